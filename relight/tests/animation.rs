//! What moves in a material is an animation where one is asked for, and every value that it changes is in the document.

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use relight::export::{Export, ExportOptions, ExportReport, Format, ImageStore, Lightmaps, export};
use relight::{Materials, MemoryFiles, Options, RelitWorld};
use serde_json::Value;

const SCRIPT: &str = "
t/flame
{
surfaceparm trans
{
animMap 4 t/a.tga t/b.tga t/c.tga
blendFunc add
rgbGen wave sin 0.5 0.5 0 2
}
}
t/water
{
surfaceparm nolightmap
{
map t/a.tga
tcMod turb 0 0.1 0 0.5
}
}
t/lamp
{
{
map $lightmap
}
{
map t/a.tga
blendFunc filter
}
{
map t/b.tga
blendFunc add
rgbGen wave square 0.5 0.5 0 1
}
}
t/wheel
{
surfaceparm nolightmap
{
map t/a.tga
tcMod rotate 90
}
}
t/rest
{
surfaceparm nolightmap
{
map t/a.tga
rgbGen const ( 0.5 0.5 0.5 )
}
}
";

fn tga(grey: u8) -> Vec<u8> {
    let header = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 4, 0, 24, 0x20];
    [&header[..], &[grey; 48]].concat()
}

fn write(animate: bool, lightmaps: Lightmaps) -> (Value, Vec<u8>, ExportReport) {
    let mut files = MemoryFiles::new();
    files.insert("scripts/t.shader", SCRIPT).unwrap();
    for (name, grey) in [("a", 60), ("b", 120), ("c", 180)] {
        files.insert(&format!("t/{name}.tga"), tga(grey)).unwrap();
    }
    let mut map = MapBuilder::new();
    for (i, name) in ["t/flame", "t/water", "t/lamp", "t/wheel", "t/rest"]
        .iter()
        .enumerate()
    {
        let shader = map.add_shader(name, 0, 1);
        let z = 16.0 * i as f32;
        let corners = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)];
        map.add_quad(shader, corners.map(|(x, y)| Vec3::new(x, y, z)));
    }
    let (materials, _) = Materials::load(&files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = RelitWorld::from_bsp(&files, &materials, "maps/t.bsp", map.build(), options);
    let folder = tempfile::tempdir().unwrap();
    let source = Export {
        world: &world,
        files: &files,
        materials: &materials,
        images: &ImageStore::default(),
        options: ExportOptions {
            animate,
            lightmaps,
            ..ExportOptions::default()
        },
    };
    let path = folder.path().join("t.gltf");
    let report = export(&source, Format::Gltf, &path).unwrap();
    let document = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let data = std::fs::read(path.with_extension("bin")).unwrap();
    (document, data, report)
}

/// The floats of an accessor.
fn floats(document: &Value, data: &[u8], accessor: &Value) -> Vec<f32> {
    let accessor = &document["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let begin = view["byteOffset"].as_u64().unwrap() + accessor["byteOffset"].as_u64().unwrap();
    let width = match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        other => panic!("{other}"),
    };
    let count = accessor["count"].as_u64().unwrap() * width;
    let bytes = &data[begin as usize..][..count as usize * 4];
    let words = bytes.as_chunks::<4>().0.iter();
    words.map(|b| f32::from_le_bytes(*b)).collect()
}

/// An animated value.
#[derive(Debug)]
struct Animated {
    material: String,
    /// End of the pointer.
    property: String,
    interpolation: String,
    times: Vec<f32>,
    values: Vec<f32>,
}

/// All animated values.
fn animated(document: &Value, data: &[u8]) -> Vec<Animated> {
    let mut out = Vec::new();
    for animation in document["animations"].as_array().into_iter().flatten() {
        for channel in animation["channels"].as_array().unwrap() {
            assert_eq!(channel["target"]["path"], "pointer");
            let pointer = &channel["target"]["extensions"]["KHR_animation_pointer"]["pointer"];
            let pointer = pointer.as_str().unwrap();
            let value = document.pointer(pointer);
            let value = value.unwrap_or_else(|| panic!("{pointer} is not in the document"));
            let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
            let times = floats(document, data, &sampler["input"]);
            let values = floats(document, data, &sampler["output"]);
            let width = value.as_array().map_or(1, Vec::len);
            assert_eq!(values.len(), times.len() * width, "{pointer}");
            assert!(times.is_sorted() && times[0] == 0.0, "{pointer}");
            let number: usize = pointer.split('/').nth(2).unwrap().parse().unwrap();
            let name = document["materials"][number]["name"].as_str().unwrap();
            out.push(Animated {
                material: name.to_owned(),
                property: pointer.rsplit('/').next().unwrap().to_owned(),
                interpolation: sampler["interpolation"]
                    .as_str()
                    .unwrap_or("LINEAR")
                    .to_owned(),
                times,
                values,
            });
        }
    }
    out
}

#[test]
fn nothing_moves_unless_that_is_asked_for() {
    let (document, _, report) = write(false, Lightmaps::Vertices);
    assert!(document.get("animations").is_none());
    let printed = report.warnings.join("\n");
    for part in ["follow each other", "brightness changes", "wobbles"] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
}

#[test]
fn films_waves_and_wobbles_are_animated() {
    let (document, data, report) = write(true, Lightmaps::Vertices);
    let all = animated(&document, &data);
    let find = |material: &str, property: &str| {
        let mut all = all.iter();
        let found = all.find(|a| a.material == material && a.property == property);
        found.unwrap_or_else(|| panic!("{material} {property}"))
    };
    let film = find("t/flame", "offset");
    assert_eq!(
        (film.interpolation.as_str(), film.times.as_slice()),
        ("STEP", &[0.0, 0.25, 0.5, 0.75][..])
    );
    let steps: Vec<f32> = film.values.chunks(2).map(|v| v[0]).collect();
    assert!((steps[1] - steps[0] - 1.0 / 3.0).abs() < 1e-5, "{steps:?}");
    assert_eq!(steps[3], steps[0]);
    let wave = find("t/flame", "baseColorFactor");
    assert_eq!(
        (wave.interpolation.as_str(), wave.times.last()),
        ("LINEAR", Some(&0.5))
    );
    let red: Vec<f32> = wave.values.chunks(4).map(|v| v[0]).collect();
    assert!(
        red.iter().any(|v| *v > 0.95) && red.iter().any(|v| *v < 0.05),
        "{red:?}"
    );
    let sway = find("t/water", "offset");
    assert_eq!(sway.times.last(), Some(&2.0));
    assert!(sway.values.iter().all(|v| v.abs() < 0.11), "{sway:?}");
    assert!(sway.values.iter().any(|v| *v > 0.09), "{sway:?}");
    assert_eq!(find("t/wheel", "rotation").times.last(), Some(&4.0));
    assert!(all.iter().all(|a| a.material != "t/rest"));
    let printed = report.warnings.join("\n");
    assert!(!printed.contains("flame: stage 0"), "{printed}");
    assert!(printed.contains("sways as a whole"), "{printed}");
    // its glow is part of the picture that the lightmap's light is in
    assert!(
        printed.contains("t/lamp: stage 2: its brightness changes"),
        "{printed}"
    );
}

#[test]
fn a_glow_of_its_own_pulses_where_materials_are_lit() {
    let (document, data, report) = write(true, Lightmaps::Keep);
    let all = animated(&document, &data);
    let lamp: Vec<_> = all.iter().filter(|a| a.material == "t/lamp").collect();
    assert_eq!(lamp.len(), 1, "{all:?}");
    assert_eq!(lamp[0].property, "emissiveFactor");
    let material = document["materials"].as_array().unwrap();
    let material = material.iter().find(|m| m["name"] == "t/lamp").unwrap();
    let strength = &material["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"];
    let strength = strength.as_f64().unwrap() as f32;
    let glow: Vec<f32> = lamp[0].values.iter().map(|v| v * strength).collect();
    // on half of the time: twice its mean, then nothing
    assert!(
        glow.iter()
            .all(|v| (v - 2.0).abs() < 0.05 || v.abs() < 0.05),
        "{glow:?}"
    );
    assert!(lamp[0].values.iter().all(|v| (0.0..=1.0).contains(v)));
    let printed = report.warnings.join("\n");
    assert!(!printed.contains("t/lamp: stage 2"), "{printed}");
}
