//! `rt_stats` and `rt_printPerfStats`: costs of frames.
//!
//! Rays are counted only on request, and the GPU finishes a few frames later; `rt_stats` therefore prints a few frames
//! after the command.

use renderer_vk::{Renderer, Settings};
use std::time::{Duration, Instant};

/// Output format of `rt_stats`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Report {
    /// Lines for people.
    Lines,
    /// JSON in the console.
    Json,
    /// JSON in a file in the user's game folder.
    File(String),
}

impl Report {
    /// From the arguments of `rt_stats`: none, `json`, or `json NAME`. `None`: anything else.
    pub fn of(arguments: &[String]) -> Option<Self> {
        match arguments {
            [] => Some(Self::Lines),
            [json] if json.eq_ignore_ascii_case("json") => Some(Self::Json),
            [json, name] if json.eq_ignore_ascii_case("json") => {
                let name = name.strip_suffix(".json").unwrap_or(name);
                Some(Self::File(format!("{name}.json")))
            }
            _ => None,
        }
    }
}

/// Frames from request to report: one begins with counters, and is finished when two more have begun.
const FRAMES: u32 = 4;

/// Time between the lines of `rt_printPerfStats`.
const INTERVAL: Duration = Duration::from_secs(1);

/// Requests for reports.
#[derive(Debug, Default)]
pub struct Questions {
    asked: Vec<(Report, u32)>,
    printed: Option<Instant>,
    /// Frames since `printed`.
    frames: u32,
}

/// Reports of a frame.
#[derive(Debug, Default)]
pub struct Answers {
    /// Lines for the console.
    pub lines: Vec<String>,
    /// Files to write.
    pub files: Vec<(String, Vec<u8>)>,
}

impl Questions {
    /// Adds a request.
    pub fn ask(&mut self, report: Report) {
        self.asked.push((report, FRAMES));
    }

    /// Ends a frame at the time `now`; returns the reports that are due.
    pub fn answer(
        &mut self,
        renderer: &mut Renderer,
        settings: &Settings,
        now: Instant,
    ) -> Answers {
        let mut answers = Answers::default();
        let prints = settings.rt_print_perf_stats;
        if !prints {
            self.printed = None;
        }
        if !prints && self.asked.is_empty() {
            return answers;
        }
        let mut due = Vec::new();
        self.asked.retain_mut(|(report, left)| {
            *left -= 1;
            if *left == 0 {
                due.push(report.clone());
            }
            *left > 0
        });
        if !due.is_empty() {
            let costs = renderer.costs();
            for report in due {
                match report {
                    Report::Lines => answers.lines.extend(costs.lines()),
                    Report::Json => answers
                        .lines
                        .extend(costs.json().lines().map(str::to_owned)),
                    Report::File(path) => answers.files.push((path, costs.json().into_bytes())),
                }
            }
        }
        if prints && let Some(fps) = self.frame_rate(now) {
            let summary = renderer.costs().summary();
            answers.lines.push(format!("{fps:.0} frames/s; {summary}"));
        }
        // the first call enables timing of passes
        renderer.timings();
        renderer.count_rays(prints || !self.asked.is_empty());
        answers
    }

    /// Frames per second, once per interval.
    fn frame_rate(&mut self, now: Instant) -> Option<f32> {
        self.frames += 1;
        let Some(printed) = self.printed else {
            (self.printed, self.frames) = (Some(now), 0);
            return None;
        };
        let passed = now.duration_since(printed);
        if passed < INTERVAL {
            return None;
        }
        #[allow(clippy::cast_precision_loss)] // frames of one second
        let rate = std::mem::take(&mut self.frames) as f32 / passed.as_secs_f32();
        self.printed = Some(now);
        Some(rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_choose_the_report() {
        let of = |arguments: &[&str]| {
            let arguments: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
            Report::of(&arguments)
        };
        assert_eq!(of(&[]), Some(Report::Lines));
        assert_eq!(of(&["JSON"]), Some(Report::Json));
        let file = Some(Report::File("a/b.json".into()));
        assert_eq!(of(&["json", "a/b"]), file);
        assert_eq!(of(&["json", "a/b.json"]), file);
        assert_eq!(of(&["xml"]), None);
        assert_eq!(of(&["json", "a", "b"]), None);
    }

    #[test]
    fn the_rate_is_reported_once_a_second() {
        let mut questions = Questions::default();
        let start = Instant::now();
        let at =
            |questions: &mut Questions, ms| questions.frame_rate(start + Duration::from_millis(ms));
        assert_eq!(at(&mut questions, 0), None);
        for frame in 1..10 {
            assert_eq!(at(&mut questions, frame * 100), None);
        }
        assert_eq!(at(&mut questions, 1000), Some(10.0));
        assert_eq!(at(&mut questions, 1500), None);
        assert_eq!(at(&mut questions, 2000), Some(2.0));
    }

    #[test]
    fn each_second_has_a_line_with_its_mean_rate() {
        let mut questions = Questions::default();
        let start = Instant::now();
        let rates: Vec<f32> = (0..=250)
            .filter_map(|frame| questions.frame_rate(start + Duration::from_millis(10 * frame)))
            .collect();
        assert_eq!(rates.len(), 2, "{rates:?}");
        assert!(rates.iter().all(|r| (r - 100.0).abs() < 0.1), "{rates:?}");
    }
}
