//! A volume that a paper's comparisons draw.

use std::path::Path;
use std::sync::Arc;

use brickfield::io::{OpenOptions, WorldFrame, open};
use brickfield::optics::automatic;
use brickfield_core::glam::UVec3;
use brickfield_core::{ScalarType, TransferFunction, Volume};

use super::PaperError;
use crate::volumes::{Phantom, phantom_of};

/// A volume with its name in tables and its transfer function.
#[derive(Clone)]
pub(crate) struct Subject {
    pub(crate) name: String,
    pub(crate) volume: Arc<Volume>,
    pub(crate) transfer: TransferFunction,
    pub(crate) frame: WorldFrame,
}

impl Subject {
    /// A file, with an automatic transfer function.
    pub(crate) fn of_file(name: String, path: &Path) -> Result<Subject, PaperError> {
        let opened = open(path, &OpenOptions::default())?;
        let transfer = automatic(&opened.volume);
        Ok(Subject { name, volume: Arc::new(opened.volume), transfer, frame: opened.frame })
    }

    /// The phantom, of so many voxels along each side.
    pub(crate) fn of_phantom(side: u32, scalar: ScalarType) -> Subject {
        let Phantom { volume, transfer, .. } = phantom_of(UVec3::splat(side), scalar);
        Subject { name: format!("generated {side}^3"), volume: Arc::new(volume), transfer, frame: WorldFrame::Lps }
    }
}
