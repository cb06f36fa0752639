//! Normals of surface voxels, against a slow computation of its own and against surfaces whose normals are known.

mod noise;

use std::sync::Arc;

use brickfield_bricks::{BlockOptions, BlockSource, BlockVolume, SurfaceEdit, SurfaceNormals, build_blocks};
use brickfield_core::glam::{DVec3, IVec3, UVec3};
use brickfield_core::{
    BlockLayout, BlockSide, Companion, Grid, Knot, Level, ScalarType, TransferFunction, Volume, Voxels,
};
use noise::{index, noise, points};
use proptest::prelude::*;

fn blocks(volume: Volume, side: BlockSide) -> BlockVolume {
    build_blocks(Arc::new(volume), &BlockOptions { side, max_bytes: None }).unwrap()
}

fn transfer(knots: &[(f64, f64)]) -> TransferFunction {
    let knot = |&(value, extinction)| Knot { value, extinction, color: [1.0; 3] };
    TransferFunction::new(knots.iter().map(knot).collect()).unwrap()
}

/// Shows the values above one.
fn above(value: f64) -> TransferFunction {
    transfer(&[(value, 0.0), (value + 1.0, 1.0)])
}

fn surface(source: &BlockVolume, transfer: &TransferFunction) -> (SurfaceNormals, SurfaceEdit) {
    SurfaceNormals::none(source).after(source, transfer).unwrap()
}

/// The direction towards the inside at a voxel, along the grid's axes in the world; 0 at others than surface voxels.
fn inwards(volume: &Volume, transfer: &TransferFunction, voxel: UVec3) -> DVec3 {
    let grid = volume.grid();
    let value = |p: UVec3| volume.value(index(grid.dims(), p));
    let is_outside = |p: UVec3| transfer.at(value(p)).extinction == 0.0;
    if is_outside(voxel) {
        return DVec3::ZERO;
    }
    let mut sum = DVec3::ZERO;
    for step in points(UVec3::splat(3)).map(|p| p.as_ivec3() - 1).filter(|step| *step != IVec3::ZERO) {
        let q = voxel.as_ivec3() + step;
        if q.min_element() < 0 || q.cmpge(grid.dims().as_ivec3()).any() || !is_outside(q.as_uvec3()) {
            continue;
        }
        let difference = (value(voxel) - value(q.as_uvec3())).abs();
        sum -= step.as_dvec3() / step.as_dvec3().length() * difference;
    }
    // Sums of whole numbers and square roots that are 0 are 0 up to rounding.
    if sum.length() < 1e-6 { DVec3::ZERO } else { (sum / grid.spacing()).normalize() }
}

fn decoded([x, y, z, root]: [u8; 4]) -> DVec3 {
    (DVec3::new(x.into(), y.into(), z.into()) - 127.0) / 127.0 * (f64::from(root) / 255.0).powi(2)
}

/// What a block has at level 0: the code and the voxel.
fn voxels(source: &BlockVolume, normals: &SurfaceNormals, block: UVec3) -> Vec<([u8; 4], UVec3)> {
    let layout = source.layout();
    let codes = normals.codes(block, Level(0)).unwrap();
    let places = points(layout.extent(block)).map(|p| layout.first_voxel(block) + p);
    codes.as_chunks().0.iter().copied().zip(places).collect()
}

fn all_codes(layout: &BlockLayout, normals: &SurfaceNormals) -> Vec<Vec<u8>> {
    let all = layout.blocks().flat_map(|block| layout.side().levels().map(move |level| (block, level)));
    all.map(|(block, level)| normals.codes(block, level).unwrap()).collect()
}

fn dims() -> impl Strategy<Value = UVec3> {
    let thick = [1u32..24, 1u32..20, 1u32..20].prop_map(UVec3::from);
    prop_oneof![3 => thick, 1 => (1u32..60).prop_map(|n| UVec3::new(1, n, 2))]
}

/// Few values, so that many neighbours are equal.
fn volumes() -> impl Strategy<Value = Volume> {
    (dims(), any::<u64>(), 2u8..=255, [0.2..3.0, 0.2..3.0, 0.2..3.0]).prop_map(|(dims, seed, n_values, spacing)| {
        let full = noise(dims, ScalarType::U8, seed);
        let voxels = (0..full.voxels().len()).map(|i| (full.value(i) as u8) % n_values).collect();
        Volume::new(Grid::axis_aligned(dims, DVec3::from(spacing)).unwrap(), Voxels::U8(voxels)).unwrap()
    })
}

/// Bands, jumps and single dark values.
fn transfers() -> impl Strategy<Value = TransferFunction> {
    prop::collection::vec((0u8..=255, 0u8..2), 1..6).prop_map(|mut knots| {
        knots.sort_by_key(|knot| knot.0);
        knots.dedup_by_key(|knot| knot.0 / 2);
        transfer(&knots.into_iter().map(|(value, shown)| (f64::from(value / 2), f64::from(shown))).collect::<Vec<_>>())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn normals_are_sums_over_outside_neighbours(volume in volumes(), transfer in transfers()) {
        let source = blocks(volume, BlockSide::V8);
        let (normals, _) = surface(&source, &transfer);
        for block in source.layout().blocks() {
            for (code, voxel) in voxels(&source, &normals, block) {
                let expected = inwards(source.volume(), &transfer, voxel);
                prop_assert_eq!(code[3], if expected == DVec3::ZERO { 0 } else { 255 }, "at {}", voxel);
                prop_assert!((decoded(code) - expected).abs().max_element() <= 0.5 / 127.0 + 1e-9, "at {}", voxel);
            }
        }
    }

    #[test]
    fn coarser_normals_are_averages(volume in volumes(), transfer in transfers()) {
        let source = blocks(volume, BlockSide::V8);
        let layout = source.layout();
        let (normals, _) = surface(&source, &transfer);
        for (block, level) in layout.blocks().flat_map(|block| layout.side().levels().map(move |level| (block, level))) {
            let codes = normals.codes(block, level).unwrap();
            let n = layout.n_samples(block, level);
            prop_assert_eq!(codes.len(), 4 * n.element_product() as usize);
            for (code, sample) in codes.as_chunks().0.iter().zip(points(n)) {
                let first = sample * level.stride();
                let end = (first + level.stride()).min(layout.extent(block));
                let covered = points(end - first).map(|p| layout.first_voxel(block) + first + p);
                let sum: DVec3 = covered.map(|voxel| inwards(source.volume(), &transfer, voxel)).sum();
                let expected = sum / f64::from((end - first).element_product());
                // Half a code of each component, twice; half a code of the length's root.
                let half = 0.5 / 255.0;
                let off = 2.0 * 3f64.sqrt() * 0.5 / 127.0 + 2.0 * expected.length().sqrt() * half + half * half;
                prop_assert!((decoded(*code) - expected).length() <= off + 1e-9, "{:?} at {sample} of {block}", level);
            }
        }
    }

    #[test]
    fn after_edits_all_is_as_if_computed_anew(
        volume in volumes(), side in 0usize..2, edits in prop::collection::vec(transfers(), 1..5),
    ) {
        let source = blocks(volume, BlockSide::ALL[side]);
        let (layout, mut edited) = (source.layout(), SurfaceNormals::none(&source));
        for transfer in edits {
            let (after, edit) = edited.after(&source, &transfer).unwrap();
            let (anew, whole) = surface(&source, &transfer);
            prop_assert_eq!(all_codes(layout, &after), all_codes(layout, &anew));
            prop_assert!(edit.n_recomputed <= edit.n_examined && edit.n_examined <= edit.n_voxels);
            prop_assert_eq!((edit.n_voxels, whole.n_voxels), (u64::from(layout.dims().element_product()), edit.n_voxels));
            for (i, block) in layout.blocks().enumerate() {
                let is_same = edited.codes(block, Level(0)).unwrap() == after.codes(block, Level(0)).unwrap();
                prop_assert_eq!(edit.changed.contains(&i), !is_same, "block {}", block);
            }
            let (_, nothing) = after.after(&source, &transfer).unwrap();
            prop_assert_eq!((nothing.n_examined, nothing.n_recomputed, nothing.changed.len()), (0, 0, 0));
            edited = after;
        }
    }
}

#[test]
fn a_small_edit_recomputes_few_voxels() {
    // Values rise along x: each edit moves the surface by one voxel of 64.
    let dims = UVec3::new(64, 24, 20);
    let source = blocks(noise::volume(dims, Voxels::U8(points(dims).map(|p| 2 * p.x as u8).collect())), BlockSide::V8);
    let (before, _) = surface(&source, &above(54.0));
    let (_, edit) = before.after(&source, &above(56.0)).unwrap();
    // Slices 27 to 29; slice 28 has become transparent.
    assert_eq!((edit.n_voxels, edit.n_recomputed), (64 * 24 * 20, 3 * 24 * 20));
    // Of eight blocks along x two: the fourth, and the fifth beside it. All of the third is transparent.
    assert_eq!(edit.n_examined, 2 * 8 * 24 * 20);
    let changed: Vec<usize> = (0..72).filter(|i| source.layout().block(*i).x == 3).collect();
    assert_eq!(edit.changed, changed);
}

#[test]
fn an_edit_that_makes_no_value_transparent_reads_nothing() {
    let source = blocks(noise(UVec3::new(30, 20, 10), ScalarType::U8, 7), BlockSide::V8);
    let (before, _) = surface(&source, &transfer(&[(100.0, 0.0), (200.0, 1.0)]));
    let (_, edit) = before.after(&source, &transfer(&[(100.0, 0.0), (150.0, 0.4), (200.0, 0.9)])).unwrap();
    assert_eq!((edit.n_examined, edit.n_recomputed, edit.changed), (0, 0, vec![]));
}

/// As in figure 9: eight neighbours of a voxel in a plane, of which three are outside.
#[test]
fn a_normal_in_a_plane_is_the_one_worked_by_hand() {
    // From the lowest row to the highest.
    let values = vec![9, 9, 9, 0, 8, 9, 1, 2, 9];
    let volume = noise::volume(UVec3::new(3, 3, 1), Voxels::U8(values));
    let source = blocks(volume, BlockSide::V8);
    let (normals, _) = surface(&source, &above(2.0));
    let [centre] = [normals.codes(UVec3::ZERO, Level(0)).unwrap()].map(|codes| codes.as_chunks::<4>().0[4]);
    // Left: 8 (-1, 0). Above: 6 (0, 1). Between them: 7 (-1, 1) / sqrt(2). The sum is (-12.95, 10.95), its length 16.96.
    let normal = -decoded(centre);
    assert!((normal - DVec3::new(-0.7636, 0.6457, 0.0)).abs().max_element() < 0.5 / 127.0 + 1e-4, "{normal}");
    assert_eq!(centre, [224, 45, 127, 255]);
}

#[test]
fn a_half_space_has_its_own_normal() {
    let dims = UVec3::new(20, 20, 20);
    for (axis, spacing) in (0..3).flat_map(|axis| [DVec3::ONE, DVec3::new(1.0, 2.0, 0.5)].map(|s| (axis, s))) {
        let grid = Grid::axis_aligned(dims, spacing).unwrap();
        let voxels = points(dims).map(|p| if p[axis] < 11 { 200u8 } else { 10 }).collect::<Vec<u8>>();
        let source = blocks(Volume::new(grid, voxels).unwrap(), BlockSide::V8);
        let (normals, _) = surface(&source, &above(100.0));
        // Away from the volume's faces, where half of the neighbours are missing.
        let is_within = |p: &UVec3| (0..3).all(|a| a == axis || (1..19).contains(&p[a]));
        for block in source.layout().blocks() {
            for (code, p) in voxels_within(&source, &normals, block, is_within) {
                let expected = if p[axis] == 10 { -DVec3::AXES[axis] } else { DVec3::ZERO };
                assert_eq!(decoded(code), expected, "{p}, axis {axis}");
            }
        }
    }
}

fn voxels_within(
    source: &BlockVolume,
    normals: &SurfaceNormals,
    block: UVec3,
    is_within: impl Fn(&UVec3) -> bool,
) -> Vec<([u8; 4], UVec3)> {
    voxels(source, normals, block).into_iter().filter(|(_, p)| is_within(p)).collect()
}

/// Of a ball in voxels of any shape, most normals are near those of the sphere.
#[test]
fn a_ball_has_normals_that_point_outwards() {
    for (spacing, bound) in [(DVec3::ONE, 7.0), (DVec3::new(1.0, 1.0, 2.5), 10.0), (DVec3::new(0.6, 1.0, 1.5), 9.0)] {
        let dims = (DVec3::splat(40.0) / spacing).as_uvec3();
        let grid = Grid::axis_aligned(dims, spacing).unwrap();
        let (center, radius) = (0.5 * dims.as_dvec3() * spacing + DVec3::new(0.31, -0.27, 0.42), 14.0);
        let at = |p: UVec3| grid.index_to_world().transform_point3(p.as_dvec3() + 0.5) - center;
        let value = |p: UVec3| (255.0 / (1.0 + (at(p).length() - radius).exp())).round() as u8;
        let source = blocks(Volume::new(grid, points(dims).map(value).collect::<Vec<u8>>()).unwrap(), BlockSide::V8);
        let (normals, _) = surface(&source, &above(128.0));
        let all = source.layout().blocks().flat_map(|block| voxels(&source, &normals, block));
        let mut degrees: Vec<f64> = all
            .filter(|(code, _)| code[3] > 0)
            .map(|(code, p)| (-decoded(code)).angle_between(at(p)).to_degrees())
            .collect();
        degrees.sort_by(f64::total_cmp);
        let median = degrees[degrees.len() / 2];
        assert!(degrees.len() > 1000 && median < bound, "{spacing}: {median} of {}", degrees.len());
    }
}

#[test]
fn between_two_outside_voxels_there_is_no_normal() {
    let source = blocks(noise::volume(UVec3::new(3, 1, 1), Voxels::U8(vec![1, 9, 1])), BlockSide::V8);
    let (normals, edit) = surface(&source, &above(4.0));
    assert_eq!(normals.codes(UVec3::ZERO, Level(0)).unwrap(), [127, 127, 127, 0].repeat(3));
    assert_eq!((normals.n_bytes(), edit.changed.len()), (0, 0));
}

#[test]
fn extreme_values_have_finite_normals() {
    let of = |values: Vec<f64>| blocks(noise::volume(UVec3::new(3, 1, 1), Voxels::F64(values)), BlockSide::V8);
    for (values, knots) in [
        (vec![f64::MIN, f64::MAX, f64::MAX], [(-1.0, 0.0), (1.0, 1.0)]),
        (vec![0.0, 5e-324, 5e-324], [(0.0, 0.0), (5e-324, 1.0)]),
    ] {
        let source = of(values);
        let (normals, _) = surface(&source, &transfer(&knots));
        let codes = normals.codes(UVec3::ZERO, Level(0)).unwrap();
        assert_eq!(codes, [[127, 127, 127, 0], [254, 127, 127, 255], [127, 127, 127, 0]].concat());
    }
}

#[test]
fn normals_come_from_their_own_table() {
    let source = blocks(noise(UVec3::new(20, 9, 5), ScalarType::U8, 3), BlockSide::V8);
    let error = source.fetch_companion(Companion::SurfaceNormal, UVec3::ZERO, Level(0), &mut Vec::new()).unwrap_err();
    assert!(error.to_string().contains("no surface normals"), "{error}");
    let (normals, _) = surface(&source, &above(100.0));
    assert!(normals.codes(UVec3::new(3, 0, 0), Level(0)).is_err() && normals.codes(UVec3::ZERO, Level(4)).is_err());
    let other = blocks(noise(UVec3::new(20, 9, 5), ScalarType::U8, 4), BlockSide::V8);
    let (of_other, _) = normals.after(&other, &above(100.0)).unwrap();
    assert!(of_other.is_of(&other) && !of_other.is_of(&source));
    assert_eq!(all_codes(other.layout(), &of_other), all_codes(other.layout(), &surface(&other, &above(100.0)).0));
}
