//! Damaged maps.

use super::{ceiling_lamp, game, relight};
use crate::light::{LightsByHand, POINT_LIGHT_INTENSITY, TriangleLight};
use crate::load::*;
use crate::materials::Materials;
use crate::world::*;
use glam::Vec2;
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, lightmap_index};
use testkit::Random;

#[test]
fn damaged_geometry_is_made_whole() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    let quad = map.add_quad(wall, ceiling_lamp(16.0, 0.0));
    for vertex in map.vertices_mut(quad) {
        vertex.normal = Vec3::ZERO;
        vertex.lightmap = Vec2::NAN;
        vertex.color = [100, 50, 25, 77];
    }
    map.surface_mut(quad).unwrap().lightmap_vecs[2] = Vec3::ZERO;
    map.set_lightmap(quad, 7);
    let vertex = |x: f32, y: f32| DrawVert {
        position: Vec3::new(x, y, 0.0),
        st: Vec2::new(f32::INFINITY, 0.5),
        lightmap: Vec2::ZERO,
        normal: Vec3::ZERO,
        color: [255; 4],
    };
    let soup = map.add_soup(
        wall,
        &[vertex(0.0, 0.0), vertex(0.0, 8.0), vertex(8.0, 0.0)],
        &[0, 1, 2],
    );
    let world = relight(map);
    let plane = world.surfaces[quad].plane.unwrap();
    assert!((plane.normal - Vec3::NEG_Z).length() < 1e-6, "{:?}", plane);
    assert_eq!(world.surfaces[quad].lightmap, lightmap_index::BY_VERTEX);
    let corner = world.vertices[world.surfaces[quad].first_vertex as usize];
    assert_eq!((corner.normal, corner.lightmap), (plane.normal, Vec2::ZERO));
    assert_eq!(corner.color, [255, 127, 63, 77]);
    let corner = world.vertices[world.surfaces[soup].first_vertex as usize];
    assert!((corner.normal - Vec3::Z).length() < 1e-6 && corner.st == Vec2::new(0.0, 0.5));
}

/// A map with one of everything, for damaging.
fn rich_map() -> Vec<u8> {
    let mut map = MapBuilder::new();
    let names = [
        "t/wall", "t/lamp", "t/both", "t/sprite", "t/sky", "t/glow", "t/gone", "t/haze",
    ];
    let shaders: Vec<_> = names.iter().map(|n| map.add_shader(n, 0, 1)).collect();
    map.add_room(shaders[0], Vec3::splat(-128.0), Vec3::splat(128.0));
    let other = map.add_room(
        shaders[4],
        Vec3::new(200.0, -128.0, -128.0),
        Vec3::new(400.0, 128.0, 128.0),
    );
    map.set_sees(other, 0, false);
    for (&shader, z) in shaders
        .iter()
        .zip([-90.0f32, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0])
    {
        map.add_quad(shader, ceiling_lamp(16.0, z));
    }
    let point = |i: i32| DrawVert {
        position: Vec3::new(
            (i % 3) as f32 * 16.0,
            (i / 3) as f32 * 16.0,
            (i % 2) as f32 * 30.0,
        ),
        st: Vec2::ZERO,
        lightmap: Vec2::ZERO,
        normal: Vec3::Z,
        color: [9; 4],
    };
    let points: Vec<_> = (0..9).map(point).collect();
    map.add_patch(shaders[1], 3, 3, &points);
    map.add_soup(shaders[2], &points, &[0, 1, 2, 4, 5, 6]);
    map.add_flare(shaders[0], Vec3::ZERO, Vec3::Z, Vec3::ONE);
    map.add_fog_brush(shaders[7], Vec3::splat(-128.0), Vec3::splat(0.0), 5);
    map.add_lightmap([1, 2, 3]);
    let model = map.begin_model();
    map.add_quad(shaders[1], ceiling_lamp(16.0, 10.0));
    map.add_entity(&[
        ("classname", "func_door"),
        ("model", &format!("*{model}")),
        ("origin", "5 5 5"),
    ]);
    map.add_entity(&[
        ("classname", "light"),
        ("origin", "0 0 9"),
        ("target", "a"),
        ("_color", "1 0 0"),
    ]);
    map.add_entity(&[
        ("classname", "info_null"),
        ("origin", "0 9 9"),
        ("targetname", "a"),
    ]);
    map.build().write()
}

/// Damaged maps are refused or relit; they never panic, and what comes out is finite.
#[test]
fn damage_does_no_harm() {
    let files = game();
    let (materials, _) = Materials::load(&files);
    let whole = rich_map();
    let mut random = Random::new(1);
    let mut relit = 0;
    for round in 0..600 {
        let mut bytes = whole.clone();
        for _ in 0..1 + round % 4 {
            let at = random.below(bytes.len() / 4) * 4;
            let values = [
                0u32,
                1,
                u32::MAX,
                0x7f80_0000,
                0x7fc0_0000,
                0x7f7f_ffff,
                0xff7f_ffff,
                0x8000_0000,
                17,
            ];
            let value = values[random.below(values.len())].to_le_bytes();
            bytes[at..at + 4].copy_from_slice(&value);
        }
        let Ok(bsp) = Bsp::parse(&bytes) else {
            continue;
        };
        let world = RelitWorld::from_bsp(&files, &materials, "damaged", bsp, Options::default());
        relit += 1;
        assert!(
            world
                .lights
                .iter()
                .all(|l| l.radiance.is_finite() && l.area().is_finite())
        );
        assert!(
            world
                .vertices
                .iter()
                .all(|v| v.position.is_finite() && v.normal.is_finite())
        );
        assert!(
            world
                .indices
                .iter()
                .all(|&i| (i as usize) < world.vertices.len())
        );
        assert!(
            world
                .point_lights
                .iter()
                .all(|l| l.intensity.is_finite() && l.origin.is_finite())
        );
        let entries = (world.lights.len() + world.point_lights.len()) as u32;
        assert!(world.light_lists.lights.iter().all(|&l| l < entries));
    }
    assert!(relit > 100, "only {relit} of 600 were relit");
}

#[test]
fn absent_and_broken_maps_are_errors() {
    let mut files = game();
    files.insert("maps/x.bsp", "nonsense").unwrap();
    let (materials, _) = Materials::load(&files);
    let load =
        |name: &str| RelitWorld::load(&files, &materials, name, Options::default()).unwrap_err();
    assert!(matches!(load("maps/y.bsp"), LoadError::Absent { .. }));
    assert!(load("maps/x.bsp").to_string().starts_with("maps/x.bsp: "));
}

#[test]
fn lights_beyond_arithmetic_are_brought_into_range() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    let lamp = map.add_shader("t/lamp", 0, 0);
    map.add_room(wall, Vec3::splat(-64.0), Vec3::splat(64.0));
    map.add_quad(lamp, ceiling_lamp(16.0, 60.0));
    map.add_quad(lamp, ceiling_lamp(1.0e18, 60.0));
    let red = ("_color", "1 0 0");
    let place = ("origin", "0 0 8");
    let light = ("classname", "light");
    map.add_entity(&[light, place, red, ("light", "3e38")]);
    map.add_entity(&[light, place, red, ("light", "1e30")]);
    map.add_entity(&[
        light,
        place,
        red,
        ("light", "1e20"),
        ("spawnflags", "1"),
        ("fade", "1e-30"),
    ]);
    map.add_entity(&[light, place, red, ("light", "1e30"), ("_sun", "1")]);
    map.add_entity(&[light, place, red, ("light", "300")]);
    let mut world = relight(map);
    assert_eq!((world.point_lights.len(), world.suns.len()), (4, 1));
    // those of the quad that no map has room for are left out
    assert_eq!(world.lights.len(), 2);
    assert_eq!(world.warnings.len(), 1, "{:?}", world.warnings);

    let (file, wrong) = LightsByHand::parse(
        "scale surfaces 1e38\nambient 3e38 1 1 1\nspot 0 0 0 300 1 1 1 0 0 3e38 30",
    );
    assert_eq!(
        wrong.len(),
        1,
        "a spot has no direction to a target that far: {wrong:?}"
    );
    file.apply(&mut world);
    assert_eq!(world.warnings.len(), 2, "{:?}", world.warnings);
    assert!(world.ambient.is_finite() && world.ambient.x > 0.0);
    let strengths = (world.lights.iter().map(TriangleLight::power))
        .chain(world.point_lights.iter().map(|l| l.intensity))
        .chain(world.suns.iter().map(|s| s.irradiance));
    for strength in strengths {
        assert!(
            strength.length_squared().is_finite() && strength.x > 0.0,
            "{strength}"
        );
    }
    // what overflowed on the way is none; the weak one is as it was
    let [strong, weak] = [0, 1].map(|at| world.point_lights[at].intensity);
    assert!(strong.x > 1.0e9);
    assert_eq!(weak, Vec3::X * 300.0 * POINT_LIGHT_INTENSITY);
}
