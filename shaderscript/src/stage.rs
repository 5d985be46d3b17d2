//! One stage of a material: an image, how it is coloured, placed and blended.

use glam::{Vec2, Vec3};

/// One drawing pass of a [`Shader`](crate::Shader), with all defaults filled in.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stage {
    /// What is sampled.
    pub image: StageImage,
    /// Source and destination blend factor; `None` overwrites. `GL_ONE GL_ZERO` is stored as `None`, because the
    /// engine treats it as no blending.
    pub blend: Option<(BlendFactor, BlendFactor)>,
    /// Alpha test; a fragment that fails it is not drawn by this stage.
    pub alpha_func: Option<AlphaFunc>,
    /// Whether the stage writes depth: on without blending, off with it, unless the script forces it.
    pub depth_write: bool,
    /// Depth test.
    pub depth_func: DepthFunc,
    /// Dropped when the player turns detail textures off.
    pub detail: bool,
    /// Dynamic lights that are evaluated per pixel are reflected by this stage (`dlight` in `.shaderx` files).
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "std::ops::Not::not")
    )]
    pub dynamic_light: bool,
    /// Where the colour that multiplies the image comes from.
    pub rgb_gen: RgbGen,
    /// Where the alpha that multiplies the image's comes from.
    pub alpha_gen: AlphaGen,
    /// Where texture coordinates come from.
    pub tc_gen: TcGen,
    /// Changes to the texture coordinates, applied in order. The engine allows four; longer lists are kept, with a
    /// warning.
    pub tc_mods: Vec<TcMod>,
    /// Image is loaded without mipmaps (`nomipmaps` came before the stage).
    pub no_mipmaps: bool,
    /// Image is not reduced by the player's `r_picmip` (`nopicmip` or `nomipmaps` came before the stage).
    pub no_picmip: bool,
    /// Images of earlier lines of the stage. The last line's is drawn, but the engine loads all of them and draws the
    /// default material when one is missing.
    pub replaced: Vec<StageImage>,
    /// Line of the stage's opening brace, from 1; 0 for stages that no script wrote.
    pub line: u32,
}

impl Default for Stage {
    /// An opaque white stage.
    fn default() -> Self {
        Stage {
            image: StageImage::White,
            blend: None,
            alpha_func: None,
            depth_write: true,
            depth_func: DepthFunc::LessEqual,
            detail: false,
            dynamic_light: false,
            rgb_gen: RgbGen::IdentityLighting,
            alpha_gen: AlphaGen::Identity,
            tc_gen: TcGen::Base,
            tc_mods: Vec::new(),
            no_mipmaps: false,
            no_picmip: false,
            replaced: Vec::new(),
            line: 0,
        }
    }
}

impl Stage {
    /// Whether the stage draws the surface's lightmap.
    pub fn is_lightmap(&self) -> bool {
        self.image == StageImage::Lightmap
    }
}

/// The image of a stage. Names are as written in the script.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StageImage {
    /// A repeating image.
    Map(String),
    /// An image clamped to its edge.
    ClampMap(String),
    /// Repeating images shown one after the other.
    Animation {
        /// Images per second.
        frequency: f32,
        /// The images; at least one, at most the eight that the engine uses.
        images: Vec<String>,
    },
    /// A cinematic.
    Video(String),
    /// `$lightmap`: the surface's own lightmap, white where it has none.
    Lightmap,
    /// `$whiteimage`.
    White,
}

impl StageImage {
    /// Names of the image files that the stage needs; empty for lightmap, white and video.
    pub fn names(&self) -> &[String] {
        match self {
            StageImage::Map(name) | StageImage::ClampMap(name) => std::slice::from_ref(name),
            StageImage::Animation { images, .. } => images,
            StageImage::Video(_) | StageImage::Lightmap | StageImage::White => &[],
        }
    }

    /// Index into [`names`](Self::names) at a shader time in seconds: floor(time x frequency) modulo the number of
    /// images, 0 for negative times.
    pub fn frame(&self, time: f64) -> usize {
        match self {
            StageImage::Animation { frequency, images } if images.len() > 1 => {
                // The engine multiplies by a power of two before it truncates and shifts back: the same floor.
                let frame = (time * f64::from(*frequency)).floor();
                if frame > 0.0 {
                    (frame % images.len() as f64) as usize
                } else {
                    0
                }
            }
            _ => 0,
        }
    }
}

/// Factor of a blend equation, as OpenGL defines it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum BlendFactor {
    /// 0.
    Zero,
    /// 1.
    One,
    /// Colour of the stage; destination factor only.
    SrcColor,
    /// 1 - colour of the stage; destination factor only.
    OneMinusSrcColor,
    /// Colour already drawn; source factor only.
    DstColor,
    /// 1 - colour already drawn; source factor only.
    OneMinusDstColor,
    /// Alpha of the stage.
    SrcAlpha,
    /// 1 - alpha of the stage.
    OneMinusSrcAlpha,
    /// Alpha already drawn.
    DstAlpha,
    /// 1 - alpha already drawn.
    OneMinusDstAlpha,
    /// min(alpha of the stage, 1 - alpha already drawn); source factor only.
    SrcAlphaSaturate,
}

/// Alpha test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AlphaFunc {
    /// Passes where alpha > 0.
    Gt0,
    /// Passes where alpha < 0.5.
    Lt128,
    /// Passes where alpha >= 0.5.
    Ge128,
}

impl AlphaFunc {
    /// Whether a fragment of this alpha (0 to 1) is drawn.
    pub fn passes(self, alpha: f32) -> bool {
        match self {
            AlphaFunc::Gt0 => alpha > 0.0,
            AlphaFunc::Lt128 => alpha < 0.5,
            AlphaFunc::Ge128 => alpha >= 0.5,
        }
    }
}

/// Depth test of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DepthFunc {
    /// Drawn where nothing is nearer.
    LessEqual,
    /// Drawn only where the depth is already this surface's.
    Equal,
    /// No test at all: implicit 2D materials; no script can ask for it.
    Disabled,
}

/// Source of a stage's colour.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum RgbGen {
    /// White.
    Identity,
    /// White divided by the overbright factor.
    IdentityLighting,
    /// Grey of a wave.
    Wave(Wave),
    /// Fixed colour, as written (nominally 0 to 1).
    Const(Vec3),
    /// The entity's colour.
    Entity,
    /// 1 - the entity's colour.
    OneMinusEntity,
    /// The vertex's colour, divided by the overbright factor.
    Vertex,
    /// The vertex's colour, unchanged.
    ExactVertex,
    /// 1 - the vertex's colour, divided by the overbright factor.
    OneMinusVertex,
    /// Diffuse light from the light grid.
    LightingDiffuse,
}

/// Source of a stage's alpha.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AlphaGen {
    /// 1.
    Identity,
    /// Fixed, as written.
    Const(f32),
    /// A wave, clamped to 0..1.
    Wave(Wave),
    /// The entity's alpha.
    Entity,
    /// 1 - the entity's alpha.
    OneMinusEntity,
    /// The vertex's alpha.
    Vertex,
    /// 1 - the vertex's alpha.
    OneMinusVertex,
    /// A highlight of a light at a fixed place in the entity's own space.
    LightingSpecular,
    /// Distance from the camera over `range`, clamped to 0..1.
    Portal {
        /// Distance in world units at which the surface is opaque.
        range: f32,
    },
}

/// Source of texture coordinates.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TcGen {
    /// The vertex's texture coordinates.
    Base,
    /// The vertex's lightmap coordinates.
    Lightmap,
    /// From the reflected view direction.
    Environment,
    /// Dot products of the position with two vectors.
    Vector(Vec3, Vec3),
}

/// One change of texture coordinates. See [`eval::apply_tc_mods`](crate::eval::apply_tc_mods) for the formulas.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TcMod {
    /// Wobble by position.
    Turbulent {
        /// Read but never used by the engine.
        base: f32,
        /// Size of the wobble in texture coordinates.
        amplitude: f32,
        /// In turns.
        phase: f32,
        /// Turns per second.
        frequency: f32,
    },
    /// Multiply.
    Scale(Vec2),
    /// Move, in texture widths per second.
    Scroll(Vec2),
    /// Scale about the middle by 1 / wave.
    Stretch(Wave),
    /// `st * matrix + translate`; `matrix[i][j]` carries input coordinate i to output coordinate j.
    Transform {
        /// Rows by input coordinate.
        matrix: [[f32; 2]; 2],
        /// Added afterwards.
        translate: Vec2,
    },
    /// Turn about the middle, in degrees per second.
    Rotate(f32),
    /// Move with the speed that the entity carries.
    EntityTranslate,
}

/// A periodic function of time: `base + f(phase + time * frequency) * amplitude`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Wave {
    /// Shape.
    pub function: WaveFunction,
    /// Added.
    pub base: f32,
    /// Multiplies the shape.
    pub amplitude: f32,
    /// In turns.
    pub phase: f32,
    /// Turns per second.
    pub frequency: f32,
}

/// Shape of a wave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum WaveFunction {
    /// Sine.
    Sin,
    /// +1, then -1.
    Square,
    /// Up to +1, down to -1, back to 0.
    Triangle,
    /// 0 to 1.
    Sawtooth,
    /// 1 to 0.
    InverseSawtooth,
    /// Value noise in -1..1.
    Noise,
}
