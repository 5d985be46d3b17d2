//! Texels beside placed lights.

use super::*;
use crate::calibrate::near_light::spots;
use crate::calibrate::residual_candidates::ResidualCandidates;
use crate::light::Falloff;
use crate::occluders::Occluders;

/// Light of a point in the middle of the room.
fn from_middle(at: Vec3, normal: Vec3) -> Vec3 {
    let origin = Vec3::new(-160.0, 0.0, 100.0);
    if in_pillar(at, origin) {
        return Vec3::ZERO;
    }
    let offset = origin - at;
    let cosine = normal.dot(offset).max(0.0) / offset.length();
    Vec3::splat(20_000.0 * cosine / offset.length_squared() / PI)
}

/// A light that stands near to the wall behind the pillar, so strong that it makes a spot there.
const BESIDE: Vec3 = Vec3::new(-310.0, 40.0, 100.0);

#[test]
fn a_point_light_near_a_wall_makes_a_counted_spot() {
    let mut world = room(false, Some(&from_middle));
    let mut lit_by = |origin: Vec3, intensity: f32| {
        world.point_lights = vec![PointLight {
            origin,
            intensity: Vec3::splat(intensity),
            radius: 4.0,
            spot: None,
            falloff: Falloff::InverseSquare,
            pulse: None,
        }];
        spots(&world)
    };
    let right = lit_by(Vec3::new(-160.0, 0.0, 100.0), 20_000.0);
    assert_eq!(right.too_bright, 0, "{right:?}");
    assert!(right.texels > 20, "{right:?}");
    let wrong = lit_by(BESIDE, 1000.0);
    assert!(wrong.too_bright > 3, "{wrong:?}");
    let weak = lit_by(BESIDE, 1.0);
    assert_eq!((weak.texels, weak.too_bright), (wrong.texels, 0));
}

#[test]
fn texels_that_are_too_bright_join_the_samples_and_reduce_the_light() {
    let world = room(false, Some(&from_middle));
    let occluders = Occluders::of_world(&world);
    let sampling = sampling(200);
    let (samples, _) = samples::take(&world, &occluders, &sampling);
    let again = Cell::new(false);
    let column = |origin: Vec3, strength: f32| {
        let falloff = Falloff::InverseSquare;
        let lamp = Lamp { origin, falloff };
        let range = f32::INFINITY;
        let soa = sample_soa::SampleSoa::new(&samples);
        columns::Column {
            source: Source::Placed(lamp),
            rows: columns::point_rows(&world.bsp, &occluders, &soa, lamp, None, range),
            pieces: Vec::new(),
            strength: Vec3::splat(strength),
            limit: Vec3::INFINITY,
            prior: None,
        }
    };
    let dark = solve::Ambient {
        value: Vec3::ZERO,
        limit: Vec3::ZERO,
    };
    let columns = vec![
        column(Vec3::new(-160.0, 0.0, 100.0), 20_000.0),
        column(BESIDE, 1000.0),
    ];
    let mut fit = Fit {
        near_light_measurements: HashMap::new(),
        world: &world,
        occluders: &occluders,
        unknown_skies: &[],
        of_triangle: world.surfaces_of_triangles(),
        sampling,
        near_light_texels: HashSet::new(),
        measured: MeasuredSpace::new(&samples),
        transfer: bounce::Transfer::new(&world, &occluders, &samples, 0, |_| false),
        splashes: Vec::new(),
        columns,
        ambient: dark,
        crossings: Vec::new(),
        grid_candidates: None,
        cutoff: 0.0,
        residual_candidates: ResidualCandidates::new(samples.len()),
        rounds: Vec::new(),
        mode: FitMode::Full(Acceptance {
            stops: 1.0,
            round_limits: &[],
            splashes: &again,
        }),
        samples,
    };
    let before = fit.samples.len();
    assert!(fit.add_near_light_texels(0));
    let joined = fit.samples.len() - before;
    assert!(joined > 3, "{joined}");
    let near = |s: &samples::Sample| s.position.distance(BESIDE) < 140.0 && !s.held_out;
    assert!(fit.samples[before..].iter().all(near));
    // What the lights give to them is what they would give had they been there before.
    for column in &fit.columns {
        let Source::Placed(lamp) = column.source else {
            panic!("{column:?}");
        };
        let range = f32::INFINITY;
        let whole = columns::point_rows(
            &world.bsp,
            &occluders,
            &sample_soa::SampleSoa::new(&fit.samples),
            lamp,
            None,
            range,
        );
        assert_eq!(column.rows, whole);
    }
    fit.settle();
    let [right, wrong] = [0, 1].map(|i| fit.columns[i].strength.x);
    assert!((right / 20_000.0 - 1.0).abs() < 0.05, "{right}");
    assert!(wrong < 100.0, "{wrong}");
    assert!(!fit.add_near_light_texels(0));
}
