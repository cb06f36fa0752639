#![doc = include_str!("../README.md")]

mod evaluate;
mod library;
mod reflect;
mod rounds;
mod specialise;
mod variant;

pub use evaluate::{shader_inputs, shader_outputs};
pub use library::{PatchError, ShaderLibrary};
pub use reflect::{Binding, BindingKind};
pub use rounds::{LLVMPIPE_LOOP_ROUNDS, loop_rounds};
pub use specialise::{Counts, ShaderError, Specialised, specialise};
pub use variant::{Entry, KnotSearch, Variant};

/// The compiler that the modules are for.
pub use naga;
