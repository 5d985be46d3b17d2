//! What packs and files by hand state about reflection is in the files that are written.

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use relight::export::{
    Export, ExportOptions, ExportReport, Format, ImagePlace, ImageStore, Lightmaps, export,
};
use relight::{Materials, MemoryFiles, Options, RelitWorld};
use serde_json::{Value, json};
use std::collections::BTreeMap;

const NAMES: [&str; 16] = [
    "bare", "rough", "dull", "metal", "mirror", "faint", "glass", "beside", "surface", "scaled",
    "grey", "missing", "plain", "grate", "frosted", "lamp",
];

const LINES: &str = "
rough t/rough 0.25
rough t/dull 0.5 0.01
metal t/metal
mirror t/mirror 0.9 0.8 0.7
mirror t/faint 0.1 0.2 0.1
glass t/glass 1.4 0.9 1 0.9
surface t/surface t/packed
rough t/surface 0.5
normals t/scaled t/beside_n 2
surface t/missing t/nothing
rough t/missing 0.75
plain t/plain
normals t/grate t/beside_n
metal t/grate 0.5
glass t/frosted 1.5 1 1 1
rough t/frosted 0.3
glow t/lamp t/lit 6
glow t/rough t/nothing
";

const SCRIPT: &str = "
t/plain
{
{
map t/image
}
{
map t/image
tcGen environment
blendFunc add
}
}
t/grate
{
{
map t/image
alphaFunc GE128
tcMod scale 2 3
}
}
";

/// A TGA of one colour (RGBA).
fn tga([r, g, b, a]: [u8; 4]) -> Vec<u8> {
    let header = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 4, 0, 32, 8];
    [&header[..], &[b, g, r, a].repeat(16)].concat()
}

/// A file that was written, and those beside it.
struct Written {
    folder: tempfile::TempDir,
    report: ExportReport,
}

fn write(format: Format, options: ExportOptions) -> Written {
    let mut files = MemoryFiles::new();
    files.insert("scripts/t.shader", SCRIPT).unwrap();
    files.insert("scripts/t.materials", LINES).unwrap();
    let mut image = |name: &str, color| files.insert(&format!("t/{name}.tga"), tga(color)).unwrap();
    for name in NAMES.iter().chain(&["image"]) {
        image(name, [100, 120, 140, 255]);
    }
    image("beside_n", [166, 77, 239, 255]);
    image("beside_s", [188, 188, 188, 204]);
    image("grey_n", [128, 128, 128, 255]);
    image("lit", [188, 188, 0, 255]);
    image("packed", [255, 128, 64, 255]);
    let mut map = MapBuilder::new();
    for (i, name) in NAMES.iter().enumerate() {
        let shader = map.add_shader(&format!("t/{name}"), 0, 1);
        let z = 16.0 * i as f32;
        let corners = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)];
        map.add_quad(shader, corners.map(|(x, y)| Vec3::new(x, y, z)));
    }
    let (materials, _) = Materials::load(&files);
    let load = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = RelitWorld::from_bsp(&files, &materials, "maps/t.bsp", map.build(), load);
    let source = Export {
        world: &world,
        files: &files,
        materials: &materials,
        images: &ImageStore::default(),
        options,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("t.{}", format.extension()));
    let report = export(&source, format, &path).unwrap();
    Written { folder, report }
}

impl Written {
    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.path().join(name)).unwrap()
    }
}

fn lit() -> ExportOptions {
    ExportOptions {
        lightmaps: Lightmaps::Strip,
        ..ExportOptions::default()
    }
}

/// Materials of a document by the ends of their names.
fn materials(document: &Value) -> BTreeMap<&str, &Value> {
    let all = document["materials"].as_array().unwrap().iter();
    let named = all.filter_map(|m| Some((m["name"].as_str()?.strip_prefix("t/")?, m)));
    named.collect()
}

#[track_caller]
fn near(value: &Value, expected: &[f64]) {
    let values: Vec<f64> = match value {
        Value::Array(all) => all.iter().map(|v| v.as_f64().unwrap()).collect(),
        one => vec![one.as_f64().unwrap()],
    };
    assert_eq!(values.len(), expected.len(), "{value}");
    for (a, b) in values.iter().zip(expected) {
        assert!((a - b).abs() < 1.0e-4, "{value}, not {expected:?}");
    }
}

#[test]
fn gltf_has_what_is_stated() {
    let written = write(Format::Glb, lit());
    let (_, _, images) = gltf::import(written.folder.path().join("t.glb")).unwrap();
    let bytes = written.read("t.glb");
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let stored: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let found = materials(&stored);
    assert_eq!(found.len(), NAMES.len());
    let base = |name: &str, key: &str| &found[name]["pbrMetallicRoughness"][key];
    let extension = |name: &str, key: &str| &found[name]["extensions"][key];
    let specular = |name: &str| extension(name, "KHR_materials_specular");
    let texel = |texture: &Value| {
        let texture = texture["index"].as_u64().unwrap() as usize;
        let image = stored["textures"][texture]["source"].as_u64().unwrap() as usize;
        let pixels = &images[image].pixels;
        [pixels[0], pixels[1], pixels[2]]
    };

    for name in ["bare", "plain"] {
        near(base(name, "roughnessFactor"), &[1.0]);
        assert_eq!(specular(name), &json!({"specularFactor": 0.0}));
        near(&extension(name, "KHR_materials_ior")["ior"], &[1.0]);
        assert_eq!(found[name]["normalTexture"], Value::Null);
    }
    assert_eq!(
        found["bare"]["extras"]["material"]["reflection"],
        Value::Null
    );
    let stated = &found["dull"]["extras"]["material"]["reflection"];
    near(&stated["roughness"], &[0.5]);
    near(&stated["reflectance"], &[0.01; 3]);

    near(base("rough", "roughnessFactor"), &[0.25]);
    near(base("rough", "metallicFactor"), &[0.0]);
    assert_eq!(found["rough"]["extensions"], Value::Null);
    near(&specular("dull")["specularColorFactor"], &[0.25; 3]);
    near(base("metal", "roughnessFactor"), &[0.3]);
    near(base("metal", "metallicFactor"), &[1.0]);
    assert_ne!(base("metal", "baseColorTexture"), &Value::Null);

    near(base("mirror", "metallicFactor"), &[1.0]);
    near(base("mirror", "roughnessFactor"), &[0.0]);
    near(base("mirror", "baseColorFactor"), &[0.9, 0.8, 0.7, 1.0]);
    assert_eq!(base("mirror", "baseColorTexture"), &Value::Null);
    near(base("faint", "metallicFactor"), &[0.0]);

    let transmission = extension("glass", "KHR_materials_transmission");
    near(&transmission["transmissionFactor"], &[1.0]);
    near(&extension("glass", "KHR_materials_ior")["ior"], &[1.4]);
    near(base("glass", "roughnessFactor"), &[0.0]);
    near(base("glass", "baseColorFactor"), &[0.9, 1.0, 0.9, 1.0]);
    assert_eq!(base("glass", "baseColorTexture"), &Value::Null);
    assert_eq!(found["glass"]["alphaMode"], Value::Null);

    near(base("frosted", "roughnessFactor"), &[0.3]);
    let strength = extension("lamp", "KHR_materials_emissive_strength");
    near(
        &strength["emissiveStrength"],
        &[6.0 * stored["asset"]["extras"]["exposure"].as_f64().unwrap()],
    );
    near(&found["lamp"]["emissiveFactor"], &[1.0; 3]);
    assert_eq!(texel(&found["lamp"]["emissiveTexture"]), [188, 188, 0]);

    // a map of reflectance: its smoothness of 204 is a roughness of 51
    near(base("beside", "roughnessFactor"), &[1.0]);
    near(base("beside", "metallicFactor"), &[0.0]);
    assert_eq!(texel(base("beside", "metallicRoughnessTexture"))[1], 51);
    near(&specular("beside")["specularColorFactor"], &[25.0; 3]);
    assert_eq!(texel(&specular("beside")["specularColorTexture"]), [188; 3]);
    // y of packs points down, of glTF up
    let [x, y, z] = texel(&found["beside"]["normalTexture"]);
    assert_eq!((x, y), (166, 178));
    assert!(z.abs_diff(239) <= 1, "{z}");

    // a line states roughness after the map: it is a factor
    near(base("surface", "roughnessFactor"), &[0.5]);
    near(base("surface", "metallicFactor"), &[1.0]);
    let packed = texel(base("surface", "metallicRoughnessTexture"));
    assert_eq!(packed, [255, 128, 64]);
    assert_eq!(specular("surface"), &Value::Null);

    let [x, y, z] = texel(&found["scaled"]["normalTexture"]);
    assert!(
        x.abs_diff(204) < 2 && y.abs_diff(26) < 2 && z < 150,
        "{x} {y} {z}"
    );
    assert_eq!(specular("scaled"), &json!({"specularFactor": 0.0}));

    near(base("missing", "roughnessFactor"), &[0.75]);
    near(base("missing", "metallicFactor"), &[0.0]);
    assert_eq!(base("missing", "metallicRoughnessTexture"), &Value::Null);
    assert_eq!(found["grey"]["normalTexture"], Value::Null);
    near(base("grate", "metallicFactor"), &[0.5]);
    assert_eq!(found["grate"]["alphaMode"], "MASK");
    // maps lie where the texture does
    let transform = &found["grate"]["normalTexture"]["extensions"]["KHR_texture_transform"];
    near(&transform["scale"], &[2.0, 3.0]);

    let warnings = &written.report.warnings;
    let about = |name: &str, text: &str| {
        let of = |w: &&String| w.starts_with(&format!("material t/{name}: "));
        let of: Vec<_> = warnings.iter().filter(of).collect();
        assert!(of.len() == 1 && of[0].contains(text), "{of:?}");
    };
    about("grey", "t/grey_n is no normal map");
    about("missing", "the map of roughness t/nothing is missing");
    about("rough", "the emissive map t/nothing is missing");
    about("faint", "mirrors 0.1 0.2 0.1 of the light; left out");
    about("plain", "a picture of the surroundings; left out");
    assert_eq!(warnings.len(), 5, "{warnings:?}");
    for name in [
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_materials_transmission",
    ] {
        let used = stored["extensionsUsed"].as_array().unwrap();
        assert!(used.contains(&json!(name)), "{name}");
    }
}

#[test]
fn images_of_reflection_lie_beside_or_are_left_out() {
    let written = write(
        Format::Gltf,
        ExportOptions {
            images: ImagePlace::Beside,
            ..lit()
        },
    );
    for name in [
        "beside_n",
        "beside_s_reflectance",
        "beside_s_roughness_0",
        "packed",
        "beside_n_scaled_2_2",
    ] {
        let path = written.folder.path().join(format!("images/t/{name}.png"));
        assert!(path.is_file(), "{}", path.display());
    }
    let none = ExportOptions {
        images: ImagePlace::None,
        ..lit()
    };
    let written = write(Format::Gltf, none);
    let document: Value = serde_json::from_slice(&written.read("t.gltf")).unwrap();
    let found = materials(&document);
    let base = |name: &str| &found[name]["pbrMetallicRoughness"];
    near(&base("surface")["roughnessFactor"], &[0.5]);
    near(&base("surface")["metallicFactor"], &[0.0]);
    near(&base("beside")["roughnessFactor"], &[1.0]);
    let missing = |w: &String| w.contains("missing") || w.contains("normal map");
    assert!(!written.report.warnings.iter().any(missing));
}

#[test]
fn materials_that_need_no_light_reflect_nothing() {
    let written = write(Format::Gltf, ExportOptions::default());
    let document: Value = serde_json::from_slice(&written.read("t.gltf")).unwrap();
    for (name, material) in materials(&document) {
        assert_eq!(
            material["extensions"],
            json!({"KHR_materials_unlit": {}}),
            "{name}"
        );
        near(&material["pbrMetallicRoughness"]["metallicFactor"], &[0.0]);
        assert_eq!(material["normalTexture"], Value::Null, "{name}");
    }
}

#[test]
fn mtl_has_roughness_metal_and_normals() {
    let written = write(Format::Obj, ExportOptions::default());
    let text = String::from_utf8(written.read("t.mtl")).unwrap();
    let entry = |name: &str| {
        let mut entries = text.split("newmtl ");
        let found = entries.find(|e| e.starts_with(&format!("t/{name}.")));
        found.unwrap().lines().skip(1).collect::<Vec<_>>()
    };
    assert!(entry("bare").contains(&"Ks 0 0 0"));
    assert!(!entry("bare").iter().any(|line| line.starts_with('P')));
    for line in ["Ks 0.04 0.04 0.04", "Pr 0.25", "Pm 0", "illum 2"] {
        assert!(entry("rough").contains(&line), "{line}");
    }
    assert!(entry("metal").contains(&"Pm 1"));
    assert!(entry("beside").contains(&"norm images/t/beside_n_up.png"));
    assert!(!entry("beside").iter().any(|line| line.starts_with('P')));
    let mapped = |w: &&String| w.contains("has a map of roughness");
    assert_eq!(written.report.warnings.iter().filter(mapped).count(), 2);
}
