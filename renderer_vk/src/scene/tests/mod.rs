//! Tests of gathering, without a GPU.

mod damage;
mod entities;
mod views;

use super::{ClassicScene, Geometry, Scene, TracedScene, ViewScene};
use crate::api::{EntityKind, RefDef, RefEntity};
use crate::test_support::{PIXEL, Registration};
use crate::world::WorldData;
use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3model::{Frame, Md3, PackedVertex, Surface};

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
) -> Vec<ClassicScene> {
    let views = scene.gather_classic(&game.input(world), def).unwrap();
    for view in &views {
        check_finite(view);
        check_ranges(view);
        check_surfaces(view, world);
    }
    views
}

fn gather_traced(
    scene: &mut Scene,
    game: &Registration,
    world: Option<&WorldData>,
    def: &RefDef,
) -> TracedScene {
    let view = scene.gather_traced(&game.input(world), def).unwrap();
    check_finite(&view);
    check_ranges(&view);
    view
}

/// Checks every gathered view of valid entities.
fn check_finite(view: &ViewScene) {
    assert!(
        view.vertices
            .iter()
            .all(|v| v.position.is_finite() && v.normal.is_finite())
    );
}

/// Checks every gathered view.
fn check_ranges(view: &ViewScene) {
    assert!(view.vertices.iter().all(|v| v.position.is_finite()));
    for mesh in &view.meshes {
        let first = mesh.first_index as usize;
        let indices = &view.indices[first..first + mesh.index_count as usize];
        let vertices = mesh.first_vertex..mesh.first_vertex + mesh.vertex_count;
        assert!(indices.iter().all(|i| vertices.contains(i)));
        assert!((mesh.instance as usize) < view.instances.len());
    }
}

/// Checks every gathered view of the classic look.
fn check_surfaces(view: &ClassicScene, world: Option<&WorldData>) {
    assert!(view.look.surfaces.is_sorted_by_key(|s| s.sort_key));
    for surface in &view.look.surfaces {
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
