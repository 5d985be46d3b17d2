//! Frames of a simulated engine, GPU and display. Times are milliseconds.

use super::*;

/// What is simulated.
#[derive(Clone, Copy, Debug)]
struct Machine {
    /// Mean time of the engine and of recording.
    work: f64,
    /// Added to some frames: the engine's server.
    server: f64,
    /// Every so many frames.
    every: usize,
    /// Mean time of the GPU.
    gpu: f64,
    /// Time between two pictures of the display; 0: pictures are shown at once.
    display: f64,
    /// Greatest deviation of the times, as part of them.
    jitter: f64,
}

#[derive(Clone, Copy, Debug)]
struct Result {
    /// Mean time between the ends of two frames.
    interval: f64,
    /// 50th and 99th percentile of the time from the end of the frame before to that of the frame.
    latency: [f64; 2],
    /// The 99th percentile as the pacer reports it.
    reported: f64,
    /// 99th percentile of the latency minus the frame's own CPU time and the larger of GPU time and display interval.
    excess: f64,
}

/// Numbers from -1 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }
}

/// How many frames wait, and whether the engine is kept until its work is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    Two,
    One,
    JustInTime,
}

fn simulate(machine: Machine, mode: Mode) -> Result {
    const FRAMES: usize = 4000;
    let start = Instant::now();
    let at = |ms: f64| start + Duration::from_secs_f64(ms / 1000.0);
    let mut random = Random(1);
    let mut vary = |mean: f64| mean * (1.0 + machine.jitter * random.next());
    let mut pacer = Pacer::default();
    let look = |pacer: &mut Pacer, ended: &[f64], now: f64| {
        while let Some(oldest) = pacer.oldest().filter(|f| ended[*f as usize] <= now) {
            pacer.end(oldest, at(now));
        }
    };
    let (mut done, mut ended) = (vec![0.0; 2], vec![0.0; 2]);
    let (mut now, mut latencies, mut excesses) = (0.0, Vec::new(), Vec::new());
    for frame in 2..FRAMES {
        let free = now;
        pacer.begin(at(now));
        let server = if frame % machine.every == 0 {
            machine.server
        } else {
            0.0
        };
        let halves = [machine.work * 0.5; 2].map(&mut vary);
        let gpu = vary(machine.gpu);
        now += halves[0] + server;
        // the ring, and the images of the window
        now = f64::max(now, done[frame - 2]);
        look(&mut pacer, &ended, now);
        now += halves[1];
        if machine.display > 0.0 {
            now = f64::max(now, ended[frame - 2]);
        }
        pacer.submit(frame as u64, frame as u64, at(now));
        done.push(f64::max(now, done[frame - 1]) + gpu);
        ended.push(match machine.display {
            0.0 => done[frame],
            d => f64::max((done[frame] / d).ceil() * d, ended[frame - 1] + d),
        });
        if mode != Mode::Two {
            let before = frame - 1;
            if machine.display > 0.0 && done[before] > now {
                now = done[before];
                pacer.draw(before as u64, at(now));
            }
            let waited = ended[before] > now;
            now = f64::max(now, ended[before]);
            pacer.end(before as u64, at(now));
            pacer.waited(waited.then(|| at(now)));
            let rest = pacer.rest().as_secs_f64() * 1000.0;
            if mode == Mode::JustInTime && rest > 0.0 {
                let until = now + rest;
                if machine.display > 0.0 && done[frame] > now && done[frame] < until {
                    pacer.draw(frame as u64, at(done[frame]));
                }
                // a sleep lasts longer than it is asked to
                now = until + 0.1;
            }
        }
        look(&mut pacer, &ended, now);
        pacer.free(at(now));
        let latency = ended[frame] - free;
        latencies.push(latency);
        let own = halves[0] + halves[1] + server + f64::max(gpu, machine.display);
        excesses.push(latency - own);
    }
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    let (latencies, excesses) = (sorted(latencies), sorted(excesses));
    let part = |p: usize| latencies[latencies.len() * p / 100];
    Result {
        interval: (ended[FRAMES - 1] - ended[2]) / (FRAMES - 3) as f64,
        latency: [part(50), part(99)],
        excess: excesses[excesses.len() * 99 / 100],
        reported: pacer.latency("").map_or(0.0, |l| l.from_end.p99),
    }
}

/// Machines, with the name of what is slowest.
fn machines() -> Vec<(&'static str, Machine)> {
    let machine = |work, (server, every), gpu, display, jitter| Machine {
        work,
        server,
        every,
        gpu,
        display,
        jitter,
    };
    let (slow, fast) = (1000.0 / 60.0, 1000.0 / 144.0);
    vec![
        ("GPU, steady", machine(1.0, (0.0, 6), 8.0, 0.0, 0.03)),
        ("GPU, uneven", machine(1.2, (0.4, 6), 8.0, 0.0, 0.15)),
        ("GPU, slow CPU", machine(5.0, (2.0, 6), 12.0, 0.0, 0.15)),
        ("GPU, 500 Hz", machine(0.6, (0.6, 50), 2.0, 0.0, 0.15)),
        ("CPU and GPU", machine(8.0, (1.0, 6), 8.0, 0.0, 0.15)),
        ("CPU", machine(8.0, (1.0, 6), 3.0, 0.0, 0.15)),
        ("display, 60 Hz", machine(1.2, (0.4, 3), 5.0, slow, 0.15)),
        ("display, 144 Hz", machine(1.2, (0.4, 7), 4.0, fast, 0.15)),
        ("GPU near 60 Hz", machine(1.2, (0.4, 3), 16.0, slow, 0.1)),
        ("GPU below 60 Hz", machine(1.2, (0.4, 3), 20.0, slow, 0.1)),
    ]
}

/// Milliseconds of the frames, and of their latency: median and 99th percentile. `-- --nocapture` prints them.
#[test]
fn one_waiting_frame_saves_time_and_costs_little() {
    for (slowest, machine) in machines() {
        let modes = [Mode::Two, Mode::One, Mode::JustInTime];
        let [two, one, just] = modes.map(|mode| simulate(machine, mode));
        for (mode, found) in modes.iter().zip([two, one, just]) {
            let [median, p99] = found.latency;
            println!(
                "{slowest}, {mode:?}: {:.2} ms a frame, latency {median:.2}, {p99:.2}, more than its own {:.2}",
                found.interval, found.excess
            );
        }
        assert!(one.interval < two.interval * 1.04, "{slowest}");
        assert!(just.interval < one.interval * 1.005, "{slowest}");
        for at in 0..2 {
            assert!(one.latency[at] <= two.latency[at] + 0.01, "{slowest}");
            assert!(just.latency[at] <= one.latency[at] + 0.2, "{slowest}");
        }
        if slowest.starts_with("GPU") || slowest.starts_with("display") {
            let saved = two.latency[0] - one.latency[0];
            assert!(saved > 0.75 * two.interval, "{slowest}: {saved}");
        }
    }
}

#[test]
fn a_frame_that_the_engine_makes_just_in_time_is_shown_soon() {
    for (slowest, machine) in machines() {
        if slowest == "GPU, steady" || slowest.starts_with("display") {
            let found = simulate(machine, Mode::JustInTime);
            assert!(found.excess < 2.0, "{slowest}: {found:?}");
            // what the pacer reports is what happened
            let error = found.reported - found.latency[1];
            assert!(error.abs() < 0.2, "{slowest}: {found:?}");
        }
    }
}

/// A pacer whose frames take 2 ms of the CPU and end every 10 ms.
fn steady(frames: u64) -> (Pacer, Instant) {
    let start = Instant::now();
    let at = |ms: u64| start + Duration::from_millis(ms);
    let mut pacer = Pacer::default();
    pacer.free(start);
    for frame in 1..=frames {
        let begin = frame * 10;
        pacer.begin(at(begin));
        pacer.submit(frame, frame, at(begin + 2));
        if let Some((mark, _)) = pacer.before_newest() {
            assert_eq!(mark, frame - 1);
            pacer.end(mark, at(begin + 10));
            pacer.waited(Some(at(begin + 10)));
        }
        pacer.free(at(begin + 10));
    }
    (pacer, at(frames * 10 + 10))
}

#[test]
fn the_engine_is_kept_for_what_it_does_not_need() {
    let (pacer, _) = steady(1);
    assert_eq!(pacer.rest(), Duration::ZERO, "nothing is known");
    // the first frame begins 10 ms after the last end
    let (pacer, _) = steady(80);
    assert_eq!(pacer.rest(), Duration::from_micros(7500));
}

#[test]
fn a_late_frame_is_not_followed_by_a_rest() {
    let (mut pacer, now) = steady(80);
    pacer.submit(81, 81, now);
    pacer.end(80, now);
    pacer.waited(None);
    assert_eq!(pacer.rest(), Duration::ZERO);
    pacer.forget();
    assert_eq!((pacer.oldest(), pacer.rest()), (None, Duration::ZERO));
    assert_eq!(pacer.newest(), 81);
}

#[test]
fn a_gpu_that_misses_pictures_of_the_display_gets_work_at_once() {
    let (mut pacer, now) = steady(80);
    pacer.submit(81, 81, now);
    pacer.draw(81, now + Duration::from_millis(12));
    assert_eq!(pacer.rest(), Duration::ZERO);
}

#[test]
fn frames_whose_end_is_never_seen_are_forgotten() {
    let (mut pacer, now) = steady(1);
    for frame in 2..100 {
        pacer.submit(frame, frame, now);
    }
    assert_eq!(pacer.waiting.len(), WAITING);
    assert_eq!(pacer.oldest(), Some(92));
    pacer.end(99, now);
    assert_eq!(pacer.oldest(), None);
    let latency = pacer.latency("drawn").expect("frames");
    assert_eq!((latency.frames, latency.from_end.median), (8, 0.0));
}
