//! What a built array says of its codec.

use std::sync::Arc;

use brickfield_haar::{Kernel, Storages};
use brickfield_haar_zarrs::{HaarCodec, HaarOptions};
use serde_json::{Value, json};
use zarrs::array::{ArrayBuilder, ArrayMetadata, data_type};

fn codecs(codec: HaarCodec) -> Value {
    let mut builder = ArrayBuilder::new(vec![8, 8], vec![8, 8], data_type::uint8(), 0u8);
    let metadata = builder.array_to_bytes_codec(Arc::new(codec)).build_metadata().unwrap();
    serde_json::to_value(ArrayMetadata::V3(metadata)).unwrap()["codecs"].clone()
}

#[test]
fn the_default_codec_is_that_of_the_readme() {
    let readme = include_str!("../../README.md");
    let document = readme.split("```json\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let stated: Value = serde_json::from_str(document).unwrap();
    assert_eq!(codecs(HaarCodec::default()), stated["codecs"]);
}

#[test]
fn every_option_is_stated() {
    let options = HaarOptions {
        kernels: vec![Kernel::LeGall53, Kernel::Haar],
        n_levels: Some(2),
        max_error: 3,
        storages: Storages::Packed,
    };
    let configuration =
        json!({ "version": 1, "kernels": ["5/3", "haar"], "levels": 2, "max_error": 3, "storage": "packed" });
    let codec = HaarCodec::new(options.clone()).unwrap();
    assert_eq!(codecs(codec), json!([{ "name": "brickfield.haar", "configuration": configuration.clone() }]));

    let configuration = configuration.as_object().unwrap().clone().into();
    assert_eq!(HaarCodec::from_configuration(&configuration).unwrap().options(), &options);
}
