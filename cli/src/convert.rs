//! `relight convert`: maps for other programs.

pub mod inputs;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use relight::export::{
    Brushes, Export, ExportOptions, ExportReport, Format, ImagePlace, ImageStore, Lightmaps,
    METRES_PER_UNIT, Sky, export,
};
use relight::{
    CalibrationCache, CalibrationOptions, GameFiles, Materials, Options, RelitWorld, SearchPath,
    external_lightmaps,
};
use serde::Serialize;

use crate::brought::Brought;
use crate::game::Game;
use crate::numbers::positive;
use crate::outcome::{BAD_INPUT, one_sentence};
use crate::scripts::load_scripts;
use inputs::Input;

/// Write maps for other programs
///
/// Writes geometry with curves, normals and both sets of texture coordinates, materials with their images, lights,
/// entities and cameras. Files are written atomically. Exit code: 0 if all maps were written, 2 if a map cannot be
/// read, 1 for other errors.
///
/// Examples: relight convert oa_dm1 -o oa_dm1.glb; relight convert pak1-maps.pk3 -o converted;
/// relight convert pak1-maps.pk3:maps/kaos.bsp my.bsp -o out --format gltf
#[derive(Args, Debug)]
pub struct ConvertArgs {
    /// Maps: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) for all maps in it, or pack.pk3:maps/x.bsp
    #[arg(required = true, value_name = "MAP")]
    inputs: Vec<String>,
    /// Output file, or for several maps the folder; maps of several packs get a folder each
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Format; default: that of the output's extension, else the first
    #[arg(long, value_parser = parse_format)]
    format: Option<Format>,
    #[command(flatten)]
    game: Game,
    /// Length of an id unit in the output
    #[arg(long, default_value_t = METRES_PER_UNIT, value_parser = positive)]
    scale: f32,
    /// Treatment of lightmaps; default: vertices, and strip if lights are requested
    #[arg(long, value_enum)]
    lightmaps: Option<LightmapChoice>,
    /// Write lights, and let lamps emit as strongly as in the map; default: if lightmaps are stripped
    #[arg(long, value_enum)]
    lights: Option<LightChoice>,
    /// Factor of all light; default: the factor that makes the map as bright as in the game
    #[arg(long, value_parser = positive)]
    light_scale: Option<f32>,
    /// Place of images: as usual for the format, inside the file, in a folder beside it, or none
    #[arg(long, value_enum, default_value_t = ImageChoice::Usual)]
    images: ImageChoice,
    /// Texture projection of brush sides in a .map: as usual for the map's game, brush primitives (brushDef), Valve
    /// 220, or the format of Quake
    #[arg(long, value_enum, default_value_t = BrushChoice::Usual)]
    brushes: BrushChoice,
    /// Write moving textures as animations, which strict glTF readers reject
    #[arg(long)]
    animate: bool,
    /// The sky as a box, as a sphere with one panorama, or none
    #[arg(long, value_enum, default_value_t = SkyChoice::Box)]
    sky: SkyChoice,
    /// Let the sky emit as strongly as its light in the map; it then looks brighter than in the game
    #[arg(long)]
    sky_light: bool,
    /// Largest distance of a curve from its mesh, id units
    #[arg(long, default_value_t = 4.0, value_parser = positive)]
    subdivisions: f32,
    /// Fit lights to the lightmaps first, find those that the compiler left out (seconds a map), and write them
    #[arg(long)]
    calibrate: bool,
    /// Cache calibrations in this folder
    #[arg(long, value_name = "DIR", requires = "calibrate")]
    cache: Option<PathBuf>,
    /// Number of maps converted in parallel; default: one a core
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
    /// Print JSON about the written files
    #[arg(long)]
    json: bool,
    /// Print every warning instead of their number
    #[arg(long, short)]
    verbose: bool,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum LightmapChoice {
    /// As vertex colours: every program shows the map lit
    Vertices,
    /// For programs with MOZ_lightmap
    Keep,
    /// For programs that compute light
    Strip,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum LightChoice {
    Keep,
    Strip,
}

/// Treatment of lightmaps, and whether lights are written. Both together only on request, because light would count
/// twice.
fn lighting(args: &ConvertArgs) -> (Lightmaps, bool) {
    let lightmaps = match (args.lightmaps, args.lights) {
        (Some(LightmapChoice::Vertices), _) => Lightmaps::Vertices,
        (Some(LightmapChoice::Keep), _) => Lightmaps::Keep,
        (Some(LightmapChoice::Strip), _) | (None, Some(LightChoice::Keep)) => Lightmaps::Strip,
        (None, None) if args.calibrate => Lightmaps::Strip,
        (None, _) => Lightmaps::Vertices,
    };
    let lights = match args.lights {
        Some(choice) => choice == LightChoice::Keep,
        None => args.calibrate || lightmaps == Lightmaps::Strip,
    };
    (lightmaps, lights)
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum SkyChoice {
    Box,
    Panorama,
    Strip,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum ImageChoice {
    Usual,
    Embed,
    Beside,
    None,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum BrushChoice {
    Usual,
    Primitives,
    Valve,
    Classic,
}

fn parse_format(text: &str) -> Result<Format, String> {
    Format::from_extension(text).ok_or_else(|| {
        let known: Vec<_> = Format::ALL.iter().map(|f| f.extension()).collect();
        format!("formats are {}", known.join(", "))
    })
}

/// Report about a written map.
#[derive(Serialize)]
struct Converted {
    map: String,
    output: PathBuf,
    files: Vec<PathBuf>,
    bytes: u64,
    triangles: usize,
    degenerate_triangles: usize,
    vertices: usize,
    materials: usize,
    images: usize,
    warnings: Vec<String>,
    milliseconds: u128,
}

/// Report about a map that was not written.
#[derive(Serialize)]
struct Failure {
    map: String,
    error: String,
    /// The map's file is invalid, in contrast to an output error.
    bad_input: bool,
}

/// Data that the threads share.
struct Shared<'a> {
    args: &'a ConvertArgs,
    format: Format,
    files: &'a SearchPath,
    materials: &'a Materials,
    images: &'a ImageStore,
}

/// Converts the maps.
pub fn run(args: &ConvertArgs) -> Result<ExitCode> {
    let format = format_of(args)?;
    let mut files = args.game.files()?;
    let inputs = match inputs::find(&mut files, &args.game.paths, &args.inputs) {
        Ok(inputs) => inputs,
        Err(problem) => {
            eprintln!("{}", one_sentence(&problem));
            return Ok(ExitCode::from(BAD_INPUT));
        }
    };
    let outputs = inputs::outputs(&inputs, &args.output, format)?;
    let (materials, _) = load_scripts(&files);
    let images = ImageStore::default();
    let shared = Shared {
        args,
        format,
        files: &files,
        materials: &materials,
        images: &images,
    };
    let bar = ProgressBar::new(inputs.len() as u64);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}")?);
    let results: Vec<Mutex<Option<Result<Converted, Failure>>>> =
        inputs.iter().map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let threads = args
        .jobs
        .or_else(|| std::thread::available_parallelism().ok())
        .map_or(1, NonZeroUsize::get)
        .min(inputs.len());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let (Some(input), Some(output), Some(slot)) =
                        (inputs.get(index), outputs.get(index), results.get(index))
                    else {
                        // all maps are taken
                        break;
                    };
                    bar.set_message(input.to_string());
                    let result = convert(&shared, input, output);
                    if let Ok(mut slot) = slot.lock() {
                        *slot = Some(result);
                    }
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    let results = results
        .into_iter()
        .filter_map(|slot| slot.into_inner().ok().flatten());
    let (mut converted, mut failures) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(one) => converted.push(one),
            Err(one) => failures.push(one),
        }
    }
    report(args, &converted, &failures)?;
    Ok(if failures.is_empty() {
        ExitCode::SUCCESS
    } else if failures.iter().any(|f| f.bad_input) {
        ExitCode::from(BAD_INPUT)
    } else {
        ExitCode::FAILURE
    })
}

/// The format: by name, by the output's extension, or the first one.
fn format_of(args: &ConvertArgs) -> Result<Format> {
    let by_name = args
        .output
        .extension()
        .and_then(|e| Format::from_extension(&e.to_string_lossy()));
    let Some(first) = Format::ALL.first().copied() else {
        bail!("no format");
    };
    Ok(args.format.or(by_name).unwrap_or(first))
}

fn convert(shared: &Shared, input: &Input, output: &Path) -> Result<Converted, Failure> {
    let args = shared.args;
    let begin = Instant::now();
    let failure = |bad_input: bool| {
        move |error: anyhow::Error| Failure {
            map: input.to_string(),
            error: one_sentence(&error),
            bad_input,
        }
    };
    let calibrate = args.calibrate.then(|| CalibrationOptions {
        cache: args.cache.as_ref().map(CalibrationCache::new),
        ..CalibrationOptions::default()
    });
    let options = Options {
        subdivisions: args.subdivisions,
        calibrate,
        ..Options::default()
    };
    let bytes = input.read(shared.files).map_err(failure(true))?;
    let mut bsp = q3bsp::Bsp::parse(&bytes)
        .with_context(|| input.to_string())
        .map_err(failure(true))?;
    drop(bytes);
    let name = input.to_string();
    let found = input.files(shared.files).map_err(failure(false))?;
    let brought = Brought::new(&found, &bsp);
    let (files, materials) = match &brought {
        Some(own) => (&own.files as &dyn GameFiles, &own.materials),
        None => (&found as &dyn GameFiles, shared.materials),
    };
    // the JSON document describes the map file alone
    let external = match shared.format {
        Format::Json => Ok(0),
        _ => external_lightmaps(&mut bsp, files, &input.game_path()),
    };
    let mut world = RelitWorld::from_bsp(files, materials, &input.game_path(), bsp, options);
    world.warnings.extend(external.err());
    let warnings = brought.iter().flat_map(|own| own.warnings.iter());
    world.warnings.extend(warnings.cloned());
    let (lightmaps, lights) = lighting(args);
    let source = Export {
        world: &world,
        files,
        materials,
        images: shared.images,
        options: ExportOptions {
            scale: args.scale,
            lightmaps,
            images: match args.images {
                ImageChoice::Usual => ImagePlace::Usual,
                ImageChoice::Embed => ImagePlace::Embed,
                ImageChoice::Beside => ImagePlace::Beside,
                ImageChoice::None => ImagePlace::None,
            },
            brushes: match args.brushes {
                BrushChoice::Usual => Brushes::Usual,
                BrushChoice::Primitives => Brushes::Primitives,
                BrushChoice::Valve => Brushes::Valve,
                BrushChoice::Classic => Brushes::Classic,
            },
            lights,
            exposure: args.light_scale,
            sky: match args.sky {
                SkyChoice::Box => Sky::Box,
                SkyChoice::Panorama => Sky::Panorama,
                SkyChoice::Strip => Sky::Strip,
            },
            sky_light: args.sky_light,
            animate: args.animate,
        },
    };
    let report = export(&source, shared.format, output)
        .with_context(|| name.clone())
        .map_err(failure(false))?;
    Ok(Converted::new(name, output, report, begin))
}

impl Converted {
    fn new(map: String, output: &Path, report: ExportReport, begin: Instant) -> Converted {
        Converted {
            map,
            output: output.to_owned(),
            bytes: report.files.iter().map(|(_, size)| size).sum(),
            files: report.files.into_iter().map(|(path, _)| path).collect(),
            triangles: report.triangles,
            degenerate_triangles: report.degenerate,
            vertices: report.vertices,
            materials: report.materials,
            images: report.images,
            warnings: report.warnings,
            milliseconds: begin.elapsed().as_millis(),
        }
    }
}

fn report(args: &ConvertArgs, converted: &[Converted], failures: &[Failure]) -> Result<()> {
    if args.json {
        let all = serde_json::json!({ "converted": converted, "failures": failures });
        println!("{}", serde_json::to_string_pretty(&all)?);
    } else {
        for one in converted {
            println!(
                "{} -> {}: {} triangles, {} materials, {} images, {:.1} MiB, {} ms{}",
                one.map,
                one.output.display(),
                one.triangles,
                one.materials,
                one.images,
                one.bytes as f64 / f64::from(1 << 20),
                one.milliseconds,
                match one.warnings.len() {
                    0 => String::new(),
                    _ if args.verbose => ":".to_owned(),
                    1 => "; 1 warning".to_owned(),
                    count => format!("; {count} warnings (--verbose lists them)"),
                }
            );
            for warning in one.warnings.iter().filter(|_| args.verbose) {
                println!("    {warning}");
            }
        }
    }
    for failure in failures {
        eprintln!("{}", failure.error);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: ConvertArgs,
    }

    fn lit(options: &str) -> (Lightmaps, bool) {
        let words = ["convert", "map", "-o", "out.glb"];
        let line = Line::try_parse_from(words.into_iter().chain(options.split_whitespace()));
        lighting(&line.unwrap().args)
    }

    #[test]
    fn light_is_written_twice_only_where_that_is_asked_for() {
        assert_eq!(lit(""), (Lightmaps::Vertices, false));
        assert_eq!(lit("--lightmaps keep"), (Lightmaps::Keep, false));
        assert_eq!(lit("--lightmaps strip"), (Lightmaps::Strip, true));
        assert_eq!(lit("--calibrate"), (Lightmaps::Strip, true));
        assert_eq!(lit("--lights keep"), (Lightmaps::Strip, true));
        assert_eq!(
            lit("--lightmaps keep --lights keep"),
            (Lightmaps::Keep, true)
        );
        assert_eq!(
            lit("--lightmaps strip --lights strip"),
            (Lightmaps::Strip, false)
        );
        assert_eq!(lit("--lightmaps keep --calibrate"), (Lightmaps::Keep, true));
    }
}
