//! A room lit by weak lights; the compiler left out contributions below one step of light.

use super::*;

/// Strength beside that of the lights with the same places that have no end.
const PART: f32 = 0.3;

/// Light, irradiance / π, that is left out: a step.
const END: f32 = 4.0 / 255.0;

/// What lights give, each only where the brightest of its channels is more than a step.
fn from_ending(at: Vec3, normal: Vec3) -> Vec3 {
    let seen = HIDDEN.iter().filter(|(origin, _)| !in_pillar(at, *origin));
    seen.map(|(origin, intensity)| {
        let offset = *origin - at;
        let cosine = normal.dot(offset).max(0.0) / offset.length();
        *intensity * (PART * cosine / offset.length_squared() / PI)
    })
    .filter(|light| light.max_element() > END)
    .sum()
}

#[test]
fn a_cutoff_of_the_compiler_is_found() {
    let mut world = room(false, Some(&from_ending));
    let report = calibrate(&mut world, &small());
    println!("{report:?}");
    assert!(report.has_cutoff && report.gamma == 1.0, "{report:?}");
    assert!((world.light_cutoff - END).abs() < 1e-6);
    // Weak light is a few steps, which are rounded.
    assert!(report.after.median_stops < 0.1, "{report:?}");
    let hidden = HIDDEN.map(|(origin, intensity)| PointLight {
        origin,
        intensity: intensity * PART,
        radius: 4.0,
        spot: None,
        falloff: crate::light::Falloff::InverseSquare,
        pulse: None,
    });
    let found = recovery(&hidden, &world);
    println!("{found:?}");
    assert_eq!((found.found, found.found_well), (3, 3), "{found:?}");
    assert!(found.power_invented < 0.05, "{found:?}");
    // The world as it is now is judged by the same rule: black stays black.
    let options = CalibrationOptions { seed: 9, ..small() };
    let places = residuals(&world, &options);
    let dark = |r: &&Residual| r.stored == Vec3::ZERO;
    let lit = places
        .iter()
        .filter(dark)
        .filter(|r| r.direct.max_element() > END * 1.2);
    let black = places.iter().filter(dark).count();
    assert!(black > 20, "{black}");
    assert!(lit.count() * 10 < black);
}

#[test]
fn lights_without_a_cutoff_get_none() {
    let mut world = room(false, Some(&from_hidden));
    let report = calibrate(&mut world, &small());
    assert!(
        !report.has_cutoff && world.light_cutoff == 0.0,
        "{report:?}"
    );
}
