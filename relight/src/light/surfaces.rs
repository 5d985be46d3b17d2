//! Triangle lights from emitting materials, and suns from sky materials.

use super::{
    DEFAULT_SUN_RADIUS, Emission, EmissionSource, EmitterSummary, SUN_IRRADIANCE, SunLight,
    TriangleLight,
};
use crate::world::{NO_LIGHT, RelitWorld, WorldMaterial, WorldSurface};
use glam::Vec3;
use support::slice::{self, part, span};

/// Smallest area of an emitting triangle, square id units: below it the light is less than rounding and the normal
/// is noise.
const LEAST_AREA: f32 = 1.0 / 64.0;

/// Largest area of an emitting triangle, square id units: no playable map is a million units wide. Larger triangles
/// count as degenerate, because their power might overflow.
const MOST_AREA: f32 = 1.0e12;

/// Suns of the sky materials of drawn surfaces. Equal suns count once.
pub(crate) fn suns(materials: &[WorldMaterial], surfaces: &[WorldSurface]) -> Vec<SunLight> {
    let mut used = vec![false; materials.len()];
    for surface in surfaces.iter().filter(|s| s.num_indices > 0) {
        if let Some(used) = used.get_mut(surface.material as usize) {
            *used = true;
        }
    }
    let mut suns: Vec<SunLight> = Vec::new();
    for (index, (material, _)) in materials
        .iter()
        .zip(used)
        .enumerate()
        .filter(|(_, (m, used))| *used && m.is_sky())
    {
        for sun in &material.resolved.definition().suns {
            let irradiance = sun.compiler_color() * (sun.intensity * SUN_IRRADIANCE);
            let direction = sun.direction.normalize_or_zero();
            if !irradiance.is_finite() || irradiance.max_element() <= 0.0 || direction == Vec3::ZERO
            {
                continue;
            }
            if suns
                .iter()
                .any(|s| s.direction == direction && s.irradiance == irradiance)
            {
                continue;
            }
            suns.push(SunLight {
                direction,
                irradiance,
                angular_radius: match sun.deviance_degrees {
                    d if d > 0.0 && d.is_finite() => d.min(90.0).to_radians(),
                    _ => DEFAULT_SUN_RADIUS,
                },
                material: Some(index as u32),
            });
        }
    }
    suns
}

/// Creates the triangle lights of a world whose materials have their emission, and the report of them.
pub(crate) fn add_triangle_lights(world: &mut RelitWorld) {
    world.lights.clear();
    world.report.emitters.clear();
    add_triangle_lights_of(world, |_| true);
}

/// Adds the triangle lights of the materials that `chosen` accepts by index.
pub(crate) fn add_triangle_lights_of(world: &mut RelitWorld, chosen: impl Fn(u32) -> bool) {
    let mut summaries: Vec<Option<EmitterSummary>> = vec![None; world.materials.len()];
    let mut lights = std::mem::take(&mut world.lights);
    for index in 0..world.surfaces.len() {
        let Some(surface) = slice::get(&world.surfaces, index).copied() else {
            continue;
        };
        if !chosen(surface.material) {
            continue;
        }
        let material = slice::get(&world.materials, surface.material as usize);
        let Some((material, emission)) = material.and_then(|m| Some((m, m.emission?))) else {
            continue; // emits nothing
        };
        let first = lights.len();
        let degenerate = add_surface_lights(
            world,
            index as u32,
            &surface,
            material,
            emission,
            &mut lights,
        );
        let made = part(&lights, first..);
        world.report.degenerate_triangles += degenerate;
        for (light, at) in made.iter().zip(first as u32..) {
            if let Some(slot) = world.triangle_lights.get_mut(light.triangle as usize) {
                *slot = at;
            }
        }
        if let Some(surface) = world.surfaces.get_mut(index) {
            surface.first_light = first as u32;
            surface.num_lights = made.len() as u32;
        }
        let Some(brightest) = made.first() else {
            // No triangle of the surface has an area.
            continue;
        };
        if let Some(slot) = summaries.get_mut(surface.material as usize) {
            let summary = slot.get_or_insert_with(|| EmitterSummary {
                material: surface.material,
                name: material.name.clone(),
                source: emission.source,
                radiance: brightest.radiance,
                surfaces: 0,
                triangles: 0,
                area: 0.0,
            });
            summary.surfaces += 1;
            summary.triangles += made.len();
            summary.area += made.iter().map(|l| f64::from(l.area())).sum::<f64>();
        }
    }
    debug_assert!(
        world
            .triangle_lights
            .iter()
            .all(|&l| l == NO_LIGHT || (l as usize) < lights.len())
    );
    world.lights = lights;
    world
        .report
        .emitters
        .extend(summaries.into_iter().flatten());
    world.report.emitters.sort_by_key(|e| e.material);
    world.report.triangle_lights = world.lights.len();
    world.report.point_lights = world.point_lights.len();
    world.report.suns = world.suns.len();
}

/// Removes triangle lights without radiance, and those of materials that `dropped` accepts.
pub(crate) fn remove_triangle_lights(world: &mut RelitWorld, dropped: impl Fn(u32) -> bool) {
    let old = std::mem::take(&mut world.lights);
    world.triangle_lights.fill(NO_LIGHT);
    for surface in &mut world.surfaces {
        let own = part(&old, span(surface.first_light, surface.num_lights));
        surface.first_light = world.lights.len() as u32;
        surface.num_lights = 0;
        if dropped(surface.material) {
            continue;
        }
        for light in own {
            if light.radiance.max_element() > 0.0 {
                if let Some(slot) = world.triangle_lights.get_mut(light.triangle as usize) {
                    *slot = world.lights.len() as u32;
                }
                world.lights.push(*light);
                surface.num_lights += 1;
            }
        }
    }
    world.report.emitters.retain(|e| !dropped(e.material));
    world.report.triangle_lights = world.lights.len();
}

/// Appends the lights of one surface; returns the number of degenerate triangles.
fn add_surface_lights(
    world: &RelitWorld,
    index: u32,
    surface: &WorldSurface,
    material: &WorldMaterial,
    emission: Emission,
    lights: &mut Vec<TriangleLight>,
) -> usize {
    let offset = world
        .models
        .get(surface.model as usize)
        .map_or(Vec3::ZERO, |m| m.origin);
    let sprite = emission.turns_to_viewer;
    let radiance = match emission.source {
        // The compiler has one light for all quads of the surface.
        EmissionSource::Sprite => {
            let area = world.surface_area(surface);
            if area < LEAST_AREA {
                Vec3::ZERO
            } else {
                emission.strength * (2.0 / area)
            }
        }
        _ => emission.strength,
    };
    if !radiance.is_finite() || radiance.max_element() <= 0.0 {
        return 0;
    }
    let first = surface.first_index / 3;
    let mut degenerate = 0;
    for triangle in first..first + surface.num_indices / 3 {
        let [a, b, c] = world.triangle(triangle as usize);
        // Front faces of a map are clockwise; a light's are counter-clockwise.
        let corners = if emission.reversed {
            [a, b, c]
        } else {
            [a, c, b]
        };
        let light = TriangleLight {
            vertices: corners.map(|p| p + offset),
            radiance,
            two_sided: emission.two_sided || sprite,
            surface: index,
            triangle: if sprite { u32::MAX } else { triangle },
            model: surface.model,
            is_sky: material.is_sky(),
            source: emission.source,
        };
        let area = light.area();
        if (LEAST_AREA..=MOST_AREA).contains(&area) {
            lights.push(light);
        } else {
            degenerate += 1;
        }
    }
    degenerate
}
