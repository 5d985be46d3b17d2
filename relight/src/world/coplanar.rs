//! Coplanar rank: the order of surfaces that share a plane with others (posters on walls, decals, paint). The
//! engine draws them in its own order (polygon offset, then sort value, then material); ray tracing and depth
//! buffers of other programs have none.

use super::{RelitWorld, WorldSurface};
use crate::materials::light::SurfaceClass;
use glam::{Vec2, Vec3};
use shaderscript::Cull;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use support::slice::{self, item};

/// Largest distance of coplanar surfaces, id units. Compilers compute both surfaces' corners from the same plane in
/// single precision; surfaces that mappers place before a wall are 1/16 or more away.
pub const APART: f32 = 0.01;
/// Overlap up to which triangles count as side by side, id units.
const TOUCHING: f32 = 0.01;
/// Cell size and tolerance of the plane lookup: normals, and distances from the origin, id units.
const NORMAL_CELL: (f32, f32) = (1.0 / 16.0, 1.0 / 256.0);
const DISTANCE_CELL: (f32, f32) = (4.0, 0.25);
/// Largest number of triangle pairs that are compared: damaged maps place all triangles in one spot.
const MOST_PAIRS: usize = 1 << 26;

/// The engine's drawing order in a plane; greater is drawn later, above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawOrder {
    /// The material has `polygonOffset`: it is moved towards the camera.
    pub offset: bool,
    /// Its sort value.
    pub sort: f32,
    /// Place of the material among those of one sort value.
    pub material: u32,
}

impl DrawOrder {
    fn compare(&self, other: &DrawOrder) -> Ordering {
        (self.offset.cmp(&other.offset))
            .then(self.sort.total_cmp(&other.sort))
            .then(self.material.cmp(&other.material))
    }
}

/// A surface that may lie on others.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Brush model; only surfaces of one model are compared.
    pub model: u32,
    /// Which of its faces are drawn.
    pub cull: Cull,
    /// When it is drawn.
    pub order: DrawOrder,
    /// Its triangles, clockwise seen from the front; none: it lies on nothing.
    pub triangles: Vec<[Vec3; 3]>,
}

/// Position of a surface among those that share its plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stacked {
    /// Rank: surfaces below it, one on the other. 0: it lies on nothing.
    pub below: u32,
    /// Surfaces above it, one on the other.
    pub above: u32,
    /// What lies above the others does so on the back of its triangles.
    pub on_back: bool,
}

impl Stacked {
    /// Relative height: 0 at the bottom, 1 on top. Of two overlapping surfaces the upper one has the greater share.
    pub fn share(self) -> f32 {
        self.below as f32 / (self.below + self.above).max(1) as f32
    }

    /// Unit vectors, by vertex index, along which the surface's vertices are raised; `triangles`: index and
    /// position of each corner. A vertex of a curved surface is raised along the mean of its triangles' normals, so
    /// that no gap opens.
    pub fn directions(
        self,
        triangles: impl Iterator<Item = ([u32; 3], [Vec3; 3])>,
    ) -> BTreeMap<u32, Vec3> {
        let mut sums: BTreeMap<u32, Vec3> = BTreeMap::new();
        for (numbers, [a, b, c]) in triangles {
            let front = (c - a).cross(b - a);
            for number in numbers {
                *sums.entry(number).or_default() += if self.on_back { -front } else { front };
            }
        }
        for sum in sums.values_mut() {
            *sum = sum.normalize_or_zero();
        }
        sums
    }
}

impl RelitWorld {
    /// Coplanar rank of each surface. Skies, fog, surfaces that are not drawn and those moved by `deformVertexes`
    /// have rank 0.
    pub fn stacked(&self) -> Vec<Stacked> {
        let sheet = |surface: &WorldSurface| {
            let material = self.material_of(surface);
            let shader = material.map(|m| &m.resolved.shader);
            let first = surface.first_index as usize / 3;
            let drawn = material.is_some_and(|m| {
                let hidden = [
                    SurfaceClass::Sky,
                    SurfaceClass::Fog,
                    SurfaceClass::Invisible,
                ];
                !hidden.contains(&m.class.class) && m.resolved.shader.deforms.is_empty()
            });
            let count = if drawn {
                surface.num_indices as usize / 3
            } else {
                0
            };
            Sheet {
                model: surface.model,
                cull: shader.map_or(Cull::Front, |s| s.cull),
                order: DrawOrder {
                    offset: shader.is_some_and(|s| s.polygon_offset),
                    sort: shader.map_or(0.0, |s| s.sort_value()),
                    material: surface.material,
                },
                triangles: (first..first + count).map(|t| self.triangle(t)).collect(),
            }
        };
        stack(&self.surfaces.iter().map(sheet).collect::<Vec<_>>())
    }
}

/// A triangle projected to its plane.
struct Flat {
    sheet: usize,
    corners: [Vec3; 3],
    front: Vec3,
    area: f32,
    /// Its corners on the two axes that the plane leans to least.
    shadow: [Vec2; 3],
    mins: Vec2,
    maxs: Vec2,
}

/// Model and lookup cell of a plane, regardless of its orientation.
type Cell = (u32, [i32; 4]);

/// Rank of each of `sheets`. Surfaces of one material have no order and are not compared.
pub fn stack(sheets: &[Sheet]) -> Vec<Stacked> {
    let mut on: Vec<BTreeSet<(usize, bool)>> = vec![BTreeSet::new(); sheets.len()];
    for (lower, upper, alike) in overlaps(sheets) {
        if let Some(list) = on.get_mut(upper) {
            list.insert((lower, alike));
        }
    }
    let mut rising: Vec<usize> = (0..sheets.len()).collect();
    rising.sort_by(|&a, &b| match (sheets.get(a), sheets.get(b)) {
        (Some(a), Some(b)) => a.order.compare(&b.order),
        _ => Ordering::Equal,
    });
    let shows_both = |sheet: usize| sheets.get(sheet).is_some_and(|s| s.cull == Cull::None);
    let mut stacked = vec![Stacked::default(); sheets.len()];
    for &upper in &rising {
        let Some(cull) = slice::get(sheets, upper).map(|s| s.cull) else {
            continue;
        };
        let below = || on.get(upper).into_iter().flatten();
        let of = |sheet: usize| item(&stacked, sheet);
        let rank = below().map(|&(lower, _)| of(lower).below + 1).max();
        let on_back = match cull {
            Cull::Front => false,
            Cull::Back => true,
            // a two-sided surface shows the face that the surface below it shows
            Cull::None => (below().min_by_key(|(lower, _)| shows_both(*lower)))
                .is_some_and(|&(lower, alike)| of(lower).on_back == alike),
        };
        if let Some(own) = stacked.get_mut(upper) {
            own.below = rank.unwrap_or(0);
            own.on_back = on_back;
        }
    }
    for &upper in rising.iter().rev() {
        let above = stacked.get(upper).map_or(0, |s| s.above + 1);
        for &(lower, _) in on.get(upper).into_iter().flatten() {
            if let Some(lower) = stacked.get_mut(lower) {
                lower.above = lower.above.max(above);
            }
        }
    }
    stacked
}

/// Pairs of sheets that overlap in one plane with the same visible side: the lower, the upper, and whether their
/// triangles face the same side.
fn overlaps(sheets: &[Sheet]) -> BTreeSet<(usize, usize, bool)> {
    let mut planes: HashMap<Cell, Vec<Flat>> = HashMap::new();
    for (number, sheet) in sheets.iter().enumerate() {
        for &corners in &sheet.triangles {
            for cell in cells(sheet.model, corners) {
                planes
                    .entry(cell)
                    .or_default()
                    .extend(flat(number, corners, cell));
            }
        }
    }
    let mut found = BTreeSet::new();
    let mut pairs = 0;
    for mut flats in planes.into_values() {
        let orders = || {
            flats
                .iter()
                .filter_map(|f| Some(sheets.get(f.sheet)?.order))
        };
        if orders().zip(orders().skip(1)).all(|(a, b)| a == b) {
            continue;
        }
        flats.sort_by(|a, b| a.mins.x.total_cmp(&b.mins.x));
        for (i, a) in flats.iter().enumerate() {
            for b in (flats.iter().skip(i + 1)).take_while(|b| b.mins.x + TOUCHING < a.maxs.x) {
                pairs += 1;
                if pairs > MOST_PAIRS {
                    return found;
                }
                found.extend(overlap(sheets, a, b));
            }
        }
    }
    found
}

/// The pair of two triangles' sheets, if they overlap; see [`overlaps`].
fn overlap(sheets: &[Sheet], a: &Flat, b: &Flat) -> Option<(usize, usize, bool)> {
    let (one, other) = (sheets.get(a.sheet)?, sheets.get(b.sheet)?);
    let order = one.order.compare(&other.order);
    let shared = a.maxs.min(b.maxs) - a.mins.max(b.mins);
    if order.is_eq() || shared.min_element() <= TOUCHING {
        return None;
    }
    let alike = a.front.dot(b.front) > 0.0;
    let faces = |cull, front: bool| match cull {
        Cull::Front => front,
        Cull::Back => !front,
        Cull::None => true,
    };
    let same_side = |side| faces(one.cull, side) && faces(other.cull, side == alike);
    if !(same_side(true) || same_side(false)) {
        return None;
    }
    let (small, large) = if a.area < b.area { (a, b) } else { (b, a) };
    let height = |p: Vec3| (p - large.corners[0]).dot(large.front).abs();
    if small.corners.into_iter().any(|p| height(p) > APART) || !overlap_flat(&a.shadow, &b.shadow) {
        return None;
    }
    Some(match order {
        Ordering::Less => (a.sheet, b.sheet, alike),
        _ => (b.sheet, a.sheet, alike),
    })
}

/// Whether two triangles overlap (separating axis test).
fn overlap_flat(a: &[Vec2; 3], b: &[Vec2; 3]) -> bool {
    let range = |t: &[Vec2; 3], axis: Vec2| {
        let [p, q, r] = t.map(|v| v.dot(axis));
        (p.min(q).min(r), p.max(q).max(r))
    };
    let apart = |axis: Vec2| {
        let ((a_low, a_high), (b_low, b_high)) = (range(a, axis), range(b, axis));
        a_high.min(b_high) - a_low.max(b_low) <= TOUCHING
    };
    let sides = |t: &[Vec2; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    !(sides(a).into_iter().chain(sides(b))).any(|side| apart(side.perp().normalize_or_zero()))
}

/// Unit normal of the front (clockwise corners); `None` for degenerate or non-finite triangles.
fn front_of([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    (c - a).cross(b - a).try_normalize()
}

/// Lookup cells of a triangle's plane: several if it is near a cell border.
fn cells(model: u32, corners: [Vec3; 3]) -> Vec<Cell> {
    let Some(front) = front_of(corners) else {
        return Vec::new();
    };
    // One orientation of the plane; both, if neither is clear.
    let lean = front.x + 0.7 * front.y + 0.4 * front.z;
    let sides = [1.0, -1.0].map(|s| (s * lean > -NORMAL_CELL.1).then_some(front * s));
    let range = |x: f32, (size, slack): (f32, f32)| {
        ((x - slack) / size).round() as i32..=((x + slack) / size).round() as i32
    };
    let mut found = Vec::new();
    for up in sides.into_iter().flatten() {
        for x in range(up.x, NORMAL_CELL) {
            for y in range(up.y, NORMAL_CELL) {
                for z in range(up.z, NORMAL_CELL) {
                    let distances = range(up.dot(corners[0]), DISTANCE_CELL);
                    found.extend(distances.map(|d| (model, [x, y, z, d])));
                }
            }
        }
    }
    found
}

/// A triangle projected along the common axis of a cell.
fn flat(sheet: usize, corners: [Vec3; 3], (_, [x, y, z, _]): Cell) -> Option<Flat> {
    let front = front_of(corners)?;
    let [a, b, c] = corners;
    let [x, y, z] = [x, y, z].map(i32::unsigned_abs);
    let drop = |v: Vec3| {
        if x >= y && x >= z {
            Vec2::new(v.y, v.z)
        } else if y >= z {
            Vec2::new(v.x, v.z)
        } else {
            Vec2::new(v.x, v.y)
        }
    };
    let shadow = corners.map(drop);
    let [p, q, r] = shadow;
    Some(Flat {
        sheet,
        corners,
        front,
        area: (c - a).cross(b - a).length(),
        shadow,
        mins: p.min(q).min(r),
        maxs: p.max(q).max(r),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALL: DrawOrder = order(false, 3.0, 0);

    const fn order(offset: bool, sort: f32, material: u32) -> DrawOrder {
        DrawOrder {
            offset,
            sort,
            material,
        }
    }

    /// A square around a point of the plane x = `x` that faces +x.
    fn square(order: DrawOrder, [x, y, z]: [f32; 3], half: f32) -> Sheet {
        let at = |dy: f32, dz: f32| Vec3::new(x, y + dy * half, z + dz * half);
        let [a, b, c, d] = [at(-1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0)];
        Sheet {
            model: 0,
            cull: Cull::Front,
            order,
            triangles: vec![[a, b, c], [a, c, d]],
        }
    }

    fn turned(mut sheet: Sheet, by: impl Fn(Vec3) -> Vec3) -> Sheet {
        for triangle in &mut sheet.triangles {
            *triangle = triangle.map(&by);
        }
        sheet
    }

    fn ranks(sheets: &[Sheet]) -> Vec<u32> {
        stack(sheets).iter().map(|s| s.below).collect()
    }

    #[test]
    fn offset_comes_before_sort_and_sort_before_material() {
        let at = [8.0, 0.0, 0.0];
        let sheets = [
            square(order(true, 4.0, 1), at, 8.0),
            square(order(false, 9.0, 2), at, 8.0),
            square(order(true, 3.0, 7), at, 8.0),
            square(WALL, at, 64.0),
            square(order(false, 3.0, 5), at, 8.0),
        ];
        assert_eq!(ranks(&sheets), [4, 2, 3, 0, 1]);
        let stacked = stack(&sheets);
        let shares: Vec<_> = [3, 4, 1, 2, 0]
            .iter()
            .map(|&i| stacked[i].share())
            .collect();
        assert_eq!(shares, [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert!(stacked.iter().all(|s| !s.on_back));
    }

    #[test]
    fn what_lies_beside_before_or_back_to_back_lies_on_nothing() {
        let poster = |at| square(order(true, 4.0, 1), at, 8.0);
        let wall = square(WALL, [8.0, 0.0, 0.0], 64.0);
        let mut behind = poster([8.0, 0.0, 0.0]);
        for triangle in &mut behind.triangles {
            triangle.swap(0, 1);
        }
        let mut door = poster([8.0, 0.0, 0.0]);
        door.model = 1;
        for other in [
            poster([8.0, 72.0, 0.0]),           // shares an edge
            poster([8.0625, 0.0, 0.0]),         // in front
            poster([-8.0, 0.0, 0.0]),           // as far from the middle of the world
            behind,                             // faces the other way
            door,                               // moves by itself
            square(WALL, [8.0, 0.0, 0.0], 8.0), // of the same material
        ] {
            assert_eq!(ranks(&[wall.clone(), other]), [0, 0]);
        }
        // a corner over the edge is enough
        assert_eq!(ranks(&[wall, poster([8.0, 70.0, 70.0])]), [0, 1]);
    }

    #[test]
    fn planes_of_all_directions_are_found() {
        for axis in [
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            Vec3::new(1.0, -2.0, 0.5),
            Vec3::new(-4.0, 1.0, 9.0),
        ] {
            for degrees in (0..360).step_by(15) {
                let turn =
                    glam::Quat::from_axis_angle(axis.normalize(), (degrees as f32).to_radians());
                // single precision differs in the last bits between the two
                let by = |v: Vec3| turn * (v + Vec3::new(700.3, 1300.7, -900.1));
                let wall = turned(square(WALL, [2.0, 0.0, 0.0], 500.0), by);
                let poster = turned(square(order(true, 4.0, 1), [2.0, 90.0, 33.3], 7.7), by);
                assert_eq!(ranks(&[poster, wall]), [1, 0], "{axis} {degrees}");
            }
        }
    }

    #[test]
    fn what_shows_both_faces_rises_on_the_side_of_what_it_lies_on() {
        let flipped = |mut sheet: Sheet| {
            for triangle in &mut sheet.triangles {
                triangle.swap(0, 1);
            }
            sheet
        };
        let wall = square(WALL, [8.0, 0.0, 0.0], 64.0);
        let mut poster = square(order(true, 4.0, 1), [8.0, 0.0, 0.0], 8.0);
        poster.cull = Cull::None;
        let mut back = flipped(wall.clone());
        back.cull = Cull::Back;
        for (poster, on_back) in [(poster.clone(), false), (flipped(poster), true)] {
            for wall in [&wall, &back] {
                let stacked = stack(&[wall.clone(), poster.clone()])[1];
                assert_eq!((stacked.below, stacked.on_back), (1, on_back));
                let rise = stacked.directions([([0, 1, 2], poster.triangles[0])].into_iter());
                assert!(rise.values().all(|d| (*d - Vec3::X).length() < 1.0e-6));
            }
        }
    }

    #[test]
    fn a_bent_surface_stays_whole() {
        let place = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let (a, b) = (place(0.0, 0.0, 0.0), place(0.0, 0.0, 8.0));
        let triangles = [
            ([1, 0, 2], [b, a, place(8.0, 0.0, 0.0)]),
            ([3, 0, 1], [place(0.0, 8.0, 0.0), a, b]),
        ];
        let lone = Stacked::default().directions(triangles[..1].iter().copied());
        assert_eq!(lone[&0], Vec3::Y);
        let bent = Stacked::default().directions(triangles.into_iter());
        let mean = (Vec3::X + Vec3::Y).normalize();
        assert!((bent[&0] - mean).length() < 1.0e-6 && (bent[&1] - mean).length() < 1.0e-6);
        assert_eq!((bent[&2], bent[&3]), (Vec3::Y, Vec3::X));
    }

    #[test]
    fn damaged_triangles_lie_on_nothing() {
        let mut broken = square(order(true, 4.0, 1), [8.0, 0.0, 0.0], 8.0);
        broken.triangles[0][1] = Vec3::NAN;
        broken.triangles[1] = [Vec3::splat(1.0e38), Vec3::splat(-1.0e38), Vec3::ZERO];
        let wall = square(WALL, [8.0, 0.0, 0.0], 64.0);
        assert_eq!(ranks(&[wall, broken]), [0, 0]);
        assert!(stack(&[]).is_empty());
    }
}
