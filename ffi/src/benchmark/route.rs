//! What a benchmark shows.

use crate::engine::valid_game_path;
use glam::Vec3;
use relight::viewpoints::Viewpoint;
use renderer_vk::path::PathPoint;

/// Frames of a fly-through.
const FRAMES: usize = 240;
/// Most places of a fly-through.
const PLACES: usize = 8;
/// Frames in a second of game time.
const RATE: usize = 60;
/// Field of view of games by default, full angles, degrees.
const FOV: [f32; 2] = [90.0, 73.739_8];

/// A flight through a map from what it holds alone: a full turn at each of at most 8 places, evenly chosen among the
/// views inside of the bounds (smallest and largest corner); without one of these in the middle of the map.
pub fn fly_through(views: impl Iterator<Item = Viewpoint>, bounds: [Vec3; 2]) -> Vec<PathPoint> {
    let [low, high] = bounds;
    let inside = |view: &Viewpoint| {
        let origin = view.origin;
        view.yaw.is_finite() && origin.cmpge(low).all() && origin.cmple(high).all()
    };
    let mut places: Vec<Viewpoint> = views.filter(inside).collect();
    if places.is_empty() {
        let middle = (low + high) * 0.5;
        places.push(Viewpoint {
            origin: if middle.is_finite() {
                middle
            } else {
                Vec3::ZERO
            },
            yaw: 0.0,
            pitch: 0.0,
        });
    }
    let turns = places.len().min(PLACES);
    let chosen = (0..turns).filter_map(|turn| places.get(turn * places.len() / turns));
    let points = chosen.enumerate().flat_map(|(turn, place)| {
        let [begin, end] = [turn, turn + 1].map(|turn| turn * FRAMES / turns);
        (begin..end).map(move |frame| {
            #[allow(clippy::cast_precision_loss)] // a few frames
            let part = (frame - begin) as f32 / (end - begin) as f32;
            PathPoint {
                time_ms: i32::try_from(frame * 1000 / RATE).unwrap_or(i32::MAX),
                origin: place.origin,
                angles: Vec3::new(0.0, (place.yaw + 360.0 * part) % 360.0, 0.0),
                fov: FOV,
            }
        })
    });
    points.collect()
}

/// Whether a name of a demo may be appended to the engine's command buffer: nothing in it ends the command or leaves
/// the folder of demos.
pub fn is_demo_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
    name.chars().all(allowed)
        && !name.is_empty()
        && !name.contains("..")
        && !name.starts_with('/')
        && valid_game_path(&format!("demos/{name}")).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn views(count: u8) -> impl Iterator<Item = Viewpoint> {
        (0..count).map(|i| Viewpoint {
            origin: Vec3::new(f32::from(i), 0.0, 10.0),
            yaw: 45.0 * f32::from(i),
            pitch: 0.0,
        })
    }

    const BOUNDS: [Vec3; 2] = [Vec3::splat(-20.0), Vec3::splat(20.0)];

    #[test]
    fn a_fly_through_is_the_same_each_time_and_stays_in_the_map() {
        for count in [0, 1, 3, 7, 8, 21, 200] {
            let points = fly_through(views(count), BOUNDS);
            assert_eq!(points, fly_through(views(count), BOUNDS));
            assert_eq!(points.len(), FRAMES, "{count}");
            for (i, point) in points.iter().enumerate() {
                let origin = point.origin;
                assert!(origin.cmpge(BOUNDS[0]).all() && origin.cmple(BOUNDS[1]).all());
                assert!(point.angles.is_finite());
                assert_eq!(usize::try_from(point.time_ms), Ok(i * 1000 / 60));
            }
            let mut places: Vec<f32> = points.iter().map(|point| point.origin.x).collect();
            places.dedup();
            assert_eq!(
                places.len(),
                usize::from(count.min(21)).clamp(1, 8),
                "{count}"
            );
        }
        // evenly chosen
        let points = fly_through(views(16), BOUNDS);
        let mut places: Vec<f32> = points.iter().map(|point| point.origin.x).collect();
        places.dedup();
        assert_eq!(places, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0]);
    }

    #[test]
    fn each_place_is_turned_around_once() {
        let points = fly_through(views(8), BOUNDS);
        let turn: Vec<f32> = points[30..60].iter().map(|p| p.angles.y).collect();
        assert_eq!((turn[0], turn[1]), (45.0, 57.0));
        assert!((turn[29] - 33.0).abs() < 1e-3, "{turn:?}");
    }

    #[test]
    fn places_outside_and_hostile_numbers_are_left_out() {
        let odd = [
            (Vec3::splat(f32::NAN), 0.0),
            (Vec3::splat(1e9), 0.0),
            (Vec3::ZERO, f32::INFINITY),
        ];
        let odd = odd.map(|(origin, yaw)| Viewpoint {
            origin,
            yaw,
            pitch: 0.0,
        });
        let points = fly_through(odd.into_iter(), BOUNDS);
        assert!(points.iter().all(|point| point.origin == Vec3::ZERO));
        let points = fly_through(views(1), [Vec3::NAN; 2]);
        assert!(points.iter().all(|point| point.origin == Vec3::ZERO));
        assert_eq!(points.len(), FRAMES);
    }

    #[test]
    fn names_of_demos_hold_no_other_command() {
        for good in ["one", "demo0001", "a/b-c_d.dm_71"] {
            assert!(is_demo_name(good), "{good}");
        }
        let long = "x".repeat(60);
        for bad in [
            "", "a;quit", "a\nquit", "a b", "\"a", "a'", "../a", "a..b", "/a", "a\\b", "$a", "ä",
            &long,
        ] {
            assert!(!is_demo_name(bad), "{bad}");
        }
    }
}
