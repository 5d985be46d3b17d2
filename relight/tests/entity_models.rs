//! Models that entities name are in a glTF once, and stand where the entities stand.

use glam::{Mat4, Vec2, Vec3};
use q3model::{Frame, Md3, PackedVertex, Surface};
use relight::export::{Export, ExportOptions, ExportReport, Format, ImageStore, export};
use relight::{GameFiles, Materials, MemoryFiles, Options, RelitWorld};

/// A triangle that faces up, clockwise seen from above, and one without area.
fn model() -> Vec<u8> {
    let positions = [
        Vec3::ZERO,
        Vec3::new(0.0, 16.0, 0.0),
        Vec3::new(8.0, 0.0, 4.0),
    ];
    let vertices = positions.map(|p| PackedVertex::pack(p, Vec3::Z)).to_vec();
    let surface = |name: &str, shader: &str| Surface {
        name: name.to_owned(),
        shaders: vec![shader.to_owned()],
        triangles: vec![[0, 1, 2], [0, 1, 1]],
        st: vec![Vec2::ZERO, Vec2::new(0.0, 1.0), Vec2::new(0.25, 0.75)],
        vertices: vertices.clone(),
        num_verts: 3,
    };
    let model = Md3 {
        name: "m".to_owned(),
        frames: vec![Frame {
            mins: Vec3::ZERO,
            maxs: Vec3::new(8.0, 16.0, 4.0),
            local_origin: Vec3::ZERO,
            radius: 20.0,
            name: "f".to_owned(),
        }],
        surfaces: vec![
            surface("a", "textures/sample/lamp_warm"),
            surface("b", "models/t/skin"),
        ],
        ..Md3::default()
    };
    model.write()
}

/// The sample's map with more entities.
fn files(entities: &str) -> MemoryFiles {
    let mut files = relight::sample::Sample::Hall.files().unwrap();
    let bytes = files
        .read(relight::sample::Sample::Hall.map())
        .unwrap()
        .unwrap();
    let mut bsp = q3bsp::Bsp::parse(&bytes).unwrap();
    while bsp.entities.last() == Some(&0) {
        bsp.entities.pop();
    }
    bsp.entities.extend_from_slice(entities.as_bytes());
    files
        .insert(relight::sample::Sample::Hall.map(), bsp.write())
        .unwrap();
    files.insert("models/t/Thing.md3", model()).unwrap();
    files.insert("models/t/cut.md3", &model()[..200]).unwrap();
    files
}

fn write(files: &MemoryFiles) -> (tempfile::TempDir, ExportReport, RelitWorld) {
    let (materials, _) = Materials::load(files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = RelitWorld::load(
        files,
        &materials,
        relight::sample::Sample::Hall.map(),
        options,
    )
    .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let source = Export {
        world: &world,
        files,
        materials: &materials,
        images: &ImageStore::default(),
        options: ExportOptions::default(),
    };
    let report = export(&source, Format::Glb, &folder.path().join("map.glb")).unwrap();
    (folder, report, world)
}

const ENTITIES: &str = r#"
{ "classname" "misc_a" "model" "models/t/thing.md3" "origin" "10 20 30" "angle" "90" }
{ "classname" "misc_b" "model" "models\\T\\thing.md3" "modelscale_vec" "1 2 3" }
{ "classname" "misc_c" "model2" "/models/t/thing.md3" "origin" "0 0 64" "modelscale" "2" }
{ "classname" "misc_d" "model" "models/t/gone.md3" }
{ "classname" "misc_e" "model" "models/t/gone.md3" }
{ "classname" "misc_f" "model" "models/t/cut.md3" }
{ "classname" "misc_model" "model" "models/t/compiled.md3" }
{ "classname" "misc_g" "model" "somebody/default" }
{ "classname" "info_player_x" "model2" "models/t/thing.md3" "origin" "1 2 3" "angle" "180" "modelscale" "2" }
"#;

/// The first node below another that has a mesh.
fn below<'a>(node: &gltf::Node<'a>) -> Option<gltf::Node<'a>> {
    node.children().find(|c| c.mesh().is_some())
}

#[test]
fn a_file_is_one_mesh_however_many_entities_name_it() {
    let (folder, report, _) = write(&files(ENTITIES));
    let path = folder.path().join("map.glb");
    let (document, buffers, _) = gltf::import(path).unwrap();
    let with_file: Vec<_> = document
        .meshes()
        .filter(|m| m.name() == Some("models/t/thing.md3"))
        .collect();
    assert_eq!(with_file.len(), 1);
    let mesh = &with_file[0];
    assert_eq!(mesh.primitives().count(), 2);

    let users: Vec<_> = document
        .nodes()
        .filter(|n| n.mesh().is_some_and(|m| m.index() == mesh.index()))
        .collect();
    assert_eq!(users.len(), 4);
    let node = |class: &str| {
        let found = users.iter().find(|n| n.name().unwrap().starts_with(class));
        let found = found.unwrap_or_else(|| panic!("{class}"));
        Mat4::from_cols_array_2d(&found.transform().matrix())
    };
    let primitive = mesh.primitives().next().unwrap();
    assert_eq!(
        primitive.material().name(),
        Some("textures/sample/lamp_warm")
    );
    let reader = primitive.reader(|b| Some(&buffers[b.index()]));
    let positions: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from).collect();
    let normals: Vec<Vec3> = reader.read_normals().unwrap().map(Vec3::from).collect();
    let indices: Vec<usize> = reader
        .read_indices()
        .unwrap()
        .into_u32()
        .map(|i| i as usize)
        .collect();
    // the one without area is not there, and the front is counter-clockwise
    assert_eq!(indices.len(), 3);
    let [a, b, c] = [0, 1, 2].map(|i| positions[indices[i]]);
    assert!((b - a).cross(c - a).dot(normals[0]) > 0.0);
    let corner = positions
        .iter()
        .position(|p| p.x > 0.0)
        .expect("the corner at 8 0 4");
    assert!(normals[corner].distance(Vec3::Y) < 0.02);
    let st: Vec<[f32; 2]> = reader.read_tex_coords(0).unwrap().into_f32().collect();
    assert_eq!(st[corner], [0.25, 0.75]);

    let scale = ExportOptions::default().scale;
    let placed = |class: &str, expected: Vec3| {
        let p = node(class).transform_point3(positions[corner]) / scale;
        // back in the map's axes
        let p = Vec3::new(p.x, -p.z, p.y);
        assert!(p.distance(expected) < 1.0e-3, "{class}: {p}");
    };
    placed("misc_a", Vec3::new(10.0, 28.0, 34.0));
    placed("misc_b", Vec3::new(8.0, 0.0, 12.0));
    placed("misc_c", Vec3::new(16.0, 0.0, 72.0));
    // below a node that has something else already, here a camera
    let parent = document
        .nodes()
        .find(|n| n.name().is_some_and(|n| n.starts_with("info_player_x")) && below(n).is_some());
    let parent = parent.expect("a place for players with a model");
    assert!(parent.children().any(|c| c.camera().is_some()));
    let matrix = |n: &gltf::Node<'_>| Mat4::from_cols_array_2d(&n.transform().matrix());
    let whole = matrix(&parent) * matrix(&below(&parent).unwrap());
    let p = whole.transform_point3(positions[corner]) / scale;
    assert!(p.distance(Vec3::new(-15.0, 11.0, -2.0)) < 1.0e-3, "{p}");

    let about = |what: &str| report.warnings.iter().filter(|w| w.contains(what)).count();
    assert_eq!(about("gone.md3"), 1, "{:?}", report.warnings);
    assert_eq!(about("(misc_d) and 1 more is left out: there is no"), 1);
    assert_eq!(about("cut.md3"), 1);
    assert_eq!((about("compiled"), about("somebody")), (0, 0));
    assert_eq!(about("material models/t/skin"), 1);
}

#[test]
fn models_are_lit_by_the_grid() {
    let mut files = files(
        r#"{ "classname" "misc_a" "model" "models/t/thing.md3" "origin" "10 20 70" "angle" "90" }"#,
    );
    let white = image::RgbImage::from_pixel(4, 4, image::Rgb([255; 3]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    white.write_to(&mut bytes, image::ImageFormat::Tga).unwrap();
    files
        .insert("models/t/skin.tga", bytes.into_inner())
        .unwrap();
    let (folder, _, world) = write(&files);
    let (document, buffers, _) = gltf::import(folder.path().join("map.glb")).unwrap();
    let mesh = document
        .meshes()
        .find(|m| m.name() == Some("models/t/thing.md3"))
        .unwrap();
    let lit = mesh
        .primitives()
        .find(|p| p.material().name() == Some("models/t/skin"))
        .unwrap();
    let reader = lit.reader(|b| Some(&buffers[b.index()]));
    let colors: Vec<_> = reader.read_colors(0).unwrap().into_rgb_f32().collect();
    assert_eq!(colors.len(), 3);
    let layout = world.bsp.light_grid().unwrap();
    let raw = layout
        .sample(&world.bsp.light_grid, Vec3::new(10.0, 20.0, 70.0))
        .unwrap();
    // the normals point up
    let shift = f32::from(1u8 << world.overbright_shift);
    let cosine = raw.direction.z.max(0.0);
    let light = (raw.ambient * 0.6 + raw.directed * cosine) * shift + Vec3::splat(32.0);
    // its points are dim, so that nothing is cut off, and lit
    assert!(light.max_element() < 255.0 && raw.directed.max_element() > 0.0);
    let expected = (light / 255.0)
        .to_array()
        .map(|c| relight::overbright::to_linear(c.min(1.0)));
    for color in colors {
        let off = Vec3::from(color).distance(Vec3::from(expected));
        assert!(off < 0.02, "{color:?} {expected:?}");
    }
}

/// The same triangle in one level of an MDR, hung on a bone that is 100 units up.
fn mdr() -> Vec<u8> {
    let vertex = |number: u32, st| q3model::MdrVertex {
        normal: Vec3::Z,
        st,
        first_weight: number,
        num_weights: 1,
    };
    let weight = |offset| q3model::MdrWeight {
        bone: 0,
        weight: 1.0,
        offset,
    };
    let surface = q3model::MdrSurface {
        name: "body".to_owned(),
        shader: "models/t/skin".to_owned(),
        triangles: vec![[0, 1, 2]],
        vertices: vec![
            vertex(0, Vec2::ZERO),
            vertex(1, Vec2::Y),
            vertex(2, Vec2::X),
        ],
        weights: vec![
            weight(Vec3::ZERO),
            weight(Vec3::Y * 16.0),
            weight(Vec3::X * 8.0),
        ],
    };
    let mut up = q3model::BoneMatrix::IDENTITY;
    up.rows[2].w = 100.0;
    let model = q3model::Mdr {
        name: "m".to_owned(),
        frames: vec![Frame {
            mins: Vec3::ZERO,
            maxs: Vec3::splat(116.0),
            local_origin: Vec3::ZERO,
            radius: 116.0,
            name: "f".to_owned(),
        }],
        bones: vec![up],
        num_bones: 1,
        lods: vec![vec![surface]],
        tags: Vec::new(),
    };
    model.write(false)
}

/// The same in an IQM without a skeleton.
fn iqm() -> Vec<u8> {
    let vertex = |position, st| q3model::IqmVertex {
        position,
        normal: Vec3::Z,
        st,
        color: [255; 4],
        joints: [0; 4],
        weights: [0.0; 4],
    };
    let model = q3model::Iqm {
        surfaces: vec![q3model::IqmSurface {
            name: "Body".to_owned(),
            material: "models/t/skin".to_owned(),
            first_vertex: 0,
            num_vertices: 3,
            triangles: vec![[0, 1, 2]],
        }],
        vertices: vec![
            vertex(Vec3::Z * 100.0, Vec2::ZERO),
            vertex(Vec3::new(0.0, 16.0, 100.0), Vec2::Y),
            vertex(Vec3::new(8.0, 0.0, 100.0), Vec2::X),
        ],
        ..q3model::Iqm::default()
    };
    model.write()
}

#[test]
fn models_of_all_kinds_are_written_in_the_skin_that_the_entity_names() {
    let mut files = files(
        r#"
{ "classname" "misc_a" "model" "models/t/a.mdr" }
{ "classname" "misc_b" "model" "models/t/b.iqm" }
{ "classname" "misc_c" "model" "models/t/a.mdr" "skin" "2" }
{ "classname" "misc_d" "model" "models/t/b.iqm" "_skin" "models/t/a_2.skin" }
{ "classname" "misc_e" "model" "models/t/b.iqm" "skin" "9" }
"#,
    );
    files.insert("models/t/a.mdr", mdr()).unwrap();
    files.insert("models/t/b.iqm", iqm()).unwrap();
    let skin = "tag_head,\nbody,textures/sample/lamp_warm\n";
    files.insert("models/t/a_2.skin", skin).unwrap();
    let (folder, report, _) = write(&files);
    let (document, buffers, _) = gltf::import(folder.path().join("map.glb")).unwrap();
    let shown = |class: &str| {
        let node = document
            .nodes()
            .find(|n| n.name().is_some_and(|name| name.starts_with(class)))
            .unwrap();
        let mesh = node.mesh().unwrap();
        let part = mesh.primitives().next().unwrap();
        let reader = part.reader(|b| Some(&buffers[b.index()]));
        let places: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
        assert_eq!(places.len(), 3, "{class}");
        // 100 units up in metres
        assert!(
            places.iter().all(|p| (p[1] - 3.125).abs() < 1e-4),
            "{class}: {places:?}"
        );
        (mesh.index(), part.material().name().unwrap().to_owned())
    };
    let all: Vec<_> = ["misc_a", "misc_b", "misc_c", "misc_d", "misc_e"]
        .map(shown)
        .into_iter()
        .collect();
    let materials: Vec<&str> = all.iter().map(|(_, m)| m.as_str()).collect();
    let (own, skin) = ("models/t/skin", "textures/sample/lamp_warm");
    assert_eq!(materials, [own, own, skin, skin, own]);
    assert!(all[0].0 != all[2].0);
    let printed = report.warnings.join("\n");
    assert!(
        printed.contains("models/t/b_9.skin: there is no such skin"),
        "{printed}"
    );
}
