//! What `relight bake` does with a map: a bar while it lasts, and its seconds.

use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use relight::bake::BakeStage;

/// The stages of one map.
pub struct Times {
    begin: Instant,
    /// Names of the stages, and when they began.
    stages: Vec<(String, Instant)>,
    /// Of the stages of light.
    bar: ProgressBar,
}

impl Times {
    /// Begins a map; `alone`: no other map is baked at the same time, so that a bar can be shown.
    pub fn new(alone: bool) -> Self {
        let style = ProgressStyle::with_template("{msg:16} {bar:40} {percent} %, {eta} left");
        let bar = match (alone, style) {
            (true, Ok(style)) => ProgressBar::new(1000).with_style(style),
            _ => ProgressBar::hidden(),
        };
        Self {
            begin: Instant::now(),
            stages: Vec::new(),
            bar,
        }
    }

    /// Begins a stage.
    pub fn begin(&mut self, stage: impl Into<String>) {
        self.bar.finish_and_clear();
        self.stages.push((stage.into(), Instant::now()));
    }

    /// A stage of light has been completed in part.
    pub fn bake(&mut self, stage: BakeStage, bounces: u32, part: f32) {
        let name = match stage {
            BakeStage::Direct => "direct light".to_owned(),
            BakeStage::Bounce(number) => format!("bounce {number} of {bounces}"),
            BakeStage::Dirt => "dirt".to_owned(),
            BakeStage::Grid => "light grid".to_owned(),
        };
        if self.stages.last().is_none_or(|(last, _)| *last != name) {
            self.begin(name.clone());
            self.bar.reset();
            self.bar.set_message(name);
        }
        self.bar.set_position((part * 1000.0) as u64);
    }

    /// Seconds since the map was begun.
    pub fn seconds(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
    }

    /// Ends the last stage. Returns the seconds of all.
    pub fn end(&mut self) -> String {
        self.bar.finish_and_clear();
        let now = Instant::now();
        let starts = self.stages.iter().map(|(_, start)| *start);
        let ends = starts.skip(1).chain([now]);
        let listed: Vec<String> = (self.stages.iter().zip(ends))
            .map(|((name, start), end)| format!("{name} {:.2} s", (end - *start).as_secs_f64()))
            .collect();
        self.stages.clear();
        listed.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_listed_in_their_order_once() {
        let mut times = Times::new(false);
        times.begin("reading");
        times.bake(BakeStage::Bounce(1), 2, 0.5);
        times.bake(BakeStage::Bounce(1), 2, 1.0);
        times.begin("storing");
        let line = times.end();
        let stages: Vec<&str> = line.split(", ").collect();
        let begins = ["reading ", "bounce 1 of 2 ", "storing "];
        assert_eq!(stages.len(), begins.len(), "{line}");
        let pairs = stages.iter().zip(begins);
        assert!(
            pairs
                .into_iter()
                .all(|(stage, begin)| stage.starts_with(begin)),
            "{line}"
        );
        assert_eq!(times.end(), "");
    }
}
