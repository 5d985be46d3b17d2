//! Sky light as q3map2 computes it: by suns.
//!
//! `q3map_skylight v n` gives rows of suns at elevations that are 90 / n degrees apart, from half a step above the
//! horizon to one and a half below the zenith, 4 (n − 1) in each row, and one in the zenith, of v divided by their number
//! each. Rows have equal numbers, so suns are closer to each other near the zenith. With a sky box each has the colour
//! of the box around it, divided by the largest channel of all.

use super::{Finder, SUN_IRRADIANCE, SunLight};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Least and most `iterations`.
const ITERATIONS: (i32, i32) = (2, 16);

/// Places along each side of an image of the box.
const SIDE: u32 = 16;

/// The images of a sky box, as directions with their colour.
pub(super) struct SkyBox {
    probes: Vec<(Vec3, Vec3)>,
}

impl SkyBox {
    /// Reads the six images. `None` if one is absent.
    pub fn new(finder: &mut Finder<'_>, outer: &str) -> Option<SkyBox> {
        // from the place in an image, each -1 to 1 from its upper left, to a direction
        type Direction = fn(f32, f32) -> Vec3;
        let sides: [(&str, Direction); 6] = [
            ("lf", |u, v| Vec3::new(-1.0, u, -v)),
            ("rt", |u, v| Vec3::new(1.0, -u, -v)),
            ("ft", |u, v| Vec3::new(-u, -1.0, -v)),
            ("bk", |u, v| Vec3::new(u, 1.0, -v)),
            ("up", |u, v| Vec3::new(v, -u, 1.0)),
            ("dn", |u, v| Vec3::new(-v, -u, -1.0)),
        ];
        let mut probes = Vec::new();
        for (side, direction) in sides {
            let image = finder.image(&format!("{outer}_{side}"))?;
            let pixels: Vec<[u8; 4]> = image.pixels().collect();
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let at = |i: u32, size: u32| (i * size + size / 2) / SIDE;
                    let index = at(y, image.height) * image.width + at(x, image.width);
                    let [r, g, b, _] = pixels.get(index as usize).copied()?;
                    let place = |i: u32| (2 * i + 1) as f32 / SIDE as f32 - 1.0;
                    let towards = direction(place(x), place(y));
                    // the part of the sphere that a place of the image has, as q3map2 weights it
                    let weight = towards.length_recip() / 255.0;
                    let color = Vec3::from_array([r, g, b].map(f32::from));
                    probes.push((towards.normalize(), color * weight));
                }
            }
        }
        Some(SkyBox { probes })
    }

    /// Mean colour around a direction, of the upper half.
    fn color(&self, direction: Vec3) -> Vec3 {
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for (towards, color) in self.probes.iter().filter(|(towards, _)| towards.z >= 0.0) {
            let cosine = towards.dot(direction);
            if cosine > 0.0 {
                sum += *color * cosine;
                weights += cosine;
            }
        }
        sum / f32::max(weights, 1.0e-6)
    }
}

/// The suns of a sky light. `color`: that of skies without images.
pub(super) fn sky_suns(
    value: f32,
    iterations: i32,
    color: Vec3,
    images: Option<&SkyBox>,
) -> impl Iterator<Item = SunLight> {
    let n = iterations.clamp(ITERATIONS.0, ITERATIONS.1);
    let around = 4 * (n - 1);
    let step = FRAC_PI_2 / n as f32;
    let (low, high) = (0.5 * step, FRAC_PI_2 - 1.5 * step);
    let rows = (1.0 + ((high - low) / step).max(0.0)).round() as i32;
    let mut directions = Vec::new();
    let mut azimuth = 0.0f32;
    for row in 0..rows {
        let elevation = low.min(FRAC_PI_2) + step * row as f32;
        for _ in 0..around {
            let ((sin, cos), (up, aside)) = (azimuth.sin_cos(), elevation.sin_cos());
            directions.push(Vec3::new(cos * aside, sin * aside, up));
            azimuth += TAU / around as f32;
        }
        azimuth += TAU / (around * rows) as f32;
    }
    directions.push(Vec3::Z);
    let mut colors = vec![color; directions.len()];
    if let Some(images) = images {
        for (color, direction) in colors.iter_mut().zip(&directions) {
            *color = images.color(*direction);
        }
        let most = colors.iter().map(|c| c.max_element()).fold(0.0, f32::max);
        if most > 0.0 {
            colors.iter_mut().for_each(|color| *color /= most);
        }
    }
    let one = value.max(0.0) / directions.len() as f32 * SUN_IRRADIANCE;
    directions
        .into_iter()
        .zip(colors)
        .map(move |(direction, color)| SunLight {
            direction,
            irradiance: color * one,
            angular_radius: 0.0,
            material: None,
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;
    use crate::image::tests::rgb_tga;

    #[test]
    fn suns_are_in_equal_rows_and_one_in_the_zenith() {
        let suns: Vec<SunLight> = sky_suns(130.0, 5, Vec3::ONE, None).collect();
        // 16 suns in each of 4 rows at 9, 27, 45 and 63 degrees
        assert_eq!(suns.len(), 65);
        let elevation = |sun: &SunLight| sun.direction.z.asin().to_degrees();
        for (row, degrees) in [9.0f32, 27.0, 45.0, 63.0].into_iter().enumerate() {
            let own = &suns[row * 16..row * 16 + 16];
            assert!(
                own.iter()
                    .all(|sun| (elevation(sun) - degrees).abs() < 1e-3)
            );
            let sum: Vec3 = own.iter().map(|sun| sun.direction).sum();
            assert!(sum.truncate().length() < 1e-4, "{sum}");
        }
        assert_eq!(suns[64].direction, Vec3::Z);
        let sum: f32 = suns.iter().map(|sun| sun.irradiance.x).sum();
        assert!((sum / SUN_IRRADIANCE - 130.0).abs() < 1e-2);
        assert_eq!(sky_suns(1.0, 0, Vec3::ONE, None).count(), 5);
        assert!(sky_suns(1.0, i32::MAX, Vec3::ONE, None).count() < 1000);
    }

    #[test]
    fn suns_have_the_colour_of_the_box_behind_them() {
        let mut files = MemoryFiles::new();
        for side in ["lf", "rt", "ft", "bk", "up", "dn"] {
            // grey above, red towards +x, blue elsewhere; TGA has blue first
            let color = match side {
                "rt" => [0, 0, 200],
                "up" => [100, 100, 100],
                _ => [100, 0, 0],
            };
            let texels: Vec<u8> = color.repeat(16);
            files
                .insert(&format!("env/box_{side}.tga"), rgb_tga(4, 4, &texels))
                .unwrap();
        }
        let mut finder = Finder::new(&files, 1.0);
        let images = SkyBox::new(&mut finder, "env/box").unwrap();
        let suns: Vec<SunLight> = sky_suns(100.0, 3, Vec3::ONE, Some(&images)).collect();
        let towards = |direction: Vec3| {
            let dot = |sun: &&SunLight| sun.direction.dot(direction);
            let nearest = suns.iter().max_by(|a, b| dot(a).total_cmp(&dot(b)));
            nearest.unwrap().irradiance
        };
        let (east, west) = (towards(Vec3::X), towards(Vec3::NEG_X));
        assert!(
            east.x > 2.0 * east.z && west.z > 2.0 * west.x,
            "{east} {west}"
        );
        let zenith = towards(Vec3::Z);
        assert!((zenith.y - zenith.x).abs() < 0.4 * zenith.x, "{zenith}");
        let most = suns.iter().map(|sun| sun.irradiance.max_element());
        let whole = 100.0 / suns.len() as f32 * SUN_IRRADIANCE;
        assert!((most.fold(0.0, f32::max) / whole - 1.0).abs() < 1e-4);
        assert!(SkyBox::new(&mut finder, "env/none").is_none());
    }
}
