//! What a renderer holds over many changes of map: its own objects, and the memory of its process.
//!
//! Without a device each test is skipped; with `RELIGHT_REQUIRE_GPU=1` it fails.

use std::fmt::Write as _;
use std::sync::{Arc, Mutex, PoisonError};

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use relight::MemoryFiles;
use renderer_vk::api::RefDef;
use renderer_vk::{Look, MapLightChoice, Renderer, RendererOptions, Settings, TracerChoice};

/// Materials of a map, each a room.
const MATERIALS: usize = 4;

/// The process's memory is that of all tests, so they take turns.
static TURN: Mutex<()> = Mutex::new(());

/// Factors of `blendFunc`, source and target.
const SOURCES: [&str; 5] = [
    "GL_ONE",
    "GL_DST_COLOR",
    "GL_SRC_ALPHA",
    "GL_ONE_MINUS_DST_COLOR",
    "GL_ONE_MINUS_SRC_ALPHA",
];
const TARGETS: [&str; 5] = [
    "GL_ZERO",
    "GL_ONE",
    "GL_SRC_COLOR",
    "GL_ONE_MINUS_SRC_COLOR",
    "GL_SRC_ALPHA",
];
const COORDINATES: [&str; 4] = [
    "",
    "tcMod scroll 0.1 0",
    "tcGen environment",
    "tcMod turb 0 0.1 0 0.3",
];

const ALPHA_TESTS: [&str; 3] = ["", "alphaFunc GT0", "alphaFunc GE128"];

/// An uncompressed TGA of one colour.
fn picture(side: u16, color: [u8; 4]) -> Vec<u8> {
    let [low, high] = side.to_le_bytes();
    let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    bytes.extend([low, high, low, high, 32, 8]);
    for _ in 0..u32::from(side) * u32::from(side) {
        bytes.extend(color);
    }
    bytes
}

/// Map `number` with materials and pictures that no other map has. What differs between materials of an index in two
/// maps makes other pipelines: 25 ways to blend, 4 of coordinates, 3 of alpha tests.
fn files(number: usize) -> MemoryFiles {
    let mut files = MemoryFiles::new();
    let mut script = String::new();
    let mut map = MapBuilder::new();
    for i in 0..MATERIALS {
        let state = number * MATERIALS + i;
        let blend = [SOURCES[state % 5], TARGETS[state / 5 % 5]].join(" ");
        let coordinates = COORDINATES[state / 25 % 4];
        let alpha = ALPHA_TESTS[state / 100 % 3];
        let name = format!("t/map{number}_{i}");
        let _ = write!(
            script,
            "{name} {{ {{ map {name}.tga\n rgbGen identity }}\n {{ map {name}.tga\n blendFunc {blend}\n {coordinates}\n {alpha}\n }} }}\n"
        );
        let side = 16 << (state % 4);
        let shade = (state * 5 % 256) as u8;
        files
            .insert(&format!("{name}.tga"), picture(side, [shade, 99, 200, 128]))
            .unwrap();
        let shader = map.add_shader(&name, 0, 0);
        let west = Vec3::X * 512.0 * i as f32;
        map.add_room(shader, west - 256.0, west + 256.0);
    }
    map.add_entity(&[
        ("classname", "light"),
        ("origin", "0 0 100"),
        ("light", "300"),
    ]);
    files.insert("scripts/t.shader", script).unwrap();
    files.insert("maps/t.bsp", map.build().write()).unwrap();
    files
}

/// What is held once a map has been shown.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// Pipelines of any kind: compiled so far, and held.
    compiled: u64,
    pipelines: u64,
    /// Bytes of the device's memory in use, and taken from the driver.
    used: u64,
    reserved: u64,
    /// Bytes of the process that no file backs; 0 where the system does not say.
    anonymous: u64,
    /// The device is a driver in software, whose compilers run in this process.
    software: bool,
}

/// Anonymous memory of this process, bytes.
fn anonymous() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("RssAnon:"));
    let kilobytes = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

/// Loads `count` maps one after the other, draws three frames of each, and returns what was held then; `None`, with a
/// printed line, without a device.
fn changes(settings: &Settings, count: usize) -> Option<Vec<Held>> {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let options = RendererOptions {
        validation: true,
        ..RendererOptions::headless(64, 48)
    };
    let mut renderer = testkit::device(Renderer::new(options))?;
    renderer.set_settings(settings);
    let mut held = Vec::new();
    for number in 0..count {
        renderer
            .begin_registration(Arc::new(files(number)), settings)
            .unwrap();
        renderer.load_world("maps/t.bsp").unwrap();
        renderer.end_registration();
        for frame in 0..3 {
            let def = RefDef {
                width: 64,
                height: 48,
                fov_x: 90.0,
                fov_y: 74.0,
                time_ms: 1000 + frame * 25,
                ..RefDef::default()
            };
            renderer.begin_frame(def.time_ms);
            renderer.clear_scene();
            renderer.render_scene(&def).unwrap();
            renderer.end_frame().unwrap();
        }
        let costs = renderer.costs();
        held.push(Held {
            compiled: renderer.compiled_pipelines(),
            pipelines: renderer.live_pipelines(),
            used: costs.memory.iter().map(|(_, bytes)| bytes).sum(),
            reserved: costs.reserved,
            anonymous: anonymous(),
            software: renderer.device_info().software,
        });
    }
    let messages = renderer.validation_messages();
    assert!(messages.is_empty(), "validation: {messages:#?}");
    Some(held)
}

/// Mean anonymous memory, megabytes.
fn megabytes(held: &[Held]) -> u64 {
    let bytes: u64 = held.iter().map(|h| h.anonymous).sum();
    (bytes / held.len() as u64) >> 20
}

/// Each of the later maps holds as many of the renderer's own objects as the first, and the last third of the maps at
/// most `growth` megabytes more than the first third after `warm` maps.
fn assert_flat(held: &[Held], warm: usize, growth: u64) {
    let [first, rest @ ..] = held else {
        panic!("no map was loaded");
    };
    for (number, map) in rest.iter().enumerate() {
        let number = number + 1;
        assert!(
            map.pipelines <= first.pipelines + MATERIALS as u64,
            "map {number}: {map:?}, at first {first:?}"
        );
        assert!(
            map.used <= first.used + (4 << 20) && map.reserved <= first.reserved,
            "map {number}: {map:?}, at first {first:?}"
        );
    }
    let third = (held.len() - warm) / 3;
    let early = megabytes(&held[warm..warm + third]);
    let late = megabytes(&held[held.len() - third..]);
    println!("anonymous memory: {early} MB, then {late} MB");
    assert!(late <= early + growth, "{early} MB became {late} MB");
}

#[test]
fn classic_maps_hold_no_more_after_sixty_than_after_a_few() {
    let Some(held) = changes(&Settings::full_size(), 60) else {
        return;
    };
    // a driver's pipeline for draws takes 3 MB of Mesa's software driver: kept ones make it 300 MB
    assert_flat(&held, 3, 40);
}

#[test]
fn traced_maps_share_the_passes() {
    let settings = Settings {
        rt: Look::Traced,
        rt_tracer: TracerChoice::Compute,
        rt_lights: MapLightChoice::Prior,
        ..Settings::full_size()
    };
    let Some(held) = changes(&settings, 15) else {
        return;
    };
    assert_flat(&held, 3, 40);
    // Mesa's compiler frees some 400 MB when it is done, which are to go back to the system
    let most = held.iter().map(|h| h.anonymous >> 20).max();
    assert!(!held[0].software || most < Some(500), "{most:?} MB");
    // what a map's materials need, and none of the passes, which are 35 for the first map
    for (number, maps) in held.windows(2).enumerate() {
        let compiled = maps[1].compiled - maps[0].compiled;
        let number = number + 1;
        assert!(
            compiled <= 2 * MATERIALS as u64,
            "map {number} compiled {compiled} pipelines"
        );
    }
}
