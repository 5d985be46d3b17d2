//! `relight render`: a picture of a map, without an engine and without a display.

use std::path::PathBuf;
use std::sync::Arc;

use crate::timings::Timings;
use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use relight::{FileError, GameFiles, MemoryFiles, Pk3, SearchPath};
use renderer_vk::api::{EntityKind, RefDef, RefEntity};
use renderer_vk::{Renderer, RendererOptions, Settings};

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
    /// Turn the camera once round over the frames, so that they show different things
    #[arg(long)]
    turn: bool,
    /// Measure frames as a game would send them: nothing accumulates
    #[arg(long)]
    no_accumulation: bool,
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text
        .split_once('x')
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match parsed {
        Some((w, h)) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok((w, h)),
        _ => Err("a size is WIDTHxHEIGHT, at most 16384 each, for example 1280x720".into()),
    }
}

/// A loose file over a game's files.
struct Layered {
    front: MemoryFiles,
    back: SearchPath,
}

impl GameFiles for Layered {
    fn read(&self, path: &str) -> Result<Option<Vec<u8>>, FileError> {
        match self.front.read(path)? {
            Some(bytes) => Ok(Some(bytes)),
            None => self.back.read(path),
        }
    }

    fn list(&self, dir: &str, extension: &str) -> Vec<String> {
        self.back.list(dir, extension)
    }

    fn exists(&self, path: &str) -> bool {
        self.front.exists(path) || self.back.exists(path)
    }
}

/// Where the game's files and the map come from.
fn open(args: &RenderArgs) -> anyhow::Result<(Arc<dyn GameFiles>, String)> {
    if args.sample {
        return Ok((
            Arc::new(relight::sample::files()?),
            relight::sample::MAP.into(),
        ));
    }
    let mut path = SearchPath::open(&args.game)?;
    let map = args.map.clone().unwrap_or_default();
    let file = PathBuf::from(&map);
    let name = match file.extension().and_then(|e| e.to_str()) {
        Some("pk3") if file.is_file() => {
            let pack = Pk3::open(&file)?;
            let maps = pack.list("maps", ".bsp");
            path.add_pk3(&file)?;
            match maps.as_slice() {
                [one] => format!("maps/{one}"),
                [] => bail!("{map}: no map in it"),
                many => bail!(
                    "{map}: several maps in it ({}); name one and give the pack's folder with --game",
                    many.join(", ")
                ),
            }
        }
        Some("bsp") if file.is_file() => {
            let stem = file.file_stem().and_then(|s| s.to_str()).unwrap_or("map");
            let name = format!("maps/{stem}.bsp");
            let mut front = MemoryFiles::new();
            front.insert(
                &name,
                std::fs::read(&file).with_context(|| format!("{map}: cannot be read"))?,
            )?;
            return Ok((Arc::new(Layered { front, back: path }), name));
        }
        _ if map.starts_with("maps/") => map,
        _ => format!("maps/{map}.bsp"),
    };
    Ok((Arc::new(path), name))
}

/// A place to look from.
#[derive(Clone, Copy, Debug)]
struct Camera {
    origin: Vec3,
    yaw: f32,
    pitch: f32,
}

impl Camera {
    /// Forward, left, up.
    fn axis(&self) -> [Vec3; 3] {
        let (sy, cy) = self.yaw.to_radians().sin_cos();
        let (sp, cp) = self.pitch.to_radians().sin_cos();
        [
            Vec3::new(cp * cy, cp * sy, -sp),
            Vec3::new(-sy, cy, 0.0),
            Vec3::new(sp * cy, sp * sy, cp),
        ]
    }

    /// The intermission's view, or that of the first spawn point, eyes 26 units above it.
    fn of_map(bsp: &q3bsp::Bsp) -> Option<Self> {
        let entities = bsp.entities();
        let find = |class: &str| entities.iter().find(|e| e.classname() == class);
        let number =
            |e: &q3bsp::Entity, key: &str| e.get(key).and_then(|v| v.trim().parse::<f32>().ok());
        if let Some(view) = find("info_player_intermission") {
            let origin = view.vec3("origin")?;
            let target = view.get("target").and_then(|name| {
                entities
                    .iter()
                    .find(|e| e.get("targetname") == Some(name))
                    .and_then(|e| e.vec3("origin"))
            });
            let (mut yaw, mut pitch) = (number(view, "angle").unwrap_or(0.0), 0.0);
            if let Some(angles) = view.vec3("angles") {
                (pitch, yaw) = (angles.x, angles.y);
            }
            if let Some(to) = target.map(|t| t - origin).filter(|to| to.length() > 1.0) {
                yaw = to.y.atan2(to.x).to_degrees();
                pitch = -to.z.atan2(to.truncate().length()).to_degrees();
            }
            return Some(Self { origin, yaw, pitch });
        }
        let spawn = [
            "info_player_deathmatch",
            "info_player_start",
            "team_CTF_redspawn",
            "team_CTF_redplayer",
        ]
        .into_iter()
        .find_map(find)?;
        Some(Self {
            origin: spawn.vec3("origin")? + Vec3::Z * 26.0,
            yaw: number(spawn, "angle").unwrap_or(0.0),
            pitch: 0.0,
        })
    }
}

/// What the game would add to every view: the map's inline models at rest, and the marks of its mirrors.
fn map_entities(renderer: &mut Renderer, bsp: &q3bsp::Bsp) -> Vec<RefEntity> {
    let mut entities = Vec::new();
    let axis = [Vec3::X, Vec3::Y, Vec3::Z];
    for entity in bsp.entities() {
        let origin = entity.vec3("origin").unwrap_or(Vec3::ZERO);
        let base = RefEntity {
            axis,
            origin,
            old_origin: origin,
            shader_rgba: [255; 4],
            ..RefEntity::default()
        };
        match entity.get("model") {
            Some(name) if name.starts_with('*') && name != "*0" => {
                let model = renderer.register_model(name);
                entities.push(RefEntity { model, ..base });
            }
            _ => {}
        }
        // without a target it is a mirror; a camera portal needs the game to turn and move its camera
        if entity.classname() == "misc_portal_surface" && entity.get("target").is_none() {
            entities.push(RefEntity {
                kind: EntityKind::PortalSurface,
                ..base
            });
        }
    }
    entities
}

/// Runs the command.
pub fn run(args: &RenderArgs) -> anyhow::Result<()> {
    let (files, map) = open(args)?;
    let (width, height) = args.size;
    let mut renderer = Renderer::new(RendererOptions {
        width,
        height,
        window: None,
        validation: args.validate,
        device: args.device.clone(),
        vsync: false,
    })
    .context("no picture without a Vulkan device")?;
    let info = renderer.device_info().clone();
    let settings = Settings {
        rt: args.look == Look::Traced,
        rt_accumulate: !args.no_accumulation,
        rt_bounces: args.bounces,
        rt_exposure: args.exposure,
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
    let half = (args.fov.clamp(1.0, 170.0).to_radians() * 0.5).tan();
    let def = RefDef {
        width: width as i32,
        height: height as i32,
        fov_x: args.fov.clamp(1.0, 170.0),
        fov_y: (half * height as f32 / width as f32).atan().to_degrees() * 2.0,
        view_origin: camera.origin,
        view_axis: camera.axis(),
        time_ms: (args.time * 1000.0) as i32,
        ..RefDef::default()
    };

    let frames = if args.look == Look::Traced || args.timings {
        args.frames.max(1)
    } else {
        1
    };
    let bar = ProgressBar::new(frames.into());
    bar.set_style(ProgressStyle::with_template(
        "{msg} {bar:40} {pos}/{len} frames, {eta} left",
    )?);
    bar.set_message(format!("{map} on {}", info.name));
    let mut timings = Timings::default();
    for frame in 0..frames {
        let mut def = def;
        if args.turn {
            let turned = Camera {
                yaw: camera.yaw + 360.0 * frame as f32 / frames as f32,
                ..camera
            };
            def.view_axis = turned.axis();
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
