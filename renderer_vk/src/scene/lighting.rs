//! Light on entities: the light grid, the engine's constant part, dynamic lights.
//!
//! Source: engine behaviour of `renderer_opengl1` (entity lighting, `LightForPoint`).

use glam::Vec3;

use crate::api::{DynamicLight, PointLighting};
use crate::settings::Settings;
use crate::world::{GridLight, WorldData};

/// Ambient and directed light where there is no grid, of 255.
const NO_GRID: f32 = 150.0;
/// Ambient light that is always added, of 255.
const MINIMUM: f32 = 32.0;
/// Strength of a dynamic light of radius 1 at distance 1, of 255; also the least distance that counts.
const DYNAMIC_AT_RADIUS: f32 = 16.0;

/// Light on an entity at `point`, world directions, 0..255 scale. `has_world`: the view shows the world.
pub(super) fn entity_light(
    world: Option<&WorldData>,
    has_world: bool,
    point: Vec3,
    lights: &[DynamicLight],
    settings: &Settings,
) -> GridLight {
    let identity = settings.identity_light();
    let grid = world
        .filter(|_| has_world)
        .and_then(|world| world.grid_light(point, settings));
    let mut light = grid.unwrap_or(GridLight {
        ambient: Vec3::splat(NO_GRID * identity),
        directed: Vec3::splat(NO_GRID * identity),
        direction: world.map_or(Vec3::ZERO, |world| world.sun_direction),
    });
    light.ambient += MINIMUM * identity;
    let mut direction = light.direction * light.directed.length();
    for dynamic in lights {
        let to_light = dynamic.origin - point;
        let distance = to_light.length();
        let near = distance.max(DYNAMIC_AT_RADIUS);
        let strength = DYNAMIC_AT_RADIUS * dynamic.radius * dynamic.radius / (near * near);
        light.directed += strength * dynamic.color;
        direction += strength * to_light.normalize_or_zero();
    }
    // the engine keeps this limit in whole numbers
    light.ambient = light.ambient.min(Vec3::splat((255.0 * identity).trunc()));
    light.direction = direction.normalize_or_zero();
    light
}

/// Light at a point of the map, before the engine's constant part and dynamic lights; `None` without a light grid.
pub fn light_for_point(
    world: &WorldData,
    point: Vec3,
    settings: &Settings,
) -> Option<PointLighting> {
    let light = world.grid_light(point, settings)?;
    Some(PointLighting {
        ambient: light.ambient,
        directed: light.directed,
        direction: light.direction,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_grid_light_is_even() {
        let settings = Settings::default();
        let light = entity_light(None, false, Vec3::ZERO, &[], &settings);
        assert_eq!(light.ambient, Vec3::splat(182.0));
        assert_eq!(light.directed, Vec3::splat(150.0));
        assert_eq!(light.direction, Vec3::ZERO);
    }

    #[test]
    fn dynamic_lights_fall_off_with_the_square() {
        let settings = Settings::default();
        let lamp = |x: f32| DynamicLight {
            origin: Vec3::new(x, 0.0, 0.0),
            radius: 200.0,
            color: Vec3::new(1.0, 0.5, 0.0),
            additive: false,
        };
        let directed =
            |x| entity_light(None, false, Vec3::ZERO, &[lamp(x)], &settings).directed - 150.0;
        assert!(directed(100.0).abs_diff_eq(Vec3::new(64.0, 32.0, 0.0), 1e-3));
        assert!(directed(200.0).abs_diff_eq(Vec3::new(16.0, 8.0, 0.0), 1e-3));
        // nearer than 16 units it grows no more
        assert_eq!(directed(1.0), directed(16.0));
        let light = entity_light(None, false, Vec3::ZERO, &[lamp(100.0)], &settings);
        assert!(light.direction.abs_diff_eq(Vec3::X, 1e-6));
    }
}
