//! What is stored of a coarse zone, and how it is found out.

use brickfield_core::glam::{DVec2, DVec3, Vec3};
use brickfield_core::{Aabb, rounded_up};
use rayon::prelude::*;

use crate::chart::{Chart, DrawnZone, Quad, along_edge};
use crate::{CurvilinearGrid, Node, Positions, ZoneRange};

/// What the hierarchy knows of a zone: 24 bytes, stored for every zone of the coarser levels (Wynn et al. 1999, section 3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneSummary {
    /// How far nodes lie beyond the box around the zone's four corners, along each axis, in world units; rounded up.
    pub extension: Vec3,
    /// The mean of the values, final zone by final zone: a node counts once for each final zone at which it is a corner. In 2 x 2
    /// zones the weights of nodes are 1, 2, 1; 2, 4, 2; 1, 2, 1 sixteenths (figure 8). NaN if all final zones have holes.
    pub value: f32,
    /// The greatest deviation of a node's value from the value that is drawn there if the zone is drawn coarse (L-infinity); rounded up.
    /// Infinite for a zone that must not be drawn coarse.
    pub error: f32,
    /// The shorter diagonal, in world units.
    pub size: f32,
}

/// Whether a zone may be drawn coarse: as one quadrilateral, and with finer zones beside it that keep to its edges.
///
/// "Inside" and "beyond" are seen along the normal of the zone's diagonals; in height fields, along the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Niceness {
    /// It may: the grid is nice here (Wynn et al. 1999, section 2.5).
    Nice,
    /// All its final zones have holes, so that there is nothing to draw.
    Void,
    /// One of its nodes is a hole.
    Hole,
    /// Its four corners make no convex quadrilateral.
    NotConvex,
    /// One of its inner nodes lies outside of its quadrilateral.
    NodeOutside,
    /// The nodes of one of its edges, projected onto it, are not in order.
    EdgeTurnsBack,
    /// A node of a zone beside it lies on its side of the common edge.
    NeighbourInside,
}

impl ZoneSummary {
    /// Whether the zone may be drawn as one quadrilateral.
    pub fn is_nice(&self) -> bool {
        self.error.is_finite() && !self.is_void()
    }

    /// Whether all its final zones have holes.
    pub fn is_void(&self) -> bool {
        self.value.is_nan()
    }

    /// The summary of a final zone, which is the data itself: without extension and error.
    pub fn of_final(grid: &CurvilinearGrid, range: &ZoneRange) -> ZoneSummary {
        let quad = Quad::of(grid, range);
        let value = quad.values.iter().sum::<f64>() * 0.25;
        ZoneSummary { extension: Vec3::ZERO, value: value as f32, error: 0.0, size: quad.size() as f32 }
    }
}

/// Looks at every node of a zone: its summary, and whether it may be drawn coarse.
///
/// `range` is that of a zone above level 0, or any other range of final zones of the grid. A zone of many nodes is looked at by several threads, with the same result.
///
/// # Panics
/// If the range is empty or leads out of the grid.
pub fn examine(grid: &CurvilinearGrid, range: &ZoneRange) -> (ZoneSummary, Niceness) {
    let quad = Quad::of(grid, range);
    let drawn = drawn_zone(grid, &quad);
    let inner = scan(grid, range, drawn.as_ref());
    let edges = drawn.as_ref().map(|(chart, _)| examine_edges(grid, &quad, chart));
    let niceness = niceness(&inner, edges.as_ref());
    let error = match (niceness, edges) {
        (Niceness::Nice, Some(Ok(of_edges))) => rounded_up(inner.error.max(of_edges)),
        _ => f32::INFINITY,
    };
    let summary = ZoneSummary {
        extension: extension(grid, &quad, &inner),
        value: (inner.sum / inner.n_drawn as f64) as f32,
        error,
        size: quad.size() as f32,
    };
    (summary, niceness)
}

fn drawn_zone(grid: &CurvilinearGrid, quad: &Quad) -> Option<(Chart, DrawnZone)> {
    let chart = Chart::of(grid, quad)?;
    let flat = quad.nodes.map(|node| chart.at(grid, node));
    let drawn = DrawnZone::new(flat, quad.values, quad.cut(grid))?;
    Some((chart, drawn))
}

fn niceness(inner: &Scan, edges: Option<&Result<f64, Niceness>>) -> Niceness {
    match edges {
        _ if inner.n_drawn == 0 => Niceness::Void,
        _ if inner.has_hole => Niceness::Hole,
        None => Niceness::NotConvex,
        _ if inner.is_outside => Niceness::NodeOutside,
        Some(Err(reason)) => *reason,
        Some(Ok(_)) => Niceness::Nice,
    }
}

/// What a pass over nodes finds.
#[derive(Clone, Copy)]
struct Scan {
    /// Of a height field, the range of the values is in `low.x` and `high.x`.
    low: DVec3,
    high: DVec3,
    /// Of inner nodes; those of the edges are looked at apart.
    error: f64,
    is_outside: bool,
    has_hole: bool,
    /// The sum of the mean values of final zones without holes.
    sum: f64,
    n_drawn: u64,
}

/// Nodes above which a zone is looked at in bands, by several threads.
const BAND_NODES: usize = 1 << 16;

fn scan(grid: &CurvilinearGrid, range: &ZoneRange, drawn: Option<&(Chart, DrawnZone)>) -> Scan {
    let n_band = (BAND_NODES / (range.columns.len() + 1)).max(1);
    if range.rows.len() <= n_band {
        return scan_rows(grid, range, range, drawn);
    }
    let starts: Vec<u32> = range.rows.clone().step_by(n_band).collect();
    let band = |start: &u32| ZoneRange {
        rows: *start..range.rows.end.min(start + n_band as u32),
        columns: range.columns.clone(),
    };
    let scans: Vec<Scan> = starts.par_iter().map(|start| scan_rows(grid, range, &band(start), drawn)).collect();
    scans.into_iter().fold(Scan::NOTHING, Scan::and)
}

/// Looks at the rows of final zones of a band, and at the nodes of each row of nodes that the band has above its end.
fn scan_rows(grid: &CurvilinearGrid, whole: &ZoneRange, band: &ZoneRange, drawn: Option<&(Chart, DrawnZone)>) -> Scan {
    let mut scan = Scan::NOTHING;
    let columns = whole.columns.start..whole.columns.end + 1;
    let (mut above, mut sum_above) = (&[][..], 0.0);
    for row in band.rows.start..=band.rows.end {
        let values = grid.row_values(row, columns.clone());
        let sum = trapezium_sum(values);
        if row > band.rows.start {
            scan.add_means([above, values], [sum_above, sum]);
        }
        (above, sum_above) = (values, sum);
        if row < band.rows.end || row == whole.rows.end {
            scan.has_hole |= sum.is_nan();
            scan.add_extent(grid, row, columns.start, values);
            if let Some((chart, drawn)) = drawn.filter(|_| row > whole.rows.start && row < whole.rows.end) {
                scan.add_errors(grid, row, columns.start, values, chart, drawn);
            }
        }
    }
    scan
}

/// The sum of the means of each two neighbours; NaN if there is a hole.
fn trapezium_sum(values: &[f32]) -> f64 {
    let (first, last) = (f64::from(values[0]), f64::from(values[values.len() - 1]));
    values.iter().map(|v| f64::from(*v)).sum::<f64>() - 0.5 * (first + last)
}

impl Scan {
    const NOTHING: Scan = Scan {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        error: 0.0,
        is_outside: false,
        has_hole: false,
        sum: 0.0,
        n_drawn: 0,
    };

    fn and(self, other: Scan) -> Scan {
        Scan {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            error: self.error.max(other.error),
            is_outside: self.is_outside | other.is_outside,
            has_hole: self.has_hole | other.has_hole,
            sum: self.sum + other.sum,
            n_drawn: self.n_drawn + other.n_drawn,
        }
    }

    fn add_extent(&mut self, grid: &CurvilinearGrid, row: u32, first: u32, values: &[f32]) {
        if let Positions::Heights(_) = grid.positions() {
            // `min` and `max` pass over NaN.
            let low = values.iter().fold(f32::INFINITY, |low, v| low.min(*v));
            let high = values.iter().fold(f32::NEG_INFINITY, |high, v| high.max(*v));
            self.low.x = self.low.x.min(f64::from(low));
            self.high.x = self.high.x.max(f64::from(high));
            return;
        }
        for (column, value) in (first..).zip(values) {
            if !value.is_nan() {
                let p = grid.position(Node { row, column });
                (self.low, self.high) = (self.low.min(p), self.high.max(p));
            }
        }
    }

    /// The deviations of the nodes within a row. A hole has none: `max` passes over NaN.
    fn add_errors(
        &mut self,
        grid: &CurvilinearGrid,
        row: u32,
        first: u32,
        values: &[f32],
        chart: &Chart,
        drawn: &DrawnZone,
    ) {
        let inner = (first + 1..).zip(&values[1..values.len() - 1]);
        let mut error = self.error;
        match chart {
            Chart::Index => inner.for_each(|(column, value)| {
                let at = DVec2::new(f64::from(column), f64::from(row));
                error = error.max((f64::from(*value) - drawn.value(at)).abs());
            }),
            Chart::Plane { .. } => inner.for_each(|(column, value)| {
                let at = chart.at(grid, Node { row, column });
                error = error.max((f64::from(*value) - drawn.value(at)).abs());
                self.is_outside |= !drawn.contains(at);
            }),
        }
        self.error = error;
    }

    /// The means of the final zones between two rows of nodes, whose trapezium sums are known.
    fn add_means(&mut self, [above, below]: [&[f32]; 2], [sum_above, sum_below]: [f64; 2]) {
        let sum = 0.5 * (sum_above + sum_below);
        if !sum.is_nan() {
            self.sum += sum;
            self.n_drawn += above.len() as u64 - 1;
            return;
        }
        for (a, b) in above.windows(2).zip(below.windows(2)) {
            let mean = (f64::from(a[0]) + f64::from(a[1]) + f64::from(b[0]) + f64::from(b[1])) * 0.25;
            if !mean.is_nan() {
                self.sum += mean;
                self.n_drawn += 1;
            }
        }
    }
}

/// The greatest deviation of the nodes on the edges, each at its projection onto its edge, where finer zones beside a coarse one have it.
///
/// # Errors
/// [`Niceness::EdgeTurnsBack`], [`Niceness::NeighbourInside`].
fn examine_edges(grid: &CurvilinearGrid, quad: &Quad, chart: &Chart) -> Result<f64, Niceness> {
    let mut error: f64 = 0.0;
    for i in 0..4 {
        let ends = [quad.nodes[i], quad.nodes[(i + 1) % 4]];
        // The step from an edge to the zones beyond it.
        let beyond = [(-1, 0), (0, 1), (1, 0), (0, -1)][i];
        error = error.max(examine_edge(grid, ends, beyond, chart)?);
    }
    Ok(error)
}

fn examine_edge(grid: &CurvilinearGrid, ends: [Node; 2], beyond: (i64, i64), chart: &Chart) -> Result<f64, Niceness> {
    let [start, end] = ends.map(|node| chart.at(grid, node));
    let [from, to] = ends.map(|node| f64::from(grid.value(node)));
    let is_inside = |at: DVec2| (end - start).perp_dot(at - start) >= 0.0;
    let (mut error, mut last): (f64, f64) = (0.0, 0.0);
    for node in inner_nodes(ends) {
        let t = along_edge(grid, ends, node).filter(|t| *t > last && *t < 1.0).ok_or(Niceness::EdgeTurnsBack)?;
        last = t;
        error = error.max((f64::from(grid.value(node)) - lerp(from, to, t)).abs());
        if matches!(chart, Chart::Index) {
            continue;
        }
        let Some(next) = grid.moved(node, beyond.0, beyond.1) else { continue };
        if !grid.value(next).is_nan() && is_inside(chart.at(grid, next)) {
            return Err(Niceness::NeighbourInside);
        }
    }
    Ok(error)
}

/// The nodes between the ends of an edge, from the first end to the second.
pub(crate) fn inner_nodes([a, b]: [Node; 2]) -> impl Iterator<Item = Node> {
    let n = a.row.abs_diff(b.row) + a.column.abs_diff(b.column);
    let step = |from: u32, to: u32, i: u32| {
        if from < to {
            from + i
        } else if from > to {
            from - i
        } else {
            from
        }
    };
    (1..n).map(move |i| Node { row: step(a.row, b.row, i), column: step(a.column, b.column, i) })
}

/// Exactly `from` at 0.
#[inline]
pub(crate) fn lerp(from: f64, to: f64, t: f64) -> f64 {
    from + (to - from) * t
}

fn extension(grid: &CurvilinearGrid, quad: &Quad, scan: &Scan) -> Vec3 {
    let (low, high) = match grid.positions() {
        _ if scan.low.x > scan.high.x => return Vec3::ZERO,
        Positions::Heights(field) => {
            let ends = quad.nodes.map(|node| [scan.low.x, scan.high.x].map(|value| field.at(node, value)));
            let around = Aabb::of_points(ends.into_iter().flatten());
            (around.min, around.max)
        }
        Positions::Curvilinear(_) | Positions::Offsets { .. } => (scan.low, scan.high),
    };
    let inner = Aabb::of_points(quad.positions);
    extension_to(&inner, low, high)
}

/// By how much a box must grow to all sides to hold another one.
pub(crate) fn extension_to(inner: &Aabb, low: DVec3, high: DVec3) -> Vec3 {
    let beyond = (inner.min - low).max(high - inner.max);
    // The box is made by a sum, which rounds: room for that, too.
    let room = low.abs().max(high.abs()).max(inner.min.abs()).max(inner.max.abs()) * f64::EPSILON;
    Vec3::from([0, 1, 2].map(|i| if beyond[i] > 0.0 { rounded_up(beyond[i] + room[i]) } else { 0.0 }))
}
