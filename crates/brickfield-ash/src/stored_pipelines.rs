//! A file that keeps compiled pipelines from one process to the next.

use std::fmt;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use brickfield_frame::RenderError;

use crate::vulkan::{Device, PipelineIdentity};

/// What came of a file of pipelines ([`Options::pipelines`](crate::Options::pipelines)) when the backend was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PipelineFile {
    /// There was none: it is written when the backend goes.
    New,
    /// Its pipelines are in use.
    Read {
        /// Bytes of them.
        n_bytes: u64,
    },
    /// It is of another device or driver, damaged, or not readable: pipelines are compiled anew, and the file is written again.
    Ignored {
        /// The reason.
        reason: String,
    },
}

impl fmt::Display for PipelineFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PipelineFile::New => f.write_str("new"),
            PipelineFile::Read { n_bytes } => write!(f, "{n_bytes} bytes read"),
            PipelineFile::Ignored { reason } => write!(f, "ignored: {reason}"),
        }
    }
}

/// The file, written when it is dropped if there is more to keep than it has.
pub(crate) struct StoredPipelines {
    device: Arc<Device>,
    path: PathBuf,
    file: PipelineFile,
    /// What the file has; empty if nothing of use.
    stored: Vec<u8>,
}

const MAGIC: [u8; 8] = *b"bfpipe01";
/// Magic, identity, length and checksum of the data.
const HEADER: usize = MAGIC.len() + PipelineIdentity::BYTES + 8 + 4;
/// Longer files are not pipelines of ours.
const MOST_BYTES: u64 = 256 << 20;

impl StoredPipelines {
    /// Gives the device what a file has for it.
    pub(crate) fn open(device: &Arc<Device>, path: &Path) -> StoredPipelines {
        let (file, stored) = match read(path).and_then(|bytes| bytes.map(|b| decode(&device.identity(), b)).transpose())
        {
            Ok(None) => (PipelineFile::New, Vec::new()),
            Ok(Some(data)) => match device.add_pipelines(&data) {
                Ok(()) => (PipelineFile::Read { n_bytes: data.len() as u64 }, data),
                Err(e) => (PipelineFile::Ignored { reason: e.to_string() }, Vec::new()),
            },
            Err(reason) => (PipelineFile::Ignored { reason }, Vec::new()),
        };
        StoredPipelines { device: Arc::clone(device), path: path.to_owned(), file, stored }
    }

    /// What came of the file.
    pub(crate) fn file(&self) -> &PipelineFile {
        &self.file
    }

    /// Writes the file, if there is more to keep than it has.
    pub(crate) fn save(&mut self) -> Result<(), SaveError> {
        let data = self.device.pipelines()?;
        if data != self.stored {
            write(&self.path, &encode(&self.device.identity(), &data))
                .map_err(|source| SaveError::File { path: self.path.clone(), source })?;
            self.stored = data;
        }
        Ok(())
    }
}

impl Drop for StoredPipelines {
    /// A file that cannot be written costs time in the next process, and nothing else: who wants to know calls `save`.
    fn drop(&mut self) {
        drop(self.save());
    }
}

/// Why pipelines were not kept.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum SaveError {
    #[error(transparent)]
    Device(#[from] RenderError),
    #[error("{}: {source}", path.display())]
    File { path: PathBuf, source: io::Error },
}

fn encode(identity: &PipelineIdentity, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + data.len());
    bytes.extend(MAGIC);
    bytes.extend(identity.to_bytes());
    bytes.extend((data.len() as u64).to_le_bytes());
    bytes.extend(crc32c::crc32c(data).to_le_bytes());
    bytes.extend(data);
    bytes
}

/// The data of a file, or the reason why they are of no use. Drivers trust what they are given: they get no byte that they did not write.
fn decode(identity: &PipelineIdentity, mut bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let Some((header, data)) = bytes.split_at_checked(HEADER) else {
        return Err(format!("{} bytes; a file of pipelines has {HEADER} at least", bytes.len()));
    };
    let (magic, rest) = header.split_at(MAGIC.len());
    let (whose, rest) = rest.split_at(PipelineIdentity::BYTES);
    let (length, checksum) = rest.split_at(8);
    if magic != MAGIC {
        return Err("no file of pipelines, or one of another version".to_owned());
    }
    if whose != identity.to_bytes() {
        return Err("pipelines of another device or driver".to_owned());
    }
    let length = u64::from_le_bytes(length.try_into().expect("eight bytes"));
    if length != data.len() as u64 {
        return Err(format!("{} bytes of pipelines; the header says {length}", data.len()));
    }
    if checksum != crc32c::crc32c(data).to_le_bytes() {
        return Err("damaged: the checksum differs".to_owned());
    }
    Ok(bytes.split_off(HEADER))
}

fn read(path: &Path) -> Result<Option<Vec<u8>>, String> {
    let file = match fs::File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        opened => opened.map_err(|e| e.to_string())?,
    };
    let mut bytes = Vec::new();
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    match bytes.len() as u64 {
        n if n > MOST_BYTES => Err(format!("more than {MOST_BYTES} bytes")),
        _ => Ok(Some(bytes)),
    }
}

/// Beside the file first, so that it is never half there.
fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(format!(".{}", std::process::id()));
    let beside = PathBuf::from(beside);
    let written = fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, path));
    if written.is_err() {
        drop(fs::remove_file(&beside));
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: PipelineIdentity = PipelineIdentity { vendor: 1, device: 2, driver: 3, uuid: [4; 16] };

    #[test]
    fn what_was_encoded_is_decoded_and_nothing_else() {
        let (data, bytes) = (vec![7; 100], encode(&OURS, &[7; 100]));
        assert_eq!(decode(&OURS, bytes.clone()), Ok(data));
        for identity in [
            PipelineIdentity { vendor: 9, ..OURS },
            PipelineIdentity { device: 9, ..OURS },
            PipelineIdentity { driver: 9, ..OURS },
            PipelineIdentity { uuid: [9; 16], ..OURS },
        ] {
            assert_eq!(decode(&identity, bytes.clone()), Err("pipelines of another device or driver".to_owned()));
        }
        for n in 0..bytes.len() {
            assert!(decode(&OURS, bytes[..n].to_vec()).is_err(), "{n} bytes");
            let mut flipped = bytes.clone();
            flipped[n] ^= 1;
            assert!(decode(&OURS, flipped).is_err(), "byte {n}");
        }
        assert!(decode(&OURS, [bytes, vec![0]].concat()).is_err());
    }
}
