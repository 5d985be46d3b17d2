//! Motion vectors: positions of a view's geometry in the last frame.
//!
//! The engine's entities have no identifiers. An entity is therefore matched by its properties (kind, model, skin,
//! material, visibility) and position: among entities of equal properties, the one of the last frame whose extrapolated
//! position is nearest; key frames that do not continue add a penalty distance. Without such an entity within the
//! distance that the fastest projectile covers, the entity is unmatched: its surfaces have unknown motion and no
//! history. If two equal entities are confused, the motion vector points to the other entity, and filters reject the
//! history where the stored view distance differs.
//!
//! The vertices of a matched mesh of equal vertex count have their positions of the last frame; otherwise the mesh
//! moves rigidly. Polygons without an entity (most are marks on walls) count as static.

use std::collections::HashMap;

use glam::Vec3;
use shaders::trace_types::constants::{LAST_MOVED, LAST_SAME};
use shaders::trace_types::{LastInstance, MotionView, PortalRecord};
use shaders::types::{Instance, Vertex};
use support::slice::{self, item};

use super::nearby::Nearby;
use super::targets::Targets;
use crate::api::{EntityKind, renderfx};
use crate::gpu::{Error, Recorder};
use crate::scene::{DynamicMesh, TracedScene, ViewEntity};

/// Greatest speed of an entity, units a second, and an additional distance, units.
const FASTEST: f32 = 2500.0;
const SLACK: f32 = 32.0;
/// Longest frame time for which velocities are extrapolated, seconds.
const TRUSTED_TIME: f32 = 0.25;
/// Penalty for key frames that do not continue, as a part of the search distance.
const STRANGE_FRAME: f32 = 0.1;

/// Properties by which entities are matched.
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

/// Data of the last frame's view.
#[derive(Default)]
struct Past {
    entities: Vec<ViewEntity>,
    /// Velocity of each entity, units a second.
    velocities: Vec<Vec3>,
    meshes: Vec<DynamicMesh>,
    places: Vec<([Vec3; 3], Vec3)>,
    positions: Vec<Vec3>,
    portals: Vec<PortalRecord>,
    time: f32,
}

/// Matches a view's geometry with that of the last frame.
#[derive(Default)]
pub struct Motion {
    past: Option<Past>,
}

/// Result of [`Motion::follow`].
pub(super) struct Followed {
    /// For each instance.
    pub instances: Vec<LastInstance>,
    /// For each vertex, in the space of its instance in the last frame.
    pub positions: Vec<Vec3>,
    /// For each portal.
    pub portals: Vec<PortalRecord>,
    /// The game's time is that of the last frame.
    pub time_stands: bool,
}

impl Motion {
    /// For each entity of a view, the index of its match in the last view.
    pub fn matches(&self, view: &TracedScene) -> Vec<Option<usize>> {
        match &self.past {
            Some(past) => past.match_entities(&view.look.entities, view.time - past.time),
            None => vec![None; view.look.entities.len()],
        }
    }

    /// Matches a view with the last one and stores it for the next. `matches`: of [`matches`](Self::matches); `vertices`: device address of the view's vertices;
    /// `camera_rests`: the camera has not moved.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(
        &mut self,
        rec: &mut Recorder,
        view: &TracedScene,
        portals: &[PortalRecord],
        (matches, vertices): (Vec<Option<usize>>, u64),
        targets: &Targets,
        camera_rests: bool,
    ) -> Result<MotionView, Error> {
        let found = self.follow(view, portals, matches);
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

    /// Matches all geometry of a view with the last view, and stores the view for the next frame.
    pub(super) fn follow(
        &mut self,
        view: &TracedScene,
        portals: &[PortalRecord],
        matches: Vec<Option<usize>>,
    ) -> Followed {
        // The first view has no predecessor.
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
        let mut velocities = vec![Vec3::ZERO; view.look.entities.len()];
        for ((entity, found_again), velocity) in
            view.look.entities.iter().zip(matches).zip(&mut velocities)
        {
            let Some(last) = found_again.and_then(|i| past.entities.get(i)) else {
                continue; // new
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
    /// For each entity, the index of its match in the last frame.
    fn match_entities(&self, entities: &[ViewEntity], passed: f32) -> Vec<Option<usize>> {
        // a restarted game resets its clock
        let passed = if passed >= 0.0 { passed } else { 0.0 };
        let reach = SLACK + FASTEST * passed;
        let ahead = if passed <= TRUSTED_TIME { passed } else { 0.0 };
        let expected =
            |index: usize, last: &ViewEntity| last.origin + item(&self.velocities, index) * ahead;
        let mut alike: HashMap<Sort, Nearby> = HashMap::new();
        for (index, entity) in self.entities.iter().enumerate() {
            let alike = alike.entry(Sort::of(entity)).or_default();
            alike.add(index, expected(index, entity));
        }
        let match_one = |entity: &ViewEntity| {
            let candidates = alike.get_mut(&Sort::of(entity))?;
            // Of two entities at one position each is matched with itself.
            candidates.take(entity.origin, |index| {
                let last = self.entities.get(index)?;
                if entity.origin.distance(last.origin) > reach {
                    return None;
                }
                let follows = [last.frame, last.old_frame].contains(&entity.old_frame)
                    || entity.frame == last.frame;
                let strange = if follows { 0.0 } else { STRANGE_FRAME * reach };
                Some(entity.origin.distance(expected(index, last)) + strange)
            })
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
                slice::get_mut(&mut found.instances, now),
                slice::get(&view.instances, now),
                slice::get(&self.places, then),
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

    /// Motion of the world's deformed surfaces.
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

    /// Copies the last positions of a mesh whose counts of vertices and triangles are unchanged.
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

    /// The matching portal of the last frame: the nearest one of equal kind and direction; without one, the portal
    /// itself.
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
