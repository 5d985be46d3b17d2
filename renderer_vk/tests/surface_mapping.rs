//! Normal maps and highlights of the classic look (`r_normalMapping`, `r_specularMapping`), beside the closed form of
//! ioquake3's `opengl2` (`lightall_fp.glsl`).
//!
//! Without a device the test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use q3bsp::GridPoint;
use q3bsp::builder::MapBuilder;
use relight::{GameFiles, MemoryFiles, SearchPath};
use renderer_vk::api::RefDef;
use renderer_vk::{Renderer, RendererOptions, Settings};

/// Side of the picture, pixels.
const SIDE: usize = 64;
/// Distance of the wall from the camera, units.
const WALL: f32 = 256.0;
/// Values of the wall's texture and lightmap, of 255.
const TEXTURE: u8 = 200;
const BAKED: u8 = 100;
/// The normal map's texel, y down, and the map of reflection's: grey and smoothness.
const NORMAL: [u8; 3] = [166, 178, 238];
const GREY: u8 = 64;
const SMOOTHNESS: u8 = 128;
/// Angles of the grid's light, 1/256 turns.
const ANGLES: [u8; 2] = [43, 114];

fn byte(value: u8) -> f32 {
    f32::from(value) / 255.0
}

/// Brightness of the wall at `y` units to the left and `z` units above the middle, of 255.
fn expected(y: f32, z: f32, normals: bool, highlights: bool) -> f32 {
    let [longitude, latitude] = ANGLES.map(|angle| f32::from(angle) * TAU / 256.0);
    let light = Vec3::new(
        latitude.cos() * longitude.sin(),
        latitude.sin() * longitude.sin(),
        longitude.cos(),
    );
    let view = Vec3::new(-WALL, -y, -z).normalize();
    let flat = Vec3::NEG_X;
    let mut normal = flat;
    if normals {
        let [right, down] = [NORMAL[0], NORMAL[1]].map(|v| byte(v) * 2.0 - 1.0);
        let out = (1.0 - right * right - down * down).sqrt();
        normal = (Vec3::NEG_Y * right + Vec3::NEG_Z * down + flat * out).normalize();
    }
    let reflectance = if highlights { byte(GREY) } else { 0.0 };
    let (incidence, baked) = (normal.dot(light).max(0.0), flat.dot(light).max(0.0));
    let factor = 0.75 / baked.max(0.25);
    let scattered = factor * incidence + (1.0 - factor * baked).max(0.0);
    let half = (light + view).normalize();
    let roughness = (1.0 - byte(SMOOTHNESS)).powf(0.3);
    let alpha_squared = roughness.powi(4);
    let d = normal.dot(half).max(0.0).powi(2) * (alpha_squared - 1.0) + 1.0;
    let lobe = alpha_squared / (4.0 * d * d * view.dot(half).powi(2) * (roughness + 0.5));
    let shown =
        byte(TEXTURE) * (1.0 - reflectance) * scattered + reflectance * lobe * factor * incidence;
    255.0 * byte(BAKED) * shown
}

/// An uncompressed TGA image of one pixel.
fn pixel(rgba: [u8; 4]) -> Vec<u8> {
    square(1, |_, _| rgba)
}

/// The same of `side` x `side` pixels, from the bottom.
fn square(side: u8, rgba: impl Fn(u8, u8) -> [u8; 4]) -> Vec<u8> {
    let mut tga = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, side, 0, side, 0, 32, 8];
    for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
        let [red, green, blue, alpha] = rgba(x, y);
        tga.extend([blue, green, red, alpha]);
    }
    tga
}

fn files() -> MemoryFiles {
    let mut files = MemoryFiles::new();
    let [red, green, blue] = NORMAL;
    files.insert("maps/t.bsp", wall(1.0 / 64.0)).unwrap();
    files
        .insert("t/wall.tga", pixel([TEXTURE, TEXTURE, TEXTURE, 255]))
        .unwrap();
    files
        .insert("t/wall_n.tga", pixel([red, green, blue, 255]))
        .unwrap();
    files
        .insert("t/wall_s.tga", pixel([GREY, GREY, GREY, SMOOTHNESS]))
        .unwrap();
    files
}

/// A map with a wall before the camera. `scale`: texture coordinates for each unit.
fn wall(scale: f32) -> Vec<u8> {
    let mut map = MapBuilder::new();
    let (other, wall) = (
        map.add_shader("t/other", 0, 0),
        map.add_shader("t/wall", 0, 0),
    );
    map.add_room(other, Vec3::splat(-WALL - 64.0), Vec3::splat(WALL + 64.0));
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let surface = map.add_quad(wall, corners.map(|(y, z)| Vec3::new(1.0, y, z) * WALL));
    for vertex in map.vertices_mut(surface) {
        vertex.st = Vec2::new(-vertex.position.y, -vertex.position.z) * scale;
    }
    let page = map.add_lightmap([BAKED; 3]);
    map.set_lightmap(surface, page);
    let bsp = map.build_with_grid(Vec3::splat(64.0), |_| GridPoint {
        ambient: [20; 3],
        directed: [200; 3],
        longitude: ANGLES[0],
        latitude: ANGLES[1],
    });
    bsp.write()
}

/// Red of the picture with these settings, row by row from the top.
fn picture(renderer: &mut Renderer, settings: &Settings) -> Vec<u8> {
    load(renderer, Arc::new(files()), settings);
    shown(renderer)
}

fn load(renderer: &mut Renderer, files: Arc<dyn GameFiles>, settings: &Settings) {
    renderer.begin_registration(files, settings).unwrap();
    renderer.load_world("maps/t.bsp").unwrap();
    renderer.end_registration();
}

/// Red of a frame, row by row from the top.
fn shown(renderer: &mut Renderer) -> Vec<u8> {
    renderer.begin_frame(5000);
    renderer.clear_scene();
    let def = RefDef {
        width: SIDE as i32,
        height: SIDE as i32,
        fov_x: 90.0,
        fov_y: 90.0,
        ..RefDef::default()
    };
    renderer.render_scene(&def).unwrap();
    let picture = renderer.read_pixels().unwrap();
    renderer.end_frame().unwrap();
    picture.rgb.iter().step_by(3).copied().collect()
}

#[test]
fn normal_maps_and_highlights_are_those_of_opengl2() {
    let options = RendererOptions {
        validation: true,
        ..RendererOptions::headless(SIDE as u32, SIDE as u32)
    };
    let Some(mut renderer) = testkit::device(Renderer::new(options)) else {
        return;
    };
    for (normals, highlights) in [(false, false), (true, false), (false, true), (true, true)] {
        let settings = Settings {
            normal_mapping: normals,
            specular_mapping: highlights,
            map_overbright_bits: 0,
            ..Settings::full_size()
        };
        let shown = picture(&mut renderer, &settings);
        let at = |i: usize| WALL * ((i as f32 + 0.5) / (SIDE as f32 / 2.0) - 1.0);
        for (i, &value) in shown.iter().enumerate() {
            // 90 degrees: the picture is as wide as the wall
            let (y, z) = (-at(i % SIDE), -at(i / SIDE));
            let wanted = expected(y, z, normals, highlights);
            assert!(
                (f32::from(value) - wanted).abs() <= 1.5,
                "{i}: {value}, expected {wanted} ({normals}, {highlights})"
            );
        }
    }
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
}

#[test]
fn files_of_materials_are_read_again() {
    let options = RendererOptions::headless(SIDE as u32, SIDE as u32);
    let Some(mut renderer) = testkit::device(Renderer::new(options)) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let write = |path: &str, bytes: &[u8]| {
        let path = folder.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    };
    let made = files();
    for path in ["maps/t.bsp", "t/wall.tga", "t/wall_n.tga"] {
        write(path, &made.read(path).unwrap().unwrap());
    }
    let mut settings = Settings {
        map_overbright_bits: 0,
        ..Settings::full_size()
    };
    let open = || Arc::new(SearchPath::open(&[folder.path()]).unwrap());
    // without the settings nothing is read
    load(&mut renderer, open(), &settings);
    assert!(!renderer.read_by_hand_again().unwrap());
    settings.normal_mapping = true;
    load(&mut renderer, open(), &settings);
    let of_pack = shown(&mut renderer);
    // y of the line's map points up
    write("maps/t.materials", b"normals t/wall t/wall_n\n");
    assert!(renderer.read_by_hand_again().unwrap());
    let of_line = shown(&mut renderer);
    assert!(
        of_pack[0].abs_diff(of_line[0]) > 20,
        "{of_pack:?} {of_line:?}"
    );
}

/// Depth of the heights, and the alpha that they have everywhere.
const DEPTH: f32 = 0.25;
const HEIGHT: u8 = 128;

/// The wall with a texture of waves and heights. `stage`: how the script names the normal map.
fn waves(scale: f32, stage: &str) -> MemoryFiles {
    let mut files = MemoryFiles::new();
    files.insert("maps/t.bsp", wall(scale)).unwrap();
    let wave = |x: u8, y: u8| {
        let [x, y] = [x, y].map(|place| f32::from(place) * TAU / 64.0);
        (128.0 + 100.0 * (x * 2.0).sin() * (y * 3.0).cos()) as u8
    };
    let waves = square(64, |x, y| [wave(x, y), 0, 0, 255]);
    files.insert("t/wall.tga", waves).unwrap();
    (files.insert("t/heights.tga", pixel([128, 128, 255, HEIGHT]))).unwrap();
    (files.insert("t/flat.tga", pixel([128, 128, 255, 255]))).unwrap();
    let script = format!(
        "t/wall\n{{\n{{\nmap t/wall\n}}\n{{\n{stage}\nparallaxDepth {DEPTH}\n}}\n{{\nmap $lightmap\nblendFunc filter\n}}\n}}\n"
    );
    files.insert("scripts/t.shader", script).unwrap();
    files
}

#[test]
fn heights_move_the_texture_as_a_wall_farther_away_would_show_it() {
    let options = RendererOptions {
        validation: true,
        ..RendererOptions::headless(SIDE as u32, SIDE as u32)
    };
    let Some(mut renderer) = testkit::device(Renderer::new(options)) else {
        return;
    };
    let mut draw = |parallax_mapping, scale, stage: &str| {
        let settings = Settings {
            normal_mapping: true,
            parallax_mapping,
            map_overbright_bits: 0,
            ..Settings::full_size()
        };
        load(&mut renderer, Arc::new(waves(scale, stage)), &settings);
        shown(&mut renderer)
    };
    let greatest = |a: &[u8], b: &[u8]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap()
    };
    let heights = "stage normalParallaxMap\nmap t/heights";
    let (scale, below) = (1.0 / 512.0, 1.0 - byte(HEIGHT));
    let plain = draw(0, scale, heights);
    // `r_parallaxMapping 1` adds a step of 1/16
    for (mode, depth) in [(1, below + 1.0 / 16.0), (2, below)] {
        let moved = draw(mode, scale, heights);
        let farther = draw(0, scale + depth * DEPTH / WALL, heights);
        assert!(greatest(&plain, &moved) > 20, "{mode}");
        let error = greatest(&farther, &moved);
        assert!(error <= 3, "{mode}: {error}");
    }
    // maps without heights, and stages that state none
    for stage in [
        "stage normalParallaxMap\nmap t/flat",
        "stage normalMap\nmap t/heights",
    ] {
        assert_eq!(draw(2, scale, stage), plain, "{stage}");
    }
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
}
