//! `relight bake`: light of a map's sources, written into the map.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use q3bsp::Bsp;
use relight::bake::layout::{self, LayoutOptions, LightmapUse, PageSides};
use relight::bake::store::deluxe::{DirectionSpace, interleave};
use relight::bake::store::external::{numbered, scripted};
use relight::bake::store::pack::{RelitMap, relit_pack};
use relight::bake::store::{self, GameFile};
use relight::bake::{
    BakeOptions, BakeStage, Baked, BakedPage, Gather, Page, Stored, bake, light_bytes, seams,
};
use relight::calibrate::Dirt;
use relight::export::Output;
use relight::light::LightColor;
use relight::{
    CalibrationCache, CalibrationOptions, GameFiles, Materials, Options, RelitWorld,
    external_lightmaps,
};

use crate::bake_device;
use crate::game::Maps;
use crate::numbers::positive;
use crate::scripts::load_scripts;
use crate::view::open;
use crate::watched::SourceText;

/// Compute the light of maps, and write it into them
///
/// Writes lightmaps, vertex colours and the light grid anew; everything else in the map stays as it is. The light of a
/// finished map comes from sources that calibration finds; that of a map without lightmaps from its scripts and entities.
///
/// Examples: relight bake oa_dm1 -o z_oa_dm1_relit.pk3 --texels 4; relight bake mymap.bsp -o mymap.bsp --bounce 4;
/// relight bake oa_dm1 kaos2 -o baked
#[derive(Args, Debug)]
pub struct BakeArgs {
    #[command(flatten)]
    maps: Maps,
    /// Output file, .bsp or .pk3, or for several maps the folder
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
    #[arg(long)]
    samples: Option<u32>,
    /// Points along each side of a texel, 1 to 8
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8))]
    pattern: Option<u32>,
    /// One point a texel, one shadow ray to a light, one bounce: for a first look
    #[arg(long)]
    fast: bool,
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
    /// Write the output early with direct light, and again with a bounce, before it is done
    #[arg(long)]
    preview: bool,
    /// Write pages of directions to the light between those of light, for engines with deluxe mapping
    #[arg(long)]
    deluxe: bool,
}

/// How images beside a map are found.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum External {
    /// By scripts, which every engine loads
    Scripted,
    /// By number: maps/NAME/lm_0000.tga
    Numbered,
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

/// A map, and the game that it is of.
struct Source {
    files: Arc<dyn GameFiles>,
    materials: Materials,
    /// Game path.
    name: String,
    /// The file.
    bytes: Vec<u8>,
    bsp: Bsp,
}

/// Bakes one map.
fn bake_map(args: &BakeArgs, map: &str, output: &Path) -> Result<()> {
    let begin = Instant::now();
    let (files, name) = open(map, &args.maps.game)?;
    let bytes = files.read(&name)?;
    let bytes = bytes.with_context(|| format!("{name}: no such file in the game folders"))?;
    let bsp = Bsp::parse(&bytes).with_context(|| name.clone())?;
    let source = Source {
        materials: load_scripts(&*files).0,
        files,
        name,
        bytes,
        bsp,
    };
    let mut lit = source.bsp.clone();
    let is_own = add_lights_of_source(&mut lit, map)?;
    let mut world = load(args, &source, lit, is_own)?;
    if world.light_count() == 0 {
        log::warn!(
            "{}: no light source is known: light entities are read from the .map file beside a .bsp file",
            source.name
        );
    }
    let mut changed = source.bsp.clone();
    // numbered images beside the map are its pages
    let mut external = args.external;
    if external_lightmaps(&mut changed, &*source.files, &source.name).is_ok_and(|count| count > 0) {
        external = external.or(Some(External::Numbered));
    }
    let laid_out = args.texels.is_some() || args.external.is_some() || !has_pages(&world);
    if laid_out {
        lay_out(args, &source, &mut changed)?;
        world = with_layout(&source, &changed, world);
    }
    let shared = if laid_out {
        0
    } else {
        layout::owners(&world).shared
    };
    if shared > 0 {
        log::warn!(
            "{}: {shared} texels are shown at several places and get the mean of their light; --texels 1 gives each place its own",
            source.name
        );
    }
    let loaded = begin.elapsed();
    let mut gather = bake_device::gather(args.device.as_deref(), &source.files, &world)?;
    let job = Job {
        source: &source,
        world: &world,
        map: &changed,
        laid_out,
        external,
        deluxe: args.deluxe,
        output,
    };
    let options = options(args, &world);
    if args.preview {
        for early in early_rounds(&options) {
            job.round(&mut *gather, &early)?;
            println!(
                "{}: {:.1} s: {} of {} bounces",
                output.display(),
                begin.elapsed().as_secs_f64(),
                early.bounces,
                options.bounces
            );
        }
    }
    let (baked, pages, stored) = job.round(&mut *gather, &options)?;
    let outside = baked.pages_outside(&changed);
    report(
        &source,
        &stored,
        &baked,
        outside,
        (!laid_out).then_some(&pages),
    );
    println!(
        "{}: {:.1} s, {:.1} s of these for {} by {}",
        output.display(),
        begin.elapsed().as_secs_f64(),
        loaded.as_secs_f64(),
        match world.calibration.is_some() {
            true => "loading and finding the lights",
            false => "loading",
        },
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
    deluxe: bool,
    output: &'a Path,
}

impl Job<'_> {
    /// Game path of the map that is written: a pack replaces the map, and a `.bsp` file has the name of the output.
    fn name(&self) -> String {
        match self.output.file_stem() {
            Some(stem) if !is_pack(self.output) => format!("maps/{}.bsp", stem.to_string_lossy()),
            _ => self.source.name.clone(),
        }
    }

    /// Bakes with these options, and writes the output.
    fn round(
        &self,
        gather: &mut dyn Gather,
        options: &BakeOptions,
    ) -> Result<(Baked, Vec<Page>, Stored)> {
        let Job { source, world, .. } = self;
        let baked = bake_with_bar(&source.name, world, gather, options)?;
        let encoding = options.encoding;
        let mut map = self.map.clone();
        let mut pages = baked.pages(world, &map, encoding);
        if self.laid_out {
            seams::match_seams(world, &mut pages);
        }
        let stored = baked.store_beside_pages(world, &mut map, encoding);
        if baked.pages.is_empty() && stored == Stored::default() {
            bail!(
                "{}: nothing in it stores light: no lightmaps, no vertices that are lit, no light grid",
                source.name
            );
        }
        let all = match self.deluxe {
            true => {
                let space = DirectionSpace::Model;
                let directions = baked.directions(world, &map, space);
                interleave(&mut map, pages.clone(), directions, space)
            }
            false => pages.clone(),
        };
        let beside = match self.external {
            None => {
                store::internal(&mut map, &all)?;
                Vec::new()
            }
            Some(External::Numbered) => numbered(&mut map, &self.name(), &all)?,
            Some(External::Scripted) => {
                let (files, materials) = (&*source.files, &source.materials);
                scripted(&mut map, &self.name(), &all, files, materials)?
            }
        };
        write(source, &map, &beside, self.output)?;
        Ok((baked, pages, stored))
    }
}

/// Whether surfaces of a world have lightmaps.
fn has_pages(world: &RelitWorld) -> bool {
    world.surfaces.iter().any(|surface| surface.light_page >= 0)
}

/// Gives a map new lightmap coordinates.
fn lay_out(args: &BakeArgs, source: &Source, bsp: &mut Bsp) -> Result<()> {
    let material = |name: &str| LightmapUse::of(&source.materials, name);
    let usual = match args.external {
        Some(_) => LayoutOptions::external(&material),
        None => LayoutOptions {
            sides: PageSides::Fixed(bsp.format.lightmap_size() as u32),
            ..LayoutOptions::internal(&material)
        },
    };
    let options = LayoutOptions {
        finer: args.texels.unwrap_or(1.0),
        ..usual
    };
    let laid = layout::make(bsp, &options).with_context(|| source.name.clone())?;
    println!(
        "{}: {} charts in {} pages of {} texels a side, {:.0} % filled",
        source.name,
        laid.charts,
        laid.pages,
        laid.side,
        laid.efficiency() * 100.0
    );
    if !laid.coarser.is_empty() {
        log::warn!(
            "{}: {} charts are larger than a page and have coarser texels; --external has larger pages",
            source.name,
            laid.coarser.len()
        );
    }
    if !laid.styled.is_empty() && args.external != Some(External::Scripted) {
        log::warn!(
            "{}: {} surfaces lose the light of their light styles; --external leaves their stages out",
            source.name,
            laid.styled.len()
        );
    }
    Ok(())
}

/// The world of a map with a new layout, with the light of the one before.
fn with_layout(source: &Source, bsp: &Bsp, before: RelitWorld) -> RelitWorld {
    let options = Options {
        calibrate: None,
        by_hand: false,
        light_color: LightColor::Stored,
        ..Options::default()
    };
    let (files, materials) = (&*source.files, &source.materials);
    let mut world = RelitWorld::from_bsp(files, materials, &source.name, bsp.clone(), options);
    world.measure_materials(files);
    // materials by hand; the lights are replaced
    world.read_by_hand(files);
    world.set_lighting(before.lighting());
    world
}

/// Whether an output is a pack.
fn is_pack(output: &Path) -> bool {
    let extension = output.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("pk3"))
}

/// Writes a map with the files beside it, or a pack of them.
fn write(source: &Source, bsp: &Bsp, beside: &[GameFile], output: &Path) -> Result<()> {
    let mut out = Output::new(output);
    let bytes = bsp.write();
    if is_pack(output) {
        let aas = Path::new(&source.name).with_extension("aas");
        let aas = source.files.read(&aas.to_string_lossy())?;
        let pack = relit_pack(RelitMap {
            map: &source.name,
            original: &source.bytes,
            relit: &bytes,
            aas: aas.as_deref(),
            files: beside,
        });
        let pack = pack.map_err(|problem| anyhow!("{}: {problem}", output.display()))?;
        for note in &pack.notes {
            log::warn!("{}: {note}", source.name);
        }
        out.write_main(&pack.bytes)?;
    } else {
        let in_maps = output
            .parent()
            .and_then(Path::file_name)
            .is_some_and(|name| name.eq_ignore_ascii_case("maps"));
        for file in beside {
            // images lie beside the map, scripts in the folder of the game if the map is in its `maps`
            let name = match file.path.strip_prefix("maps/") {
                Some(name) => name.to_owned(),
                None if in_maps => format!("../{}", file.path),
                None => file.path.clone(),
            };
            out.write_beside(&name, &file.bytes)?;
        }
        out.write_main(&bytes)?;
    }
    out.finish()?;
    Ok(())
}

/// Gives a map the light entities of the `.map` file beside its `.bsp` file: compilers leave them out of the map, and read
/// that file for light. False without that file.
///
/// # Errors
/// The file cannot be read.
fn add_lights_of_source(bsp: &mut Bsp, map: &str) -> Result<bool> {
    let source = Path::new(map).with_extension("map");
    if !Path::new(map).is_file() || !source.is_file() {
        return Ok(false);
    }
    let name = || source.display().to_string();
    let text = std::fs::read(&source).with_context(name)?;
    SourceText::parse(&text).with_context(name)?.light(bsp);
    Ok(true)
}

/// Loads a map with light as it is stored. `is_own`: its lights are known.
fn load(args: &BakeArgs, source: &Source, mut bsp: Bsp, is_own: bool) -> Result<RelitWorld> {
    let files = &*source.files;
    let external = external_lightmaps(&mut bsp, files, &source.name);
    let stored = !bsp.lightmaps.is_empty() && !args.no_calibration && !is_own;
    let calibrate = stored.then(|| CalibrationOptions {
        cache: args.cache.as_ref().map(CalibrationCache::new),
        ..CalibrationOptions::default()
    });
    let options = Options {
        calibrate,
        by_hand: false,
        light_color: LightColor::Stored,
        ..Options::default()
    };
    let mut world = RelitWorld::from_bsp(files, &source.materials, &source.name, bsp, options);
    world.warnings.extend(external.err());
    if world.calibration.is_none() {
        world.measure_materials(files);
        world.take_compiled_lights(files);
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
    if args.dirty {
        options.dirt = options.dirt.or(Some(Dirt::DEFAULT));
    }
    if let Some(gamma) = args.gamma {
        options.encoding.set_gamma(gamma);
    }
    options.encoding.compensate = args.compensate;
    options
}

/// Bakes with a bar for each stage. Prints the seconds of each.
fn bake_with_bar(
    map: &str,
    world: &RelitWorld,
    gather: &mut dyn Gather,
    options: &BakeOptions,
) -> Result<Baked> {
    let style = ProgressStyle::with_template("{msg:16} {bar:40} {percent} %, {eta} left")?;
    let bar = ProgressBar::new(1000).with_style(style);
    let mut stages: Vec<(BakeStage, Instant)> = Vec::new();
    let name = |stage: BakeStage| match stage {
        BakeStage::Direct => "direct light".to_owned(),
        BakeStage::Bounce(number) => format!("bounce {number} of {}", options.bounces),
        BakeStage::Dirt => "dirt".to_owned(),
        BakeStage::Grid => "light grid".to_owned(),
    };
    let begin = Instant::now();
    let baked = bake(world, gather, options, &mut |stage, part| {
        if stages.last().is_none_or(|(last, _)| *last != stage) {
            stages.push((stage, Instant::now()));
            bar.reset();
            bar.set_message(name(stage));
        }
        bar.set_position((part * 1000.0) as u64);
    });
    bar.finish_and_clear();
    let baked = baked?;
    let end = Instant::now();
    let starts = stages.iter().map(|(_, start)| *start);
    let ends = starts.clone().skip(1).chain([end]);
    let first = starts.clone().next().unwrap_or(end);
    let mut seconds = format!("points {:.2} s", (first - begin).as_secs_f64());
    for ((stage, start), end) in stages.iter().zip(ends) {
        seconds += &format!(", {} {:.2} s", name(*stage), (end - *start).as_secs_f64());
    }
    println!("{map}: {seconds}");
    Ok(baked)
}

/// Prints what was baked; for a map that keeps its coordinates also how far its pages are from those that it had.
fn report(
    source: &Source,
    stored: &Stored,
    baked: &Baked,
    outside: usize,
    pages: Option<&Vec<Page>>,
) {
    let name = &source.name;
    let lit = |page: &BakedPage| page.owners.iter().filter(|o| **o != u32::MAX).count();
    let texels: usize = baked.pages.iter().map(lit).sum();
    println!(
        "{name}: {} pages ({texels} texels), {} vertices, {} points of the light grid",
        baked.pages.len(),
        stored.vertices,
        stored.grid
    );
    if baked.unlit > 0 {
        log::warn!(
            "{name}: {} texels and vertices lie in solid and take the light of their neighbours",
            baked.unlit
        );
    }
    if outside > 0 {
        log::warn!("{name}: {outside} lightmap images that scripts name stay as they are");
    }
    let mut differences: Vec<u8> = Vec::new();
    for baked in &baked.pages {
        let old = source.bsp.lightmaps.get(baked.number);
        let new = pages.and_then(|pages| pages.get(baked.number));
        let (Some(old), Some(new)) = (old, new) else {
            continue;
        };
        let texels = old.0.as_chunks::<3>().0.iter().zip(&new.texels);
        let covered = texels.zip(&baked.owners).filter(|(_, o)| **o != u32::MAX);
        differences.extend(covered.flat_map(|((old, new), _)| {
            let new = light_bytes(*new);
            (0..3).map(move |k| old[k].abs_diff(new[k]))
        }));
    }
    if !differences.is_empty() {
        differences.sort_unstable();
        let at = |part: usize| {
            let place = differences.len() * part / 100;
            differences.get(place).copied().unwrap_or(0)
        };
        println!(
            "{name}: lightmaps differ by {}/255 in the median from those that it had, 90 % by at most {}",
            at(50),
            at(90)
        );
    }
}
