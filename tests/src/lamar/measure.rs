//! Frames: how long, how far from the answer, and whether as the plan says.

use brickfield::bricks::BrickTree;
use brickfield::cpu::{ContinuousOptions, Discrete, continuous, discrete};
use brickfield::frame::{Backend, Feature, FramePlan};
use brickfield::{Residency, Scene, Skipping, Technique, prepare};
use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, Image, Volume};
use serde::Serialize;

use crate::conformance::Tolerance;
use crate::metrics::{delta_e, errors};
use crate::paper::PaperError;
use crate::turns::{Contestant, Ratio, Spread, TimedFrame, take_turns};

/// The bricks and polygons of a frame. Frames of one scene, one of them of level 0 alone, draw the same bricks if these are equal.
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

/// The continuous integral at full resolution: the answer to which every picture is held.
pub(super) fn answer(volume: &Volume, scene: &Scene) -> Image<f64> {
    let options = ContinuousOptions { tolerance: 1e-7, transmittance_floor: 1e-9 };
    let everywhere = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
    continuous(volume, &scene.transfer, &scene.camera, scene.size, &everywhere, &options).image
}

/// The sum that the scene's cut asks for in f64, with nothing culled and nothing left out.
pub(super) fn reference(tree: &BrickTree, scene: &Scene) -> Result<Discrete, PaperError> {
    let complete = Scene { skipping: Skipping::Off, technique: Technique::RayCasting, ..scene.clone() };
    Ok(discrete(&prepare(tree, &complete, &mut Residency::default())?))
}

/// Two scenes of one tree on one backend, which took turns.
pub(super) struct Duel {
    pub(super) first: SceneTimes,
    pub(super) second: SceneTimes,
    /// The first's time over the second's.
    pub(super) ratio: Ratio,
}

/// One of two scenes.
pub(super) struct SceneTimes {
    pub(super) image: Image<f32>,
    pub(super) drawn: Drawn,
    /// Whole frames.
    pub(super) ms: Spread,
    /// Their part before the backend's: selection, order, polygons.
    pub(super) prepare_ms: Spread,
}

/// Times two scenes of a tree in so many rounds, at least one.
pub(super) fn duel(
    tree: &BrickTree,
    scenes: &[Scene; 2],
    backend: &mut dyn Backend,
    n_rounds: u32,
) -> Result<Duel, PaperError> {
    let mut contestants = scenes.each_ref().map(|scene| Contestant::new(tree, scene.clone()));
    let (mut latest, mut prepare_ms) = ([None, None], [Vec::new(), Vec::new()]);
    let ms = take_turns::<PaperError>(2, n_rounds, |turn| {
        let frame = contestants[turn.contestant].take(turn, backend)?;
        if !turn.warms_up() {
            prepare_ms[turn.contestant].push(frame.prepare_ms);
        }
        let frame_ms = frame.ms;
        latest[turn.contestant] = Some(frame);
        Ok(frame_ms)
    })?;
    let times = |frame: Option<TimedFrame>, i: usize| {
        let TimedFrame { image, plan, .. } = frame.expect("every contestant has had its turn");
        let (ms, prepare_ms) = (Spread::of(&ms[i]), Spread::of(&prepare_ms[i]));
        SceneTimes { image, drawn: Drawn::of(&plan), ms, prepare_ms }
    };
    let [first, second] = latest;
    Ok(Duel { first: times(first, 0), second: times(second, 1), ratio: Ratio::of(&ms[0], &ms[1]) })
}

impl Drawn {
    fn of(plan: &FramePlan) -> Drawn {
        Drawn {
            n_bricks: plan.field().slots().n_filled(),
            n_bytes: plan.field().slots().n_bytes(),
            n_polygons: plan.proxy().map_or(0, |proxy| proxy.n_polygons()),
            has_coarse: plan.features().contains(Feature::MultiLevel),
        }
    }
}

/// The sum that a scene's cut asks for, and how far a picture of it may be off.
pub(super) struct Judge {
    reference: Discrete,
    tolerance: Tolerance,
}

impl Judge {
    /// For a scene in exact mode, of which the rule is the same on every device.
    pub(super) fn new(tree: &BrickTree, scene: &Scene, backend: &dyn Backend) -> Result<Judge, PaperError> {
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

pub(super) fn distance(image: &Image<f32>, answer: &Image<f64>) -> Result<Distance, PaperError> {
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
            Drawn::of(&Contestant::new(&tree, scene).frame(&mut CpuBackend::new()).unwrap().plan)
        };
        assert_eq!((drawn(0).n_bricks, drawn(1).n_bricks), (1, 1));
        assert!(drawn(0) == drawn(0) && drawn(0) != drawn(1));
    }
}
