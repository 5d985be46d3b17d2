//! How bright a map is meant to look: the exposure at which a linear picture of it is, in the mean, as bright as the
//! engine's own.
//!
//! The engine multiplies display-encoded colours by lightmap values `v` (1 shows a texture as it is); so on the screen
//! a texture of linear albedo ρ has the linear brightness ρ · decode(v). A tracer finds the light itself, ρ · v. Over
//! a map's texels, the mean of decode(v) over the mean of v is the factor between the two; where the map's compiler
//! stored light with a gamma g, that light is ρ · v^g, and the mean is over that.

use crate::overbright;
use crate::world::RelitWorld;
use glam::Vec3;
use q3bsp::Bsp;

/// Every so many texels of a page one is taken.
const STRIDE: usize = 7;
/// Texels darker than this are what no light reached, or lie outside of any surface.
const DARK: f32 = 2.0 / 255.0;
/// Exposure of a map that has no light stored.
const DEFAULT: f32 = 0.25;
/// Bounds, so that a strange map stays visible.
const LIMITS: (f32, f32) = (0.02, 1.0);

/// Brightness of a texture, encoded: about the mean of lit surfaces in OpenArena's maps (0.13 to 0.33).
const TEXTURE: f32 = 0.2;
/// Exponent of the display's curve on a map that has no light stored.
pub(crate) const DEFAULT_EXPONENT: f32 = 1.4;

/// The exposure of a map, a factor of radiance: from its lightmaps, else from the colours of its vertices.
pub fn display_exposure(world: &RelitWorld) -> f32 {
    of_stored(&world.bsp, |light| ratio(light, world.stored_gamma)).unwrap_or(DEFAULT)
}

/// The exponent of the power law that the display's curve D comes to where a map shows its light: the mean of
/// d ln D / d ln x over the light of its lightmaps, else of its vertices, on a texture of usual brightness.
pub fn display_exponent(bsp: &Bsp) -> f32 {
    of_stored(bsp, |light| exponent(light)).unwrap_or(DEFAULT_EXPONENT)
}

/// What is found of light on lightmaps, encoded; else on vertices.
fn of_stored(
    bsp: &Bsp,
    find: impl Fn(&mut dyn Iterator<Item = [u8; 3]>) -> Option<f32>,
) -> Option<f32> {
    let mut texels = bsp
        .lightmaps
        .iter()
        .flat_map(|page| page.0.as_chunks::<3>().0.iter().step_by(STRIDE))
        .map(|&texel| overbright::shift(texel, overbright::MAP_OVERBRIGHT_BITS));
    let mut vertices = bsp.vertices.iter().map(|v| {
        let [r, g, b, _] = v.color;
        overbright::shift([r, g, b], overbright::MAP_OVERBRIGHT_BITS)
    });
    find(&mut texels).or_else(|| find(&mut vertices))
}

/// Luminance of a colour, encoded like its bytes (Rec. 709); `None` of what is dark.
fn level(rgb: [u8; 3]) -> Option<f32> {
    let value = Vec3::from_array(rgb.map(f32::from)).dot(Vec3::new(0.2126, 0.7152, 0.0722)) / 255.0;
    (value > DARK).then_some(value)
}

/// Mean decoded brightness over mean light, which is brightness to the power of `gamma`; `None` where all is dark.
fn ratio(colors: impl Iterator<Item = [u8; 3]>, gamma: f32) -> Option<f32> {
    let (mut decoded, mut stored) = (0.0_f64, 0.0_f64);
    for value in colors.filter_map(level) {
        decoded += f64::from(overbright::to_linear(value));
        stored += f64::from(value.powf(gamma));
    }
    (stored > 0.0).then(|| ((decoded / stored) as f32).clamp(LIMITS.0, LIMITS.1))
}

/// Mean of the curve's exponent; `None` where all is dark.
fn exponent(colors: impl Iterator<Item = [u8; 3]>) -> Option<f32> {
    let (mut sum, mut count) = (0.0_f64, 0usize);
    for value in colors.filter_map(level) {
        sum += f64::from(overbright::exponent(value * TEXTURE));
        count += 1;
    }
    (count > 0).then(|| (sum / count as f64) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_is_exposed_to_what_the_engine_shows() {
        // half of full brightness everywhere: shown as decode(0.5) instead of 0.5
        let value = 128.0_f32 / 255.0;
        let found = ratio(std::iter::repeat_n([128; 3], 10), 1.0).unwrap();
        assert!(
            (found - overbright::to_linear(value) / value).abs() < 1e-5,
            "{found}"
        );
        // light that was stored encoded as the display decodes it is shown as it is
        let encoded = ratio(std::iter::repeat_n([128; 3], 10), 2.2).unwrap();
        assert!((encoded - 1.0).abs() < 0.03, "{encoded}");
        assert_eq!(ratio(std::iter::repeat_n([255; 3], 4), 1.0), Some(1.0));
        assert_eq!(ratio(std::iter::empty(), 1.0), None);
        assert_eq!(ratio(std::iter::repeat_n([1, 0, 0], 4), 1.0), None);
        let curve = exponent(std::iter::repeat_n([128; 3], 10)).unwrap();
        let x = value * TEXTURE;
        let step = (overbright::to_linear(x * 1.01) / overbright::to_linear(x)).ln() / 1.01f32.ln();
        assert!((curve - step).abs() < 0.01, "{curve} {step}");
        assert_eq!(exponent(std::iter::empty()), None);
    }
}
