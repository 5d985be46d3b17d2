//! Converts entities to instances.

use glam::Vec3;
use shaders::types::{Instance, constants as c};

use super::View;
use crate::api::{RefEntity, renderfx};
use crate::world::GridLight;

/// The instance of the world: no transform, no colour, no entity light.
pub(super) fn world_instance(view: &View, time: f32) -> Instance {
    Instance {
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        origin: Vec3::ZERO,
        viewer: view.origin,
        // the engine's world entity is all zero, so `rgbGen entity` is black
        color: [0.0; 4],
        time,
        flags: c::INSTANCE_UNLIT,
        ..Instance::default()
    }
}

/// The `INSTANCE_*` bits of an entity.
fn flags(entity: &RefEntity) -> u32 {
    [
        (renderfx::DEPTH_HACK, c::INSTANCE_DEPTH_HACK),
        (renderfx::FIRST_PERSON, c::INSTANCE_FIRST_PERSON),
        (renderfx::THIRD_PERSON, c::INSTANCE_THIRD_PERSON),
        (renderfx::NO_SHADOW, c::INSTANCE_NO_SHADOW),
        (renderfx::CROSSHAIR, c::INSTANCE_CROSSHAIR),
    ]
    .into_iter()
    .filter(|(flag, _)| entity.renderfx & flag != 0)
    .fold(0, |bits, (_, bit)| bits | bit)
}

fn color(entity: &RefEntity) -> [f32; 4] {
    entity.shader_rgba.map(|byte| f32::from(byte) / 255.0)
}

/// Instance of an entity with geometry in world space: sprite, beam, rail.
pub(super) fn effect_instance(entity: &RefEntity, view: &View, time: f32) -> Instance {
    Instance {
        color: color(entity),
        texcoord: entity.shader_texcoord,
        time: time - entity.shader_time,
        flags: flags(entity) | c::INSTANCE_UNLIT,
        ..world_instance(view, time)
    }
}

/// Instance of a model. `added`: constant part of its ambient light, which comes from no light source.
pub(super) fn model_instance(
    entity: &RefEntity,
    view: &View,
    time: f32,
    light: &GridLight,
    added: f32,
) -> Instance {
    let axis = entity.axis;
    let into_axes = |v: Vec3| Vec3::new(v.dot(axis[0]), v.dot(axis[1]), v.dot(axis[2]));
    // the engine divides by the length of the first axis: correct for uniform scale
    let scale = if entity.non_normalized_axes {
        let length = axis[0].length();
        if length > 0.0 { 1.0 / length } else { 0.0 }
    } else {
        1.0
    };
    Instance {
        axis,
        origin: entity.origin,
        viewer: into_axes(view.origin - entity.origin) * scale,
        color: color(entity),
        texcoord: entity.shader_texcoord,
        time: time - entity.shader_time,
        ambient: light.ambient / 255.0,
        directed: light.directed / 255.0,
        light_direction: into_axes(light.direction),
        added: added / 255.0,
        flags: flags(entity),
    }
}

/// Transforms a point from instance space to world space.
pub(super) fn to_world(instance: &Instance, p: Vec3) -> Vec3 {
    let [x, y, z] = instance.axis;
    instance.origin + x * p.x + y * p.y + z * p.z
}

/// A world direction along the axes of an instance.
pub(super) fn into_axes(instance: &Instance, v: Vec3) -> Vec3 {
    let [x, y, z] = instance.axis;
    Vec3::new(v.dot(x), v.dot(y), v.dot(z))
}
