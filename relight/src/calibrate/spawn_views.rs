//! Views from spawn points. Samples are stratified by area; these views weight them by how much of the screen they
//! fill.

use super::bounce::Near;
use super::samples::Sample;
use crate::occluders::Occluders;
use crate::viewpoints::{self, Viewpoint};
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::Entity;
use support::parallel;
use support::random::Random;

/// Largest number of views.
const VIEWS: usize = 128;

/// Rays of all views together.
const RAYS: usize = 16_384;

/// Half the height of a 4 : 3 view with a horizontal field of view of 90 degrees, at distance 1.
const HALF_HEIGHT: f32 = 0.75;

/// Camera at a spawn point.
struct View {
    origin: Vec3,
    forward: Vec3,
}

/// The views from the spawn points.
fn views(entities: &[Entity]) -> Vec<View> {
    let all: Vec<View> = viewpoints::spawn_views(entities)
        .filter_map(|Viewpoint { origin, yaw, .. }| {
            let (sin, cos) = yaw.to_radians().sin_cos();
            let forward = Vec3::new(cos, sin, 0.0);
            (origin.is_finite() && forward.is_finite()).then_some(View { origin, forward })
        })
        .collect();
    let step = all.len().div_ceil(VIEWS).max(1);
    all.into_iter().step_by(step).collect()
}

/// (sample, material) for each of many pixels that show a lit surface. Empty for maps without spawn points.
pub(super) fn visible_samples(
    world: &RelitWorld,
    occluders: &Occluders,
    samples: &[Sample],
) -> Vec<(u32, u32)> {
    let views = views(&world.bsp.entities());
    let of_triangle = world.surfaces_of_triangles();
    let near = Near::new(samples);
    let rays = RAYS / views.len().max(1);
    let found = parallel::map(&views, |i, view| {
        let mut random = Random::new(0x5EE0_0000 + i as u64);
        let aside = view.forward.cross(Vec3::Z);
        let pixel = |ray: usize| {
            let x = (ray as f32 + random.uniform()) / rays as f32 * 2.0 - 1.0;
            let y = (random.uniform() * 2.0 - 1.0) * HALF_HEIGHT;
            let ray = view.forward + aside * x + Vec3::Z * y;
            let hit = occluders.nearest(view.origin, ray, f32::INFINITY);
            let hit = hit.filter(|hit| hit.front && !hit.sky)?;
            let surface = *of_triangle.get(hit.tag as usize)?;
            let index = world.surfaces.get(surface as usize)?.material;
            if world.materials.get(index as usize)?.emission.is_some() {
                return None;
            }
            let sample = near.find(samples, view.origin + ray * hit.t, hit.normal)?;
            Some((sample, index))
        };
        (0..rays).filter_map(pixel).collect::<Vec<_>>()
    });
    found.into_iter().flatten().collect()
}
