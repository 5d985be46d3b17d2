//! Coplanar surfaces.

use glam::Vec3;
use shaders::types::constants as c;

use super::cut_outs::stripes;
use super::harness::{Gpu, Scene, gpu_tests, mirror_at, rectangle, reference, stage, through_byte};
use super::layers::{TRANSLUCENT, close, over};

gpu_tests! {
    each: [
        posters_lie_before_their_wall_in_the_order_of_the_engine,
    ],
}

const OFFSET: u32 = c::MATERIAL_POLYGON_OFFSET;
const BACK: [f32; 3] = [0.2, 0.4, 0.8];
const RED: [f32; 3] = [0.9, 0.1, 0.1];
const GREEN: [f32; 3] = [0.1, 0.8, 0.2];

/// A square on the wall around a point; the wall is at x and faces the origin.
fn patch(x: f32, [y, z]: [f32; 2], half: f32) -> [Vec3; 4] {
    let corner = Vec3::new(x, y - half, z - half);
    let (up, aside) = (Vec3::Z * half * 2.0, Vec3::Y * half * 2.0);
    if x > 0.0 {
        rectangle(corner, up, aside)
    } else {
        rectangle(corner + aside, up, -aside)
    }
}

fn posters_lie_before_their_wall_in_the_order_of_the_engine(gpu: &mut Gpu) {
    let image = stripes(gpu, [[255; 4], [255, 255, 255, 0]]);
    for (mirrored, wall_first) in [(false, false), (false, true), (true, false), (true, true)] {
        // 200 units from the camera in both cases
        let x = if mirrored { -100.0 } else { 200.0 };
        let mut scene = Scene::new(Vec3::ZERO, Vec3::X, 40.0, 32);
        scene.images.push(image.texture_index());
        let wall = scene.material(&[stage::constant(BACK)], 0);
        let opaque = scene.material(&[stage::constant(GREEN)], OFFSET);
        let [under, above] =
            [RED, GREEN].map(|color| scene.material(&[stage::constant(color)], OFFSET));
        scene.materials[above as usize].1.sort = 4.0;
        scene.materials[under as usize].1.order = 90;
        let mut cut = stage::image(0);
        cut.alpha_func = c::ALPHAFUNC_GE128;
        let cut = scene.material(&[cut], OFFSET | c::MATERIAL_CUT_OUT);
        let blend = scene.material(&[stage::blend(RED, 0.5)], OFFSET | TRANSLUCENT);
        let mut quads = vec![
            (patch(x, [0.0, 0.0], 900.0), wall),
            (patch(x, [36.0, 36.0], 24.0), opaque),
            (patch(x, [-36.0, 36.0], 24.0), under),
            (patch(x, [-36.0, 36.0], 24.0), above),
            (patch(x, [36.0, -36.0], 24.0), cut),
            (patch(x, [-36.0, -36.0], 24.0), blend),
        ];
        if !wall_first {
            quads.reverse();
        }
        for (points, material) in quads {
            scene.quad(points, material);
        }
        if mirrored {
            let mirror = scene.material(&[stage::add([0.0; 3])], c::MATERIAL_PORTAL);
            scene.quad(patch(50.0, [0.0, 0.0], 900.0), mirror);
            scene.portals.push(mirror_at(50.0, Vec3::NEG_X));
        }
        let (pixels, _) = gpu.render(&scene, &reference(), 1);
        let linear = |color: [f32; 3]| Vec3::from(color.map(through_byte));
        let (green, back) = (linear(GREEN), linear(BACK));
        let mixed = over(&[(RED, 0.5)], BACK);
        // y points left, z up; s of the alpha-tested image runs along z
        for (row, column, exact) in [
            ([5, 10], [5, 10], green),
            ([5, 10], [21, 26], green),
            ([26, 27], [5, 10], Vec3::ONE),
            ([20, 21], [5, 10], back),
            ([21, 26], [21, 26], mixed),
            ([14, 17], [0, 31], back),
        ] {
            for (row, column) in
                (row[0]..=row[1]).flat_map(|r| (column[0]..=column[1]).map(move |c| (r, c)))
            {
                let pixel = pixels[row * 32 + column];
                assert!(
                    close(pixel, exact),
                    "mirrored {mirrored}, wall first {wall_first}, row {row}, column {column}: {pixel} {exact}"
                );
            }
        }
    }
}
