//! Constants that Rust and GLSL share: kinds and bits of flags. The build script writes them as `generated/types.glsl`.
#![allow(missing_docs)] // the comment of a group's first constant describes the group; some names need none

/// No texture.
pub const NO_TEXTURE: u32 = 0xFFFF_FFFF;
/// No stage.
pub const NO_STAGE: u32 = 0xFFFF_FFFF;

pub const WAVE_SIN: u32 = 0;
pub const WAVE_SQUARE: u32 = 1;
pub const WAVE_TRIANGLE: u32 = 2;
pub const WAVE_SAWTOOTH: u32 = 3;
pub const WAVE_INVERSE_SAWTOOTH: u32 = 4;
pub const WAVE_NOISE: u32 = 5;

pub const TCMOD_TURBULENT: u32 = 0;
pub const TCMOD_SCALE: u32 = 1;
pub const TCMOD_SCROLL: u32 = 2;
pub const TCMOD_STRETCH: u32 = 3;
pub const TCMOD_TRANSFORM: u32 = 4;
pub const TCMOD_ROTATE: u32 = 5;
pub const TCMOD_ENTITY_TRANSLATE: u32 = 6;

pub const TCGEN_BASE: u32 = 0;
pub const TCGEN_LIGHTMAP: u32 = 1;
pub const TCGEN_ENVIRONMENT: u32 = 2;
pub const TCGEN_VECTOR: u32 = 3;

pub const RGBGEN_IDENTITY: u32 = 0;
pub const RGBGEN_IDENTITY_LIGHTING: u32 = 1;
pub const RGBGEN_WAVE: u32 = 2;
pub const RGBGEN_CONST: u32 = 3;
pub const RGBGEN_ENTITY: u32 = 4;
pub const RGBGEN_ONE_MINUS_ENTITY: u32 = 5;
pub const RGBGEN_VERTEX: u32 = 6;
pub const RGBGEN_EXACT_VERTEX: u32 = 7;
pub const RGBGEN_ONE_MINUS_VERTEX: u32 = 8;
pub const RGBGEN_LIGHTING_DIFFUSE: u32 = 9;

pub const ALPHAGEN_IDENTITY: u32 = 0;
pub const ALPHAGEN_CONST: u32 = 1;
pub const ALPHAGEN_WAVE: u32 = 2;
pub const ALPHAGEN_ENTITY: u32 = 3;
pub const ALPHAGEN_ONE_MINUS_ENTITY: u32 = 4;
pub const ALPHAGEN_VERTEX: u32 = 5;
pub const ALPHAGEN_ONE_MINUS_VERTEX: u32 = 6;
pub const ALPHAGEN_LIGHTING_SPECULAR: u32 = 7;
pub const ALPHAGEN_PORTAL: u32 = 8;

pub const ALPHAFUNC_NONE: u32 = 0;
pub const ALPHAFUNC_GT0: u32 = 1;
pub const ALPHAFUNC_LT128: u32 = 2;
pub const ALPHAFUNC_GE128: u32 = 3;

pub const BLEND_ZERO: u32 = 0;
pub const BLEND_ONE: u32 = 1;
pub const BLEND_DST_COLOR: u32 = 2;
pub const BLEND_ONE_MINUS_DST_COLOR: u32 = 3;
pub const BLEND_SRC_ALPHA: u32 = 4;
pub const BLEND_ONE_MINUS_SRC_ALPHA: u32 = 5;
pub const BLEND_DST_ALPHA: u32 = 6;
pub const BLEND_ONE_MINUS_DST_ALPHA: u32 = 7;
pub const BLEND_SRC_ALPHA_SATURATE: u32 = 8;
pub const BLEND_SRC_COLOR: u32 = 9;
pub const BLEND_ONE_MINUS_SRC_COLOR: u32 = 10;

/// The stage's image is white.
pub const STAGE_WHITE: u32 = 1;
/// The stage writes depth.
pub const STAGE_DEPTH_WRITE: u32 = 2;
/// The stage tests depth for equality.
pub const STAGE_DEPTH_EQUAL: u32 = 4;
/// The stage's image represents a reflection of the surroundings.
pub const STAGE_REFLECTION: u32 = 8;
/// Covers the background by an alpha that the game fades (smoke, blood); not emissive.
pub const STAGE_MATTER: u32 = 16;
/// The reflection image also shows the light at the surface.
pub const STAGE_GLOSS: u32 = 32;
/// The stage shows the lightmap of a surface without one: the engine uses a white image.
pub const STAGE_NO_LIGHTMAP: u32 = 64;
/// The reflection image is also a lit haze over the background.
pub const STAGE_HAZE: u32 = 128;
/// The stage's image is baked light: it uses lightmap coordinates.
pub const STAGE_BAKED_LIGHT: u32 = 256;
/// The stage adds baked light of a style; the traced look has light sources for it.
pub const STAGE_LIGHT_STYLE: u32 = 512;

/// Drawn from both sides.
pub const MATERIAL_TWO_SIDED: u32 = 1;
/// Only the back side is drawn.
pub const MATERIAL_CULL_BACK: u32 = 2;
/// An alpha-tested stage decides which points are solid.
pub const MATERIAL_CUT_OUT: u32 = 4;
/// Its first stage blends with the background.
pub const MATERIAL_TRANSLUCENT: u32 = 8;
pub const MATERIAL_SKY: u32 = 16;
pub const MATERIAL_PORTAL: u32 = 32;
pub const MATERIAL_FOG: u32 = 64;
pub const MATERIAL_LIQUID: u32 = 128;
pub const MATERIAL_GLASS: u32 = 256;
/// Vertex colours are baked light (world surfaces), not part of the material.
pub const MATERIAL_VERTEX_LIGHT: u32 = 512;
/// Drawn with a depth offset (decals).
pub const MATERIAL_POLYGON_OFFSET: u32 = 1024;
/// Emits light, and is in the light lists.
pub const MATERIAL_EMITTER: u32 = 2048;
/// Nothing is drawn.
pub const MATERIAL_INVISIBLE: u32 = 4096;
/// On the map's surfaces: casts no shadow, because the map compiler ignored it.
pub const MATERIAL_PASSED: u32 = 8192;
/// Mirrors light: a stage represents a reflection of the surroundings, or it is glass or a liquid.
pub const MATERIAL_REFLECTS: u32 = 16384;
/// It reflects light by its roughness.
pub const MATERIAL_ROUGH: u32 = 32768;
/// It has a normal map.
pub const MATERIAL_NORMALS: u32 = 65536;
/// Its stages show painted reflections as the engine does, and no ray follows them.
pub const MATERIAL_PLAIN: u32 = 131072;
/// Clear glass that a file of materials states: transmits its filter colour and shows none of its stages.
pub const MATERIAL_CLEAR: u32 = 262144;
/// It has an emissive map.
pub const MATERIAL_GLOWS: u32 = 1048576;
/// Its map has reflectance and smoothness, not roughness and metal.
pub const MATERIAL_SPECULAR_MAP: u32 = 524288;
/// Its normal map has heights.
pub const MATERIAL_HEIGHTS: u32 = 2097152;

/// Drawn in front of everything near (first-person weapon).
pub const INSTANCE_DEPTH_HACK: u32 = 1;
/// Visible to primary rays only, not in mirrors and shadows.
pub const INSTANCE_FIRST_PERSON: u32 = 2;
/// Visible in mirrors and shadows only.
pub const INSTANCE_THIRD_PERSON: u32 = 4;
pub const INSTANCE_NO_SHADOW: u32 = 8;
/// The light grid does not light it: the world, sprites and beams, pictures.
pub const INSTANCE_UNLIT: u32 = 16;
/// A crosshair: without stereo offset.
pub const INSTANCE_CROSSHAIR: u32 = 32;
/// A sprite, lit by `ambient`; traced look only.
pub const INSTANCE_SUSPENDED: u32 = 64;
/// `alphaGen lightingSpecular` reflects the light of the grid, not the engine's constant one.
pub const INSTANCE_OWN_SPECULAR: u32 = 128;

/// A draw of a material's stage.
pub const DRAW_STAGE: u32 = 0;
/// The blob of a dynamic light over a surface.
pub const DRAW_LIGHT: u32 = 1;
/// The fog over an opaque surface.
pub const DRAW_FOG: u32 = 2;
/// Depth only, before everything else.
pub const DRAW_DEPTH: u32 = 3;
/// A dynamic light that is evaluated per pixel.
pub const DRAW_PIXEL_LIGHT: u32 = 4;
/// Most stages of one draw.
pub const DRAW_STAGES: u32 = 4;

/// Combination of a stage with the previous stages of a draw: none (the first, or absent); as a second texture of the
/// same pass, multiplied, added or replaced; blended, as a pass of its own.
pub const COMBINE_NONE: u32 = 0;
pub const COMBINE_MODULATE: u32 = 1;
pub const COMBINE_ADD: u32 = 2;
pub const COMBINE_REPLACE: u32 = 3;
pub const COMBINE_BLEND: u32 = 4;

/// Colour of a stage: white, equal for all vertices, or per vertex.
pub const COLOR_WHITE: u32 = 0;
pub const COLOR_FLAT: u32 = 1;
pub const COLOR_VERTEX: u32 = 2;

/// Normal and specular mapping of a draw: source of the light (lowest bits; 0: no mapping), whether there are a normal map
/// and a highlight, and the shifts to 4 bits each for the stage with the texture and for that with the light, plus one; 0:
/// the texture's stage has the light as its colour. Whether the normal map's heights move the texture, and by halved steps.
pub const MAPPING_BAKED: u32 = 1;
pub const MAPPING_OF_GRID: u32 = 2;
pub const MAPPING_SOURCE: u32 = 3;
pub const MAPPING_NORMALS: u32 = 4;
pub const MAPPING_SPECULAR: u32 = 8;
pub const MAPPING_TEXTURE_SHIFT: u32 = 4;
pub const MAPPING_LIGHT_SHIFT: u32 = 8;
pub const MAPPING_HEIGHTS: u32 = 4096;
pub const MAPPING_RELIEF: u32 = 8192;

pub const FOG_ADJUST_NONE: u32 = 0;
pub const FOG_ADJUST_RGB: u32 = 1;
pub const FOG_ADJUST_ALPHA: u32 = 2;
pub const FOG_ADJUST_RGBA: u32 = 3;

/// A fog volume has no visible face, has one, or has one that the engine also draws while the camera is inside.
pub const FOG_SURFACE_NONE: u32 = 0;
pub const FOG_SURFACE: u32 = 1;
pub const FOG_SURFACE_DRAWN: u32 = 2;

/// The triangle belongs to the world (its vertex colours and lightmap are baked light).
pub const TRIANGLE_WORLD: u32 = 1;
/// The triangle faces the camera; mirrors show it although they see its back.
pub const TRIANGLE_FACES_CAMERA: u32 = 2;
/// The triangle has an opposite in its plane, which handles rays from its back.
pub const TRIANGLE_ONE_SIDED: u32 = 4;
/// The triangle is static: its geometry names its instance, and `instance` is the index of its surface.
pub const TRIANGLE_STATIC: u32 = 8;
/// The triangle is part of a curve or a model: its vertex normals imply a curved surface.
pub const TRIANGLE_CURVED: u32 = 16;
/// The triangle belongs to a closed body of glass, which refracts: both sides are hit.
pub const TRIANGLE_SOLID: u32 = 32;
/// The triangle belongs to a refracting body that photons are aimed at (`renderer_vk/src/trace/bodies.rs`).
pub const TRIANGLE_BODY: u32 = 64;
