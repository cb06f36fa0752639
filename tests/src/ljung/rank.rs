//! The estimated error of blocks against the exact one: how well they agree in order.

use brickfield::bricks::{BlockSource, fetch_values};
use brickfield::lod::{LevelErrors, Reconstruction, Slab, exact_errors, rank_correlation};
use serde::Serialize;

use super::LjungArgs;
use super::data::data_sets;
use crate::paper::{Missed, PaperError, print};

#[derive(Clone, Debug, Serialize)]
struct RankRow {
    data: String,
    /// Spearman's rank correlation at each level from 1 on; none where all errors are equal.
    per_level: Vec<Option<f64>>,
    /// Of the errors of all levels together.
    all_levels: Option<f64>,
}

pub(super) fn run(args: &LjungArgs) -> Result<Vec<Missed>, PaperError> {
    print(
        "Spearman's rank correlation of estimate and exact error, over blocks; exact: every voxel against the trilinear value of its block's samples.\n",
    )?;
    let mut rows = Vec::new();
    for data_set in data_sets(args)? {
        let data = data_set?;
        let slab = Slab::of_block(data.blocks.layout(), data.blocks.grid());
        let exact =
            exact_errors(data.blocks.layout(), &data.transfer, slab, Reconstruction::Trilinear, |block, level| {
                fetch_values(&data.blocks, block, level)
            })?;
        let n_levels = usize::from(data.blocks.layout().side().one_sample().0);
        let column =
            |errors: &[LevelErrors], level: usize| errors.iter().map(|e| f64::from(e[level])).collect::<Vec<_>>();
        let estimated = data.errors().levels();
        let of_level = |level| rank_correlation(&column(estimated, level), &column(&exact, level));
        let all = |errors: &[LevelErrors]| (1..=n_levels).flat_map(|level| column(errors, level)).collect::<Vec<_>>();
        let row = RankRow {
            data: data.name.clone(),
            per_level: (1..=n_levels).map(of_level).collect(),
            all_levels: rank_correlation(&all(estimated), &all(&exact)),
        };
        let text = |r: &Option<f64>| r.map_or("-".to_owned(), |r| format!("{r:.3}"));
        let levels: Vec<String> = row.per_level.iter().map(text).collect();
        print(&format!(
            "{:<22} levels 1 to {n_levels}: {}; all: {}",
            row.data,
            levels.join(" "),
            text(&row.all_levels)
        ))?;
        rows.push(row);
    }
    args.common.write_rows("rank.json", &rows)?;
    Ok(Vec::new())
}
