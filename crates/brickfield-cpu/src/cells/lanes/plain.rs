//! Lanes that every processor has.

use brickfield_core::glam::Vec4;

use super::{Areas, EDGES, FACE_CORNERS, Lanes, N_EDGES, Rows, UNSURE};

/// Numbers one by one.
#[derive(Clone, Copy, Debug)]
pub(in crate::cells) struct Plain;

impl Lanes for Plain {
    type Four = [f32; 4];
    type Eight = [f32; 8];

    #[inline(always)]
    fn see(self, rows: &Rows, nodes: [Vec4; 4]) -> [[f32; 4]; 3] {
        rows.map(|[x, y, z, add]| nodes.map(|node| ((node.x * x + node.y * y) + node.z * z) + add))
    }

    #[inline(always)]
    fn join(self, low: [f32; 4], high: [f32; 4]) -> [f32; 8] {
        std::array::from_fn(|i| if i < 4 { low[i] } else { high[i - 4] })
    }

    #[inline(always)]
    fn follow(self, last: [f32; 8], new: [f32; 4], face: usize) -> [f32; 8] {
        let mut next = last;
        for (lower, new) in FACE_CORNERS[face >> 1].into_iter().zip(new) {
            let upper = lower | 1 << (face >> 1);
            let (near, far) = if face & 1 == 0 { (lower, upper) } else { (upper, lower) };
            next[near] = last[far];
            next[far] = new;
        }
        next
    }

    #[inline(always)]
    fn areas(self, u: [f32; 8], v: [f32; 8]) -> Areas {
        let mut areas = Areas { areas: [0.0; 24], signs: 0, is_unsure: false };
        for (i, [a, b]) in EDGES.into_iter().enumerate().take(N_EDGES) {
            let less = u[b] * v[a];
            let area = u[a] * v[b] - less;
            areas.areas[i] = area;
            areas.signs |= u32::from(area > 0.0) << i;
            areas.is_unsure |= area.abs() <= less.abs() * UNSURE;
        }
        areas
    }

    #[inline(always)]
    fn array(self, numbers: [f32; 8]) -> [f32; 8] {
        numbers
    }
}
