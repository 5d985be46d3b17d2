//! Views gathered without a GPU.

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3model::{Frame, Md3, PackedVertex, Surface};
use shaders::types::constants as c;

use super::{Geometry, Look, Scene, ViewScene};
use crate::Error;
use crate::api::{DynamicLight, EntityKind, PolyVert, RefDef, RefEntity, rdflags, renderfx};
use crate::test_support::{PIXEL, Registration, openarena};
use crate::world::WorldData;

const SCRIPT: &[u8] = b"
t/glass
{
  { map t/wall.tga
    blendFunc blend }
}
t/mirror
{
  portal
  { map t/wall.tga
    blendFunc blend
    depthWrite }
}
t/sprite
{
  deformVertexes autosprite
  { map t/wall.tga
    blendFunc add }
}
projectionShadow
{
  deformVertexes projectionShadow
  { map t/wall.tga
    blendFunc blend }
}
t/sky { surfaceparm sky
  skyParms - 200 -
  { map t/wall.tga } }
";

fn model(name: &str) -> Vec<u8> {
    let frame = |x: f32| Frame {
        mins: Vec3::new(x, -8.0, -8.0),
        maxs: Vec3::new(x + 16.0, 8.0, 8.0),
        local_origin: Vec3::ZERO,
        radius: 16.0,
        name: String::new(),
    };
    let corner = |x: f32, y: f32, z: f32| PackedVertex::pack(Vec3::new(x, y, z), Vec3::Z);
    let triangle = |x: f32| {
        [
            corner(x, 0.0, 0.0),
            corner(x + 8.0, 0.0, 0.0),
            corner(x, 8.0, 0.0),
        ]
    };
    Md3 {
        name: name.into(),
        frames: vec![frame(0.0), frame(16.0)],
        tags: Vec::new(),
        num_tags: 0,
        surfaces: vec![Surface {
            name: "body".into(),
            shaders: vec!["t/wall".into(), "t/glass".into()],
            triangles: vec![[0, 1, 2]],
            st: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
            vertices: triangle(0.0).into_iter().chain(triangle(16.0)).collect(),
            num_verts: 3,
        }],
    }
    .write()
}

fn game() -> Registration {
    let md3 = model("m");
    Registration::from_entries(&[
        ("scripts/t.shader", SCRIPT),
        ("t/wall.tga", PIXEL),
        ("m/thing.md3", &md3),
        ("m/thing_1.md3", &md3),
    ])
}

/// A room with a mirror on its +x wall, a sprite in the middle, a sky above, and a brush model.
fn room(game: &mut Registration) -> WorldData {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    let mirror = map.add_shader("t/mirror", 0, 0);
    let sprite = map.add_shader("t/sprite", 0, 0);
    let sky = map.add_shader("t/sky", 4, 0);
    map.add_room(wall, Vec3::splat(-256.0), Vec3::splat(256.0));
    let facing_back = |x: f32, size: f32| {
        // clockwise seen from -x
        [
            Vec3::new(x, size, size),
            Vec3::new(x, -size, size),
            Vec3::new(x, -size, -size),
            Vec3::new(x, size, -size),
        ]
    };
    map.add_quad(mirror, facing_back(250.0, 64.0));
    map.add_quad(sprite, facing_back(100.0, 8.0));
    map.add_quad(
        sky,
        [
            Vec3::new(-100.0, -100.0, 150.0),
            Vec3::new(100.0, -100.0, 150.0),
            Vec3::new(100.0, 100.0, 150.0),
            Vec3::new(-100.0, 100.0, 150.0),
        ],
    );
    let door = map.begin_model();
    assert_eq!(door, 1);
    map.add_box_faces(wall, Vec3::splat(-16.0), Vec3::splat(16.0), false);
    game.build(map.build())
}

fn def() -> RefDef {
    RefDef {
        fov_x: 90.0,
        fov_y: 90.0,
        view_origin: Vec3::new(-100.0, 0.0, 0.0),
        time_ms: 2000,
        ..RefDef::default()
    }
}

fn entity(kind: EntityKind) -> RefEntity {
    RefEntity {
        kind,
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        shader_rgba: [255; 4],
        ..RefEntity::default()
    }
}

fn gather(
    scene: &mut Scene,
    game: &Registration,
    world: Option<&WorldData>,
    def: &RefDef,
    look: Look,
) -> Vec<ViewScene> {
    let views = scene.gather_from(&game.input(world), def, look).unwrap();
    for view in &views {
        check(view, world);
    }
    views
}

/// What must hold for every gathered view of sane entities.
fn check(view: &ViewScene, world: Option<&WorldData>) {
    check_ranges(view, world);
    assert!(
        view.vertices
            .iter()
            .all(|v| v.position.is_finite() && v.normal.is_finite())
    );
}

/// What must hold for every gathered view.
fn check_ranges(view: &ViewScene, world: Option<&WorldData>) {
    assert!(view.surfaces.is_sorted_by_key(|s| s.sort_key));
    assert!(view.vertices.iter().all(|v| v.position.is_finite()));
    for mesh in &view.meshes {
        let first = mesh.first_index as usize;
        let indices = &view.indices[first..first + mesh.index_count as usize];
        let vertices = mesh.first_vertex..mesh.first_vertex + mesh.vertex_count;
        assert!(indices.iter().all(|i| vertices.contains(i)));
        assert!((mesh.instance as usize) < view.instances.len());
    }
    for surface in &view.surfaces {
        assert!((surface.instance as usize) < view.instances.len());
        let (count, range) = match surface.geometry {
            Geometry::Static {
                first_index,
                index_count,
            } => (world.unwrap().indices.len(), (first_index, index_count)),
            Geometry::Dynamic {
                first_index,
                index_count,
            } => (view.indices.len(), (first_index, index_count)),
        };
        assert!(range.0 as usize + range.1 as usize <= count);
    }
}

#[test]
fn the_world_in_sight_is_sorted_and_culled() {
    let mut game = game();
    let world = room(&mut game);
    let mut scene = Scene::new();
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    let [view] = views.as_slice() else { panic!() };
    let sorts: Vec<f32> = view
        .surfaces
        .iter()
        .map(|s| game.materials.get(s.material).sort)
        .collect();
    assert!(sorts.is_sorted(), "{sorts:?}");
    assert_eq!(sorts[0], shaderscript::sort::PORTAL);
    // six walls (the box of the one behind is not wholly outside any one plane), the mirror, the sprite; the sky is
    // listed apart
    assert_eq!(view.surfaces.len(), 8);
    assert_eq!(view.skies.len(), 1);
    assert_eq!(view.meshes.len(), 1);
    assert_eq!(view.meshes[0].world_surface, Some(7));
    // the far plane is at the farthest corner
    let farthest = Vec3::new(356.0, 256.0, 256.0).length();
    assert!((view.view.far - farthest).abs() < 2.0, "{}", view.view.far);
    // the sprite faces the eye
    let first = view.meshes[0].first_vertex as usize;
    assert!(
        view.vertices[first..first + 4]
            .iter()
            .all(|v| (v.position.x - 100.0).abs() < 1e-3)
    );
    scene.recycle(views);
    // looking the other way
    let back = RefDef {
        view_axis: [-Vec3::X, -Vec3::Y, Vec3::Z],
        ..def()
    };
    let views = gather(&mut scene, &game, Some(&world), &back, Look::Classic);
    assert!(views[0].skies.is_empty());
    assert!(
        views[0]
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
    let mut scene = Scene::new();
    let none = RefDef {
        flags: rdflags::NO_WORLD_MODEL,
        ..def()
    };
    scene.add_entity(&RefEntity {
        model: thing,
        ..entity(EntityKind::Model)
    });
    let views = gather(&mut scene, &game, Some(&world), &none, Look::Classic);
    assert!(!views[0].has_world);
    assert_eq!(views[0].surfaces.len(), 1);
    assert_eq!(views[0].view.far, 2048.0);
    let instance = views[0].instances[1];
    assert!(
        instance
            .ambient
            .abs_diff_eq(Vec3::splat(182.0 / 255.0), 1e-5)
    );
    // what was added is gone
    let views = gather(&mut scene, &game, Some(&world), &none, Look::Classic);
    assert!(views[0].surfaces.is_empty());
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    assert!(views[0].surfaces.is_empty());
}

#[test]
fn models_are_lerped_and_placed() {
    let mut game = game();
    let thing = game.model("m/thing.md3");
    assert!(thing > 0);
    assert_eq!(game.model("m/thing.md3"), thing);
    assert_eq!(game.model("m/none.md3"), 0);
    let mut scene = Scene::new();
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
    let mut scene = Scene::new();
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
        1
    );
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
    let mut scene = Scene::new();
    scene.add_entity(&standing);
    let views = gather(&mut scene, &game, None, &none, Look::Classic);
    assert!(views[0].meshes.is_empty());
    game.settings.shadows = 3;
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
        let mut scene = Scene::new();
        scene.add_entity(&entity);
        let views = gather(&mut scene, game, Some(&world), &def(), look);
        views.last().unwrap().shadows.ranges.clone()
    };
    assert!(volumes(&game, standing, Look::Classic).is_empty());
    game.settings.shadows = 2;
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
    let mut scene = Scene::new();
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
    let of_door = |s: &&super::DrawSurface| s.instance == submodel.instance;
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
    let mut scene = Scene::new();
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

#[test]
fn bad_entities_do_no_harm() {
    let mut game = game();
    let world = room(&mut game);
    let mut scene = Scene::new();
    scene.add_entity(&RefEntity {
        origin: Vec3::new(f32::NAN, 0.0, 0.0),
        ..entity(EntityKind::Model)
    });
    let kinds = [
        EntityKind::Model,
        EntityKind::Sprite,
        EntityKind::Beam,
        EntityKind::RailCore,
        EntityKind::RailRings,
        EntityKind::Lightning,
        EntityKind::PortalSurface,
    ];
    for kind in kinds {
        for value in [f32::NAN, f32::INFINITY, 0.0, 1e38] {
            scene.add_entity(&RefEntity {
                axis: [Vec3::splat(value); 3],
                old_origin: Vec3::splat(value),
                model: i32::MIN,
                custom_shader: -1,
                custom_skin: i32::MAX,
                shader_time: value,
                ..entity(kind)
            });
        }
    }
    scene.add_light(DynamicLight {
        radius: -1.0,
        ..DynamicLight::default()
    });
    let views = scene
        .gather_from(&game.input(Some(&world)), &def(), Look::Classic)
        .unwrap();
    assert!(views[0].dlights.is_empty());
    // handle 0 shows its axes
    scene.add_entity(&entity(EntityKind::Model));
    let views = gather(&mut scene, &game, Some(&world), &def(), Look::Classic);
    let axes = game.materials.internal().axes;
    assert!(views[0].meshes.iter().any(|m| m.material == axes));
    scene.add_entity(&entity(EntityKind::Poly));
    let failed = scene.gather_from(&game.input(None), &def(), Look::Classic);
    assert!(matches!(failed, Err(Error::EntityKind { .. })));
}

/// Numbers of a linear congruential generator, often the ones that break things.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 33) as u32
    }

    fn float(&mut self) -> f32 {
        match self.next() % 8 {
            0 => f32::from_bits(self.next()),
            1 => 0.0,
            2 => f32::NAN,
            _ => (self.next() % 2048) as f32 - 1024.0,
        }
    }

    fn vec(&mut self) -> Vec3 {
        Vec3::new(self.float(), self.float(), self.float())
    }

    fn int(&mut self) -> i32 {
        match self.next() % 4 {
            0 => self.next() as i32,
            1 => -1,
            _ => (self.next() % 32) as i32,
        }
    }
}

#[test]
fn random_scenes_stay_within_their_arrays() {
    let mut game = game();
    let world = room(&mut game);
    game.model("m/thing.md3");
    game.settings.shadows = 3;
    let mut numbers = Numbers(1);
    let mut scene = Scene::new();
    for round in 0..200 {
        for _ in 0..20 {
            let kinds = [
                EntityKind::Model,
                EntityKind::Model,
                EntityKind::Sprite,
                EntityKind::Beam,
                EntityKind::RailCore,
                EntityKind::Lightning,
                EntityKind::PortalSurface,
            ];
            scene.add_entity(&RefEntity {
                kind: kinds[numbers.next() as usize % kinds.len()],
                renderfx: numbers.next(),
                model: numbers.int(),
                lighting_origin: numbers.vec(),
                shadow_plane: numbers.float(),
                axis: [numbers.vec(), numbers.vec(), numbers.vec()],
                non_normalized_axes: numbers.next().is_multiple_of(2),
                origin: numbers.vec(),
                frame: numbers.int(),
                old_origin: numbers.vec(),
                old_frame: numbers.int(),
                backlerp: numbers.float(),
                skin_num: numbers.int(),
                custom_skin: numbers.int(),
                custom_shader: numbers.int(),
                radius: numbers.float(),
                rotation: numbers.float(),
                shader_time: numbers.float(),
                ..RefEntity::default()
            });
            scene.add_light(DynamicLight {
                origin: numbers.vec(),
                radius: numbers.float(),
                color: numbers.vec(),
                additive: false,
            });
            let corner = PolyVert {
                position: numbers.vec(),
                ..PolyVert::default()
            };
            let corners = vec![corner; numbers.next() as usize % 9];
            scene.add_poly(numbers.int(), &corners, numbers.next() as usize % 7);
        }
        let def = RefDef {
            view_origin: numbers.vec(),
            view_axis: [numbers.vec(), numbers.vec(), numbers.vec()],
            fov_x: numbers.float(),
            fov_y: numbers.float(),
            time_ms: numbers.int(),
            flags: u32::from(round % 5 == 0),
            ..RefDef::default()
        };
        let look = if round % 2 == 0 {
            Look::Classic
        } else {
            Look::Traced
        };
        let views = scene
            .gather_from(&game.input(Some(&world)), &def, look)
            .unwrap();
        for view in &views {
            check_ranges(view, Some(&world));
        }
        scene.recycle(views);
    }
}

#[test]
fn real_maps_gather_from_every_spawn() {
    let Some(files) = openarena() else { return };
    let mut maps = relight::GameFiles::list(&files, "maps", ".bsp");
    maps.sort();
    let mut game = Registration::new(files);
    for map in &maps {
        let world = game.load(&format!("maps/{map}"));
        let mut scene = Scene::new();
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
            for look in [Look::Classic, Look::Traced] {
                for model in 1..world.models.len() {
                    let handle = game.model(&format!("*{model}"));
                    scene.add_entity(&RefEntity {
                        model: handle,
                        ..entity(EntityKind::Model)
                    });
                }
                let views = gather(&mut scene, &game, Some(&world), &def, look);
                if look == Look::Classic {
                    check_against_leafs(&world, &game, &views[0]);
                    drawn += views[0].surfaces.len();
                    let sky = !views[0].skies.is_empty();
                    assert!(sky || !views[0].surfaces.is_empty(), "{map} at {origin}");
                }
                scene.recycle(views);
            }
        }
        assert!(drawn > 0, "{map}");
    }
}

/// The surfaces in sight are those of the leafs in sight, found here without marks.
fn check_against_leafs(world: &WorldData, game: &Registration, view: &ViewScene) {
    let bsp = &world.relit.bsp;
    let frustum = view.view.frustum();
    let cluster = bsp.cluster_at(view.def.view_origin);
    let corner = |v: [i32; 3]| Vec3::from_array(v.map(|c| c as f32));
    let bounds = |mins, maxs| crate::world::Bounds {
        mins: corner(mins),
        maxs: corner(maxs),
    };
    let mut leafs = Vec::new();
    let mut expected = std::collections::BTreeSet::new();
    let mut pending = vec![0i32];
    while let Some(at) = pending.pop() {
        let Ok(node) = usize::try_from(at) else {
            let leaf = &bsp.leafs[usize::try_from(-1 - at).unwrap()];
            leafs.push(leaf);
            continue;
        };
        let node = &bsp.nodes[node];
        if !crate::world::outside(&bounds(node.mins, node.maxs), &frustum) {
            pending.extend(node.children);
        }
    }
    for leaf in leafs {
        let seen = cluster < 0 || (leaf.cluster >= 0 && bsp.cluster_sees(cluster, leaf.cluster));
        if !seen || crate::world::outside(&bounds(leaf.mins, leaf.maxs), &frustum) {
            continue;
        }
        for &index in bsp.leaf_surface_indices(leaf) {
            let surface = &world.surfaces[usize::try_from(index).unwrap()];
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
    let first_of = |s: &super::DrawSurface| match s.geometry {
        Geometry::Static { first_index, .. } => Some(first_index),
        Geometry::Dynamic { .. } => None,
    };
    let drawn: std::collections::BTreeSet<u32> =
        view.surfaces.iter().filter_map(first_of).collect();
    let meshes = view.meshes.iter().filter_map(|m| m.world_surface);
    let meshes: std::collections::BTreeSet<u32> = meshes
        .map(|s| world.surfaces[s as usize].first_index)
        .collect();
    for first in expected {
        let own = world.surfaces.iter().filter(|s| s.first_index == first);
        // curves have levels of detail, other surfaces perhaps a copy with the stored normal
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
