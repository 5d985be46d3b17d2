//! Lights of styles, whose strength is a wave of time.

use crate::world::StyleStrength;

/// Times that the mean of a wave is taken over, and their distance in seconds.
const TIMES: u32 = 256;
const TIME_STEP: f64 = 0.137;

/// How a light's strength changes in time, about its mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    strength: StyleStrength,
    mean: f32,
}

impl Pulse {
    /// The mean strength of a style over time, and how it changes about that; `None` where it does not change.
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

    /// The strength at a shader time in seconds over the mean. At least 0.
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
    use shaderscript::{Wave, WaveFunction};

    #[test]
    fn strength_is_told_about_its_mean() {
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
