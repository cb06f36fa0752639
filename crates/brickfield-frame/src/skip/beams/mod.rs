//! Beams: the rays of a tile pass the dark together.

mod beam;
mod overview;

use std::ops::Range;

use brickfield_core::glam::UVec2;
use rayon::prelude::*;

use crate::{Division, FramePlan, Placement, QuadratureRule};
use beam::Beam;
pub use overview::Overview;

/// Pixels along the side of the smallest tiles.
const LEAST_SIDE: u32 = 8;
/// Most tiles of a picture; larger pictures have larger tiles.
const MOST_TILES: u32 = 4096;

/// For each tile of a picture, the segments in which its rays may see something.
///
/// The rays of a tile are a beam, which is traced once through an [`Overview`] of the cut for all of them (beams: Heckbert and
/// Hanrahan 1984; leaps by Chebyshev distance: Deakin and Knoll 2019). All other segments of its rays see nothing: to leave
/// them out changes no sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Beams {
    side: u32,
    n_columns: u32,
    /// Tile after tile, row after row: ranges of segments, front to back.
    runs: Vec<Vec<Range<i64>>>,
}

impl Beams {
    /// The beams of a plan's picture; `None` where they could pass over something.
    ///
    /// About 1 us a tile, over all threads of the current rayon pool.
    pub(crate) fn of(plan: &FramePlan, overview: &Overview) -> Option<Beams> {
        // Beams count segments of shells; bricks have segments of their own.
        if plan.rays().placement != Placement::Shells || plan.sampling().division() == Division::Brick {
            return None;
        }
        // Between levels, dark regions need not be connected: a pre-integrated segment could cross a visible one.
        if plan.sampling().rule() == QuadratureRule::PreIntegrated && plan.field().has_several_levels() {
            return None;
        }
        let size = plan.size();
        let mut side = LEAST_SIDE;
        let n_tiles = |side: u32| UVec2::new(size.x.div_ceil(side), size.y.div_ceil(side));
        while n_tiles(side).element_product() > MOST_TILES {
            side *= 2;
        }
        let n = n_tiles(side);
        let beam = |tile: u32| {
            let low = UVec2::new(tile % n.x, tile / n.x) * side;
            let high = (low + side).min(size);
            Beam::new(plan.rays(), plan.field().dims(), &(low.x..high.x), &(low.y..high.y)).runs(overview, plan)
        };
        let runs = (0..n.element_product()).into_par_iter().map(beam).collect();
        Some(Beams { side, n_columns: n.x, runs })
    }

    /// Pixels along a tile's side: a power of two, at least 8.
    pub fn tile_side(&self) -> u32 {
        self.side
    }

    /// The segments in which the ray of a pixel may see something, front to back.
    ///
    /// # Panics
    /// If the pixel is outside the picture.
    pub fn runs(&self, pixel: UVec2) -> &[Range<i64>] {
        let tile = pixel / self.side;
        &self.runs[(tile.y * self.n_columns + tile.x) as usize]
    }

    /// For each tile, row after row, the first segment of its first run and the end of its last; equal if there is none.
    pub fn spans(&self) -> Vec<[f32; 2]> {
        let span = |runs: &Vec<Range<i64>>| match (runs.first(), runs.last()) {
            (Some(first), Some(last)) => [first.start as f32, last.end as f32],
            _ => [0.0; 2],
        };
        self.runs.iter().map(span).collect()
    }
}
