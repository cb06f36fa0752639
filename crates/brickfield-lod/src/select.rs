//! From a view and criteria to a cut: the descent through the octree.

use brickfield_core::glam::UVec2;
use brickfield_core::{BrickId, BrickLayout, Camera, Cut, Grid, Level};

use crate::{Answer, Criterion, CriterionInView, Filter, Frustum, Tile};

/// From where, and through which picture, the volume is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera in the world.
    pub camera: Camera,
    /// Pixels of the picture along x and y.
    pub size: UVec2,
    /// Whether bricks that no ray can reach are ignored.
    pub culling: Culling,
}

/// Whether bricks that no ray of the picture can reach are ignored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Culling {
    /// They are ignored, at the coarsest level where the whole brick is out of reach.
    #[default]
    Frustum,
    /// They are selected like all others.
    Off,
}

/// A cut, and which of its bricks were ignored.
///
/// The ignored bricks are in the cut so that it tiles the volume. An ignored brick stands for its whole subtree. No ray
/// meets a brick that [`select_cut`] ignores, so it is neither uploaded nor sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    cut: Cut,
    is_ignored: Vec<bool>,
}

impl Selection {
    /// The bricks, drawn and ignored: they tile the volume exactly once.
    pub fn cut(&self) -> &Cut {
        &self.cut
    }

    /// Whether each brick of [`Cut::bricks`] is ignored, in that order.
    pub fn is_ignored(&self) -> &[bool] {
        &self.is_ignored
    }

    /// The bricks to draw.
    pub fn drawn(&self) -> impl Iterator<Item = BrickId> + Clone + '_ {
        self.answered(false)
    }

    /// The bricks that are not needed.
    pub fn ignored(&self) -> impl Iterator<Item = BrickId> + Clone + '_ {
        self.answered(true)
    }

    /// Number of drawn bricks per level, finest first.
    pub fn n_drawn_per_level(&self) -> Vec<usize> {
        let mut n = vec![0; usize::from(self.cut.layout().n_levels())];
        for id in self.drawn() {
            n[usize::from(id.level.0)] += 1;
        }
        n
    }

    fn answered(&self, ignored: bool) -> impl Iterator<Item = BrickId> + Clone + '_ {
        let pairs = self.cut.bricks().iter().zip(&self.is_ignored);
        pairs.filter(move |(_, is_ignored)| **is_ignored == ignored).map(|(id, _)| *id)
    }
}

/// The bricks that satisfy all of `criteria` in a view; cost is proportional to the bricks visited.
///
/// Depth first from the root (LaMar, Hamann and Joy 1999, section 4.1). `grid` says where the layout's samples lie. No
/// criterion is satisfied by all: the root is drawn, and every criterion that is added draws it finer or leaves it.
pub fn select_cut(layout: &BrickLayout, grid: &Grid, view: &View, criteria: &[Criterion]) -> Selection {
    let all = All(criteria.iter().map(|criterion| criterion.in_view(view)).collect());
    match view.culling {
        Culling::Frustum => select_by(layout, grid, Frustum::new(grid, &view.camera, view.size).and(all)),
        Culling::Off => select_by(layout, grid, all),
    }
}

/// The bricks that a filter asks for.
///
/// The filter is asked about the root, then about the children of every brick to which it says descend. A brick of level
/// 0 that it finds too coarse is drawn: there is nothing finer.
pub fn select_by<F: Filter>(layout: &BrickLayout, grid: &Grid, filter: F) -> Selection {
    let mut is_ignored = Vec::new();
    let cut = Cut::descend(*layout, F::Known::default(), |id, known| {
        let (answer, known) = filter.answer_knowing(&Tile::new(layout, grid, id), known);
        if answer == Answer::Descend && id.level > Level(0) {
            return Some(known);
        }
        is_ignored.push(answer == Answer::Ignore);
        None
    });
    Selection { cut, is_ignored }
}

/// Criteria that must all be satisfied.
struct All(Vec<CriterionInView>);

impl Filter for All {
    type Known = ();

    #[inline]
    fn answer_knowing(&self, tile: &Tile<'_>, (): ()) -> (Answer, ()) {
        let is_satisfied = self.0.iter().all(|criterion| criterion.answer(tile) == Answer::Render);
        (if is_satisfied { Answer::Render } else { Answer::Descend }, ())
    }
}
