//! Light at points of a real map: all tracers and the CPU's rays agree.

use std::sync::Arc;

use glam::Vec3;
use relight::bake::{Gather, Light, LitSurfaces, LitTriangle, Point, Rays};
use relight::calibrate::Dirt;
use relight::{GameFiles, Options, RelitWorld};

use crate::bake::{BakeDevice, GatherOptions, GpuGather};
use crate::error::Error;
use crate::settings::TracerChoice;
use crate::test_support::openarena;

/// A map as its directives light it.
fn load(files: &dyn GameFiles, map: &str) -> RelitWorld {
    let scripts = relight::Materials::load(files).0;
    let options = Options {
        calibrate: None,
        by_hand: false,
        ..Options::default()
    };
    RelitWorld::load(files, &scripts, map, options).expect("map")
}

fn device(tracer: TracerChoice, validation: bool) -> Result<Arc<BakeDevice>, Error> {
    let options = GatherOptions {
        tracer,
        validation,
        ..GatherOptions::default()
    };
    BakeDevice::new(&options).map(Arc::new)
}

fn gather(on: &Arc<BakeDevice>, files: &Arc<dyn GameFiles>, world: &RelitWorld) -> GpuGather {
    let scripts = Arc::new(relight::Materials::load(&**files).0);
    GpuGather::new(on, Arc::clone(files), scripts, world).expect("the world")
}

/// Points one unit above the middle of each of about `count` triangles of the world that stop light; every eighth has no
/// surface.
fn points(world: &RelitWorld, count: usize) -> Vec<Point> {
    let of_world = world.surfaces.iter().filter(|s| s.model == 0);
    let opaque = of_world.filter(|s| {
        let material = world.material_of(s);
        material.is_some_and(|m| {
            !m.is_sky() && m.class.class == relight::materials::light::SurfaceClass::Opaque
        })
    });
    let all: Vec<usize> = opaque.flat_map(|s| s.triangles()).collect();
    let step = (all.len() / count).max(1);
    let chosen = all.iter().step_by(step).enumerate();
    chosen
        .filter_map(|(number, &triangle)| {
            let [a, b, c] = world.triangle(triangle);
            let normal = (c - a).cross(b - a).try_normalize()?;
            let position = (a + b + c) / 3.0 + normal;
            // points in solid leafs have the list of all lights
            let is_open = world.bsp.cluster_at(position) >= 0;
            is_open.then_some(Point::new(
                position,
                if number % 8 == 7 { Vec3::ZERO } else { normal },
            ))
        })
        .collect()
}

/// The median, and the 90th of 100 parts, of relative differences of green where one is above a hundredth of the mean; and
/// the difference of the means.
fn differences(found: &[Light], exact: &[Light]) -> [f32; 3] {
    let mean = |lights: &[Light]| {
        lights
            .iter()
            .map(|light| f64::from(light.value.y))
            .sum::<f64>() as f32
            / lights.len() as f32
    };
    let least = 0.01 * mean(exact);
    let mut differences: Vec<f32> = (found.iter().zip(exact))
        .map(|(found, exact)| (found.value.y, exact.value.y))
        .filter(|(found, exact)| found.max(*exact) > least)
        .map(|(found, exact)| (found - exact).abs() / found.max(exact))
        .collect();
    assert!(differences.len() > 100, "{} lit points", differences.len());
    differences.sort_by(f32::total_cmp);
    let at = |part: f32| differences[(differences.len() as f32 * part) as usize];
    [at(0.5), at(0.9), mean(found) / mean(exact) - 1.0]
}

#[test]
fn the_gpu_finds_the_light_that_the_cpu_finds() {
    let Some(files) = openarena() else {
        return;
    };
    let files: Arc<dyn GameFiles> = Arc::new(files);
    let tracers = [
        TracerChoice::Compute,
        TracerChoice::Pipeline,
        TracerChoice::Query,
        TracerChoice::Grid,
    ];
    let full = testkit::is_set("RELIGHT_FULL");
    let tracers = if full { &tracers[..] } else { &tracers[..2] };
    // am_galmevish: points inside of torches, and on lamps, closer to them than a lamp is wide, where the CPU takes the visible part of the area
    for (map, tracers, bounds) in [
        ("maps/kaos2.bsp", tracers, [0.003, 0.04, 0.01, 1.0 / 255.0]),
        (
            "maps/am_galmevish.bsp",
            &tracers[..1],
            [0.02, 0.5, 0.08, 0.3],
        ),
    ] {
        let world = load(&*files, map);
        let points = points(&world, 400);
        let count = world.indices.len() / 3;
        let triangles = vec![LitTriangle::Vertices([0; 3]); count];
        let reflectances = vec![Vec3::new(0.25, 0.5, 0.75); count];
        let lit = LitSurfaces {
            triangles: &triangles,
            reflectances: &reflectances,
            light: &[Vec3::ONE],
        };
        let mut cpu = Rays::new(&world);
        let nothing = &mut |_| {};
        let on_surfaces: Vec<Point> = points
            .iter()
            .filter(|p| p.normal != Vec3::ZERO)
            .copied()
            .collect();
        let around = Dirt::DEFAULT.surroundings();
        let near = cpu.nearness(&on_surfaces, &around, nothing).expect("rays");
        let exact = [0, 32].map(|samples| cpu.direct(&points, samples, nothing).expect("light"));
        let bounced = cpu.reflected(&points, lit, 256, nothing).expect("light");
        println!(
            "{map}: {} points, {} triangle lights, {} points, {} suns",
            points.len(),
            world.lights.len(),
            world.point_lights.len(),
            world.suns.len()
        );
        let mut first: Option<[Vec<Light>; 3]> = None;
        for &tracer in tracers {
            let made = device(tracer, true);
            let Some(on) = testkit::device(made.map_err(|e| e.to_string())) else {
                return;
            };
            let mut gpu = gather(&on, &files, &world);
            let direct =
                [0, 32].map(|samples| gpu.direct(&points, samples, nothing).expect("light"));
            for (samples, (found, exact)) in [0, 32].iter().zip(direct.iter().zip(&exact)) {
                let [median, most, mean] = differences(found, exact);
                println!("{tracer:?} {samples} samples: median {median}, 90 % {most}, mean {mean}");
                assert!(median < bounds[0] && most < bounds[1], "{median} {most}");
                assert!(mean.abs() < bounds[2], "{mean}");
            }
            let reflected = gpu.reflected(&points, lit, 256, nothing).expect("light");
            let [median, most, mean] = differences(&reflected, &bounced);
            println!("{tracer:?} reflected: median {median}, 90 % {most}, mean {mean}");
            assert!(median < 0.03 && most < 0.1 && mean.abs() < 0.02);
            let found = gpu.nearness(&on_surfaces, &around, nothing).expect("rays");
            let mut apart: Vec<f32> = (found.iter().zip(&near))
                .map(|(found, exact)| (found - exact).abs())
                .collect();
            apart.sort_by(f32::total_cmp);
            let [most, last] =
                [0.98, 1.0].map(|part| apart[((apart.len() - 1) as f32 * part) as usize]);
            println!("{tracer:?} nearness: 98 % {most}, all {last}");
            // a step of a byte; inside of models, and where backs lie in one plane, the GPU's rays pass what stops the CPU's
            assert!(most < 1.0 / 255.0 && last < bounds[3], "{most} {last}");
            let messages = on.validation_messages();
            assert!(messages.is_empty(), "{messages:#?}");
            let [few, some] = direct;
            let all = [few, some, reflected];
            let same = first.get_or_insert_with(|| all.clone());
            for (found, exact) in all.iter().zip(same) {
                let [median, most, mean] = differences(found, exact);
                println!("{tracer:?} and the first: median {median}, 90 % {most}, mean {mean}");
                assert!(median < 1e-4 && most < 0.01 && mean.abs() < 2e-3);
            }
        }
    }
}

/// Points of a map's light grid in open leafs. Some lie in the plane of a surface.
fn grid_points(world: &RelitWorld, step: usize) -> Vec<Point> {
    let layout = world.bsp.light_grid_layout(1 << 23).expect("a grid");
    let [nx, ny, _] = layout.counts;
    let all = (0..layout.points()).step_by(step);
    all.map(|i| layout.position(i % nx, i / nx % ny, i / nx / ny))
        .filter(|at| world.bsp.cluster_at(*at) >= 0)
        .map(|position| Point::new(position, Vec3::ZERO))
        .collect()
}

#[test]
fn points_of_the_light_grid_have_the_light_that_the_cpu_finds() {
    let Some(files) = openarena() else {
        return;
    };
    let files: Arc<dyn GameFiles> = Arc::new(files);
    let world = load(&*files, "maps/kaos2.bsp");
    let points = grid_points(&world, 5);
    let made = device(TracerChoice::Compute, false);
    let Some(on) = testkit::device(made.map_err(|e| e.to_string())) else {
        return;
    };
    let mut gpu = gather(&on, &files, &world);
    let mut cpu = Rays::new(&world);
    let nothing = &mut |_| {};
    for samples in [0, 8] {
        let found = gpu.direct(&points, samples, nothing).expect("light");
        let exact = cpu.direct(&points, samples, nothing).expect("light");
        let [median, most, mean] = differences(&found, &exact);
        println!("{samples} samples: median {median}, 90 % {most}, mean {mean}");
        assert!(median < 0.005 && most < 0.06 && mean.abs() < 0.02);
    }
}

#[test]
fn curves_without_shadows_are_passed_and_reflect() {
    let Some(files) = openarena() else {
        return;
    };
    let files: Arc<dyn GameFiles> = Arc::new(files);
    let mut world = load(&*files, "maps/kaos2.bsp");
    let points = points(&world, 600);
    let count = world.indices.len() / 3;
    let lit = LitSurfaces {
        triangles: &vec![LitTriangle::Vertices([0; 3]); count],
        reflectances: &vec![Vec3::splat(0.5); count],
        light: &[Vec3::ONE],
    };
    let made = device(TracerChoice::Compute, false);
    let Some(on) = testkit::device(made.map_err(|e| e.to_string())) else {
        return;
    };
    let nothing = &mut |_| {};
    let shadowed = Rays::new(&world)
        .direct(&points, 0, nothing)
        .expect("light");
    world.shadowless_curves = true;
    let mut gpu = gather(&on, &files, &world);
    let mut cpu = Rays::new(&world);
    let exact = cpu.direct(&points, 0, nothing).expect("light");
    let found = gpu.direct(&points, 0, nothing).expect("light");
    let brighter = exact
        .iter()
        .zip(&shadowed)
        .filter(|(light, before)| light.value.y > before.value.y * 1.1);
    let brighter = brighter.count();
    let [median, most, mean] = differences(&found, &exact);
    println!("{brighter} brighter; median {median}, 90 % {most}, mean {mean}");
    assert!(brighter > 10, "{brighter}");
    assert!(median < 0.003 && most < 0.04 && mean.abs() < 0.01);
    let exact = cpu.reflected(&points, lit, 256, nothing).expect("light");
    let found = gpu.reflected(&points, lit, 256, nothing).expect("light");
    let [median, most, mean] = differences(&found, &exact);
    println!("reflected: median {median}, 90 % {most}, mean {mean}");
    assert!(median < 0.03 && most < 0.1 && mean.abs() < 0.02);
}
