//! Frame pacing: how long to delay the engine at the end of a frame, and the latency from input to picture.
//!
//! The engine reads input after a frame's end and before the next frame's calls. Every wait between that input and the
//! picture adds to the latency, so the waits are moved to the frame's end. This module only computes, from timestamps
//! that it is given; `renderer/pace.rs` takes the timestamps and waits.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::statistics::{Latency, Spread};

/// Number of frames whose times are remembered: more than the engine draws between two frames of its server (50 ms),
/// which make the frames that they fall into longer than others.
const REMEMBERED: usize = 64;
/// Number of frames whose latency is reported.
const REPORTED: usize = 512;
/// Safety margin of the delay: a sleep of the system may last this much longer than asked.
const MARGIN: Duration = Duration::from_micros(500);
/// Most submitted frames whose end is awaited, more than a display queues; beyond it the oldest is dropped.
const WAITING: usize = 8;

/// A submitted frame.
#[derive(Clone, Copy, Debug)]
struct Frame {
    /// Number by which its end is known.
    mark: u64,
    /// Number of its submission, by which the end of drawing is known.
    submission: u64,
    /// End of the frame before: the engine may read input from here on.
    free: Instant,
    /// Its first call: the engine has read input.
    begun: Instant,
    submitted: Instant,
}

/// Durations of the newest frames, each with the number of its frame; not every frame has one.
#[derive(Clone, Debug, Default)]
struct Recent(VecDeque<(u64, Duration)>);

impl Recent {
    fn add(&mut self, frame: u64, value: Duration) {
        if self.0.len() == REMEMBERED {
            self.0.pop_front();
        }
        self.0.push_back((frame, value));
    }

    /// Durations of the last [`REMEMBERED`] frames up to `frame`.
    fn until(&self, frame: u64) -> impl Iterator<Item = Duration> {
        let newer = move |(of, _): &&(u64, Duration)| of + REMEMBERED as u64 > frame;
        self.0.iter().filter(newer).map(|(_, value)| *value)
    }
}

/// Timestamps of the recent frames, and what follows from them.
#[derive(Debug, Default)]
pub struct Pacer {
    /// End of the last frame.
    free: Option<Instant>,
    /// First call of the present frame.
    begun: Option<Instant>,
    /// Number of frames so far.
    frames: u64,
    /// Mark of the newest frame.
    newest: u64,
    /// Mark and submission of the newest frame, and of the one before it.
    last: Option<(u64, u64)>,
    before: Option<(u64, u64)>,
    /// Submitted frames, oldest first.
    waiting: VecDeque<Frame>,
    /// Time of frames from the end of the frame before to their submission.
    work: Recent,
    /// Times between the ends of two successive frames that the CPU waited for: it was not the bottleneck, so these are
    /// frame times of the GPU or intervals of the display.
    intervals: Recent,
    /// GPU times of frames; only known where a frame ends on the display.
    gpu: Recent,
    /// End of the last frame that the GPU is known to have finished.
    drawn: Option<Instant>,
    /// End of the last frame if it was waited for.
    ended: Option<Instant>,
    /// Latencies of the newest frames in milliseconds: from the end of the frame before, and from the first call.
    latencies: VecDeque<(f32, f32)>,
}

impl Pacer {
    /// A call of a frame; the first counts.
    pub fn begin(&mut self, now: Instant) {
        self.begun.get_or_insert(now);
    }

    /// A frame was submitted, whose end is known by `mark`, and the end of its drawing by `submission`; both ascend.
    pub fn submit(&mut self, mark: u64, submission: u64, now: Instant) {
        let free = self.free.unwrap_or(now);
        self.frames += 1;
        self.work
            .add(self.frames, now.saturating_duration_since(free));
        self.newest = mark;
        self.before = self.last.replace((mark, submission));
        if self.waiting.len() == WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(Frame {
            mark,
            submission,
            free,
            begun: self.begun.take().unwrap_or(free),
            submitted: now,
        });
    }

    /// Mark and submission of the frame before the newest, whether or not it has ended.
    pub fn before_newest(&self) -> Option<(u64, u64)> {
        self.before
    }

    /// The mark of the newest frame; 0 before the first.
    pub fn newest(&self) -> u64 {
        self.newest
    }

    /// The mark of the oldest frame that is not known to have ended.
    pub fn oldest(&self) -> Option<u64> {
        self.waiting.front().map(|frame| frame.mark)
    }

    /// The GPU has just finished a submission, which was waited for, and is not the end of its frame.
    pub fn draw(&mut self, submission: u64, now: Instant) {
        if let Some(frame) = self.waiting.iter().find(|f| f.submission == submission) {
            let start = (self.drawn).map_or(frame.submitted, |before| before.max(frame.submitted));
            self.gpu
                .add(self.frames, now.saturating_duration_since(start));
        }
        self.drawn = Some(now);
    }

    /// The frame of this mark, and all before it, are seen to have ended.
    pub fn end(&mut self, mark: u64, now: Instant) {
        while let Some(frame) = self.waiting.front().filter(|frame| frame.mark <= mark) {
            if self.latencies.len() == REPORTED {
                self.latencies.pop_front();
            }
            let since = |then| now.saturating_duration_since(then).as_secs_f32() * 1000.0;
            self.latencies
                .push_back((since(frame.free), since(frame.begun)));
            self.waiting.pop_front();
        }
    }

    /// The end of the frame before the newest was waited for, and is just now; `None`: it was earlier.
    pub fn waited(&mut self, now: Option<Instant>) {
        let before = std::mem::replace(&mut self.ended, now);
        if let (Some(before), Some(now)) = (before, now) {
            self.intervals
                .add(self.frames, now.saturating_duration_since(before));
        }
    }

    /// Delay of the engine after the frame before the newest has ended, so that its next frame is ready just when the
    /// newest ends: the shortest interval minus the longest CPU work and a margin. Zero if the CPU did not have to wait for
    /// that end: then it is the bottleneck. Zero too if a frame of the GPU takes longer than an interval of the display:
    /// the GPU would be idle until the display's next refresh.
    pub fn rest(&self) -> Duration {
        let least = self.intervals.until(self.frames).min();
        let greatest = self.work.until(self.frames).max();
        let (Some(_), Some(interval), Some(work)) = (self.ended, least, greatest) else {
            return Duration::ZERO;
        };
        let mut gpu = self.gpu.until(self.frames);
        if gpu.any(|gpu| gpu + MARGIN > interval) {
            return Duration::ZERO;
        }
        interval.saturating_sub(work + MARGIN)
    }

    /// The frame's end: the engine may read input.
    pub fn free(&mut self, now: Instant) {
        self.free = Some(now);
        self.begun = None;
    }

    /// Drops all awaited frames: a frame is not shown, or its end cannot be observed.
    pub fn forget(&mut self) {
        self.waiting.clear();
        (self.last, self.before) = (None, None);
        self.drawn = None;
        self.ended = None;
        self.free = None;
    }

    /// The newest frame's latency from the end of the frame before.
    pub fn newest_latency(&self) -> Option<f32> {
        self.latencies.back().map(|(free, _)| *free)
    }

    /// Latencies of the newest frames; `None` before the first.
    pub fn latency(&self, to: &'static str) -> Option<Latency> {
        let (free, begun): (Vec<f32>, Vec<f32>) = self.latencies.iter().copied().unzip();
        Some(Latency {
            to,
            frames: free.len(),
            from_end: Spread::of(&free)?,
            from_begin: Spread::of(&begun)?,
        })
    }
}

#[cfg(test)]
#[path = "pacing_tests.rs"]
mod tests;
