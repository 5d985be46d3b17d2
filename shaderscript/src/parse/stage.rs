//! Keywords inside a stage.

use super::{
    definition::{DefinitionParser, Rejection},
    values::{destination_factor, lookup, source_factor},
};
use crate::{
    reflection::{NormalStage, SpecularStage, roughness_of_exponent},
    stage::{AlphaFunc, AlphaGen, BlendFactor, DepthFunc, RgbGen, Stage, StageImage, TcGen, TcMod},
    token::{Token, number},
};
use glam::{Vec2, Vec3};

/// Images of an animation that the engine shows.
const MAX_ANIMATION_IMAGES: usize = 8;
/// Texture coordinate changes that the engine allows.
const MAX_TC_MODS: usize = 4;

/// A stage as far as it is read.
struct Draft {
    image: Option<StageImage>,
    replaced: Vec<StageImage>,
    /// `map $lightmap` occurred, even when another image came after it.
    lightmap_named: bool,
    blend: Option<(BlendFactor, BlendFactor)>,
    alpha_func: Option<AlphaFunc>,
    depth_write: bool,
    depth_write_forced: bool,
    depth_func: DepthFunc,
    detail: bool,
    dynamic_light: bool,
    rgb_gen: Option<RgbGen>,
    alpha_gen: AlphaGen,
    tc_gen: Option<TcGen>,
    tc_mods: Vec<TcMod>,
    /// A change that could not be read ends the list.
    tc_mods_ended: bool,
    kind: Kind,
    normals: NormalStage,
    specular: SpecularStage,
}

/// What a stage is for (`stage NAME`).
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Color,
    Normals,
    Specular,
}

/// A stage that is read.
pub(super) enum Read {
    /// It is drawn.
    Color(Stage, SpecularStage),
    Normals(NormalStage),
    Specular(SpecularStage),
}

impl Draft {
    fn set_image(&mut self, image: StageImage) {
        self.replaced.extend(self.image.replace(image));
    }
}

impl DefinitionParser<'_, '_, '_> {
    /// Reads a stage whose opening brace is read; `None` when it names no image.
    pub(super) fn stage(&mut self) -> Result<Option<Read>, Rejection> {
        let line = self.at.line;
        let mut draft = Draft {
            image: None,
            replaced: Vec::new(),
            lightmap_named: false,
            blend: None,
            alpha_func: None,
            depth_write: true,
            depth_write_forced: false,
            depth_func: DepthFunc::LessEqual,
            detail: false,
            dynamic_light: false,
            rgb_gen: None,
            alpha_gen: AlphaGen::Identity,
            tc_gen: None,
            tc_mods: Vec::new(),
            tc_mods_ended: false,
            kind: Kind::Color,
            normals: NormalStage::default(),
            specular: SpecularStage::default(),
        };
        loop {
            let token = self
                .lexer
                .token()
                .ok_or_else(|| Rejection("no closing '}' of a stage".to_owned()))?;
            self.at = token.position;
            if token.text.starts_with('}') {
                break;
            }
            self.stage_keyword(&token, &mut draft)?;
        }
        Ok(self.finish(draft, line))
    }

    fn stage_keyword(&mut self, token: &Token, draft: &mut Draft) -> Result<(), Rejection> {
        match token.text.to_ascii_lowercase().as_str() {
            "map" => {
                let name = self.required("map")?;
                let image = if name.eq_ignore_ascii_case("$whiteimage") || name == "*white" {
                    StageImage::White
                } else if name.eq_ignore_ascii_case("$lightmap") {
                    draft.lightmap_named = true;
                    StageImage::Lightmap
                } else {
                    StageImage::Map(name)
                };
                draft.set_image(image);
            }
            "clampmap" => draft.set_image(StageImage::ClampMap(self.required("clampMap")?)),
            // the engine's picture of the screen needs its r_fbo; without it, it takes the image
            "screenmap" if self.extended => {
                draft.set_image(StageImage::Map(self.required("screenMap")?));
            }
            "animmap" => self.animation(draft)?,
            "videomap" => draft.set_image(StageImage::Video(self.required("videoMap")?)),
            "alphafunc" => {
                const NAMES: [(&str, AlphaFunc); 3] = [
                    ("GT0", AlphaFunc::Gt0),
                    ("LT128", AlphaFunc::Lt128),
                    ("GE128", AlphaFunc::Ge128),
                ];
                let name = self.required("alphaFunc")?;
                draft.alpha_func = lookup(&NAMES, &name);
                if draft.alpha_func.is_none() {
                    self.warn(format!("unknown alphaFunc '{name}', using none"));
                }
            }
            "depthfunc" => {
                let name = self.required("depthFunc")?;
                if name.eq_ignore_ascii_case("lequal") {
                    draft.depth_func = DepthFunc::LessEqual;
                } else if name.eq_ignore_ascii_case("equal") {
                    draft.depth_func = DepthFunc::Equal;
                } else {
                    self.warn(format!("unknown depthFunc '{name}'"));
                }
            }
            "detail" => draft.detail = true,
            "blendfunc" => self.blend(draft),
            "rgbgen" => self.rgb_gen(draft),
            "alphagen" => self.alpha_gen(draft),
            "tcgen" | "texgen" => self.tc_gen(draft),
            "tcmod" => self.tc_mod(draft),
            "depthwrite" => {
                draft.depth_write = true;
                draft.depth_write_forced = true;
            }
            "dlight" if self.extended => draft.dynamic_light = true,
            // only the engine's own depth pass uses it
            "depthfragment" if self.extended => {}
            "stage" => self.kind(draft),
            "normalscale" => self.normal_scale(draft),
            "specularscale" => self.specular_scale(draft),
            word @ ("specularreflectance"
            | "specularexponent"
            | "gloss"
            | "roughness"
            | "parallaxdepth") => self.specular_word(word, draft),
            _ => return Err(Rejection(format!("unknown stage keyword '{}'", token.text))),
        }
        Ok(())
    }

    fn kind(&mut self, draft: &mut Draft) {
        let Some(kind) = self.lexer.token_on_line() else {
            self.warn("stage without a kind");
            return;
        };
        draft.kind = match kind.text.to_ascii_lowercase().as_str() {
            "diffusemap" => Kind::Color,
            word @ ("normalmap" | "bumpmap" | "normalparallaxmap" | "bumpparallaxmap") => {
                draft.normals = NormalStage {
                    heights: word.ends_with("parallaxmap"),
                    ..NormalStage::default()
                };
                Kind::Normals
            }
            "specularmap" => {
                draft.specular = SpecularStage::default();
                Kind::Specular
            }
            _ => {
                self.warn(format!("unknown stage '{}'", kind.text));
                return;
            }
        };
    }

    /// The numbers up to the end of the line.
    fn numbers(&mut self) -> Vec<f32> {
        std::iter::from_fn(|| self.lexer.token_on_line())
            .map(|token| token.number())
            .collect()
    }

    fn normal_scale(&mut self, draft: &mut Draft) {
        let normals = &mut draft.normals;
        match self.numbers()[..] {
            [] => self.warn("normalScale without a number"),
            [both] => normals.scale = Some(Vec2::splat(both)),
            [x, y, ref rest @ ..] => {
                normals.scale = Some(Vec2::new(x, y));
                normals.depth = rest.first().copied().or(normals.depth);
            }
        }
    }

    fn specular_scale(&mut self, draft: &mut Draft) {
        let numbers = self.numbers();
        let specular = &mut draft.specular;
        match (numbers[..].as_ref(), self.pbr) {
            ([] | [_], _) => self.warn("specularScale needs at least two numbers"),
            (&[metal, gloss], true) => {
                specular.metal = Some(if metal < 0.5 { 0.0 } else { 1.0 });
                specular.gloss = Some(gloss);
            }
            (&[gloss, metal, ..], true) => {
                specular.gloss = Some(gloss);
                specular.metal = Some(metal);
            }
            (&[all, gloss], false) => {
                specular.reflectance = Some(Vec3::splat(all));
                specular.gloss = Some(gloss);
            }
            (&[r, g, b, ref rest @ ..], false) => {
                specular.reflectance = Some(Vec3::new(r, g, b));
                specular.gloss = rest.first().copied().or(specular.gloss);
            }
        }
    }

    /// A word with one number.
    fn specular_word(&mut self, word: &str, draft: &mut Draft) {
        let Some(value) = self.lexer.token_on_line().map(|token| token.number()) else {
            self.warn(format!("{word} without a number"));
            return;
        };
        let specular = &mut draft.specular;
        let mut gloss_of = |roughness: f32| specular.gloss = Some(self.gloss.gloss(roughness));
        match word {
            "specularreflectance" if self.pbr => {
                specular.metal = Some(if value < 0.5 { 0.0 } else { 1.0 });
            }
            "specularreflectance" => specular.reflectance = Some(Vec3::splat(value)),
            "specularexponent" => gloss_of(roughness_of_exponent(value)),
            "gloss" if self.pbr => gloss_of((-3.0 * value).exp2()),
            "gloss" => specular.gloss = Some(value),
            "roughness" => gloss_of(value),
            _ => draft.normals.depth = Some(value),
        }
    }

    fn required(&mut self, keyword: &str) -> Result<String, Rejection> {
        self.lexer
            .token_on_line()
            .map(|token| token.text)
            .ok_or_else(|| Rejection(format!("{keyword} without an argument")))
    }

    fn animation(&mut self, draft: &mut Draft) -> Result<(), Rejection> {
        let frequency = number(&self.required("animMap")?);
        let (before, mut images) = match draft.image.take() {
            // A second line adds to the first.
            Some(StageImage::Animation { images, .. }) => (None, images),
            other => (other, Vec::new()),
        };
        let mut found = images.len();
        while let Some(token) = self.lexer.token_on_line() {
            found += 1;
            if images.len() < MAX_ANIMATION_IMAGES {
                images.push(token.text);
            }
        }
        if found > MAX_ANIMATION_IMAGES {
            self.warn(format!(
                "animMap has {found} images; {MAX_ANIMATION_IMAGES} are shown"
            ));
        }
        // Without images the stage keeps the one that it had.
        draft.image = before;
        if !images.is_empty() {
            draft.set_image(StageImage::Animation { frequency, images });
        }
        Ok(())
    }

    fn blend(&mut self, draft: &mut Draft) {
        use BlendFactor::{DstColor, One, OneMinusSrcAlpha, SrcAlpha, Zero};
        const SHORT: [(&str, (BlendFactor, BlendFactor)); 3] = [
            ("add", (One, One)),
            ("filter", (DstColor, Zero)),
            ("blend", (SrcAlpha, OneMinusSrcAlpha)),
        ];
        let Some(first) = self.lexer.token_on_line() else {
            self.warn("blendFunc without an argument");
            return;
        };
        draft.blend = Some(if let Some(pair) = lookup(&SHORT, &first.text) {
            pair
        } else {
            let source = source_factor(&first.text).unwrap_or_else(|| {
                self.warn(format!(
                    "'{}' is no source factor, using GL_ONE",
                    first.text
                ));
                One
            });
            let Some(second) = self.lexer.token_on_line() else {
                self.warn("blendFunc needs two factors; the stage does not blend");
                return;
            };
            let destination = destination_factor(&second.text).unwrap_or_else(|| {
                self.warn(format!(
                    "'{}' is no destination factor, using GL_ONE",
                    second.text
                ));
                One
            });
            (source, destination)
        });
        if !draft.depth_write_forced {
            draft.depth_write = false;
        }
    }

    fn rgb_gen(&mut self, draft: &mut Draft) {
        // the last two are words of `opengl2` for vertex colours under normal maps
        const SIMPLE: [(&str, RgbGen); 10] = [
            ("identity", RgbGen::Identity),
            ("identityLighting", RgbGen::IdentityLighting),
            ("entity", RgbGen::Entity),
            ("oneMinusEntity", RgbGen::OneMinusEntity),
            ("vertex", RgbGen::Vertex),
            ("exactVertex", RgbGen::ExactVertex),
            ("lightingDiffuse", RgbGen::LightingDiffuse),
            ("oneMinusVertex", RgbGen::OneMinusVertex),
            ("vertexLit", RgbGen::Vertex),
            ("exactVertexLit", RgbGen::ExactVertex),
        ];
        let Some(kind) = self.lexer.token_on_line() else {
            self.warn("rgbGen without an argument");
            return;
        };
        if kind.is("wave") {
            draft.rgb_gen = Some(RgbGen::Wave(self.wave("rgbGen wave", true)));
        } else if kind.is("const") {
            let mut color = Vec3::ZERO;
            if let Err(fault) = self.vector(&mut color) {
                self.warn(format!("rgbGen const: {fault}"));
            }
            draft.rgb_gen = Some(RgbGen::Const(color));
        } else if let Some((_, rgb_gen)) = SIMPLE.iter().find(|(name, _)| kind.is(name)) {
            if *rgb_gen == RgbGen::Vertex && draft.alpha_gen == AlphaGen::Identity {
                draft.alpha_gen = AlphaGen::Vertex;
            }
            draft.rgb_gen = Some(rgb_gen.clone());
        } else {
            self.warn(format!("unknown rgbGen '{}'", kind.text));
        }
    }

    fn alpha_gen(&mut self, draft: &mut Draft) {
        const SIMPLE: [(&str, AlphaGen); 6] = [
            ("identity", AlphaGen::Identity),
            ("entity", AlphaGen::Entity),
            ("oneMinusEntity", AlphaGen::OneMinusEntity),
            ("vertex", AlphaGen::Vertex),
            ("lightingSpecular", AlphaGen::LightingSpecular),
            ("oneMinusVertex", AlphaGen::OneMinusVertex),
        ];
        let Some(kind) = self.lexer.token_on_line() else {
            self.warn("alphaGen without an argument");
            return;
        };
        if kind.is("wave") {
            draft.alpha_gen = AlphaGen::Wave(self.wave("alphaGen wave", false));
        } else if kind.is("const") {
            let value = self.lexer.token_on_line();
            if value.is_none() {
                self.warn("alphaGen const without a value, using 0");
            }
            draft.alpha_gen = AlphaGen::Const(value.map_or(0.0, |t| t.number()));
        } else if kind.is("portal") {
            let range = self.lexer.token_on_line();
            if range.is_none() {
                self.warn("alphaGen portal without a range, using 256");
            }
            draft.alpha_gen = AlphaGen::Portal {
                range: range.map_or(256.0, |t| t.number()),
            };
        } else if let Some((_, alpha_gen)) = SIMPLE.iter().find(|(name, _)| kind.is(name)) {
            draft.alpha_gen = alpha_gen.clone();
        } else {
            self.warn(format!("unknown alphaGen '{}'", kind.text));
        }
    }

    fn tc_gen(&mut self, draft: &mut Draft) {
        let Some(kind) = self.lexer.token_on_line() else {
            self.warn("tcGen without an argument");
            return;
        };
        draft.tc_gen = match kind.text.to_ascii_lowercase().as_str() {
            "environment" => {
                let before = self.lexer;
                let word = self.lexer.token_on_line();
                // the same to this renderer: the engine tilts it on the player's own weapon
                if !(self.extended && word.is_some_and(|word| word.is("firstPerson"))) {
                    self.lexer = before;
                }
                Some(TcGen::Environment)
            }
            "lightmap" => Some(TcGen::Lightmap),
            "texture" | "base" => Some(TcGen::Base),
            "vector" => {
                let mut axes = [Vec3::ZERO; 2];
                for axis in &mut axes {
                    if let Err(fault) = self.vector(axis) {
                        self.warn(format!("tcGen vector: {fault}"));
                    }
                }
                Some(TcGen::Vector(axes[0], axes[1]))
            }
            _ => {
                self.warn(format!("unknown tcGen '{}'", kind.text));
                return;
            }
        };
    }

    fn tc_mod(&mut self, draft: &mut Draft) {
        let mut words = Vec::new();
        while let Some(token) = self.lexer.token_on_line() {
            words.push(token.text);
        }
        if draft.tc_mods_ended {
            self.warn("tcMod after one that could not be read; it is ignored");
            return;
        }
        match self.tc_mod_of(&words) {
            Ok(tc_mod) => {
                draft.tc_mods.push(tc_mod);
                if draft.tc_mods.len() == MAX_TC_MODS + 1 {
                    self.warn(format!(
                        "more than {MAX_TC_MODS} tcMods; the engine stops with an error here"
                    ));
                }
            }
            Err(fault) => {
                self.warn(fault);
                draft.tc_mods_ended = true;
            }
        }
    }

    fn tc_mod_of(&mut self, words: &[String]) -> Result<TcMod, String> {
        let Some((kind, arguments)) = words.split_first() else {
            return Err("tcMod without an argument".to_owned());
        };
        let argument = |i: usize| {
            arguments
                .get(i)
                .map(|word| number(word))
                .ok_or_else(|| format!("tcMod {kind}: missing argument"))
        };
        let pair = |i: usize| Ok::<_, String>(Vec2::new(argument(i)?, argument(i + 1)?));
        match kind.to_ascii_lowercase().as_str() {
            "turb" => Ok(TcMod::Turbulent {
                base: argument(0)?,
                amplitude: argument(1)?,
                phase: argument(2)?,
                frequency: argument(3)?,
            }),
            "scale" => Ok(TcMod::Scale(pair(0)?)),
            "scroll" => Ok(TcMod::Scroll(pair(0)?)),
            "stretch" => match self.wave_of("tcMod stretch", arguments) {
                Ok(wave) => Ok(TcMod::Stretch(wave)),
                Err(_) => Err("tcMod stretch: missing argument".to_owned()),
            },
            "transform" => Ok(TcMod::Transform {
                matrix: [[argument(0)?, argument(1)?], [argument(2)?, argument(3)?]],
                translate: pair(4)?,
            }),
            "rotate" => Ok(TcMod::Rotate(argument(0)?)),
            "entitytranslate" => Ok(TcMod::EntityTranslate),
            _ => Err(format!("unknown tcMod '{kind}'")),
        }
    }

    /// Fills in what the script leaves open.
    fn finish(&self, mut draft: Draft, line: u32) -> Option<Read> {
        let image = draft.image?;
        draft.specular.metallic = self.pbr;
        match draft.kind {
            Kind::Color => {}
            Kind::Normals => {
                return Some(Read::Normals(NormalStage {
                    image: image.names().first()?.clone(),
                    ..draft.normals
                }));
            }
            Kind::Specular => {
                draft.specular.image = Some(image.names().first()?.clone());
                return Some(Read::Specular(draft.specular));
            }
        }
        let rgb_gen = draft.rgb_gen.unwrap_or(match draft.blend {
            None | Some((BlendFactor::One | BlendFactor::SrcAlpha, _)) => RgbGen::IdentityLighting,
            Some(_) => RgbGen::Identity,
        });
        let overwrites = draft.blend == Some((BlendFactor::One, BlendFactor::Zero));
        let stage = Stage {
            image,
            replaced: draft.replaced,
            blend: if overwrites { None } else { draft.blend },
            alpha_func: draft.alpha_func,
            depth_write: draft.depth_write || overwrites,
            depth_func: draft.depth_func,
            detail: draft.detail,
            dynamic_light: draft.dynamic_light,
            rgb_gen,
            alpha_gen: draft.alpha_gen,
            tc_gen: draft.tc_gen.unwrap_or(if draft.lightmap_named {
                TcGen::Lightmap
            } else {
                TcGen::Base
            }),
            tc_mods: draft.tc_mods,
            no_mipmaps: self.shader.no_mipmaps,
            no_picmip: self.shader.no_picmip,
            line,
        };
        Some(Read::Color(stage, draft.specular))
    }
}
