//! Colours of materials that change in time (`rgbGen wave`, `alphaGen wave`), as animations of their factors
//! (`KHR_animation_pointer`).

use super::animation::{Track, key_times};
use super::buffer::Kind;
use crate::export::look::Look;
use crate::export::stack::Moment;
use glam::{Vec3, Vec4};
use shaderscript::{AlphaGen, RgbGen, Shader, Wave, WaveFunction};

/// Periods of noise after which it jumps back.
const NOISE: f64 = 16.0;
/// What changes less does not.
const LEAST: f32 = 2.0e-3;

/// A material's factors in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Pulse {
    times: Vec<f32>,
    factors: Vec<Vec4>,
    glows: Vec<Vec3>,
}

/// The waves of a material's stages.
fn waves(shader: &Shader) -> impl Iterator<Item = &Wave> {
    shader.stages.iter().flat_map(|stage| {
        let rgb = match &stage.rgb_gen {
            RgbGen::Wave(wave) => Some(wave),
            _ => None,
        };
        let alpha = match &stage.alpha_gen {
            AlphaGen::Wave(wave) => Some(wave),
            _ => None,
        };
        rgb.into_iter().chain(alpha)
    })
}

impl Pulse {
    /// How a material's factors change; `None` where they do not. `look` is the material at a moment.
    pub fn of(shader: &Shader, look: &mut dyn FnMut(Moment) -> Look) -> Option<Pulse> {
        let mut periods = Vec::new();
        for wave in waves(shader).filter(|w| w.frequency != 0.0 && w.frequency.is_finite()) {
            let period = f64::from(wave.frequency.abs()).recip();
            periods.push(period);
            if wave.function == WaveFunction::Noise {
                periods.push(period * NOISE);
            }
        }
        if periods.is_empty() {
            return None;
        }
        let times = key_times(&periods, false);
        let looks = times.iter().map(|&t| look(Moment::At(f64::from(t))));
        let (factors, glows) = looks
            .map(|l| {
                let factor = l.factor.clamp(Vec4::ZERO, Vec4::ONE);
                (factor, l.glow_factor.max(Vec3::ZERO))
            })
            .unzip();
        let pulse = Pulse {
            times,
            factors,
            glows,
        };
        (pulse.factor_varies() || pulse.glow_varies()).then_some(pulse)
    }

    /// Whether the colour changes.
    pub fn factor_varies(&self) -> bool {
        // Nothing changes in an empty list.
        let first = self.factors.first().copied().unwrap_or_default();
        let off = |v: &Vec4| (*v - first).abs().max_element() > LEAST;
        self.factors.iter().any(off) && self.factors.iter().all(|v| v.is_finite())
    }

    /// Whether the glow changes.
    fn glow_varies(&self) -> bool {
        // Nothing changes in an empty list.
        let first = self.glows.first().copied().unwrap_or_default();
        let off = |v: &Vec3| (*v - first).abs().max_element() > LEAST;
        self.glows.iter().any(off) && self.glows.iter().all(|v| v.is_finite())
    }

    /// The strongest channel that the glow ever has.
    pub fn brightest(&self) -> f32 {
        match self.glow_varies() {
            true => self
                .glows
                .iter()
                .map(|v| v.max_element())
                .fold(0.0, f32::max),
            false => 0.0,
        }
    }

    /// The factors as a glTF animation; `place`: the material's in the document, `strength`: what its glow is
    /// multiplied with besides, `None` where it has none.
    pub fn track(&self, place: &str, strength: Option<f32>) -> Track {
        let mut parts = Vec::new();
        if self.factor_varies() {
            let values = self.factors.iter().flat_map(|v| v.to_array()).collect();
            let pointer = format!("{place}/pbrMetallicRoughness/baseColorFactor");
            parts.push((pointer, Kind::Quad, values));
        }
        if let Some(strength) = strength.filter(|_| self.glow_varies()) {
            let glows = self.glows.iter().map(|v| (*v / strength).min(Vec3::ONE));
            let values = glows.flat_map(|v| v.to_array()).collect();
            parts.push((format!("{place}/emissiveFactor"), Kind::Triple, values));
        }
        Track {
            times: self.times.clone(),
            step: false,
            parts,
        }
    }
}
