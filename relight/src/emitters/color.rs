//! Colour of stored light.
//!
//! The engine multiplies textures and stored light display-encoded. With the display's curve D, a texture t and the
//! light v on it, it shows D(t v). If D were a power x^γ, that would be D(t) D(v): the linear albedo D(t) lit by
//! D(v) instead of v. The map's author therefore saw light of more saturated colours and more contrast than v.
//!
//! The contrast cannot be reproduced: lights add up in v but not in D(v), and an inverse-square light would fall
//! off with a higher power. So the *luminance* of light stays as stored, and [one exposure](crate::exposure) gives
//! the map its mean brightness. The *colour* can be: under a power law the ratio of the channels of D(v) is
//! independent of brightness, so a light has one colour everywhere. Hence
//!
//! > v' = v^γ Y(v) / Y(v^γ)
//!
//! channel by channel, with Y the luminance. sRGB's curve is not a power law; γ is its slope at the brightness that
//! a map shows: [`display_exponent`](crate::exposure::display_exponent). That depends on the map's textures, which
//! only calibration measures; until then a usual brightness is assumed, and afterwards the colours are raised
//! again.

use crate::overbright::luminance;
use glam::Vec3;

/// How colours of stored light and of directives, which are on the same scale, become colours of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightColor {
    /// As the engine shows them.
    #[default]
    Displayed,
    /// The numbers as they are: right for maps whose light is linear all the way.
    Stored,
}

/// Light with the ratios of its channels raised to `exponent` and its luminance kept. Negative channels count as
/// black; non-finite light is black.
pub(crate) fn raise(light: Vec3, exponent: f32) -> Vec3 {
    let light = light.max(Vec3::ZERO);
    let largest = light.max_element();
    if !(largest > 0.0 && light.is_finite()) {
        return Vec3::ZERO;
    }
    let raised = (light / largest).powf(exponent);
    raised * (luminance(light) / luminance(raised))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_raised_and_luminance_stays() {
        let light = Vec3::new(0.8, 0.4, 0.2) * 3.0;
        let raised = raise(light, 2.0);
        assert!((luminance(raised) / luminance(light) - 1.0).abs() < 1e-5);
        assert!((raised.x / raised.y - 4.0).abs() < 1e-4, "{raised}");
        assert!((raised.y / raised.z - 4.0).abs() < 1e-4, "{raised}");
        // The same colour at every brightness, and none where there is none.
        assert!((raise(light * 1e-3, 2.0) * 1e3 - raised).length() < 1e-4);
        assert!((raise(Vec3::splat(0.3), 2.2) - 0.3).length() < 1e-6);
        assert!((raise(light, 1.0) - light).length() < 1e-6);
        assert_eq!(raise(Vec3::new(0.0, 7.0, 0.0), 2.0), Vec3::Y * 7.0);
        for strange in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::NEG_ONE] {
            assert_eq!(raise(strange, 2.0), Vec3::ZERO);
        }
    }
}
