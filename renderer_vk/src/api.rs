//! Types of a front end's calls: entities, polygons and views, in the engine's terms as safe types.
//!
//! Space: id Tech units, x forward, y left, z up. Angles: degrees. Time: milliseconds. Colours: display-encoded.

use glam::{Vec2, Vec3};

pub use crate::settings::Look;

/// Kind of a scene entity (`refEntityType_t`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum EntityKind {
    /// A model, inline BSP models included.
    #[default]
    Model,
    /// Part of the engine's interface, but an error when drawn.
    Poly,
    /// A quad that faces the camera.
    Sprite,
    /// A red tube.
    Beam,
    /// The core of a rail trail.
    RailCore,
    /// The rings of a rail trail.
    RailRings,
    /// A lightning bolt.
    Lightning,
    /// Invisible: marks the plane of a portal or mirror.
    PortalSurface,
}

/// `renderfx` bits of an entity.
pub mod renderfx {
    #![allow(missing_docs)]
    pub const MIN_LIGHT: u32 = 0x1;
    pub const THIRD_PERSON: u32 = 0x2;
    pub const FIRST_PERSON: u32 = 0x4;
    pub const DEPTH_HACK: u32 = 0x8;
    pub const CROSSHAIR: u32 = 0x10;
    pub const NO_SHADOW: u32 = 0x40;
    pub const LIGHTING_ORIGIN: u32 = 0x80;
    pub const SHADOW_PLANE: u32 = 0x100;
    pub const WRAP_FRAMES: u32 = 0x200;
}

/// `rdflags` bits of a view.
pub mod rdflags {
    #![allow(missing_docs)]
    pub const NO_WORLD_MODEL: u32 = 0x1;
    pub const HYPERSPACE: u32 = 0x4;
}

/// An entity to draw (`refEntity_t`).
#[derive(Clone, Copy, Debug, Default)]
#[allow(missing_docs)] // the engine's fields under its names
pub struct RefEntity {
    pub kind: EntityKind,
    pub renderfx: u32,
    pub model: i32,
    pub lighting_origin: Vec3,
    pub shadow_plane: f32,
    pub axis: [Vec3; 3],
    pub non_normalized_axes: bool,
    pub origin: Vec3,
    pub frame: i32,
    pub old_origin: Vec3,
    pub old_frame: i32,
    /// 0 = `frame`, 1 = `old_frame`.
    pub backlerp: f32,
    pub skin_num: i32,
    pub custom_skin: i32,
    pub custom_shader: i32,
    pub shader_rgba: [u8; 4],
    pub shader_texcoord: Vec2,
    /// Seconds, subtracted from the view's time.
    pub shader_time: f32,
    pub radius: f32,
    /// Sprites: degrees.
    pub rotation: f32,
}

/// A corner of a polygon (`polyVert_t`).
#[derive(Clone, Copy, Debug, Default)]
#[allow(missing_docs)]
pub struct PolyVert {
    pub position: Vec3,
    pub st: Vec2,
    pub rgba: [u8; 4],
}

/// A view to draw (`refdef_t`).
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct RefDef {
    /// Pixels from the left and the top of the window.
    pub x: i32,
    pub y: i32,
    pub width: i32,
    pub height: i32,
    /// Full angles, degrees.
    pub fov_x: f32,
    pub fov_y: f32,
    pub view_origin: Vec3,
    /// Forward, left, up.
    pub view_axis: [Vec3; 3],
    pub time_ms: i32,
    pub flags: u32,
    /// A set bit hides that area.
    pub area_mask: [u8; 32],
    /// Strings of `deformVertexes text0..7`, NUL-terminated.
    pub text: [[u8; 32]; 8],
    /// Draws the view in this look instead of that of the settings.
    pub look: Option<Look>,
    /// Draws only this part of the view: left, top, width, height, window pixels. The traced look draws all of it.
    pub part: Option<[i32; 4]>,
}

/// A free camera for held views (`rt_pause`). It shows what other people see: the player's body instead of the
/// first-person weapon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeCamera {
    /// Position.
    pub origin: Vec3,
    /// Forward, left, up.
    pub axis: [Vec3; 3],
    /// Full vertical angle, degrees. The horizontal one follows from the view's size.
    pub fov_y: f32,
}

/// A finished still picture.
#[derive(Clone, Debug)]
pub struct StillPicture {
    /// As the display would show it.
    pub picture: Picture,
    /// The linear picture before exposure, if it was requested; display white has radiance 1.
    pub radiance: Option<Vec<[f32; 3]>>,
}

impl Default for RefDef {
    fn default() -> Self {
        Self {
            x: 0,
            y: 0,
            width: 640,
            height: 480,
            fov_x: 90.0,
            fov_y: 73.739_8,
            view_origin: Vec3::ZERO,
            view_axis: [Vec3::X, Vec3::Y, Vec3::Z],
            time_ms: 0,
            flags: 0,
            area_mask: [0; 32],
            text: [[0; 32]; 8],
            look: None,
            part: None,
        }
    }
}

/// A dynamic light as the game sends it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DynamicLight {
    /// Position.
    pub origin: Vec3,
    /// Reach, units (the engine calls it intensity).
    pub radius: f32,
    /// Nominally 0..1.
    pub color: Vec3,
    /// Added to surfaces instead of modulating them.
    pub additive: bool,
    /// The other end of a light along a line, which the classic look draws at `origin` alone; `None` for a light at a
    /// point.
    pub end: Option<Vec3>,
}

/// A piece of a decal clipped to the world (`markFragment_t`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MarkFragment {
    /// Index of its first point.
    pub first_point: usize,
    /// Number of points.
    pub num_points: usize,
}

/// Position and axes of a tag (`orientation_t`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Origin.
    pub origin: Vec3,
    /// Forward, left, up.
    pub axis: [Vec3; 3],
}

/// Result of `light_for_point`, on a scale of 0..255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLighting {
    /// Ambient light.
    pub ambient: Vec3,
    /// Directed light.
    pub directed: Vec3,
    /// Unit vector towards the directed light.
    pub direction: Vec3,
}

/// A picture read back from the frame: RGB8, rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// `width * height * 3` bytes.
    pub rgb: Vec<u8>,
}

/// A rectangle of the window that a material is stretched over (`DrawStretchPic`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StretchedPicture {
    /// Left top corner, window pixels.
    pub position: Vec2,
    /// Width and height, window pixels; if one is negative, the back of the picture is shown.
    pub size: Vec2,
    /// Texture coordinates of the left top corner.
    pub st1: Vec2,
    /// Texture coordinates of the right bottom corner.
    pub st2: Vec2,
}

/// Pixels of a cinematic (`DrawStretchRaw`, `UploadCinematic`).
#[derive(Clone, Copy, Debug)]
pub struct CinematicFrame<'a> {
    /// Width in pixels.
    pub cols: u32,
    /// Height in pixels.
    pub rows: u32,
    /// RGBA8, rows from the top.
    pub rgba: &'a [u8],
    /// The engine's number of the cinematic. Each number has its own texture.
    pub client: usize,
    /// The pixels have changed. Otherwise a texture of the same size keeps its content.
    pub dirty: bool,
}

/// A vertex of a user interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UiVertex {
    /// Window pixels from the left and the top.
    pub position: Vec2,
    /// Texture coordinates.
    pub st: Vec2,
    /// Display-encoded colour, multiplied by alpha.
    pub rgba: [u8; 4],
}

/// Triangles of a user interface with one texture.
#[derive(Clone, Debug, Default)]
pub struct UiMesh {
    /// Number of a [`UiTexture`].
    pub texture: u64,
    /// Left top and right bottom corner of the rectangle that is drawn, window pixels.
    pub clip: [Vec2; 2],
    /// Corners.
    pub vertices: Vec<UiVertex>,
    /// Three for each triangle.
    pub indices: Vec<u32>,
}

/// A texture of a user interface.
#[derive(Clone, Debug)]
pub struct UiTexture {
    /// Its number; a texture that has it is replaced.
    pub id: u64,
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// `width * height * 4` bytes, display-encoded, multiplied by alpha, rows from the top.
    pub rgba: Vec<u8>,
}

/// A frame of a user interface, drawn over the picture.
#[derive(Clone, Debug, Default)]
pub struct UiFrame {
    /// New and changed textures.
    pub textures: Vec<UiTexture>,
    /// Numbers of textures that no later frame uses.
    pub dropped: Vec<u64>,
    /// Meshes in drawing order.
    pub meshes: Vec<UiMesh>,
}
