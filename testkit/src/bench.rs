//! What the benchmarks of the parsers share.

use std::hint::black_box;
use std::io;
use std::time::{Duration, Instant};

/// The file that the command line names, else what is made up.
///
/// # Errors
/// The file cannot be read.
pub fn input(made_up: impl FnOnce() -> Vec<u8>) -> io::Result<Vec<u8>> {
    // cargo adds `--bench`
    match std::env::args().skip(1).find(|a| !a.starts_with("--")) {
        Some(path) => std::fs::read(path),
        None => Ok(made_up()),
    }
}

/// Runs `work` for a second and prints the best time.
pub fn measure<T>(name: &str, bytes: usize, mut work: impl FnMut() -> T) {
    let started = Instant::now();
    let mut best = Duration::MAX;
    while started.elapsed() < Duration::from_secs(1) {
        let run = Instant::now();
        black_box(work());
        best = best.min(run.elapsed());
    }
    let seconds = best.as_secs_f64();
    let rate = bytes as f64 / 1e6 / seconds;
    println!("{name:<12} {rate:>8.1} MB/s, {:.3} ms", seconds * 1e3);
}
