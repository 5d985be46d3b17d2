//! Computed and stored light at single positions of a world, calibrated or not.

use super::bounce::Transfer;
use super::samples::SamplingOptions;
use super::{CalibrationOptions, columns, compiler_command_line, samples, skies, solve};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;

/// Stored and computed light at a position. All light is irradiance over π, the outgoing radiance of a white
/// surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Slightly above the surface, id units.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Index into [`RelitWorld::materials`]; `u32::MAX` for points of the light grid.
    pub material: u32,
    /// Stored light with the compiler's dirt removed.
    pub stored: Vec3,
    /// Direct light.
    pub direct: Vec3,
    /// Reflected light.
    pub bounced: Vec3,
    /// Ambient term.
    pub ambient: Vec3,
    /// Light of one step of a stored byte.
    pub step: f32,
    /// Whether a channel of the stored light is 255: the light was at least that.
    pub saturated: bool,
}

impl Residual {
    /// Sum of direct, reflected and ambient light.
    pub fn computed(&self) -> Vec3 {
        self.direct + self.bounced + self.ambient
    }

    /// Computed over stored light, means of the channels, stops; light below one step of a byte counts as one step.
    pub fn stops(&self) -> f32 {
        let level = |v: Vec3| samples::mean(v).max(self.step);
        (level(self.computed()) / level(self.stored)).log2()
    }
}

/// Compares light at about `options.samples` positions chosen by `options.seed`. Another seed than that of the fit
/// gives other positions; a few of them may have been fitted. Empty for worlds without stored light.
///
/// The world's [materials must be measured](RelitWorld::measure_materials), which loading for calibration does.
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
