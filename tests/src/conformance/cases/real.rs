//! Real volumes of every scalar type, read through the front door from the folder that `BRICKFIELD_DATA` names.

use std::path::Path;

use brickfield::io::{OpenOptions, open};
use brickfield_core::{Scalar, ScalarType, Volume, Voxels};
use brickfield_optics::automatic;

use super::setup::{Setup, catches, fallible_picture, type_name};
use crate::conformance::case::{Case, NoData};
use crate::conformance::plan_mutants::PlanMutant::*;
use crate::conformance::shader_mutants as shader;

/// The folder of real volumes.
pub(crate) const DATA: &str = "BRICKFIELD_DATA";

/// A scalar type, a file of that type or of one that is converted without loss, and its name.
const VOLUMES: [(ScalarType, &str, &str); 8] = [
    (ScalarType::U8, "engine", "ct/engine.vti"),
    (ScalarType::I8, "engine", "ct/engine.vti"),
    (ScalarType::U16, "tooth", "ct/tooth.nhdr"),
    (ScalarType::I16, "head", "ct/GE_head_dicom"),
    (ScalarType::U32, "tooth", "ct/tooth.nhdr"),
    (ScalarType::I32, "head", "ct/GE_head_dicom"),
    (ScalarType::F32, "fetal", "mri/fetal_template_T2.nrrd"),
    (ScalarType::F64, "fetal", "mri/fetal_template_T2.nrrd"),
];

pub(super) fn cases() -> Vec<Case> {
    let one = |(scalar, name, path): (ScalarType, &str, &'static str)| {
        let mutants = catches![BricksShifted, AnchorHalfVoxel, DecodeOffset, shader::NEAREST];
        fallible_picture(format!("real/{name}-{}", type_name(scalar)), mutants, move || {
            let volume = converted(&read(path)?, scalar);
            let transfer = automatic(&volume);
            Ok(Setup::new(volume, transfer).side(brickfield_core::BrickSide::S32).step(1.0))
        })
    };
    VOLUMES.map(one).into()
}

/// A volume of the data folder.
pub(crate) fn read(path: &str) -> Result<Volume, NoData> {
    let Some(folder) = std::env::var_os(DATA) else {
        return Err(NoData { reason: format!("{DATA} is not set") });
    };
    let opened = open(&Path::new(&folder).join(path), &OpenOptions::default());
    opened.map(|o| o.volume).map_err(|e| NoData { reason: e.to_string() })
}

/// The same values in another type; i8 gets the values of u8 less 128.
fn converted(volume: &Volume, scalar: ScalarType) -> Volume {
    let shift = match (volume.scalar_type(), scalar) {
        (ScalarType::U8, ScalarType::I8) => -128.0,
        _ => 0.0,
    };
    let voxels = match scalar {
        ScalarType::U8 => convert::<u8>(volume, shift),
        ScalarType::I8 => convert::<i8>(volume, shift),
        ScalarType::U16 => convert::<u16>(volume, shift),
        ScalarType::I16 => convert::<i16>(volume, shift),
        ScalarType::U32 => convert::<u32>(volume, shift),
        ScalarType::I32 => convert::<i32>(volume, shift),
        ScalarType::F32 => convert::<f32>(volume, shift),
        ScalarType::F64 => convert::<f64>(volume, shift),
    };
    Volume::new(*volume.grid(), voxels).expect("as many voxels")
}

fn convert<T: Scalar>(volume: &Volume, shift: f64) -> Voxels {
    let value = |i: usize| T::from_f64(volume.value(i) + shift);
    T::wrap((0..volume.voxels().len()).map(value).collect())
}
