#![doc = include_str!("../README.md")]

mod adapter;
mod backend;
mod cells;
mod content;
mod facets;
mod feature;
mod field;
mod knot_table;
mod lighting;
mod mesh;
mod packed;
mod pass;
mod plan;
mod probe;
mod proxy;
mod rays;
mod resource;
mod sampling;
mod skip;
mod spoil;
mod surfaces;
mod uniform;
mod value_scale;
mod view_rays;

pub use adapter::AdapterKind;
pub use backend::{
    Backend, Capabilities, Cost, Description, Evaluate, Frame, RenderError, ShaderChoice, ShaderFunction, Timing,
    check_memory, draw_batches,
};
pub use brickfield_optics::QuadratureRule;
pub use cells::{
    CellFace, CellNode, Cells, CellsBackend, CellsError, CellsPlan, CellsPlanError, CellsShading, CellsView, FaceBox,
    Handedness,
};
pub use content::{Chunk, Chunked, ContentId, HeldChunks};
pub use feature::{Feature, FeatureSet};
pub use field::{
    AtlasShape, BlockPlaces, BlockRanges, BlockRow, BlockSamples, Decode, Field, FieldError, IndexEntry, IndexGrid,
    IndexLattice, Join, Packing, Places, Reach, Room, RoomChange, SampleFormat, Slots, SlotsError, TextureLayout,
    TextureShape,
};
pub use knot_table::KnotTable;
pub use lighting::{LightUniform, Lighting};
pub use mesh::{
    Coloring, Mesh, MeshBackend, MeshError, MeshFrame, MeshLines, MeshPlan, MeshPlanError, MeshShading, MeshTriangle,
    MeshUniforms, MeshVertex, MeshView,
};
pub use packed::{DecodingUniforms, PackedSamples, PackedUniform, Upload};
pub use pass::Pass;
pub use plan::{Drawing, FramePlan, PlanError, PlanParts, Sequence};
pub use probe::{Fetch, Probe, ProbeUniforms, TextureReads, TextureWork};
pub use proxy::{ProxyCorner, ProxyGeometry, Slices, Target};
pub use rays::{PlanRay, RayFrame};
pub use resource::{Content, Resource};
pub use sampling::{Division, Lengths, Mode, Sampling, SamplingError};
pub use skip::{
    Beams, DarkError, DarkRegions, DarkRuns, KeptBoxes, MACROCELL_SIDE, MacrocellRanges, Occupancy, Overview,
};
pub use spoil::SpoiltPlan;
pub use surfaces::{Placement, PlacementError, PlaneStacks, Steps};
pub use uniform::{FEW_KNOTS, FrameUniforms, KnotUniform, PlaceUniform};
pub use value_scale::ValueScale;
pub use view_rays::{ViewRay, ViewRays};
