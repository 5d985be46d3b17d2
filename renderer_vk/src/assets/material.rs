//! A registered material: a script's definition bound to images, in the form that the passes read.

use super::finish::OfScript;
use super::lit_texture::LitTexture;
use shaders::types::{Dielectric, Specular};
use shaderscript::{AlphaGen, Cull, Deform, Fog, Shader, TcGen};

/// `surfaceparm nodlight` and `surfaceparm sky`: surfaces without dynamic lights.
pub const NO_DYNAMIC_LIGHT: u32 = 0x20000 | 0x4;

/// Light source of a surface: part of a material's identity, as the engine's lightmap index is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightmapClass {
    /// A lightmap page (index 0 and above).
    Page,
    /// Models and sprites: lit by the light grid (index -1).
    None,
    /// Full light (index -2).
    White,
    /// Light baked into vertex colours (index -3).
    Vertex,
    /// Pictures on the screen (index -4).
    TwoD,
}

impl LightmapClass {
    /// Every class.
    pub const ALL: [Self; 5] = [
        Self::Page,
        Self::None,
        Self::White,
        Self::Vertex,
        Self::TwoD,
    ];
}

/// How the two stages of a collapsed pass combine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combine {
    /// first x second x colour
    Modulate,
    /// first x colour + second
    Add,
}

/// One drawing pass: one stage, or two that the engine draws with two texture units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RasterPass {
    /// Indices of the GPU stages; the second is valid only if `stage_count` is 2.
    pub stages: [u32; 2],
    /// 1 or 2.
    pub stage_count: u32,
    /// Combination of two stages.
    pub combine: Combine,
    /// `BLEND_*` factors of source and destination; `None`: no blending.
    pub blend: Option<(u32, u32)>,
    /// Writes depth.
    pub depth_write: bool,
    /// Depth test for equality.
    pub depth_equal: bool,
    /// `false`: no depth test (implicit 2D materials).
    pub depth_test: bool,
    /// One of the `ALPHAFUNC_*` constants.
    pub alpha_func: u32,
}

/// `skyParms`, with its images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyBox {
    /// Bindless indices of the far box's sides `rt bk lf ft up dn`; `None` without a box, or without its first side:
    /// the engine then draws no box.
    pub faces: Option<[u32; 6]>,
}

/// A stage that plays a video.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VideoStage {
    /// Index of the GPU stage.
    pub stage: u32,
    /// File name as written in the script.
    pub name: String,
    /// Client number of the pictures that it shows, see [`Textures::scratch`](super::Textures::scratch).
    pub client: usize,
}

/// A registered material.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name without extension, in the spelling of the first request.
    pub name: String,
    /// The engine's variant of the material. A material of class `Page` whose script has no lightmap stage keeps its
    /// class.
    pub lightmap_class: LightmapClass,
    /// The definition without detail stages, and without stages from a missing image on.
    pub shader: Shader,
    /// It is defined by a script.
    pub explicit: bool,
    /// The definition is unusable (rejected, or an image is missing). Skins draw its remaining stages; all other
    /// geometry uses the default material instead.
    pub defaulted: bool,
    /// Effective sort value.
    pub sort: f32,
    /// Creation order.
    pub order: u32,
    /// `MATERIAL_*` bits.
    pub flags: u32,
    /// What the script decides about them, before files of materials.
    pub of_script: OfScript,
    /// Transmission for rays.
    pub dielectric: Dielectric,
    /// It is rough and reflects much at normal incidence.
    pub metallic: bool,
    /// Specular reflection for rays.
    pub specular: Specular,
    /// Which faces are drawn.
    pub cull: Cull,
    /// Drawn with a depth offset towards the camera.
    pub polygon_offset: bool,
    /// Drawing passes of the classic look, in order.
    pub passes: Vec<RasterPass>,
    /// First GPU stage.
    pub stage_first: u32,
    /// Number of GPU stages.
    pub stage_count: u32,
    /// GPU stage whose texture reflects dynamic lights that are evaluated per pixel.
    pub light_stage: Option<u32>,
    /// Its first texture under light, which normal maps and maps of reflection vary; stages are GPU stages.
    pub lit_texture: Option<LitTexture>,
    /// Set for skies.
    pub sky: Option<SkyBox>,
    /// Fog parameters, for the materials of fog brushes.
    pub fog: Option<Fog>,
    /// `SURF_*` bits of the script.
    pub surface_flags: u32,
    /// `CONTENTS_*` bits of the script.
    pub content_flags: u32,
    /// Distance at which an `alphaGen portal` stage is opaque, units; the engine's default is 256.
    pub portal_range: f32,
    /// Material that replaces this one (`RemapShader`).
    pub remapped: Option<u32>,
    /// Seconds subtracted from shader time.
    pub time_offset: f32,
    /// Stages that play videos.
    pub videos: Vec<VideoStage>,
}

impl Material {
    /// Whether vertices depend on time or view, so that its surfaces are dynamic meshes.
    pub fn deforms(&self) -> bool {
        !self.shader.deforms.is_empty()
    }

    /// Whether its surfaces turn to the camera.
    pub fn faces_camera(&self) -> bool {
        let turns = |d: &Deform| matches!(d, Deform::AutoSprite | Deform::AutoSprite2);
        self.shader.deforms.iter().any(turns)
    }

    /// Its name in lists; the default material has a special one.
    pub fn shown_name(&self) -> &str {
        if self.order == 0 {
            "<default>"
        } else {
            &self.name
        }
    }

    /// Whether the appearance of a surface depends on its normals.
    pub fn uses_normals(&self) -> bool {
        let by_normal = |stage: &shaderscript::Stage| {
            stage.tc_gen == TcGen::Environment || stage.alpha_gen == AlphaGen::LightingSpecular
        };
        self.deforms() || self.shader.stages.iter().any(by_normal)
    }

    /// Whether the material is a sky.
    pub fn is_sky(&self) -> bool {
        self.shader.sky.is_some()
    }
}
