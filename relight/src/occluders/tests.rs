//! Rays with known hits.

use super::*;
use support::random::Random;

/// Where a ray meets a single triangle, one number at a time.
fn alone([a, b, c]: [Vec3; 3], sky: bool, tag: u32, from: Vec3, ray: Vec3) -> Option<Hit> {
    let (e1, e2) = (b - a, c - a);
    let p = ray.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let s = from - a;
    let q = s.cross(e1);
    let [u, v, t] = [s.dot(p), ray.dot(q), e2.dot(q)].map(|x| x * inverse);
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    (inside && t > 1e-5 && t < 0.9999).then_some(Hit {
        t,
        sky,
        front: inverse < 0.0,
        tag,
        normal: e2.cross(e1).normalize_or_zero(),
    })
}

#[test]
fn agrees_with_trying_every_triangle() {
    let mut random = Random::new(7);
    let mut point = |scale: f32| {
        (Vec3::new(random.uniform(), random.uniform(), random.uniform()) - 0.5) * scale
    };
    let input: Vec<([Vec3; 3], bool, u32)> = (0..500)
        .map(|tag| {
            let at = point(100.0);
            let corners = [at, at + point(20.0), at + point(20.0)];
            (corners, tag % 5 == 0, tag)
        })
        .collect();
    let tree = Occluders::new(input.iter().copied());
    let mut found = 0;
    for _ in 0..500 {
        let (from, to) = (point(150.0), point(150.0));
        let tried = |sky: bool| {
            input
                .iter()
                .filter(|(.., s)| sky || *s % 5 != 0)
                .filter_map(|&(corners, sky, tag)| alone(corners, sky, tag, from, to - from))
                .min_by(|a, b| a.t.total_cmp(&b.t))
        };
        let nearest = tree.nearest(from, to - from, 0.9999);
        assert_eq!(nearest, tried(true));
        assert_eq!(tree.blocked(from, to, false), tried(true).is_some());
        assert_eq!(tree.blocked(from, to, true), tried(false).is_some());
        found += usize::from(tried(true).is_some());
    }
    assert!(found > 50, "{found}");
    assert!(!Occluders::new(std::iter::empty()).blocked(Vec3::ZERO, Vec3::ONE, false));
}

#[test]
fn rays_along_faces_are_stopped_and_deep_trees_are_seen_to_their_end() {
    // Ever farther off, so that the tree is as deep as can be; a ray passes by all but one.
    let input = |blocker: i32| {
        (0..120).map(move |k| {
            let x = (k as f32 * 0.8).exp2();
            let far = if k == blocker { 9.0 } else { 1.0 };
            let corners = [[-1.0, -1.0], [-1.0, far], [far, -1.0]];
            (corners.map(|[y, z]| Vec3::new(x, y, z)), false, k as u32)
        })
    };
    for blocker in 0..120 {
        let tree = Occluders::new(input(blocker));
        let hit = tree.nearest(Vec3::splat(0.5), Vec3::X, f32::INFINITY);
        assert_eq!(hit.map(|h| h.tag), Some(blocker as u32));
    }
    // Along a side of the box around a triangle.
    for side in [Vec3::X, Vec3::NEG_X] {
        let at = Vec3::new(0.0, -0.5, 2.0);
        let tree = Occluders::new(std::iter::once(([at, at + Vec3::Y, at + side], false, 0)));
        assert!(tree.nearest(Vec3::ZERO, Vec3::Z, 9.0).is_some(), "{side}");
    }
}

#[test]
fn a_walk_forgets_nothing_that_it_has_still_to_see() {
    let mut stack = Stack::new();
    let all = 0..3 * STACK as u32;
    for entry in all.clone() {
        stack.push(entry, (entry % 4) as f32, stack.depth.saturating_sub(3));
    }
    let mut left: Vec<u32> = std::iter::from_fn(|| stack.pop(9.0)).collect();
    left.sort_unstable();
    assert_eq!(left, all.collect::<Vec<_>>());
    for near in [1.0, 3.0, 2.0] {
        stack.push(near as u32, near, 0);
    }
    assert_eq!(
        [stack.pop(2.5), stack.pop(2.5), stack.pop(2.5)],
        [Some(1), Some(2), None]
    );
}

#[test]
fn light_passes_holes() {
    // Texture coordinates are places; the right half of the picture is a hole.
    let corners = [Vec3::ZERO, Vec3::Y * 4.0, Vec3::X * 4.0];
    let script = "t\n{\ncull none\n{\nmap a\nalphaFunc GE128\n}\n}\n";
    let shader = shaderscript::parse_script("test", script.as_bytes());
    let mut rgba = vec![255; 16];
    (rgba[7], rgba[15]) = (0, 0);
    let picture = crate::image::Image::from_rgba(2, 2, rgba).unwrap();
    for two_sided in [true, false] {
        let holes = Holes::of(&shader.shaders[0], two_sided, |_| Some(picture.clone())).unwrap();
        let holes = Arc::new(holes);
        let tree = Occluders::new(std::iter::once((corners, false, 7))).cut(|tag| {
            (tag == 7).then(|| CutOut {
                st: corners.map(|c| c.truncate()),
                holes: Arc::clone(&holes),
            })
        });
        let through = |x: f32| {
            let (above, below) = (Vec3::new(x, 0.3, 1.0), Vec3::new(x, 0.3, -1.0));
            let mut last = Some(0);
            let open = !tree.blocked(above, below, false);
            assert_eq!(open, !tree.blocked_hinted(above, below, &mut last));
            open
        };
        assert_eq!(
            [0.2, 0.7, 1.2, 1.7].map(through),
            [false, true, false, true]
        );
        let under = tree
            .nearest(Vec3::new(0.2, 0.3, -1.0), Vec3::Z, 9.0)
            .unwrap();
        assert_eq!(under.front, two_sided);
        assert!(!two_sided || under.normal.z < -0.9);
    }
}

#[test]
fn fronts_are_clockwise() {
    // Seen from +z, x to the right, y up: clockwise.
    let corners = [Vec3::ZERO, Vec3::Y, Vec3::X];
    let tree = Occluders::new(std::iter::once((corners, false, 3)));
    let hit = tree.nearest(Vec3::new(0.2, 0.2, 5.0), Vec3::NEG_Z, 10.0);
    assert!(hit.is_some_and(|h| h.front && h.tag == 3 && (h.t - 5.0).abs() < 1e-5));
    let hit = tree.nearest(Vec3::new(0.2, 0.2, -5.0), Vec3::Z, 10.0);
    assert!(hit.is_some_and(|h| !h.front));
}

#[test]
fn at_the_same_distance_fronts_come_first_and_then_the_lowest_tag() {
    let up = [Vec3::ZERO, Vec3::Y * 4.0, Vec3::X * 4.0];
    let down = [up[0], up[2], up[1]];
    let coplanar = [(down, 9), (up, 8), (up, 7), (down, 1)];
    // Others below decide where the tree splits, and which of the coplanar ones a ray meets first.
    for others in 0..40u32 {
        for turned in 0..4 {
            let mut input: Vec<([Vec3; 3], bool, u32)> = (0..others)
                .map(|k| (up.map(|p| p - Vec3::Z * (5.0 + k as f32)), false, 100 + k))
                .collect();
            for (k, &(corners, tag)) in coplanar.iter().cycle().skip(turned).take(4).enumerate() {
                input.insert(input.len() * k / 4, (corners, false, tag));
            }
            let tree = Occluders::new(input.into_iter());
            let hit = |z: f32| {
                let from = Vec3::new(1.0, 1.0, z);
                let hit = tree.nearest(from, Vec3::Z * -z, f32::INFINITY);
                hit.map(|hit| (hit.front, hit.tag))
            };
            assert_eq!([hit(2.0), hit(-2.0)], [Some((true, 7)), Some((true, 1))]);
        }
    }
}
