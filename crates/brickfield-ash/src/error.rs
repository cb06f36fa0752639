//! The errors before the first frame, and how failed Vulkan calls become errors.

use ash::vk;
use brickfield_frame::RenderError;

/// Why there is no backend.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ConnectError {
    #[error(
        "no Vulkan loader ({reason}): install libvulkan1 (Debian, Ubuntu), vulkan-loader (Fedora), the Vulkan SDK (macOS) \
         or a graphics driver (Windows)"
    )]
    NoLoader { reason: String },
    #[error("the Vulkan loader is of version {found}; 1.1 is needed")]
    OldLoader { found: String },
    #[error(
        "no Vulkan 1.1 device: install a graphics driver, or mesa-vulkan-drivers (Debian, Ubuntu) for one in software"
    )]
    NoDevice,
    #[error("no Vulkan adapter {wanted}; the adapters are {there}")]
    UnknownAdapter { wanted: String, there: String },
    #[error("{adapter} has no queue that computes")]
    NoComputeQueue { adapter: String },
    #[error("no Vulkan validation layer: install vulkan-validationlayers (Debian, Ubuntu) or the Vulkan SDK")]
    NoValidationLayer,
    #[error("{call} failed: {code}")]
    Driver { call: &'static str, code: String },
}

/// A Vulkan call that failed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FailedCall {
    pub(crate) call: &'static str,
    pub(crate) code: vk::Result,
}

/// Names the call that gave a result.
pub(crate) trait OfCall<T> {
    fn of(self, call: &'static str) -> Result<T, FailedCall>;
}

impl<T> OfCall<T> for Result<T, vk::Result> {
    fn of(self, call: &'static str) -> Result<T, FailedCall> {
        self.map_err(|code| FailedCall { call, code })
    }
}

impl FailedCall {
    /// The error of work on the device: a lost device is reported with the work that was being done.
    pub(crate) fn while_doing(self, doing: &'static str) -> RenderError {
        match self.code {
            vk::Result::ERROR_DEVICE_LOST => RenderError::DeviceLost { doing },
            code => RenderError::Driver { call: self.call, code: format!("{code:?}") },
        }
    }
}

impl From<FailedCall> for RenderError {
    fn from(failed: FailedCall) -> RenderError {
        failed.while_doing(failed.call)
    }
}

impl From<FailedCall> for ConnectError {
    fn from(FailedCall { call, code }: FailedCall) -> ConnectError {
        ConnectError::Driver { call, code: format!("{code:?}") }
    }
}
