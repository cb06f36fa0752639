//! Which bricks of a row of clusters are merged.

use brickfield_core::glam::UVec3;

use super::{BetweenClusters, FirstMerge, MergeOptions};

/// A texture chunk to be: bricks in one or two columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Draft {
    pub(super) columns: Vec<Pile>,
    /// Clusters that refer to it: its own, and the next one along z.
    pub(super) n_clusters: u32,
}

/// Bricks upon each other along z, the lowest first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pile {
    pub(super) bricks: Vec<usize>,
    height: u32,
}

impl Draft {
    pub(super) fn alone(brick: usize, thickness: u32) -> Draft {
        Draft { columns: vec![Pile { bricks: vec![brick], height: thickness }], n_clusters: 1 }
    }

    /// Texels along z.
    pub(super) fn height(&self) -> u32 {
        self.columns.iter().map(|pile| pile.height).max().unwrap_or(0)
    }

    /// The only column, if there is one.
    fn only(&self) -> Option<&Pile> {
        match &self.columns[..] {
            [only] => Some(only),
            _ => None,
        }
    }

    /// The only brick, if nothing has been merged with it.
    fn unmerged(&self) -> Option<&Pile> {
        self.only().filter(|pile| pile.bricks.len() == 1)
    }
}

/// How many chunks a cache has room for: rows of as many bricks as lie along its x.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// Chunks of one column.
    n_bricks: usize,
    /// Chunks of two columns.
    n_pairs: usize,
}

impl Room {
    /// `n` bricks along x, y, z.
    pub(super) fn new(n: UVec3) -> Room {
        let [x, y, z] = n.to_array().map(|n| n as usize);
        Room { n_bricks: x * y * z, n_pairs: x / 2 * y * z }
    }

    /// Whether there is room for chunks of one and of two columns.
    fn holds(self, n_single: usize, n_pairs: usize) -> bool {
        n_pairs <= self.n_pairs && n_single + 2 * n_pairs <= self.n_bricks
    }
}

/// A merge of two chunks: one goes beside another, or upon a column of it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Merge {
    Beside,
    Upon { column: usize },
}

const HORIZONTAL: FirstMerge = FirstMerge::Horizontal;
const VERTICAL: FirstMerge = FirstMerge::Vertical;

impl FirstMerge {
    fn order(self) -> [FirstMerge; 2] {
        match self {
            HORIZONTAL => [HORIZONTAL, VERTICAL],
            VERTICAL => [VERTICAL, HORIZONTAL],
        }
    }
}

/// Merges the bricks of clusters that follow each other along z; each chunk with its first cluster. `side` is the greatest height of a
/// pile.
pub(super) fn merge_row(
    mut clusters: Vec<Vec<Draft>>,
    options: &MergeOptions,
    room: Room,
    side: u32,
) -> Vec<(u32, Draft)> {
    for cluster in &mut clusters {
        while options.first.order().into_iter().any(|merge| merge_in_cluster(cluster, merge, room, side)) {}
    }
    if options.between == BetweenClusters::AlongZ {
        for lower in 1..clusters.len() {
            while options.first.order().into_iter().any(|merge| merge_between(&mut clusters, lower, merge, room, side))
            {
            }
        }
    }
    let with_cluster = |(z, drafts): (usize, Vec<Draft>)| drafts.into_iter().map(move |draft| (z as u32, draft));
    clusters.into_iter().enumerate().flat_map(with_cluster).collect()
}

/// Does one merge in a cluster; `false` if there is none to do.
fn merge_in_cluster(drafts: &mut Vec<Draft>, merge: FirstMerge, room: Room, side: u32) -> bool {
    let n_pairs = drafts.iter().filter(|draft| draft.only().is_none()).count();
    // A pair takes the room of the two chunks that it is made of.
    if merge == HORIZONTAL && n_pairs == room.n_pairs {
        return false;
    }
    let pairs = (0..drafts.len()).flat_map(|i| (0..drafts.len()).filter(move |j| i != *j).map(move |j| (i, j)));
    let closest = pairs.filter_map(|(i, j)| {
        let (difference, how) = match merge {
            HORIZONTAL => beside(&drafts[i], &drafts[j])?,
            VERTICAL => upon(&drafts[i], &drafts[j], side)?,
        };
        Some((difference, i, j, how))
    });
    let Some((_, i, j, how)) = closest.min_by_key(|(difference, ..)| *difference) else { return false };
    let moved = drafts[j].clone();
    put(&mut drafts[i], moved, how);
    drafts.remove(j);
    true
}

/// Does one merge between bricks that are still alone: one of the cluster before `upper`, one of `upper`.
fn merge_between(clusters: &mut [Vec<Draft>], upper: usize, merge: FirstMerge, room: Room, side: u32) -> bool {
    let may_pair = [upper - 1, upper].into_iter().all(|cluster| {
        let (n_single, n_pairs) = count(clusters, cluster);
        n_single > 0 && room.holds(n_single - 1, n_pairs + 1)
    });
    if merge == HORIZONTAL && !may_pair {
        return false;
    }
    let (below, above) = (&clusters[upper - 1], &clusters[upper]);
    let pairs = (0..below.len()).flat_map(|i| (0..above.len()).map(move |j| (i, j)));
    // A chunk that is shared already has two bricks.
    let alone = |(i, j): &(usize, usize)| below[*i].unmerged().is_some() && above[*j].unmerged().is_some();
    let closest = pairs.filter(alone).filter_map(|(i, j)| {
        let (difference, how) = match merge {
            HORIZONTAL => beside(&below[i], &above[j])?,
            VERTICAL => upon(&below[i], &above[j], side)?,
        };
        Some((difference, i, j, how))
    });
    let Some((_, i, j, how)) = closest.min_by_key(|(difference, ..)| *difference) else { return false };
    let moved = clusters[upper].remove(j);
    let draft = &mut clusters[upper - 1][i];
    put(draft, moved, how);
    draft.n_clusters = 2;
    true
}

/// Chunks of one and of two columns that a cluster refers to.
fn count(clusters: &[Vec<Draft>], cluster: usize) -> (usize, usize) {
    let before = cluster.checked_sub(1).map_or(&[][..], |before| &clusters[before]);
    let shared = before.iter().filter(|draft| draft.n_clusters == 2);
    let (single, pairs): (Vec<&Draft>, Vec<&Draft>) =
        clusters[cluster].iter().chain(shared).partition(|draft| draft.only().is_some());
    (single.len(), pairs.len())
}

/// The difference in height of two chunks that can lie side by side.
fn beside(a: &Draft, b: &Draft) -> Option<(u32, Merge)> {
    Some((a.only()?.height.abs_diff(b.only()?.height), Merge::Beside))
}

/// The least difference in height of a column and a brick that is not merged and has room upon it.
fn upon(a: &Draft, b: &Draft, side: u32) -> Option<(u32, Merge)> {
    let thickness = b.unmerged()?.height;
    let fits = a.columns.iter().enumerate().filter(|(_, pile)| pile.height + thickness <= side);
    fits.map(|(column, pile)| (pile.height.abs_diff(thickness), Merge::Upon { column })).min_by_key(|(d, _)| *d)
}

fn put(draft: &mut Draft, moved: Draft, how: Merge) {
    match how {
        Merge::Beside => draft.columns.extend(moved.columns),
        Merge::Upon { column } => {
            let pile = &mut draft.columns[column];
            for added in moved.columns {
                pile.height += added.height;
                pile.bricks.extend(added.bricks);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The chunks of clusters with bricks of some thicknesses, at most 64: for each, its first cluster, how many refer to it, and the
    /// thicknesses in its columns.
    fn merged(clusters: &[&[u32]], first: FirstMerge) -> Vec<(u32, u32, Vec<Vec<u32>>)> {
        let all: Vec<u32> = clusters.concat();
        let mut next = 0..all.len();
        let drafts = |of: &&[u32]| of.iter().map(|t| Draft::alone(next.next().unwrap(), *t)).collect();
        let clusters = clusters.iter().map(drafts).collect();
        let options = MergeOptions { first, ..MergeOptions::default() };
        let row = merge_row(clusters, &options, Room::new(UVec3::new(2, 2, 1)), 64);
        let thicknesses = |pile: &Pile| pile.bricks.iter().map(|i| all[*i]).collect();
        row.iter().map(|(z, d)| (*z, d.n_clusters, d.columns.iter().map(thicknesses).collect())).collect()
    }

    #[test]
    fn the_least_difference_of_thickness_is_merged_first() {
        assert_eq!(
            merged(&[&[10, 40, 38, 60]], HORIZONTAL),
            [(0, 1, vec![vec![10], vec![60]]), (0, 1, vec![vec![40], vec![38]])]
        );
    }

    #[test]
    fn a_third_brick_lies_upon_one_of_two_side_by_side() {
        // Figure 4(c): 30 and 34 side by side; 20 has room upon both, and is nearer to 30.
        assert_eq!(merged(&[&[30, 34, 20]], HORIZONTAL), [(0, 1, vec![vec![30, 20], vec![34]])]);
        // The vertical merge first: 30 and 34 make a whole pile.
        assert_eq!(merged(&[&[30, 34, 20]], VERTICAL), [(0, 1, vec![vec![30, 34], vec![20]])]);
    }

    #[test]
    fn bricks_that_stay_alone_are_merged_with_the_next_cluster() {
        // The third brick has no room upon the first two, but upon that of the next cluster: stored once, referred to twice.
        assert_eq!(
            merged(&[&[64, 64, 50], &[14]], HORIZONTAL),
            [(0, 1, vec![vec![64], vec![64]]), (0, 2, vec![vec![50], vec![14]])]
        );
        // No third cluster refers to it; bricks of clusters that do not follow each other stay apart.
        assert_eq!(merged(&[&[50], &[], &[14]], HORIZONTAL), [(0, 1, vec![vec![50]]), (2, 1, vec![vec![14]])]);
        let shared = merged(&[&[50], &[14], &[30]], VERTICAL);
        assert_eq!(shared, [(0, 2, vec![vec![50, 14]]), (2, 1, vec![vec![30]])]);
    }

    #[test]
    fn no_merge_takes_more_room_than_the_cache_has() {
        let alone = |bricks: std::ops::Range<usize>| bricks.map(|i| Draft::alone(i, 64)).collect();
        let chunks = |clusters: Vec<Vec<Draft>>, row: u32| {
            let chunks = merge_row(clusters, &MergeOptions::default(), Room::new(UVec3::new(row, 1, 1)), 64);
            chunks.iter().map(|(z, draft)| (*z, draft.n_clusters, draft.columns.len())).collect::<Vec<_>>()
        };
        // A row of one brick has no room for two side by side.
        assert_eq!(chunks(vec![alone(0..1), alone(1..2)], 1), [(0, 1, 1), (1, 1, 1)]);
        // A row of three has room for a pair and a brick, a row of four for two pairs, one of them shared.
        let three = || vec![alone(0..3), alone(3..6)];
        assert_eq!(chunks(three(), 3), [(0, 1, 2), (0, 1, 1), (1, 1, 2), (1, 1, 1)]);
        assert_eq!(chunks(three(), 4), [(0, 1, 2), (0, 2, 2), (1, 1, 2)]);
    }

    #[test]
    fn clusters_stay_apart_on_request() {
        let options = MergeOptions { between: BetweenClusters::Apart, ..MergeOptions::default() };
        let clusters = vec![vec![Draft::alone(0, 20)], vec![Draft::alone(1, 20)]];
        let chunks = merge_row(clusters, &options, Room::new(UVec3::new(2, 2, 1)), 64);
        assert!(chunks.len() == 2 && chunks.iter().all(|(_, draft)| draft.n_clusters == 1));
    }
}
