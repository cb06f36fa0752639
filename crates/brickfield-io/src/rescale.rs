//! Applying a file's slope and intercept.

use brickfield_core::ScalarType;
#[cfg(feature = "nifti")]
use brickfield_core::{Scalar, Voxels, with_voxels};

use crate::Note;
#[cfg(feature = "nifti")]
use crate::ReadError;
#[cfg(feature = "nifti")]
use crate::limits::{Limits, check_bytes};
#[cfg(feature = "nifti")]
use crate::samples::with_room;

/// value = slope * stored + intercept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rescale {
    pub(crate) slope: f64,
    pub(crate) intercept: f64,
}

impl Rescale {
    pub(crate) const IDENTITY: Rescale = Rescale { slope: 1.0, intercept: 0.0 };

    /// The rescale, or the identity with a note if it is not finite or loses everything.
    pub(crate) fn usable(self, notes: &mut Vec<Note>) -> Rescale {
        if self.slope.is_finite() && self.intercept.is_finite() && self.slope != 0.0 {
            return self;
        }
        notes.push(Note::RescaleIgnored { slope: self.slope, intercept: self.intercept });
        Rescale::IDENTITY
    }

    pub(crate) fn apply(self, stored: f64) -> f64 {
        self.slope * stored + self.intercept
    }
}

/// The type that holds rescaled values of a stored type: f64 where f32 would lose digits of the stored value.
pub(crate) fn rescaled_type(stored: ScalarType) -> ScalarType {
    match stored {
        ScalarType::U32 | ScalarType::I32 | ScalarType::F64 => ScalarType::F64,
        _ => ScalarType::F32,
    }
}

/// Rescaled voxels, as f32 or f64; the identity keeps them as they are.
///
/// # Errors
/// If the rescaled voxels would be beyond the limits.
#[cfg(feature = "nifti")]
pub(crate) fn rescaled(voxels: Voxels, rescale: Rescale, limits: &Limits) -> Result<Voxels, ReadError> {
    if rescale == Rescale::IDENTITY {
        return Ok(voxels);
    }
    let to = rescaled_type(voxels.scalar_type());
    check_bytes(voxels.len() as u128 * to.n_bytes() as u128, limits, || format!("the volume rescaled to {to}"))?;
    match to {
        ScalarType::F64 => mapped::<f64>(&voxels, rescale),
        _ => mapped::<f32>(&voxels, rescale),
    }
}

/// Voxels as `T`, rescaled; a value outside `T` saturates.
#[cfg(feature = "nifti")]
fn mapped<T: Scalar>(voxels: &Voxels, rescale: Rescale) -> Result<Voxels, ReadError> {
    let mut values = with_room::<T>(voxels.len())?;
    with_voxels!(voxels, v => values.extend(v.iter().map(|x| T::from_f64(rescale.apply(x.to_f64())))));
    Ok(T::wrap(values))
}
