//! Shadow rays at load: how much of each light arrives in each cluster of its lists.
//!
//! Points of a cluster (of its surfaces, and some in the open for what moves) look at random points of each light of
//! the cluster's list. What comes out is two numbers for each pair: the light that the cluster would get without
//! shadows, and the part of it that arrives. They make good chances for picking lights, and tell which lights can be
//! left out.
//!
//! # What is left out
//!
//! A light is left out of a cluster's list only if none of its rays arrived, and only as long as all that is left out of
//! the list together stays below [`DROPPED_PART`](super::DROPPED_PART) of the light that does arrive there. A light that
//! arrives in a cluster beside is charged with more than others (`BESIDE_CHARGE`): where light comes in through a gap,
//! few points see it.
//!
//! What is missed by leaving out all that n rays each did not find is told by what they found once (Good, The
//! Population Frequencies of Species and the Estimation of Population Parameters, 1953): a light of which the part v
//! arrives is not found with the chance (1 - v)^n, and found once with n v (1 - v)^(n - 1), so that with b for a light
//! without shadows the sum of b / n over the lights found once has the mean of what is missed. Where none was found
//! once, the number of rays that should have arrived is below 3 with a confidence of 95 %, and less than 3 times the
//! largest b / n is missed. Both are added, and for b the most is taken that a point of the cluster could get. Strong
//! lights that no ray found stay in the list with a small chance, and the estimators stay as unbiased as they are
//! without sweeping, but for that part.
//!
//! # How long it may take
//!
//! A map gets [`BUDGET`] rays at the most, each cluster as many of them as its list has of all lists' entries, so that
//! the result depends on no clock. A first round, which may take half, finds what is easily seen; a second one looks
//! longer for lights that were not, weak ones first. Rays that visible lights leave go to those that come after them.
//! Where not even `FEWEST` rays are left for each pair, the lights that would give most without shadows come first;
//! pairs that get no ray stay in the list as the potentially visible sets have them, with a chance by their unshadowed
//! light.
//!
//! What was found can be kept: see [`sweep`].

use super::looks::{Pair, Row, boxes, keep, look_again, look_at_all, mark_beside};
use super::receivers::{luminance, receivers};
use super::{LightLists, LightShare, kept};
use crate::cache::CalibrationCache;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use std::time::Instant;
use support::parallel;
use support::random::Random;

/// Points of a cluster on surfaces, and in the open.
const ON_SURFACES: usize = 96;
const IN_THE_OPEN: usize = 32;

/// Most rays for a map: see the [module](self). Less than two seconds of two processor cores on large maps.
const BUDGET: u64 = 6_000_000;

/// What sweeping did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SweepReport {
    /// Entries of the clusters' lists before and after.
    pub entries: [usize; 2],
    /// Clusters without a point to look from; their lists stay.
    pub unseen: usize,
    /// Entries before that no ray was left for; they stay.
    pub unswept: usize,
    /// Rays.
    pub rays: u64,
    /// Whether it comes from a cache; rays and what they did not reach are not counted then.
    pub cached: bool,
    /// Seconds.
    pub seconds: f64,
}

/// Sends rays through a world's light lists: shortens the lists, and notes in them what each light gives where. What
/// it does depends on the world alone: its geometry, and its lights as they are now. A world whose lists know already
/// is left as it is. With a `cache` a result is taken from there, or kept there; what goes wrong with it is a warning
/// of the world's.
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
    let (lists, mut report) = kept::kept(world, cache, |world| fresh(world, entries, BUDGET));
    world.report.mean_list_length = lists.mean_length();
    world.report.longest_list = lists.longest();
    world.light_lists = lists;
    report.seconds = begin.elapsed().as_secs_f64();
    report
}

/// A world's lists of so many entries, swept with so many rays at the most.
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
        let row = look_at_all(world, row, receivers, &occluders, allowed, &mut random);
        Some(row)
    });
    let boxes = boxes(&receivers);
    let rows = mark_beside(rows, &boxes);
    let rows = parallel::map(&rows, |cluster, row| {
        let (mut row, receivers) = (row.clone()?, receivers.get(cluster)?);
        let length = i32::try_from(cluster).map_or(0, |c| old.row(c).len());
        let left = allowed(length).saturating_sub(row.rays);
        let mut random = Random::new(0xa6a1 + cluster as u64);
        row.rays += look_again(
            world,
            &mut row.pairs,
            receivers,
            &occluders,
            left,
            &mut random,
        );
        Some(row)
    });
    let rows = mark_beside(rows, &boxes);
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
        .map(|row| Some(keep(row?.pairs, ambient)))
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
                    kept::rounded(LightShare {
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
