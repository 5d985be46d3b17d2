//! Colours of fitted lights against those that the engine shows.

use super::*;
use crate::overbright;

#[test]
fn an_orange_light_is_as_orange_as_the_engine_shows_it() {
    // `_color 255 128 0`: wherever it falls the engine shows green half as bright as red, encoded.
    let orange = |at: Vec3, normal: Vec3| {
        let from = Vec3::new(-150.0, 60.0, 150.0);
        if in_pillar(at, from) {
            return Vec3::ZERO;
        }
        let offset = from - at;
        let light = 60_000.0 * normal.dot(offset).max(0.0) / offset.length().powi(3) / PI;
        Vec3::new(light, light * 0.5, 0.0)
    };
    for (wall, texture) in [("t/wall", 1.0), ("t/grey", 0.6)] {
        let map = room_map(wall, false, usize::MAX, Some(&orange)).build();
        let mut world = relit_as(&map, LightColor::Displayed);
        world.measure_materials(&MemoryFiles::new());
        // The stored light has no bounces.
        for material in &mut world.materials {
            material.albedo = Vec3::ZERO;
        }
        let report = calibrate(&mut world, &small());
        assert!(report.after.median_stops < 0.05, "{report:?}");
        let total: Vec3 = world.point_lights.iter().map(|l| l.intensity).sum();
        for stored in [0.3, 0.5, 0.8] {
            let red = texture * stored;
            let green = overbright::to_linear(red) * total.y / total.x;
            let ratio = overbright::from_linear(green) / red;
            println!("{wall} {stored}: {ratio:.3}");
            assert!((ratio - 0.5).abs() < 0.07, "{wall} at {stored}: {ratio}");
        }
    }
}
