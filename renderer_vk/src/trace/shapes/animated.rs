//! Shapes with moving vertices: triangles stay, and the structure is refitted to the new positions each frame, and
//! rebuilt when refits have degraded it. Several entities of one model have one structure each, assigned in order.
//!
//! Rebuilds: our own hierarchies compute their expected ray cost, and are rebuilt once it exceeds [`WORSE`] times its
//! initial value. The driver reports no cost; its structures are rebuilt after [`REFITS`] frames, and at once when the
//! surface area of the bounds has changed by the factor [`GROWN`] in either direction.
//!
//! With `rt_hitFeedback` an entity keeps its structure from frame to frame, and one that few rays meet is refitted only
//! every [`OMITTED`]th frame.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use shaders::trace_types::{BvhNode, BvhTriangle};
use shaders::types::Vertex;
use support::bvh::Hierarchy;
use support::{Aabb, slice};

use super::super::bvh::{TRIANGLES, ordered, widen};
use super::super::input::Kind;
use super::super::part_mesh::{MeshPart, geometry, is_same, part_indices};
use super::super::tracer::Tracer;
use super::{Bottom, OwnBottom, Use};
use crate::gpu::{
    Blas, BlasBuild, BlasFlags, BlasGeometry, Buffer, BufferUsage, Device, Error, Recorder,
};

/// Cost ratio at which our refitted hierarchy is rebuilt.
const WORSE: f32 = 1.5;
/// Number of refits after which a structure of the driver is rebuilt.
const REFITS: u32 = 60;
/// Ratio of the surface areas of the bounds at which a structure of the driver is rebuilt.
const GROWN: f32 = 2.0;
/// Frames between two refits of what few rays meet.
const OMITTED: u64 = 32;

/// Constant triangles of parts with moving vertices.
pub struct AnimatedShape {
    /// Number of the last frame that showed it.
    pub seen: u64,
    /// Changes whenever the triangles change.
    version: u64,
    indices: Arc<[[u32; 3]]>,
    /// The triangles as build input of the driver; `None` for our own hierarchies.
    index_buffer: Option<Buffer>,
    /// One for each part of this shape in a view.
    poses: Vec<Pose>,
    /// Number of poses used in this view.
    taken: usize,
    /// Those of bodies that are followed over frames.
    of_bodies: HashMap<u32, Pose>,
}

/// A pose of a shape.
#[derive(Clone, Copy, Debug)]
pub enum PoseKey {
    /// By its order in the view.
    Ordered(usize),
    /// By the number of its body.
    OfBody(u32),
}

impl Default for PoseKey {
    fn default() -> Self {
        Self::Ordered(0)
    }
}

/// A structure that is refitted.
struct Pose {
    seen: u64,
    bottom: PoseBottom,
}

enum PoseBottom {
    Driver {
        blas: Blas,
        /// Surface area of the bounds at the last build.
        area: f32,
        refits: u32,
        /// Geometry to be built in this frame; `true`: by a refit.
        pending: Option<([BlasGeometry; 1], bool)>,
    },
    Own(OwnPose),
}

/// A hierarchy of ours.
#[derive(Default)]
struct OwnPose {
    hierarchy: Hierarchy,
    /// Expected ray cost at the last build.
    cost: f32,
    bottom: Option<OwnBottom>,
    /// Nodes and triangles of `bottom`, if they last longer than a frame.
    kept: Option<Buffer>,
    /// What it is to be fitted to in this frame.
    due: Option<Due>,
}

/// What a hierarchy of ours is to be fitted to.
struct Due {
    /// The shape's triangles when it was taken: another entity of this view may replace them.
    indices: Arc<[[u32; 3]]>,
    /// The vertices of the view.
    vertices: Range<usize>,
    /// Whether it lasts longer than a frame.
    lasts: bool,
}

/// A hierarchy of ours that is to be fitted.
pub struct Fit<'a> {
    pose: &'a mut OwnPose,
    due: Due,
    fitted: Option<Fitted>,
}

/// A fitted hierarchy in the GPU's form.
struct Fitted {
    nodes: Vec<BvhNode>,
    triangles: Vec<BvhTriangle>,
    bounds: Aabb,
}

impl Fit<'_> {
    /// Fits the hierarchy to its vertices. `all`: those of the view.
    pub fn compute(&mut self, all: &[Vertex]) {
        let vertices = slice::part(all, self.due.vertices.clone());
        let position = |i: u32| vertices.get(i as usize).map_or(Vec3::NAN, |v| v.position);
        let corners: Vec<[Vec3; 3]> = self.due.indices.iter().map(|t| t.map(position)).collect();
        let boxes: Vec<Aabb> = corners.iter().map(|&c| Aabb::of(c)).collect();
        let OwnPose {
            hierarchy, cost, ..
        } = &mut *self.pose;
        self.fitted = fit(hierarchy, cost, &boxes).map(|bounds| Fitted {
            nodes: widen(hierarchy),
            triangles: ordered(hierarchy, &corners),
            bounds,
        });
    }

    /// Stores it on the device.
    ///
    /// # Errors
    /// Out of memory.
    pub fn store(self, rec: &mut Recorder, device: &Device) -> Result<(), Error> {
        (self.pose.bottom, self.pose.kept) = (None, None);
        let Some(fitted) = self.fitted else {
            return Ok(()); // without a triangle
        };
        let [nodes, triangles] = if self.due.lasts {
            let bytes = [
                bytemuck::cast_slice::<_, u8>(&fitted.nodes),
                bytemuck::cast_slice(&fitted.triangles),
            ];
            let (name, storage) = ("trace animated kept", BufferUsage::STORAGE);
            let buffer = Buffer::with_data(device, name, storage, &bytes.concat())?;
            let address = buffer.address();
            self.pose.kept = Some(buffer);
            [
                address,
                address + size_of_val(fitted.nodes.as_slice()) as u64,
            ]
        } else {
            let arena = rec.arena();
            [arena.push(&fitted.nodes)?, arena.push(&fitted.triangles)?]
        };
        self.pose.bottom = Some(OwnBottom {
            nodes,
            triangles,
            bounds: fitted.bounds,
        });
        Ok(())
    }
}

impl AnimatedShape {
    /// A shape with the triangles of some meshes. `old`: the shape whose triangles these replace, for deformations that
    /// change triangles each frame; its structures are reused.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        tracer: Tracer,
        meshes: &[MeshPart<'_>],
        version: u64,
        old: Option<Self>,
    ) -> Result<Self, Error> {
        let indices = part_indices(meshes);
        let index_buffer = if tracer.has_own_structures() {
            None
        } else {
            let name = "trace animated indices";
            let input = BufferUsage::ACCEL_INPUT;
            Some(Buffer::with_data(device, name, input, &indices)?)
        };
        let (mut poses, taken, mut of_bodies) =
            old.map_or_else(Default::default, |s| (s.poses, s.taken, s.of_bodies));
        for pose in poses.iter_mut().chain(of_bodies.values_mut()) {
            pose.forget();
        }
        Ok(Self {
            seen: 0,
            version,
            indices: indices.into(),
            index_buffer,
            poses,
            taken,
            of_bodies,
        })
    }

    /// Begins a view, of number `frame`; drops poses of bodies that the last view did not have.
    pub fn begin_view(&mut self, frame: u64) {
        self.taken = 0;
        self.of_bodies.retain(|_, pose| pose.seen + 1 >= frame);
    }

    fn all(&self) -> impl Iterator<Item = &Pose> {
        self.poses.iter().chain(self.of_bodies.values())
    }

    fn all_mut(&mut self) -> impl Iterator<Item = &mut Pose> {
        self.poses.iter_mut().chain(self.of_bodies.values_mut())
    }

    /// Drops poses whose last frame is not `fresh`.
    pub fn drop_poses(&mut self, fresh: impl Fn(u64) -> bool) {
        // poses are assigned in order, so unused ones are last
        while self.poses.last().is_some_and(|pose| !fresh(pose.seen)) {
            self.poses.pop();
        }
    }

    /// Whether its triangles equal those of some meshes.
    pub fn has_triangles_of(&self, meshes: &[MeshPart<'_>]) -> bool {
        is_same(&self.indices, meshes)
    }

    /// Version of its triangles.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Number of kept structures.
    #[cfg(test)]
    pub fn pose_count(&self) -> usize {
        self.all().count()
    }

    /// Bytes on the device.
    #[cfg(test)]
    pub fn size(&self) -> u64 {
        let indices = self.index_buffer.as_ref().map_or(0, Buffer::size);
        indices + self.all().map(Pose::size).sum::<u64>()
    }

    /// A pose's structure for the top level.
    pub fn bottom(&self, pose: PoseKey) -> Option<Bottom> {
        let pose = match pose {
            PoseKey::Ordered(index) => self.poses.get(index),
            PoseKey::OfBody(body) => self.of_bodies.get(&body),
        };
        match &pose?.bottom {
            PoseBottom::Driver { blas, .. } => Some(Bottom::Driver(blas.address())),
            PoseBottom::Own(own) => own.bottom.map(Bottom::Own),
        }
    }

    /// Whether a pose is still to be built or refitted.
    pub fn has_work(&self) -> bool {
        let waits = |pose: &Pose| {
            let PoseBottom::Driver { pending, .. } = &pose.bottom else {
                return false;
            };
            pending.is_some()
        };
        self.all().any(waits)
    }

    /// Build inputs of this frame's poses.
    pub fn pending(&mut self) -> impl Iterator<Item = BlasBuild<'_>> {
        self.all_mut().filter_map(|pose| {
            if let PoseBottom::Driver {
                blas,
                pending: Some((geometries, refit)),
                ..
            } = &mut pose.bottom
            {
                Some(BlasBuild {
                    blas,
                    geometries,
                    refit: *refit,
                })
            } else {
                None
            }
        })
    }

    /// Marks all poses as built.
    pub fn settle(&mut self) {
        for pose in self.all_mut() {
            if let PoseBottom::Driver { pending, .. } = &mut pose.bottom {
                *pending = None;
            }
        }
    }

    /// Hierarchies of ours that are to be fitted in this frame.
    pub fn due(&mut self) -> impl Iterator<Item = Fit<'_>> {
        self.all_mut().filter_map(|pose| match &mut pose.bottom {
            PoseBottom::Own(own) => Some(Fit {
                due: own.due.take()?,
                pose: own,
                fitted: None,
            }),
            PoseBottom::Driver { .. } => None,
        })
    }

    /// Assigns a pose to vertices and their device address: that of the body, or the next. Leaves our own hierarchy to
    /// [`due`](Self::due), and the driver's structure to [`pending`](Self::pending). `range`: of `all` vertices of the
    /// view; `refits`: number of refits and builds.
    pub fn take_pose(
        &mut self,
        device: &Device,
        (kind, used): (Kind, Use),
        (all, range): (&[Vertex], Range<usize>),
        address: u64,
        refits: &mut u64,
    ) -> PoseKey {
        let own = self.index_buffer.is_none();
        // a second part of this shape on one body is not followed
        let is_free = |pose: &Pose| pose.seen != self.seen;
        let body = used.body;
        let body = body.filter(|body| self.of_bodies.get(body).is_none_or(is_free));
        let (key, pose) = match body {
            Some(body) => {
                let pose = self.of_bodies.entry(body);
                let pose = pose.or_insert_with(|| Pose::new(device, own));
                (PoseKey::OfBody(body), Some(pose))
            }
            None => {
                let index = self.taken;
                self.taken += 1;
                if self.poses.len() <= index {
                    self.poses.push(Pose::new(device, own));
                }
                (PoseKey::Ordered(index), self.poses.get_mut(index))
            }
        };
        let Some(pose) = pose else {
            return key; // just pushed
        };
        pose.seen = self.seen;
        let omitted = body.filter(|_| !used.refit);
        // spreads the refits of omitted bodies over frames
        let is_due = |body: u32| (self.seen + u64::from(body)).is_multiple_of(OMITTED);
        if omitted.is_some_and(|body| !is_due(body)) && pose.is_kept() {
            return key;
        }
        *refits += 1;
        let spread = match key {
            PoseKey::Ordered(index) => u32::try_from(index).unwrap_or(0),
            PoseKey::OfBody(body) => body,
        };
        match &mut pose.bottom {
            PoseBottom::Driver {
                blas,
                area,
                refits,
                pending,
            } => {
                let vertices = slice::part(all, range);
                let bounds = Aabb::of(vertices.iter().map(|v| v.position)).half_area();
                let fits = *refits < REFITS && bounds <= *area * GROWN && bounds * GROWN >= *area;
                let refit = fits && blas.address() != 0 && *area > 0.0;
                if refit {
                    *refits += 1;
                } else {
                    // spreads the rebuilds of entities that come into view together over frames
                    *refits = spread % (REFITS / 2);
                    *area = bounds;
                }
                let at = self.index_buffer.as_ref().map_or(0, Buffer::address);
                let geometry = geometry(kind, address, vertices.len(), at, self.indices.len());
                *pending = Some(([geometry], refit));
            }
            PoseBottom::Own(own) => {
                own.due = Some(Due {
                    indices: Arc::clone(&self.indices),
                    vertices: range,
                    lasts: omitted.is_some(),
                });
            }
        }
        key
    }
}

impl Pose {
    /// A pose that is not built. `own`: it has a hierarchy of ours.
    fn new(device: &Device, own: bool) -> Self {
        let bottom = if own {
            PoseBottom::Own(OwnPose::default())
        } else {
            let flags = BlasFlags {
                refit: true,
                ..BlasFlags::default()
            };
            PoseBottom::Driver {
                blas: Blas::new(device, "trace animated", flags),
                area: 0.0,
                refits: 0,
                pending: None,
            }
        };
        Self { seen: 0, bottom }
    }

    /// Bytes on the device.
    #[cfg(test)]
    fn size(&self) -> u64 {
        match &self.bottom {
            PoseBottom::Driver { blas, .. } => blas.size(),
            PoseBottom::Own(OwnPose {
                hierarchy, kept, ..
            }) => {
                kept.as_ref().map_or(0, Buffer::size)
                    + (hierarchy.node_count() * size_of::<BvhNode>()
                        + hierarchy.order().len() * size_of::<BvhTriangle>())
                        as u64
            }
        }
    }

    /// Whether its structure lasts longer than a frame.
    fn is_kept(&self) -> bool {
        match &self.bottom {
            PoseBottom::Driver { blas, area, .. } => blas.address() != 0 && *area > 0.0,
            PoseBottom::Own(own) => own.kept.is_some(),
        }
    }

    /// Forces a rebuild at its next use: its triangles have changed.
    fn forget(&mut self) {
        match &mut self.bottom {
            PoseBottom::Driver { area, .. } => *area = 0.0,
            PoseBottom::Own(own) => (own.hierarchy, own.kept) = (Hierarchy::default(), None),
        }
    }
}

/// Refits a hierarchy to its entries, or rebuilds it; returns its bounds, if it has entries.
fn fit(hierarchy: &mut Hierarchy, cost: &mut f32, boxes: &[Aabb]) -> Option<Aabb> {
    if hierarchy.order().len() == boxes.len() && !boxes.is_empty() {
        let bounds = hierarchy.refit(boxes);
        if hierarchy.cost() <= *cost * WORSE {
            return Some(bounds);
        }
    }
    *hierarchy = Hierarchy::new(boxes, TRIANGLES);
    *cost = hierarchy.cost();
    (!hierarchy.is_empty()).then(|| hierarchy.bounds())
}
