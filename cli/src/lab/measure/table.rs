//! Measurements as a table.

use serde_json::{Map, Value};

use super::shadows::{BINS, limits};

/// Columns: heading, JSON pointer, factor, decimals.
const COLUMNS: [(&str, &str, f64, usize); 8] = [
    ("SSIM", "/ssim", 1.0, 4),
    ("FLIP", "/flip", 1.0, 4),
    ("rest SSIM", "/rest_ssim", 1.0, 4),
    ("rest FLIP", "/rest_flip", 1.0, 4),
    ("noise %", "/noise", 100.0, 2),
    ("fly SSIM", "/moving_light/ssim", 1.0, 4),
    ("trail %", "/moving_light/trail", 100.0, 1),
    ("bias %", "/rested_bias", 100.0, 1),
];
type Row = [f64; COLUMNS.len()];

fn row(value: &Value) -> Row {
    COLUMNS.map(|(_, at, scale, _)| {
        value
            .pointer(at)
            .and_then(Value::as_f64)
            .map_or(f64::NAN, |v| v * scale)
    })
}

/// Frames until a switched-off light disappeared; `None` if it lit nothing, infinity if it remained.
fn off(value: &Value) -> Option<f64> {
    match value.get("light_off_frames")? {
        Value::Null => Some(f64::INFINITY),
        frames => frames.as_f64(),
    }
}

/// Prints a row for each place, variant and region, and their means.
pub fn print(all: &Map<String, Value>) {
    print!("{:<20} {:<22}", "place", "picture");
    COLUMNS.iter().for_each(|(name, ..)| print!(" {name:>9}"));
    println!(" {:>6}", "off");
    let mut sums: Vec<(String, Vec<Row>, Vec<f64>)> = Vec::new();
    for (place, kinds) in all {
        for (kind, value) in kinds.as_object().into_iter().flatten() {
            if !value.is_object() {
                continue;
            }
            let parts = ["specular", "direct"].map(|part| (part, value.get(part)));
            let whole = (kind.clone(), value);
            let parts = parts
                .into_iter()
                .filter_map(|(part, value)| Some((format!("{kind}, {part}"), value?)));
            for (name, value) in std::iter::once(whole).chain(parts) {
                let (row, off) = (row(value), off(value));
                line(place, &name, row, off);
                match sums.iter_mut().find(|(n, ..)| *n == name) {
                    Some((_, rows, offs)) => {
                        rows.push(row);
                        offs.extend(off);
                    }
                    None => sums.push((name, vec![row], off.into_iter().collect())),
                }
            }
        }
    }
    for (name, rows, offs) in sums {
        let mean = std::array::from_fn(|i| {
            let known = || rows.iter().map(|r| r[i]).filter(|v| v.is_finite());
            known().sum::<f64>() / known().count() as f64
        });
        line(
            "mean (worst off)",
            &name,
            mean,
            offs.into_iter().reduce(f64::max),
        );
    }
    print_shadows(all);
    for (place, kinds) in all {
        let number = |name: &str| kinds.get(name).and_then(Value::as_f64);
        if let Some(share) = number("specular_share") {
            println!(
                "{place:<20} {:.1} % of the pixels show reflections and the like",
                100.0 * share
            );
        }
        if let Some(ratio) = number("brightness") {
            println!("{place:<20} brightness of the traced over the classic look {ratio:.2}");
        }
    }
}

/// The contrast of shadows that each picture keeps, by view distance, of the moving and of the resting camera.
fn shadows(value: &Value, name: &str) -> Option<[f64; BINS]> {
    let bins = value.get(name)?.as_array()?;
    let kept = |bin: usize| bins.get(bin)?.get("kept")?.as_f64();
    Some(std::array::from_fn(|bin| kept(bin).unwrap_or(f64::NAN)))
}

fn print_shadows(all: &Map<String, Value>) {
    print!("{:<20} {:<22}", "shadow contrast %", "units away");
    for bin in 0..BINS {
        match limits(bin) {
            (_, Some(to)) => print!(" {:>9}", format!("to {to}")),
            (from, None) => print!(" {:>9}", format!("{from} on")),
        }
    }
    println!();
    let mut sums: Vec<(String, Vec<[f64; BINS]>)> = Vec::new();
    for (place, kinds) in all {
        for (kind, value) in kinds.as_object().into_iter().flatten() {
            for (name, suffix) in [("shadows", ""), ("rest_shadows", ", rest")] {
                let Some(row) = shadows(value, name) else {
                    continue;
                };
                let name = format!("{kind}{suffix}");
                shadow_line(place, &name, &row);
                match sums.iter_mut().find(|(n, _)| *n == name) {
                    Some((_, rows)) => rows.push(row),
                    None => sums.push((name, vec![row])),
                }
            }
        }
    }
    for (name, rows) in sums {
        let mean = |bin: usize| {
            let known = || rows.iter().map(|row| row[bin]).filter(|v| v.is_finite());
            known().sum::<f64>() / known().count() as f64
        };
        shadow_line("mean", &name, &std::array::from_fn(mean));
    }
}

fn shadow_line(place: &str, kind: &str, row: &[f64; BINS]) {
    print!("{place:<20} {kind:<22}");
    for kept in row {
        match kept.is_finite() {
            true => print!(" {:>9.1}", 100.0 * kept),
            false => print!(" {:>9}", "-"),
        }
    }
    println!();
}

fn line(place: &str, kind: &str, row: Row, off: Option<f64>) {
    print!("{place:<20} {kind:<22}");
    for (value, (.., digits)) in row.into_iter().zip(COLUMNS) {
        if value.is_finite() {
            print!(" {value:>9.digits$}");
        } else {
            print!(" {:>9}", "-");
        }
    }
    match off {
        None => println!(" {:>6}", "-"),
        Some(frames) if frames.is_finite() => println!(" {frames:>6}"),
        Some(_) => println!(" {:>6}", "never"),
    }
}
