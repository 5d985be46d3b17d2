//! Light at points (`relight bake`) compared with closed forms.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use relight::bake::{Light, LitSurfaces, LitTriangle, Point};
use relight::light::{Falloff, Spot};
use shaders::trace_types::SkyRecord;
use shaders::types::constants as c;

use super::harness::{Gpu, Scene, ceiling_at, floor_at, gpu_tests, lambert, rectangle, wall_at};
use crate::trace::bake::{BakeScene, Baker, Limits, Shared};
use crate::trace::bake_passes::BakePasses;

gpu_tests! {
    each: [
        a_point_light_follows_the_cosine_and_the_distance,
        triangles_have_the_form_factor_of_a_rectangle,
        what_stands_before_a_light_hides_it,
        a_closed_box_reflects_its_reflectance,
    ],
    any: [
        falloff_and_cone_are_those_of_the_compiler,
        negative_lights_take_light_away,
        suns_shine_through_the_sky,
        a_sky_lights_by_what_is_visible_of_it,
        a_light_ends_at_its_cutoff,
        the_part_of_a_triangle_above_the_horizon_counts,
        points_without_surface_have_no_cosine,
        texels_and_vertices_are_found_where_they_are,
    ],
}

fn on_floor(x: f32, y: f32) -> Point {
    Point::new(Vec3::new(x, y, 0.1), Vec3::Z)
}

/// A scene seen from nowhere.
pub(super) fn scene() -> Scene {
    Scene::new(Vec3::ZERO, Vec3::X, 90.0, 8)
}

/// A floor at z = 0, and lights by the caller.
fn floor() -> Scene {
    let mut scene = scene();
    let grey = scene.diffuse(0.5);
    scene.quad(floor_at(0.0, 2000.0), grey);
    scene
}

/// For each triangle of the geometry the radiance of the sky's light that lies on it.
fn sky_light_of(scene: &Scene, sources: &[u32]) -> Vec<Vec3> {
    if !scene.lights.iter().any(|light| light.is_sky) {
        return Vec::new();
    }
    let of_triangle = |source: &u32| {
        let on = (scene.lights.iter()).find(|light| light.is_sky && light.triangle == *source);
        on.map_or(Vec3::ZERO, |light| light.radiance)
    };
    sources.iter().map(of_triangle).collect()
}

/// What computes light in a scene.
pub(super) fn with<T>(
    gpu: &mut Gpu,
    scene: &Scene,
    limits: Option<Limits>,
    compute: impl FnOnce(&mut Baker, &mut Shared<'_>, BakeScene<'_>) -> T,
) -> T {
    let uploaded = scene.upload(&gpu.device, gpu.tracer);
    let lists = scene.lists();
    let source = scene.light_source(&lists);
    let sky_light = &sky_light_of(scene, &uploaded.geometry.sources);
    let mut baker = Baker::new(&gpu.device, gpu.tracer, &source, sky_light).expect("lights");
    baker.limits = limits.unwrap_or(baker.limits);
    let lit = BakeScene {
        geometry: &uploaded.geometry,
        materials: &uploaded.materials,
    };
    let mut passes = BakePasses::new(&gpu.device, gpu.tracer);
    let shared = &mut Shared {
        ring: &mut gpu.ring,
        passes: &mut passes,
    };
    let result = compute(&mut baker, shared, lit);
    gpu.device.wait_idle().expect("done");
    gpu.check_messages();
    result
}

fn direct(gpu: &mut Gpu, scene: &Scene, points: &[Point], samples: u32) -> Vec<Light> {
    let mut last = 0.0;
    let found = with(gpu, scene, None, |baker, shared, lit| {
        let progress = &mut |done| last = done;
        baker.direct(shared, lit, points, samples, progress)
    });
    let found = found.expect("light");
    assert_eq!(found.len(), points.len());
    assert_eq!(last, 1.0);
    found
}

fn reflected(
    gpu: &mut Gpu,
    scene: &Scene,
    points: &[Point],
    lit: &LitSurfaces<'_>,
    rays: u32,
) -> Vec<Light> {
    let found = with(gpu, scene, None, |baker, shared, seen| {
        baker.reflected(shared, seen, points, (lit, rays), &mut |_| {})
    });
    found.expect("light")
}

#[track_caller]
fn assert_near(found: f32, exact: f32, part: f32) {
    let most = part * exact.abs().max(1.0e-6);
    assert!((found - exact).abs() <= most, "{found} for {exact}");
}

fn a_point_light_follows_the_cosine_and_the_distance(gpu: &mut Gpu) {
    let mut scene = floor();
    let lamp = Vec3::new(30.0, -10.0, 120.0);
    scene.point(lamp, 5000.0, 4.0);
    let points: Vec<Point> = (0..40).map(|i| on_floor(i as f32 * 17.0, -30.0)).collect();
    for samples in [0, 1, 16] {
        let found = direct(gpu, &scene, &points, samples);
        for (point, light) in points.iter().zip(&found) {
            let to = lamp - point.position;
            let exact = 5000.0 * to.normalize().z / to.length_squared() / PI;
            assert_near(light.value.x, exact, 1e-4);
            assert_near(light.value.z, exact, 1e-4);
            // the sphere has a radius of 4 units: its directions differ by a few degrees
            let off = (light.towards / exact - to.normalize()).length();
            assert!(off < if samples == 0 { 1e-4 } else { 0.05 }, "{off}");
        }
    }
}

fn triangles_have_the_form_factor_of_a_rectangle(gpu: &mut Gpu) {
    // of a rectangle a by b, parallel to the surface, with a corner above the point (Howell, A Catalog of Radiation Heat
    // Transfer Configuration Factors, B-3)
    let factor = |a: f32, b: f32, height: f32| {
        let (x, y) = (a / height, b / height);
        let term = |x: f32, y: f32| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
        (term(x, y) + term(y, x)) / (2.0 * PI)
    };
    for (a, b, height) in [(80.0, 40.0, 30.0), (8.0, 4.0, 200.0), (300.0, 300.0, 12.0)] {
        let mut scene = floor();
        let corners = [
            Vec3::new(0.0, 0.0, height),
            Vec3::new(0.0, b, height),
            Vec3::new(a, b, height),
            Vec3::new(a, 0.0, height),
        ];
        for [p, q, r] in [[0, 1, 2], [0, 2, 3]] {
            scene.light(
                [corners[p], corners[q], corners[r]],
                Vec3::new(1.0, 2.0, 4.0),
            );
        }
        let exact = factor(a, b, height - 0.1);
        for samples in [0, 4] {
            let light = direct(gpu, &scene, &[on_floor(0.0, 0.0)], samples)[0];
            println!(
                "{a} x {b} at {height}, {samples}: {} for {exact}",
                light.value
            );
            assert_near(light.value.x, exact, 3e-3);
            assert_near(light.value.z, 4.0 * exact, 3e-3);
            assert!(light.towards.x > 0.0 && light.towards.y > 0.0 && light.towards.z > 0.0);
        }
        // from behind
        let above = Point::new(Vec3::new(0.0, 0.0, height + 50.0), Vec3::NEG_Z);
        assert_eq!(direct(gpu, &scene, &[above], 4)[0], Light::default());
    }
}

fn what_stands_before_a_light_hides_it(gpu: &mut Gpu) {
    let mut scene = floor();
    let grey = scene.diffuse(0.5);
    scene.point(Vec3::new(-5.0, 0.0, 100.0), 1000.0, 0.0);
    // a lamp of 20 by 20 units; an opaque half plane at half its height hides x < 0
    let corner = Vec3::new(-10.0, 190.0, 100.0);
    let (x, y) = (Vec3::X * 20.0, Vec3::Y * 20.0);
    scene.light([corner, corner + y, corner + x], Vec3::ONE);
    scene.light([corner + x, corner + y, corner + x + y], Vec3::ONE);
    let hidden = [
        Vec3::new(-400.0, -400.0, 50.0),
        Vec3::new(0.0, -400.0, 50.0),
        Vec3::new(0.0, 400.0, 50.0),
        Vec3::new(-400.0, 400.0, 50.0),
    ];
    scene.quad(hidden, grey);
    let unshadowed = |point: Point, light: usize| {
        let triangle = scene.lights[light].vertices;
        lambert(point.position, point.normal, triangle, 1.0)
    };
    let points = [
        on_floor(-30.0, 0.0),
        on_floor(30.0, 0.0),
        on_floor(0.0, 200.0),
    ];
    let found = direct(gpu, &scene, &points, 256);
    // in the shadow of both lights
    assert_eq!(found[0], Light::default());
    let to = Vec3::new(-35.0, 0.0, 99.9);
    let lamp = 1000.0 * to.normalize().z / to.length_squared() / PI;
    let both = lamp + unshadowed(points[1], 0) + unshadowed(points[1], 1);
    assert_near(found[1].value.x, both, 2e-3);
    // below the edge, half of the lamp is visible
    let halves = 0.5 * (unshadowed(points[2], 0) + unshadowed(points[2], 1));
    println!("half: {} for {halves}", found[2].value.x);
    assert_near(found[2].value.x, halves, 0.02);
}

fn falloff_and_cone_are_those_of_the_compiler(gpu: &mut Gpu) {
    let linear = Falloff::Linear { reach: 400.0 };
    let spot = Spot {
        direction: Vec3::new(0.3, 0.1, -1.0).normalize(),
        tan_half_angle: 0.6,
    };
    for (falloff, spot) in [
        (linear, None),
        (Falloff::LinearAtAnyAngle { reach: 300.0 }, None),
        (Falloff::InverseSquare, Some(spot)),
        (linear, Some(spot)),
    ] {
        let mut scene = floor();
        let lamp = Vec3::new(0.0, 0.0, 150.0);
        scene.point(lamp, 9000.0, 0.0);
        scene.points[0].falloff = falloff;
        scene.points[0].spot = spot;
        let points: Vec<Point> = (-30..30).map(|i| on_floor(i as f32 * 11.0, 3.0)).collect();
        let found = direct(gpu, &scene, &points, 8);
        let exact: Vec<f32> = (points.iter())
            .map(|point| {
                let to = lamp - point.position;
                let part = spot.map_or(1.0, |spot| spot.part(to));
                9000.0 * part * falloff.irradiance(to.length(), to.normalize().z) / PI
            })
            .collect();
        for (light, exact) in found.iter().zip(&exact) {
            assert!((light.value.y - exact).abs() <= 1e-4 * exact + 1e-6);
        }
        let lit = exact.iter().filter(|v| **v > 0.0).count();
        assert!(lit > 10 && lit < 58, "{lit} points are lit");
    }
}

fn negative_lights_take_light_away(gpu: &mut Gpu) {
    let mut scene = floor();
    let lamp = Vec3::new(0.0, 0.0, 100.0);
    scene.point(lamp, 5000.0, 4.0);
    scene.point(lamp, -2000.0, 0.0);
    let point = on_floor(40.0, 0.0);
    let to = lamp - point.position;
    let exact = 3000.0 * to.normalize().z / to.length_squared() / PI;
    for samples in [0, 8] {
        let light = direct(gpu, &scene, &[point], samples)[0];
        assert_near(light.value.x, exact, 1e-4);
        assert!((light.towards.normalize() - to.normalize()).length() < 0.05);
    }
}

/// A sky without images.
fn black_sky(scene: &mut Scene) -> u32 {
    let record = SkyRecord {
        faces: [c::NO_TEXTURE; 6],
        cloud_height: 512.0,
    };
    scene.sky(&[], record)
}

fn suns_shine_through_the_sky(gpu: &mut Gpu) {
    let mut scene = floor();
    let sky = black_sky(&mut scene);
    scene.quad(ceiling_at(500.0, 2000.0), sky);
    let grey = scene.diffuse(0.5);
    scene.quad(ceiling_at(100.0, 50.0), grey);
    let to_sun = Vec3::new(0.0, 0.6, 0.8);
    scene.sun(to_sun, 3.0, 0.01);
    let points = [on_floor(0.0, 200.0), on_floor(0.0, -75.0)]; // the second in the roof's shadow
    for samples in [0, 16] {
        let found = direct(gpu, &scene, &points, samples);
        let exact = 3.0 * 0.8 / PI;
        assert_near(found[0].value.x, exact, 1e-4);
        assert!((found[0].towards / exact - to_sun).length() < 0.02);
        assert_eq!(found[1], Light::default());
    }
}

fn a_sky_lights_by_what_is_visible_of_it(gpu: &mut Gpu) {
    let mut scene = floor();
    let sky = black_sky(&mut scene);
    let grey = scene.diffuse(0.5);
    // over x > 0 the sky is a light; over x < 0 there is a roof
    let first = scene.indices.len() as u32 / 3;
    let (x, y) = (Vec3::X * 9000.0, Vec3::Y * 18000.0);
    scene.quad(rectangle(Vec3::new(0.0, -9000.0, 40.0), y, x), sky);
    scene.quad(rectangle(Vec3::new(-9000.0, -9000.0, 40.0), y, x), grey);
    for triangle in [first, first + 1] {
        scene.light([Vec3::ZERO, Vec3::Y, Vec3::X], Vec3::new(0.5, 1.0, 2.0));
        if let Some(light) = scene.lights.last_mut() {
            (light.is_sky, light.triangle) = (true, triangle);
        }
    }
    for samples in [0, 4] {
        let points = [
            on_floor(0.0, 0.0),
            on_floor(1500.0, 0.0),
            on_floor(-1500.0, 0.0),
        ];
        let found = direct(gpu, &scene, &points, samples);
        println!("{found:?}");
        assert_near(found[0].value.y, 0.5, 0.02);
        assert_near(found[1].value.y, 1.0, 0.02);
        assert_near(found[1].value.x, 0.5, 0.02);
        assert!(found[2].value.y < 0.01);
    }
}

fn a_light_ends_at_its_cutoff(gpu: &mut Gpu) {
    let mut scene = floor();
    scene.point(Vec3::new(0.0, 0.0, 100.0), 1000.0, 0.0);
    scene.light_cutoff = 1000.0 / 200.0f32.powi(2) / PI * 0.5;
    let points: Vec<Point> = (0..50).map(|i| on_floor(i as f32 * 10.0, 0.0)).collect();
    for (point, light) in points.iter().zip(direct(gpu, &scene, &points, 4)) {
        let to = Vec3::new(0.0, 0.0, 100.0) - point.position;
        let exact = 1000.0 * to.normalize().z / to.length_squared() / PI;
        let kept = if exact < scene.light_cutoff {
            0.0
        } else {
            exact
        };
        assert_near(light.value.x, kept, 1e-4);
    }
}

/// L of a triangle of radiance 1 at a point, by numerical integration over its area.
fn integrated(point: Point, [a, b, c]: [Vec3; 3]) -> f32 {
    const PIECES: u32 = 300;
    let face = (b - a).cross(c - a).normalize();
    let piece = (b - a).cross(c - a).length() * 0.5 / (PIECES * PIECES) as f32;
    let mut sum = 0.0f64;
    for i in 0..PIECES {
        for j in 0..PIECES - i {
            for third in [1.0, 2.0] {
                if third == 2.0 && i + j + 1 >= PIECES {
                    continue;
                }
                let (u, v) = (i as f32 + third / 3.0, j as f32 + third / 3.0);
                let at = a + ((b - a) * u + (c - a) * v) / PIECES as f32;
                let to = at - point.position;
                let direction = to.normalize();
                let cosine = match point.normal == Vec3::ZERO {
                    true => 1.0,
                    false => direction.dot(point.normal).max(0.0),
                };
                let part = cosine * (-direction.dot(face)).max(0.0) / to.length_squared();
                sum += f64::from(part * piece);
            }
        }
    }
    sum as f32 / PI
}

fn the_part_of_a_triangle_above_the_horizon_counts(gpu: &mut Gpu) {
    // a wall that crosses the plane of the surface, and one that is far away
    for distance in [20.0, 600.0] {
        let mut scene = scene();
        let triangle = [
            Vec3::new(distance, -60.0, -30.0),
            Vec3::new(distance, 10.0, 70.0),
            Vec3::new(distance, 50.0, -20.0),
        ];
        scene.light(triangle, Vec3::ONE);
        for normal in [
            Vec3::Z,
            Vec3::new(0.6, 0.0, -0.8),
            Vec3::X,
            Vec3::new(-0.1, 0.2, 1.0),
        ] {
            let point = Point::new(Vec3::ZERO, normal.normalize());
            let exact = integrated(point, triangle);
            for samples in [0, 8] {
                let found = direct(gpu, &scene, &[point], samples)[0];
                println!("{distance} {normal}: {} for {exact}", found.value.x);
                assert_near(found.value.x, exact, 5e-3);
                let towards = found.towards.normalize_or_zero();
                assert!(towards.dot(point.normal) > 0.0, "{towards}");
            }
        }
    }
}

fn points_without_surface_have_no_cosine(gpu: &mut Gpu) {
    let free = Point::new(Vec3::new(3.0, 4.0, 20.0), Vec3::ZERO);
    let mut scene = scene();
    scene.point(Vec3::new(3.0, 104.0, 20.0), 1000.0, 4.0);
    let found = direct(gpu, &scene, &[free], 16)[0];
    assert_near(found.value.x, 1000.0 / 100.0f32.powi(2) / PI, 1e-4);
    // the plane of a floor that a point of the grid lies in hides nothing above it
    let mut scene = floor();
    scene.point(Vec3::new(3.0, 4.0, 100.0), 1000.0, 4.0);
    let on_plane = Point::new(Vec3::new(3.0, 4.0, 0.0), Vec3::ZERO);
    let found = direct(gpu, &scene, &[on_plane], 16)[0];
    assert_near(found.value.x, 1000.0 / 100.0f32.powi(2) / PI, 1e-4);
    let mut scene = self::scene();
    let triangle = [
        Vec3::new(-40.0, -40.0, 60.0),
        Vec3::new(0.0, 50.0, 60.0),
        Vec3::new(50.0, -20.0, 60.0),
    ];
    scene.light(triangle, Vec3::ONE);
    for samples in [0, 16] {
        let found = direct(gpu, &scene, &[free], samples)[0];
        assert_near(found.value.x, integrated(free, triangle), 3e-3);
        assert!(found.towards.z > 0.8 * found.value.x);
    }
}

/// A triangle for each two of a scene's triangles, all with one texel of light, and their reflectance.
pub(super) fn uniform(scene: &Scene, reflectance: f32) -> (Vec<LitTriangle>, Vec<Vec3>) {
    let count = scene.indices.len() / 3;
    let texels = LitTriangle::Texels {
        first: 0,
        side: 1,
        corners: [Vec2::splat(0.5); 3],
    };
    let place = |i: usize| match i % 2 {
        0 => texels,
        _ => LitTriangle::Vertices([0; 3]),
    };
    let places = (0..count).map(place).collect();
    (places, vec![Vec3::new(reflectance, 0.25, 1.0); count])
}

fn a_closed_box_reflects_its_reflectance(gpu: &mut Gpu) {
    let mut scene = scene();
    let grey = scene.diffuse(0.5);
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), grey);
    let (triangles, reflectances) = uniform(&scene, 0.5);
    let lit = LitSurfaces {
        triangles: &triangles,
        reflectances: &reflectances,
        light: &[Vec3::new(2.0, 4.0, 3.0)],
    };
    let wall = |x: f32| Point::new(Vec3::new(x, 13.0, 20.0), -Vec3::X * x.signum());
    let free = Point {
        normal: Vec3::ZERO,
        ..wall(30.0)
    };
    let outside = Point::new(Vec3::new(300.0, 0.0, 0.0), Vec3::NEG_X);
    let points = [wall(99.9), wall(-99.9), free, outside];
    let found = reflected(gpu, &scene, &points, &lit, 256);
    let exact = Vec3::new(1.0, 1.0, 3.0);
    let bright = 0.2126 + 0.7152 + 3.0 * 0.0722;
    for (light, point) in found[..2].iter().zip(points) {
        assert!(
            (light.value - exact).abs().max_element() < 1e-4,
            "{light:?}"
        );
        // the mean of a cosine-weighted direction is 2/3 of the normal
        let towards = light.towards / bright;
        assert!(
            (towards - point.normal * (2.0 / 3.0)).length() < 0.01,
            "{towards}"
        );
    }
    assert!((found[2].value - 4.0 * exact).abs().max_element() < 1e-3);
    assert!(found[2].towards.length() < 0.05 * 4.0 * bright);
    // backs reflect nothing
    assert_eq!(found[3], Light::default());
}

fn texels_and_vertices_are_found_where_they_are(gpu: &mut Gpu) {
    let mut scene = scene();
    let grey = scene.diffuse(0.5);
    // 8 x 8 texels of 25 units, from (-100, -100) on
    scene.quad(floor_at(0.0, 100.0), grey);
    scene.quad(wall_at(1000.0, 100.0), grey);
    let texel = |vertex: u32| {
        let p = scene.vertices[vertex as usize].position;
        Vec2::new(p.x + 100.0, p.y + 100.0) / 25.0
    };
    let corners = |t: usize| [0, 1, 2].map(|k| scene.indices[3 * t + k]);
    let page = |t: usize| LitTriangle::Texels {
        first: 5,
        side: 8,
        corners: corners(t).map(texel),
    };
    let light: Vec<Vec3> = (0..69).map(|i| Vec3::splat(i as f32)).collect();
    let by_vertex = |t: usize| LitTriangle::Vertices(corners(t).map(|v| v % 4));
    let reflectances = [Vec3::ONE; 4];
    let near = |x: f32, y: f32| Point::new(Vec3::new(x, y, 0.05), Vec3::NEG_Z);
    let places: Vec<(usize, usize)> = (0..64).map(|i| (i % 8, i / 8)).collect();
    let points: Vec<Point> = (places.iter())
        .map(|&(x, y)| near(-87.5 + 25.0 * x as f32, -87.5 + 25.0 * y as f32))
        .collect();
    let triangles = [page(0), page(1), LitTriangle::Dark, LitTriangle::Dark];
    let lit = LitSurfaces {
        triangles: &triangles,
        reflectances: &reflectances,
        light: &light,
    };
    for (light, (x, y)) in reflected(gpu, &scene, &points, &lit, 32)
        .iter()
        .zip(&places)
    {
        assert_near(light.value.x, (5 + 8 * y + x) as f32, 0.01);
    }
    // the corners have the values 0, 1, 2, 3: 0 at (-1, -1), 1 at (1, -1), 2 at (1, 1), 3 at (-1, 1); the diagonal from 0 to 2
    let triangles = [
        by_vertex(0),
        by_vertex(1),
        LitTriangle::Dark,
        LitTriangle::Dark,
    ];
    let lit = LitSurfaces {
        triangles: &triangles,
        ..lit
    };
    let points = [near(50.0, -50.0), near(-50.0, 50.0), near(0.0, 0.0)];
    let found = reflected(gpu, &scene, &points, &lit, 32);
    for (light, exact) in found.iter().zip([1.0, 2.0, 1.0]) {
        assert!((light.value.x - exact).abs() < 0.01, "{light:?}, {exact}");
    }
    // a damaged description reflects nothing
    let triangles = [LitTriangle::Vertices([0, 1, 99]), LitTriangle::Dark];
    let lit = LitSurfaces {
        triangles: &triangles,
        ..lit
    };
    let found = reflected(gpu, &scene, &points, &lit, 4);
    assert!(found.iter().all(|light| *light == Light::default()));
}
