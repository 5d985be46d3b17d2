//! A map with something in every lump.
#![allow(dead_code, reason = "each test takes some of it")]

use glam::{Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{Advertisement, Bsp, DrawVert, GridPoint, content_flags};

pub fn vert(x: f32, y: f32, z: f32) -> DrawVert {
    DrawVert {
        position: Vec3::new(x, y, z),
        st: Vec2::new(x, y),
        lightmap: Vec2::ZERO,
        normal: Vec3::Z,
        color: [255; 4],
    }
}

pub fn advertisement() -> Advertisement {
    Advertisement {
        cell: 5,
        normal: Vec3::Z,
        corners: [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE],
        model: [b'*'; 64],
    }
}

/// A map with something in every lump.
pub fn sample() -> Bsp {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("textures/wall", 0, content_flags::SOLID);
    let fog = map.add_shader("textures/fog", 0, content_flags::FOG);
    let one = map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let two = map.add_room(
        wall,
        Vec3::new(128.0, -64.0, -64.0),
        Vec3::new(256.0, 64.0, 64.0),
    );
    map.set_sees(one, two, false);
    let arch: Vec<DrawVert> = (0..9)
        .map(|at| {
            let (x, y) = ((at % 3) as f32, (at / 3) as f32);
            vert(x * 40.0, y * 40.0, if x == 1.0 { 60.0 } else { 0.0 })
        })
        .collect();
    map.add_patch(wall, 3, 3, &arch);
    map.add_soup(
        wall,
        &[
            vert(0.0, 0.0, 0.0),
            vert(0.0, 9.0, 0.0),
            vert(9.0, 0.0, 0.0),
        ],
        &[0, 1, 2],
    );
    map.add_flare(wall, Vec3::ZERO, Vec3::Z, Vec3::ONE);
    map.add_box_brush(wall, Vec3::splat(-130.0), Vec3::splat(-128.0));
    let volume = map.add_fog_brush(fog, Vec3::splat(-128.0), Vec3::splat(0.0), 5);
    let page = map.add_lightmap([10, 20, 30]);
    map.set_lightmap(0, page);
    map.set_fog(1, volume);
    let model = map.begin_model();
    map.add_box_faces(wall, Vec3::splat(-8.0), Vec3::splat(8.0), false);
    map.add_entity(&[("classname", "func_door"), ("model", &format!("*{model}"))]);
    map.build_with_grid(Vec3::new(64.0, 64.0, 128.0), |_| GridPoint {
        ambient: [10; 3],
        directed: [20; 3],
        longitude: 30,
        latitude: 40,
    })
}
