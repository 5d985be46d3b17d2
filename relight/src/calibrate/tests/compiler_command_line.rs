//! Maps that store their compiler's command line.

use super::*;
use crate::occluders::Occluders;

/// How far surfaces make a place dirty, id units.
const DEPTH: f32 = 128.0;

/// A room whose map has the compiler's command line.
fn saying(pairs: &[(&str, &str)], light: &dyn Fn(Vec3, Vec3) -> Vec3) -> RelitWorld {
    let mut map = room_map("t/wall", false, usize::MAX, Some(light));
    for (key, value) in pairs {
        map.set_world_key(key, value);
    }
    relit(&map.build())
}

/// Way from inside the room to its walls or the pillar.
fn way(from: Vec3, ray: Vec3) -> f32 {
    let slabs = |[a, b]: [Vec3; 2]| {
        let (a, b) = ((a - from) / ray, (b - from) / ray);
        (a.min(b).max_element(), a.max(b).min_element())
    };
    let (near, far) = slabs(PILLAR);
    let (_, out) = slabs(ROOM);
    if near > 0.0 && near < far {
        near.min(out)
    } else {
        out
    }
}

/// Part of the light that dirt leaves at a place: what lies near, over the cone that the compiler looks into.
fn left_by_dirt(at: Vec3, normal: Vec3) -> f32 {
    let across = if normal.z.abs() > 0.5 {
        Vec3::X
    } else {
        Vec3::Z
    };
    let along = normal.cross(across);
    let mut near = (1.0 - way(at, normal) / DEPTH).max(0.0);
    for k in 0..48 {
        let turn = ((k / 3) as f32 + 0.5) / 16.0 * std::f32::consts::TAU;
        let tilt = (14.5 + 29.0 * (k % 3) as f32).to_radians();
        let aside = across * turn.cos() + along * turn.sin();
        let ray = normal * tilt.cos() + aside * tilt.sin();
        near += (1.0 - way(at, ray) / DEPTH).max(0.0);
    }
    1.0 - near / 49.0
}

#[test]
fn dirt_is_found_without_a_command_line() {
    let dirty = |at: Vec3, normal: Vec3| from_hidden(at, normal) * left_by_dirt(at, normal);
    let found = |line: &str| {
        let mut world = saying(&[("_q3map2_cmdline", line)], &dirty);
        let report = calibrate(&mut world, &small());
        let total: Vec3 = world.point_lights.iter().map(|l| l.intensity).sum();
        println!("{report:?} {total}");
        (report.after.median_stops, total)
    };
    let (off, total) = found("-meta; -vis; -light -dirty -gamma 1");
    assert!(off < 0.05, "{off}");
    let hidden: Vec3 = HIDDEN.iter().map(|(_, i)| *i).sum();
    assert!((total / hidden - 1.0).abs().max_element() < 0.1, "{total}");
    // Taken for light it is light that is missing.
    let (remove_dirt, _) = found("-meta; -vis; -light -gamma 1");
    assert!(remove_dirt > off * 1.5, "{remove_dirt} {off}");
}

#[test]
fn dirt_of_the_command_line_is_dropped_if_absent() {
    let line = ("_q3map2_cmdline", "-light -dirty");
    let mut world = saying(&[line], &from_hidden);
    let report = calibrate(&mut world, &small());
    assert!(!report.dirty, "{report:?}");
    assert!(report.after.median_stops < 0.05, "{report:?}");
}

#[test]
fn the_command_line_replaces_the_search() {
    // No trial has this gamma.
    let gamma = 1.5f32;
    let encoded = |at: Vec3, normal: Vec3| from_hidden(at, normal).powf(gamma.recip());
    let line = ("_q3map2_cmdline", "-light -gamma 1.5");
    let mut world = saying(&[line], &encoded);
    let report = calibrate(&mut world, &small());
    println!("{report:?}");
    assert_eq!((report.gamma, report.has_cutoff), (gamma, false));
    assert_eq!(world.stored_gamma, gamma);
    let total: Vec3 = world.point_lights.iter().map(|l| l.intensity).sum();
    let hidden: Vec3 = HIDDEN.iter().map(|(_, i)| *i).sum();
    assert!((total / hidden - 1.0).abs().max_element() < 0.1, "{total}");
}

#[test]
fn held_out_texels_are_not_thinned() {
    // Black but for what lies near one light.
    let near = |at: Vec3, normal: Vec3| {
        let (origin, _) = HIDDEN[0];
        match at.distance(origin) < 260.0 {
            true => from_hidden(at, normal),
            false => Vec3::ZERO,
        }
    };
    let world = saying(&[], &near);
    let occluders = Occluders::of_world(&world);
    let take = |few_black| {
        let sampling = SamplingOptions {
            few_black,
            ..sampling(4000)
        };
        samples::take(&world, &occluders, &sampling).0
    };
    let part_black = |samples: &[samples::Sample], held_out: bool| {
        let chosen = samples.iter().filter(|s| s.held_out == held_out);
        let black = chosen.clone().filter(|s| s.value == Vec3::ZERO).count();
        black as f32 / chosen.count() as f32
    };
    let (alike, few) = (take(false), take(true));
    let black = part_black(&alike, false);
    assert!(black > 0.55, "{black}");
    assert!((part_black(&few, true) - black).abs() < 0.06);
    assert!(part_black(&few, false) < black - 0.15);
}
