#![no_main]

use brickfield_core::glam::UVec3;
use brickfield_haar::{
    BrickHeader, EncodeOptions, Kernel, Loss, LowBand, Sample, Storages, decode, decode_with_low, encode,
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Some((&[kind, options, x, y, loss], content)) = bytes.split_first_chunk() else { return };
    match kind % 6 {
        0 => round_trip(content, [options, x, y, loss], |b: [u8; 1]| b[0]),
        1 => round_trip(content, [options, x, y, loss], |b: [u8; 1]| b[0] as i8),
        2 => round_trip(content, [options, x, y, loss], u16::from_le_bytes),
        3 => round_trip(content, [options, x, y, loss], i16::from_le_bytes),
        4 => round_trip(content, [options, x, y, loss], u32::from_le_bytes),
        _ => round_trip(content, [options, x, y, loss], i32::from_le_bytes),
    }
});

/// What is decoded differs from the samples by as much as the header says, and by no more than was allowed.
fn round_trip<T: Sample, const N: usize>(content: &[u8], [options, x, y, loss]: [u8; 4], sample: fn([u8; N]) -> T) {
    let samples: Vec<T> = content.chunks_exact(N).map(|b| sample(b.try_into().expect("N bytes"))).collect();
    let (x, y) = (u32::from(x % 40) + 1, u32::from(y % 40) + 1);
    let z = samples.len() as u32 / (x * y);
    if z == 0 {
        return;
    }
    let extent = UVec3::new(x, y, z);
    let samples = &samples[..extent.element_product() as usize];
    let kernels = match options % 8 {
        kernel @ 0..4 => vec![Kernel::ALL[usize::from(kernel)]],
        _ => Kernel::ALL.to_vec(),
    };
    let storages = if options & 8 == 0 { Storages::Smallest } else { Storages::Packed };
    let n_levels = if options & 16 == 0 { None } else { Some(options >> 5) };
    if loss == u8::MAX {
        return without_low_band(extent, samples, storages);
    }
    let max_error = u32::from(loss);
    let loss = if loss == 0 { Loss::None } else { Loss::MaxError(max_error) };
    let brick =
        encode(extent, samples, &EncodeOptions { kernels, storages, n_levels, loss, ..EncodeOptions::default() })
            .expect("a brick");
    let decoded = decode::<T>(&brick).expect("a brick that was just encoded");
    let error = samples.iter().zip(&decoded.samples).map(|(a, b)| a.to_i64().abs_diff(b.to_i64())).max();
    assert_eq!(error, Some(u64::from(BrickHeader::read(&brick).expect("a header").max_error())));
    assert!(error <= Some(u64::from(max_error)) && decoded.extent == extent);
}

/// Details and the means that are level 1 make the samples.
fn without_low_band<T: Sample>(extent: UVec3, samples: &[T], storages: Storages) {
    let kernels = vec![Kernel::Haar, Kernel::HaarPredicted];
    let options = EncodeOptions { kernels, storages, low_band: LowBand::Elsewhere, ..EncodeOptions::default() };
    let brick = encode(extent, samples, &options).expect("a brick");
    let n = (extent + 1) / 2;
    let mut sums = vec![(0i64, 0i64); n.element_product() as usize];
    for (i, sample) in (0..).zip(samples) {
        let cell = UVec3::new(i % extent.x, i / extent.x % extent.y, i / extent.x / extent.y) / 2;
        let sum = &mut sums[(cell.x + n.x * (cell.y + n.y * cell.z)) as usize];
        *sum = (sum.0 + sample.to_i64(), sum.1 + 1);
    }
    let low: Vec<T> = sums.into_iter().map(|(sum, n)| T::saturate((2 * sum + n).div_euclid(2 * n))).collect();
    let decoded = decode_with_low::<T>(&brick, &low).expect("a brick that was just encoded");
    assert!(decoded.extent == extent && decoded.samples == samples);
}
