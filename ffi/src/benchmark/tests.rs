//! Made-up frames in, results out.

use super::*;
use glam::Vec3;

fn points(count: usize) -> Vec<PathPoint> {
    let point = |i: usize| PathPoint {
        time_ms: i32::try_from(i).unwrap_or(i32::MAX),
        origin: Vec3::ZERO,
        angles: Vec3::ZERO,
        fov: [90.0, 74.0],
    };
    (0..count).map(point).collect()
}

fn cost(ms: f32) -> Vec<PassCost> {
    let pass = |name: &str, ms| PassCost {
        name: name.to_owned(),
        ms,
        rays: None,
    };
    vec![pass("a", ms), pass("b", 1.0)]
}

/// Plays a path, whose frame `i` of all takes `i` ms on the GPU, with games' frames of 99 ms after every few; the
/// times of the path's points in the order in which they were drawn, and the lines.
fn play(benchmark: &mut Benchmark, few: usize) -> (Vec<i32>, Vec<String>) {
    let start = Instant::now();
    let (mut clock, mut costs) = (0u64, vec![0.0, 0.0]);
    let (mut drawn, mut lines) = (Vec::new(), Vec::new());
    for _ in 0..1000 {
        assert!(!benchmark.sees());
        (clock, costs) = (clock + 5, [&costs[..], &[99.0]].concat());
        let known = costs[costs.len() - 1 - LATE];
        let now = start + Duration::from_millis(clock);
        match benchmark.game_frame(now, || cost(known)) {
            Step::Ends => return (drawn, lines),
            step => assert_eq!(step, Step::GoesOn),
        }
        for _ in 0..few {
            let Some(point) = benchmark.next() else { break };
            #[allow(clippy::cast_precision_loss)] // a few frames
            costs.push(drawn.len() as f32);
            drawn.push(point.time_ms);
            clock += 10;
            let known = costs[costs.len() - 1 - LATE];
            let now = start + Duration::from_millis(clock);
            match benchmark.path_frame(now, || cost(known)) {
                Step::GoesOn => {}
                Step::Says(line) => lines.push(line),
                Step::Ends => return (drawn, lines),
                Step::GivesUp(line) => panic!("{line}"),
            }
        }
        benchmark.game_goes_on();
    }
    panic!("it never ends");
}

#[test]
fn each_frame_of_a_path_is_measured_once_and_by_its_own_gpu_time() {
    for few in [1, 3, 1000] {
        let mut benchmark = Benchmark::path("x", points(40)).expect("a path");
        let (drawn, lines) = play(&mut benchmark, few);
        assert_eq!(drawn[..WARM_UP], [0; WARM_UP]);
        let all: Vec<i32> = (0..40).collect();
        assert_eq!(drawn[WARM_UP..WARM_UP + 40], all);
        assert_eq!(
            lines,
            [10, 20, 30].map(|n| format!("benchmark: {n} of 40 frames"))
        );
        let samples = benchmark.samples();
        // the pass b adds 1
        let gpu: Vec<f32> = (0..40u8).map(|i| f32::from(i) + 10.0 + 1.0).collect();
        assert_eq!(samples.gpu, gpu, "{few}");
        assert_eq!(samples.passes[1], ("b".to_owned(), vec![1.0; 40]));
        assert_eq!(samples.frames.len(), 40);
        let slower = samples.frames.iter().filter(|ms| **ms > 14.0).count();
        assert_eq!(slower, 40 / few.min(41), "{few}: {:?}", samples.frames);
    }
}

#[test]
fn a_short_path_is_measured_and_an_empty_one_is_none() {
    let mut benchmark = Benchmark::path("x", points(1)).expect("a path");
    let (drawn, lines) = play(&mut benchmark, 100);
    assert_eq!(drawn.len(), WARM_UP + 1 + LATE);
    assert_eq!(lines, Vec::<String>::new());
    assert_eq!(benchmark.samples().gpu.len(), 1);
    assert!(Benchmark::path("x", Vec::new()).is_none());
}

#[test]
fn a_path_waits_while_the_game_does_not_show_the_map_and_ends_with_the_map() {
    let mut benchmark = Benchmark::path("x", points(4)).expect("a path");
    assert_eq!(benchmark.game_frame(Instant::now(), Vec::new), Step::GoesOn);
    assert!(benchmark.next().is_none());
    let Step::GivesUp(line) = benchmark.unload(true) else {
        panic!("it goes on without its map");
    };
    assert!(line.contains("after 0 of 4 frames"), "{line}");
}

#[test]
fn a_device_without_timestamps_leaves_gpu_times_empty() {
    let mut benchmark = Benchmark::path("x", points(4)).expect("a path");
    let mut now = Instant::now();
    benchmark.sees();
    while benchmark.next().is_some() {
        now += Duration::from_millis(1);
        benchmark.path_frame(now, Vec::new);
    }
    assert_eq!(benchmark.samples().frames.len(), 4);
    assert!(benchmark.samples().gpu.is_empty());
}

/// Plays frames of 10 ms of a demo, with or without a view of the map; the first step other than going on.
fn show(benchmark: &mut Benchmark, now: &mut Instant, frames: usize, views: bool) -> Step {
    for _ in 0..frames {
        *now += Duration::from_millis(10);
        if views {
            assert!(benchmark.sees());
        }
        let step = benchmark.game_frame(*now, || cost(2.0));
        if step != Step::GoesOn {
            return step;
        }
    }
    Step::GoesOn
}

#[test]
fn a_demo_is_measured_from_its_map_on_until_its_view_stays_away() {
    let mut benchmark = Benchmark::demo("one");
    let now = &mut Instant::now();
    // of the map before
    assert_eq!(show(&mut benchmark, now, 50, true), Step::GoesOn);
    for _ in 0..2 {
        assert_eq!(benchmark.unload(true), Step::GoesOn);
    }
    *now += Duration::from_secs(100);
    assert_eq!(show(&mut benchmark, now, 20, false), Step::GoesOn);
    assert_eq!(show(&mut benchmark, now, 100, true), Step::GoesOn);
    assert_eq!(show(&mut benchmark, now, 200, false), Step::GoesOn);
    assert_eq!(show(&mut benchmark, now, 10, true), Step::GoesOn);
    assert_eq!(show(&mut benchmark, now, 400, false), Step::Ends);
    let samples = benchmark.samples();
    assert_eq!((samples.frames.len(), samples.gpu.len()), (100, 100));
    assert!(samples.frames.iter().all(|ms| (ms - 10.0).abs() < 0.1));
}

#[test]
fn a_demo_ends_with_its_map() {
    let mut benchmark = Benchmark::demo("one");
    let now = &mut Instant::now();
    benchmark.unload(true);
    show(&mut benchmark, now, 30, true);
    assert_eq!(benchmark.unload(true), Step::Ends);
    assert_eq!(benchmark.samples().frames.len(), 20);
}

#[test]
fn a_demo_that_is_not_played_or_too_short_has_no_result() {
    let now = &mut Instant::now();
    let mut benchmark = Benchmark::demo("none");
    let step = show(&mut benchmark, now, 10_000, true);
    assert!(matches!(step, Step::GivesUp(_)), "{step:?}");
    let mut benchmark = Benchmark::demo("short");
    benchmark.unload(true);
    show(&mut benchmark, now, 5, true);
    assert!(matches!(benchmark.unload(true), Step::GivesUp(_)));
    assert!(matches!(
        Benchmark::demo("quit").unload(false),
        Step::GivesUp(_)
    ));
}
