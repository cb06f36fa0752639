//! The files of a folder and of those in it, as far down as CDs and archives of studies go.

use std::io;
use std::path::Path;

use crate::ReadError;

/// Patient, study, series, and room for those who sort further.
const MAX_DEPTH: usize = 8;
/// Most files and folders that are looked at.
const MAX_ENTRIES: usize = 1 << 17;

/// Calls `visit` for every regular file, by its path below `folder` with slashes: the files of a folder in the order of
/// their names, then those of its sub-folders. Links to folders are not followed.
///
/// # Errors
/// If there are more than [`MAX_ENTRIES`], or as `visit` does.
pub(crate) fn visit_files<B>(
    folder: &Path,
    visit: &mut dyn FnMut(&str) -> Result<Option<B>, ReadError>,
) -> Result<Option<B>, ReadError> {
    let mut n_entries = 0;
    descend(folder, "", 0, &mut n_entries, visit)
}

fn descend<B>(
    folder: &Path,
    below: &str,
    depth: usize,
    n_entries: &mut usize,
    visit: &mut dyn FnMut(&str) -> Result<Option<B>, ReadError>,
) -> Result<Option<B>, ReadError> {
    let Entries { files, folders } = entries(&folder.join(below)).map_err(|e| ReadError::io("the folder", e))?;
    *n_entries += files.len() + folders.len();
    if *n_entries > MAX_ENTRIES {
        return Err(ReadError::field("entries of the folder", *n_entries, format!("at most {MAX_ENTRIES}")));
    }
    let path = |name: &String| if below.is_empty() { name.clone() } else { format!("{below}/{name}") };
    for file in files.iter().map(path) {
        if let Some(found) = visit(&file)? {
            return Ok(Some(found));
        }
    }
    for inner in folders.iter().map(path).filter(|_| depth < MAX_DEPTH) {
        if let Some(found) = descend(folder, &inner, depth + 1, n_entries, visit)? {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

#[derive(Default)]
struct Entries {
    files: Vec<String>,
    folders: Vec<String>,
}

/// The names of a folder's files and folders, in order.
fn entries(folder: &Path) -> io::Result<Entries> {
    let mut entries = Entries::default();
    for entry in folder.read_dir()? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.file_type()?.is_dir() {
            entries.folders.push(name);
        } else if entry.path().is_file() {
            entries.files.push(name);
        }
    }
    entries.files.sort();
    entries.folders.sort();
    Ok(entries)
}
