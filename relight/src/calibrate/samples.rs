//! Samples: light that the map compiler stored, and its position in space.
//!
//! Light is the outgoing radiance of a white surface, irradiance over π: a stored byte v is (v 4 / 255)^g with the
//! compiler's gamma g (see [`light`](mod@crate::light)). Its colour is what the engine shows:
//! [`LightColor`](crate::light::LightColor).

use super::dirt::{Dirt, Surroundings};
use super::light_grid;
use super::texels::{self, Stored, lit_by_texel};
use super::vertices;
use crate::emitters::Evidence;
use crate::light;
use crate::materials::light::SurfaceClass;
use crate::occluders::Occluders;
use crate::world::{RelitWorld, WorldSurface};
use glam::Vec3;
use support::random::{self, Random};

/// Radiance of white for a stored value of 1 with gamma 1.
pub(super) const STORED_UNIT: f32 = 4.0 / 255.0;

/// Measurement floor, steps of a byte.
const FLOOR: f32 = 2.0;

/// Distance of a sample from its surface, id units.
const LIFT: f32 = 1.0;

/// Depth inside a brush from which a position is invalid, id units, negative inside.
const INSIDE: f32 = -0.5;

/// Trust of a black texel next to lit ones. Compilers leave texels black whose sample point lay in solid, and some
/// maps have many.
const TRUST_IN_BLACK: f32 = 0.2;

/// Largest total weight of black samples over that of lit ones. In a mostly black map lights had a limited reach
/// (linear falloff, spots) that inverse-square lights lack; unbounded, black samples would switch them off.
const BLACK_OVER_LIT: f32 = 0.1;

/// One sample in this many is held out.
pub(super) const HELD_OUT: usize = 5;

/// Where a sample was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Site {
    /// On a surface: all light.
    Surface,
    /// At a point of the light grid: direct light only ([`super::light_grid`]).
    LightGrid,
}

/// A measurement of light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// Surface or light grid.
    pub site: Site,
    /// Slightly above the surface, id units.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Stored light, irradiance over π.
    pub value: Vec3,
    /// The same as the engine shows it on white, display-encoded, at most 1.
    pub shown: Vec3,
    /// Computed reflected light, irradiance over π: see [`bounce`](super::bounce).
    pub bounce: Vec3,
    /// PVS cluster of the position.
    pub cluster: i32,
    /// Material of the surface; `u32::MAX` for none.
    pub material: u32,
    /// Whether a channel is 255: the light was at least that.
    pub saturated: bool,
    /// Part of the light that the compiler stored ([`Dirt`]); 1 without dirt.
    pub part: f32,
    /// Measurement floor, added to both sides of a ratio, irradiance over π.
    pub floor: f32,
    /// Weight, at most 1.
    pub trust: f32,
    /// Whether it is excluded from the fit, to state the error.
    pub held_out: bool,
}

impl Sample {
    /// Mean of the channels.
    pub fn level(&self) -> f32 {
        mean(self.value)
    }

    /// Factor of the ambient term.
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

/// Light of a number of steps of a stored byte, irradiance over π.
pub(super) fn light_of(world: &RelitWorld, steps: f32) -> f32 {
    (steps * STORED_UNIT).powf(world.stored_gamma)
}

/// Measurement floor: two steps of a byte; with gamma more steps, as dark steps are then finer than the light is
/// known.
pub(super) fn floor(world: &RelitWorld) -> f32 {
    light_of(world, FLOOR * world.stored_gamma)
}

/// Light of a stored colour: inverts the compiler's gamma and the `scale` applied before it, and raises the colour
/// to what the engine shows.
pub(super) fn decode(world: &RelitWorld, stored: Vec3, scale: f32) -> Vec3 {
    let light = stored.map(|channel| light_of(world, channel)) / scale;
    light::raise(light, world.color_exponent / world.stored_gamma)
}

/// Stored bytes as the engine shows them: times 4, scaled down where a channel exceeds 1.
pub(super) fn shown(stored: Vec3) -> Vec3 {
    let light = stored * STORED_UNIT;
    light / light.max_element().max(1.0)
}

/// Whether the stored light of a surface is evidence of the lights around it: opaque or cut-out, not emitting, not
/// sky, of the world model.
pub(super) fn is_measurable(world: &RelitWorld, surface: &WorldSurface) -> bool {
    let material = world.material_of(surface);
    surface.model == 0
        && surface.num_indices > 0
        && material.is_some_and(|m| {
            m.emission.is_none()
                && !m.is_sky()
                && matches!(m.class.class, SurfaceClass::Opaque | SurfaceClass::CutOut)
        })
}

/// Area of measurable surfaces, square id units.
fn area(world: &RelitWorld, is: fn(&WorldSurface) -> bool) -> f64 {
    let measurable = world
        .surfaces
        .iter()
        .filter(|s| is(s) && is_measurable(world, s));
    let triangles = measurable.flat_map(|surface| surface.triangles());
    let areas = triangles.filter_map(|triangle| {
        let [a, b, c] = world.triangle(triangle);
        Some(f64::from((b - a).cross(c - a).length() * 0.5)).filter(|area| area.is_finite())
    });
    areas.sum()
}

/// Inputs for samples on surfaces.
pub(super) struct SampleContext<'a> {
    pub world: &'a RelitWorld,
    pub occluders: &'a Occluders,
    /// The compiler's ambient occlusion, and its rays.
    dirt: Option<(Dirt, Surroundings)>,
    /// Seed of the held-out choice.
    pub seed: u64,
}

impl<'a> SampleContext<'a> {
    /// The inputs for these options.
    pub fn new(
        world: &'a RelitWorld,
        occluders: &'a Occluders,
        sampling: &SamplingOptions,
    ) -> SampleContext<'a> {
        SampleContext {
            world,
            occluders,
            dirt: sampling.dirt.map(|dirt| (dirt, dirt.surroundings())),
            seed: sampling.seed,
        }
    }

    /// Divides a [sample](sample_at) by the part of its light that the compiler's dirt left, if it computed dirt.
    pub fn remove_dirt(&self, sample: &mut Sample) {
        let Some((dirt, around)) = &self.dirt else {
            return;
        };
        sample.part =
            dirt.part_stored(around.nearness(self.occluders, sample.position, sample.normal));
        sample.value /= sample.part;
        sample.floor /= sample.part;
    }
}

/// How samples are taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SamplingOptions {
    /// Approximate number.
    pub count: usize,
    /// Seed of the choice.
    pub seed: u64,
    /// Whether black texels are thinned among the fitted samples of a mostly black map. Held-out samples are never
    /// thinned.
    pub few_black: bool,
    /// The compiler's ambient occlusion.
    pub dirt: Option<Dirt>,
}

/// Samples, stratified by the map's area.
pub(super) fn take(
    world: &RelitWorld,
    occluders: &Occluders,
    sampling: &SamplingOptions,
) -> (Vec<Sample>, Evidence) {
    let mut random = Random::new(sampling.seed);
    let context = SampleContext::new(world, occluders, sampling);
    let count = sampling.count;
    let lightmaps = texels::take(&context, count, sampling.few_black, &mut random);
    // Fewer lightmapped samples do not represent the map.
    if lightmaps.len() >= 16 {
        let mut samples = lightmaps;
        balance(&mut samples);
        // Surfaces lit by vertex get samples in proportion to their area. Texels alone state the error.
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

/// Bounds the total weight of black fitted samples.
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

/// Marks held-out samples; samples at one position are held out together.
fn hold_out(mut samples: Vec<Sample>, seed: u64) -> Vec<Sample> {
    for sample in &mut samples {
        let place = sample.position.to_array().map(f32::to_bits);
        sample.held_out = is_held_out(seed, &place);
    }
    samples
}

/// Whether the sample of this identity is held out.
pub(super) fn is_held_out(seed: u64, name: &[u32]) -> bool {
    random::hashed_uniform(seed, name) * (HELD_OUT as f32) < 1.0
}

/// A sample at a position, unless the position is outside the map or in solid. Its
/// [dirt](SampleContext::remove_dirt) is not yet removed.
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
    // A position from which most rays hit back faces lies inside something.
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

/// Ascending indices below `len`: all, or one from each of `count` equal ranges.
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

    /// A sample with some light at a position.
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
    fn black_samples_never_outweigh_lit_ones() {
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
