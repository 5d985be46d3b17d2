//! `rt_benchmark`: costs of the frames along a camera path, or of a demo that the game plays.
//!
//! Frames of a path are drawn between the game's frames, each once and in order, before them the first one repeatedly,
//! until pipelines are compiled and caches are warm. Views of a demo are the game's own. GPU times of a frame are known
//! some frames later.

mod report;
mod route;

pub use report::Report;
pub use route::{fly_through, is_demo_name};

use renderer_vk::PassCost;
use renderer_vk::path::PathPoint;
use std::time::{Duration, Instant};

/// Frames before the first that is measured.
const WARM_UP: usize = 10;
/// Frames from a frame to the one that knows its GPU times.
const LATE: usize = renderer_vk::FRAMES_IN_FLIGHT;
/// A demo has ended when the game has shown no view of the map for this long.
const DEMO_ENDED: Duration = Duration::from_secs(3);
/// A demo that shows no view for this long is not played.
const DEMO_MISSING: Duration = Duration::from_secs(30);
/// Loading a map takes one frame; no frame counts as longer in the times above.
const LONGEST_FRAME: Duration = Duration::from_millis(250);

/// Times of the measured frames, milliseconds.
#[derive(Debug, Default)]
pub struct Samples {
    /// From the end of the frame before to the end of the frame.
    pub frames: Vec<f32>,
    /// On the GPU; empty where the device measures no times.
    pub gpu: Vec<f32>,
    /// The same of each pass, in the order of the first recording.
    pub passes: Vec<(String, Vec<f32>)>,
}

impl Samples {
    fn add(&mut self, passes: &[PassCost]) {
        if passes.is_empty() {
            return;
        }
        self.gpu.push(passes.iter().map(|pass| pass.ms).sum());
        for pass in passes {
            match self.passes.iter_mut().find(|(name, _)| *name == pass.name) {
                Some((_, times)) => times.push(pass.ms),
                None => self.passes.push((pass.name.clone(), vec![pass.ms])),
            }
        }
    }
}

/// What is drawn.
#[derive(Debug)]
enum Source {
    /// Cameras, at least one.
    Path(Vec<PathPoint>),
    /// What the game shows. Whether the map that was loaded before the demo is gone.
    Demo(bool),
}

/// What becomes of a benchmark.
#[derive(Debug, PartialEq, Eq)]
pub enum Step {
    /// It goes on.
    GoesOn,
    /// It goes on, with a line for the player.
    Says(String),
    /// Everything was measured.
    Ends,
    /// There is no result, for this reason.
    GivesUp(String),
}

/// A benchmark in progress.
#[derive(Debug)]
pub struct Benchmark {
    route: String,
    source: Source,
    /// Frames with a view of the map: those of the path, or the game's of a demo.
    shown: usize,
    /// The game's frame has a view of the map.
    seen: bool,
    /// Whether the last frames are measured ones whose GPU times are not known yet, the newest first.
    late: [bool; LATE],
    /// How long the game has shown no view of the map.
    away: Duration,
    /// End of the last frame.
    last: Option<Instant>,
    samples: Samples,
}

impl Benchmark {
    fn new(route: String, source: Source) -> Self {
        Self {
            route,
            source,
            shown: 0,
            seen: false,
            late: [false; LATE],
            away: Duration::ZERO,
            last: None,
            samples: Samples::default(),
        }
    }

    /// Measures a camera path; `route` names it in the result. `None`: it has no frames.
    pub fn path(route: &str, points: Vec<PathPoint>) -> Option<Self> {
        (!points.is_empty()).then(|| Self::new(route.to_owned(), Source::Path(points)))
    }

    /// Measures a demo, from the next map that is loaded on.
    pub fn demo(name: &str) -> Self {
        Self::new(format!("demo {name}"), Source::Demo(false))
    }

    /// What is drawn, in words for the result.
    pub fn route(&self) -> &str {
        &self.route
    }

    /// The measured times.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Number of frames to measure; `None`: as many as the demo has.
    pub fn length(&self) -> Option<usize> {
        match &self.source {
            Source::Path(points) => Some(points.len()),
            Source::Demo(_) => None,
        }
    }

    /// The game shows a view of the map. Returns whether to draw it.
    pub fn sees(&mut self) -> bool {
        self.seen = true;
        matches!(self.source, Source::Demo(_))
    }

    /// The next frame of the path, to be drawn before the game goes on; `None` while the game does not show the map.
    pub fn next(&self) -> Option<PathPoint> {
        match &self.source {
            Source::Path(points) if self.seen && !self.is_over() => {
                let at = self.shown.saturating_sub(WARM_UP).min(points.len() - 1);
                points.get(at).copied()
            }
            _ => None,
        }
    }

    /// Whether the frames of the path and their GPU times are all measured.
    fn is_over(&self) -> bool {
        let all = self.length().map(|length| WARM_UP + length);
        all.is_some_and(|all| self.shown >= all) && !self.late.contains(&true)
    }

    /// Ends a frame that was measured or not; `passes` are those of the newest frame whose GPU times are known.
    fn record(&mut self, now: Instant, measured: bool, passes: impl FnOnce() -> Vec<PassCost>) {
        let time = self.last.replace(now).map(|last| now.duration_since(last));
        if let Some(time) = time.filter(|_| measured) {
            self.samples.frames.push(time.as_secs_f32() * 1000.0);
        }
        self.late.rotate_right(1);
        if std::mem::replace(&mut self.late[0], measured) {
            self.samples.add(&passes());
        }
    }

    /// Ends a frame of the path.
    pub fn path_frame(&mut self, now: Instant, passes: impl FnOnce() -> Vec<PassCost>) -> Step {
        let length = self.length().unwrap_or_default();
        let at = self.shown.checked_sub(WARM_UP).filter(|at| *at < length);
        self.shown += 1;
        self.record(now, at.is_some(), passes);
        if self.is_over() {
            return Step::Ends;
        }
        match at.map(|at| at + 1) {
            Some(done) if done < length && done * 4 / length > (done - 1) * 4 / length => {
                Step::Says(format!("benchmark: {done} of {length} frames"))
            }
            _ => Step::GoesOn,
        }
    }

    /// Ends a frame of the game. Frames of a path follow until [`next`](Self::next) has none.
    pub fn game_frame(&mut self, now: Instant, passes: impl FnOnce() -> Vec<PassCost>) -> Step {
        let before = self.last;
        let Source::Demo(begun) = self.source else {
            self.record(now, false, passes);
            // the time of the game's frame is part of the next one's, unless a menu hid the map
            self.last = before.filter(|_| self.seen);
            // it may be the frame that knows the last GPU times
            return match self.is_over() {
                true => Step::Ends,
                false => Step::GoesOn,
            };
        };
        let seen = std::mem::take(&mut self.seen) && begun;
        self.shown += usize::from(seen);
        self.record(now, seen && self.shown > WARM_UP, passes);
        let passed = before.map_or(Duration::ZERO, |before| now.duration_since(before));
        self.away = match seen {
            true => Duration::ZERO,
            false => self.away + passed.min(LONGEST_FRAME),
        };
        match self.shown {
            0 if self.away >= DEMO_MISSING => Step::GivesUp(format!(
                "benchmark: the game did not play \"{}\"; write the demo's name as the command demo takes it",
                self.route
            )),
            1.. if self.away >= DEMO_ENDED => self.ended(),
            _ => Step::GoesOn,
        }
    }

    /// A frame of the game ended, and so did the frames drawn after it.
    pub fn game_goes_on(&mut self) {
        self.seen = false;
    }

    /// The game ends its registration, which unloads its map. `back`: it may load another one.
    pub fn unload(&mut self, back: bool) -> Step {
        match &mut self.source {
            Source::Demo(begun) if back && self.shown == 0 => {
                (*begun, self.seen, self.last) = (true, false, None);
                Step::GoesOn
            }
            _ => self.ended(),
        }
    }

    /// The end of the demo, or of the map in the middle of a path.
    fn ended(&self) -> Step {
        let done = self.samples.frames.len();
        match self.length() {
            None if done > 0 => Step::Ends,
            None => Step::GivesUp(format!(
                "benchmark: \"{}\" was too short to measure: {WARM_UP} frames come before the first",
                self.route
            )),
            Some(length) => Step::GivesUp(format!(
                "benchmark: the map ended after {done} of {length} frames; nothing was written"
            )),
        }
    }
}

#[cfg(test)]
mod tests;
