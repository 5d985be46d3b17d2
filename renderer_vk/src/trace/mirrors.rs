//! The flat mirrors of a map, across which light is sampled.
//!
//! Light that a flat mirror reflects comes from the mirror image of the lamp. A path finds it by a light sample in the
//! mirrored space (`mirror_light.rgen`); a random direction would hardly ever lead through the mirror to a small lamp.
//! Live frames use the largest mirrors, and at a point those that its cluster may see.

use std::collections::HashMap;

use glam::Vec3;
use relight::light::{ClusterSet, Sight};
use shaders::trace_types::MirrorPlane;
use shaders::trace_types::constants::{
    MASKED_MIRRORS as MASKED, MIRROR_TRANSLUCENT, MIRROR_TWO_SIDED, NO_MIRROR,
};
use shaders::types::Vertex;
use shaders::types::constants as c;
use support::Aabb;

use super::input::{Kind, MaterialTable, StaticScene, StaticSurface};
use super::light_tables::{Entry, probabilities};
use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// Largest distance of a flat surface's vertices from its plane, units.
const FLATNESS: f32 = 1.0 / 16.0;
/// Least cosine of the vertex normals to the normal of a flat surface.
const STRAIGHTNESS: f32 = 0.9999;
/// Planes in live frames: the largest ones. Of many, a frame's samples would rarely choose the one that matters.
const LIVE_PLANES: u32 = 16;

/// Flat mirrors of a map.
#[derive(Default)]
pub struct Mirrors {
    buffers: Option<[Buffer; 2]>,
    count: u32,
    has_layers: bool,
    /// Boxes around the surfaces of each of the first `MASKED_MIRRORS` planes.
    boxes: Vec<Vec<Aabb>>,
    reach: Option<Buffer>,
    /// For each cluster, the planes that reflect light onto a cluster which it sees: bits as in `reach`.
    in_sight: Vec<u32>,
}

impl Mirrors {
    /// Collects the mirrors of a map.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        scene: &StaticScene<'_>,
        materials: &dyn MaterialTable,
    ) -> Result<Self, Error> {
        let mut found = Found::of(scene, materials);
        let count = u32::try_from(found.planes.len()).unwrap_or(NO_MIRROR);
        let buffer =
            |name, data: &[u8]| Buffer::with_data(device, name, BufferUsage::STORAGE, data);
        let buffers = if count > 0 {
            let [planes, of_surface] = [
                bytemuck::cast_slice(&found.planes),
                bytemuck::cast_slice(&found.of_surface),
            ];
            Some([
                buffer("trace mirrors", planes)?,
                buffer("trace mirror surfaces", of_surface)?,
            ])
        } else {
            None
        };
        found.boxes.truncate(MASKED as usize);
        Ok(Self {
            buffers,
            count,
            has_layers: found.has_layers,
            boxes: found.boxes,
            ..Self::default()
        })
    }

    /// Finds the clusters on which each of the first planes may reflect light.
    ///
    /// # Errors
    /// Out of memory.
    pub fn find_reach(&mut self, device: &Device, sight: &Sight) -> Result<(), Error> {
        let clusters = sight.count();
        if self.boxes.is_empty() || clusters == 0 {
            return Ok(());
        }
        let mut masks = vec![0u32; clusters];
        for (boxes, bit) in self.boxes.iter().zip(0..MASKED) {
            let mut at = ClusterSet::none(clusters);
            for bounds in boxes {
                at.merge(&sight.touching(*bounds));
            }
            for cluster in sight.lit_from(&at).iter() {
                if let Some(mask) = masks.get_mut(cluster) {
                    *mask |= 1 << bit;
                }
            }
        }
        let seen_from = |cluster| {
            let mut at = ClusterSet::none(clusters);
            at.insert(cluster);
            let seen = sight.lit_from(&at);
            let masks = seen.iter().filter_map(|other| masks.get(other));
            masks.fold(0, |all, mask| all | mask)
        };
        self.in_sight = (0..clusters).map(seen_from).collect();
        let usage = BufferUsage::STORAGE;
        let reach = Buffer::with_data(device, "trace mirror reach", usage, &masks)?;
        self.reach = Some(reach);
        Ok(())
    }

    /// Device addresses of the `MirrorPlane`s and of the index of each surface's plane; 0: there are none.
    pub fn addresses(&self) -> [u64; 2] {
        (self.buffers.as_ref()).map_or([0; 2], |buffers| buffers.each_ref().map(Buffer::address))
    }

    /// Whether the map has glass or liquids that mirror light, flat or not.
    pub fn has_layers(&self) -> bool {
        self.has_layers
    }

    /// Device address of the clusters' masks, and their number.
    pub fn reach(&self) -> (u64, u32) {
        let clusters = u32::try_from(self.in_sight.len()).unwrap_or(0);
        (self.reach.as_ref().map_or(0, Buffer::address), clusters)
    }

    /// Number of planes that a frame uses. `cluster`: of the camera, if the frame shows only what that sees.
    pub fn count(&self, accumulates: bool, cluster: Option<usize>) -> u32 {
        if accumulates {
            return self.count;
        }
        let live = self.count.min(LIVE_PLANES);
        let in_sight = cluster.and_then(|cluster| self.in_sight.get(cluster));
        let none = in_sight.is_some_and(|mask| mask.trailing_zeros() >= live);
        if none { 0 } else { live }
    }
}

/// A surface's plane.
#[derive(Clone, Copy, Debug)]
struct Flat {
    normal: Vec3,
    distance: f32,
    area: f32,
}

impl Flat {
    /// The plane of a surface; `None`: it is curved, or is shaded as if it were, or has no area.
    fn of(scene: &StaticScene<'_>, surface: &StaticSurface) -> Option<Self> {
        let corners: Vec<&Vertex> = scene.corners(surface).collect();
        let (triangles, _) = corners.as_chunks::<3>();
        let mut sum = Vec3::ZERO;
        for &[a, b, c] in triangles {
            // clockwise from the front
            sum += (c.position - a.position).cross(b.position - a.position);
        }
        let area = 0.5 * sum.length();
        let normal = sum.try_normalize().filter(|n| n.is_finite())?;
        let distance = normal.dot(corners.first()?.position);
        let is_flat = |v: &&Vertex| {
            (normal.dot(v.position) - distance).abs() <= FLATNESS
                && (v.normal == Vec3::ZERO || normal.dot(v.normal.normalize()) >= STRAIGHTNESS)
        };
        (!surface.curved && area > 0.0 && corners.iter().all(is_flat)).then_some(Self {
            normal,
            distance,
            area,
        })
    }

    /// Equal for surfaces in one plane, up to a thousandth of a unit and a few seconds of arc.
    fn key(&self) -> [i64; 4] {
        #[allow(clippy::cast_possible_truncation)] // saturates
        let step = |v: f32, steps: f32| (v * steps).round() as i64;
        let n = self.normal;
        [
            step(n.x, 1.0e5),
            step(n.y, 1.0e5),
            step(n.z, 1.0e5),
            step(self.distance, 1.0e3),
        ]
    }
}

/// Planes by area, and the plane of each surface.
#[derive(Debug, Default)]
struct Found {
    planes: Vec<MirrorPlane>,
    of_surface: Vec<u32>,
    has_layers: bool,
    /// Boxes around the surfaces of each plane.
    boxes: Vec<Vec<Aabb>>,
}

/// The surfaces in one plane.
#[derive(Debug, Default)]
struct InPlane {
    plane: MirrorPlane,
    boxes: Vec<Aabb>,
    surfaces: Vec<u32>,
}

/// What a surface mirrors light as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Mirroring {
    Solid,
    Layer,
}

impl Mirroring {
    /// `None`: it mirrors nothing, or rays of light do not meet it.
    fn of(flags: u32) -> Option<Self> {
        const GLASSY: u32 = c::MATERIAL_GLASS | c::MATERIAL_LIQUID;
        let reflects = flags & c::MATERIAL_REFLECTS != 0;
        match Kind::in_light(flags, true)? {
            Kind::Opaque | Kind::Tested if reflects || flags & c::MATERIAL_PORTAL != 0 => {
                Some(Self::Solid)
            }
            Kind::Translucent if reflects && flags & GLASSY != 0 => Some(Self::Layer),
            _ => None,
        }
    }
}

impl Found {
    fn of(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> Self {
        let mut by_plane: HashMap<_, InPlane> = HashMap::new();
        let mut has_layers = false;
        for surface in &scene.surfaces {
            let (_, info) = materials.info(surface.material);
            let Some(mirroring) = Mirroring::of(info.flags) else {
                continue;
            };
            let is_layer = mirroring == Mirroring::Layer;
            has_layers |= is_layer;
            if surface.model != 0 {
                continue; // it may move
            }
            let Some(flat) = Flat::of(scene, surface) else {
                continue;
            };
            let key = (mirroring, flat.key());
            let InPlane {
                plane,
                boxes,
                surfaces,
            } = by_plane.entry(key).or_default();
            plane.plane = flat.normal.extend(flat.distance).to_array();
            plane.area += flat.area;
            if info.flags & (c::MATERIAL_TWO_SIDED | c::MATERIAL_CULL_BACK) != 0 {
                plane.flags |= MIRROR_TWO_SIDED;
            }
            if is_layer {
                plane.flags |= MIRROR_TRANSLUCENT;
            }
            let corners = scene.corners(surface);
            boxes.push(corners.fold(Aabb::EMPTY, |bounds, v| bounds.with(v.position)));
            surfaces.push(surface.number);
        }
        let mut planes: Vec<InPlane> = by_plane.into_values().collect();
        // planes of equal area in the order of the map, so that a map has one order
        planes.sort_by(|a, b| {
            let by_area = b.plane.area.total_cmp(&a.plane.area);
            by_area.then_with(|| a.surfaces.cmp(&b.surfaces))
        });
        let mut found = Self {
            planes: Vec::with_capacity(planes.len()),
            of_surface: vec![NO_MIRROR; surface_count(scene)],
            has_layers,
            boxes: Vec::with_capacity(planes.len()),
        };
        for (in_plane, index) in planes.into_iter().zip(0..) {
            let all = in_plane.boxes.iter().copied();
            let bounds = all.fold(Aabb::EMPTY, Aabb::union);
            found.planes.push(MirrorPlane {
                centre: bounds.centre(),
                radius: 0.5 * bounds.size().length(),
                ..in_plane.plane
            });
            found.boxes.push(in_plane.boxes);
            for surface in in_plane.surfaces {
                if let Some(of) = found.of_surface.get_mut(surface as usize) {
                    *of = index;
                }
            }
        }
        accumulate(&mut found.planes);
        found
    }
}

fn surface_count(scene: &StaticScene<'_>) -> usize {
    let after = |surface: &StaticSurface| surface.number as usize + 1;
    scene.surfaces.iter().map(after).max().unwrap_or(0)
}

/// Sets the sums of probabilities, which follow the areas.
fn accumulate(planes: &mut [MirrorPlane]) {
    let entry = |(plane, index): (&MirrorPlane, u32)| Entry {
        light: index,
        share: plane.area,
        visibility: 1.0,
    };
    let entries: Vec<Entry> = planes.iter().zip(0..).map(entry).collect();
    let mut sum = 0.0;
    for (plane, probability) in planes.iter_mut().zip(probabilities(&entries)) {
        sum += probability;
        #[allow(clippy::cast_possible_truncation)] // rounds
        let until = sum as f32;
        plane.until = until;
    }
}

#[cfg(test)]
mod tests {
    use shaders::types::MaterialBuffers;

    use super::super::input::MaterialInfo;
    use super::*;

    /// Materials whose flags are their indices' entries.
    struct Table(Vec<u32>);

    impl MaterialTable for Table {
        fn info(&self, index: u32) -> (u32, MaterialInfo) {
            let flags = self.0[index as usize];
            let info = MaterialInfo {
                flags,
                ..MaterialInfo::default()
            };
            (index, info)
        }

        fn buffers(&self) -> MaterialBuffers {
            MaterialBuffers::default()
        }

        fn sky_sampler(&self) -> u32 {
            0
        }

        fn generation(&self) -> u64 {
            0
        }
    }

    /// A map of right triangles that face up: height, side, material, and model of each.
    fn found(triangles: &[(f32, f32, u32, u32)], bent: f32) -> Found {
        let materials = Table(vec![
            c::MATERIAL_REFLECTS,
            0,
            c::MATERIAL_PORTAL,
            c::MATERIAL_REFLECTS | c::MATERIAL_LIQUID | c::MATERIAL_TRANSLUCENT,
            c::MATERIAL_REFLECTS | c::MATERIAL_TRANSLUCENT,
        ]);
        let vertices: Vec<Vertex> = triangles
            .iter()
            .flat_map(|&(z, side, _, _)| {
                // clockwise from above
                [[0.0, 0.0], [0.0, side], [side, 0.0]].map(|[x, y]| Vertex {
                    position: Vec3::new(x, y, z),
                    normal: Vec3::new(bent * x, 0.0, 1.0),
                    ..Vertex::default()
                })
            })
            .collect();
        let indices: Vec<u32> = (0..).zip(&vertices).map(|(i, _)| i).collect();
        let surfaces = (triangles.iter().zip(0..))
            .map(|(&(_, _, material, model), number)| StaticSurface {
                first_index: 3 * number,
                index_count: 3,
                material,
                fog: 0,
                lightmap: c::NO_TEXTURE,
                model,
                number,
                curved: false,
            })
            .collect();
        let scene = StaticScene {
            vertices: &vertices,
            vertex_address: 0,
            mapped_address: 0,
            indices: &indices,
            surfaces,
            fogs: &[],
        };
        Found::of(&scene, &materials)
    }

    #[test]
    fn surfaces_are_joined_by_plane_and_sorted_by_area() {
        let found = found(
            &[
                (5.0, 2.0, 0, 0),
                (9.0, 8.0, 2, 0),
                (5.0, 4.0, 0, 0),
                (1.0, 9.0, 1, 0), // matt
                (2.0, 9.0, 0, 1), // of a door
                (5.0, 1.0, 3, 0), // water in the plane of a mirror
                (3.0, 9.0, 4, 0), // neither glass nor liquid
            ],
            0.0,
        );
        let none = NO_MIRROR;
        assert_eq!(found.of_surface, [1, 0, 1, none, none, 2, none]);
        let areas: Vec<f32> = found.planes.iter().map(|p| p.area).collect();
        assert_eq!(areas, [32.0, 10.0, 0.5]);
        assert_eq!(found.planes[1].plane, [0.0, 0.0, 1.0, 5.0]);
        assert_eq!(found.boxes[1].len(), 2);
        assert_eq!(found.planes[2].flags, MIRROR_TRANSLUCENT);
        assert!(found.has_layers);
        assert!((found.planes[2].until - 1.0).abs() < 1.0e-6);
        // by area, but for a part that is shared evenly
        let by_area = 32.0 / 42.5;
        assert!(found.planes[0].until < by_area && found.planes[0].until > 0.9 * by_area);
    }

    #[test]
    fn what_is_shaded_as_a_curve_is_no_flat_mirror() {
        assert_eq!(found(&[(0.0, 1.0, 0, 0)], 0.001).planes.len(), 1);
        assert_eq!(found(&[(0.0, 1.0, 0, 0)], 0.1).planes.len(), 0);
    }

    #[test]
    fn live_frames_use_the_largest_mirrors_that_may_be_in_sight() {
        let mirrors = Mirrors {
            count: 40,
            in_sight: vec![1 << 20, 1 << 3],
            ..Mirrors::default()
        };
        assert_eq!(mirrors.count(true, Some(0)), 40);
        assert_eq!(mirrors.count(false, None), LIVE_PLANES);
        assert_eq!(mirrors.count(false, Some(1)), LIVE_PLANES);
        assert_eq!(mirrors.count(false, Some(2)), LIVE_PLANES);
        // the camera's cluster sees a small one alone
        assert_eq!(mirrors.count(false, Some(0)), 0);
    }
}
