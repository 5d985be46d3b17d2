//! Cost of frames: `relight render --timings` and `--frame-times`.

use std::fmt::Write as _;

use renderer_vk::{Costs, CpuTimes, FRAMES_IN_FLIGHT, FrameStats, PassCost, Renderer, Spread};
use serde_json::{Map, Value, json};

/// First frames, whose times are stated apart: caches, clocks and histories are not yet as in later frames. At most
/// half of a run.
const COLD: usize = 10;

/// Number of frames in the list of the slowest.
const SLOWEST: usize = 5;

/// A frame.
struct Frame {
    serial: u64,
    cpu: CpuTimes,
    draws: u32,
    /// Pipelines compiled since the frame before.
    pipelines: u64,
    /// Costs of its passes on the GPU; `None` until they are known.
    passes: Option<Vec<PassCost>>,
}

impl Frame {
    /// Milliseconds on the GPU.
    fn gpu(&self) -> Option<f32> {
        Some(self.passes.as_ref()?.iter().map(|pass| pass.ms).sum())
    }

    /// Milliseconds of the CPU, without the wait for the GPU.
    fn cpu(&self) -> f32 {
        self.cpu.gather + self.cpu.record + self.cpu.submit
    }

    /// Milliseconds of a pass on the GPU, if the frame ran it.
    fn pass(&self, name: &str) -> Option<f32> {
        let passes = self.passes.iter().flatten();
        passes.filter(|p| p.name == name).map(|p| p.ms).next()
    }
}

/// A frame that took long, and the pass that was farthest above its median.
struct Slow<'a> {
    frame: usize,
    gpu: f32,
    pass: &'a str,
    ms: f32,
    median: f64,
    pipelines: u64,
}

/// Times of many frames, milliseconds.
#[derive(Default)]
pub struct Timings {
    frames: Vec<Frame>,
    /// Pipelines compiled before the next frame.
    compiled: u64,
}

impl Timings {
    /// Of the frames that the renderer will draw.
    pub fn new(renderer: &Renderer) -> Self {
        // a software device times passes from the first call on
        renderer.timings();
        Self {
            compiled: renderer.compiled_pipelines(),
            ..Self::default()
        }
    }

    /// Adds the frame that was drawn last. Its GPU times are known some frames later.
    pub fn add(&mut self, renderer: &Renderer, stats: &FrameStats) {
        self.begin(stats, renderer.compiled_pipelines());
        self.know(renderer.timed_frame(), &renderer.timings());
    }

    /// Waits for the GPU times of the last frames. Needed before a picture is read, which waits for them unseen.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn finish(&mut self, renderer: &mut Renderer) -> Result<(), renderer_vk::Error> {
        for _ in 0..FRAMES_IN_FLIGHT {
            renderer.wait_for_oldest()?;
            self.know(renderer.timed_frame(), &renderer.timings());
        }
        Ok(())
    }

    fn begin(&mut self, stats: &FrameStats, compiled: u64) {
        self.frames.push(Frame {
            serial: stats.serial,
            cpu: stats.cpu,
            draws: stats.draws,
            pipelines: compiled - std::mem::replace(&mut self.compiled, compiled),
            passes: None,
        });
    }

    fn know(&mut self, serial: u64, passes: &[(String, f32)]) {
        let mut late = self.frames.iter_mut().rev();
        if let Some(frame) = late.find(|frame| frame.serial == serial) {
            frame.passes = Some(Costs::passes(passes, |_| None));
        }
    }

    /// The first frames, and the others.
    fn parts(&self) -> (&[Frame], &[Frame]) {
        self.frames.split_at(COLD.min(self.frames.len() / 2))
    }

    /// Distribution of GPU times without the first frames; `None` if the device measures none.
    pub fn gpu(&self) -> Option<Spread> {
        let (_, warm) = self.parts();
        Spread::of(&warm.iter().filter_map(Frame::gpu).collect::<Vec<_>>())
    }

    /// Distribution of CPU times without the first frames; `None` without a frame.
    pub fn cpu(&self) -> Option<Spread> {
        self.cpu_part(Frame::cpu)
    }

    /// The same of a part.
    fn cpu_part(&self, part: impl Fn(&Frame) -> f32) -> Option<Spread> {
        let (_, warm) = self.parts();
        Spread::of(&warm.iter().map(part).collect::<Vec<_>>())
    }

    /// Names of the passes, in order of the first recording.
    fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for pass in self.frames.iter().flat_map(|f| f.passes.iter().flatten()) {
            if !names.contains(&pass.name.as_str()) {
                names.push(&pass.name);
            }
        }
        names
    }

    /// GPU times of each pass in the frames that ran it, without the first frames.
    pub fn passes(&self) -> Vec<(&str, Vec<f32>)> {
        let (_, warm) = self.parts();
        let times = |name| warm.iter().filter_map(|f| f.pass(name)).collect();
        let all = self.names().into_iter().map(|name| (name, times(name)));
        all.filter(|(_, times): &(_, Vec<f32>)| !times.is_empty())
            .collect()
    }

    /// The slowest frames, the slowest first, without the first frames.
    fn slowest(&self) -> Vec<Slow<'_>> {
        let medians: Vec<(&str, f64)> = (self.passes().into_iter())
            .filter_map(|(name, times)| Some((name, Spread::of(&times)?.median)))
            .collect();
        let (cold, warm) = self.parts();
        let mut slow: Vec<Slow<'_>> = (warm.iter().enumerate())
            .filter_map(|(at, frame)| {
                let over = |(name, median): &(&str, f64)| {
                    f64::from(frame.pass(name).unwrap_or_default()) - median
                };
                let most = medians.iter().max_by(|a, b| over(a).total_cmp(&over(b)));
                let (pass, median) = *most?;
                Some(Slow {
                    frame: cold.len() + at,
                    gpu: frame.gpu()?,
                    pass,
                    ms: frame.pass(pass).unwrap_or_default(),
                    median,
                    pipelines: frame.pipelines,
                })
            })
            .collect();
        slow.sort_by(|a, b| b.gpu.total_cmp(&a.gpu));
        slow.truncate(SLOWEST);
        slow
    }

    /// `ms`: mean of each pass over the frames that run it; `gpu_ms` and `cpu_ms`: distribution of the frames' sums,
    /// for the CPU with the medians of its parts; `draws`: largest number of draw calls in a frame. All without the
    /// first frames, whose times are in `cold`. `slowest`: the slowest of the others, each with the pass that is
    /// farthest above its median.
    pub fn report(&self) -> Map<String, Value> {
        let mean = |times: &[f32]| times.iter().sum::<f32>() / times.len() as f32;
        let passes: Map<_, _> = (self.passes().into_iter())
            .map(|(name, times)| (name.to_owned(), json!(mean(&times))))
            .collect();
        let mut cpu = json!(self.cpu());
        if let Some(cpu) = cpu.as_object_mut() {
            let median = |part: fn(&Frame) -> f32| json!(self.cpu_part(part).map(|s| s.median));
            cpu.insert("gather".into(), median(|frame| frame.cpu.gather));
            cpu.insert("record".into(), median(|frame| frame.cpu.record));
            cpu.insert("submit".into(), median(|frame| frame.cpu.submit));
        }
        let (cold, _) = self.parts();
        let slowest: Vec<Value> = (self.slowest().iter())
            .map(|slow| {
                json!({
                    "frame": slow.frame, "gpu_ms": slow.gpu, "pass": slow.pass, "pass_ms": slow.ms,
                    "pass_median": slow.median, "pipelines": slow.pipelines,
                })
            })
            .collect();
        let mut report = Map::new();
        report.insert("ms".into(), Value::Object(passes));
        report.insert("gpu_ms".into(), json!(self.gpu()));
        report.insert("cpu_ms".into(), cpu);
        report.insert(
            "cold".into(),
            json!({
                "frames": cold.len(),
                "gpu_ms": cold.iter().map(Frame::gpu).collect::<Vec<_>>(),
                "cpu_ms": cold.iter().map(Frame::cpu).collect::<Vec<_>>(),
                "pipelines": cold.iter().map(|frame| frame.pipelines).sum::<u64>(),
            }),
        );
        report.insert("slowest".into(), json!(slowest));
        let draws = self.frames.iter().map(|frame| frame.draws).max();
        report.insert("draws".into(), json!(draws.unwrap_or_default()));
        report
    }

    /// The same for people.
    pub fn lines(&self) -> Vec<String> {
        let (cold, warm) = self.parts();
        let mut lines = Vec::new();
        for (name, spread) in [("GPU", self.gpu()), ("CPU", self.cpu())] {
            lines.push(match spread {
                Some(s) => format!(
                    "{name} {:.3} ms median, {:.3} p95, {:.3} p99, {:.3} worst of {} frames after the first {}",
                    s.median,
                    s.p95,
                    s.p99,
                    s.worst,
                    warm.len(),
                    cold.len()
                ),
                None => format!("{name}: no times"),
            });
        }
        let compiled: u64 = cold.iter().map(|frame| frame.pipelines).sum();
        let mut first = format!(
            "first {} frames, {compiled} pipelines compiled, GPU ms:",
            cold.len()
        );
        for frame in cold {
            let _ = match frame.gpu() {
                Some(ms) => write!(first, " {ms:.3}"),
                None => write!(first, " -"),
            };
        }
        lines.push(first);
        lines.extend(self.slowest().iter().map(|slow| {
            format!(
                "slow frame {}: {:.3} ms; {} {:.3} ms, {:.3} at its median; {} pipelines compiled",
                slow.frame, slow.gpu, slow.pass, slow.ms, slow.median, slow.pipelines
            )
        }));
        lines
    }

    /// Every frame as CSV; what is unknown is empty.
    pub fn csv(&self) -> String {
        let names = self.names();
        let mut csv =
            "frame,cold,gpu_ms,cpu_ms,gather_ms,wait_ms,record_ms,submit_ms,pipelines,draws"
                .to_owned();
        for name in &names {
            csv.push(',');
            csv.push_str(name);
        }
        csv.push('\n');
        let (cold, _) = self.parts();
        let known = |ms: Option<f32>| ms.map_or_else(String::new, |ms| format!("{ms:.4}"));
        for (number, frame) in self.frames.iter().enumerate() {
            let CpuTimes {
                gather,
                wait,
                record,
                submit,
            } = frame.cpu;
            let _ = write!(
                csv,
                "{number},{},{},{:.4},{gather:.4},{wait:.4},{record:.4},{submit:.4},{},{}",
                u8::from(number < cold.len()),
                known(frame.gpu()),
                frame.cpu(),
                frame.pipelines,
                frame.draws,
            );
            for name in &names {
                csv.push(',');
                csv.push_str(&known(frame.pass(name)));
            }
            csv.push('\n');
        }
        csv
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of these GPU times in pass `a`, each known when the one after the next is drawn.
    fn timings(times: &[f32]) -> Timings {
        let mut timings = Timings::default();
        let passes = |ms| [("a".into(), ms), ("b".into(), 0.5), ("b".into(), 0.5)];
        for (number, ms) in times.iter().enumerate() {
            let mut stats = FrameStats {
                serial: number as u64 + 5,
                ..FrameStats::default()
            };
            stats.cpu.record = *ms;
            stats.cpu.wait = 100.0;
            timings.begin(&stats, 1);
            // frames of loading come before
            timings.know(
                number as u64 + 3,
                &passes(*times.get(number.wrapping_sub(2)).unwrap_or(&1e9)),
            );
        }
        for late in [2, 1] {
            let number = times.len() - late;
            timings.know(number as u64 + 5, &passes(times[number]));
        }
        timings
    }

    #[test]
    fn a_report_states_the_first_frames_apart() {
        let mut times = vec![50.0; 10];
        times.extend([1.0, 1.0, 1.0, 2.0, 9.0, 1.0, 1.0, 1.0, 1.0, 2.0]);
        let timings = timings(&times);
        let report = Value::Object(timings.report());
        assert_eq!(report["ms"]["a"], json!(2.0));
        assert_eq!(report["ms"]["b"], json!(1.0), "runs of one frame add up");
        assert_eq!(report["gpu_ms"]["median"], json!(2.0));
        assert_eq!(report["gpu_ms"]["p95"], json!(10.0));
        assert_eq!(report["gpu_ms"]["worst"], json!(10.0));
        assert_eq!(report["cpu_ms"]["worst"], json!(9.0), "without the wait");
        assert_eq!(report["cpu_ms"]["record"], json!(1.0));
        assert_eq!(report["cold"]["frames"], json!(10));
        assert_eq!(report["cold"]["gpu_ms"][9], json!(51.0));
        assert_eq!(report["cold"]["pipelines"], json!(1));
        let slow = &report["slowest"][0];
        assert_eq!((&slow["frame"], &slow["pass"]), (&json!(14), &json!("a")));
        assert_eq!(
            (&slow["pass_ms"], &slow["pass_median"]),
            (&json!(9.0), &json!(1.0))
        );
        assert_eq!(report["slowest"].as_array().map(Vec::len), Some(SLOWEST));
        let lines = timings.lines().join("\n");
        assert!(
            lines.contains("10.000 worst of 10 frames after the first 10"),
            "{lines}"
        );
    }

    #[test]
    fn every_frame_is_a_line() {
        let timings = timings(&[3.0, 4.0, 5.0]);
        let csv = timings.csv();
        let rows: Vec<Vec<&str>> = csv.lines().map(|row| row.split(',').collect()).collect();
        assert_eq!(rows.len(), 4);
        assert!(rows.iter().all(|row| row.len() == 12), "{csv}");
        assert_eq!(rows[0][10..], ["a", "b"]);
        assert_eq!(rows[1][..4], ["0", "1", "4.0000", "3.0000"]);
        assert_eq!(rows[3][..4], ["2", "0", "6.0000", "5.0000"]);
        assert_eq!((rows[1][8], rows[2][8]), ("1", "0"));
    }

    #[test]
    fn no_frames_and_no_times_are_no_figures() {
        let mut timings = Timings::default();
        assert!(timings.report()["gpu_ms"].is_null());
        timings.begin(&FrameStats::default(), 0);
        assert!(timings.report()["gpu_ms"].is_null() && timings.lines()[0].contains("no times"));
        assert_eq!(timings.csv().lines().count(), 2);
    }
}
