//! A selection as triangles without cracks (Wynn et al. 1999, section 2.5).

use brickfield_core::Level;
use brickfield_core::glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::chart::{Quad, along_edge, corners};
use crate::select::ZoneMap;
use crate::zone::lerp;
use crate::{CurvilinearGrid, Node, Selection, Zone};

/// The triangles of a selection, with a value at each vertex.
///
/// A vertex stands for one node of the grid, so that zones which share it share it bit by bit. Triangles are counter-clockwise where
/// columns run to the right and rows up.
#[derive(Clone, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct SurrogateMesh {
    /// In the world.
    pub positions: Vec<DVec3>,
    pub values: Vec<f32>,
    /// The node of each vertex. Nodes of a seam are those of the first row or column.
    pub nodes: Vec<Node>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// How many vertices were moved onto the edge of a coarser zone.
    pub n_moved: usize,
}

/// A selection of another grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a selection of {} x {} zones; the grid has {} x {}",
    of_selection[0], of_selection[1], of_grid[0], of_grid[1]
)]
#[allow(missing_docs)]
pub struct OtherGrid {
    pub of_grid: [u32; 2],
    pub of_selection: [u32; 2],
}

/// The passes that keep a mesh free of cracks. Tests leave one out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Passes {
    Both,
    #[cfg(test)]
    ConstrainOnly,
    #[cfg(test)]
    StitchOnly,
    #[cfg(test)]
    Neither,
}

impl SurrogateMesh {
    /// Positions as f32, relative to `origin`: what graphics cards take. Shared vertices stay shared.
    pub fn positions_from(&self, origin: DVec3) -> Vec<Vec3> {
        self.positions.iter().map(|p| (*p - origin).as_vec3()).collect()
    }
}

/// The mesh of a selection.
///
/// Two passes go over the leaves, after the selection labelled them:
///
/// 1. *Constrain.* A vertex that lies within an edge of a coarser leaf is moved to its projection onto that edge, and takes
///    the value that the edge has there. Coarse leaves come first, because the ends of an edge may be moved, too.
/// 2. *Stitch.* A leaf takes up the vertices on its edges, so that both sides of an edge have the same vertices. A leaf of n
///    such vertices has n + 2 triangles, which together are the two triangles of its quadrilateral.
///
/// ```text
///  +-------+---+     v is moved onto the edge a b of the coarse leaf; then the coarse leaf has
///  |       a   |     the triangles of its diagonal, cut at v
///  |       v---+
///  |       b   |
///  +-------+---+
/// ```
///
/// # Errors
/// A selection of a grid with other numbers of rows or columns.
pub fn surrogate_mesh(grid: &CurvilinearGrid, selection: &Selection) -> Result<SurrogateMesh, OtherGrid> {
    let [of_grid, of_selection] =
        [grid.layout(), selection.layout()].map(|layout| [layout.rows().n_final(), layout.columns().n_final()]);
    if of_grid != of_selection {
        return Err(OtherGrid { of_grid, of_selection });
    }
    Ok(mesh_by(grid, selection, Passes::Both))
}

pub(crate) fn mesh_by(grid: &CurvilinearGrid, selection: &Selection, passes: Passes) -> SurrogateMesh {
    let leaves = selection.leaves();
    let mut vertices = Vertices::of(grid, &leaves);
    let hanging = hanging_vertices(grid, selection, &vertices);
    let (constrains, stitches) = match passes {
        Passes::Both => (true, true),
        #[cfg(test)]
        Passes::ConstrainOnly => (true, false),
        #[cfg(test)]
        Passes::StitchOnly => (false, true),
        #[cfg(test)]
        Passes::Neither => (false, false),
    };
    if constrains {
        hanging.iter().for_each(|vertex| vertices.constrain(grid, vertex));
    }
    let taken_up = if stitches { &hanging[..] } else { &[] };
    let of_leaf = |(leaf, corners): (&Zone, &[u32; 4])| stitched(grid, *leaf, *corners, on_edges_of(*leaf, taken_up));
    let triangles = leaves.par_iter().zip(&vertices.of_leaf).flat_map_iter(of_leaf).collect();
    let Vertices { positions, values, nodes, .. } = vertices;
    SurrogateMesh { positions, values, nodes, triangles, n_moved: hanging.len() }
}

/// A vertex within an edge of a leaf.
struct Hanging {
    vertex: u32,
    leaf: Zone,
    /// Of the leaf: from corner `edge` to the next one.
    edge: usize,
    ends: [Node; 2],
    /// The node of the vertex, counted as the leaf's edge counts it.
    node: Node,
}

impl Hanging {
    /// How many nodes lie between the first end of the edge and the vertex.
    fn along(&self) -> u32 {
        self.node.row.abs_diff(self.ends[0].row) + self.node.column.abs_diff(self.ends[0].column)
    }
}

/// The corners of all leaves.
struct Vertices {
    of_leaf: Vec<[u32; 4]>,
    positions: Vec<DVec3>,
    values: Vec<f32>,
    nodes: Vec<Node>,
    of_node: ZoneMap<Node, u32>,
}

impl Vertices {
    fn of(grid: &CurvilinearGrid, leaves: &[Zone]) -> Vertices {
        let mut vertices = Vertices {
            of_leaf: Vec::with_capacity(leaves.len()),
            positions: Vec::new(),
            values: Vec::new(),
            nodes: Vec::new(),
            of_node: ZoneMap::default(),
        };
        for leaf in leaves {
            let corners = corners(&grid.layout().descendants(*leaf));
            let of_leaf = corners.map(|node| vertices.add(grid, grid.canonical(node)));
            vertices.of_leaf.push(of_leaf);
        }
        vertices
    }

    fn add(&mut self, grid: &CurvilinearGrid, node: Node) -> u32 {
        let next = self.nodes.len() as u32;
        let vertex = *self.of_node.entry(node).or_insert(next);
        if vertex == next {
            self.positions.push(grid.position(node));
            self.values.push(grid.value(node));
            self.nodes.push(node);
        }
        vertex
    }

    /// Moves a vertex onto the edge, as that is drawn. Its place along the edge is the one before any vertex was moved, which is in order
    /// on a nice zone.
    fn constrain(&mut self, grid: &CurvilinearGrid, hanging: &Hanging) {
        // An edge without length has all its vertices at its first end.
        let t = along_edge(grid, hanging.ends, hanging.node).unwrap_or(0.0);
        let [a, b] = hanging.ends.map(|node| self.of_node[&grid.canonical(node)] as usize);
        let i = hanging.vertex as usize;
        self.positions[i] = self.positions[a] + (self.positions[b] - self.positions[a]) * t;
        self.values[i] = lerp(f64::from(self.values[a]), f64::from(self.values[b]), t) as f32;
    }
}

/// The vertices on the edges of a leaf, edge by edge, each from its first end to its second.
fn on_edges_of(leaf: Zone, hanging: &[Hanging]) -> &[Hanging] {
    let of_coarser = hanging.partition_point(|h| h.leaf > leaf);
    let n = hanging[of_coarser..].partition_point(|h| h.leaf == leaf);
    &hanging[of_coarser..of_coarser + n]
}

/// The triangles of a leaf, those on the right of its diagonal first.
fn stitched(grid: &CurvilinearGrid, leaf: Zone, corners: [u32; 4], on_edges: &[Hanging]) -> Vec<[u32; 3]> {
    let first = Quad::of(grid, &grid.layout().descendants(leaf)).cut(grid);
    // The vertices of an edge, both ends included.
    let edge = |i: usize| {
        let i = (first + i) % 4;
        let within = on_edges.iter().filter(|h| h.edge == i).map(|h| h.vertex);
        std::iter::once(corners[i]).chain(within).chain([corners[(i + 1) % 4]]).collect::<Vec<u32>>()
    };
    let mut triangles = Vec::with_capacity(2 + on_edges.len());
    zip(&edge(0), &edge(1), &mut triangles);
    zip(&edge(2), &edge(3), &mut triangles);
    triangles
}

/// The triangles between two chains of vertices, the second of which goes on where the first ends: a triangle whose sides the chains are, cut
/// at all their vertices, its third side the diagonal. No triangle has all its vertices in one chain.
fn zip(to_apex: &[u32], from_apex: &[u32], triangles: &mut Vec<[u32; 3]>) {
    let back: Vec<u32> = to_apex.iter().rev().copied().collect();
    let (n, m) = (back.len() - 1, from_apex.len() - 1);
    let (mut i, mut j) = (1, 1);
    triangles.push([back[1], back[0], from_apex[1]]);
    while i < n || j < m {
        // The chain that is behind goes on.
        if j == m || (i < n && i * m <= j * n) {
            triangles.push([back[i + 1], back[i], from_apex[j]]);
            i += 1;
        } else {
            triangles.push([back[i], from_apex[j], from_apex[j + 1]]);
            j += 1;
        }
    }
}

/// The vertices that lie within an edge of a leaf: by leaves, the coarse ones first, then by edges, each from its first end on.
fn hanging_vertices(grid: &CurvilinearGrid, selection: &Selection, vertices: &Vertices) -> Vec<Hanging> {
    let of = |(vertex, node): (usize, &Node)| {
        let cells = [(-1, -1), (-1, 0), (0, -1), (0, 0)];
        cells.into_iter().find_map(|cell| hanging_on(grid, selection, vertex as u32, *node, cell))
    };
    let mut hanging: Vec<Hanging> = vertices.nodes.par_iter().enumerate().filter_map(of).collect();
    hanging.par_sort_unstable_by_key(|h| (std::cmp::Reverse(h.leaf), h.edge, h.along()));
    hanging
}

/// The leaf over one of the four final zones around a node, if the node lies within an edge of the leaf. (No node lies within edges of two
/// leaves: one would have both zones above the node, say, and the other both on its left.)
fn hanging_on(
    grid: &CurvilinearGrid,
    selection: &Selection,
    vertex: u32,
    node: Node,
    cell: (i64, i64),
) -> Option<Hanging> {
    let cell = grid.moved(node, cell.0, cell.1)?;
    let leaf = selection.leaf_over(cell.row, cell.column).filter(|leaf| leaf.level > Level(0))?;
    let corners = corners(&grid.layout().descendants(leaf));
    (0..4).find_map(|edge| {
        let ends = [corners[edge], corners[(edge + 1) % 4]];
        let node = within(grid, ends, node)?;
        Some(Hanging { vertex, leaf, edge, ends, node })
    })
}

/// A node, or its copy on the other side of a seam, that lies between the ends of an edge.
fn within(grid: &CurvilinearGrid, [a, b]: [Node; 2], node: Node) -> Option<Node> {
    let is_between = |i: u32, a: u32, b: u32| i > a.min(b) && i < a.max(b);
    grid.copies(node).find(|n| {
        (a.row == b.row && n.row == a.row && is_between(n.column, a.column, b.column))
            || (a.column == b.column && n.column == a.column && is_between(n.row, a.row, b.row))
    })
}
