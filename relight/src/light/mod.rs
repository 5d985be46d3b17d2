//! Light sources of a map: which surfaces, stages and entities emit, the light lists of each cluster, and their
//! reduction by visibility rays. The source types and their units are in [`emitters`](mod@crate::emitters).

mod bounds;
mod by_hand;
mod color;
mod compiled;
mod emission;
mod entities;
mod fallback;
mod glow;
mod judge;
mod lists;
mod materials;
mod occlusion;
mod receivers;
mod sight;
mod sky_suns;
mod solid;
mod surfaces;
mod sweep;
mod sweep_cache;
mod visibility_rays;

pub use crate::emitters::*;
pub use bounds::STRONGEST;
pub use by_hand::{ChangeableLights, LightsByHand, lights_file};
pub use emission::GLOW_THRESHOLD;
pub use judge::{ListJudgement, judge, lists_by_geometry, lists_by_visibility};
pub use occlusion::Occlusion;
pub use sight::{ClusterSet, Sight};
pub use sweep::{SweepReport, sweep};
pub use visibility_rays::{DROPPED_LEAST, DROPPED_PART};

pub(crate) use crate::emitters::raise;
pub(crate) use color::recolor;
pub(crate) use emission::Finder;
pub(crate) use entities::{ambient, light_entities, negative_lights};
pub(crate) use fallback::add_fallback_light;
use lists::Clusters;
pub(crate) use surfaces::{
    add_triangle_lights, add_triangle_lights_of, remove_triangle_lights, suns,
};

/// The light lists of a world's current lights. `facing`: without lights whose plane has the whole cluster behind
/// it.
fn lists_of(world: &crate::world::RelitWorld, facing: bool) -> LightLists {
    let clusters = Clusters::new(&world.bsp);
    let sky = |s: &crate::world::WorldSurface| {
        let material = world.material_of(s);
        material.is_some_and(crate::world::WorldMaterial::is_sky)
    };
    let (lights, points) = (&world.lights, &world.point_lights);
    clusters.lists(lights, points, &world.surfaces, facing, sky)
}

/// Bounds a world's lights and rebuilds its light lists.
pub(crate) fn build_lists(world: &mut crate::world::RelitWorld) {
    bounds::bound_lights(world);
    world.light_lists = lists_of(world, true);
    world.report.clusters = world.light_lists.clusters();
    world.report.mean_list_length = world.light_lists.mean_length();
    world.report.longest_list = world.light_lists.longest();
}
