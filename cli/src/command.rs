//! The subcommands of `relight`.

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::outcome::parse;
use crate::{
    bake, calibration, cameras, compare, convert, info, lights, material, render, report, sample,
    viewer, watch,
};

/// Maps of id Tech 3 games: contents, conversion, pictures with new light
#[derive(Parser, Debug)]
#[command(name = "relight", version)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

// No documentation comments on the variants: clap would show them in place of the descriptions of the arguments.
#[derive(Subcommand, Debug)]
enum Command {
    Bake(bake::BakeArgs),
    Calibration(calibration::CalibrationArgs),
    Cameras(cameras::CamerasArgs),
    Compare(compare::CompareArgs),
    Convert(convert::ConvertArgs),
    Info(info::InfoArgs),
    Lights(lights::LightsArgs),
    Material(material::MaterialArgs),
    Render(Box<render::RenderArgs>),
    Report(report::ReportArgs),
    Sample(sample::SampleArgs),
    View(Box<viewer::ViewArgs>),
    Watch(Box<watch::WatchArgs>),
}

/// Names of earlier versions: subcommand, option (empty for the subcommand itself), replacement.
const REPLACED: [(&str, &str, &str); 13] = [
    ("cameras", "--each", "--views"),
    ("convert", "--exposure", "--light-scale"),
    ("estimators", "", "relight-lab estimators"),
    ("lights", "--judge", "relight-lab light-lists"),
    ("lights", "--picture", "--output"),
    ("looks", "", "relight-lab looks"),
    ("measure", "", "relight-lab measure"),
    ("render", "--camera", "--view X,Y,Z,YAW,PITCH"),
    ("render", "--classic", "--look classic"),
    ("render", "--lens", "--lens DIAMETER,DISTANCE"),
    ("render", "--scale", "--render-scale"),
    ("render", "--step", "--step X,Y,Z,YAW"),
    ("render", "--traced", "--look traced"),
];

/// Runs the subcommand that the process arguments name.
///
/// # Errors
/// Those of the subcommand.
pub fn run() -> Result<ExitCode> {
    match parse::<Cli>(&REPLACED).command {
        Command::Bake(args) => bake::run(&args),
        Command::Calibration(args) => calibration::run(&args),
        Command::Cameras(args) => cameras::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Convert(args) => return convert::run(&args),
        Command::Info(args) => return info::run(&args),
        Command::Lights(args) => lights::run(&args),
        Command::Material(args) => return material::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Sample(args) => sample::run(&args),
        Command::View(args) => viewer::run(&args),
        Command::Watch(args) => watch::run(&args),
    }?;
    Ok(ExitCode::SUCCESS)
}
