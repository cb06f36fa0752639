//! A scene that a backend renders, from the scene to the picture in memory.

use std::time::Instant;

use brickfield::bricks::{BlockSource, BrickTree};
use brickfield::frame::{Backend, FramePlan, RenderError, Timing};
use brickfield::{
    BlockResidency, BlockStyle, PrepareBlocksError, PrepareError, PrepareTrimmedError, Residency, Scene, TrimResidency,
    TrimmedVolume, Trimming, prepare, prepare_blocks, prepare_trimmed,
};
use brickfield_core::{Image, Level};

use super::Turn;

/// A scene of a tree or of flat blocks, and the slots of its bricks or blocks.
pub struct Contestant<'a> {
    subject: Subject<'a>,
    scene: Scene,
}

/// What a contestant draws, and what of it is resident.
enum Subject<'a> {
    Tree(&'a BrickTree, Box<Residency>),
    Blocks(&'a dyn BlockSource, Vec<Level>, BlockStyle, Box<BlockResidency>),
    Trimmed(&'a TrimmedVolume, Trimming, Box<TrimResidency>),
}

/// A frame and its times in milliseconds.
pub struct TimedFrame {
    /// The plan that the backend replayed.
    pub plan: FramePlan,
    /// The picture.
    pub image: Image<f32>,
    /// From the scene to the plan: selection, order, polygons.
    pub prepare_ms: f64,
    /// From the scene to the picture.
    pub ms: f64,
    /// The backend's part of it.
    pub timing: Timing,
    /// Bytes that were brought to the device.
    pub uploaded_bytes: u64,
}

/// Why there is no frame.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum FrameError {
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    #[error(transparent)]
    PrepareBlocks(#[from] PrepareBlocksError),
    #[error(transparent)]
    PrepareTrimmed(#[from] PrepareTrimmedError),
    #[error("{backend}: {source}")]
    Render { backend: &'static str, source: RenderError },
}

impl<'a> Contestant<'a> {
    /// A scene whose bricks no backend has yet.
    pub fn new(tree: &'a BrickTree, scene: Scene) -> Contestant<'a> {
        Contestant { subject: Subject::Tree(tree, Box::default()), scene }
    }

    /// A scene of flat blocks at some levels, of which no backend has any yet.
    pub fn of_blocks(source: &'a dyn BlockSource, levels: Vec<Level>, style: BlockStyle, scene: Scene) -> Self {
        Contestant { subject: Subject::Blocks(source, levels, style, Box::default()), scene }
    }

    /// A scene of trimmed bricks that no backend has yet.
    pub fn of_trimmed(volume: &'a TrimmedVolume, trimming: Trimming, scene: Scene) -> Contestant<'a> {
        Contestant { subject: Subject::Trimmed(volume, trimming, Box::default()), scene }
    }

    /// Renders a frame. The bricks are resident if the backend's frame before was this contestant's, too; if not, the time
    /// includes their upload.
    ///
    /// # Errors
    /// A scene that is refused, a backend that fails.
    pub fn frame(&mut self, backend: &mut dyn Backend) -> Result<TimedFrame, FrameError> {
        let begin = Instant::now();
        let plan = match &mut self.subject {
            Subject::Tree(tree, residency) => prepare(tree, &self.scene, residency)?,
            Subject::Blocks(source, levels, style, residency) => {
                prepare_blocks(*source, &self.scene, levels, *style, residency)?
            }
            Subject::Trimmed(volume, trimming, residency) => {
                prepare_trimmed(volume, &self.scene, *trimming, residency)?
            }
        };
        rendered(begin, plan, backend)
    }

    /// Takes a turn. The bricks are resident in a timed one: unless the turn before was this contestant's, a frame that is not
    /// timed brings them.
    ///
    /// # Errors
    /// As [`Contestant::frame`].
    pub fn take(&mut self, turn: Turn, backend: &mut dyn Backend) -> Result<TimedFrame, FrameError> {
        if !turn.warms_up() && !turn.again {
            self.frame(backend)?;
        }
        self.frame(backend)
    }
}

/// A frame of a scene of a tree, whose bricks have the slots of `residency`.
///
/// # Errors
/// A scene that is refused, a backend that fails.
pub fn tree_frame(
    tree: &BrickTree,
    scene: &Scene,
    residency: &mut Residency,
    backend: &mut (impl Backend + ?Sized),
) -> Result<TimedFrame, FrameError> {
    let begin = Instant::now();
    rendered(begin, prepare(tree, scene, residency)?, backend)
}

/// Renders a plan that was being prepared since `begin`.
fn rendered(begin: Instant, plan: FramePlan, backend: &mut (impl Backend + ?Sized)) -> Result<TimedFrame, FrameError> {
    let prepare_ms = milliseconds_since(begin);
    let name = backend.describe().backend;
    let frame = backend.render(&plan).map_err(|source| FrameError::Render { backend: name, source })?;
    let (ms, timing, uploaded_bytes) = (milliseconds_since(begin), frame.timing, frame.uploaded_bytes);
    Ok(TimedFrame { plan, image: frame.image, prepare_ms, ms, timing, uploaded_bytes })
}

fn milliseconds_since(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}
