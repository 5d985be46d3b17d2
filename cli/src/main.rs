//! The `relight` command.

#![forbid(unsafe_code)]

mod beside;
mod brought;
mod calibration;
mod cameras;
mod chromaticity;
mod compare;
mod convert;
mod estimators;
mod info;
mod lights;
mod lights_picture;
mod looks;
mod material;
mod measure;
mod messages;
mod numbers;
mod pictures;
mod render;
mod scripts;
mod statistics;
mod table;
mod timings;
mod view;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Maps of id Tech 3 games: what is in them, converted, relit
#[derive(Parser, Debug)]
#[command(name = "relight", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Tell how well traced light agrees with maps' lightmaps, before and after calibration
    Calibration(calibration::CalibrationArgs),
    /// List places to look at maps from: intermission cameras and spawn points
    Cameras(cameras::CamerasArgs),
    /// Tell how alike pictures of one view are
    Compare(compare::CompareArgs),
    /// Write maps for other programs
    Convert(convert::ConvertArgs),
    /// Compare the ways to choose lights: all of them have the same mean
    Estimators(estimators::EstimatorsArgs),
    /// Tell what is in maps, and where their light comes from
    Info(info::InfoArgs),
    /// Draw a map's lights from above, or judge its light lists by rays
    Lights(lights::LightsArgs),
    /// Draw views in the classic look and traced, side by side, and compare how bright and how coloured they are
    Looks(looks::LooksArgs),
    /// Tell how a material is understood
    Material(material::MaterialArgs),
    /// Measure the traced look in real time against its reference
    Measure(measure::MeasureArgs),
    /// Make a picture of a map, without an engine or a display
    Render(render::RenderArgs),
}

/// Exit code for input that cannot be read: a file that is cut off, of another kind, or damaged.
const BAD_INPUT: u8 = 2;

/// Ends quietly where whoever reads the output has had enough of it (`relight info | head`).
fn end_with_the_reader() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let text = panic.payload().downcast_ref::<String>();
        if text.is_some_and(|t| t.starts_with("failed printing to stdout: Broken pipe")) {
            std::process::exit(0);
        }
        usual(panic);
    }));
}

fn main() -> ExitCode {
    end_with_the_reader();
    messages::print_warnings();
    match run(Cli::parse().command) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("{}", one_sentence(&error));
            match is_bad_input(&error) {
                true => ExitCode::from(BAD_INPUT),
                false => ExitCode::FAILURE,
            }
        }
    }
}

/// An error with its causes, each once: some of them repeat what caused them.
pub(crate) fn one_sentence(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.ends_with(&cause) {
            continue;
        }
        if !text.is_empty() {
            text.push_str(": ");
        }
        text.push_str(&cause);
    }
    text
}

/// Whether a file was read that is not what it should be, or a map is nowhere.
fn is_bad_input(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<q3bsp::Error>()
            || matches!(
                cause.downcast_ref(),
                Some(relight::LoadError::Map { .. } | relight::LoadError::Absent { .. })
            )
            || matches!(
                cause.downcast_ref(),
                Some(relight::FileError::Pack { .. } | relight::FileError::Entry { .. })
            )
    })
}

fn run(command: Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::Calibration(args) => calibration::run(&args),
        Command::Cameras(args) => cameras::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Convert(args) => return convert::run(&args),
        Command::Estimators(args) => estimators::run(&args),
        Command::Info(args) => return info::run(&args),
        Command::Lights(args) => lights::run(&args),
        Command::Looks(args) => looks::run(&args),
        Command::Material(args) => return material::run(&args),
        Command::Measure(args) => measure::run(&args),
        Command::Render(args) => render::run(&args),
    }?;
    Ok(ExitCode::SUCCESS)
}
