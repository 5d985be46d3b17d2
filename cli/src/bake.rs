//! `relight bake`: light of a map's sources, written into the map.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use q3bsp::{Bsp, Entity, map_text};
use relight::bake::{BakeOptions, BakeStage, Baked, Gather, Rays, Stored, bake};
use relight::export::Output;
use relight::light::LightColor;
use relight::{
    CalibrationCache, CalibrationOptions, GameFiles, Options, RelitWorld, external_lightmaps,
};

use crate::game::Maps;
use crate::numbers::positive;
use crate::scripts::load_scripts;
use crate::view::open;

/// Compute the light of maps, and write it into them
///
/// Writes lightmaps, vertex colours and the light grid anew; everything else in the map stays as it is. The light of a
/// finished map comes from sources that calibration finds; that of a map without lightmaps from its scripts and entities.
///
/// Examples: relight bake oa_dm1 -o oa_dm1.bsp; relight bake mymap.bsp -o mymap.bsp --bounce 4;
/// relight bake oa_dm1 kaos2 -o baked
#[derive(Args, Debug)]
pub struct BakeArgs {
    #[command(flatten)]
    maps: Maps,
    /// Output file, or for several maps the folder
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Do not fit lights to the map's lightmaps first (the game does)
    #[arg(long)]
    no_calibration: bool,
    /// Cache calibrations and swept light lists in this folder
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Diffuse bounces; default: 1 with lights found by calibration, else 8
    #[arg(long, value_name = "N")]
    bounce: Option<u32>,
    /// Shadow rays from a point to each light; 0: one to its middle, for hard shadows
    #[arg(long, value_name = "N")]
    samples: Option<u32>,
    /// Points along each side of a texel, 1 to 8
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8))]
    pattern: Option<u32>,
    /// One point a texel, one shadow ray to a light, one bounce: for a first look
    #[arg(long)]
    fast: bool,
    /// Gamma of stored light, as the compiler's -gamma; default: 1, or what calibration found
    #[arg(long, value_parser = positive)]
    gamma: Option<f32>,
    /// Divisor of stored light after gamma, as the compiler's -compensate
    #[arg(long, default_value_t = 1.0, value_parser = positive)]
    compensate: f32,
    /// Leave the light grid, which lights models, as it is
    #[arg(long)]
    no_grid: bool,
}

/// Runs the command.
pub fn run(args: &BakeArgs) -> Result<()> {
    let several = args.maps.maps.len() > 1;
    for map in &args.maps.maps {
        let output = match several {
            true => {
                let stem = Path::new(map).file_stem().unwrap_or_default();
                args.output.join(stem).with_extension("bsp")
            }
            false => args.output.clone(),
        };
        bake_map(args, map, &output)?;
    }
    Ok(())
}

/// Bakes one map.
fn bake_map(args: &BakeArgs, map: &str, output: &Path) -> Result<()> {
    let begin = Instant::now();
    let (files, name) = open(map, &args.maps.game)?;
    let bytes = files.read(&name)?;
    let bytes = bytes.with_context(|| format!("{name}: no such file in the game folders"))?;
    let original = Bsp::parse(&bytes).with_context(|| name.clone())?;
    let mut lit = original.clone();
    add_lights_of_source(&mut lit, map)?;
    let world = load(args, &*files, &name, lit)?;
    let loaded = begin.elapsed();
    let options = options(args, &world);
    let mut gather = Rays::new(&world);
    let baked = bake_with_bar(&world, &mut gather, &options)?;
    let mut changed = original.clone();
    let stored = baked.store(&world, &mut changed, options.encoding);
    if stored == Stored::default() {
        bail!(
            "{name}: nothing in it stores light: no lightmaps, no vertices that are lit, no light grid"
        );
    }
    let mut out = Output::new(output);
    out.write_main(&changed.write())?;
    out.finish()?;
    report(&name, &stored, &baked, &original, &changed);
    println!(
        "{}: {:.1} s, {:.1} s of these for {} by {}",
        output.display(),
        begin.elapsed().as_secs_f64(),
        loaded.as_secs_f64(),
        if world.calibration.is_some() {
            "lights found by calibration"
        } else {
            "loading"
        },
        gather.name(),
    );
    Ok(())
}

/// Adds the light entities of the `.map` file beside a `.bsp` file: compilers leave them out of the map, and read that file
/// for light. Does nothing for a map without that file, or with light entities of its own.
///
/// # Errors
/// The file cannot be read.
fn add_lights_of_source(bsp: &mut Bsp, map: &str) -> Result<()> {
    let source = Path::new(map).with_extension("map");
    let own = bsp.entities();
    let is_light = |entity: &Entity| entity.classname().to_ascii_lowercase().starts_with("light");
    if !Path::new(map).is_file() || !source.is_file() || own.iter().any(is_light) {
        return Ok(());
    }
    let text = std::fs::read(&source).with_context(|| format!("{}", source.display()))?;
    let entities = map_text::parse(&text).with_context(|| format!("{}", source.display()))?;
    let mut lights = String::new();
    let mut count = 0;
    for entity in entities.iter().map(|e| &e.entity) {
        // lights point at others
        if is_light(entity) || entity.get("targetname").is_some() {
            count += usize::from(is_light(entity));
            lights.push_str("{\n");
            for (key, value) in &entity.pairs {
                lights.push_str(&format!("\"{key}\" \"{value}\"\n"));
            }
            lights.push_str("}\n");
        }
    }
    while bsp.entities.last().is_some_and(|byte| *byte == 0) {
        bsp.entities.pop();
    }
    bsp.entities.extend_from_slice(lights.as_bytes());
    log::info!("{}: {count} light entities", source.display());
    Ok(())
}

/// Loads a map with light as it is stored.
fn load(args: &BakeArgs, files: &dyn GameFiles, name: &str, mut bsp: Bsp) -> Result<RelitWorld> {
    let (materials, _) = load_scripts(files);
    let external = external_lightmaps(&mut bsp, files, name);
    let calibrate =
        (!args.no_calibration && !bsp.lightmaps.is_empty()).then(|| CalibrationOptions {
            cache: args.cache.as_ref().map(CalibrationCache::new),
            ..CalibrationOptions::default()
        });
    let is_calibrated = calibrate.is_some();
    let options = Options {
        calibrate,
        by_hand: false,
        light_color: LightColor::Stored,
        ..Options::default()
    };
    let mut world = RelitWorld::from_bsp(files, &materials, name, bsp, options);
    world.warnings.extend(external.err());
    if !is_calibrated {
        world.measure_materials(files);
    }
    world.read_by_hand(files);
    for warning in &world.warnings {
        log::warn!("{warning}");
    }
    Ok(world)
}

fn options(args: &BakeArgs, world: &RelitWorld) -> BakeOptions {
    let mut options = BakeOptions::of(world);
    if args.fast {
        (options.pattern, options.samples, options.bounces) = (1, 0, 1);
    }
    options.pattern = args.pattern.unwrap_or(options.pattern);
    options.samples = args.samples.unwrap_or(options.samples);
    options.bounces = args.bounce.unwrap_or(options.bounces);
    options.grid = !args.no_grid;
    if let Some(gamma) = args.gamma {
        options.encoding.set_gamma(gamma);
    }
    options.encoding.compensate = args.compensate;
    options
}

/// Bakes with a bar for each stage.
fn bake_with_bar(
    world: &RelitWorld,
    gather: &mut dyn Gather,
    options: &BakeOptions,
) -> Result<Baked> {
    let style = ProgressStyle::with_template("{msg:16} {bar:40} {percent} %, {eta} left")?;
    let bar = ProgressBar::new(1000).with_style(style);
    let mut last = None;
    let baked = bake(world, gather, options, &mut |stage, part| {
        if last != Some(stage) {
            last = Some(stage);
            bar.reset();
            bar.set_message(match stage {
                BakeStage::Direct => "direct light".to_owned(),
                BakeStage::Bounce(number) => format!("bounce {number} of {}", options.bounces),
                BakeStage::Dirt => "dirt".to_owned(),
                BakeStage::Grid => "light grid".to_owned(),
            });
        }
        bar.set_position((part * 1000.0) as u64);
    });
    bar.finish_and_clear();
    Ok(baked?)
}

/// Prints what was baked, and how far it is from the light that the map had.
fn report(name: &str, stored: &Stored, baked: &Baked, before: &Bsp, after: &Bsp) {
    println!(
        "{name}: {} pages ({} texels), {} vertices, {} points of the light grid",
        stored.pages, stored.texels, stored.vertices, stored.grid
    );
    if baked.unlit > 0 {
        log::warn!(
            "{name}: {} texels and vertices lie in solid and take the light of their neighbours",
            baked.unlit
        );
    }
    if stored.outside > 0 {
        log::warn!(
            "{name}: {} lightmap images that scripts name stay as they are",
            stored.outside
        );
    }
    let mut differences: Vec<u8> = Vec::new();
    for page in &baked.pages {
        let (Some(old), Some(new)) = (
            before.lightmaps.get(page.number),
            after.lightmaps.get(page.number),
        ) else {
            continue;
        };
        let texels = old
            .0
            .as_chunks::<3>()
            .0
            .iter()
            .zip(new.0.as_chunks::<3>().0);
        let covered = texels
            .zip(&page.owners)
            .filter(|(_, owner)| **owner != u32::MAX);
        differences.extend(covered.flat_map(|((old, new), _)| {
            let channels = old.iter().zip(new);
            channels.map(|(old, new)| old.abs_diff(*new))
        }));
    }
    if !differences.is_empty() {
        differences.sort_unstable();
        let at = |part: usize| {
            differences
                .get(differences.len() * part / 100)
                .copied()
                .unwrap_or(0)
        };
        println!(
            "{name}: lightmaps differ by {}/255 in the median from those that it had, 90 % by at most {}",
            at(50),
            at(90)
        );
    }
}
