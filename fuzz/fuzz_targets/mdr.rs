//! MDR models: read, posed, written.

#![no_main]

#[path = "../../q3model/tests/common/survive.rs"]
mod survive;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    survive::survive_mdr(bytes);
});
