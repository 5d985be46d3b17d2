//! A page with the curves of a run; it needs no other file.

use std::fmt::Write as _;

use super::bound::{Measured, Part, Report, Row, short};

/// Size of a chart and of its margins (left, right, top, bottom), in pixels.
const CHART: (f64, f64) = (560.0, 320.0);
const MARGIN: [f64; 4] = [64.0, 190.0, 28.0, 44.0];

/// Curves in a chart beside the sum: the parts that are largest at the largest size.
const PARTS: usize = 6;

/// Colours of the curves, the first of the sum (Okabe and Ito, distinguishable by people with colour blindness).
const COLORS: [&str; PARTS + 2] = [
    "#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#999999",
];

/// Least value on a logarithmic axis, as a part of the greatest.
const LEAST: f64 = 1e-4;

struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
}

/// The page.
pub fn html(report: &Report) -> String {
    let (width, height) = report.size;
    let tracer = report.tracer.as_deref().unwrap_or("no tracer");
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>How cost grows</title>\n<style>\
         body{{font:15px/1.5 sans-serif;max-width:1180px;margin:2em auto;padding:0 1em;color:#111;background:#fff}}\
         svg{{max-width:100%}}table{{border-collapse:collapse;margin:.5em 0}}\
         td,th{{padding:.1em .8em;text-align:right;font-variant-numeric:tabular-nums}}</style>\n\
         <h1>How cost grows</h1>\n<p>{}, {}. {width} x {height} pixels unless pixels grow. {} frames of each size; medians \
         without the first 10, at most half. Command: <code>relight-lab growth</code>.</p>\n",
        escaped(&report.device),
        escaped(tracer),
        report.frames
    );
    for axis in &report.axes {
        section(&mut page, axis);
    }
    page.push_str("</html>\n");
    page
}

fn section(page: &mut String, axis: &Measured) {
    let _ = write!(
        page,
        "<h2>{}</h2>\n<p>{}</p>\n<ul>",
        escaped(axis.axis),
        escaped(axis.unit)
    );
    for line in axis.conclusions() {
        let _ = write!(page, "<li>{}</li>", escaped(&line));
    }
    page.push_str("</ul>\n");
    let gpu = |row: &Row| row.gpu();
    let mut times = curves(&axis.rows, "GPU, all passes", gpu, |row| &row.passes);
    times.push(Curve {
        name: "CPU".into(),
        points: points(&axis.rows, Row::cpu),
    });
    let memory = curves(
        &axis.rows,
        "all",
        |row| Some(row.memory()),
        |row| &row.megabytes,
    );
    chart(page, axis.axis, "ms", &times);
    chart(page, axis.axis, "MB", &memory);
    page.push_str("<table><tr><th>size<th>GPU ms<th>p95<th>p99<th>worst<th>CPU ms<th>MB</tr>");
    let cell = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.3}"));
    for row in &axis.rows {
        let spread = row.gpu_ms;
        let _ = write!(page, "<tr><td>{}", short(row.size));
        for value in [
            row.gpu(),
            spread.map(|s| s.p95),
            spread.map(|s| s.p99),
            spread.map(|s| s.worst),
            row.cpu(),
            Some(row.memory()),
        ] {
            let _ = write!(page, "<td>{}", cell(value));
        }
        page.push_str("</tr>");
    }
    page.push_str("</table>\n");
}

fn points(rows: &[Row], of: impl Fn(&Row) -> Option<f64>) -> Vec<(f64, f64)> {
    let known = rows.iter().filter_map(|row| Some((row.size, of(row)?)));
    known.collect()
}

/// The sum, and its largest parts at the largest size.
fn curves(
    rows: &[Row],
    sum: &str,
    of: impl Fn(&Row) -> Option<f64>,
    parts: impl Fn(&Row) -> &Vec<Part>,
) -> Vec<Curve> {
    let mut all = vec![Curve {
        name: sum.to_owned(),
        points: points(rows, of),
    }];
    let mut largest: Vec<&Part> = rows
        .last()
        .map_or(Vec::new(), |row| parts(row).iter().collect());
    largest.sort_by(|a, b| b.cost.total_cmp(&a.cost));
    for part in largest.into_iter().take(PARTS) {
        let cost = |row: &Row| {
            let same = parts(row).iter().find(|p| p.name == part.name);
            same.map(|p| p.cost)
        };
        all.push(Curve {
            name: part.name.clone(),
            points: points(rows, cost),
        });
    }
    all
}

/// An axis of a chart.
struct Scale {
    log: bool,
    low: f64,
    high: f64,
    /// Pixels of both ends.
    from: f64,
    to: f64,
}

impl Scale {
    fn new(values: &[f64], log: bool, (from, to): (f64, f64)) -> Self {
        let high = values.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let least = values
            .iter()
            .copied()
            .filter(|v| *v > 0.0)
            .fold(high, f64::min);
        let (low, high) = match log {
            true => {
                let low = least.max(high * LEAST);
                // no empty range
                (low, if high > low { high } else { low * 2.0 })
            }
            false => (0.0, high),
        };
        Self {
            log,
            low,
            high,
            from,
            to,
        }
    }

    fn at(&self, value: f64) -> f64 {
        let part = match self.log {
            true => (value.max(self.low) / self.low).ln() / (self.high / self.low).ln(),
            false => value / self.high,
        };
        self.from + (self.to - self.from) * part
    }

    /// Values with a mark: 1, 2 and 5 of each decade, at most eight.
    fn marks(&self) -> Vec<f64> {
        let decade = |value: f64| value.log10().floor() as i32;
        let steps: &[f64] = &[1.0, 2.0, 5.0];
        if !self.log {
            let step = (self.high / 5.0).max(f64::MIN_POSITIVE);
            let power = 10f64.powi(decade(step));
            let step = steps.iter().map(|s| s * power).find(|s| *s >= step);
            let step = step.unwrap_or(10.0 * power);
            return (0..=8u8)
                .map(|n| f64::from(n) * step)
                .filter(|mark| *mark <= self.high)
                .collect();
        }
        let all: Vec<f64> = (decade(self.low)..=decade(self.high))
            .flat_map(|power| steps.iter().map(move |s| s * 10f64.powi(power)))
            .filter(|mark| (self.low..=self.high).contains(mark))
            .collect();
        let every = all.len().div_ceil(8).max(1);
        all.into_iter().step_by(every).collect()
    }
}

/// Logarithmic if every size is positive, so that a power law is a straight line.
fn chart(page: &mut String, x_name: &str, y_name: &str, curves: &[Curve]) {
    let all = || curves.iter().flat_map(|curve| &curve.points);
    let xs: Vec<f64> = all().map(|p| p.0).collect();
    let ys: Vec<f64> = all().map(|p| p.1).collect();
    let log = !xs.is_empty() && xs.iter().all(|x| *x > 0.0);
    let (width, height) = CHART;
    let [left, right, top, bottom] = MARGIN;
    let x = Scale::new(&xs, log, (left, width - right));
    let y = Scale::new(&ys, log, (height - bottom, top));
    let _ = write!(
        page,
        "<svg viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" \
         font-size=\"11\" role=\"img\" aria-label=\"{y_name} over {x_name}\">"
    );
    for mark in x.marks() {
        let at = x.at(mark);
        let _ = write!(
            page,
            "<path d=\"M{at:.1} {top}V{:.1}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{}</text>",
            height - bottom,
            height - bottom + 16.0,
            short(mark)
        );
    }
    for mark in y.marks() {
        let at = y.at(mark);
        let _ = write!(
            page,
            "<path d=\"M{left} {at:.1}H{:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"end\">{}</text>",
            width - right,
            left - 6.0,
            at + 4.0,
            short(mark)
        );
    }
    let _ = write!(
        page,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{x_name}</text><text x=\"6\" y=\"16\">{y_name}</text>",
        (left + width - right) * 0.5,
        height - 8.0
    );
    for (number, (curve, color)) in curves.iter().zip(COLORS).enumerate() {
        let mut path = String::new();
        for (at, (size, cost)) in curve.points.iter().enumerate() {
            let move_or_line = if at == 0 { 'M' } else { 'L' };
            let _ = write!(path, "{move_or_line}{:.1} {:.1}", x.at(*size), y.at(*cost));
        }
        let line = 14.0 * number as f64 + top + 6.0;
        let _ = write!(
            page,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{}\"/>\
             <path d=\"M{:.1} {line:.1}h14\" stroke=\"{color}\" stroke-width=\"3\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            if number == 0 { 2.5 } else { 1.5 },
            width - right + 10.0,
            width - right + 28.0,
            line + 4.0,
            escaped(&curve.name)
        );
    }
    page.push_str("</svg>\n");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::super::bound::tests::measured;
    use super::*;

    #[test]
    fn a_page_has_two_charts_for_each_axis() {
        let none = Measured::new("layers", "layers", Vec::new(), None);
        let page = html(&Report {
            device: "a <device>".into(),
            tracer: None,
            size: (4, 2),
            frames: 8,
            axes: vec![measured(), none],
        });
        assert_eq!(page.matches("<svg").count(), 4);
        assert!(page.contains("a &lt;device&gt;") && page.contains("lights &lt;of&gt; a hall"));
        assert!(page.contains(">direct</text>") && page.contains(">textures</text>"));
        assert!(!page.contains("NaN") && !page.contains("inf"), "{page}");
    }

    #[test]
    fn marks_are_round_and_within_the_scale() {
        let log = Scale::new(&[1.0, 20_000.0], true, (0.0, 100.0));
        assert!(log.marks().len() <= 8 && log.marks().iter().all(|m| (1.0..=20_000.0).contains(m)));
        assert_eq!((log.at(1.0), log.at(20_000.0)), (0.0, 100.0));
        let linear = Scale::new(&[0.0, 8.0], false, (0.0, 100.0));
        assert_eq!(linear.marks(), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(linear.at(4.0), 50.0);
        let one = Scale::new(&[3.0], true, (0.0, 100.0));
        assert!(one.at(3.0).is_finite());
    }
}
