//! Builds the stand-in engine's C part: what Rust cannot write, variadic functions and `setjmp`.

fn main() {
    println!("cargo::rerun-if-changed=src/engine/shim.c");
    cc::Build::new()
        .file("src/engine/shim.c")
        .warnings(true)
        .extra_warnings(true)
        .compile("engine_shim");
}
