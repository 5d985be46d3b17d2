//! The console command `report`: what the developers ask for when something is wrong.

use crate::cvars::Cvars;
use crate::engine::Engine;
use crate::failure::Failure;
use crate::logging;
use crate::session::Front;
use renderer_vk::Renderer;
use renderer_vk::report::{Report, ReportError};

/// The archive. Its picture is the last one on the screen, if there was one.
///
/// # Errors
/// The device was lost, or is out of memory. The inner error: the archive could not be made.
pub fn zip(
    engine: Engine,
    renderer: &mut Renderer,
    front: &Front,
) -> Result<Result<Vec<u8>, ReportError>, Failure> {
    let mut pictures = Vec::new();
    if front.has_picture {
        let picture = renderer.read_pixels().map_err(Failure::from)?;
        pictures.push(("picture".to_owned(), picture));
    }
    let name = engine.front_end().map_or("unknown", |front| front.name);
    let version = engine.cvar_text(c"version");
    let map = renderer.world_name().unwrap_or("none");
    let game = engine.cvar_text(c"fs_game");
    let about = vec![
        format!("engine: {version}, tables of {name}"),
        format!("map: {map}, fs_game \"{game}\""),
        format!("window: {}x{}", front.size.0, front.size.1),
        format!("r_lowLatency: {}", renderer.latency_method()),
    ];
    let report = Report {
        about,
        device: Some((renderer.device_info(), &renderer.costs())),
        settings: front.cvars.as_ref().map(Cvars::texts).unwrap_or_default(),
        log: &logging::newest(),
        pictures: &pictures,
    };
    Ok(report.zip())
}
