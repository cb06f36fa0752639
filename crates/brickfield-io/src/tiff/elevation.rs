//! The one page of a GeoTIFF: its samples, and the tags that place them (OGC 19-008r4, "GeoTIFF Standard", 1.1).

use std::io::Cursor;

use brickfield_core::Voxels;
use brickfield_core::glam::UVec2;

use super::chunks::{read_samples, visit_missing};
use super::files::OneFile;
use super::page::Page;
use crate::files::ByteSource;
use crate::grids::check_nodes;
use crate::numbers::with_room;
use crate::pixel::Pixel;
use crate::samples::{append_binary, room_for};
use crate::{Limits, ReadError};

mod tag {
    pub(super) const PIXEL_SCALE: u16 = 33550;
    pub(super) const TIEPOINT: u16 = 33922;
    pub(super) const TRANSFORMATION: u16 = 34264;
    pub(super) const GEO_KEYS: u16 = 34735;
    pub(super) const NO_DATA: u16 = 42113;
}

/// The tags of a GeoTIFF; those that are missing are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct GeoTags {
    pub(crate) pixel_scale: Vec<f64>,
    pub(crate) tiepoints: Vec<f64>,
    /// Row by row.
    pub(crate) transformation: Vec<f64>,
    pub(crate) geo_keys: Vec<u64>,
    /// GDAL's: a number as text.
    pub(crate) no_data: Option<String>,
}

/// A page of one band.
pub(crate) struct Elevations<'a> {
    file: OneFile<'a>,
    page: Page,
    pub(crate) tags: GeoTags,
}

/// The samples of a page, the northern row first in most files.
pub(crate) struct BandSamples {
    pub(crate) samples: Voxels,
    /// Which samples lie in strips or tiles that are not stored; empty if all are.
    pub(crate) missing: Vec<bool>,
    pub(crate) n_missing: u64,
    pub(crate) n_chunks: u64,
}

impl<'a> Elevations<'a> {
    /// # Errors
    /// Several pages, reduced copies not counted; several bands, or a palette.
    pub(crate) fn open(source: &'a mut dyn ByteSource) -> Result<Elevations<'a>, ReadError> {
        let mut file = OneFile::open(Box::new(source))?;
        let full: Vec<usize> = (0..file.pages.len()).filter(|i| !file.pages[*i].is_reduced).collect();
        let [i] = full[..] else {
            return Err(ReadError::field("number of pages", full.len(), "1, reduced copies not counted"));
        };
        let page = file.page(i as u64, 0)?;
        if page.shape.pixel != Pixel::Grey || page.shape.depth != 1 {
            return Err(ReadError::unsupported("page of", page.shape, "one band of elevations, grey, is"));
        }
        let tags = GeoTags::read(&mut file, &page)?;
        Ok(Elevations { file, page, tags })
    }

    /// Columns and rows.
    pub(crate) fn n_nodes(&self) -> UVec2 {
        UVec2::new(self.page.shape.width, self.page.shape.height)
    }

    /// # Errors
    /// Samples and nodes beyond the limits or the file; samples that cannot be unpacked.
    pub(crate) fn read(mut self, limits: &Limits) -> Result<BandSamples, ReadError> {
        let stored = self.page.shape.stored;
        let n_unpacked = (stored.n_bytes() + stored.read_into().n_bytes()) as u128 * self.page.shape.n_pixels();
        // A value, a hole, and a sample that is missing.
        check_nodes(&[self.n_nodes().extend(1)], 6, n_unpacked, limits)?;
        let samples = read_samples(&mut self.file.tiff, &self.page, 0..1, 0, limits)?;
        let n = self.page.shape.n_pixels() as usize;
        let mut voxels = room_for(stored.read_into(), n)?;
        let name = self.page.name();
        append_binary(&mut voxels, &mut Cursor::new(samples.bytes), n, stored, samples.order, name)?;
        let missing = if samples.n_missing > 0 { self.missing()? } else { Vec::new() };
        Ok(BandSamples { samples: voxels, missing, n_missing: samples.n_missing, n_chunks: samples.n_chunks })
    }

    fn missing(&mut self) -> Result<Vec<bool>, ReadError> {
        let (n, width) = (self.page.shape.n_pixels() as usize, self.page.shape.width as usize);
        let mut missing = with_room(n)?;
        missing.resize(n, false);
        visit_missing(&mut self.file.tiff, &self.page, &mut |columns, rows| {
            for row in rows {
                let start = row as usize * width;
                missing[start + columns.start as usize..start + columns.end as usize].fill(true);
            }
        })?;
        Ok(missing)
    }
}

impl GeoTags {
    fn read(file: &mut OneFile, page: &Page) -> Result<GeoTags, ReadError> {
        let directory = &page.directory;
        let mut doubles = |tag| file.tiff.doubles(directory, tag);
        let (pixel_scale, tiepoints, transformation) =
            (doubles(tag::PIXEL_SCALE)?, doubles(tag::TIEPOINT)?, doubles(tag::TRANSFORMATION)?);
        Ok(GeoTags {
            pixel_scale,
            tiepoints,
            transformation,
            geo_keys: file.tiff.numbers(directory, tag::GEO_KEYS)?.unwrap_or_default(),
            no_data: file.tiff.texts(directory, tag::NO_DATA)?.into_iter().next(),
        })
    }
}
