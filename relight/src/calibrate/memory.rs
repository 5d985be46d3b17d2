//! What ways of looking for a map's light have in common: which measurements are taken, and what these see of each other. Most
//! ways take the same, so that it is traced once.

use super::Evidence;
use super::bounce::Transfer;
use super::bvh::Occluders;
use super::samples::{self, Sample, Site, Taking};
use crate::world::RelitWorld;

/// What was traced for other ways.
#[derive(Default)]
pub(super) struct Memory {
    taken: Vec<Taken>,
    seen: Vec<Seen>,
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
