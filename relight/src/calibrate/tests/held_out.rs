//! Texels are fitted or held out, and each is measured at most once.

use super::*;
use crate::occluders::Occluders;
use proptest::prelude::*;
use samples::Sample;
use std::collections::HashSet;

/// The room with `side` texels along each side of its faces, but for the first face, which has `first`.
fn coarse(side: u32, first: u32) -> RelitWorld {
    let mut map = room_map("t/wall", false, usize::MAX, Some(&from_hidden));
    let page = q3bsp::LIGHTMAP_SIZE as f32;
    for face in 0..12 {
        let side = if face == 0 { first } else { side };
        for vertex in map.vertices_mut(face) {
            vertex.lightmap *= side as f32 / page;
        }
    }
    relit(&map.build())
}

fn taken(world: &RelitWorld, count: usize, seed: u64) -> Vec<Sample> {
    let occluders = Occluders::of_world(world);
    let sampling = SamplingOptions {
        seed,
        ..sampling(count)
    };
    let (samples, evidence) = samples::take(world, &occluders, &sampling);
    assert_eq!(evidence, Evidence::Lightmaps);
    samples
}

/// A texel's middle and the way that it faces.
fn places(samples: &[Sample], held_out: bool) -> HashSet<[u32; 6]> {
    let chosen = samples.iter().filter(|s| s.held_out == held_out);
    let place = |s: &Sample| {
        let [x, y, z] = s.position.to_array();
        let [u, v, w] = s.normal.to_array();
        [x, y, z, u, v, w].map(f32::to_bits)
    };
    chosen.map(place).collect()
}

proptest! {
    #![proptest_config(testkit::cases(24))]

    #[test]
    fn a_texel_is_fitted_or_held_out(
        side in 3u32..24,
        first in 3u32..24,
        count in 100usize..3000,
        others in 100usize..3000,
        seed in any::<u64>(),
    ) {
        let world = coarse(side, first);
        let one = taken(&world, count, seed);
        let (fitted, judges) = (places(&one, false), places(&one, true));
        prop_assert!(fitted.is_disjoint(&judges));
        prop_assert_eq!(fitted.len() + judges.len(), one.len());
        prop_assert!(one.len() as u32 <= 11 * side * side + first * first);
        // Nor with any other number of measurements.
        let other = taken(&world, others, seed);
        prop_assert!(fitted.is_disjoint(&places(&other, true)));
        prop_assert!(judges.is_disjoint(&places(&other, false)));
    }
}

#[test]
fn a_fifth_is_held_out_and_another_seed_holds_out_others() {
    let world = coarse(24, 24);
    let one = taken(&world, 5000, 1);
    let judges = places(&one, true);
    let part = judges.len() as f32 / one.len() as f32;
    assert!(one.len() > 4000 && (part - 0.2).abs() < 0.03, "{part}");
    let other = taken(&world, 5000, 2);
    let both = judges.intersection(&places(&other, true)).count();
    assert!(both * 3 < judges.len(), "{both} of {}", judges.len());
}

#[test]
fn a_surface_gets_at_most_one_sample_a_texel() {
    // The first face is the floor or a wall of the room: a large part of its area.
    let world = coarse(48, 4);
    let samples = taken(&world, 3000, 1);
    let [a, b, c] = world.triangle(0);
    let normal = (b - a).cross(c - a).normalize();
    let on_first = samples
        .iter()
        .filter(|s| s.normal.dot(normal).abs() > 0.99)
        .filter(|s| (s.position - a).dot(normal).abs() < 2.0);
    let on_first = on_first.count();
    assert!((12..=16).contains(&on_first), "{on_first}");
    // the remaining samples are on the other surfaces
    assert!(samples.len() > 2700, "{}", samples.len());
}

#[test]
fn positions_inside_brushes_give_no_samples() {
    let [low, high] = [
        Vec3::new(100.0, -200.0, -8.0),
        Vec3::new(200.0, -100.0, 60.0),
    ];
    let in_it = |blocked: bool| {
        let mut map = room_map("t/wall", false, usize::MAX, Some(&from_hidden));
        let wall = map.add_shader("t/wall", 0, 1);
        if blocked {
            map.add_box_brush(wall, low, high);
        }
        let samples = taken(&relit(&map.build()), 4000, 1);
        let inside = |s: &&Sample| s.position.cmpgt(low).all() && s.position.cmplt(high).all();
        samples.iter().filter(inside).count()
    };
    assert!(in_it(false) > 20);
    assert_eq!(in_it(true), 0);
}
