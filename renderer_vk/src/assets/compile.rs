//! Compiles a script's stages to the structures that shaders read, without a GPU.

use bytemuck::Zeroable;
use shaders::types::{self, constants as c};
use shaderscript::{
    AlphaFunc, AlphaGen, BlendFactor, DepthFunc, RgbGen, Stage, StageImage, TcGen, TcMod, Wave,
    WaveFunction,
};

use super::source::{ImageFlags, ImageSource};

/// Samplers in the order in which [`Samplers`](super::Samplers) makes them.
pub mod sampler {
    /// Repeating, mipmapped by `r_textureMode`.
    pub const REPEAT_MIP: u32 = 0;
    /// Clamped, mipmapped by `r_textureMode`.
    pub const CLAMP_MIP: u32 = 1;
    /// Repeating, linear, largest level only.
    pub const REPEAT: u32 = 2;
    /// Clamped, linear, largest level only.
    pub const CLAMP: u32 = 3;
}

/// The arrays that all materials share.
#[derive(Clone, Debug, Default)]
pub struct StageArrays {
    /// Stages; their `sampler_index` is a value of [`sampler`], which the upload translates to a bindless index.
    pub stages: Vec<types::Stage>,
    /// `tcMod`s.
    pub tc_mods: Vec<types::TcMod>,
    /// Bindless texture indices.
    pub images: Vec<u32>,
}

/// Name of the fog image, see [`fog_picture`](super::prepare::fog_picture).
pub const FOG_IMAGE: &str = "*fog";

/// First client number of `videoMap` stages; the engine uses lower ones itself.
pub const FIRST_VIDEO_CLIENT: usize = 32;

fn count(len: usize) -> u32 {
    u32::try_from(len).unwrap_or(u32::MAX)
}

/// `BLEND_*` of a factor. The engine's framebuffer has no alpha, which reads as 1: factors of destination alpha become
/// constants.
pub fn blend_factor(factor: BlendFactor) -> u32 {
    match factor {
        BlendFactor::Zero => c::BLEND_ZERO,
        BlendFactor::One => c::BLEND_ONE,
        BlendFactor::SrcColor => c::BLEND_SRC_COLOR,
        BlendFactor::OneMinusSrcColor => c::BLEND_ONE_MINUS_SRC_COLOR,
        BlendFactor::DstColor => c::BLEND_DST_COLOR,
        BlendFactor::OneMinusDstColor => c::BLEND_ONE_MINUS_DST_COLOR,
        BlendFactor::SrcAlpha => c::BLEND_SRC_ALPHA,
        BlendFactor::OneMinusSrcAlpha => c::BLEND_ONE_MINUS_SRC_ALPHA,
        BlendFactor::DstAlpha => c::BLEND_ONE,
        BlendFactor::OneMinusDstAlpha | BlendFactor::SrcAlphaSaturate => c::BLEND_ZERO,
    }
}

/// `ALPHAFUNC_*` of an alpha test.
pub fn alpha_func(func: Option<AlphaFunc>) -> u32 {
    match func {
        None => c::ALPHAFUNC_NONE,
        Some(AlphaFunc::Gt0) => c::ALPHAFUNC_GT0,
        Some(AlphaFunc::Lt128) => c::ALPHAFUNC_LT128,
        Some(AlphaFunc::Ge128) => c::ALPHAFUNC_GE128,
    }
}

fn wave(wave: &Wave) -> types::Wave {
    types::Wave {
        function: match wave.function {
            WaveFunction::Sin => c::WAVE_SIN,
            WaveFunction::Square => c::WAVE_SQUARE,
            WaveFunction::Triangle => c::WAVE_TRIANGLE,
            WaveFunction::Sawtooth => c::WAVE_SAWTOOTH,
            WaveFunction::InverseSawtooth => c::WAVE_INVERSE_SAWTOOTH,
            WaveFunction::Noise => c::WAVE_NOISE,
        },
        base: wave.base,
        amplitude: wave.amplitude,
        phase: wave.phase,
        frequency: wave.frequency,
    }
}

fn tc_mod(tc_mod: &TcMod) -> types::TcMod {
    let mut out = types::TcMod::zeroed();
    match tc_mod {
        TcMod::Turbulent {
            base,
            amplitude,
            phase,
            frequency,
        } => {
            out.kind = c::TCMOD_TURBULENT;
            out.wave = types::Wave {
                function: c::WAVE_SIN,
                base: *base,
                amplitude: *amplitude,
                phase: *phase,
                frequency: *frequency,
            };
        }
        TcMod::Scale(scale) => {
            out.kind = c::TCMOD_SCALE;
            out.values = [scale.x, scale.y, 0.0, 0.0, 0.0, 0.0];
        }
        TcMod::Scroll(speed) => {
            out.kind = c::TCMOD_SCROLL;
            out.values = [speed.x, speed.y, 0.0, 0.0, 0.0, 0.0];
        }
        TcMod::Stretch(function) => {
            out.kind = c::TCMOD_STRETCH;
            out.wave = wave(function);
        }
        TcMod::Transform { matrix, translate } => {
            out.kind = c::TCMOD_TRANSFORM;
            let [[m00, m01], [m10, m11]] = *matrix;
            out.values = [m00, m01, m10, m11, translate.x, translate.y];
        }
        TcMod::Rotate(degrees) => {
            out.kind = c::TCMOD_ROTATE;
            out.values = [*degrees, 0.0, 0.0, 0.0, 0.0, 0.0];
        }
        TcMod::EntityTranslate => out.kind = c::TCMOD_ENTITY_TRANSLATE,
    }
    out
}

/// Whether a stage covers the background by an alpha that the game fades. Glowing stages are added instead, and names
/// and icons are not faded.
fn is_matter(stage: &Stage) -> bool {
    let covers = Some((BlendFactor::SrcAlpha, BlendFactor::OneMinusSrcAlpha));
    let alpha_of_game = matches!(
        stage.alpha_gen,
        AlphaGen::Entity | AlphaGen::OneMinusEntity | AlphaGen::Vertex | AlphaGen::OneMinusVertex
    );
    // these colour sources also set alpha
    let color_of_game = matches!(stage.rgb_gen, RgbGen::Vertex | RgbGen::Entity)
        && matches!(stage.alpha_gen, AlphaGen::Identity);
    stage.blend == covers && stage.image != StageImage::Lightmap && (alpha_of_game || color_of_game)
}

/// The image of a stage with its flags.
struct FoundImage {
    first: u32,
    count: u32,
    frequency: f32,
    sampler: u32,
    flags: u32,
}

/// File name of a video stage and the client number of its pictures.
pub type Video = (String, usize);

impl StageArrays {
    /// Loads the images of a stage that is not drawn; `Err` with the name of a missing image.
    pub fn need_stage(
        &mut self,
        stage: &Stage,
        videos: &mut VideoClients,
        source: &mut dyn ImageSource,
    ) -> Result<(), String> {
        self.need_images(&stage.replaced, stage, None, videos, source)?;
        let image = std::slice::from_ref(&stage.image);
        self.need_images(image, stage, None, videos, source)
    }

    /// Loads images as [`push_image`](Self::push_image) does, without appending a stage.
    fn need_images(
        &mut self,
        images: &[StageImage],
        stage: &Stage,
        implicit: Option<ImageFlags>,
        videos: &mut VideoClients,
        source: &mut dyn ImageSource,
    ) -> Result<(), String> {
        let start = self.images.len();
        for image in images.iter().filter(|i| !i.names().is_empty()) {
            let found = self.push_image(image, stage, implicit, videos, &mut None, source);
            self.images.truncate(start);
            found?;
        }
        Ok(())
    }

    /// Appends a stage and returns its index; on a missing image, appends nothing and returns its name in `Err`.
    ///
    /// `implicit`: flags of a material without a script; a script's stages define their own.
    pub fn push_stage(
        &mut self,
        stage: &Stage,
        implicit: Option<ImageFlags>,
        videos: &mut VideoClients,
        source: &mut dyn ImageSource,
    ) -> Result<(u32, Option<Video>), String> {
        self.need_images(&stage.replaced, stage, implicit, videos, source)?;
        let mut video = None;
        let image = self.push_image(&stage.image, stage, implicit, videos, &mut video, source)?;
        let mut out = types::Stage::zeroed();
        out.image_first = image.first;
        out.image_count = image.count;
        out.image_frequency = image.frequency;
        out.sampler_index = image.sampler;
        out.flags = image.flags;
        match stage.tc_gen {
            TcGen::Base => out.tc_gen = c::TCGEN_BASE,
            TcGen::Lightmap => out.tc_gen = c::TCGEN_LIGHTMAP,
            TcGen::Environment => out.tc_gen = c::TCGEN_ENVIRONMENT,
            TcGen::Vector(s, t) => {
                out.tc_gen = c::TCGEN_VECTOR;
                out.vector_s = s;
                out.vector_t = t;
            }
        }
        out.tc_mod_first = count(self.tc_mods.len());
        out.tc_mod_count = count(stage.tc_mods.len());
        self.tc_mods.extend(stage.tc_mods.iter().map(tc_mod));
        set_colors(&mut out, stage);
        out.alpha_func = alpha_func(stage.alpha_func);
        let (src, dst) = stage.blend.unwrap_or((BlendFactor::One, BlendFactor::Zero));
        out.blend_src = blend_factor(src);
        out.blend_dst = blend_factor(dst);
        if stage.depth_write {
            out.flags |= c::STAGE_DEPTH_WRITE;
        }
        if stage.depth_func == DepthFunc::Equal {
            out.flags |= c::STAGE_DEPTH_EQUAL;
        }
        if is_matter(stage) {
            out.flags |= c::STAGE_MATTER;
        }
        let index = count(self.stages.len());
        self.stages.push(out);
        Ok((index, video))
    }

    fn push_image(
        &mut self,
        image: &StageImage,
        stage: &Stage,
        implicit: Option<ImageFlags>,
        videos: &mut VideoClients,
        video: &mut Option<Video>,
        source: &mut dyn ImageSource,
    ) -> Result<FoundImage, String> {
        let first = count(self.images.len());
        let flags = |clamp: bool| {
            implicit.unwrap_or(ImageFlags {
                mipmap: !stage.no_mipmaps,
                picmip: !stage.no_picmip,
                clamp,
                detail: stage.detail,
                data: false,
            })
        };
        let sampler_of = |flags: ImageFlags| match (flags.clamp, flags.mipmap) {
            (false, true) => sampler::REPEAT_MIP,
            (true, true) => sampler::CLAMP_MIP,
            (false, false) => sampler::REPEAT,
            (true, false) => sampler::CLAMP,
        };
        let mut found = FoundImage {
            first,
            count: 1,
            frequency: 0.0,
            sampler: sampler::REPEAT_MIP,
            flags: 0,
        };
        match image {
            StageImage::Map(name) | StageImage::ClampMap(name) => {
                // the engine's own image has this name, too; `$whiteimage` is special only in `map`
                if name == "*white" {
                    self.images.push(source.white());
                    found.flags = c::STAGE_WHITE;
                    return Ok(found);
                }
                let flags = flags(matches!(image, StageImage::ClampMap(_)));
                let (texture, flags) = source.image(name, flags).ok_or_else(|| name.clone())?;
                self.images.push(texture);
                found.sampler = sampler_of(flags);
            }
            StageImage::Animation { frequency, images } => {
                let mut flags = flags(false);
                let mut textures = Vec::with_capacity(images.len());
                for name in images {
                    let (texture, first) = source.image(name, flags).ok_or_else(|| name.clone())?;
                    textures.push(texture);
                    // all images share one sampler: that of the first
                    if textures.len() == 1 {
                        flags = first;
                    }
                }
                if textures.is_empty() {
                    return Err("(animation without images)".into());
                }
                found.count = count(textures.len());
                found.frequency = *frequency;
                found.sampler = sampler_of(flags);
                self.images.extend(textures);
            }
            StageImage::Video(name) => {
                let client = videos.client(name);
                self.images.push(source.scratch(client));
                found.sampler = sampler::CLAMP;
                *video = Some((name.clone(), client));
            }
            StageImage::Lightmap => {
                found.count = 0;
                found.sampler = sampler::CLAMP;
            }
            StageImage::White => {
                self.images.push(source.white());
                found.flags = c::STAGE_WHITE;
            }
        }
        Ok(found)
    }
}

/// Client numbers of `videoMap` files, assigned in order of first use.
#[derive(Clone, Debug, Default)]
pub struct VideoClients {
    names: Vec<String>,
}

impl VideoClients {
    /// The client number of a file.
    pub fn client(&mut self, name: &str) -> usize {
        let index = self
            .names
            .iter()
            .position(|n| n.eq_ignore_ascii_case(name))
            .unwrap_or_else(|| {
                self.names.push(name.to_owned());
                self.names.len() - 1
            });
        FIRST_VIDEO_CLIENT + index
    }

    /// Every file with its client number.
    pub fn iter(&self) -> impl Iterator<Item = (&str, usize)> {
        self.names
            .iter()
            .enumerate()
            .map(|(i, name)| (name.as_str(), FIRST_VIDEO_CLIENT + i))
    }
}

/// Sets how a stage makes colour and alpha.
fn set_colors(out: &mut types::Stage, stage: &Stage) {
    out.constant = [1.0; 4];
    out.rgb_gen = match &stage.rgb_gen {
        RgbGen::Identity => c::RGBGEN_IDENTITY,
        RgbGen::IdentityLighting => c::RGBGEN_IDENTITY_LIGHTING,
        RgbGen::Wave(function) => {
            out.rgb_wave = wave(function);
            c::RGBGEN_WAVE
        }
        RgbGen::Const(rgb) => {
            let [r, g, b] = rgb.to_array();
            out.constant = [r, g, b, 1.0];
            c::RGBGEN_CONST
        }
        RgbGen::Entity => c::RGBGEN_ENTITY,
        RgbGen::OneMinusEntity => c::RGBGEN_ONE_MINUS_ENTITY,
        RgbGen::Vertex => c::RGBGEN_VERTEX,
        RgbGen::ExactVertex => c::RGBGEN_EXACT_VERTEX,
        RgbGen::OneMinusVertex => c::RGBGEN_ONE_MINUS_VERTEX,
        RgbGen::LightingDiffuse => c::RGBGEN_LIGHTING_DIFFUSE,
    };
    out.alpha_gen = match &stage.alpha_gen {
        AlphaGen::Identity => c::ALPHAGEN_IDENTITY,
        AlphaGen::Const(alpha) => {
            out.constant[3] = *alpha;
            c::ALPHAGEN_CONST
        }
        AlphaGen::Wave(function) => {
            out.alpha_wave = wave(function);
            c::ALPHAGEN_WAVE
        }
        AlphaGen::Entity => c::ALPHAGEN_ENTITY,
        AlphaGen::OneMinusEntity => c::ALPHAGEN_ONE_MINUS_ENTITY,
        AlphaGen::Vertex => c::ALPHAGEN_VERTEX,
        AlphaGen::OneMinusVertex => c::ALPHAGEN_ONE_MINUS_VERTEX,
        AlphaGen::LightingSpecular => c::ALPHAGEN_LIGHTING_SPECULAR,
        AlphaGen::Portal { range } => {
            out.portal_range = *range;
            c::ALPHAGEN_PORTAL
        }
    };
}
