//! Samples from the light grid, which lights moving models.
//!
//! At each point the compiler sums the unshadowed direct light of every visible light, weighted by the cosine
//! between the direction to the light and the mean of these directions. That sum is the point's *directed* light:
//! the irradiance (over π) of a surface that faces the mean direction. On six maps with known lights the stored
//! values agree with this within 5 %. The *ambient* light of a point is a quarter of the remaining or of all light,
//! depending on the compiler, plus constants; it is not used. Neither contains reflected light.

use super::CalibrationOptions;
use super::samples::{Sample, Site, decode, floor, light_of, mean, pick, shown};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use support::parallel;
use support::random::Random;

/// Smallest distance of a usable point from surfaces, id units: compilers move points that lie in solid without
/// recording it.
const CLEARANCE: f32 = 8.0;

/// Largest number of points that are tested by rays; larger grids are stratified.
const MOST: usize = 24_000;

/// Surface samples for one light-grid sample.
const SURFACE_PER_GRID_SAMPLE: usize = 4;

/// Weight of a light-grid sample relative to a surface sample: it stores the sum of several lights in one
/// direction.
const TRUST: f32 = 0.3;

/// Largest ratio of the upper to the lower quartile of stored over computed light at which the grid is used: about
/// the ratio in maps whose lights are known.
const MAX_QUARTILE_RATIO: f32 = 2.0;

/// Stored light below which ratios are not formed, steps of a byte.
const DARK: f32 = 4.0;

/// A lit point of the light grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LitGridPoint {
    pub position: Vec3,
    /// PVS cluster of the position.
    pub cluster: i32,
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Directed light, irradiance / π.
    pub light: Vec3,
    /// Directed light as the display shows it on white, encoded.
    pub shown: Vec3,
    /// Whether a channel is 255.
    pub saturated: bool,
}

/// Lit points with [`CLEARANCE`] for which `wanted` holds, in the order of the map.
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

/// About `count` samples, evenly chosen from `points`.
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

/// Light-grid samples to be added to surface samples. Their trust is 0 until [`trust_if_consistent`] finds the
/// scale of the grid.
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

/// Gives the light-grid samples weight if `direct`, the direct light of a fit to the surfaces, explains them up to
/// one factor; divides them by this factor. (Compilers scale the grid, and may add reflected light to surfaces
/// only.) Returns whether they now count.
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

/// Sets the trust of all light-grid samples; returns whether they counted before.
pub(super) fn trust(samples: &mut [Sample], trust: f32) -> bool {
    let mut was_trusted = false;
    for sample in samples.iter_mut().filter(|s| s.site == Site::LightGrid) {
        was_trusted |= sample.trust > 0.0;
        sample.trust = trust;
    }
    was_trusted
}
