//! Normal bins of each cell, with sample points on the surfaces of each bin.

use glam::Vec3;
use q3bsp::{Bsp, Surface, SurfaceKind, surface_flags};
use shaders::trace_types::constants as c;
use support::Aabb;

use super::light_cells::Cell;

/// Normal bins: one for each signed axis.
pub const NORMAL_BINS: usize = c::NORMAL_BINS as usize;

/// Margin of a cell for sample points, units: a shaded point uses the cell one unit in front of it.
pub const BESIDE: f32 = 1.5;

/// Points on surfaces of a cell, with unit normals, for each normal bin; empty for a bin without surfaces.
pub type NormalBins = [Vec<(Vec3, Vec3)>; NORMAL_BINS];

/// Maximum number of points for each normal bin of a cell.
pub const POINTS: usize = 8;

/// The axis of a normal bin.
pub fn direction(bin: usize) -> Vec3 {
    let axis = Vec3::AXES.get(bin / 2).copied().unwrap_or(Vec3::X);
    if bin.is_multiple_of(2) { axis } else { -axis }
}

/// A normal's component of at least this part of its largest counts as largest: shaders read rounded normals, and a
/// slope of 45 degrees belongs to two bins.
const TIE: f32 = 0.99;

/// Whether shaders may assign a normal to a bin.
fn faces(normal: Vec3, bin: usize) -> bool {
    normal.dot(direction(bin)) >= TIE * normal.abs().max_element()
}

/// A triangle of a surface.
struct Piece {
    corners: [Vec3; 3],
    normal: Vec3,
}

impl Piece {
    /// A triangle from positions and normals; `None` without area.
    fn new(corners: [(Vec3, Vec3); 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|(p, _)| p);
        // fronts are clockwise
        let front = (c - a).cross(b - a).try_normalize()?;
        let normal: Vec3 = corners.iter().map(|(_, n)| *n).sum();
        Some(Self {
            corners: [a, b, c],
            normal: normal.normalize_or(front),
        })
    }

    /// The part of it inside a box, as corners of a polygon (Sutherland and Hodgman, Reentrant Polygon Clipping, 1974).
    fn within(&self, bounds: Aabb) -> Vec<Vec3> {
        let mut polygon = self.corners.to_vec();
        let planes = Vec3::AXES.map(|axis| {
            [
                (axis, axis.dot(bounds.mins)),
                (-axis, -axis.dot(bounds.maxs)),
            ]
        });
        for (normal, dist) in planes.into_iter().flatten() {
            let height = |p: Vec3| p.dot(normal) - dist;
            let next = polygon.iter().cycle().skip(1);
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (&a, &b) in polygon.iter().zip(next) {
                let (x, y) = (height(a), height(b));
                if x >= 0.0 {
                    kept.push(a);
                }
                if (x >= 0.0) != (y >= 0.0) {
                    kept.push(a + (b - a) * (x / (x - y)));
                }
            }
            polygon = kept;
        }
        polygon
    }
}

/// The triangles of a surface; for a patch those of its control points, which lie near it.
fn pieces(bsp: &Bsp, surface: &Surface) -> Vec<Piece> {
    let vertices = bsp.surface_vertices(surface);
    let corner = |i: usize| Some((vertices.get(i)?.position, vertices.get(i)?.normal));
    let piece = |[a, b, c]: [usize; 3]| Piece::new([corner(a)?, corner(b)?, corner(c)?]);
    match surface.kind {
        SurfaceKind::Planar | SurfaceKind::TriangleSoup => {
            let corners = bsp.surface_triangles(surface);
            let corners = corners.map(|t| t.map(|corner| corner as usize));
            corners.filter_map(piece).collect()
        }
        SurfaceKind::Patch => {
            let width = usize::try_from(surface.patch_width).unwrap_or(0);
            let squares = (0..vertices.len()).filter(|i| width > 0 && i % width + 1 < width);
            let halves = squares.flat_map(|i| {
                let (below, beyond) = (i + width, i + width + 1);
                [[i, below, i + 1], [i + 1, below, beyond]]
            });
            halves.filter_map(piece).collect()
        }
        _ => Vec::new(),
    }
}

/// Triangles of one normal bin, with the running sum of their areas.
#[derive(Default)]
struct Parts {
    triangles: Vec<(f32, [Vec3; 3], Vec3)>,
    area: f32,
}

impl Parts {
    fn add(&mut self, polygon: &[Vec3], normal: Vec3) {
        let Some((&a, others)) = polygon.split_first() else {
            return; // clipped away
        };
        for (&b, &c) in others.iter().zip(others.iter().skip(1)) {
            let area = (b - a).cross(c - a).length() * 0.5;
            if area > 0.0 && area.is_finite() {
                self.area += area;
                self.triangles.push((self.area, [a, b, c], normal));
            }
        }
    }

    /// Points distributed evenly over the area, each one unit in front of its surface.
    fn points(&self) -> Vec<(Vec3, Vec3)> {
        let point = |i: usize| {
            #[allow(clippy::cast_precision_loss)] // a handful
            let (at, turn) = ((i as f32 + 0.5) / POINTS as f32 * self.area, i as f32 + 0.5);
            let found = self.triangles.partition_point(|(end, ..)| *end <= at);
            let (_, [a, b, c], normal) = *self.triangles.get(found).or(self.triangles.last())?;
            // Roberts' additive recurrence in the square, folded to a triangle
            let (u, v) = ((turn * 0.754_877_7).fract(), (turn * 0.569_840_3).fract());
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            Some((a + (b - a) * u + (c - a) * v + normal, normal))
        };
        (0..POINTS).filter_map(point).collect()
    }
}

/// Sample points for each cell on the world's surfaces in it, without skies.
pub fn normal_bins(bsp: &Bsp, cells: &[Cell]) -> Vec<NormalBins> {
    let world = bsp.models.first().map(|model| bsp.model_surfaces(model));
    let drawn: Vec<(Aabb, Vec<Piece>)> = (bsp.surfaces.iter().enumerate())
        .map(|(index, surface)| {
            let sky = bsp.shader(surface.shader).surface_flags & surface_flags::SKY != 0;
            let pieces = if sky || !world.as_ref().is_some_and(|w| w.contains(&index)) {
                Vec::new()
            } else {
                pieces(bsp, surface)
            };
            let corners = pieces.iter().flat_map(|piece| piece.corners);
            (Aabb::of(corners), pieces)
        })
        .collect();
    let listed = bsp.cluster_surfaces();
    let of_cell = |cell: &Cell| {
        let around = cell.bounds.grown(Vec3::splat(BESIDE));
        let mut parts: [Parts; NORMAL_BINS] = Default::default();
        let surfaces = listed.get(cell.cluster).into_iter().flatten();
        let surfaces = surfaces.filter_map(|&s| drawn.get(s.index()));
        for (_, pieces) in surfaces.filter(|(bounds, _)| bounds.touches(around)) {
            for piece in pieces {
                if !Aabb::of(piece.corners).touches(around) {
                    continue;
                }
                let polygon = piece.within(around);
                for (bin, parts) in parts.iter_mut().enumerate() {
                    if faces(piece.normal, bin) {
                        parts.add(&polygon, piece.normal);
                    }
                }
            }
        }
        parts.map(|parts| parts.points())
    };
    cells.iter().map(of_cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use q3bsp::builder::MapBuilder;

    #[test]
    fn a_slope_of_45_degrees_is_in_two_normal_bins() {
        let count = |normal: Vec3| (0..NORMAL_BINS).filter(|&f| faces(normal, f)).count();
        assert!(faces(Vec3::NEG_Y, 3) && count(Vec3::NEG_Y) == 1);
        let slope = Vec3::new(-0.707_2, 0.0, -0.707_0);
        assert!(faces(slope, 1) && faces(slope, 5) && count(slope) == 2);
        assert_eq!(count(Vec3::new(0.6, 0.0, 0.8)), 1);
    }

    #[test]
    fn triangles_are_clipped_to_a_box() {
        let up = |p| (p, Vec3::Z);
        let corners = [Vec3::ZERO, Vec3::Y * 100.0, Vec3::X * 100.0];
        let piece = Piece::new(corners.map(up)).unwrap();
        let mut parts = Parts::default();
        let polygon = piece.within(Aabb::new(Vec3::splat(-1.0), Vec3::new(60.0, 60.0, 1.0)));
        parts.add(&polygon, Vec3::Z);
        // the square without the corner beyond the hypotenuse
        assert!(
            (parts.area - (3600.0 - 200.0)).abs() < 0.1,
            "{}",
            parts.area
        );
        let points = parts.points();
        assert_eq!(points.len(), POINTS);
        for (p, normal) in points {
            assert_eq!((normal, p.z), (Vec3::Z, 1.0));
            assert!(
                p.min_element() >= 0.0 && p.truncate().max_element() <= 60.0,
                "{p}"
            );
            assert!(p.x + p.y <= 100.01, "{p}");
        }
        assert!(
            piece
                .within(Aabb::new(Vec3::splat(2.0), Vec3::splat(60.0)))
                .is_empty()
        );
        assert!(Piece::new([up(Vec3::ZERO); 3]).is_none());
    }

    #[test]
    fn cells_list_the_normal_bins_of_their_surfaces() {
        let mut map = MapBuilder::new();
        map.add_cell(Vec3::ZERO, Vec3::splat(100.0));
        let stone = map.add_shader("stone", 0, 0);
        let corners = [Vec3::ZERO, Vec3::Y, Vec3::ONE - Vec3::Z, Vec3::X];
        map.add_quad(stone, corners.map(|p| p * 100.0));
        let cell = |low: f32, high: f32| Cell {
            cluster: 0,
            bounds: Aabb::new(Vec3::new(0.0, 0.0, low), Vec3::new(100.0, 100.0, high)),
        };
        let found = normal_bins(&map.build(), &[cell(0.0, 50.0), cell(50.0, 100.0)]);
        let faced = |i: usize| found[i].iter().map(|points| !points.is_empty());
        assert!(faced(0).eq((0..NORMAL_BINS).map(|f| f == 4)), "{found:?}");
        assert!(faced(1).all(|faced| !faced), "{found:?}");
    }
}
