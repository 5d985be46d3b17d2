//! Shadow rays at load: how much of each light arrives in each cluster of its lists.
//!
//! Points of a cluster (of its surfaces, and some in the open for what moves) look at random points of each light of
//! the cluster's list. What comes out is two numbers for each pair: the light that the cluster would get without
//! shadows, and the part of it that arrives. They make good chances for picking lights, and tell which lights can be
//! left out.
//!
//! # What is left out
//!
//! A light is left out of a cluster's list only if none of its rays arrived, neither there nor in a cluster beside it
//! (where light comes in through a gap, the next cluster sees more of it), and only as long as all that is left out
//! of the list together stays below [`DROPPED_PART`] of the light that does arrive there. Of a light that none of n
//! rays found, less than 3 / n arrives, with a confidence of 95 % (the "rule of three": (1 - 3 / n)^n is about 5 %),
//! so 3 / n of its unshadowed light is what it is charged with. Strong lights that no ray found stay in the list with a
//! small chance, and the estimators stay as unbiased as they are without sweeping, but for that part.
//!
//! # How long it may take
//!
//! A map gets [`BUDGET`] rays at the most, each cluster as many of them as its list has of all lists' entries, so that
//! the result depends on no clock. Rays that visible lights leave go to those that come after them in the list. Where
//! not even [`FEWEST`] rays are left for each pair, the lights that would give most without shadows come first; pairs
//! that get no ray stay in the list as the potentially visible sets have them, with a chance by their unshadowed light.
//!
//! What was found can be kept: see [`sweep`].

use super::{LightLists, LightRef, LightShare, PointLight, TriangleLight, kept};
use crate::calibrate::CalibrationCache;
use crate::calibrate::bvh::Occluders;
use crate::calibrate::random::Random;
use crate::calibrate::{parallel, samples};
use crate::world::RelitWorld;
use glam::Vec3;
use std::f32::consts::PI;
use std::time::Instant;

/// Part of a cluster's light that may be left out of its list. The step of a display in sRGB from one code to the next
/// is about 2.4 / (code + 14) of the light: 0.9 % at the bright end and more below. This is a quarter of it at the most.
pub const DROPPED_PART: f32 = 0.002;

/// Light (irradiance / π, luminance) that may be left out of a dark cluster's list: a tenth of the first display code.
pub const DROPPED_LEAST: f32 = 3.0e-5;

/// Points of a cluster on surfaces, and in the open.
const ON_SURFACES: usize = 24;
const IN_THE_OPEN: usize = 8;

/// Rays after which a light that was seen is known well enough.
const ENOUGH: u32 = 6;

/// Most rays for a pair of light and cluster.
const MOST: u32 = 64;

/// Fewest, on maps of so many pairs that [`BUDGET`] would leave less.
const FEWEST: u32 = 8;

/// Most rays for a map: see the [module](self). Less than two seconds of two processor cores on large maps; four times
/// as many would make their lists 4 % shorter.
const BUDGET: u64 = 6_000_000;

/// Clusters are beside each other when the boxes around their points meet, after these have been made wider by so many
/// id units or by such a part of their size: points seldom lie at the very end of their cluster.
const BESIDE: f32 = 2.0;
const WIDER: f32 = 0.04;

/// How far off its surface a point lies, id units.
const LIFT: f32 = 0.5;

/// A place where light is gathered.
#[derive(Debug, Clone, Copy)]
pub(super) struct Receiver {
    pub position: Vec3,
    /// Unit normal; zero in the open.
    pub normal: Vec3,
}

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

/// Points of each cluster: random ones on what is drawn there, and in the open.
pub(super) fn receivers(
    world: &RelitWorld,
    clusters: usize,
    on_surfaces: usize,
    in_the_open: usize,
    seed: u64,
) -> Vec<Vec<Receiver>> {
    let bsp = &world.bsp;
    let mut surfaces: Vec<Vec<u32>> = vec![Vec::new(); clusters];
    let mut boxes: Vec<Vec<(Vec3, Vec3)>> = vec![Vec::new(); clusters];
    for leaf in bsp.tree_leafs() {
        let Some(leaf) = bsp.leafs.get(leaf) else {
            continue;
        };
        let Ok(cluster) = usize::try_from(leaf.cluster) else {
            continue;
        };
        let (Some(surfaces), Some(boxes)) = (surfaces.get_mut(cluster), boxes.get_mut(cluster))
        else {
            continue;
        };
        let corner = |c: [i32; 3]| Vec3::from_array(c.map(|v| v as f32));
        boxes.push((corner(leaf.mins), corner(leaf.maxs)));
        let listed = bsp.leaf_surface_indices(leaf).iter();
        surfaces.extend(listed.filter_map(|&s| u32::try_from(s).ok()));
    }
    let rooms: Vec<_> = surfaces.into_iter().zip(boxes).collect();
    parallel::map(&rooms, |cluster, (surfaces, boxes)| {
        let mut random = Random::new(seed ^ (cluster as u64) << 8);
        let inside = |p: Vec3| usize::try_from(bsp.cluster_at(p)).is_ok_and(|c| c == cluster);
        let mut points = on_drawn(world, surfaces, boxes, on_surfaces, &mut random, inside);
        // where nothing is drawn, more in the open
        let open = in_the_open.max((on_surfaces + in_the_open - points.len()) / 2);
        in_boxes(boxes, open, &mut random, inside, &mut points);
        points
    })
}

/// Points on the surfaces of a cluster, evenly over the area that lies in its leafs' boxes, as nearly as a few tries do.
fn on_drawn(
    world: &RelitWorld,
    surfaces: &[u32],
    boxes: &[(Vec3, Vec3)],
    count: usize,
    random: &mut Random,
    inside: impl Fn(Vec3) -> bool,
) -> Vec<Receiver> {
    let mut listed = surfaces.to_vec();
    listed.sort_unstable();
    listed.dedup();
    let mut triangles = Vec::new();
    let mut total = 0.0f32;
    for index in listed {
        let Some(surface) = world.surfaces.get(index as usize) else {
            continue;
        };
        let first = surface.first_index as usize / 3;
        for triangle in first..first + surface.num_indices as usize / 3 {
            let Some([a, b, c]) = world.triangle(triangle) else {
                continue;
            };
            let (mins, maxs) = (a.min(b).min(c), a.max(b).max(c));
            // only what may lie here
            let touches = |(low, high): &(Vec3, Vec3)| {
                mins.cmple(*high + 1.0).all() && maxs.cmpge(*low - 1.0).all()
            };
            let area = (b - a).cross(c - a).length() * 0.5;
            if area > 0.0 && area.is_finite() && boxes.iter().any(touches) {
                total += area;
                triangles.push((total, [a, b, c]));
            }
        }
    }
    let mut points = Vec::with_capacity(count);
    if triangles.is_empty() {
        return points;
    }
    for _ in 0..count * 8 {
        if points.len() == count {
            break;
        }
        let at = random.next() * total;
        let found = triangles
            .partition_point(|(end, _)| *end <= at)
            .min(triangles.len() - 1);
        let Some(&(_, [a, b, c])) = triangles.get(found) else {
            break;
        };
        let (u, v) = random.in_triangle();
        // fronts are clockwise
        let normal = (c - a).cross(b - a).normalize_or_zero();
        let on = a + (b - a) * u + (c - a) * v;
        // as the shaders look for it
        if inside(on + normal) {
            points.push(Receiver {
                position: on + normal * LIFT,
                normal,
            });
        }
    }
    points
}

/// Points in the open.
fn in_boxes(
    boxes: &[(Vec3, Vec3)],
    count: usize,
    random: &mut Random,
    inside: impl Fn(Vec3) -> bool,
    points: &mut Vec<Receiver>,
) {
    let wanted = points.len() + count;
    for attempt in 0..count * 8 {
        if points.len() >= wanted || boxes.is_empty() {
            break;
        }
        let Some(&(low, high)) = boxes.get(attempt % boxes.len()) else {
            break;
        };
        let at = Vec3::new(random.next(), random.next(), random.next());
        let position = low + (high - low) * at;
        if inside(position) {
            points.push(Receiver {
                position,
                normal: Vec3::ZERO,
            });
        }
    }
}

/// Luminance of linear Rec. 709 colours.
fn luminance(color: Vec3) -> f32 {
    super::emission::luminance(color).max(0.0)
}

/// A light as rays see it.
pub(super) enum Target<'a> {
    Triangle(&'a TriangleLight),
    Point(&'a PointLight),
}

impl<'a> Target<'a> {
    pub fn of(world: &'a RelitWorld, entry: u32) -> Option<Self> {
        match world.light_lists.light(entry) {
            LightRef::Triangle(i) => world.lights.get(i as usize).map(Target::Triangle),
            LightRef::Point(i) => world.point_lights.get(i as usize).map(Target::Point),
        }
    }

    /// A random point of it, and what it would give to a receiver if all of it were there, without shadows: irradiance
    /// / π, luminance.
    pub fn sample(&self, receiver: &Receiver, random: &mut Random) -> (Vec3, f32) {
        let cosine = |to: Vec3| {
            if receiver.normal == Vec3::ZERO {
                // a surface in the open may face any way
                0.25
            } else {
                receiver.normal.dot(to).max(0.0)
            }
        };
        match self {
            Target::Triangle(light) => {
                let [a, b, c] = light.vertices;
                let (u, v) = random.in_triangle();
                let point = a + (b - a) * u + (c - a) * v;
                let offset = point - receiver.position;
                let area = light.area();
                let squared = offset.length_squared().max(area * 0.05).max(1.0);
                let to = offset.normalize_or_zero();
                let facing = -light.normal().dot(to);
                let facing = if light.two_sided {
                    facing.abs()
                } else {
                    facing.max(0.0)
                };
                let power = luminance(light.radiance) * area;
                (point, power * facing * cosine(to) / (PI * squared))
            }
            Target::Point(light) => {
                let around = Vec3::new(random.next(), random.next(), random.next()) * 2.0 - 1.0;
                let point = light.origin + around.clamp_length_max(1.0) * light.radius;
                let offset = light.origin - receiver.position;
                let squared = offset
                    .length_squared()
                    .max(light.radius * light.radius)
                    .max(1.0);
                let to = offset.normalize_or_zero();
                let in_cone = light.spot.is_none_or(|spot| {
                    let along = -to.dot(spot.direction);
                    along > 0.0
                        && (1.0 - along * along).max(0.0).sqrt() <= along * spot.tan_half_angle
                });
                let power = if in_cone {
                    luminance(light.intensity)
                } else {
                    0.0
                };
                (point, power * cosine(to) / (PI * squared))
            }
        }
    }

    /// Light that comes to a place about there from a light that faces it.
    fn bare(&self, at: Vec3) -> f32 {
        let (middle, power) = match self {
            Target::Triangle(light) => {
                let [a, b, c] = light.vertices;
                let power = luminance(light.radiance) * light.area();
                ((a + b + c) / 3.0, power)
            }
            Target::Point(light) => (light.origin, luminance(light.intensity)),
        };
        power / (PI * middle.distance_squared(at).max(64.0))
    }
}

/// What is known of a light in a cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pair {
    entry: u32,
    /// Mean light without shadows, irradiance / π, luminance.
    bare: f32,
    /// Mean light that arrives.
    arrived: f32,
    rays: u32,
    hits: u32,
    /// Whether it arrives in a cluster beside.
    beside: bool,
}

/// Least that is believed to arrive of a light, for one that arrives in a cluster beside and for others. Where such a
/// light does come in after all, a smaller chance would make it rare and blinding: noise that no filter takes away.
const LEAST_VISIBLE: [f32; 2] = [0.1, 0.03];

impl Pair {
    /// About which part of the light arrives, above 0.
    fn visible(&self) -> f32 {
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
) -> (Pair, u32) {
    let (mut bare, mut arrived, mut rays, mut hits, mut tries) = (0.0, 0.0, 0u32, 0u32, 0u32);
    let start = (random.next() * receivers.len() as f32) as usize;
    while rays < most && tries < 2 * most && (hits == 0 || rays < ENOUGH) {
        let Some(receiver) = receivers.get((start + tries as usize) % receivers.len()) else {
            break;
        };
        tries += 1;
        let (point, light) = target.sample(receiver, random);
        bare += light;
        if light <= 0.0 {
            continue;
        }
        rays += 1;
        if !occluders.blocked(receiver.position, point, false) {
            hits += 1;
            arrived += light;
        }
    }
    let count = tries.max(1) as f32;
    let bare = if rays > 0 {
        bare / count
    } else {
        // all that looked had it below their horizon or were behind it: others may just see its edge
        let at = receivers.first().map_or(Vec3::ZERO, |r| r.position);
        target.bare(at) / count
    };
    let pair = Pair {
        entry,
        bare,
        arrived: arrived / count,
        rays: if rays > 0 { rays } else { tries },
        hits,
        beside: false,
    };
    (pair, rays)
}

/// Looks from a cluster at the lights of its list, with as many rays as are `allowed` for all.
fn look_at_all(
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
                    arrived: 0.0,
                    rays: 0,
                    hits: 0,
                    beside: false,
                };
                return (nothing, 0);
            }
            let (pair, sent) = look(*entry, target, receivers, occluders, most, random);
            left -= u64::from(sent).min(left);
            (pair, sent)
        });
    let (pairs, sent): (Vec<Pair>, Vec<u32>) = pairs.unzip();
    Row {
        pairs,
        rays: sent.into_iter().map(u64::from).sum(),
    }
}

/// What is known of a cluster's list.
struct Row {
    pairs: Vec<Pair>,
    /// Rays that it took.
    rays: u64,
}

/// Bounds of each cluster's receivers, a little larger than they are.
fn boxes(receivers: &[Vec<Receiver>]) -> Vec<(Vec3, Vec3)> {
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

/// The pairs of a cluster's list that stay, by rising entry. `beside`: lights that arrive in clusters beside it, rising.
fn keep(mut pairs: Vec<Pair>, beside: &[u32], ambient: f32) -> Vec<Pair> {
    for pair in &mut pairs {
        pair.beside = beside.binary_search(&pair.entry).is_ok();
    }
    let light: f32 = ambient + pairs.iter().map(|p| p.arrived).sum::<f32>();
    let mut left = (light * DROPPED_PART).max(DROPPED_LEAST);
    // those that no ray found, weakest first
    let charge = |p: &Pair| {
        if p.hits > 0 || p.beside || p.rays == 0 {
            f32::INFINITY
        } else {
            p.bare * 3.0 / p.rays.max(1) as f32
        }
    };
    pairs.sort_by(|a, b| charge(a).total_cmp(&charge(b)).then(a.entry.cmp(&b.entry)));
    let dropped = pairs.iter().take_while(|pair| {
        left -= charge(pair);
        left >= 0.0
    });
    let dropped = dropped.count();
    let mut kept = pairs.split_off(dropped);
    kept.sort_by_key(|p| p.entry);
    kept
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
    let occluders = samples::occluders(world);
    let receivers = receivers(world, clusters, ON_SURFACES, IN_THE_OPEN, 0x5eed);
    let ambient = luminance(world.ambient);
    let rows = parallel::map(&receivers, |cluster, receivers| {
        if receivers.is_empty() {
            return None;
        }
        let row = i32::try_from(cluster).map_or(&[][..], |c| old.row(c));
        let allowed = u128::from(budget) * row.len() as u128 / entries.max(1) as u128;
        let allowed = u64::try_from(allowed).unwrap_or(budget);
        let mut random = Random::new(0x11f7 + cluster as u64);
        let row = look_at_all(world, row, receivers, &occluders, allowed, &mut random);
        Some(row)
    });
    let found = || rows.iter().flatten();
    let mut report = SweepReport {
        entries: [entries; 2],
        unseen: rows.iter().filter(|r| r.is_none()).count(),
        unswept: found()
            .flat_map(|r| &r.pairs)
            .filter(|p| p.rays == 0)
            .count(),
        rays: found().map(|r| r.rays).sum(),
        ..SweepReport::default()
    };
    let boxes = boxes(&receivers);
    let rows = parallel::map(&rows, |cluster, row| {
        let row = row.as_ref()?;
        let &(low, high) = boxes.get(cluster)?;
        let near = rows
            .iter()
            .zip(&boxes)
            .filter(|(_, other)| low.cmple(other.1).all() && high.cmpge(other.0).all());
        let mut beside: Vec<u32> = near
            .flat_map(|(row, _)| row.iter().flat_map(|r| &r.pairs))
            .filter(|pair| pair.hits > 0)
            .map(|pair| pair.entry)
            .collect();
        beside.sort_unstable();
        beside.dedup();
        Some(keep(row.pairs.clone(), &beside, ambient))
    });
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
