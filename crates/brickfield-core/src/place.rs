//! Where the samples of a part of a field lie: in a texture, and in space.

use glam::{DVec3, UVec3};

use crate::Level;

/// Where a slot's samples lie.
///
/// ```text
/// texture            space, samples of level 0
/// +-----------+      first       first + 2^level
/// |  texel    |        o ---------- o ---------- o
/// |   +--n--+ |        0            1            2    sample of the slot
/// |   |     | |
/// |   +-----+ |      A sample that was picked lies at 2^l i: first = 2^l * (number of the slot's first sample).
/// +-----------+      An average lies in the middle of the samples it averages: first = 2^l i + (2^l - 1) / 2.
/// ```
///
/// The last sample may lie nearer to the last but one, where it averages less: at the upper ends of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The first texel, along the texture's axes.
    pub texel: UVec3,
    /// Samples along the texture's axes; at least 1 each.
    pub n: UVec3,
    /// Resolution: neighbouring samples are 2^level samples of level 0 apart.
    pub level: Level,
    /// Where the first sample lies, in sample space.
    pub first: DVec3,
    /// Where the last sample lies.
    pub last: DVec3,
    /// Which axis of space each axis of the texture runs along.
    pub axes: Axes,
}

/// A permutation of the axes: which axis of space each axis of a texture runs along.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Axes {
    #[default]
    Xyz,
    Xzy,
    Yxz,
    Yzx,
    Zxy,
    Zyx,
}

impl Axes {
    /// All permutations.
    pub const ALL: [Axes; 6] = [Axes::Xyz, Axes::Xzy, Axes::Yxz, Axes::Yzx, Axes::Zxy, Axes::Zyx];

    /// For each axis of the texture, the axis of space that it runs along.
    #[inline]
    pub const fn of_texture(self) -> [usize; 3] {
        match self {
            Axes::Xyz => [0, 1, 2],
            Axes::Xzy => [0, 2, 1],
            Axes::Yxz => [1, 0, 2],
            Axes::Yzx => [1, 2, 0],
            Axes::Zxy => [2, 0, 1],
            Axes::Zyx => [2, 1, 0],
        }
    }

    /// From space to the texture.
    #[inline]
    pub fn to_texture(self, space: DVec3) -> DVec3 {
        DVec3::from(self.of_texture().map(|axis| space[axis]))
    }

    /// From the texture to space.
    #[inline]
    pub fn to_space(self, texture: UVec3) -> UVec3 {
        let mut space = UVec3::ZERO;
        for (axis, of_space) in self.of_texture().into_iter().enumerate() {
            space[of_space] = texture[axis];
        }
        space
    }
}

impl Place {
    /// A place of samples that are all 2^level apart, whose texture runs along the axes of space.
    pub fn even(texel: UVec3, n: UVec3, level: Level, first: DVec3) -> Place {
        let last = first + (n.as_dvec3() - 1.0) * f64::from(level.stride());
        Place { texel, n, level, first, last, axes: Axes::Xyz }
    }

    /// A sample position in units of the slot's own samples, along the axes of space.
    #[inline]
    pub fn local(&self, sample_position: DVec3) -> DVec3 {
        let stride = f64::from(self.level.stride());
        let local = (sample_position - self.first) / stride;
        let before_last = self.n_in_space().as_dvec3() - 2.0;
        // The last two are not farther apart than others.
        let last_gap = self.last - (self.first + before_last * stride);
        let past = (local - before_last) * stride / last_gap;
        DVec3::select(local.cmpgt(before_last) & last_gap.cmplt(DVec3::splat(stride)), before_last + past, local)
    }

    /// Whether all samples are 2^level apart.
    pub fn is_even(&self) -> bool {
        self.last
            == Place { axes: self.axes, ..Place::even(self.texel, self.n_in_space(), self.level, self.first) }.last
    }

    /// Samples along the axes of space.
    #[inline]
    pub fn n_in_space(&self) -> UVec3 {
        self.axes.to_space(self.n)
    }

    /// Samples in all.
    pub fn n_samples(&self) -> usize {
        self.n.to_array().into_iter().map(|n| n as usize).product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_there_and_back_are_the_identity() {
        let space = UVec3::new(5, 7, 11);
        for axes in Axes::ALL {
            let texture = axes.to_texture(space.as_dvec3()).as_uvec3();
            assert_eq!(axes.to_space(texture), space, "{axes:?}");
        }
        assert_eq!(Axes::Yzx.to_texture(DVec3::new(1.0, 2.0, 3.0)), DVec3::new(2.0, 3.0, 1.0));
    }

    #[test]
    fn an_average_lies_in_the_middle_of_its_samples() {
        let place = Place::even(UVec3::ZERO, UVec3::splat(8), Level(2), DVec3::splat(1.5));
        assert_eq!((place.local(DVec3::splat(5.5)), place.is_even()), (DVec3::ONE, true));
    }

    #[test]
    fn the_last_sample_may_be_nearer() {
        // 10 samples in threes of four, the last of two.
        let place =
            Place { last: DVec3::splat(8.5), ..Place::even(UVec3::ZERO, UVec3::splat(3), Level(2), DVec3::splat(1.5)) };
        let at = [(1.5, 0.0), (5.5, 1.0), (7.0, 1.5), (8.5, 2.0)];
        assert!(at.into_iter().all(|(q, s)| (place.local(DVec3::splat(q)) - s).abs().max_element() < 1e-15));
        assert!(!place.is_even());
    }
}
