//! Light as it would be traced beside stored light, place by place, of a world as it is: calibrated or not.

use super::bounce::Transfer;
use super::samples::SamplingOptions;
use super::{CalibrationOptions, columns, compiler_command_line, samples, skies, solve};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;

/// A place where light is stored, and what lights give there. All light is irradiance / π, the outgoing radiance of a
/// white surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// A little off the surface.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Material of the surface, index into [`RelitWorld::materials`]; `u32::MAX` for points of the light grid.
    pub material: u32,
    /// Light that the map stores, without the compiler's dirt.
    pub stored: Vec3,
    /// Light that comes straight from lights.
    pub direct: Vec3,
    /// Light that comes by way of other surfaces.
    pub bounced: Vec3,
    /// Light that is the same everywhere.
    pub ambient: Vec3,
    /// Light of one step of a stored byte.
    pub step: f32,
    /// Some channel of the stored light is at its end: there was at least that much.
    pub saturated: bool,
}

impl Residual {
    /// All light that lights give.
    pub fn computed(&self) -> Vec3 {
        self.direct + self.bounced + self.ambient
    }

    /// Stops that computed light is above stored light, means of the channels; light of less than one step of a stored
    /// byte counts as one.
    pub fn stops(&self) -> f32 {
        let level = |v: Vec3| samples::mean(v).max(self.step);
        (level(self.computed()) / level(self.stored)).log2()
    }
}

/// Compares light at about `options.samples` places, chosen by `options.seed`. With another seed than fitting had they are
/// other places, though a few that were fitted may be among them. Empty for worlds that store no light. The world must have been loaded to be calibrated, or its
/// [materials measured](RelitWorld::measure_materials).
pub fn residuals(world: &RelitWorld, options: &CalibrationOptions) -> Vec<Residual> {
    let occluders = Occluders::of_world(world);
    let sampling = SamplingOptions {
        count: options.samples,
        seed: options.seed,
        few_black: false,
        dirt: compiler_command_line::dirt_of_calibrated(world),
    };
    let (samples, _) = samples::take(world, &occluders, &sampling);
    let unknown_skies = skies::unknown_skies(world);
    let mut columns = columns::known(world, &occluders, &samples, &unknown_skies);
    for column in &mut columns {
        column.apply_cutoff(world.light_cutoff);
    }
    let direct = solve::direct(&samples, &columns);
    let unlisted = |material| unknown_skies.contains(&material);
    let transfer = Transfer::new(world, &occluders, &samples, options.bounces, unlisted);
    let bounced = transfer.of(&direct, true);
    let lit = direct.into_iter().zip(bounced);
    let places = samples.iter().zip(lit);
    let residuals = places.map(|(sample, (direct, bounced))| Residual {
        position: sample.position,
        normal: sample.normal,
        material: sample.material,
        stored: sample.value,
        direct,
        bounced,
        ambient: world.ambient,
        step: samples::light_of(world, 1.0),
        saturated: sample.saturated,
    });
    residuals.collect()
}
