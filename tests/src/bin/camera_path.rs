//! Plays a recorded camera path through the library and prints what the frames cost; see [`tests::camera_path`].

#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use tests::camera_path::{Play, SETTLING, play};
use tests::data;
use tests::engine::files::Packs;

const USAGE: &str = "usage: camera_path MAP PATH [options]

Loads the library as an engine does, plays the camera path of the file PATH (recorded in the game by rt_path) on MAP,
and prints as JSON: milliseconds of each pass of the GPU, rays and rays a second, memory by purpose, frames a second.
It needs no display and no engine. The library is the one that cargo builds beside this program, or RELIGHT_LIBRARY;
the game's own packs lie in OPENARENA_DATA, or where Debian puts them.

  --size WxH        of the picture (default 1920x1080)
  --rt 0|1          the classic or the traced look (default 1)
  --set NAME VALUE  a console variable; may be repeated
  --frames N        of the path, from its beginning (default: all)
  --window          opens a window and presents to it; needs a display
  --picture FILE    the last frame as PNG";

fn read(arguments: &[String]) -> Result<(Play, Option<PathBuf>), String> {
    let mut plain: Vec<&str> = Vec::new();
    let (mut size, mut traced, mut window) = ([1920, 1080], true, false);
    let (mut cvars, mut frames, mut picture) = (Vec::new(), usize::MAX, None);
    let mut rest = arguments.iter().map(String::as_str);
    while let Some(argument) = rest.next() {
        let mut value = || rest.next().ok_or(format!("{argument} needs a value"));
        match argument {
            "--size" => {
                let text = value()?;
                let numbers = text.split_once('x').and_then(|(w, h)| {
                    let side = |t: &str| t.parse().ok().filter(|n| (1..=16384).contains(n));
                    Some([side(w)?, side(h)?])
                });
                size = numbers.ok_or(format!("{text} is no size; write it like 1280x720"))?;
            }
            "--rt" => match value()? {
                "0" => traced = false,
                "1" => traced = true,
                other => return Err(format!("--rt takes 0 or 1, not {other}")),
            },
            "--set" => cvars.push((value()?.to_string(), value()?.to_string())),
            "--frames" => {
                let text = value()?;
                frames = text
                    .parse()
                    .map_err(|_| format!("{text} is no number of frames"))?;
            }
            "--window" => window = true,
            "--picture" => picture = Some(PathBuf::from(value()?)),
            option if option.starts_with('-') => return Err(format!("unknown option {option}")),
            other => plain.push(other),
        }
    }
    let [map, file] = plain[..] else {
        return Err("a map and a path are needed".into());
    };
    let text = std::fs::read_to_string(file).map_err(|e| format!("{file}: {e}"))?;
    let mut path = renderer_vk::path::parse(&text).map_err(|e| format!("{file}: {e}"))?;
    path.truncate(frames);
    let folder = testkit::folder().ok_or("the game's packs are needed")?;
    let packs = Packs::open(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let play = Play {
        library: data::library(),
        packs,
        files: Vec::new(),
        map: format!("maps/{map}.bsp"),
        path,
        size,
        traced,
        window,
        cvars,
        settling: SETTLING,
        picture: picture.is_some(),
    };
    Ok((play, picture))
}

fn run(arguments: &[String]) -> Result<(), String> {
    let (wanted, file) = read(arguments).map_err(|e| format!("{e}\n\n{USAGE}"))?;
    let (report, picture) = play(&wanted).map_err(|e| e.to_string())?;
    println!("{:#}", report.json());
    if let (Some(file), Some(picture)) = (file, picture) {
        let (width, height) = (picture.width() as u32, picture.height() as u32);
        let rgb = image::ExtendedColorType::Rgb8;
        image::save_buffer(&file, picture.pixels(), width, height, rgb)
            .map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|a| a == "--help" || a == "-h") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("camera_path: {error}");
            ExitCode::FAILURE
        }
    }
}
