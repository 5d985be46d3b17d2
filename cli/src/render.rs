//! `relight render`: a picture of a map, without an engine and without a display.

use std::path::PathBuf;
use std::sync::Arc;

use crate::timings::Timings;
use crate::view::{Camera, map_entities, open};
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use relight::GameFiles;
use renderer_vk::api::RefDef;
use renderer_vk::path::{self, PathPoint};
use renderer_vk::{Renderer, RendererOptions, Settings, TracerChoice};

/// How the picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Look {
    /// As the engine's own renderer draws it.
    Classic,
    /// Ray traced.
    Traced,
}

/// How traced light chooses lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Sampling {
    /// One light of the cluster's list, all with the same probability.
    Uniform,
    /// One light by resampled importance.
    Resampled,
    /// Every light of the list.
    All,
}

/// What follows the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Tracer {
    /// The best for the device.
    Auto,
    /// Ray tracing pipelines.
    Pipeline,
    /// Ray queries in compute shaders.
    Query,
    /// A hierarchy of our own in compute shaders.
    Compute,
}

/// Make a picture of a map, without an engine or a display
///
/// Example: relight render --game /usr/share/games/openarena/baseoa oa_dm1 -o oa_dm1.png
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// The map: a name (oa_dm1), maps/oa_dm1.bsp, or a .bsp or .pk3 file
    #[arg(required_unless_present = "sample")]
    map: Option<String>,
    /// Render the built-in sample map
    #[arg(long, conflicts_with = "map")]
    sample: bool,
    /// Game folder with pk3s; may be given more than once, the last has precedence
    #[arg(long, value_name = "DIR")]
    game: Vec<PathBuf>,
    /// Where the picture goes (PNG)
    #[arg(short, long)]
    output: PathBuf,
    /// How the picture is made
    #[arg(long, value_enum, default_value = "traced")]
    look: Look,
    /// Size in pixels
    #[arg(long, default_value = "1280x720", value_parser = parse_size)]
    size: (u32, u32),
    /// Camera: X Y Z YAW PITCH; default: the map's intermission or first spawn point
    #[arg(long, num_args = 4..=5, allow_negative_numbers = true, value_names = ["X", "Y", "Z", "YAW", "PITCH"])]
    camera: Option<Vec<f32>>,
    /// Horizontal field of view, degrees
    #[arg(long, default_value_t = 90.0)]
    fov: f32,
    /// Frames accumulated by the traced look
    #[arg(long, default_value_t = 64)]
    frames: u32,
    /// How traced light chooses lights
    #[arg(long, value_enum, default_value = "resampled")]
    sampling: Sampling,
    /// Lights looked at for each one that is chosen
    #[arg(long, default_value_t = Settings::default().rt_candidates)]
    candidates: u32,
    /// What follows the rays
    #[arg(long, value_enum, default_value = "auto")]
    tracer: Tracer,
    /// Diffuse bounces of the traced look
    #[arg(long, default_value_t = 1)]
    bounces: u32,
    /// Exposure in stops, on top of automatic exposure
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Game time, seconds
    #[arg(long, default_value_t = 0.0)]
    time: f32,
    /// Vulkan device: part of its name
    #[arg(long)]
    device: Option<String>,
    /// Switch Vulkan's validation layer on; any message is an error
    #[arg(long)]
    validate: bool,
    /// Print milliseconds as JSON: of the GPU for each pass (the mean over the frames), and of GPU and CPU for a frame
    #[arg(long)]
    timings: bool,
    /// Print what the last frames cost as JSON: milliseconds, rays and millions of rays a second of each pass, and bytes
    /// of GPU memory by purpose
    #[arg(long)]
    stats: bool,
    /// Camera path, a frame a line, as the console command rt_path records it; in place of --camera and --frames
    #[arg(long, value_name = "FILE", conflicts_with_all = ["camera", "turn"])]
    path: Option<PathBuf>,
    /// Turn the camera once round over the frames, so that they show different things
    #[arg(long)]
    turn: bool,
    /// Measure frames as a game would send them: nothing accumulates
    #[arg(long)]
    no_accumulation: bool,
    /// Move the camera by this much from frame to frame, so that the last frame is where it was asked for
    #[arg(long, num_args = 4, allow_negative_numbers = true, value_names = ["X", "Y", "Z", "YAW"])]
    step: Option<Vec<f32>>,
    /// Look into a step of the traced look: the numbers of the console variable rt_debug
    #[arg(long, default_value_t = 0)]
    debug: u32,
    /// Filter of frames that do not accumulate: 0 none, 1 A-SVGF, 2 sparse
    #[arg(long, default_value_t = 1)]
    denoiser: u32,
    /// No temporal antialiasing of frames that do not accumulate
    #[arg(long)]
    no_taa: bool,
    /// Width and height that are traced over those of the picture, 0.25 to 1, for frames that do not accumulate
    #[arg(long, default_value_t = 1.0)]
    scale: f32,
    /// Depth of field: diameter of the lens and distance that is sharp, units
    #[arg(long, num_args = 2, value_names = ["DIAMETER", "DISTANCE"])]
    lens: Option<Vec<f32>>,
}

/// `WIDTHxHEIGHT`.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text
        .split_once('x')
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match parsed {
        Some((w, h)) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok((w, h)),
        _ => Err("a size is WIDTHxHEIGHT, at most 16384 each, for example 1280x720".into()),
    }
}

/// The frames of a camera path.
fn read_path(file: &std::path::Path) -> anyhow::Result<Vec<PathPoint>> {
    let text = std::fs::read_to_string(file)
        .with_context(|| format!("{}: cannot be read", file.display()))?;
    let points = path::parse(&text).with_context(|| file.display().to_string())?;
    if points.is_empty() {
        bail!("{}: no frame in it", file.display());
    }
    Ok(points)
}

/// Runs the command.
pub fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let (files, map) = if args.sample {
        (
            Arc::new(relight::sample::files()?) as Arc<dyn GameFiles>,
            relight::sample::MAP.to_owned(),
        )
    } else {
        open(args.map.as_deref().unwrap_or_default(), &args.game)?
    };
    let (width, height) = args.size;
    let mut renderer = Renderer::new(RendererOptions {
        width,
        height,
        window: None,
        validation: args.validate,
        device: args.device.clone(),
        vsync: false,
        pipeline_cache: None,
    })
    .context("no picture without a Vulkan device")?;
    let info = renderer.device_info().clone();
    let mut settings = Settings {
        rt: args.look == Look::Traced,
        rt_accumulate: !args.no_accumulation,
        rt_bounces: args.bounces,
        rt_candidates: args.candidates.max(1),
        rt_tracer: match args.tracer {
            Tracer::Auto => TracerChoice::Auto,
            Tracer::Pipeline => TracerChoice::Pipeline,
            Tracer::Query => TracerChoice::Query,
            Tracer::Compute => TracerChoice::Compute,
        },
        rt_debug: args.debug,
        rt_exposure: args.exposure,
        rt_denoiser: args.denoiser,
        rt_taa: !args.no_taa,
        rt_scale: args.scale,
        rt_dof: args.lens.is_some(),
        rt_num_random_dl: match args.sampling {
            Sampling::Uniform | Sampling::Resampled => 1,
            Sampling::All => 0,
        },
        rt_light_selection: match args.sampling {
            Sampling::Uniform => renderer_vk::LightSelection::Uniform,
            Sampling::Resampled | Sampling::All => renderer_vk::LightSelection::Resampled,
        },
        ..Settings::default()
    };
    if let Some([diameter, distance]) = args.lens.as_deref() {
        settings.rt_aperture = *diameter;
        settings.rt_focal_length = *distance;
    }
    renderer.begin_registration(files, &settings)?;
    renderer.load_world(&map)?;
    renderer.end_registration();

    let bsp = renderer
        .world()
        .map(|w| w.relit.bsp.clone())
        .context("no map")?;
    let entities = map_entities(&mut renderer, &bsp);
    let camera = match args.camera.as_deref() {
        Some([x, y, z, yaw, rest @ ..]) => Camera {
            origin: Vec3::new(*x, *y, *z),
            yaw: *yaw,
            pitch: rest.first().copied().unwrap_or(0.0),
        },
        _ => Camera::of_map(&bsp)
            .context("the map has no place to look from; give one with --camera")?,
    };
    let def = RefDef {
        time_ms: (args.time * 1000.0) as i32,
        ..camera.ref_def(args.size, args.fov)
    };

    let points = args.path.as_deref().map(read_path).transpose()?;
    let frames = match &points {
        Some(points) => u32::try_from(points.len())?,
        None if args.look == Look::Traced || args.timings || args.stats => args.frames.max(1),
        None => 1,
    };
    let bar = ProgressBar::new(frames.into());
    bar.set_style(ProgressStyle::with_template(
        "{msg} {bar:40} {pos}/{len} frames, {eta} left",
    )?);
    bar.set_message(format!("{map} on {}", info.name));
    let mut timings = Timings::default();
    renderer.count_rays(args.stats);
    for frame in 0..frames {
        let mut def = def;
        if args.turn {
            let turned = Camera {
                yaw: camera.yaw + 360.0 * frame as f32 / frames as f32,
                ..camera
            };
            def.view_axis = turned.axis();
        }
        if let Some([x, y, z, yaw]) = args.step.as_deref() {
            let before = (frames - 1 - frame) as f32;
            def.view_origin -= Vec3::new(*x, *y, *z) * before;
            let turned = Camera {
                yaw: camera.yaw - yaw * before,
                ..camera
            };
            def.view_axis = turned.axis();
        }
        if let Some(point) = points.as_ref().and_then(|p| p.get(frame as usize)) {
            def = point.ref_def(width, height);
        }
        renderer.begin_frame(def.time_ms);
        renderer.clear_scene();
        for entity in &entities {
            renderer.add_entity(entity);
        }
        renderer.render_scene(&def)?;
        let stats = renderer.end_frame()?;
        timings.add(&renderer.timings(), &stats);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let costs = args.stats.then(|| renderer.costs());
    let picture = renderer.read_pixels()?;
    image::save_buffer(
        &args.output,
        &picture.rgb,
        picture.width,
        picture.height,
        image::ColorType::Rgb8,
    )
    .with_context(|| format!("{}: cannot be written", args.output.display()))?;
    println!("{}", args.output.display());
    if let Some(costs) = costs {
        print!("{}", costs.json());
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
    let messages = renderer.validation_messages();
    if !messages.is_empty() {
        bail!(
            "the validation layer has {} messages, the first: {}",
            messages.len(),
            messages[0]
        );
    }
    Ok(())
}
