//! Light that comes by way of other surfaces.
//!
//! Tracing adds bounced light to direct light, so that direct light must not explain all of a lightmap. What a surface
//! throws back is its albedo times the light on it, and that light is known: it is in the lightmap. So bounced light
//! at a sample is gathered from what rays hit, before any light is known.

use super::bvh::{Hit, Occluders};
use super::parallel;
use super::random::Random;
use super::samples::{STORED_UNIT, Sample, corners};
use crate::world::RelitWorld;
use glam::{Vec2, Vec3};
use q3bsp::lightmap_index;
use std::f32::consts::TAU;

/// Rays per sample: a square of this many strata a side.
const SIDE: u32 = 5;

/// Gives every sample its bounced light.
pub(super) fn gather(world: &RelitWorld, occluders: &Occluders, samples: &mut [Sample]) {
    let black = world.surfaces.iter().all(|s| {
        let material = world.materials.get(s.material as usize);
        material.is_none_or(|m| m.albedo == Vec3::ZERO)
    });
    if black {
        return;
    }
    let of_triangle = surfaces_of_triangles(world);
    let gathered = parallel::map(samples, |i, sample| {
        let mut random = Random::new(0xB0_0000 + i as u64);
        let (u, v) = sample.normal.any_orthonormal_pair();
        let mut sum = Vec3::ZERO;
        for stratum in 0..SIDE * SIDE {
            let x = ((stratum % SIDE) as f32 + random.next()) / SIDE as f32;
            let y = ((stratum / SIDE) as f32 + random.next()) / SIDE as f32;
            // Density cosine / π: the mean of radiance is irradiance / π (Malley's method).
            let (sin, cos) = (x * TAU).sin_cos();
            let radius = y.sqrt();
            let ray = u * (radius * cos) + v * (radius * sin) + sample.normal * (1.0 - y).sqrt();
            if let Some(hit) = occluders.nearest(sample.position, ray, f32::INFINITY)
                && hit.front
                && !hit.sky
            {
                sum += thrown_back(world, &of_triangle, &hit).unwrap_or(Vec3::ZERO);
            }
        }
        sum / (SIDE * SIDE) as f32
    });
    for (sample, bounce) in samples.iter_mut().zip(gathered) {
        sample.bounce = bounce;
    }
}

/// For every triangle, the surface that it is of.
fn surfaces_of_triangles(world: &RelitWorld) -> Vec<u32> {
    let mut of_triangle = vec![u32::MAX; world.indices.len() / 3];
    for (index, surface) in (0u32..).zip(&world.surfaces) {
        let first = surface.first_index as usize / 3;
        let own = first..first + surface.num_indices as usize / 3;
        of_triangle.get_mut(own).unwrap_or_default().fill(index);
    }
    of_triangle
}

/// Radiance that leaves a surface where a ray met it, without its own emission.
fn thrown_back(world: &RelitWorld, of_triangle: &[u32], hit: &Hit) -> Option<Vec3> {
    let surface = *of_triangle.get(hit.tag as usize)?;
    let surface = world.surfaces.get(surface as usize)?;
    let albedo = world.materials.get(surface.material as usize)?.albedo;
    let [a, b, c] = corners(world, hit.tag as usize)?;
    let (u, v) = hit.at;
    let light = match surface.lightmap {
        page @ 0.. => {
            let at: Vec2 = a.lightmap * (1.0 - u - v) + b.lightmap * u + c.lightmap * v;
            let page = world.bsp.lightmaps.get(page as usize)?;
            let at = at * page.size() as f32;
            // Casts saturate.
            let texel = page.texel(at.x as usize, at.y as usize);
            Vec3::from_array(texel.map(f32::from)) * STORED_UNIT
        }
        lightmap_index::BY_VERTEX => {
            // Shifted already, by what may not be all of it.
            let shifted = (1u32 << world.overbright_shift.min(8)) as f32;
            let colour = |v: &crate::world::WorldVertex| {
                let [r, g, b, _] = v.color;
                Vec3::from_array([r, g, b].map(f32::from)) * (STORED_UNIT / shifted)
            };
            colour(a) * (1.0 - u - v) + colour(b) * u + colour(c) * v
        }
        _ => return None,
    };
    Some(albedo * light)
}
