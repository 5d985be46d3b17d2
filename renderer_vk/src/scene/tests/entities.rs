//! Content that the game adds: models, players, shadows, brush models, polygons.

use super::{def, entity, game, gather, gather_traced, room};
use crate::api::{DynamicLight, EntityKind, PolyVert, RefDef, RefEntity, rdflags, renderfx};
use crate::scene::{DrawSurface, Scene, ViewScene};
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
    let views = gather(&mut scene, &game, None, &none);
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
    // skin 1 of its two has the second material
    assert_eq!(game.materials.get(view.meshes[0].material).name, "t/glass");
    // the entity's own material takes precedence
    let glass = view.meshes[0].material;
    scene.add_entity(&RefEntity {
        custom_shader: i32::try_from(glass).unwrap(),
        skin_num: 0,
        ..moving
    });
    let views = gather(&mut scene, &game, None, &none);
    assert_eq!(views[0].meshes[0].material, glass);
    // a skin without that surface has the default material
    scene.add_entity(&RefEntity {
        custom_skin: 7,
        skin_num: -3,
        ..moving
    });
    let views = gather(&mut scene, &game, None, &none);
    assert_eq!(
        game.materials.get(views[0].meshes[0].material).name,
        "t/wall"
    );
    // behind the camera
    scene.add_entity(&RefEntity {
        origin: Vec3::new(-500.0, 0.0, 0.0),
        ..moving
    });
    let views = gather(&mut scene, &game, None, &none);
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
    let views = gather(&mut scene, &game, Some(&world), &def());
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
    // in the traced look both are present, with their flags, and the mirror is listed
    for e in [
        at(renderfx::FIRST_PERSON),
        at(renderfx::THIRD_PERSON),
        mirror,
    ] {
        scene.add_entity(&e);
    }
    let view = gather_traced(&mut scene, &game, Some(&world), &def());
    assert_eq!(
        flags(&view),
        [c::INSTANCE_FIRST_PERSON, c::INSTANCE_THIRD_PERSON]
    );
    assert_eq!(view.look.portals.len(), 1);
    assert!(view.look.portals[0].mirror);
    assert_eq!(
        view.meshes
            .iter()
            .filter(|m| m.world_surface == Some(7))
            .count(),
        2
    );
}

#[test]
fn surfaces_that_face_the_camera_face_it_in_mirrors_too() {
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
    // the camera looks down
    let turn = glam::Quat::from_rotation_y(0.7);
    let def = RefDef {
        view_axis: [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| turn * axis),
        ..def()
    };
    let mut scene = Scene::default();
    let mut shown = |traced: bool, renderfx, mirrored: bool| {
        scene.add_entity(&sprite(renderfx));
        if mirrored {
            scene.add_entity(&mirror);
        }
        let of_view = |view: &ViewScene| -> Vec<(u8, Vec<Vec3>)> {
            let ours = view.meshes.iter().filter(|m| m.world_surface.is_none());
            let corners = |m: &crate::scene::DynamicMesh| {
                let first = m.first_vertex as usize;
                let vertices = &view.vertices[first..first + m.vertex_count as usize];
                vertices.iter().map(|v| v.position).collect()
            };
            ours.map(|m| (m.paths, corners(m))).collect()
        };
        if traced {
            of_view(&gather_traced(&mut scene, &game, Some(&world), &def))
        } else {
            let views = gather(&mut scene, &game, Some(&world), &def);
            views.iter().flat_map(|view| of_view(view)).collect()
        }
    };
    // the two views of the classic look, the mirror's first
    let classic = shown(false, 0, true);
    let traced = shown(true, 0, true);
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
    // one copy where no mirror is visible, and for geometry that mirrors do not show
    assert_eq!(shown(true, 0, false)[0].0, 0);
    let first_person = shown(true, renderfx::FIRST_PERSON, true);
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
    let views = gather(&mut scene, &game, None, &none);
    assert!(views[0].meshes.is_empty());
    game.settings.shadows = crate::settings::ModelShadows::Planar;
    scene.add_entity(&standing);
    let views = gather(&mut scene, &game, None, &none);
    let [mesh] = views[0].meshes.as_slice() else {
        panic!("no shadow");
    };
    assert_eq!(Some(mesh.material), game.materials.internal().shadow);
    // without light there is no shadow direction: the shadow is flattened along z
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
    let volumes = |game: &Registration, entity: RefEntity| {
        let mut scene = Scene::default();
        scene.add_entity(&entity);
        let views = gather(&mut scene, game, Some(&world), &def());
        views.last().unwrap().look.shadows.ranges.clone()
    };
    assert!(volumes(&game, standing).is_empty());
    game.settings.shadows = crate::settings::ModelShadows::Volumes;
    // one triangle that faces away from the sun: three sides, two triangles each
    assert_eq!(volumes(&game, standing), [(0, 18)]);
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
        assert!(volumes(&game, entity).is_empty());
    }
    // its second material blends
    let glass = RefEntity {
        skin_num: 1,
        ..standing
    };
    assert!(volumes(&game, glass).is_empty());
}

/// Instance of a scene's only entity; 0 is the world.
const DOOR: u32 = 1;

/// A brush model that an entity moves.
fn door(game: &mut Registration) -> RefEntity {
    RefEntity {
        model: game.model("*1"),
        origin: Vec3::new(0.0, 50.0, 0.0),
        ..entity(EntityKind::Model)
    }
}

#[test]
fn brush_models_move_with_their_entity() {
    let mut game = game();
    let world = room(&mut game);
    let placed = door(&mut game);
    assert!(placed.model > 0);
    let (mins, maxs) = game.models.bounds(placed.model);
    assert!(mins.max_element() <= -16.0 && maxs.min_element() >= 16.0);
    let mut scene = Scene::default();
    scene.add_entity(&placed);
    let views = gather(&mut scene, &game, Some(&world), &def());
    let instance = views[0].instances[DOOR as usize];
    assert_eq!(instance.origin, placed.origin);
    // unlike the world, it has entity light
    assert!(instance.flags & c::INSTANCE_UNLIT == 0 && instance.ambient.x > 0.0);
    let of_door = |s: &&DrawSurface| s.instance == DOOR;
    // its front and, seen from the side, one more
    let count = views[0].look.surfaces.iter().filter(of_door).count();
    assert!((1..=3).contains(&count), "{count}");
    // the engine ignores `renderfx` of brush models
    scene.add_entity(&RefEntity {
        renderfx: renderfx::THIRD_PERSON,
        ..placed
    });
    let views = gather(&mut scene, &game, Some(&world), &def());
    assert_eq!(views[0].look.surfaces.iter().filter(of_door).count(), count);
    scene.add_entity(&placed);
    let view = gather_traced(&mut scene, &game, Some(&world), &def());
    let [submodel] = view.look.submodels.as_slice() else {
        panic!("{:?}", view.look.submodels);
    };
    assert_eq!((submodel.model, submodel.instance), (1, DOOR));
}

#[test]
fn brush_models_keep_one_bit_for_all_lights() {
    let mut game = game();
    let world = room(&mut game);
    let placed = door(&mut game);
    let light = DynamicLight {
        origin: Vec3::new(-40.0, 50.0, 0.0),
        radius: 30.0,
        color: Vec3::ONE,
        ..DynamicLight::default()
    };
    let short = DynamicLight {
        radius: 5.0,
        ..light
    };
    let mut scene = Scene::default();
    let mut bits = |lights: &[DynamicLight]| -> Vec<u32> {
        scene.add_entity(&placed);
        for light in lights {
            scene.add_light(*light);
        }
        let views = gather(&mut scene, &game, Some(&world), &def());
        let surfaces = views[0].look.surfaces.iter();
        let bits = surfaces.filter(|s| s.instance == DOOR).map(|s| s.dlights);
        bits.collect()
    };
    // its sides are tested with the light as if they had not moved, and are not lit
    let one = bits(&[light]);
    assert_eq!(one.iter().filter(|bits| **bits == 1).count(), 1, "{one:?}");
    // of several lights, the first one's bit is set, whichever reaches the model
    assert_eq!(bits(&[light, light]), one);
    assert!(bits(&[short, light]).iter().all(|bits| bits & !1 == 0));
    assert!(bits(&[short]).iter().all(|bits| *bits == 0));
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
    let views = gather(&mut scene, &game, Some(&world), &def());
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
