//! The state of a fit, and its steps: strengths, ambient and bounced light, which depend on each other.

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
use crate::exposure::{self, Exposure, Place};
use crate::occluders::Occluders;
use crate::world::{RelitWorld, WorldMaterial};
use glam::Vec3;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Most times that lights are looked for.
pub(super) const ROUNDS: usize = 4;

/// Lights are looked for again while that leaves less than this part of the error at samples held out.
const ROUND_GAIN: f32 = 0.985;

/// Linear falloff is believed when it leaves less than this part of the error at samples held out.
const LINEAR_KEPT: f32 = 0.97;

/// Times that texels beside lights are looked at once these stay where they are.
const NEAR_LIGHT_PASSES: u32 = 2;

/// How many times the error at samples held out these texels may leave then: they are a small part of the map.
const NEAR_LIGHT_TOLERANCE: f32 = 1.02;

/// Error, stops, of lights that fall off with the square of the distance, from which on linear ones are tried, as they are
/// where less than half of the error of directives is gone. Elsewhere a few that reach far may agree a little better with the
/// light of many lamps than these do.
const LINEAR_TRIED_ABOVE: f32 = 0.25;

/// More ambient light than the darkest texels have is believed when it leaves less than this part of the error at
/// samples held out: then these texels are dark for another reason.
const MORE_AMBIENT: f32 = 0.93;

/// Back splashes are believed when they leave less than this part of the error at samples held out.
const SPLASHES_KEPT: f32 = 0.95;

/// How many times the error that is asked for leaves no hope after the first round that lights are looked for, and after each
/// other one.
const HOPELESS: (f32, f32) = (1.3, 1.1);

/// Strengths from a rough guess.
const FIRST: Effort = Effort {
    rounds: 8,
    sweeps: 12,
    sparsity: 0.0,
    anew: true,
};

/// Strengths from nearly right ones.
const NEXT: Effort = Effort {
    rounds: 3,
    sweeps: 8,
    sparsity: 0.0,
    anew: false,
};

/// A state to come back to.
#[derive(Clone)]
pub(super) struct SavedState {
    columns: Vec<Column>,
    ambient: Ambient,
    samples: Vec<Sample>,
    transfer: Transfer,
    near_light_texels: HashSet<TexelId>,
}

/// What lights that are put in have to come up to.
struct ErrorLimits {
    /// Error that is asked for, stops.
    target: f32,
    /// Error that another way left after each round, and a little more.
    per_round: Vec<f32>,
    /// Most times that lights are looked for.
    rounds: usize,
}

impl ErrorLimits {
    /// Error after a round that leaves no hope.
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
    /// Skies of which directives tell nothing.
    pub unknown_skies: &'a [u32],
    /// For every triangle, the surface that it is of.
    pub of_triangle: Vec<u32>,
    /// How measurements are taken.
    pub sampling: SamplingOptions,
    pub samples: Vec<Sample>,
    /// Texels that joined them, beside lights that were put in.
    pub near_light_texels: HashSet<TexelId>,
    /// What was measured beside lights before, by texel and triangle.
    pub near_light_measurements: HashMap<(TexelId, u32), Option<Sample>>,
    /// Where texels, or what tells in their place, are measured.
    pub measured: MeasuredSpace,
    pub transfer: Transfer,
    /// Back splashes that there may be.
    pub splashes: Vec<Splashes>,
    /// Known sources first.
    pub columns: Vec<Column>,
    pub ambient: Ambient,
    /// Places that the light grid's directions meet at.
    pub crossings: Vec<Crossing>,
    /// Candidates all over open space, once they were tried: they see the first measurements alike each time.
    pub grid_candidates: Option<Arc<Candidates>>,
    /// Places in front of samples that were candidates before.
    pub residual_candidates: ResidualCandidates,
    /// Error at samples held out after each round of lights that fall off with the square of the distance.
    pub rounds: Vec<f32>,
    /// Light at which lights end.
    pub cutoff: f32,
    /// What it is for: what will not do that need not be looked for to the end.
    pub mode: FitMode<'a>,
}

impl Fit<'_> {
    /// Light at the samples as it is computed now.
    pub fn agreement(&self) -> Agreement {
        let computed = solve::predict(&self.samples, &self.columns, self.ambient.value);
        Agreement::of(self.world, &self.samples, &computed)
    }

    /// [`agreement`](Self::agreement) with all texels, those that are fitted, too.
    pub fn agreement_overall(&self) -> Agreement {
        let computed = solve::predict(&self.samples, &self.columns, self.ambient.value);
        let mut samples = self.samples.clone();
        for sample in samples.iter_mut().filter(|s| s.site == Site::Surface) {
            sample.held_out = true;
        }
        Agreement::of(self.world, &samples, &computed)
    }

    /// Exposure at which light as it is now is as bright as the engine shows the map, in the mean of what players see where
    /// they are set; over the map's area where nothing tells where that is.
    pub fn exposure(&self) -> Option<Exposure> {
        let computed = solve::predict(&self.samples, &self.columns, self.ambient.value);
        let place = |sample: usize, material: u32| {
            let stored = self.samples.get(sample)?.shown;
            let light = *computed.get(sample)?;
            let material = self.world.materials.get(material as usize);
            Some(Place {
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

    /// Takes bounced light from the strengths as they are. `pictures`: with what pictures of skies give.
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

    /// Fits known sources, and a sun where none is known.
    pub fn fit_known(&mut self) {
        // What was measured is a better first guess of what is thrown back than what is believed of lights.
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

    /// Adds back splashes where they explain what known lights do not. Whether some were added.
    pub fn try_splashes(&mut self, splashes: Vec<Column>) -> bool {
        let state = self.state();
        self.settle();
        let without = self.agreement().median_stops;
        let known = self.columns.len();
        self.columns.extend(splashes);
        self.settle();
        let believed = self.agreement().median_stops < without * SPLASHES_KEPT;
        let residual = solve::residual(&self.samples, &self.columns, self.ambient.value);
        placement::drop_useless(&mut self.columns, known, &residual, placement::WORTH);
        let splashes = self.columns.split_off(known);
        self.restore(state);
        let added = believed && !splashes.is_empty();
        if added {
            self.columns.extend(splashes);
        }
        added
    }

    /// Fits strengths and the light that they throw back to each other, in turns.
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

    /// What lights that are put in have to come up to.
    fn error_limits(&self, linear: bool) -> ErrorLimits {
        let (target, per_round, rounds) = match self.mode {
            // they are worth having if they agree better than what there is
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

    /// Puts in point lights for as long as samples that are held out get better by it.
    /// `linear`: such that may fall off linearly, too. `progress` gets the part of the most rounds that are done.
    /// Whether what is asked for was not come near to.
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
            // The first round, over all space, takes as long as the others together.
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
        // What is moved or grows to make up for what was too bright may be too bright elsewhere.
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

    /// Puts in lights that may fall off linearly, as compilers can have it, in place of those of [`place_lights`](Self::place_lights),
    /// where these leave much and samples that are held out get better by it. `state`: the state before them. `directives`:
    /// error of what these say, stops.
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

    /// What [`place_lights`](Self::place_lights) begins with.
    pub fn state(&self) -> SavedState {
        SavedState {
            columns: self.columns.clone(),
            ambient: self.ambient,
            samples: self.samples.clone(),
            transfer: self.transfer.clone(),
            near_light_texels: self.near_light_texels.clone(),
        }
    }

    /// Goes back to a state.
    fn restore(&mut self, state: SavedState) {
        (self.columns, self.ambient) = (state.columns, state.ambient);
        (self.samples, self.transfer) = (state.samples, state.transfer);
        self.near_light_texels = state.near_light_texels;
    }

    /// Leaves the measurements in the air out again where samples held out say so.
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

    /// Lets the ambient term grow to what the darker of the lit texels have, where that explains much more.
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

/// Where the ambient term starts, and how far it may go: what the darkest twentieth has, for no texel has less than the
/// compiler's ambient and minimum light. More would hide lights, and fill shadows.
pub(super) fn first_ambient(world: &RelitWorld, samples: &[Sample]) -> Ambient {
    let dark = quantile(samples, 0.05, 0.0);
    // Without any light, loading took the mean of all light for ambient.
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

/// What a part of the samples that are fitted and not below `least` are darker than, channel by channel.
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
