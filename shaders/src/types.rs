//! The structures that Rust and GLSL share. The build script writes them as `generated/types.glsl`; a test compares
//! their member offsets with those in the compiled SPIR-V.
//!
//! All layouts are `layout(scalar)`: a `Vec3` takes 12 bytes and aligns to 4; a `vec4` is `[f32; 4]` here, because
//! glam's `Vec4` aligns to 16. Addresses are buffer device addresses.

#![allow(clippy::struct_excessive_bools)]

pub mod constants;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A vertex: of the world in world space, of moving geometry in the space of its [`Instance`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Vertex {
    /// Position, id Tech units.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Texture coordinates; (0, 0) is the image's first texel.
    pub st: Vec2,
    /// Lightmap coordinates within the page of the draw.
    pub lightmap: Vec2,
    /// RGBA8, red in the lowest byte; encoded as displayed, overbright shift applied.
    pub color: u32,
}

/// Tangent and light direction of a vertex of the world, for normal and specular mapping, in the space of the vertex. The
/// array is parallel to that of the vertices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MappedVertex {
    /// Unit tangent along s, as MikkTSpace; zero if the texture coordinates define none.
    pub tangent: Vec3,
    /// Unit direction from which most of the baked light comes.
    pub light: Vec3,
}

/// A periodic function: `base + table(function, phase + time * frequency) * amplitude`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Wave {
    /// One of the `WAVE_*` constants.
    pub function: u32,
    /// Added to the table's value.
    pub base: f32,
    /// Scale of the table's value.
    pub amplitude: f32,
    /// Phase, in periods.
    pub phase: f32,
    /// Periods per second.
    pub frequency: f32,
}

/// One `tcMod`; the meaning of `values` depends on `kind` (see `material.glsl`).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TcMod {
    /// One of the `TCMOD_*` constants.
    pub kind: u32,
    /// Parameters: scale, scroll: (s, t); rotate: degrees per second; transform: m00 m01 m10 m11 t0 t1.
    pub values: [f32; 6],
    /// The wave of `stretch`; amplitude, phase and frequency of `turb`.
    pub wave: Wave,
}

/// One stage of a material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Stage {
    /// First of the stage's images in the image list (an array of bindless texture indices).
    pub image_first: u32,
    /// Number of images of the animation; 1: a plain map; 0: the lightmap of the draw.
    pub image_count: u32,
    /// Images per second of an animation.
    pub image_frequency: f32,
    /// Index of the sampler.
    pub sampler_index: u32,
    /// One of the `TCGEN_*` constants.
    pub tc_gen: u32,
    /// `tcGen vector`: the axis of s.
    pub vector_s: Vec3,
    /// `tcGen vector`: the axis of t.
    pub vector_t: Vec3,
    /// First of the stage's `tcMod`s.
    pub tc_mod_first: u32,
    /// Number of `tcMod`s.
    pub tc_mod_count: u32,
    /// One of the `RGBGEN_*` constants.
    pub rgb_gen: u32,
    /// One of the `ALPHAGEN_*` constants.
    pub alpha_gen: u32,
    /// `rgbGen const` and `alphaGen const`, 0..1.
    pub constant: [f32; 4],
    /// `rgbGen wave`.
    pub rgb_wave: Wave,
    /// `alphaGen wave`.
    pub alpha_wave: Wave,
    /// `alphaGen portal`: distance at which alpha reaches 1.
    pub portal_range: f32,
    /// One of the `ALPHAFUNC_*` constants.
    pub alpha_func: u32,
    /// Source blend factor, `BLEND_*`; `BLEND_ONE` with a destination of `BLEND_ZERO`: no blending.
    pub blend_src: u32,
    /// Destination blend factor, `BLEND_*`.
    pub blend_dst: u32,
    /// `STAGE_*` bits.
    pub flags: u32,
}

/// Optical properties of glass and liquids; all zero for other materials.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Dielectric {
    /// Refractive index behind the surface; 0: no refraction and no reflection.
    pub index: f32,
    /// Root mean square slope of the ripples.
    pub ripple: f32,
    /// Factor of the background's blend factor, so that a surface transmits no more light than it receives.
    pub scale: f32,
    /// 1: tints the light that passes it.
    pub filters: u32,
    /// Transmittance, the mean over the surface.
    pub filter_color: Vec3,
    /// Absorption behind the surface, per unit of length (Beer's law).
    pub absorption: Vec3,
}

/// Specular reflection of an opaque surface; all zero for materials without. Colours are linear.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Specular {
    /// Perceptual roughness, 0 to 1: its square is the width alpha of the GGX distribution. Of `MATERIAL_ROUGH` alone.
    pub roughness: f32,
    /// Part of the surface that is metal, 0 to 1: its colour is that of the reflection, and it scatters nothing.
    pub metal: f32,
    /// Reflectance at normal incidence of the part that is no metal.
    pub reflectance: Vec3,
    /// Bindless texture of factors of roughness (green) and metal (blue), or with `MATERIAL_SPECULAR_MAP` of the reflectance,
    /// display-encoded, and of 1 - roughness (alpha); `NO_TEXTURE`: none.
    pub map: u32,
    /// Bindless texture of normals in the tangent space of the texture coordinates. Of `MATERIAL_NORMALS` alone.
    pub normals: u32,
    /// Bindless emissive texture, display-encoded. Of `MATERIAL_GLOWS` alone.
    pub glow: u32,
    /// Radiance of the white of `glow`.
    pub glow_radiance: f32,
    /// Bindless sampler of all.
    pub sampler_index: u32,
    /// Stage that has the texture coordinates of the maps; `NO_STAGE`: those of the vertices.
    pub stage: u32,
    /// Factors of the normals' first two components; the third completes them to unit length.
    pub normal_scale: Vec2,
    /// Depth of the normal map's alpha of 0 below one of 1, in texture coordinates. Of `MATERIAL_HEIGHTS` alone.
    pub depth: f32,
    /// Part of the light that the surface mirrors sharply, beside its stages.
    pub mirror: Vec3,
}

/// A material: a run of stages, and properties for the tracer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Material {
    /// First stage.
    pub stage_first: u32,
    /// Number of stages.
    pub stage_count: u32,
    /// `MATERIAL_*` bits.
    pub flags: u32,
    /// Seconds subtracted from shader time (`RemapShader`).
    pub time_offset: f32,
    /// `clampTime`, or a very large number.
    pub clamp_time: f32,
    /// Bindless texture of a material that is one still image under light, so that rays skip its stages; `NO_TEXTURE`
    /// for all others. With `MATERIAL_VERTEX_LIGHT` this holds for the map's own surfaces only.
    pub plain_image: u32,
    /// Bindless sampler of `plain_image`.
    pub plain_sampler: u32,
    /// Extra radiance of the surface as a light, display-white units, shown as its emission; 0: none.
    pub light_radiance: Vec3,
    /// Factor of the reflected light beside its stages (`q3map_lightmapBrightness`).
    pub lit_scale: f32,
    /// Optical properties of glass and liquids.
    pub dielectric: Dielectric,
    /// Specular reflection.
    pub specular: Specular,
}

/// One entity (or the world, index 0) of a view.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Instance {
    /// The entity's axes as columns: `world = axis * local + origin`.
    pub axis: [Vec3; 3],
    /// Origin of the entity, world space.
    pub origin: Vec3,
    /// Camera position in the entity's space (for environment mapping and specular alpha).
    pub viewer: Vec3,
    /// `shaderRGBA`, 0..1.
    pub color: [f32; 4],
    /// `shaderTexCoord`, for `tcMod entityTranslate`.
    pub texcoord: Vec2,
    /// Shader time in seconds: view time minus the entity's.
    pub time: f32,
    /// Ambient light from the grid, 0..1 (of 255), engine's scales applied.
    pub ambient: Vec3,
    /// Directed light, 0..1 and above.
    pub directed: Vec3,
    /// Unit direction towards that light, in the entity's space.
    pub light_direction: Vec3,
    /// Part of `ambient` that is not light of the place: the engine adds it to the light of every model.
    pub added: f32,
    /// `INSTANCE_*` bits.
    pub flags: u32,
}

/// Material and instance of a primitive of an acceleration structure.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Triangle {
    /// Vertex indices into the geometry's vertex array.
    pub indices: [u32; 3],
    /// Index of the material.
    pub material: u32,
    /// Index of the instance (entity); with `TRIANGLE_STATIC` the index of its surface in the map.
    pub instance: u32,
    /// Index of the fog volume plus one; 0: none.
    pub fog: u32,
    /// Bindless texture index of the lightmap page, or `NO_TEXTURE`.
    pub lightmap: u32,
    /// `TRIANGLE_*` bits.
    pub flags: u32,
}

/// A fog volume.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Fog {
    /// Lower corner of the box.
    pub mins: Vec3,
    /// Upper corner of the box.
    pub maxs: Vec3,
    /// Fog surface: `normal.p - distance` is the depth below it; valid if `has_surface`.
    pub plane: [f32; 4],
    /// `FOG_SURFACE_*`; 0: the volume has none.
    pub has_surface: u32,
    /// Colour, as displayed (encoded).
    pub color: Vec3,
    /// Depth at which the fog is opaque, units.
    pub depth: f32,
    /// Mean radiance of the map's lights at points in the volume; read by the traced look only.
    pub own_light: Vec3,
}

/// Device addresses of the materials' arrays.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct MaterialBuffers {
    /// [`Material`]s.
    pub materials: u64,
    /// [`Stage`]s.
    pub stages: u64,
    /// [`TcMod`]s.
    pub tc_mods: u64,
    /// The image list: bindless texture indices (`u32`).
    pub images: u64,
    /// The noise lattice of `rgbGen wave noise`: 256 values (`f32`), then the permutation (256 `u32`).
    pub noise: u64,
}

/// Parameters shared by all draws of a classic view.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RasterView {
    /// World to clip space, columns.
    pub world_to_clip: [[f32; 4]; 4],
    /// Only the positive side of `xyz.p = w` is drawn; zero: everything.
    pub clip_plane: [f32; 4],
    /// Camera position, world space.
    pub origin: Vec3,
    /// View direction, world space.
    pub forward: Vec3,
    /// `identityLight`: 1 over 2 to the power of the overbright bits.
    pub identity_light: f32,
    /// 0: dynamic lights skip surfaces that face away (`r_dlightBacks`).
    pub light_backs: u32,
    /// Materials.
    pub materials: MaterialBuffers,
    /// The world's [`Vertex`] array.
    pub static_vertices: u64,
    /// The world's [`MappedVertex`] array; 0 if no draw needs it.
    pub mapped_vertices: u64,
    /// [`Vertex`] array of moving geometry.
    pub dynamic_vertices: u64,
    /// [`Instance`]s.
    pub instances: u64,
    /// [`Draw`]s.
    pub draws: u64,
    /// [`Fog`]s.
    pub fogs: u64,
    /// [`RasterLight`]s.
    pub lights: u64,
}

/// Most stages of one draw of the classic look, as an array length; not in GLSL.
pub const DRAW_STAGES: usize = constants::DRAW_STAGES as usize;

/// One draw call of the classic look, apart from its specialization constants.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Draw {
    /// For each stage, the bindless index of its texture in the lower 24 bits and of its sampler in the upper 8.
    pub textures: [u32; DRAW_STAGES],
    /// Indices of the stages, for values evaluated per vertex.
    pub stages: [u32; DRAW_STAGES],
    /// Combined `tcMod`s of each stage that are equal for all vertices:
    /// `s' = s m[0] + t m[2] + m[4]`, `t' = s m[1] + t m[3] + m[5]`.
    pub texcoords: [[f32; 6]; DRAW_STAGES],
    /// Components of each stage's colour that are equal for all vertices; 1 for the others. `DRAW_PIXEL_LIGHT`: factor of
    /// the light's colour, highlight's reflectance (negative: factor of the texture), exponent, 1: faces have two sides.
    pub colors: [[f32; 4]; DRAW_STAGES],
    /// The material's time, seconds.
    pub time: f32,
    /// Index of the instance.
    pub instance: u32,
    /// Index of the fog volume plus one; 0: none.
    pub fog: u32,
    /// Index of the dynamic light (`DRAW_LIGHT`, `DRAW_PIXEL_LIGHT`).
    pub light: u32,
    /// 1: the vertices are in `dynamic_vertices`.
    pub dynamic_vertices: u32,
    /// Index of the material, of draws with normal or specular mapping.
    pub material: u32,
}

/// A dynamic light as the classic look draws it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RasterLight {
    /// Position, world space.
    pub origin: Vec3,
    /// Radius, units.
    pub radius: f32,
    /// Colour, nominally 0..1.
    pub color: Vec3,
}

/// What rays found for a pixel of half the picture's size, in the hybrid look.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct HybridTexel {
    /// Bit i: something is between the surface and dynamic light i.
    pub occluded_lights: u32,
    /// Part of the hemisphere, weighted by the cosine, that models occlude.
    pub occlusion: f32,
    /// 1 over the depth `w` of clip space; 0: no surface of the map.
    pub inverse_depth: f32,
    /// Unit normal of the surface, octahedral, two 16-bit signed normalized values.
    pub normal: u32,
}

/// The mirrored scene in a pixel of half the picture's size, in the hybrid look.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct HybridReflection {
    /// 1 over the depth `w` of the reflecting surface; 0: there is none.
    pub inverse_depth: f32,
    /// Colour as displayed, four 8-bit unsigned normalized values.
    pub color: u32,
}

/// A view of the hybrid look: input of its rays, and their results as draws read them.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct HybridView {
    /// [`HybridTexel`]s.
    pub texels: u64,
    /// The same between the steps of the filter.
    pub between: u64,
    /// [`HybridReflection`]s; 0: no surface in sight reflects.
    pub reflections: u64,
    /// [`RasterLight`]s of the view.
    pub lights: u64,
    /// Number of lights, at most 32.
    pub light_count: u32,
    /// Storage image of the surfaces of the map, RGBA32F: octahedral normal, 0, 1 over `w`.
    pub surfaces: u32,
    /// The same of the nearest reflecting surfaces; the third value is 1 of first-person models.
    pub mirrors: u32,
    /// See [`RasterView::identity_light`].
    pub identity_light: f32,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Centre of projection.
    pub eye: Vec3,
    /// A point at depth `w` of the texel (x, y) is `eye + w (corner + x right + y down)`.
    pub corner: Vec3,
    /// See `corner`.
    pub right: Vec3,
    /// See `corner`.
    pub down: Vec3,
}

/// A flare: point of its visibility test, and its square.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Flare {
    /// Colour at full brightness, 0..255.
    pub color: Vec3,
    /// Half the side of its square, pixels.
    pub size: f32,
    /// Centre of the square, pixels of the window.
    pub center: Vec2,
    /// Pixel of the window at which depth is tested.
    pub pixel: [u32; 2],
    /// Depth of the test: passes if the depth image holds this or more.
    pub depth: f32,
    /// Index of its [`FlareState`].
    pub slot: u32,
    /// 1: the slot holds the state of another flare, or none.
    pub fresh: u32,
    /// Position, world space.
    pub at: Vec3,
    /// Length of the segment from the camera to the flare that must be free, units.
    pub reach: f32,
}

/// The image of the sun: a square in the sky (`r_drawSun`).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SunDisc {
    /// Unit vector towards it.
    pub direction: Vec3,
    /// Index of its material; `NO_TEXTURE`: no sun is drawn.
    pub material: u32,
    /// Unit vector to the left of the image.
    pub left: Vec3,
    /// Half the side of the square, relative to its distance.
    pub size: f32,
}

/// State of a flare between frames.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct FlareState {
    /// 1: the test has passed in this frame.
    pub seen: u32,
    /// 1: the test had passed at the last evaluation.
    pub visible: u32,
    /// Time of the last change, milliseconds of the view's time.
    pub since: i32,
}
