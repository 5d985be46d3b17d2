//! Measurements of the light in the air: the points of the light grid, which lights what moves.
//!
//! At each point the compiler adds up what comes straight from each light, weighted by the cosine between the way to
//! the light and a direction that is the mean of these ways: that is the point's *directed* light, and so what a surface
//! there would get from lights that faced this direction. (In six maps whose lights are known well, that is what is
//! stored within 5 %.) Its *ambient* light is a quarter of all the rest or of all light, as compilers differ, and whatever
//! they add: it tells nothing that could be relied on. Light that surfaces throw back is in neither.

use super::CalibrationOptions;
use super::samples::{Sample, Site, decode, floor, light_of, mean, pick, shown};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use support::parallel;
use support::random::Random;

/// Least distance of a point from surfaces, id units: compilers move points that lie in something, and do not tell.
const CLEARANCE: f32 = 8.0;

/// Most points that are asked for their surroundings: more of them come in strata.
const MOST: usize = 24_000;

/// One measurement in the air for so many on surfaces.
const SURFACE_PER_GRID_SAMPLE: usize = 4;

/// How much a measurement in the air tells beside one on a surface: of several lights only the sum, one direction's.
const TRUST: f32 = 0.3;

/// How far the middle half of what is stored over what is computed may spread for the grid to be believed, a factor:
/// about as far as in maps whose lights are known.
const MAX_QUARTILE_RATIO: f32 = 2.0;

/// Stored light too dark to be compared, steps of a byte.
const DARK: f32 = 4.0;

/// A point of the light grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LitGridPoint {
    pub position: Vec3,
    /// Visibility cluster that it lies in.
    pub cluster: i32,
    /// Unit vector to where light comes from.
    pub direction: Vec3,
    /// Directed light, irradiance / π.
    pub light: Vec3,
    /// The same as the display shows it on white.
    pub shown: Vec3,
    /// Some channel is at its end.
    pub saturated: bool,
}

/// Lit points that lie in the open where that is `wanted`, in the order of the map's.
pub(super) fn points(
    world: &RelitWorld,
    occluders: &Occluders,
    wanted: impl Fn(Vec3) -> bool,
) -> Vec<LitGridPoint> {
    let Some(layout) = world.bsp.light_grid() else {
        return Vec::new();
    };
    let [nx, ny, _] = layout.counts;
    let place = |i: usize| layout.position(i % nx, i / nx % ny, i / nx / ny);
    let all = &world.bsp.light_grid;
    let lit: Vec<usize> = (0..all.len())
        .filter(|&i| {
            let dark = |p: &q3bsp::GridPoint| p.ambient == [0; 3] || p.directed == [0; 3];
            all.get(i).is_some_and(|p| !dark(p))
                && wanted(place(i))
                && world.bsp.cluster_at(place(i)) >= 0
        })
        .collect();
    let mut random = Random::new(0xA1_0000);
    let chosen: Vec<usize> = pick(lit.len(), MOST, &mut random)
        .filter_map(|k| lit.get(k).copied())
        .collect();
    let found = parallel::map(&chosen, |_, &i| {
        let (point, position) = (all.get(i)?, place(i));
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let mut around = axes.into_iter().flat_map(|axis| [axis, -axis]);
        let direction = point.direction().normalize_or_zero();
        if direction == Vec3::ZERO
            || around.any(|ray| occluders.nearest(position, ray, CLEARANCE).is_some())
        {
            return None;
        }
        Some(LitGridPoint {
            position,
            cluster: world.bsp.cluster_at(position),
            direction,
            light: decode(world, Vec3::from_array(point.directed.map(f32::from)), 1.0),
            shown: shown(Vec3::from_array(point.directed.map(f32::from))),
            saturated: point.directed.contains(&255),
        })
    });
    found.into_iter().flatten().collect()
}

/// About `count` measurements, evenly out of points.
pub(super) fn samples(
    world: &RelitWorld,
    points: &[LitGridPoint],
    count: usize,
    random: &mut Random,
) -> Vec<Sample> {
    let floor = floor(world);
    pick(points.len(), count, random)
        .filter_map(|i| points.get(i))
        .map(|point| Sample {
            site: Site::LightGrid,
            position: point.position,
            normal: point.direction,
            value: point.light,
            shown: point.shown,
            bounce: Vec3::ZERO,
            cluster: point.cluster,
            material: u32::MAX,
            saturated: point.saturated,
            part: 1.0,
            floor,
            trust: 1.0,
            held_out: false,
        })
        .collect()
}

/// Measurements in the air beside those on surfaces. None of them tells anything before it is known how strong the
/// compiler stored light in the air: [`trust_if_consistent`].
pub(super) fn additional_samples(
    world: &RelitWorld,
    points: &[LitGridPoint],
    options: &CalibrationOptions,
) -> Vec<Sample> {
    let mut random = Random::new(options.seed ^ 0xA1);
    let mut found = samples(
        world,
        points,
        options.samples / SURFACE_PER_GRID_SAMPLE,
        &mut random,
    );
    for sample in &mut found {
        sample.trust = 0.0;
    }
    found
}

/// Makes measurements in the air count if `direct`, the light that comes straight from lights that explain what is stored
/// on surfaces, explains them up to a factor, by which stored light is divided. (Compilers scale the grid, and may have
/// added thrown back light to surfaces alone.) Whether they count now.
pub(super) fn trust_if_consistent(
    world: &RelitWorld,
    samples: &mut [Sample],
    direct: &[Vec3],
) -> bool {
    let dark = light_of(world, DARK);
    let mut ratios: Vec<f32> = samples
        .iter()
        .zip(direct)
        .filter(|(s, _)| s.site == Site::LightGrid && !s.saturated && s.level() > dark)
        .map(|(s, light)| s.level() / mean(*light).max(dark * 0.1))
        .collect();
    ratios.sort_by(f32::total_cmp);
    let quarter = |k: usize| ratios.get(ratios.len() * k / 4).copied().unwrap_or(0.0);
    let (low, scale, high) = (quarter(1), quarter(2), quarter(3));
    if !(low > 0.0 && high <= low * MAX_QUARTILE_RATIO) {
        return false;
    }
    for sample in samples.iter_mut().filter(|s| s.site == Site::LightGrid) {
        sample.value /= scale;
    }
    trust(samples, TRUST);
    true
}

/// Sets how much measurements in the air tell. Whether they told anything before.
pub(super) fn trust(samples: &mut [Sample], trust: f32) -> bool {
    let mut was_trusted = false;
    for sample in samples.iter_mut().filter(|s| s.site == Site::LightGrid) {
        was_trusted |= sample.trust > 0.0;
        sample.trust = trust;
    }
    was_trusted
}
