//! The feature `serde`: what was serialized is deserialized again.

use q3model::{FONT_FILE_BYTES, FontInfo, Skin};
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Debug;

#[path = "common/samples.rs"]
mod samples;

fn same_after_json<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let json = serde_json::to_string(value).unwrap();
    assert_eq!(&serde_json::from_str::<T>(&json).unwrap(), value);
}

#[test]
fn models_skins_and_fonts_are_the_same_after_json() {
    same_after_json(&samples::md3());
    same_after_json(&samples::mdr());
    same_after_json(&samples::iqm());
    same_after_json(&samples::iqm().skeleton());
    same_after_json(&Skin::parse(b"head,models/head\nbody,models/body\n"));
    let mut bytes = vec![0; FONT_FILE_BYTES];
    bytes[48..52].copy_from_slice(b"font");
    same_after_json(&FontInfo::parse(&bytes).unwrap());
}
