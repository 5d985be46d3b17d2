//! Exposure of a map: the factor at which the linear picture has the mean brightness of the engine's picture.
//!
//! The engine multiplies textures t and stored light v, both display-encoded and at most 1, and shows D(t v) with
//! the display's curve D. The tracer computes the light L and shows T(e D(t) L) with the tone curve T. If D were a
//! power, D(t v) would be D(t) D(v), and e would be mean D(v) over mean v, independent of textures. It is not, so e
//! is solved for equal means over the views from the spawn points and over the pixels of the textures there
//! ([`matching`]). L is the calibrated light: light that is too bright in the mean lowers the exposure. Mirrors
//! show the mean of all these pixels.
//!
//! Automatic exposure moves a picture towards the usual brightness of its map ([`Exposure::middle`]), computed from
//! the same pixels.
//!
//! Without calibrated light ([`display_exposure`](crate::RelitWorld::display_exposure)) e is mean D(v) over mean v,
//! with v^g in the denominator if the compiler stored light with a gamma g.

use crate::emitters::Shade;
use crate::overbright::{self, luminance};
use glam::Vec3;
use q3bsp::{Bsp, Lightmap};

/// One texel of a page in this many is used.
const STRIDE: usize = 7;
/// Encoded brightness below which texels are ignored: unlit, or outside any surface.
const DARK: f32 = 2.0 / 255.0;
/// Exposure of a map without stored light.
const DEFAULT: f32 = 0.25;
/// Bounds of an exposure from stored light, so that an unusual map stays visible.
const LIMITS: (f32, f32) = (0.02, 1.0);
/// Usual luminance of a picture, logarithmic mean, linear.
const MIDDLE: f32 = 0.02;
/// Smallest luminance of a pixel, stops: the end of the renderer's histogram.
pub const DARKEST: f32 = -12.0;
/// Part of the darkest pixels that automatic exposure leaves out.
pub const DARK_PART: f32 = 0.2;
/// Part of the brightest pixels that automatic exposure leaves out.
pub const BRIGHT_PART: f32 = 0.05;
/// Bounds of an exposure from calibrated light.
const MATCHED: (f32, f32) = (0.005, 8.0);
/// Largest number of iterations.
const STEPS: u32 = 32;
/// Relative tolerance of the means.
const NEAR: f32 = 1e-3;
/// Knee of the tone curve, below which it is linear.
const KNEE: f32 = 0.6;

/// Largest ratio of computed to stored light in the mean, where the stored light is not clipped. More than this is
/// an error of a light's position or shape, and must not darken the rest.
const MOST_OVER: f32 = 2.0;
/// Encoded stored light from which it may be clipped.
const CUT_OFF: f32 = 0.99;

/// Assumed encoded brightness of unmeasured textures: about the mean of lit surfaces in OpenArena's maps (0.13 to
/// 0.33).
const TEXTURE: f32 = 0.2;
/// Exponent of the display's curve for a map without stored light.
pub(crate) const DEFAULT_EXPONENT: f32 = 1.4;

/// Exposure of a map.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Exposure {
    /// Factor of radiance.
    pub scale: f32,
    /// Usual brightness of the map as the engine shows it: logarithmic mean of luminance, stops, without the pixels
    /// that automatic exposure leaves out.
    pub middle: f32,
}

impl Exposure {
    /// An exposure with the usual brightness of OpenArena's maps, for uncalibrated worlds.
    pub fn usual(scale: f32) -> Exposure {
        Exposure {
            scale,
            middle: MIDDLE.log2(),
        }
    }

    /// Whether calibration can have found it.
    pub(crate) fn is_possible(&self) -> bool {
        (MATCHED.0..=MATCHED.1).contains(&self.scale) && (DARKEST..=0.0).contains(&self.middle)
    }
}

/// Stored and computed light at a position.
pub(crate) struct LitSample<'a> {
    /// Stored light as the engine shows it on a white surface, encoded, at most 1.
    pub stored: Vec3,
    /// Light that the world's lights give, linear.
    pub light: Vec3,
    /// What the surface throws back; nothing known: of usual brightness.
    pub shades: &'a [Shade],
}

/// Tone curve of the traced look, linear output. `shaders/trace/tone_curve.glsl` has its source.
pub fn tone_curve(x: f32) -> f32 {
    if x < KNEE {
        x
    } else {
        1.0 - (1.0 - KNEE) * (-(x - KNEE) / (1.0 - KNEE)).exp()
    }
}

/// The exposure at which samples have the same mean brightness traced as in the engine; `None` if all are dark.
pub(crate) fn matching<'a>(places: impl Iterator<Item = LitSample<'a>>) -> Option<Exposure> {
    let usual = [Shade {
        linear: Vec3::splat(overbright::to_linear(TEXTURE)),
        encoded: Vec3::splat(TEXTURE),
        mirrored: Vec3::ZERO,
    }];
    let mut engine = 0.0f64;
    let mut shown_by_engine: Vec<(f32, f32)> = Vec::new();
    let mut traced: Vec<(Vec3, Vec3, f32)> = Vec::new();
    for place in places {
        let shades = if place.shades.is_empty() {
            &usual
        } else {
            place.shades
        };
        let part = 1.0 / shades.len() as f32;
        let light = bounded_light(&place);
        for shade in shades {
            let shown = overbright::colour_to_linear((shade.encoded * place.stored).min(Vec3::ONE));
            engine += f64::from(luminance(shown) * part);
            shown_by_engine.push((luminance(shown), part));
            traced.push((shade.linear * light, shade.mirrored, part));
        }
    }
    let surroundings = surroundings(&traced);
    let mean = |exposure: f32| -> f64 {
        let shown = |(own, mirrored, part): &(Vec3, Vec3, f32)| {
            let radiance = *own + *mirrored * surroundings;
            let shown = (radiance * exposure).to_array().map(tone_curve);
            f64::from(luminance(Vec3::from_array(shown)) * part)
        };
        traced.iter().map(shown).sum()
    };
    // The curve is concave: the iteration converges monotonically.
    let mut exposure = DEFAULT;
    for _ in 0..STEPS {
        let ratio = (engine / mean(exposure)) as f32;
        if !(ratio.is_finite() && ratio > 0.0) {
            return None;
        }
        exposure = (exposure * ratio).clamp(MATCHED.0, MATCHED.1);
        if (ratio - 1.0).abs() < NEAR {
            let middle = middle(shown_by_engine);
            return Some(Exposure {
                scale: exposure,
                middle,
            });
        }
    }
    // No solution: most of what is lit has no computed light.
    None
}

/// Computed light of a sample, bounded relative to the stored light.
fn bounded_light(place: &LitSample<'_>) -> Vec3 {
    let most = MOST_OVER * luminance(place.stored).max(DARK);
    let found = luminance(place.light);
    if found <= most || place.stored.max_element() > CUT_OFF {
        return place.light;
    }
    place.light * (most / found)
}

/// Weighted logarithmic mean of luminances as automatic exposure computes it, stops.
fn middle(mut pixels: Vec<(f32, f32)>) -> f32 {
    pixels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = pixels.iter().map(|(_, part)| f64::from(*part)).sum();
    let (from, to) = (
        whole * f64::from(DARK_PART),
        whole * f64::from(1.0 - BRIGHT_PART),
    );
    let (mut below, mut sum) = (0.0, 0.0);
    for (luminance, part) in pixels {
        let above = below + f64::from(part);
        let inside = (above.min(to) - f64::max(below, from)).max(0.0);
        sum += inside * f64::from(luminance.log2().clamp(DARKEST, 0.0));
        below = above;
    }
    (sum / (to - from)) as f32
}

/// Largest mean mirror reflectance, so that mutual reflections stay finite.
const MOST_MIRRORED: f32 = 0.9;

/// Mean radiance that mirrors show, from (own radiance, mirrored part, weight) of pixels, including mutual
/// reflections.
fn surroundings(pixels: &[(Vec3, Vec3, f32)]) -> Vec3 {
    let whole: f32 = pixels.iter().map(|(.., part)| part).sum();
    let mean = |of: fn(&(Vec3, Vec3, f32)) -> Vec3| {
        let sum: Vec3 = pixels.iter().map(|pixel| of(pixel) * pixel.2).sum();
        sum / whole.max(1.0)
    };
    let (own, mirrored) = (mean(|pixel| pixel.0), mean(|pixel| pixel.1));
    own / (1.0 - mirrored.min(Vec3::splat(MOST_MIRRORED)))
}

/// Exposure of an uncalibrated map from its lightmaps or vertex colours. `pages`: further lightmaps; `gamma`: the
/// compiler's gamma.
pub(crate) fn of_stored_light(bsp: &Bsp, pages: &[Lightmap], gamma: f32) -> Exposure {
    let found = of_stored(bsp, pages, |light| ratio(light, gamma));
    Exposure::usual(found.unwrap_or(DEFAULT))
}

/// Surfaces with textures of one brightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Texture {
    /// Luminance, encoded.
    pub brightness: f32,
    /// Square id units.
    pub area: f32,
}

/// Exponent of the power law that approximates the display's curve D where a map shows light: the mean of d ln D /
/// d ln x over x = t v, for the light v of its lightmaps and `pages`, else of its vertices, on each of its
/// `textures` t, weighted by x. Without textures a usual brightness is assumed.
pub(crate) fn display_exponent(bsp: &Bsp, pages: &[Lightmap], textures: &[Texture]) -> f32 {
    of_stored(bsp, pages, |light| exponent(light, textures)).unwrap_or(DEFAULT_EXPONENT)
}

/// A result from encoded lightmap colours, else from vertex colours.
fn of_stored(
    bsp: &Bsp,
    pages: &[Lightmap],
    find: impl Fn(&mut dyn Iterator<Item = [u8; 3]>) -> Option<f32>,
) -> Option<f32> {
    let some = |page: &'_ Lightmap| {
        let texels = page.0.as_chunks::<3>().0.iter().step_by(STRIDE);
        texels.copied().collect::<Vec<_>>()
    };
    let own = (bsp.lightmaps.iter().flat_map(some))
        .map(|texel| overbright::shift(texel, overbright::MAP_OVERBRIGHT_BITS));
    let mut texels = own.chain(pages.iter().flat_map(some));
    let mut vertices = bsp.vertices.iter().map(|v| {
        let [r, g, b, _] = v.color;
        overbright::shift([r, g, b], overbright::MAP_OVERBRIGHT_BITS)
    });
    find(&mut texels).or_else(|| find(&mut vertices))
}

/// Encoded luminance of an encoded colour (Rec. 709 weights); `None` if dark.
fn level(rgb: [u8; 3]) -> Option<f32> {
    let value = luminance(Vec3::from_array(rgb.map(f32::from))) / 255.0;
    (value > DARK).then_some(value)
}

/// Mean decoded brightness over mean light, which is brightness to the power of `gamma`; `None` if all is dark.
fn ratio(colors: impl Iterator<Item = [u8; 3]>, gamma: f32) -> Option<f32> {
    let (mut decoded, mut stored) = (0.0_f64, 0.0_f64);
    for value in colors.filter_map(level) {
        decoded += f64::from(overbright::to_linear(value));
        stored += f64::from(value.powf(gamma));
    }
    (stored > 0.0).then(|| ((decoded / stored) as f32).clamp(LIMITS.0, LIMITS.1))
}

/// Mean exponent of the curve; `None` if all is dark.
fn exponent(colors: impl Iterator<Item = [u8; 3]>, textures: &[Texture]) -> Option<f32> {
    let usual = [Texture {
        brightness: TEXTURE,
        area: 1.0,
    }];
    let textures = match textures {
        [] => &usual,
        some => some,
    };
    let mut levels = [0.0_f64; 256];
    for value in colors.filter_map(level) {
        if let Some(count) = levels.get_mut((value * 255.0).round() as usize) {
            *count += 1.0;
        }
    }
    let (mut sum, mut whole) = (0.0, 0.0);
    for (byte, count) in levels.iter().enumerate() {
        for texture in textures {
            let shown = (texture.brightness * byte as f32 / 255.0).min(1.0);
            let weight = count * f64::from(texture.area) * f64::from(shown);
            sum += weight * f64::from(overbright::exponent(shown));
            whole += weight;
        }
    }
    (whole > 0.0).then(|| (sum / whole) as f32)
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
                        mirrored: Vec3::ZERO,
                    };
                    textures.iter().map(shade).collect()
                })
                .collect();
            matching(
                places
                    .iter()
                    .zip(&shades)
                    .map(|(&(stored, light, _), shades)| LitSample {
                        stored: Vec3::splat(stored),
                        light: Vec3::splat(light),
                        shades,
                    }),
            )
            .map(|exposure| exposure.scale)
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
        // A spot far brighter than what was stored there counts a little more than the rest, not so much more.
        let spot = found(&[(0.4, 0.4, &[0.4]), (0.4, 90.0, &[0.4])]).unwrap();
        let even = found(&[(0.4, 0.4, &[0.4])]).unwrap();
        assert!((spot / even - 2.0 / 3.0).abs() < 1e-3);
        // The tone curve takes from what is bright, which is made up for.
        let white = found(&[(0.95, 0.95, &[1.0])]).unwrap();
        assert!((tone_curve(white * 0.95) / shown(1.0, 0.95) - 1.0).abs() < 1e-3);
        assert_eq!(found(&[]), None);
        assert_eq!(found(&[(0.0, 1.0, &[0.5])]), None);
        assert_eq!(found(&[(0.5, 0.0, &[0.5])]), None);
        assert!(found(&[(0.5, 0.5, &[])]).is_some());
    }

    #[test]
    fn a_usual_picture_is_that_of_the_map() {
        // a fifth of the dark and a twentieth of the bright pixels are left out, in part, too
        let near = |pixels: &[(f32, f32)], meant: f32| {
            let found = middle(pixels.to_vec());
            assert!((found - meant).abs() < 1e-4, "{found} {meant}");
        };
        near(&[(0.25, 3.0)], -2.0);
        near(&[(1.0, 0.05), (0.25, 0.75), (0.001, 0.2)], -2.0);
        near(&[(0.125, 0.5), (0.5, 0.5)], (-3.0 * 0.3 - 0.45) / 0.75);
        near(&[(0.0, 1.0)], DARKEST);
        let place = LitSample {
            stored: Vec3::splat(0.5),
            light: Vec3::ONE,
            shades: &[],
        };
        let found = matching(std::iter::once(place)).unwrap();
        let shown = overbright::to_linear(0.5 * TEXTURE).log2();
        assert!((found.middle - shown).abs() < 1e-4, "{found:?}");
        assert!(found.is_possible() && Exposure::usual(1.0).is_possible());
    }

    #[test]
    fn what_mirrors_shows_its_surroundings_besides() {
        // A room of nothing but metal: each wall shows its own light, and of what it mirrors a tenth, a hundredth and so on.
        let found = |mirrored: f32| {
            let shades = [Shade {
                linear: Vec3::splat(overbright::to_linear(0.5)),
                encoded: Vec3::splat(0.5),
                mirrored: Vec3::splat(mirrored),
            }];
            let place = LitSample {
                stored: Vec3::splat(0.5),
                light: Vec3::splat(0.5),
                shades: &shades,
            };
            matching(std::iter::once(place)).unwrap().scale
        };
        assert!((found(0.1) / found(0.0) - 0.9).abs() < 1e-3);
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
    }

    #[test]
    fn the_exponent_is_the_slope_of_the_curve_at_what_is_shown() {
        let value = 128.0_f32 / 255.0;
        let slope = |x: f32| {
            let [below, above] = [x / 1.01, x * 1.01].map(overbright::to_linear);
            (above / below).ln() / (1.01f32 * 1.01).ln()
        };
        let found = |textures: &[(f32, f32)]| {
            let textures: Vec<_> = (textures.iter())
                .map(|&(brightness, area)| Texture { brightness, area })
                .collect();
            exponent(std::iter::repeat_n([128; 3], 10), &textures).unwrap()
        };
        let near =
            |found: f32, meant: f32| assert!((found - meant).abs() < 2e-3, "{found} {meant}");
        near(found(&[]), slope(value * TEXTURE));
        near(found(&[(0.8, 3.0)]), slope(value * 0.8));
        // Each part of the surfaces has the weight of its area, and of how bright it is shown.
        let both = (3.0 * 0.2 * slope(value * 0.2) + 0.6 * slope(value * 0.6)) / (3.0 * 0.2 + 0.6);
        near(found(&[(0.2, 3.0), (0.6, 1.0)]), both);
        assert_eq!(exponent(std::iter::empty(), &[]), None);
        let black = Texture {
            brightness: 0.0,
            area: 1.0,
        };
        assert_eq!(exponent(std::iter::once([128; 3]), &[black]), None);
    }
}
