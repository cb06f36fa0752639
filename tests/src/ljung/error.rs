//! The error of a picture.

use brickfield_core::Image;
use serde::Serialize;

use crate::metrics::{MetricError, delta_e, errors};

/// Against the picture at full resolution.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Error {
    /// Root mean square of the channels' differences.
    pub(super) rmse: f64,
    /// CIELUV colour difference over black: mean, and 95th percentile of the pixels.
    pub(super) delta_e_mean: f64,
    pub(super) delta_e_95: f64,
}

impl Error {
    pub(super) fn of(image: &Image<f32>, answer: &Image<f64>) -> Result<Error, MetricError> {
        let difference = delta_e(image, answer, [0.0; 3])?;
        Ok(Error {
            rmse: errors(image, answer)?.rmse,
            delta_e_mean: difference.mean,
            delta_e_95: difference.percentile_95,
        })
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Error { rmse, delta_e_mean, delta_e_95 } = self;
        write!(f, "RMSE {rmse:.2e}, dE mean {delta_e_mean:.3}, 95 % {delta_e_95:.2}")
    }
}
