//! Arithmetic of a cell's eight corners at once.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod plain;

use brickfield_core::glam::Vec4;

pub(super) use plain::Plain;

/// The edges of a cell, then the diagonals of its faces, lower corner first; lanes of eight, the last ones idle.
pub(super) const EDGES: [[usize; 2]; 24] = {
    let all = [
        [0, 1],
        [2, 3],
        [4, 5],
        [6, 7],
        [0, 2],
        [1, 3],
        [4, 6],
        [5, 7],
        [0, 4],
        [1, 5],
        [2, 6],
        [3, 7],
        [0, 6],
        [1, 7],
        [0, 5],
        [2, 7],
        [0, 3],
        [4, 7],
    ];
    let mut edges = [[0, 1]; 24];
    let mut i = 0;
    while i < N_EDGES {
        edges[i] = all[i];
        i += 1;
    }
    edges
};
pub(super) const N_EDGES: usize = 18;

/// The corners of the lower face along each axis; those of the upper face have the axis' bit as well.
pub(super) const FACE_CORNERS: [[usize; 4]; 3] = [[0, 2, 4, 6], [0, 1, 4, 5], [0, 1, 2, 3]];

/// A sign is sure if its number is above this part of one of the two products that it is the difference of: each of three roundings is at
/// most 2^-24 of a product or of the difference.
const UNSURE: f32 = 1.0 / (1 << 22) as f32;

/// Three rows that make u, v and w of x, y, z and 1.
pub(super) type Rows = [[f32; 4]; 3];

/// For each edge, u of its lower corner times v of its upper one, less v times u.
#[derive(Clone, Copy)]
pub(super) struct Areas {
    pub(super) areas: [f32; 24],
    /// Bit i: that of edge i is above 0.
    pub(super) signs: u32,
    /// Whether rounding may have turned a sign.
    pub(super) is_unsure: bool,
}

/// Four and eight numbers of an instruction set. The same number comes of the same node, in whichever lane it is.
pub(super) trait Lanes: Copy + Send + Sync {
    type Four: Copy;
    type Eight: Copy;

    /// u, v and w of four nodes.
    fn see(self, rows: &Rows, nodes: [Vec4; 4]) -> [Self::Four; 3];

    /// The numbers of corners 0 to 3, and 4 to 7.
    fn join(self, low: Self::Four, high: Self::Four) -> Self::Eight;

    /// The numbers of the next cell's corners: those at `face`, where it is entered, are the last cell's at the opposite one; the others are
    /// new, in the order of [`FACE_CORNERS`].
    fn follow(self, last: Self::Eight, new: Self::Four, face: usize) -> Self::Eight;

    fn areas(self, u: Self::Eight, v: Self::Eight) -> Areas;

    fn array(self, numbers: Self::Eight) -> [f32; 8];
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(first: usize) -> [Vec4; 4] {
        std::array::from_fn(|i| {
            let x = (first + i) as f32;
            Vec4::new(x.sin(), (2.0 * x).cos(), (3.0 * x + 0.5).sin(), 9.0)
        })
    }

    const ROWS: Rows = [[0.3, -0.5, 0.8, 0.1], [0.9, 0.2, -0.3, -0.2], [0.1, 0.8, 0.6, 0.4]];

    /// All that a set of lanes makes of some corners, and of the next cell's behind each face.
    fn all<L: Lanes>(lanes: L) -> Vec<f32> {
        let [low, high, new] = [0, 4, 8].map(|first| lanes.see(&ROWS, nodes(first)));
        let [u, v, w]: [L::Eight; 3] = std::array::from_fn(|i| lanes.join(low[i], high[i]));
        let mut numbers: Vec<f32> = [u, v, w].into_iter().flat_map(|x| lanes.array(x)).collect();
        let areas = lanes.areas(u, v);
        numbers.extend(&areas.areas[..N_EDGES]);
        numbers.extend([areas.signs as f32, f32::from(areas.is_unsure)]);
        numbers.extend((0..6).flat_map(|face| lanes.array(lanes.follow(u, new[0], face))));
        numbers
    }

    #[test]
    fn corners_at_a_face_are_kept_and_the_others_are_new() {
        let plain = all(Plain);
        let (u, next) = (&plain[..8], &plain[24 + N_EDGES + 2..]);
        let new = Plain.see(&ROWS, nodes(8))[0];
        for (face, next) in next.chunks(8).enumerate() {
            for (i, lower) in FACE_CORNERS[face / 2].into_iter().enumerate() {
                let upper = lower | 1 << (face / 2);
                let (near, far) = if face % 2 == 0 { (lower, upper) } else { (upper, lower) };
                assert_eq!((next[near], next[far]), (u[far], new[i]));
            }
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn vectors_make_what_plain_numbers_make() {
        let Some(simd) = pulp::x86::V3::try_new() else { return };
        for (a, b) in all(Plain).into_iter().zip(all(simd)) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}
