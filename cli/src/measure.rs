//! `relight measure`: how near the traced look comes in real time to its own reference, without an engine or a display.
//!
//! Truth is the mean of many frames with all the sampling switched to its unbiased form (`rt_accumulate`). Every picture
//! has the exposure that the map starts with, so that differences are those of the light. Cameras follow from the map
//! by the rule of `relight cameras`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use relight::compare::{Rgb8, compare, flip};
use renderer_vk::api::{DynamicLight, RefEntity};
use renderer_vk::{LightSelection, Renderer, RendererOptions, Settings};
use serde_json::{Value, json};

use crate::cameras::{EYES, places};
use crate::render::parse_size;
use crate::statistics::{luminance, relative_bias, relative_error, temporal_noise};
use crate::view::{Camera, Maps, map_entities, open};

/// Measure the traced look in real time against its reference
///
/// For each place: similarity of what a player sees after a short turn of the head (raw, denoised, denoised and
/// antialiased, and a baseline with uniform light selection and a denoiser without gradients), noise over time of a
/// resting view, frames until a light that was switched off is gone, and what a moving light leaves behind.
///
/// Example: relight measure oa_dm1 kaos2 --reference 4096 -o out/measure
#[derive(Args, Debug)]
pub struct MeasureArgs {
    #[command(flatten)]
    chosen: Maps,
    /// Places of each map
    #[arg(long, default_value_t = 2)]
    each: usize,
    /// Size in pixels
    #[arg(long, default_value = "1024x768", value_parser = parse_size)]
    size: (u32, u32),
    /// Frames of the reference
    #[arg(long, default_value_t = 4096)]
    reference: u32,
    /// Frames that lead to a picture, and frames over which noise is taken
    #[arg(long, default_value_t = 32)]
    frames: u32,
    /// Diffuse bounces
    #[arg(long, default_value_t = 1)]
    bounces: u32,
    /// Vulkan device: part of its name
    #[arg(long)]
    device: Option<String>,
    /// Folder for the pictures of every variant beside the reference
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

/// Degrees that the camera turns and units that it moves forward in a frame on its way to a place: a player who looks
/// around while walking.
const TURN: f32 = 0.5;
const WALK: f32 = 0.75;

/// Distance of the light that is switched, before the eye, and its reach: about an explosion.
const LIGHT_DISTANCE: f32 = 96.0;
const LIGHT_REACH: f32 = 300.0;
/// Units a frame of the light that moves: a rocket at 60 frames a second.
const LIGHT_SPEED: f32 = 15.0;

/// A way to make the picture.
struct Variant {
    name: &'static str,
    settings: Settings,
}

/// One light sample a pixel, and what is done with it.
fn variants(base: &Settings) -> Vec<Variant> {
    let with = |name, change: &dyn Fn(&mut Settings)| {
        let mut settings = base.clone();
        change(&mut settings);
        Variant { name, settings }
    };
    vec![
        with("raw", &|s| (s.rt_denoiser, s.rt_taa) = (0, false)),
        with("denoised", &|s| (s.rt_denoiser, s.rt_taa) = (1, false)),
        with("denoised-taa", &|s| (s.rt_denoiser, s.rt_taa) = (1, true)),
        with("sparse-taa", &|s| (s.rt_denoiser, s.rt_taa) = (2, true)),
        with("baseline", &|s| {
            (s.rt_denoiser, s.rt_taa) = (1, true);
            s.rt_light_selection = LightSelection::Uniform;
            s.rt_gradients = false;
        }),
    ]
}

/// A map that pictures are taken of.
struct Stage {
    renderer: Renderer,
    entities: Vec<RefEntity>,
    size: (u32, u32),
}

impl Stage {
    /// Draws a frame.
    fn frame(&mut self, camera: &Camera, lights: &[DynamicLight]) -> Result<()> {
        self.renderer.begin_frame(0);
        self.renderer.clear_scene();
        for entity in &self.entities {
            self.renderer.add_entity(entity);
        }
        for light in lights {
            self.renderer.add_light(*light);
        }
        self.renderer
            .render_scene(&camera.ref_def(self.size, 90.0))?;
        self.renderer.end_frame()?;
        Ok(())
    }

    /// What the last frame shows.
    fn picture(&mut self) -> Result<Rgb8> {
        let picture = self.renderer.read_pixels()?;
        Ok(Rgb8::new(
            picture.width as usize,
            picture.height as usize,
            picture.rgb,
        )?)
    }

    /// Forgets all frames: the next one starts without a past.
    fn cut(&mut self, camera: &Camera, settings: &Settings) -> Result<()> {
        // a frame of the other mode ends both kinds of memory
        let other = Settings {
            rt_accumulate: !settings.rt_accumulate,
            ..settings.clone()
        };
        self.renderer.set_settings(&other);
        self.frame(camera, &[])?;
        self.renderer.set_settings(settings);
        Ok(())
    }

    /// The mean of `frames` frames.
    fn reference(
        &mut self,
        base: &Settings,
        camera: &Camera,
        lights: &[DynamicLight],
        frames: u32,
        bar: &ProgressBar,
    ) -> Result<Rgb8> {
        let settings = Settings {
            rt_accumulate: true,
            ..base.clone()
        };
        self.cut(camera, &settings)?;
        for _ in 0..frames {
            self.frame(camera, lights)?;
            bar.inc(1);
        }
        self.picture()
    }
}

/// Where the camera is `left` frames before it arrives.
fn on_the_way(camera: &Camera, left: u32) -> Camera {
    let left = left as f32;
    let [forward, ..] = camera.axis();
    Camera {
        origin: camera.origin - forward * (WALK * left),
        yaw: camera.yaw - TURN * left,
        ..*camera
    }
}

/// Frames that the eye takes to adapt: two seconds.
const ADAPTATION: u32 = 120;

/// Mean luminance of what a player sees in the traced look over that of the classic look, as displayed.
fn brightness(
    stage: &mut Stage,
    base: &Settings,
    camera: &Camera,
    bar: &ProgressBar,
) -> Result<f64> {
    let mut seen = |rt, frames| {
        stage.renderer.set_settings(&Settings {
            rt,
            rt_auto_exposure: true,
            ..base.clone()
        });
        for _ in 0..frames {
            stage.frame(camera, &[])?;
            bar.inc(1);
        }
        anyhow::Ok(stage.picture()?.mean_luminance())
    };
    let classic = seen(false, 1)?;
    Ok(seen(true, ADAPTATION)? / classic.max(1.0e-3))
}

/// What was measured at one place.
fn place(
    stage: &mut Stage,
    args: &MeasureArgs,
    base: &Settings,
    camera: &Camera,
    name: &str,
    bar: &ProgressBar,
) -> Result<Value> {
    bar.set_message(format!("{name}: reference"));
    let truth = stage.reference(base, camera, &[], args.reference, bar)?;
    let [forward, left, _] = camera.axis();
    let light = |offset: f32| DynamicLight {
        origin: camera.origin + forward * LIGHT_DISTANCE + left * offset,
        radius: LIGHT_REACH,
        color: Vec3::new(1.0, 0.75, 0.4),
        additive: false,
    };
    let brightness = brightness(stage, base, camera, bar)?;
    // a lit picture needs less: it only tells which pixels the light reaches
    let lit = stage.reference(base, camera, &[light(0.0)], args.reference.div_ceil(8), bar)?;
    // the light that moves comes from the left and is here at the end
    let moved = LIGHT_SPEED * args.frames as f32 * 0.25;
    let moved_truth = stage.reference(
        base,
        camera,
        &[light(-moved)],
        args.reference.div_ceil(4),
        bar,
    )?;
    let truth_values = luminance(&truth);
    let reached: Vec<bool> = luminance(&lit)
        .iter()
        .zip(&truth_values)
        .map(|(lit, dark)| *lit > 2.0 * dark && *lit > 0.01)
        .collect();
    let moved_values = luminance(&moved_truth);
    // where the light was ten frames ago and its light is not any more
    let trail: Vec<bool> = reached
        .iter()
        .zip(moved_values.iter().zip(&truth_values))
        .map(|(reached, (now, dark))| *reached && *now < 1.5 * dark)
        .collect();

    let mut results = serde_json::Map::new();
    results.insert("brightness".into(), json!(brightness));
    for Variant {
        name: kind,
        settings,
    } in variants(base)
    {
        bar.set_message(format!("{name}: {kind}"));
        stage.cut(camera, &settings)?;
        for left in (0..args.frames).rev() {
            stage.frame(&on_the_way(camera, left), &[])?;
            bar.inc(1);
        }
        let picture = stage.picture()?;
        let difference = compare(&truth, &picture)?;

        // at rest: settled, then watched
        let mut watched = Vec::new();
        for frame in 0..2 * args.frames {
            stage.frame(camera, &[])?;
            bar.inc(1);
            if frame >= args.frames {
                watched.push(luminance(&stage.picture()?));
            }
        }

        // a light goes out
        for _ in 0..args.frames {
            stage.frame(camera, &[light(0.0)])?;
            bar.inc(1);
        }
        let mut gone = None;
        for frame in 1..=args.frames {
            stage.frame(camera, &[])?;
            bar.inc(1);
            let values = luminance(&stage.picture()?);
            if relative_bias(&values, &truth_values, &reached).abs() <= 0.1 {
                gone = Some(frame);
                break;
            }
        }

        // a light flies by
        for frame in 0..args.frames {
            let offset = LIGHT_SPEED * (args.frames - 1 - frame) as f32 - moved;
            stage.frame(camera, &[light(offset)])?;
            bar.inc(1);
        }
        let flown = stage.picture()?;
        let flown_values = luminance(&flown);
        results.insert(
            kind.into(),
            json!({
                "ssim": difference.ssim,
                "flip": flip(&truth, &picture)?,
                "noise": temporal_noise(&watched),
                "light_off_frames": gone,
                "moving_light": {
                    "ssim": compare(&moved_truth, &flown)?.ssim,
                    "trail": relative_bias(&flown_values, &moved_values, &trail),
                    "error": relative_error(&flown_values, &moved_values, &reached),
                },
            }),
        );
        if let Some(folder) = &args.output {
            save(folder, &format!("{name}-{kind}"), &picture)?;
            save(folder, &format!("{name}-{kind}-flown"), &flown)?;
        }
    }
    if let Some(folder) = &args.output {
        save(folder, &format!("{name}-reference"), &truth)?;
        save(folder, &format!("{name}-reference-flown"), &moved_truth)?;
    }
    Ok(Value::Object(results))
}

fn save(folder: &Path, name: &str, picture: &Rgb8) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}", folder.display()))?;
    let path = folder.join(format!("{name}.png"));
    image::save_buffer(
        &path,
        picture.pixels(),
        picture.width() as u32,
        picture.height() as u32,
        image::ColorType::Rgb8,
    )
    .with_context(|| format!("{}: cannot be written", path.display()))
}

/// Runs the command.
pub fn run(args: &MeasureArgs) -> Result<()> {
    if args.frames < 2 || args.reference == 0 || args.each == 0 {
        bail!("--frames is at least 2, --reference and --each at least 1");
    }
    let mut all = serde_json::Map::new();
    for map in &args.chosen.maps {
        let (files, path) = open(map, &args.chosen.games)?;
        let mut renderer = Renderer::new(RendererOptions {
            width: args.size.0,
            height: args.size.1,
            window: None,
            validation: false,
            device: args.device.clone(),
            vsync: false,
            pipeline_cache: None,
        })
        .context("nothing to measure without a Vulkan device")?;
        let base = Settings {
            rt: true,
            rt_bounces: args.bounces,
            rt_auto_exposure: false,
            ..Settings::default()
        };
        renderer.begin_registration(files, &base)?;
        renderer.load_world(&path)?;
        renderer.end_registration();
        let bsp = renderer
            .world()
            .map(|w| w.relit.bsp.clone())
            .context("no map")?;
        let entities = map_entities(&mut renderer, &bsp);
        let mut stage = Stage {
            renderer,
            entities,
            size: args.size,
        };
        let cameras = places(&bsp.entities(), args.each);
        let (variants, frames) = (variants(&base).len() as u64, u64::from(args.frames));
        let bar = ProgressBar::new(
            cameras.len() as u64
                * (u64::from(args.reference) * 11 / 8
                    + u64::from(ADAPTATION)
                    + variants * 6 * frames),
        );
        bar.set_style(ProgressStyle::with_template(
            "{msg} {bar:30} {pos}/{len} frames, {eta} left",
        )?);
        for (index, at) in cameras.iter().enumerate() {
            let camera = Camera {
                origin: at.origin + Vec3::Z * EYES,
                yaw: at.yaw,
                pitch: 0.0,
            };
            let name = format!("{map}-{index}");
            let result = place(&mut stage, args, &base, &camera, &name, &bar)?;
            all.insert(name, result);
        }
        bar.finish_and_clear();
    }
    if args.json {
        println!("{}", Value::Object(all));
    } else {
        table(&all);
    }
    Ok(())
}

/// A line for each place and way, and their means.
fn table(all: &serde_json::Map<String, Value>) {
    println!(
        "{:<20} {:<14} {:>7} {:>7} {:>8} {:>6} {:>8} {:>7}",
        "place", "picture", "SSIM", "FLIP", "noise %", "off", "fly SSIM", "trail %"
    );
    let mut sums: Vec<(String, [f64; 5], f64, f64)> = Vec::new();
    let mut brightness = Vec::new();
    for (place, kinds) in all {
        brightness.extend(
            kinds
                .pointer("/brightness")
                .and_then(Value::as_f64)
                .map(|b| (place, b)),
        );
        for (kind, v) in kinds
            .as_object()
            .into_iter()
            .flatten()
            .filter(|(_, v)| v.is_object())
        {
            let number = |path: &str| v.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN);
            let row = [
                number("/ssim"),
                number("/flip"),
                100.0 * number("/noise"),
                number("/moving_light/ssim"),
                100.0 * number("/moving_light/trail"),
            ];
            let off = v.pointer("/light_off_frames").and_then(Value::as_u64);
            let shown = off.map_or("never".into(), |n| n.to_string());
            line(place, kind, row, &shown);
            let off = off.map_or(f64::INFINITY, |n| n as f64);
            match sums.iter_mut().find(|(k, ..)| k == kind) {
                Some((_, sum, worst, count)) => {
                    (0..row.len()).for_each(|i| sum[i] += row[i]);
                    (*worst, *count) = (worst.max(off), *count + 1.0);
                }
                None => sums.push((kind.clone(), row, off, 1.0)),
            }
        }
    }
    for (kind, sum, worst, count) in sums {
        line(
            "mean (worst off)",
            &kind,
            sum.map(|v| v / count),
            &format!("{worst}"),
        );
    }
    for (place, ratio) in brightness {
        println!("{place:<20} brightness of the traced over the classic look {ratio:.2}");
    }
}

fn line(place: &str, kind: &str, [ssim, flip, noise, fly, trail]: [f64; 5], off: &str) {
    println!(
        "{place:<20} {kind:<14} {ssim:>7.4} {flip:>7.4} {noise:>8.2} {off:>6} {fly:>8.4} {trail:>7.1}"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_arrives() {
        let camera = Camera {
            origin: Vec3::new(1.0, 2.0, 3.0),
            yaw: 30.0,
            pitch: 0.0,
        };
        assert_eq!(on_the_way(&camera, 0).origin, camera.origin);
        assert_eq!(on_the_way(&camera, 4).yaw, 28.0);
        assert!(on_the_way(&camera, 4).origin.distance(camera.origin) - 3.0 < 1.0e-5);
    }
}
