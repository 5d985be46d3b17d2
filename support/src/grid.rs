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
mod tests;
