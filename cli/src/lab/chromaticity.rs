//! Difference in chromaticity of two pictures of the same view.
//!
//! Compares means of blocks in linear light, so that noise and texture have no effect. Chromaticity is CIE 1976 (u',
//! v'), in which equal distances look about equally different: 0.004 is just noticeable side by side.
//!
//! Source: CIE 15, *Colorimetry*, section 8.1 (u'v'); IEC 61966-2-1 for sRGB's primaries and curve.

use glam::{Mat3, Vec2, Vec3};
use relight::compare::Rgb8;
use relight::overbright::{byte_table, colour_to_linear};

/// Side of a block, pixels.
const BLOCK: usize = 8;

/// Luminance below which a block has no visible colour.
const DARK: f64 = 0.004;

/// Linear sRGB to CIE XYZ, by columns.
const TO_XYZ: Mat3 = Mat3::from_cols_array(&[
    0.4124, 0.2126, 0.0193, 0.3576, 0.7152, 0.1192, 0.1805, 0.0722, 0.9505,
]);

/// Sums over blocks of the chromaticity difference between pictures and references.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ColorDifference {
    blocks: usize,
    distance: f64,
    saturation: f64,
    saturation_of_reference: f64,
}

impl ColorDifference {
    /// Adds the blocks that are dark in neither picture. Both have one size.
    pub fn add(&mut self, picture: &Rgb8, reference: &Rgb8) {
        let white = chromaticity(colour_to_linear(Vec3::ONE));
        for (a, b) in blocks(picture).into_iter().zip(blocks(reference)) {
            let dark = |c: Vec3| f64::from((TO_XYZ * c).y) < DARK;
            if dark(a) || dark(b) {
                continue;
            }
            let (a, b) = (chromaticity(a), chromaticity(b));
            self.blocks += 1;
            self.distance += f64::from(a.distance(b));
            self.saturation += f64::from(a.distance(white));
            self.saturation_of_reference += f64::from(b.distance(white));
        }
    }

    /// Adds another sum.
    pub fn join(&mut self, other: &ColorDifference) {
        self.blocks += other.blocks;
        self.distance += other.distance;
        self.saturation += other.saturation;
        self.saturation_of_reference += other.saturation_of_reference;
    }

    /// Mean distance in (u', v').
    pub fn mean(&self) -> f64 {
        self.distance / self.blocks.max(1) as f64
    }

    /// Mean distance from white over that of the reference; below 1 the pictures are less saturated.
    pub fn saturation(&self) -> f64 {
        self.saturation / self.saturation_of_reference.max(1e-9)
    }
}

/// Means of a picture's blocks in linear light, without incomplete blocks at its edges.
fn blocks(picture: &Rgb8) -> Vec<Vec3> {
    let table = byte_table();
    let decode = |byte: u8| table.get(usize::from(byte)).copied().unwrap_or(0.0);
    let (across, down) = (picture.width() / BLOCK, picture.height() / BLOCK);
    let mut sums = vec![Vec3::ZERO; across * down];
    for (y, row) in picture
        .pixels()
        .chunks_exact(picture.width().max(1) * 3)
        .enumerate()
    {
        for (x, pixel) in row.as_chunks::<3>().0.iter().enumerate() {
            if x / BLOCK < across
                && let Some(sum) = sums.get_mut(y / BLOCK * across + x / BLOCK)
            {
                *sum += Vec3::from_array(pixel.map(decode));
            }
        }
    }
    sums.into_iter()
        .map(|s| s / (BLOCK * BLOCK) as f32)
        .collect()
}

/// CIE 1976 (u', v') of a linear colour; (0, 0) for black.
fn chromaticity(linear: Vec3) -> Vec2 {
    let [x, y, z] = (TO_XYZ * linear).to_array();
    let sum = x + 15.0 * y + 3.0 * z;
    if sum > 0.0 {
        Vec2::new(4.0 * x, 9.0 * y) / sum
    } else {
        Vec2::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(color: [u8; 3]) -> Rgb8 {
        Rgb8::new(20, 17, color.repeat(20 * 17)).unwrap()
    }

    #[test]
    fn brightness_is_no_colour_but_paleness_is_a_difference() {
        let mut same = ColorDifference::default();
        same.add(&even([120; 3]), &even([240; 3]));
        assert_eq!(same.blocks, 4);
        assert!(same.mean() < 1e-6, "{same:?}");
        let mut paler = ColorDifference::default();
        paler.add(&even([200, 150, 150]), &even([200, 100, 100]));
        assert!(paler.mean() > 0.02 && paler.saturation() < 0.7, "{paler:?}");
        // chromaticity of sRGB's red, from the standard
        let red = chromaticity(Vec3::X);
        assert!(red.distance(Vec2::new(0.4507, 0.5229)) < 1e-3, "{red}");
        let mut dark = ColorDifference::default();
        dark.add(&even([3, 0, 0]), &even([0, 3, 0]));
        assert_eq!(dark, ColorDifference::default());
        paler.join(&same);
        assert_eq!(paler.blocks, 8);
    }
}
