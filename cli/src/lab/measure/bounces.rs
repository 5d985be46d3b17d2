//! Light that paths of few bounces lack.

use anyhow::Result;
use indicatif::ProgressBar;
use renderer_vk::Settings;
use serde_json::{Map, Value, json};

use super::stage::Stage;
use crate::view::Camera;

/// Bounces of the pictures that are compared.
const FEW: [u32; 4] = [0, 1, 2, 4];

/// Of these the ones that are compared with light of further bounces, too, if the settings add it.
const COMPLETED: [u32; 3] = [1, 2, 4];

/// Bounces of the reference.
const ALL: u32 = 8;

/// Excess over the reference above which a pixel counts as too bright.
const EXCESS: f64 = 0.05;

/// Added to the luminance by which an error is divided, as a part of the median: bounds the weight of black pixels.
const FLOOR: f64 = 0.01;

/// Part of the pixels that [`Missing::darkest`] leaves out.
const DARKEST: f64 = 0.1;

/// Frames of a place.
pub fn frames(base: &Settings, reference: u32) -> u64 {
    (kinds(base).len() as u64 + 1) * u64::from(reference)
}

/// Names and settings of the pictures that are compared.
fn kinds(base: &Settings) -> Vec<(String, Settings)> {
    let with = |rt_bounces, rt_bounce_ambient| Settings {
        rt_bounces,
        rt_bounce_ambient,
        ..base.clone()
    };
    let few = FEW.map(|bounces| (bounces.to_string(), with(bounces, 0.0)));
    let completed = COMPLETED.map(|bounces| {
        let name = format!("{bounces}+ambient");
        (name, with(bounces, base.rt_bounce_ambient))
    });
    let adds = base.rt_bounce_ambient > 0.0;
    few.into_iter()
        .chain(completed.into_iter().filter(|_| adds))
        .collect()
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
    let mut light = |settings: &Settings| {
        let (_, light) = stage.reference(settings, camera, &[], frames, bar)?;
        anyhow::Ok(light)
    };
    let all = light(&Settings {
        rt_bounces: ALL,
        rt_bounce_ambient: 0.0,
        ..base.clone()
    })?;
    let mut results = Map::new();
    for (name, settings) in kinds(base) {
        let figures = Missing::of(&light(&settings)?, &all);
        let figures = json!({
            "relative_rmse": figures.relative_rmse,
            "mean": figures.mean,
            "darkest": figures.darkest,
            "too_bright": figures.too_bright,
        });
        results.insert(name, figures);
    }
    Ok(results)
}

/// Luminance of a picture against its reference.
#[derive(Debug, PartialEq)]
struct Missing {
    /// Root of the mean squared relative error of a pixel.
    relative_rmse: f64,
    /// Sum over that of the reference: lamps and sky weigh most.
    mean: f64,
    /// Luminance over that of the reference which all but [`DARKEST`] of the pixels exceed.
    darkest: f64,
    /// Part of the pixels that are brighter than the reference by more than [`EXCESS`].
    too_bright: f64,
}

impl Missing {
    fn of(light: &[f32], all: &[f32]) -> Self {
        let quantile = |values: &mut [f64], part: f64| {
            values.sort_by(f64::total_cmp);
            let at = (values.len() as f64 * part) as usize;
            values.get(at).copied().unwrap_or(0.0)
        };
        let mut sorted: Vec<f64> = all.iter().copied().map(f64::from).collect();
        let floor = (FLOOR * quantile(&mut sorted, 0.5)).max(f64::MIN_POSITIVE);
        let pairs = || {
            light
                .iter()
                .zip(all)
                .map(|(a, b)| (f64::from(*a), f64::from(*b)))
        };
        let mut ratios: Vec<f64> = pairs()
            .map(|(few, all)| (few + floor) / (all + floor))
            .collect();
        let count = ratios.len().max(1) as f64;
        let squares = ratios
            .iter()
            .map(|ratio| (ratio - 1.0).powi(2))
            .sum::<f64>();
        let bright = ratios.iter().filter(|ratio| **ratio > 1.0 + EXCESS).count();
        let (few, whole) = pairs().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
        Self {
            relative_rmse: (squares / count).sqrt(),
            mean: (few + floor) / (whole + floor),
            darkest: quantile(&mut ratios, DARKEST),
            too_bright: bright as f64 / count,
        }
    }
}

/// Columns: heading, name in the JSON.
const COLUMNS: [(&str, &str); 4] = [
    ("relative RMSE", "relative_rmse"),
    ("mean", "mean"),
    ("darkest tenth", "darkest"),
    ("too bright", "too_bright"),
];

/// Prints a row for each place and number of bounces.
pub fn print(all: &Map<String, Value>) {
    print!("{:<20} {:<10}", "place", "bounces");
    COLUMNS.iter().for_each(|(name, _)| print!(" {name:>14}"));
    println!();
    for (place, kinds) in all {
        for (bounces, figures) in kinds.as_object().into_iter().flatten() {
            print!("{place:<20} {bounces:<10}");
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

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 0.02
    }

    #[test]
    fn half_the_light_is_half_missing() {
        let Missing {
            relative_rmse,
            mean,
            darkest,
            too_bright,
        } = Missing::of(&[1.0, 4.0], &[2.0, 8.0]);
        assert!(
            [relative_rmse, mean, darkest]
                .into_iter()
                .all(|v| near(v, 0.5))
        );
        assert_eq!(too_bright, 0.0);
    }

    #[test]
    fn a_lamp_hides_a_dark_corner_in_the_mean_alone() {
        let lit = [[1.0f32; 8].as_slice(), &[1000.0]].concat();
        let dark = [[0.5f32, 0.5].as_slice(), &[1.0; 6], &[1000.0]].concat();
        let missing = Missing::of(&dark, &lit);
        assert!(near(missing.mean, 1.0) && near(missing.darkest, 0.5));
        assert!(near(missing.relative_rmse, 0.5 * (2.0f64 / 9.0).sqrt()));
    }

    #[test]
    fn a_leak_is_counted() {
        let missing = Missing::of(&[1.0, 0.2, 1.0, 1.0], &[1.0, 0.0, 1.0, 2.0]);
        assert_eq!(missing.too_bright, 0.25);
        assert_eq!(Missing::of(&[], &[]).mean, 1.0);
    }
}
