//! Maps of Quake, GoldSrc and Quake II: files made by the writer here, the writer held against the known layouts.

use exercise::exercise;
use glam::{Vec2, Vec3};
use proptest::prelude::*;
use q3bsp::quake::{
    Edge, Face, QuakeBrush, QuakeBrushSide, QuakeLeaf, QuakeMap, QuakeModel, QuakeNode, QuakePlane,
    Texinfo, quake2_flags,
};
use q3bsp::{Bsp, Error, Format, Lump, content_flags, lightmap_index, surface_flags};

#[path = "common/exercise.rs"]
mod exercise;

const FORMATS: [Format; 6] = [
    Format::Quake,
    Format::Bsp2,
    Format::TwoPsb,
    Format::GoldSrc,
    Format::Quake2,
    Format::Qbism,
];

fn two(format: Format) -> bool {
    matches!(format, Format::Quake2 | Format::Qbism)
}

/// A texture of 16 × 16 texels with all four sizes, and in GoldSrc its palette.
fn miptex(name: &str, format: Format, texel: u8) -> Vec<u8> {
    let mut out = vec![0; 16];
    out[..name.len()].copy_from_slice(name.as_bytes());
    let sizes = [256u32, 64, 16, 4];
    let offsets = [40, 40 + 256, 40 + 320, 40 + 336];
    for n in [16, 16].into_iter().chain(offsets) {
        out.extend(u32::to_le_bytes(n));
    }
    for size in sizes {
        out.extend(vec![texel; size as usize]);
    }
    if format == Format::GoldSrc {
        out.extend(256u16.to_le_bytes());
        out.extend((0..768).map(|at| (at / 3) as u8));
    }
    out
}

fn textures(names: &[(&str, u8)], format: Format) -> Vec<u8> {
    let start = 4 + 4 * names.len();
    let mut data = Vec::new();
    let mut head = (names.len() as i32).to_le_bytes().to_vec();
    for (name, texel) in names {
        if name.is_empty() {
            head.extend((-1i32).to_le_bytes());
            continue;
        }
        head.extend(((start + data.len()) as i32).to_le_bytes());
        data.extend(miptex(name, format, *texel));
    }
    head.extend(data);
    head
}

/// A room of 64 units whose faces look inwards: stone everywhere, a liquid below, sky above.
fn room(format: Format) -> QuakeMap {
    let two = two(format);
    let corner = |at: u32| {
        Vec3::new(
            if at & 1 == 0 { -32.0 } else { 32.0 },
            if at & 2 == 0 { -32.0 } else { 32.0 },
            if at & 4 == 0 { -32.0 } else { 32.0 },
        )
    };
    // Corners of the sides -x +x -y +y -z +z, clockwise seen from inside.
    let loops = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let mut map = QuakeMap {
        format,
        entities:
            b"{\n\"classname\" \"worldspawn\"\n\"sky\" \"night\"\n\"skyname\" \"night\"\n}\n\0"
                .to_vec(),
        vertices: (0..8).map(corner).collect(),
        edges: vec![Edge([0, 0])],
        lighting: (0..6 * 25 * 2 * 3).map(|at| (at % 200) as u8).collect(),
        ..QuakeMap::default()
    };
    for side in 0..6 {
        let mut normal = Vec3::ZERO;
        normal[side / 2] = 1.0;
        let dist = if side % 2 == 0 { -32.0 } else { 32.0 };
        map.planes.push(QuakePlane {
            normal,
            dist,
            kind: (side / 2) as i32,
        });
        let first_edge = map.surfedges.len() as i32;
        let corners: [u32; 4] = loops[side];
        for at in 0..4 {
            let (from, to) = (corners[at], corners[(at + 1) % 4]);
            // Shared edges are walked backwards by the second face.
            match map.edges.iter().position(|e| e.0 == [to, from]) {
                Some(edge) => map.surfedges.push(-(edge as i32)),
                None => {
                    map.edges.push(Edge([from, to]));
                    map.surfedges.push(map.edges.len() as i32 - 1);
                }
            }
        }
        let bytes = if matches!(format, Format::Quake | Format::Bsp2 | Format::TwoPsb) {
            1
        } else {
            3
        };
        map.faces.push(Face {
            plane: side as u32,
            side: i32::from(side % 2 == 1),
            first_edge,
            num_edges: 4,
            texinfo: match side {
                4 => 1,
                5 => 2,
                _ => 0,
            },
            styles: [0, 7, 255, 255],
            light_offset: (side * 50 * bytes) as i32,
        });
    }
    let info = |texture: u32, name: &str, flags: u32, value: i32| {
        let mut raw = [0; 32];
        raw[..name.len()].copy_from_slice(name.as_bytes());
        Texinfo {
            s: [1.0, 1.0, 0.0, 32.0],
            t: [0.0, 0.0, -1.0, 16.0],
            texture: if two { 0 } else { texture },
            flags,
            value: if two { value } else { 0 },
            name: if two { raw } else { [0; 32] },
            next: -1,
        }
    };
    map.texinfos = if two {
        vec![
            info(0, "e1/stone", 0, 0),
            info(
                0,
                "e1/pool",
                quake2_flags::WARP | quake2_flags::TRANS66 | quake2_flags::LIGHT,
                300,
            ),
            info(0, "e1/sky", quake2_flags::SKY, 0),
        ]
    } else {
        map.textures = textures(&[("Stone", 3), ("*lava1", 4), ("sky4", 5), ("", 0)], format);
        vec![info(0, "", 0, 0), info(1, "", 1, 0), info(2, "", 1, 0)]
    };
    map.nodes = vec![QuakeNode {
        plane: 0,
        children: [-2, -1],
        mins: Vec3::splat(-32.0),
        maxs: Vec3::splat(32.0),
        first_face: 0,
        num_faces: 6,
    }];
    let leaf = |contents: i32, visibility: i32, num_faces: u32| QuakeLeaf {
        contents,
        visibility,
        area: i32::from(two),
        mins: Vec3::splat(-32.0),
        maxs: Vec3::splat(32.0),
        first_face: 0,
        num_faces,
        first_brush: 0,
        num_brushes: u32::from(two && num_faces == 0),
        ambient: if two { [0; 4] } else { [1, 2, 3, 4] },
    };
    map.leaf_faces = (0..6).collect();
    map.models = vec![QuakeModel {
        mins: Vec3::splat(-32.0),
        maxs: Vec3::splat(32.0),
        origin: Vec3::ZERO,
        head_nodes: if two { [0; 4] } else { [0, 1, 2, 3] },
        visible_leafs: i32::from(!two),
        first_face: 0,
        num_faces: 6,
    }];
    if two {
        map.leafs = vec![leaf(1, -1, 0), leaf(0, 0, 6)];
        map.leaf_brushes = vec![0];
        map.brushes = vec![QuakeBrush {
            first_side: 0,
            num_sides: 6,
            contents: 0x20,
        }];
        map.brush_sides = (0..6)
            .map(|side| QuakeBrushSide {
                plane: side,
                texinfo: if side == 0 { 1 } else { -1 },
            })
            .collect();
        map.visibility = [1i32, 12, 12].map(i32::to_le_bytes).concat();
        map.visibility.push(1);
        map.others = vec![
            (Lump::Pop, vec![0; 256]),
            (Lump::Areas, vec![0; 8]),
            (Lump::AreaPortals, vec![0; 8]),
        ];
    } else {
        map.leafs = vec![leaf(-2, -1, 0), leaf(-1, 0, 6)];
        map.visibility = vec![1];
        map.others = vec![(Lump::Clipnodes, vec![0; 24])];
    }
    map
}

fn i32_at(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap())
}

#[test]
fn what_is_written_is_read_again() {
    for format in FORMATS {
        let map = room(format);
        let bytes = map.write();
        let mut read = QuakeMap::parse(&bytes).unwrap();
        assert!(read.write() == bytes, "{format}");
        read.directory.clear();
        assert_eq!(read, map, "{format}");
    }
}

/// A record of a written file by its place in the directory, which begins at `start`.
fn record(bytes: &[u8], start: usize, lump: usize, stride: usize, element: usize) -> &[u8] {
    let (offset, length) = (
        i32_at(bytes, start + lump * 8),
        i32_at(bytes, start + 4 + lump * 8),
    );
    assert_eq!(length as usize % stride, 0, "lump {lump}");
    &bytes[offset as usize + element * stride..][..stride]
}

#[test]
fn records_of_quake_have_the_layouts_of_the_format() {
    let bytes = room(Format::Quake).write();
    assert_eq!(i32_at(&bytes, 0), 29);
    let at = |lump, stride, element| record(&bytes, 4, lump, stride, element);
    assert_eq!(
        [f32_at(at(1, 20, 3), 4), f32_at(at(1, 20, 3), 12)],
        [1.0, 32.0]
    );
    assert_eq!(f32_at(at(3, 12, 1), 0), 32.0);
    let node = at(5, 24, 0);
    assert_eq!(
        [
            i32_at(node, 0),
            i32::from(u16_at(node, 4) as i16),
            i32::from(u16_at(node, 6) as i16)
        ],
        [0, -2, -1]
    );
    assert_eq!([u16_at(node, 8) as i16, u16_at(node, 14) as i16], [-32, 32]);
    assert_eq!([u16_at(node, 20), u16_at(node, 22)], [0, 6]);
    let info = at(6, 40, 1);
    assert_eq!(
        [
            f32_at(info, 0),
            f32_at(info, 12),
            f32_at(info, 24),
            f32_at(info, 28)
        ],
        [1.0, 32.0, -1.0, 16.0]
    );
    assert_eq!([i32_at(info, 32), i32_at(info, 36)], [1, 1]);
    let face = at(7, 20, 5);
    assert_eq!([0, 2, 8, 10].map(|o| u16_at(face, o)), [5, 1, 4, 2]);
    assert_eq!([i32_at(face, 4), i32_at(face, 16)], [20, 250]);
    assert_eq!(face[12..16], [0, 7, 255, 255]);
    let leaf = at(10, 28, 1);
    assert_eq!([i32_at(leaf, 0), i32_at(leaf, 4)], [-1, 0]);
    assert_eq!([u16_at(leaf, 20), u16_at(leaf, 22)], [0, 6]);
    assert_eq!(leaf[24..], [1, 2, 3, 4]);
    assert_eq!(u16_at(at(11, 2, 4), 0), 4);
    assert_eq!([u16_at(at(12, 4, 1), 0), u16_at(at(12, 4, 1), 2)], [0, 4]);
    let model = at(14, 64, 0);
    assert_eq!(
        [36, 40, 52, 56, 60].map(|o| i32_at(model, o)),
        [0, 1, 1, 0, 6]
    );

    let bytes = room(Format::Bsp2).write();
    assert_eq!(bytes[..4], *b"BSP2");
    let at = |lump, stride, element| record(&bytes, 4, lump, stride, element);
    let node = at(5, 44, 0);
    assert_eq!(
        [i32_at(node, 4), i32_at(node, 36), i32_at(node, 40)],
        [-2, 0, 6]
    );
    assert_eq!([f32_at(node, 12), f32_at(node, 24)], [-32.0, 32.0]);
    let face = at(7, 28, 5);
    assert_eq!(
        [0, 4, 8, 12, 16, 24].map(|o| i32_at(face, o)),
        [5, 1, 20, 4, 2, 250]
    );
    let leaf = at(10, 44, 1);
    assert_eq!([f32_at(leaf, 8), f32_at(leaf, 20)], [-32.0, 32.0]);
    assert_eq!([i32_at(leaf, 36), i32::from(leaf[43])], [6, 4]);
    assert_eq!(i32_at(at(12, 8, 1), 4), 4);
    let bytes = room(Format::TwoPsb).write();
    assert_eq!(i32_at(record(&bytes, 4, 5, 32, 0), 28), 6);
    assert_eq!(i32_at(record(&bytes, 4, 10, 32, 1), 24), 6);
    assert_eq!(i32_at(&room(Format::GoldSrc).write(), 0), 30);
}

#[test]
fn records_of_quake2_have_the_layouts_of_the_format() {
    let bytes = room(Format::Quake2).write();
    assert_eq!((&bytes[..4], i32_at(&bytes, 4)), (&b"IBSP"[..], 38));
    let at = |lump, stride, element| record(&bytes, 8, lump, stride, element);
    let node = at(4, 28, 0);
    assert_eq!([i32_at(node, 4), i32_at(node, 8)], [-2, -1]);
    assert_eq!(
        [
            u16_at(node, 12) as i16,
            u16_at(node, 18) as i16,
            u16_at(node, 26) as i16
        ],
        [-32, 32, 6]
    );
    let info = at(5, 76, 1);
    assert_eq!(
        [i32_at(info, 32), i32_at(info, 36), i32_at(info, 72)],
        [0x29, 300, -1]
    );
    assert_eq!(info[40..48], *b"e1/pool\0");
    let face = at(6, 20, 5);
    assert_eq!([0, 2, 8, 10].map(|o| u16_at(face, o)), [5, 1, 4, 2]);
    assert_eq!(i32_at(face, 16), 750);
    let leaf = at(8, 28, 0);
    assert_eq!(
        [
            i32_at(leaf, 0),
            i32::from(u16_at(leaf, 4) as i16),
            i32::from(u16_at(leaf, 26))
        ],
        [1, -1, 1]
    );
    let model = at(13, 48, 0);
    assert_eq!([36, 40, 44].map(|o| i32_at(model, o)), [0, 0, 6]);
    assert_eq!([0, 4, 8].map(|o| i32_at(at(14, 12, 0), o)), [0, 6, 0x20]);
    assert_eq!(
        [u16_at(at(15, 4, 1), 0), u16_at(at(15, 4, 1), 2)],
        [1, 65535]
    );

    let bytes = room(Format::Qbism).write();
    assert_eq!(bytes[..4], *b"QBSP");
    let leaf = record(&bytes, 8, 8, 52, 1);
    assert_eq!([4, 8, 40, 48].map(|o| i32_at(leaf, o)), [0, 1, 6, 0]);
    assert_eq!(i32_at(record(&bytes, 8, 15, 8, 1), 4), -1);
    assert_eq!(i32_at(record(&bytes, 8, 4, 44, 0), 40), 6);
}

#[test]
fn rooms_become_maps_of_the_one_model() {
    for format in FORMATS {
        let bsp = Bsp::parse(&room(format).write()).unwrap();
        assert_eq!(bsp.warnings, [], "{format}");
        assert_eq!(bsp.format, format);
        exercise(&bsp);
        assert_eq!(bsp.surfaces.len(), 6);
        for surface in &bsp.surfaces {
            let vertices = bsp.surface_vertices(surface);
            let normal = surface.lightmap_vecs[2];
            // Faces look inwards, and their triangles are clockwise.
            assert!(vertices[0].position.dot(normal) < 0.0, "{format}");
            for corner in bsp.surface_indices(surface).chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|at| vertices[corner[at] as usize].position);
                assert!(
                    (c - a).cross(b - a).normalize().dot(normal) > 0.99,
                    "{format}"
                );
            }
        }
        let wall = &bsp.surfaces[0];
        let size = if two(format) { 1.0 } else { 16.0 };
        for v in bsp.surface_vertices(wall) {
            let p = v.position;
            assert_eq!(
                v.st * size,
                Vec2::new(p.x + p.y + 32.0, 16.0 - p.z),
                "{format}"
            );
            // 64 units are four cells and five texels, and corners lie in the middles of texels.
            let texel =
                v.lightmap * 512.0 - Vec2::new(wall.lightmap_x as f32, wall.lightmap_y as f32);
            let expected = Vec2::new((p.y + 32.0) / 16.0 + 0.5, (32.0 - p.z) / 16.0 + 0.5);
            assert!(
                texel.abs_diff_eq(expected, 1e-3),
                "{format}: {texel} {expected}"
            );
        }
        assert_eq!([wall.lightmap_width, wall.lightmap_height], [5, 5]);
        let page = &bsp.lightmaps[wall.lightmap as usize];
        let stored = if matches!(format, Format::Quake | Format::Bsp2 | Format::TwoPsb) {
            [1, 1, 1]
        } else {
            [2, 2, 3]
        };
        assert_eq!(
            page.texel(wall.lightmap_x as usize + 1, wall.lightmap_y as usize),
            stored,
            "{format}"
        );
        let layers = bsp.layers.surfaces[0];
        assert_eq!(layers.lightmap_styles, [0, 7, 255, 255]);
        let second = page.texel(layers.lightmap_x[0] as usize, layers.lightmap_y[0] as usize);
        let expected = if stored[2] == 1 {
            [13; 3]
        } else {
            [38, 38, 39]
        };
        assert_eq!(second, expected, "{format}");
        assert_eq!(bsp.surfaces[5].lightmap, lightmap_index::WHITE);
        let flags =
            |surface: usize| bsp.shaders[bsp.surfaces[surface].shader as usize].surface_flags;
        assert!(flags(5) & surface_flags::SKY != 0 && flags(0) & surface_flags::SKY == 0);
        let contents = bsp.shaders[bsp.surfaces[4].shader as usize].content_flags;
        assert_eq!(
            contents,
            if two(format) {
                content_flags::WATER
            } else {
                content_flags::LAVA
            }
        );
        assert_eq!((bsp.num_clusters(), bsp.cluster_at(Vec3::ZERO)), (1, 0));
        // It is written as a format that has place for all of it.
        let again = Bsp::parse(&bsp.write()).unwrap();
        assert_eq!(again.format, Format::Fbsp);
        assert_eq!(
            (&again.vertices, &again.surfaces),
            (&bsp.vertices, &bsp.surfaces)
        );
        assert_eq!(
            (&again.layers.surfaces, &again.lightmaps),
            (&bsp.layers.surfaces, &bsp.lightmaps)
        );
    }
}

#[test]
fn names_and_flags_become_materials() {
    let mut map = room(Format::Quake);
    map.textures = textures(
        &[
            ("{grate", 255),
            ("*slime", 0),
            ("sky1", 0),
            ("+0lamp", 230),
            ("+1lamp", 1),
        ],
        Format::Quake,
    );
    map.texinfos.push(Texinfo {
        texture: 3,
        ..map.texinfos[0].clone()
    });
    map.faces[3].texinfo = 3;
    let bsp = Bsp::parse(&map.write()).unwrap();
    let script = bsp.material_script();
    for part in [
        "textures/{grate\n{",
        "alphaFunc GE128",
        "textures/*slime\n{\n\tsurfaceparm slime",
        "tcMod turb",
        "map textures/sky1_back",
        "animMap 5 textures/+0lamp textures/+1lamp",
        "map textures/+0lamp_glow",
    ] {
        assert!(script.contains(part), "{part} in\n{script}");
    }
    let palette = vec![9; 768];
    let holes = bsp.embedded_textures[0].rgba(&palette).unwrap();
    assert_eq!(holes[..4], [9, 9, 9, 0]);
    assert_eq!(
        bsp.embedded_textures[3].glow(&palette).unwrap()[..4],
        [9, 9, 9, 255]
    );
    assert_eq!(bsp.embedded_textures[4].glow(&palette), None);

    let bsp = Bsp::parse(&room(Format::Quake2).write()).unwrap();
    let script = bsp.material_script();
    for part in [
        "textures/e1/pool+warp+66+light300\n{",
        "alphaGen const 0.66",
        "q3map_surfacelight 300",
        "skyparms env/night - -",
        "surfaceparm water",
    ] {
        assert!(script.contains(part), "{part} in\n{script}");
    }
    assert!(!script.contains("stone"));
    let gold = Bsp::parse(&room(Format::GoldSrc).write()).unwrap();
    assert_eq!(
        gold.embedded_textures[0].rgba(&[]).unwrap()[..4],
        [3, 3, 3, 255]
    );
    assert!(
        gold.material_script()
            .contains("skyparms gfx/env/night - -")
    );
}

#[test]
fn sizes_of_textures_are_told_afterwards() {
    let mut bsp = Bsp::parse(&room(Format::Quake2).write()).unwrap();
    let before = bsp.vertices[1].st;
    assert!(bsp.texel_coordinates);
    bsp.resolve_texture_sizes(|name| (name == "textures/e1/stone").then_some((32, 128)));
    assert_eq!(bsp.vertices[1].st * Vec2::new(32.0, 128.0), before);
    bsp.resolve_texture_sizes(|_| Some((1000, 1000)));
    assert_eq!(bsp.vertices[1].st * Vec2::new(32.0, 128.0), before);
}

#[test]
fn errors_name_lump_record_and_byte() {
    for (format, face) in [(Format::Quake, 20), (Format::Qbism, 28)] {
        let broken = |change: &dyn Fn(&mut QuakeMap)| {
            let mut map = room(format);
            change(&mut map);
            let bytes = map.write();
            (Bsp::parse(&bytes).unwrap_err(), bytes)
        };
        let (error, bytes) = broken(&|m| m.faces[2].texinfo = 99);
        let directory = if two(format) { 8 + 6 * 8 } else { 4 + 7 * 8 };
        let start = i32_at(&bytes, directory) as u64;
        assert!(
            matches!(error, Error::At { offset, .. } if offset == start + 2 * face),
            "{error}"
        );
        assert!(
            error
                .to_string()
                .contains("lump faces, element 2: texinfo is 99"),
            "{error}"
        );
        for change in [
            &(|m: &mut QuakeMap| m.faces[1].plane = 999) as &dyn Fn(&mut QuakeMap),
            &|m| m.faces[1].first_edge = -5,
            &|m| m.faces[1].num_edges = 30_000,
            &|m| m.surfedges[0] = i32::MIN,
            &|m| m.edges[1].0[0] = 60_000,
            &|m| m.nodes[0].plane = 999,
            &|m| m.nodes[0].children[0] = 7,
            &|m| m.leaf_faces[0] = 999,
            &|m| m.models[0].num_faces = 999,
            &|m| m.models.clear(),
        ] {
            let (error, _) = broken(change);
            assert!(error.to_string().starts_with("lump "), "{error}");
        }
    }
    let bytes = room(Format::Quake).write();
    let cut = Bsp::parse(&bytes[..bytes.len() - 100])
        .unwrap_err()
        .to_string();
    assert!(cut.contains("outside the file"), "{cut}");
    assert!(matches!(
        Bsp::parse(&bytes[..20]),
        Err(Error::TooShort { .. })
    ));
}

/// Reads; a map must work.
fn survive(bytes: &[u8]) {
    if let Ok(bsp) = Bsp::parse(bytes) {
        exercise(&bsp);
        bsp.material_script();
        for texture in &bsp.embedded_textures {
            texture.rgba(&[0; 768]);
            texture.glow(&[0; 5]);
        }
        // By bytes, as numbers may be none.
        let written = bsp.write();
        assert!(Bsp::parse(&written).unwrap().write() == written);
    }
}

#[test]
fn every_word_may_be_anything() {
    for format in [Format::Quake, Format::Quake2] {
        let bytes = room(format).write();
        for at in (0..bytes.len() - 3).step_by(2) {
            // One of them each, so that the test is done in time.
            let value = [-1i32, 0x7fff_ffff, 1000, 0x7fc0_0000][at / 2 % 4];
            let mut bytes = bytes.clone();
            bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
            if let Ok(bsp) = Bsp::parse(&bytes) {
                exercise(&bsp);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pokes_and_cuts_are_survived(
        format in prop::sample::select(&FORMATS[..]),
        pokes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        cut in any::<Option<prop::sample::Index>>(),
    ) {
        let mut bytes = room(format).write();
        for (at, value) in pokes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        survive(&bytes);
    }

    #[test]
    fn files_survive_the_way_there_and_back(
        format in prop::sample::select(&FORMATS[..]),
        numbers in any::<[u16; 6]>(),
        bounds in any::<[i16; 3]>(),
        axis in prop::array::uniform4(-1e6f32..1e6),
        styles in any::<[u8; 4]>(),
    ) {
        let mut map = room(format);
        let half = |at: usize| i32::from(numbers[at] / 2);
        map.faces[0] = Face {
            plane: u32::from(numbers[0]),
            side: half(1),
            first_edge: i32::from(numbers[2]) << 8,
            num_edges: half(3),
            texinfo: half(4),
            styles,
            light_offset: -i32::from(numbers[5]),
        };
        map.texinfos[0].s = axis;
        map.leafs[0].mins = Vec3::from_array(bounds.map(f32::from));
        map.leafs[0].num_faces = u32::from(numbers[0]);
        map.edges[2] = Edge([u32::from(numbers[1]), u32::from(numbers[2])]);
        let mut read = QuakeMap::parse(&map.write()).unwrap();
        read.directory.clear();
        prop_assert_eq!(read, map);
    }
}
