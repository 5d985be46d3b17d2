//! Calibration results in files of the cache folder.
//!
//! The file name is the hash of everything that the result depends on, so a file is either current or absent. A file
//! of another version counts as absent; so does a damaged file, which gives a warning.

use super::{Agreement, CalibrationOptions, Solution, VERSION, compiler};
use crate::cache::{CacheError, CalibrationCache, add_world, read_file};
use crate::world::RelitWorld;
use glam::Vec3;
use serde::de::Error as _;
use serde::{Deserialize, Serialize};
use support::hash::Hash;

/// Extension of the files.
const KIND: &str = "light";

/// A file: JSON of a solution, of type `S`.
#[derive(Serialize, Deserialize)]
struct Cached<S> {
    version: u32,
    solution: S,
}

/// The cached result for a world with `known` known sources, if there is one of this version.
pub(super) fn read(
    cache: &CalibrationCache,
    key: u128,
    known: usize,
) -> Result<Option<Solution>, CacheError> {
    let path = cache.path(key, KIND);
    let Some(bytes) = read_file(&path)? else {
        return Ok(None);
    };
    parse(&bytes, known).map_err(|source| CacheError::Damaged { path, source })
}

/// Writes a result to the cache.
pub(super) fn write(
    cache: &CalibrationCache,
    key: u128,
    solution: &Solution,
) -> Result<(), CacheError> {
    let path = cache.path(key, KIND);
    let version = VERSION;
    match serde_json::to_vec(&Cached { version, solution }) {
        Ok(bytes) => cache.write_file(path, &bytes),
        Err(problem) => Err(CacheError::Write {
            path,
            source: problem.into(),
        }),
    }
}

/// The solution in a file; `None` if the file has another version.
fn parse(bytes: &[u8], known: usize) -> Result<Option<Solution>, serde_json::Error> {
    let file: Cached<serde_json::Value> = serde_json::from_slice(bytes)?;
    if file.version != VERSION {
        return Ok(None);
    }
    let solution = Solution::deserialize(file.solution)?;
    if is_possible(&solution, known) {
        Ok(Some(solution))
    } else {
        Err(serde_json::Error::custom("impossible light"))
    }
}

/// Whether calibration can have found it in a map with `known` known sources.
fn is_possible(solution: &Solution, known: usize) -> bool {
    let strength = |v: &Vec3| v.is_finite() && v.min_element() >= 0.0;
    let agreement =
        |a: &Agreement| (a.median_stops + a.worst_tenth_stops + a.sum_ratio).is_finite();
    let report = &solution.report;
    solution.known.len() == known
        && agreement(&report.before)
        && agreement(&report.after)
        && compiler::possible(report.gamma)
        && solution.exposure.is_none_or(|e| e.is_possible())
        && strength(&solution.ambient)
        && solution.known.iter().all(strength)
        && solution.splashes.iter().all(strength)
        && (solution.placed.iter()).all(|(lamp, intensity)| {
            let reach = lamp.falloff.reach().unwrap_or(1.0);
            lamp.origin.is_finite() && reach.is_finite() && reach > 0.0 && strength(intensity)
        })
        && (solution.suns.iter()).all(|(to, light)| to.is_normalized() && strength(light))
}

/// Hash of everything that a calibration depends on.
pub(super) fn key(world: &RelitWorld, options: &CalibrationOptions) -> u128 {
    key_from(Hash::new(), world, options)
}

/// [`key`] continued from a hash that already names a part of the result.
pub(super) fn key_from(mut hash: Hash, world: &RelitWorld, options: &CalibrationOptions) -> u128 {
    hash.number(u64::from(VERSION));
    hash.number(options.samples as u64);
    hash.number(options.candidates as u64);
    hash.number(options.seed);
    hash.number(u64::from(options.bounces));
    add_world(&mut hash, world);
    hash.finish()
}
