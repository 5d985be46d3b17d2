//! `relight report`: what the developers ask for when something is wrong, as one file.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::Args;
use relight::GameFiles;
use renderer_vk::api::{Picture, RefDef};
use renderer_vk::report::Report;
use renderer_vk::{Costs, Look, Renderer, RendererOptions, Settings};

use crate::game::Game;
use crate::messages;
use crate::pictures::write_whole;
use crate::view::{Camera, draw, load, open};

/// Size of the pictures.
const SIZE: (u32, u32) = (640, 360);
/// Frames of each look: enough for GPU times, which arrive a few frames late, and for a filtered picture.
const FRAMES: i32 = 8;
/// Time of the game between two of them, milliseconds.
const FRAME_MS: i32 = 16;

/// Make one file to send with a question: device, driver, versions, GPU times, messages and two pictures
///
/// Nothing personal is in it: home folders and the names of user and computer are removed. In the game, the console
/// command `report` makes the same of the moment, in the game's folder under reports/.
///
/// Examples: relight report; relight report oa_dm1 -o oa_dm1.zip
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// The map: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) with one map, or pack.pk3:maps/x.bsp;
    /// otherwise the built-in sample
    map: Option<String>,
    #[command(flatten)]
    game: Game,
    /// The file
    #[arg(short, long, value_name = "PATH", default_value = "relight-report.zip")]
    output: PathBuf,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
}

/// Writes the file.
///
/// # Errors
/// The map cannot be read, the device is lost, or the file cannot be written.
pub fn run(args: &ReportArgs) -> Result<()> {
    let zip = args
        .output
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("zip"));
    if !zip {
        bail!("{}: reports are .zip", args.output.display());
    }
    let (files, map) = match &args.map {
        Some(map) => open(map, &args.game)?,
        None => (
            Arc::new(relight::sample::Sample::Hall.files()?) as Arc<dyn GameFiles>,
            relight::sample::Sample::Hall.map().to_owned(),
        ),
    };
    let mut about = vec![format!("map: {map}")];
    let renderer = Renderer::new(RendererOptions {
        device: args.device.clone(),
        ..RendererOptions::headless(SIZE.0, SIZE.1)
    });
    let drawn = match renderer {
        Ok(renderer) => Some(Drawn::new(renderer, files, &map)?),
        // That may be what the question is about.
        Err(error) => {
            eprintln!("{error}: the report has no pictures");
            about.push(error.to_string());
            None
        }
    };
    let report = Report {
        about,
        device: drawn
            .as_ref()
            .map(|drawn| (drawn.renderer.device_info(), &drawn.costs)),
        settings: drawn
            .as_ref()
            .map(|drawn| drawn.settings.clone())
            .unwrap_or_default(),
        log: &messages::kept(),
        pictures: drawn.as_ref().map_or(&[], |drawn| &drawn.pictures),
    };
    write_whole(&args.output, &report.zip()?)?;
    println!(
        "{}: send this file with your question",
        args.output.display()
    );
    Ok(())
}

/// Pictures of a map in both looks, and what they cost.
struct Drawn {
    renderer: Renderer,
    costs: Costs,
    settings: HashMap<&'static str, String>,
    pictures: Vec<(String, Picture)>,
}

impl Drawn {
    fn new(mut renderer: Renderer, files: Arc<dyn GameFiles>, map: &str) -> Result<Self> {
        let mut settings = Settings::full_size();
        let (bsp, entities) = load(&mut renderer, files, map, &settings)?;
        let camera = Camera::of_map(&bsp).context("the map has no place for a camera")?;
        let mut pictures = Vec::new();
        for look in [Look::Classic, Look::Traced] {
            settings.rt = look;
            renderer.set_settings(&settings);
            for frame in 0..FRAMES {
                let def = RefDef {
                    time_ms: frame * FRAME_MS,
                    ..camera.ref_def(SIZE, 90.0)
                };
                draw(&mut renderer, &entities, &def)?;
                renderer.timings();
            }
            pictures.push((look.name().to_owned(), renderer.read_pixels()?));
        }
        let changed = [("r_rt", settings.rt as u32), ("r_picmip", settings.picmip)];
        Ok(Self {
            costs: renderer.costs(),
            settings: changed
                .map(|(name, value): (_, u32)| (name, value.to_string()))
                .into(),
            pictures,
            renderer,
        })
    }
}
