//! Bricks from far to near.

use brickfield_core::glam::{DVec3, UVec3};
use brickfield_core::{BrickId, BrickLayout, Camera, Grid, Level, Projection, WorldPos};

/// The order in which to draw bricks so that none lies behind one that is drawn before it: indices into `bricks`.
///
/// LaMar, Hamann and Joy 1999, section 4.1. `bricks` are disjoint bricks of any levels, in any order: the bricks of a cut, or
/// some of them. From the root down, each node's bricks are parted among its children, the far ones first. A ray to the
/// eye crosses each of the three planes between children at most once, toward the eye's side. An orthographic picture has
/// one order for the whole tree, given by the signs of the view direction; a perspective one has its own at every node,
/// given by the side of each plane on which the eye lies. Sides are taken in index space, where the planes are brick
/// faces; the order holds for sheared and mirrored grids, and for an eye inside the volume.
///
/// Cost is proportional to bricks times levels. Bricks that overlap come in some order.
///
/// # Panics
/// From 2^32 bricks on.
pub fn back_to_front(layout: &BrickLayout, grid: &Grid, camera: &Camera, bricks: &[BrickId]) -> Vec<usize> {
    let viewer = Viewer::new(grid, camera);
    let mut placed: Vec<OrderedBrick> = bricks.iter().enumerate().map(|(at, id)| OrderedBrick::new(*id, at)).collect();
    let mut scratch = placed.clone();
    let mut order = vec![0; bricks.len()];
    part(layout, &viewer, layout.root(), &mut placed, &mut scratch, &mut order);
    order
}

/// A brick among the bricks of level 0: the first one that it covers.
#[derive(Clone, Copy)]
struct OrderedBrick {
    first: UVec3,
    at: u32,
}

/// Where rays come from, in index space.
enum Viewer {
    Eye(DVec3),
    Direction(DVec3),
}

const N_OCTANTS: usize = 8;

impl Viewer {
    fn new(grid: &Grid, camera: &Camera) -> Viewer {
        match camera.projection() {
            Projection::Perspective { .. } => Viewer::Eye(grid.index(WorldPos(camera.eye())).0),
            Projection::Orthographic { .. } => {
                Viewer::Direction(grid.world_to_index().transform_vector3(camera.forward()))
            }
        }
    }

    /// The octant of `node` that rays reach first: one bit per axis, x lowest.
    fn first_reached(&self, layout: &BrickLayout, node: BrickId) -> usize {
        let is_upper = match self {
            Viewer::Eye(eye) => eye.cmpge(split(layout, node)),
            Viewer::Direction(direction) => direction.cmplt(DVec3::ZERO),
        };
        is_upper.bitmask() as usize
    }
}

/// Where the faces between a node's children lie, in index space.
fn split(layout: &BrickLayout, node: BrickId) -> DVec3 {
    let middle = BrickId { level: Level(node.level.0 - 1), coords: node.coords * 2 + 1 };
    layout.sample_box(middle).min + 0.5
}

/// Writes the order of the bricks below a node; `bricks`, `scratch` and `order` are of one length.
fn part(
    layout: &BrickLayout,
    viewer: &Viewer,
    node: BrickId,
    bricks: &mut [OrderedBrick],
    scratch: &mut [OrderedBrick],
    order: &mut [usize],
) {
    if bricks.len() < 2 || node.level == Level(0) {
        return write(bricks, order);
    }
    // The octant opposite to the one that rays reach first is drawn first.
    let first_drawn = !viewer.first_reached(layout, node) & (N_OCTANTS - 1);
    let rank = |brick: &OrderedBrick| brick.octant(node.level) ^ first_drawn;
    if node.level == Level(1) {
        bricks.sort_unstable_by_key(rank);
        return write(bricks, order);
    }
    let mut start = 0;
    for (rank, end) in scatter(bricks, scratch, rank).into_iter().enumerate() {
        let (bricks, scratch) = (&mut bricks[start..end], &mut scratch[start..end]);
        part(layout, viewer, child(node, rank ^ first_drawn), scratch, bricks, &mut order[start..end]);
        start = end;
    }
}

fn write(bricks: &[OrderedBrick], order: &mut [usize]) {
    order.iter_mut().zip(bricks).for_each(|(place, brick)| *place = brick.at as usize);
}

/// Sorts by rank; returns where each rank ends.
fn scatter(
    from: &[OrderedBrick],
    to: &mut [OrderedBrick],
    rank: impl Fn(&OrderedBrick) -> usize,
) -> [usize; N_OCTANTS] {
    let mut ends = [0; N_OCTANTS];
    from.iter().for_each(|brick| ends[rank(brick)] += 1);
    let mut n = 0;
    for end in &mut ends {
        (*end, n) = (n, n + *end);
    }
    for brick in from {
        let end = &mut ends[rank(brick)];
        to[*end] = *brick;
        *end += 1;
    }
    ends
}

impl OrderedBrick {
    fn new(id: BrickId, at: usize) -> OrderedBrick {
        let at = u32::try_from(at).expect("fewer than 2^32 bricks");
        OrderedBrick { first: id.coords << u32::from(id.level.0).min(u32::BITS - 1), at }
    }

    /// In which octant of a node of `level` it lies: one bit per axis, x lowest.
    #[inline]
    fn octant(&self, level: Level) -> usize {
        let UVec3 { x, y, z } = (self.first >> u32::from(level.0 - 1)) & 1;
        (x | y << 1 | z << 2) as usize
    }
}

fn child(node: BrickId, octant: usize) -> BrickId {
    let octant = octant as u32;
    let coords = node.coords * 2 + UVec3::new(octant & 1, octant >> 1 & 1, octant >> 2);
    BrickId { level: Level(node.level.0 - 1), coords }
}
