//! Light lists against rays, on made-up maps whose matrix makes all clusters mutually visible.

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use relight::light::{DROPPED_PART, judge, lists_by_geometry, lists_by_visibility, sweep};
use relight::{Materials, MemoryFiles, Options, RelitWorld};

const SCRIPT: &str = "
t/lamp
{
    q3map_surfacelight 2000
    { map *white }
}
t/wall
{
    { map *white }
}
";

/// Size of a room, units.
const ROOM: f32 = 256.0;

/// The rooms of these numbers are those that the least recall was measured in.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as u32
    }
}

/// A wall between two rooms, seen from both sides, with a doorway in it or without. `along`: from the wall's start to
/// its end.
fn wall(map: &mut MapBuilder, shader: q3bsp::ShaderId, start: Vec3, along: Vec3, door: bool) {
    let mut panel = |from: f32, to: f32, low: f32, high: f32| {
        let corner = |t: f32, z: f32| start + along * t + Vec3::Z * z;
        let quad = [
            corner(from, low),
            corner(to, low),
            corner(to, high),
            corner(from, high),
        ];
        map.add_quad(shader, quad);
        let mut back = quad;
        back.reverse();
        map.add_quad(shader, back);
    };
    if door {
        panel(0.0, 0.35, 0.0, ROOM);
        panel(0.65, 1.0, 0.0, ROOM);
        panel(0.35, 0.65, ROOM * 0.5, ROOM);
    } else {
        panel(0.0, 1.0, 0.0, ROOM);
    }
}

/// Rooms in a square, with doorways here and there, a lamp in each second ceiling.
fn rooms(side: i32, seed: u64) -> RelitWorld {
    let mut random = Random(seed);
    let mut map = MapBuilder::new();
    let plain = map.add_shader("t/wall", 0, 1);
    let lamp = map.add_shader("t/lamp", 0, 1);
    let at = |x: i32, y: i32| Vec3::new(x as f32, y as f32, 0.0) * ROOM;
    for x in 0..side {
        for y in 0..side {
            let low = at(x, y);
            map.add_cell(low, low + ROOM);
            for (z, flip) in [(0.0, false), (ROOM, true)] {
                let mut quad = [
                    low,
                    low + Vec3::X * ROOM,
                    low + Vec3::new(ROOM, ROOM, 0.0),
                    low + Vec3::Y * ROOM,
                ]
                .map(|p| p + Vec3::Z * z);
                if flip {
                    quad.reverse();
                }
                map.add_quad(plain, quad);
            }
            if (x + y) % 2 == 0 {
                let middle =
                    low + Vec3::new(random.next() as f32 % 120.0 + 60.0, 100.0, ROOM - 2.0);
                let mut quad = [
                    middle,
                    middle + Vec3::X * 32.0,
                    middle + Vec3::new(32.0, 32.0, 0.0),
                    middle + Vec3::Y * 32.0,
                ];
                quad.reverse();
                map.add_quad(lamp, quad);
            }
        }
    }
    for i in 0..=side {
        for j in 0..side {
            let inner = i > 0 && i < side;
            let mut door = || inner && !random.next().is_multiple_of(3);
            let (a, b) = (door(), door());
            wall(&mut map, plain, at(i, j), Vec3::Y * ROOM, a);
            wall(&mut map, plain, at(j, i), Vec3::X * ROOM, b);
        }
    }
    // a matrix in which all clusters see each other
    map.set_sees(0, 0, true);
    let mut files = MemoryFiles::new();
    files.insert("scripts/t.shader", SCRIPT).expect("a path");
    let (materials, _) = Materials::load(&files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    RelitWorld::from_bsp(&files, &materials, "maps/t.bsp", map.build(), options)
}

#[test]
fn what_rays_find_stays_in_the_lists() {
    for seed in 1..4 {
        let mut world = rooms(4, seed);
        let visible = lists_by_visibility(&world);
        let geometric = lists_by_geometry(&world);
        let report = sweep(&mut world, None);
        let swept = &world.light_lists;
        assert_eq!(report.unseen, 0);
        let rows = 0..16;
        assert_eq!(
            report.entries[1],
            rows.map(|c| swept.row(c).len()).sum::<usize>()
        );
        for cluster in 0..16 {
            let row = swept.row(cluster);
            assert!(row.is_sorted() && row.iter().all(|e| geometric.row(cluster).contains(e)));
            assert_eq!(row.len(), swept.shares(cluster).len());
            assert!(
                swept
                    .shares(cluster)
                    .iter()
                    .all(|s| s.visible > 0.0 && s.visible <= 1.0)
            );
        }
        // points in no cluster still have all lights
        assert_eq!(swept.row(-1).len(), world.lights.len());
        let judged = judge(&world, &[&visible, swept], 512, 1);
        let [all, kept] = [judged[0], judged[1]];
        println!(
            "recall {} precision {} of {} light {}",
            kept.recall(),
            kept.precision(),
            all.precision(),
            kept.light_found
        );
        assert_eq!(all.recall(), 1.0);
        // what is missing is too weak to matter
        assert!(kept.recall() >= 0.98, "{}", kept.recall());
        assert_eq!(kept.recall_of_mattering(), 1.0);
        assert!(kept.light_found >= 1.0 - f64::from(DROPPED_PART) / 4.0);
        assert!(kept.precision() >= 1.5 * all.precision());
        // a second sweep finds nothing to do
        let again = sweep(&mut world, None);
        assert_eq!(again.entries[0], again.entries[1]);
    }
}

#[test]
fn on_a_real_map_lists_are_short_and_whole() {
    let Some(folder) = testkit::folder() else {
        return;
    };
    let files = relight::SearchPath::open(&[folder]).expect("packs");
    let (materials, _) = Materials::load(&files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let map = std::env::var("RELIGHT_LISTS_MAP").unwrap_or_else(|_| "oa_dm1".into());
    let map = format!("maps/{map}.bsp");
    let mut world = RelitWorld::load(&files, &materials, &map, options).expect("a map");
    let visible = lists_by_visibility(&world);
    let report = sweep(&mut world, None);
    let judged = judge(&world, &[&visible, &world.light_lists], 128, 8);
    for j in &judged {
        println!(
            "recall {} of what matters {} precision {} light {}",
            j.recall(),
            j.recall_of_mattering(),
            j.precision(),
            j.light_found
        );
    }
    println!("{report:?}");
    let [all, kept] = [judged[0], judged[1]];
    assert_eq!(all.recall(), 1.0);
    assert_eq!(kept.recall_of_mattering(), 1.0);
    assert!(kept.precision() >= 1.5 * all.precision());
    assert!(kept.recall() >= 0.98);
    assert!(kept.light_found >= 1.0 - f64::from(DROPPED_PART) / 10.0);
    assert!(kept.worst_loss <= f64::from(DROPPED_PART) * 2.0);
}
