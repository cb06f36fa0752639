//! Why a part of a paper's comparisons could not be run.

use std::io;
use std::path::PathBuf;

use crate::compare::CompareError;
use crate::turns::FrameError;

/// Why a part of a paper's comparisons could not be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PaperError {
    #[error("no data: set BRICKFIELD_DATA (or --data) to the folder of real volumes")]
    NoData,
    #[error("no data: {} is not a folder; BRICKFIELD_DATA (or --data) names that of real volumes", path.display())]
    NoFolder { path: PathBuf },
    #[error("no data: {} does not exist", path.display())]
    NoVolume { path: PathBuf },
    #[error("--only {only}: no data set's path contains that; there are {known}")]
    NoSuchData { only: String, known: String },
    #[error(transparent)]
    Volume(#[from] brickfield::io::OpenError),
    #[error("{} is no terrain: heights over an even grid", path.display())]
    NotTerrain { path: PathBuf },
    #[error(transparent)]
    Surface(#[from] brickfield::SurfaceError),
    #[error(transparent)]
    Cells(#[from] brickfield::frame::CellsError),
    #[error(transparent)]
    CellsPlan(#[from] brickfield::frame::CellsPlanError),
    #[error("--out {}: {source}", path.display())]
    Out { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Backends(Box<CompareError>),
    #[error(transparent)]
    Tree(#[from] brickfield::bricks::BuildError),
    #[error(transparent)]
    Camera(#[from] brickfield_core::CameraError),
    #[error(transparent)]
    Prepare(#[from] brickfield::PrepareError),
    #[error(transparent)]
    PrepareBlocks(#[from] brickfield::PrepareBlocksError),
    #[error(transparent)]
    PrepareTrimmed(#[from] brickfield::PrepareTrimmedError),
    #[error(transparent)]
    Trim(#[from] brickfield::trim::MergeError),
    #[error(transparent)]
    Store(#[from] brickfield::trim::PackError),
    #[error(transparent)]
    Blocks(#[from] brickfield::bricks::BlockBuildError),
    #[error(transparent)]
    Errors(#[from] brickfield::lod::EstimateError),
    #[error(transparent)]
    Budget(#[from] brickfield::lod::BudgetError),
    #[error(transparent)]
    Pack(#[from] brickfield::PackError),
    #[error(transparent)]
    Fetch(#[from] brickfield::bricks::FetchError),
    #[error(transparent)]
    Delivery(#[from] brickfield::delivery::DeliveryError),
    #[error(transparent)]
    Client(#[from] brickfield::fetch::FetchError),
    #[error(transparent)]
    Serve(#[from] brickfield::serve::ServeError),
    #[error(transparent)]
    Shader(#[from] brickfield_shaders::ShaderError),
    #[error("a backend that was there: {source}")]
    Reopen { source: brickfield::BackendError },
    #[error("a process of its own: {what}")]
    OwnProcess { what: String },
    #[error("{backend} cannot evaluate single functions")]
    NoFunctions { backend: &'static str },
    #[error("{backend}: {source}")]
    Render { backend: &'static str, source: brickfield::frame::RenderError },
    #[error(transparent)]
    Metric(#[from] crate::metrics::MetricError),
    #[error(transparent)]
    Rule(#[from] crate::conformance::Complaint),
    #[error(transparent)]
    Picture(#[from] brickfield::PictureError),
    #[error("standard output: {0}")]
    Print(io::Error),
}

impl From<CompareError> for PaperError {
    fn from(e: CompareError) -> PaperError {
        PaperError::Backends(Box::new(e))
    }
}

impl From<FrameError> for PaperError {
    fn from(e: FrameError) -> PaperError {
        match e {
            FrameError::Prepare(e) => PaperError::Prepare(e),
            FrameError::PrepareBlocks(e) => PaperError::PrepareBlocks(e),
            FrameError::PrepareTrimmed(e) => PaperError::PrepareTrimmed(e),
            FrameError::Render { backend, source } => PaperError::Render { backend, source },
        }
    }
}

impl PaperError {
    /// The exit status that scripts see: 1 failed, 2 unusable arguments or data, 3 a required backend is absent.
    pub fn status(&self) -> u8 {
        match self {
            PaperError::Backends(e) => e.status(),
            PaperError::NoData
            | PaperError::NoFolder { .. }
            | PaperError::NoVolume { .. }
            | PaperError::NoSuchData { .. }
            | PaperError::Prepare(_) => 2,
            _ => 1,
        }
    }
}
