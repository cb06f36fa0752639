//! The edges of bricks, each once.

use brickfield_core::glam::DVec3;
use brickfield_core::{Aabb, BrickId, BrickLayout, Level};

/// A line along an axis of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    /// The coarsest level of the bricks that have it.
    pub(super) level: Level,
    /// In index space.
    pub(super) ends: [DVec3; 2],
}

/// A brick's edge in half voxels, of which corners have whole numbers. Ordered by line, along it, the longest and coarsest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct EdgePiece {
    axis: usize,
    /// On the other two axes.
    at: [i64; 2],
    start: i64,
    minus_end: i64,
    minus_level: i16,
}

/// The edges of the boxes of bricks, the finest level first. No two lie on each other; edges of a level that follow each other
/// are one.
pub(super) fn edges(layout: &BrickLayout, bricks: &[BrickId]) -> Vec<Edge> {
    let mut pieces: Vec<EdgePiece> = bricks.iter().flat_map(|id| pieces(*id, &layout.index_box(*id))).collect();
    pieces.sort_unstable();
    let same_line = |a: &EdgePiece, b: &EdgePiece| (a.axis, a.at) == (b.axis, b.at);
    let mut edges: Vec<Edge> = pieces.chunk_by(same_line).flat_map(along_a_line).map(edge).collect();
    edges.sort_by_key(|edge| edge.level);
    edges
}

/// The twelve edges of a box.
fn pieces(id: BrickId, b: &Aabb) -> impl Iterator<Item = EdgePiece> + use<> {
    let halves = |v: DVec3| (2.0 * v).to_array().map(|x| x as i64);
    let bounds = [halves(b.min), halves(b.max)];
    (0..3usize).flat_map(move |axis| {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        (0..4usize).map(move |i| EdgePiece {
            axis,
            at: [bounds[i & 1][u], bounds[i >> 1][v]],
            start: bounds[0][axis],
            minus_end: -bounds[1][axis],
            minus_level: -i16::from(id.level.0),
        })
    })
}

/// The pieces of a line without the parts on which other pieces lie.
fn along_a_line(pieces: &[EdgePiece]) -> Vec<EdgePiece> {
    let mut left: Vec<EdgePiece> = Vec::new();
    for piece in pieces {
        // Of two edges of an octree on a line, one lies in the other, or they do not overlap.
        match left.last_mut() {
            Some(last) if piece.minus_end >= last.minus_end => {}
            Some(last) if piece.start == -last.minus_end && piece.minus_level == last.minus_level => {
                last.minus_end = piece.minus_end;
            }
            _ => left.push(*piece),
        }
    }
    left
}

fn edge(piece: EdgePiece) -> Edge {
    let end = |along: i64| {
        let mut p = [0.0; 3];
        p[piece.axis] = along as f64 / 2.0;
        p[(piece.axis + 1) % 3] = piece.at[0] as f64 / 2.0;
        p[(piece.axis + 2) % 3] = piece.at[1] as f64 / 2.0;
        DVec3::from(p)
    };
    Edge { level: Level(-piece.minus_level as u8), ends: [end(piece.start), end(-piece.minus_end)] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec3;
    use brickfield_core::{BrickSide, Cut};
    use proptest::prelude::*;

    fn length(edges: &[Edge]) -> f64 {
        edges.iter().map(|e| e.ends[0].distance(e.ends[1])).sum()
    }

    #[test]
    fn bricks_of_a_level_share_their_edges() {
        let layout = BrickLayout::new(UVec3::new(31, 46, 16), BrickSide::S16);
        let bricks: Vec<_> = layout.bricks(Level(0)).collect();
        assert_eq!(bricks.len(), 6);
        // 3 x 4 x 2 planes: along x 4 * 2 lines, along y 3 * 2, along z 3 * 4; each is whole.
        let edges = edges(&layout, &bricks);
        assert_eq!(edges.len(), 8 + 6 + 12);
        assert_eq!(length(&edges), 8.0 * 31.0 + 6.0 * 46.0 + 12.0 * 16.0);
    }

    #[test]
    fn a_shared_edge_is_of_the_coarser_brick() {
        let layout = BrickLayout::new(UVec3::new(61, 31, 31), BrickSide::S16);
        let coarse = BrickId { level: Level(1), coords: UVec3::ZERO };
        let beside = BrickId { level: Level(0), coords: UVec3::new(2, 0, 0) };
        let edges = edges(&layout, &[beside, coarse]);
        let of = |level: u8| edges.iter().filter(|e| e.level == Level(level)).count();
        // The fine brick's face has two edges on the coarse one's; the other two lie inside its face.
        assert_eq!((of(1), of(0)), (12, 10));
        assert!(edges.is_sorted_by_key(|e| e.level));
        assert!(super::edges(&layout, &[]).is_empty());
    }

    proptest! {
        /// Every point of every brick's edges lies on exactly one of the pieces that are left.
        #[test]
        fn every_edge_is_drawn_exactly_once(dims in [2u32..70, 2u32..50, 2u32..40], deep in 0usize..64, along in 0.0..1.0) {
            let layout = BrickLayout::new(UVec3::from(dims), BrickSide::S16);
            let cut = Cut::descend(layout, (), |id, ()| {
                ((deep >> (layout.ordinal(id) % 6)) & 1 == 1 || id == layout.root()).then_some(())
            });
            let left = edges(&layout, cut.bricks());
            for id in cut.bricks() {
                for piece in pieces(*id, &layout.index_box(*id)) {
                    let whole = edge(piece);
                    // No end of any edge lies at a place so odd.
                    let p = whole.ends[0].lerp(whole.ends[1], 0.01 + 0.98 * along + 1e-7);
                    let on = |e: &&Edge| {
                        let along = e.ends[1] - e.ends[0];
                        let t = (p - e.ends[0]).dot(along) / along.length_squared();
                        (0.0..1.0).contains(&t) && (e.ends[0] + along * t).distance(p) < 1e-9
                    };
                    let on: Vec<_> = left.iter().filter(on).collect();
                    prop_assert_eq!(on.len(), 1);
                    prop_assert!(on[0].level >= id.level);
                }
            }
        }
    }
}
