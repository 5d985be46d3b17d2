//! The draw calls of a view: its surfaces ([`super::groups`]), and its skies between the opaque and the other ones.

use shaders::types::constants as c;
use shaders::types::{Draw, Instance, Vertex};

use super::aids::Aids;
use super::depth_first::Occluder;
use super::groups::{Group, GroupContext, fog_state, fogged};
use super::passes;
use super::pipelines::{CullFaces, Depth, State};
use super::shading::{Shading, StageContext};
use super::sky;
use crate::api::DynamicLight;
use crate::assets::compile::sampler;
use crate::assets::{Material, Materials, RasterPass};
use crate::scene::{ClassicScene, SKY_FACES, Sun, VisibleSky};
use shaderscript::{Cull, sort};
use support::slice;

/// The depth range of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthRange {
    /// The whole range.
    Normal,
    /// The nearest third, so that a first-person weapon does not intersect walls. In stereo its pictures coincide at
    /// the near plane.
    Near,
    /// The nearest third, with the view's own projection in stereo.
    Crosshair,
    /// The far end, for skies.
    Sky,
    /// The near end, for debugging lines over everything.
    Front,
}

/// One draw call.
#[derive(Clone, Copy, Debug)]
pub struct Call {
    /// Pipeline state.
    pub state: State,
    /// Depth range.
    pub range: DepthRange,
    /// First index in [`DrawList::indices`].
    pub first_index: u32,
    /// Number of indices.
    pub index_count: u32,
    /// Index of its parameters in [`DrawList::draws`].
    pub draw: u32,
}

/// The world's vertex and index arrays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statics<'a> {
    /// Vertices.
    pub vertices: &'a [Vertex],
    /// Indices.
    pub indices: &'a [u32],
}

/// Triangles of a sky or of the sun, with the parameters of all their stages.
#[derive(Clone, Copy)]
struct SkyPart<'a> {
    /// Material of the sky or of the sun.
    material: &'a Material,
    /// The world's instance, whose time the stages use.
    world: &'a Instance,
    /// Culled faces.
    cull: CullFaces,
    /// First index in [`DrawList::indices`], and number of indices.
    span: (u32, u32),
    /// Parameters that do not depend on the stage.
    draw: Draw,
}

/// The draw calls of a view and their arrays. Kept between frames to reuse the allocations.
#[derive(Default)]
pub struct DrawList {
    /// Calls in drawing order.
    pub calls: Vec<Call>,
    /// Parameters of each call.
    pub draws: Vec<Draw>,
    /// Indices of all calls into the static or the dynamic vertices.
    pub indices: Vec<u32>,
    /// Moving vertices: those of the view, then those of the sky.
    pub vertices: Vec<Vertex>,
    /// See [`super::depth_first`].
    pub(super) depth_first: Vec<Call>,
    /// Draws depth of curves first, too; see [`super::depth_first`].
    pub(super) curves_hide: bool,
    /// See [`super::depth_first`].
    pub(super) occluders: Vec<Occluder>,
    /// Groups of the current material; see [`super::groups`].
    pub(super) groups: Vec<Group>,
    /// Deferred calls of dynamic lights.
    pub(super) lights: Vec<Call>,
    /// Deferred calls of fog, drawn after the lights.
    pub(super) fog: Vec<Call>,
    /// Deferred calls of lights that are evaluated per pixel, drawn before the first translucent surface.
    pub(super) pixel_lights: Vec<Call>,
}

impl DrawList {
    /// An empty list. `curves_hide`: draws depth of curves first, for devices with fast vertex processing.
    pub fn new(curves_hide: bool) -> Self {
        Self {
            curves_hide,
            ..Self::default()
        }
    }

    /// Empties the list.
    pub fn clear(&mut self) {
        self.calls.clear();
        self.draws.clear();
        self.indices.clear();
        self.vertices.clear();
        self.depth_first.clear();
        self.occluders.clear();
    }

    /// Adds everything in a view.
    pub fn add_view(
        &mut self,
        scene: &ClassicScene,
        stages: StageContext<'_>,
        statics: Statics<'_>,
        aids: Aids,
    ) {
        let materials = stages.materials;
        self.vertices.extend_from_slice(&scene.vertices);
        let (before_sky, rest) = scene.look.surfaces.split_at(
            scene
                .look
                .surfaces
                .partition_point(|s| materials.get(s.material).sort < sort::SKY),
        );
        let context = GroupContext {
            surfaces: before_sky,
            scene,
            stages,
            statics,
            aids,
        };
        self.add_surfaces(&context);
        for sky in &scene.look.skies {
            self.add_sky(sky, scene, stages, aids);
        }
        let fog = rest.partition_point(|s| materials.get(s.material).sort < sort::FOG);
        let (solid, translucent) = rest.split_at(fog);
        self.add_surfaces(&GroupContext {
            surfaces: solid,
            ..context
        });
        self.calls.append(&mut self.pixel_lights);
        self.add_surfaces(&GroupContext {
            surfaces: translucent,
            ..context
        });
        if let Some(sun) = scene.sun.filter(|_| !scene.look.skies.is_empty()) {
            self.add_sun(&sun, scene, stages, aids);
        }
        self.push_debug_polygons(&scene.look.debug);
        let clip = scene.view.clip_plane.is_some();
        if clip {
            self.occluders.clear();
        }
        self.put_depth_first(statics.indices);
        self.occluders.clear();
        for call in &mut self.calls {
            call.state.shading.clip = clip;
        }
    }

    fn add_sky(
        &mut self,
        visible: &VisibleSky,
        scene: &ClassicScene,
        stages: StageContext<'_>,
        aids: Aids,
    ) {
        let material = stages.materials.get(visible.material);
        // The material may be remapped to one that is no sky.
        let (Some(sky), Some(world)) = (&material.sky, slice::get(&scene.instances, 0)) else {
            return;
        };
        if aids.leaves_out(material.sort) {
            return;
        }
        let view = &scene.view;
        let grey = (stages.identity_light.clamp(0.0, 1.0) * 255.0) as u32;
        let color = 0xFF00_0000 | grey << 16 | grey << 8 | grey;
        let draw = Draw {
            dynamic_vertices: 1,
            ..Draw::default()
        };
        if let Some(images) = &sky.faces {
            for (face, &image) in images.iter().enumerate() {
                let Some(cells) = visible.coverage.cells(face) else {
                    continue; // hidden
                };
                let span = self
                    .mesh()
                    .append_face(face, cells, view, color, sky::Coordinates::Box);
                let (shading, draw) = stages.plain_image(image, sampler::CLAMP_MIP, draw);
                let state = sky_state(None, false, CullFaces::None, shading);
                self.push(state, aids.sky_range(), span, draw);
            }
        }
        if material.passes.is_empty() {
            return;
        }
        let first_index = self.indices.len() as u32;
        // all skies share one dome, without clouds below the horizon
        let clouds = sky::Coordinates::Clouds(stages.materials.cloud_height());
        for face in 0..SKY_FACES - 1 {
            if let Some(cells) = visible.coverage.cells(face) {
                self.mesh().append_face(face, cells, view, color, clouds);
            }
        }
        let span = (first_index, self.indices.len() as u32 - first_index);
        if span.1 > 0 {
            // the box has no fog
            let fog = visible.fog;
            let draw = Draw { fog, ..draw };
            let part = SkyPart {
                material,
                world,
                cull: CullFaces::None,
                span,
                draw,
            };
            self.add_sky_passes(part, stages, aids);
            if let Some(opaque) = fogged(material, fog) {
                let (shading, draw) = stages.fog(draw);
                let clouds = sky_state(None, false, CullFaces::None, shading);
                self.push(
                    fog_state(clouds, opaque, shading),
                    aids.sky_range(),
                    span,
                    draw,
                );
            }
            if aids.edges {
                self.push_edges(span, draw, CullFaces::None);
            }
        }
    }

    /// Adds the sun's disc, in front of the sky and behind everything else.
    fn add_sun(&mut self, sun: &Sun, scene: &ClassicScene, stages: StageContext<'_>, aids: Aids) {
        let material = stages.materials.get(sun.material);
        let Some(world) = slice::get(&scene.instances, 0) else {
            return;
        };
        let span = self.mesh().append_sun(sun.direction, &scene.view);
        let draw = Draw {
            dynamic_vertices: 1,
            ..Draw::default()
        };
        let cull = faces(material.shader.cull, scene.view.mirrored);
        let part = SkyPart {
            material,
            world,
            cull,
            span,
            draw,
        };
        self.add_sky_passes(part, stages, aids);
    }

    fn add_sky_passes(&mut self, part: SkyPart<'_>, stages: StageContext<'_>, aids: Aids) {
        for passes in passes::draws(&part.material.passes, aids.passes_alone()) {
            let Some(pass) = slice::get(passes, 0) else {
                continue;
            };
            let fog_adjust = fog_adjust(part.material, part.draw.fog, pass.blend);
            let (shading, draw) = stages.passes(
                part.material,
                passes,
                part.world,
                c::NO_TEXTURE,
                fog_adjust,
                part.draw,
            );
            let state = sky_state(pass.blend, pass.depth_write, part.cull, shading);
            self.push(state, aids.sky_range(), part.span, draw);
        }
    }

    fn mesh(&mut self) -> sky::Mesh<'_> {
        sky::Mesh {
            vertices: &mut self.vertices,
            indices: &mut self.indices,
        }
    }
}

/// State of draws at the far end of the depth range.
pub(super) fn sky_state(
    blend: Option<(u32, u32)>,
    depth_write: bool,
    cull: CullFaces,
    shading: Shading,
) -> State {
    State {
        blend,
        depth_write,
        shading,
        ..State::plain(cull)
    }
}

/// Whether a stage of the pass shows the lightmap.
pub(super) fn shows_lightmap(pass: &RasterPass, materials: &Materials) -> bool {
    let stages = &materials.arrays().stages;
    let shows = |&&stage: &&u32| {
        stages
            .get(stage as usize)
            .is_some_and(|s| s.image_count == 0)
    };
    pass.stages
        .iter()
        .take(pass.stage_count as usize)
        .any(|stage| shows(&stage))
}

/// The depth comparison of a pass.
pub fn stage_depth(pass: &RasterPass) -> Depth {
    match (pass.depth_test, pass.depth_equal) {
        (false, _) => Depth::Always,
        (true, true) => Depth::Equal,
        (true, false) => Depth::LessEqual,
    }
}

pub(super) fn light_source_factor(light: &DynamicLight) -> u32 {
    if light.additive {
        c::BLEND_ONE
    } else {
        c::BLEND_DST_COLOR
    }
}

/// The engine's front faces wind clockwise; a mirror reverses the winding.
pub(super) fn faces(cull: Cull, mirrored: bool) -> CullFaces {
    match (cull, mirrored) {
        (Cull::None, _) => CullFaces::None,
        (Cull::Front, false) | (Cull::Back, true) => CullFaces::CounterClockwise,
        (Cull::Back, false) | (Cull::Front, true) => CullFaces::Clockwise,
    }
}

/// The channels of a blended stage that fog scales, by its blend function; none unless the material's first stage
/// blends, too (`adjustColorsForFog`, `ComputeColors`). The material's sort does not matter: clouds of a sky are scaled
/// like this and also get a fog pass.
pub(super) fn fog_adjust(material: &Material, fog: u32, blend: Option<(u32, u32)>) -> u32 {
    let first_blends = material.passes.first().is_some_and(|p| p.blend.is_some());
    if fog == 0 || !first_blends {
        return c::FOG_ADJUST_NONE;
    }
    match blend {
        Some((c::BLEND_ONE, c::BLEND_ONE) | (c::BLEND_ZERO, c::BLEND_ONE_MINUS_SRC_COLOR)) => {
            c::FOG_ADJUST_RGB
        }
        Some((c::BLEND_SRC_ALPHA, c::BLEND_ONE_MINUS_SRC_ALPHA)) => c::FOG_ADJUST_ALPHA,
        Some((c::BLEND_ONE, c::BLEND_ONE_MINUS_SRC_ALPHA)) => c::FOG_ADJUST_RGBA,
        _ => c::FOG_ADJUST_NONE,
    }
}
