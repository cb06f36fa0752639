//! The Vulkan instance, and the messenger of its validation layer.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::ffi::CStr;

use ash::{Entry, ext, khr, vk};

use super::ValidationLog;
use crate::error::OfCall;
use crate::{ConnectError, Validation};

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// A Vulkan instance.
pub(crate) struct Instance {
    raw: ash::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    log: ValidationLog,
    /// Dropped last: it unloads the library.
    _entry: Entry,
}

impl Instance {
    /// Loads Vulkan.
    pub(crate) fn new(validation: Validation) -> Result<Instance, ConnectError> {
        // SAFETY: the system's Vulkan loader has no initialisation routine that could break this program's invariants.
        let entry = unsafe { Entry::load() }.map_err(|e| ConnectError::NoLoader { reason: e.to_string() })?;
        check_version(&entry)?;
        let log = ValidationLog::default();
        let raw = match validation {
            Validation::Off => create(&entry, &[], &[], None)?,
            Validation::On => create_watched(&entry, &log)?,
        };
        let mut instance = Instance { raw, messenger: None, log, _entry: entry };
        if validation == Validation::On {
            instance.watch()?;
        }
        Ok(instance)
    }

    pub(super) fn raw(&self) -> &ash::Instance {
        &self.raw
    }

    /// The messages of the validation layer.
    pub(crate) fn log(&self) -> &ValidationLog {
        &self.log
    }

    fn watch(&mut self) -> Result<(), ConnectError> {
        let debug_utils = ext::debug_utils::Instance::new(&self._entry, &self.raw);
        // SAFETY: the extension is enabled; the log lives in `self`, and `drop` destroys the messenger first.
        let messenger = unsafe { debug_utils.create_debug_utils_messenger(&self.log.messenger(), None) }
            .of("vkCreateDebugUtilsMessengerEXT")?;
        self.messenger = Some((debug_utils, messenger));
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((debug_utils, messenger)) = self.messenger.take() {
            // SAFETY: created from this instance, used by nothing else.
            unsafe { debug_utils.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: `Device` owns its instance and is destroyed before it; nothing else is created from an instance.
        unsafe { self.raw.destroy_instance(None) };
    }
}

fn check_version(entry: &Entry) -> Result<(), ConnectError> {
    // SAFETY: no arguments.
    let version = unsafe { entry.try_enumerate_instance_version() }.of("vkEnumerateInstanceVersion")?;
    let version = version.unwrap_or(vk::API_VERSION_1_0);
    match version >= vk::API_VERSION_1_1 {
        true => Ok(()),
        false => Err(ConnectError::OldLoader { found: version_text(version) }),
    }
}

/// An instance that the validation layer watches from its creation to its end.
fn create_watched(entry: &Entry, log: &ValidationLog) -> Result<ash::Instance, ConnectError> {
    // SAFETY: no arguments.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.of("vkEnumerateInstanceLayerProperties")?;
    if !layers.iter().any(|l| l.layer_name_as_c_str() == Ok(LAYER)) {
        return Err(ConnectError::NoValidationLayer);
    }
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut messenger = log.messenger();
    features.p_next = (&raw mut messenger).cast();
    create(entry, &[LAYER], &[ext::debug_utils::NAME, ext::validation_features::NAME], Some(&mut features))
}

fn create(
    entry: &Entry,
    layers: &[&CStr],
    extensions: &[&CStr],
    validation: Option<&mut vk::ValidationFeaturesEXT<'_>>,
) -> Result<ash::Instance, ConnectError> {
    let mut extensions = extensions.to_vec();
    let mut flags = vk::InstanceCreateFlags::empty();
    if has_portability(entry)? {
        extensions.push(khr::portability_enumeration::NAME);
        flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    }
    let [layers, extensions] = [layers, &extensions].map(|names| names.iter().map(|n| n.as_ptr()).collect::<Vec<_>>());
    let application = vk::ApplicationInfo::default().application_name(c"brickfield").api_version(vk::API_VERSION_1_3);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions)
        .flags(flags);
    if let Some(features) = validation {
        info.p_next = std::ptr::from_mut(features).cast();
    }
    // SAFETY: `info` and all that it points to are valid and live until the call returns.
    match unsafe { entry.create_instance(&info, None) } {
        Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => Err(ConnectError::NoDevice),
        created => Ok(created.of("vkCreateInstance")?),
    }
}

/// Whether devices that lack parts of Vulkan (over Metal) are listed only on request.
fn has_portability(entry: &Entry) -> Result<bool, ConnectError> {
    // SAFETY: no layer is named.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(None) };
    let extensions = extensions.of("vkEnumerateInstanceExtensionProperties")?;
    Ok(extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::portability_enumeration::NAME)))
}

/// A packed Vulkan version as text.
pub(super) fn version_text(version: u32) -> String {
    let [major, minor, patch] =
        [vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version)];
    format!("{major}.{minor}.{patch}")
}
