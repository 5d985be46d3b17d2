//! Fog volumes: the brush of a fog as a box and the plane one looks into it through.

use crate::{Bsp, Plane};
use glam::Vec3;

/// Farthest coordinate of a map, id units.
const WORLD_EXTENT: f32 = 131_072.0;

/// A fog volume, in the order of [`Bsp::fogs`], so that [`crate::Surface::fog`] indexes it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FogVolume {
    /// Smallest corner, id units.
    pub mins: Vec3,
    /// Largest corner.
    pub maxs: Vec3,
    /// The plane of the visible side, negated, so that [`Plane::distance`] is the depth of a point
    /// below the fog's surface. `None`: the viewer always counts as inside.
    pub surface: Option<Plane>,
    /// Shader whose `fogParms` give colour and depth.
    pub shader: String,
}

impl FogVolume {
    /// Whether it fills the world, because the map names no brush for it.
    pub fn fills_world(&self) -> bool {
        self.mins == Vec3::splat(-WORLD_EXTENT) && self.maxs == Vec3::splat(WORLD_EXTENT)
    }
}

impl Bsp {
    /// The fog volumes. A fog without a brush fills the world. Bounds come from the first six sides of the brush, which compilers write as
    /// -x +x -y +y -z +z; numbers that are not finite become 0.
    pub fn fog_volumes(&self) -> Vec<FogVolume> {
        self.fogs
            .iter()
            .map(|fog| {
                let Some(brush) = fog.brush_id() else {
                    return FogVolume {
                        mins: Vec3::splat(-WORLD_EXTENT),
                        maxs: Vec3::splat(WORLD_EXTENT),
                        surface: None,
                        shader: fog.shader.clone(),
                    };
                };
                let sides = self.sides_of(self.brush(brush));
                let plane = |side: usize| -> Option<Plane> {
                    let plane = self.plane(sides.get(side)?.plane);
                    let clean = |v: f32| if v.is_finite() { v } else { 0.0 };
                    Some(Plane {
                        normal: plane.normal.map(clean),
                        dist: clean(plane.dist),
                    })
                };
                // The brush of a fog has at least six sides.
                let dist = |side: usize| plane(side).map_or(0.0, |plane| plane.dist);
                FogVolume {
                    mins: Vec3::new(-dist(0), -dist(2), -dist(4)),
                    maxs: Vec3::new(dist(1), dist(3), dist(5)),
                    surface: usize::try_from(fog.visible_side)
                        .ok()
                        .and_then(plane)
                        .map(|plane| Plane {
                            normal: -plane.normal,
                            dist: -plane.dist,
                        }),
                    shader: fog.shader.clone(),
                }
            })
            .collect()
    }
}
