//! Levels of detail of curves.
//!
//! The engine omits an inner row or column of a grid if its stored error exceeds a limit that falls with distance.
//! Loading makes an index list for every set of rows and columns that can result.

use glam::Vec3;
use q3bsp::PatchMesh;
use relight::world::WorldSurface;

/// Maximum number of indices of one curve's lists together. A curve that exceeds it omits some levels, towards the
/// finer side.
const MAX_INDICES: usize = 1 << 18;
/// Minimum number of levels of a curve that needs more than one.
const MIN_LEVELS: usize = 8;

/// One index list.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Level {
    /// Smallest limit that selects this list.
    from: f32,
    first_index: u32,
    index_count: u32,
}

/// The index lists of a curve, coarsest first.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchLod {
    origin: Vec3,
    radius: f32,
    levels: Vec<Level>,
    size: (usize, usize),
}

impl PatchLod {
    /// Appends the coarser lists of `mesh` to `indices`; the finest is the surface's own.
    pub(super) fn new(mesh: &PatchMesh, surface: &WorldSurface, indices: &mut Vec<u32>) -> Self {
        let mut errors: Vec<f32> = mesh
            .column_errors
            .iter()
            .chain(&mesh.row_errors)
            .copied()
            .filter(|e| e.is_finite())
            .collect();
        errors.push(0.0);
        errors.sort_unstable_by(f32::total_cmp);
        errors.dedup();
        let finest = errors.len() - 1;
        // keep the finest; if there are too many, keep every n-th from there
        let full = surface.num_indices.max(1) as usize;
        let most = (MAX_INDICES / full).max(MIN_LEVELS);
        let step = errors.len().div_ceil(most).max(1);
        let mut levels = Vec::new();
        let mut below = f32::NEG_INFINITY;
        for (i, &error) in errors.iter().enumerate() {
            if !(finest - i).is_multiple_of(step) {
                continue;
            }
            // a limit between the last kept error and this one selects this list from the first omitted error on
            let from = errors.iter().copied().find(|&e| e > below).unwrap_or(error);
            let level = if i == finest {
                Level {
                    from,
                    first_index: surface.first_index,
                    index_count: surface.num_indices,
                }
            } else {
                let list = mesh.indices_at(error);
                let first_index = u32::try_from(indices.len()).unwrap_or(u32::MAX);
                indices.extend(list.iter().map(|i| surface.first_vertex + i));
                Level {
                    from,
                    first_index,
                    index_count: u32::try_from(list.len()).unwrap_or(0),
                }
            };
            levels.push(level);
            below = error;
        }
        Self {
            origin: mesh.lod_origin,
            radius: mesh.lod_radius,
            levels,
            size: (mesh.width, mesh.height),
        }
    }

    /// The index range to draw. `depth`: distance of the level-of-detail origin along the view direction;
    /// `curve_error`: `r_lodCurveError`.
    pub fn choose(&self, depth: f32, curve_error: f32) -> (u32, u32) {
        let limit = curve_error / (depth.abs() - self.radius).max(1.0);
        let level = self
            .levels
            .iter()
            .rev()
            .find(|level| level.from <= limit)
            .or(self.levels.first());
        level.map_or((0, 0), |level| (level.first_index, level.index_count))
    }

    /// Centre of the level-of-detail group, model space.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Columns and rows of the full grid; its vertices are the surface's, row by row.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }
}
