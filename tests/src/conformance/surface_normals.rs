//! Normals of surface voxels, straight from values: a second opinion on the bytes of a plan, and wrong ones for mutants.
//!
//! From ARCHITECTURE.md, rule 9; shares nothing with the code that makes the bytes.

use brickfield_core::glam::{DVec3, IVec3, UVec3};
use brickfield_core::{TransferFunction, Volume};

/// Which neighbours of a voxel are asked, and what each counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NormalRule {
    /// All 26, by the difference of values: the right one.
    Weighted,
    /// All 26 alike.
    Unweighted,
    /// Those that share a face, by the difference of values.
    OfSix,
}

/// Values, x fastest, and how far apart they lie along each axis.
pub(crate) struct Values<'a> {
    pub(crate) values: Vec<f64>,
    pub(crate) dims: UVec3,
    pub(crate) spacing: DVec3,
    pub(crate) transfer: &'a TransferFunction,
}

/// No normal.
const NONE: [u8; 4] = [127, 127, 127, 0];

impl<'a> Values<'a> {
    /// The voxels of a volume.
    pub(crate) fn of(volume: &Volume, transfer: &'a TransferFunction) -> Values<'a> {
        let grid = volume.grid();
        let values = (0..grid.n_voxels()).map(|i| volume.value(i)).collect();
        Values { values, dims: grid.dims(), spacing: grid.spacing(), transfer }
    }

    /// The four bytes of every voxel.
    pub(crate) fn codes(&self, rule: NormalRule) -> Vec<[u8; 4]> {
        let UVec3 { x: nx, y: ny, z: nz } = self.dims;
        let rows = (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z)));
        rows.flat_map(|(y, z)| (0..nx).map(move |x| IVec3::new(x as i32, y as i32, z as i32)))
            .map(|voxel| self.code(voxel, rule))
            .collect()
    }

    fn value(&self, p: IVec3) -> Option<f64> {
        let is_there = p.min_element() >= 0 && p.cmplt(self.dims.as_ivec3()).all();
        let [x, y, z] = p.to_array().map(|i| i as usize);
        let (nx, ny) = (self.dims.x as usize, self.dims.y as usize);
        is_there.then(|| self.values[(z * ny + y) * nx + x])
    }

    fn is_outside(&self, value: f64) -> bool {
        self.transfer.at(value).extinction == 0.0
    }

    fn code(&self, voxel: IVec3, rule: NormalRule) -> [u8; 4] {
        let own = self.value(voxel).expect("a voxel of the volume");
        if self.is_outside(own) {
            return NONE;
        }
        let (mut inwards, mut weights) = (DVec3::ZERO, 0.0);
        for (dx, dy, dz) in (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| (x, y, z)))) {
            let offset = IVec3::new(dx, dy, dz);
            let n_steps = offset.abs().element_sum();
            let is_asked = match rule {
                NormalRule::Weighted | NormalRule::Unweighted => n_steps > 0,
                NormalRule::OfSix => n_steps == 1,
            };
            let Some(other) = self.value(voxel + offset).filter(|other| is_asked && self.is_outside(*other)) else {
                continue;
            };
            let weight = if rule == NormalRule::Unweighted { 1.0 } else { (own - other).abs() };
            inwards -= offset.as_dvec3() * (weight / f64::from(n_steps).sqrt());
            weights += weight;
        }
        if weights == 0.0 || inwards.length() <= 1e-9 * weights {
            return NONE;
        }
        let direction = (inwards / weights / self.spacing).normalize();
        let [x, y, z] = direction.to_array().map(|c| (127.0 + 127.0 * c).round() as u8);
        [x, y, z, 255]
    }
}
