//! Light sources of a relit world: which surfaces, stages and entities emit, in which clusters they matter, and which of that
//! reaches anything. What they are, and their units: [`emitters`](mod@crate::emitters).

mod bounds;
mod by_hand;
mod color;
mod emission;
mod entities;
mod fallback;
mod glow;
mod judge;
mod kept;
mod lists;
mod looks;
mod materials;
mod occlusion;
mod receivers;
mod sight;
mod solid;
mod surfaces;
mod sweep;

pub use crate::emitters::*;
pub use bounds::STRONGEST;
pub use by_hand::{LightsByHand, LightsLineError};
pub use emission::GLOW_THRESHOLD;
pub use judge::{ListJudgement, judge, lists_by_geometry, lists_by_visibility};
pub use looks::{DROPPED_LEAST, DROPPED_PART};
pub use occlusion::Occlusion;
pub use sight::{ClusterSet, Sight};
pub use sweep::{SweepReport, sweep};

pub(crate) use crate::emitters::raise;
pub(crate) use color::recolor;
pub(crate) use emission::Finder;
pub(crate) use entities::{ambient, light_entities, negative_lights};
pub(crate) use fallback::rescue;
use lists::Clusters;
pub(crate) use surfaces::{place, place_of, suns, take_out};

/// The light lists of a world as it is now. `facing`: less what lies behind a light's plane.
fn lists_of(world: &crate::world::RelitWorld, facing: bool) -> LightLists {
    let clusters = Clusters::new(&world.bsp);
    let sky = |s: &crate::world::WorldSurface| {
        let material = world.materials.get(s.material as usize);
        material.is_some_and(crate::world::WorldMaterial::is_sky)
    };
    let (lights, points) = (&world.lights, &world.point_lights);
    clusters.lists(lights, points, &world.surfaces, facing, sky)
}

/// Builds a world's light lists, of lights within bounds.
pub(crate) fn build_lists(world: &mut crate::world::RelitWorld) {
    bounds::bound_lights(world);
    world.light_lists = lists_of(world, true);
    world.report.clusters = world.light_lists.clusters();
    world.report.mean_list_length = world.light_lists.mean_length();
    world.report.longest_list = world.light_lists.longest();
}
