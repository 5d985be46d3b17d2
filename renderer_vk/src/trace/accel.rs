//! The acceleration structures of a frame: what moves, and the top level over everything.
//!
//! Meshes that move come with vertices in the space of their entity. For the build they are transformed into world
//! space on the CPU; the hit shading reads the untransformed ones. All meshes that a ray treats alike go into one
//! bottom-level structure, so a frame builds at most twelve of them, in one batch.

use glam::{Mat3, Vec3};
use shaders::trace_types::constants::{
    MASK_FIRST_SOLID, MASK_FIRST_TRANSLUCENT, MASK_NO_SHADOW, MASK_SKY, MASK_SOLID,
    MASK_THIRD_SOLID, MASK_THIRD_TRANSLUCENT, MASK_TRANSLUCENT, NO_INSTANCE,
};
use shaders::trace_types::{BvhInstance, GeometryRecord};
use shaders::types::Triangle;
use shaders::types::constants as c;

use super::bvh::{Aabb, build, build_triangles};
use super::geometry::{StaticBlas, StaticGeometry, Structure, rank_bits};
use super::input::{Kind, MaterialTable, Tracer};
use crate::gpu::{
    self, Access, Blas, BlasBuild, BlasFlags, BlasGeometry, Device, Error, Recorder, Tlas,
};
use crate::scene::{DynamicMesh, ViewScene};

/// Who sees a mesh that moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    /// Every ray.
    Always,
    /// The eye alone.
    FirstPerson,
    /// Mirrors, shadows and bounced light.
    ThirdPerson,
    /// Everything but shadows.
    NoShadow,
}

impl Seen {
    fn of(flags: u32) -> Self {
        if flags & c::INSTANCE_FIRST_PERSON != 0 {
            Self::FirstPerson
        } else if flags & c::INSTANCE_THIRD_PERSON != 0 {
            Self::ThirdPerson
        } else if flags & c::INSTANCE_NO_SHADOW != 0 {
            Self::NoShadow
        } else {
            Self::Always
        }
    }
}

/// Mask of a top-level instance.
fn mask(seen: Seen, kind: Kind) -> u8 {
    match (seen, kind) {
        (_, Kind::Sky) => MASK_SKY,
        (Seen::Always | Seen::NoShadow, Kind::Translucent) => MASK_TRANSLUCENT,
        (Seen::FirstPerson, Kind::Translucent) => MASK_FIRST_TRANSLUCENT,
        (Seen::ThirdPerson, Kind::Translucent) => MASK_THIRD_TRANSLUCENT,
        (Seen::Always, _) => MASK_SOLID,
        (Seen::FirstPerson, _) => MASK_FIRST_SOLID,
        (Seen::ThirdPerson, _) => MASK_THIRD_SOLID,
        (Seen::NoShadow, _) => MASK_NO_SHADOW,
    }
}

/// Hit group: solids report the nearest hit, translucent layers search in their any-hit shader.
fn hit_group(kind: Kind) -> u32 {
    u32::from(kind == Kind::Translucent)
}

/// Meshes that move and that rays treat alike.
struct Slot {
    seen: Seen,
    kind: Kind,
    triangles: Vec<Triangle>,
    indices: Vec<[u32; 3]>,
}

/// What a frame's rays are traced against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelOutput {
    /// Bindless index of the driver's top-level structure.
    pub scene: u32,
    /// Device address of our own top level's nodes; 0: nothing is there.
    pub nodes: u64,
    /// Device address of the `BvhInstance`s in the order of its leafs.
    pub placed: u64,
    /// Device address of the `GeometryRecord`s.
    pub geometries: u64,
    /// Device address of the view's `Instance`s.
    pub instances: u64,
    /// Device address of the view's `Vertex`es.
    pub vertices: u64,
    /// There is something that only the eye sees.
    pub first_person: bool,
}

/// A structure in its place.
struct Placement<'a> {
    part: Part<'a>,
    axis: Mat3,
    origin: Vec3,
    record: u32,
    mask: u8,
    kind: Kind,
}

/// What is placed.
enum Part<'a> {
    Static(&'a StaticBlas),
    /// Index of the slot.
    Slot(usize),
}

/// The driver's structures for what changes from frame to frame.
struct DriverStructures {
    slots: Vec<Blas>,
    tlas: Tlas,
}

/// Builds the structures of each frame in storage that stays.
pub struct Accel {
    slots: Vec<Slot>,
    /// With the tracers that walk them.
    driver: Option<DriverStructures>,
    positions: Vec<Vec3>,
    used: Vec<bool>,
}

const SEEN: [Seen; 4] = [
    Seen::Always,
    Seen::FirstPerson,
    Seen::ThirdPerson,
    Seen::NoShadow,
];
const KINDS: [Kind; 4] = [Kind::Opaque, Kind::Tested, Kind::Translucent, Kind::Sky];

impl Accel {
    /// Empty structures.
    pub fn new(device: &Device, tracer: Tracer) -> Self {
        let mut slots = Vec::new();
        for seen in SEEN {
            for kind in KINDS {
                slots.push(Slot {
                    seen,
                    kind,
                    triangles: Vec::new(),
                    indices: Vec::new(),
                });
            }
        }
        let flags = BlasFlags {
            fast_build: true,
            ..BlasFlags::default()
        };
        let blas = |s: &Slot| Blas::new(device, &format!("trace {:?} {:?}", s.seen, s.kind), flags);
        Self {
            driver: (tracer != Tracer::Compute).then(|| DriverStructures {
                slots: slots.iter().map(blas).collect(),
                tlas: Tlas::new(device, "trace scene"),
            }),
            slots,
            positions: Vec::new(),
            used: Vec::new(),
        }
    }

    /// Builds the structures of a view. `geometry`: the map, if the view shows it.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn record(
        &mut self,
        rec: &mut Recorder,
        view: &ViewScene,
        geometry: Option<&StaticGeometry>,
        materials: &dyn MaterialTable,
    ) -> Result<AccelOutput, Error> {
        self.collect(view, materials);
        let vertices = rec.arena().push(&view.vertices)?;
        let mut output = AccelOutput {
            instances: rec.arena().push(&view.instances)?,
            vertices,
            first_person: self.slots.iter().any(|s| {
                s.seen == Seen::FirstPerson
                    && s.kind != Kind::Translucent
                    && !s.triangles.is_empty()
            }),
            ..AccelOutput::default()
        };
        let mut records: Vec<GeometryRecord> = Vec::new();
        let mut placed: Vec<Placement<'_>> = Vec::new();
        let mut place = |part, axis, origin, mask, kind: Kind, record: GeometryRecord| {
            placed.push(Placement {
                part,
                axis,
                origin,
                record: u32::try_from(records.len()).unwrap_or(u32::MAX),
                mask,
                kind,
            });
            records.push(record);
        };
        if let Some(geometry) = geometry {
            let submodels = view.submodels.iter().map(|s| (s.model, s.instance));
            for (model, index) in std::iter::once((0, 0)).chain(submodels) {
                let Some(instance) = view.instances.get(index as usize) else {
                    continue;
                };
                let [x, y, z] = instance.axis;
                for part in geometry.structures.iter().filter(|s| s.model == model) {
                    let record = GeometryRecord {
                        triangles: part.triangles,
                        vertices: geometry.vertices,
                        instance: index,
                        kind: part.kind.index(),
                    };
                    let mask = mask(Seen::Always, part.kind);
                    let axis = Mat3::from_cols(x, y, z);
                    place(
                        Part::Static(part),
                        axis,
                        instance.origin,
                        mask,
                        part.kind,
                        record,
                    );
                }
            }
        }
        for (index, slot) in self.slots.iter().enumerate() {
            if slot.triangles.is_empty() {
                continue;
            }
            let record = GeometryRecord {
                triangles: rec.arena().push(&slot.triangles)?,
                vertices,
                instance: NO_INSTANCE,
                kind: slot.kind.index(),
            };
            let mask = mask(slot.seen, slot.kind);
            place(
                Part::Slot(index),
                Mat3::IDENTITY,
                Vec3::ZERO,
                mask,
                slot.kind,
                record,
            );
        }
        output.geometries = rec.arena().push(&records)?;
        match &mut self.driver {
            Some(driver) => {
                driver.build(rec, &self.slots, &self.positions, &placed)?;
                output.scene = driver.tlas.index();
            }
            None => {
                (output.nodes, output.placed) =
                    build_own(rec, &self.slots, &self.positions, &placed)?;
            }
        }
        Ok(output)
    }

    /// Sorts the view's meshes into slots and moves their vertices to world space.
    fn collect(&mut self, view: &ViewScene, materials: &dyn MaterialTable) {
        for slot in &mut self.slots {
            slot.triangles.clear();
            slot.indices.clear();
        }
        self.positions.clear();
        self.positions
            .extend(view.vertices.iter().map(|v| v.position));
        self.used.clear();
        self.used.resize(view.vertices.len(), false);
        // in drawing order, so that of two translucent layers in one plane the later primitive is drawn later
        let mut order: Vec<(f32, u32, usize)> = Vec::with_capacity(view.meshes.len());
        for (index, mesh) in view.meshes.iter().enumerate() {
            let (_, info) = materials.info(mesh.material);
            order.push((info.sort, info.order, index));
        }
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        for (_, _, index) in order {
            if let Some(mesh) = view.meshes.get(index) {
                self.add_mesh(view, mesh, materials);
            }
        }
    }

    fn add_mesh(&mut self, view: &ViewScene, mesh: &DynamicMesh, materials: &dyn MaterialTable) {
        let (material, info) = materials.info(mesh.material);
        let Some(instance) = view.instances.get(mesh.instance as usize) else {
            return;
        };
        let Some(kind) = Kind::of(info.flags) else {
            return;
        };
        let seen = Seen::of(instance.flags);
        let slot = self
            .slots
            .iter_mut()
            .find(|s| s.seen == seen && s.kind == kind);
        let Some(slot) = slot else {
            return;
        };
        let first = mesh.first_vertex as usize;
        let range = first..first.saturating_add(mesh.vertex_count as usize);
        let axis = Mat3::from_cols(instance.axis[0], instance.axis[1], instance.axis[2]);
        if let (Some(positions), Some(used)) = (
            self.positions.get_mut(range.clone()),
            self.used.get_mut(range),
        ) {
            for (position, used) in positions.iter_mut().zip(used) {
                // two meshes of one entity may share vertices
                if !std::mem::replace(used, true) {
                    *position = axis * *position + instance.origin;
                }
            }
        }
        // what is baked into the world's own vertices is not part of the material
        let world = if mesh.world_surface.is_some() {
            c::TRIANGLE_WORLD
        } else {
            0
        };
        let first = mesh.first_index as usize;
        let range = first..first.saturating_add(mesh.index_count as usize);
        for corner in view.indices.get(range).unwrap_or_default().chunks_exact(3) {
            let indices = [corner[0], corner[1], corner[2]];
            if indices.iter().any(|&i| i as usize >= view.vertices.len()) {
                continue;
            }
            slot.indices.push(indices);
            slot.triangles.push(Triangle {
                indices,
                material,
                instance: mesh.instance,
                fog: mesh.fog,
                lightmap: c::NO_TEXTURE,
                flags: world | rank_bits(&info),
            });
        }
    }
}

impl DriverStructures {
    /// Builds the bottom level of what moves in one batch, then the top level.
    fn build(
        &mut self,
        rec: &mut Recorder,
        slots: &[Slot],
        positions: &[Vec3],
        placed: &[Placement<'_>],
    ) -> Result<(), Error> {
        let vertex_address = rec.arena().push(positions)?;
        let mut geometries = Vec::with_capacity(slots.len());
        for slot in slots {
            geometries.push([BlasGeometry {
                vertex_address,
                vertex_stride: size_of::<Vec3>() as u64,
                max_vertex: u32::try_from(positions.len().saturating_sub(1)).unwrap_or(u32::MAX),
                index_address: rec.arena().push(&slot.indices)?,
                triangle_count: u32::try_from(slot.triangles.len()).unwrap_or(u32::MAX),
                opaque: matches!(slot.kind, Kind::Opaque | Kind::Sky),
                no_duplicate_any_hit: slot.kind == Kind::Translucent,
            }]);
        }
        let mut pass = rec.pass("trace_accel", Access::ACCEL_BUILD, Access::ACCEL_BUILD)?;
        let mut builds: Vec<BlasBuild<'_>> = (self.slots.iter_mut().zip(&geometries))
            .filter(|(_, geometries)| geometries[0].triangle_count > 0)
            .map(|(blas, geometries)| BlasBuild { blas, geometries })
            .collect();
        if !builds.is_empty() {
            pass.build_blas(&mut builds)?;
            pass.barrier();
        }
        let instances: Vec<gpu::Instance> = placed
            .iter()
            .map(|p| gpu::Instance {
                transform: rows(p.axis, p.origin),
                custom_index: p.record,
                mask: p.mask,
                sbt_offset: hit_group(p.kind),
                cull_disable: true,
                flip_facing: false,
                force_opaque: None,
                blas: match &p.part {
                    Part::Static(part) => match &part.structure {
                        Structure::Driver(blas) => blas.address(),
                        Structure::Own(_) => 0,
                    },
                    Part::Slot(index) => self.slots.get(*index).map_or(0, Blas::address),
                },
            })
            .collect();
        pass.build_tlas(&mut self.tlas, &instances)
    }
}

/// Builds our own hierarchies of what moves and the one over everything; their addresses in the frame's memory.
fn build_own(
    rec: &mut Recorder,
    slots: &[Slot],
    positions: &[Vec3],
    placed: &[Placement<'_>],
) -> Result<(u64, u64), Error> {
    let mut instances = Vec::with_capacity(placed.len());
    let mut boxes = Vec::with_capacity(placed.len());
    let position = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::NAN);
    for p in placed {
        let (nodes, triangles, bounds) = match &p.part {
            Part::Static(part) => match &part.structure {
                Structure::Own(own) => (own.nodes.address(), own.triangles.address(), own.bounds),
                Structure::Driver(_) => continue,
            },
            Part::Slot(index) => {
                let indices = slots.get(*index).map_or(&[][..], |s| &s.indices);
                let corners: Vec<[Vec3; 3]> = indices.iter().map(|t| t.map(position)).collect();
                let Some(hierarchy) = build_triangles(&corners) else {
                    continue;
                };
                let nodes = rec.arena().push(&hierarchy.nodes)?;
                (
                    nodes,
                    rec.arena().push(&hierarchy.triangles)?,
                    hierarchy.bounds,
                )
            }
        };
        // flattened to nothing it is not to be seen
        if p.axis.determinant().abs() < 1.0e-12 {
            continue;
        }
        let inverse = p.axis.inverse();
        boxes.push(
            bounds
                .corners()
                .iter()
                .fold(Aabb::EMPTY, |b, &c| b.with(p.axis * c + p.origin)),
        );
        instances.push(BvhInstance {
            nodes,
            triangles,
            to_object: rows(inverse, -(inverse * p.origin)),
            geometry: p.record,
            mask: u32::from(p.mask),
            kind: p.kind.index(),
            padding: 0,
        });
    }
    let top = build(&boxes);
    if top.nodes.is_empty() {
        return Ok((0, 0));
    }
    let ordered: Vec<BvhInstance> = top
        .order
        .iter()
        .filter_map(|&i| instances.get(i as usize).copied())
        .collect();
    Ok((rec.arena().push(&top.nodes)?, rec.arena().push(&ordered)?))
}

/// Rows of the matrix that places an entity.
fn rows(axis: Mat3, o: Vec3) -> [[f32; 4]; 3] {
    let (x, y, z) = (axis.x_axis, axis.y_axis, axis.z_axis);
    [
        [x.x, y.x, z.x, o.x],
        [x.y, y.y, z.y, o.y],
        [x.z, y.z, z.z, o.z],
    ]
}
