//! Patches that touch get the same points on their common edges.

use super::{MAX_GRID_SIZE, PatchMesh, normals};
use glam::Vec3;
use std::collections::BTreeMap;

/// Points closer than this on every axis are the same, id units.
const SAME: f32 = 0.1;

/// An edge with both ends closer than this on every axis has no room for a point.
const NO_ROOM: f32 = 0.01;

/// Comparisons of points that one map may cost. Shipped maps need about a hundredth; a hostile one
/// could ask for the square of its size.
const MAX_COMPARISONS: u64 = 1_000_000_000;

/// What may still be spent on a map.
struct Budget {
    comparisons: u64,
    new_vertices: u64,
}

impl Budget {
    /// Takes what it costs to compare the edges of two meshes; false when it is not there any more.
    fn compare(&mut self, a: &PatchMesh, b: &PatchMesh) -> bool {
        let edges = |mesh: &PatchMesh| 2 * (mesh.width + mesh.height) as u64;
        self.take(|budget| &mut budget.comparisons, edges(a) * edges(b))
    }

    fn take(&mut self, which: impl Fn(&mut Self) -> &mut u64, cost: u64) -> bool {
        let left = which(self);
        let rest = left.checked_sub(cost);
        *left = rest.unwrap_or(0);
        rest.is_some()
    }

    fn is_spent(&self) -> bool {
        self.comparisons == 0 || self.new_vertices == 0
    }
}

/// One of the four edges of a grid.
#[derive(Clone, Copy)]
struct Edge {
    /// Runs along a row, so that its points are columns.
    along_row: bool,
    /// The last row (or column) rather than the first.
    last: bool,
}

/// The order in which edges are looked at.
const EDGES: [Edge; 4] = [
    Edge {
        along_row: true,
        last: false,
    },
    Edge {
        along_row: true,
        last: true,
    },
    Edge {
        along_row: false,
        last: false,
    },
    Edge {
        along_row: false,
        last: true,
    },
];

impl PatchMesh {
    fn edge_length(&self, edge: Edge) -> usize {
        if edge.along_row {
            self.width
        } else {
            self.height
        }
    }

    fn edge_point(&self, edge: Edge, k: usize) -> Vec3 {
        let (row, column) = match (edge.along_row, edge.last) {
            (true, false) => (0, k),
            (true, true) => (self.height - 1, k),
            (false, false) => (k, 0),
            (false, true) => (k, self.width - 1),
        };
        self.vertices[row * self.width + column].position
    }

    fn edge_error(&self, edge: Edge, k: usize) -> f32 {
        let errors = if edge.along_row {
            &self.column_errors
        } else {
            &self.row_errors
        };
        errors[k]
    }

    /// Whether two inner points of an edge coincide: it is bent back on itself or collapsed.
    fn edge_is_merged(&self, edge: Edge) -> bool {
        let last = self.edge_length(edge) - 1;
        (1..last).any(|i| {
            (i + 1..last).any(|j| same(self.edge_point(edge, i), self.edge_point(edge, j)))
        })
    }

    /// Inserts a line of points before line `at` of those that cross `edge`, half way between its
    /// neighbours, except for the point on the edge itself.
    fn insert_line(&mut self, edge: Edge, at: usize, point: Vec3, error: f32) {
        let (width, height) = (self.width, self.height);
        let new_width = width + usize::from(edge.along_row);
        let new_height = height + usize::from(!edge.along_row);
        let mut vertices = Vec::with_capacity(new_width * new_height);
        for row in 0..new_height {
            for column in 0..new_width {
                let (line, across) = if edge.along_row {
                    (column, row)
                } else {
                    (row, column)
                };
                let old = |line: usize| {
                    let at = if edge.along_row {
                        row * width + line
                    } else {
                        line * width + column
                    };
                    self.vertices[at]
                };
                vertices.push(if line == at {
                    let mut new = old(line - 1).halfway(&old(line));
                    let on_edge = if edge.last {
                        across + 1 == if edge.along_row { height } else { width }
                    } else {
                        across == 0
                    };
                    if on_edge {
                        new.position = point;
                    }
                    new
                } else {
                    old(if line < at { line } else { line - 1 })
                });
            }
        }
        self.vertices = vertices;
        self.width = new_width;
        self.height = new_height;
        let errors = if edge.along_row {
            &mut self.column_errors
        } else {
            &mut self.row_errors
        };
        errors.insert(at, error);
        normals::recompute(self);
    }
}

fn same(a: Vec3, b: Vec3) -> bool {
    (a - b).abs().max_element() <= SAME
}

/// A mesh under work.
struct Grid<'a> {
    mesh: &'a mut PatchMesh,
    mins: Vec3,
    maxs: Vec3,
    done: bool,
}

impl Grid<'_> {
    fn new(mesh: &mut PatchMesh) -> Grid<'_> {
        let mut grid = Grid {
            mesh,
            mins: Vec3::ZERO,
            maxs: Vec3::ZERO,
            done: false,
        };
        grid.measure();
        grid
    }

    fn measure(&mut self) {
        self.mins = self
            .mesh
            .vertices
            .iter()
            .fold(Vec3::INFINITY, |m, v| m.min(v.position));
        self.maxs = self
            .mesh
            .vertices
            .iter()
            .fold(Vec3::NEG_INFINITY, |m, v| m.max(v.position));
    }

    /// Whether points of the two can be the same.
    fn touches(&self, other: &Grid<'_>) -> bool {
        (self.mins - SAME).cmple(other.maxs).all() && (other.mins - SAME).cmple(self.maxs).all()
    }
}

/// Stitches all meshes and makes touching edges agree on their LOD errors. Only meshes of one LOD group
/// meet, because others change their detail at different distances. A map that would take too long or
/// grow too much is left with cracks where the work ended, which is logged.
pub(super) fn stitch(meshes: &mut [Option<PatchMesh>]) {
    let mut groups: BTreeMap<[u32; 4], Vec<Grid<'_>>> = BTreeMap::new();
    for mesh in meshes.iter_mut().flatten() {
        // Adding zero makes -0 and 0 the same key.
        let key = [
            mesh.lod_origin.x,
            mesh.lod_origin.y,
            mesh.lod_origin.z,
            mesh.lod_radius,
        ];
        groups
            .entry(key.map(|v| (v + 0.0).to_bits()))
            .or_default()
            .push(Grid::new(mesh));
    }
    let mut budget = Budget {
        comparisons: MAX_COMPARISONS,
        new_vertices: super::MAX_TOTAL_VERTICES as u64,
    };
    for grids in groups.values_mut() {
        stitch_group(grids, &mut budget);
        share_errors(grids, &mut budget);
    }
    if budget.is_spent() {
        log::warn!("too many patches touch each other; some are not stitched");
    }
}

/// Goes over the group until nothing changes. Every insertion grows a grid, which ends at
/// [`MAX_GRID_SIZE`].
fn stitch_group(grids: &mut [Grid<'_>], budget: &mut Budget) {
    let mut changed = true;
    while changed {
        changed = false;
        for from in 0..grids.len() {
            if std::mem::replace(&mut grids[from].done, true) {
                continue;
            }
            changed = true;
            for to in 0..grids.len() {
                if !budget.take(|budget| &mut budget.comparisons, 1) {
                    return;
                }
                while grids[from].touches(&grids[to])
                    && budget.compare(grids[from].mesh, grids[to].mesh)
                {
                    let Some(missing) = missing_point(grids[from].mesh, grids[to].mesh) else {
                        break;
                    };
                    let Missing {
                        edge,
                        at,
                        point,
                        error,
                    } = missing;
                    grids[to].mesh.insert_line(edge, at, point, error);
                    let across = if edge.along_row {
                        grids[to].mesh.height
                    } else {
                        grids[to].mesh.width
                    };
                    if !budget.take(|budget| &mut budget.new_vertices, across as u64) {
                        return;
                    }
                    grids[to].measure();
                    grids[to].done = false;
                }
            }
        }
    }
}

/// A point that one grid lacks on one of its edges.
struct Missing {
    edge: Edge,
    at: usize,
    point: Vec3,
    error: f32,
}

/// The first point of `from` that lies between two points which `to` has as neighbours on an edge.
fn missing_point(from: &PatchMesh, to: &PatchMesh) -> Option<Missing> {
    for descending in [false, true] {
        for from_edge in EDGES {
            if from.edge_is_merged(from_edge) {
                continue;
            }
            let length = from.edge_length(from_edge);
            for step in (0..length.saturating_sub(2)).step_by(2) {
                let (k, middle, end) = if descending {
                    (length - 1 - step, length - 2 - step, length - 3 - step)
                } else {
                    (step, step + 1, step + 2)
                };
                let start_point = from.edge_point(from_edge, k);
                let end_point = from.edge_point(from_edge, end);
                for edge in EDGES {
                    if to.edge_length(edge) >= MAX_GRID_SIZE {
                        continue;
                    }
                    for l in 0..to.edge_length(edge) - 1 {
                        let (here, next) = (to.edge_point(edge, l), to.edge_point(edge, l + 1));
                        if same(start_point, here)
                            && same(end_point, next)
                            && (here - next).abs().max_element() >= NO_ROOM
                        {
                            return Some(Missing {
                                edge,
                                at: l + 1,
                                point: from.edge_point(from_edge, middle),
                                error: from.edge_error(from_edge, middle),
                            });
                        }
                    }
                }
            }
        }
    }
    None
}

/// Spreads the errors of each grid to the points that others share with it, depth first, so that all
/// leave out the same points at the same distance.
fn share_errors(grids: &mut [Grid<'_>], budget: &mut Budget) {
    for grid in grids.iter_mut() {
        grid.done = false;
    }
    for first in 0..grids.len() {
        if std::mem::replace(&mut grids[first].done, true) {
            continue;
        }
        let mut path = vec![(first, first + 1)];
        while let Some((from, next)) = path.pop() {
            let hit = (next..grids.len()).find(|&to| {
                !grids[to].done
                    && budget.take(|budget| &mut budget.comparisons, 1)
                    && grids[from].touches(&grids[to])
                    && budget.compare(grids[from].mesh, grids[to].mesh)
                    && copy_errors(from, to, grids)
            });
            if let Some(to) = hit {
                grids[to].done = true;
                path.push((from, to + 1));
                path.push((to, first + 1));
            }
        }
    }
}

fn copy_errors(from: usize, to: usize, grids: &mut [Grid<'_>]) -> bool {
    let mut copies = Vec::new();
    let (a, b) = (&*grids[from].mesh, &*grids[to].mesh);
    for from_edge in EDGES {
        if a.edge_is_merged(from_edge) {
            continue;
        }
        for k in 1..a.edge_length(from_edge) - 1 {
            let point = a.edge_point(from_edge, k);
            for edge in EDGES {
                if b.edge_is_merged(edge) {
                    continue;
                }
                for l in 1..b.edge_length(edge) - 1 {
                    if same(point, b.edge_point(edge, l)) {
                        copies.push((edge, l, a.edge_error(from_edge, k)));
                    }
                }
            }
        }
    }
    let touched = !copies.is_empty();
    for (edge, l, error) in copies {
        let mesh = &mut *grids[to].mesh;
        let errors = if edge.along_row {
            &mut mesh.column_errors
        } else {
            &mut mesh.row_errors
        };
        errors[l] = error;
    }
    touched
}
