//! The states that registered materials will be drawn with, so that pipelines are made while the game loads and not
//! when a surface first comes into sight. What is not foreseen here (mirrors, fog, debugging aids) is made when used.

use shaders::types::constants as c;
use shaders::types::{Draw, Instance};

use super::depth_first;
use super::list::{faces, stage_depth};
use super::pipelines::{CullFaces, State};
use super::shading::{Shading, StageContext};
use crate::assets::{LightmapClass, Material};

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
    for pass in &material.passes {
        let (shading, _) = stages.pass(
            material,
            pass,
            &Instance::default(),
            lightmap,
            c::FOG_ADJUST_NONE,
            Draw::default(),
        );
        let in_view = State {
            blend: pass.blend,
            depth: stage_depth(pass),
            depth_write: pass.depth_write,
            cull: faces(material.shader.cull, false),
            offset: material.polygon_offset,
            wireframe: false,
            shading,
        };
        // pictures of the overlay are sprites and marks in views, too, unless no script says how
        if !flat || pass.depth_test {
            found(in_view);
            if depth_first::covers(material) {
                found(depth_first::depth_alone(in_view.cull));
            }
        }
        if flat {
            found(State {
                depth_write: pass.depth_write && pass.depth_test,
                cull: CullFaces::None,
                offset: false,
                ..in_view
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
