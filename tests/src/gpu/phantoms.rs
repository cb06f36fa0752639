//! The phantoms that parts share: a small one takes longer than the octree of a large one.

use std::collections::BTreeMap;
use std::sync::Arc;

use brickfield_core::glam::UVec3;
use brickfield_core::{ScalarType, Volume};

use crate::volumes::{enlarge, phantom_of};

/// The largest that is evaluated voxel by voxel; larger ones are made of it.
const EVALUATED: u32 = 256;

/// The phantoms of 8 bits that were evaluated so far, by the voxels along their sides.
#[derive(Default)]
pub(super) struct Phantoms(BTreeMap<u32, Arc<Volume>>);

impl Phantoms {
    /// A phantom of so many voxels along each side. Above 256 these are a multiple of 256.
    pub(super) fn of(&mut self, voxels: u32) -> Arc<Volume> {
        let factor = (voxels / EVALUATED).max(1);
        let evaluated = self.evaluated(voxels / factor);
        if factor == 1 { evaluated } else { Arc::new(enlarge(&evaluated, factor)) }
    }

    fn evaluated(&mut self, voxels: u32) -> Arc<Volume> {
        let make = || Arc::new(phantom_of(UVec3::splat(voxels), ScalarType::U8).volume);
        Arc::clone(self.0.entry(voxels).or_insert_with(make))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phantom_is_evaluated_once_and_large_ones_are_made_of_it() {
        let small = Arc::new(phantom_of(UVec3::splat(8), ScalarType::U8).volume);
        // A stand-in for the one of 256^3.
        let mut phantoms = Phantoms(BTreeMap::from([(EVALUATED, Arc::clone(&small))]));
        assert!(Arc::ptr_eq(&phantoms.of(256), &small));
        assert_eq!(phantoms.of(512).grid().dims(), UVec3::splat(16));
        assert!(Arc::ptr_eq(&phantoms.of(9), &phantoms.of(9)) && phantoms.of(9).grid().dims() == UVec3::splat(9));
    }
}
