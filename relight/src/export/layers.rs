//! Stages weighted by vertex alpha (terrain), as layers of their own over the rest of their material.
//!
//! No format here has a material that mixes two pictures by a weight of the vertices. Each such stage becomes a material
//! of its own for further triangles, which lie [`LIFT`] above those of the layer below.
//!
//! What later stages make of a colour x is c + k x, and that of a mixture is the mixture of what they make of its parts:
//! so every layer has the later stages that are not weighed, light among them.

use super::Export;
use super::geometry::Part;
use super::look::{Alpha, Look, Picture, VertexAlpha};
use crate::materials::light::classify;
use crate::world::{WorldMaterial, WorldVertex};
use shaderscript::{AlphaFunc, AlphaGen, BlendFactor, Shader, Stage, StageImage, TcGen};
use std::borrow::Cow;
use support::slice;

/// Distance between layers along the normals of vertices, id units.
pub const LIFT: f32 = 0.125;

/// How a stage is combined with what is below it, weighted by vertex alpha.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Weight {
    /// It covers what is below by its alpha.
    Mixed,
    /// It covers what is below by what its alpha leaves of 1.
    Inverse,
    /// It covers what is below where its alpha is large, or above 0.
    Cut,
    /// It covers what is below where its alpha is small.
    InverseCut,
    /// It is added by its alpha.
    Added,
}

impl Weight {
    fn is_inverse(self) -> bool {
        matches!(self, Weight::Inverse | Weight::InverseCut)
    }
}

/// A part of a material that is drawn as a material of its own.
#[derive(Debug, Clone)]
pub struct Layer<'a> {
    /// The material.
    pub whole: &'a WorldMaterial,
    /// With the stages of this layer; the others draw nothing. Numbers of stages are those of the whole material.
    pub material: Cow<'a, WorldMaterial>,
    /// The stage weighted by vertex alpha, and how; `None` for the lowest layer.
    weighed: Option<(usize, Weight)>,
}

/// The layers of a material, from below. Most have one, which is the material.
pub fn layers(material: &WorldMaterial) -> Vec<Layer<'_>> {
    let stages = &material.resolved.shader.stages;
    let covers = |s: &Stage| s.blend.is_none() && s.alpha_func.is_none();
    let body = stages.iter().rposition(covers).unwrap_or(0);
    let above = stages.iter().enumerate().skip(body + 1);
    let weighed: Vec<(usize, Weight)> = above
        .filter_map(|(i, stage)| Some((i, weight(stage)?)))
        .collect();
    if weighed.is_empty() {
        return vec![Layer::only(material)];
    }
    let is_weighed = |i: usize| weighed.iter().any(|&(other, _)| other == i);
    let lowest = with_stages(material, &material.name, &|i, stage| {
        (!is_weighed(i)).then(|| stage.clone())
    });
    let mut layers = vec![Layer {
        whole: material,
        material: Cow::Owned(lowest),
        weighed: None,
    }];
    for &(number, how) in &weighed {
        let name = format!("{}.layer{}", material.name, layers.len());
        let mut upper = with_stages(material, &name, &|i, stage| match how {
            _ if i == number => Some(bodily(stage, how)),
            Weight::Added => None,
            _ => (i > number && !is_weighed(i)).then(|| stage.clone()),
        });
        // What it covers may be a liquid; a cover refracts nothing.
        upper.resolved.shader.content_flags = 0;
        upper.class = classify(&upper.resolved.shader);
        layers.push(Layer {
            whole: material,
            material: Cow::Owned(upper),
            weighed: Some((number, how)),
        });
    }
    layers
}

/// How vertex alpha weights a stage; `None` where it does not, or where no layer can express it.
fn weight(stage: &Stage) -> Option<Weight> {
    use BlendFactor::{One, OneMinusSrcAlpha, SrcAlpha};
    VertexAlpha::weighing(stage)?;
    if matches!(stage.image, StageImage::Video(_)) || stage.tc_gen != TcGen::Base {
        return None;
    }
    match (stage.alpha_func, stage.blend) {
        (Some(AlphaFunc::Gt0) | None, Some((SrcAlpha, OneMinusSrcAlpha))) => Some(Weight::Mixed),
        (None, Some((OneMinusSrcAlpha, SrcAlpha))) => Some(Weight::Inverse),
        (Some(AlphaFunc::Gt0) | None, Some((SrcAlpha, One))) => Some(Weight::Added),
        (Some(test), None | Some((SrcAlpha, OneMinusSrcAlpha))) => Some(match test {
            AlphaFunc::Lt128 => Weight::InverseCut,
            AlphaFunc::Ge128 | AlphaFunc::Gt0 => Weight::Cut,
        }),
        _ => None,
    }
}

/// A weighed stage as the body of its layer: its image's alpha stays to be seen, what is below does not.
fn bodily(stage: &Stage, how: Weight) -> Stage {
    let mut body = stage.clone();
    if how == Weight::Added {
        return body;
    }
    body.blend = None;
    body.depth_write = true;
    body.alpha_func = Some(match stage.alpha_func {
        Some(AlphaFunc::Lt128 | AlphaFunc::Ge128) => AlphaFunc::Ge128,
        Some(AlphaFunc::Gt0) | None => AlphaFunc::Gt0,
    });
    // What an opaque image's alpha leaves is what that of the vertices leaves.
    if how.is_inverse() {
        body.alpha_gen = match stage.alpha_gen {
            AlphaGen::Vertex => AlphaGen::OneMinusVertex,
            _ => AlphaGen::Vertex,
        };
    }
    body
}

/// A material of another name with the stages that `keep` gives; where it gives none, a stage draws nothing.
fn with_stages(
    material: &WorldMaterial,
    name: &str,
    keep: &dyn Fn(usize, &Stage) -> Option<Stage>,
) -> WorldMaterial {
    let nothing = || Stage {
        blend: Some((BlendFactor::Zero, BlendFactor::One)),
        depth_write: false,
        ..Stage::default()
    };
    let shader = &material.resolved.shader;
    let stages = shader.stages.iter().enumerate();
    let stages = stages.map(|(i, stage)| keep(i, stage).unwrap_or_else(nothing));
    let mut out = material.clone();
    out.name = name.to_owned();
    out.resolved.shader = Shader {
        stages: stages.collect(),
        ..shader.clone()
    };
    out
}

/// Whether a stage leaves what is below as it is.
pub fn draws_nothing(stage: &Stage) -> bool {
    stage.blend == Some((BlendFactor::Zero, BlendFactor::One))
}

impl<'a> Layer<'a> {
    /// A material as its own only layer.
    pub fn only(material: &'a WorldMaterial) -> Layer<'a> {
        Layer {
            whole: material,
            material: Cow::Borrowed(material),
            weighed: None,
        }
    }

    /// The stage weighted by vertex alpha; `None` for the lowest layer.
    pub fn stage(&self) -> Option<usize> {
        self.weighed.map(|(stage, _)| stage)
    }

    /// Makes the look of the layer's material one weighted by vertex alpha, if the layer is.
    pub fn weigh(&self, source: &Export<'_>, look: &mut Look) {
        let Some((number, how)) = self.weighed else {
            return;
        };
        let stages = &self.material.resolved.shader.stages;
        let Some(stage) = slice::get(stages, number) else {
            return;
        };
        look.vertex_alpha = VertexAlpha::weighing(stage);
        let image = stage.image.names().first();
        let mean = image.and_then(|name| source.mean(&self.material, &Picture::File(name.clone())));
        let opaque = mean.is_none_or(|mean| mean.w > 0.999);
        if matches!(how, Weight::Mixed | Weight::Inverse) {
            look.alpha = Alpha::Blend;
        }
        let two_sided = look.two_sided;
        let mut report = |what: &str| look.lost.push(format!("stage {number}: {what}"));
        if how.is_inverse() && !opaque {
            report("covers what its alpha leaves; said for its image's alpha as it is");
        }
        if two_sided {
            report("covers both sides; it is on the front alone");
        }
    }

    /// The triangles of a part that are `seen` of the layer at a height, counted from 0, with the vertices that theirs were.
    pub fn raise(
        &self,
        part: &Part,
        height: usize,
        look: &Look,
        seen: &dyn Fn([WorldVertex; 3]) -> bool,
    ) -> (Part, Vec<usize>) {
        let front = if look.reversed { -1.0 } else { 1.0 };
        part.lifted(LIFT * height as f32 * front, seen)
    }

    /// How much of a vertex's place the layer covers, where its image is opaque: 0..1.
    pub fn cover(&self, vertex: &WorldVertex) -> f32 {
        let stage = self
            .stage()
            .and_then(|i| self.material.resolved.shader.stages.get(i));
        let weight = stage.and_then(VertexAlpha::weighing);
        weight.map_or(1.0, |of| f32::from(of.weight(vertex.color[3])) / 255.0)
    }
}
