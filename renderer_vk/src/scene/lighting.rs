//! Light on entities: light grid, the engine's constant part, dynamic lights.
//!
//! Source: engine behaviour of `renderer_opengl1` (entity lighting, `LightForPoint`).

use glam::Vec3;

use crate::api::DynamicLight;
use crate::settings::Settings;
use crate::world::{GridLight, WorldData};

/// Ambient and directed light without a light grid, 0 to 255.
const NO_GRID: f32 = 150.0;
/// Ambient light that is always added, 0 to 255.
const MINIMUM: f32 = 32.0;
/// Light of a dynamic light of radius 1 at distance 1, 0 to 255; also the least distance, units.
const DYNAMIC_AT_RADIUS: f32 = 16.0;

/// The constant part of [`entity_light`]'s ambient light, 0 to 255.
pub(super) fn added(settings: &Settings) -> f32 {
    MINIMUM * settings.identity_light()
}

/// Light on an entity at `point`: world directions, 0 to 255. `has_world`: the view shows the world.
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
    light.ambient += added(settings);
    let mut direction = light.direction * light.directed.length();
    for dynamic in lights {
        let to_light = dynamic.origin - point;
        let distance = to_light.length();
        let near = distance.max(DYNAMIC_AT_RADIUS);
        let strength = DYNAMIC_AT_RADIUS * dynamic.radius * dynamic.radius / (near * near);
        light.directed += strength * dynamic.color;
        direction += strength * to_light.normalize_or_zero();
    }
    // the engine truncates this limit to an integer
    light.ambient = light.ambient.min(Vec3::splat((255.0 * identity).trunc()));
    light.direction = direction.normalize_or_zero();
    light
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
            ..DynamicLight::default()
        };
        let directed =
            |x| entity_light(None, false, Vec3::ZERO, &[lamp(x)], &settings).directed - 150.0;
        assert!(directed(100.0).abs_diff_eq(Vec3::new(64.0, 32.0, 0.0), 1e-3));
        assert!(directed(200.0).abs_diff_eq(Vec3::new(16.0, 8.0, 0.0), 1e-3));
        // below 16 units the light is constant
        assert_eq!(directed(1.0), directed(16.0));
        let light = entity_light(None, false, Vec3::ZERO, &[lamp(100.0)], &settings);
        assert!(light.direction.abs_diff_eq(Vec3::X, 1e-6));
    }

    /// Reference implementation of the engine's rules in double precision: ambient and directed light as bytes, and the
    /// direction.
    fn described(
        grid: &[(Vec3, [u8; 8])],
        size: Vec3,
        p: Vec3,
        lights: &[DynamicLight],
        scales: [f32; 2],
    ) -> ([f64; 3], [f64; 3], [f64; 3]) {
        let table = |entry: usize| ((entry % 1024) as f64 * std::f64::consts::TAU / 1023.0).sin();
        let (mut ambient, mut directed, mut direction) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let mut total = 0.0;
        for (at, [a0, a1, a2, d0, d1, d2, lng, lat]) in grid {
            let mut weight = 1.0;
            for axis in 0..3 {
                let cells = f64::from(p[axis] - at[axis]).abs() / f64::from(size[axis]);
                weight *= (1.0 - cells).max(0.0);
            }
            if weight == 0.0 || [a0, a1, a2].iter().all(|a| **a == 0) {
                continue;
            }
            total += weight;
            for (sum, value) in ambient.iter_mut().zip([a0, a1, a2]) {
                *sum += weight * f64::from(*value);
            }
            for (sum, value) in directed.iter_mut().zip([d0, d1, d2]) {
                *sum += weight * f64::from(*value);
            }
            let (lat, lng) = (usize::from(*lat) * 4, usize::from(*lng) * 4);
            direction[0] += weight * table(lat + 256) * table(lng);
            direction[1] += weight * table(lat) * table(lng);
            direction[2] += weight * table(lng + 256);
        }
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let even = if total > 0.0 && total < 0.99 {
            total
        } else {
            1.0
        };
        for axis in 0..3 {
            ambient[axis] = ambient[axis] / even * f64::from(scales[0]) + 32.0;
            directed[axis] = directed[axis] / even * f64::from(scales[1]);
        }
        let (unit, strength) = (length(direction).max(1e-30), length(directed));
        direction = direction.map(|x| x / unit * strength);
        for light in lights {
            let to = [0, 1, 2].map(|axis| f64::from(light.origin[axis] - p[axis]));
            let distance = length(to);
            let near = distance.max(16.0);
            let k = 16.0 * f64::from(light.radius).powi(2) / (near * near);
            for axis in 0..3 {
                directed[axis] += k * f64::from(light.color[axis]);
                direction[axis] += k * to[axis] / distance;
            }
        }
        let unit = length(direction);
        (
            ambient.map(|a| a.min(255.0)),
            directed,
            direction.map(|x| x / unit),
        )
    }

    #[test]
    fn light_is_what_the_rules_say() {
        use crate::test_support::{PIXEL, Registration};
        use q3bsp::builder::MapBuilder;

        let size = Vec3::new(64.0, 64.0, 128.0);
        let at_point = |at: Vec3| {
            let byte = |v: f32| (v.abs() as u32 * 7 % 60) as u8;
            let inside_wall = (at.x as i32 / 64 + at.y as i32 / 64) % 3 == 0;
            let ambient = [byte(at.x + 3.0), byte(at.y + 5.0), 9];
            q3bsp::GridPoint {
                ambient: if inside_wall { [0; 3] } else { ambient },
                directed: [byte(at.z + 90.0), byte(at.x * 2.0), byte(at.y + at.z)],
                longitude: at.x.abs() as u8,
                latitude: (at.y + 100.0) as u8,
            }
        };
        let mut game = Registration::from_entries(&[("t/wall.tga", PIXEL)]);
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 0);
        map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
        game.settings.map_overbright_bits = 0;
        let world = game.build(map.build_with_grid(size, at_point));
        let mut grid = Vec::new();
        for (x, y, z) in (0..125u8)
            .map(|i| (i % 5, i / 5 % 5, i / 25))
            .filter(|c| c.2 < 3)
        {
            let at = Vec3::new(
                f32::from(x) * 64.0 - 128.0,
                f32::from(y) * 64.0 - 128.0,
                f32::from(z) * 128.0 - 128.0,
            );
            let point = at_point(at);
            let ([a0, a1, a2], [d0, d1, d2]) = (point.ambient, point.directed);
            let record = [a0, a1, a2, d0, d1, d2, point.longitude, point.latitude];
            grid.push((at, record));
        }
        let lamp = |origin, radius, color| DynamicLight {
            origin,
            radius,
            color,
            ..DynamicLight::default()
        };
        let lamps = [
            lamp(Vec3::new(10.0, 20.0, 30.0), 150.0, Vec3::new(1.0, 0.5, 0.1)),
            lamp(Vec3::new(-50.0, 3.0, 30.0), 60.0, Vec3::new(0.0, 2.0, 0.3)),
        ];
        let scales = [game.settings.ambient_scale, game.settings.directed_scale];
        for p in [
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(-100.0, 77.5, -60.0),
            Vec3::new(63.0, -65.0, 127.0),
            Vec3::new(-20.0, -20.0, 100.0),
        ] {
            for lights in [&[][..], &lamps[..1], &lamps] {
                let light = entity_light(Some(&world), true, p, lights, &game.settings);
                let (ambient, directed, direction) = described(&grid, size, p, lights, scales);
                let near = |found: Vec3, expected: [f64; 3], what: &str| {
                    for (found, expected) in found.to_array().into_iter().zip(expected) {
                        assert!(
                            (f64::from(found) - expected).abs() < 1e-4 * expected.abs().max(1.0),
                            "{what} at {p}: {found}, not {expected}"
                        );
                    }
                };
                near(light.ambient, ambient, "ambient");
                near(light.directed, directed, "directed");
                near(light.direction, direction, "direction");
            }
        }
    }
}
