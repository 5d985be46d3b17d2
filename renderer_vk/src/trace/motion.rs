//! Where everything of a view was in the last frame: what the motion of a pixel's surface is found with.
//!
//! The engine's entities have no names, so an entity is found again by what it is (kind, model, skin, material, who
//! sees it) and where: among those that are alike, the nearest to where the one of the last frame would be by now, a
//! little farther counted if its key frames do not follow on. An entity is not found again when none that is alike is
//! within reach of the fastest thing in a game; then its surfaces say that nobody knows where they were, and they begin
//! without history. If two that are alike are mistaken for each other, the motion points at where the other one was,
//! and the length of the way there tells whether the same was seen.
//!
//! The vertices of a mesh that is found again, and has as many, are those of the last frame; otherwise it moved as a
//! whole. Polygons that belong to no entity (marks on walls, most of them) are taken to be at rest.

use std::collections::HashMap;

use glam::Vec3;
use shaders::trace_types::constants::{LAST_MOVED, LAST_SAME};
use shaders::trace_types::{LastInstance, MotionView, PortalRecord};
use shaders::types::{Instance, Vertex};
use support::slice::item;

use super::targets::Targets;
use crate::api::{EntityKind, renderfx};
use crate::gpu::{Error, Recorder};
use crate::scene::{DynamicMesh, TracedScene, ViewEntity};

/// Fastest that an entity is taken to move, units a second, and what is allowed beside that.
const FASTEST: f32 = 2500.0;
const SLACK: f32 = 32.0;
/// Longest time between two frames that a velocity is trusted for, seconds.
const TRUSTED_TIME: f32 = 0.25;
/// What key frames that do not follow on count for, as a part of the reach.
const STRANGE_FRAME: f32 = 0.1;

/// What tells one sort of entity from another.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Sort {
    kind: u8,
    model: i32,
    skin: i32,
    material: i32,
    seen: u32,
}

impl Sort {
    fn of(entity: &ViewEntity) -> Self {
        Self {
            kind: match entity.kind {
                EntityKind::Model => 0,
                EntityKind::Poly => 1,
                EntityKind::Sprite => 2,
                EntityKind::Beam => 3,
                EntityKind::RailCore => 4,
                EntityKind::RailRings => 5,
                EntityKind::Lightning => 6,
                EntityKind::PortalSurface => 7,
            },
            model: entity.model,
            skin: entity.skin,
            material: entity.material,
            seen: entity.renderfx
                & (renderfx::FIRST_PERSON | renderfx::THIRD_PERSON | renderfx::DEPTH_HACK),
        }
    }
}

/// The last frame's view, as much of it as is asked for.
#[derive(Default)]
struct Past {
    entities: Vec<ViewEntity>,
    /// Units a second, of each entity.
    velocities: Vec<Vec3>,
    meshes: Vec<DynamicMesh>,
    places: Vec<([Vec3; 3], Vec3)>,
    positions: Vec<Vec3>,
    portals: Vec<PortalRecord>,
    time: f32,
}

/// Finds what moves in the last frame.
#[derive(Default)]
pub struct Motion {
    past: Option<Past>,
}

/// What [`Motion::follow`] found.
pub(super) struct Followed {
    /// Of each instance.
    pub instances: Vec<LastInstance>,
    /// Of each vertex, in the space of its instance then.
    pub positions: Vec<Vec3>,
    /// Of each portal.
    pub portals: Vec<PortalRecord>,
    /// No time has passed.
    pub time_stands: bool,
}

impl Motion {
    /// Compares a view with the one before and keeps it for the next. `vertices`: device address of the view's
    /// vertices; `camera_rests`: the camera is where it was.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &mut self,
        rec: &mut Recorder,
        view: &TracedScene,
        portals: &[PortalRecord],
        vertices: u64,
        targets: &Targets,
        camera_rests: bool,
    ) -> Result<MotionView, Error> {
        let found = self.follow(view, portals);
        Ok(MotionView {
            vertices,
            vertex_bytes: size_of_val(view.vertices.as_slice()) as u64,
            last_positions: rec.arena().push(&found.positions)?,
            last_instances: rec.arena().push(&found.instances)?,
            last_portals: rec.arena().push(&found.portals)?,
            still: u32::from(camera_rests && found.portals == portals),
            time_stands: u32::from(found.time_stands),
            view_distance: targets.view_distance[0].storage_index(),
            last_view_distance: targets.view_distance[1].storage_index(),
        })
    }

    /// Finds everything of a view in the one before, and keeps it for the next.
    pub(super) fn follow(&mut self, view: &TracedScene, portals: &[PortalRecord]) -> Followed {
        // The first view has none before it.
        let past = self.past.take().unwrap_or_default();
        let mut found = Followed {
            instances: vec![LastInstance::default(); view.instances.len()],
            positions: view.vertices.iter().map(|v| v.position).collect(),
            portals: portals.iter().map(|p| past.portal(p)).collect(),
            time_stands: view.time == past.time,
        };
        if let (Some(last), Some(world)) = (found.instances.first_mut(), view.instances.first()) {
            *last = last_instance(world, (world.axis, world.origin));
        }
        past.follow_world(view, &mut found.positions);
        let passed = view.time - past.time;
        let matches = past.match_entities(&view.look.entities, passed);
        let mut velocities = vec![Vec3::ZERO; view.look.entities.len()];
        for ((entity, found_again), velocity) in
            view.look.entities.iter().zip(matches).zip(&mut velocities)
        {
            let Some(last) = found_again.and_then(|i| past.entities.get(i)) else {
                continue;
            };
            if passed > 0.0 {
                *velocity = (entity.origin - last.origin) / passed;
            }
            past.follow_entity(view, entity, last, &mut found);
        }
        let mut past = past;
        past.entities.clone_from(&view.look.entities);
        past.velocities = velocities;
        past.meshes.clone_from(&view.meshes);
        past.places.clear();
        past.places
            .extend(view.instances.iter().map(|i| (i.axis, i.origin)));
        past.positions.clear();
        past.positions
            .extend(view.vertices.iter().map(|v: &Vertex| v.position));
        past.portals.clear();
        past.portals.extend(portals);
        past.time = view.time;
        self.past = Some(past);
        found
    }
}

fn last_instance(now: &Instance, (axis, origin): ([Vec3; 3], Vec3)) -> LastInstance {
    LastInstance {
        axis,
        origin,
        known: if axis == now.axis && origin == now.origin {
            LAST_SAME
        } else {
            LAST_MOVED
        },
    }
}

impl Past {
    /// For each entity the index of the one that it was.
    fn match_entities(&self, entities: &[ViewEntity], passed: f32) -> Vec<Option<usize>> {
        let mut alike: HashMap<Sort, Vec<usize>> = HashMap::new();
        for (index, entity) in self.entities.iter().enumerate() {
            alike.entry(Sort::of(entity)).or_default().push(index);
        }
        // a game that starts anew sets its clock back
        let passed = if passed >= 0.0 { passed } else { 0.0 };
        let reach = SLACK + FASTEST * passed;
        let ahead = if passed <= TRUSTED_TIME { passed } else { 0.0 };
        let match_one = |entity: &ViewEntity| {
            let candidates = alike.get_mut(&Sort::of(entity))?;
            let cost = |&index: &usize| {
                let last = self.entities.get(index)?;
                let velocity = item(&self.velocities, index);
                if entity.origin.distance(last.origin) > reach {
                    return None;
                }
                let expected = last.origin + velocity * ahead;
                let follows = [last.frame, last.old_frame].contains(&entity.old_frame)
                    || entity.frame == last.frame;
                let strange = if follows { 0.0 } else { STRANGE_FRAME * reach };
                Some(entity.origin.distance(expected) + strange)
            };
            let best = candidates
                .iter()
                .enumerate()
                .filter_map(|(place, index)| Some((place, cost(index)?)))
                .min_by(|a, b| a.1.total_cmp(&b.1))?;
            // the order stays: of two at one place each finds its own
            Some(candidates.remove(best.0))
        };
        entities.iter().map(match_one).collect()
    }

    fn follow_entity(
        &self,
        view: &TracedScene,
        entity: &ViewEntity,
        last: &ViewEntity,
        found: &mut Followed,
    ) {
        let pairs = entity.instance_count.min(last.instance_count);
        for i in 0..pairs {
            let now = entity.first_instance.saturating_add(i) as usize;
            let then = last.first_instance.saturating_add(i) as usize;
            let (Some(slot), Some(instance), Some(place)) = (
                found.instances.get_mut(now),
                view.instances.get(now),
                self.places.get(then),
            ) else {
                continue;
            };
            *slot = last_instance(instance, *place);
        }
        if entity.mesh_count != last.mesh_count {
            return;
        }
        for i in 0..entity.mesh_count {
            let now = entity.first_mesh.saturating_add(i) as usize;
            let then = last.first_mesh.saturating_add(i) as usize;
            if let (Some(mesh), Some(old)) = (view.meshes.get(now), self.meshes.get(then)) {
                self.follow_mesh(mesh, old, &mut found.positions);
            }
        }
    }

    /// Surfaces of the world that are deformed.
    fn follow_world(&self, view: &TracedScene, positions: &mut [Vec3]) {
        let ours = |mesh: &&DynamicMesh| mesh.instance == 0 && mesh.world_surface.is_some();
        let old: HashMap<(u32, u8), &DynamicMesh> = self
            .meshes
            .iter()
            .filter(ours)
            .filter_map(|mesh| Some(((mesh.world_surface?, mesh.paths), mesh)))
            .collect();
        for mesh in view.meshes.iter().filter(ours) {
            if let Some(old) = mesh.world_surface.and_then(|s| old.get(&(s, mesh.paths))) {
                self.follow_mesh(mesh, old, positions);
            }
        }
    }

    /// Of a mesh with as many vertices and triangles as before, the positions that it had.
    fn follow_mesh(&self, mesh: &DynamicMesh, old: &DynamicMesh, positions: &mut [Vec3]) {
        if (mesh.vertex_count, mesh.index_count) != (old.vertex_count, old.index_count) {
            return;
        }
        let range = |mesh: &DynamicMesh| {
            let first = mesh.first_vertex as usize;
            first..first.saturating_add(mesh.vertex_count as usize)
        };
        if let (Some(to), Some(from)) = (
            positions.get_mut(range(mesh)),
            self.positions.get(range(old)),
        ) {
            to.copy_from_slice(from);
        }
    }

    /// A portal as it was: the nearest of its sort that faces alike; itself if there was none.
    fn portal(&self, now: &PortalRecord) -> PortalRecord {
        let normal = |p: &PortalRecord| Vec3::new(p.plane[0], p.plane[1], p.plane[2]);
        self.portals
            .iter()
            .filter(|p| p.mirror == now.mirror && normal(p).dot(normal(now)) > 0.7)
            .map(|p| (p, p.surface_origin.distance(now.surface_origin)))
            .filter(|(_, distance)| *distance < SLACK)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(*now, |(p, _)| *p)
    }
}
