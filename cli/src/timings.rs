//! Cost of frames: `relight render --timings`.

use renderer_vk::{Costs, FrameStats};
use serde_json::{Map, Value, json};

/// Times of many frames, milliseconds.
#[derive(Default)]
pub struct Timings {
    /// Name, sum and number of frames of each GPU pass, in order of recording.
    passes: Vec<(String, f32, u32)>,
    gpu: Vec<f32>,
    cpu: Vec<f32>,
    gather: Vec<f32>,
    record: Vec<f32>,
    submit: Vec<f32>,
    draws: u32,
}

impl Timings {
    /// Adds a frame: the passes of the newest frame that the GPU finished, and the CPU time of this one.
    pub fn add(&mut self, passes: &[(String, f32)], stats: &FrameStats) {
        for pass in Costs::passes(passes, |_| None) {
            match self.passes.iter_mut().find(|(n, ..)| *n == pass.name) {
                Some((_, sum, count)) => (*sum, *count) = (*sum + pass.ms, *count + 1),
                None => self.passes.push((pass.name, pass.ms, 1)),
            }
        }
        if !passes.is_empty() {
            self.gpu.push(passes.iter().map(|(_, ms)| ms).sum());
        }
        let cpu = &stats.cpu;
        // without the wait for the GPU
        self.cpu.push(cpu.gather + cpu.record + cpu.submit);
        self.gather.push(cpu.gather);
        self.record.push(cpu.record);
        self.submit.push(cpu.submit);
        self.draws = self.draws.max(stats.draws);
    }

    /// `ms`: mean of each pass over the frames that run it; `gpu_ms` and `cpu_ms`: median and maximum of the frames'
    /// sums, for the CPU with the medians of its parts; `draws`: largest number of draw calls in a frame.
    pub fn report(&self) -> Map<String, Value> {
        let passes: Map<_, _> = self
            .passes
            .iter()
            .map(|(name, sum, count)| (name.clone(), json!(sum / *count as f32)))
            .collect();
        let mut report = Map::new();
        report.insert("ms".into(), Value::Object(passes));
        report.insert(
            "gpu_ms".into(),
            json!({ "median": median(&self.gpu), "worst": worst(&self.gpu) }),
        );
        report.insert(
            "cpu_ms".into(),
            json!({
                "median": median(&self.cpu), "worst": worst(&self.cpu), "gather": median(&self.gather),
                "record": median(&self.record), "submit": median(&self.submit),
            }),
        );
        report.insert("draws".into(), json!(self.draws));
        report
    }
}

/// The median; 0 for no values.
fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

fn worst(values: &[f32]) -> f32 {
    values.iter().copied().fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_has_means_medians_and_the_worst() {
        let mut timings = Timings::default();
        for ms in [1.0, 2.0, 9.0] {
            let mut stats = FrameStats::default();
            stats.cpu.record = ms;
            stats.cpu.wait = 100.0;
            let passes = [("a".into(), ms), ("b".into(), 0.5), ("b".into(), 0.5)];
            timings.add(&passes, &stats);
        }
        let report = Value::Object(timings.report());
        assert_eq!(report["ms"]["a"], json!(4.0));
        assert_eq!(report["ms"]["b"], json!(1.0), "runs of one frame add up");
        assert_eq!(report["gpu_ms"]["median"], json!(3.0));
        assert_eq!(report["cpu_ms"]["worst"], json!(9.0));
        assert_eq!(report["cpu_ms"]["median"], json!(2.0));
    }
}
