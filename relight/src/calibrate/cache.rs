//! Cached calibration results.
//!
//! The file name is the hash of everything that the result depends on, so a file is either current or absent. A
//! damaged file counts as absent and gives a warning.

use super::columns::Lamp;
use super::{CalibrationOptions, Solution, VERSION};
use crate::cache::{CacheError, CalibrationCache, add_world, read_file};
use crate::emitters::Agreement;
use crate::emitters::Evidence;
use crate::exposure::Exposure;
use crate::light::Falloff;
use crate::world::RelitWorld;
use glam::Vec3;
use std::fmt::Write as _;
use support::hash::Hash;

/// First word of a file.
const MAGIC: &str = "relight-calibration";

/// Extension of the files.
const KIND: &str = "light";

/// The cached result for a world with `known` known sources, if there is one.
pub(super) fn read(
    cache: &CalibrationCache,
    key: u128,
    known: usize,
) -> Result<Option<Solution>, CacheError> {
    let path = cache.path(key, KIND);
    let Some(bytes) = read_file(&path)? else {
        return Ok(None);
    };
    match parse(&String::from_utf8_lossy(&bytes), known) {
        Ok(solution) => Ok(Some(solution)),
        Err((line, what)) => Err(CacheError::Damaged { path, line, what }),
    }
}

/// Writes a result to the cache.
pub(super) fn write(
    cache: &CalibrationCache,
    key: u128,
    solution: &Solution,
) -> Result<(), CacheError> {
    cache.write_file(cache.path(key, KIND), print(solution).as_bytes())
}

/// Text of a result. Rust prints the shortest number that parses to the same value.
fn print(solution: &Solution) -> String {
    let mut text = String::new();
    let report = &solution.report;
    let evidence = report.evidence.label();
    let three = |v: Vec3| format!("{} {} {}", v.x, v.y, v.z);
    let agreement =
        |a: &Agreement| format!("{} {} {}", a.median_stops, a.worst_tenth_stops, a.sum_ratio);
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{MAGIC} {VERSION}");
    let _ = writeln!(
        text,
        "evidence {evidence} {} {}",
        report.samples, report.held_out
    );
    let _ = writeln!(text, "before {}", agreement(&report.before));
    let _ = writeln!(text, "after {}", agreement(&report.after));
    let has_cutoff = if report.has_cutoff { " ends" } else { "" };
    let dirty = if report.dirty { " dirty" } else { "" };
    let _ = writeln!(text, "gamma {}{has_cutoff}{dirty}", report.gamma);
    let _ = writeln!(text, "ambient {}", three(solution.ambient));
    if let Some(Exposure { scale, middle }) = solution.exposure {
        let _ = writeln!(text, "exposure {scale} {middle}");
    }
    for strength in &solution.known {
        let _ = writeln!(text, "known {}", three(*strength));
    }
    for (lamp, intensity) in &solution.placed {
        let reach = lamp
            .falloff
            .reach()
            .map_or(String::new(), |r| format!(" {r}"));
        let _ = writeln!(
            text,
            "placed {} {}{reach}",
            three(lamp.origin),
            three(*intensity)
        );
    }
    for strength in &solution.splashes {
        let _ = writeln!(text, "splash {}", three(*strength));
    }
    for (direction, irradiance) in &solution.suns {
        let _ = writeln!(text, "sun {} {}", three(*direction), three(*irradiance));
    }
    let _ = writeln!(text, "end {}", solution.lights());
    text
}

/// Parses the text of [`print()`]. The error is a line number and a message.
fn parse(text: &str, known: usize) -> Result<Solution, (usize, &'static str)> {
    let mut lines = text.lines().enumerate();
    let header = lines.next().map(|(_, l)| l.split_whitespace());
    let header: Vec<&str> = header.into_iter().flatten().collect();
    if header != [MAGIC, &VERSION.to_string()] {
        return Err((1, "not a result of this version"));
    }
    let mut solution = Solution::default();
    let mut ended = false;
    for (number, line) in lines {
        let wrong = |what| (number + 1, what);
        if ended {
            return Err(wrong("text after the end"));
        }
        let mut words = line.split_whitespace();
        let key = words.next().unwrap_or("");
        let words: Vec<&str> = words.collect();
        let numbers: Vec<f32> = words
            .iter()
            .map(|w| w.parse().unwrap_or(f32::NAN))
            .collect();
        let finite = numbers.iter().all(|n| n.is_finite());
        let agreement = match numbers[..] {
            [median_stops, worst_tenth_stops, sum_ratio] if finite => Some(Agreement {
                median_stops,
                worst_tenth_stops,
                sum_ratio,
            }),
            _ => None,
        };
        // Strengths are not negative.
        let light = |v: &[f32]| match *v {
            [x, y, z] if finite && v.iter().all(|n| *n >= 0.0) => Ok(Vec3::new(x, y, z)),
            _ => Err(wrong("not three strengths")),
        };
        match key {
            "evidence" => {
                let count = |k: usize| words.get(k).and_then(|w| w.parse().ok());
                let evidence = words.first().and_then(|w| Evidence::from_label(w));
                let evidence = evidence.ok_or(wrong("unknown evidence"))?;
                solution.report.evidence = evidence;
                solution.report.samples = count(1).ok_or(wrong("not a count"))?;
                solution.report.held_out = count(2).ok_or(wrong("not a count"))?;
            }
            "before" => solution.report.before = agreement.ok_or(wrong("not three numbers"))?,
            "after" => solution.report.after = agreement.ok_or(wrong("not three numbers"))?,
            "gamma" => {
                let (gamma, more) = match (&numbers[..], words.get(1..)) {
                    ([gamma, ..], Some(more)) if super::compiler::possible(*gamma) => (gamma, more),
                    _ => return Err(wrong("not a gamma")),
                };
                solution.report.gamma = *gamma;
                (solution.report.has_cutoff, solution.report.dirty) = match more {
                    [] => (false, false),
                    ["ends"] => (true, false),
                    ["dirty"] => (false, true),
                    ["ends", "dirty"] => (true, true),
                    _ => return Err(wrong("unknown word")),
                };
            }
            "exposure" => match numbers[..] {
                [scale, middle] => {
                    let found = Exposure { scale, middle };
                    solution.exposure = found.is_possible().then_some(found);
                    if solution.exposure.is_none() {
                        return Err(wrong("not an exposure"));
                    }
                }
                _ => return Err(wrong("not an exposure")),
            },
            "ambient" => solution.ambient = light(&numbers)?,
            "known" => solution.known.push(light(&numbers)?),
            "splash" => solution.splashes.push(light(&numbers)?),
            "placed" => {
                let (numbers, falloff) = match numbers[..] {
                    [.., reach] if numbers.len() == 7 && reach > 0.0 => {
                        (numbers.get(..6), Falloff::Linear { reach })
                    }
                    _ => (numbers.get(..), Falloff::InverseSquare),
                };
                let (origin, intensity) = match numbers.and_then(|n| n.split_at_checked(3)) {
                    Some((&[x, y, z], rest)) => (Vec3::new(x, y, z), light(rest)?),
                    _ => return Err(wrong("not a place")),
                };
                solution.placed.push((Lamp { origin, falloff }, intensity));
            }
            "sun" => {
                let (direction, irradiance) = match numbers.split_at_checked(3) {
                    Some((&[x, y, z], rest)) => (Vec3::new(x, y, z), light(rest)?),
                    _ => return Err(wrong("not a direction")),
                };
                if !direction.is_normalized() {
                    return Err(wrong("not a unit vector"));
                }
                solution.suns.push((direction, irradiance));
            }
            "end" => {
                let count = words.first().and_then(|w| w.parse().ok());
                if count != Some(solution.lights()) {
                    return Err(wrong("lights are missing"));
                }
                ended = true;
            }
            _ => return Err(wrong("unknown key")),
        }
    }
    if !ended {
        return Err((text.lines().count(), "the end is missing"));
    }
    if solution.known.len() != known {
        return Err((text.lines().count(), "not for this map's lights"));
    }
    solution.report.known = known;
    solution.report.placed = solution.placed.len();
    solution.report.suns = solution.suns.len();
    Ok(solution)
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
