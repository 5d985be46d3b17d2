//! Where rays meet what lies in one plane with something else: posters, decals and paint on walls.
//!
//! A ray meets both at the same distance, and which of them it is told of is left to the last bits. So for rays the upper
//! one, by the engine's order, lies a little before the lower one. What is shaded stays where it is: a hit's point is that
//! of the map's own vertices.

use glam::Vec3;
use relight::world::coplanar::{DrawOrder, Sheet, stack};
use shaders::types::constants as c;
use shaderscript::Cull;

use super::input::{Kind, MaterialTable, StaticScene, StaticSurface};

/// How far the uppermost of several surfaces in one plane lies before the lowest, units. Far above what rounding costs
/// (0.001 where coordinates are 4096), and below the 0.02 that rays start away from their surface (`offset_ray`) and
/// that shadow rays end before their light: no ray meets what it leaves.
pub const LIFT: f32 = 1.0 / 128.0;

/// The positions of a map's vertices as rays meet them. Translucent layers are left where they are: rays order them by
/// themselves.
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

/// The triangles of a surface: their vertices' numbers and places.
fn triangles<'a>(
    scene: &'a StaticScene<'_>,
    surface: &StaticSurface,
) -> impl Iterator<Item = ([u32; 3], [Vec3; 3])> + 'a {
    scene.triangles(surface).iter().filter_map(|&numbers| {
        let place = |i: u32| scene.vertices.get(i as usize).map(|v| v.position);
        let [Some(a), Some(b), Some(c)] = numbers.map(place) else {
            return None;
        };
        Some((numbers, [a, b, c]))
    })
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
