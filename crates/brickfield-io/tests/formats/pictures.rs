//! Folders of pictures.

use std::collections::BTreeMap;

use brickfield_core::Voxels;
use brickfield_core::glam::{DVec3, UVec3};
use brickfield_io::{ChoiceKind, Format, Note, OpenOptions, Opened, ReadError, open, pictures};

use crate::common::*;

type Files = BTreeMap<String, Vec<u8>>;

fn read_with(files: &Files, options: &OpenOptions) -> Result<Opened, ReadError> {
    let names: Vec<String> = files.keys().cloned().collect();
    pictures::read(&names, files, options)
}

fn read(files: &Files) -> Result<Opened, ReadError> {
    read_with(files, &options())
}

fn named(name: &str, file: Vec<u8>) -> (String, Vec<u8>) {
    (name.to_owned(), file)
}

#[cfg(feature = "png")]
mod of_png {
    use super::*;

    fn png(width: u32, color: png::ColorType, depth: png::BitDepth, palette: &[u8], data: &[u8]) -> Vec<u8> {
        let mut out = vec![];
        let row_bytes = (width as usize * color.samples() * depth as usize).div_ceil(8);
        let mut encoder = png::Encoder::new(&mut out, width, (data.len() / row_bytes) as u32);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if !palette.is_empty() {
            encoder.set_palette(palette);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        out
    }

    pub(super) fn grey(values: &[u8]) -> Vec<u8> {
        png(2, png::ColorType::Grayscale, png::BitDepth::Eight, &[], values)
    }

    #[test]
    fn slices_are_in_the_order_of_their_numbers() {
        let files: Files = (1..=11).map(|i| named(&format!("Slice{i}.png"), grey(&[i, i]))).collect();
        let opened = read(&files).unwrap();
        assert_eq!((opened.format, opened.volume.grid().dims()), (Format::Pictures, UVec3::new(2, 1, 11)));
        assert_eq!(opened.volume.voxels(), &Voxels::U8((1..=11).flat_map(|i| [i, i]).collect()));
        assert_eq!((opened.volume.grid().spacing(), &opened.notes[..]), (DVec3::ONE, &[][..]));
        let mut options: OpenOptions = options();
        options.spacing = Some(DVec3::new(0.5, 0.5, 3.0));
        assert_eq!(read_with(&files, &options).unwrap().volume.grid().spacing(), DVec3::new(0.5, 0.5, 3.0));
    }

    #[test]
    fn a_gap_in_the_numbers_is_noted() {
        let files: Files = [1, 2, 5, 6].map(|i| named(&format!("z{i}.png"), grey(&[i, i]))).into();
        let said: Vec<_> = read(&files).unwrap().notes.iter().map(ToString::to_string).collect();
        let note = "by the numbers of the names 2 pictures are missing, first between \"z2.png\" and \"z5.png\"; the slices are \
                    stacked without a gap";
        assert_eq!(said, [note]);
    }

    #[test]
    fn other_files_are_skipped_with_a_note() {
        let files: Files = [
            named("1.png", grey(&[1, 2])),
            named("Thumbs.db", vec![0; 9]),
            named("about.txt", vec![]),
            named("2.png", grey(&[3, 4])),
        ]
        .into();
        let opened = read(&files).unwrap();
        assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![1, 2, 3, 4]));
        assert_eq!(
            opened.notes[0].to_string(),
            "2 files are no slices of this volume and were skipped, first \"about.txt\": it is neither TIFF nor PNG"
        );
    }

    #[test]
    fn a_slice_unlike_the_first_is_named() {
        let mut files: Files = [named("a1.png", grey(&[1, 2])), named("a2.png", grey(&[1, 2, 3, 4]))].into();
        let refused = read(&files).unwrap_err().to_string();
        assert_eq!(refused, "slice \"a2.png\" is \"2 x 2 samples of u8\"; expected 2 x 1 samples of u8, as \"a1.png\"");
        files.extend([named("a2.png", png(2, png::ColorType::Rgb, png::BitDepth::Eight, &[], &[0; 6]))]);
        let refused = read(&files).unwrap_err().to_string();
        assert!(refused.starts_with("slice \"a2.png\" is \"2 x 1 samples of u8 RGB\""), "{refused}");
        files.extend([named("a2.png", grey(&[1, 2])[..40].to_vec())]);
        let refused = read(&files).unwrap_err().to_string();
        assert!(refused.starts_with("slice \"a2.png\": ") && !refused.contains('\n'), "{refused}");
    }

    /// One slice of two pixels.
    #[track_caller]
    fn check(file: Vec<u8>, channel: Option<&str>, expected: impl Into<Voxels>, notes: &[Note]) {
        let mut options: OpenOptions = options();
        channel.into_iter().for_each(|entry| options.wanted.want(ChoiceKind::Channel, entry));
        let opened = read_with(&[named("1.png", file)].into(), &options).unwrap();
        assert_eq!((opened.volume.voxels(), &opened.notes[..]), (&expected.into(), notes));
    }

    #[test]
    fn every_kind_of_pixel() {
        use png::{BitDepth, ColorType};
        let sixteen = |color, samples: &[u16]| {
            let data: Vec<u8> = samples.iter().flat_map(|v| v.to_be_bytes()).collect();
            png(2, color, BitDepth::Sixteen, &[], &data)
        };
        check(sixteen(ColorType::Grayscale, &[1, 770]), None, vec![1u16, 770], &[]);
        check(sixteen(ColorType::Rgb, &[1, 2, 3, 400, 500, 600]), Some("blue"), vec![3u16, 600], &[]);
        check(sixteen(ColorType::Rgba, &[9, 9, 9, 0, 10, 20, 30, 0]), None, vec![9u16, 19], &[Note::Luminance]);
        check(png(2, ColorType::Grayscale, BitDepth::Two, &[], &[0b0111_0000]), None, vec![1u8, 3], &[]);
        let alpha = png(2, ColorType::GrayscaleAlpha, BitDepth::Eight, &[], &[5, 255, 6, 0]);
        check(alpha.clone(), Some("alpha"), vec![255u8, 0], &[]);
        let note = Note::OneOfSeveral { kind: ChoiceKind::Channel, read: "0 (grey)".to_owned(), n_entries: 2 };
        check(alpha, None, vec![5u8, 6], &[note]);
        let palette = [0, 0, 0, 10, 20, 30, 7, 7, 7];
        let numbered = || png(2, ColorType::Indexed, BitDepth::Four, &palette, &[0x12]);
        check(numbered(), None, vec![19u8, 7], &[Note::Luminance]);
        check(numbered(), Some("red"), vec![10u8, 7], &[]);
        check(numbered(), Some("index"), vec![1u8, 2], &[]);
    }

    #[test]
    fn a_picture_is_held_against_the_limits() {
        let file = png(1 << 13, png::ColorType::Rgb, png::BitDepth::Eight, &[], &[0; 3 << 13]);
        let names = [named("1.png", file)].into();
        let refused = read_with(&names, &brickfield_io::Limits { max_bytes: 20_000 }.into()).unwrap_err().to_string();
        assert!(refused.contains("the limit is 20000 bytes"), "{refused}");
    }
}

#[cfg(feature = "tiff")]
mod of_tiff {
    use super::*;
    use crate::tiff_bytes::{PageBytes, tiff};

    fn page(value: u8) -> PageBytes {
        PageBytes::grey(2, 1, 8, vec![value; 2])
    }

    #[test]
    fn slices_are_in_the_order_of_their_numbers() {
        let files: Files = [("z10.TIF", 3), ("z9.tif", 2), ("Z8.tif", 1)]
            .map(|(name, value)| named(name, tiff(&[page(value)])))
            .into();
        let opened = read(&files).unwrap();
        assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![1, 1, 2, 2, 3, 3]));
        let shown: Files = files.keys().map(|name| named(name, tiff(&[page(1).with(262, &[0])]))).collect();
        assert!(matches!(&read(&shown).unwrap().notes[..], [Note::AsStored { .. }]));
    }

    #[test]
    fn a_stack_among_slices_is_refused_and_alone_is_read() {
        let stack = tiff(&[page(1), page(2)]);
        let alone: Files = [named("stack.tif", stack.clone()), named("note.txt", vec![1])].into();
        let opened = read(&alone).unwrap();
        assert_eq!((opened.format, opened.volume.voxels()), (Format::Tiff, &Voxels::U8(vec![1, 1, 2, 2])));
        assert_eq!(opened.notes.len(), 1);
        let both: Files = [named("1.tif", tiff(&[page(1)])), named("2.tif", stack)].into();
        let refused = read(&both).unwrap_err().to_string();
        assert_eq!(refused, "slice \"2.tif\": number of pages is \"2\"; expected 1, as a slice of a folder has");
    }

    #[test]
    fn files_of_one_ome_image_are_its_planes() {
        let opened = read(&crate::tiff_ome::examples()[1]).unwrap();
        assert_eq!((opened.format, opened.volume.grid().dims()), (Format::Tiff, UVec3::new(2, 2, 3)));
    }

    #[cfg(feature = "png")]
    #[test]
    fn tiff_goes_before_png() {
        let files: Files =
            [named("1.tif", tiff(&[page(1)])), named("1.png", of_png::grey(&[9, 9])), named("2.tif", tiff(&[page(2)]))]
                .into();
        let opened = read(&files).unwrap();
        assert_eq!(opened.volume.voxels(), &Voxels::U8(vec![1, 1, 2, 2]));
        assert!(opened.notes[0].to_string().ends_with("\"1.png\": the slices are TIFF files"));
    }

    #[test]
    fn a_folder_is_opened_by_its_path() {
        let folder = tempfile::tempdir().unwrap();
        for i in [1, 2, 10] {
            std::fs::write(folder.path().join(format!("slice {i}.tif")), tiff(&[page(i)])).unwrap();
        }
        std::fs::create_dir(folder.path().join("previews")).unwrap();
        let opened = open(folder.path(), &options()).unwrap();
        assert_eq!((opened.format, opened.volume.voxels()), (Format::Pictures, &Voxels::U8(vec![1, 1, 2, 2, 10, 10])));
        #[cfg(feature = "dicom")]
        {
            std::fs::write(folder.path().join("slice.dcm"), crate::dicom::Slice::at(1.0).bytes()).unwrap();
            assert_eq!(brickfield_io::detect(folder.path()).unwrap(), Format::Dicom);
        }
    }
}

#[test]
fn a_folder_without_pictures_is_refused() {
    let files: Files = [named("about.txt", vec![1])].into();
    assert_eq!(read(&files).unwrap_err().to_string(), "a TIFF or PNG picture is missing");
}

/// Folders for fuzzing.
pub(crate) fn examples() -> Vec<Files> {
    let mut folders = vec![];
    #[cfg(feature = "png")]
    folders.push([named("1.png", of_png::grey(&[1, 2])), named("2.png", of_png::grey(&[3, 4]))].into());
    #[cfg(feature = "tiff")]
    folders.push(
        (1..3u8)
            .map(|i| {
                named(
                    &i.to_string(),
                    crate::tiff_bytes::tiff(&[crate::tiff_bytes::PageBytes::grey(2, 1, 8, vec![i; 2])]),
                )
            })
            .collect(),
    );
    folders
}
