//! The sky as a box: the images of its script, or, where it has clouds, pictures of both together; and as one picture
//! all round.
//!
//! Source: the axes of the box's sides and the dome of the clouds are the engine's; see the classic look.

use super::images::load;
use super::look::Picture;
use super::stack::texel;
use crate::files::GameFiles;
use crate::image::Image;
use crate::materials::light::{StageSample, compose};
use crate::overbright::{self, ByteEncoder};
use crate::world::WorldMaterial;
use glam::{Vec2, Vec3, Vec4};
use shaderscript::eval;
use shaderscript::{Shader, Sky, StageImage};

/// Side of the pictures of skies with clouds.
const SIZE: u32 = 512;
/// Radius of the planet under the clouds, id units.
const PLANET: f32 = 4096.0;

/// What is seen on a side of the box; `None` where nothing is.
pub fn picture(files: &dyn GameFiles, material: &WorldMaterial, side: usize) -> Option<Picture> {
    let shader = definition(material);
    let outer = outer(shader, side).filter(|name| crate::image::find(files, name).is_some());
    if shader.stages.is_empty() {
        return outer.map(Picture::File);
    }
    Some(Picture::Sky {
        name: material.name.to_ascii_lowercase(),
        side,
    })
}

/// The script's definition, if it is drawn.
pub fn definition(material: &WorldMaterial) -> &Shader {
    let resolved = &material.resolved;
    match &resolved.script {
        // Sides of the box may be missing; stages may not.
        Some(script) if resolved.fault.is_none() || script.stages.is_empty() => script,
        _ => &resolved.shader,
    }
}

fn outer(shader: &Shader, side: usize) -> Option<String> {
    let outer = shader.sky.as_ref()?.outer.as_ref()?;
    Some(format!("{outer}_{}", Sky::SIDES.get(side)?))
}

/// Coordinates on the cloud layer in a direction, clouds `height` above the ground: where the direction meets a
/// sphere around the planet's middle, as arc cosines of the unit vector there.
fn cloud_coordinates(direction: Vec3, height: f32) -> Vec2 {
    let d = direction.normalize();
    let along = -d.z * PLANET
        + (d.z * d.z * PLANET * PLANET + 2.0 * PLANET * height + height * height)
            .max(0.0)
            .sqrt();
    let v = (d * along + Vec3::Z * PLANET).normalize();
    Vec2::new(v.x.clamp(-1.0, 1.0).acos(), v.y.clamp(-1.0, 1.0).acos())
}

/// The picture of a side, as it is when the map begins.
pub fn bake(files: &dyn GameFiles, shader: &Shader, side: usize) -> Option<Image> {
    let outer = outer(shader, side).and_then(|name| Some(load(files, &name)?.0));
    let height = shader.sky.as_ref().map_or(512.0, |sky| sky.cloud_height);
    let images: Vec<Option<Image>> = shader
        .stages
        .iter()
        .map(|stage| Some(load(files, stage.image.names().first()?)?.0))
        .collect();
    let (table, encoder) = (overbright::byte_table(), ByteEncoder::new());
    let colors: Vec<Vec4> = shader.stages.iter().map(super::stack::mean_color).collect();
    let mut rgba = Vec::with_capacity((SIZE * SIZE * 4) as usize);
    let mut samples = Vec::with_capacity(images.len());
    let at = |i: u32| (i as f32 + 0.5) / SIZE as f32;
    for y in 0..SIZE {
        for x in 0..SIZE {
            let (u, v) = (at(x), at(y));
            let behind = outer
                .as_ref()
                .map_or(Vec4::ZERO, |image| texel(image, Vec2::new(u, v), &table));
            let direction = Sky::side_point(side, u * 2.0 - 1.0, 1.0 - v * 2.0);
            let mut color = behind.truncate();
            // The clouds' dome has no floor.
            if side != 5 {
                let st = cloud_coordinates(direction, height);
                samples.clear();
                for ((stage, image), color) in shader.stages.iter().zip(&images).zip(&colors) {
                    let st = eval::apply_tc_mods(&stage.tc_mods, st, direction, 0.0, Vec2::ZERO);
                    let texture = match (&stage.image, image) {
                        (_, Some(image)) => texel(image, st, &table),
                        (StageImage::White | StageImage::Lightmap, None) => Vec4::ONE,
                        _ => Vec4::W,
                    };
                    samples.push(StageSample {
                        texture,
                        color: *color,
                        ..StageSample::WHITE
                    });
                }
                let drawn = compose(&shader.stages, &samples, false);
                color = drawn.evaluate(Vec3::ONE, color);
            }
            let byte = |v: f32| encoder.byte(v);
            rgba.extend(color.to_array().map(byte));
            rgba.push(255);
        }
    }
    Image::from_rgba(SIZE, SIZE, rgba)
}

/// Widest picture all round.
const WIDEST: u32 = 4096;

/// Direction of a place of a picture all round, map space: its middle shows the map's x, its left half y; the upper edge
/// is above.
pub fn direction(u: f32, v: f32) -> Vec3 {
    let azimuth = (0.5 - u) * std::f32::consts::TAU;
    let elevation = (0.5 - v) * std::f32::consts::PI;
    let (level, z) = (elevation.cos(), elevation.sin());
    Vec3::new(level * azimuth.cos(), level * azimuth.sin(), z)
}

/// The side of the box in a direction, and where on it, from the left and from above in 0..1.
fn side_of(direction: Vec3) -> (usize, Vec2) {
    let mut found = (0, Vec2::splat(0.5));
    let mut nearest = 0.0;
    for side in 0..6 {
        let middle = Sky::side_point(side, 0.0, 0.0);
        let depth = direction.dot(middle);
        if depth > nearest {
            nearest = depth;
            let right = Sky::side_point(side, 1.0, 0.0) - middle;
            let up = Sky::side_point(side, 0.0, 1.0) - middle;
            let (s, t) = (direction.dot(right) / depth, direction.dot(up) / depth);
            found = (side, Vec2::new((s + 1.0) * 0.5, (1.0 - t) * 0.5));
        }
    }
    found
}

/// The sky as one picture all round (equirectangular); `None` where no side has a picture.
pub fn panorama(files: &dyn GameFiles, shader: &Shader) -> Option<Image> {
    let sides: [Option<Image>; 6] = std::array::from_fn(|side| match shader.stages.is_empty() {
        true => Some(load(files, &outer(shader, side)?)?.0),
        false => bake(files, shader, side),
    });
    let largest = sides.iter().flatten().map(|side| side.width).max()?;
    let width = largest.saturating_mul(4).clamp(16, WIDEST);
    let height = width / 2;
    let table = overbright::byte_table();
    let encoder = ByteEncoder::new();
    let byte = |v: f32| encoder.byte(v);
    let mut rgba = Vec::with_capacity((width * height * 4) as usize);
    for y in 0..height {
        for x in 0..width {
            let mut sum = Vec3::ZERO;
            for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
                let u = (x as f32 + dx) / width as f32;
                let v = (y as f32 + dy) / height as f32;
                let (side, place) = side_of(direction(u, v));
                if let Some(Some(picture)) = sides.get(side) {
                    sum += picture.linear_texel(place, true, &table).truncate();
                }
            }
            rgba.extend((sum / 4.0).to_array().map(byte));
            rgba.push(255);
        }
    }
    Image::from_rgba(width, height, rgba)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_meet_and_look_inward() {
        // the right edge of a side is the left edge of the next, going round to the right
        for (side, next) in [(0, 3), (3, 2), (2, 1), (1, 0)] {
            assert_eq!(
                Sky::side_point(side, 1.0, 0.5),
                Sky::side_point(next, -1.0, 0.5),
                "{side}"
            );
        }
        assert_eq!(Sky::side_point(0, 0.0, 1.0), Sky::side_point(4, 0.0, -1.0));
        for side in 0..6 {
            let right = Sky::side_point(side, 1.0, 0.0) - Sky::side_point(side, -1.0, 0.0);
            let up = Sky::side_point(side, 0.0, 1.0) - Sky::side_point(side, 0.0, -1.0);
            // right × up points to the viewer in the middle
            assert!(
                right.cross(up).dot(Sky::side_point(side, 0.0, 0.0)) < 0.0,
                "{side}"
            );
        }
    }

    #[test]
    fn clouds_overhead_are_at_a_quarter_turn() {
        let uv = cloud_coordinates(Vec3::Z, 512.0);
        assert!((uv - Vec2::splat(std::f32::consts::FRAC_PI_2)).length() < 1.0e-6);
    }

    #[test]
    fn places_of_the_picture_all_round_are_on_the_side_that_shows_them() {
        for side in 0..6 {
            for (s, t) in [(0.0, 0.0), (0.5, -0.25), (-0.7, 0.9)] {
                let (found, place) = side_of(Sky::side_point(side, s, t).normalize());
                assert_eq!(found, side);
                let want = Vec2::new((s + 1.0) * 0.5, (1.0 - t) * 0.5);
                assert!((place - want).length() < 1.0e-5, "{side} {place} {want}");
            }
        }
        assert!((direction(0.5, 0.5) - Vec3::X).length() < 1.0e-6);
        assert!((direction(0.25, 0.5) - Vec3::Y).length() < 1.0e-6);
        assert!((direction(0.1, 0.0) - Vec3::Z).length() < 1.0e-6);
    }
}
