//! Candidates for lost lights in front of samples that stay unexplained.
//!
//! Where much stays unexplained, places come up again in later rounds: what they see is kept.

use super::columns::{Column, point_rows};
use super::placement::{RANGE, Scene, lamp};
use super::sample_soa::SampleSoa;
use super::samples::{self, mean};
use super::solve::Residual;
use glam::Vec3;
use std::collections::HashMap;
use support::parallel;

/// Distances from a sample at which candidates are put in front of it, id units.
const DISTANCES: [f32; 4] = [12.0, 28.0, 60.0, 120.0];

/// What stays unexplained of a sample's light, a part of it, that asks for a light in front of it.
const UNEXPLAINED: f32 = 0.25;

/// Places that were looked at, and what they see of the first samples of a fit, which stay the same.
pub(super) struct ResidualCandidates {
    first: usize,
    known: HashMap<[u32; 3], CachedRows>,
}

/// A place that was looked at.
struct CachedRows {
    /// (sample, light there for strength 1).
    rows: Vec<(u32, f32)>,
    /// The most that a light may be there.
    limit: Vec3,
}

impl ResidualCandidates {
    /// None so far, of a fit with so many samples at first.
    pub fn new(first: usize) -> ResidualCandidates {
        ResidualCandidates {
            first,
            known: HashMap::new(),
        }
    }

    /// Columns of lights in front of what stays unexplained, the worst first; such as reach nothing are left out.
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

/// Places in front of bright samples that are not explained, the worst first.
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

/// What tells places apart.
fn key(at: Vec3) -> [u32; 3] {
    at.to_array().map(f32::to_bits)
}
