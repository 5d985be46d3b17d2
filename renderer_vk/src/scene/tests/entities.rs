//! What the game adds: models, persons, shadows, brush models, polygons.

use super::{def, entity, game, gather, room};
use crate::api::{DynamicLight, EntityKind, PolyVert, RefDef, RefEntity, rdflags, renderfx};
use crate::scene::{Look, Scene, ViewScene};
use crate::test_support::Registration;
use glam::{Vec2, Vec3};
use shaders::types::constants as c;

#[test]
fn models_are_lerped_and_placed() {
    let mut game = game();
    let thing = game.model("m/thing.md3");
    assert!(thing > 0);
    assert_eq!(game.model("m/thing.md3"), thing);
    assert_eq!(game.model("m/none.md3"), 0);
    let mut scene = Scene::default();
    let none = RefDef {
        flags: rdflags::NO_WORLD_MODEL,
        ..def()
    };
    let moving = RefEntity {
        model: thing,
        origin: Vec3::new(50.0, 0.0, 0.0),
        frame: 1,
        old_frame: 0,
        backlerp: 0.25,
        shader_time: 0.5,
        shader_rgba: [255, 0, 51, 255],
        skin_num: 1,
        ..entity(EntityKind::Model)
    };
    scene.add_entity(&moving);
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    let view = &views[0];
    let vertex = view.vertices[view.meshes[0].first_vertex as usize];
    assert!(
        (vertex.position.x - 12.0).abs() < 0.02,
        "{}",
        vertex.position
    );
    assert_eq!(vertex.color, u32::MAX);
    let instance = view.instances[view.meshes[0].instance as usize];
    assert_eq!(instance.origin, Vec3::new(50.0, 0.0, 0.0));
    assert_eq!(instance.viewer, Vec3::new(-150.0, 0.0, 0.0));
    assert_eq!(instance.time, 1.5);
    assert!((instance.color[2] - 0.2).abs() < 1e-6);
    // skin 1 of its two is the second material
    assert_eq!(game.materials.get(view.meshes[0].material).name, "t/glass");
    // an entity's own material wins
    let glass = view.meshes[0].material;
    scene.add_entity(&RefEntity {
        custom_shader: i32::try_from(glass).unwrap(),
        skin_num: 0,
        ..moving
    });
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    assert_eq!(views[0].meshes[0].material, glass);
    // a skin without that surface shows the default
    scene.add_entity(&RefEntity {
        custom_skin: 7,
        skin_num: -3,
        ..moving
    });
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    assert_eq!(
        game.materials.get(views[0].meshes[0].material).name,
        "t/wall"
    );
    // behind the eye
    scene.add_entity(&RefEntity {
        origin: Vec3::new(-500.0, 0.0, 0.0),
        ..moving
    });
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    assert!(views[0].meshes.is_empty());
}

#[test]
fn persons_show_where_they_should() {
    let mut game = game();
    let world = room(&mut game);
    let thing = game.model("m/thing.md3");
    let at = |renderfx| RefEntity {
        model: thing,
        renderfx,
        ..entity(EntityKind::Model)
    };
    let mirror = RefEntity {
        origin: Vec3::new(250.0, 0.0, 0.0),
        old_origin: Vec3::new(250.0, 0.0, 0.0),
        ..entity(EntityKind::PortalSurface)
    };
    let mut scene = Scene::default();
    for e in [
        at(renderfx::FIRST_PERSON),
        at(renderfx::THIRD_PERSON),
        mirror,
    ] {
        scene.add_entity(&e);
    }
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    let [behind, main] = views.as_slice() else {
        panic!("the mirror shows no view");
    };
    let flags = |view: &ViewScene| -> Vec<u32> {
        view.meshes
            .iter()
            .filter(|m| m.world_surface.is_none())
            .map(|m| view.instances[m.instance as usize].flags)
            .collect()
    };
    assert_eq!(flags(main), [c::INSTANCE_FIRST_PERSON]);
    assert_eq!(flags(behind), [c::INSTANCE_THIRD_PERSON]);
    assert!(behind.view.mirrored && behind.view.is_portal && !main.view.is_portal);
    assert!(
        behind
            .view
            .origin
            .abs_diff_eq(Vec3::new(600.0, 0.0, 0.0), 1e-3)
    );
    assert!(behind.portals.is_empty() && main.portals.len() == 1);
    // traced: both are there, with their flags, and the mirror is listed
    for e in [
        at(renderfx::FIRST_PERSON),
        at(renderfx::THIRD_PERSON),
        mirror,
    ] {
        scene.add_entity(&e);
    }
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Traced);
    let [view] = views.as_slice() else { panic!() };
    assert_eq!(
        flags(view),
        [c::INSTANCE_FIRST_PERSON, c::INSTANCE_THIRD_PERSON]
    );
    assert!(view.surfaces.is_empty());
    assert_eq!(view.portals.len(), 1);
    assert!(view.portals[0].mirror);
    assert_eq!(
        view.meshes
            .iter()
            .filter(|m| m.world_surface == Some(7))
            .count(),
        2
    );
}

#[test]
fn what_turns_to_the_eye_turns_to_mirrors_too() {
    let mut game = game();
    let world = room(&mut game);
    let sprite = |renderfx| RefEntity {
        origin: Vec3::new(0.0, 40.0, 0.0),
        radius: 5.0,
        renderfx,
        ..entity(EntityKind::Sprite)
    };
    let mirror = RefEntity {
        origin: Vec3::new(250.0, 0.0, 0.0),
        old_origin: Vec3::new(250.0, 0.0, 0.0),
        ..entity(EntityKind::PortalSurface)
    };
    // seen from above
    let turn = glam::Quat::from_rotation_y(0.7);
    let def = RefDef {
        view_axis: [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| turn * axis),
        ..def()
    };
    let mut scene = Scene::default();
    let mut shown = |look, renderfx, mirrored: bool| {
        scene.add_entity(&sprite(renderfx));
        if mirrored {
            scene.add_entity(&mirror);
        }
        let views = gather(&mut scene, &game, Some(&world), &def, look);
        let of_view = |view: &ViewScene| -> Vec<(u8, Vec<Vec3>)> {
            let ours = view.meshes.iter().filter(|m| m.world_surface.is_none());
            let corners = |m: &crate::scene::DynamicMesh| {
                let vertices = view.mesh_geometry(m).vertices;
                vertices.iter().map(|v| v.position).collect()
            };
            ours.map(|m| (m.paths, corners(m))).collect()
        };
        views.iter().flat_map(of_view).collect::<Vec<_>>()
    };
    // the two views of the classic look, the mirror's first
    let classic = shown(Look::Classic, 0, true);
    let traced = shown(Look::Traced, 0, true);
    let [(_, in_mirror), (_, straight_on)] = classic.as_slice() else {
        panic!("{classic:?}");
    };
    let [direct, through] = traced.as_slice() else {
        panic!("{traced:?}");
    };
    let same = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).all(|(a, b)| a.abs_diff_eq(*b, 1.0e-3));
    assert_eq!((direct.0, through.0), (1, 2));
    assert!(same(&direct.1, straight_on) && same(&through.1, in_mirror));
    assert!(!same(&direct.1, &through.1));
    // without a mirror in sight, and for what mirrors do not show, there is one for all
    assert_eq!(shown(Look::Traced, 0, false)[0].0, 0);
    let first_person = shown(Look::Traced, renderfx::FIRST_PERSON, true);
    assert_eq!((first_person.len(), first_person[0].0), (1, 0));
}

#[test]
fn models_cast_planar_shadows_when_asked() {
    let mut game = game();
    let thing = game.model("m/thing.md3");
    let none = RefDef {
        flags: rdflags::NO_WORLD_MODEL,
        ..def()
    };
    let standing = RefEntity {
        model: thing,
        renderfx: renderfx::SHADOW_PLANE | renderfx::THIRD_PERSON,
        origin: Vec3::new(0.0, 0.0, 40.0),
        shadow_plane: 10.0,
        ..entity(EntityKind::Model)
    };
    let mut scene = Scene::default();
    scene.add_entity(&standing);
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    assert!(views[0].meshes.is_empty());
    game.settings.shadows = crate::settings::ModelShadows::Planar;
    scene.add_entity(&standing);
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    let [mesh] = views[0].meshes.as_slice() else {
        panic!("no shadow");
    };
    assert_eq!(Some(mesh.material), game.materials.internal().shadow);
    // without any light the model is flattened straight down? there is none to go by: it keeps to the plane's height
    let first = mesh.first_vertex as usize;
    let flat = &views[0].vertices[first..first + mesh.vertex_count as usize];
    assert!(
        flat.iter().all(|v| (v.position.z - -30.0).abs() < 1e-3),
        "{flat:?}"
    );
}

#[test]
fn opaque_models_cast_shadow_volumes_when_asked() {
    let mut game = game();
    let thing = game.model("m/thing.md3");
    let world = room(&mut game);
    let standing = RefEntity {
        model: thing,
        origin: Vec3::new(0.0, 100.0, 0.0),
        ..entity(EntityKind::Model)
    };
    let volumes = |game: &Registration, entity: RefEntity, look| {
        let mut scene = Scene::default();
        scene.add_entity(&entity);
        let views = gather(&mut scene, game, Some(&world), &def(), look);
        views.last().unwrap().shadows.ranges.clone()
    };
    assert!(volumes(&game, standing, Look::Classic).is_empty());
    game.settings.shadows = crate::settings::ModelShadows::Volumes;
    // one triangle that the sun meets from behind: three sides, two triangles each
    assert_eq!(volumes(&game, standing, Look::Classic), [(0, 18)]);
    assert!(volumes(&game, standing, Look::Traced).is_empty());
    let flags = [
        renderfx::NO_SHADOW,
        renderfx::DEPTH_HACK,
        renderfx::THIRD_PERSON,
    ];
    for renderfx in flags {
        let entity = RefEntity {
            renderfx,
            ..standing
        };
        assert!(volumes(&game, entity, Look::Classic).is_empty());
    }
    // its second material blends
    let glass = RefEntity {
        skin_num: 1,
        ..standing
    };
    assert!(volumes(&game, glass, Look::Classic).is_empty());
}

#[test]
fn brush_models_move_with_their_entity() {
    let mut game = game();
    let world = room(&mut game);
    let door = game.model("*1");
    assert!(door > 0);
    let (mins, maxs) = game.models.bounds(door);
    assert!(mins.max_element() <= -16.0 && maxs.min_element() >= 16.0);
    let mut scene = Scene::default();
    let placed = RefEntity {
        model: door,
        origin: Vec3::new(0.0, 50.0, 0.0),
        ..entity(EntityKind::Model)
    };
    let light = DynamicLight {
        origin: Vec3::new(-40.0, 50.0, 0.0),
        radius: 30.0,
        color: Vec3::ONE,
        additive: false,
    };
    scene.add_entity(&placed);
    scene.add_light(light);
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    let view = &views[0];
    let submodel = view.submodels[0];
    assert_eq!(submodel.model, 1);
    let instance = view.instances[submodel.instance as usize];
    // unlike the world itself it has an entity's light
    assert!(instance.flags & c::INSTANCE_UNLIT == 0 && instance.ambient.x > 0.0);
    let of_door: Vec<_> = view
        .surfaces
        .iter()
        .filter(|s| s.instance == submodel.instance)
        .collect();
    // its front and, seen from the side, one more
    assert!((1..=3).contains(&of_door.len()), "{}", of_door.len());
    // its sides are compared with the light as if they had not moved, and miss it
    let lit = of_door.iter().filter(|s| s.dlights == 1).count();
    assert_eq!(lit, 1, "{}", of_door.len());
    // of several lights the first one counts, whichever reaches the model
    scene.add_entity(&placed);
    scene.add_light(light);
    scene.add_light(light);
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    let of_door = |s: &&crate::scene::DrawSurface| s.instance == submodel.instance;
    let mut lit = views[0].surfaces.iter().filter(of_door);
    assert!(lit.any(|s| s.dlights == 1));
    assert!(
        views[0]
            .surfaces
            .iter()
            .filter(of_door)
            .all(|s| s.dlights < 2)
    );
    scene.add_entity(&placed);
    scene.add_light(DynamicLight {
        radius: 5.0,
        ..light
    });
    scene.add_light(light);
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    assert!(
        views[0]
            .surfaces
            .iter()
            .all(|s| s.dlights & !1 == 0 || s.instance == 0)
    );
    // it asks in vain to be seen in mirrors alone
    scene.add_entity(&RefEntity {
        renderfx: renderfx::THIRD_PERSON,
        ..placed
    });
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    assert_eq!(views[0].submodels.len(), 1);
    // out of the light's reach
    scene.add_entity(&placed);
    scene.add_light(DynamicLight {
        radius: 5.0,
        ..light
    });
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    assert!(views[0].surfaces.iter().all(|s| s.dlights == 0));
    scene.add_entity(&placed);
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Traced);
    assert_eq!(views[0].submodels.len(), 1);
}

#[test]
fn polygons_of_one_material_are_one_mesh() {
    let mut game = game();
    let world = room(&mut game);
    let glass = i32::try_from(game.materials.find(
        &mut game.textures,
        "t/glass",
        crate::assets::LightmapClass::TwoD,
        true,
    ))
    .unwrap();
    let corner = |y: f32, z: f32| PolyVert {
        position: Vec3::new(20.0, y, z),
        st: Vec2::ZERO,
        rgba: [1, 2, 3, 4],
    };
    let quad = [
        corner(0.0, 0.0),
        corner(0.0, 8.0),
        corner(8.0, 8.0),
        corner(8.0, 0.0),
    ];
    let eight: Vec<_> = quad.iter().chain(&quad).copied().collect();
    let mut scene = Scene::default();
    scene.add_poly(glass, &eight, 4);
    scene.add_poly(glass, &quad, 4);
    scene.add_poly(0, &quad, 4);
    scene.add_poly(
        glass,
        &[PolyVert {
            position: Vec3::NAN,
            ..quad[0]
        }; 3],
        3,
    );
    scene.add_poly(-1, &quad, 4);
    scene.add_poly(9999, &quad, 3);
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    let polys: Vec<_> = views[0]
        .meshes
        .iter()
        .filter(|m| m.world_surface.is_none())
        .collect();
    assert_eq!(polys.len(), 2);
    assert_eq!((polys[0].vertex_count, polys[0].index_count), (12, 18));
    assert_eq!(polys[1].material, 0, "a bad handle is the default material");
    let vertex = views[0].vertices[polys[0].first_vertex as usize];
    assert_eq!(vertex.color.to_le_bytes(), [1, 2, 3, 4]);
}
