//! What the shaders of a draw are specialised for, and what of a stage is the same over a whole draw: that is
//! evaluated here, once, and neither per vertex nor per fragment.

use glam::Vec2;
use shaders::types::constants as c;
use shaders::types::{Draw, Instance};
use shaderscript::{AlphaGen, RgbGen, TcMod, WaveFunction, eval};

use crate::assets::compile::sampler;
use crate::assets::{Combine, Material, Materials, RasterPass, Samplers};

/// Bits of a texture handle in [`Draw::textures`] that are the texture's; the sampler's lie above.
const TEXTURE_BITS: u32 = 24;

/// What a draw's shaders do. Every value is a specialization constant (`shaders/raster/draw.glsl`), so that a fragment
/// pays for what its draw needs and not for all that any draw may need.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Shading {
    /// `DRAW_*`.
    pub mode: u32,
    /// Bit i: stage i has a texture; otherwise it is white.
    pub textures: u32,
    /// `COMBINE_*`.
    pub combine: u32,
    /// `ALPHAFUNC_*`.
    pub alpha_func: u32,
    /// `COLOR_*`.
    pub color: u32,
    /// `RGBGEN_*` of a colour per vertex.
    pub rgb_gen: u32,
    /// `ALPHAGEN_*` of a colour per vertex.
    pub alpha_gen: u32,
    /// `TCGEN_*` of each stage.
    pub tc_gen: [u32; 2],
    /// Bit i: the `tcMod`s of stage i differ between vertices.
    pub tc_mods: u32,
    /// `FOG_ADJUST_*`.
    pub fog_adjust: u32,
    /// There is a clip plane.
    pub clip: bool,
}

/// Number of specialization constants.
pub const CONSTANTS: usize = 12;

impl Shading {
    /// One colour, white.
    pub const WHITE: Self = Self {
        mode: c::DRAW_STAGE,
        textures: 0,
        combine: c::COMBINE_NONE,
        alpha_func: c::ALPHAFUNC_NONE,
        color: c::COLOR_WHITE,
        rgb_gen: 0,
        alpha_gen: 0,
        tc_gen: [0; 2],
        tc_mods: 0,
        fog_adjust: c::FOG_ADJUST_NONE,
        clip: false,
    };

    /// A dynamic light's spot.
    pub const LIGHT: Self = Self {
        mode: c::DRAW_LIGHT,
        textures: 1,
        ..Self::WHITE
    };

    /// The vertices' colours.
    pub const VERTEX_COLOR: Self = Self {
        color: c::COLOR_VERTEX,
        rgb_gen: c::RGBGEN_EXACT_VERTEX,
        ..Self::WHITE
    };

    /// The same with the second of two textures alone (`r_lightmap`).
    pub fn second_alone(self) -> Self {
        Self {
            combine: c::COMBINE_REPLACE,
            ..self
        }
    }

    /// The specialization constants: id and value.
    pub fn constants(&self) -> [(u32, u32); CONSTANTS] {
        [
            (0, self.mode),
            (1, self.textures),
            (2, self.combine),
            (3, self.alpha_func),
            (4, self.color),
            (5, self.rgb_gen),
            (6, self.alpha_gen),
            (7, self.tc_gen[0]),
            (8, self.tc_gen[1]),
            (9, self.tc_mods),
            (10, self.fog_adjust),
            (11, self.clip.into()),
        ]
    }
}

/// Where the colour of a stage comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Color {
    White,
    Flat([f32; 4]),
    Vertex,
}

/// What stages are evaluated with.
#[derive(Clone, Copy)]
pub struct StageContext<'a> {
    /// Materials.
    pub materials: &'a Materials,
    /// Samplers in force.
    pub samplers: &'a Samplers,
    /// 1 over 2 to the power of the overbright bits.
    pub identity_light: f32,
    /// The spot that a dynamic light makes on a wall.
    pub light_spot: u32,
    /// Shown in place of every texture (`r_nobind`).
    pub only_texture: Option<u32>,
}

impl StageContext<'_> {
    /// The draw of a pass of `material`'s on an instance. `draw` has what does not depend on the stages; `lightmap` is
    /// the page's texture or `NO_TEXTURE`, `fog_adjust` one of `FOG_ADJUST_*`.
    pub fn pass(
        &self,
        material: &Material,
        pass: &RasterPass,
        instance: &Instance,
        lightmap: u32,
        fog_adjust: u32,
        draw: Draw,
    ) -> (Shading, Draw) {
        let clamp = material.shader.clamp_time.unwrap_or(f32::INFINITY);
        let time = (instance.time - material.time_offset).min(clamp);
        let mut draw = Draw {
            stages: pass.stages,
            time,
            ..draw
        };
        let mut shading = Shading {
            combine: match (pass.stage_count, pass.combine) {
                (0 | 1, _) => c::COMBINE_NONE,
                (_, Combine::Modulate) => c::COMBINE_MODULATE,
                (_, Combine::Add) => c::COMBINE_ADD,
            },
            alpha_func: pass.alpha_func,
            ..Shading::WHITE
        };
        let arrays = self.materials.arrays();
        for (i, &index) in (0..).zip(pass.stages.iter().take(pass.stage_count as usize)) {
            let Some(stage) = arrays.stages.get(index as usize) else {
                continue;
            };
            let Some(texture) = self.stage_texture(stage, lightmap, time) else {
                continue;
            };
            let place = i as usize;
            shading.textures |= 1 << i;
            shading.tc_gen[place] = stage.tc_gen;
            draw.textures[place] = self.handle(texture, stage.sampler_index);
            let tc_mods = script_stage(material, index).map_or(&[][..], |s| &s.tc_mods);
            match affine(tc_mods, seconds(time), instance.texcoord) {
                Some(matrix) => draw.texcoords[place] = matrix,
                None => shading.tc_mods |= 1 << i,
            }
        }
        let color = match pass.stages.first() {
            _ if fog_adjust != c::FOG_ADJUST_NONE => Color::Vertex,
            Some(&first) => script_stage(material, first)
                .map_or(Color::White, |stage| self.color(stage, instance, time)),
            None => Color::White,
        };
        match color {
            Color::White => shading.color = c::COLOR_WHITE,
            Color::Flat(color) => {
                shading.color = c::COLOR_FLAT;
                draw.color = color;
            }
            Color::Vertex => {
                let stage = arrays.stages.get(pass.stages[0] as usize);
                shading.color = c::COLOR_VERTEX;
                shading.rgb_gen = stage.map_or(0, |s| s.rgb_gen);
                shading.alpha_gen = stage.map_or(0, |s| s.alpha_gen);
                shading.fog_adjust = fog_adjust;
            }
        }
        (shading, draw)
    }

    /// The draw of one texture, by a sampler ([`sampler`]), times the vertices' colours.
    pub fn image(&self, texture: u32, kind: u32, draw: Draw) -> (Shading, Draw) {
        let shading = Shading {
            textures: 1,
            ..Shading::VERTEX_COLOR
        };
        (shading, self.textured(texture, kind, draw))
    }

    /// The draw of one texture, by a sampler, as bright as white is before overbright bits. Not the byte of that: the
    /// engine hands this colour over as a number.
    pub fn plain_image(&self, texture: u32, kind: u32, draw: Draw) -> (Shading, Draw) {
        let light = self.identity_light;
        let shading = Shading {
            textures: 1,
            color: if light >= 1.0 {
                c::COLOR_WHITE
            } else {
                c::COLOR_FLAT
            },
            ..Shading::WHITE
        };
        let draw = Draw {
            color: [light, light, light, 1.0],
            ..draw
        };
        (shading, self.textured(texture, kind, draw))
    }

    /// The draw of a dynamic light on a surface.
    pub fn light(&self, draw: Draw) -> (Shading, Draw) {
        (
            Shading::LIGHT,
            self.textured(self.light_spot, sampler::CLAMP, draw),
        )
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

    /// The draw of a lightmap page alone.
    pub fn lightmap(&self, texture: u32, draw: Draw) -> (Shading, Draw) {
        let shading = Shading {
            textures: 1,
            tc_gen: [c::TCGEN_LIGHTMAP, 0],
            ..Shading::WHITE
        };
        (shading, self.textured(texture, sampler::CLAMP, draw))
    }

    fn textured(&self, texture: u32, kind: u32, draw: Draw) -> Draw {
        Draw {
            textures: [self.handle(texture, kind), 0],
            texcoords: [UNCHANGED, UNCHANGED],
            ..draw
        }
    }

    /// A texture with a sampler ([`sampler`]).
    fn handle(&self, texture: u32, kind: u32) -> u32 {
        // the spot is clamped, whatever it stands for
        let (texture, kind) = match self.only_texture {
            Some(only) => (only, sampler::CLAMP),
            None => (texture, kind),
        };
        texture & ((1 << TEXTURE_BITS) - 1) | self.samplers.index(kind) << TEXTURE_BITS
    }

    /// The texture that a stage shows at a time; `None` for white.
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
                // a float becomes the nearest integer there is, and no number is frame 0
                let frame = (time * stage.image_frequency).floor().max(0.0) as u64;
                let frame = (frame % u64::from(count)) as u32;
                let index = (stage.image_first + frame) as usize;
                *self.materials.arrays().images.get(index)?
            }
        };
        (texture != c::NO_TEXTURE).then_some(texture)
    }

    /// The colour of a stage, if it is the same for every vertex. White is only what is always white, so that a pulse
    /// does not change the pipeline.
    fn color(&self, stage: &shaderscript::Stage, instance: &Instance, time: f32) -> Color {
        let time = seconds(time);
        let [er, eg, eb, ea] = instance.color;
        let mut always_white = true;
        let rgb = match &stage.rgb_gen {
            RgbGen::Identity => [1.0; 3],
            RgbGen::IdentityLighting => {
                always_white &= self.identity_light >= 1.0;
                [self.identity_light; 3]
            }
            RgbGen::Const(rgb) => {
                always_white &= rgb.min_element() >= 1.0;
                rgb.to_array()
            }
            RgbGen::Wave(wave) => {
                always_white = false;
                let scale = match wave.function {
                    WaveFunction::Noise => 1.0,
                    _ => self.identity_light,
                };
                [eval::wave(wave, time) * scale; 3]
            }
            RgbGen::Entity => {
                always_white = false;
                [er, eg, eb]
            }
            RgbGen::OneMinusEntity => {
                always_white = false;
                [1.0 - er, 1.0 - eg, 1.0 - eb]
            }
            RgbGen::Vertex
            | RgbGen::ExactVertex
            | RgbGen::OneMinusVertex
            | RgbGen::LightingDiffuse => return Color::Vertex,
        };
        let alpha = match &stage.alpha_gen {
            AlphaGen::Identity => 1.0,
            AlphaGen::Const(alpha) => {
                always_white &= *alpha >= 1.0;
                *alpha
            }
            AlphaGen::Wave(wave) => {
                always_white = false;
                eval::wave(wave, time)
            }
            AlphaGen::Entity => {
                always_white = false;
                ea
            }
            AlphaGen::OneMinusEntity => {
                always_white = false;
                1.0 - ea
            }
            AlphaGen::Vertex
            | AlphaGen::OneMinusVertex
            | AlphaGen::LightingSpecular
            | AlphaGen::Portal { .. } => return Color::Vertex,
        };
        if always_white {
            return Color::White;
        }
        let [r, g, b] = rgb;
        // the engine keeps bytes; see `stage_color` in material.glsl
        Color::Flat([r, g, b, alpha].map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.001).floor() / 255.0))
    }
}

/// A time as the engine has it. Its clock counts milliseconds, which 32-bit seconds only come near to, and the engine's
/// tables are read at steps that whole milliseconds fall on.
fn seconds(time: f32) -> f64 {
    let near = f64::from(time);
    let whole = (near * 1000.0).round() / 1000.0;
    if whole as f32 == time { whole } else { near }
}

/// The script's stage of a GPU stage.
fn script_stage(material: &Material, index: u32) -> Option<&shaderscript::Stage> {
    let place = index.checked_sub(material.stage_first)?;
    material.shader.stages.get(place as usize)
}

/// [`Draw::texcoords`] of no `tcMod`.
const UNCHANGED: [f32; 6] = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];

/// What `tcMod`s come to, as in [`Draw::texcoords`]; `None` when they differ between vertices.
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
