//! Draw states of the registered materials. Their pipelines are created and used once while the game loads, not when a
//! surface first becomes visible: Mesa's software driver compiles shaders for blending, formats and samplers only in
//! the first draw that combines them. States that are not predicted here (mirrors, fog over blended stages, debugging
//! aids) are created at first use.

use glam::{Vec2, Vec3};
use shaders::types::constants as c;
use shaders::types::{Draw, Instance, Vertex};

use super::depth_first;
use super::groups::{fog_state, light_state, pixel_light_source};
use super::list::{Call, DepthRange, DrawList, faces, sky_state, stage_depth};
use super::overlay::overlay_instance;
use super::passes;
use super::pipelines::{CullFaces, State};
use super::shading::{Shading, StageContext};
use crate::assets::compile::sampler;
use crate::assets::{LightmapClass, Material, RasterPass};
use shaderscript::sort;

/// Facts about a map before its first view.
#[derive(Clone, Copy, Debug)]
pub struct ExpectedWorld {
    /// Texture of any of its lightmap pages, or `NO_TEXTURE`.
    pub lightmap: u32,
    /// The map has fog volumes.
    pub fog: bool,
}

impl DrawList {
    /// Adds a call for each state of the registered materials in views and in the overlay: two triangles of opposite
    /// winding that cover the viewport at the far end of the depth range.
    pub fn add_expected(&mut self, stages: StageContext<'_>, world: ExpectedWorld) {
        let first_vertex = self.vertices.len() as u32;
        for (x, y) in [(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)] {
            self.vertices.push(Vertex {
                position: Vec3::new(x, y, 1.0),
                normal: Vec3::Z,
                st: Vec2::ZERO,
                lightmap: Vec2::ZERO,
                color: u32::MAX,
            });
        }
        let first_index = self.indices.len() as u32;
        let corners = [0, 1, 2, 0, 2, 1].map(|corner| first_vertex + corner);
        self.indices.extend(corners);
        let mut found = |state: State, draw: Draw| {
            let index = self.draws.len() as u32;
            self.draws.push(Draw {
                dynamic_vertices: 1,
                ..draw
            });
            self.calls.push(Call {
                state,
                range: DepthRange::Normal,
                first_index,
                index_count: corners.len() as u32,
                draw: index,
            });
        };
        for material in stages.materials.iter().filter(|m| !m.defaulted) {
            if material.sky.is_some() {
                sky(&stages, material, &mut found);
            } else {
                surfaces(&stages, material, world, &mut found);
            }
        }
        if stages.pixel_lights.is_none() {
            spots(&stages, &mut found);
        }
    }
}

/// Calls `found` with each draw of a material's surfaces, and of its pictures if the overlay uses it.
fn surfaces(
    stages: &StageContext<'_>,
    material: &Material,
    world: ExpectedWorld,
    mut found: impl FnMut(State, Draw),
) {
    let flat = material.lightmap_class == LightmapClass::TwoD;
    let lightmap = match material.lightmap_class {
        LightmapClass::Page => world.lightmap,
        _ => c::NO_TEXTURE,
    };
    let drawn = |passes: &[RasterPass]| {
        let first = passes.first()?;
        let (shading, draw) = shaded(stages, material, passes, lightmap);
        let state = State {
            blend: first.blend,
            depth: stage_depth(first),
            depth_write: first.depth_write,
            offset: material.polygon_offset,
            shading,
            ..State::plain(faces(material.shader.cull, false))
        };
        Some((state, draw))
    };
    for passes in passes::draws(&material.passes, false) {
        // views use pictures of the overlay as sprites and marks, if no script defines the material
        if flat && passes.iter().any(|pass| !pass.depth_test) {
            continue;
        }
        if let Some((in_view, draw)) = drawn(passes) {
            found(in_view, draw);
            if depth_first::covers(material) {
                found(depth_first::depth_alone(in_view.cull), draw);
            }
            if world.fog && !flat && material.sort <= sort::OPAQUE {
                let (shading, draw) = stages.fog(Draw {
                    fog: 1,
                    ..Draw::default()
                });
                found(fog_state(in_view, true, shading), draw);
            }
        }
    }
    let reflecting = material
        .light_stage
        .filter(|_| material.lightmap_class == LightmapClass::Page);
    if let (Some(stage), Some(_)) = (reflecting, stages.pixel_lights) {
        let instance = expected_instance();
        let (shading, draw) =
            stages.pixel_light(material, stage, &instance, lightmap, Draw::default());
        let plain = State {
            offset: material.polygon_offset,
            ..State::plain(faces(material.shader.cull, false))
        };
        found(
            light_state(plain, pixel_light_source(material), shading),
            draw,
        );
    }
    for pass in material.passes.iter().filter(|_| flat) {
        if let Some((state, draw)) = drawn(std::slice::from_ref(pass)) {
            let state = State {
                depth_write: pass.depth_write && pass.depth_test,
                cull: CullFaces::None,
                offset: false,
                ..state
            };
            found(state, draw);
        }
    }
}

/// Calls `found` with each draw of a sky.
fn sky(stages: &StageContext<'_>, material: &Material, mut found: impl FnMut(State, Draw)) {
    let faces = material.sky.as_ref().and_then(|sky| sky.faces.as_ref());
    if let Some(&image) = faces.and_then(|images| images.first()) {
        let (shading, draw) = stages.plain_image(image, sampler::CLAMP_MIP, Draw::default());
        found(sky_state(None, false, CullFaces::None, shading), draw);
    }
    for passes in passes::draws(&material.passes, false) {
        if let Some(first) = passes.first() {
            let (shading, draw) = shaded(stages, material, passes, c::NO_TEXTURE);
            let state = sky_state(first.blend, first.depth_write, CullFaces::None, shading);
            found(state, draw);
        }
    }
}

/// Calls `found` with each draw of the spots of dynamic lights on walls.
fn spots(stages: &StageContext<'_>, mut found: impl FnMut(State, Draw)) {
    let (shading, draw) = stages.light(Draw::default());
    let plain = State::plain(CullFaces::CounterClockwise);
    for source in [c::BLEND_DST_COLOR, c::BLEND_ONE] {
        found(light_state(plain, source, shading), draw);
    }
}

fn shaded(
    stages: &StageContext<'_>,
    material: &Material,
    passes: &[RasterPass],
    lightmap: u32,
) -> (Shading, Draw) {
    let (fog, instance) = (c::FOG_ADJUST_NONE, expected_instance());
    stages.passes(material, passes, &instance, lightmap, fog, Draw::default())
}

/// The instance of all expected calls.
pub fn expected_instance() -> Instance {
    overlay_instance(0.0)
}
