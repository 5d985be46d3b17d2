//! Plays a recorded camera path through the library, as an engine calls it, and reports the cost of the frames.
//!
//! The path is played twice after some frames that let the driver settle: once for the times, and once with rays
//! counted, because counting them takes time of its own. Nothing is waited for but what the library itself waits for.

mod report;

use std::path::PathBuf;
use std::time::Instant;

use q3bsp::Bsp;
use renderer_vk::path::PathPoint;
use thiserror::Error;

use crate::engine::abi::refEntity_t;
use crate::engine::files::Packs;
use crate::engine::{Engine, LoadError, Options, Raised, View};
pub use report::{PassReport, Report};

/// Enough for [`Play::settling`]: what the map's first frames make, upload and compact is done by then, and histories
/// are full.
pub const SETTLING: usize = 60;

/// Frames from a question to its answer, which the GPU gives when it is done.
const LATENCY: usize = 4;

/// What is to be played.
#[derive(Clone)]
pub struct Play {
    /// The library.
    pub library: PathBuf,
    /// The game's packs.
    pub packs: Packs,
    /// Files above the packs.
    pub files: Vec<(String, Vec<u8>)>,
    /// `maps/NAME.bsp`.
    pub map: String,
    /// The camera, frame by frame.
    pub path: Vec<PathPoint>,
    /// Pixels.
    pub size: [i32; 2],
    /// Whether the traced look is on.
    pub traced: bool,
    /// Whether a window is opened and presented to.
    pub window: bool,
    /// Further console variables, set before the renderer starts.
    pub cvars: Vec<(String, String)>,
    /// Frames at the path's beginning before anything is measured.
    pub settling: usize,
    /// Whether the last frame is wanted.
    pub picture: bool,
}

/// Why nothing was measured.
#[derive(Debug, Error)]
pub enum PlayError {
    /// The library cannot be used.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// It raised an error.
    #[error(transparent)]
    Raised(#[from] Raised),
    /// Nothing to play.
    #[error("the path has no frame")]
    Empty,
    /// The library's report has another format.
    #[error("rt_stats wrote no report that can be read: {0}")]
    Stats(String),
}

/// Plays a path and measures. With [`Play::picture`] the last frame comes with the report.
///
/// # Errors
/// What keeps the library from starting, or the map from loading.
pub fn play(play: &Play) -> Result<(Report, Option<relight::compare::Rgb8>), PlayError> {
    let first = *play.path.first().ok_or(PlayError::Empty)?;
    let [width, height] = play.size;
    let mut cvars: Vec<(String, String)> = [
        ("r_vkValidation", "0".to_string()),
        ("r_headless", u8::from(!play.window).to_string()),
        ("r_customwidth", width.to_string()),
        ("r_customheight", height.to_string()),
        ("r_rt", u8::from(play.traced).to_string()),
        // a path may rest: what accumulates while it does is no frame of a game
        ("rt_accumulate", "0".to_string()),
        ("r_swapInterval", "0".to_string()),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .to_vec();
    cvars.extend(play.cvars.iter().cloned());
    let options = Options {
        cvars,
        files: play.files.clone(),
        packs: play.packs.clone(),
        clock: Some(first.time_ms),
        ..Options::default()
    };
    let mut engine = Engine::start_with(&play.library, options)?;
    engine.start_map(&play.map)?;
    let entities = brush_models(&mut engine, &play.map)?;

    let mut report = Report::new(play);
    for _ in 0..play.settling + LATENCY {
        // passes are timed from the first question on
        engine.command("rt_timings")?;
        frame(&mut engine, play.size, &first, &entities)?;
    }
    engine.take_messages();
    let started = Instant::now();
    for point in &play.path {
        let begun = Instant::now();
        frame(&mut engine, play.size, point, &entities)?;
        report.add_frame(begun.elapsed());
        engine.command("rt_timings")?;
        report.add_times(&engine.take_messages());
    }
    report.set_duration(started.elapsed());
    let rest = std::iter::repeat_n(play.path.last().unwrap_or(&first), LATENCY);
    for point in play.path.iter().chain(rest) {
        engine.command("rt_stats json stats")?;
        frame(&mut engine, play.size, point, &entities)?;
        if let Some(stats) = engine.read_file("stats.json") {
            let error = || PlayError::Stats(String::from_utf8_lossy(&stats).into_owned());
            report.add_stats(&stats).ok_or_else(error)?;
        }
    }
    let picture = match (play.picture, play.path.last()) {
        (true, Some(last)) => {
            let view = view(play.size, last);
            Some(engine.picture_of(|engine| scene(engine, &view, &entities))?)
        }
        _ => None,
    };
    Ok((report, picture))
}

/// One frame as a game makes it.
fn frame(
    engine: &mut Engine,
    size: [i32; 2],
    point: &PathPoint,
    entities: &[refEntity_t],
) -> Result<(), Raised> {
    engine.set_clock(point.time_ms);
    engine.begin_frame(0)?;
    scene(engine, &view(size, point), entities)?;
    engine.end_frame()
}

fn scene(engine: &mut Engine, view: &View, entities: &[refEntity_t]) -> Result<(), Raised> {
    engine.clear_scene()?;
    for entity in entities {
        engine.add_entity(entity)?;
    }
    engine.render_scene(view)
}

fn view([width, height]: [i32; 2], point: &PathPoint) -> View {
    View {
        place: [0; 2],
        origin: point.origin,
        angles: point.angles,
        width,
        height,
        fov: point.fov[0].clamp(1.0, 170.0),
        time: point.time_ms,
        flags: 0,
        text: [""; 8],
    }
}

/// The map's brush models where they rest, and its mirrors: what a game adds in each frame without anybody in it.
fn brush_models(engine: &mut Engine, map: &str) -> Result<Vec<refEntity_t>, Raised> {
    const PORTAL_SURFACE: i32 = 7;
    let Some(bsp) = engine.read_file(map).and_then(|b| Bsp::parse(&b).ok()) else {
        return Ok(Vec::new()); // the library printed the error
    };
    let mut entities = Vec::new();
    for entity in bsp.entities() {
        let origin = entity.vec3("origin").unwrap_or_default().to_array();
        let base = refEntity_t {
            origin,
            oldorigin: origin,
            shaderRGBA: [255; 4],
            ..refEntity_t::default()
        };
        if let Some(name) = entity.get("model").filter(|n| n.starts_with('*')) {
            let model = engine.register_model(name)?;
            entities.push(refEntity_t {
                hModel: model,
                ..base
            });
        }
        // without a target it is a mirror; the camera of any other is turned and moved by the game
        if entity.classname() == "misc_portal_surface" && entity.get("target").is_none() {
            entities.push(refEntity_t {
                reType: PORTAL_SURFACE,
                ..base
            });
        }
    }
    Ok(entities)
}
