//! `relight info`: what is in maps, and where their light comes from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use relight::{
    CalibrationCache, CalibrationOptions, CalibrationReport, GameFiles, Materials, Options, Pk3,
    RelitWorld, SearchPath,
};
use serde::Serialize;

/// Options of `relight info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Game folder with packs; give several in rising priority (the base game first, the mod after it)
    #[arg(
        long = "game",
        value_name = "DIR",
        default_value = "/usr/share/games/openarena/baseoa"
    )]
    games: Vec<PathBuf>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// List the emitting materials of each map
    #[arg(long)]
    emitters: bool,
    /// Fit the lights to the maps' lightmaps, and tell how well they agree with them
    #[arg(long)]
    calibrate: bool,
    /// Keep what calibration finds in this folder, and take it from there
    #[arg(long, value_name = "DIR", requires = "calibrate")]
    cache: Option<PathBuf>,
    /// Maps by name (oa_dm1), by game path (maps/oa_dm1.bsp) or by file; packs (.pk3) stand for all maps in
    /// them. Without any: all maps of the game folders
    #[arg(value_name = "MAP|PK3")]
    maps: Vec<String>,
}

/// Where a map is to be found.
enum Source {
    /// In the game folders and the packs given.
    Game(String),
    /// A file of its own.
    File(PathBuf),
}

/// What is told about a map.
#[derive(Serialize)]
struct MapInfo {
    map: String,
    surfaces: usize,
    triangles: usize,
    materials: usize,
    /// Materials without script and image, or that the engine rejects: drawn with the default.
    missing: Vec<String>,
    triangle_lights: usize,
    /// Triangle lights by the evidence for them.
    lights_by_source: BTreeMap<&'static str, usize>,
    point_lights: usize,
    suns: usize,
    ambient: [f32; 3],
    clusters: usize,
    mean_list_length: f64,
    longest_list: usize,
    degenerate_triangles: usize,
    emitters: Vec<Emitter>,
    /// Light against the map's lightmaps; absent unless asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    calibration: Option<Calibration>,
    warnings: Vec<String>,
    milliseconds: u128,
}

/// How well light agrees with the map's lightmaps, over measurements that fitting did not see.
#[derive(Serialize)]
struct Calibration {
    /// What told of light.
    evidence: &'static str,
    samples: usize,
    held_out: usize,
    known_sources: usize,
    placed_lights: usize,
    before: Agreement,
    after: Agreement,
    cached: bool,
    seconds: f64,
}

/// Computed light against stored light.
#[derive(Serialize)]
struct Agreement {
    median_stops: f32,
    worst_tenth_stops: f32,
    sum_ratio: f32,
}

impl Calibration {
    fn new(report: &CalibrationReport) -> Calibration {
        let agreement = |a: &relight::calibrate::Agreement| Agreement {
            median_stops: a.median_stops,
            worst_tenth_stops: a.worst_tenth_stops,
            sum_ratio: a.sum_ratio,
        };
        Calibration {
            evidence: report.evidence.label(),
            samples: report.samples,
            held_out: report.held_out,
            known_sources: report.known,
            placed_lights: report.placed,
            before: agreement(&report.before),
            after: agreement(&report.after),
            cached: report.cached,
            seconds: report.seconds,
        }
    }
}

/// One emitting material.
#[derive(Serialize)]
struct Emitter {
    material: String,
    source: &'static str,
    radiance: [f32; 3],
    surfaces: usize,
    triangles: usize,
    area: f64,
}

/// What is told about a map that cannot be loaded.
#[derive(Serialize)]
struct Failure {
    map: String,
    error: String,
}

/// Loads the maps and prints what is in them; fails when one of them cannot be loaded.
pub fn run(args: &InfoArgs) -> Result<()> {
    let mut files = SearchPath::open(&args.games)?;
    let sources = find_maps(&mut files, &args.maps)?;
    if sources.is_empty() {
        bail!(
            "no maps in {}",
            args.games
                .iter()
                .map(|g| g.display().to_string())
                .collect::<Vec<_>>()
                .join(", ")
        );
    }
    let (materials, _) = Materials::load(&files);
    let bar = ProgressBar::new(sources.len() as u64);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}")?);
    let mut infos = Vec::new();
    let mut failures = Vec::new();
    for source in sources {
        let name = match &source {
            Source::Game(map) => map.clone(),
            Source::File(path) => path.display().to_string(),
        };
        bar.set_message(name.clone());
        let begin = Instant::now();
        match load(&files, &materials, &source, args) {
            Ok(world) => infos.push(describe(&world, begin.elapsed().as_millis())),
            Err(error) => failures.push(Failure {
                map: name,
                error: format!("{error:#}"),
            }),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if args.json {
        let all = serde_json::json!({ "maps": infos, "failures": failures });
        println!("{}", serde_json::to_string_pretty(&all)?);
    } else {
        print_table(&infos, args.emitters);
        for failure in &failures {
            eprintln!("{}: {}", failure.map, failure.error);
        }
    }
    match failures.len() {
        0 => Ok(()),
        1 => bail!("1 map cannot be loaded"),
        count => bail!("{count} maps cannot be loaded"),
    }
}

fn find_maps(files: &mut SearchPath, asked: &[String]) -> Result<Vec<Source>> {
    let mut sources = Vec::new();
    for name in asked {
        let path = Path::new(name);
        let extension = path
            .extension()
            .map(|e| e.to_string_lossy().to_lowercase())
            .unwrap_or_default();
        match extension.as_str() {
            "pk3" => {
                let maps = Pk3::open(path)?.list("maps", ".bsp");
                if maps.is_empty() {
                    bail!("{name}: no maps in it");
                }
                files.add_pk3(path)?;
                sources.extend(
                    maps.into_iter()
                        .map(|map| Source::Game(format!("maps/{map}"))),
                );
            }
            "bsp" if path.is_file() => sources.push(Source::File(path.to_owned())),
            "bsp" => sources.push(Source::Game(name.clone())),
            _ => sources.push(Source::Game(format!("maps/{name}.bsp"))),
        }
    }
    if asked.is_empty() {
        let mut maps = files.list("maps", ".bsp");
        maps.sort();
        sources.extend(
            maps.into_iter()
                .map(|map| Source::Game(format!("maps/{map}"))),
        );
    }
    Ok(sources)
}

fn load(
    files: &SearchPath,
    materials: &Materials,
    source: &Source,
    args: &InfoArgs,
) -> Result<RelitWorld> {
    let calibrate = args.calibrate.then(|| CalibrationOptions {
        cache: args.cache.as_ref().map(CalibrationCache::new),
        ..CalibrationOptions::default()
    });
    let options = Options {
        calibrate,
        ..Options::default()
    };
    match source {
        Source::Game(map) => Ok(RelitWorld::load(files, materials, map, options)?),
        Source::File(path) => {
            let name = path.display().to_string();
            let bytes = std::fs::read(path).with_context(|| name.clone())?;
            let bsp = q3bsp::Bsp::parse(&bytes).with_context(|| name.clone())?;
            Ok(RelitWorld::from_bsp(files, materials, &name, bsp, options))
        }
    }
}

fn describe(world: &RelitWorld, milliseconds: u128) -> MapInfo {
    let report = &world.report;
    let mut missing: Vec<_> = world
        .materials
        .iter()
        .filter(|m| m.resolved.fault.is_some())
        .map(|m| m.name.clone())
        .collect();
    missing.sort();
    missing.dedup();
    let mut lights_by_source = BTreeMap::new();
    for emitter in &report.emitters {
        *lights_by_source.entry(emitter.source.label()).or_default() += emitter.triangles;
    }
    MapInfo {
        map: world.name.clone(),
        surfaces: world.surfaces.len(),
        triangles: world.indices.len() / 3,
        materials: world.materials.len(),
        missing,
        triangle_lights: report.triangle_lights,
        lights_by_source,
        point_lights: report.point_lights,
        suns: report.suns,
        ambient: world.ambient.to_array(),
        clusters: report.clusters,
        mean_list_length: report.mean_list_length,
        longest_list: report.longest_list,
        degenerate_triangles: report.degenerate_triangles,
        emitters: report
            .emitters
            .iter()
            .map(|e| Emitter {
                material: e.name.clone(),
                source: e.source.label(),
                radiance: e.radiance.to_array(),
                surfaces: e.surfaces,
                triangles: e.triangles,
                area: e.area,
            })
            .collect(),
        calibration: world.calibration.as_ref().map(Calibration::new),
        warnings: world.warnings.clone(),
        milliseconds,
    }
}

fn print_table(infos: &[MapInfo], emitters: bool) {
    let width = infos.iter().map(|i| i.map.len()).max().unwrap_or(0).max(3);
    println!(
        "{:width$} {:>8} {:>9} {:>9} {:>7} {:>6} {:>6} {:>4} {:>8} {:>9} {:>7} {:>6}",
        "map",
        "surfaces",
        "triangles",
        "materials",
        "missing",
        "lights",
        "points",
        "suns",
        "clusters",
        "mean list",
        "longest",
        "ms"
    );
    for info in infos {
        println!(
            "{:width$} {:>8} {:>9} {:>9} {:>7} {:>6} {:>6} {:>4} {:>8} {:>9.1} {:>7} {:>6}",
            info.map,
            info.surfaces,
            info.triangles,
            info.materials,
            info.missing.len(),
            info.triangle_lights,
            info.point_lights,
            info.suns,
            info.clusters,
            info.mean_list_length,
            info.longest_list,
            info.milliseconds
        );
        if !info.missing.is_empty() {
            println!("    missing: {}", info.missing.join(", "));
        }
        if let Some(c) = &info.calibration {
            println!(
                "    {}: {} samples ({} held out), {} known sources, {} lights placed; stops off in the median {:.3} -> {:.3}, \
                 in the worst tenth {:.3} -> {:.3}; sum {:.3} -> {:.3} of stored; {:.2} s{}",
                c.evidence,
                c.samples,
                c.held_out,
                c.known_sources,
                c.placed_lights,
                c.before.median_stops,
                c.after.median_stops,
                c.before.worst_tenth_stops,
                c.after.worst_tenth_stops,
                c.before.sum_ratio,
                c.after.sum_ratio,
                c.seconds,
                if c.cached { ", from the cache" } else { "" }
            );
        }
        if emitters {
            for e in &info.emitters {
                let [r, g, b] = e.radiance;
                println!(
                    "    {:12} {:5} triangles, area {:10.0}, radiance {r:.3} {g:.3} {b:.3}  {}",
                    e.source, e.triangles, e.area, e.material
                );
            }
        }
    }
    let dark = infos
        .iter()
        .filter(|i| i.triangle_lights + i.point_lights + i.suns == 0)
        .count();
    println!("{} maps, {dark} without any light", infos.len());
}
