//! Codecs that are compared.

use brickfield_core::glam::UVec3;
use brickfield_haar::{EncodeOptions, Kernel, Loss, Sample, Storages, decode, encode};

/// A codec of bricks.
pub(crate) struct Contestant<T> {
    pub(crate) name: String,
    pub(crate) max_error: u64,
    pub(crate) encode: Box<Encode<T>>,
    pub(crate) decode: Box<Decode<T>>,
}

type Encode<T> = dyn Fn(UVec3, &[T]) -> Vec<u8> + Sync;
type Decode<T> = dyn Fn(&[u8]) -> Vec<T> + Sync;

/// All codecs.
pub(crate) fn contestants<T: Stored>() -> Vec<Contestant<T>> {
    let default = EncodeOptions::default;
    let mut contestants = vec![
        ours("the smallest of all kernels", EncodeOptions { kernels: Kernel::ALL.to_vec(), ..default() }),
        ours("of averaging kernels, the default", default()),
    ];
    for kernel in Kernel::ALL {
        contestants.push(ours(kernel.name(), EncodeOptions { kernels: vec![kernel], ..default() }));
    }
    for kernel in [Kernel::Haar, Kernel::HaarPredicted, Kernel::LeGall53] {
        let options = EncodeOptions { kernels: vec![kernel], storages: Storages::Packed, ..default() };
        contestants.push(ours(&format!("{kernel}, packed"), options));
    }
    for most in [1, 4] {
        let options = EncodeOptions { loss: Loss::MaxError(most), ..default() };
        contestants.push(ours(&format!("default, error of at most {most}"), options));
    }
    contestants.extend([zstd(3), zstd(19), pco()]);
    contestants
}

fn ours<T: Sample>(name: &str, options: EncodeOptions) -> Contestant<T> {
    let max_error = if let Loss::MaxError(most) = options.loss { u64::from(most) } else { 0 };
    Contestant {
        name: name.to_owned(),
        max_error,
        encode: Box::new(move |extent, samples| encode(extent, samples, &options).expect("a brick")),
        decode: Box::new(|bytes| decode(bytes).expect("a brick").samples),
    }
}

fn zstd<T: Stored>(level: i32) -> Contestant<T> {
    Contestant {
        name: format!("zstd-{level}"),
        max_error: 0,
        encode: Box::new(move |_, samples| ::zstd::bulk::compress(&T::to_bytes(samples), level).expect("zstd")),
        decode: Box::new(|bytes| T::from_bytes(&::zstd::bulk::decompress(bytes, 1 << 20).expect("zstd"))),
    }
}

/// pco has no numbers of 8 bits: it gets 16.
fn pco<T: Stored>() -> Contestant<T> {
    let config = ::pco::ChunkConfig::default();
    Contestant {
        name: "pco".to_owned(),
        max_error: 0,
        encode: Box::new(move |_, samples| {
            let wide: Vec<u16> = samples.iter().map(|s| s.to_i64() as u16).collect();
            ::pco::standalone::simple_compress(&wide, &config).expect("pco")
        }),
        decode: Box::new(|bytes| {
            let wide: Vec<u16> = ::pco::standalone::simple_decompress(bytes).expect("pco");
            wide.into_iter().map(|s| T::saturate(i64::from(s))).collect()
        }),
    }
}

/// Samples of 8 or 16 bits as bytes, little-endian.
pub(crate) trait Stored: Sample {
    fn to_bytes(samples: &[Self]) -> Vec<u8>;
    fn from_bytes(bytes: &[u8]) -> Vec<Self>;
}

impl Stored for u8 {
    fn to_bytes(samples: &[u8]) -> Vec<u8> {
        samples.to_vec()
    }
    fn from_bytes(bytes: &[u8]) -> Vec<u8> {
        bytes.to_vec()
    }
}

impl Stored for u16 {
    fn to_bytes(samples: &[u16]) -> Vec<u8> {
        samples.iter().flat_map(|s| s.to_le_bytes()).collect()
    }
    fn from_bytes(bytes: &[u8]) -> Vec<u16> {
        bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
    }
}
