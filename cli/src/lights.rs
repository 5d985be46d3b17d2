//! `relight lights`: maps' lights and light lists from above.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use relight::light::sweep;

use crate::lit_maps::LitMaps;

/// Draw a map's lights from above
///
/// The picture shows the clusters by the length of their light lists, the lights, and the difference between traced and
/// stored light. Without --output it is written as NAME_lights.png and NAME_lights.svg into the current folder.
///
/// Examples: relight lights oa_dm1; relight lights kaos2 -o kaos2.svg
#[derive(Args, Debug)]
pub struct LightsArgs {
    #[command(flatten)]
    maps: LitMaps,
    /// Output file, .svg or .png; may be repeated for both
    #[arg(short, long, value_name = "PATH")]
    output: Vec<PathBuf>,
}

/// Output files for a map: those of the command line, or two files in the current folder.
fn pictures(args: &LightsArgs, map: &str) -> Vec<PathBuf> {
    if !args.output.is_empty() {
        return args.output.clone();
    }
    // A path that ends in `..` has no name, and is no map.
    let stem = Path::new(map).file_stem().unwrap_or_default();
    let stem = stem.to_string_lossy();
    ["png", "svg"]
        .map(|kind| PathBuf::from(format!("{stem}_lights.{kind}")))
        .to_vec()
}

/// Runs the command.
pub fn run(args: &LightsArgs) -> Result<()> {
    if args.maps.chosen.maps.len() > 1 && !args.output.is_empty() {
        bail!("--output is for one map");
    }
    for map in &args.maps.chosen.maps {
        let (mut world, map) = args.maps.load(map)?;
        sweep(&mut world, args.maps.cache().as_ref());
        let pictures = pictures(args, &map);
        crate::lights_picture::draw(&world, &pictures)?;
        for picture in pictures {
            println!("{}", picture.display());
        }
    }
    Ok(())
}
