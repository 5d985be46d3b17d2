//! Uniform grids over triangles: equal cubic cells, each with a list of the triangles that touch it (Amanatides and Woo,
//! A Fast Voxel Traversal Algorithm for Ray Tracing, Eurographics 1987; Purcell et al., Ray Tracing on Programmable
//! Graphics Hardware, SIGGRAPH 2002).
//!
//! Triangles are tested against cells that are grown by [`Layout::margin`], which covers the rounding of a walk in 32-bit
//! floats: every point of a ray that lies in a triangle lies in a cell of the walk that lists this triangle.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec3, UVec3, Vec3};

use crate::aabb::Aabb;
use crate::parallel;
use crate::slice::{item, part};

/// Most cells along an axis.
pub const MOST_CELLS: u32 = 256;

/// Triangles that a thread tests at a time.
const CHUNK: usize = 256;

/// Rounding of a walk over the size and the distance from the origin of a grid. The walk multiplies and adds a few
/// numbers of that magnitude (units in the last place of 2^-24); rays may start up to a few sizes away from the grid.
const ROUNDING: f32 = 1.0 / (1 << 18) as f32;

/// Largest coordinate of a triangle that a grid holds: distances along rays, and products with them, stay finite.
const FARTHEST: f32 = 1.0e7;

/// Place and size of the cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Least corner of the first cell.
    pub origin: Vec3,
    /// Edge of a cell, above 0.
    pub edge: f32,
    /// Cells along each axis, at least 1.
    pub counts: UVec3,
    /// Distance by which cells are grown for the test of triangles.
    pub margin: f32,
}

/// Cells along the longest axis of a box for a number of triangles: `density` cells a triangle (Cleary and Wyvill,
/// Analysis of an Algorithm for Fast Ray Tracing Using Uniform Space Subdivision, The Visual Computer 1988). At least 1,
/// at most [`MOST_CELLS`].
pub fn cells_by_density(bounds: Aabb, triangles: usize, density: f64) -> u32 {
    let size = bounds.size().as_dvec3();
    let longest = size.max_element();
    // a flat box has at least one cell across
    let least = longest / f64::from(MOST_CELLS);
    let volume = size.max(DVec3::splat(least)).element_product();
    #[allow(clippy::cast_precision_loss)] // of a rounded result
    let cells = longest * (density * triangles as f64 / volume).cbrt();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // the cast maps NaN to 0
    let cells = cells.round() as u32;
    cells.clamp(1, MOST_CELLS)
}

impl Layout {
    /// Cells around a box, `most` of them along its longest axis, at most [`MOST_CELLS`]. `None` if the box is empty or
    /// too far from the origin.
    pub fn around(bounds: Aabb, most: u32) -> Option<Self> {
        let far = bounds.mins.abs().max(bounds.maxs.abs()).max_element();
        if bounds.is_empty() || far > FARTHEST {
            return None;
        }
        let most = most.clamp(1, MOST_CELLS);
        let margin = (far + bounds.size().max_element()).max(1.0) * ROUNDING;
        // what lies on the outermost faces lies within a cell
        let grown = bounds.grown(Vec3::splat(2.0 * margin));
        let size = grown.size();
        #[allow(clippy::cast_precision_loss)] // at most 256
        let edge = size.max_element() / most as f32;
        let counts = (size / edge)
            .ceil()
            .as_uvec3()
            .clamp(UVec3::ONE, UVec3::splat(most));
        let origin = grown.centre() - counts.as_vec3() * (0.5 * edge);
        Some(Self {
            origin,
            edge,
            counts,
            margin,
        })
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.counts.as_u64vec3().element_product() as usize
    }

    /// Index of a cell: x changes fastest, z slowest.
    pub fn index(&self, cell: UVec3) -> usize {
        ((cell.z * self.counts.y + cell.y) * self.counts.x + cell.x) as usize
    }

    /// Middle of a cell.
    fn middle(&self, cell: UVec3) -> DVec3 {
        self.origin.as_dvec3() + (cell.as_dvec3() + 0.5) * f64::from(self.edge)
    }

    /// Cells whose grown boxes a range of coordinates on an axis touches: first and last.
    fn range(&self, axis: usize, low: f64, high: f64) -> [u32; 2] {
        let last = self.counts[axis] - 1;
        let margin = f64::from(self.margin);
        let place = |x: f64| (x - f64::from(self.origin[axis])) / f64::from(self.edge);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        // the cast clamps at 0 and maps NaN to 0
        let cell = |x: f64| (place(x).floor() as u32).min(last);
        [cell(low - margin), cell(high + margin)]
    }
}

/// A triangle prepared for tests against boxes of one size (Akenine-Möller, Fast 3D Triangle-Box Overlap Testing,
/// Journal of Graphics Tools 2001): the 13 axes that can separate them, each with the range of box centres along it whose
/// boxes the triangle touches. Both touch unless the centre lies outside of a range.
struct Separation {
    axes: [(DVec3, f64, f64); 13],
    normal: DVec3,
}

impl Separation {
    /// `half`: half of the edge of the boxes.
    fn new(corners: [DVec3; 3], half: f64) -> Self {
        let [a, b, c] = corners;
        let edges = [b - a, c - b, a - c];
        let normal = edges[0].cross(edges[1]);
        let range = |axis: DVec3| {
            let along = corners.map(|corner| corner.dot(axis));
            let reach = half * axis.abs().element_sum();
            let low = along.into_iter().fold(f64::INFINITY, f64::min);
            let high = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
            (axis, low - reach, high + reach)
        };
        let [ab, bc, ca] = edges;
        let axes = [
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            normal,
            DVec3::X.cross(ab),
            DVec3::X.cross(bc),
            DVec3::X.cross(ca),
            DVec3::Y.cross(ab),
            DVec3::Y.cross(bc),
            DVec3::Y.cross(ca),
            DVec3::Z.cross(ab),
            DVec3::Z.cross(bc),
            DVec3::Z.cross(ca),
        ];
        Self {
            axes: axes.map(range),
            normal,
        }
    }

    /// Whether the triangle touches the box around a centre.
    fn touches(&self, centre: DVec3) -> bool {
        self.axes.iter().all(|(axis, low, high)| {
            let along = centre.dot(*axis);
            (*low..=*high).contains(&along)
        })
    }
}

/// Calls `found` with the cells that a triangle touches. A triangle without area touches none: nothing hits it.
fn cells_of(layout: &Layout, corners: [Vec3; 3], mut found: impl FnMut(UVec3)) {
    let exact = corners.map(|corner| corner.as_dvec3());
    let half = f64::from(layout.edge) * 0.5 + f64::from(layout.margin);
    let triangle = Separation::new(exact, half);
    let normal = triangle.normal;
    if normal == DVec3::ZERO || !corners.iter().all(|corner| corner.is_finite()) {
        return;
    }
    let bounds = Aabb::of(corners);
    let range = |axis: usize| {
        let (low, high) = (f64::from(bounds.mins[axis]), f64::from(bounds.maxs[axis]));
        layout.range(axis, low, high)
    };
    // along the axis nearest to the normal, the plane crosses few cells of each column of cells
    let steep = normal.abs();
    let down = match (steep.x >= steep.y, steep.x >= steep.z, steep.y >= steep.z) {
        (true, true, _) => 0,
        (false, _, true) => 1,
        _ => 2,
    };
    let (across, along) = ((down + 1) % 3, (down + 2) % 3);
    let (columns, rows, limits) = (range(across), range(along), range(down));
    let slope_across = normal[across] / normal[down];
    let slope_along = normal[along] / normal[down];
    let height = exact[0].dot(normal) / normal[down];
    let reach = half * (slope_across.abs() + slope_along.abs());
    let mut cell = UVec3::ZERO;
    for column in columns[0]..=columns[1] {
        for row in rows[0]..=rows[1] {
            (cell[across], cell[along]) = (column, row);
            let middle = layout.middle(cell);
            let at = height - slope_across * middle[across] - slope_along * middle[along];
            let [low, high] = layout.range(down, at - reach, at + reach);
            for depth in low.max(limits[0])..=high.min(limits[1]) {
                cell[down] = depth;
                if triangle.touches(layout.middle(cell)) {
                    found(cell);
                }
            }
        }
    }
}

/// A grid over numbered triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Place and size of the cells.
    pub layout: Layout,
    /// For each cell the place of its first triangle in `entries`; at the end the number of entries.
    pub starts: Vec<u32>,
    /// Numbers of triangles, cell by cell, ascending in each.
    pub entries: Vec<u32>,
}

impl Grid {
    /// Builds a grid over triangles, given by their corners. Triangles without area and those that are not finite are in
    /// no list. `None` if the lists would have more than `most` entries.
    pub fn new(corners: &[[Vec3; 3]], layout: Layout, most: usize) -> Option<Self> {
        let most = most.min(u32::MAX as usize);
        let total = AtomicUsize::new(0);
        let chunks: Vec<&[[Vec3; 3]]> = corners.chunks(CHUNK).collect();
        // cell and triangle
        let found = parallel::map(&chunks, |chunk, corners| {
            let mut found: Vec<[u32; 2]> = Vec::new();
            for (number, &corners) in corners.iter().enumerate() {
                let before = found.len();
                if total.load(Ordering::Relaxed) > most {
                    break;
                }
                let number = u32::try_from(chunk * CHUNK + number).unwrap_or(u32::MAX);
                cells_of(&layout, corners, |cell| {
                    let cell = u32::try_from(layout.index(cell)).unwrap_or(u32::MAX);
                    found.push([cell, number]);
                });
                total.fetch_add(found.len() - before, Ordering::Relaxed);
            }
            found
        });
        let total = total.into_inner();
        if total > most {
            return None;
        }
        // a counting sort by cell, which keeps the order of the triangles
        let mut starts = vec![0u32; layout.cells() + 1];
        for [cell, _] in found.iter().flatten() {
            if let Some(count) = starts.get_mut(*cell as usize + 1) {
                *count += 1;
            }
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut next = starts.clone();
        let mut entries = vec![0u32; total];
        for [cell, triangle] in found.into_iter().flatten() {
            if let Some(place) = next.get_mut(cell as usize)
                && let Some(entry) = entries.get_mut(*place as usize)
            {
                *entry = triangle;
                *place += 1;
            }
        }
        Some(Self {
            layout,
            starts,
            entries,
        })
    }

    /// The triangles of a cell.
    pub fn triangles(&self, cell: UVec3) -> &[u32] {
        let index = self.layout.index(cell);
        let [first, end] = [index, index + 1].map(|at| item(&self.starts, at) as usize);
        part(&self.entries, first..end)
    }

    /// Bytes of the lists.
    pub fn bytes(&self) -> usize {
        size_of_val(self.starts.as_slice()) + size_of_val(self.entries.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Random triangles of about `size` within `spread` of a point, some of them in planes of constant coordinates, as
    /// walls of maps are.
    fn soup(seed: u64, count: usize, centre: Vec3, spread: Vec3, size: f32) -> Vec<[Vec3; 3]> {
        let mut random = Random::new(seed);
        (0..count)
            .map(|number| {
                let middle = centre + random.signed_point() * spread;
                let mut corners = [0; 3].map(|_| middle + random.signed_point() * size);
                if number % 3 == 0 {
                    let axis = number / 3 % 3;
                    let level = corners[0][axis].round();
                    corners.iter_mut().for_each(|corner| corner[axis] = level);
                }
                corners
            })
            .collect()
    }

    fn around(corners: &[[Vec3; 3]], cells: u32) -> Layout {
        let bounds = Aabb::of(corners.iter().flatten().copied());
        Layout::around(bounds, cells).expect("finite")
    }

    fn built(corners: &[[Vec3; 3]], cells: u32) -> Grid {
        Grid::new(corners, around(corners, cells), usize::MAX).expect("small")
    }

    /// Distance to a triangle (Möller and Trumbore, 1997), in 64-bit floats.
    fn hit(origin: Vec3, direction: Vec3, corners: [Vec3; 3]) -> Option<f64> {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let inverse = ab.dot(p).recip();
        let s = origin - a;
        let u = s.dot(p) * inverse;
        let q = s.cross(ab);
        let v = direction.dot(q) * inverse;
        let distance = ac.dot(q) * inverse;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0 && distance.is_finite())
            .then_some(distance)
    }

    /// The walk of `shaders/trace/grid.glsl` in the same 32-bit arithmetic: nearest hit, and cells visited.
    fn walk(
        grid: &Grid,
        corners: &[[Vec3; 3]],
        origin: Vec3,
        direction: Vec3,
    ) -> (Option<f64>, u32) {
        let layout = &grid.layout;
        let along = Vec3::select(
            direction.abs().cmplt(Vec3::splat(1.0e-20)),
            Vec3::splat(1.0e-20),
            direction,
        );
        let inverse = along.recip();
        let base = (layout.origin - origin) * inverse;
        let delta = layout.edge * inverse;
        let end = base + layout.counts.as_vec3() * delta;
        let enter = base.min(end).max_element().max(0.0);
        let leave = base.max(end).min_element();
        if enter.partial_cmp(&leave).is_none_or(|order| order.is_gt()) {
            return (None, 0);
        }
        let place = (origin + enter * direction - layout.origin) / layout.edge;
        let counts = layout.counts.as_ivec3();
        let mut cell = place
            .floor()
            .as_ivec3()
            .clamp(glam::IVec3::ZERO, counts - 1);
        let back = along.cmplt(Vec3::ZERO);
        let mut nearest: Option<f64> = None;
        let mut visited = 0;
        loop {
            visited += 1;
            for &number in grid.triangles(cell.as_uvec3()) {
                let found = hit(origin, direction, corners[number as usize]);
                nearest = [nearest, found].into_iter().flatten().reduce(f64::min);
            }
            let ahead = Vec3::select(back, Vec3::ZERO, Vec3::ONE);
            let next = (cell.as_vec3() + ahead) * delta + base;
            let least = next.min_element();
            if nearest.is_some_and(|t| t <= f64::from(least)) {
                break;
            }
            let axis = (0..3)
                .find(|&axis| next[axis] == least)
                .expect("not a number");
            cell[axis] += if back.test(axis) { -1 } else { 1 };
            if cell[axis] < 0 || cell[axis] >= counts[axis] {
                break;
            }
        }
        assert!(visited <= layout.counts.element_sum() + 1, "{visited}");
        (nearest, visited)
    }

    #[test]
    fn every_cell_lists_the_triangles_that_touch_it() {
        let mut random = Random::new(3);
        for (seed, count, spread, size, cells) in [
            (1, 60, 100.0, 40.0, 12),
            (2, 200, 4000.0, 300.0, 16),
            (3, 40, 1.0, 0.01, 20),
            (4, 12, 30.0, 500.0, 9),
        ] {
            let spread = Vec3::new(spread, 0.5 * spread, 0.2 * spread);
            let corners = soup(seed, count, Vec3::new(700.0, -90.0, 3.0), spread, size);
            let grid = built(&corners, cells);
            let layout = &grid.layout;
            assert_eq!(layout.counts.max_element(), cells);
            assert_eq!(grid.starts.len(), layout.cells() + 1);
            let bounds = Aabb::of(corners.iter().flatten().copied());
            let end = layout.origin + layout.counts.as_vec3() * layout.edge;
            assert!(layout.origin.cmplt(bounds.mins).all() && end.cmpgt(bounds.maxs).all());
            // points of each triangle lie in cells that list it
            for (number, corners) in (0..).zip(&corners) {
                for _ in 0..200 {
                    let [u, v] = [random.uniform(), random.uniform()];
                    let [u, v] = if u + v > 1.0 {
                        [1.0 - u, 1.0 - v]
                    } else {
                        [u, v]
                    };
                    let [a, b, c] = *corners;
                    let point = a + (b - a) * u + (c - a) * v;
                    let cell = ((point - layout.origin) / layout.edge).floor().as_uvec3();
                    let cell = cell.min(layout.counts - 1);
                    assert!(grid.triangles(cell).contains(&number), "{number} {cell}");
                }
            }
            // cells that list a triangle touch it: no plane of the 13 axes separates them, by all cells
            let half = f64::from(0.5 * layout.edge + layout.margin);
            let tests: Vec<Separation> = (corners.iter())
                .map(|c| Separation::new(c.map(|p| p.as_dvec3()), half))
                .collect();
            let mut cell = UVec3::ZERO;
            for index in 0..layout.cells() as u32 {
                cell.x = index % layout.counts.x;
                cell.y = index / layout.counts.x % layout.counts.y;
                cell.z = index / (layout.counts.x * layout.counts.y);
                assert_eq!(layout.index(cell), index as usize);
                let middle = layout.middle(cell);
                let touching = (0u32..)
                    .zip(&tests)
                    .filter(|(_, test)| test.touches(middle));
                let touching: Vec<u32> = touching.map(|(number, _)| number).collect();
                assert_eq!(grid.triangles(cell), touching);
            }
        }
    }

    #[test]
    fn triangles_and_boxes_that_touch_are_told_from_those_that_do_not() {
        let test = |corners: [[f64; 3]; 3]| {
            Separation::new(corners.map(DVec3::from), 0.5).touches(DVec3::ZERO)
        };
        // a corner inside; the plane through the middle with all corners outside; an edge that cuts an edge
        assert!(test([[0.1, 0.2, 0.3], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]]));
        assert!(test([[-9.0, -9.0, 0.1], [9.0, -9.0, 0.1], [0.0, 9.0, 0.1]]));
        assert!(test([[0.4, 0.55, 0.0], [0.55, 0.4, 0.0], [9.0, 9.0, 0.0]]));
        // apart along a face, the triangle's plane, and a product of edges alone
        assert!(!test([[0.6, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, -1.0, 0.0]]));
        assert!(!test([[1.6, 0.0, 0.0], [0.0, 1.6, 0.0], [0.0, 0.0, 1.6]]));
        assert!(!test([[0.7, 0.4, -9.0], [0.4, 0.7, 9.0], [0.9, 0.9, 0.0]]));
        // faces that coincide touch
        assert!(test([[0.5, -0.1, -0.1], [0.5, 0.1, -0.1], [0.5, 0.0, 0.1]]));
    }

    #[test]
    fn walks_find_what_all_triangles_give() {
        let mut random = Random::new(11);
        let mut hits = 0;
        for (seed, count, cells, spread) in [
            (21, 300, 16, Vec3::splat(100.0)),
            (22, 300, 40, Vec3::new(2000.0, 1500.0, 200.0)),
            (23, 100, 1, Vec3::splat(50.0)),
            // flat: all triangles near a plane
            (24, 100, 32, Vec3::new(800.0, 0.0, 600.0)),
        ] {
            let centre = Vec3::new(-300.0, 64.0, 8.0);
            let size = spread.max_element() * 0.4;
            let size = if spread.y == 0.0 { 200.0 } else { size };
            let mut corners = soup(seed, count, centre, spread, size);
            if spread.y == 0.0 {
                corners.iter_mut().flatten().for_each(|p| p.y = centre.y);
            }
            let grid = built(&corners, cells);
            for ray in 0..1500 {
                let mut origin = centre + random.signed_point() * spread * 1.2;
                let mut direction = random.signed_point().normalize_or(Vec3::X);
                let axis = ray % 3;
                match ray % 8 {
                    // parallel to an axis, to a plane of axes, and nearly so
                    0 => direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z][axis],
                    1 => direction[axis] = 0.0,
                    2 => direction[axis] = 1.0e-7,
                    // from a boundary between cells, and from a face of the grid
                    3 => {
                        let cell = (random.uniform() * 9.0).floor();
                        origin[axis] = grid.layout.origin[axis] + cell * grid.layout.edge;
                        direction[(axis + 1) % 3] = 0.0;
                    }
                    4 => origin[axis] = grid.layout.origin[axis],
                    // from outside
                    5 => origin += direction * -3.0 * spread.max_element(),
                    _ => {}
                }
                let all = corners.iter().filter_map(|&c| hit(origin, direction, c));
                let expected = all.reduce(f64::min);
                let (found, _) = walk(&grid, &corners, origin, direction);
                assert_eq!(found, expected, "{ray}: {origin} {direction}");
                hits += usize::from(found.is_some());
            }
        }
        assert!(hits > 2000, "{hits}");
    }

    #[test]
    fn walks_along_boundaries_of_cells_miss_nothing() {
        let mut random = Random::new(31);
        let centre = Vec3::new(900.0, -2000.0, 70.0);
        let half = Vec3::new(310.0, 250.0, 130.0);
        let bounds = Aabb::new(centre - half, centre + half);
        let layout = Layout::around(bounds, 13).expect("finite");
        let inner = (layout.counts - 1).as_vec3();
        let boundary = |random: &mut Random, reach: f32| {
            let place = [0; 3].map(|_| random.uniform());
            layout.origin
                + (Vec3::ONE + (Vec3::from(place) * (inner - 1.0) * reach).round()) * layout.edge
        };
        // corners at corners of cells; many triangles lie in planes between cells
        let corners: Vec<[Vec3; 3]> = (0..250)
            .map(|number| {
                let first = boundary(&mut random, 1.0);
                let mut corners = [first; 3];
                for corner in corners.iter_mut().skip(1) {
                    let away = random.signed_point() * 2.6 * layout.edge;
                    *corner = first + (away / layout.edge).round() * layout.edge;
                }
                if number % 2 == 0 {
                    let axis = number / 2 % 3;
                    corners.iter_mut().for_each(|c| c[axis] = first[axis]);
                }
                corners.map(|c| c.clamp(bounds.mins, bounds.maxs))
            })
            .collect();
        let grid = Grid::new(&corners, layout, usize::MAX).expect("small");
        let mut hits = 0;
        for ray in 0..4000 {
            let origin = boundary(&mut random, 1.0);
            let mut direction = (boundary(&mut random, 1.0) - origin) / layout.edge;
            match ray % 4 {
                // in a plane of boundaries, and along an edge of cells
                0 => direction[ray / 4 % 3] = 0.0,
                1 => direction = [Vec3::X, Vec3::NEG_Z, Vec3::Y][ray / 4 % 3],
                _ => {}
            }
            if direction == Vec3::ZERO {
                continue;
            }
            let all = corners.iter().filter_map(|&c| hit(origin, direction, c));
            let expected = all.reduce(f64::min);
            let (found, _) = walk(&grid, &corners, origin, direction);
            assert_eq!(found, expected, "{ray}: {origin} {direction}");
            hits += usize::from(found.is_some());
        }
        assert!(hits > 1000, "{hits}");
    }

    #[test]
    fn odd_boxes_and_triangles_are_borne() {
        let [x, y] = [Vec3::X * 40.0, Vec3::Y * 40.0];
        // one flat triangle, one without area, one that is not finite
        let corners = [
            [Vec3::ZERO, x, y],
            [x, x, y],
            [Vec3::ZERO, x, 2.0 * x],
            [Vec3::NAN, x, y],
        ];
        let bounds = Aabb::of([Vec3::ZERO, x, y]);
        let layout = Layout::around(bounds, 4).expect("finite");
        assert_eq!(layout.counts, UVec3::new(4, 4, 1));
        let grid = Grid::new(&corners, layout, 100).expect("small");
        assert!(grid.entries.iter().all(|&number| number == 0));
        // 4 + 3 + 2 + 1 cells on and below the diagonal, and those that the diagonal touches at corners
        assert!((10..=13).contains(&grid.entries.len()));
        assert!(Grid::new(&corners, layout, 9).is_none(), "a bound");
        let point = Layout::around(Aabb::of([Vec3::ONE]), 256).expect("a point");
        assert!(point.edge > 0.0 && point.counts.min_element() >= 1);
        for bad in [
            Aabb::EMPTY,
            Aabb::of([Vec3::splat(1.0e8)]),
            Aabb::new(Vec3::NAN, Vec3::ONE),
        ] {
            assert_eq!(Layout::around(bad, 16), None);
        }
        let none = Grid::new(&[], layout, 0).expect("empty");
        assert_eq!(none.entries.len(), 0);
        assert_eq!(none.bytes(), 4 * 17);
    }

    #[test]
    fn density_gives_cells_a_triangle() {
        let cube = Aabb::new(Vec3::ZERO, Vec3::splat(1000.0));
        assert_eq!(cells_by_density(cube, 2000, 4.0), 20);
        assert_eq!(cells_by_density(cube, 0, 4.0), 1);
        assert_eq!(cells_by_density(cube, 1 << 30, 4.0), MOST_CELLS);
        let flat = Aabb::new(Vec3::ZERO, Vec3::new(1000.0, 1000.0, 0.0));
        let cells = cells_by_density(flat, 2000, 4.0);
        assert!((100..=MOST_CELLS).contains(&cells), "{cells}");
        assert_eq!(cells_by_density(Aabb::of([Vec3::ONE]), 5, 4.0), 1);
    }
}
