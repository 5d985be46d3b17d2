//! All maps of an installed OpenArena, against numbers counted independently of this crate; and what holds for the maps
//! of any other pack beside them.

use q3bsp::{Bsp, PatchMesh, SurfaceKind, lightmap_index};
use std::collections::BTreeSet;

#[derive(Default, Debug, PartialEq)]
struct Totals {
    bytes: usize,
    planar: usize,
    patches: usize,
    soups: usize,
    flares: usize,
    vertices: usize,
    pages: usize,
    most_pages: usize,
    entities: usize,
    fogged_maps: usize,
    maps_with_nan: usize,
    surfaces_with_nan: usize,
    maps_without_visibility: usize,
    maps_without_grid: usize,
}

#[test]
fn every_map_is_read_and_written_back() {
    let Some(game) = testkit::game() else { return };
    let mut totals = Totals::default();
    let mut names = BTreeSet::new();
    let mut warned = Vec::new();
    let maps = testkit::for_each_file(&game.packs, ".bsp", |pak, name, bytes| {
        let bsp = match Bsp::parse(bytes) {
            Ok(bsp) => bsp,
            Err(error) => panic!("{pak}/{name}: {error}"),
        };
        assert!(
            bsp.write() == bytes,
            "{pak}/{name} is not written back as it was"
        );

        names.insert(name.to_ascii_lowercase());
        totals.bytes += bytes.len();
        for s in &bsp.surfaces {
            *match s.kind {
                SurfaceKind::Planar => &mut totals.planar,
                SurfaceKind::Patch => &mut totals.patches,
                SurfaceKind::TriangleSoup => &mut totals.soups,
                SurfaceKind::Flare => &mut totals.flares,
                other => panic!("{pak}/{name}: surface type {}", other.raw()),
            } += 1;
        }
        let odd: Vec<_> = bsp
            .surfaces
            .iter()
            .filter(|s| bsp.surface_vertices(s).iter().any(|v| !v.is_finite()))
            .collect();
        assert!(odd.iter().all(|s| s.lightmap == lightmap_index::BY_VERTEX));
        totals.surfaces_with_nan += odd.len();
        totals.maps_with_nan += usize::from(!odd.is_empty());
        totals.vertices += bsp.vertices.len();
        totals.pages += bsp.lightmaps.len();
        totals.most_pages = totals.most_pages.max(bsp.lightmaps.len());
        let (entities, oddities) = q3bsp::entities::parse(&bsp.entities);
        assert_eq!(oddities, [], "{pak}/{name}");
        totals.entities += entities.len();
        totals.fogged_maps += usize::from(!bsp.fogs.is_empty());
        totals.maps_without_visibility += usize::from(bsp.visibility.is_none());
        totals.maps_without_grid += usize::from(bsp.light_grid().is_none());
        for fog in bsp.fog_volumes() {
            assert!(fog.mins.cmplt(fog.maxs).all(), "{pak}/{name}: {fog:?}");
            assert!(fog.surface.is_some());
        }
        check_tree(&bsp);
        for warning in &bsp.warnings {
            warned.push(format!("{pak}/{name}: {warning}"));
        }
    });
    if !game.exact() {
        return;
    }
    assert_eq!(maps, 100);
    assert_eq!(names.len(), 72);
    assert_eq!(totals.bytes / 100_000, 3068);
    totals.bytes = 0;
    assert_eq!(
        totals,
        Totals {
            bytes: 0,
            planar: 207_973,
            patches: 8_440,
            soups: 6_389,
            flares: 7_328,
            vertices: 1_497_844,
            pages: 2_374,
            most_pages: 114,
            entities: 15_293,
            fogged_maps: 34,
            maps_with_nan: 19,
            surfaces_with_nan: 100,
            maps_without_visibility: 1,
            maps_without_grid: 1,
        }
    );
    // One warning per map with NaN, one per flare of aggressor that names a fog which is not there.
    assert_eq!(warned.iter().filter(|w| w.contains("NaN")).count(), 19);
    assert_eq!(warned.iter().filter(|w| w.contains("fogNum")).count(), 74);
    assert_eq!(warned.len(), 19 + 74, "{warned:#?}");
}

/// Directions stored elsewhere in the file agree with winding, patch normals, tree and grid.
#[test]
fn geometry_is_the_right_way_round() {
    let Some(game) = testkit::game() else { return };
    let (mut planar, mut planar_agree) = (0u32, 0u32);
    let (mut patch, mut patch_agree) = (0u32, 0u32);
    let (mut spawns, mut spawns_inside, mut spawns_lit) = (0u32, 0u32, 0u32);
    let maps = testkit::for_each_file(&game.packs, ".bsp", |_, _, bytes| {
        let bsp = Bsp::parse(bytes).unwrap();
        for s in &bsp.surfaces {
            let vertices = bsp.surface_vertices(s);
            if s.kind == SurfaceKind::Planar {
                for t in bsp.surface_indices(s).chunks(3) {
                    let [a, b, c] = [t[0], t[1], t[2]].map(|at| vertices[at as usize]);
                    let normal = (c.position - a.position).cross(b.position - a.position);
                    // Slivers have no direction to speak of.
                    if normal.length() > 1.0 {
                        planar += 1;
                        planar_agree += u32::from(normal.dot(a.normal) > 0.0);
                    }
                }
            }
            if let Some(mesh) = bsp.patch_mesh(s, 4.0) {
                // Corners may have moved with the longer side, but not in space.
                for corner in vertices {
                    let place = |v: &&q3bsp::DrawVert| v.position == corner.position;
                    if let Some(v) = mesh.vertices.iter().find(place) {
                        patch += 1;
                        patch_agree += u32::from(v.normal.dot(corner.normal) > 0.0);
                    }
                }
                for t in mesh.indices().chunks(3) {
                    let [a, b, c] = [t[0], t[1], t[2]].map(|at| mesh.vertices[at as usize]);
                    let normal = (c.position - a.position).cross(b.position - a.position);
                    if normal.length() > 1.0 {
                        patch += 1;
                        patch_agree += u32::from(normal.dot(a.normal + b.normal + c.normal) > 0.0);
                    }
                }
            }
        }
        for entity in bsp.entities() {
            if entity.classname() == "info_player_deathmatch" {
                let camera = entity.vec3("origin").unwrap() + glam::Vec3::Z * 26.0;
                spawns += 1;
                spawns_inside += u32::from(bsp.cluster_at(camera) >= 0 || bsp.num_clusters() == 0);
                let light = bsp
                    .light_grid()
                    .and_then(|grid| grid.sample(&bsp.light_grid, camera));
                spawns_lit += u32::from(light.is_some_and(|l| l.ambient.max_element() > 0.0));
            }
        }
    });
    assert!(maps > 0);
    println!("{planar_agree}/{planar} {patch_agree}/{patch} {spawns_inside}/{spawns} {spawns_lit}");
    assert!(f64::from(planar_agree) > 0.99 * f64::from(planar));
    assert!(f64::from(patch_agree) > 0.99 * f64::from(patch));
    assert!(f64::from(spawns_inside) > 0.99 * f64::from(spawns));
    assert!(f64::from(spawns_lit) > 0.95 * f64::from(spawns));
}

/// Every cluster's leafs are found again from a point inside them.
fn check_tree(bsp: &Bsp) {
    let leafs = bsp.tree_leafs();
    assert!(
        !leafs.iter().any(|leaf| leaf.index() == 0),
        "the dummy leaf is not in the tree"
    );
    let mut hits = 0;
    for &at in &leafs {
        let leaf = bsp.leaf(at);
        let [mins, maxs] = [leaf.mins, leaf.maxs].map(|v| glam::IVec3::from_array(v).as_vec3());
        hits += usize::from(bsp.leaf_at((mins + maxs) * 0.5) == at);
    }
    // Leafs are convex but not boxes, so that not every middle is inside.
    assert!(hits * 2 > leafs.len(), "{hits} of {}", leafs.len());
    for cluster in 0..bsp.num_clusters() {
        let cluster = cluster as i32;
        assert!(bsp.cluster_sees(cluster, cluster));
    }
}

fn check_mesh(mesh: &PatchMesh) {
    assert_eq!(mesh.vertices.len(), mesh.width * mesh.height);
    assert_eq!(
        (mesh.column_errors.len(), mesh.row_errors.len()),
        (mesh.width, mesh.height)
    );
    for v in &mesh.vertices {
        assert!(v.is_finite() && (v.normal.length() - 1.0).abs() < 1e-4);
    }
}

/// What holds for any map, whoever made it. What is no map is refused, with a line that names it.
#[test]
fn maps_of_other_packs_are_read_and_written_back() {
    let Some(game) = testkit::game() else { return };
    let maps = testkit::for_each_file(&game.others, ".bsp", |pack, name, bytes| {
        let bsp = match Bsp::parse(bytes) {
            Ok(bsp) => bsp,
            Err(error) => return println!("{pack}/{name} is refused: {error}"),
        };
        assert!(
            bsp.write() == bytes,
            "{pack}/{name} is not written back as it was"
        );
        for surface in &bsp.surfaces {
            if let Some(mesh) = bsp.patch_mesh(surface, 4.0) {
                check_mesh(&mesh);
            }
        }
        bsp.patch_meshes(4.0).iter().flatten().for_each(check_mesh);
    });
    println!("{maps} maps");
}

#[test]
fn patches_are_tessellated_as_the_engine_does() {
    let Some(game) = testkit::game() else { return };
    // (subdivisions, vertices and triangles before and after stitching)
    let known = [
        (4.0, (139_410, 152_476), Some((140_096, 153_280))),
        (1.0, (311_982, 398_080), None),
        (80.0, (0, 0), Some((54_486, 49_644))),
    ];
    let mut drawn = [0; 3];
    let mut skipped = 0;
    let mut plain = [(0, 0); 3];
    let mut stitched = [(0, 0); 3];
    let mut single = Vec::new();
    let maps = testkit::for_each_file(&game.packs, ".bsp", |pak, name, bytes| {
        let bsp = Bsp::parse(bytes).unwrap();
        for (setting, (subdivisions, ..)) in known.iter().enumerate() {
            let mut own = (0, 0, 0);
            for surface in bsp.surfaces.iter().filter(|s| s.kind == SurfaceKind::Patch) {
                let Some(mesh) = bsp.patch_mesh(surface, *subdivisions) else {
                    skipped += usize::from(setting == 0);
                    continue;
                };
                check_mesh(&mesh);
                own.0 += 1;
                own.1 += mesh.vertices.len();
                own.2 += mesh.indices().len() / 3;
            }
            drawn[setting] += own.0;
            plain[setting].0 += own.1;
            plain[setting].1 += own.2;
            if setting == 0 {
                single.push((pak.to_owned(), name.to_owned(), own));
            }
            for mesh in bsp.patch_meshes(*subdivisions).into_iter().flatten() {
                check_mesh(&mesh);
                stitched[setting].0 += mesh.vertices.len();
                stitched[setting].1 += mesh.indices().len() / 3;
            }
        }
    });
    assert!(maps > 0);
    if !game.exact() {
        return;
    }
    assert_eq!((drawn, skipped), ([5_076; 3], 3_364));
    assert_eq!(plain[0], known[0].1);
    assert_eq!(plain[1], known[1].1);
    for (pak, name, patches) in [
        ("pak1-maps.pk3", "kaos", (193, 5_306, 4_920)),
        ("pak1-maps.pk3", "kaos2", (173, 4_626, 4_280)),
        ("pak1-maps.pk3", "oa_dm3", (182, 4_494, 5_360)),
        ("pak1-maps.pk3", "oa_shouse", (279, 6_099, 5_748)),
        ("pak1-maps.pk3", "czest3ctf", (424, 5_668, 4_820)),
        ("pak1-maps.pk3", "ctf_inyard", (212, 6_872, 6_824)),
        ("pak6-patch088.pk3", "oa_thor", (98, 4_148, 4_672)),
        ("pak6-patch088.pk3", "oa_minia", (271, 5_933, 5_974)),
        ("pak6-patch088.pk3", "pul1ctf", (304, 9_204, 8_904)),
    ] {
        let path = format!("maps/{name}.bsp");
        let found = single
            .iter()
            .find(|(p, n, _)| p == pak && n.eq_ignore_ascii_case(&path));
        assert_eq!(found.map(|f| f.2), Some(patches), "{pak}/{name}");
    }
    assert_eq!(Some(stitched[0]), known[0].2);
    assert_eq!(Some(stitched[2]), known[2].2);
}
