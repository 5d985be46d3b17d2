//! `relight-lab estimators`: bias and noise of the ways to sample lights.

use std::sync::Arc;

use anyhow::{Context, Result};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use relight::GameFiles;
use renderer_vk::api::RefEntity;
use renderer_vk::{LightSelection, Look, MapLightChoice, Renderer, RendererOptions, Settings};
use serde_json::{Value, json};

use super::growth::scene;
use crate::chosen::parse_view;
use crate::game::Game;
use crate::render::parse_size;
use crate::settings::{Assignment, SettingArgs, default, help, value_of};
use crate::view::{Camera, draw, load, open};

/// Compare the ways to sample lights: all have the same mean
///
/// Renders a view with every light of the list (the reference), with one light chosen uniformly, with one chosen by
/// importance from the lists, from a tree over all lights, from the lists with the samples of neighbouring pixels, from
/// one list of all lights, and with every light of the map. Prints for each the relative difference of the whole
/// picture, and of the worst tile of 16 x 16 pixels, from the reference, in percent and in standard errors (noise stays
/// below 4 or 5, bias grows with the frames), and the noise of the first frame, of 16 and of all: the mean squared
/// error over the squared mean of the picture, times the frames. Frames that are independent have the same noise; that
/// of all frames includes the noise of the reference. Milliseconds are those of the passes that sample lights for
/// visible surfaces and trace the rays, on the GPU; bytes and build times those of the lists or of the tree. JSON also
/// has the mean over the pixels of the squared error over the squared pixel, where pixels below a hundredth of the
/// picture's mean count as that. A tile darker than a hundredth of the picture is measured against that. --tiles adds
/// the noisiest tiles of each estimator: position, relative brightness, difference and standard error of its mean.
/// These predict the noise after more frames: the standard error falls at least with the square root of the frames.
///
/// Example: relight-lab estimators oa_dm1 --frames 4096 --size 512x384
#[derive(Args, Debug)]
pub struct EstimatorsArgs {
    /// Maps: a name (oa_dm1), maps/oa_dm1.bsp, a .bsp file, a pack (.pk3) with one map, or pack.pk3:maps/x.bsp
    #[arg(value_name = "MAP", required_unless_present = "made")]
    maps: Vec<String>,
    #[command(flatten)]
    game: Game,
    /// Made-up halls with so many lights each
    #[arg(long, value_name = "SIZE,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=100_000))]
    made: Vec<u32>,
    /// Only estimators whose name begins with this, besides the reference; may be repeated
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Take every light of the map as the reference, not those of the lists
    #[arg(long)]
    unculled_reference: bool,
    /// Frames of each estimator
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Frames of the reference; default: a sixteenth of the others', at least 16
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    reference: Option<u32>,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "512x384", value_parser = parse_size)]
    size: (u32, u32),
    #[arg(long, help = help("rt_bounces"), value_parser = value_of("rt_bounces"), default_value = "0")]
    bounces: Assignment,
    #[arg(long, help = help("rt_candidates"), value_parser = value_of("rt_candidates"), default_value = default("rt_candidates"))]
    candidates: Assignment,
    /// Omit the pictures lit by every light of the map
    #[arg(long)]
    no_unculled: bool,
    /// Print this number of the noisiest tiles of each estimator
    #[arg(long, default_value_t = 0)]
    tiles: usize,
    /// Camera: position in units, yaw and pitch (down) in degrees, which may be left out; default: the map's
    /// intermission or first spawn point
    #[arg(long, value_parser = parse_view, allow_hyphen_values = true, value_name = "X,Y,Z,YAW,PITCH")]
    view: Option<Camera>,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Print JSON in place of a table: one object a map and estimator
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    set: SettingArgs,
}

/// Side of a tile, pixels.
const TILE: usize = 16;

/// Numbers of frames at which noise is measured, besides all frames.
const NOISE_FRAMES: [u32; 2] = [1, 16];

/// Passes that sample lights for visible surfaces, and trace rays to them.
const DIRECT: [&str; 2] = ["trace_sample_lights", "trace_direct"];

/// A picture: linear RGB.
type Picture = Vec<[f32; 3]>;

/// Result of an estimator.
struct Rendered {
    /// Mean of all frames.
    mean: Picture,
    frames: u32,
    /// Means of the first frames, with their number.
    early: Vec<(u32, Picture)>,
    /// Median time of the passes for direct light without suns, milliseconds.
    time: f32,
}

struct Stage {
    renderer: Renderer,
    entities: Vec<RefEntity>,
    camera: Camera,
    size: (u32, u32),
}

impl Stage {
    /// Renders `frames` frames: their mean, those of the first ones, and the median time of the passes for direct light.
    fn render(&mut self, name: &str, settings: &Settings, frames: u32) -> Result<Rendered> {
        let bar = ProgressBar::new(frames.into());
        bar.set_style(ProgressStyle::with_template(
            "{msg} {bar:40} {pos}/{len} frames, {eta} left",
        )?);
        bar.set_message(name.to_owned());
        self.renderer.set_settings(settings);
        let mut early = Vec::new();
        let mut times = Vec::new();
        for frame in 1..=frames {
            let def = self.camera.ref_def(self.size, 90.0);
            draw(&mut self.renderer, &self.entities, &def)?;
            if NOISE_FRAMES.contains(&frame) {
                early.push((frame, self.renderer.read_radiance()?));
            }
            let passes = self.renderer.timings();
            let direct = passes.iter().filter(|p| DIRECT.contains(&p.0.as_str()));
            times.push(direct.map(|p| p.1).sum());
            bar.inc(1);
        }
        bar.finish_and_clear();
        times.sort_by(f32::total_cmp);
        let mean = self.renderer.read_radiance()?;
        Ok(Rendered {
            mean,
            frames,
            early,
            time: times.get(times.len() / 2).copied().unwrap_or(0.0),
        })
    }
}

fn level(p: &[f32; 3]) -> f64 {
    f64::from(p[0] + p[1] + p[2]) / 3.0
}

/// A part of a picture against the same part of its reference.
struct Score {
    /// Its first pixel.
    at: (usize, usize),
    /// Mean of the reference over that of its whole picture.
    brightness: f64,
    /// Relative difference of the mean.
    difference: f64,
    /// Standard error of the difference.
    error: f64,
}

impl Score {
    /// `mean`: of the reference's whole picture; parts darker than a hundredth of it are measured against that.
    fn new<'a>(
        at: (usize, usize),
        pixels: impl Iterator<Item = (&'a [f32; 3], &'a [f32; 3])>,
        mean: f64,
    ) -> Self {
        // pixels are independent, so the variance of the sum is estimated by the sum of their squared differences
        let (mut sum, mut squares, mut light, mut count) = (0.0, 0.0, 0.0, 0.0f64);
        for (a, b) in pixels {
            let d = level(a) - level(b);
            sum += d;
            squares += d * d;
            light += level(b);
            count += 1.0;
        }
        let floor = (mean * 0.01).max(1.0e-9);
        let against = light.max(floor * count);
        Self {
            at,
            brightness: light / (count * mean).max(1.0e-9),
            difference: sum.abs() / against,
            error: squares.sqrt() / against,
        }
    }

    fn standard_errors(&self) -> f64 {
        if self.error > 0.0 {
            self.difference / self.error
        } else {
            0.0
        }
    }

    fn json(&self) -> Value {
        json!({
            "at": [self.at.0, self.at.1],
            "brightness": self.brightness,
            "difference": self.difference,
            "standard_error": self.error,
        })
    }
}

/// Relative differences of the picture and of its tiles, with the `noisiest` noisiest tiles.
fn compare(picture: &Picture, truth: &Picture, width: usize, noisiest: usize) -> Value {
    let mean = truth.iter().map(level).sum::<f64>() / truth.len().max(1) as f64;
    let all = Score::new((0, 0), picture.iter().zip(truth), mean);
    let height = truth.len() / width.max(1);
    let mut tiles = Vec::new();
    for y in (0..height).step_by(TILE) {
        for x in (0..width).step_by(TILE) {
            let pixels = (y..(y + TILE).min(height)).flat_map(|row| {
                let range = row * width + x..row * width + (x + TILE).min(width);
                let rows = picture.get(range.clone()).zip(truth.get(range));
                rows.into_iter().flat_map(|(a, b)| a.iter().zip(b))
            });
            tiles.push(Score::new((x, y), pixels, mean));
        }
    }
    let worst = (tiles.iter()).max_by(|a, b| a.difference.total_cmp(&b.difference));
    let strangest = tiles.iter().map(Score::standard_errors).fold(0.0, f64::max);
    let mean_tile = tiles.iter().map(|t| t.difference).sum::<f64>() / tiles.len().max(1) as f64;
    let mut line = json!({
        "difference": all.difference,
        "standard_errors": all.standard_errors(),
        "mean_tile_difference": mean_tile,
        "worst_tile_difference": worst.map_or(0.0, |w| w.difference),
        "worst_tile": worst.map(|w| [w.at.0, w.at.1]),
        "worst_tile_standard_errors": strangest,
    });
    tiles.sort_by(|a, b| b.error.total_cmp(&a.error));
    line["noisiest_tiles"] = tiles.iter().take(noisiest).map(Score::json).collect();
    line
}

/// Mean squared error over the squared mean of the picture, times the number of frames in the picture.
fn noise(early: &Picture, truth: &Picture, frames: u32) -> f64 {
    let mean = truth.iter().map(level).sum::<f64>() / truth.len().max(1) as f64;
    let squares = early
        .iter()
        .zip(truth)
        .map(|(a, b)| (level(a) - level(b)).powi(2));
    squares.sum::<f64>() / truth.len().max(1) as f64 * f64::from(frames) / (mean * mean).max(1e-18)
}

/// Mean over the pixels of the squared error over the squared pixel, times the frames.
fn relative_noise(early: &Picture, truth: &Picture, frames: u32) -> f64 {
    let count = truth.len().max(1) as f64;
    let floor = truth.iter().map(level).sum::<f64>() / count * 0.01;
    let squares = early
        .iter()
        .zip(truth)
        .map(|(a, b)| ((level(a) - level(b)) / (level(b) + floor).max(1e-9)).powi(2));
    squares.sum::<f64>() / count * f64::from(frames)
}

/// Prints an estimator's JSON as a row of a table.
fn row(line: &Value) {
    let number = |key: &str| line.get(key).and_then(Value::as_f64).unwrap_or(0.0);
    let noise = |path: &str| line.pointer(path).and_then(Value::as_f64).unwrap_or(0.0);
    println!(
        "{:<18} {:>6} {:>9.3} % {:>7.1} {:>9.2} % {:>7.1} {:>9.3} {:>9.3} {:>9.3} {:>9.2} {:>10.2} {:>8.0} {:>9.1}",
        line["estimator"].as_str().unwrap_or("?"),
        number("frames"),
        number("difference") * 100.0,
        number("standard_errors"),
        number("worst_tile_difference") * 100.0,
        number("worst_tile_standard_errors"),
        noise("/noise/0/noise"),
        noise("/noise/1/noise"),
        line.pointer("/noise")
            .and_then(Value::as_array)
            .and_then(|all| all.last()?.get("noise")?.as_f64())
            .unwrap_or(0.0),
        number("direct_ms"),
        number("direct_ms") * noise("/noise/0/noise"),
        number("structure_bytes") / 1024.0,
        number("structure_ms"),
    );
    let tiles = line.get("noisiest_tiles").and_then(Value::as_array);
    for tile in tiles.into_iter().flatten() {
        let number = |path: &str| tile.pointer(path).and_then(Value::as_f64).unwrap_or(0.0);
        println!(
            "  tile at {:>4} {:>4}: {:>7.3} of the brightness, {:>6.2} % off, standard error {:>6.2} %",
            number("/at/0"),
            number("/at/1"),
            number("/brightness"),
            number("/difference") * 100.0,
            number("/standard_error") * 100.0,
        );
    }
}

/// A scene to render.
struct Subject {
    name: String,
    files: Arc<dyn GameFiles>,
    map: String,
    /// `None`: that of the map.
    camera: Option<Camera>,
}

/// Runs the command: a table for each map, or one JSON object a map and estimator.
pub fn run(args: &EstimatorsArgs) -> Result<()> {
    for map in &args.maps {
        let (files, map) = open(map, &args.game)?;
        let subject = Subject {
            name: map.clone(),
            files,
            map,
            camera: args.view,
        };
        compare_on(args, subject, MapLightChoice::Calibrated)?;
    }
    for &lights in &args.made {
        let made = scene::Made {
            lights: lights as usize,
            ..scene::Made::default()
        };
        let subject = Subject {
            name: format!("made {lights}"),
            files: Arc::new(made.files()?),
            map: scene::MAP.to_owned(),
            camera: Some(args.view.unwrap_or(scene::CAMERA)),
        };
        compare_on(args, subject, MapLightChoice::Prior)?;
    }
    Ok(())
}

/// The estimators beside the reference, with the frames of each.
fn ways(args: &EstimatorsArgs, base: &Settings, reference: u32) -> Vec<(String, Settings, u32)> {
    let with = |selection| Settings {
        rt_light_selection: selection,
        ..base.clone()
    };
    let way = |name: &str, settings| (name.to_owned(), settings, args.frames);
    let mut ways = vec![
        way("uniform", with(LightSelection::Uniform)),
        way("resampled", with(LightSelection::Resampled)),
        way("tree", with(LightSelection::Tree)),
    ];
    if base.rt_candidates > 1 {
        let alone = Settings {
            rt_candidates: 1,
            ..with(LightSelection::Tree)
        };
        ways.push(way("tree, 1 candidate", alone));
    }
    ways.push(way("reused", with(LightSelection::Reused)));
    if !args.no_unculled {
        let one = Settings {
            rt_cull_lights: false,
            ..with(LightSelection::Resampled)
        };
        ways.push(way("one list", one));
        let all = Settings {
            rt_cull_lights: false,
            rt_num_random_dl: 0,
            ..base.clone()
        };
        ways.push(("all, not culled".to_owned(), all, reference));
    }
    let chosen =
        |name: &str| args.only.is_empty() || args.only.iter().any(|only| name.starts_with(only));
    ways.retain(|(name, ..)| chosen(name));
    ways
}

/// Compares the estimators on a scene with these lights of the map.
fn compare_on(args: &EstimatorsArgs, subject: Subject, lights: MapLightChoice) -> Result<()> {
    let Subject {
        name: map,
        files,
        map: path,
        camera,
    } = subject;
    let base = Settings {
        rt: Look::Traced,
        rt_accumulate: true,
        rt_auto_exposure: false,
        // only light sampling may cause differences
        rt_antialiasing: false,
        rt_num_random_dl: 1,
        rt_lights: lights,
        ..Settings::full_size()
    };
    let base = (args.set).change([&args.bounces, &args.candidates], base);
    let (width, height) = args.size;
    let mut renderer = Renderer::new(RendererOptions {
        device: args.device.clone(),
        ..RendererOptions::headless(width, height)
    })
    .context("no picture without a Vulkan device")?;
    let (bsp, entities) = load(&mut renderer, files, &path, &base)?;
    let camera = (camera.or_else(|| Camera::of_map(&bsp)))
        .context("the map has no place for a camera; set one with --view")?;
    let mut stage = Stage {
        renderer,
        entities,
        camera,
        size: args.size,
    };
    let all = Settings {
        rt_num_random_dl: 0,
        rt_cull_lights: !args.unculled_reference,
        ..base.clone()
    };
    let reference = args.reference.unwrap_or((args.frames / 16).max(16));
    let truth = stage.render(&format!("{map} all"), &all, reference)?;
    let print = |name: &str, rendered: &Rendered, structure: (u64, f64)| {
        let mut line = compare(&rendered.mean, &truth.mean, width as usize, args.tiles);
        line["map"] = json!(map);
        line["estimator"] = json!(name);
        line["frames"] = json!(rendered.frames);
        line["direct_ms"] = json!(rendered.time);
        line["structure_bytes"] = json!(structure.0);
        line["structure_ms"] = json!(structure.1);
        let early = rendered.early.iter().map(|(frames, p)| (*frames, p));
        let noises = early
            .chain([(rendered.frames, &rendered.mean)])
            .map(|(frames, p)| {
                json!({
                    "frames": frames,
                    "noise": noise(p, &truth.mean, frames),
                    "relative": relative_noise(p, &truth.mean, frames),
                })
            });
        line["noise"] = noises.collect();
        if args.json {
            println!("{line}");
        } else {
            row(&line);
        }
    };
    let cost = |stage: &Stage| stage.renderer.light_cost().unwrap_or_default();
    let lists = cost(&stage);
    let of_lists = (lists.lists_bytes, lists.lists_ms);
    if !args.json {
        println!("{map}: {} lights", lists.lights);
        println!(
            "{:<18} {:>6} {:>11} {:>7} {:>11} {:>7} {:>9} {:>9} {:>9} {:>9} {:>10} {:>8} {:>9}",
            "estimator",
            "frames",
            "difference",
            "errors",
            "worst tile",
            "errors",
            "noise 1",
            "noise 16",
            "noise all",
            "direct ms",
            "noise x ms",
            "KiB",
            "build ms"
        );
    }
    print("all", &truth, of_lists);
    for (name, settings, frames) in ways(args, &base, reference) {
        let rendered = stage.render(&format!("{map} {name}"), &settings, frames)?;
        let tree = cost(&stage).tree_bytes.zip(cost(&stage).tree_ms);
        let structure = match settings.rt_light_selection {
            LightSelection::Tree => tree.unwrap_or_default(),
            _ => of_lists,
        };
        print(&name, &rendered, structure);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noisiest_tiles_are_listed_with_their_standard_error() {
        // four tiles; one is off up and down by a tenth, a darker one by a fifth up
        let (width, height) = (2 * TILE, 2 * TILE);
        let pixel = |i: usize| (i % width / TILE, i / width / TILE);
        let truth: Picture = (0..width * height)
            .map(|i| [if pixel(i) == (0, 1) { 0.5 } else { 1.0 }; 3])
            .collect();
        let off = |i: usize, level: f32| match pixel(i) {
            (1, 0) => level * if i.is_multiple_of(2) { 1.1 } else { 0.9 },
            (0, 1) => level * 1.2,
            _ => level,
        };
        let picture: Picture = (truth.iter().enumerate())
            .map(|(i, p)| p.map(|level| off(i, level)))
            .collect();
        let report = compare(&picture, &truth, width, 2);
        let tiles = report["noisiest_tiles"].as_array().unwrap();
        assert_eq!(tiles.len(), 2);
        let near = |path: &str, expected: f64| {
            let found = report.pointer(path).and_then(Value::as_f64).unwrap();
            assert!((found - expected).abs() < 1.0e-5, "{path}: {found}");
        };
        assert_eq!(tiles[0]["at"], json!([0, TILE]));
        near("/noisiest_tiles/0/brightness", 0.5 / 0.875);
        near("/noisiest_tiles/0/difference", 0.2);
        // the square root of 256 squares over 256 pixels
        near("/noisiest_tiles/0/standard_error", 0.2 / 16.0);
        assert_eq!(tiles[1]["at"], json!([TILE, 0]));
        near("/noisiest_tiles/1/difference", 0.0);
        near("/noisiest_tiles/1/standard_error", 0.1 / 16.0);
        near("/worst_tile_difference", 0.2);
        near("/difference", 0.1 / 3.5);
        near("/standard_errors", 25.6 / (256.0f64 * 0.01 * 2.0).sqrt());
    }
}
