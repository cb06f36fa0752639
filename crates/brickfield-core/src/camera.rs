//! Cameras, and the ray of a pixel.

use glam::{DVec2, DVec3, UVec2};

use crate::{Aabb, Ray};

/// A camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    projection: Projection,
}

/// How rays leave the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All rays start at the eye; `fov_y` is the full vertical angle in radians, above 0 and below pi.
    #[allow(missing_docs)]
    Perspective { fov_y: f64 },
    /// All rays run along the view direction, from the plane through the eye; `height` is the picture's height in
    /// world units.
    #[allow(missing_docs)]
    Orthographic { height: f64 },
}

/// Why a camera could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum CameraError {
    #[error("camera {what} {value} is not finite")]
    NotFinite { what: &'static str, value: DVec3 },
    #[error("the camera's eye and target are both at {eye}")]
    NoDirection { eye: DVec3 },
    #[error("the camera's up vector {up} is parallel to its view direction {forward}, or zero")]
    Up { up: DVec3, forward: DVec3 },
    #[error("a vertical field of view of {degrees} degrees; it must be above 0 and below 180")]
    FieldOfView { degrees: f64 },
    #[error("an orthographic height of {height}; it must be finite and above 0")]
    Height { height: f64 },
}

impl Camera {
    /// A camera at `eye` that looks at `target`; `up` need not be orthogonal to the view direction.
    ///
    /// # Errors
    /// Numbers that are not finite, eye = target, up parallel to the view, a field of view or height out of range.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3, projection: Projection) -> Result<Camera, CameraError> {
        for (what, value) in [("eye", eye), ("target", target), ("up", up)] {
            if !value.is_finite() {
                return Err(CameraError::NotFinite { what, value });
            }
        }
        check_projection(projection)?;
        let forward = (target - eye).try_normalize().ok_or(CameraError::NoDirection { eye })?;
        let right = forward.cross(up.normalize_or_zero());
        if right.length() <= 1e-9 {
            return Err(CameraError::Up { up, forward });
        }
        let right = right.normalize();
        Ok(Camera { eye, forward, right, up: right.cross(forward), projection })
    }

    /// A perspective camera (40 degrees) that sees the whole box from direction `from` (box to eye).
    ///
    /// # Errors
    /// As [`look_at`](Self::look_at).
    pub fn framing(b: &Aabb, from: DVec3, up: DVec3) -> Result<Camera, CameraError> {
        let fov_y = 40f64.to_radians();
        let distance = 0.5 * b.diagonal() / (fov_y * 0.5).sin();
        let eye = b.center() + from.normalize_or_zero() * distance;
        Camera::look_at(eye, b.center(), up, Projection::Perspective { fov_y })
    }

    /// Where the camera stands.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Unit view direction.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// Unit vector to the right of the picture.
    pub fn right(&self) -> DVec3 {
        self.right
    }

    /// Unit vector to the top of the picture.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// How rays leave the camera.
    pub fn projection(&self) -> Projection {
        self.projection
    }

    /// The rays through the pixels of a picture of `size`.
    pub fn pixel_rays(&self, size: UVec2) -> PixelRays {
        let size = size.as_dvec2();
        let (half_height, depth) = match self.projection {
            Projection::Perspective { fov_y } => ((fov_y * 0.5).tan(), 1.0),
            Projection::Orthographic { height } => (height * 0.5, 0.0),
        };
        let pixel = 2.0 * half_height / size.y;
        PixelRays { camera: *self, corner: DVec2::new(-0.5 * size.x, 0.5 * size.y) * pixel, pixel, depth }
    }
}

/// The rays through the pixels of a picture.
///
/// The ray of pixel (x, y) passes the pixel's centre (x + 1/2, y + 1/2), y running down, pixels square. Its direction is
/// a unit vector in the world, its parameter t the distance from the eye (perspective) or the eye's plane (orthographic).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelRays {
    camera: Camera,
    corner: DVec2,
    pixel: f64,
    depth: f64,
}

impl PixelRays {
    /// The plane coordinates (right, up) of a picture position, in units of the plane at distance
    /// [`depth`](Self::depth).
    pub fn plane(&self, at: DVec2) -> DVec2 {
        self.corner + DVec2::new(at.x, -at.y) * self.pixel
    }

    /// Plane coordinates of the picture's upper left corner.
    pub fn corner(&self) -> DVec2 {
        self.corner
    }

    /// The side of a pixel in the plane.
    pub fn pixel(&self) -> f64 {
        self.pixel
    }

    /// Distance of the picture plane: 1 for perspective, 0 for orthographic.
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// The world ray of a picture position; pixel (x, y) has its centre at (x + 1/2, y + 1/2).
    #[inline]
    pub fn at(&self, at: DVec2) -> Ray {
        let c = &self.camera;
        let p = self.plane(at);
        let across = c.right * p.x + c.up * p.y;
        if self.depth == 0.0 {
            return Ray { origin: c.eye + across, direction: c.forward };
        }
        Ray { origin: c.eye, direction: (c.forward + across).normalize() }
    }

    /// The world ray of pixel (x, y).
    #[inline]
    pub fn pixel_ray(&self, x: u32, y: u32) -> Ray {
        self.at(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
    }
}

fn check_projection(projection: Projection) -> Result<(), CameraError> {
    match projection {
        Projection::Perspective { fov_y } if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) => {
            Err(CameraError::FieldOfView { degrees: fov_y.to_degrees() })
        }
        Projection::Orthographic { height } if !(height.is_finite() && height > 0.0) => {
            Err(CameraError::Height { height })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upper_left_pixel_looks_up_and_left() {
        let camera = Camera::look_at(DVec3::ZERO, -DVec3::Z, DVec3::Y, Projection::Perspective { fov_y: 1.0 }).unwrap();
        let ray = camera.pixel_rays(UVec2::new(4, 4)).pixel_ray(0, 0);
        assert!(ray.direction.x < 0.0 && ray.direction.y > 0.0 && ray.direction.z < 0.0);
        assert!((ray.direction.length() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn orthographic_rays_are_parallel_and_a_pixel_apart() {
        let camera =
            Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Z, Projection::Orthographic { height: 8.0 }).unwrap();
        let rays = camera.pixel_rays(UVec2::new(8, 4));
        assert_eq!(rays.pixel_ray(3, 1).direction, DVec3::X);
        assert_eq!((rays.pixel_ray(4, 1).origin - rays.pixel_ray(3, 1).origin).length(), 2.0);
    }

    #[test]
    fn bad_cameras_are_named() {
        let error = |eye, up, projection| Camera::look_at(eye, DVec3::ZERO, up, projection).unwrap_err().to_string();
        let p = Projection::Perspective { fov_y: 1.0 };
        assert!(error(DVec3::ZERO, DVec3::Y, p).contains("both at"));
        assert!(error(DVec3::Y, DVec3::Y, p).contains("parallel"));
        assert!(error(DVec3::X, DVec3::Y, Projection::Perspective { fov_y: 4.0 }).contains("229"));
        assert!(error(DVec3::NAN, DVec3::Y, p).contains("eye"));
        assert!(error(DVec3::X, DVec3::Y, Projection::Orthographic { height: 0.0 }).contains("height of 0"));
    }
}
