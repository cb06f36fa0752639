//! The messages of the validation layer.
#![expect(unsafe_code, reason = "Vulkan calls back through a C function")]

use std::ffi::c_void;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

/// The messages of Vulkan's validation layer; none if all is well.
///
/// Clones share their messages, and may outlive the backend: messages about its end are kept, too.
#[derive(Clone, Debug, Default)]
pub struct ValidationLog(Arc<Mutex<Vec<String>>>);

impl ValidationLog {
    /// The messages so far, oldest first.
    pub fn messages(&self) -> Vec<String> {
        self.lock().clone()
    }

    /// Takes the messages out.
    pub fn drain(&self) -> Vec<String> {
        std::mem::take(&mut self.lock())
    }

    fn lock(&self) -> MutexGuard<'_, Vec<String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How a messenger writes to this log; an object that is created with it must be destroyed before the log.
    pub(super) fn messenger(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
        use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(Severity::ERROR | Severity::WARNING)
            .message_type(Type::VALIDATION | Type::PERFORMANCE)
            .pfn_user_callback(Some(record))
            .user_data(Arc::as_ptr(&self.0).cast_mut().cast())
    }
}

unsafe extern "system" fn record(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    log: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes a valid structure with strings that end, and the pointer of `messenger`, whose log outlives
    // the messenger (`Instance` destroys the messenger before it drops its clone of the log).
    let (text, log) = unsafe { ((*data).message_as_c_str(), &*log.cast_const().cast::<Mutex<Vec<String>>>()) };
    let text = text.map(|t| t.to_string_lossy().into_owned()).unwrap_or_default();
    log.lock().unwrap_or_else(PoisonError::into_inner).push(text);
    vk::FALSE
}
