//! The state of a fit, and its steps: strengths, ambient and bounced light, which depend on each other.

use super::air;
use super::bounce::Transfer;
use super::columns::Column;
use super::crossings::Crossing;
use super::fronts::Fronts;
use super::nodes::Measured;
use super::place::{self, Candidates, Scene};
use super::samples::{Sample, Site, Taking, light_of, mean};
use super::solve::{self, Ambient, Effort};
use super::splash::Splashes;
use super::spread::Spread;
use super::texels::TexelId;
use super::{Purpose, suns, views, ways};
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
const ENOUGH: f32 = 0.985;

/// Linear falloff is believed when it leaves less than this part of the error at samples held out.
const LINEAR: f32 = 0.97;

/// Times that texels beside lights are looked at once these stay where they are.
const LAST_LOOKS: u32 = 2;

/// How many times the error at samples held out these texels may leave then: they are a small part of the map.
const BESIDE: f32 = 1.02;

/// Error, stops, of lights that fall off with the square of the distance, from which on linear ones are tried, as they are
/// where less than half of the error of directives is gone. Elsewhere a few that reach far may agree a little better with the
/// light of many lamps than these do.
const MUCH: f32 = 0.25;

/// More ambient light than the darkest texels have is believed when it leaves less than this part of the error at
/// samples held out: then these texels are dark for another reason.
const MORE_AMBIENT: f32 = 0.93;

/// Back splashes are believed when they leave less than this part of the error at samples held out.
const SPLASHED: f32 = 0.95;

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
pub(super) struct Start {
    columns: Vec<Column>,
    ambient: Ambient,
    samples: Vec<Sample>,
    transfer: Transfer,
    beside: HashSet<TexelId>,
}

/// What lights that are put in have to come up to.
struct Rivals {
    /// Error that is asked for, stops.
    asked: f32,
    /// Error that another way left after each round, and a little more.
    pace: Vec<f32>,
    /// Most times that lights are looked for.
    rounds: usize,
}

impl Rivals {
    /// Error after a round that leaves no hope.
    fn hopeless(&self, round: usize) -> f32 {
        match (self.pace.get(round), round) {
            (Some(pace), _) => *pace,
            (None, 0) => self.asked * HOPELESS.0,
            (None, _) => self.asked * HOPELESS.1,
        }
    }
}

/// A fit in progress.
pub(super) struct Fit<'a> {
    pub world: &'a RelitWorld,
    pub occluders: &'a Occluders,
    /// Skies of which directives tell nothing.
    pub silent: &'a [u32],
    /// For every triangle, the surface that it is of.
    pub of_triangle: Vec<u32>,
    /// How measurements are taken.
    pub taking: Taking,
    pub samples: Vec<Sample>,
    /// Texels that joined them, beside lights that were put in.
    pub beside: HashSet<TexelId>,
    /// What was measured beside lights before, by texel and triangle.
    pub looked_at: HashMap<(TexelId, u32), Option<Sample>>,
    /// Where texels, or what tells in their place, are measured.
    pub measured: Measured,
    pub transfer: Transfer,
    /// Back splashes that there may be.
    pub splashes: Vec<Splashes>,
    /// Known sources first.
    pub columns: Vec<Column>,
    pub ambient: Ambient,
    /// Places that the light grid's directions meet at.
    pub crossings: Vec<Crossing>,
    /// Candidates all over open space, once they were tried: they see the first measurements alike each time.
    pub tried: Option<Arc<Candidates>>,
    /// Places in front of samples that were candidates before.
    pub fronts: Fronts,
    /// Error at samples held out after each round of lights that fall off with the square of the distance.
    pub rounds: Vec<f32>,
    /// Light at which lights end.
    pub least: f32,
    /// What it is for: what will not do that need not be looked for to the end.
    pub purpose: Purpose<'a>,
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
        let seen = views::seen(self.world, self.occluders, &self.samples);
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
        self.bounce_of(&direct, pictures);
    }

    fn bounce_of(&mut self, light: &[Vec3], pictures: bool) {
        let bounced = self.transfer.of(light, pictures);
        for (sample, bounce) in self.samples.iter_mut().zip(bounced) {
            sample.bounce = bounce;
        }
    }

    /// Fits known sources, and a sun where none is known.
    pub fn known(&mut self) {
        // What was measured is a better first guess of what is thrown back than what is believed of lights.
        let measured: Vec<Vec3> = self.samples.iter().map(|s| s.value).collect();
        self.bounce_of(&measured, false);
        let (columns, ambient) = (&mut self.columns, &mut self.ambient);
        solve::solve(&self.samples, columns, ambient, FIRST, 0.0);
        if self.occluders.any_sky() {
            suns::find(self.occluders, &self.samples, columns, ambient, FIRST, 0.0);
        }
        if self.least > 0.0 {
            solve::solve(&self.samples, columns, ambient, NEXT, self.least);
        }
    }

    /// Adds back splashes where they explain what known lights do not. Whether some were added.
    pub fn splash(&mut self, splashes: Vec<Column>) -> bool {
        let start = self.start();
        self.settle();
        let without = self.agreement().median_stops;
        let known = self.columns.len();
        self.columns.extend(splashes);
        self.settle();
        let believed = self.agreement().median_stops < without * SPLASHED;
        let state = solve::residual(&self.samples, &self.columns, self.ambient.value);
        place::drop_useless(&mut self.columns, known, &state, place::WORTH);
        let splashes = self.columns.split_off(known);
        self.back_to(start);
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
                self.least,
            );
        }
        self.rebounce(false);
    }

    /// What lights that are put in have to come up to.
    fn rivals(&self, linear: bool) -> Rivals {
        let (asked, pace, rounds) = match self.purpose {
            // they are worth having if they agree better than what there is
            _ if linear => (f32::INFINITY, self.rounds.clone(), ROUNDS),
            Purpose::Trial(rounds) => (f32::INFINITY, Vec::new(), rounds),
            Purpose::Enough(asked) => (asked.stops, asked.pace.to_vec(), ROUNDS),
        };
        Rivals {
            asked,
            pace,
            rounds,
        }
    }

    /// Puts in point lights for as long as samples that are held out get better by it.
    /// `linear`: such that may fall off linearly, too. `progress` gets the part of the most rounds that are done.
    /// Whether what is asked for was not come near to.
    pub fn place(
        &mut self,
        candidates: usize,
        linear: bool,
        progress: &mut dyn FnMut(f32),
    ) -> bool {
        let fixed = self.columns.len();
        let rivals = self.rivals(linear);
        let mut spacing = 0.0;
        let mut best = f32::INFINITY;
        for round in 0..rivals.rounds {
            let kept = (self.columns.clone(), self.ambient);
            let scene = Scene {
                world: self.world,
                occluders: self.occluders,
                spread: Spread::new(&self.samples),
                measured: &self.measured,
                of_triangle: &self.of_triangle,
                candidates,
                linear,
                least: self.least,
            };
            let (columns, ambient) = (&mut self.columns, &mut self.ambient);
            if round == 0 {
                let tried = self
                    .tried
                    .get_or_insert_with(|| Arc::new(place::over_space(&scene, &self.crossings)));
                spacing = tried.spacing;
                place::out_of(&scene, tried, columns, fixed, ambient);
            } else {
                place::in_front(&scene, &mut self.fronts, columns, fixed, ambient, spacing);
            }
            self.settle();
            let direct = solve::direct(&self.samples, &self.columns);
            if round == 0 && air::believe(self.world, &mut self.samples, &direct) {
                self.settle();
            }
            // The first round, over all space, takes as long as the others together.
            progress(0.5 + 0.5 * round as f32 / (ROUNDS - 1) as f32);
            let found = self.agreement().median_stops;
            if found > best {
                (self.columns, self.ambient) = kept;
                self.rebounce(false);
            }
            let done = found > best * ENOUGH;
            best = best.min(found);
            if !linear {
                self.rounds.push(best);
            }
            if best > rivals.hopeless(round) {
                return true;
            }
            if done {
                break;
            }
            self.look_beside(fixed);
        }
        // What is moved or grows to make up for what was too bright may be too bright elsewhere.
        for _ in 0..LAST_LOOKS {
            let kept = self.start();
            if !self.look_beside(fixed) {
                break;
            }
            self.settle();
            let found = self.agreement().median_stops;
            if found > best * BESIDE {
                self.back_to(kept);
                break;
            }
        }
        best > rivals.asked
    }

    /// Puts in lights that may fall off linearly, as compilers can have it, in place of those of [`place`](Self::place),
    /// where these leave much and samples that are held out get better by it. `start`: the state before them. `directives`:
    /// error of what these say, stops.
    pub fn place_linear(&mut self, start: Start, candidates: usize, directives: f32) {
        let before = self.agreement().median_stops;
        if before < MUCH && before <= ways::halved(directives) {
            return;
        }
        let kept = self.start();
        self.back_to(start);
        let hopeless = self.place(candidates, true, &mut |_| ());
        if hopeless || self.agreement().median_stops > before * LINEAR {
            self.back_to(kept);
        }
    }

    /// What [`place`](Self::place) begins with.
    pub fn start(&self) -> Start {
        Start {
            columns: self.columns.clone(),
            ambient: self.ambient,
            samples: self.samples.clone(),
            transfer: self.transfer.clone(),
            beside: self.beside.clone(),
        }
    }

    /// Goes back to a state.
    fn back_to(&mut self, start: Start) {
        (self.columns, self.ambient) = (start.columns, start.ambient);
        (self.samples, self.transfer) = (start.samples, start.transfer);
        self.beside = start.beside;
    }

    /// Leaves the measurements in the air out again where samples held out say so.
    pub fn with_or_without_air(&mut self) {
        let kept = (self.columns.clone(), self.ambient);
        let before = self.agreement().median_stops;
        let trusted = air::trust(&mut self.samples, 0.0);
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
    pub fn more_ambient(&mut self) {
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
