//! A room lit by lights that fall off linearly, as the compiler computes them.

use super::*;
use crate::light::Falloff;

/// How far the hidden lights reach, id units.
const REACH: [f32; 3] = [330.0, 260.0, 300.0];

/// Strength beside that of the lights with the same places that fall off with the square.
const STRONGER: f32 = 3.0;

/// E / π = 8 I / (π R²) (cosθ − d / R).
fn from_linear(at: Vec3, normal: Vec3) -> Vec3 {
    let lights = HIDDEN.iter().zip(REACH);
    let seen = lights.filter(|((origin, _), _)| !in_pillar(at, *origin));
    seen.map(|((origin, intensity), reach)| {
        let offset = *origin - at;
        let distance = offset.length();
        let part = (normal.dot(offset) / distance - distance / reach).max(0.0);
        *intensity * (STRONGER * 8.0 * part / (reach * reach * PI))
    })
    .sum()
}

#[test]
fn linear_and_inverse_square_lights_are_distinguished() {
    let mut world = room(false, Some(&from_linear));
    let report = calibrate(&mut world, &small());
    println!("{report:?}");
    for ((origin, intensity), reach) in HIDDEN.into_iter().zip(REACH) {
        let near = world
            .point_lights
            .iter()
            .filter(|l| l.origin.distance(origin) < 32.0);
        let strongest = near
            .max_by(|a, b| a.intensity.x.total_cmp(&b.intensity.x))
            .unwrap_or_else(|| panic!("none at {origin}"));
        println!("{origin} {intensity} {reach}: {strongest:?}");
        let Falloff::Linear { reach: found } = strongest.falloff else {
            panic!("{strongest:?}")
        };
        assert!((found / reach - 1.0).abs() < 0.25, "{found} for {reach}");
    }
    assert!(report.after.median_stops < 0.15, "{report:?}");
}

#[test]
fn linear_falloff_is_tried_where_more_than_half_of_the_error_is_left() {
    // beside light from everywhere they are too weak to leave much
    let weak = |at: Vec3, normal: Vec3| Vec3::splat(0.2) + 0.3 * from_linear(at, normal);
    let mut world = room(false, Some(&weak));
    let few = CalibrationOptions {
        candidates: 100,
        ..small()
    };
    let report = calibrate(&mut world, &few);
    println!("{report:?}");
    assert!(report.before.median_stops < 0.25, "{report:?}");
    assert!(report.after.median_stops < 0.02, "{report:?}");
    let has_cutoff = |light: &PointLight| matches!(light.falloff, Falloff::Linear { .. });
    assert!(world.point_lights.iter().all(has_cutoff), "{report:?}");
}
