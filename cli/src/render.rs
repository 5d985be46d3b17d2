//! `relight render`: pictures of a map, without engine and display.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::mpsc::SyncSender;

use crate::chosen::{ChosenCamera, ChosenMap};
use crate::denoise::DenoiseArgs;
use crate::numbers;
use crate::pictures::{check_name, write_rgb, write_whole};
use crate::settings::{Assignment, SettingArgs, default, help, value_of};
use crate::sharing::{self, Others, PartMean};
use crate::timings::Timings;
use crate::view::{Camera, draw, load};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use renderer_vk::api::{RefDef, RefEntity};
use renderer_vk::path::{self, PathPoint};
use renderer_vk::{DebugOutput, FrameStats, LightSelection, Renderer, RendererOptions, Settings};

/// Look of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Look {
    /// As the engine's own renderer draws it.
    Classic,
    /// Ray traced.
    Traced,
    /// The classic look with traced shadows and reflections.
    Hybrid,
}

/// Light sampling of the traced look.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sampling {
    /// One light of the cluster's list, each with equal probability.
    Uniform,
    /// One light, by resampled importance sampling.
    Resampled,
    /// Every light of the list.
    All,
}

/// Make a picture of a map, or a series of pictures, without an engine or a display
///
/// Files are written atomically. Exit code: 0, 2 if the map cannot be read, or 1 for other errors.
///
/// Examples: relight render oa_dm1 -o oa_dm1.png; relight render my.bsp --spawn 2 --look classic -o spawn.png;
/// relight render oa_dm1 --view 100,-50,80,90,10 --spp 256 --size 640x480 -o view.png;
/// relight render oa_dm1 --spp 64 --denoise oidn -o clean.png;
/// relight render oa_dm1 --path flight.txt --frames 120 --spp 16 -o flight.png (flight_0000.png, flight_0001.png, …)
#[derive(Args, Debug)]
pub struct RenderArgs {
    #[command(flatten)]
    chosen: ChosenMap,
    /// Output file (PNG, or JPEG by the ending .jpg)
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Look of the picture; default: traced, and classic with --overview
    #[arg(long, value_enum)]
    look: Option<Look>,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    #[command(flatten)]
    place: ChosenCamera,
    /// View of the whole map from above one of its corners; classic by default. The traced look moves the camera
    /// forward to the first position inside the map, below the sky
    #[arg(long, conflicts_with_all = ["view", "spawn"])]
    overview: bool,
    /// Horizontal field of view, degrees, from 1 to 170
    #[arg(long, default_value_t = 90.0, value_parser = numbers::fov)]
    fov: f32,
    /// Frames a picture, each with one sample a pixel; default 64. The classic look draws one, but for --timings,
    /// --frame-times and --stats
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Pictures of a --path, evenly along it; each has --spp frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Motion blur: the part of the time from one picture to the next for which the shutter is open, 0 to 1. The --spp
    /// frames of a picture are spread over it: along the --path before the picture's place, or over a --step. Not with
    /// --denoise, whose guides are sharp
    #[arg(long, value_name = "PART", value_parser = numbers::part, default_value_t = 0.0, conflicts_with_all = ["denoise", "no_accumulation"])]
    shutter: f32,
    /// Light sampling of the traced look
    #[arg(long, value_enum, default_value = "resampled")]
    sampling: Sampling,
    #[arg(long, help = help("rt_candidates"), value_parser = value_of("rt_candidates"), default_value = default("rt_candidates"))]
    candidates: Assignment,
    #[arg(long, help = help("rt_tracer"), value_parser = value_of("rt_tracer"), default_value = default("rt_tracer"))]
    tracer: Assignment,
    #[arg(long, help = help("rt_bounces"), value_parser = value_of("rt_bounces"), default_value = default("rt_bounces"))]
    bounces: Assignment,
    #[arg(long, help = help("rt_exposure"), value_parser = value_of("rt_exposure"), default_value = default("rt_exposure"), allow_negative_numbers = true)]
    exposure: Assignment,
    /// Game time, seconds
    #[arg(long, default_value_t = 0.0, value_parser = numbers::not_negative)]
    time: f32,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Draw each picture by several devices, which share its --spp frames: part of a device's name, or its number, for
    /// each
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', conflicts_with_all = ["device", "no_accumulation", "timings", "frame_times", "stats", "turn"])]
    devices: Vec<String>,
    /// Enable Vulkan's validation layer; any message is an error
    #[arg(long)]
    validate: bool,
    /// Print milliseconds as JSON: of the GPU for each pass (mean over the frames), and of GPU and CPU for a frame
    /// (median, percentiles, worst); the first frames, at most 10, are apart, and the slowest with the pass that was
    /// slow
    #[arg(long)]
    timings: bool,
    /// Write the times of every frame as CSV: milliseconds of GPU, CPU and each pass, and pipelines compiled meanwhile
    #[arg(long, value_name = "FILE")]
    frame_times: Option<PathBuf>,
    /// Print the cost of the last frames as JSON: milliseconds, rays and millions of rays a second for each pass, and
    /// GPU memory by purpose
    #[arg(long)]
    stats: bool,
    /// Camera path, a frame a line, as the console command rt_path records it: with --frames a series of pictures;
    /// without, its frames are drawn in succession, as in a game, and the last one is the picture
    #[arg(long, value_name = "FILE", conflicts_with_all = ["view", "spawn", "overview", "turn"])]
    path: Option<PathBuf>,
    /// Turn the camera by a full turn over the frames, so that they differ
    #[arg(long)]
    turn: bool,
    /// Draw frames as the game does, without accumulation
    #[arg(long)]
    no_accumulation: bool,
    /// Move the camera by this much from frame to frame; the last frame is at the requested view
    #[arg(long, value_parser = parse_step, allow_hyphen_values = true, value_name = "X,Y,Z,YAW")]
    step: Option<[f32; 4]>,
    #[arg(long, help = help("rt_debug"), value_parser = value_of("rt_debug"), default_value = default("rt_debug"))]
    debug: Assignment,
    #[arg(long, help = help("rt_denoiser"), value_parser = value_of("rt_denoiser"), default_value = default("rt_denoiser"))]
    denoiser: Assignment,
    #[command(flatten)]
    denoise: DenoiseArgs,
    /// No temporal antialiasing of frames that do not accumulate
    #[arg(long)]
    no_taa: bool,
    #[arg(long, help = help("rt_scale"), value_parser = value_of("rt_scale"), default_value = default("rt_scale"))]
    render_scale: Assignment,
    /// Depth of field: diameter of the lens and focus distance, units
    #[arg(long, value_parser = parse_lens, value_name = "DIAMETER,DISTANCE")]
    lens: Option<[f32; 2]>,
    #[command(flatten)]
    set: SettingArgs,
}

/// Parses `WIDTHxHEIGHT`.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text
        .split_once('x')
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match parsed {
        Some((w, h)) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok((w, h)),
        _ => Err("a size is WIDTHxHEIGHT, at most 16384 each, for example 1280x720".into()),
    }
}

/// Reads a camera path.
fn read_path(file: &Path) -> anyhow::Result<Vec<PathPoint>> {
    let text = std::fs::read_to_string(file)
        .with_context(|| format!("{}: cannot be read", file.display()))?;
    let points = path::parse(&text).with_context(|| file.display().to_string())?;
    if points.is_empty() {
        bail!("{}: no frame in it", file.display());
    }
    Ok(points)
}

/// Parses `X,Y,Z,YAW`.
fn parse_step(text: &str) -> Result<[f32; 4], String> {
    let step = numbers::list(text).and_then(|step| step.try_into().ok());
    step.ok_or_else(|| "a step is X,Y,Z,YAW, for example 4,0,0,-1".to_owned())
}

/// Parses `DIAMETER,DISTANCE`.
fn parse_lens(text: &str) -> Result<[f32; 2], String> {
    let lens = numbers::list(text).and_then(|lens| lens.try_into().ok());
    lens.filter(|lens: &[f32; 2]| lens.iter().all(|n| *n > 0.0))
        .ok_or_else(|| "a lens is DIAMETER,DISTANCE, numbers above 0, for example 4,200".to_owned())
}

/// A frame: its view, the number of frames after it that join its mean, and the file of the picture after it, if any.
struct Shot {
    def: RefDef,
    joined_by: u32,
    written: Option<PathBuf>,
}

impl Shot {
    /// The view and the file of the picture that ends with this frame.
    fn written(&self) -> Option<(&RefDef, &Path)> {
        Some((&self.def, self.written.as_deref()?))
    }
}

impl RenderArgs {
    /// A renderer on a device.
    fn renderer(&self, device: Option<&String>) -> anyhow::Result<Renderer> {
        let (width, height) = self.size;
        Renderer::new(RendererOptions {
            validation: self.validate,
            device: device.cloned(),
            ..RendererOptions::headless(width, height)
        })
        .context("no picture without a Vulkan device")
    }

    /// An error where several devices cannot share the frames of a picture.
    fn check_devices(&self, settings: &Settings) -> anyhow::Result<()> {
        if self.devices.len() < 2 {
            return Ok(());
        }
        if settings.rt != renderer_vk::Look::Traced
            || !settings.rt_accumulate
            || settings.rt_debug != DebugOutput::None
        {
            bail!(
                "--devices share the mean picture of the traced look: it needs rt_accumulate 1 and rt_debug 0"
            );
        }
        if settings.rt_scale < 1.0 {
            bail!("--devices share pictures of the traced size: they need --render-scale 1");
        }
        if self.shutter == 0.0
            && (self.step.is_some() || self.path.is_some() && self.frames.is_none())
        {
            bail!(
                "--devices share the frames of one view: a --step needs a --shutter, and a --path needs --frames"
            );
        }
        if (self.samples() as usize) < self.devices.len() {
            bail!("--devices share --spp frames: there are more devices than frames");
        }
        Ok(())
    }

    fn look(&self) -> Look {
        let usual = match self.overview {
            true => Look::Classic,
            false => Look::Traced,
        };
        self.look.unwrap_or(usual)
    }

    fn settings(&self) -> Settings {
        let mut settings = Settings {
            rt: match self.look() {
                Look::Classic => renderer_vk::Look::Classic,
                Look::Traced => renderer_vk::Look::Traced,
                Look::Hybrid => renderer_vk::Look::Hybrid,
            },
            rt_accumulate: !self.no_accumulation,
            rt_taa: !self.no_taa,
            rt_dof: self.lens.is_some(),
            rt_num_random_dl: match self.sampling {
                Sampling::Uniform | Sampling::Resampled => 1,
                Sampling::All => 0,
            },
            rt_light_selection: match self.sampling {
                Sampling::Uniform => LightSelection::Uniform,
                Sampling::Resampled | Sampling::All => LightSelection::Resampled,
            },
            ..Settings::full_size()
        };
        if let Some([diameter, distance]) = self.lens {
            settings.rt_aperture = diameter;
            settings.rt_focal_length = distance;
        }
        let options = [
            &self.candidates,
            &self.tracer,
            &self.bounces,
            &self.exposure,
            &self.debug,
            &self.denoiser,
            &self.render_scale,
        ];
        self.set.change(options, settings)
    }

    fn camera(&self, world: &relight::RelitWorld) -> anyhow::Result<Camera> {
        let bsp = &world.bsp;
        if self.overview {
            let camera = Camera::overview(world, self.size, self.fov)
                .context("the map has no triangles to draw")?;
            return Ok(match self.look() {
                Look::Classic | Look::Hybrid => camera,
                // from outside, rays hit the back of the sky instead of the map
                Look::Traced => camera.moved_inside(bsp),
            });
        }
        let chosen = self.place.find(bsp)?;
        let camera = chosen.or_else(|| Camera::of_map(bsp));
        camera.context("the map has no place for a camera; set one with --view")
    }

    /// Whether the costs of frames are wanted, not their picture alone.
    fn measures(&self) -> bool {
        self.timings || self.stats || self.frame_times.is_some()
    }

    /// Number of frames of a picture.
    fn samples(&self) -> u32 {
        match self.look() {
            Look::Traced => self.spp.unwrap_or(64),
            Look::Classic | Look::Hybrid if self.measures() => self.spp.unwrap_or(64),
            Look::Classic | Look::Hybrid => 1,
        }
    }

    /// All frames, in order.
    fn shots(&self, camera: Camera) -> anyhow::Result<Vec<Shot>> {
        let (width, height) = self.size;
        let last = |mut shots: Vec<Shot>| {
            if let Some(shot) = shots.last_mut() {
                shot.written = Some(self.output.clone());
            }
            shots
        };
        if let Some(path) = &self.path {
            let points = read_path(path)?;
            let shot = |point: &PathPoint| Shot {
                def: point.ref_def(width, height),
                joined_by: 0,
                written: None,
            };
            let Some(count) = self.frames else {
                return Ok(last(points.iter().map(shot).collect()));
            };
            // frames of the path from one picture to the next
            let step = (points.len() - 1) as f32 / (count - 1).max(1) as f32;
            let samples = self.samples();
            let mut shots = Vec::new();
            for number in 0..count {
                for sample in 0..samples {
                    let place = (number as f32 - self.before(sample)) * step;
                    let point = path::camera_at(&points, place).context("an empty path")?;
                    shots.push(Shot {
                        def: point.ref_def(width, height),
                        joined_by: self.joined_by(sample),
                        written: (sample + 1 == samples).then(|| self.numbered(number)),
                    });
                }
            }
            return Ok(shots);
        }
        let frames = self.samples();
        let still = RefDef {
            time_ms: (self.time * 1000.0) as i32,
            ..camera.ref_def(self.size, self.fov)
        };
        let frame = |frame: u32| {
            let mut def = still;
            if self.turn {
                let turned = Camera {
                    yaw: camera.yaw + 360.0 * frame as f32 / frames as f32,
                    ..camera
                };
                def.view_axis = turned.axis();
            }
            if let Some([x, y, z, yaw]) = self.step {
                let before = if self.shutter > 0.0 {
                    self.before(frame)
                } else {
                    (frames - 1 - frame) as f32
                };
                def.view_origin -= Vec3::new(x, y, z) * before;
                let turned = Camera {
                    yaw: camera.yaw - yaw * before,
                    ..camera
                };
                def.view_axis = turned.axis();
            }
            Shot {
                def,
                joined_by: self.joined_by(frame),
                written: None,
            }
        };
        Ok(last((0..frames).map(frame).collect()))
    }

    /// Time of a frame of a picture before the end of its exposure, in intervals of pictures. The frames are spread
    /// evenly, the last one at the end.
    fn before(&self, sample: u32) -> f32 {
        self.shutter * (1.0 - (sample + 1) as f32 / self.samples() as f32)
    }

    /// Number of frames after this one of a picture that join the mean, though they show something else.
    fn joined_by(&self, sample: u32) -> u32 {
        if self.shutter > 0.0 && sample == 0 {
            self.samples() - 1
        } else {
            0
        }
    }

    /// File of a picture of a series: the output's name with its number.
    fn numbered(&self, number: u32) -> PathBuf {
        // a path that ends in `..` has no name; writing to it fails
        let stem = self.output.file_stem().unwrap_or_default();
        let extension = self.output.extension().unwrap_or_default();
        let name = format!("{}_{number:04}.{}", stem.display(), extension.display());
        self.output.with_file_name(name)
    }
}

/// Runs the command.
pub fn run(args: &RenderArgs) -> anyhow::Result<()> {
    check_name(&args.output)?;
    if args.frames.is_some() && args.path.is_none() {
        bail!(
            "--frames is the number of pictures of a --path; --spp is the number of frames drawn for one picture"
        );
    }
    if args.shutter > 0.0 && args.frames.is_none() && args.step.is_none() {
        bail!("--shutter blurs what moves: give a --path with --frames, or a --step");
    }
    if args.shutter > 0.0 && args.look() != Look::Traced {
        bail!("--shutter is for the traced look; the others draw a single frame");
    }
    let settings = args.settings();
    args.check_devices(&settings)?;
    let denoiser = args.denoise.filter(&settings)?;
    let (files, map) = args.chosen.open()?;
    let (width, height) = args.size;
    let device = args.devices.first().or(args.device.as_ref());
    let mut renderer = args.renderer(device)?;
    let info = renderer.device_info().clone();
    let (_, entities) = load(&mut renderer, files, &map, &settings)?;
    let camera = match args.path {
        Some(_) => Camera::default(),
        None => args.camera(&renderer.world().context("no map")?.relit)?,
    };
    let shots = args.shots(camera)?;
    let frames = shots.len();
    let bar = ProgressBar::new(frames as u64);
    bar.set_style(ProgressStyle::with_template(
        "{msg} {bar:40} {pos}/{len} frames, {eta} left",
    )?);
    bar.set_message(format!("{map} on {}", info.name));
    let mut timings = Timings::new(&renderer);
    renderer.count_rays(args.stats);
    // standard output has the JSON only
    let json = args.stats || args.timings;
    let pictures: Vec<&[Shot]> = shots.split_inclusive(|s| s.written.is_some()).collect();
    let count = args.devices.len().max(1);
    let draw_parts = |name: &str, index: usize, means: &SyncSender<anyhow::Result<PartMean>>| {
        let mut renderer = args.renderer(Some(&name.to_owned()))?;
        let (files, map) = args.chosen.open()?;
        let (_, entities) = load(&mut renderer, files, &map, &settings)?;
        for picture in &pictures {
            let part = sharing::part(picture.len(), index, count);
            renderer.set_settings(&sharing::of_part(&settings, &part));
            draw_part(&mut renderer, &entities, picture, &part, |_, _| bar.inc(1))?;
            let (mean, frames) = (renderer.read_radiance()?, part.len());
            // the other end is gone where the first device has failed
            if means.send(Ok(PartMean { mean, frames })).is_err() {
                break;
            }
        }
        check_messages(&renderer)
    };
    std::thread::scope(|scope| {
        let others = Others::start(scope, &args.devices, &draw_parts);
        for picture in &pictures {
            let part = sharing::part(picture.len(), 0, count);
            draw_part(
                &mut renderer,
                &entities,
                picture,
                &part,
                |renderer, stats| {
                    timings.add(renderer, stats);
                    bar.inc(1);
                },
            )?;
            let Some((def, path)) = picture.last().and_then(Shot::written) else {
                continue;
            };
            timings.finish(&mut renderer)?;
            if count > 1 {
                others.join(&mut renderer, part.len())?;
                draw(&mut renderer, &entities, def)?;
            }
            if let Some(denoiser) = &denoiser {
                denoiser.apply(&mut renderer, &settings, |renderer| {
                    draw(renderer, &entities, def).map(drop)
                })?;
            }
            let picture = renderer.read_pixels()?;
            write_rgb(path, &picture.rgb, picture.width, picture.height)?;
            if json {
                eprintln!("{}", path.display());
            } else {
                bar.suspend(|| println!("{}", path.display()));
            }
        }
        others.end()
    })?;
    bar.finish_and_clear();
    if let Some(path) = &args.frame_times {
        write_whole(path, timings.csv().as_bytes())?;
    }
    if args.timings || args.frame_times.is_some() {
        timings.lines().iter().for_each(|line| eprintln!("{line}"));
    }
    if args.stats {
        print!("{}", renderer.costs().json());
    }
    if args.timings {
        let mut report = timings.report();
        for (key, value) in [
            ("device", serde_json::json!(info.name)),
            ("map", serde_json::json!(map)),
            ("width", serde_json::json!(width)),
            ("height", serde_json::json!(height)),
            ("frames", serde_json::json!(frames)),
        ] {
            report.insert(key.into(), value);
        }
        println!("{}", serde_json::Value::Object(report));
    }
    check_messages(&renderer)
}

/// Draws a part of a picture's frames; `drawn` is called after each.
fn draw_part(
    renderer: &mut Renderer,
    entities: &[RefEntity],
    picture: &[Shot],
    part: &Range<usize>,
    mut drawn: impl FnMut(&Renderer, &FrameStats),
) -> anyhow::Result<()> {
    let joins = picture.first().is_some_and(|shot| shot.joined_by > 0);
    let shots = picture.get(part.clone()).unwrap_or_default();
    for (number, shot) in shots.iter().enumerate() {
        let stats = draw(renderer, entities, &shot.def)?;
        if joins && number == 0 {
            renderer.join_frames(u32::try_from(shots.len() - 1)?);
        }
        drawn(renderer, &stats);
    }
    Ok(())
}

/// An error if the validation layer has found something.
fn check_messages(renderer: &Renderer) -> anyhow::Result<()> {
    let messages = renderer.validation_messages();
    if let Some(first) = messages.first() {
        bail!(
            "the validation layer has {} messages, the first: {first}",
            messages.len(),
        );
    }
    Ok(())
}
