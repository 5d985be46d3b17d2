//! Layouts of made-up maps, of hostile ones and of installed ones.

use super::*;
use crate::bake::tests::plain_world;
use crate::materials::Materials;
use glam::{Vec2, Vec3};
use proptest::prelude::*;
use q3bsp::DrawVert;
use q3bsp::builder::MapBuilder;

fn plain(_: &str) -> LightmapUse {
    LightmapUse::default()
}

fn unlit(map: MapBuilder) -> Bsp {
    let mut bsp = map.build();
    bsp.surfaces.iter_mut().for_each(|s| s.lightmap = -3);
    bsp.lightmaps.clear();
    bsp
}

fn room(size: f32) -> Bsp {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("w", 0, 1);
    map.add_room(wall, Vec3::ZERO, Vec3::splat(size));
    unlit(map)
}

fn point(position: Vec3) -> DrawVert {
    DrawVert {
        position,
        st: Vec2::ZERO,
        lightmap: Vec2::ZERO,
        normal: Vec3::Z,
        color: [255; 4],
    }
}

/// Every coordinate lies at least half a texel inside its chart's rectangle, and texels within the border are its own.
fn check(bsp: &Bsp, report: &LayoutReport, border: u32) {
    let side = report.side as f32;
    for (surface, &owner) in bsp.surfaces.iter().zip(&report.owners.of_surface) {
        if owner == NO_OWNER {
            assert!(surface.lightmap < 0);
            continue;
        }
        let (x, y) = (surface.lightmap_x, surface.lightmap_y);
        let (columns, rows) = (surface.lightmap_width, surface.lightmap_height);
        let low = Vec2::new(x as f32, y as f32) + 0.5;
        let high = Vec2::new((x + columns) as f32, (y + rows) as f32) - 0.5;
        for vertex in bsp.surface_vertices(surface) {
            let at = vertex.lightmap * side;
            assert!(at.is_finite());
            assert!(
                at.cmpge(low - 1e-2).all() && at.cmple(high + 1e-2).all(),
                "{at} {low} {high}"
            );
        }
        let page = &report.owners.pages[surface.lightmap as usize];
        let border = border as i32;
        for row in y - border..y + rows + border {
            for column in x - border..x + columns + border {
                let texel = row as usize * report.side as usize + column as usize;
                assert_eq!(page[texel], owner);
            }
        }
    }
    let owned = report.owners.pages.iter().flat_map(|page| page.iter());
    let owned = owned.filter(|owner| **owner != NO_OWNER).count() as u64;
    assert!(owned >= report.texels);
}

#[test]
fn the_texels_of_a_wall_end_on_its_border() {
    let mut bsp = room(128.0);
    let report = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    assert_eq!((report.charts, report.pages), (6, 1));
    check(&bsp, &report, 1);
    let surface = &bsp.surfaces[0];
    assert_eq!((surface.lightmap_width, surface.lightmap_height), (9, 9));
    let written = Bsp::parse(&bsp.write()).unwrap();
    assert_eq!(written.surfaces, bsp.surfaces);
    assert_eq!(written.vertices, bsp.vertices);
    assert!(written.warnings.is_empty(), "{:?}", written.warnings);
}

#[test]
fn finer_texels_are_finer_on_both_axes() {
    let mut bsp = room(128.0);
    make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    let options = LayoutOptions {
        finer: 4.0,
        ..LayoutOptions::internal(&plain)
    };
    let report = make(&mut bsp, &options).unwrap();
    check(&bsp, &report, 1);
    let surface = &bsp.surfaces[0];
    assert_eq!((surface.lightmap_width, surface.lightmap_height), (33, 33));
}

#[test]
fn pieces_of_one_wall_share_a_chart_and_those_of_two_shaders_do_not() {
    let mut map = MapBuilder::new();
    let shaders = [map.add_shader("a", 0, 1), map.add_shader("b", 0, 1)];
    for (x, shader) in [(0.0, 0), (64.0, 0), (128.0, 1)] {
        let corners = [(x, 0.), (x, 64.), (x + 64., 64.), (x + 64., 0.)];
        let corners = corners.map(|(x, y)| Vec3::new(x, y, 0.0));
        map.add_quad(shaders[shader], corners);
    }
    let mut bsp = unlit(map);
    let report = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    assert_eq!(report.charts, 2);
    assert_eq!(report.owners.of_surface[0], report.owners.of_surface[1]);
    // the same place in the world is the same texel
    let (a, b) = (&bsp.vertices[2], &bsp.vertices[5]);
    assert_eq!((a.position, a.lightmap), (b.position, b.lightmap));
    assert_eq!(bsp.surfaces[0].lightmap_width, 9);
}

#[test]
fn only_surfaces_that_show_a_page_get_one() {
    let mut map = MapBuilder::new();
    let names = [
        ("lit", 0),
        ("sky", surface_flags::SKY),
        ("point", surface_flags::POINTLIGHT),
        ("glow", 0),
    ];
    let corners = [(0., 0.), (0., 64.), (64., 64.), (64., 0.)].map(|(x, y)| Vec3::new(x, y, 0.0));
    for (name, flags) in names {
        let shader = map.add_shader(name, flags, 1);
        map.add_quad(shader, corners);
    }
    let lit = map.add_shader("soup", 0, 1);
    map.add_soup(lit, &corners.map(point), &[0, 1, 2]);
    let mut bsp = unlit(map);
    let material = |name: &str| LightmapUse {
        shows_page: name != "glow",
        ..LightmapUse::default()
    };
    let report = make(&mut bsp, &LayoutOptions::internal(&material)).unwrap();
    let pages: Vec<i32> = bsp.surfaces.iter().map(|s| s.lightmap).collect();
    assert_eq!(pages, [0, -3, -3, -3, -3]);
    assert_eq!(report.surfaces, 1);
}

#[test]
fn a_surface_larger_than_a_page_is_coarser_and_reported() {
    let mut bsp = room(8192.0);
    let report = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    check(&bsp, &report, 1);
    assert_eq!(report.coarser.len(), 6);
    assert!((report.coarser[0].used - 8192.0 / 125.0).abs() < 0.01);
    let report = make(&mut room(8192.0), &LayoutOptions::external(&plain)).unwrap();
    assert!(report.coarser.is_empty());
    assert_eq!((report.side, report.pages), (2048, 1));
}

#[test]
fn too_many_pages_are_refused_with_a_factor_that_fits() {
    let mut bsp = room(1024.0);
    let before = bsp.clone().write();
    let options = LayoutOptions {
        finer: 4.0,
        most_pages: 2,
        ..LayoutOptions::internal(&plain)
    };
    // 4 units would take 257 texels: the charts are as large as pages
    let error = make(&mut bsp, &options).unwrap_err();
    let LayoutError::TooMany {
        needed: 6, fits, ..
    } = error
    else {
        panic!("{error}")
    };
    assert_eq!(bsp.write(), before);
    let options = LayoutOptions {
        finer: fits,
        ..options
    };
    assert!(make(&mut bsp, &options).unwrap().pages <= 2);
    let mut empty = MapBuilder::new().build();
    let nothing = make(&mut empty, &LayoutOptions::internal(&plain));
    assert_eq!(nothing, Err(LayoutError::Nothing));
}

#[test]
fn vertices_that_two_surfaces_share_are_copied() {
    let mut bsp = room(128.0);
    // the second wall has the first one's vertices
    let first = bsp.surfaces[0].first_vert;
    bsp.surfaces[1].first_vert = first;
    let report = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    assert_eq!(report.copied_vertices, 4);
    assert_ne!(bsp.surfaces[1].first_vert, first);
    Bsp::parse(&bsp.write()).unwrap();
}

#[test]
fn repaired_page_numbers_do_not_come_back() {
    let mut bsp = room(128.0);
    bsp.surfaces[0].lightmap = 9;
    let sky = bsp.surfaces[1].shader;
    let mut bsp = Bsp::parse(&bsp.write()).unwrap();
    bsp.shaders[sky.index()].surface_flags = 0;
    assert_eq!(bsp.surfaces[0].lightmap, -3);
    // it stays lit by vertex
    bsp.surfaces[0].kind = SurfaceKind::TriangleSoup;
    make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    let written = Bsp::parse(&bsp.write()).unwrap();
    assert_eq!(written.surfaces[0].lightmap, -3);
    assert!(written.warnings.is_empty());
}

fn half_cylinder(map: &mut MapBuilder, radius: f32, height: f32) {
    let wall = map.add_shader("w", 0, 1);
    let around = [(1., 0.), (1., 1.), (0., 1.), (-1., 1.), (-1., 0.)];
    let points: Vec<DrawVert> = [0.0, 0.5, 1.0]
        .into_iter()
        .flat_map(|z| around.map(|(x, y)| Vec3::new(x * radius, y * radius, z * height)))
        .map(point)
        .collect();
    map.add_patch(wall, 5, 3, &points);
}

#[test]
fn a_curve_has_texels_by_the_length_of_its_arc() {
    let mut map = MapBuilder::new();
    half_cylinder(&mut map, 64.0, 128.0);
    let mut bsp = unlit(map);
    let report = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    check(&bsp, &report, 1);
    let surface = &bsp.surfaces[0];
    // two parabolas of 103.9 units at 16 units a texel
    assert_eq!((surface.lightmap_width, surface.lightmap_height), (14, 9));
    // the distance between texels of the tessellated curve varies little
    let mesh = bsp.patch_mesh(surface, 1.0).unwrap();
    let row = &mesh.vertices[..mesh.width];
    let densities = row.windows(2).map(|pair| {
        let texels = (pair[1].lightmap.x - pair[0].lightmap.x) * 128.0;
        pair[1].position.distance(pair[0].position) / texels.abs()
    });
    for density in densities {
        assert!((11.0..21.0).contains(&density), "{density}");
    }
}

#[test]
fn a_flat_patch_shares_the_chart_of_its_wall() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("w", 0, 1);
    let corners = [(0., 0.), (0., 64.), (64., 64.), (64., 0.)].map(|(x, y)| Vec3::new(x, y, 0.0));
    map.add_quad(wall, corners);
    // rows from back to front, seen from above
    let points: Vec<DrawVert> = (0..9)
        .map(|i| Vec3::new(64.0 + (i % 3) as f32 * 32.0, (i / 3) as f32 * 32.0, 0.0))
        .map(point)
        .collect();
    map.add_patch(wall, 3, 3, &points);
    let mut bsp = unlit(map);
    let report = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    assert_eq!(report.charts, 1, "{report:?}");
}

#[test]
fn present_coordinates_give_the_same_charts_as_their_layout() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("w", 0, 1);
    map.add_room(wall, Vec3::ZERO, Vec3::splat(256.0));
    half_cylinder(&mut map, 64.0, 128.0);
    let mut bsp = unlit(map);
    let report = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    let world = plain_world(bsp);
    let found = owners(&world);
    assert_eq!(found.shared, 0);
    let texels = found.pages.iter().zip(&report.owners.pages);
    let mut same = std::collections::BTreeMap::new();
    for (a, b) in texels.flat_map(|(a, b)| a.iter().zip(b)) {
        if *a != NO_OWNER {
            assert_eq!(same.insert(*a, *b).unwrap_or(*b), *b);
        }
    }
    assert_eq!(same.len(), 7);
    // all texels with their border
    let count = |owners: &Owners| {
        let all = owners.pages.iter().flat_map(|page| page.iter());
        all.filter(|owner| **owner != NO_OWNER).count()
    };
    assert_eq!(count(&found), count(&report.owners));
}

#[test]
fn texels_of_two_places_are_counted_as_shared() {
    let mut bsp = room(64.0);
    make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap();
    // the second wall shows the first one's light
    let (first, second) = (bsp.surfaces[0], bsp.surfaces[1]);
    for i in 0..4 {
        let light = bsp.vertices[first.first_vert as usize + i].lightmap;
        bsp.vertices[second.first_vert as usize + i].lightmap = light;
    }
    let world = plain_world(bsp);
    let found = owners(&world);
    assert_eq!(found.shared, 25);
    assert_ne!(found.of_surface[0], found.of_surface[1]);
}

#[test]
fn hostile_positions_are_laid_out_or_left() {
    let values = [f32::NAN, f32::INFINITY, 1e30, -1e30, 0.0, 1e-30, 131_072.0];
    let mut random = testkit::Random::new(3);
    for _ in 0..50 {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("w", 0, 1);
        map.add_room(wall, Vec3::ZERO, Vec3::splat(512.0));
        half_cylinder(&mut map, 64.0, 128.0);
        let mut bsp = unlit(map);
        for _ in 0..6 {
            let at = random.below(bsp.vertices.len());
            let position = &mut bsp.vertices[at].position;
            position[random.below(3)] = values[random.below(values.len())];
        }
        let options = LayoutOptions {
            finer: [1.0, 4.0, 0.0, f32::NAN][random.below(4)],
            ..LayoutOptions::internal(&plain)
        };
        if let Ok(report) = make(&mut bsp, &options) {
            check(&bsp, &report, 1);
        }
    }
}

#[test]
fn a_map_of_many_large_surfaces_is_refused_at_once() {
    let mut map = MapBuilder::new();
    for name in 0..3000 {
        let wall = map.add_shader(&format!("w{name}"), 0, 1);
        let corners = [(0., 0.), (0., 4096.), (4096., 4096.), (4096., 0.)];
        map.add_quad(wall, corners.map(|(x, y)| Vec3::new(x, y, 0.0)));
    }
    let mut bsp = unlit(map);
    let error = make(&mut bsp, &LayoutOptions::internal(&plain)).unwrap_err();
    assert!(
        matches!(error, LayoutError::TooMany { needed: 3000, .. }),
        "{error}"
    );
}

#[test]
fn damaged_maps_are_laid_out_or_refused() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("w", 0, 1);
    map.add_room(wall, Vec3::ZERO, Vec3::splat(512.0));
    half_cylinder(&mut map, 64.0, 128.0);
    let file = unlit(map).write();
    let values = [
        -1,
        1,
        i32::MAX,
        f32::NAN.to_bits() as i32,
        1e30f32.to_bits() as i32,
    ];
    let offsets = (0..file.len() - 4).step_by(8);
    testkit::poke_words(&file, offsets, &values, |damaged| {
        let Ok(mut bsp) = Bsp::parse(damaged) else {
            return false;
        };
        if let Ok(report) = make(&mut bsp, &LayoutOptions::internal(&plain)) {
            check(&bsp, &report, 1);
            Bsp::parse(&bsp.write()).unwrap();
        }
        true
    });
}

proptest! {
    #![proptest_config(testkit::cases(32))]

    #[test]
    fn layouts_of_boxes_keep_their_rules(
        boxes in prop::collection::vec((0u32..40, 0u32..40, 1u32..60, 1u32..60, 0usize..3), 1..30),
        finer in 0.5f32..3.0,
        border in 0u32..5,
    ) {
        let mut map = MapBuilder::new();
        let shaders = ["a", "b", "c"].map(|name| map.add_shader(name, 0, 1));
        for (x, y, width, height, shader) in boxes {
            let mins = Vec3::new(x as f32 * 16.0, y as f32 * 16.0, 0.0);
            let size = Vec3::new(width as f32 * 7.0, height as f32 * 7.0, 96.0);
            map.add_box_faces(shaders[shader], mins, mins + size, false);
        }
        let bsp = unlit(map);
        let options = LayoutOptions { finer, border, ..LayoutOptions::internal(&plain) };
        let mut first = bsp.clone();
        let report = make(&mut first, &options).unwrap();
        check(&first, &report, border);
        let mut second = bsp.clone();
        prop_assert_eq!(&make(&mut second, &options).unwrap(), &report);
        prop_assert_eq!(first.write(), second.write());
        Bsp::parse(&first.write()).unwrap();
    }
}

/// Bytes of each lump of a file.
fn lumps(file: &[u8]) -> Vec<(q3bsp::Lump, Vec<u8>)> {
    let entries = q3bsp::lump_entries(file).unwrap();
    let bytes = |range: q3bsp::LumpRange| {
        let start = range.offset as usize;
        file[start..start + range.length as usize].to_vec()
    };
    entries
        .into_iter()
        .map(|entry| (entry.lump, bytes(entry.range)))
        .collect()
}

#[test]
fn installed_maps_are_laid_out_and_the_rest_of_them_stays() {
    let Some(folder) = testkit::folder() else {
        return;
    };
    let files = crate::files::SearchPath::open(&[folder]).unwrap();
    let (materials, _) = Materials::load(&files);
    let uses = |name: &str| LightmapUse::of(&materials, name);
    use crate::files::GameFiles;
    use q3bsp::Lump;
    for map in ["oa_dm1", "kaos2", "oa_thor", "islandctf", "oa_minia"] {
        let file = files.read(&format!("maps/{map}.bsp")).unwrap().unwrap();
        let mut bsp = Bsp::parse(&file).unwrap();
        let options = LayoutOptions {
            finer: 2.0,
            ..LayoutOptions::internal(&uses)
        };
        let report = make(&mut bsp, &options).unwrap();
        check(&bsp, &report, 1);
        assert!(report.efficiency() > 0.6, "{map}: {report:?}");
        assert!(report.without.is_empty(), "{map}: {report:?}");
        let written = bsp.write();
        Bsp::parse(&written).unwrap();
        for ((lump, before), (_, after)) in lumps(&file).into_iter().zip(lumps(&written)) {
            let changes = matches!(lump, Lump::DrawVerts | Lump::Surfaces | Lump::Lightmaps);
            assert_eq!(before != after, changes, "{map}: {lump}");
        }
    }
}
