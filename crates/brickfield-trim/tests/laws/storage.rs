//! Bricks in texture chunks and in packed boxes: each sample is stored once, and is found again where it was.

use brickfield_core::glam::{DMat3, DVec3, UVec2, UVec3};
use brickfield_core::{
    BrickId, BrickLayout, BrickSide, Grid, IndexPos, Level, Place, SamplePos, TransferFunction, Volume,
};
use brickfield_trim::*;
use proptest::prelude::*;

use crate::field::{Field, field, transfer, trilinear};

const SIDE: u32 = 16;
const MOST: UVec3 = UVec3::new(256, 256, 1 << 20);

fn trimmed(field: &Field, transfer: &TransferFunction) -> TrimmedBricks {
    let arrays = BrickArrays::of_volume(&field.volume(), BrickSide::S16);
    trim_bricks(&arrays, &DarkValues::of(transfer), Interpolation::Trilinear)
}

fn options() -> impl Strategy<Value = MergeOptions> {
    let first = prop::sample::select(vec![FirstMerge::Horizontal, FirstMerge::Vertical]);
    let between = prop::sample::select(vec![BetweenClusters::Apart, BetweenClusters::AlongZ]);
    (1..4u32, 1..3u32, prop::array::uniform3(0..20u32), first, between).prop_map(|(u, v, more, first, between)| {
        let cache = UVec3::new(u, v, 1) * SIDE + UVec3::from(more);
        MergeOptions { cluster: UVec2::new(u, v), cache, first, between }
    })
}

fn coords(layout: &BrickLayout, ordinal: usize) -> UVec3 {
    layout.bricks(Level(0)).nth(ordinal).unwrap().coords
}

/// A texture with the samples of all bricks; the number of writes to each texel.
fn texture(field: &Field, stored: &StoredBricks) -> (Vec<u8>, Vec<u8>) {
    let n = stored.texels().element_product() as usize;
    let (mut texture, mut writes, voxels) = (vec![255; n], vec![0; n], field.voxels());
    for (brick, place) in stored.places().iter().enumerate() {
        let samples = stored.samples(brick, &voxels).unwrap();
        let Some(place) = place else {
            assert_eq!(samples, []);
            continue;
        };
        assert_eq!(samples.len(), place.n_samples());
        for (i, sample) in (0..).zip(samples) {
            let offset = UVec3::new(i % place.n.x, i / place.n.x % place.n.y, i / place.n.x / place.n.y);
            let texel = number(place.texel + offset, stored.texels());
            texture[texel] = sample;
            writes[texel] += 1;
        }
    }
    (texture, writes)
}

/// The number of a texel or voxel, x fastest.
fn number(p: UVec3, n: UVec3) -> usize {
    assert!(p.cmplt(n).all(), "{p} of {n}");
    (p.x + n.x * (p.y + n.y * p.z)) as usize
}

/// The texel of sample `i` of a place, along the axes of space.
fn texel(place: &Place, i: UVec3) -> UVec3 {
    place.texel + UVec3::from(place.axes.of_texture().map(|axis| i[axis]))
}

/// All samples that may be seen, of every brick: stored once, with the voxel's value, at the voxel's place in the world.
fn check_samples(field: &Field, transfer: &TransferFunction, stored: &StoredBricks) -> Result<(), TestCaseError> {
    let (texture, writes) = texture(field, stored);
    prop_assert!(writes.iter().all(|n| *n <= 1), "a texel holds two samples");
    let n_written = writes.iter().filter(|n| **n == 1).count();
    prop_assert_eq!(n_written as u64, stored.account().n_samples);
    let turned = DMat3::from_cols(DVec3::Y, DVec3::Z, -DVec3::X);
    let grid = Grid::from_first_sample(field.dims, DVec3::new(0.5, 2.0, 3.0), DVec3::splat(-7.0), turned).unwrap();
    for (id, place) in stored.layout().bricks(Level(0)).zip(stored.places()) {
        let brick = brick_samples(stored.layout(), id);
        for i in 0..brick.n.element_product() {
            let voxel = brick.first + UVec3::new(i % brick.n.x, i / brick.n.x % brick.n.y, i / brick.n.x / brick.n.y);
            let value = field.voxel(voxel);
            if transfer.at(f64::from(value)).extinction == 0.0 {
                continue;
            }
            let Some(place) = place else { panic!("{value} at {voxel} of a white brick") };
            let first = place.first.as_uvec3();
            prop_assert!(voxel.cmpge(first).all() && voxel.cmplt(first + place.n_in_space()).all());
            prop_assert_eq!(texture[number(texel(place, voxel - first), stored.texels())], value);
            let world = |p: DVec3| grid.world(IndexPos::from(SamplePos(p))).0;
            let stride = (place.last - place.first) / (place.n_in_space() - 1).max(UVec3::ONE).as_dvec3();
            prop_assert_eq!(world(place.first + (voxel - first).as_dvec3() * stride), world(voxel.as_dvec3()));
        }
    }
    Ok(())
}

/// The field as a plan reads it from the texture: what is seen is what the whole volume shows.
fn check_picture(
    field: &Field,
    transfer: &TransferFunction,
    stored: &StoredBricks,
    parts: &[[f64; 3]],
) -> Result<(), TestCaseError> {
    let (texture, _) = texture(field, stored);
    let layout = stored.layout();
    for part in parts {
        let q = (DVec3::from(*part) * field.dims.as_dvec3() - 0.5).clamp(DVec3::ZERO, (field.dims - 1).as_dvec3());
        let whole = trilinear(q, [UVec3::ZERO, field.dims - 1], |i| f64::from(field.voxel(i)));
        let seen = |value: f64| transfer.at(value).extinction;
        let coords = (q / f64::from(layout.side().n_cells())).as_uvec3().min(layout.n_bricks(Level(0)) - 1);
        let left = stored.places()[layout.ordinal(BrickId { level: Level(0), coords })].map_or(0.0, |place| {
            let sample = |i| f64::from(texture[number(texel(&place, i), stored.texels())]);
            seen(trilinear(place.local(q), [UVec3::ZERO, place.n_in_space() - 1], sample))
        });
        prop_assert!((left - seen(whole)).abs() < 1e-9, "{} not {} at {}", left, seen(whole), q);
    }
    Ok(())
}

/// Whether chunks lie in the cache together: pairs of bricks in rows along x, single ones in what is left.
fn fits(chunks: impl Iterator<Item = UVec3>, cache: UVec3) -> bool {
    let rows = (cache.y / SIDE * (cache.z / SIDE)) as usize;
    let mut free = vec![cache.x / SIDE; rows];
    let mut widths: Vec<u32> = chunks.map(|n| n.x / SIDE).collect();
    widths.sort_by_key(|width| std::cmp::Reverse(*width));
    widths.into_iter().all(|width| match free.iter_mut().find(|free| **free >= width) {
        Some(row) => {
            *row -= width;
            true
        }
        None => false,
    })
}

fn parts() -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec(prop::array::uniform3(0.0..1.0f64), 100)
}

proptest! {
    #[test]
    fn chunks_hold_every_sample_that_is_seen_once(
        field in field(64), transfer in transfer(), options in options(), parts in parts()
    ) {
        let merged = merge_bricks(&trimmed(&field, &transfer), &options).unwrap();
        let stored = merged.store(MOST).unwrap();
        check_samples(&field, &transfer, &stored)?;
        check_picture(&field, &transfer, &stored, &parts)?;
    }

    #[test]
    fn packed_boxes_hold_every_sample_that_is_seen_once(field in field(64), transfer in transfer(), parts in parts()) {
        let trimmed = trimmed(&field, &transfer);
        let stored = pack_bricks(&trimmed, MOST).unwrap();
        check_samples(&field, &transfer, &stored)?;
        check_picture(&field, &transfer, &stored, &parts)?;
        let n_kept: u64 = trimmed.kept().iter().map(SampleBox::n_samples).sum();
        prop_assert_eq!(stored.account().n_samples, n_kept);
    }

    #[test]
    fn pages_hold_every_sample_that_is_seen_once(
        field in field(64), transfer in transfer(), options in options(), parts in parts(), more in 0..40u32, way in 0..3
    ) {
        let trimmed = trimmed(&field, &transfer);
        let side = UVec3::splat(trimmed.layout().side().n_samples() + more);
        let paged = match way {
            0 => PagedBricks::packed(&trimmed, side),
            1 => PagedBricks::alone(&trimmed, side),
            _ => PagedBricks::merged(&merge_bricks(&trimmed, &options).unwrap(), options.cache),
        };
        let paged = paged.unwrap();
        for (i, brick) in paged.bricks().iter().enumerate() {
            prop_assert_eq!(brick.is_some(), !trimmed.kept()[i].is_empty());
            let Some(PagedBrick { page, place }) = brick else { continue };
            prop_assert!(paged.pages()[*page].contains(&i) && (place.texel + place.n).cmple(paged.texels()).all());
        }
        let stored = paged.one_upon_the_other();
        check_samples(&field, &transfer, &stored)?;
        check_picture(&field, &transfer, &stored, &parts)?;
    }

    #[test]
    fn chunks_are_referred_to_by_the_clusters_of_their_bricks(
        field in field(64), transfer in transfer(), options in options()
    ) {
        let trimmed = trimmed(&field, &transfer);
        let merged = merge_bricks(&trimmed, &options).unwrap();
        let layout = merged.layout();
        let cluster = |brick: usize| coords(layout, brick) / options.cluster.extend(1);
        let n = merged.n_clusters();
        let clusters = (0..n.element_product()).map(|i| UVec3::new(i % n.x, i / n.x % n.y, i / n.x / n.y));
        let mut referred = vec![Vec::new(); merged.chunks().len()];
        for at in clusters {
            merged.chunks_of(at).iter().for_each(|chunk| referred[*chunk].push(at));
            prop_assert!(fits(merged.chunks_of(at).iter().map(|chunk| merged.chunks()[*chunk].n), options.cache));
        }
        let mut n_stored = vec![0; merged.parts().len()];
        for (i, chunk) in merged.chunks().iter().enumerate() {
            let mut of_bricks: Vec<UVec3> = chunk.bricks.iter().map(|brick| cluster(*brick)).collect();
            of_bricks.sort_by_key(|cluster| cluster.z);
            if options.between == BetweenClusters::AlongZ && of_bricks.len() == 2 && of_bricks[0] != of_bricks[1] {
                prop_assert_eq!(of_bricks[0] + UVec3::Z, of_bricks[1]);
            } else {
                of_bricks.dedup();
                prop_assert_eq!(of_bricks.len(), 1);
            }
            prop_assert_eq!(&referred[i], &of_bricks);
            for &brick in &chunk.bricks {
                n_stored[brick] += 1;
                let part = merged.parts()[brick].unwrap();
                prop_assert_eq!(part.chunk, i);
                prop_assert!((part.texel + part.n()).cmple(chunk.n).all());
                if let Class::Grey { trimming_axis } = trimmed.class(brick) {
                    prop_assert_eq!(part.n().z, trimmed.kept()[brick].n[trimming_axis]);
                }
            }
        }
        for (brick, n) in n_stored.into_iter().enumerate() {
            prop_assert_eq!(n, usize::from(trimmed.class(brick) != Class::White));
        }
    }

    #[test]
    fn merging_goes_on_until_no_pair_is_left(field in field(64), transfer in transfer(), options in options()) {
        let options = MergeOptions { between: BetweenClusters::Apart, ..options };
        let merged = merge_bricks(&trimmed(&field, &transfer), &options).unwrap();
        let [x, y, z] = (options.cache / SIDE).to_array().map(|n| n as usize);
        let n = merged.n_clusters();
        for i in 0..n.element_product() {
            let chunks = merged.chunks_of(UVec3::new(i % n.x, i / n.x % n.y, i / n.x / n.y));
            let width = |chunk: &usize| merged.chunks()[*chunk].n.x;
            let single: Vec<usize> = chunks.iter().copied().filter(|c| width(c) == SIDE).collect();
            let n_pairs = chunks.len() - single.len();
            prop_assert!(single.len() <= 1 || n_pairs == x / 2 * y * z);
            for alone in single.into_iter().filter(|c| merged.chunks()[*c].bricks.len() == 1) {
                let thickness = merged.chunks()[alone].n.z;
                let heights = chunks.iter().filter(|c| **c != alone).flat_map(|c| columns(&merged, *c));
                prop_assert!(heights.into_iter().all(|height| height + thickness > SIDE));
            }
        }
    }

    #[test]
    fn accounts_add_up(field in field(64), transfer in transfer(), options in options()) {
        let merged = merge_bricks(&trimmed(&field, &transfer), &options).unwrap();
        let (before, after) = (merged.before(), merged.after());
        prop_assert!(after.n_boxes <= before.n_boxes && after.n_texels >= before.n_texels);
        prop_assert_eq!(before.n_samples, after.n_samples);
        prop_assert_eq!(merged.store(MOST).unwrap().account().n_samples, after.n_samples);
        if options.first == FirstMerge::Vertical && merged.chunks().iter().all(|chunk| chunk.n.x == SIDE) {
            prop_assert_eq!(after.n_padding(), before.n_padding());
        }
    }

    #[test]
    fn rows_of_clusters_without_changed_bricks_keep_their_chunks(field in field(64), a in transfer(), b in transfer()) {
        let options = MergeOptions { cluster: UVec2::ONE, cache: UVec3::new(32, 16, 16), ..MergeOptions::default() };
        let before = trimmed(&field, &a);
        let mut after = before.clone();
        let arrays = BrickArrays::of_volume(&field.volume(), BrickSide::S16);
        let changed = reclassify(&mut after, &arrays, &DarkValues::of(&b)).unwrap();
        let [before, after] = [before, after].map(|trimmed| merge_bricks(&trimmed, &options).unwrap());
        let row = |brick: usize| coords(before.layout(), brick).truncate();
        let rows: Vec<UVec2> = changed.into_iter().map(row).collect();
        for brick in (0..before.parts().len()).filter(|brick| !rows.contains(&row(*brick))) {
            let chunk = |merged: &MergedBricks| {
                let part = merged.parts()[brick]?;
                Some((merged.chunks()[part.chunk].clone(), part.texel, part.samples, part.axes))
            };
            prop_assert_eq!(chunk(&before), chunk(&after));
        }
    }
}

/// The heights of a chunk's columns.
fn columns(merged: &MergedBricks, chunk: usize) -> Vec<u32> {
    let mut heights = vec![0; (merged.chunks()[chunk].n.x / SIDE) as usize];
    for brick in &merged.chunks()[chunk].bricks {
        let part = merged.parts()[*brick].unwrap();
        heights[(part.texel.x / SIDE) as usize] += part.n().z;
    }
    heights
}

#[test]
fn options_that_do_not_fit_are_named() {
    let grid = Grid::axis_aligned(UVec3::splat(16), DVec3::ONE).unwrap();
    let arrays = BrickArrays::of_volume(&Volume::new(grid, vec![9u8; 4096]).unwrap(), BrickSide::S16);
    let trimmed = trim_bricks(&arrays, &DarkValues::below(1.0).unwrap(), Interpolation::Trilinear);
    let error = |u: u32, v: u32, cache: [u32; 3]| {
        let options = MergeOptions { cluster: UVec2::new(u, v), cache: cache.into(), ..MergeOptions::default() };
        merge_bricks(&trimmed, &options).unwrap_err().to_string()
    };
    assert_eq!(error(0, 2, [32, 32, 16]), "a cluster has 0 x 2 bricks; it must have 1 to 256");
    assert_eq!(error(17, 16, [512, 512, 16]), "a cluster has 17 x 16 bricks; it must have 1 to 256");
    assert_eq!(error(2, 3, [32, 32, 16]), "a cluster takes 48 texels along y; the cache has 32");
    assert_eq!(error(1, 1, [32, 32, 8]), "a cluster takes 16 texels along z; the cache has 8");
    let stored = pack_bricks(&trimmed, MOST).unwrap();
    let error = stored.samples(0, &[0u8; 5]).unwrap_err().to_string();
    assert_eq!(error, "5 voxels do not fill the bricks' volume of 16 x 16 x 16");
    let error = pack_bricks(&trimmed, UVec3::splat(15)).unwrap_err().to_string();
    assert_eq!(error, "box 0 has 16 texels along x; it must have 1 to 15");
}
