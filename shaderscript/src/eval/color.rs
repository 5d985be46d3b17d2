//! `rgbGen` and `alphaGen`: the colour that multiplies a stage's image, as bytes like the engine's.

use super::{byte, wave};
use crate::stage::{AlphaGen, RgbGen, Stage, WaveFunction};
use glam::Vec3;

/// Light of the light grid at an entity, in bytes (0..255), as the engine's `lightingDiffuse` takes it.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct DiffuseLight {
    /// From everywhere, already clamped to the full byte range of the display.
    pub ambient: Vec3,
    /// From one direction; may exceed 255.
    pub directed: Vec3,
    /// Unit vector towards the light, in entity space; zero for ambient only.
    pub direction: Vec3,
}

/// What colours depend on besides the vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorContext {
    /// Shader time in seconds.
    pub time: f64,
    /// 1 / overbright factor.
    pub identity_light: f32,
    /// The entity's colour.
    pub entity: [u8; 4],
    /// Light at the entity; `None` for what the light grid does not light: the world, sprites, pictures.
    pub light: Option<DiffuseLight>,
    /// Camera position, entity space.
    pub viewer: Vec3,
    /// Camera position in the space that `alphaGen portal` measures in: the world, for the world's own surfaces.
    pub portal_camera: Vec3,
}

impl Default for ColorContext {
    /// Time 0, no overbright, a white entity without light, the camera at the origin.
    fn default() -> Self {
        ColorContext {
            time: 0.0,
            identity_light: 1.0,
            entity: [255; 4],
            light: None,
            viewer: Vec3::ZERO,
            portal_camera: Vec3::ZERO,
        }
    }
}

/// Colour and alpha of a stage at a vertex.
pub fn vertex_color(
    stage: &Stage,
    context: &ColorContext,
    position: Vec3,
    normal: Vec3,
    vertex: [u8; 4],
) -> [u8; 4] {
    let [r, g, b] = rgb_gen(&stage.rgb_gen, context, normal, vertex);
    let a = match (&stage.alpha_gen, &stage.rgb_gen) {
        // Light has an alpha of its own, and vertices keep theirs where the engine copies them as they are.
        (AlphaGen::Identity, RgbGen::LightingDiffuse) if context.light.is_none() => 0,
        (AlphaGen::Identity, RgbGen::Vertex) if context.identity_light == 1.0 => vertex[3],
        (kind, _) => alpha_gen(kind, context, position, normal, vertex),
    };
    [r, g, b, a]
}

/// Colour of `rgbGen` at a vertex.
pub fn rgb_gen(rgb_gen: &RgbGen, context: &ColorContext, normal: Vec3, vertex: [u8; 4]) -> [u8; 3] {
    let [r, g, b, _] = vertex;
    let [entity_r, entity_g, entity_b, _] = context.entity;
    let idl = context.identity_light;
    match rgb_gen {
        RgbGen::Identity => [255; 3],
        RgbGen::IdentityLighting => [byte(255.0 * idl); 3],
        RgbGen::Wave(w) => {
            let glow = wave(w, context.time);
            // Noise alone is not reduced for overbright.
            let scale = if w.function == WaveFunction::Noise {
                1.0
            } else {
                idl
            };
            [byte(255.0 * (glow * scale).clamp(0.0, 1.0)); 3]
        }
        RgbGen::Const(color) => (*color * 255.0).to_array().map(byte),
        RgbGen::Entity => [entity_r, entity_g, entity_b],
        RgbGen::OneMinusEntity => [entity_r, entity_g, entity_b].map(|c| 255 - c),
        RgbGen::Vertex => [r, g, b].map(|c| byte(f32::from(c) * idl)),
        RgbGen::ExactVertex => [r, g, b],
        RgbGen::OneMinusVertex => [r, g, b].map(|c| byte(f32::from(255 - c) * idl)),
        RgbGen::LightingDiffuse => context
            .light
            .as_ref()
            .map_or([0; 3], |light| diffuse(light, normal)),
    }
}

/// Alpha of `alphaGen` at a vertex.
pub fn alpha_gen(
    alpha_gen: &AlphaGen,
    context: &ColorContext,
    position: Vec3,
    normal: Vec3,
    vertex: [u8; 4],
) -> u8 {
    match alpha_gen {
        AlphaGen::Identity => 255,
        AlphaGen::Const(alpha) => byte(255.0 * alpha),
        AlphaGen::Wave(w) => byte(255.0 * wave(w, context.time).clamp(0.0, 1.0)),
        AlphaGen::Entity => context.entity[3],
        AlphaGen::OneMinusEntity => 255 - context.entity[3],
        AlphaGen::Vertex => vertex[3],
        AlphaGen::OneMinusVertex => 255 - vertex[3],
        AlphaGen::LightingSpecular => specular_alpha(position, normal, context.viewer),
        AlphaGen::Portal { range } => {
            let distance = position.distance(context.portal_camera) / range;
            if distance < 0.0 {
                0
            } else if distance > 1.0 {
                255
            } else {
                byte(distance * 255.0)
            }
        }
    }
}

/// `rgbGen lightingDiffuse`: ambient + max(0, n.l) directed, each channel capped at 255.
pub fn diffuse(light: &DiffuseLight, normal: Vec3) -> [u8; 3] {
    let incoming = normal.dot(light.direction).max(0.0);
    (light.ambient + incoming * light.directed)
        .to_array()
        .map(byte)
}

/// `alphaGen lightingSpecular`: fourth power of the cosine between the reflected direction of a light that stands at
/// (-960, 1980, 96) in entity space, and the direction to the viewer.
pub fn specular_alpha(position: Vec3, normal: Vec3, viewer: Vec3) -> u8 {
    const LIGHT: Vec3 = Vec3::new(-960.0, 1980.0, 96.0);
    let to_light = (LIGHT - position).normalize_or_zero();
    let reflected = 2.0 * normal.dot(to_light) * normal - to_light;
    let cosine = reflected.dot((viewer - position).normalize_or_zero());
    byte(cosine.max(0.0).powi(4) * 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::Wave;

    const VERTEX: [u8; 4] = [10, 20, 30, 40];

    fn context() -> ColorContext {
        ColorContext {
            identity_light: 0.5,
            entity: [200, 100, 50, 25],
            ..ColorContext::default()
        }
    }

    fn rgb(gen_: &RgbGen) -> [u8; 3] {
        rgb_gen(gen_, &context(), Vec3::Z, VERTEX)
    }

    fn alpha(gen_: &AlphaGen) -> u8 {
        alpha_gen(gen_, &context(), Vec3::ZERO, Vec3::Z, VERTEX)
    }

    fn constant_wave(function: WaveFunction, base: f32) -> Wave {
        Wave {
            function,
            base,
            amplitude: 0.0,
            phase: 0.0,
            frequency: 0.0,
        }
    }

    #[test]
    fn every_rgb_gen() {
        assert_eq!(rgb(&RgbGen::Identity), [255; 3]);
        assert_eq!(rgb(&RgbGen::IdentityLighting), [127; 3]);
        assert_eq!(
            rgb(&RgbGen::Const(Vec3::new(0.5, 2.0, -1.0))),
            [127, 255, 0]
        );
        assert_eq!(rgb(&RgbGen::Entity), [200, 100, 50]);
        assert_eq!(rgb(&RgbGen::OneMinusEntity), [55, 155, 205]);
        assert_eq!(rgb(&RgbGen::Vertex), [5, 10, 15]);
        assert_eq!(rgb(&RgbGen::ExactVertex), [10, 20, 30]);
        assert_eq!(rgb(&RgbGen::OneMinusVertex), [122, 117, 112]);
        let wave = |f, base| rgb(&RgbGen::Wave(constant_wave(f, base)));
        assert_eq!(wave(WaveFunction::Sin, 0.5), [63; 3]);
        assert_eq!(wave(WaveFunction::Sin, 4.0), [255; 3]);
        assert_eq!(wave(WaveFunction::Sin, -1.0), [0; 3]);
        assert_eq!(wave(WaveFunction::Noise, 0.5), [127; 3]);
    }

    #[test]
    fn lighting_diffuse_adds_and_caps() {
        let light = DiffuseLight {
            ambient: Vec3::new(10.0, 20.0, 30.0),
            directed: Vec3::new(100.0, 200.0, 400.0),
            direction: Vec3::new(0.0, 0.8, 0.6),
        };
        assert_eq!(diffuse(&light, Vec3::Z), [70, 140, 255]);
        assert_eq!(diffuse(&light, Vec3::NEG_Z), [10, 20, 30]);
    }

    #[test]
    fn every_alpha_gen() {
        assert_eq!(alpha(&AlphaGen::Identity), 255);
        assert_eq!(alpha(&AlphaGen::Const(0.25)), 63);
        assert_eq!(
            alpha(&AlphaGen::Wave(constant_wave(WaveFunction::Sin, 0.5))),
            127
        );
        assert_eq!(alpha(&AlphaGen::Entity), 25);
        assert_eq!(alpha(&AlphaGen::OneMinusEntity), 230);
        assert_eq!(alpha(&AlphaGen::Vertex), 40);
        assert_eq!(alpha(&AlphaGen::OneMinusVertex), 215);
        let at = |x: f32| {
            alpha_gen(
                &AlphaGen::Portal { range: 256.0 },
                &context(),
                Vec3::new(x, 0.0, 0.0),
                Vec3::Z,
                VERTEX,
            )
        };
        assert_eq!((at(0.0), at(128.0), at(300.0)), (0, 127, 255));
    }

    #[test]
    fn alpha_without_alpha_gen() {
        let alpha = |rgb_gen, context: &ColorContext| {
            let stage = Stage {
                rgb_gen,
                ..Stage::default()
            };
            vertex_color(&stage, context, Vec3::ZERO, Vec3::Z, VERTEX)[3]
        };
        let bright = ColorContext {
            identity_light: 1.0,
            ..context()
        };
        for rgb_gen in [RgbGen::Entity, RgbGen::OneMinusEntity, RgbGen::ExactVertex] {
            assert_eq!(alpha(rgb_gen, &bright), 255);
        }
        assert_eq!(alpha(RgbGen::Vertex, &bright), 40);
        assert_eq!(alpha(RgbGen::Vertex, &context()), 255);
        assert_eq!(alpha(RgbGen::LightingDiffuse, &bright), 0);
        let lit = ColorContext {
            light: Some(DiffuseLight::default()),
            ..bright
        };
        assert_eq!(alpha(RgbGen::LightingDiffuse, &lit), 255);
    }

    #[test]
    fn specular_is_full_in_the_mirror_direction() {
        let to_light = Vec3::new(-960.0, 1980.0, 96.0).normalize();
        let mirrored = Vec3::new(-to_light.x, -to_light.y, to_light.z);
        assert!(specular_alpha(Vec3::ZERO, Vec3::Z, mirrored * 50.0) >= 254);
        assert_eq!(specular_alpha(Vec3::ZERO, Vec3::Z, -mirrored), 0);
        // 45 degrees off: cos^4 = 1/4.
        let side = mirrored.any_orthonormal_vector();
        let alpha = specular_alpha(Vec3::ZERO, Vec3::Z, (mirrored + side) * 9.0);
        assert!((62..=64).contains(&alpha), "{alpha}");
    }
}
