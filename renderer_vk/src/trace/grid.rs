//! The uniform grid of the map for the grid tracer: size, bounds of its memory, its place on the device.

use glam::Vec3;
use shaders::trace_types::{BvhTriangle, GridRecord};
use support::Aabb;
use support::grid::{Grid, Layout, MOST_CELLS, cells_by_density};

use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// Cells a triangle of the automatic choice: within the 3 to 5 that the literature states (Cleary and Wyvill 1988; Wald
/// et al., Ray Tracing Animated Scenes using Coherent Grid Traversal, SIGGRAPH 2006: 5).
const DENSITY: f64 = 4.0;
/// Fewest cells of the automatic choice along the longest axis.
const FEWEST: u32 = 16;
/// Bytes of the lists of a grid at most.
const MOST_BYTES: usize = 256 << 20;

/// Why triangles have no grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// No triangle, or one too far from the origin.
    #[error("the map is empty or reaches too far from its origin")]
    Bounds,
    /// The lists would be too large.
    #[error("its lists would take more than {} MiB at {cells} cells along the longest axis", MOST_BYTES >> 20)]
    Bytes {
        /// Cells along the longest axis.
        cells: u32,
    },
}

/// Builds a grid over triangles. `cells`: along the longest axis; 0 chooses by the number of triangles.
///
/// # Errors
/// The bounds of a grid; with `cells` of 0 the memory alone is no reason, because fewer cells take less.
pub fn build(corners: &[[Vec3; 3]], cells: u32) -> Result<Grid, Unfit> {
    build_within(corners, cells, MOST_BYTES)
}

fn build_within(corners: &[[Vec3; 3]], cells: u32, most: usize) -> Result<Grid, Unfit> {
    let finite = corners.iter().filter(|c| c.iter().all(|p| p.is_finite()));
    let bounds = Aabb::of(finite.flatten().copied());
    let of = |cells| {
        let layout = Layout::around(bounds, cells).ok_or(Unfit::Bounds)?;
        let starts = (layout.cells() + 1) * size_of::<u32>();
        let room = most.checked_sub(starts).ok_or(Unfit::Bytes { cells })?;
        Grid::new(corners, layout, room / size_of::<u32>()).ok_or(Unfit::Bytes { cells })
    };
    if cells > 0 {
        return of(cells.min(MOST_CELLS));
    }
    let mut cells = cells_by_density(bounds, corners.len(), DENSITY).max(FEWEST);
    loop {
        match of(cells) {
            Err(Unfit::Bytes { .. }) if cells > 1 => cells = cells * 3 / 4,
            built => return built,
        }
    }
}

/// A grid on the device.
pub struct GridStructure {
    /// The `GridRecord`.
    pub record: Buffer,
    /// `BvhTriangle`s.
    pub triangles: Buffer,
    /// Bounds of all triangles, in the model's space.
    pub bounds: Aabb,
    /// Cells along each axis.
    pub cells: [u32; 3],
    starts: Buffer,
    entries: Buffer,
}

impl GridStructure {
    /// Uploads a grid over `triangles`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device, grid: &Grid, triangles: &[BvhTriangle]) -> Result<Self, Error> {
        let storage = BufferUsage::STORAGE;
        let starts = Buffer::with_data(device, "trace grid cells", storage, &grid.starts)?;
        let entries = Buffer::with_data(device, "trace grid lists", storage, &grid.entries)?;
        let Layout {
            origin,
            edge,
            counts,
            ..
        } = grid.layout;
        let record = GridRecord {
            starts: starts.address(),
            entries: entries.address(),
            origin,
            edge,
            counts: counts.to_array(),
            padding: 0,
        };
        let corners = triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
        Ok(Self {
            record: Buffer::with_data(device, "trace grid", storage, &[record])?,
            triangles: Buffer::with_data(device, "trace leafs", storage, triangles)?,
            bounds: Aabb::of(corners.filter(|corner| corner.is_finite())),
            cells: record.counts,
            starts,
            entries,
        })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let buffers = [&self.record, &self.triangles, &self.starts, &self.entries];
        buffers.into_iter().map(Buffer::size).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squares of a waved floor, two triangles each.
    fn floor(side: u32) -> Vec<[Vec3; 3]> {
        let at = |x: u32, y: u32| {
            let [x, y] = [x, y].map(|v| v as f32 * 10.0);
            Vec3::new(x, y, 30.0 * (0.1 * x).sin() * (0.07 * y).cos())
        };
        let squares = (0..side).flat_map(|x| (0..side).map(move |y| (x, y)));
        squares
            .flat_map(|(x, y)| {
                let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
                [[a, b, c], [b, d, c]]
            })
            .collect()
    }

    #[test]
    fn the_number_of_cells_is_chosen_or_given() {
        let corners = floor(40);
        for (cells, expected) in [(7, 7), (256, 256), (1000, 256)] {
            let grid = build(&corners, cells).expect("small");
            assert_eq!(grid.layout.counts.max_element(), expected);
        }
        let chosen = build(&corners, 0).expect("small");
        let per_triangle = chosen.layout.cells() as f64 / corners.len() as f64;
        assert!((2.0..8.0).contains(&per_triangle), "{per_triangle}");
        assert_eq!(
            build(&floor(1), 0).map(|g| g.layout.counts.max_element()),
            Ok(FEWEST)
        );
    }

    #[test]
    fn memory_is_bounded() {
        let corners = floor(40);
        let (cells, most) = (128, 200_000);
        let refused = build_within(&corners, cells, most);
        assert_eq!(refused, Err(Unfit::Bytes { cells }));
        let text = Unfit::Bytes { cells }.to_string();
        assert_eq!(
            text,
            "its lists would take more than 256 MiB at 128 cells along the longest axis"
        );
        let chosen = build_within(&corners, 0, 30_000).expect("fewer cells");
        assert!(chosen.bytes() <= 30_000);
        let freely = build(&corners, 0).expect("small");
        assert!(chosen.layout.cells() < freely.layout.cells());
    }

    #[test]
    fn nothing_and_the_far_away_have_no_grid() {
        let far = [[Vec3::ZERO, Vec3::X * 1.0e9, Vec3::Y]];
        let nowhere = [[Vec3::NAN; 3]];
        for corners in [&[][..], &far, &nowhere] {
            assert_eq!(build(corners, 0), Err(Unfit::Bounds));
        }
    }
}
