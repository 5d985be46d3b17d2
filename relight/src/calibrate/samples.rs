//! Measurements of light: what the map compiler stored, and where in space it did.
//!
//! Light is counted as the outgoing radiance of a white surface, irradiance / π: a stored byte v is v 4 / 255 (see
//! [`light`](mod@crate::light)), to the power of the compiler's gamma. Its colour is what the engine shows: [`LightColor`](crate::light::LightColor).

use super::air;
use super::bvh::{CutOut, Occluders};
use super::random::Random;
use super::vertices;
use crate::light;
use crate::world::{RelitWorld, WorldMaterial, WorldSurface, WorldVertex};
use glam::{Vec2, Vec3};
use q3bsp::Lightmap;
use shaderscript::light::SurfaceClass;
use std::collections::HashMap;
use std::sync::Arc;

/// Radiance of white for a stored value of 1, where light is stored as it is.
pub(super) const STORED_UNIT: f32 = 4.0 / 255.0;

/// Steps of a stored byte that are too few to tell apart.
const FLOOR: f32 = 2.0;

/// How far off its surface light is gathered, id units.
const LIFT: f32 = 1.0;

/// How far around a black texel others are black as well where no light falls, texels.
const BLACK_AROUND: i32 = 2;

/// How much a black texel tells that may be black for another reason than the lack of light: compilers leave texels
/// black where the point that they measured at lay inside of something, and some maps are full of them.
const TRUST_IN_BLACK: f32 = 0.2;

/// What all black measurements together may weigh beside those that are lit. Where most of a map is black, its lights had
/// an end (linear falloff, spots), which lights of the square of the distance have not: then black would put them out.
const BLACK_OVER_LIT: f32 = 0.1;

/// Where more than this part of a map's texels is black, black ones can be measured less often: the map may lie in a dark
/// box much larger than itself.
const MOSTLY_BLACK: f32 = 0.5;

/// One of so many black texels is measured there.
const BLACK_THINNED: f32 = 3.0;

/// Texels that tell how many are black.
const LOOKS: usize = 2000;

/// Points tried in each stratum before it is given up.
const TRIES: usize = 8;

/// Where a measurement was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Site {
    /// On a surface, which all light falls on.
    Surface,
    /// In the open, at a point of the light grid: only light that comes straight from lights ([`super::air`]).
    Air,
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
            Site::Air => 0.0,
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

/// What measurements were taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Evidence {
    /// Lightmap texels.
    Lightmaps,
    /// Colours of vertices: the map has no lightmaps.
    Vertices,
    /// Points of the light grid: neither lightmaps nor lit vertices.
    Grid,
    /// Nothing that tells of light.
    #[default]
    Nothing,
}

impl Evidence {
    /// A short name for tables and files.
    pub fn label(self) -> &'static str {
        match self {
            Evidence::Lightmaps => "lightmaps",
            Evidence::Vertices => "vertices",
            Evidence::Grid => "grid",
            Evidence::Nothing => "nothing",
        }
    }

    /// The evidence of a [`label`](Self::label).
    pub(super) fn from_label(label: &str) -> Option<Evidence> {
        let all = [
            Evidence::Lightmaps,
            Evidence::Vertices,
            Evidence::Grid,
            Evidence::Nothing,
        ];
        all.into_iter().find(|e| e.label() == label)
    }
}

/// Triangles that stop light: those of the world itself that are opaque, and cut-outs where these are there, if anybody
/// knows where that is. Tagged with their number.
pub(crate) fn occluders(world: &RelitWorld) -> Occluders {
    let drawn = world.surfaces.iter().filter(|s| {
        let material = world.materials.get(s.material as usize);
        s.model == 0 && material.is_some_and(|m| m.is_sky() || stops_light(m))
    });
    let mut holes_of = HashMap::new();
    for surface in &world.surfaces {
        let material = world.materials.get(surface.material as usize);
        if let Some(holes) = material.and_then(|m| m.holes.as_ref()) {
            let first = surface.first_index / 3;
            holes_of.extend((first..first + surface.num_indices / 3).map(|t| (t, holes)));
        }
    }
    Occluders::new(drawn.flat_map(|surface| {
        let material = world.materials.get(surface.material as usize);
        let sky = material.is_some_and(WorldMaterial::is_sky);
        let first = surface.first_index as usize / 3;
        (first..first + surface.num_indices as usize / 3)
            .filter_map(move |t| Some((world.triangle(t)?, sky, t as u32)))
    }))
    .cut(|tag| {
        let holes = holes_of.get(&tag)?;
        let [a, b, c] = corners(world, tag as usize)?;
        Some(CutOut {
            st: [a.st, b.st, c.st],
            holes: Arc::clone(holes),
        })
    })
}

fn stops_light(material: &WorldMaterial) -> bool {
    matches!(
        material.class.class,
        SurfaceClass::Opaque | SurfaceClass::Mirror | SurfaceClass::Portal
    ) || material.holes.is_some()
}

/// Whether a surface's first layer of light is the one that never changes (style 0).
fn constant(world: &RelitWorld, surface: usize) -> bool {
    let layers = world.bsp.layers.surfaces.get(surface);
    layers.is_none_or(|l| l.lightmap_styles.first() == Some(&0))
}

/// Whether light on a surface tells of the lights around it.
pub(super) fn tells(world: &RelitWorld, surface: &WorldSurface) -> bool {
    let material = world.materials.get(surface.material as usize);
    surface.model == 0
        && surface.num_indices > 0
        && material.is_some_and(|m| {
            m.emission.is_none()
                && !m.is_sky()
                && matches!(m.class.class, SurfaceClass::Opaque | SurfaceClass::CutOut)
        })
}

/// Whether a surface stores its light in a lightmap.
fn lit_by_texel(surface: &WorldSurface) -> bool {
    surface.lightmap >= 0
}

/// Area of surfaces that tell of light.
fn area(world: &RelitWorld, is: fn(&WorldSurface) -> bool) -> f64 {
    let told = world.surfaces.iter().filter(|s| is(s) && tells(world, s));
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

/// About `count` measurements, spread evenly over the map's area. `few_black`: fewer of them black where most of it is.
pub(super) fn take(
    world: &RelitWorld,
    occluders: &Occluders,
    count: usize,
    seed: u64,
    few_black: bool,
) -> (Vec<Sample>, Evidence) {
    let mut random = Random::new(seed);
    let mut lightmaps = texels(world, occluders, count, few_black, &mut random);
    // A few lightmapped scraps say nothing about the rest.
    if lightmaps.len() >= 16 {
        balance(&mut lightmaps);
        let mut samples = hold_out(lightmaps, &mut random);
        // What the map lights by vertex tells as much of its light as texels of the same area; agreement is told by
        // texels alone.
        let [by_vertex, by_texel] = [vertices::lit, lit_by_texel].map(|is| area(world, is));
        let share = by_vertex / (by_vertex + by_texel).max(1.0);
        let beside = (count as f64 * share) as usize;
        samples.extend(vertices::take(world, occluders, beside, &mut random));
        return (samples, Evidence::Lightmaps);
    }
    let lit = |s: &[Sample]| s.iter().any(|s| s.level() > 0.0 && !s.saturated);
    let vertices = vertices::take(world, occluders, count, &mut random);
    if vertices.len() >= 16 && lit(&vertices) {
        return (hold_out(vertices, &mut random), Evidence::Vertices);
    }
    let grid = air::samples(world, &air::points(world, occluders), count, &mut random);
    if grid.len() >= 16 && lit(&grid) {
        return (hold_out(grid, &mut random), Evidence::Grid);
    }
    (Vec::new(), Evidence::Nothing)
}

/// Bounds what black measurements weigh together.
fn balance(samples: &mut [Sample]) {
    let black = |s: &Sample| s.value == Vec3::ZERO;
    let dark = samples.iter().filter(|s| black(s)).count() as f32;
    let lit = samples.len() as f32 - dark;
    let most = (BLACK_OVER_LIT * lit / dark.max(1.0)).clamp(TRUST_IN_BLACK, 1.0);
    for sample in samples.iter_mut().filter(|s| black(s)) {
        sample.trust = sample.trust.min(most);
    }
}

/// Keeps every fifth or so out of fitting.
fn hold_out(mut samples: Vec<Sample>, random: &mut Random) -> Vec<Sample> {
    for group in samples.chunks_mut(5) {
        let chosen = (random.next() * 5.0) as usize;
        if let Some(sample) = group.get_mut(chosen) {
            sample.held_out = true;
        }
    }
    samples
}

/// A measurement at a place, unless the place is outside of the map or inside of something.
pub(super) fn sample_at(
    world: &RelitWorld,
    occluders: &Occluders,
    (on, normal): (Vec3, Vec3),
    material: u32,
    stored: Stored,
) -> Option<Sample> {
    let position = on + normal * LIFT;
    let cluster = world.bsp.cluster_at(position);
    if cluster < 0 {
        return None;
    }
    // What is seen from behind all around is something that this place is inside of.
    let (u, v) = normal.any_orthonormal_pair();
    let around = [normal, normal + u, normal - u, normal + v, normal - v];
    let backs = around
        .into_iter()
        .filter_map(|ray| occluders.nearest(position, ray, f32::INFINITY))
        .filter(|hit| !hit.front && !hit.sky);
    if backs.count() > around.len() / 2 {
        return None;
    }
    Some(Sample {
        site: Site::Surface,
        position,
        normal,
        value: stored.light(world),
        shown: shown(Vec3::from_array(stored.rgb.map(f32::from))),
        bounce: Vec3::ZERO,
        cluster,
        material,
        saturated: stored.rgb.contains(&255),
        floor: floor(world),
        trust: if stored.lone_black {
            TRUST_IN_BLACK
        } else {
            1.0
        },
        held_out: false,
    })
}

/// What is stored at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stored {
    rgb: [u8; 3],
    /// Black, and not all around it is.
    lone_black: bool,
    /// What the compiler multiplied light by before it stored it.
    scale: f32,
}

impl Stored {
    /// A value that tells nothing of what is around it.
    pub(super) fn alone(rgb: [u8; 3]) -> Stored {
        Stored {
            rgb,
            lone_black: black(rgb),
            scale: 1.0,
        }
    }

    /// The light that it stands for, irradiance / π.
    fn light(&self, world: &RelitWorld) -> Vec3 {
        decode(world, Vec3::from_array(self.rgb.map(f32::from)), self.scale)
    }

    /// A texel of a page, of a surface whose light was multiplied by `scale`.
    fn texel(page: &Lightmap, x: usize, y: usize, scale: f32) -> Stored {
        let rgb = page.texel(x, y);
        let around = || {
            let sides = -BLACK_AROUND..=BLACK_AROUND;
            sides
                .clone()
                .flat_map(move |dy| sides.clone().map(move |dx| (dx, dy)))
        };
        let lit = |(dx, dy): (i32, i32)| {
            let inside = |at: usize, by: i32| {
                let at = at.checked_add_signed(by as isize)?;
                (at < page.size()).then_some(at)
            };
            match (inside(x, dx), inside(y, dy)) {
                (Some(x), Some(y)) => !black(page.texel(x, y)),
                _ => false,
            }
        };
        Stored {
            rgb,
            lone_black: black(rgb) && around().any(lit),
            scale,
        }
    }
}

/// Whether a stored colour is less than a step of all its channels.
fn black(rgb: [u8; 3]) -> bool {
    rgb.map(u32::from).iter().sum::<u32>() < 3
}

/// Texels of lightmaps, stratified by area.
fn texels(
    world: &RelitWorld,
    occluders: &Occluders,
    count: usize,
    few_black: bool,
    random: &mut Random,
) -> Vec<Sample> {
    let mut triangles = Vec::new();
    let mut total = 0.0f64;
    for (index, surface) in world.surfaces.iter().enumerate() {
        if !lit_by_texel(surface) || !tells(world, surface) || !constant(world, index) {
            continue;
        }
        let first = surface.first_index as usize / 3;
        for triangle in first..first + surface.num_indices as usize / 3 {
            if let Some([a, b, c]) = world.triangle(triangle) {
                let area = f64::from((b - a).cross(c - a).length() * 0.5);
                if area > 0.0 && area.is_finite() {
                    total += area;
                    triangles.push((total, triangle, surface));
                }
            }
        }
    }
    // The texel at a part of the whole area.
    let texel_at = |part: f64, random: &mut Random| {
        let found = triangles.partition_point(|(end, ..)| *end <= part * total);
        let &(_, triangle, surface) = triangles.get(found)?;
        let (place, stored) = texel(world, triangle, surface, random)?;
        Some((place, surface.material, stored))
    };
    let dark = |stored: &Stored| black(stored.rgb);
    let (mut looks, mut blacks) = (0.0f32, 0.0);
    let mut looking = Random::new(0xB1AC);
    for k in 0..LOOKS {
        let part = (k as f64 + 0.5) / LOOKS as f64;
        if let Some((_, _, stored)) = texel_at(part, &mut looking) {
            looks += 1.0;
            blacks += f32::from(u8::from(dark(&stored)));
        }
    }
    let thinned = few_black && blacks > looks * MOSTLY_BLACK;
    let mut strata = count;
    if thinned {
        let measured = 1.0 - blacks / looks * (1.0 - 1.0 / BLACK_THINNED);
        strata = (count as f32 / measured) as usize;
    }
    let mut samples = Vec::with_capacity(count);
    for stratum in 0..strata {
        for _ in 0..TRIES {
            let at = (stratum as f64 + f64::from(random.next())) / strata as f64;
            let Some((place, material, stored)) = texel_at(at, random) else {
                continue;
            };
            if thinned && dark(&stored) && random.next() * BLACK_THINNED >= 1.0 {
                break;
            }
            if let Some(sample) = sample_at(world, occluders, place, material, stored) {
                samples.push(sample);
                break;
            }
        }
    }
    samples
}

/// The texel that a random point of a triangle falls into: the place of its middle, the normal there, what it stores.
/// `None` when the middle is beyond the surface: compilers move such texels.
fn texel(
    world: &RelitWorld,
    triangle: usize,
    surface: &WorldSurface,
    random: &mut Random,
) -> Option<((Vec3, Vec3), Stored)> {
    let page = usize::try_from(surface.lightmap).ok()?;
    let page = world.bsp.lightmaps.get(page)?;
    let size = page.size() as f32;
    let (u, v) = random.in_triangle();
    let [a, b, c] = corners(world, triangle)?.map(|c| c.lightmap * size);
    let cell = (a + (b - a) * u + (c - a) * v).floor();
    if !(cell.min_element() >= 0.0 && cell.max_element() < size) {
        return None;
    }
    let middle = cell + Vec2::splat(0.5);
    let first = surface.first_index as usize / 3;
    let others = first..first + surface.num_indices as usize / 3;
    let place = std::iter::once(triangle)
        .chain(others)
        .find_map(|t| place_of(corners(world, t)?, middle, size))?;
    let scale = stored_scale(world, surface);
    let stored = Stored::texel(page, cell.x as usize, cell.y as usize, scale);
    Some((place, stored))
}

/// Light that the lightmap stores where a ray met a triangle; `None` where it tells nothing: of other surfaces, of texels
/// at their end and of black ones that are alone.
pub(super) fn stored_at(
    world: &RelitWorld,
    surface: usize,
    triangle: usize,
    at: Vec3,
) -> Option<Vec3> {
    let own = world.surfaces.get(surface)?;
    if !tells(world, own) || !constant(world, surface) {
        return None;
    }
    let page = world
        .bsp
        .lightmaps
        .get(usize::try_from(own.lightmap).ok()?)?;
    let [a, b, c] = corners(world, triangle)?;
    let (e1, e2, offset) = (
        b.position - a.position,
        c.position - a.position,
        at - a.position,
    );
    let normal = e1.cross(e2);
    let squared = normal.length_squared();
    if squared <= 0.0 {
        return None;
    }
    let u = offset.cross(e2).dot(normal) / squared;
    let v = e1.cross(offset).dot(normal) / squared;
    let place = a.lightmap + (b.lightmap - a.lightmap) * u + (c.lightmap - a.lightmap) * v;
    let cell = (place * page.size() as f32).floor();
    if !(cell.min_element() >= 0.0 && cell.max_element() < page.size() as f32) {
        return None;
    }
    let scale = stored_scale(world, own);
    let stored = Stored::texel(page, cell.x as usize, cell.y as usize, scale);
    (!stored.lone_black && !stored.rgb.contains(&255)).then(|| stored.light(world))
}

/// What the compiler multiplied a surface's light by before it stored it.
fn stored_scale(world: &RelitWorld, surface: &WorldSurface) -> f32 {
    let material = world.materials.get(surface.material as usize);
    material.map_or(1.0, WorldMaterial::stored_scale)
}

/// Vertices of a triangle.
pub(super) fn corners(world: &RelitWorld, triangle: usize) -> Option<[&WorldVertex; 3]> {
    let [a, b, c] = *world.indices.as_chunks::<3>().0.get(triangle)?;
    let vertex = |i: u32| world.vertices.get(i as usize);
    Some([vertex(a)?, vertex(b)?, vertex(c)?])
}

/// Position and normal of a place in a lightmap page of `size` texels a side, in texels, if the triangle covers it.
fn place_of([a, b, c]: [&WorldVertex; 3], at: Vec2, size: f32) -> Option<(Vec3, Vec3)> {
    let (e1, e2) = (
        (b.lightmap - a.lightmap) * size,
        (c.lightmap - a.lightmap) * size,
    );
    let offset = at - a.lightmap * size;
    let determinant = e1.perp_dot(e2);
    if determinant.abs() < 1e-6 {
        return None;
    }
    let (u, v) = (
        offset.perp_dot(e2) / determinant,
        e1.perp_dot(offset) / determinant,
    );
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| {
        let on = a.position + (b.position - a.position) * u + (c.position - a.position) * v;
        let normal = a.normal + (b.normal - a.normal) * u + (c.normal - a.normal) * v;
        (on, normal.normalize_or_zero())
    })
}

/// Indices below `len`, in order: all, or one of each of `count` equal stretches.
pub(super) fn pick(len: usize, count: usize, random: &mut Random) -> impl Iterator<Item = usize> {
    let count = count.min(len);
    (0..count).map(move |i| {
        let low = i * len / count.max(1);
        let high = (i + 1) * len / count.max(1);
        low + (((high - low) as f32 * random.next()) as usize).min(high.saturating_sub(low + 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
            floor: FLOOR * STORED_UNIT,
            trust,
            held_out: false,
        }
    }

    #[test]
    fn black_counts_where_all_around_is_black() {
        let side = q3bsp::LIGHTMAP_SIZE;
        let mut texels = vec![0u8; side * side * 3].into_boxed_slice();
        // One lit texel, in the middle of the first row.
        texels[10 * 3..10 * 3 + 3].fill(90);
        let page = Lightmap(texels);
        let lone = |x, y| Stored::texel(&page, x, y, 1.0).lone_black;
        assert!(!lone(10, 0) && lone(9, 0) && lone(8, 2) && lone(12, 0));
        assert!(!lone(7, 0) && !lone(10, 3) && !lone(0, 0) && !lone(side - 1, side - 1));
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
