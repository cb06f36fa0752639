//! Frames: how long, how far from the answer, and whether as the plan says.

use std::ops::RangeInclusive;
use std::time::Instant;

use brickfield::bricks::BrickTree;
use brickfield::cpu::{ContinuousOptions, Discrete, continuous, discrete};
use brickfield::frame::{Backend, Feature, RenderError};
use brickfield::{Residency, Scene, Skipping, Technique, prepare};
use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Image, Volume};
use serde::Serialize;

use super::LamarError;
use crate::conformance::Tolerance;
use crate::metrics::{delta_e, errors, median};

/// Milliseconds over frames.
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(missing_docs)]
pub(super) struct Spread {
    pub(super) median: f64,
    pub(super) min: f64,
    pub(super) max: f64,
}

/// What a frame draws. Frames of one scene, one of them of level 0 alone, draw the same bricks if these are equal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Drawn {
    pub(super) n_bricks: usize,
    pub(super) n_bytes: usize,
    pub(super) n_polygons: usize,
    /// Whether bricks coarser than level 0 are among them.
    pub(super) has_coarse: bool,
}

/// How far a picture is from the answer at full resolution.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Distance {
    pub(super) rmse: f64,
    pub(super) max: f64,
    pub(super) delta_e_mean: f64,
}

/// The continuous integral at full resolution: what everything is held against.
pub(super) fn answer(volume: &Volume, scene: &Scene) -> Image<f64> {
    let options = ContinuousOptions { tolerance: 1e-7, transmittance_floor: 1e-9 };
    let everywhere = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
    continuous(volume, &scene.transfer, &scene.camera, scene.size, &everywhere, &options).image
}

/// The sum that the scene's cut asks for in f64, with nothing culled and nothing left out.
pub(super) fn reference(tree: &BrickTree, scene: &Scene) -> Result<Discrete, LamarError> {
    let complete = Scene { skipping: Skipping::Off, technique: Technique::RayCasting, ..scene.clone() };
    Ok(discrete(&prepare(tree, &complete, &mut Residency::default())?))
}

/// Two scenes of one tree on one backend, which take turns.
pub(super) struct Duel {
    pub(super) first: Outcome,
    pub(super) second: Outcome,
    /// The first's time over the second's: median over the rounds.
    pub(super) ratio: f64,
    /// Rounds, of one frame of each.
    pub(super) n_rounds: usize,
}

/// One of them.
pub(super) struct Outcome {
    pub(super) image: Image<f32>,
    pub(super) drawn: Drawn,
    /// Whole frames.
    pub(super) ms: Spread,
    /// Their part before the backend's: selection, order, polygons.
    pub(super) prepare_ms: Spread,
}

/// At least so many rounds, and on to so many while it is in doubt which is faster.
pub(super) fn duel(
    tree: &BrickTree,
    scenes: &[Scene; 2],
    backend: &mut dyn Backend,
    rounds: RangeInclusive<u32>,
) -> Result<Duel, LamarError> {
    let [mut first, mut second] = [0, 1].map(|i| Contestant::new(tree, &scenes[i]));
    let mut ratios = Vec::new();
    first.warm_up(backend)?;
    loop {
        let (a, b) = match ratios.len() % 2 {
            0 => round(&mut first, &mut second, backend)?,
            _ => {
                let (b, a) = round(&mut second, &mut first, backend)?;
                (a, b)
            }
        };
        ratios.push(first.ms[ratios.len()] / second.ms[ratios.len()]);
        let n = ratios.len() as u32;
        // Of the same bricks neither is faster.
        let is_open = a.1 != b.1 && in_doubt(&ratios);
        if n >= *rounds.start() && (n >= *rounds.end() || !is_open) {
            let (ratio, n_rounds) = (median(ratios.clone()), ratios.len());
            return Ok(Duel { first: first.outcome(a), second: second.outcome(b), ratio, n_rounds });
        }
    }
}

/// A timed frame of each. Who begins drew the frame before, so only the other has bricks to bring.
fn round(
    begins: &mut Contestant,
    ends: &mut Contestant,
    backend: &mut dyn Backend,
) -> Result<(Picture, Picture), LamarError> {
    let begun = begins.frame(backend)?;
    ends.warm_up(backend)?;
    Ok((begun, ends.frame(backend)?))
}

/// A few rounds of one mind do if their median ratio is as far from 1 as this.
const BY_FAR: f64 = 4.0 / 3.0;
/// Else one must lead by so many standard deviations of a fair coin's tosses.
const DEVIATIONS: f64 = 3.0;

/// Whether rounds of these ratios leave open who is faster: on a busy machine a round may say what the next denies.
fn in_doubt(ratios: &[f64]) -> bool {
    let n_above = ratios.iter().filter(|ratio| **ratio > 1.0).count();
    let lead = n_above.abs_diff(ratios.len() - n_above);
    let ratio = median(ratios.to_vec());
    let is_clear = lead == ratios.len() && ratio.max(1.0 / ratio) >= BY_FAR;
    !is_clear && (lead as f64) < DEVIATIONS * (ratios.len() as f64).sqrt()
}

/// A frame's picture, and what it draws.
type Picture = (Image<f32>, Drawn);

/// One scene on one backend.
pub(super) struct Contestant<'a> {
    tree: &'a BrickTree,
    scene: &'a Scene,
    residency: Residency,
    ms: Vec<f64>,
    prepare_ms: Vec<f64>,
}

impl<'a> Contestant<'a> {
    pub(super) fn new(tree: &'a BrickTree, scene: &'a Scene) -> Contestant<'a> {
        Contestant { tree, scene, residency: Residency::default(), ms: Vec::new(), prepare_ms: Vec::new() }
    }

    /// A frame that is not timed: it brings the bricks.
    fn warm_up(&mut self, backend: &mut dyn Backend) -> Result<(), LamarError> {
        let plan = prepare(self.tree, self.scene, &mut self.residency)?;
        backend.render(&plan).map_err(failed(backend))?;
        Ok(())
    }

    /// A frame from the scene to the picture in memory, selection, order and polygons included. Its bricks are resident if the
    /// backend's frame before was this contestant's, too.
    pub(super) fn frame(&mut self, backend: &mut dyn Backend) -> Result<Picture, LamarError> {
        let begin = Instant::now();
        let plan = prepare(self.tree, self.scene, &mut self.residency)?;
        self.prepare_ms.push(begin.elapsed().as_secs_f64() * 1e3);
        let image = backend.render(&plan).map_err(failed(backend))?.image;
        self.ms.push(begin.elapsed().as_secs_f64() * 1e3);
        let drawn = Drawn {
            n_bricks: plan.bricks.n_bricks() as usize,
            n_bytes: plan.bricks.bytes().len(),
            n_polygons: plan.proxy.as_ref().map_or(0, |proxy| proxy.n_polygons()),
            has_coarse: plan.features.contains(Feature::MultiLevel),
        };
        Ok((image, drawn))
    }

    fn outcome(self, (image, drawn): Picture) -> Outcome {
        Outcome { image, drawn, ms: spread(&self.ms), prepare_ms: spread(&self.prepare_ms) }
    }
}

/// The sum that a scene's cut asks for, and how far a picture of it may be off.
pub(super) struct Judge {
    reference: Discrete,
    tolerance: Tolerance,
}

impl Judge {
    /// For a scene in exact mode, of which the rule is the same on every device.
    pub(super) fn new(tree: &BrickTree, scene: &Scene, backend: &dyn Backend) -> Result<Judge, LamarError> {
        let reference = reference(tree, scene)?;
        let plan = prepare(tree, scene, &mut Residency::default())?;
        let tolerance = Tolerance::of(&plan, &reference, &backend.describe().capabilities)?;
        Ok(Judge { reference, tolerance })
    }

    /// Why a picture is not within the rule, if it is not.
    pub(super) fn complaint(&self, image: &Image<f32>) -> Option<String> {
        self.tolerance.judge(image, &self.reference.image).complaint.map(|c| c.to_string())
    }
}

/// What a backend's failure becomes.
fn failed(backend: &dyn Backend) -> impl FnOnce(RenderError) -> LamarError + use<> {
    let name = backend.describe().backend;
    move |source| LamarError::Render { backend: name, source }
}

fn spread(ms: &[f64]) -> Spread {
    let (min, max) = ms.iter().fold((f64::INFINITY, 0.0f64), |(a, b), t| (a.min(*t), b.max(*t)));
    Spread { median: median(ms.to_vec()), min, max }
}

pub(super) fn distance(image: &Image<f32>, answer: &Image<f64>) -> Result<Distance, LamarError> {
    let e = errors(image, answer)?;
    let delta_e_mean = delta_e(image, answer, [0.0; 3])?.mean;
    Ok(Distance { rmse: e.rmse, max: e.worst.difference, delta_e_mean })
}

#[cfg(test)]
mod tests {
    use brickfield::bricks::{BuildOptions, Downsampling, build_tree};
    use brickfield::cpu::CpuBackend;
    use brickfield::lod::Criterion;
    use brickfield_core::glam::{UVec2, UVec3};
    use brickfield_core::{BrickSide, Camera, Grid, Knot, Level, ScalarType, TransferFunction};

    use super::*;
    use crate::volumes::fill;

    #[test]
    fn as_many_bricks_of_another_level_are_not_the_same_bricks() {
        // Something in one of eight bricks, and so in the one above them.
        let grid = Grid::axis_aligned(UVec3::splat(31), DVec3::ONE).unwrap();
        let volume = fill(&grid, ScalarType::U8, |p| (7.0 - (p - 8.5).length()).max(0.0));
        let options = BuildOptions { side: BrickSide::S16, downsampling: Downsampling::Subsample, max_bytes: None };
        let tree = build_tree(&volume, &options).unwrap();
        let knot = |value| Knot { value, extinction: 0.1 * value, color: [1.0; 3] };
        let camera = Camera::framing(&grid.world_box(), DVec3::new(0.6, -1.0, 0.35), DVec3::Z).unwrap();
        let transfer = TransferFunction::new(vec![knot(0.0), knot(7.0)]).unwrap();
        let drawn = |level| {
            let detail = vec![Criterion::Uniform(Level(level))];
            let scene = Scene { detail, ..Scene::new(camera, UVec2::splat(8), transfer.clone()) };
            Contestant::new(&tree, &scene).frame(&mut CpuBackend::new()).unwrap().1
        };
        assert_eq!((drawn(0).n_bricks, drawn(1).n_bricks), (1, 1));
        assert!(drawn(0) == drawn(0) && drawn(0) != drawn(1));
    }

    #[test]
    fn who_is_faster_is_open_while_it_is_close_or_rounds_disagree() {
        // By far, and of one mind.
        assert!(!in_doubt(&[1.2, 2.0, 1.5]) && !in_doubt(&[0.5, 0.6, 0.8]));
        assert!(in_doubt(&[1.1, 1.2, 1.3]) && in_doubt(&[0.8, 0.8, 0.9]));
        // By far, but not of one mind.
        assert!(in_doubt(&[0.8, 0.7, 0.5, 1.3]) && in_doubt(&[1.3, 1.4, 1.6, 0.9]));
        // By little, but again and again.
        assert!(in_doubt(&[1.01; 8]) && in_doubt(&[0.99; 8]));
        assert!(!in_doubt(&[1.01; 9]) && !in_doubt(&[0.99; 9]));
        let with_dissent = |n_above, n_below| [vec![1.1; n_above], vec![0.9; n_below]].concat();
        assert!(in_doubt(&with_dissent(30, 12)) && in_doubt(&with_dissent(12, 30)));
        assert!(!in_doubt(&with_dissent(31, 11)) && !in_doubt(&with_dissent(11, 31)));
    }
}
