//! Strips and tiles from their compressed bytes.

use std::io::Read;

use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};

use crate::ReadError;
use crate::error::{Damage, one_line};
use crate::numbers::with_room;
use crate::runs::unpack_runs;

/// How strips and tiles are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PageCompression {
    None,
    Lzw,
    Deflate,
    PackBits,
    Jpeg,
    #[cfg(feature = "zstd")]
    Zstd,
}

impl PageCompression {
    pub(super) fn of_code(code: u64) -> Result<PageCompression, ReadError> {
        let name = match code {
            1 => return Ok(PageCompression::None),
            5 => return Ok(PageCompression::Lzw),
            7 => return Ok(PageCompression::Jpeg),
            8 | 32946 => return Ok(PageCompression::Deflate),
            32773 => return Ok(PageCompression::PackBits),
            #[cfg(feature = "zstd")]
            50000 | 34926 => return Ok(PageCompression::Zstd),
            #[cfg(not(feature = "zstd"))]
            50000 | 34926 => "zstd, which this build leaves out",
            2..=4 => "CCITT fax",
            6 => "JPEG of TIFF 6.0",
            33003..=33005 | 34712 => "JPEG 2000",
            34887 => "LERC",
            34925 => "LZMA",
            34927 | 50001 => "WebP",
            50002 => "JPEG XL",
            _ => "unknown",
        };
        let value = format!("{name} (code {code})");
        Err(ReadError::unsupported("compression", value, "none, LZW, deflate, PackBits, JPEG and zstd are"))
    }

    /// More bytes than this do not come out of one byte.
    pub(super) fn max_ratio(self) -> u128 {
        match self {
            #[cfg(feature = "zstd")]
            PageCompression::Zstd => 1 << 16,
            _ => 4096,
        }
    }
}

/// The shape that a JPEG must have.
#[derive(Clone, Copy, Debug)]
pub(super) struct JpegShape<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) n_samples: usize,
    /// Whether its colours are to be turned into red, green and blue.
    pub(super) is_ycbcr: bool,
    /// The tables that the strips or tiles of a page share; may be empty.
    pub(super) tables: &'a [u8],
}

/// The `expected` bytes of a strip or tile; `what` names it in errors.
pub(super) fn unpack(
    packed: Vec<u8>,
    compression: PageCompression,
    expected: usize,
    jpeg: JpegShape,
    what: &str,
) -> Result<Vec<u8>, ReadError> {
    if expected as u128 > packed.len() as u128 * compression.max_ratio() {
        let (n_compressed_bytes, expected_bytes) = (packed.len() as u64, expected as u128);
        return Err(ReadError::TooFewCompressed { what: what.to_owned(), n_compressed_bytes, expected_bytes });
    }
    let mut out = Unpacked { bytes: with_room(expected)?, expected };
    let damage = match compression {
        PageCompression::None => return whole(packed, expected, what),
        PageCompression::Jpeg => return unpack_jpeg(&packed, expected, jpeg, what),
        PageCompression::Lzw if is_reversed_lzw(&packed) => {
            return Err(ReadError::unsupported("compression", "LZW of before TIFF 5.0", "LZW of TIFF 6.0 is"));
        }
        PageCompression::Lzw => out.lzw(&packed),
        PageCompression::PackBits => out.pack_bits(&packed),
        PageCompression::Deflate => out.read_from(&mut flate2::bufread::ZlibDecoder::new(&*packed)),
        #[cfg(feature = "zstd")]
        PageCompression::Zstd => out.zstd(&packed),
    };
    match out.bytes.len() == expected {
        true => Ok(out.bytes),
        false => {
            let (n_bytes, expected_bytes) = (out.bytes.len() as u64, expected as u128);
            Err(ReadError::Damaged { what: one_line(what), n_bytes, expected_bytes, damage })
        }
    }
}

fn whole(mut bytes: Vec<u8>, expected: usize, what: &str) -> Result<Vec<u8>, ReadError> {
    crate::error::check_length(what, bytes.len() as u64, expected as u128)?;
    bytes.truncate(expected);
    Ok(bytes)
}

/// Bytes as they come out. A method returns why no more come; whether enough came is for the caller to see.
struct Unpacked {
    bytes: Vec<u8>,
    expected: usize,
}

impl Unpacked {
    fn lzw(&mut self, packed: &[u8]) -> Damage {
        use weezl::{BitOrder, LzwStatus, decode::Configuration};
        let mut decoder =
            Configuration::with_tiff_size_switch(BitOrder::Msb, 8).with_yield_on_full_buffer(true).build();
        self.bytes.resize(self.expected, 0);
        let (mut n_in, mut n_out) = (0, 0);
        let damage = loop {
            let step = decoder.decode_bytes(&packed[n_in..], &mut self.bytes[n_out..]);
            n_in += step.consumed_in;
            n_out += step.consumed_out;
            match step.status {
                _ if n_out == self.expected => break Damage::CutOff,
                Ok(LzwStatus::Ok) if step.consumed_in + step.consumed_out > 0 => {}
                Ok(_) => break Damage::CutOff,
                Err(_) => break Damage::Corrupt,
            }
        };
        self.bytes.truncate(n_out);
        damage
    }

    fn pack_bits(&mut self, packed: &[u8]) -> Damage {
        self.bytes.resize(self.expected, 0);
        let n_left = unpack_runs(packed, &mut self.bytes.iter_mut());
        self.bytes.truncate(self.expected - n_left);
        Damage::CutOff
    }

    fn read_from(&mut self, reader: &mut dyn Read) -> Damage {
        let n = self.expected as u64;
        match reader.take(n).read_to_end(&mut self.bytes) {
            Ok(_) => Damage::CutOff,
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Damage::CutOff,
            Err(_) => Damage::Corrupt,
        }
    }

    #[cfg(feature = "zstd")]
    fn zstd(&mut self, packed: &[u8]) -> Damage {
        let Ok(mut decoder) = zstd::stream::read::Decoder::with_buffer(packed) else { return Damage::Corrupt };
        // The default, 128 MiB, is a window that no encoder takes for a smaller strip or tile.
        let window_log = self.expected.max(MIN_WINDOW).next_power_of_two().ilog2().min(27);
        match decoder.window_log_max(window_log) {
            Ok(()) => self.read_from(&mut decoder),
            Err(_) => Damage::Corrupt,
        }
    }
}

/// The window of zstd's highest usual level.
#[cfg(feature = "zstd")]
const MIN_WINDOW: usize = 8 << 20;

/// Writers before TIFF 5.0 put the bits of a code in the other order; the first code is 256 in either.
fn is_reversed_lzw(packed: &[u8]) -> bool {
    matches!(packed, [0, second, ..] if second & 1 == 1)
}

/// A JPEG that may be higher than the strip, never narrower or wider.
fn unpack_jpeg(packed: &[u8], expected: usize, shape: JpegShape, what: &str) -> Result<Vec<u8>, ReadError> {
    let stream = joined(shape.tables, packed);
    let mut decoder = Decoder::new(&stream[..]);
    let fault = |e| ReadError::decoder(what, e);
    decoder.read_info().map_err(fault)?;
    let found = decoder.info().map(|i| (usize::from(i.width), usize::from(i.height), i.pixel_format));
    let (width, height, format) = found.unwrap_or((0, 0, PixelFormat::L8));
    let n_samples = match format {
        PixelFormat::L8 => 1,
        PixelFormat::RGB24 => 3,
        PixelFormat::CMYK32 => 4,
        PixelFormat::L16 => return Err(ReadError::unsupported("JPEG in TIFF with", "16 bits a sample", "8 bits are")),
    };
    if width != shape.width || height < shape.height || height > shape.height + 15 || n_samples != shape.n_samples {
        let value = format!("{width} x {height}, {n_samples} samples a pixel");
        let JpegShape { width, height, n_samples, .. } = shape;
        let expected = format!("{width} x {height}, {n_samples} samples a pixel");
        return Err(ReadError::field(format!("JPEG of {what}"), value, expected));
    }
    if n_samples == 3 {
        decoder.set_color_transform(if shape.is_ycbcr { ColorTransform::YCbCr } else { ColorTransform::RGB });
    }
    decoder.set_max_decoding_buffer_size(width * height * n_samples);
    whole(decoder.decode().map_err(fault)?, expected, what)
}

/// Tables and JPEG in one stream: the end mark of the first and the start mark of the second are left out.
fn joined(tables: &[u8], jpeg: &[u8]) -> Vec<u8> {
    let tables = tables.strip_suffix(&[0xff, 0xd9]).unwrap_or(tables);
    match jpeg.strip_prefix(&[0xff, 0xd8]) {
        Some(rest) if !tables.is_empty() => [tables, rest].concat(),
        _ => jpeg.to_vec(),
    }
}
