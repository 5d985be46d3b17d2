//! `rt_preset`: presets of settings, by name or by what the device can do.

use renderer_vk::Settings;
use renderer_vk::settings::{PRESETS, Preset};
use std::time::{Duration, Instant};

/// A preset is measured for this long.
const MEASURED: Duration = Duration::from_secs(1);
/// After a change, frames that are not measured: pipelines are compiled, and GPU times arrive late.
const SETTLING: u32 = 10;
/// A measurement ends after this time, even with few frames.
const PATIENCE: Duration = Duration::from_secs(4);
/// The GPU may take this part of the time between two pictures of the display: the game needs the rest.
const SHARE: f32 = 0.8;

/// `rt_preset auto`: measures presets, from an expensive one to cheaper ones, and ends with the first that is fast
/// enough.
#[derive(Debug)]
pub struct Trial {
    /// The presets that may be taken, from the cheapest to the most expensive; the last is being measured.
    left: Vec<&'static Preset>,
    /// The longest time of a frame, milliseconds.
    wanted: f32,
    /// Frames since the preset was set.
    frames: u32,
    begun: Instant,
    measured: Option<Instant>,
    times: Vec<f32>,
}

/// What becomes of a trial after a frame.
#[derive(Debug)]
pub enum Step {
    /// The measurement goes on.
    Measures,
    /// The preset is too slow, with this median; the next one is to be set.
    Try(&'static Preset, f32),
    /// The preset to keep, which is set, and its median if it was measured.
    Ends(&'static Preset, Option<f32>),
}

impl Trial {
    /// A trial for a display of so many pictures a second (0: unknown), and the preset to begin with. A device that
    /// draws in software gets the cheapest one without a trial.
    pub fn new(refresh_rate: i32, software: bool, now: Instant) -> (Option<Self>, &'static Preset) {
        let playable = PRESETS
            .split_last()
            .map_or(PRESETS, |(_, playable)| playable);
        let mut left: Vec<&'static Preset> = playable.iter().collect();
        if software {
            left.truncate(1);
        }
        let first = left.last().copied().unwrap_or(&PRESETS[0]);
        if left.len() == 1 {
            return (None, first);
        }
        // Faster displays are fed less often rather than with a worse picture.
        let rate = match u16::try_from(refresh_rate) {
            Ok(0) | Err(_) => 60.0,
            Ok(rate) => f32::from(rate).clamp(30.0, 120.0),
        };
        let trial = Self {
            left,
            wanted: SHARE * 1000.0 / rate,
            frames: 0,
            begun: now,
            measured: None,
            times: Vec::new(),
        };
        (Some(trial), first)
    }

    /// Ends a frame, whose GPU time is known if it showed the traced map.
    pub fn frame(&mut self, now: Instant, ms: Option<f32>) -> Step {
        self.frames += 1;
        let patient = now.duration_since(self.begun) < PATIENCE;
        if self.frames <= SETTLING && patient {
            return Step::Measures;
        }
        let since = *self.measured.get_or_insert(now);
        self.times.extend(ms);
        if (now.duration_since(since) < MEASURED && patient) || self.times.is_empty() {
            return Step::Measures;
        }
        self.times.sort_by(f32::total_cmp);
        let median = self.times[self.times.len() / 2];
        let Some(tried) = self.left.last().copied() else {
            return Step::Measures;
        };
        if median <= self.wanted {
            return Step::Ends(tried, Some(median));
        }
        self.left.pop();
        match self.left[..] {
            // There is nothing cheaper, so it need not be measured.
            [cheapest] => Step::Ends(cheapest, None),
            [.., next] => {
                (self.frames, self.begun, self.measured) = (0, now, None);
                self.times.clear();
                Step::Try(next, median)
            }
            [] => Step::Ends(tried, Some(median)),
        }
    }
}

/// Lines of `rt_preset` without a name: the presets, what they set, and which one is in use.
pub fn lines(settings: &Settings) -> Vec<String> {
    let current = Preset::current(settings).map(|preset| preset.name);
    let mut lines: Vec<String> = PRESETS
        .iter()
        .flat_map(|preset| {
            let values: Vec<String> = preset.values().map(|(n, v)| format!("{n} {v}")).collect();
            let mark = if current == Some(preset.name) {
                '*'
            } else {
                ' '
            };
            [
                format!("{mark} {:9} {}", preset.name, preset.help),
                format!("            {}", values.join(", ")),
            ]
        })
        .collect();
    lines.push(
        "usage: rt_preset NAME, or rt_preset auto, which measures what this device can do"
            .to_owned(),
    );
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays a trial of a device that takes `cost` milliseconds for each preset; the preset in the end.
    fn ends_with(cost: impl Fn(&str) -> f32, rate: i32) -> (&'static str, f32) {
        let start = Instant::now();
        let (trial, mut tried) = Trial::new(rate, false, start);
        let mut trial = trial.expect("a trial");
        let mut seconds = 0.0;
        for _ in 0..10_000 {
            let ms = cost(tried.name);
            seconds += (ms / 1000.0).max(0.004);
            match trial.frame(start + Duration::from_secs_f32(seconds), Some(ms)) {
                Step::Measures => {}
                Step::Try(preset, _) => tried = preset,
                Step::Ends(preset, _) => return (preset.name, seconds),
            }
        }
        panic!("it never ends");
    }

    #[test]
    fn the_best_preset_that_is_fast_enough_is_kept() {
        let (name, seconds) = ends_with(|_| 3.0, 60);
        assert_eq!(name, "high");
        assert!(seconds < 1.5, "{seconds} s");
        let by_cost = |name: &str| if name == "high" { 20.0 } else { 9.0 };
        assert_eq!(ends_with(by_cost, 0).0, "medium");
        // 120 pictures a second leave 6.7 ms
        assert_eq!(ends_with(by_cost, 144).0, "low");
        let (name, seconds) = ends_with(|_| 900.0, 60);
        assert_eq!(name, "low");
        assert!(seconds < 12.0, "{seconds} s");
    }

    #[test]
    fn frames_without_the_traced_map_are_not_measured() {
        let start = Instant::now();
        let (trial, _) = Trial::new(60, false, start);
        let mut trial = trial.expect("a trial");
        for frame in 0..2000 {
            let step = trial.frame(start + Duration::from_millis(10 * frame), None);
            assert!(matches!(step, Step::Measures));
        }
    }

    #[test]
    fn a_software_device_gets_the_cheapest_preset_at_once() {
        let (trial, preset) = Trial::new(60, true, Instant::now());
        assert!(trial.is_none());
        assert_eq!(preset.name, "low");
    }
}
