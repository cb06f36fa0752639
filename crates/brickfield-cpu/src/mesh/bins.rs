//! Which triangles may show in which rows of the picture.

use brickfield_frame::MeshPlan;
use rayon::prelude::*;

use super::outline::{Corners, Outline};

/// Rows of a band.
pub(super) const BAND_ROWS: u32 = 16;

/// For each band of rows, the triangles that reach into it, ascending.
pub(super) struct Bins {
    of_band: Vec<Vec<u32>>,
}

impl Bins {
    pub(super) fn of(plan: &MeshPlan) -> Bins {
        let n_bands = plan.size().y.div_ceil(BAND_ROWS);
        let bands = |triangle: u32| {
            let rows = Outline::of(plan, &Corners::of(plan, triangle))?.rows(0, plan.size().y);
            (!rows.is_empty()).then(|| (triangle, rows.start / BAND_ROWS, (rows.end - 1) / BAND_ROWS))
        };
        let n_triangles = plan.mesh().triangles().len() as u32;
        let reaching: Vec<_> = (0..n_triangles).into_par_iter().filter_map(bands).collect();
        let mut of_band = vec![Vec::new(); n_bands as usize];
        for (triangle, first, last) in reaching {
            (first..=last).for_each(|band| of_band[band as usize].push(triangle));
        }
        Bins { of_band }
    }

    pub(super) fn of_band(&self, band: usize) -> &[u32] {
        &self.of_band[band]
    }
}
