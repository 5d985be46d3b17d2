//! `relight-lab growth`: cost of a traced frame as one property of a generated scene grows.
//!
//! One hall, in which one thing at a time grows. Lights are those of the directives, frames are drawn as in a game,
//! with a camera at rest. Times are medians by GPU timers, without the first frames.

mod axis;
mod bound;
mod fit;
mod page;
pub(super) mod scene;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use renderer_vk::api::Picture;
use renderer_vk::{Look, MapLightChoice, Renderer, RendererOptions, Settings};

use self::axis::{Axis, Case, Sizes, parse_axis};
use self::bound::{Measured, Report, Row};
use crate::pictures::{write_rgb, write_whole};
use crate::render::parse_size;
use crate::settings::SettingArgs;
use crate::timings::Timings;
use crate::view::{draw, load};

/// Measure how the cost of a frame grows: with pixels, lights, triangles, entities, curves, layers, mirrors, trees
///
/// Draws made-up scenes in the traced look, each larger in one respect, and writes milliseconds by pass and bytes by
/// purpose: growth.json, growth.csv, growth.html with curves, and a picture of the largest size. For each axis it
/// prints the power law through the times, the pass with most of the time at the largest size, and the pass with most
/// of the increase.
///
/// Examples: relight-lab growth -o out/growth; relight-lab growth -o out --axis lights=1,100,10000 --axis layers
#[derive(Args, Debug)]
pub struct GrowthArgs {
    /// Folder for the results
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// What grows: pixels, lights, triangles, entities, curves, layers, mirrors or trees, with sizes in place of the usual
    /// ones; may be repeated; default: all
    #[arg(long, value_name = "NAME[=SIZE,…]", value_parser = parse_axis)]
    axis: Vec<Sizes>,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    /// Frames of a scene; the medians leave out the first 10, or half of them if there are fewer than 20
    #[arg(long, value_name = "N", default_value_t = 74, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    #[command(flatten)]
    set: SettingArgs,
}

/// Field of view of the camera, degrees.
const FOV: f32 = 90.0;

/// Runs the command.
///
/// # Errors
/// There is no Vulkan device, or a file cannot be written. A size that cannot be drawn ends its axis.
pub fn run(args: &GrowthArgs) -> Result<()> {
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("{}: cannot be made", args.output.display()))?;
    let axes: Vec<Sizes> = match args.axis.is_empty() {
        true => Axis::ALL.map(Sizes::from).to_vec(),
        false => args.axis.clone(),
    };
    let base = Settings {
        rt: Look::Traced,
        rt_lights: MapLightChoice::Prior,
        ..Settings::full_size()
    };
    let base = args.set.change([], base);
    let start = || {
        let (width, height) = args.size;
        let options = RendererOptions {
            device: args.device.clone(),
            ..RendererOptions::headless(width, height)
        };
        Renderer::new(options).context("nothing to measure without a Vulkan device")
    };
    let mut renderer = start()?;
    let mut report = Report {
        device: renderer.device_info().name.clone(),
        tracer: None,
        size: args.size,
        frames: args.frames,
        axes: Vec::new(),
    };
    let sizes = axes.iter().map(|axis| axis.sizes.len()).sum::<usize>();
    let bar = ProgressBar::new(sizes as u64 * u64::from(args.frames));
    bar.set_style(ProgressStyle::with_template(
        "{msg} {bar:30} {pos}/{len} frames, {eta} left",
    )?);
    for Sizes { axis, sizes } in axes {
        let (mut rows, mut ended, mut picture) = (Vec::new(), None, None);
        for size in sizes {
            bar.set_message(format!("{} {size}", axis.name()));
            let case = axis.case(size, args.size, &base);
            match measure(&mut renderer, &case, size, args.frames, &bar) {
                Ok((row, shown)) => {
                    rows.push(row);
                    picture = Some(shown);
                }
                Err(error) => {
                    ended = Some(format!("{size}: {error:#}"));
                    // the device may be lost
                    renderer = start()?;
                    break;
                }
            }
        }
        report.tracer = renderer.costs().tracer.or(report.tracer);
        let measured = Measured::new(axis.name(), axis.unit(), rows, ended);
        bar.suspend(|| measured.lines().iter().for_each(|line| println!("{line}")));
        report.axes.push(measured);
        // after each axis, so that an interrupted run leaves what it has
        for (name, text) in [
            ("growth.json", report.json()?),
            ("growth.csv", report.csv()),
            ("growth.html", page::html(&report)),
        ] {
            write_whole(&args.output.join(name), text.as_bytes())?;
        }
        if let Some(shown) = picture {
            let path = args.output.join(format!("{}.png", axis.name()));
            write_rgb(&path, &shown.rgb, shown.width, shown.height)?;
        }
    }
    bar.finish_and_clear();
    Ok(())
}

/// Draws a scene and returns its costs, and the last picture.
fn measure(
    renderer: &mut Renderer,
    case: &Case,
    size: f64,
    frames: u32,
    bar: &ProgressBar,
) -> Result<(Row, Picture)> {
    let files = Arc::new(case.scene.files()?);
    renderer.resize(case.picture.0, case.picture.1)?;
    let (_, mut entities) = load(renderer, files, scene::MAP, &case.settings)?;
    let model = renderer.register_model("*1");
    entities.extend(scene::entities(case.entities, model));
    let mut timings = Timings::new(renderer);
    for frame in 0..frames {
        let mut def = scene::CAMERA.ref_def(case.picture, FOV);
        def.time_ms = i32::try_from(frame.saturating_mul(16)).unwrap_or(i32::MAX);
        let stats = draw(renderer, &entities, &def)?;
        timings.add(renderer, &stats);
        bar.inc(1);
    }
    timings.finish(renderer)?;
    let row = Row::new(size, &timings, &renderer.costs());
    Ok((row, renderer.read_pixels()?))
}
