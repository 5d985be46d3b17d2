//! Which part of a lightmap texel lies on which triangle.

use crate::world::WorldVertex;
use glam::{IVec2, Vec2, Vec3};
use support::slice;

/// Side of the pattern in which a texel is searched for any place on a triangle.
pub const FINEST: u32 = 8;

/// Distance beyond an edge that still counts as on the triangle, texels: charts of compilers put vertices on the centres
/// of texels.
const EDGE: f32 = 1.0e-3;

/// Most texels that one triangle is searched for along an axis: coordinates of damaged maps.
const MOST: i32 = 1 << 14;

/// Least distance of a place from the border of its surface, id units: on the border it would lie in the plane of an adjacent
/// wall, which then shadows nothing.
pub const INSET: f32 = 0.5;

/// A triangle in its page.
#[derive(Debug, Clone, Copy)]
pub struct PageTriangle {
    /// Its vertices.
    vertices: [WorldVertex; 3],
    /// For the edge from each vertex to the next: unit vector into the triangle, if the surface ends there.
    inward: [Option<Vec3>; 3],
    /// First corner, in texels.
    origin: Vec2,
    /// Edges from it, in texels.
    edges: [Vec2; 2],
    /// Twice its area in texels.
    determinant: f32,
}

impl PageTriangle {
    /// A triangle in a page of so many texels a side; `None` if its coordinates are not finite or it has no area there.
    /// `ends`: whether the surface ends at the edge from each vertex to the next.
    pub fn new(vertices: [WorldVertex; 3], ends: [bool; 3], side: usize) -> Option<PageTriangle> {
        let [p, q, r] = vertices.map(|v| v.position);
        let normal = (q - p).cross(r - p);
        let inward = [(p, q), (q, r), (r, p)].map(|(a, b)| normal.cross(b - a).normalize_or_zero());
        let inward = [0, 1, 2].map(|k| ends[k].then_some(inward[k]));
        let [a, b, c] = vertices.map(|v| v.lightmap * side as f32);
        let edges = [b - a, c - a];
        let determinant = edges[0].perp_dot(edges[1]);
        let finite = a.is_finite() && b.is_finite() && c.is_finite();
        (finite && determinant.abs() > 1.0e-6).then_some(PageTriangle {
            vertices,
            inward,
            origin: a,
            edges,
            determinant,
        })
    }

    /// Corners in texels.
    pub fn corners(&self) -> [Vec2; 3] {
        let [e1, e2] = self.edges;
        [self.origin, self.origin + e1, self.origin + e2]
    }

    /// The texels that it may touch in a page: first and one past the last.
    pub fn bounds(&self, side: usize) -> (IVec2, IVec2) {
        let [a, b, c] = self.corners();
        let side = Vec2::splat((side as i32).min(MOST) as f32);
        let least = (a.min(b).min(c) - EDGE).floor();
        let most = (a.max(b).max(c) + EDGE).floor() + 1.0;
        let bound = |at: Vec2| at.clamp(Vec2::ZERO, side).as_ivec2();
        (bound(least), bound(most))
    }

    /// Barycentric coordinates of the second and third corner at a place in texels, if the triangle covers it.
    fn weights(&self, at: Vec2) -> Option<Vec2> {
        let [e1, e2] = self.edges;
        let offset = at - self.origin;
        let weights = Vec2::new(offset.perp_dot(e2), e1.perp_dot(offset)) / self.determinant;
        let longest = e1.length().max(e2.length()).max(1.0);
        let slack = EDGE * longest / self.determinant.abs();
        let inside = weights.min_element() >= -slack && weights.element_sum() <= 1.0 + slack;
        inside.then_some(weights)
    }

    /// Position and unit normal at a place in texels, if the triangle covers it.
    pub fn at(&self, at: Vec2) -> Option<(Vec3, Vec3)> {
        let w = self.weights(at)?;
        let [a, b, c] = self.vertices;
        let position =
            a.position + (b.position - a.position) * w.x + (c.position - a.position) * w.y;
        let normal = a.normal + (b.normal - a.normal) * w.x + (c.normal - a.normal) * w.y;
        Some((self.inset(position), normal.normalize_or(a.normal)))
    }

    /// A position moved away from the border of the surface.
    fn inset(&self, mut position: Vec3) -> Vec3 {
        for (vertex, inward) in self.vertices.iter().zip(self.inward) {
            if let Some(inward) = inward {
                let distance = (position - vertex.position).dot(inward);
                position += inward * (INSET - distance).max(0.0);
            }
        }
        position
    }

    /// A texel of the triangle's plane, whether the triangle covers it or not.
    fn square(&self, texel: Vec2) -> Square {
        let [e1, e2] = self.edges;
        let [a, b, c] = self.vertices.map(|v| v.position);
        let on_plane = |offset: Vec2| {
            let weights = Vec2::new(offset.perp_dot(e2), e1.perp_dot(offset)) / self.determinant;
            (b - a) * weights.x + (c - a) * weights.y
        };
        Square {
            middle: a + on_plane(texel + 0.5 - self.origin),
            half: [Vec2::X, Vec2::Y].map(|side| on_plane(side * 0.5)),
        }
    }

    /// Its middle.
    pub fn middle(&self) -> Vec3 {
        let [a, b, c] = self.vertices.map(|v| v.position);
        (a + b + c) / 3.0
    }
}

/// A place on a triangle in a texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Index of the texel in its page, row by row.
    pub texel: u32,
    /// Surface.
    pub surface: u32,
    /// Position on the surface, model space.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Middle of the triangle that it is on.
    pub middle: Vec3,
    /// Its texel in the plane of the triangle.
    pub square: Square,
}

/// A texel in the plane of a triangle, model space.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Square {
    /// Its middle, which may lie beyond the triangle.
    pub middle: Vec3,
    /// Half its sides.
    pub half: [Vec3; 2],
}

/// Finds the places in a page's texels, a pattern of `pattern` × `pattern` places each: of a texel that a triangle touches
/// without one of these, the place nearest to the middle.
///
/// `triangles`: (surface, triangle). Places ascend by texel; each is on the first triangle that covers it.
pub fn places(side: usize, pattern: u32, triangles: &[(u32, PageTriangle)]) -> Vec<Place> {
    let pattern = pattern.clamp(1, FINEST);
    let mut taken: Vec<u64> = vec![0; side * side];
    let mut found = Vec::new();
    let scan = |side_of_pattern: u32, alone: bool, taken: &mut [u64], found: &mut Vec<Place>| {
        let order = from_the_middle(side_of_pattern);
        for (surface, triangle) in triangles {
            let (least, most) = triangle.bounds(side);
            for y in least.y..most.y {
                for x in least.x..most.x {
                    let texel = y as usize * side + x as usize;
                    let Some(mask) = taken.get_mut(texel) else {
                        continue;
                    };
                    if alone && *mask != 0 {
                        continue;
                    }
                    for &(bit, offset) in &order {
                        if *mask & bit != 0 {
                            continue;
                        }
                        let at = Vec2::new(x as f32, y as f32) + offset;
                        let Some((position, normal)) = triangle.at(at) else {
                            continue;
                        };
                        *mask |= bit;
                        found.push(Place {
                            texel: texel as u32,
                            surface: *surface,
                            position,
                            normal,
                            middle: triangle.middle(),
                            square: triangle.square(Vec2::new(x as f32, y as f32)),
                        });
                        if alone {
                            break;
                        }
                    }
                }
            }
        }
    };
    scan(pattern, false, &mut taken, &mut found);
    scan(FINEST, true, &mut taken, &mut found);
    found.sort_by_key(|place| place.texel);
    found
}

/// Bits and offsets of a pattern's places in a texel, the nearest to its middle first.
fn from_the_middle(side: u32) -> Vec<(u64, Vec2)> {
    let mut all: Vec<(u64, Vec2)> = (0..side * side)
        .map(|i| {
            let at = Vec2::new((i % side) as f32, (i / side) as f32) + 0.5;
            (1 << (i & 63), at / side as f32)
        })
        .collect();
    let off = |at: Vec2| (at - 0.5).length_squared();
    all.sort_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    all
}

/// Texels that no surface covers and that filtering may read: filled from covered neighbours, ring by ring.
///
/// `owners`: for each texel the surface that covers it, or `u32::MAX`. An uncovered texel gets the owner of its first covered
/// neighbour, and the mean of the neighbours with that owner.
pub fn fill<T: Copy>(
    side: usize,
    rings: usize,
    owners: &mut [u32],
    texels: &mut [T],
    mean: impl Fn(&[T]) -> T,
) {
    const AROUND: [(i32, i32); 8] = [
        (-1, 0),
        (1, 0),
        (0, -1),
        (0, 1),
        (-1, -1),
        (1, -1),
        (-1, 1),
        (1, 1),
    ];
    for _ in 0..rings {
        let before: Vec<u32> = owners.to_vec();
        let mut new = Vec::new();
        for texel in 0..side * side {
            if slice::item(&before, texel) != u32::MAX {
                continue;
            }
            let (x, y) = ((texel % side) as i32, (texel / side) as i32);
            let near = AROUND.iter().filter_map(|(dx, dy)| {
                let (x, y) = (x + dx, y + dy);
                let inside = x >= 0 && y >= 0 && x < side as i32 && y < side as i32;
                let at = inside.then(|| y as usize * side + x as usize)?;
                let owner = *before.get(at)?;
                (owner != u32::MAX).then_some((owner, at))
            });
            let near: Vec<(u32, usize)> = near.collect();
            let Some(&(owner, _)) = near.first() else {
                continue;
            };
            let own = near.iter().filter(|(o, _)| *o == owner);
            let light: Vec<T> = own.filter_map(|&(_, at)| texels.get(at).copied()).collect();
            new.push((texel, owner, mean(&light)));
        }
        if new.is_empty() {
            return;
        }
        for (texel, owner, light) in new {
            if let (Some(slot), Some(own)) = (texels.get_mut(texel), owners.get_mut(texel)) {
                *slot = light;
                *own = owner;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(x: f32, y: f32) -> WorldVertex {
        WorldVertex {
            position: Vec3::new(x, y, 3.0),
            normal: Vec3::Z,
            lightmap: Vec2::new(x, y) / 8.0,
            ..WorldVertex::default()
        }
    }

    fn square(x0: f32, y0: f32, x1: f32, y1: f32) -> [(u32, PageTriangle); 2] {
        let [a, b, c, d] = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| vertex(x, y));
        [[a, b, c], [a, c, d]].map(|t| (7, PageTriangle::new(t, [false; 3], 8).unwrap()))
    }

    #[test]
    fn each_place_is_found_once() {
        // texel centres on the border, as compilers lay charts out
        let found = places(8, 1, &square(1.5, 1.5, 4.5, 3.5));
        let texels: Vec<u32> = found.iter().map(|p| p.texel).collect();
        let expected: Vec<u32> = (1..4)
            .flat_map(|y| (1..5).map(move |x| y * 8 + x))
            .collect();
        assert_eq!(texels, expected);
        for place in &found {
            let middle = Vec2::new((place.texel % 8) as f32, (place.texel / 8) as f32) + 0.5;
            assert!((place.position - middle.extend(3.0)).length() < 2.0e-3);
        }
        assert_eq!(places(8, 4, &square(1.0, 1.0, 3.0, 2.0)).len(), 32);
    }

    #[test]
    fn a_place_has_its_whole_texel() {
        // a strip a tenth of a texel wide, which covers no middle of a texel
        let found = places(8, 1, &square(0.9, 0.1, 5.2, 0.2));
        assert_eq!(found.len(), 6);
        for (place, x) in found.iter().zip(0u8..) {
            let expected = Square {
                middle: Vec3::new(f32::from(x) + 0.5, 0.5, 3.0),
                half: [Vec3::X * 0.5, Vec3::Y * 0.5],
            };
            let found = place.square;
            assert!(found.middle.distance(expected.middle) < 1e-4, "{found:?}");
            for (found, expected) in found.half.iter().zip(expected.half) {
                assert!(found.distance(expected) < 1e-5, "{found}");
            }
        }
    }

    #[test]
    fn a_sliver_has_a_place_in_every_texel_that_it_reaches() {
        let found = places(8, 1, &square(0.9, 0.1, 5.2, 0.3));
        let texels: Vec<u32> = found.iter().map(|p| p.texel).collect();
        assert_eq!(texels, [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn damaged_coordinates_give_nothing() {
        let mut corners = [vertex(0.0, 0.0), vertex(1.0, 0.0), vertex(0.0, 1.0)];
        corners[1].lightmap.x = f32::NAN;
        assert!(PageTriangle::new(corners, [true; 3], 8).is_none());
        corners[1].lightmap.x = 1.0e30;
        let huge = PageTriangle::new(corners, [true; 3], 8).unwrap();
        assert!(places(8, 2, &[(0, huge)]).len() <= 64 * 4);
    }

    #[test]
    fn places_stay_off_the_border_of_a_surface() {
        let corners = [vertex(0.0, 0.0), vertex(8.0, 0.0), vertex(0.0, 8.0)];
        let triangle = PageTriangle::new(corners, [true, false, true], 8).unwrap();
        let (corner, _) = triangle.at(Vec2::ZERO).unwrap();
        assert!(
            (corner - Vec3::new(0.5, 0.5, 3.0)).length() < 1e-5,
            "{corner}"
        );
        // the other triangle of a quad continues there
        let (inner, _) = triangle.at(Vec2::splat(4.0)).unwrap();
        assert!(
            (inner - Vec3::new(4.0, 4.0, 3.0)).length() < 1e-5,
            "{inner}"
        );
    }

    #[test]
    fn filling_keeps_owners_apart() {
        let mut owners = vec![u32::MAX; 16];
        let mut light = vec![0.0f32; 16];
        (owners[4], light[4]) = (1, 10.0);
        (owners[7], light[7]) = (2, 20.0);
        let mean = |own: &[f32]| own.iter().sum::<f32>() / own.len() as f32;
        fill(4, 1, &mut owners, &mut light, mean);
        assert_eq!(
            (light[5], light[6], owners[5], owners[6]),
            (10.0, 20.0, 1, 2)
        );
        assert_eq!(owners[13], u32::MAX);
        fill(4, 9, &mut owners, &mut light, mean);
        assert!(light.iter().all(|l| *l == 10.0 || *l == 20.0));
    }
}
