//! Tests that do not run because something is absent: one line each, which `./test` counts.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// What a test may lack, and the environment variable that forbids it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Game data or a program: `RELIGHT_REQUIRE_DATA`.
    Data,
    /// A Vulkan device, or a feature of one: `RELIGHT_REQUIRE_GPU`.
    Gpu,
}

impl Need {
    fn variable(self) -> &'static str {
        match self {
            Self::Data => "RELIGHT_REQUIRE_DATA",
            Self::Gpu => "RELIGHT_REQUIRE_GPU",
        }
    }
}

/// Whether the environment variable is 1.
pub fn is_set(variable: &str) -> bool {
    std::env::var(variable).is_ok_and(|value| value == "1")
}

/// Reports that the running test ends early for `reason`: `skipped: NAME: reason`, once for each test, on standard
/// error past the capture of the test harness. NAME is the thread's name, which the harness sets to the test's.
pub fn skip(reason: impl Display) {
    static REPORTED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let name = thread::current().name().unwrap_or("unnamed").to_owned();
    let mut reported = REPORTED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(line) = line(&mut reported, &name, &reason.to_string()) {
        // The test's outcome does not depend on the report.
        let _ = io::stderr().write_all(line.as_bytes());
    }
}

/// The report, if the test has none yet. A reason of several lines becomes one.
fn line(reported: &mut BTreeSet<String>, name: &str, reason: &str) -> Option<String> {
    let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
    (reported.insert(name.to_owned())).then(|| format!("skipped: {name}: {reason}\n"))
}

/// [`skip`], where `need` may be absent.
///
/// # Panics
/// When the variable of `need` is 1.
pub fn absent(need: Need, reason: impl Display) {
    assert_optional(need, &reason);
    skip(reason);
}

/// Checks that `need` may be absent, without reporting a skipped test: for a test that runs in part.
///
/// # Panics
/// When the variable of `need` is 1.
pub fn assert_optional(need: Need, reason: impl Display) {
    let variable = need.variable();
    assert!(!is_set(variable), "{reason}, and {variable}=1");
}

/// A Vulkan device, or what was made with one; otherwise [`absent`] with the error. `Device` of `renderer_vk` cannot
/// be named here, because the unit tests of that crate have a `Device` of their own.
///
/// # Panics
/// When there is none and `RELIGHT_REQUIRE_GPU=1`.
pub fn device<T>(made: Result<T, impl Display>) -> Option<T> {
    made.map_err(|error| absent(Need::Gpu, error)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_is_reported_once_and_in_one_line() {
        let mut reported = BTreeSet::new();
        let first = line(&mut reported, "a::b", "no device:\n  none found");
        assert_eq!(
            first.as_deref(),
            Some("skipped: a::b: no device: none found\n")
        );
        assert_eq!(line(&mut reported, "a::b", "no data"), None);
        let other = line(&mut reported, "a::c", "no data");
        assert_eq!(other.as_deref(), Some("skipped: a::c: no data\n"));
    }

    #[test]
    fn the_harness_names_the_thread_of_a_test() {
        let name = "skips::tests::the_harness_names_the_thread_of_a_test";
        assert_eq!(thread::current().name(), Some(name));
    }

    #[test]
    fn a_device_is_handed_on() {
        assert_eq!(device(Ok::<_, String>(7)), Some(7));
    }
}
