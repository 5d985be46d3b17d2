//! Changes of materials after loading: remaps, light from maps, video pictures.

use glam::Vec3;
use shaders::types;
use shaderscript::strip_extension;
use support::slice::{part_mut, span};

use super::super::bind::passes;
use super::super::material::LightmapClass;
use super::super::source::ImageSource;
use super::Materials;

impl Materials {
    /// Finds a material that only `RemapShader` names. The engine assigns it the map's first lightmap page.
    fn find_with_first_page(&mut self, source: &mut dyn ImageSource, name: &str) -> u32 {
        let Some(page) = source.lightmap(0) else {
            // A map without lightmaps.
            return self.find(source, name, LightmapClass::None, true);
        };
        let index = self.find(source, name, LightmapClass::Page, true);
        let material = self.get(index);
        let stages = span(material.stage_first, material.stage_count);
        for stage in part_mut(&mut self.arrays.stages, stages) {
            if stage.image_count == 0 {
                stage.image_first = u32::try_from(self.arrays.images.len()).unwrap_or(u32::MAX);
                stage.image_count = 1;
                self.arrays.images.push(page);
            }
        }
        index
    }

    /// Replaces `old` by `new` in every class (`RemapShader`); equal names cancel. `time_offset` is subtracted from the
    /// new material's time.
    pub fn remap(
        &mut self,
        source: &mut dyn ImageSource,
        old: &str,
        new: &str,
        time_offset: Option<f32>,
    ) {
        let stripped = |name: &str| strip_extension(name).to_ascii_lowercase();
        let any_class = |materials: &Self, name: &str| {
            let name = stripped(name);
            materials
                .list
                .iter()
                .find(|m| m.name.eq_ignore_ascii_case(&name))
                .map(|m| m.order)
        };
        let mut usable = |materials: &mut Self, name: &str| {
            let index = match any_class(materials, name) {
                Some(index) => index,
                None => materials.find_with_first_page(source, name),
            };
            if index == 0 || materials.get(index).defaulted {
                log::warn!("remap of {old} to {new}: no material {name}");
                return None;
            }
            Some(index)
        };
        if usable(self, old).is_none() {
            return;
        }
        let Some(target) = usable(self, new) else {
            return; // `usable` has warned
        };
        let old = stripped(old);
        let cancels = old == stripped(new);
        for material in &mut self.list {
            if material.name.eq_ignore_ascii_case(&old) {
                material.remapped = (!cancels && material.order != target).then_some(target);
            }
        }
        if let (Some(offset), Some(material)) = (time_offset, self.list.get_mut(target as usize)) {
            material.time_offset = offset;
        }
        self.touch();
    }

    /// Marks a material as an emitter of the light list, with its radiance (in units of display white). If a stage
    /// glows by itself, the traced look shows the radiance on the glowing parts of the image; otherwise the whole
    /// texture has the light's brightness.
    pub fn set_emitter(&mut self, index: u32, radiance: Vec3) {
        let slots = (
            self.list.get_mut(index as usize),
            self.light_radiance.get_mut(index as usize),
        );
        if let (Some(material), Some(light)) = slots {
            material.flags |= types::constants::MATERIAL_EMITTER;
            *light = if relight::materials::light::is_glowing(&material.shader) {
                Vec3::ZERO
            } else {
                radiance
            };
            self.touch();
        }
    }

    /// Reverts every [`set_emitter`](Self::set_emitter).
    pub fn forget_emitters(&mut self) {
        for material in &mut self.list {
            material.flags &= !types::constants::MATERIAL_EMITTER;
        }
        self.light_radiance.fill(Vec3::ZERO);
        self.touch();
    }

    /// Leaves the absorption of a liquid to the map's fog volume of this material.
    pub fn leave_to_fog(&mut self, name: &str) {
        let name = strip_extension(name);
        for material in &mut self.list {
            if strip_extension(&material.name).eq_ignore_ascii_case(name) {
                material.dielectric.absorption = Vec3::ZERO;
                material.of_script.dielectric.absorption = Vec3::ZERO;
            }
        }
        self.touch();
    }

    /// Replaces texture `old` by `new` in every stage of a client.
    pub fn replace_scratch(&mut self, client: usize, new: u32) {
        let mut changed = false;
        for material in &self.list {
            for video in material.videos.iter().filter(|v| v.client == client) {
                let first = self
                    .arrays
                    .stages
                    .get(video.stage as usize)
                    .map(|stage| stage.image_first as usize);
                if let Some(image) = first.and_then(|first| self.arrays.images.get_mut(first)) {
                    *image = new;
                    changed = true;
                }
            }
        }
        if changed {
            self.touch();
        }
    }

    /// Removes the stages of a video that cannot be played, and all stages after each of them, as the engine does.
    pub fn drop_video(&mut self, client: usize) {
        for material in &mut self.list {
            let mut videos = material.videos.iter().enumerate();
            let Some((at, video)) = videos.find(|(_, v)| v.client == client) else {
                continue; // does not show the video
            };
            let stage = video.stage;
            let kept = stage.saturating_sub(material.stage_first);
            material.videos.truncate(at);
            material.stage_count = kept;
            material.shader.stages.truncate(kept as usize);
            material.passes = passes(&material.shader, material.stage_first);
        }
        self.touch();
    }
}
