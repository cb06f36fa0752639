//! Cases x backends: every case renders (or evaluates) on every backend and is held to the f64 answer by a rule.
//!
//! - [`Case`]: a scene or a function, and the mutants that it must catch; [`cases`] lists them.
//! - [`Tolerance`]: the rules. No case has a tolerance of its own.
//! - `naive`: a second opinion on the reference itself, straight from the volume's voxels.
//! - [`PlanMutant`], [`ShaderMutant`]: backends with one thing wrong; [`SelfCheck`] runs them.
//! - [`Run`], [`Outcome`], [`Summary`]: pass, fail, unsupported, no-device, no-data. Absence is reported, never passed.
//! - [`RecordWriter`], [`Comparison`]: a record of all answers, and a later run held against it.

mod ahead;
mod candidate;
mod case;
mod cases;
mod cells;
mod check;
mod mesh_mutants;
mod meshes;
mod naive;
mod outcome;
mod pictures;
mod plan_mutants;
mod record;
mod rule;
mod run;
mod samples;
mod self_check;
pub mod shader_mutants;
mod storage;
mod surface_normals;
mod surfaces;

pub use ahead::for_each_prepared;
pub use candidate::Candidate;
pub use case::{Case, Check, FunctionPoint, FunctionTest, Mutant, NoData, Oracle, PictureTest, Plans, Shows};
pub use cases::all as cases;
pub use cells::{CellsMutant, CellsTest};
pub use check::{Judged, Obstacle, Prepared};
pub use mesh_mutants::MeshMutant;
pub use meshes::{Covers, MeshTest};
pub use outcome::{Outcome, Status, Summary};
pub use pictures::write_difference;
pub use plan_mutants::PlanMutant;
pub use record::{Comparison, Difference, RecordEntry, RecordError, RecordWriter, read_record};
pub use rule::{Complaint, PlanTolerance, Tolerance, Verdict};
pub use run::Run;
pub(crate) use samples::{Samples, VolumeSamples};
pub use self_check::SelfCheck;
pub use shader_mutants::ShaderMutant;
pub use storage::Storage;
