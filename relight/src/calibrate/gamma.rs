//! Which gamma the map's compiler encoded light with.
//!
//! Compilers store light as it is unless told otherwise; told so (`-gamma`), they store (L / 255)^(1 / g). Nothing in a
//! map says so, but light is linear in its sources only as it was before: taken for linear, bright light is too weak
//! beside dim light, suns are turned down, and lights are put in to fill what is left. So a map is fitted with less effort
//! for some gammas, and one of them is believed where it leaves much less unexplained *of what is stored*, another leaves
//! less as well, and the light that directives tell of does not speak against it.

use super::{CalibrationCache, CalibrationOptions, Evidence};
use crate::world::RelitWorld;

/// Gammas tried: about the display's own, and two between it and none.
const TRIED: [f32; 3] = [1.4, 1.8, 2.2];

/// The one that is tried first: were light encoded with any of them, it would explain more than none.
const FIRST: f32 = 1.8;

/// Part of the error without gamma that the best may leave to be believed.
const BELIEVED: f32 = 0.8;

/// Part that one more of them may leave, and the first, for the others to be tried.
const SUPPORTED: f32 = 0.92;

/// How many times as far off as without gamma what directives say may be: it was the compiler that read them.
const CONTRADICTED: f32 = 1.5;

/// Error that leaves nothing to be explained, stops.
const NOTHING: f32 = 0.01;

/// Least measurements of a trial.
const SAMPLES: usize = 1000;

/// Whether a number can be the gamma of a compiler.
pub(super) fn possible(gamma: f32) -> bool {
    gamma == 1.0 || TRIED.contains(&gamma)
}

/// Looks for the gamma of a world's compiler; 1 for none. `progress` gets the part that is done.
///
/// Cut-outs let all light through here: that single rays are let through by a grate or not is noise, which a wrong gamma
/// would seem to explain.
pub(super) fn find(
    world: &mut RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> f32 {
    let holes: Vec<_> = (world.materials.iter_mut().map(|m| m.holes.take())).collect();
    let found = without_cut_outs(world, silent, options, progress);
    for (material, holes) in world.materials.iter_mut().zip(holes) {
        material.holes = holes;
    }
    found
}

fn without_cut_outs(
    world: &mut RelitWorld,
    silent: &[u32],
    options: &CalibrationOptions,
    progress: &mut dyn FnMut(f32),
) -> f32 {
    let less = CalibrationOptions {
        samples: (options.samples / 3).max(SAMPLES).min(options.samples),
        candidates: options.candidates / 5,
        cache: None::<CalibrationCache>,
        ..*options
    };
    let steps = 1.0 + TRIED.len() as f32;
    let mut done = 0.0;
    let mut error = |world: &mut RelitWorld, gamma: f32| {
        progress(done / steps);
        done += 1.0;
        world.stored_gamma = gamma;
        // What is stored on surfaces decides, with lights that fall off as light does.
        let report = super::find(world, silent, &less, false, &mut |_| ()).report;
        world.stored_gamma = 1.0;
        let found = [report.before.median_stops, report.after.median_stops];
        (report.evidence != Evidence::Nothing).then_some(found)
    };
    let Some([said, none]) = error(world, 1.0).filter(|[_, e]| *e > NOTHING) else {
        return 1.0;
    };
    let fallback = world.report.fallback;
    let mut error = |world: &mut RelitWorld, gamma: f32| {
        let [before, after] = error(world, gamma)?;
        // A map without any light has what loading put there in its place.
        (fallback || before <= said * CONTRADICTED).then_some(after)
    };
    let Some(first) = error(world, FIRST).filter(|e| *e < none * SUPPORTED) else {
        return 1.0;
    };
    let mut found: Vec<(f32, f32)> = TRIED
        .into_iter()
        .filter(|gamma| *gamma != FIRST)
        .filter_map(|gamma| Some((error(world, gamma)?, gamma)))
        .collect();
    found.push((first, FIRST));
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    match found[..] {
        [(best, gamma), (next, _), ..] if best < none * BELIEVED && next < none * SUPPORTED => {
            gamma
        }
        _ => 1.0,
    }
}
