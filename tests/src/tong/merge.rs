//! Chunks and padding of every way to store trimmed bricks.

use brickfield::trim::{
    BetweenClusters, DarkValues, FirstMerge, Interpolation, MergeOptions, TexelAccount, merge_bricks, pack_bricks,
    store_alone, trim_bricks,
};
use brickfield_core::glam::UVec3;
use serde::Serialize;

use super::TongArgs;
use super::data::data_sets;
use crate::paper::{Missed, PaperError, print};

/// Texels along a side of a texture.
const MOST: UVec3 = UVec3::splat(2048);

/// A line of the table.
#[derive(Clone, Debug, Serialize)]
struct MergeRow {
    data: String,
    stored: &'static str,
    n_boxes: usize,
    n_texels: u64,
    n_samples: u64,
    n_padding: u64,
}

pub(super) fn run(args: &TongArgs) -> Result<Vec<Missed>, PaperError> {
    print(&format!(
        "Bricks of {} samples a side. Boxes: bricks or chunks that are brought to a device one by one. Padding: texels without a sample of the volume.\n",
        args.side
    ))?;
    let mut rows = Vec::new();
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let dark = DarkValues::of(&data_set.subject.transfer);
        let trimmed = trim_bricks(data_set.trimmed.arrays(), &dark, Interpolation::Trilinear);
        let counts = trimmed.counts();
        print(&format!(
            "{}: {:.1} % of voxels are empty; {} bricks white, {} grey, {} black\n  stored                                boxes       texels    of them padding   in one texture",
            data_set.subject.name,
            100.0 * data_set.empty_share(&data_set.subject.transfer),
            counts.n_white,
            counts.n_grey,
            counts.n_black
        ))?;
        let options = MergeOptions::of_bricks(args.side);
        let merged = |first, between| merge_bricks(&trimmed, &MergeOptions { first, between, ..options });
        let in_clusters = merged(FirstMerge::Horizontal, BetweenClusters::Apart)?;
        let horizontal = merged(FirstMerge::Horizontal, BetweenClusters::AlongZ)?;
        let vertical = merged(FirstMerge::Vertical, BetweenClusters::AlongZ)?;
        let packed = pack_bricks(&trimmed, MOST)?.account();
        let ways = [
            ("one axis trimmed, alone", horizontal.before(), store_alone(&trimmed, MOST)?.account()),
            ("merged in clusters", in_clusters.after(), in_clusters.store(MOST)?.account()),
            ("and between, horizontal first", horizontal.after(), horizontal.store(MOST)?.account()),
            ("and between, vertical first", vertical.after(), vertical.store(MOST)?.account()),
            ("all axes trimmed, packed", packed, packed),
        ];
        for (stored, account, in_texture) in ways {
            print(&line(stored, &account, &in_texture))?;
            let TexelAccount { n_boxes, n_texels, n_samples } = account;
            let (data, n_padding) = (data_set.subject.name.clone(), account.n_padding());
            rows.push(MergeRow { data, stored, n_boxes, n_texels, n_samples, n_padding });
        }
    }
    args.common.write_rows("merge.json", &rows)?;
    Ok(Vec::new())
}

fn line(stored: &str, account: &TexelAccount, in_texture: &TexelAccount) -> String {
    let share = 100.0 * account.n_padding() as f64 / account.n_texels.max(1) as f64;
    format!(
        "  {stored:<34} {:>8} {:>12} {:>12} ({share:>4.1} %) {:>12}",
        account.n_boxes,
        account.n_texels,
        account.n_padding(),
        in_texture.n_texels
    )
}
