//! A material as far as other programs can say it: one image for colour, one for glow, transparency, refraction,
//! reflection.
//!
//! Stages are classified by their effect, as in [`crate::materials::light`]. Those whose images lie on the
//! surface in the same way become one picture; of what moves against that, the brightest addition is kept as glow and
//! the rest is reported in [`Look::lost`].

use super::film::Film;
use super::layers::draws_nothing;
use super::losses::report_losses;
use super::reflection::{Reflection, ReflectionImage};
use super::stack::{self, Moment, Part, tiling};
use crate::materials::light::{
    LEAST_SLIME_TRANSMISSION, LIQUID_DEPTH, LightLinear, SurfaceClass, base_stage, cut_out_stage,
    glow_stages, liquid_color, refraction_index,
};
use crate::world::WorldMaterial;
use glam::{Vec2, Vec3, Vec4};
use shaderscript::surface_params::{CONTENTS_FOG, CONTENTS_SLIME};
use shaderscript::{
    AlphaFunc, AlphaGen, BlendFactor, Cull, ImplicitKind, RgbGen, Shader, Stage, StageImage, TcGen,
    TcMod, eval,
};

/// Roughness of what has a stage that shows its surroundings.
const SHINY: f32 = 0.3;
/// End of the message about such a stage.
pub const SURROUNDINGS: &str = "a picture of the surroundings; said by roughness";

/// A change of an image's alpha.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Edit {
    /// 255 − alpha.
    Inverted,
    /// For images that are added: alpha is the brightness, the colour is divided by it.
    FromBrightness,
    /// For images that multiply: black, alpha is what is taken away.
    FromDarkness,
}

impl Edit {
    /// A short name, for files.
    pub fn label(self) -> &'static str {
        match self {
            Edit::Inverted => "inverted",
            Edit::FromBrightness => "added",
            Edit::FromDarkness => "filter",
        }
    }
}

/// What an image is made of.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Picture {
    /// An image as the game has it.
    File(String),
    /// The same with another alpha.
    Edited(String, Edit),
    /// An image of reflection.
    Reflection(ReflectionImage),
    /// Several stages of a material together.
    Baked {
        /// The material, lower case.
        name: String,
        /// Which of its stages.
        stages: Vec<usize>,
        /// Which part of what they show.
        part: Part,
    },
    /// Images that follow each other, side by side or one below the other.
    Film(Film),
    /// A side of a sky with clouds.
    Sky {
        /// The material, lower case.
        name: String,
        /// Which side.
        side: usize,
    },
    /// A whole sky, all round.
    Panorama(String),
}

/// A picture and how it lies on the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Slot {
    /// The picture.
    pub picture: Picture,
    /// Whether it ends at its edge instead of repeating.
    pub clamp: bool,
    /// Changes to the texture coordinates.
    pub tc_mods: Vec<TcMod>,
}

impl Slot {
    /// A picture that repeats, at the texture coordinates of the surface.
    pub fn plain(picture: Picture) -> Slot {
        Slot {
            picture,
            clamp: false,
            tc_mods: Vec::new(),
        }
    }
}

/// How a surface hides what is behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alpha {
    /// Fully.
    Opaque,
    /// Where alpha is at least this.
    Mask(f32),
    /// By alpha.
    Blend,
}

/// Glass and liquids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dielectric {
    /// Index of refraction.
    pub index: f32,
    /// Part of light that passes.
    pub transmission: f32,
    /// Colour of white light after a distance in id units; `None` for panes, which have no inside.
    pub liquid: Option<(Vec3, f32)>,
}

/// A material for other programs.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// Image of its colour; `None` where no stage has one.
    pub color: Option<Slot>,
    /// Multiplies the colour, linear; alpha multiplies alpha.
    pub factor: Vec4,
    /// How it hides what is behind it.
    pub alpha: Alpha,
    /// Image of its glow.
    pub glow: Option<Slot>,
    /// Multiplies the glow, linear radiance.
    pub glow_factor: Vec3,
    /// Whether both sides are drawn.
    pub two_sided: bool,
    /// Whether the back is drawn instead of the front.
    pub reversed: bool,
    /// Whether colours of vertices multiply it, and whether these are light that the compiler found.
    pub vertex_color: Option<VertexColor>,
    /// Whether vertex alpha, or 1 - vertex alpha, multiplies alpha.
    pub vertex_alpha: Option<VertexAlpha>,
    /// Whether it is lit by lightmaps.
    pub lightmapped: bool,
    /// What glass and liquids do to light.
    pub dielectric: Option<Dielectric>,
    /// How it reflects.
    pub reflection: Reflection,
    /// Properties that the format cannot represent.
    pub lost: Vec<String>,
}

impl Look {
    /// Whether something of it is an image.
    pub fn has_pictures(&self) -> bool {
        self.color.is_some() || self.glow.is_some() || self.reflection.has_pictures()
    }

    /// Takes what changes from the look of another moment.
    pub fn take_factors(&mut self, now: &Look) {
        self.glow_factor = now.glow_factor;
        let color = self.color.as_ref().map(|slot| &slot.picture);
        if self.dielectric.is_none() && !matches!(color, Some(Picture::Baked { .. })) {
            self.factor = now.factor;
        }
    }
}

/// What colours of vertices are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VertexColor {
    /// Light that the map's compiler found.
    Light,
    /// Paint.
    Paint,
}

/// Which function of vertex alpha multiplies alpha.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VertexAlpha {
    /// Itself.
    Own,
    /// What it leaves of 1.
    Inverse,
}

impl VertexAlpha {
    /// What weighs a stage; `None` where neither does, or its alpha is not used.
    pub fn weighing(stage: &Stage) -> Option<VertexAlpha> {
        use BlendFactor::{OneMinusSrcAlpha, SrcAlpha, SrcAlphaSaturate};
        let by_alpha = |f| matches!(f, SrcAlpha | OneMinusSrcAlpha | SrcAlphaSaturate);
        let blends = |(source, destination)| by_alpha(source) || by_alpha(destination);
        let used = stage.alpha_func.is_some() || stage.blend.is_some_and(blends);
        match stage.alpha_gen {
            _ if !used || stage.is_lightmap() => None,
            AlphaGen::Vertex => Some(VertexAlpha::Own),
            AlphaGen::OneMinusVertex => Some(VertexAlpha::Inverse),
            _ => None,
        }
    }

    /// What multiplies alpha at a vertex with the alpha `byte`.
    pub fn weight(self, byte: u8) -> u8 {
        match self {
            VertexAlpha::Own => byte,
            VertexAlpha::Inverse => 255 - byte,
        }
    }
}

/// Reads a material. `mean` gives the mean colour of an image, linear, with its alpha; `None` for one that is missing.
/// `clear`: whether glass and liquids let light pass and refract it; else they are what their stages show. At a `moment`
/// pictures are those of the mean, and what changes is in the factors.
pub fn look(
    material: &WorldMaterial,
    clear: bool,
    moment: Moment,
    mean: &mut dyn FnMut(&str) -> Option<Vec4>,
) -> Look {
    let shader = &material.resolved.shader;
    let class = material.class;
    let lightmapped = material.lighting == ImplicitKind::Lightmapped && shader.has_lightmap_stage();
    // Compilers write light into vertices whether there are lightmaps or not.
    let vertex_light = !lightmapped;
    let mut look = Look {
        color: None,
        factor: Vec4::ONE,
        alpha: Alpha::Opaque,
        glow: None,
        glow_factor: Vec3::ZERO,
        two_sided: class.two_sided,
        reversed: shader.cull == Cull::Back,
        vertex_color: None,
        vertex_alpha: None,
        lightmapped,
        dielectric: None,
        reflection: if class.class == SurfaceClass::Mirror {
            Reflection::mirror()
        } else if class.environment {
            Reflection::usual(SHINY)
        } else {
            Reflection::DIFFUSE
        },
        lost: Vec::new(),
    };
    report_losses(shader, &mut look.lost);
    if !material.baked.styles.is_empty() {
        let styles = material.baked.styles.len();
        look.lost.push(format!(
            "baked light of {styles} light styles; the light of style 0 alone is shown"
        ));
    }
    let base = match class.class {
        SurfaceClass::CutOut => cut_out_stage(shader).or_else(|| base_stage(shader)),
        _ => base_stage(shader),
    };
    let Some((base, stage)) = base.and_then(|i| Some((i, shader.stages.get(i)?))) else {
        bare(shader, vertex_light, moment, &mut look);
        look.vertex_alpha = shader.stages.iter().find_map(VertexAlpha::weighing);
        return look;
    };
    let group = group_of(shader, base, stage, &mut look.lost);
    colors_of_vertices(shader, &group, &mut look);
    let slot = |picture: Picture, stage: &Stage| Slot {
        picture,
        clamp: matches!(stage.image, StageImage::ClampMap(_)),
        tc_mods: stage.tc_mods.clone(),
    };
    // A stage may have no image file.
    let name = stage.image.names().first().cloned().unwrap_or_default();
    let images = |group: &[usize]| {
        let has = |i: &&usize| {
            shader
                .stages
                .get(**i)
                .is_some_and(|s| !s.image.names().is_empty())
        };
        group.iter().filter(has).count()
    };
    let kept = stack::without_reflections(shader, &group);
    let drawn = stack::mean_of(&kept, vertex_light, moment, mean);
    let color = stack::color_of(stage, moment);
    if class.additive && group.len() == 1 {
        look.alpha = Alpha::Blend;
        look.factor = Vec4::new(0.0, 0.0, 0.0, 1.0);
        look.color = Some(slot(Picture::Edited(name, Edit::FromBrightness), stage));
        look.glow = look.color.clone();
        look.glow_factor = color.truncate();
        look.lost
            .push("adds light to what is behind it; said by transparency".to_owned());
    } else if class.filter && group.len() == 1 {
        look.alpha = Alpha::Blend;
        look.color = Some(slot(Picture::Edited(name, Edit::FromDarkness), stage));
        look.lost
            .push("multiplies what is behind it; said by transparency".to_owned());
    } else if images(&group) == 1 && plain_blend(stage).is_some() {
        let (alpha, edit) = plain_blend(stage).unwrap_or((Alpha::Opaque, None));
        look.alpha = if class.class == SurfaceClass::Opaque {
            Alpha::Opaque
        } else {
            alpha
        };
        let picture = match edit {
            Some(edit) => Picture::Edited(name, edit),
            None => Picture::File(name),
        };
        look.color = Some(slot(picture, stage));
        // What the stack makes of one image is that image times something.
        let alpha = color.w;
        let through = if look.alpha == Alpha::Blend {
            (1.0 - drawn.through.element_sum() / 3.0).max(1.0e-3)
        } else {
            1.0
        };
        let texture = look
            .color
            .as_ref()
            .and_then(|_| mean(stage.image.names().first()?))
            .unwrap_or(Vec4::ONE)
            .truncate()
            .max(Vec3::splat(1.0e-4));
        let part = |part: Vec3| (part / through / texture).clamp(Vec3::ZERO, Vec3::ONE);
        look.factor = part(drawn.lit).extend(alpha);
        look.glow_factor = part(drawn.emission);
        if look.glow_factor.max_element() > 1.0e-3 {
            look.glow = look.color.clone();
        }
    } else {
        look.alpha = match class.class {
            SurfaceClass::Opaque => Alpha::Opaque,
            SurfaceClass::CutOut => Alpha::Mask(0.5),
            _ => Alpha::Blend,
        };
        let baked = |part| Picture::Baked {
            name: material.name.to_ascii_lowercase(),
            stages: group.clone(),
            part,
        };
        if class.class == SurfaceClass::CutOut
            && let Some((alpha, _)) = plain_blend(stage)
        {
            look.alpha = alpha;
        }
        if drawn.lit.max_element() > 1.0e-3 {
            look.color = Some(slot(baked(Part::Color), stage));
        } else {
            look.color = Some(slot(baked(Part::Glow), stage));
            look.factor = Vec4::new(0.0, 0.0, 0.0, 1.0);
        }
        if drawn.emission.max_element() > 1.0e-3 {
            look.glow = Some(slot(baked(Part::Glow), stage));
            let usual = stack::mean_of(&kept, vertex_light, Moment::Mean, mean).emission;
            look.glow_factor = ratio(drawn.emission, usual);
        }
    }
    if look.glow.is_none() {
        add_moving_glow(shader, vertex_light, &group, moment, &mut look);
    }
    if clear {
        dielectric(shader, &drawn, &mut look);
    }
    look
}

/// The stages that lie on the surface as the base stage does; the treatment of the others is reported in `lost`.
fn group_of(shader: &Shader, base: usize, stage: &Stage, lost: &mut Vec<String>) -> Vec<usize> {
    let mut group = Vec::new();
    let drawn = |(_, s): &(usize, &Stage)| !draws_nothing(s);
    for (i, other) in shader.stages.iter().enumerate().filter(drawn) {
        let by_vertex = VertexAlpha::weighing(other).is_some();
        let alike = i == base
            || other.is_lightmap()
            || (other.image == StageImage::White && !by_vertex)
            || (tiling(other, &stage.tc_mods).is_some()
                && !by_vertex
                && other.image.names().len() <= 1);
        if alike {
            group.push(i);
        } else if other.tc_gen == TcGen::Environment {
            lost.push(format!("stage {i}: {SURROUNDINGS}"));
        } else if by_vertex {
            lost.push(format!("stage {i}: weighted by vertex alpha; left out"));
        } else {
            lost.push(format!("stage {i}: lies on the surface in another way"));
        }
    }
    group
}

/// A material without an image of its own: one colour.
fn bare(shader: &Shader, vertex_light: bool, moment: Moment, look: &mut Look) {
    let all: Vec<usize> = (0..shader.stages.len()).collect();
    let stages = stack::without_reflections(shader, &all);
    let drawn = stack::mean_of(&stages, vertex_light, moment, &mut |_| None);
    look.factor = drawn.lit.clamp(Vec3::ZERO, Vec3::ONE).extend(1.0);
    look.glow_factor = drawn.emission.clamp(Vec3::ZERO, Vec3::ONE);
    let through = drawn.through.element_sum() / 3.0;
    if through > 1.0e-3 {
        look.alpha = Alpha::Blend;
        look.factor.w = (1.0 - through).clamp(0.0, 1.0);
    }
}

/// How often `usual` goes into `now`; once where there is none.
pub fn ratio(now: Vec3, usual: Vec3) -> Vec3 {
    let part = now / usual;
    let known = usual.cmpgt(Vec3::splat(1.0e-4)) & part.is_finite_mask();
    Vec3::select(known, part, Vec3::ONE)
}

/// How a stage by itself hides what is behind it, and the change of its alpha that this needs; `None` if only
/// its whole stack determines that.
fn plain_blend(stage: &Stage) -> Option<(Alpha, Option<Edit>)> {
    use BlendFactor::{DstColor, OneMinusSrcAlpha, SrcAlpha, SrcColor, Zero};
    match (stage.alpha_func, stage.blend) {
        (Some(AlphaFunc::Ge128), _) => Some((Alpha::Mask(0.5), None)),
        (Some(AlphaFunc::Gt0), _) => Some((Alpha::Mask(1.0 / 255.0), None)),
        (Some(AlphaFunc::Lt128), _) => Some((Alpha::Mask(0.5), Some(Edit::Inverted))),
        // an image that multiplies a lightmap under it
        (None, None | Some((DstColor, Zero) | (Zero, SrcColor))) => Some((Alpha::Opaque, None)),
        (None, Some((SrcAlpha, OneMinusSrcAlpha))) => Some((Alpha::Blend, None)),
        (None, Some((OneMinusSrcAlpha, SrcAlpha))) => Some((Alpha::Blend, Some(Edit::Inverted))),
        _ => None,
    }
}

/// Whether and how colours of vertices multiply the group.
fn colors_of_vertices(shader: &Shader, group: &[usize], look: &mut Look) {
    let stages = || group.iter().filter_map(|&i| shader.stages.get(i));
    let from_vertex = |s: &Stage| {
        matches!(
            s.rgb_gen,
            RgbGen::Vertex | RgbGen::ExactVertex | RgbGen::OneMinusVertex
        )
    };
    if stages().any(from_vertex) {
        look.vertex_color = Some(if look.lightmapped {
            VertexColor::Paint
        } else {
            VertexColor::Light
        });
    }
    if stages().any(|s| matches!(s.rgb_gen, RgbGen::OneMinusVertex)) {
        look.vertex_color = None;
        look.lost
            .push("is lit by the reverse of vertex colours".to_owned());
    }
    look.vertex_alpha = stages().find_map(VertexAlpha::weighing);
}

/// Of what moves against the colour, or lies on it in another way, the first stage that adds light becomes the glow.
fn add_moving_glow(
    shader: &Shader,
    vertex_light: bool,
    group: &[usize],
    moment: Moment,
    look: &mut Look,
) {
    if look.alpha != Alpha::Opaque {
        return;
    }
    // What is added under a lightmap is lit.
    let glowing = glow_stages(shader, vertex_light);
    let found = shader.stages.iter().enumerate().find(|(i, stage)| {
        !group.contains(i)
            && glowing.contains(i)
            && stage.tc_gen == TcGen::Base
            && matches!(
                stage.blend,
                Some((BlendFactor::One | BlendFactor::SrcAlpha, BlendFactor::One))
            )
            && !stage.image.names().is_empty()
    });
    if let Some((i, stage)) = found
        && let Some(name) = stage.image.names().first()
    {
        look.glow = Some(Slot {
            picture: Picture::File(name.clone()),
            clamp: matches!(stage.image, StageImage::ClampMap(_)),
            tc_mods: stage.tc_mods.clone(),
        });
        look.glow_factor = stack::color_of(stage, moment).truncate();
        let prefix = format!("stage {i}: ");
        look.lost.retain(|l| !l.starts_with(&prefix));
    }
}

/// What glass and liquids do to light.
fn dielectric(shader: &Shader, drawn: &LightLinear, look: &mut Look) {
    let Some(index) = refraction_index(shader) else {
        return; // neither glass nor a liquid
    };
    let transmission = drawn.through.max_element().clamp(0.0, 1.0);
    if transmission < LEAST_SLIME_TRANSMISSION && shader.content_flags & CONTENTS_SLIME != 0 {
        return;
    }
    let liquid = crate::materials::light::classify(shader).liquid;
    let color = drawn.lit + drawn.emission + drawn.through;
    look.dielectric = Some(Dielectric {
        index,
        transmission,
        liquid: (liquid && shader.content_flags & CONTENTS_FOG == 0 && color.is_finite())
            .then(|| (liquid_color(color), LIQUID_DEPTH)),
    });
    look.alpha = Alpha::Opaque;
    look.reflection = Reflection::usual(0.0);
    // The surface of a volume has an inside and an outside; its back is the way out.
    if look.dielectric.is_some_and(|d| d.liquid.is_some()) {
        look.two_sided = false;
    }
    // What it shows of its own is seen with what it does not let pass.
    look.glow_factor *= 1.0 - transmission;
    look.factor = look.factor.max(Vec4::new(0.0, 0.0, 0.0, 1.0));
    if look.factor.truncate().max_element() < 1.0e-3 {
        look.factor = Vec4::ONE;
    }
}

/// `st * matrix + translate`: what changes of texture coordinates come to at a time, wobbles left out.
/// `matrix[i]` is where coordinate i goes.
pub fn affine(tc_mods: &[TcMod], time: f64) -> ([Vec2; 2], Vec2) {
    let still: Vec<TcMod> = tc_mods
        .iter()
        .filter(|m| !matches!(m, TcMod::Turbulent { .. } | TcMod::EntityTranslate))
        .cloned()
        .collect();
    let at = |st: Vec2| eval::apply_tc_mods(&still, st, Vec3::ZERO, time, Vec2::ZERO);
    let origin = at(Vec2::ZERO);
    ([at(Vec2::X) - origin, at(Vec2::Y) - origin], origin)
}
