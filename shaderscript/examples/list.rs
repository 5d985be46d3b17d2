//! Lists the materials of a script with their stages: `cargo run -p shaderscript --example list -- FILE.shader`.
//!
//! Faults go to the error output. Exit code 2 when the file cannot be read, the engine would ignore it, or it defines
//! nothing.

use shaderscript::{Script, StageImage, parse_script};
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::ExitCode;

fn image(image: &StageImage) -> String {
    match image {
        StageImage::Map(name) => name.clone(),
        StageImage::ClampMap(name) => format!("{name} (clamped)"),
        StageImage::Animation { frequency, images } => {
            format!("{} at {frequency} images/s", images.join(", "))
        }
        StageImage::Video(name) => format!("{name} (video)"),
        StageImage::Lightmap => "$lightmap".to_owned(),
        StageImage::White => "$whiteimage".to_owned(),
    }
}

fn list(script: &Script) -> Result<String, std::fmt::Error> {
    let mut out = String::new();
    for shader in &script.shaders {
        write!(out, "{}, line {}", shader.name, shader.location.line)?;
        write!(out, ", sort {}", shader.sort_value())?;
        if !shader.surface_params.is_empty() {
            write!(out, ", {}", shader.surface_params.join(" "))?;
        }
        writeln!(out)?;
        if let Some(reason) = &shader.rejected {
            writeln!(out, "    rejected: {reason}")?;
        }
        for (number, stage) in shader.stages.iter().enumerate() {
            write!(out, "    {number}: {}", image(&stage.image))?;
            if let Some((source, destination)) = stage.blend {
                write!(out, ", blend {source:?} {destination:?}")?;
            }
            if let Some(test) = stage.alpha_func {
                write!(out, ", alpha {test:?}")?;
            }
            write!(
                out,
                ", rgb {:?}, alpha {:?}",
                stage.rgb_gen, stage.alpha_gen
            )?;
            write!(out, ", coordinates {:?}", stage.tc_gen)?;
            for change in &stage.tc_mods {
                write!(out, ", {change:?}")?;
            }
            writeln!(out)?;
        }
    }
    Ok(out)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path] = arguments.as_slice() else {
        eprintln!("usage: list FILE.shader");
        return ExitCode::from(2);
    };
    let text = match std::fs::read(path) {
        Ok(text) => text,
        Err(error) => {
            eprintln!("{path}: {error}");
            return ExitCode::from(2);
        }
    };
    let script = parse_script(path, &text);
    for diagnostic in &script.diagnostics {
        eprintln!("{diagnostic}");
    }
    match list(&script) {
        // A reader that closed the pipe wants no more.
        Ok(text) => drop(std::io::stdout().write_all(text.as_bytes())),
        Err(error) => {
            eprintln!("{path}: {error}");
            return ExitCode::from(2);
        }
    }
    if script.dropped.is_none() && script.shaders.is_empty() {
        eprintln!("{path}: no definition found; is this a .shader script?");
    }
    if script.dropped.is_some() || script.shaders.is_empty() {
        return ExitCode::from(2);
    }
    ExitCode::SUCCESS
}
