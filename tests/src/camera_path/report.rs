//! What the frames of a path cost, as JSON.

use std::time::Duration;

use serde_json::{Map, Value, json};

use super::Play;
use crate::engine::Message;

/// A pass of the GPU over all frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassReport {
    /// Name.
    pub name: String,
    /// Milliseconds, a value for each frame that had it.
    pub ms: Vec<f64>,
    /// Rays, a value for each frame in which they were counted.
    pub rays: Vec<f64>,
}

/// All figures of a path.
#[derive(Clone, Debug, Default)]
pub struct Report {
    about: Map<String, Value>,
    passes: Vec<PassReport>,
    /// All passes of each frame, milliseconds.
    gpu: Vec<f64>,
    /// Milliseconds from `BeginFrame` to `EndFrame`'s return.
    wall: Vec<f64>,
    /// Seconds for all frames.
    duration: f64,
    device: Value,
    tracer: Value,
    memory: Value,
}

impl Report {
    pub(super) fn new(play: &Play) -> Self {
        let mut about = Map::new();
        about.insert("map".into(), json!(play.map));
        about.insert("width".into(), json!(play.size[0]));
        about.insert("height".into(), json!(play.size[1]));
        let look = if play.traced { "traced" } else { "classic" };
        about.insert("look".into(), json!(look));
        about.insert("window".into(), json!(play.window));
        for (name, value) in &play.cvars {
            about.insert(name.clone(), json!(value));
        }
        Self {
            about,
            ..Self::default()
        }
    }

    pub(super) fn add_frame(&mut self, wall: Duration) {
        self.wall.push(wall.as_secs_f64() * 1000.0);
    }

    pub(super) fn set_duration(&mut self, duration: Duration) {
        self.duration = duration.as_secs_f64();
    }

    fn pass(&mut self, name: &str) -> &mut PassReport {
        let at = self.passes.iter().position(|p| p.name == name);
        let at = at.unwrap_or_else(|| {
            self.passes.push(PassReport {
                name: name.to_string(),
                ..PassReport::default()
            });
            self.passes.len() - 1
        });
        &mut self.passes[at]
    }

    /// Takes the lines that `rt_timings` printed: `TIME ms  NAME`. A pass that a frame has twice counts as one.
    pub(super) fn add_times(&mut self, messages: &[Message]) {
        let text: String = messages.iter().map(|m| m.text.as_str()).collect();
        let mut frame: Vec<(&str, f64)> = Vec::new();
        for line in text.lines() {
            let Some((ms, name)) = line.split_once(" ms  ") else {
                continue;
            };
            let Ok(ms) = ms.trim().parse::<f64>() else {
                continue;
            };
            match frame.iter_mut().find(|(n, _)| *n == name) {
                Some((_, sum)) => *sum += ms,
                None => frame.push((name, ms)),
            }
        }
        for (name, ms) in frame {
            if name == "all passes" {
                self.gpu.push(ms);
            } else {
                self.pass(name).ms.push(ms);
            }
        }
    }

    /// Takes a report of `rt_stats`. `None`: it is none.
    pub(super) fn add_stats(&mut self, json: &[u8]) -> Option<()> {
        let stats: Value = serde_json::from_slice(json).ok()?;
        self.device = stats.get("device")?.clone();
        self.tracer = stats.get("tracer")?.clone();
        self.memory = stats.get("memory")?.clone();
        for pass in stats.get("passes")?.as_array()? {
            let name = pass.get("name")?.as_str()?.to_string();
            if let Some(rays) = pass.get("rays")?.as_f64() {
                self.pass(&name).rays.push(rays);
            }
        }
        Some(())
    }

    /// All passes, in the order of recording.
    pub fn passes(&self) -> &[PassReport] {
        &self.passes
    }

    /// Median of the frames' sums over all passes, milliseconds; 0 if the device has no timestamps.
    pub fn gpu_ms(&self) -> f64 {
        median(&self.gpu)
    }

    /// `passes`: of each its mean, median and worst time over the frames that had it, the mean of its rays and
    /// millions of rays a second (by the times taken while rays were not counted); `gpu_ms`: sums of a frame;
    /// `frame_ms`: from `BeginFrame` to the return of `EndFrame`, which waits while the GPU is two frames behind;
    /// `rays`: of all passes, `null` where none was counted; `frames_per_second`: over the whole path; `memory`: bytes by purpose.
    pub fn json(&self) -> Value {
        let passes: Vec<Value> = self.passes.iter().map(pass_json).collect();
        let counted = self.passes.iter().filter(|pass| !pass.rays.is_empty());
        let rays: Option<f64> = counted.map(|pass| mean(&pass.rays)).reduce(|a, b| a + b);
        let mut report = self.about.clone();
        report.insert("device".into(), self.device.clone());
        report.insert("tracer".into(), self.tracer.clone());
        report.insert("frames".into(), json!(self.wall.len()));
        report.insert("passes".into(), Value::Array(passes));
        report.insert("rays".into(), json!(rays.map(f64::round)));
        report.insert("gpu_ms".into(), times(&self.gpu));
        report.insert("frame_ms".into(), times(&self.wall));
        #[allow(clippy::cast_precision_loss)] // a count of frames
        let rate = self.wall.len() as f64 / self.duration.max(f64::MIN_POSITIVE);
        report.insert("frames_per_second".into(), json!(round(rate)));
        report.insert("memory".into(), self.memory.clone());
        Value::Object(report)
    }
}

fn pass_json(pass: &PassReport) -> Value {
    let mut json = times(&pass.ms);
    json["name"] = json!(pass.name);
    if !pass.rays.is_empty() {
        let (rays, ms) = (mean(&pass.rays), mean(&pass.ms));
        json["rays"] = json!(rays.round());
        if ms > 0.0 {
            json["mrays_per_second"] = json!(round(rays / (ms * 1000.0)));
        }
    }
    json
}

fn times(ms: &[f64]) -> Value {
    let worst = ms.iter().copied().fold(0.0, f64::max);
    json!({ "mean": round(mean(ms)), "median": round(median(ms)), "worst": round(worst) })
}

/// To a thousandth.
fn round(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

/// 0 of nothing.
fn mean(values: &[f64]) -> f64 {
    #[allow(clippy::cast_precision_loss)] // a count of frames
    let count = values.len().max(1) as f64;
    values.iter().sum::<f64>() / count
}

/// The value in the middle; 0 of nothing.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_reports_become_means() {
        let mut report = Report::default();
        for ms in ["   1.000", "   3.000"] {
            let text =
                format!("{ms} ms  a\n   0.500 ms  a\n   0.250 ms  b b\n   4.000 ms  all passes\n");
            let (first, second) = text.split_at(20);
            let messages = [first, second].map(|text| Message {
                level: 0,
                text: text.to_string(),
            });
            report.add_times(&messages);
        }
        let stats = br#"{"device": "d", "tracer": null, "memory": {"x": 5},
            "passes": [{"name": "a", "ms": 9.0, "rays": 5000}, {"name": "b b", "ms": 1.0, "rays": null}]}"#;
        report.add_stats(stats).unwrap();
        assert_eq!(report.add_stats(b"{}"), None);
        let json = report.json();
        assert_eq!(json["passes"][0]["mean"], json!(2.5));
        assert_eq!(json["passes"][0]["rays"], json!(5000.0));
        assert_eq!(json["passes"][0]["mrays_per_second"], json!(2.0));
        assert_eq!(json["passes"][1]["name"], json!("b b"));
        assert_eq!(json["gpu_ms"]["worst"], json!(4.0));
        assert_eq!(json["memory"]["x"], json!(5));
    }
}
