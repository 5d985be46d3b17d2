//! What formats with light styles (`RBSP`, `FBSP`) store beyond the first layer of light, and the advertisements of
//! Quake Live.
//!
//! Layer 0 of a surface is in [`crate::Surface`] and [`crate::DrawVert`], so that a reader without support for
//! styles gets the map lit by its first style. A style is a number that the game gives a brightness to: 0 is
//! constant, 255 marks an unused layer.

use crate::bytes::{Fields, Put, Record};
use crate::ids::{PlaneId, ShaderId};
use crate::lumps::{BrushSide, DrawVert, GridPoint};
use crate::surface::{Surface, SurfaceKind, lightmap_index};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// The style of a layer that is not used.
pub const NO_STYLE: u8 = 255;

/// Everything beyond the first layer. All lists are empty in formats without styles; a list that is shorter than the
/// one it goes with stands for defaults when it is written.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Layers {
    /// For each of [`crate::Bsp::surfaces`].
    pub surfaces: Vec<SurfaceLayers>,
    /// For each of [`crate::Bsp::vertices`].
    pub vertices: Vec<VertexLayers>,
    /// For each of [`crate::Bsp::brush_sides`] the surface drawn for it, or -1. Not checked.
    pub side_surfaces: Vec<i32>,
    /// The different points of the light grid; [`crate::Bsp::light_grid`] has them spread out, layer 0 only.
    pub grid_points: Vec<GridLayers>,
    /// For each point of the grid, x fastest, an index into [`Self::grid_points`]. Compilers overflowed it: it may be
    /// too large, and then stands for a point in a wall.
    pub grid_indices: Vec<u16>,
}

impl Layers {
    /// The light grid as one without styles has it.
    pub(crate) fn spread_grid(&self) -> Vec<GridPoint> {
        let dark = GridPoint {
            ambient: [0; 3],
            directed: [0; 3],
            longitude: 0,
            latitude: 0,
        };
        let point = |&index: &u16| self.grid_points.get(usize::from(index));
        let first = |index| point(index).map_or(dark, GridLayers::first);
        self.grid_indices.iter().map(first).collect()
    }

    /// Points and indices for a light grid without styles: each point once. The format's index has 16 bits: what
    /// comes after the 65,535 first different points takes the index of none of them, a point in a wall.
    pub(crate) fn gather_grid(points: &[GridPoint]) -> (Vec<GridLayers>, Vec<u16>) {
        let mut known = HashMap::new();
        let mut list = Vec::new();
        let indices = points
            .iter()
            .map(|point| {
                *known.entry(*point).or_insert_with(|| {
                    let index = u16::try_from(list.len()).unwrap_or(u16::MAX);
                    if index < u16::MAX {
                        list.push(GridLayers::from_point(point));
                    }
                    index
                })
            })
            .collect();
        (list, indices)
    }
}

/// Styles of a surface, and the lightmaps of its layers 1 to 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SurfaceLayers {
    /// Styles of the four lightmaps.
    pub lightmap_styles: [u8; 4],
    /// Styles of the four vertex colours.
    pub vertex_styles: [u8; 4],
    /// Lightmap pages of layers 1 to 3, or [`lightmap_index`] codes.
    pub lightmaps: [i32; 3],
    /// Left columns of their charts, texels.
    pub lightmap_x: [i32; 3],
    /// Upper rows of their charts.
    pub lightmap_y: [i32; 3],
}

impl Default for SurfaceLayers {
    /// Constant light in layer 0, nothing in the others.
    fn default() -> Self {
        let styles = [0, NO_STYLE, NO_STYLE, NO_STYLE];
        SurfaceLayers {
            lightmap_styles: styles,
            vertex_styles: styles,
            lightmaps: [lightmap_index::BY_VERTEX; 3],
            lightmap_x: [0; 3],
            lightmap_y: [0; 3],
        }
    }
}

/// Layers 1 to 3 of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VertexLayers {
    /// Coordinates in the lightmap pages, 0 to 1.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub lightmap: [Vec2; 3],
    /// Colours.
    pub color: [[u8; 4]; 3],
}

/// A point of the light grid with its four layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(from = "GridLayersForm", into = "GridLayersForm")
)]
pub struct GridLayers {
    /// Light from everywhere, per layer.
    pub ambient: [[u8; 3]; 4],
    /// Light from the direction below, per layer.
    pub directed: [[u8; 3]; 4],
    /// Styles; the first is [`NO_STYLE`] when the point is inside a wall.
    pub styles: [u8; 4],
    /// See [`GridPoint::longitude`].
    pub longitude: u8,
    /// See [`GridPoint::latitude`].
    pub latitude: u8,
}

impl GridLayers {
    /// The point as a grid without styles has it: layer 0, dark inside walls.
    pub fn first(&self) -> GridPoint {
        let lit = self.styles[0] != NO_STYLE;
        let of = |light: &[[u8; 3]; 4]| if lit { light[0] } else { [0; 3] };
        GridPoint {
            ambient: of(&self.ambient),
            directed: of(&self.directed),
            longitude: self.longitude,
            latitude: self.latitude,
        }
    }

    /// A point with one constant layer.
    pub fn from_point(point: &GridPoint) -> GridLayers {
        let mut layers = GridLayers {
            ambient: [[0; 3]; 4],
            directed: [[0; 3]; 4],
            styles: [0, NO_STYLE, NO_STYLE, NO_STYLE],
            longitude: point.longitude,
            latitude: point.latitude,
        };
        layers.ambient[0] = point.ambient;
        layers.directed[0] = point.directed;
        layers
    }
}

impl Record for GridLayers {
    const STRIDE: usize = 30;
    fn decode(mut f: Fields<'_>) -> Self {
        GridLayers {
            ambient: std::array::from_fn(|_| f.bytes()),
            directed: std::array::from_fn(|_| f.bytes()),
            styles: f.bytes(),
            longitude: f.u8(),
            latitude: f.u8(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        for light in self.ambient.iter().chain(&self.directed) {
            out.extend_from_slice(light);
        }
        out.extend_from_slice(&self.styles);
        out.extend_from_slice(&[self.longitude, self.latitude]);
    }
}

impl Record for u16 {
    const STRIDE: usize = 2;
    fn decode(mut f: Fields<'_>) -> Self {
        f.u16()
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.to_le_bytes());
    }
}

/// A vertex with its layers.
pub(crate) struct LayeredVertex(pub DrawVert, pub VertexLayers);

impl Record for LayeredVertex {
    const STRIDE: usize = 80;
    fn decode(mut f: Fields<'_>) -> Self {
        let (position, st, lightmap) = (f.vec3(), f.vec2(), f.vec2());
        let lightmaps = std::array::from_fn(|_| f.vec2());
        let normal = f.vec3();
        let color = f.bytes();
        LayeredVertex(
            DrawVert {
                position,
                st,
                lightmap,
                normal,
                color,
            },
            VertexLayers {
                lightmap: lightmaps,
                color: std::array::from_fn(|_| f.bytes()),
            },
        )
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_vec3(self.0.position);
        out.put_vec2(self.0.st);
        out.put_vec2(self.0.lightmap);
        for at in self.1.lightmap {
            out.put_vec2(at);
        }
        out.put_vec3(self.0.normal);
        out.extend_from_slice(&self.0.color);
        for color in &self.1.color {
            out.extend_from_slice(color);
        }
    }
}

/// A surface with its layers.
pub(crate) struct LayeredSurface(pub Surface, pub SurfaceLayers);

impl LayeredSurface {
    /// Byte offset of `lightmapNum`, one per layer.
    pub(crate) const LIGHTMAP_OFFSET: usize = 36;
}

/// The first of four and the other three.
fn split(four: [i32; 4]) -> (i32, [i32; 3]) {
    let [first, rest @ ..] = four;
    (first, rest)
}

impl Record for LayeredSurface {
    const STRIDE: usize = 148;
    fn decode(mut f: Fields<'_>) -> Self {
        let head: [i32; 7] = std::array::from_fn(|_| f.i32());
        let (lightmap_styles, vertex_styles) = (f.bytes(), f.bytes());
        let four = |f: &mut Fields<'_>| split(std::array::from_fn(|_| f.i32()));
        let (lightmap, lightmaps) = four(&mut f);
        let (x, xs) = four(&mut f);
        let (y, ys) = four(&mut f);
        let [
            shader,
            fog,
            kind,
            first_vert,
            num_verts,
            first_index,
            num_indices,
        ] = head;
        LayeredSurface(
            Surface {
                shader: ShaderId(shader),
                fog,
                kind: SurfaceKind::from_raw(kind),
                first_vert,
                num_verts,
                first_index,
                num_indices,
                lightmap,
                lightmap_x: x,
                lightmap_y: y,
                lightmap_width: f.i32(),
                lightmap_height: f.i32(),
                lightmap_origin: f.vec3(),
                lightmap_vecs: [f.vec3(), f.vec3(), f.vec3()],
                patch_width: f.i32(),
                patch_height: f.i32(),
            },
            SurfaceLayers {
                lightmap_styles,
                vertex_styles,
                lightmaps,
                lightmap_x: xs,
                lightmap_y: ys,
            },
        )
    }
    fn encode(&self, out: &mut Vec<u8>) {
        let LayeredSurface(s, layers) = self;
        for v in [
            s.shader.0,
            s.fog,
            s.kind.raw(),
            s.first_vert,
            s.num_verts,
            s.first_index,
            s.num_indices,
        ] {
            out.put_i32(v);
        }
        out.extend_from_slice(&layers.lightmap_styles);
        out.extend_from_slice(&layers.vertex_styles);
        for (first, rest) in [
            (s.lightmap, layers.lightmaps),
            (s.lightmap_x, layers.lightmap_x),
            (s.lightmap_y, layers.lightmap_y),
        ] {
            out.put_i32(first);
            out.put_ivec3(rest);
        }
        out.put_i32(s.lightmap_width);
        out.put_i32(s.lightmap_height);
        out.put_vec3(s.lightmap_origin);
        for v in s.lightmap_vecs {
            out.put_vec3(v);
        }
        out.put_i32(s.patch_width);
        out.put_i32(s.patch_height);
    }
}

/// A brush side with the surface drawn for it.
pub(crate) struct LayeredSide(pub BrushSide, pub i32);

impl Record for LayeredSide {
    const STRIDE: usize = 12;
    fn decode(mut f: Fields<'_>) -> Self {
        LayeredSide(
            BrushSide {
                plane: PlaneId(f.i32()),
                shader: ShaderId(f.i32()),
            },
            f.i32(),
        )
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_i32(self.0.plane.0);
        out.put_i32(self.0.shader.0);
        out.put_i32(self.1);
    }
}

/// A rectangle that Quake Live showed an advertisement on.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Advertisement {
    /// Number of the cell in the advertiser's system.
    pub cell: i32,
    /// Normal of the rectangle.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub normal: Vec3,
    /// Its corners, id units.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub corners: [Vec3; 4],
    /// The model field as stored: a NUL-terminated name such as `*12`.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub model: [u8; 64],
}

/// A serialized [`GridLayers`].
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct GridLayersForm {
    ambient: [[u8; 3]; 4],
    directed: [[u8; 3]; 4],
    styles: [u8; 4],
    angles: [u8; 2],
}

#[cfg(feature = "serde")]
impl From<GridLayers> for GridLayersForm {
    fn from(point: GridLayers) -> GridLayersForm {
        GridLayersForm {
            ambient: point.ambient,
            directed: point.directed,
            styles: point.styles,
            angles: [point.longitude, point.latitude],
        }
    }
}

#[cfg(feature = "serde")]
impl From<GridLayersForm> for GridLayers {
    fn from(form: GridLayersForm) -> GridLayers {
        let [longitude, latitude] = form.angles;
        GridLayers {
            ambient: form.ambient,
            directed: form.directed,
            styles: form.styles,
            longitude,
            latitude,
        }
    }
}

impl Record for Advertisement {
    const STRIDE: usize = 128;
    fn decode(mut f: Fields<'_>) -> Self {
        Advertisement {
            cell: f.i32(),
            normal: f.vec3(),
            corners: std::array::from_fn(|_| f.vec3()),
            model: f.bytes(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_i32(self.cell);
        out.put_vec3(self.normal);
        for corner in self.corners {
            out.put_vec3(corner);
        }
        out.extend_from_slice(&self.model);
    }
}
