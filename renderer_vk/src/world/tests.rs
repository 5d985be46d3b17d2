//! Tests of worlds without a GPU: visibility, decals, fog, light.

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, GridPoint};
use support::Aabb;

use super::{Marked, Marker};
use super::{VisibleQuery, VisibleSet, WorldData};
use crate::settings::Settings;
use crate::test_support::{PIXEL, Registration, openarena};

fn game() -> Registration {
    Registration::from_entries(&[
        ("t/wall.tga", PIXEL),
        (
            "scripts/t.shader",
            b"t/nomarks\n{\nsurfaceparm nomarks\n{\nmap t/wall.tga\n}\n}\nt/lit\n{\n{\nmap $lightmap\n}\n{\nmap t/wall.tga\n\
              blendFunc filter\n}\n}\nt/mist\n{\nsurfaceparm fog\nfogParms ( 0.5 0.25 1 ) 300\n}\n\
              t/murk\n{\nsurfaceparm water\nsurfaceparm trans\nfogParms ( 0.2 0.3 0.3 ) 1024\n\
              {\nmap $whiteimage\nblendFunc filter\nrgbGen const ( 1 0.5 0.25 )\n}\n}\n",
        ),
    ])
}

/// Two rooms side by side along x, mutually invisible.
fn two_rooms(game: &mut Registration) -> WorldData {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    let a = map.add_room(wall, Vec3::splat(0.0), Vec3::splat(256.0));
    let b = map.add_room(
        wall,
        Vec3::new(256.0, 0.0, 0.0),
        Vec3::new(512.0, 256.0, 256.0),
    );
    map.set_sees(a, b, false);
    map.set_sees(b, a, false);
    game.build(map.build())
}

fn visible(world: &WorldData, at: Vec3, frustum: &[glam::Vec4]) -> Vec<u32> {
    let mut set = VisibleSet::default();
    set.gather(
        world,
        &VisibleQuery {
            pvs_origin: at,
            area_mask: &[0; 32],
            frustum,
            culls: true,
            no_vis: false,
            locked: false,
            show_cluster: 0,
        },
    );
    let mut surfaces = set.surfaces.clone();
    surfaces.sort_unstable();
    surfaces
}

#[test]
fn a_room_sees_its_own_walls() {
    let mut game = game();
    let world = two_rooms(&mut game);
    let in_first = visible(&world, Vec3::splat(128.0), &[]);
    assert!((0..6).all(|s| in_first.contains(&s)), "{in_first:?}");
    // the shared wall may be listed by both rooms; the far walls are not
    assert!(
        !in_first.contains(&6) || !in_first.contains(&7),
        "{in_first:?}"
    );
    let outside = visible(&world, Vec3::splat(-500.0), &[]);
    assert_eq!(outside, (0..12).collect::<Vec<_>>());
    // a plane that excludes the first room
    let plane = Vec3::X.extend(300.0);
    assert!(visible(&world, Vec3::splat(128.0), &[plane]).is_empty());
}

#[test]
fn hidden_areas_and_no_vis() {
    let mut game = game();
    let world = two_rooms(&mut game);
    let mut set = VisibleSet::default();
    let mut query = VisibleQuery {
        pvs_origin: Vec3::splat(128.0),
        area_mask: &[0xFF; 32],
        frustum: &[],
        culls: true,
        no_vis: false,
        locked: false,
        show_cluster: 0,
    };
    set.gather(&world, &query);
    assert!(set.surfaces.is_empty());
    query.no_vis = true;
    set.gather(&world, &query);
    assert_eq!(set.surfaces.len(), 12);
    // locked: the visible set stays when the camera moves
    query.no_vis = false;
    query.area_mask = &[0; 32];
    set.gather(&world, &query);
    let before = set.surfaces.clone();
    query.locked = true;
    query.pvs_origin = Vec3::new(400.0, 100.0, 100.0);
    set.gather(&world, &query);
    assert_eq!(set.surfaces, before);
}

fn quad_corners(size: f32, z: f32) -> [Vec3; 4] {
    // counter-clockwise seen from above, as games send decals
    [
        Vec3::new(-size, -size, z),
        Vec3::new(-size, size, z),
        Vec3::new(size, size, z),
        Vec3::new(size, -size, z),
    ]
}

fn floor_map(game: &mut Registration, material: &str) -> WorldData {
    let mut map = MapBuilder::new();
    let shader = map.add_shader(material, 0, 0);
    // clockwise seen from above
    map.add_quad(
        shader,
        [
            Vec3::new(-100.0, -100.0, 0.0),
            Vec3::new(-100.0, 100.0, 0.0),
            Vec3::new(100.0, 100.0, 0.0),
            Vec3::new(100.0, -100.0, 0.0),
        ],
    );
    game.build(map.build())
}

fn mark(
    game: &Registration,
    world: &WorldData,
    points: &[Vec3],
    limits: (usize, usize),
) -> (f32, usize) {
    let projection = Vec3::new(0.0, 0.0, -20.0);
    let marked = Marked {
        world,
        materials: &game.materials,
        on_meshes: false,
    };
    let mut marker = Marker::default();
    let (corners, fragments) = marker.mark(marked, points, projection, limits.0, limits.1);
    let mut area = 0.0;
    for fragment in fragments {
        let piece = &corners[fragment.first_point..][..fragment.num_points];
        for pair in piece[1..].windows(2) {
            area += (pair[0] - piece[0]).cross(pair[1] - piece[0]).length() * 0.5;
        }
    }
    (area, fragments.len())
}

#[test]
fn a_decal_covers_its_own_area() {
    let mut game = game();
    let world = floor_map(&mut game, "t/wall");
    assert_eq!(world.surfaces[0].plane.unwrap().normal, Vec3::Z);
    let mut points = quad_corners(10.0, 1.0);
    let (area, fragments) = mark(&game, &world, &points, (384, 128));
    assert!((area - 400.0).abs() < 1.0, "{area}");
    assert_eq!(fragments, 2);
    // with reversed winding the planes face outwards and nothing remains
    points.reverse();
    assert_eq!(mark(&game, &world, &points, (384, 128)).1, 0);
}

#[test]
fn decals_respect_limits_flags_and_distance() {
    let mut game = game();
    let world = floor_map(&mut game, "t/wall");
    let points = quad_corners(10.0, 1.0);
    assert_eq!(mark(&game, &world, &points, (384, 1)).1, 1);
    assert_eq!(mark(&game, &world, &points, (5, 128)).1, 1);
    assert_eq!(mark(&game, &world, &points, (2, 128)).1, 0);
    assert_eq!(mark(&game, &world, &points, (384, 0)).1, 0);
    assert_eq!(mark(&game, &world, &[], (384, 128)).1, 0);
    assert_eq!(mark(&game, &world, &[Vec3::NAN; 4], (384, 128)).1, 0);
    // more than 20 units behind the floor, and more than the sweep's length above it
    assert_eq!(
        mark(&game, &world, &quad_corners(10.0, -25.0), (384, 128)).1,
        0
    );
    assert_eq!(
        mark(&game, &world, &quad_corners(10.0, 40.0), (384, 128)).1,
        0
    );
    let mut game = self::game();
    let world = floor_map(&mut game, "t/nomarks");
    assert_eq!(mark(&game, &world, &points, (384, 128)).1, 0);
}

#[test]
fn surfaces_without_a_stored_plane_take_no_decals() {
    let mut game = game();
    let mut map = MapBuilder::new();
    let shader = map.add_shader("t/wall", 0, 0);
    let floor = map.add_quad(shader, quad_corners(100.0, 0.0));
    map.surface_mut(floor).unwrap().lightmap_vecs[2] = Vec3::ZERO;
    let world = game.build(map.build());
    assert_eq!(world.surfaces[0].plane.unwrap().normal, Vec3::Z);
    assert_eq!(
        mark(&game, &world, &quad_corners(10.0, 1.0), (384, 128)).1,
        0
    );
}

#[test]
fn curves_take_decals_and_have_levels() {
    let mut game = game();
    let mut map = MapBuilder::new();
    let shader = map.add_shader("t/wall", 0, 0);
    let point = |x: f32, y: f32, z: f32| DrawVert {
        position: Vec3::new(x, y, z),
        st: Vec2::ZERO,
        lightmap: Vec2::ZERO,
        normal: Vec3::Z,
        color: [255; 4],
    };
    // an arch: flat along y, bent along x; rows run so that its front is above
    let mut points = Vec::new();
    for y in [-100.0, 0.0, 100.0] {
        for x in [-100.0, 0.0, 100.0] {
            points.push(point(x, y, if x == 0.0 { 100.0 } else { 0.0 }));
        }
    }
    map.add_patch(shader, 3, 3, &points);
    let world = game.build(map.build());
    let surface = &world.surfaces[0];
    let lod = surface.lod.as_ref().unwrap();
    let near = lod.choose(0.0, 250.0);
    let far = lod.choose(100_000.0, 250.0);
    assert_eq!(near, (surface.first_index, surface.index_count));
    assert!(far.1 < near.1, "{far:?} {near:?}");
    assert!(
        world.indices[far.0 as usize..][..far.1 as usize]
            .iter()
            .all(|&i| (i as usize) < world.vertices.len())
    );
    let (area, fragments) = mark(&game, &world, &quad_corners(10.0, 52.0), (384, 128));
    let (flipped, _) = mark(&game, &world, &quad_corners(10.0, 48.0), (384, 128));
    assert!(fragments > 0 && area > 100.0, "{area}");
    assert!(flipped > 100.0);
}

#[test]
fn fog_volumes_take_in_spheres_and_boxes() {
    let mut game = game();
    let mut map = MapBuilder::new();
    let mist = map.add_shader("t/mist", 0, 0x40);
    map.add_fog_brush(mist, Vec3::ZERO, Vec3::splat(100.0), 5);
    let world = game.build(map.build());
    assert_eq!(world.fogs.len(), 1);
    let fog = &world.fogs[0];
    assert_eq!((fog.color, fog.depth), (Vec3::new(0.5, 0.25, 1.0), 300.0));
    assert_eq!(fog.has_surface, 1);
    // depth below the surface is positive inside
    let [x, y, z, w] = fog.plane;
    assert!(Vec3::new(x, y, z).dot(Vec3::splat(50.0)) - w > 0.0);
    assert_eq!(world.fog_of_sphere(Vec3::splat(50.0), 1.0), 1);
    assert_eq!(world.fog_of_sphere(Vec3::new(110.0, 50.0, 50.0), 9.0), 0);
    assert_eq!(world.fog_of_sphere(Vec3::new(110.0, 50.0, 50.0), 11.0), 1);
    let bounds = |x: f32| Aabb::new(Vec3::splat(x), Vec3::splat(x + 1.0));
    assert_eq!(world.fog_of_box(&bounds(50.0)), 1);
    assert_eq!(world.fog_of_box(&bounds(150.0)), 0);
}

/// Compilers make fog of a liquid that has `fogParms`, but not of every one.
#[test]
fn a_liquid_absorbs_unless_it_is_fog() {
    for is_fog in [true, false] {
        let mut game = game();
        let mut map = MapBuilder::new();
        let murk = map.add_shader("t/murk", 0, 0x20);
        map.add_room(murk, Vec3::ZERO, Vec3::splat(100.0));
        if is_fog {
            map.add_fog_brush(murk, Vec3::ZERO, Vec3::splat(100.0), 5);
        }
        let world = game.build(map.build());
        let liquid = game.materials.get(world.surfaces[0].material).dielectric;
        assert!(liquid.index > 1.0);
        assert_eq!(liquid.absorption == Vec3::ZERO, is_fog);
    }
}

#[test]
fn grid_light_is_shifted_then_scaled() {
    let mut game = game();
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let bsp = map.build_with_grid(Vec3::splat(64.0), |_| GridPoint {
        ambient: [10, 20, 30],
        directed: [200, 100, 50],
        longitude: 0,
        latitude: 0,
    });
    let world = game.build(bsp);
    let light = world.grid_light(Vec3::ZERO, &Settings::default()).unwrap();
    assert!(
        light.ambient.abs_diff_eq(Vec3::new(24.0, 48.0, 72.0), 1e-3),
        "{}",
        light.ambient
    );
    assert!(
        light
            .directed
            .abs_diff_eq(Vec3::new(255.0, 127.0, 63.0), 1e-3),
        "{}",
        light.directed
    );
    assert_eq!(light.direction, Vec3::Z);
}

#[test]
fn the_map_can_remap_materials() {
    let mut game = game();
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    map.set_world_key("remapShader1", "t/wall;t/nomarks");
    let world = game.build(map.build());
    let drawn = game.materials.resolve(world.surfaces[0].material);
    assert_eq!(game.materials.get(drawn).name, "t/nomarks");
}

#[test]
fn lightmap_stages_are_white_only_in_maps_with_lightmaps() {
    for has_lightmaps in [false, true] {
        let mut game = game();
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/lit", 0, 0);
        map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
        let mut bsp = map.build();
        // as q3map2 -meta writes them
        for surface in &mut bsp.surfaces {
            surface.lightmap = q3bsp::lightmap_index::BY_VERTEX;
        }
        bsp.lightmaps.clear();
        if has_lightmaps {
            bsp.lightmaps
                .push(q3bsp::Lightmap(vec![255; 128 * 128 * 3].into()));
        }
        let world = game.build(bsp);
        let material = game.materials.get(world.surfaces[0].material);
        let flags = game.materials.stages(material)[0].flags;
        let white = flags & shaders::types::constants::STAGE_NO_LIGHTMAP != 0;
        assert_eq!(white, has_lightmaps);
    }
}

#[test]
fn levels_of_real_curves_are_exact() {
    let Some(files) = openarena() else { return };
    let mut maps = relight::GameFiles::list(&files, "maps", ".bsp");
    maps.sort();
    let mut game = Registration::new(files);
    let mut curves = 0;
    for map in maps.iter().step_by(5) {
        let world = game.load(&format!("maps/{map}"));
        let meshes = world.relit.bsp.patch_meshes(4.0);
        for (surface, mesh) in world.surfaces.iter().zip(&meshes) {
            let (Some(lod), Some(mesh)) = (&surface.lod, mesh) else {
                continue;
            };
            curves += 1;
            for depth in [0.0, 30.0, 100.0, 250.0, 500.0, 1000.0, 3000.0, 20_000.0] {
                let limit = 250.0 / (depth - mesh.lod_radius).max(1.0);
                let (first, count) = lod.choose(depth, 250.0);
                let list = &world.indices[first as usize..][..count as usize];
                let relative: Vec<u32> = list.iter().map(|i| i - surface.first_vertex).collect();
                assert_eq!(relative, mesh.indices_at(limit), "{map} at {depth}");
            }
        }
    }
    assert!(curves > 100, "{curves}");
}

#[test]
fn curves_for_rays_meet_the_subdivision_limit() {
    // a quarter of a cylinder of radius 128 along y: control points on its tangents
    let radius = 128.0;
    let profile = [
        Vec3::new(radius, 0.0, 0.0),
        Vec3::new(radius, 0.0, radius),
        Vec3::new(0.0, 0.0, radius),
    ];
    let points: Vec<DrawVert> = (0..3)
        .flat_map(|row| {
            profile.map(|p| DrawVert {
                position: p + Vec3::Y * 64.0 * row as f32,
                normal: Vec3::Z,
                st: Vec2::ZERO,
                lightmap: Vec2::ZERO,
                color: [255; 4],
            })
        })
        .collect();
    let mut worst = Vec::new();
    for subdivisions in [32.0, 4.0, 0.5] {
        let mut game = game();
        game.settings.subdivisions = subdivisions;
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 0);
        map.add_room(wall, Vec3::splat(-512.0), Vec3::splat(512.0));
        let patch = map.add_patch(wall, 3, 3, &points);
        let world = game.build(map.build());
        let surface = &world.surfaces[patch];
        // the parabola of the control points, along an edge of the mesh
        let curve = |t: f32| {
            profile[0] * (1.0 - t) * (1.0 - t)
                + profile[1] * 2.0 * t * (1.0 - t)
                + profile[2] * t * t
        };
        let first = surface.first_index as usize;
        let triangles = &world.indices[first..first + surface.index_count as usize];
        let mut distance = 0.0f32;
        for i in 0..=64 {
            let on = curve(i as f32 / 64.0);
            let nearest = triangles
                .chunks_exact(3)
                .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])])
                .map(|(a, b)| {
                    let [a, b] = [a, b].map(|i| world.vertices[i as usize].position);
                    // edges of the mesh, projected along y
                    let [a, b, p] = [a, b, on].map(|p| Vec2::new(p.x, p.z));
                    let along =
                        ((p - a).dot(b - a) / (b - a).length_squared().max(1e-9)).clamp(0.0, 1.0);
                    p.distance(a.lerp(b, along))
                })
                .fold(f32::INFINITY, f32::min);
            distance = distance.max(nearest);
        }
        assert!(distance <= subdivisions, "{distance} at {subdivisions}");
        worst.push(distance);
    }
    assert!(worst[0] > worst[1] && worst[1] > worst[2], "{worst:?}");
}
