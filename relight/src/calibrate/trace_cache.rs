//! Results of rays in memory, shared between the fits of one world, and the hierarchy of its triangles: samples, transfer
//! matrices and candidate rows. Most fits use the same ones.

use super::Evidence;
use super::bounce::Transfer;
use super::placement::Candidates;
use super::samples::{self, Sample, SamplingOptions, Site};
use super::triangulation::Crossing;
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::sync::Arc;

/// Results of rays of earlier fits.
#[derive(Default)]
pub(super) struct TraceCache {
    /// Hierarchies of the world's triangles, by whether cut-outs have holes.
    occluders: Vec<(bool, Arc<Occluders>)>,
    samples: Vec<CachedSamples>,
    transfers: Vec<CachedTransfer>,
    candidates: Option<(CandidateKey, Arc<Candidates>)>,
}

/// Everything that the candidates over open space and their rows depend on.
#[derive(PartialEq)]
pub(super) struct CandidateKey {
    holes: bool,
    measured: Vec<(Vec3, Vec3)>,
    crossings: Vec<Vec3>,
    most: usize,
}

impl CandidateKey {
    /// The key for these samples, at most `most` candidates and these crossings.
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

/// Samples, and everything that they depend on.
struct CachedSamples {
    sampling: SamplingOptions,
    gamma: f32,
    holes: bool,
    samples: Vec<Sample>,
    evidence: Evidence,
}

/// The transfer matrix of surface samples.
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
    /// [`Occluders::of_world`] with reuse. Fits change a world's light, and whether its cut-outs have holes.
    pub fn occluders(&mut self, world: &RelitWorld) -> Arc<Occluders> {
        let holes = holes(world);
        if let Some((_, made)) = self.occluders.iter().find(|(of, _)| *of == holes) {
            return Arc::clone(made);
        }
        let made = Arc::new(Occluders::of_world(world));
        self.occluders.push((holes, Arc::clone(&made)));
        made
    }

    /// The candidates for this key, if they are the kept ones.
    pub fn candidates(&self, key: &CandidateKey) -> Option<Arc<Candidates>> {
        let (of, candidates) = self.candidates.as_ref()?;
        (of == key).then(|| Arc::clone(candidates))
    }

    /// Keeps the candidates of the last fit only: they are large, and fits with the same key mostly follow each
    /// other.
    pub fn keep_candidates(&mut self, key: CandidateKey, candidates: Option<Arc<Candidates>>) {
        self.candidates = candidates.map(|candidates| (key, candidates));
    }

    /// [`samples::take`] with reuse.
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

    /// [`Transfer::new`] with reuse: the matrix depends on the positions of the samples, not on their light.
    /// Light-grid samples come last and get no row of their own.
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
