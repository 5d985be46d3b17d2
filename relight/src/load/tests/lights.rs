//! What becomes light: emissive surfaces, skies, sprites, glow, flares, and which clusters see it.

use super::{ORANGE, ceiling_lamp, game, relight};
use crate::light::{
    EmissionSource, LightColor, LightRef, POINT_LIGHT_INTENSITY, SURFACE_LIGHT_RADIANCE, raise,
};
use crate::load::*;
use crate::materials::Materials;
use crate::overbright;
use crate::world::*;
use q3bsp::builder::MapBuilder;
use q3bsp::surface_flags;
use std::f32::consts::PI;

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
    // The compiler takes the mean of an image's bytes as they are.
    let half = 128.0 / 255.0;
    let expected = Vec3::new(1.0, half, 0.0) * (PI * 1000.0 / 255.0);
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
        let corners = world.triangle(light.triangle as usize);
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
    let warned: Vec<_> = world
        .warnings
        .iter()
        .filter(|w| w.contains("t/nowhere"))
        .collect();
    assert_eq!(warned.len(), 1, "{:?}", world.warnings);
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
fn negative_lights_are_left_out_with_a_warning() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let light = [("classname", "light"), ("origin", "0 0 0")];
    map.add_entity(&[light[0], light[1], ("light", "300")]);
    map.add_entity(&[light[0], light[1], ("light", "-100")]);
    map.add_entity(&[light[0], light[1], ("light", "100"), ("scale", "-1")]);
    let world = relight(map);
    assert_eq!(world.point_lights.len(), 1);
    let warned = |w: &&String| w.contains("2 light entities with negative light");
    assert_eq!(
        world.warnings.iter().filter(warned).count(),
        1,
        "{:?}",
        world.warnings
    );
}

#[test]
fn lights_have_the_colours_that_show_on_the_maps_textures() {
    // A room of walls of one texture, with a lamp of each kind that directives and entities describe, and one that glows.
    let load = |light_color: LightColor, texture: u8| {
        let mut files = game();
        let mut tga = ORANGE.to_vec();
        tga.truncate(18);
        tga.extend([texture; 3]);
        files.insert("t/grey.tga", tga).unwrap();
        let script = "t/grey\n{\n{\nmap $lightmap\n}\n{\nmap t/grey.tga\nblendFunc filter\n}\n}\n";
        files.insert("scripts/grey.shader", script).unwrap();
        let (materials, _) = Materials::load(&files);
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/grey", 0, 1);
        let (mins, maxs) = (Vec3::splat(-128.0), Vec3::splat(128.0));
        let page = map.add_lightmap([40, 40, 40]);
        for face in map.add_box_faces(wall, mins, maxs, true) {
            map.set_lightmap(face, page);
        }
        map.add_cell(mins, maxs);
        for (k, name) in ["t/lamp", "t/sprite", "t/sky", "t/glow"].iter().enumerate() {
            let lamp = map.add_shader(name, 0, 1);
            map.add_quad(lamp, ceiling_lamp(8.0, 20.0 + 30.0 * k as f32));
        }
        map.add_entity(&[
            ("classname", "light"),
            ("origin", "0 0 0"),
            ("_color", "1 0.5 0.25"),
        ]);
        map.set_world_key("ambient", "20");
        map.set_world_key("_color", "0.25 0.5 1");
        let options = Options {
            light_color,
            calibrate: None,
            ..Options::default()
        };
        let bsp = Bsp::parse(&map.build().write()).unwrap();
        let mut world = RelitWorld::from_bsp(&files, &materials, "test", bsp, options);
        world.measure_materials(&files);
        world
    };
    // Each strength, and whether it is that of something that glows: it shows its own colour whatever the map's light is.
    let all = |world: &RelitWorld| -> Vec<(bool, Vec3)> {
        let glows = |source: EmissionSource| source == EmissionSource::Glow;
        let lights = world.lights.iter().map(|l| (glows(l.source), l.radiance));
        let emissions = world.materials.iter().filter_map(|m| m.emission);
        let emissions = emissions.map(|e| (glows(e.source), e.strength));
        let summaries = world.report.emitters.iter();
        let summaries = summaries.map(|e| (glows(e.source), e.radiance));
        let points = world.point_lights.iter().map(|l| (false, l.intensity));
        let suns = world.suns.iter().map(|s| (false, s.irradiance));
        (lights
            .chain(emissions)
            .chain(summaries)
            .chain(points)
            .chain(suns))
        .chain([(false, world.ambient)])
        .collect()
    };
    let plain = load(LightColor::Stored, 200);
    assert_eq!(plain.color_exponent, 1.0);
    assert!(plain.suns.len() == 1 && plain.point_lights.len() == 1);
    assert!(plain.ambient != Vec3::ZERO);
    let plain = all(&plain);
    assert!(plain.iter().any(|(glows, _)| *glows));
    for texture in [20, 80, 200] {
        let world = load(LightColor::Displayed, texture);
        // Light of 160 steps on the texture.
        let shown = f32::from(texture) / 255.0 * 160.0 / 255.0;
        let (found, meant) = (world.color_exponent, overbright::exponent(shown));
        assert!((found - meant).abs() < 0.05, "{found} {meant}");
        let strengths = all(&world);
        assert_eq!(strengths.len(), plain.len());
        for ((_, found), (glows, stored)) in strengths.into_iter().zip(&plain) {
            let exponent = if *glows { 1.0 } else { world.color_exponent };
            let meant = raise(*stored, exponent);
            assert!(
                (found - meant).length() < 1e-4 * meant.length(),
                "{found} {meant}"
            );
        }
    }
}

/// A world with the lights that q3map2 makes of its map.
fn compiled(map: MapBuilder) -> RelitWorld {
    let mut world = relight(map);
    world.take_compiled_lights(&game());
    world
}

/// A room with a lamp at its ceiling.
fn lamp_room() -> MapBuilder {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let lamp = map.add_shader("t/lamp", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    map.add_quad(lamp, ceiling_lamp(16.0, 127.0));
    map
}

#[test]
fn compiled_lights_are_those_that_q3map2_makes() {
    let mut map = lamp_room();
    let glow = map.add_shader("t/glow", 0, 1);
    let sprite = map.add_shader("t/sprite", 0, 1);
    map.add_quad(glow, ceiling_lamp(16.0, 100.0));
    map.add_quad(sprite, ceiling_lamp(8.0, 50.0));
    map.set_world_key("ambient", "10");
    map.set_world_key("_minlight", "20");
    map.add_entity(&[
        ("classname", "light"),
        ("origin", "0 0 0"),
        ("light", "-50"),
    ]);
    let world = compiled(map);

    let color = Vec3::new(1.0, 128.0 / 255.0, 0.0);
    let [lamps, splashes] = world.lights.as_chunks::<2>().0 else {
        panic!("glow emits nothing: {:?}", world.lights)
    };
    for light in lamps {
        assert!((light.radiance - color * (3.0 * 1000.0 / 255.0)).length() < 1e-3);
        assert!((light.normal() - Vec3::NEG_Z).length() < 1e-6);
    }
    for (splash, lamp) in splashes.iter().zip(lamps) {
        // 7 times 5 per cent, 23 units in front, turned round
        assert!((splash.radiance - lamp.radiance * 0.35).length() < 1e-3);
        assert!((splash.normal() - Vec3::Z).length() < 1e-6);
        assert!(splash.vertices.iter().all(|v| (v.z - 104.0).abs() < 1e-3));
    }
    let [dark, fire] = world.point_lights[..] else {
        panic!("{:?}", world.point_lights)
    };
    assert!((dark.intensity + Vec3::splat(50.0 * POINT_LIGHT_INTENSITY)).length() < 0.1);
    assert!((fire.origin - Vec3::new(0.0, 0.0, 50.0)).length() < 1e-3);
    assert!((fire.intensity - Vec3::splat(100.0 * POINT_LIGHT_INTENSITY)).length() < 0.1);
    let bytes = |light: Vec3| (light.x * 255.0 / 4.0).round();
    assert_eq!(bytes(world.ambient), 10.0);
    assert_eq!(world.least_light().map(bytes), [20.0; 3]);
}

#[test]
fn splashes_in_solid_are_dropped() {
    let mut map = lamp_room();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_box_brush(
        wall,
        Vec3::new(-64.0, -64.0, 90.0),
        Vec3::new(64.0, 64.0, 115.0),
    );
    assert_eq!(compiled(map).lights.len(), 2);
}

#[test]
fn light_moves_to_a_map_with_other_light_coordinates() {
    let map = |first: i32| {
        let mut map = MapBuilder::new();
        let page = map.add_lightmap([128; 3]);
        let wall = map.add_shader("t/wall", 0, 1);
        let lamp = map.add_shader("t/lamp", 0, 1);
        for (place, lightmap) in [first, page].into_iter().enumerate() {
            let quad = map.add_quad(wall, ceiling_lamp(16.0, 100.0 + place as f32));
            map.set_lightmap(quad, lightmap);
        }
        let quad = map.add_quad(lamp, ceiling_lamp(16.0, 127.0));
        map.set_lightmap(quad, page);
        map
    };
    let before = compiled(map(q3bsp::lightmap_index::BY_VERTEX));
    let mut after = relight(map(0));
    // the wall of one light by vertices and one by texels is two materials before
    assert_eq!((before.materials.len(), after.materials.len()), (3, 2));
    for material in &mut after.materials {
        material.emission = None;
    }
    after.take_lighting(&before);
    let strengths = |world: &RelitWorld, name: &str| {
        let named = world.materials.iter().filter(|m| m.name == name);
        named
            .map(|m| m.emission.map(|e| e.strength))
            .collect::<Vec<_>>()
    };
    assert_eq!(strengths(&after, "t/wall"), [None]);
    assert_eq!(strengths(&after, "t/lamp"), strengths(&before, "t/lamp"));
    assert!(strengths(&after, "t/lamp")[0].is_some());
    assert_eq!(after.lights, before.lights);
}

#[test]
fn rays_give_what_q3map2_stores_of_points() {
    use crate::bake::{Gather, Point, Rays};
    let stored = |light: &str, height: f32| {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_room(wall, Vec3::splat(-256.0), Vec3::splat(256.0));
        map.add_entity(&[
            ("classname", "light"),
            ("origin", "0 0 0"),
            ("light", light),
        ]);
        let world = compiled(map);
        let point = Point::new(Vec3::NEG_Z * height, Vec3::Z);
        let found = Rays::new(&world).direct(&[point], 0, &mut |_| ());
        found.unwrap()[0].value.x * 255.0 / 4.0
    };
    for (light, height, expected) in [
        ("100", 100.0, 75.0),
        ("-100", 100.0, -75.0),
        // one step at most is left out
        ("1", 90.0, 0.0),
        ("1", 80.0, 7500.0 / 6400.0),
        // nearer than 16 units it is as at 16
        ("1", 4.0, 7500.0 / 256.0),
    ] {
        let found = stored(light, height);
        assert!(
            (found - expected).abs() < 1e-2,
            "{light} at {height}: {found}"
        );
    }
}
