//! The pipelines of shader variants.

use std::collections::HashMap;
use std::collections::hash_map::Entry::{Occupied, Vacant};
use std::sync::Arc;

use brickfield_frame::{RenderError, Target};
use brickfield_shaders::{ShaderLibrary, Variant};

use crate::vulkan::{Device, Pipeline};

/// The variants that were needed so far; there are a few hundred in all.
pub(crate) struct Variants {
    library: ShaderLibrary,
    /// The target is that of polygons.
    pipelines: HashMap<(Variant, Target), Pipeline>,
}

impl Variants {
    /// No variant yet.
    pub(crate) fn new(library: ShaderLibrary) -> Variants {
        Variants { library, pipelines: HashMap::new() }
    }

    /// The pipeline of a variant that computes, built if it is new.
    pub(crate) fn pipeline(&mut self, device: &Arc<Device>, variant: Variant) -> Result<&mut Pipeline, RenderError> {
        self.blending_into(device, variant, Target::default())
    }

    /// The pipeline of a variant that blends polygons into a target.
    pub(crate) fn blending_into(
        &mut self,
        device: &Arc<Device>,
        variant: Variant,
        target: Target,
    ) -> Result<&mut Pipeline, RenderError> {
        match self.pipelines.entry((variant, target)) {
            Occupied(known) => Ok(known.into_mut()),
            Vacant(new) => {
                let limit = device.physical().limits.max_per_stage_descriptor_storage_buffers;
                let shader = self.library.specialise_within(&variant, limit)?;
                Ok(new.insert(Pipeline::new(device, &shader, target)?))
            }
        }
    }
}
