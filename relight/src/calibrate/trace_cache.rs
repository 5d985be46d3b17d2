//! What ways of looking for a map's light have in common: which measurements are taken, what these see of each other,
//! and which of them candidates for lost lights see. Most ways take the same, so that it is traced once.

use super::Evidence;
use super::bounce::Transfer;
use super::placement::Candidates;
use super::samples::{self, Sample, SamplingOptions, Site};
use super::triangulation::Crossing;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::sync::Arc;

/// What was traced for other ways.
#[derive(Default)]
pub(super) struct TraceCache {
    samples: Vec<CachedSamples>,
    transfers: Vec<CachedTransfer>,
    candidates: Option<(CandidateKey, Arc<Candidates>)>,
}

/// What candidates all over open space, and what they see, depend on.
#[derive(PartialEq)]
pub(super) struct CandidateKey {
    holes: bool,
    measured: Vec<(Vec3, Vec3)>,
    crossings: Vec<Vec3>,
    most: usize,
}

impl CandidateKey {
    /// At most so many candidates for some measurements, and where directions of the light grid meet.
    pub fn of(
        world: &RelitWorld,
        samples: &[Sample],
        crossings: &[Crossing],
        most: usize,
    ) -> CandidateKey {
        CandidateKey {
            holes: holes(world),
            measured: samples.iter().map(|s| (s.position, s.normal)).collect(),
            crossings: crossings.iter().map(|c| c.origin).collect(),
            most,
        }
    }
}

/// Measurements, and all that they depend on.
struct CachedSamples {
    sampling: SamplingOptions,
    gamma: f32,
    holes: bool,
    samples: Vec<Sample>,
    evidence: Evidence,
}

/// What measurements on surfaces see of each other.
struct CachedTransfer {
    samples: Vec<Sample>,
    bounces: u32,
    holes: bool,
    transfer: Transfer,
}

/// Whether cut-outs have holes.
fn holes(world: &RelitWorld) -> bool {
    world.materials.iter().any(|m| m.holes.is_some())
}

impl TraceCache {
    /// Candidates that were tried for the same.
    pub fn candidates(&self, key: &CandidateKey) -> Option<Arc<Candidates>> {
        let (of, candidates) = self.candidates.as_ref()?;
        (of == key).then(|| Arc::clone(candidates))
    }

    /// Keeps candidates, the last ones alone: they are much, and ways that look alike mostly follow each other.
    pub fn keep_candidates(&mut self, key: CandidateKey, candidates: Option<Arc<Candidates>>) {
        self.candidates = candidates.map(|candidates| (key, candidates));
    }

    /// [`samples::take`].
    pub fn take(
        &mut self,
        world: &RelitWorld,
        occluders: &Occluders,
        sampling: &SamplingOptions,
    ) -> (Vec<Sample>, Evidence) {
        let (gamma, holes) = (world.stored_gamma, holes(world));
        let same = |t: &&CachedSamples| (&t.sampling, t.gamma, t.holes) == (sampling, gamma, holes);
        if let Some(cached) = self.samples.iter().find(same) {
            return (cached.samples.clone(), cached.evidence);
        }
        let (samples, evidence) = samples::take(world, occluders, sampling);
        self.samples.push(CachedSamples {
            sampling: *sampling,
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
        let same = |cached: &&CachedTransfer| {
            (cached.bounces, cached.holes) == (bounces, holes)
                && cached
                    .samples
                    .iter()
                    .map(place)
                    .eq(surfaces.iter().map(place))
        };
        let cached = self.transfers.iter().find(same).map(|s| s.transfer.clone());
        let mut transfer = cached.unwrap_or_else(|| {
            let transfer = Transfer::new(world, occluders, surfaces, bounces, &unlisted);
            self.transfers.push(CachedTransfer {
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
