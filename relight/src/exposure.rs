//! How bright a map is meant to look: the exposure at which a linear picture of it is, in the mean, as bright as the
//! engine's own.
//!
//! The engine multiplies display-encoded colours by lightmap values `v` (1 shows a texture as it is); so on the screen
//! a texture of linear albedo ρ has the linear brightness ρ · decode(v). A tracer finds the light itself, ρ · v. Over
//! a map's texels, the mean of decode(v) over the mean of v is the factor between the two.

use crate::overbright;
use crate::world::RelitWorld;

/// Every so many texels of a page one is taken.
const STRIDE: usize = 7;
/// Texels darker than this are what no light reached, or lie outside of any surface.
const DARK: f32 = 2.0 / 255.0;
/// Exposure of a map that has no light stored.
const DEFAULT: f32 = 0.25;
/// Bounds, so that a strange map stays visible.
const LIMITS: (f32, f32) = (0.02, 1.0);

/// The exposure of a map, a factor of radiance: from its lightmaps, else from the colours of its vertices.
pub fn display_exposure(world: &RelitWorld) -> f32 {
    let texels = world
        .bsp
        .lightmaps
        .iter()
        .flat_map(|page| page.0.as_chunks::<3>().0.iter().step_by(STRIDE))
        .map(|&texel| overbright::shift(texel, overbright::MAP_OVERBRIGHT_BITS));
    if let Some(exposure) = ratio(texels) {
        return exposure;
    }
    let vertices = world.bsp.vertices.iter().map(|v| {
        let [r, g, b, _] = v.color;
        overbright::shift([r, g, b], overbright::MAP_OVERBRIGHT_BITS)
    });
    ratio(vertices).unwrap_or(DEFAULT)
}

/// Mean decoded brightness over mean brightness; `None` where all is dark.
fn ratio(colors: impl Iterator<Item = [u8; 3]>) -> Option<f32> {
    let (mut decoded, mut stored) = (0.0_f64, 0.0_f64);
    for [r, g, b] in colors {
        // Rec. 709 luminance
        let value = (0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)) / 255.0;
        if value > DARK {
            decoded += f64::from(overbright::to_linear(value));
            stored += f64::from(value);
        }
    }
    (stored > 0.0).then(|| ((decoded / stored) as f32).clamp(LIMITS.0, LIMITS.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_light_is_exposed_to_what_the_engine_shows() {
        // half of full brightness everywhere: shown as decode(0.5) instead of 0.5
        let value = 128.0_f32 / 255.0;
        let found = ratio(std::iter::repeat_n([128; 3], 10)).unwrap();
        assert!(
            (found - overbright::to_linear(value) / value).abs() < 1e-5,
            "{found}"
        );
        assert_eq!(ratio(std::iter::repeat_n([255; 3], 4)), Some(1.0));
        assert_eq!(ratio(std::iter::empty()), None);
        assert_eq!(ratio(std::iter::repeat_n([1, 0, 0], 4)), None);
    }
}
