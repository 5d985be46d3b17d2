//! What every text must lead to: materials that can be evaluated, and faults with a place.

use glam::{Vec2, Vec3};
use shaderscript::{Library, Shader, eval, parse_script};

/// Reads a script and evaluates all of it at a time in seconds. False when there is no definition.
pub fn survive(text: &[u8], time: f64) -> bool {
    let script = parse_script("f", text);
    let lines = 1 + text.iter().filter(|b| matches!(b, b'\n' | b'\r')).count();
    for diagnostic in &script.diagnostics {
        assert!((1..=lines as u32).contains(&diagnostic.line));
        assert!(diagnostic.column >= 1);
        assert!(diagnostic.to_string().starts_with("f:"));
    }
    for shader in &script.shaders {
        assert!(!shader.name.is_empty());
        use_everything(shader, time);
    }
    let library = Library::new([("f", text)]);
    assert_eq!(
        library.definitions().len(),
        if script.dropped.is_some() {
            0
        } else {
            script.shaders.len()
        }
    );
    !script.shaders.is_empty()
}

/// Calls everything that takes a material.
fn use_everything(shader: &Shader, time: f64) {
    let _ = shader.sort_value();
    let _ = shaderscript::collapse(shader);
    let _ = shaderscript::collapse_vertex_light(shader, false);
    let context = eval::ColorContext {
        time: shader.shader_time(time, 0.0, 0.0),
        ..eval::ColorContext::default()
    };
    for stage in &shader.stages {
        assert!(stage.image.frame(time) < stage.image.names().len().max(1));
        let _ = eval::vertex_color(stage, &context, Vec3::ONE, Vec3::Z, [1, 2, 3, 4]);
        let st = eval::tex_coord(
            &stage.tc_gen,
            Vec2::ONE,
            Vec2::ZERO,
            Vec3::ONE,
            Vec3::Z,
            Vec3::X,
        );
        let _ = eval::apply_tc_mods(&stage.tc_mods, st, Vec3::ONE, time, Vec2::ONE);
    }
    for count in [0, 3, 4, 9] {
        let vertex = eval::DeformVertex {
            position: Vec3::new(count as f32, 2.0, 3.0),
            normal: Vec3::Z,
            st: Vec2::ONE,
            color: [255; 4],
        };
        let mut vertices = vec![vertex; count];
        let mut indices: Vec<u32> = (0..count as u32 / 3 * 3).collect();
        eval::deform(
            &shader.deforms,
            &mut vertices,
            &mut indices,
            &eval::DeformContext {
                time,
                texts: &[b"some", b"text", b"", b"\xff\0x"],
                ..eval::DeformContext::default()
            },
        );
        assert!(indices.iter().all(|&i| (i as usize) < vertices.len()));
    }
}
