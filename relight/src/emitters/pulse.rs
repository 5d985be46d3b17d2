//! Strength of light styles over time.

use shaderscript::eval;
use shaderscript::{RgbGen, Stage, Wave};

/// Number and spacing, seconds, of the times of a wave's mean.
const TIMES: u32 = 256;
const TIME_STEP: f64 = 0.137;

/// Factor on the light of a style.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StyleStrength {
    /// The same at all times.
    Steady(f32),
    /// A wave of time.
    Wave(Wave),
}

impl StyleStrength {
    pub(crate) fn of(stage: &Stage) -> StyleStrength {
        match stage.rgb_gen {
            RgbGen::Wave(wave) if wave.amplitude == 0.0 => {
                StyleStrength::Steady(wave.base.clamp(0.0, 1.0))
            }
            RgbGen::Wave(wave) => StyleStrength::Wave(wave),
            RgbGen::Const(color) => {
                StyleStrength::Steady((color.element_sum() / 3.0).clamp(0.0, 1.0))
            }
            _ => StyleStrength::Steady(1.0),
        }
    }

    /// The factor at a shader time in seconds, 0..1.
    pub fn at(self, time: f64) -> f32 {
        let factor = match self {
            StyleStrength::Steady(factor) => factor,
            StyleStrength::Wave(wave) => eval::wave(&wave, time),
        };
        if factor.is_finite() {
            factor.clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}

/// Change of a light's strength over time, relative to its mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    strength: StyleStrength,
    mean: f32,
}

impl Pulse {
    /// Mean strength of a style over time, and its change relative to it; `None` if it is constant.
    pub fn of(strength: StyleStrength) -> (f32, Option<Pulse>) {
        if let StyleStrength::Steady(_) = strength {
            return (strength.at(0.0), None);
        }
        let sum: f32 = (0..TIMES)
            .map(|i| strength.at(f64::from(i) * TIME_STEP))
            .sum();
        let mean = sum / TIMES as f32;
        (mean, (mean > 0.0).then_some(Pulse { strength, mean }))
    }

    /// Strength at a shader time in seconds, relative to the mean. At least 0.
    pub fn scale(&self, time: f64) -> f32 {
        self.strength.at(time) / self.mean
    }

    /// The strength of the style.
    pub fn strength(&self) -> StyleStrength {
        self.strength
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shaderscript::WaveFunction;

    #[test]
    fn strength_is_relative_to_its_mean() {
        let wave = Wave {
            function: WaveFunction::Square,
            base: 0.25,
            amplitude: 0.5,
            phase: 0.0,
            frequency: 1.0,
        };
        // 0.75 and -0.25, which the engine clamps to 0, half of the time each
        let (mean, pulse) = Pulse::of(StyleStrength::Wave(wave));
        let pulse = pulse.expect("pulses");
        assert!((mean - 0.375).abs() < 0.02, "{mean}");
        assert!((pulse.scale(0.25) * mean - 0.75).abs() < 1e-6);
        assert_eq!(pulse.scale(0.75), 0.0);
        assert_eq!(Pulse::of(StyleStrength::Steady(0.7)), (0.7, None));
    }
}
