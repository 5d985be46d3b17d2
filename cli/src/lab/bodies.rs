//! `relight-lab bodies`: cost of the structures of many bodies, with and without the feedback of rays
//! (`rt_hitFeedback`).

mod model;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::Args;
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use relight::Overlay;
use renderer_vk::api::{RefDef, RefEntity};
use renderer_vk::{
    HitFeedback, Look, MapLightChoice, MemoryPurpose, MovingCost, Renderer, RendererOptions,
    Settings, Spread,
};
use serde::Serialize;

use crate::chosen::parse_view;
use crate::game::Game;
use crate::pictures::write_whole;
use crate::render::parse_size;
use crate::settings::SettingArgs;
use crate::timings::Timings;
use crate::view::{Camera, draw, load, map_name, open, placed};

/// Measure the structures of bodies: refits saved by the feedback of rays, milliseconds, bytes, differing pixels
///
/// Spreads made-up bodies over the open space of a map, animated ones of 400 triangles and still ones of 16, and draws
/// the same frames without and with rt_hitFeedback in turns. Prints after each run: refits a part, bodies left out,
/// instances written by the CPU and milliseconds of the structures on the CPU, of the second half of the frames; medians
/// of the structures on the GPU and of whole frames; bytes of the structures; then the frames whose pictures differ, with
/// the number of pixels that do by more than 2 of 255. The camera may turn, so that bodies come into view.
///
/// Examples: relight-lab bodies oa_dm1 --animated 5000; relight-lab bodies kaos2 --still 1000000 --frames 20 --runs 1
#[derive(Args, Debug)]
pub struct BodiesArgs {
    /// Map: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) with one map, or pack.pk3:maps/x.bsp
    #[arg(value_name = "MAP")]
    map: String,
    #[command(flatten)]
    game: Game,
    /// Number of animated bodies; default: 5000, or 0 with --still
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=100_000))]
    animated: Option<u32>,
    /// Number of still bodies
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=4_000_000))]
    still: u32,
    /// Camera: position in units, yaw and pitch (down) in degrees, which may be left out; default: the map's
    /// intermission or first spawn point
    #[arg(long, value_parser = parse_view, allow_hyphen_values = true, value_name = "X,Y,Z,YAW,PITCH")]
    view: Option<Camera>,
    /// Degrees that the camera turns in a frame
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    rotate: f32,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "512x288", value_parser = parse_size)]
    size: (u32, u32),
    /// Frames; the medians leave out the first 10, or half of them if there are fewer than 20
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u32).range(4..))]
    frames: u32,
    /// Number of runs, in which all variants take turns
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Seconds after which frames, runs and the comparison are cut short: at least 4 frames of each variant are drawn
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
    /// Omit the comparison of the pictures
    #[arg(long)]
    no_pictures: bool,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// File for the results as JSON
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    #[command(flatten)]
    set: SettingArgs,
}

/// Field of view of the camera, degrees.
const FOV: f32 = 90.0;

/// Time of a frame, milliseconds of the game.
const FRAME_MS: u32 = 16;

/// Frames after which the feedback has found what rests, with as many that show it.
const SHOWING: u32 = 24;

/// Fewest frames.
const FEWEST: u32 = 4;

/// Passes that build structures and count rays.
const STRUCTURES: [&str; 4] = [
    "trace_accel",
    "trace_instances",
    "trace_scene",
    "trace_feedback",
];

/// Difference of a channel above which pixels differ.
const SAME: u8 = 2;

/// Costs of a run.
#[derive(Debug, Serialize)]
struct Row {
    feedback: bool,
    /// Of the second half of the frames.
    moving: MovingCost,
    /// CPU work for structures in a frame: the mean.
    structures_cpu_ms: f64,
    /// Medians; `None` if the device measures no times.
    structures_gpu_ms: Option<f64>,
    gpu_ms: Option<f64>,
    cpu_ms: Option<f64>,
    structure_bytes: u64,
    shared_bytes: u64,
}

impl Row {
    fn line(&self) -> String {
        let of = |part: u64, of: u64| match of {
            0 => "–".to_owned(),
            _ => format!("{:.4}", part as f64 / of as f64),
        };
        let ms = |ms: Option<f64>| ms.map_or_else(|| "–".to_owned(), |ms| format!("{ms:.3}"));
        let moving = &self.moving;
        format!(
            "| {} | {} | {} | {} | {} | {:.3} | {} | {} | {} | {:.1} | {:.1} |",
            if self.feedback { "with" } else { "without" },
            of(moving.refits, moving.parts + moving.left_out_parts),
            of(moving.unmet, moving.counted),
            of(moving.left_out, moving.bodies),
            of(moving.written, moving.instances),
            self.structures_cpu_ms,
            ms(self.structures_gpu_ms),
            ms(self.gpu_ms),
            ms(self.cpu_ms),
            self.structure_bytes as f64 / 1e6,
            self.shared_bytes as f64 / 1e6,
        )
    }
}

/// A frame whose pictures differ.
#[derive(Debug, Serialize)]
struct Differing {
    frame: u32,
    pixels: usize,
}

/// All results.
#[derive(Debug, Serialize)]
struct Report {
    device: String,
    tracer: Option<String>,
    map: String,
    size: (u32, u32),
    frames: u32,
    animated: usize,
    still: usize,
    rows: Vec<Row>,
    /// `None`: they were not compared.
    differing: Option<Vec<Differing>>,
}

impl Report {
    /// What precedes the rows.
    fn head(&self) -> String {
        let (width, height) = self.size;
        format!(
            "{}, {}, {width}x{height}, {}: {} animated and {} still bodies, {} frames\n\n\
             | feedback | refits a part | parts met by no ray | bodies left out | instances written | structures, CPU ms | structures, GPU ms | frame, GPU ms | frame, CPU ms | structures, MB | shared, MB |\n\
             |---|---|---|---|---|---|---|---|---|---|---|",
            self.device,
            self.tracer.as_deref().unwrap_or("no tracer"),
            self.map,
            self.animated,
            self.still,
            self.frames
        )
    }

    /// What follows them.
    fn tail(&self) -> Option<String> {
        let differing = self.differing.as_ref()?;
        let each: Vec<String> = (differing.iter())
            .map(|d| format!("{}: {}", d.frame, d.pixels))
            .collect();
        Some(format!(
            "\n{} frames differ; frame and pixels: {}",
            each.len(),
            each.join(", ")
        ))
    }
}

/// The map with its bodies, and how it is drawn.
struct Stage<'a> {
    args: &'a BodiesArgs,
    renderer: Renderer,
    entities: Vec<RefEntity>,
    /// Indices of the animated bodies in `entities`.
    animated: std::ops::Range<usize>,
    camera: Camera,
    /// Places of all bodies, once they are known.
    places: Option<Vec<Vec3>>,
    /// Number of frames, once it is known.
    frames: Option<u32>,
    begun: Instant,
    bar: ProgressBar,
}

impl Stage<'_> {
    fn def(&self, frame: u32) -> RefDef {
        let mut camera = self.camera;
        camera.yaw += self.args.rotate * frame as f32;
        let mut def = camera.ref_def(self.args.size, FOV);
        def.time_ms = i32::try_from(frame.saturating_mul(FRAME_MS)).unwrap_or(i32::MAX);
        def
    }

    /// Draws a frame.
    fn draw(&mut self, frame: u32) -> Result<renderer_vk::FrameStats> {
        let bodies = self.entities.get_mut(self.animated.clone());
        for (number, body) in bodies.into_iter().flatten().enumerate() {
            model::animate(body, number, frame as usize);
        }
        let def = self.def(frame);
        self.bar.inc(1);
        draw(&mut self.renderer, &self.entities, &def)
    }

    /// Whether a frame follows so many, the first of which began at `first`. The first run finds how many the time allows: its
    /// frames take a quarter of what loading has left, more if they are few.
    fn goes_on(&mut self, drawn: u32, first: Instant) -> bool {
        let limit = Duration::from_secs(self.args.seconds.into());
        let left = limit.saturating_sub(first - self.begun);
        let share = left.max(limit / 4) / 4;
        let passed = first.elapsed();
        let late = drawn >= SHOWING && passed > share || passed > share * 2;
        let most = self.frames.unwrap_or(match late && drawn >= FEWEST {
            true => drawn,
            false => self.args.frames,
        });
        if drawn >= most {
            self.frames = Some(most);
        }
        drawn < most
    }

    /// Tells where the command is, if no bar shows it.
    fn tell(&self, what: &str) {
        if self.bar.is_hidden() {
            eprintln!("{:.1} s: {what}", self.begun.elapsed().as_secs_f32());
        }
    }

    /// Whether the time allows frames that take as long as those since `begun`.
    fn has_time(&self, begun: Instant) -> bool {
        let limit = Duration::from_secs(self.args.seconds.into());
        self.begun.elapsed() + begun.elapsed() <= limit
    }
}

/// Runs the command.
///
/// # Errors
/// There is no Vulkan device, the map cannot be read or has no open space, or the file cannot be written.
pub fn run(args: &BodiesArgs) -> Result<()> {
    let base = Settings {
        rt: Look::Traced,
        rt_lights: MapLightChoice::Prior,
        ..Settings::full_size()
    };
    let base = args.set.change([], base);
    let variants = [HitFeedback::None, HitFeedback::Acts].map(|rt_hit_feedback| Settings {
        rt_hit_feedback,
        ..base.clone()
    });
    let (width, height) = args.size;
    let options = RendererOptions {
        device: args.device.clone(),
        ..RendererOptions::headless(width, height)
    };
    let renderer = Renderer::new(options).context("nothing to measure without a Vulkan device")?;
    let passes = args.runs + u32::from(!args.no_pictures);
    let bar = ProgressBar::new(u64::from(args.frames) * 2 * u64::from(passes));
    bar.set_style(ProgressStyle::with_template(
        "{bar:30} {pos}/{len} frames, {eta} left",
    )?);
    let mut stage = Stage {
        args,
        renderer,
        entities: Vec::new(),
        animated: 0..0,
        camera: Camera::default(),
        places: None,
        frames: None,
        begun: Instant::now(),
        bar,
    };
    let mut report = Report {
        device: stage.renderer.device_info().name.clone(),
        tracer: None,
        map: map_name(&open(&args.map, &args.game)?.1).to_owned(),
        size: args.size,
        frames: 0,
        animated: 0,
        still: 0,
        rows: Vec::new(),
        differing: None,
    };
    let mut pair = Instant::now();
    for run in 0..args.runs {
        if run > 0 && !stage.has_time(pair) {
            eprintln!("{run} of {} runs: --seconds {}", args.runs, args.seconds);
            break;
        }
        pair = Instant::now();
        for settings in &variants {
            begin(&mut stage, settings)?;
            report.rows.push(measure(&mut stage, settings)?);
            if report.tracer.is_none() {
                report.tracer = stage.renderer.costs().tracer;
                report.frames = stage.frames.unwrap_or(args.frames);
                report.animated = stage.animated.len();
                report.still = stage.entities.len() - stage.animated.end;
                stage.bar.suspend(|| println!("{}", report.head()));
            }
            let row = report.rows.last().map(Row::line).unwrap_or_default();
            stage.bar.suspend(|| println!("{row}"));
        }
    }
    if !args.no_pictures && stage.has_time(pair) {
        report.differing = Some(compare(&mut stage, &variants)?);
    } else if !args.no_pictures {
        eprintln!("pictures were not compared: --seconds {}", args.seconds);
    }
    stage.bar.finish_and_clear();
    (report.tail().iter()).for_each(|tail| println!("{tail}"));
    if let Some(output) = &args.output {
        let json = serde_json::to_string_pretty(&report)? + "\n";
        write_whole(output, json.as_bytes())?;
    }
    Ok(())
}

/// Loads the map and places the bodies.
fn begin(stage: &mut Stage<'_>, settings: &Settings) -> Result<()> {
    let args = stage.args;
    let (files, path) = open(&args.map, &args.game)?;
    let files = Overlay {
        front: model::files()?,
        back: files,
    };
    #[allow(clippy::arc_with_non_send_sync)] // the renderer's interface; one thread uses them
    let files = Arc::new(files);
    let (bsp, entities) = load(&mut stage.renderer, files, &path, settings)?;
    stage.entities = entities;
    let models = [model::ANIMATED, model::STILL].map(|name| stage.renderer.register_model(name));
    let animated = args
        .animated
        .unwrap_or(if args.still > 0 { 0 } else { 5000 });
    let [animated, still] = [animated, args.still].map(|n| n as usize);
    let is_first = stage.places.is_none();
    let places = (stage.places).get_or_insert_with(|| model::places(&bsp, animated + still));
    let first = stage.entities.len();
    let bodies = places.iter().enumerate().map(|(number, place)| {
        let of = usize::from(number >= animated);
        placed(models[of], *place)
    });
    stage.entities.extend(bodies);
    stage.animated = first..first + animated.min(places.len());
    let camera = args.view.or_else(|| Camera::of_map(&bsp));
    stage.camera = camera.context("the map has no place for a camera; set one with --view")?;
    if is_first {
        let bodies = stage.entities.len() - first;
        stage.tell(&format!("{}: {bodies} bodies are placed", args.map));
    }
    Ok(())
}

/// Draws all frames, and returns their cost.
fn measure(stage: &mut Stage<'_>, settings: &Settings) -> Result<Row> {
    let mut timings = Timings::new(&stage.renderer);
    let mut costs = Vec::new();
    let mut first = Instant::now();
    while stage.goes_on(u32::try_from(costs.len())?, first) {
        costs.push(stage.renderer.moving_cost().unwrap_or_default());
        let stats = stage.draw(u32::try_from(costs.len() - 1)?)?;
        timings.add(&stage.renderer, &stats);
        if costs.len() == 1 {
            // the driver compiles for it
            stage.tell("the first frame is drawn");
            first = Instant::now();
        }
    }
    timings.finish(&mut stage.renderer)?;
    // once the feedback has found what rests
    let before = costs.get(costs.len() / 2).copied().unwrap_or_default();
    let median = |spread: Option<Spread>| spread.map(|s| s.median);
    let passes = timings.passes();
    let structures = passes.iter().filter(|(name, _)| STRUCTURES.contains(name));
    let structures = structures.filter_map(|(_, times)| median(Spread::of(times)));
    let moving = stage
        .renderer
        .moving_cost()
        .unwrap_or_default()
        .since(before);
    let costs = stage.renderer.costs();
    let bytes = |purpose| {
        let mut memory = costs.memory.iter();
        memory.find(|m| m.0 == purpose).map_or(0, |m| m.1)
    };
    Ok(Row {
        feedback: settings.rt_hit_feedback != HitFeedback::None,
        moving,
        structures_cpu_ms: moving.cpu_ms / moving.frames.max(1) as f64,
        structures_gpu_ms: timings.gpu().map(|_| structures.sum::<f64>().max(0.0)),
        gpu_ms: median(timings.gpu()),
        cpu_ms: median(timings.cpu()),
        structure_bytes: bytes(MemoryPurpose::AccelerationStructures),
        shared_bytes: bytes(MemoryPurpose::Shared),
    })
}

/// The frames whose pictures differ between both variants.
fn compare(stage: &mut Stage<'_>, variants: &[Settings; 2]) -> Result<Vec<Differing>> {
    let mut without = Vec::new();
    let mut differing = Vec::new();
    for (number, settings) in variants.iter().enumerate() {
        begin(stage, settings)?;
        for frame in 0..stage.frames.unwrap_or(stage.args.frames) {
            stage.draw(frame)?;
            let picture = stage.renderer.read_pixels()?.rgb;
            if number == 0 {
                without.push(picture);
                continue;
            }
            let Some(other) = without.get(frame as usize) else {
                continue;
            };
            let pixels = picture.chunks_exact(3).zip(other.chunks_exact(3));
            let pixels =
                pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > SAME));
            let pixels = pixels.count();
            if pixels > 0 {
                differing.push(Differing { frame, pixels });
            }
        }
    }
    Ok(differing)
}
