//! Visibility rays at load: the part of each light that arrives in each cluster of its lists.
//!
//! Receivers of a cluster (points on its surfaces, and some in the open for moving models) send rays to random
//! points of each light in the cluster's list. Each pair of light and cluster gets two numbers: the mean unshadowed
//! light, and the visible part. They give the tracer its selection probabilities, and decide which lights can be
//! dropped.
//!
//! # Dropped lights
//!
//! A light is dropped from a cluster's list only if none of its rays arrived, and only while everything dropped
//! from the list stays below [`DROPPED_PART`](super::DROPPED_PART) of the light that arrives there. A light that
//! arrives in a neighbouring cluster is charged with a multiple of its light (`NEIGHBOUR_CHARGE`): where light
//! enters through a gap, few receivers see it.
//!
//! The light missed by dropping every light without a hit among n rays is estimated from the lights with exactly
//! one hit (Good, *The Population Frequencies of Species and the Estimation of Population Parameters*, 1953). A
//! light with visible part v has no hit with probability (1 - v)^n and one hit with probability n v (1 - v)^(n -
//! 1), so with b the unshadowed light, the sum of b / n over the lights with one hit has the expected missed light
//! as its mean. Where no light has exactly one hit, the expected number of hits is below 3 with a confidence of 95
//! %, and less than 3 times the largest b / n is missed. Both terms are added, and b is the peak over the
//! receivers. Strong lights without a hit stay in the list with a small probability, so the estimators stay as
//! unbiased as without the sweep, except for the dropped part.
//!
//! # Ray budget
//!
//! A map gets at most [`BUDGET`] rays; each cluster gets a part in proportion to its list's entries, so the result
//! depends on no clock. The first round may use half and finds lights that are easily seen; the second sends more
//! rays to lights without hits, weakest first. Rays that visible lights do not need go to the lights after them. If
//! the budget leaves less than `MIN_RAYS` rays a pair, the lights with most unshadowed light come first; pairs
//! without a ray stay in the list as the PVS has them, with a probability by their unshadowed light.
//!
//! Results can be cached: see [`sweep`].

use super::receivers::{luminance, receivers};
use super::visibility_rays::{
    Pair, Row, boxes, first_round, mark_neighbours, retained, second_round,
};
use super::{LightLists, LightShare, sweep_cache};
use crate::cache::CalibrationCache;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use std::time::Instant;
use support::parallel;
use support::random::Random;

/// Receivers of a cluster: on surfaces, and in the open.
const ON_SURFACES: usize = 96;
const IN_THE_OPEN: usize = 32;

/// Most rays for a map: see the [module](self). Less than two seconds on two processor cores on large maps.
const BUDGET: u64 = 6_000_000;

/// Figures of a sweep.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SweepReport {
    /// Entries of the clusters' lists before and after.
    pub entries: [usize; 2],
    /// Clusters without a receiver; their lists stay.
    pub unseen: usize,
    /// Pairs without a ray for lack of budget; they stay.
    pub unswept: usize,
    /// Number of rays.
    pub rays: u64,
    /// Whether it comes from a cache; `rays` and `unswept` are 0 then.
    pub cached: bool,
    /// Duration, seconds.
    pub seconds: f64,
}

/// Sends visibility rays through a world's light lists: shortens the lists and stores the share of each entry. The
/// result depends on the world alone: its geometry and its current lights. A world whose lists have shares stays
/// unchanged. With a `cache` the result is read from it or written to it; failures become warnings of the world.
pub fn sweep(world: &mut RelitWorld, cache: Option<&CalibrationCache>) -> SweepReport {
    let begin = Instant::now();
    let lists = &world.light_lists;
    let entries = lists.lights.len() - lists.row(-1).len();
    if lists.clusters() == 0 || entries == 0 || !lists.shares.is_empty() {
        return SweepReport {
            entries: [entries; 2],
            ..SweepReport::default()
        };
    }
    let (lists, mut report) =
        sweep_cache::load_or_sweep(world, cache, |world| fresh(world, entries, BUDGET));
    world.report.mean_list_length = lists.mean_length();
    world.report.longest_list = lists.longest();
    world.light_lists = lists;
    report.seconds = begin.elapsed().as_secs_f64();
    report
}

/// A world's lists of `entries` entries, swept with at most `budget` rays.
pub(super) fn fresh(world: &RelitWorld, entries: usize, budget: u64) -> (LightLists, SweepReport) {
    let old = &world.light_lists;
    let clusters = old.clusters();
    let occluders = Occluders::of_world(world);
    let receivers = receivers(world, clusters, ON_SURFACES, IN_THE_OPEN, 0x5eed);
    let ambient = luminance(world.ambient);
    let allowed = |length: usize| {
        let share = u128::from(budget) * length as u128 / entries.max(1) as u128;
        u64::try_from(share).unwrap_or(budget)
    };
    let rows = parallel::map(&receivers, |cluster, receivers| {
        if receivers.is_empty() {
            return None;
        }
        let row = i32::try_from(cluster).map_or(&[][..], |c| old.row(c));
        let allowed = allowed(row.len()) / 2;
        let mut random = Random::new(0x11f7 + cluster as u64);
        let row = first_round(world, row, receivers, &occluders, allowed, &mut random);
        Some(row)
    });
    let boxes = boxes(&receivers);
    let rows = mark_neighbours(rows, &boxes);
    let rows = parallel::map(&rows, |cluster, row| {
        let (mut row, receivers) = (row.clone()?, receivers.get(cluster)?);
        let length = i32::try_from(cluster).map_or(0, |c| old.row(c).len());
        let left = allowed(length).saturating_sub(row.rays);
        let mut random = Random::new(0xa6a1 + cluster as u64);
        row.rays += second_round(
            world,
            &mut row.pairs,
            receivers,
            &occluders,
            left,
            &mut random,
        );
        Some(row)
    });
    let rows = mark_neighbours(rows, &boxes);
    let found: Vec<&Row> = rows.iter().flatten().collect();
    let mut report = SweepReport {
        entries: [entries; 2],
        unseen: rows.iter().filter(|r| r.is_none()).count(),
        unswept: found
            .iter()
            .flat_map(|r| &r.pairs)
            .filter(|p| p.rays == 0)
            .count(),
        rays: found.iter().map(|r| r.rays).sum(),
        ..SweepReport::default()
    };
    let rows: Vec<Option<Vec<Pair>>> = rows
        .into_iter()
        .map(|row| Some(retained(row?.pairs, ambient)))
        .collect();
    let mut lists = LightLists {
        offsets: vec![0],
        lights: Vec::new(),
        shares: Vec::new(),
        ..old.clone()
    };
    for (row, cluster) in rows.iter().zip(0i32..) {
        match row {
            Some(pairs) => {
                lists.lights.extend(pairs.iter().map(|p| p.entry));
                lists.shares.extend(pairs.iter().map(|p| {
                    sweep_cache::rounded(LightShare {
                        bare: p.bare,
                        visible: p.visible(),
                    })
                }));
            }
            None => {
                let row = old.row(cluster);
                lists.lights.extend(row);
                let unknown = std::iter::repeat_n(LightShare::UNKNOWN, row.len());
                lists.shares.extend(unknown);
            }
        }
        lists.offsets.push(lists.lights.len() as u32);
    }
    report.entries[1] = lists.lights.len();
    lists.end_with_all(old);
    (lists, report)
}
