//! One view gathered: the world, polygons, entities, in the engine's order.

use glam::{Vec3, Vec4};
use q3model::Frame;
use shaders::types::Vertex;
use shaders::types::constants::NO_TEXTURE;

use super::entity;
use super::key_frames::{self, Frames};
use super::lighting;
use super::mesh::{self, DeformScratch, RawMesh};
use super::portal;
use super::shapes::MeshBuilder;
use super::surfaces::{self, LocalView, PendingDeform, SurfaceRun, WORLD_ENTITY, sort_key};
use super::{DynamicMesh, GatherInput, Look, Scene, Submodel, View, ViewScene};
use crate::api::{DynamicLight, EntityKind, PolyVert, RefDef, RefEntity, rdflags, renderfx};
use crate::assets::{Md3Lod, Model};
use crate::world::{Bounds, VisibleQuery, VisibleSet, WorldData};

/// Distance of the far plane without a world, units.
const FAR_WITHOUT_WORLD: f32 = 2048.0;

/// Memory that gathering reuses.
#[derive(Default)]
pub(super) struct Scratch {
    deform: DeformScratch,
    pending: Vec<PendingDeform>,
    lights: Vec<(Vec3, f32)>,
}

/// The views of a scene: at most one through a portal or mirror (classic look), then the main one.
pub(super) fn views(
    scene: &mut Scene,
    input: &GatherInput<'_>,
    def: &RefDef,
    look: Look,
) -> Vec<ViewScene> {
    let mut out = Vec::with_capacity(2);
    let view = View::new(def, input.settings.znear, FAR_WITHOUT_WORLD);
    let mut main = scene.pool.pop().unwrap_or_else(|| empty_view(def, view));
    Gatherer::new(scene, input, def, look, view).gather(def.view_origin, &mut main);
    match look {
        Look::Traced => portal::find_all(&scene.entities, input, def, &mut main),
        Look::Classic => {
            if let Some(portal) = portal::find_first(&scene.entities, input, def, &main) {
                let seen = portal::view_through(&portal, &main.view);
                let mut behind = scene.pool.pop().unwrap_or_else(|| empty_view(def, seen));
                Gatherer::new(scene, input, def, look, seen).gather(portal.pvs_origin, &mut behind);
                main.portals.push(portal);
                out.push(behind);
            }
        }
    }
    out.push(main);
    out
}

fn empty_view(def: &RefDef, view: View) -> ViewScene {
    ViewScene {
        def: *def,
        view,
        time: 0.0,
        instances: Vec::new(),
        vertices: Vec::new(),
        indices: Vec::new(),
        meshes: Vec::new(),
        submodels: Vec::new(),
        surfaces: Vec::new(),
        dlights: Vec::new(),
        portals: Vec::new(),
        has_world: false,
        skies: Vec::new(),
    }
}

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// Everything that one view is gathered from.
struct Gatherer<'a> {
    input: &'a GatherInput<'a>,
    entities: &'a [RefEntity],
    polys: &'a [super::Poly],
    poly_vertices: &'a [PolyVert],
    lights: &'a [DynamicLight],
    visible: &'a mut VisibleSet,
    scratch: &'a mut Scratch,
    def: &'a RefDef,
    look: Look,
    view: View,
    /// The world, when the view shows it.
    world: Option<&'a WorldData>,
    frustum: [Vec4; 4],
    /// The frustum counts: not for the traced look, whose rays go anywhere.
    culling: bool,
}

impl<'a> Gatherer<'a> {
    fn new(
        scene: &'a mut Scene,
        input: &'a GatherInput<'a>,
        def: &'a RefDef,
        look: Look,
        view: View,
    ) -> Self {
        let settings = input.settings;
        let dynamic = settings.dynamic_light && !settings.vertex_light;
        let shows_world = def.flags & rdflags::NO_WORLD_MODEL == 0;
        Self {
            input,
            entities: if settings.draw_entities {
                &scene.entities
            } else {
                &[]
            },
            polys: &scene.polys,
            poly_vertices: &scene.poly_vertices,
            lights: if dynamic { &scene.lights } else { &[] },
            visible: if view.is_portal {
                &mut scene.portal_visible
            } else {
                &mut scene.visible
            },
            scratch: &mut scene.scratch,
            def,
            look,
            view,
            world: input.world.filter(|_| shows_world),
            frustum: view.frustum(),
            culling: look == Look::Classic && !settings.no_cull,
        }
    }

    fn gather(mut self, pvs_origin: Vec3, out: &mut ViewScene) {
        self.clear(out);
        if let Some(world) = self.world {
            self.find_visible(world, pvs_origin, out);
            self.add_world(world, out);
        }
        self.add_polys(out);
        let entities = self.entities;
        for (number, entity) in entities.iter().enumerate() {
            self.add_entity(count(number), entity, out);
        }
        // equal keys keep the order of submission
        out.surfaces.sort_by_key(|surface| surface.sort_key);
    }

    fn clear(&self, out: &mut ViewScene) {
        out.def = *self.def;
        out.view = self.view;
        out.time = self.def.time_ms as f32 / 1000.0;
        out.instances.clear();
        out.vertices.clear();
        out.indices.clear();
        out.meshes.clear();
        out.submodels.clear();
        out.surfaces.clear();
        out.dlights.clear();
        out.dlights.extend_from_slice(self.lights);
        out.portals.clear();
        out.has_world = self.world.is_some();
        for sky in &mut out.skies {
            sky.triangles.clear();
        }
        out.skies.clear();
        out.instances
            .push(entity::world_instance(&self.view, out.time));
    }

    /// The frustum's planes; none when nothing is culled.
    fn planes(&self) -> &[Vec4] {
        if self.culling { &self.frustum } else { &[] }
    }

    /// Finds the visible surfaces and sets the far plane to the farthest corner of what is visible.
    fn find_visible(&mut self, world: &WorldData, pvs_origin: Vec3, out: &mut ViewScene) {
        let settings = self.input.settings;
        let frustum: &[Vec4] = if self.culling { &self.frustum } else { &[] };
        self.visible.gather(
            world,
            &VisibleQuery {
                pvs_origin,
                area_mask: &self.def.area_mask,
                frustum,
                no_vis: settings.no_vis,
                locked: settings.lock_pvs,
            },
        );
        let bounds = self.visible.bounds;
        if bounds.mins.cmple(bounds.maxs).all() {
            let eye = self.view.origin;
            let far = bounds
                .corners()
                .into_iter()
                .map(|corner| corner.distance(eye))
                .fold(0.0, f32::max);
            self.view.far = far.max(self.view.near * 2.0);
            self.view.update();
            out.view = self.view;
        }
    }

    fn add_world(&mut self, world: &'a WorldData, out: &mut ViewScene) {
        let settings = self.input.settings;
        if !settings.draw_world {
            return;
        }
        let mut pending = std::mem::take(&mut self.scratch.pending);
        let mut lights = std::mem::take(&mut self.scratch.lights);
        surfaces::local_lights(
            self.lights,
            Vec3::ZERO,
            &[Vec3::X, Vec3::Y, Vec3::Z],
            &mut lights,
        );
        let local = LocalView {
            eye: self.view.origin,
            frustum: self.planes(),
            lights: &lights,
            forward: self.view.axis[0],
        };
        let run = self.run(world, &local, 0, WORLD_ENTITY);
        match self.look {
            Look::Classic => {
                for &surface in &self.visible.surfaces {
                    pending.extend(run.add(surface, out));
                }
            }
            Look::Traced => {
                let deformed = self
                    .visible
                    .surfaces
                    .iter()
                    .filter(|&&surface| world.is_deformed(surface));
                pending.extend(deformed.filter_map(|&s| self.traced_deform(world, s)));
            }
        }
        self.add_deformed(world, &mut pending, 0, None, out);
        self.scratch.pending = pending;
        self.scratch.lights = lights;
    }

    fn run<'b>(
        &self,
        world: &'b WorldData,
        local: &'b LocalView<'b>,
        instance: u32,
        entity: u32,
    ) -> SurfaceRun<'b>
    where
        'a: 'b,
    {
        SurfaceRun {
            world,
            materials: self.input.materials,
            local,
            instance,
            entity,
            curve_error: self.input.settings.lod_curve_error,
            no_curves: self.input.settings.no_curves,
        }
    }

    fn traced_deform(&self, world: &WorldData, surface: u32) -> Option<PendingDeform> {
        let found = world.surfaces.get(surface as usize)?;
        (found.index_count > 0).then(|| PendingDeform {
            surface,
            material: self.input.materials.resolve(found.material),
            sort_key: 0,
            dlights: 0,
        })
    }

    /// Copies surfaces of the map into the view's vertices and deforms them. Empties `pending`.
    fn add_deformed(
        &mut self,
        world: &WorldData,
        pending: &mut Vec<PendingDeform>,
        instance: u32,
        entity: Option<&RefEntity>,
        out: &mut ViewScene,
    ) {
        for deform in pending.drain(..) {
            let Some(surface) = world.surfaces.get(deform.surface as usize) else {
                continue;
            };
            let mut raw = RawMesh::begin(out, deform.material, instance, surface.fog);
            raw.world_surface = Some(deform.surface);
            let first = surface.first_index as usize;
            let range = first..first + surface.index_count as usize;
            let base = count(out.vertices.len());
            out.vertices
                .extend_from_slice(world.surface_vertices(surface));
            out.indices.extend(
                world
                    .indices
                    .get(range)
                    .unwrap_or_default()
                    .iter()
                    .map(|i| i.wrapping_sub(surface.first_vertex).wrapping_add(base)),
            );
            let mesh = self.finish(raw, entity, out);
            if let Some(mesh) = mesh.filter(|_| self.look == Look::Classic) {
                surfaces::push_mesh_surface(
                    out,
                    &mesh,
                    deform.sort_key,
                    surface.lightmap,
                    deform.dlights,
                );
            }
        }
    }

    fn finish(
        &mut self,
        raw: RawMesh,
        entity: Option<&RefEntity>,
        out: &mut ViewScene,
    ) -> Option<DynamicMesh> {
        mesh::finish(
            raw,
            entity,
            self.input.materials,
            self.def,
            &mut self.scratch.deform,
            out,
        )
    }

    /// Finishes a mesh that is no world surface and lists it for the classic look. `asked` is the material before
    /// remapping, which decides the order.
    fn finish_and_list(
        &mut self,
        raw: RawMesh,
        asked: u32,
        number: u32,
        entity: Option<&RefEntity>,
        out: &mut ViewScene,
    ) {
        let mesh = self.finish(raw, entity, out);
        if let Some(mesh) = mesh.filter(|_| self.look == Look::Classic) {
            let rank = self.input.materials.rank(asked);
            let key = sort_key(rank, number, mesh.fog, false);
            surfaces::push_mesh_surface(out, &mesh, key, NO_TEXTURE, 0);
        }
    }

    /// Polygons, each a fan; neighbours of one material and fog become one mesh.
    fn add_polys(&mut self, out: &mut ViewScene) {
        let mut open: Option<(RawMesh, u32)> = None;
        let polys = self.polys;
        for poly in polys {
            let range = poly.first_vertex..poly.first_vertex + poly.vertex_count;
            let corners = self.poly_vertices.get(range).unwrap_or_default();
            let bounds = corners
                .iter()
                .fold(Bounds::EMPTY, |b, v| b.with(v.position));
            let fog = self.world.map_or(0, |world| world.fog_of_box(&bounds));
            let same = open.is_some_and(|(raw, asked)| asked == poly.material && raw.fog == fog);
            if !same {
                if let Some((raw, asked)) = open.take() {
                    self.finish_and_list(raw, asked, WORLD_ENTITY, None, out);
                }
                let material = self.input.materials.resolve(poly.material);
                open = Some((RawMesh::begin(out, material, 0, fog), poly.material));
            }
            append_fan(corners, out);
        }
        if let Some((raw, asked)) = open {
            self.finish_and_list(raw, asked, WORLD_ENTITY, None, out);
        }
    }

    fn add_entity(&mut self, number: u32, entity: &RefEntity, out: &mut ViewScene) {
        let first_person = entity.renderfx & renderfx::FIRST_PERSON != 0;
        if first_person && self.view.is_portal {
            return;
        }
        // in the main view they only cast shadows, which the classic look does not draw
        let third_person = entity.renderfx & renderfx::THIRD_PERSON != 0;
        let hidden = third_person && !self.view.is_portal && self.look == Look::Classic;
        match entity.kind {
            EntityKind::PortalSurface | EntityKind::Poly => {}
            EntityKind::Model => self.add_model(number, entity, hidden, out),
            _ if hidden => {}
            _ => self.add_effect(number, entity, out),
        }
    }

    fn add_effect(&mut self, number: u32, entity: &RefEntity, out: &mut ViewScene) {
        let needs_end = entity.kind != EntityKind::Sprite;
        if needs_end && !entity.old_origin.is_finite() {
            return;
        }
        let materials = self.input.materials;
        let asked = material_of_handle(materials.len(), entity.custom_shader);
        let material = match entity.kind {
            EntityKind::Beam => materials.internal().beam,
            _ => materials.resolve(asked),
        };
        let no_fog = entity.renderfx & renderfx::CROSSHAIR != 0;
        let fog = self
            .world
            .filter(|_| !no_fog)
            .map_or(0, |w| w.fog_of_sphere(entity.origin, entity.radius));
        let instance = count(out.instances.len());
        out.instances
            .push(entity::effect_instance(entity, &self.view, out.time));
        let raw = RawMesh::begin(out, material, instance, fog);
        let (view, settings) = (self.view, self.input.settings);
        let mut builder = MeshBuilder {
            vertices: &mut out.vertices,
            indices: &mut out.indices,
        };
        match entity.kind {
            EntityKind::Sprite => builder.sprite(entity, &view),
            EntityKind::Beam => builder.beam(entity),
            EntityKind::RailCore => builder.rail_core(entity, &view, settings),
            EntityKind::RailRings => builder.rail_rings(entity, settings),
            EntityKind::Lightning => builder.lightning(entity, &view),
            EntityKind::Model | EntityKind::Poly | EntityKind::PortalSurface => {}
        }
        self.finish_and_list(raw, asked, number, Some(entity), out);
    }

    fn add_model(&mut self, number: u32, entity: &RefEntity, hidden: bool, out: &mut ViewScene) {
        if !entity.axis.iter().all(|axis| axis.is_finite()) {
            return;
        }
        match self.input.models.get(entity.model) {
            Some(Model::Mesh { lods }) => self.add_mesh(number, entity, hidden, lods, out),
            _ if hidden => {}
            Some(Model::Inline { model, .. }) => self.add_brush_model(number, entity, *model, out),
            None => {
                let instance = self.push_instance(entity, false, out);
                let axes = self.input.materials.internal().axes;
                let raw = RawMesh::begin(out, axes, instance, 0);
                MeshBuilder {
                    vertices: &mut out.vertices,
                    indices: &mut out.indices,
                }
                .axes();
                // the engine lists it under its default material
                self.finish_and_list(raw, 0, number, Some(entity), out);
            }
        }
    }

    fn push_instance(&self, entity: &RefEntity, is_world: bool, out: &mut ViewScene) -> u32 {
        let at = if entity.renderfx & renderfx::LIGHTING_ORIGIN != 0 {
            entity.lighting_origin
        } else {
            entity.origin
        };
        let light = lighting::entity_light(
            self.input.world,
            self.world.is_some(),
            at,
            self.lights,
            self.input.settings,
        );
        let instance = count(out.instances.len());
        out.instances.push(entity::model_instance(
            entity, &self.view, out.time, &light, is_world,
        ));
        instance
    }

    fn add_mesh(
        &mut self,
        number: u32,
        entity: &RefEntity,
        hidden: bool,
        lods: &[std::sync::Arc<Md3Lod>],
        out: &mut ViewScene,
    ) {
        let Some(finest) = lods.first() else {
            return;
        };
        let shadow = self.shadow_material(entity);
        if hidden && shadow.is_none() {
            return;
        }
        let frames = Frames::of(entity, finest.md3.frames.len());
        let Some(frame) = finest.md3.frames.get(frames.new) else {
            return;
        };
        let old_frame = finest.md3.frames.get(frames.old).unwrap_or(frame);
        if self.culls_model(entity, frame, old_frame) {
            return;
        }
        let settings = self.input.settings;
        let level =
            key_frames::level_of_detail(lods.len(), frame, entity.origin, &self.view, settings);
        let Some(lod) = lods.get(level) else {
            return;
        };
        // a coarser level may have fewer frames
        let frames = if lod.md3.frames.len() > frames.new.max(frames.old) {
            frames
        } else {
            Frames::of(&RefEntity::default(), 1)
        };
        let fog = self.world.map_or(0, |world| {
            world.fog_of_sphere(entity.origin + frame.local_origin, frame.radius)
        });
        let instance = self.push_instance(entity, false, out);
        for (surface, own) in lod.md3.surfaces.iter().zip(&lod.materials) {
            let materials = self.input.materials;
            let asked = self.surface_material(entity, &surface.name, own);
            // only opaque surfaces outside of fog cast a planar shadow
            let opaque = materials.get(asked).sort == shaderscript::sort::OPAQUE;
            let shadow = shadow.filter(|_| opaque && fog == 0);
            for asked in shadow.into_iter().chain((!hidden).then_some(asked)) {
                let raw = RawMesh::begin(out, materials.resolve(asked), instance, fog);
                let base = count(out.vertices.len());
                key_frames::append_vertices(surface, frames, &mut out.vertices);
                out.indices
                    .extend(surface.triangles.iter().flatten().map(|i| base + i));
                self.finish_and_list(raw, asked, number, Some(entity), out);
            }
        }
    }

    /// The material that an entity casts a planar shadow with, if it casts one (`cg_shadows 3`). Traced views have
    /// real ones.
    fn shadow_material(&self, entity: &RefEntity) -> Option<u32> {
        let casts = self.look == Look::Classic
            && self.input.settings.shadows == 3
            && entity.renderfx & renderfx::SHADOW_PLANE != 0
            && entity.shadow_plane.is_finite();
        self.input.materials.internal().shadow.filter(|_| casts)
    }

    /// The material of a model's surface: the entity's own, its skin's, or the model's.
    fn surface_material(&self, entity: &RefEntity, name: &str, own: &[u32]) -> u32 {
        let materials = self.input.materials;
        if entity.custom_shader != 0 {
            return material_of_handle(materials.len(), entity.custom_shader);
        }
        if let Some(skin) = self.input.skins.get(entity.custom_skin) {
            return skin.material(name).unwrap_or(0);
        }
        let wrapped = usize::try_from(entity.skin_num)
            .ok()
            .and_then(|n| n.checked_rem(own.len()));
        own.get(wrapped.unwrap_or(0)).copied().unwrap_or(0)
    }

    /// Whether the box around both frames is out of sight.
    fn culls_model(&self, entity: &RefEntity, frame: &Frame, old: &Frame) -> bool {
        let bounds = Bounds {
            mins: frame.mins.min(old.mins),
            maxs: frame.maxs.max(old.maxs),
        };
        self.culls_box(entity, &bounds)
    }

    fn culls_box(&self, entity: &RefEntity, bounds: &Bounds) -> bool {
        let corners = bounds.corners().map(|c| {
            entity.origin + entity.axis[0] * c.x + entity.axis[1] * c.y + entity.axis[2] * c.z
        });
        self.planes().iter().any(|plane| {
            corners
                .iter()
                .all(|corner| plane.truncate().dot(*corner) < plane.w)
        })
    }

    fn add_brush_model(
        &mut self,
        number: u32,
        entity: &RefEntity,
        model: u32,
        out: &mut ViewScene,
    ) {
        let Some(world) = self.input.world else {
            return;
        };
        let Some(brush) = world.models.get(model as usize).copied() else {
            return;
        };
        if self.culls_box(entity, &brush.bounds) {
            return;
        }
        let instance = self.push_instance(entity, true, out);
        out.submodels.push(Submodel { model, instance });
        let first = brush.first_surface;
        let range = first..first.saturating_add(brush.num_surfaces);
        let mut pending = std::mem::take(&mut self.scratch.pending);
        match self.look {
            Look::Traced => {
                let deformed = range.filter(|&s| world.is_deformed(s));
                pending.extend(deformed.filter_map(|s| self.traced_deform(world, s)));
            }
            Look::Classic => {
                let mut lights = std::mem::take(&mut self.scratch.lights);
                surfaces::local_lights(self.lights, entity.origin, &entity.axis, &mut lights);
                // a model that no light reaches has surfaces that none reaches
                if surfaces::lights_at(&lights, &brush.bounds) == 0 {
                    lights.clear();
                }
                // its box was tested; its surfaces are tested by facing alone
                let placed = out.instances.get(instance as usize);
                let local = LocalView {
                    eye: placed.map_or(Vec3::ZERO, |i| i.viewer),
                    frustum: &[],
                    lights: &lights,
                    forward: placed.map_or(Vec3::X, |i| entity::into_axes(i, self.view.axis[0])),
                };
                let run = self.run(world, &local, instance, number);
                for surface in range {
                    pending.extend(run.add(surface, out));
                }
                self.scratch.lights = lights;
            }
        }
        self.add_deformed(world, &mut pending, instance, Some(entity), out);
        self.scratch.pending = pending;
    }
}

/// Index of the material of a handle; the default one for a bad handle.
fn material_of_handle(materials: usize, handle: i32) -> u32 {
    u32::try_from(handle)
        .ok()
        .filter(|&index| (index as usize) < materials)
        .unwrap_or(0)
}

/// A convex polygon as a fan of triangles with its plane's normal.
fn append_fan(corners: &[PolyVert], out: &mut ViewScene) {
    let base = count(out.vertices.len());
    let normal = match corners {
        [a, rest @ ..] => rest
            .windows(2)
            .map(|pair| match pair {
                [b, c] => (c.position - a.position).cross(b.position - a.position),
                _ => Vec3::ZERO,
            })
            .fold(Vec3::ZERO, |sum, n| sum + n)
            .normalize_or(Vec3::Z),
        [] => Vec3::Z,
    };
    out.vertices.extend(corners.iter().map(|corner| Vertex {
        position: corner.position,
        normal,
        st: corner.st,
        lightmap: glam::Vec2::ZERO,
        color: u32::from_le_bytes(corner.rgba),
    }));
    for i in 2..count(corners.len()) {
        out.indices.extend([base, base + i - 1, base + i]);
    }
}
