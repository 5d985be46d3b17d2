//! What casts shadows, and what reflects light all the same.

use super::tests::{room, world};
use super::*;
use glam::Vec2;
use q3bsp::DrawVert;

/// A flat curve below a lamp: height, corners, and where the lamp is.
const HEIGHT: f32 = 40.0;
const CORNERS: [[f32; 2]; 2] = [[0.0, -80.0], [80.0, 20.0]];
const LAMP: Vec3 = Vec3::new(40.0, -30.0, 120.0);

/// A room with the lamp and the curve, which is seen from below.
fn room_with_a_curve() -> RelitWorld {
    let lamp: [(&str, &str); 3] = [
        ("classname", "light"),
        ("origin", "40 -30 120"),
        ("light", "300"),
    ];
    let bsp = room(&[&lamp], |map| {
        let wall = map.add_shader("t/wall", 0, 1);
        let [low, high] = CORNERS;
        let at = |from: f32, to: f32, k: u8| from + (to - from) * f32::from(k) / 2.0;
        let point = |k: u8| DrawVert {
            position: Vec3::new(
                at(low[0], high[0], k / 3),
                at(low[1], high[1], k % 3),
                HEIGHT,
            ),
            normal: Vec3::NEG_Z,
            st: Vec2::ZERO,
            lightmap: Vec2::ZERO,
            color: [255; 4],
        };
        map.add_patch(wall, 3, 3, &(0..9).map(point).collect::<Vec<_>>());
    });
    world(&bsp)
}

/// Points above the floor, and whether the curve hides the lamp from them. None is near the edge of the shadow.
fn floor_points() -> Vec<(Point, bool)> {
    let places = (-15..15).flat_map(|y| (-15..15).map(move |x| (x, y)));
    places
        .filter_map(|(x, y)| {
            let position = Vec3::new(x as f32 * 16.0 + 5.0, y as f32 * 16.0 + 5.0, 1.0);
            let part = (HEIGHT - position.z) / (LAMP.z - position.z);
            let across = position.lerp(LAMP, part).truncate();
            let [low, high] = CORNERS.map(Vec2::from);
            let depth = (across - low).min(high - across).min_element();
            let normal = Vec3::Z;
            (depth.abs() > 0.5).then_some((Point::new(position, normal), depth > 0.0))
        })
        .collect()
}

#[test]
fn curves_cast_no_shadow_of_a_compilers_lights_but_reflect() {
    let mut world = room_with_a_curve();
    let (points, hidden): (Vec<Point>, Vec<bool>) = floor_points().into_iter().unzip();
    let is_curve = |triangle: usize| {
        let curves = world.surfaces.iter();
        let mut curves = curves.filter(|s| s.kind == q3bsp::SurfaceKind::Patch);
        curves.any(|curve| curve.triangles().contains(&triangle))
    };
    let count = world.indices.len() / 3;
    let triangles: Vec<LitTriangle> = (0..count)
        .map(|triangle| match is_curve(triangle) {
            true => LitTriangle::Vertices([0; 3]),
            false => LitTriangle::Dark,
        })
        .collect();
    let lit = LitSurfaces {
        triangles: &triangles,
        reflectances: &vec![Vec3::ONE; count],
        light: &[Vec3::ONE],
    };
    let mut found = Vec::new();
    for shadowless in [false, true] {
        world.shadowless_curves = shadowless;
        let mut rays = Rays::new(&world);
        let direct = rays.direct(&points, 0, &mut |_| ()).unwrap();
        for ((point, hidden), light) in points.iter().zip(&hidden).zip(direct) {
            let is_lit = light.value.x > 0.0;
            assert_eq!(is_lit, shadowless || !hidden, "{}", point.position);
        }
        found.push(rays.reflected(&points, lit, 64, &mut |_| ()).unwrap());
    }
    assert!(hidden.iter().filter(|hidden| **hidden).count() > 50);
    assert_eq!(found[0], found[1]);
    let brightest = found[0].iter().map(|light| light.value.x);
    assert!(brightest.fold(0.0, f32::max) > 0.2);
}
