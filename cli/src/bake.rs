//! `relight bake`: light of a map's sources, written into the map.

mod computer;
mod loading;
mod output;
mod permits;
mod report;
mod times;

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use q3bsp::Bsp;
use relight::bake::store;
use relight::bake::store::deluxe;
use relight::bake::store::external::{image_file, numbered, scripted};
use relight::bake::{BakeOptions, Baked, Gather, Page, Stored, bake, seams};
use relight::calibrate::Dirt;
use relight::{GameFiles, RelitWorld};

use crate::game::Maps;
use crate::numbers::positive;
use crate::viewer::cache_folder;
use computer::Computer;
use loading::{Deluxe, Loaded, Source};
use output::{Format, MapOutput, Outputs};
use permits::Permits;
use report::report;
use times::Times;

/// Compute the light of maps, and write it into them
///
/// Writes lightmaps, vertex colours and the light grid anew; everything else in the map stays as it is. The light of a
/// finished map comes from sources that calibration finds; that of a map without lightmaps from its scripts and entities.
///
/// Examples: relight bake oa_dm1 -o z_oa_dm1_relit.pk3 --texels 4; relight bake mymap.bsp -o mymap.bsp --bounce 4;
/// relight bake oa_dm1 kaos2 -o z_relit.pk3
#[derive(Args, Debug)]
pub struct BakeArgs {
    #[command(flatten)]
    maps: Maps,
    /// Output file, .bsp or .pk3; for several maps a folder, or one .pk3 with all of them, which is written at the end
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// Format; default: that of the output's extension, else the first
    #[arg(long)]
    format: Option<Format>,
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
    #[arg(long)]
    samples: Option<u32>,
    /// Points along each side of a texel, 1 to 8
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8))]
    pattern: Option<u32>,
    /// One point a texel, one shadow ray to a light, one bounce: for a first look
    #[arg(long)]
    fast: bool,
    /// Let curves cast shadows, as the compiler's -patchshadows; on a finished map they always do
    #[arg(long)]
    patch_shadows: bool,
    /// Gamma of stored light, as the compiler's -gamma; default: 1, or what calibration found
    #[arg(long, value_name = "G", value_parser = positive)]
    gamma: Option<f32>,
    /// Divisor of stored light after gamma, as the compiler's -compensate
    #[arg(long, value_name = "C", default_value_t = 1.0, value_parser = positive)]
    compensate: f32,
    /// Leave the light grid, which lights models, as it is
    #[arg(long)]
    no_grid: bool,
    /// Lay the lightmaps out anew, with so many texels along an axis in place of one; maps without lightmaps get some anyway
    #[arg(long, value_name = "N", value_parser = positive)]
    texels: Option<f32>,
    /// Write lightmaps as images of up to 2048 texels a side beside the map: named by scripts, which every engine loads, or
    /// numbered
    #[arg(long, value_name = "KIND", num_args = 0..=1, default_missing_value = "scripted")]
    external: Option<External>,
    /// What computes: cpu, gpu, or part of a Vulkan device's name; default: a GPU, else the CPU
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Darken places near surfaces, as the compiler's -dirty; bounces do that without it
    #[arg(long)]
    dirty: bool,
    /// Distance in units within which surfaces darken, as the compiler's -dirtdepth; default: 128
    #[arg(long, value_name = "UNITS", requires = "dirty", value_parser = positive)]
    dirt_depth: Option<f32>,
    /// Factor of that darkness, as the compiler's -dirtscale; default: 1
    #[arg(long, value_name = "F", requires = "dirty", value_parser = positive)]
    dirt_scale: Option<f32>,
    /// Exponent of that darkness, as the compiler's -dirtgain; default: 1
    #[arg(long, value_name = "E", requires = "dirty", value_parser = positive)]
    dirt_gain: Option<f32>,
    /// Write the output early with direct light, and again with a bounce, before it is done
    #[arg(long)]
    preview: bool,
    /// Write pages of directions to the light between those of light, for engines with deluxe mapping; a map that has some
    /// gets them anyway
    #[arg(long)]
    deluxe: bool,
}

/// How images beside a map are found.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum External {
    /// By scripts, which every engine loads
    Scripted,
    /// By number: maps/NAME/lm_0000.tga
    Numbered,
}

/// Stack of a thread that bakes, bytes: drivers assume that of a main thread.
const STACK_SIZE: usize = 16 << 20;

/// Maps that are worked on at once: most of a calibration and of loading is done by one thread.
fn at_once(maps: usize) -> usize {
    let threads = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    (threads / 2).clamp(2, 8).min(maps)
}

/// Maps that have light in memory at once, up to a gigabyte each: one is lit, others are stored or wait for the device.
const LIT_AT_ONCE: usize = 3;

/// Runs the command.
pub fn run(args: &BakeArgs) -> Result<()> {
    // ready while the first map is read
    let cache = args.cache.clone().or_else(cache_folder);
    let computer = Computer::begin(args.device.as_deref(), cache.as_deref());
    let permits = Permits::new(LIT_AT_ONCE);
    let several = args.maps.maps.len() > 1;
    let outputs = Outputs::of(&args.maps.maps, &args.output, args.format)?;
    let queue = Mutex::new(args.maps.maps.iter().enumerate());
    let failed: Mutex<Option<anyhow::Error>> = Mutex::new(None);
    let failure = || failed.lock().unwrap_or_else(PoisonError::into_inner);
    let has_failed = || failure().is_some();
    let next = || match has_failed() {
        true => None,
        false => queue.lock().unwrap_or_else(PoisonError::into_inner).next(),
    };
    let work = || {
        while let Some((number, map)) = next() {
            let Some(output) = outputs.of_map(number) else {
                continue;
            };
            let mut times = Times::new(!several);
            let shared = (&computer, &permits);
            if let Err(error) = bake_map(args, map, &output, shared, &mut times) {
                failure().get_or_insert(error);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 1..at_once(args.maps.maps.len()) {
            // without the thread, the others do its work
            let builder = thread::Builder::new().stack_size(STACK_SIZE);
            if builder.spawn_scoped(scope, work).is_err() {
                break;
            }
        }
        work();
    });
    let failed = failure().take();
    failed.map_or(Ok(()), Err)?;
    outputs.finish()
}

/// Bakes one map.
fn bake_map(
    args: &BakeArgs,
    map: &str,
    output: &MapOutput<'_>,
    (computer, permits): (&Computer, &Permits),
    times: &mut Times,
) -> Result<()> {
    let Loaded {
        source,
        world,
        map,
        laid_out,
        external,
        deluxe,
    } = loading::load(args, map, times)?;
    times.begin("waiting");
    let _permit = permits.take();
    let mut gather = computer.gather(&source, &world);
    let job = Job {
        source: &source,
        world: &world,
        map: &map,
        laid_out,
        external,
        deluxe,
        output,
    };
    let options = options(args, &world);
    if args.preview && output.is_own() {
        for early in early_rounds(&options) {
            job.round(&mut gather, &early, times)?;
            println!(
                "{}: {:.1} s: {} of {} bounces",
                output.path().display(),
                times.seconds(),
                early.bounces,
                options.bounces
            );
        }
    }
    let (baked, pages, stored) = job.round(&mut gather, &options, times)?;
    println!(
        "{}: {}; the points waited {:.2} s for {}",
        source.name,
        times.end(),
        gather.waited.as_secs_f64(),
        gather.name()
    );
    report(&source, &stored, &baked, (!laid_out).then_some(&pages));
    println!(
        "{}: {:.1} s, by {}",
        output.path().display(),
        times.seconds(),
        gather.name(),
    );
    Ok(())
}

/// Rounds before the last, which are shown early: direct light by one ray to each light, then with a bounce.
fn early_rounds(last: &BakeOptions) -> [BakeOptions; 2] {
    let rough = BakeOptions {
        pattern: 1,
        samples: 0,
        bounces: 0,
        dirt: None,
        grid: false,
        ..*last
    };
    let better = BakeOptions {
        bounces: last.bounces.min(1),
        rays: last.rays.min(16),
        ..rough
    };
    [rough, better]
}

/// What is baked, and where to.
struct Job<'a> {
    source: &'a Source,
    world: &'a RelitWorld,
    /// The map that gets the light.
    map: &'a Bsp,
    laid_out: bool,
    external: Option<External>,
    deluxe: Deluxe,
    output: &'a MapOutput<'a>,
}

impl Job<'_> {
    /// Bakes with these options, and writes the output.
    fn round(
        &self,
        gather: &mut dyn Gather,
        options: &BakeOptions,
        times: &mut Times,
    ) -> Result<(Baked, Vec<Page>, Stored)> {
        let Job { source, world, .. } = self;
        times.begin("points");
        let baked = bake(world, gather, options, &mut |stage, part| {
            times.bake(stage, options.bounces, part);
        })?;
        times.begin("pages");
        let encoding = options.encoding;
        let mut map = self.map.clone();
        let mut pages = baked.pages(world, &map, encoding);
        if self.laid_out {
            times.begin("seams");
            seams::match_seams(world, &mut pages);
        }
        times.begin("storing");
        let stored = baked.store_beside_pages(world, &mut map, encoding);
        if baked.pages.is_empty() && stored == Stored::default() {
            bail!(
                "{}: nothing in it stores light: no lightmaps, no vertices that are lit, no light grid",
                source.name
            );
        }
        let mut all = pages.clone();
        if let Some(space) = self.deluxe.space() {
            let directions = baked.directions(&map, space);
            match self.deluxe.stored.is_some() && !self.laid_out {
                true => deluxe::replace(&mut all, directions),
                false => all = deluxe::interleave(&mut map, all, directions, space),
            }
        }
        let name = self.output.map_name(&source.name);
        let mut beside = match self.external {
            None => {
                store::internal(&mut map, &all)?;
                Vec::new()
            }
            Some(External::Numbered) => numbered(&mut map, &name, &all)?,
            Some(External::Scripted) => {
                let game: (&dyn GameFiles, _) = (&*source.files, &*source.materials);
                scripted(&mut map, &name, &all, game, &loading::taken(world))?
            }
        };
        for (path, page) in baked.images(world, encoding) {
            match image_file(&path, &page) {
                Some(file) => beside.push(file),
                None => log::warn!("{path}: images of this kind stay as they are"),
            }
        }
        self.output.write(source, &map, &beside)?;
        Ok((baked, pages, stored))
    }
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
    if args.dirty {
        let usual = options.dirt.unwrap_or(Dirt::DEFAULT);
        options.dirt = Some(Dirt {
            depth: args.dirt_depth.unwrap_or(usual.depth),
            scale: args.dirt_scale.unwrap_or(usual.scale),
            gain: args.dirt_gain.unwrap_or(usual.gain),
        });
    }
    if let Some(gamma) = args.gamma {
        options.encoding.set_gamma(gamma);
    }
    options.encoding.compensate = args.compensate;
    options
}
