//! Figures 4 and 5: the weights of blocks, read back from each backend, against those in f64.

use std::sync::Arc;

use brickfield::bricks::{BlockOptions, BlockSource, BlockVolume, build_blocks};
use brickfield::frame::{Join, ShaderFunction};
use brickfield::interp::Neighbourhood;
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BlockSide, Grid, Image, Interblock, Level, Volume};

use super::LjungArgs;
use super::gradient::{evaluate, plan};
use crate::compare::rivals::Rivals;
use crate::paper::panels::{beside, stacked};
use crate::paper::{Missed, PaperError, print};

const BLOCK: BlockSide = BlockSide::V16;
/// Rounding of f32 positions and weights.
const ROUNDING: f64 = 2e-6;
/// Pixels along a side of figure 5's panels.
const PANEL: u32 = 129;

pub(super) fn run(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<Missed>, PaperError> {
    let missed = [figure_4(rivals)?, figure_5(args, rivals)?].concat();
    Ok(missed.into_iter().map(Missed::of_pictures).collect())
}

/// Blocks whose samples do not matter.
fn blocks(dims: UVec3) -> Result<BlockVolume, PaperError> {
    let grid = Grid::axis_aligned(dims, DVec3::ONE).expect("a grid");
    let ramp: Vec<u8> = (0..grid.n_voxels()).map(|i| (i % 251) as u8).collect();
    let volume = Volume::new(grid, ramp).expect("a value for each voxel");
    Ok(build_blocks(Arc::new(volume), &BlockOptions { side: BLOCK, ..BlockOptions::default() })?)
}

/// Two blocks along x: one sample, and four samples a side.
fn figure_4(rivals: &mut Rivals) -> Result<Vec<String>, PaperError> {
    const N: u32 = 17;
    let (blocks, levels) = (blocks(UVec3::new(32, 1, 1))?, [Level(4), Level(2)]);
    let side = f64::from(BLOCK.n_voxels());
    let at = |i: u32| f64::from(i) / f64::from(N - 1) - 0.5;
    // Neighbourhoods change at the blocks' middles: their ends are a hair inside.
    let positions: Vec<DVec3> =
        (0..N).map(|i| DVec3::new((side - 0.5 + at(i) * side).clamp(7.5001, 23.4999), 0.0, 0.0)).collect();
    let heads: Vec<String> = (0..N).step_by(2).map(|i| format!("{:>7.3}", at(i))).collect();
    print(&format!(
        "Figure 4: the weight of the right block (level of 4 samples) beside the left one (1 sample), at rho in blocks.\n\n\
         backend  scheme            {}   greatest difference to f64",
        heads.concat()
    ))?;
    let mut missed = Vec::new();
    for scheme in Interblock::ALL {
        for read in read_back(rivals, &blocks, &levels, scheme, &positions)? {
            let right: Vec<f64> = read.weights.iter().map(|w| w[1] + w[3] + w[5] + w[7]).collect();
            let columns: Vec<String> = right.iter().step_by(2).map(|w| format!("{w:>7.4}")).collect();
            print(&format!(
                "{:<8} {:<17} {}   {:.1e}",
                read.backend,
                scheme.name(),
                columns.concat(),
                read.difference
            ))?;
            missed.extend(read.complaint("figure 4", scheme));
        }
    }
    Ok(missed)
}

/// Four blocks of 1 x 1, 4 x 4, 2 x 2 and 8 x 8 samples.
fn figure_5(args: &LjungArgs, rivals: &mut Rivals) -> Result<Vec<String>, PaperError> {
    let (blocks, levels) = (blocks(UVec3::new(32, 32, 1))?, [Level(4), Level(2), Level(3), Level(1)]);
    let along = |i: u32| 7.5001 + f64::from(i) / f64::from(PANEL - 1) * 15.9998;
    // Upwards, as in the figure.
    let positions: Vec<DVec3> =
        (0..PANEL * PANEL).map(|i| DVec3::new(along(i % PANEL), along(PANEL - 1 - i / PANEL), 0.0)).collect();
    print("\nFigure 5: the weights of four blocks.\n\nbackend  scheme              greatest difference to f64")?;
    let (mut missed, mut rows) = (Vec::new(), Vec::new());
    for scheme in Interblock::ALL {
        let read = read_back(rivals, &blocks, &levels, scheme, &positions)?;
        for read in &read {
            print(&format!("{:<8} {:<17}   {:.1e}", read.backend, scheme.name(), read.difference))?;
            missed.extend(read.complaint("figure 5", scheme));
        }
        let Some(last) = read.last() else { continue };
        // Blocks 1 to 4 of the figure; the volume is one voxel thick, so that all others are missing.
        let panel = |b: usize| {
            let grey = |w: &[f64; 8]| [(w[b] + w[b + 4]) as f32; 3];
            let pixels = last.weights.iter().map(grey).map(|[r, g, b]| [r, g, b, 1.0]).collect();
            Image::new(UVec2::splat(PANEL), pixels).expect("a pixel for each position")
        };
        rows.push(beside(&[panel(0), panel(1), panel(2), panel(3)]));
    }
    let what =
        "weights of blocks of 1 x 1, 4 x 4, 2 x 2, 8 x 8 samples; minimum distance, boundary split, maximum distance";
    args.common.write_picture("figure5", &stacked(&rows), what)?;
    Ok(missed)
}

/// The weights of the eight blocks around some positions, on one backend.
struct ReadBack {
    backend: &'static str,
    weights: Vec<[f64; 8]>,
    /// The greatest difference to the weights in f64.
    difference: f64,
}

impl ReadBack {
    fn complaint(&self, figure: &str, scheme: Interblock) -> Option<String> {
        let is_off = self.difference > ROUNDING;
        is_off
            .then(|| format!("{figure}, {}, {}: weights are off by {:e}", self.backend, scheme.name(), self.difference))
    }
}

fn read_back(
    rivals: &mut Rivals,
    blocks: &BlockVolume,
    levels: &[Level],
    scheme: Interblock,
    positions: &[DVec3],
) -> Result<Vec<ReadBack>, PaperError> {
    let plan = plan(blocks, levels, Join::Blend(scheme))?;
    let inputs: Vec<[f32; 4]> = positions.iter().map(|q| q.as_vec3().extend(0.0).to_array()).collect();
    let layout = blocks.layout();
    let expected = |input: &[f32; 4]| {
        let around = Neighbourhood::around(layout, [0, 1, 2].map(|axis| f64::from(input[axis])));
        around.weights(layout, scheme, |block| levels[layout.ordinal(block)])
    };
    let expected: Vec<[f64; 8]> = inputs.iter().map(expected).collect();
    let mut all = Vec::new();
    for backend in &mut rivals.present {
        let low = evaluate(backend.as_mut(), &plan, ShaderFunction::WeightsLow, &inputs)?;
        let high = evaluate(backend.as_mut(), &plan, ShaderFunction::WeightsHigh, &inputs)?;
        let eight = |(low, high): (&[f32; 4], &[f32; 4])| {
            std::array::from_fn(|b| f64::from(if b < 4 { low[b] } else { high[b - 4] }))
        };
        let weights: Vec<[f64; 8]> = low.iter().zip(&high).map(eight).collect();
        let pairs = weights.iter().flatten().zip(expected.iter().flatten());
        let difference = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        all.push(ReadBack { backend: backend.describe().backend, weights, difference });
    }
    Ok(all)
}
