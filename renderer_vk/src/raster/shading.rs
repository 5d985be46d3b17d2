//! Specialization of a draw's shaders. Evaluates on the CPU, once, the stage values that are equal for all vertices of
//! a draw.

use glam::Vec2;
use shaders::constant_ids::raster::draw as id;
use shaders::constant_ids::raster::hybrid;
use shaders::types::constants as c;
use shaders::types::{DRAW_STAGES, Draw, Instance};
use shaderscript::{AlphaGen, Cull, RgbGen, TcMod, WaveFunction, eval};
use support::slice;

use super::per_stage::PerStage;
use super::surface_mapping::SurfaceMapping;
use crate::assets::compile::sampler;
use crate::assets::{Combine, Material, Materials, RasterPass, Samplers};
use crate::settings::Settings;

/// Number of low bits of a handle in [`Draw::textures`] for the texture; the sampler is above.
const TEXTURE_BITS: u32 = 24;

/// Specialization of a draw's shaders. Every field is a specialization constant (`shaders/raster/draw.glsl`), so that a
/// draw runs only the code it needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Shading {
    /// `DRAW_*`.
    pub mode: u32,
    /// `FOG_ADJUST_*` of the first stage.
    pub fog_adjust: u32,
    /// Uses a clip plane.
    pub clip: bool,
    /// Bit i: stage i has a texture; without, it is white.
    pub textures: u32,
    /// Bit i: the `tcMod`s of stage i differ between vertices.
    pub tc_mods: u32,
    /// `COMBINE_*`.
    pub combine: PerStage,
    /// Source factor of a blended stage, `BLEND_*`.
    pub blend_source: PerStage,
    /// Destination factor of a blended stage, `BLEND_*`.
    pub blend_target: PerStage,
    /// `ALPHAFUNC_*`; of the last stage of each pass.
    pub alpha_func: PerStage,
    /// `COLOR_*`.
    pub color: PerStage,
    /// `RGBGEN_*`, if the colour is evaluated per vertex.
    pub rgb_gen: PerStage,
    /// `ALPHAGEN_*`, if alpha is evaluated per vertex.
    pub alpha_gen: PerStage,
    /// `TCGEN_*`.
    pub tc_gen: PerStage,
    /// `MAPPING_*`; 0: none.
    pub mapping: u32,
    /// `SHADOWED` of `hybrid.glsl`; 0: none.
    pub shadowed: u32,
    /// `MIRRORED` of `hybrid.glsl`; 0: none.
    pub mirrored: u32,
}

/// Number of specialization constants.
pub const CONSTANTS: usize = 16;

impl Shading {
    /// Uniformly white.
    pub const WHITE: Self = Self {
        mode: c::DRAW_STAGE,
        fog_adjust: c::FOG_ADJUST_NONE,
        clip: false,
        textures: 0,
        tc_mods: 0,
        combine: PerStage::NONE,
        blend_source: PerStage::NONE,
        blend_target: PerStage::NONE,
        alpha_func: PerStage::NONE,
        color: PerStage::NONE,
        rgb_gen: PerStage::NONE,
        alpha_gen: PerStage::NONE,
        tc_gen: PerStage::NONE,
        mapping: 0,
        shadowed: 0,
        mirrored: 0,
    };

    /// The spot of a dynamic light.
    pub const LIGHT: Self = Self {
        mode: c::DRAW_LIGHT,
        textures: 1,
        ..Self::WHITE
    };

    /// Vertex colours.
    pub const VERTEX_COLOR: Self = Self {
        color: PerStage::first(c::COLOR_VERTEX),
        rgb_gen: PerStage::first(c::RGBGEN_EXACT_VERTEX),
        ..Self::WHITE
    };

    /// The same, but shows only the second of two textures (`r_lightmap`).
    pub fn second_alone(mut self) -> Self {
        self.combine.set(1, c::COMBINE_REPLACE);
        self.mapping = 0;
        (self.shadowed, self.mirrored) = (0, 0);
        self
    }

    /// Whether a place of the draw has a stage.
    pub(super) fn draws(&self, place: usize) -> bool {
        place == 0 || self.combine.at(place) != c::COMBINE_NONE
    }

    /// Whether a place of the draw has the coordinates of an environment image.
    pub(super) fn shows_environment(&self, place: usize) -> bool {
        self.textures >> place & 1 != 0 && self.tc_gen.at(place) == c::TCGEN_ENVIRONMENT
    }

    /// Whether the draw shows shadows or reflections that rays found.
    pub fn is_hybrid(&self) -> bool {
        self.shadowed != 0 || self.mirrored != 0
    }

    /// Whether the draw has several stages.
    pub fn has_stages(&self) -> bool {
        self.combine != PerStage::NONE
    }

    /// The specialization constants, as id and value.
    pub fn constants(&self) -> [(u32, u32); CONSTANTS] {
        [
            (id::MODE, self.mode),
            (id::FOG_ADJUST, self.fog_adjust),
            (id::CLIP, self.clip.into()),
            (id::TEXTURES, self.textures),
            (id::TC_MODS, self.tc_mods),
            (id::COMBINE, self.combine.bits()),
            (id::BLEND_SOURCE, self.blend_source.bits()),
            (id::BLEND_TARGET, self.blend_target.bits()),
            (id::ALPHA_FUNC, self.alpha_func.bits()),
            (id::COLOR, self.color.bits()),
            (id::RGB_GEN, self.rgb_gen.bits()),
            (id::ALPHA_GEN, self.alpha_gen.bits()),
            (id::TC_GEN, self.tc_gen.bits()),
            (id::MAPPING, self.mapping),
            (hybrid::SHADOWED, self.shadowed),
            (hybrid::MIRRORED, self.mirrored),
        ]
    }
}

/// The colour of a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StageColor {
    /// Value shared by all vertices; 1 if they differ.
    flat: [f32; 4],
    /// Whether the colour is white in every frame.
    always_white: bool,
    /// `RGBGEN_*`, if vertices differ in colour.
    rgb_gen: Option<u32>,
    /// `ALPHAGEN_*`, if vertices differ in alpha.
    alpha_gen: Option<u32>,
}

impl StageColor {
    const WHITE: Self = Self {
        flat: [1.0; 4],
        always_white: true,
        rgb_gen: None,
        alpha_gen: None,
    };
}

/// Evaluation of dynamic lights per pixel, by Quake3e's `r_dlight*`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelLights {
    /// Factor of the lights' colours.
    pub scale: f32,
    /// Reflectance of the highlight; negative: factor of the texture.
    pub specular: f32,
    /// Exponent of the highlight.
    pub power: f32,
}

impl PixelLights {
    /// By the settings; `None` with `r_dlightMode 0`.
    pub fn new(settings: &Settings) -> Option<Self> {
        let scale = if settings.ignore_hw_gamma {
            2.0 * settings.intensity.powf(settings.gamma)
        } else {
            1.0
        };
        (settings.dlight_mode != 0).then_some(Self {
            scale,
            specular: settings.dlight_specular,
            power: settings.dlight_specular_power,
        })
    }
}

/// Parameters for the evaluation of stages.
#[derive(Clone, Copy)]
pub struct StageContext<'a> {
    /// Materials.
    pub materials: &'a Materials,
    /// Current samplers.
    pub samplers: &'a Samplers,
    /// 1 over 2 to the power of the overbright bits.
    pub identity_light: f32,
    /// Texture of a dynamic light's spot.
    pub light_spot: u32,
    /// Evaluation of dynamic lights per pixel; `None`: they are spots.
    pub pixel_lights: Option<PixelLights>,
    /// Maps that vary light.
    pub mapping: SurfaceMapping,
    /// Replaces every texture (`r_nobind`).
    pub only_texture: Option<u32>,
    /// Rays find the shadows of models and of dynamic lights.
    pub traced_shadows: bool,
}

impl StageContext<'_> {
    /// The draw of one pass, or of several that share a draw ([`super::passes`]), on an instance. `draw` has the values
    /// that do not depend on stages; `lightmap` is the page's texture or `NO_TEXTURE`; `fog_adjust` is one of
    /// `FOG_ADJUST_*`, for a single pass.
    pub fn passes(
        &self,
        material: &Material,
        passes: &[RasterPass],
        instance: &Instance,
        lightmap: u32,
        fog_adjust: u32,
        draw: Draw,
    ) -> (Shading, Draw) {
        let time = material_time(material, instance);
        let mut draw = Draw { time, ..draw };
        let mut shading = Shading {
            fog_adjust,
            ..Shading::WHITE
        };
        for (place, (pass, part)) in (0..DRAW_STAGES).zip(parts(passes)) {
            let combine = match (place, part, pass.combine) {
                (0, ..) => c::COMBINE_NONE,
                (_, 0, _) => c::COMBINE_BLEND,
                (.., Combine::Modulate) => c::COMBINE_MODULATE,
                (.., Combine::Add) => c::COMBINE_ADD,
            };
            shading.combine.set(place, combine);
            if combine == c::COMBINE_BLEND {
                let (source, target) = pass.blend.unwrap_or((c::BLEND_ONE, c::BLEND_ZERO));
                shading.blend_source.set(place, source);
                shading.blend_target.set(place, target);
            }
            if part + 1 == pass.stage_count as usize {
                shading.alpha_func.set(place, pass.alpha_func);
            }
            let index = pass.stages[part];
            draw.stages[place] = index;
            let script = script_stage(material, index);
            self.set_texture(place, script, instance, lightmap, &mut shading, &mut draw);
            let color = match (part, script) {
                (0, Some(script)) => self.color(script, instance, time),
                // a pass has the colour of its first stage
                _ => StageColor::WHITE,
            };
            draw.colors[place] = color.flat;
            let fades = part == 0 && fog_adjust != c::FOG_ADJUST_NONE;
            let kind = if fades || color.rgb_gen.is_some() || color.alpha_gen.is_some() {
                shading
                    .rgb_gen
                    .set(place, color.rgb_gen.unwrap_or(c::RGBGEN_IDENTITY));
                shading
                    .alpha_gen
                    .set(place, color.alpha_gen.unwrap_or(c::ALPHAGEN_CONST));
                c::COLOR_VERTEX
            } else if color.always_white {
                c::COLOR_WHITE
            } else {
                c::COLOR_FLAT
            };
            shading.color.set(place, kind);
        }
        let mapping = self
            .mapping
            .of_draw(material, draw.stages, shading.textures);
        if let Some(mapping) = mapping.filter(|_| self.only_texture.is_none()) {
            shading.mapping = mapping;
            draw.material = material.order;
        }
        (shading, draw)
    }

    /// The draw of a texture with a sampler ([`sampler`]), times vertex colours.
    pub fn image(&self, texture: u32, kind: u32, draw: Draw) -> (Shading, Draw) {
        let shading = Shading {
            textures: 1,
            ..Shading::VERTEX_COLOR
        };
        (shading, self.textured(texture, kind, draw))
    }

    /// The draw of a texture with a sampler, times vertex colours with their alpha.
    pub fn translucent_image(&self, texture: u32, kind: u32, draw: Draw) -> (Shading, Draw) {
        let (shading, draw) = self.image(texture, kind, draw);
        let shading = Shading {
            alpha_gen: PerStage::first(c::ALPHAGEN_VERTEX),
            ..shading
        };
        (shading, draw)
    }

    /// The draw of a texture with a sampler, at the brightness of white before overbright bits. That factor is not
    /// rounded to a byte: the engine passes this colour as floats.
    pub fn plain_image(&self, texture: u32, kind: u32, draw: Draw) -> (Shading, Draw) {
        let light = self.identity_light;
        let shading = Shading {
            textures: 1,
            color: PerStage::first(if light >= 1.0 {
                c::COLOR_WHITE
            } else {
                c::COLOR_FLAT
            }),
            ..Shading::WHITE
        };
        let mut draw = self.textured(texture, kind, draw);
        draw.colors[0] = [light, light, light, 1.0];
        (shading, draw)
    }

    /// The draw of a dynamic light on a surface.
    pub fn light(&self, draw: Draw) -> (Shading, Draw) {
        (
            Shading::LIGHT,
            self.textured(self.light_spot, sampler::CLAMP, draw),
        )
    }

    /// The draw of a dynamic light that is evaluated per pixel: the texture of one of the material's stages reflects it.
    pub fn pixel_light(
        &self,
        material: &Material,
        stage: u32,
        instance: &Instance,
        lightmap: u32,
        draw: Draw,
    ) -> (Shading, Draw) {
        let mut shading = Shading {
            mode: c::DRAW_PIXEL_LIGHT,
            ..Shading::WHITE
        };
        let mut draw = Draw {
            time: material_time(material, instance),
            ..draw
        };
        draw.stages[0] = stage;
        let script = script_stage(material, stage);
        self.set_texture(0, script, instance, lightmap, &mut shading, &mut draw);
        if let Some(lights) = self.pixel_lights {
            let both_sides = f32::from(material.cull == Cull::None);
            draw.colors[0] = [lights.scale, lights.specular, lights.power, both_sides];
        }
        (shading, draw)
    }

    /// Sets the texture of the stage at a place in the draw, and its texture coordinates.
    fn set_texture(
        &self,
        place: usize,
        script: Option<&shaderscript::Stage>,
        instance: &Instance,
        lightmap: u32,
        shading: &mut Shading,
        draw: &mut Draw,
    ) {
        let index = draw.stages[place];
        let Some(stage) = slice::get(&self.materials.arrays().stages, index as usize) else {
            return; // a material has its stages
        };
        if let Some(texture) = self.stage_texture(stage, lightmap, draw.time) {
            shading.textures |= 1 << place;
            shading.tc_gen.set(place, stage.tc_gen);
            draw.textures[place] = self.handle(texture, stage.sampler_index);
            let tc_mods = script.map_or(&[][..], |s| &s.tc_mods);
            match affine(tc_mods, seconds(draw.time), instance.texcoord) {
                Some(matrix) => draw.texcoords[place] = matrix,
                None => shading.tc_mods |= 1 << place,
            }
        }
    }

    /// The draw of fog over a surface.
    pub fn fog(&self, draw: Draw) -> (Shading, Draw) {
        let shading = Shading {
            mode: c::DRAW_FOG,
            textures: 1,
            ..Shading::WHITE
        };
        let picture = self.materials.internal().fog_image;
        (shading, self.textured(picture, sampler::CLAMP, draw))
    }

    /// The draw of a lightmap page only.
    pub fn lightmap(&self, texture: u32, draw: Draw) -> (Shading, Draw) {
        let shading = Shading {
            textures: 1,
            tc_gen: PerStage::first(c::TCGEN_LIGHTMAP),
            ..Shading::WHITE
        };
        (shading, self.textured(texture, sampler::CLAMP, draw))
    }

    /// The draw, with one texture.
    fn textured(&self, texture: u32, kind: u32, mut draw: Draw) -> Draw {
        draw.textures[0] = self.handle(texture, kind);
        draw.texcoords[0] = UNCHANGED;
        draw.colors[0] = StageColor::WHITE.flat;
        draw
    }

    /// Handle of a texture with a sampler ([`sampler`]).
    fn handle(&self, texture: u32, kind: u32) -> u32 {
        // the spot's sampler stays clamped, whatever its texture
        let (texture, kind) = match self.only_texture {
            Some(only) => (only, sampler::CLAMP),
            None => (texture, kind),
        };
        texture & ((1 << TEXTURE_BITS) - 1) | self.samplers.index(kind) << TEXTURE_BITS
    }

    /// The texture of a stage at a time; `None` for white.
    fn stage_texture(
        &self,
        stage: &shaders::types::Stage,
        lightmap: u32,
        time: f32,
    ) -> Option<u32> {
        if self.only_texture.is_some() {
            return self.only_texture;
        }
        if stage.flags & c::STAGE_WHITE != 0 {
            return None;
        }
        let texture = match stage.image_count {
            0 => lightmap,
            count => {
                // the conversion saturates; NaN gives frame 0
                let frame = (time * stage.image_frequency).floor().max(0.0) as u64;
                let frame = (frame % u64::from(count)) as u32;
                let index = (stage.image_first + frame) as usize;
                *self.materials.arrays().images.get(index)?
            }
        };
        (texture != c::NO_TEXTURE).then_some(texture)
    }

    /// The colour of a stage.
    fn color(&self, stage: &shaderscript::Stage, instance: &Instance, time: f32) -> StageColor {
        let time = seconds(time);
        let rgb = self.rgb(&stage.rgb_gen, instance.color, time);
        let mut alpha = alpha(&stage.alpha_gen, instance.color, time);
        if matches!(stage.alpha_gen, AlphaGen::Identity) {
            // light and vertex colours may have their own alpha
            alpha.per_vertex = rgb.per_vertex.map(|_| c::ALPHAGEN_IDENTITY);
        }
        let ([r, g, b], [a]) = (rgb.flat, alpha.flat);
        StageColor {
            // the engine stores bytes; see `point_color` in material.glsl
            flat: [r, g, b, a].map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.001).floor() / 255.0),
            always_white: rgb.always_white && alpha.always_white,
            rgb_gen: rgb.per_vertex,
            alpha_gen: alpha.per_vertex,
        }
    }

    fn rgb(&self, rgb_gen: &RgbGen, [r, g, b, _]: [f32; 4], time: f64) -> Channels<3> {
        match rgb_gen {
            RgbGen::Identity => Channels::constant([1.0; 3]),
            RgbGen::IdentityLighting => Channels::constant([self.identity_light; 3]),
            RgbGen::Const(rgb) => Channels::constant(rgb.to_array()),
            RgbGen::Wave(wave) => {
                let scale = match wave.function {
                    WaveFunction::Noise => 1.0,
                    _ => self.identity_light,
                };
                Channels::changing([eval::wave(wave, time) * scale; 3])
            }
            RgbGen::Entity => Channels::changing([r, g, b]),
            RgbGen::OneMinusEntity => Channels::changing([1.0 - r, 1.0 - g, 1.0 - b]),
            RgbGen::Vertex => Channels::per_vertex(c::RGBGEN_VERTEX),
            RgbGen::ExactVertex => Channels::per_vertex(c::RGBGEN_EXACT_VERTEX),
            RgbGen::OneMinusVertex => Channels::per_vertex(c::RGBGEN_ONE_MINUS_VERTEX),
            RgbGen::LightingDiffuse => Channels::per_vertex(c::RGBGEN_LIGHTING_DIFFUSE),
        }
    }
}

fn alpha(alpha_gen: &AlphaGen, [.., a]: [f32; 4], time: f64) -> Channels<1> {
    match alpha_gen {
        AlphaGen::Identity => Channels::constant([1.0]),
        AlphaGen::Const(alpha) => Channels::constant([*alpha]),
        AlphaGen::Wave(wave) => Channels::changing([eval::wave(wave, time)]),
        AlphaGen::Entity => Channels::changing([a]),
        AlphaGen::OneMinusEntity => Channels::changing([1.0 - a]),
        AlphaGen::Vertex => Channels::per_vertex(c::ALPHAGEN_VERTEX),
        AlphaGen::OneMinusVertex => Channels::per_vertex(c::ALPHAGEN_ONE_MINUS_VERTEX),
        AlphaGen::LightingSpecular => Channels::per_vertex(c::ALPHAGEN_LIGHTING_SPECULAR),
        AlphaGen::Portal { .. } => Channels::per_vertex(c::ALPHAGEN_PORTAL),
    }
}

/// Channels of a stage's colour: RGB or alpha.
struct Channels<const N: usize> {
    /// Value shared by all vertices of a draw; 1 if they differ.
    flat: [f32; N],
    /// The value is 1 in every frame. False for waves that reach 1, so that a pulse does not change the pipeline.
    always_white: bool,
    /// Evaluation in the vertex shader, if vertices differ.
    per_vertex: Option<u32>,
}

impl<const N: usize> Channels<N> {
    fn constant(flat: [f32; N]) -> Self {
        Self {
            flat,
            always_white: flat.iter().all(|v| *v >= 1.0),
            per_vertex: None,
        }
    }

    fn changing(flat: [f32; N]) -> Self {
        Self {
            flat,
            always_white: false,
            per_vertex: None,
        }
    }

    fn per_vertex(source: u32) -> Self {
        Self {
            flat: [1.0; N],
            always_white: true,
            per_vertex: Some(source),
        }
    }
}

/// The stages of passes: each pass with the index of the stage in it.
fn parts(passes: &[RasterPass]) -> impl Iterator<Item = (&RasterPass, usize)> {
    let stages = |pass: &RasterPass| 0..pass.stages.len().min(pass.stage_count as usize);
    (passes.iter()).flat_map(move |pass| stages(pass).map(move |part| (pass, part)))
}

/// A time of the engine. Its clock counts milliseconds, which `f32` seconds only approximate, and its wave tables have
/// steps at whole milliseconds.
fn seconds(time: f32) -> f64 {
    let near = f64::from(time);
    let whole = (near * 1000.0).round() / 1000.0;
    if whole as f32 == time { whole } else { near }
}

/// Shader time of a material on an instance, seconds.
fn material_time(material: &Material, instance: &Instance) -> f32 {
    let clamp = material.shader.clamp_time.unwrap_or(f32::INFINITY);
    (instance.time - material.time_offset).min(clamp)
}

/// The script's stage for a GPU stage.
fn script_stage(material: &Material, index: u32) -> Option<&shaderscript::Stage> {
    let place = index.checked_sub(material.stage_first)?;
    material.shader.stages.get(place as usize)
}

/// [`Draw::texcoords`] without a `tcMod`.
const UNCHANGED: [f32; 6] = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];

/// `tcMod`s as [`Draw::texcoords`]; `None` if they differ between vertices.
fn affine(tc_mods: &[TcMod], time: f64, entity_st: Vec2) -> Option<[f32; 6]> {
    if tc_mods.is_empty() {
        return Some(UNCHANGED);
    }
    if tc_mods
        .iter()
        .any(|tc_mod| matches!(tc_mod, TcMod::Turbulent { .. }))
    {
        return None;
    }
    let at = |st| eval::apply_tc_mods(tc_mods, st, glam::Vec3::ZERO, time, entity_st);
    let origin = at(Vec2::ZERO);
    let (s, t) = (at(Vec2::X) - origin, at(Vec2::Y) - origin);
    Some([s.x, s.y, t.x, t.y, origin.x, origin.y])
}
