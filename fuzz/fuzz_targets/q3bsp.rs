//! Maps of all formats: read, walked, written back.

#![no_main]

#[path = "../../q3bsp/tests/common/exercise.rs"]
mod exercise;
#[path = "../../q3bsp/tests/common/survive.rs"]
mod survive;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    survive::survive(bytes);
});
