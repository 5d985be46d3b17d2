//! A material as a script defines it.

use crate::reflection::Reflection;
use crate::stage::{Stage, StageImage, Wave};
use glam::Vec3;

/// Named sort values: surfaces are drawn in rising order.
pub mod sort {
    /// Mirrors and portals; examined before anything is drawn.
    pub const PORTAL: f32 = 1.0;
    /// Sky.
    pub const SKY: f32 = 2.0;
    /// Opaque surfaces.
    pub const OPAQUE: f32 = 3.0;
    /// Decals.
    pub const DECAL: f32 = 4.0;
    /// Blended surfaces that write depth.
    pub const SEE_THROUGH: f32 = 5.0;
    /// Banners.
    pub const BANNER: f32 = 6.0;
    /// Fog volumes' own surfaces.
    pub const FOG: f32 = 7.0;
    /// Under water.
    pub const UNDERWATER: f32 = 8.0;
    /// Blended surfaces.
    pub const BLEND: f32 = 9.0;
    /// Additive surfaces.
    pub const ADDITIVE: f32 = 10.0;
    /// In front of everything.
    pub const NEAREST: f32 = 16.0;
}

/// Where a definition stands.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Location {
    /// Script file, as named by the caller; empty for materials that no script wrote.
    pub file: String,
    /// Line of the name, from 1.
    pub line: u32,
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Shader {
    /// Name as written; compared without case.
    pub name: String,
    /// Where it is defined.
    pub location: Location,
    /// Why the engine would reject the definition; `None` for a good one. A rejected material is replaced by the
    /// default one, except on `.skin` surfaces, where the stages read before the fault are drawn: `stages` holds
    /// those.
    pub rejected: Option<String>,
    /// `SURF_*` bits of its `surfaceparm`s, see [`surface_params`](crate::surface_params).
    pub surface_flags: u32,
    /// `CONTENTS_*` bits of its `surfaceparm`s.
    pub content_flags: u32,
    /// Its `surfaceparm` names in lower case, in order, unknown ones too.
    pub surface_params: Vec<String>,
    /// Which faces are drawn.
    pub cull: Cull,
    /// Sort value that the script sets; see [`sort_value`](Self::sort_value) for the one that applies.
    pub sort: Option<f32>,
    /// Vertex deformations, in order; at most three.
    pub deforms: Vec<Deform>,
    /// Stages in drawing order.
    pub stages: Vec<Stage>,
    /// How it reflects, in the words of `opengl2`.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Reflection::is_empty")
    )]
    pub reflection: Reflection,
    /// Set when the material is a sky.
    pub sky: Option<Sky>,
    /// Fog that a brush of this material is filled with.
    pub fog: Option<Fog>,
    /// Drawn slightly nearer than it is.
    pub polygon_offset: bool,
    /// `nomipmaps` occurs; a stage has the flag of its own image.
    pub no_mipmaps: bool,
    /// `nopicmip` or `nomipmaps` occurs; a stage has the flag of its own image.
    pub no_picmip: bool,
    /// Several entities may be drawn in one batch.
    pub entity_mergable: bool,
    /// Shader time never exceeds this, in seconds.
    pub clamp_time: Option<f32>,
    /// `portal` occurs.
    pub portal: bool,
    /// The sun that the engine would take from this material: the last one defined.
    pub sun: Option<Sun>,
    /// Every sun defined; the map compiler uses them all.
    pub suns: Vec<Sun>,
    /// Its directives for the map compiler about light.
    pub light: LightDirectives,
    /// Every line for other programs (`q3map...`, `qer...`), whether `light` interprets it or not, and every
    /// unknown keyword.
    pub unknown: Vec<UnknownDirective>,
}

impl Shader {
    /// A material without stages.
    pub fn new(name: impl Into<String>) -> Shader {
        Shader {
            name: name.into(),
            location: Location::default(),
            rejected: None,
            surface_flags: 0,
            content_flags: 0,
            surface_params: Vec::new(),
            cull: Cull::Front,
            sort: None,
            deforms: Vec::new(),
            stages: Vec::new(),
            reflection: Reflection::default(),
            sky: None,
            fog: None,
            polygon_offset: false,
            no_mipmaps: false,
            no_picmip: false,
            entity_mergable: false,
            clamp_time: None,
            portal: false,
            sun: None,
            suns: Vec::new(),
            light: LightDirectives::default(),
            unknown: Vec::new(),
        }
    }

    /// The value that decides drawing order: the script's own, or the one that its directives imply.
    ///
    /// A sky is always 2. Otherwise an explicit value is kept; polygon offset implies 4; a first stage that blends
    /// implies 5 when it writes depth and 9 when not; anything else is 3. Without stages it is fog, 7.
    pub fn sort_value(&self) -> f32 {
        if self.sky.is_some() {
            return sort::SKY;
        }
        let Some(first) = self.stages.first() else {
            // Set last by the engine, so that it overrides even an explicit value.
            return sort::FOG;
        };
        if let Some(explicit) = self.sort {
            return explicit;
        }
        if self.polygon_offset {
            sort::DECAL
        } else if first.blend.is_some() {
            if first.depth_write {
                sort::SEE_THROUGH
            } else {
                sort::BLEND
            }
        } else {
            sort::OPAQUE
        }
    }

    /// Whether any stage draws the lightmap.
    pub fn has_lightmap_stage(&self) -> bool {
        self.stages.iter().any(Stage::is_lightmap)
    }

    /// Names of all image files that must exist for the engine to draw the material: those of its stages, and those
    /// that a later line of a stage replaced.
    pub fn needed_images(&self) -> impl Iterator<Item = &str> {
        self.stages
            .iter()
            .flat_map(|stage| stage.replaced.iter().chain([&stage.image]))
            .flat_map(StageImage::names)
            .map(String::as_str)
    }

    /// Names of all image files that the stages draw, in order, with repetitions.
    pub fn image_names(&self) -> impl Iterator<Item = &str> {
        self.stages
            .iter()
            .flat_map(|stage| stage.image.names())
            .map(String::as_str)
    }
}

/// Which faces are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Cull {
    /// Front faces are drawn: the default.
    Front,
    /// Back faces are drawn.
    Back,
    /// Both are drawn.
    None,
}

/// A change of a surface's vertices. See [`eval::deform`](crate::eval::deform) for the formulas.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Deform {
    /// Along the normal.
    Wave {
        /// Turns per world unit of x + y + z.
        spread: f32,
        /// In world units.
        wave: Wave,
    },
    /// Turns the normals only.
    Normal {
        /// How far.
        amplitude: f32,
        /// Noise lattice cells per second.
        frequency: f32,
    },
    /// Along the normal, travelling in the first texture coordinate.
    Bulge {
        /// Radians per texture width.
        width: f32,
        /// World units.
        height: f32,
        /// Radians per second.
        speed: f32,
    },
    /// The whole surface.
    Move {
        /// Where to, in world units.
        direction: Vec3,
        /// How far.
        wave: Wave,
    },
    /// Quads turn fully to the viewer.
    AutoSprite,
    /// Quads pivot about their long axis.
    AutoSprite2,
    /// Flattened onto the ground.
    ProjectionShadow,
    /// Replaced by one of the scene's eight text strings.
    Text(u8),
}

/// `skyParms`.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sky {
    /// Far box: base name of six images with the suffixes `_rt _bk _lf _ft _up _dn`.
    pub outer: Option<String>,
    /// Height of the cloud dome in world units.
    pub cloud_height: f32,
    /// Near box: base name of six images.
    pub inner: Option<String>,
}

impl Sky {
    /// Sides of a box by the suffixes of their images, without the `_`.
    pub const SIDES: [&str; 6] = ["rt", "bk", "lf", "ft", "up", "dn"];

    /// The point of a side of the cube [-1, 1]³ at `s` (right) and `t` (up) of its image, both in [-1, 1] and seen from
    /// inside. Sides are in the order of [`Self::SIDES`].
    pub fn side_point(side: usize, s: f32, t: f32) -> Vec3 {
        match side {
            0 => Vec3::new(1.0, -s, t),
            1 => Vec3::new(s, 1.0, t),
            2 => Vec3::new(-1.0, s, t),
            3 => Vec3::new(-s, -1.0, t),
            4 => Vec3::new(-t, -s, 1.0),
            _ => Vec3::new(t, -s, -1.0),
        }
    }
}

/// `fogParms`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fog {
    /// Colour as written, nominally 0 to 1, in display space.
    pub color: Vec3,
    /// Distance in world units at which fog is opaque, as written; the engine uses at least 1.
    pub depth: f32,
}

/// `q3map_sun` or `q3map_sunExt`: light from infinitely far.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sun {
    /// Colour as written; only its ratios count.
    pub color: Vec3,
    /// Irradiance of a surface that faces the sun, in the compiler's 0..255 units.
    pub intensity: f32,
    /// Unit vector towards the sun.
    pub direction: Vec3,
    /// Angular radius of the jitter that makes its shadows soft, in degrees.
    pub deviance_degrees: f32,
    /// Number of jittered copies that the compiler makes.
    pub samples: i32,
}

impl Sun {
    /// Colour whose largest channel is 1, as the map compiler normalises it; black stays black.
    pub fn compiler_color(&self) -> Vec3 {
        let largest = self.color.max_element();
        if largest > 0.0 {
            self.color / largest
        } else {
            Vec3::ZERO
        }
    }

    /// Colour of unit length times intensity, as the engine normalises it.
    pub fn engine_light(&self) -> Vec3 {
        self.color.normalize_or_zero() * self.intensity
    }
}

/// A material's directives for the map compiler about light.
#[derive(Clone, Debug, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LightDirectives {
    /// `q3map_surfacelight`: light that the surface emits per area, in the compiler's units. Lines whose
    /// argument is no number do not count.
    pub surface_light: Option<f32>,
    /// `q3map_lightimage`: image whose average is the colour of emission.
    pub light_image: Option<String>,
    /// `q3map_lightRGB`: colour of emission, before any image.
    pub light_rgb: Option<Vec3>,
    /// `q3map_lightSubdivide`: largest piece of an emitter, in world units.
    pub light_subdivide: Option<f32>,
    /// `q3map_skylight`: value and iterations of light from the whole sky dome.
    pub sky_light: Option<(f32, i32)>,
    /// `q3map_backsplash`: per cent of the light and distance in units of a second light that illuminates the
    /// emitter's own surroundings.
    pub backsplash: Option<(f32, f32)>,
    /// `q3map_bounceScale` or `q3map_bounce`: factor on bounced light.
    pub bounce_scale: Option<f32>,
    /// `q3map_lightmapBrightness`, or `q3map_lightmapGamma` as it was called first: factor on the light that lightmaps store
    /// on these surfaces. Such lines multiply; what is not above zero counts as 1.
    pub lightmap_brightness: Option<f32>,
    /// `qer_editorimage`: what the editor shows, and the compiler's second choice for the colour of emission.
    pub editor_image: Option<String>,
    /// `q3map_flare` or `q3map_flareShader`: material of flares at the surface.
    pub flare: Option<String>,
    /// `light`: the old spelling of a flare, its value.
    pub light: Option<f32>,
}

/// A line that the engine does not interpret.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct UnknownDirective {
    /// Keyword as written.
    pub keyword: String,
    /// Rest of its line.
    pub arguments: Vec<String>,
    /// Line, from 1.
    pub line: u32,
}
