//! Decals: the parts of the world's surfaces inside a polygon that is swept along a direction.
//!
//! Source: engine behaviour of `MarkFragments`, its tolerances included.

use glam::Vec3;
use q3bsp::{Bsp, Plane, SurfaceId, SurfaceKind};
use shaders::types::Vertex;
use support::Aabb;
use support::slice;

use super::visible::Side;
use super::{WorldData, WorldSurface};
use crate::api::MarkFragment;
use crate::assets::Materials;

/// Maximum number of corners of the polygon and of a clipped piece.
const MAX_POINTS: usize = 64;
/// Maximum number of surfaces in one call.
const MAX_SURFACES: usize = 64;
/// Distance, units, within which a point counts as on a plane.
const EPSILON: f32 = 0.5;
/// Distance behind the polygon within which surfaces are marked, units.
const BEHIND: f32 = 20.0;
/// Distance along the projection within which surfaces are marked, units, regardless of the projection's length.
const AHEAD: f32 = 32.0;
/// Surface and content flags that prevent marks.
const NO_IMPACT: u32 = q3bsp::surface_flags::NOIMPACT | q3bsp::surface_flags::NOMARKS;

/// A clipping plane; it keeps the part in front of it.
#[derive(Clone, Copy, Debug)]
struct ClipPlane {
    normal: Vec3,
    dist: f32,
}

/// Clips surfaces to marks. Its memory is reused between calls.
#[derive(Debug, Default)]
pub struct Marker {
    out: Output,
    planes: Vec<ClipPlane>,
    found: Vec<SurfaceId>,
}

/// The result during its construction.
#[derive(Debug, Default)]
struct Output {
    points: Vec<Vec3>,
    fragments: Vec<MarkFragment>,
    max_points: usize,
    max_fragments: usize,
    /// The clipped part of the current triangle.
    piece: Vec<Vec3>,
    /// Output of the next clip.
    clipped: Vec<Vec3>,
}

impl Output {
    fn full(&self) -> bool {
        self.fragments.len() >= self.max_fragments
    }

    /// Adds the part of a triangle inside of the planes; omits a piece that exceeds the limits.
    fn add(&mut self, triangle: [Vec3; 3], planes: &[ClipPlane]) {
        self.piece.clear();
        self.piece.extend(triangle);
        for plane in planes {
            clip(&self.piece, plane, &mut self.clipped);
            std::mem::swap(&mut self.piece, &mut self.clipped);
            if self.piece.is_empty() {
                return;
            }
        }
        if self.points.len() + self.piece.len() > self.max_points {
            return;
        }
        self.fragments.push(MarkFragment {
            first_point: self.points.len(),
            num_points: self.piece.len(),
        });
        self.points.extend_from_slice(&self.piece);
    }
}

/// Surfaces that marks are projected on.
#[derive(Clone, Copy)]
pub struct Marked<'a> {
    /// The map.
    pub world: &'a WorldData,
    /// Its materials.
    pub materials: &'a Materials,
    /// Triangle meshes are marked, too.
    pub on_meshes: bool,
}

impl Marker {
    /// The pieces of the world's surfaces that lie under a polygon projected along `projection`: their corners and
    /// where each piece's corners begin. At most `max_points` and `max_fragments` are returned.
    pub fn mark(
        &mut self,
        marked: Marked<'_>,
        points: &[Vec3],
        projection: Vec3,
        max_points: usize,
        max_fragments: usize,
    ) -> (&[Vec3], &[MarkFragment]) {
        let out = &mut self.out;
        out.points.clear();
        out.fragments.clear();
        (out.max_points, out.max_fragments) = (max_points, max_fragments);
        let points = slice::part(points, ..points.len().min(MAX_POINTS));
        let finite = projection.is_finite() && points.iter().all(|p| p.is_finite());
        if let Some(&first) = points.first().filter(|_| finite && max_fragments > 0) {
            let direction = projection.normalize_or_zero();
            let bounds = points.iter().fold(Aabb::EMPTY, |bounds, &point| {
                bounds
                    .with(point)
                    .with(point + projection)
                    .with(point - BEHIND * direction)
            });
            clip_planes(points, projection, direction, first, &mut self.planes);
            candidates(&marked, &bounds, direction, &mut self.found);
            let surfaces = &marked.world.surfaces;
            for surface in self
                .found
                .iter()
                .filter_map(|id| slice::get(surfaces, id.index()))
            {
                mark_surface(marked, surface, direction, &self.planes, out);
                if out.full() {
                    break;
                }
            }
        }
        (&out.points, &out.fragments)
    }
}

/// One plane for each side of the polygon, and one for each end of the sweep.
fn clip_planes(
    points: &[Vec3],
    projection: Vec3,
    direction: Vec3,
    first: Vec3,
    planes: &mut Vec<ClipPlane>,
) {
    let next = points.iter().cycle().skip(1);
    planes.clear();
    planes.extend(points.iter().zip(next).map(|(&a, &b)| {
        let normal = (b - a).cross(-projection).normalize_or_zero();
        ClipPlane {
            normal,
            dist: normal.dot(a),
        }
    }));
    let at = direction.dot(first);
    planes.push(ClipPlane {
        normal: direction,
        dist: at - AHEAD,
    });
    planes.push(ClipPlane {
        normal: -direction,
        dist: -at - BEHIND,
    });
}

/// Surfaces of the leafs that touch the box and that can be marked, each once.
fn candidates(marked: &Marked<'_>, bounds: &Aabb, direction: Vec3, found: &mut Vec<SurfaceId>) {
    let (world, materials) = (marked.world, marked.materials);
    let bsp = &world.relit.bsp;
    found.clear();
    world.tree.leafs_in_box(bsp, bounds, |leaf| {
        for &id in bsp.leaf_surface_ids(bsp.leaf(leaf)) {
            if found.len() >= MAX_SURFACES {
                return;
            }
            let Some(surface) = slice::get(&world.surfaces, id.index()) else {
                continue;
            };
            if found.contains(&id) || surface.model != 0 {
                continue;
            }
            let material = materials.get(surface.material);
            if material.surface_flags & NO_IMPACT != 0
                || material.content_flags & q3bsp::content_flags::FOG != 0
            {
                continue;
            }
            let taken = match surface.kind {
                SurfaceKind::Planar => stored_plane(&world.relit.bsp, id).is_some_and(|plane| {
                    let side = Side::of(bounds, plane.normal, plane.dist);
                    side.front && side.back && plane.normal.dot(direction) <= -0.5
                }),
                SurfaceKind::Patch | SurfaceKind::TriangleSoup => true,
                _ => false,
            };
            if taken {
                found.push(id);
            }
        }
    });
}

/// The plane as the map stores it. Map compilers store a zero plane for merged surfaces; the engine does not mark
/// those.
fn stored_plane(bsp: &Bsp, id: SurfaceId) -> Option<Plane> {
    let stored = bsp.surface(id);
    let normal = stored.lightmap_vecs[2];
    let first = bsp.surface_vertices(stored).first()?.position;
    let dist = normal.dot(first);
    (normal != Vec3::ZERO && normal.is_finite() && dist.is_finite())
        .then_some(Plane { normal, dist })
}

fn mark_surface(
    marked: Marked<'_>,
    surface: &WorldSurface,
    direction: Vec3,
    planes: &[ClipPlane],
    out: &mut Output,
) {
    let Marked {
        world, on_meshes, ..
    } = marked;
    match surface.kind {
        SurfaceKind::Patch => mark_curve(world, surface, direction, planes, out),
        SurfaceKind::Planar => {
            for triangle in world.triangles(surface.first_index, surface.index_count) {
                out.add(triangle, planes);
                if out.full() {
                    return;
                }
            }
        }
        SurfaceKind::TriangleSoup if on_meshes => {
            for triangle in world.triangles(surface.first_index, surface.index_count) {
                out.add(triangle, planes);
                if out.full() {
                    return;
                }
            }
        }
        _ => {}
    }
}

/// Both triangles of every cell of the full grid, if they face the mark.
fn mark_curve(
    world: &WorldData,
    surface: &WorldSurface,
    direction: Vec3,
    planes: &[ClipPlane],
    out: &mut Output,
) {
    let Some(lod) = &surface.lod else {
        return; // nothing of the patch is drawn, or its points make no grid
    };
    let (width, height) = lod.size();
    let vertices = world.surface_vertices(surface);
    let at = |row: usize, column: usize| {
        vertices
            .get(row * width + column)
            .map_or(Vec3::ZERO, |v: &Vertex| v.position)
    };
    for row in 0..height.saturating_sub(1) {
        for column in 0..width.saturating_sub(1) {
            let cell = [
                (
                    [at(row, column), at(row + 1, column), at(row, column + 1)],
                    -0.1,
                ),
                (
                    [
                        at(row, column + 1),
                        at(row + 1, column),
                        at(row + 1, column + 1),
                    ],
                    -0.05,
                ),
            ];
            for (triangle, limit) in cell {
                let [a, b, c] = triangle;
                let normal = (a - b).cross(c - b).normalize_or_zero();
                if normal.dot(direction) < limit {
                    out.add(triangle, planes);
                    if out.full() {
                        return;
                    }
                }
            }
        }
    }
}

/// Clips a convex polygon to the front of a plane, into `out`. Points within [`EPSILON`] of the plane are kept
/// unchanged.
fn clip(polygon: &[Vec3], plane: &ClipPlane, out: &mut Vec<Vec3>) {
    out.clear();
    if polygon.len() >= MAX_POINTS - 2 {
        return;
    }
    let distance = |p: Vec3| plane.normal.dot(p) - plane.dist;
    if !polygon.iter().any(|&p| distance(p) > EPSILON) {
        return;
    }
    if !polygon.iter().any(|&p| distance(p) < -EPSILON) {
        out.extend_from_slice(polygon);
        return;
    }
    for (&a, &b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (da, db) = (distance(a), distance(b));
        if da >= -EPSILON {
            out.push(a);
        }
        let crosses = (da > EPSILON && db < -EPSILON) || (da < -EPSILON && db > EPSILON);
        if crosses {
            out.push(a + (b - a) * (da / (da - db)));
        }
    }
}
