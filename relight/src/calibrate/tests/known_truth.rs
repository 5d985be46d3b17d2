//! A hall whose lights and reflectances are known, baked by a reference integrator that shares no code with
//! calibration.

use super::*;
use std::f32::consts::TAU;

const ALBEDO: f32 = 0.5;
/// Part of the ceiling, a little below it, is sky.
const SKY_HEIGHT: f32 = 250.0;
const SKY_END: f32 = -60.0;
const AMBIENT: f32 = 3.0 * 4.0 / 255.0;
const SUN: Vec3 = Vec3::new(1.6, 1.4, 1.1);
/// Strength of the lamp over that of its directive.
const FACTOR: f32 = 0.4;

fn sun_direction() -> Vec3 {
    // Low enough for the pillar's shadow to fall on the floor.
    Vec3::new(-0.6, 0.3, 0.7).normalize()
}

/// Where a ray from inside meets the hall or the pillar: the place and the normal there; `None` where it meets sky.
fn cast(from: Vec3, ray: Vec3) -> Option<(Vec3, Vec3)> {
    let slabs = |box_: [Vec3; 2]| {
        let inverse = ray.recip();
        let (a, b) = ((box_[0] - from) * inverse, (box_[1] - from) * inverse);
        (a.min(b), a.max(b))
    };
    let side = |t: Vec3, entry: f32, sign: f32| {
        let axis = (0..3).find(|&k| t[k] == entry).unwrap();
        let mut normal = Vec3::ZERO;
        normal[axis] = sign * ray[axis].signum();
        normal
    };
    let (near, far) = slabs(PILLAR);
    let (enter, leave) = (near.max_element(), far.min_element());
    let sky = (SKY_HEIGHT - from.z) / ray.z;
    let meets_sky = sky > 0.0 && (from + ray * sky).x < SKY_END;
    let (_, out) = slabs(ROOM);
    let end = out.min_element();
    if enter > 1e-3 && enter < leave && enter < end && !(meets_sky && sky < enter) {
        return Some((from + ray * enter, side(near, enter, -1.0)));
    }
    if meets_sky && sky < end {
        return None;
    }
    Some((from + ray * end, side(out, end, -1.0)))
}

/// Light that comes straight from the hidden lights, the lamp and the sun.
fn direct(at: Vec3, normal: Vec3) -> Vec3 {
    if at.z > SKY_HEIGHT && at.x < SKY_END {
        return Vec3::ZERO;
    }
    let mut light = from_hidden(at, normal);
    let [a, b, _, d] = LAMP_CORNERS;
    let mut lamp = 0.0;
    for i in 0..16 {
        let (u, v) = ((i % 4) as f32 + 0.5, (i / 4) as f32 + 0.5);
        let origin = a + (b - a) * (u / 4.0) + (d - a) * (v / 4.0);
        let offset = origin - at;
        if offset.z > 0.0 && !in_pillar(at, origin) {
            lamp += normal.dot(offset).max(0.0) * offset.z / offset.length_squared().powi(2);
        }
    }
    light += Vec3::splat(lamp * FACTOR * LAMP * SURFACE_LIGHT_RADIANCE * 2400.0 / 16.0 / PI);
    let cosine = normal.dot(sun_direction());
    if cosine > 0.0 && cast(at, sun_direction()).is_none() {
        light += SUN * (cosine / PI);
    }
    light
}

/// Light thrown there by the walls, once.
fn bounced(at: Vec3, normal: Vec3) -> Vec3 {
    let (u, v) = normal.any_orthonormal_pair();
    let mut sum = Vec3::ZERO;
    for i in 0..100 {
        let (x, y) = (
            ((i % 10) as f32 + 0.5) / 10.0,
            ((i / 10) as f32 + 0.5) / 10.0,
        );
        let (sin, cos) = ((x + y * 0.618) * TAU).sin_cos();
        let ray = (u * cos + v * sin) * y.sqrt() + normal * (1.0 - y).sqrt();
        if let Some((hit, normal)) = cast(at, ray) {
            sum += direct(hit + normal * 0.1, normal);
        }
    }
    sum * (ALBEDO / 100.0)
}

/// What the compiler stores: all light, clamped so that the hue stays.
fn stored(at: Vec3, normal: Vec3, bounced: Vec3) -> Vec3 {
    let light = direct(at, normal) + bounced + AMBIENT;
    light / (light.max_element() / 4.0).max(1.0)
}

#[test]
fn all_sources_of_a_known_hall_are_found() {
    assert_all_sources_found(LightColor::Stored);
}

#[test]
fn all_sources_of_a_known_hall_are_found_in_engine_colours() {
    assert_all_sources_found(LightColor::Displayed);
}

/// Calibrates the hall and compares all light sources with the known ones.
fn assert_all_sources_found(light_color: LightColor) {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    let mut faces = map.add_box_faces(wall, ROOM[0], ROOM[1], true).to_vec();
    faces.extend(map.add_box_faces(wall, PILLAR[0], PILLAR[1], false));
    map.add_cell(ROOM[0], ROOM[1]);
    let lamp = map.add_shader("t/lamp", 0, 1);
    map.add_quad(lamp, LAMP_CORNERS);
    let sky = map.add_shader("t/sky", q3bsp::surface_flags::SKY, 1);
    // Clockwise seen from below.
    let (x, y) = ((ROOM[0].x, SKY_END), (ROOM[0].y, ROOM[1].y));
    let at = |x, y| Vec3::new(x, y, SKY_HEIGHT);
    map.add_quad(
        sky,
        [at(x.0, y.0), at(x.1, y.0), at(x.1, y.1), at(x.0, y.1)],
    );
    for face in faces {
        let corners = map.vertices_mut(face).to_vec();
        let (a, b, d) = (corners[0], corners[1], corners[3]);
        let place = |u: f32, v: f32| {
            a.position
                + (b.position - a.position) * u
                + (d.position - a.position) * v
                + a.normal * 0.1
        };
        // Bounced light is smooth: known on a grid, and between its points by interpolation.
        let side = 9;
        let part = |k: usize| (k as f32 / (side - 1) as f32).clamp(0.004, 0.996);
        let grid: Vec<Vec3> = (0..side * side)
            .map(|k| bounced(place(part(k % side), part(k / side)), a.normal))
            .collect();
        let between = |u: f32, v: f32| {
            let (x, y) = (u * (side - 1) as f32, v * (side - 1) as f32);
            let (i, j) = ((x as usize).min(side - 2), (y as usize).min(side - 2));
            let (fx, fy) = (x - i as f32, y - j as f32);
            let row = |j: usize| grid[j * side + i].lerp(grid[j * side + i + 1], fx);
            row(j).lerp(row(j + 1), fy)
        };
        let size = q3bsp::LIGHTMAP_SIZE as f32;
        let page = map.add_lightmap_with(|x, y| {
            let at = (glam::Vec2::new(x as f32, y as f32) + 0.5) / size;
            let (e1, e2) = (b.lightmap - a.lightmap, d.lightmap - a.lightmap);
            let offset = at - a.lightmap;
            let determinant = e1.perp_dot(e2);
            let (u, v) = (
                offset.perp_dot(e2) / determinant,
                e1.perp_dot(offset) / determinant,
            );
            let light = stored(place(u, v), a.normal, between(u, v)) * 255.0 / 4.0;
            light.to_array().map(|c| c.round() as u8)
        });
        map.set_lightmap(face, page);
    }
    let mut world = relit_as(&map.build(), light_color);
    let exponent = world.color_exponent;
    assert_eq!(exponent > 1.02, light_color == LightColor::Displayed);
    let color = |light: Vec3| crate::light::raise(light, exponent);
    for material in world.materials.iter_mut().filter(|m| !m.is_sky()) {
        material.albedo = Vec3::splat(ALBEDO);
    }
    assert!(world.suns.is_empty() && world.point_lights.is_empty());
    let before = world.lights[0].radiance;
    let report = calibrate(&mut world, &small());
    println!("{report:?}");
    println!("ambient {} suns {:?}", world.ambient, world.suns);
    assert!(report.after.median_stops < 0.08, "{report:?}");

    let factor = world.lights.iter().find(|l| !l.is_sky).unwrap().radiance / before;
    println!("lamp {factor}");
    // Where lights of different colours meet, raised light is not their sum: the lamp, which lies widest, takes that up.
    let off = match light_color {
        LightColor::Stored => 0.15,
        LightColor::Displayed => 0.25,
    };
    assert!(
        (factor / FACTOR - 1.0).abs().max_element() < off,
        "{factor}"
    );
    let [sun] = world.suns[..] else {
        panic!("{:?}", world.suns)
    };
    let angle = sun.direction.angle_between(sun_direction()).to_degrees();
    println!("sun {angle} degrees off");
    assert!(angle < 2.0, "{angle}");
    assert!(
        (sun.irradiance / color(SUN) - 1.0).abs().max_element() < 0.15,
        "{sun:?}"
    );
    assert!(
        (world.ambient - AMBIENT).abs().max_element() < 0.4 * AMBIENT,
        "{}",
        world.ambient
    );
    // The sky itself gives no light: what calibration gives it must not matter beside the sun.
    let sky: f32 = world
        .lights
        .iter()
        .filter(|l| l.is_sky)
        .map(|l| l.radiance.max_element())
        .fold(0.0, f32::max);
    println!("sky {sky}");
    assert!(sky * PI < 0.05 * SUN.x, "{sky}");

    let hidden: Vec<PointLight> = HIDDEN
        .iter()
        .map(|&(origin, intensity)| PointLight {
            origin,
            intensity: color(intensity),
            radius: 4.0,
            spot: None,
            falloff: crate::light::Falloff::InverseSquare,
            pulse: None,
        })
        .collect();
    let found = recovery(&hidden, &world);
    println!("{found:?} {:?}", world.point_lights);
    assert_eq!((found.found, found.found_well), (3, 3), "{found:?}");
    assert!(found.power_invented < 0.03, "{found:?}");
    assert!((found.power_ratio - 1.0).abs() < 0.1, "{found:?}");
}
