//! Where a store is.

use std::ffi::OsStr;
use std::sync::Arc;

use object_store::http::HttpBuilder;
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::{ClientOptions, ObjectStore, RetryConfig};

use crate::seen::Reach;
use crate::web::Web;
use crate::{FetchError, FetchOptions};

/// The store of a location, and where it lies inside of what `object_store` opens.
pub(crate) struct Place {
    pub(crate) store: Arc<dyn ObjectStore>,
    pub(crate) reach: Reach,
    prefix: Path,
}

impl Place {
    /// Opens a folder, or a URL of scheme `file`, `http`, `https` or `s3`. Nothing is asked for yet.
    pub(crate) fn open(location: &OsStr, options: &FetchOptions) -> Result<Place, FetchError> {
        let bad =
            |reason: String| FetchError::BadLocation { location: location.to_string_lossy().into_owned(), reason };
        let text = location.to_str().unwrap_or_default();
        let Some((scheme, rest)) = text.split_once("://") else { return folder(location).map_err(bad) };
        match scheme.to_ascii_lowercase().as_str() {
            "file" => folder(OsStr::new(rest)).map_err(bad),
            "http" => web(text, options).map_err(bad),
            #[cfg(feature = "cloud")]
            "https" => web(text, options).map_err(bad),
            #[cfg(feature = "cloud")]
            "s3" => s3(text, options).map_err(bad),
            #[cfg(not(feature = "cloud"))]
            "https" | "s3" => Err(bad(format!("{scheme} needs the cargo feature `cloud` of brickfield-fetch"))),
            _ => Err(bad(format!("scheme {scheme} is none of file, http, https, s3"))),
        }
    }

    /// The path of a key.
    pub(crate) fn path(&self, key: &str) -> Result<Path, FetchError> {
        let bad = |reason: String| FetchError::BadKey { key: key.to_owned(), reason };
        if key.is_empty() || key.starts_with('/') || key.ends_with('/') {
            return Err(bad("a key is a path of names with one / between two".to_owned()));
        }
        let path = Path::parse(key).map_err(|e| bad(e.to_string()))?;
        Ok(self.prefix.parts().chain(path.parts()).collect())
    }
}

fn folder(folder: &OsStr) -> Result<Place, String> {
    let path = std::path::Path::new(folder);
    if !path.is_dir() {
        return Err("there is no such folder".to_owned());
    }
    let store = LocalFileSystem::new_with_prefix(path).map_err(|e| e.to_string())?;
    Ok(Place { store: Arc::new(store), reach: Reach::Folder, prefix: Path::ROOT })
}

fn web(url: &str, options: &FetchOptions) -> Result<Place, String> {
    let builder = HttpBuilder::new().with_url(url).with_client_options(plain_allowed()).with_retry(no_retry());
    let store = builder.with_http_connector(connector(options)).build().map_err(|e| e.to_string())?;
    Ok(Place { store: Arc::new(store), reach: Reach::Network, prefix: Path::ROOT })
}

/// Credentials, region and endpoint come from the environment (`AWS_...`).
#[cfg(feature = "cloud")]
fn s3(url: &str, options: &FetchOptions) -> Result<Place, String> {
    let key = url.splitn(4, '/').nth(3).unwrap_or_default();
    let prefix = Path::parse(key).map_err(|e| e.to_string())?;
    let builder = object_store::aws::AmazonS3Builder::from_env().with_url(url).with_retry(no_retry());
    let builder = builder.with_client_options(plain_allowed()).with_http_connector(connector(options));
    let store = builder.build().map_err(|e| e.to_string())?;
    Ok(Place { store: Arc::new(store), reach: Reach::Network, prefix })
}

fn connector(options: &FetchOptions) -> Web {
    Web { connect_timeout: options.timeout }
}

fn plain_allowed() -> ClientOptions {
    ClientOptions::new().with_allow_http(true)
}

/// Attempts are the client's own, so that they are counted and end in its errors.
fn no_retry() -> RetryConfig {
    RetryConfig { max_retries: 0, ..RetryConfig::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(location: &str) -> String {
        Place::open(OsStr::new(location), &FetchOptions::default()).err().unwrap().to_string()
    }

    #[test]
    fn a_location_that_cannot_be_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let gone = folder.path().join("gone");
        assert!(refused(gone.to_str().unwrap()).ends_with("gone: there is no such folder"));
        assert_eq!(
            refused("ftp://host/store"),
            "cannot fetch from ftp://host/store: scheme ftp is none of file, http, https, s3"
        );
        assert!(refused("http://").starts_with("cannot fetch from http://: "));
        #[cfg(not(feature = "cloud"))]
        assert!(refused("s3://bucket/store").contains("`cloud`"));
    }

    #[test]
    fn a_key_that_leads_out_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let place = Place::open(folder.path().as_os_str(), &FetchOptions::default()).unwrap();
        for key in ["", "/a", "a/", "a//b", "../a", "a/../b", "a/./b"] {
            assert!(matches!(place.path(key), Err(FetchError::BadKey { .. })), "{key}");
        }
        assert_eq!(place.path("0/c/1/0/2").unwrap().as_ref(), "0/c/1/0/2");
    }

    #[cfg(feature = "cloud")]
    #[test]
    fn the_path_of_an_s3_url_is_before_every_key() {
        let place = Place::open(OsStr::new("s3://bucket/a/store"), &FetchOptions::default()).unwrap();
        assert_eq!(place.path("0/c/1").unwrap().as_ref(), "a/store/0/c/1");
    }
}
