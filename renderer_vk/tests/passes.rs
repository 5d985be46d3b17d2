//! Passes of a material that one draw does, beside the same passes one after the other, in a whole renderer without a
//! window. `r_measureOverdraw` counts passes, so with it each is a draw of its own.
//!
//! Without a device each test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

use std::fmt::Write as _;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use relight::MemoryFiles;
use renderer_vk::api::{Picture, RefDef};
use renderer_vk::{Renderer, RendererOptions, Settings};

/// Panels in a row and in a column of the wall that is drawn.
const ROW: usize = 10;
/// Side of a panel: of the map, and in the picture.
const UNITS: f32 = 20.0;
const PIXELS: usize = 16;

const SOURCES: [&str; 9] = [
    "GL_ONE",
    "GL_ZERO",
    "GL_DST_COLOR",
    "GL_ONE_MINUS_DST_COLOR",
    "GL_SRC_ALPHA",
    "GL_ONE_MINUS_SRC_ALPHA",
    "GL_DST_ALPHA",
    "GL_ONE_MINUS_DST_ALPHA",
    "GL_SRC_ALPHA_SATURATE",
];
const TARGETS: [&str; 8] = [
    "GL_ONE",
    "GL_ZERO",
    "GL_SRC_ALPHA",
    "GL_ONE_MINUS_SRC_ALPHA",
    "GL_DST_ALPHA",
    "GL_ONE_MINUS_DST_ALPHA",
    "GL_SRC_COLOR",
    "GL_ONE_MINUS_SRC_COLOR",
];

/// Materials of several passes: every way to blend a second one, with a third over it, and all else that passes may
/// differ in.
fn materials() -> Vec<String> {
    let pairs = SOURCES.iter().flat_map(|s| TARGETS.map(|t| (s, t)));
    // another alpha than the first stage's, so that they are not joined to one pass
    let three = |(source, target): (&&str, &str)| {
        format!(
            "{{ map t/a.tga }}\n{{ map t/b.tga\nblendFunc {source} {target}\nalphaGen const 0.6 }}\n\
             {{ map t/a.tga\nblendFunc add\nrgbGen const ( 0.3 0.2 0.1 ) }}"
        )
    };
    let mut bodies: Vec<String> = pairs.map(three).collect();
    let others = [
        // holes, shared by what asks for the first pass's depth
        "{ map t/a.tga\nalphaFunc GE128\ndepthWrite }\n{ map t/b.tga\nblendFunc filter\ndepthFunc equal }",
        "{ map t/a.tga\nalphaFunc GE128 }\n{ map t/b.tga\nblendFunc filter }",
        // holes of later passes
        "{ map t/a.tga }\n{ map t/b.tga\nblendFunc filter\nalphaFunc GE128 }",
        "{ map t/a.tga }\n{ map t/b.tga\nalphaFunc LT128 }\n{ map t/b.tga\nblendFunc add\nalphaFunc GT0 }",
        // overwritten
        "{ map t/a.tga }\n{ map t/b.tga\ntcGen environment\nrgbGen oneMinusVertex }\n{ map t/a.tga\nblendFunc add }\n\
         { map $lightmap\nblendFunc GL_DST_COLOR GL_ONE_MINUS_SRC_ALPHA }",
        // two stages in the first pass
        "{ map $lightmap }\n{ map t/a.tga\nblendFunc filter }\n{ map t/b.tga\nblendFunc GL_DST_COLOR GL_SRC_COLOR\n\
         tcMod scale 8 8\ndetail }",
        "{ map t/a.tga }\n{ map t/b.tga\nblendFunc add }\n{ map $lightmap\nblendFunc filter }\n\
         { map t/b.tga\nblendFunc add\ntcMod scroll 0.3 0.1\n}",
        // more than one draw takes
        "{ map $lightmap }\n{ map t/a.tga\nblendFunc filter }\n{ map t/b.tga\nblendFunc add }\n\
         { map t/b.tga\nblendFunc filter }\n{ map t/a.tga\nblendFunc blend }\n{ map t/b.tga\nblendFunc add\nrgbGen vertex }",
        // colours and coordinates of each vertex and of a time
        "{ map t/a.tga\nrgbGen exactVertex }\n{ map t/b.tga\nblendFunc blend\nrgbGen vertex\nalphaGen vertex }\n\
         { map t/a.tga\nblendFunc add\nrgbGen wave sin 0.3 0.2 0 1\ntcMod turb 0 0.2 0 1\n}",
        "{ map t/a.tga\nalphaGen lightingSpecular }\n{ map t/b.tga\nblendFunc GL_DST_COLOR GL_SRC_ALPHA\n\
         alphaGen lightingSpecular }",
        // blended over what is behind, and over the result
        "{ map t/a.tga\nblendFunc blend }\n{ map t/b.tga\nblendFunc filter }",
        // through everything
        "{ map t/a.tga }\n{ map t/b.tga\nblendFunc filter\ndepthFunc disable }\n{ map t/b.tga\nblendFunc add }",
        "polygonOffset\n{ map t/a.tga }\n{ map t/b.tga\nblendFunc filter }\n{ map t/b.tga\nblendFunc add }",
        "deformVertexes wave 20 sin 0 1 0 1\n{ map t/a.tga }\n{ map t/b.tga\nblendFunc filter\ntcMod rotate 40\n}",
    ];
    bodies.extend(others.map(str::to_owned));
    assert!(bodies.len() <= ROW * ROW);
    bodies
}

/// A picture of 64 x 64 whose channels, alpha among them, run through all their values.
fn image(channel: impl Fn(usize, usize) -> [usize; 4]) -> Vec<u8> {
    let mut file = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 64, 0, 64, 0, 32, 8];
    for at in 0..64 * 64 {
        file.extend(channel(at % 64, at / 64).map(|v| (v % 256) as u8));
    }
    file
}

/// The wall of panels, a material each.
fn renderer() -> Option<Renderer> {
    let side = (ROW * PIXELS) as u32;
    let options = RendererOptions {
        validation: true,
        ..RendererOptions::headless(side, side)
    };
    let mut renderer = testkit::device(Renderer::new(options))?;
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    map.add_room(wall, Vec3::splat(-256.0), Vec3::splat(256.0));
    let page = map.add_lightmap_with(|x, y| [2 * x as u8, 2 * y as u8, (x + y) as u8]);
    let mut script = String::from("t/wall { { map $whiteimage\nrgbGen const ( 0.4 0.5 0.6 ) } }\n");
    for (at, body) in materials().iter().enumerate() {
        let _ = writeln!(script, "t/{at} {{\n{body}\n}}");
        let shader = map.add_shader(&format!("t/{at}"), 0, 0);
        let corner = |x: usize, y: usize| {
            let place = Vec2::new((at % ROW + x) as f32, (at / ROW + y) as f32);
            let [right, down] = (UNITS * (place - ROW as f32 / 2.0)).to_array();
            Vec3::new(UNITS * ROW as f32 / 2.0, -right, -down)
        };
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
        let panel = map.add_quad(shader, corners.map(|(x, y)| corner(x, y)));
        for (vertex, (x, y)) in map.vertices_mut(panel).iter_mut().zip(corners) {
            vertex.st = Vec2::new(x as f32, y as f32);
            vertex.lightmap = vertex.st;
            vertex.color = [250 * x as u8, 250 * y as u8, 120, 30 + 200 * x as u8];
        }
        map.set_lightmap(panel, page);
    }
    let mut files = MemoryFiles::new();
    files.insert("scripts/t.shader", script).unwrap();
    let pictures = [
        (
            "t/a.tga",
            image(|x, y| [4 * x, 4 * y, 255 - 2 * (x + y), 4 * (63 - x)]),
        ),
        (
            "t/b.tga",
            image(|x, y| [4 * y, 255 - 4 * x, 16 * (x % 16), 4 * y]),
        ),
    ];
    for (name, picture) in pictures {
        files.insert(name, picture).unwrap();
    }
    files.insert("maps/t.bsp", map.build().write()).unwrap();
    let files = Arc::new(files);
    renderer
        .begin_registration(files, &Settings::full_size())
        .unwrap();
    renderer.load_world("maps/t.bsp").unwrap();
    renderer.end_registration();
    Some(renderer)
}

/// A frame, and the draws that it took.
fn frame(renderer: &mut Renderer, settings: &Settings) -> (Picture, u32) {
    let side = (ROW * PIXELS) as i32;
    renderer.set_settings(settings);
    renderer.begin_frame(5300);
    renderer.clear_scene();
    let def = RefDef {
        width: side,
        height: side,
        fov_x: 90.0,
        fov_y: 90.0,
        time_ms: 5300,
        ..RefDef::default()
    };
    renderer.render_scene(&def).unwrap();
    let draws = renderer.end_frame().unwrap().draws;
    (renderer.read_pixels().unwrap(), draws)
}

#[test]
fn passes_drawn_together_look_as_one_after_the_other() {
    let Some(mut renderer) = renderer() else {
        return;
    };
    let together = Settings::full_size();
    let alone = Settings {
        measure_overdraw: true,
        ..Settings::full_size()
    };
    let (expected, many) = frame(&mut renderer, &alone);
    let (picture, few) = frame(&mut renderer, &together);
    // of each pair's three passes two
    let pairs = (SOURCES.len() * TARGETS.len()) as u32;
    assert!(few + 2 * pairs <= many, "{few} {many}");
    let mut steps = [0; 256];
    for (a, b) in expected.rgb.iter().zip(&picture.rgb) {
        steps[usize::from(a.abs_diff(*b))] += 1;
    }
    let all = picture.rgb.len();
    println!(
        "{many} draws, {few} together; of {all} values {:?} off",
        &steps[..8]
    );
    // Drivers in software blend in steps of 255, as the shader does. GPUs round once for each pass: a source and two
    // products that are rounded before make two steps at most, in each of three passes.
    let (most, differing) = match renderer.device_info().software {
        true => (1, all / 1000),
        false => (6, all),
    };
    assert_eq!(steps[most + 1..].iter().sum::<usize>(), 0, "{steps:?}");
    assert!(all - steps[0] <= differing, "{steps:?}");
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
}

#[test]
fn what_is_registered_is_compiled_before_it_is_seen() {
    let Some(mut renderer) = renderer() else {
        return;
    };
    let ahead = renderer.compiled_pipelines();
    assert!(ahead > 20, "{ahead}");
    frame(&mut renderer, &Settings::full_size());
    assert_eq!(renderer.compiled_pipelines(), ahead);
    // and the count includes pipelines that were not predicted
    let unforeseen = Settings {
        measure_overdraw: true,
        ..Settings::full_size()
    };
    frame(&mut renderer, &unforeseen);
    assert!(renderer.compiled_pipelines() > ahead);
}
