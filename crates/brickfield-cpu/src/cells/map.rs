//! The value at a position in a cell.

use brickfield_core::glam::{DMat3, DVec3, Vec3, Vec4, Vec4Swizzles};

use super::scene::Scene;

/// A cell's map from local coordinates to positions and values, as a polynomial: of 1, x, y, z, xy, xz, yz, xyz.
pub(super) struct Map {
    terms: [Vec4; 8],
}

/// Steps of Newton's method before it is left to f64.
const MAX_STEPS: usize = 6;
/// A step after which the error is far below f32's digits of a value.
const LAST_STEP: f32 = 1.0 / 256.0;

impl Map {
    #[inline(always)]
    pub(super) fn of(scene: &Scene, node: usize) -> Map {
        let p = scene.corners.map(|corner| scene.nodes[node + corner]);
        let (x, y, z) = (p[1] - p[0], p[2] - p[0], p[4] - p[0]);
        let (xy, xz, yz) = ((p[3] - p[1]) - y, (p[5] - p[1]) - z, (p[6] - p[2]) - z);
        let xyz = (((p[7] - p[6]) - (p[5] - p[4])) - (p[3] - p[2])) + x;
        Map { terms: [p[0], x, y, z, xy, xz, yz, xyz] }
    }

    /// The value at a position, by Newton's method from a place near it.
    #[inline(always)]
    pub(super) fn value(&self, position: Vec4, guess: Vec3) -> f32 {
        let [one, x, y, z, xy, xz, yz, xyz] = self.terms;
        let mut local = guess;
        // Relative to the first corner.
        let target = position - one;
        for _ in 0..MAX_STEPS {
            let (u, v, w) = (local.x, local.y, local.z);
            let (a, b) = (xy + xyz * w, xz * w + x);
            let du = a * v + b;
            let (c, d) = (y + yz * w, z * w);
            let dv = a * u + c;
            let dw = (xz + xyz * v) * u + yz * v + z;
            let at = du * u + c * v + d;
            let step = solve([du.xyz(), dv.xyz(), dw.xyz()], (target - at).xyz());
            local += step;
            if step.abs().max_element() < LAST_STEP {
                let inside = local.clamp(Vec3::ZERO, Vec3::ONE);
                if inside != local {
                    return self.value_at(inside);
                }
                return one.w + at.w + (du.w * step.x + dv.w * step.y + dw.w * step.z);
            }
        }
        self.value_by_f64(position)
    }

    #[inline(always)]
    fn value_at(&self, local: Vec3) -> f32 {
        let [one, x, y, z, xy, xz, yz, xyz] = self.terms.map(|term| term.w);
        let Vec3 { x: u, y: v, z: w } = local;
        one + (x + (xy + xyz * w) * v + xz * w) * u + (y + yz * w) * v + z * w
    }

    /// Newton's method with steps that are halved until they come nearer, from the cell's middle.
    #[cold]
    #[inline(never)]
    fn value_by_f64(&self, position: Vec4) -> f32 {
        let terms = self.terms.map(|term| term.xyz().as_dvec3());
        let position = position.xyz().as_dvec3();
        let miss = |l: DVec3| {
            let factors = [1.0, l.x, l.y, l.z, l.x * l.y, l.x * l.z, l.y * l.z, l.x * l.y * l.z];
            position - terms.iter().zip(factors).map(|(term, f)| *term * f).sum::<DVec3>()
        };
        let slopes = |l: DVec3| {
            let [_, x, y, z, xy, xz, yz, xyz] = terms;
            let along = [
                x + xy * l.y + xz * l.z + xyz * (l.y * l.z),
                y + xy * l.x + yz * l.z + xyz * (l.x * l.z),
                z + xz * l.x + yz * l.y + xyz * (l.x * l.y),
            ];
            DMat3::from_cols(along[0], along[1], along[2])
        };
        let mut local = DVec3::splat(0.5);
        let mut distance = miss(local).length_squared();
        for _ in 0..40 {
            let step = slopes(local).inverse() * miss(local);
            let halved = (0..6).map(|i| local + step * 0.5f64.powi(i));
            let nearer = halved.map(|l| (l, miss(l).length_squared())).find(|(_, d)| *d < distance);
            let Some(nearer) = nearer else { break };
            (local, distance) = nearer;
            if step.length_squared() < 1e-17 {
                break;
            }
        }
        self.value_at(local.clamp(DVec3::ZERO, DVec3::ONE).as_vec3())
    }
}

/// The solution of three equations by Cramer's rule; not finite where they are singular.
#[inline(always)]
fn solve([a, b, c]: [Vec3; 3], right: Vec3) -> Vec3 {
    let (bc, ca, ab) = (b.cross(c), c.cross(a), a.cross(b));
    Vec3::new(right.dot(bc), right.dot(ca), right.dot(ab)) / a.dot(bc)
}
