//! A transfer function chosen from a volume's histogram.

use brickfield_core::{Grid, Knot, LinearRgb, TransferFunction, Volume};

use crate::histogram::{Classes, VolumeHistogram, otsu_cuts, triangle_foot};

/// A transfer function in which the thing in the volume is likely to be recognised, found from its histogram alone.
///
/// 1. *Padding*, a lone value at either end of the range, is left out. So are *stray values*, the brightest thousandth of all
///    voxels, where they take up more than half of the range and the others still part in two: burnt-in letters, a hot pixel.
/// 2. *Background* is the fullest bin of the lower of two classes (Otsu 1979). Its noise ends at the foot of the slope above
///    it (triangle method; Zack, Rogers and Latt 1977) and half as far again.
/// 3. *Materials* are up to three classes of brighter values (Otsu again). Extinction is exactly 0 up to `EDGE` of
///    the way from the background to the first material's median and never ends within the noise, then rises from
///    median to median; constant beyond the last.
/// 4. *Extinction* gives each material an optical depth over the mean length of a ray in it (its volume over the
///    volume's mean cross section), but two voxels of it are not more than opaque: the first is a veil in a cool colour, the second warm, the
///    brightest nearly opaque and almost white.
///
/// Deterministic; at most seven passes over the voxels. A constant volume is a translucent grey block. Not for volumes
/// whose background is their brightest value: such volumes need a transfer-function file.
pub fn automatic(volume: &Volume) -> TransferFunction {
    let histogram = VolumeHistogram::without_padding(volume).without_stray_values(volume);
    let knots = if histogram.is_constant() {
        vec![Knot {
            value: volume.range().min,
            extinction: extinction(1.0 / diagonal_world(volume.grid())),
            color: GRAY,
        }]
    } else {
        let background = background(&histogram);
        knots(&background, &materials(&histogram, &background, volume))
    };
    TransferFunction::new(knots).unwrap_or_else(|e| unreachable!("knots of a histogram are in order: {e}"))
}

/// Length of a volume's diagonal in world units: the length over which relative presets measure their depth.
pub fn diagonal_world(grid: &Grid) -> f64 {
    (grid.dims().as_dvec3() * grid.spacing()).length()
}

const GRAY: LinearRgb = [0.5; 3];
/// Where a material begins between the background's value and its own: half-way is the edge of a blurred step.
const EDGE: f64 = 0.4;
/// Optical depth of a ray of mean length in the first, second and third material.
const DEPTHS: [f64; 3] = [0.4, 1.0, 4.0];
/// Optical depth of one voxel at the most.
const MAX_VOXEL_DEPTH: f64 = 1.0;
/// Colours of the materials, linear: steel blue, amber, ivory.
const COLORS: [LinearRgb; 3] = [[0.10, 0.25, 0.55], [0.70, 0.18, 0.03], [1.0, 0.93, 0.80]];

/// The background: its value, the greatest value of its noise, and the first bin above that.
struct BackgroundPeak {
    value: f64,
    noise_end: f64,
    end_bin: usize,
}

/// A class of values: its median, and the extinction and colour there.
struct Material {
    median: f64,
    extinction: f64,
    color: LinearRgb,
}

fn background(h: &VolumeHistogram) -> BackgroundPeak {
    let n = h.n_bins();
    let cut = otsu_cuts(h, 0, n, Classes::Two).first().copied().unwrap_or(1);
    let peak = h.mode(0, cut);
    let foot = triangle_foot(h, peak, n);
    let noise_bins = (foot - peak) + (foot - peak) / 2 + n / 100;
    let end_bin = (peak + noise_bins + 1).min(n - 1).min(cut.max(foot + 1));
    BackgroundPeak { value: h.value(peak), noise_end: h.value(end_bin - 1), end_bin }
}

fn materials(h: &VolumeHistogram, background: &BackgroundPeak, volume: &Volume) -> Vec<Material> {
    let n = h.n_bins();
    let mut ends = vec![background.end_bin];
    ends.extend(otsu_cuts(h, background.end_bin, n, Classes::Three));
    ends.push(n);
    let classes: Vec<(usize, usize)> =
        ends.windows(2).map(|w| (w[0], w[1])).filter(|c| h.total(c.0, c.1) > 0).collect();
    let first = DEPTHS.len() - classes.len().min(DEPTHS.len());
    let material = |(k, (from, to)): (usize, (usize, usize))| Material {
        median: h.value(h.quantile(from, to, 0.5)),
        extinction: material_extinction(volume, h.total(from, to), DEPTHS[first + k]),
        color: COLORS[first + k],
    };
    let mut found: Vec<Material> = classes.into_iter().enumerate().map(material).collect();
    found.dedup_by(|next, previous| next.median <= previous.median);
    for k in 1..found.len() {
        found[k].extinction = extinction(found[k].extinction.max(2.0 * found[k - 1].extinction));
    }
    found
}

/// The extinction that gives a ray of mean length in the material an optical depth.
fn material_extinction(volume: &Volume, n_voxels: u64, depth: f64) -> f64 {
    let grid = volume.grid();
    let voxel = grid.spacing().element_product();
    let extent = grid.dims().as_dvec3() * grid.spacing();
    let cross_section = 0.5 * extent.element_product().powf(2.0 / 3.0);
    let mean_length = n_voxels as f64 * voxel / cross_section;
    let limit = MAX_VOXEL_DEPTH / voxel.cbrt();
    extinction((depth / mean_length).min(limit))
}

fn extinction(wanted: f64) -> f64 {
    wanted.clamp(0.0, TransferFunction::MAX_EXTINCTION)
}

fn knots(background: &BackgroundPeak, materials: &[Material]) -> Vec<Knot> {
    let Some(first) = materials.first() else { return vec![] };
    let edge = (1.0 - EDGE) * background.value + EDGE * first.median;
    let foot = edge.max(background.noise_end).min(first.median);
    let mut knots = vec![Knot { value: foot, extinction: 0.0, color: first.color.map(|c| 0.2 * c) }];
    knots.extend(materials.iter().map(|m| Knot { value: m.median, extinction: m.extinction, color: m.color }));
    knots
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::{DVec3, UVec3};
    use brickfield_core::{Scalar, ValueRange};
    use proptest::prelude::*;

    fn cube<T: Scalar>(side: u32, spacing: f64, value: impl Fn(UVec3) -> T) -> Volume {
        let grid = Grid::axis_aligned(UVec3::splat(side), DVec3::splat(spacing)).unwrap();
        let at = |i: u32| value(UVec3::new(i % side, i / side % side, i / side / side));
        Volume::new(grid, T::wrap((0..side.pow(3)).map(at).collect())).unwrap()
    }

    /// Noise around `background`, and three nested balls that are brighter and brighter.
    fn balls(spacing: f64, background: i16) -> Volume {
        cube(32, spacing, |p| {
            let r = (p.as_dvec3() - DVec3::splat(15.5)).length();
            let noise = ((p.x * 7919 + p.y * 104_729 + p.z * 1_299_709) % 11) as i16;
            let step = [(4.0, 900), (8.0, 500), (12.0, 250)].into_iter().find(|(radius, _)| r < *radius);
            background + noise + step.map_or(0, |(_, v)| v)
        })
    }

    #[test]
    fn background_and_its_noise_are_exactly_transparent() {
        for background in [0, -1000, 400] {
            let tf = automatic(&balls(1.0, background));
            let low = f64::from(background);
            assert!(tf.is_transparent(ValueRange { min: f64::MIN, max: low + 30.0 }), "{tf:?}");
            assert!(tf.at(low + 255.0).extinction > 0.0, "{tf:?}");
        }
    }

    #[test]
    fn brighter_is_denser_and_materials_differ_in_colour() {
        let tf = automatic(&balls(1.0, 0));
        let [dim, mid, bright] = [255.0, 505.0, 905.0].map(|v| tf.at(v));
        assert!(dim.extinction < 0.6 * mid.extinction && mid.extinction < 0.6 * bright.extinction);
        assert!(dim.color[2] > dim.color[0] && mid.color[0] > mid.color[2] && bright.color[1] > 0.8);
    }

    #[test]
    fn padding_below_the_background_changes_nothing() {
        let padded = cube(32, 1.0, |p| if p.x < 6 { -1500i16 } else { (p.y * 12) as i16 });
        let bare = automatic(&cube(32, 1.0, |p| (p.y * 12) as i16));
        let values = |tf: &TransferFunction| tf.knots().iter().map(|k| k.value).collect::<Vec<_>>();
        assert_eq!(values(&automatic(&padded)), values(&bare));
    }

    /// A number from -1 to 1 that depends on the place, of about a Gaussian's distribution with a standard deviation of 0.29.
    fn noise(p: UVec3) -> f64 {
        let uniform = |seed: u32| {
            let h =
                p.x.wrapping_mul(0x9e37_79b1) ^ p.y.wrapping_mul(0x85eb_ca77) ^ p.z.wrapping_mul(0xc2b2_ae3d) ^ seed;
            let h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
            f64::from(h ^ h >> 12) / f64::from(u32::MAX)
        };
        (0..4).map(|k| uniform(k * 0x27d4_eb2f)).sum::<f64>() / 2.0 - 1.0
    }

    /// 0 in the middle of a head in a cube of 64, 1 at its surface.
    fn radius(p: UVec3) -> f64 {
        ((p.as_dvec3() - DVec3::splat(31.5)) / DVec3::new(24.0, 28.0, 24.0)).length()
    }

    /// Of the object's voxels the visible share; of the other ones; and of the rays through at least ten of the object's voxels
    /// the share that has an opacity of 0.3 from the object alone.
    fn shown(volume: &Volume, is_object: impl Fn(UVec3) -> bool) -> [f64; 3] {
        let (transfer, side) = (automatic(volume), volume.grid().dims().x);
        let (mut counts, mut visible, mut rays, mut opaque) = ([0.0; 2], [0.0; 2], 0.0, 0.0);
        for (x, y) in (0..side * side).map(|i| (i % side, i / side)) {
            let (mut depth, mut n) = (0.0, 0);
            for p in (0..side).map(|z| UVec3::new(x, y, z)) {
                let optics = transfer.at(volume.value((p.x + side * (p.y + side * p.z)) as usize));
                let other = usize::from(!is_object(p));
                counts[other] += 1.0;
                visible[other] += f64::from(u8::from(optics.extinction > 0.0));
                if other == 0 {
                    (depth, n) = (depth + optics.extinction, n + 1);
                }
            }
            if n >= 10 {
                rays += 1.0;
                opaque += f64::from(u8::from(crate::alpha(depth) > 0.3));
            }
        }
        [visible[0] / counts[0], visible[1] / counts[1], opaque / rays]
    }

    #[test]
    fn burnt_in_letters_do_not_hide_the_head() {
        let is_letter = |p: UVec3| p.x < 6 && p.y < 9 && (30..33).contains(&p.z) && (p.x + p.y).is_multiple_of(2);
        let is_head = |p: UVec3| radius(p) < 1.0;
        for (letters, spread) in [(255.0, 0.0), (1000.0, 0.0), (1000.0, 400.0), (8000.0, 3000.0)] {
            let volume = cube(64, 1.0, |p| {
                let tissue = [(0.5, 150.0), (0.8, 110.0), (1.0, 60.0)].into_iter().find(|(r, _)| radius(p) < *r);
                let value = match tissue {
                    _ if is_letter(p) => letters + spread * noise(p),
                    Some((_, value)) => value + 12.0 * noise(p),
                    None => 5.0 * noise(p).abs(),
                };
                value as i16
            });
            let [object, others, rays] = shown(&volume, is_head);
            assert!(object > 0.98 && others < 1e-3 && rays > 0.9, "{letters}: {object} {others} {rays}");
        }
    }

    #[test]
    fn low_contrast_near_zero_is_seen() {
        let is_object = |p: UVec3| radius(p) < 0.7;
        let is_marker = |p: UVec3| p.x < 2 && p.y < 8 && p.z == 4;
        // The object stands 5 to 17 standard deviations above the noise, and a marker of 16 voxels far above both.
        for (contrast, deviation) in [(6.0, 0.6), (10.0, 0.6), (10.0, 1.2), (12.0, 2.3)] {
            for marker in [0.0, 90.0] {
                let volume = cube(64, 1.0, |p| match is_marker(p) {
                    true => (255.0 - marker * noise(p).abs()) as u8,
                    false => {
                        (deviation / 0.29 * noise(p).abs() + if is_object(p) { contrast } else { 0.0 }).round() as u8
                    }
                });
                let [object, others, rays] = shown(&volume, is_object);
                assert!(object > 0.95 && others < 0.01 && rays > 0.9, "{contrast} {marker}: {object} {others} {rays}");
            }
        }
    }

    #[test]
    fn extinction_is_per_world_unit() {
        let (fine, coarse) = (automatic(&balls(0.5, 0)), automatic(&balls(2.0, 0)));
        for (a, b) in fine.knots().iter().zip(coarse.knots()) {
            assert!((a.extinction - 4.0 * b.extinction).abs() <= 1e-12 * a.extinction);
        }
    }

    #[test]
    fn labels_and_constants_have_a_picture() {
        let label = automatic(&cube(8, 1.0, |p| u8::from(p.x > 3)));
        assert!(label.at(0.0).extinction == 0.0 && label.at(1.0).extinction > 0.0);
        assert!(automatic(&cube(4, 1.0, |_| 7.0f32)).at(7.0).extinction > 0.0);
    }

    proptest! {
        #[test]
        fn any_volume_has_a_transfer_function(
            values in prop::collection::vec(
                prop_oneof![any::<f32>(), Just(0.0f32), -1f32..1.0, Just(f32::MAX), Just(f32::MIN)], 27),
            spacing in prop_oneof![Just(1e-300), Just(1.0), Just(1e300)],
        ) {
            let grid = Grid::axis_aligned(UVec3::splat(3), DVec3::splat(spacing)).unwrap();
            automatic(&Volume::new(grid, values).unwrap());
        }

        #[test]
        fn any_wide_volume_has_one_too(values in prop::collection::vec(any::<f64>(), 27)) {
            let grid = Grid::axis_aligned(UVec3::splat(3), DVec3::ONE).unwrap();
            automatic(&Volume::new(grid, values).unwrap());
        }
    }
}
