//! Likeness to the reference in the frames after a cut of the camera.

use anyhow::Result;
use indicatif::ProgressBar;
use relight::compare::{Rgb8, compare, flip};
use serde_json::{Map, Value, json};

use super::stage::{Stage, Variant};
use crate::view::Camera;

/// Frames after the cut whose pictures are compared; 1 is the first with the new view.
pub const AFTER: [u32; 6] = [1, 2, 4, 8, 16, 32];

/// Degrees by which the camera turns in the cut.
const TURN: f32 = 180.0;

/// Frames of a variant: before the cut, and after it.
pub fn frames(before: u32) -> u64 {
    u64::from(before) + u64::from(AFTER[AFTER.len() - 1])
}

/// SSIM and FLIP of each variant, in the order of [`AFTER`].
///
/// # Errors
/// The device is lost or out of memory, or a picture is too small.
pub fn place(
    stage: &mut Stage,
    variants: &[Variant],
    camera: &Camera,
    truth: &Rgb8,
    before: u32,
    bar: &ProgressBar,
) -> Result<Map<String, Value>> {
    let away = Camera {
        yaw: camera.yaw + TURN,
        ..*camera
    };
    let mut results = Map::new();
    for Variant { name, settings } in variants {
        stage.cut(&away, settings)?;
        for _ in 0..before {
            stage.frame(&away, 0, &[])?;
            bar.inc(1);
        }
        let (mut ssim, mut flips) = (Vec::new(), Vec::new());
        for frame in 1..=AFTER[AFTER.len() - 1] {
            stage.frame(camera, 0, &[])?;
            bar.inc(1);
            if AFTER.contains(&frame) {
                let picture = stage.picture()?;
                ssim.push(compare(truth, &picture)?.ssim);
                flips.push(flip(truth, &picture)?);
            }
        }
        let figures = json!({ "frames": AFTER, "ssim": ssim, "flip": flips });
        results.insert((*name).into(), figures);
    }
    Ok(results)
}

/// Prints a row for each place, variant and measure.
pub fn print(all: &Map<String, Value>) {
    print!("{:<20} {:<16} {:<6}", "place", "picture", "after");
    AFTER.iter().for_each(|frame| print!(" {frame:>8}"));
    println!();
    for (place, kinds) in all {
        for (kind, value) in kinds.as_object().into_iter().flatten() {
            for (heading, name) in [("SSIM", "ssim"), ("FLIP", "flip")] {
                print!("{place:<20} {kind:<16} {heading:<6}");
                let figures = value.get(name).and_then(Value::as_array);
                for figure in figures.into_iter().flatten().filter_map(Value::as_f64) {
                    print!(" {figure:>8.4}");
                }
                println!();
            }
        }
    }
}
