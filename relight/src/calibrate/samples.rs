//! Measurements of light: what the map compiler stored, and where in space it did.
//!
//! Light is counted as the outgoing radiance of a white surface, irradiance / π: a stored byte v is v 4 / 255 (see
//! [`light`](mod@crate::light)), to the power of the compiler's gamma. Its colour is what the engine shows: [`LightColor`](crate::light::LightColor).

use super::compiler_command_line::Dirt;
use super::light_grid;
use super::texels::{self, Stored, lit_by_texel};
use super::vertices;
use crate::emitters::Evidence;
use crate::light;
use crate::occluders::Occluders;
use crate::world::{RelitWorld, WorldSurface};
use glam::Vec3;
use shaderscript::light::SurfaceClass;
use support::random::{self, Random};

/// Radiance of white for a stored value of 1, where light is stored as it is.
pub(super) const STORED_UNIT: f32 = 4.0 / 255.0;

/// Steps of a stored byte that are too few to tell apart.
const FLOOR: f32 = 2.0;

/// How far off its surface light is gathered, id units.
const LIFT: f32 = 1.0;

/// How far inside of a brush a place is not seen any more, id units.
const INSIDE: f32 = -0.5;

/// How much a black texel tells that may be black for another reason than the lack of light: compilers leave texels
/// black where the point that they measured at lay inside of something, and some maps are full of them.
const TRUST_IN_BLACK: f32 = 0.2;

/// What all black measurements together may weigh beside those that are lit. Where most of a map is black, its lights had
/// an end (linear falloff, spots), which lights of the square of the distance have not: then black would put them out.
const BLACK_OVER_LIT: f32 = 0.1;

/// One of so many measurements is not fitted, to judge by.
pub(super) const HELD_OUT: usize = 5;

/// Where a measurement was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Site {
    /// On a surface, which all light falls on.
    Surface,
    /// In the open, at a point of the light grid: only light that comes straight from lights ([`super::air`]).
    LightGrid,
}

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// Where it was taken.
    pub site: Site,
    /// A little off the surface.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Light, irradiance / π.
    pub value: Vec3,
    /// What the engine shows of it on a white surface, encoded for the display, at most 1.
    pub shown: Vec3,
    /// Part of it that comes by way of other surfaces, irradiance / π: see [`bounce`](super::bounce).
    pub bounce: Vec3,
    /// Visibility cluster that it lies in.
    pub cluster: i32,
    /// Material of the surface; `u32::MAX` for none.
    pub material: u32,
    /// Some channel is at its end: there was at least that much light.
    pub saturated: bool,
    /// The part of it that the compiler stored: it made corners darker ([`Dirt`]).
    pub part: f32,
    /// Light that is too little to tell apart, added to both sides of a ratio, irradiance / π.
    pub floor: f32,
    /// How much it tells, at most 1.
    pub trust: f32,
    /// Kept out of fitting, to judge by.
    pub held_out: bool,
}

impl Sample {
    /// Mean of the channels.
    pub fn level(&self) -> f32 {
        mean(self.value)
    }

    /// The part of light from everywhere that is in it.
    pub fn ambient(&self) -> f32 {
        match self.site {
            Site::Surface => 1.0,
            Site::LightGrid => 0.0,
        }
    }
}

/// Mean of the channels.
pub(super) fn mean(value: Vec3) -> f32 {
    value.element_sum() / 3.0
}

/// Light, irradiance / π, of so many steps of a stored byte.
pub(super) fn light_of(world: &RelitWorld, steps: f32) -> f32 {
    (steps * STORED_UNIT).powf(world.stored_gamma)
}

/// Light that is too little to tell apart: two steps of a stored byte, and more where steps in the dark are finer than
/// their light is known.
pub(super) fn floor(world: &RelitWorld) -> f32 {
    light_of(world, FLOOR * world.stored_gamma)
}

/// Light of a stored colour: bytes were gamma-encoded by the compiler, and it was multiplied by `scale` before that. Its
/// colour is what the engine shows of the stored one.
pub(super) fn decode(world: &RelitWorld, stored: Vec3, scale: f32) -> Vec3 {
    let light = stored.map(|channel| light_of(world, channel)) / scale;
    light::raise(light, world.color_exponent / world.stored_gamma)
}

/// What the engine shows of stored bytes: four times as much, less where a channel would run over.
pub(super) fn shown(stored: Vec3) -> Vec3 {
    let light = stored * STORED_UNIT;
    light / light.max_element().max(1.0)
}

/// Whether light on a surface tells of the lights around it.
pub(super) fn is_measurable(world: &RelitWorld, surface: &WorldSurface) -> bool {
    let material = world.materials.get(surface.material as usize);
    surface.model == 0
        && surface.num_indices > 0
        && material.is_some_and(|m| {
            m.emission.is_none()
                && !m.is_sky()
                && matches!(m.class.class, SurfaceClass::Opaque | SurfaceClass::CutOut)
        })
}

/// Area of surfaces that tell of light.
fn area(world: &RelitWorld, is: fn(&WorldSurface) -> bool) -> f64 {
    let told = world
        .surfaces
        .iter()
        .filter(|s| is(s) && is_measurable(world, s));
    let triangles = told.flat_map(|surface| {
        let first = surface.first_index as usize / 3;
        first..first + surface.num_indices as usize / 3
    });
    let areas = triangles.filter_map(|triangle| {
        let [a, b, c] = world.triangle(triangle)?;
        Some(f64::from((b - a).cross(c - a).length() * 0.5)).filter(|area| area.is_finite())
    });
    areas.sum()
}

/// What measurements on surfaces are taken of, and what is known of how light was stored there.
pub(super) struct SampleContext<'a> {
    pub world: &'a RelitWorld,
    pub occluders: &'a Occluders,
    /// How corners were made darker.
    dirt: Option<Dirt>,
    /// Seed of the choice of what is held out.
    pub seed: u64,
}

impl<'a> SampleContext<'a> {
    /// What measurements are taken of in a way.
    pub fn new(
        world: &'a RelitWorld,
        occluders: &'a Occluders,
        sampling: &SamplingOptions,
    ) -> SampleContext<'a> {
        SampleContext {
            world,
            occluders,
            dirt: sampling.dirt,
            seed: sampling.seed,
        }
    }

    /// Takes what the compiler's dirt did out of a measurement at a [place](sample_at): it was made as dark as that.
    pub fn remove_dirt(&self, sample: &mut Sample) {
        let Some(dirt) = self.dirt else {
            return;
        };
        sample.part = dirt.part_stored(self.occluders, sample.position, sample.normal);
        sample.value /= sample.part;
        sample.floor /= sample.part;
    }
}

/// How measurements are taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SamplingOptions {
    /// How many, about.
    pub count: usize,
    /// Seed of their choice.
    pub seed: u64,
    /// Fewer of those that are fitted are black where most of the map is; those held out are of all texels alike.
    pub few_black: bool,
    /// How corners were made darker.
    pub dirt: Option<Dirt>,
}

/// Measurements, spread evenly over the map's area.
pub(super) fn take(
    world: &RelitWorld,
    occluders: &Occluders,
    sampling: &SamplingOptions,
) -> (Vec<Sample>, Evidence) {
    let mut random = Random::new(sampling.seed);
    let context = SampleContext::new(world, occluders, sampling);
    let count = sampling.count;
    let lightmaps = texels::take(&context, count, sampling.few_black, &mut random);
    // A few lightmapped scraps say nothing about the rest.
    if lightmaps.len() >= 16 {
        let mut samples = lightmaps;
        balance(&mut samples);
        // What the map lights by vertex tells as much of its light as texels of the same area; agreement is told by
        // texels alone.
        let [by_vertex, by_texel] = [vertices::lit, lit_by_texel].map(|is| area(world, is));
        let share = by_vertex / (by_vertex + by_texel).max(1.0);
        let beside = (count as f64 * share) as usize;
        samples.extend(vertices::take(&context, beside, &mut random));
        return (samples, Evidence::Lightmaps);
    }
    let lit = |s: &[Sample]| s.iter().any(|s| s.level() > 0.0 && !s.saturated);
    let vertices = vertices::take(&context, count, &mut random);
    if vertices.len() >= 16 && lit(&vertices) {
        return (hold_out(vertices, sampling.seed), Evidence::Vertices);
    }
    let grid = light_grid::samples(
        world,
        &light_grid::points(world, occluders, |_| true),
        count,
        &mut random,
    );
    if grid.len() >= 16 && lit(&grid) {
        return (hold_out(grid, sampling.seed), Evidence::Grid);
    }
    (Vec::new(), Evidence::Nothing)
}

/// Bounds what black measurements that are fitted weigh together.
fn balance(samples: &mut [Sample]) {
    let black = |s: &Sample| s.value == Vec3::ZERO;
    let fitted = || samples.iter().filter(|s| !s.held_out);
    let dark = fitted().filter(|s| black(s)).count() as f32;
    let lit = fitted().count() as f32 - dark;
    let most = (BLACK_OVER_LIT * lit / dark.max(1.0)).clamp(TRUST_IN_BLACK, 1.0);
    for sample in samples.iter_mut().filter(|s| black(s)) {
        sample.trust = sample.trust.min(most);
    }
}

/// Keeps one of so many out of fitting: at a place all of them or none.
fn hold_out(mut samples: Vec<Sample>, seed: u64) -> Vec<Sample> {
    for sample in &mut samples {
        let place = sample.position.to_array().map(f32::to_bits);
        sample.held_out = is_held_out(seed, &place);
    }
    samples
}

/// Whether what has this name is kept out of fitting.
pub(super) fn is_held_out(seed: u64, name: &[u32]) -> bool {
    random::hashed_uniform(seed, name) * (HELD_OUT as f32) < 1.0
}

/// A measurement at a place, unless the place is outside of the map or inside of something. It is yet to be
/// [cleaned](Gauge::clean).
pub(super) fn sample_at(
    context: &SampleContext<'_>,
    (on, normal): (Vec3, Vec3),
    material: u32,
    stored: Stored,
) -> Option<Sample> {
    let SampleContext {
        world, occluders, ..
    } = *context;
    let position = on + normal * LIFT;
    let cluster = world.bsp.cluster_at(position);
    if cluster < 0 || world.bsp.is_in_drawn_brush(position, INSIDE) {
        return None;
    }
    // What is seen from behind all around is something that this place is inside of.
    let (u, v) = normal.any_orthonormal_pair();
    let around = [normal, normal + u, normal - u, normal + v, normal - v];
    let is_back = |ray: &Vec3| {
        let hit = occluders.nearest(position, *ray, f32::INFINITY);
        hit.is_some_and(|hit| !hit.front && !hit.sky)
    };
    let most = around.len().div_ceil(2);
    let open = around.iter().filter(|ray| !is_back(ray));
    if open.take(most).count() < most {
        return None;
    }
    Some(Sample {
        site: Site::Surface,
        position,
        normal,
        value: stored.light(world),
        shown: stored.shown(),
        bounce: Vec3::ZERO,
        cluster,
        material,
        saturated: stored.saturated(),
        part: 1.0,
        floor: floor(world),
        trust: if stored.lone_black() {
            TRUST_IN_BLACK
        } else {
            1.0
        },
        held_out: false,
    })
}

/// Indices below `len`, in order: all, or one of each of `count` equal stretches.
pub(super) fn pick(len: usize, count: usize, random: &mut Random) -> impl Iterator<Item = usize> {
    let count = count.min(len);
    (0..count).map(move |i| {
        let low = i * len / count.max(1);
        let high = (i + 1) * len / count.max(1);
        low + (((high - low) as f32 * random.uniform()) as usize).min(high.saturating_sub(low + 1))
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A measurement of some light at a place.
    pub fn sample_at_place(position: Vec3) -> Sample {
        Sample {
            position,
            ..sample(0.5, 1.0)
        }
    }

    fn sample(value: f32, trust: f32) -> Sample {
        Sample {
            site: Site::Surface,
            position: Vec3::ZERO,
            normal: Vec3::Z,
            value: Vec3::splat(value),
            shown: Vec3::splat(value.min(1.0)),
            bounce: Vec3::ZERO,
            cluster: 0,
            material: u32::MAX,
            saturated: false,
            part: 1.0,
            floor: FLOOR * STORED_UNIT,
            trust,
            held_out: false,
        }
    }

    #[test]
    fn black_never_outweighs_what_is_lit() {
        let lit = || std::iter::repeat_n(sample(0.5, 1.0), 100);
        let trusts = |black: usize, trust: f32| {
            let mut samples: Vec<Sample> = lit().collect();
            samples.extend(std::iter::repeat_n(sample(0.0, trust), black));
            balance(&mut samples);
            assert!(samples.iter().take(100).all(|s| s.trust == 1.0));
            samples[100].trust
        };
        assert_eq!(trusts(5, 1.0), 1.0);
        assert!((trusts(20, 1.0) - 0.5).abs() < 1e-6);
        assert_eq!(trusts(20, TRUST_IN_BLACK), TRUST_IN_BLACK);
        assert_eq!(trusts(2000, 1.0), TRUST_IN_BLACK);
    }
}
