//! A room with a known light grid, baked as a compiler does.

use super::*;
use crate::occluders::Occluders;
use q3bsp::GridPoint;

/// What a compiler stores at a point of the grid: the mean of the ways to the lights, weighted by their light, the light
/// that comes from there, and a quarter of the rest.
pub(super) fn baked(lights: &[(Vec3, Vec3)], scale: f32, at: Vec3) -> GridPoint {
    let seen = lights.iter().filter(|(origin, _)| !in_pillar(at, *origin));
    let parts: Vec<(Vec3, Vec3)> = seen
        .map(|(origin, intensity)| {
            let offset = *origin - at;
            let light = *intensity / offset.length_squared().max(256.0) / PI;
            (offset.normalize_or_zero(), light)
        })
        .collect();
    let sum: Vec3 = parts
        .iter()
        .map(|(way, light)| *way * light.element_sum())
        .sum();
    let turn = 256.0 / std::f32::consts::TAU;
    let byte = |angle: f32| (angle * turn).round().rem_euclid(256.0) as u8;
    let way = sum.normalize_or(Vec3::Z);
    let mut point = GridPoint {
        ambient: [1; 3],
        directed: [0; 3],
        longitude: byte(way.z.clamp(-1.0, 1.0).acos()),
        latitude: byte(way.y.atan2(way.x)),
    };
    let (mut directed, mut ambient) = (Vec3::ZERO, Vec3::ZERO);
    for (to, light) in parts {
        let part = to.dot(point.direction()).max(0.0);
        directed += light * part;
        ambient += light * (0.25 * (1.0 - part));
    }
    let bytes = |light: Vec3| {
        let light = light * (scale * 255.0 / 4.0);
        (light / (light.max_element() / 255.0).max(1.0))
            .to_array()
            .map(|c| c.round() as u8)
    };
    point.directed = bytes(directed);
    point.ambient = bytes(ambient).map(|c| c.max(1));
    point
}

/// Sum and weighted middle of the lights within 48 units of each hidden one: distance, part of the intensity.
fn found(world: &RelitWorld) -> Vec<(f32, f32)> {
    let hidden: Vec<PointLight> = HIDDEN
        .iter()
        .map(|&(origin, intensity)| PointLight {
            origin,
            intensity,
            radius: 4.0,
            spot: None,
            falloff: crate::light::Falloff::InverseSquare,
            pulse: None,
        })
        .collect();
    let found = hidden.iter().map(|h| {
        let near = world
            .point_lights
            .iter()
            .filter(|l| l.origin.distance(h.origin) < 48.0);
        let sum: f32 = near.clone().map(|l| l.intensity.element_sum()).sum();
        let middle: Vec3 = near.map(|l| l.origin * l.intensity.element_sum()).sum();
        let off = (middle / sum.max(1e-6)).distance(h.origin);
        (off, sum / h.intensity.element_sum())
    });
    found.collect()
}

#[test]
fn the_light_grid_places_lights_that_few_texels_see() {
    // Two of twelve faces are lightmapped, and the grid is stored half as bright as it should be.
    let light = |gridded: bool| {
        let map = room_map("t/wall", false, 2, Some(&from_hidden));
        let bsp = if gridded {
            map.build_with_grid(Vec3::splat(48.0), |p| baked(&HIDDEN, 0.5, p))
        } else {
            map.build()
        };
        let mut world = relit(&bsp);
        let report = calibrate(&mut world, &small());
        assert_eq!(report.evidence, Evidence::Lightmaps);
        println!("{report:?} {:?}", world.point_lights);
        (found(&world), report)
    };
    let (with, report) = light(true);
    let (without, _) = light(false);
    println!("{with:?} {without:?}");
    assert!(report.after.median_stops < 0.1, "{report:?}");
    for (off, part) in &with {
        assert!(*off < 16.0 && (part - 1.0).abs() < 0.2, "{with:?}");
    }
    // Without it one is far off, and one more is put in for what that leaves.
    let worst = |found: &[(f32, f32)]| found.iter().map(|f| f.0).fold(0.0, f32::max);
    assert!(worst(&with) < worst(&without), "{with:?} {without:?}");
}

#[test]
fn vertex_light_joins_the_texels() {
    let mut map = room_map("t/wall", false, 2, Some(&from_hidden));
    let wall = map.add_shader("t/wall", 0, 1);
    // A pane in the open, lit at its corners as the lights have it.
    let corners = [[-40.0, 0.0], [-40.0, 60.0], [40.0, 60.0], [40.0, 0.0]];
    let pane = map.add_quad(wall, corners.map(|[x, y]| Vec3::new(x, y, 40.0)));
    map.set_lightmap(pane, q3bsp::lightmap_index::BY_VERTEX);
    let normal = map.vertices_mut(pane)[0].normal;
    for vertex in map.vertices_mut(pane) {
        let stored = from_hidden(vertex.position + normal * 0.1, normal) * 255.0 / 4.0;
        let [r, g, b] = stored.to_array().map(|c| c.round() as u8);
        vertex.color = [r, g, b, 255];
    }
    let world = relit(&map.build());
    let occluders = Occluders::of_world(&world);
    let (samples, evidence) = samples::take(&world, &occluders, &sampling(4000));
    assert_eq!(evidence, Evidence::Lightmaps);
    let on_pane =
        |s: &&samples::Sample| (s.position.z - 40.0).abs() < 2.0 && s.position.x.abs() < 41.0;
    let on_pane: Vec<_> = samples.iter().filter(on_pane).collect();
    assert_eq!(on_pane.len(), 4);
    for sample in on_pane {
        let truth = from_hidden(sample.position, sample.normal);
        assert!(!sample.held_out && sample.trust == 1.0);
        let off = (sample.value - truth).abs().max_element();
        assert!(off < 0.05, "{} {truth}", sample.value);
    }
}
