//! Plays a short session in the stand-in engine, in a process of its own; see [`tests::layer`].
//!
//! Prints `error: MESSAGE` for each error that returns to the menu, from where the session begins anew, `ended:
//! MESSAGE` if the renderer ends the game, and every message of the renderer. It fails if the renderer broke a rule of
//! the engine or the validation layer found a fault.

#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use relight::compare::Rgb8;
use tests::engine::{Engine, LoadError, Options, Tables, View, has_surfaces};
use tests::maps::{self, HERE, ROOMS};

const USAGE: &str = "usage: session FOLDER [--looks LOOKS] [--frames N] [--costs] [--window] [--set NAME VALUE]...

Plays the map of the tests in the stand-in engine: menu, map, N + 1 frames (default 2) of each look (c: classic, t:
traced; default ct), a restart of the video, the map again. Leaves the pictures in FOLDER. With --costs it prints
`frames: N in MS ms` for each look and what rt_stats prints. With --window it opens a window of SDL; otherwise its window
has a surface without a display.";

/// Errors after which the session begins anew; more mean that it does not recover.
const ERRORS: usize = 3;
/// Frames until rt_stats prints.
const COSTS: u32 = 4;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut rest = arguments.iter().map(String::as_str);
    let Some(folder) = rest.next().map(PathBuf::from) else {
        println!("{USAGE}");
        return ExitCode::FAILURE;
    };
    let mut cvars = Vec::new();
    let (mut looks, mut frames, mut costs, mut tables) = ("ct", 1, false, Tables::Quake3e);
    while let Some(argument) = rest.next() {
        let mut value = || rest.next().unwrap_or_default();
        match argument {
            "--looks" => looks = value(),
            "--frames" => frames = value().parse().unwrap_or(1),
            "--costs" => costs = true,
            "--window" => tables = Tables::Ioquake3,
            "--set" => cvars.push((value().to_owned(), value().to_owned())),
            _ => {
                println!("{USAGE}");
                return ExitCode::FAILURE;
            }
        }
    }
    if tables == Tables::Ioquake3 || has_surfaces() {
        cvars.push(("r_headless".to_owned(), "0".to_owned()));
    }
    let options = Options {
        files: maps::files(),
        tables,
        clock: Some(1000),
        cvars,
        ..Options::default()
    };
    session(&folder, (looks, frames, costs), options)
}

fn session(folder: &Path, looks: (&str, u32, bool), options: Options) -> ExitCode {
    let mut engine = match Engine::start(options) {
        Ok(engine) => engine,
        Err(error) => return ended(&error),
    };
    let mut errors = 0;
    while let Err(error) = play(&mut engine, folder, looks) {
        match &error {
            LoadError::Raised(raised) if raised.level == 1 && errors < ERRORS => {
                println!("error: {}", raised.message);
                errors += 1;
            }
            error => {
                report(&engine);
                return ended(error);
            }
        }
    }
    let clean = report(&engine);
    println!("played to the end");
    if clean {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// The renderer ended the game: as it may, with one line.
fn ended(error: &LoadError) -> ExitCode {
    let message = match error {
        LoadError::Raised(raised) if raised.level == 0 => raised.message.clone(),
        other => {
            println!("unexpected: {other}");
            return ExitCode::FAILURE;
        }
    };
    println!("ended: {message}");
    if message.lines().count() == 1 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Prints the renderer's messages; whether it broke no rule.
fn report(engine: &Engine) -> bool {
    for message in engine.messages() {
        print!("{}", message.text);
    }
    for violation in engine.violations() {
        println!("violation: {violation}");
    }
    engine.violations().is_empty() && engine.validation_messages().is_empty()
}

fn play(
    engine: &mut Engine,
    folder: &Path,
    (looks, frames, costs): (&str, u32, bool),
) -> Result<(), LoadError> {
    let view = View::new(HERE, 30.0);
    engine.set("r_rt", "0");
    engine.start_map(ROOMS)?;
    println!("drawing");
    for look in looks.chars() {
        let (value, name) = match look {
            't' => ("1", "traced"),
            _ => ("0", "classic"),
        };
        engine.set("r_rt", value);
        let draw = |engine: &mut Engine, frames: u32| -> Result<(), LoadError> {
            for _ in 0..frames {
                engine.begin_frame(0)?;
                engine.clear_scene()?;
                engine.render_scene(&view)?;
                engine.end_frame()?;
            }
            Ok(())
        };
        let start = std::time::Instant::now();
        draw(engine, frames)?;
        if costs {
            println!("frames: {frames} in {} ms", start.elapsed().as_millis());
            engine.command("rt_stats")?;
            draw(engine, COSTS)?;
        }
        save(
            &engine.picture(&view)?,
            &folder.join(name).with_extension("png"),
        );
    }
    engine.set("r_rt", "0");
    engine.restart_video()?;
    engine.load_world(ROOMS)?;
    engine.end_registration()?;
    engine.picture(&view)?;
    engine.shutdown(true)?;
    Ok(())
}

fn save(picture: &Rgb8, file: &Path) {
    let (width, height) = (picture.width() as u32, picture.height() as u32);
    let image = image::RgbImage::from_raw(width, height, picture.pixels().to_vec());
    image
        .expect("its size")
        .save(file)
        .expect("a file in the folder");
}
