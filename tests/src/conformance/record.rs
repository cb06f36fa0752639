//! A record of all answers of a run, and the comparison of a later run with it: which pictures has a change of the code changed?
//!
//! The file is one gzip stream of entries. An entry is a line of JSON ([`AnswerHeader`]) and the answer's bytes. The values are f32,
//! little-endian, four a pixel, x varies fastest, rows from the top. All first bytes of the values come first, then all second
//! bytes, and so on: signs and exponents are alike, so gzip packs them well. An answer that is equal to an earlier one is an
//! entry without bytes; its digest names the bytes.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use brickfield_core::glam::UVec2;
use flate2::Compression;
use flate2::bufread::GzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};

/// A backend's answer to a case: a picture, or a function's outputs as a picture of one row.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordEntry {
    /// The case.
    pub case: String,
    /// backend@adapter.
    pub backend: String,
    /// Columns and rows.
    pub size: UVec2,
    /// Rows from the top.
    pub values: Vec<[f32; 4]>,
}

/// Why a record cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum RecordError {
    #[error("record {}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("record {}: entry {entry} is damaged: {reason}", path.display())]
    Damaged { path: PathBuf, entry: usize, reason: &'static str },
}

/// Writes answers as they come.
pub struct RecordWriter {
    path: PathBuf,
    out: GzEncoder<BufWriter<File>>,
    stored: HashSet<String>,
}

/// The line before an answer's bytes.
#[derive(Serialize, Deserialize)]
struct AnswerHeader {
    case: String,
    backend: String,
    size: [u32; 2],
    /// FNV-1a, 64 bits, of the size and the bytes.
    digest: String,
    n_bytes: usize,
}

/// How two answers to one case differ.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Difference {
    /// Pixels that are not equal to the bit, and the greatest difference of any channel: infinite beside NaN.
    Values { n_pixels: usize, greatest: f64 },
    /// Columns and rows.
    Size { earlier: UVec2, now: UVec2 },
}

/// An earlier run, and how the answers of this one differ from it.
#[derive(Debug)]
pub struct Comparison {
    earlier: BTreeMap<(String, String), RecordEntry>,
    n_equal: usize,
    n_changed: usize,
    n_new: usize,
    n_gone: usize,
}

impl RecordWriter {
    /// Creates the file, or replaces it.
    ///
    /// # Errors
    /// A file that cannot be created.
    pub fn create(path: &Path) -> Result<RecordWriter, RecordError> {
        let file = File::create(path).map_err(|source| RecordError::Io { path: path.to_owned(), source })?;
        let out = GzEncoder::new(BufWriter::new(file), Compression::default());
        Ok(RecordWriter { path: path.to_owned(), out, stored: HashSet::new() })
    }

    /// Appends an answer.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&mut self, answer: &RecordEntry) -> Result<(), RecordError> {
        let digest = format!("{:016x}", digest(answer));
        let bytes = if self.stored.insert(digest.clone()) { planes(&answer.values) } else { Vec::new() };
        let header = AnswerHeader {
            case: answer.case.clone(),
            backend: answer.backend.clone(),
            size: answer.size.to_array(),
            digest,
            n_bytes: bytes.len(),
        };
        let line = serde_json::to_string(&header).expect("a header is plain data");
        let written = writeln!(self.out, "{line}").and_then(|()| self.out.write_all(&bytes));
        written.map_err(|source| RecordError::Io { path: self.path.clone(), source })
    }

    /// Completes the file; its size in bytes.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(self) -> Result<u64, RecordError> {
        let finished = self.out.finish().and_then(|mut out| out.flush().map(|()| out));
        let size = finished.and_then(|out| out.get_ref().metadata()).map(|metadata| metadata.len());
        size.map_err(|source| RecordError::Io { path: self.path, source })
    }
}

/// All answers of a record.
///
/// # Errors
/// A file that cannot be read, or that is no record.
pub fn read_record(path: &Path) -> Result<Vec<RecordEntry>, RecordError> {
    let io = |source| RecordError::Io { path: path.to_owned(), source };
    let mut input = BufReader::new(GzDecoder::new(BufReader::new(File::open(path).map_err(io)?)));
    let (mut answers, mut stored) = (Vec::new(), HashMap::<String, usize>::new());
    let mut line = String::new();
    while input.read_line(&mut line).map_err(io)? > 0 {
        let damaged = |reason| RecordError::Damaged { path: path.to_owned(), entry: answers.len(), reason };
        let header: AnswerHeader =
            serde_json::from_str(&line).map_err(|_| damaged("its header is no JSON of a header"))?;
        let answer = entry(&header, &mut input, &stored, &answers).map_err(io)?;
        let answer = answer.ok_or_else(|| damaged("it has neither bytes for its size nor an earlier entry's"))?;
        if header.digest != format!("{:016x}", digest(&answer)) {
            return Err(damaged("its digest is not that of its bytes"));
        }
        stored.entry(header.digest).or_insert(answers.len());
        answers.push(answer);
        line.clear();
    }
    Ok(answers)
}

/// The answer that follows a header; `None` if there are not as many bytes as its size asks for.
fn entry(
    header: &AnswerHeader,
    input: &mut impl Read,
    stored: &HashMap<String, usize>,
    answers: &[RecordEntry],
) -> io::Result<Option<RecordEntry>> {
    let mut bytes = Vec::new();
    input.take(header.n_bytes as u64).read_to_end(&mut bytes)?;
    let values = match stored.get(&header.digest) {
        Some(i) if header.n_bytes == 0 => answers[*i].values.clone(),
        _ => from_planes(&bytes),
    };
    let n_pixels = header.size.iter().map(|n| *n as usize).product::<usize>();
    let AnswerHeader { case, backend, size, .. } = header;
    let answer = RecordEntry { case: case.clone(), backend: backend.clone(), size: (*size).into(), values };
    Ok((bytes.len() == header.n_bytes && answer.values.len() == n_pixels).then_some(answer))
}

fn planes(values: &[[f32; 4]]) -> Vec<u8> {
    let bytes: Vec<[u8; 4]> = values.as_flattened().iter().map(|v| v.to_le_bytes()).collect();
    (0..4).flat_map(|plane| bytes.iter().map(move |b| b[plane])).collect()
}

fn from_planes(bytes: &[u8]) -> Vec<[f32; 4]> {
    let n = bytes.len() / 4;
    let value = |i: usize| f32::from_le_bytes([0, 1, 2, 3].map(|plane| bytes[plane * n + i]));
    (0..n / 4).map(|pixel| [0, 1, 2, 3].map(|c| value(4 * pixel + c))).collect()
}

/// FNV-1a over size and values.
fn digest(answer: &RecordEntry) -> u64 {
    let size = answer.size.to_array().into_iter().flat_map(u32::to_le_bytes);
    let values = answer.values.as_flattened().iter().flat_map(|v| v.to_le_bytes());
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    size.chain(values).fold(0xcbf2_9ce4_8422_2325, mix)
}

impl Comparison {
    /// With an earlier run's answers.
    pub fn with(earlier: Vec<RecordEntry>) -> Comparison {
        let earlier = earlier.into_iter().map(|a| ((a.case.clone(), a.backend.clone()), a)).collect();
        Comparison { earlier, n_equal: 0, n_changed: 0, n_new: 0, n_gone: 0 }
    }

    /// Holds an answer against the earlier run's; a line about it unless both are equal to the bit.
    pub fn hold(&mut self, now: &RecordEntry) -> Option<String> {
        let name = format!("{:<36} {}", now.case, now.backend);
        let Some(earlier) = self.earlier.remove(&(now.case.clone(), now.backend.clone())) else {
            self.n_new += 1;
            return Some(format!("{:<11} {name}", "new"));
        };
        let Some(difference) = difference(&earlier, now) else {
            self.n_equal += 1;
            return None;
        };
        self.n_changed += 1;
        Some(format!("{:<11} {name}  {difference}", "changed"))
    }

    /// A line for each answer of the earlier run that this run should have given, too, and has not.
    pub fn gone(&mut self, should_be_here: impl Fn(&RecordEntry) -> bool) -> Vec<String> {
        let gone = self.earlier.values().filter(|a| should_be_here(a));
        let lines: Vec<String> = gone.map(|a| format!("{:<11} {:<36} {}", "gone", a.case, a.backend)).collect();
        self.n_gone += lines.len();
        lines
    }

    /// Whether an answer has changed.
    pub fn has_changes(&self) -> bool {
        self.n_changed > 0
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Comparison { n_equal, n_changed, n_new, n_gone, .. } = self;
        write!(f, "{n_changed} pictures changed, {n_new} new, {n_gone} gone, {n_equal} equal to the bit")
    }
}

/// How two answers differ, if they do.
fn difference(earlier: &RecordEntry, now: &RecordEntry) -> Option<Difference> {
    if earlier.size != now.size {
        return Some(Difference::Size { earlier: earlier.size, now: now.size });
    }
    let pairs = earlier.values.iter().zip(&now.values);
    let unequal: Vec<_> = pairs.filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits)).collect();
    let channels = unequal.iter().flat_map(|(a, b)| a.iter().zip(*b)).filter(|(a, b)| a.to_bits() != b.to_bits());
    let apart = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).abs();
    let greatest = channels.map(apart).map(|d| if d.is_nan() { f64::INFINITY } else { d }).fold(0.0, f64::max);
    (!unequal.is_empty()).then_some(Difference::Values { n_pixels: unequal.len(), greatest })
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Difference::Values { n_pixels, greatest } => write!(f, "{n_pixels} pixels, by up to {greatest:.2e}"),
            Difference::Size { earlier, now } => {
                write!(f, "{} x {} pixels, earlier {} x {}", now.x, now.y, earlier.x, earlier.y)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(case: &str, backend: &str, values: &[f32]) -> RecordEntry {
        let values: Vec<[f32; 4]> = values.iter().map(|v| [*v, 0.5, -0.0, 1.0]).collect();
        RecordEntry { case: case.into(), backend: backend.into(), size: UVec2::new(values.len() as u32, 1), values }
    }

    fn written(folder: &Path, answers: &[RecordEntry]) -> PathBuf {
        let path = folder.join("record");
        let mut writer = RecordWriter::create(&path).unwrap();
        answers.iter().for_each(|a| writer.write(a).unwrap());
        assert!(writer.finish().unwrap() > 0);
        path
    }

    #[test]
    fn a_record_holds_answers_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let odd = [f32::MIN_POSITIVE / 2.0, -0.0, f32::INFINITY, 1.0 / 3.0];
        let answers = [answer("a", "cpu", &odd), answer("b", "wgpu", &[1.0]), answer("b", "ash", &[1.0])];
        let read = read_record(&written(folder.path(), &answers)).unwrap();
        assert_eq!(read, answers);
        assert_eq!(digest(&read[1]), digest(&read[2]));
        let other = folder.path().join("other");
        std::fs::write(&other, "no gzip").unwrap();
        assert!(matches!(read_record(&other), Err(RecordError::Io { .. })));
    }

    #[test]
    fn a_comparison_tells_changed_new_gone_and_equal() {
        let folder = tempfile::tempdir().unwrap();
        let earlier = [
            answer("equal", "cpu", &[0.25, 0.5]),
            answer("changed", "cpu", &[0.25, 0.5, 1.0]),
            answer("sign", "cpu", &[0.0]),
            answer("nan", "cpu", &[0.0, 0.0]),
            answer("size", "cpu", &[0.0]),
            answer("gone", "cpu", &[0.0]),
            answer("not-run", "cpu", &[0.0]),
        ];
        let mut comparison = Comparison::with(read_record(&written(folder.path(), &earlier)).unwrap());
        let mut line = |now: RecordEntry| comparison.hold(&now).unwrap_or_default();
        assert_eq!(line(answer("equal", "cpu", &[0.25, 0.5])), "");
        assert!(line(answer("changed", "cpu", &[0.25, 0.625, 1.0])).ends_with("1 pixels, by up to 1.25e-1"));
        assert!(line(answer("sign", "cpu", &[-0.0])).ends_with("1 pixels, by up to 0.00e0"));
        assert!(line(answer("nan", "cpu", &[f32::NAN, 0.5])).ends_with("2 pixels, by up to inf"));
        assert!(line(answer("size", "cpu", &[0.0, 0.0])).ends_with("2 x 1 pixels, earlier 1 x 1"));
        assert!(line(answer("equal", "ash", &[0.25, 0.5])).starts_with("new"));
        assert_eq!(comparison.gone(|a| a.case != "not-run").len(), 1);
        assert!(comparison.has_changes());
        assert_eq!(comparison.to_string(), "4 pictures changed, 1 new, 1 gone, 1 equal to the bit");
    }
}
