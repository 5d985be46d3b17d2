//! What ways of looking for a map's light have in common: which measurements are taken, what these see of each other,
//! and which of them candidates for lost lights see. Most ways take the same, so that it is traced once.

use super::Evidence;
use super::bounce::Transfer;
use super::crossings::Crossing;
use super::place::Candidates;
use super::samples::{self, Sample, Site, Taking};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::sync::Arc;

/// What was traced for other ways.
#[derive(Default)]
pub(super) struct Memory {
    taken: Vec<Taken>,
    seen: Vec<Seen>,
    tried: Option<(Looked, Arc<Candidates>)>,
}

/// What candidates all over open space, and what they see, depend on.
#[derive(PartialEq)]
pub(super) struct Looked {
    holes: bool,
    measured: Vec<(Vec3, Vec3)>,
    crossings: Vec<Vec3>,
    most: usize,
}

impl Looked {
    /// At most so many candidates for some measurements, and where directions of the light grid meet.
    pub fn of(
        world: &RelitWorld,
        samples: &[Sample],
        crossings: &[Crossing],
        most: usize,
    ) -> Looked {
        Looked {
            holes: holes(world),
            measured: samples.iter().map(|s| (s.position, s.normal)).collect(),
            crossings: crossings.iter().map(|c| c.origin).collect(),
            most,
        }
    }
}

/// Measurements, and all that they depend on.
struct Taken {
    taking: Taking,
    gamma: f32,
    holes: bool,
    samples: Vec<Sample>,
    evidence: Evidence,
}

/// What measurements on surfaces see of each other.
struct Seen {
    samples: Vec<Sample>,
    bounces: u32,
    holes: bool,
    transfer: Transfer,
}

/// Whether cut-outs have holes.
fn holes(world: &RelitWorld) -> bool {
    world.materials.iter().any(|m| m.holes.is_some())
}

impl Memory {
    /// Candidates that were tried for the same.
    pub fn tried(&self, looked: &Looked) -> Option<Arc<Candidates>> {
        let (of, tried) = self.tried.as_ref()?;
        (of == looked).then(|| Arc::clone(tried))
    }

    /// Keeps candidates, the last ones alone: they are much, and ways that look alike mostly follow each other.
    pub fn keep_tried(&mut self, looked: Looked, tried: Option<Arc<Candidates>>) {
        self.tried = tried.map(|tried| (looked, tried));
    }

    /// [`samples::take`].
    pub fn take(
        &mut self,
        world: &RelitWorld,
        occluders: &Occluders,
        taking: &Taking,
    ) -> (Vec<Sample>, Evidence) {
        let (gamma, holes) = (world.stored_gamma, holes(world));
        let same = |t: &&Taken| (&t.taking, t.gamma, t.holes) == (taking, gamma, holes);
        if let Some(known) = self.taken.iter().find(same) {
            return (known.samples.clone(), known.evidence);
        }
        let (samples, evidence) = samples::take(world, occluders, taking);
        self.taken.push(Taken {
            taking: *taking,
            gamma,
            holes,
            samples: samples.clone(),
            evidence,
        });
        (samples, evidence)
    }

    /// [`Transfer::new`]: what is seen hangs on where measurements are, not on how bright. Those in the air come last.
    pub fn transfer(
        &mut self,
        world: &RelitWorld,
        occluders: &Occluders,
        samples: &[Sample],
        bounces: u32,
        unlisted: impl Fn(u32) -> bool + Sync,
    ) -> Transfer {
        let holes = holes(world);
        let surfaces = samples.partition_point(|s| s.site == Site::Surface);
        let (surfaces, air) = samples.split_at(surfaces);
        let place = |s: &Sample| (s.position, s.normal);
        let same = |seen: &&Seen| {
            (seen.bounces, seen.holes) == (bounces, holes)
                && seen
                    .samples
                    .iter()
                    .map(place)
                    .eq(surfaces.iter().map(place))
        };
        let known = self.seen.iter().find(same).map(|s| s.transfer.clone());
        let mut transfer = known.unwrap_or_else(|| {
            let transfer = Transfer::new(world, occluders, surfaces, bounces, &unlisted);
            self.seen.push(Seen {
                samples: surfaces.to_vec(),
                bounces,
                holes,
                transfer: transfer.clone(),
            });
            transfer
        });
        transfer.add(world, occluders, surfaces, air, unlisted);
        transfer
    }
}
