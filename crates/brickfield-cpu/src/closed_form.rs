//! Exact solutions of the emission-absorption integral, to hold renderers to.
//!
//! All return linear, premultiplied RGBA, or a depth. Accuracy: a few roundings of f64 unless stated. Lengths are in world
//! units, extinctions per world unit.

use brickfield_core::{LinearRgb, Optics};
use brickfield_optics::{RayState, Segment, alpha, transmittance};

/// Any medium of one colour: C = c A, A = 1 - e^-depth.
pub fn one_color(depth: f64, color: LinearRgb) -> [f64; 4] {
    let a = alpha(depth);
    [color[0] * a, color[1] * a, color[2] * a, a]
}

/// A homogeneous slab: depth = extinction * length.
pub fn slab(medium: Optics, length: f64) -> [f64; 4] {
    one_color(medium.extinction * length, medium.color)
}

/// Extinction that runs linearly from `near` to `far` along `length`, of one colour: depth = (near + far) length / 2.
pub fn linear_extinction(near: f64, far: f64, length: f64, color: LinearRgb) -> [f64; 4] {
    one_color(0.5 * (near + far) * length, color)
}

/// Extinction and colour that both run linearly along `length`, each by itself.
///
/// By parts, C = c(0) - c(L) e^-D(L) + (c(L) - c(0)) J / L with J = integral of e^-D: an error function where the extinction
/// rises, Dawson's integral where it falls (compare Williams, Max and Stein 1998), in scaled functions that neither overflow nor
/// cancel. Accuracy: about 1e-14 + 1e-16 / depth.
pub fn linear_extinction_and_color(near: Optics, far: Optics, length: f64) -> [f64; 4] {
    let depth = 0.5 * (near.extinction + far.extinction) * length;
    let t = transmittance(depth);
    let mean_transmittance = mean_transmittance(near.extinction * length, far.extinction * length);
    let channel = |c: usize| {
        let (a, b) = (near.color[c], far.color[c]);
        a * alpha(depth) + (b - a) * (mean_transmittance - t)
    };
    [channel(0), channel(1), channel(2), alpha(depth)]
}

/// Layers of constant medium and given length, front to back.
pub fn layers(layers: &[(Optics, f64)]) -> [f64; 4] {
    let mut ray = RayState::default();
    for (medium, length) in layers {
        let [r, g, b, _] = slab(*medium, *length);
        ray.push(Segment { depth: medium.extinction * length, emission: [r, g, b] });
    }
    ray.rgba()
}

/// Premultiplied `front` over `back`: a ray that is split at any point must give this for the whole.
pub fn over(front: [f64; 4], back: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|c| front[c] + (1.0 - front[3]) * back[c])
}

/// Depth of a Gaussian ball, extinction `peak` e^(-r^2 / sigma^2), along a chord at distance `impact` from its centre that
/// reaches `half_length` to both sides: peak sigma sqrt(pi) e^(-impact^2 / sigma^2) erf(half_length / sigma).
pub fn gaussian_ball_depth(peak: f64, sigma: f64, impact: f64, half_length: f64) -> f64 {
    let x = impact / sigma;
    peak * sigma * std::f64::consts::PI.sqrt() * (-x * x).exp() * libm::erf(half_length / sigma)
}

/// Depth of an atmosphere, extinction `ground` e^(-z / scale), along `length` straight up from the ground.
pub fn atmosphere_depth(ground: f64, scale: f64, length: f64) -> f64 {
    ground * scale * alpha(length / scale)
}

/// Integral over u in [0, 1] of e^-D(u), where D' runs linearly from `a` to `b`.
fn mean_transmittance(a: f64, b: f64) -> f64 {
    let slope = b - a;
    let depth = 0.5 * (a + b);
    // Where the extinction hardly changes, a series in the slope: D = depth u - slope u (1 - u) / 2 + ...
    if slope.abs() <= 1e-2 * depth.min(1.0) || depth == 0.0 {
        return gently(depth, slope);
    }
    let root = (2.0 * slope.abs()).sqrt();
    let scale = 2.0 / root;
    if slope > 0.0 {
        0.5 * std::f64::consts::PI.sqrt() * scale * (erfcx(a / root) - transmittance(depth) * erfcx(b / root))
    } else {
        scale * (dawson(a / root) - transmittance(depth) * dawson(b / root))
    }
}

/// [`mean_transmittance`] by Gauss-Legendre panels: for slopes that are small beside the depth the closed form would cancel.
fn gently(depth: f64, slope: f64) -> f64 {
    const X: [f64; 4] =
        [0.183_434_642_495_649_8, 0.525_532_409_916_329, 0.796_666_477_413_626_7, 0.960_289_856_497_536_3];
    const W: [f64; 4] =
        [0.362_683_783_378_362, 0.313_706_645_877_887_3, 0.222_381_034_453_374_48, 0.101_228_536_290_376_26];
    let f = |u: f64| transmittance(depth * u - 0.5 * slope * u * (1.0 - u));
    let n = (depth.min(700.0)).ceil().max(1.0);
    let end = if depth > 700.0 { 700.0 / depth } else { 1.0 };
    let half = 0.5 * end / n;
    let panel = |k: u32| {
        let center = (2.0 * f64::from(k) + 1.0) * half;
        X.iter().zip(W).map(|(x, w)| w * (f(center - half * x) + f(center + half * x))).sum::<f64>()
    };
    (0..n as u32).map(panel).sum::<f64>() * half
}

/// e^(x^2) erfc(x), x >= 0; relative error about 1e-15.
fn erfcx(x: f64) -> f64 {
    if x < 5.0 {
        return (x * x).exp() * libm::erfc(x);
    }
    // Laplace's continued fraction, from its tail.
    let tail = (1..=60).rev().fold(0.0, |tail, k| 0.5 * f64::from(k) / (x + tail));
    1.0 / (std::f64::consts::PI.sqrt() * (x + tail))
}

/// Dawson's integral e^(-x^2) integral of e^(t^2) from 0 to x (Rybicki 1989), x >= 0; error about 1e-16.
fn dawson(x: f64) -> f64 {
    const H: f64 = 0.2;
    if x < 0.2 {
        let y = x * x;
        return x
            * (1.0
                - y * (2.0 / 3.0)
                    * (1.0
                        - y * 0.4
                            * (1.0
                                - y * (2.0 / 7.0)
                                    * (1.0 - y * (2.0 / 9.0) * (1.0 - y * (2.0 / 11.0) * (1.0 - y * (2.0 / 13.0)))))));
    }
    let nearest = 2.0 * (0.5 * x / H).round();
    let rest = x - nearest * H;
    let term = |n: i32| {
        let odd = f64::from(n);
        (-(rest - odd * H).powi(2)).exp() / (nearest + odd)
    };
    (0..24).map(|i| term(2 * i + 1) + term(-2 * i - 1)).sum::<f64>() / std::f64::consts::PI.sqrt()
}
