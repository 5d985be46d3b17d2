//! Models with key frames or skeletons: frames, level of detail, materials, vertices.
//!
//! Source: engine behaviour of `renderer_opengl1` (model surfaces).

use std::sync::Arc;

use glam::Vec3;
use q3model::{BoneMatrix, Frame, Iqm, IqmSurface, MdrSurface};
use shaders::types::Vertex;
use support::{Aabb, slice};

use super::cull;
use super::gather::{Gatherer, count};
use super::key_frames::{self, Frames};
use super::mesh::RawMesh;
use super::shapes::MeshBuilder;
use super::turned::Way;
use super::{DynamicMesh, LookPartMut, MeshId, Shape, ViewScene};
use crate::api::{RefEntity, renderfx};
use crate::assets::{IqmModel, Md3Lod, MdrModel, Model};
use crate::settings::ModelShadows;

/// Box for the fog of a skeletal model without bounds, units.
const UNKNOWN: Aabb = Aabb::new(Vec3::splat(-8.0), Vec3::splat(8.0));

/// A model placed in a view.
pub(super) struct Placed<'a> {
    /// Number of the entity in the engine.
    number: u32,
    entity: &'a RefEntity,
    /// Visible in mirrors and portals only, in a view that is neither.
    hidden: bool,
    /// Material of its planar shadow.
    shadow: Option<u32>,
    instance: u32,
    /// Fog volume plus one; 0: no fog.
    fog: u32,
}

/// The single key frame that a model is drawn in.
#[derive(Clone, Copy)]
struct StillFrame {
    frame: usize,
    /// The model has no other frame.
    only: bool,
}

/// Source of a model's surface.
struct SurfaceSource<'a> {
    id: MeshId,
    name: &'a str,
    /// The model's own materials for the surface.
    materials: &'a [u32],
    /// The frame, if the model is not between two.
    still: Option<StillFrame>,
}

impl Placed<'_> {
    fn source<'a>(
        &self,
        name: &'a str,
        materials: &'a [u32],
        level: usize,
        surface: usize,
        still: Option<StillFrame>,
    ) -> SurfaceSource<'a> {
        SurfaceSource {
            id: MeshId {
                model: self.entity.model,
                level: count(level),
                surface: count(surface),
            },
            name,
            materials,
            still,
        }
    }
}

impl Gatherer<'_> {
    /// Adds a model of triangles. `hidden`: it only casts a shadow.
    pub(super) fn add_animated(
        &mut self,
        number: u32,
        entity: &RefEntity,
        hidden: bool,
        model: &Model,
        out: &mut ViewScene,
    ) {
        let shadow = self.shadow_material(entity);
        if hidden && shadow.is_none() {
            return;
        }
        let placed = Placed {
            number,
            entity,
            hidden,
            shadow,
            instance: 0,
            fog: 0,
        };
        match model {
            Model::Mesh { lods } => self.add_md3(placed, lods, out),
            Model::Mdr(model) => self.add_mdr(placed, model, out),
            Model::Iqm(model) => self.add_iqm(placed, model, out),
            Model::Inline { .. } => {}
        }
    }

    fn add_md3(&mut self, placed: Placed<'_>, lods: &[Arc<Md3Lod>], out: &mut ViewScene) {
        let Some(finest) = slice::get(lods, 0) else {
            return;
        };
        let frames = Frames::of(placed.entity, finest.md3.frames.len());
        let Some(level) = self.level(&placed, &finest.md3.frames, frames, lods.len()) else {
            return;
        };
        let Some(lod) = slice::get(lods, level) else {
            return;
        };
        // coarser levels may have fewer frames
        let frames = if lod.md3.frames.len() > frames.new.max(frames.old) {
            frames
        } else {
            Frames::of(&RefEntity::default(), 1)
        };
        let Some(frame) = self.frame_in_sight(&placed, &lod.md3.frames, frames) else {
            return; // out of sight
        };
        let placed = self.place(placed, frame.local_origin, frame.radius, out);
        let still = (frames.backlerp == 0.0).then_some(StillFrame {
            frame: frames.new,
            only: lod.md3.frames.len() == 1,
        });
        for (index, (surface, own)) in lod.md3.surfaces.iter().zip(&lod.materials).enumerate() {
            let source = placed.source(&surface.name, own, level, index, still);
            self.add_surface(&placed, source, out, |out| {
                let base = count(out.vertices.len());
                key_frames::append_vertices(surface, frames, out.vertices);
                append_triangles(base, &surface.triangles, out.indices);
            });
        }
    }

    fn add_mdr(&mut self, placed: Placed<'_>, model: &MdrModel, out: &mut ViewScene) {
        let mdr = &model.mdr;
        let frames = Frames::of(placed.entity, mdr.frames.len());
        let Some(level) = self.level(&placed, &mdr.frames, frames, mdr.lods.len()) else {
            return;
        };
        let (Some(surfaces), Some(materials)) = (
            slice::get(&mdr.lods, level),
            slice::get(&model.materials, level),
        ) else {
            return;
        };
        let Some(frame) = self.frame_in_sight(&placed, &mdr.frames, frames) else {
            return; // out of sight
        };
        let placed = self.place(placed, frame.local_origin, frame.radius, out);
        let mut bones = std::mem::take(&mut self.scratch.bones);
        mdr.pose(frames.new, frames.old, frames.backlerp, &mut bones);
        for (index, (surface, own)) in surfaces.iter().zip(materials).enumerate() {
            let own = std::slice::from_ref(own);
            let source = placed.source(&surface.name, own, level, index, None);
            self.add_surface(&placed, source, out, |out| {
                append_mdr(surface, &bones, out);
            });
        }
        self.scratch.bones = bones;
    }

    fn add_iqm(&mut self, placed: Placed<'_>, model: &IqmModel, out: &mut ViewScene) {
        let iqm = &model.iqm;
        let frames = Frames::of(placed.entity, iqm.num_frames.max(iqm.bounds.len()));
        let bounds = |frame: usize| {
            let &(mins, maxs) = iqm.bounds.get(frame)?;
            Some(Aabb::new(mins, maxs))
        };
        let new = bounds(frames.new);
        if let (Some(new), Some(old)) = (new, bounds(frames.old))
            && self.culls_box(placed.entity, &new.union(old))
        {
            return;
        }
        let around = new.unwrap_or(UNKNOWN);
        let half = around.size() * 0.5;
        let placed = self.place(placed, around.mins + half, half.length(), out);
        let mut pose = std::mem::take(&mut self.scratch.bones);
        let Frames { new, old, backlerp } = frames;
        iqm.pose(&model.skeleton, new, old, backlerp, &mut pose);
        let still = (backlerp == 0.0).then_some(StillFrame {
            frame: new,
            only: iqm.num_frames <= 1,
        });
        for (index, (surface, own)) in iqm.surfaces.iter().zip(&model.materials).enumerate() {
            let own = std::slice::from_ref(own);
            let source = placed.source(&surface.name, own, 0, index, still);
            self.add_surface(&placed, source, out, |out| {
                append_iqm(iqm, surface, &pose, out);
            });
        }
        self.scratch.bones = pose;
    }

    /// Level of detail of a model, by the projected size of its frame in the finest level.
    fn level(
        &self,
        placed: &Placed<'_>,
        finest: &[Frame],
        frames: Frames,
        levels: usize,
    ) -> Option<usize> {
        let (frame, at) = (slice::get(finest, frames.new)?, placed.entity.origin);
        let settings = self.input.settings;
        Some(key_frames::level_of_detail(
            levels, frame, at, &self.view, settings,
        ))
    }

    /// The newer of the model's two frames in its level of detail; `None` if culled.
    fn frame_in_sight<'m>(
        &self,
        placed: &Placed<'_>,
        list: &'m [Frame],
        frames: Frames,
    ) -> Option<&'m Frame> {
        let new = slice::get(list, frames.new)?;
        let old = slice::get(list, frames.old)?;
        let lies = cull::model(placed.entity, new, old, self.planes());
        (!lies.is_outside()).then_some(new)
    }

    /// Lights a model, and finds its fog by its bounding sphere: `middle` is in model space, but not rotated, as in the
    /// engine.
    fn place<'e>(
        &self,
        placed: Placed<'e>,
        middle: Vec3,
        radius: f32,
        out: &mut ViewScene,
    ) -> Placed<'e> {
        let fog = self.world.map_or(0, |world| {
            world.fog_of_sphere(placed.entity.origin + middle, radius)
        });
        Placed {
            instance: self.push_instance(placed.entity, out),
            fog,
            ..placed
        }
    }

    /// Adds a surface and its shadow. `append` appends its vertices and triangles to the view.
    fn add_surface(
        &mut self,
        placed: &Placed<'_>,
        source: SurfaceSource<'_>,
        out: &mut ViewScene,
        append: impl Fn(MeshBuilder<'_>),
    ) {
        let materials = self.input.materials;
        let asked = self.surface_material(placed.entity, source.name, source.materials);
        // only opaque surfaces outside of fog cast shadows
        let opaque = materials.get(asked).sort == shaderscript::sort::OPAQUE;
        let shadow = placed.shadow.filter(|_| opaque && placed.fog == 0);
        let volumes = opaque && placed.fog == 0 && self.casts_volumes(placed.entity);
        for asked in shadow.into_iter().chain((!placed.hidden).then_some(asked)) {
            let material = materials.resolve(asked);
            let mut raw = RawMesh::begin(out, material, placed.instance, placed.fog);
            raw.shape = Shape::Animated(source.id);
            if self.add_rigid(&source, &raw, out, &append) {
                continue;
            }
            append(out.builder());
            if volumes && Some(asked) != shadow {
                out.add_shadow_volumes(&raw);
            }
            let turns = self.input.materials.get(material).faces_camera();
            let ways = self.ways_of(placed.entity, turns);
            for way in 0..ways {
                let Some(Way { paths, .. }) = self.way(way, ways) else {
                    continue; // nothing is seen on it
                };
                if way > 0 {
                    let shape = raw.shape;
                    raw = RawMesh::begin(out, material, placed.instance, placed.fog);
                    raw.shape = shape;
                    append(out.builder());
                }
                raw.paths = paths;
                self.finish_and_list(raw, asked, placed.number, Some(placed.entity), out);
            }
        }
    }

    /// Adds a surface as a shared rigid mesh. `false` if it moves, and in the classic look, which uploads all vertices
    /// of a view together.
    fn add_rigid(
        &mut self,
        source: &SurfaceSource<'_>,
        raw: &RawMesh,
        out: &mut ViewScene,
        append: &impl Fn(MeshBuilder<'_>),
    ) -> bool {
        let deforms = self.input.materials.get(raw.material).deforms();
        let (Some(still), LookPartMut::Traced(traced)) =
            (source.still.filter(|_| !deforms), out.look.part())
        else {
            return false;
        };
        let make = || {
            append(MeshBuilder {
                vertices: &mut out.vertices,
                indices: &mut out.indices,
            });
            let vertices = out.vertices.split_off(raw.first_vertex);
            let mut indices = out.indices.split_off(raw.first_index);
            for index in &mut indices {
                *index = index.wrapping_sub(count(raw.first_vertex));
            }
            let finite = vertices.iter().all(|v| v.position.is_finite());
            if finite {
                (vertices, indices)
            } else {
                (Vec::new(), Vec::new())
            }
        };
        let rigid = &mut self.scratch.rigid;
        let Some(mesh) = rigid.get(source.id, still.frame, still.only, make) else {
            return false;
        };
        if !mesh.indices.is_empty() {
            let shape = Shape::Rigid(count(traced.rigid.len()));
            traced.rigid.push(mesh);
            out.meshes.push(DynamicMesh {
                first_index: count(out.indices.len()),
                index_count: 0,
                first_vertex: count(out.vertices.len()),
                vertex_count: 0,
                material: raw.material,
                instance: raw.instance,
                fog: raw.fog,
                world_surface: None,
                shape,
                paths: raw.paths,
            });
        }
        true
    }

    /// Whether rays find the shadows of models, so that none is drawn.
    pub(super) fn has_traced_shadows(&self) -> bool {
        self.traced || self.input.traced_shadows
    }

    /// The material of an entity's planar shadow (`cg_shadows 3`), if it casts one. Traced views have traced shadows.
    fn shadow_material(&self, entity: &RefEntity) -> Option<u32> {
        let casts = !self.has_traced_shadows()
            && self.input.settings.shadows == ModelShadows::Planar
            && entity.renderfx & renderfx::SHADOW_PLANE != 0
            && entity.shadow_plane.is_finite();
        self.input.materials.internal().shadow.filter(|_| casts)
    }

    /// Whether an entity casts shadow volumes (`cg_shadows 2`).
    fn casts_volumes(&self, entity: &RefEntity) -> bool {
        self.input.settings.shadows == ModelShadows::Volumes
            && !self.has_traced_shadows()
            && entity.renderfx & (renderfx::NO_SHADOW | renderfx::DEPTH_HACK) == 0
    }

    /// The material of a model's surface: that of the entity, of its skin, or of the model.
    fn surface_material(&self, entity: &RefEntity, name: &str, own: &[u32]) -> u32 {
        let materials = self.input.materials;
        if entity.custom_shader != 0 {
            return materials.of_handle(entity.custom_shader);
        }
        if let Some(skin) = self.input.skins.get(entity.custom_skin) {
            return skin.material(name).unwrap_or(0);
        }
        let wrapped = usize::try_from(entity.skin_num)
            .ok()
            .and_then(|n| n.checked_rem(own.len()));
        own.get(wrapped.unwrap_or(0)).copied().unwrap_or(0)
    }
}

fn append_triangles(base: u32, triangles: &[[u32; 3]], out: &mut Vec<u32>) {
    out.extend(triangles.iter().flatten().map(|i| base.wrapping_add(*i)));
}

fn append_mdr(surface: &MdrSurface, bones: &[BoneMatrix], out: MeshBuilder<'_>) {
    let base = count(out.vertices.len());
    out.vertices.extend(surface.vertices.iter().map(|vertex| {
        let (position, normal) = surface.skinned(vertex, bones);
        Vertex {
            position,
            normal,
            st: vertex.st,
            color: u32::MAX,
            ..Vertex::default()
        }
    }));
    append_triangles(base, &surface.triangles, out.indices);
}

fn append_iqm(iqm: &Iqm, surface: &IqmSurface, pose: &[BoneMatrix], out: MeshBuilder<'_>) {
    let base = count(out.vertices.len());
    let vertices = iqm.surface_vertices(surface).iter();
    out.vertices.extend(vertices.map(|vertex| {
        let (position, normal) = vertex.skinned(pose);
        Vertex {
            position,
            normal,
            st: vertex.st,
            color: u32::from_le_bytes(vertex.color),
            ..Vertex::default()
        }
    }));
    append_triangles(base, &surface.triangles, out.indices);
}
