//! Measurements of light: what the map compiler stored, and where in space it did.
//!
//! Light is counted as the outgoing radiance of a white surface, irradiance / π: a stored byte v is v 4 / 255 (see
//! [`light`](crate::light)). Its colour is what the engine shows: [`LightColor`](crate::light::LightColor).

use super::bvh::Occluders;
use super::random::Random;
use crate::light;
use crate::world::{RelitWorld, WorldMaterial, WorldSurface, WorldVertex};
use glam::{Vec2, Vec3};
use q3bsp::SurfaceKind;
use shaderscript::light::SurfaceClass;

/// Radiance of white for a stored value of 1.
pub(super) const STORED_UNIT: f32 = 4.0 / 255.0;

/// How far off its surface light is gathered, id units.
const LIFT: f32 = 1.0;

/// Points tried in each stratum before it is given up.
const TRIES: usize = 8;

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// A little off the surface.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Light, irradiance / π.
    pub value: Vec3,
    /// Part of it that comes by way of other surfaces, irradiance / π: see [`bounce`](super::bounce).
    pub bounce: Vec3,
    /// Visibility cluster that it lies in.
    pub cluster: i32,
    /// Some channel is at its end: there was at least that much light.
    pub saturated: bool,
    /// Kept out of fitting, to judge by.
    pub held_out: bool,
}

impl Sample {
    /// Mean of the channels.
    pub fn level(&self) -> f32 {
        mean(self.value)
    }
}

/// Mean of the channels.
pub(super) fn mean(value: Vec3) -> f32 {
    value.element_sum() / 3.0
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

/// Triangles that stop light when the compiler casts shadows: those of the world itself that are opaque. Tagged with
/// their number.
pub(crate) fn occluders(world: &RelitWorld) -> Occluders {
    let drawn = world.surfaces.iter().filter(|s| {
        let material = world.materials.get(s.material as usize);
        s.model == 0 && material.is_some_and(|m| m.is_sky() || stops_light(m))
    });
    Occluders::new(drawn.flat_map(|surface| {
        let material = world.materials.get(surface.material as usize);
        let sky = material.is_some_and(WorldMaterial::is_sky);
        let first = surface.first_index as usize / 3;
        (first..first + surface.num_indices as usize / 3)
            .filter_map(move |t| Some((world.triangle(t)?, sky, t as u32)))
    }))
}

fn stops_light(material: &WorldMaterial) -> bool {
    matches!(
        material.class.class,
        SurfaceClass::Opaque | SurfaceClass::Mirror | SurfaceClass::Portal
    )
}

/// Whether a surface's first layer of light is the one that never changes (style 0).
fn constant(world: &RelitWorld, surface: usize) -> bool {
    let layers = world.bsp.layers.surfaces.get(surface);
    layers.is_none_or(|l| l.lightmap_styles.first() == Some(&0))
}

/// Whether light on a surface tells of the lights around it.
fn tells(world: &RelitWorld, surface: &WorldSurface) -> bool {
    let material = world.materials.get(surface.material as usize);
    surface.model == 0
        && surface.num_indices > 0
        && material.is_some_and(|m| {
            m.emission.is_none()
                && !m.is_sky()
                && matches!(m.class.class, SurfaceClass::Opaque | SurfaceClass::CutOut)
        })
}

/// About `count` measurements, spread evenly over the map's area.
pub(super) fn take(
    world: &RelitWorld,
    occluders: &Occluders,
    count: usize,
    seed: u64,
) -> (Vec<Sample>, Evidence) {
    let mut random = Random::new(seed);
    let lightmaps = texels(world, occluders, count, &mut random);
    // A few lightmapped scraps say nothing about the rest.
    if lightmaps.len() >= 16 {
        return (hold_out(lightmaps, &mut random), Evidence::Lightmaps);
    }
    let lit = |s: &[Sample]| s.iter().any(|s| s.level() > 0.0 && !s.saturated);
    let vertices = vertices(world, occluders, count, &mut random);
    if vertices.len() >= 16 && lit(&vertices) {
        return (hold_out(vertices, &mut random), Evidence::Vertices);
    }
    let grid = grid(world, count, &mut random);
    if grid.len() >= 16 && lit(&grid) {
        return (hold_out(grid, &mut random), Evidence::Grid);
    }
    (Vec::new(), Evidence::Nothing)
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
fn sample_at(
    world: &RelitWorld,
    occluders: &Occluders,
    on: Vec3,
    normal: Vec3,
    stored: [u8; 3],
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
        position,
        normal,
        value: light::raise(
            Vec3::from_array(stored.map(f32::from)) * STORED_UNIT,
            world.color_exponent,
        ),
        bounce: Vec3::ZERO,
        cluster,
        saturated: stored.contains(&255),
        held_out: false,
    })
}

/// Texels of lightmaps, stratified by area.
fn texels(
    world: &RelitWorld,
    occluders: &Occluders,
    count: usize,
    random: &mut Random,
) -> Vec<Sample> {
    let mut triangles = Vec::new();
    let mut total = 0.0f64;
    for (index, surface) in world.surfaces.iter().enumerate() {
        if surface.lightmap < 0 || !tells(world, surface) || !constant(world, index) {
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
    let mut samples = Vec::with_capacity(count);
    for stratum in 0..count {
        for _ in 0..TRIES {
            let at = (stratum as f64 + f64::from(random.next())) / count as f64 * total;
            let found = triangles.partition_point(|(end, ..)| *end <= at);
            let Some(&(_, triangle, surface)) = triangles.get(found) else {
                break;
            };
            let sample = texel(world, triangle, surface, random)
                .and_then(|(on, normal, stored)| sample_at(world, occluders, on, normal, stored));
            if let Some(sample) = sample {
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
) -> Option<(Vec3, Vec3, [u8; 3])> {
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
    let (on, normal) = std::iter::once(triangle)
        .chain(others)
        .find_map(|t| place_of(corners(world, t)?, middle, size))?;
    let stored = page.texel(cell.x as usize, cell.y as usize);
    Some((on, normal, stored))
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

/// Lit vertices of surfaces without a page. Each stands for itself, however large its surface is.
fn vertices(
    world: &RelitWorld,
    occluders: &Occluders,
    count: usize,
    random: &mut Random,
) -> Vec<Sample> {
    let mut all = Vec::new();
    for (index, surface) in world.surfaces.iter().enumerate() {
        let by_vertex = surface.lightmap == q3bsp::lightmap_index::BY_VERTEX;
        let own = matches!(
            surface.kind,
            SurfaceKind::Planar | SurfaceKind::TriangleSoup
        );
        if !by_vertex || !own || !tells(world, surface) {
            continue;
        }
        let stored = world.bsp.surfaces.get(index);
        let stored = stored.map_or(&[][..], |s| world.bsp.surface_vertices(s));
        let first = surface.first_vertex as usize;
        let made = world.vertices.get(first..).unwrap_or_default();
        all.extend(stored.iter().zip(made).map(|(raw, vertex)| {
            let [r, g, b, _] = raw.color;
            (vertex.position, vertex.normal, [r, g, b])
        }));
    }
    pick(all.len(), count, random)
        .filter_map(|i| all.get(i))
        .filter_map(|&(on, normal, stored)| sample_at(world, occluders, on, normal, stored))
        .collect()
}

/// Points of the light grid: what comes from the bright side and what comes from the other.
fn grid(world: &RelitWorld, count: usize, random: &mut Random) -> Vec<Sample> {
    let Some(layout) = world.bsp.light_grid() else {
        return Vec::new();
    };
    let [nx, ny, _] = layout.counts;
    let mut samples = Vec::new();
    for i in pick(world.bsp.light_grid.len(), count.div_ceil(2), random) {
        let Some(point) = world.bsp.light_grid.get(i) else {
            continue;
        };
        let position = layout.position(i % nx, i / nx % ny, i / nx / ny);
        let cluster = world.bsp.cluster_at(position);
        let normal = point.direction().normalize_or_zero();
        if cluster < 0 || normal == Vec3::ZERO || point.ambient == [0; 3] {
            continue;
        }
        let ambient = Vec3::from_array(point.ambient.map(f32::from));
        let directed = Vec3::from_array(point.directed.map(f32::from));
        for (normal, value) in [(normal, ambient + directed), (-normal, ambient)] {
            samples.push(Sample {
                position,
                normal,
                value: light::raise(value * STORED_UNIT, world.color_exponent),
                bounce: Vec3::ZERO,
                cluster,
                saturated: point.directed.contains(&255),
                held_out: false,
            });
        }
    }
    samples
}

/// Indices below `len`, in order: all, or one of each of `count` equal stretches.
fn pick(len: usize, count: usize, random: &mut Random) -> impl Iterator<Item = usize> {
    let count = count.min(len);
    (0..count).map(move |i| {
        let low = i * len / count.max(1);
        let high = (i + 1) * len / count.max(1);
        low + (((high - low) as f32 * random.next()) as usize).min(high.saturating_sub(low + 1))
    })
}
