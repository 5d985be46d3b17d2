//! The stages of a material as a linear function of light.
//!
//! The engine's stages multiply and add colours that already contain light: a lightmap, vertex light, the light
//! grid. To light a surface anew, the stack is decomposed into `lit * L + emission + through * B`, where L is
//! the incident light (what the lightmap would have shown), and B the background. Each stage is a polynomial in L
//! and B, and blending multiplies polynomials; two rules keep the result linear:
//!
//! * L^2 counts as L: a surface that was multiplied by its light twice is still lit once.
//! * L B counts as B: the background brings its own light, and so do mirrored surroundings. (The camera sees the
//!   background darkened by stored light once more where the engine does so: [`darkens_behind`].)
//!
//! All colours are linear; nothing is clamped. Alphas and blend factors made of them are plain numbers. The engine blends
//! colours that are encoded for the display, though. Where that comes to something else than the same sum in linear light
//! would, linear light is brought to what the engine shows, as `trace/layer.glsl` does:
//!
//! * twice the product (`GL_DST_COLOR GL_SRC_COLOR`): half grey, encoded, leaves what is below as it is;
//! * a paint over an opaque body (`blend`): it has the colour that the mixed display values have where all is lit in full.

use crate::overbright::{from_linear, to_linear};
use glam::{Vec3, Vec4};
use shaderscript::{BlendFactor, RgbGen, Stage, StageImage};
use support::slice::part;

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
/// `vertex_light`: the surface's vertex colours are light, as on world surfaces without a lightmap.
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

/// Whether the engine multiplies what lies behind by the light at the surface, too: a lightmap over layers that are seen
/// through.
pub fn darkens_behind(stages: &[Stage], vertex_light: bool) -> bool {
    use BlendFactor::{DstColor, OneMinusDstColor, OneMinusSrcColor, SrcColor};
    let grey = StageSample {
        texture: Vec4::splat(0.5),
        ..StageSample::WHITE
    };
    let samples = vec![grey; stages.len()];
    stages.iter().enumerate().any(|(i, stage)| {
        let below = part(stages, ..i);
        let multiplies = stage.blend.is_some_and(|(source, destination)| {
            matches!(source, DstColor | OneMinusDstColor)
                || matches!(destination, SrcColor | OneMinusSrcColor)
        });
        multiplies
            && source_of(stage, grey, vertex_light).0.lit != Vec3::ZERO
            && compose(below, &samples, vertex_light).through != Vec3::ZERO
    })
}

/// What colours are numbers of.
#[derive(Clone, Copy, PartialEq)]
enum Numbers {
    Linear,
    Encoded,
}

/// Linear value of half the display's range (IEC 61966-2-1).
const HALF: f32 = 0.214_041_14;

/// A paint over an opaque body: both mixed in linear light, with the colour of the mixed display values.
fn paint(body: LightLinear, paint: LightLinear, alpha: f32) -> LightLinear {
    let mut mixed = paint.scale(alpha).plus(body.scale(1.0 - alpha));
    let full = |l: LightLinear| (l.lit + l.emission).max(Vec3::ZERO);
    let (below, above) = (full(body), full(paint));
    let sum = below.lerp(above, alpha);
    let chosen = below
        .map(from_linear)
        .lerp(above.map(from_linear), alpha)
        .map(to_linear);
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

#[cfg(test)]
mod tests;
