//! Samples beside placed lights.
//!
//! A point light is brightest on the nearest surface, in a spot smaller than the distance between samples. After
//! lights have been placed, rays from each of them find the texels around it; texels that the fit makes too bright
//! join the samples, and the following fits include them.

use super::columns::{self, Column, Lamp, Source, point_rows, sun_rows};
use super::cutoff::pieces_of;
use super::fit::Fit;
use super::sample_soa::SampleSoa;
use super::samples::{self, Sample, SampleContext, SamplingOptions};
use super::texels::{self, Texel, TexelId};
use super::{FitMode, compiler_command_line, splash};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::collections::HashSet;
use std::f32::consts::{PI, TAU};
use support::parallel;

/// Radius around a light in which texels are tested, id units: farther away the ordinary samples are dense enough.
pub(super) const NEAR: f32 = 128.0;

/// Rays from each placed light.
const RAYS: usize = 160;

/// Ratio of fitted to stored light from which a texel joins the samples.
const EXCESS: f32 = 1.3;

/// Most texels that join for one light.
const MOST: usize = 12;

/// Weight of such a texel relative to other samples: it stands for less area.
const TRUST: f32 = 0.3;

/// Part of stored light below which a light is ignored when looking for texels that are too bright.
const PART: f32 = 0.05;

/// Rays from each light for [`spots`].
const SPOT_RAYS: usize = 512;

/// Ratio of computed to stored light from which a texel counts as a spot: one stop.
const SPOT_RATIO: f32 = 2.0;

/// Evenly distributed directions over the sphere.
///
/// Source: González 2010, the Fibonacci lattice.
fn directions(count: usize) -> impl Iterator<Item = Vec3> {
    let golden = TAU / (1.0 + 5.0f32.sqrt()) * 2.0;
    (0..count).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f32 / count as f32;
        let (sin, cos) = (k as f32 * golden).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(radius * cos, radius * sin, z)
    })
}

/// Samples of the texels within [`NEAR`] that rays from `origin` hit, each texel once, if `wanted` accepts it and
/// it is a usable measurement. `measure` also gets the triangle, because surfaces may share a texel.
pub(super) fn texels_around(
    context: &SampleContext<'_>,
    of_triangle: &[u32],
    origin: Vec3,
    rays: usize,
    wanted: impl Fn(&TexelId) -> bool,
    mut measure: impl FnMut(Texel, usize) -> Option<Sample>,
) -> Vec<(TexelId, Sample)> {
    let mut taken = HashSet::new();
    let trace = |ray: Vec3| {
        let hit = context.occluders.nearest(origin, ray, NEAR)?;
        let triangle = hit.tag as usize;
        let surface = *of_triangle.get(triangle)? as usize;
        if !hit.front || hit.sky {
            return None;
        }
        let at = origin + ray * hit.t;
        let texel = texels::texel_on(context.world, surface, triangle, at)?;
        let (id, stored) = (texel.id, &texel.stored);
        if stored.saturated() || stored.lone_black() || taken.contains(&id) || !wanted(&id) {
            return None;
        }
        let sample = measure(texel, triangle)?;
        taken.insert(id);
        Some((id, sample))
    };
    directions(rays).filter_map(trace).collect()
}

impl Fit<'_> {
    /// Adds texels beside placed lights that the fit makes too bright to the samples. `fixed`: number of leading
    /// columns that are not placed lights. Returns whether any was added.
    pub fn add_near_light_texels(&mut self, fixed: usize) -> bool {
        if matches!(self.mode, FitMode::Trial(_)) {
            return false;
        }
        let context = SampleContext::new(self.world, self.occluders, &self.sampling);
        let placed: Vec<(Lamp, Vec3)> = self.columns.iter().skip(fixed).filter_map(lit).collect();
        let per_light = parallel::map(&placed, |_, &(lamp, _)| {
            let usable = |id: &TexelId| {
                !samples::is_held_out(context.seed, id) && !self.near_light_texels.contains(id)
            };
            let mut new = Vec::new();
            let measure = |texel: Texel, triangle| {
                let key = (texel.id, triangle as u32);
                let known = self.near_light_measurements.get(&key).copied();
                known.unwrap_or_else(|| {
                    let sample = texel.measured(&context);
                    new.push((key, sample));
                    sample
                })
            };
            let (of_triangle, origin) = (&self.of_triangle, lamp.origin);
            let found = texels_around(&context, of_triangle, origin, RAYS, usable, measure);
            let samples: Vec<Sample> = found.iter().map(|(_, s)| *s).collect();
            let given = light_from(self.world, self.occluders, &samples, &placed, self.cutoff);
            let mut bright: Vec<(f32, TexelId, Sample)> = found
                .into_iter()
                .zip(given)
                .map(|((id, s), given)| ((given + s.floor) / (s.level() + s.floor), id, s))
                .filter(|(excess, ..)| *excess > EXCESS)
                .collect();
            bright.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            bright.truncate(MOST);
            (bright, new)
        });
        let mut more = Vec::new();
        for (bright, new) in per_light {
            self.near_light_measurements.extend(new);
            for (_, id, sample) in bright {
                if self.near_light_texels.insert(id) {
                    more.push(Sample {
                        trust: TRUST,
                        ..sample
                    });
                }
            }
        }
        if more.is_empty() {
            return false;
        }
        self.add_samples(&more);
        true
    }

    /// Adds samples, with their rows in every column and in the transfer matrix.
    fn add_samples(&mut self, more: &[Sample]) {
        let (world, occluders, unknown_skies) = (self.world, self.occluders, self.unknown_skies);
        let first = self.samples.len() as u32;
        let mut known = columns::known(world, occluders, more, unknown_skies).into_iter();
        let splashes = splash::columns(world, occluders, more, &self.splashes, &[]);
        let soa = SampleSoa::new(more);
        for column in &mut self.columns {
            let rows = |lamp| point_rows(&world.bsp, occluders, &soa, lamp, None, f32::INFINITY);
            let (rows, pieces) = match column.source {
                Source::Group(..) | Source::Entity(_) | Source::Sun(_) => match known.next() {
                    Some(found) => (found.rows, found.pieces),
                    None => continue,
                },
                Source::Splash(index) => match splashes.get(index as usize) {
                    Some(found) => (found.rows.clone(), found.pieces.clone()),
                    None => continue,
                },
                Source::FoundSun(direction) => (sun_rows(occluders, more, direction), Vec::new()),
                Source::Placed(lamp) => {
                    let rows = rows(lamp);
                    let pieces = match self.cutoff > 0.0 {
                        true => pieces_of(&rows),
                        false => Vec::new(),
                    };
                    (rows, pieces)
                }
            };
            let after = |i: u32| first + i;
            column
                .rows
                .extend(rows.into_iter().map(|(i, a)| (after(i), a)));
            column.pieces.extend(pieces.into_iter().map(|mut piece| {
                piece.sample = after(piece.sample);
                piece
            }));
        }
        let unlisted = |material| unknown_skies.contains(&material);
        let lit = &self.samples;
        self.transfer.add(world, occluders, lit, more, unlisted);
        self.samples.extend_from_slice(more);
    }
}

/// The lamp and strength of a column that is a placed light with light.
fn lit(column: &Column) -> Option<(Lamp, Vec3)> {
    match column.source {
        Source::Placed(lamp) if column.strength != Vec3::ZERO => Some((lamp, column.strength)),
        _ => None,
    }
}

/// Irradiance over π, mean of the channels, of several lights at samples that lie close together.
fn light_from(
    world: &RelitWorld,
    occluders: &Occluders,
    samples: &[Sample],
    lights: &[(Lamp, Vec3)],
    cutoff: f32,
) -> Vec<f32> {
    let mut sums = vec![0.0; samples.len()];
    let Some(first) = samples.first() else {
        return sums;
    };
    let soa = SampleSoa::new(samples);
    for &(lamp, strength) in lights {
        // A light below this part of the stored light cannot make it too bright.
        let power = samples::mean(strength);
        let reach = (power / (PI * PART * (first.level() + first.floor).max(1e-6))).sqrt();
        if lamp.origin.distance(first.position) > reach + NEAR * 2.0 {
            continue;
        }
        let rows = point_rows(&world.bsp, occluders, &soa, lamp, None, f32::INFINITY);
        for (i, a) in rows {
            let is_cut_off = strength.max_element() * a <= cutoff;
            if let Some(sum) = sums.get_mut(i as usize).filter(|_| !is_cut_off) {
                *sum += power * a;
            }
        }
    }
    sums
}

/// Texels beside point lights, and how many of them are too bright.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spots {
    /// Texels within 128 units of a point light that are usable measurements.
    pub texels: usize,
    /// Those that point lights alone make brighter than stored by more than one stop.
    pub too_bright: usize,
}

/// Counts the texels that the point lights of a world, calibrated or not, make too bright.
pub fn spots(world: &RelitWorld) -> Spots {
    let occluders = Occluders::of_world(world);
    let sampling = SamplingOptions {
        dirt: compiler_command_line::dirt_of_calibrated(world),
        ..Default::default()
    };
    let context = SampleContext::new(world, &occluders, &sampling);
    let of_triangle = world.surfaces_of_triangles();
    let lights: Vec<(Lamp, Vec3)> = (world.point_lights.iter())
        .filter(|light| light.spot.is_none())
        .map(|light| {
            let (origin, falloff) = (light.origin, light.falloff);
            (Lamp { origin, falloff }, light.intensity)
        })
        .collect();
    let found = parallel::map(&lights, |_, &(lamp, _)| {
        let measure = |texel: Texel, _| texel.measured(&context);
        let every = |_: &TexelId| true;
        let found = texels_around(
            &context,
            &of_triangle,
            lamp.origin,
            SPOT_RAYS,
            every,
            measure,
        );
        let samples: Vec<Sample> = found.iter().map(|(_, s)| *s).collect();
        let given = light_from(world, &occluders, &samples, &lights, world.light_cutoff);
        let bright = samples.iter().zip(given);
        let bright = bright.map(|(s, given)| given + s.floor > SPOT_RATIO * (s.level() + s.floor));
        let found: Vec<(TexelId, bool)> = found.into_iter().map(|(id, _)| id).zip(bright).collect();
        found
    });
    let mut spots = Spots::default();
    let mut counted = HashSet::new();
    for (id, bright) in found.into_iter().flatten() {
        if counted.insert(id) {
            spots.texels += 1;
            spots.too_bright += usize::from(bright);
        }
    }
    spots
}
