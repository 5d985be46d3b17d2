//! Lightmap texels as samples: their position in space and their stored light.

use super::samples::{
    HELD_OUT, Sample, SampleContext, decode, is_held_out, is_measurable, sample_at, shown,
};
use crate::overbright::MAP_OVERBRIGHT_BITS;
use crate::world::{RelitWorld, WorldMaterial, WorldSurface, WorldVertex};
use glam::{Vec2, Vec3};
use q3bsp::Lightmap;
use std::collections::HashSet;
use support::parallel;
use support::random::Random;

/// Neighbourhood in which all texels of an unlit black texel are black, texels.
const BLACK_AROUND: i32 = 2;

/// Part of black texels above which they are thinned: the map may stand in a dark box much larger than itself.
const MOSTLY_BLACK: f32 = 0.5;

/// One black texel in this many stays.
const BLACK_THINNED: f32 = 3.0;

/// Texels that estimate the black part.
const BLACK_PROBES: usize = 2000;

/// Points tried in a stratum before it is skipped.
const TRIES: usize = 8;

/// Whether the first light layer of a surface is the constant one (style 0).
fn constant(world: &RelitWorld, surface: usize) -> bool {
    let layers = world.bsp.layers.surfaces.get(surface);
    layers.is_none_or(|l| l.lightmap_styles.first() == Some(&0))
}

/// Whether a surface has a lightmap.
pub(super) fn lit_by_texel(surface: &WorldSurface) -> bool {
    surface.light_page >= 0
}

/// Stored light of a texel or vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stored {
    rgb: [u8; 3],
    /// Whether it is black and a neighbour is not.
    lone_black: bool,
    /// Factor that the compiler applied before storing.
    scale: f32,
    /// Size of a step of this page in steps of the map's own pages.
    step: f32,
}

impl Stored {
    /// A value without neighbours.
    pub(super) fn alone(rgb: [u8; 3]) -> Stored {
        Stored {
            rgb,
            lone_black: dark(rgb),
            scale: 1.0,
            step: 1.0,
        }
    }

    /// Whether it is black while a neighbour is not.
    pub(super) fn lone_black(&self) -> bool {
        self.lone_black
    }

    /// Whether a channel is 255.
    pub(super) fn saturated(&self) -> bool {
        self.rgb.contains(&255)
    }

    /// Display-encoded colour as the engine shows it.
    pub(super) fn shown(&self) -> Vec3 {
        shown(self.steps())
    }

    /// Light, irradiance over π.
    pub(super) fn light(&self, world: &RelitWorld) -> Vec3 {
        decode(world, self.steps(), self.scale)
    }

    /// Value in steps of the map's own pages.
    fn steps(&self) -> Vec3 {
        Vec3::from_array(self.rgb.map(f32::from)) * self.step
    }

    /// A texel of a page, of a surface whose light was multiplied by `scale`. `step`: size of a step of the page in
    /// steps of the map's own pages.
    fn texel(page: &Lightmap, x: usize, y: usize, scale: f32, step: f32) -> Stored {
        let rgb = page.texel(x, y);
        let around = || {
            let sides = -BLACK_AROUND..=BLACK_AROUND;
            sides
                .clone()
                .flat_map(move |dy| sides.clone().map(move |dx| (dx, dy)))
        };
        let lit = |(dx, dy): (i32, i32)| {
            let inside = |at: usize, by: i32| {
                let at = at.checked_add_signed(by as isize)?;
                (at < page.size()).then_some(at)
            };
            match (inside(x, dx), inside(y, dy)) {
                (Some(x), Some(y)) => !dark(page.texel(x, y)),
                _ => false,
            }
        };
        Stored {
            rgb,
            lone_black: dark(rgb) && around().any(lit),
            scale,
            step,
        }
    }
}

/// Whether a stored colour is below one step in the mean.
fn dark(rgb: [u8; 3]) -> bool {
    rgb.map(u32::from).iter().sum::<u32>() < 3
}

/// Texels, stratified by area, each at most once. Whether a texel is held out depends on the texel and the seed
/// only, so no other choice of samples fits it. `few_black`: thin the black texels among the fitted ones in a
/// mostly black map.
pub(super) fn take(
    context: &SampleContext<'_>,
    count: usize,
    few_black: bool,
    random: &mut Random,
) -> Vec<Sample> {
    let mut density_map = SampleDensity::new(context.world, count);
    let black = if few_black {
        density_map.part_black()
    } else {
        0.0
    };
    let thinned = black > MOSTLY_BLACK;
    if thinned {
        let fitted = 1.0 - 1.0 / HELD_OUT as f32;
        let measured = 1.0 - black * fitted * (1.0 - 1.0 / BLACK_THINNED);
        density_map = SampleDensity::new(context.world, (count as f32 / measured) as usize);
    }
    let strata = density_map.total() as usize;
    let mut samples = Vec::with_capacity(strata);
    let mut taken = HashSet::new();
    for stratum in 0..strata {
        for _ in 0..TRIES {
            let at = (stratum as f64 + f64::from(random.uniform())) / strata as f64;
            // Its centre may be off the surface.
            let Some(found) = density_map.texel_at(at, random) else {
                continue;
            };
            if !taken.insert(found.id) {
                continue;
            }
            if let Some(sample) = found.sample(context) {
                samples.push(sample);
                break;
            }
        }
    }
    if thinned {
        let dark = |s: &Sample| s.value == Vec3::ZERO;
        samples.retain(|s| s.held_out || !dark(s) || random.uniform() * BLACK_THINNED < 1.0);
    }
    parallel::each(&mut samples, |sample| context.remove_dirt(sample));
    samples
}

/// Page, column and row of a texel.
pub(super) type TexelId = [u32; 3];

/// A texel to be sampled.
pub(super) struct Texel {
    pub id: TexelId,
    /// Centre and normal.
    place: (Vec3, Vec3),
    material: u32,
    pub stored: Stored,
}

impl Texel {
    /// Its sample; `None` where the position is invalid.
    pub fn measured(self, context: &SampleContext<'_>) -> Option<Sample> {
        let mut sample = self.sample(context)?;
        context.remove_dirt(&mut sample);
        Some(sample)
    }

    /// The same with the dirt not yet removed.
    fn sample(self, context: &SampleContext<'_>) -> Option<Sample> {
        let mut sample = sample_at(context, self.place, self.material, self.stored)?;
        sample.held_out = is_held_out(context.seed, &self.id);
        Some(sample)
    }
}

/// Number of samples for each measurable triangle: proportional to its area, at most its number of texels.
/// Otherwise distant surroundings with huge texels would take the samples of the map itself.
struct SampleDensity<'a> {
    world: &'a RelitWorld,
    /// Cumulative number of samples, triangle, surface.
    triangles: Vec<(f64, usize, &'a WorldSurface)>,
}

impl<'a> SampleDensity<'a> {
    /// The distribution of about `count` samples.
    fn new(world: &'a RelitWorld, count: usize) -> SampleDensity<'a> {
        let mut sizes = Vec::new();
        let mut triangles = Vec::new();
        for (index, surface) in world.surfaces.iter().enumerate() {
            if !lit_by_texel(surface) || !is_measurable(world, surface) || !constant(world, index) {
                continue;
            }
            let page = usize::try_from(surface.light_page).ok();
            let page = page.and_then(|page| world.page(page));
            let side = page.map_or(0.0, |page| page.size() as f32);
            for triangle in surface.triangles() {
                let corners = world.corners(triangle);
                let [a, b, c] = corners.map(|c| c.position);
                let [s, t, u] = corners.map(|c| c.lightmap * side);
                let area = (b - a).cross(c - a).length() * 0.5;
                let texels = (t - s).perp_dot(u - s).abs() * 0.5;
                if area > 0.0 && area.is_finite() && texels.is_finite() {
                    sizes.push([f64::from(area), f64::from(texels)]);
                    triangles.push((triangle, surface));
                }
            }
        }
        let density = density(&sizes, count as f64);
        let mut end = 0.0;
        let triangles = triangles.into_iter().zip(sizes);
        let triangles = triangles.map(|((triangle, surface), [area, texels])| {
            end += (area * density).min(texels);
            (end, triangle, surface)
        });
        SampleDensity {
            world,
            triangles: triangles.collect(),
        }
    }

    /// Number of samples.
    fn total(&self) -> f64 {
        self.triangles.last().map_or(0.0, |(end, ..)| *end)
    }

    /// A random texel of the triangle at a fraction of all samples.
    fn texel_at(&self, part: f64, random: &mut Random) -> Option<Texel> {
        let at = part * self.total();
        let found = self.triangles.partition_point(|(end, ..)| *end <= at);
        let &(_, triangle, surface) = self.triangles.get(found)?;
        texel(self.world, triangle, surface, random)
    }

    /// Part of texels that are black.
    fn part_black(&self) -> f32 {
        let mut random = Random::new(0xB1AC);
        let (mut probes, mut blacks) = (0.0f32, 0.0);
        for k in 0..BLACK_PROBES {
            let part = (k as f64 + 0.5) / BLACK_PROBES as f64;
            if let Some(texel) = self.texel_at(part, &mut random) {
                probes += 1.0;
                blacks += f32::from(u8::from(dark(texel.stored.rgb)));
            }
        }
        blacks / probes.max(1.0)
    }
}

/// Samples per area so that triangles of these areas and texel counts get `count` in total, none more than its
/// texels.
fn density(sizes: &[[f64; 2]], count: f64) -> f64 {
    let mut by_texel_size: Vec<[f64; 2]> = sizes.to_vec();
    by_texel_size.sort_by(|[a, s], [b, t]| (s / a).total_cmp(&(t / b)));
    let mut wanted = count;
    let mut area: f64 = sizes.iter().map(|[area, _]| area).sum();
    // Triangles with the largest texels saturate first; the others get the rest.
    for [own, texels] in by_texel_size {
        if area <= 0.0 || wanted * own <= texels * area {
            return (wanted / area.max(f64::MIN_POSITIVE)).max(0.0);
        }
        wanted -= texels;
        area -= own;
    }
    f64::INFINITY
}

/// The texel at a random point of a triangle. `None` if its centre is off the surface: compilers move such texels.
fn texel(
    world: &RelitWorld,
    triangle: usize,
    surface: &WorldSurface,
    random: &mut Random,
) -> Option<Texel> {
    let [a, b, c] = world.corners(triangle).map(|c| c.lightmap);
    let (u, v) = random.in_triangle();
    texel_at(world, triangle, surface, a + (b - a) * u + (c - a) * v)
}

/// The texel at a page position (0 to 1).
fn texel_at(
    world: &RelitWorld,
    triangle: usize,
    surface: &WorldSurface,
    at: Vec2,
) -> Option<Texel> {
    let number = usize::try_from(surface.light_page).ok()?;
    let page = world.page(number)?;
    let size = page.size() as f32;
    let cell = (at * size).floor();
    if !(cell.min_element() >= 0.0 && cell.max_element() < size) {
        return None;
    }
    let middle = cell + Vec2::splat(0.5);
    let others = surface.triangles();
    let place = std::iter::once(triangle)
        .chain(others)
        .find_map(|t| place_of(world.corners(t), middle, size))?;
    let scale = stored_scale(world, surface);
    Some(Texel {
        id: [number as u32, cell.x as u32, cell.y as u32],
        place,
        material: surface.material,
        stored: Stored::texel(
            page,
            cell.x as usize,
            cell.y as usize,
            scale,
            step_of(world, number),
        ),
    })
}

/// Light that the lightmap stores at a hit point; `None` where it is no evidence: unmeasurable surfaces, saturated
/// texels, lone black texels.
pub(super) fn stored_at(
    world: &RelitWorld,
    surface: usize,
    triangle: usize,
    at: Vec3,
) -> Option<Vec3> {
    let own = world.surfaces.get(surface)?;
    let number = usize::try_from(own.light_page).ok()?;
    let page = world.page(number)?;
    let cell = (page_place(world, surface, triangle, at)? * page.size() as f32).floor();
    if !(cell.min_element() >= 0.0 && cell.max_element() < page.size() as f32) {
        return None;
    }
    let scale = stored_scale(world, own);
    let step = step_of(world, number);
    let stored = Stored::texel(page, cell.x as usize, cell.y as usize, scale, step);
    (!stored.lone_black && !stored.rgb.contains(&255)).then(|| stored.light(world))
}

/// The texel at a hit point; `None` where it is no evidence.
pub(super) fn texel_on(
    world: &RelitWorld,
    surface: usize,
    triangle: usize,
    at: Vec3,
) -> Option<Texel> {
    let place = page_place(world, surface, triangle, at)?;
    texel_at(world, triangle, world.surfaces.get(surface)?, place)
}

/// Page position (0 to 1) of a point on a triangle; `None` for surfaces that are not measurable.
fn page_place(world: &RelitWorld, surface: usize, triangle: usize, at: Vec3) -> Option<Vec2> {
    let own = world.surfaces.get(surface)?;
    if !lit_by_texel(own) || !is_measurable(world, own) || !constant(world, surface) {
        return None;
    }
    let [a, b, c] = world.corners(triangle);
    let (e1, e2, offset) = (
        b.position - a.position,
        c.position - a.position,
        at - a.position,
    );
    let normal = e1.cross(e2);
    let squared = normal.length_squared();
    if squared <= 0.0 {
        return None;
    }
    let u = offset.cross(e2).dot(normal) / squared;
    let v = e1.cross(offset).dot(normal) / squared;
    Some(a.lightmap + (b.lightmap - a.lightmap) * u + (c.lightmap - a.lightmap) * v)
}

/// Size of a step of a page in steps of the map's own pages: pages that are shown as stored have finer steps.
fn step_of(world: &RelitWorld, page: usize) -> f32 {
    match world.is_shown_as_stored(page) {
        true => 1.0 / (1 << MAP_OVERBRIGHT_BITS) as f32,
        false => 1.0,
    }
}

/// Factor that the compiler applied to a surface's light before storing.
fn stored_scale(world: &RelitWorld, surface: &WorldSurface) -> f32 {
    let material = world.material_of(surface);
    material.map_or(1.0, WorldMaterial::stored_scale)
}

/// Position and normal of a page position, in texels, if the triangle covers it. `size`: texels along the side of
/// the page.
fn place_of([a, b, c]: [WorldVertex; 3], at: Vec2, size: f32) -> Option<(Vec3, Vec3)> {
    let (e1, e2) = (
        (b.lightmap - a.lightmap) * size,
        (c.lightmap - a.lightmap) * size,
    );
    let offset = at - a.lightmap * size;
    let determinant = e1.perp_dot(e2);
    if determinant.abs() < 1e-6 {
        return None;
    }
    let (u, v) = (
        offset.perp_dot(e2) / determinant,
        e1.perp_dot(offset) / determinant,
    );
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| {
        let on = a.position + (b.position - a.position) * u + (c.position - a.position) * v;
        let normal = a.normal + (b.normal - a.normal) * u + (c.normal - a.normal) * v;
        (on, normal.normalize_or_zero())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_texels_are_trusted_in_black_surroundings() {
        let side = q3bsp::LIGHTMAP_SIZE;
        let mut texels = vec![0u8; side * side * 3].into_boxed_slice();
        // One lit texel, in the middle of the first row.
        texels[10 * 3..10 * 3 + 3].fill(90);
        let page = Lightmap(texels);
        let lone = |x, y| Stored::texel(&page, x, y, 1.0, 1.0).lone_black;
        assert!(!lone(10, 0) && lone(9, 0) && lone(8, 2) && lone(12, 0));
        assert!(!lone(7, 0) && !lone(10, 3) && !lone(0, 0) && !lone(side - 1, side - 1));
    }
}
