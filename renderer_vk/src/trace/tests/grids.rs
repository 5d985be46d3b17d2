//! Grids show what hierarchies show.

use glam::{Mat3, Vec3};
use shaders::types::Instance;
use shaders::types::constants as c;
use testkit::Random;

use super::cut_outs::stripes;
use super::harness::{Gpu, Scene, bounced, floor_at, identity, rectangle, reference, stage};
use crate::settings::Settings;
use crate::trace::tracer::Tracer;

/// Renders scenes with hierarchies and with grids of these numbers of cells, and compares the pictures. Rays that graze
/// an edge may hit or miss it; `most` pixels may differ.
fn compare(make: impl Fn(&Gpu) -> Scene, settings: &Settings, cells: &[u32], most: usize) {
    let (Some(mut compute), Some(mut grid)) = (Gpu::new(Tracer::Compute), Gpu::new(Tracer::Grid))
    else {
        return;
    };
    let expected = compute.render(&make(&compute), settings, 2).0;
    let lit = expected.iter().filter(|p| p.max_element() > 0.01).count();
    assert!(lit > expected.len() / 4, "{lit} pixels are lit");
    for &cells in cells {
        let mut scene = make(&grid);
        scene.grid_cells = cells;
        let uploaded = scene.upload(&grid.device, grid.tracer);
        let found = uploaded.geometry.cost.cells.expect("a grid");
        assert!(cells == 0 || found.into_iter().max() == Some(cells));
        let pixels = grid.render(&scene, settings, 2).0;
        let pairs = expected.iter().zip(&pixels);
        let differing = pairs
            .filter(|(a, b)| (**a - **b).abs().max_element() > 0.01 * a.max_element().max(0.1))
            .count();
        println!("{found:?} cells: {differing} of {} differ", pixels.len());
        assert!(differing <= most, "{cells}: {differing}");
    }
}

/// A room with squares at all angles, some in planes of constant coordinates, cut-outs, layers, a brush model that has
/// moved, and moving squares.
fn full_room(gpu: &Gpu) -> Scene {
    let camera = Vec3::new(-180.0, 10.0, 40.0);
    let mut scene = Scene::new(camera, Vec3::new(50.0, 0.0, -10.0), 80.0, 64);
    let image = stripes(gpu, [[255; 4], [255, 255, 255, 0]]);
    scene.images.push(image.texture_index());
    let grey = scene.diffuse(0.6);
    let mut holes = stage::image(0);
    holes.alpha_func = c::ALPHAFUNC_GE128;
    let grate = scene.material(&[holes], c::MATERIAL_CUT_OUT | c::MATERIAL_TWO_SIDED);
    let veil = [stage::blend([0.2, 0.1, 1.0], 0.4)];
    let veil = scene.material(&veil, c::MATERIAL_TRANSLUCENT | c::MATERIAL_TWO_SIDED);
    let (low, high) = (
        Vec3::new(-200.0, -150.0, -80.0),
        Vec3::new(200.0, 150.0, 120.0),
    );
    scene.room(low, high, grey);
    let mut random = Random::new(5);
    let size = high - low;
    for number in 0..150 {
        let at =
            low + size * Vec3::from_array(std::array::from_fn(|_| 0.1 + 0.8 * random.uniform()));
        if at.distance(camera) < 50.0 {
            continue;
        }
        let turn = match number % 2 {
            0 => Mat3::IDENTITY,
            _ => Mat3::from_rotation_y(number as f32) * Mat3::from_rotation_z(0.7 * number as f32),
        };
        let (at, axis) = (at.round(), number / 2 % 3);
        let square = rectangle(at, turn.col(axis) * 20.0, turn.col((axis + 1) % 3) * 20.0);
        if number % 5 == 4 {
            let turn = Mat3::from_rotation_x(number as f32) * (0.5 + 0.01 * number as f32);
            let instance = Instance {
                axis: [turn.x_axis, turn.y_axis, turn.z_axis],
                origin: at,
                ..identity()
            };
            let square = rectangle(Vec3::splat(-10.0), Vec3::X * 20.0, Vec3::Y * 20.0);
            scene.mesh(square, if number % 3 == 0 { veil } else { grey }, instance);
        } else {
            let material = [grey, grate, grey, veil][number % 4];
            scene.quad(square, material);
        }
    }
    // no area
    scene.quad([low; 4], grey);
    scene.quad(rectangle(low, size, size), grey);
    let first = scene.surfaces.len();
    scene.quad(floor_at(0.0, 30.0), grey);
    scene.surfaces[first].model = 1;
    scene.instances.push(Instance {
        origin: Vec3::new(-60.0, 40.0, 20.0),
        ..identity()
    });
    scene.submodels.push(crate::scene::Submodel {
        model: 1,
        instance: scene.instances.len() as u32 - 1,
    });
    scene.lamp(Vec3::new(0.0, 60.0, 110.0), 60.0, Vec3::splat(12.0));
    scene
}

#[test]
fn grids_show_what_hierarchies_show() {
    compare(full_room, &bounced(1), &[0, 1, 16, 61, 256], 8);
}

#[test]
fn a_map_that_fits_no_grid_has_a_hierarchy() {
    let Some(mut gpu) = Gpu::new(Tracer::Grid) else {
        return;
    };
    let mut scene = Scene::hall(20.0, 0.5, 32);
    scene.sun(Vec3::new(0.0, 0.6, 0.8), 3.0, 0.01);
    scene.lamp(Vec3::new(0.0, 60.0, 110.0), 60.0, Vec3::splat(12.0));
    let picture = gpu.render(&scene, &reference(), 2).0;
    let far = Vec3::splat(2.0e7);
    scene.quad(rectangle(far, Vec3::X * 1.0e6, Vec3::Y * 1.0e6), 0);
    let cost = scene.upload(&gpu.device, gpu.tracer).geometry.cost;
    assert_eq!(cost.cells, None);
    assert_eq!(gpu.render(&scene, &reference(), 2).0, picture);
}

#[test]
fn flat_maps_have_grids() {
    // all of the map in one plane, and the camera outside of the grid: rays along an axis, and across the plane
    let flat = |_: &Gpu| {
        let mut scene = Scene::new(Vec3::new(0.0, 0.0, 90.0), Vec3::ZERO, 70.0, 33);
        let grey = scene.diffuse(0.5);
        for number in 0..12 {
            let corner = Vec3::new(20.0 * (number % 4) as f32, 30.0 * (number / 4) as f32, 0.0);
            let corner = corner - Vec3::new(40.0, 45.0, 0.0);
            scene.quad(rectangle(corner, Vec3::X * 20.0, Vec3::Y * 30.0), grey);
        }
        scene.sun(Vec3::new(0.6, 0.0, 0.8), 3.0, 0.01);
        scene
    };
    compare(flat, &reference(), &[0, 5], 0);
}
