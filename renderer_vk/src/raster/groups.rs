//! Groups the surfaces of a view that share a draw, and adds the calls of each group: its stages, then its dynamic
//! lights, then its fog, as in the engine.
//!
//! Pipeline changes are the main cost of a call, above all with software drivers. So calls of equal state are joined
//! where the order is invisible. Surfaces whose first stage covers everything behind them ([`depth_first::covers`])
//! leave one surface in each pixel, in any order. For neighbouring groups of one such material, the draws of a stage
//! ([`passes`]) are added for all groups before the next stage, and the lights and fog of all such groups are deferred
//! until something else is drawn. They pass the depth test only on the visible surface. For the same reason entities
//! are drawn before the map between such surfaces: what they hide is not textured.

use shaders::types::constants as c;
use shaders::types::{Draw, Instance};
use support::slice::{self, part};

use super::aids::Aids;
use super::depth_first;
use super::hybrid;
use super::light_reach::LightReach;
use super::list::{
    Call, DepthRange, DrawList, Statics, faces, fog_adjust, light_source_factor, shows_lightmap,
    stage_depth,
};
use super::passes;
use super::pipelines::{Depth, State};
use super::shading::{Shading, StageContext};
use crate::assets::{Material, NO_DYNAMIC_LIGHT, RasterPass};
use crate::scene::{ClassicScene, DrawSurface, Geometry};
use shaderscript::sort;

/// Most dynamic lights of a surface, as in the engine: one bit each.
const MAX_LIGHTS: usize = 32;

/// State shared by the surfaces of a group.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Common {
    material: u32,
    instance: u32,
    fog: u32,
    lightmap: u32,
    dynamic: bool,
}

impl Common {
    fn of(surface: &DrawSurface) -> Self {
        Self {
            material: surface.material,
            instance: surface.instance,
            fog: surface.fog,
            lightmap: surface.lightmap,
            dynamic: matches!(surface.geometry, Geometry::Dynamic { .. }),
        }
    }

    /// Number of first surfaces with equal state.
    fn run(surfaces: &[DrawSurface]) -> usize {
        let common = surfaces.first().map(Self::of);
        surfaces
            .iter()
            .take_while(|s| Some(Self::of(s)) == common)
            .count()
    }

    /// Whether it belongs to an entity, not to the map.
    fn moves(&self) -> bool {
        self.dynamic && self.instance != 0
    }
}

/// Neighbouring surfaces of equal state.
#[derive(Clone, Copy)]
pub(super) struct Group {
    common: Common,
    /// First surface in the view's list, and their number.
    surfaces: (usize, usize),
    /// First index and number of indices.
    span: (u32, u32),
    range: DepthRange,
}

impl Group {
    /// Whether it is part of the map, in its rigid shape.
    fn is_of_map(&self) -> bool {
        !self.common.dynamic && self.range == DepthRange::Normal
    }
}

/// Parameters of all groups.
#[derive(Clone, Copy)]
pub(super) struct GroupContext<'a> {
    pub surfaces: &'a [DrawSurface],
    pub scene: &'a ClassicScene,
    pub stages: StageContext<'a>,
    pub statics: Statics<'a>,
    pub aids: Aids,
}

impl GroupContext<'_> {
    fn instance(&self, group: &Group) -> Option<&Instance> {
        slice::get(&self.scene.instances, group.common.instance as usize)
    }

    fn plain_state(&self, material: &Material) -> State {
        State {
            offset: material.polygon_offset,
            ..State::plain(faces(material.shader.cull, self.scene.view.mirrored))
        }
    }
}

/// Whether fog is drawn over surfaces of a material with `fog`, and if so, whether they are opaque.
pub(super) fn fogged(material: &Material, fog: u32) -> Option<bool> {
    let opaque = material.sort <= sort::OPAQUE;
    let passes = opaque || material.flags & c::MATERIAL_FOG != 0;
    (fog != 0 && passes).then_some(opaque)
}

/// State of fog over the draws of `plain`.
pub(super) fn fog_state(plain: State, opaque: bool, shading: Shading) -> State {
    State {
        blend: Some((c::BLEND_SRC_ALPHA, c::BLEND_ONE_MINUS_SRC_ALPHA)),
        depth: if opaque {
            Depth::Equal
        } else {
            Depth::LessEqual
        },
        depth_write: false,
        shading,
        ..plain
    }
}

/// State of a dynamic light over the draws of `plain`. `source`: source factor of its blending.
pub(super) fn light_state(plain: State, source: u32, shading: Shading) -> State {
    State {
        blend: Some((source, c::BLEND_ONE)),
        depth: Depth::Equal,
        depth_write: false,
        shading,
        ..plain
    }
}

/// Source factor of a light that is evaluated per pixel.
pub(super) fn pixel_light_source(material: &Material) -> u32 {
    if material.sort < sort::OPAQUE {
        c::BLEND_DST_COLOR
    } else {
        c::BLEND_ONE
    }
}

fn plain_draw(group: &Group) -> Draw {
    Draw {
        instance: group.common.instance,
        fog: group.common.fog,
        dynamic_vertices: group.common.dynamic.into(),
        ..Draw::default()
    }
}

impl DrawList {
    /// Adds the calls of `context.surfaces`.
    pub(super) fn add_surfaces(&mut self, context: &GroupContext<'_>) {
        let order_free = |surface: &&DrawSurface| {
            depth_first::order_free(context.stages.materials.get(surface.material))
        };
        let mut rest = context.surfaces;
        while !rest.is_empty() {
            let run = rest.iter().take_while(order_free).count();
            let others = rest.iter().skip(run).take_while(|s| !order_free(s)).count();
            let (these, those) = rest.split_at(run);
            // moving geometry hides the map more often than the reverse, and is not in the depth prepass
            self.add_groups(these, context, |common| common.moves());
            self.add_groups(these, context, |common| !common.moves());
            self.draw_put_off();
            let (those, after) = those.split_at(others);
            self.add_groups(those, context, |_| true);
            rest = after;
        }
    }

    /// Adds the calls of the groups that `wanted` selects.
    fn add_groups(
        &mut self,
        surfaces: &[DrawSurface],
        context: &GroupContext<'_>,
        wanted: impl Fn(&Common) -> bool,
    ) {
        let context = &GroupContext {
            surfaces,
            ..*context
        };
        let mut groups = std::mem::take(&mut self.groups);
        let mut next = 0;
        while let Some(first) = surfaces.get(next) {
            let material = context.stages.materials.get(first.material);
            let covers = depth_first::covers(material);
            let order_free = depth_first::order_free(material);
            groups.clear();
            loop {
                let begin = part(surfaces, next..);
                if begin.first().is_some_and(|s| wanted(&Common::of(s))) {
                    let group = self.gather_group(next, context);
                    next += group.surfaces.1;
                    groups.push(group);
                } else {
                    next += Common::run(begin).max(1);
                }
                let goes_on =
                    (surfaces.get(next)).is_some_and(|s| s.material == first.material && covers);
                if !goes_on {
                    break;
                }
            }
            if material.sky.is_some() || context.aids.leaves_out(material.sort) {
                continue;
            }
            groups.retain(|group| group.span.1 > 0 && context.instance(group).is_some());
            self.add_stages(material, &groups, context);
            for group in &groups {
                self.add_lights(material, group, context);
                self.add_fog(material, group, context);
            }
            if !order_free {
                self.draw_put_off();
            }
            for group in &groups {
                let draw = plain_draw(group);
                if context.aids.edges {
                    let cull = context.plain_state(material).cull;
                    self.push_edges(group.span, draw, cull);
                }
                if context.aids.normals {
                    self.push_normals(group.span, context.statics.vertices, draw);
                }
            }
        }
        self.groups = groups;
    }

    /// The group that begins with a surface. Copies its indices.
    fn gather_group(&mut self, first: usize, context: &GroupContext<'_>) -> Group {
        let surfaces = part(context.surfaces, first..);
        let common = surfaces.first().map(Common::of);
        let count = Common::run(surfaces);
        let first_index = self.indices.len() as u32;
        for surface in surfaces.iter().take(count) {
            let indices = context.scene.indices_of(surface, context.statics.indices);
            self.indices.extend_from_slice(indices);
        }
        let common = common.unwrap_or(Common {
            material: 0,
            instance: u32::MAX,
            fog: 0,
            lightmap: c::NO_TEXTURE,
            dynamic: false,
        });
        let instance = slice::get(&context.scene.instances, common.instance as usize);
        let has = |bit: u32| instance.is_some_and(|i| i.flags & bit != 0);
        let range = match (has(c::INSTANCE_DEPTH_HACK), has(c::INSTANCE_CROSSHAIR)) {
            (true, false) => DepthRange::Near,
            (true, true) => DepthRange::Crosshair,
            _ => DepthRange::Normal,
        };
        Group {
            common,
            surfaces: (first, count.max(1)),
            span: (first_index, self.indices.len() as u32 - first_index),
            range,
        }
    }

    /// Adds the stages of groups of one material: each stage for all groups before the next stage.
    fn add_stages(&mut self, material: &Material, groups: &[Group], context: &GroupContext<'_>) {
        let plain = context.plain_state(material);
        for group in groups {
            if group.is_of_map() {
                let (first, count) = group.surfaces;
                let surfaces = part(context.surfaces, first..first + count);
                self.note_depth(material, plain, surfaces);
            }
        }
        let aids = context.aids;
        for passes in passes::draws(&material.passes, aids.passes_alone()) {
            for group in groups {
                self.add_passes(material, passes, group, context);
            }
            let shown = |pass| shows_lightmap(pass, context.stages.materials);
            if aids.lightmaps && passes.iter().any(shown) {
                break;
            }
        }
    }

    fn add_passes(
        &mut self,
        material: &Material,
        passes: &[RasterPass],
        group: &Group,
        context: &GroupContext<'_>,
    ) {
        let (stages, aids) = (context.stages, context.aids);
        let (Some(instance), Some(pass)) = (context.instance(group), slice::get(passes, 0)) else {
            return;
        };
        let draw = plain_draw(group);
        let fog_adjust = fog_adjust(material, draw.fog, pass.blend);
        let lightmap = group.common.lightmap;
        let (mut shading, mut draw) =
            stages.passes(material, passes, instance, lightmap, fog_adjust, draw);
        if stages.traced_shadows && group.range != DepthRange::Crosshair {
            shading.mirrored = hybrid::mirroring_stages(stages.materials, &shading, &draw);
        }
        if group.is_of_map() && stages.traced_shadows {
            shading.shadowed = hybrid::lit_stages(stages.materials, &shading, &draw, lightmap);
        }
        // of two textures in one pass the second is shown: the lightmap, if the pass has one
        if aids.lightmaps && pass.stage_count == 2 {
            (shading, draw) = match (shows_lightmap(pass, stages.materials), lightmap) {
                (false, _) => (shading.second_alone(), draw),
                (true, c::NO_TEXTURE) => (Shading::WHITE, draw),
                (true, page) => stages.lightmap(page, draw),
            };
        }
        let state = State {
            blend: pass.blend,
            depth: stage_depth(pass),
            depth_write: pass.depth_write,
            shading,
            ..context.plain_state(material)
        };
        self.push(state, group.range, group.span, draw);
    }

    fn add_lights(&mut self, material: &Material, group: &Group, context: &GroupContext<'_>) {
        let Some(instance) = context.instance(group) else {
            return;
        };
        let pixel_stage = match context.stages.pixel_lights {
            Some(_) => material.light_stage,
            None => None,
        };
        let spots = material.sort <= sort::OPAQUE && material.surface_flags & NO_DYNAMIC_LIGHT == 0;
        if pixel_stage.is_none() && (context.stages.pixel_lights.is_some() || !spots) {
            return;
        }
        let (first, count) = group.surfaces;
        let surfaces = part(context.surfaces, first..first + count);
        let lights = surfaces.iter().fold(0, |all, s| all | s.dlights);
        for (i, light) in (0..).zip(context.scene.dlights.iter().take(MAX_LIGHTS)) {
            if lights & (1 << i) == 0 {
                continue;
            }
            let reach = match pixel_stage {
                Some(_) => LightReach::sphere(light, instance),
                None => LightReach::spot(light, instance),
            };
            let first_index = self.indices.len() as u32;
            for surface in surfaces.iter().filter(|s| s.dlights & (1 << i) != 0) {
                let (vertices, indices) = match surface.geometry {
                    Geometry::Static { .. } => (context.statics.vertices, context.statics.indices),
                    Geometry::Dynamic { .. } => (self.vertices.as_slice(), &[][..]),
                };
                let indices = context.scene.indices_of(surface, indices);
                reach.gather(vertices, indices, &mut self.indices);
            }
            let span = (first_index, self.indices.len() as u32 - first_index);
            if span.1 == 0 {
                continue;
            }
            let draw = Draw {
                light: i,
                ..plain_draw(group)
            };
            let (mut shading, draw) = match pixel_stage {
                Some(stage) => {
                    let fog = fogged(material, draw.fog).map_or(0, |_| draw.fog);
                    let draw = Draw { fog, ..draw };
                    let lightmap = group.common.lightmap;
                    (context.stages).pixel_light(material, stage, instance, lightmap, draw)
                }
                None => context.stages.light(draw),
            };
            if group.is_of_map() && context.stages.traced_shadows {
                shading.shadowed = hybrid::DYNAMIC_LIGHT;
            }
            let source = match pixel_stage {
                Some(_) => pixel_light_source(material),
                None => light_source_factor(light),
            };
            let state = light_state(context.plain_state(material), source, shading);
            let call = self.call(state, group.range, span, draw);
            match pixel_stage {
                Some(_) => self.pixel_lights.push(call),
                None => self.lights.push(call),
            }
        }
    }

    fn add_fog(&mut self, material: &Material, group: &Group, context: &GroupContext<'_>) {
        let Some(opaque) = fogged(material, group.common.fog) else {
            return; // no fog over it
        };
        let (shading, draw) = context.stages.fog(plain_draw(group));
        let state = fog_state(context.plain_state(material), opaque, shading);
        let call = self.call(state, group.range, group.span, draw);
        self.fog.push(call);
    }

    /// Adds the deferred lights and fog.
    fn draw_put_off(&mut self) {
        self.calls.append(&mut self.lights);
        self.calls.append(&mut self.fog);
    }

    /// Adds a call with its parameters.
    pub(super) fn call(
        &mut self,
        state: State,
        range: DepthRange,
        (first_index, index_count): (u32, u32),
        draw: Draw,
    ) -> Call {
        let index = self.draws.len() as u32;
        self.draws.push(draw);
        Call {
            state,
            range,
            first_index,
            index_count,
            draw: index,
        }
    }

    /// Adds a call, or extends the last one if both differ only in their indices.
    pub(super) fn push(&mut self, state: State, range: DepthRange, span: (u32, u32), draw: Draw) {
        if let Some(last) = self.calls.last_mut()
            && (last.state, last.range) == (state, range)
            && last.first_index + last.index_count == span.0
            && let Some(same) = self.draws.get(last.draw as usize)
            && bytemuck::bytes_of(same) == bytemuck::bytes_of(&draw)
        {
            last.index_count += span.1;
            return;
        }
        let call = self.call(state, range, span, draw);
        self.calls.push(call);
    }
}
