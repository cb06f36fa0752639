//! The phantom: a head with an "F" on its forehead, a ring in its left ear, and a neck that runs out of the volume.
//!
//! Made to be hard where renderers go wrong. A mirrored, flipped or turned picture shows at once; the grid is neither
//! cubic nor isotropic, so that swapped axes and mixed units show too; soft tissue, hard bone and sharp metal lie in and
//! behind each other; the neck is opaque up to the volume's face; about 70 % is empty, so skipping matters.

use std::path::Path;

use brickfield::io::{Format, ReadError, SliceSource, VolumeFacts, WorldFrame};
use brickfield::{Codec, PackError, PackProgress, Packed, pack};
use brickfield_core::glam::{DMat3, DVec3, UVec3};
use brickfield_core::{
    Camera, CameraError, Grid, Knot, Projection, Rescale, ScalarType, TransferFunction, Volume, Voxels,
};

use super::field::coverage;
use super::{Shape, empty, fill_unit, spread};

/// Voxels of the phantom along x, y, z.
pub const PHANTOM_DIMS: UVec3 = UVec3::new(112, 128, 120);

/// Edge lengths of the phantom's box, in millimetres: at [`PHANTOM_DIMS`] the voxels measure 1.6 x 1.6 x 1.8 mm.
const EXTENT_MM: DVec3 = DVec3::new(179.2, 204.8, 216.0);

/// The phantom as a scene: volume, transfer function and view.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Phantom {
    pub volume: Volume,
    pub transfer: TransferFunction,
    pub camera: Camera,
}

/// The phantom of 8 bits at [`PHANTOM_DIMS`].
pub fn phantom() -> Phantom {
    phantom_of(PHANTOM_DIMS, ScalarType::U8)
}

/// The phantom at any resolution, in any scalar type; its size in millimetres stays. A zero dimension counts as one.
pub fn phantom_of(dims: UVec3, scalar: ScalarType) -> Phantom {
    let dims = dims.max(UVec3::ONE);
    let grid = Grid::axis_aligned(dims, EXTENT_MM / dims.as_dvec3()).expect("the phantom's box has an extent");
    let parts = parts();
    let volume = fill_unit(&grid, scalar, |p| value(&parts, p - 0.5 * EXTENT_MM));
    let transfer = phantom_transfer(scalar);
    let camera = phantom_camera(&grid).expect("the phantom's camera looks at its box");
    Phantom { volume, transfer, camera }
}

/// The slices of the phantom at any resolution: each is made when it is asked for, so that the volume is never whole in memory.
pub struct PhantomSlices {
    facts: VolumeFacts,
    parts: Vec<Solid>,
    n_made: u32,
}

impl PhantomSlices {
    /// The slices of [`phantom_of`], sample by sample, up to a rounding of positions. A zero dimension counts as one.
    pub fn new(dims: UVec3, scalar: ScalarType) -> PhantomSlices {
        let dims = dims.max(UVec3::ONE);
        let grid = Grid::axis_aligned(dims, EXTENT_MM / dims.as_dvec3()).expect("the phantom's box has an extent");
        let facts = VolumeFacts {
            grid,
            scalar,
            rescale: Rescale::IDENTITY,
            format: Format::Raw,
            frame: WorldFrame::Plain,
            unit: Some("mm".to_owned()),
            notes: Vec::new(),
            choices: Vec::new(),
        };
        PhantomSlices { facts, parts: parts(), n_made: 0 }
    }
}

impl SliceSource for PhantomSlices {
    fn facts(&self) -> &VolumeFacts {
        &self.facts
    }

    fn next_slices(&mut self, n: u32) -> Result<Voxels, ReadError> {
        let VolumeFacts { grid, scalar, .. } = &self.facts;
        let dims = grid.dims();
        let n = n.min(dims.z - self.n_made);
        if n == 0 {
            return Ok(empty(*scalar));
        }
        let first = (DVec3::new(0.5, 0.5, 0.5 + f64::from(self.n_made))) * grid.spacing();
        let slab = Grid::from_first_sample(dims.with_z(n), grid.spacing(), first, DMat3::IDENTITY);
        let slab = slab.expect("a part of the phantom's box has an extent");
        self.n_made += n;
        Ok(fill_unit(&slab, *scalar, |p| value(&self.parts, p - 0.5 * EXTENT_MM)).into_voxels())
    }
}

/// Packs the phantom of some resolution as a store, slice by slice, without loss.
///
/// # Errors
/// As [`pack`].
pub fn pack_phantom(
    dims: UVec3,
    scalar: ScalarType,
    codec: Codec,
    out: &Path,
    told: &mut dyn FnMut(PackProgress),
) -> Result<Packed, PackError> {
    let mut slices = || Ok(Box::new(PhantomSlices::new(dims, scalar)) as _);
    pack(Path::new("the phantom"), &mut slices, out, codec, told)
}

/// Extinction per millimetre and colour of the phantom's tissues.
pub fn phantom_transfer(scalar: ScalarType) -> TransferFunction {
    let knot = |value, extinction, color| Knot { value, extinction, color };
    let (skin, brain, bone, metal) = ([0.80, 0.42, 0.26], [0.75, 0.22, 0.24], [0.86, 0.78, 0.58], [0.10, 0.34, 0.85]);
    let knots = [
        knot(0.06, 0.0, skin),
        knot(0.16, 0.010, skin),
        knot(0.26, 0.001, skin),
        knot(0.34, 0.0005, brain),
        knot(0.44, 0.008, brain),
        knot(0.50, 0.025, [0.90, 0.45, 0.05]),
        knot(0.58, 0.010, bone),
        knot(0.80, 0.030, bone),
        knot(0.90, 0.030, metal),
        knot(1.00, 0.250, metal),
    ];
    spread(&knots, scalar).expect("the phantom's knots ascend")
}

/// A camera before the face, above and to the right of it.
///
/// # Errors
/// As [`Camera::look_at`].
pub fn phantom_camera(grid: &Grid) -> Result<Camera, CameraError> {
    let center = grid.world_box().center();
    let eye = center + DVec3::new(0.5, -1.0, 0.2).normalize() * 500.0;
    Camera::look_at(eye, center, DVec3::Z, Projection::Perspective { fov_y: 27f64.to_radians() })
}

/// A solid that covers the solids before it in the list.
struct Solid {
    shape: Shape,
    /// Value inside, 0 to 1.
    value: f64,
    /// Width of the edge, in millimetres.
    edge: f64,
}

const AIR: f64 = 0.0;
const SKIN: f64 = 0.24;
const FLUID: f64 = 0.33;
const GREY: f64 = 0.41;
const WHITE: f64 = 0.44;
const BONE: f64 = 0.78;
const METAL: f64 = 1.0;
const SOFT: f64 = 6.0;
const HARD: f64 = 4.0;
const SHARP: f64 = 2.0;

/// The value at `p`, millimetres from the box's centre: x to the right of the picture (the head's left), y into the
/// head, z up.
fn value(parts: &[Solid], p: DVec3) -> f64 {
    let painted = parts.iter().fold(AIR, |v, part| {
        let share = coverage(part.shape.distance(p), part.edge);
        v + (part.value - v) * share
    });
    (painted + lesion(p)).min(1.0)
}

/// A smooth swelling in one half of the brain: (1 - r^2)^3.
fn lesion(p: DVec3) -> f64 {
    let r2 = (p - DVec3::new(24.0, 8.0, 34.0)).length_squared() / (18.0 * 18.0);
    0.08 * (1.0 - r2).max(0.0).powi(3)
}

fn parts() -> Vec<Solid> {
    [tissue(), skull(), brain(), metal()].into_iter().flatten().collect()
}

fn part(shape: Shape, value: f64, edge: f64) -> Solid {
    Solid { shape, value, edge }
}

fn ellipsoid(center: [f64; 3], radii: [f64; 3]) -> Shape {
    Shape::Ellipsoid { center: center.into(), radii: radii.into() }
}

fn tissue() -> Vec<Solid> {
    let neck = Shape::Capsule { from: DVec3::new(0.0, 18.0, -140.0), to: DVec3::new(0.0, 18.0, -40.0), radius: 38.0 };
    vec![
        part(neck, SKIN, SOFT),
        part(ellipsoid([0.0, 4.0, 16.0], [70.0, 88.0, 86.0]), SKIN, SOFT),
        part(ellipsoid([0.0, -84.0, -4.0], [11.0, 16.0, 17.0]), SKIN, SOFT),
        part(ellipsoid([71.0, 14.0, 4.0], [9.0, 14.0, 21.0]), SKIN, SOFT),
    ]
}

fn skull() -> Vec<Solid> {
    let spine = |z: f64| part(ellipsoid([0.0, 34.0, z], [13.0, 14.0, 8.0]), BONE, HARD);
    let jaw = Shape::Torus { center: DVec3::new(0.0, -20.0, -44.0), axis: DVec3::Z, radius: 36.0, thickness: 7.0 };
    let mut parts = vec![
        part(jaw, BONE, HARD),
        part(ellipsoid([0.0, 6.0, 22.0], [62.0, 79.0, 73.0]), BONE, HARD),
        part(ellipsoid([0.0, 6.0, 22.0], [55.0, 72.0, 66.0]), FLUID, HARD),
        part(Shape::sphere(DVec3::new(-25.0, -68.0, 8.0), 15.0), SKIN, HARD),
        part(Shape::sphere(DVec3::new(25.0, -68.0, 8.0), 15.0), SKIN, HARD),
    ];
    parts.extend([-58.0, -78.0, -98.0].map(spine));
    parts
}

fn brain() -> Vec<Solid> {
    vec![
        part(ellipsoid([-26.0, 8.0, 26.0], [23.0, 60.0, 52.0]), GREY, SOFT),
        part(ellipsoid([26.0, 8.0, 26.0], [23.0, 60.0, 52.0]), WHITE, SOFT),
        part(ellipsoid([-22.0, 6.0, 26.0], [7.0, 28.0, 12.0]), FLUID, SOFT),
    ]
}

/// An F, upright and legible from the front, and an ear ring.
fn metal() -> Vec<Solid> {
    let bar = |x: f64, z: f64, half: [f64; 3]| {
        let shape = Shape::Block { center: DVec3::new(x, -76.0, z), half: half.into(), x: DVec3::X, y: DVec3::Y };
        part(shape, METAL, SHARP)
    };
    let ring = Shape::Torus { center: DVec3::new(78.0, 10.0, -28.0), axis: DVec3::Y, radius: 9.0, thickness: 2.5 };
    vec![
        bar(-14.0, 52.0, [3.5, 6.0, 20.0]),
        bar(0.0, 68.5, [17.5, 6.0, 3.5]),
        bar(-3.0, 52.0, [12.0, 6.0, 3.5]),
        part(ring, METAL, SHARP),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::Voxels;

    fn bytes(volume: &Volume) -> &[u8] {
        let Voxels::U8(bytes) = volume.voxels() else { panic!("the phantom has 8 bits") };
        bytes
    }

    /// FNV-1a.
    fn hash(bytes: &[u8]) -> u64 {
        bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x100_0000_01b3))
    }

    #[test]
    fn the_phantom_is_the_same_everywhere() {
        assert_eq!(format!("{:016x}", hash(bytes(&phantom().volume))), "289b0d7c02fffca7");
    }

    #[test]
    fn most_of_it_is_empty_and_all_values_occur() {
        let Phantom { volume, transfer, .. } = phantom();
        let seen = |v: u8| transfer.at(f64::from(v)).extinction > 0.0;
        let bytes = bytes(&volume);
        let empty = bytes.iter().filter(|v| !seen(**v)).count() as f64 / bytes.len() as f64;
        assert!((0.6..0.8).contains(&empty), "{empty}");
        assert_eq!((volume.range().min, volume.range().max), (0.0, 255.0));
    }

    #[test]
    fn slices_are_those_of_the_whole() {
        let dims = UVec3::new(30, 34, 37);
        let whole = phantom_of(dims, ScalarType::U8).volume;
        let mut slices = PhantomSlices::new(dims, ScalarType::U8);
        assert_eq!(slices.facts().grid.index_to_world(), whole.grid().index_to_world());
        let mut all = Vec::new();
        while let Voxels::U8(more) = slices.next_slices(16).unwrap()
            && !more.is_empty()
        {
            all.extend(more);
        }
        assert!(all.len() == whole.voxels().len() && all.iter().zip(bytes(&whole)).all(|(a, b)| a.abs_diff(*b) <= 1));
    }

    #[test]
    fn no_mirror_image_is_the_phantom() {
        let dims = UVec3::splat(48);
        let volume = phantom_of(dims, ScalarType::U8).volume;
        let n = dims.x as usize;
        let at = |v: &[u8], p: [usize; 3]| v[p[0] + n * (p[1] + n * p[2])];
        for axis in 0..3 {
            let differ = (0..n * n * n).filter(|i| {
                let p = [i % n, i / n % n, i / n / n];
                let mut q = p;
                q[axis] = n - 1 - p[axis];
                at(bytes(&volume), p).abs_diff(at(bytes(&volume), q)) > 40
            });
            assert!(differ.count() > 200, "axis {axis}");
        }
    }

    #[test]
    fn the_neck_reaches_the_volumes_lower_face() {
        let Phantom { volume, .. } = phantom();
        let lowest = &bytes(&volume)[..(PHANTOM_DIMS.x * PHANTOM_DIMS.y) as usize];
        assert!(lowest.iter().filter(|v| **v > 40).count() > 500);
    }
}
