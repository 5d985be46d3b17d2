//! Broken maps: the reader answers with a map or an error, and every accessor of a map works.

use proptest::prelude::*;
use q3bsp::{Bsp, Child, DrawVert, Error, Lump, PlaneId, ShaderId, tessellate_patch};
use sample::{sample, vert};
use std::sync::LazyLock;
use survive::survive;

#[path = "common/exercise.rs"]
mod exercise;
#[path = "common/sample.rs"]
mod sample;
#[path = "common/survive.rs"]
mod survive;

static SAMPLE: LazyLock<Vec<u8>> = LazyLock::new(|| sample().write());

#[test]
fn the_sample_has_something_in_every_lump() {
    let bsp = Bsp::parse(&SAMPLE).unwrap();
    assert_eq!(bsp.warnings, []);
    for lump in Lump::ALL {
        assert!(bsp.container.lumps[lump.index()].length > 0, "{lump}");
    }
    assert_eq!(bsp.patch_meshes(4.0).iter().flatten().count(), 1);
    assert!(survive(&SAMPLE));
}

#[test]
fn truncation_anywhere_is_an_error() {
    for length in (0..SAMPLE.len()).step_by(37).chain(0..200) {
        assert!(!survive(&SAMPLE[..length]), "{length} bytes were enough");
    }
}

#[test]
fn every_header_byte_may_be_anything() {
    for at in 0..144 {
        for value in [0, 1, 0x7f, 0x80, 0xff] {
            let mut bytes = SAMPLE.clone();
            bytes[at] = value;
            survive(&bytes);
        }
    }
}

/// Every 32-bit word outside the lightmaps, with values that break counts, indices and floats.
#[test]
fn every_word_may_be_anything() {
    let pages = Bsp::parse(&SAMPLE).unwrap().container.lumps[Lump::Lightmaps.index()];
    let pages = pages.offset as usize..(pages.offset + pages.length) as usize;
    let words = (144..SAMPLE.len() - 3).step_by(4);
    let words = words.filter(|at| !pages.contains(at));
    let values = [-1i32, 0x7fff_ffff, i32::MIN, 1000, 0x7fc0_0000];
    testkit::poke_words(&SAMPLE, words, &values, survive);
}

proptest! {
    #![proptest_config(testkit::cases(300))]

    #[test]
    fn several_pokes_at_once(pokes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20)) {
        let mut bytes = SAMPLE.clone();
        for (at, value) in pokes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        survive(&bytes);
    }

    #[test]
    fn noise_behind_a_good_header(noise in prop::collection::vec(any::<u8>(), 0..600)) {
        let mut bytes = b"IBSP\x2e\0\0\0".to_vec();
        bytes.extend(noise);
        survive(&bytes);
    }

    #[test]
    fn entity_text_may_be_anything(text in prop::collection::vec(prop::sample::select(&b"{}\"ab \n/*0"[..]), 0..200)) {
        let (entities, _) = q3bsp::entities::parse(&text);
        // What was read, written and read again is the same, but for quotation marks inside words.
        let entities: Vec<_> = entities
            .into_iter()
            .map(|mut entity| {
                for (key, value) in &mut entity.pairs {
                    *key = key.replace('"', "'");
                    *value = value.replace('"', "'");
                }
                entity
            })
            .collect();
        let (again, warnings) = q3bsp::entities::parse(&q3bsp::entities::write(&entities));
        prop_assert_eq!(again, entities);
        prop_assert_eq!(warnings, vec![]);
    }

    #[test]
    fn patches_of_finite_points_are_finite_and_keep_their_corners(
        half in (1usize..5, 1usize..5),
        seed in prop::collection::vec(-1e6f32..1e6, 81 * 3),
        subdivisions in prop::sample::select(&[0.0f32, 1.0, 4.0, 80.0, f32::NAN, f32::INFINITY][..]),
    ) {
        let (width, height) = (half.0 * 2 + 1, half.1 * 2 + 1);
        let points: Vec<DrawVert> = seed
            .chunks(3)
            .take(width * height)
            .map(|p| vert(p[0], p[1], p[2]))
            .collect();
        let mesh = tessellate_patch(&points, width, height, subdivisions).unwrap();
        prop_assert!(mesh.vertices.iter().all(DrawVert::is_finite));
        prop_assert!(mesh.width <= q3bsp::MAX_GRID_SIZE && mesh.height <= mesh.width);
        let first = mesh.vertices.first().unwrap().position;
        let corners = [points[0], points[width - 1], points[width * (height - 1)], points[width * height - 1]];
        prop_assert!(corners.iter().any(|c| c.position == first));
    }
}

#[test]
fn extreme_patches_end() {
    for value in [0.0, 1e30, f32::MAX, f32::NAN, f32::INFINITY] {
        let points: Vec<DrawVert> = (0..9)
            .map(|at| vert(value * at as f32, value, -value))
            .collect();
        let mesh = tessellate_patch(&points, 3, 3, 4.0).unwrap();
        assert!(mesh.vertices.iter().all(DrawVert::is_finite));
        assert!(
            mesh.column_errors
                .iter()
                .chain(&mesh.row_errors)
                .all(|e| e.is_finite())
        );
    }
    let long: Vec<DrawVert> = (0..3 * 3001)
        .map(|at| vert(at as f32, (at % 7) as f32, 0.0))
        .collect();
    assert!(tessellate_patch(&long, 3001, 3, 4.0).unwrap().width >= 65);
}

#[test]
fn wrong_sizes_are_errors() {
    let points = vec![vert(0.0, 0.0, 0.0); 12];
    for (width, height) in [(4, 3), (3, 4), (1, 12), (3, 3), (usize::MAX, usize::MAX)] {
        assert!(matches!(
            tessellate_patch(&points, width, height, 4.0),
            Err(Error::Patch { .. })
        ));
    }
}

/// Breaks the sample in memory and returns the result of the check.
fn broken(change: impl FnOnce(&mut Bsp)) -> Error {
    let mut bsp = sample();
    change(&mut bsp);
    let error = bsp.validate().unwrap_err();
    assert_eq!(
        Bsp::parse(&bsp.write()).unwrap_err().without_offset(),
        &error
    );
    error
}

#[test]
fn errors_name_lump_element_and_value() {
    for (error, text) in [
        (
            broken(|b| b.nodes[1].plane = PlaneId::from_raw(999)),
            "lump nodes, element 1: planeNum is 999, outside the ",
        ),
        (
            broken(|b| b.nodes[2].children[0] = Child::from_raw(-1000)),
            "lump nodes, element 2: leaf child is 999, outside the ",
        ),
        (
            broken(|b| b.nodes[1].children[0] = Child::from_raw(0)),
            "lump nodes, element 0: number of parents is 2",
        ),
        (
            broken(|b| b.surfaces[3].shader = ShaderId::from_raw(-1)),
            "lump surfaces, element 3: shaderNum is -1, outside the 2 of lump shaders",
        ),
        (
            broken(|b| b.surfaces[0].first_vert = i32::MAX),
            "lump surfaces, element 0: firstVert 2147483647+4 reach outside the ",
        ),
        (
            broken(|b| b.indices[1] = 4),
            "lump drawindexes, element 1: corner is 4, outside the 4 vertices of its surface",
        ),
        (
            broken(|b| b.surfaces[12].patch_width = 4),
            "lump surfaces, element 12: patchWidth is 4, but patches",
        ),
        (
            broken(|b| b.surfaces[0].kind = q3bsp::SurfaceKind::Other(5)),
            "lump surfaces, element 0: surfaceType is 5",
        ),
        (
            broken(|b| b.brushes[1].num_sides = 5),
            "lump fogs, element 0: number of sides of its brush is 5",
        ),
        (broken(|b| b.models.clear()), "lump models is empty"),
    ] {
        assert!(error.to_string().starts_with(text), "{error}");
    }
}

#[test]
fn tolerated_values_are_repaired_and_written_back() {
    let mut bsp = sample();
    bsp.surfaces[0].fog = 7;
    bsp.surfaces[1].lightmap = 1;
    bsp.surfaces[2].num_indices = 5;
    bsp.surfaces[12].num_verts = 1;
    bsp.fogs[0].visible_side = 6;
    bsp.leafs[1].cluster = 99;
    let bytes = bsp.write();
    let mut read = Bsp::parse(&bytes).unwrap();
    assert_eq!(read.warnings.len(), 6, "{:#?}", read.warnings);
    assert_eq!(read.surfaces[0].fog, -1);
    assert_eq!(read.surfaces[1].lightmap, -3);
    assert_eq!(read.surfaces[2].num_indices, 3);
    assert_eq!(read.surfaces[12].num_verts, 9);
    assert_eq!(read.fog_volumes()[0].surface, None);
    assert_eq!(read.leafs[1].cluster, -1);
    assert_eq!(
        read.warnings[1].to_string(),
        "lump fogs, element 0: visibleSide is 6, no side of its brush; taken as none"
    );
    assert!(read.write() == bytes);
    // A value that was changed on purpose is not overwritten by the original.
    read.surfaces[0].fog = 0;
    assert_eq!(Bsp::parse(&read.write()).unwrap().surfaces[0].fog, 0);
}

#[test]
fn unusual_containers_are_kept() {
    // Banner, gaps and an unaligned lump: everything moved by 13 bytes.
    let mut bytes = SAMPLE[..144].to_vec();
    bytes.extend(b"MADE BY HAND\0");
    bytes.extend(&SAMPLE[144..]);
    for lump in 0..17 {
        let at = 8 + lump * 8;
        let offset = i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) + 13;
        bytes[at..at + 4].copy_from_slice(&offset.to_le_bytes());
    }
    bytes.extend(b"trailing");
    let mut bsp = Bsp::parse(&bytes).unwrap();
    assert!(bsp.container.banner().starts_with(b"MADE BY HAND\0"));
    assert!(bsp.write() == bytes);
    // A change of length makes a new layout that reads back and keeps the banner.
    bsp.entities = b"{ classname worldspawn }\0".to_vec();
    let again = Bsp::parse(&bsp.write()).unwrap();
    assert_eq!(again.entities, bsp.entities);
    assert_eq!(again.surfaces, bsp.surfaces);
    assert!(again.container.banner().starts_with(b"MADE BY HAND\0"));
}

#[test]
fn odd_ends_of_lightmaps_grid_and_visibility_are_kept() {
    let mut bsp = sample();
    bsp.container.trailing[Lump::Lightmaps.index()] = vec![1; 1000];
    bsp.container.trailing[Lump::LightGrid.index()] = vec![2; 3];
    let bytes = bsp.write();
    let read = Bsp::parse(&bytes).unwrap();
    assert_eq!((read.lightmaps.len(), read.light_grid()), (1, None));
    assert_eq!(read.warnings.len(), 2);
    assert!(read.write() == bytes);

    let mut bsp = sample();
    bsp.visibility = None;
    bsp.container.trailing[Lump::Visibility.index()] = [9i32, 1].map(i32::to_le_bytes).concat();
    let bytes = bsp.write();
    let read = Bsp::parse(&bytes).unwrap();
    assert_eq!((read.visibility.as_ref(), read.warnings.len()), (None, 1));
    assert!(read.cluster_sees(0, 1) && read.num_clusters() == 2);
    assert!(read.write() == bytes);
}

#[test]
fn foreign_formats_are_named() {
    for (bytes, name) in [
        (&b"IBSP\x30\0\0\0"[..], "\"IBSP\" version 48 (Iron Grip"),
        (b"VBSP\x14\0\0\0", "\"VBSP\" version 20 (Source"),
        (b"PSBI\0\0\0\x2e", "big-endian"),
        (b"FAKK\x0c\0\0\0", "Ritual"),
        (b"PK\x03\x04....", "zip"),
    ] {
        let error = Bsp::parse(bytes).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    assert!(matches!(
        Bsp::parse(b"IBSP\x2e\0\0\0"),
        Err(Error::TooShort { .. })
    ));
    assert!(matches!(Bsp::parse(b""), Err(Error::TooShort { .. })));
}
