//! Places of a map in a picture of it.

use glam::{Mat4, Vec2, Vec3, Vec4};
use renderer_vk::api::RefDef;

/// Projection of places to the picture.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    axis: [Vec3; 3],
    /// Tangents of half the angles.
    tan: Vec2,
    /// World to clip space, y up.
    to_clip: Mat4,
    /// Left top corner and size of the view, points.
    corner: Vec2,
    size: Vec2,
}

impl Screen {
    /// A camera with these axes (forward, left, up) and full angles in degrees, whose picture has this left top corner
    /// and size.
    pub fn new(origin: Vec3, axis: [Vec3; 3], fov: [f32; 2], corner: Vec2, size: Vec2) -> Self {
        let [forward, left, up] = axis;
        let rows = [-left, up, forward].map(|row| row.extend(-row.dot(origin)));
        let tan = Vec2::from(fov.map(|angle| (angle.to_radians() * 0.5).tan()));
        let to_clip =
            Mat4::from_cols(rows[0] / tan.x, rows[1] / tan.y, rows[2], Vec4::W).transpose();
        Self {
            axis,
            tan,
            to_clip,
            corner,
            size,
        }
    }

    /// The camera of a view in a picture.
    pub fn of(def: &RefDef, corner: Vec2, size: Vec2) -> Self {
        let fov = [def.fov_x, def.fov_y];
        Self::new(def.view_origin, def.view_axis, fov, corner, size)
    }

    /// Where a place appears, points; `None` behind the camera.
    pub fn place(&self, point: Vec3) -> Option<Vec2> {
        let seen = self.to_clip * point.extend(1.0);
        if seen.z < 1.0 {
            return None;
        }
        let unit = Vec2::new(seen.x, -seen.y) / seen.z;
        Some(self.corner + (unit * 0.5 + 0.5) * self.size)
    }

    /// Unit vector from the camera through a point of the picture.
    pub fn ray(&self, at: Vec2) -> Vec3 {
        let unit = ((at - self.corner) / self.size * 2.0 - 1.0) * self.tan;
        let [forward, left, up] = self.axis;
        (forward - left * unit.x - up * unit.y).normalize()
    }

    /// Distance along a line through `from` with a unit `direction` for a motion of the pointer by `by` points.
    pub fn along(&self, from: Vec3, direction: Vec3, by: Vec2) -> f32 {
        let step = 1.0;
        let (Some(a), Some(b)) = (self.place(from), self.place(from + direction * step)) else {
            return 0.0;
        };
        let shown = (b - a) / step;
        match shown.length_squared() {
            // the line points at the camera
            squared if squared < 1e-6 => 0.0,
            squared => by.dot(shown) / squared,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight::viewpoints::Viewpoint;

    #[test]
    fn places_and_rays_of_the_picture_agree() {
        let camera = Viewpoint {
            origin: Vec3::new(10.0, -20.0, 30.0),
            yaw: 37.0,
            pitch: 12.0,
        };
        let (axis, fov) = (camera.axis(), [90.0, 60.0]);
        let (corner, size) = (Vec2::new(5.0, 7.0), Vec2::new(640.0, 370.0));
        let screen = Screen::new(camera.origin, axis, fov, corner, size);
        for at in [
            Vec2::new(325.0, 192.0),
            Vec2::new(20.0, 300.0),
            Vec2::new(600.0, 15.0),
        ] {
            let ray = screen.ray(at);
            let place = screen.place(camera.origin + ray * 77.0).unwrap();
            assert!(place.distance(at) < 0.01, "{place} {at}");
        }
        assert!(screen.place(camera.origin - axis[0] * 50.0).is_none());
        // a drag along an axis moves the handle with the pointer
        let from = camera.origin + axis[0] * 200.0;
        let moved = screen.along(from, Vec3::Z, Vec2::new(0.0, -10.0));
        let (a, b) = (
            screen.place(from).unwrap(),
            screen.place(from + Vec3::Z * moved).unwrap(),
        );
        assert!((b.y - a.y + 10.0).abs() < 0.7, "{a} {b}");
    }
}
