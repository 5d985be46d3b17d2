//! Which colour stored light has.
//!
//! The engine multiplies textures and stored light as they are encoded for the display. With D the display's curve, t
//! a texture and v the light on it, shown is D(t v); were D a power x^γ, that would be D(t) D(v): the linear albedo
//! D(t) lit by D(v), not by v. So what the map's author saw is light of stronger colours than v has, and of more
//! contrast.
//!
//! Contrast cannot be followed: lights add up in v, in D(v) they do not, and a light of the square of the distance
//! would fall off with a higher power. So *how bright* light is stays as it is stored, and
//! [one exposure](crate::exposure) makes a map as bright as it was, in the mean. *Which colour* it has can be: under a
//! power law the ratio of the channels of D(v) does not depend on brightness, so that a light has one colour wherever it
//! falls. Hence
//!
//! > v' = v^γ Y(v) / Y(v^γ)
//!
//! channel by channel, with Y the luminance. sRGB's curve is no power law; γ is what its slope is at the brightnesses
//! that a map shows: [`display_exponent`](crate::exposure::display_exponent). That depends on its textures, which only
//! calibration measures: until then they count as usually bright, and then the lights are raised anew.

use crate::overbright::luminance;
use glam::Vec3;

/// How the colours of stored light, and of directives, which are numbers of the same kind, become colours of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LightColor {
    /// As the engine shows them.
    #[default]
    Displayed,
    /// The numbers as they are: right for maps whose light is linear all the way.
    Stored,
}

/// Light whose channels have ratios raised to `exponent`, and the luminance that it had. Negative channels count as
/// black; what is not finite is black.
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
