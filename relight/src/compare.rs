//! Two pictures of one view compared: how alike are they, and how bright is each.
//!
//! Values are those of the picture file (display-referred, 0..255): a comparison of what is seen, so nothing
//! is linearized here.

mod flip;

use support::slice::part;
use thiserror::Error;

/// Side of the window over which structural similarity is computed, in pixels.
const WINDOW: usize = 7;

/// An RGB picture, 8 bits a channel, rows from the top.
#[derive(Clone, PartialEq, Eq)]
pub struct Rgb8 {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl std::fmt::Debug for Rgb8 {
    /// The size and the mean luminance: a message that holds a picture has to stay readable.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (width, height) = (self.width, self.height);
        write!(
            f,
            "picture of {width}x{height}, mean luminance {:.1}",
            self.mean_luminance()
        )
    }
}

/// Why two pictures cannot be compared.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum CompareError {
    /// The number of bytes is not that of a picture of this size.
    #[error("{bytes} bytes are no picture of {width}x{height}: 3 bytes a pixel make {}", width * height * 3)]
    Length {
        /// Pixels.
        width: usize,
        /// Pixels.
        height: usize,
        /// Bytes given.
        bytes: usize,
    },
    /// The pictures differ in size.
    #[error("a picture of {}x{} cannot be compared with one of {}x{}", .0.0, .0.1, .1.0, .1.1)]
    Size((usize, usize), (usize, usize)),
    /// A side is shorter than the window of the similarity measure.
    #[error("a picture of {0}x{1} is smaller than the {WINDOW}x{WINDOW} window of the comparison")]
    TooSmall(usize, usize),
}

/// What [`compare`] measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Mean structural similarity: 1 = the same picture.
    pub ssim: f64,
    /// Mean absolute difference, 0..255.
    pub mean_absolute: f64,
    /// Root of the mean squared difference, 0..255.
    pub root_mean_square: f64,
    /// Share of pixels with a channel that differs by more than 8, 0..1.
    pub differing: f64,
}

/// Mean FLIP of `b` against `a`: how visible the difference is to an observer who flips between the two, 0 for the same
/// picture, at most 1. For a screen 0.7 m wide with 3840 pixels, seen from 0.7 m: the measure's own default.
///
/// # Errors
/// The pictures differ in size.
pub fn flip(a: &Rgb8, b: &Rgb8) -> Result<f64, CompareError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(CompareError::Size((a.width, a.height), (b.width, b.height)));
    }
    Ok(flip::mean(a, b))
}

/// FLIP at each pixel, rows from the top; see [`flip()`].
///
/// # Errors
/// The pictures differ in size.
pub fn flip_map(a: &Rgb8, b: &Rgb8) -> Result<Vec<f32>, CompareError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(CompareError::Size((a.width, a.height), (b.width, b.height)));
    }
    Ok(flip::map(a, b).into_iter().map(|v| v as f32).collect())
}

impl Rgb8 {
    /// Takes over `pixels`, which have to be `width * height * 3` bytes.
    ///
    /// # Errors
    /// [`CompareError::Length`] when there are more or fewer bytes.
    pub fn new(width: usize, height: usize, pixels: Vec<u8>) -> Result<Self, CompareError> {
        let wanted = width.checked_mul(height).and_then(|n| n.checked_mul(3));
        if wanted != Some(pixels.len()) {
            return Err(CompareError::Length {
                width,
                height,
                bytes: pixels.len(),
            });
        }
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// Pixels from left to right.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels from top to bottom.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Red, green, blue of each pixel, rows from the top.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Mean luma (the weights of BT.709, applied to the values as stored), 0..255.
    pub fn mean_luminance(&self) -> f64 {
        let sum: f64 = self
            .pixels
            .chunks_exact(3)
            .map(|p| 0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2]))
            .sum();
        sum / (self.width * self.height).max(1) as f64
    }

    /// Number of different colours; large for a picture with content.
    pub fn distinct_colors(&self) -> usize {
        let mut colors: Vec<[u8; 3]> = self
            .pixels
            .chunks_exact(3)
            .map(|p| [p[0], p[1], p[2]])
            .collect();
        colors.sort_unstable();
        colors.dedup();
        colors.len()
    }

    /// Where and how much `other` differs: absolute differences of all channels, `gain` times, on black. The part
    /// that both have, where they differ in size.
    pub fn difference(&self, other: &Self, gain: u8) -> Self {
        let (width, height) = (self.width.min(other.width), self.height.min(other.height));
        let row = |picture: &Self, y: usize| {
            let start = y * picture.width * 3;
            part(&picture.pixels, start..start + width * 3).to_vec()
        };
        let pixels = (0..height)
            .flat_map(|y| row(self, y).into_iter().zip(row(other, y)))
            .map(|(a, b)| a.abs_diff(b).saturating_mul(gain))
            .collect();
        Self {
            width,
            height,
            pixels,
        }
    }

    /// The pictures beside each other, a gap of `gap` black pixels between them. `None` without pictures.
    /// Lower ones are filled up with black.
    pub fn side_by_side(pictures: &[Self], gap: usize) -> Option<Self> {
        let height = pictures.iter().map(|p| p.height).max()?;
        let width = pictures.iter().map(|p| p.width).sum::<usize>() + gap * (pictures.len() - 1);
        let mut pixels = vec![0; width * height * 3];
        let mut left = 0;
        for picture in pictures {
            let row = picture.width * 3;
            for (from, to) in picture
                .pixels
                .chunks_exact(row.max(1))
                .zip(pixels.chunks_exact_mut(width * 3))
            {
                to[left * 3..left * 3 + row].copy_from_slice(from);
            }
            left += picture.width + gap;
        }
        Some(Self {
            width,
            height,
            pixels,
        })
    }
}

/// Compares `b` with `a`.
///
/// Structural similarity as of Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error
/// visibility to structural similarity" (2004), equation 13, with its constants (K1 0.01, K2 0.03), over a
/// uniform window of 7x7 pixels with sample covariances, each channel alone, averaged over channels and over
/// the windows that lie fully in the picture: the defaults of scikit-image, so figures compare with its.
///
/// # Errors
/// Pictures of different sizes, or with a side shorter than the window.
pub fn compare(a: &Rgb8, b: &Rgb8) -> Result<Difference, CompareError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(CompareError::Size((a.width, a.height), (b.width, b.height)));
    }
    if a.width < WINDOW || a.height < WINDOW {
        return Err(CompareError::TooSmall(a.width, a.height));
    }
    let ssim = (0..3)
        .map(|channel| channel_ssim(a, b, channel))
        .sum::<f64>()
        / 3.0;
    let mut absolute = 0u64;
    let mut squared = 0u64;
    let mut differing = 0usize;
    for (p, q) in a.pixels.chunks_exact(3).zip(b.pixels.chunks_exact(3)) {
        let mut worst = 0;
        for (&x, &y) in p.iter().zip(q) {
            let difference = x.abs_diff(y);
            worst = worst.max(difference);
            absolute += u64::from(difference);
            squared += u64::from(difference).pow(2);
        }
        differing += usize::from(worst > 8);
    }
    let values = a.pixels.len() as f64;
    Ok(Difference {
        ssim,
        mean_absolute: absolute as f64 / values,
        root_mean_square: (squared as f64 / values).sqrt(),
        differing: differing as f64 / (values / 3.0),
    })
}

/// Structural similarity at each pixel, mean of the channels: of the window around it, or near the picture's edge of the
/// nearest window that lies fully in it. Rows from the top.
///
/// # Errors
/// As [`compare`].
pub fn ssim_map(a: &Rgb8, b: &Rgb8) -> Result<Vec<f32>, CompareError> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(CompareError::Size((a.width, a.height), (b.width, b.height)));
    }
    if a.width < WINDOW || a.height < WINDOW {
        return Err(CompareError::TooSmall(a.width, a.height));
    }
    let (columns, rows) = (a.width - WINDOW + 1, a.height - WINDOW + 1);
    let mut windows = vec![0.0; columns * rows];
    for channel in 0..3 {
        let mut next = windows.iter_mut();
        each_window(a, b, channel, |ssim| {
            if let Some(window) = next.next() {
                *window += ssim / 3.0;
            }
        });
    }
    let near = |at: usize, count: usize| at.saturating_sub(WINDOW / 2).min(count - 1);
    let places = (0..a.height).flat_map(|y| (0..a.width).map(move |x| (x, y)));
    Ok(places
        .map(|(x, y)| windows[near(y, rows) * columns + near(x, columns)] as f32)
        .collect())
}

/// Sums over a window: of the values, their squares and their products.
#[derive(Clone, Copy, Default)]
struct Sums {
    a: i64,
    b: i64,
    aa: i64,
    bb: i64,
    ab: i64,
}

impl Sums {
    fn of(x: u8, y: u8) -> Self {
        let (x, y) = (i64::from(x), i64::from(y));
        Self {
            a: x,
            b: y,
            aa: x * x,
            bb: y * y,
            ab: x * y,
        }
    }

    fn add(&mut self, o: &Self) {
        self.a += o.a;
        self.b += o.b;
        self.aa += o.aa;
        self.bb += o.bb;
        self.ab += o.ab;
    }

    fn subtract(&mut self, o: &Self) {
        self.a -= o.a;
        self.b -= o.b;
        self.aa -= o.aa;
        self.bb -= o.bb;
        self.ab -= o.ab;
    }

    /// Equation 13 of the paper. Sums are whole numbers, so equal pictures give exactly 1.
    fn ssim(&self) -> f64 {
        let n = (WINDOW * WINDOW) as f64;
        let c1 = (0.01f64 * 255.0).powi(2);
        let c2 = (0.03f64 * 255.0).powi(2);
        let (a, b) = (self.a as f64, self.b as f64);
        let (mean_a, mean_b) = (a / n, b / n);
        let variance_a = (self.aa as f64 - a * mean_a) / (n - 1.0);
        let variance_b = (self.bb as f64 - b * mean_b) / (n - 1.0);
        let covariance = (self.ab as f64 - a * mean_b) / (n - 1.0);
        ((2.0 * mean_a * mean_b + c1) * (2.0 * covariance + c2))
            / ((mean_a * mean_a + mean_b * mean_b + c1) * (variance_a + variance_b + c2))
    }
}

/// Mean similarity of one channel.
fn channel_ssim(a: &Rgb8, b: &Rgb8, channel: usize) -> f64 {
    let mut total = 0.0;
    each_window(a, b, channel, |ssim| total += ssim);
    total / ((a.width - WINDOW + 1) * (a.height - WINDOW + 1)) as f64
}

/// Similarity of one channel in each window, row by row. A window slides down the columns' running sums, so the work does
/// not grow with the window.
fn each_window(a: &Rgb8, b: &Rgb8, channel: usize, mut found: impl FnMut(f64)) {
    let at = |x: usize, y: usize| {
        let i = (y * a.width + x) * 3 + channel;
        Sums::of(a.pixels[i], b.pixels[i])
    };
    let mut columns = vec![Sums::default(); a.width];
    for y in 0..a.height {
        for (x, column) in columns.iter_mut().enumerate() {
            column.add(&at(x, y));
            if y >= WINDOW {
                column.subtract(&at(x, y - WINDOW));
            }
        }
        if y + 1 < WINDOW {
            continue;
        }
        let mut window = Sums::default();
        for x in 0..a.width {
            window.add(&columns[x]);
            if x >= WINDOW {
                window.subtract(&columns[x - WINDOW]);
            }
            if x + 1 >= WINDOW {
                found(window.ssim());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use testkit::Random;

    use super::*;

    /// A repeatable picture without structure shared between seeds.
    fn noise(width: usize, height: usize, seed: u64) -> Rgb8 {
        let pixels = Random::new(seed).bytes(width * height * 3);
        Rgb8::new(width, height, pixels).unwrap()
    }

    fn ramp(offset: u8) -> Rgb8 {
        let pixels = (0..32 * 24)
            .flat_map(|i| {
                let (x, y) = ((i % 32) as u8, (i / 32) as u8);
                [x * 5 + offset, y * 7 + offset, x * 2 + y * 3 + offset]
            })
            .collect();
        Rgb8::new(32, 24, pixels).unwrap()
    }

    #[test]
    fn a_picture_equals_itself() {
        let d = compare(&noise(40, 30, 1), &noise(40, 30, 1)).unwrap();
        assert_eq!(
            (d.ssim, d.mean_absolute, d.root_mean_square, d.differing),
            (1.0, 0.0, 0.0, 0.0)
        );
    }

    #[test]
    fn unrelated_pictures_are_unlike() {
        let d = compare(&noise(40, 30, 1), &noise(40, 30, 99)).unwrap();
        assert!(d.ssim.abs() < 0.05, "{d:?}");
        assert!(d.differing > 0.9, "{d:?}");
    }

    /// The closed form for a constant window: variances vanish and the luminance term alone remains.
    #[test]
    fn flat_pictures_follow_the_formula() {
        let flat = |v| Rgb8::new(9, 8, vec![v; 9 * 8 * 3]).unwrap();
        let d = compare(&flat(100), &flat(150)).unwrap();
        let c1 = 6.5025;
        let wanted = (2.0 * 100.0 * 150.0 + c1) / (100.0f64.powi(2) + 150.0f64.powi(2) + c1);
        assert!((d.ssim - wanted).abs() < 1e-12, "{} {wanted}", d.ssim);
        assert_eq!(d.mean_absolute, 50.0);
    }

    /// Against sums done window by window in floating point.
    #[test]
    fn sliding_sums_agree_with_direct_ones() {
        let (a, b) = (ramp(0), ramp(40));
        let mut total = 0.0;
        for channel in 0..3 {
            for y in 0..=24 - WINDOW {
                for x in 0..=32 - WINDOW {
                    let mut sums = Sums::default();
                    for j in 0..WINDOW {
                        for i in 0..WINDOW {
                            let at = ((y + j) * 32 + x + i) * 3 + channel;
                            sums.add(&Sums::of(a.pixels[at], b.pixels[at]));
                        }
                    }
                    total += sums.ssim();
                }
            }
        }
        let wanted = total / (3 * (24 - WINDOW + 1) * (32 - WINDOW + 1)) as f64;
        assert!((compare(&a, &b).unwrap().ssim - wanted).abs() < 1e-12);
    }

    /// A window in the middle of the picture is that of its pixel, and far from a difference nothing differs.
    #[test]
    fn maps_tell_where_pictures_differ() {
        let a = ramp(0);
        let mut pixels = a.pixels().to_vec();
        pixels[(12 * 32 + 16) * 3] ^= 0x80;
        let b = Rgb8::new(32, 24, pixels).unwrap();
        let ssim = ssim_map(&a, &b).unwrap();
        assert_eq!(ssim.len(), 32 * 24);
        assert!(ssim[12 * 32 + 16] < 0.99 && ssim[12 * 32 + 19] < 0.99);
        assert_eq!(
            (ssim[12 * 32 + 20], ssim[0], ssim[32 * 24 - 1]),
            (1.0, 1.0, 1.0)
        );
        let flips = flip_map(&a, &b).unwrap();
        let mean = flips.iter().map(|v| f64::from(*v)).sum::<f64>() / flips.len() as f64;
        assert!((mean - flip(&a, &b).unwrap()).abs() < 1e-6);
        assert!(flips[12 * 32 + 16] > 0.05 && flips[0] == 0.0);
    }

    #[test]
    fn sizes_have_to_fit() {
        assert_eq!(
            compare(&noise(8, 8, 1), &noise(8, 9, 1)),
            Err(CompareError::Size((8, 8), (8, 9)))
        );
        assert_eq!(
            compare(&noise(6, 8, 1), &noise(6, 8, 1)),
            Err(CompareError::TooSmall(6, 8))
        );
        assert!(Rgb8::new(2, 2, vec![0; 11]).is_err());
    }

    #[test]
    fn beside_each_other() {
        let a = Rgb8::new(1, 2, vec![1; 6]).unwrap();
        let b = Rgb8::new(2, 1, vec![2; 6]).unwrap();
        let both = Rgb8::side_by_side(&[a, b], 1).unwrap();
        assert_eq!((both.width(), both.height()), (4, 2));
        assert_eq!(both.pixels()[..12], [1, 1, 1, 0, 0, 0, 2, 2, 2, 2, 2, 2]);
        assert_eq!(both.pixels()[12..], [1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(Rgb8::side_by_side(&[], 1), None);
    }

    #[test]
    fn differences_stand_on_black() {
        let a = Rgb8::new(2, 1, vec![10, 20, 30, 40, 50, 60]).unwrap();
        let b = Rgb8::new(1, 1, vec![12, 20, 130]).unwrap();
        let d = a.difference(&b, 4);
        assert_eq!((d.width(), d.height()), (1, 1));
        assert_eq!(d.pixels(), [8, 0, 255]);
        assert!(flip(&a, &b).is_err());
    }

    #[test]
    fn brightness_and_colours() {
        let picture = Rgb8::new(2, 1, vec![255, 255, 255, 0, 0, 0]).unwrap();
        assert!((picture.mean_luminance() - 127.5).abs() < 1e-9);
        assert_eq!(picture.distinct_colors(), 2);
    }
}
