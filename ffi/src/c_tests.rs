//! For tests: C code compiled by the system's compiler, which defines C layouts and `longjmp`.

use std::path::{Path, PathBuf};
use std::process::Command;

use testkit::Need;

/// A file of this crate's sources.
pub fn source(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("src")
        .join(relative)
}

/// Compiles `input` with extra arguments. `None`, with a report of a skipped test, without a C compiler; with
/// `RELIGHT_REQUIRE_DATA=1` that is a failure.
pub fn compile(input: &Path, output: &Path, arguments: &[&str]) -> Option<()> {
    let result = Command::new("cc")
        .args(arguments)
        .arg("-o")
        .arg(output)
        .arg(input)
        .output();
    match result {
        Ok(result) => {
            assert!(
                result.status.success(),
                "{}: {}",
                input.display(),
                String::from_utf8_lossy(&result.stderr)
            );
            Some(())
        }
        Err(error) => {
            testkit::absent(Need::Data, format!("no C compiler: {error}"));
            None
        }
    }
}

/// A folder for one test's files, removed by the test itself.
pub fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("relight-ffi-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}
