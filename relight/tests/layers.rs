//! Stages weighted by vertex alpha are in exports as layers over the rest of their material, and surfaces that lie on
//! others rise from them.

use glam::Vec3;
use q3bsp::builder::MapBuilder;
use relight::export::{Export, ExportOptions, ExportReport, Format, ImageStore, Lightmaps, export};
use relight::{Materials, MemoryFiles, Options, RelitWorld};
use std::path::PathBuf;

/// Alpha of the corners of the two squares: the second is not covered anywhere.
const ALPHA: [u8; 8] = [255, 200, 130, 64, 0, 0, 0, 0];
const SIDE: f32 = 128.0;

/// Two squares on the floor, with `stages` between the rock and the light.
fn files(stages: &str, lightmapped: bool) -> MemoryFiles {
    let script = format!(
        "t/terrain\n{{\n{{\nmap t/rock.tga\n}}\n{stages}\n{{\nmap $lightmap\nblendFunc filter\n}}\n}}\n"
    );
    let mut map = MapBuilder::new();
    let terrain = map.add_shader("t/terrain", 0, 0);
    let page = map.add_lightmap([40; 3]);
    for (square, alphas) in ALPHA.chunks(4).enumerate() {
        let x = square as f32 * 2.0 * SIDE;
        let corner = |i: f32, j: f32| Vec3::new(x + i * SIDE, j * SIDE, 8.0);
        let corners = [
            corner(0.0, 0.0),
            corner(0.0, 1.0),
            corner(1.0, 1.0),
            corner(1.0, 0.0),
        ];
        let surface = map.add_quad(terrain, corners);
        for (vertex, &alpha) in map.vertices_mut(surface).iter_mut().zip(alphas) {
            vertex.color = [20, 20, 20, alpha];
        }
        if lightmapped {
            map.set_lightmap(surface, page);
        }
    }
    let mut files = MemoryFiles::new();
    files.insert("maps/t.bsp", map.build().write()).unwrap();
    files.insert("scripts/t.shader", script).unwrap();
    for (name, color) in [
        ("rock", [60, 60, 60]),
        ("grass", [30, 90, 20]),
        ("mud", [80, 50, 30]),
    ] {
        let head = [0u8, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0];
        let image = [&head[..], &color].concat();
        files.insert(&format!("t/{name}.tga"), image).unwrap();
    }
    files
}

struct Written {
    folder: tempfile::TempDir,
    path: PathBuf,
    report: ExportReport,
}

fn write(files: &MemoryFiles, format: Format, lightmaps: Lightmaps) -> Written {
    let (materials, _) = Materials::load(files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = RelitWorld::load(files, &materials, "maps/t.bsp", options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("t.{}", format.extension()));
    let source = Export {
        world: &world,
        files,
        materials: &materials,
        images: &ImageStore::default(),
        options: ExportOptions {
            lightmaps,
            scale: 1.0,
            ..ExportOptions::default()
        },
    };
    let report = export(&source, format, &path).unwrap();
    Written {
        folder,
        path,
        report,
    }
}

/// A primitive of a glTF.
struct Drawn {
    material: String,
    mode: gltf::material::AlphaMode,
    cutoff: Option<f32>,
    image: Option<String>,
    triangles: usize,
    heights: Vec<f32>,
    colors: Vec<[u8; 4]>,
    lightmapped: bool,
}

fn read(written: &Written) -> Vec<Drawn> {
    let (document, buffers, _) = gltf::import(&written.path).unwrap();
    let mut out = Vec::new();
    for primitive in document.meshes().flat_map(|m| m.primitives()) {
        let reader = primitive.reader(|b| buffers.get(b.index()).map(|d| &d.0[..]));
        let material = primitive.material();
        let color = material.pbr_metallic_roughness().base_color_texture();
        out.push(Drawn {
            material: material.name().unwrap().to_owned(),
            mode: material.alpha_mode(),
            cutoff: material.alpha_cutoff(),
            image: color.and_then(|c| Some(c.texture().source().name()?.to_owned())),
            triangles: reader.read_indices().unwrap().into_u32().count() / 3,
            heights: reader.read_positions().unwrap().map(|p| p[1]).collect(),
            colors: (reader.read_colors(0)).map_or(Vec::new(), |c| c.into_rgba_u8().collect()),
            lightmapped: reader.read_tex_coords(1).is_some(),
        });
    }
    out
}

const GRASS: &str =
    "{\nmap t/grass.tga\nblendFunc GL_SRC_ALPHA GL_ONE_MINUS_SRC_ALPHA\nalphaGen vertex\n}";

#[track_caller]
fn alphas(drawn: &Drawn) -> Vec<u8> {
    let mut all: Vec<u8> = drawn.colors.iter().map(|c| c[3]).collect();
    all.sort_unstable();
    all
}

#[test]
fn a_weighed_stage_is_a_layer_whatever_becomes_of_light() {
    for lightmaps in [Lightmaps::Vertices, Lightmaps::Keep, Lightmaps::Strip] {
        let written = write(&files(GRASS, true), Format::Glb, lightmaps);
        assert_eq!(written.report.warnings, [""; 0], "{lightmaps:?}");
        let drawn = read(&written);
        let [base, layer] = &drawn[..] else {
            panic!("{} primitives", drawn.len());
        };
        assert_eq!(base.material, "t/terrain");
        assert_eq!(base.mode, gltf::material::AlphaMode::Opaque);
        assert_eq!(base.image.as_deref(), Some("t/rock.png"));
        assert_eq!(base.triangles, 4);
        assert!(base.heights.iter().all(|h| *h == 8.0));

        assert_eq!(layer.material, "t/terrain.layer1");
        assert_eq!(layer.mode, gltf::material::AlphaMode::Blend);
        assert_eq!(layer.image.as_deref(), Some("t/grass.png"));
        assert_eq!(layer.triangles, 2, "what it does not cover is left out");
        assert!(layer.heights.iter().all(|h| *h == 8.125));
        assert_eq!(alphas(layer), [64, 130, 200, 255], "{lightmaps:?}");
        let kept = lightmaps != Lightmaps::Strip;
        assert_eq!((base.lightmapped, layer.lightmapped), (kept, kept));
        // both are under the same light
        let light = |d: &Drawn| d.colors.first().map_or(255, |c| c[0]);
        assert_eq!(light(base), light(layer), "{lightmaps:?}");
        assert_eq!(light(layer) < 255, lightmaps == Lightmaps::Vertices);
        assert_eq!(written.report.triangles, 6);
    }
}

#[test]
fn vertex_lit_layers_have_the_light_of_vertices() {
    let lit = GRASS.replace("alphaGen", "rgbGen vertex\nalphaGen");
    let written = write(&files(&lit, false), Format::Glb, Lightmaps::Vertices);
    let drawn = read(&written);
    let layer = &drawn[1];
    assert_eq!(alphas(layer), [64, 130, 200, 255]);
    assert!(
        layer.colors.iter().all(|c| c[0] < 255),
        "{:?}",
        layer.colors
    );
}

#[test]
fn what_alpha_leaves_weighs_too() {
    for stage in [
        GRASS.replace("alphaGen vertex", "alphaGen oneMinusVertex"),
        GRASS.replace(
            "GL_SRC_ALPHA GL_ONE_MINUS_SRC_ALPHA",
            "GL_ONE_MINUS_SRC_ALPHA GL_SRC_ALPHA",
        ),
    ] {
        let written = write(&files(&stage, true), Format::Glb, Lightmaps::Keep);
        let drawn = read(&written);
        let layer = &drawn[1];
        assert_eq!(layer.mode, gltf::material::AlphaMode::Blend);
        assert_eq!(layer.triangles, 4);
        assert_eq!(alphas(layer), [0, 55, 125, 191, 255, 255, 255, 255]);
    }
}

#[test]
fn several_layers_lie_above_each_other_with_what_is_over_all() {
    let detail = "{\nmap t/mud.tga\nblendFunc filter\ntcMod scale 4 4\n}";
    let cut = "{\nmap t/mud.tga\nalphaFunc GE128\nalphaGen vertex\n}";
    let written = write(
        &files(&format!("{GRASS}\n{cut}\n{detail}"), true),
        Format::Glb,
        Lightmaps::Keep,
    );
    let drawn = read(&written);
    let [base, grass, mud] = &drawn[..] else {
        panic!("{} primitives", drawn.len());
    };
    assert_eq!(mud.mode, gltf::material::AlphaMode::Mask);
    assert_eq!(mud.cutoff.unwrap_or(0.5), 0.5);
    assert_eq!(alphas(mud), [64, 130, 200, 255]);
    assert!(grass.heights.iter().all(|h| *h == 8.125));
    assert!(mud.heights.iter().all(|h| *h == 8.25));
    // The detail multiplies all three, each in a picture of its own.
    let mut images: Vec<_> = [base, grass, mud]
        .map(|d| d.image.clone().unwrap())
        .to_vec();
    images.dedup();
    assert_eq!(images.len(), 3, "{images:?}");
    assert!(
        images.iter().all(|i| i.ends_with("_color.png")),
        "{images:?}"
    );
}

#[test]
fn a_surface_that_fades_by_alpha_of_vertices_does_so_in_both_ways() {
    for (how, want) in [("vertex", [64, 130]), ("oneMinusVertex", [125, 191])] {
        let mut files = files(GRASS, true);
        let script = format!(
            "t/terrain\n{{\n{{\nmap t/grass.tga\nblendFunc blend\nalphaGen {how}\n}}\n}}\n"
        );
        files.insert("scripts/t.shader", script).unwrap();
        let drawn = read(&write(&files, Format::Glb, Lightmaps::Keep));
        let [only] = &drawn[..] else {
            panic!("{} primitives", drawn.len());
        };
        assert_eq!(only.mode, gltf::material::AlphaMode::Blend);
        let found = alphas(only);
        assert!(want.iter().all(|a| found.contains(a)), "{how}: {found:?}");
    }
}

#[test]
fn obj_has_layers_where_they_cover_half_and_says_so() {
    let written = write(&files(GRASS, true), Format::Obj, Lightmaps::Vertices);
    let text = std::fs::read_to_string(&written.path).unwrap();
    let mtl = std::fs::read_to_string(written.folder.path().join("t.mtl")).unwrap();
    for name in ["t/terrain.0", "t/terrain.layer1.0"] {
        assert!(text.contains(&format!("usemtl {name}\n")), "{text}");
        assert!(mtl.contains(&format!("newmtl {name}\n")), "{mtl}");
    }
    let faces = text.lines().filter(|l| l.starts_with("f ")).count();
    assert_eq!(faces, written.report.triangles);
    // Of the first square one triangle is covered by 195 of 255 in the mean, and the other by 149.
    assert_eq!(faces, 4 + 2);
    let list = &written.report.warnings;
    assert!(
        list.iter()
            .any(|w| w.contains("terrain.layer1") && w.contains("OBJ lacks")),
        "{list:?}"
    );
}

/// A floor with a poster, a decal over both, and a poster beside them; all in one plane but the last.
fn posters() -> MemoryFiles {
    let script = "t/floor\n{\n{\nmap t/rock.tga\n}\n}\n\
        t/decal\n{\npolygonOffset\nsort 9\n{\nmap t/mud.tga\nblendFunc blend\n}\n}\n\
        t/poster\n{\npolygonOffset\n{\nmap t/grass.tga\n}\n}\n";
    let mut map = MapBuilder::new();
    let square = |map: &mut MapBuilder, name: &str, x: f32, z: f32, half: f32| {
        let shader = map.add_shader(name, 0, 0);
        let corner = |i: f32, j: f32| Vec3::new(x + i * half, j * half, z);
        let corners = [
            corner(-1.0, -1.0),
            corner(-1.0, 1.0),
            corner(1.0, 1.0),
            corner(1.0, -1.0),
        ];
        map.add_quad(shader, corners);
    };
    square(&mut map, "t/decal", 8.0, 8.0, 8.0);
    square(&mut map, "t/floor", 0.0, 8.0, SIDE);
    square(&mut map, "t/poster", 0.0, 8.0, 16.0);
    square(&mut map, "t/poster", 0.0, 40.0, 16.0);
    let mut files = files("", false);
    files.insert("maps/t.bsp", map.build().write()).unwrap();
    files.insert("scripts/t.shader", script).unwrap();
    files
}

#[test]
fn what_lies_on_others_rises_a_quarter_of_a_unit_for_each() {
    let drawn = read(&write(&posters(), Format::Glb, Lightmaps::Vertices));
    let heights = |name: &str| -> Vec<f32> {
        let parts = drawn.iter().filter(|d| d.material == name);
        let mut all: Vec<f32> = parts.flat_map(|d| d.heights.clone()).collect();
        all.sort_by(f32::total_cmp);
        all.dedup();
        all
    };
    assert_eq!(heights("t/floor"), [8.0]);
    assert_eq!(heights("t/poster"), [8.25, 40.0]);
    assert_eq!(heights("t/decal"), [8.5]);
    let written = write(&posters(), Format::Obj, Lightmaps::Vertices);
    let text = std::fs::read_to_string(&written.path).unwrap();
    for height in ["8", "8.25", "8.5", "40"] {
        let at = |line: &str| line.starts_with("v ") && line.split(' ').nth(2) == Some(height);
        assert!(text.lines().any(at), "{height} in {text}");
    }
}
