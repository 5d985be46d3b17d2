//! Light styles: light that the compiler stored separately, because games switch or animate it.
//!
//! Each style has its own lightmap pages ([`StyleLight`]), so its light is a second world with the same geometry:
//! its pages replace those of the main light, surfaces without the style become black, and calibration places
//! lights as for the main light. Styles of equal strength are fitted together, because scripts do not name the
//! style of a stage. Gamma and light cutoff are those of the main light. The placed lights follow the wave of their
//! style.

use super::Acceptance;
use super::compiler::Compiler;
use super::trace_cache::TraceCache;
use super::{CalibrationOptions, FitMode, Solution, apply, find, result_cache};
use crate::emitters::Evidence;
use crate::light::{self, PointLight, Pulse};
use crate::overbright::MAP_OVERBRIGHT_BITS;
use crate::world::{NO_LIGHT, RelitWorld, StyleLight, StyleStrength, WorldSurface};
use glam::{Vec2, Vec3};
use q3bsp::Lightmap;
use shaderscript::eval;
use std::cell::Cell;
use std::collections::BTreeMap;
use support::hash::Hash;

/// Fits the light of each style after the main light, and adds it to the world.
pub(super) fn add(world: &mut RelitWorld, options: &CalibrationOptions) {
    let mut found = Vec::new();
    for (number, strength) in strengths(world).into_iter().enumerate() {
        let (mean, pulse) = Pulse::of(strength);
        let lights = lights_of(world, options, number, strength);
        found.extend(lights.into_iter().map(|light| PointLight {
            intensity: light.intensity * mean,
            pulse,
            ..light
        }));
    }
    found.retain(|light| light.intensity.max_element() > 0.0);
    if found.is_empty() {
        return;
    }
    world.point_lights.extend(found);
    world.report.point_lights = world.point_lights.len();
    light::build_lists(world);
}

/// The distinct strengths of all styles on drawn surfaces, in the order of materials.
fn strengths(world: &RelitWorld) -> Vec<StyleStrength> {
    let mut found: Vec<StyleStrength> = Vec::new();
    for style in world.materials.iter().flat_map(|m| &m.baked.styles) {
        if !found.contains(&style.strength) {
            found.push(style.strength);
        }
    }
    found
}

/// The lights of one style at full strength. The world is restored.
fn lights_of(
    world: &mut RelitWorld,
    options: &CalibrationOptions,
    number: usize,
    strength: StyleStrength,
) -> Vec<PointLight> {
    let lighting = world.lighting();
    let grid = std::mem::take(&mut world.bsp.light_grid);
    let layer = Layer::install(world, strength);
    remove_lights(world);
    let solution = solve(world, options, number);
    layer.restore(world);
    world.bsp.light_grid = grid;
    world.set_lighting(lighting);
    let placed = solution.filter(|s| s.report.evidence == Evidence::Lightmaps);
    // No lamp where the fit fails or finds no lightmaps.
    let placed = placed.map(|s| s.placed).unwrap_or_default();
    placed
        .into_iter()
        .map(|(lamp, intensity)| apply::placed_light(lamp, intensity))
        .collect()
}

/// Removes all known lights of a world.
fn remove_lights(world: &mut RelitWorld) {
    world.lights.clear();
    world.triangle_lights.fill(NO_LIGHT);
    for surface in &mut world.surfaces {
        surface.num_lights = 0;
    }
    world.point_lights.clear();
    world.suns.clear();
    world.ambient = Vec3::ZERO;
}

/// The solution of a style's world, cached or fitted.
fn solve(world: &mut RelitWorld, options: &CalibrationOptions, number: usize) -> Option<Solution> {
    let key = options.cache.as_ref().map(|cache| {
        let mut hash = Hash::new();
        hash.number(number as u64);
        (cache, result_cache::key_from(hash, world, options))
    });
    let kept = key.map_or(Ok(None), |(cache, key)| result_cache::read(cache, key, 0));
    match kept {
        Ok(Some(solution)) => return Some(solution),
        Ok(None) => {}
        Err(problem) => world.warnings.push(problem.to_string()),
    }
    let compiler = world.calibration.as_ref().map(Compiler::of)?;
    let compiler = Compiler {
        splashes: false,
        ..compiler
    };
    let acceptance = Acceptance {
        stops: f32::INFINITY,
        round_limits: &[],
        splashes: &Cell::new(false),
    };
    let mut traced = TraceCache::default();
    let mode = FitMode::Full(acceptance);
    let solution = find(
        world,
        &[],
        options,
        compiler,
        mode,
        &mut traced,
        &mut |_| (),
    )?;
    if let Some((cache, key)) = key
        && let Err(problem) = result_cache::write(cache, key, &solution)
    {
        world.warnings.push(problem.to_string());
    }
    Some(solution)
}

/// The pages of a style in place of the main light's.
struct Layer {
    /// Original page of each surface.
    pages: Vec<i32>,
    /// Original number of pages of the world.
    count: usize,
}

impl Layer {
    /// Replaces the main light by all light of one strength, texel by texel; pages without it are black.
    fn install(world: &mut RelitWorld, strength: StyleStrength) -> Layer {
        let own = world.bsp.lightmaps.len();
        let layer = Layer {
            pages: world.surfaces.iter().map(|s| s.light_page).collect(),
            count: world.pages.len(),
        };
        // One page for each page of the main light, of the same size.
        let mut pages: BTreeMap<i32, Vec<u8>> = BTreeMap::new();
        for surface in &world.surfaces {
            let main = usize::try_from(surface.light_page).ok();
            let Some(size) = main.and_then(|page| Some(world.page(page)?.size())) else {
                continue; // lit by vertex
            };
            let page = pages.entry(surface.light_page);
            let page = page.or_insert_with(|| vec![0; size * size * 3]);
            let material = world.material_of(surface);
            let styles = material.map_or(&[][..], |m| &m.baked.styles);
            let mine: Vec<&StyleLight> = styles.iter().filter(|s| s.strength == strength).collect();
            if !mine.is_empty() {
                fill(world, surface, &mine, page, size);
            }
        }
        let first = own + world.pages.len();
        for surface in &mut world.surfaces {
            if pages.contains_key(&surface.light_page) {
                let place = pages.range(..surface.light_page).count();
                surface.light_page = (first + place) as i32;
            }
        }
        let pages = pages.into_values();
        world
            .pages
            .extend(pages.map(|texels| Lightmap(texels.into_boxed_slice())));
        layer
    }

    /// Restores the main light.
    fn restore(self, world: &mut RelitWorld) {
        for (surface, page) in world.surfaces.iter_mut().zip(self.pages) {
            surface.light_page = page;
        }
        world.pages.truncate(self.count);
    }
}

/// Writes the sum of the styles' light to the texels of one surface. `size`: texels along the side of the page.
fn fill(
    world: &RelitWorld,
    surface: &WorldSurface,
    styles: &[&StyleLight],
    page: &mut [u8],
    size: usize,
) {
    let places = world.vertices_of(surface).iter().map(|v| v.lightmap);
    let (low, high) = places.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), at| {
        (low.min(at), high.max(at))
    });
    // One texel of margin, for texels that the edge crosses.
    let range = |low: f32, high: f32| {
        let cell =
            |at: f32, by: f32| (at * size as f32 + by).floor().clamp(0.0, size as f32) as usize;
        cell(low, -1.0)..cell(high, 2.0)
    };
    for y in range(low.y, high.y) {
        for x in range(low.x, high.x) {
            let at = (Vec2::new(x as f32, y as f32) + 0.5) / size as f32;
            let sum = styles
                .iter()
                .map(|style| shown_at(world, surface, style, at));
            let sum = sum.fold([0u32; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
            let to = (y * size + x) * 3;
            if let Some(texel) = page.get_mut(to..to + 3) {
                texel.copy_from_slice(&sum.map(|channel| channel.min(255) as u8));
            }
        }
    }
}

/// A style's light as shown at a position of the main light's page, 0 to 255 and above.
fn shown_at(world: &RelitWorld, surface: &WorldSurface, style: &StyleLight, at: Vec2) -> [u32; 3] {
    let number = match style.page {
        Some(page) => Some(world.bsp.lightmaps.len() + page as usize),
        None => usize::try_from(surface.lightmap).ok(),
    };
    let Some((number, page)) = number.and_then(|n| Some((n, world.page(n)?))) else {
        return [0; 3];
    };
    let bits = match world.is_shown_as_stored(number) {
        true => 0,
        false => MAP_OVERBRIGHT_BITS,
    };
    let place = eval::apply_tc_mods(&style.tc_mods, at, Vec3::ZERO, 0.0, Vec2::ZERO);
    let [x, y] = (place * page.size() as f32)
        .to_array()
        .map(|c| c.max(0.0) as usize);
    page.texel(x, y).map(|channel| u32::from(channel) << bits)
}
