//! Queries of the game and its console: light, marks, tags, visibility, lists.

use glam::Vec3;

use super::Renderer;
use crate::api::{MarkFragment, Orientation, PointLighting};
use crate::error::Error;
use crate::statistics::{Costs, LightCost, MovingCost, StructureCost};
use crate::trace::TraceLook;
use crate::world::{LightsChanged, Marked, World};

impl Renderer {
    /// Light of the map's light grid at a point; `None` without a map or a light grid.
    pub fn light_for_point(&self, point: Vec3) -> Option<PointLighting> {
        let light = self.world.as_ref()?.grid_light(point, &self.settings)?;
        Some(PointLighting {
            ambient: light.ambient,
            directed: light.directed,
            direction: light.direction,
        })
    }

    /// The pieces of the map under a decal's polygon, projected along `projection`.
    pub fn mark_fragments(
        &mut self,
        points: &[Vec3],
        projection: Vec3,
        max_points: usize,
        max_fragments: usize,
    ) -> (&[Vec3], &[MarkFragment]) {
        match (&self.world, &self.assets) {
            (Some(world), Some(assets)) => {
                let marked = Marked {
                    world,
                    materials: &assets.materials,
                    on_meshes: self.settings.marks_on_triangle_meshes,
                };
                (self.marker).mark(marked, points, projection, max_points, max_fragments)
            }
            _ => (&[], &[]),
        }
    }

    /// Interpolated orientation of a model's tag between two frames (`frac` is the weight of the end frame); `None`
    /// without such a model or tag.
    pub fn lerp_tag(
        &self,
        model: i32,
        start: i32,
        end: i32,
        frac: f32,
        name: &str,
    ) -> Option<Orientation> {
        self.assets
            .as_ref()?
            .models
            .lerp_tag(model, start, end, frac, name)
    }

    /// Bounds of a model's first frame, or of an inline model.
    pub fn model_bounds(&self, model: i32) -> (Vec3, Vec3) {
        match &self.assets {
            Some(assets) => assets.models.bounds(model),
            None => (Vec3::ZERO, Vec3::ZERO),
        }
    }

    /// Cluster of the leaf at a point; -1: none.
    pub fn leaf_cluster(&self, point: Vec3) -> i32 {
        self.world
            .as_ref()
            .map_or(-1, |world| world.relit.bsp.cluster_at(point))
    }

    /// Whether cluster `b` is in the potentially visible set of cluster `a`.
    pub fn cluster_sees(&self, a: i32, b: i32) -> bool {
        self.world
            .as_ref()
            .is_none_or(|world| world.relit.bsp.cluster_sees(a, b))
    }

    /// The next token of the map's entity text; `None` at the end, after which reading restarts.
    pub fn entity_token(&mut self) -> Option<String> {
        self.entity_tokens
            .next(&self.world.as_ref()?.relit.bsp.entities)
    }

    /// Switches the ray counters of traced views, from the next frame on; see [`costs`](Self::costs). Counting has a
    /// cost. No effect without the traced look.
    pub fn count_rays(&mut self, count: bool) {
        self.counts_rays = count;
    }

    /// Costs of the newest finished frame, and memory in use. On a software device, passes are timed from the first
    /// call on.
    pub fn costs(&self) -> Costs {
        let timings = self.timings();
        let rays = |pass: &str| self.trace.as_ref().and_then(|trace| trace.rays(pass));
        Costs {
            device: self.device_info().name.clone(),
            tracer: (self.trace.as_ref()).map(|trace| format!("{:?}", trace.tracer())),
            size: self.size(),
            passes: Costs::passes(&timings, rays),
            memory: Costs::memory(&self.device.memory_uses()),
            reserved: self.device.memory_report().reserved,
            latency: self.latency(),
            moving: self.moving_cost().filter(|cost| cost.counted > 0),
        }
    }

    /// Cost of the map's structures; `None` without the traced look.
    pub fn structure_cost(&self) -> Option<StructureCost> {
        self.trace.as_ref().map(TraceLook::structure_cost)
    }

    /// Cost of the acceleration structures of moving bodies, summed over frames; `None` without the traced look.
    pub fn moving_cost(&self) -> Option<MovingCost> {
        self.trace.as_ref().map(TraceLook::moving_cost)
    }

    /// Cost of the structures from which the map's lights are sampled; `None` if there are none.
    pub fn light_cost(&self) -> Option<LightCost> {
        self.trace.as_ref().map(TraceLook::light_cost)
    }

    /// Name of the loaded map, as given to [`load_world`](Self::load_world).
    pub fn world_name(&self) -> Option<&str> {
        self.world.as_ref().map(|world| world.relit.name.as_str())
    }

    /// The map, for tools.
    pub fn world(&self) -> Option<&World> {
        self.world.as_ref()
    }

    /// The lights of the map before hand-written ones changed them; `None` before the first traced view.
    pub fn lights_before_hand(&mut self) -> Option<relight::light::ChangeableLights> {
        self.world.as_mut()?.lights_before_hand()
    }

    /// Replaces the changes of the map's hand-written lights by others, and accumulation restarts. No effect before the
    /// first traced view.
    ///
    /// # Errors
    /// The device is out of memory or lost.
    pub fn light_by_hand(
        &mut self,
        by_hand: &relight::light::LightsByHand,
    ) -> Result<LightsChanged, Error> {
        let (Some(world), Some(assets)) = (&mut self.world, &mut self.assets) else {
            return Ok(LightsChanged::default());
        };
        let changed = world.light_by_hand(by_hand, assets);
        if let Some(trace) = &mut self.trace {
            trace.change_lights(world, assets)?;
        }
        Ok(changed)
    }

    /// Reads the files of lights and materials beside the map again, and accumulation restarts. False if nothing has read
    /// them yet: a traced view does when it is first drawn.
    ///
    /// # Errors
    /// The device is out of memory or lost.
    pub fn read_by_hand_again(&mut self) -> Result<bool, Error> {
        let (Some(world), Some(assets)) = (&mut self.world, &mut self.assets) else {
            return Ok(false);
        };
        let read = world.read_by_hand_again(assets);
        if self.settings.shows_surface_mapping() && assets.materials.has_gloss(false) {
            world.need_mapped_vertices(&self.device)?;
        }
        if let Some(trace) = self.trace.as_mut().filter(|_| read) {
            trace.change_lights(world, assets)?;
        }
        Ok(read)
    }

    /// Replaces the lights of the map's entities by those of others, and reads files by hand again; accumulation restarts.
    /// False, and no change, without a map or if it must be loaded again for that.
    ///
    /// # Errors
    /// The device is out of memory or lost.
    pub fn light_by_entities(&mut self, entities: &[q3bsp::Entity]) -> Result<bool, Error> {
        let (Some(world), Some(assets)) = (&mut self.world, &mut self.assets) else {
            return Ok(false);
        };
        let changed = world.light_by_entities(entities, assets);
        if let Some(trace) = self.trace.as_mut().filter(|_| changed) {
            trace.change_lights(world, assets)?;
        }
        Ok(changed)
    }

    /// Number of frames in the mean of `rt_accumulate`; 0 without a traced view.
    pub fn accumulated_frames(&self) -> u32 {
        (self.trace.as_ref()).map_or(0, TraceLook::accumulated_frames)
    }

    /// Whether the traced look is ready: its lights are found and its pipelines compiled.
    pub fn is_ready_to_trace(&self) -> bool {
        self.trace.is_some()
    }

    /// The `videoMap` files of registered materials, with the client numbers for
    /// [`upload_cinematic`](Self::upload_cinematic).
    pub fn videos(&self) -> impl Iterator<Item = (&str, usize)> {
        let assets = self.assets.iter();
        assets.flat_map(|assets| assets.materials.videos())
    }

    /// Reports that a video of [`videos`](Self::videos) cannot be played: its stages and the stages above them are no
    /// longer drawn.
    pub fn drop_video(&mut self, client: usize) {
        if let Some(assets) = &mut self.assets {
            assets.materials.drop_video(client);
        }
    }

    /// One line for each image.
    pub fn image_list(&self) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.textures.list())
    }

    /// One line for each material; in drawing order if `sorted`.
    pub fn shader_list(&self, sorted: bool) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.materials.list(sorted))
    }

    /// One line for each skin and each of its surfaces.
    pub fn skin_list(&self) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.skins.list(&a.materials))
    }

    /// One line for each model.
    pub fn model_list(&self) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.models.list())
    }
}
