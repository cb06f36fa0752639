//! The order that a curve of errors shows.

use super::Row;

/// The slope of log error over log step, by least squares, of one curve's rows.
///
/// Steps above a voxel are left out (no rule has its order where it jumps over cells), and so are errors within a factor
/// of 3 of the curve's least (there the floor of f32, or of the fast mode, shows instead). `None` with fewer than three
/// steps left.
pub fn observed_order(rows: &[&Row]) -> Option<f64> {
    let floor = rows.iter().map(|r| r.rmse).fold(f64::INFINITY, f64::min);
    let counts = |r: &&&Row| r.step_voxels <= 1.0 && r.rmse > 3.0 * floor;
    let points: Vec<[f64; 2]> = rows.iter().filter(counts).map(|r| [r.step_voxels.ln(), r.rmse.ln()]).collect();
    if points.len() < 3 {
        return None;
    }
    let mean = |c: usize| points.iter().map(|p| p[c]).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(0), mean(1)];
    let products = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>();
    let squares = points.iter().map(|p| (p[0] - x) * (p[0] - x)).sum::<f64>();
    Some(products / squares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::row;

    fn order(errors: impl Fn(f64) -> f64) -> Option<f64> {
        let step = |k: i32| 4.0 / f64::from(1 << k);
        let rows: Vec<Row> = (0..9).map(|k| row("cpu", "midpoint", "exact", step(k), 1.0, errors(step(k)))).collect();
        observed_order(&rows.iter().collect::<Vec<_>>())
    }

    #[test]
    fn the_order_is_seen_above_the_floor_only() {
        assert!((order(|h| 0.3 * h * h).unwrap() - 2.0).abs() < 1e-12);
        assert!((order(|h| if h > 1.0 { 0.9 } else { (0.01 * h).max(1e-4) }).unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(order(|_| 1e-3), None);
    }
}
