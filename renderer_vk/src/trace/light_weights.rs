//! Weights of a list's lights: estimated irradiance at points of a cell, with visibility.

use std::f32::consts::PI;

use glam::Vec3;
use relight::light::{Occlusion, TriangleLight};
use shaders::trace_types as t;
use support::Aabb;

use super::light_cells::Cell;
use super::light_normal_bins::{BESIDE, NORMAL_BINS, POINTS, direction};

/// Cosine and sine of the angle by which the tilted sample normals deviate from the surface normal.
const TILT: (f32, f32) = (0.8, 0.6);

/// Weight, in rays, of a light's visibility in the whole cluster against the rays from a cell's few points. With a
/// smaller weight, a light that reaches none of these points is sampled too rarely where it is visible.
const KNOWN_RAYS: f32 = 4.0;

/// The same at a single point, which sends one ray to one point of the light.
const KNOWN_RAYS_AT_PLACE: f32 = 1.0;

/// A light of a cluster's list, with the data that weights need.
pub struct Listed<'a> {
    /// Its number.
    pub number: u32,
    /// Bounds.
    pub bounds: t::LightBounds,
    /// The triangle, if it is a triangle light.
    pub triangle: Option<&'a TriangleLight>,
    /// Estimated visible part of the light in the cluster.
    pub visibility: f32,
}

/// A light as seen from a point: its light without the cosine at the point, and its direction.
struct Seen {
    light: f32,
    /// Unit vectors to its corners, or to its centre.
    directions: [Vec3; 3],
    parts: usize,
    /// Sine of its angular radius; 0 if `directions` are its corners.
    size: f32,
}

impl Seen {
    /// Approximate mean cosine between a normal and the directions to the light.
    fn cosine(&self, normal: Vec3) -> f32 {
        let of = |direction: &Vec3| {
            let aloft = normal.dot(*direction);
            aloft.max(0.25 * (aloft + self.size)).clamp(0.0, 1.0)
        };
        let parts = self.directions.iter().take(self.parts);
        #[allow(clippy::cast_precision_loss)] // one or three
        let count = self.parts as f32;
        parts.map(of).sum::<f32>() / count
    }
}

impl Listed<'_> {
    /// As `light_target` of `shaders/trace/lights.glsl`; `nearest`: lower bound of the distance.
    fn seen_from(&self, point: Vec3, nearest: f32) -> Option<Seen> {
        let bounds = &self.bounds;
        let to = bounds.centre - point;
        let squared = to.length_squared().max(nearest * nearest).max(1.0);
        let inverse = squared.sqrt().recip();
        let mut light = bounds.omni_intensity;
        if bounds.omni_intensity <= 0.0 {
            let facing = -bounds.axis.dot(to);
            let facing = if bounds.omni_intensity < 0.0 {
                facing.abs()
            } else {
                facing
            };
            if facing <= 0.0 {
                return None;
            }
            let large = bounds.radius * bounds.radius * 4.0 > squared;
            if let Some(triangle) = self.triangle.filter(|_| large) {
                return Some(large_triangle(triangle, bounds, point));
            }
            light = facing * inverse / PI;
        } else if bounds.axis != Vec3::ZERO {
            let stretch = bounds.axis.length();
            if -bounds.axis.dot(to) * inverse < (stretch - 2.0) * stretch {
                return None;
            }
        }
        Some(Seen {
            light: light / squared.max(0.25 * bounds.radius * bounds.radius),
            directions: [to * inverse; 3],
            parts: 1,
            size: bounds.radius * inverse,
        })
    }

    /// Approximate irradiance over pi on a surface that faces the light; `nearest`: lower bound of the distance. `None`
    /// behind a one-sided light.
    pub fn straight_on(&self, point: Vec3, nearest: f32) -> Option<f32> {
        self.seen_from(point, nearest).map(|seen| seen.light)
    }

    /// Approximate light that it emits in all directions.
    pub fn power(&self) -> f32 {
        if self.bounds.omni_intensity > 0.0 {
            self.bounds.omni_intensity
        } else {
            self.bounds.axis.length() * (0.25 / PI)
        }
    }

    /// Target of a visibility ray: point number `turn` on a triangle light, or the nearest point of a sphere light, whose
    /// centre may lie inside of geometry; `None` behind a one-sided light.
    pub fn point_for(&self, place: Vec3, turn: usize) -> Option<Vec3> {
        let Some(triangle) = self.triangle else {
            let away = (place - self.bounds.centre).clamp_length_max(self.bounds.radius);
            return Some(self.bounds.centre + away);
        };
        #[allow(clippy::cast_precision_loss)] // a handful
        let turn = turn as f32 + 0.5;
        let (u, v) = ((turn * 0.618_034).fract(), (turn * 0.414_213_6).fract());
        let (u, v) = if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        };
        let [a, b, c] = triangle.vertices;
        let point = a + (b - a) * u + (c - a) * v;
        let faces = triangle.two_sided || triangle.normal().dot(place - point) > 0.0;
        faces.then_some(point)
    }

    /// Whether every point of a cell with a normal of this normal bin is below the light's horizon.
    pub fn is_below(&self, cell: &Cell, bin: usize) -> bool {
        let Aabb { mins, maxs } = cell.bounds.grown(Vec3::splat(BESIDE));
        let axis = direction(bin);
        // Height of a position over a point's horizon, for a normal whose largest component is 1 and whose others, of
        // any value up to 1, are the most favourable; its length is at most the root of 3.
        let highest = |place: Vec3, radius: f32| {
            let (low, high) = (place - maxs, place - mins);
            let along = (axis * low).max(axis * high).dot(axis.abs());
            let beside = low.abs().max(high.abs()) * (Vec3::ONE - axis.abs());
            along + beside.element_sum() + radius * 3.0f32.sqrt()
        };
        match self.triangle {
            Some(triangle) => triangle.vertices.iter().all(|&p| highest(p, 0.0) < 0.0),
            None => highest(self.bounds.centre, self.bounds.radius) < 0.0,
        }
    }
}

/// A triangle light that subtends a large solid angle at a point.
fn large_triangle(triangle: &TriangleLight, bounds: &t::LightBounds, point: Vec3) -> Seen {
    let directions = triangle.vertices.map(|p| (p - point).normalize_or(Vec3::Z));
    let [a, b, c] = directions;
    // Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983
    let volume = a.dot(b.cross(c)).abs();
    let omega = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
    let radiance = bounds.axis.length() / triangle.area().max(f32::MIN_POSITIVE);
    Seen {
        light: radiance * omega / PI,
        directions,
        parts: 3,
        size: 0.0,
    }
}

/// Point `i` of a low-discrepancy sequence in the unit cube.
///
/// Source: the additive recurrence by the root of x^4 = x + 1 (Roberts, The Unreasonable Effectiveness of Quasirandom
/// Sequences, 2018).
pub fn spread_point(i: usize) -> Vec3 {
    let step = Vec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5);
    #[allow(clippy::cast_precision_loss)] // some hundred
    (step * i as f32 + 0.5).fract()
}

/// A point at which lights are weighted, with normals and their weights.
pub struct Place {
    point: Vec3,
    normals: Vec<(Vec3, f32)>,
}

impl Place {
    /// Points throughout a cell, for surfaces of any orientation.
    pub fn throughout(cell: &Cell) -> Vec<Self> {
        let place = |i: usize| Self {
            point: cell.bounds.mins + cell.bounds.size() * spread_point(i),
            normals: (0..NORMAL_BINS)
                .map(|f| (direction(f), 1.0 / 6.0))
                .collect(),
        };
        (0..POINTS).map(place).collect()
    }

    /// A point on a surface, with normals around the surface's own.
    pub fn on_surface(point: Vec3, normal: Vec3) -> Self {
        let (x, y) = normal.any_orthonormal_pair();
        let tilted = [x, y, -x, -y].map(|side| (normal * TILT.0 + side * TILT.1, 0.1));
        Self {
            point,
            normals: [(normal, 0.6)].into_iter().chain(tilted).collect(),
        }
    }
}

/// Estimated visible part of each light.
pub struct Arriving {
    /// Mean over all points.
    pub together: Vec<f32>,
    /// At each point.
    at_places: Vec<Vec<f32>>,
}

impl Arriving {
    /// Visibility as the light list stores it.
    pub fn as_listed(lights: &[&Listed<'_>], places: &[Place]) -> Self {
        let together: Vec<f32> = lights.iter().map(|light| light.visibility).collect();
        Self {
            at_places: vec![together.clone(); places.len()],
            together,
        }
    }

    /// Visibility by one ray from each point to each light that it faces.
    pub fn looked_for(lights: &[&Listed<'_>], places: &[Place], occlusion: &Occlusion) -> Self {
        let mut arriving = Self::as_listed(lights, places);
        for (number, (light, together)) in lights.iter().zip(&mut arriving.together).enumerate() {
            let mut last = None;
            let seen: Vec<Option<bool>> = (places.iter().enumerate())
                .map(|(turn, place)| {
                    let to = light.point_for(place.point, turn)?;
                    let (normal, _) = place.normals.first()?;
                    let faces = normal.dot(to - place.point) > 0.0;
                    faces.then(|| occlusion.is_free(place.point, to, &mut last))
                })
                .collect();
            let estimate = |found: f32, rays: f32, before: f32, known: f32| {
                (found + before * known) / (rays + known)
            };
            #[allow(clippy::cast_precision_loss)] // a handful
            let [rays, found] = [
                seen.iter().flatten().count() as f32,
                seen.iter().flatten().filter(|free| **free).count() as f32,
            ];
            *together = estimate(found, rays, light.visibility, KNOWN_RAYS);
            for (at_place, seen) in arriving.at_places.iter_mut().zip(seen) {
                if let Some(at_place) = at_place.get_mut(number) {
                    *at_place = match seen {
                        Some(free) => {
                            estimate(f32::from(free), 1.0, *together, KNOWN_RAYS_AT_PLACE)
                        }
                        None => *together,
                    };
                }
            }
        }
        arriving
    }
}

/// Probabilities for the lights of a list: one half by each light's share in the sum of all light at all points, which
/// keeps the noise of bright points low; one half by the mean of its shares at each point, by which a dark point keeps
/// a part of the probabilities, so that no light is sampled too rarely there.
pub fn shares(
    lights: &[&Listed<'_>],
    arriving: &Arriving,
    places: &[Place],
    nearest: f32,
) -> Vec<f32> {
    let mut shares = vec![0.0f32; lights.len()];
    let mut given = vec![0.0f32; lights.len()];
    let mut sums = vec![0.0f32; lights.len()];
    #[allow(clippy::cast_precision_loss)] // a handful
    let each = 0.5 / places.len().max(1) as f32;
    for (place, arriving) in places.iter().zip(&arriving.at_places) {
        let seen: Vec<Option<Seen>> = (lights.iter())
            .map(|light| light.seen_from(place.point, nearest))
            .collect();
        for &(normal, part) in &place.normals {
            for ((given, seen), part) in given.iter_mut().zip(&seen).zip(arriving) {
                let bare = |seen: &Seen| seen.light * seen.cosine(normal);
                *given = seen.as_ref().map_or(0.0, bare) * part;
            }
            let total: f32 = given.iter().sum();
            if total > 0.0 && total.is_finite() {
                let shares = shares.iter_mut().zip(&mut sums);
                for ((share, sum), given) in shares.zip(&given) {
                    *share += each * part * given / total;
                    *sum += part * given;
                }
            }
        }
    }
    let total: f32 = sums.iter().sum();
    for (share, sum) in shares.iter_mut().zip(&sums) {
        *share += 0.5 * sum / total.max(f32::MIN_POSITIVE);
    }
    shares
}

#[cfg(test)]
mod target_test;
#[cfg(test)]
pub(super) mod tests {
    use super::super::lights::{triangle_bounds, triangle_light};
    use super::*;
    use q3bsp::builder::MapBuilder;
    use relight::light::EmissionSource;
    use relight::{Materials, MemoryFiles, Options, RelitWorld};
    use testkit::Random;

    pub fn lamp(at: Vec3, towards: Vec3, radiance: f32) -> TriangleLight {
        let (x, y) = towards.normalize().any_orthonormal_pair();
        let mut vertices = [at + x * 4.0, at + y * 4.0, at - (x + y) * 4.0];
        let [a, b, c] = vertices;
        if (b - a).cross(c - a).dot(towards) < 0.0 {
            vertices.swap(0, 1);
        }
        TriangleLight {
            vertices,
            radiance: Vec3::splat(radiance),
            two_sided: false,
            surface: 0,
            triangle: 0,
            model: 0,
            is_sky: false,
            source: EmissionSource::SurfaceLight,
        }
    }

    pub(super) fn listed(light: &TriangleLight) -> Listed<'_> {
        Listed {
            number: 0,
            bounds: triangle_bounds(&triangle_light(light, 0.0, Vec3::ZERO)),
            triangle: Some(light),
            visibility: 1.0,
        }
    }

    fn chances(lights: &[&Listed<'_>], places: &[Place]) -> Vec<f32> {
        shares(lights, &Arriving::as_listed(lights, places), places, 1.0)
    }

    #[test]
    fn probabilities_follow_the_light_on_surfaces_of_one_normal_bin() {
        // two equal lamps, one in front of a wall and one behind it, and a weak lamp that alone lights a distant point
        let wall = [Vec3::ZERO, Vec3::new(10.0, 0.0, 0.0)];
        let far = Vec3::X * 4000.0;
        let before = lamp(Vec3::Y * 100.0, -Vec3::Y, 1.0);
        let behind = lamp(Vec3::Y * -100.0, Vec3::Y, 1.0);
        let weak = lamp(far + Vec3::Y * 50.0, -Vec3::Y, 0.001);
        let lights = [&before, &behind, &weak].map(listed);
        let lights: Vec<&Listed<'_>> = lights.iter().collect();
        let on = |p: &Vec3| Place::on_surface(*p, Vec3::Y);
        let places: Vec<Place> = wall.iter().map(on).collect();
        let found = chances(&lights, &places);
        assert!((found.iter().sum::<f32>() - 1.0).abs() < 1.0e-4);
        assert!(found[0] > 0.99, "{found:?}");
        // a dark point keeps its half, however dark it is
        let places: Vec<Place> = wall.iter().chain([&far]).map(on).collect();
        let found = chances(&lights, &places);
        assert!(found[2] > 0.1, "{found:?}");
        // without orientation, both lamps have equal weights
        let cell = Cell {
            cluster: 0,
            bounds: Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0)),
        };
        let found = chances(&lights, &Place::throughout(&cell));
        assert!((found[0] / found[1] - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn occluded_lamps_lose_probability() {
        // a board hides the left lamp from a floor
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_cell(Vec3::splat(-500.0), Vec3::splat(500.0));
        let low = Vec3::new(-200.0, -200.0, 50.0);
        map.add_box_faces(wall, low, Vec3::new(-20.0, 200.0, 52.0), false);
        let (files, options) = (MemoryFiles::new(), Options::default());
        let (materials, _) = Materials::load(&files);
        let world = RelitWorld::from_bsp(&files, &materials, "maps/t.bsp", map.build(), options);
        let occlusion = Occlusion::new(&world);
        let left = lamp(Vec3::new(-100.0, 0.0, 100.0), Vec3::NEG_Z, 1.0);
        let right = lamp(Vec3::new(100.0, 0.0, 100.0), Vec3::NEG_Z, 1.0);
        let up = lamp(Vec3::new(0.0, 0.0, 60.0), Vec3::Z, 1.0);
        let lights = [&left, &right, &up].map(listed);
        let lights: Vec<&Listed<'_>> = lights.iter().collect();
        let places: Vec<Place> = (0..POINTS)
            .map(|i| Place::on_surface(Vec3::new(i as f32 * 4.0 - 100.0, 0.0, 1.0), Vec3::Z))
            .collect();
        let arriving = Arriving::looked_for(&lights, &places, &occlusion);
        // no ray of eight arrives, all arrive, no ray sent; the list's visibility has the weight of four rays
        let expected = [4.0 / 12.0, 1.0, 1.0];
        for (found, expected) in arriving.together.iter().zip(expected) {
            assert!((found - expected).abs() < 1.0e-6, "{:?}", arriving.together);
        }
        let open = shares(
            &lights,
            &Arriving::as_listed(&lights, &places),
            &places,
            1.0,
        );
        let seen = shares(&lights, &arriving, &places, 1.0);
        // at each point the hidden lamp has a sixth of its former weight
        let ratio = |shares: &[f32]| shares[0] / shares[1];
        assert!(ratio(&seen) < 0.25 * ratio(&open), "{seen:?} {open:?}");
        assert!(ratio(&seen) > 0.1 * ratio(&open), "{seen:?} {open:?}");
        assert_eq!(seen[2], 0.0);
    }

    #[test]
    fn lights_omitted_by_normal_bin_contribute_nothing() {
        let mut random = Random::new(1);
        let mut vector = || random.signed_point();
        let cell = Cell {
            cluster: 0,
            bounds: Aabb::new(Vec3::splat(-20.0), Vec3::splat(20.0)),
        };
        let mut left_out = 0;
        for _ in 0..2000 {
            let light = lamp(vector() * 300.0, vector(), 1.0);
            let listed = listed(&light);
            for bin in 0..NORMAL_BINS {
                if !listed.is_below(&cell, bin) {
                    continue;
                }
                left_out += 1;
                for _ in 0..20 {
                    let mut normal = vector() * (1.0 - direction(bin).abs());
                    normal += direction(bin) * normal.abs().max_element();
                    let point = vector() * 20.0;
                    let heights = light.vertices.map(|p| (p - point).dot(normal));
                    assert!(heights.iter().all(|h| *h <= 0.0), "{normal} {point}");
                }
            }
            // geometry in front of the cell is kept
            let axis = light.vertices[0].abs().max_element();
            let before = (0..NORMAL_BINS).find(|&f| light.vertices[0].dot(direction(f)) == axis);
            assert!(before.is_some_and(|f| !listed.is_below(&cell, f)));
        }
        assert!(left_out > 300, "{left_out}");
    }
}
