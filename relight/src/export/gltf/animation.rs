//! Moving textures and films as animations of `KHR_texture_transform` (`KHR_animation_pointer`).
//!
//! A wobble moves each vertex in its own time, which no texture transform can; the whole texture sways as that of one
//! vertex does.

use super::buffer::{Buffers, Kind};
use super::materials::turn_and_size;
use crate::export::film::Film;
use crate::export::look::affine;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};
use shaderscript::TcMod;
use shaderscript::eval::apply_tc_mods;
use std::f32::consts::TAU;

/// Keys per turn or wave.
const KEYS: f64 = 32.0;
/// Longest animation, seconds: what does not repeat by then jumps.
const LONGEST: f64 = 120.0;
/// The vertex whose wobble the whole texture has: its two directions are a quarter of a wave apart.
const SWAYING: Vec3 = Vec3::new(0.0, 256.0, 0.0);

/// An animated value, in the form of a glTF animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Times of the keys, seconds.
    pub times: Vec<f32>,
    /// Whether values stay until the next key.
    pub step: bool,
    /// Where each value is in the document, what kind it is, and it at each key.
    pub parts: Vec<(String, Kind, Vec<f32>)>,
}

impl Track {
    /// The animation.
    pub fn animation(&self, buffers: &mut Buffers, name: &str) -> Value {
        let input = buffers.add_floats(Kind::Float, self.times.iter().map(|&t| [t]));
        let last = self.times.last().copied().unwrap_or(0.0);
        buffers.bound(input, &[0.0], &[last]);
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for (pointer, kind, values) in &self.parts {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let output = buffers.add(*kind, &bytes, self.times.len());
            let mut sampler = json!({"input": input, "output": output});
            if let (true, Value::Object(map)) = (self.step, &mut sampler) {
                map.insert("interpolation".into(), json!("STEP"));
            }
            channels.push(json!({
                "sampler": samplers.len(),
                "target": {
                    "path": "pointer",
                    "extensions": {"KHR_animation_pointer": {"pointer": pointer}},
                },
            }));
            samplers.push(sampler);
        }
        json!({"name": name, "samplers": samplers, "channels": channels})
    }
}

/// Times of keys for what repeats after each of `periods`: from 0 to the time after which everything repeats, or
/// nearly. `straight`: whether it moves evenly in between.
pub fn key_times(periods: &[f64], straight: bool) -> Vec<f32> {
    let longest = periods.iter().copied().fold(0.0, f64::max).min(LONGEST);
    let shortest = periods.iter().copied().fold(LONGEST, f64::min);
    let repeats = |n: &f64| {
        let length = n * longest;
        periods.iter().all(|p| {
            let turns = length / p;
            (turns - turns.round()).abs() < 0.01
        })
    };
    let most = (LONGEST / longest).floor().max(1.0) as u32;
    let times = (1..=most).map(f64::from).find(repeats).unwrap_or(1.0);
    let length = longest * times;
    let keys = if straight {
        1
    } else {
        ((length / shortest) * KEYS).ceil().clamp(1.0, 4096.0) as u32
    };
    (0..=keys)
        .map(|key| (length * f64::from(key) / f64::from(keys)) as f32)
        .collect()
}

/// A texture that moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    tc_mods: Vec<TcMod>,
    /// Where its transform is in the document.
    place: String,
}

impl Motion {
    /// The motion of a texture at `place`; `None` when it rests, or moves as no transform can.
    pub fn of(tc_mods: &[TcMod], place: String) -> Option<Motion> {
        let motion = Motion {
            tc_mods: tc_mods.to_vec(),
            place,
        };
        let rests = motion.periods().is_empty();
        let can = (0..16).all(|i| turn_and_size(motion.at(f64::from(i) * 0.37).0).is_some());
        (!rests && can).then_some(motion)
    }

    /// Seconds after which each part of the motion repeats.
    fn periods(&self) -> Vec<f64> {
        let mut periods = Vec::new();
        let mut push = |frequency: f32| {
            if frequency != 0.0 && frequency.is_finite() {
                periods.push(f64::from(frequency.abs()).recip());
            }
        };
        for tc_mod in &self.tc_mods {
            match tc_mod {
                TcMod::Scroll(speed) => {
                    push(speed.x);
                    push(speed.y);
                }
                TcMod::Rotate(degrees) => push(degrees / 360.0),
                TcMod::Stretch(wave) => push(wave.frequency),
                TcMod::Turbulent { frequency, .. } => push(*frequency),
                _ => {}
            }
        }
        periods
    }

    /// Matrix and offset at a time; unlike the engine's, scrolling does not start anew with each repetition.
    fn at(&self, time: f64) -> ([Vec2; 2], Vec2) {
        let mut matrix = [Vec2::X, Vec2::Y];
        let mut offset = Vec2::ZERO;
        for tc_mod in &self.tc_mods {
            if let TcMod::Scroll(speed) = tc_mod {
                offset += *speed * time as f32;
                continue;
            }
            if let TcMod::Turbulent { .. } = tc_mod {
                offset += apply_tc_mods(
                    std::slice::from_ref(tc_mod),
                    Vec2::ZERO,
                    SWAYING,
                    time,
                    Vec2::ZERO,
                );
                continue;
            }
            let ([s, t], moved) = affine(std::slice::from_ref(tc_mod), time);
            let apply = |v: Vec2| s * v.x + t * v.y;
            matrix = matrix.map(apply);
            offset = apply(offset) + moved;
        }
        (matrix, offset)
    }

    fn times(&self) -> Vec<f32> {
        let bent = |m: &TcMod| {
            matches!(
                m,
                TcMod::Rotate(_) | TcMod::Stretch(_) | TcMod::Turbulent { .. }
            )
        };
        key_times(&self.periods(), !self.tc_mods.iter().any(bent))
    }

    /// The motion as a glTF animation.
    pub fn track(&self) -> Track {
        let times = self.times();
        let mut values = Vec::with_capacity(times.len());
        let mut before = 0.0f32;
        for &time in &times {
            let (matrix, offset) = self.at(f64::from(time));
            let (angle, size) = turn_and_size(matrix).unwrap_or((before, Vec2::ONE));
            // turns go on where half a turn would jump back
            let angle = angle + ((before - angle) / TAU).round() * TAU;
            before = angle;
            values.push((offset, angle, size));
        }
        let part =
            |name: &str, kind, values: Vec<f32>| (format!("{}/{name}", self.place), kind, values);
        let pairs =
            |values: &mut dyn Iterator<Item = Vec2>| values.flat_map(|v| v.to_array()).collect();
        let offsets = pairs(&mut values.iter().map(|v| v.0));
        let mut parts = vec![part("offset", Kind::Pair, offsets)];
        // Nothing changes in an empty list.
        let first = values.first().copied().unwrap_or_default();
        if values.iter().any(|v| (v.1 - first.1).abs() > 1.0e-4) {
            parts.push(part(
                "rotation",
                Kind::Float,
                values.iter().map(|v| v.1).collect(),
            ));
        }
        // The engine's table of sines is a little off the circle.
        if values
            .iter()
            .any(|v| (v.2 - first.2).abs().max_element() > 0.02)
        {
            parts.push(part(
                "scale",
                Kind::Pair,
                pairs(&mut values.iter().map(|v| v.2)),
            ));
        }
        Track {
            times,
            step: false,
            parts,
        }
    }
}

/// The film of a texture whose transform is at `place`; `side`: texels of all its images together.
pub fn film_track(film: &Film, side: u32, place: &str) -> Track {
    let count = film.images.len();
    let times = (0..=count).map(|k| k as f32 / film.frequency());
    let offsets = (0..=count).flat_map(|k| film.transform(k % count, side).1.to_array());
    Track {
        times: times.collect(),
        step: true,
        parts: vec![(format!("{place}/offset"), Kind::Pair, offsets.collect())],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scrolling_goes_on_until_both_directions_repeat() {
        let mods = [TcMod::Scroll(Vec2::new(0.5, -0.2))];
        let motion = Motion::of(&mods, "/x".into()).unwrap();
        assert_eq!(motion.times(), [0.0, 10.0]);
        assert!((motion.at(10.0).1 - Vec2::new(5.0, -2.0)).length() < 1.0e-5);
    }

    #[test]
    fn a_turn_is_a_rotation_about_the_middle() {
        let motion = Motion::of(&[TcMod::Rotate(90.0)], "/x".into()).unwrap();
        assert_eq!(motion.times().len(), 33);
        let mut buffers = Buffers::default();
        let animation = motion.track().animation(&mut buffers, "a");
        assert_eq!(animation["channels"].as_array().unwrap().len(), 2);
        let (matrix, offset) = motion.at(0.7);
        let (angle, size) = turn_and_size(matrix).unwrap();
        let (sin, cos) = angle.sin_cos();
        let turned = |v: Vec2| {
            let v = v * size;
            Vec2::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x) + offset
        };
        let middle = Vec2::splat(0.5);
        assert!((turned(middle) - middle).length() < 1.0e-3);
        let st = Vec2::new(0.2, 0.9);
        let engine = apply_tc_mods(&[TcMod::Rotate(90.0)], st, Vec3::ZERO, 0.7, Vec2::ZERO);
        assert!((turned(st) - engine).length() < 1.0e-3);
    }

    #[test]
    fn what_rests_has_no_motion() {
        assert_eq!(
            Motion::of(&[TcMod::Scale(Vec2::splat(2.0))], "/x".into()),
            None
        );
        assert_eq!(Motion::of(&[TcMod::Scroll(Vec2::ZERO)], "/x".into()), None);
    }
}
