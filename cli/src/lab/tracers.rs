//! `relight-lab tracers`: what each tracer's structures of a map cost, and how fast it traces rays.
//!
//! Coherent rays are those of the camera (`trace_primary_rays`), incoherent ones those of a bounce
//! (`trace_bounce_rays`, one for each pixel in a direction of the cosine lobe); rays to lights (`trace_direct`) lie
//! between. Tracers take turns within a run, so that a slower or faster machine changes all of them alike.

mod report;
mod scene;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use clap::Args;
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use relight::GameFiles;
use relight::viewpoints::VIEW_HEIGHT;
use renderer_vk::{
    Look, MapLightChoice, Renderer, RendererOptions, Settings, Spread, TracerChoice,
};

use self::report::{Report, Row};
use crate::cameras::{Place, places};
use crate::game::Game;
use crate::numbers;
use crate::pictures::write_whole;
use crate::render::parse_size;
use crate::settings::SettingArgs;
use crate::timings::Timings;
use crate::view::{Camera, draw, load, map_name, open};

/// Measure tracers: rays a second, bytes and build time of their structures
///
/// Draws maps and made-up scenes of stated numbers of triangles with each tracer: the driver's pipelines and queries,
/// our hierarchies, uniform grids of several sizes. Prints a table with the median, the least and the most of the runs:
/// milliseconds until the structures of the map are on the device, their bytes, millions of rays a second of the camera,
/// of a bounce and to lights, and the ratios of the first two to our hierarchies' within each run. Rays are counted in
/// all frames.
///
/// Examples: relight-lab tracers oa_dm1 oacmpctf2 -o out/tracers.json;
/// relight-lab tracers --made 36,2064,61562 --size 256x256 --tracer compute --tracer grid=64
#[derive(Args, Debug)]
pub struct TracersArgs {
    /// Maps: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) with one map, or pack.pk3:maps/x.bsp
    #[arg(value_name = "MAP", required_unless_present = "made")]
    maps: Vec<String>,
    #[command(flatten)]
    game: Game,
    /// Made-up scenes of so many triangles each: a room with two boxes, and a ball if there are more than 37
    #[arg(long, value_name = "SIZE,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(14..=4_000_000))]
    made: Vec<u32>,
    /// Tracer, by the names of rt_tracer; grid=CELLS for a grid of so many cells; may be repeated; default: all, with
    /// grids of 16, 32, 64, 128, 256 and the automatic number of cells
    #[arg(long, value_name = "TRACER", value_parser = parse_tracer)]
    tracer: Vec<Variant>,
    /// Views of each map: the camera of the intermission first, then spawn points, evenly out of the map's list
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = numbers::count)]
    views: usize,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "256x256", value_parser = parse_size)]
    size: (u32, u32),
    /// Frames of a view, at least 4, because rays of a frame are known two frames later; the medians leave out the first
    /// 10, or half of them if there are fewer than 20
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(4..))]
    frames: u32,
    /// Number of runs, in which all variants take turns
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// File for the results as JSON, written after each map
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    #[command(flatten)]
    set: SettingArgs,
}

/// A tracer with the cells of its grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Variant {
    tracer: TracerChoice,
    cells: u32,
}

impl Variant {
    const fn of(tracer: TracerChoice, cells: u32) -> Self {
        Self { tracer, cells }
    }

    fn name(self) -> String {
        let name = match self.tracer {
            TracerChoice::Auto => "auto",
            TracerChoice::Pipeline => "pipeline",
            TracerChoice::Query => "query",
            TracerChoice::Compute => "compute",
            TracerChoice::Grid => "grid",
        };
        match self.cells {
            0 => name.to_owned(),
            cells => format!("{name} {cells}"),
        }
    }
}

/// The usual variants.
const ALL: [Variant; 9] = [
    Variant::of(TracerChoice::Pipeline, 0),
    Variant::of(TracerChoice::Query, 0),
    Variant::of(TracerChoice::Compute, 0),
    Variant::of(TracerChoice::Grid, 16),
    Variant::of(TracerChoice::Grid, 32),
    Variant::of(TracerChoice::Grid, 64),
    Variant::of(TracerChoice::Grid, 128),
    Variant::of(TracerChoice::Grid, 256),
    Variant::of(TracerChoice::Grid, 0),
];

/// Parses a tracer's name, or `grid=CELLS`.
fn parse_tracer(text: &str) -> Result<Variant, String> {
    let cells = match text.split_once('=') {
        Some(("grid", cells)) => cells.parse().ok().filter(|cells| *cells <= 256),
        Some(_) => None,
        None => Some(0),
    };
    let name = text.split('=').next().unwrap_or_default();
    let known = ALL
        .into_iter()
        .find(|v| v.cells == 0 && v.name() == name)
        .zip(cells);
    let (variant, cells) =
        known.ok_or("a tracer is pipeline, query, compute, grid or grid=CELLS")?;
    Ok(Variant { cells, ..variant })
}

/// A map to measure.
struct Case {
    name: String,
    files: Arc<dyn GameFiles>,
    path: String,
    /// `None`: those of the map.
    camera: Option<Camera>,
}

/// Field of view of the camera, degrees.
const FOV: f32 = 90.0;

/// Runs the command.
///
/// # Errors
/// There is no Vulkan device, a map cannot be read, or the file cannot be written.
pub fn run(args: &TracersArgs) -> Result<()> {
    let mut cases = Vec::new();
    for map in &args.maps {
        let (files, path) = open(map, &args.game)?;
        cases.push(Case {
            name: map_name(&path).to_owned(),
            files,
            path,
            camera: None,
        });
    }
    for &triangles in &args.made {
        cases.push(Case {
            name: format!("made {triangles}"),
            files: Arc::new(scene::files(triangles as usize)?),
            path: scene::MAP.to_owned(),
            camera: Some(scene::CAMERA),
        });
    }
    let base = Settings {
        rt: Look::Traced,
        rt_lights: MapLightChoice::Prior,
        rt_accumulate: true,
        rt_auto_exposure: false,
        rt_bloom: 0.0,
        rt_bounces: 1,
        ..Settings::full_size()
    };
    let base = args.set.change([], base);
    let variants = match args.tracer.is_empty() {
        true => ALL.to_vec(),
        false => args.tracer.clone(),
    };
    let mut bench = Bench {
        args,
        base,
        renderers: Vec::new(),
    };
    let mut report = Report {
        device: String::new(),
        size: args.size,
        views: args.views,
        frames: args.frames,
        runs: args.runs,
        rows: Vec::new(),
    };
    let steps = cases.len() * variants.len() * args.runs as usize;
    let bar = ProgressBar::new(steps as u64);
    bar.set_style(ProgressStyle::with_template(
        "{msg} {bar:30} {pos}/{len} runs of a tracer, {eta} left",
    )?);
    for case in &cases {
        let mut rows: Vec<Option<Row>> = variants.iter().map(|_| None).collect();
        for run in 0..args.runs {
            for (variant, row) in variants.iter().zip(&mut rows) {
                bar.set_message(format!("{} {}", case.name, variant.name()));
                bar.inc(1);
                if run > 0 && row.is_none() {
                    continue; // the device lacks it
                }
                if let Some(found) = bench.measure(case, *variant)? {
                    match row {
                        Some(row) => row.join(&found),
                        none => *none = Some(found),
                    }
                }
            }
        }
        report.device = bench.device();
        report.rows.extend(rows.into_iter().flatten());
        // after each map, so that an interrupted run leaves what it has
        if let Some(output) = &args.output {
            write_whole(output, report.json()?.as_bytes())?;
        }
    }
    bar.finish_and_clear();
    report.lines().iter().for_each(|line| println!("{line}"));
    Ok(())
}

/// Renderers that keep their pipelines, one for each tracer.
struct Bench<'a> {
    args: &'a TracersArgs,
    base: Settings,
    renderers: Vec<(TracerChoice, Renderer)>,
}

impl Bench<'_> {
    /// Name of the device.
    fn device(&self) -> String {
        let renderer = self.renderers.first();
        renderer.map_or_else(String::new, |(_, r)| r.device_info().name.clone())
    }

    /// The renderer of a tracer.
    fn renderer(&mut self, tracer: TracerChoice) -> Result<&mut Renderer> {
        let place = match self.renderers.iter().position(|(of, _)| *of == tracer) {
            Some(place) => place,
            None => {
                let (width, height) = self.args.size;
                let options = RendererOptions {
                    device: self.args.device.clone(),
                    ..RendererOptions::headless(width, height)
                };
                let renderer = Renderer::new(options);
                let renderer = renderer.context("nothing to measure without a Vulkan device")?;
                self.renderers.push((tracer, renderer));
                self.renderers.len() - 1
            }
        };
        let found = self.renderers.get_mut(place);
        Ok(&mut found.context("the renderer was just made")?.1)
    }

    /// Loads a map with a tracer and draws its views; `None` if the device does not support the tracer.
    fn measure(&mut self, case: &Case, variant: Variant) -> Result<Option<Row>> {
        let settings = Settings {
            rt_tracer: variant.tracer,
            rt_grid_cells: variant.cells,
            ..self.base.clone()
        };
        let args = self.args;
        let renderer = self.renderer(variant.tracer)?;
        let (bsp, entities) = load(renderer, Arc::clone(&case.files), &case.path, &settings)?;
        let cameras: Vec<Camera> = match case.camera {
            Some(camera) => vec![camera],
            None => (places(&bsp.entities(), args.views).into_iter())
                .map(|Place { origin, yaw }| Camera {
                    origin: origin + Vec3::Z * VIEW_HEIGHT,
                    yaw,
                    pitch: 0.0,
                })
                .collect(),
        };
        if cameras.is_empty() {
            bail!("{}: no player can appear there", case.path);
        }
        renderer.count_rays(true);
        // rays and milliseconds of the passes, over the views
        let mut sums = report::PASSES.map(|_| [0.0; 2]);
        for camera in cameras {
            let def = camera.ref_def(args.size, FOV);
            let mut timings = Timings::new(renderer);
            for _ in 0..args.frames {
                let stats = draw(renderer, &entities, &def)?;
                timings.add(renderer, &stats);
            }
            timings.finish(renderer)?;
            let costs = renderer.costs();
            if costs.tracer.as_deref().map(str::to_lowercase)
                != Some(Variant::of(variant.tracer, 0).name())
            {
                return Ok(None);
            }
            for (sum, pass) in sums.iter_mut().zip(report::PASSES) {
                let times = timings.passes().into_iter().find(|(name, _)| *name == pass);
                let ms = times.and_then(|(_, times)| Spread::of(&times));
                let rays = costs.passes.iter().find(|cost| cost.name == pass);
                if let (Some(ms), Some(rays)) = (ms, rays.and_then(|cost| cost.rays)) {
                    sum[0] += rays as f64;
                    sum[1] += ms.median;
                }
            }
        }
        let cost = renderer.structure_cost().context("no structures")?;
        Ok(Some(Row::new(&case.name, variant.name(), &cost, sums)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracers_have_names() {
        for variant in ALL {
            let text = variant.name().replace(' ', "=");
            assert_eq!(parse_tracer(&text), Ok(variant));
        }
        for wrong in [
            "",
            "auto",
            "gpu",
            "grid=",
            "grid=257",
            "compute=16",
            "grid=-1",
        ] {
            assert!(parse_tracer(wrong).is_err(), "{wrong}");
        }
    }
}
