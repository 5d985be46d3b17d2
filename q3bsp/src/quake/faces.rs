//! Faces to surfaces: corners along the edges, coordinates along the texture's axes, lightmaps on pages.

use super::atlas::{Atlas, PAGE};
use super::{Face, QuakeMap, Texinfo};
use crate::error::{Error, Lump};
use crate::format::Format;
use crate::ids::ShaderId;
use crate::layers::{NO_STYLE, SurfaceLayers, VertexLayers};
use crate::lumps::DrawVert;
use crate::surface::{Surface, SurfaceKind, lightmap_index};
use glam::{DVec3, Vec2, Vec3};

/// Units of texture between two texels of a lightmap.
const LUXEL: f64 = 16.0;

/// Halves stored light, to our fixed scale: these formats show 128 (with Quake II's doubled textures 127) as
/// the texture itself, `IBSP` shows 64 so.
fn halved(byte: u8) -> u8 {
    byte / 2 + byte % 2
}

/// A face as a surface, before its vertices have an index.
pub(super) struct Polygon {
    pub surface: Surface,
    pub layers: SurfaceLayers,
    pub vertices: Vec<DrawVert>,
    pub vertex_layers: Vec<VertexLayers>,
    /// Its lightmap is larger than a page.
    pub too_large: bool,
}

/// Where a face lies in the grid of its lightmap.
struct Extent {
    /// First grid line, horizontal and vertical.
    first: [f64; 2],
    /// Texels.
    size: [usize; 2],
}

fn along(axis: &[f32; 4], point: Vec3) -> f64 {
    let [x, y, z, offset] = axis.map(f64::from);
    point.as_dvec3().dot(DVec3::new(x, y, z)) + offset
}

impl QuakeMap {
    fn reference(
        &self,
        element: usize,
        field: &'static str,
        value: i64,
        target: Lump,
        limit: usize,
    ) -> Error {
        self.located(Error::Value {
            lump: Lump::Faces,
            element,
            field,
            value,
            expected: format!("outside the {limit} of lump {target}"),
        })
    }

    /// The texinfo of a face.
    pub(super) fn texinfo_of(&self, element: usize, face: &Face) -> Result<&Texinfo, Error> {
        usize::try_from(face.texinfo)
            .ok()
            .and_then(|at| self.texinfos.get(at))
            .ok_or_else(|| {
                let limit = self.texinfos.len();
                let value = i64::from(face.texinfo);
                self.reference(element, "texinfo", value, Lump::Texinfo, limit)
            })
    }

    /// Corners of a face in the order stored.
    fn corners(&self, element: usize, face: &Face) -> Result<Vec<Vec3>, Error> {
        let range = usize::try_from(face.first_edge)
            .ok()
            .zip(usize::try_from(face.num_edges).ok())
            .and_then(|(first, count)| self.surfedges.get(first..first.checked_add(count)?));
        let Some(surfedges) = range else {
            return Err(self.located(Error::Range {
                lump: Lump::Faces,
                element,
                field: "edges",
                first: face.first_edge,
                count: face.num_edges,
                target: Lump::Surfedges,
                limit: self.surfedges.len(),
            }));
        };
        surfedges
            .iter()
            .map(|&surfedge| {
                let edge = usize::try_from(surfedge.unsigned_abs())
                    .ok()
                    .and_then(|at| self.edges.get(at))
                    .ok_or_else(|| {
                        let limit = self.edges.len();
                        let value = i64::from(surfedge);
                        self.reference(element, "edge", value, Lump::Edges, limit)
                    })?;
                let [start, end] = edge.0;
                let vertex = if surfedge < 0 { end } else { start };
                usize::try_from(vertex)
                    .ok()
                    .and_then(|at| self.vertices.get(at).copied())
                    .ok_or_else(|| {
                        let limit = self.vertices.len();
                        let value = i64::from(vertex);
                        self.reference(element, "vertex", value, Lump::Vertices, limit)
                    })
            })
            .collect()
    }

    /// Normal of a face, out of its front.
    fn normal(&self, element: usize, face: &Face) -> Result<Vec3, Error> {
        let plane = usize::try_from(face.plane)
            .ok()
            .and_then(|at| self.planes.get(at))
            .ok_or_else(|| {
                let limit = self.planes.len();
                let value = i64::from(face.plane);
                self.reference(element, "plane", value, Lump::Planes, limit)
            })?;
        Ok(match face.side {
            0 => plane.normal,
            _ => -plane.normal,
        })
    }

    /// Bytes of a texel of the lighting lump.
    fn light_bytes(&self) -> usize {
        match self.format {
            Format::Quake | Format::Bsp2 | Format::TwoPsb => 1,
            _ => 3,
        }
    }

    /// The lightmap texels of one style of a face; `None` when they are not in the lump.
    fn light_texels(&self, face: &Face, extent: &Extent, style: usize) -> Option<Vec<[u8; 3]>> {
        let [width, height] = extent.size;
        let texels = width.checked_mul(height)?;
        let bytes = self.light_bytes();
        let start = usize::try_from(face.light_offset).ok()? + style * texels * bytes;
        let data = self
            .lighting
            .get(start..start.checked_add(texels * bytes)?)?;
        Some(match bytes {
            1 => data.iter().map(|&b| [halved(b); 3]).collect(),
            _ => {
                let rgb = data.as_chunks::<3>().0.iter();
                rgb.map(|texel| texel.map(halved)).collect()
            }
        })
    }

    /// Makes a surface of a face. `shader` is its material, `lit` whether the material takes a lightmap, `size` that
    /// of its texture, in texels.
    pub(super) fn polygon(
        &self,
        element: usize,
        face: &Face,
        shader: ShaderId,
        lit: bool,
        size: Vec2,
        atlas: &mut Atlas,
    ) -> Result<Polygon, Error> {
        let texinfo = self.texinfo_of(element, face)?;
        let normal = self.normal(element, face)?;
        let mut corners = self.corners(element, face)?;
        let origin = corners.first().map_or(Vec3::ZERO, |&first| first);
        let edges = corners.iter().zip(corners.iter().skip(1));
        let winding: Vec3 = edges.map(|(a, b)| (b - origin).cross(a - origin)).sum();
        if winding.dot(normal) < 0.0 {
            corners.reverse();
        }
        let texture: Vec<[f64; 2]> = corners
            .iter()
            .map(|&p| [along(&texinfo.s, p), along(&texinfo.t, p)])
            .collect();
        let extent = extent_of(&texture);
        let styles = face.styles.iter().take_while(|&&style| style != NO_STYLE);
        let mut charts = Vec::new();
        let mut too_large = false;
        let mut mean = None;
        if lit && let Some(extent) = &extent {
            for (at, &style) in styles.enumerate() {
                // The lump ends before the texels of this style.
                let Some(texels) = self.light_texels(face, extent, at) else {
                    break;
                };
                mean.get_or_insert_with(|| mean_of(&texels));
                let [width, height] = extent.size;
                // `light_texels` returns width × height texels.
                let texel = |at: usize| texels.get(at).copied().unwrap_or_default();
                match atlas.add(width, height, texel) {
                    Some(chart) => charts.push((style, chart)),
                    None => too_large = true,
                }
            }
        }
        // What no light was computed for: nothing fell on it in Quake, and Quake II shows it bright.
        let dark = lit && !self.lighting.is_empty() && !self.format.is_quake2();
        let unlit = if dark { [0; 3] } else { [128; 3] };
        let without = match (lit, dark || too_large) {
            (true, true) => lightmap_index::BY_VERTEX,
            _ => lightmap_index::WHITE,
        };
        let [r, g, b] = mean.unwrap_or(unlit);
        let place = |at: usize| -> Option<(i32, i32, i32)> {
            let &(_, (page, x, y)) = charts.get(at)?;
            let int = |n: usize| i32::try_from(n).ok();
            Some((int(page)?, int(x)?, int(y)?))
        };
        let on_page = |coordinates: &[f64; 2], layer: usize| -> Vec2 {
            let (Some(extent), Some((_, x, y))) = (&extent, place(layer)) else {
                return Vec2::ZERO; // without light
            };
            let at = |coordinate: f64, first: f64, start: i32| {
                let cell = coordinate / LUXEL - first;
                ((f64::from(start) + cell + 0.5) / PAGE as f64) as f32
            };
            let ([s, t], [first_s, first_t]) = (*coordinates, extent.first);
            Vec2::new(at(s, first_s, x), at(t, first_t, y))
        };
        let vertices = corners
            .iter()
            .zip(&texture)
            .map(|(&position, st)| DrawVert {
                position,
                st: Vec2::new(st[0] as f32, st[1] as f32) / size,
                lightmap: on_page(st, 0),
                normal,
                color: [r, g, b, 255],
            });
        let layers = texture.iter().map(|st| VertexLayers {
            lightmap: [1, 2, 3].map(|layer| on_page(st, layer)),
            color: [[0; 4]; 3],
        });
        let (page, x, y) = place(0).unwrap_or((without, 0, 0));
        let [width, height] = extent.as_ref().map_or([0, 0], |e| e.size);
        let count = |n: usize| i32::try_from(n).unwrap_or(0);
        let mut surface_layers = SurfaceLayers::default();
        for (slot, (style, _)) in surface_layers.lightmap_styles.iter_mut().zip(&charts) {
            *slot = *style;
        }
        let SurfaceLayers {
            lightmaps,
            lightmap_x,
            lightmap_y,
            ..
        } = &mut surface_layers;
        let places = lightmaps.iter_mut().zip(lightmap_x).zip(lightmap_y);
        for (layer, ((page, x), y)) in places.enumerate() {
            if let Some(found) = place(layer + 1) {
                (*page, *x, *y) = found;
            }
        }
        Ok(Polygon {
            surface: Surface {
                shader,
                fog: -1,
                kind: SurfaceKind::Planar,
                first_vert: 0,
                num_verts: count(corners.len()),
                first_index: 0,
                num_indices: 3 * count(corners.len().saturating_sub(2)),
                lightmap: page,
                lightmap_x: x,
                lightmap_y: y,
                lightmap_width: count(width),
                lightmap_height: count(height),
                lightmap_origin: Vec3::ZERO,
                lightmap_vecs: [Vec3::ZERO, Vec3::ZERO, normal],
                patch_width: 0,
                patch_height: 0,
            },
            layers: surface_layers,
            vertices: vertices.collect(),
            vertex_layers: layers.collect(),
            too_large,
        })
    }
}

/// The grid lines that enclose a face: every 16 units of texture. `None` for a face that has no finite extent.
fn extent_of(texture: &[[f64; 2]]) -> Option<Extent> {
    let along = |axis: fn(&[f64; 2]) -> f64| {
        let values = texture.iter().map(|st| axis(st) / LUXEL);
        let low = values.clone().fold(f64::INFINITY, f64::min).floor();
        let high = values.fold(f64::NEG_INFINITY, f64::max).ceil();
        let span = high - low;
        // Beyond this no lump could hold the texels.
        let fits = (0.0..65_536.0).contains(&span);
        fits.then(|| (low, span as usize + 1))
    };
    let (first_s, width) = along(|&[s, _]| s)?;
    let (first_t, height) = along(|&[_, t]| t)?;
    Some(Extent {
        first: [first_s, first_t],
        size: [width, height],
    })
}

fn mean_of(texels: &[[u8; 3]]) -> [u8; 3] {
    let count = texels.len().max(1) as u64;
    let mut sums = [0u64; 3];
    for texel in texels {
        for (sum, &channel) in sums.iter_mut().zip(texel) {
            *sum += u64::from(channel);
        }
    }
    sums.map(|sum| (sum / count) as u8)
}
