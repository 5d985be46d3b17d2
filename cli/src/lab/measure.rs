//! `relight-lab measure`: error of the traced look in real time against its own reference, without an engine or a
//! display.
//!
//! The reference is the mean of many frames with all sampling in its unbiased form (`rt_accumulate`). Every picture has
//! the map's initial exposure, so that differences are those of light. Cameras are those of `relight cameras`, or
//! given.
//!
//! Similarity is measured over all pixels, and separately for those with specular paths (mirror, portal, glass, liquid
//! or shiny surface; `rt_debug 11`) and for the others. Light is compared before display: clipping at white and
//! rounding to black change means; so is the contrast of shadows ([`shadows`]).

mod bounces;
mod clips;
mod cut;
mod matrix;
mod region;
mod shadows;
mod stage;
mod table;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use relight::compare::{Rgb8, compare};
use relight::viewpoints::VIEW_HEIGHT;
use renderer_vk::api::DynamicLight;
use renderer_vk::{Look, Renderer, RendererOptions, Settings};
use serde_json::{Value, json};

use self::clips::Clip;
use self::region::Regions;
use self::shadows::Shadows;
use self::stage::{Stage, Variant, variants};
use super::statistics::{luminance, mean_of, relative_bias, relative_error};
use crate::cameras::{Place, places};
use crate::chosen::parse_view;
use crate::game::Maps;
use crate::numbers;
use crate::render::parse_size;
use crate::settings::{Assignment, SettingArgs, default, help, value_of};
use crate::view::{Camera, load, map_name, open};

/// Measure the traced look in real time against its reference
///
/// For each place: similarity of the picture after a short turn of the camera (raw, denoised, denoised and antialiased,
/// and a baseline with uniform light selection and a denoiser without gradients), contrast of shadows by their distance,
/// noise over time at rest, frames until a light that was switched off has disappeared, and the trail of a moving light.
/// With --cut, --matrix, --bounce-counts or --clips something else in place of it.
///
/// Examples: relight-lab measure oa_dm1 kaos2 --reference 4096 -o out/measure; relight-lab measure oa_dm1 --cut;
/// relight-lab measure oa_dm1 --clips out/clips --reference 1024 --picture denoised-taa
#[derive(Args, Debug)]
pub struct MeasureArgs {
    #[command(flatten)]
    chosen: Maps,
    /// Views of each map: the camera of the intermission first, then spawn points, evenly out of the map's list
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = numbers::count)]
    views: usize,
    /// Camera: position in units, yaw and pitch (down) in degrees, which may be left out; may be repeated; default: the
    /// views that --views counts
    #[arg(long, value_name = "X,Y,Z,YAW,PITCH", value_parser = parse_view, allow_hyphen_values = true)]
    view: Vec<Camera>,
    /// A first-person model: its file in the game's data
    #[arg(long, value_name = "MODEL")]
    hold: Option<String>,
    /// Horizontal field of view, degrees, from 1 to 170
    #[arg(long, default_value_t = 90.0, value_parser = numbers::fov)]
    fov: f32,
    /// Keep the camera still; game time runs
    #[arg(long)]
    stand: bool,
    /// Similarity 1, 2, 4, 8, 16 and 32 frames after the camera turned by 180 degrees at once
    #[arg(long, conflicts_with_all = ["matrix", "clips"])]
    cut: bool,
    /// Similarity, noise and GPU time with 1, 2, 4, 8, 16 and all light samples, each with each denoiser, with and
    /// without temporal antialiasing
    #[arg(long, conflicts_with = "clips")]
    matrix: bool,
    /// Error of 0, 1, 2 and 4 bounces against 8, each the mean of --reference frames; with rt_bounceAmbient also of 1, 2
    /// and 4 with it
    #[arg(long, conflicts_with_all = ["cut", "matrix", "clips"])]
    bounce_counts: bool,
    /// Write pictures of a camera that walks from each place to this folder, and of the reference of each; lab/jod.py
    /// compares them
    #[arg(long, value_name = "DIR")]
    clips: Option<PathBuf>,
    /// Frames of a clip
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..))]
    clip_frames: u32,
    /// Pictures to make, by the table's names; default: all
    #[arg(long, value_name = "NAME")]
    picture: Vec<String>,
    /// Omit the measurements with dynamic lights
    #[arg(long)]
    no_lights: bool,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1024x768", value_parser = parse_size)]
    size: (u32, u32),
    /// Frames of the reference
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..))]
    reference: u32,
    /// Frames before a picture, and frames over which noise is measured
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(2..))]
    frames: u32,
    #[arg(long, help = help("rt_bounces"), value_parser = value_of("rt_bounces"), default_value = default("rt_bounces"))]
    bounces: Assignment,
    #[arg(long, help = help("rt_exposure"), value_parser = value_of("rt_exposure"), default_value = default("rt_exposure"), allow_negative_numbers = true)]
    exposure: Assignment,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Folder for the pictures of every variant, the reference, and the mask of pixels with specular paths
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// Print JSON in place of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    set: SettingArgs,
}

impl MeasureArgs {
    /// The chosen variants.
    fn variants(&self, base: &Settings) -> Vec<Variant> {
        let mut variants = variants(base);
        variants.retain(|v| self.picture.is_empty() || self.picture.iter().any(|p| p == v.name));
        variants
    }

    /// Frames to draw for a place.
    fn frames_of_place(&self, base: &Settings) -> u64 {
        let variants = self.variants(base).len() as u64;
        let (reference, frames) = (u64::from(self.reference), u64::from(self.frames));
        if self.clips.is_some() {
            let shown = u64::from(self.clip_frames);
            variants * (frames + shown) + shown * reference
        } else if self.bounce_counts {
            bounces::frames(base, self.reference)
        } else if self.cut {
            reference + variants * cut::frames(self.frames)
        } else if self.matrix {
            reference + matrix::frames(self.frames)
        } else {
            reference * 15 / 8 + u64::from(ADAPTATION) + variants * 6 * frames
        }
    }
}

/// Distance of the switched light from the camera, and its radius, units: about an explosion.
const LIGHT_DISTANCE: f32 = 96.0;
const LIGHT_REACH: f32 = 300.0;
/// Speed of the moving light, units a frame: a rocket at 60 frames a second.
const LIGHT_SPEED: f32 = 15.0;

/// Frames until automatic exposure has adapted: two seconds.
const ADAPTATION: u32 = 120;

/// Mean luminance of the displayed traced look over that of the classic look.
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
            stage.frame(camera, 0, &[])?;
            bar.inc(1);
        }
        anyhow::Ok(stage.picture()?.mean_luminance())
    };
    let classic = seen(Look::Classic, 1)?;
    Ok(seen(Look::Traced, ADAPTATION)? / classic.max(1.0e-3))
}

/// Measures one place.
fn place(
    stage: &mut Stage,
    args: &MeasureArgs,
    base: &Settings,
    camera: &Camera,
    name: &str,
    bar: &ProgressBar,
) -> Result<Value> {
    bar.set_message(format!("{name}: reference"));
    let (truth, light) = stage.reference(base, camera, &[], args.reference, bar)?;
    let specular = stage.specular(base, camera)?;
    let surfaces = stage.surfaces(base, camera)?;
    let shadows = Shadows::new(truth.width(), &light, &surfaces, &specular);
    let regions = Regions::new(&truth, specular);
    let lights = match args.no_lights {
        true => None,
        false => Some(Lights::new(stage, args, base, camera, bar)?),
    };

    let mut results = serde_json::Map::new();
    results.insert("specular_share".into(), json!(regions.specular_share()));
    if !args.no_lights {
        let brightness = brightness(stage, base, camera, bar)?;
        results.insert("brightness".into(), json!(brightness));
    }
    for Variant {
        name: kind,
        settings,
    } in args.variants(base)
    {
        bar.set_message(format!("{name}: {kind}"));
        stage.cut(camera, &settings)?;
        for left in (0..args.frames).rev() {
            stage.frame(camera, left, &[])?;
            bar.inc(1);
        }
        let picture = stage.picture()?;
        let arrived = stage.light()?;

        // at rest: first half to settle, second half to measure
        let mut watched = Vec::new();
        for frame in 0..2 * args.frames {
            stage.frame(camera, 0, &[])?;
            bar.inc(1);
            if frame >= args.frames {
                watched.push(stage.light()?);
            }
        }
        let rested = stage.picture()?;
        let mut result = regions.compare(&picture, &rested, &watched)?;
        result.insert("shadows".into(), shadows.json(&arrived));
        result.insert("rest_shadows".into(), shadows.json(&mean_of(&watched)));
        if let Some(lights) = &lights {
            let (figures, flown) = lights.measure(stage, args, camera, bar)?;
            result.extend(figures);
            if let Some(folder) = &args.output {
                save(folder, &format!("{name}-{kind}-flown"), &flown)?;
            }
        }
        results.insert(kind.into(), Value::Object(result));
        if let Some(folder) = &args.output {
            save(folder, &format!("{name}-{kind}"), &picture)?;
            save(folder, &format!("{name}-{kind}-rested"), &rested)?;
        }
    }
    if let Some(folder) = &args.output {
        save(folder, &format!("{name}-reference"), &truth)?;
        save(folder, &format!("{name}-specular"), &regions.picture()?)?;
        if let Some(lights) = &lights {
            save(folder, &format!("{name}-reference-flown"), &lights.flown)?;
        }
    }
    Ok(Value::Object(results))
}

/// References for a light that is switched off, and for one that moves.
struct Lights {
    /// Offset of the moving light to the left at the end, units.
    moved: f32,
    dark: Vec<f32>,
    /// The view with that light.
    flown: Rgb8,
    flown_light: Vec<f32>,
    /// Pixels that the switched light reached, and those that the moving light reached and left.
    reached: Vec<bool>,
    left: Vec<bool>,
}

/// Thresholds of the pixels that the switched light reached: at least twice as bright with the light, brighter by this
/// part of display white, and without the light at least this part of display white (7 of 255 as displayed); and the
/// least share of such pixels in the picture.
const SEEN_LIGHT: f32 = 0.01;
const SEEN_DARK: f32 = 0.002;
const SEEN_PART: f32 = 0.002;

impl Lights {
    fn light(camera: &Camera, offset: f32) -> DynamicLight {
        let [forward, left, _] = camera.axis();
        DynamicLight {
            origin: camera.origin + forward * LIGHT_DISTANCE + left * offset,
            radius: LIGHT_REACH,
            color: Vec3::new(1.0, 0.75, 0.4),
            ..DynamicLight::default()
        }
    }

    fn new(
        stage: &mut Stage,
        args: &MeasureArgs,
        base: &Settings,
        camera: &Camera,
        bar: &ProgressBar,
    ) -> Result<Self> {
        // half of the frames: errors are relative, so dark places need a precise mean
        let (truth, dark) = stage.reference(base, camera, &[], args.reference.div_ceil(2), bar)?;
        // fewer frames: the lit picture only selects the pixels that the light reaches
        let frames = args.reference.div_ceil(8);
        let (lit, _) = stage.reference(base, camera, &[Self::light(camera, 0.0)], frames, bar)?;
        // the moving light starts at the left and ends here
        let moved = LIGHT_SPEED * args.frames as f32 * 0.25;
        let light = Self::light(camera, -moved);
        let (flown, flown_light) =
            stage.reference(base, camera, &[light], args.reference.div_ceil(4), bar)?;
        let shown = [&truth, &lit].map(luminance);
        let mut reached: Vec<bool> = std::iter::zip(&shown[0], &shown[1])
            .map(|(dark, lit)| *dark >= SEEN_DARK && *lit > 2.0 * dark && *lit > dark + SEEN_LIGHT)
            .collect();
        let count = reached.iter().filter(|r| **r).count();
        if (count as f32) < SEEN_PART * reached.len() as f32 {
            reached.fill(false);
        }
        // pixels that the light reached some frames ago and does not reach now
        let left = reached
            .iter()
            .zip(flown_light.iter().zip(&dark))
            .map(|(reached, (now, dark))| *reached && *now < 1.5 * dark)
            .collect();
        Ok(Self {
            moved,
            dark,
            flown,
            flown_light,
            reached,
            left,
        })
    }

    /// Measures the error of both lights; also returns the picture at the end of the movement.
    fn measure(
        &self,
        stage: &mut Stage,
        args: &MeasureArgs,
        camera: &Camera,
        bar: &ProgressBar,
    ) -> Result<(serde_json::Map<String, Value>, Rgb8)> {
        let rested = relative_bias(&stage.light()?, &self.dark, &self.reached);
        for _ in 0..args.frames {
            stage.frame(camera, 0, &[Self::light(camera, 0.0)])?;
            bar.inc(1);
        }
        let mut off = Vec::new();
        for _ in 0..args.frames {
            stage.frame(camera, 0, &[])?;
            bar.inc(1);
            off.push(relative_bias(&stage.light()?, &self.dark, &self.reached));
        }
        // last frame above the limit: the bias may cross zero before
        let gone = off.iter().rposition(|bias| bias.abs() > 0.1);
        let gone = match (self.reached.contains(&true), gone.map_or(0, |i| i + 1)) {
            (false, _) => json!("nothing"),
            (true, last) if last == off.len() => Value::Null,
            (true, last) => json!(last + 1),
        };

        for frame in 0..args.frames {
            let offset = LIGHT_SPEED * (args.frames - 1 - frame) as f32 - self.moved;
            stage.frame(camera, 0, &[Self::light(camera, offset)])?;
            bar.inc(1);
        }
        let (picture, light) = (stage.picture()?, stage.light()?);
        let mut figures = serde_json::Map::new();
        figures.insert("rested_bias".into(), json!(rested));
        figures.insert("light_off_bias".into(), json!(off));
        figures.insert("light_off_frames".into(), gone);
        figures.insert(
            "moving_light".into(),
            json!({
                "ssim": compare(&self.flown, &picture)?.ssim,
                "trail": relative_bias(&light, &self.flown_light, &self.left),
                "error": relative_error(&light, &self.flown_light, &self.reached),
            }),
        );
        Ok((figures, picture))
    }
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

/// Cameras at the places of `relight cameras`.
fn ruled_cameras(entities: &[q3bsp::Entity], each: usize) -> Vec<Camera> {
    let camera = |at: &Place| Camera {
        origin: at.origin + Vec3::Z * VIEW_HEIGHT,
        yaw: at.yaw,
        pitch: 0.0,
    };
    places(entities, each).iter().map(camera).collect()
}

/// Runs the command.
pub fn run(args: &MeasureArgs) -> Result<()> {
    let mut all = serde_json::Map::new();
    for map in &args.chosen.maps {
        let (files, path) = open(map, &args.chosen.game)?;
        let mut renderer = Renderer::new(RendererOptions {
            device: args.device.clone(),
            ..RendererOptions::headless(args.size.0, args.size.1)
        })
        .context("nothing to measure without a Vulkan device")?;
        let base = Settings {
            rt: Look::Traced,
            rt_auto_exposure: false,
            ..Settings::full_size()
        };
        let base = (args.set).change([&args.bounces, &args.exposure], base);
        let (bsp, entities) = load(&mut renderer, files, &path, &base)?;
        let held = args.hold.as_ref().map(|m| renderer.register_model(m));
        let mut stage = Stage {
            renderer,
            entities,
            held,
            size: args.size,
            fov: args.fov,
            stand: args.stand,
        };
        let cameras = match args.view.is_empty() {
            true => ruled_cameras(&bsp.entities(), args.views),
            false => args.view.clone(),
        };
        let bar = ProgressBar::new(cameras.len() as u64 * args.frames_of_place(&base));
        bar.set_style(ProgressStyle::with_template(
            "{msg} {bar:30} {pos}/{len} frames, {eta} left",
        )?);
        for (index, camera) in cameras.iter().enumerate() {
            let name = format!("{}-{index}", map_name(&path));
            bar.set_message(name.clone());
            let result = if let Some(folder) = &args.clips {
                let clip = Clip {
                    cameras: clips::walk(&bsp, camera, args.clip_frames as usize),
                    before: args.frames,
                    reference: args.reference,
                    variants: &args.variants(&base),
                };
                clip.write(&mut stage, &base, &folder.join(&name), &bar)?
            } else if args.bounce_counts {
                let frames = args.reference;
                Value::Object(bounces::place(&mut stage, &base, camera, frames, &bar)?)
            } else if args.cut || args.matrix {
                let (truth, _) = stage.reference(&base, camera, &[], args.reference, &bar)?;
                match args.cut {
                    true => {
                        let variants = args.variants(&base);
                        let before = args.frames;
                        let figures =
                            cut::place(&mut stage, &variants, camera, &truth, before, &bar);
                        Value::Object(figures?)
                    }
                    false => {
                        let each = args.frames;
                        Value::Array(matrix::place(
                            &mut stage, &base, camera, &truth, each, &bar,
                        )?)
                    }
                }
            } else {
                place(&mut stage, args, &base, camera, &name, &bar)?
            };
            all.insert(name, result);
        }
        bar.finish_and_clear();
    }
    if args.json {
        println!("{}", Value::Object(all));
    } else if args.clips.is_some() {
        all.keys().for_each(|name| println!("{name}"));
    } else if args.bounce_counts {
        bounces::print(&all);
    } else if args.cut {
        cut::print(&all);
    } else if args.matrix {
        matrix::print(&all);
    } else {
        table::print(&all);
    }
    Ok(())
}
