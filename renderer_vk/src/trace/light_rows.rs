//! The lists that lights are drawn from: for each cell one for each direction that surfaces in it face.
//!
//! What faces away from a lamp gets nothing from it, however strong it is in the cell: with one list for all normals most
//! candidates on a wall may be lamps behind it. So a list's chances are by what its lights give to surfaces that face
//! about one way, where those lie. What moves has the list of the cell for all normals where nothing of the map faces
//! its way.

use std::f32::consts::PI;

use glam::Vec3;
use relight::light::{LightRef, LightShare, TriangleLight};
use shaders::trace_types as t;
use shaders::trace_types::constants as c;

use super::light_cells::{Cell, Cells};
use super::light_facings::{BESIDE, FACINGS, POINTS, direction};
use super::light_tables::{Entry, append_slots};
use super::lights::{
    MapLightSource, count, number, point_light, sphere_bounds, triangle_bounds, triangle_light,
};

/// Lights nearer to such a point than this part of the cell's half diagonal are taken to be as far away: what they give
/// grows without end there, but next to few points.
const NEAREST: f32 = 1.0 / 6.0;

/// Part of the chances of a list for one direction that is as in the list of the cell for all: for what moves, and for
/// places that are like none of the points.
const ANYWHERE_PART: f32 = 0.125;

/// Cosine and sine of the angle by which normals are tilted besides the one that faces straight on.
const TILT: (f32, f32) = (0.8, 0.6);

/// Part of a list's light that its weak lights may give together, by what is known of them. Where all lights are used,
/// some of these are picked at random.
const WEAK_PART: f32 = 0.1;

/// Fewest strong lights of a list that has weak ones: shorter lists are used whole.
const LEAST_STRONG: usize = 12;

/// Rays for the weak lights of a list, as the shaders send them.
const WEAK_RAYS: usize = c::WEAK_RAYS as usize;

/// How many of the entries, which fall by what they give, are strong.
fn strong(entries: &[Entry]) -> usize {
    let all: f32 = entries.iter().map(Entry::given).sum();
    let mut weak = 0.0;
    let few = entries.iter().rev().take_while(|entry| {
        weak += entry.given();
        weak <= all * WEAK_PART
    });
    let strong = entries.len() - few.count();
    if all.is_finite() && strong.max(LEAST_STRONG) + WEAK_RAYS < entries.len() {
        strong.max(LEAST_STRONG)
    } else {
        entries.len()
    }
}

/// A light of a cluster's list.
struct Listed<'a> {
    number: u32,
    bounds: t::LightBounds,
    /// Where it is one.
    triangle: Option<&'a TriangleLight>,
    visibility: f32,
}

/// What a point sees of a light: its light but for the cosine at the point, and where it lies.
struct Seen {
    light: f32,
    /// Unit vectors to its corners, or one to its middle.
    directions: [Vec3; 3],
    parts: usize,
    /// Sine of its angular radius, where that matters.
    size: f32,
}

impl Seen {
    /// About the mean cosine between a normal and the light.
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
    /// As the shaders' target function has it; `nearest`: the least distance that is believed.
    fn seen_from(&self, point: Vec3, nearest: f32) -> Option<Seen> {
        let bounds = &self.bounds;
        let to = bounds.centre - point;
        let squared = to.length_squared().max(nearest * nearest).max(1.0);
        let inverse = squared.sqrt().recip();
        let mut light = bounds.even;
        if bounds.even <= 0.0 {
            let facing = -bounds.axis.dot(to);
            let facing = if bounds.even < 0.0 {
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

    /// What it gives to all sides, about.
    fn power(&self) -> f32 {
        if self.bounds.even > 0.0 {
            self.bounds.even
        } else {
            self.bounds.axis.length() * (0.25 / PI)
        }
    }

    /// Whether it gives nothing to any point of a cell whose normal has its largest part along the axis of `facing`.
    fn is_below(&self, cell: &Cell, facing: usize) -> bool {
        let (mins, maxs) = (cell.mins - BESIDE, cell.maxs + BESIDE);
        let axis = direction(facing);
        // The height of a place over a point's horizon, were the largest part of the normal 1 and the others, which may
        // be anything up to that, the worst; such a normal is no longer than the root of 3.
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

/// A triangle that is large as seen from a point.
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

/// A point where lights are weighed, with normals and how much each counts.
struct Place {
    point: Vec3,
    normals: Vec<(Vec3, f32)>,
}

impl Place {
    /// Throughout a cell, for what faces any way.
    ///
    /// Source of the points: the additive recurrence by the root of x^4 = x + 1 (Roberts, The Unreasonable Effectiveness
    /// of Quasirandom Sequences, 2018).
    fn throughout(cell: &Cell) -> Vec<Self> {
        let step = Vec3::new(0.819_172_5, 0.671_043_6, 0.549_700_5);
        let place = |i: usize| {
            #[allow(clippy::cast_precision_loss)] // a handful
            let at = (step * i as f32 + 0.5).fract();
            Self {
                point: cell.mins + (cell.maxs - cell.mins) * at,
                normals: (0..FACINGS).map(|f| (direction(f), 1.0 / 6.0)).collect(),
            }
        };
        (0..POINTS).map(place).collect()
    }

    /// On a surface, for normals about its own.
    fn on_surface(point: Vec3, normal: Vec3) -> Self {
        let (x, y) = normal.any_orthonormal_pair();
        let tilted = [x, y, -x, -y].map(|side| (normal * TILT.0 + side * TILT.1, 0.1));
        Self {
            point,
            normals: [(normal, 0.6)].into_iter().chain(tilted).collect(),
        }
    }
}

/// Chances for the lights of a list, without visibility: one half by the share of each in what all give at all places
/// together, which keeps the noise of bright ones low, and one half by the mean of its shares at each place. By that one
/// that is dark beside others keeps a part of the chances for itself, and there is no light that it finds too rarely.
fn shares(lights: &[&Listed<'_>], places: &[Place], nearest: f32) -> Vec<f32> {
    let mut shares = vec![0.0f32; lights.len()];
    let mut given = vec![0.0f32; lights.len()];
    let mut sums = vec![0.0f32; lights.len()];
    #[allow(clippy::cast_precision_loss)] // a handful
    let each = 0.5 / places.len().max(1) as f32;
    for place in places {
        let seen: Vec<Option<Seen>> = (lights.iter())
            .map(|light| light.seen_from(place.point, nearest))
            .collect();
        for &(normal, part) in &place.normals {
            for ((given, seen), light) in given.iter_mut().zip(&seen).zip(lights) {
                let bare = |seen: &Seen| seen.light * seen.cosine(normal);
                *given = seen.as_ref().map_or(0.0, bare) * light.visibility;
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

/// Rows and slots of the lists: for each cell a row for each direction. The last row, which is always there, holds all
/// lights.
pub fn rows(
    source: &MapLightSource<'_>,
    numbers: &[Option<u32>],
    cells: &Cells,
) -> (Vec<t::LightRow>, Vec<t::LightSlot>) {
    let lists = source.lists;
    let mut rows = Vec::with_capacity(cells.cells.len() * FACINGS + 1);
    let mut slots = Vec::new();
    let mut row = |mut entries: Vec<Entry>, cluster: Option<i32>| {
        entries.sort_by(|a, b| b.given().total_cmp(&a.given()).then(a.light.cmp(&b.light)));
        let swept = cluster.is_some_and(|c| !lists.shares(c).is_empty());
        let strong = if swept {
            strong(&entries)
        } else {
            entries.len()
        };
        let row = t::LightRow {
            first: count(slots.len()),
            count: count(entries.len()),
            strong: count(strong),
            suns: u32::from(cluster.is_none_or(|c| lists.sees_sky(c))),
            cluster: cluster.map_or(u32::MAX, i32::unsigned_abs),
        };
        append_slots(&mut slots, &entries);
        append_slots(&mut slots, entries.get(strong..).unwrap_or_default());
        row
    };
    let clusters = 0..i32::try_from(lists.clusters()).unwrap_or(i32::MAX);
    let listed_in: Vec<Vec<Listed<'_>>> = clusters.map(|c| listed(source, numbers, c)).collect();
    for (cell, facings) in cells.cells.iter().zip(&cells.facings) {
        let cluster = i32::try_from(cell.cluster).ok();
        let listed = listed_in.get(cell.cluster).into_iter().flatten();
        let near: Vec<&Listed<'_>> = listed
            .filter(|light| !light.triangle.is_some_and(|t| cell.behind(t)))
            .collect();
        let entry = |light: &Listed<'_>, share: f32| Entry {
            light: light.number,
            weight: share / light.visibility.max(f32::MIN_POSITIVE),
            visibility: light.visibility,
        };
        let nearest = cell.ball().1 * NEAREST;
        let anywhere = shares(&near, &Place::throughout(cell), nearest);
        let of_all = near
            .iter()
            .zip(&anywhere)
            .map(|(l, share)| entry(l, *share));
        let of_all = row(of_all.collect(), cluster);
        for (facing, points) in facings.iter().enumerate() {
            if points.is_empty() {
                rows.push(of_all);
                continue;
            }
            let places = points
                .iter()
                .map(|&(p, normal)| Place::on_surface(p, normal));
            let own = shares(&near, &places.collect::<Vec<_>>(), nearest);
            let entries = near.iter().zip(anywhere.iter().zip(&own));
            let above = entries.filter(|(light, _)| !light.is_below(cell, facing));
            let entries = above.map(|(light, (any, own))| {
                entry(light, ANYWHERE_PART * any + (1.0 - ANYWHERE_PART) * own)
            });
            rows.push(row(entries.collect(), cluster));
        }
    }
    let all = listed(source, numbers, -1);
    let all = all.iter().map(|light| Entry {
        light: light.number,
        weight: light.power(),
        visibility: light.visibility,
    });
    rows.push(row(all.collect(), None));
    (rows, slots)
}

/// The lights of a cluster's list, or of all for -1.
fn listed<'a>(
    source: &MapLightSource<'a>,
    numbers: &[Option<u32>],
    cluster: i32,
) -> Vec<Listed<'a>> {
    let lists = source.lists;
    let shares = lists.shares(cluster);
    let light = |(i, &entry): (usize, &u32)| {
        let share = shares.get(i).copied().unwrap_or(LightShare::UNKNOWN);
        Some(match lists.light(entry) {
            LightRef::Triangle(index) => {
                let light = source.triangles.get(index as usize)?;
                Listed {
                    number: numbers.get(index as usize).copied().flatten()?,
                    bounds: triangle_bounds(&triangle_light(light, 0.0, Vec3::ZERO)),
                    triangle: Some(light),
                    visibility: share.visible,
                }
            }
            LightRef::Point(index) => Listed {
                number: number(c::LIGHT_SPHERE, index as usize),
                bounds: sphere_bounds(&point_light(source.points.get(index as usize)?, 0.0)),
                triangle: None,
                visibility: share.visible,
            },
        })
    };
    let entries = lists.row(cluster).iter().enumerate();
    entries.filter_map(light).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::light::EmissionSource;

    fn lamp(at: Vec3, towards: Vec3, radiance: f32) -> TriangleLight {
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

    fn listed(light: &TriangleLight) -> Listed<'_> {
        Listed {
            number: 0,
            bounds: triangle_bounds(&triangle_light(light, 0.0, Vec3::ZERO)),
            triangle: Some(light),
            visibility: 1.0,
        }
    }

    #[test]
    fn chances_are_by_what_surfaces_that_face_one_way_get() {
        // two like lamps, one before a wall and one behind it, and a weak one that alone lights a place far off
        let wall = [Vec3::ZERO, Vec3::new(10.0, 0.0, 0.0)];
        let far = Vec3::X * 4000.0;
        let before = lamp(Vec3::Y * 100.0, -Vec3::Y, 1.0);
        let behind = lamp(Vec3::Y * -100.0, Vec3::Y, 1.0);
        let weak = lamp(far + Vec3::Y * 50.0, -Vec3::Y, 0.001);
        let lights = [&before, &behind, &weak].map(listed);
        let lights: Vec<&Listed<'_>> = lights.iter().collect();
        let on = |p: &Vec3| Place::on_surface(*p, Vec3::Y);
        let places: Vec<Place> = wall.iter().map(on).collect();
        let chances = shares(&lights, &places, 1.0);
        assert!((chances.iter().sum::<f32>() - 1.0).abs() < 1.0e-4);
        assert!(chances[0] > 0.99, "{chances:?}");
        // a dark place has its part, however dark it is
        let places: Vec<Place> = wall.iter().chain([&far]).map(on).collect();
        let chances = shares(&lights, &places, 1.0);
        assert!(chances[2] > 0.1, "{chances:?}");
        // facing any way, both lamps are alike
        let cell = Cell {
            cluster: 0,
            mins: Vec3::splat(-1.0),
            maxs: Vec3::splat(1.0),
        };
        let chances = shares(&lights, &Place::throughout(&cell), 1.0);
        assert!((chances[0] / chances[1] - 1.0).abs() < 0.1, "{chances:?}");
    }

    #[test]
    fn what_is_left_out_gives_nothing() {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32 * 2.0 - 1.0
        };
        let mut vector = || Vec3::new(random(), random(), random());
        let cell = Cell {
            cluster: 0,
            mins: Vec3::splat(-20.0),
            maxs: Vec3::splat(20.0),
        };
        let mut left_out = 0;
        for _ in 0..2000 {
            let light = lamp(vector() * 300.0, vector(), 1.0);
            let listed = listed(&light);
            for facing in 0..FACINGS {
                if !listed.is_below(&cell, facing) {
                    continue;
                }
                left_out += 1;
                for _ in 0..20 {
                    let mut normal = vector() * (1.0 - direction(facing).abs());
                    normal += direction(facing) * normal.abs().max_element();
                    let point = vector() * 20.0;
                    let heights = light.vertices.map(|p| (p - point).dot(normal));
                    assert!(heights.iter().all(|h| *h <= 0.0), "{normal} {point}");
                }
            }
            // what lies before the cell is kept
            let axis = light.vertices[0].abs().max_element();
            let before = (0..FACINGS).find(|&f| light.vertices[0].dot(direction(f)) == axis);
            assert!(before.is_some_and(|f| !listed.is_below(&cell, f)));
        }
        assert!(left_out > 300, "{left_out}");
    }
}
