//! Light at points by shadow rays on the CPU.

use super::{Gather, GatherError, GatherProgress, Light, LitSurfaces, LitTriangle, Point};
use crate::calibrate::Surroundings;
use crate::calibrate::triangle_lights::{lambert, solid_angle};
use crate::emitters::{LightRef, PointLight, SunLight, TriangleLight};
use crate::occluders::Occluders;
use crate::overbright::luminance;
use crate::world::RelitWorld;
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::f32::consts::{PI, TAU};
use support::parallel;
use support::random::{Pairs, Random};
use support::slice;

/// Points that one task computes: neighbours share the triangles that shadow them.
const TASK: usize = 64;

/// Part of a point's unshadowed light that the weakest lights may have together and be left out.
const NEGLIGIBLE: f32 = 0.003;

/// The same, absolute: a quarter of a step of a stored byte, irradiance over π.
const NEGLIGIBLE_STEP: f32 = 0.25 * 4.0 / 255.0;

/// Area over squared distance from which a triangle gets [`WIDE_RAYS`] times the rays, an approximate solid angle, sr.
const WIDE: f32 = 0.15;
/// Factor of the rays to a wide triangle; their number if there is one ray to a light.
const WIDE_RAYS: u32 = 4;

/// Least distance at which the light of a point is computed, id units: q3map2 avoids spots by it.
const NEAREST: f32 = 16.0;

/// Directions over the sphere in which the sky is searched: with one ray to each light, and with several.
const SKY_DIRECTIONS: [u32; 2] = [384, 1024];

/// Casts rays on the CPU's threads.
pub struct Rays<'a> {
    world: &'a RelitWorld,
    occluders: Occluders,
    /// What reflects light, if more than casts shadows.
    reflecting: Option<Occluders>,
    has_sky_lights: bool,
}

impl<'a> Rays<'a> {
    /// Builds the hierarchy of a world's triangles.
    pub fn new(world: &'a RelitWorld) -> Rays<'a> {
        Rays {
            world,
            occluders: Occluders::that_shadow(world),
            reflecting: world.has_shadowless().then(|| Occluders::of_world(world)),
            has_sky_lights: world.lights.iter().any(|light| light.is_sky),
        }
    }
}

/// Light that would arrive without shadows.
struct Unshadowed {
    entry: u32,
    value: Vec3,
    size: f32,
    /// What the compiler counts as one light, whether it is a sprite: see [`TriangleLight::has_own_cutoff`].
    one: (bool, u32),
    is_point: bool,
}

/// For each light of a list the leaf that shadowed a neighbouring point.
#[derive(Default)]
struct Hints {
    cluster: Option<i32>,
    leaves: Vec<Option<u32>>,
}

impl Hints {
    /// Hints for the list of a cluster.
    fn enter(&mut self, cluster: i32, length: usize) {
        if self.cluster != Some(cluster) {
            self.cluster = Some(cluster);
            self.leaves.clear();
            self.leaves.resize(length, None);
        }
    }
}

/// Where the shadow rays of one point to one light end: points that are averaged take other strata of the light each.
struct Strata {
    places: Pairs,
    rank: u32,
}

impl Strata {
    /// `first`: the number of the first of the points that are averaged; `light`: unique for each light.
    fn new(first: usize, light: u32, rank: u32) -> Strata {
        let own = (first as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        Strata {
            places: Pairs::new(own ^ u64::from(light)),
            rank,
        }
    }

    /// In the unit square. Rays from the number `rays` on replace others.
    fn place(&self, ray: u32, rays: u32) -> [f32; 2] {
        let (turn, ray) = (ray / rays.max(1), ray % rays.max(1));
        let within = self.rank.wrapping_mul(rays).wrapping_add(ray);
        self.places.at(within ^ turn << 24)
    }

    /// In the disc of radius 1.
    fn in_disc(&self, ray: u32, rays: u32) -> [f32; 2] {
        let [x, y] = self.place(ray, rays);
        let (sin, cos) = (y * TAU).sin_cos();
        [cos, sin].map(|along| along * x.sqrt())
    }
}

impl Rays<'_> {
    fn direct_at(&self, point: &Point, samples: u32, number: usize, hints: &mut Hints) -> Light {
        let world = self.world;
        let cluster = world.bsp.cluster_at(point.position);
        let row = world.light_lists.row(cluster);
        hints.enter(cluster, row.len());
        let first = number.saturating_sub(point.rank as usize);
        let mut sum = Light::default();
        for (place, light) in self.unshadowed(point, row) {
            let hint = slice::get_mut(&mut hints.leaves, place);
            let mut none = None;
            let hint = hint.unwrap_or(&mut none);
            let strata = Strata::new(first, light.entry, point.rank);
            let (part, towards) = match world.light_lists.light(light.entry) {
                LightRef::Triangle(index) => match world.lights.get(index as usize) {
                    Some(light) => self.part_of_triangle(point, light, samples, hint, &strata),
                    None => continue,
                },
                LightRef::Point(index) => match world.point_lights.get(index as usize) {
                    Some(light) => self.part_of_point(point, light, samples, hint, &strata),
                    None => continue,
                },
            };
            add(&mut sum, light.value * part, towards);
        }
        if world.light_lists.sees_sky(cluster) {
            for (sun, key) in world.suns.iter().zip(0u32..) {
                let strata = Strata::new(first, !key, point.rank);
                self.add_sun(point, sun, samples, &strata, &mut sum);
            }
            if self.has_sky_lights {
                self.add_sky(point, samples, &mut sum);
            }
        }
        sum
    }

    /// The lights of a list without the negligible ones, each with its place in the list. Skies are not among them.
    fn unshadowed(&self, point: &Point, row: &[u32]) -> Vec<(usize, Unshadowed)> {
        let world = self.world;
        let mut all = Vec::new();
        for (place, &entry) in row.iter().enumerate() {
            let light = world.light_lists.light(entry);
            let is_point = matches!(light, LightRef::Point(_));
            let (value, one) = match light {
                LightRef::Triangle(index) => {
                    let Some(light) = world.lights.get(index as usize).filter(|l| !l.is_sky) else {
                        continue;
                    };
                    let geometric = match point.normal == Vec3::ZERO {
                        true => solid_angle(point.position, light),
                        false => lambert(point.position, point.normal, light),
                    };
                    let one = match light.has_own_cutoff() {
                        true => (false, entry),
                        false => (true, light.surface),
                    };
                    (light.radiance * (geometric / PI), one)
                }
                LightRef::Point(index) => {
                    let Some(light) = world.point_lights.get(index as usize) else {
                        continue;
                    };
                    let value = light.intensity * unshadowed_point(point, light);
                    (value, (false, entry))
                }
            };
            // negative lights take light away
            let size = value.abs().max_element();
            if size > 0.0 {
                all.push((
                    place,
                    Unshadowed {
                        entry,
                        value,
                        size,
                        one,
                        is_point,
                    },
                ));
            }
        }
        if world.light_cutoff > 0.0 {
            cut_off(&mut all, world.light_cutoff, world.has_compiled_lights);
        }
        let whole: f32 = all.iter().map(|(_, light)| light.size).sum();
        let mut sizes: Vec<f32> = all.iter().map(|(_, light)| light.size).collect();
        sizes.sort_by(f32::total_cmp);
        let mut left = (whole * NEGLIGIBLE).min(NEGLIGIBLE_STEP);
        let mut least = 0.0;
        for size in sizes {
            left -= size;
            if left < 0.0 {
                break;
            }
            least = size;
        }
        all.retain(|(_, light)| light.size > least);
        all
    }

    /// Visible part of a triangle, and the direction to it.
    fn part_of_triangle(
        &self,
        point: &Point,
        light: &TriangleLight,
        samples: u32,
        hint: &mut Option<u32>,
        strata: &Strata,
    ) -> (f32, Vec3) {
        let [a, b, c] = light.vertices;
        let middle = (a + b + c) / 3.0;
        let towards = (middle - point.position).normalize_or_zero();
        let above =
            |to: Vec3| point.normal == Vec3::ZERO || point.normal.dot(to - point.position) > 0.0;
        let wide = light.area() > WIDE * middle.distance_squared(point.position);
        if samples == 0 && self.world.has_compiled_lights {
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            // q3map2 moves it off the surface
            let middle = (low + high) * 0.5 + light.normal();
            let open =
                above(middle) && !self.occluders.blocked_hinted(point.position, middle, hint);
            return (if open { 1.0 } else { 0.0 }, towards);
        }
        let rays = match (samples, wide) {
            (0, false) if above(middle) => {
                let stopped = self.occluders.blocked_hinted(point.position, middle, hint);
                return (if stopped { 0.0 } else { 1.0 }, towards);
            }
            (0, _) => WIDE_RAYS,
            (samples, false) => samples,
            (samples, true) => samples.saturating_mul(WIDE_RAYS),
        };
        let (mut sent, mut open) = (0u32, 0u32);
        for ray in 0..rays.saturating_mul(3) {
            let [x, y] = strata.place(ray, rays);
            let from_a = x.sqrt();
            let to = a + ((b - a) * (1.0 - y) + (c - a) * y) * from_a;
            if !above(to) {
                continue;
            }
            sent += 1;
            open += u32::from(!self.occluders.blocked_hinted(point.position, to, hint));
            if sent == rays {
                break;
            }
        }
        (open as f32 / sent.max(1) as f32, towards)
    }

    /// Visible part of a point light's sphere, and the direction to it.
    fn part_of_point(
        &self,
        point: &Point,
        light: &PointLight,
        samples: u32,
        hint: &mut Option<u32>,
        strata: &Strata,
    ) -> (f32, Vec3) {
        let towards = (light.origin - point.position).normalize_or_zero();
        let rays = if light.radius > 0.0 {
            samples.max(1)
        } else {
            1
        };
        // the sphere seen from the point is a disc
        let (u, v) = towards.any_orthonormal_pair();
        let mut open = 0;
        for ray in 0..rays {
            let to = match samples {
                0 => light.origin,
                _ => {
                    let [x, y] = strata.in_disc(ray, rays);
                    light.origin + (u * x + v * y) * light.radius
                }
            };
            open += u32::from(!self.occluders.blocked_hinted(point.position, to, hint));
        }
        (open as f32 / rays as f32, towards)
    }

    fn add_sun(
        &self,
        point: &Point,
        sun: &SunLight,
        samples: u32,
        strata: &Strata,
        sum: &mut Light,
    ) {
        let (u, v) = sun.direction.any_orthonormal_pair();
        let radius = sun.angular_radius.tan();
        let rays = samples.max(1);
        for ray in 0..rays {
            let direction = match samples {
                0 => sun.direction,
                _ => {
                    let [x, y] = strata.in_disc(ray, rays);
                    (sun.direction + (u * x + v * y) * radius).normalize_or(sun.direction)
                }
            };
            let cosine = cosine(point, direction);
            if cosine <= 0.0 {
                continue;
            }
            let hit = self
                .occluders
                .nearest(point.position, direction, f32::INFINITY);
            if hit.is_none_or(|hit| hit.sky) {
                let value = sun.irradiance * (cosine / PI / rays as f32);
                add(sum, value, direction);
            }
        }
    }

    /// Light of sky surfaces, from directions that are the same at all points: no noise between neighbours.
    fn add_sky(&self, point: &Point, samples: u32, sum: &mut Light) {
        let [few, many] = SKY_DIRECTIONS;
        let count = if samples == 0 { few } else { many };
        for direction in sphere(count) {
            let cosine = cosine(point, direction);
            if cosine <= 0.0 {
                continue;
            }
            let hit = self
                .occluders
                .nearest(point.position, direction, f32::INFINITY);
            let Some(hit) = hit.filter(|hit| hit.sky) else {
                continue;
            };
            if let Some(light) = self.world.light_of_triangle(hit.tag as usize) {
                let part = cosine * 4.0 / count as f32;
                add(sum, light.radiance * part, direction);
            }
        }
    }

    fn reflected_at(&self, point: &Point, lit: LitSurfaces<'_>, rays: u32, number: usize) -> Light {
        let reflecting = self.reflecting.as_ref().unwrap_or(&self.occluders);
        let mut random = Random::new(0xB0CE_0000 + number as u64);
        let side = (rays.max(1) as f32).sqrt().ceil() as u32;
        let (u, v) = match point.normal == Vec3::ZERO {
            true => (Vec3::X, Vec3::Y),
            false => point.normal.any_orthonormal_pair(),
        };
        let mut sum = Light::default();
        // fluence over π of uniform radiance L is 4 L
        let part = if point.normal == Vec3::ZERO { 4.0 } else { 1.0 } / (side * side) as f32;
        for stratum in 0..side * side {
            let x = ((stratum % side) as f32 + random.uniform()) / side as f32;
            let y = ((stratum / side) as f32 + random.uniform()) / side as f32;
            let (sin, cos) = (x * TAU).sin_cos();
            let ray = match point.normal == Vec3::ZERO {
                true => {
                    let z = 1.0 - 2.0 * y;
                    let radius = (1.0 - z * z).max(0.0).sqrt();
                    Vec3::new(radius * cos, radius * sin, z)
                }
                // cosine-weighted: the mean of radiance is irradiance over π (Malley's method)
                false => (u * cos + v * sin) * y.sqrt() + point.normal * (1.0 - y).sqrt(),
            };
            let hit = reflecting.nearest(point.position, ray, f32::INFINITY);
            let Some(hit) = hit.filter(|hit| !hit.sky && hit.front) else {
                continue;
            };
            let triangle = hit.tag as usize;
            let light = light_at(self.world, lit, triangle, point.position + ray * hit.t);
            add(
                &mut sum,
                light * slice::item(lit.reflectances, triangle) * part,
                ray,
            );
        }
        sum
    }
}

/// Adds light from a direction.
fn add(sum: &mut Light, value: Vec3, towards: Vec3) {
    *sum += Light {
        value,
        towards: towards * luminance(value),
    };
}

fn cosine(point: &Point, direction: Vec3) -> f32 {
    match point.normal == Vec3::ZERO {
        true => 1.0,
        false => point.normal.dot(direction),
    }
}

/// Irradiance over π of a point light of intensity 1, without shadows.
fn unshadowed_point(point: &Point, light: &PointLight) -> f32 {
    let offset = light.origin - point.position;
    let cosine = cosine(point, offset.normalize_or_zero());
    let distance = offset.length().max(NEAREST);
    if cosine <= 0.0 {
        return 0.0;
    }
    let cone = light.spot.map_or(1.0, |spot| spot.part(offset));
    light.falloff.irradiance(distance, cosine) * cone / PI
}

/// Removes lights whose unshadowed light is not above the cutoff, points alone or all; skies and suns are not among them.
fn cut_off(all: &mut Vec<(usize, Unshadowed)>, cutoff: f32, of_points: bool) {
    let mut sums: HashMap<(bool, u32), f32> = HashMap::new();
    for (_, light) in all.iter() {
        *sums.entry(light.one).or_default() += light.size;
    }
    all.retain(|(_, light)| {
        of_points && !light.is_point || sums.get(&light.one).is_some_and(|sum| *sum > cutoff)
    });
}

/// Directions evenly over the sphere: a Fibonacci spiral.
fn sphere(count: u32) -> impl Iterator<Item = Vec3> {
    let golden = (5.0f32.sqrt() - 1.0) / 2.0;
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f32 / count as f32;
        let radius = (1.0 - z * z).sqrt();
        let (sin, cos) = ((i as f32 * golden).fract() * TAU).sin_cos();
        Vec3::new(radius * cos, radius * sin, z)
    })
}

/// Light on a triangle at a position on it.
fn light_at(world: &RelitWorld, lit: LitSurfaces<'_>, triangle: usize, at: Vec3) -> Vec3 {
    let [a, b, c] = world.triangle(triangle);
    let (e1, e2, offset) = (b - a, c - a, at - a);
    let normal = e1.cross(e2);
    let squared = normal.length_squared();
    if squared <= 0.0 {
        return Vec3::ZERO;
    }
    let u = offset.cross(e2).dot(normal) / squared;
    let v = e1.cross(offset).dot(normal) / squared;
    let light = |index: u32| slice::item(lit.light, index as usize);
    match slice::item(lit.triangles, triangle) {
        LitTriangle::Dark => Vec3::ZERO,
        LitTriangle::Vertices([a, b, c]) => light(a) * (1.0 - u - v) + light(b) * u + light(c) * v,
        LitTriangle::Texels {
            first,
            side,
            corners: [a, b, c],
        } => {
            let place = a + (b - a) * u + (c - a) * v;
            let most = Vec2::splat(side.saturating_sub(1) as f32);
            let texel = place.floor().clamp(Vec2::ZERO, most);
            light(first + texel.y as u32 * side + texel.x as u32)
        }
    }
}

impl Rays<'_> {
    /// Computes points in tasks; `one` gets a task's first number and its points.
    fn tasks<T: Send>(
        &self,
        points: &[Point],
        progress: GatherProgress<'_>,
        one: impl Fn(usize, &[Point]) -> Vec<T> + Sync,
    ) -> Vec<T> {
        let tasks: Vec<&[Point]> = points.chunks(TASK).collect();
        // progress is reported between rounds
        let round = tasks.len().div_ceil(64).max(64);
        let mut found = Vec::with_capacity(points.len());
        for (number, some) in tasks.chunks(round).enumerate() {
            let first = number * round;
            let done = parallel::map(some, |i, task| one((first + i) * TASK, task));
            found.extend(done.into_iter().flatten());
            progress(found.len() as f32 / points.len().max(1) as f32);
        }
        found
    }
}

impl Gather for Rays<'_> {
    fn name(&self) -> String {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        format!("{threads} CPU threads")
    }

    fn direct(
        &mut self,
        points: &[Point],
        samples: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        Ok(self.tasks(points, progress, |first, task| {
            let mut hints = Hints::default();
            let numbered = (first..).zip(task);
            numbered
                .map(|(number, point)| self.direct_at(point, samples, number, &mut hints))
                .collect()
        }))
    }

    fn reflected(
        &mut self,
        points: &[Point],
        lit: LitSurfaces<'_>,
        rays: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        Ok(self.tasks(points, progress, |first, task| {
            let numbered = (first..).zip(task);
            numbered
                .map(|(number, point)| self.reflected_at(point, lit, rays, number))
                .collect()
        }))
    }

    fn nearness(
        &mut self,
        points: &[Point],
        around: &Surroundings,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<f32>, GatherError> {
        let at = |point: &Point| around.nearness(&self.occluders, point.position, point.normal);
        Ok(self.tasks(points, progress, |_, task| task.iter().map(at).collect()))
    }
}
