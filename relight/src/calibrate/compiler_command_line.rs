//! Compiler settings from the command line that q3map2 stores in worldspawn.
//!
//! q3map2 writes the command lines of its stages into the worldspawn entity. They state the gamma, whether lights
//! have a cutoff, and *dirt*: ambient occlusion by which all light of a texel is multiplied.
//!
//! Source: meanings and defaults are q3map2's.

use super::compiler;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::Entity;
use std::f32::consts::TAU;

/// Worldspawn key with the command lines of all stages, separated by semicolons.
const COMMAND_LINES: &str = "_q3map2_cmdline";

/// Rays of the ambient occlusion: angles from the normal, degrees, and rays at each angle.
const DIRT_RINGS: ([f32; 3], u32) = ([14.5, 43.5, 72.5], 16);

/// Smallest part of light that dirt leaves: bounds the division.
const LEAST_PART: f32 = 0.1;

/// Settings of the light stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommandLine {
    /// Encoding gamma; 1 for none.
    pub gamma: f32,
    /// Whether lights have a cutoff.
    pub has_cutoff: bool,
    /// Ambient occlusion, if any.
    pub dirt: Option<Dirt>,
}

/// Ambient occlusion by which the compiler multiplies all light of a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dirt {
    /// Distance within which surfaces occlude, id units.
    depth: f32,
    /// Exponent of the occlusion.
    gain: f32,
    /// Factor of the occlusion.
    scale: f32,
}

/// The settings of the last light stage, which computed the stored light. `None` without a command line or with an
/// invalid number.
pub(super) fn command_line(entities: &[Entity]) -> Option<CommandLine> {
    let stages = entities.first()?.last(COMMAND_LINES)?.split(';');
    let words = |stage: &'_ str| stage.split_ascii_whitespace().map(str::to_owned).collect();
    let light: Vec<String> = stages
        .map(words)
        .rfind(|words: &Vec<String>| words.first().is_some_and(|w| w == "-light"))?;
    let is = |option: &str| light.iter().any(|w| w == option);
    let number = |option: &str| {
        let at = light.iter().rposition(|w| w == option)?;
        light.get(at + 1)?.parse::<f32>().ok()
    };
    let or = |option: &str, default: f32| match is(option) {
        true => number(option).filter(|n| n.is_finite() && *n > 0.0),
        false => Some(default),
    };
    Some(CommandLine {
        gamma: or("-gamma", 1.0).filter(|g| compiler::possible(*g))?,
        has_cutoff: is("-fast") || is("-faster"),
        dirt: match is("-dirty") {
            true => Some(Dirt {
                depth: or("-dirtdepth", Dirt::DEFAULT.depth)?,
                gain: or("-dirtgain", Dirt::DEFAULT.gain)?,
                scale: or("-dirtscale", Dirt::DEFAULT.scale)?,
            }),
            false => None,
        },
    })
}

/// The dirt of a calibrated map, if calibration found dirt.
pub(crate) fn dirt_of_calibrated(world: &RelitWorld) -> Option<Dirt> {
    let report = world.calibration.as_ref()?;
    report.dirty.then(|| dirt(&world.bsp.entities()))
}

/// The dirt of a map that has some: from its command line, else the default.
pub(super) fn dirt(entities: &[Entity]) -> Dirt {
    command_line(entities)
        .and_then(|line| line.dirt)
        .unwrap_or(Dirt::DEFAULT)
}

impl Dirt {
    /// q3map2's defaults.
    pub const DEFAULT: Dirt = Dirt {
        depth: 128.0,
        gain: 1.0,
        scale: 1.0,
    };

    /// Part of the light at a position that was stored, 0.1 to 1.
    pub(crate) fn part_stored(&self, occluders: &Occluders, position: Vec3, normal: Vec3) -> f32 {
        let (u, v) = normal.any_orthonormal_pair();
        let (angles, count) = DIRT_RINGS;
        let around = angles.into_iter().flat_map(|angle| {
            let (out, up) = angle.to_radians().sin_cos();
            (0..count).map(move |k| {
                let (sin, cos) = (k as f32 / count as f32 * TAU).sin_cos();
                (u * cos + v * sin) * out + normal * up
            })
        });
        let (mut near, mut rays) = (0.0f32, 0.0);
        for ray in around.chain([normal]) {
            rays += 1.0;
            let hit = occluders.nearest(position, ray, self.depth);
            near += hit
                .filter(|h| !h.sky)
                .map_or(0.0, |h| 1.0 - h.t / self.depth);
        }
        let taken = (near / rays).powf(self.gain).min(1.0) * self.scale;
        (1.0 - taken).clamp(LEAST_PART, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(pairs: &str) -> Vec<Entity> {
        q3bsp::entities::parse(format!("{{ \"classname\" \"worldspawn\" {pairs} }}").as_bytes()).0
    }

    fn parsed(line: &str) -> Option<CommandLine> {
        command_line(&world(&format!("\"{COMMAND_LINES}\" \"{line}\"")))
    }

    #[test]
    fn the_last_light_stage_counts() {
        assert_eq!(command_line(&world("")), None);
        assert_eq!(parsed("-meta -patchmeta; -vis -fast"), None);
        let plain = CommandLine {
            gamma: 1.0,
            has_cutoff: false,
            dirt: None,
        };
        assert_eq!(parsed("-meta; -vis -fast; -light -bounce 8"), Some(plain));
        // A word that is no option is none.
        assert_eq!(parsed("-light -dirt"), Some(plain));
        let line =
            "-vis; -light -gamma 2.2; -light -fast -gamma 1.5 -dirty -dirtdepth 64 -samples 3";
        let dirt = Dirt {
            depth: 64.0,
            gain: 1.0,
            scale: 1.0,
        };
        let expected = CommandLine {
            gamma: 1.5,
            has_cutoff: true,
            dirt: Some(dirt),
        };
        assert_eq!(parsed(line), Some(expected));
        for wrong in [
            "-light -gamma",
            "-light -gamma x",
            "-light -gamma -1",
            "-light -gamma 1e9",
        ] {
            assert_eq!(parsed(wrong), None, "{wrong}");
        }
        assert_eq!(parsed("-light -dirty -dirtdepth nan"), None);
    }

    #[test]
    fn corners_are_occluded_and_open_ground_is_not() {
        let dirt = Dirt::DEFAULT;
        // A wall along y at x = 0, as high as rays go.
        let (a, b, c) = (
            Vec3::new(0.0, -999.0, -999.0),
            Vec3::new(0.0, 999.0, -999.0),
            Vec3::new(0.0, 0.0, 999.0),
        );
        let wall = |sky| Occluders::new(std::iter::once(([a, b, c], sky, 0)));
        let at = |x: f32| dirt.part_stored(&wall(false), Vec3::new(x, 0.0, 0.0), Vec3::Z);
        assert_eq!(at(129.0), 1.0);
        assert!(at(64.0) < 1.0 && at(16.0) < at(64.0) && at(1.0) < at(16.0));
        // Half of the rays but for the one along the normal meet it at once.
        let half = 24.0 / 49.0;
        assert!((at(1e-3) - (1.0 - half)).abs() < 0.07, "{}", at(1e-3));
        // The sky is far away.
        let open = dirt.part_stored(&wall(true), Vec3::new(1.0, 0.0, 0.0), Vec3::Z);
        assert_eq!(open, 1.0);
    }
}
