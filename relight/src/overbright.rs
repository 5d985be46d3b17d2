//! Overbright, gamma and sRGB: conversion of stored bytes to light.
//!
//! Map compilers store light at a quarter of its displayed strength, so that a lightmap can hold
//! more than display white: *overbright*. The engine shifts lightmap texels, vertex colours and
//! light-grid points left by `r_mapOverBrightBits - r_overBrightBits` when it loads a map, and keeps
//! the hue when a channel runs over ([`shift`]); what the hardware's gamma ramp adds back makes the
//! whole ×4 in *encoded* (gamma) space whatever the split. Everything that Relight traces is linear
//! ([`to_linear`]).
//!
//! Source: behaviour of ioquake3's `renderer_opengl1`; IEC 61966-2-1 for the sRGB curve.

use glam::Vec3;

/// Default of `r_mapOverBrightBits`: stored light is shifted by two bits in all, that is ×4.
pub const MAP_OVERBRIGHT_BITS: u32 = 2;

/// Shifts stored light left by `bits` (encoded space); when a channel passes 255, all are scaled so
/// that the largest is 255 and the hue stays.
pub fn shift(rgb: [u8; 3], bits: u32) -> [u8; 3] {
    let bits = bits.min(8);
    let wide = rgb.map(|c| u32::from(c) << bits);
    let max = wide.into_iter().max().unwrap_or(0);
    let keep = |c: u32| u8::try_from(if max > 255 { c * 255 / max } else { c }).unwrap_or(u8::MAX);
    wide.map(keep)
}

/// [`shift`] for a colour with alpha, which stays as it is.
pub fn shift_rgba(rgba: [u8; 4], bits: u32) -> [u8; 4] {
    let [r, g, b, a] = rgba;
    let [r, g, b] = shift([r, g, b], bits);
    [r, g, b, a]
}

/// Linear value of an sRGB-encoded one; both 1 at display white. Values above 1 continue the curve,
/// negative ones give 0.
pub fn to_linear(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        (encoded / 12.92).max(0.0)
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Exponent of the power law that [`to_linear`] comes to around a value, d ln D / d ln x: 1 near black, up to 2.4.
pub fn exponent(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        1.0
    } else {
        2.4 * encoded / (encoded + 0.055)
    }
}

/// sRGB-encoded value of a linear one: the inverse of [`to_linear`].
pub fn from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        (linear * 12.92).max(0.0)
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Relative luminance of a linear colour (ITU-R BT.709-6, whose primaries are sRGB's).
pub fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// What a display's gamma ramp shows for every byte: `c^(1/gamma)`, then shifted left by `bits`.
pub fn gamma_table(gamma: f32, bits: u32) -> [u8; 256] {
    std::array::from_fn(|i| {
        let value = (i as f32 / 255.0).powf(1.0 / gamma) * 255.0 + 0.5;
        ((value as u32) << bits.min(8)).min(255) as u8
    })
}

/// Linear value (0..=1) of every sRGB-encoded byte.
pub fn byte_table() -> [f32; 256] {
    std::array::from_fn(|i| to_linear(i as f32 / 255.0))
}

/// Linear values to sRGB-encoded bytes, without a power for each: the byte nearest to [`from_linear`].
pub struct ByteEncoder {
    /// For each of equal parts of 0..=1 the byte of its least value.
    first: Vec<u8>,
    /// The least value of each byte.
    least: [f32; 256],
}

impl ByteEncoder {
    /// Parts of 0..=1: few bytes begin in one.
    const PARTS: usize = 16_384;

    /// The tables.
    pub fn new() -> ByteEncoder {
        let least = std::array::from_fn(|byte| to_linear((byte as f32 - 0.5) / 255.0));
        let byte_of = |v: f32| least.partition_point(|&l| l <= v).saturating_sub(1) as u8;
        let part = |i: usize| byte_of(i as f32 / Self::PARTS as f32);
        ByteEncoder {
            first: (0..=Self::PARTS).map(part).collect(),
            least,
        }
    }

    /// The byte of a value, which is limited to 0..=1; 0 for what is no number.
    pub fn byte(&self, linear: f32) -> u8 {
        let v = linear.clamp(0.0, 1.0);
        let first = self.first.get((v * Self::PARTS as f32) as u32 as usize);
        let mut byte = first.copied().unwrap_or(0);
        while self
            .least
            .get(usize::from(byte) + 1)
            .is_some_and(|&l| v >= l)
        {
            byte += 1;
        }
        byte
    }
}

impl Default for ByteEncoder {
    fn default() -> Self {
        ByteEncoder::new()
    }
}

/// Linear colour of an sRGB-encoded one, channel by channel.
pub fn colour_to_linear(encoded: Vec3) -> Vec3 {
    Vec3::new(
        to_linear(encoded.x),
        to_linear(encoded.y),
        to_linear(encoded.z),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_the_nearest() {
        let encoder = ByteEncoder::new();
        for step in 0..=100_000u32 {
            let v = step as f32 / 100_000.0;
            let exact = from_linear(v) * 255.0;
            let off = (exact - f32::from(encoder.byte(v))).abs();
            assert!(off <= 0.5001, "{v}: {exact} {}", encoder.byte(v));
        }
        assert_eq!(encoder.byte(-1.0), 0);
        assert_eq!((encoder.byte(2.0), encoder.byte(f32::NAN)), (255, 0));
    }

    #[test]
    fn shift_keeps_hue() {
        assert_eq!(shift([10, 20, 30], 2), [40, 80, 120]);
        assert_eq!(shift([200, 100, 50], 2), [255, 127, 63]);
        assert_eq!(shift([1, 2, 3], 0), [1, 2, 3]);
        assert_eq!(shift([255, 255, 255], 99), [255, 255, 255]);
        assert_eq!(shift_rgba([64, 0, 0, 7], 2), [255, 0, 0, 7]);
    }

    #[test]
    fn gamma_brightens_and_bits_double() {
        let plain = gamma_table(1.0, 0);
        assert!(plain.iter().zip(0..=255).all(|(a, b)| *a == b));
        let bright = gamma_table(2.0, 1);
        assert_eq!((bright[0], bright[16], bright[255]), (0, 128, 255));
    }

    #[test]
    fn srgb_round_trip() {
        for i in 0..=255u8 {
            let encoded = f32::from(i) / 255.0;
            assert!((from_linear(to_linear(encoded)) - encoded).abs() < 1e-5);
        }
        assert!((to_linear(0.5) - 0.2140).abs() < 1e-4);
        assert!(to_linear(4.0) > 16.0);
        assert_eq!(to_linear(-1.0), 0.0);
    }
}
