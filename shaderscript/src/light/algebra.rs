//! The stages of a material as a linear function of light.
//!
//! The engine's stages multiply and add colours that already contain light: a lightmap, vertex light, the light
//! grid. To light a surface anew, the stack has to be told apart into `lit * L + emission + through * B`, where L is
//! the incident light (what the lightmap would have shown), and B the background. Each stage is a polynomial in L
//! and B, and blending multiplies polynomials; two rules keep the result linear:
//!
//! * L^2 counts as L: a surface that was multiplied by its light twice is still lit once.
//! * L B counts as B: the background brings its own light, and so do mirrored surroundings.
//!
//! All colours are linear; nothing is clamped. Alphas and blend factors made of them are plain numbers. The engine blends
//! colours that are encoded for the display, though. Where that comes to something else than the same sum in linear light
//! would, linear light is brought to what the engine shows, as `trace/layer.glsl` does:
//!
//! * twice the product (`GL_DST_COLOR GL_SRC_COLOR`): half grey, encoded, leaves what is below as it is;
//! * a paint over an opaque body (`blend`): it has the colour that the mixed display values have where all is lit in full.

use crate::{
    shader::Shader,
    stage::{BlendFactor, RgbGen, Stage, StageImage},
};
use glam::{Vec3, Vec4};

/// What a stage shows at a point: texture and generated colour, before blending. Both linear, alpha in 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageSample {
    /// Texel of the stage's image; ignored for the lightmap, which shows L.
    pub texture: Vec4,
    /// `rgbGen` and `alphaGen`. The colour is ignored where it stands for incident light: `lightingDiffuse`, and
    /// `vertex` or `exactVertex` on surfaces with vertex light.
    pub color: Vec4,
    /// How much of its surroundings the stage mirrors; zero for all but reflections
    /// ([`is_reflection`](super::is_reflection)).
    pub mirrored: Vec3,
}

impl StageSample {
    /// White, opaque.
    pub const WHITE: StageSample = StageSample {
        texture: Vec4::ONE,
        color: Vec4::ONE,
        mirrored: Vec3::ZERO,
    };
}

/// A colour that depends linearly on light: `lit * L + emission + through * B + reflected * R`, channel by channel.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct LightLinear {
    /// Coefficient of the incident light L: the diffuse albedo when L is irradiance over pi.
    pub lit: Vec3,
    /// What is seen without any light.
    pub emission: Vec3,
    /// Coefficient of the background B; zero for opaque surfaces.
    pub through: Vec3,
    /// Coefficient of the mirrored surroundings R, which bring their own light.
    pub reflected: Vec3,
}

impl LightLinear {
    /// The background alone.
    pub const BACKGROUND: LightLinear = LightLinear {
        lit: Vec3::ZERO,
        emission: Vec3::ZERO,
        through: Vec3::ONE,
        reflected: Vec3::ZERO,
    };

    /// Value for given light and background, where nothing is mirrored.
    pub fn evaluate(&self, light: Vec3, background: Vec3) -> Vec3 {
        self.lit * light + self.emission + self.through * background
    }

    fn scale(self, factor: f32) -> LightLinear {
        LightLinear {
            lit: self.lit * factor,
            emission: self.emission * factor,
            through: self.through * factor,
            reflected: self.reflected * factor,
        }
    }

    fn plus(self, other: LightLinear) -> LightLinear {
        LightLinear {
            lit: self.lit + other.lit,
            emission: self.emission + other.emission,
            through: self.through + other.through,
            reflected: self.reflected + other.reflected,
        }
    }

    fn minus(self, other: LightLinear) -> LightLinear {
        self.plus(other.scale(-1.0))
    }

    /// Product of a stage (which has no background of its own) and what is drawn already.
    fn filter(self, drawn: LightLinear) -> LightLinear {
        LightLinear {
            lit: self.lit * drawn.lit + self.lit * drawn.emission + self.emission * drawn.lit,
            emission: self.emission * drawn.emission,
            through: (self.lit + self.emission) * drawn.through,
            reflected: (self.lit + self.emission) * drawn.reflected
                + self.reflected * (drawn.lit + drawn.emission),
        }
    }
}

/// Evaluates a stack of stages.
///
/// `samples` holds what each stage shows, in the same order; missing ones count as [`StageSample::WHITE`].
/// `vertex_light` tells that the surface's vertex colours are light, as on world surfaces without a lightmap.
/// A stage whose sample fails its alpha test draws nothing.
///
/// The background starts with coefficient 1 when the first stage blends, else with 0. Destination alpha counts as
/// 1: the engine asks for a frame buffer without alpha, where OpenGL defines it so.
pub fn compose(stages: &[Stage], samples: &[StageSample], vertex_light: bool) -> LightLinear {
    compose_in(stages, samples, vertex_light, Numbers::Linear)
}

/// [`compose`] of samples that are encoded for the display, by the engine's own sums: with L the stored light, encoded as
/// well, `evaluate` gives what the engine shows, encoded.
pub fn compose_encoded(
    stages: &[Stage],
    samples: &[StageSample],
    vertex_light: bool,
) -> LightLinear {
    compose_in(stages, samples, vertex_light, Numbers::Encoded)
}

/// What colours are numbers of.
#[derive(Clone, Copy, PartialEq)]
enum Numbers {
    Linear,
    Encoded,
}

/// Linear value of half the display's range (IEC 61966-2-1).
const HALF: f32 = 0.214_041_14;

/// Linear value of an encoded one.
fn decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Encoded value of a linear one.
fn encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// A paint over an opaque body: both mixed in linear light, with the colour of the mixed display values.
fn paint(body: LightLinear, paint: LightLinear, alpha: f32) -> LightLinear {
    let mut mixed = paint.scale(alpha).plus(body.scale(1.0 - alpha));
    let full = |l: LightLinear| (l.lit + l.emission).max(Vec3::ZERO);
    let (below, above) = (full(body), full(paint));
    let sum = below.lerp(above, alpha);
    let chosen = below.map(encode).lerp(above.map(encode), alpha).map(decode);
    let tint = |sum: f32, chosen: f32| if sum > 1e-6 { chosen / sum } else { 1.0 };
    let tint = Vec3::new(
        tint(sum.x, chosen.x),
        tint(sum.y, chosen.y),
        tint(sum.z, chosen.z),
    );
    mixed.lit *= tint;
    mixed.emission *= tint;
    mixed
}

fn compose_in(
    stages: &[Stage],
    samples: &[StageSample],
    vertex_light: bool,
    numbers: Numbers,
) -> LightLinear {
    let mut drawn = LightLinear::default();
    if stages.first().is_none_or(|first| first.blend.is_some()) {
        drawn = LightLinear::BACKGROUND;
    }
    for (i, stage) in stages.iter().enumerate() {
        let sample = samples.get(i).copied().unwrap_or(StageSample::WHITE);
        let (source, alpha) = source_of(stage, sample, vertex_light);
        if stage.alpha_func.is_some_and(|func| !func.passes(alpha)) {
            continue;
        }
        let part = alpha > 0.0 && alpha < 1.0;
        drawn = match stage.blend {
            None => source,
            Some((BlendFactor::DstColor, BlendFactor::SrcColor)) if numbers == Numbers::Linear => {
                source.filter(drawn).scale(HALF.recip())
            }
            Some((BlendFactor::SrcAlpha, BlendFactor::OneMinusSrcAlpha))
                if numbers == Numbers::Linear && part && drawn.through == Vec3::ZERO =>
            {
                paint(drawn, source, alpha)
            }
            Some((source_factor, destination_factor)) => {
                let product = source.filter(drawn);
                let from_source = match source_factor {
                    BlendFactor::DstColor => product,
                    BlendFactor::OneMinusDstColor => source.minus(product),
                    other => source.scale(scalar(other, alpha)),
                };
                let from_drawn = match destination_factor {
                    BlendFactor::SrcColor => product,
                    BlendFactor::OneMinusSrcColor => drawn.minus(product),
                    other => drawn.scale(scalar(other, alpha)),
                };
                from_source.plus(from_drawn)
            }
        };
    }
    drawn
}

/// What a stage draws, before blending, and its alpha.
fn source_of(stage: &Stage, sample: StageSample, vertex_light: bool) -> (LightLinear, f32) {
    let texture = sample.texture.truncate();
    let color = sample.color.truncate();
    let is_light = match stage.rgb_gen {
        RgbGen::LightingDiffuse => true,
        RgbGen::Vertex | RgbGen::ExactVertex => vertex_light,
        _ => false,
    };
    let mut source = LightLinear {
        reflected: sample.mirrored,
        ..LightLinear::default()
    };
    let mut alpha = sample.color.w;
    if stage.image == StageImage::Lightmap {
        // Lightmaps have no alpha.
        source.lit = if is_light { Vec3::ONE } else { color };
    } else {
        alpha *= sample.texture.w;
        if is_light {
            source.lit = texture;
        } else {
            source.emission = texture * color;
        }
    }
    (source, alpha)
}

/// Value of a blend factor that is a plain number. Factors made of colours never come here.
fn scalar(factor: BlendFactor, alpha: f32) -> f32 {
    match factor {
        BlendFactor::Zero | BlendFactor::OneMinusDstAlpha | BlendFactor::SrcAlphaSaturate => 0.0,
        BlendFactor::One | BlendFactor::DstAlpha => 1.0,
        BlendFactor::SrcAlpha => alpha,
        BlendFactor::OneMinusSrcAlpha => 1.0 - alpha,
        // A colour factor on the side where OpenGL has none; no script can bring it about.
        BlendFactor::SrcColor
        | BlendFactor::OneMinusSrcColor
        | BlendFactor::DstColor
        | BlendFactor::OneMinusDstColor => 1.0,
    }
}

/// White samples for every stage of a material, with its constant colours put in and every wave at its brightest.
pub fn stage_samples_white(stages: &[Stage]) -> Vec<StageSample> {
    use crate::stage::{AlphaGen, Wave};
    // Most that a wave reaches; all shapes stay within -1..1.
    let peak = |w: &Wave| (w.base + w.amplitude.abs()).clamp(0.0, 1.0);
    stages
        .iter()
        .map(|stage| {
            let color = match &stage.rgb_gen {
                RgbGen::Const(color) => *color,
                RgbGen::Wave(w) => Vec3::splat(peak(w)),
                _ => Vec3::ONE,
            };
            let alpha = match &stage.alpha_gen {
                AlphaGen::Const(alpha) => *alpha,
                AlphaGen::Wave(w) => peak(w),
                _ => 1.0,
            };
            StageSample {
                color: color.extend(alpha),
                ..StageSample::WHITE
            }
        })
        .collect()
}

/// Whether some of what a material draws does not depend on incident light, whatever its images show.
pub fn is_glowing(shader: &Shader) -> bool {
    !glow_stages(shader, true).is_empty()
}

/// The stages whose own image reaches the emission: without them the surface would glow less.
///
/// Found by evaluating the stack with half-transparent grey images, once with each stage's image black.
pub fn glow_stages(shader: &Shader, vertex_light: bool) -> Vec<usize> {
    // Grey and half alpha, so that no factor hides a stage by being exactly 0 or 1.
    let grey = |mut sample: StageSample| {
        sample.texture = Vec4::new(0.5, 0.5, 0.5, 0.5);
        sample
    };
    // The alpha test is left out: it depends on the images.
    let stages: Vec<Stage> = shader
        .stages
        .iter()
        .map(|stage| Stage {
            alpha_func: None,
            ..stage.clone()
        })
        .collect();
    let samples: Vec<StageSample> = stage_samples_white(&stages).into_iter().map(grey).collect();
    let full = compose(&stages, &samples, vertex_light).emission;
    (0..stages.len())
        .filter(|&i| {
            let mut without = samples.clone();
            if let Some(sample) = without.get_mut(i) {
                sample.texture = Vec4::new(0.0, 0.0, 0.0, 0.5);
            }
            let emission = compose(&stages, &without, vertex_light).emission;
            (full - emission).max_element() > 1e-6
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImplicitKind, parse_script};

    const RED: Vec3 = Vec3::new(0.8, 0.2, 0.1);
    const BLUE: Vec3 = Vec3::new(0.1, 0.3, 0.6);

    fn shader(stages: &str) -> Shader {
        let script = parse_script("test", format!("t\n{{\n{stages}\n}}\n").as_bytes());
        assert_eq!(script.diagnostics, []);
        script.shaders.into_iter().next().unwrap()
    }

    fn texel(color: Vec3, alpha: f32) -> StageSample {
        StageSample {
            texture: color.extend(alpha),
            ..StageSample::WHITE
        }
    }

    fn run(stages: &str, samples: &[StageSample]) -> LightLinear {
        compose(&shader(stages).stages, samples, false)
    }

    /// As the engine mixes them.
    fn mixed(below: Vec3, above: Vec3, alpha: f32) -> Vec3 {
        below.map(encode).lerp(above.map(encode), alpha).map(decode)
    }

    #[track_caller]
    fn near(found: LightLinear, lit: Vec3, emission: Vec3, through: Vec3) {
        assert!(
            found.lit.abs_diff_eq(lit, 1e-6)
                && found.emission.abs_diff_eq(emission, 1e-6)
                && found.through.abs_diff_eq(through, 1e-6),
            "{found:?} is not {lit} L + {emission} + {through} B"
        );
    }

    const LIGHTMAP: &str = "{\nmap $lightmap\nrgbGen identity\n}";

    #[test]
    fn lightmap_first() {
        let found = run(
            &format!("{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}"),
            &[StageSample::WHITE, texel(RED, 1.0)],
        );
        near(found, RED, Vec3::ZERO, Vec3::ZERO);
        let implicit = Shader::implicit("a", ImplicitKind::Lightmapped);
        let found = compose(
            &implicit.stages,
            &[StageSample::WHITE, texel(RED, 1.0)],
            false,
        );
        near(found, RED, Vec3::ZERO, Vec3::ZERO);
    }

    #[test]
    fn lightmap_last() {
        for blend in ["filter", "GL_ZERO GL_SRC_COLOR"] {
            let found = run(
                &format!("{{\nmap a\n}}\n{{\nmap $lightmap\nblendFunc {blend}\n}}"),
                &[texel(RED, 1.0), StageSample::WHITE],
            );
            near(found, RED, Vec3::ZERO, Vec3::ZERO);
        }
        // The doubling blend leaves what is below half grey as it is.
        let found = run(
            "{\nmap a\n}\n{\nmap $lightmap\nblendFunc GL_DST_COLOR GL_SRC_COLOR\n}",
            &[texel(RED, 1.0), StageSample::WHITE],
        );
        near(found, RED / HALF, Vec3::ZERO, Vec3::ZERO);
    }

    #[test]
    fn glow_after_the_lightmap_is_emission() {
        let found = run(
            &format!(
                "{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}\n{{\nmap glow\nblendFunc add\n}}"
            ),
            &[StageSample::WHITE, texel(RED, 1.0), texel(BLUE, 1.0)],
        );
        near(found, RED, BLUE, Vec3::ZERO);
    }

    #[test]
    fn glow_before_the_lightmap_is_lit() {
        let found = run(
            "{\nmap a\n}\n{\nmap glow\nblendFunc add\n}\n{\nmap $lightmap\nblendFunc filter\n}",
            &[texel(RED, 1.0), texel(BLUE, 1.0), StageSample::WHITE],
        );
        near(found, RED + BLUE, Vec3::ZERO, Vec3::ZERO);
    }

    #[test]
    fn decal_blends_over_the_lit_base() {
        let found = run(
            &format!(
                "{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}\n{{\nmap decal\nblendFunc blend\n}}"
            ),
            &[StageSample::WHITE, texel(RED, 1.0), texel(BLUE, 0.25)],
        );
        let tint = mixed(RED, BLUE, 0.25) / RED.lerp(BLUE, 0.25);
        near(found, 0.75 * RED * tint, 0.25 * BLUE * tint, Vec3::ZERO);
    }

    #[test]
    fn encoded_samples_add_up_as_the_engine_adds_them() {
        let stages = shader(&format!(
            "{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}\n{{\nmap detail\nblendFunc GL_DST_COLOR GL_SRC_COLOR\n}}\n{{\nmap b\nblendFunc blend\n}}"
        ))
        .stages;
        let samples = |decal: f32| {
            let grey = texel(Vec3::splat(0.5), 1.0);
            [
                StageSample::WHITE,
                texel(RED, 1.0),
                grey,
                texel(BLUE, decal),
            ]
        };
        let found = compose_encoded(&stages, &samples(0.0), false);
        near(found, RED, Vec3::ZERO, Vec3::ZERO);
        let found = compose_encoded(&stages, &samples(0.25), false);
        near(found, 0.75 * RED, 0.25 * BLUE, Vec3::ZERO);
        // In linear light the same stack shows the same where it is lit in full.
        let linear = samples(0.25).map(|s| StageSample {
            texture: s.texture.truncate().map(decode).extend(s.texture.w),
            ..s
        });
        let shown = compose(&stages, &linear, false).evaluate(Vec3::ONE, Vec3::ONE);
        let meant = found.evaluate(Vec3::ONE, Vec3::ONE).map(decode);
        assert!(shown.abs_diff_eq(meant, 1e-5), "{shown} {meant}");
    }

    #[test]
    fn what_is_mirrored_brings_its_own_light() {
        // gloss under paint with holes, and a lightmap over both
        let shine = StageSample {
            mirrored: BLUE,
            ..texel(BLUE, 1.0)
        };
        let found = run(
            "{\nmap e\ntcGen environment\n}\n{\nmap a\nblendFunc blend\n}\n{\nmap $lightmap\nblendFunc filter\n}",
            &[shine, texel(RED, 0.75), StageSample::WHITE],
        );
        near(found, mixed(BLUE, RED, 0.75), Vec3::ZERO, Vec3::ZERO);
        assert!(found.reflected.abs_diff_eq(0.25 * BLUE, 1e-6));
        // multiplied by a body that is lit
        let found = run(
            "{\nmap a\nrgbGen lightingDiffuse\n}\n{\nmap e\ntcGen environment\nblendFunc gl_dst_color gl_one\n}",
            &[texel(RED, 1.0), shine],
        );
        assert!(found.reflected.abs_diff_eq(RED * BLUE, 1e-6));
    }

    #[test]
    fn environment_base_lightmap() {
        let found = run(
            "{\nmap e\ntcGen environment\n}\n{\nmap a\nblendFunc blend\n}\n{\nmap $lightmap\nblendFunc filter\n}",
            &[texel(BLUE, 1.0), texel(RED, 0.75), StageSample::WHITE],
        );
        near(found, mixed(BLUE, RED, 0.75), Vec3::ZERO, Vec3::ZERO);
    }

    #[test]
    fn additive_sprite_glows_over_the_background() {
        let found = run("{\nmap flame\nblendFunc add\n}", &[texel(RED, 1.0)]);
        near(found, Vec3::ZERO, RED, Vec3::ONE);
        let found = run(
            "{\nmap flame\nblendFunc GL_SRC_ALPHA GL_ONE\n}",
            &[texel(RED, 0.5)],
        );
        near(found, Vec3::ZERO, 0.5 * RED, Vec3::ONE);
    }

    #[test]
    fn marks_only_darken() {
        for blend in ["filter", "GL_ZERO GL_SRC_COLOR"] {
            let found = run(
                &format!("{{\nmap mark\nblendFunc {blend}\n}}"),
                &[texel(RED, 1.0)],
            );
            near(found, Vec3::ZERO, Vec3::ZERO, RED);
        }
        let found = run(
            "{\nmap mark\nblendFunc GL_ZERO GL_ONE_MINUS_SRC_COLOR\n}",
            &[texel(RED, 1.0)],
        );
        near(found, Vec3::ZERO, Vec3::ZERO, Vec3::ONE - RED);
    }

    #[test]
    fn light_seen_twice_counts_once() {
        let found = run(
            &format!("{LIGHTMAP}\n{{\nmap $lightmap\nblendFunc filter\n}}"),
            &[],
        );
        near(found, Vec3::ONE, Vec3::ZERO, Vec3::ZERO);
        let glass = run("{\nmap $lightmap\nblendFunc filter\n}", &[]);
        near(glass, Vec3::ZERO, Vec3::ZERO, Vec3::ONE);
    }

    #[test]
    fn model_and_vertex_light() {
        let model = Shader::implicit("a", ImplicitKind::EntityLit);
        near(
            compose(&model.stages, &[texel(RED, 1.0)], false),
            RED,
            Vec3::ZERO,
            Vec3::ZERO,
        );
        let vertex = Shader::implicit("a", ImplicitKind::Vertex);
        let colored = StageSample {
            texture: RED.extend(1.0),
            color: BLUE.extend(1.0),
            ..StageSample::WHITE
        };
        near(
            compose(&vertex.stages, &[colored], true),
            RED,
            Vec3::ZERO,
            Vec3::ZERO,
        );
        near(
            compose(&vertex.stages, &[colored], false),
            Vec3::ZERO,
            RED * BLUE,
            Vec3::ZERO,
        );
    }

    #[test]
    fn every_factor() {
        let base = "{\nmap a\n}";
        let alpha = 0.25;
        for (source, destination, expected) in [
            ("GL_ONE", "GL_ZERO", BLUE),
            ("GL_ZERO", "GL_ONE", RED),
            ("GL_ONE_MINUS_DST_COLOR", "GL_ONE", RED + BLUE * (1.0 - RED)),
            (
                "GL_SRC_ALPHA",
                "GL_ONE_MINUS_SRC_ALPHA",
                mixed(RED, BLUE, 0.25),
            ),
            (
                "GL_ONE_MINUS_SRC_ALPHA",
                "GL_SRC_ALPHA",
                0.75 * BLUE + 0.25 * RED,
            ),
            ("GL_DST_ALPHA", "GL_ONE_MINUS_DST_ALPHA", BLUE),
            ("GL_ONE_MINUS_DST_ALPHA", "GL_DST_ALPHA", RED),
            ("GL_SRC_ALPHA_SATURATE", "GL_ONE", RED),
            (
                "GL_ONE",
                "GL_ONE_MINUS_SRC_COLOR",
                BLUE + RED * (1.0 - BLUE),
            ),
        ] {
            let found = run(
                &format!("{base}\n{{\nmap b\nblendFunc {source} {destination}\n}}"),
                &[texel(RED, 1.0), texel(BLUE, alpha)],
            );
            near(found, Vec3::ZERO, expected, Vec3::ZERO);
            assert_eq!(found.evaluate(Vec3::ONE, Vec3::ONE), found.emission);
        }
    }

    #[test]
    fn failed_alpha_tests_draw_nothing() {
        let found = run(
            "{\nmap a\n}\n{\nmap b\nalphaFunc GE128\nblendFunc add\n}",
            &[texel(RED, 1.0), texel(BLUE, 0.4)],
        );
        near(found, Vec3::ZERO, RED, Vec3::ZERO);
    }

    #[test]
    fn glow_is_what_reaches_the_emission() {
        let glow = |stages: &str| glow_stages(&shader(stages), true);
        let base = format!("{LIGHTMAP}\n{{\nmap a\nblendFunc filter\n}}");
        assert_eq!(glow(&base), [0; 0]);
        assert_eq!(
            glow(&format!("{base}\n{{\nmap glow\nblendFunc add\n}}")),
            [2]
        );
        assert_eq!(
            glow(
                "{\nmap a\n}\n{\nmap glow\nblendFunc add\n}\n{\nmap $lightmap\nblendFunc filter\n}"
            ),
            [0; 0]
        );
        assert_eq!(glow("{\nmap a\n}"), [0]);
        assert_eq!(glow("{\nmap a\nrgbGen vertex\n}"), [0; 0]);
        assert_eq!(
            glow("{\nmap a\nblendFunc add\nrgbGen const ( 0 0 0 )\n}"),
            [0; 0]
        );
    }
}
