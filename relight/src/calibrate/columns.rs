//! The columns of the linear system: irradiance that each light source gives to each sample.
//!
//! A column holds, for every sample that its source reaches, the irradiance over π of a source of strength 1. The
//! fit finds the strength, channel by channel. Shadow rays decide what a source reaches.

use super::cutoff::{Piece, pieces_of};
use super::sample_soa::{NEAREST, SampleSoa};
use super::samples::{Sample, Site};
use super::triangle_lights;
use crate::light::{EmissionSource, EmitterSummary, Falloff, Spot, TriangleLight};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::Bsp;
use std::collections::HashMap;
use std::f32::consts::PI;
use support::parallel;
use support::random::Random;
use support::slice;

/// Light source of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Source {
    /// All triangle lights of one material and emission source.
    Group(u32, EmissionSource),
    /// A light entity of the map.
    Entity(u32),
    /// A sun.
    Sun(u32),
    /// A light placed by calibration.
    Placed(Lamp),
    /// The back splashes of one material: index into [`splash::of`](super::splash::of).
    Splash(u32),
    /// A sun found by calibration: unit vector towards it.
    FoundSun(Vec3),
}

/// Position and falloff of a point light.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Lamp {
    pub origin: Vec3,
    pub falloff: Falloff,
}

/// Prior of a strength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prior {
    /// Strength by the map's directives.
    pub value: Vec3,
    /// Smallest strength.
    pub low: Vec3,
    /// Largest strength.
    pub high: Vec3,
}

/// A light source and its contribution to the samples.
#[derive(Debug, Clone)]
pub(super) struct Column {
    /// The source.
    pub source: Source,
    /// (sample, irradiance over π for strength 1), by ascending sample.
    pub rows: Vec<(u32, f32)>,
    /// With a light cutoff: contributions without it, by the size of each single light's contribution.
    pub pieces: Vec<Piece>,
    /// Strength: radiance of a group's brightest triangle, radiant intensity of a point light, irradiance of a sun.
    pub strength: Vec3,
    /// Upper bound of the strength.
    pub limit: Vec3,
    /// `None` for placed lights and for skies without directives.
    pub prior: Option<Prior>,
}

/// Irradiance over π at a sample for intensity 1, without shadows; 0 behind the sample's surface and outside a
/// spot's cone.
pub(super) fn unshadowed(sample: &Sample, lamp: Lamp, spot: Option<&Spot>) -> f32 {
    let offset = lamp.origin - sample.position;
    let squared = offset.length_squared();
    let cosine = sample.normal.dot(offset);
    if cosine <= 0.0 || squared < NEAREST {
        return 0.0;
    }
    let cone = spot.map_or(1.0, |spot| spot.part(offset));
    let distance = squared.sqrt();
    let mut given = lamp.falloff.irradiance(distance, cosine / distance);
    if sample.site == Site::LightGrid && lamp.falloff != Falloff::InverseSquare {
        // The light grid weights the incoming light by the cosine after the falloff.
        given = lamp.falloff.irradiance(distance, 1.0) * cosine / distance;
    }
    given * cone / PI
}

/// Rows of a point light up to a distance of `range`.
pub(super) fn point_rows(
    bsp: &Bsp,
    occluders: &Occluders,
    soa: &SampleSoa<'_>,
    lamp: Lamp,
    spot: Option<&Spot>,
    range: f32,
) -> Vec<(u32, f32)> {
    // Consecutive samples are mostly neighbours, shadowed by the same triangle.
    point_rows_hinted(bsp, occluders, soa, lamp, (spot, range), &mut [None])
}

/// [`point_rows`] with occlusion hints: `stopped` has the last occluder for each sample, or for each residue class
/// of samples.
pub(super) fn point_rows_hinted(
    bsp: &Bsp,
    occluders: &Occluders,
    soa: &SampleSoa<'_>,
    lamp: Lamp,
    (spot, range): (Option<&Spot>, f32),
    stopped: &mut [Option<u32>],
) -> Vec<(u32, f32)> {
    let places = stopped.len().max(1);
    let origin = lamp.origin;
    let cluster = bsp.cluster_at(origin);
    let mut rows = Vec::new();
    for (i, sample) in soa.facing(origin, range) {
        if !bsp.cluster_sees(cluster, sample.cluster) && !bsp.cluster_sees(sample.cluster, cluster)
        {
            continue;
        }
        let light = unshadowed(sample, lamp, spot);
        let Some(last) = slice::get_mut(stopped, i as usize % places) else {
            continue;
        };
        if light > 0.0 && !occluders.blocked_hinted(origin, sample.position, last) {
            rows.push((i, light));
        }
    }
    rows
}

/// Irradiance over π of a sun of irradiance 1 at a sample; `None` in shadow.
pub(super) fn sun_at(occluders: &Occluders, sample: &Sample, direction: Vec3) -> Option<f32> {
    let cosine = sample.normal.dot(direction);
    let hit = || occluders.nearest(sample.position, direction, f32::INFINITY);
    (cosine > 0.0 && hit().is_none_or(|hit| hit.sky)).then_some(cosine / PI)
}

/// Rows of a sun.
pub(super) fn sun_rows(
    occluders: &Occluders,
    samples: &[Sample],
    direction: Vec3,
) -> Vec<(u32, f32)> {
    let reached = parallel::map(samples, |_, sample| sun_at(occluders, sample, direction));
    (0u32..)
        .zip(reached)
        .filter_map(|(i, light)| Some((i, light?)))
        .collect()
}

/// Columns of the lights that the map's directives and entities describe. `unknown_skies`: materials of skies
/// without directives.
pub(super) fn known(
    world: &RelitWorld,
    occluders: &Occluders,
    samples: &[Sample],
    unknown_skies: &[u32],
) -> Vec<Column> {
    let (groups, of_light) = group(world);
    let has_cutoff = world.light_cutoff > 0.0;
    let pieces_if = |rows: &[(u32, f32)]| {
        if has_cutoff {
            pieces_of(rows)
        } else {
            Vec::new()
        }
    };
    let found = parallel::map(samples, |i, sample| {
        let mut random = Random::new(0x7121 + i as u64);
        triangle_lights::contributions(world, occluders, sample, &of_light, &mut random)
    });
    let mut columns: Vec<Column> = groups
        .iter()
        .map(|g| Column {
            source: Source::Group(g.material, g.evidence),
            rows: Vec::new(),
            pieces: Vec::new(),
            strength: g.strength,
            limit: Vec3::INFINITY,
            prior: (!unknown_skies.contains(&g.material)).then(|| prior_of(g.strength, g.evidence)),
        })
        .collect();
    for (i, given) in (0u32..).zip(found) {
        for bucket in given {
            let Some(column) = slice::get_mut(&mut columns, bucket.group as usize) else {
                continue;
            };
            match column.rows.last_mut() {
                Some((last, sum)) if *last == i => *sum += bucket.given,
                _ => column.rows.push((i, bucket.given)),
            }
            if has_cutoff {
                column.pieces.push(Piece {
                    sample: i,
                    unshadowed: bucket.unshadowed / bucket.count,
                    given: bucket.given,
                });
            }
        }
    }
    let soa = SampleSoa::new(samples);
    let points: Vec<u32> = (0..world.point_lights.len() as u32).collect();
    let rows = parallel::map(&points, |_, &index| {
        world
            .point_lights
            .get(index as usize)
            .map_or_else(Vec::new, |light| {
                let spot = light.spot.as_ref();
                point_rows(
                    &world.bsp,
                    occluders,
                    &soa,
                    Lamp {
                        origin: light.origin,
                        falloff: light.falloff,
                    },
                    spot,
                    f32::INFINITY,
                )
            })
    });
    for ((index, rows), light) in points.into_iter().zip(rows).zip(&world.point_lights) {
        columns.push(Column {
            source: Source::Entity(index),
            pieces: pieces_if(&rows),
            rows,
            strength: light.intensity,
            limit: Vec3::INFINITY,
            prior: Some(prior_of(light.intensity, EmissionSource::SurfaceLight)),
        });
    }
    for (index, sun) in (0u32..).zip(&world.suns) {
        columns.push(Column {
            source: Source::Sun(index),
            rows: sun_rows(occluders, samples, sun.direction),
            pieces: Vec::new(),
            strength: sun.irradiance,
            limit: Vec3::INFINITY,
            prior: Some(prior_of(sun.irradiance, EmissionSource::SurfaceLight)),
        });
    }
    // Directives give light before the compiler's gamma, so their colour exponent is the display's divided by it.
    if world.stored_gamma != 1.0 {
        let color = |light| crate::light::raise(light, world.stored_gamma.recip());
        for column in &mut columns {
            column.strength = color(column.strength);
            if let Some(prior) = &mut column.prior {
                prior.value = color(prior.value);
                let floor = Vec3::splat(prior.value.max_element() * 0.1);
                let loosest = prior.high.max_element() / prior.value.max_element().max(1e-30);
                prior.high = prior.high.max(prior.value.max(floor) * loosest.min(24.0));
                prior.low = prior.low.min(prior.value);
            }
        }
    }
    columns
}

/// Number of columns of [`known`].
pub(super) fn count(world: &RelitWorld) -> usize {
    group(world).0.len() + world.point_lights.len() + world.suns.len()
}

/// Sets the strengths of the known lights, in the order of [`known`].
pub(super) fn set_known(world: &mut RelitWorld, strengths: &[Vec3]) {
    let (groups, of_light) = group(world);
    let mut strengths = strengths.iter().copied();
    let of_group: Vec<Vec3> = strengths.by_ref().take(groups.len()).collect();
    for (light, (index, part)) in world.lights.iter_mut().zip(of_light) {
        if let Some(strength) = of_group.get(index as usize) {
            light.radiance = *strength * part;
        }
    }
    for (group, &strength) in groups.iter().zip(&of_group) {
        let whole = group.strength.max_element().max(f32::MIN_POSITIVE);
        let emission = world
            .materials
            .get_mut(group.material as usize)
            .and_then(|m| m.emission.as_mut());
        if let Some(emission) = emission.filter(|e| e.source == group.evidence) {
            // The strength of a sprite is an intensity: the ratio to the group stays.
            let whole = match emission.source {
                EmissionSource::Sprite => whole / emission.strength.max_element().max(1e-30),
                _ => 1.0,
            };
            emission.strength = strength / whole.max(f32::MIN_POSITIVE);
        }
        let same =
            |e: &&mut EmitterSummary| e.material == group.material && e.source == group.evidence;
        if let Some(summary) = world.report.emitters.iter_mut().find(same) {
            summary.radiance = strength * (summary.radiance.max_element() / whole);
        }
    }
    for (light, strength) in world.point_lights.iter_mut().zip(strengths.by_ref()) {
        light.intensity = strength;
    }
    for (sun, strength) in world.suns.iter_mut().zip(strengths) {
        sun.irradiance = strength;
    }
}

/// Prior for a directive. Compiler options scale all lights of a kind, so the bounds are wide; a glow or flare,
/// which the compiler did not use as a light, may fall to zero.
fn prior_of(value: Vec3, evidence: EmissionSource) -> Prior {
    let (low, high) = match evidence {
        EmissionSource::Glow | EmissionSource::Flare => (0.0, 8.0),
        _ => (0.02, 24.0),
    };
    let floor = Vec3::splat(value.max_element() * 0.1);
    Prior {
        value,
        low: value * low,
        high: value.max(floor) * high,
    }
}

/// Triangle lights with a common strength.
struct Group {
    material: u32,
    evidence: EmissionSource,
    /// Radiance of the brightest of them.
    strength: Vec3,
}

/// The groups, and for every light its group and its radiance relative to the group's strength.
fn group(world: &RelitWorld) -> (Vec<Group>, Vec<(u32, f32)>) {
    let mut known: HashMap<(u32, EmissionSource), u32> = HashMap::new();
    let mut groups: Vec<Group> = Vec::new();
    let mut of_light = Vec::with_capacity(world.lights.len());
    for light in &world.lights {
        let material = material_of(world, light);
        let index = *known.entry((material, light.source)).or_insert_with(|| {
            groups.push(Group {
                material,
                evidence: light.source,
                strength: Vec3::ZERO,
            });
            (groups.len() - 1) as u32
        });
        if let Some(group) = groups.get_mut(index as usize)
            && light.radiance.max_element() > group.strength.max_element()
        {
            group.strength = light.radiance;
        }
        of_light.push((index, 0.0));
    }
    for (light, slot) in world.lights.iter().zip(&mut of_light) {
        let whole = groups
            .get(slot.0 as usize)
            .map_or(Vec3::ZERO, |g| g.strength);
        slot.1 = light.radiance.max_element() / whole.max_element().max(f32::MIN_POSITIVE);
    }
    (groups, of_light)
}

/// Material of a light's surface.
pub(super) fn material_of(world: &RelitWorld, light: &TriangleLight) -> u32 {
    world
        .surfaces
        .get(light.surface as usize)
        .map_or(u32::MAX, |s| s.material)
}
