//! The files of a folder, and nothing beside it.

use std::ffi::OsStr;
use std::fs::Metadata;
use std::io;
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::sync::Arc;

use tower_http::services::fs::{Backend, TokioBackend, TokioFile};

/// Files inside of a folder, for `ServeDir`: no folders, no names with a dot, no links that lead outside.
#[derive(Debug, Clone)]
pub(crate) struct Inside {
    /// Without links.
    root: Arc<Path>,
}

impl Inside {
    pub(crate) fn new(folder: &Path) -> io::Result<Inside> {
        let root = folder.canonicalize()?;
        if !root.is_dir() {
            return Err(io::ErrorKind::NotADirectory.into());
        }
        Ok(Inside { root: root.into() })
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// The file that a path leads to, without links.
    fn resolve(&self, path: &Path) -> io::Result<PathBuf> {
        let file = path.canonicalize()?;
        let is_served = |path: &Path| match path.strip_prefix(&self.root) {
            Ok(inside) => inside.iter().all(is_served_name),
            Err(_) => false,
        };
        // A pipe or a device would not end, or would not begin.
        match is_served(path) && is_served(&file) && file.metadata()?.is_file() {
            true => Ok(file),
            false => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

/// Names that begin with a dot are of stores that are not complete, or of nobody's concern; but Zarr v2 has its metadata there.
fn is_served_name(name: &OsStr) -> bool {
    let zarr = [".zarray", ".zattrs", ".zgroup", ".zmetadata"];
    !name.as_encoded_bytes().starts_with(b".") || zarr.iter().any(|z| name == *z)
}

/// A file that may not be read is there: `ServeDir` would answer 404, and a viewer would draw a hole.
fn not_absent(error: io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::PermissionDenied => io::Error::other(error),
        _ => error,
    }
}

type Later<T> = Pin<Box<dyn Future<Output = io::Result<T>> + Send>>;

impl Backend for Inside {
    type File = TokioFile;
    type Metadata = Metadata;
    type OpenFuture = Later<TokioFile>;
    type MetadataFuture = Later<Metadata>;

    fn open(&self, path: PathBuf) -> Later<TokioFile> {
        let inside = self.clone();
        Box::pin(async move {
            let file = tokio::task::spawn_blocking(move || inside.resolve(&path)).await?.map_err(not_absent)?;
            TokioBackend.open(file).await.map_err(not_absent)
        })
    }

    fn metadata(&self, path: PathBuf) -> Later<Metadata> {
        let inside = self.clone();
        let metadata = move || inside.resolve(&path).and_then(|file| file.metadata()).map_err(not_absent);
        Box::pin(async move { tokio::task::spawn_blocking(metadata).await? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_not_be_read_is_not_told_to_be_absent() {
        let kinds =
            [io::ErrorKind::PermissionDenied, io::ErrorKind::NotFound].map(|kind| not_absent(kind.into()).kind());
        assert_eq!(kinds, [io::ErrorKind::Other, io::ErrorKind::NotFound]);
    }

    #[test]
    fn names_with_a_dot_are_not_served_unless_zarr_has_them() {
        let served = ["zarr.json", "c", "0", "a.b", ".zattrs", ".zgroup", ".zarray", ".zmetadata"];
        assert!(served.iter().all(|name| is_served_name(OsStr::new(name))));
        let not = [".", "..", ".git", ".store.zarr.part", ".zarr", ".zattrs2"];
        assert!(not.iter().all(|name| !is_served_name(OsStr::new(name))));
    }
}
