//! Whether a mesh is watertight, and keeps to the edges of its coarse zones.

use std::collections::HashMap;

use brickfield_core::glam::DVec3;

use crate::chart::corners;
use crate::zone::inner_nodes;
use crate::{CurvilinearGrid, Node, Selection, SurrogateMesh, Zone};

/// What is wrong with a mesh.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum MeshFault {
    #[error("triangle {triangle} has vertex {vertex}; there are {n_vertices}")]
    NoVertex { triangle: usize, vertex: u32, n_vertices: usize },
    #[error("two triangles have the edge from {from} to {to} on the same side")]
    Doubled { from: DVec3, to: DVec3 },
    #[error("one triangle has the edge from {from} to {to}, which is not on the border: a crack")]
    Crack { from: DVec3, to: DVec3 },
    #[error("no triangle has the border from row {} and column {} to row {} and column {}", from.row, from.column, to.row, to.column)]
    BorderMissing { from: Node, to: Node },
    #[error(
        "the vertex of row {} and column {} is {distance} away from the edge of {leaf}, which it lies in; {bound} is allowed",
        node.row, node.column
    )]
    OffEdge { node: Node, leaf: Zone, distance: f64, bound: f64 },
    #[error(
        "the vertex of row {} and column {} has the value {value} on an edge of {leaf} that has {of_edge} there; a difference of {bound} is allowed",
        node.row, node.column
    )]
    ValueOffEdge { node: Node, leaf: Zone, value: f32, of_edge: f64, bound: f64 },
}

/// The position and value of a vertex, bit by bit.
type Bits = ([u64; 3], u32);

/// A step between neighbouring nodes, the lesser one first.
type Step = [Node; 2];

/// Checks a mesh against its selection, without the neighbourhoods by which it was made.
///
/// - Each edge between two vertices, told by the bits of their positions and values, belongs to two triangles, once in each direction;
///   an edge on the border of the selected zones to one.
/// - A vertex within an edge of a leaf lies on the straight line between the ends, within 2^-40 of the size of the numbers, and
///   has the value that is linear between the ends, within 2^-20. So a coarse leaf looks the same whatever lies beside it.
///
/// # Errors
/// The first fault.
pub fn check_mesh(grid: &CurvilinearGrid, selection: &Selection, mesh: &SurrogateMesh) -> Result<(), MeshFault> {
    let leaves = selection.leaves();
    check_edges(grid, mesh, border(grid, &leaves))?;
    let vertices: HashMap<Node, usize> = mesh.nodes.iter().enumerate().map(|(i, node)| (*node, i)).collect();
    for leaf in leaves {
        check_leaf(grid, mesh, &vertices, leaf)?;
    }
    Ok(())
}

/// The steps around the leaves that belong to one of them.
fn border(grid: &CurvilinearGrid, leaves: &[Zone]) -> HashMap<Step, u32> {
    let mut border: HashMap<Step, u32> = HashMap::new();
    for leaf in leaves {
        let corners = corners(&grid.layout().descendants(*leaf));
        for i in 0..4 {
            let ends = [corners[i], corners[(i + 1) % 4]];
            for step in steps(grid, ends) {
                *border.entry(step).or_default() += 1;
            }
        }
    }
    border.retain(|_, n| *n == 1);
    border
}

fn check_edges(grid: &CurvilinearGrid, mesh: &SurrogateMesh, mut border: HashMap<Step, u32>) -> Result<(), MeshFault> {
    let mut edges: HashMap<[Bits; 2], [u32; 2]> = HashMap::new();
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        let n_vertices = mesh.positions.len().min(mesh.values.len()).min(mesh.nodes.len());
        if let Some(vertex) = vertices.iter().copied().find(|v| *v as usize >= n_vertices) {
            return Err(MeshFault::NoVertex { triangle, vertex, n_vertices });
        }
        for i in 0..3 {
            let edge = [vertices[i], vertices[(i + 1) % 3]];
            if edges.insert(edge.map(|v| bits(mesh, v)), edge).is_some() {
                let [from, to] = edge.map(|v| mesh.positions[v as usize]);
                return Err(MeshFault::Doubled { from, to });
            }
        }
    }
    // What has no counterpart must be the border. A fault of the least edge is reported, so that reports do not depend on hashes.
    let mut open: Vec<[u32; 2]> =
        edges.iter().filter(|(bits, _)| !edges.contains_key(&[bits[1], bits[0]])).map(|(_, edge)| *edge).collect();
    open.sort_unstable();
    for edge in open {
        let [from, to] = edge.map(|v| mesh.positions[v as usize]);
        let [a, b] = edge.map(|v| mesh.nodes[v as usize]);
        if !take_border(grid, &mut border, a, b) {
            return Err(MeshFault::Crack { from, to });
        }
    }
    border.keys().min().map_or(Ok(()), |[from, to]| Err(MeshFault::BorderMissing { from: *from, to: *to }))
}

/// Takes the steps between two nodes of one row or column from the border; `false` if not all of them belong to it. Of several ways, on both
/// sides of a seam, the shortest one is taken.
fn take_border(grid: &CurvilinearGrid, border: &mut HashMap<Step, u32>, a: Node, b: Node) -> bool {
    let ways = grid.copies(a).flat_map(|a| grid.copies(b).map(move |b| [a, b]));
    let mut ways: Vec<[Node; 2]> = ways.filter(|[a, b]| a.row == b.row || a.column == b.column).collect();
    ways.sort_by_key(|[a, b]| a.row.abs_diff(b.row) + a.column.abs_diff(b.column));
    ways.into_iter().any(|way| {
        let steps = steps(grid, way);
        let is_border = steps.iter().all(|step| border.contains_key(step));
        if is_border {
            for step in steps {
                border.remove(&step);
            }
        }
        is_border
    })
}

fn steps(grid: &CurvilinearGrid, way: [Node; 2]) -> Vec<Step> {
    let nodes: Vec<Node> = [way[0]].into_iter().chain(inner_nodes(way)).chain([way[1]]).collect();
    let step = |ends: &[Node]| {
        let [a, b] = [ends[0], ends[1]].map(|node| grid.canonical(node));
        [a.min(b), a.max(b)]
    };
    nodes.windows(2).map(step).collect()
}

fn check_leaf(
    grid: &CurvilinearGrid,
    mesh: &SurrogateMesh,
    vertices: &HashMap<Node, usize>,
    leaf: Zone,
) -> Result<(), MeshFault> {
    let corners = corners(&grid.layout().descendants(leaf));
    for i in 0..4 {
        let ends = [corners[i], corners[(i + 1) % 4]];
        let [a, b] = ends.map(|node| vertices.get(&grid.canonical(node)).copied());
        for node in inner_nodes(ends).map(|node| grid.canonical(node)) {
            if let (Some(a), Some(b), Some(vertex)) = (a, b, vertices.get(&node).copied()) {
                check_on_edge(mesh, [a, b], vertex, leaf)?;
            }
        }
    }
    Ok(())
}

fn check_on_edge(mesh: &SurrogateMesh, [a, b]: [usize; 2], vertex: usize, leaf: Zone) -> Result<(), MeshFault> {
    let [from, to, at] = [a, b, vertex].map(|i| mesh.positions[i]);
    let along = ((at - from).dot(to - from) / from.distance_squared(to)).clamp(0.0, 1.0);
    let distance = at.distance(from.lerp(to, along));
    let node = mesh.nodes[vertex];
    let bound = (from.abs().max_element() + to.abs().max_element()) * 2f64.powi(-40);
    // A distance that is no number is a fault, too.
    if distance > bound || distance.is_nan() {
        return Err(MeshFault::OffEdge { node, leaf, distance, bound });
    }
    let [low, high] = [a, b].map(|i| f64::from(mesh.values[i]));
    let (of_edge, value) = (low + (high - low) * along, mesh.values[vertex]);
    let bound = (low.abs() + high.abs()) * 2f64.powi(-20);
    let difference = (f64::from(value) - of_edge).abs();
    if difference > bound || difference.is_nan() {
        return Err(MeshFault::ValueOffEdge { node, leaf, value, of_edge, bound });
    }
    Ok(())
}

fn bits(mesh: &SurrogateMesh, vertex: u32) -> Bits {
    let i = vertex as usize;
    (mesh.positions[i].to_array().map(f64::to_bits), mesh.values[i].to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grids::{KINDS, Kind, random_leaves};
    use crate::mesh::{Passes, mesh_by};
    use crate::{QuadTree, surrogate_mesh};

    /// Meshes of selections on a grid, made with some of the passes. Only selections with vertices within edges are of interest.
    fn faults(kind: Kind, passes: Passes) -> Vec<Option<MeshFault>> {
        let tree = QuadTree::build(kind.grid(21, 38));
        let fault = |seed| {
            let selection = Selection::of_leaves(&tree, random_leaves(&tree, seed)).unwrap();
            let mesh = mesh_by(tree.grid(), &selection, passes);
            (mesh.n_moved > 0).then(|| check_mesh(tree.grid(), &selection, &mesh).err())
        };
        let faults: Vec<_> = (0..60).filter_map(fault).collect();
        assert!(faults.len() > 40, "{kind:?}: only {} selections of several levels", faults.len());
        faults
    }

    #[test]
    fn both_passes_leave_no_fault() {
        for kind in KINDS {
            assert!(faults(kind, Passes::Both).iter().all(Option::is_none), "{kind:?}");
        }
    }

    #[test]
    fn a_mesh_that_is_not_stitched_has_cracks() {
        for kind in KINDS {
            for passes in [Passes::ConstrainOnly, Passes::Neither] {
                let faults = faults(kind, passes);
                assert!(
                    faults.iter().all(|fault| matches!(fault, Some(MeshFault::Crack { .. }))),
                    "{kind:?} {faults:?}"
                );
            }
        }
    }

    #[test]
    fn a_mesh_that_is_not_constrained_leaves_the_edges() {
        for kind in KINDS {
            let is_off = |fault: &Option<MeshFault>| {
                matches!(fault, Some(MeshFault::OffEdge { .. } | MeshFault::ValueOffEdge { .. }))
            };
            let faults = faults(kind, Passes::StitchOnly);
            assert!(faults.iter().all(is_off), "{kind:?} {faults:?}");
        }
    }

    #[test]
    fn single_wrong_bits_and_triangles_are_found() {
        let tree = QuadTree::build(Kind::Torus.grid(12, 20));
        let selection = Selection::of_leaves(&tree, random_leaves(&tree, 3)).unwrap();
        let mesh = surrogate_mesh(tree.grid(), &selection).unwrap();
        let fault = |mesh: &SurrogateMesh| check_mesh(tree.grid(), &selection, mesh).unwrap_err();

        // One triangle with a copy of a vertex, one bit away.
        let mut split = mesh.clone();
        let [vertex, ..] = split.triangles[5];
        let copy = split.positions.len() as u32;
        let mut position = split.positions[vertex as usize];
        position.x = position.x.next_up();
        split.positions.push(position);
        split.values.push(split.values[vertex as usize]);
        split.nodes.push(split.nodes[vertex as usize]);
        split.triangles[5][0] = copy;
        assert!(matches!(fault(&split), MeshFault::Crack { .. }));
        // The same with the value.
        split.positions[copy as usize] = split.positions[vertex as usize];
        split.values[copy as usize] = split.values[vertex as usize].next_up();
        assert!(matches!(fault(&split), MeshFault::Crack { .. }));

        let mut missing = mesh.clone();
        missing.triangles.pop();
        assert!(matches!(fault(&missing), MeshFault::Crack { .. }));
        let mut turned = mesh.clone();
        turned.triangles[0].swap(0, 1);
        assert!(matches!(fault(&turned), MeshFault::Doubled { .. }));
        let mut wild = mesh.clone();
        wild.triangles[0][2] = 1 << 30;
        assert!(matches!(fault(&wild), MeshFault::NoVertex { .. }));
    }

    #[test]
    fn a_missing_border_is_found() {
        let tree = QuadTree::build(Kind::Flat.grid(4, 4));
        let selection = Selection::of_leaves(&tree, [tree.layout().root()]).unwrap();
        let fault = check_mesh(tree.grid(), &selection, &SurrogateMesh::default()).unwrap_err();
        assert_eq!(fault.to_string(), "no triangle has the border from row 0 and column 0 to row 0 and column 1");
    }
}
