//! Held views of `rt_pause`: the traced views of the frame in which it was switched on are traced again in every frame.
//! The game and its 2D pictures continue.

use crate::api::RefDef;
use crate::scene::TracedScene;

/// The held views, in the order of the frame.
#[derive(Default)]
pub(super) struct HeldViews {
    views: Vec<TracedScene>,
    next: usize,
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
        Some(held.clone())
    }

    /// Holds a view for which [`next`](Self::next) returned none.
    pub fn hold(&mut self, view: &TracedScene) {
        self.views.truncate(self.next);
        self.views.push(view.clone());
        self.next += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::View;

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
