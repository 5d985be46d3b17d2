//! Key-framed models: frames, level of detail, interpolated vertices.
//!
//! Source: engine behaviour of `renderer_opengl1` (model surfaces).

use std::sync::OnceLock;

use glam::Vec3;
use q3model::{Frame, PackedVertex, Surface};
use shaders::types::Vertex;

use super::View;
use crate::api::{RefEntity, renderfx};
use crate::settings::Settings;

/// Upper limit of `r_lodscale`.
const MAX_LOD_SCALE: f32 = 20.0;

/// The two key frames of an entity, and the weight of the previous one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frames {
    pub new: usize,
    pub old: usize,
    pub backlerp: f32,
}

impl Frames {
    /// The key frames of an entity with a model of `count` frames: wrapped if the entity asks for it; both 0 if either
    /// is out of range.
    pub fn of(entity: &RefEntity, count: usize) -> Self {
        let frame = |frame: i32| {
            let frame = i64::from(frame);
            let count = i64::try_from(count).unwrap_or(i64::MAX).max(1);
            let wraps = entity.renderfx & renderfx::WRAP_FRAMES != 0;
            let frame = if wraps { frame % count } else { frame };
            usize::try_from(frame)
                .ok()
                .filter(|&f| (f as u64) < count as u64)
        };
        match (frame(entity.frame), frame(entity.old_frame)) {
            (Some(new), Some(old)) => Self {
                new,
                old,
                backlerp: if new == old || !entity.backlerp.is_finite() {
                    0.0
                } else {
                    entity.backlerp
                },
            },
            _ => Self {
                new: 0,
                old: 0,
                backlerp: 0.0,
            },
        }
    }
}

/// Level of detail of a model with `levels` of them, by the projected size of its frame.
pub(super) fn level_of_detail(
    levels: usize,
    frame: &Frame,
    origin: Vec3,
    view: &View,
    settings: &Settings,
) -> usize {
    let last = levels.saturating_sub(1);
    if last == 0 {
        return 0;
    }
    let radius = frame.mins.abs().max(frame.maxs.abs()).length();
    let distance = view.axis[0].dot(origin - view.origin);
    let size = if distance <= 0.0 {
        0.0
    } else {
        (radius / (view.tan_y * distance)).min(1.0)
    };
    // a model behind the camera has projected size 0, which selects the finest level
    let level = if size == 0.0 {
        0.0
    } else {
        (1.0 - size * settings.lod_scale.min(MAX_LOD_SCALE)) * levels as f32
    };
    let clamp = |level: i64| usize::try_from(level.max(0)).unwrap_or(last).min(last);
    let chosen = i64::try_from(clamp(level as i64)).unwrap_or(0);
    clamp(chosen + i64::from(settings.lod_bias))
}

/// Sines of the 256 angles of a packed normal. The engine's table has 1024 entries over 1023 steps, so its angles are
/// 1024/1023 of the exact ones.
fn sines() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|i| (i as f32 * (4.0 * std::f32::consts::TAU / 1023.0)).sin())
    })
}

/// The normal of a packed vertex by that table; [`PackedVertex::normal`] is exact.
fn normal(vertex: PackedVertex, sines: &[f32; 256]) -> Vec3 {
    let [longitude, latitude] = vertex.normal.to_le_bytes();
    let sine = |angle: u8| sines[usize::from(angle)];
    let cosine = |angle: u8| sines[usize::from(angle.wrapping_add(64))];
    Vec3::new(
        cosine(latitude) * sine(longitude),
        sine(latitude) * sine(longitude),
        cosine(longitude),
    )
}

/// Appends the vertices of a surface between two frames: model space, white.
pub(super) fn append_vertices(surface: &Surface, frames: Frames, out: &mut Vec<Vertex>) {
    let sines = sines();
    let new = surface.frame_vertices(frames.new);
    let vertex = |position, normal, st| Vertex {
        position,
        normal,
        st,
        color: u32::MAX,
        ..Vertex::default()
    };
    if frames.backlerp == 0.0 {
        let vertices = new.iter().zip(&surface.st);
        out.extend(vertices.map(|(v, &st)| vertex(v.position(), normal(*v, sines), st)));
        return;
    }
    let old = surface.frame_vertices(frames.old);
    let back = frames.backlerp;
    out.extend(new.iter().zip(old).zip(&surface.st).map(|((n, o), &st)| {
        vertex(
            n.position() * (1.0 - back) + o.position() * back,
            (normal(*n, sines) * (1.0 - back) + normal(*o, sines) * back).normalize_or(Vec3::Z),
            st,
        )
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::RefDef;

    fn frame(radius: f32) -> Frame {
        Frame {
            mins: Vec3::new(-radius, 0.0, 0.0),
            maxs: Vec3::new(radius, 0.0, 0.0),
            local_origin: Vec3::ZERO,
            radius,
            name: String::new(),
        }
    }

    #[test]
    fn level_follows_the_size_on_the_screen() {
        let def = RefDef {
            fov_x: 90.0,
            fov_y: 90.0,
            ..RefDef::default()
        };
        let view = View::new(&def, 4.0, 1000.0);
        let settings = Settings::default();
        let level = |distance: f32, settings: &Settings| {
            level_of_detail(
                3,
                &frame(10.0),
                Vec3::new(distance, 0.0, 0.0),
                &view,
                settings,
            )
        };
        // size 10 / distance, times 5: (1 - 50 / distance) * 3
        assert_eq!(level(50.0, &settings), 0);
        assert_eq!(level(74.0, &settings), 0);
        assert_eq!(level(76.0, &settings), 1);
        assert_eq!(level(151.0, &settings), 2);
        assert_eq!(level(1e6, &settings), 2);
        assert_eq!(level(-10.0, &settings), 0);
        let biased = Settings {
            lod_bias: 1,
            ..Settings::default()
        };
        assert_eq!(level(50.0, &biased), 1);
        assert_eq!(level(1e6, &biased), 2);
        assert_eq!(
            level_of_detail(1, &frame(1.0), Vec3::X * 1e6, &view, &settings),
            0
        );
    }

    #[test]
    fn frames_wrap_or_fall_back() {
        let entity = |frame, old_frame, renderfx| RefEntity {
            frame,
            old_frame,
            renderfx,
            backlerp: 0.25,
            ..RefEntity::default()
        };
        let frames = |new, old, backlerp| Frames { new, old, backlerp };
        assert_eq!(Frames::of(&entity(3, 2, 0), 5), frames(3, 2, 0.25));
        assert_eq!(Frames::of(&entity(3, 3, 0), 5), frames(3, 3, 0.0));
        assert_eq!(Frames::of(&entity(5, 2, 0), 5), frames(0, 0, 0.0));
        assert_eq!(Frames::of(&entity(-1, 2, 0), 5), frames(0, 0, 0.0));
        let wrap = renderfx::WRAP_FRAMES;
        assert_eq!(Frames::of(&entity(7, 5, wrap), 5), frames(2, 0, 0.25));
        assert_eq!(Frames::of(&entity(-7, 5, wrap), 5), frames(0, 0, 0.0));
        assert_eq!(Frames::of(&entity(1, 0, wrap), 0), frames(0, 0, 0.0));
    }

    #[test]
    fn table_normals_are_the_engines() {
        for raw in (0..=u16::MAX).step_by(257) {
            let vertex = PackedVertex {
                position: [0; 3],
                normal: raw,
            };
            let found = normal(vertex, sines());
            assert!(found.abs_diff_eq(vertex.normal(), 0.02), "{raw:x}");
            let entry = |angle: u16, quarter: u32| {
                let entry = (u32::from(angle) * 4 + quarter) % 1024;
                (f64::from(entry) * std::f64::consts::TAU / 1023.0).sin() as f32
            };
            let (around, from_z) = (raw >> 8, raw & 0xff);
            let expected = Vec3::new(
                entry(around, 256) * entry(from_z, 0),
                entry(around, 0) * entry(from_z, 0),
                entry(from_z, 256),
            );
            assert!(found.abs_diff_eq(expected, 1e-5), "{raw:x}");
        }
    }
}
