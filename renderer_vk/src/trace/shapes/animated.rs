//! Shapes whose vertices move: their triangles stay, and a structure is fitted to the new positions each frame, and built
//! anew when that has made it bad. Of several entities of one model each has its own, by turns.
//!
//! When a fitted structure is bad: our own hierarchies know what a ray costs in them, and are built anew once that is
//! [`WORSE`] times what it was. The driver does not tell; its structures are built anew after [`REFITS`] frames, and at
//! once when the box of all triangles has [`GROWN`] times the surface it had, or as much less.

use glam::Vec3;
#[cfg(test)]
use shaders::trace_types::{BvhNode, BvhTriangle};
use shaders::types::Vertex;
use support::Aabb;
use support::bvh::Hierarchy;

use super::super::bvh::{TRIANGLES, ordered, widen};
use super::super::input::{Kind, Tracer};
use super::super::part_mesh::{MeshPart, geometry, is_same, part_indices};
use super::{Bottom, OwnBottom};
use crate::gpu::{
    Blas, BlasBuild, BlasFlags, BlasGeometry, Buffer, BufferUsage, Device, Error, Recorder,
};

/// How much more a ray may cost in a fitted hierarchy of ours.
const WORSE: f32 = 1.5;
/// How often a structure of the driver is fitted before it is built anew.
const REFITS: u32 = 60;
/// How much the surface of the box around a structure of the driver may change.
const GROWN: f32 = 2.0;

/// Triangles that stay, of parts whose vertices move.
pub struct AnimatedShape {
    /// Number of the frame that showed it last.
    pub seen: u64,
    /// Another number whenever the triangles have become others.
    version: u64,
    indices: Vec<[u32; 3]>,
    /// The same for the driver; without it the hierarchies are ours.
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

/// Memory that fitting hierarchies uses again.
#[derive(Default)]
pub struct Scratch {
    boxes: Vec<Aabb>,
    corners: Vec<[Vec3; 3]>,
}

impl AnimatedShape {
    /// With the triangles of some meshes. `old`: the shape whose triangles these replace, as those of a deformation that
    /// makes other ones each time; its structures go on.
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
        let index_buffer = if tracer == Tracer::Compute {
            None
        } else {
            let name = "trace animated indices";
            let input = BufferUsage::ACCEL_INPUT;
            Some(Buffer::with_data(device, name, input, &indices)?)
        };
        let (mut poses, taken) = old.map_or((Vec::new(), 0), |s| (s.poses, s.taken));
        for pose in &mut poses {
            pose.forget();
        }
        Ok(Self {
            seen: 0,
            version,
            indices,
            index_buffer,
            poses,
            taken,
        })
    }

    /// Another view begins.
    pub fn begin_view(&mut self) {
        self.taken = 0;
    }

    /// Drops poses whose last frame is not `fresh`.
    pub fn drop_poses(&mut self, fresh: impl Fn(u64) -> bool) {
        // they are taken in order, so the last ones are those that rest
        while self.poses.last().is_some_and(|pose| !fresh(pose.seen)) {
            self.poses.pop();
        }
    }

    /// Whether its triangles are those of some meshes.
    pub fn has_triangles_of(&self, meshes: &[MeshPart<'_>]) -> bool {
        is_same(&self.indices, meshes)
    }

    /// Version of its triangles.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Structures that are kept.
    #[cfg(test)]
    pub fn pose_count(&self) -> usize {
        self.poses.len()
    }

    /// Bytes on the device.
    #[cfg(test)]
    pub fn size(&self) -> u64 {
        let indices = self.index_buffer.as_ref().map_or(0, Buffer::size);
        indices + self.poses.iter().map(Pose::size).sum::<u64>()
    }

    /// What to place of a pose.
    pub fn bottom(&self, pose: usize) -> Option<Bottom> {
        match &self.poses.get(pose)?.bottom {
            PoseBottom::Driver { blas, .. } => Some(Bottom::Driver(blas.address())),
            PoseBottom::Own { bottom, .. } => bottom.map(Bottom::Own),
        }
    }

    /// Whether a pose waits to be built or fitted.
    pub fn has_work(&self) -> bool {
        let waits = |pose: &Pose| {
            let PoseBottom::Driver { pending, .. } = &pose.bottom else {
                return false;
            };
            pending.is_some()
        };
        self.poses.iter().any(waits)
    }

    /// How to build or fit the poses of this frame.
    pub fn pending(&mut self) -> impl Iterator<Item = BlasBuild<'_>> {
        self.poses.iter_mut().filter_map(|pose| {
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

    /// All poses were built or fitted.
    pub fn settle(&mut self) {
        for pose in &mut self.poses {
            if let PoseBottom::Driver { pending, .. } = &mut pose.bottom {
                *pending = None;
            }
        }
    }

    /// The next pose of the view, with its vertices and where they are on the device: our own hierarchy is fitted at
    /// once, the driver's is left to [`pending`](Self::pending). Which one it is.
    ///
    /// # Errors
    /// Out of memory.
    pub fn take_pose(
        &mut self,
        rec: &mut Recorder,
        device: &Device,
        kind: Kind,
        vertices: &[Vertex],
        address: u64,
        scratch: &mut Scratch,
    ) -> Result<usize, Error> {
        let index = self.taken;
        self.taken += 1;
        if self.poses.len() <= index {
            let own = self.index_buffer.is_none();
            self.poses.push(Pose::new(device, own));
        }
        let Some(pose) = self.poses.get_mut(index) else {
            return Ok(index); // just pushed
        };
        pose.seen = self.seen;
        match &mut pose.bottom {
            PoseBottom::Driver {
                blas,
                area,
                refits,
                pending,
            } => {
                let bounds = Aabb::of(vertices.iter().map(|v| v.position)).half_area();
                let fits = *refits < REFITS && bounds <= *area * GROWN && bounds * GROWN >= *area;
                let refit = fits && blas.address() != 0 && *area > 0.0;
                if refit {
                    *refits += 1;
                } else {
                    // entities that come into sight together are not all built anew together
                    *refits = u32::try_from(index).unwrap_or(0) % (REFITS / 2);
                    *area = bounds;
                }
                let at = self.index_buffer.as_ref().map_or(0, Buffer::address);
                let geometry = geometry(kind, address, vertices.len(), at, self.indices.len());
                *pending = Some(([geometry], refit));
            }
            PoseBottom::Own {
                hierarchy,
                cost,
                bottom,
            } => {
                let Scratch { boxes, corners } = scratch;
                let position = |i: u32| vertices.get(i as usize).map_or(Vec3::NAN, |v| v.position);
                corners.clear();
                corners.extend(self.indices.iter().map(|t| t.map(position)));
                boxes.clear();
                boxes.extend(corners.iter().map(|&c| Aabb::of(c)));
                *bottom = fit(hierarchy, cost, boxes)
                    .map(|bounds| {
                        let triangles = ordered(hierarchy, corners);
                        Ok::<_, Error>(OwnBottom {
                            nodes: rec.arena().push(&widen(hierarchy))?,
                            triangles: rec.arena().push(&triangles)?,
                            bounds,
                        })
                    })
                    .transpose()?;
            }
        }
        Ok(index)
    }
}

impl Pose {
    /// Not built yet. `own`: a hierarchy of ours.
    fn new(device: &Device, own: bool) -> Self {
        let bottom = if own {
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
            PoseBottom::Own { hierarchy, .. } => {
                (hierarchy.node_count() * size_of::<BvhNode>()
                    + hierarchy.order().len() * size_of::<BvhTriangle>()) as u64
            }
        }
    }

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
