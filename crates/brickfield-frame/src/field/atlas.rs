//! Bricks of one size in a 3-D texture.

use brickfield_core::BrickSide;
use brickfield_core::glam::UVec3;

/// How slots lie in a 3-D texture: slot s at (s mod x, s / x mod y, s / (x y)), in bricks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtlasShape {
    /// Bricks along x, y, z.
    pub bricks: UVec3,
    /// Samples along a brick's side.
    pub side: BrickSide,
}

impl AtlasShape {
    /// One brick, which nobody reads.
    pub const fn least(side: BrickSide) -> AtlasShape {
        AtlasShape { bricks: UVec3::ONE, side }
    }

    /// The smallest atlas that holds so many bricks in a texture of at most `max_texels` a side; at least one brick.
    ///
    /// `None` if no such atlas can.
    pub fn fit(n_bricks: u32, side: BrickSide, max_texels: u32) -> Option<AtlasShape> {
        let n = n_bricks.max(1);
        let most = max_texels / side.n_samples();
        let x = (f64::from(n).cbrt().ceil() as u32).min(most);
        if x == 0 {
            return None;
        }
        let y = (f64::from(n.div_ceil(x)).sqrt().ceil() as u32).min(most);
        let z = n.div_ceil(x * y);
        (z <= most).then_some(AtlasShape { bricks: UVec3::new(x, y, z), side })
    }

    /// The atlas with more layers, so that it holds `n_bricks` and some more; every slot stays where it is.
    ///
    /// `None` if it would need more texels along z than `max_texels`.
    pub fn grown(&self, n_bricks: u32, max_texels: u32) -> Option<AtlasShape> {
        let (needed, most) = (n_bricks.div_ceil(self.bricks.x * self.bricks.y), max_texels / self.side.n_samples());
        let z = (self.bricks.z + self.bricks.z.div_ceil(4)).max(needed).min(most);
        (z >= needed).then_some(AtlasShape { bricks: self.bricks.with_z(z), side: self.side })
    }

    /// Number of bricks that it has room for.
    pub fn n_bricks(&self) -> u32 {
        self.bricks.element_product()
    }

    /// The texture's size in texels.
    pub fn texels(&self) -> UVec3 {
        self.bricks * self.side.n_samples()
    }

    /// Where a slot's first texel lies.
    pub fn origin(&self, slot: u32) -> UVec3 {
        let UVec3 { x, y, .. } = self.bricks;
        UVec3::new(slot % x, slot / x % y, slot / (x * y)) * self.side.n_samples()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_atlas_holds_every_slot_once() {
        for n in [0, 1, 2, 9, 100, 1000, 4096] {
            let atlas = AtlasShape::fit(n, BrickSide::S32, 2048).unwrap();
            assert!(atlas.n_bricks() >= n && atlas.texels().max_element() <= 2048);
            let last = atlas.origin(n.saturating_sub(1));
            assert!((last + 32).cmple(atlas.texels()).all());
        }
        assert_eq!(AtlasShape::fit(65 * 64 * 64, BrickSide::S32, 2048), None);
        assert_eq!(AtlasShape::fit(1, BrickSide::S64, 32), None);
    }

    #[test]
    fn a_grown_atlas_leaves_every_slot_where_it_is() {
        let atlas = AtlasShape::fit(100, BrickSide::S16, 2048).unwrap();
        let grown = atlas.grown(atlas.n_bricks() + 1, 2048).unwrap();
        assert!(grown.n_bricks() > atlas.n_bricks());
        assert!((0..atlas.n_bricks()).all(|slot| atlas.origin(slot) == grown.origin(slot)));
        assert_eq!(atlas.grown(1 << 20, 128), None);
    }
}
