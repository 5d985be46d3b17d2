//! Held views of `rt_pause`: the traced views of the frame in which it was switched on are traced again in every frame.
//! The game and its 2D pictures continue.

use shaders::types::constants as c;

use crate::api::{FreeCamera, RefDef};
use crate::scene::TracedScene;

/// The held views, in the order of the frame.
#[derive(Default)]
pub(super) struct HeldViews {
    views: Vec<TracedScene>,
    next: usize,
    /// Replaces the camera of views of the world.
    pub camera: Option<FreeCamera>,
}

impl HeldViews {
    /// Releases all views.
    pub fn release(&mut self) {
        self.views.clear();
        self.next = 0;
    }

    /// Begins a frame: its first view is the first held one.
    pub fn begin_frame(&mut self) {
        self.next = 0;
    }

    /// The held view for the next traced view; `None` if there is none of its size.
    pub fn next(&mut self, def: &RefDef) -> Option<TracedScene> {
        let rectangle = |d: &RefDef| [d.x, d.y, d.width, d.height];
        let held = self.views.get(self.next)?;
        if rectangle(&held.def) != rectangle(def) {
            return None;
        }
        self.next += 1;
        let mut view = held.clone();
        if let Some(camera) = self.camera.filter(|_| view.has_world) {
            look_from(&mut view, &camera);
        }
        Some(view)
    }

    /// Holds a view for which [`next`](Self::next) returned none.
    pub fn hold(&mut self, view: &TracedScene) {
        self.views.truncate(self.next);
        self.views.push(view.clone());
        self.next += 1;
    }
}

/// Distance from the game's camera within which the player's own body stays invisible, units.
const HEAD: f32 = 40.0;

/// Moves the camera of a view.
fn look_from(view: &mut TracedScene, camera: &FreeCamera) {
    let [.., width, height] = view.view.viewport;
    let tan = (camera.fov_y.clamp(1.0, 170.0).to_radians() * 0.5).tan();
    let is_in_head = camera.origin.distance(view.view.origin) < HEAD;
    view.view.origin = camera.origin;
    view.view.axis = camera.axis;
    view.view.tan_y = tan;
    #[allow(clippy::cast_precision_loss)] // pixels
    let shape = width.max(1) as f32 / height.max(1) as f32;
    view.view.tan_x = tan * shape;
    view.view.update();
    let instances = &mut view.instances;
    let of_weapon = |instance: u32| {
        let instance = instances.get(instance as usize);
        instance.is_some_and(|i| i.flags & c::INSTANCE_FIRST_PERSON != 0)
    };
    view.meshes.retain(|mesh| !of_weapon(mesh.instance));
    if !is_in_head {
        for instance in instances {
            instance.flags &= !c::INSTANCE_THIRD_PERSON;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::View;
    use glam::Vec3;

    fn def(width: i32, time_ms: i32) -> RefDef {
        RefDef {
            width,
            height: 10,
            fov_x: 90.0,
            fov_y: 90.0,
            time_ms,
            ..RefDef::default()
        }
    }

    fn view(def: &RefDef) -> TracedScene {
        TracedScene::empty(def, View::new(def, 4.0, 100.0))
    }

    #[test]
    fn a_free_camera_replaces_that_of_views_of_the_world() {
        let mut held = HeldViews::default();
        let mut world = view(&def(20, 1));
        world.has_world = true;
        held.hold(&world);
        held.hold(&view(&def(5, 1)));
        held.camera = Some(FreeCamera {
            origin: Vec3::new(1.0, 2.0, 3.0),
            axis: [Vec3::Y, Vec3::NEG_X, Vec3::Z],
            fov_y: 60.0,
        });
        held.begin_frame();
        let moved = held.next(&def(20, 2)).unwrap().view;
        assert_eq!(moved.origin, Vec3::new(1.0, 2.0, 3.0));
        assert!((moved.tan_y - 30f32.to_radians().tan()).abs() < 1e-6);
        assert!((moved.tan_x - 2.0 * moved.tan_y).abs() < 1e-6);
        let ahead = moved.world_to_clip * Vec3::new(1.0, 12.0, 3.0).extend(1.0);
        assert!(ahead.truncate().truncate().length() < 1e-4 * ahead.w);
        // the picture of a model in a menu stays
        assert_eq!(held.next(&def(5, 2)).unwrap().view.origin, Vec3::ZERO);
    }

    #[test]
    fn views_are_held_by_their_order_until_their_size_changes() {
        let mut held = HeldViews::default();
        for (width, time) in [(20, 1), (5, 2)] {
            assert!(held.next(&def(width, time)).is_none());
            held.hold(&view(&def(width, time)));
        }
        held.begin_frame();
        assert_eq!(held.next(&def(20, 50)).map(|v| v.def.time_ms), Some(1));
        assert_eq!(held.next(&def(5, 50)).map(|v| v.def.time_ms), Some(2));
        assert!(held.next(&def(5, 50)).is_none());
        held.begin_frame();
        assert!(held.next(&def(30, 60)).is_none());
        held.hold(&view(&def(30, 60)));
        held.begin_frame();
        assert_eq!(held.next(&def(30, 70)).map(|v| v.def.time_ms), Some(60));
        held.release();
        assert!(held.next(&def(30, 70)).is_none());
    }
}
