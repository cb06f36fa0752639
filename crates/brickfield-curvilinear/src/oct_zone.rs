//! What is stored of a zone of a volume, and how it is found out.

use brickfield_core::glam::{DVec3, UVec3, Vec3};
use brickfield_core::{Aabb, rounded_up};
use rayon::prelude::*;

use crate::volume::CellMap;
use crate::zone::extension_to;
use crate::{CellBox, CurvilinearVolume};

/// What an octree knows of a zone: 32 bytes, stored for every zone above level 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OctSummary {
    /// How far nodes lie beyond the box around the zone's eight corners, along each axis, in world units; rounded up.
    pub extension: Vec3,
    /// The mean of the values, cell by cell: a node counts once for each cell at which it is a corner. NaN if all cells have holes.
    pub value: f32,
    /// The least and the greatest value of the nodes that are no holes.
    pub range: [f32; 2],
    /// The greatest deviation of a node's value from the trilinear cell between the zone's corners, at the node's place in that cell
    /// (L-infinity); rounded up. Infinite if a node is a hole. A node beside the cell is compared with a near place of the cell.
    pub error: f32,
    /// The shortest of the four diagonals, in world units.
    pub size: f32,
}

impl OctSummary {
    /// Whether all cells have holes.
    pub fn is_void(&self) -> bool {
        self.value.is_nan()
    }
}

/// Looks at every node of some cells, as if they were a zone. `values` has one value for each node of the volume; NaN is a hole.
///
/// Many nodes are looked at by several threads, with the same result.
///
/// # Panics
/// If there are no cells, or they lead out of the volume; without a value for each node.
pub fn examine_cells(volume: &CurvilinearVolume, values: &[f32], cells: &CellBox) -> OctSummary {
    let zone = Zone::of(volume, values, cells);
    let layers = cells.first.z..cells.first.z + cells.n.z + 1;
    let scans: Vec<Scan> = if (cells.n + 1).element_product() as usize > SERIAL_NODES {
        layers.into_par_iter().map(|z| zone.scan_layer(z)).collect()
    } else {
        layers.map(|z| zone.scan_layer(z)).collect()
    };
    let scan = scans.into_iter().fold(Scan::NOTHING, Scan::and);
    let corners = Aabb::of_points(zone.corners);
    OctSummary {
        extension: extension(&corners, &scan),
        value: zone.mean(&scan) as f32,
        range: scan.range,
        error: if scan.has_hole { f32::INFINITY } else { rounded_up(scan.error) },
        size: (0..4).map(|i| zone.corners[i].distance(zone.corners[7 - i])).fold(f64::INFINITY, f64::min) as f32,
    }
}

/// Nodes above which a zone is looked at in layers, by several threads.
const SERIAL_NODES: usize = 1 << 14;

struct Zone<'a> {
    volume: &'a CurvilinearVolume,
    values: &'a [f32],
    cells: &'a CellBox,
    corners: [DVec3; 8],
    corner_values: [f64; 8],
    map: CellMap,
}

/// What a pass over nodes finds.
#[derive(Clone, Copy)]
struct Scan {
    low: DVec3,
    high: DVec3,
    range: [f32; 2],
    error: f64,
    has_hole: bool,
    /// Of nodes, each with its part of the cells around it; NaN with a hole.
    sum: f64,
}

impl<'a> Zone<'a> {
    fn of(volume: &'a CurvilinearVolume, values: &'a [f32], cells: &'a CellBox) -> Zone<'a> {
        let corner = |i: u32| volume.number(cells.first + cells.n * UVec3::new(i & 1, i >> 1 & 1, i >> 2));
        let numbers: [usize; 8] = std::array::from_fn(|i| corner(i as u32));
        let corners = numbers.map(|i| volume.positions()[i]);
        let corner_values = numbers.map(|i| f64::from(values[i]));
        Zone { volume, values, cells, corners, corner_values, map: CellMap::new(&corners) }
    }

    fn scan_layer(&self, z: u32) -> Scan {
        let CellBox { first, n } = *self.cells;
        let mut scan = Scan::NOTHING;
        for y in first.y..=first.y + n.y {
            for x in first.x..=first.x + n.x {
                let node = UVec3::new(x, y, z);
                let number = self.volume.number(node);
                scan.add(self, node - first, self.volume.positions()[number], self.values[number]);
            }
        }
        scan
    }

    /// By how much a node's value is off the trilinear cell.
    fn deviation(&self, node: UVec3, position: DVec3, value: f32) -> f64 {
        let guess = node.as_dvec3() / self.cells.n.as_dvec3();
        let local = self.map.local_inside(position, guess);
        (f64::from(value) - trilinear(&self.corner_values, local)).abs()
    }

    /// The mean of the cells that have no hole.
    fn mean(&self, scan: &Scan) -> f64 {
        let n_cells = self.cells.n.as_dvec3().element_product();
        if !scan.has_hole {
            return scan.sum / n_cells;
        }
        let CellBox { first, n } = *self.cells;
        let cells = (0..n.z).flat_map(|z| (0..n.y).flat_map(move |y| (0..n.x).map(move |x| UVec3::new(x, y, z))));
        let value = |cell: UVec3, i: u32| {
            let node = first + cell + UVec3::new(i & 1, i >> 1 & 1, i >> 2);
            f64::from(self.values[self.volume.number(node)])
        };
        let means = cells.map(|cell| (0..8).map(|i| value(cell, i)).sum::<f64>() * 0.125).filter(|mean| !mean.is_nan());
        let (sum, n) = means.fold((0.0, 0u64), |(sum, n), mean| (sum + mean, n + 1));
        sum / n as f64
    }
}

impl Scan {
    const NOTHING: Scan = Scan {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        range: [f32::INFINITY, f32::NEG_INFINITY],
        error: 0.0,
        has_hole: false,
        sum: 0.0,
    };

    fn add(&mut self, zone: &Zone, node: UVec3, position: DVec3, value: f32) {
        if value.is_nan() {
            self.has_hole = true;
            return;
        }
        (self.low, self.high) = (self.low.min(position), self.high.max(position));
        self.range = [self.range[0].min(value), self.range[1].max(value)];
        self.sum += f64::from(value) * part(node, zone.cells.n);
        if !self.has_hole {
            self.error = self.error.max(zone.deviation(node, position, value));
        }
    }

    fn and(self, other: Scan) -> Scan {
        Scan {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            range: [self.range[0].min(other.range[0]), self.range[1].max(other.range[1])],
            error: self.error.max(other.error),
            has_hole: self.has_hole | other.has_hole,
            sum: self.sum + other.sum,
        }
    }
}

/// The part of a cell that a node of a zone counts for: 1 inside, a half on a face, a quarter on an edge, an eighth at a corner.
fn part(node: UVec3, n: UVec3) -> f64 {
    let along = |axis: usize| if node[axis] == 0 || node[axis] == n[axis] { 0.5 } else { 1.0 };
    along(0) * along(1) * along(2)
}

fn trilinear(corners: &[f64; 8], local: DVec3) -> f64 {
    let mix = |a: f64, b: f64, x: f64| a + (b - a) * x;
    let x: [f64; 4] = std::array::from_fn(|i| mix(corners[2 * i], corners[2 * i + 1], local.x));
    mix(mix(x[0], x[1], local.y), mix(x[2], x[3], local.y), local.z)
}

fn extension(corners: &Aabb, scan: &Scan) -> Vec3 {
    if scan.low.x > scan.high.x {
        return Vec3::ZERO;
    }
    extension_to(corners, scan.low, scan.high)
}
