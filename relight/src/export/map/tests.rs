//! Maps as map files, read back by a foreign parser.

use super::*;
use crate::export::{ExportOptions, ImageStore, uncalibrated as world};
use crate::files::MemoryFiles;
use crate::{Materials, Options, RelitWorld, SearchPath};
use glam::Vec2;
use q3bsp::DrawVert;
use q3bsp::builder::MapBuilder;

fn written(world: &RelitWorld, files: &dyn crate::GameFiles) -> (String, Tally) {
    let (materials, _) = Materials::load(files);
    document(&Export {
        world,
        files,
        materials: &materials,
        images: &ImageStore::default(),
        options: ExportOptions {
            // The brushes of the foreign parser.
            brushes: crate::export::Brushes::Valve,
            ..ExportOptions::default()
        },
    })
}

/// A box brush with one drawn side, a patch, and a door with an origin.
fn map() -> Bsp {
    let mut map = MapBuilder::new();
    let stone = map.add_shader("textures/stone/wall", 0, 1);
    map.add_cell(Vec3::splat(-256.0), Vec3::splat(256.0));
    map.add_box_brush(stone, Vec3::ZERO, Vec3::new(64.0, 32.0, 16.0));
    let top = [(0.0, 0.0), (0.0, 32.0), (64.0, 32.0), (64.0, 0.0)];
    let top = map.add_quad(stone, top.map(|(x, y)| Vec3::new(x, y, 16.0)));
    for vertex in map.vertices_mut(top) {
        // Turned by an eighth of a turn, 32 units to a repetition along s and 64 along t.
        let p = vertex.position;
        vertex.st = Vec2::new((p.x + p.y) / 32.0 + 0.25, (p.y - p.x) / 64.0);
    }
    let arch: Vec<DrawVert> = (0..15)
        .map(|at| DrawVert {
            position: Vec3::new((at % 5) as f32 * 8.0, (at / 5) as f32 * 16.0, 40.5),
            st: Vec2::new((at % 5) as f32 * 0.25, (at / 5) as f32),
            lightmap: Vec2::ZERO,
            normal: Vec3::Z,
            color: [255; 4],
        })
        .collect();
    map.add_patch(stone, 5, 3, &arch);
    let door = map.begin_model();
    map.add_box_brush(stone, Vec3::splat(-8.0), Vec3::splat(8.0));
    let number = format!("*{door}");
    map.add_entity(&[
        ("classname", "func_door"),
        ("model", &number),
        ("origin", "100 0 0"),
    ]);
    map.add_entity(&[("classname", "light"), ("origin", "1 2 3")]);
    map.build()
}

/// The document without its patches, which parsers of Quake's form do not support.
fn without_patches(text: &str) -> String {
    let mut out = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line == "{" && lines.peek() == Some(&"patchDef2") {
            while lines.next().is_some_and(|line| line != ")") {}
            // The patch's and its brush's brace.
            lines.next();
            lines.next();
            continue;
        }
        out.push_str(line);
        out.push('\n');
    }
    out
}

fn parse(text: &str) -> quake_map::QuakeMap {
    let text = without_patches(text);
    quake_map::parse(&mut std::io::Cursor::new(text.into_bytes())).unwrap()
}

#[test]
fn brushes_and_entities_are_read_by_a_foreign_parser() {
    let (text, tally) = written(&world(map()), &MemoryFiles::new());
    assert_eq!(
        (tally.brushes, tally.sides, tally.aligned, tally.patches),
        (2, 12, 1, 1)
    );
    let read = parse(&text);
    assert_eq!(read.entities.len(), 3);
    assert_eq!(read.entities[0].brushes.len(), 1);
    let door = &read.entities[1];
    let key = |entity: &quake_map::Entity, key: &str| {
        let found = entity
            .edict
            .iter()
            .find(|(k, _)| k.to_bytes() == key.as_bytes());
        found.map(|(_, value)| value.to_str().unwrap().to_owned())
    };
    assert_eq!(key(door, "classname").unwrap(), "func_door");
    assert_eq!(
        (key(door, "model"), key(door, "origin").unwrap()),
        (None, "100 0 0".into())
    );
    // The door stands where its entity puts it, and planes look outwards.
    for surface in &door.brushes[0] {
        let [a, b, c] = surface.half_space.map(DVec3::from_array);
        let normal = (a - b).cross(c - b).normalize();
        assert!(
            normal.dot(a - DVec3::new(100.0, 0.0, 0.0)) - 8.0 < 1e-9,
            "{normal}"
        );
        assert!(normal.dot(a - DVec3::new(100.0, 0.0, 0.0)) > 7.9);
    }
    assert!(
        text.contains("( 5 3 0 0 0 )\n(\n( ( 0 0 40.5 0 0 ) ( 0 16 40.5 0 1 ) ( 0 32 40.5 0 2 ) )")
    );
}

#[test]
fn textures_lie_as_they_were_drawn() {
    let (text, _) = written(&world(map()), &MemoryFiles::new());
    let read = parse(&text);
    let top = read.entities[0].brushes[0]
        .iter()
        .find(|s| s.half_space.iter().all(|p| p[2] == 16.0))
        .unwrap();
    let at = &top.alignment;
    let axes = at.axes.unwrap();
    for p in [DVec3::new(3.0, 5.0, 16.0), DVec3::new(60.0, 31.0, 16.0)] {
        let texels = |k: usize| p.dot(DVec3::from_array(axes[k])) / at.scale[k] + at.offset[k];
        // Without an image a texture is 64 texels wide and high.
        let s = texels(0) / 64.0 - ((p.x + p.y) / 32.0 + 0.25);
        let t = texels(1) / 64.0 - (p.y - p.x) / 64.0;
        assert!(
            (s - s.round()).abs() < 1e-4 && (t - t.round()).abs() < 1e-4,
            "{s} {t}"
        );
    }
    assert_eq!(top.texture.to_str().unwrap(), "stone/wall");
}

#[test]
fn bevels_are_left_out_and_open_brushes_told() {
    let mut bsp = map();
    // A seventh side that touches the box in an edge only, as compilers add for collision.
    let side = bsp.brush_sides[0];
    let mut planes = bsp.planes.clone();
    let normal = Vec3::new(1.0, 1.0, 0.0).normalize();
    planes.push(q3bsp::Plane {
        normal,
        dist: normal.dot(Vec3::new(64.0, 32.0, 0.0)),
    });
    bsp.planes = planes;
    let bevel = q3bsp::BrushSide {
        plane: q3bsp::PlaneId::from_raw(bsp.planes.len() as i32 - 1),
        ..side
    };
    let first = bsp.brush_sides.len() as i32;
    let sides: Vec<_> = bsp.brush_sides[..6].to_vec();
    bsp.brush_sides.extend(sides);
    bsp.brush_sides.push(bevel);
    bsp.brushes[0].first_side = first;
    bsp.brushes[0].num_sides = 7;
    bsp.brushes[1].num_sides = 3;
    let (text, tally) = written(&world(bsp), &MemoryFiles::new());
    assert_eq!((tally.brushes, tally.sides, tally.open), (1, 6, 1));
    assert_eq!(parse(&text).entities[0].brushes[0].len(), 6);
}

#[test]
fn a_shipped_map_is_read_by_a_foreign_parser() {
    let Some(folder) = testkit::folder() else {
        return;
    };
    let files = SearchPath::open(&[folder]).unwrap();
    let (materials, _) = Materials::load(&files);
    let options = Options {
        calibrate: None,
        ..Options::default()
    };
    let world = RelitWorld::load(&files, &materials, "maps/oa_dm1.bsp", options).unwrap();
    let (text, tally) = written(&world, &files);
    assert_eq!(tally.open, 0);
    // Most sides that are seen have their texture back.
    assert!(
        tally.aligned * 5 > tally.sides,
        "{} of {}",
        tally.aligned,
        tally.sides
    );
    let read = parse(&text);
    assert_eq!(read.entities.len(), world.bsp.entities().len());
    let brushes: usize = read.entities.iter().map(|e| e.brushes.len()).sum();
    assert_eq!(brushes, world.bsp.brushes.len());
}
