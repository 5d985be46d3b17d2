//! Link options of the library that the engine loads.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Cargo sets it.
    let os = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    if matches!(os.as_str(), "linux" | "freebsd" | "netbsd" | "openbsd") {
        // The engine unloads a renderer on every vid_restart. Code that ever ran a thread cannot be unmapped
        // safely, and what is unmapped and what is not would depend on what ran: keep the library, always.
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
