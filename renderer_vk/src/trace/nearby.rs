//! Points by place, for searches of the cheapest one where the cost is at least the distance.

use std::collections::HashMap;

use glam::Vec3;

/// Edge of the grid's cells, units.
const CELL: f32 = 32.0;

/// Numbered points on a grid; each can be taken once.
#[derive(Default)]
pub struct Nearby {
    cells: HashMap<[i32; 3], Vec<usize>>,
    left: usize,
}

/// The cell of a point.
fn cell_of(at: Vec3) -> [i32; 3] {
    #[allow(clippy::cast_possible_truncation)] // saturates, and NaN is 0: the cost decides
    let index = |v: f32| (v / CELL).floor() as i32;
    at.to_array().map(index)
}

/// A point that a search has found.
struct Found {
    cost: f32,
    number: usize,
    cell: [i32; 3],
}

impl Nearby {
    /// Adds a point.
    pub fn add(&mut self, number: usize, at: Vec3) {
        self.cells.entry(cell_of(at)).or_default().push(number);
        self.left += 1;
    }

    /// Takes the point of the least cost, of equal ones that with the least number. `cost`: of a point, at least its
    /// distance from `at`; `None` excludes it.
    pub fn take(&mut self, at: Vec3, cost: impl Fn(usize) -> Option<f32>) -> Option<usize> {
        let found = self.find(at, cost)?;
        let cell = self.cells.get_mut(&found.cell)?;
        cell.retain(|number| *number != found.number);
        self.left -= 1;
        Some(found.number)
    }

    fn find(&self, at: Vec3, cost: impl Fn(usize) -> Option<f32>) -> Option<Found> {
        let mut best: Option<Found> = None;
        let mut visit = |cell: [i32; 3], numbers: &[usize]| {
            for &number in numbers {
                let Some(cost) = cost(number) else {
                    continue;
                };
                let better = best.as_ref().is_none_or(|best| {
                    let order = cost.total_cmp(&best.cost);
                    order.then(number.cmp(&best.number)).is_lt()
                });
                if better {
                    best = Some(Found { cost, number, cell });
                }
            }
            best.as_ref().map(|best| best.cost)
        };
        // Cells at a growing distance. Points beyond ring r are at least r cells away.
        let middle = cell_of(at);
        let (mut ring, mut visited) = (0, 0);
        while visited < self.left {
            let mut least = None;
            for cell in ring_around(middle, ring) {
                visited += 1;
                if let Some(numbers) = self.cells.get(&cell) {
                    least = visit(cell, numbers);
                }
            }
            #[allow(clippy::cast_precision_loss)] // a few
            if least.is_some_and(|cost| cost <= ring as f32 * CELL) {
                return best;
            }
            ring += 1;
        }
        // There are fewer points than cells within reach.
        for (cell, numbers) in &self.cells {
            visit(*cell, numbers);
        }
        best
    }
}

/// The cells at a distance of `ring` cells from one, along the axis on which it is greatest.
fn ring_around(middle: [i32; 3], ring: i32) -> impl Iterator<Item = [i32; 3]> {
    let side = -ring..=ring;
    let all = side.clone().flat_map(move |x| {
        let side = side.clone();
        side.clone()
            .flat_map(move |y| side.clone().map(move |z| [x, y, z]))
    });
    all.filter(move |offset| offset.iter().any(|v| v.abs() == ring))
        .map(move |[x, y, z]| {
            let [a, b, c] = middle;
            [
                a.saturating_add(x),
                b.saturating_add(y),
                c.saturating_add(z),
            ]
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use testkit::Random;

    #[test]
    fn the_cheapest_point_is_taken() {
        let mut random = Random::new(1);
        for round in 0..200 {
            let spread = if round % 2 == 0 { 40.0 } else { 2000.0 };
            let points: Vec<(Vec3, f32)> = (0..60)
                .map(|i| {
                    let penalty = if i % 3 == 0 { 100.0 } else { 0.0 };
                    (random.signed_point() * spread, penalty)
                })
                .collect();
            let mut nearby = Nearby::default();
            for (number, (at, _)) in points.iter().enumerate() {
                nearby.add(number, *at);
            }
            let mut left: Vec<usize> = (0..points.len()).collect();
            for _ in 0..70 {
                let at = random.signed_point() * spread;
                let cost = |number: usize| {
                    let (point, penalty) = points[number];
                    (number % 7 != 3).then_some(point.distance(at) + penalty)
                };
                let expected = (left.iter().copied())
                    .filter_map(|number| Some((cost(number)?, number)))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .map(|(_, number)| number);
                assert_eq!(nearby.take(at, cost), expected);
                left.retain(|number| Some(*number) != expected);
            }
        }
    }

    #[test]
    fn points_at_one_place_are_taken_in_order_and_odd_numbers_do_no_harm() {
        let places = [Vec3::ZERO, Vec3::ZERO, Vec3::splat(f32::NAN), Vec3::MAX];
        let mut nearby = Nearby::default();
        for (number, at) in places.iter().enumerate() {
            nearby.add(number, *at);
        }
        let cost = |number: usize| Some(places[number].distance(Vec3::ZERO));
        let taken = [(); 5].map(|()| nearby.take(Vec3::ZERO, cost));
        assert_eq!(&taken[..2], [Some(0), Some(1)]);
        assert_eq!(taken.iter().flatten().count(), 4);
        assert_eq!(nearby.take(Vec3::splat(f32::INFINITY), cost), None);
    }

    #[test]
    fn points_that_rest_are_found_without_a_look_at_all_others() {
        let mut random = Random::new(2);
        let points: Vec<Vec3> = (0..4000).map(|_| random.signed_point() * 1000.0).collect();
        let mut nearby = Nearby::default();
        for (number, at) in points.iter().enumerate() {
            nearby.add(number, *at);
        }
        let looks = Cell::new(0);
        for (number, at) in points.iter().enumerate() {
            let cost = |other: usize| {
                looks.set(looks.get() + 1);
                points.get(other).map(|point| point.distance(*at))
            };
            assert_eq!(nearby.take(*at, cost), Some(number));
        }
        assert!(looks.get() < 3 * points.len(), "{}", looks.get());
    }
}
