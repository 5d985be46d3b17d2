//! Placement of the lights that the compiler stripped.
//!
//! In the first round every node of a grid over open space is a candidate, and the sparse solver selects among
//! them. A light between nodes is selected as several of them: nearby selected lights that see each other are
//! merged, and each light moves to a better position. In later rounds candidates lie in front of samples with a
//! large residual.

use super::candidate_grid::MeasuredSpace;
use super::columns::{Column, Lamp, Source, point_rows, point_rows_hinted, unshadowed};
use super::cutoff::pieces_of;
use super::residual_candidates::ResidualCandidates;
use super::sample_soa::SampleSoa;
use super::samples::{self, Sample, mean};
use super::solve::{Ambient, Effort, Residual, norm, residual, solve};
use super::texels;
use super::triangulation::Crossing;
use crate::light::Falloff;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::f32::consts::PI;
use support::parallel;
use support::slice::part_mut;

/// Smallest distance of a light from surfaces, id units: its sphere must not reach into them.
pub(super) const CLEARANCE: f32 = 8.0;

/// Range of candidates, id units. Lights that are kept have no range limit.
pub(super) const RANGE: f32 = 700.0;

/// Squared logarithmic error that a light must remove to be kept; 1 is one sample that is off by a factor of e.
pub(super) const WORTH: f32 = 0.6;

/// Largest number of samples by which a light is moved.
const MOVE_SAMPLES: usize = 240;

/// Part of a sample's light that a light must be able to give for the sample to affect its move.
const INFLUENCE: f32 = 0.05;

/// Reaches of linear lights that are tried, id units: smallest, largest, ratio of successive ones.
const REACHES: (f32, f32, f32) = (128.0, 2048.0, 1.4);

/// Ratio of the removed error to that of inverse-square falloff from which linear falloff is taken.
const LINEAR_WORTH: f32 = 1.15;

const AROUND: [Vec3; 6] = [
    Vec3::X,
    Vec3::NEG_X,
    Vec3::Y,
    Vec3::NEG_Y,
    Vec3::Z,
    Vec3::NEG_Z,
];

/// Radius in which surfaces bound a light's strength, id units: farther away samples are dense enough.
const NEAR: f32 = 64.0;

/// Largest ratio of a light's contribution to the stored light on the surface beside it: texels are wide, and the
/// position is inexact.
const EXCESS: f32 = 1.5;

/// An inverse-square point light at `origin`.
pub(super) fn lamp(origin: Vec3) -> Lamp {
    Lamp {
        origin,
        falloff: Falloff::InverseSquare,
    }
}

/// Inputs of placement.
pub(super) struct Scene<'a> {
    pub world: &'a RelitWorld,
    pub occluders: &'a Occluders,
    pub soa: SampleSoa<'a>,
    /// The part of space near samples.
    pub measured: &'a MeasuredSpace,
    /// Surface index of each triangle.
    pub of_triangle: &'a [u32],
    /// Largest number of candidates in a round.
    pub candidates: usize,
    /// Whether linear falloff is allowed.
    pub linear: bool,
    /// Light cutoff, irradiance over π.
    pub cutoff: f32,
}

impl Scene<'_> {
    fn rows(&self, lamp: Lamp, range: f32) -> Vec<(u32, f32)> {
        let bsp = &self.world.bsp;
        point_rows(bsp, self.occluders, &self.soa, lamp, None, range)
    }

    /// Fitted samples that a light of this intensity may affect when it moves by up to `margin`; evenly thinned to
    /// [`MOVE_SAMPLES`].
    fn influenced(&self, origin: Vec3, intensity: f32, margin: f32) -> Vec<u32> {
        let all = (self.soa).within_reach(origin, intensity, margin, INFLUENCE * PI);
        let all: Vec<u32> = all.collect();
        let count = all.len().min(MOVE_SAMPLES);
        (0..count)
            .filter_map(|k| all.get(k * all.len() / count.max(1)).copied())
            .collect()
    }

    /// Upper bound of a light's strength from the lightmaps of the surfaces beside it, where it is brightest and
    /// samples are too sparse.
    pub(super) fn limit(&self, lamp: Lamp) -> Vec3 {
        limit_by(&self.near(lamp.origin), lamp)
    }

    /// The surfaces beside a position, found by 14 rays.
    fn near(&self, origin: Vec3) -> Vec<NearSurface> {
        let floor = samples::floor(self.world);
        let corners = (0..8u8).map(|k| {
            let side = |bit: u8| if k & bit == 0 { -1.0 } else { 1.0 };
            Vec3::new(side(1), side(2), side(4)).normalize()
        });
        let trace = |ray: Vec3| {
            let hit = self.occluders.nearest(origin, ray, NEAR)?;
            let triangle = hit.tag as usize;
            let surface = self.of_triangle.get(triangle).map(|s| *s as usize);
            let at = origin + ray * hit.t;
            let stored = surface.and_then(|s| texels::stored_at(self.world, s, triangle, at));
            let cosine = -hit.normal.dot(ray);
            (hit.front && cosine > 0.1).then_some(NearSurface {
                stored: stored? + floor,
                distance: hit.t,
                cosine,
            })
        };
        AROUND
            .into_iter()
            .chain(corners)
            .filter_map(trace)
            .collect()
    }

    fn column(&self, lamp: Lamp, rows: Vec<(u32, f32)>, strength: Vec3) -> Column {
        self.limited(lamp, rows, strength, self.limit(lamp))
    }

    /// The column of a placed light with this upper bound.
    pub(super) fn limited(
        &self,
        lamp: Lamp,
        rows: Vec<(u32, f32)>,
        strength: Vec3,
        limit: Vec3,
    ) -> Column {
        Column {
            source: Source::Placed(lamp),
            pieces: if self.cutoff > 0.0 {
                pieces_of(&rows)
            } else {
                Vec::new()
            },
            rows,
            strength,
            limit,
            prior: None,
        }
    }

    /// Whether a light fits at a position: inside the map and clear of surfaces.
    pub(super) fn open(&self, origin: Vec3) -> bool {
        self.world.bsp.cluster_at(origin) >= 0
            && !self.world.bsp.is_in_drawn_brush(origin, 0.0)
            && AROUND
                .into_iter()
                .all(|d| self.occluders.nearest(origin, d, CLEARANCE).is_none())
    }

    pub(super) fn sees(&self, a: Vec3, b: Vec3) -> bool {
        !self.occluders.blocked(a, b, false)
    }
}

/// A surface beside a position.
struct NearSurface {
    /// Stored irradiance over π plus the measurement floor.
    stored: Vec3,
    distance: f32,
    cosine: f32,
}

/// Upper bound of a light's strength by the surfaces beside it.
fn limit_by(near: &[NearSurface], lamp: Lamp) -> Vec3 {
    let most = |near: &NearSurface| {
        let given = lamp.falloff.irradiance(near.distance, near.cosine);
        (given > 0.0).then(|| near.stored * (EXCESS * PI / given))
    };
    near.iter().filter_map(most).fold(Vec3::INFINITY, Vec3::min)
}

/// Candidates over open space.
pub(super) struct Candidates {
    /// Position and rows for strength 1; candidates without rows are left out.
    places: Vec<(Vec3, Vec<(u32, f32)>)>,
    /// Grid spacing, id units.
    pub spacing: f32,
}

/// Candidates at the nodes of a grid over open space and where directions of the light grid meet.
pub(super) fn over_open_space(scene: &Scene<'_>, crossings: &[Crossing]) -> Candidates {
    let open = |at| scene.open(at);
    let (mut nodes, spacing) = scene.measured.grid(scene.world, scene.candidates, open);
    nodes.extend(
        crossings
            .iter()
            .map(|c| c.origin)
            .filter(|&at| scene.open(at)),
    );
    let rows = parallel::map(&nodes, |_, &at| scene.rows(lamp(at), RANGE));
    let places = nodes.into_iter().zip(rows);
    Candidates {
        places: places.filter(|(_, rows)| !rows.is_empty()).collect(),
        spacing,
    }
}

/// Adds lights from grid candidates to `columns`; the first `fixed` columns stay.
pub(super) fn place_from_grid(
    scene: &Scene<'_>,
    candidates: &Candidates,
    columns: &mut Vec<Column>,
    fixed: usize,
    ambient: &mut Ambient,
) {
    let of = parallel::map(&candidates.places, |_, (at, rows)| {
        scene.column(lamp(*at), rows.clone(), Vec3::ZERO)
    });
    select_and_refine(scene, columns, fixed, ambient, (of, candidates.spacing));
}

/// Adds lights in front of samples with a large residual.
pub(super) fn place_at_residuals(
    scene: &Scene<'_>,
    residual_candidates: &mut ResidualCandidates,
    columns: &mut Vec<Column>,
    fixed: usize,
    ambient: &mut Ambient,
    spacing: f32,
) {
    let state = residual(scene.soa.samples, columns, ambient.value);
    let candidates = residual_candidates.candidates(scene, &state);
    select_and_refine(scene, columns, fixed, ambient, (candidates, spacing * 0.5));
}

/// Selects the best of candidates and placed lights, merges and moves them, and fits their strengths.
fn select_and_refine(
    scene: &Scene<'_>,
    columns: &mut Vec<Column>,
    known: usize,
    ambient: &mut Ambient,
    (mut candidates, spacing): (Vec<Column>, f32),
) {
    let placed = columns.len();
    columns.append(&mut candidates);
    let sparse = Effort {
        rounds: 4,
        sweeps: 16,
        sparsity: 0.5,
        anew: false,
    };
    let state = solve(scene.soa.samples, columns, ambient, sparse, scene.cutoff);
    let mut chosen = columns.split_off(placed);
    drop_useless(columns, known, &state, WORTH * 0.25);
    drop_useless(&mut chosen, 0, &state, WORTH * 0.25);
    let whole = columns.len();
    columns.append(&mut chosen);
    merge(scene, columns, known, spacing * 1.5, whole);
    let refit = Effort {
        rounds: 2,
        sweeps: 16,
        sparsity: 0.2,
        anew: false,
    };
    let mut state = solve(scene.soa.samples, columns, ambient, refit, scene.cutoff);
    for step in [0.5, 0.25, 0.125] {
        move_lights(scene, columns, known, &state, spacing * step);
        state = solve(scene.soa.samples, columns, ambient, refit, scene.cutoff);
        drop_useless(columns, known, &state, WORTH * 0.5);
    }
    let whole = columns.len();
    merge(scene, columns, known, spacing * 0.5, whole);
    let settle = Effort {
        rounds: 4,
        sweeps: 16,
        sparsity: 0.1,
        anew: false,
    };
    let state = solve(scene.soa.samples, columns, ambient, settle, scene.cutoff);
    drop_useless(columns, known, &state, WORTH);
    solve(scene.soa.samples, columns, ambient, settle, scene.cutoff);
}

/// Removes placed lights that remove less than `worth` of the error.
pub(super) fn drop_useless(columns: &mut Vec<Column>, known: usize, state: &Residual, worth: f32) {
    let mut index = 0;
    columns.retain(|column| {
        index += 1;
        let strength = mean(column.strength);
        index <= known
            || (strength > 0.0 && norm(column, &state.weights) * strength * strength >= worth)
    });
}

/// Merges lights within `radius` that see each other, strongest first. The rows of the first `whole` columns have
/// no range limit; such a light keeps its rows if it does not move.
fn merge(scene: &Scene<'_>, columns: &mut Vec<Column>, known: usize, radius: f32, whole: usize) {
    let mut placed: Vec<(Lamp, Column, bool)> = (known..)
        .zip(columns.drain(known..))
        .filter_map(|(i, c)| match c.source {
            Source::Placed(lamp) => Some((lamp, c, i < whole)),
            _ => None,
        })
        .collect();
    placed.sort_by(|a, b| mean(b.1.strength).total_cmp(&mean(a.1.strength)));
    let mut taken = vec![false; placed.len()];
    let mut merged = Vec::new();
    for (i, (lamp, column, _)) in placed.iter().enumerate() {
        let origin = lamp.origin;
        if taken.get(i).copied().unwrap_or(true) {
            continue;
        }
        let mut centre = Vec3::ZERO;
        let mut total = 0.0;
        let mut sum = Vec3::ZERO;
        for ((other, own, _), taken) in placed.iter().zip(&mut taken).skip(i) {
            if !*taken
                && other.origin.distance(origin) <= radius
                && (other.origin == origin || scene.sees(origin, other.origin))
            {
                *taken = true;
                let power = mean(own.strength);
                centre += other.origin * power;
                total += power;
                sum += own.strength;
            }
        }
        let strength = if sum == Vec3::ZERO {
            column.strength
        } else {
            sum
        };
        let centre = if total > 0.0 { centre / total } else { origin };
        let moved =
            centre.distance(origin) > 1e-3 && scene.open(centre) && scene.sees(origin, centre);
        // The merged light has the falloff of the strongest.
        let origin = if moved { centre } else { origin };
        merged.push((Lamp { origin, ..*lamp }, strength, (!moved).then_some(i)));
    }
    let traced = |(lamp, strength, of): &(Lamp, Vec3, Option<usize>)| {
        let same = of.and_then(|i| placed.get(i));
        match same {
            Some((_, column, true)) => Column {
                strength: *strength,
                ..column.clone()
            },
            _ => scene.column(*lamp, scene.rows(*lamp, f32::INFINITY), *strength),
        }
    };
    columns.extend(parallel::map(&merged, |_, light| traced(light)));
}

/// The reaches of linear lights that are tried.
fn reaches() -> impl Iterator<Item = f32> {
    let next = |reach: &f32| Some(reach * REACHES.2).filter(|r| *r <= REACHES.1);
    std::iter::successors(Some(REACHES.0), next)
}

/// Moves every placed light by up to two steps to where it removes more error, with all others fixed.
fn move_lights(
    scene: &Scene<'_>,
    columns: &mut [Column],
    known: usize,
    state: &Residual,
    step: f32,
) {
    let placed = part_mut(columns, known..);
    let moved = parallel::map(placed, |_, column| best_move(scene, column, state, step));
    for (column, moved) in placed.iter_mut().zip(moved) {
        if let Some(moved) = moved {
            *column = moved;
        }
    }
}

fn best_move(scene: &Scene<'_>, column: &Column, state: &Residual, step: f32) -> Option<Column> {
    let Source::Placed(start) = column.source else {
        return None;
    };
    let around = scene.influenced(start.origin, mean(column.strength), step * 2.0);
    let affected: Vec<Sample> = around
        .iter()
        .filter_map(|&i| scene.soa.samples.get(i as usize).copied())
        .collect();
    let near = SampleSoa::new(&affected);
    // Target of this light: the residual plus its own contribution.
    let mut rows = column.rows.iter().peekable();
    let wanted: Vec<(Vec3, f32)> = around
        .iter()
        .map(|&i| {
            while rows.peek().is_some_and(|(row, _)| *row < i) {
                rows.next();
            }
            let own = match rows.peek() {
                Some(&&(row, a)) if row == i => column.strength * a,
                _ => Vec3::ZERO,
            };
            let at = i as usize;
            let rest = state.rest.get(at).copied().unwrap_or(Vec3::ZERO);
            (rest + own, state.weights.get(at).copied().unwrap_or(0.0))
        })
        .collect();
    // Removed error and strength of the best light at a position.
    let worth = |near: &[NearSurface], lamp: Lamp, rows: &[(u32, f32)]| {
        let mut gradient = Vec3::ZERO;
        let mut norm = 0.0;
        for &(i, a) in rows {
            if let Some((wanted, weight)) = wanted.get(i as usize) {
                gradient += *wanted * (*weight * a);
                norm += *weight * a * a;
            }
        }
        if norm > 0.0 {
            let limit = limit_by(near, lamp);
            let strength = (gradient / norm).max(Vec3::ZERO).min(limit);
            if scene.cutoff > 0.0 && strength.max_element() > 0.0 {
                // Recomputed without the samples beyond the cutoff.
                let least = scene.cutoff / strength.max_element();
                let (mut gradient, mut norm) = (Vec3::ZERO, 0.0);
                for &(i, a) in rows.iter().filter(|(_, a)| *a > least) {
                    if let Some((wanted, weight)) = wanted.get(i as usize) {
                        gradient += *wanted * (*weight * a);
                        norm += *weight * a * a;
                    }
                }
                if norm <= 0.0 {
                    return (0.0, Vec3::ZERO);
                }
                let strength = (gradient / norm).max(Vec3::ZERO).min(limit);
                return ((gradient * 2.0 - strength * norm).dot(strength), strength);
            }
            let taken = (gradient * 2.0 - strength * norm).dot(strength);
            (taken, strength)
        } else {
            (0.0, Vec3::ZERO)
        }
    };
    // An occluder of one position probably occludes its neighbour.
    let mut stopped = vec![None; affected.len()];
    let mut seen = |lamp: Lamp| {
        let (bsp, all) = (&scene.world.bsp, (None, f32::INFINITY));
        point_rows_hinted(bsp, scene.occluders, &near, lamp, all, &mut stopped)
    };
    let mut near = scene.near(start.origin);
    let mut best = (start, worth(&near, start, &seen(start)));
    for _ in 0..2 {
        let from = best.0;
        for direction in AROUND {
            let at = from.origin + direction * step;
            // Skips the way back.
            if at.distance(start.origin) < step * 0.5 {
                continue;
            }
            if !scene.open(at) || !scene.sees(from.origin, at) {
                continue;
            }
            let moved = Lamp { origin: at, ..from };
            let near_there = scene.near(at);
            let found = worth(&near_there, moved, &seen(moved));
            if found.0 > best.1.0 * 1.001 {
                (best, near) = ((moved, found), near_there);
            }
        }
        if best.0 == from {
            break;
        }
    }
    if scene.linear {
        // Visibility does not depend on the falloff.
        let square = lamp(best.0.origin);
        let seen = seen(square);
        let linear = reaches().map(|reach| (Falloff::Linear { reach }, LINEAR_WORTH));
        for (falloff, more) in std::iter::once((Falloff::InverseSquare, 1.0)).chain(linear) {
            let kind = Lamp { falloff, ..square };
            let given =
                |&(i, _): &(u32, f32)| Some((i, unshadowed(affected.get(i as usize)?, kind, None)));
            let rows: Vec<(u32, f32)> = seen.iter().filter_map(given).collect();
            let found = worth(&near, kind, &rows);
            if found.0 > best.1.0 * more {
                best = (kind, found);
            }
        }
    }
    let (lamp, (_, strength)) = best;
    (lamp != start).then(|| {
        let rows = scene.rows(lamp, f32::INFINITY);
        scene.limited(lamp, rows, strength, limit_by(&near, lamp))
    })
}
