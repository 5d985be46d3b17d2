//! `relight-lab looks`: views in the classic and the traced look, with lights by directives and calibrated, side by
//! side.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use relight::compare::Rgb8;
use relight::viewpoints::VIEW_HEIGHT;
use renderer_vk::api::RefDef;
use renderer_vk::{Look, MapLightChoice, Renderer, RendererOptions, Settings};
use serde_json::{Value, json};

use super::chromaticity::ColorDifference;
use super::statistics::luminance;
use crate::cameras::places;
use crate::game::Maps;
use crate::render::parse_size;
use crate::settings::SettingArgs;
use crate::view::{Camera, draw, load, map_name, open};

/// Draw views in the classic and the traced look, side by side, and compare their brightness and colour
///
/// Views are the camera of the intermission and spawn points. Prints for each map, with lights by directives and
/// calibrated: the mean luminance of the traced pictures over that of the classic ones; the mean distance of their
/// colours in CIE 1976 (u', v'), times 1000; and their mean saturation over that of the classic ones.
///
/// Example: relight-lab looks oa_dm1 fan --views 4 --output out
#[derive(Args, Debug)]
pub struct LooksArgs {
    #[command(flatten)]
    chosen: Maps,
    /// Views of each map: the camera of the intermission first, then spawn points, evenly out of the map's list
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = crate::numbers::count)]
    views: usize,
    /// Size in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "320x240", value_parser = parse_size)]
    size: (u32, u32),
    /// Frames accumulated for a traced picture
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Draw frames as the game does, without accumulation
    #[arg(long)]
    no_accumulation: bool,
    /// Disable automatic exposure
    #[arg(long)]
    fixed_exposure: bool,
    /// Folder for pictures: classic, traced by directives, traced calibrated, from left to right
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// Cache calibrations in this folder
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Vulkan device: part of its name
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Print JSON in place of a table: one object a map, null for looks without a view
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    set: SettingArgs,
}

/// The looks, from left to right.
const LOOKS: [Option<MapLightChoice>; 3] = [
    None,
    Some(MapLightChoice::Prior),
    Some(MapLightChoice::Calibrated),
];

/// Runs the command.
///
/// # Errors
/// A map cannot be loaded, there is no Vulkan device, a picture cannot be written.
pub fn run(args: &LooksArgs) -> Result<()> {
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot be made", folder.display()))?;
    }
    if !args.json {
        println!(
            "{:20} {:>5} {:>9} {:>11} {:>9} {:>11} {:>10} {:>10}",
            "", "", "luminance", "", "colour", "", "saturation", ""
        );
        println!(
            "{:20} {:>5} {:>9} {:>11} {:>9} {:>11} {:>10} {:>10}",
            "map",
            "views",
            "by prior",
            "calibrated",
            "by prior",
            "calibrated",
            "by prior",
            "calibrated"
        );
    }
    let mut all = Sums::default();
    for map in &args.chosen.maps {
        let sums = one(args, map)?;
        if args.json {
            println!("{}", sums.as_json(map));
        } else {
            sums.print_line(map);
        }
        all.join(&sums);
    }
    if !args.json {
        all.print_line("all");
    }
    Ok(())
}

/// Sums over views.
#[derive(Default)]
struct Sums {
    views: usize,
    /// Mean luminances of the pictures in each look.
    luminance: [f64; 3],
    /// Chromaticity of the traced looks against the classic look.
    color: [ColorDifference; 2],
}

impl Sums {
    fn join(&mut self, other: &Sums) {
        self.views += other.views;
        for (all, sum) in self.luminance.iter_mut().zip(other.luminance) {
            *all += sum;
        }
        for (all, sum) in self.color.iter_mut().zip(&other.color) {
            all.join(sum);
        }
    }

    /// Luminance by directives and calibrated, over that of the classic look.
    fn brightness(&self) -> [f64; 2] {
        let [classic, prior, calibrated] = self.luminance;
        [prior, calibrated].map(|sum| sum / classic.max(1e-9))
    }

    fn print_line(&self, name: &str) {
        if self.views == 0 {
            println!("{name:20} {:5} {:>9}", 0, "–");
            return;
        }
        let [prior, calibrated] = self.brightness();
        let [by_prior, by_calibrated] = &self.color;
        println!(
            "{name:20} {:5} {prior:9.3} {calibrated:11.3} {:9.1} {:11.1} {:10.3} {:10.3}",
            self.views,
            by_prior.mean() * 1000.0,
            by_calibrated.mean() * 1000.0,
            by_prior.saturation(),
            by_calibrated.saturation(),
        );
    }

    fn as_json(&self, map: &str) -> Value {
        let [prior, calibrated] = self.brightness();
        let [by_prior, by_calibrated] = &self.color;
        let look = |luminance: f64, color: &ColorDifference| {
            if self.views == 0 {
                return Value::Null;
            }
            json!({
                "luminance": luminance,
                "color_distance": color.mean(),
                "saturation": color.saturation(),
            })
        };
        json!({
            "map": map,
            "views": self.views,
            "prior": look(prior, by_prior),
            "calibrated": look(calibrated, by_calibrated),
        })
    }
}

/// The views of one map in each look.
fn one(args: &LooksArgs, map: &str) -> Result<Sums> {
    let (files, path) = open(map, &args.chosen.game)?;
    let (width, height) = args.size;
    let mut renderer = Renderer::new(RendererOptions {
        device: args.device.clone(),
        ..RendererOptions::headless(width, height)
    })
    .context("no picture without a Vulkan device")?;
    renderer.keep_calibrations(args.cache.clone());
    let chosen = args.set.change([], Settings::full_size());
    let settings = |look: Option<MapLightChoice>| Settings {
        rt: match look {
            Some(_) => Look::Traced,
            None => Look::Classic,
        },
        // The classic look does not read it.
        rt_lights: look.unwrap_or_default(),
        rt_accumulate: !args.no_accumulation,
        rt_auto_exposure: !args.fixed_exposure,
        ..chosen.clone()
    };
    let (bsp, entities) = load(&mut renderer, files, &path, &settings(None))?;
    let places = places(&bsp.entities(), args.views);
    if places.is_empty() {
        log::warn!("{path}: no picture; the game sets no player anywhere in it");
    }
    let cameras: Vec<Camera> = places
        .iter()
        .map(|place| Camera {
            origin: place.origin + glam::Vec3::Z * VIEW_HEIGHT,
            yaw: place.yaw,
            pitch: 0.0,
        })
        .collect();
    let mut pictures: Vec<Vec<Rgb8>> = cameras.iter().map(|_| Vec::new()).collect();
    let mut sums = Sums {
        views: cameras.len(),
        ..Sums::default()
    };
    for (look, sum) in LOOKS.into_iter().zip(&mut sums.luminance) {
        renderer.set_settings(&settings(look));
        for (camera, pictures) in cameras.iter().zip(&mut pictures) {
            let def: RefDef = camera.ref_def(args.size, 90.0);
            let frames = if look.is_some() {
                args.frames.max(1)
            } else {
                1
            };
            for _ in 0..frames {
                draw(&mut renderer, &entities, &def)?;
            }
            let picture = renderer.read_pixels()?;
            let picture = Rgb8::new(width as usize, height as usize, picture.rgb)?;
            let shown = luminance(&picture);
            let whole: f64 = shown.iter().copied().map(f64::from).sum();
            *sum += whole / shown.len().max(1) as f64;
            pictures.push(picture);
        }
    }
    for pictures in &pictures {
        // The first is of the classic look.
        for (picture, color) in pictures.iter().skip(1).zip(&mut sums.color) {
            color.add(picture, &pictures[0]);
        }
    }
    if let Some(folder) = &args.output {
        for (number, pictures) in pictures.iter().enumerate() {
            let file = folder.join(format!("{}_{number}.png", map_name(&path)));
            save(&file, pictures, args.size)?;
        }
    }
    Ok(sums)
}

/// Writes pictures of one size side by side.
fn save(file: &std::path::Path, pictures: &[Rgb8], (width, height): (u32, u32)) -> Result<()> {
    let mut rows = Vec::with_capacity((width * height * 3) as usize * pictures.len());
    for row in 0..height as usize {
        for picture in pictures {
            let bytes = width as usize * 3;
            let row = picture.pixels().get(row * bytes..(row + 1) * bytes);
            // all pictures of a map have one size
            rows.extend_from_slice(row.unwrap_or_default());
        }
    }
    let whole = width * pictures.len() as u32;
    image::save_buffer(file, &rows, whole, height, image::ColorType::Rgb8)
        .with_context(|| format!("{}: cannot be written", file.display()))
}
