//! The files of a comparison: pictures as they come, report and page at the end, all at once visible.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use brickfield::core::{Image, LinearRgb};
use brickfield::optics::ColorDifferences;
use brickfield::{PictureError, write_exr, write_png};

use crate::metrics::{Errors, MetricError, color_errors, delta_e, errors, opaque};
use crate::report::{Channels, Report, Row, heat};
use crate::turns::Spread;

/// Why the results could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum OutputError {
    #[error("--out {}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("--out {}: it has an images/ but no report.json, so it is not a comparison's; choose another folder", path.display())]
    Foreign { path: PathBuf },
    #[error("--out {}: its {name} is a folder; choose another folder", path.display())]
    IsFolder { path: PathBuf, name: &'static str },
    #[error(transparent)]
    Picture(#[from] PictureError),
    #[error("index.html: {0}")]
    Page(io::Error),
}

/// A hidden folder in the output folder, which takes everything until it is complete.
pub(crate) struct OutputFolder {
    out: PathBuf,
    draft: tempfile::TempDir,
}

/// A picture's files, relative to the report.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Files {
    pub(crate) exr: String,
    pub(crate) png: String,
}

impl OutputFolder {
    pub(crate) fn new(out: &Path) -> Result<OutputFolder, OutputError> {
        let io = |source| OutputError::Io { path: out.to_owned(), source };
        std::fs::create_dir_all(out).map_err(io)?;
        if out.join("images").exists() && !out.join("report.json").exists() {
            return Err(OutputError::Foreign { path: out.to_owned() });
        }
        if let Some(name) = ["index.html", "report.json"].into_iter().find(|name| out.join(name).is_dir()) {
            return Err(OutputError::IsFolder { path: out.to_owned(), name });
        }
        let draft = tempfile::Builder::new().prefix(".draft").tempdir_in(out).map_err(io)?;
        std::fs::create_dir(draft.path().join("images")).map_err(io)?;
        Ok(OutputFolder { out: out.to_owned(), draft })
    }

    /// Where the files lie until they are published.
    pub(crate) fn folder(&self) -> &Path {
        self.draft.path()
    }

    /// Writes a picture for measuring and for looking.
    pub(crate) fn picture(
        &self,
        name: &str,
        image: &Image<f32>,
        background: LinearRgb,
        attributes: &[(&str, String)],
    ) -> Result<Files, OutputError> {
        let files = Files { exr: format!("images/{name}.exr"), png: format!("images/{name}.png") };
        write_exr(&self.folder().join(&files.exr), image, attributes)?;
        write_png(&self.folder().join(&files.png), image, background)?;
        Ok(files)
    }

    /// Moves everything to its place, replacing an earlier comparison's; `report.json` comes last.
    pub(crate) fn publish(self, report: &Report, html: &str) -> Result<(), OutputError> {
        let io = |source| OutputError::Io { path: self.out.clone(), source };
        let json = serde_json::to_string_pretty(report).map_err(|e| io(e.into()))?;
        std::fs::write(self.folder().join("index.html"), html).map_err(io)?;
        std::fs::write(self.folder().join("report.json"), json + "\n").map_err(io)?;
        if self.out.join("images").exists() {
            // The draft's end is the old pictures' end.
            std::fs::rename(self.out.join("images"), self.folder().join("old")).map_err(io)?;
        }
        for name in ["images", "index.html", "report.json"] {
            std::fs::rename(self.folder().join(name), self.out.join(name)).map_err(io)?;
        }
        Ok(())
    }
}

/// Judges pictures by the answer, and writes them.
pub(crate) struct Pictures<'a> {
    pub(crate) output: &'a OutputFolder,
    pub(crate) answer: &'a Image<f64>,
    pub(crate) background: LinearRgb,
    pub(crate) channels: Channels,
}

/// Who made a picture, and how.
pub(crate) struct Caption<'a> {
    pub(crate) backend: &'a str,
    /// In the attributes of a picture with its driver.
    pub(crate) adapter: String,
    pub(crate) mode: &'a str,
    pub(crate) rule: &'a str,
    pub(crate) step_voxels: f64,
}

/// A picture that has been judged and written.
pub(crate) struct JudgedPicture {
    pub(crate) errors: Errors,
    pub(crate) delta_e: ColorDifferences,
    pub(crate) files: Files,
    pub(crate) difference: Files,
}

/// What a picture took.
pub(crate) struct Effort {
    pub(crate) samples: u64,
    /// Milliseconds a frame, and the number of frames.
    pub(crate) wall: Spread,
    pub(crate) n_frames: usize,
    pub(crate) device_ms: Option<f64>,
    pub(crate) upload_ms: f64,
}

impl JudgedPicture {
    /// Its line in the report.
    pub(crate) fn row(self, by: Caption<'_>, effort: Effort) -> Row {
        let JudgedPicture { errors, delta_e, files, difference } = self;
        Row {
            backend: by.backend.to_owned(),
            adapter: by.adapter,
            mode: by.mode.to_owned(),
            rule: by.rule.to_owned(),
            step_voxels: by.step_voxels,
            samples: effort.samples,
            median_ms: effort.wall.median,
            min_ms: effort.wall.min,
            max_ms: effort.wall.max,
            device_ms: effort.device_ms,
            upload_ms: effort.upload_ms,
            n_frames: effort.n_frames as u32,
            rmse: errors.rmse,
            max_abs: errors.worst.difference,
            worst_pixel: errors.worst.pixel.to_array(),
            p999: errors.p999,
            delta_e_mean: delta_e.mean,
            delta_e_p95: delta_e.percentile_95,
            on_front: false,
            exr: files.exr,
            png: files.png,
            difference_exr: difference.exr,
            difference_png: difference.png,
        }
    }
}

impl Pictures<'_> {
    /// The inner error says why the picture has no errors (it is not finite, say).
    pub(crate) fn judge(
        &self,
        by: &Caption<'_>,
        image: &Image<f32>,
    ) -> Result<Result<JudgedPicture, String>, OutputError> {
        let over_black;
        let image = match self.channels {
            Channels::All => image,
            Channels::Colors => {
                over_black = opaque(image);
                &over_black
            }
        };
        let judged = self.errors(image).and_then(|e| Ok((e, delta_e(image, self.answer, self.background)?)));
        let (errors, delta_e) = match judged {
            Ok(judged) => judged,
            Err(e) => return Ok(Err(e.to_string())),
        };
        let Caption { backend, adapter, mode, rule, step_voxels } = by;
        let name = format!("{backend}-{mode}-{rule}-{step_voxels}");
        let attributes = [
            ("backend", (*backend).to_owned()),
            ("adapter", adapter.clone()),
            ("sampling", format!("{mode} {rule} step {step_voxels} voxels")),
        ];
        let files = self.output.picture(&name, image, self.background, &attributes)?;
        let difference = self.difference(&format!("{name}-difference"), image, &attributes)?;
        Ok(Ok(JudgedPicture { errors, delta_e, files, difference }))
    }

    fn errors(&self, image: &Image<f32>) -> Result<Errors, MetricError> {
        match self.channels {
            Channels::All => errors(image, self.answer),
            Channels::Colors => color_errors(image, self.answer),
        }
    }

    fn difference(&self, name: &str, image: &Image<f32>, attributes: &[(&str, String)]) -> Result<Files, OutputError> {
        let files = Files { exr: format!("images/{name}.exr"), png: format!("images/{name}.png") };
        let mut signed = image.clone();
        for (p, r) in signed.pixels_mut().iter_mut().zip(self.answer.pixels()) {
            *p = std::array::from_fn(|c| (f64::from(p[c]) - r[c]) as f32);
        }
        write_exr(&self.output.folder().join(&files.exr), &signed, attributes)?;
        let path = self.output.folder().join(&files.png);
        let greatest = |p: &[f32; 4]| p.iter().map(|d| f64::from(d.abs())).fold(0.0, f64::max);
        let bytes: Vec<u8> = signed.pixels().iter().flat_map(|p| heat(greatest(p))).collect();
        let size = image.size();
        let buffer = image::RgbImage::from_raw(size.x, size.y, bytes).expect("three bytes a pixel");
        buffer.save(&path).map_err(|source| PictureError::Png { path, source })?;
        Ok(files)
    }
}

/// Prints text; a reader that has gone away is no error.
///
/// # Errors
/// Any other error of the system.
pub fn say(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::report;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn nothing_shows_before_all_is_there_and_a_second_run_replaces_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("a/b");
        for pixel in [0.25, 0.75] {
            let output = OutputFolder::new(&out).unwrap();
            let image = Image::new([1, 1].into(), vec![[pixel; 4]]).unwrap();
            let files = output.picture(&format!("p{pixel}"), &image, [0.0; 3], &[]).unwrap();
            assert!(!out.join(files.png).exists());
            output.publish(&report(), "<html>").unwrap();
        }
        assert_eq!(names(&out), ["images", "index.html", "report.json"]);
        assert_eq!(names(&out.join("images")), ["p0.75.exr", "p0.75.png"]);
    }

    #[test]
    fn what_fails_leaves_nothing_behind_and_foreign_pictures_alone() {
        let folder = tempfile::tempdir().unwrap();
        drop(OutputFolder::new(folder.path()).unwrap());
        assert!(names(folder.path()).is_empty());
        std::fs::create_dir(folder.path().join("images")).unwrap();
        assert!(matches!(OutputFolder::new(folder.path()), Err(OutputError::Foreign { .. })));
    }
}
