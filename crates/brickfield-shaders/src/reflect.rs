//! The resources that are left in a module, which a backend must bind.

use brickfield_frame::{Resource, TextureLayout};
use naga::{AddressSpace, GlobalVariable, ImageClass, ImageDimension, Module, StorageAccess, StorageFormat, TypeInner};

/// A resource of group 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Binding {
    /// Its binding number.
    pub index: u32,
    /// The resource, by its name in the shader.
    pub resource: Resource,
    /// The kind of its binding.
    pub kind: BindingKind,
}

/// The kinds of bindings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BindingKind {
    /// A uniform buffer ([`brickfield_frame::FrameUniforms`]).
    Uniform,
    /// A texture whose reads are f32 (the atlas): a volume that is filtered, or layers that are not.
    Texture(TextureLayout),
    /// A sampler, clamped to the edge: linear for a volume, nearest for layers.
    Sampler(TextureLayout),
    /// A storage buffer that is read.
    StorageRead,
    /// A storage buffer that is written.
    StorageReadWrite,
    /// A 2-D storage image of rgba32float that is written (the picture).
    StorageImage,
}

impl BindingKind {
    /// Whether it counts among a stage's storage buffers.
    pub const fn is_storage_buffer(self) -> bool {
        matches!(self, BindingKind::StorageRead | BindingKind::StorageReadWrite)
    }
}

/// The bindings of a module in ascending order.
///
/// # Errors
/// The name of a variable that is no resource of ours, or of a kind that no backend binds.
pub(crate) fn bindings(module: &Module) -> Result<Vec<Binding>, String> {
    let bound = module.global_variables.iter().filter_map(|(_, g)| g.binding.map(|b| (b.binding, g)));
    let binding = |(index, g): (u32, &GlobalVariable)| {
        let name = g.name.as_deref().unwrap_or_default();
        let resource = Resource::of_name(name);
        let kind = resource.and_then(|resource| kind(resource, g.space, &module.types[g.ty].inner));
        match (resource, kind) {
            (Some(resource), Some(kind)) => Ok(Binding { index, resource, kind }),
            _ => Err(name.to_owned()),
        }
    };
    let mut bindings = bound.map(binding).collect::<Result<Vec<_>, _>>()?;
    bindings.sort();
    Ok(bindings)
}

fn kind(resource: Resource, space: AddressSpace, inner: &TypeInner) -> Option<BindingKind> {
    match (space, inner) {
        (AddressSpace::Uniform, _) => Some(BindingKind::Uniform),
        (AddressSpace::Storage { access }, _) if access.contains(StorageAccess::STORE) => {
            Some(BindingKind::StorageReadWrite)
        }
        (AddressSpace::Storage { .. }, _) => Some(BindingKind::StorageRead),
        (AddressSpace::Handle, TypeInner::Sampler { comparison: false }) => match resource {
            Resource::NearestSampler => Some(BindingKind::Sampler(TextureLayout::Layers)),
            _ => Some(BindingKind::Sampler(TextureLayout::Volume)),
        },
        (AddressSpace::Handle, TypeInner::Image { dim, arrayed, class: ImageClass::Sampled { .. } }) => {
            layout(*dim, *arrayed).map(BindingKind::Texture)
        }
        (
            AddressSpace::Handle,
            TypeInner::Image {
                dim: ImageDimension::D2,
                class: ImageClass::Storage { format: StorageFormat::Rgba32Float, .. },
                ..
            },
        ) => Some(BindingKind::StorageImage),
        _ => None,
    }
}

fn layout(dim: ImageDimension, arrayed: bool) -> Option<TextureLayout> {
    match (dim, arrayed) {
        (ImageDimension::D3, false) => Some(TextureLayout::Volume),
        (ImageDimension::D2, true) => Some(TextureLayout::Layers),
        _ => None,
    }
}
