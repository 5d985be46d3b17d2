//! A made-up map in each of the formats.

use glam::Vec3;
use q3bsp::quake::{
    Edge, Face, QuakeBrush, QuakeBrushSide, QuakeLeaf, QuakeMap, QuakeModel, QuakeNode, QuakePlane,
    Texinfo, quake2_flags,
};
use q3bsp::{Format, Lump};

pub(super) const FORMATS: [Format; 6] = [
    Format::Quake,
    Format::Bsp2,
    Format::TwoPsb,
    Format::GoldSrc,
    Format::Quake2,
    Format::Qbism,
];

pub(super) fn two(format: Format) -> bool {
    matches!(format, Format::Quake2 | Format::Qbism)
}

/// A texture of 16 × 16 texels with all four sizes, and in GoldSrc its palette.
pub(super) fn miptex(name: &str, format: Format, texel: u8) -> Vec<u8> {
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

pub(super) fn textures(names: &[(&str, u8)], format: Format) -> Vec<u8> {
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
pub(super) fn room(format: Format) -> QuakeMap {
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

/// The little-endian word at an offset.
pub(super) fn i32_at(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}
