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
/// Geometry with curves, normals and both sets of texture coordinates, materials with their images, lights, entities
/// and cameras. A file appears whole or not at all. Exit code: 0 when everything was written, 2 when some map cannot be
/// read, 1 for everything else.
///
/// Examples: relight convert oa_dm1 -o oa_dm1.glb; relight convert pak1-maps.pk3 -o converted;
/// relight convert pak1-maps.pk3:maps/kaos.bsp my.bsp -o out --format gltf
#[derive(Args, Debug)]
pub struct ConvertArgs {
    /// Maps: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) for all maps in it, or pack.pk3:maps/x.bsp
    #[arg(required = true, value_name = "MAP")]
    inputs: Vec<String>,
    /// File to write, or for several maps the folder; maps of several packs get a folder each
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
    /// What becomes of lightmaps; by default vertices, and strip where lights are asked for
    #[arg(long, value_enum)]
    lightmaps: Option<LightmapChoice>,
    /// Whether lights are written, and lamps shine as strongly as in the map; by default where lightmaps are stripped
    #[arg(long, value_enum)]
    lights: Option<LightChoice>,
    /// What all light is multiplied by; by default so much that the map is as bright as in the game
    #[arg(long, value_parser = positive)]
    light_scale: Option<f32>,
    /// Where images go: as usual for the format, inside the file, into a folder beside it, or nowhere
    #[arg(long, value_enum, default_value_t = ImageChoice::Usual)]
    images: ImageChoice,
    /// How sides of brushes in a .map say how their textures lie: as the editors of the map's game have it, as brush
    /// primitives (brushDef), as Valve 220, or in Quake's first form
    #[arg(long, value_enum, default_value_t = BrushChoice::Usual)]
    brushes: BrushChoice,
    /// Write moving textures as animations, which strict readers of glTF refuse
    #[arg(long)]
    animate: bool,
    /// The sky as a box, as a ball with one picture all round, or none
    #[arg(long, value_enum, default_value_t = SkyChoice::Box)]
    sky: SkyChoice,
    /// Let the sky shine as strongly as its light in the map; it then looks brighter than in the game
    #[arg(long)]
    sky_light: bool,
    /// Largest distance of a curve from its mesh, id units
    #[arg(long, default_value_t = 4.0, value_parser = positive)]
    subdivisions: f32,
    /// Fit lights to the lightmaps first, find those again that the compiler left out (some seconds a map), and write
    /// them
    #[arg(long)]
    calibrate: bool,
    /// Keep what calibration finds in this folder, and take it from there
    #[arg(long, value_name = "DIR", requires = "calibrate")]
    cache: Option<PathBuf>,
    /// Maps converted at a time; by default one a core
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
    /// Print every warning instead of their number
    #[arg(long, short)]
    verbose: bool,
}

#[derive(ValueEnum, Clone, Copy, Debug)]
enum LightmapChoice {
    /// Into colours of vertices: every program shows the map lit
    Vertices,
    /// For programs that know MOZ_lightmap
    Keep,
    /// For programs that compute light
    Strip,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum LightChoice {
    Keep,
    Strip,
}

/// What becomes of lightmaps and whether lights are written. Light is not written twice unless that is asked for.
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

/// What is told about a map that was written.
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

/// What is told about a map that was not.
#[derive(Serialize)]
struct Failure {
    map: String,
    error: String,
    /// Whether the map is at fault.
    bad_input: bool,
}

/// Everything that the threads share.
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
                        // All maps are taken.
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
    tell(args, &converted, &failures)?;
    Ok(if failures.is_empty() {
        ExitCode::SUCCESS
    } else if failures.iter().any(|f| f.bad_input) {
        ExitCode::from(BAD_INPUT)
    } else {
        ExitCode::FAILURE
    })
}

/// The format asked for: by name, by the output's extension, or the first of all.
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
    // JSON is the file as it is.
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

fn tell(args: &ConvertArgs, converted: &[Converted], failures: &[Failure]) -> Result<()> {
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
                    count => format!("; {count} warnings"),
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
