//! Prints what a map holds: `cargo run -p q3bsp --example dump -- FILE.bsp`.
//!
//! Exit code 2 when the file cannot be read or is no map.

use q3bsp::Bsp;
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::ExitCode;

fn dump(path: &str) -> Result<String, Box<dyn std::error::Error>> {
    let bytes = std::fs::read(path)?;
    let bsp = Bsp::parse(&bytes)?;
    let mut out = String::new();
    writeln!(out, "{}, {} bytes", bsp.format, bytes.len())?;
    for entry in q3bsp::lump_entries(&bytes)? {
        let length = usize::try_from(entry.range.length)?;
        let unit = if entry.stride == 1 {
            "bytes"
        } else {
            "records"
        };
        writeln!(
            out,
            "{:>16} {:>9} {unit}",
            entry.lump.name(),
            length / entry.stride
        )?;
    }
    for warning in &bsp.warnings {
        writeln!(out, "warning: {warning}")?;
    }
    let (entities, warnings) = q3bsp::entities::parse(&bsp.entities);
    for warning in warnings {
        writeln!(
            out,
            "warning: entities, line {}: {}",
            warning.line, warning.message
        )?;
    }
    for entity in &entities {
        writeln!(out, "{}", entity.classname())?;
        for (key, value) in &entity.pairs {
            if !key.eq_ignore_ascii_case("classname") {
                writeln!(out, "    {key} = {value}")?;
            }
        }
    }
    Ok(out)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path] = arguments.as_slice() else {
        eprintln!("usage: dump FILE.bsp");
        return ExitCode::from(2);
    };
    match dump(path) {
        Ok(text) => {
            // A reader that closed the pipe wants no more.
            let _ = std::io::stdout().write_all(text.as_bytes());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{path}: {error}");
            ExitCode::from(2)
        }
    }
}
