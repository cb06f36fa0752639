//! The scenes: three generated volumes, or a file; each with a camera and a transfer function.
//!
//! The volumes fill the cube [-1, 1]^3, whose first and last samples lie on its faces. Their values are spread over 0 to 255.
//!
//! - `blobs`: fourteen Gaussian balls, and around them a shell with a hole.
//! - `sharp`: the same shapes, with a surface a voxel and a half thick.
//! - `ml`: the signal of Marschner and Lobb 1994.

use std::fmt;
use std::path::Path;
use std::str::FromStr;

use brickfield::core::glam::{DMat3, DVec3, UVec3};
use brickfield::core::{Camera, Grid, IndexPos, Knot, Projection, TransferFunction, Volume, Voxels};
use brickfield::io::{Opened, WorldFrame};
use brickfield::options::{InputOptions, OptionError, ViewOptions};
use rayon::prelude::*;
use serde::Serialize;

use super::PeersError;
use super::protocol::View;
use crate::volumes::FieldFormula;

/// A generated volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Generated {
    Blobs,
    Ml,
    Sharp,
}

/// A volume, how it is seen and what shows.
pub(super) struct Subject {
    pub(super) name: String,
    /// Sample (0, 0, 0) lies at the world's origin, and the world's axes are the volume's.
    pub(super) volume: Volume,
    pub(super) transfer: TransferFunction,
    pub(super) view: View,
    pub(super) fov_degrees: f64,
}

/// Centre, standard deviation and peak of the balls.
const BALLS: [([f64; 3], f64, f64); 14] = [
    ([-0.09957359435691115, 0.26438939213058976, -0.5998627502191861], 0.14930323444213917, 0.5733779454085566),
    ([-0.48919368627744264, -0.37648774634679494, -0.18532712754834268], 0.1615797716499871, 0.7694083670016785),
    ([-0.09696658271604619, 0.22226340047611137, -0.35465730032217907], 0.22415526673082292, 0.5136937965989631),
    ([0.20456101221408263, -0.09923423715944768, 0.07042779413490197], 0.12825030201738039, 0.5990507445424393),
    ([0.360893482410644, 0.5619138908632769, -0.22389098620890857], 0.20000194003701083, 0.9381945761480192),
    ([0.4735279962046167, -0.49794694635626646, -0.5531342601205411], 0.13207795454339397, 0.9390712517147066),
    ([-0.48198379940033986, -0.09467084999393738, 0.5494674361806023], 0.17931148704649222, 0.8459385569752367),
    ([-0.22138124279272448, 0.22380111321790042, 0.40155080627684747], 0.11237747605474493, 0.8750721574724838),
    ([0.5866333066877937, 0.2977987852558073, -0.2634672095227138], 0.2126063126986935, 0.551613003288821),
    ([-0.06252776858891385, 0.49031460371171465, -0.24766302195158457], 0.14741079401622534, 0.5650142860591388),
    ([-0.5767596505556435, 0.21460263952786918, -0.3460462607999291], 0.1445210657183894, 0.7457865796401691),
    ([-0.5359649458595035, 0.08894112659041564, -0.4239257101130278], 0.18660971979742697, 0.8498791800104656),
    ([-0.477198685406609, -0.10313281461651802, 0.23328018927329408], 0.16384330503849734, 0.5249767294730436),
    ([0.04307568709861387, 0.19655357426374653, 0.01786693446997023], 0.23279731827880573, 0.7932775202509965),
];

/// Where the eye of the generated scenes lies, seen from the volume's centre, and how many sides of the volume away.
const TOWARDS_EYE: DVec3 = DVec3::new(1.0, 0.7, 0.5);
const SIDES_AWAY: f64 = 2.3;
const FOV_DEGREES: f64 = 30.0;
/// Pieces of the transfer function between a quarter of the values and all of them.
const N_PIECES: u32 = 6;

impl Generated {
    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Generated::Blobs => "blobs",
            Generated::Ml => "ml",
            Generated::Sharp => "sharp",
        }
    }

    /// The volume of `n` voxels a side, u8, with its camera and its transfer function.
    pub(super) fn subject(self, n: u32) -> Subject {
        let grid = Grid::from_first_sample(UVec3::splat(n), DVec3::ONE, DVec3::ZERO, DMat3::IDENTITY);
        let volume = Volume::new(grid.expect("a cube of voxels of side 1"), Voxels::U8(self.voxels(n)));
        let center = DVec3::splat(0.5 * f64::from(n - 1));
        let eye = center + TOWARDS_EYE.normalize() * (SIDES_AWAY * f64::from(n));
        Subject {
            name: format!("{}-{n}", self.name()),
            volume: volume.expect("one sample was made per voxel"),
            transfer: transfer(n),
            view: View { eye: eye.to_array(), target: center.to_array(), up: [0.0, 0.0, 1.0] },
            fov_degrees: FOV_DEGREES,
        }
    }

    /// Values 0 to 255, x fastest.
    fn voxels(self, n: u32) -> Vec<u8> {
        let signal = FieldFormula::MarschnerLobb { center: DVec3::ZERO, half_side: 1.0 };
        let field = match self {
            Generated::Blobs => blobs(n),
            Generated::Sharp => sharpened(&blobs(n), n as usize),
            Generated::Ml => sampled(n, |at| signal.at(at.map(|i| position(i, n)).into())),
        };
        field.into_par_iter().map(|value| (255.0 * value).round() as u8).collect()
    }
}

impl fmt::Display for Generated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Generated {
    type Err = String;

    fn from_str(text: &str) -> Result<Generated, String> {
        let all = [Generated::Blobs, Generated::Ml, Generated::Sharp];
        all.into_iter().find(|g| g.name() == text).ok_or_else(|| "blobs, ml or sharp".to_owned())
    }
}

/// A file's volume, moved so that its first sample lies at the origin and its axes are the world's.
///
/// # Errors
/// A file that cannot be read, a camera or a transfer function that cannot be had, an orthographic camera.
pub(super) fn of_file(path: &Path, input: &InputOptions, view: &ViewOptions) -> Result<Subject, PeersError> {
    let Opened { volume, .. } = input.open(path)?.evenly_spaced(&input.limits());
    let (dims, spacing) = (volume.grid().dims(), volume.grid().spacing());
    let grid = Grid::from_first_sample(dims, spacing, DVec3::ZERO, DMat3::IDENTITY);
    let (grid, rescale) = (grid.expect("a grid that was moved is one"), volume.rescale());
    let volume = Volume::rescaled(grid, volume.into_voxels(), rescale).expect("the voxels are as many as before");
    let camera = view.camera.camera(volume.grid(), WorldFrame::Plain, view.size).map_err(OptionError::from)?;
    let transfer = view.transfer(&volume)?;
    let Projection::Perspective { fov_y } = camera.projection() else { return Err(PeersError::Orthographic) };
    let distance = (volume.grid().world_box().center() - camera.eye()).dot(camera.forward());
    let target = camera.eye() + camera.forward() * distance;
    let view = View { eye: camera.eye().to_array(), target: target.to_array(), up: upwards(&camera).to_array() };
    let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Ok(Subject { name, volume, transfer, view, fov_degrees: fov_y.to_degrees() })
}

/// The world's z axis where it lies upwards in the picture, else the picture's own: the same picture, and cameras that turn about
/// z alone can take it.
fn upwards(camera: &Camera) -> DVec3 {
    let is_level = camera.right().z.abs() < 1e-9 && camera.up().z > 0.0;
    if is_level { DVec3::Z } else { camera.up() }
}

impl Subject {
    /// The camera, with a field of view whose tangent is `scale` of the subject's.
    pub(super) fn camera(&self, scale: f64) -> Camera {
        let fov_y = 2.0 * (scale * (0.5 * self.fov_degrees.to_radians()).tan()).atan();
        self.view.camera(fov_y).expect("the camera has been made once")
    }

    /// The middle of the outer sample centres: the point that the camera turns around.
    pub(super) fn middle(&self) -> DVec3 {
        let grid = self.volume.grid();
        grid.world(IndexPos(0.5 * grid.dims().as_dvec3())).0
    }
}

/// Opacities of 0 to 0.3 a voxel of a volume of 256: zero up to a quarter of the values, then along a line, of which the knots
/// of the extinction are points. Blue at 0, white in the middle, red at the end.
fn transfer(n: u32) -> TransferFunction {
    let knot = |k: u32| {
        let value = 0.25 + 0.75 * f64::from(k) / f64::from(N_PIECES);
        let extinction = -(-0.4 * (value - 0.25)).ln_1p() * 256.0 / f64::from(n);
        let dimmed = (2.0 - 2.0 * value).min(1.0);
        let color = [(2.0 * value).min(1.0), (2.0 * value).min(dimmed), dimmed];
        Knot { value: 255.0 * value, extinction, color }
    };
    TransferFunction::new((0..=N_PIECES).map(knot).collect()).expect("values rise")
}

/// Where a sample lies in [-1, 1].
fn position(i: u32, n: u32) -> f64 {
    2.0 * f64::from(i) / f64::from(n - 1) - 1.0
}

/// Values of a field, x fastest.
fn sampled(n: u32, field: impl Fn([u32; 3]) -> f64 + Sync) -> Vec<f32> {
    let mut values = vec![0.0; (n as usize).pow(3)];
    values.par_chunks_mut(n as usize).enumerate().for_each(|(row, values)| {
        let (y, z) = (row as u32 % n, row as u32 / n);
        values.iter_mut().zip(0..).for_each(|(value, x)| *value = field([x, y, z]) as f32);
    });
    values
}

fn blobs(n: u32) -> Vec<f32> {
    // A ball is a product of three functions of one coordinate.
    let factors = BALLS.map(|(center, sigma, _)| {
        center.map(|c| {
            let along = |i| (-(position(i, n) - c).powi(2) / (2.0 * sigma * sigma)).exp();
            (0..n).map(along).collect::<Vec<f64>>()
        })
    });
    sampled(n, |at| {
        let [x, y, z] = at.map(|i| i as usize);
        let balls = factors.iter().zip(&BALLS).map(|([fx, fy, fz], (.., peak))| peak * fx[x] * fy[y] * fz[z]);
        (balls.sum::<f64>() + shell(at.map(|i| position(i, n)).into())).clamp(0.0, 1.0)
    })
}

/// A shell of radius 0.86, open towards the eye.
fn shell(p: DVec3) -> f64 {
    let r = p.length();
    let cosine = p.dot(TOWARDS_EYE) / TOWARDS_EYE.length() / r.max(1e-6);
    let hole = 1.0 / (1.0 + (-(0.35 - cosine) * 30.0).exp());
    0.55 * (-(r - 0.86).powi(2) / (2.0 * 0.045 * 0.045)).exp() * hole
}

/// A field whose surface at 0.35 is about a voxel and a half thick: the distance from it is estimated by central differences,
/// at the volume's faces by one-sided ones. Inside, values are at least 0.45.
fn sharpened(field: &[f32], n: usize) -> Vec<f32> {
    let stride = [1, n, n * n];
    sampled(n as u32, |at| {
        let here: usize = at.iter().zip(stride).map(|(i, s)| *i as usize * s).sum();
        let slope = |axis: usize| {
            let (i, s) = (at[axis] as usize, stride[axis]);
            let (below, above) = (if i == 0 { here } else { here - s }, if i == n - 1 { here } else { here + s });
            f64::from(field[above] - field[below]) * if i == 0 || i == n - 1 { 1.0 } else { 0.5 }
        };
        let gradient = DVec3::new(slope(0), slope(1), slope(2)).length() + 1e-6;
        let value = f64::from(field[here]);
        ((value - 0.35) / gradient / 1.5 + 0.5).clamp(0.0, 1.0) * value.max(0.45)
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn values(scene: Generated, n: u32, at: &[[u32; 3]]) -> (u64, Vec<u8>) {
        let voxels = scene.voxels(n);
        let value = |[x, y, z]: &[u32; 3]| voxels[(x + n * (y + n * z)) as usize];
        (voxels.iter().map(|v| u64::from(*v)).sum(), at.iter().map(value).collect())
    }

    /// Sums and values of the fields as numpy makes them in f32, of which roundings may differ.
    #[test]
    fn peers_scenes_are_the_fields_that_were_measured_first() {
        let at = [[8, 8, 8], [5, 9, 3], [12, 4, 7], [10, 11, 2]];
        let cases = [
            (Generated::Blobs, 133_958, [222, 157, 14, 55]),
            (Generated::Ml, 521_960, [140, 232, 145, 217]),
            (Generated::Sharp, 100_837, [222, 157, 0, 34]),
        ];
        for (scene, sum, expected) in cases {
            let (found_sum, found) = values(scene, 16, &at);
            assert_eq!(found, expected, "{scene}");
            assert!(found_sum.abs_diff(sum) <= 4, "{scene}: {found_sum}");
        }
        let at = [[100, 120, 90], [200, 90, 40], [150, 180, 200], [30, 128, 128]];
        assert_eq!(values(Generated::Blobs, 256, &at).1, [111, 65, 7, 34]);
    }

    #[test]
    fn peers_transfer_functions_scale_with_the_volume() {
        let (small, large) = (transfer(256), transfer(512));
        assert_eq!(small.knots().len(), 7);
        let (a, b) = (small.knots()[6], large.knots()[6]);
        assert!((a.extinction - -(0.7f64.ln())).abs() < 1e-12 && (a.extinction - 2.0 * b.extinction).abs() < 1e-12);
        assert_eq!(
            (small.knots()[2].color, a.color, small.knots()[0].color),
            ([1.0; 3], [1.0, 0.0, 0.0], [0.5, 0.5, 1.0])
        );
    }

    #[test]
    fn peers_look_upwards_along_z_where_the_picture_is_level() {
        let camera =
            |up| Camera::look_at(DVec3::new(5.0, 3.0, 2.0), DVec3::ZERO, up, Projection::Perspective { fov_y: 0.5 });
        assert_eq!(upwards(&camera(DVec3::Z).unwrap()), DVec3::Z);
        for up in [DVec3::X, -DVec3::Z] {
            let camera = camera(up).unwrap();
            assert_eq!(upwards(&camera), camera.up());
        }
    }

    #[test]
    fn peers_see_a_volume_from_its_middle() {
        let subject = Generated::Ml.subject(16);
        assert_eq!(subject.middle(), DVec3::splat(7.5));
        let camera = subject.camera(1.0);
        assert!((camera.eye().distance(subject.middle()) - 2.3 * 16.0).abs() < 1e-12);
        assert!((camera.eye() - subject.middle()).dot(TOWARDS_EYE) > 0.0);
        let Projection::Perspective { fov_y } = subject.camera(0.5).projection() else { panic!("a perspective") };
        assert!(((fov_y / 2.0).tan() - 0.5 * (PI / 12.0).tan()).abs() < 1e-12);
    }
}
