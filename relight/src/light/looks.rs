//! What rays tell of pairs of a light and a cluster: two rounds of them, and what may be left out after these. Why so
//! is in [`sweep`](mod@super::sweep).

use super::receivers::{Receiver, Target, luminance};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use support::parallel;
use support::random::Random;

/// Part of a cluster's light that may be left out of its list. The step of a display in sRGB from one code to the next
/// is about 2.4 / (code + 14) of the light: 0.9 % at the bright end and more below. This is a quarter of it at the most.
pub const DROPPED_PART: f32 = 0.002;

/// Light (irradiance / π, luminance) that may be left out of a dark cluster's list: a tenth of the first display code.
pub const DROPPED_LEAST: f32 = 3.0e-5;

/// Rays after which a light that was seen is known well enough.
const ENOUGH: u32 = 6;

/// Most rays for a pair of light and cluster in the first round, and in the second.
const MOST: u32 = 32;
const MOST_AGAIN: u32 = 4096;

/// Rays that should have arrived where none did, at the most, with a confidence of 95 %: -ln 0.05.
const UNSEEN: f32 = 3.0;

/// Fewest, on maps of so many pairs that a bound on all rays would leave less.
const FEWEST: u32 = 8;

/// A light that no ray found, but that arrives in a cluster beside, is charged with so many times its light: points at
/// random seldom lie in the gap that it comes in through.
const BESIDE_CHARGE: f32 = 256.0;

/// Clusters are beside each other when the boxes around their points meet, after these have been made wider by so many
/// id units or by such a part of their size: points seldom lie at the very end of their cluster.
const BESIDE: f32 = 2.0;
const WIDER: f32 = 0.04;

/// What is known of a light in a cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    pub entry: u32,
    /// Mean light without shadows, irradiance / π, luminance.
    pub bare: f32,
    /// The most that it would give to a point of the cluster without shadows, of those that looked.
    pub peak: f32,
    /// Mean light that arrives.
    arrived: f32,
    pub rays: u32,
    hits: u32,
    /// Whether it arrives in a cluster beside.
    beside: bool,
}

/// Least that is believed to arrive of a light, for one that arrives in a cluster beside and for others. Where such a
/// light does come in after all, a smaller chance would make it rare and blinding: noise that no filter takes away.
const LEAST_VISIBLE: [f32; 2] = [0.1, 0.03];

impl Pair {
    /// What a light is charged with for being left out, for each ray that was sent.
    fn ratio(&self) -> f32 {
        self.charged() / self.rays.max(1) as f32
    }

    /// Light as it counts for being left out: the most that a point could get, for the places that see a light may be
    /// those that are next to it.
    fn charged(&self) -> f32 {
        self.peak * if self.beside { BESIDE_CHARGE } else { 1.0 }
    }

    /// Adds what more rays found.
    fn add(&mut self, more: &Pair) {
        let [own, others] = [self.rays, more.rays].map(|n| n as f32);
        let all = (own + others).max(1.0);
        self.bare = (self.bare * own + more.bare * others) / all;
        self.peak = self.peak.max(more.peak);
        self.arrived = (self.arrived * own + more.arrived * others) / all;
        self.rays += more.rays;
        self.hits += more.hits;
    }

    /// About which part of the light arrives, above 0.
    pub fn visible(&self) -> f32 {
        let [beside, alone] = LEAST_VISIBLE;
        if self.rays == 0 {
            // not known
            return 1.0;
        }
        let least = if self.beside { beside } else { alone };
        ((self.hits as f32 + 0.5) / (self.rays as f32 + 1.0)).max(least)
    }
}

/// Looks at a light with `most` rays at the most; also the number that were sent.
fn look(
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
    while rays < most && tries < 2 * most && (hits == 0 || rays < ENOUGH) {
        let Some(receiver) = receivers.get((start + tries as usize) % receivers.len()) else {
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
        // all that looked had it below their horizon or were behind it: others may just see its edge
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
        beside: false,
    };
    (pair, rays)
}

/// Looks from a cluster at the lights of its list, with as many rays as are `allowed` for all.
pub(super) fn look_at_all(
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
    if allowed < targets.len() as u64 * u64::from(FEWEST) {
        targets.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    }
    let mut left = allowed;
    let mut last = None;
    let count = targets.len();
    let pairs = targets
        .iter()
        .enumerate()
        .map(|(i, (bare, entry, target))| {
            let share = u32::try_from(left / (count - i).max(1) as u64).unwrap_or(MOST);
            let most = share.clamp(FEWEST, MOST);
            if u64::from(most) > left {
                let nothing = Pair {
                    entry: *entry,
                    bare: *bare,
                    peak: *bare,
                    arrived: 0.0,
                    rays: 0,
                    hits: 0,
                    beside: false,
                };
                return (nothing, 0);
            }
            let (pair, sent) = look(
                *entry, target, receivers, occluders, most, random, &mut last,
            );
            left -= u64::from(sent).min(left);
            (pair, sent)
        });
    let (pairs, sent): (Vec<Pair>, Vec<u32>) = pairs.unzip();
    let sent = sent.into_iter().map(u64::from).sum();
    Row { pairs, rays: sent }
}

/// Light of a cluster that may be left out of its list, when so much arrives there.
fn droppable(arrives: f32) -> f32 {
    (arrives * DROPPED_PART).max(DROPPED_LEAST)
}

/// Looks with as many more rays as it takes to leave lights out for those that no ray found, or a single one, as far as
/// `allowed` reaches; returns how many it took. What is left out is bounded through charge / n (see [`threshold`]): so n
/// goes with bare, and the lights that give least come first, for they cost least.
pub(super) fn look_again(
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
    let unit = droppable(arrives) * 0.5 / UNSEEN;
    let (mut sent, mut last) = (0, None);
    for pair in unknown {
        let wanted = (pair.charged() / unit).ceil();
        // the most that there are left for
        if wanted > MOST_AGAIN as f32 || sent + u64::from(wanted as u32) > allowed {
            break;
        }
        let more = (wanted as u32).saturating_sub(pair.rays);
        let Some(target) = Target::of(world, pair.entry).filter(|_| more > 0) else {
            continue;
        };
        let seen = look(
            pair.entry, &target, receivers, occluders, more, random, &mut last,
        );
        sent += u64::from(seen.1);
        pair.add(&seen.0);
    }
    sent
}

/// What is known of a cluster's list.
#[derive(Clone)]
pub(super) struct Row {
    pub pairs: Vec<Pair>,
    /// Rays that it took.
    pub rays: u64,
}

/// Bounds of each cluster's receivers, a little larger than they are.
pub(super) fn boxes(receivers: &[Vec<Receiver>]) -> Vec<(Vec3, Vec3)> {
    let of = |points: &Vec<Receiver>| {
        points
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), r| {
                (low.min(r.position), high.max(r.position))
            })
    };
    receivers
        .iter()
        .map(|points| {
            let (low, high) = of(points);
            let margin = ((high - low) * WIDER).max(Vec3::splat(BESIDE));
            (low - margin, high + margin)
        })
        .collect()
}

/// Marks in each row the lights that arrive in clusters beside its own: those whose boxes meet.
pub(super) fn mark_beside(mut rows: Vec<Option<Row>>, boxes: &[(Vec3, Vec3)]) -> Vec<Option<Row>> {
    let beside = parallel::map(boxes, |_, &(low, high)| {
        let near = rows
            .iter()
            .zip(boxes)
            .filter(|(_, other)| low.cmple(other.1).all() && high.cmpge(other.0).all());
        let mut beside: Vec<u32> = near
            .flat_map(|(row, _)| row.iter().flat_map(|r| &r.pairs))
            .filter(|pair| pair.hits > 0)
            .map(|pair| pair.entry)
            .collect();
        beside.sort_unstable();
        beside.dedup();
        beside
    });
    for (row, beside) in rows.iter_mut().zip(beside) {
        for pair in row.iter_mut().flat_map(|r| &mut r.pairs) {
            pair.beside = beside.binary_search(&pair.entry).is_ok();
        }
    }
    rows
}

/// The largest charge / n of pairs that may be left out when no ray found them: see the [module](self).
fn threshold(pairs: &[Pair], bound: f32) -> f32 {
    let known = pairs.iter().filter(|p| p.rays > 0);
    let mut ratios: Vec<(f32, bool)> = known.map(|p| (p.ratio(), p.hits == 1)).collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut once, mut most) = (0.0, 0.0);
    for (ratio, seen_once) in ratios {
        once += if seen_once { ratio } else { 0.0 };
        if once + UNSEEN * ratio > bound {
            break;
        }
        most = ratio;
    }
    most
}

/// The pairs of a cluster's list that stay, by rising entry.
pub(super) fn keep(mut pairs: Vec<Pair>, ambient: f32) -> Vec<Pair> {
    let light: f32 = ambient + pairs.iter().map(|p| p.arrived).sum::<f32>();
    let most = threshold(&pairs, droppable(light));
    pairs.retain(|p| p.hits > 0 || p.rays == 0 || p.ratio() > most);
    pairs.sort_by_key(|p| p.entry);
    pairs
}
