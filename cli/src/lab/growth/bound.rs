//! Costs over sizes, and what bounds them.

use std::fmt::Write as _;

use anyhow::Result;
use renderer_vk::{Costs, Spread};
use serde::Serialize;

use super::fit::PowerLaw;
use crate::timings::Timings;

/// Bytes in a megabyte of reports.
const MEGABYTE: f64 = (1u32 << 20) as f64;

/// A part of a cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    pub name: String,
    pub cost: f64,
}

impl Part {
    fn new(name: &str, cost: f64) -> Self {
        let name = name.to_owned();
        Self { name, cost }
    }
}

/// Costs of a size.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub size: f64,
    /// `None` if the device measures no times.
    pub gpu_ms: Option<Spread>,
    pub cpu_ms: Option<Spread>,
    /// Medians of the passes, milliseconds.
    pub passes: Vec<Part>,
    /// By purpose.
    pub megabytes: Vec<Part>,
}

impl Row {
    pub fn new(size: f64, timings: &Timings, costs: &Costs) -> Self {
        let passes = timings.passes().into_iter();
        #[allow(clippy::cast_precision_loss)] // a rounded value for reports
        let megabytes = |bytes: u64| (bytes as f64 / MEGABYTE * 1e3).round() / 1e3;
        Self {
            size,
            gpu_ms: timings.gpu(),
            cpu_ms: timings.cpu(),
            passes: passes
                .filter_map(|(name, times)| Some(Part::new(name, Spread::of(&times)?.median)))
                .collect(),
            megabytes: (costs.memory.iter())
                .map(|(purpose, bytes)| Part::new(purpose.name(), megabytes(*bytes)))
                .collect(),
        }
    }

    /// Median milliseconds of the GPU.
    pub fn gpu(&self) -> Option<f64> {
        Some(self.gpu_ms?.median)
    }

    /// Median milliseconds of the CPU.
    pub fn cpu(&self) -> Option<f64> {
        Some(self.cpu_ms?.median)
    }

    /// Megabytes of all purposes.
    pub fn memory(&self) -> f64 {
        self.megabytes.iter().map(|part| part.cost).sum()
    }
}

/// A part of a cost with its share, 0 to 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Share {
    pub name: String,
    pub share: f64,
}

/// How a cost grows, and what has most of it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Growth {
    pub law: Option<PowerLaw>,
    /// Part with most of the cost at the largest size.
    pub largest: Option<Share>,
    /// Part with most of the increase from the smallest size to the largest; `None` without a [law](Self::law).
    pub increase: Option<Share>,
}

impl Growth {
    /// `rows`: size, cost and parts of it, by size.
    fn of(rows: &[(f64, f64, &[Part])]) -> Self {
        let points: Vec<_> = rows.iter().map(|(size, cost, _)| (*size, *cost)).collect();
        let law = PowerLaw::of(&points);
        let (Some((_, least, before)), Some((_, most, after))) = (rows.first(), rows.last()) else {
            return Self::default();
        };
        let first = |name: &str| {
            let part = before.iter().find(|part| part.name == name);
            part.map_or(0.0, |part| part.cost)
        };
        let share_of = |whole: f64, cost: &dyn Fn(&Part) -> f64| {
            let part = after.iter().max_by(|a, b| cost(a).total_cmp(&cost(b)))?;
            (whole > 0.0).then(|| Share {
                name: part.name.clone(),
                share: cost(part) / whole,
            })
        };
        Self {
            law,
            largest: share_of(*most, &|part| part.cost),
            increase: law
                .and_then(|_| share_of(most - least, &|part| part.cost - first(&part.name))),
        }
    }

    /// In words; `unit` is that of the cost.
    fn words(&self, unit: &str) -> String {
        let mut text = match &self.law {
            Some(law) => format!(
                "{:.3} + {:.3e} · size^{:.2} {unit} (error {:.1} %)",
                law.base,
                law.factor,
                law.exponent,
                100.0 * law.error
            ),
            None => "no increase of 10 % or more, or fewer than 3 sizes".to_owned(),
        };
        if let Some(Share { name, share }) = &self.increase {
            let _ = write!(text, "; {:.0} % of the increase in {name}", 100.0 * share);
        }
        if let Some(Share { name, share }) = &self.largest {
            let _ = write!(
                text,
                "; at the largest size {:.0} % in {name}",
                100.0 * share
            );
        }
        text
    }
}

/// An axis with its costs.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    pub axis: &'static str,
    pub unit: &'static str,
    pub rows: Vec<Row>,
    /// The size that could not be drawn, and why.
    pub ended: Option<String>,
    pub time: Growth,
    pub memory: Growth,
    /// `GPU` or `CPU`: which takes longer at the largest size.
    pub bound_by: Option<&'static str>,
}

impl Measured {
    /// `rows` ascend by size.
    pub fn new(
        axis: &'static str,
        unit: &'static str,
        rows: Vec<Row>,
        ended: Option<String>,
    ) -> Self {
        let times: Vec<_> = (rows.iter())
            .filter_map(|row| Some((row.size, row.gpu()?, row.passes.as_slice())))
            .collect();
        let memory: Vec<_> = (rows.iter())
            .map(|row| (row.size, row.memory(), row.megabytes.as_slice()))
            .collect();
        let (time, memory) = (Growth::of(&times), Growth::of(&memory));
        let bound_by = rows.last().and_then(|row| match row.gpu()? < row.cpu()? {
            true => Some("CPU"),
            false => Some("GPU"),
        });
        Self {
            axis,
            unit,
            rows,
            ended,
            time,
            memory,
            bound_by,
        }
    }

    /// What bounds the costs, in words.
    pub fn conclusions(&self) -> Vec<String> {
        let mut lines = vec![
            format!("time: {}", self.time.words("ms")),
            format!("memory: {}", self.memory.words("MB")),
        ];
        if let Some(by) = self.bound_by {
            lines.push(format!("bound by the {by} at the largest size"));
        }
        lines.extend((self.ended.iter()).map(|why| format!("ended at {why}")));
        lines
    }

    /// A table for people.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!("{}: {}", self.axis, self.unit),
            format!(
                "{:>12} {:>10} {:>10} {:>10} {:>10}",
                "size", "GPU ms", "p99", "CPU ms", "MB"
            ),
        ];
        let known = |ms: Option<f64>| ms.map_or_else(|| "-".to_owned(), |ms| format!("{ms:.3}"));
        for row in &self.rows {
            lines.push(format!(
                "{:>12} {:>10} {:>10} {:>10} {:>10.1}",
                short(row.size),
                known(row.gpu()),
                known(row.gpu_ms.map(|spread| spread.p99)),
                known(row.cpu()),
                row.memory()
            ));
        }
        lines.extend(
            self.conclusions()
                .into_iter()
                .map(|line| format!("  {line}")),
        );
        lines
    }
}

/// A number with at most four digits.
pub fn short(value: f64) -> String {
    let (scaled, unit) = match value.abs() {
        v if v >= 1e6 => (value / 1e6, " M"),
        v if v >= 1e4 => (value / 1e3, " k"),
        _ => (value, ""),
    };
    let text = match scaled.abs() {
        v if v >= 100.0 || v == 0.0 => format!("{scaled:.0}"),
        v if v >= 1.0 => format!("{scaled:.2}"),
        _ => format!("{scaled:.4}"),
    };
    let text = match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => &text,
    };
    format!("{text}{unit}")
}

/// A run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub device: String,
    pub tracer: Option<String>,
    /// Pixels of the pictures, but for the axis of pixels.
    pub size: (u32, u32),
    /// Frames of each size.
    pub frames: u32,
    pub axes: Vec<Measured>,
}

impl Report {
    /// # Errors
    /// None in practice: no value fails to serialize.
    pub fn json(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// A line for each size and part of its cost.
    pub fn csv(&self) -> String {
        let mut csv = "axis,size,kind,part,value\n".to_owned();
        for (axis, row) in
            (self.axes.iter()).flat_map(|a| a.rows.iter().map(move |row| (a.axis, row)))
        {
            let mut line = |kind: &str, part: &str, value: f64| {
                let _ = writeln!(csv, "{axis},{},{kind},{part},{value}", row.size);
            };
            for (kind, spread) in [("gpu_ms", row.gpu_ms), ("cpu_ms", row.cpu_ms)] {
                let Some(spread) = spread else { continue };
                line(kind, "median", spread.median);
                line(kind, "p95", spread.p95);
                line(kind, "p99", spread.p99);
                line(kind, "worst", spread.worst);
            }
            row.passes
                .iter()
                .for_each(|part| line("pass_ms", &part.name, part.cost));
            row.megabytes
                .iter()
                .for_each(|part| line("mb", &part.name, part.cost));
        }
        csv
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// An axis on which `direct` grows, `eye` does not, and lights take more memory.
    pub fn measured() -> Measured {
        let rows = [1.0, 2.0, 4.0, 8.0].map(|size| {
            let gpu = Spread::of(&[(3.0 + size) as f32]);
            Row {
                size,
                gpu_ms: gpu,
                cpu_ms: Spread::of(&[0.5]),
                passes: vec![Part::new("eye", 3.0), Part::new("direct", size)],
                megabytes: vec![
                    Part::new("textures", 100.0),
                    Part::new("lights", size * 100.0),
                ],
            }
        });
        Measured::new(
            "lights",
            "lights <of> a hall",
            rows.into(),
            Some("16: no memory".into()),
        )
    }

    #[test]
    fn the_part_that_grows_is_named() {
        let measured = measured();
        let law = measured.time.law.expect("a law");
        assert!((law.exponent - 1.0).abs() < 0.02 && (law.base - 3.0).abs() < 0.05);
        let share = |name: &str, share: f64| {
            let name = name.to_owned();
            Some(Share { name, share })
        };
        assert_eq!(measured.time.increase, share("direct", 1.0));
        assert_eq!(measured.time.largest, share("direct", 8.0 / 11.0));
        assert_eq!(measured.memory.increase, share("lights", 1.0));
        assert_eq!(measured.bound_by, Some("GPU"));
        let text = measured.lines().join("\n");
        for part in [
            "100 % of the increase in direct",
            "bound by the GPU",
            "ended at 16: no memory",
        ] {
            assert!(text.contains(part), "{text}");
        }
    }

    #[test]
    fn an_axis_without_sizes_has_no_figures() {
        let none = Measured::new("lights", "lights", Vec::new(), None);
        assert!(none.time.law.is_none() && none.time.largest.is_none() && none.bound_by.is_none());
        assert_eq!(none.lines().len(), 4);
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.015_625, "0.0156"),
            (8.0, "8"),
            (720.0, "720"),
            (1234.0, "1234"),
            (20_000.0, "20 k"),
            (250_000.0, "250 k"),
            (1.5e6, "1.5 M"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn every_part_is_a_line() {
        let report = Report {
            device: "a".into(),
            tracer: None,
            size: (1, 1),
            frames: 4,
            axes: vec![measured()],
        };
        assert_eq!(report.csv().lines().count(), 1 + 4 * (8 + 2 + 2));
        let json: serde_json::Value = serde_json::from_str(&report.json().unwrap()).unwrap();
        assert_eq!(json["axes"][0]["rows"][3]["passes"][1]["cost"], 8.0);
    }
}
