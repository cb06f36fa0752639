//! Section 3.1: how much is stored twice, by the paper's formula and in fact.

use brickfield::bricks::tree_memory;
use brickfield_core::{BrickLayout, Level};

use super::LamarArgs;
use super::scenes::{data_sets, sides};
use crate::paper::{Missed, PaperError, print};

pub(super) fn run(args: &LamarArgs) -> Result<Vec<Missed>, PaperError> {
    print(
        "The formula: of a brick's n^3 voxels, n^3 - (n - 1)^3 are shared. Stored: level 0 in whole bricks; with the coarser\n\
           levels; of what is stored, voxels once, again in a neighbour, and beyond the volume's border.\n",
    )?;
    print(
        "data               side  shared by the formula   bricks  level 0: once  shared  padding   all levels / voxels",
    )?;
    for data_set in data_sets(args)? {
        let data_set = data_set?;
        let (dims, scalar) = (data_set.volume.grid().dims(), data_set.volume.scalar_type());
        for side in sides(args) {
            let layout = BrickLayout::new(dims, side);
            let memory = tree_memory(&layout, scalar);
            let (level, n) = (&memory.levels[usize::from(Level(0).0)], f64::from(side.n_samples()));
            let share = |bytes: u64| 100.0 * bytes as f64 / level.stored_bytes as f64;
            print(&format!(
                "{:<18} {:>4} {:>12.0} ({:>5.2} %) {:>8} {:>13.1} % {:>5.1} % {:>6.1} % {:>21.3}",
                data_set.name,
                side,
                n.powi(3) - (n - 1.0).powi(3),
                100.0 * (1.0 - ((n - 1.0) / n).powi(3)),
                level.n_bricks,
                share(level.unique_bytes),
                share(level.shared_bytes),
                share(level.padding_bytes),
                memory.total.stored_bytes as f64 / level.unique_bytes as f64,
            ))?;
        }
    }
    Ok(Vec::new())
}
