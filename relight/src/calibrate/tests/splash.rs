//! A lamp with the compiler's back splash.

use super::*;

/// Strength of the lamp over that of its directive.
pub(super) const FACTOR: f32 = 2.5;

const AREA: f32 = 40.0 * 60.0;

/// Light from the lamp, and from its back splash of so much of its light.
pub(super) fn from_lamp(splash: f32) -> impl Fn(Vec3, Vec3) -> Vec3 {
    from_lamp_and_point(splash, 23.0)
}

/// Light from the lamp, and from a point so far below its middle that gives so much of its light.
fn from_lamp_and_point(splash: f32, below: f32) -> impl Fn(Vec3, Vec3) -> Vec3 {
    let power = FACTOR * LAMP * SURFACE_LIGHT_RADIANCE * AREA;
    let [a, b, _, d] = LAMP_CORNERS;
    move |at, normal| {
        let point = |origin: Vec3, side: f32, part: f32| {
            let offset = origin - at;
            if in_pillar(at, origin) || side < 0.0 {
                return 0.0;
            }
            let cosine = normal.dot(offset).max(0.0) / offset.length();
            part * side * cosine / offset.length_squared()
        };
        let mut sum = point((a + (b - a + d - a) * 0.5) - Vec3::Z * below, 1.0, splash);
        for i in 0..64 {
            let (u, v) = ((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5);
            let origin = a + (b - a) * (u / 8.0) + (d - a) * (v / 8.0);
            sum += point(origin, (origin - at).normalize().z, 1.0 / 64.0);
        }
        Vec3::splat(sum * power / PI)
    }
}

#[test]
fn a_back_splash_is_found_as_one_source() {
    let part = 0.08;
    let mut world = room(true, Some(&from_lamp(part)));
    let report = calibrate(&mut world, &small());
    println!("{report:?} {:?}", world.point_lights);
    assert_eq!(report.splashes, 1);
    // Both triangles of the lamp together have one, where the compiler puts it.
    let splash = world.point_lights[0];
    let place = Vec3::new(200.0, 0.0, 227.0);
    assert!(splash.origin.distance(place) < 0.01, "{splash:?}");
    let power = world.lights[0].radiance * AREA;
    let off = splash.intensity / (power * part) - 1.0;
    assert!(off.abs().max_element() < 0.15, "{off}");
    let factor = world.lights[0].radiance.x / (LAMP * SURFACE_LIGHT_RADIANCE);
    assert!((factor / FACTOR - 1.0).abs() < 0.06, "{factor}");
    assert!(report.after.median_stops < 0.05, "{report:?}");
}

#[test]
fn lamps_without_back_splashes_get_none() {
    let mut world = room(true, Some(&from_lamp(0.0)));
    let mut parts = vec![0.0];
    let report = calibrate_with(&mut world, &small(), &mut |part| parts.push(part));
    assert_eq!(report.splashes, 0, "{report:?}");
    // Nor does progress wait for a try without them.
    let steps = parts.windows(2).map(|pair| pair[1] - pair[0]);
    let longest = steps.fold(0.0, f32::max);
    assert!(longest < 0.3, "{longest} {parts:?}");
}

#[test]
fn back_splashes_are_dropped_if_placed_lights_explain_as_much() {
    // A splash explains much of this light, but not as well as the point that it is.
    let mut world = room(true, Some(&from_lamp_and_point(0.3, 50.0)));
    let report = calibrate(&mut world, &small());
    println!("{report:?} {:?}", world.point_lights);
    assert_eq!(report.splashes, 0);
    let place = Vec3::new(200.0, 0.0, 200.0);
    let nearest = world.point_lights.iter().map(|l| l.origin.distance(place));
    assert!(nearest.fold(f32::MAX, f32::min) < 16.0);
    assert!(report.after.median_stops < 0.05, "{report:?}");
}

#[test]
fn back_splashes_do_not_count_as_recovered_entities() {
    let mut world = room(true, Some(&from_lamp(0.08)));
    let report = calibrate(&mut world, &small());
    let found = recovery(&[], &world);
    assert_eq!(report.splashes, 1);
    assert_eq!(found.invented, report.placed);
}

#[test]
fn unexplained_light_takes_more_samples_and_progress_is_monotonic() {
    // No light is like that: each texel by chance.
    let noise = |at: Vec3, _: Vec3| {
        let hashed_uniform = support::random::hashed_uniform(3, &at.to_array().map(f32::to_bits));
        Vec3::splat(4.0 * 0.01f32.powf(hashed_uniform))
    };
    let mut world = room(true, Some(&noise));
    let mut parts = Vec::new();
    let report = calibrate_with(&mut world, &small(), &mut |part| parts.push(part));
    assert!(report.after.median_stops > 0.3, "{report:?}");
    assert!(report.samples > 2 * small().samples * 9 / 10, "{report:?}");
    assert!(parts.is_sorted(), "{parts:?}");
    assert!(parts.last().is_some_and(|last| (0.99..=1.0).contains(last)));
}
