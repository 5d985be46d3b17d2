//! The acceleration structures of a frame: what moves, and the top level over everything.
//!
//! Meshes that move come with vertices in the space of their entity. For the build they are transformed into world
//! space on the CPU; the hit shading reads the untransformed ones. All meshes that a ray treats alike go into one
//! bottom-level structure, so a frame builds at most twelve of them, in one batch.

use glam::{Mat3, Vec3};
use shaders::trace_types::GeometryRecord;
use shaders::trace_types::constants::{
    MASK_FIRST_SOLID, MASK_FIRST_TRANSLUCENT, MASK_NO_SHADOW, MASK_SKY, MASK_SOLID,
    MASK_THIRD_SOLID, MASK_THIRD_TRANSLUCENT, MASK_TRANSLUCENT, NO_INSTANCE,
};
use shaders::types::constants as c;
use shaders::types::{Instance, Triangle};

use super::geometry::{StaticGeometry, rank_bits};
use super::input::{Kind, MaterialTable};
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

/// One bottom-level structure for meshes that move.
struct Slot {
    seen: Seen,
    kind: Kind,
    blas: Blas,
    triangles: Vec<Triangle>,
    indices: Vec<[u32; 3]>,
}

/// What a frame's rays are traced against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccelOutput {
    /// Bindless index of the top-level structure.
    pub scene: u32,
    /// Device address of the `GeometryRecord`s.
    pub geometries: u64,
    /// Device address of the view's `Instance`s.
    pub instances: u64,
    /// There is something that only the eye sees.
    pub first_person: bool,
}

/// Builds the structures of each frame in storage that stays.
pub struct Accel {
    slots: Vec<Slot>,
    tlas: Tlas,
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
    pub fn new(device: &Device) -> Self {
        let flags = BlasFlags {
            fast_build: true,
            ..BlasFlags::default()
        };
        let mut slots = Vec::new();
        for seen in SEEN {
            for kind in KINDS {
                slots.push(Slot {
                    seen,
                    kind,
                    blas: Blas::new(device, &format!("trace {seen:?} {kind:?}"), flags),
                    triangles: Vec::new(),
                    indices: Vec::new(),
                });
            }
        }
        Self {
            slots,
            tlas: Tlas::new(device, "trace scene"),
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
        let vertex_address = rec.arena().push(&view.vertices)?;
        let instance_address = rec.arena().push(&view.instances)?;
        let position_address = rec.arena().push(&self.positions)?;

        let mut records: Vec<GeometryRecord> = Vec::new();
        let mut placed: Vec<gpu::Instance> = Vec::new();
        let custom_index =
            |records: &Vec<GeometryRecord>| u32::try_from(records.len()).unwrap_or(0);

        if let Some(geometry) = geometry {
            let submodels = view.submodels.iter().map(|s| (s.model, s.instance));
            for (model, instance_index) in std::iter::once((0, 0)).chain(submodels) {
                let Some(instance) = view.instances.get(instance_index as usize) else {
                    continue;
                };
                for part in geometry.structures.iter().filter(|s| s.model == model) {
                    placed.push(gpu::Instance {
                        transform: transform(instance),
                        custom_index: custom_index(&records),
                        mask: mask(Seen::Always, part.kind),
                        sbt_offset: hit_group(part.kind),
                        cull_disable: true,
                        flip_facing: false,
                        force_opaque: None,
                        blas: part.blas.address(),
                    });
                    records.push(GeometryRecord {
                        triangles: part.triangles,
                        vertices: geometry.vertices,
                        instance: instance_index,
                        kind: part.kind.index(),
                    });
                }
            }
        }

        let mut geometries = Vec::new();
        for slot in self.slots.iter().filter(|s| !s.triangles.is_empty()) {
            let triangles = rec.arena().push(&slot.triangles)?;
            let index_address = rec.arena().push(&slot.indices)?;
            records.push(GeometryRecord {
                triangles,
                vertices: vertex_address,
                instance: NO_INSTANCE,
                kind: slot.kind.index(),
            });
            geometries.push([BlasGeometry {
                vertex_address: position_address,
                vertex_stride: size_of::<Vec3>() as u64,
                max_vertex: u32::try_from(self.positions.len().saturating_sub(1))
                    .unwrap_or(u32::MAX),
                index_address,
                triangle_count: u32::try_from(slot.triangles.len()).unwrap_or(u32::MAX),
                opaque: matches!(slot.kind, Kind::Opaque | Kind::Sky),
                no_duplicate_any_hit: slot.kind == Kind::Translucent,
            }]);
        }
        let first_dynamic = records.len() - geometries.len();
        let geometry_address = rec.arena().push(&records)?;

        let mut pass = rec.pass("trace_accel", Access::ACCEL_BUILD, Access::ACCEL_BUILD)?;
        let active = self.slots.iter_mut().filter(|s| !s.triangles.is_empty());
        let mut builds: Vec<BlasBuild<'_>> = active
            .zip(&geometries)
            .map(|(slot, geometries)| BlasBuild {
                blas: &mut slot.blas,
                geometries,
            })
            .collect();
        if !builds.is_empty() {
            pass.build_blas(&mut builds)?;
            pass.barrier();
        }
        let active = self.slots.iter().filter(|s| !s.triangles.is_empty());
        for (slot, index) in active.zip(first_dynamic..) {
            placed.push(gpu::Instance {
                transform: IDENTITY,
                custom_index: u32::try_from(index).unwrap_or(0),
                mask: mask(slot.seen, slot.kind),
                sbt_offset: hit_group(slot.kind),
                cull_disable: true,
                flip_facing: false,
                force_opaque: None,
                blas: slot.blas.address(),
            });
        }
        pass.build_tlas(&mut self.tlas, &placed)?;
        drop(pass);
        Ok(AccelOutput {
            scene: self.tlas.index(),
            geometries: geometry_address,
            instances: instance_address,
            first_person: self.slots.iter().any(|s| {
                s.seen == Seen::FirstPerson
                    && s.kind != Kind::Translucent
                    && !s.triangles.is_empty()
            }),
        })
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

const IDENTITY: [[f32; 4]; 3] = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];

/// Rows of the matrix that places an entity.
fn transform(instance: &Instance) -> [[f32; 4]; 3] {
    let [x, y, z] = instance.axis;
    let o = instance.origin;
    [
        [x.x, y.x, z.x, o.x],
        [x.y, y.y, z.y, o.y],
        [x.z, y.z, z.z, o.z],
    ]
}
