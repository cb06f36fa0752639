//! JPEG-LS (ITU-T T.87, 1998): the marker segments. Lossless and near-lossless, 2 to 16 bits, all three interleaves.
//!
//! Not: mapping tables, restart intervals, subsampled components. DICOM writers use none of them.

use super::FrameShape;
use super::jpeg_ls_scan::{Coding, Interleave, decode_scan};
use crate::ReadError;

const START: u8 = 0xd8;
const END: u8 = 0xd9;
const FRAME: u8 = 0xf7;
const PARAMETERS: u8 = 0xf8;
const SCAN: u8 = 0xda;
const RESTART_INTERVAL: u8 = 0xdd;

pub(super) fn decode(packed: &[u8], shape: &FrameShape) -> Result<Vec<u8>, ReadError> {
    let mut rest = packed.strip_prefix(&[0xff, START]).ok_or_else(|| cut_off("start"))?;
    let mut frame: Option<Frame> = None;
    let mut stated = Parameters::default();
    let mut planes: Vec<Vec<u16>> = Vec::new();
    while planes.len() < shape.n_channels {
        let (marker, segment, after) = next_segment(rest)?;
        rest = after;
        match marker {
            FRAME => frame = Some(Frame::new(segment, shape)?),
            PARAMETERS => stated = Parameters::new(segment)?,
            RESTART_INTERVAL if segment != [0, 0] => {
                return Err(ReadError::unsupported("JPEG-LS", "restart intervals", "one interval a frame is"));
            }
            SCAN => {
                let frame = frame.as_ref().ok_or_else(|| cut_off("frame header"))?;
                let scan = Scan::new(segment, frame)?;
                let coding = stated.coding(frame, scan.near)?;
                let (decoded, n_read) =
                    decode_scan(rest, &coding, scan.interleave, scan.n_components, [shape.columns, shape.rows])
                        .ok_or_else(|| cut_off("scan"))?;
                planes.extend(decoded.into_iter().map(|plane| shifted(plane, scan.n_low_bits)));
                rest = &rest[n_read..];
            }
            END => return Err(cut_off("last scan")),
            _ => {}
        }
    }
    let n_pixels = shape.columns * shape.rows;
    let sample = |i: usize| i32::from(planes[i % shape.n_channels][i / shape.n_channels]);
    Ok(shape.words((0..n_pixels * shape.n_channels).map(sample)))
}

fn cut_off(part: &str) -> ReadError {
    ReadError::field("a JPEG-LS frame", format!("cut off or corrupt in its {part}"), "a whole one")
}

/// The next marker, its segment without the length, and what follows.
fn next_segment(bytes: &[u8]) -> Result<(u8, &[u8], &[u8]), ReadError> {
    let mut at = bytes;
    loop {
        match at {
            [0xff, 0xff, ..] => at = &at[1..],
            [0xff, END, rest @ ..] => return Ok((END, &[], rest)),
            [0xff, marker @ 0x80..=0xff, high, low, rest @ ..] => {
                let n_bytes = usize::from(u16::from_be_bytes([*high, *low])).saturating_sub(2);
                let (segment, after) = rest.split_at_checked(n_bytes).ok_or_else(|| cut_off("header"))?;
                return Ok((*marker, segment, after));
            }
            [_, rest @ ..] if !rest.is_empty() => at = rest,
            _ => return Err(cut_off("header")),
        }
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_be_bytes([*bytes.get(at)?, *bytes.get(at + 1)?]))
}

fn shifted(mut plane: Vec<u16>, n_bits: u32) -> Vec<u16> {
    if n_bits > 0 {
        plane.iter_mut().for_each(|v| *v = v.checked_shl(n_bits).unwrap_or(0));
    }
    plane
}

struct Frame {
    n_bits: u32,
    n_components: usize,
}

impl Frame {
    fn new(segment: &[u8], shape: &FrameShape) -> Result<Frame, ReadError> {
        let parse = || {
            let [n_bits, _, _, _, _, n_components, ..] = *segment else { return None };
            Some((n_bits, word(segment, 1)?, word(segment, 3)?, n_components))
        };
        let (n_bits, rows, columns, n_components) = parse().ok_or_else(|| cut_off("frame header"))?;
        shape.check("JPEG-LS", columns.into(), rows.into(), n_components.into())?;
        shape.check_precision("JPEG-LS", n_bits.into())?;
        if n_bits < 2 {
            return Err(ReadError::field("bits of a JPEG-LS sample", n_bits, "2 to 16"));
        }
        Ok(Frame { n_bits: n_bits.into(), n_components: n_components.into() })
    }
}

struct Scan {
    n_components: usize,
    near: i32,
    interleave: Interleave,
    n_low_bits: u32,
}

impl Scan {
    fn new(segment: &[u8], frame: &Frame) -> Result<Scan, ReadError> {
        let parse = || {
            let n_components = usize::from(*segment.first()?);
            let [near, interleave, n_low_bits] = *segment.get(1 + 2 * n_components..)?.first_chunk()?;
            let has_tables = segment[1..=2 * n_components].chunks(2).any(|component| component[1] != 0);
            Some((n_components, near, interleave, n_low_bits, has_tables))
        };
        let (n_components, near, interleave, n_low_bits, has_tables) = parse().ok_or_else(|| cut_off("scan header"))?;
        if has_tables {
            return Err(ReadError::unsupported("JPEG-LS", "mapping tables", "samples as they are coded are"));
        }
        let interleave = match (n_components, interleave) {
            (1, _) => Interleave::Line,
            (n, 1) if n == frame.n_components => Interleave::Line,
            (n, 2) if n == frame.n_components => Interleave::Sample,
            _ => {
                let value = format!("{interleave} of {n_components} components");
                return Err(ReadError::field("JPEG-LS interleave", value, "1 or 2 where there are several"));
            }
        };
        Ok(Scan { n_components, near: near.into(), interleave, n_low_bits: u32::from(n_low_bits) & 15 })
    }
}

/// What the file states of MAXVAL, T1, T2, T3 and RESET; 0 stands for the default (C.2.4.1.1).
#[derive(Clone, Copy, Default)]
struct Parameters([i32; 5]);

impl Parameters {
    fn new(segment: &[u8]) -> Result<Parameters, ReadError> {
        match segment {
            [1, values @ ..] => {
                let mut words = [0; 5];
                for (i, value) in words.iter_mut().enumerate() {
                    *value = word(values, 2 * i).ok_or_else(|| cut_off("parameters"))?.into();
                }
                Ok(Parameters(words))
            }
            [kind, ..] => Err(ReadError::unsupported("JPEG-LS parameter segment", kind, "1 is")),
            [] => Err(cut_off("parameters")),
        }
    }

    fn coding(&self, frame: &Frame, near: i32) -> Result<Coding, ReadError> {
        let most = (1 << frame.n_bits) - 1;
        let [max, t1, t2, t3, reset] = self.0;
        let max = if max == 0 { most } else { max };
        let or = |stated: i32, default: i32| if stated == 0 { default } else { stated };
        let defaults = default_thresholds(max, near);
        let thresholds = [or(t1, defaults[0]), or(t2, defaults[1]), or(t3, defaults[2])];
        let reset = or(reset, 64);
        let [t1, t2, t3] = thresholds;
        let is_sound = max <= most && near <= max.min(510) / 2 && near < t1 && t1 <= t2 && t2 <= t3 && t3 <= max;
        if !is_sound || reset < 3 {
            let value = format!("{max}, {t1}, {t2}, {t3}, {reset}, {near}");
            let expected = "MAXVAL, T1, T2, T3, RESET and NEAR in their ranges (C.2.4.1.1)";
            return Err(ReadError::field("JPEG-LS parameters", value, expected));
        }
        Ok(Coding::new(max, near, thresholds, reset))
    }
}

/// T.87, C.2.4.1.1.1.
fn default_thresholds(max: i32, near: i32) -> [i32; 3] {
    let within = |value: i32, least: i32| if value > max || value < least { least } else { value };
    let scaled = |base: i32, per_near: i32, least: i32| match max >= 128 {
        true => (max.min(4095) + 128) / 256 * (base - least) + least + per_near * near,
        false => least.max(base / (256 / (max + 1)) + per_near * near),
    };
    let t1 = within(scaled(3, 3, 2), near + 1);
    let t2 = within(scaled(7, 5, 3), t1);
    [t1, t2, within(scaled(21, 7, 4), t2)]
}
