//! The algorithms that are compared.

use brickfield::frame::FramePlan;
use brickfield::trim::{FirstMerge, MergeOptions};
use brickfield::{Residency, Scene, TrimResidency, Trimming, prepare, prepare_trimmed};
use brickfield_core::BrickSide;

use super::data::DataSet;
use crate::paper::PaperError;
use crate::turns::Contestant;

/// An algorithm of the paper, or an alternative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Algorithm {
    Trimmed(&'static str, Trimming),
    /// The octree's finest level: bricks by arithmetic, with what else leaves out dark samples.
    Octree,
}

impl Algorithm {
    /// The first is the paper's I, to which others are compared.
    pub(super) fn all(side: BrickSide) -> Vec<Algorithm> {
        let horizontal = MergeOptions::of_bricks(side);
        let vertical = MergeOptions { first: FirstMerge::Vertical, ..horizontal };
        vec![
            Algorithm::Trimmed("I: conventional", Trimming::Conventional),
            Algorithm::Trimmed("II: envelope", Trimming::Envelope),
            Algorithm::Trimmed("III: trimmed alone", Trimming::Alone),
            Algorithm::Trimmed("IV: merged", Trimming::Merged(horizontal)),
            Algorithm::Trimmed("IV, vertical first", Trimming::Merged(vertical)),
            Algorithm::Trimmed("all axes, packed", Trimming::Packed),
            Algorithm::Trimmed("min-max per brick", Trimming::Visible),
            Algorithm::Octree,
        ]
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Algorithm::Trimmed(name, _) => name,
            Algorithm::Octree => "macrocells, beams",
        }
    }

    /// The plan of a scene of which nothing is prepared yet.
    pub(super) fn plan(self, data: &DataSet, scene: &Scene) -> Result<FramePlan, PaperError> {
        Ok(match self {
            Algorithm::Trimmed(_, trimming) => {
                prepare_trimmed(&data.trimmed, scene, trimming, &mut TrimResidency::default())?
            }
            Algorithm::Octree => prepare(&data.tree, scene, &mut Residency::default())?,
        })
    }

    pub(super) fn contestant(self, data: &DataSet, scene: Scene) -> Contestant<'_> {
        match self {
            Algorithm::Trimmed(_, trimming) => Contestant::of_trimmed(&data.trimmed, trimming, scene),
            Algorithm::Octree => Contestant::new(&data.tree, scene),
        }
    }
}
