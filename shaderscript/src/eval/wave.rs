//! Periodic functions of time.

use super::noise::noise4;
use crate::stage::{Wave, WaveFunction};
use std::sync::OnceLock;

/// Entries of a period: waves change in steps of 1 / 1024 of it.
pub const TABLE_SIZE: usize = 1024;

fn sine_table() -> &'static [f32; TABLE_SIZE] {
    static TABLE: OnceLock<[f32; TABLE_SIZE]> = OnceLock::new();
    TABLE.get_or_init(|| {
        // The engine divides the circle by 1023, so that the last entry repeats the first.
        std::array::from_fn(|i| {
            (i as f32 * 360.0 / (TABLE_SIZE - 1) as f32)
                .to_radians()
                .sin()
        })
    })
}

/// Table index of a phase in turns.
pub fn shape_index(turns: f64) -> usize {
    // Truncated towards zero and masked, as the engine does; a saturated or NaN phase still gives an entry.
    ((turns * TABLE_SIZE as f64) as i64 & (TABLE_SIZE as i64 - 1)) as usize
}

/// Sine from the engine's table, of a phase in turns.
pub fn sine(turns: f64) -> f32 {
    shape(WaveFunction::Sin, shape_index(turns))
}

/// Table entry of a shape; `index` counts modulo 1024. Noise has no table and gives 0.
pub fn shape(function: WaveFunction, index: usize) -> f32 {
    // Below the length of the table, so that the entry exists.
    let index = index % TABLE_SIZE;
    let ramp = index as f32 / TABLE_SIZE as f32;
    match function {
        WaveFunction::Sin => sine_table().get(index).copied().unwrap_or(0.0),
        WaveFunction::Square => {
            if index < TABLE_SIZE / 2 {
                1.0
            } else {
                -1.0
            }
        }
        WaveFunction::Triangle => {
            let quarter = TABLE_SIZE / 4;
            let half = index % (2 * quarter);
            let rise = half as f32 / quarter as f32;
            let value = if half < quarter { rise } else { 2.0 - rise };
            if index < 2 * quarter { value } else { -value }
        }
        WaveFunction::Sawtooth => ramp,
        WaveFunction::InverseSawtooth => 1.0 - ramp,
        WaveFunction::Noise => 0.0,
    }
}

/// Value of a wave at a shader time in seconds, not clamped.
///
/// `base + f(phase + time * frequency) * amplitude`; noise is sampled at `(time + phase) * frequency`. The engine
/// stops with an error where a noise wave is used for anything but `rgbGen`; here it is evaluated everywhere.
pub fn wave(wave: &Wave, time: f64) -> f32 {
    wave_with_offset(wave, time, 0.0)
}

/// As [`wave`] with something added to the phase, in turns.
pub(super) fn wave_with_offset(wave: &Wave, time: f64, offset: f32) -> f32 {
    let value = if wave.function == WaveFunction::Noise {
        let turns = (time + f64::from(wave.phase + offset)) * f64::from(wave.frequency);
        noise4(0.0, 0.0, 0.0, turns)
    } else {
        let turns = f64::from(wave.phase + offset) + time * f64::from(wave.frequency);
        shape(wave.function, shape_index(turns))
    };
    wave.base + value * wave.amplitude
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(function: WaveFunction, phase: f32, frequency: f32, time: f64) -> f32 {
        wave(
            &Wave {
                function,
                base: 10.0,
                amplitude: 2.0,
                phase,
                frequency,
            },
            time,
        )
    }

    #[test]
    fn sine_follows_the_table_of_1023_steps() {
        assert_eq!(at(WaveFunction::Sin, 0.0, 1.0, 0.0), 10.0);
        // Entry 256 is at 256 * 360 / 1023 degrees = 90.08798.
        let expected = 10.0 + 2.0 * 90.087_98_f32.to_radians().sin();
        assert!((at(WaveFunction::Sin, 0.25, 1.0, 0.0) - expected).abs() < 1e-5);
        // Entry 1023 is a full turn.
        assert!((at(WaveFunction::Sin, 1023.0 / 1024.0, 1.0, 0.0) - 10.0).abs() < 1e-5);
        // A second at one turn per second changes nothing; half a second is half a turn.
        assert_eq!(
            at(WaveFunction::Sin, 0.25, 1.0, 7.0),
            at(WaveFunction::Sin, 0.25, 1.0, 0.0)
        );
        assert_eq!(sine(0.5), shape(WaveFunction::Sin, 512));
        assert!(sine(0.75) < -0.999);
    }

    #[test]
    fn square_is_one_half_up_and_one_half_down() {
        assert_eq!(at(WaveFunction::Square, 0.0, 1.0, 0.0), 12.0);
        assert_eq!(at(WaveFunction::Square, 0.0, 1.0, 0.499), 12.0);
        assert_eq!(at(WaveFunction::Square, 0.0, 1.0, 0.5), 8.0);
        assert_eq!(at(WaveFunction::Square, 0.5, 0.25, 2.0), 12.0);
    }

    #[test]
    fn triangle_rises_falls_and_repeats_negated() {
        for (turns, value) in [
            (0.0, 0.0),
            (0.125, 0.5),
            (0.25, 1.0),
            (0.375, 0.5),
            (0.5, 0.0),
            (0.625, -0.5),
            (0.75, -1.0),
            (0.875, -0.5),
        ] {
            assert_eq!(
                at(WaveFunction::Triangle, turns, 0.0, 3.0),
                10.0 + 2.0 * value
            );
        }
    }

    #[test]
    fn sawtooth_rises_and_its_inverse_falls() {
        assert_eq!(at(WaveFunction::Sawtooth, 0.0, 1.0, 0.75), 11.5);
        assert_eq!(at(WaveFunction::InverseSawtooth, 0.0, 1.0, 0.75), 10.5);
        assert_eq!(at(WaveFunction::InverseSawtooth, 0.0, 1.0, 0.0), 12.0);
        // Never reaches its end: the table has no entry for 1.
        assert_eq!(at(WaveFunction::Sawtooth, 0.0, 1.0, 1.0), 10.0);
    }

    #[test]
    fn negative_time_truncates_towards_zero_and_then_wraps() {
        // -0.25 turns = -256, masked 768.
        assert_eq!(at(WaveFunction::Sawtooth, 0.0, 1.0, -0.25), 11.5);
        // -0.0005 turns truncates to entry 0, where a floor would give 1023.
        assert_eq!(at(WaveFunction::Sawtooth, 0.0, 1.0, -0.0005), 10.0);
    }

    #[test]
    fn noise_is_lattice_noise_along_time() {
        let value = at(WaveFunction::Noise, 0.5, 2.0, 1.25);
        assert_eq!(value, 10.0 + 2.0 * noise4(0.0, 0.0, 0.0, 3.5));
        assert!((8.0..=12.0).contains(&value));
    }

    #[test]
    fn extreme_arguments_give_some_value() {
        for time in [f64::NAN, f64::INFINITY, -1e300, 1e300] {
            for function in [
                WaveFunction::Sin,
                WaveFunction::Triangle,
                WaveFunction::Noise,
            ] {
                let _ = at(function, 0.0, 1e30, time);
            }
        }
    }
}
