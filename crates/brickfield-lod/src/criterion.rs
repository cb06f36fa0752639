//! When a tile is fine enough, as plain data and measured in a view.

use std::f64::consts::PI;

use brickfield_core::glam::{DVec2, DVec3};
use brickfield_core::{Level, Projection, WorldPos};

use crate::{Answer, Filter, Tile, View};

/// When a tile is fine enough to be drawn, as a scene states it.
///
/// Tiles of level 0 are: there is nothing finer. With NaN no others are.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Criterion {
    /// Only level 0 is.
    FullResolution,
    /// This level is, and finer ones; the root always is.
    Uniform(Level),
    /// A tile is whose centre lies farther from the eye than `factor` times its diagonal, both in world units
    /// (LaMar, Hamann and Joy 1999, section 4.1: factor 1). The eye of an orthographic camera counts, too.
    ///
    /// A greater factor draws finer tiles: infinity level 0, below 0 the root.
    #[allow(missing_docs)]
    Distance { factor: f64 },
    /// As [`Distance`](Criterion::Distance), from a point of interest instead of the eye (LaMar, Hamann and Joy 1999,
    /// figures 4 and 5). All tiles are far from a point at infinity.
    #[allow(missing_docs)]
    DistanceFrom { point: WorldPos, factor: f64 },
    /// A tile is whose projected angle lies below `fraction` of the picture's vertical field of view (LaMar, Hamann and
    /// Joy 1999, section 4.1 and figure 6: 1/2). That it meets the view frustum is left to [`Culling`](crate::Culling).
    ///
    /// The projected angle is the greatest angle, at the eye, between two of the tile's eight corners. No tile that holds
    /// the eye is fine enough. Orthographic: the tile's longest diagonal in the picture must be shorter than `fraction`
    /// of the picture's height.
    ///
    /// A smaller fraction draws finer tiles: 0 and less level 0; infinity the root, or the coarsest tiles that do not
    /// hold the eye.
    #[allow(missing_docs)]
    FieldOfView { fraction: f64 },
    /// A tile is whose voxels appear at most `pixels` long where the tile is nearest.
    ///
    /// The longest edge of a voxel of the tile's level is divided by the side of a pixel at the tile's least depth, along
    /// the view direction. No tile that reaches the plane through the eye is fine enough. Orthographic: pixels have one
    /// size.
    ///
    /// Fewer pixels draw finer tiles: 0 and less level 0; infinity the root, or the coarsest tiles before the eye.
    #[allow(missing_docs)]
    ScreenSpaceError { pixels: f64 },
}

impl Criterion {
    /// The filter that asks for the criterion in a view: it renders or descends, and never ignores.
    pub fn in_view(&self, view: &View) -> CriterionInView {
        let eye = WorldPos(view.camera.eye());
        CriterionInView(match *self {
            Criterion::FullResolution => Law::Level { coarsest: Level(0) },
            Criterion::Uniform(level) => Law::Level { coarsest: level },
            Criterion::Distance { factor } => Law::Farther { point: eye, factor },
            Criterion::DistanceFrom { point, factor } => Law::Farther { point, factor },
            Criterion::FieldOfView { fraction } => field_of_view(view, fraction),
            Criterion::ScreenSpaceError { pixels } => screen_space_error(view, pixels),
        })
    }
}

/// A criterion, with the numbers of a view that it needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CriterionInView(Law);

/// Lengths in world units; `eye` and `forward` are the camera's.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    Level { coarsest: Level },
    Farther { point: WorldPos, factor: f64 },
    AngleBelow { eye: WorldPos, chord_squared: f64 },
    ProjectionBelow { right: DVec3, up: DVec3, length: f64 },
    VoxelAtDepth { eye: WorldPos, forward: DVec3, length_per_depth: f64 },
    Voxel { length: f64 },
}

impl Filter for CriterionInView {
    type Known = ();

    #[inline]
    fn answer_knowing(&self, tile: &Tile<'_>, (): ()) -> (Answer, ()) {
        let is_fine_enough = tile.id().level == Level(0) || self.0.holds(tile);
        (if is_fine_enough { Answer::Render } else { Answer::Descend }, ())
    }
}

impl Law {
    fn holds(&self, tile: &Tile<'_>) -> bool {
        match *self {
            Law::Level { coarsest } => tile.id().level <= coarsest,
            Law::Farther { point, factor } => tile.center().0.distance(point.0) > factor * tile.diagonal_world(),
            Law::AngleBelow { eye, chord_squared } => is_angle_below(tile, eye, chord_squared),
            Law::ProjectionBelow { right, up, length } => projected_diagonal(tile, right, up) < length,
            Law::VoxelAtDepth { eye, forward, length_per_depth } => {
                tile.voxel_world() <= length_per_depth * tile.least_depth_world(eye, forward).max(0.0)
            }
            Law::Voxel { length } => tile.voxel_world() <= length,
        }
    }
}

/// Angles are compared by their chords in the unit circle, 2 sin(angle / 2), which are as accurate for small ones.
fn field_of_view(view: &View, fraction: f64) -> Law {
    let (eye, right, up) = (WorldPos(view.camera.eye()), view.camera.right(), view.camera.up());
    match view.camera.projection() {
        Projection::Orthographic { height } => Law::ProjectionBelow { right, up, length: fraction * height },
        Projection::Perspective { fov_y } if fraction * fov_y > PI => {
            Law::AngleBelow { eye, chord_squared: f64::INFINITY }
        }
        Projection::Perspective { fov_y } => {
            let chord = 2.0 * (0.5 * (fraction * fov_y).max(0.0)).sin();
            Law::AngleBelow { eye, chord_squared: chord * chord }
        }
    }
}

fn screen_space_error(view: &View, pixels: f64) -> Law {
    let length = pixels * view.camera.pixel_rays(view.size).pixel();
    match view.camera.projection() {
        Projection::Orthographic { .. } => Law::Voxel { length },
        Projection::Perspective { .. } => {
            let (eye, forward) = (WorldPos(view.camera.eye()), view.camera.forward());
            Law::VoxelAtDepth { eye, forward, length_per_depth: length }
        }
    }
}

/// Most tiles are so far that the sphere around them appears below the angle: its chord is diagonal / distance.
fn is_angle_below(tile: &Tile<'_>, eye: WorldPos, chord_squared: f64) -> bool {
    let diagonal_squared = tile.diagonal_world().powi(2);
    if diagonal_squared < chord_squared.min(2.0) * tile.center().0.distance_squared(eye.0) {
        return true;
    }
    greatest_chord_squared(tile, eye) < chord_squared && !tile.contains(eye)
}

fn greatest_chord_squared(tile: &Tile<'_>, eye: WorldPos) -> f64 {
    let toward = tile.corners().map(|corner| (corner.0 - eye.0).normalize_or_zero());
    let pairs = toward.iter().enumerate().flat_map(|(i, a)| toward[..i].iter().map(move |b| a.distance_squared(*b)));
    pairs.fold(0.0, f64::max)
}

/// Of two corners of a parallelepiped the farthest apart in a picture are opposite ones.
fn projected_diagonal(tile: &Tile<'_>, right: DVec3, up: DVec3) -> f64 {
    let lengths = tile.diagonals_world().map(|d| DVec2::new(d.dot(right), d.dot(up)).length_squared());
    lengths.into_iter().fold(0.0, f64::max).sqrt()
}
