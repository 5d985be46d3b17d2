//! The records of the lumps: one struct per kind, with its decoder and encoder.

use crate::bytes::{Fields, Put, Record, name_field, name_text};
use crate::flags;
use crate::ids::{BrushId, Child, PlaneId, ShaderId};
use glam::{Vec2, Vec3};

/// Lump 1: a shader name with the flags that the map compiler saw.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ShaderRef {
    /// Name without extension, as written, to the first NUL; bytes that are not UTF-8 are replaced.
    pub name: String,
    /// The field as stored; compilers left garbage behind the NUL.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub raw_name: [u8; 64],
    /// See [`crate::surface_flags`].
    pub surface_flags: u32,
    /// See [`crate::content_flags`].
    pub content_flags: u32,
    /// Surface and content flags as stored, where the format's game gives the bits other meanings and the two fields
    /// above are a translation.
    pub raw_flags: Option<[u32; 2]>,
}

impl ShaderRef {
    /// A reference with a clean name field. Names longer than 63 bytes are cut when written.
    pub fn new(name: &str, surface_flags: u32, content_flags: u32) -> ShaderRef {
        ShaderRef {
            name: name.to_owned(),
            raw_name: name_field(name, &[0; 64]),
            surface_flags,
            content_flags,
            raw_flags: None,
        }
    }

    /// Converts the flags of Raven's games to ours.
    pub(crate) fn read_as_raven(mut self) -> ShaderRef {
        let raw = [self.surface_flags, self.content_flags];
        [self.surface_flags, self.content_flags] = flags::from_raven(raw);
        self.raw_flags = Some(raw);
        self
    }

    /// With flags as Raven's games store them: those read, as long as they still say the same.
    pub(crate) fn to_raven(&self) -> ShaderRef {
        let ours = [self.surface_flags, self.content_flags];
        let stored = self
            .raw_flags
            .filter(|&raw| flags::from_raven(raw) == ours)
            .unwrap_or_else(|| flags::to_raven(ours));
        let mut shader = self.clone();
        [shader.surface_flags, shader.content_flags] = stored;
        shader
    }
}

impl Record for ShaderRef {
    const STRIDE: usize = 72;
    fn decode(mut f: Fields<'_>) -> Self {
        let raw_name = f.bytes();
        ShaderRef {
            name: name_text(&raw_name),
            raw_name,
            surface_flags: f.u32(),
            content_flags: f.u32(),
            raw_flags: None,
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&name_field(&self.name, &self.raw_name));
        out.extend_from_slice(&self.surface_flags.to_le_bytes());
        out.extend_from_slice(&self.content_flags.to_le_bytes());
    }
}

/// Lump 2: the plane of points p with `normal · p = dist`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plane {
    /// Unit normal.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub normal: Vec3,
    /// Distance from the origin along the normal, id units.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub dist: f32,
}

impl Plane {
    /// Signed distance of a point, positive in front.
    pub fn distance(&self, point: Vec3) -> f32 {
        self.normal.dot(point) - self.dist
    }
}

impl Record for Plane {
    const STRIDE: usize = 16;
    fn decode(mut f: Fields<'_>) -> Self {
        Plane {
            normal: f.vec3(),
            dist: f.f32(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_vec3(self.normal);
        out.put_f32(self.dist);
    }
}

/// Lump 3: an inner node of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Node {
    /// The splitting plane.
    pub plane: PlaneId,
    /// Front and back child.
    pub children: [Child; 2],
    /// Smallest corner of the bounds, id units.
    pub mins: [i32; 3],
    /// Largest corner of the bounds, id units.
    pub maxs: [i32; 3],
}

impl Record for Node {
    const STRIDE: usize = 36;
    fn decode(mut f: Fields<'_>) -> Self {
        Node {
            plane: PlaneId(f.i32()),
            children: [Child::from_raw(f.i32()), Child::from_raw(f.i32())],
            mins: f.ivec3(),
            maxs: f.ivec3(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_i32(self.plane.0);
        out.put_i32(self.children[0].raw());
        out.put_i32(self.children[1].raw());
        out.put_ivec3(self.mins);
        out.put_ivec3(self.maxs);
    }
}

/// Lump 4: a convex cell of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Leaf {
    /// Visibility cluster, below [`crate::Bsp::num_clusters`]; -1 for solid space and outside.
    pub cluster: i32,
    /// Area that doors separate; -1 likewise. Not used as an index here, and not checked.
    pub area: i32,
    /// Smallest corner of the bounds, id units.
    pub mins: [i32; 3],
    /// Largest corner of the bounds, id units.
    pub maxs: [i32; 3],
    /// First of this leaf's entries in [`crate::Bsp::leaf_surfaces`].
    pub first_leaf_surface: i32,
    /// Number of them.
    pub num_leaf_surfaces: i32,
    /// First of this leaf's entries in [`crate::Bsp::leaf_brushes`].
    pub first_leaf_brush: i32,
    /// Number of them.
    pub num_leaf_brushes: i32,
}

impl Leaf {
    /// The cluster as an index; `None` in solid space and outside.
    pub fn cluster_index(&self) -> Option<usize> {
        usize::try_from(self.cluster).ok()
    }
}

impl Record for Leaf {
    const STRIDE: usize = 48;
    fn decode(mut f: Fields<'_>) -> Self {
        Leaf {
            cluster: f.i32(),
            area: f.i32(),
            mins: f.ivec3(),
            maxs: f.ivec3(),
            first_leaf_surface: f.i32(),
            num_leaf_surfaces: f.i32(),
            first_leaf_brush: f.i32(),
            num_leaf_brushes: f.i32(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_i32(self.cluster);
        out.put_i32(self.area);
        out.put_ivec3(self.mins);
        out.put_ivec3(self.maxs);
        out.put_i32(self.first_leaf_surface);
        out.put_i32(self.num_leaf_surfaces);
        out.put_i32(self.first_leaf_brush);
        out.put_i32(self.num_leaf_brushes);
    }
}

/// Lump 11 is plain integers.
impl Record for i32 {
    const STRIDE: usize = 4;
    fn decode(mut f: Fields<'_>) -> Self {
        f.i32()
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_i32(*self);
    }
}

/// Lump 7: the world or a brush model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Model {
    /// Smallest corner. For model 0 these are the compiler's bounds, which the light grid is laid out
    /// by; geometry may lie outside.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub mins: Vec3,
    /// Largest corner.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub maxs: Vec3,
    /// First surface.
    pub first_surface: i32,
    /// Number of surfaces.
    pub num_surfaces: i32,
    /// First brush.
    pub first_brush: i32,
    /// Number of brushes.
    pub num_brushes: i32,
}

impl Record for Model {
    const STRIDE: usize = 40;
    fn decode(mut f: Fields<'_>) -> Self {
        Model {
            mins: f.vec3(),
            maxs: f.vec3(),
            first_surface: f.i32(),
            num_surfaces: f.i32(),
            first_brush: f.i32(),
            num_brushes: f.i32(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_vec3(self.mins);
        out.put_vec3(self.maxs);
        out.put_i32(self.first_surface);
        out.put_i32(self.num_surfaces);
        out.put_i32(self.first_brush);
        out.put_i32(self.num_brushes);
    }
}

/// Lump 8: the intersection of the half-spaces `normal · p <= dist` of its sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Brush {
    /// First side. Compilers write the six axial sides first: -x +x -y +y -z +z.
    pub first_side: i32,
    /// Number of sides.
    pub num_sides: i32,
    /// Shader whose content flags say what the brush is.
    pub shader: ShaderId,
}

impl Record for Brush {
    const STRIDE: usize = 12;
    fn decode(mut f: Fields<'_>) -> Self {
        Brush {
            first_side: f.i32(),
            num_sides: f.i32(),
            shader: ShaderId(f.i32()),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_i32(self.first_side);
        out.put_i32(self.num_sides);
        out.put_i32(self.shader.0);
    }
}

/// Lump 9: one side of a brush.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BrushSide {
    /// Plane, normal outwards.
    pub plane: PlaneId,
    /// Shader.
    pub shader: ShaderId,
}

impl Record for BrushSide {
    const STRIDE: usize = 8;
    fn decode(mut f: Fields<'_>) -> Self {
        BrushSide {
            plane: PlaneId(f.i32()),
            shader: ShaderId(f.i32()),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_i32(self.plane.0);
        out.put_i32(self.shader.0);
    }
}

/// Lump 10: a vertex, or a control point of a patch. Values are as stored and may be NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DrawVert {
    /// Position, id units.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub position: Vec3,
    /// Texture coordinates; t = 0 is the first image row.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub st: Vec2,
    /// Coordinates in the lightmap page, 0 to 1.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub lightmap: Vec2,
    /// Unit normal; zero in some files.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub normal: Vec3,
    /// Red, green, blue before the over-bright shift, and alpha.
    pub color: [u8; 4],
}

impl DrawVert {
    /// The vertex with every component that is NaN or infinite set to 0.
    pub fn finite(&self) -> DrawVert {
        let clean = |v: f32| if v.is_finite() { v } else { 0.0 };
        DrawVert {
            position: self.position.map(clean),
            st: self.st.map(clean),
            lightmap: self.lightmap.map(clean),
            normal: self.normal.map(clean),
            color: self.color,
        }
    }

    /// Whether no component is NaN or infinite.
    pub fn is_finite(&self) -> bool {
        self.position.is_finite()
            && self.st.is_finite()
            && self.lightmap.is_finite()
            && self.normal.is_finite()
    }

    /// The point half way on the segment: positions and coordinates in float, colours by integer
    /// halving; the normal of `self` (patches compute normals afterwards).
    pub(crate) fn halfway(&self, other: &DrawVert) -> DrawVert {
        let mut color = self.color;
        for (c, o) in color.iter_mut().zip(other.color) {
            *c = ((u16::from(*c) + u16::from(o)) >> 1) as u8;
        }
        DrawVert {
            position: (self.position + other.position) * 0.5,
            st: (self.st + other.st) * 0.5,
            lightmap: (self.lightmap + other.lightmap) * 0.5,
            normal: self.normal,
            color,
        }
    }
}

impl Record for DrawVert {
    const STRIDE: usize = 44;
    fn decode(mut f: Fields<'_>) -> Self {
        DrawVert {
            position: f.vec3(),
            st: f.vec2(),
            lightmap: f.vec2(),
            normal: f.vec3(),
            color: f.bytes(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.put_vec3(self.position);
        out.put_vec2(self.st);
        out.put_vec2(self.lightmap);
        out.put_vec3(self.normal);
        out.extend_from_slice(&self.color);
    }
}

/// Lump 12: a fog volume as stored.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fog {
    /// Shader whose `fogParms` give colour and depth.
    pub shader: String,
    /// The name field as stored.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub raw_shader: [u8; 64],
    /// The brush, which has at least six sides; -1 for fog that fills the world.
    pub brush: i32,
    /// Side of the brush (relative to its first) through which one looks into the fog; -1 for none.
    pub visible_side: i32,
}

impl Fog {
    /// The brush; `None` for fog that fills the world.
    pub fn brush_id(&self) -> Option<BrushId> {
        (self.brush >= 0).then_some(BrushId(self.brush))
    }
}

impl Record for Fog {
    const STRIDE: usize = 72;
    fn decode(mut f: Fields<'_>) -> Self {
        let raw_shader = f.bytes();
        Fog {
            shader: name_text(&raw_shader),
            raw_shader,
            brush: f.i32(),
            visible_side: f.i32(),
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&name_field(&self.shader, &self.raw_shader));
        out.put_i32(self.brush);
        out.put_i32(self.visible_side);
    }
}

/// Texels per side of a lightmap page of `IBSP` and `RBSP`; others have other sizes, see [`Lightmap::size`].
pub const LIGHTMAP_SIZE: usize = 128;

/// Bytes of such a page.
pub const LIGHTMAP_BYTES: usize = LIGHTMAP_SIZE * LIGHTMAP_SIZE * 3;

/// Lump 14: one square page of texels, red green blue, first row first, before the over-bright shift. All pages of a
/// map have the same size, that of its format ([`crate::Bsp::lightmap_size`]).
#[derive(Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lightmap(
    /// The bytes.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub Box<[u8]>,
);

impl std::fmt::Debug for Lightmap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Lightmap({} bytes)", self.0.len())
    }
}

impl Lightmap {
    /// Texels per side.
    pub fn size(&self) -> usize {
        (self.0.len() / 3).isqrt()
    }

    /// The texel at column `x`, row `y`; coordinates beyond the page are clamped to its edge.
    pub fn texel(&self, x: usize, y: usize) -> [u8; 3] {
        let size = self.size();
        let most = size.saturating_sub(1);
        let at = (y.min(most) * size + x.min(most)) * 3;
        match self.0.get(at..at + 3) {
            Some(&[r, g, b]) => [r, g, b],
            _ => [0; 3],
        }
    }
}

/// Lump 15: light that arrives at one point of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(from = "GridPointForm", into = "GridPointForm")
)]
pub struct GridPoint {
    /// Light from everywhere; all zero when the point is inside a wall.
    pub ambient: [u8; 3],
    /// Light from the direction below.
    pub directed: [u8; 3],
    /// Angle from the z axis in 1/256 turns (byte 6).
    pub longitude: u8,
    /// Angle around the z axis in 1/256 turns (byte 7).
    pub latitude: u8,
}

/// A serialized [`GridPoint`], without keys because there are many: ambient, directed, angles.
#[cfg(feature = "serde")]
type GridPointForm = ([u8; 3], [u8; 3], [u8; 2]);

#[cfg(feature = "serde")]
impl From<GridPoint> for GridPointForm {
    fn from(point: GridPoint) -> GridPointForm {
        let angles = [point.longitude, point.latitude];
        (point.ambient, point.directed, angles)
    }
}

#[cfg(feature = "serde")]
impl From<GridPointForm> for GridPoint {
    fn from((ambient, directed, [longitude, latitude]): GridPointForm) -> GridPoint {
        GridPoint {
            ambient,
            directed,
            longitude,
            latitude,
        }
    }
}

impl GridPoint {
    /// Unit vector towards the light.
    pub fn direction(&self) -> Vec3 {
        let turn = std::f32::consts::TAU / 256.0;
        let (sin_lat, cos_lat) = (f32::from(self.latitude) * turn).sin_cos();
        let (sin_long, cos_long) = (f32::from(self.longitude) * turn).sin_cos();
        Vec3::new(cos_lat * sin_long, sin_lat * sin_long, cos_long)
    }
}

impl Record for GridPoint {
    const STRIDE: usize = 8;
    fn decode(mut f: Fields<'_>) -> Self {
        let ambient = f.bytes();
        let directed = f.bytes();
        let [longitude, latitude] = f.bytes();
        GridPoint {
            ambient,
            directed,
            longitude,
            latitude,
        }
    }
    fn encode(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.ambient);
        out.extend_from_slice(&self.directed);
        out.push(self.longitude);
        out.push(self.latitude);
    }
}
