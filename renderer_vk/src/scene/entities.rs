//! Adds entities other than triangle models: brush models, sprites, beams, rails, lightning.

use glam::Vec3;
use shaders::types::constants as c;
use support::Aabb;
use support::slice;

use super::cull;
use super::entity;
use super::gather::{Gatherer, count};
use super::lighting;
use super::mesh::RawMesh;
use super::surfaces::{self, LocalView};
use super::turned::Way;
use super::{LookPartMut, Submodel, ViewScene};
use crate::api::{EntityKind, RefEntity, renderfx};
use crate::assets::Model;
use crate::world::GridLight;

impl Gatherer<'_> {
    pub(super) fn add_entity(&mut self, number: u32, entity: &RefEntity, out: &mut ViewScene) {
        let first_person = entity.renderfx & renderfx::FIRST_PERSON != 0;
        if first_person && self.view.is_portal {
            return;
        }
        // in the main view they cast shadows only, which the classic look does not draw
        let third_person = entity.renderfx & renderfx::THIRD_PERSON != 0;
        let hidden = third_person && !self.view.is_portal && !self.traced;
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
        let asked = materials.of_handle(entity.custom_shader);
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
        let mut placed = entity::effect_instance(entity, &self.view, out.time);
        if self.traced && entity.kind == EntityKind::Sprite {
            // a sprite has no normal: it receives half of the directed light
            let light = self.light_at(entity.origin);
            placed.ambient = ((light.ambient + light.directed * 0.5) / 255.0).min(Vec3::ONE);
            placed.flags |= c::INSTANCE_SUSPENDED;
        }
        out.instances.push(placed);
        let settings = self.input.settings;
        let turns = matches!(
            entity.kind,
            EntityKind::Sprite | EntityKind::RailCore | EntityKind::Lightning
        ) || materials.get(material).faces_camera();
        let ways = self.ways_of(entity, turns);
        for way in 0..ways {
            let Some(Way { paths, view }) = self.way(way, ways) else {
                continue; // nothing is seen on it
            };
            let mut raw = RawMesh::begin(out, material, instance, fog);
            raw.paths = paths;
            let mut builder = out.builder();
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
    }

    fn add_model(&mut self, number: u32, entity: &RefEntity, hidden: bool, out: &mut ViewScene) {
        if !entity.axis.iter().all(|axis| axis.is_finite()) {
            return;
        }
        match self.input.models.get(entity.model) {
            Some(model @ (Model::Mesh { .. } | Model::Mdr(_) | Model::Iqm(_))) => {
                self.add_animated(number, entity, hidden, model, out);
            }
            // the engine ignores `renderfx` of brush models
            Some(Model::Inline { model, .. }) => self.add_brush_model(number, entity, *model, out),
            None if hidden => {}
            None => {
                // lines in world space, because their width depends on the view
                let instance = count(out.instances.len());
                out.instances
                    .push(entity::effect_instance(entity, &self.view, out.time));
                let axes = self.input.materials.internal().axes;
                let ways = self.ways_of(entity, true);
                for way in 0..ways {
                    let Some(Way { paths, view }) = self.way(way, ways) else {
                        continue; // nothing is seen on it
                    };
                    let mut raw = RawMesh::begin(out, axes, instance, 0);
                    raw.paths = paths;
                    out.builder().axes(entity, &view);
                    // the engine sorts it by the default material
                    self.finish_and_list(raw, 0, number, Some(entity), out);
                }
            }
        }
    }

    /// Light of an entity at a position, by the engine's rules.
    fn light_at(&self, at: Vec3) -> GridLight {
        lighting::entity_light(
            self.input.world,
            self.world.is_some(),
            at,
            if self.lights_models() {
                &[]
            } else {
                self.lights
            },
            self.input.settings,
        )
    }

    pub(super) fn push_instance(&self, entity: &RefEntity, out: &mut ViewScene) -> u32 {
        let at = if entity.renderfx & renderfx::LIGHTING_ORIGIN != 0 {
            entity.lighting_origin
        } else {
            entity.origin
        };
        let light = self.light_at(at);
        if self.input.settings.debug_light && entity.renderfx & renderfx::FIRST_PERSON != 0 {
            let brightest = |light: Vec3| light.max_element() as i32;
            let (ambient, directed) = (brightest(light.ambient), brightest(light.directed));
            log::info!("amb:{ambient}  dir:{directed}");
        }
        let number = count(out.instances.len());
        let added = lighting::added(self.input.settings);
        let mut instance = entity::model_instance(entity, &self.view, out.time, &light, added);
        if self.input.settings.own_specular {
            instance.flags |= c::INSTANCE_OWN_SPECULAR;
        }
        out.instances.push(instance);
        number
    }

    pub(super) fn culls_box(&self, entity: &RefEntity, bounds: &Aabb) -> bool {
        cull::corners(&cull::placed(entity, bounds), self.planes()) == cull::Lies::Outside
    }

    fn add_brush_model(
        &mut self,
        number: u32,
        entity: &RefEntity,
        model: u32,
        out: &mut ViewScene,
    ) {
        let Some(world) = self.input.world else {
            return; // the game names a model of a map that is not loaded
        };
        let Some(brush) = world.models.get(model as usize).copied() else {
            // the map has no such model
            return;
        };
        if self.culls_box(entity, &brush.bounds) {
            return;
        }
        let instance = self.push_instance(entity, out);
        let first = brush.first_surface;
        let range = first..first.saturating_add(brush.num_surfaces);
        self.add_flares(world, range.clone(), instance, out);
        let mut pending = std::mem::take(&mut self.scratch.pending);
        match out.look.part() {
            LookPartMut::Traced(traced) => {
                traced.submodels.push(Submodel { model, instance });
                let deformed = range.filter(|&s| world.is_deformed(s));
                pending.extend(deformed.filter_map(|s| self.traced_deform(world, s)));
            }
            LookPartMut::Classic(classic) => {
                let mut lights = std::mem::take(&mut self.scratch.lights);
                surfaces::local_lights(self.lights, entity.origin, &entity.axis, &mut lights);
                if self.input.settings.dlight_mode == 0 {
                    // If no light reaches the model's box, no surface is lit. Otherwise the engine keeps one bit for
                    // all lights: that of the view's first light.
                    let reached = surfaces::lights_at(&lights, &brush.bounds) != 0;
                    lights.truncate(usize::from(reached));
                } else {
                    // lights that are evaluated per pixel have no such faults
                    for light in &mut lights {
                        light.world = light.local;
                    }
                }
                // the model's box was tested; its surfaces are culled by facing only
                let placed = slice::get(&out.instances, instance as usize);
                let local = LocalView {
                    camera: placed.map_or(Vec3::ZERO, |i| i.viewer),
                    frustum: &[],
                    lights: &lights,
                    forward: placed.map_or(Vec3::X, |i| entity::into_axes(i, self.view.axis[0])),
                    by_facing: self.input.settings.face_plane_cull,
                };
                let run = self.run(world, &local, (instance, &out.instances), number);
                for surface in range {
                    pending.extend(run.add(surface, classic));
                }
                self.scratch.lights = lights;
            }
        }
        self.add_deformed(world, &mut pending, instance, Some(entity), out);
        self.scratch.pending = pending;
    }
}
