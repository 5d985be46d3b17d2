//! Visibility rays of the sweep: two rounds of rays for each pair of light and cluster, and the decision which
//! lights are dropped. [`sweep`](mod@super::sweep) derives the bounds.

use super::receivers::{Receiver, Target, luminance};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use support::Aabb;
use support::parallel;
use support::random::Random;
use support::slice;

/// Part of a cluster's light that its list may lack. One code of an sRGB display is about 2.4 / (code + 14) of the
/// light: 0.9 % at the bright end and more below. This is at most a quarter of it.
pub const DROPPED_PART: f32 = 0.002;

/// Light (irradiance over π, luminance) that the list of a dark cluster may lack: a tenth of the first display
/// code.
pub const DROPPED_LEAST: f32 = 3.0e-5;

/// Rays after which a light with a hit is known well enough.
const ENOUGH_RAYS: u32 = 6;

/// Most rays for a pair of light and cluster in the first round, and in the second.
const MAX_RAYS: u32 = 32;
const MAX_RAYS_SECOND_ROUND: u32 = 4096;

/// 95 % confidence bound of the expected hits where none was observed: -ln 0.05.
const MISSED_HITS: f32 = 3.0;

/// Fewest rays for a pair on maps where the ray budget would leave less.
const MIN_RAYS: u32 = 8;

/// Factor on the light of a pair without hits whose light arrives in a neighbouring cluster: random points seldom
/// lie in the gap through which it enters.
const NEIGHBOUR_CHARGE: f32 = 256.0;

/// Clusters are neighbours when the boxes of their receivers intersect after widening by this margin, id units, or
/// this part of their size: receivers seldom lie at the very end of their cluster.
const NEIGHBOUR_MARGIN: f32 = 2.0;
const NEIGHBOUR_WIDENING: f32 = 0.04;

/// Result of the rays for a light in a cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    pub entry: u32,
    /// Mean unshadowed light, irradiance over π, luminance.
    pub bare: f32,
    /// Largest unshadowed light at a receiver.
    pub peak: f32,
    /// Mean light that arrives.
    arrived: f32,
    pub rays: u32,
    hits: u32,
    /// Whether it arrives in a neighbouring cluster.
    in_neighbour: bool,
}

/// Smallest assumed visible part: of a light that arrives in a neighbouring cluster, and of others. If such a light
/// does arrive, a smaller sampling probability would make it rare and bright: noise that no filter removes.
const LEAST_VISIBLE: [f32; 2] = [0.1, 0.03];

impl Pair {
    /// Bound on the missed light for dropping this light, divided by its rays.
    fn charge_per_ray(&self) -> f32 {
        self.charged() / self.rays.max(1) as f32
    }

    /// Light that dropping may lose: the peak, because the points that see a light may be those next to it.
    fn charged(&self) -> f32 {
        self.peak
            * if self.in_neighbour {
                NEIGHBOUR_CHARGE
            } else {
                1.0
            }
    }

    /// Adds the result of more rays.
    fn add(&mut self, more: &Pair) {
        let [own, others] = [self.rays, more.rays].map(|n| n as f32);
        let all = (own + others).max(1.0);
        self.bare = (self.bare * own + more.bare * others) / all;
        self.peak = self.peak.max(more.peak);
        self.arrived = (self.arrived * own + more.arrived * others) / all;
        self.rays += more.rays;
        self.hits += more.hits;
    }

    /// Estimated visible part of the light, above 0.
    pub fn visible(&self) -> f32 {
        let [in_neighbour, other] = LEAST_VISIBLE;
        if self.rays == 0 {
            // unknown
            return 1.0;
        }
        let least = if self.in_neighbour {
            in_neighbour
        } else {
            other
        };
        ((self.hits as f32 + 0.5) / (self.rays as f32 + 1.0)).max(least)
    }
}

/// Sends at most `most` rays to a light; returns the result and the number of rays.
fn trace_pair(
    entry: u32,
    target: &Target<'_>,
    receivers: &[Receiver],
    occluders: &Occluders,
    most: u32,
    random: &mut Random,
    last: &mut Option<u32>,
) -> (Pair, u32) {
    let (mut bare, mut arrived, mut rays, mut hits, mut tries) = (0.0, 0.0, 0u32, 0u32, 0u32);
    let mut peak = 0.0f32;
    let start = (random.uniform() * receivers.len() as f32) as usize;
    while rays < most && tries < 2 * most && (hits == 0 || rays < ENOUGH_RAYS) {
        let Some(receiver) = slice::get(receivers, (start + tries as usize) % receivers.len())
        else {
            break;
        };
        tries += 1;
        let (point, light) = target.sample(receiver, random);
        bare += light;
        peak = f32::max(peak, light);
        if light <= 0.0 {
            continue;
        }
        rays += 1;
        if !occluders.blocked_hinted(receiver.position, point, last) {
            hits += 1;
            arrived += light;
        }
    }
    let count = tries.max(1) as f32;
    let (bare, peak) = if rays > 0 {
        (bare / count, peak)
    } else {
        // The light is below the horizon of, or behind, all receivers; other points may see its edge.
        let at = receivers.first().map_or(Vec3::ZERO, |r| r.position);
        (target.bare(at) / count, target.bare(at))
    };
    let pair = Pair {
        entry,
        bare,
        peak,
        arrived: arrived / count,
        rays: if rays > 0 { rays } else { tries },
        hits,
        in_neighbour: false,
    };
    (pair, rays)
}

/// First round: rays from a cluster to the lights of its list, at most `allowed` in total.
pub(super) fn first_round(
    world: &RelitWorld,
    row: &[u32],
    receivers: &[Receiver],
    occluders: &Occluders,
    allowed: u64,
    random: &mut Random,
) -> Row {
    let sum: Vec3 = receivers.iter().map(|r| r.position).sum();
    let middle = sum / receivers.len().max(1) as f32;
    let targets = row.iter().filter_map(|&e| Some((e, Target::of(world, e)?)));
    let mut targets: Vec<_> = targets.map(|(e, t)| (t.bare(middle), e, t)).collect();
    if allowed < targets.len() as u64 * u64::from(MIN_RAYS) {
        targets.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    }
    let mut left = allowed;
    let mut last = None;
    let count = targets.len();
    let pairs = targets
        .iter()
        .enumerate()
        .map(|(i, (bare, entry, target))| {
            let share = u32::try_from(left / (count - i).max(1) as u64).unwrap_or(MAX_RAYS);
            let most = share.clamp(MIN_RAYS, MAX_RAYS);
            if u64::from(most) > left {
                let nothing = Pair {
                    entry: *entry,
                    bare: *bare,
                    peak: *bare,
                    arrived: 0.0,
                    rays: 0,
                    hits: 0,
                    in_neighbour: false,
                };
                return (nothing, 0);
            }
            let (pair, sent) = trace_pair(
                *entry, target, receivers, occluders, most, random, &mut last,
            );
            left -= u64::from(sent).min(left);
            (pair, sent)
        });
    let (pairs, sent): (Vec<Pair>, Vec<u32>) = pairs.unzip();
    let sent = sent.into_iter().map(u64::from).sum();
    Row { pairs, rays: sent }
}

/// Light that the list of a cluster may lack when `arrives` arrives.
fn droppable(arrives: f32) -> f32 {
    (arrives * DROPPED_PART).max(DROPPED_LEAST)
}

/// Second round: the additional rays that dropping a light with at most one hit requires, at most `allowed` in
/// total; returns their number. The bound on dropped light is charge / n (see [`threshold`]), so n is proportional
/// to the charge; the weakest lights come first, because they need the fewest rays.
pub(super) fn second_round(
    world: &RelitWorld,
    pairs: &mut [Pair],
    receivers: &[Receiver],
    occluders: &Occluders,
    allowed: u64,
    random: &mut Random,
) -> u64 {
    let arrives = luminance(world.ambient) + pairs.iter().map(|p| p.arrived).sum::<f32>();
    let mut unknown: Vec<&mut Pair> = pairs
        .iter_mut()
        .filter(|p| p.hits <= 1 && p.rays > 0)
        .collect();
    unknown.sort_by(|a, b| {
        a.charged()
            .total_cmp(&b.charged())
            .then(a.entry.cmp(&b.entry))
    });
    let unit = droppable(arrives) * 0.5 / MISSED_HITS;
    let (mut sent, mut last) = (0, None);
    for pair in unknown {
        let wanted = (pair.charged() / unit).ceil();
        // no budget for this and all stronger lights
        if wanted > MAX_RAYS_SECOND_ROUND as f32 || sent + u64::from(wanted as u32) > allowed {
            break;
        }
        let more = (wanted as u32).saturating_sub(pair.rays);
        let Some(target) = Target::of(world, pair.entry).filter(|_| more > 0) else {
            continue; // the first round sent enough
        };
        let seen = trace_pair(
            pair.entry, &target, receivers, occluders, more, random, &mut last,
        );
        sent += u64::from(seen.1);
        pair.add(&seen.0);
    }
    sent
}

/// Results for a cluster's list.
#[derive(Clone)]
pub(super) struct Row {
    pub pairs: Vec<Pair>,
    /// Number of rays.
    pub rays: u64,
}

/// Widened bounds of each cluster's receivers.
pub(super) fn boxes(receivers: &[Vec<Receiver>]) -> Vec<Aabb> {
    receivers
        .iter()
        .map(|points| {
            let bounds = Aabb::of(points.iter().map(|r| r.position));
            let margin = (bounds.size() * NEIGHBOUR_WIDENING).max(Vec3::splat(NEIGHBOUR_MARGIN));
            bounds.grown(margin)
        })
        .collect()
}

/// Marks the lights of each row that arrive in a neighbouring cluster.
pub(super) fn mark_neighbours(mut rows: Vec<Option<Row>>, boxes: &[Aabb]) -> Vec<Option<Row>> {
    let in_neighbours = parallel::map(boxes, |_, bounds| {
        let near = (rows.iter().zip(boxes)).filter(|(_, other)| bounds.touches(**other));
        let mut in_neighbours: Vec<u32> = near
            .flat_map(|(row, _)| row.iter().flat_map(|r| &r.pairs))
            .filter(|pair| pair.hits > 0)
            .map(|pair| pair.entry)
            .collect();
        in_neighbours.sort_unstable();
        in_neighbours.dedup();
        in_neighbours
    });
    for (row, in_neighbours) in rows.iter_mut().zip(in_neighbours) {
        for pair in row.iter_mut().flat_map(|r| &mut r.pairs) {
            pair.in_neighbour = in_neighbours.binary_search(&pair.entry).is_ok();
        }
    }
    rows
}

/// Largest charge / n at which a pair without hits is dropped: see [`sweep`](mod@super::sweep).
fn threshold(pairs: &[Pair], bound: f32) -> f32 {
    let known = pairs.iter().filter(|p| p.rays > 0);
    let mut ratios: Vec<(f32, bool)> = known.map(|p| (p.charge_per_ray(), p.hits == 1)).collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut once, mut most) = (0.0, 0.0);
    for (charge_per_ray, seen_once) in ratios {
        once += if seen_once { charge_per_ray } else { 0.0 };
        if once + MISSED_HITS * charge_per_ray > bound {
            break;
        }
        most = charge_per_ray;
    }
    most
}

/// The pairs that remain in a cluster's list, by ascending entry.
pub(super) fn retained(mut pairs: Vec<Pair>, ambient: f32) -> Vec<Pair> {
    let light: f32 = ambient + pairs.iter().map(|p| p.arrived).sum::<f32>();
    let most = threshold(&pairs, droppable(light));
    pairs.retain(|p| p.hits > 0 || p.rays == 0 || p.charge_per_ray() > most);
    pairs.sort_by_key(|p| p.entry);
    pairs
}
