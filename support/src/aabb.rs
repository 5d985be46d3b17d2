//! Axis-aligned boxes.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// An axis-aligned box, as shaders read it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Aabb {
    /// Smallest corner.
    pub mins: Vec3,
    /// Largest corner.
    pub maxs: Vec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// Contains no point; the union with it changes nothing.
    pub const EMPTY: Self = Self::new(Vec3::INFINITY, Vec3::NEG_INFINITY);

    /// The box between two corners.
    pub const fn new(mins: Vec3, maxs: Vec3) -> Self {
        Self { mins, maxs }
    }

    /// The smallest box that contains all points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// With a point added.
    #[must_use]
    pub fn with(self, point: Vec3) -> Self {
        Self::new(self.mins.min(point), self.maxs.max(point))
    }

    /// The smallest box that contains both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self::new(self.mins.min(other.mins), self.maxs.max(other.maxs))
    }

    /// With each face moved outwards by the margin of its axis.
    #[must_use]
    pub fn grown(self, margin: Vec3) -> Self {
        Self::new(self.mins - margin, self.maxs + margin)
    }

    /// Whether it contains no point: on an axis the smallest coordinate is larger than the largest, or one is NaN.
    pub fn is_empty(self) -> bool {
        !self.mins.cmple(self.maxs).all()
    }

    /// Whether both corners are finite.
    pub fn is_finite(self) -> bool {
        self.mins.is_finite() && self.maxs.is_finite()
    }

    /// Whether both share a point, be it on a face.
    pub fn touches(self, other: Self) -> bool {
        self.mins.cmple(other.maxs).all() && self.maxs.cmpge(other.mins).all()
    }

    /// Size on each axis; negative for an empty box.
    pub fn size(self) -> Vec3 {
        self.maxs - self.mins
    }

    /// Centre.
    pub fn centre(self) -> Vec3 {
        (self.mins + self.maxs) * 0.5
    }

    /// Half of the surface area; 0 for an empty box.
    pub fn half_area(self) -> f32 {
        let size = self.size().max(Vec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// The eight corners; bits 0 to 2 of an index select the largest x, y and z.
    pub fn corners(self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |axis: usize| {
                if i >> axis & 1 == 0 {
                    self.mins
                } else {
                    self.maxs
                }
            };
            Vec3::new(pick(0).x, pick(1).y, pick(2).z)
        })
    }

    /// The corner that is farthest in a direction.
    pub fn farthest(self, direction: Vec3) -> Vec3 {
        Vec3::select(direction.cmpge(Vec3::ZERO), self.maxs, self.mins)
    }

    /// The corner that is least far in a direction.
    pub fn nearest(self, direction: Vec3) -> Vec3 {
        Vec3::select(direction.cmpge(Vec3::ZERO), self.mins, self.maxs)
    }

    /// Square of the distance from a point to the box; infinite for an empty box.
    pub fn distance_squared(self, point: Vec3) -> f32 {
        (self.mins - point)
            .max(point - self.maxs)
            .max(Vec3::ZERO)
            .length_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Boxes around 1 to 4 points with integer coordinates from -4 to 4, so that faces coincide often, and the points.
    fn boxes() -> impl Iterator<Item = (Aabb, Vec<Vec3>)> {
        let mut random = Random::new(1);
        std::iter::repeat_with(move || {
            let points: Vec<Vec3> = (0..1 + random.below(4))
                .map(|_| (random.signed_point() * 4.5).round())
                .collect();
            (Aabb::of(points.iter().copied()), points)
        })
        .take(2000)
    }

    fn contains(b: Aabb, point: Vec3) -> bool {
        b.mins.cmple(point).all() && b.maxs.cmpge(point).all()
    }

    /// All points with integer coordinates from -5 to 5.
    fn lattice() -> impl Iterator<Item = Vec3> {
        let at = |i: i32| (i - 5) as f32;
        (0..11 * 11 * 11).map(move |i| Vec3::new(at(i % 11), at(i / 11 % 11), at(i / 121)))
    }

    #[test]
    fn a_box_is_the_smallest_around_its_points() {
        for (b, points) in boxes() {
            assert!(points.iter().all(|&p| contains(b, p)));
            for axis in 0..3 {
                assert!(points.iter().any(|p| p[axis] == b.mins[axis]));
                assert!(points.iter().any(|p| p[axis] == b.maxs[axis]));
            }
            assert_eq!(b.union(Aabb::EMPTY), b);
            assert_eq!(Aabb::EMPTY.union(b), b);
        }
    }

    #[test]
    fn union_and_touching_agree_with_points() {
        let all: Vec<Aabb> = boxes().map(|(b, _)| b).collect();
        for pair in all.chunks_exact(2).take(300) {
            let [a, b] = [pair[0], pair[1]];
            let both = a.union(b);
            assert!(a.corners().iter().all(|&p| contains(both, p)));
            assert!(b.corners().iter().all(|&p| contains(both, p)));
            assert_eq!(both, Aabb::of(a.corners().into_iter().chain(b.corners())));
            // boxes with integer corners that share a point share one with integer coordinates
            let shared = lattice().any(|p| contains(a, p) && contains(b, p));
            assert_eq!(a.touches(b), shared, "{a:?} {b:?}");
            assert_eq!(b.touches(a), shared);
        }
    }

    #[test]
    fn extremes_are_those_of_the_corners() {
        let mut random = Random::new(2);
        for (b, _) in boxes() {
            let direction = random.signed_point();
            let along = b.corners().map(|c| c.dot(direction));
            let most = along.into_iter().fold(f32::NEG_INFINITY, f32::max);
            let least = along.into_iter().fold(f32::INFINITY, f32::min);
            assert_eq!(b.farthest(direction).dot(direction), most);
            assert_eq!(b.nearest(direction).dot(direction), least);
            assert_eq!(Aabb::of(b.corners()), b);
        }
    }

    #[test]
    fn distance_is_that_of_the_nearest_point() {
        let mut random = Random::new(3);
        for (b, _) in boxes() {
            let point = random.signed_point() * 9.0;
            let nearest = point.clamp(b.mins, b.maxs);
            let expected = nearest.distance_squared(point);
            assert!((b.distance_squared(point) - expected).abs() <= 1e-4 * expected);
            assert_eq!(b.distance_squared(b.centre()), 0.0);
        }
        assert_eq!(Aabb::EMPTY.distance_squared(Vec3::ZERO), f32::INFINITY);
    }

    #[test]
    fn sizes_of_known_boxes() {
        let b = Aabb::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 4.0, 6.0));
        assert_eq!(b.half_area(), 2.0 + 6.0 + 3.0);
        assert_eq!(b.size(), Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(b.centre(), Vec3::new(1.5, 3.0, 4.5));
        assert_eq!(b.grown(Vec3::ONE).size(), b.size() + 2.0);
        assert!(!b.is_empty() && b.is_finite());
        assert!(!Aabb::new(Vec3::ONE, Vec3::ONE).is_empty());
        assert!(Aabb::EMPTY.is_empty() && !Aabb::EMPTY.is_finite());
        assert!(Aabb::new(Vec3::NAN, Vec3::ONE).is_empty());
        assert_eq!(Aabb::EMPTY.half_area(), 0.0);
        assert_eq!(Aabb::of([]), Aabb::EMPTY);
    }
}
