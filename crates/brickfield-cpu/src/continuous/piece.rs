//! The integral over one smooth piece: value, extinction and colour are cubics of the parameter.

use brickfield_core::{Knot, LinearRgb, TransferFunction};
use brickfield_optics::{alpha, transmittance};

use super::ContinuousOptions;
use super::cubic::Cubic;

/// The light of a piece, as seen from its near end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) depth: f64,
    pub(super) emission: LinearRgb,
    /// Estimate of the emission's quadrature error.
    pub(super) error: f64,
}

/// Cuts a cubic at the transfer function's knots and integrates the pieces.
pub(super) struct Pieces<'a> {
    transfer: &'a TransferFunction,
    options: &'a ContinuousOptions,
    cuts: Vec<f64>,
}

/// A ray's tolerance is shared among this many pieces.
const N_SHARES: f64 = 1024.0;

impl<'a> Pieces<'a> {
    pub(super) fn new(transfer: &'a TransferFunction, options: &'a ContinuousOptions) -> Self {
        Pieces { transfer, options, cuts: Vec::new() }
    }

    pub(super) fn transmittance_floor(&self) -> f64 {
        self.options.transmittance_floor
    }

    /// Hands the smooth pieces of `values`, a way of `length` world units at depth `depth`, to `take`, front to back.
    pub(super) fn integrate(&mut self, values: &Cubic, length: f64, depth: f64, mut take: impl FnMut(Piece)) {
        let (low, high) = values.hull();
        let knots = self.transfer.knots();
        let below = knots.partition_point(|k| k.value <= low);
        let inside = knots[below..].partition_point(|k| k.value < high);
        if is_dark(knots, below, inside) {
            return;
        }
        if inside == 0 {
            return take(self.smooth(values, length, depth));
        }
        self.cuts.clear();
        self.cuts.push(0.0);
        for knot in &knots[below..below + inside] {
            values.crossings(knot.value, &mut self.cuts);
        }
        self.cuts.push(1.0);
        self.cuts.sort_by(f64::total_cmp);
        for cut in self.cuts.windows(2).filter(|c| c[0] < c[1]) {
            let part = values.restricted(cut[0], cut[1]);
            take(self.smooth(&part, length * (cut[1] - cut[0]), depth));
        }
    }

    /// A piece within one linear stretch of the transfer function.
    fn smooth(&self, values: &Cubic, length: f64, depth: f64) -> Piece {
        let (low, high) = stretch(self.transfer.knots(), values.at(0.5));
        // Place between the knots, 0 to 1; 0 where the function is constant.
        let width = high.value - low.value;
        let place = values.0.map(|v| if width > 0.0 { (v - low.value) / width } else { 0.0 });
        let extinction = Cubic(place.map(|p| low.extinction * (1.0 - p) + high.extinction * p));
        let medium = Medium::new(extinction, length);
        let a = alpha(medium.depth[4]);
        let color = |c: usize| low.color[c] * (1.0 - place[0]) + high.color[c] * place[0];
        let change = [0, 1, 2].map(|c| high.color[c] - low.color[c]);
        if change == [0.0; 3] || place == [place[0]; 4] {
            return Piece { depth: medium.depth[4], emission: [0, 1, 2].map(|c| color(c) * a), error: 0.0 };
        }
        let shift = Cubic(place.map(|p| p - place[0]));
        let tolerance = self.options.tolerance / N_SHARES / transmittance(depth).max(f64::MIN_POSITIVE);
        let weighted = match medium.depth[4] {
            thin if thin <= THIN => medium.thin(&shift),
            _ => medium.weighted(&shift, 0.0, 1.0, tolerance, 0),
        };
        let emission = [0, 1, 2].map(|c| color(c) * a + change[c] * weighted.value);
        Piece { depth: medium.depth[4], emission, error: weighted.error }
    }
}

/// Whether nothing is visible from knot `below - 1` to the knot behind the `inside` that follow.
fn is_dark(knots: &[Knot], below: usize, inside: usize) -> bool {
    let first = below.saturating_sub(1);
    let last = (below + inside).min(knots.len() - 1);
    knots[first..=last].iter().all(|k| k.extinction == 0.0)
}

/// The knots around a value; twice the same where the function is constant.
fn stretch(knots: &[Knot], value: f64) -> (&Knot, &Knot) {
    let above = knots.partition_point(|k| k.value <= value);
    let (low, high) = (above.saturating_sub(1), above.min(knots.len() - 1));
    (&knots[low], &knots[high])
}

/// An integral and its error estimate.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    value: f64,
    error: f64,
}

/// The extinction of a piece times its length, and the depth from its near end, in Bernstein form.
struct Medium {
    extinction: Cubic,
    depth: [f64; 5],
}

/// Depth beyond which an interval is halved before it is looked at: its nodes could miss a thin bright front.
const MAX_DEPTH: f64 = 2.0;
/// Depth up to which a piece is integrated by eight Gauss nodes.
const THIN: f64 = 0.03;
/// Depth at which nothing is left to see.
const OPAQUE: f64 = 40.0;
const MAX_HALVINGS: u32 = 60;

impl Medium {
    fn new(extinction: Cubic, length: f64) -> Medium {
        let scaled = Cubic(extinction.0.map(|e| e * length));
        let mut depth = [0.0; 5];
        for i in 0..4 {
            depth[i + 1] = depth[i] + 0.25 * scaled.0[i];
        }
        Medium { extinction: scaled, depth }
    }

    /// Optical depth from the near end to `u`: the exact quartic.
    fn depth_at(&self, u: f64) -> f64 {
        let v = 1.0 - u;
        let [a, b, c, d, e] = self.depth;
        let (u2, v2) = (u * u, v * v);
        a * v2 * v2 + 4.0 * b * v2 * v * u + 6.0 * c * v2 * u2 + 4.0 * d * v * u2 * u + e * u2 * u2
    }

    /// Integral of `weight` extinction e^-depth over a thin piece, by eight Gauss nodes: exact up to degree 15.
    ///
    /// weight, extinction and depth are of degree 3, 3 and 4, so that only the terms of e^-depth beyond depth^2 / 2 can be wrong.
    /// The leading term of depth^3 / 6 is of degree 18, where eight nodes are wrong by 5e-8; a cubic with coefficients up to b
    /// leads with at most 8 b, the depth with 2 b.
    fn thin(&self, weight: &Cubic) -> Estimate {
        let f = |u: f64| weight.at(u) * self.extinction.at(u) * transmittance_of_thin(self.depth_at(u));
        let pair = |(x, w): (&f64, f64)| w * (f(0.5 - 0.5 * x) + f(0.5 + 0.5 * x));
        let value = 0.5 * GAUSS_8_NODES.iter().zip(GAUSS_8).map(pair).sum::<f64>();
        let most = |c: &Cubic| c.0.iter().fold(0.0f64, |m, b| m.max(b.abs()));
        Estimate { value, error: 4e-6 * most(weight) * most(&self.extinction).powi(4) }
    }

    /// Integral of `weight` extinction e^-depth over [u0, u1], by Gauss-Kronrod (7, 15) and bisection.
    fn weighted(&self, weight: &Cubic, u0: f64, u1: f64, tolerance: f64, halvings: u32) -> Estimate {
        let (d0, d1) = (self.depth_at(u0), self.depth_at(u1));
        if d0 > OPAQUE {
            return Estimate::default();
        }
        if d1 - d0 <= MAX_DEPTH || halvings == MAX_HALVINGS {
            let estimate = self.kronrod(weight, u0, u1);
            if estimate.error <= tolerance || halvings == MAX_HALVINGS {
                return estimate;
            }
        }
        let mid = 0.5 * (u0 + u1);
        let near = self.weighted(weight, u0, mid, tolerance, halvings + 1);
        let far = self.weighted(weight, mid, u1, tolerance, halvings + 1);
        Estimate { value: near.value + far.value, error: near.error + far.error }
    }

    fn kronrod(&self, weight: &Cubic, u0: f64, u1: f64) -> Estimate {
        let (center, half) = (0.5 * (u0 + u1), 0.5 * (u1 - u0));
        let f = |u: f64| weight.at(u) * self.extinction.at(u) * transmittance(self.depth_at(u));
        let middle = f(center);
        let (mut gauss, mut kronrod) = (GAUSS[3] * middle, KRONROD[7] * middle);
        for (i, x) in NODES.iter().enumerate() {
            let pair = f(center - half * x) + f(center + half * x);
            kronrod += KRONROD[i] * pair;
            if i % 2 == 1 {
                gauss += GAUSS[i / 2] * pair;
            }
        }
        // Below rounding of the sum the difference says nothing.
        let error = ((gauss - kronrod).abs() * half - 1e-15 * (kronrod * half).abs()).max(0.0);
        Estimate { value: kronrod * half, error }
    }
}

/// e^-x for x up to [`THIN`], by Taylor's polynomial; the first term left out is x^7 / 5040 < 5e-15.
fn transmittance_of_thin(x: f64) -> f64 {
    1.0 - x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0))))))
}

/// Positive nodes and weights of eight-point Gauss-Legendre quadrature (Abramowitz and Stegun 1964, table 25.4).
const GAUSS_8_NODES: [f64; 4] =
    [0.183_434_642_495_649_8, 0.525_532_409_916_329, 0.796_666_477_413_626_7, 0.960_289_856_497_536_3];

const GAUSS_8: [f64; 4] =
    [0.362_683_783_378_362, 0.313_706_645_877_887_3, 0.222_381_034_453_374_48, 0.101_228_536_290_376_26];

/// Kronrod nodes on [0, 1) (Piessens et al. 1983, QUADPACK qk15); every second one is a Gauss node.
const NODES: [f64; 7] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_5,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_48,
];

const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_56,
    0.104_790_010_322_250_19,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_42,
    0.204_432_940_075_298_89,
    0.209_482_141_084_727_82,
];

const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thin_piece_is_what_error_control_makes_of_it() {
        let medium = Medium::new(Cubic([0.0, 0.05, 0.001, 0.06]), 1.0);
        assert!(medium.depth[4] < THIN && medium.depth[4] > 0.9 * THIN);
        for weight in [Cubic([0.0, 0.5, -0.7, 1.0]), Cubic([0.0, -1.0, 1.0, -1.0])] {
            let (thin, controlled) = (medium.thin(&weight), medium.weighted(&weight, 0.0, 1.0, 1e-15, 0));
            assert!((thin.value - controlled.value).abs() <= 1e-17 + thin.error, "{thin:?} {controlled:?}");
            assert!(thin.error < 1e-10);
        }
    }
}
