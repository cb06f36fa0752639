//! Cubics on [0, 1] in Bernstein form: stable, and their coefficients enclose their values.

/// Coefficients b0..b3 of sum b_i binomial(3, i) u^i (1 - u)^(3 - i).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cubic(pub(super) [f64; 4]);

/// Halvings before a root that will not separate from another is taken as it is: 2^-48 of the interval.
const MAX_DEPTH: u32 = 48;

impl Cubic {
    pub(super) fn at(&self, u: f64) -> f64 {
        let [a, b, c, d] = self.0;
        let v = 1.0 - u;
        let mix = |a: f64, b: f64| a * v + b * u;
        let (ab, bc, cd) = (mix(a, b), mix(b, c), mix(c, d));
        mix(mix(ab, bc), mix(bc, cd))
    }

    /// A lower and an upper bound of its values.
    pub(super) fn hull(&self) -> (f64, f64) {
        let [a, b, c, d] = self.0;
        (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)))
    }

    /// The same cubic on [u0, u1], as a cubic on [0, 1]: its blossom (de Casteljau).
    pub(super) fn restricted(&self, u0: f64, u1: f64) -> Cubic {
        let blossom = |x: f64, y: f64, z: f64| {
            let mix = |a: f64, b: f64, u: f64| a * (1.0 - u) + b * u;
            let [a, b, c, d] = self.0;
            let (ab, bc, cd) = (mix(a, b, x), mix(b, c, x), mix(c, d, x));
            mix(mix(ab, bc, y), mix(bc, cd, y), z)
        };
        Cubic([blossom(u0, u0, u0), blossom(u0, u0, u1), blossom(u0, u1, u1), blossom(u1, u1, u1)])
    }

    /// Appends the places in (0, 1) where the cubic passes through `value`, ascending.
    ///
    /// The sign changes of the coefficients bound the number of roots: none is left out, none is looked for in vain. An
    /// interval with one change holds one root, which is bracketed and closed in on to rounding.
    pub(super) fn crossings(&self, value: f64, to: &mut Vec<f64>) {
        Cubic(self.0.map(|b| b - value)).roots(0.0, 1.0, 0, to);
    }

    fn roots(&self, low: f64, high: f64, depth: u32, to: &mut Vec<f64>) {
        let mid = 0.5 * (low + high);
        match self.n_sign_changes() {
            0 => {}
            1 if self.0[0] * self.0[3] < 0.0 => to.push(low + (high - low) * self.bracketed_root()),
            _ if depth == MAX_DEPTH => to.push(mid),
            _ => {
                let (left, right) = (self.restricted(0.0, 0.5), self.restricted(0.5, 1.0));
                left.roots(low, mid, depth + 1, to);
                if left.0[3] == 0.0 {
                    to.push(mid);
                }
                right.roots(mid, high, depth + 1, to);
            }
        }
    }

    fn n_sign_changes(&self) -> usize {
        let mut changes = 0;
        let mut last = 0.0f64;
        for b in self.0.into_iter().filter(|b| *b != 0.0) {
            changes += usize::from(last * b.signum() < 0.0);
            last = b.signum();
        }
        changes
    }

    /// The root of a cubic whose ends differ in sign: Newton's steps, halving where they leave the bracket.
    fn bracketed_root(&self) -> f64 {
        let rising = self.0[0] < 0.0;
        let (mut low, mut high) = (0.0, 1.0);
        let mut u = self.0[0] / (self.0[0] - self.0[3]);
        for _ in 0..64 {
            let value = self.at(u);
            if value == 0.0 {
                return u;
            }
            if (value < 0.0) == rising {
                low = u
            } else {
                high = u
            }
            let step = value / self.slope(u);
            let next = u - step;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - u).abs() <= 1e-16 {
                return next;
            }
            u = next;
        }
        u
    }

    fn slope(&self, u: f64) -> f64 {
        let [a, b, c, d] = self.0;
        let v = 1.0 - u;
        3.0 * ((b - a) * v * v + 2.0 * (c - b) * u * v + (d - c) * u * u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The cubic with three given roots, from its blossom.
    fn with_roots(r: [f64; 3]) -> Cubic {
        let blossom = |u: [f64; 3]| {
            let product = |p: [usize; 3]| (0..3).map(|i| u[p[i]] - r[i]).product::<f64>();
            [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].map(product).iter().sum::<f64>() / 6.0
        };
        Cubic([blossom([0.0; 3]), blossom([0.0, 0.0, 1.0]), blossom([0.0, 1.0, 1.0]), blossom([1.0; 3])])
    }

    proptest! {
        #[test]
        fn every_root_is_found_once(mut r in [0.01f64..0.99, 0.01f64..0.99, -1.0f64..2.0], value in -5.0f64..5.0) {
            r.sort_by(f64::total_cmp);
            prop_assume!(r.windows(2).all(|w| w[1] - w[0] > 1e-3) && r.iter().all(|x| (0.005..0.995).contains(x) || !(-0.005..1.005).contains(x)));
            let shifted = Cubic(with_roots(r).0.map(|b| b + value));
            let mut found = vec![];
            shifted.crossings(value, &mut found);
            let expected: Vec<_> = r.into_iter().filter(|x| (0.0..1.0).contains(x)).collect();
            prop_assert_eq!(found.len(), expected.len());
            for (a, b) in found.iter().zip(expected) {
                prop_assert!((a - b).abs() < 1e-9, "{} {}", a, b);
            }
        }

        #[test]
        fn restriction_keeps_values(b in [-1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0], u0 in 0.0f64..1.0, u1 in 0.0f64..1.0, x in 0.0f64..1.0) {
            let cubic = Cubic(b);
            prop_assert!((cubic.restricted(u0, u1).at(x) - cubic.at(u0 + (u1 - u0) * x)).abs() < 1e-14);
        }
    }

    #[test]
    fn double_roots_and_flat_cubics_do_no_harm() {
        let mut found = vec![];
        with_roots([0.3, 0.3, 2.0]).crossings(0.0, &mut found);
        assert!(found.iter().all(|u| (u - 0.3).abs() < 1e-6), "{found:?}");
        found.clear();
        Cubic([1.0; 4]).crossings(1.0, &mut found);
        assert!(found.is_empty());
    }
}
