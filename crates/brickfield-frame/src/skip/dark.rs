//! The regions of a field that are known to be dark.

use std::sync::Arc;

use super::{KeptBoxes, Occupancy, Overview};
use crate::{Chunked, ContentId, Field, Places};

/// The regions of a field that are dark under a transfer function; shared between frames. To leave them out changes no sample.
#[derive(Clone, Debug, Default)]
pub struct DarkRegions {
    /// Index and slots of the field that it was made for.
    of: Option<[ContentId; 2]>,
    occupancy: Option<Arc<Occupancy>>,
    overview: Option<Arc<Overview>>,
    kept: Option<Arc<KeptBoxes>>,
}

/// Regions of another field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum DarkError {
    #[error("slot {slot} has no distances of macrocells: the occupancy is of other bricks")]
    NoDistances { slot: u32 },
    #[error("distances of macrocells in bricks of {side} samples, for a field of other slots")]
    OtherBricks { side: u32 },
    #[error("{n_boxes} boxes of trimmed bricks for a field of {n_slots} slots that a table has")]
    OtherBoxes { n_boxes: usize, n_slots: u32 },
}

impl DarkRegions {
    /// The dark regions of a field: the empty blocks of its index, and the macrocells that are known to be dark; with an overview
    /// of both for evenly placed bricks.
    ///
    /// Cost: some milliseconds for the overview.
    ///
    /// # Errors
    /// An occupancy of other bricks than the field's.
    pub fn new(field: &Field, occupancy: Option<Arc<Occupancy>>) -> Result<DarkRegions, DarkError> {
        let of = Some(DarkRegions::key(field));
        let Some(side) = field.slots().brick_side() else {
            return match occupancy {
                Some(o) => Err(DarkError::OtherBricks { side: o.side().n_samples() }),
                None => Ok(DarkRegions { of, ..DarkRegions::default() }),
            };
        };
        if let Some(occupancy) = &occupancy {
            if occupancy.side() != side {
                return Err(DarkError::OtherBricks { side: occupancy.side().n_samples() });
            }
            if let Some(slot) = field.index().slots().find(|slot| !occupancy.has(*slot)) {
                return Err(DarkError::NoDistances { slot });
            }
        }
        let overview = Overview::of(side, field.index(), occupancy.as_deref()).map(Arc::new);
        Ok(DarkRegions { of, occupancy, overview, kept: None })
    }

    /// The dark regions of a field of trimmed bricks: the empty blocks of its index, and in others all that lies beside their boxes.
    ///
    /// # Errors
    /// If the field's slots have no table of places, or there is not one box for each.
    pub fn beside_boxes(field: &Field, kept: Arc<KeptBoxes>) -> Result<DarkRegions, DarkError> {
        let n_slots = match field.slots().places() {
            Places::Table { .. } => field.slots().n_slots(),
            Places::Even(_) | Places::Blocks(_) => 0,
        };
        if kept.boxes().len() != n_slots as usize {
            return Err(DarkError::OtherBoxes { n_boxes: kept.boxes().len(), n_slots });
        }
        Ok(DarkRegions { of: Some(DarkRegions::key(field)), kept: Some(kept), ..DarkRegions::default() })
    }

    /// Whether the regions are of this field. The default, without any region, is of every field.
    pub fn is_of(&self, field: &Field) -> bool {
        self.of.is_none_or(|of| of == DarkRegions::key(field))
    }

    /// The macrocells that are dark, if any are known to be.
    pub fn occupancy(&self) -> Option<&Arc<Occupancy>> {
        self.occupancy.as_ref()
    }

    /// The boxes beside which trimmed bricks are dark, if they are known.
    pub fn kept(&self) -> Option<&Arc<KeptBoxes>> {
        self.kept.as_ref()
    }

    /// The distances over the whole field, if anything is known to be dark.
    pub fn overview(&self) -> Option<&Arc<Overview>> {
        self.overview.as_ref()
    }

    fn key(field: &Field) -> [ContentId; 2] {
        [field.index().id(), field.slots().id()]
    }
}
