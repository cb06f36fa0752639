#![doc = include_str!("../README.md")]

mod decoding;
mod evaluate;
mod library;
mod passes;
mod pipelines;
mod reflect;
mod specialise;
mod trial;
mod variant;

pub use decoding::{DecodedTexels, Decoding, DecodingTask, decodings};
pub use evaluate::{shader_inputs, shader_outputs};
pub use library::{PatchError, ShaderLibrary};
pub use passes::{n_rays_that_go_on, passes, passes_of_cells};
pub use pipelines::{Chosen, PipelineKey, Pipelines};
pub use reflect::{Binding, BindingKind};
pub use specialise::{Counts, ShaderError, Specialised, specialise};
pub use variant::{Entry, FieldKind, KnotSearch, Segments, Surfaces, Variant};

/// The compiler that the modules are for.
pub use naga;
