//! What the map's compiler did to light: with which gamma it encoded it, and whether it let lights end.
//!
//! Compilers store light as it is unless told otherwise; told so (`-gamma`), they store (L / 255)^(1 / g). Nothing in a
//! map says so, but light is linear in its sources only as it was before: taken for linear, bright light is too weak
//! beside dim light, suns are turned down, and lights are put in to fill what is left. To save time (`-fast`) they leave
//! out of a texel what a light adds less than a step of light to, so that all light of many weak lights has an end. So a
//! map is fitted with less effort for some gammas and with lights that end, and one of them is believed where it leaves
//! much less unexplained *of what is stored*, of gammas another leaves less as well, and the light that directives tell of
//! does not speak against it. Compared is the error at all texels, fitted ones too: these fits have the same freedom, and a
//! fifth of the texels would leave the choice to chance.

use super::{CalibrationCache, CalibrationOptions, Evidence};
use crate::world::RelitWorld;

/// Gammas tried: about the display's own, and two between it and none.
const TRIED: [f32; 3] = [1.4, 1.8, 2.2];

/// The one that is tried first: were light encoded with any of them, it would explain more than none.
const FIRST: f32 = 1.8;

/// Part of the error without gamma that the best may leave to be believed.
const BELIEVED: f32 = 0.87;

/// Part that one more of them may leave, and the first, for the others to be tried.
const SUPPORTED: f32 = 0.92;

/// Gammas that explain light nearly as well as the best, a factor of the error: of these the largest is believed, as the
/// display's own is what compilers are told as a rule.
const ALIKE: f32 = 1.07;

/// Part of the error without gamma that may be left with all that is found.
const BETTER: f32 = 0.92;

/// Part of the error of lights without an end that such with an end may leave to be believed.
const ENDED: f32 = 0.97;

/// How many times as far off as without gamma what directives say may be: it was the compiler that read them.
const CONTRADICTED: f32 = 1.5;

/// Error that leaves nothing to be explained, stops.
const NOTHING: f32 = 0.01;

/// Least measurements of a trial.
const SAMPLES: usize = 1000;

/// Light, in steps of 1 / 255 as compilers count it before their gamma, at which lights end.
const LAST_STEP: f32 = 1.0;

/// Whether a number can be the gamma of a compiler.
pub(super) fn possible(gamma: f32) -> bool {
    gamma == 1.0 || TRIED.contains(&gamma)
}

/// What a compiler did to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Compiler {
    /// What it encoded light with; 1 for nothing.
    pub gamma: f32,
    /// Whether its lights end.
    pub ends: bool,
}

impl Compiler {
    /// Stores light as it is.
    const PLAIN: Compiler = Compiler {
        gamma: 1.0,
        ends: false,
    };

    /// The value of [`RelitWorld::light_end`]. A stored byte of 255 is light of 4 (the engine's overbright shift), to the
    /// power of gamma: a step of what was encoded is a 255th of that.
    pub fn light_end(self) -> f32 {
        if self.ends {
            LAST_STEP / 255.0 * 4.0f32.powf(self.gamma)
        } else {
            0.0
        }
    }
}

/// Looks for what a world's compiler did. `progress` gets the part that is done.
///
/// Cut-outs let all light through here: that single rays are let through by a grate or not is noise, which a wrong gamma
/// would seem to explain.
pub(super) fn find(
    world: &mut RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> Compiler {
    let holes: Vec<_> = (world.materials.iter_mut().map(|m| m.holes.take())).collect();
    let found = without_cut_outs(world, silent, options, progress);
    for (material, holes) in world.materials.iter_mut().zip(holes) {
        material.holes = holes;
    }
    found.unwrap_or(Compiler::PLAIN)
}

fn without_cut_outs(
    world: &mut RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> Option<Compiler> {
    let less = CalibrationOptions {
        samples: (options.samples / 3).max(SAMPLES).min(options.samples),
        candidates: options.candidates / 5,
        cache: None::<CalibrationCache>,
        ..*options
    };
    let steps = 3.0 + TRIED.len() as f32;
    let mut done = 0.0;
    // Error of what directives say, and of what is fitted.
    let mut error = |world: &mut RelitWorld, compiler: Compiler| {
        progress(done / steps);
        done += 1.0;
        (world.stored_gamma, world.light_end) = (compiler.gamma, compiler.light_end());
        // What is stored on surfaces decides, with lights that fall off as light does.
        let found = super::find(world, silent, &less, false, &mut |_| ());
        (world.stored_gamma, world.light_end) = (1.0, 0.0);
        let errors = [found.report.before.median_stops, found.overall.median_stops];
        (found.report.evidence != Evidence::Nothing).then_some(errors)
    };
    let [said, endless] = error(world, Compiler::PLAIN).filter(|[_, e]| *e > NOTHING)?;
    let ended = Compiler {
        ends: true,
        ..Compiler::PLAIN
    };
    let ended_error = error(world, ended).map_or(f32::INFINITY, |[_, e]| e);
    let linear = Compiler {
        gamma: 1.0,
        ends: ended_error < endless * ENDED,
    };
    let fallback = world.report.fallback;
    let mut trial = |world: &mut RelitWorld, compiler: Compiler| {
        let [before, after] = error(world, compiler)?;
        // A map without any light has what loading put there in its place.
        (fallback || before <= said * CONTRADICTED).then_some(after)
    };
    // Like is compared with like: ends that belong to one gamma mislead with another.
    let with = |gamma| Compiler { gamma, ends: false };
    let Some(first) = trial(world, with(FIRST)).filter(|e| *e < endless * SUPPORTED) else {
        return Some(linear);
    };
    let mut found: Vec<(f32, f32)> = TRIED
        .into_iter()
        .filter(|gamma| *gamma != FIRST)
        .filter_map(|gamma| Some((trial(world, with(gamma))?, gamma)))
        .collect();
    found.push((first, FIRST));
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [(best, _), (next, _), ..] = found[..] else {
        return Some(linear);
    };
    if best >= endless * BELIEVED || next >= endless * SUPPORTED {
        return Some(linear);
    }
    let alike = found.into_iter().filter(|(e, _)| *e <= best * ALIKE);
    let (error, gamma) = alike.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let ended = Compiler { gamma, ends: true };
    let ended_with = trial(world, ended).unwrap_or(f32::INFINITY);
    let ends = ended_with < error * ENDED;
    let none = endless.min(ended_error);
    if error.min(ended_with) >= none * BETTER {
        return Some(linear);
    }
    Some(Compiler { gamma, ends })
}
