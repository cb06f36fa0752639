//! From slices to a store of all levels.

use std::path::{Path, PathBuf};

use brickfield_bricks::{Pyramid, SliceError, block_summaries, coarsest_level};
use brickfield_core::{BlockSide, Level, NonFinite, Rescale, Scalar, ScalarType, ValueRange, Voxels, with_voxels};
use brickfield_io::ome_zarr::{Finest, PyramidOptions, PyramidWriter};
use brickfield_io::{Compression, Format, Note, OpenError, SaveError, SaveNote, SaveOptions, SliceSource, VolumeFacts};

/// Slices that are in memory at once: a layer of chunks, and of the largest blocks.
const SLAB_SLICES: u32 = 32;

/// How the samples of a store are coded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Codec {
    /// Not at all.
    None,
    /// zstd: every program opens all levels.
    #[default]
    Zstd,
    /// Level 0 as details of level 1 (Saladi, Pinnamaneni and Meyer 2003), the other levels by zstd: the least bytes, and other programs
    /// open levels 1 and coarser. Of integers only; the store has the stored numbers, and slope and intercept in an attribute of our own.
    Haar,
}

impl Codec {
    /// All codecs.
    pub const ALL: [Codec; 3] = [Codec::None, Codec::Zstd, Codec::Haar];

    /// The name on command lines.
    pub const fn name(self) -> &'static str {
        match self {
            Codec::None => "none",
            Codec::Zstd => "zstd",
            Codec::Haar => "haar",
        }
    }
}

/// A volume that was packed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Packed {
    /// All about the volume but its samples; the notes are those of the reader, and that voxels were not finite.
    pub facts: VolumeFacts,
    /// The type of the samples in the store.
    pub scalar: ScalarType,
    /// The coarsest level in the store.
    pub coarsest: Level,
    /// What the store does not state, or states in another way.
    pub notes: Vec<SaveNote>,
}

/// How far packing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PackProgress {
    /// Slices that are done, of all passes.
    pub n_done: u64,
    /// Slices of all passes.
    pub n_total: u64,
}

/// Why a volume could not be packed. There is nothing at the store's path then, unless there was before.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PackError {
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error(transparent)]
    Save(#[from] SaveError),
    #[error("{}: a store is a folder of OME-Zarr; the end of the name is that of {format}: take .zarr", path.display())]
    NotZarr { path: PathBuf, format: Format },
    #[error("{}: the store would lie inside of {}, which is packed", path.display(), input.display())]
    IntoInput { path: PathBuf, input: PathBuf },
    #[error("{}: samples are {scalar}; the codec haar is for integers: take zstd", path.display())]
    Floats { path: PathBuf, scalar: ScalarType },
    #[error("{}: {fault}", path.display())]
    Slices { path: PathBuf, fault: SliceError },
    #[error("{}: values rescaled by slope {} and intercept {} reach from {} to {}; they must be finite", path.display(), rescale.slope(), rescale.intercept(), range.min, range.max)]
    BeyondFinite { path: PathBuf, rescale: Rescale, range: ValueRange },
}

/// Packs a volume as OME-Zarr 0.5, with averages of all levels and summaries of blocks: see [`PyramidWriter`].
///
/// `open` opens the slices of the volume at `path`; it is called twice for floats, which may not be finite, and for rescaled
/// volumes, whose type depends on their values: a store has values, in f32 if that holds all of them exactly, else in f64. With
/// [`Codec::Haar`] it has the stored numbers.
///
/// Memory: 32 slices of the volume as they are read and as they are stored; 32 slices of each level, 1/3 of that; sums of 8/3 bytes for each voxel of a
/// slice; two copies of a shard of 32 x 512 x 512 samples.
///
/// # Errors
/// What the reader says; a store that is there already or cannot be written to; floats for [`Codec::Haar`].
pub fn pack(
    path: &Path,
    open: &mut dyn FnMut() -> Result<Box<dyn SliceSource>, OpenError>,
    store: &Path,
    codec: Codec,
    progress: &mut dyn FnMut(PackProgress),
) -> Result<Packed, PackError> {
    check_store_path(path, store)?;
    let mut source = open()?;
    let facts = source.facts().clone();
    let dims = facts.grid.dims();
    let is_float = matches!(facts.scalar, ScalarType::F32 | ScalarType::F64);
    if codec == Codec::Haar && is_float {
        return Err(PackError::Floats { path: path.to_owned(), scalar: facts.scalar });
    }
    let options = options_of(&facts, codec);
    let has_two_passes = is_float || facts.rescale != options.rescale;
    let n_total = u64::from(dims.z) * if has_two_passes { 2 } else { 1 };
    let mut n_done = 0;
    let mut told = |n: u64| {
        n_done += n;
        progress(PackProgress { n_done, n_total });
    };
    let survey = match has_two_passes {
        true => {
            // A path that is taken is refused before the first pass, too.
            drop(PyramidWriter::create(store, &facts.grid, facts.scalar, &options)?);
            let survey = Survey::of(path, &mut *source, &mut told)?;
            source = open()?;
            survey
        }
        false => Survey::default(),
    };
    let values = Values::new(path, &facts, options.rescale, &survey)?;
    let coarsest = options.coarsest;
    let writer = PyramidWriter::create(store, &facts.grid, values.scalar, &options)?;
    let mut notes = writer.notes();
    if values.scalar != facts.scalar {
        notes.push(SaveNote::ValuesStored { format: Format::OmeZarr, from: facts.scalar, to: values.scalar });
    }
    write(path, &mut *source, &values, writer, coarsest, &mut told)?;
    let mut facts = VolumeFacts { notes: source.facts().notes.clone(), ..facts };
    facts.notes.extend(values.note(survey.non_finite));
    Ok(Packed { facts, scalar: values.scalar, coarsest, notes })
}

/// The store of a volume.
fn options_of(facts: &VolumeFacts, codec: Codec) -> PyramidOptions {
    let mut save = SaveOptions::default();
    (save.frame, save.unit) = (facts.frame, facts.unit.clone());
    save.compression = if codec == Codec::None { Compression::None } else { Compression::Lossless };
    let coarsest = coarsest_level(facts.grid.dims());
    match codec {
        // A volume of one sample has a level 1, too.
        Codec::Haar => {
            PyramidOptions { save, coarsest: coarsest.max(Level(1)), finest: Finest::Details, rescale: facts.rescale }
        }
        _ => PyramidOptions { save, coarsest, ..PyramidOptions::default() },
    }
}

/// Refuses names of other formats, and places inside of what is packed.
fn check_store_path(input: &Path, store: &Path) -> Result<(), PackError> {
    match Format::from_extension(store) {
        None | Some(Format::OmeZarr) => {}
        Some(format) => return Err(PackError::NotZarr { path: store.to_owned(), format }),
    }
    let folder = store.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (input.canonicalize(), folder.canonicalize()) {
        (Ok(real), Ok(folder)) if folder.starts_with(&real) => {
            Err(PackError::IntoInput { path: store.to_owned(), input: input.to_owned() })
        }
        // Files that are not there are named by those who open them.
        _ => Ok(()),
    }
}

/// The next slices, and their number.
fn next_slab(path: &Path, source: &mut dyn SliceSource) -> Result<(Voxels, u32), PackError> {
    let slab = source.next_slices(SLAB_SLICES).map_err(|fault| OpenError { path: path.to_owned(), fault })?;
    let dims = source.facts().grid.dims();
    let n_slices = slab.len() / (dims.x as usize * dims.y as usize);
    Ok((slab, n_slices as u32))
}

fn write(
    path: &Path,
    source: &mut dyn SliceSource,
    values: &Values,
    mut writer: PyramidWriter,
    coarsest: Level,
    told: &mut dyn FnMut(u64),
) -> Result<(), PackError> {
    let dims = source.facts().grid.dims();
    let fault = |fault| PackError::Slices { path: path.to_owned(), fault };
    let mut pyramid = Pyramid::new(dims, values.scalar, coarsest);
    while !pyramid.is_complete() {
        let (slab, n_slices) = next_slab(path, source)?;
        let slab = values.of(slab);
        for side in BlockSide::ALL {
            let summaries = block_summaries(&slab, dims.with_z(n_slices), side, values.stated).map_err(fault)?;
            writer.push_summaries(side, &summaries)?;
        }
        let mut coarser = Vec::new();
        pyramid.push(&slab, &mut |level, slice| coarser.push((level, slice))).map_err(fault)?;
        writer.push(Level(0), slab)?;
        coarser.into_iter().try_for_each(|(level, slice)| writer.push(level, slice))?;
        told(n_slices.into());
        if n_slices == 0 {
            break;
        }
    }
    Ok(writer.finish()?)
}

/// What stored numbers are, of volumes whose samples depend on all of them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Survey {
    /// Of the finite ones.
    range: Option<ValueRange>,
    pub(crate) non_finite: NonFinite,
    /// Values that f32 does not hold exactly.
    n_inexact: u64,
}

impl Survey {
    fn of(path: &Path, source: &mut dyn SliceSource, told: &mut dyn FnMut(u64)) -> Result<Survey, PackError> {
        let (mut survey, rescale) = (Survey::default(), source.facts().rescale);
        loop {
            let (slab, n_slices) = next_slab(path, source)?;
            if n_slices == 0 {
                return Ok(survey);
            }
            with_voxels!(&slab, v => survey.add(v, rescale));
            told(n_slices.into());
        }
    }

    pub(crate) fn add<T: Scalar>(&mut self, voxels: &[T], rescale: Rescale) {
        for stored in voxels.iter().map(|v| v.to_f64()) {
            if !stored.is_finite() {
                self.add_non_finite(stored);
                continue;
            }
            let value = rescale.value(stored);
            self.n_inexact += u64::from(f64::from(value as f32) != value);
            let range = self.range.get_or_insert(ValueRange { min: stored, max: stored });
            range.min = range.min.min(stored);
            range.max = range.max.max(stored);
        }
    }

    /// Least and greatest finite number, if there are others.
    pub(crate) fn finite(&self) -> Option<ValueRange> {
        (self.non_finite.total() > 0).then(|| self.finite_or_zero())
    }

    fn finite_or_zero(&self) -> ValueRange {
        self.range.unwrap_or(ValueRange { min: 0.0, max: 0.0 })
    }

    fn add_non_finite(&mut self, stored: f64) {
        let NonFinite { n_nan, n_positive_infinity, n_negative_infinity } = &mut self.non_finite;
        let n = match stored {
            v if v.is_nan() => n_nan,
            v if v > 0.0 => n_positive_infinity,
            _ => n_negative_infinity,
        };
        *n += 1;
    }
}

/// How stored numbers become samples of the store.
struct Values {
    scalar: ScalarType,
    /// From stored numbers to samples.
    rescale: Rescale,
    /// From samples to values: what the store states.
    stated: Rescale,
    /// Least and greatest finite number, if there are others.
    finite: Option<ValueRange>,
}

impl Values {
    fn new(path: &Path, facts: &VolumeFacts, stated: Rescale, survey: &Survey) -> Result<Values, PackError> {
        if stated == facts.rescale {
            check_finite(path, stated, INTEGERS)?;
            return Ok(Values { scalar: facts.scalar, rescale: Rescale::IDENTITY, stated, finite: survey.finite() });
        }
        let rescale = facts.rescale;
        check_finite(path, rescale, survey.finite_or_zero())?;
        let scalar = if survey.n_inexact == 0 { ScalarType::F32 } else { ScalarType::F64 };
        Ok(Values { scalar, rescale, stated, finite: survey.finite() })
    }

    /// The samples of stored numbers.
    fn of(&self, slab: Voxels) -> Voxels {
        if self.rescale == Rescale::IDENTITY && self.finite.is_none() {
            return slab;
        }
        let value = |stored: f64| self.rescale.value(self.finite(stored));
        with_voxels!(&slab, v => match self.scalar {
            ScalarType::F32 => Voxels::F32(v.iter().map(|stored| value(stored.to_f64()) as f32).collect()),
            _ => Voxels::F64(v.iter().map(|stored| value(stored.to_f64())).collect()),
        })
    }

    fn finite(&self, stored: f64) -> f64 {
        match self.finite {
            Some(range) if !stored.is_finite() => finite_for(stored, range),
            _ => stored,
        }
    }

    fn note(&self, counts: NonFinite) -> Option<Note> {
        let ValueRange { min, max } = self.finite?;
        Some(Note::NonFinite { counts, low: self.rescale.value(min), high: self.rescale.value(max) })
    }
}

/// The range of all integers that are samples.
const INTEGERS: ValueRange = ValueRange { min: i32::MIN as f64, max: u32::MAX as f64 };

fn check_finite(path: &Path, rescale: Rescale, stored: ValueRange) -> Result<(), PackError> {
    let range = rescale.values(stored);
    match range.min.is_finite() && range.max.is_finite() {
        true => Ok(()),
        false => Err(PackError::BeyondFinite { path: path.to_owned(), rescale, range }),
    }
}

/// What takes the place of a number that is not finite, as in a [`Volume`](brickfield_core::Volume).
pub(crate) fn finite_for(number: f64, finite: ValueRange) -> f64 {
    if number == f64::INFINITY { finite.max } else { finite.min }
}
