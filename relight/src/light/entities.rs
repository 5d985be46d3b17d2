//! Light of entities: light entities that the compiler left in the map, and the ambient term.
//!
//! Compilers strip light entities by default, so most maps have none.
//!
//! Source: meanings and defaults of the keys are q3map2's.

use super::{
    AMBIENT_RADIANCE, DEFAULT_POINT_LIGHT_RADIUS, DEFAULT_SUN_RADIUS, Falloff,
    POINT_LIGHT_INTENSITY, PointLight, SUN_IRRADIANCE, Spot, SunLight, raise,
};
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::Entity;

/// Default of `light`.
const DEFAULT_LIGHT: f32 = 300.0;
/// Default `radius` of a spot light: radius of the cone at its target, id units.
const DEFAULT_CONE_RADIUS: f32 = 64.0;
/// Radius that the compiler adds to a cone, id units.
const CONE_MARGIN: f32 = 16.0;
/// `spawnflags` bit of linear falloff.
const LINEAR_FALLOFF: i64 = 1;
/// Scale of a linear light: value l gives 7500 l / 8000 at distance 0.
const LINEAR_SCALE: f32 = 1.0 / 8000.0;

/// Radius of the ball with the volume of a cube of half side 1, over which q3map2 spreads the `_samples` of a light.
const BALL_OF_CUBE: f32 = 1.240_7;

/// Light entities as point lights and suns.
pub(crate) fn light_entities(entities: &[Entity]) -> (Vec<PointLight>, Vec<SunLight>) {
    read_entities(entities, Reading::Traced)
}

/// Light entities as q3map2 computes their light: points and suns have no extent but that of their `_deviance`, the
/// light of linear ones does not depend on its angle of incidence, and negative lights take light away.
pub(super) fn compiled_light_entities(entities: &[Entity]) -> (Vec<PointLight>, Vec<SunLight>) {
    read_entities(entities, Reading::Compiled)
}

/// For what light entities are read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Reading {
    /// For a tracer: lights have an extent, and strengths are positive.
    Traced,
    /// For the light that a map compiler stores.
    Compiled,
}

fn read_entities(entities: &[Entity], reading: Reading) -> (Vec<PointLight>, Vec<SunLight>) {
    let compiled = reading == Reading::Compiled;
    let mut points = Vec::new();
    let mut suns = Vec::new();
    for entity in entities.iter().filter(|e| is_light(e.classname())) {
        let Some(origin) = entity.vec3("origin") else {
            continue; // no place
        };
        let value = value_of(entity);
        let color = color(entity);
        let usable = value > 0.0 || compiled && value < 0.0;
        if !(usable && value.is_finite()) || color == Vec3::ZERO {
            continue;
        }
        let deviance = number(entity, &["_deviance", "_deviation", "_jitter"]).filter(|d| *d > 0.0);
        let samples = number(entity, &["_samples"]).map_or(1.0, |n| n.trunc().max(1.0));
        let deviance = deviance.filter(|_| !compiled || samples > 1.0);
        let target = entity.get("target").and_then(|name| {
            let aim = entities.iter().find(|e| {
                e.get("targetname")
                    .is_some_and(|t| t.eq_ignore_ascii_case(name))
            })?;
            let offset = aim.vec3("origin")? - origin;
            (offset.length() > 0.0).then_some(offset)
        });
        if number(entity, &["_sun"]) == Some(1.0) {
            suns.push(SunLight {
                direction: target.map_or(Vec3::Z, |offset| -offset.normalize_or(Vec3::NEG_Z)),
                irradiance: match compiled {
                    // q3map2 divides the strength of an entity's sun by its samples twice
                    true => color * (value / samples * SUN_IRRADIANCE),
                    false => color * (value * SUN_IRRADIANCE),
                },
                angular_radius: match (deviance, compiled) {
                    (Some(degrees), _) => degrees.min(90.0).to_radians(),
                    (None, true) => 0.0,
                    (None, false) => DEFAULT_SUN_RADIUS,
                },
                material: None,
            });
            continue;
        }
        let flags = number(entity, &["spawnflags"]).map_or(0, |f| f as i64);
        // a spot's light falls off with the square of the distance whatever its flags
        let is_linear = flags & LINEAR_FALLOFF != 0 && (!compiled || target.is_none());
        let (intensity, falloff) = if is_linear {
            let fade = number(entity, &["fade"]).filter(|f| *f > 0.0);
            match linear(value, fade.unwrap_or(1.0)) {
                (intensity, Falloff::Linear { reach }) if compiled => {
                    (intensity, Falloff::LinearAtAnyAngle { reach })
                }
                linear => linear,
            }
        } else {
            (value * POINT_LIGHT_INTENSITY, Falloff::InverseSquare)
        };
        let spot = target.map(|offset| Spot {
            direction: offset.normalize_or(Vec3::NEG_Z),
            tan_half_angle: (number(entity, &["radius"])
                .filter(|r| *r != 0.0)
                .unwrap_or(DEFAULT_CONE_RADIUS)
                + CONE_MARGIN)
                / offset.length(),
        });
        points.push(PointLight {
            origin,
            intensity: color * intensity,
            radius: match compiled {
                true => deviance.unwrap_or(0.0) * BALL_OF_CUBE,
                false => DEFAULT_POINT_LIGHT_RADIUS,
            },
            spot,
            falloff,
            pulse: None,
        });
    }
    (points, suns)
}

/// Value of a light entity. q3map2 subtracts negative lights.
fn value_of(entity: &Entity) -> f32 {
    let scale = number(entity, &["scale"]).filter(|s| *s != 0.0);
    let light = number(entity, &["_light", "light"]).filter(|light| *light != 0.0);
    light.unwrap_or(DEFAULT_LIGHT) * scale.unwrap_or(1.0)
}

/// Number of light entities with a negative value (dark spots), which a light source cannot represent.
pub(crate) fn negative_lights(entities: &[Entity]) -> usize {
    let lights = entities.iter().filter(|e| is_light(e.classname()));
    lights.filter(|light| value_of(light) < 0.0).count()
}

/// Intensity and falloff of a linear light of a value and a `fade`.
///
/// It gives v(d) = N cosθ − fade d with N = 7500 l / 8000, so it reaches R = N / fade and gives a surface that faces it
/// half its strength at R / 2; with E = π v 4 / 255 the inverse-square light that is equal there has I = E (R / 2)².
pub(super) fn linear(value: f32, fade: f32) -> (f32, Falloff) {
    let near = 7500.0 * value * LINEAR_SCALE;
    let reach = near / fade;
    let intensity = SUN_IRRADIANCE * near * 0.5 * (reach * 0.5) * (reach * 0.5);
    (intensity, Falloff::Linear { reach })
}

/// Value and `fade` of a [`linear`] light of an intensity that reaches so far.
pub(super) fn value_and_fade(intensity: f32, reach: f32) -> (f32, f32) {
    let near = intensity / (SUN_IRRADIANCE * 0.5 * (reach * 0.5) * (reach * 0.5));
    (near / (7500.0 * LINEAR_SCALE), near / reach)
}

/// Ambient radiance: the compiler adds `ambient` to every texel and raises texels to `_minlight`.
pub(crate) fn ambient(entities: &[Entity]) -> Vec3 {
    let Some(world) = entities.first() else {
        // The map has no entities.
        return Vec3::ZERO;
    };
    let positive = |keys: &[&str]| {
        number(world, keys)
            .filter(|v| *v > 0.0 && v.is_finite())
            .unwrap_or(0.0)
    };
    let value = positive(&["_ambient", "ambient"]).max(positive(&["_minlight"]));
    world_color(world) * (value * AMBIENT_RADIANCE)
}

/// `ambient` alone, as radiance, without the bound `_minlight`.
pub(super) fn ambient_alone(entities: &[Entity]) -> Vec3 {
    world_light(entities, &["_ambient", "ambient"])
}

/// Bounds that a compiler raises light to, as radiance: of texels (`_minlight`), of vertices (`_minvertexlight`) and
/// of the grid's ambient light (`_mingridlight`); those of the latter two default to the first.
pub(super) fn least_light(entities: &[Entity]) -> [Vec3; 3] {
    [
        world_light(entities, &["_minlight"]),
        world_light(entities, &["_minvertexlight", "_minlight"]),
        world_light(entities, &["_mingridlight", "_minlight"]),
    ]
}

/// Radiance of the first of these keys of the world that exists, in the colour of the world; none if it is negative.
fn world_light(entities: &[Entity], keys: &[&str]) -> Vec3 {
    let Some(world) = entities.first() else {
        return Vec3::ZERO;
    };
    let value = number(world, keys).unwrap_or(0.0).max(0.0);
    world_color(world) * (value * AMBIENT_RADIANCE)
}

/// `_color` of the world, which the compiler takes as it is; white when absent or black.
fn world_color(world: &Entity) -> Vec3 {
    let color = world.vec3("_color").filter(|c| c.is_finite());
    let color = color.unwrap_or(Vec3::ZERO).max(Vec3::ZERO);
    match color == Vec3::ZERO {
        true => Vec3::ONE,
        false => color,
    }
}

impl RelitWorld {
    /// Replaces the point lights, the suns and the ambient term of entities by those of others, and rebuilds the light
    /// lists. False, and no change, if the [light of a map without any](super::fallback) was needed or would be: loading
    /// finds that.
    pub fn replace_light_entities(&mut self, entities: &[Entity]) -> bool {
        let (mut points, mut suns) = light_entities(entities);
        let ambient = raise(ambient(entities), self.color_exponent);
        let strengths = points.iter_mut().map(|l| &mut l.intensity);
        for strength in strengths.chain(suns.iter_mut().map(|s| &mut s.irradiance)) {
            *strength = raise(*strength, self.color_exponent);
        }
        // those of skies follow those of entities
        suns.extend(self.suns.iter().filter(|sun| sun.material.is_some()));
        if self.report.fallback || points.len() + suns.len() + self.lights.len() == 0 {
            return false;
        }
        self.point_lights = points;
        self.suns = suns;
        self.ambient = ambient;
        self.report.point_lights = self.point_lights.len();
        self.report.suns = self.suns.len();
        super::build_lists(self);
        true
    }
}

/// Whether an entity class lights the world. (`lightJunior` lights moving models only.)
fn is_light(classname: &str) -> bool {
    let class = classname.to_ascii_lowercase();
    class.starts_with("light") && class != "lightjunior"
}

/// The first existing key as a finite number.
fn number(entity: &Entity, keys: &[&str]) -> Option<f32> {
    keys.iter()
        .find_map(|key| entity.number(key))
        .filter(|v| v.is_finite())
}

/// `_color`, scaled so that its largest channel is 1; white when absent.
fn color(entity: &Entity) -> Vec3 {
    match entity.vec3("_color") {
        Some(color) => normalise(color.max(Vec3::ZERO)),
        None => Vec3::ONE,
    }
}

/// A colour scaled so that its largest channel is 1; white when there is nothing to scale.
pub(super) fn normalise(color: Vec3) -> Vec3 {
    let largest = color.max_element();
    if largest > 0.0 && color.is_finite() {
        color / largest
    } else {
        Vec3::ONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    fn entities(text: &str) -> Vec<Entity> {
        q3bsp::entities::parse(text.as_bytes()).0
    }

    #[test]
    fn a_point_light_lights_as_the_compiler_computes() {
        let text = r#"{ "classname" "worldspawn" } { "classname" "light" "origin" "1 2 3" "light" "200" "_color" "0.5 0.25 0" }"#;
        let (points, suns) = light_entities(&entities(text));
        assert!(suns.is_empty());
        let [light] = points[..] else {
            panic!("{points:?}")
        };
        assert_eq!(light.origin, Vec3::new(1.0, 2.0, 3.0));
        // At distance d the compiler stores 7500 · 200 / d², shown ×4; white shows I / d² / π.
        let shown = light.intensity / (100.0 * 100.0) / PI;
        let stored = 7500.0 * 200.0 / (100.0 * 100.0) * 4.0 / 255.0;
        assert!((shown - stored * Vec3::new(1.0, 0.5, 0.0)).length() < 1e-3);
        assert_eq!(light.spot, None);
    }

    #[test]
    fn targets_make_spots_and_suns() {
        let text = r#"{ "classname" "worldspawn" "ambient" "10" "_color" "0 2 1" }
            { "classname" "light" "origin" "0 0 100" "target" "a" "radius" "84" }
            { "classname" "light" "origin" "0 0 100" "target" "a" "_sun" "1" "light" "50" "_deviance" "2" }
            { "classname" "light" "origin" "0 0 100" "target" "nothing" }
            { "classname" "light" "light" "100" }
            { "classname" "light" "origin" "0 0 0" "light" "-3" }
            { "classname" "target_position" "origin" "0 0 0" "targetname" "a" }"#;
        let entities = entities(text);
        let (points, suns) = light_entities(&entities);
        assert_eq!(points.len(), 2);
        let spot = points[0].spot.unwrap();
        assert_eq!(spot.direction, Vec3::NEG_Z);
        assert!((spot.tan_half_angle - 1.0).abs() < 1e-6);
        assert_eq!(points[1].spot, None);
        assert_eq!(suns[0].direction, Vec3::Z);
        assert!((suns[0].irradiance.x - PI * 50.0 * 4.0 / 255.0).abs() < 1e-5);
        assert!((suns[0].angular_radius - 2f32.to_radians()).abs() < 1e-7);
        assert!((ambient(&entities) - Vec3::new(0.0, 2.0, 1.0) * 40.0 / 255.0).length() < 1e-6);
        assert_eq!(ambient(&[]), Vec3::ZERO);
    }

    #[test]
    fn lights_of_entities_are_replaced_and_others_stay() {
        use crate::materials::Materials;
        use crate::sample::Sample;
        let files = Sample::Hall.files().unwrap();
        let (materials, _) = Materials::load(&files);
        let options = crate::Options {
            calibrate: None,
            ..crate::Options::default()
        };
        let mut world = RelitWorld::load(&files, &materials, Sample::Hall.map(), options).unwrap();
        let (before, own) = (world.lights.clone(), world.suns.clone());
        assert!(own.iter().all(|sun| sun.material.is_some()));
        let text = r#"{ "classname" "worldspawn" "ambient" "10" }
            { "classname" "light" "origin" "1 2 3" "light" "200" }
            { "classname" "light" "origin" "0 0 9" "target" "a" "_sun" "1" "light" "50" }
            { "classname" "target_position" "origin" "0 0 0" "targetname" "a" }"#;
        assert!(world.replace_light_entities(&entities(text)));
        assert_eq!(world.point_lights.len(), 1);
        assert_eq!(world.suns.len(), own.len() + 1);
        let raised = raise(Vec3::splat(10.0 * AMBIENT_RADIANCE), world.color_exponent);
        assert!((world.ambient - raised).length() < 1e-6);
        assert_eq!(world.light_lists.row(-1).len(), before.len() + 1);
        // once more, with other entities: nothing of the first is left
        let text = r#"{ "classname" "worldspawn" }"#;
        assert!(world.replace_light_entities(&entities(text)));
        assert!(world.point_lights.is_empty());
        assert_eq!((&world.suns, &world.lights), (&own, &before));
        assert_eq!(world.ambient, Vec3::ZERO);
        // a map of entities alone, and without any
        world.lights.clear();
        world.suns.clear();
        assert!(!world.replace_light_entities(&entities(text)));
    }

    #[test]
    fn linear_lights_give_what_the_compiler_computes() {
        let text = r#"{ "classname" "worldspawn" }
            { "classname" "light" "origin" "0 0 0" "light" "300" "spawnflags" "1" "fade" "2" }"#;
        let (points, _) = light_entities(&entities(text));
        let [light] = points[..] else {
            panic!("{points:?}")
        };
        let near = 7500.0 * 300.0 / 8000.0;
        for (distance, cosine) in [
            (1.0f32, 1.0f32),
            (50.0, 0.8),
            (100.0, 1.0),
            (140.0, 1.0),
            (150.0, 1.0),
        ] {
            let stored = (near * cosine - 2.0 * distance).max(0.0);
            let found = light.intensity.x * light.falloff.irradiance(distance, cosine);
            assert!(
                (found - SUN_IRRADIANCE * stored).abs() < 1e-3,
                "{distance}: {found}"
            );
        }
        // Half way it is as bright as one of the same intensity that falls off with the square.
        let half = near / 4.0;
        let square = Falloff::InverseSquare.irradiance(half, 1.0);
        assert!((light.falloff.irradiance(half, 1.0) / square - 1.0).abs() < 1e-4);
    }

    #[test]
    fn compiled_lights_are_those_of_the_compiler() {
        let text = r#"{ "classname" "worldspawn" "ambient" "10" "_minlight" "20" "_mingridlight" "5" }
            { "classname" "light" "origin" "0 0 0" "light" "-100" }
            { "classname" "light" "origin" "0 0 0" "light" "0" "_deviance" "8" }
            { "classname" "light" "origin" "0 0 0" "light" "400" "_deviance" "8" "_samples" "4" }
            { "classname" "light" "origin" "0 0 0" "light" "300" "spawnflags" "1" "fade" "2" }
            { "classname" "light" "origin" "0 0 100" "target" "a" "_sun" "1" "light" "60" "_samples" "3" "_deviance" "2" }
            { "classname" "light" "origin" "0 0 100" "target" "a" "light" "60" "spawnflags" "1" }
            { "classname" "target_position" "origin" "0 0 0" "targetname" "a" }"#;
        let entities = entities(text);
        let (points, suns) = compiled_light_entities(&entities);
        let strengths: Vec<f32> = points
            .iter()
            .map(|p| p.intensity.x / POINT_LIGHT_INTENSITY)
            .collect();
        assert!((strengths[0] + 100.0).abs() < 1e-3, "{strengths:?}");
        // 0 counts as absent; without samples a light has no extent
        assert!((strengths[1] - 300.0).abs() < 1e-3 && points[1].radius == 0.0);
        assert!((strengths[2] - 400.0).abs() < 1e-3 && points[2].radius > 8.0);
        // linear light: 7500 · 300 / 8000 − 2 d at any angle of incidence
        let linear = points[3];
        let found = linear.intensity.x * linear.falloff.irradiance(50.0, 0.1) / SUN_IRRADIANCE;
        assert!((found - (281.25 - 100.0)).abs() < 1e-2, "{found}");
        assert_eq!(linear.falloff.irradiance(50.0, -0.1), 0.0);
        assert_eq!(points[4].falloff, Falloff::InverseSquare);
        assert!((suns[0].irradiance.x - 20.0 * SUN_IRRADIANCE).abs() < 1e-5);
        assert!((suns[0].angular_radius - 2f32.to_radians()).abs() < 1e-7);
        let bytes = |light: Vec3| (light.x / AMBIENT_RADIANCE).round();
        assert_eq!(bytes(ambient_alone(&entities)), 10.0);
        assert_eq!(least_light(&entities).map(bytes), [20.0, 20.0, 5.0]);
        assert_eq!(bytes(ambient(&entities)), 20.0);
    }
}
