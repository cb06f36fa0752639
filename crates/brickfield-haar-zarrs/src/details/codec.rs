//! The codec of details, as `zarrs` has codecs: it makes their array one that can be opened.

use std::any::Any;
use std::num::NonZeroU64;
use std::sync::Arc;

use brickfield_haar::FORMAT_VERSION;
use serde_json::json;
use zarrs::array::codec::api::{CodecPluginV3, PartialDecoderCapability, PartialEncoderCapability};
use zarrs::array::{
    ArrayBytes, ArrayBytesRaw, ArrayCodecTraits, ArrayToBytesCodecTraits, BytesRepresentation, Codec, CodecError,
    CodecMetadataOptions, CodecOptions, CodecTraits, CodecTraitsV3, DataType, FillValue, RecommendedConcurrency,
};
use zarrs::metadata::Configuration;
use zarrs::metadata::v3::MetadataV3;
use zarrs::plugin::{PluginConfigurationInvalidError, PluginCreateError, ZarrVersion, impl_extension_aliases};

use crate::chunk::max_encoded_bytes;

/// The name of the codec of details in the metadata of an array.
pub const DETAILS_CODEC_NAME: &str = "brickfield.haar_details";

/// The codec of an array of details. `zarrs` gives a codec the bytes of one chunk, and these are samples only together with samples of
/// another array: [`DetailArray`](crate::DetailArray) has both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HaarDetailsCodec;

impl_extension_aliases!(HaarDetailsCodec, v3: DETAILS_CODEC_NAME);

inventory::submit! {
    CodecPluginV3::new::<HaarDetailsCodec>()
}

impl CodecTraitsV3 for HaarDetailsCodec {
    fn create(metadata: &MetadataV3) -> Result<Codec, PluginCreateError> {
        let Some(configuration) = metadata.configuration() else {
            return Ok(Codec::ArrayToBytes(Arc::new(HaarDetailsCodec)));
        };
        for (key, value) in configuration.iter() {
            if key != "version" || *value != json!(FORMAT_VERSION) {
                let text = format!(
                    "the configuration of {DETAILS_CODEC_NAME} has {key} = {value}, but its one key is version, and that is {FORMAT_VERSION}"
                );
                return Err(PluginConfigurationInvalidError::new(text).into());
            }
        }
        Ok(Codec::ArrayToBytes(Arc::new(HaarDetailsCodec)))
    }
}

impl CodecTraits for HaarDetailsCodec {
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn configuration(&self, version: ZarrVersion, _: &CodecMetadataOptions) -> Option<Configuration> {
        let configuration = || serde_json::Map::from_iter([("version".to_owned(), json!(FORMAT_VERSION))]);
        matches!(version, ZarrVersion::V3).then(|| configuration().into())
    }

    fn partial_decoder_capability(&self) -> PartialDecoderCapability {
        PartialDecoderCapability { partial_read: false, partial_decode: false }
    }

    fn partial_encoder_capability(&self) -> PartialEncoderCapability {
        PartialEncoderCapability { partial_encode: false }
    }
}

impl ArrayCodecTraits for HaarDetailsCodec {
    fn recommended_concurrency(&self, _: &[NonZeroU64], _: &DataType) -> Result<RecommendedConcurrency, CodecError> {
        Ok(RecommendedConcurrency::new_maximum(1))
    }
}

fn of_two_arrays(doing: &str) -> CodecError {
    CodecError::Other(format!(
        "{DETAILS_CODEC_NAME}: a chunk of details is not {doing} alone, without the samples of the array that it refines; DetailArray reads both"
    ))
}

impl ArrayToBytesCodecTraits for HaarDetailsCodec {
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
        _: ArrayBytes<'a>,
        _: &[NonZeroU64],
        _: &DataType,
        _: &FillValue,
        _: &CodecOptions,
    ) -> Result<ArrayBytesRaw<'a>, CodecError> {
        Err(of_two_arrays("encoded"))
    }

    fn decode<'a>(
        &self,
        _: ArrayBytesRaw<'a>,
        _: &[NonZeroU64],
        _: &DataType,
        _: &FillValue,
        _: &CodecOptions,
    ) -> Result<ArrayBytes<'a>, CodecError> {
        Err(of_two_arrays("decoded"))
    }
}
