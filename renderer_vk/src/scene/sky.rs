//! Coverage of a sky: the cells of the box around the camera that its surfaces cover.
//!
//! Source: engine behaviour of `renderer_opengl1`: it projects the surfaces of a sky onto the faces of a cube, and
//! draws on each face the rectangle of 8 × 8 cells that they span.

use glam::{Vec2, Vec3};
use support::slice::part;

/// Number of faces, in the order of the box's images: right, back, left, front, up, down.
pub const FACES: usize = 6;
/// Number of cells along each side of a face.
pub const CELLS: usize = 8;
/// Smallest polygon that counts, as a part of its face.
const SMALLEST_SHARE: f32 = 1e-6;
/// Smallest distance in front of the camera's plane that counts, units.
const NEAREST: f32 = 0.001;

/// The inverse of [`shaderscript::Sky::side_point`]: a direction as `(s, t)` of a face, both times the depth towards
/// it, and that depth.
fn face_point(face: usize, p: Vec3) -> Vec3 {
    match face {
        0 => Vec3::new(-p.y, p.z, p.x),
        1 => Vec3::new(p.x, p.z, p.y),
        2 => Vec3::new(p.y, p.z, -p.x),
        3 => Vec3::new(-p.x, p.z, -p.y),
        4 => Vec3::new(-p.y, -p.x, p.z),
        _ => Vec3::new(-p.y, p.x, -p.z),
    }
}

/// A rectangle of cells of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cells {
    /// First column and row.
    pub from: [usize; 2],
    /// Column and row after the last.
    pub to: [usize; 2],
}

impl Cells {
    /// A whole face.
    #[cfg(test)]
    pub const ALL: Self = Self {
        from: [0; 2],
        to: [CELLS; 2],
    };
}

/// Coverage of the surfaces of a sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyCoverage {
    /// Smallest and largest `(s, t)` on each face; smallest above largest if nothing is covered.
    extent: [(Vec2, Vec2); FACES],
}

/// A visible sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisibleSky {
    /// Index of the material, after remapping.
    pub material: u32,
    /// Fog volume plus one; 0: no fog.
    pub fog: u32,
    /// Covered cells.
    pub coverage: SkyCoverage,
}

impl SkyCoverage {
    /// No coverage.
    pub const EMPTY: Self = Self {
        extent: [(Vec2::INFINITY, Vec2::NEG_INFINITY); FACES],
    };

    /// Full coverage.
    #[cfg(test)]
    pub const FULL: Self = Self {
        extent: [(Vec2::NEG_ONE, Vec2::ONE); FACES],
    };

    /// Adds a triangle relative to the camera.
    pub fn add(&mut self, triangle: [Vec3; 3]) {
        for (face, (low, high)) in self.extent.iter_mut().enumerate() {
            let mut polygon = Polygon::new(triangle.map(|p| face_point(face, p)));
            // clips to the pyramid of the face: |s| <= depth, |t| <= depth
            polygon.clip(|p| p.z - p.x);
            polygon.clip(|p| p.z + p.x);
            polygon.clip(|p| p.z - p.y);
            polygon.clip(|p| p.z + p.y);
            if polygon.covers_nothing() {
                continue;
            }
            for p in polygon.corners().iter().filter(|p| p.z >= NEAREST) {
                let at = p.truncate() / p.z;
                *low = low.min(at);
                *high = high.max(at);
            }
        }
    }

    /// The covered cells of a face; `None` if there are none.
    pub fn cells(&self, face: usize) -> Option<Cells> {
        let (low, high) = self.extent.get(face)?;
        let half = CELLS as f32 / 2.0;
        let cell = |at: f32| (at + half).clamp(0.0, CELLS as f32) as usize;
        let from = [low.x, low.y].map(|v| cell((v * half).floor()));
        let to = [high.x, high.y].map(|v| cell((v * half).ceil()));
        let shows = low.cmple(*high).all() && from[0] < to[0] && from[1] < to[1];
        shows.then_some(Cells { from, to })
    }
}

/// Corners of a clipped triangle: each plane adds at most one.
struct Polygon {
    points: [Vec3; 8],
    count: usize,
}

impl Polygon {
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        let mut points = [Vec3::ZERO; 8];
        for (slot, point) in points.iter_mut().zip([a, b, c]) {
            *slot = point;
        }
        Self { points, count: 3 }
    }

    fn corners(&self) -> &[Vec3] {
        part(&self.points, ..self.count)
    }

    /// Whether its solid angle is zero: the triangle only touches the face with a corner or an edge.
    fn covers_nothing(&self) -> bool {
        let corners = self.corners();
        let next = corners.iter().cycle().skip(1);
        let twice_area: Vec3 = corners.iter().zip(next).map(|(a, b)| a.cross(*b)).sum();
        let Some(first) = corners.first() else {
            return true;
        };
        // volume of its pyramid to the camera, relative to its extent
        let extent = corners.iter().map(|p| p.length()).fold(0.0, f32::max);
        twice_area.dot(*first).abs() <= SMALLEST_SHARE * extent.powi(3)
    }

    /// Clips to the part where `side` is not negative.
    fn clip(&mut self, side: impl Fn(Vec3) -> f32) {
        let old = self.points;
        let corners = part(&old, ..self.count);
        let next = corners.iter().cycle().skip(1);
        let mut count = 0;
        let mut push = |point: Vec3| {
            if let Some(slot) = self.points.get_mut(count) {
                *slot = point;
                count += 1;
            }
        };
        for (&a, &b) in corners.iter().zip(next) {
            let (da, db) = (side(a), side(b));
            if da >= 0.0 {
                push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                push(a + (b - a) * (da / (da - db)));
            }
        }
        self.count = count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shaderscript::Sky;

    #[test]
    fn faces_lie_on_the_cube_and_go_back() {
        for face in 0..FACES {
            let p = Sky::side_point(face, 0.25, -0.5);
            assert_eq!(p.abs().max_element(), 1.0, "face {face}: {p}");
            assert_eq!(face_point(face, p), Vec3::new(0.25, -0.5, 1.0));
        }
    }

    #[test]
    fn a_ceiling_covers_the_top_alone() {
        let mut coverage = SkyCoverage::EMPTY;
        // x from -10 to 20 and y from -5 to 5, 100 above the camera: t = -x / z, s = -y / z
        let at = |x: f32, y: f32| Vec3::new(x, y, 100.0);
        coverage.add([at(-10.0, -5.0), at(20.0, -5.0), at(20.0, 5.0)]);
        let top = coverage.cells(4).unwrap();
        assert_eq!((top.from, top.to), ([3, 3], [5, 5]));
        for face in [0, 1, 2, 3, 5] {
            assert_eq!(coverage.cells(face), None, "face {face}");
        }
    }

    #[test]
    fn a_large_ceiling_reaches_down_the_sides() {
        let mut coverage = SkyCoverage::EMPTY;
        let at = |x: f32, y: f32| Vec3::new(x, y, 100.0);
        let far = 400.0;
        coverage.add([at(-far, -far), at(far, -far), at(far, far)]);
        coverage.add([at(-far, -far), at(far, far), at(-far, far)]);
        assert_eq!(coverage.cells(4), Some(Cells::ALL));
        for face in 0..4 {
            // 100 up at distance 400 is a quarter of half the face: row 5 of 8
            let side = coverage.cells(face).unwrap();
            assert_eq!((side.from, side.to), ([0, 5], [8, 8]), "face {face}");
        }
        assert_eq!(coverage.cells(5), None);
    }

    #[test]
    fn what_touches_a_face_with_an_edge_covers_nothing_of_it() {
        // two walls of a cube around the camera each touch the ceiling with an edge, whose box is the whole ceiling
        let mut coverage = SkyCoverage::EMPTY;
        for face in [0, 1] {
            let at = |s: f32, t: f32| Sky::side_point(face, s, t) * 256.0;
            coverage.add([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0)]);
            coverage.add([at(-1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]);
        }
        for face in 0..FACES {
            let expected = (face < 2).then_some(Cells::ALL);
            assert_eq!(coverage.cells(face), expected, "face {face}");
        }
    }

    #[test]
    fn behind_and_broken_triangles_cover_little() {
        let mut coverage = SkyCoverage::EMPTY;
        coverage.add([Vec3::ZERO; 3]);
        coverage.add([Vec3::NAN; 3]);
        for face in 0..FACES {
            assert_eq!(coverage.cells(face), None);
        }
        assert_eq!(SkyCoverage::FULL.cells(3), Some(Cells::ALL));
    }
}
