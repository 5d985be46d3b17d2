//! The acceleration structures of what keeps its shape: one bottom-level structure for each brush model and kind of
//! material, built once per map, compacted.

use std::collections::BTreeMap;

use glam::Vec3;
use shaders::trace_types::SkyRecord;
use shaders::types::Triangle;
use shaders::types::constants::{NO_TEXTURE, TRIANGLE_WORLD};

use super::input::{Kind, MaterialInfo, MaterialTable, StaticScene, StaticSurface};
use crate::gpu::{Blas, BlasBuild, BlasFlags, BlasGeometry, Buffer, BufferUsage, Device, Error};

/// One bottom-level structure of the map.
pub struct StaticBlas {
    /// BSP model.
    pub model: u32,
    /// Kind of its triangles.
    pub kind: Kind,
    /// Device address of its `Triangle`s.
    pub triangles: u64,
    /// The structure.
    pub blas: Blas,
}

/// A map's geometry as rays see it.
pub struct StaticGeometry {
    /// Its bottom-level structures.
    pub structures: Vec<StaticBlas>,
    /// Device address of the vertices that their triangles index.
    pub vertices: u64,
    /// Sky records, indexed by the lightmap field of sky triangles.
    pub skies: Buffer,
    /// Fog volumes.
    pub fogs: Buffer,
    /// Number of fog volumes.
    pub fog_count: u32,
    // kept alive for the structures' triangles
    _triangles: Buffer,
}

/// A group of surfaces that become one structure.
struct Group {
    first: usize,
    count: usize,
}

/// Rank of a material among those drawn, as a triangle's flags hold it: of translucent layers in one plane the one with
/// the greater rank is in front.
pub fn rank_bits(info: &MaterialInfo) -> u32 {
    // sort values lie between 0 and 16 and have fractions now and then
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let rank = (info.sort * 8.0).clamp(0.0, 255.0) as u32;
    rank << shaders::trace_types::constants::TRIANGLE_RANK_SHIFT
}

/// The CPU half: triangles grouped by model and kind, translucent ones in drawing order, indices beside them.
struct Grouped {
    triangles: Vec<Triangle>,
    groups: BTreeMap<(u32, Kind), Group>,
    skies: Vec<SkyRecord>,
}

/// Surfaces of one structure with the material that is drawn for each.
type Members<'a> = Vec<(&'a StaticSurface, u32, MaterialInfo)>;

fn group(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> Grouped {
    let mut sorted: BTreeMap<(u32, Kind), Members<'_>> = BTreeMap::new();
    for surface in &scene.surfaces {
        let (material, info) = materials.info(surface.material);
        if let Some(kind) = Kind::of(info.flags) {
            let list = sorted.entry((surface.model, kind)).or_default();
            list.push((surface, material, info));
        }
    }
    let mut grouped = Grouped {
        triangles: Vec::new(),
        groups: BTreeMap::new(),
        skies: Vec::new(),
    };
    let mut sky_of_material: BTreeMap<u32, u32> = BTreeMap::new();
    for (key, mut list) in sorted {
        // in the engine's order, so that a later primitive is one that is drawn later; stable, as its order is
        list.sort_by(|a, b| {
            a.2.sort
                .total_cmp(&b.2.sort)
                .then(a.2.order.cmp(&b.2.order))
        });
        let first = grouped.triangles.len();
        for (surface, material, info) in list {
            let lightmap = if key.1 == Kind::Sky {
                *sky_of_material.entry(material).or_insert_with(|| {
                    grouped.skies.push(info.sky.unwrap_or(SkyRecord {
                        faces: [NO_TEXTURE; 6],
                        cloud_height: 512.0,
                    }));
                    u32::try_from(grouped.skies.len() - 1).unwrap_or(0)
                })
            } else {
                surface.lightmap
            };
            let range = surface.first_index as usize
                ..(surface.first_index as usize).saturating_add(surface.index_count as usize);
            let corners = scene.indices.get(range).unwrap_or_default();
            for corner in corners.chunks_exact(3) {
                let indices = [corner[0], corner[1], corner[2]];
                if indices.iter().any(|&i| i as usize >= scene.vertices.len()) {
                    continue;
                }
                grouped.triangles.push(Triangle {
                    indices,
                    material,
                    instance: 0,
                    fog: surface.fog,
                    lightmap,
                    flags: TRIANGLE_WORLD | rank_bits(&info),
                });
            }
        }
        let count = grouped.triangles.len() - first;
        if count > 0 {
            grouped.groups.insert(key, Group { first, count });
        }
    }
    grouped
}

impl StaticGeometry {
    /// Builds the structures of a map, blocking until they are done.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn new(
        device: &Device,
        scene: &StaticScene<'_>,
        materials: &dyn MaterialTable,
    ) -> Result<Self, Error> {
        let grouped = group(scene, materials);
        let indices: Vec<[u32; 3]> = grouped.triangles.iter().map(|t| t.indices).collect();
        let index_buffer = Buffer::with_data(
            device,
            "trace static indices",
            BufferUsage::ACCEL_INPUT,
            &indices,
        )?;
        // of their own, because only these need to be readable by builds
        let positions: Vec<Vec3> = scene.vertices.iter().map(|v| v.position).collect();
        let position_buffer = Buffer::with_data(
            device,
            "trace static positions",
            BufferUsage::ACCEL_INPUT,
            &positions,
        )?;
        let triangles = Buffer::with_data(
            device,
            "trace static triangles",
            BufferUsage::STORAGE,
            &grouped.triangles,
        )?;
        let flags = BlasFlags {
            compact: true,
            ..BlasFlags::default()
        };
        let mut structures = Vec::new();
        let mut geometries = Vec::new();
        for ((model, kind), group) in grouped.groups {
            structures.push(StaticBlas {
                model,
                kind,
                triangles: triangles.address() + (group.first * size_of::<Triangle>()) as u64,
                blas: Blas::new(device, &format!("trace model {model} {kind:?}"), flags),
            });
            geometries.push([BlasGeometry {
                vertex_address: position_buffer.address(),
                vertex_stride: size_of::<Vec3>() as u64,
                max_vertex: u32::try_from(scene.vertices.len().saturating_sub(1))
                    .unwrap_or(u32::MAX),
                index_address: index_buffer.address()
                    + (group.first * size_of::<[u32; 3]>()) as u64,
                triangle_count: u32::try_from(group.count).unwrap_or(u32::MAX),
                opaque: matches!(kind, Kind::Opaque | Kind::Sky),
                no_duplicate_any_hit: kind == Kind::Translucent,
            }]);
        }
        let mut builds: Vec<BlasBuild<'_>> = structures
            .iter_mut()
            .zip(&geometries)
            .map(|(s, g)| BlasBuild {
                blas: &mut s.blas,
                geometries: g,
            })
            .collect();
        device.build_static_blas(&mut builds)?;
        Ok(Self {
            structures,
            vertices: scene.vertex_address,
            skies: Buffer::with_data(device, "trace skies", BufferUsage::STORAGE, &grouped.skies)?,
            fogs: Buffer::with_data(device, "trace fogs", BufferUsage::STORAGE, scene.fogs)?,
            fog_count: u32::try_from(scene.fogs.len()).unwrap_or(u32::MAX),
            _triangles: triangles,
        })
    }
}
