//! What is exported is the map: counted and measured against the map's own lumps, and read by the `gltf` crate,
//! a foreign reader.

use glam::{Vec2, Vec3};
use q3bsp::{Bsp, SurfaceKind, surface_flags};
use relight::export::{
    Export, ExportOptions, ExportReport, Format, ImagePlace, ImageStore, Lightmaps, export,
};
use relight::{GameFiles, Materials, Options, Pk3, RelitWorld, SearchPath};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

/// A map written to a folder of its own.
struct Written {
    folder: tempfile::TempDir,
    path: PathBuf,
    world: RelitWorld,
    report: ExportReport,
}

fn write(files: &dyn GameFiles, map: &str, format: Format, options: ExportOptions) -> Written {
    let (materials, _) = Materials::load(files);
    let world = RelitWorld::load(
        files,
        &materials,
        map,
        Options {
            calibrate: None,
            ..Options::default()
        },
    )
    .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("map.{}", format.extension()));
    let source = Export {
        world: &world,
        files,
        materials: &materials,
        images: &ImageStore::default(),
        options,
    };
    let report = export(&source, format, &path).unwrap();
    Written {
        folder,
        path,
        world,
        report,
    }
}

/// Triangles of one material: number, area in square id units, bounds, ranges of texture coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Measure {
    triangles: usize,
    area: f64,
    mins: Vec3,
    maxs: Vec3,
    st: [Vec2; 2],
}

impl Default for Measure {
    fn default() -> Self {
        Measure {
            triangles: 0,
            area: 0.0,
            mins: Vec3::MAX,
            maxs: Vec3::MIN,
            st: [Vec2::MAX, Vec2::MIN],
        }
    }
}

impl Measure {
    fn add(&mut self, corners: [Vec3; 3], st: [Vec2; 3]) {
        let [a, b, c] = corners;
        self.triangles += 1;
        self.area += 0.5 * f64::from((b - a).cross(c - a).length());
        for p in corners {
            (self.mins, self.maxs) = (self.mins.min(p), self.maxs.max(p));
        }
        for p in st {
            self.st = [self.st[0].min(p), self.st[1].max(p)];
        }
    }
}

/// Whether a triangle faces away from its vertices' normals; `front`: the cross product of two sides, towards its front.
fn faces_away(front: Vec3, normals: [Vec3; 3]) -> bool {
    let normal: Vec3 = normals.into_iter().sum();
    // slivers have no direction to speak of
    front.length() > 1.0 && front.normalize().dot(normal) < -0.1
}

/// What the map's own lumps say, without what they mark as not drawn, sky, and what has no area; and how many triangles
/// face away from their normals.
fn measure_lumps(bsp: &Bsp, hidden: &dyn Fn(&str) -> bool) -> (BTreeMap<String, Measure>, usize) {
    let mut out: BTreeMap<String, Measure> = BTreeMap::new();
    let mut away = 0;
    let patches = bsp.patch_meshes(4.0);
    for (index, surface) in bsp.surfaces.iter().enumerate() {
        let shader = bsp.shader(surface.shader);
        let flags =
            surface_flags::NODRAW | surface_flags::HINT | surface_flags::SKIP | surface_flags::SKY;
        if shader.surface_flags & flags != 0 || hidden(&shader.name) {
            continue;
        }
        let (vertices, corners) = match (surface.kind, &patches[index]) {
            (SurfaceKind::Patch, Some(mesh)) => (mesh.vertices.clone(), mesh.indices()),
            (SurfaceKind::Planar | SurfaceKind::TriangleSoup, _) => (
                bsp.surface_vertices(surface).to_vec(),
                bsp.surface_indices(surface)
                    .iter()
                    .map(|&i| i as u32)
                    .collect(),
            ),
            _ => continue,
        };
        for corners in corners.as_chunks::<3>().0 {
            let v = corners.map(|i| vertices[i as usize]);
            let [a, b, c] = v.map(|v| v.position);
            if (b - a).cross(c - a) != Vec3::ZERO {
                let measure = out.entry(shader.name.to_ascii_lowercase()).or_default();
                measure.add([a, b, c], v.map(|v| v.st));
                let normals = v.map(|v| v.normal.normalize_or(Vec3::Z));
                away += usize::from(faces_away((c - a).cross(b - a), normals));
            }
        }
    }
    (out, away)
}

/// Whether a mesh is a model that entities name, and not of the map.
fn is_file(mesh: &gltf::Mesh<'_>) -> bool {
    let extras = mesh.extras().as_ref();
    extras.is_some_and(|e| e.get().contains("\"file\""))
}

/// Whether a primitive is a layer over another that has the same triangles.
fn is_layer(primitive: &gltf::Primitive<'_>) -> bool {
    let material = primitive.material();
    let extras = material.extras().as_ref();
    extras.is_some_and(|e| e.get().contains("\"layer\":"))
}

/// What a glTF holds without layers, back in id units; and how many triangles face away from their normals.
fn measure_gltf(path: &Path, scale: f32) -> (BTreeMap<String, Measure>, usize) {
    let (document, buffers, images) = gltf::import(path).unwrap();
    assert!(images.len() <= document.images().count());
    let mut contents = HashSet::new();
    for image in document.images() {
        if let gltf::image::Source::View { view, .. } = image.source() {
            let range = view.offset()..view.offset() + view.length();
            let bytes = &buffers[view.buffer().index()].0[range];
            assert!(contents.insert(bytes.to_vec()), "{:?} twice", image.name());
        }
    }
    let mut out: BTreeMap<String, Measure> = BTreeMap::new();
    let mut away = 0;
    let mut meshes = HashSet::new();
    for node in document.nodes() {
        let Some(mesh) = node.mesh().filter(|_| node.name() != Some("sky")) else {
            continue;
        };
        if is_file(&mesh) {
            continue;
        }
        if !meshes.insert(mesh.index()) {
            continue;
        }
        for primitive in mesh.primitives().filter(|p| !is_layer(p)) {
            let reader = primitive.reader(|b| Some(&buffers[b.index()]));
            let back = |p: [f32; 3]| Vec3::new(p[0], -p[2], p[1]);
            let positions: Vec<Vec3> = reader
                .read_positions()
                .unwrap()
                .map(|p| back(p) / scale)
                .collect();
            let normals: Vec<Vec3> = reader.read_normals().unwrap().map(back).collect();
            let st: Vec<Vec2> = match reader.read_tex_coords(0) {
                Some(st) => st.into_f32().map(Vec2::from).collect(),
                None => vec![Vec2::ZERO; positions.len()],
            };
            assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1.0e-3));
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            let name = primitive.material().name().unwrap().to_ascii_lowercase();
            let measure = out.entry(name).or_default();
            for corners in indices.as_chunks::<3>().0 {
                let at = corners.map(|i| i as usize);
                let [a, b, c] = at.map(|i| positions[i]);
                measure.add([a, b, c], at.map(|i| st[i]));
                let front = (b - a).cross(c - a);
                away += usize::from(faces_away(front, at.map(|i| normals[i])));
            }
        }
    }
    (out, away)
}

/// Materials that are not drawn whatever the map's flags say.
fn hidden(world: &RelitWorld) -> HashSet<String> {
    use relight::materials::light::SurfaceClass::{Fog, Invisible};
    let unseen = world
        .materials
        .iter()
        .filter(|m| m.is_sky() || matches!(m.class.class, Invisible | Fog));
    unseen.map(|m| m.name.to_ascii_lowercase()).collect()
}

#[track_caller]
fn agree(written: &Written, name: &str) {
    let unseen = hidden(&written.world);
    let (lumps, lumps_away) = measure_lumps(&written.world.bsp, &|n| {
        unseen.contains(&n.to_ascii_lowercase())
    });
    // What lies on other surfaces rises from them, and bent surfaces change their area with that.
    let stacked = written.world.stacked();
    let mut risen: BTreeMap<String, f32> = BTreeMap::new();
    for (surface, stacked) in written.world.surfaces.iter().zip(&stacked) {
        let material = &written.world.materials[surface.material as usize];
        let rise = risen.entry(material.name.to_ascii_lowercase()).or_default();
        *rise = rise.max(0.25 * stacked.below as f32);
    }
    let scale = ExportOptions::default().scale;
    let (found, away) = measure_gltf(&written.path, scale);
    let names = |m: &BTreeMap<String, Measure>| m.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&found), names(&lumps), "{name}");
    let mut triangles = 0;
    for (material, lump) in &lumps {
        let one = &found[material];
        triangles += one.triangles;
        assert_eq!(one.triangles, lump.triangles, "{name}: {material}");
        let rise = risen.get(material).copied().unwrap_or_default();
        let exact = if rise > 0.0 { 1.0e-2 } else { 1.0e-4 };
        assert!(
            (one.area - lump.area).abs() <= exact * lump.area.max(1.0),
            "{name}: {material}: {} {}",
            one.area,
            lump.area
        );
        let near = |a: Vec3, b: Vec3| (a - b).length() < 0.01 + rise;
        assert!(near(one.mins, lump.mins), "{name}: {material}");
        assert!(near(one.maxs, lump.maxs), "{name}: {material}");
        // far out, coordinates are moved by whole repetitions
        if lump.st[0].abs().max(lump.st[1].abs()).max_element() < 200.0 {
            assert_eq!(one.st, lump.st, "{name}: {material}");
        }
    }
    let document = gltf::Gltf::open(&written.path).unwrap();
    // What several entities name is there once.
    let mut models = HashSet::new();
    for mesh in document.meshes().filter(is_file) {
        let extras = mesh.extras().as_ref().map(|e| e.get().to_owned());
        assert!(models.insert(extras), "{name}: {:?} twice", mesh.name());
    }
    let files = document.meshes().filter(is_file);
    let of_files = files.flat_map(|m| m.primitives().collect::<Vec<_>>());
    let of_files: usize = of_files.map(|p| p.indices().unwrap().count() / 3).sum();
    let all = document
        .meshes()
        .flat_map(|m| m.primitives().collect::<Vec<_>>());
    let of_layers = all
        .filter(is_layer)
        .map(|p| p.indices().unwrap().count() / 3);
    let of_layers: usize = of_layers.sum();
    assert_eq!(
        triangles + of_layers + of_files,
        written.report.triangles,
        "{name}"
    );
    // compilers leave some triangles whose vertices' normals point elsewhere; flat surfaces get those of their planes
    assert!(
        away <= lumps_away + triangles / 1000 + 2,
        "{name}: {away} of {triangles} face away, and in the map {lumps_away}"
    );
}

#[test]
fn the_sample_is_the_map() {
    let files = relight::sample::Sample::Hall.files().unwrap();
    let lit = ExportOptions {
        lightmaps: Lightmaps::Strip,
        lights: true,
        ..ExportOptions::default()
    };
    let written = write(
        &files,
        relight::sample::Sample::Hall.map(),
        Format::Glb,
        lit,
    );
    agree(&written, "sample");
    let (document, ..) = gltf::import(&written.path).unwrap();
    let material = |name: &str| {
        document
            .materials()
            .find(|m| m.name() == Some(name))
            .unwrap()
    };
    let grate = material("sample/grate");
    assert_eq!(grate.alpha_mode(), gltf::material::AlphaMode::Mask);
    assert!(grate.double_sided());
    let lamp = material("sample/lamp_warm");
    assert!(lamp.emissive_strength().unwrap() > 1.0);
    assert!(lamp.emissive_texture().is_some());
    let entities = written.world.bsp.entities().len();
    let kept = document.nodes().filter(|n| {
        n.extras()
            .as_ref()
            .is_some_and(|e| e.get().contains("\"classname\""))
    });
    assert_eq!(kept.count(), entities);
}

#[test]
fn images_are_stored_once_and_lightmaps_can_be_left_out() {
    let files = relight::sample::Sample::Hall.files().unwrap();
    let options = ExportOptions {
        images: ImagePlace::Beside,
        ..ExportOptions::default()
    };
    let written = write(
        &files,
        relight::sample::Sample::Hall.map(),
        Format::Gltf,
        options,
    );
    let mut contents = HashSet::new();
    let images = |path: &Path| path.extension().is_some_and(|e| e == "png" || e == "jpg");
    let mut count = 0;
    for (path, size) in &written.report.files {
        let bytes = std::fs::read(path).unwrap();
        assert_eq!(bytes.len() as u64, *size);
        if images(path) {
            count += 1;
            assert!(contents.insert(bytes), "{} twice", path.display());
        }
    }
    assert_eq!(count, written.report.images);
    assert!(written.folder.path().join("map.bin").is_file());
    gltf::import(&written.path).unwrap();

    let with = |lightmaps| {
        let options = ExportOptions {
            lightmaps,
            ..options
        };
        let written = write(
            &files,
            relight::sample::Sample::Hall.map(),
            Format::Gltf,
            options,
        );
        let text = std::fs::read_to_string(&written.path).unwrap();
        (written.report.images, text)
    };
    let (_, text) = with(Lightmaps::Vertices);
    assert!(text.contains("KHR_materials_unlit") && !text.contains("MOZ_lightmap"));
    let (kept, text) = with(Lightmaps::Keep);
    assert!(text.contains("MOZ_lightmap") && text.contains("TEXCOORD_1"));
    assert!(!text.contains("KHR_materials_unlit"));
    let (stripped, text) = with(Lightmaps::Strip);
    assert_eq!(stripped + 1, kept);
    assert!(!text.contains("MOZ_lightmap") && !text.contains("TEXCOORD_1"));
}

#[test]
fn by_default_every_program_shows_the_light() {
    let files = relight::sample::Sample::Hall.files().unwrap();
    let options = ExportOptions::default();
    let written = write(
        &files,
        relight::sample::Sample::Hall.map(),
        Format::Glb,
        options,
    );
    agree(&written, "sample");
    let (document, buffers, _) = gltf::import(&written.path).unwrap();
    let (mut dark, mut bright, mut mean, mut count) = (0, 0, 0.0, 0.0);
    for primitive in document.meshes().flat_map(|m| m.primitives()) {
        // the sky has no light of its own
        let Some(colors) = primitive
            .reader(|b| buffers.get(b.index()).map(|d| &d.0[..]))
            .read_colors(0)
        else {
            continue;
        };
        for [r, g, b, _] in colors.into_rgba_f32() {
            let light = (r + g + b) / 3.0;
            dark += usize::from(light < 0.01);
            bright += usize::from(light > 0.99);
            mean += light;
            count += 1.0;
        }
    }
    let mean = mean / count;
    assert!((0.02..0.9).contains(&mean), "{mean}");
    assert!(((dark + bright) as f32) < 0.9 * count, "{dark} {bright}");
    // light is not there twice
    assert!(document.lights().is_none_or(|lights| lights.count() == 0));
}

#[test]
fn obj_has_every_triangle() {
    let files = relight::sample::Sample::Hall.files().unwrap();
    let written = write(
        &files,
        relight::sample::Sample::Hall.map(),
        Format::Obj,
        ExportOptions::default(),
    );
    let text = std::fs::read_to_string(&written.path).unwrap();
    let lines = |keyword: &str| text.lines().filter(|l| l.starts_with(keyword)).count();
    assert_eq!(lines("f "), written.report.triangles);
    assert_eq!(lines("v "), written.report.vertices);
    assert_eq!(lines("vt "), lines("v "));
    let mtl = std::fs::read_to_string(written.path.with_extension("mtl")).unwrap();
    for line in mtl.lines().filter(|l| l.starts_with("map_")) {
        let file = line.rsplit(' ').next().unwrap();
        assert!(written.folder.path().join(file).is_file(), "{line}");
    }
}

/// Maps that together have what maps have: patches drawn and hidden, soups, coordinates that are no numbers, the same
/// name with different flags, layers.
const MAPS: [&str; 4] = ["aggressor", "am_lavaarena", "islandctf", "oa_dm3"];

#[test]
fn real_maps_are_exported_as_they_are() {
    let Some(folder) = testkit::folder() else {
        return;
    };
    let files = SearchPath::open(&[folder]).unwrap();
    for name in MAPS {
        let map = format!("maps/{name}.bsp");
        let written = write(&files, &map, Format::Glb, ExportOptions::default());
        agree(&written, name);
    }
}

/// Minutes: `cargo test --release -p relight --test export -- --ignored`.
#[test]
#[ignore = "converts and reads back every map of every pack"]
fn all_maps_are_exported_as_they_are() {
    let Some(game) = testkit::game() else {
        return;
    };
    let mut count = 0;
    for pack in game.all_packs() {
        let mut files = SearchPath::open(std::slice::from_ref(&game.folder)).unwrap();
        // later packs replace maps of earlier ones; here each has its own
        files.add_pk3(pack).unwrap();
        for map in Pk3::open(pack).unwrap().list("maps", ".bsp") {
            let path = format!("maps/{map}");
            let written = write(&files, &path, Format::Glb, ExportOptions::default());
            agree(&written, &format!("{}:{path}", pack.display()));
            count += 1;
        }
    }
    println!("{count} maps");
    assert!(count > 0);
}
