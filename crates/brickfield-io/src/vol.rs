//! VOL of the San Diego Supercomputer Center's VisTools, version 1: scalars, or colours with opacities; z fastest, big-endian.
//!
//! ```text
//! VOLS\n            8 bits a voxel
//! VOLB\n            red, green, blue, alpha of 8 bits
//! VOLC\n, #VOLC\n   red 10 bits, green 12, blue 10; alpha and beta of 16 bits
//! width, height, depth: 32-bit integers, most significant byte first
//! voxels, the last one ends the file
//! ```

use std::io::{BufRead, Read, Seek, Write};
use std::path::Path;

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{Rescale, ScalarType, Volume, Voxels};

use crate::choice::Entries;
use crate::colour::luminance;
use crate::error::check_length;
use crate::files::{ByteSource, n_bytes_left};
use crate::limits::CheckedShape;
use crate::numbers::with_room;
use crate::opened::FileFacts;
use crate::placement::{AXES, GridPlacement};
use crate::save_note::Stated;
use crate::saved::{SaveError, save_atomically};
use crate::{ChoiceKind, Format, Note, OpenOptions, Opened, ReadError, SaveNote, SaveOptions, Saved, WorldFrame};

/// The kinds of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Scalar,
    Rgba,
    RgbAlphaBeta,
}

impl Kind {
    const ALL: [(&'static [u8], Kind); 4] = [
        (b"VOLS\n", Kind::Scalar),
        (b"VOLB\n", Kind::Rgba),
        (b"VOLC\n", Kind::RgbAlphaBeta),
        (b"#VOLC\n", Kind::RgbAlphaBeta),
    ];

    const fn n_bytes(self) -> usize {
        match self {
            Kind::Scalar => 1,
            Kind::Rgba => 4,
            Kind::RgbAlphaBeta => 8,
        }
    }

    const fn scalar(self) -> ScalarType {
        match self {
            Kind::Scalar | Kind::Rgba => ScalarType::U8,
            Kind::RgbAlphaBeta => ScalarType::U16,
        }
    }

    const fn channels(self) -> &'static [&'static str] {
        match self {
            Kind::Scalar => &[],
            Kind::Rgba => &["red", "green", "blue", "alpha"],
            Kind::RgbAlphaBeta => &["red", "green", "blue", "alpha", "beta"],
        }
    }

    /// The channels of a voxel; colours of fewer than 16 bits in the range of 16.
    fn channels_of(self, voxel: &[u8]) -> [u16; 5] {
        match (self, voxel) {
            (Kind::RgbAlphaBeta, [a, b, c, d, e, f, g, h]) => {
                let colours = u32::from_be_bytes([*a, *b, *c, *d]);
                let wide = |n: u32, n_bits: u32| {
                    let most = (1 << n_bits) - 1;
                    ((n & most) * 65_535 + most / 2).div_euclid(most) as u16
                };
                let [red, green, blue] = [wide(colours >> 22, 10), wide(colours >> 10, 12), wide(colours, 10)];
                [red, green, blue, u16::from_be_bytes([*e, *f]), u16::from_be_bytes([*g, *h])]
            }
            _ => std::array::from_fn(|i| voxel.get(i).copied().unwrap_or_default().into()),
        }
    }
}

/// Reads a VOL file of version 1. Of colours the luminance is read with a note, or the channel that is wanted; those of `VOLC` become 16 bits.
///
/// The format states no spacing: it is 1, with notes. The outer corner of the first voxel is the world's origin.
///
/// # Errors
/// As [`ReadError`] lists them: another version, a shape beyond the limits or the file, bytes after the last voxel.
pub fn read(mut input: impl BufRead + Seek, options: &OpenOptions) -> Result<Opened, ReadError> {
    read_from(&mut input, options)
}

fn read_from(source: &mut dyn ByteSource, options: &OpenOptions) -> Result<Opened, ReadError> {
    let kind = kind_of(source)?;
    let mut header = [0; 12];
    check_length("the header", n_bytes_left(source)?, header.len() as u128)?;
    source.read_exact(&mut header).map_err(|e| ReadError::io("the header", e))?;
    let (sizes, _) = header.as_chunks::<4>();
    let [x, y, z] = [0, 1, 2].map(|i| u64::from(u32::from_be_bytes(sizes[i])));
    let mut found = FileFacts::plain(Format::Vol, options);
    let channel = choose(kind, &mut found)?;
    let shape = CheckedShape::claim([x, y, z], kind.scalar(), &options.limits)?;
    let (promised, left) = (shape.n_voxels() as u128 * kind.n_bytes() as u128, n_bytes_left(source)?);
    check_length("the image", left, promised)?;
    if u128::from(left) > promised {
        return Err(ReadError::unsupported(
            "version",
            format!("that has {} bytes after its voxels", u128::from(left) - promised),
            "1, which ends with them, is; 2, which names its axes, is not",
        ));
    }
    let voxels = match kind.scalar() {
        ScalarType::U16 => Voxels::U16(voxels(source, kind, shape.dims, |voxel| part(kind, voxel, channel))?),
        _ => Voxels::U8(voxels(source, kind, shape.dims, |voxel| part(kind, voxel, channel) as u8)?),
    };
    found.notes.extend(AXES.map(|axis| Note::SpacingAssumed { axis, reason: "is not stated in this format" }));
    let grid = GridPlacement::axis_aligned(DVec3::ONE, DVec3::splat(0.5)).grid(shape.dims)?;
    found.finish(grid, voxels)
}

/// Whether this is how a VOL file begins, of any version.
pub(crate) fn has_magic(head: &[u8]) -> bool {
    Kind::ALL.iter().any(|(line, _)| head.starts_with(line.trim_ascii_end()))
}

/// Bytes of a file that is none, for the message.
const SHOWN_BYTES: u64 = 64;

fn kind_of(source: &mut dyn ByteSource) -> Result<Kind, ReadError> {
    let mut head = Vec::new();
    source.take(SHOWN_BYTES).read_to_end(&mut head).map_err(|e| ReadError::io("the header", e))?;
    match Kind::ALL.into_iter().find(|(magic, _)| head.starts_with(magic)) {
        Some((magic, kind)) => {
            let surplus = head.len() - magic.len();
            source.seek_relative(-(surplus as i64)).map_err(|e| ReadError::io("the header", e))?;
            Ok(kind)
        }
        None if has_magic(&head) => Err(ReadError::unsupported(
            "version",
            String::from_utf8_lossy(&head).lines().next().unwrap_or_default(),
            "1, whose first line is VOLS, VOLB, VOLC or #VOLC, is",
        )),
        None => Err(ReadError::wrong_start(Format::Vol, &head, "VOLS, VOLB, VOLC or #VOLC")),
    }
}

/// The channel that is wanted; `None` for the luminance, and of scalars.
fn choose(kind: Kind, found: &mut FileFacts) -> Result<Option<usize>, ReadError> {
    let channels = kind.channels();
    if channels.is_empty() {
        return Ok(None);
    }
    let names = channels.iter().chain(&["luminance"]).map(|name| (*name).to_owned()).collect();
    let n_channels = channels.len() as u64;
    let entry = found.choices.choose(ChoiceKind::Channel, Entries::Named(names), n_channels)?.entry;
    if entry == n_channels {
        found.notes.push(Note::Luminance);
    }
    Ok((entry < n_channels).then_some(entry as usize))
}

fn part(kind: Kind, voxel: &[u8], channel: Option<usize>) -> u16 {
    let channels = kind.channels_of(voxel);
    match (kind, channel) {
        (Kind::Scalar, _) => channels[0],
        (_, Some(channel)) => channels[channel],
        (_, None) => luminance([channels[0], channels[1], channels[2]]),
    }
}

/// The voxels, x fastest, of a source that has them z fastest: plane after plane of constant x.
fn voxels<T: Copy + Default>(
    source: &mut dyn ByteSource,
    kind: Kind,
    dims: UVec3,
    part: impl Fn(&[u8]) -> T,
) -> Result<Vec<T>, ReadError> {
    let [nx, ny, nz] = dims.to_array().map(|n| n as usize);
    let mut voxels: Vec<T> = with_room(nx * ny * nz)?;
    voxels.resize(nx * ny * nz, T::default());
    let mut column = with_room(nz * kind.n_bytes())?;
    column.resize(nz * kind.n_bytes(), 0);
    for x in 0..nx {
        for y in 0..ny {
            source.read_exact(&mut column).map_err(|e| ReadError::io("the image", e))?;
            for (z, voxel) in column.chunks_exact(kind.n_bytes()).enumerate() {
                voxels[x + nx * (y + ny * z)] = part(voxel);
            }
        }
    }
    Ok(voxels)
}

/// Saves a volume of 8-bit samples as scalars: whole or not at all, for the file is renamed into place.
///
/// # Errors
/// Samples of another type, or with a slope and intercept; a folder that cannot be written to.
pub fn save(path: &Path, volume: &Volume, options: &SaveOptions) -> Result<Saved, SaveError> {
    let (Voxels::U8(voxels), Rescale::IDENTITY) = (volume.voxels(), volume.rescale()) else {
        let fault = format!("holds values of u8; these are {}", described(volume));
        return Err(SaveError::Unsupported { path: path.to_owned(), format: Format::Vol, fault });
    };
    let dims = volume.grid().dims();
    let [nx, ny, nz] = dims.to_array().map(|n| n as usize);
    save_atomically(path, |out| {
        out.write_all(b"VOLS\n")?;
        dims.to_array().iter().try_for_each(|n| out.write_all(&n.to_be_bytes()))?;
        let mut column = vec![0; nz];
        for x in 0..nx {
            for y in 0..ny {
                column.iter_mut().enumerate().for_each(|(z, to)| *to = voxels[x + nx * (y + ny * z)]);
                out.write_all(&column)?;
            }
        }
        Ok(())
    })?;
    let stated = Stated { frame: WorldFrame::Plain, unit: false };
    let mut saved = Saved::of(Format::Vol, volume, ScalarType::U8, options, stated);
    saved.notes.push(SaveNote::PlacementLost { format: Format::Vol });
    Ok(saved)
}

fn described(volume: &Volume) -> String {
    let rescale = volume.rescale();
    match rescale == Rescale::IDENTITY {
        true => volume.scalar_type().to_string(),
        false => {
            format!("{} with slope {} and intercept {}", volume.scalar_type(), rescale.slope(), rescale.intercept())
        }
    }
}
