//! `relight watch`: a window that follows a map while it is made.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use gui::egui::{Pos2, RawInput, Rect, vec2};
use renderer_vk::{Renderer, RendererOptions};

use crate::chosen::ChosenMap;
use crate::game::{Game, USUAL};
use crate::pictures::write_rgb;
use crate::viewer::{Followed, Source, Start, State, Viewer, WindowArgs, WindowOptions, show};
use crate::watched::{Compiler, Files};

/// Show a map in a window while it is made: each new version within a second
///
/// A .bsp is shown whenever a compiler has written it. A .map is compiled by your own q3map2 when you save it; lights
/// that you change in it show without a compile. The window is that of relight view.
///
/// Examples: relight watch baseq3/maps/room.map; relight watch room.bsp --game ~/quake3/baseq3; relight watch room.map
/// --compile "-meta" --compile "-vis -fast"
#[derive(Args, Debug)]
pub struct WatchArgs {
    /// A .map or .bsp file, which may not exist yet
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    game: Game,
    /// The compiler of a .map; default: q3map2 on the search path
    #[arg(long, value_name = "PATH")]
    compiler: Option<PathBuf>,
    /// Arguments of the compiler, one stage an option; default: -meta
    #[arg(long, value_name = "ARGUMENTS", allow_hyphen_values = true)]
    compile: Vec<String>,
    #[command(flatten)]
    window: WindowArgs,
    /// Open no window; write each version as a picture (0001.png and so on) to this folder
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// End after so many pictures
    #[arg(long, value_name = "N", requires = "pictures", value_parser = clap::value_parser!(u32).range(1..))]
    count: Option<u32>,
}

/// Runs the command.
pub fn run(args: &WatchArgs) -> Result<()> {
    let file = &args.file;
    let extension = file
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default();
    let is_source = match extension.to_ascii_lowercase().as_str() {
        "map" => true,
        "bsp" => false,
        _ => bail!("{}: a .map or .bsp file is watched", file.display()),
    };
    if let Some(folder) = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        && !folder.is_dir()
    {
        bail!("{}: no such folder", folder.display());
    }
    let bsp = file.with_extension("bsp");
    let game = Game {
        paths: game_of(file, &args.game.paths),
    };
    let source = Source {
        chosen: ChosenMap {
            map: Some(bsp.display().to_string()),
            sample: None,
            game: game.clone(),
        },
        lights: args.window.lights(),
        followed: None,
    };
    let (mut start, options) = args.window.start(source)?;
    remove_old(&start.cache);
    let work = start.cache.join(format!("{WORK}{}", std::process::id()));
    let source = match is_source {
        true => Some((file.clone(), compiler(args, &game, &work)?)),
        false => None,
    };
    start.source.followed = Some(Followed::new(Files { bsp, source }));
    println!("watching {}", file.display());
    let shown = match &args.pictures {
        None => show(start, options),
        Some(folder) => write_pictures(start, &options, folder, args.count),
    };
    // made by the first compile
    let _ = std::fs::remove_dir_all(work);
    shown
}

/// Beginning of the names of folders for compilers.
const WORK: &str = "watch-";

/// Removes folders of programs that were killed: those a day old.
fn remove_old(cache: &Path) {
    const OLD: Duration = Duration::from_secs(24 * 3600);
    let folders = std::fs::read_dir(cache).into_iter().flatten().flatten();
    for folder in folders {
        let is_work = folder.file_name().to_string_lossy().starts_with(WORK);
        let modified = folder.metadata().and_then(|data| data.modified()).ok();
        if is_work && modified.is_some_and(|at| at.elapsed().is_ok_and(|age| age > OLD)) {
            // it costs only space
            let _ = std::fs::remove_dir_all(folder.path());
        }
    }
}

/// What compiles a `.map`; `None` if nothing is installed.
fn compiler(args: &WatchArgs, game: &Game, folder: &Path) -> Result<Option<Compiler>> {
    let program = match &args.compiler {
        Some(path) if !path.is_file() => bail!("{}: no such program", path.display()),
        // a bare name would be looked up in the search path
        Some(path) => Some(std::path::absolute(path)?),
        None => Compiler::installed(),
    };
    if program.is_none() {
        println!(
            "no q3map2 is found: the .bsp is shown when it is written; --compiler PATH names one"
        );
    }
    Ok(
        program
            .map(|program| Compiler::new(program, &args.compile, &game.paths, folder.to_owned())),
    )
}

/// The game folders of a map in `GAME/maps`: that one is the last. It is the only one if it is a whole game and no other
/// has been named.
fn game_of(file: &Path, named: &[PathBuf]) -> Vec<PathBuf> {
    let absolute = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    let maps = absolute.parent();
    let is_maps = maps
        .and_then(Path::file_name)
        .is_some_and(|name| name.eq_ignore_ascii_case("maps"));
    let own = maps.and_then(Path::parent).filter(|_| is_maps);
    let mut games = named.to_vec();
    let Some(own) = own else {
        return games;
    };
    if games == [Path::new(USUAL)] && own.join("pak0.pk3").is_file() {
        games.clear();
    }
    let same = |game: &PathBuf| std::path::absolute(game).is_ok_and(|game| game == own);
    if !games.iter().any(same) {
        games.push(own.to_owned());
    }
    games
}

/// Time between two frames that show the same.
const REST: Duration = Duration::from_millis(5);

/// Shows the map without a window, and writes a picture of each version once it is calm. Prints the state.
fn write_pictures(
    start: Start,
    options: &WindowOptions,
    folder: &Path,
    count: Option<u32>,
) -> Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be made", folder.display()))?;
    let (width, height) = options.size;
    let renderer = Renderer::new(RendererOptions {
        validation: options.validation,
        device: options.device.clone(),
        pipeline_cache: Some(start.cache.join("pipelines.cache")),
        ..RendererOptions::headless(width, height)
    })
    .context("no picture without a Vulkan device")?;
    let mut viewer = Viewer::new(renderer, start, Box::new(|| ()))?;
    viewer.hide_panel();
    let screen = Rect::from_min_size(Pos2::ZERO, vec2(width as f32, height as f32));
    let mut written = 0;
    let mut printed = None;
    let mut last = Instant::now();
    while count.is_none_or(|count| written < count) {
        let passed = last.elapsed();
        last = Instant::now();
        let input = RawInput {
            screen_rect: Some(screen),
            ..RawInput::default()
        };
        let at_rest = viewer.frame(input, passed)?.at_rest;
        let Some(follow) = viewer.followed() else {
            break;
        };
        let line = match follow.state {
            // its seconds are for a window
            State::Compiles(_) => "compiling".to_owned(),
            _ => follow.line(),
        };
        let shown = follow.shown;
        if printed.as_ref() != Some(&(line.clone(), shown)) {
            match follow.state {
                State::Shown(Some(seconds)) => {
                    println!(
                        "{line}: {seconds:.3} s, of these {:.3} s reading",
                        follow.read
                    );
                }
                _ => println!("{line}"),
            }
            if let (State::Failed, Some(problem)) = (follow.state, &follow.problem) {
                println!("{problem}");
            }
            if let (State::Shown(_), Some(note)) = (follow.state, &follow.note) {
                println!("{note}");
            }
            printed = Some((line, shown));
        }
        if shown > written && viewer.is_ready() {
            written = shown;
            let picture = viewer.picture()?;
            let path = folder.join(format!("{written:04}.png"));
            write_rgb(&path, &picture.rgb, picture.width, picture.height)?;
            println!("{}", path.display());
        }
        if at_rest {
            std::thread::sleep(REST);
        }
    }
    match viewer.end().first() {
        Some(first) if options.validation => bail!("the validation layer: {first}"),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // elsewhere a folder's time cannot be set
    #[cfg(unix)]
    #[test]
    fn folders_of_killed_programs_are_removed() {
        let cache = tempfile::tempdir().unwrap();
        let path = |name: &str| cache.path().join(name);
        for name in ["watch-1", "watch-2", "other"] {
            std::fs::create_dir(path(name)).unwrap();
        }
        let long_ago = std::time::SystemTime::now() - Duration::from_secs(3 * 24 * 3600);
        for name in ["watch-1", "other"] {
            let folder = std::fs::File::open(path(name)).unwrap();
            folder.set_modified(long_ago).unwrap();
        }
        remove_old(cache.path());
        assert!(!path("watch-1").exists());
        assert!(path("watch-2").exists() && path("other").exists());
    }

    #[test]
    fn a_map_in_the_folder_of_a_game_is_read_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let game = folder.path().join("mymod");
        let file = game.join("maps/room.map");
        std::fs::create_dir_all(game.join("maps")).unwrap();
        let usual = vec![PathBuf::from(USUAL)];
        let base = vec![PathBuf::from("/games/baseq3")];
        assert_eq!(game_of(&file, &usual), [usual[0].clone(), game.clone()]);
        assert_eq!(game_of(&file, &base), [base[0].clone(), game.clone()]);
        let own = vec![game.clone()];
        assert_eq!(game_of(&file, &own), own);
        std::fs::write(game.join("pak0.pk3"), "x").unwrap();
        assert_eq!(game_of(&file, &usual), own);
        assert_eq!(game_of(&file, &base), [base[0].clone(), game.clone()]);
        let elsewhere = folder.path().join("room.map");
        assert_eq!(game_of(&elsewhere, &usual), usual);
    }
}
