//! Pictures on normals of every kind, their differences and their times.

use brickfield::bricks::BlockSource;
use brickfield::frame::Backend;
use brickfield::lod::BlockLevels;
use brickfield::{BlockResidency, prepare_blocks};
use brickfield_core::{Image, Level};
use brickfield_optics::{ColorMetric, Normals};
use serde::Serialize;

use super::SaladiArgs;
use super::data::{DataSet, files, style};
use super::edits;
use crate::compare::rivals::Rivals;
use crate::metrics::{delta_e, greatest_difference};
use crate::paper::panels::{beside, heat_pixel, stacked};
use crate::paper::{Missed, PaperError, device_bytes, frame_of, mib, print};
use crate::turns::{Contestant, Ratio, Spread, take_turns};

/// The difference at the bright end.
const BRIGHT: f64 = 40.0;
/// Pictures of backends in exact mode differ by less, but where a node is within rounding of a jump.
const BETWEEN_BACKENDS: f64 = 1e-3;

/// Where a picture's normals come from; the first one has no light.
const METHODS: [Option<Normals>; 4] = [None, Some(Normals::Central), Some(Normals::Stored), Some(Normals::Surface)];

const fn name(normals: Option<Normals>) -> &'static str {
    match normals {
        None => "no light",
        Some(normals) => normals.name(),
    }
}

/// A picture of a volume.
#[derive(Clone, Debug, Serialize)]
struct NormalsRow {
    data: String,
    backend: &'static str,
    normals: &'static str,
    /// Bytes on the device.
    n_bytes: u64,
    /// From the scene to the picture, blocks resident.
    ms: Spread,
    /// Of its time over that of the picture without light.
    ratio: Ratio,
    /// From the picture on central differences.
    delta_e_mean: f64,
    delta_e_95: f64,
    /// The greatest difference of a channel from the first backend's picture.
    between_backends: f64,
}

pub(super) fn run(args: &SaladiArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "{} x {} pixels, steps of {} voxel(s), exact, flat blocks of {}, objects from {} % of the range of values on, a light at a place. Delta E: from the\n\
         picture on central differences; frames: medians of {} rounds in which the normals took turns, blocks resident.\n",
        args.common.size.x, args.common.size.y, args.common.step, args.blocks, args.threshold, args.common.frames
    ))?;
    let (mut rows, mut missed, mut edit_rows) = (Vec::new(), Vec::new(), Vec::new());
    for (data, path) in files(args)? {
        let data = DataSet::of_file(args.blocks, data, &path)?;
        rows.extend(of_data_set(args, rivals, &data)?);
        coarse(args, rivals, &data)?;
        edit_rows.extend(edits::run(args, &data, &mut missed)?);
    }
    args.common.write_rows("normals.json", &rows)?;
    args.common.write_rows("edits.json", &edit_rows)?;
    missed.extend(rows.iter().filter_map(claim));
    Ok(missed)
}

/// Every backend draws the same picture.
fn claim(row: &NormalsRow) -> Option<Missed> {
    // NaN is a difference, too.
    let is_equal = row.between_backends <= BETWEEN_BACKENDS;
    (!is_equal).then(|| {
        let NormalsRow { data, backend, normals, between_backends, .. } = row;
        Missed::of_pictures(format!(
            "{data}, {backend}, {normals}: a channel differs by {between_backends:.1e} from another backend"
        ))
    })
}

fn of_data_set(args: &SaladiArgs, rivals: &mut Rivals, data: &DataSet) -> Result<Vec<NormalsRow>, PaperError> {
    let dims = data.blocks.layout().dims();
    print(&format!("{}: {} x {} x {}\n{HEADER}", data.name, dims.x, dims.y, dims.z))?;
    let (mut rows, mut first) = (Vec::new(), None);
    for backend in &mut rivals.present {
        let (pictures, of_backend) = contest(args, backend.as_mut(), data, first.as_deref())?;
        of_backend.iter().try_for_each(|row| print(&line(row)))?;
        rows.extend(of_backend);
        first.get_or_insert(pictures);
    }
    let Some(pictures) = first else { return Ok(rows) };
    let differences: Vec<Image<f32>> = pictures.iter().map(|picture| heat(picture, &pictures[1])).collect();
    let what = format!(
        "{}: without light, central differences, stored gradients, surface voxels; below, Delta E from central differences, 0 to {BRIGHT}",
        data.name
    );
    let panels = stacked(&[beside(&pictures), beside(&differences)]);
    args.common.write_picture(&format!("normals-{}", file_name(&data.name)), &panels, &what)?;
    Ok(rows)
}

const HEADER: &str = "  backend  normals     device MiB   frame ms (min to max)        of no light                Delta E mean   95 %   from the first backend";

fn line(row: &NormalsRow) -> String {
    let ms = format!("{:.1} ({:.1} to {:.1})", row.ms.median, row.ms.min, row.ms.max);
    format!(
        "  {:<8} {:<10} {:>11.2}   {ms:<28} {:<26} {:>12.2} {:>6.1}   {:.1e}",
        row.backend,
        row.normals,
        mib(row.n_bytes),
        row.ratio.to_string(),
        row.delta_e_mean,
        row.delta_e_95,
        row.between_backends
    )
}

/// All kinds of normals take turns on a backend, at full resolution.
fn contest(
    args: &SaladiArgs,
    backend: &mut dyn Backend,
    data: &DataSet,
    first: Option<&[Image<f32>]>,
) -> Result<(Vec<Image<f32>>, Vec<NormalsRow>), PaperError> {
    let levels = BlockLevels::uniform(*data.blocks.layout(), Level(0));
    let contestant = |normals: Option<Normals>| -> Result<Contestant, PaperError> {
        Ok(Contestant::of_blocks(&data.blocks, levels.levels().to_vec(), style(), data.scene(args, normals)?))
    };
    let mut contestants: Vec<Contestant> = METHODS.into_iter().map(contestant).collect::<Result<_, _>>()?;
    let mut last: Vec<Option<(Image<f32>, u64)>> = METHODS.map(|_| None).to_vec();
    let ms = take_turns::<PaperError>(METHODS.len(), args.common.frames, |turn| {
        let frame = contestants[turn.contestant].take(turn, backend)?;
        last[turn.contestant] = Some((frame.image, device_bytes(&frame.plan)));
        Ok(frame.ms)
    })?;
    let (pictures, n_bytes): (Vec<_>, Vec<_>) = last.into_iter().map(|last| last.expect("all had turns")).unzip();
    let central = pictures[1].map(f64::from);
    let row = |(i, picture): (usize, &Image<f32>)| -> Result<NormalsRow, PaperError> {
        let colors = delta_e(picture, &central, [0.0; 3])?;
        Ok(NormalsRow {
            data: data.name.clone(),
            backend: backend.describe().backend,
            normals: name(METHODS[i]),
            n_bytes: n_bytes[i],
            ms: Spread::of(&ms[i]),
            ratio: Ratio::of(&ms[i], &ms[0]),
            delta_e_mean: colors.mean,
            delta_e_95: colors.percentile_95,
            between_backends: first.map_or(0.0, |first| greatest_difference(picture, &first[i])),
        })
    };
    let rows = pictures.iter().enumerate().map(row).collect::<Result<_, PaperError>>()?;
    Ok((pictures, rows))
}

/// How far coarser levels are from full resolution, by the kind of normals.
fn coarse(args: &SaladiArgs, rivals: &mut Rivals, data: &DataSet) -> Result<(), PaperError> {
    let Some(backend) = rivals.present.first_mut() else { return Ok(()) };
    for normals in METHODS {
        let scene = data.scene(args, normals)?;
        let mut picture = |level| {
            let levels = BlockLevels::uniform(*data.blocks.layout(), level);
            let plan = prepare_blocks(&data.blocks, &scene, levels.levels(), style(), &mut BlockResidency::default())?;
            Ok::<_, PaperError>(frame_of(backend.as_mut(), &plan)?.image)
        };
        let fine = picture(Level(0))?.map(f64::from);
        let mut off = Vec::new();
        for level in [Level(1), Level(2)] {
            off.push(format!("level {} {:.2}", level.0, delta_e(&picture(level)?, &fine, [0.0; 3])?.mean));
        }
        print(&format!("  {:<10} mean Delta E of coarser samples from level 0: {}", name(normals), off.join(", ")))?;
    }
    Ok(())
}

/// The name of a data set as a part of a file's.
fn file_name(data: &str) -> String {
    data.rsplit('/').next().unwrap_or(data).split('.').next().unwrap_or_default().replace(' ', "-")
}

/// The colour difference of each pixel.
fn heat(image: &Image<f32>, from: &Image<f32>) -> Image<f32> {
    let mut out = image.clone();
    for (to, expected) in out.pixels_mut().iter_mut().zip(from.pixels()) {
        let d = ColorMetric::CieLuv1976.of_pixels(to.map(f64::from), expected.map(f64::from), [0.0; 3]);
        *to = heat_pixel(d / BRIGHT);
    }
    out
}
