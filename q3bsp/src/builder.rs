//! Small valid maps made in memory, for tests of everything that reads maps.
//!
//! ```
//! use glam::Vec3;
//! use q3bsp::builder::MapBuilder;
//!
//! let mut map = MapBuilder::new();
//! let wall = map.add_shader("textures/wall", 0, q3bsp::content_flags::SOLID);
//! map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
//! map.add_entity(&[("classname", "info_player_deathmatch"), ("origin", "0 0 0")]);
//! let bsp = map.build();
//! assert_eq!(bsp.surfaces.len(), 6);
//! assert_eq!(bsp.cluster_at(Vec3::ZERO), 0);
//! assert_eq!(q3bsp::Bsp::parse(&bsp.write()).unwrap().surfaces, bsp.surfaces);
//! ```

mod tree;

use crate::entities::{self, Entity};
use crate::ids::{Child, PlaneId, ShaderId};
use crate::lumps::{
    Brush, BrushSide, DrawVert, Fog, GridPoint, LIGHTMAP_BYTES, Lightmap, Node, Plane, ShaderRef,
};
use crate::surface::{Surface, SurfaceKind, lightmap_index};
use crate::{Bsp, Visibility};
use glam::{Vec2, Vec3};

/// An axis-aligned box.
#[derive(Clone, Copy)]
struct Cell {
    mins: Vec3,
    maxs: Vec3,
    cluster: i32,
}

/// Puts a map together. Methods that add something return its index in the [`Bsp`]. Indices that the
/// builder did not give out make a map that [`Bsp::validate`] refuses.
#[derive(Default)]
pub struct MapBuilder {
    bsp: Bsp,
    cells: Vec<Cell>,
    entities: Vec<Entity>,
    visibility: Option<Visibility>,
    /// First surface and first brush of each model begun.
    model_starts: Vec<(usize, usize)>,
    texture_scale: f32,
    blind: bool,
}

impl MapBuilder {
    /// A map with a `worldspawn` entity and nothing else.
    pub fn new() -> MapBuilder {
        let mut builder = MapBuilder {
            model_starts: vec![(0, 0)],
            texture_scale: 1.0 / 128.0,
            ..MapBuilder::default()
        };
        builder.add_entity(&[("classname", "worldspawn")]);
        builder
    }

    /// Adds a shader reference.
    pub fn add_shader(&mut self, name: &str, surface_flags: u32, content_flags: u32) -> ShaderId {
        self.bsp
            .shaders
            .push(ShaderRef::new(name, surface_flags, content_flags));
        ShaderId(last(&self.bsp.shaders))
    }

    /// Adds an entity; the first, a `worldspawn`, is there already.
    pub fn add_entity(&mut self, pairs: &[(&str, &str)]) -> usize {
        let pairs = pairs
            .iter()
            .map(|&(k, v)| (k.to_owned(), v.to_owned()))
            .collect();
        self.entities.push(Entity { pairs });
        self.entities.len() - 1
    }

    /// Adds a key to the world.
    pub fn set_world_key(&mut self, key: &str, value: &str) {
        if let Some(world) = self.entities.first_mut() {
            world.pairs.push((key.to_owned(), value.to_owned()));
        }
    }

    /// Adds a flat convex polygon, its corners clockwise seen from the front. Texture coordinates repeat
    /// every 128 units; lightmap coordinates cover the page.
    pub fn add_polygon(&mut self, shader: ShaderId, corners: &[Vec3]) -> usize {
        let normal = match corners {
            [a, b, c, ..] => (*c - *a).cross(*b - *a).normalize_or_zero(),
            _ => Vec3::ZERO,
        };
        let axis = normal.any_orthonormal_vector_or_x();
        let other = normal.cross(axis);
        let project = |p: Vec3| Vec2::new(p.dot(axis), p.dot(other));
        let flat: Vec<Vec2> = corners.iter().map(|&p| project(p)).collect();
        let low = flat.iter().copied().fold(Vec2::INFINITY, Vec2::min);
        let high = flat.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max);
        let vertices: Vec<DrawVert> = corners
            .iter()
            .zip(&flat)
            .map(|(&position, &at)| DrawVert {
                position,
                st: at * self.texture_scale,
                lightmap: (at - low) / (high - low).max(Vec2::splat(1e-6)),
                normal,
                color: [255; 4],
            })
            .collect();
        let fan = 1..int(corners.len()).saturating_sub(1).max(1);
        let indices: Vec<i32> = fan.flat_map(|at| [0, at, at + 1]).collect();
        let surface = self.add_surface(shader, SurfaceKind::Planar, &vertices, &indices);
        if let Some(surface) = self.bsp.surfaces.get_mut(surface) {
            surface.lightmap_vecs[2] = normal;
        }
        surface
    }

    /// [`Self::add_polygon`] with four corners.
    pub fn add_quad(&mut self, shader: ShaderId, corners: [Vec3; 4]) -> usize {
        self.add_polygon(shader, &corners)
    }

    /// Adds the six faces of a box; they look inwards, as the walls of a room do, or outwards.
    pub fn add_box_faces(
        &mut self,
        shader: ShaderId,
        mins: Vec3,
        maxs: Vec3,
        inwards: bool,
    ) -> [usize; 6] {
        [0, 1, 2, 3, 4, 5].map(|face| {
            let mut corners = box_face(mins, maxs, face);
            if inwards {
                corners.reverse();
            }
            self.add_quad(shader, corners)
        })
    }

    /// Adds a patch of `width` × `height` control points, width fastest. The control points' own bounds
    /// become its LOD group.
    pub fn add_patch(
        &mut self,
        shader: ShaderId,
        width: usize,
        height: usize,
        points: &[DrawVert],
    ) -> usize {
        let mins = points.iter().fold(Vec3::INFINITY, |m, v| m.min(v.position));
        let maxs = points
            .iter()
            .fold(Vec3::NEG_INFINITY, |m, v| m.max(v.position));
        let surface = self.add_surface(shader, SurfaceKind::Patch, points, &[]);
        if let Some(surface) = self.bsp.surfaces.get_mut(surface) {
            surface.patch_width = int(width);
            surface.patch_height = int(height);
            surface.lightmap_vecs = [mins, maxs, Vec3::ZERO];
        }
        surface
    }

    /// Adds triangles of any shape: three corners each, clockwise seen from the front.
    pub fn add_soup(&mut self, shader: ShaderId, vertices: &[DrawVert], indices: &[i32]) -> usize {
        self.add_surface(shader, SurfaceKind::TriangleSoup, vertices, indices)
    }

    /// Adds a flare.
    pub fn add_flare(
        &mut self,
        shader: ShaderId,
        position: Vec3,
        normal: Vec3,
        color: Vec3,
    ) -> usize {
        let surface = self.add_surface(shader, SurfaceKind::Flare, &[], &[]);
        if let Some(surface) = self.bsp.surfaces.get_mut(surface) {
            surface.lightmap_origin = position;
            surface.lightmap_vecs = [color, Vec3::ZERO, normal];
        }
        surface
    }

    fn add_surface(
        &mut self,
        shader: ShaderId,
        kind: SurfaceKind,
        vertices: &[DrawVert],
        indices: &[i32],
    ) -> usize {
        self.bsp.surfaces.push(Surface {
            shader,
            fog: -1,
            kind,
            first_vert: int(self.bsp.vertices.len()),
            num_verts: int(vertices.len()),
            first_index: int(self.bsp.indices.len()),
            num_indices: int(indices.len()),
            lightmap: lightmap_index::BY_VERTEX,
            lightmap_x: 0,
            lightmap_y: 0,
            lightmap_width: 0,
            lightmap_height: 0,
            lightmap_origin: Vec3::ZERO,
            lightmap_vecs: [Vec3::ZERO; 3],
            patch_width: 0,
            patch_height: 0,
        });
        self.bsp.vertices.extend_from_slice(vertices);
        self.bsp.indices.extend_from_slice(indices);
        self.bsp.surfaces.len() - 1
    }

    /// The vertices of a surface, to change colours or coordinates.
    pub fn vertices_mut(&mut self, surface: usize) -> &mut [DrawVert] {
        let range = self
            .bsp
            .surfaces
            .get(surface)
            .map_or(0..0, |s| crate::tree::span(s.first_vert, s.num_verts));
        self.bsp.vertices.get_mut(range).unwrap_or(&mut [])
    }

    /// A surface, to change what has no method here.
    pub fn surface_mut(&mut self, surface: usize) -> Option<&mut Surface> {
        self.bsp.surfaces.get_mut(surface)
    }

    /// Adds a lightmap page of one colour.
    pub fn add_lightmap(&mut self, color: [u8; 3]) -> i32 {
        let page: Vec<u8> = color.into_iter().cycle().take(LIGHTMAP_BYTES).collect();
        self.bsp.lightmaps.push(Lightmap(page.into()));
        last(&self.bsp.lightmaps)
    }

    /// Adds a lightmap page texel by texel; `texel` is given column and row.
    pub fn add_lightmap_with(&mut self, texel: impl Fn(usize, usize) -> [u8; 3]) -> i32 {
        let size = crate::LIGHTMAP_SIZE;
        let page: Vec<u8> = (0..size * size)
            .flat_map(|at| texel(at % size, at / size))
            .collect();
        self.bsp.lightmaps.push(Lightmap(page.into()));
        last(&self.bsp.lightmaps)
    }

    /// Gives a surface a lightmap page, or one of [`lightmap_index`].
    pub fn set_lightmap(&mut self, surface: usize, page: i32) {
        if let Some(surface) = self.bsp.surfaces.get_mut(surface) {
            surface.lightmap = page;
        }
    }

    /// Puts a surface into a fog.
    pub fn set_fog(&mut self, surface: usize, fog: i32) {
        if let Some(surface) = self.bsp.surfaces.get_mut(surface) {
            surface.fog = fog;
        }
    }

    /// Makes a box of space a leaf with a cluster of its own, without walls. Boxes must not overlap;
    /// space in none of them is solid.
    pub fn add_cell(&mut self, mins: Vec3, maxs: Vec3) -> i32 {
        let cluster = int(self.cells.len());
        self.cells.push(Cell {
            mins,
            maxs,
            cluster,
        });
        cluster
    }

    /// [`Self::add_cell`] with six walls that look inwards. Returns the cluster.
    pub fn add_room(&mut self, shader: ShaderId, mins: Vec3, maxs: Vec3) -> i32 {
        self.add_box_faces(shader, mins, maxs, true);
        self.add_cell(mins, maxs)
    }

    /// Decides whether cluster `a` sees cluster `b` (one way). Without such a call every cluster sees
    /// everything. Only clusters that exist already can be decided about.
    pub fn set_sees(&mut self, a: i32, b: i32, sees: bool) {
        let clusters = self.cells.len();
        let old = self.visibility.take();
        let known = old.as_ref().map_or(0, |v| v.clusters);
        let mut visibility = Visibility::new(clusters);
        for from in 0..clusters {
            for to in 0..clusters {
                let before = old.as_ref().is_none_or(|v| v.sees(from, to));
                visibility.set(from, to, before || from >= known || to >= known);
            }
        }
        if let (Ok(a), Ok(b)) = (usize::try_from(a), usize::try_from(b)) {
            visibility.set(a, b, sees);
        }
        self.visibility = Some(visibility);
    }

    /// Leaves the visibility lump out.
    pub fn without_visibility(&mut self) {
        self.blind = true;
    }

    /// Adds a box-shaped brush of six sides.
    pub fn add_box_brush(&mut self, shader: ShaderId, mins: Vec3, maxs: Vec3) -> i32 {
        let first_side = int(self.bsp.brush_sides.len());
        for axis in 0..3 {
            for (direction, dist) in [(-1.0, -mins[axis]), (1.0, maxs[axis])] {
                let mut normal = Vec3::ZERO;
                normal[axis] = direction;
                let plane = self.plane(normal, dist);
                self.bsp.brush_sides.push(BrushSide { plane, shader });
            }
        }
        self.bsp.brushes.push(Brush {
            first_side,
            num_sides: 6,
            shader,
        });
        last(&self.bsp.brushes)
    }

    /// Adds a fog volume with its brush. `visible_side` is 0 to 5 for -x +x -y +y -z +z, or -1.
    pub fn add_fog_brush(
        &mut self,
        shader: ShaderId,
        mins: Vec3,
        maxs: Vec3,
        visible_side: i32,
    ) -> i32 {
        let brush = self.add_box_brush(shader, mins, maxs);
        // An index that the builder did not give out is left to [`Bsp::validate`].
        let reference = self.bsp.shaders.get(shader.index());
        let (shader, raw_shader) = reference.map_or((String::new(), [0; 64]), |shader| {
            (shader.name.clone(), shader.raw_name)
        });
        self.bsp.fogs.push(Fog {
            shader,
            raw_shader,
            brush,
            visible_side,
        });
        last(&self.bsp.fogs)
    }

    /// Begins a brush model: surfaces and brushes added from here on belong to it. Returns the `n` of
    /// the `*n` that an entity names it by.
    pub fn begin_model(&mut self) -> usize {
        self.model_starts
            .push((self.bsp.surfaces.len(), self.bsp.brushes.len()));
        self.model_starts.len() - 1
    }

    fn plane(&mut self, normal: Vec3, dist: f32) -> PlaneId {
        let wanted = Plane { normal, dist };
        if let Some(at) = self.bsp.planes.iter().position(|&plane| plane == wanted) {
            return PlaneId(int(at));
        }
        // Planes come in pairs, the positive first.
        let negative = normal.min_element() < 0.0 && normal.max_element() <= 0.0;
        let opposite = Plane {
            normal: -normal,
            dist: -dist,
        };
        let pair = if negative {
            [opposite, wanted]
        } else {
            [wanted, opposite]
        };
        self.bsp.planes.extend(pair);
        PlaneId(last(&self.bsp.planes) - i32::from(!negative))
    }

    /// Builds the tree, the leafs with their surfaces and brushes, the models and the entity text.
    /// Without any cell, one cell around all geometry is made. Without a shader, one is.
    pub fn build(mut self) -> Bsp {
        if self.bsp.shaders.is_empty() {
            self.add_shader("noshader", 0, 0);
        }
        self.bsp.entities = entities::write(&self.entities);
        self.build_models();
        if self.cells.is_empty() {
            let world = self.bsp.models.first();
            let (mins, maxs) = world.map_or((Vec3::ZERO, Vec3::ZERO), |w| (w.mins, w.maxs));
            self.add_cell(mins - 64.0, maxs + 64.0);
        }
        if !self.blind {
            if self
                .visibility
                .as_ref()
                .is_none_or(|v| v.clusters < self.cells.len())
            {
                self.set_sees(0, 0, true);
            }
            self.bsp.visibility = self.visibility.take();
        }
        // The dummy that compilers put first.
        self.push_leaf(None);
        let cells = std::mem::take(&mut self.cells);
        let everything = Cell {
            mins: Vec3::splat(-131_072.0),
            maxs: Vec3::splat(131_072.0),
            cluster: -1,
        };
        let root = self.build_node(&cells, everything);
        if let Child::Leaf(_) = root {
            // A single cell may fill the world; the format still wants a node.
            let plane = self.plane(Vec3::X, 0.0);
            self.bsp.nodes.push(Node {
                plane,
                children: [root, root],
                mins: whole(everything.mins),
                maxs: whole(everything.maxs),
            });
        }
        self.bsp
    }

    /// [`Self::build`] with a light grid, each point by its position.
    pub fn build_with_grid(mut self, size: Vec3, point: impl Fn(Vec3) -> GridPoint) -> Bsp {
        self.set_world_key("gridsize", &format!("{} {} {}", size.x, size.y, size.z));
        let mut bsp = self.build();
        let Some(world) = bsp.models.first() else {
            // `build` makes at least the world.
            return bsp;
        };
        let origin = size * (world.mins / size).ceil();
        let counts = ((size * (world.maxs / size).floor() - origin) / size + 1.0).max(Vec3::ZERO);
        let [nx, ny, nz] = counts.to_array().map(|n| n as usize);
        let mut points = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    points.push(point(
                        origin + size * Vec3::new(x as f32, y as f32, z as f32),
                    ));
                }
            }
        }
        bsp.light_grid = points;
        bsp
    }
}

/// The corners of a face of a box, clockwise seen from outside; faces in the order -x +x -y +y -z +z.
fn box_face(mins: Vec3, maxs: Vec3, face: usize) -> [Vec3; 4] {
    let axis = face / 2;
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let positive = face % 2 == 1;
    let corner = |high_u: bool, high_v: bool| {
        let mut p = if positive { maxs } else { mins };
        p[u] = if high_u { maxs[u] } else { mins[u] };
        p[v] = if high_v { maxs[v] } else { mins[v] };
        p
    };
    let counter_clockwise_from_front = [
        corner(false, false),
        corner(true, false),
        corner(true, true),
        corner(false, true),
    ];
    let mut corners = counter_clockwise_from_front;
    if positive {
        corners.reverse();
    }
    corners
}

trait OrthonormalOrX {
    fn any_orthonormal_vector_or_x(self) -> Vec3;
}

impl OrthonormalOrX for Vec3 {
    fn any_orthonormal_vector_or_x(self) -> Vec3 {
        if self == Vec3::ZERO {
            Vec3::X
        } else {
            self.any_orthonormal_vector()
        }
    }
}

fn whole(v: Vec3) -> [i32; 3] {
    v.to_array().map(|v| v as i32)
}

fn int(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

fn last<T>(list: &[T]) -> i32 {
    int(list.len()) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_look_the_way_they_should() {
        for inwards in [false, true] {
            let mut map = MapBuilder::new();
            let shader = map.add_shader("a", 0, 0);
            map.add_box_faces(shader, Vec3::splat(-8.0), Vec3::splat(8.0), inwards);
            for s in &map.bsp.surfaces {
                let outwards = map.bsp.surface_vertices(s)[0]
                    .position
                    .dot(s.lightmap_vecs[2])
                    > 0.0;
                assert_eq!(outwards, !inwards);
                assert_eq!(s.lightmap_vecs[2].length(), 1.0);
            }
        }
    }

    #[test]
    fn rooms_become_leafs_and_the_rest_is_solid() {
        let mut map = MapBuilder::new();
        let shader = map.add_shader("a", 0, 0);
        let one = map.add_room(shader, Vec3::splat(-64.0), Vec3::splat(64.0));
        let two = map.add_room(
            shader,
            Vec3::new(64.0, -64.0, -64.0),
            Vec3::new(128.0, 0.0, 0.0),
        );
        map.set_sees(one, two, false);
        let mut bsp = map.build();
        bsp.validate().unwrap();
        assert_eq!(bsp.warnings, []);
        assert_eq!(bsp.cluster_at(Vec3::ZERO), one);
        assert_eq!(bsp.cluster_at(Vec3::new(100.0, -10.0, -10.0)), two);
        assert_eq!(bsp.cluster_at(Vec3::new(100.0, 10.0, -10.0)), -1);
        assert!(!bsp.cluster_sees(one, two));
        assert!(bsp.cluster_sees(two, one));
        let lists = bsp.cluster_surfaces();
        assert!(lists[0].len() >= 6 && lists[1].len() >= 6);
    }

    #[test]
    fn grid_is_found_again() {
        let mut map = MapBuilder::new();
        let shader = map.add_shader("a", 0, 0);
        map.add_room(shader, Vec3::splat(-100.0), Vec3::splat(100.0));
        let bsp = map.build_with_grid(Vec3::new(32.0, 64.0, 64.0), |p| GridPoint {
            ambient: [if p.x > 0.0 { 200 } else { 100 }; 3],
            directed: [0; 3],
            longitude: 0,
            latitude: 0,
        });
        let layout = bsp.light_grid().unwrap();
        assert_eq!(layout.counts, [7, 3, 3]);
        let sample = layout
            .sample(&bsp.light_grid, Vec3::new(64.0, 0.0, 0.0))
            .unwrap();
        assert_eq!(sample.ambient, Vec3::splat(200.0));
    }
}
