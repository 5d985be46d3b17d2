//! Acceleration structures of the map's constant geometry: one for each brush model and group of kinds, built once per
//! map.

use std::collections::{BTreeMap, HashSet};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use glam::{Vec2, Vec3};
use shaders::trace_types::{BvhTriangle, SkyRecord};
use shaders::types::Triangle;
use shaders::types::constants::{
    NO_TEXTURE, TRIANGLE_BODY, TRIANGLE_CURVED, TRIANGLE_ONE_SIDED, TRIANGLE_SOLID,
    TRIANGLE_STATIC, TRIANGLE_WORLD,
};
use support::Aabb;
use support::slice;

use super::beyond_sky::MapSkies;
use super::bodies::{Bodies, body_surfaces};
use super::bvh::{build_triangles, unordered};
use super::cut_out_boxes::CutOuts;
use super::cutout::Coverage;
use super::doubled::doubled;
use super::grid::{self, GridStructure};
use super::input::{Kind, MaterialInfo, MaterialTable, StaticScene, StaticSurface};
use super::layer_boxes::{StaticLayer, bounds_of};
use super::lifted::lifted;
use super::mirrors::Mirrors;
use super::solids::solid_surfaces;
use super::surroundings::Surroundings;
use super::tracer::Tracer;
use crate::gpu::{Blas, BlasBuild, BlasFlags, BlasGeometry, Buffer, BufferUsage, Device, Error};
use crate::statistics::StructureCost;

/// Triangles of one kind.
pub struct StaticPart {
    /// Their kind.
    pub kind: Kind,
    /// Device address of the `Triangle`s.
    pub triangles: u64,
    /// Number of them.
    pub count: u32,
}

/// One bottom-level structure of the map.
pub struct StaticBlas {
    /// BSP model.
    pub model: u32,
    /// The geometries in it. All geometry of a model that stops rays shares one structure, because a ray traverses each
    /// structure that it meets; translucent and passed geometry is separate, because fewer ray types test it.
    pub parts: Vec<StaticPart>,
    /// The structure.
    pub structure: Structure,
}

/// An acceleration structure.
pub enum Structure {
    /// The driver's structure, for the ray tracing pipeline and ray queries.
    Driver(Blas),
    /// Our own hierarchy, for the compute and the grid tracer.
    Own(OwnStructure),
    /// A uniform grid, for the grid tracer.
    Grid(GridStructure),
}

impl Structure {
    /// Bytes on the device.
    fn bytes(&self) -> u64 {
        match self {
            Self::Driver(blas) => blas.size(),
            Self::Own(own) => own.nodes.size() + own.triangles.size(),
            Self::Grid(grid) => grid.bytes(),
        }
    }
}

/// A hierarchy on the GPU.
pub struct OwnStructure {
    /// `BvhNode`s.
    pub nodes: Buffer,
    /// `BvhTriangle`s.
    pub triangles: Buffer,
    /// Bounds of all triangles, in the model's space.
    pub bounds: Aabb,
}

/// Acceleration structures and shading data of a map.
pub struct StaticGeometry {
    /// Unique number of this geometry; addresses may be reused by a later one.
    pub serial: u64,
    /// Its bottom-level structures.
    pub structures: Vec<StaticBlas>,
    /// Device address of the vertices that their triangles index.
    pub vertices: u64,
    /// Positions of these vertices in the structures.
    pub positions: Vec<Vec3>,
    /// Device address of the vertices' `MappedVertex`; 0: they have none.
    pub mapped_vertices: u64,
    /// Sky records, indexed by the lightmap field of sky triangles.
    pub skies: Buffer,
    /// Fog volumes.
    pub fogs: Buffer,
    /// Number of fog volumes.
    pub fog_count: u32,
    /// Their boxes.
    pub fog_boxes: Vec<Aabb>,
    /// Its translucent surfaces.
    pub layers: Vec<StaticLayer>,
    /// Its skies, and the geometry that may be visible through them.
    pub map_skies: MapSkies,
    /// Its flat mirrors.
    pub mirrors: Mirrors,
    /// Its alpha-tested surfaces.
    pub cut_outs: CutOuts,
    /// Its refracting bodies.
    pub bodies: Bodies,
    /// Surfaces that filter light, and liquids; empty unless the caller sets them.
    pub surroundings: Surroundings,
    /// Cost of the structures.
    pub cost: StructureCost,
    /// Numbers of the first triangles: those of the world that stop rays, but for the sky; all of the world.
    pub world_triangles: [u32; 2],
    /// For each of all triangles, its number in the scene's indices.
    pub sources: Vec<u32>,
    /// Records of the structures' triangles, which shaders read by address.
    triangle_records: Buffer,
}

/// Groups of kinds that share a structure, whose instances have one mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Together {
    Solid,
    Translucent,
    Passed,
}

impl Together {
    fn of(kind: Kind) -> Self {
        match kind {
            Kind::Opaque | Kind::Tested | Kind::Sky => Self::Solid,
            Kind::Translucent => Self::Translucent,
            Kind::Passed => Self::Passed,
        }
    }
}

/// A group of surfaces that become one structure.
struct Group {
    first: usize,
    count: usize,
}

/// Drawing rank of a material as bits of a triangle's flags: of coplanar translucent layers, the one of greater rank is
/// in front.
pub fn rank_bits(info: &MaterialInfo) -> u32 {
    // sort values lie between 0 and 16, some with fractions
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let rank = (info.sort * 8.0).clamp(0.0, 255.0) as u32;
    rank << shaders::trace_types::constants::TRIANGLE_RANK_SHIFT
}

/// Triangle flags of a kind. `Kind::Passed` is one-sided: camera rays pass its back face.
pub fn sides(kind: Kind) -> u32 {
    match kind {
        Kind::Passed => TRIANGLE_ONE_SIDED,
        _ => 0,
    }
}

/// CPU data: triangles grouped by model and kind, translucent ones in drawing order, with their indices.
struct Grouped {
    triangles: Vec<Triangle>,
    /// The number of each in the scene's indices.
    sources: Vec<u32>,
    groups: BTreeMap<(u32, Kind), Group>,
    skies: Vec<SkyRecord>,
}

/// A subset of a surface's triangles.
#[derive(Clone, Copy)]
enum Portion {
    /// All.
    Whole,
    /// Those of an alpha-tested surface with this coverage.
    Covered(Coverage),
    /// Those with an opposite triangle in their plane, or those without.
    Doubled(bool),
}

/// Surfaces of one structure, each with its drawn material.
type Members<'a> = Vec<(&'a StaticSurface, u32, MaterialInfo, Portion)>;

/// The surfaces of each structure, by BSP model and kind. `doubled`: first indices of triangles that lie in another's place.
fn members<'a>(
    scene: &'a StaticScene<'_>,
    materials: &dyn MaterialTable,
    doubled: &HashSet<usize>,
) -> BTreeMap<(u32, Kind), Members<'a>> {
    let has_doubled = |surface: &StaticSurface| {
        let first = surface.first_index as usize;
        let firsts = (0..surface.index_count as usize).step_by(3);
        !doubled.is_empty() && firsts.into_iter().any(|i| doubled.contains(&(first + i)))
    };
    let mut sorted: BTreeMap<(u32, Kind), Members<'_>> = BTreeMap::new();
    for surface in &scene.surfaces {
        let (material, info) = materials.info(surface.material);
        if let Some(kind) = Kind::in_light(info.flags, true) {
            let mut add = |kind, part| {
                let list = sorted.entry((surface.model, kind)).or_default();
                list.push((surface, material, info, part));
            };
            if kind == Kind::Tested {
                // solid triangles need no alpha test, empty ones are left out
                add(Kind::Opaque, Portion::Covered(Coverage::Solid));
                add(Kind::Tested, Portion::Covered(Coverage::Mixed));
            } else if kind == Kind::Opaque && has_doubled(surface) {
                add(Kind::Opaque, Portion::Doubled(false));
                add(Kind::Tested, Portion::Doubled(true));
            } else {
                add(kind, Portion::Whole);
            }
        }
    }
    sorted
}

/// The triangles of all structures, each with a range of them. `solids`: surfaces of closed bodies of glass; `bodies`: of
/// bodies that photons are aimed at.
fn group(
    scene: &StaticScene<'_>,
    materials: &dyn MaterialTable,
    solids: &HashSet<u32>,
    bodies: &HashSet<u32>,
) -> Grouped {
    let doubled = doubled(scene, materials);
    let sorted = members(scene, materials, &doubled);
    let mut grouped = Grouped {
        triangles: Vec::new(),
        sources: Vec::new(),
        groups: BTreeMap::new(),
        skies: Vec::new(),
    };
    let mut sky_of_material: BTreeMap<u32, u32> = BTreeMap::new();
    for (key, mut list) in sorted {
        // a stable sort in drawing order, so that later primitives are drawn later
        list.sort_by(|a, b| {
            a.2.sort
                .total_cmp(&b.2.sort)
                .then(a.2.order.cmp(&b.2.order))
        });
        let first = grouped.triangles.len();
        for (surface, material, info, part) in list {
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
            for (i, &indices) in scene.triangles(surface).iter().enumerate() {
                if indices.iter().any(|&i| i as usize >= scene.vertices.len()) {
                    continue;
                }
                let st = |i: u32| scene.vertices.get(i as usize).map_or(Vec2::ZERO, |v| v.st);
                let first = surface.first_index as usize + 3 * i;
                let takes = match part {
                    Portion::Whole => true,
                    Portion::Covered(c) => materials.coverage(material, indices.map(st)) == c,
                    Portion::Doubled(is) => doubled.contains(&first) == is,
                };
                if !takes {
                    continue;
                }
                let sides = match part {
                    Portion::Doubled(true) => TRIANGLE_ONE_SIDED,
                    _ => sides(key.1),
                };
                let mut shape = if surface.curved { TRIANGLE_CURVED } else { 0 };
                if solids.contains(&surface.number) {
                    shape |= TRIANGLE_SOLID;
                }
                if bodies.contains(&surface.number) {
                    shape |= TRIANGLE_BODY;
                }
                (grouped.sources).push(u32::try_from(first / 3).unwrap_or(u32::MAX));
                grouped.triangles.push(Triangle {
                    indices,
                    material,
                    instance: surface.number,
                    fog: surface.fog,
                    lightmap,
                    flags: TRIANGLE_WORLD | TRIANGLE_STATIC | shape | sides | rank_bits(&info),
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

/// Bounds of translucent surfaces.
fn layers(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> Vec<StaticLayer> {
    let is_layer = |s: &&StaticSurface| {
        let (_, info) = materials.info(s.material);
        Kind::of(info.flags) == Some(Kind::Translucent)
    };
    let layer = |s: &StaticSurface| StaticLayer {
        model: s.model,
        bounds: bounds_of(scene.corners(s)),
    };
    scene.surfaces.iter().filter(is_layer).map(layer).collect()
}

impl Grouped {
    /// See [`StaticGeometry::world_triangles`]: models and kinds are in this order.
    fn world_triangles(&self) -> [u32; 2] {
        let count = |last: Kind| {
            let groups = self.groups.range(..=(0, last));
            let counts = groups.map(|(_, group)| group.count);
            u32::try_from(counts.sum::<usize>()).unwrap_or(0)
        };
        [count(Kind::Tested), count(Kind::Passed)]
    }
}

impl StaticGeometry {
    /// Device address of the records of all triangles.
    pub fn triangles(&self) -> u64 {
        self.triangle_records.address()
    }

    /// Bytes of the structures and of the triangle records.
    #[cfg(test)]
    pub fn bytes(&self) -> u64 {
        self.cost.bytes + self.triangle_records.size()
    }

    /// Builds the structures of a map; returns when the GPU has built them. `grid_cells`: `rt_gridCells`.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn new(
        device: &Device,
        (tracer, grid_cells): (Tracer, u32),
        scene: &StaticScene<'_>,
        materials: &dyn MaterialTable,
    ) -> Result<Self, Error> {
        let solids = solid_surfaces(scene, materials);
        let bodies = body_surfaces(scene, materials, &solids);
        let grouped = group(scene, materials, &solids, &bodies);
        let storage = BufferUsage::STORAGE;
        let triangles = Buffer::with_data(
            device,
            "trace static triangles",
            storage,
            &grouped.triangles,
        )?;
        let positions = lifted(scene, materials);
        let begin = Instant::now();
        let structures = match tracer {
            Tracer::Pipeline | Tracer::Query => {
                driver_structures(device, &positions, &grouped, &triangles)?
            }
            Tracer::Compute => own_structures(device, &positions, &grouped, &triangles, None)?,
            Tracer::Grid => {
                own_structures(device, &positions, &grouped, &triangles, Some(grid_cells))?
            }
        };
        let grids = structures.iter().filter_map(|s| match &s.structure {
            Structure::Grid(grid) => Some(grid.cells),
            _ => None,
        });
        let cost = StructureCost {
            build_ms: begin.elapsed().as_secs_f64() * 1e3,
            bytes: structures.iter().map(|s| s.structure.bytes()).sum(),
            triangles: grouped.triangles.len(),
            cells: grids.into_iter().next(),
        };
        static SERIALS: AtomicU64 = AtomicU64::new(1);
        Ok(Self {
            serial: SERIALS.fetch_add(1, Ordering::Relaxed),
            structures,
            cost,
            vertices: scene.vertex_address,
            positions,
            mapped_vertices: scene.mapped_address,
            skies: Buffer::with_data(device, "trace skies", storage, &grouped.skies)?,
            fogs: Buffer::with_data(device, "trace fogs", storage, scene.fogs)?,
            fog_count: u32::try_from(scene.fogs.len()).unwrap_or(u32::MAX),
            fog_boxes: (scene.fogs.iter())
                .map(|fog| Aabb::new(fog.mins, fog.maxs))
                .collect(),
            layers: layers(scene, materials),
            map_skies: MapSkies::new(scene, materials),
            mirrors: Mirrors::new(device, scene, materials)?,
            cut_outs: CutOuts::new(device, scene, materials)?,
            bodies: Bodies::new(device, scene, materials, &bodies)?,
            world_triangles: grouped.world_triangles(),
            surroundings: Surroundings::default(),
            sources: grouped.sources,
            triangle_records: triangles,
        })
    }
}

/// The driver's structures: built in one batch, compacted.
fn driver_structures(
    device: &Device,
    positions: &[Vec3],
    grouped: &Grouped,
    triangles: &Buffer,
) -> Result<Vec<StaticBlas>, Error> {
    let input = BufferUsage::ACCEL_INPUT;
    let indices: Vec<[u32; 3]> = grouped.triangles.iter().map(|t| t.indices).collect();
    let index_buffer = Buffer::with_data(device, "trace static indices", input, &indices)?;
    // a separate buffer, because only positions need the usage flag of build inputs
    let position_buffer = Buffer::with_data(device, "trace static positions", input, positions)?;
    let flags = BlasFlags {
        compact: true,
        ..BlasFlags::default()
    };
    let mut parts: BTreeMap<(u32, Together), (Vec<StaticPart>, Vec<BlasGeometry>)> =
        BTreeMap::new();
    for ((model, kind), group) in &grouped.groups {
        let (members, geometries) = parts.entry((*model, Together::of(*kind))).or_default();
        members.push(StaticPart {
            kind: *kind,
            triangles: triangles.address() + (group.first * size_of::<Triangle>()) as u64,
            count: u32::try_from(group.count).unwrap_or(u32::MAX),
        });
        geometries.push(BlasGeometry {
            vertex_address: position_buffer.address(),
            vertex_stride: size_of::<Vec3>() as u64,
            max_vertex: u32::try_from(positions.len().saturating_sub(1)).unwrap_or(u32::MAX),
            index_address: index_buffer.address() + (group.first * size_of::<[u32; 3]>()) as u64,
            triangle_count: u32::try_from(group.count).unwrap_or(u32::MAX),
            opaque: kind.is_untested(),
            no_duplicate_any_hit: *kind == Kind::Translucent,
        });
    }
    let blas = |(model, together)| {
        let name = format!("trace model {model} {together:?}");
        Blas::new(device, &name, flags)
    };
    let mut structures: Vec<Blas> = parts.keys().copied().map(blas).collect();
    let mut builds: Vec<BlasBuild<'_>> = (structures.iter_mut().zip(parts.values()))
        .map(|(blas, (_, geometries))| BlasBuild {
            blas,
            geometries,
            refit: false,
        })
        .collect();
    device.build_static_blas(&mut builds)?;
    Ok((parts.into_iter().zip(structures))
        .map(|(((model, _), (parts, _)), blas)| StaticBlas {
            model,
            parts,
            structure: Structure::Driver(blas),
        })
        .collect())
}

/// Structures of our own. `grid`: what stops rays in the map itself has a grid of so many cells; 0 chooses them.
fn own_structures(
    device: &Device,
    positions: &[Vec3],
    grouped: &Grouped,
    triangles: &Buffer,
    grid: Option<u32>,
) -> Result<Vec<StaticBlas>, Error> {
    let mut structures = Vec::new();
    let position = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::ZERO);
    let mut together: BTreeMap<(u32, Together), Vec<(Kind, &Group)>> = BTreeMap::new();
    for ((model, kind), group) in &grouped.groups {
        let members = together.entry((*model, Together::of(*kind)));
        members.or_default().push((*kind, group));
    }
    for ((model, kinds), groups) in together {
        // geometry of each triangle, counted from the first, and its number in the geometry
        let mut places: Vec<[u32; 2]> = Vec::new();
        let mut corners: Vec<[Vec3; 3]> = Vec::new();
        for (part, (_, group)) in (0..).zip(&groups) {
            let members = slice::part(&grouped.triangles, group.first..group.first + group.count);
            places.extend((0..).zip(members).map(|(primitive, _)| [part, primitive]));
            corners.extend(members.iter().map(|t| t.indices.map(position)));
        }
        let name = |triangles: &mut [BvhTriangle]| {
            for triangle in triangles {
                if let Some(&[part, primitive]) = places.get(triangle.primitive as usize) {
                    (triangle.part, triangle.primitive) = (part, primitive);
                }
            }
        };
        let grid = match grid.filter(|_| model == 0 && kinds == Together::Solid) {
            Some(cells) => grid::build(&corners, cells)
                .inspect_err(|why| log::warn!("rt_tracer grid: {why}; the map has a hierarchy"))
                .ok(),
            None => None,
        };
        let structure = match grid {
            Some(grid) => {
                let mut triangles = unordered(&corners);
                name(&mut triangles);
                Structure::Grid(GridStructure::new(device, &grid, &triangles)?)
            }
            None => {
                let Some(mut hierarchy) = build_triangles(&corners) else {
                    continue; // no triangle has an area
                };
                name(&mut hierarchy.triangles);
                let storage = BufferUsage::STORAGE;
                let leafs = &hierarchy.triangles;
                Structure::Own(OwnStructure {
                    nodes: Buffer::with_data(device, "trace nodes", storage, &hierarchy.nodes)?,
                    triangles: Buffer::with_data(device, "trace leafs", storage, leafs)?,
                    bounds: hierarchy.bounds,
                })
            }
        };
        let part = |(kind, group): &(Kind, &Group)| StaticPart {
            kind: *kind,
            triangles: triangles.address() + (group.first * size_of::<Triangle>()) as u64,
            count: u32::try_from(group.count).unwrap_or(u32::MAX),
        };
        structures.push(StaticBlas {
            model,
            parts: groups.iter().map(part).collect(),
            structure,
        });
    }
    Ok(structures)
}
