//! The formats beside `IBSP` 46: no game package is at hand, so that files are made by the writer, and the writer is
//! held against the layouts that are known of the formats.

use glam::{Vec2, Vec3};
use proptest::prelude::*;
use q3bsp::builder::MapBuilder;
use q3bsp::{
    Bsp, Error, Format, GridLayers, GridPoint, Lightmap, Lump, ShaderId, SurfaceKind,
    SurfaceLayers, VertexLayers, content_flags, surface_flags,
};
use sample::{advertisement, sample, vert};
use survive::survive;

#[path = "common/exercise.rs"]
mod exercise;
#[path = "common/sample.rs"]
mod sample;
#[path = "common/survive.rs"]
mod survive;

const FORMATS: [Format; 5] = [
    Format::Ibsp46,
    Format::Ibsp47,
    Format::QuakeLive,
    Format::Rbsp,
    Format::Fbsp,
];

/// The sample as a map of a format, with what the format adds.
fn sample_of(format: Format) -> Bsp {
    let mut bsp = sample();
    bsp.format = format;
    let bytes = format.lightmap_size() * format.lightmap_size() * 3;
    bsp.lightmaps = (0..2u8)
        .map(|page| Lightmap((0..bytes).map(|at| (at % 251) as u8 ^ page).collect()))
        .collect();
    if format != Format::Ibsp46 {
        let mut global = bsp.fogs[0].clone();
        (global.brush, global.visible_side) = (-1, -1);
        bsp.fogs.push(global);
    }
    if format.has_layers() {
        bsp.layers.side_surfaces = (0..bsp.brush_sides.len() as i32).collect();
        bsp.layers.vertices = (0..bsp.vertices.len())
            .map(|at| VertexLayers {
                lightmap: [1.0, 2.0, 3.0].map(|layer| Vec2::new(at as f32, layer)),
                color: [[at as u8, 1, 2, 3], [4; 4], [5; 4]],
            })
            .collect();
        bsp.layers.surfaces = vec![
            SurfaceLayers {
                lightmap_styles: [0, 33, 255, 255],
                vertex_styles: [1, 255, 255, 255],
                lightmaps: [1, -3, -3],
                lightmap_x: [7, 8, 9],
                lightmap_y: [10, 11, 12],
            };
            bsp.surfaces.len()
        ];
        let count = bsp.light_grid.len();
        let lit = GridLayers {
            ambient: [[10, 20, 30], [1; 3], [2; 3], [3; 3]],
            directed: [[40, 50, 60], [4; 3], [5; 3], [6; 3]],
            styles: [0, 33, 255, 255],
            longitude: 70,
            latitude: 80,
        };
        let wall = GridLayers {
            styles: [255; 4],
            ..lit
        };
        bsp.layers.grid_points = vec![lit, wall];
        bsp.layers.grid_indices = (0..count).map(|at| (at % 2) as u16).collect();
        bsp.light_grid = (0..count)
            .map(|at| {
                if at % 2 == 0 {
                    lit.first()
                } else {
                    wall.first()
                }
            })
            .collect();
    }
    if format == Format::QuakeLive {
        bsp.advertisements = vec![advertisement()];
    }
    bsp
}

fn i32_at(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// A record of a written file, found by the directory.
fn record(bytes: &[u8], lump: usize, stride: usize, element: usize) -> &[u8] {
    let (offset, length) = (i32_at(bytes, 8 + lump * 8), i32_at(bytes, 12 + lump * 8));
    assert_eq!(length as usize % stride, 0, "lump {lump}");
    &bytes[offset as usize + element * stride..][..stride]
}

#[test]
fn what_is_written_is_read_again() {
    for format in FORMATS {
        let bsp = sample_of(format);
        let bytes = bsp.write();
        let read = Bsp::parse(&bytes).unwrap();
        assert_eq!(read.warnings, [], "{format}");
        assert_eq!(read.format, format);
        assert_eq!(read.vertices, bsp.vertices, "{format}");
        assert_eq!(read.surfaces, bsp.surfaces, "{format}");
        assert_eq!(read.brush_sides, bsp.brush_sides, "{format}");
        assert_eq!(read.layers, bsp.layers, "{format}");
        assert_eq!(read.light_grid, bsp.light_grid, "{format}");
        assert_eq!(read.lightmaps, bsp.lightmaps, "{format}");
        assert_eq!(read.advertisements, bsp.advertisements, "{format}");
        assert_eq!(read.fogs, bsp.fogs, "{format}");
        assert!(read.light_grid().is_some(), "{format}");
        assert!(survive(&bytes), "{format}");
        for lump in format.lumps() {
            assert!(
                read.container.lumps[lump.index()].length > 0,
                "{format}: {lump}"
            );
        }
    }
}

#[test]
fn layered_records_have_the_layouts_of_the_format() {
    for (format, page) in [(Format::Rbsp, 128), (Format::Fbsp, 512)] {
        let mut bsp = sample_of(format);
        bsp.surfaces[3].lightmap = 1;
        bsp.surfaces[3].lightmap_width = 77;
        bsp.surfaces[12].patch_width = 3;
        let bytes = bsp.write();
        let ident: &[u8] = if format == Format::Rbsp {
            b"RBSP"
        } else {
            b"FBSP"
        };
        assert_eq!((&bytes[..4], i32_at(&bytes, 4)), (ident, 1));

        let vertex = record(&bytes, 10, 80, 2);
        let v = &bsp.vertices[2];
        assert_eq!(
            [0, 4, 8].map(|at| f32_at(vertex, at)),
            v.position.to_array()
        );
        assert_eq!([12, 16].map(|at| f32_at(vertex, at)), v.st.to_array());
        assert_eq!([20, 24].map(|at| f32_at(vertex, at)), v.lightmap.to_array());
        assert_eq!(
            [28, 32, 44, 48].map(|at| f32_at(vertex, at)),
            [2.0, 1.0, 2.0, 3.0]
        );
        assert_eq!(
            [52, 56, 60].map(|at| f32_at(vertex, at)),
            v.normal.to_array()
        );
        assert_eq!(vertex[64..68], v.color);
        assert_eq!(vertex[68..80], [2, 1, 2, 3, 4, 4, 4, 4, 5, 5, 5, 5]);

        let surface = record(&bytes, 13, 148, 3);
        let s = &bsp.surfaces[3];
        assert_eq!(
            [0, 8, 12, 16, 20, 24].map(|at| i32_at(surface, at)),
            [
                s.shader.raw(),
                1,
                s.first_vert,
                s.num_verts,
                s.first_index,
                s.num_indices
            ]
        );
        assert_eq!(surface[28..36], [0, 33, 255, 255, 1, 255, 255, 255]);
        assert_eq!(
            [36, 40, 44, 48].map(|at| i32_at(surface, at)),
            [1, 1, -3, -3]
        );
        assert_eq!(
            [52, 56, 68, 72].map(|at| i32_at(surface, at)),
            [0, 7, 0, 10]
        );
        assert_eq!(i32_at(surface, 84), 77);
        let normal = [128, 132, 136].map(|at| f32_at(surface, at));
        assert_eq!(normal, s.lightmap_vecs[2].to_array());
        let patch = record(&bytes, 13, 148, 12);
        assert_eq!([140, 144].map(|at| i32_at(patch, at)), [3, 3]);

        let side = record(&bytes, 9, 12, 4);
        assert_eq!(i32_at(side, 8), 4);
        let point = record(&bytes, 15, 30, 0);
        assert_eq!(point[..6], [10, 20, 30, 1, 1, 1]);
        assert_eq!(point[12..15], [40, 50, 60]);
        assert_eq!(point[24..], [0, 33, 255, 255, 70, 80]);
        assert_eq!(record(&bytes, 17, 2, 1), [1, 0]);
        assert_eq!(i32_at(&bytes, 12 + 14 * 8), 2 * page * page * 3);
    }
}

#[test]
fn quake_live_is_told_by_its_eighteenth_lump() {
    let bytes = sample_of(Format::QuakeLive).write();
    assert_eq!((&bytes[..4], i32_at(&bytes, 4)), (&b"IBSP"[..], 47));
    let advertisement = record(&bytes, 17, 128, 0);
    assert_eq!(
        (i32_at(advertisement, 0), f32_at(advertisement, 12)),
        (5, 1.0)
    );
    assert_eq!(f32_at(advertisement, 16), 1.0);
    assert_eq!(advertisement[64..], [b'*'; 64]);
    // Without it, and with text in its place, the file is one of version 47 without it.
    let mut other = bytes.clone();
    other[144..152].copy_from_slice(b"I LOVE M");
    let read = Bsp::parse(&other).unwrap();
    assert_eq!(
        (read.format, read.advertisements.len()),
        (Format::Ibsp47, 0)
    );
    assert!(read.write() == other);
    let plain = sample_of(Format::Ibsp47).write();
    assert_eq!(Bsp::parse(&plain).unwrap().format, Format::Ibsp47);
}

#[test]
fn flags_of_raven_are_said_in_ours_and_kept() {
    let mut bsp = sample_of(Format::Rbsp);
    bsp.shaders[0].surface_flags = surface_flags::SKY | surface_flags::NODRAW;
    bsp.shaders[0].content_flags = content_flags::WATER;
    let mut bytes = bsp.write();
    let at = i32_at(&bytes, 8 + 8) as usize + 64;
    assert_eq!([i32_at(&bytes, at), i32_at(&bytes, at + 4)], [0x20_2000, 4]);
    // A material number and a bit that only the game defines.
    bytes[at] = 5;
    bytes[at + 5] = 0x80;
    let read = Bsp::parse(&bytes).unwrap();
    let shader = &read.shaders[0];
    assert_eq!(
        shader.surface_flags,
        surface_flags::SKY | surface_flags::NODRAW
    );
    assert_eq!(shader.content_flags, content_flags::WATER);
    assert_eq!(shader.raw_flags, Some([0x20_2005, 0x8004]));
    assert!(read.write() == bytes);
}

#[test]
fn fog_without_a_brush_fills_the_world() {
    let volumes = Bsp::parse(&sample_of(Format::Ibsp47).write())
        .unwrap()
        .fog_volumes();
    assert_eq!(volumes.len(), 2);
    assert!(volumes[1].mins.x < -100_000.0 && volumes[1].maxs.z > 100_000.0);
    let mut bsp = sample();
    bsp.fogs[0].brush = -2;
    assert!(Bsp::parse(&bsp.write()).is_err());
}

#[test]
fn foliage_stands_in_its_places() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("textures/wall", 0, content_flags::SOLID);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let mut place = vert(10.0, 20.0, 30.0);
    place.color = [9; 4];
    let leaf = [
        vert(0.0, 0.0, 0.0),
        vert(0.0, 1.0, 0.0),
        vert(1.0, 0.0, 0.0),
    ];
    let vertices = [&leaf[..], &[place, vert(-50.0, 0.0, 0.0)]].concat();
    let at = map.add_soup(wall, &vertices, &[0, 1, 2]);
    let surface = map.surface_mut(at).unwrap();
    surface.kind = SurfaceKind::Foliage;
    (surface.patch_width, surface.patch_height) = (2, 3);
    let mut bsp = map.build();
    let refused = Bsp::parse(&bsp.write()).unwrap_err().to_string();
    assert!(refused.contains("surfaceType is 5"), "{refused}");
    bsp.format = Format::Ibsp47;
    let read = Bsp::parse(&bsp.write()).unwrap();
    let (vertices, corners) = read.foliage_mesh(&read.surfaces[at]).unwrap();
    assert_eq!(corners, [0, 1, 2, 3, 4, 5]);
    assert_eq!(vertices[1].position, Vec3::new(10.0, 21.0, 30.0));
    assert_eq!(vertices[1].color, [9; 4]);
    assert_eq!(vertices[3].position, Vec3::new(-50.0, 0.0, 0.0));
    // An index may not reach the places.
    let first = read.surfaces[at].first_index as usize;
    bsp.indices[first] = 3;
    assert!(Bsp::parse(&bsp.write()).is_err());
    bsp.indices[first] = 0;
    bsp.surfaces[at].patch_width = 3;
    assert!(Bsp::parse(&bsp.write()).is_err());
}

#[test]
fn a_map_without_layers_is_written_with_constant_light() {
    let mut bsp = sample();
    let page = bsp.lightmaps[0].clone();
    bsp.format = Format::Rbsp;
    let read = Bsp::parse(&bsp.write()).unwrap();
    assert_eq!(read.lightmaps, [page]);
    assert_eq!(read.layers.surfaces[0], SurfaceLayers::default());
    assert_eq!(read.layers.grid_points.len(), 1);
    assert_eq!(read.light_grid, bsp.light_grid);
    assert_eq!(read.light_grid[0].longitude, 30);
    // A grid changed in memory is gathered anew.
    let mut changed = read.clone();
    changed.light_grid[1] = GridPoint {
        ambient: [99; 3],
        ..read.light_grid[0]
    };
    let again = Bsp::parse(&changed.write()).unwrap();
    assert_eq!(again.light_grid, changed.light_grid);
    assert_eq!(again.layers.grid_points.len(), 2);
}

#[test]
fn indices_beyond_the_grid_are_walls_and_warned_about() {
    let mut bsp = sample_of(Format::Rbsp);
    bsp.layers.grid_indices[4] = 900;
    let dark = GridPoint {
        ambient: [0; 3],
        directed: [0; 3],
        longitude: 0,
        latitude: 0,
    };
    bsp.light_grid[4] = dark;
    let bytes = bsp.write();
    let read = Bsp::parse(&bytes).unwrap();
    assert_eq!((read.light_grid[4], read.warnings.len()), (dark, 1));
    assert_eq!(read.warnings[0].lump, Lump::LightArray);
    assert!(read.write() == bytes);
}

#[test]
fn repairs_of_layered_surfaces_are_undone_in_the_right_place() {
    let mut bsp = sample_of(Format::Rbsp);
    bsp.surfaces[1].lightmap = 50;
    bsp.layers.surfaces[2].lightmaps[1] = 51;
    bsp.fogs[0].visible_side = 9;
    let bytes = bsp.write();
    let read = Bsp::parse(&bytes).unwrap();
    assert_eq!(read.warnings.len(), 3, "{:?}", read.warnings);
    assert_eq!(read.surfaces[1].lightmap, -3);
    assert_eq!(read.layers.surfaces[2].lightmaps[1], -3);
    assert!(read.write() == bytes);
}

#[test]
fn errors_name_the_byte() {
    for (format, stride) in [(Format::Ibsp47, 104), (Format::Rbsp, 148)] {
        let mut bsp = sample_of(format);
        bsp.surfaces[2].shader = ShaderId::from_raw(77);
        let bytes = bsp.write();
        let start = i32_at(&bytes, 8 + 13 * 8) as u64;
        match Bsp::parse(&bytes).unwrap_err() {
            Error::At { offset, error } => {
                assert_eq!(offset, start + 2 * stride, "{format}");
                assert!(error.to_string().contains("lump surfaces, element 2"));
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn truncation_anywhere_is_an_error() {
    for format in FORMATS {
        let bytes = sample_of(format).write();
        for length in (0..bytes.len()).step_by(4003).chain(0..160) {
            assert!(!survive(&bytes[..length]), "{format}: {length} were enough");
        }
    }
}

proptest! {
    #![proptest_config(testkit::cases(60))]

    #[test]
    fn pokes_are_survived(
        format in prop::sample::select(&FORMATS[..]),
        pokes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..12),
    ) {
        let mut bytes = sample_of(format).write();
        for (at, value, in_header) in pokes {
            let range = if in_header { 152 } else { bytes.len() };
            bytes[at.index(range)] = value;
        }
        survive(&bytes);
    }

    #[test]
    fn layers_survive_the_way_through_a_file(
        styles in any::<[u8; 4]>(),
        x in any::<[i32; 3]>(),
        colors in any::<[[u8; 4]; 3]>(),
        raw in any::<[u32; 2]>(),
        side in any::<i32>(),
        points in prop::collection::vec((any::<[[u8; 3]; 4]>(), any::<[u8; 4]>(), any::<[u8; 2]>()), 1..20),
    ) {
        let mut bsp = sample_of(Format::Rbsp);
        bsp.layers.surfaces[4].lightmap_styles = styles;
        bsp.layers.surfaces[4].lightmap_x = x;
        bsp.layers.vertices[3].color = colors;
        bsp.layers.side_surfaces[2] = side;
        bsp.layers.grid_points = points
            .into_iter()
            .map(|(light, styles, [longitude, latitude])| GridLayers { ambient: light, directed: light, styles, longitude, latitude })
            .collect();
        bsp.layers.grid_indices.fill(0);
        bsp.light_grid.fill(bsp.layers.grid_points[0].first());
        let mut bytes = bsp.write();
        let at = i32_at(&bytes, 16) as usize + 64;
        bytes[at..at + 4].copy_from_slice(&raw[0].to_le_bytes());
        bytes[at + 4..at + 8].copy_from_slice(&raw[1].to_le_bytes());
        let read = Bsp::parse(&bytes).unwrap();
        prop_assert_eq!(&read.layers, &bsp.layers);
        prop_assert!(read.write() == bytes);
    }
}
