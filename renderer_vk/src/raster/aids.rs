//! Debugging aids of the classic look, and the sheet of all images.

use glam::Vec2;
use shaders::types::constants as c;
use shaders::types::{Draw, Vertex};
use support::slice::{self, part};

use super::list::{DepthRange, DrawList};
use super::overlay::{Overlay, Picture2d};
use super::pipelines::{CullFaces, State};
use super::shading::Shading;
use crate::scene::DebugPolygons;

/// Length of a displayed normal, units.
const NORMAL_LENGTH: f32 = 2.0;
/// Width of a displayed normal, which is the outline of a thin triangle, units.
const SLIVER: f32 = 0.001;

/// Debugging aids.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aids {
    /// Draws the edges of all triangles over everything (`r_showtris`).
    pub edges: bool,
    /// Draws the normals of all vertices over everything (`r_shownormals`).
    pub normals: bool,
    /// Draws only the lightmaps of lightmapped surfaces (`r_lightmap`).
    pub lightmaps: bool,
    /// Draws skies over everything (`r_showsky`).
    pub sky_in_front: bool,
    /// Omits materials of a greater sort value (`r_debugSort`); 0: none.
    pub last_sort: i32,
    /// Counts the fragments of each pass (`r_measureOverdraw`).
    pub overdraw: bool,
}

impl Aids {
    /// Whether each pass has a draw of its own.
    pub fn passes_alone(&self) -> bool {
        self.lightmaps || self.overdraw
    }

    /// Whether materials of this sort value are omitted.
    pub fn leaves_out(&self, sort: f32) -> bool {
        self.last_sort != 0 && (self.last_sort as f32) < sort
    }

    /// The depth range of skies.
    pub fn sky_range(&self) -> DepthRange {
        if self.sky_in_front {
            DepthRange::Front
        } else {
            DepthRange::Sky
        }
    }
}

impl DrawList {
    /// Adds the edges of triangles in white, over everything. `cull`: culled faces.
    pub(super) fn push_edges(&mut self, span: (u32, u32), draw: Draw, cull: CullFaces) {
        self.push(outlines(cull), DepthRange::Front, span, draw);
    }

    /// Adds the normals of the vertices of a span of indices. `statics`: the world's vertices; those of the view are in
    /// the list.
    pub(super) fn push_normals(&mut self, span: (u32, u32), statics: &[Vertex], draw: Draw) {
        let mut used = part(&self.indices, slice::span(span.0, span.1)).to_vec();
        used.sort_unstable();
        used.dedup();
        let start = self.indices.len() as u32;
        for index in used {
            let source = if draw.dynamic_vertices != 0 {
                self.vertices.as_slice()
            } else {
                statics
            };
            let Some(&vertex) = slice::get(source, index as usize) else {
                continue;
            };
            let tip = vertex.position + vertex.normal * NORMAL_LENGTH;
            let aside = vertex.normal.any_orthogonal_vector() * SLIVER;
            let base = self.vertices.len() as u32;
            self.vertices.extend(
                [vertex.position, tip, tip + aside].map(|position| Vertex { position, ..vertex }),
            );
            self.indices.extend([base, base + 1, base + 2]);
        }
        let span = (start, self.indices.len() as u32 - start);
        if span.1 > 0 {
            let draw = Draw {
                dynamic_vertices: 1,
                ..draw
            };
            self.push(outlines(CullFaces::None), DepthRange::Front, span, draw);
        }
    }
}

impl DrawList {
    /// Adds the debug polygons of the collision code: additively blended, each with a white outline over everything.
    /// Their vertices are in the space of instance 0.
    pub(super) fn push_debug_polygons(&mut self, polygons: &DebugPolygons) {
        let add = Some((c::BLEND_ONE, c::BLEND_ONE));
        let filled = State {
            blend: add,
            wireframe: false,
            shading: Shading::VERTEX_COLOR,
            ..outlines(CullFaces::None)
        };
        let edges = State {
            blend: add,
            ..outlines(CullFaces::None)
        };
        let mut draw = Draw {
            dynamic_vertices: 1,
            ..Draw::default()
        };
        draw.colors[0] = [1.0; 4];
        let mut first = 0;
        for &size in &polygons.sizes {
            let corners = first..first + size as usize;
            first = corners.end;
            let corners = part(&polygons.vertices, corners);
            let base = self.vertices.len() as u32;
            let start = self.indices.len() as u32;
            self.vertices.extend_from_slice(corners);
            let fan = (2..size).flat_map(|i| [base, base + i - 1, base + i]);
            self.indices.extend(fan);
            let span = (start, self.indices.len() as u32 - start);
            self.push(filled, DepthRange::Normal, span, draw);
            let start = self.indices.len() as u32;
            // an edge is the outline of a thin triangle
            let next = corners.iter().cycle().skip(1);
            for (&a, &b) in corners.iter().zip(next) {
                let aside = (b.position - a.position).any_orthogonal_vector();
                let aside = aside.normalize_or_zero() * SLIVER;
                let tip = Vertex {
                    position: b.position + aside,
                    ..b
                };
                let base = self.vertices.len() as u32;
                self.vertices.extend([a, b, tip]);
                self.indices.extend([base, base + 1, base + 2]);
            }
            let span = (start, self.indices.len() as u32 - start);
            self.push(edges, DepthRange::Front, span, draw);
        }
    }
}

fn outlines(cull: CullFaces) -> State {
    State {
        wireframe: true,
        ..State::plain(cull)
    }
}

/// The sheet of `r_showImages`: every image in a grid of 20 × 15 cells over the window; with value 2 scaled by its size
/// over 512 texels. `images`: texture, width, height.
pub fn image_sheet(
    overlay: &mut Overlay,
    window: (u32, u32),
    proportional: bool,
    white: u32,
    images: impl IntoIterator<Item = (u32, u32, u32)>,
) {
    const COLUMNS: u32 = 20;
    const ROWS: u32 = 15;
    let (width, height) = (window.0 as f32, window.1 as f32);
    let picture = |position: Vec2, size: Vec2, color: u32| Picture2d {
        position,
        size,
        st1: Vec2::ZERO,
        st2: Vec2::ONE,
        color,
    };
    let black = picture(Vec2::ZERO, Vec2::new(width, height), 0xFF00_0000);
    overlay.add_texture(white, &black);
    let cell = Vec2::new(width / COLUMNS as f32, height / ROWS as f32);
    for (i, (texture, texels_x, texels_y)) in (0u32..).zip(images) {
        let at = Vec2::new((i % COLUMNS) as f32, (i / COLUMNS) as f32) * cell;
        let size = if proportional {
            cell * Vec2::new(texels_x as f32, texels_y as f32) / 512.0
        } else {
            cell
        };
        overlay.add_transparent_texture(texture, &picture(at, size, u32::MAX));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn normals_are_slivers_of_two_units_from_each_vertex_once() {
        let vertex = |x: f32| Vertex {
            position: Vec3::X * x,
            normal: Vec3::Z,
            ..Vertex::default()
        };
        let statics = [vertex(0.0), vertex(1.0), vertex(2.0)];
        let mut list = DrawList::default();
        list.indices.extend([0, 1, 2, 2, 1, 0]);
        let list_len = list.indices.len() as u32;
        list.push_normals((0, list_len), &statics, Draw::default());
        assert_eq!(list.indices.len(), 6 + 9);
        assert_eq!(list.vertices.len(), 9);
        assert_eq!(list.vertices[0].position, Vec3::ZERO);
        assert_eq!(list.vertices[1].position, Vec3::Z * 2.0);
        assert_eq!(list.calls.len(), 1);
        assert_eq!(
            (list.calls[0].first_index, list.calls[0].index_count),
            (6, 9)
        );
    }

    #[test]
    fn sort_values_past_the_last_are_left_out() {
        let aids = Aids {
            last_sort: 3,
            ..Aids::default()
        };
        assert!(!aids.leaves_out(3.0));
        assert!(aids.leaves_out(4.0));
        assert!(!Aids::default().leaves_out(16.0));
    }
}
