//! Colours of described lights under another exponent: see [`LightColor`](super::LightColor).

use super::emission::directed;
use super::{EmissionSource, raise};
use crate::world::RelitWorld;

/// Raises the colours of lights from directives and entities to another exponent. This is exact, because exponents
/// of successive [`raise`]s multiply.
pub(crate) fn recolor(world: &mut RelitWorld, exponent: f32) {
    let by = exponent / world.color_exponent;
    if by == 1.0 {
        return;
    }
    world.color_exponent = exponent;
    let described: Vec<bool> = (world.materials.iter())
        .map(|material| directed(material).is_some())
        .collect();
    let is_described = |material: u32| described.get(material as usize) == Some(&true);
    let of_surface = |surface: u32| {
        let surface = world.surfaces.get(surface as usize);
        surface.is_some_and(|surface| is_described(surface.material))
    };
    let lights = (world.lights.iter_mut())
        .filter(|light| light.source != EmissionSource::Flare && of_surface(light.surface))
        .map(|light| &mut light.radiance);
    let emissions = (world.materials.iter_mut().zip(&described))
        .filter(|(_, described)| **described)
        .filter_map(|(material, _)| Some(&mut material.emission.as_mut()?.strength));
    let summaries = (world.report.emitters.iter_mut())
        .filter(|s| s.source != EmissionSource::Flare && is_described(s.material))
        .map(|summary| &mut summary.radiance);
    let strengths = lights
        .chain(emissions)
        .chain(summaries)
        .chain(world.point_lights.iter_mut().map(|l| &mut l.intensity))
        .chain(world.suns.iter_mut().map(|sun| &mut sun.irradiance))
        .chain([&mut world.ambient]);
    for strength in strengths {
        *strength = raise(*strength, by);
    }
}
