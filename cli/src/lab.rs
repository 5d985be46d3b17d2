//! The subcommands of `relight-lab`: measurements of the renderer, without an engine or a display.

mod agreement;
mod bodies;
mod chromaticity;
mod curves;
mod estimators;
mod growth;
mod light_lists;
mod looks;
mod measure;
mod statistics;
mod tracers;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::outcome::parse;

/// Measurements of Relight's renderer: light sampling, light lists, denoising, brightness, tracers, curves
#[derive(Parser, Debug)]
#[command(name = "relight-lab", version)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

// No documentation comments on the variants: clap would show them in place of the descriptions of the arguments.
#[derive(Subcommand, Debug)]
enum Command {
    Agreement(agreement::AgreementArgs),
    Bodies(bodies::BodiesArgs),
    Curves(curves::CurvesArgs),
    Estimators(estimators::EstimatorsArgs),
    Growth(growth::GrowthArgs),
    LightLists(light_lists::LightListsArgs),
    Looks(looks::LooksArgs),
    Measure(measure::MeasureArgs),
    Tracers(tracers::TracersArgs),
}

/// Names of earlier versions: subcommand, option, replacement.
const REPLACED: [(&str, &str, &str); 2] = [
    ("estimators", "--camera", "--view X,Y,Z,YAW,PITCH"),
    ("measure", "--each", "--views"),
];

/// Runs the subcommand that the process arguments name.
///
/// # Errors
/// Those of the subcommand.
pub fn run() -> Result<ExitCode> {
    match parse::<Cli>(&REPLACED).command {
        Command::Agreement(args) => agreement::run(&args),
        Command::Bodies(args) => bodies::run(&args),
        Command::Curves(args) => curves::run(&args),
        Command::Estimators(args) => estimators::run(&args),
        Command::Growth(args) => growth::run(&args),
        Command::LightLists(args) => light_lists::run(&args),
        Command::Looks(args) => looks::run(&args),
        Command::Measure(args) => measure::run(&args),
        Command::Tracers(args) => tracers::run(&args),
    }?;
    Ok(ExitCode::SUCCESS)
}
