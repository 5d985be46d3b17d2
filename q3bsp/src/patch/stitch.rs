//! Patches that touch get the same points on their common edges.

use super::{MAX_GRID_SIZE, PatchMesh, normals};
use crate::lumps::DrawVert;
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

    /// `None` beyond the end of the edge.
    fn edge_point(&self, edge: Edge, k: usize) -> Option<Vec3> {
        let (row, column) = match (edge.along_row, edge.last) {
            (true, false) => (0, k),
            (true, true) => (self.height - 1, k),
            (false, false) => (k, 0),
            (false, true) => (k, self.width - 1),
        };
        let vertex = self.vertices.get(row * self.width + column)?;
        Some(vertex.position)
    }

    /// Errors of the points of an edge.
    fn edge_errors(&self, edge: Edge) -> &[f32] {
        if edge.along_row {
            &self.column_errors
        } else {
            &self.row_errors
        }
    }

    fn edge_errors_mut(&mut self, edge: Edge) -> &mut Vec<f32> {
        if edge.along_row {
            &mut self.column_errors
        } else {
            &mut self.row_errors
        }
    }

    /// Whether two inner points of an edge coincide: it is bent back on itself or collapsed.
    fn edge_is_merged(&self, edge: Edge) -> bool {
        let last = self.edge_length(edge) - 1;
        (1..last).any(|i| {
            let point = self.edge_point(edge, i);
            (i + 1..last).any(|j| {
                let both = point.zip(self.edge_point(edge, j));
                both.is_some_and(|(a, b)| same(a, b))
            })
        })
    }

    /// The vertices with a line of points inserted before line `at` of those that cross `edge`, half way between its
    /// neighbours, except for the point on the edge itself. `None` unless the line has a neighbour on either side.
    fn with_line(&self, edge: Edge, at: usize, point: Vec3) -> Option<Vec<DrawVert>> {
        let (width, height) = (self.width, self.height);
        let between = |across: usize, count: usize, before: &DrawVert, after: &DrawVert| {
            let mut new = before.halfway(after);
            if across == if edge.last { count - 1 } else { 0 } {
                new.position = point;
            }
            new
        };
        let mut vertices = Vec::with_capacity(self.vertices.len() + width.max(height));
        if edge.along_row {
            for (row, points) in self.vertices.chunks_exact(width).enumerate() {
                let (head, tail) = points.split_at_checked(at)?;
                vertices.extend_from_slice(head);
                vertices.push(between(row, height, head.last()?, tail.first()?));
                vertices.extend_from_slice(tail);
            }
        } else {
            let (head, tail) = self.vertices.split_at_checked(at * width)?;
            let before = head.get(head.len().checked_sub(width)?..)?;
            let after = tail.get(..width)?;
            vertices.extend_from_slice(head);
            let pairs = before.iter().zip(after).enumerate();
            vertices.extend(pairs.map(|(column, (a, b))| between(column, width, a, b)));
            vertices.extend_from_slice(tail);
        }
        Some(vertices)
    }

    /// Inserts the line of [`Self::with_line`]; false when there is no room for it.
    fn insert_line(&mut self, edge: Edge, at: usize, point: Vec3, error: f32) -> bool {
        let Some(vertices) = self.with_line(edge, at, point) else {
            return false;
        };
        self.vertices = vertices;
        self.width += usize::from(edge.along_row);
        self.height += usize::from(!edge.along_row);
        self.edge_errors_mut(edge).insert(at, error);
        normals::recompute(self);
        true
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
            let done = grids.get_mut(from).map(|grid| &mut grid.done);
            if done.is_none_or(|done| std::mem::replace(done, true)) {
                continue;
            }
            changed = true;
            for to in 0..grids.len() {
                if !budget.take(|budget| &mut budget.comparisons, 1) {
                    return;
                }
                while let Some(missing) = meeting(grids, from, to, budget)
                    .and_then(|(from, to)| missing_point(from.mesh, to.mesh))
                    && let Some(grid) = grids.get_mut(to)
                {
                    let Missing {
                        edge,
                        at,
                        point,
                        error,
                    } = missing;
                    if !grid.mesh.insert_line(edge, at, point, error) {
                        break;
                    }
                    let across = if edge.along_row {
                        grid.mesh.height
                    } else {
                        grid.mesh.width
                    };
                    if !budget.take(|budget| &mut budget.new_vertices, across as u64) {
                        return;
                    }
                    grid.measure();
                    grid.done = false;
                }
            }
        }
    }
}

/// Two grids, if they touch and the budget allows to compare their edges.
fn meeting<'a, 'b>(
    grids: &'a [Grid<'b>],
    from: usize,
    to: usize,
    budget: &mut Budget,
) -> Option<(&'a Grid<'b>, &'a Grid<'b>)> {
    let (from, to) = (grids.get(from)?, grids.get(to)?);
    (from.touches(to) && budget.compare(from.mesh, to.mesh)).then_some((from, to))
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
                let start_point = from.edge_point(from_edge, k)?;
                let end_point = from.edge_point(from_edge, end)?;
                for edge in EDGES {
                    if to.edge_length(edge) >= MAX_GRID_SIZE {
                        continue;
                    }
                    for l in 0..to.edge_length(edge) - 1 {
                        let (here, next) = (to.edge_point(edge, l)?, to.edge_point(edge, l + 1)?);
                        if same(start_point, here)
                            && same(end_point, next)
                            && (here - next).abs().max_element() >= NO_ROOM
                        {
                            return Some(Missing {
                                edge,
                                at: l + 1,
                                point: from.edge_point(from_edge, middle)?,
                                error: *from.edge_errors(from_edge).get(middle)?,
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
        let done = grids.get_mut(first).map(|grid| &mut grid.done);
        if done.is_none_or(|done| std::mem::replace(done, true)) {
            continue;
        }
        let mut path = vec![(first, first + 1)];
        while let Some((from, next)) = path.pop() {
            let hit = (next..grids.len()).find(|&to| {
                grids.get(to).is_some_and(|grid| !grid.done)
                    && budget.take(|budget| &mut budget.comparisons, 1)
                    && share_between(from, to, grids, budget)
            });
            if let Some(to) = hit {
                if let Some(grid) = grids.get_mut(to) {
                    grid.done = true;
                }
                path.push((from, to + 1));
                path.push((to, first + 1));
            }
        }
    }
}

/// Gives points of `to` the errors of the same points of `from`; false when they share none.
fn share_between(from: usize, to: usize, grids: &mut [Grid<'_>], budget: &mut Budget) -> bool {
    let copies = match meeting(grids, from, to, budget) {
        Some((from, to)) => shared_errors(from.mesh, to.mesh),
        None => return false,
    };
    let Some(grid) = grids.get_mut(to) else {
        debug_assert!(false, "grid {to} met another and does not exist");
        return false;
    };
    for &(edge, l, error) in &copies {
        if let Some(slot) = grid.mesh.edge_errors_mut(edge).get_mut(l) {
            *slot = error;
        }
    }
    !copies.is_empty()
}

/// For inner points of the edges of `b` that `a` has, too: the edge, the number on it, and the error in `a`.
fn shared_errors(a: &PatchMesh, b: &PatchMesh) -> Vec<(Edge, usize, f32)> {
    let mut copies = Vec::new();
    for from_edge in EDGES {
        if a.edge_is_merged(from_edge) {
            continue;
        }
        let last = a.edge_length(from_edge) - 1;
        let errors = a.edge_errors(from_edge).iter().enumerate();
        for (k, &error) in errors.take(last).skip(1) {
            let Some(point) = a.edge_point(from_edge, k) else {
                debug_assert!(false, "an edge has an error and no point {k}");
                continue;
            };
            for edge in EDGES {
                if b.edge_is_merged(edge) {
                    continue;
                }
                for l in 1..b.edge_length(edge) - 1 {
                    if b.edge_point(edge, l)
                        .is_some_and(|other| same(point, other))
                    {
                        copies.push((edge, l, error));
                    }
                }
            }
        }
    }
    copies
}
