//! Candidates for lights in front of samples with a large residual.
//!
//! Positions recur in later rounds; their rows are kept.

use super::columns::{Column, point_rows};
use super::placement::{RANGE, Scene, lamp};
use super::sample_soa::SampleSoa;
use super::samples::{self, mean};
use super::solve::Residual;
use glam::Vec3;
use std::collections::HashMap;
use support::parallel;

/// Distances of candidates from their sample, id units.
const DISTANCES: [f32; 4] = [12.0, 28.0, 60.0, 120.0];

/// Residual relative to the stored light from which a sample gets candidates.
const UNEXPLAINED: f32 = 0.25;

/// Candidate positions with their rows for the first samples of a fit, which do not change.
pub(super) struct ResidualCandidates {
    first: usize,
    known: HashMap<[u32; 3], CachedRows>,
}

/// Rows and limit of a candidate.
struct CachedRows {
    /// (sample, irradiance over π for strength 1).
    rows: Vec<(u32, f32)>,
    /// Upper bound of the strength.
    limit: Vec3,
}

impl ResidualCandidates {
    /// No candidates; the fit starts with `first` samples.
    pub fn new(first: usize) -> ResidualCandidates {
        ResidualCandidates {
            first,
            known: HashMap::new(),
        }
    }

    /// Columns of candidates in front of samples with a large residual, worst sample first. Candidates that reach
    /// no sample are left out.
    pub fn candidates(&mut self, scene: &Scene<'_>, state: &Residual) -> Vec<Column> {
        let positions = positions_in_front(scene, state);
        let samples = scene.soa.samples;
        let (first, more) = samples.split_at(self.first.min(samples.len()));
        let rows = |soa: &SampleSoa<'_>, at| {
            let (bsp, occluders) = (&scene.world.bsp, scene.occluders);
            point_rows(bsp, occluders, soa, lamp(at), None, RANGE)
        };
        let (first_soa, more_soa) = (SampleSoa::new(first), SampleSoa::new(more));
        let new: Vec<Vec3> = (positions.iter().copied())
            .filter(|at| !self.known.contains_key(&key(*at)))
            .collect();
        let found = parallel::map(&new, |_, &at| CachedRows {
            rows: rows(&first_soa, at),
            limit: scene.limit(lamp(at)),
        });
        self.known.extend(new.into_iter().map(key).zip(found));
        let columns = parallel::map(&positions, |_, &at| {
            let cached = self.known.get(&key(at))?;
            let after = |(i, a)| (first.len() as u32 + i, a);
            let joined = rows(&more_soa, at).into_iter().map(after);
            let rows: Vec<(u32, f32)> = cached.rows.iter().copied().chain(joined).collect();
            (!rows.is_empty()).then(|| scene.limited(lamp(at), rows, Vec3::ZERO, cached.limit))
        });
        columns.into_iter().flatten().collect()
    }
}

/// Open positions in front of samples with a large residual, worst sample first.
fn positions_in_front(scene: &Scene<'_>, state: &Residual) -> Vec<Vec3> {
    let mut worst: Vec<(f32, usize)> = (scene.soa.samples)
        .iter()
        .zip(&state.rest)
        .enumerate()
        .filter(|(_, (s, _))| !s.held_out && s.site == samples::Site::Surface)
        .map(|(i, (s, rest))| (mean(*rest) / (s.level() + s.floor), i))
        .filter(|(missing, _)| *missing > UNEXPLAINED)
        .collect();
    worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let positions = worst.into_iter().flat_map(|(_, i)| {
        let sample = scene.soa.samples.get(i);
        DISTANCES.into_iter().filter_map(move |distance| {
            let sample = sample?;
            Some((sample.position, sample.position + sample.normal * distance))
        })
    });
    positions
        .filter(|&(from, at)| scene.sees(from, at) && scene.open(at))
        .map(|(_, at)| at)
        .take(scene.candidates)
        .collect()
}

/// Key of a position.
fn key(at: Vec3) -> [u32; 3] {
    at.to_array().map(f32::to_bits)
}
