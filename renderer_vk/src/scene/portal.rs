//! Portals and mirrors: the surfaces that show another view, and those views.
//!
//! Source: engine behaviour of `renderer_opengl1` (portal views).

use glam::{Quat, Vec3, Vec4};
use q3bsp::Plane;
use shaders::types::Instance;
use support::slice::{self, part, span};

use super::shapes::perpendicular;
use super::{ClassicScene, DrawSurface, GatherInput, Geometry, Portal, View, entity};
use crate::api::{EntityKind, RefDef, RefEntity, rdflags};
use crate::assets::Model;
use crate::world::WorldData;

/// Largest distance between a portal's plane and the entity that marks it, units.
const REACH: f32 = 64.0;

/// The first visible surface in drawing order that shows a portal or mirror; `None` inside such a view.
pub(super) fn find_first(
    entities: &[RefEntity],
    input: &GatherInput<'_>,
    def: &RefDef,
    scene: &ClassicScene,
) -> Option<Portal> {
    let settings = input.settings;
    let world = input.world?;
    if settings.hides_portals() || scene.view.is_portal {
        return None;
    }
    // surfaces are in drawing order, portals first
    scene
        .look
        .surfaces
        .iter()
        .take_while(|s| input.materials.get(s.material).sort <= shaderscript::sort::PORTAL)
        .find_map(|surface| {
            let triangles = triangles(world, scene, surface);
            let plane =
                stored_plane(world, scene, surface).or_else(|| plane_of(triangles.first()?))?;
            let portal = portal_at(plane, entities, def)?;
            let range = input.materials.get(surface.material).portal_range;
            let reach = (!portal.mirror).then_some(range);
            in_sight(&triangles, &scene.view, reach).then_some(portal)
        })
}

/// All portals and mirrors that rays may hit, one for each plane.
pub(super) fn find_all(
    entities: &[RefEntity],
    input: &GatherInput<'_>,
    def: &RefDef,
) -> Vec<Portal> {
    let mut found: Vec<Portal> = Vec::new();
    let shows_world = def.flags & rdflags::NO_WORLD_MODEL == 0;
    let Some(world) = input.world.filter(|_| shows_world) else {
        return found;
    };
    if input.settings.hides_portals()
        || !entities.iter().any(|e| e.kind == EntityKind::PortalSurface)
    {
        return found;
    }
    for &index in &world.portal_surfaces {
        let Some(surface) = slice::get(&world.surfaces, index as usize) else {
            continue;
        };
        let Some(instance) = placed_model(surface.model, entities, input) else {
            continue; // of a model that the game does not show
        };
        let plane = surface.plane.map(|plane| placed_plane(plane, &instance));
        let plane = plane.or_else(|| {
            let triangle = world
                .triangles(surface.first_index, surface.index_count)
                .next()?;
            plane_of(&triangle.map(|p| entity::to_world(&instance, p)))
        });
        let Some(portal) = plane.and_then(|plane| portal_at(plane, entities, def)) else {
            continue; // without an entity that says where it leads
        };
        let known = found.iter().any(|p| {
            p.plane.abs_diff_eq(portal.plane, 1e-3) && p.entity_origin == portal.entity_origin
        });
        if !known {
            found.push(portal);
        }
    }
    found
}

/// The instance of a BSP model; 0 is the world. `None`: no entity places it.
fn placed_model(model: u32, entities: &[RefEntity], input: &GatherInput<'_>) -> Option<Instance> {
    let identity = Instance {
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        ..Instance::default()
    };
    if model == 0 {
        return Some(identity);
    }
    if !input.settings.draw_entities {
        return None;
    }
    let places = |e: &&RefEntity| {
        let of_map = |m: &Model| matches!(m, Model::Inline { model: of, .. } if *of == model);
        e.kind == EntityKind::Model && input.models.get(e.model).is_some_and(of_map)
    };
    let entity = entities.iter().find(places)?;
    entity
        .axis
        .iter()
        .all(|a| a.is_finite())
        .then_some(Instance {
            axis: entity.axis,
            origin: entity.origin,
            ..identity
        })
}

/// The plane that the map stores for a surface of the view. The up direction in a portal depends on the smallest
/// component of the normal; triangles may be deformed, and their normals have rounding errors.
fn stored_plane(world: &WorldData, scene: &ClassicScene, surface: &DrawSurface) -> Option<Plane> {
    let instance = slice::get(&scene.instances, surface.instance as usize)?;
    let mut portals = world
        .portal_surfaces
        .iter()
        .filter_map(|&index| slice::get(&world.surfaces, index as usize));
    let found = match surface.geometry {
        Geometry::Static { first_index, .. } => portals.find(|s| {
            s.first_index == first_index || s.classic.is_some_and(|c| c.first_index == first_index)
        })?,
        Geometry::Dynamic { first_index, .. } => {
            let mut meshes = scene.meshes.iter();
            let mesh = meshes.find(|mesh| mesh.first_index == first_index)?;
            slice::get(&world.surfaces, mesh.world_surface? as usize)?
        }
    };
    found.plane.map(|plane| placed_plane(plane, instance))
}

/// A plane in the space of an instance, transformed to world space.
fn placed_plane(plane: Plane, instance: &Instance) -> Plane {
    let [x, y, z] = instance.axis;
    let normal = x * plane.normal.x + y * plane.normal.y + z * plane.normal.z;
    Plane {
        normal,
        dist: plane.dist + normal.dot(instance.origin),
    }
}

/// World-space triangles of a surface.
fn triangles(world: &WorldData, scene: &ClassicScene, surface: &DrawSurface) -> Vec<[Vec3; 3]> {
    let Some(instance): Option<&Instance> = slice::get(&scene.instances, surface.instance as usize)
    else {
        return Vec::new();
    };
    let place = |t: [Vec3; 3]| t.map(|p| entity::to_world(instance, p));
    match surface.geometry {
        Geometry::Static {
            first_index,
            index_count,
        } => world
            .triangles(first_index, index_count)
            .map(place)
            .collect(),
        Geometry::Dynamic {
            first_index,
            index_count,
        } => {
            let position = |&i: &u32| {
                scene
                    .vertices
                    .get(i as usize)
                    .map_or(Vec3::ZERO, |v| v.position)
            };
            let indices = part(&scene.indices, span(first_index, index_count));
            let corners = indices.as_chunks::<3>().0.iter();
            corners
                .map(|t| place([position(&t[0]), position(&t[1]), position(&t[2])]))
                .collect()
        }
    }
}

/// Plane of a triangle, whose front winds clockwise.
fn plane_of(triangle: &[Vec3; 3]) -> Option<Plane> {
    let [a, b, c] = *triangle;
    let normal = (c - a).cross(b - a).try_normalize()?;
    Some(Plane {
        normal,
        dist: normal.dot(a),
    })
}

/// The portal or mirror on a plane; `None` if no entity marks it.
fn portal_at(plane: Plane, entities: &[RefEntity], def: &RefDef) -> Option<Portal> {
    let entity = entities.iter().find(|e| {
        e.kind == EntityKind::PortalSurface
            && e.old_origin.is_finite()
            && plane.distance(e.origin).abs() <= REACH
    })?;
    let across = perpendicular(plane.normal);
    let surface_axis = [plane.normal, across, plane.normal.cross(across)];
    let mirror = entity.origin == entity.old_origin;
    let (surface_origin, camera_origin, camera_axis) = if mirror {
        let on_plane = plane.normal * plane.dist;
        let [normal, across, up] = surface_axis;
        (on_plane, on_plane, [-normal, across, up])
    } else {
        let on_plane = entity.origin - plane.normal * plane.distance(entity.origin);
        (on_plane, entity.old_origin, camera_axes(entity, def))
    };
    Some(Portal {
        plane: plane.normal.extend(plane.dist),
        mirror,
        surface_origin,
        surface_axis,
        camera_origin,
        camera_axis,
        pvs_origin: entity.old_origin,
        entity_origin: entity.origin,
    })
}

/// Axes of a portal's far camera: those of its entity, turned by half a turn and rolled by its parameters.
fn camera_axes(entity: &RefEntity, def: &RefDef) -> [Vec3; 3] {
    let [forward, left, up] = entity.axis;
    let forward = -forward;
    let left = -left;
    let milliseconds = def.time_ms as f32;
    let degrees = if entity.old_frame != 0 {
        if entity.frame != 0 {
            milliseconds / 1000.0 * entity.frame as f32
        } else {
            entity.skin_num as f32 + 4.0 * (milliseconds * 0.003).sin()
        }
    } else {
        entity.skin_num as f32
    };
    if degrees == 0.0 {
        return [forward, left, up];
    }
    let Some(about) = forward.try_normalize() else {
        return [forward, left, up];
    };
    let left = Quat::from_axis_angle(about, degrees.to_radians()) * left;
    [forward, left, forward.cross(left)]
}

/// Whether a triangle faces the camera and lies in the frustum; with `reach`, also near enough.
fn in_sight(triangles: &[[Vec3; 3]], view: &View, reach: Option<f32>) -> bool {
    let frustum = view.frustum();
    let corners = || triangles.iter().flatten();
    let out = frustum
        .iter()
        .any(|plane| corners().all(|p| plane.truncate().dot(*p) < plane.w));
    let nearest = corners()
        .map(|p| p.distance_squared(view.origin))
        .fold(f32::INFINITY, f32::min);
    let faces = triangles
        .iter()
        .any(|t| plane_of(t).is_some_and(|plane| plane.distance(view.origin) > 0.0));
    !out && faces && reach.is_none_or(|reach| nearest <= reach * reach)
}

/// The view that a portal or mirror shows.
pub(super) fn view_through(portal: &Portal, from: &View) -> View {
    let turn = |v: Vec3| {
        let [a, b, c] = portal.surface_axis.map(|axis| v.dot(axis));
        let [x, y, z] = portal.camera_axis;
        x * a + y * b + z * c
    };
    let normal = -portal.camera_axis[0];
    let mut view = View {
        origin: portal.camera_origin + turn(from.origin - portal.surface_origin),
        axis: from.axis.map(turn),
        mirrored: portal.mirror != from.mirrored,
        clip_plane: Some(Vec4::from((normal, normal.dot(portal.camera_origin)))),
        is_portal: true,
        ..*from
    };
    view.update();
    view
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marker(origin: Vec3, old_origin: Vec3) -> RefEntity {
        RefEntity {
            kind: EntityKind::PortalSurface,
            origin,
            old_origin,
            axis: [Vec3::X, Vec3::Y, Vec3::Z],
            ..RefEntity::default()
        }
    }

    /// A wall at x = 100 that faces the origin.
    fn wall() -> Plane {
        Plane {
            normal: -Vec3::X,
            dist: -100.0,
        }
    }

    #[test]
    fn a_mirror_reflects_camera_and_axes() {
        let at = Vec3::new(90.0, 5.0, 0.0);
        let def = RefDef::default();
        let portal = portal_at(wall(), &[marker(at, at)], &def).unwrap();
        assert!(portal.mirror);
        let view = View::new(
            &RefDef {
                view_origin: Vec3::new(10.0, 3.0, 2.0),
                ..def
            },
            4.0,
            1000.0,
        );
        let seen = view_through(&portal, &view);
        assert!(seen.origin.abs_diff_eq(Vec3::new(190.0, 3.0, 2.0), 1e-4));
        assert!(seen.axis[0].abs_diff_eq(-Vec3::X, 1e-6));
        assert!(seen.axis[1].abs_diff_eq(Vec3::Y, 1e-6));
        assert!(seen.mirrored && seen.is_portal);
        // the view shows the front of the mirror's plane only
        let clip = seen.clip_plane.unwrap();
        assert!(clip.truncate().dot(Vec3::ZERO) > clip.w);
        assert!(clip.truncate().dot(Vec3::X * 150.0) < clip.w);
    }

    #[test]
    fn a_portal_shows_the_far_camera() {
        let def = RefDef::default();
        let far = Vec3::new(0.0, 5000.0, 0.0);
        let portal = portal_at(wall(), &[marker(Vec3::new(99.0, 0.0, 0.0), far)], &def).unwrap();
        assert!(!portal.mirror);
        assert_eq!(portal.surface_origin, Vec3::new(100.0, 0.0, 0.0));
        let view = View::new(&def, 4.0, 1000.0);
        let seen = view_through(&portal, &view);
        // looking straight into the portal is looking along the far camera's axis, from behind it
        assert!(seen.axis[0].abs_diff_eq(Vec3::X, 1e-5), "{}", seen.axis[0]);
        assert!(
            seen.origin.abs_diff_eq(far - Vec3::X * 100.0, 1e-3),
            "{}",
            seen.origin
        );
        assert!(!seen.mirrored);
    }

    #[test]
    fn no_entity_near_the_plane_is_no_portal() {
        let def = RefDef::default();
        let near = marker(Vec3::new(36.5, 0.0, 0.0), Vec3::ZERO);
        assert!(portal_at(wall(), &[near], &def).is_some());
        let away = marker(Vec3::new(35.0, 0.0, 0.0), Vec3::ZERO);
        assert!(portal_at(wall(), &[away], &def).is_none());
        assert!(portal_at(wall(), &[], &def).is_none());
    }
}
