//! Results of calibration, kept in a folder.
//!
//! A file's name is the hash of all that its result depends on, so that a file is right or not there. Its text is
//! checked as any input is: a damaged one counts as absent, with a warning.

use super::columns::Lamp;
use super::report::Agreement;
use super::samples::Evidence;
use super::{CalibrationOptions, Solution, VERSION};
use crate::exposure::Exposure;
use crate::light::Falloff;
use crate::world::RelitWorld;
use glam::Vec3;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

/// First words of a file.
const MAGIC: &str = "relight-calibration";

/// How the names of its files end.
const KIND: &str = "light";

/// A folder of results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CalibrationCache {
    folder: PathBuf,
}

/// Why a kept result could not be used, or not be kept.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CacheError {
    #[error("{}: cannot be read: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("{}: cannot be written: {source}", path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error("{}: line {line}: {what}; the map is calibrated again", path.display())]
    Damaged {
        path: PathBuf,
        line: usize,
        what: &'static str,
    },
    #[error("{}: {what}; the lists of lights are swept again", path.display())]
    Lists { path: PathBuf, what: &'static str },
}

impl CalibrationCache {
    /// Results in a folder, which is made when the first is kept.
    pub fn new(folder: impl Into<PathBuf>) -> CalibrationCache {
        CalibrationCache {
            folder: folder.into(),
        }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of a result of some kind.
    pub(crate) fn path(&self, key: u128, kind: &str) -> PathBuf {
        self.folder.join(format!("{key:032x}.{kind}"))
    }

    /// A kept result for `known` known sources; `None` when there is none.
    pub(super) fn read(&self, key: u128, known: usize) -> Result<Option<Solution>, CacheError> {
        let path = self.path(key, KIND);
        let Some(bytes) = read_file(&path)? else {
            return Ok(None);
        };
        match parse(&String::from_utf8_lossy(&bytes), known) {
            Ok(solution) => Ok(Some(solution)),
            Err((line, what)) => Err(CacheError::Damaged { path, line, what }),
        }
    }

    /// Keeps a result.
    pub(super) fn write(&self, key: u128, solution: &Solution) -> Result<(), CacheError> {
        self.write_file(self.path(key, KIND), print(solution).as_bytes())
    }

    /// Writes a file of the folder. It appears whole or not at all.
    pub(crate) fn write_file(&self, path: PathBuf, bytes: &[u8]) -> Result<(), CacheError> {
        let unfinished = path.with_extension(format!("{}.part", std::process::id()));
        let write = || {
            std::fs::create_dir_all(&self.folder)?;
            std::fs::write(&unfinished, bytes)?;
            std::fs::rename(&unfinished, &path)
        };
        write().map_err(|source| {
            // What is left of a failed attempt; that it may not be there is fine.
            let _ = std::fs::remove_file(&unfinished);
            CacheError::Write { path, source }
        })
    }
}

/// The bytes of a file; `None` when there is none.
pub(crate) fn read_file(path: &Path) -> Result<Option<Vec<u8>>, CacheError> {
    match std::fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(CacheError::Read {
            path: path.into(),
            source,
        }),
    }
}

/// Text of a result. Rust prints the shortest number that reads back as the same one.
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
    let ends = if report.ends { " ends" } else { "" };
    let dirty = if report.dirty { " dirty" } else { "" };
    let _ = writeln!(text, "gamma {}{ends}{dirty}", report.gamma);
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

/// Reads what [`print()`] wrote; else the line that is wrong, and how.
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
        // Light is never negative.
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
                (solution.report.ends, solution.report.dirty) = match more {
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

/// Hash of everything that calibrating a world depends on.
pub(super) fn key(world: &RelitWorld, options: &CalibrationOptions) -> u128 {
    key_from(Hash::new(), world, options)
}

/// The same of a part of the result that `hash` has begun to name.
pub(super) fn key_from(mut hash: Hash, world: &RelitWorld, options: &CalibrationOptions) -> u128 {
    hash.number(u64::from(VERSION));
    hash.number(options.samples as u64);
    hash.number(options.candidates as u64);
    hash.number(options.seed);
    hash.number(u64::from(options.bounces));
    hash.world(world);
    hash.finish()
}

/// Two 64-bit lanes of multiply and rotate. Chance collisions matter here, enemies do not: who can write the folder
/// can write anything into it.
pub(crate) struct Hash(u64, u64);

impl Hash {
    pub(crate) fn new() -> Hash {
        Hash(0xCBF2_9CE4_8422_2325, 0x9E37_79B9_7F4A_7C15)
    }

    /// What light in a world depends on: its geometry, its materials, its lights.
    pub(crate) fn world(&mut self, world: &RelitWorld) {
        // The file's own bytes: light, geometry, visibility. The entities hold the grid's size.
        self.bytes(&world.bsp.write());
        for surface in &world.surfaces {
            for number in [
                surface.material,
                surface.model,
                surface.first_index,
                surface.num_indices,
                surface.light_page as u32,
            ] {
                self.number(u64::from(number));
            }
        }
        for vertex in &world.vertices {
            self.vector(vertex.position);
        }
        for material in &world.materials {
            self.number(u64::from(material.is_sky()));
            let passed = u64::from(material.class.passed);
            self.number(material.class.class as u64 | passed << 8);
            self.number(u64::from(material.emission.is_some()));
            self.vector(material.albedo);
            if let Some(holes) = &material.holes {
                self.bytes(&holes.bytes());
            }
            for shade in &material.shades {
                self.vector(shade.linear);
                self.vector(shade.encoded);
                self.vector(shade.mirrored);
            }
            self.vector(material.shown);
            for style in &material.baked.styles {
                self.bytes(format!("{style:?}").as_bytes());
            }
        }
        for page in &world.pages {
            self.bytes(&page.0);
        }
        for light in &world.lights {
            light.vertices.iter().for_each(|v| self.vector(*v));
            self.vector(light.radiance);
            self.number(u64::from(light.surface) << 8 | u64::from(light.two_sided));
            self.number(light.source as u64);
        }
        for light in &world.point_lights {
            self.vector(light.origin);
            self.vector(light.intensity);
            self.number(u64::from(light.falloff.reach().unwrap_or(0.0).to_bits()));
        }
        for sun in &world.suns {
            self.vector(sun.direction);
            self.vector(sun.irradiance);
        }
        self.vector(world.ambient);
        self.number(u64::from(world.color_exponent.to_bits()));
    }

    pub(crate) fn number(&mut self, number: u64) {
        self.0 = (self.0 ^ number).wrapping_mul(0x0000_0100_0000_01B3);
        self.0 ^= self.0 >> 29;
        self.1 = (self.1.rotate_left(23) ^ number).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    }

    pub(crate) fn vector(&mut self, v: Vec3) {
        let [x, y, z] = v.to_array().map(|c| u64::from(c.to_bits()));
        self.number(x << 32 | y);
        self.number(z);
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        let (whole, rest) = bytes.as_chunks::<8>();
        whole
            .iter()
            .for_each(|b| self.number(u64::from_le_bytes(*b)));
        rest.iter().for_each(|b| self.number(u64::from(*b)));
    }

    pub(crate) fn finish(mut self) -> u128 {
        self.number(0x5851_F42D_4C95_7F2D);
        u128::from(self.0) << 64 | u128::from(self.1)
    }
}
