//! Light to the bytes that maps store.

use super::page::light_bytes;
use crate::emitters::raise;
use crate::world::RelitWorld;
use glam::Vec3;

/// Overbright factor of stored light: a byte of 255 shows light of this value on white.
const OVERBRIGHT: f32 = 4.0;

/// How light becomes bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoding {
    /// Light of a byte of 255, irradiance over π.
    pub full: f32,
    /// Gamma g: light v gives a byte of 255 (v / full)^(1 / g).
    pub gamma: f32,
    /// Divisor of the value after gamma: q3map2's `-compensate`, for engines without overbright bits.
    pub compensate: f32,
    /// Whether values are half a step lower, so that the bytes after rounding are those that q3map2 cuts off.
    pub truncates: bool,
    /// Whether the factor of a material follows gamma, as in q3map2 since 2.5.17n; before, gamma followed it.
    pub scales_last: bool,
    /// Exponent that ratios of the channels were raised to when the world was loaded.
    pub exponent: f32,
}

impl Encoding {
    /// The one that inverts how calibration reads a world's stored light; for a world that is not calibrated: bytes in
    /// proportion to light, as a compiler stores them.
    pub fn of(world: &RelitWorld) -> Encoding {
        Encoding {
            // the unit of calibrated light is display white for any gamma
            full: OVERBRIGHT.powf(world.stored_gamma),
            gamma: world.stored_gamma,
            compensate: 1.0,
            truncates: world.calibration.is_none(),
            scales_last: world.calibration.is_none(),
            exponent: world.color_exponent / world.stored_gamma,
        }
    }

    /// Sets the gamma of a compiler, which leaves a byte of 255 as it is.
    pub fn set_gamma(&mut self, gamma: f32) {
        (self.full, self.gamma, self.exponent) = (OVERBRIGHT, gamma, 1.0);
    }

    /// Stored value of light (irradiance over π), 1 for a byte of 255. `scale`: factor of the material
    /// ([`WorldMaterial::stored_scale`]).
    ///
    /// [`WorldMaterial::stored_scale`]: crate::WorldMaterial::stored_scale
    pub fn stored(&self, light: Vec3, scale: f32) -> Vec3 {
        let light = match self.exponent == 1.0 {
            true => light.max(Vec3::ZERO),
            false => raise(light, self.exponent.recip()),
        };
        let (before, after) = match self.scales_last {
            true => (1.0, scale),
            false => (scale, 1.0),
        };
        let part = light * before / self.full;
        let encoded = match self.gamma == 1.0 {
            true => part,
            false => part.powf(self.gamma.recip()),
        };
        let value = encoded * after / self.compensate;
        // rounded later
        match self.truncates {
            true => (value - 0.5 / 255.0).max(Vec3::ZERO),
            false => value,
        }
    }

    /// Bytes of light. A colour with a channel above 255 is scaled down whole, so that its hue stays.
    pub fn bytes(&self, light: Vec3, scale: f32) -> [u8; 3] {
        light_bytes(self.stored(light, scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Encoding = Encoding {
        full: OVERBRIGHT,
        gamma: 1.0,
        compensate: 1.0,
        truncates: false,
        scales_last: true,
        exponent: 1.0,
    };

    #[test]
    fn bytes_are_in_proportion_to_light_and_keep_their_hue() {
        assert_eq!(PLAIN.bytes(Vec3::new(1.0, 0.5, 0.0), 1.0), [64, 32, 0]);
        assert_eq!(PLAIN.bytes(Vec3::new(8.0, 4.0, 2.0), 1.0), [255, 128, 64]);
        assert_eq!(PLAIN.bytes(Vec3::new(f32::NAN, -1.0, 0.1), 1.0)[1], 0);
        let half = Encoding {
            compensate: 2.0,
            ..PLAIN
        };
        assert_eq!(half.bytes(Vec3::ONE, 1.0), [32; 3]);
        let cut_off = Encoding {
            truncates: true,
            ..PLAIN
        };
        let step = 4.0 / 255.0;
        let found = cut_off.bytes(Vec3::new(7.9, 3.1, 0.4) * step, 1.0);
        assert_eq!(found, [7, 3, 0]);
    }

    #[test]
    fn gamma_is_that_which_calibration_inverts() {
        let encoding = Encoding {
            full: OVERBRIGHT * OVERBRIGHT,
            gamma: 2.0,
            ..PLAIN
        };
        for value in [3u8, 40, 130, 255] {
            let light = (f32::from(value) * OVERBRIGHT / 255.0).powf(2.0);
            assert_eq!(encoding.bytes(Vec3::splat(light), 1.0), [value; 3]);
        }
        let light = Vec3::splat((100.0 * OVERBRIGHT / 255.0).powf(2.0));
        assert_eq!(encoding.bytes(light, 0.25), [25; 3]);
        let scaled_first = Encoding {
            scales_last: false,
            ..encoding
        };
        assert_eq!(scaled_first.bytes(light, 0.25), [50; 3]);
    }
}
