//! How bright a map is meant to look: the exposure at which a linear picture of it is, in the mean, as bright as the
//! engine's own.
//!
//! The engine multiplies textures t and stored light v as both are encoded for the display, at most 1; shown is D(t v),
//! with D the display's curve. A tracer finds the light L itself, and shows T(e D(t) L), with T the tone curve. Were D a
//! power, D(t v) would be D(t) D(v), and e would not depend on textures: mean D(v) over mean v. It is not: e is found such
//! that the means of both agree, over what players see where the game sets them and over the pixels of the textures there
//! ([`matching`]). L is the light of the lights that calibration found: what comes out too bright in the mean is exposed
//! less.
//!
//! Without such light ([`display_exposure`] of a world that nobody calibrated) there is the mean of D(v) over the mean of
//! v; where the map's compiler stored light with a gamma g, that light is v^g, and the mean is over that.

use crate::light::Shade;
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
/// Bounds of an exposure that light and textures tell.
const MATCHED: (f32, f32) = (0.005, 8.0);
/// Steps in which it is found, at most.
const STEPS: u32 = 32;
/// How near the means must come.
const NEAR: f32 = 1e-3;
/// Below this the picture is linear: the knee of the tone curve, as in `tonemap.comp`.
const KNEE: f32 = 0.6;

/// Brightness of a texture, encoded: about the mean of lit surfaces in OpenArena's maps (0.13 to 0.33).
const TEXTURE: f32 = 0.2;
/// Exponent of the display's curve on a map that has no light stored.
pub(crate) const DEFAULT_EXPONENT: f32 = 1.4;

/// A place where light is stored, and what the world's lights give there.
pub(crate) struct Place<'a> {
    /// Stored light as the engine shows it on a white surface, encoded, at most 1.
    pub stored: Vec3,
    /// Light that the world's lights give, linear.
    pub light: Vec3,
    /// What the surface throws back; nothing known: of usual brightness.
    pub shades: &'a [Shade],
}

/// Whether a number can have been found by [`matching`].
pub(crate) fn possible(exposure: f32) -> bool {
    (MATCHED.0..=MATCHED.1).contains(&exposure)
}

/// Luminance of linear colours (Rec. 709).
fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// What the traced look shows of an exposed radiance, linear: see `tonemap.comp`.
fn tone(x: f32) -> f32 {
    if x < KNEE {
        x
    } else {
        1.0 - (1.0 - KNEE) * (-(x - KNEE) / (1.0 - KNEE)).exp()
    }
}

/// The exposure at which places are as bright in the mean, traced, as the engine shows them; `None` where all is dark.
pub(crate) fn matching<'a>(places: impl Iterator<Item = Place<'a>>) -> Option<f32> {
    let usual = [Shade {
        linear: Vec3::splat(overbright::to_linear(TEXTURE)),
        encoded: Vec3::splat(TEXTURE),
    }];
    let mut engine = 0.0f64;
    let mut traced: Vec<(Vec3, f32)> = Vec::new();
    for place in places {
        let shades = if place.shades.is_empty() {
            &usual
        } else {
            place.shades
        };
        let part = 1.0 / shades.len() as f32;
        for shade in shades {
            let shown = overbright::colour_to_linear((shade.encoded * place.stored).min(Vec3::ONE));
            engine += f64::from(luminance(shown) * part);
            traced.push((shade.linear * place.light, part));
        }
    }
    let mean = |exposure: f32| -> f64 {
        let shown = |(radiance, part): &(Vec3, f32)| {
            let shown = (*radiance * exposure).to_array().map(tone);
            f64::from(luminance(Vec3::from_array(shown)) * part)
        };
        traced.iter().map(shown).sum()
    };
    // The curve bends downwards only: each step comes nearer from the same side.
    let mut exposure = DEFAULT;
    for _ in 0..STEPS {
        let ratio = (engine / mean(exposure)) as f32;
        if !(ratio.is_finite() && ratio > 0.0) {
            return None;
        }
        exposure = (exposure * ratio).clamp(MATCHED.0, MATCHED.1);
        if (ratio - 1.0).abs() < NEAR {
            return Some(exposure);
        }
    }
    // No exposure does: most of what is lit has no light.
    None
}

/// The exposure of a map, a factor of radiance: what calibration found; else from its lightmaps, or from the colours of
/// its vertices.
pub fn display_exposure(world: &RelitWorld) -> f32 {
    if let Some(exposure) = world.exposure {
        return exposure;
    }
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
    fn places_are_exposed_to_what_the_engine_shows() {
        let found = |places: &[(f32, f32, &[f32])]| {
            let shades: Vec<Vec<Shade>> = places
                .iter()
                .map(|(.., textures)| {
                    let shade = |&t: &f32| Shade {
                        linear: Vec3::splat(overbright::to_linear(t)),
                        encoded: Vec3::splat(t),
                    };
                    textures.iter().map(shade).collect()
                })
                .collect();
            matching(
                places
                    .iter()
                    .zip(&shades)
                    .map(|(&(stored, light, _), shades)| Place {
                        stored: Vec3::splat(stored),
                        light: Vec3::splat(light),
                        shades,
                    }),
            )
        };
        let shown = |t: f32, v: f32| overbright::to_linear(t * v);
        let near = |found: Option<f32>, meant: f32| {
            let found = found.unwrap();
            assert!((found / meant - 1.0).abs() < 1e-3, "{found} {meant}");
        };
        // On white it is the curve alone; on a dark texture the curve is straighter.
        near(found(&[(0.5, 0.5, &[1.0])]), shown(1.0, 0.5) / 0.5);
        let dark = shown(0.2, 0.5) / (shown(0.2, 1.0) * 0.5);
        near(found(&[(0.5, 0.5, &[0.2])]), dark);
        assert!(dark > 1.2 * shown(1.0, 0.5) / 0.5);
        // Dark and bright pixels each count for what they show, and so do places.
        let both =
            (shown(0.2, 0.5) + shown(0.6, 0.5)) / (0.5 * (shown(0.2, 1.0) + shown(0.6, 1.0)));
        near(found(&[(0.5, 0.5, &[0.2, 0.6])]), both);
        near(found(&[(0.5, 0.5, &[0.2]), (0.5, 0.5, &[0.6])]), both);
        // The engine shows no more than white: three times as much light is exposed a third.
        near(found(&[(1.0, 3.0, &[0.4])]), 1.0 / 3.0);
        // The tone curve takes from what is bright, which is made up for.
        let white = found(&[(0.95, 0.95, &[1.0])]).unwrap();
        assert!((tone(white * 0.95) / shown(1.0, 0.95) - 1.0).abs() < 1e-3);
        assert_eq!(found(&[]), None);
        assert_eq!(found(&[(0.0, 1.0, &[0.5])]), None);
        assert_eq!(found(&[(0.5, 0.0, &[0.5])]), None);
        assert!(found(&[(0.5, 0.5, &[])]).is_some());
    }

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
