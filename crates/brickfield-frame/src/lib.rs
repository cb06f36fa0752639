#![doc = include_str!("../README.md")]

mod backend;
mod beams;
mod brick_set;
mod chebyshev;
mod facets;
mod feature;
mod held;
mod index;
mod macrocells;
mod occupancy;
mod pass;
mod plan;
mod proxy;
mod rays;
mod sampling;
mod surfaces;
mod uniform;
mod value_scale;

pub use backend::{Backend, Capabilities, Description, Frame, RenderError, ShaderFunction, Timing, check_memory};
pub use beams::{Beams, Overview};
pub use brick_set::{AtlasShape, BrickSet, BrickSetError, Decode, SampleFormat};
pub use brickfield_optics::QuadratureRule;
pub use feature::{Feature, FeatureSet};
pub use held::Held;
pub use index::{IndexEntry, IndexGrid};
pub use macrocells::MacrocellRanges;
pub use occupancy::{MACROCELL_SIDE, Occupancy};
pub use pass::Pass;
pub use plan::FramePlan;
pub use proxy::{ProxyCorner, ProxyGeometry, Target};
pub use rays::{PlanRay, RayFrame};
pub use sampling::{Division, Lengths, Mode, Sampling, SamplingError};
pub use surfaces::{Placement, PlacementError, PlaneStacks, Steps};
pub use uniform::{FrameUniforms, KnotUniform};
pub use value_scale::ValueScale;
