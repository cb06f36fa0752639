//! From a view and a criterion to a cut: the descent through the octree.

use brickfield_core::glam::UVec2;
use brickfield_core::{BrickId, BrickLayout, Camera, Cut, Grid, Level, WorldPos};

use crate::tile::Ruler;
use crate::{Answer, Criterion, Frustum, Planes};

/// From where, and through which picture, the volume is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera in the world.
    pub camera: Camera,
    /// Pixels of the picture along x and y.
    pub size: UVec2,
    /// What happens to bricks that no ray can reach.
    pub culling: Culling,
}

/// What happens to bricks that no ray of the picture can reach.
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
/// The ignored bricks are in the cut so that it tiles the volume; no ray meets them, so they are neither uploaded nor
/// sampled. An ignored brick stands for its whole subtree.
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

    /// The bricks that no ray can reach.
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

/// The bricks that `criterion` asks for in a view; cost is proportional to the bricks visited.
///
/// Depth first from the root (LaMar, Hamann and Joy 1999, section 4.1). `grid` says where the layout's samples lie.
pub fn select_cut(layout: &BrickLayout, grid: &Grid, view: &View, criterion: &Criterion) -> Selection {
    let frustum = Frustum::new(grid, &view.camera, view.size);
    let (ruler, eye) = (Ruler::new(layout, grid), WorldPos(view.camera.eye()));
    let planes = match view.culling {
        Culling::Frustum => Planes::ALL,
        Culling::Off => Planes::NONE,
    };
    descend(layout, planes, |id, planes| match visible(&frustum, layout, id, planes) {
        None => (Answer::Ignore, planes),
        Some(planes) => (criterion.judge(id, || ruler.tile(id), eye), planes),
    })
}

/// The bricks that a filter of one's own asks for.
///
/// The filter is asked of the root, then of the children of every brick to which it says descend. A brick of level 0
/// that it finds too coarse is drawn: there is nothing finer.
pub fn select_by(layout: &BrickLayout, mut filter: impl FnMut(BrickId) -> Answer) -> Selection {
    descend(layout, (), |id, ()| (filter(id), ()))
}

/// The filter's second answer goes to the children.
fn descend<S: Copy>(layout: &BrickLayout, state: S, mut filter: impl FnMut(BrickId, S) -> (Answer, S)) -> Selection {
    let mut is_ignored = Vec::new();
    let cut = Cut::descend(*layout, state, |id, state| {
        let (answer, state) = filter(id, state);
        if answer == Answer::Descend && id.level > Level(0) {
            return Some(state);
        }
        is_ignored.push(answer == Answer::Ignore);
        None
    });
    Selection { cut, is_ignored }
}

#[inline]
fn visible(frustum: &Frustum, layout: &BrickLayout, id: BrickId, planes: Planes) -> Option<Planes> {
    if planes == Planes::NONE {
        return Some(planes);
    }
    frustum.crossed(&layout.index_box(id), planes)
}
