//! What pictures are held to: the continuous integral of each domain and field of view, over black.

use std::collections::HashMap;
use std::path::Path;

use brickfield::core::glam::{DVec3, UVec2, UVec3};
use brickfield::core::{Aabb, Image};
use brickfield::cpu::{ContinuousOptions, continuous};

use super::protocol::{Domain, Opened};
use super::scenes::Subject;
use crate::metrics::{color_errors, opaque};

/// How far the answer is driven: its error is a thousandth of the least that is asked of a contestant.
pub(super) const ACCURACY: ContinuousOptions = ContinuousOptions { tolerance: 1e-7, transmittance_floor: 1e-8 };

/// The answers that have been asked for.
pub(super) struct Answers<'a> {
    subject: &'a Subject,
    size: UVec2,
    known: HashMap<(Domain, u64), Image<f64>>,
}

impl<'a> Answers<'a> {
    pub(super) fn new(subject: &'a Subject, size: UVec2) -> Answers<'a> {
        Answers { subject, size, known: HashMap::new() }
    }

    pub(super) fn of(&mut self, domain: Domain, view: f64) -> &Image<f64> {
        let Answers { subject, size, known } = self;
        known.entry((domain, view.to_bits())).or_insert_with(|| {
            let (volume, camera) = (&subject.volume, subject.camera(view));
            let clip = clip(domain, volume.grid().dims());
            opaque(&continuous(volume, &subject.transfer, &camera, *size, &clip, &ACCURACY).image)
        })
    }

    /// The error of a picture in a file.
    pub(super) fn rmse(&mut self, picture: &Path, of: &Opened) -> Result<f64, String> {
        let answer = self.of(of.domain, of.view);
        let image = read_picture(picture, answer.size())?;
        color_errors(&opaque(&image), answer).map(|errors| errors.rmse).map_err(|e| e.to_string())
    }
}

/// A domain in sample space.
fn clip(domain: Domain, dims: UVec3) -> Aabb {
    match domain {
        Domain::Voxels => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
        Domain::Centres => Aabb { min: DVec3::ZERO, max: dims.as_dvec3() - 1.0 },
    }
}

/// A picture that a contestant wrote. Its file is taken away: another step's picture is another file.
pub(super) fn read_picture(path: &Path, size: UVec2) -> Result<Image<f32>, String> {
    let bytes = std::fs::read(path).map_err(|e| format!("it wrote no picture: {e}"))?;
    std::fs::remove_file(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let n_bytes = 16 * u64::from(size.x) * u64::from(size.y);
    if bytes.len() as u64 != n_bytes {
        let n = bytes.len();
        return Err(format!("its picture has {n} bytes, and {} x {} pixels take {n_bytes}", size.x, size.y));
    }
    let channel = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let pixels = bytes.chunks_exact(16).map(|p| std::array::from_fn(|c| channel(&p[4 * c..]))).collect();
    Image::new(size, pixels).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_pictures_are_whole_and_read_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.f32");
        let write = |n_floats: u32| {
            let bytes: Vec<u8> = (0..n_floats).flat_map(|i| (i as f32).to_le_bytes()).collect();
            std::fs::write(&path, bytes).unwrap();
        };
        write(8);
        let image = read_picture(&path, UVec2::new(1, 2)).unwrap();
        assert_eq!(image.pixels(), [[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]]);
        let again = read_picture(&path, UVec2::new(1, 2)).unwrap_err();
        assert!(again.starts_with("it wrote no picture: "), "{again}");
        write(9);
        let e = read_picture(&path, UVec2::new(1, 2)).unwrap_err();
        assert_eq!(e, "its picture has 36 bytes, and 1 x 2 pixels take 32");
    }
}
