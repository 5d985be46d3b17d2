//! Recall and precision of light lists, measured by shadow rays.
//!
//! # Definitions
//!
//! A light is *visible* in a cluster when a ray from some point of the cluster, on a surface or in the open, to
//! some point of the light meets no opaque drawn triangle and does not pass through solid. (Walls without drawn
//! surfaces, as behind panels and outside the hull, do not stop rays that test triangles only. Such pairs are
//! counted separately.) A visible light *matters* when it gives the cluster more than [`DROPPED_PART`] of its
//! light.

use super::receivers::{Target, receivers};
use super::solid::through_solid;
use super::visibility_rays::DROPPED_PART;
use super::{LightLists, lists_of};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use support::parallel;
use support::random::Random;
use support::slice;

/// Comparison of lists with rays: see [`judge`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ListJudgement {
    /// Tested pairs of light and cluster.
    pub pairs: usize,
    /// Visible pairs.
    pub visible: usize,
    /// Pairs whose rays arrive only through solid; not visible.
    pub through_solid: usize,
    /// Visible pairs in the lists.
    pub found: usize,
    /// Pairs that matter.
    pub mattering: usize,
    /// Pairs that matter and are in the lists.
    pub mattering_found: usize,
    /// Pairs in the lists.
    pub listed: usize,
    /// Part of the arriving light that comes from listed lights.
    pub light_found: f64,
    /// Largest part of a cluster's light that comes from unlisted lights.
    pub worst_loss: f64,
}

impl ListJudgement {
    /// Part of the visible pairs in the lists.
    pub fn recall(&self) -> f64 {
        self.found as f64 / self.visible.max(1) as f64
    }

    /// Part of the pairs that matter in the lists.
    pub fn recall_of_mattering(&self) -> f64 {
        self.mattering_found as f64 / self.mattering.max(1) as f64
    }

    /// Part of the listed pairs that are visible.
    pub fn precision(&self) -> f64 {
        self.found as f64 / self.listed.max(1) as f64
    }
}

/// Compares several lists of one world with shadow rays: in every `step`th cluster, points other than those of
/// [`sweep`](super::sweep()) send `rays` rays to every light of the map.
pub fn judge(
    world: &RelitWorld,
    lists: &[&LightLists],
    rays: u32,
    step: usize,
) -> Vec<ListJudgement> {
    let clusters = world.light_lists.clusters();
    let occluders = Occluders::of_world(world);
    let receivers = receivers(world, clusters, 64, 16, 0x0dd5);
    let chosen: Vec<usize> = (0..clusters).step_by(step.max(1)).collect();
    let total = (world.lights.len() + world.point_lights.len()) as u32;
    let found = parallel::map(&chosen, |_, &cluster| {
        let mut judged = vec![ListJudgement::default(); lists.len()];
        let mut light = vec![0.0f64; lists.len() + 1];
        let receivers = receivers.get(cluster).map_or(&[][..], Vec::as_slice);
        let mut random = Random::new(0x7e57 + cluster as u64);
        if receivers.is_empty() {
            return (judged, light);
        }
        let row = |lists: &LightLists, entry: u32| {
            let row = i32::try_from(cluster).map_or(&[][..], |c| lists.row(c));
            row.binary_search(&entry).is_ok()
        };
        let mut found: Vec<(u32, f64)> = Vec::new();
        let mut through = 0;
        for entry in 0..total {
            let Some(target) = Target::of(world, entry) else {
                continue;
            };
            let mut arrived = 0.0f64;
            let mut leaks = false;
            for i in 0..rays {
                let Some(receiver) = slice::get(receivers, i as usize % receivers.len()) else {
                    break;
                };
                let (point, bare) = target.sample(receiver, &mut random);
                if bare <= 0.0 || occluders.blocked(receiver.position, point, false) {
                    continue;
                }
                if through_solid(&world.bsp, receiver.position, point) {
                    leaks = true;
                } else {
                    arrived += f64::from(bare) / f64::from(rays);
                }
            }
            through += usize::from(leaks && arrived <= 0.0);
            found.push((entry, arrived));
        }
        let all: f64 = found.iter().map(|(_, arrived)| arrived).sum();
        if let Some(sum) = light.last_mut() {
            *sum = all;
        }
        for (entry, arrived) in found {
            let visible = arrived > 0.0;
            let matters = arrived > all * f64::from(DROPPED_PART);
            for ((judged, lists), light) in judged.iter_mut().zip(lists).zip(&mut light) {
                let listed = row(lists, entry);
                judged.pairs += 1;
                judged.visible += usize::from(visible);
                judged.listed += usize::from(listed);
                judged.found += usize::from(visible && listed);
                judged.mattering += usize::from(matters);
                judged.mattering_found += usize::from(matters && listed);
                *light += if listed { arrived } else { 0.0 };
            }
        }
        for (judged, light) in judged.iter_mut().zip(&light) {
            judged.through_solid = through;
            judged.worst_loss = if all > 0.0 { 1.0 - light / all } else { 0.0 };
        }
        (judged, light)
    });
    let mut sums = vec![ListJudgement::default(); lists.len()];
    let mut all = 0.0;
    for (judged, light) in found {
        for ((sum, one), light) in sums.iter_mut().zip(judged).zip(&light) {
            sum.pairs += one.pairs;
            sum.visible += one.visible;
            sum.through_solid += one.through_solid;
            sum.worst_loss = sum.worst_loss.max(one.worst_loss);
            sum.listed += one.listed;
            sum.mattering += one.mattering;
            sum.mattering_found += one.mattering_found;
            sum.found += one.found;
            sum.light_found += light;
        }
        all += light.last().copied().unwrap_or(0.0);
    }
    for sum in &mut sums {
        sum.light_found = if all > 0.0 {
            sum.light_found / all
        } else {
            1.0
        };
    }
    sums
}

/// A world's lists from the PVS alone, for comparison.
pub fn lists_by_visibility(world: &RelitWorld) -> LightLists {
    lists_of(world, false)
}

/// A world's lists before any rays: from the PVS, without lights that face away from the cluster.
pub fn lists_by_geometry(world: &RelitWorld) -> LightLists {
    lists_of(world, true)
}
