//! Bottom-level structures of moving geometry, kept between frames.
//!
//! A part of constant shape (a weapon, an item) has one structure ([`rigid`]), shared by all entities that show it. A
//! part whose vertices move (between key frames, by bones, by deformation) keeps its triangles, and its structure is
//! refitted to the vertices ([`animated`]). Parts that are out of view for long are dropped.

mod animated;
mod rigid;

use std::collections::HashMap;

use shaders::types::constants as c;
use shaders::types::{Triangle, Vertex};
use support::{Aabb, parallel, slice};

use super::part_mesh::{MeshPart, members};
use super::parts::{Part, Parts, ShapeMesh, SkinMesh};
use super::tracer::Tracer;
use crate::gpu::{BlasBuild, Buffer, BufferUsage, CompactedSizes, Device, Error, Pass, Recorder};
use crate::scene::TracedScene;

use animated::{AnimatedShape, PoseKey};
use rigid::RigidShape;

/// Number of frames out of view after which a structure is dropped.
const KEPT: u64 = 1000;
/// Most hierarchies that wait in memory for their way to the device.
const FITTED: usize = 1024;

/// A part's bottom-level structure, as the top level refers to it.
#[derive(Clone, Copy, Debug)]
pub enum Bottom {
    /// Address of the driver's structure.
    Driver(u64),
    /// Our hierarchy.
    Own(OwnBottom),
}

/// A hierarchy of ours on the GPU.
#[derive(Clone, Copy, Debug)]
pub struct OwnBottom {
    /// Address of the nodes.
    pub nodes: u64,
    /// Address of the triangles.
    pub triangles: u64,
    /// Bounds of all triangles, in the space of the instance.
    pub bounds: Aabb,
}

/// Triangle records of a skin.
struct Skin {
    seen: u64,
    /// Version of the triangles that it was made for.
    version: u64,
    count: u32,
    triangles: Buffer,
}

/// A part that is ready for the top level.
#[derive(Clone, Copy, Debug)]
pub struct Prepared {
    /// Address of its `Vertex`es.
    pub vertices: u64,
    /// Address of its `Triangle`s.
    pub triangles: u64,
    /// Number of them.
    pub count: u32,
    /// An animated part's pose.
    pose: PoseKey,
}

/// How a view uses an animated part.
#[derive(Clone, Copy, Debug)]
pub struct Use {
    /// Number of its body; `None`: the part is not followed over frames.
    pub body: Option<u32>,
    /// Its structure must have this frame's shape.
    pub refit: bool,
}

/// Bytes of the structures, by use.
#[cfg(test)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShapeMemory {
    /// Parts of constant shape: structures, vertices and indices.
    pub rigid: u64,
    /// Refitted structures.
    pub animated: u64,
    /// Triangle records.
    pub skins: u64,
}

/// The kept structures.
pub struct Shapes {
    device: Device,
    tracer: Tracer,
    frame: u64,
    versions: u64,
    rigid: HashMap<Box<[ShapeMesh]>, RigidShape>,
    animated: HashMap<Box<[ShapeMesh]>, AnimatedShape>,
    skins: HashMap<Box<[SkinMesh]>, Skin>,
    /// Structures with pending queries of their compacted sizes.
    asked: Vec<(CompactedSizes, Vec<Box<[ShapeMesh]>>)>,
    /// Number of refits and builds of animated parts, over all frames.
    refits: u64,
}

impl Shapes {
    /// An empty store.
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
            refits: 0,
        }
    }

    /// Begins a view; drops what has been out of view for long.
    pub fn begin_view(&mut self) {
        self.frame += 1;
        for shape in self.animated.values_mut() {
            shape.begin_view(self.frame);
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
            shape.drop_poses(fresh);
        }
    }

    /// Number of refits and builds of animated parts, over all frames.
    pub fn refits(&self) -> u64 {
        self.refits
    }

    /// Number of kept shapes: of constant shape, and refitted structures.
    #[cfg(test)]
    pub fn counts(&self) -> [usize; 2] {
        let poses = self.animated.values().map(AnimatedShape::pose_count).sum();
        [self.rigid.len(), poses]
    }

    /// Bytes on the device.
    #[cfg(test)]
    pub fn memory(&self) -> ShapeMemory {
        ShapeMemory {
            rigid: self.rigid.values().map(RigidShape::size).sum(),
            animated: self.animated.values().map(AnimatedShape::size).sum(),
            skins: self.skins.values().map(|s| s.triangles.size()).sum(),
        }
    }

    /// Makes a part's structure and triangle records if they are missing. `vertices`: device address of the view's
    /// vertices.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        view: &TracedScene,
        parts: &Parts,
        part: &Part,
        vertices: u64,
        used: Use,
    ) -> Result<Prepared, Error> {
        let meshes = members(view, parts, part);
        let key = slice::part(&parts.shapes, part.members.clone());
        let (address, pose, version) = if part.animated {
            let vertices = vertices + (part.vertices.start * size_of::<Vertex>()) as u64;
            let (pose, version) =
                self.prepare_animated(view, part, (key, used), &meshes, vertices)?;
            (vertices, pose, version)
        } else {
            (
                self.prepare_rigid(part, key, &meshes)?,
                PoseKey::default(),
                0,
            )
        };
        let skin = slice::part(&parts.skins, part.members.clone());
        let (triangles, count) = self.prepare_skin(skin, &meshes, version)?;
        Ok(Prepared {
            vertices: address,
            triangles,
            count,
            pose,
        })
    }

    /// Fits our own hierarchies of animated parts to this frame's vertices, on all cores.
    ///
    /// # Errors
    /// Out of memory.
    pub fn fit(&mut self, rec: &mut Recorder, view: &TracedScene) -> Result<(), Error> {
        let shapes = self.animated.values_mut();
        let mut due: Vec<_> = shapes.flat_map(AnimatedShape::due).collect();
        while !due.is_empty() {
            let mut some = due.split_off(due.len().saturating_sub(FITTED));
            parallel::each(&mut some, |fit| fit.compute(&view.vertices));
            for fit in some {
                fit.store(rec, &self.device)?;
            }
        }
        Ok(())
    }

    /// A part's structure for the top level, after [`fit`](Self::fit) and [`build`](Self::build).
    pub fn bottom(&self, parts: &Parts, part: &Part, prepared: &Prepared) -> Option<Bottom> {
        let key = parts.shapes.get(part.members.clone())?;
        if part.animated {
            self.animated.get(key)?.bottom(prepared.pose)
        } else {
            self.rigid.get(key)?.bottom()
        }
    }

    /// Whether [`build`](Self::build) has anything to do.
    pub fn has_work(&self) -> bool {
        !self.asked.is_empty()
            || self.rigid.values().any(RigidShape::has_work)
            || self.animated.values().any(AnimatedShape::has_work)
    }

    /// Builds new structures and refits moved ones, together with `changing`, in one batch.
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
            if let Some(build) = shape.pending() {
                fresh.push(key.clone());
                builds.push(build);
            }
        }
        for shape in self.animated.values_mut() {
            builds.extend(shape.pending());
        }
        if builds.is_empty() {
            return Ok(());
        }
        pass.build_blas(&mut builds)?;
        drop(builds);
        for shape in self.animated.values_mut() {
            shape.settle();
        }
        if !fresh.is_empty() {
            for shape in self.rigid.values_mut() {
                shape.settle();
            }
            let built = fresh.iter().filter_map(|key| self.rigid.get(key)?.blas());
            let built: Vec<_> = built.collect();
            let sizes = pass.ask_compacted_sizes(&built)?;
            self.asked.push((sizes, fresh));
        }
        pass.barrier();
        Ok(())
    }

    /// Compacts structures whose compacted sizes have been read back.
    fn compact(&mut self, pass: &mut Pass<'_>) -> Result<(), Error> {
        let mut waiting = Vec::new();
        for (asked, keys) in std::mem::take(&mut self.asked) {
            let Some(sizes) = asked.sizes()? else {
                waiting.push((asked, keys));
                continue;
            };
            for (key, size) in keys.iter().zip(sizes) {
                // the shape may have been dropped, and made again: the new one is not built yet
                if let Some(shape) = self.rigid.get_mut(key) {
                    shape.compact(pass, size)?;
                }
            }
        }
        self.asked = waiting;
        Ok(())
    }

    /// Address of the vertices.
    fn prepare_rigid(
        &mut self,
        part: &Part,
        key: &[ShapeMesh],
        meshes: &[MeshPart<'_>],
    ) -> Result<u64, Error> {
        if let Some(shape) = self.rigid.get_mut(key) {
            shape.seen = self.frame;
            return Ok(shape.vertices());
        }
        let shape = RigidShape::new(&self.device, self.tracer, part.kind, meshes, self.frame)?;
        let vertices = shape.vertices();
        self.rigid.insert(key.into(), shape);
        Ok(vertices)
    }

    /// The shape's pose, and the version of its triangles.
    fn prepare_animated(
        &mut self,
        view: &TracedScene,
        part: &Part,
        (key, used): (&[ShapeMesh], Use),
        meshes: &[MeshPart<'_>],
        vertices: u64,
    ) -> Result<(PoseKey, u64), Error> {
        let same = (self.animated.get(key)).is_some_and(|shape| shape.has_triangles_of(meshes));
        if !same {
            self.versions += 1;
            let old = self.animated.remove(key);
            let (device, tracer) = (&self.device, self.tracer);
            let shape = AnimatedShape::new(device, tracer, meshes, self.versions, old)?;
            self.animated.insert(key.into(), shape);
        }
        let Some(shape) = self.animated.get_mut(key) else {
            return Ok((PoseKey::default(), 0)); // just inserted
        };
        shape.seen = self.frame;
        let pose = shape.take_pose(
            &self.device,
            (part.kind, used),
            (&view.vertices, part.vertices.clone()),
            vertices,
            &mut self.refits,
        );
        Ok((pose, shape.version()))
    }

    /// Address of the triangle records.
    fn prepare_skin(
        &mut self,
        key: &[SkinMesh],
        meshes: &[MeshPart<'_>],
        version: u64,
    ) -> Result<(u64, u32), Error> {
        let found = |skin: &Skin| (skin.triangles.address(), skin.count);
        if let Some(skin) = self.skins.get_mut(key)
            && skin.version == version
        {
            skin.seen = self.frame;
            return Ok(found(skin));
        }
        let mut triangles = Vec::new();
        let mut vertices = 0;
        for (mesh, skin) in meshes.iter().zip(key) {
            vertices += mesh.mesh.vertices.len();
            let end = mesh.offset as usize + mesh.mesh.vertices.len();
            let exists = |indices: &[u32; 3]| indices.iter().all(|&i| (i as usize) < end);
            triangles.extend(mesh.triangles().map(|indices| Triangle {
                // no ray hits a triangle without its vertices, but it may be drawn
                indices: if exists(&indices) { indices } else { [0; 3] },
                material: skin.material,
                // the geometry record holds the instance
                instance: 0,
                fog: skin.fog,
                lightmap: c::NO_TEXTURE,
                flags: skin.flags,
            }));
        }
        let storage = BufferUsage::STORAGE;
        let buffer = Buffer::with_data(&self.device, "trace skin", storage, &triangles)?;
        let skin = Skin {
            seen: self.frame,
            version,
            count: match vertices {
                0 => 0,
                _ => u32::try_from(triangles.len()).unwrap_or(u32::MAX),
            },
            triangles: buffer,
        };
        let made = found(&skin);
        self.skins.insert(key.into(), skin);
        Ok(made)
    }
}
