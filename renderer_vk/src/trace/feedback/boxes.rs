//! A coarse uniform grid over the bodies of a view: rays through its boxes are counted, and bodies in boxes that few
//! rays pass are left out of the top level.

use glam::{UVec3, Vec3};
use support::Aabb;

use super::activity::{Activity, Thresholds};

/// Least edge of a box, units.
const EDGE: f32 = 128.0;
/// Boxes along an axis at most.
const MOST: f32 = 16.0;

/// The grid and its boxes.
#[derive(Default)]
pub struct Boxes {
    /// Changes whenever the boxes are others.
    pub serial: u64,
    /// Least corner.
    pub origin: Vec3,
    /// Edge of a box.
    pub edge: f32,
    /// Boxes along each axis.
    pub counts: UVec3,
    activity: Vec<Activity>,
}

impl Boxes {
    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.activity.len()
    }

    /// Begins a frame: replaces the boxes by others that hold `bounds` if they do not.
    pub fn begin(&mut self, bounds: Aabb) {
        let held = Aabb::new(self.origin, self.origin + self.counts.as_vec3() * self.edge);
        let fits = |of: Aabb| of.mins.cmpge(held.mins).all() && of.maxs.cmple(held.maxs).all();
        if !bounds.is_empty() && bounds.is_finite() && !(self.edge > 0.0 && fits(bounds)) {
            // bodies move: a margin of a box
            let longest = bounds.size().max_element();
            self.edge = (longest / (MOST - 2.0)).max(EDGE);
            self.origin = bounds.mins - self.edge;
            let counts = (bounds.maxs - self.origin) / self.edge;
            self.counts = (counts.floor() + 2.0).min(Vec3::splat(MOST)).as_uvec3();
            let number = self.counts.element_product() as usize;
            self.activity = vec![Activity::ACTIVE; number];
            self.serial += 1;
        }
    }

    /// Places of the boxes that a body touches.
    pub fn of(&self, body: &Aabb) -> impl Iterator<Item = usize> + use<> {
        let counts = self.counts;
        let cell = |p: Vec3| {
            let cell = ((p - self.origin) / self.edge).max(Vec3::ZERO).as_uvec3();
            cell.min(counts.saturating_sub(UVec3::ONE))
        };
        let (low, high) = (cell(body.mins), cell(body.maxs));
        let place = move |x, y, z| ((z * counts.y + y) * counts.x + x) as usize;
        let all = (low.z..=high.z).flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)));
        all.flat_map(move |(y, z)| (low.x..=high.x).map(move |x| place(x, y, z)))
    }

    /// Whether one of the boxes of a body is active. `enters`: all of them become active.
    pub fn are_active(&mut self, places: impl Iterator<Item = usize>, enters: bool) -> bool {
        let mut active = false;
        for place in places {
            if let Some(activity) = self.activity.get_mut(place) {
                if enters {
                    *activity = Activity::ACTIVE;
                }
                active |= activity.is_active();
            }
        }
        active
    }

    /// Takes the rays of a frame through each box.
    pub fn observe(&mut self, rays: impl Iterator<Item = f32>, thresholds: Thresholds) {
        for (activity, rays) in self.activity.iter_mut().zip(rays) {
            activity.observe(rays, thresholds);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_lie_in_the_boxes_that_they_touch() {
        let mut boxes = Boxes::default();
        boxes.begin(Aabb::new(
            Vec3::splat(-1000.0),
            Vec3::new(1000.0, 500.0, 0.0),
        ));
        assert!(boxes.counts.max_element() as f32 <= MOST);
        let all: Vec<usize> = boxes
            .of(&Aabb::new(Vec3::splat(-1.0e9), Vec3::splat(1.0e9)))
            .collect();
        assert_eq!(all, (0..boxes.len()).collect::<Vec<_>>());
        // a body around a corner of boxes lies in eight of them
        let corner = boxes.origin + boxes.edge * 2.0;
        let body = Aabb::new(corner - 1.0, corner + 1.0);
        assert_eq!(boxes.of(&body).count(), 8);
        let inside = Aabb::new(corner + 1.0, corner + 2.0);
        assert_eq!(boxes.of(&inside).count(), 1);
        // the same boxes stay while they hold all bodies
        let serial = boxes.serial;
        boxes.begin(Aabb::new(Vec3::splat(-1010.0), Vec3::ZERO));
        assert_eq!(boxes.serial, serial);
        boxes.begin(Aabb::new(Vec3::splat(-9000.0), Vec3::ZERO));
        assert_ne!(boxes.serial, serial);
    }

    #[test]
    fn a_box_rests_without_rays_and_returns_when_a_body_enters() {
        let t = Thresholds {
            active: 20.0,
            quiet: 2.0,
        };
        let mut boxes = Boxes::default();
        let bounds = Aabb::new(Vec3::ZERO, Vec3::splat(500.0));
        let body = Aabb::new(Vec3::splat(64.0), Vec3::splat(65.0));
        boxes.begin(bounds);
        let place = boxes.of(&body).next().unwrap();
        for frame in 0..super::super::activity::QUIET_FRAMES {
            assert!(boxes.are_active(boxes.of(&body), false), "{frame}");
            boxes.observe(vec![0.0; boxes.len()].into_iter(), t);
        }
        assert!(!boxes.are_active(boxes.of(&body), false));
        let rays = |n: f32| (0..4096).map(move |i| if i == place { n } else { 0.0 });
        boxes.observe(rays(20.0), t);
        assert!(!boxes.are_active(boxes.of(&body), false));
        boxes.observe(rays(21.0), t);
        assert!(boxes.are_active(boxes.of(&body), false));
        for _ in 0..9 {
            boxes.observe(rays(0.0), t);
        }
        assert!(!boxes.are_active(boxes.of(&body), false));
        assert!(boxes.are_active(boxes.of(&body), true));
    }
}
