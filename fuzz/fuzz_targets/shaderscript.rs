//! Scripts: read, resolved and evaluated at 1.25 s.

#![no_main]

#[path = "../../shaderscript/tests/common/survive.rs"]
mod survive;

libfuzzer_sys::fuzz_target!(|text: &[u8]| {
    survive::survive(text, 1.25);
});
