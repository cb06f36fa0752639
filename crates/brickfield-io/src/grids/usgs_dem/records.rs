//! The records of a USGS DEM: fields of fixed width, right-aligned, blank where they are not stated.

use std::io::{Read, SeekFrom};

use brickfield_core::glam::DVec2;

use crate::ReadError;
use crate::files::ByteSource;
use crate::grids::geographic::Horizontal;
use crate::grids::plot3d::real;

const RECORD_BYTES: u64 = 1024;
/// Bytes of the fields of a type A record that are read.
const A_BYTES: usize = 864;
/// Bytes of a type B record before its samples.
const B_HEADER_BYTES: u64 = 144;
const SAMPLE_BYTES: u64 = 6;
/// Samples in the first record of a profile, and in those after it.
const N_FIRST: u64 = 146;
const N_NEXT: u64 = 170;

/// The record about the whole.
#[derive(Clone, Debug)]
pub(super) struct RecordA {
    pub(super) horizontal: Horizontal,
    /// Of eastings and northings; seconds of arc are degrees as [`Horizontal`] has it.
    pub(super) unit: &'static str,
    pub(super) elevation_unit: &'static str,
    /// Units between profiles, and between samples of a profile.
    pub(super) resolution: DVec2,
    /// Units of elevation for a sample of 1.
    pub(super) elevation_step: f64,
    pub(super) n_profiles: u64,
}

/// A profile: its first sample, and where the samples are in the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Profile {
    pub(super) n_samples: u64,
    pub(super) start: DVec2,
    /// The elevation of sample 0.
    pub(super) datum: f64,
    position: u64,
}

impl RecordA {
    pub(super) fn read(records: &mut Records) -> Result<RecordA, ReadError> {
        let bytes = records.bytes(0, A_BYTES as u64, "the record of type A")?;
        let fields = Fields { bytes: &bytes, record: "record A" };
        check_code(fields.integer(150..156, "pattern")?, 1, "pattern", "1, regular profiles, is")?;
        check_code(fields.integer(852..858, "rows of profiles")?, 1, "rows of profiles", "1 is")?;
        let angle = fields.real(786..810, "angle")?.unwrap_or(0.0);
        if angle != 0.0 {
            return Err(ReadError::unsupported("angle of the profiles", angle, "0 is"));
        }
        let reference = fields.integer(156..162, "reference system")?;
        let (horizontal, unit) = match (reference, fields.integer(528..534, "unit of positions")?) {
            (Some(0), Some(3)) => (Horizontal::Degrees, "m"),
            (Some(1..), Some(1)) => (Horizontal::Lengths, "ft"),
            (Some(1..), Some(2)) => (Horizontal::Lengths, "m"),
            (reference, unit) => {
                let value = format!("{} in unit {}", stated(reference), stated(unit));
                let supported = "0 (geographic) in 3 (seconds of arc), others in 1 (feet) and 2 (metres) are";
                return Err(ReadError::unsupported("reference system", value, supported));
            }
        };
        let elevation_unit = match fields.integer(534..540, "unit of elevations")? {
            Some(1) => "ft",
            Some(2) => "m",
            other => return Err(ReadError::field("unit of elevations", stated(other), "1 (feet) or 2 (metres)")),
        };
        let above_0 = |place, name: &'static str| {
            let value = fields.real(place, name)?;
            let usable = value.filter(|v| v.is_finite() && *v > 0.0);
            usable.ok_or_else(|| ReadError::field(name, value.map_or("blank".to_owned(), |v| v.to_string()), "above 0"))
        };
        let n_profiles = fields.integer(858..864, "number of profiles")?.unwrap_or(0);
        let n_records = records.n_file_bytes / RECORD_BYTES;
        let in_range = u64::try_from(n_profiles).ok().filter(|n| (1..=n_records).contains(n));
        Ok(RecordA {
            horizontal,
            unit,
            elevation_unit,
            resolution: DVec2::new(above_0(816..828, "resolution of x")?, above_0(828..840, "resolution of y")?),
            elevation_step: above_0(840..852, "resolution of z")?,
            n_profiles: in_range.ok_or_else(|| {
                let expected = format!("1 to {n_records}, the file's records of 1024 bytes");
                ReadError::field("number of profiles", n_profiles, expected)
            })?,
        })
    }
}

fn check_code(found: Option<i64>, supported: i64, what: &'static str, are: &'static str) -> Result<(), ReadError> {
    match found == Some(supported) {
        true => Ok(()),
        false => Err(ReadError::unsupported(what, stated(found), are)),
    }
}

fn stated(value: Option<i64>) -> String {
    value.map_or("blank".to_owned(), |value| value.to_string())
}

/// Whether a file begins with a record of type A: its codes are where they have to be.
pub(crate) fn has_record_a(head: &[u8]) -> bool {
    let Some(bytes) = head.get(..A_BYTES) else { return false };
    let fields = Fields { bytes, record: "record A" };
    let code = |place, most: i64| matches!(fields.integer(place, ""), Ok(Some(code)) if (0..=most).contains(&code));
    let is_code = code(144..150, 4) && code(150..156, 2) && code(528..534, 3) && code(534..540, 2);
    is_code && bytes.iter().all(|b| b.is_ascii_graphic() || *b == b' ') && fields.real(816..828, "").is_ok()
}

/// The file, record after record.
pub(super) struct Records<'a> {
    source: &'a mut dyn ByteSource,
    n_file_bytes: u64,
    /// Where the next profile begins.
    next: u64,
}

impl<'a> Records<'a> {
    pub(super) fn new(source: &'a mut dyn ByteSource, n_file_bytes: u64) -> Records<'a> {
        Records { source, n_file_bytes, next: RECORD_BYTES }
    }

    /// The next profile without its samples, which are there.
    pub(super) fn profile(&mut self, i: u64, n_profiles: u64) -> Result<Profile, ReadError> {
        let what = format!("profile {} of {n_profiles}", i + 1);
        let position = self.next;
        let bytes = self.bytes(position, B_HEADER_BYTES, &what)?;
        let fields = Fields { bytes: &bytes, record: &what };
        check_code(fields.integer(18..24, "columns")?, 1, "columns of a profile", "1 is")?;
        let n_samples = fields.integer(12..18, "number of samples")?.unwrap_or(0);
        let in_range = u64::try_from(n_samples).ok().filter(|n| *n >= 1);
        let n_samples = in_range
            .ok_or_else(|| ReadError::field(format!("number of samples of {what}"), n_samples, "at least 1"))?;
        let n_more_records = n_samples.saturating_sub(N_FIRST).div_ceil(N_NEXT);
        let end = position + B_HEADER_BYTES + place_of(n_samples - 1) + SAMPLE_BYTES;
        if end > self.n_file_bytes {
            return Err(ReadError::EndsWithin { part: what, n_file_bytes: self.n_file_bytes, end: Some(end) });
        }
        self.next = position + RECORD_BYTES * (1 + n_more_records);
        let coordinate = |place, name: &str| {
            let value = fields.real(place, name)?.filter(|v| v.is_finite());
            value.ok_or_else(|| ReadError::field(format!("{name} of {what}"), "blank or infinite", "a number"))
        };
        let start = DVec2::new(coordinate(24..48, "easting")?, coordinate(48..72, "northing")?);
        let datum = fields.real(72..96, "datum")?.unwrap_or(0.0);
        Ok(Profile { n_samples, start, datum, position })
    }

    /// The samples of a profile, each with its place in it; `i` counts profiles from 0.
    pub(super) fn samples(
        &mut self,
        i: usize,
        profile: &Profile,
        put: &mut dyn FnMut(usize, i32),
    ) -> Result<(), ReadError> {
        let what = format!("profile {}", i + 1);
        let start = profile.position + B_HEADER_BYTES;
        let bytes = self.bytes(start, place_of(profile.n_samples - 1) + SAMPLE_BYTES, &what)?;
        let fields = Fields { bytes: &bytes, record: &what };
        for k in 0..profile.n_samples {
            let at = place_of(k) as usize;
            let sample = fields.integer(at..at + SAMPLE_BYTES as usize, "a sample")?;
            // Six characters.
            let sample =
                sample.ok_or_else(|| ReadError::field(format!("sample {} of {what}", k + 1), "", "a number"))?;
            put(k as usize, sample as i32);
        }
        Ok(())
    }

    fn bytes(&mut self, start: u64, n_bytes: u64, what: &str) -> Result<Vec<u8>, ReadError> {
        let end = start.saturating_add(n_bytes);
        if end > self.n_file_bytes {
            let part = what.to_owned();
            return Err(ReadError::EndsWithin { part, n_file_bytes: self.n_file_bytes, end: Some(end) });
        }
        let fault = |e| ReadError::io(what, e);
        self.source.seek(SeekFrom::Start(start)).map_err(fault)?;
        let mut bytes = Vec::new();
        (&mut *self.source).take(n_bytes).read_to_end(&mut bytes).map_err(fault)?;
        bytes.resize(n_bytes as usize, 0);
        Ok(bytes)
    }
}

/// Bytes from the first sample of a profile to another: each record has four spare bytes at its end.
fn place_of(sample: u64) -> u64 {
    match sample.checked_sub(N_FIRST) {
        None => sample * SAMPLE_BYTES,
        Some(rest) => RECORD_BYTES - B_HEADER_BYTES + rest / N_NEXT * RECORD_BYTES + rest % N_NEXT * SAMPLE_BYTES,
    }
}

/// A record, and its name in messages.
struct Fields<'a> {
    bytes: &'a [u8],
    record: &'a str,
}

impl Fields<'_> {
    /// Nothing where it is blank.
    fn integer(&self, place: std::ops::Range<usize>, name: &str) -> Result<Option<i64>, ReadError> {
        self.parsed(place, name, "an integer", |text| text.parse().ok())
    }

    /// Nothing where it is blank.
    fn real(&self, place: std::ops::Range<usize>, name: &str) -> Result<Option<f64>, ReadError> {
        self.parsed(place, name, "a number", real)
    }

    fn parsed<T>(
        &self,
        place: std::ops::Range<usize>,
        name: &str,
        expected: &str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<Option<T>, ReadError> {
        let text = String::from_utf8_lossy(&self.bytes[place]);
        match text.trim() {
            "" => Ok(None),
            text => match parse(text) {
                Some(value) => Ok(Some(value)),
                None => Err(ReadError::field(format!("{name} of {}", self.record), text, expected)),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_leave_four_bytes_of_each_record() {
        assert_eq!(place_of(145), 145 * 6);
        assert_eq!(B_HEADER_BYTES + place_of(146), RECORD_BYTES);
        assert_eq!(B_HEADER_BYTES + place_of(146 + 169), RECORD_BYTES + 169 * 6);
        assert_eq!(B_HEADER_BYTES + place_of(146 + 170), 2 * RECORD_BYTES);
    }
}
