//! Culls spheres, boxes and models by the planes of the frustum.
//!
//! Source: engine behaviour of `renderer_opengl1` (culling of models): the spheres of a model's frames decide where
//! possible, otherwise its boxes. Both are used as stored, even if they do not bound the model.

use glam::{Vec3, Vec4};
use q3model::Frame;
use support::Aabb;

use crate::api::RefEntity;

/// Position relative to the frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lies {
    /// Completely inside.
    Inside,
    /// May cross a plane.
    Across,
    /// Completely outside.
    Outside,
}

/// Tests a sphere by planes that face inwards (`xyz.p >= w` is inside).
pub(super) fn sphere(centre: Vec3, radius: f32, planes: &[Vec4]) -> Lies {
    let mut lies = Lies::Inside;
    for plane in planes {
        let distance = plane.truncate().dot(centre) - plane.w;
        if distance < -radius {
            return Lies::Outside;
        }
        if distance <= radius {
            lies = Lies::Across;
        }
    }
    lies
}

/// Tests a box of any orientation by its corners.
pub(super) fn corners(corners: &[Vec3; 8], planes: &[Vec4]) -> Lies {
    let mut lies = Lies::Inside;
    for plane in planes {
        let behind = |corner: &&Vec3| plane.truncate().dot(**corner) < plane.w;
        match corners.iter().filter(behind).count() {
            0 => {}
            8 => return Lies::Outside,
            _ => lies = Lies::Across,
        }
    }
    lies
}

/// World-space corners of a box in an entity's space.
pub(super) fn placed(entity: &RefEntity, bounds: &Aabb) -> [Vec3; 8] {
    bounds.corners().map(|corner| to_world(entity, corner))
}

fn to_world(entity: &RefEntity, point: Vec3) -> Vec3 {
    let [x, y, z] = entity.axis;
    entity.origin + x * point.x + y * point.y + z * point.z
}

/// Result for a model between two key frames: by the frames' spheres, unless the axes are scaled or the spheres differ,
/// and by the box if the spheres do not decide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ModelLies {
    pub by_sphere: Option<Lies>,
    pub by_box: Option<Lies>,
}

impl ModelLies {
    /// Whether the model is culled.
    pub fn is_outside(self) -> bool {
        self.by_sphere == Some(Lies::Outside) || self.by_box == Some(Lies::Outside)
    }
}

/// Tests a model between two key frames.
pub(super) fn model(entity: &RefEntity, new: &Frame, old: &Frame, planes: &[Vec4]) -> ModelLies {
    let by_frame =
        |frame: &Frame| sphere(to_world(entity, frame.local_origin), frame.radius, planes);
    let agreed = || Some(by_frame(new)).filter(|lies| by_frame(old) == *lies);
    let by_sphere = (!entity.non_normalized_axes).then(agreed).flatten();
    let decided = matches!(by_sphere, Some(Lies::Inside | Lies::Outside));
    let [new, old] = [new, old].map(|frame| Aabb::new(frame.mins, frame.maxs));
    ModelLies {
        by_sphere,
        by_box: (!decided).then(|| corners(&placed(entity, &new.union(old)), planes)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The half space of positive x.
    const PLANE: [Vec4; 1] = [Vec4::new(1.0, 0.0, 0.0, 0.0)];

    fn frame(x: f32, radius: f32, size: f32) -> Frame {
        Frame {
            mins: Vec3::splat(-size),
            maxs: Vec3::splat(size),
            local_origin: Vec3::new(x, 0.0, 0.0),
            radius,
            name: String::new(),
        }
    }

    fn entity(x: f32) -> RefEntity {
        RefEntity {
            origin: Vec3::new(x, 0.0, 0.0),
            axis: [Vec3::X, Vec3::Y, Vec3::Z],
            ..RefEntity::default()
        }
    }

    #[test]
    fn spheres_and_boxes_are_inside_across_or_outside() {
        for (x, expected) in [
            (5.0, Lies::Inside),
            (1.0, Lies::Across),
            (-1.0, Lies::Across),
            (-5.0, Lies::Outside),
        ] {
            assert_eq!(sphere(Vec3::new(x, 9.0, 9.0), 2.0, &PLANE), expected);
            let bounds = Aabb::new(Vec3::splat(-2.0), Vec3::splat(2.0));
            assert_eq!(corners(&placed(&entity(x), &bounds), &PLANE), expected);
        }
        assert_eq!(sphere(Vec3::ZERO, 1.0, &[]), Lies::Inside);
    }

    #[test]
    fn spheres_decide_before_boxes() {
        let lies = |entity: &RefEntity, new: &Frame, old: &Frame| model(entity, new, old, &PLANE);
        // the sphere is outside, the box is not
        let small = frame(0.0, 1.0, 90.0);
        assert!(lies(&entity(-5.0), &small, &small).is_outside());
        // the sphere is inside, the box is not
        let boxless = frame(20.0, 1.0, 2.0);
        assert!(!lies(&entity(-5.0), &boxless, &boxless).is_outside());
        // scaled axes: spheres do not decide
        let stretched = RefEntity {
            non_normalized_axes: true,
            ..entity(-5.0)
        };
        assert!(!lies(&stretched, &small, &small).is_outside());
        assert!(lies(&stretched, &boxless, &boxless).is_outside());
        // the frames differ: the box of both decides
        let found = lies(&entity(-5.0), &small, &boxless);
        assert_eq!((found.by_sphere, found.is_outside()), (None, false));
        assert_eq!(found.by_box, Some(Lies::Across));
    }
}
