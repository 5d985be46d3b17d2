//! Light that paths of few bounces leave out.

use anyhow::Result;
use indicatif::ProgressBar;
use renderer_vk::Settings;
use serde_json::{Map, Value, json};

use super::stage::Stage;
use crate::view::Camera;

/// Bounces of the pictures that are compared.
const FEW: [u32; 4] = [0, 1, 2, 4];

/// Bounces of the reference.
const ALL: u32 = 8;

/// Excess over the reference, as a part of its mean luminance, above which a pixel counts as too bright.
const EXCESS: f32 = 0.05;

/// Frames of a place.
pub fn frames(reference: u32) -> u64 {
    (FEW.len() as u64 + 1) * u64::from(reference)
}

/// For each number of bounces the error of its mean of `frames` frames against that of [`ALL`] bounces. All use the same
/// random numbers, so the light that both have differs by the rounding of their sums alone.
///
/// # Errors
/// The device is lost or out of memory.
pub fn place(
    stage: &mut Stage,
    base: &Settings,
    camera: &Camera,
    frames: u32,
    bar: &ProgressBar,
) -> Result<Map<String, Value>> {
    let mut light = |bounces| {
        let settings = Settings {
            rt_bounces: bounces,
            ..base.clone()
        };
        let (_, light) = stage.reference(&settings, camera, &[], frames, bar)?;
        anyhow::Ok(light)
    };
    let all = light(ALL)?;
    let mut results = Map::new();
    for bounces in FEW {
        let figures = Missing::of(&light(bounces)?, &all);
        let figures = json!({
            "relative_rmse": figures.relative_rmse,
            "mean": figures.mean,
            "too_bright": figures.too_bright,
        });
        results.insert(bounces.to_string(), figures);
    }
    Ok(results)
}

/// What a picture lacks of its reference.
#[derive(Debug, PartialEq)]
struct Missing {
    /// Root of the mean squared difference of luminance over the mean luminance of the reference.
    relative_rmse: f64,
    /// Mean luminance over that of the reference.
    mean: f64,
    /// Part of the pixels that are brighter than the reference by more than [`EXCESS`]: with noise alone, none.
    too_bright: f64,
}

impl Missing {
    fn of(light: &[f32], all: &[f32]) -> Self {
        let count = all.len().max(1) as f64;
        let mean = |values: &[f32]| values.iter().copied().map(f64::from).sum::<f64>() / count;
        let whole = mean(all).max(f64::MIN_POSITIVE);
        let pairs = || light.iter().zip(all).map(|(few, all)| f64::from(few - all));
        let squares = pairs().map(|d| d * d).sum::<f64>() / count;
        let limit = f64::from(EXCESS) * whole;
        Self {
            relative_rmse: squares.sqrt() / whole,
            mean: mean(light) / whole,
            too_bright: pairs().filter(|d| *d > limit).count() as f64 / count,
        }
    }
}

/// Columns: heading, name in the JSON.
const COLUMNS: [(&str, &str); 3] = [
    ("relative RMSE", "relative_rmse"),
    ("mean", "mean"),
    ("too bright", "too_bright"),
];

/// Prints a row for each place and number of bounces.
pub fn print(all: &Map<String, Value>) {
    print!("{:<20} {:<8}", "place", "bounces");
    COLUMNS.iter().for_each(|(name, _)| print!(" {name:>14}"));
    println!();
    for (place, kinds) in all {
        for (bounces, figures) in kinds.as_object().into_iter().flatten() {
            print!("{place:<20} {bounces:<8}");
            for (_, name) in COLUMNS {
                let figure = figures.get(name).and_then(Value::as_f64);
                print!(" {:>14.4}", figure.unwrap_or(f64::NAN));
            }
            println!();
        }
    }
    println!("against {ALL} bounces");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_light_is_half_missing() {
        let missing = Missing::of(&[1.0, 1.0], &[2.0, 2.0]);
        let half = Missing {
            relative_rmse: 0.5,
            mean: 0.5,
            too_bright: 0.0,
        };
        assert_eq!(missing, half);
    }

    #[test]
    fn a_leak_is_counted() {
        let missing = Missing::of(&[1.0, 0.2, 1.0, 1.0], &[1.0, 0.0, 1.0, 2.0]);
        assert_eq!(missing.too_bright, 0.25);
        assert_eq!(Missing::of(&[], &[]).mean, 0.0);
    }
}
