//! The state of a fit and its steps. Strengths, ambient term and reflected light depend on each other and are
//! updated in turns.

use super::bounce::Transfer;
use super::candidate_grid::MeasuredSpace;
use super::columns::Column;
use super::light_grid;
use super::placement::{self, Candidates, Scene};
use super::residual_candidates::ResidualCandidates;
use super::sample_soa::SampleSoa;
use super::samples::{Sample, SamplingOptions, Site, light_of, mean};
use super::solve::{self, Ambient, Effort};
use super::splash::Splashes;
use super::texels::TexelId;
use super::triangulation::Crossing;
use super::{FitMode, hypotheses, spawn_views, suns};
use crate::emitters::Agreement;
use crate::exposure::{self, Exposure, LitSample};
use crate::occluders::Occluders;
use crate::world::{RelitWorld, WorldMaterial};
use glam::Vec3;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Largest number of rounds of placement.
pub(super) const ROUNDS: usize = 4;

/// Another round follows while a round lowers the held-out error below this part.
const ROUND_GAIN: f32 = 0.985;

/// Part of the held-out error that linear falloff may leave to be kept.
const LINEAR_KEPT: f32 = 0.97;

/// Largest number of passes over near-light texels after the last round.
const NEAR_LIGHT_PASSES: u32 = 2;

/// Largest growth of the held-out error in these passes, a factor: near-light texels are a small part of the map.
const NEAR_LIGHT_TOLERANCE: f32 = 1.02;

/// Held-out error of inverse-square lights from which linear falloff is tried, stops; it is also tried where the
/// fit leaves more than half of the directives' error. Below that a few linear lights of long reach can fit many
/// inverse-square lamps slightly better.
const LINEAR_TRIED_ABOVE: f32 = 0.25;

/// Part of the held-out error that a larger ambient limit may leave to be kept. The darkest texels are then dark
/// for another reason.
const MORE_AMBIENT: f32 = 0.93;

/// Part of the held-out error that back splashes may leave to be kept.
const SPLASHES_KEPT: f32 = 0.95;

/// A fit is abandoned if its error exceeds this factor times the required one: after the first round, and after
/// each later round.
const HOPELESS: (f32, f32) = (1.3, 1.1);

/// Effort for strengths from a rough guess.
const FIRST: Effort = Effort {
    rounds: 8,
    sweeps: 12,
    sparsity: 0.0,
    anew: true,
};

/// Effort for strengths from nearly correct ones.
const NEXT: Effort = Effort {
    rounds: 3,
    sweeps: 8,
    sparsity: 0.0,
    anew: false,
};

/// A state to return to.
#[derive(Clone)]
pub(super) struct SavedState {
    columns: Vec<Column>,
    ambient: Ambient,
    samples: Vec<Sample>,
    transfer: Transfer,
    near_light_texels: HashSet<TexelId>,
}

/// Errors at which placement is abandoned.
struct ErrorLimits {
    /// Required error, stops.
    target: f32,
    /// Error of the best fit so far after each round, with a tolerance, stops.
    per_round: Vec<f32>,
    /// Largest number of rounds.
    rounds: usize,
}

impl ErrorLimits {
    /// Error after a round above which the fit is abandoned, stops.
    fn abandon_above(&self, round: usize) -> f32 {
        match (self.per_round.get(round), round) {
            (Some(per_round), _) => *per_round,
            (None, 0) => self.target * HOPELESS.0,
            (None, _) => self.target * HOPELESS.1,
        }
    }
}

/// A fit in progress.
pub(super) struct Fit<'a> {
    pub world: &'a RelitWorld,
    pub occluders: &'a Occluders,
    /// Materials of skies without directives.
    pub unknown_skies: &'a [u32],
    /// Surface index of each triangle.
    pub of_triangle: Vec<u32>,
    /// How samples are taken.
    pub sampling: SamplingOptions,
    pub samples: Vec<Sample>,
    /// Texels beside placed lights that joined the samples.
    pub near_light_texels: HashSet<TexelId>,
    /// Measurements of texels beside lights, by texel and triangle, for reuse.
    pub near_light_measurements: HashMap<(TexelId, u32), Option<Sample>>,
    /// The part of space near samples.
    pub measured: MeasuredSpace,
    pub transfer: Transfer,
    /// Possible back splashes.
    pub splashes: Vec<Splashes>,
    /// Columns; known sources come first.
    pub columns: Vec<Column>,
    pub ambient: Ambient,
    /// Candidates from the directions of the light grid.
    pub crossings: Vec<Crossing>,
    /// Candidates over open space with their rows; the first samples of a fit do not change.
    pub grid_candidates: Option<Arc<Candidates>>,
    /// Candidates in front of samples with a residual, of earlier rounds.
    pub residual_candidates: ResidualCandidates,
    /// Held-out error after each round with inverse-square lights, stops.
    pub rounds: Vec<f32>,
    /// Light cutoff, irradiance over π.
    pub cutoff: f32,
    /// What the fit is for, and when it is abandoned.
    pub mode: FitMode<'a>,
}

impl Fit<'_> {
    /// Agreement of the current fit at held-out samples.
    pub fn agreement(&self) -> Agreement {
        let computed = solve::predict(&self.samples, &self.columns, self.ambient.value);
        Agreement::of(self.world, &self.samples, &computed)
    }

    /// [`agreement`](Self::agreement) at all texels, fitted ones included.
    pub fn agreement_overall(&self) -> Agreement {
        let computed = solve::predict(&self.samples, &self.columns, self.ambient.value);
        let mut samples = self.samples.clone();
        for sample in samples.iter_mut().filter(|s| s.site == Site::Surface) {
            sample.held_out = true;
        }
        Agreement::of(self.world, &samples, &computed)
    }

    /// Exposure at which the current fit is as bright as the engine shows the map, averaged over the views from the
    /// spawn points; without spawn points over the map's area.
    pub fn exposure(&self) -> Option<Exposure> {
        let computed = solve::predict(&self.samples, &self.columns, self.ambient.value);
        let place = |sample: usize, material: u32| {
            let stored = self.samples.get(sample)?.shown;
            let light = *computed.get(sample)?;
            let material = self.world.materials.get(material as usize);
            Some(LitSample {
                stored,
                light: light * material.map_or(1.0, WorldMaterial::stored_scale),
                shades: material.map_or(&[], |m| &m.shades),
            })
        };
        let seen = spawn_views::visible_samples(self.world, self.occluders, &self.samples);
        let seen = seen.into_iter();
        exposure::matching(seen.filter_map(|(sample, material)| place(sample as usize, material)))
            .or_else(|| {
                let all = self.samples.iter().enumerate();
                exposure::matching(all.filter_map(|(i, sample)| place(i, sample.material)))
            })
    }

    /// Computes reflected light from the current strengths. `pictures`: with the light of sky images.
    pub fn rebounce(&mut self, pictures: bool) {
        let direct = solve::direct(&self.samples, &self.columns);
        self.set_bounce(&direct, pictures);
    }

    fn set_bounce(&mut self, light: &[Vec3], pictures: bool) {
        let bounced = self.transfer.of(light, pictures);
        for (sample, bounce) in self.samples.iter_mut().zip(bounced) {
            sample.bounce = bounce;
        }
    }

    /// Fits the known sources, and a sun if none is known.
    pub fn fit_known(&mut self) {
        // Measured light is a better first estimate of the reflected light than the prior of the lights.
        let measured: Vec<Vec3> = self.samples.iter().map(|s| s.value).collect();
        self.set_bounce(&measured, false);
        let (columns, ambient) = (&mut self.columns, &mut self.ambient);
        solve::solve(&self.samples, columns, ambient, FIRST, 0.0);
        if self.occluders.any_sky() {
            suns::find(self.occluders, &self.samples, columns, ambient, FIRST, 0.0);
        }
        if self.cutoff > 0.0 {
            solve::solve(&self.samples, columns, ambient, NEXT, self.cutoff);
        }
    }

    /// Adds back splashes if they explain light that known sources do not. Returns whether any were added.
    pub fn try_splashes(&mut self, splashes: Vec<Column>) -> bool {
        let state = self.state();
        self.settle();
        let without = self.agreement().median_stops;
        let known = self.columns.len();
        self.columns.extend(splashes);
        self.settle();
        let kept = self.agreement().median_stops < without * SPLASHES_KEPT;
        let residual = solve::residual(&self.samples, &self.columns, self.ambient.value);
        placement::drop_useless(&mut self.columns, known, &residual, placement::WORTH);
        let splashes = self.columns.split_off(known);
        self.restore(state);
        let added = kept && !splashes.is_empty();
        if added {
            self.columns.extend(splashes);
        }
        added
    }

    /// Updates strengths and reflected light in turns.
    pub fn settle(&mut self) {
        for _ in 0..3 {
            self.rebounce(false);
            solve::solve(
                &self.samples,
                &mut self.columns,
                &mut self.ambient,
                NEXT,
                self.cutoff,
            );
        }
        self.rebounce(false);
    }

    /// The errors at which placement is abandoned. `linear`: linear falloff is allowed.
    fn error_limits(&self, linear: bool) -> ErrorLimits {
        let (target, per_round, rounds) = match self.mode {
            // Linear lights must beat the inverse-square lights.
            _ if linear => (f32::INFINITY, self.rounds.clone(), ROUNDS),
            FitMode::Trial(rounds) => (f32::INFINITY, Vec::new(), rounds),
            FitMode::Full(acceptance) => {
                (acceptance.stops, acceptance.round_limits.to_vec(), ROUNDS)
            }
        };
        ErrorLimits {
            target,
            per_round,
            rounds,
        }
    }

    /// Places point lights in rounds while the held-out error falls. `linear`: linear falloff is allowed.
    /// `progress` gets the completed part of the rounds.
    ///
    /// Returns true if the required error was missed.
    pub fn place_lights(
        &mut self,
        candidates: usize,
        linear: bool,
        progress: &mut dyn FnMut(f32),
    ) -> bool {
        let fixed = self.columns.len();
        let error_limits = self.error_limits(linear);
        let mut spacing = 0.0;
        let mut best = f32::INFINITY;
        for round in 0..error_limits.rounds {
            let kept = (self.columns.clone(), self.ambient);
            let scene = Scene {
                world: self.world,
                occluders: self.occluders,
                soa: SampleSoa::new(&self.samples),
                measured: &self.measured,
                of_triangle: &self.of_triangle,
                candidates,
                linear,
                cutoff: self.cutoff,
            };
            let (columns, ambient) = (&mut self.columns, &mut self.ambient);
            if round == 0 {
                let grid_candidates = self.grid_candidates.get_or_insert_with(|| {
                    Arc::new(placement::over_open_space(&scene, &self.crossings))
                });
                spacing = grid_candidates.spacing;
                placement::place_from_grid(&scene, grid_candidates, columns, fixed, ambient);
            } else {
                placement::place_at_residuals(
                    &scene,
                    &mut self.residual_candidates,
                    columns,
                    fixed,
                    ambient,
                    spacing,
                );
            }
            self.settle();
            let direct = solve::direct(&self.samples, &self.columns);
            if round == 0 && light_grid::trust_if_consistent(self.world, &mut self.samples, &direct)
            {
                self.settle();
            }
            // The first round, over all open space, takes as long as the others together.
            progress(0.5 + 0.5 * round as f32 / (ROUNDS - 1) as f32);
            let found = self.agreement().median_stops;
            if found > best {
                (self.columns, self.ambient) = kept;
                self.rebounce(false);
            }
            let done = found > best * ROUND_GAIN;
            best = best.min(found);
            if !linear {
                self.rounds.push(best);
            }
            if best > error_limits.abandon_above(round) {
                return true;
            }
            if done {
                break;
            }
            self.add_near_light_texels(fixed);
        }
        // Lights that move or grow to compensate may be too bright at other texels.
        for _ in 0..NEAR_LIGHT_PASSES {
            let kept = self.state();
            if !self.add_near_light_texels(fixed) {
                break;
            }
            self.settle();
            let found = self.agreement().median_stops;
            if found > best * NEAR_LIGHT_TOLERANCE {
                self.restore(kept);
                break;
            }
        }
        best > error_limits.target
    }

    /// Repeats placement with linear falloff allowed if inverse-square lights leave a large error, and keeps the
    /// result if the held-out error falls. `state`: the state before placement. `directives`: error of the
    /// directives, stops.
    pub fn try_linear_falloff(&mut self, state: SavedState, candidates: usize, directives: f32) {
        let before = self.agreement().median_stops;
        if before < LINEAR_TRIED_ABOVE && before <= hypotheses::error_target(directives) {
            return;
        }
        let kept = self.state();
        self.restore(state);
        let abandoned = self.place_lights(candidates, true, &mut |_| ());
        if abandoned || self.agreement().median_stops > before * LINEAR_KEPT {
            self.restore(kept);
        }
    }

    /// Copies the state that placement changes.
    pub fn state(&self) -> SavedState {
        SavedState {
            columns: self.columns.clone(),
            ambient: self.ambient,
            samples: self.samples.clone(),
            transfer: self.transfer.clone(),
            near_light_texels: self.near_light_texels.clone(),
        }
    }

    /// Returns to a saved state.
    fn restore(&mut self, state: SavedState) {
        (self.columns, self.ambient) = (state.columns, state.ambient);
        (self.samples, self.transfer) = (state.samples, state.transfer);
        self.near_light_texels = state.near_light_texels;
    }

    /// Drops the light-grid samples if the held-out error does not grow without them.
    pub fn drop_light_grid_if_worse(&mut self) {
        let kept = (self.columns.clone(), self.ambient);
        let before = self.agreement().median_stops;
        let trusted = light_grid::trust(&mut self.samples, 0.0);
        if !trusted {
            return;
        }
        self.settle();
        if self.agreement().median_stops >= before {
            (self.columns, self.ambient) = kept;
            self.rebounce(false);
        }
    }

    /// Raises the ambient limit to the 20 % quantile of the lit texels, if that lowers the error clearly.
    pub fn raise_ambient(&mut self) {
        let kept = (self.columns.clone(), self.ambient);
        let before = self.agreement().median_stops;
        self.ambient.limit = quantile(&self.samples, 0.2, light_of(self.world, 1.0));
        self.settle();
        if self.agreement().median_stops > before * MORE_AMBIENT {
            (self.columns, self.ambient) = kept;
            self.rebounce(false);
        }
    }
}

/// Initial value and limit of the ambient term. The limit is the 5 % quantile of the fitted samples: every texel
/// has at least the compiler's ambient and minimum light. A larger limit would replace lights and fill shadows.
pub(super) fn first_ambient(world: &RelitWorld, samples: &[Sample]) -> Ambient {
    let dark = quantile(samples, 0.05, 0.0);
    // Without any light loading set the ambient term to the mean of the lightmaps.
    let start = if world.light_count() == 0 {
        Vec3::ZERO
    } else {
        world.ambient.min(dark)
    };
    Ambient {
        value: start,
        limit: dark,
    }
}

/// Quantile of the fitted surface samples of at least `least`, channel by channel.
fn quantile(samples: &[Sample], part: f32, least: f32) -> Vec3 {
    let chosen: Vec<Vec3> = samples
        .iter()
        .filter(|s| s.site == Site::Surface && !s.held_out && mean(s.value) >= least)
        .map(|s| s.value)
        .collect();
    let channel = |k: usize| {
        let mut values: Vec<f32> = chosen.iter().map(|v| v[k]).collect();
        values.sort_by(f32::total_cmp);
        let at = (values.len() as f32 * part) as usize;
        values.get(at).copied().unwrap_or(0.0)
    };
    Vec3::new(channel(0), channel(1), channel(2))
}
