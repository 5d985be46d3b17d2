//! Compiler settings from the command line that q3map2 stores in worldspawn.
//!
//! q3map2 writes the command lines of its stages into the worldspawn entity. They state the gamma, whether lights
//! have a cutoff, and *dirt*: ambient occlusion by which all light of a texel is multiplied.
//!
//! Source: meanings and defaults are q3map2's.

use super::compiler;
use super::dirt::Dirt;
use crate::world::RelitWorld;
use q3bsp::Entity;

/// Worldspawn key with the command lines of all stages, separated by semicolons.
const COMMAND_LINES: &str = "_q3map2_cmdline";

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
}
