//! Offsets for coplanar surfaces: posters, decals and paint on walls.
//!
//! A ray meets coplanar surfaces at the same distance, and rounding decides which one it reports. In acceleration
//! structures the upper surface, by the engine's order, is therefore moved slightly forward. Shading is unaffected: hit
//! points are computed from the map's own vertices.

use glam::Vec3;
use relight::world::coplanar::{DrawOrder, Sheet, stack};
use shaders::types::constants as c;
use shaderscript::Cull;
use support::slice;

use super::input::{Kind, MaterialTable, StaticScene, StaticSurface};

/// Distance of the uppermost of several coplanar surfaces from the lowest, units. Far above rounding errors (0.001 at
/// coordinates of 4096), and below the 0.02 by which rays start away from their surface (`offset_ray`) and shadow rays
/// end before their light, so that no ray hits the surface that it leaves.
pub const LIFT: f32 = 1.0 / 128.0;

/// Positions of a map's vertices for acceleration structures. Translucent layers keep theirs: shaders sort them.
pub fn lifted(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> Vec<Vec3> {
    let mut positions: Vec<Vec3> = scene.vertices.iter().map(|v| v.position).collect();
    let sheets: Vec<Sheet> = (scene.surfaces.iter())
        .map(|surface| sheet(scene, materials, surface))
        .collect();
    for (stacked, surface) in stack(&sheets).into_iter().zip(&scene.surfaces) {
        if stacked.below == 0 {
            continue;
        }
        let lift = LIFT * stacked.share();
        for (vertex, direction) in stacked.directions(triangles(scene, surface)) {
            if let Some(position) = positions.get_mut(vertex as usize) {
                *position += direction * lift;
            }
        }
    }
    positions
}

/// The triangles of a surface: vertex numbers and positions.
fn triangles<'a>(
    scene: &'a StaticScene<'_>,
    surface: &StaticSurface,
) -> impl Iterator<Item = ([u32; 3], [Vec3; 3])> + 'a {
    let place = |i: u32| slice::item(scene.vertices, i as usize).position;
    let triangles = scene.triangles(surface).iter();
    triangles.map(move |&numbers| (numbers, numbers.map(place)))
}

fn sheet(scene: &StaticScene<'_>, materials: &dyn MaterialTable, surface: &StaticSurface) -> Sheet {
    let (_, info) = materials.info(surface.material);
    let solid = matches!(Kind::of(info.flags), Some(Kind::Opaque | Kind::Tested));
    let of_solid = solid.then(|| triangles(scene, surface));
    Sheet {
        model: surface.model,
        cull: if info.flags & c::MATERIAL_TWO_SIDED != 0 {
            Cull::None
        } else if info.flags & c::MATERIAL_CULL_BACK != 0 {
            Cull::Back
        } else {
            Cull::Front
        },
        order: DrawOrder {
            offset: info.flags & c::MATERIAL_POLYGON_OFFSET != 0,
            sort: info.sort,
            material: info.order,
        },
        triangles: (of_solid.into_iter().flatten())
            .map(|(_, corners)| corners)
            .collect(),
    }
}
