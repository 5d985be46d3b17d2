//! Finishes moving meshes: deforms them and lists them in the view.

use glam::Vec3;
use shaders::types::Vertex;
use shaderscript::Deform;
use shaderscript::eval::{self, DeformContext, DeformVertex, ShadowProjection};
use support::slice::{self, part};

use super::entity::into_axes;
use super::shapes::MeshBuilder;
use super::{DynamicMesh, LookPartMut, Shape, View, ViewScene, turned};
use crate::api::{RefDef, RefEntity};
use crate::assets::Materials;

/// Buffers for deforming.
#[derive(Default)]
pub(super) struct DeformScratch {
    vertices: Vec<DeformVertex>,
    indices: Vec<u32>,
    lightmaps: Vec<glam::Vec2>,
}

/// A mesh, before deformation, at the end of a view's vertices and indices.
#[derive(Clone, Copy, Debug)]
pub(super) struct RawMesh {
    /// Its first vertex in [`ViewScene::vertices`].
    pub first_vertex: usize,
    /// Its first index in [`ViewScene::indices`].
    pub first_index: usize,
    /// Index of the material, after remapping.
    pub material: u32,
    /// Index of its instance.
    pub instance: u32,
    /// Fog volume plus one.
    pub fog: u32,
    /// Index of the world surface that it is a copy of.
    pub world_surface: Option<u32>,
    /// Part of the mesh that stays the same in the next frame.
    pub shape: Shape,
    /// Paths that hit the mesh, see [`turned`].
    pub paths: u8,
}

impl RawMesh {
    /// A mesh that begins at the current end.
    pub fn begin(out: &ViewScene, material: u32, instance: u32, fog: u32) -> Self {
        Self {
            first_vertex: out.vertices.len(),
            first_index: out.indices.len(),
            material,
            instance,
            fog,
            world_surface: None,
            shape: Shape::Changing,
            paths: turned::ALL,
        }
    }
}

impl ViewScene {
    /// Builder that appends to the view.
    pub(super) fn builder(&mut self) -> MeshBuilder<'_> {
        MeshBuilder {
            vertices: &mut self.vertices,
            indices: &mut self.indices,
        }
    }

    /// Adds the shadow volumes of a mesh before deformation, in the classic look.
    pub(super) fn add_shadow_volumes(&mut self, raw: &RawMesh) {
        let (
            LookPartMut::Classic(classic),
            Some(instance),
            Some(vertices),
            Some(indices),
            Ok(base),
        ) = (
            self.look.part(),
            slice::get(&self.instances, raw.instance as usize),
            self.vertices.get(raw.first_vertex..),
            self.indices.get(raw.first_index..),
            u32::try_from(raw.first_vertex),
        )
        else {
            return;
        };
        classic
            .shadows
            .add(raw.instance, instance, vertices, indices, base);
    }
}

/// Deforms the mesh `raw`, which ends at the current end, for `view`, and lists it. `None` if no triangle remains or a
/// position is not finite.
pub(super) fn finish(
    raw: RawMesh,
    entity: Option<&RefEntity>,
    materials: &Materials,
    def: &RefDef,
    view: &View,
    scratch: &mut DeformScratch,
    out: &mut ViewScene,
) -> Option<DynamicMesh> {
    let material = materials.get(raw.material);
    if material.deforms() {
        deform(&raw, entity, material, def, view, scratch, out);
    }
    let vertex_count = out.vertices.len() - raw.first_vertex;
    let index_count = out.indices.len() - raw.first_index;
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    // acceleration structures require finite positions
    let finite = out
        .vertices
        .get(raw.first_vertex..)
        .is_some_and(|added| added.iter().all(|v| v.position.is_finite()));
    if index_count == 0 || vertex_count == 0 || !finite {
        out.vertices.truncate(raw.first_vertex);
        out.indices.truncate(raw.first_index);
        return None;
    }
    let mesh = DynamicMesh {
        first_index: count(raw.first_index),
        index_count: count(index_count),
        first_vertex: count(raw.first_vertex),
        vertex_count: count(vertex_count),
        material: raw.material,
        instance: raw.instance,
        fog: raw.fog,
        world_surface: raw.world_surface,
        shape: raw.shape,
        paths: raw.paths,
    };
    out.meshes.push(mesh);
    Some(mesh)
}

fn deform(
    raw: &RawMesh,
    entity: Option<&RefEntity>,
    material: &crate::assets::Material,
    def: &RefDef,
    view: &View,
    scratch: &mut DeformScratch,
    out: &mut ViewScene,
) {
    let Some(instance) = slice::get(&out.instances, raw.instance as usize).copied() else {
        return;
    };
    let base = u32::try_from(raw.first_vertex).unwrap_or(u32::MAX);
    let DeformScratch {
        vertices,
        indices,
        lightmaps,
    } = scratch;
    vertices.clear();
    lightmaps.clear();
    for v in part(&out.vertices, raw.first_vertex..) {
        lightmaps.push(v.lightmap);
        vertices.push(DeformVertex {
            position: v.position,
            normal: v.normal,
            st: v.st,
            color: v.color.to_le_bytes(),
        });
    }
    indices.clear();
    let raw_indices = part(&out.indices, raw.first_index..);
    indices.extend(raw_indices.iter().map(|i| i.wrapping_sub(base)));
    let texts: [&[u8]; 8] = std::array::from_fn(|i| def.text[i].as_slice());
    let scaled = entity.filter(|e| e.non_normalized_axes);
    let context = DeformContext {
        time: {
            let time = f64::from(instance.time) - f64::from(material.time_offset);
            material
                .shader
                .clamp_time
                .map_or(time, |clamp| time.min(f64::from(clamp)))
        },
        frame_time: f64::from(def.time_ms) / 1000.0,
        view_axes: view.axis.map(|axis| into_axes(&instance, axis)),
        mirrored: view.mirrored,
        axis_length: scaled.map_or(1.0, |e| e.axis[0].length()),
        shadow: entity.map(|e| ShadowProjection {
            up: into_axes(&instance, Vec3::Z),
            ground_distance: e.origin.z - e.shadow_plane,
            light: instance.light_direction,
        }),
        texts: &texts,
    };
    eval::deform(&material.shader.deforms, vertices, indices, &context);
    out.vertices.truncate(raw.first_vertex);
    out.indices.truncate(raw.first_index);
    // deformations that rebuild quads write the same values to both texture coordinates
    let rebuilt = (material.shader.deforms.iter())
        .any(|deform| matches!(deform, Deform::AutoSprite | Deform::Text(_)));
    out.vertices
        .extend(vertices.iter().enumerate().map(|(i, v)| {
            Vertex {
                position: v.position,
                normal: v.normal,
                st: v.st,
                lightmap: lightmaps
                    .get(i)
                    .copied()
                    .filter(|_| !rebuilt)
                    .unwrap_or(v.st),
                color: u32::from_le_bytes(v.color),
            }
        }));
    out.indices
        .extend(indices.iter().map(|i| base.wrapping_add(*i)));
}
