//! A slope through errors.

/// One row of the table: a claim, and the observation.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderRow {
    /// The refined quantity, and the rule or renderer.
    pub what: String,
    /// The claimed order.
    pub order: f64,
    /// Refinement parameter (step, voxel) and error, coarsest first; each halves the one before.
    pub errors: Vec<(f64, f64)>,
    /// Errors below this are rounding, and left out.
    pub floor: f64,
    /// Least number of halvings that must be left; 0 where rounding leaves no order to see: then the finest error must be
    /// below the floor.
    pub n_halvings: usize,
}

/// The observed order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    /// The least-squares slope of log error over log parameter.
    pub slope: f64,
    /// Over how many halvings.
    pub n_halvings: usize,
}

impl OrderRow {
    /// The observed order; `None` if too few errors stand above the floor.
    pub fn observed(&self) -> Option<Observed> {
        let above: Vec<(f64, f64)> = self.errors.iter().copied().take_while(|(_, e)| *e > self.floor).collect();
        let n_halvings = above.len().saturating_sub(1);
        (n_halvings >= self.n_halvings.max(1)).then(|| Observed { slope: fit(&above), n_halvings })
    }

    /// Whether only the floor is claimed, not an order.
    pub fn claims_floor(&self) -> bool {
        self.n_halvings == 0
    }

    /// Whether the claim holds.
    pub fn holds(&self) -> bool {
        if self.claims_floor() {
            return self.errors.last().is_some_and(|(_, e)| *e <= self.floor);
        }
        self.observed().is_some_and(|o| (o.slope - self.order).abs() <= super::WITHIN)
    }
}

/// The least-squares slope of log error over log parameter.
fn fit(errors: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = errors.iter().map(|(h, e)| (h.log2(), e.log2())).collect();
    let n = logs.len() as f64;
    let mean = logs.iter().fold((0.0, 0.0), |m, l| (m.0 + l.0 / n, m.1 + l.1 / n));
    let products = logs.iter().map(|l| (l.0 - mean.0) * (l.1 - mean.1)).sum::<f64>();
    products / logs.iter().map(|l| (l.0 - mean.0).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(error: impl Fn(f64) -> f64) -> OrderRow {
        let errors = (0..7).map(|k| (0.5f64.powi(k), error(0.5f64.powi(k)))).collect();
        OrderRow { what: String::new(), order: 2.0, errors, floor: 0.0, n_halvings: 5 }
    }

    #[test]
    fn powers_have_their_exponent_as_slope() {
        assert!((fit(&row(|h| 3.0 * h.powi(2)).errors) - 2.0).abs() < 1e-12);
        assert!(row(|h| 3.0 * h.powi(2)).holds());
    }

    #[test]
    fn lost_orders_plateaus_and_short_series_fail() {
        assert!(!row(|h| h).holds());
        assert!(!row(|h| h.powi(2) + 1e-2).holds());
        assert!(!row(|_| 0.0).holds());
        assert!(!row(|h| f64::NAN * h).holds());
        assert!(!OrderRow { floor: 0.1, ..row(|h| h.powi(2)) }.holds());
        let floor = |e: f64| OrderRow { floor: 1e-6, n_halvings: 0, ..row(|_| e) };
        assert!(floor(1e-7).holds() && !floor(1e-5).holds() && !floor(f64::NAN).holds());
    }
}
