mod colour;
mod compiler_command_line;
mod cutoff;
mod held_out;
mod hypotheses;
mod known_truth;
mod light_grid;
mod linear;
mod near_light;
mod passed;
mod residual_candidates;
mod result_cache;
mod splash;
mod styles;
mod trace_cache;

use super::*;
use crate::files::{MemoryFiles, SearchPath};
use crate::light::{LightColor, PointLight, SURFACE_LIGHT_RADIANCE};
use crate::materials::Materials;
use crate::occluders::Occluders;
use crate::{Options, Stage};
use q3bsp::Bsp;
use q3bsp::builder::MapBuilder;
use std::f32::consts::PI;

/// Strength of the lamp's directive.
const LAMP: f32 = 1000.0;

const SCRIPT: &str = "
t/wall
{
    { map $lightmap }
    { map *white
      blendFunc filter }
}
t/grey
{
    { map $lightmap }
    { map *white
      blendFunc filter
      rgbGen const ( 0.6 0.6 0.6 ) }
}
t/dim
{
    q3map_lightmapBrightness 0.25
    { map $lightmap }
    { map *white
      blendFunc filter }
}
t/shell
{
    surfaceparm trans
    cull back
    { map *white }
}
t/inverted
{
    surfaceparm trans
    { map *white }
}
t/shellsides
{
    surfaceparm trans
    cull none
    { map *white }
}
t/shellshadow
{
    surfaceparm trans
    surfaceparm alphashadow
    cull back
    { map *white }
}
t/shellfilter
{
    surfaceparm trans
    surfaceparm lightfilter
    cull back
    { map *white }
}
t/hull
{
    cull back
    { map *white }
}
t/lamp
{
    q3map_lightRGB 1 1 1
    q3map_surfacelight 1000
    { map *white }
}
";

const ROOM: [Vec3; 2] = [
    Vec3::new(-320.0, -256.0, 0.0),
    Vec3::new(320.0, 256.0, 256.0),
];
const PILLAR: [Vec3; 2] = [Vec3::new(-32.0, -96.0, 0.0), Vec3::new(32.0, 96.0, 256.0)];
/// Corners of a lamp under the ceiling, clockwise seen from below.
const LAMP_CORNERS: [Vec3; 4] = [
    Vec3::new(180.0, -30.0, 250.0),
    Vec3::new(220.0, -30.0, 250.0),
    Vec3::new(220.0, 30.0, 250.0),
    Vec3::new(180.0, 30.0, 250.0),
];

/// Whether a segment passes through the pillar.
fn in_pillar(from: Vec3, to: Vec3) -> bool {
    let inverse = (to - from).recip();
    let a = (PILLAR[0] - from) * inverse;
    let b = (PILLAR[1] - from) * inverse;
    let near = a.min(b).max_element().max(0.0);
    let far = a.max(b).min_element().min(1.0);
    near < far - 1e-4
}

/// A room with a pillar. `light` gives irradiance / π at a point of a wall; without it there are no lightmaps.
fn room(lamp: bool, light: Option<&dyn Fn(Vec3, Vec3) -> Vec3>) -> RelitWorld {
    room_of("t/wall", lamp, light)
}

/// The room with walls of a material.
fn room_of(material: &str, lamp: bool, light: Option<&dyn Fn(Vec3, Vec3) -> Vec3>) -> RelitWorld {
    relit(&room_map(material, lamp, usize::MAX, light).build())
}

/// Its map. `lightmapped`: number of faces with a lightmap, the first ones.
fn room_map(
    material: &str,
    lamp: bool,
    lightmapped: usize,
    light: Option<&dyn Fn(Vec3, Vec3) -> Vec3>,
) -> MapBuilder {
    let mut map = MapBuilder::new();
    let wall = map.add_shader(material, 0, 1);
    let mut faces = map.add_box_faces(wall, ROOM[0], ROOM[1], true).to_vec();
    faces.extend(map.add_box_faces(wall, PILLAR[0], PILLAR[1], false));
    map.add_cell(ROOM[0], ROOM[1]);
    if lamp {
        let shader = map.add_shader("t/lamp", 0, 1);
        map.add_quad(shader, LAMP_CORNERS);
    }
    for (index, face) in faces.into_iter().enumerate() {
        let Some(light) = light else { continue };
        if index >= lightmapped {
            // they store no light, which is not the same as being dark
            if lightmapped > 0 {
                map.set_lightmap(face, q3bsp::lightmap_index::NONE);
            }
            continue;
        }
        let corners = map.vertices_mut(face);
        let (a, b, d) = (corners[0], corners[1], corners[3]);
        let normal = a.normal;
        let size = q3bsp::LIGHTMAP_SIZE as f32;
        let page = map.add_lightmap_with(|x, y| {
            let at = (glam::Vec2::new(x as f32, y as f32) + 0.5) / size;
            let (e1, e2, offset) = (
                b.lightmap - a.lightmap,
                d.lightmap - a.lightmap,
                at - a.lightmap,
            );
            let determinant = e1.perp_dot(e2);
            let (u, v) = (
                offset.perp_dot(e2) / determinant,
                e1.perp_dot(offset) / determinant,
            );
            let on = a.position + (b.position - a.position) * u + (d.position - a.position) * v;
            let stored = light(on + normal * 0.1, normal) * 255.0 / 4.0;
            stored.to_array().map(|c| c.round() as u8)
        });
        map.set_lightmap(face, page);
    }
    map
}

/// A world whose stored light has its stored colours.
fn relit(bsp: &Bsp) -> RelitWorld {
    relit_as(bsp, LightColor::Stored)
}

fn relit_as(bsp: &Bsp, light_color: LightColor) -> RelitWorld {
    let mut files = MemoryFiles::new();
    let script = SCRIPT.replace('{', "\n{\n").replace('}', "\n}\n");
    files.insert("scripts/test.shader", script).unwrap();
    let (materials, diagnostics) = Materials::load(&files);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let bsp = Bsp::parse(&bsp.write()).unwrap();
    let options = Options {
        light_color,
        calibrate: None,
        ..Options::default()
    };
    RelitWorld::from_bsp(&files, &materials, "test", bsp, options)
}

/// The lights that are hidden: origin, intensity.
const HIDDEN: [(Vec3, Vec3); 3] = [
    (
        Vec3::new(-210.0, 77.0, 190.0),
        Vec3::new(24000.0, 18000.0, 9000.0),
    ),
    (
        Vec3::new(233.0, -141.0, 122.0),
        Vec3::new(8000.0, 12000.0, 24000.0),
    ),
    (
        Vec3::new(92.0, 189.0, 61.0),
        Vec3::new(9000.0, 9000.0, 9000.0),
    ),
];

fn from_hidden(at: Vec3, normal: Vec3) -> Vec3 {
    HIDDEN
        .iter()
        .filter(|(origin, _)| !in_pillar(at, *origin))
        .map(|(origin, intensity)| {
            let offset = *origin - at;
            *intensity * (normal.dot(offset).max(0.0) / offset.length().powi(3) / PI)
        })
        .sum()
}

/// So many measurements.
fn sampling(count: usize) -> SamplingOptions {
    SamplingOptions {
        count,
        seed: 1,
        ..Default::default()
    }
}

fn small() -> CalibrationOptions {
    CalibrationOptions {
        samples: 2000,
        candidates: 600,
        ..Default::default()
    }
}

#[test]
fn hidden_lights_are_found_again() {
    let mut world = room(false, Some(&from_hidden));
    assert_eq!(world.light_count(), 0);
    let report = calibrate(&mut world, &small());
    println!("{report:?}");
    assert_eq!(report.evidence, Evidence::Lightmaps);
    assert_eq!(report.placed, world.point_lights.len());
    assert!(report.held_out > 200 && report.held_out < report.samples / 3);
    // Loading takes the mean of all light for ambient when it finds no lights.
    assert!(report.before.median_stops > 0.5, "{report:?}");
    assert!(report.after.median_stops < 0.05, "{report:?}");
    for (origin, intensity) in HIDDEN {
        let near = |l: &&PointLight| l.origin.distance(origin) < 24.0;
        let found: Vec<_> = world.point_lights.iter().filter(near).collect();
        let sum: Vec3 = found.iter().map(|l| l.intensity).sum();
        let centre: Vec3 = found
            .iter()
            .map(|l| l.origin * l.intensity.element_sum())
            .sum();
        let centre = centre / sum.element_sum();
        println!(
            "{origin} {intensity}: {} lights, {centre} {sum}",
            found.len()
        );
        assert!(centre.distance(origin) < 8.0, "{centre} for {origin}");
        let off = (sum / intensity - 1.0).abs().max_element();
        assert!(off < 0.15, "{sum} for {intensity}");
    }
    let total: Vec3 = world.point_lights.iter().map(|l| l.intensity).sum();
    let hidden: Vec3 = HIDDEN.iter().map(|(_, i)| *i).sum();
    assert!((total / hidden - 1.0).abs().max_element() < 0.1, "{total}");
    // They are in the lists: all of the room is one cluster.
    assert_eq!(world.light_lists.row(0).len(), world.point_lights.len());
    assert_eq!(world.report.point_lights, world.point_lights.len());
}

#[test]
fn bounced_light_in_an_even_room_is_albedo_times_light() {
    let even = |_: Vec3, _: Vec3| Vec3::new(1.0, 0.5, 0.25);
    let mut world = room(false, Some(&even));
    let albedo = Vec3::new(0.5, 0.25, 0.0);
    for material in &mut world.materials {
        material.albedo = albedo;
    }
    let occluders = Occluders::of_world(&world);
    let (samples, evidence) = samples::take(&world, &occluders, &sampling(500));
    assert_eq!(evidence, Evidence::Lightmaps);
    assert!(samples.len() > 400);
    let direct: Vec<Vec3> = samples.iter().map(|s| s.value).collect();
    let light = even(Vec3::ZERO, Vec3::Z);
    let once = light * albedo;
    for (bounces, expected) in [(0, Vec3::ZERO), (1, once), (2, once + once * albedo)] {
        let transfer = bounce::Transfer::new(&world, &occluders, &samples, bounces, |_| true);
        for (sample, bounced) in samples.iter().zip(transfer.of(&direct, true)) {
            // Stored values are whole numbers.
            assert!(
                (bounced - expected).length() < 0.015,
                "{sample:?}: {bounced}"
            );
        }
    }
}

#[test]
fn loading_calibrates_when_asked() {
    let plain = room(true, Some(&from_hidden));
    assert!(plain.calibration.is_none());
    assert!(plain.materials.iter().all(|m| m.albedo == Vec3::ZERO));
    let mut stages = Vec::new();
    let mut files = MemoryFiles::new();
    let script = SCRIPT.replace('{', "\n{\n").replace('}', "\n}\n");
    files.insert("scripts/test.shader", script).unwrap();
    let (materials, _) = Materials::load(&files);
    let mut progress = |stage| stages.push(stage);
    let options = Options {
        calibrate: Some(small()),
        progress: Some(&mut progress),
        ..Options::default()
    };
    let world = RelitWorld::from_bsp(&files, &materials, "test", plain.bsp, options);
    let report = world.calibration.as_ref().unwrap();
    assert_eq!(report.placed, world.point_lights.len());
    assert!(
        stages.ends_with(&[Stage::Calibration, Stage::Done]),
        "{stages:?}"
    );
    let wall = world.materials.iter().find(|m| m.name == "t/wall").unwrap();
    assert!((wall.albedo - 1.0).length() < 1e-3, "{}", wall.albedo);
}

#[test]
fn a_lamp_of_another_strength_gets_it_back() {
    let radiance = 2.5 * LAMP * SURFACE_LIGHT_RADIANCE;
    let [a, b, _, d] = LAMP_CORNERS;
    let from_lamp = |at: Vec3, normal: Vec3| {
        let mut sum = 0.0;
        for i in 0..64 {
            let (u, v) = ((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5);
            let origin = a + (b - a) * (u / 8.0) + (d - a) * (v / 8.0);
            let offset = origin - at;
            let squared = offset.length_squared();
            let leaving = offset.z.max(0.0);
            if !in_pillar(at, origin) {
                sum += normal.dot(offset).max(0.0) * leaving / (squared * squared);
            }
        }
        Vec3::splat(sum * radiance * 40.0 * 60.0 / 64.0 / PI)
    };
    let mut world = room(true, Some(&from_lamp));
    let before: Vec<_> = world.lights.iter().map(|l| l.radiance).collect();
    assert!((before[0].x / (LAMP * SURFACE_LIGHT_RADIANCE) - 1.0).abs() < 1e-4);
    let report = calibrate(&mut world, &small());
    println!("{report:?} {:?}", world.point_lights);
    for (light, before) in world.lights.iter().zip(before) {
        let factor = light.radiance / before;
        assert!((factor - 2.5).abs().max_element() < 0.15, "{factor}");
    }
    let emission = world.materials.iter().find_map(|m| m.emission).unwrap();
    assert_eq!(emission.strength, world.lights[0].radiance);
    assert_eq!(world.report.emitters[0].radiance, world.lights[0].radiance);
    assert!(report.after.median_stops < 0.1, "{report:?}");
    assert!(report.before.median_stops > 1.2, "{report:?}");
    let placed: f32 = world.point_lights.iter().map(|l| l.intensity.x).sum();
    let lamp: f32 = world.lights.iter().map(|l| l.radiance.x * l.area()).sum();
    assert!(placed < 0.05 * lamp, "{placed} beside {lamp}");
}

#[test]
fn placed_lights_are_assigned_to_the_nearest_hidden_one() {
    let at = |x: f32, power: f32| PointLight {
        origin: Vec3::new(x, 0.0, 0.0),
        intensity: Vec3::splat(power),
        radius: 4.0,
        spot: None,
        falloff: crate::light::Falloff::InverseSquare,
        pulse: None,
    };
    let mut world = room(false, None);
    world.point_lights = vec![
        at(-8.0, 60.0),
        at(8.0, 50.0),
        at(520.0, 30.0),
        at(990.0, 20.0),
    ];
    let hidden = [at(0.0, 100.0), at(500.0, 60.0), at(2000.0, 40.0)];
    let found = recovery(&hidden, &world);
    assert_eq!((found.hidden, found.found, found.found_well), (3, 2, 1));
    assert_eq!(found.invented, 1);
    assert!((found.power_found - 0.8).abs() < 1e-5 && (found.power_ratio - 0.8).abs() < 1e-5);
    assert!((found.power_invented - 0.125).abs() < 1e-5, "{found:?}");
    assert!((found.median_distance - 20.0).abs() < 1e-3, "{found:?}");
    assert_eq!(recovery(&[], &world).invented, 4);
}

#[test]
fn scaled_lightmaps_are_measured_at_full_light() {
    let mut world = room_of("t/dim", false, Some(&from_hidden));
    world.measure_materials(&MemoryFiles::new());
    let wall = world.materials.iter().find(|m| m.name == "t/dim").unwrap();
    // What they do not store they do not throw back either: white walls are grey.
    assert_eq!(wall.stored_scale(), 0.25);
    assert!((wall.albedo - 0.25).length() < 1e-3, "{}", wall.albedo);
    for material in &mut world.materials {
        material.albedo = Vec3::ZERO;
    }
    let report = calibrate(&mut world, &small());
    assert!(report.after.median_stops < 0.05, "{report:?}");
    let total: Vec3 = world.point_lights.iter().map(|l| l.intensity).sum();
    let hidden: Vec3 = HIDDEN.iter().map(|(_, i)| *i).sum();
    assert!((total / hidden - 4.0).abs().max_element() < 0.4, "{total}");
}

#[test]
fn light_that_was_stored_encoded_is_decoded_again() {
    // The stored value is what the engine shows, v; the light is v^g.
    for gamma in [1.0f32, 2.2] {
        let encoded = |at: Vec3, n: Vec3| from_hidden(at, n).powf(gamma.recip());
        let mut world = room(false, Some(&encoded));
        let options = CalibrationOptions {
            samples: 3000,
            candidates: 1500,
            ..Default::default()
        };
        let report = calibrate(&mut world, &options);
        println!("{report:?}");
        assert_eq!((world.stored_gamma, report.gamma), (gamma, gamma));
        assert!(report.after.median_stops < 0.05, "{report:?}");
        let total: Vec3 = world.point_lights.iter().map(|l| l.intensity).sum();
        let hidden: Vec3 = HIDDEN.iter().map(|(_, i)| *i).sum();
        let off = (total / hidden - 1.0).abs().max_element();
        assert!(off < 0.1, "{gamma}: {total}");
        // Directives give light on the scale of stored light.
        let there_and_back = world.lighting();
        world.stored_gamma = 5.0;
        world.set_lighting(there_and_back);
        assert_eq!(world.stored_gamma, gamma);
    }
}

/// What calibration may change.
fn lights(world: &RelitWorld) -> String {
    format!(
        "{:?} {:?} {:?} {:?} {:?}",
        world.lights, world.point_lights, world.suns, world.ambient, world.light_lists
    )
}

#[test]
fn without_stored_light_nothing_changes() {
    let mut world = room(true, None);
    let before = lights(&world);
    let report = calibrate(&mut world, &small());
    assert_eq!(report.evidence, Evidence::Nothing);
    assert_eq!(report.samples, 0);
    assert_eq!(lights(&world), before);
}

#[test]
fn the_light_grid_is_used_without_other_stored_light() {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_room(wall, ROOM[0], ROOM[1]);
    let (origin, intensity) = HIDDEN[0];
    let bsp = map.build_with_grid(Vec3::splat(32.0), |p| {
        let offset = origin - p;
        let direction = offset.normalize_or_zero();
        let stored = intensity / offset.length_squared() / PI * 255.0 / 4.0;
        let turn = 256.0 / std::f32::consts::TAU;
        let byte = |angle: f32| (angle * turn).round().rem_euclid(256.0) as u8;
        q3bsp::GridPoint {
            ambient: [1; 3],
            directed: stored.to_array().map(|c| c.round().min(255.0) as u8),
            longitude: byte(direction.z.clamp(-1.0, 1.0).acos()),
            latitude: byte(direction.y.atan2(direction.x)),
        }
    });
    let mut world = relit(&bsp);
    let report = calibrate(&mut world, &small());
    println!("{report:?} {:?}", world.point_lights);
    assert_eq!(report.evidence, Evidence::Grid);
    let near = world
        .point_lights
        .iter()
        .filter(|l| l.origin.distance(origin) < 40.0);
    let sum: Vec3 = near.map(|l| l.intensity).sum();
    assert!((sum / intensity - 1.0).abs().max_element() < 0.25, "{sum}");
}

#[test]
fn shipped_maps_agree_with_their_lightmaps() {
    let Some(folder) = testkit::folder() else {
        return;
    };
    let files = SearchPath::open(&[folder]).unwrap();
    let (materials, _) = Materials::load(&files);
    // The largest median error on samples that fitting did not see, stops.
    let maps = [
        ("oa_dm1", 0.35),
        ("oa_dm3", 0.35),
        ("oa_dm5", 0.35),
        ("oa_dm7", 0.35),
        ("kaos2", 0.35),
        ("am_lavactf", 0.35),
    ];
    for (map, largest) in maps {
        let options = Options {
            calibrate: Some(CalibrationOptions {
                samples: 3000,
                candidates: 1500,
                ..Default::default()
            }),
            ..Default::default()
        };
        let path = format!("maps/{map}.bsp");
        let world = RelitWorld::load(&files, &materials, &path, options).unwrap();
        let report = world.calibration.unwrap();
        println!("{map}: {report:?}");
        assert!(report.held_out > 200, "{map}");
        assert!(report.after.median_stops <= largest, "{map}: {report:?}");
        assert!(
            report.after.median_stops * 2.0 <= report.before.median_stops,
            "{map}: {report:?}"
        );
        assert!(
            (0.8..1.2).contains(&report.after.sum_ratio),
            "{map}: {report:?}"
        );
    }
}
