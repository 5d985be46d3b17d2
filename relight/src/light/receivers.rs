//! Receivers: points of a cluster at which light is gathered; and lights as targets of their rays.

use super::{LightRef, PointLight, TriangleLight};
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::SurfaceId;
use std::f32::consts::PI;
use support::Aabb;
use support::parallel;
use support::random::Random;
use support::slice;

/// Distance of a receiver from its surface, id units.
const LIFT: f32 = 0.5;

/// A point at which light is gathered.
#[derive(Debug, Clone, Copy)]
pub(super) struct Receiver {
    pub position: Vec3,
    /// Unit normal; zero in the open.
    pub normal: Vec3,
}

/// Receivers of each cluster: random points on its drawn surfaces, and in the open.
pub(super) fn receivers(
    world: &RelitWorld,
    clusters: usize,
    on_surfaces: usize,
    in_the_open: usize,
    seed: u64,
) -> Vec<Vec<Receiver>> {
    let bsp = &world.bsp;
    let mut surfaces: Vec<Vec<SurfaceId>> = vec![Vec::new(); clusters];
    let mut boxes: Vec<Vec<Aabb>> = vec![Vec::new(); clusters];
    for leaf in bsp.tree_leafs().into_iter().map(|id| bsp.leaf(id)) {
        let Some(cluster) = leaf.cluster_index() else {
            // Solid space has no cluster.
            continue;
        };
        let (Some(surfaces), Some(boxes)) = (surfaces.get_mut(cluster), boxes.get_mut(cluster))
        else {
            // The lights of a map without a PVS are in one list.
            continue;
        };
        let corner = |c: [i32; 3]| Vec3::from_array(c.map(|v| v as f32));
        boxes.push(Aabb::new(corner(leaf.mins), corner(leaf.maxs)));
        surfaces.extend_from_slice(bsp.leaf_surface_ids(leaf));
    }
    let rooms: Vec<_> = surfaces.into_iter().zip(boxes).collect();
    parallel::map(&rooms, |cluster, (surfaces, boxes)| {
        let mut random = Random::new(seed ^ (cluster as u64) << 8);
        let inside = |p: Vec3| bsp.leaf(bsp.leaf_at(p)).cluster_index() == Some(cluster);
        let mut points =
            points_on_surfaces(world, surfaces, boxes, on_surfaces, &mut random, inside);
        // a cluster without drawn surfaces gets more points in the open
        let open = in_the_open.max((on_surfaces + in_the_open - points.len()) / 2);
        points_in_the_open(boxes, open, &mut random, inside, &mut points);
        points
    })
}

/// Points on the surfaces of a cluster, approximately uniform over the area inside its leafs' bounds (rejection
/// with few tries).
fn points_on_surfaces(
    world: &RelitWorld,
    surfaces: &[SurfaceId],
    boxes: &[Aabb],
    count: usize,
    random: &mut Random,
    inside: impl Fn(Vec3) -> bool,
) -> Vec<Receiver> {
    let mut listed = surfaces.to_vec();
    listed.sort_unstable();
    listed.dedup();
    let mut triangles = Vec::new();
    let mut total = 0.0f32;
    for surface in listed
        .into_iter()
        .filter_map(|id| slice::get(&world.surfaces, id.index()))
    {
        for triangle in surface.triangles() {
            let [a, b, c] = world.triangle(triangle);
            let bounds = Aabb::of([a, b, c]);
            // only surfaces that may lie in the cluster
            let touches = |leaf: &Aabb| bounds.touches(leaf.grown(Vec3::ONE));
            let area = (b - a).cross(c - a).length() * 0.5;
            if area > 0.0 && area.is_finite() && boxes.iter().any(touches) {
                total += area;
                triangles.push((total, [a, b, c]));
            }
        }
    }
    let mut points = Vec::with_capacity(count);
    if triangles.is_empty() {
        return points;
    }
    for _ in 0..count * 8 {
        if points.len() == count {
            break;
        }
        let at = random.uniform() * total;
        let found = triangles
            .partition_point(|(end, _)| *end <= at)
            .min(triangles.len() - 1);
        let Some(&(_, [a, b, c])) = slice::get(&triangles, found) else {
            break;
        };
        let (u, v) = random.in_triangle();
        // fronts are clockwise
        let normal = (c - a).cross(b - a).normalize_or_zero();
        let on = a + (b - a) * u + (c - a) * v;
        // the same offset as in the shaders
        if inside(on + normal) {
            points.push(Receiver {
                position: on + normal * LIFT,
                normal,
            });
        }
    }
    points
}

/// Points in the open.
fn points_in_the_open(
    boxes: &[Aabb],
    count: usize,
    random: &mut Random,
    inside: impl Fn(Vec3) -> bool,
    points: &mut Vec<Receiver>,
) {
    let wanted = points.len() + count;
    for attempt in 0..count * 8 {
        if points.len() >= wanted || boxes.is_empty() {
            break;
        }
        let bounds = slice::item(boxes, attempt % boxes.len());
        let at = Vec3::new(random.uniform(), random.uniform(), random.uniform());
        let position = bounds.mins + bounds.size() * at;
        if inside(position) {
            points.push(Receiver {
                position,
                normal: Vec3::ZERO,
            });
        }
    }
}

/// Luminance of a linear colour; 0 if negative.
pub(super) fn luminance(color: Vec3) -> f32 {
    crate::overbright::luminance(color).max(0.0)
}

/// A light as the target of a ray.
pub(super) enum Target<'a> {
    Triangle(&'a TriangleLight),
    Point(&'a PointLight),
}

impl<'a> Target<'a> {
    pub fn of(world: &'a RelitWorld, entry: u32) -> Option<Self> {
        match world.light_lists.light(entry) {
            LightRef::Triangle(i) => slice::get(&world.lights, i as usize).map(Target::Triangle),
            LightRef::Point(i) => slice::get(&world.point_lights, i as usize).map(Target::Point),
        }
    }

    /// A random point of the light, and the unshadowed light at a receiver if all of the light were there:
    /// irradiance over π, luminance.
    pub fn sample(&self, receiver: &Receiver, random: &mut Random) -> (Vec3, f32) {
        let cosine = |to: Vec3| {
            if receiver.normal == Vec3::ZERO {
                // a surface in the open may face any direction
                0.25
            } else {
                receiver.normal.dot(to).max(0.0)
            }
        };
        match self {
            Target::Triangle(light) => {
                let [a, b, c] = light.vertices;
                let (u, v) = random.in_triangle();
                let point = a + (b - a) * u + (c - a) * v;
                let offset = point - receiver.position;
                let area = light.area();
                let squared = offset.length_squared().max(area * 0.05).max(1.0);
                let to = offset.normalize_or_zero();
                let facing = -light.normal().dot(to);
                let facing = if light.two_sided {
                    facing.abs()
                } else {
                    facing.max(0.0)
                };
                let power = luminance(light.radiance) * area;
                (point, power * facing * cosine(to) / (PI * squared))
            }
            Target::Point(light) => {
                let around =
                    Vec3::new(random.uniform(), random.uniform(), random.uniform()) * 2.0 - 1.0;
                let point = light.origin + around.clamp_length_max(1.0) * light.radius;
                let offset = light.origin - receiver.position;
                let squared = offset
                    .length_squared()
                    .max(light.radius * light.radius)
                    .max(1.0);
                let to = offset.normalize_or_zero();
                let in_cone = light.spot.is_none_or(|spot| {
                    let along = -to.dot(spot.direction);
                    along > 0.0
                        && (1.0 - along * along).max(0.0).sqrt() <= along * spot.tan_half_angle
                });
                let power = if in_cone {
                    luminance(light.intensity)
                } else {
                    0.0
                };
                let given = light.falloff.irradiance(squared.sqrt(), cosine(to));
                (point, power * given / PI)
            }
        }
    }

    /// Approximate unshadowed light at a position that faces the light.
    pub fn bare(&self, at: Vec3) -> f32 {
        let (middle, power) = match self {
            Target::Triangle(light) => {
                let [a, b, c] = light.vertices;
                let power = luminance(light.radiance) * light.area();
                ((a + b + c) / 3.0, power)
            }
            Target::Point(light) => (light.origin, luminance(light.intensity)),
        };
        power / (PI * middle.distance_squared(at).max(64.0))
    }
}
