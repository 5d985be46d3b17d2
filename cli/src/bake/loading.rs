//! Loads the maps of `relight bake` with their lights, and lays their lightmaps out.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use q3bsp::Bsp;
use relight::bake::layout::{self, LayoutOptions, LightmapUse, PageSides};
use relight::bake::store::deluxe::{self, DirectionSpace};
use relight::light::LightColor;
use relight::materials::light::baked_light;
use relight::{
    CalibrationCache, CalibrationOptions, GameFiles, Materials, Options, RelitWorld, Stage,
    WorldSurface, external_lightmaps,
};
use shaderscript::StageImage;

use super::times::Times;
use super::{BakeArgs, External};
use crate::scripts::load_scripts;
use crate::view::open;
use crate::watched::SourceText;

/// A map, and the game that it is of.
pub struct Source {
    /// Its files.
    pub files: Arc<dyn GameFiles>,
    /// Its scripts.
    pub materials: Arc<Materials>,
    /// Game path.
    pub name: String,
    /// The file.
    pub bytes: Vec<u8>,
    /// The map.
    pub bsp: Bsp,
}

/// A map that is ready to be baked.
pub struct Loaded {
    pub source: Source,
    /// Its world, with the lights and the layout.
    pub world: RelitWorld,
    /// The map that gets the light.
    pub map: Bsp,
    /// Whether it has new lightmap coordinates.
    pub laid_out: bool,
    /// How its pages are stored beside it.
    pub external: Option<External>,
    /// Pages of directions.
    pub deluxe: Deluxe,
}

/// Pages of directions to the light.
#[derive(Clone, Copy, Debug)]
pub struct Deluxe {
    /// The axes of those that the map has.
    pub stored: Option<DirectionSpace>,
    /// Whether they are wanted in any case.
    wanted: bool,
}

impl Deluxe {
    /// The axes of those that are written, if any are.
    pub fn space(self) -> Option<DirectionSpace> {
        let usual = self.wanted.then(DirectionSpace::default);
        self.stored.or(usual)
    }
}

/// Loads a map.
///
/// # Errors
/// The map cannot be found, read or laid out.
pub fn load(args: &BakeArgs, map: &str, times: &mut Times) -> Result<Loaded> {
    times.begin("reading");
    let (files, name) = open(map, &args.maps.game)?;
    let bytes = files.read(&name)?;
    let bytes = bytes.with_context(|| format!("{name}: no such file in the game folders"))?;
    let bsp = Bsp::parse(&bytes).with_context(|| name.clone())?;
    times.begin("scripts");
    let source = Source {
        materials: Arc::new(load_scripts(&*files).0),
        files,
        name,
        bytes,
        bsp,
    };
    times.begin("world");
    let mut lit = source.bsp.clone();
    let is_own = add_lights_of_source(&mut lit, map)?;
    let mut world = load_world(args, &source, lit, is_own, times);
    if world.light_count() == 0 {
        log::warn!(
            "{}: no light source is known: light entities are read from the .map file beside a .bsp file",
            source.name
        );
    }
    let mut changed = source.bsp.clone();
    // numbered images beside the map are its pages
    let mut external = args.external;
    let found = external_lightmaps(&mut changed, &*source.files, &source.name);
    if found.is_ok_and(|count| count > 0) {
        match layout::has_layout(&changed) {
            true => external = external.or(Some(External::Numbered)),
            // scripts name these images
            false => changed = source.bsp.clone(),
        }
    }
    let deluxe = Deluxe {
        stored: deluxe::space_of(&changed),
        wanted: args.deluxe,
    };
    times.begin("layout");
    let laid_out = args.texels.is_some() || args.external.is_some() || !has_pages(&world);
    if laid_out {
        let images = images_of_materials(&world);
        if !images.is_empty() {
            // scripts name these images, and new ones name the new images
            external = external.or(Some(External::Scripted));
        }
        lay_out(args, &source, &mut changed, (external, &images))?;
        times.begin("world of the layout");
        world = with_layout(&source, &changed, &world);
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
    Ok(Loaded {
        source,
        world,
        map: changed,
        laid_out,
        external,
        deluxe,
    })
}

/// Whether surfaces of a world have lightmaps.
fn has_pages(world: &RelitWorld) -> bool {
    world.surfaces.iter().any(|surface| surface.light_page >= 0)
}

/// Materials that show an image in place of a page of the map, with its texels per side.
fn images_of_materials(world: &RelitWorld) -> BTreeMap<String, u32> {
    let image = |(index, surface): (usize, &WorldSurface)| {
        let page = usize::try_from(surface.light_page).ok()?;
        let outside = page >= world.bsp.lightmaps.len();
        let side = world.page(page).filter(|_| outside)?.size();
        let shader = world.bsp.surfaces.get(index)?.shader;
        Some((
            world.bsp.shader(shader).name.clone(),
            u32::try_from(side).ok()?,
        ))
    };
    world
        .surfaces
        .iter()
        .enumerate()
        .filter_map(image)
        .collect()
}

/// Paths of the images that scripts name and surfaces of a world show, in lower case.
pub fn taken(world: &RelitWorld) -> BTreeSet<String> {
    let number = |surface: &WorldSurface| {
        let page = usize::try_from(surface.light_page).ok()?;
        page.checked_sub(world.bsp.lightmaps.len())
    };
    let shown = world.surfaces.iter().filter_map(number);
    shown
        .filter_map(|page| Some(world.files_of_pages.get(page)?.to_ascii_lowercase()))
        .collect()
}

/// Gives a map new lightmap coordinates.
fn lay_out(
    args: &BakeArgs,
    source: &Source,
    bsp: &mut Bsp,
    (external, images): (Option<External>, &BTreeMap<String, u32>),
) -> Result<()> {
    let scripted = external == Some(External::Scripted);
    let material = |name: &str| LightmapUse {
        image: images.get(name).copied().filter(|_| scripted),
        ..LightmapUse::of(&source.materials, name)
    };
    let usual = match external {
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
    if !laid.styled.is_empty() && !scripted {
        log::warn!(
            "{}: {} surfaces lose the light of their light styles; --external leaves their stages out",
            source.name,
            laid.styled.len()
        );
    }
    Ok(())
}

/// The world of a map with a new layout, with the light of the one before.
fn with_layout(source: &Source, bsp: &Bsp, before: &RelitWorld) -> RelitWorld {
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
    world.take_lighting(before);
    // a page in place of the image that the script names
    for (surface, stored) in world.surfaces.iter_mut().zip(&bsp.surfaces) {
        if stored.lightmap >= 0 && surface.light_page >= 0 {
            surface.light_page = stored.lightmap;
        }
    }
    world
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

/// Whether scripts of a map's materials name images of its light.
fn names_images(source: &Source) -> bool {
    let library = source.materials.library();
    let used = source.bsp.surfaces.iter();
    let used: BTreeSet<_> = used.map(|s| &source.bsp.shader(s.shader).name).collect();
    let stages = used.into_iter().filter_map(|name| library.find(name));
    stages.map(|shader| &shader.stages).any(|stages| {
        let light = baked_light(stages);
        let mut shown = stages.iter().zip(light);
        shown.any(|(stage, light)| light.is_some() && stage.image != StageImage::Lightmap)
    })
}

/// Loads a map with light as it is stored. `is_own`: its lights are known.
fn load_world(
    args: &BakeArgs,
    source: &Source,
    mut bsp: Bsp,
    is_own: bool,
    times: &mut Times,
) -> RelitWorld {
    let files = &*source.files;
    let external = external_lightmaps(&mut bsp, files, &source.name);
    let stored = !bsp.lightmaps.is_empty() || names_images(source);
    let calibrate = (stored && !args.no_calibration && !is_own).then(|| CalibrationOptions {
        cache: args.cache.as_ref().map(CalibrationCache::new),
        ..CalibrationOptions::default()
    });
    let mut begin = |stage: Stage| match stage {
        Stage::LightLists => times.begin("light lists"),
        Stage::Calibration => times.begin("calibration"),
        _ => {}
    };
    let options = Options {
        progress: Some(&mut begin),
        calibrate,
        by_hand: false,
        light_color: LightColor::Stored,
        ..Options::default()
    };
    let mut world = RelitWorld::from_bsp(files, &source.materials, &source.name, bsp, options);
    world.warnings.extend(external.err());
    if world.calibration.is_none() {
        times.begin("materials and lights");
        world.measure_materials(files);
        world.take_compiled_lights(files);
        world.shadowless_curves &= !args.patch_shadows;
    }
    world.read_by_hand(files);
    for warning in &world.warnings {
        log::warn!("{warning}");
    }
    world
}
