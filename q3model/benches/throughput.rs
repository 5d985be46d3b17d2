//! MB/s of reading models: `cargo bench -p q3model [-- MODEL]`.
//!
//! Takes MD3, MDR and IQM. Without a file a made-up MD3 of some 1 MB is taken.

use q3model::glam::{Vec2, Vec3};
use q3model::{Frame, Iqm, Md3, Mdr, PackedVertex, Surface};
use testkit::bench::{input, measure};

/// 100 frames of 1000 vertices.
fn made_up() -> Vec<u8> {
    let (frames, vertices) = (100, 1000u16);
    let frame = Frame {
        mins: Vec3::ZERO,
        maxs: Vec3::ONE,
        local_origin: Vec3::ZERO,
        radius: 1.0,
        name: "frame".to_owned(),
    };
    let vertex = |at: u16| PackedVertex::pack(Vec3::splat(f32::from(at) / 8.0), Vec3::Z);
    let surface = Surface {
        name: "body".to_owned(),
        shaders: vec!["models/a".to_owned()],
        triangles: (2..u32::from(vertices))
            .map(|at| [at - 2, at - 1, at])
            .collect(),
        st: vec![Vec2::ZERO; usize::from(vertices)],
        vertices: (0..frames)
            .flat_map(|_| (0..vertices).map(vertex))
            .collect(),
        num_verts: usize::from(vertices),
    };
    let model = Md3 {
        name: "models/a.md3".to_owned(),
        frames: vec![frame; frames],
        surfaces: vec![surface],
        ..Md3::default()
    };
    model.write()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bytes = input(made_up)?;
    println!("{:.2} MB", bytes.len() as f64 / 1e6);
    if bytes.starts_with(b"INTERQUAKEMODEL\0") {
        let model = Iqm::parse(&bytes)?;
        measure("IQM parse", bytes.len(), || Iqm::parse(&bytes));
        measure("IQM write", bytes.len(), || model.write());
    } else if bytes.starts_with(b"RDM5") {
        let model = Mdr::parse(&bytes)?;
        measure("MDR parse", bytes.len(), || Mdr::parse(&bytes));
        measure("MDR write", bytes.len(), || model.write(false));
    } else {
        let model = Md3::parse(&bytes)?;
        measure("MD3 parse", bytes.len(), || Md3::parse(&bytes));
        measure("MD3 write", bytes.len(), || model.write());
    }
    Ok(())
}
