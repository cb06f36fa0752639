//! Slots in a 3-D texture.

use brickfield_core::BrickSide;
use brickfield_core::glam::UVec3;

use super::{Places, Slots};
use crate::RenderError;

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

/// How a device holds a texture of three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TextureLayout {
    /// A 3-D texture: the texture unit filters along all three axes (fast mode).
    Volume,
    /// A 2-D array with a layer for each z: four neighbours of a layer are read at once, as they are (exact mode).
    Layers,
}

/// How slots lie in a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureShape {
    /// Bricks of one size, by arithmetic.
    Atlas(AtlasShape),
    /// As the table of their places says, in so many texels.
    Table(UVec3),
}

/// The texture that a device needs for slots, and how it comes by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// The texture's shape.
    pub shape: TextureShape,
    /// What happens to the texture that the device holds.
    pub change: RoomChange,
}

/// What happens to the texture that a device holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoomChange {
    /// It has room, and stays.
    Keep,
    /// Its bricks move to a larger one, each to the same place.
    Grow,
    /// It goes before its successor is made: both may not fit the device.
    Replace,
}

/// An atlas with so many times the room that slots need is replaced by a smaller one.
const TOO_LARGE: u32 = 8;

impl TextureShape {
    /// The texture's size in texels.
    pub fn texels(self) -> UVec3 {
        match self {
            TextureShape::Atlas(shape) => shape.texels(),
            TextureShape::Table(texels) => texels,
        }
    }

    /// The arithmetic of evenly placed bricks.
    pub fn atlas(self) -> Option<AtlasShape> {
        match self {
            TextureShape::Atlas(shape) => Some(shape),
            TextureShape::Table(_) => None,
        }
    }

    /// Where a slot's texels lie: the first one, and their number along each axis.
    pub fn texels_of(self, slots: &Slots, slot: u32) -> (UVec3, UVec3) {
        match (slots.places(), self) {
            (Places::Table { places, .. }, _) => (places[slot as usize].texel, places[slot as usize].n),
            (Places::Blocks(places), _) => {
                let place = places.place(places.layout().block(slot as usize));
                (place.texel, place.n)
            }
            (Places::Even(side), TextureShape::Atlas(shape)) => (shape.origin(slot), UVec3::splat(side.n_samples())),
            (Places::Even(side), TextureShape::Table(_)) => (UVec3::ZERO, UVec3::splat(side.n_samples())),
        }
    }
}

impl Slots {
    /// The texture of at most `max_texels` a side that these slots need on a device that holds one of shape `held`, of the same
    /// format.
    ///
    /// # Errors
    /// If no such texture can hold them.
    pub fn room(&self, held: Option<TextureShape>, max_texels: u32) -> Result<Room, RenderError> {
        let side = match self.places() {
            Places::Even(side) => *side,
            Places::Table { texels, .. } => return room_of_table(*texels, held, max_texels),
            Places::Blocks(places) => return room_of_table(places.texels(), held, max_texels),
        };
        let n_bricks = self.n_slots();
        let room = |shape, change| Ok(Room { shape: TextureShape::Atlas(shape), change });
        let held = held.and_then(TextureShape::atlas).filter(|shape| shape.side == side);
        match held {
            Some(shape) if shape.n_bricks() >= n_bricks && shape.n_bricks() / TOO_LARGE <= n_bricks => {
                return room(shape, RoomChange::Keep);
            }
            Some(shape) if shape.n_bricks() < n_bricks => {
                if let Some(grown) = shape.grown(n_bricks, max_texels) {
                    return room(grown, RoomChange::Grow);
                }
            }
            _ => {}
        }
        let too_large = RenderError::AtlasTooLarge { n_bricks, side: side.n_samples(), limit: max_texels };
        room(AtlasShape::fit(n_bricks, side, max_texels).ok_or(too_large)?, RoomChange::Replace)
    }
}

fn room_of_table(texels: UVec3, held: Option<TextureShape>, max_texels: u32) -> Result<Room, RenderError> {
    if texels.max_element() > max_texels {
        return Err(RenderError::TextureTooLarge { texels, limit: max_texels });
    }
    let shape = TextureShape::Table(texels);
    let change = match held {
        Some(held) if held == shape => RoomChange::Keep,
        Some(TextureShape::Table(held)) if held.truncate() == texels.truncate() && held.z < texels.z => {
            RoomChange::Grow
        }
        _ => RoomChange::Replace,
    };
    Ok(Room { shape, change })
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

    #[test]
    fn an_atlas_is_kept_grown_or_replaced() {
        use crate::{Decode, SampleFormat};
        let slots = |n: usize| {
            let decode = Decode { scale: 1.0, offset: 0.0 };
            Slots::even(BrickSide::S16, SampleFormat::Unorm8, decode, &vec![0; n * 4096]).unwrap()
        };
        let first = slots(9).room(None, 256).unwrap();
        assert_eq!(first.change, RoomChange::Replace);
        let after = |n| slots(n).room(Some(first.shape), 256).unwrap();
        assert_eq!((after(9), after(2).change), (Room { change: RoomChange::Keep, ..first }, RoomChange::Keep));
        let far_too_large = slots(1).room(Some(slots(40).room(None, 256).unwrap().shape), 256).unwrap();
        assert_eq!((after(40).change, far_too_large.change), (RoomChange::Grow, RoomChange::Replace));
        assert!(matches!(slots(9).room(None, 16), Err(RenderError::AtlasTooLarge { n_bricks: 9, .. })));
    }
}
