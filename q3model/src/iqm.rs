//! IQM: models whose vertices hang on a skeleton of joints.

use glam::{Quat, Vec2, Vec3};

use crate::{BoneMatrix, TagPose};

/// Joints that a vertex may hang on.
pub const IQM_WEIGHTS: usize = 4;
/// Numbers of a joint's pose: translation, rotation, scale.
pub const IQM_CHANNELS: usize = 10;

/// Cosine of the angle between two rotations above which they are mixed linearly.
const NEARLY_EQUAL: f32 = 0.999_999;

/// A model.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Iqm {
    /// Parts of the model, each drawn with one shader.
    pub surfaces: Vec<IqmSurface>,
    /// The vertices of all surfaces, in the pose that the model was bound in.
    pub vertices: Vec<IqmVertex>,
    /// The skeleton; parents come before their children.
    pub joints: Vec<IqmJoint>,
    /// How the poses of the joints are stored: one for each joint, or none in a model without poses.
    pub channels: Vec<IqmChannels>,
    /// Key-frames; 0 in a model without poses.
    pub num_frames: usize,
    /// The stored numbers of all key-frames, each of [`Self::numbers_per_frame`], all of the first frame first.
    pub frame_data: Vec<u16>,
    /// Numbers of one frame.
    pub numbers_per_frame: usize,
    /// Smallest and largest corner for each key-frame. Without any in the file: for a model without frames those of its
    /// vertices, else empty.
    pub bounds: Vec<(Vec3, Vec3)>,
}

/// Triangles that share a shader.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IqmSurface {
    /// Name that skins refer to, lower case.
    pub name: String,
    /// Shader as written.
    pub material: String,
    /// First vertex in [`Iqm::vertices`].
    pub first_vertex: usize,
    /// Number of vertices.
    pub num_vertices: usize,
    /// Corners, clockwise seen from the front, counted from the first vertex; each less than their number.
    pub triangles: Vec<[u32; 3]>,
}

/// A vertex in the pose that the model was bound in.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IqmVertex {
    /// Position, id units.
    pub position: Vec3,
    /// Normal.
    pub normal: Vec3,
    /// Texture coordinates.
    pub st: Vec2,
    /// Colour; black without alpha if the file has none, as in the engine.
    pub color: [u8; 4],
    /// Joints that it hangs on, each of the skeleton; those after the first weight of 0 mean nothing.
    pub joints: [u8; IQM_WEIGHTS],
    /// Shares of the joints, which should add up to 1.
    pub weights: [f32; IQM_WEIGHTS],
}

/// A joint as it was when the model was bound.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IqmJoint {
    /// Name, compared with regard to case.
    pub name: String,
    /// The joint that it hangs on, less than its own number.
    pub parent: Option<usize>,
    /// Place in its parent's space.
    pub pose: IqmPose,
}

/// Place of a joint in its parent's space.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IqmPose {
    /// Id units.
    pub translate: Vec3,
    /// Of length 1.
    pub rotate: Quat,
    /// Factors.
    pub scale: Vec3,
}

/// The joints of a model when it was bound, in the model's space ([`Iqm::skeleton`]).
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IqmSkeleton {
    bind: Vec<BoneMatrix>,
    /// What undoes them, provided that joints are scaled evenly.
    inverse: Vec<BoneMatrix>,
}

/// How the poses of one joint are stored: number `c` of its pose is `offset[c]` and, if bit `c` of the mask is set,
/// `scale[c]` times the next stored number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IqmChannels {
    /// Which numbers change from frame to frame.
    pub mask: u32,
    /// What they are where the stored number is 0.
    pub offset: [f32; IQM_CHANNELS],
    /// What one step of the stored number is.
    pub scale: [f32; IQM_CHANNELS],
}

impl IqmChannels {
    /// How many numbers the joint has in each frame.
    pub fn stored_numbers(&self) -> usize {
        (self.mask & ((1 << IQM_CHANNELS) - 1)).count_ones() as usize
    }
}

impl IqmPose {
    /// From translation, rotation (not yet of length 1) and scale.
    pub fn from_numbers(numbers: [f32; IQM_CHANNELS]) -> IqmPose {
        let [tx, ty, tz, qx, qy, qz, qw, sx, sy, sz] = numbers;
        let rotate = Quat::from_xyzw(qx, qy, qz, qw);
        let length = rotate.length();
        IqmPose {
            translate: Vec3::new(tx, ty, tz),
            rotate: if length > 0.0 {
                rotate * (1.0 / length)
            } else {
                rotate
            },
            scale: Vec3::new(sx, sy, sz),
        }
    }

    /// Translation, rotation and scale in the order of the file.
    pub fn numbers(&self) -> [f32; IQM_CHANNELS] {
        let ([tx, ty, tz], [sx, sy, sz]) = (self.translate.to_array(), self.scale.to_array());
        let [qx, qy, qz, qw] = self.rotate.to_array();
        [tx, ty, tz, qx, qy, qz, qw, sx, sy, sz]
    }

    /// As a matrix. The scale stretches what is already turned, as in the engine; the format's own examples stretch
    /// before they turn, which is the same as long as all three factors are.
    pub fn matrix(&self) -> BoneMatrix {
        let [x, y, z, w] = self.rotate.to_array();
        let (xx, yy, zz) = (2.0 * x * x, 2.0 * y * y, 2.0 * z * z);
        let (xy, xz, yz) = (2.0 * x * y, 2.0 * x * z, 2.0 * y * z);
        let (wx, wy, wz) = (2.0 * w * x, 2.0 * w * y, 2.0 * w * z);
        let rotation = [
            Vec3::new(1.0 - (yy + zz), xy - wz, xz + wy),
            Vec3::new(xy + wz, 1.0 - (xx + zz), yz - wx),
            Vec3::new(xz - wy, yz + wx, 1.0 - (xx + yy)),
        ];
        let mut matrix = BoneMatrix::ZERO;
        let parts = rotation
            .into_iter()
            .zip(self.scale.to_array())
            .zip(self.translate.to_array());
        for (row, ((turned, scale), moved)) in matrix.rows.iter_mut().zip(parts) {
            *row = (turned * scale).extend(moved);
        }
        matrix
    }

    /// Between this and another pose: `back` is the weight of the other one. Rotations go the short way round.
    pub fn mix(&self, other: &IqmPose, back: f32) -> IqmPose {
        let front = 1.0 - back;
        IqmPose {
            translate: self.translate * front + other.translate * back,
            rotate: mix_rotations(other.rotate, self.rotate, front),
            scale: self.scale * front + other.scale * back,
        }
    }
}

/// Spherical interpolation from one rotation to another.
fn mix_rotations(from: Quat, to: Quat, fraction: f32) -> Quat {
    let cosine = from.dot(to);
    let (cosine, to) = if cosine < 0.0 {
        (-cosine, -to)
    } else {
        (cosine, to)
    };
    let (a, b) = if cosine < NEARLY_EQUAL {
        let angle = cosine.acos();
        let sine = angle.sin();
        (
            ((1.0 - fraction) * angle).sin() / sine,
            (fraction * angle).sin() / sine,
        )
    } else {
        (1.0 - fraction, fraction)
    };
    from * a + to * b
}

impl IqmVertex {
    /// Where the vertex and its normal are with such a pose, one matrix for each joint ([`Iqm::pose`]). The normal has
    /// the length that the joints give it, as in the engine. A vertex whose first weight is 0 stays where it is.
    pub fn skinned(&self, pose: &[BoneMatrix]) -> (Vec3, Vec3) {
        let mut sum: Option<BoneMatrix> = None;
        for (&joint, &weight) in self.joints.iter().zip(&self.weights) {
            // the engine stops at the first weight that is none
            if weight <= 0.0 {
                break;
            }
            if let Some(matrix) = pose.get(usize::from(joint)) {
                let so_far = sum.unwrap_or(BoneMatrix::ZERO);
                sum = Some(so_far.mix(1.0, matrix, weight));
            }
        }
        match sum {
            Some(matrix) => (
                matrix.point(self.position),
                matrix.of_normals().direction(self.normal),
            ),
            None => (self.position, self.normal),
        }
    }
}

impl Iqm {
    /// The vertices of a surface.
    pub fn surface_vertices(&self, surface: &IqmSurface) -> &[IqmVertex] {
        let end = surface.first_vertex.saturating_add(surface.num_vertices);
        self.vertices.get(surface.first_vertex..end).unwrap_or(&[])
    }

    /// Whether vertices follow poses at all.
    pub fn is_animated(&self) -> bool {
        !self.channels.is_empty() && self.num_frames > 0
    }

    /// The joints' places in one frame, one after the other; frames beyond the last give the last.
    fn frame_poses(&self, frame: usize) -> impl Iterator<Item = IqmPose> {
        let frame = frame.min(self.num_frames.saturating_sub(1));
        let numbers = frame
            .checked_mul(self.numbers_per_frame)
            .and_then(|start| self.frame_data.get(start..))
            .unwrap_or(&[]);
        let mut numbers = numbers.iter();
        self.channels.iter().map(move |channels| {
            let mut pose = channels.offset;
            for (c, (value, scale)) in pose.iter_mut().zip(channels.scale).enumerate() {
                if channels.mask >> c & 1 != 0 {
                    *value += f32::from(numbers.next().copied().unwrap_or(0)) * scale;
                }
            }
            IqmPose::from_numbers(pose)
        })
    }

    /// Replaces `out` by the model-space matrices of places of joints, each after its parent's.
    fn chain(&self, poses: impl Iterator<Item = IqmPose>, out: &mut Vec<BoneMatrix>) {
        out.clear();
        for (joint, pose) in self.joints.iter().zip(poses) {
            let matrix = pose.matrix();
            let parent = joint.parent.and_then(|parent| out.get(parent));
            out.push(parent.map_or(matrix, |parent| parent.after(&matrix)));
        }
    }

    /// Replaces `out` by the model-space matrices of the joints when the model was bound.
    pub fn bind_pose(&self, out: &mut Vec<BoneMatrix>) {
        self.chain(self.joints.iter().map(|joint| joint.pose), out);
    }

    /// Replaces `out` by the model-space matrices of the joints between two frames; `back` is the weight of the
    /// second. In a model without poses they are as when it was bound.
    pub fn joint_matrices(&self, frame: usize, old: usize, back: f32, out: &mut Vec<BoneMatrix>) {
        if !self.is_animated() {
            self.bind_pose(out);
        } else if frame == old {
            self.chain(self.frame_poses(frame), out);
        } else {
            let between = self.frame_poses(frame).zip(self.frame_poses(old));
            self.chain(between.map(|(new, old)| new.mix(&old, back)), out);
        }
    }

    /// The skeleton as it was when the model was bound.
    pub fn skeleton(&self) -> IqmSkeleton {
        let mut bind = Vec::new();
        self.bind_pose(&mut bind);
        let mut inverse: Vec<BoneMatrix> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let local = joint.pose.matrix().inverse_of_even();
            let parent = joint.parent.and_then(|parent| inverse.get(parent));
            inverse.push(parent.map_or(local, |parent| local.after(parent)));
        }
        IqmSkeleton { bind, inverse }
    }

    /// Replaces `out` by what moves the vertices of each joint between two frames; `back` is the weight of the old
    /// one. `skeleton` is [`Self::skeleton`], which is the same for every pose. Empty for a model without poses: its
    /// vertices stay where they are.
    pub fn pose(
        &self,
        skeleton: &IqmSkeleton,
        new: usize,
        old: usize,
        back: f32,
        out: &mut Vec<BoneMatrix>,
    ) {
        out.clear();
        if !self.is_animated() {
            return;
        }
        let between = self.frame_poses(new).zip(self.frame_poses(old));
        let joints = self.joints.iter().zip(&skeleton.inverse);
        for ((new_pose, old_pose), (joint, inverse)) in between.zip(joints) {
            let pose = if new == old {
                new_pose
            } else {
                new_pose.mix(&old_pose, back)
            };
            let local = pose.matrix().after(inverse);
            // where the inverse does not undo the bound pose exactly this is not the joint's own place, but the engine's
            let parent = joint.parent.and_then(|parent| {
                let bind = skeleton.bind.get(parent)?;
                Some(out.get(parent)?.after(bind))
            });
            out.push(parent.map_or(local, |parent| parent.after(&local)));
        }
    }

    /// A joint between two frames; `frac` is the weight of `end`. Its axes have the length that the joints give them,
    /// as in the engine, which looks for frames beyond those that exist where there are none; here the nearest ones
    /// count. `None` when there is no such joint.
    pub fn lerp_tag(&self, name: &str, start: i32, end: i32, frac: f32) -> Option<TagPose> {
        let joint = self.joints.iter().position(|joint| joint.name == name)?;
        let frame = |frame: i32| usize::try_from(frame).unwrap_or(0);
        let mut matrices = Vec::with_capacity(self.joints.len());
        self.joint_matrices(frame(start), frame(end), frac, &mut matrices);
        let matrix = matrices.get(joint)?;
        Some(TagPose {
            origin: matrix.translation(),
            axis: matrix.axes(),
        })
    }

    /// Stores poses, one list of places of all joints for each frame, to the nearest of 65536 steps between the
    /// smallest and the largest value of each number. Joints that a list leaves out are as when bound.
    pub fn set_frames(&mut self, frames: &[Vec<IqmPose>]) {
        let number = |frame: &Vec<IqmPose>, joint: usize, c: usize| {
            let pose = frame
                .get(joint)
                .copied()
                .or_else(|| self.joints.get(joint).map(|joint| joint.pose));
            pose.and_then(|pose| pose.numbers().get(c).copied())
                .unwrap_or(0.0)
        };
        let mut all = Vec::new();
        for joint in 0..self.joints.len() {
            let mut channels = IqmChannels::default();
            let slots = channels.offset.iter_mut().zip(&mut channels.scale);
            for (c, (offset, scale)) in slots.enumerate() {
                let values = || frames.iter().map(|frame| number(frame, joint, c));
                let low = values().fold(f32::INFINITY, f32::min);
                let high = values().fold(f32::NEG_INFINITY, f32::max);
                *offset = if low.is_finite() { low } else { 0.0 };
                if high > low {
                    *scale = (high - low) / f32::from(u16::MAX);
                    channels.mask |= 1 << c;
                }
            }
            all.push(channels);
        }
        let mut data = Vec::new();
        for frame in frames {
            for (joint, channels) in all.iter().enumerate() {
                for (c, (offset, scale)) in channels.offset.iter().zip(channels.scale).enumerate() {
                    if channels.mask >> c & 1 != 0 {
                        // A float-to-integer cast saturates.
                        data.push(((number(frame, joint, c) - offset) / scale).round() as u16);
                    }
                }
            }
        }
        self.numbers_per_frame = all.iter().map(|c| c.stored_numbers()).sum();
        self.num_frames = frames.len();
        self.frame_data = data;
        self.channels = all;
    }
}
