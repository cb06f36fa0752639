//! How far exact and fast mode are from the sum that they stand for, and how finely the device's filter weighs.

use std::collections::BTreeSet;

use brickfield::bricks::{BrickTree, BuildOptions, Downsampling, build_tree};
use brickfield::cpu::{Discrete, discrete};
use brickfield::frame::{Backend, Mode, ShaderFunction};
use brickfield::{Residency, Scene, Skipping, prepare};
use brickfield_core::glam::{DVec3, UVec2, UVec3};
use brickfield_core::{BrickSide, Grid, Knot, ScalarType, Volume};

use super::budget::{Deadline, Unmeasured};
use super::devices::Devices;
use super::report::{FilterBits, ModeError};
use super::{Form, PartResult};
use crate::conformance::Tolerance;
use crate::volumes::{Phantom, fill_unit, phantom_of, spread};

/// One for each format of a texture.
const SCALARS: [ScalarType; 3] = [ScalarType::U8, ScalarType::U16, ScalarType::F32];

/// The modes, and their names in reports.
pub(super) const MODES: [(&str, Mode); 3] =
    [("exact", Mode::Exact), ("fast without a floor", Mode::Fast { transmittance_floor: 0.0 }), ("fast", Mode::FAST)];

/// Measures the phantom in each format, mode and backend.
pub(super) fn errors(
    form: Form,
    devices: &mut Devices,
    deadline: Deadline,
    failures: &mut Vec<String>,
) -> PartResult<Vec<ModeError>> {
    let (voxels, pixels) = form.sizes().errors;
    let (mut found, mut left_out) = (Vec::new(), Vec::new());
    for scalar in SCALARS {
        if let Err(e) = deadline.admit(&format!("errors of {} voxels", scalar.name()), 0.0) {
            left_out.push(e);
            continue;
        }
        match subject(scalar, voxels, pixels) {
            Err(reason) => left_out.push(Unmeasured::new(scalar.name(), reason)),
            Ok(subject) => subject.measure(devices, &mut found, &mut left_out),
        }
    }
    failures.extend(found.iter().filter_map(|e: &ModeError| {
        e.complaint.as_ref().map(|c| format!("{}, {}, {}: {c}", e.backend, e.scalar, e.mode))
    }));
    let worst = found.iter().map(|e| e.of_bound).fold(0.0, f64::max);
    let line = format!("{} pictures, at most {worst:.2} of what the rule allows", found.len());
    PartResult { found, left_out, line }
}

/// The phantom in one format.
struct PhantomInFormat {
    scalar: ScalarType,
    tree: BrickTree,
    scene: Scene,
    reference: Discrete,
}

fn subject(scalar: ScalarType, voxels: u32, pixels: u32) -> Result<PhantomInFormat, String> {
    let Phantom { volume, transfer, camera } = phantom_of(UVec3::splat(voxels), scalar);
    let tree = tree(&volume)?;
    let scene = Scene::new(camera, UVec2::splat(pixels), transfer);
    let complete = Scene { skipping: Skipping::Off, ..scene.clone() };
    let plan = prepare(&tree, &complete, &mut Residency::default()).map_err(|e| e.to_string())?;
    Ok(PhantomInFormat { scalar, tree, scene, reference: discrete(&plan) })
}

/// An octree of bricks of 32.
pub(super) fn tree(volume: &Volume) -> Result<BrickTree, String> {
    let options = BuildOptions { side: BrickSide::S32, downsampling: Downsampling::Average, max_bytes: None };
    build_tree(volume, &options).map_err(|e| e.to_string())
}

impl PhantomInFormat {
    fn measure(&self, devices: &mut Devices, found: &mut Vec<ModeError>, left_out: &mut Vec<Unmeasured>) {
        for (name, mode) in MODES {
            for (kind, probe) in devices.iter_mut() {
                match self.error(name, mode, &mut **probe) {
                    Ok(error) => found.push(error),
                    Err(e) => left_out.push(Unmeasured::new(format!("{kind}, {}, {name}", self.scalar.name()), e)),
                }
            }
        }
    }

    fn error(&self, name: &str, mode: Mode, backend: &mut dyn Backend) -> Result<ModeError, String> {
        let scene = Scene { mode, ..self.scene.clone() };
        let plan = prepare(&self.tree, &scene, &mut Residency::default()).map_err(|e| e.to_string())?;
        let image = backend.render(&plan).map_err(|e| e.to_string())?.image;
        let d = backend.describe();
        let tolerance = Tolerance::of(&plan, &self.reference, &d.capabilities).map_err(|e| e.to_string())?;
        let verdict = tolerance.judge(&image, &self.reference.image);
        let errors = verdict.errors.ok_or("the picture cannot be compared")?;
        Ok(ModeError {
            backend: d.backend.to_owned(),
            scalar: self.scalar.name().to_owned(),
            mode: name.to_owned(),
            rmse: errors.rmse,
            max: errors.worst.difference,
            p999: errors.p999,
            of_bound: verdict.used,
            complaint: verdict.complaint.map(|c| c.to_string()),
        })
    }
}

/// Positions between two samples at which the filter is looked at.
const N_POSITIONS: u32 = 4096;

/// Measures how many steps the device's filter takes from one sample to the next.
pub(super) fn filters(devices: &mut Devices) -> PartResult<Vec<FilterBits>> {
    let (mut found, mut left_out) = (Vec::new(), Vec::new());
    for scalar in SCALARS {
        for (kind, probe) in devices.iter_mut() {
            match filter_bits(scalar, &mut **probe) {
                Ok(bits) => found.push(bits),
                Err(e) => left_out.push(Unmeasured::new(format!("{kind}, filter of {}", scalar.name()), e)),
            }
        }
    }
    let bits: Vec<String> =
        found.iter().map(|b: &FilterBits| format!("{} {} {:.1}", b.backend, b.scalar, b.measured)).collect();
    PartResult { found, left_out, line: format!("bits of a weight: {}", bits.join(", ")) }
}

fn filter_bits(scalar: ScalarType, backend: &mut dyn Backend) -> Result<FilterBits, String> {
    // Layers of 0 and 1 by turns.
    let grid = Grid::axis_aligned(UVec3::splat(16), DVec3::ONE).map_err(|e| e.to_string())?;
    let volume = fill_unit(&grid, scalar, |p| f64::from(p.x as u32 % 2));
    let knot = |value| Knot { value, extinction: 0.1, color: [value, 0.5, 1.0] };
    let transfer = spread(&[knot(0.0), knot(1.0)], scalar).map_err(|e| e.to_string())?;
    let camera = brickfield_core::Camera::framing(&grid.world_box(), DVec3::new(0.6, -1.0, 0.35), DVec3::Z);
    let camera = camera.map_err(|e| e.to_string())?;
    let scene = Scene { mode: Mode::FAST, ..Scene::new(camera, UVec2::splat(8), transfer) };
    let plan = prepare(&tree(&volume)?, &scene, &mut Residency::default()).map_err(|e| e.to_string())?;
    let input = |i: u32| [6.0 + i as f32 / N_POSITIONS as f32, 7.0, 7.0, 0.0];
    let inputs: Vec<[f32; 4]> = (0..=N_POSITIONS).map(input).collect();
    let evaluates = backend.as_evaluate().ok_or_else(|| "it evaluates no single functions".to_owned())?;
    let outputs = evaluates.evaluate(&plan, ShaderFunction::Sample, &inputs).map_err(|e| e.to_string())?;
    let d = backend.describe();
    Ok(FilterBits {
        backend: d.backend.to_owned(),
        scalar: scalar.name().to_owned(),
        stated: d.capabilities.sub_texel_bits,
        measured: bits(outputs.iter().map(|o| o[0])),
    })
}

/// The binary logarithm of the steps between values.
fn bits(values: impl Iterator<Item = f32>) -> f64 {
    let distinct: BTreeSet<u32> = values.map(f32::to_bits).collect();
    (distinct.len().max(2) as f64 - 1.0).log2()
}

#[cfg(test)]
mod tests {
    use brickfield::BackendKind;

    use super::*;

    #[test]
    fn steps_are_counted() {
        let quantised = |i: u32| (i / 16) as f32 / 256.0;
        assert_eq!(bits((0..=N_POSITIONS).map(quantised)), 8.0);
        assert_eq!(bits([1.0, 1.0].into_iter()), 0.0);
    }

    /// The cpu filters in f32: it tells all positions apart, and its fast mode without a floor is its exact one.
    #[test]
    fn a_picture_is_held_to_the_rule_of_its_mode() {
        let mut cpu = brickfield::cpu::CpuBackend::new();
        assert_eq!(filter_bits(ScalarType::F32, &mut cpu).unwrap().measured, 12.0);
        let subject = subject(ScalarType::U8, 24, 24).unwrap();
        let [exact, no_floor, fast] = MODES.map(|(name, mode)| subject.error(name, mode, &mut cpu).unwrap());
        assert_eq!(exact.backend, BackendKind::Cpu.name());
        assert!(exact.complaint.is_none() && exact.rmse < 1e-5 && fast.complaint.is_none());
        assert_eq!((exact.rmse, exact.max), (no_floor.rmse, no_floor.max));
        assert!(fast.rmse >= exact.rmse);
    }
}
