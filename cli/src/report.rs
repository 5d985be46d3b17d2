//! `relight report`: what the developers ask for when something is wrong, as one file.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::Args;
use relight::GameFiles;
use renderer_vk::report::Report;
use renderer_vk::{Renderer, RendererOptions, Settings};

use crate::game::Game;
use crate::messages;
use crate::pictures::write_whole;
use crate::view::{Camera, load, open};

/// Size of the pictures.
const SIZE: (u32, u32) = (640, 360);
/// Frames of each look: enough for GPU times, which arrive a few frames late, and for a filtered picture.
const FRAMES: u32 = 8;

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
/// There is no device, the map cannot be read, or the file cannot be written.
pub fn run(args: &ReportArgs) -> Result<()> {
    if !args
        .output
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("zip"))
    {
        bail!("{}: reports are .zip", args.output.display());
    }
    let (files, map) = match &args.map {
        Some(map) => open(map, &args.game)?,
        None => (
            Arc::new(relight::sample::files()?) as Arc<dyn GameFiles>,
            relight::sample::MAP.to_owned(),
        ),
    };
    let mut renderer = Renderer::new(RendererOptions {
        device: args.device.clone(),
        ..RendererOptions::headless(SIZE.0, SIZE.1)
    })
    .context("no report without a Vulkan device")?;
    let mut settings = Settings::full_size();
    let (bsp, entities) = load(&mut renderer, files, &map, &settings)?;
    let camera = Camera::of_map(&bsp).context("the map has no place for a camera")?;
    let mut pictures = Vec::new();
    for (name, traced) in [("classic", false), ("traced", true)] {
        settings.rt = traced;
        renderer.set_settings(&settings);
        for frame in 0..FRAMES {
            let mut def = camera.ref_def(SIZE, 90.0);
            def.time_ms = i32::try_from(frame * 16).unwrap_or(0);
            renderer.begin_frame(def.time_ms);
            renderer.clear_scene();
            for entity in &entities {
                renderer.add_entity(entity);
            }
            renderer.render_scene(&def)?;
            renderer.end_frame()?;
            renderer.timings();
        }
        pictures.push((name.to_owned(), renderer.read_pixels()?));
    }
    let report = Report {
        about: vec![
            format!("relight {}", env!("CARGO_PKG_VERSION")),
            format!(
                "system: {} {}",
                std::env::consts::OS,
                std::env::consts::ARCH
            ),
            format!("map: {map}"),
        ],
        device: renderer.device_info(),
        costs: &renderer.costs(),
        settings: [("r_rt", "1".to_owned()), ("r_picmip", "0".to_owned())].into(),
        log: &messages::kept(),
        pictures: &pictures,
    };
    write_whole(&args.output, &report.zip()?)?;
    println!(
        "{}: send this file with your question",
        args.output.display()
    );
    Ok(())
}
