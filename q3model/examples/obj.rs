//! Writes a model as Wavefront OBJ: `cargo run -p q3model --example obj -- MODEL [FRAME] > MODEL.obj`.
//!
//! Reads MD3, MDR (finest level of detail) and IQM. Exit code 2 when the file cannot be read, is no model, or has no
//! such frame.

use q3model::glam::{Vec2, Vec3};
use q3model::{Iqm, Md3, Mdr};
use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::ExitCode;

/// A part with one shader.
struct Part {
    name: String,
    shader: String,
    /// Position, normal and texture coordinates.
    vertices: Vec<(Vec3, Vec3, Vec2)>,
    /// Clockwise seen from the front.
    triangles: Vec<[u32; 3]>,
}

fn md3(model: &Md3, frame: usize) -> Vec<Part> {
    let part = |surface: &q3model::Surface| Part {
        name: surface.name.clone(),
        shader: surface.shaders.first().cloned().unwrap_or_default(),
        vertices: surface
            .frame_vertices(frame)
            .iter()
            .zip(&surface.st)
            .map(|(vertex, &st)| (vertex.position(), vertex.normal(), st))
            .collect(),
        triangles: surface.triangles.clone(),
    };
    model.surfaces.iter().map(part).collect()
}

fn mdr(model: &Mdr, frame: usize) -> Vec<Part> {
    let bones = model.frame_bones(frame);
    let part = |surface: &q3model::MdrSurface| Part {
        name: surface.name.clone(),
        shader: surface.shader.clone(),
        vertices: surface
            .vertices
            .iter()
            .map(|vertex| {
                let (position, normal) = surface.skinned(vertex, bones);
                (position, normal, vertex.st)
            })
            .collect(),
        triangles: surface.triangles.clone(),
    };
    model.lods.iter().take(1).flatten().map(part).collect()
}

fn iqm(model: &Iqm, frame: usize) -> Vec<Part> {
    let mut pose = Vec::new();
    model.pose(&model.skeleton(), frame, frame, 0.0, &mut pose);
    let part = |surface: &q3model::IqmSurface| Part {
        name: surface.name.clone(),
        shader: surface.material.clone(),
        vertices: model
            .surface_vertices(surface)
            .iter()
            .map(|vertex| {
                let (position, normal) = vertex.skinned(&pose);
                (position, normal, vertex.st)
            })
            .collect(),
        triangles: surface.triangles.clone(),
    };
    model.surfaces.iter().map(part).collect()
}

/// The parts of a model file of any format in one frame.
fn parts(bytes: &[u8], frame: usize) -> Result<Vec<Part>, Box<dyn Error>> {
    let (frames, parts): (usize, Vec<Part>) = if bytes.starts_with(b"INTERQUAKEMODEL\0") {
        let model = Iqm::parse(bytes)?;
        // A model without poses has the one that it was bound in.
        (model.num_frames.max(1), iqm(&model, frame))
    } else if bytes.starts_with(b"RDM5") {
        let model = Mdr::parse(bytes)?;
        (model.frames.len(), mdr(&model, frame))
    } else {
        let model = Md3::parse(bytes)?;
        (model.frames.len(), md3(&model, frame))
    };
    if frame >= frames {
        return Err(format!("there is no frame {frame}; the model has {frames}").into());
    }
    Ok(parts)
}

fn obj(path: &str, frame: usize) -> Result<String, Box<dyn Error>> {
    let mut out = String::new();
    let mut first = 1;
    for part in parts(&std::fs::read(path)?, frame)? {
        writeln!(out, "o {}\nusemtl {}", part.name, part.shader)?;
        for (position, normal, st) in &part.vertices {
            writeln!(out, "v {} {} {}", position.x, position.y, position.z)?;
            writeln!(out, "vn {} {} {}", normal.x, normal.y, normal.z)?;
            // Rows of images run down here and up in OBJ.
            writeln!(out, "vt {} {}", st.x, 1.0 - st.y)?;
        }
        for [a, b, c] in part.triangles {
            // OBJ has front faces counter-clockwise.
            let corner = |at: u32| first + u64::from(at);
            let (a, b, c) = (corner(a), corner(c), corner(b));
            writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?;
        }
        first += part.vertices.len() as u64;
    }
    Ok(out)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (path, frame) = match arguments.as_slice() {
        [path] => (path, Ok(0)),
        [path, frame] => (path, frame.parse()),
        _ => {
            eprintln!("usage: obj MODEL [FRAME]");
            return ExitCode::from(2);
        }
    };
    let Ok(frame) = frame else {
        eprintln!("usage: obj MODEL [FRAME]; a frame is a whole number, from 0");
        return ExitCode::from(2);
    };
    match obj(path, frame) {
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
