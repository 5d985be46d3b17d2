//! Damaged files: errors that say where, and nothing worse.

use super::exercise::exercise;
use super::room::{FORMATS, i32_at, room, two};
use glam::Vec3;
use proptest::prelude::*;
use q3bsp::quake::{Edge, Face, QuakeBrush, QuakeMap};
use q3bsp::{Bsp, Error, Format, Lump};

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
#[test]
fn brushes_that_share_their_sides_without_end_are_refused() {
    let mut map = room(Format::Quake2);
    let brush = QuakeBrush {
        first_side: 0,
        num_sides: 60_000,
        ..map.brushes[0]
    };
    map.brush_sides = vec![map.brush_sides[0]; 60_000];
    map.brushes = vec![brush; 60_000];
    let refused = Bsp::parse(&map.write()).unwrap_err();
    assert!(
        matches!(
            refused,
            Error::TooMuchSharing {
                lump: Lump::Brushes,
                ..
            }
        ),
        "{refused}"
    );
}

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
    #![proptest_config(testkit::cases(60))]

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
