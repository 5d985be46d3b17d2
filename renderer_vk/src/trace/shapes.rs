//! Bottom-level structures of what moves, kept from frame to frame.
//!
//! A part that keeps its shape (a weapon, an item) has one structure, built and compacted once, however many entities
//! show it. A part whose vertices move (between key frames, by bones, by deformation) keeps its triangles: its structure
//! is fitted to the new positions each frame, and built anew when that has made it bad. Of several entities of one model
//! each has its own, by turns. What is not seen for a while is dropped.
//!
//! When a fitted structure is bad: our own hierarchies know what a ray costs in them, and are built anew once that is
//! [`WORSE`] times what it was. The driver does not tell; its structures are built anew after [`REFITS`] frames, and at
//! once when the box of all triangles has [`GROWN`] times the surface it had, or as much less.

use std::collections::HashMap;

use glam::Vec3;
use shaders::types::constants as c;
use shaders::types::{Triangle, Vertex};

use super::bvh::{self, Aabb, Hierarchy, build, build_triangles};
use super::input::{Kind, Tracer};
use super::part_mesh::{MeshPart, geometry, is_same, members, part_corners, part_indices};
use super::parts::{Part, Parts, ShapeMesh, SkinMesh};
use super::wide_bvh::widen;
use crate::gpu::{
    Blas, BlasBuild, BlasFlags, BlasGeometry, Buffer, BufferUsage, CompactedSizes, Device, Error,
    Pass, Recorder,
};
use crate::scene::ViewScene;

/// Frames after which what was not seen is dropped.
const KEPT: u64 = 1000;
/// How much more a ray may cost in a fitted hierarchy of ours.
const WORSE: f32 = 1.5;
/// How often a structure of the driver is fitted before it is built anew.
const REFITS: u32 = 60;
/// How much the surface of the box around a structure of the driver may change.
const GROWN: f32 = 2.0;

/// What stands for a part in the top level.
#[derive(Clone, Copy, Debug)]
pub enum Bottom {
    /// The driver's structure, by its address.
    Driver(u64),
    /// Ours.
    Own(OwnBottom),
}

/// A hierarchy of ours on the GPU.
#[derive(Clone, Copy, Debug)]
pub struct OwnBottom {
    /// Address of the nodes.
    pub nodes: u64,
    /// Address of the triangles.
    pub triangles: u64,
    /// Of all triangles, in the space of the instance.
    pub bounds: Aabb,
}

/// A shape that stays.
struct RigidShape {
    /// Number of the frame that showed it last.
    seen: u64,
    /// Vertices, then the driver's indices, or our nodes and triangles.
    data: Buffer,
    bottom: RigidBottom,
}

enum RigidBottom {
    Driver {
        blas: Blas,
        /// Until it is built.
        pending: Option<[BlasGeometry; 1]>,
    },
    /// `None`: no triangle that a ray could hit.
    Own(Option<OwnBottom>),
}

/// Triangles that stay, of parts whose vertices move.
struct AnimatedShape {
    seen: u64,
    /// Another number whenever the triangles have become others.
    version: u64,
    indices: Vec<[u32; 3]>,
    /// The same for the driver.
    index_buffer: Option<Buffer>,
    /// One for each part of the shape in a view.
    poses: Vec<Pose>,
    /// Poses taken in this view.
    taken: usize,
}

/// A structure that is fitted.
struct Pose {
    seen: u64,
    bottom: PoseBottom,
}

enum PoseBottom {
    Driver {
        blas: Blas,
        /// Surface of the box when it was built.
        area: f32,
        refits: u32,
        /// To be built (or fitted) in this frame.
        pending: Option<([BlasGeometry; 1], bool)>,
    },
    Own {
        hierarchy: Hierarchy,
        /// When it was built.
        cost: f32,
        bottom: Option<OwnBottom>,
    },
}

/// Triangle records of a skin.
struct Skin {
    seen: u64,
    /// Of the triangles that it was made for.
    version: u64,
    triangles: Buffer,
}

/// A part ready to be placed.
#[derive(Clone, Copy, Debug)]
pub struct Prepared {
    /// Address of its `Vertex`es.
    pub vertices: u64,
    /// Address of its `Triangle`s.
    pub triangles: u64,
    /// Of an animated part, which of its shape's poses.
    pose: usize,
}

/// Bytes of the structures by what they are for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShapeMemory {
    /// Of shapes that stay: structures, vertices and indices.
    pub rigid: u64,
    /// Of what is fitted each frame.
    pub animated: u64,
    /// Of triangle records.
    pub skins: u64,
}

/// The structures that are kept.
pub struct Shapes {
    device: Device,
    tracer: Tracer,
    frame: u64,
    versions: u64,
    rigid: HashMap<Box<[ShapeMesh]>, RigidShape>,
    animated: HashMap<Box<[ShapeMesh]>, AnimatedShape>,
    skins: HashMap<Box<[SkinMesh]>, Skin>,
    /// Structures whose compacted size the GPU was asked for.
    asked: Vec<(CompactedSizes, Vec<Box<[ShapeMesh]>>)>,
    boxes: Vec<Aabb>,
    corners: Vec<[Vec3; 3]>,
}

impl Shapes {
    /// None yet.
    pub fn new(device: &Device, tracer: Tracer) -> Self {
        Self {
            device: device.clone(),
            tracer,
            frame: 0,
            versions: 0,
            rigid: HashMap::new(),
            animated: HashMap::new(),
            skins: HashMap::new(),
            asked: Vec::new(),
            boxes: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// Another view begins; what was not seen for long is dropped.
    pub fn begin_view(&mut self) {
        self.frame += 1;
        for shape in self.animated.values_mut() {
            shape.taken = 0;
        }
        if !self.frame.is_multiple_of(KEPT / 4) {
            return;
        }
        let frame = self.frame;
        let fresh = |seen: u64| frame - seen <= KEPT;
        self.rigid.retain(|_, shape| fresh(shape.seen));
        self.skins.retain(|_, skin| fresh(skin.seen));
        self.animated.retain(|_, shape| fresh(shape.seen));
        for shape in self.animated.values_mut() {
            // they are taken in order, so the last ones are those that rest
            while shape.poses.last().is_some_and(|pose| !fresh(pose.seen)) {
                shape.poses.pop();
            }
        }
    }

    /// How many shapes are kept: those that stay, and structures that are fitted.
    pub fn counts(&self) -> [usize; 2] {
        let poses = self.animated.values().map(|s| s.poses.len()).sum();
        [self.rigid.len(), poses]
    }

    /// Bytes on the device.
    pub fn memory(&self) -> ShapeMemory {
        let rigid = |shape: &RigidShape| {
            shape.data.size()
                + match &shape.bottom {
                    RigidBottom::Driver { blas, .. } => blas.size(),
                    RigidBottom::Own(_) => 0,
                }
        };
        let pose = |pose: &Pose| match &pose.bottom {
            PoseBottom::Driver { blas, .. } => blas.size(),
            PoseBottom::Own { hierarchy, .. } => {
                (size_of_val(hierarchy.nodes.as_slice())
                    + hierarchy.order.len() * size_of::<shaders::trace_types::BvhTriangle>())
                    as u64
            }
        };
        let animated = |shape: &AnimatedShape| {
            shape.index_buffer.as_ref().map_or(0, Buffer::size)
                + shape.poses.iter().map(pose).sum::<u64>()
        };
        ShapeMemory {
            rigid: self.rigid.values().map(rigid).sum(),
            animated: self.animated.values().map(animated).sum(),
            skins: self.skins.values().map(|s| s.triangles.size()).sum(),
        }
    }

    /// Sees to it that a part has its structure and its triangle records. `vertices`: device address of the view's.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        rec: &mut Recorder,
        view: &ViewScene,
        parts: &Parts,
        part: &Part,
        vertices: u64,
    ) -> Result<Prepared, Error> {
        let meshes = members(view, parts, part);
        let key = parts.shapes.get(part.members.clone()).unwrap_or_default();
        let (address, pose, version) = if part.animated {
            let vertices = vertices + (part.vertices.start * size_of::<Vertex>()) as u64;
            let (pose, version) = self.prepare_animated(rec, view, part, key, &meshes, vertices)?;
            (vertices, pose, version)
        } else {
            (self.prepare_rigid(part.kind, key, &meshes)?, 0, 0)
        };
        let skin = parts.skins.get(part.members.clone()).unwrap_or_default();
        Ok(Prepared {
            vertices: address,
            triangles: self.prepare_skin(skin, &meshes, version)?,
            pose,
        })
    }

    /// What to place for a part, after [`build`](Self::build).
    pub fn bottom(&self, parts: &Parts, part: &Part, prepared: &Prepared) -> Option<Bottom> {
        let key = parts.shapes.get(part.members.clone())?;
        if part.animated {
            match &self.animated.get(key)?.poses.get(prepared.pose)?.bottom {
                PoseBottom::Driver { blas, .. } => Some(Bottom::Driver(blas.address())),
                PoseBottom::Own { bottom, .. } => bottom.map(Bottom::Own),
            }
        } else {
            match &self.rigid.get(key)?.bottom {
                RigidBottom::Driver { blas, .. } => Some(Bottom::Driver(blas.address())),
                RigidBottom::Own(bottom) => bottom.map(Bottom::Own),
            }
        }
    }

    /// Whether [`build`](Self::build) has anything to do.
    pub fn has_work(&self) -> bool {
        let rigid = |shape: &RigidShape| {
            let RigidBottom::Driver { pending, .. } = &shape.bottom else {
                return false;
            };
            pending.is_some()
        };
        let pose = |pose: &Pose| {
            let PoseBottom::Driver { pending, .. } = &pose.bottom else {
                return false;
            };
            pending.is_some()
        };
        let mut poses = self.animated.values().flat_map(|s| &s.poses);
        !self.asked.is_empty() || self.rigid.values().any(rigid) || poses.any(pose)
    }

    /// Builds what is new and fits what has moved, together with `changing`, in one batch.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn build(
        &mut self,
        pass: &mut Pass<'_>,
        changing: Vec<BlasBuild<'_>>,
    ) -> Result<(), Error> {
        self.compact(pass)?;
        let mut fresh = Vec::new();
        let mut builds = changing;
        for (key, shape) in &mut self.rigid {
            if let RigidBottom::Driver {
                blas,
                pending: Some(geometries),
            } = &mut shape.bottom
            {
                fresh.push(key.clone());
                builds.push(BlasBuild {
                    blas,
                    geometries,
                    refit: false,
                });
            }
        }
        for pose in self.animated.values_mut().flat_map(|s| &mut s.poses) {
            if let PoseBottom::Driver {
                blas,
                pending: Some((geometries, refit)),
                ..
            } = &mut pose.bottom
            {
                builds.push(BlasBuild {
                    blas,
                    geometries,
                    refit: *refit,
                });
            }
        }
        if builds.is_empty() {
            return Ok(());
        }
        pass.build_blas(&mut builds)?;
        drop(builds);
        for pose in self.animated.values_mut().flat_map(|s| &mut s.poses) {
            if let PoseBottom::Driver { pending, .. } = &mut pose.bottom {
                *pending = None;
            }
        }
        if !fresh.is_empty() {
            let mut built = Vec::with_capacity(fresh.len());
            for shape in self.rigid.values_mut() {
                if let RigidBottom::Driver { pending, .. } = &mut shape.bottom {
                    *pending = None;
                }
            }
            for key in &fresh {
                if let Some(RigidBottom::Driver { blas, .. }) =
                    self.rigid.get(key).map(|shape| &shape.bottom)
                {
                    built.push(blas);
                }
            }
            let sizes = pass.ask_compacted_sizes(&built)?;
            self.asked.push((sizes, fresh));
        }
        pass.barrier();
        Ok(())
    }

    /// Compacts those whose sizes have arrived.
    fn compact(&mut self, pass: &mut Pass<'_>) -> Result<(), Error> {
        let mut waiting = Vec::new();
        for (asked, keys) in std::mem::take(&mut self.asked) {
            let Some(sizes) = asked.sizes()? else {
                waiting.push((asked, keys));
                continue;
            };
            for (key, size) in keys.iter().zip(sizes) {
                // dropped in the meantime, and perhaps made again: then it is another one that is not built yet
                if let Some(RigidBottom::Driver {
                    blas,
                    pending: None,
                }) = self.rigid.get_mut(key).map(|shape| &mut shape.bottom)
                    && size < blas.size()
                {
                    pass.compact_blas(blas, size)?;
                }
            }
        }
        self.asked = waiting;
        Ok(())
    }

    /// Address of the vertices.
    fn prepare_rigid(
        &mut self,
        kind: Kind,
        key: &[ShapeMesh],
        meshes: &[MeshPart<'_>],
    ) -> Result<u64, Error> {
        if let Some(shape) = self.rigid.get_mut(key) {
            shape.seen = self.frame;
            return Ok(shape.data.address());
        }
        let vertices: Vec<Vertex> = meshes
            .iter()
            .flat_map(|m| m.mesh.vertices)
            .copied()
            .collect();
        let indices = part_indices(meshes);
        let mut bytes: Vec<u8> = bytemuck::cast_slice(&vertices).to_vec();
        let mut append = |part: &[u8]| {
            bytes.resize(bytes.len().next_multiple_of(16), 0);
            let at = bytes.len() as u64;
            bytes.extend_from_slice(part);
            at
        };
        let name = "trace rigid";
        let input = BufferUsage::ACCEL_INPUT;
        let shape = if self.tracer == Tracer::Compute {
            let corners = part_corners(&vertices, &indices);
            let built = build_triangles(&corners);
            let places = built.as_ref().map(|h| {
                let nodes = append(bytemuck::cast_slice(&h.nodes));
                (nodes, append(bytemuck::cast_slice(&h.triangles)), h.bounds)
            });
            let data = Buffer::with_data(&self.device, name, BufferUsage::STORAGE, &bytes)?;
            let bottom = places.map(|(nodes, triangles, bounds)| OwnBottom {
                nodes: data.address() + nodes,
                triangles: data.address() + triangles,
                bounds,
            });
            RigidShape {
                seen: self.frame,
                data,
                bottom: RigidBottom::Own(bottom),
            }
        } else {
            let at = append(bytemuck::cast_slice(&indices));
            let data = Buffer::with_data(&self.device, name, input, &bytes)?;
            let geometry = geometry(
                kind,
                data.address(),
                vertices.len(),
                data.address() + at,
                indices.len(),
            );
            let flags = BlasFlags {
                compact: true,
                ..BlasFlags::default()
            };
            RigidShape {
                seen: self.frame,
                data,
                bottom: RigidBottom::Driver {
                    blas: Blas::new(&self.device, name, flags),
                    pending: Some([geometry]),
                },
            }
        };
        let address = shape.data.address();
        self.rigid.insert(key.into(), shape);
        Ok(address)
    }

    /// Which pose of the shape it is, and the version of its triangles.
    fn prepare_animated(
        &mut self,
        rec: &mut Recorder,
        view: &ViewScene,
        part: &Part,
        key: &[ShapeMesh],
        meshes: &[MeshPart<'_>],
        vertices: u64,
    ) -> Result<(usize, u64), Error> {
        let own = self.tracer == Tracer::Compute;
        let same = self
            .animated
            .get(key)
            .is_some_and(|shape| is_same(&shape.indices, meshes));
        if !same {
            let indices = part_indices(meshes);
            let index_buffer = if own {
                None
            } else {
                let name = "trace animated indices";
                let input = BufferUsage::ACCEL_INPUT;
                Some(Buffer::with_data(&self.device, name, input, &indices)?)
            };
            // of a deformation that makes other triangles each time the structures go on, their order does not
            let old = self.animated.remove(key);
            let (mut poses, taken) = old.map_or((Vec::new(), 0), |s| (s.poses, s.taken));
            for pose in &mut poses {
                pose.forget();
            }
            self.versions += 1;
            self.animated.insert(
                key.into(),
                AnimatedShape {
                    seen: self.frame,
                    version: self.versions,
                    indices,
                    index_buffer,
                    poses,
                    taken,
                },
            );
        }
        let Some(shape) = self.animated.get_mut(key) else {
            return Ok((0, 0)); // just inserted
        };
        shape.seen = self.frame;
        let index = shape.taken;
        shape.taken += 1;
        if shape.poses.len() <= index {
            shape.poses.push(Pose {
                seen: self.frame,
                bottom: if own {
                    PoseBottom::Own {
                        hierarchy: Hierarchy::default(),
                        cost: 0.0,
                        bottom: None,
                    }
                } else {
                    let flags = BlasFlags {
                        refit: true,
                        ..BlasFlags::default()
                    };
                    PoseBottom::Driver {
                        blas: Blas::new(&self.device, "trace animated", flags),
                        area: 0.0,
                        refits: 0,
                        pending: None,
                    }
                },
            });
        }
        let Some(pose) = shape.poses.get_mut(index) else {
            return Ok((index, shape.version)); // just pushed
        };
        pose.seen = self.frame;
        let used = view.vertices.get(part.vertices.clone()).unwrap_or_default();
        match &mut pose.bottom {
            PoseBottom::Driver {
                blas,
                area,
                refits,
                pending,
            } => {
                let bounds = used
                    .iter()
                    .fold(Aabb::EMPTY, |b, v| b.with(v.position))
                    .half_area();
                let fits = *refits < REFITS && bounds <= *area * GROWN && bounds * GROWN >= *area;
                let refit = fits && blas.address() != 0 && *area > 0.0;
                if refit {
                    *refits += 1;
                } else {
                    // entities that come into sight together are not all built anew together
                    *refits = u32::try_from(index).unwrap_or(0) % (REFITS / 2);
                    *area = bounds;
                }
                let at = shape.index_buffer.as_ref().map_or(0, Buffer::address);
                let triangles = shape.indices.len();
                let geometry = geometry(part.kind, vertices, used.len(), at, triangles);
                *pending = Some(([geometry], refit));
            }
            PoseBottom::Own {
                hierarchy,
                cost,
                bottom,
            } => {
                self.corners.clear();
                let position = |i: u32| used.get(i as usize).map_or(Vec3::NAN, |v| v.position);
                let corners = shape.indices.iter().map(|t| t.map(position));
                self.corners.extend(corners);
                self.boxes.clear();
                self.boxes.extend(self.corners.iter().map(bvh::box_of));
                *bottom = fit(hierarchy, cost, &self.boxes)
                    .map(|bounds| {
                        let triangles = bvh::ordered(hierarchy, &self.corners);
                        Ok::<_, Error>(OwnBottom {
                            nodes: rec.arena().push(&widen(hierarchy))?,
                            triangles: rec.arena().push(&triangles)?,
                            bounds,
                        })
                    })
                    .transpose()?;
            }
        }
        Ok((index, shape.version))
    }

    /// Address of the triangle records.
    fn prepare_skin(
        &mut self,
        key: &[SkinMesh],
        meshes: &[MeshPart<'_>],
        version: u64,
    ) -> Result<u64, Error> {
        if let Some(skin) = self.skins.get_mut(key)
            && skin.version == version
        {
            skin.seen = self.frame;
            return Ok(skin.triangles.address());
        }
        let mut triangles = Vec::new();
        for (mesh, skin) in meshes.iter().zip(key) {
            triangles.extend(mesh.triangles().map(|indices| Triangle {
                indices,
                material: skin.material,
                // the geometry's record names it
                instance: 0,
                fog: skin.fog,
                lightmap: c::NO_TEXTURE,
                flags: skin.flags,
            }));
        }
        let storage = BufferUsage::STORAGE;
        let buffer = Buffer::with_data(&self.device, "trace skin", storage, &triangles)?;
        let address = buffer.address();
        self.skins.insert(
            key.into(),
            Skin {
                seen: self.frame,
                version,
                triangles: buffer,
            },
        );
        Ok(address)
    }
}

impl Pose {
    /// Builds anew when it is used next: its triangles have become others.
    fn forget(&mut self) {
        match &mut self.bottom {
            PoseBottom::Driver { area, .. } => *area = 0.0,
            PoseBottom::Own { hierarchy, .. } => *hierarchy = Hierarchy::default(),
        }
    }
}

/// Fits a hierarchy to its entries, or builds it anew; the box of everything, if there is anything.
fn fit(hierarchy: &mut Hierarchy, cost: &mut f32, boxes: &[Aabb]) -> Option<Aabb> {
    if hierarchy.order.len() == boxes.len() && !boxes.is_empty() {
        let bounds = hierarchy.refit(boxes);
        if hierarchy.cost() <= *cost * WORSE {
            return Some(bounds);
        }
    }
    *hierarchy = build(boxes, bvh::LEAF);
    *cost = hierarchy.cost();
    (!hierarchy.nodes.is_empty()).then(|| hierarchy.bounds())
}
