//! MDR: models whose vertices hang on bones that are stored per frame.

use glam::{Vec2, Vec3};

use crate::{BoneMatrix, Frame, TagPose};

/// A model with all its levels of detail.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mdr {
    /// Path that the exporter wrote; nothing depends on it.
    pub name: String,
    /// Bounds of the key-frames, at least one.
    pub frames: Vec<Frame>,
    /// Model-space transforms, `frames × num_bones`, all of the first frame first.
    pub bones: Vec<BoneMatrix>,
    /// Bones per frame.
    pub num_bones: usize,
    /// Parts of the model for each level of detail, the finest first.
    pub lods: Vec<Vec<MdrSurface>>,
    /// Bones that other models are attached to.
    pub tags: Vec<MdrTag>,
}

/// A bone with a name.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MdrTag {
    /// Name, compared with regard to case.
    pub name: String,
    /// Less than [`Mdr::num_bones`].
    pub bone: usize,
}

/// Triangles that share a shader.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MdrSurface {
    /// Name that skins refer to, lower case.
    pub name: String,
    /// Shader as written.
    pub shader: String,
    /// Corners, clockwise seen from the front; each less than the number of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Vertices.
    pub vertices: Vec<MdrVertex>,
    /// Weights of all vertices.
    pub weights: Vec<MdrWeight>,
}

/// A vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MdrVertex {
    /// Normal before bones turn it.
    pub normal: Vec3,
    /// Texture coordinates.
    pub st: Vec2,
    /// Its first weight in [`MdrSurface::weights`].
    pub first_weight: u32,
    /// How many it has.
    pub num_weights: u32,
}

/// What a vertex has of a bone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MdrWeight {
    /// Less than [`Mdr::num_bones`].
    pub bone: u32,
    /// Share of the bone; those of a vertex should add up to 1.
    pub weight: f32,
    /// Where the vertex is in the bone's space.
    pub offset: Vec3,
}

impl MdrSurface {
    /// Where a vertex of this surface and its normal are with such bones. The normal has the length that the bones
    /// give it, as in the engine. Bones that are not there count for nothing.
    pub fn skinned(&self, vertex: &MdrVertex, bones: &[BoneMatrix]) -> (Vec3, Vec3) {
        let first = vertex.first_weight as usize;
        let weights = self
            .weights
            .get(first..first.saturating_add(vertex.num_weights as usize))
            .unwrap_or(&[]);
        let (mut position, mut normal) = (Vec3::ZERO, Vec3::ZERO);
        for weight in weights {
            if let Some(bone) = bones.get(weight.bone as usize) {
                position += bone.point(weight.offset) * weight.weight;
                normal += bone.direction(vertex.normal) * weight.weight;
            }
        }
        (position, normal)
    }
}

impl Mdr {
    /// The bones of one frame; empty when there is no such frame.
    pub fn frame_bones(&self, frame: usize) -> &[BoneMatrix] {
        frame
            .checked_mul(self.num_bones)
            .and_then(|start| self.bones.get(start..start.checked_add(self.num_bones)?))
            .unwrap_or(&[])
    }

    /// Replaces `out` by the bones between two frames, element by element; `backlerp` is the weight of the old one.
    pub fn pose(&self, new: usize, old: usize, backlerp: f32, out: &mut Vec<BoneMatrix>) {
        out.clear();
        let bones = self.frame_bones(new);
        if backlerp == 0.0 {
            out.extend_from_slice(bones);
        } else {
            let old = self.frame_bones(old);
            let between = bones.iter().zip(old);
            out.extend(between.map(|(new, old)| new.mix(1.0 - backlerp, old, backlerp)));
        }
    }

    /// A tag between two frames, by the rules of [`crate::Md3::lerp_tag`]. `None` when there is no such tag.
    pub fn lerp_tag(&self, name: &str, start: i32, end: i32, frac: f32) -> Option<TagPose> {
        let tag = self.tags.iter().find(|tag| tag.name == name)?;
        let last = self.frames.len().saturating_sub(1);
        let bone = |frame: i32| {
            let frame = usize::try_from(frame).unwrap_or(0).min(last);
            self.frame_bones(frame).get(tag.bone)
        };
        let between = bone(start)?.mix(1.0 - frac, bone(end)?, frac);
        Some(TagPose {
            origin: between.translation(),
            axis: between.axes().map(Vec3::normalize_or_zero),
        })
    }
}
