//! Candidates for lights from the directions of the light grid.
//!
//! A point of the grid stores the direction of its light. Where one light dominates, that is the direction to it,
//! and the lines from neighbouring points meet at the light (triangulation). Pairs of neighbours vote for the
//! midpoint of the closest approach of their lines if the lines nearly meet and the ratio of their light agrees
//! with the inverse square. Positions with many votes, visible from the voters, become candidates.

use super::light_grid::LitGridPoint;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::{IVec3, Vec3};
use std::collections::{BTreeMap, HashMap};
use support::parallel;

/// Largest distance between the points of a pair, in grid spacings: the cell size of the lookup.
const NEIGHBOURS: f32 = 2.0;

/// Smallest sine of the angle between two lines.
const MIN_SINE: f32 = 0.08;

/// Largest distance between two lines: absolute, id units, and relative to the longer one. Directions are stored in
/// bytes.
const MISS: (f32, f32) = (6.0, 0.03);

/// Shortest and longest distance to a light, id units.
const RAY_LENGTH: (f32, f32) = (16.0, 1024.0);

/// Largest ratio of the intensities that two points imply.
const MAX_INTENSITY_RATIO: f32 = 1.6;

/// Side of the cells in which votes are counted, id units.
const CELL: f32 = 24.0;

/// Smallest number of votes of a candidate.
const VOTES: usize = 4;

/// Votes that are tested for visibility.
const SAMPLED_VOTES: usize = 16;

/// Largest ratio of the upper to the lower quartile of the implied intensities. Distant light is equal at all
/// points, so the implied intensities differ.
const MAX_INTENSITY_SPREAD: f32 = 1.5;

/// A position at which lines meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub origin: Vec3,
    /// Median of the radiant intensities that the points imply.
    pub intensity: Vec3,
}

/// A vote: position, weight, the two points. Near points weigh more, because other lights matter less there.
type Vote = (Vec3, f32, [u32; 2]);

/// Weighted mean of the votes' positions.
fn middle(votes: &[Vote]) -> Vec3 {
    let weight: f32 = votes.iter().map(|v| v.1).sum();
    votes.iter().map(|v| v.0 * v.1).sum::<Vec3>() / weight.max(f32::MIN_POSITIVE)
}

/// The positions with the most votes, best first, at most `most`.
pub(super) fn find(
    world: &RelitWorld,
    points: &[LitGridPoint],
    occluders: &Occluders,
    most: usize,
) -> Vec<Crossing> {
    let spacing = world.bsp.light_grid().map_or(Vec3::ONE, |l| l.size);
    triangulate(points, spacing, occluders, most)
}

/// [`find`] for points of a grid of the given spacing, id units.
fn triangulate(
    points: &[LitGridPoint],
    spacing: Vec3,
    occluders: &Occluders,
    most: usize,
) -> Vec<Crossing> {
    let lookup = (spacing.min_element() * NEIGHBOURS).max(spacing.max_element());
    let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
    let cell_of = |at: Vec3, side: f32| (at / side).floor().as_ivec3();
    for (i, point) in (0u32..).zip(points) {
        cells
            .entry(cell_of(point.position, lookup))
            .or_default()
            .push(i);
    }
    let votes = parallel::map(points, |i, point| {
        let middle = cell_of(point.position, lookup);
        let side = -1..=1;
        let mut votes: Vec<Vote> = Vec::new();
        for z in side.clone() {
            for y in side.clone() {
                for x in side.clone() {
                    let Some(near) = cells.get(&(middle + IVec3::new(x, y, z))) else {
                        // No point lies in this cell.
                        continue;
                    };
                    let later = near.iter().filter(|&&j| j as usize > i);
                    votes.extend(later.filter_map(|&j| {
                        let (meeting, weight) = meeting_point(point, points.get(j as usize)?)?;
                        Some((meeting, weight, [i as u32, j]))
                    }));
                }
            }
        }
        votes
    });
    // A sorted map makes the result independent of the order of threads.
    let mut counted: BTreeMap<[i32; 3], Vec<Vote>> = BTreeMap::new();
    for vote in votes.into_iter().flatten() {
        let cell = cell_of(vote.0, CELL).to_array();
        counted.entry(cell).or_default().push(vote);
    }
    // The votes of one light may fall into several cells: neighbours count.
    let around = |[x, y, z]: [i32; 3]| {
        (0..27).map(move |k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1])
    };
    let mut cells: Vec<(usize, [i32; 3])> = counted
        .iter()
        .map(|(&cell, votes)| (votes.len(), cell))
        .filter(|(votes, _)| *votes >= VOTES)
        .collect();
    cells.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut found: Vec<Crossing> = Vec::new();
    for (_, cell) in cells {
        if found.len() >= most {
            break;
        }
        let start = middle(counted.get(&cell).map_or(&[][..], Vec::as_slice));
        let near: Vec<Vote> = around(cell)
            .filter_map(|c| counted.get(&c))
            .flatten()
            .filter(|v| v.0.distance(start) <= CELL)
            .copied()
            .collect();
        let origin = middle(&near);
        if found.iter().any(|f| f.origin.distance(origin) < CELL) {
            continue;
        }
        let sampled_votes = near.len().min(SAMPLED_VOTES);
        let some =
            (0..sampled_votes).filter_map(|k| near.get(k * near.len() / sampled_votes.max(1)));
        let visible = some
            .filter(|(_, _, pair)| {
                pair.iter().all(|&i| {
                    let point = points.get(i as usize);
                    point.is_some_and(|p| !occluders.blocked(p.position, origin, false))
                })
            })
            .count();
        if visible * 2 < sampled_votes || sampled_votes == 0 {
            continue;
        }
        let mut estimates: Vec<Vec3> = near
            .iter()
            .filter_map(|(_, _, [i, _])| points.get(*i as usize))
            .map(|p| intensity(p, origin))
            .collect();
        estimates.sort_by(|a, b| a.element_sum().total_cmp(&b.element_sum()));
        let quarter = |k: usize| {
            estimates
                .get(estimates.len() * k / 4)
                .map_or(0.0, |t| t.element_sum())
        };
        if quarter(3) > quarter(1) * MAX_INTENSITY_SPREAD {
            continue;
        }
        found.push(Crossing {
            origin,
            intensity: estimates
                .get(estimates.len() / 2)
                .copied()
                .unwrap_or(Vec3::ZERO),
        });
    }
    found
}

/// Radiant intensity that a point implies for an inverse-square light at a position.
fn intensity(point: &LitGridPoint, origin: Vec3) -> Vec3 {
    point.light * (std::f32::consts::PI * point.position.distance_squared(origin))
}

/// Midpoint of the closest approach of two points' lines, if one light explains both, and its weight.
fn meeting_point(a: &LitGridPoint, b: &LitGridPoint) -> Option<(Vec3, f32)> {
    let offset = b.position - a.position;
    let cosine = a.direction.dot(b.direction);
    let squared = 1.0 - cosine * cosine;
    if squared < MIN_SINE * MIN_SINE {
        return None;
    }
    let (along_a, along_b) = (offset.dot(a.direction), offset.dot(b.direction));
    let far_a = (along_a - along_b * cosine) / squared;
    let far_b = (along_a * cosine - along_b) / squared;
    let within = |t: f32| t > RAY_LENGTH.0 && t < RAY_LENGTH.1;
    if !within(far_a) || !within(far_b) {
        return None;
    }
    let (at_a, at_b) = (
        a.position + a.direction * far_a,
        b.position + b.direction * far_b,
    );
    if at_a.distance(at_b) > MISS.0 + MISS.1 * far_a.max(far_b) {
        return None;
    }
    let middle = (at_a + at_b) * 0.5;
    let (intensity_a, intensity_b) = (intensity(a, middle), intensity(b, middle));
    let alike = |x: f32, y: f32| x <= y * MAX_INTENSITY_RATIO && y <= x * MAX_INTENSITY_RATIO;
    alike(intensity_a.element_sum(), intensity_b.element_sum())
        .then_some((middle, (far_a * far_b).recip()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    /// Points of a grid in the open, lit by point lights and a sun.
    fn points(lights: &[(Vec3, f32)], sun: f32) -> Vec<LitGridPoint> {
        let mut points = Vec::new();
        for k in 0..10 * 10 * 4 {
            let cell = Vec3::new((k % 10) as f32, (k / 10 % 10) as f32, (k / 100) as f32);
            let position = cell * Vec3::new(64.0, 64.0, 128.0);
            let mut parts = vec![(Vec3::new(0.6, 0.0, 0.8), sun)];
            for (origin, intensity) in lights {
                let offset = *origin - position;
                let light = intensity / offset.length_squared() / PI;
                parts.push((offset.normalize(), light));
            }
            let sum: Vec3 = parts
                .iter()
                .map(|(direction_to, light)| *direction_to * *light)
                .sum();
            // Directions are stored as two bytes.
            let turn = std::f32::consts::TAU / 256.0;
            let byte = |angle: f32| (angle / turn).round() * turn;
            let direction_to = sum.normalize_or(Vec3::Z);
            let (down, round) = (
                byte(direction_to.z.acos()),
                byte(direction_to.y.atan2(direction_to.x)),
            );
            let (out, up) = down.sin_cos();
            let direction = Vec3::new(round.cos() * out, round.sin() * out, up);
            let directed: f32 = parts
                .iter()
                .map(|(direction_to, light)| light * direction_to.dot(direction).max(0.0))
                .sum();
            points.push(LitGridPoint {
                position,
                cluster: 0,
                direction,
                light: Vec3::splat(directed),
                shown: Vec3::splat(directed.min(1.0)),
                saturated: false,
            });
        }
        points
    }

    fn found(points: &[LitGridPoint]) -> Vec<Crossing> {
        let nothing = Occluders::new(std::iter::empty());
        triangulate(points, Vec3::new(64.0, 64.0, 128.0), &nothing, 100)
    }

    #[test]
    fn lights_are_found_where_lines_meet() {
        let lights = [
            (Vec3::new(101.0, 83.0, 209.0), 40_000.0),
            (Vec3::new(470.0, 493.0, 77.0), 60_000.0),
        ];
        let found = found(&points(&lights, 0.0));
        for (origin, intensity) in lights {
            let near = found.iter().find(|c| c.origin.distance(origin) < 12.0);
            let near = near.unwrap_or_else(|| panic!("{origin}: {found:?}"));
            assert!((near.intensity.x / intensity - 1.0).abs() < 0.1, "{near:?}");
        }
    }

    #[test]
    fn a_sun_gives_no_candidates() {
        assert_eq!(found(&points(&[], 1.0)), []);
    }
}
