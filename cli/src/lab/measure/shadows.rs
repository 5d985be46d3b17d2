//! How much of the contrast of shadows a picture keeps, by distance from the camera.
//!
//! The picture and the reference are divided by albedo, which leaves light. In each tile of 8 × 8 pixels, the deviations
//! of the picture's light from its mean are regressed on those of the reference: the slope is 1 if the picture has the
//! reference's pattern in full, 0 if it has none of it. Noise and patterns that the reference does not have change
//! neither the numerator nor the denominator in expectation; a ratio of standard deviations would count them as contrast.

use serde_json::{Value, json};

/// Side of a tile, pixels.
const TILE: usize = 8;

/// Least albedo to divide by: it is read as 8 bits, which differ by 8 % here, and by more below.
const LEAST_ALBEDO: f32 = 0.004;

/// Least light of a tile over the mean light: what is darker shows hardly any contrast.
const LEAST_LIGHT: f64 = 0.02;

/// Least standard deviation over mean of the reference in a tile: above its noise, so that a shadow or a gradient of
/// light is in the tile.
const LEAST_CONTRAST: f32 = 0.1;

/// Largest ratio of the view distances in a tile: no surface in front of another.
const LARGEST_STEP: f32 = 1.25;

/// Bins of view distance: up to this many units, twice as many, and so on; the last has no end.
const FIRST_BIN: f32 = 128.0;
pub const BINS: usize = 6;

/// Least number of tiles of a bin.
const LEAST_TILES: usize = 8;

/// A pixel's surface: luminance of its albedo, and its view distance in units; `None` if it is not lit.
pub type Surface = Option<(f32, f32)>;

/// A tile with a shadow or a gradient of light.
struct Tile {
    /// Its first pixel, column and row.
    at: [usize; 2],
    bin: usize,
    /// Mean of the reference's light.
    mean: f64,
}

/// Tiles of the reference with contrast.
pub struct Shadows {
    width: usize,
    /// 1 / albedo of each pixel; 0 where the light is unknown.
    weights: Vec<f32>,
    /// The reference's light.
    light: Vec<f32>,
    tiles: Vec<Tile>,
}

/// The bin of a distance in units.
fn bin(distance: f32) -> usize {
    let doublings = (distance / FIRST_BIN).log2().floor() + 1.0;
    (doublings.max(0.0) as usize).min(BINS - 1)
}

/// Limits of a bin, units; without an end for the last.
pub fn limits(bin: usize) -> (f32, Option<f32>) {
    let limit = |n: usize| FIRST_BIN * (n as f32 - 1.0).exp2();
    let from = if bin == 0 { 0.0 } else { limit(bin) };
    (from, (bin + 1 < BINS).then(|| limit(bin + 1)))
}

impl Shadows {
    /// `luminance`: linear, of the reference; `excluded`: pixels whose colour is not albedo times light, such as mirrors.
    pub fn new(width: usize, luminance: &[f32], surfaces: &[Surface], excluded: &[bool]) -> Self {
        let known = |(surface, excluded): (&Surface, &bool)| {
            surface.filter(|(albedo, _)| *albedo >= LEAST_ALBEDO && !excluded)
        };
        let known: Vec<Surface> = surfaces.iter().zip(excluded).map(known).collect();
        let weights: Vec<f32> = known
            .iter()
            .map(|s| s.map_or(0.0, |(a, _)| 1.0 / a))
            .collect();
        let light = lights(luminance, &weights);
        let height = light.len() / width.max(1);
        let corners = (0..height / TILE).flat_map(|row| (0..width / TILE).map(move |c| [c, row]));
        let shadows = Self {
            width,
            weights,
            light,
            tiles: Vec::new(),
        };
        let lit = || (shadows.light.iter().zip(&shadows.weights)).filter(|(_, w)| **w > 0.0);
        let sum: f64 = lit().map(|(light, _)| f64::from(*light)).sum();
        let least_light = LEAST_LIGHT * sum / lit().count().max(1) as f64;
        let tiles = corners.filter_map(|[column, row]| {
            let at = [column * TILE, row * TILE];
            let (mut least, mut most) = (f32::INFINITY, 0.0f32);
            for pixel in pixels(at, width) {
                let (_, distance) = (*known.get(pixel)?)?;
                (least, most) = (least.min(distance), most.max(distance));
            }
            let mean = mean(&shadows.light, at, width);
            let variance = covariance([&shadows.light; 2], [mean; 2], at, width);
            let seen = most <= least * LARGEST_STEP
                && mean >= least_light
                && variance >= (f64::from(LEAST_CONTRAST) * mean).powi(2);
            seen.then(|| Tile {
                at,
                bin: bin((least * most).sqrt()),
                mean,
            })
        });
        let tiles: Vec<Tile> = tiles.collect();
        Self { tiles, ..shadows }
    }

    /// The contrast that a picture keeps, for each bin with enough tiles; `luminance`: linear.
    pub fn kept(&self, luminance: &[f32]) -> [Option<f64>; BINS] {
        let light = lights(luminance, &self.weights);
        let mut sums = [(0.0, 0.0, 0); BINS];
        for tile in &self.tiles {
            let (at, width) = (tile.at, self.width);
            let means = [mean(&light, at, width), tile.mean];
            let both = covariance([&light, &self.light], means, at, width);
            let own = covariance([&self.light; 2], [tile.mean; 2], at, width);
            // relative to the tile's light, so that dark places count as bright ones do
            let scale = tile.mean.powi(-2);
            let (covariance, variance, count) = &mut sums[tile.bin];
            *covariance += both * scale;
            *variance += own * scale;
            *count += 1;
        }
        sums.map(|(covariance, variance, count)| {
            (count >= LEAST_TILES).then(|| covariance / variance)
        })
    }

    /// The same as JSON, with the limits of each bin and its number of tiles.
    pub fn json(&self, luminance: &[f32]) -> Value {
        let kept = self.kept(luminance);
        let rows = kept.iter().enumerate().map(|(bin, kept)| {
            let (from, to) = limits(bin);
            let tiles = self.tiles.iter().filter(|tile| tile.bin == bin).count();
            json!({ "from": from, "to": to, "tiles": tiles, "kept": kept })
        });
        rows.collect()
    }
}

/// Luminance divided by albedo.
fn lights(luminance: &[f32], weights: &[f32]) -> Vec<f32> {
    std::iter::zip(luminance, weights)
        .map(|(l, w)| l * w)
        .collect()
}

/// Indices of the pixels of a tile.
fn pixels([x, y]: [usize; 2], width: usize) -> impl Iterator<Item = usize> {
    (y..y + TILE).flat_map(move |row| (x..x + TILE).map(move |column| row * width + column))
}

fn mean(values: &[f32], at: [usize; 2], width: usize) -> f64 {
    let sum: f64 = pixels(at, width).map(|p| f64::from(values[p])).sum();
    sum / (TILE * TILE) as f64
}

fn covariance(values: [&[f32]; 2], means: [f64; 2], at: [usize; 2], width: usize) -> f64 {
    let deviation = |k: usize, pixel: usize| f64::from(values[k][pixel]) - means[k];
    let sum: f64 = pixels(at, width)
        .map(|p| deviation(0, p) * deviation(1, p))
        .sum();
    sum / (TILE * TILE) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 64;
    const HEIGHT: usize = 48;

    /// A picture of rows that are ever farther away: stripes of light on a checkered texture.
    fn stripes() -> (Vec<f32>, Vec<Surface>) {
        let pixel = |at: usize| {
            let (x, y) = (at % WIDTH, at / WIDTH);
            let albedo = if (x + y) % 2 == 0 { 0.2 } else { 0.8 };
            let light = if x % 4 < 2 { 0.5 } else { 1.5 };
            (
                albedo * light,
                Some((albedo, 100.0 * ((y / TILE) as f32).exp2())),
            )
        };
        (0..WIDTH * HEIGHT).map(pixel).unzip()
    }

    fn close(found: [Option<f64>; BINS], expected: [f64; BINS]) {
        for (found, expected) in found.iter().zip(expected) {
            let found = found.expect("tiles of every distance");
            assert!((found - expected).abs() < 1.0e-4, "{found} {expected}");
        }
    }

    #[test]
    fn contrast_that_fades_with_distance_is_found_at_each_distance() {
        let (truth, surfaces) = stripes();
        let shadows = Shadows::new(WIDTH, &truth, &surfaces, &[false; WIDTH * HEIGHT]);
        close(shadows.kept(&truth), [1.0; BINS]);
        // light of mean 1 whose contrast is halved from bin to bin; a brighter picture keeps more
        let faded: Vec<f32> = std::iter::zip(&truth, &surfaces)
            .map(|(l, surface)| {
                let (albedo, distance) = surface.expect("lit");
                albedo * (1.0 + (l / albedo - 1.0) * 100.0 / distance)
            })
            .collect();
        close(
            shadows.kept(&faded),
            [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125],
        );
        // a pattern of its own does not count, as that of noise would not on average: rows instead of columns
        let other: Vec<f32> = (0..truth.len())
            .map(|at| {
                let (albedo, _) = surfaces[at].expect("lit");
                faded[at]
                    + albedo
                        * if (at / WIDTH).is_multiple_of(2) {
                            0.3
                        } else {
                            -0.3
                        }
            })
            .collect();
        close(
            shadows.kept(&other),
            [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125],
        );
    }

    #[test]
    fn tiles_without_a_shadow_on_one_surface_are_left_out() {
        let (truth, surfaces) = stripes();
        let none = |luminance: &[f32], surfaces: &[Surface], excluded: &[bool]| {
            let shadows = Shadows::new(WIDTH, luminance, surfaces, excluded);
            assert_eq!(shadows.kept(luminance), [None; BINS]);
        };
        let all = [false; WIDTH * HEIGHT];
        none(&truth, &surfaces, &[true; WIDTH * HEIGHT]);
        let flat: Vec<f32> = surfaces.iter().map(|s| s.map_or(0.0, |(a, _)| a)).collect();
        none(&flat, &surfaces, &all);
        // contrast in one tile alone, which is dark beside all others
        let dark = |at: usize| match at % WIDTH < 8 && at / WIDTH < 8 {
            true => truth[at] * 0.001,
            false => flat[at],
        };
        let dark: Vec<f32> = (0..truth.len()).map(dark).collect();
        assert!(Shadows::new(WIDTH, &dark, &surfaces, &all).tiles.is_empty());
        let step = |at: usize| {
            surfaces[at].map(|(a, d)| (a, if at.is_multiple_of(8) { d * 2.0 } else { d }))
        };
        let steps: Vec<Surface> = (0..truth.len()).map(step).collect();
        none(&truth, &steps, &all);
        let sky = |at: usize| surfaces[at].filter(|_| at % 8 != 3);
        let holes: Vec<Surface> = (0..truth.len()).map(sky).collect();
        none(&truth, &holes, &all);
    }

    #[test]
    fn bins_are_powers_of_two() {
        assert_eq!([1.0, 127.0, 128.0, 255.0, 256.0].map(bin), [0, 0, 1, 1, 2]);
        assert_eq!([2047.0, 2048.0, 1.0e9].map(bin), [4, 5, 5]);
        assert_eq!(limits(0), (0.0, Some(128.0)));
        assert_eq!(limits(4), (1024.0, Some(2048.0)));
        assert_eq!(limits(5), (2048.0, None));
    }
}
