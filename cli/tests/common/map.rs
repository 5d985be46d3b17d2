//! A map of one room.

use glam::Vec3;
use q3bsp::Format;
use q3bsp::builder::MapBuilder;

/// A room without lights, as a file of a format.
pub fn map(format: Format) -> Vec<u8> {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("t/wall", 0, 1);
    map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
    let mut bsp = map.build();
    bsp.format = format;
    bsp.write()
}
