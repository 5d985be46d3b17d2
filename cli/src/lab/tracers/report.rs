//! The figures of tracers, as a table and as JSON.

use anyhow::Result;
use renderer_vk::StructureCost;
use serde::Serialize;

/// The passes whose rays are measured: rays of the camera, of a bounce, to lights.
pub const PASSES: [&str; 3] = ["trace_primary_rays", "trace_bounce_rays", "trace_direct"];

/// A tracer on a map, with a value for each run.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub scene: String,
    pub tracer: String,
    /// Triangles in the structures.
    pub triangles: usize,
    /// Cells of the grid along each axis.
    pub cells: Option<[u32; 3]>,
    /// Bytes of the structures.
    pub bytes: u64,
    /// Milliseconds until the structures are on the device.
    pub build_ms: Vec<f64>,
    /// Millions of rays a second by [pass](PASSES); empty without rays, or if the device measures no times.
    pub mrays: [Vec<f64>; PASSES.len()],
}

impl Row {
    /// Of one run. `sums`: rays and milliseconds of each pass.
    pub fn new(
        scene: &str,
        tracer: String,
        cost: &StructureCost,
        sums: [[f64; 2]; PASSES.len()],
    ) -> Self {
        let rate = |[rays, ms]: [f64; 2]| match rays > 0.0 && ms > 0.0 {
            true => vec![rounded(rays / (ms * 1e3))],
            false => Vec::new(),
        };
        Self {
            scene: scene.to_owned(),
            tracer,
            triangles: cost.triangles,
            cells: cost.cells,
            bytes: cost.bytes,
            build_ms: vec![rounded(cost.build_ms)],
            mrays: sums.map(rate),
        }
    }

    /// Adds another run.
    pub fn join(&mut self, run: &Self) {
        self.build_ms.extend(&run.build_ms);
        for (values, more) in self.mrays.iter_mut().zip(&run.mrays) {
            values.extend(more);
        }
    }

    /// As a row of a table. `hierarchy`: our hierarchies on the same map.
    fn line(&self, hierarchy: Option<&Self>) -> String {
        let cells = match self.cells {
            Some([x, y, z]) => format!("{x}×{y}×{z}"),
            None => "–".to_owned(),
        };
        #[allow(clippy::cast_precision_loss)] // a rounded value for reports
        let kib = self.bytes as f64 / 1024.0;
        let [eye, bounce, lights] = self.mrays.each_ref().map(|values| spread(values));
        let over = |pass: usize| {
            let of = |row: &Self| row.mrays.get(pass).cloned().unwrap_or_default();
            let pairs = of(self)
                .into_iter()
                .zip(hierarchy.map(of).unwrap_or_default());
            let ratios: Vec<f64> = pairs
                .map(|(a, b)| (a / b * 100.0).round() / 100.0)
                .collect();
            spread(&ratios)
        };
        format!(
            "| {} | {} | {} | {cells} | {} | {kib:.0} | {eye} | {bounce} | {lights} | {} | {} |",
            self.scene,
            self.triangles,
            self.tracer,
            spread(&self.build_ms),
            over(0),
            over(1),
        )
    }
}

/// All figures.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub device: String,
    pub size: (u32, u32),
    /// Views of a map; a made-up scene has one.
    pub views: usize,
    pub frames: u32,
    pub runs: u32,
    pub rows: Vec<Row>,
}

impl Report {
    /// As JSON.
    ///
    /// # Errors
    /// None in practice: all values can be written.
    pub fn json(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// As a table in Markdown: median, least and most of the runs. The ratios are those within each run.
    pub fn lines(&self) -> Vec<String> {
        let (width, height) = self.size;
        let mut lines = vec![
            format!(
                "{}, {width}x{height}, {} runs of {} frames a view",
                self.device, self.runs, self.frames
            ),
            String::new(),
            "| scene | triangles | tracer | cells | build ms | KiB | eye Mrays/s | bounce Mrays/s | light Mrays/s | eye / compute | bounce / compute |".into(),
            "|---|---|---|---|---|---|---|---|---|---|---|".into(),
        ];
        lines.extend(self.rows.iter().map(|row| {
            let mut rows = self.rows.iter();
            row.line(rows.find(|other| other.scene == row.scene && other.tracer == "compute"))
        }));
        lines
    }
}

/// To four digits.
fn rounded(value: f64) -> f64 {
    let digits = 3 - value.abs().max(1e-6).log10().floor() as i32;
    let scale = 10f64.powi(digits);
    (value * scale).round() / scale
}

/// Median, least and most.
fn spread(values: &[f64]) -> String {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len().saturating_sub(1) / 2);
    let (Some(middle), Some(least), Some(most)) = (middle, sorted.first(), sorted.last()) else {
        return "–".to_owned();
    };
    match sorted.len() {
        1 => format!("{middle}"),
        _ => format!("{middle}, {least}, {most}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_become_a_median_with_its_spread() {
        let cost = StructureCost {
            build_ms: 2.0,
            bytes: 2048,
            triangles: 12,
            cells: Some([16, 8, 1]),
        };
        let run = |ms| {
            Row::new(
                "m",
                "grid 16".into(),
                &cost,
                [[1e6, ms], [1e6, 4.0], [0.0; 2]],
            )
        };
        let mut row = run(1.0);
        row.join(&run(8.0));
        row.join(&run(2.0));
        assert_eq!(
            row.line(Some(&row)),
            "| m | 12 | grid 16 | 16×8×1 | 2, 2, 2 | 2 | 500, 125, 1000 | 250, 250, 250 | – | 1, 1, 1 | 1, 1, 1 |"
        );
        assert_eq!(rounded(1234.56), 1235.0);
        assert_eq!(rounded(0.012_345), 0.01235);
        let report = Report {
            device: "d".into(),
            size: (2, 2),
            views: 1,
            frames: 1,
            runs: 3,
            rows: vec![row],
        };
        assert_eq!(report.lines().len(), 5);
        let json: serde_json::Value = serde_json::from_str(&report.json().unwrap()).unwrap();
        assert_eq!(json["rows"][0]["mrays"][0][1], 125.0);
    }
}
