//! The order of accuracy that errors show.

/// Least-squares slope of log2(error) over halvings.
pub(crate) fn slope(errors: &[f64]) -> f64 {
    let n = errors.len() as f64;
    let mean_x = (n - 1.0) / 2.0;
    let mean_y = errors.iter().map(|e| e.log2()).sum::<f64>() / n;
    let xy: f64 = errors.iter().enumerate().map(|(i, e)| (i as f64 - mean_x) * (e.log2() - mean_y)).sum();
    let xx: f64 = (0..errors.len()).map(|i| (i as f64 - mean_x).powi(2)).sum();
    -xy / xx
}
