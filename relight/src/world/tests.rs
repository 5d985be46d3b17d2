use super::*;
use crate::calibrate::CalibrationOptions;
use crate::files::{GameFiles, MemoryFiles, SearchPath};
use crate::light::{EmissionSource, LightRef, POINT_LIGHT_INTENSITY, SURFACE_LIGHT_RADIANCE};
use crate::materials::Materials;
use crate::test_data;
use glam::Vec2;
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, lightmap_index, surface_flags};
use std::f32::consts::PI;

const SCRIPT: &str = "
t/lamp
{
    q3map_lightimage t/orange.tga
    q3map_surfacelight 1000
    { map $lightmap }
}
t/both
{
    cull disable
    q3map_lightRGB 0 0 2
    q3map_surfacelight 510
    { map *white }
}
t/sprite
{
    deformVertexes autosprite
    q3map_surfacelight 100
    { map *white
      blendFunc add }
}
t/sky
{
    surfaceparm sky
    skyparms - 512 -
    q3map_sun 1 0.5 0 100 0 90
    q3map_surfacelight 255
    { map t/orange.tga }
}
t/glow
{
    { map $lightmap }
    { map t/orange.tga
      blendFunc filter }
    { map *white
      blendFunc add
      rgbGen const ( 0.5 0.5 0.5 ) }
}
t/faint
{
    { map $lightmap }
    { map *white
      blendFunc add
      rgbGen const ( 0.1 0.1 0.1 ) }
}
t/wall
{
    { map $lightmap }
    { map t/orange.tga
      blendFunc filter }
}
t/haze
{
    surfaceparm fog
    fogparms ( 0.25 0.5 1 ) 300
}
t/gone
{
    q3map_surfacelight 50
    { map t/nowhere.tga }
}
";

/// One pixel, sRGB 255, 128, 0.
const ORANGE: &[u8] = &[
    0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 0, 128, 255,
];

fn game() -> MemoryFiles {
    // Tokens must be apart from braces.
    let script = SCRIPT.replace('{', "\n{\n").replace('}', "\n}\n");
    let mut files = MemoryFiles::new();
    files.insert("scripts/test.shader", script).unwrap();
    files.insert("t/orange.tga", ORANGE).unwrap();
    files
}

/// Lights as directives say, whatever the lightmaps tell.
fn as_said() -> Options<'static> {
    Options {
        calibrate: None,
        ..Options::default()
    }
}

fn relight(map: MapBuilder) -> RelitWorld {
    let files = game();
    let (materials, diagnostics) = Materials::load(&files);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let bsp = Bsp::parse(&map.build().write()).unwrap();
    RelitWorld::from_bsp(&files, &materials, "test", bsp, as_said())
}

/// A square of 2 × 2 `half`, front to +z, at a height.
fn ceiling_lamp(half: f32, z: f32) -> [Vec3; 4] {
    // Clockwise seen from below: facing -z.
    [(-half, -half), (-half, half), (half, half), (half, -half)].map(|(x, y)| Vec3::new(y, x, z))
}

#[test]
fn an_emissive_quad_in_a_room() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let lamp = map.add_shader("t/lamp", 0, 1);
    let here = map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let there = map.add_room(
        wall,
        Vec3::new(200.0, -128.0, -128.0),
        Vec3::new(400.0, 128.0, 128.0),
    );
    map.set_sees(here, there, false);
    map.set_sees(there, here, false);
    let quad = map.add_quad(lamp, ceiling_lamp(16.0, 127.0));
    let page = map.add_lightmap([10, 100, 20]);
    map.set_lightmap(quad, page);
    let world = relight(map);

    assert_eq!(world.lights.len(), 2);
    let linear_half = overbright::to_linear(128.0 / 255.0);
    let expected = Vec3::new(1.0, linear_half, 0.0) * (PI * 1000.0 / 255.0);
    for light in &world.lights {
        assert!(
            (light.radiance - expected).length() < 1e-3,
            "{:?}",
            light.radiance
        );
        assert!(
            (light.normal() - Vec3::NEG_Z).length() < 1e-6,
            "lights point into the room"
        );
        assert_eq!(light.area(), 512.0);
        assert!(!light.two_sided && !light.is_sky);
        assert_eq!(light.source, EmissionSource::SurfaceLight);
        assert_eq!(light.surface as usize, quad);
        let corners = world.triangle(light.triangle as usize).unwrap();
        assert!(light.vertices.iter().all(|v| corners.contains(v)));
        assert_eq!(
            world.light_of_triangle(light.triangle as usize),
            Some(light)
        );
    }
    let power: Vec3 = world.lights.iter().map(TriangleLight::power).sum();
    assert!((power - expected * (PI * 1024.0)).length() < power.length() * 1e-5);
    let surface = world.surfaces[quad];
    assert_eq!((surface.first_light, surface.num_lights), (0, 2));
    assert_eq!(world.light_lists.row(here), [0, 1]);
    assert!(world.light_lists.row(there).is_empty());
    assert_eq!(world.light_lists.row(-1), [0, 1]);
    assert_eq!(world.report.triangles_by(EmissionSource::SurfaceLight), 2);
    assert!(!world.report.fallback);
    assert_eq!(world.lightmap(0).unwrap()[..3], [25, 255, 51]);
    assert_eq!(world.lightmap(1), None);
}

#[test]
fn one_way_visibility_lights_both_ways_and_backs_stay_dark() {
    let mut map = MapBuilder::new();
    let lamp = map.add_shader("t/lamp", 0, 1);
    let both = map.add_shader("t/both", 0, 1);
    let low = map.add_cell(Vec3::new(-64.0, -64.0, -64.0), Vec3::new(64.0, 64.0, 0.0));
    let high = map.add_cell(Vec3::new(-64.0, -64.0, 64.0), Vec3::new(64.0, 64.0, 128.0));
    let far = map.add_cell(
        Vec3::new(-64.0, -64.0, -256.0),
        Vec3::new(64.0, 64.0, -128.0),
    );
    map.set_sees(low, far, false); // far still sees low
    // Both hang at the ceiling of `low`, facing down.
    map.add_quad(lamp, ceiling_lamp(16.0, -1.0));
    map.add_quad(both, ceiling_lamp(8.0, -2.0));
    let world = relight(map);
    let sources = |cluster| -> Vec<u32> {
        let mut surfaces: Vec<_> = world
            .light_lists
            .row(cluster)
            .iter()
            .map(|&l| world.lights[l as usize].surface)
            .collect();
        surfaces.dedup();
        surfaces
    };
    assert_eq!(sources(low), [0, 1]);
    assert_eq!(sources(far), [0, 1]);
    // Above the lamps: only the one with two sides reaches it.
    assert_eq!(sources(high), [1]);
    let blue = world.lights.iter().find(|l| l.surface == 1).unwrap();
    assert!(blue.two_sided);
    assert!((blue.radiance - Vec3::new(0.0, 0.0, 510.0 * SURFACE_LIGHT_RADIANCE)).length() < 1e-5);
}

#[test]
fn no_visibility_means_everything() {
    let mut map = MapBuilder::new();
    let lamp = map.add_shader("t/lamp", 0, 1);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    map.add_quad(lamp, ceiling_lamp(16.0, 0.0));
    map.without_visibility();
    let world = relight(map);
    assert_eq!(world.light_lists.clusters(), 0);
    assert_eq!(world.light_lists.row(0), [0, 1]);
}

#[test]
fn skies_shine_and_carry_the_sun() {
    let mut map = MapBuilder::new();
    let sky = map.add_shader("t/sky", surface_flags::SKY, 0);
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let quad = map.add_quad(sky, ceiling_lamp(100.0, 127.0));
    let world = relight(map);
    assert_eq!(world.lights.len(), 2);
    assert!(
        world
            .lights
            .iter()
            .all(|l| l.is_sky && l.source == EmissionSource::Sky)
    );
    let [sun] = world.suns[..] else {
        panic!("{:?}", world.suns)
    };
    assert!((sun.direction - Vec3::Z).length() < 1e-5);
    let irradiance = Vec3::new(1.0, 0.5, 0.0) * (PI * 100.0 * 4.0 / 255.0);
    assert!((sun.irradiance - irradiance).length() < 1e-4);
    assert_eq!(world.sky, Some(world.surfaces[quad].material));
    assert_eq!(
        world.materials[sun.material.unwrap() as usize].name,
        "t/sky"
    );
}

#[test]
fn sprites_shine_as_strongly_as_the_compilers_point_light() {
    let mut map = MapBuilder::new();
    let sprite = map.add_shader("t/sprite", 0, 0);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    map.add_quad(sprite, ceiling_lamp(8.0, 0.0));
    let world = relight(map);
    assert_eq!(world.lights.len(), 2);
    assert!(
        world
            .lights
            .iter()
            .all(|l| l.two_sided && l.triangle == u32::MAX)
    );
    assert!(world.triangle_lights.iter().all(|&l| l == NO_LIGHT));
    // A point light of intensity I emits 4π I.
    let power: Vec3 = world.lights.iter().map(TriangleLight::power).sum();
    let expected = 4.0 * PI * 100.0 * POINT_LIGHT_INTENSITY;
    assert!(
        (power.x / expected - 1.0).abs() < 1e-5,
        "{power} {expected}"
    );
}

#[test]
fn strong_glow_is_light_and_faint_glow_is_not() {
    let mut map = MapBuilder::new();
    let glow = map.add_shader("t/glow", 0, 1);
    let faint = map.add_shader("t/faint", 0, 1);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    map.add_quad(glow, ceiling_lamp(16.0, 0.0));
    map.add_quad(faint, ceiling_lamp(16.0, 8.0));
    let world = relight(map);
    assert!(
        world
            .lights
            .iter()
            .all(|l| l.surface == 0 && l.source == EmissionSource::Glow)
    );
    let shown = overbright::to_linear(127.0 / 255.0);
    assert!(
        (world.lights[0].radiance - Vec3::splat(shown)).length() < 1e-3,
        "{}",
        world.lights[0].radiance
    );
}

#[test]
fn directives_count_even_where_the_default_is_drawn() {
    let mut map = MapBuilder::new();
    let gone = map.add_shader("t/gone", 0, 1);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    map.add_quad(gone, ceiling_lamp(16.0, 0.0));
    map.add_quad(gone, ceiling_lamp(16.0, 8.0));
    let world = relight(map);
    assert_eq!(world.lights.len(), 4);
    assert!(
        (world.lights[0].radiance - Vec3::splat(50.0 * SURFACE_LIGHT_RADIANCE)).length() < 1e-4
    );
    let told: Vec<_> = world
        .warnings
        .iter()
        .filter(|w| w.contains("t/nowhere"))
        .collect();
    assert_eq!(told.len(), 1, "{:?}", world.warnings);
}

#[test]
fn without_directives_flares_are_lamps_and_then_lightmaps_ambient() {
    let dark = |flares: bool| {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
        map.add_lightmap([51, 0, 0]);
        if flares {
            let flare = map.add_shader("flareShader", 0, 0);
            map.add_flare(
                flare,
                Vec3::new(0.0, 0.0, 128.0),
                Vec3::NEG_Z,
                Vec3::new(1.0, 0.0, 0.0),
            );
        }
        relight(map)
    };
    let world = dark(true);
    assert!(world.report.fallback);
    assert_eq!(world.flares.len(), 1);
    assert_eq!(world.lights.len(), 2);
    assert!((world.lights[0].normal() - Vec3::NEG_Z).length() < 1e-6);
    assert!(world.lights[0].radiance.x > 1.0 && world.lights[0].radiance.y == 0.0);
    assert_eq!(world.light_lists.row(0), [0, 1]);
    assert_eq!(world.report.triangles_by(EmissionSource::Flare), 2);

    let world = dark(false);
    assert_eq!(world.light_count(), 0);
    assert!((world.ambient - Vec3::new(51.0 * 4.0 / 255.0, 0.0, 0.0)).length() < 1e-5);
}

#[test]
fn models_are_lit_from_where_their_entities_stand() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let lamp = map.add_shader("t/lamp", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let there = map.add_room(
        wall,
        Vec3::new(872.0, -128.0, -128.0),
        Vec3::new(1128.0, 128.0, 128.0),
    );
    map.set_sees(0, there, false);
    map.set_sees(there, 0, false);
    let model = map.begin_model();
    map.add_quad(lamp, ceiling_lamp(16.0, 100.0));
    map.add_entity(&[
        ("classname", "func_door"),
        ("model", &format!("*{model}")),
        ("origin", "1000 0 0"),
    ]);
    map.add_entity(&[
        ("classname", "light"),
        ("origin", "0 0 0"),
        ("light", "100"),
    ]);
    let world = relight(map);
    assert_eq!(world.models[model].origin, Vec3::new(1000.0, 0.0, 0.0));
    assert!(
        world
            .lights
            .iter()
            .all(|l| l.model as usize == model && (l.vertices[0].x - 1000.0).abs() < 17.0)
    );
    assert_eq!(world.light_lists.row(there), [0, 1]);
    // The point light of the first room comes after the triangles.
    let row: Vec<_> = world
        .light_lists
        .row(0)
        .iter()
        .map(|&e| world.light_lists.light(e))
        .collect();
    assert_eq!(row, [LightRef::Point(0)]);
}

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

#[test]
fn invisible_patches_are_left_out_by_their_own_flags() {
    let mut map = MapBuilder::new();
    let drawn = map.add_shader("t/wall", 0, 1);
    let hidden = map.add_shader("t/wall", surface_flags::NODRAW, 1);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    let bump = |x: i32, y: i32| {
        Vec3::new(
            x as f32 * 32.0,
            y as f32 * 32.0,
            if x == 1 { 40.0 } else { 0.0 },
        )
    };
    let points: Vec<DrawVert> = (0..9)
        .map(|i| DrawVert {
            position: bump(i % 3, i / 3),
            st: Vec2::ZERO,
            lightmap: Vec2::ZERO,
            normal: Vec3::Z,
            color: [255; 4],
        })
        .collect();
    let a = map.add_patch(drawn, 3, 3, &points);
    let b = map.add_patch(hidden, 3, 3, &points);
    let world = relight(map);
    assert!(world.surfaces[a].num_indices > 0);
    assert_eq!(world.surfaces[b].num_indices, 0);
    assert_ne!(world.surfaces[a].material, world.surfaces[b].material);
    assert_eq!(world.surfaces[a].maxs.z, 20.0);
}

#[test]
fn fogs_are_numbered_from_one() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let haze = map.add_shader("t/haze", 0, q3bsp::content_flags::FOG);
    map.add_cell(Vec3::splat(-64.0), Vec3::splat(64.0));
    let fog = map.add_fog_brush(haze, Vec3::splat(-64.0), Vec3::new(64.0, 64.0, 0.0), 5);
    let inside = map.add_quad(wall, ceiling_lamp(16.0, -8.0));
    let outside = map.add_quad(wall, ceiling_lamp(16.0, 8.0));
    map.set_fog(inside, fog);
    map.set_fog(outside, -1);
    let world = relight(map);
    assert_eq!(world.fogs.len(), 1);
    assert_eq!(world.fogs[0].color, Vec3::new(0.25, 0.5, 1.0));
    assert_eq!(world.fogs[0].depth, 300.0);
    assert_eq!(
        (world.surfaces[inside].fog, world.surfaces[outside].fog),
        (1, 0)
    );
}

/// A map with one of everything, for damaging.
fn rich_map() -> Vec<u8> {
    let mut map = MapBuilder::new();
    let names = [
        "t/wall", "t/lamp", "t/both", "t/sprite", "t/sky", "t/glow", "t/gone", "t/haze",
    ];
    let shaders: Vec<i32> = names.iter().map(|n| map.add_shader(n, 0, 1)).collect();
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
    let mut state = 1u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut relit = 0;
    for round in 0..600 {
        let mut bytes = whole.clone();
        for _ in 0..1 + round % 4 {
            let at = random(bytes.len() / 4) * 4;
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
            let value = values[random(values.len())].to_le_bytes();
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

/// Every map of OpenArena has light, everything is finite, and no light is missing from a list: checked from the
/// places where entities stand, against the visibility matrix itself.
#[test]
fn every_openarena_map_has_light() {
    let Some(folder) = test_data::folder() else {
        return;
    };
    let files = SearchPath::open(&[folder]).unwrap();
    let (materials, _) = Materials::load(&files);
    let maps = files.list("maps", ".bsp");
    assert_eq!(maps.len(), 72);
    let mut checked = 0;
    for map in maps {
        let world = RelitWorld::load(
            &files,
            &materials,
            &format!("maps/{map}"),
            Options {
                calibrate: Some(CalibrationOptions {
                    samples: 200,
                    candidates: 100,
                    ..Default::default()
                }),
                ..Options::default()
            },
        )
        .unwrap();
        assert!(world.light_count() > 0, "{map} is dark");
        assert!(!world.report.fallback, "{map} needs the fallback");
        for light in &world.lights {
            assert!(
                light.radiance.is_finite() && light.radiance.max_element() > 0.0,
                "{map}: {light:?}"
            );
            assert!(
                light.vertices.iter().all(|v| v.is_finite()),
                "{map}: {light:?}"
            );
            assert!(
                (light.normal().length() - 1.0).abs() < 1e-4,
                "{map}: {light:?}"
            );
        }
        for vertex in &world.vertices {
            assert!(
                vertex.position.is_finite() && vertex.st.is_finite() && vertex.lightmap.is_finite()
            );
            assert!(
                (vertex.normal.length() - 1.0).abs() < 1e-4,
                "{map}: {vertex:?}"
            );
        }
        assert_eq!(world.indices.len() % 3, 0);
        assert!(
            world
                .indices
                .iter()
                .all(|&i| (i as usize) < world.vertices.len())
        );
        checked += check_lists(&map, &world);
    }
    assert!(checked > 10_000, "only {checked} pairs of place and light");
    println!("{checked} pairs of place and light");
}

fn check_lists(map: &str, world: &RelitWorld) -> usize {
    let lists = &world.light_lists;
    assert_eq!(lists.clusters(), world.bsp.num_clusters());
    assert!(lists.offsets.is_sorted());
    assert_eq!(
        lists.row(-1).len(),
        world.lights.len() + world.point_lights.len()
    );
    let of_cluster = world.bsp.cluster_surfaces();
    let mut checked = 0;
    for entity in world.bsp.entities().iter().step_by(7) {
        let Some(place) = entity.vec3("origin") else {
            continue;
        };
        let cluster = world.bsp.cluster_at(place);
        if cluster < 0 {
            continue;
        }
        let row = lists.row(cluster);
        for (index, light) in (0u32..).zip(&world.lights).filter(|(_, l)| l.model == 0) {
            let center = light.vertices.into_iter().sum::<Vec3>() / 3.0;
            let from = world.bsp.cluster_at(center + light.normal());
            let in_front = (place - center).dot(light.normal()) > 1.0 || light.two_sided;
            if from >= 0 && in_front && world.bsp.cluster_sees(from, cluster) {
                // Surfaces that no leaf of the cluster in front lists are never drawn from there.
                let listed = of_cluster
                    .get(from as usize)
                    .is_some_and(|l| l.contains(&light.surface));
                assert!(
                    !listed || row.binary_search(&index).is_ok(),
                    "{map}: light {index} at {center} is missing at {place}"
                );
                checked += 1;
            }
        }
        if checked > 500 {
            break;
        }
    }
    checked
}

#[test]
fn bent_planar_surfaces_keep_the_normals_of_their_vertices() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 0);
    let flat = map.add_quad(wall, ceiling_lamp(64.0, 0.0));
    let bent = map.add_quad(wall, ceiling_lamp(64.0, 100.0));
    for surface in [flat, bent] {
        map.surface_mut(surface).unwrap().lightmap_vecs[2] = Vec3::ZERO;
        for (i, vertex) in map.vertices_mut(surface).iter_mut().enumerate() {
            vertex.normal = Vec3::new(i as f32, 0.0, -4.0);
        }
    }
    // one corner pulled down: the two triangles of the quad now face apart
    map.vertices_mut(bent)[1].position.z -= 60.0;
    let world = relight(map);
    let normals = |surface: usize| {
        let surface = &world.surfaces[surface];
        let first = surface.first_vertex as usize;
        world.vertices[first..first + surface.num_vertices as usize]
            .iter()
            .map(|v| v.normal)
            .collect::<Vec<_>>()
    };
    assert!(world.surfaces[flat].plane.is_some());
    assert!(normals(flat).windows(2).all(|pair| pair[0] == pair[1]));
    assert_eq!(world.surfaces[bent].plane, None);
    for (i, normal) in normals(bent).into_iter().enumerate() {
        let stored = Vec3::new(i as f32, 0.0, -4.0).normalize();
        assert!(normal.abs_diff_eq(stored, 1e-6), "{normal}");
    }
}
