//! `rt_benchmark`: the command, and its results between the frames of the game.

use super::{map_base_name, path_file};
use crate::benchmark::{Benchmark, Report, Step, fly_through, is_demo_name};
use crate::boundary::entry;
use crate::capture::free_path;
use crate::delivery::Outbox;
use crate::engine::{self, Engine, valid_game_path};
use crate::failure::Failure;
use crate::panel::Panel;
use crate::session::{Front, with_renderer};
use relight::viewpoints;
use renderer_vk::path::{self, PathPoint};
use renderer_vk::{Costs, Look, PassCost, Renderer};
use std::ffi::CString;
use std::time::{Duration, Instant};

/// Frames of a path are drawn for this long until the game gets a frame.
const WITHOUT_GAME: Duration = Duration::from_secs(1);

/// A benchmark prevents what would change its result.
pub const IN_PROGRESS: &str = "a benchmark is measuring; rt_benchmark stop ends it";

const USAGE: &str = "usage: rt_benchmark [NAME of a path of rt_path | demo NAME | stop]";

/// What the command's words request.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Order {
    FlyThrough,
    Path(String),
    Demo(String),
    Stop,
}

impl Order {
    /// From the words after the command; `None`: anything else.
    fn of(words: &[String]) -> Option<Self> {
        match words {
            [] => Some(Self::FlyThrough),
            [stop] if stop.eq_ignore_ascii_case("stop") => Some(Self::Stop),
            [demo] if demo.eq_ignore_ascii_case("demo") => None,
            [demo, name] if demo.eq_ignore_ascii_case("demo") => Some(Self::Demo(name.clone())),
            [name] => Some(Self::Path(name.clone())),
            _ => None,
        }
    }
}

/// The command.
pub(super) unsafe extern "C" fn run() {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(());
        };
        let words = engine.arguments();
        // The first argument is the name of the command.
        let line = match Order::of(words.get(1..).unwrap_or_default()) {
            None => USAGE.to_owned(),
            Some(Order::Stop) => stop()?,
            Some(Order::Demo(name)) => begin_demo(engine, &name)?,
            Some(Order::Path(name)) => match read_path(engine, &path_file(&name)) {
                Ok(points) => begin_path(&path_file(&name), |_| Some(points))?,
                Err(reason) => format!("rt_benchmark: {reason}"),
            },
            Some(Order::FlyThrough) => begin_path("fly-through", fly_through_of)?,
        };
        engine.say(&format!("{line}\n"));
        Ok(())
    });
}

fn stop() -> Result<String, Failure> {
    with_renderer(|_, front| {
        Ok(match front.benchmark.take() {
            Some(_) => "benchmark: stopped; nothing was written".to_owned(),
            None => "rt_benchmark: none is measuring".to_owned(),
        })
    })
}

/// A path of `rt_path`; otherwise what is wrong and what to do.
fn read_path(engine: Engine, file: &str) -> Result<Vec<PathPoint>, String> {
    let name = valid_game_path(file).ok_or_else(|| format!("{file}: the name is too long"))?;
    let Some(bytes) = engine.read_file(&name) else {
        return Err(match engine.home_file_exists(&name) {
            true => format!(
                "the game may not read {file} on a pure server: set sv_pure 0 and start the map again"
            ),
            false => format!("there is no {file}: rt_path NAME records one"),
        });
    };
    let points =
        path::parse(&String::from_utf8_lossy(&bytes)).map_err(|e| format!("{file}: {e}"))?;
    match points.is_empty() {
        true => Err(format!("{file} has no frames: rt_path NAME records some")),
        false => Ok(points),
    }
}

/// The flight through the loaded map.
fn fly_through_of(renderer: &Renderer) -> Option<Vec<PathPoint>> {
    let bsp = &renderer.world()?.relit.bsp;
    let entities = bsp.entities();
    let spawns: Vec<_> = viewpoints::spawn_views(&entities).collect();
    let all = viewpoints::intermission(&entities).filter(|_| spawns.is_empty());
    let bounds = bsp.models.first().map(|world| [world.mins, world.maxs]);
    let views = spawns.into_iter().chain(all);
    Some(fly_through(views, bounds.unwrap_or_default()))
}

/// Why no benchmark can begin, in words for the player.
fn obstacle(front: &Front) -> Option<&'static str> {
    let settings = &front.settings;
    if front.benchmark.is_some() {
        Some(IN_PROGRESS)
    } else if front.captures.still.is_some() {
        Some("rt_screenshot is drawing: wait until it has written its picture")
    } else if matches!(front.panel, Some(Panel::Photo(_))) {
        Some("photo mode keeps the picture still: give rt_photo to end it first")
    } else if settings.rt == Look::Traced && settings.rt_pause {
        Some("rt_pause keeps the picture still: set rt_pause 0 first")
    } else if settings.no_refresh || settings.skip_back_end {
        Some("nothing is drawn: set r_norefresh 0 and r_skipBackEnd 0 first")
    } else {
        None
    }
}

/// Begins to measure a path; returns a line for the player.
fn begin_path(
    route: &str,
    points: impl FnOnce(&Renderer) -> Option<Vec<PathPoint>>,
) -> Result<String, Failure> {
    with_renderer(|renderer, front| {
        if let Some(reason) = obstacle(front) {
            return Ok(format!("rt_benchmark: {reason}"));
        }
        let points = points(renderer).filter(|_| renderer.world().is_some());
        let Some(benchmark) = points.and_then(|points| Benchmark::path(route, points)) else {
            return Ok(
                "rt_benchmark: start a map first, or measure a demo: rt_benchmark demo NAME"
                    .to_owned(),
            );
        };
        let frames = benchmark.length().unwrap_or_default();
        begin(renderer, front, benchmark);
        Ok(format!(
            "benchmark: {frames} frames; rt_benchmark stop ends it"
        ))
    })
}

/// Has the game play a demo, and measures it; returns a line for the player.
fn begin_demo(engine: Engine, name: &str) -> Result<String, Failure> {
    if !is_demo_name(name) {
        return Ok(
            "rt_benchmark demo: a name has letters, digits and the characters _ - / . only"
                .to_owned(),
        );
    }
    let (line, begun) = with_renderer(|renderer, front| {
        if let Some(reason) = obstacle(front) {
            return Ok((format!("rt_benchmark: {reason}"), false));
        }
        begin(renderer, front, Benchmark::demo(name));
        let line = format!("benchmark: measuring demo {name}; rt_benchmark stop ends it");
        Ok((line, true))
    })?;
    if let (true, Ok(command)) = (begun, CString::new(format!("demo {name}\n"))) {
        // before what a configuration file has after this command
        engine.insert_command(&command);
    }
    Ok(line)
}

fn begin(renderer: &Renderer, front: &mut Front, benchmark: Benchmark) {
    // the first call enables timing of passes
    renderer.timings();
    front.trial = None;
    front.benchmark = Some(benchmark);
}

/// Passes of the newest finished frame.
fn passes(renderer: &Renderer) -> Vec<PassCost> {
    Costs::passes(&renderer.timings(), |_| None)
}

/// After a frame of the game: draws frames of the path, and ends the benchmark when it has measured all.
pub fn go_on(
    renderer: &mut Renderer,
    front: &mut Front,
    outbox: &mut Outbox,
) -> Result<(), Failure> {
    let Some(benchmark) = &mut front.benchmark else {
        return Ok(());
    };
    let begun = Instant::now();
    let mut step = benchmark.game_frame(begun, || passes(renderer));
    let (width, height) = renderer.size();
    while matches!(step, Step::GoesOn | Step::Says(_))
        && begun.elapsed() < WITHOUT_GAME
        && let Some(point) = benchmark.next()
    {
        renderer.begin_frame(point.time_ms);
        let drawn = renderer.render_scene(&point.ref_def(width, height));
        drawn.and_then(|()| renderer.end_frame())?;
        step = benchmark.path_frame(Instant::now(), || passes(renderer));
        if let Step::Says(line) = &step {
            outbox.lines.push(line.clone());
        }
    }
    benchmark.game_goes_on();
    finish(renderer, front, step, outbox);
    Ok(())
}

/// The game ends its registration; `back`: it may load another map.
pub fn unload(renderer: &Renderer, front: &mut Front, back: bool, outbox: &mut Outbox) {
    if let Some(benchmark) = &mut front.benchmark {
        let step = benchmark.unload(back);
        finish(renderer, front, step, outbox);
    }
}

/// Writes the result of a benchmark that ended.
fn finish(renderer: &Renderer, front: &mut Front, step: Step, outbox: &mut Outbox) {
    let reason = match step {
        Step::GoesOn | Step::Says(_) => return,
        Step::GivesUp(reason) => Some(reason),
        Step::Ends => None,
    };
    let Some(benchmark) = front.benchmark.take() else {
        return;
    };
    if let Some(reason) = reason {
        outbox.lines.push(reason);
        return;
    }
    let map = map_base_name(renderer.world_name().unwrap_or("none"));
    let costs = renderer.costs();
    let report = Report::new(
        (map, benchmark.route()),
        &front.settings,
        (&renderer.device_info().driver, &costs),
        benchmark.samples(),
    );
    let exists = |path: &str| engine::current().is_some_and(|engine| engine.home_has(path));
    match free_path(&file_stem(map), "json", &mut 0, exists) {
        Some(path) => outbox.files.push((path, report.json().into_bytes(), false)),
        None => (outbox.lines).push("rt_benchmark: all 10000 file names are taken".to_owned()),
    }
    outbox.lines.push(report.line());
}

/// The beginning of a result's file name, which the engine writes to whatever the map's name is.
fn file_stem(map: &str) -> String {
    let plain = |c: char| match c {
        'a'..='z' | 'A'..='Z' | '0'..='9' | '_' | '-' => c,
        _ => '_',
    };
    // with a number and an ending within the limit of game paths
    let name: String = map.chars().take(32).map(plain).collect();
    format!("relight/benchmark-{name}-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::valid_path_to_write;

    #[test]
    fn words_say_what_to_measure() {
        let of = |words: &[&str]| {
            let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
            Order::of(&words)
        };
        assert_eq!(of(&[]), Some(Order::FlyThrough));
        assert_eq!(of(&["STOP"]), Some(Order::Stop));
        assert_eq!(of(&["a"]), Some(Order::Path("a".into())));
        assert_eq!(of(&["demo", "a"]), Some(Order::Demo("a".into())));
        for bad in [&["demo"][..], &["a", "b"], &["demo", "a", "b"]] {
            assert_eq!(of(bad), None, "{bad:?}");
        }
    }

    #[test]
    fn results_of_any_map_have_a_name_that_can_be_written() {
        assert_eq!(file_stem("oa_dm1"), "relight/benchmark-oa_dm1-");
        for map in ["", "..", "a::b", "ä b", &"long".repeat(30)] {
            let path = format!("{}9999.json", file_stem(map));
            assert!(valid_path_to_write(&path).is_some(), "{path}");
        }
    }
}
