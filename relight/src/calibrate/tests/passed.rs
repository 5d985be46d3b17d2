//! Surfaces that are drawn but pass light.

use super::*;
use crate::occluders::Occluders;

#[test]
fn shadow_rays_pass_surfaces_that_the_compiler_let_light_pass() {
    let corners = LAMP_CORNERS;
    let [above, below] = [260.0, 100.0].map(|z| Vec3::new(200.0, 0.0, z) - Vec3::Y * 3.0);
    for (material, stops) in [
        ("t/shell", false),
        ("t/inverted", false),
        ("t/shellsides", true),
        ("t/shellshadow", true),
        ("t/shellfilter", true),
        ("t/hull", true),
    ] {
        let mut map = room_map("t/wall", false, usize::MAX, None);
        let shell = map.add_shader(material, 0, 0);
        map.add_quad(shell, corners);
        let mut world = relit(&map.build());
        // the room's ceiling lies below the upper end
        world.surfaces.retain(|s| s.material != 0);
        let occluders = Occluders::of_world(&world);
        for (from, to) in [(above, below), (below, above)] {
            let stopped = occluders.blocked(from, to, false);
            assert_eq!(stopped, stops, "{material} from {from}");
        }
    }
}
