//! Measurements that are taken where directives are nearly as good as what is found.

use super::splash::from_lamp;
use super::*;
use crate::calibrate::random::lot;

/// How far off what any light could explain texels are, stops.
const NOISE: f32 = 0.2;

/// A room lit by its lamp as the directive says, but for noise.
fn noisy() -> RelitWorld {
    let lamp = from_lamp(0.0);
    let light = |at: Vec3, normal: Vec3| {
        let name = at.to_array().map(f32::to_bits);
        let off = if lot(1, &name) < 0.5 { -NOISE } else { NOISE };
        lamp(at, normal) * (off.exp2() / splash::FACTOR)
    };
    room(true, Some(&light))
}

#[test]
fn where_directives_are_nearly_right_more_is_measured_and_the_better_is_kept() {
    for seed in [1, 2] {
        let options = CalibrationOptions {
            samples: 600,
            candidates: 300,
            seed,
            ..Default::default()
        };
        let report = calibrate(&mut noisy(), &options);
        println!("{report:?}");
        let [before, after] = [&report.before, &report.after].map(|a| a.median_stops);
        assert!(after < UNEXPLAINED && after > before * HALF);
        let world = noisy();
        let way = |splashes: bool| Compiler {
            gamma: report.gamma,
            ends: report.ends,
            dirt: None,
            splashes,
        };
        assert!(report.gamma == 1.0 && !report.ends && !report.dirty);
        let cell = Cell::new(true);
        let once = find_with_enough(&world, &[], &options, way(true), &cell, &mut |_| ());
        let splashes = once.report.splashes > 0;
        let more = find_more(&world, &[], &options, way(splashes), &cell, &mut |_| ());
        assert!(!once.measured_more && more.measured_more);
        assert!(more.report.samples > once.report.samples * 3 / 2);
        let off = [once, more].map(|s| s.report.after.median_stops);
        assert_eq!(after, off[0].min(off[1]), "{off:?}");
    }
}
