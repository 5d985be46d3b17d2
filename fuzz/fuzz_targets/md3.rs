//! MD3 models: read, interpolated, written.

#![no_main]

#[path = "../../q3model/tests/common/survive.rs"]
mod survive;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    survive::survive_md3(bytes);
});
