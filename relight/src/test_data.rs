//! Where tests find OpenArena's data.

use std::path::PathBuf;

/// OpenArena's game folder: `OPENARENA_DATA`, or where Debian installs it. `None`, with a line that
/// says so, when it is absent; a failure instead when `RELIGHT_REQUIRE_DATA=1`.
pub(crate) fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("OPENARENA_DATA").map_or_else(
        || PathBuf::from("/usr/share/games/openarena/baseoa"),
        PathBuf::from,
    );
    if folder.is_dir() {
        return Some(folder);
    }
    let required = std::env::var("RELIGHT_REQUIRE_DATA").is_ok_and(|v| v == "1");
    assert!(
        !required,
        "{}: OpenArena's data is required",
        folder.display()
    );
    println!("skipped: no OpenArena data in {}", folder.display());
    None
}
