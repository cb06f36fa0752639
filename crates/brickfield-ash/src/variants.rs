//! The pipelines of shader variants.

use std::collections::HashMap;
use std::collections::hash_map::Entry::{Occupied, Vacant};
use std::sync::Arc;

use brickfield_frame::RenderError;
use brickfield_shaders::{ShaderLibrary, Variant};

use crate::vulkan::{Device, Pipeline};

/// The variants that were needed so far; there are a few hundred in all.
pub(crate) struct Variants {
    library: ShaderLibrary,
    pipelines: HashMap<Variant, Pipeline>,
}

impl Variants {
    /// No variant yet.
    pub(crate) fn new(library: ShaderLibrary) -> Variants {
        Variants { library, pipelines: HashMap::new() }
    }

    /// The pipeline of a variant, built if it is new.
    pub(crate) fn pipeline(&mut self, device: &Arc<Device>, variant: Variant) -> Result<&mut Pipeline, RenderError> {
        match self.pipelines.entry(variant) {
            Occupied(known) => Ok(known.into_mut()),
            Vacant(new) => {
                let shader = self.library.specialise(&variant);
                let shader = shader.map_err(|e| RenderError::Shader { message: e.to_string() })?;
                Ok(new.insert(Pipeline::new(device, &shader)?))
            }
        }
    }
}
