//! A transfer function chosen from a volume's histogram.

use brickfield_core::{Grid, Knot, LinearRgb, TransferFunction, Volume};

use crate::histogram::{Classes, VolumeHistogram, otsu_cuts, triangle_foot};

/// A transfer function in which the thing in the volume is likely to be recognised, found from its histogram alone.
///
/// 1. *Padding*, a lone value at either end of the range, is left out.
/// 2. *Background* is the fullest bin of the lower of two classes (Otsu 1979). Its noise ends at the foot of the slope above
///    it (triangle method; Zack, Rogers and Latt 1977) and half as far again.
/// 3. *Materials* are up to three classes of brighter values (Otsu again). Extinction is exactly 0 up to `EDGE` of
///    the way from the background to the first material's median and never ends within the noise, then rises from
///    median to median; constant beyond the last.
/// 4. *Extinction* gives each material an optical depth over the mean length of a ray in it (its volume over the
///    volume's mean cross section), but two voxels of it are not more than opaque: the first is a veil in a cool colour, the second warm, the
///    brightest nearly opaque and almost white.
///
/// Deterministic; at most four passes over the voxels. A constant volume is a translucent grey block. Not for volumes
/// whose background is their brightest value: such volumes need a transfer-function file.
pub fn automatic(volume: &Volume) -> TransferFunction {
    let histogram = VolumeHistogram::without_padding(volume);
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
