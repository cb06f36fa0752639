//! The regions of a field that are known to be dark.

use std::sync::Arc;

use super::{Occupancy, Overview};
use crate::{Chunked, ContentId, Field};

/// The regions of a field that are dark under a transfer function; shared between frames. To leave them out changes no sample.
#[derive(Clone, Debug, Default)]
pub struct DarkRegions {
    /// Index and slots of the field that it was made for.
    of: Option<[ContentId; 2]>,
    occupancy: Option<Arc<Occupancy>>,
    overview: Option<Arc<Overview>>,
}

/// An occupancy of another field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum DarkError {
    #[error("slot {slot} has no distances of macrocells: the occupancy is of other bricks")]
    NoDistances { slot: u32 },
    #[error("distances of macrocells in bricks of {side} samples, for a field of other slots")]
    OtherBricks { side: u32 },
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
                None => Ok(DarkRegions { of, occupancy: None, overview: None }),
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
        Ok(DarkRegions { of, occupancy, overview })
    }

    /// Whether the regions are of this field. The default, without any region, is of every field.
    pub fn is_of(&self, field: &Field) -> bool {
        self.of.is_none_or(|of| of == DarkRegions::key(field))
    }

    /// The macrocells that are dark, if any are known to be.
    pub fn occupancy(&self) -> Option<&Arc<Occupancy>> {
        self.occupancy.as_ref()
    }

    /// The distances over the whole field, if anything is known to be dark.
    pub fn overview(&self) -> Option<&Arc<Overview>> {
        self.overview.as_ref()
    }

    fn key(field: &Field) -> [ContentId; 2] {
        [field.index().id(), field.slots().id()]
    }
}
