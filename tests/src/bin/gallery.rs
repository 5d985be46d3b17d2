//! Draws the gallery's scenes on the engine's own `opengl1` and on Relight and compares them; see [`tests::gallery`].

#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use tests::data;
use tests::gallery::run::{self, Player};
use tests::gallery::{Scene, scenes};

const USAGE: &str = "usage: gallery [--list] [--out DIR] [SCENE...]

Draws scenes (all, or those whose names begin so) on opengl1 and on Relight, and leaves the contact sheet in DIR/index.html
(default: out/gallery). Fails if one of them differs.

  gallery --play opengl1|vk|traced DIR SCENE...   draws on one renderer, named by RELIGHT_LIBRARY, in this process;
                                                   traced: Relight's traced look, which has nothing to be compared with";

fn chosen(names: &[String]) -> Vec<Scene> {
    let mut all = scenes();
    if !names.is_empty() {
        all.retain(|s| names.iter().any(|n| s.name.starts_with(n.as_str())));
    }
    all
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if let ["--play", player, folder, ..] = words.as_slice() {
        let Some(player) = Player::from_name(player) else {
            eprintln!("{USAGE}");
            return ExitCode::FAILURE;
        };
        let exact: Vec<Scene> = scenes()
            .into_iter()
            .filter(|s| arguments.iter().skip(3).any(|n| n == s.name))
            .collect();
        return match run::play(player, &data::library(), &exact, Path::new(folder)) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{folder}: {error}");
                ExitCode::FAILURE
            }
        };
    }
    let mut folder = data::repository().join("out/gallery");
    let mut names = Vec::new();
    let mut rest = arguments.into_iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--list" => {
                for scene in scenes() {
                    println!("{:24} {}", scene.name, scene.about);
                }
                return ExitCode::SUCCESS;
            }
            "--out" => match rest.next() {
                Some(place) => folder = PathBuf::from(place),
                None => {
                    eprintln!("{USAGE}");
                    return ExitCode::FAILURE;
                }
            },
            option if option.starts_with('-') => {
                eprintln!("{USAGE}");
                return ExitCode::FAILURE;
            }
            _ => names.push(argument),
        }
    }
    let program = std::env::current_exe().expect("the path of this program");
    let Some(outcomes) = run::compare(&program, &chosen(&names), &folder) else {
        return ExitCode::FAILURE;
    };
    let mut bad = 0;
    for outcome in &outcomes {
        let figures = outcome.difference.map_or_else(String::new, |d| {
            format!("SSIM {:.4} mean {:7.3}", d.ssim, d.mean_absolute)
        });
        let name = format!("{}.{}", outcome.scene, outcome.name);
        println!("{name:40} {figures:26} {}", outcome.complaint);
        bad += usize::from(!outcome.complaint.is_empty());
    }
    println!(
        "{} compared, {bad} differ; {}",
        outcomes.len(),
        folder.join("index.html").display()
    );
    if bad == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
