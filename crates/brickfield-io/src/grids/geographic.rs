//! Longitudes and latitudes in degrees as metres on a sphere.

use brickfield_core::GridPoints;
use brickfield_core::glam::{DVec2, DVec3, UVec2};

use crate::{GridNote, ReadError};

/// Metres: the mean radius R1 = (2a + b) / 3 of the ellipsoid GRS 80 (Moritz 2000, "Geodetic Reference System 1980").
///
/// A degree of latitude is 111,195.08 m. On the ellipsoid it has 110,574 m at the equator and 111,694 m at the poles.
pub const EARTH_RADIUS_M: f64 = 6_371_008.771_4;

/// Even nodes of one layer, in degrees or in lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GeoPlacement {
    pub(crate) n_nodes: UVec2,
    /// Where node (0, 0) lies: longitude and latitude, or easting and northing.
    pub(crate) first: DVec2,
    pub(crate) steps: [DVec2; 2],
}

/// What the coordinates of a placement are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Horizontal {
    Degrees,
    Lengths,
}

impl GeoPlacement {
    /// The points, with a note where degrees became metres.
    ///
    /// # Errors
    /// Nodes beyond a pole.
    pub(crate) fn points(self, horizontal: Horizontal, notes: &mut Vec<GridNote>) -> Result<GridPoints, ReadError> {
        let placed = match horizontal {
            Horizontal::Degrees => self.in_metres(notes)?,
            Horizontal::Lengths => self,
        };
        let [i, j] = placed.steps.map(|step| step.extend(0.0));
        Ok(GridPoints::Even { origin: placed.first.extend(0.0), steps: [i, j, DVec3::Z] })
    }

    /// Metres east and north of the most western and the most southern node, on a sphere of [`EARTH_RADIUS_M`]; longitudes
    /// are scaled by the cosine of the middle latitude.
    fn in_metres(self, notes: &mut Vec<GridNote>) -> Result<GeoPlacement, ReadError> {
        let [low, high] = self.bounds();
        // Outer corners of pixels may lie at a pole, and their centres a rounding error beyond it.
        const MOST: f64 = 90.0 + 1e-6;
        if !(low.y >= -MOST && high.y <= MOST) {
            let value = format!("{} to {}", low.y, high.y);
            return Err(ReadError::field("range of latitudes", value, "-90 to 90"));
        }
        let scale_latitude = 0.5 * (low.y + high.y);
        let degree = EARTH_RADIUS_M.to_radians();
        let scale = DVec2::new(degree * scale_latitude.to_radians().cos(), degree);
        notes.push(GridNote::Degrees { west: low.x, south: low.y, scale_latitude });
        Ok(GeoPlacement { first: (self.first - low) * scale, steps: self.steps.map(|step| step * scale), ..self })
    }

    /// The least and the greatest coordinates of its corners.
    fn bounds(self) -> [DVec2; 2] {
        let [i, j] = self.steps;
        let last = (self.n_nodes - 1).as_dvec2();
        let corners = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE]
            .map(|corner| self.first + i * (corner.x * last.x) + j * (corner.y * last.y));
        let low = corners.into_iter().fold(corners[0], DVec2::min);
        [low, corners.into_iter().fold(corners[0], DVec2::max)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degree_at_sixty_north_is_half_as_wide() {
        let n_nodes = UVec2::new(3, 3);
        let steps = [DVec2::X * 0.5, DVec2::Y * 0.5];
        let placement = GeoPlacement { n_nodes, first: DVec2::new(7.0, 59.5), steps };
        let mut notes = Vec::new();
        let points = placement.points(Horizontal::Degrees, &mut notes).unwrap();
        let GridPoints::Even { origin, steps: [i, j, _] } = points else { panic!("{points:?}") };
        assert_eq!(origin, DVec3::ZERO);
        assert!((i.x - 0.25 * 111_195.08).abs() < 0.01 && (j.y - 0.5 * 111_195.08).abs() < 0.01, "{i} {j}");
        assert_eq!(notes, [GridNote::Degrees { west: 7.0, south: 59.5, scale_latitude: 60.0 }]);
        let beyond = GeoPlacement { first: DVec2::new(0.0, 89.5), ..placement };
        let said = beyond.points(Horizontal::Degrees, &mut notes).unwrap_err().to_string();
        assert_eq!(said, "range of latitudes is \"89.5 to 90.5\"; expected -90 to 90");
    }
}
