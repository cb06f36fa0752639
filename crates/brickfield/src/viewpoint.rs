//! Cameras by name or by numbers, fitted to a volume.

use std::ops::Range;
use std::str::FromStr;

use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Camera, CameraError, Grid, Projection};
use brickfield_io::WorldFrame;

/// Where a picture is taken from, before the volume is known.
///
/// As text: a name (`oblique`, `front`, `back`, `left`, `right`, `top`, `bottom`) and/or fields, separated by blanks:
/// `from=X,Y,Z` (direction from the volume's centre to the eye), `eye=X,Y,Z`, `target=X,Y,Z`, `up=X,Y,Z` in world units,
/// `fov=DEGREES` (vertical) or `height=UNITS` (orthographic), `zoom=FACTOR`.
///
/// ```
/// let front: brickfield::Viewpoint = "front zoom=1.5".parse()?;
/// let inside: brickfield::Viewpoint = "eye=10,20,30 target=40,20,30 up=0,0,1 fov=60".parse()?;
/// # Ok::<(), brickfield::ViewpointError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Viewpoint {
    side: Option<Side>,
    from: Option<DVec3>,
    eye: Option<DVec3>,
    target: Option<DVec3>,
    up: Option<DVec3>,
    fov_degrees: Option<f64>,
    height: Option<f64>,
    zoom: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Side {
    #[default]
    Oblique,
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
}

/// Why a viewpoint is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum ViewpointError {
    #[error(
        "{word:?} is neither a view (oblique, front, back, left, right, top, bottom) nor from=, eye=, target=, up=, fov=, height=, zoom="
    )]
    Word { word: String },
    #[error("{field}={value:?} is not three finite numbers X,Y,Z")]
    Vector { field: String, value: String },
    #[error("{field}={value:?} is not {expected}")]
    Number { field: String, value: String, expected: &'static str },
    #[error("{first} and {second} exclude each other")]
    Both { first: &'static str, second: &'static str },
}

/// Vertical field of view where none is asked for, in degrees.
const FOV_DEGREES: f64 = 30.0;
/// Beyond it the eye stands at the target, as far as its numbers can tell.
const MAX_ZOOM: f64 = 1e6;
/// How much larger than the volume the picture is.
const MARGIN: f64 = 1.04;

impl FromStr for Viewpoint {
    type Err = ViewpointError;

    fn from_str(text: &str) -> Result<Viewpoint, ViewpointError> {
        let mut v = Viewpoint::default();
        for word in text.split_whitespace() {
            match word.split_once('=') {
                None => v.side = Some(side(word)?),
                Some(("from", value)) => v.from = Some(vector("from", value)?),
                Some(("eye", value)) => v.eye = Some(vector("eye", value)?),
                Some(("target", value)) => v.target = Some(vector("target", value)?),
                Some(("up", value)) => v.up = Some(vector("up", value)?),
                Some(("fov", value)) => {
                    v.fov_degrees = Some(number("fov", value, 0.0..180.0, "above 0 and below 180 degrees")?)
                }
                Some(("height", value)) => {
                    v.height = Some(number("height", value, 0.0..f64::INFINITY, "a finite number above 0")?)
                }
                Some(("zoom", value)) => v.zoom = Some(number("zoom", value, 0.0..MAX_ZOOM, "above 0 and below 1e6")?),
                Some(_) => return Err(ViewpointError::Word { word: word.to_owned() }),
            }
        }
        v.checked()
    }
}

impl Viewpoint {
    /// The camera for a volume on `grid`, for a picture of `size`. Numbers that are not stated are chosen so that the volume fills
    /// the picture, upright by `frame`.
    ///
    /// # Errors
    /// The errors of [`Camera::look_at`].
    pub fn camera(&self, grid: &Grid, frame: WorldFrame, size: UVec2) -> Result<Camera, CameraError> {
        let center = self.target.unwrap_or_else(|| grid.world_box().center());
        let (side_from, side_up) = side_directions(self.side.unwrap_or_default(), frame);
        let from = self.from.unwrap_or(side_from);
        let up = self.up.unwrap_or(side_up);
        let fov_y = self.fov_degrees.unwrap_or(FOV_DEGREES).to_radians();
        let perspective = Projection::Perspective { fov_y };
        let fit = Fit::of(grid, &Camera::look_at(center + from, center, up, perspective)?, center, size);
        let zoom = self.zoom.unwrap_or(1.0);
        if let Some(height) = self.height {
            let height = height / zoom;
            let eye = self.eye.unwrap_or(center + from.normalize_or_zero() * fit.depth * 1.1);
            return Camera::look_at(eye, center, up, Projection::Orthographic { height });
        }
        let distance = fit.distance(fov_y) * MARGIN / zoom;
        let eye = self.eye.unwrap_or(center + from.normalize_or_zero() * distance);
        Camera::look_at(eye, center, up, perspective)
    }

    /// Refuses what is wrong for any volume.
    ///
    /// # Errors
    /// The errors of [`Camera::look_at`].
    pub fn check(&self) -> Result<(), CameraError> {
        let (Some(eye), Some(target)) = (self.eye, self.target) else { return Ok(()) };
        // The direction that is up by default depends on the volume.
        let any_up = (target - eye).try_normalize().map_or(DVec3::Y, DVec3::any_orthogonal_vector);
        Camera::look_at(eye, target, self.up.unwrap_or(any_up), Projection::Orthographic { height: 1.0 }).map(drop)
    }

    fn checked(self) -> Result<Viewpoint, ViewpointError> {
        if self.from.is_some() && self.eye.is_some() {
            return Err(ViewpointError::Both { first: "from", second: "eye" });
        }
        if self.fov_degrees.is_some() && self.height.is_some() {
            return Err(ViewpointError::Both { first: "fov", second: "height" });
        }
        Ok(self)
    }
}

/// The measures of a volume from which the distance follows at which a camera sees all of it.
struct Fit {
    /// Corners relative to the centre: right (scaled to the height's share), up, towards the view.
    corners: [DVec3; 8],
    /// How far the nearest corner stands before the centre.
    depth: f64,
}

impl Fit {
    fn of(grid: &Grid, camera: &Camera, center: DVec3, size: UVec2) -> Fit {
        let aspect = f64::from(size.x) / f64::from(size.y);
        let corners = grid.index_box().corners().map(|c| {
            let p = grid.index_to_world().transform_point3(c) - center;
            DVec3::new(p.dot(camera.right()) / aspect, p.dot(camera.up()), p.dot(camera.forward()))
        });
        let depth = corners.iter().map(|c| -c.z).fold(0.0, f64::max);
        Fit { corners, depth }
    }

    /// Distance from the centre at which every corner is inside the picture.
    fn distance(&self, fov_y: f64) -> f64 {
        let tan = (0.5 * fov_y).tan();
        self.corners.iter().map(|c| c.x.abs().max(c.y.abs()) / tan - c.z).fold(0.0, f64::max)
    }
}

/// Direction from the centre to the eye, and up.
fn side_directions(side: Side, frame: WorldFrame) -> (DVec3, DVec3) {
    let (right, back, up) = match frame {
        // +x is the patient's left, which is to the right of a viewer in front.
        WorldFrame::Lps => (DVec3::X, DVec3::Y, DVec3::Z),
        // As the pictures of the stack are looked at.
        WorldFrame::Pictures => (DVec3::X, DVec3::Z, -DVec3::Y),
        // Nothing is known: x to the right, z up.
        WorldFrame::Plain => (DVec3::X, DVec3::Y, DVec3::Z),
    };
    match side {
        Side::Oblique => (right * 0.55 - back + up * 0.4, up),
        Side::Front => (-back, up),
        Side::Back => (back, up),
        Side::Left => (right, up),
        Side::Right => (-right, up),
        Side::Top => (up, back),
        Side::Bottom => (-up, back),
    }
}

fn side(word: &str) -> Result<Side, ViewpointError> {
    Ok(match word {
        "oblique" => Side::Oblique,
        "front" => Side::Front,
        "back" => Side::Back,
        "left" => Side::Left,
        "right" => Side::Right,
        "top" => Side::Top,
        "bottom" => Side::Bottom,
        _ => return Err(ViewpointError::Word { word: word.to_owned() }),
    })
}

fn vector(field: &str, value: &str) -> Result<DVec3, ViewpointError> {
    let numbers: Result<Vec<f64>, _> = value.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok([x, y, z]) if [x, y, z].iter().all(|n| n.is_finite()) => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(ViewpointError::Vector { field: field.to_owned(), value: value.to_owned() }),
    }
}

/// A number inside an open interval.
fn number(field: &str, value: &str, open: Range<f64>, expected: &'static str) -> Result<f64, ViewpointError> {
    let number = value.parse::<f64>().ok().filter(|n| open.start < *n && *n < open.end);
    number.ok_or_else(|| ViewpointError::Number { field: field.to_owned(), value: value.to_owned(), expected })
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::{DVec2, UVec3};

    fn grid() -> Grid {
        Grid::axis_aligned(UVec3::new(40, 20, 10), DVec3::new(1.0, 1.0, 2.0)).unwrap()
    }

    #[test]
    fn every_named_view_holds_all_corners() {
        let size = UVec2::new(300, 200);
        for name in ["oblique", "front", "back", "left", "right", "top", "bottom", "front height=60", "fov=70"] {
            let camera = name.parse::<Viewpoint>().unwrap().camera(&grid(), WorldFrame::Plain, size).unwrap();
            let rays = camera.pixel_rays(size);
            for corner in grid().world_box().corners() {
                let p = corner - camera.eye();
                let depth = if rays.depth() == 0.0 { 1.0 } else { p.dot(camera.forward()) };
                let plane = DVec2::new(p.dot(camera.right()), p.dot(camera.up())) / depth;
                let limit = rays.corner().abs();
                assert!(depth > 0.0 && plane.x.abs() <= limit.x && plane.y.abs() <= limit.y, "{name}");
            }
        }
    }

    #[test]
    fn bad_viewpoints_are_named() {
        let error = |text: &str| text.parse::<Viewpoint>().unwrap_err().to_string();
        assert!(error("sideways").contains("sideways"));
        assert!(error("eye=1,2").contains("eye=\"1,2\""));
        assert!(error("target=NaN,0,0").contains("finite"));
        assert!(error("fov=-3").contains("fov=\"-3\""));
        assert!(error("fov=500").contains("below 180"));
        assert!(error("zoom=1e300").contains("below 1e6"));
        assert!(error("fov=30 height=3").contains("exclude"));
        assert!(error("colour=red").contains("colour=red"));
    }
}
