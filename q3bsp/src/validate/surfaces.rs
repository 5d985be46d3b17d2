//! Surfaces: what they refer to, by kind.

use super::{Field, Repairs, in_range, index};
use crate::Bsp;
use crate::error::{Error, Lump};
use crate::format::Format;
use crate::layers::LayeredSurface;
use crate::surface::{Surface, SurfaceKind, lightmap_index};

impl Bsp {
    pub(super) fn check_surfaces(&mut self) -> Result<(), Error> {
        let (shaders, fogs) = (self.shaders.len(), self.fogs.len() as i64);
        let (vertices, indices) = (self.vertices.len(), self.indices.len());
        let pages = self.lightmaps.len() as i64;
        let lightmap_offset = match self.format.has_layers() {
            true => LayeredSurface::LIGHTMAP_OFFSET,
            false => 28,
        };
        let has_foliage = matches!(self.format, Format::Ibsp47 | Format::QuakeLive);
        let mut log = Repairs {
            lump: Lump::Surfaces,
            warnings: &mut self.warnings,
            repairs: &mut self.container.repairs,
        };
        let first_vert = Field("firstVert", 12);
        let first_index = Field("firstIndex", 20);
        for (element, s) in self.surfaces.iter_mut().enumerate() {
            index(
                Lump::Surfaces,
                element,
                "shaderNum",
                s.shader.0,
                Lump::Shaders,
                shaders,
            )?;
            if s.fog < -1 || i64::from(s.fog) >= fogs {
                log.replace(
                    element,
                    Field("fogNum", 4),
                    &mut s.fog,
                    -1,
                    "taken as no fog",
                );
            }
            if s.lightmap < lightmap_index::TWO_D || i64::from(s.lightmap) >= pages {
                let action = "no such page; lit by vertex";
                let by_vertex = lightmap_index::BY_VERTEX;
                log.replace(
                    element,
                    Field("lightmapNum", lightmap_offset),
                    &mut s.lightmap,
                    by_vertex,
                    action,
                );
            }
            let drawn_by_indices = match s.kind {
                SurfaceKind::Planar | SurfaceKind::TriangleSoup => true,
                SurfaceKind::Patch => {
                    let points = patch_points(element, s.patch_width, s.patch_height)?;
                    let action = "not width × height of the patch, which counts";
                    log.replace(
                        element,
                        Field("numVerts", 16),
                        &mut s.num_verts,
                        points,
                        action,
                    );
                    false
                }
                SurfaceKind::Flare => {
                    if !in_range(s.first_vert, s.num_verts, vertices) {
                        let action = "unused by a flare; taken as 0";
                        log.replace(element, first_vert, &mut s.first_vert, 0, action);
                        log.replace(element, Field("numVerts", 16), &mut s.num_verts, 0, action);
                    }
                    false
                }
                SurfaceKind::Foliage if has_foliage => {
                    check_foliage(element, s)?;
                    true
                }
                SurfaceKind::Foliage | SurfaceKind::Other(_) => {
                    let most = if has_foliage { 5 } else { 4 };
                    return Err(Error::Value {
                        lump: Lump::Surfaces,
                        element,
                        field: "surfaceType",
                        value: i64::from(s.kind.raw()),
                        expected: format!("not one of 1 to {most}"),
                    });
                }
            };
            let count = s.num_verts;
            log.range(
                element,
                first_vert,
                &mut s.first_vert,
                count,
                Lump::DrawVerts,
                vertices,
            )?;
            let num_indexes = Field("numIndexes", 24);
            if drawn_by_indices {
                if s.num_indices > 0 && s.num_indices % 3 != 0 {
                    let whole = s.num_indices - s.num_indices % 3;
                    let action = "not a multiple of three; the rest is ignored";
                    log.replace(element, num_indexes, &mut s.num_indices, whole, action);
                }
                let count = s.num_indices;
                let target = Lump::DrawIndexes;
                log.range(
                    element,
                    first_index,
                    &mut s.first_index,
                    count,
                    target,
                    indices,
                )?;
            } else if !in_range(s.first_index, s.num_indices, indices) {
                let action = "unused by this kind of surface; taken as 0";
                log.replace(element, first_index, &mut s.first_index, 0, action);
                log.replace(element, num_indexes, &mut s.num_indices, 0, action);
            }
        }
        for (element, layers) in self.layers.surfaces.iter_mut().enumerate() {
            for (layer, page) in layers.lightmaps.iter_mut().enumerate() {
                if *page < lightmap_index::TWO_D || i64::from(*page) >= pages {
                    let field = Field(
                        "lightmapNum of a further layer",
                        lightmap_offset + 4 + layer * 4,
                    );
                    let action = "no such page; lit by vertex";
                    log.replace(element, field, page, lightmap_index::BY_VERTEX, action);
                }
            }
        }
        Ok(())
    }

    /// Triangle corners must lie among their surface's vertices.
    pub(super) fn check_indices(&self) -> Result<(), Error> {
        for s in &self.surfaces {
            let vertices = match s.kind {
                SurfaceKind::Planar | SurfaceKind::TriangleSoup => s.num_verts,
                SurfaceKind::Foliage => s.patch_height,
                _ => continue,
            };
            let corners = self.surface_indices(s);
            let outside = |&corner: &i32| corner < 0 || corner >= vertices;
            if let Some(at) = corners.iter().position(outside) {
                let element = usize::try_from(s.first_index).unwrap_or(0) + at;
                return Err(Error::Value {
                    lump: Lump::DrawIndexes,
                    element,
                    field: "corner",
                    value: i64::from(corners.get(at).copied().unwrap_or(0)),
                    expected: format!("outside the {vertices} vertices of its surface"),
                });
            }
        }
        Ok(())
    }
}

/// Foliage must have the vertices of its mesh and one for each place.
fn check_foliage(element: usize, s: &Surface) -> Result<(), Error> {
    let (places, mesh) = (i64::from(s.patch_width), i64::from(s.patch_height));
    if places >= 0 && mesh >= 0 && places + mesh <= i64::from(s.num_verts) {
        return Ok(());
    }
    Err(Error::Value {
        lump: Lump::Surfaces,
        element,
        field: "patchHeight",
        value: mesh,
        expected: format!(
            "which with the {places} places of patchWidth is not among its {} vertices",
            s.num_verts
        ),
    })
}

/// Number of control points of a patch whose sizes are acceptable to the engine.
fn patch_points(element: usize, width: i32, height: i32) -> Result<i32, Error> {
    for (field, size) in [("patchWidth", width), ("patchHeight", height)] {
        if size < 3 || size % 2 == 0 {
            return Err(Error::Value {
                lump: Lump::Surfaces,
                element,
                field,
                value: i64::from(size),
                expected: "but patches have an odd number of at least 3".to_owned(),
            });
        }
    }
    width.checked_mul(height).ok_or(Error::Value {
        lump: Lump::Surfaces,
        element,
        field: "patchWidth",
        value: i64::from(width),
        expected: format!("too much for patchHeight {height}"),
    })
}
