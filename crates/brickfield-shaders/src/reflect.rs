//! What is left in a module: the resources that a backend must bind.

use naga::{AddressSpace, ImageClass, ImageDimension, Module, StorageAccess, StorageFormat, TypeInner};

/// A resource of group 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Binding {
    /// Its binding number.
    pub index: u32,
    /// What is to be bound.
    pub kind: BindingKind,
}

/// What a binding holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BindingKind {
    /// A uniform buffer ([`brickfield_frame::FrameUniforms`]).
    Uniform,
    /// A 3-D texture whose reads are f32 (the atlas); filtered if there is a [`Sampler`](Self::Sampler).
    Texture3d,
    /// A sampler: linear, clamped to the edge.
    Sampler,
    /// A storage buffer that is read.
    StorageRead,
    /// A storage buffer that is written.
    StorageReadWrite,
    /// A 2-D storage image of rgba32float that is written (the picture).
    StorageImage,
}

/// The bindings of a module in ascending order; `None` if a resource is none of ours.
pub(crate) fn bindings(module: &Module) -> Option<Vec<Binding>> {
    let bound = module.global_variables.iter().filter_map(|(_, g)| g.binding.map(|b| (b.binding, g)));
    let mut bindings = bound
        .map(|(index, g)| Some(Binding { index, kind: kind(g.space, &module.types[g.ty].inner)? }))
        .collect::<Option<Vec<_>>>()?;
    bindings.sort();
    Some(bindings)
}

fn kind(space: AddressSpace, inner: &TypeInner) -> Option<BindingKind> {
    match (space, inner) {
        (AddressSpace::Uniform, _) => Some(BindingKind::Uniform),
        (AddressSpace::Storage { access }, _) if access.contains(StorageAccess::STORE) => {
            Some(BindingKind::StorageReadWrite)
        }
        (AddressSpace::Storage { .. }, _) => Some(BindingKind::StorageRead),
        (AddressSpace::Handle, TypeInner::Sampler { comparison: false }) => Some(BindingKind::Sampler),
        (AddressSpace::Handle, TypeInner::Image { dim: ImageDimension::D3, class: ImageClass::Sampled { .. }, .. }) => {
            Some(BindingKind::Texture3d)
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
