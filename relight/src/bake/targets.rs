//! Where a map stores light, and the points that stand for each place.

use super::coverage::{INSET, PageTriangle, Place, Square, places};
use super::solids::Solids;
use super::{LitTriangle, Point};
use crate::world::{RelitWorld, WorldMaterial, WorldSurface};
use glam::Vec3;
use q3bsp::SurfaceKind;
use std::collections::HashSet;
use std::ops::Range;
use support::parallel;
use support::slice::{self, span};

/// Distance of a point from its surface, id units: as compilers have it.
pub(super) const LIFT: f32 = 1.0;

/// Depth inside a brush from which a point is inside, id units, negative inside.
const INSIDE: f32 = -0.5;

/// Distances by which a point inside of something solid is moved towards the middle of its triangle, id units.
const MOVES: [f32; 2] = [2.0, 5.0];

/// Distance beside a surface of a brush model at which a point is searched if the surface lies in solid, as those of doors
/// in their frames do, id units.
const BESIDE: f32 = 8.0;

/// Places that one task searches.
const TASK: usize = 1024;

/// A texel that surfaces cover.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Texel {
    /// Index in its page, row by row.
    pub at: u32,
    /// Surface that covers it.
    pub surface: u32,
    /// Its points in [`Targets::points`]; none if all lay in solid.
    pub points: Range<u32>,
}

/// A page that surfaces use.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Page {
    /// Number, as [`RelitWorld::page`] counts.
    pub number: usize,
    /// Texels per side.
    pub side: usize,
    /// Index of its first texel in the light of all places.
    pub first: usize,
    /// Its covered texels, ascending.
    pub texels: Vec<Texel>,
}

/// A vertex that stores light.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Vertex {
    /// Index into the map's vertices.
    pub vertex: u32,
    /// Index into [`RelitWorld::vertices`], for vertices that are drawn where they are stored.
    pub drawn: Option<u32>,
    /// Its surface.
    pub surface: u32,
    /// Its point in [`Targets::points`]; empty if it lies in solid.
    pub points: Range<u32>,
}

/// Where a map stores light.
#[derive(Debug, Clone, Default)]
pub(super) struct Targets {
    /// Points whose light is wanted.
    pub points: Vec<Point>,
    pub pages: Vec<Page>,
    /// Vertices of surfaces that are lit by vertex.
    pub vertices: Vec<Vertex>,
    /// Where the light of each triangle is.
    pub lit: Vec<LitTriangle>,
    /// Number of places: texels of all pages, then the world's vertices.
    pub places: usize,
    /// Number of texels of all pages.
    pub texels: usize,
}

/// Whether a surface shows the light of its page or its vertices.
fn shows_light(world: &RelitWorld, surface: &WorldSurface) -> bool {
    let lit = |material: &WorldMaterial| !material.is_sky();
    world.material_of(surface).is_some_and(lit)
}

/// Whether a surface's light is stored at its vertices.
fn is_lit_by_vertex(surface: &WorldSurface) -> bool {
    surface.light_page == q3bsp::lightmap_index::BY_VERTEX
        && surface.num_indices > 0
        && !matches!(surface.kind, SurfaceKind::Flare | SurfaceKind::Foliage)
}

impl Targets {
    /// The texels and vertices of a world. `pattern`: points along each side of a texel.
    pub fn of(world: &RelitWorld, pattern: u32) -> Targets {
        let mut targets = Targets {
            lit: vec![LitTriangle::Dark; world.indices.len() / 3],
            ..Targets::default()
        };
        let space = FreeSpace::of(world);
        targets.add_pages(world, &space, pattern);
        targets.texels = targets.places;
        targets.add_vertices(world, &space);
        targets.places += world.vertices.len();
        targets
    }

    fn add_pages(&mut self, world: &RelitWorld, space: &FreeSpace<'_>, pattern: u32) {
        let count = world.bsp.lightmaps.len() + world.pages.len();
        let mut of_page: Vec<Vec<(u32, PageTriangle)>> = vec![Vec::new(); count];
        let mut sides = vec![0; count];
        let mut first = Vec::with_capacity(count);
        for (number, slot) in sides.iter_mut().enumerate() {
            *slot = world.page(number).map_or(0, q3bsp::Lightmap::size);
            first.push(self.places);
            self.places += *slot * *slot;
        }
        for (index, surface) in (0u32..).zip(&world.surfaces) {
            let Some(page) = usize::try_from(surface.light_page).ok() else {
                continue;
            };
            let side = slice::item(&sides, page);
            if side == 0 || !shows_light(world, surface) {
                continue;
            }
            let ends = ends(world, surface);
            for (number, ends) in surface.triangles().zip(ends) {
                let Some(triangle) = PageTriangle::new(world.corners(number), ends, side) else {
                    continue;
                };
                if let Some(slot) = self.lit.get_mut(number) {
                    *slot = LitTriangle::Texels {
                        first: slice::item(&first, page) as u32,
                        side: side as u32,
                        corners: triangle.corners(),
                    };
                }
                if let Some(list) = of_page.get_mut(page) {
                    list.push((index, triangle));
                }
            }
        }
        // the one point of a texel lies where the compiler has it
        let as_compiler = pattern == 1 && world.has_compiled_lights;
        let found = parallel::map(&of_page, |page, triangles| {
            places(slice::item(&sides, page), pattern, triangles)
        });
        // pages differ in size, and a map may have one alone
        let tasks: Vec<&[Place]> = found.iter().flat_map(|p| p.chunks(TASK)).collect();
        let free = |place: &Place| match as_compiler {
            true => space.compiler_point(place).or_else(|| space.point(place)),
            false => space.point(place),
        };
        let free = |_, some: &&[Place]| some.iter().map(free).collect();
        let mut points = parallel::map(&tasks, free)
            .into_iter()
            .flat_map(|found: Vec<Option<Point>>| found);
        for (number, places) in found.iter().enumerate() {
            let mut texels: Vec<Texel> = Vec::new();
            for (place, point) in places.iter().zip(points.by_ref()) {
                if texels.last().is_none_or(|texel| texel.at != place.texel) {
                    let start = self.points.len() as u32;
                    texels.push(Texel {
                        at: place.texel,
                        surface: place.surface,
                        points: start..start,
                    });
                }
                if let Some(texel) = texels.last_mut() {
                    let rank = texel.points.len() as u32;
                    self.points
                        .extend(point.map(|point| Point { rank, ..point }));
                    texel.points.end = self.points.len() as u32;
                }
            }
            if !texels.is_empty() {
                self.pages.push(Page {
                    number,
                    side: slice::item(&sides, number),
                    first: slice::item(&first, number),
                    texels,
                });
            }
        }
    }

    fn add_vertices(&mut self, world: &RelitWorld, space: &FreeSpace<'_>) {
        let base = self.places as u32;
        let mut all = Vec::new();
        for (index, surface) in (0u32..).zip(&world.surfaces) {
            if !is_lit_by_vertex(surface) || !shows_light(world, surface) {
                continue;
            }
            let Some(stored) = world.bsp.surfaces.get(index as usize) else {
                continue;
            };
            let drawn = !matches!(surface.kind, SurfaceKind::Patch);
            let made = world.vertices_of(surface);
            let middle = (surface.mins + surface.maxs) * 0.5;
            for (k, raw) in (0u32..).zip(world.bsp.surface_vertices(stored)) {
                let own = made.get(k as usize).filter(|_| drawn);
                let clean = raw.finite();
                let place = Place {
                    texel: 0,
                    surface: index,
                    // a corner lies in the planes of adjacent walls
                    position: own
                        .map_or(clean.position, |v| v.position)
                        .move_towards(middle, INSET),
                    normal: own.map_or(clean.normal.normalize_or(Vec3::Z), |v| v.normal),
                    middle,
                    square: Square::default(),
                };
                all.push((
                    place,
                    stored.first_vert.max(0) as u32 + k,
                    drawn.then_some(surface.first_vertex + k),
                ));
            }
            if drawn {
                for number in surface.triangles() {
                    let corners = span(number as u32 * 3, 3);
                    if let Some(&[a, b, c]) = world.indices.get(corners)
                        && let Some(slot) = self.lit.get_mut(number)
                    {
                        *slot = LitTriangle::Vertices([a, b, c].map(|corner| base + corner));
                    }
                }
            }
        }
        let points = parallel::map(&all, |_, (place, ..)| space.point(place));
        for ((place, vertex, drawn), point) in all.into_iter().zip(points) {
            let start = self.points.len() as u32;
            self.points.extend(point);
            self.vertices.push(Vertex {
                vertex,
                drawn,
                surface: place.surface,
                points: start..self.points.len() as u32,
            });
        }
    }
}

/// For each triangle of a surface: whether the surface ends at the edge from each corner to the next.
fn ends(world: &RelitWorld, surface: &WorldSurface) -> Vec<[bool; 3]> {
    // corners at one place are one, whatever their number
    let place = |corner: u32| {
        let vertex = slice::item(&world.vertices, corner as usize);
        vertex.position.to_array().map(|x| (x + 0.0).to_bits())
    };
    let edges = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(place);
        [(a, b), (b, c), (c, a)]
    };
    let triangles = world.indices_of(surface).as_chunks::<3>().0;
    let all: HashSet<_> = triangles.iter().flat_map(edges).collect();
    let ends = |corners: &[u32; 3]| edges(corners).map(|(a, b)| !all.contains(&(b, a)));
    triangles.iter().map(ends).collect()
}

/// Space of a world in which points may lie.
pub(super) struct FreeSpace<'a> {
    pub(super) world: &'a RelitWorld,
    solids: Solids<'a>,
    /// Whether the map has a tree that separates space from solid.
    has_leafs: bool,
}

impl<'a> FreeSpace<'a> {
    /// That of a world.
    pub fn of(world: &'a RelitWorld) -> FreeSpace<'a> {
        FreeSpace {
            world,
            solids: Solids::of(&world.bsp),
            has_leafs: world.bsp.visibility.is_some() || world.bsp.leafs.len() > 1,
        }
    }

    /// Whether a position is inside of the map and of nothing solid.
    pub fn has(&self, position: Vec3) -> bool {
        self.is_inside(position) && !self.solids.hold(position, INSIDE)
    }

    /// Whether a position is inside of the map.
    pub(super) fn is_inside(&self, position: Vec3) -> bool {
        position.is_finite() && (!self.has_leafs || self.world.bsp.cluster_at(position) >= 0)
    }

    /// The point of a place: above its surface, moved towards the middle of its triangle if that lies in solid, on brush
    /// models also beside it. `None` if none of these is free.
    fn point(&self, place: &Place) -> Option<Point> {
        let world = self.world;
        let surface = world.surfaces.get(place.surface as usize)?;
        let model = world.models.get(surface.model as usize);
        let origin = model.map_or(Vec3::ZERO, |m| m.origin);
        let normal = place.normal;
        let lift = origin + normal * LIFT;
        let to_middle = place.middle - place.position;
        let moved = |step: f32| place.position + to_middle.clamp_length_max(step);
        let places = std::iter::once(place.position).chain(MOVES.map(moved));
        let mut points = places.map(|on| Point::new(on + lift, normal));
        let found = points.find(|point| self.has(point.position));
        if surface.model == 0 {
            return found;
        }
        let (u, v) = normal.any_orthonormal_pair();
        let mut beside = [u, -u, v, -v]
            .map(|along| Point::new(place.position + along * BESIDE + lift, normal))
            .into_iter();
        found.or_else(|| beside.find(|point| self.has(point.position)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::tests::{baked, plain, room, world};

    #[test]
    fn a_door_in_its_frame_is_lit_from_beside() {
        // a plate that ends at a step as high as itself
        let light = [
            ("classname", "light"),
            ("origin", "350 0 90"),
            ("light", "300"),
        ];
        let world = world(&room(&[&light], |map| {
            let wall = map.add_shader("t/wall", 0, 1);
            let step = Vec3::new(256.0, -256.0, 4.0);
            map.add_room(wall, step, Vec3::new(512.0, 256.0, 256.0));
            map.begin_model();
            let plate = [Vec3::new(100.0, -50.0, 0.0), Vec3::new(256.0, 50.0, 4.0)];
            for face in map.add_box_faces(wall, plate[0], plate[1], false) {
                let page = map.add_lightmap([0; 3]);
                map.set_lightmap(face, page);
            }
        }));
        let end = |s: &&WorldSurface| s.model == 1 && s.plane.is_some_and(|p| p.normal == Vec3::X);
        let page = world.surfaces.iter().find(end).unwrap().light_page as usize;
        let baked = baked(&world, &plain(&world));
        let page = baked.pages.iter().find(|p| p.number == page).unwrap();
        assert!(page.light.iter().all(|light| light.value.x > 0.0));
    }
}
