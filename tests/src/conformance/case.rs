//! A case: a scene to render or a function to evaluate, its reference, and the mutants that it must catch.

use std::collections::BTreeSet;
use std::fmt;

use brickfield::bricks::{BlockVolume, BrickTree};
use brickfield::frame::{FramePlan, ShaderFunction};
use brickfield::{
    BlockResidency, BlockStyle, PrepareBlocksError, PrepareError, PrepareTrimmedError, Residency, Scene, Skipping,
    Technique, TrimResidency, TrimmedVolume, Trimming, prepare, prepare_blocks, prepare_trimmed,
};
use brickfield_core::{Level, Volume};

use super::cells::{CellsMutant, CellsTest};
use super::mesh_mutants::MeshMutant;
use super::meshes::MeshTest;
use super::plan_mutants::PlanMutant;
use super::shader_mutants::ShaderMutant;
use super::storage::Storage;

/// A case of the conformance run.
pub struct Case {
    /// Its name: group/name.
    pub name: String,
    /// The picture or the function.
    pub check: Check,
    /// The mutants that the case must catch; at least one.
    pub mutants: Vec<Mutant>,
}

/// The test of a case.
pub enum Check {
    /// Renders a scene.
    Picture(Box<dyn Fn() -> Result<PictureTest, NoData> + Send + Sync>),
    /// Draws a mesh.
    Mesh(Box<dyn Fn() -> MeshTest + Send + Sync>),
    /// Draws curvilinear cells.
    Cells(Box<dyn Fn() -> CellsTest + Send + Sync>),
    /// Evaluates one function on a list of inputs.
    Function(Box<dyn Fn() -> FunctionTest + Send + Sync>),
}

/// A backend with one thing wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Mutant {
    /// In the plan that it is handed.
    Plan(PlanMutant),
    /// In the plan of a mesh that it is handed.
    Mesh(MeshMutant),
    /// In the plan of cells that it is handed.
    Cells(CellsMutant),
    /// In the shaders that it compiles.
    Shader(ShaderMutant),
}

/// The data that a case needs is not on this machine.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no data: {reason}")]
#[allow(missing_docs)]
pub struct NoData {
    pub reason: String,
}

/// The scene of a picture case.
pub struct PictureTest {
    /// The volume's octree.
    pub tree: BrickTree,
    /// How it is shown.
    pub scene: Scene,
    /// Who else knows the picture.
    pub oracle: Oracle,
    /// Whether there is anything to see.
    pub shows: Shows,
    /// How many triangles are drawn at a time, if not as many as usual.
    pub triangles_at_a_time: Option<u32>,
    /// How the samples are stored.
    pub storage: Storage,
    /// The flat blocks that are drawn instead of the octree.
    pub blocks: Option<FlatBlocks>,
    /// The trimmed bricks that are drawn instead of the octree.
    pub trimmed: Option<TrimmedBricks>,
}

/// Trimmed bricks, and which of their samples are stored and drawn.
pub struct TrimmedBricks {
    /// The bricks.
    pub volume: TrimmedVolume,
    /// Which samples.
    pub trimming: Trimming,
}

/// Flat blocks, and how they are drawn.
pub struct FlatBlocks {
    /// The blocks.
    pub volume: BlockVolume,
    /// The level of each block, by number.
    pub levels: Vec<Level>,
    /// How values between them come about.
    pub style: BlockStyle,
}

/// Whether a picture shows anything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Shows {
    Something,
    Nothing,
}

impl Shows {
    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Shows::Something => "something",
            Shows::Nothing => "nothing",
        }
    }
}

/// A second answer, that shares no code with `prepare`.
pub enum Oracle {
    /// The volume's own samples at full resolution; the reference must agree to 1e-9.
    Volume(Box<Volume>),
    /// The picture at full resolution, though the cut is coarser: the field is one that every level reproduces.
    EveryLevel(Box<Volume>),
    /// None: coarse levels of a field that they change.
    None,
}

/// One function, its inputs and its answers.
pub struct FunctionTest {
    /// The plan in whose context it is evaluated.
    pub plan: FramePlan,
    /// The function.
    pub function: ShaderFunction,
    /// Inputs, each with its answer.
    pub points: Vec<FunctionPoint>,
}

/// An input, its answer, and how far each channel may be off.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct FunctionPoint {
    pub input: [f32; 4],
    pub expected: [f64; 4],
    pub tolerance: [f64; 4],
}

/// The plans of a picture case: the plan that backends replay, and the plan that the reference is made of.
pub struct Plans {
    /// The plan that backends replay.
    pub replayed: FramePlan,
    /// The same frame without skipping, by casting rays: its f64 sum is the reference.
    pub complete: FramePlan,
}

impl PictureTest {
    /// Prepares the scene as it is, and without skipping.
    ///
    /// # Errors
    /// A scene that `prepare` refuses.
    pub fn plans(&self) -> Result<Plans, PrepareError> {
        let technique = Technique::RayCasting;
        let complete = Scene { skipping: Skipping::Off, technique, ..self.scene.clone() };
        let mut replayed = self.prepare(&self.scene)?;
        if let Some(n) = self.triangles_at_a_time {
            replayed = replayed.in_batches_of(n);
        }
        let complete = self.prepare(&complete)?;
        let volume = match &self.oracle {
            Oracle::Volume(volume) | Oracle::EveryLevel(volume) => Some(&**volume),
            Oracle::None => None,
        };
        let stored = |plan| self.storage.of(plan, volume);
        Ok(Plans { replayed: stored(replayed), complete: stored(complete) })
    }

    /// The plan of a scene of the subject.
    ///
    /// # Errors
    /// A scene that `prepare` refuses.
    pub fn prepare(&self, scene: &Scene) -> Result<FramePlan, PrepareError> {
        if let Some(TrimmedBricks { volume, trimming }) = &self.trimmed {
            return match prepare_trimmed(volume, scene, *trimming, &mut TrimResidency::default()) {
                Err(PrepareTrimmedError::Prepare(error)) => Err(error),
                plan => Ok(plan.expect("a case's bricks are stored")),
            };
        }
        let Some(FlatBlocks { volume, levels, style }) = &self.blocks else {
            return prepare(&self.tree, scene, &mut Residency::default());
        };
        match prepare_blocks(volume, scene, levels, *style, &mut BlockResidency::default()) {
            Err(PrepareBlocksError::Prepare(error)) => Err(error),
            plan => Ok(plan.expect("a level for each block in memory")),
        }
    }
}

impl Mutant {
    /// The mutant's name in reports.
    pub const fn name(&self) -> &'static str {
        match self {
            Mutant::Plan(m) => m.name(),
            Mutant::Mesh(m) => m.name(),
            Mutant::Cells(m) => m.name(),
            Mutant::Shader(m) => m.name,
        }
    }

    /// All mutants.
    pub fn all() -> BTreeSet<Mutant> {
        let shaders = super::shader_mutants::ALL.iter().copied().map(Mutant::Shader);
        let meshes = MeshMutant::ALL.into_iter().map(Mutant::Mesh);
        let cells = CellsMutant::ALL.into_iter().map(Mutant::Cells);
        PlanMutant::ALL.into_iter().map(Mutant::Plan).chain(meshes).chain(cells).chain(shaders).collect()
    }
}

impl fmt::Display for Mutant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl From<PlanMutant> for Mutant {
    fn from(m: PlanMutant) -> Mutant {
        Mutant::Plan(m)
    }
}

impl From<MeshMutant> for Mutant {
    fn from(m: MeshMutant) -> Mutant {
        Mutant::Mesh(m)
    }
}

impl From<CellsMutant> for Mutant {
    fn from(m: CellsMutant) -> Mutant {
        Mutant::Cells(m)
    }
}

impl From<ShaderMutant> for Mutant {
    fn from(m: ShaderMutant) -> Mutant {
        Mutant::Shader(m)
    }
}
