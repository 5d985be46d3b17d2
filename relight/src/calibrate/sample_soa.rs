//! Samples as a structure of arrays: four at a time are tested for distance and orientation towards a light.
//!
//! Most samples fail the test; the rest are processed one by one.

use super::samples::Sample;
use glam::{Vec3, Vec4};
use support::simd4::{self, Four, WIDE, dot, four, lanes, splat};

/// Squared distance below which a light gives nothing, square id units.
pub(super) const NEAREST: f32 = 1.0;

/// Four samples.
struct Group {
    positions: Four,
    normals: Four,
    /// Stored light plus floor, mean of the channels; infinite for held-out samples and empty lanes.
    levels: Vec4,
}

/// Samples and their structure of arrays.
pub(super) struct SampleSoa<'a> {
    pub samples: &'a [Sample],
    groups: Vec<Group>,
}

impl<'a> SampleSoa<'a> {
    /// The structure for these samples.
    pub fn new(samples: &'a [Sample]) -> SampleSoa<'a> {
        let level = |sample: &Sample| match sample.held_out {
            true => f32::INFINITY,
            false => sample.level() + sample.floor,
        };
        let group = |of: &[Sample]| {
            let mut levels = [f32::INFINITY; WIDE];
            for (slot, sample) in levels.iter_mut().zip(of) {
                *slot = level(sample);
            }
            Group {
                positions: four(of.iter().map(|s| s.position)),
                normals: four(of.iter().map(|s| s.normal)),
                levels: Vec4::from_array(levels),
            }
        };
        SampleSoa {
            samples,
            groups: samples.chunks(WIDE).map(group).collect(),
        }
    }

    /// Samples within `range` that face a light at `origin`, in order.
    pub fn facing(&self, origin: Vec3, range: f32) -> impl Iterator<Item = (u32, &Sample)> {
        let from = splat(origin);
        let (nearest, farthest) = (Vec4::splat(NEAREST), Vec4::splat(range * range));
        self.masked(move |group| {
            let offset = simd4::sub(&from, &group.positions);
            let squared = dot(&offset, &offset);
            let lit = dot(&group.normals, &offset).cmpgt(Vec4::ZERO);
            (lit & squared.cmpge(nearest) & squared.cmple(farthest)).bitmask()
        })
    }

    /// Fitted samples to which a light of this intensity, moved by up to `margin`, may give `part` of their light,
    /// in order.
    pub fn within_reach(
        &self,
        origin: Vec3,
        intensity: f32,
        margin: f32,
        part: f32,
    ) -> impl Iterator<Item = u32> {
        let from = splat(origin);
        let (behind, far) = (Vec4::splat(-margin), Vec4::splat(4.0 * margin * margin));
        // Beyond twice the move, at least half of the distance remains; the factor 4 covers it, and .001 the
        // rounding.
        let power = Vec4::splat(intensity * 4.001);
        let near = self.masked(move |group| {
            let offset = simd4::sub(&from, &group.positions);
            let squared = dot(&offset, &offset);
            let before = dot(&offset, &group.normals).cmpgt(behind);
            let reached = (group.levels * part * squared).cmplt(power);
            (before & (squared.cmple(far) | reached)).bitmask()
        });
        let reached = move |sample: &Sample| {
            let least = (sample.level() + sample.floor) * part;
            let distance = (sample.position.distance(origin) - margin).max(1.0);
            !sample.held_out && intensity > least * distance * distance
        };
        near.filter(move |(_, sample)| reached(sample))
            .map(|(i, _)| i)
    }

    /// Samples whose bit is set in the mask of their group, in order.
    fn masked(&self, mask: impl Fn(&Group) -> u32) -> impl Iterator<Item = (u32, &Sample)> {
        let groups = self.groups.iter().zip(self.samples.chunks(WIDE));
        let first = (0u32..).step_by(WIDE);
        first
            .zip(groups)
            .flat_map(move |(first, (group, samples))| {
                let chosen = lanes(mask(group));
                chosen.filter_map(move |lane| Some((first + lane as u32, samples.get(lane)?)))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::samples::tests::sample_at_place;
    use support::random::Random;

    #[test]
    fn four_at_a_time_equal_one_by_one() {
        let mut random = Random::new(11);
        let mut anywhere =
            || Vec3::new(random.uniform(), random.uniform(), random.uniform()) * 400.0;
        let mut samples: Vec<Sample> = (0..203).map(|_| sample_at_place(anywhere())).collect();
        for (k, sample) in samples.iter_mut().enumerate() {
            sample.normal = (anywhere() - 200.0).normalize();
            sample.held_out = k % 5 == 0;
        }
        let soa = SampleSoa::new(&samples);
        let (mut lit, mut reached) = (0, 0);
        for (margin, intensity) in [(8.0, 900.0), (30.0, 5000.0), (90.0, 20_000.0)] {
            let origin = anywhere();
            let facing = |s: &Sample| {
                let offset = origin - s.position;
                offset.length() <= 250.0 && s.normal.dot(offset) > 0.0
            };
            let all = || (0u32..).zip(&samples);
            let wanted: Vec<u32> = all().filter(|(_, s)| facing(s)).map(|(i, _)| i).collect();
            let found: Vec<u32> = soa.facing(origin, 250.0).map(|(i, _)| i).collect();
            assert_eq!(found, wanted);
            lit += found.len();
            let part = 0.15;
            let within = |s: &Sample| {
                let least = (s.level() + s.floor) * part;
                let distance = (s.position.distance(origin) - margin).max(1.0);
                let before = (origin - s.position).dot(s.normal) > -margin;
                !s.held_out && before && intensity > least * distance * distance
            };
            let wanted: Vec<u32> = all().filter(|(_, s)| within(s)).map(|(i, _)| i).collect();
            let found: Vec<u32> = soa.within_reach(origin, intensity, margin, part).collect();
            assert_eq!(found, wanted);
            reached += found.len();
        }
        assert!(lit > 50 && (20..400).contains(&reached), "{lit} {reached}");
    }
}
