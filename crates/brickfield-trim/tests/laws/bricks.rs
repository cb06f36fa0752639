//! Bricks with shared border samples.

use crate::field::{Field, field, transfer, trilinear};
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{
    BrickId, BrickLayout, BrickSide, Grid, Knot, Level, Rescale, TransferFunction, ValueRange, Volume,
};
use brickfield_trim::*;
use proptest::prelude::*;

/// The value at a sample position of a brick, among some of its samples.
fn value(field: &Field, brick: SampleBox, among: SampleBox, q: DVec3) -> f64 {
    let ends = [among.first, among.first + among.n - 1];
    trilinear(q - brick.first.as_dvec3(), ends, |i| f64::from(field.voxel(brick.first + i)))
}

/// The brick that holds a sample position.
fn brick_at(layout: &BrickLayout, q: DVec3) -> (usize, SampleBox) {
    let cell = q.max(DVec3::ZERO) / f64::from(layout.side().n_cells());
    let coords = cell.floor().as_uvec3().min(layout.n_bricks(Level(0)) - 1);
    let id = BrickId { level: Level(0), coords };
    (layout.ordinal(id), brick_samples(layout, id))
}

/// The box around all samples of a brick that are `visible`, by looking at each.
fn object_box(field: &Field, brick: SampleBox, visible: impl Fn(u8) -> bool) -> SampleBox {
    let (mut first, mut end) = (UVec3::MAX, UVec3::ZERO);
    for i in 0..brick.n.element_product() {
        let p = UVec3::new(i % brick.n.x, i / brick.n.x % brick.n.y, i / brick.n.x / brick.n.y);
        if visible(field.voxel(brick.first + p)) {
            (first, end) = (first.min(p), end.max(p + 1));
        }
    }
    if end == UVec3::ZERO { SampleBox::EMPTY } else { SampleBox { first, n: end - first } }
}

fn bricks(layout: &BrickLayout) -> impl Iterator<Item = SampleBox> {
    layout.bricks(Level(0)).map(|id| brick_samples(layout, id))
}

#[test]
fn blocks_of_table_1() {
    let sizes = [[256, 256, 128], [512, 512, 56], [512, 512, 78], [500, 470, 176], [250, 512, 352], [512, 512, 256]];
    let n_bricks = sizes.map(|dims| BrickLayout::new(UVec3::from(dims), BrickSide::S64).n_bricks_total(Level(0)));
    assert_eq!(n_bricks, [75, 81, 162, 192, 216, 405]);
}

#[test]
fn arrays_of_another_layout_are_named() {
    let volume = |dims: [u32; 3]| {
        let grid = Grid::axis_aligned(UVec3::from(dims), DVec3::ONE).unwrap();
        Volume::new(grid, vec![0u8; grid.n_voxels()]).unwrap()
    };
    let arrays = BrickArrays::of_volume(&volume([20, 16, 16]), BrickSide::S16);
    let layout = *arrays.layout();
    let error = |arrays: &[MinMaxArrays]| BrickArrays::new(layout, arrays.to_vec()).unwrap_err().to_string();
    assert_eq!(error(&arrays.arrays()[..1]), "min-max arrays of 1 bricks; the layout has 2");
    let swapped = [arrays.arrays()[1].clone(), arrays.arrays()[0].clone()];
    assert_eq!(error(&swapped), "brick (0, 0, 0) of level 0 has 5 x 16 x 16 slices; it has 16 x 16 x 16 samples");
    assert_eq!(BrickArrays::new(layout, arrays.arrays().to_vec()), Ok(arrays.clone()));

    let dark = DarkValues::below(1.0).unwrap();
    let mut trimmed = trim_bricks(&arrays, &dark, Interpolation::Trilinear);
    let other = BrickArrays::of_volume(&volume([20, 16, 17]), BrickSide::S16);
    let error = reclassify(&mut trimmed, &other, &dark).unwrap_err().to_string();
    assert_eq!(
        error,
        "bricks of 16^3 samples over 20 x 16 x 17; the trimmed ones have 16^3 samples, over 20 x 16 x 16"
    );
}

#[test]
fn the_intervals_of_object_voxels_alone_lose_what_interpolation_shows() {
    // Object voxels from 8 on; between the voxels 0 and 9 the values from 8 on are seen in a ninth of the way.
    let grid = Grid::axis_aligned(UVec3::new(16, 1, 1), DVec3::ONE).unwrap();
    let voxels: Vec<u8> = (0..16).map(|x| if x == 5 { 9 } else { 0 }).collect();
    let volume = Volume::new(grid, voxels).unwrap();
    let arrays = BrickArrays::of_volume(&volume, BrickSide::S16);
    let dark = DarkValues::below(8.0).unwrap();
    let kept = |interpolation| trim_bricks(&arrays, &dark, interpolation).kept()[0];
    let [nearest, trilinear] = [Interpolation::Nearest, Interpolation::Trilinear].map(kept);
    assert_eq!((nearest.first.x, nearest.n.x), (5, 1));
    assert_eq!((trilinear.first.x, trilinear.n.x), (4, 3));
}

#[test]
fn a_box_that_moves_is_named() {
    // Slice x has the value x: a peak that moves along the values moves the box.
    let grid = Grid::axis_aligned(UVec3::new(16, 2, 2), DVec3::ONE).unwrap();
    let volume = Volume::new(grid, (0..64u8).map(|i| i % 16).collect::<Vec<u8>>()).unwrap();
    let arrays = BrickArrays::of_volume(&volume, BrickSide::S16);
    let peak_at = |value: f64| {
        let knot = |value, extinction| Knot { value, extinction, color: [1.0; 3] };
        let knots = vec![knot(value - 1.0, 0.0), knot(value, 1.0), knot(value + 1.0, 0.0)];
        DarkValues::of(&TransferFunction::new(knots).unwrap())
    };
    let mut trimmed = trim_bricks(&arrays, &peak_at(4.0), Interpolation::Trilinear);
    assert_eq!((trimmed.kept()[0].first.x, trimmed.kept()[0].n.x), (3, 3));
    assert_eq!(reclassify(&mut trimmed, &arrays, &peak_at(9.0)), Ok(vec![0]));
    assert_eq!((trimmed.kept()[0].first.x, trimmed.kept()[0].n.x), (8, 3));
}

proptest! {
    #[test]
    fn dark_values_are_those_of_the_transfer_function(transfer in transfer(), a in -4..88i32, b in 0..40i32) {
        let range = ValueRange { min: f64::from(a) / 4.0, max: f64::from(a + b) / 4.0 };
        let dark = DarkValues::of(&transfer);
        prop_assert_eq!(dark.covers(range), transfer.is_transparent(range), "{:?} of {:?}", range, dark);
        prop_assert!(dark.intervals().windows(2).all(|pair| pair[0].max.next_up() < pair[1].min));
    }

    #[test]
    fn arrays_are_the_least_and_greatest_of_each_slice(field in field(40), slope in prop::sample::select(vec![1.0, -0.5])) {
        let rescale = Rescale::new(slope, 3.0).unwrap();
        let grid = *field.volume().grid();
        fn check(field: &Field, volume: &Volume) {
            let arrays = BrickArrays::of_volume(volume, BrickSide::S16);
            for (brick, arrays) in bricks(arrays.layout()).zip(arrays.arrays()) {
                for axis in 0..3 {
                    for slice in 0..brick.n[axis] {
                        let mut of = brick;
                        (of.first[axis], of.n[axis]) = (brick.first[axis] + slice, 1);
                        let in_slice = (0..of.n.element_product()).map(|i| {
                            let p = UVec3::new(i % of.n.x, i / of.n.x % of.n.y, i / of.n.x / of.n.y);
                            volume.rescale().value(f64::from(field.voxel(of.first + p)))
                        });
                        let (min, max) = in_slice.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
                        assert_eq!(arrays.along(axis)[slice as usize], ValueRange { min, max });
                    }
                }
            }
        }
        check(&field, &Volume::rescaled(grid, field.voxels(), rescale).unwrap());
        let floats: Vec<f32> = field.voxels().into_iter().map(f32::from).collect();
        check(&field, &Volume::rescaled(grid, floats, rescale).unwrap());
    }

    #[test]
    fn no_visible_value_is_lost(
        field in field(48), transfer in transfer(),
        parts in prop::collection::vec(prop::array::uniform3(0.0..1.0f64), 200)
    ) {
        let arrays = BrickArrays::of_volume(&field.volume(), BrickSide::S16);
        let trimmed = trim_bricks(&arrays, &DarkValues::of(&transfer), Interpolation::Trilinear);
        for part in parts {
            let q = DVec3::from(part) * field.dims.as_dvec3() - 0.5;
            let (ordinal, brick) = brick_at(arrays.layout(), q);
            let whole = value(&field, brick, SampleBox::whole(brick.n), q);
            let kept = trimmed.kept()[ordinal];
            let seen = |value: f64| transfer.at(value).extinction;
            match kept.is_empty() {
                true => prop_assert!(seen(whole) < 1e-9, "{} at {} of a white brick", whole, q),
                false => {
                    let left = value(&field, brick, kept, q);
                    prop_assert!((seen(left) - seen(whole)).abs() < 1e-9, "{} not {} at {} of {:?}", left, whole, q, kept);
                }
            }
        }
    }

    #[test]
    fn nothing_is_kept_without_reason(field in field(48), transfer in transfer()) {
        // Each face of a kept box lies beside a gap with a value that is seen, or beside the slices that make it so.
        let arrays = BrickArrays::of_volume(&field.volume(), BrickSide::S16);
        let dark = DarkValues::of(&transfer);
        let trimmed = trim_bricks(&arrays, &dark, Interpolation::Trilinear);
        for (of_brick, kept) in arrays.arrays().iter().zip(trimmed.kept()).filter(|(_, kept)| !kept.is_empty()) {
            for axis in 0..3 {
                let slices = of_brick.along(axis);
                let (first, last) = (kept.first[axis] as usize, (kept.first[axis] + kept.n[axis] - 1) as usize);
                let seen = |a: usize, b: usize| !transfer.is_transparent(slices[a].union(slices[b]));
                prop_assert!(seen(first, last.min(first + 1)) && seen(first.max(last.saturating_sub(1)), last));
            }
        }
    }

    #[test]
    fn a_threshold_keeps_the_object_voxels_and_their_neighbours(field in field(40), threshold in 0..21u8) {
        let arrays = BrickArrays::of_volume(&field.volume(), BrickSide::S16);
        let dark = DarkValues::below(f64::from(threshold)).unwrap();
        let trimmed = |interpolation| trim_bricks(&arrays, &dark, interpolation);
        let [nearest, trilinear] = [Interpolation::Nearest, Interpolation::Trilinear].map(trimmed);
        for (ordinal, brick) in bricks(arrays.layout()).enumerate() {
            let object = object_box(&field, brick, |v| v >= threshold);
            prop_assert_eq!(nearest.kept()[ordinal], object);
            let (from, end) = (object.first.saturating_sub(UVec3::ONE), (object.first + object.n + 1).min(brick.n));
            let grown = if object.is_empty() { object } else { SampleBox { first: from, n: end - from } };
            prop_assert_eq!(trilinear.kept()[ordinal], grown);
        }
    }

    #[test]
    fn an_edit_changes_the_bricks_that_it_names_and_no_other(field in field(64), a in transfer(), b in transfer()) {
        let arrays = BrickArrays::of_volume(&field.volume(), BrickSide::S16);
        let trimmed = |transfer: &TransferFunction| trim_bricks(&arrays, &DarkValues::of(transfer), Interpolation::Trilinear);
        let (before, anew) = (trimmed(&a), trimmed(&b));
        let mut edited = before.clone();
        let changed = reclassify(&mut edited, &arrays, &DarkValues::of(&b)).unwrap();
        prop_assert_eq!(&edited, &anew);
        let differ = |i: &usize| before.class(*i) != anew.class(*i) || before.kept()[*i] != anew.kept()[*i];
        prop_assert_eq!(changed, (0..before.kept().len()).filter(differ).collect::<Vec<_>>());
        prop_assert_eq!(reclassify(&mut edited, &arrays, &DarkValues::of(&b)), Ok(vec![]));
    }
}
