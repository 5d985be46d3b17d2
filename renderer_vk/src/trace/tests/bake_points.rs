//! Points of a bake: how near surfaces are around them, and the division of their work.

use glam::{Vec3, Vec4};
use relight::bake::{Light, LitSurfaces, Point};
use relight::calibrate::{Dirt, Surroundings};

use super::baking::{scene, uniform, with};
use super::harness::{Gpu, Scene, floor_at, gpu_tests};
use crate::trace::bake::Limits;

gpu_tests! {
    each: [nearness_is_the_mean_over_the_rays],
    any: [
        results_do_not_depend_on_chunks,
        points_of_a_texel_divide_a_light_among_their_rays,
    ],
}

fn nearness(gpu: &mut Gpu, scene: &Scene, points: &[Point], around: &Surroundings) -> Vec<f32> {
    let found = with(gpu, scene, None, |baker, shared, seen| {
        baker.nearness(shared, seen, points, around, &mut |_| {})
    });
    found.expect("rays")
}

fn nearness_is_the_mean_over_the_rays(gpu: &mut Gpu) {
    let mut scene = scene();
    let grey = scene.diffuse(0.5);
    scene.room(Vec3::splat(-100.0), Vec3::splat(100.0), grey);
    let point = Point::new(Vec3::new(-60.0, 10.0, 30.0), Vec3::X);
    // the frame of a normal along x is -z, y, x
    let half = 0.5f32.sqrt();
    for (ray, exact) in [
        // 160 units away, beyond the reach
        (Vec4::W, 0.0),
        (Vec4::new(1.0, 0.0, 1.0, 0.0), 1.0 - 130.0 / 150.0),
        (Vec4::new(0.0, 1.0, half, half), 1.0 - 90.0 / half / 150.0),
    ] {
        let around = Surroundings {
            rays: vec![ray],
            reach: 150.0,
        };
        let found = nearness(gpu, &scene, &[point], &around)[0];
        assert!((found - exact).abs() < 1e-4, "{ray}: {found} {exact}");
    }
    // half of a ring of rays around a point at a wall meets it at once
    let mut scene = self::scene();
    let grey = scene.diffuse(0.5);
    scene.quad(floor_at(0.0, 4000.0), grey);
    let at = |height: f32, normal: Vec3| Point::new(Vec3::new(0.0, 0.0, height), normal);
    let around = Dirt::DEFAULT.surroundings();
    let points = [
        at(0.1, Vec3::X),
        at(0.1, Vec3::new(1.0, 0.0, -0.0)),
        at(60.0, Vec3::X),
        at(129.0, Vec3::NEG_Z),
        at(20.0, Vec3::Z),
    ];
    let found = nearness(gpu, &scene, &points, &around);
    assert!((found[0] - 24.0 / 49.0).abs() < 0.07, "{found:?}");
    assert!((found[1] - found[0]).abs() < 0.07, "{found:?}");
    assert!(found[2] > 0.0 && found[2] < found[0], "{found:?}");
    assert_eq!(found[3..], [0.0, 0.0]);
}

fn results_do_not_depend_on_chunks(gpu: &mut Gpu) {
    let mut scene = Scene::hall(0.0, 0.5, 8);
    for i in 0..9 {
        scene.lamp(
            Vec3::new(-150.0 + 30.0 * i as f32, -60.0, 110.0),
            25.0,
            Vec3::ONE,
        );
    }
    scene.point(Vec3::new(0.0, 60.0, 60.0), 3000.0, 6.0);
    let points: Vec<Point> = (0..900)
        .map(|i| {
            Point::new(
                Vec3::new(
                    (i % 30) as f32 * 12.0 - 180.0,
                    (i / 30) as f32 * 9.0 - 140.0,
                    -79.9,
                ),
                Vec3::Z,
            )
        })
        .collect();
    let (triangles, reflectances) = uniform(&scene, 0.7);
    let lit = LitSurfaces {
        triangles: &triangles,
        reflectances: &reflectances,
        light: &[Vec3::ONE],
    };
    let mut both = |limits: Option<Limits>| {
        with(gpu, &scene, limits, |baker, shared, seen| {
            let nothing = &mut |_| {};
            let direct = baker.direct(shared, seen, &points, 4, nothing);
            let reflected = baker.reflected(shared, seen, &points, (&lit, 7), nothing);
            (direct.expect("light"), reflected.expect("light"))
        })
    };
    let whole = both(None);
    for (points, slice) in [(100, 1), (333, 3), (1, u32::MAX)] {
        assert_eq!(whole, both(Some(Limits { points, slice })));
    }
    let lit = whole.0.iter().filter(|light| light.value.x > 0.0).count();
    assert!(lit > 500, "{lit} points are lit");
}

fn points_of_a_texel_divide_a_light_among_their_rays(gpu: &mut Gpu) {
    const TEXELS: usize = 200;
    let mut scene = scene();
    let grey = scene.diffuse(0.5);
    scene.quad(floor_at(0.0, 2000.0), grey);
    // an edge hides parts of a lamp and of a sphere
    scene.lamp(Vec3::new(-10.0, -10.0, 100.0), 20.0, Vec3::ONE);
    scene.point(Vec3::new(0.0, 5.0, 100.0), 20.0, 6.0);
    let edge = [
        (-400.0, -400.0),
        (0.0, -400.0),
        (0.0, 400.0),
        (-400.0, 400.0),
    ];
    scene.quad(edge.map(|(x, y)| Vec3::new(x, y, 50.0)), grey);
    let mut deviation = |ranks: [u32; 4]| {
        let points: Vec<Point> = (0..TEXELS)
            .flat_map(|_| ranks)
            .map(|rank| Point {
                rank,
                ..Point::new(Vec3::new(0.0, 0.0, 0.1), Vec3::Z)
            })
            .collect();
        let found = with(gpu, &scene, None, |baker, shared, seen| {
            baker.direct(shared, seen, &points, 1, &mut |_| {})
        });
        let found = found.expect("light");
        let texel = |four: &[Light]| four.iter().map(|light| light.value.x).sum::<f32>() / 4.0;
        let texels: Vec<f32> = found.chunks(4).map(texel).collect();
        let mean = texels.iter().sum::<f32>() / TEXELS as f32;
        let squares: f32 = texels
            .iter()
            .map(|value| (value / mean - 1.0).powi(2))
            .sum();
        (mean, (squares / TEXELS as f32).sqrt())
    };
    let (mean, alone) = deviation([0; 4]);
    let (same, together) = deviation([0, 1, 2, 3]);
    println!("{mean} {same}, deviation {alone}, {together}");
    assert!((same / mean - 1.0).abs() < 0.1, "{mean} {same}");
    assert!(together < 0.65 * alone, "{alone} {together}");
}
