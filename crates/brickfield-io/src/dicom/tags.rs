//! The elements that are kept of a data set (PS3.6), and the value representation that each has where none is written.

pub(super) type Tag = (u16, u16);

macro_rules! tags {
    ($($name:ident = ($group:literal, $element:literal), $vr:literal;)*) => {
        $(pub(super) const $name: Tag = ($group, $element);)*
        const KEPT: &[(Tag, [u8; 2])] = &[$(($name, *$vr),)*];
    };
}

tags! {
    DIRECTORY_RECORDS = (0x0004, 0x1220), b"SQ";
    IMAGE_TYPE = (0x0008, 0x0008), b"CS";
    SOP_CLASS_UID = (0x0008, 0x0016), b"UI";
    SOP_INSTANCE_UID = (0x0008, 0x0018), b"UI";
    SLICE_THICKNESS = (0x0018, 0x0050), b"DS";
    ECHO_NUMBERS = (0x0018, 0x0086), b"IS";
    SPACING_BETWEEN_SLICES = (0x0018, 0x0088), b"DS";
    IMAGER_PIXEL_SPACING = (0x0018, 0x1164), b"DS";
    SIEMENS_MOSAIC_COUNT = (0x0019, 0x100a), b"US";
    SERIES_INSTANCE_UID = (0x0020, 0x000e), b"UI";
    INSTANCE_NUMBER = (0x0020, 0x0013), b"IS";
    IMAGE_POSITION = (0x0020, 0x0032), b"DS";
    IMAGE_ORIENTATION = (0x0020, 0x0037), b"DS";
    TEMPORAL_POSITION = (0x0020, 0x0100), b"IS";
    SLICE_LOCATION = (0x0020, 0x1041), b"DS";
    STACK_ID = (0x0020, 0x9056), b"SH";
    IN_STACK_POSITION = (0x0020, 0x9057), b"UL";
    FRAME_CONTENT = (0x0020, 0x9111), b"SQ";
    PLANE_POSITION = (0x0020, 0x9113), b"SQ";
    PLANE_ORIENTATION = (0x0020, 0x9116), b"SQ";
    TEMPORAL_POSITION_INDEX = (0x0020, 0x9128), b"UL";
    DIMENSION_INDEX_VALUES = (0x0020, 0x9157), b"UL";
    DIMENSION_INDEX_POINTER = (0x0020, 0x9165), b"AT";
    DIMENSION_INDICES = (0x0020, 0x9222), b"SQ";
    IMAGE_POSITION_VOLUME = (0x0020, 0x9301), b"FD";
    SAMPLES_PER_PIXEL = (0x0028, 0x0002), b"US";
    PHOTOMETRIC_INTERPRETATION = (0x0028, 0x0004), b"CS";
    PLANAR_CONFIGURATION = (0x0028, 0x0006), b"US";
    NUMBER_OF_FRAMES = (0x0028, 0x0008), b"IS";
    ROWS = (0x0028, 0x0010), b"US";
    COLUMNS = (0x0028, 0x0011), b"US";
    PIXEL_SPACING = (0x0028, 0x0030), b"DS";
    BITS_ALLOCATED = (0x0028, 0x0100), b"US";
    BITS_STORED = (0x0028, 0x0101), b"US";
    HIGH_BIT = (0x0028, 0x0102), b"US";
    PIXEL_REPRESENTATION = (0x0028, 0x0103), b"US";
    RESCALE_INTERCEPT = (0x0028, 0x1052), b"DS";
    RESCALE_SLOPE = (0x0028, 0x1053), b"DS";
    RED_PALETTE_SHAPE = (0x0028, 0x1101), b"US";
    GREEN_PALETTE_SHAPE = (0x0028, 0x1102), b"US";
    BLUE_PALETTE_SHAPE = (0x0028, 0x1103), b"US";
    RED_PALETTE = (0x0028, 0x1201), b"OW";
    GREEN_PALETTE = (0x0028, 0x1202), b"OW";
    BLUE_PALETTE = (0x0028, 0x1203), b"OW";
    MODALITY_LUT = (0x0028, 0x3000), b"SQ";
    PIXEL_MEASURES = (0x0028, 0x9110), b"SQ";
    PIXEL_VALUE_TRANSFORMATION = (0x0028, 0x9145), b"SQ";
    SIEMENS_CSA_IMAGE_HEADER = (0x0029, 0x1010), b"OB";
    DETECTOR_INFORMATION = (0x0054, 0x0022), b"SQ";
    SEGMENT_IDENTIFICATION = (0x0062, 0x000a), b"SQ";
    REFERENCED_SEGMENT_NUMBER = (0x0062, 0x000b), b"US";
    GRID_FRAME_OFFSETS = (0x3004, 0x000c), b"DS";
    DOSE_GRID_SCALING = (0x3004, 0x000e), b"DS";
    SHARED_FUNCTIONAL_GROUPS = (0x5200, 0x9229), b"SQ";
    PER_FRAME_FUNCTIONAL_GROUPS = (0x5200, 0x9230), b"SQ";
    EXTENDED_OFFSETS = (0x7fe0, 0x0001), b"OV";
}

pub(super) const FLOAT_PIXELS: Tag = (0x7fe0, 0x0008);
pub(super) const DOUBLE_PIXELS: Tag = (0x7fe0, 0x0009);
pub(super) const PIXELS: Tag = (0x7fe0, 0x0010);

/// The value representation of an element that is kept.
pub(super) fn kept_vr(tag: Tag) -> Option<[u8; 2]> {
    KEPT.binary_search_by_key(&tag, |(kept, _)| *kept).ok().map(|i| KEPT[i].1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_ascend_so_that_they_are_found() {
        assert!(KEPT.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(kept_vr(ROWS), Some(*b"US"));
        assert_eq!(kept_vr(PIXELS), None);
    }
}
