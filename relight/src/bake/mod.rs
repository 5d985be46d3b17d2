//! Baking: light of a world's sources, written into the lightmaps, vertex colours and light grid of its map.
//!
//! 1. `targets` finds the places where a map stores light, and the points that stand for them: for a texel a pattern of
//!    points on the triangles that cover it (`coverage`), for a vertex one.
//! 2. A [`Gather`] computes direct light at all points: [`Rays`] on the CPU, or a GPU by the renderer.
//! 3. Bounces: each gathers at one point of every place the light that surfaces reflect, lit by the bounce before
//!    ([`LitSurfaces`]). The reflected light of a texel is smoothed over its neighbours on the same surface.
//! 4. `grid` computes the light grid.
//! 5. [`Baked::pages`] and [`Baked::store_beside_pages`] encode the light ([`Encoding`]) for the map's lumps of light; nothing
//!    else changes.
//!
//! Light is irradiance over π: the outgoing radiance of a white surface, in display units ([`emitters`](crate::emitters)).
//!
//! * [`layout`]: new lightmap coordinates.
//! * [`seams`]: equal light on both sides of an edge between two charts.
//! * [`store`]: pages written into a map, beside it, and into packs.

mod compiler_place;
mod coverage;
mod dirt;
mod encode;
mod gather;
mod grid;
pub mod layout;
mod lumps;
mod page;
mod rays;
pub mod seams;
#[cfg(test)]
mod shadow_tests;
mod smooth;
mod solids;
pub mod store;
mod targets;
#[cfg(test)]
mod tests;

pub use encode::Encoding;
pub use gather::{Gather, GatherError, GatherProgress, Light, LitSurfaces, LitTriangle, Point};
pub use lumps::Stored;
pub use page::{Page, light_bytes};
pub use rays::Rays;

use crate::calibrate::Dirt;
use crate::overbright::luminance;
use crate::world::{RelitWorld, WorldMaterial};
use glam::Vec3;
use q3bsp::GridPoint;
use std::ops::Range;
use support::parallel;
use support::slice::{item, part, part_mut};
use targets::Targets;

/// Texels around a covered one that filtering may read.
const RINGS: usize = 2;

/// What part of light surfaces reflect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reflectance {
    /// Their mean albedo, as the tracer has it: lights that calibration has found are fitted with this.
    #[default]
    Albedo,
    /// 0.55 of the mean of their display-encoded image, as q3map2 has it.
    Compiler,
}

/// Least weight of the normal in the direction to the light: a step of a stored byte, as q3map2 has it.
const LEAST_TOWARDS: f32 = 4.0 / 256.0;

/// Weight of bounced light in the direction to the light: q3map2's, since bounces would turn it to the normal.
const BOUNCE_TOWARDS: f32 = 0.25;

/// Part of display-encoded texture colour that q3map2's bounces reflect: 500 × 0.375 × 3 × 0.25 / 255.
const COMPILER_REFLECTANCE: f32 = 0.5515;

/// What is baked, and how well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BakeOptions {
    /// Points along each side of a texel, 1 to 8.
    pub pattern: u32,
    /// Shadow rays to each light from a point; 0 for one to its middle.
    pub samples: u32,
    /// Diffuse bounces.
    pub bounces: u32,
    /// Rays from a place that gather a bounce.
    pub rays: u32,
    /// What surfaces reflect.
    pub reflectance: Reflectance,
    /// Ambient occlusion of all light, if any.
    pub dirt: Option<Dirt>,
    /// Least light of texels, vertices and points of the grid, irradiance over π.
    pub least: [Vec3; 3],
    /// Whether the light grid is computed.
    pub grid: bool,
    /// How light becomes bytes.
    pub encoding: Encoding,
}

impl BakeOptions {
    /// Options that reproduce what a calibrated world was fitted to; else those for a map's directives.
    pub fn of(world: &RelitWorld) -> BakeOptions {
        let calibrated = world.calibration.is_some();
        BakeOptions {
            pattern: 2,
            samples: 4,
            bounces: if calibrated { 1 } else { 8 },
            rays: 64,
            reflectance: match calibrated {
                true => Reflectance::Albedo,
                false => Reflectance::Compiler,
            },
            dirt: crate::calibrate::dirt_of_calibrated(world),
            least: match calibrated {
                true => [Vec3::ZERO; 3],
                false => world.least_light(),
            },
            grid: true,
            encoding: Encoding::of(world),
        }
    }
}

/// A stage of a bake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BakeStage {
    /// Direct light.
    Direct,
    /// A bounce, counted from 1.
    Bounce(u32),
    /// Ambient occlusion.
    Dirt,
    /// The light grid.
    Grid,
}

/// Gets the stage and its completed part, 0 to 1.
pub type BakeProgress<'a> = &'a mut dyn FnMut(BakeStage, f32);

/// Light of one page.
#[derive(Debug, Clone, PartialEq)]
pub struct BakedPage {
    /// Number, as [`RelitWorld::page`] counts.
    pub number: usize,
    /// Texels per side.
    pub side: usize,
    /// For each texel the surface whose light it has, or `u32::MAX`.
    pub owners: Vec<u32>,
    /// Light of each texel.
    pub light: Vec<Light>,
    /// Unit normal of the surface at each texel that has an owner.
    pub normals: Vec<Vec3>,
}

/// Light of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Baked {
    /// Pages that surfaces use.
    pub pages: Vec<BakedPage>,
    /// Index into the map's vertices, its surface, and light of the vertices of surfaces that are lit by vertex.
    pub vertices: Vec<(u32, u32, Vec3)>,
    /// Light grid; `None` for a map that can have none, or if none was wanted.
    pub grid: Option<Vec<GridPoint>>,
    /// Texels and vertices without light, because everything near them is solid.
    pub unlit: usize,
}

/// Computes the light of a map.
///
/// # Errors
/// Those of `gather`.
pub fn bake(
    world: &RelitWorld,
    gather: &mut dyn Gather,
    options: &BakeOptions,
    progress: BakeProgress<'_>,
) -> Result<Baked, GatherError> {
    let targets = Targets::of(world, options.pattern);
    let firsts = Places::first_points(&targets);
    let direct = gather.direct(&targets.points, options.samples, &mut |part| {
        progress(BakeStage::Direct, part);
    })?;
    let least = LEAST_TOWARDS.max(luminance(world.ambient));
    let mut places = Places::of(&targets, |points| {
        let mut light = mean(part(&direct, points.clone()));
        let normal = part(&targets.points, points)
            .first()
            .map_or(Vec3::ZERO, |point| point.normal);
        light.towards += normal * least;
        light
    });
    let dirt = match options.dirt {
        Some(dirt) => {
            let near = gather.nearness(&firsts, &dirt.surroundings(), &mut |part| {
                progress(BakeStage::Dirt, part);
            })?;
            let parts = near.iter().map(|near| dirt.part(*near));
            Some(dirt::of_places(world, &targets, parts))
        }
        None => None,
    };
    // q3map2 darkens direct light and each bounce; calibration has fitted a darkened sum
    let each = dirt.as_deref().filter(|_| world.has_compiled_lights);
    if let Some(dirt) = each {
        places.darken(dirt);
    }
    let ambient = |index: usize| {
        world.ambient * each.map_or(1.0, |dirt| dirt.get(index).copied().unwrap_or(1.0))
    };
    bounce(
        world,
        (&targets, &firsts),
        &mut places,
        (&ambient, each),
        gather,
        options,
        progress,
    )?;
    for (index, light) in places.lights_mut().enumerate() {
        light.value += ambient(index);
    }
    if let Some(dirt) = dirt.as_deref().filter(|_| each.is_none()) {
        places.darken(dirt);
    }
    let grid = match options.grid {
        true => grid::bake(
            world,
            gather,
            options.samples,
            options.encoding,
            (world.ambient, options.least[2]),
            &mut |part| progress(BakeStage::Grid, part),
        )?,
        false => None,
    };
    Ok(places.finish(&targets, options, grid))
}

/// Mean light of points.
fn mean(points: &[Light]) -> Light {
    let mut sum = Light::default();
    for light in points {
        sum += *light;
    }
    sum * (1.0 / points.len().max(1) as f32)
}

/// Adds the bounces to the light of all places. `firsts`: [`Places::first_points`]; `ambient`: ambient light of each place;
/// `dirt`: part of the light that each keeps.
fn bounce(
    world: &RelitWorld,
    (targets, firsts): (&Targets, &[Point]),
    places: &mut Places,
    (ambient, dirt): (&dyn Fn(usize) -> Vec3, Option<&[f32]>),
    gather: &mut dyn Gather,
    options: &BakeOptions,
    progress: BakeProgress<'_>,
) -> Result<(), GatherError> {
    if options.bounces == 0 {
        return Ok(());
    }
    let reflectances = reflectances(world, options.reflectance);
    let mut last = places.clone();
    if world.has_compiled_lights {
        // q3map2 reflects the ambient term once
        for (index, light) in last.lights_mut().enumerate() {
            light.value += ambient(index);
        }
    }
    for number in 1..=options.bounces {
        last.fill(targets);
        let light: Vec<Vec3> = last.all.iter().map(|light| light.value).collect();
        let lit = LitSurfaces {
            triangles: &targets.lit,
            reflectances: &reflectances,
            light: &light,
        };
        let reflected = gather.reflected(firsts, lit, options.rays, &mut |part| {
            progress(BakeStage::Bounce(number), part);
        })?;
        let mut found = reflected.iter().copied();
        last = Places::of(targets, |points| match points.is_empty() {
            true => Light::default(),
            false => found.next().unwrap_or_default(),
        });
        last.smooth(world, targets);
        if let Some(dirt) = dirt {
            last.darken(dirt);
        }
        for (sum, more) in places.lights_mut().zip(last.lights_mut()) {
            sum.value += more.value;
            sum.towards += more.towards * BOUNCE_TOWARDS;
        }
    }
    Ok(())
}

/// What each triangle reflects.
fn reflectances(world: &RelitWorld, kind: Reflectance) -> Vec<Vec3> {
    let of_material = |material: &WorldMaterial| match kind {
        _ if material.is_sky() => Vec3::ZERO,
        Reflectance::Albedo => material.albedo,
        Reflectance::Compiler => {
            let shades = &material.shades;
            let sum: Vec3 = shades.iter().map(|shade| shade.encoded).sum();
            sum * (COMPILER_REFLECTANCE / shades.len().max(1) as f32)
        }
    };
    let of_materials: Vec<Vec3> = world.materials.iter().map(of_material).collect();
    let mut all = vec![Vec3::ZERO; world.indices.len() / 3];
    for surface in &world.surfaces {
        let value = item(&of_materials, surface.material as usize);
        part_mut(&mut all, surface.triangles()).fill(value);
    }
    all
}

/// Owners and light of each page, and its side.
fn of_pages<'a>(
    targets: &Targets,
    mut owners: &'a mut [u32],
    mut light: &'a mut [Light],
) -> Vec<(usize, &'a mut [u32], &'a mut [Light])> {
    let mut first = 0;
    let cut = |page: &targets::Page| {
        let (before, texels) = (page.first - first, page.side * page.side);
        first = page.first + texels;
        let owners = cut_off(&mut owners, before, texels);
        let light = cut_off(&mut light, before, texels);
        (page.side, owners, light)
    };
    targets.pages.iter().map(cut).collect()
}

/// Removes the first `before` items of a list, and the next `count`, which it returns.
fn cut_off<'a, T>(rest: &mut &'a mut [T], before: usize, count: usize) -> &'a mut [T] {
    let all = std::mem::take(rest);
    let (_, all) = all.split_at_mut(before.min(all.len()));
    let (cut, after) = all.split_at_mut(count.min(all.len()));
    *rest = after;
    cut
}

/// Light of all places: texels of all pages, then the world's vertices; and of the vertices that store light.
#[derive(Clone)]
struct Places {
    all: Vec<Light>,
    /// Light of [`Targets::vertices`].
    vertices: Vec<Light>,
    /// For each texel the surface that covers it, or `u32::MAX`.
    owners: Vec<u32>,
}

impl Places {
    /// Calls `light` with the points of each covered texel, and then of each vertex.
    fn of(targets: &Targets, mut light: impl FnMut(Range<usize>) -> Light) -> Places {
        let mut places = Places {
            all: vec![Light::default(); targets.places],
            vertices: Vec::with_capacity(targets.vertices.len()),
            owners: vec![u32::MAX; targets.texels],
        };
        let range = |points: &Range<u32>| points.start as usize..points.end as usize;
        for page in &targets.pages {
            for texel in &page.texels {
                let at = page.first + texel.at as usize;
                let found = light(range(&texel.points));
                if let (Some(slot), Some(owner)) =
                    (places.all.get_mut(at), places.owners.get_mut(at))
                    && !texel.points.is_empty()
                {
                    *slot = found;
                    *owner = texel.surface;
                }
            }
        }
        for vertex in &targets.vertices {
            let found = light(range(&vertex.points));
            places.vertices.push(found);
            places.spread_vertex(targets, vertex, found);
        }
        places
    }

    /// The light of all places, and of the vertices that store light.
    fn lights_mut(&mut self) -> impl Iterator<Item = &mut Light> {
        self.all.iter_mut().chain(&mut self.vertices)
    }

    /// Sets the light of a drawn vertex.
    fn spread_vertex(&mut self, targets: &Targets, vertex: &targets::Vertex, light: Light) {
        let drawn = vertex.drawn.map(|drawn| targets.texels + drawn as usize);
        if let Some(slot) = drawn.and_then(|at| self.all.get_mut(at)) {
            *slot = light;
        }
    }

    /// The first point of each place that has some, in the order of [`Places::of`].
    fn first_points(targets: &Targets) -> Vec<Point> {
        let texels = targets.pages.iter().flat_map(|page| &page.texels);
        let vertices = targets.vertices.iter().map(|vertex| &vertex.points);
        texels
            .map(|texel| &texel.points)
            .chain(vertices)
            .filter(|points| !points.is_empty())
            .filter_map(|points| targets.points.get(points.start as usize).copied())
            .collect()
    }

    /// Normals of all texels that have points, and of those around them.
    fn normals(&self, targets: &Targets) -> Vec<Vec3> {
        let mut all = vec![Vec3::ZERO; targets.texels];
        for page in &targets.pages {
            let range = page.first..page.first + page.side * page.side;
            let normals = part_mut(&mut all, range.clone());
            for texel in &page.texels {
                let point = targets.points.get(texel.points.start as usize);
                if let (Some(slot), Some(point)) = (normals.get_mut(texel.at as usize), point)
                    && !texel.points.is_empty()
                {
                    *slot = point.normal;
                }
            }
            let mut owners = part(&self.owners, range).to_vec();
            let mean = |near: &[Vec3]| near.iter().sum::<Vec3>().normalize_or_zero();
            coverage::fill(page.side, RINGS, &mut owners, normals, mean);
        }
        all
    }

    /// Gives texels around the covered ones light.
    fn fill(&mut self, targets: &Targets) {
        let mut pages = of_pages(targets, &mut self.owners, &mut self.all);
        parallel::each(&mut pages, |(side, owners, light)| {
            coverage::fill(*side, RINGS, owners, light, mean);
        });
    }

    /// Smooths the light of texels over their neighbours on the same plane.
    fn smooth(&mut self, world: &RelitWorld, targets: &Targets) {
        let mut pages = of_pages(targets, &mut self.owners, &mut self.all);
        parallel::each(&mut pages, |(side, owners, light)| {
            smooth::smooth(world, *side, owners, light);
        });
    }

    /// Multiplies the light of each place by its factor.
    fn darken(&mut self, factors: &[f32]) {
        for (light, factor) in self.lights_mut().zip(factors) {
            light.value *= *factor;
        }
    }

    fn finish(
        mut self,
        targets: &Targets,
        options: &BakeOptions,
        grid: Option<Vec<GridPoint>>,
    ) -> Baked {
        let lit = self
            .owners
            .iter()
            .filter(|owner| **owner != u32::MAX)
            .count();
        let covered: usize = targets.pages.iter().map(|page| page.texels.len()).sum();
        let dark = targets
            .vertices
            .iter()
            .filter(|v| v.points.is_empty())
            .count();
        let mut normals = self.normals(targets);
        self.fill(targets);
        let [texel, vertex, _] = options.least;
        let pages = targets.pages.iter().map(|page| {
            let range = page.first..page.first + page.side * page.side;
            let mut light = part(&self.all, range.clone()).to_vec();
            for light in &mut light {
                light.value = light.value.max(texel);
            }
            BakedPage {
                number: page.number,
                side: page.side,
                owners: part(&self.owners, range.clone()).to_vec(),
                light,
                normals: part_mut(&mut normals, range).to_vec(),
            }
        });
        let vertices = targets.vertices.iter().zip(&self.vertices);
        let vertices = vertices
            .filter(|(target, _)| !target.points.is_empty())
            .map(|(target, light)| (target.vertex, target.surface, light.value.max(vertex)));
        Baked {
            pages: pages.collect(),
            vertices: vertices.collect(),
            grid,
            unlit: covered - lit + dark,
        }
    }
}
