//! The codec as `zarrs` has codecs.

use std::any::Any;
use std::num::NonZeroU64;
use std::sync::Arc;

use zarrs::array::codec::api::{CodecPluginV3, PartialDecoderCapability, PartialEncoderCapability};
use zarrs::array::{
    ArrayBytes, ArrayBytesRaw, ArrayCodecTraits, ArrayToBytesCodecTraits, BytesRepresentation, Codec, CodecError,
    CodecMetadataOptions, CodecOptions, CodecTraits, CodecTraitsV3, DataType, FillValue, RecommendedConcurrency,
};
use zarrs::metadata::Configuration;
use zarrs::metadata::v3::MetadataV3;
use zarrs::plugin::{PluginConfigurationInvalidError, PluginCreateError, ZarrVersion, impl_extension_aliases};

use crate::chunk::{decode_chunk, encode_chunk, max_encoded_bytes};
use crate::options::{ConfigurationError, HaarOptions};

/// The codec's name in the metadata of an array.
pub const CODEC_NAME: &str = "brickfield.haar";

/// Encodes chunks of integer samples as bricks of `brickfield-haar`, and decodes them: an array-to-bytes codec of Zarr v3.
///
/// Data types are uint8, uint16, uint32, int8, int16 and int32; a chunk has at most three dimensions of more than one sample, and
/// at most [`MAX_SAMPLES`](brickfield_haar::MAX_SAMPLES) samples. Other chunks are refused when they are encoded or decoded, with a
/// [`ChunkError`](crate::ChunkError) as the text of the [`CodecError`]. A part of a chunk is read by decoding the whole chunk.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HaarCodec {
    options: HaarOptions,
}

impl HaarCodec {
    /// The codec with these options.
    ///
    /// # Errors
    /// If an option is outside of its bounds.
    pub fn new(options: HaarOptions) -> Result<HaarCodec, ConfigurationError> {
        Ok(HaarCodec { options: options.checked()? })
    }

    /// The codec with the options of an array's metadata: the keys of the README, each of which may be left out.
    ///
    /// # Errors
    /// If a key is unknown, or its value is outside of its bounds.
    pub fn from_configuration(configuration: &Configuration) -> Result<HaarCodec, ConfigurationError> {
        Ok(HaarCodec { options: HaarOptions::from_configuration(configuration)? })
    }

    /// The options.
    pub fn options(&self) -> &HaarOptions {
        &self.options
    }
}

impl_extension_aliases!(HaarCodec, v3: CODEC_NAME);

inventory::submit! {
    CodecPluginV3::new::<HaarCodec>()
}

impl CodecTraitsV3 for HaarCodec {
    fn create(metadata: &MetadataV3) -> Result<Codec, PluginCreateError> {
        let codec = metadata.configuration().map_or(Ok(HaarCodec::default()), HaarCodec::from_configuration);
        let invalid = |error: ConfigurationError| PluginConfigurationInvalidError::new(error.to_string());
        Ok(Codec::ArrayToBytes(Arc::new(codec.map_err(invalid)?)))
    }
}

impl CodecTraits for HaarCodec {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn configuration(&self, version: ZarrVersion, _: &CodecMetadataOptions) -> Option<Configuration> {
        matches!(version, ZarrVersion::V3).then(|| self.options.to_configuration().into())
    }

    fn partial_decoder_capability(&self) -> PartialDecoderCapability {
        PartialDecoderCapability { partial_read: false, partial_decode: false }
    }

    fn partial_encoder_capability(&self) -> PartialEncoderCapability {
        PartialEncoderCapability { partial_encode: false }
    }
}

impl ArrayCodecTraits for HaarCodec {
    /// A chunk is encoded or decoded by one thread.
    fn recommended_concurrency(&self, _: &[NonZeroU64], _: &DataType) -> Result<RecommendedConcurrency, CodecError> {
        Ok(RecommendedConcurrency::new_maximum(1))
    }
}

impl ArrayToBytesCodecTraits for HaarCodec {
    fn into_dyn(self: Arc<Self>) -> Arc<dyn ArrayToBytesCodecTraits> {
        self
    }

    fn encoded_representation(
        &self,
        shape: &[NonZeroU64],
        data_type: &DataType,
        _: &FillValue,
    ) -> Result<BytesRepresentation, CodecError> {
        Ok(BytesRepresentation::BoundedSize(max_encoded_bytes(shape, data_type)?))
    }

    fn encode<'a>(
        &self,
        bytes: ArrayBytes<'a>,
        shape: &[NonZeroU64],
        data_type: &DataType,
        _: &FillValue,
        _: &CodecOptions,
    ) -> Result<ArrayBytesRaw<'a>, CodecError> {
        Ok(encode_chunk(bytes, shape, data_type, &self.options.encode_options())?.into())
    }

    fn decode<'a>(
        &self,
        bytes: ArrayBytesRaw<'a>,
        shape: &[NonZeroU64],
        data_type: &DataType,
        _: &FillValue,
        _: &CodecOptions,
    ) -> Result<ArrayBytes<'a>, CodecError> {
        Ok(decode_chunk(&bytes, shape, data_type, self.options.max_error)?)
    }
}
