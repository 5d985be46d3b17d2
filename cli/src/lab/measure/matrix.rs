//! Light samples, denoisers and antialiasing, each with each.

use anyhow::Result;
use indicatif::ProgressBar;
use relight::compare::{Rgb8, compare, flip};
use renderer_vk::{DenoiserChoice, Settings};
use serde_json::{Map, Value, json};

use super::stage::Stage;
use crate::lab::statistics::temporal_noise;
use crate::timings::Timings;
use crate::view::Camera;

/// Values of `rt_numRandomDL`; 0 samples all lights that may reach a point.
const SAMPLES: [u32; 6] = [1, 2, 4, 8, 16, 0];

const FILTERS: [(&str, DenoiserChoice); 3] = [
    ("none", DenoiserChoice::None),
    ("a-svgf", DenoiserChoice::ASvgf),
    ("sparse", DenoiserChoice::Sparse),
];

/// Frames of all cells, with this many before and after the camera arrives.
pub fn frames(each: u32) -> u64 {
    (SAMPLES.len() * FILTERS.len() * 2) as u64 * 2 * u64::from(each)
}

/// For each cell: SSIM and FLIP when the camera arrives, noise over the frames after it, median GPU time of all its
/// frames.
///
/// # Errors
/// The device is lost or out of memory, or a picture is too small.
pub fn place(
    stage: &mut Stage,
    base: &Settings,
    camera: &Camera,
    truth: &Rgb8,
    frames: u32,
    bar: &ProgressBar,
) -> Result<Vec<Value>> {
    let everywhere = vec![true; truth.width() * truth.height()];
    let mut cells = Vec::new();
    for samples in SAMPLES {
        for (filter, denoiser) in FILTERS {
            for taa in [false, true] {
                let settings = Settings {
                    rt_num_random_dl: samples,
                    rt_denoiser: denoiser,
                    rt_taa: taa,
                    ..base.clone()
                };
                stage.cut(camera, &settings)?;
                let mut timings = Timings::new(&stage.renderer);
                for left in (0..frames).rev() {
                    let stats = stage.frame(camera, left, &[])?;
                    timings.add(&stage.renderer, &stats);
                    bar.inc(1);
                }
                timings.finish(&mut stage.renderer)?;
                let picture = stage.picture()?;
                let mut watched = Vec::new();
                for _ in 0..frames {
                    let stats = stage.frame(camera, 0, &[])?;
                    timings.add(&stage.renderer, &stats);
                    timings.finish(&mut stage.renderer)?;
                    watched.push(stage.light()?);
                    bar.inc(1);
                }
                cells.push(json!({
                    "samples": samples_name(samples),
                    "filter": filter,
                    "taa": taa,
                    "ssim": compare(truth, &picture)?.ssim,
                    "flip": flip(truth, &picture)?,
                    "noise": temporal_noise(&watched, &everywhere),
                    "gpu_ms": timings.gpu().map(|spread| spread.median),
                }));
            }
        }
    }
    Ok(cells)
}

fn samples_name(samples: u32) -> String {
    match samples {
        0 => "all".to_owned(),
        count => count.to_string(),
    }
}

/// Columns: heading, name in the JSON, factor, decimals.
const COLUMNS: [(&str, &str, f64, usize); 4] = [
    ("SSIM", "ssim", 1.0, 4),
    ("FLIP", "flip", 1.0, 4),
    ("noise %", "noise", 100.0, 2),
    ("GPU ms", "gpu_ms", 1.0, 3),
];

/// Prints the mean over the places of each cell.
pub fn print(all: &Map<String, Value>) {
    print!("{:<8} {:<8} {:<4}", "samples", "filter", "TAA");
    COLUMNS.iter().for_each(|(name, ..)| print!(" {name:>9}"));
    println!();
    let places: Vec<&Vec<Value>> = all.values().filter_map(Value::as_array).collect();
    let Some(first) = places.first() else { return };
    for (number, cell) in first.iter().enumerate() {
        let text = |name| cell.get(name).and_then(Value::as_str).unwrap_or_default();
        let taa = cell.get("taa").and_then(Value::as_bool) == Some(true);
        let taa = if taa { "on" } else { "off" };
        print!("{:<8} {:<8} {taa:<4}", text("samples"), text("filter"));
        for (_, name, scale, digits) in COLUMNS {
            let figure = |place: &&Vec<Value>| place.get(number)?.get(name)?.as_f64();
            let known: Vec<f64> = places.iter().filter_map(figure).collect();
            match known.is_empty() {
                true => print!(" {:>9}", "-"),
                false => {
                    let mean = known.iter().sum::<f64>() / known.len() as f64 * scale;
                    print!(" {mean:>9.digits$}");
                }
            }
        }
        println!();
    }
    println!("means of {} places", places.len());
}
