//! A panorama out of six square views.

use glam::Vec3;
use renderer_vk::api::Picture;
use std::f32::consts::{PI, TAU};

/// Axes (forward, left, up) of the six views, each of 90 degrees.
pub const FACES: [[Vec3; 3]; 6] = [
    [Vec3::X, Vec3::Y, Vec3::Z],
    [Vec3::Y, Vec3::NEG_X, Vec3::Z],
    [Vec3::NEG_X, Vec3::NEG_Y, Vec3::Z],
    [Vec3::NEG_Y, Vec3::X, Vec3::Z],
    [Vec3::Z, Vec3::Y, Vec3::NEG_X],
    [Vec3::NEG_Z, Vec3::Y, Vec3::X],
];

/// Side of the views for a panorama of this width: their middle has its resolution.
pub fn side(width: u32) -> u32 {
    (width as f32 / PI).ceil() as u32
}

/// Joins the views to an equirectangular panorama, `width` x `width / 2` pixels: the middle column looks along
/// `yaw` (degrees), rows from the zenith. `None` unless there are six square views.
pub fn join(faces: &[Picture], width: u32, yaw: f32) -> Option<Picture> {
    let faces: &[Picture; 6] = faces.try_into().ok()?;
    let square = |f: &Picture| {
        let bytes = f.width as usize * f.height as usize * 3;
        f.width == f.height && f.width > 1 && f.rgb.len() == bytes
    };
    if !faces.iter().all(square) {
        return None;
    }
    let height = (width / 2).max(1);
    let mut rgb = Vec::with_capacity(width as usize * height as usize * 3);
    for y in 0..height {
        let elevation = (0.5 - (y as f32 + 0.5) / height as f32) * PI;
        for x in 0..width {
            let turn = yaw.to_radians() + (0.5 - (x as f32 + 0.5) / width as f32) * TAU;
            let flat = elevation.cos();
            let direction = Vec3::new(turn.cos() * flat, turn.sin() * flat, elevation.sin());
            rgb.extend(seen(faces, direction));
        }
    }
    Some(Picture { width, height, rgb })
}

/// The colour in a direction, interpolated.
fn seen(faces: &[Picture; 6], direction: Vec3) -> [u8; 3] {
    let ahead = |(_, axes): &(usize, &[Vec3; 3])| direction.dot(axes[0]);
    let best = FACES.iter().enumerate();
    let best = best.max_by(|a, b| ahead(a).total_cmp(&ahead(b)));
    let Some((index, [forward, left, up])) = best else {
        return [0; 3];
    };
    let face = &faces[index.min(5)];
    let depth = direction.dot(*forward);
    let place = |axis: Vec3| (0.5 - 0.5 * direction.dot(axis) / depth) * face.width as f32 - 0.5;
    let most = (face.width - 1) as f32;
    let (x, y) = (place(*left).clamp(0.0, most), place(*up).clamp(0.0, most));
    let texel = |x: f32, y: f32, channel: usize| {
        let at = (y as usize * face.width as usize + x as usize) * 3 + channel;
        face.rgb.get(at).map_or(0.0, |v| f32::from(*v))
    };
    let (x0, y0) = (x.floor(), y.floor());
    let (x1, y1) = ((x0 + 1.0).min(most), (y0 + 1.0).min(most));
    [0, 1, 2].map(|channel| {
        let row = |y| {
            let (a, b) = (texel(x0, y, channel), texel(x1, y, channel));
            a + (b - a) * (x - x0)
        };
        let (a, b) = (row(y0), row(y1));
        (a + (b - a) * (y - y0)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A colour for a direction: smooth over the sphere.
    fn color(direction: Vec3) -> [u8; 3] {
        let d = direction.normalize();
        d.to_array().map(|v| (127.5 + 120.0 * v).round() as u8)
    }

    #[test]
    fn every_direction_of_the_panorama_has_its_colour() {
        let size = 64;
        let faces: Vec<Picture> = FACES
            .iter()
            .map(|[forward, left, up]| {
                let mut rgb = Vec::new();
                for y in 0..size {
                    for x in 0..size {
                        let unit = |v: u32| (v as f32 + 0.5) / size as f32 * 2.0 - 1.0;
                        rgb.extend(color(*forward - *left * unit(x) - *up * unit(y)));
                    }
                }
                Picture {
                    width: size,
                    height: size,
                    rgb,
                }
            })
            .collect();
        let yaw = 90.0f32;
        let joined = join(&faces, 128, yaw).unwrap();
        assert_eq!((joined.width, joined.height), (128, 64));
        for y in 0..64u32 {
            for x in 0..128u32 {
                let elevation = (0.5 - (y as f32 + 0.5) / 64.0) * PI;
                let turn = yaw.to_radians() + (0.5 - (x as f32 + 0.5) / 128.0) * TAU;
                let flat = elevation.cos();
                let expected = color(Vec3::new(
                    turn.cos() * flat,
                    turn.sin() * flat,
                    elevation.sin(),
                ));
                let at = ((y * 128 + x) * 3) as usize;
                for channel in 0..3 {
                    let found = joined.rgb[at + channel];
                    assert!(
                        found.abs_diff(expected[channel]) <= 3,
                        "{x} {y}: {found} {expected:?}"
                    );
                }
            }
        }
        assert!(join(&faces[1..], 128, 0.0).is_none());
    }

    #[test]
    fn axes_of_views_are_right_handed() {
        for [forward, left, up] in FACES {
            assert_eq!(forward.cross(left), up);
        }
    }
}
