//! The field that a plan describes, evaluated in f64: the same questions that shaders ask of `package::field`.

use std::marker::PhantomData;

use brickfield_core::Place;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_frame::{FramePlan, IndexEntry};

/// How a sample is read from a slot's bytes.
pub(super) trait Stored: Sync {
    /// The stored number of sample `i` of a slot.
    fn read(bytes: &[u8], i: usize) -> f64;
}

pub(super) struct Unorm8;
pub(super) struct Unorm16;
pub(super) struct Float32;

impl Stored for Unorm8 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        f64::from(bytes[i])
    }
}

impl Stored for Unorm16 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        f64::from(u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]))
    }
}

impl Stored for Float32 {
    #[inline(always)]
    fn read(bytes: &[u8], i: usize) -> f64 {
        let b = &bytes[4 * i..4 * i + 4];
        f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }
}

/// A field: from a position to the patch that owns it, and to the value there.
pub(super) trait FieldReader: Sync {
    /// The plan whose field it is.
    fn plan(&self) -> &FramePlan;

    /// The patch around an index cell.
    fn patch_of(&self, cell: UVec3) -> Patch;

    /// The samples that a patch has around a clamped position; `None` if it is empty.
    fn around(&self, patch: &Patch, q: DVec3) -> Option<Cell>;

    /// The position that the field is evaluated at.
    #[inline]
    fn clamped(&self, q: DVec3) -> DVec3 {
        q.clamp(DVec3::ZERO, self.plan().field().last_sample())
    }

    /// The index cell that owns a position.
    #[inline]
    fn cell_at(&self, q: DVec3) -> UVec3 {
        self.plan().field().cell_at(q)
    }

    /// The data value that a patch has at a clamped position; `None` if it is empty.
    #[inline]
    fn value(&self, patch: &Patch, q: DVec3) -> Option<f64> {
        let cell = self.around(patch, q)?;
        let slots = self.plan().field().slots();
        Some(slots.decode().value(trilinear(&cell) / slots.format().unit()))
    }

    /// The data value at a sample position; `None` where its patch is empty.
    #[inline]
    fn value_at(&self, q: DVec3) -> Option<f64> {
        let q = self.clamped(q);
        self.value(&self.patch_of(self.cell_at(q)), q)
    }

    /// Data values between two stored numbers, without sign.
    fn gain(&self) -> f64 {
        let slots = self.plan().field().slots();
        (slots.decode().scale / slots.format().unit()).abs()
    }
}

/// A part of a field with one way to fetch its values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    /// Its slot and where that one's samples lie; `None` if nothing is visible there.
    slot: Option<(u32, Place)>,
}

/// The eight samples around a position, and where it lies between them.
pub(super) struct Cell {
    /// Stored numbers, x varying fastest.
    pub(super) samples: [f64; 8],
    /// Place in the cell, 0 to 1.
    pub(super) fraction: DVec3,
}

impl Cell {
    /// Least and greatest of the samples.
    pub(super) fn range(&self) -> (f64, f64) {
        self.samples.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)))
    }
}

/// A field whose slots share their border samples ([`Join::Shared`](brickfield_frame::Join::Shared)): every value is one slot's.
pub(super) struct Shared<'a, S> {
    plan: &'a FramePlan,
    stored: PhantomData<S>,
}

impl<'a, S: Stored> Shared<'a, S> {
    pub(super) fn new(plan: &'a FramePlan) -> Self {
        Shared { plan, stored: PhantomData }
    }
}

impl<S: Stored> FieldReader for Shared<'_, S> {
    #[inline]
    fn plan(&self) -> &FramePlan {
        self.plan
    }

    #[inline]
    fn patch_of(&self, cell: UVec3) -> Patch {
        let field = self.plan.field();
        let IndexEntry::Resident { slot, .. } = field.index().at(cell) else { return Patch { slot: None } };
        Patch { slot: field.place_at(cell).map(|place| (slot, place)) }
    }

    #[inline]
    fn around(&self, patch: &Patch, q: DVec3) -> Option<Cell> {
        let (slot, place) = patch.slot?;
        let bytes = self.plan.field().slots().samples(slot)?.bytes();
        let last = place.n_in_space() - 1;
        let s = place.local(q).clamp(DVec3::ZERO, last.as_dvec3());
        let i = s.as_uvec3().min(last.saturating_sub(UVec3::ONE));
        let strides = strides(&place);
        let base: usize = (0..3).map(|axis| i[axis] as usize * strides[axis]).sum();
        // Along an axis with a single sample there is no neighbour.
        let next = [0, 1, 2].map(|axis| if last[axis] > 0 { strides[axis] } else { 0 });
        let corner = |c: usize| (c & 1) * next[0] + (c >> 1 & 1) * next[1] + (c >> 2) * next[2];
        let samples = std::array::from_fn(|c| S::read(bytes, base + corner(c)));
        Some(Cell { samples, fraction: s - i.as_dvec3() })
    }
}

/// How many samples neighbours along each axis of space are apart in a slot.
#[inline]
fn strides(place: &Place) -> [usize; 3] {
    let of_texture = [1, place.n.x as usize, place.n.x as usize * place.n.y as usize];
    let mut strides = [0; 3];
    for (axis, of_space) in place.axes.of_texture().into_iter().enumerate() {
        strides[of_space] = of_texture[axis];
    }
    strides
}

/// Linear along x, then y, then z.
fn trilinear(cell: &Cell) -> f64 {
    let mix = |a: f64, b: f64, f: f64| a + (b - a) * f;
    let (v, f) = (&cell.samples, cell.fraction);
    let x = [0, 2, 4, 6].map(|i| mix(v[i], v[i + 1], f.x));
    mix(mix(x[0], x[1], f.y), mix(x[2], x[3], f.y), f.z)
}
