//! Fallback light for maps whose directives describe none.
//!
//! Some maps were made for compilers that take all light from entities, and had the entities stripped. Weaker
//! evidence is then used together:
//!
//! * glowing stages of any strength on any surface, with their emission;
//! * skies, with the mean radiance of their image;
//! * flares, which mappers or materials place at lamps. Each becomes a square light of the flare's colour,
//!   [`LAMP_SIDE`] wide, as strong as a surface of `q3map_surfacelight` [`LAMP_VALUE`].
//!
//! Without any of these the mean of the lightmaps becomes the ambient term, so that the map is visible.

use super::{
    AMBIENT_RADIANCE, Emission, EmissionSource, EmitterSummary, Finder, SURFACE_LIGHT_RADIANCE,
};
use super::{TriangleLight, surfaces};
use crate::overbright::{self, MAP_OVERBRIGHT_BITS};
use crate::world::{Flare, RelitWorld};
use glam::Vec3;

/// Side of a flare's lamp, id units.
const LAMP_SIDE: f32 = 16.0;

/// Strength of that lamp: the median `q3map_surfacelight` in OpenArena's scripts.
const LAMP_VALUE: f32 = 2000.0;

/// Distance of a lamp from its flare, id units: flares lie in the plane of their surface.
const LAMP_OFFSET: f32 = 1.0;

/// Ambient value (0..255) of maps without lightmaps.
const BARE_AMBIENT: f32 = 64.0;

/// Adds light to a world that has none.
pub(crate) fn add_fallback_light(world: &mut RelitWorld, finder: &mut Finder<'_>) {
    world.report.fallback = true;
    for material in &mut world.materials {
        if material.emission.is_none() {
            material.emission = finder.faint_emission(material);
        }
    }
    surfaces::add_triangle_lights(world);
    for flare in world.flares.clone() {
        lamp(world, &flare);
    }
    world.report.triangle_lights = world.lights.len();
    if world.light_count() == 0 && world.ambient == Vec3::ZERO {
        world.ambient = super::raise(
            mean_lightmap(world) * AMBIENT_RADIANCE,
            world.color_exponent,
        );
    }
}

/// A square lamp in front of a flare.
fn lamp(world: &mut RelitWorld, flare: &Flare) {
    let encoded = flare.color.clamp(Vec3::ZERO, Vec3::ONE);
    let radiance = overbright::colour_to_linear(encoded) * (LAMP_VALUE * SURFACE_LIGHT_RADIANCE);
    if radiance.max_element() <= 0.0 {
        return;
    }
    let normal = flare.normal.normalize_or(Vec3::NEG_Z);
    let (u, v) = normal.any_orthonormal_pair();
    let (u, v) = (u * (LAMP_SIDE / 2.0), v * (LAMP_SIDE / 2.0));
    let center = flare.origin + flare.normal.normalize_or_zero() * LAMP_OFFSET;
    // Counter-clockwise seen from the front: u, v and the normal are right-handed.
    let corners = [
        center - u - v,
        center + u - v,
        center + u + v,
        center - u + v,
    ];
    let first_light = world.lights.len() as u32;
    for triangle in [[0, 1, 2], [0, 2, 3]] {
        world.lights.push(TriangleLight {
            vertices: triangle.map(|i: usize| corners[i]),
            radiance,
            two_sided: flare.normal == Vec3::ZERO,
            surface: flare.surface,
            triangle: u32::MAX,
            model: 0,
            is_sky: false,
            source: EmissionSource::Flare,
        });
    }
    if let Some(surface) = world.surfaces.get_mut(flare.surface as usize) {
        surface.first_light = first_light;
        surface.num_lights = 2;
    }
    let known = world
        .report
        .emitters
        .iter_mut()
        .find(|e| e.source == EmissionSource::Flare && e.material == flare.material);
    let area = f64::from(LAMP_SIDE * LAMP_SIDE);
    match known {
        Some(summary) => {
            summary.surfaces += 1;
            summary.triangles += 2;
            summary.area += area;
        }
        None => world.report.emitters.push(EmitterSummary {
            material: flare.material,
            name: world
                .materials
                .get(flare.material as usize)
                .map_or_else(String::new, |m| m.name.clone()),
            source: EmissionSource::Flare,
            radiance,
            surfaces: 1,
            triangles: 2,
            area,
        }),
    }
}

/// Mean of the lightmaps, 0..255 as stored; grey for maps without any light in them.
fn mean_lightmap(world: &RelitWorld) -> Vec3 {
    let mut sum = [0u64; 3];
    let mut count = 0u64;
    let pages = (0..).map_while(|number| Some((number, world.page(number)?)));
    for (number, page) in pages {
        // A step of a page that is shown as stored is a quarter of a step of the map's own pages.
        let weight = match world.is_shown_as_stored(number) {
            true => 1,
            false => 1 << MAP_OVERBRIGHT_BITS,
        };
        for texel in page.0.as_chunks::<3>().0 {
            for (sum, &byte) in sum.iter_mut().zip(texel) {
                *sum += u64::from(byte) * weight;
            }
            count += 1;
        }
    }
    let whole = (count.max(1) << MAP_OVERBRIGHT_BITS) as f64;
    let mean = Vec3::from_array(sum.map(|s| (s as f64 / whole) as f32));
    if mean.max_element() >= 1.0 {
        mean
    } else {
        Vec3::splat(BARE_AMBIENT)
    }
}

impl Finder<'_> {
    /// Emission of a material without directives and without a strong glow: everything that its stages emit.
    fn faint_emission(&mut self, material: &crate::world::WorldMaterial) -> Option<Emission> {
        let shown = if material.is_sky() {
            self.sky_radiance(material)
        } else {
            self.shown(material)
        };
        let source = if material.is_sky() {
            EmissionSource::Sky
        } else {
            EmissionSource::Glow
        };
        (overbright::luminance(shown) > 1e-3).then(|| Emission::of(material, source, shown))
    }
}
