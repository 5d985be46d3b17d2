//! FLIP: how visible the differences between two pictures are to an observer who flips between them.
//!
//! After Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: a difference evaluator for
//! alternating images" (2020), for pictures of ordinary dynamic range; numbers in comments are the paper's sections.

use super::Rgb8;

/// Pixels in a degree of the viewer's sight: a screen 0.7 m wide with 3840 pixels seen from 0.7 m, as in the paper.
const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// Exponent on colour differences and the points of the remapping (4.1.3).
const COLOR_EXPONENT: f64 = 0.7;
const COLOR_KNEE: f64 = 0.4;
const COLOR_KNEE_VALUE: f64 = 0.95;
/// Width of the feature detectors in degrees, and the exponent on feature differences (4.2).
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_EXPONENT: f64 = 0.5;

/// Weights and spreads of the Gaussians that make up the contrast sensitivity of each channel (table 1).
const SENSITIVITY: [[(f64, f64); 2]; 3] = [
    [(1.0, 0.0047), (0.0, 1e-5)],
    [(1.0, 0.0053), (0.0, 1e-5)],
    [(34.1, 0.04), (13.5, 0.025)],
];

/// Linear RGB (sRGB primaries) to XYZ.
const TO_XYZ: [[f64; 3]; 3] = [
    [0.412_386_6, 0.357_591_5, 0.180_450_8],
    [0.212_637_5, 0.715_183_0, 0.072_180_2],
    [0.019_330_6, 0.119_197_2, 0.950_372_6],
];
const FROM_XYZ: [[f64; 3]; 3] = [
    [3.241_003, -1.537_399, -0.498_616],
    [-0.969_224, 1.875_930, 0.041_554],
    [0.055_639, -0.204_011, 1.057_149],
];

type Color = [f64; 3];

fn transform(m: &[[f64; 3]; 3], [x, y, z]: Color) -> Color {
    m.map(|[a, b, c]| a * x + b * y + c * z)
}

/// XYZ of white.
fn white() -> Color {
    transform(&TO_XYZ, [1.0; 3])
}

fn linear(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// Opponent colours in which the eye's sensitivity is known: luminance, red-green, blue-yellow.
fn opponent(rgb: Color) -> Color {
    let ([x, y, z], [wx, wy, wz]) = (transform(&TO_XYZ, rgb), white());
    let (x, y, z) = (x / wx, y / wy, z / wz);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([l, rg, by]: Color) -> Color {
    let [wx, wy, wz] = white();
    let y = (l + 16.0) / 116.0;
    transform(
        &FROM_XYZ,
        [(y + rg / 500.0) * wx, y * wy, (y - by / 200.0) * wz],
    )
}

/// CIELAB, its colourfulness scaled by lightness (Hunt).
fn hunt_lab(rgb: Color) -> Color {
    let curve = |v: f64| {
        let delta = 6.0f64 / 29.0;
        if v > delta.powi(3) {
            v.cbrt()
        } else {
            v / (3.0 * delta * delta) + 4.0 / 29.0
        }
    };
    let ([x, y, z], [wx, wy, wz]) = (transform(&TO_XYZ, rgb), white());
    let (x, y, z) = (curve(x / wx), curve(y / wy), curve(z / wz));
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// The distance of two such colours: lightness and colour added, not rooted.
fn hyab(a: Color, b: Color) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// One value a pixel.
struct Plane {
    width: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Each row, then each column, weighed with kernels of odd length; the edge's values go on outside.
    fn filtered(&self, across: &[f64], down: &[f64]) -> Plane {
        let height = self.values.len() / self.width.max(1);
        let rows = convolve(&self.values, self.width, height, across);
        let values = convolve(&transposed(&rows, self.width), height, self.width, down);
        Plane {
            width: self.width,
            values: transposed(&values, height),
        }
    }
}

fn transposed(values: &[f64], width: usize) -> Vec<f64> {
    let width = width.max(1);
    (0..width)
        .flat_map(|x| values.iter().skip(x).step_by(width).copied())
        .collect()
}

/// Rows weighed with a kernel.
fn convolve(values: &[f64], width: usize, height: usize, kernel: &[f64]) -> Vec<f64> {
    let reach = kernel.len() / 2;
    let mut out = Vec::with_capacity(width * height);
    let mut padded = Vec::with_capacity(width + 2 * reach);
    for row in values.chunks_exact(width.max(1)) {
        let (first, last) = (row[0], row[row.len() - 1]);
        padded.clear();
        padded.extend(std::iter::repeat_n(first, reach));
        padded.extend_from_slice(row);
        padded.extend(std::iter::repeat_n(last, reach));
        out.extend(
            padded
                .windows(kernel.len())
                .map(|window| window.iter().zip(kernel).map(|(v, k)| v * k).sum::<f64>()),
        );
    }
    out
}

fn kernel(reach: i32, value: impl Fn(f64) -> f64) -> Vec<f64> {
    (-reach..=reach).map(|i| value(f64::from(i))).collect()
}

fn scaled_to_one(mut kernel: Vec<f64>) -> Vec<f64> {
    let sum: f64 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    kernel
}

/// A channel as the eye resolves it (4.1.1).
fn seen(plane: &Plane, gaussians: &[(f64, f64); 2]) -> Plane {
    let pi = std::f64::consts::PI;
    let widest = SENSITIVITY
        .iter()
        .flatten()
        .fold(0.0f64, |most, g| most.max(g.1));
    let reach = (3.0 * (widest / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let mut out = Plane {
        width: plane.width,
        values: vec![0.0; plane.values.len()],
    };
    let mut total = 0.0;
    for &(weight, spread) in gaussians.iter().filter(|g| g.0 > 0.0) {
        let gaussian = kernel(reach, |i| {
            let degrees = i / PIXELS_PER_DEGREE;
            (-pi * pi * degrees * degrees / spread).exp()
        });
        // the sum of Gaussians is normalized as a whole, so each counts with its volume
        let volume = weight * (pi / spread).sqrt() * gaussian.iter().sum::<f64>().powi(2);
        let gaussian = scaled_to_one(gaussian);
        let part = plane.filtered(&gaussian, &gaussian);
        for (out, part) in out.values.iter_mut().zip(&part.values) {
            *out += volume * part;
        }
        total += volume;
    }
    out.values.iter_mut().for_each(|v| *v /= total);
    out
}

/// How much of an edge and of a point there is at each pixel (4.2).
fn features(luminance: &Plane) -> [Vec<f64>; 2] {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let reach = (3.0 * deviation).ceil() as i32;
    let gaussian = |i: f64| (-i * i / (2.0 * deviation * deviation)).exp();
    let smooth = scaled_to_one(kernel(reach, gaussian));
    let slope = balanced(kernel(reach, |i| -i * gaussian(i)));
    let bump = balanced(kernel(reach, |i| {
        (i * i / (deviation * deviation) - 1.0) * gaussian(i)
    }));
    [slope, bump].map(|derivative| {
        let across = luminance.filtered(&derivative, &smooth);
        let down = luminance.filtered(&smooth, &derivative);
        let pairs = across.values.iter().zip(&down.values);
        pairs.map(|(x, y)| x.hypot(*y)).collect()
    })
}

/// Positive weights add up to 1, negative ones to -1.
fn balanced(mut kernel: Vec<f64>) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|k| **k > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|k| **k < 0.0).sum::<f64>();
    for k in &mut kernel {
        *k /= if *k > 0.0 { positive } else { negative };
    }
    kernel
}

/// What of a picture is compared.
struct Appearance {
    colors: Vec<Color>,
    features: [Vec<f64>; 2],
}

fn appearance(picture: &Rgb8) -> Appearance {
    let opponents: Vec<Color> = picture
        .pixels
        .chunks_exact(3)
        .map(|p| match p {
            [r, g, b] => opponent([linear(*r), linear(*g), linear(*b)]),
            _ => [0.0; 3],
        })
        .collect();
    let channels = [0, 1, 2].map(|channel| Plane {
        width: picture.width,
        values: opponents.iter().map(|c| c[channel]).collect(),
    });
    let luminance = Plane {
        width: picture.width,
        values: opponents.iter().map(|c| (c[0] + 16.0) / 116.0).collect(),
    };
    let features = features(&luminance);
    let [l, rg, by] = [0, 1, 2].map(|i| seen(&channels[i], &SENSITIVITY[i]));
    let colors = l.values.iter().zip(&rg.values).zip(&by.values);
    let colors = colors
        .map(|((l, rg), by)| {
            hunt_lab(from_opponent([*l, *rg, *by]).map(|v: f64| v.clamp(0.0, 1.0)))
        })
        .collect();
    Appearance { colors, features }
}

/// The mean over all pixels of `b`'s difference from `a`; 0 for equal pictures, at most 1. Sizes have to agree.
pub(super) fn mean(a: &Rgb8, b: &Rgb8) -> f64 {
    let values = map(a, b);
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The measure at each pixel, rows from the top.
pub(super) fn map(a: &Rgb8, b: &Rgb8) -> Vec<f64> {
    let (a, b) = (appearance(a), appearance(b));
    let green_to_blue = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]));
    let most = green_to_blue.powf(COLOR_EXPONENT);
    let knee = COLOR_KNEE * most;
    let [edges_a, points_a] = &a.features;
    let [edges_b, points_b] = &b.features;
    let colors = a.colors.iter().zip(&b.colors);
    let edges = edges_a.iter().zip(edges_b).map(|(x, y)| (x - y).abs());
    let points = points_a.iter().zip(points_b).map(|(x, y)| (x - y).abs());
    colors
        .zip(edges.zip(points))
        .map(|((x, y), (edge, point))| {
            let distance = hyab(*x, *y).powf(COLOR_EXPONENT);
            let color = if distance < knee {
                distance * COLOR_KNEE_VALUE / knee
            } else {
                COLOR_KNEE_VALUE + (distance - knee) / (most - knee) * (1.0 - COLOR_KNEE_VALUE)
            };
            let feature = (edge.max(point) / std::f64::consts::SQRT_2).powf(FEATURE_EXPONENT);
            color.powf(1.0 - feature)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: [u8; 3]) -> Rgb8 {
        Rgb8::new(40, 30, value.repeat(40 * 30)).unwrap()
    }

    #[test]
    fn a_picture_equals_itself() {
        assert_eq!(mean(&flat([9, 80, 200]), &flat([9, 80, 200])), 0.0);
    }

    /// Even pictures have no features and look as they are: the remapped distance of their colours alone.
    #[test]
    fn even_pictures_follow_the_formula() {
        let black_to_white = mean(&flat([0; 3]), &flat([255; 3]));
        // black to white is a distance of 100, 25.119 after the exponent; green to blue 308.0, 55.2
        let most = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]));
        let (d, most) = (100.0f64.powf(0.7), most.powf(0.7));
        let expected = 0.95 + (d - 0.4 * most) / (0.6 * most) * 0.05;
        assert!((black_to_white - expected).abs() < 1e-4, "{black_to_white}");
    }

    #[test]
    fn opponent_colours_go_there_and_back() {
        for rgb in [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.2, 0.7, 0.4]] {
            let back = from_opponent(opponent(rgb));
            for (a, b) in rgb.iter().zip(back) {
                assert!((a - b).abs() < 1e-4, "{rgb:?} {back:?}");
            }
        }
    }

    #[test]
    fn a_hard_edge_tells_more_than_a_tint() {
        let grey = flat([128; 3]);
        let mut edge = grey.clone();
        for row in edge.pixels.chunks_exact_mut(40 * 3) {
            row[60..63].fill(160);
        }
        let difference = mean(&grey, &edge);
        assert!(difference > 0.002 && difference < 0.5, "{difference}");
        // one column of forty, though differing more, is less than everything tinted
        assert!(difference < mean(&grey, &flat([140; 3])));
    }
}
