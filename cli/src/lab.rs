//! The subcommands of `relight-lab`: measurements of the renderer, without an engine or a display.

mod chromaticity;
mod estimators;
mod light_lists;
mod looks;
mod measure;
mod statistics;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::outcome::parse;

/// Measurements of Relight's renderer: light sampling, light lists, denoising, brightness
#[derive(Parser, Debug)]
#[command(name = "relight-lab", version)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

// Each is described where its arguments are: a comment here would hide the rest of that description.
#[derive(Subcommand, Debug)]
enum Command {
    Estimators(estimators::EstimatorsArgs),
    LightLists(light_lists::LightListsArgs),
    Looks(looks::LooksArgs),
    Measure(measure::MeasureArgs),
}

/// What earlier versions had: subcommand, option, and what replaces it.
const REPLACED: [(&str, &str, &str); 2] = [
    ("estimators", "--camera", "--view X,Y,Z,YAW,PITCH"),
    ("measure", "--each", "--views"),
];

/// Runs the subcommand that the arguments of the process name.
///
/// # Errors
/// What the subcommand says.
pub fn run() -> Result<ExitCode> {
    match parse::<Cli>(&REPLACED).command {
        Command::Estimators(args) => estimators::run(&args),
        Command::LightLists(args) => light_lists::run(&args),
        Command::Looks(args) => looks::run(&args),
        Command::Measure(args) => measure::run(&args),
    }?;
    Ok(ExitCode::SUCCESS)
}
