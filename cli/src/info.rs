//! `relight info`: contents of maps, and sources of their light.

mod describe;
mod table;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use relight::{
    CalibrationCache, CalibrationOptions, GameFiles, Materials, Options, RelitWorld, SearchPath,
    external_lightmaps,
};
use serde::Serialize;

use crate::brought::Brought;
use crate::convert::inputs::{self, Input};
use crate::game::Game;
use crate::outcome::{BAD_INPUT, one_sentence};
use crate::scripts::load_scripts;
use describe::MapInfo;

/// List the contents of maps, and the sources of their light
///
/// One map in full, several as a table: format, lumps, bounds, entities, materials and which are missing, lightmaps,
/// fogs, clusters and their visibility, lights by source, warnings. Exit code: 0, or 2 if a map cannot be read.
///
/// Examples: relight info oa_dm1; relight info pak1-maps.pk3; relight info my.bsp --json
#[derive(Args, Debug)]
pub struct InfoArgs {
    #[command(flatten)]
    game: Game,
    /// Print JSON in place of a table
    #[arg(long)]
    json: bool,
    /// Print a table for a single map, too
    #[arg(long)]
    short: bool,
    /// List the emitting materials of each map
    #[arg(long)]
    emitters: bool,
    /// Fit the lights to the maps' lightmaps, and print the agreement
    #[arg(long)]
    calibrate: bool,
    /// Cache calibrations in this folder
    #[arg(long, value_name = "DIR", requires = "calibrate")]
    cache: Option<PathBuf>,
    /// Maps: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) for all maps in it, or pack.pk3:maps/x.bsp.
    /// Without any: all maps of the game
    #[arg(value_name = "MAP")]
    maps: Vec<String>,
}

/// Report about a map that cannot be loaded.
#[derive(Serialize)]
struct Failure {
    map: String,
    error: String,
}

/// Loads the maps and prints their contents. Exit code 2 if a map cannot be read.
pub fn run(args: &InfoArgs) -> Result<ExitCode> {
    let mut files = args.game.files()?;
    let mut sources = Vec::new();
    let mut failures = Vec::new();
    for name in &args.maps {
        match inputs::find(&mut files, &args.game.paths, std::slice::from_ref(name)) {
            Ok(found) => sources.extend(found),
            Err(error) => failures.push(Failure {
                map: name.clone(),
                error: one_sentence(&error),
            }),
        }
    }
    if args.maps.is_empty() {
        let mut maps = files.list("maps", ".bsp");
        maps.sort();
        sources.extend(maps.iter().map(|map| Input::Game(format!("maps/{map}"))));
        if sources.is_empty() {
            let games = args.game.paths.iter().map(|g| g.display().to_string());
            bail!("no maps in {}", games.collect::<Vec<_>>().join(", "));
        }
    }
    let (materials, _) = load_scripts(&files);
    let bar = ProgressBar::new(sources.len() as u64);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}")?);
    let mut infos = Vec::new();
    for source in sources {
        let name = source.to_string();
        bar.set_message(name.clone());
        match load(&files, &materials, &source, args) {
            Ok(info) => infos.push(info),
            Err(error) => failures.push(Failure {
                map: name,
                error: one_sentence(&error),
            }),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if args.json {
        let all = serde_json::json!({ "maps": infos, "failures": failures });
        println!("{}", serde_json::to_string_pretty(&all)?);
    } else {
        match infos.as_slice() {
            [] => {}
            // a single map in full, several as a table
            [one] if !args.short => table::print_map(one, args.emitters),
            many => table::print_table(many, args.emitters),
        }
        for failure in &failures {
            eprintln!("{}", failure.error);
        }
    }
    Ok(match failures.len() {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::from(BAD_INPUT),
    })
}

fn load(
    files: &SearchPath,
    materials: &Materials,
    source: &Input,
    args: &InfoArgs,
) -> Result<MapInfo> {
    let begin = Instant::now();
    let calibrate = args.calibrate.then(|| CalibrationOptions {
        cache: args.cache.as_ref().map(CalibrationCache::new),
        ..CalibrationOptions::default()
    });
    let options = Options {
        calibrate,
        ..Options::default()
    };
    let name = source.to_string();
    let bytes = source.read(files)?;
    let lumps = q3bsp::lump_entries(&bytes).with_context(|| name.clone())?;
    let mut bsp = q3bsp::Bsp::parse(&bytes).with_context(|| name.clone())?;
    let found = source.files(files)?;
    let brought = Brought::new(&found, &bsp);
    let (files, materials) = match &brought {
        Some(own) => (&own.files as &dyn GameFiles, &own.materials),
        None => (&found as &dyn GameFiles, materials),
    };
    let external = external_lightmaps(&mut bsp, files, &source.game_path());
    let beside = external.as_ref().is_ok_and(|pages| *pages > 0);
    let mut world = RelitWorld::from_bsp(files, materials, &source.game_path(), bsp, options);
    world.warnings.extend(external.err());
    let warnings = brought.iter().flat_map(|own| own.warnings.iter());
    world.warnings.extend(warnings.cloned());
    let milliseconds = begin.elapsed().as_millis();
    let mut info = MapInfo::new(&world, bytes.len(), &lumps, milliseconds);
    info.lightmaps.beside = beside;
    Ok(info)
}
