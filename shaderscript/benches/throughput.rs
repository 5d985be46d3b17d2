//! MB/s of reading scripts: `cargo bench -p shaderscript [-- FILE.shader]`.
//!
//! Without a file a made-up script of some 1 MB is taken.

use shaderscript::glam::Vec3;
use shaderscript::{Library, Stage, eval, parse_script};
use testkit::bench::{input, measure};

/// 4000 definitions of three stages.
fn made_up() -> Vec<u8> {
    let definition = |number: usize| {
        format!(
            "textures/made/up{number}\n{{\n\tsurfaceparm trans // a comment\n\tcull none\n\t{{\n\t\tmap $lightmap\n\t}}\n\
             \t{{\n\t\tmap textures/made/up{number}.tga\n\t\tblendFunc filter\n\t\ttcMod scroll 0.1 0.2\n\t}}\n\
             \t{{\n\t\tclampmap textures/made/glow.tga\n\t\tblendFunc add\n\t\trgbGen wave sin 0.5 0.5 0 1\n\t}}\n}}\n"
        )
    };
    (0..4000).map(definition).collect::<String>().into_bytes()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = input(made_up)?;
    let script = parse_script("bench", &text);
    let stages = script.shaders.iter().map(|shader| shader.stages.len());
    println!(
        "{} definitions, {} stages, {:.2} MB",
        script.shaders.len(),
        stages.sum::<usize>(),
        text.len() as f64 / 1e6
    );
    measure("parse", text.len(), || parse_script("bench", &text));
    measure("library", text.len(), || Library::new([("bench", &text)]));
    let context = eval::ColorContext {
        time: 1.25,
        ..eval::ColorContext::default()
    };
    measure("colours", text.len(), || {
        let stages = script.shaders.iter().flat_map(|shader| &shader.stages);
        let color = |stage: &Stage| eval::rgb_gen(&stage.rgb_gen, &context, Vec3::Z, [255; 4]);
        stages.map(color).collect::<Vec<_>>()
    });
    Ok(())
}
