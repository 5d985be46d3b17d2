//! Surfaces of the world and of brush models: culling, order, dynamic lights.

use glam::{Vec3, Vec4};
use q3bsp::SurfaceKind;
use shaders::types::Instance;
use shaderscript::Cull;
use support::Aabb;
use support::slice;

use super::{ClassicPart, DrawSurface, DynamicMesh, Geometry, SkyCoverage, VisibleSky, entity};
use crate::api::DynamicLight;
use crate::assets::Materials;
use crate::world::{WorldData, WorldSurface, outside};

/// Entity number of the world, after those of all entities.
pub(super) const WORLD_ENTITY: u32 = 0xF_FFFF;
/// Number of dynamic lights: one for each bit of a surface's mask.
const MAX_LIGHT_BITS: usize = 32;
/// Distance of the camera behind a flat surface from which the surface is culled, units.
const BACK_FACE_SLACK: f32 = 8.0;

/// The engine's drawing order as a number: rank of the material, entity, fog, lit by a dynamic light.
///
/// 24, 20, 19 and 1 bits; larger values are clamped, so their order among each other is lost.
pub(super) fn sort_key(rank: u32, entity: u32, fog: u32, lit: bool) -> u64 {
    let field = |value: u32, bits: u32| u64::from(value.min((1 << bits) - 1));
    field(rank, 24) << 40 | field(entity, 20) << 20 | field(fog, 19) << 1 | u64::from(lit)
}

/// A dynamic light relative to a model.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalLight {
    /// Position, model space.
    pub local: Vec3,
    /// Position, world space.
    pub world: Vec3,
    /// Reach, units.
    pub radius: f32,
}

/// A view in the space of a model.
pub(super) struct LocalView<'a> {
    /// Camera position, model space.
    pub camera: Vec3,
    /// Planes of the frustum, facing inwards; empty without culling.
    pub frustum: &'a [Vec4],
    /// Dynamic lights.
    pub lights: &'a [LocalLight],
    /// Unit view direction.
    pub forward: Vec3,
    /// Culls flat surfaces by facing (`r_facePlaneCull`).
    pub by_facing: bool,
}

/// Mask of the lights that reach a box.
fn bits_at(lights: impl Iterator<Item = (Vec3, f32)>, bounds: &Aabb) -> u32 {
    lights
        .take(MAX_LIGHT_BITS)
        .enumerate()
        .filter(|(_, (origin, radius))| {
            let nearest = origin.clamp(bounds.mins, bounds.maxs.max(bounds.mins));
            // the engine tests the bounding box of a light
            (nearest - *origin).abs().max_element() <= *radius
        })
        .fold(0, |bits, (i, _)| bits | 1 << i)
}

/// Mask of the lights that reach a box in model space.
pub(super) fn lights_at(lights: &[LocalLight], bounds: &Aabb) -> u32 {
    bits_at(
        lights.iter().map(|light| (light.local, light.radius)),
        bounds,
    )
}

impl LocalView<'_> {
    /// Mask of the lights that reach a box.
    pub fn lights_at(&self, bounds: &Aabb) -> u32 {
        lights_at(self.lights, bounds)
    }

    /// Mask of the lights that reach a surface. The engine tests flat and curved surfaces of moved models with
    /// world-space lights, so it leaves some of them dark.
    fn lights_on(&self, surface: &WorldSurface) -> u32 {
        let mut bits = self.lights_at(&surface.bounds);
        if surface.kind == SurfaceKind::Patch {
            let in_world = self.lights.iter().map(|light| (light.world, light.radius));
            bits &= bits_at(in_world, &surface.bounds);
        } else if let Some(plane) = surface.plane.filter(|_| surface.flat) {
            for (i, light) in self.lights.iter().take(MAX_LIGHT_BITS).enumerate() {
                if plane.distance(light.world).abs() > light.radius {
                    bits &= !(1 << i);
                }
            }
        }
        bits
    }

    fn culls(&self, surface: &WorldSurface, cull: Cull) -> bool {
        if outside(&surface.bounds, self.frustum) {
            return true;
        }
        let Some(plane) = surface.plane.filter(|_| surface.flat && self.by_facing) else {
            return false;
        };
        let distance = plane.distance(self.camera);
        match cull {
            Cull::Front => distance < -BACK_FACE_SLACK,
            Cull::Back => distance > BACK_FACE_SLACK,
            Cull::None => false,
        }
    }
}

/// Parameters shared by the surfaces of one model.
pub(super) struct SurfaceRun<'a> {
    pub world: &'a WorldData,
    pub materials: &'a Materials,
    pub local: &'a LocalView<'a>,
    /// Camera position, world space.
    pub camera: Vec3,
    /// Index of the instance.
    pub instance: u32,
    /// The instance; its index is asserted.
    pub placed: Option<&'a Instance>,
    /// The engine's entity number.
    pub entity: u32,
    /// `r_lodCurveError`.
    pub curve_error: f32,
    /// `r_nocurves`.
    pub no_curves: bool,
    /// `r_fastsky`.
    pub no_sky: bool,
}

impl SurfaceRun<'_> {
    /// Adds a surface if it is not culled. Returns a surface whose vertices need deformation.
    pub fn add(&self, index: u32, out: &mut ClassicPart) -> Option<PendingDeform> {
        let surface = slice::get(&self.world.surfaces, index as usize)?;
        if surface.index_count == 0 || (self.no_curves && surface.kind == SurfaceKind::Patch) {
            return None;
        }
        let material = self.materials.resolve(surface.material);
        let drawn = self.materials.get(material);
        // deformed vertices may leave the bounds
        let deforms = drawn.deforms();
        if !deforms && self.local.culls(surface, drawn.cull) {
            return None;
        }
        let (first_index, index_count) = match &surface.lod {
            Some(lod) => {
                let depth = self.local.forward.dot(lod.origin() - self.local.camera);
                lod.choose(depth, self.curve_error)
            }
            // the copy has vertices of its own; `add_deformed` takes them in place of the surface's
            None if deforms => (surface.first_index, surface.index_count),
            None => {
                let copy = surface.classic.map(|copy| copy.first_index);
                (copy.unwrap_or(surface.first_index), surface.index_count)
            }
        };
        if drawn.is_sky() {
            if !self.no_sky {
                self.add_sky((material, surface.fog), first_index, index_count, out);
            }
            return None;
        }
        let dlights = self.local.lights_on(surface);
        let rank = self.materials.rank(surface.material);
        let sort_key = sort_key(rank, self.entity, surface.fog, dlights != 0);
        if deforms {
            return Some(PendingDeform {
                surface: index,
                first_index,
                index_count,
                material,
                sort_key,
                dlights,
            });
        }
        out.surfaces.push(DrawSurface {
            sort_key,
            material,
            instance: self.instance,
            fog: surface.fog,
            lightmap: surface.lightmap,
            dlights,
            geometry: Geometry::Static {
                first_index,
                index_count,
            },
            flat: surface.flat,
            distance_squared: surface.bounds.distance_squared(self.local.camera),
        });
        None
    }
}

impl SurfaceRun<'_> {
    /// Adds triangles to the coverage of a sky. The engine draws a sky once for each fog of its surfaces.
    fn add_sky(
        &self,
        (material, fog): (u32, u32),
        first_index: u32,
        index_count: u32,
        out: &mut ClassicPart,
    ) {
        let Some(placed) = self.placed else {
            return;
        };
        let same = |sky: &VisibleSky| (sky.material, sky.fog) == (material, fog);
        let at = match out.skies.iter().position(same) {
            Some(at) => at,
            None => {
                out.skies.push(VisibleSky {
                    material,
                    fog,
                    coverage: SkyCoverage::EMPTY,
                });
                out.skies.len() - 1
            }
        };
        if let Some(sky) = out.skies.get_mut(at) {
            for triangle in self.world.triangles(first_index, index_count) {
                let seen = triangle.map(|p| entity::to_world(placed, p) - self.camera);
                sky.coverage.add(seen);
            }
        }
    }
}

/// A visible surface whose vertices need deformation.
#[derive(Clone, Copy, Debug)]
pub(super) struct PendingDeform {
    pub surface: u32,
    /// Indices of its level of detail.
    pub first_index: u32,
    pub index_count: u32,
    pub material: u32,
    pub sort_key: u64,
    pub dlights: u32,
}

impl ClassicPart {
    /// Lists a mesh as a surface.
    pub(super) fn push_mesh(
        &mut self,
        mesh: &DynamicMesh,
        sort_key: u64,
        lightmap: u32,
        dlights: u32,
    ) {
        self.surfaces.push(DrawSurface {
            sort_key,
            material: mesh.material,
            instance: mesh.instance,
            fog: mesh.fog,
            lightmap,
            dlights,
            geometry: Geometry::Dynamic {
                first_index: mesh.first_index,
                index_count: mesh.index_count,
            },
            flat: false,
            distance_squared: 0.0,
        });
    }
}

/// Writes the dynamic lights, transformed to the space of an origin and axes, to `out`.
pub(super) fn local_lights(
    lights: &[DynamicLight],
    origin: Vec3,
    axis: &[Vec3; 3],
    out: &mut Vec<LocalLight>,
) {
    out.clear();
    out.extend(lights.iter().map(|light| {
        let to = light.origin - origin;
        LocalLight {
            local: Vec3::new(to.dot(axis[0]), to.dot(axis[1]), to.dot(axis[2])),
            world: light.origin,
            radius: light.radius,
        }
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_order_material_then_entity_then_fog_then_light() {
        let keys = [
            sort_key(0, WORLD_ENTITY, 31, true),
            sort_key(1, 0, 0, false),
            sort_key(1, 0, 0, true),
            sort_key(1, 0, 1, false),
            sort_key(1, 1, 0, false),
            sort_key(1, WORLD_ENTITY, 0, false),
            sort_key(2, 0, 0, false),
        ];
        assert!(keys.is_sorted());
        assert_eq!(
            keys.iter().collect::<std::collections::HashSet<_>>().len(),
            keys.len()
        );
    }

    #[test]
    fn lights_reach_boxes() {
        let local = LocalView {
            camera: Vec3::ZERO,
            frustum: &[],
            lights: &[0.0, 100.0].map(|x| LocalLight {
                local: Vec3::X * x,
                world: Vec3::X * x,
                radius: 10.0,
            }),
            forward: Vec3::X,
            by_facing: true,
        };
        let at = |x: f32| Aabb::new(Vec3::new(x, -1.0, -1.0), Vec3::new(x + 1.0, 1.0, 1.0));
        assert_eq!(local.lights_at(&at(9.0)), 1);
        assert_eq!(local.lights_at(&at(50.0)), 0);
        assert_eq!(local.lights_at(&at(95.0)), 2);
    }
}
