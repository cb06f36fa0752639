//! Proxy geometry: the polygons on which a frame's samples are rasterised (LaMar, Hamann and Joy 1999, section 4.2).

mod picture;
mod polygon;
mod surfaces;

use std::ops::Range;

use brickfield_core::glam::UVec3;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use crate::{ContentId, FramePlan, Lengths};
use picture::Projector;
use polygon::area;
use surfaces::{Outline, outlines};

/// The polygons of a frame, brick by brick from back to front, clipped to their bricks and to the picture.
///
/// Drawn in this order and blended over each other, they make the picture. A polygon is where a surface of the plan's
/// [`Placement`](crate::Placement) cuts a brick, and its fragments are the segments that end there; the faces through which rays leave the
/// brick are polygons, too, of the segments that end with the brick. So every segment of every ray is one fragment. (With
/// [`Lengths::Nominal`] polygons are the segments' middles, and faces none.)
///
/// Polygons are projected, and grown by an eighth of a pixel and by the distance that f32 may put a ray beside its pixel
/// ([`RayFrame::rounding`](crate::RayFrame::rounding)): which fragments count is decided by the shader from the ray; rasterisers round corners to 1/256 of a
/// pixel.
///
/// With [`Slices::InteriorsFirst`] each polygon comes twice.
#[derive(Clone, Debug)]
pub struct ProxyGeometry {
    target: Target,
    slices: Slices,
    bricks: Vec<[u32; 4]>,
    corners: Vec<ProxyCorner>,
    indices: Vec<u32>,
    batches: Vec<Range<u32>>,
    n_polygons: usize,
    id: ContentId,
}

/// The pixel format that polygons are blended into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Target {
    /// Four floats of 32 bits.
    #[default]
    Float32,
    /// Four floats of 16 bits: half the memory; the sum is rounded to 11 bits at every fragment.
    Float16,
}

/// The order in which a polygon's fragments are drawn, where flat blocks are blended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Slices {
    /// All at once: each fragment asks for itself whether other blocks count.
    #[default]
    Together,
    /// First the fragments whose samples lie among the block's own, then those between blocks (Ljung, Lundstroem and Ynnerman 2006,
    /// section 4): the same picture.
    InteriorsFirst,
}

/// A polygon's corner as shaders read it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ProxyCorner {
    /// In pixels from the picture's upper left corner.
    pub pixel: [f32; 2],
    /// The number of the surface; [`ProxyCorner::EXIT`] for a face through which rays leave the brick.
    pub surface: f32,
    /// Place in [`ProxyGeometry::bricks`]; where polygons come twice, twice that, plus one the second time.
    pub brick: u32,
    /// The part that a ray must meet, too, for its fragment to count: the facet or stack of planes that the surface belongs to; the exit
    /// itself, twice its axis, plus one for the upper face.
    pub owner: u32,
}

impl ProxyCorner {
    /// The surface number of a brick's faces.
    pub const EXIT: f32 = -1.0;
}

impl Target {
    /// `rgba32float` or `rgba16float`.
    pub const fn name(self) -> &'static str {
        match self {
            Target::Float32 => "rgba32float",
            Target::Float16 => "rgba16float",
        }
    }

    /// Bytes of a pixel.
    pub const fn pixel_bytes(self) -> usize {
        match self {
            Target::Float32 => 16,
            Target::Float16 => 8,
        }
    }

    /// The pixels in bytes of this format, as far as there are both.
    pub fn read(self, bytes: &[u8], pixels: &mut [[f32; 4]]) {
        let n_pixels = pixels.len().min(bytes.len() / self.pixel_bytes());
        let (bytes, pixels) = (&bytes[..n_pixels * self.pixel_bytes()], &mut pixels[..n_pixels]);
        match self {
            Target::Float32 => bytemuck::cast_slice_mut(pixels).copy_from_slice(bytes),
            Target::Float16 => {
                let channels = bytes.chunks_exact(2).map(|b| half::f16::from_le_bytes([b[0], b[1]]).to_f32());
                pixels.as_flattened_mut().iter_mut().zip(channels).for_each(|(to, from)| *to = from);
            }
        }
    }
}

/// Most fragments in a batch, about.
const BATCH_FRAGMENTS: f64 = (1u32 << 24) as f64;

impl ProxyGeometry {
    /// The polygons of a plan whose resident bricks hold the index cells `back_to_front`, one cell for each brick.
    ///
    /// Cost: 1 to 2 us a polygon on two cores; all threads of the current rayon pool are used.
    pub(crate) fn of(plan: &FramePlan, back_to_front: &[UVec3], target: Target, slices: Slices) -> ProxyGeometry {
        let slices = if plan.field.blends_between() { slices } else { Slices::Together };
        let projector = Projector::new(plan);
        let of_brick = |cell: &UVec3| outlines(plan, &projector, *cell);
        let outlines: Vec<Vec<Outline>> = back_to_front.par_iter().map(of_brick).collect();
        let word = |cell: UVec3| [cell.x, cell.y, cell.z, plan.field.index().at(cell).pack()];
        let mut geometry = ProxyGeometry {
            target,
            slices,
            bricks: back_to_front.iter().map(|cell| word(*cell)).collect(),
            corners: Vec::new(),
            indices: Vec::new(),
            batches: Vec::new(),
            n_polygons: 0,
            id: ContentId::new(),
        };
        geometry.fill(&outlines, BATCH_FRAGMENTS);
        geometry
    }

    /// The same polygons in batches of at most `n_triangles` (at least 1): the picture is the same. Those of a new plan are
    /// so large that only large pictures have several.
    #[must_use]
    pub fn in_batches_of(mut self, n_triangles: u32) -> ProxyGeometry {
        let (end, n) = (self.indices.len() as u32, n_triangles.clamp(1, u32::MAX / 3) * 3);
        self.batches = (0..end).step_by(n as usize).map(|start| start..end.min(start.saturating_add(n))).collect();
        self
    }

    fn fill(&mut self, outlines: &[Vec<Outline>], batch_fragments: f64) {
        let n_times = match self.slices {
            Slices::Together => 1,
            Slices::InteriorsFirst => 2,
        };
        let (mut batch_start, mut n_fragments) = (0, 0.0);
        for (brick, outline) in outlines.iter().enumerate().flat_map(|(i, of)| of.iter().map(move |o| (i, o))) {
            let brick = n_times * brick as u32;
            n_fragments += (brick..brick + n_times).map(|brick| self.push(brick, outline)).sum::<f64>();
            self.n_polygons += 1;
            if n_fragments >= batch_fragments {
                self.batches.push(batch_start..self.indices.len() as u32);
                (batch_start, n_fragments) = (self.indices.len() as u32, 0.0);
            }
        }
        if batch_start < self.indices.len() as u32 {
            self.batches.push(batch_start..self.indices.len() as u32);
        }
    }

    /// Adds a polygon as a fan of triangles; its area in pixels.
    fn push(&mut self, brick: u32, outline: &Outline) -> f64 {
        let Outline { ref points, surface, owner } = *outline;
        let (first, n) = (self.corners.len() as u32, points.len() as u32);
        self.corners.extend(points.iter().map(|p| ProxyCorner {
            pixel: p.as_vec2().to_array(),
            surface,
            brick,
            owner,
        }));
        self.indices.extend((1..n.saturating_sub(1)).flat_map(|i| [first, first + i, first + i + 1]));
        area(points)
    }

    /// The identity of corners, triangles and bricks.
    pub fn id(&self) -> ContentId {
        self.id
    }

    /// The pixel format that the polygons are blended into.
    pub fn target(&self) -> Target {
        self.target
    }

    /// The order of a polygon's fragments.
    pub fn slices(&self) -> Slices {
        self.slices
    }

    /// The bricks from back to front: an index cell, and its word of the index.
    pub fn bricks(&self) -> &[[u32; 4]] {
        &self.bricks
    }

    /// The polygons' corners.
    pub fn corners(&self) -> &[ProxyCorner] {
        &self.corners
    }

    /// Triangles: three corners each, in drawing order.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// The triangles, to change some (a mutant in conformance runs does): from now on they are other polygons.
    pub fn indices_mut(&mut self) -> &mut [u32] {
        self.id = ContentId::new();
        &mut self.indices
    }

    /// Ranges of [`indices`](Self::indices), to be drawn one after the other so that no draw lasts long enough for a driver to end it.
    pub fn batches(&self) -> &[Range<u32>] {
        &self.batches
    }

    /// Number of polygons.
    pub fn n_polygons(&self) -> usize {
        self.n_polygons
    }

    /// Bytes of bricks, corners and indices.
    pub fn n_bytes(&self) -> usize {
        size_of_val(&self.bricks[..]) + size_of_val(&self.corners[..]) + size_of_val(&self.indices[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::DVec2;

    fn squares(sides: &[f64]) -> ProxyGeometry {
        let corners = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
        let square = |side: &f64| Outline { points: corners.map(|p| p * *side).to_vec(), surface: 1.0, owner: 0 };
        let outlines = [sides.iter().map(square).collect()];
        let mut geometry = ProxyGeometry {
            target: Target::Float32,
            slices: Slices::Together,
            bricks: vec![[0; 4]],
            corners: Vec::new(),
            indices: Vec::new(),
            batches: Vec::new(),
            n_polygons: 0,
            id: ContentId::new(),
        };
        geometry.fill(&outlines, 100.0);
        geometry
    }

    #[test]
    fn batches_are_all_triangles_once_and_in_order() {
        // A batch ends with the polygon that fills it.
        assert_eq!(squares(&[6.0, 6.0, 6.0, 1.0, 20.0, 3.0]).batches(), [0..18, 18..30, 30..36]);
        assert!(squares(&[10.0, 1.0]).batches() == [0..6, 6..12] && squares(&[]).batches().is_empty());
    }

    #[test]
    fn smaller_batches_are_all_triangles_once_and_in_order() {
        let of = |n_triangles| squares(&[10.0, 1.0]).in_batches_of(n_triangles).batches().to_vec();
        assert_eq!(of(3), [0..9, 9..12]);
        assert_eq!(of(0), [0..3, 3..6, 6..9, 9..12]);
        assert!(of(4) == of(u32::MAX) && of(4).len() == 1 && of(4)[0] == (0..12));
        assert!(squares(&[]).in_batches_of(1).batches().is_empty());
    }
}
