#![no_main]

use brickfield_core::{Level, ScalarType};
use brickfield_haar::{BrickHeader, PackedBrick, Sample, decode, decode_level, decode_with_low};
use libfuzzer_sys::fuzz_target;

/// Bricks of more samples are not decoded: a few bytes may state 2^28 of them.
const MAX_SAMPLES: u64 = 1 << 16;

fuzz_target!(|bytes: &[u8]| {
    let Ok(header) = BrickHeader::read(bytes) else { return };
    if header.extent().as_u64vec3().element_product() > MAX_SAMPLES {
        return;
    }
    if let Ok(packed) = PackedBrick::read(bytes) {
        let n_numbers: usize = packed.sections().iter().map(|section| section.n_numbers).sum();
        assert_eq!(n_numbers as u64, header.extent().as_u64vec3().element_product());
    }
    match header.scalar() {
        ScalarType::U8 => all_levels::<u8>(bytes, &header),
        ScalarType::I8 => all_levels::<i8>(bytes, &header),
        ScalarType::U16 => all_levels::<u16>(bytes, &header),
        ScalarType::I16 => all_levels::<i16>(bytes, &header),
        ScalarType::U32 => all_levels::<u32>(bytes, &header),
        ScalarType::I32 => all_levels::<i32>(bytes, &header),
        ScalarType::F32 | ScalarType::F64 => unreachable!("no brick has floating-point samples"),
    }
});

fn all_levels<T: Sample>(bytes: &[u8], header: &BrickHeader) {
    if let Ok(decoded) = decode::<T>(bytes) {
        assert_eq!(decoded.extent, header.extent());
    }
    let n_low = Level(header.n_levels()).dims_of(header.extent()).element_product() as usize;
    if let Ok(decoded) = decode_with_low::<T>(bytes, &vec![T::saturate(7); n_low]) {
        assert_eq!(decoded.extent, header.extent());
    }
    for level in (0..=3).map(Level) {
        if let Ok(decoded) = decode_level::<T>(bytes, level) {
            assert_eq!(decoded.extent, level.dims_of(header.extent()));
            assert_eq!(decoded.samples.len(), decoded.extent.element_product() as usize);
        }
    }
}
