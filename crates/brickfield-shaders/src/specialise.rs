//! From a variant to a module with nothing in it that the variant does not need.

use brickfield_frame::{Feature, RenderError, Resource};
use naga::Module;
use naga::back::spv;
use naga::compact::{KeepUnused, compact};
use naga::front::wgsl;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use crate::reflect::{Binding, bindings};
use crate::{ShaderLibrary, Variant};

/// A variant, compiled, validated and compacted.
#[derive(Clone, Debug)]
pub struct Specialised {
    /// The variant.
    pub variant: Variant,
    /// The module; both backends are fed this one.
    pub module: Module,
    /// The module's properties, as validation found them.
    pub info: ModuleInfo,
    /// The text it was parsed from.
    pub wgsl: String,
    /// The bindings of group 0, ascending.
    pub bindings: Vec<Binding>,
    /// Invocations along x, y, z of a workgroup; 0 where polygons are shaded.
    pub workgroup_size: [u32; 3],
    /// How much code is left.
    pub counts: Counts,
}

/// How much code is left in a variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Functions, the entry point included.
    pub functions: usize,
    /// Expressions of all functions.
    pub expressions: usize,
    /// Bytes of WGSL text.
    pub wgsl_bytes: usize,
}

/// Why a variant could not be compiled: a defect of this crate, or of a patch.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ShaderError {
    #[error("WESL: {message}")]
    Compile { message: String },
    #[error("WGSL: {message}")]
    Parse { message: String },
    #[error("validation: {message}")]
    Validate { message: String },
    #[error("the shader's variable `{name}` is no resource that a backend binds")]
    Binding { name: String },
    #[error("a shader with {n} storage buffers; the device allows {limit}")]
    TooManyStorageBuffers { n: u32, limit: u32 },
    #[error("no entry point is left")]
    NoEntry,
    #[error("SPIR-V: {message}")]
    Spirv { message: String },
}

impl ShaderError {
    pub(crate) fn compile(error: impl std::fmt::Display) -> ShaderError {
        ShaderError::Compile { message: error.to_string() }
    }
}

impl From<ShaderError> for RenderError {
    fn from(error: ShaderError) -> RenderError {
        match error {
            ShaderError::TooManyStorageBuffers { n, limit } => RenderError::TooManyStorageBuffers { n, limit },
            error => RenderError::Shader { message: error.to_string() },
        }
    }
}

/// The variant of this crate's own sources.
///
/// # Errors
/// A defect of this crate; its tests compile every variant.
pub fn specialise(variant: &Variant) -> Result<Specialised, ShaderError> {
    ShaderLibrary::embedded().specialise(variant)
}

impl ShaderLibrary {
    /// Compiles, validates and compacts a variant.
    ///
    /// WESL's conditions leave out declarations that the variant does not need, before parsing; naga's compaction then drops the types,
    /// constants and resources that nothing refers to any more. A few milliseconds.
    ///
    /// # Errors
    /// If the sources do not compile: a patch that broke them.
    pub fn specialise(&self, variant: &Variant) -> Result<Specialised, ShaderError> {
        let wgsl = self.wgsl(variant)?;
        let mut module = wgsl::parse_str(&wgsl).map_err(|e| ShaderError::Parse { message: e.emit_to_string(&wgsl) })?;
        validate(&module, &wgsl)?;
        compact(&mut module, KeepUnused::No);
        let info = validate(&module, &wgsl)?;
        let bindings = bindings(&module).map_err(|name| ShaderError::Binding { name })?;
        let workgroup_size = module.entry_points.first().ok_or(ShaderError::NoEntry)?.workgroup_size;
        let counts = counts(&module, &wgsl);
        Ok(Specialised { variant: *variant, module, info, wgsl, bindings, workgroup_size, counts })
    }
}

/// Features that only save time, in the order in which they are given up where a device has too few storage buffers. Without
/// them no pixel changes.
const GIVEN_UP: [Feature; 2] = [Feature::SkipBesideBeams, Feature::SkipDark];

impl ShaderLibrary {
    /// As [`specialise`](Self::specialise), for a device that allows so many storage buffers in a stage: where they are too few,
    /// features that only save time are left out.
    ///
    /// # Errors
    /// As [`specialise`](Self::specialise); and if the variant cannot do with so few.
    pub fn specialise_within(&self, variant: &Variant, max_storage_buffers: u32) -> Result<Specialised, ShaderError> {
        let mut variant = *variant;
        let mut shader = self.specialise(&variant)?;
        for feature in GIVEN_UP {
            if shader.n_storage_buffers() > max_storage_buffers && variant.features.contains(feature) {
                variant.features = variant.features.without(feature);
                shader = self.specialise(&variant)?;
            }
        }
        match shader.n_storage_buffers() {
            n if n > max_storage_buffers => Err(ShaderError::TooManyStorageBuffers { n, limit: max_storage_buffers }),
            _ => Ok(shader),
        }
    }
}

impl Specialised {
    /// Whether the shader reads or writes a resource.
    pub fn uses(&self, resource: Resource) -> bool {
        self.bindings.iter().any(|b| b.resource == resource)
    }

    /// Storage buffers that a stage has.
    pub fn n_storage_buffers(&self) -> u32 {
        self.bindings.iter().filter(|b| b.kind.is_storage_buffer()).count() as u32
    }

    /// The module as SPIR-V 1.3 for Vulkan, with all its entry points.
    ///
    /// Reads are restricted to their resource (at most 15 % of the time on lavapipe, mostly nothing), as wgpu does.
    ///
    /// # Errors
    /// If naga cannot express the module.
    pub fn spirv(&self) -> Result<Vec<u32>, ShaderError> {
        spv::write_vec(&self.module, &self.info, &spirv_options(), None)
            .map_err(|e| ShaderError::Spirv { message: e.to_string() })
    }
}

fn validate(module: &Module, wgsl: &str) -> Result<ModuleInfo, ShaderError> {
    Validator::new(ValidationFlags::all(), Capabilities::default())
        .validate(module)
        .map_err(|e| ShaderError::Validate { message: e.emit_to_string(wgsl) })
}

fn counts(module: &Module, wgsl: &str) -> Counts {
    let functions = || module.functions.iter().map(|(_, f)| f).chain(module.entry_points.iter().map(|e| &e.function));
    Counts {
        functions: functions().count(),
        expressions: functions().map(|f| f.expressions.len()).sum(),
        wgsl_bytes: wgsl.len(),
    }
}

fn spirv_options() -> spv::Options<'static> {
    let restrict = BoundsCheckPolicy::Restrict;
    spv::Options {
        lang_version: (1, 3),
        flags: spv::WriterFlags::empty(),
        bounds_check_policies: BoundsCheckPolicies {
            index: restrict,
            buffer: restrict,
            image_load: restrict,
            binding_array: BoundsCheckPolicy::Unchecked,
        },
        ..spv::Options::default()
    }
}
