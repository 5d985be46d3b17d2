//! Gathers a view: world, polygons, entities, in the engine's order.

use glam::{Vec3, Vec4};
use q3model::BoneMatrix;
use shaders::types::constants::NO_TEXTURE;
use shaders::types::{Instance, Vertex};
use support::Aabb;
use support::slice;

use super::entity;
use super::flares::FlareView;
use super::mesh::{self, DeformScratch, RawMesh};
use super::painted_shadows::{is_painted_shadow, only_darkens};
use super::portal;
use super::rigid::RigidMeshes;
use super::surfaces::{
    self, LocalLight, LocalView, PendingDeform, SurfaceRun, WORLD_ENTITY, sort_key,
};
use super::turned::{self, Way};
use super::{
    ClassicScene, DynamicMesh, GatherInput, LookPartMut, MeshId, Scene, Shape, Sun, TracedScene,
    View, ViewEntity, ViewScene,
};
use crate::api::{DynamicLight, EntityKind, PolyVert, RefDef, RefEntity, rdflags, renderfx};
use crate::world::{VisibleQuery, VisibleSet, WorldData};

/// Model number of the map in [`MeshId`]; handles of models are positive.
const WORLD_MODEL: i32 = -1;

/// Distance of the far plane without a world, units.
const FAR_WITHOUT_WORLD: f32 = 2048.0;

/// Buffers that gathering reuses.
#[derive(Default)]
pub(super) struct Scratch {
    deform: DeformScratch,
    pub(super) pending: Vec<PendingDeform>,
    pub(super) lights: Vec<LocalLight>,
    pub(super) bones: Vec<BoneMatrix>,
    pub(super) rigid: RigidMeshes,
    order: Vec<(u64, u32)>,
    sorted: Vec<super::DrawSurface>,
}

impl Scratch {
    /// Stable sort by key. The standard library's stable sort allocates.
    fn sort(&mut self, surfaces: &mut Vec<super::DrawSurface>) {
        self.order.clear();
        self.order
            .extend((0..).zip(surfaces.iter()).map(|(i, s)| (s.sort_key, i)));
        self.order.sort_unstable();
        self.sorted.clear();
        let in_order = self
            .order
            .iter()
            .filter_map(|(_, i)| surfaces.get(*i as usize));
        self.sorted.extend(in_order);
        std::mem::swap(surfaces, &mut self.sorted);
    }
}

/// The views of a scene in the classic look: at most one through a portal or mirror, then the main view.
pub(super) fn classic_views(
    scene: &mut Scene,
    input: &GatherInput<'_>,
    def: &RefDef,
) -> Vec<ClassicScene> {
    let mut out = scene.lists.pop().unwrap_or_default();
    let main = classic_view(
        scene,
        input,
        def,
        main_view(scene, input, def),
        def.view_origin,
    );
    if let Some(portal) = portal::find_first(&scene.entities, input, def, &main) {
        let seen = portal::view_through(&portal, &main.view);
        out.push(classic_view(scene, input, def, seen, portal.pvs_origin));
        if input.settings.portal_only {
            scene.classic_pool.push(main);
            return out;
        }
    }
    out.push(main);
    out
}

fn classic_view(
    scene: &mut Scene,
    input: &GatherInput<'_>,
    def: &RefDef,
    view: View,
    pvs_origin: Vec3,
) -> ClassicScene {
    let pooled = scene.classic_pool.pop();
    let mut out = pooled.unwrap_or_else(|| ViewScene::empty(def, view));
    let mut gatherer = Gatherer::new(scene, input, def, view, &[], &mut out);
    gatherer.gather(pvs_origin, &mut out);
    gatherer.sort_and_count(&mut out);
    out
}

/// The view of a scene in the traced look, with all portals and mirrors that its rays may hit.
pub(super) fn traced_view(scene: &mut Scene, input: &GatherInput<'_>, def: &RefDef) -> TracedScene {
    let view = main_view(scene, input, def);
    let portals = portal::find_all(&scene.entities, input, def);
    let mut turned = std::mem::take(&mut scene.turned);
    turned::views(&portals, &view, &mut turned);
    let pooled = scene.traced_pool.pop();
    let mut out = pooled.unwrap_or_else(|| ViewScene::empty(def, view));
    Gatherer::new(scene, input, def, view, &turned, &mut out).gather(def.view_origin, &mut out);
    scene.turned = turned;
    out.look.portals = portals;
    out
}

/// The main view.
fn main_view(scene: &Scene, input: &GatherInput<'_>, def: &RefDef) -> View {
    let stereo = scene.eye.stereo(input.settings);
    View::new(def, input.settings.znear, FAR_WITHOUT_WORLD).with_stereo(stereo)
}

/// A length as `u32`.
pub(super) fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// State of gathering one view.
pub(super) struct Gatherer<'a> {
    pub(super) input: &'a GatherInput<'a>,
    pub(super) entities: &'a [RefEntity],
    pub(super) polys: &'a [super::Poly],
    pub(super) poly_vertices: &'a [PolyVert],
    pub(super) lights: &'a [DynamicLight],
    pub(super) visible: &'a mut VisibleSet,
    pub(super) scratch: &'a mut Scratch,
    pub(super) def: &'a RefDef,
    /// The view is traced; otherwise it is rasterized.
    pub(super) traced: bool,
    pub(super) view: View,
    /// The views through portals, by path number; geometry that faces the camera is built for each.
    turned: &'a [Option<View>],
    /// The world, if the view shows it.
    pub(super) world: Option<&'a WorldData>,
    pub(super) frustum: [Vec4; 4],
    /// Culls by the frustum; false in the traced look, whose rays leave it.
    pub(super) culling: bool,
}

impl<'a> Gatherer<'a> {
    fn new(
        scene: &'a mut Scene,
        input: &'a GatherInput<'a>,
        def: &'a RefDef,
        view: View,
        turned: &'a [Option<View>],
        out: &mut ViewScene,
    ) -> Self {
        let traced = matches!(out.look.part(), LookPartMut::Traced(_));
        let settings = input.settings;
        let dynamic = settings.dynamic_light && !settings.vertex_light;
        let shows_world = def.flags & rdflags::NO_WORLD_MODEL == 0;
        let per_pixel = settings.dlight_mode != 0;
        if dynamic && !traced && per_pixel {
            scene.pixel_lights.clear();
            let scaled = scene.lights.iter().map(|light| DynamicLight {
                radius: light.radius * settings.dlight_scale,
                color: light.color * settings.dlight_intensity,
                ..*light
            });
            scene.pixel_lights.extend(scaled);
        }
        Self {
            input,
            entities: if settings.draw_entities {
                &scene.entities
            } else {
                &[]
            },
            polys: &scene.polys,
            poly_vertices: &scene.poly_vertices,
            lights: match (dynamic, traced) {
                (false, _) => &[],
                (true, false) if per_pixel => &scene.pixel_lights,
                (true, _) => &scene.lights,
            },
            visible: if view.is_portal {
                &mut scene.portal_visible
            } else {
                &mut scene.visible
            },
            scratch: &mut scene.scratch,
            def,
            traced,
            view,
            turned,
            world: input.world.filter(|_| shows_world),
            frustum: view.frustum(),
            culling: !traced && !settings.no_cull,
        }
    }

    fn gather(&mut self, pvs_origin: Vec3, out: &mut ViewScene) {
        self.clear(out);
        if self.traced {
            self.scratch.rigid.begin_view();
        }
        if let Some(world) = self.world {
            self.find_visible(world, pvs_origin, out);
            self.add_world(world, out);
        }
        self.add_polys(out);
        let entities = self.entities;
        for (number, entity) in entities.iter().enumerate() {
            let first_instance = count(out.instances.len());
            let first_mesh = count(out.meshes.len());
            self.add_entity(count(number), entity, out);
            let instance_count = count(out.instances.len()) - first_instance;
            if let LookPartMut::Traced(traced) = out.look.part()
                && instance_count > 0
            {
                traced.entities.push(ViewEntity {
                    kind: entity.kind,
                    model: entity.model,
                    skin: entity.custom_skin,
                    material: entity.custom_shader,
                    renderfx: entity.renderfx,
                    frame: entity.frame,
                    old_frame: entity.old_frame,
                    origin: entity.origin,
                    first_instance,
                    instance_count,
                    first_mesh,
                    mesh_count: count(out.meshes.len()) - first_mesh,
                });
            }
        }
    }

    /// Finishes a view of the classic look: greyscale, drawing order, counts.
    fn sort_and_count(&mut self, out: &mut ClassicScene) {
        let greyscale = self.input.settings.greyscale.clamp(0.0, 1.0);
        if greyscale > 0.0 {
            out.take_color(greyscale);
        }
        self.scratch.sort(&mut out.look.surfaces);
        // skies write no depth: of overlapping skies, the last one drawn shows
        let materials = self.input.materials;
        (out.look.skies).sort_unstable_by_key(|sky| (materials.rank(sky.material), sky.fog));
        if self.input.settings.speeds != 0 {
            out.look.statistics = self.count_view(out);
        }
    }

    fn clear(&self, out: &mut ViewScene) {
        out.def = *self.def;
        out.view = self.view;
        out.time = self.def.time_ms as f32 / 1000.0;
        out.instances.clear();
        out.vertices.clear();
        out.indices.clear();
        out.meshes.clear();
        out.dlights.clear();
        out.dlights.extend_from_slice(self.lights);
        out.has_world = self.world.is_some();
        out.sun = self.sun();
        out.flares.clear();
        out.look.clear();
        out.instances
            .push(entity::world_instance(&self.view, out.time));
    }

    /// The sun's disc if it is drawn; the game may have no material for it.
    fn sun(&self) -> Option<Sun> {
        let world = self.world.filter(|_| self.input.settings.draw_sun)?;
        Some(Sun {
            material: self.input.materials.internal().sun?,
            direction: world.sun_direction,
        })
    }

    /// Planes of the frustum; empty without culling.
    pub(super) fn planes(&self) -> &[Vec4] {
        if self.culling { &self.frustum } else { &[] }
    }

    /// Finds the visible surfaces, and sets the far plane to the farthest corner of their bounds.
    fn find_visible(&mut self, world: &WorldData, pvs_origin: Vec3, out: &mut ViewScene) {
        let settings = self.input.settings;
        let frustum: &[Vec4] = if settings.no_cull { &[] } else { &self.frustum };
        self.visible.gather(
            world,
            &VisibleQuery {
                pvs_origin,
                area_mask: &self.def.area_mask,
                frustum,
                culls: self.culling,
                no_vis: settings.no_vis,
                locked: settings.lock_pvs,
                show_cluster: settings.show_cluster,
            },
        );
        let bounds = self.visible.bounds;
        if !bounds.is_empty() {
            let camera = self.view.origin;
            let far = bounds
                .corners()
                .into_iter()
                .map(|corner| corner.distance(camera))
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
            camera: self.view.origin,
            frustum: self.planes(),
            lights: &lights,
            forward: self.view.axis[0],
            by_facing: settings.face_plane_cull,
        };
        let run = self.run(world, &local, (0, &out.instances), WORLD_ENTITY);
        match out.look.part() {
            LookPartMut::Classic(classic) => {
                for &surface in &self.visible.surfaces {
                    pending.extend(run.add(surface, classic));
                }
            }
            LookPartMut::Traced(traced) => {
                traced.potential.extend_from_slice(&self.visible.surfaces);
                let deformed = self
                    .visible
                    .surfaces
                    .iter()
                    .filter(|&&surface| world.is_deformed(surface));
                pending.extend(deformed.filter_map(|&s| self.traced_deform(world, s)));
            }
        }
        self.add_flares(world, self.visible.surfaces.iter().copied(), 0, out);
        self.add_deformed(world, &mut pending, 0, None, out);
        self.scratch.pending = pending;
        self.scratch.lights = lights;
    }

    /// Adds the flares among `surfaces`, placed by an instance.
    pub(super) fn add_flares(
        &self,
        world: &WorldData,
        surfaces: impl Iterator<Item = u32>,
        instance: u32,
        out: &mut ViewScene,
    ) {
        let shown = self.input.settings.flares;
        let Some(placed) = slice::get(&out.instances, instance as usize).filter(|_| shown) else {
            return;
        };
        let view = FlareView {
            view: &self.view,
            world,
            settings: self.input.settings,
        };
        out.flares
            .extend(surfaces.filter_map(|surface| view.find(surface, instance, placed)));
    }

    pub(super) fn run<'b>(
        &self,
        world: &'b WorldData,
        local: &'b LocalView<'b>,
        (instance, instances): (u32, &'b [Instance]),
        entity: u32,
    ) -> SurfaceRun<'b>
    where
        'a: 'b,
    {
        SurfaceRun {
            world,
            materials: self.input.materials,
            local,
            camera: self.view.origin,
            instance,
            placed: slice::get(instances, instance as usize),
            entity,
            curve_error: self.input.settings.lod_curve_error,
            no_curves: self.input.settings.no_curves,
            no_sky: self.input.settings.hides_sky(),
        }
    }

    pub(super) fn traced_deform(&self, world: &WorldData, surface: u32) -> Option<PendingDeform> {
        let found = slice::get(&world.surfaces, surface as usize)?;
        (found.index_count > 0).then(|| PendingDeform {
            surface,
            first_index: found.first_index,
            index_count: found.index_count,
            material: self.input.materials.resolve(found.material),
            sort_key: 0,
            dlights: 0,
        })
    }

    /// Copies surfaces of the map into the view and deforms them. Empties `pending`.
    pub(super) fn add_deformed(
        &mut self,
        world: &WorldData,
        pending: &mut Vec<PendingDeform>,
        instance: u32,
        entity: Option<&RefEntity>,
        out: &mut ViewScene,
    ) {
        for deform in pending.drain(..) {
            let Some(surface) = slice::get(&world.surfaces, deform.surface as usize) else {
                continue;
            };
            let turns = self.input.materials.get(deform.material).faces_camera();
            let ways = if turns { self.turned.len() + 1 } else { 1 };
            for way in 0..ways {
                let Some(Way { paths, .. }) = self.way(way, ways) else {
                    continue; // nothing is seen on it
                };
                let mut raw = RawMesh::begin(out, deform.material, instance, surface.fog);
                raw.paths = paths;
                raw.world_surface = Some(deform.surface);
                raw.shape = Shape::Animated(MeshId {
                    model: WORLD_MODEL,
                    level: 0,
                    surface: deform.surface,
                });
                let first = deform.first_index as usize;
                let range = first..first + deform.index_count as usize;
                let base = count(out.vertices.len());
                let own = world.surface_vertices(surface);
                let classic = world.classic_vertices(surface).filter(|_| !self.traced);
                out.vertices.extend_from_slice(classic.unwrap_or(own));
                out.indices.extend(
                    slice::part(&world.indices, range)
                        .iter()
                        .map(|i| i.wrapping_sub(surface.first_vertex).wrapping_add(base)),
                );
                let mesh = self.finish(raw, entity, out);
                if let (Some(mesh), LookPartMut::Classic(classic)) = (mesh, out.look.part()) {
                    let (key, lightmap) = (deform.sort_key, surface.lightmap);
                    classic.push_mesh(&mesh, key, lightmap, deform.dlights);
                }
            }
        }
    }

    /// Number of copies of an entity's geometry: one, unless it faces the camera and portals show it.
    pub(super) fn ways_of(&self, entity: &RefEntity, turns: bool) -> usize {
        let first_person = entity.renderfx & renderfx::FIRST_PERSON != 0;
        if turns && !first_person {
            self.turned.len() + 1
        } else {
            1
        }
    }

    /// The path numbers and the view of copy `index` of `ways`; `None` if no path leads there.
    pub(super) fn way(&self, index: usize, ways: usize) -> Option<Way> {
        let Some(index) = index.checked_sub(1) else {
            return Some(Way {
                paths: if ways > 1 {
                    turned::DIRECT
                } else {
                    turned::ALL
                },
                view: self.view,
            });
        };
        Some(Way {
            paths: turned::PORTAL.checked_add(u8::try_from(index).ok()?)?,
            view: self.turned.get(index).copied()??,
        })
    }

    fn finish(
        &mut self,
        raw: RawMesh,
        entity: Option<&RefEntity>,
        out: &mut ViewScene,
    ) -> Option<DynamicMesh> {
        let way = raw.paths.checked_sub(turned::PORTAL);
        let through = way.and_then(|way| self.turned.get(usize::from(way)).copied()?);
        mesh::finish(
            raw,
            entity,
            self.input.materials,
            self.def,
            &through.unwrap_or(self.view),
            &mut self.scratch.deform,
            out,
        )
    }

    /// Whether dynamic lights are evaluated per pixel on models, too.
    pub(super) fn lights_models(&self) -> bool {
        self.input.settings.dlight_mode == 2 && !self.traced
    }

    /// Finishes a mesh that is no world surface, and lists it for the classic look. `asked`: material before remapping,
    /// which decides the order.
    pub(super) fn finish_and_list(
        &mut self,
        raw: RawMesh,
        asked: u32,
        number: u32,
        entity: Option<&RefEntity>,
        out: &mut ViewScene,
    ) {
        let mesh = self.finish(raw, entity, out);
        if let (Some(mesh), LookPartMut::Classic(classic)) = (mesh, out.look.part()) {
            let rank = self.input.materials.rank(asked);
            let key = sort_key(rank, number, mesh.fog, false);
            let model = entity.is_some_and(|entity| entity.kind == EntityKind::Model);
            let lights = if self.lights_models() && model {
                // one bit for each light; the draw list keeps the triangles that the light reaches
                u32::MAX
                    .checked_shr(32u32.saturating_sub(count(self.lights.len())))
                    .unwrap_or(0)
            } else {
                0
            };
            classic.push_mesh(&mesh, key, NO_TEXTURE, lights);
        }
    }

    /// Adds the polygons as fans; neighbours of one material and fog become one mesh.
    fn add_polys(&mut self, out: &mut ViewScene) {
        let mut open: Option<(RawMesh, u32)> = None;
        let polys = self.polys;
        for poly in polys {
            let range = poly.first_vertex..poly.first_vertex + poly.vertex_count;
            let corners = slice::part(self.poly_vertices, range);
            let darkens = || only_darkens(&self.input.materials.get(poly.material).shader);
            if self.has_traced_shadows() && darkens() && is_painted_shadow(corners, self.entities) {
                continue;
            }
            let bounds = Aabb::of(corners.iter().map(|v| v.position));
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
}

/// Appends a convex polygon as a fan of triangles with the normal of its plane.
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
