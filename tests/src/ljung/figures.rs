//! Pictures of each volume at 32:1, unlit and in the light: at full resolution, the nearest block, and each scheme; below, the colour
//! difference.

use brickfield::bricks::BlockSource;
use brickfield::cpu::discrete;
use brickfield::frame::{Backend, Join, Mode};
use brickfield::lod::{BlockLevels, BudgetSize};
use brickfield::{BlockResidency, Scene, prepare_blocks};
use brickfield_core::{Image, Interblock, Level};
use brickfield_optics::{ColorMetric, Light, LightSource, LightTerms, flat_below};

use super::LjungArgs;
use super::data::{DataSet, data_sets};
use super::schemes::{joins, style};
use super::table::answer;
use crate::compare::rivals::Rivals;
use crate::paper::panels::{beside, heat_pixel, stacked};
use crate::paper::{Missed, PaperError, frame_of};

/// The difference at the bright end.
const BRIGHT: f64 = 20.0;

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    // For looking, larger than for timing.
    let mut args = args.clone();
    args.common.size *= 2;
    for data_set in data_sets(&args)? {
        of_data_set(&args, rivals, &data_set?)?;
    }
    Ok(Vec::new())
}

fn of_data_set(args: &LjungArgs, rivals: &mut Rivals, data: &DataSet) -> Result<(), PaperError> {
    let Some(backend) = rivals.present.last_mut() else { return Ok(()) };
    let scene = data.scene(args, Mode::Exact)?;
    let levels = data.select(BudgetSize::Ratio(32.0))?.levels;
    of_scene(args, backend.as_mut(), (data, &levels), &scene, &answer(data, &scene), "")?;
    let (range, grid) = (data.blocks.range(), data.blocks.grid());
    let steepness = flat_below(range, grid.spacing().min_element());
    let light = Light::new(LightSource::Head, LightTerms::default(), steepness).expect("a light by default");
    let lit = Scene { light: Some(light), ..scene };
    let whole = BlockLevels::uniform(*data.blocks.layout(), Level(0));
    let join = Join::Blend(Interblock::MaximumDistance);
    let plan = prepare_blocks(&data.blocks, &lit, whole.levels(), style(join), &mut BlockResidency::default())?;
    of_scene(args, backend.as_mut(), (data, &levels), &lit, &discrete(&plan).image, "-lit")
}

fn of_scene(
    args: &LjungArgs,
    backend: &mut dyn Backend,
    (data, levels): (&DataSet, &BlockLevels),
    scene: &Scene,
    answer: &Image<f64>,
    ending: &str,
) -> Result<(), PaperError> {
    let (mut pictures, mut differences) = (vec![full(answer)], vec![Image::transparent(answer.size())]);
    for join in joins() {
        let plan = prepare_blocks(&data.blocks, scene, levels.levels(), style(join), &mut BlockResidency::default())?;
        let frame = frame_of(backend, &plan)?;
        differences.push(difference(&frame.image, answer));
        pictures.push(frame.image);
    }
    let what = format!(
        "{} at 32:1: full resolution, nearest block, minimum distance, boundary split, maximum distance; below, Delta E from 0 to {BRIGHT}",
        data.name
    );
    let name = format!("figure8-{}{ending}", file_name(&data.name));
    args.common.write_picture(&name, &stacked(&[beside(&pictures), beside(&differences)]), &what)
}

/// The answer as a picture.
pub(super) fn full(answer: &Image<f64>) -> Image<f32> {
    answer.map(|channel| channel as f32)
}

/// The name of a data set as a part of a file's.
pub(super) fn file_name(data: &str) -> String {
    data.rsplit('/').next().unwrap_or(data).split('.').next().unwrap_or_default().replace(' ', "-")
}

/// The colour difference of each pixel.
pub(super) fn difference(image: &Image<f32>, answer: &Image<f64>) -> Image<f32> {
    let mut out = image.clone();
    for (to, expected) in out.pixels_mut().iter_mut().zip(answer.pixels()) {
        let found = to.map(f64::from);
        let d = ColorMetric::CieLuv1976.of_pixels(found, *expected, [0.0; 3]);
        *to = heat_pixel(d / BRIGHT);
    }
    out
}
