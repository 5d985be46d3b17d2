//! The result of a benchmark: JSON, and a line to share.

use super::Samples;
use renderer_vk::settings::{Look, Preset, ROWS, Settings};
use renderer_vk::{Costs, Spread};
use serde::{Serialize, Serializer};

/// A result. First what makes two of them comparable, then the device, then the times.
#[derive(Debug, Serialize)]
pub struct Report<'a> {
    version: &'static str,
    map: &'a str,
    route: &'a str,
    look: &'static str,
    width: u32,
    height: u32,
    /// Of the traced look.
    preset: Option<&'static str>,
    /// Those that are not at their defaults.
    #[serde(serialize_with = "as_map")]
    settings: Vec<(&'static str, String)>,
    frames: usize,
    device: &'a str,
    driver: &'a str,
    tracer: Option<&'a str>,
    gpu_ms: Option<Spread>,
    frame_ms: Option<Spread>,
    /// Median milliseconds of each pass.
    #[serde(serialize_with = "as_map")]
    passes: Vec<(&'a str, f64)>,
    /// Bytes by purpose.
    #[serde(serialize_with = "as_map")]
    memory: Vec<(&'static str, u64)>,
    #[serde(skip)]
    frames_per_second: f64,
}

fn as_map<S: Serializer, K: Serialize, V: Serialize>(
    pairs: &[(K, V)],
    to: S,
) -> Result<S::Ok, S::Error> {
    to.collect_map(pairs.iter().map(|(key, value)| (key, value)))
}

impl<'a> Report<'a> {
    /// The result of these frames: on which map, along what, with which settings.
    pub fn new(
        (map, route): (&'a str, &'a str),
        settings: &Settings,
        (driver, costs): (&'a str, &'a Costs),
        samples: &'a Samples,
    ) -> Self {
        let defaults = Settings::default();
        let changed = ROWS.iter().filter_map(|row| {
            let value = row.text(settings);
            (value != row.text(&defaults)).then_some((row.spec.name, value))
        });
        let traced = settings.rt == Look::Traced;
        let preset = Preset::current(settings).filter(|_| traced);
        let median = |(name, times): &'a (String, Vec<f32>)| {
            Some((name.as_str(), Spread::of(times)?.median))
        };
        let seconds: f64 = samples
            .frames
            .iter()
            .map(|ms| f64::from(*ms) / 1000.0)
            .sum();
        #[allow(clippy::cast_precision_loss)] // a rounded rate
        let frames_per_second = samples.frames.len() as f64 / seconds.max(1e-9);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            map,
            route,
            look: settings.rt.name(),
            width: costs.size.0,
            height: costs.size.1,
            preset: preset.map(|preset| preset.name),
            settings: changed.collect(),
            frames: samples.frames.len(),
            device: &costs.device,
            driver,
            tracer: costs.tracer.as_deref().filter(|_| traced),
            gpu_ms: Spread::of(&samples.gpu),
            frame_ms: Spread::of(&samples.frames),
            passes: samples.passes.iter().filter_map(median).collect(),
            memory: (costs.memory.iter())
                .map(|(purpose, bytes)| (purpose.name(), *bytes))
                .collect(),
            frames_per_second,
        }
    }

    /// One value per line.
    pub fn json(&self) -> String {
        // No value in a report fails to serialize.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// One line to share.
    pub fn line(&self) -> String {
        let look = match (self.look, self.preset) {
            (_, Some(preset)) => format!("preset {preset}"),
            (look, None) => format!("{look} look"),
        };
        let gpu = match &self.gpu_ms {
            Some(gpu) => format!(
                "GPU {:.2} ms median, {:.2} ms worst of 100 (p99)",
                gpu.median, gpu.p99
            ),
            None => "this device measures no GPU times".to_owned(),
        };
        format!(
            "Relight {}, {}, {}, {}x{}, {look}: {gpu}, {:.0} frames/s",
            self.version, self.device, self.map, self.width, self.height, self.frames_per_second
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use renderer_vk::MemoryPurpose;

    #[test]
    fn a_result_is_json_and_a_line() {
        let costs = Costs {
            device: "a \"device\"".into(),
            tracer: Some("Query".into()),
            size: (1920, 1080),
            memory: vec![(MemoryPurpose::Textures, 3)],
            ..Costs::default()
        };
        let samples = Samples {
            frames: vec![2.0, 3.0],
            gpu: vec![1.25, 2.5],
            passes: vec![("z".into(), vec![0.5]), ("a".into(), vec![0.25, 1.0])],
        };
        let mut settings = Settings {
            rt: Look::Traced,
            ..Settings::default()
        };
        let report = Report::new(("dm1", "path"), &settings, ("1.2", &costs), &samples);
        assert_eq!(
            report.line(),
            format!(
                "Relight {}, a \"device\", dm1, 1920x1080, preset high: GPU 1.25 ms median, 2.50 ms worst of 100 \
                 (p99), 400 frames/s",
                env!("CARGO_PKG_VERSION")
            )
        );
        let json = report.json();
        assert!(
            json.find("\"z\"") < json.find("\"a\""),
            "order of recording"
        );
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(json["settings"], serde_json::json!({ "r_rt": "1" }));
        assert_eq!(
            (&json["frames"], &json["preset"]),
            (&2.into(), &"high".into())
        );
        assert_eq!(json["gpu_ms"]["median"], 1.25);
        assert_eq!(json["frame_ms"]["worst"], 3.0);
        assert_eq!(json["passes"], serde_json::json!({ "a": 0.25, "z": 0.5 }));
        assert_eq!(json["memory"], serde_json::json!({ "textures": 3 }));
        assert_eq!(
            (&json["tracer"], &json["driver"]),
            (&"Query".into(), &"1.2".into())
        );

        // the classic look, without GPU times
        settings.rt = Look::Classic;
        let nothing = Samples::default();
        let report = Report::new(("dm1", "path"), &settings, ("1.2", &costs), &nothing);
        let json: serde_json::Value = serde_json::from_str(&report.json()).expect("JSON");
        for name in ["gpu_ms", "frame_ms", "tracer", "preset"] {
            assert!(json[name].is_null(), "{name}");
        }
        assert_eq!(json["look"], "classic");
        let line = report.line();
        assert!(
            line.contains("classic look: this device measures no GPU times"),
            "{line}"
        );
    }
}
