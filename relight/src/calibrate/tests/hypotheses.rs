//! Selection of hypotheses: more samples where directives are nearly as good as the fit, and abandoned fits.

use super::splash::from_lamp;
use super::*;
use crate::calibrate::hypotheses::{HALF, Hypotheses, Incumbent, UNEXPLAINED};
use support::random::hashed_uniform;

/// How far off what any light could explain texels are, stops.
const NOISE: f32 = 0.2;

/// A room lit by its lamp with the directive's strength, plus noise.
fn noisy() -> RelitWorld {
    let lamp = from_lamp(0.0);
    let light = |at: Vec3, normal: Vec3| {
        let name = at.to_array().map(f32::to_bits);
        let off = if hashed_uniform(1, &name) < 0.5 {
            -NOISE
        } else {
            NOISE
        };
        lamp(at, normal) * (off.exp2() / splash::FACTOR)
    };
    room(true, Some(&light))
}

#[test]
fn nearly_exact_directives_trigger_more_samples_and_the_better_fit_is_kept() {
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
        let mut world = noisy();
        let setting = |splashes: bool| Compiler {
            gamma: report.gamma,
            has_cutoff: report.has_cutoff,
            dirt: None,
            splashes,
        };
        assert!(report.gamma == 1.0 && !report.has_cutoff && !report.dirty);
        let nothing = &mut |_| ();
        let mut hypotheses = Hypotheses::new(&mut world, &[], &options, nothing);
        let once = hypotheses.with(setting(true));
        let (cell, same) = (Cell::new(true), setting(once.report.splashes > 0));
        let more = hypotheses
            .measured_more(same, None, &cell, &|| 1.0)
            .unwrap();
        assert!(!once.measured_more && more.measured_more);
        assert!(more.report.samples > once.report.samples * 3 / 2);
        let off = [once, more].map(|s| s.report.after.median_stops);
        assert_eq!(after, off[0].min(off[1]), "{off:?}");
    }
}

#[test]
fn a_fit_behind_the_incumbent_is_abandoned() {
    let mut world = room(false, Some(&from_hidden));
    let (options, nothing) = (small(), &mut |_| ());
    let mut hypotheses = Hypotheses::new(&mut world, &[], &options, nothing);
    let plain = Compiler {
        gamma: 1.0,
        has_cutoff: false,
        dirt: None,
        splashes: false,
    };
    let cell = Cell::new(false);
    let mut more =
        |incumbent: Option<&Incumbent>| hypotheses.measured_more(plain, incumbent, &cell, &|| 1.0);
    let found = more(None).unwrap();
    assert!(!found.rounds.is_empty() && found.measured_more);
    let incumbent = || {
        let mut incumbent = Incumbent::of(&found);
        incumbent.stops *= 1.1;
        incumbent
    };
    // it keeps up with itself
    let again = more(Some(&incumbent())).unwrap();
    assert_eq!(again.rounds, found.rounds);
    let mut faster = incumbent();
    faster.round_limits[0] = found.rounds[0] * 0.9;
    assert!(more(Some(&faster)).is_none());
    let mut better = incumbent();
    better.stops = found.report.after.median_stops * 0.9;
    assert!(more(Some(&better)).is_none());
}
