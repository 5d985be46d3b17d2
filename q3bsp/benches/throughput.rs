//! MB/s of reading, tessellating and writing a map: `cargo bench -p q3bsp [-- FILE.bsp]`.
//!
//! Without a file a made-up map of some 20 MB is taken.

use q3bsp::builder::MapBuilder;
use q3bsp::glam::{Vec2, Vec3};
use q3bsp::{Bsp, DrawVert, content_flags};
use testkit::bench::{input, measure};

/// 200 rooms with boxes, arches and entities, and eight lightmap pages.
fn made_up() -> Vec<u8> {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("textures/wall", 0, content_flags::SOLID);
    for room in 0..200u16 {
        let corner = Vec3::new(f32::from(room) * 128.0, 0.0, 0.0);
        map.add_room(wall, corner, corner + 128.0);
        for box_ in 0..50u16 {
            let at = corner + Vec3::splat(f32::from(box_) * 2.0);
            map.add_box_faces(wall, at, at + 1.0, false);
            map.add_box_brush(wall, at, at + 1.0);
            let origin = format!("{} {} {}", at.x, at.y, at.z);
            map.add_entity(&[("classname", "item_health"), ("origin", &origin)]);
        }
        let arch: Vec<DrawVert> = (0..9u8)
            .map(|point| {
                let (x, y) = (f32::from(point % 3), f32::from(point / 3));
                let z = if x == 1.0 { 60.0 } else { 0.0 };
                DrawVert {
                    position: corner + Vec3::new(x * 40.0, y * 40.0, z),
                    st: Vec2::new(x, y),
                    lightmap: Vec2::ZERO,
                    normal: Vec3::Z,
                    color: [255; 4],
                }
            })
            .collect();
        map.add_patch(wall, 3, 3, &arch);
    }
    for page in 0..8 {
        map.add_lightmap([page, 20, 30]);
    }
    map.build().write()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bytes = input(made_up)?;
    let bsp = Bsp::parse(&bytes)?;
    println!("{}, {:.2} MB", bsp.format, bytes.len() as f64 / 1e6);
    measure("parse", bytes.len(), || Bsp::parse(&bytes));
    measure("entities", bsp.entities.len(), || bsp.entities());
    measure("patches", bytes.len(), || bsp.patch_meshes(4.0));
    measure("write", bytes.len(), || bsp.write());
    Ok(())
}
