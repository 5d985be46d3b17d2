//! Geometry of the map in gathered views.

use super::{def, entity, game, gather, gather_traced, room};
use crate::api::{EntityKind, RefDef, RefEntity, rdflags};
use crate::scene::{ClassicScene, Geometry, Scene};
use crate::test_support::{Registration, openarena};
use crate::world::WorldData;
use glam::Vec3;
use q3bsp::{Child, NodeId};
use support::Aabb;

#[test]
fn the_world_in_sight_is_sorted_and_culled() {
    let mut game = game();
    let world = room(&mut game);
    let mut scene = Scene::default();
    let views = gather(&mut scene, &game, Some(&world), &def());
    let [view] = views.as_slice() else { panic!() };
    let sorts: Vec<f32> = view
        .look
        .surfaces
        .iter()
        .map(|s| game.materials.get(s.material).sort)
        .collect();
    assert!(sorts.is_sorted(), "{sorts:?}");
    assert_eq!(sorts[0], shaderscript::sort::PORTAL);
    // six walls (the box of the one behind is not completely outside any single plane), the mirror, the sprite; the sky
    // is listed separately
    assert_eq!(view.look.surfaces.len(), 8);
    assert_eq!(view.look.skies.len(), 1);
    assert_eq!(view.meshes.len(), 1);
    assert_eq!(view.meshes[0].world_surface, Some(7));
    // the far plane is at the farthest corner
    let farthest = Vec3::new(356.0, 256.0, 256.0).length();
    assert!((view.view.far - farthest).abs() < 2.0, "{}", view.view.far);
    // the sprite faces the camera
    let first = view.meshes[0].first_vertex as usize;
    assert!(
        view.vertices[first..first + 4]
            .iter()
            .all(|v| (v.position.x - 100.0).abs() < 1e-3)
    );
    scene.recycle_classic(views);
    // looking the other way
    let back = RefDef {
        view_axis: [-Vec3::X, -Vec3::Y, Vec3::Z],
        ..def()
    };
    let views = gather(&mut scene, &game, Some(&world), &back);
    assert!(views[0].look.skies.is_empty());
    assert!(
        views[0]
            .look
            .surfaces
            .iter()
            .all(|s| game.materials.get(s.material).sort > 1.0)
    );
}

#[test]
fn without_the_world_only_entities_show() {
    let mut game = game();
    let world = room(&mut game);
    let thing = game.model("m/thing.md3");
    let mut scene = Scene::default();
    let none = RefDef {
        flags: rdflags::NO_WORLD_MODEL,
        ..def()
    };
    scene.add_entity(&RefEntity {
        model: thing,
        ..entity(EntityKind::Model)
    });
    let views = gather(&mut scene, &game, Some(&world), &none);
    assert!(!views[0].has_world);
    assert_eq!(views[0].look.surfaces.len(), 1);
    assert_eq!(views[0].view.far, 2048.0);
    let instance = views[0].instances[1];
    assert!(
        instance
            .ambient
            .abs_diff_eq(Vec3::splat(182.0 / 255.0), 1e-5)
    );
    // the added content is dropped
    let views = gather(&mut scene, &game, Some(&world), &none);
    assert!(views[0].look.surfaces.is_empty());
    let views = gather(&mut scene, &game, None, &none);
    assert!(views[0].look.surfaces.is_empty());
}

#[test]
fn real_maps_gather_from_every_spawn() {
    let Some(files) = openarena() else { return };
    let mut maps = relight::GameFiles::list(&files, "maps", ".bsp");
    maps.sort();
    let mut game = Registration::new(files);
    for map in &maps {
        let world = game.load(&format!("maps/{map}"));
        let mut scene = Scene::default();
        let entities = world.relit.bsp.entities();
        let spawns: Vec<Vec3> = entities
            .iter()
            .filter(|e| e.classname().starts_with("info_player"))
            .filter_map(|e| e.vec3("origin"))
            .collect();
        let mut drawn = 0;
        for (i, &origin) in spawns.iter().enumerate() {
            let forward = Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0);
            let def = RefDef {
                view_origin: origin + Vec3::Z * 26.0,
                view_axis: [forward, Vec3::Z.cross(forward), Vec3::Z],
                time_ms: 12_345,
                ..RefDef::default()
            };
            for traced in [false, true] {
                for model in 1..world.models.len() {
                    let handle = game.model(&format!("*{model}"));
                    scene.add_entity(&RefEntity {
                        model: handle,
                        ..entity(EntityKind::Model)
                    });
                }
                if traced {
                    let view = gather_traced(&mut scene, &game, Some(&world), &def);
                    scene.recycle_traced(view);
                    continue;
                }
                let views = gather(&mut scene, &game, Some(&world), &def);
                check_against_leafs(&world, &game, &views[0]);
                drawn += views[0].look.surfaces.len();
                let sky = !views[0].look.skies.is_empty();
                assert!(
                    sky || !views[0].look.surfaces.is_empty(),
                    "{map} at {origin}"
                );
                scene.recycle_classic(views);
            }
        }
        assert!(drawn > 0, "{map}");
    }
}

/// The visible surfaces are those of the visible leafs, found here without marks.
fn check_against_leafs(world: &WorldData, game: &Registration, view: &ClassicScene) {
    let bsp = &world.relit.bsp;
    let frustum = view.view.frustum();
    let cluster = bsp.cluster_at(view.def.view_origin);
    let corner = |v: [i32; 3]| Vec3::from_array(v.map(|c| c as f32));
    let bounds = |mins, maxs| Aabb::new(corner(mins), corner(maxs));
    let mut leafs = Vec::new();
    let mut expected = std::collections::BTreeSet::new();
    let mut pending = vec![Child::Node(NodeId::ROOT)];
    while let Some(at) = pending.pop() {
        match at {
            Child::Leaf(leaf) => leafs.push(bsp.leaf(leaf)),
            Child::Node(node) => {
                let node = bsp.node(node);
                if !crate::world::outside(&bounds(node.mins, node.maxs), &frustum) {
                    pending.extend(node.children);
                }
            }
        }
    }
    for leaf in leafs {
        let seen = cluster < 0 || (leaf.cluster >= 0 && bsp.cluster_sees(cluster, leaf.cluster));
        if !seen || crate::world::outside(&bounds(leaf.mins, leaf.maxs), &frustum) {
            continue;
        }
        for id in bsp.leaf_surface_ids(leaf) {
            let surface = &world.surfaces[id.index()];
            let material = game.materials.get(surface.material);
            let turned_away = surface.plane.is_some_and(|p| {
                let distance = p.distance(view.view.origin);
                match material.cull {
                    shaderscript::Cull::Front => distance < 0.0,
                    shaderscript::Cull::Back => distance > 0.0,
                    shaderscript::Cull::None => false,
                }
            });
            if surface.index_count > 0
                && !surface.sky
                && !turned_away
                && !crate::world::outside(&surface.bounds, &frustum)
            {
                expected.insert(surface.first_index);
            }
        }
    }
    let first_of = |s: &crate::scene::DrawSurface| match s.geometry {
        Geometry::Static { first_index, .. } => Some(first_index),
        Geometry::Dynamic { .. } => None,
    };
    let drawn: std::collections::BTreeSet<u32> =
        view.look.surfaces.iter().filter_map(first_of).collect();
    let meshes = view.meshes.iter().filter_map(|m| m.world_surface);
    let meshes: std::collections::BTreeSet<u32> = meshes
        .map(|s| world.surfaces[s as usize].first_index)
        .collect();
    for first in expected {
        let own = world.surfaces.iter().filter(|s| s.first_index == first);
        // curves have levels of detail, others may have a copy with the stored normal
        let curve = own.clone().any(|s| s.lod.is_some());
        let mut copies = own.filter_map(|s| s.classic.map(|copy| copy.first_index));
        assert!(
            curve
                || drawn.contains(&first)
                || meshes.contains(&first)
                || copies.any(|copy| drawn.contains(&copy)),
            "index {first}"
        );
    }
}
