//! Camera and projection of a view.

use glam::{Mat4, Vec3, Vec4};

use crate::api::RefDef;
use crate::stereo::Stereo;

/// A camera with its viewport. World space is that of id Tech, clip space that of Vulkan (y down, depth 0 to 1).
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Camera position, world space.
    pub origin: Vec3,
    /// Forward, left, up.
    pub axis: [Vec3; 3],
    /// Tangent of half the horizontal angle.
    pub tan_x: f32,
    /// Tangent of half the vertical angle.
    pub tan_y: f32,
    /// World to clip space.
    pub world_to_clip: Mat4,
    /// Distance of the near plane, units.
    pub near: f32,
    /// Distance of the far plane, units.
    pub far: f32,
    /// Left, top, width and height in the window, pixels.
    pub viewport: [i32; 4],
    /// Left and right are exchanged (inside a mirror), so front faces have the opposite winding.
    pub mirrored: bool,
    /// Portal views show only the positive side of `xyz.p = w`.
    pub clip_plane: Option<Vec4>,
    /// The view of a portal or mirror.
    pub is_portal: bool,
    /// Offset of the camera for the eye that is drawn.
    pub stereo: Stereo,
}

impl View {
    /// The view of `def`, with depth from `near` to `far`.
    pub fn new(def: &RefDef, near: f32, far: f32) -> Self {
        let half = |degrees: f32| (degrees.clamp(0.1, 179.9).to_radians() * 0.5).tan();
        let mut view = Self {
            origin: def.view_origin,
            axis: def.view_axis,
            tan_x: half(def.fov_x),
            tan_y: half(def.fov_y),
            world_to_clip: Mat4::IDENTITY,
            near,
            far: far.max(near * 2.0),
            viewport: [def.x, def.y, def.width, def.height],
            mirrored: false,
            clip_plane: None,
            is_portal: false,
            stereo: Stereo::default(),
        };
        view.update();
        view
    }

    /// The view with another stereo offset.
    #[must_use]
    pub fn with_stereo(mut self, stereo: Stereo) -> Self {
        self.stereo = stereo;
        self.update();
        self
    }

    /// Distance of the sky box's faces and of the sun, units; the box's corners lie in front of the far plane.
    pub fn sky_distance(&self) -> f32 {
        self.far / 1.75
    }

    /// Recomputes the matrix from the other fields.
    pub fn update(&mut self) {
        self.world_to_clip = self.project(self.stereo);
    }

    /// World to clip space for geometry in front of everything else, such as the weapon in first person: both eyes'
    /// pictures coincide at the near plane. `None` if it equals the other matrix.
    pub fn near_world_to_clip(&self) -> Option<Mat4> {
        (self.stereo.slope != 0.0).then(|| {
            self.project(Stereo {
                distance: self.near,
                ..self.stereo
            })
        })
    }

    fn project(&self, stereo: Stereo) -> Mat4 {
        let [forward, left, up] = self.axis;
        let rotate = Mat4::from_cols(
            Vec4::new(-left.x, -up.x, forward.x, 0.0),
            Vec4::new(-left.y, -up.y, forward.y, 0.0),
            Vec4::new(-left.z, -up.z, forward.z, 0.0),
            Vec4::W,
        );
        // clip axes: right, down, forward
        let depth = self.far / (self.far - self.near);
        let project = Mat4::from_cols(
            Vec4::new(1.0 / self.tan_x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / self.tan_y, 0.0, 0.0),
            Vec4::new(-stereo.slope / self.tan_x, 0.0, depth, 1.0),
            Vec4::new(stereo.offset() / self.tan_x, 0.0, -depth * self.near, 0.0),
        );
        project * rotate * Mat4::from_translation(-self.origin)
    }

    /// Depth at a distance in front of the camera; 0 before the near plane, 1 beyond the far plane.
    pub fn depth_at(&self, distance: f32) -> f32 {
        if distance <= self.near {
            return 0.0;
        }
        let depth = self.far * (distance - self.near) / (distance * (self.far - self.near));
        depth.clamp(0.0, 1.0)
    }

    /// The four side planes of the frustum, facing inwards: `xyz.p >= w` is inside.
    pub fn frustum(&self) -> [Vec4; 4] {
        let [forward, left, up] = self.axis;
        let camera = self.origin + left * self.stereo.offset();
        let plane = |normal: Vec3| {
            let normal = normal.normalize();
            normal.extend(normal.dot(camera))
        };
        let slope = self.stereo.slope;
        [
            plane(forward * (self.tan_x - slope) - left),
            plane(forward * (self.tan_x + slope) + left),
            plane(forward * self.tan_y - up),
            plane(forward * self.tan_y + up),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(view: &View, p: Vec3) -> Vec3 {
        let c = view.world_to_clip * p.extend(1.0);
        c.truncate() / c.w
    }

    /// A view of 90 × 90 degrees.
    fn square() -> View {
        let def = RefDef {
            fov_x: 90.0,
            fov_y: 90.0,
            ..RefDef::default()
        };
        View::new(&def, 4.0, 1000.0)
    }

    #[test]
    fn forward_is_the_middle_and_up_is_up() {
        let view = square();
        let middle = clip(&view, Vec3::new(4.0, 0.0, 0.0));
        assert!(middle.abs_diff_eq(Vec3::ZERO, 1e-5), "{middle}");
        let far = clip(&view, Vec3::new(1000.0, 0.0, 0.0));
        assert!((far.z - 1.0).abs() < 1e-4, "{far}");
        // left is negative x in clip space, up is negative y (Vulkan)
        assert!((clip(&view, Vec3::new(10.0, 10.0, 0.0)).x + 1.0).abs() < 1e-5);
        assert!((clip(&view, Vec3::new(10.0, 0.0, 10.0)).y + 1.0).abs() < 1e-5);
    }

    #[test]
    fn the_eyes_pictures_meet_at_their_distance() {
        let view = square();
        let middle = clip(&view, Vec3::new(64.0, 20.0, 0.0));
        let view = view.with_stereo(Stereo {
            slope: 1.0 / 64.0,
            distance: 64.0,
        });
        let left = clip(&view, Vec3::new(64.0, 20.0, 0.0));
        assert!((left.x - middle.x).abs() < 1e-5);
        // near points move right for the left eye
        assert!(clip(&view, Vec3::new(32.0, 0.0, 0.0)).x > 0.01);
        assert!(clip(&view, Vec3::new(128.0, 0.0, 0.0)).x < -0.005);
        // points on the edge of the picture lie on a plane of the frustum
        for (x, edge) in [(-1.0, 0), (1.0, 1)] {
            let p = view
                .world_to_clip
                .inverse()
                .project_point3(Vec3::new(x, 0.0, 0.5));
            let plane = view.frustum()[edge];
            let off = plane.truncate().dot(p) - plane.w;
            assert!(off.abs() < 1e-2, "{edge}: {off}");
        }
        assert!(view.near_world_to_clip().is_some());
    }

    #[test]
    fn frustum_planes_point_inwards() {
        let view = View::new(
            &RefDef {
                fov_x: 90.0,
                fov_y: 60.0,
                ..RefDef::default()
            },
            4.0,
            1000.0,
        );
        let inside = |p: Vec3| view.frustum().iter().all(|f| f.truncate().dot(p) >= f.w);
        assert!(inside(Vec3::new(10.0, 9.0, 0.0)));
        assert!(!inside(Vec3::new(10.0, 11.0, 0.0)));
        assert!(!inside(Vec3::new(10.0, 0.0, 6.0)));
        assert!(inside(Vec3::new(10.0, 0.0, 5.0)));
    }
}
