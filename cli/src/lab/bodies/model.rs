//! Made-up models and their places.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use q3bsp::Bsp;
use q3model::{Frame, Md3, PackedVertex, Surface};
use relight::{FileError, MemoryFiles};
use renderer_vk::api::RefEntity;

/// Game paths of the models.
pub const ANIMATED: &str = "models/bodies/animated.md3";
pub const STILL: &str = "models/bodies/still.md3";

const SCRIPT: &str = "
bodies/skin
{
    {
        map $whiteimage
        rgbGen lightingDiffuse
    }
}
";

/// Key frames of the animated model.
const FRAMES: usize = 16;

/// The models and their material.
///
/// # Errors
/// None in practice: all paths are well-formed.
pub fn files() -> Result<MemoryFiles, FileError> {
    let mut files = MemoryFiles::new();
    files.insert("scripts/bodies.shader", SCRIPT)?;
    files.insert(ANIMATED, ball(ANIMATED, 14.0, 10, FRAMES).write())?;
    files.insert(STILL, ball(STILL, 2.0, 2, 1).write())?;
    Ok(files)
}

/// A ball of `rings` bands of twice as many quads; waves run around it over its frames.
fn ball(name: &str, radius: f32, rings: usize, frames: usize) -> Md3 {
    let columns = 2 * rings;
    let corners = || (0..=rings).flat_map(|ring| (0..=columns).map(move |column| (ring, column)));
    let vertex = |frame: usize, (ring, column): (usize, usize)| {
        let down = ring as f32 / rings as f32 * PI;
        let around = (column % columns) as f32 / columns as f32 * TAU;
        let normal = (Vec2::from_angle(around) * down.sin()).extend(down.cos());
        let phase = frame as f32 / frames as f32 * TAU;
        let wave = match frames {
            1 => 1.0,
            _ => 1.0 + 0.3 * (3.0 * around + phase).sin() * down.sin(),
        };
        PackedVertex::pack(normal * (radius * wave), normal)
    };
    let row = columns as u32 + 1;
    let quads = (0..rings as u32).flat_map(|ring| (0..row - 1).map(move |at| ring * row + at));
    let surface = Surface {
        name: "ball".into(),
        shaders: vec!["bodies/skin".into()],
        // clockwise as seen from outside
        triangles: quads
            .flat_map(|a| [[a, a + 1, a + row], [a + row, a + 1, a + row + 1]])
            .collect(),
        st: corners().map(|_| Vec2::ZERO).collect(),
        vertices: (0..frames)
            .flat_map(|frame| corners().map(move |corner| vertex(frame, corner)))
            .collect(),
        num_verts: corners().count(),
    };
    let frame = |number: usize| Frame {
        mins: Vec3::splat(-1.3 * radius),
        maxs: Vec3::splat(1.3 * radius),
        local_origin: Vec3::ZERO,
        radius: 1.3 * radius,
        name: format!("{number}"),
    };
    Md3 {
        name: name.to_owned(),
        frames: (0..frames).map(frame).collect(),
        tags: Vec::new(),
        num_tags: 0,
        surfaces: vec![surface],
    }
}

/// The number after the point whose digits are those of `n` in reverse order (van der Corput).
fn reversed(mut n: u32, base: u32) -> f32 {
    let (mut value, mut digit) = (0.0, 1.0);
    while n > 0 {
        digit /= base as f32;
        value += digit * (n % base) as f32;
        n /= base;
    }
    value
}

/// Points in the open space of a map, evenly (Halton).
pub fn places(bsp: &Bsp, count: usize) -> Vec<Vec3> {
    let Some(world) = bsp.models.first() else {
        return Vec::new();
    };
    let points = (1..u32::MAX).map(|n| {
        let part = Vec3::from_array([2, 3, 5].map(|base| reversed(n, base)));
        world.mins + (world.maxs - world.mins) * part
    });
    // a map may have no open space
    let most = count.saturating_mul(1000).saturating_add(100_000);
    let open = points.take(most).filter(|p| bsp.cluster_at(*p) >= 0);
    open.take(count).collect()
}

/// Moves body `number` to its key frames in frame `time`.
pub fn animate(body: &mut RefEntity, number: usize, time: usize) {
    let frames = FRAMES as i32;
    let at = (number % FRAMES + time % FRAMES) as i32;
    body.frame = at % frames;
    body.old_frame = (at + frames - 1) % frames;
    body.backlerp = 0.5;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_closed_and_look_outwards() {
        for (name, radius, rings, frames) in [(ANIMATED, 14.0, 10, FRAMES), (STILL, 2.0, 2, 1)] {
            let model = Md3::parse(&ball(name, radius, rings, frames).write()).unwrap();
            assert_eq!(model.frames.len(), frames);
            let surface = &model.surfaces[0];
            assert_eq!(surface.triangles.len(), 4 * rings * rings);
            for frame in 0..frames {
                let vertices = surface.frame_vertices(frame);
                for corners in &surface.triangles {
                    let [a, b, c] = corners.map(|i| vertices[i as usize].position());
                    assert!((c - a).cross(b - a).dot(a + b + c) >= -1.0e-3);
                }
            }
        }
    }

    #[test]
    fn numbers_are_reversed() {
        let halves: Vec<f32> = (1..5).map(|n| reversed(n, 2)).collect();
        assert_eq!(halves, [0.5, 0.25, 0.75, 0.125]);
    }
}
