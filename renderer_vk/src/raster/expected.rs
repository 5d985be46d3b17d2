//! The states that registered materials will be drawn with, so that pipelines are made while the game loads and not
//! when a surface first comes into sight. What is not foreseen here (mirrors, fog, debugging aids) is made when used.

use shaders::types::constants as c;
use shaders::types::{Draw, Instance};

use super::depth_first;
use super::list::{faces, stage_depth};
use super::passes;
use super::pipelines::{CullFaces, State};
use super::shading::{Shading, StageContext};
use crate::assets::{LightmapClass, Material, RasterPass};

/// Calls `found` with each state that `material` is drawn with in a view or in the overlay.
pub fn states(stages: &StageContext<'_>, material: &Material, mut found: impl FnMut(State)) {
    if material.sky.is_some() || material.defaulted {
        return;
    }
    let flat = material.lightmap_class == LightmapClass::TwoD;
    // any page does: which one it is makes no difference to a pipeline
    let lightmap = match material.lightmap_class {
        LightmapClass::Page => 0,
        _ => c::NO_TEXTURE,
    };
    let state = |passes: &[RasterPass]| {
        let first = passes.first()?;
        let (shading, _) = stages.passes(
            material,
            passes,
            &Instance::default(),
            lightmap,
            c::FOG_ADJUST_NONE,
            Draw::default(),
        );
        Some(State {
            blend: first.blend,
            depth: stage_depth(first),
            depth_write: first.depth_write,
            cull: faces(material.shader.cull, false),
            offset: material.polygon_offset,
            wireframe: false,
            shading,
        })
    };
    for passes in passes::draws(&material.passes, false) {
        // pictures of the overlay are sprites and marks in views, too, unless no script says how
        if flat && passes.iter().any(|pass| !pass.depth_test) {
            continue;
        }
        if let Some(in_view) = state(passes) {
            found(in_view);
            if depth_first::covers(material) {
                found(depth_first::depth_alone(in_view.cull));
            }
        }
    }
    for pass in material.passes.iter().filter(|_| flat) {
        if let Some(state) = state(std::slice::from_ref(pass)) {
            found(State {
                depth_write: pass.depth_write && pass.depth_test,
                cull: CullFaces::None,
                offset: false,
                ..state
            });
        }
    }
}

/// Calls `found` with the states of dynamic lights on walls.
pub fn light_states(mut found: impl FnMut(State)) {
    for source in [c::BLEND_DST_COLOR, c::BLEND_ONE] {
        found(State {
            blend: Some((source, c::BLEND_ONE)),
            depth: super::pipelines::Depth::Equal,
            depth_write: false,
            cull: CullFaces::CounterClockwise,
            offset: false,
            wireframe: false,
            shading: Shading::LIGHT,
        });
    }
}
