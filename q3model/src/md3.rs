//! MD3: models whose vertices and tags are stored per frame.

use glam::{Vec2, Vec3};

/// A model of one level of detail.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Md3 {
    /// Path that the exporter wrote; nothing depends on it.
    pub name: String,
    /// Key-frames, at least one.
    pub frames: Vec<Frame>,
    /// Places where other models are attached, `frames × num_tags`, all of the first frame first.
    pub tags: Vec<Tag>,
    /// Tags per frame.
    pub num_tags: usize,
    /// Parts of the model, each drawn with one shader.
    pub surfaces: Vec<Surface>,
}

/// Bounds of one key-frame.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Frame {
    /// Smallest corner, id units.
    pub mins: Vec3,
    /// Largest corner.
    pub maxs: Vec3,
    /// Middle of the bounding sphere.
    pub local_origin: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Exporter's name for the frame.
    pub name: String,
}

/// A named coordinate frame.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tag {
    /// Name, compared with regard to case.
    pub name: String,
    /// Position, id units.
    pub origin: Vec3,
    /// Forward, left and up in model space.
    pub axis: [Vec3; 3],
}

/// Where a tag is between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TagPose {
    /// Position, id units.
    pub origin: Vec3,
    /// Forward, left and up in model space.
    pub axis: [Vec3; 3],
}

/// Triangles that share a shader.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Surface {
    /// Name that skins refer to: lower case, a trailing `_` with one character (the exporters' level of
    /// detail) removed.
    pub name: String,
    /// Shaders by skin number; may be empty.
    pub shaders: Vec<String>,
    /// Corners, clockwise seen from the front; each less than [`Self::num_verts`].
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates, one per vertex.
    pub st: Vec<Vec2>,
    /// Positions and normals, `frames × num_verts`, all of the first frame first.
    pub vertices: Vec<PackedVertex>,
    /// Vertices per frame.
    pub num_verts: usize,
}

impl Surface {
    /// The vertices of one frame; empty when there is no such frame.
    pub fn frame_vertices(&self, frame: usize) -> &[PackedVertex] {
        frame
            .checked_mul(self.num_verts)
            .and_then(|start| self.vertices.get(start..start.checked_add(self.num_verts)?))
            .unwrap_or(&[])
    }
}

/// A vertex of one frame, eight bytes as in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(C)]
pub struct PackedVertex {
    /// Position in 1/64 id units.
    pub position: [i16; 3],
    /// Normal in polar angles of 1/256 turn: azimuth in the high byte, angle from z in the low one.
    pub normal: u16,
}

impl PackedVertex {
    /// Position in id units.
    pub fn position(&self) -> Vec3 {
        Vec3::from_array(self.position.map(f32::from)) * (1.0 / 64.0)
    }

    /// Unit normal.
    pub fn normal(&self) -> Vec3 {
        let turn = std::f32::consts::TAU / 256.0;
        let (sin_lat, cos_lat) = (f32::from(self.normal >> 8) * turn).sin_cos();
        let (sin_long, cos_long) = (f32::from(self.normal & 0xff) * turn).sin_cos();
        Vec3::new(cos_lat * sin_long, sin_lat * sin_long, cos_long)
    }

    /// The vertex nearest to a position and a unit normal; positions beyond ±512 units are clamped.
    pub fn pack(position: Vec3, normal: Vec3) -> PackedVertex {
        let turns = |angle: f32| {
            ((angle / std::f32::consts::TAU * 256.0).round() as i32).rem_euclid(256) as u16
        };
        let normal = normal.normalize_or(Vec3::Z);
        let azimuth = normal.y.atan2(normal.x);
        let from_z = normal.z.clamp(-1.0, 1.0).acos();
        PackedVertex {
            // A float-to-integer cast saturates.
            position: (position * 64.0).round().to_array().map(|v| v as i16),
            normal: turns(azimuth) << 8 | turns(from_z),
        }
    }
}

impl Md3 {
    /// The tags of one frame; empty when there is no such frame.
    pub fn frame_tags(&self, frame: usize) -> &[Tag] {
        frame
            .checked_mul(self.num_tags)
            .and_then(|start| self.tags.get(start..start.checked_add(self.num_tags)?))
            .unwrap_or(&[])
    }

    /// The tag of a name in a frame; frames beyond the last give the last, as in the engine.
    pub fn tag(&self, frame: usize, name: &str) -> Option<&Tag> {
        let frame = frame.min(self.frames.len().saturating_sub(1));
        self.frame_tags(frame).iter().find(|tag| tag.name == name)
    }

    /// A tag between two frames; `frac` is the weight of `end`. Frames are clamped to those that exist
    /// (the engine clamps only to the last; negative ones count as the first here). Origin and axes are
    /// mixed linearly and each axis normalised, as the engine does. `None` when there is no such tag.
    pub fn lerp_tag(&self, name: &str, start: i32, end: i32, frac: f32) -> Option<TagPose> {
        let frame = |frame: i32| usize::try_from(frame).unwrap_or(0);
        let from = self.tag(frame(start), name)?;
        let to = self.tag(frame(end), name)?;
        let mix = |a: Vec3, b: Vec3| a * (1.0 - frac) + b * frac;
        let [a, b, c] = from.axis;
        let [d, e, f] = to.axis;
        Some(TagPose {
            origin: mix(from.origin, to.origin),
            axis: [mix(a, d), mix(b, e), mix(c, f)].map(Vec3::normalize_or_zero),
        })
    }
}
