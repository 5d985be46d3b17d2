//! What changes materials after they were found: remaps, light that a map gives them, pictures of films.

use glam::Vec3;
use shaders::types;
use shaderscript::strip_extension;
use support::slice::{part_mut, span};

use super::super::bind::passes;
use super::super::material::LightmapClass;
use super::super::source::ImageSource;
use super::Materials;

impl Materials {
    /// A material that only `RemapShader` names. The engine gives it the map's first lightmap page, wherever it shows.
    fn find_with_first_page(&mut self, source: &mut dyn ImageSource, name: &str) -> u32 {
        let Some(page) = source.lightmap(0) else {
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

    /// Draws `new` wherever `old` is asked for, in every class (`RemapShader`); equal names cancel. `time_offset` is
    /// subtracted from the new material's time.
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
            return;
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

    /// Says that surfaces of a material are in the light list, and which radiance (display-white units) they have. Where
    /// a stage glows by itself it shows that, on the parts of the image that its author drew as a lamp; else the whole
    /// texture is shown as bright as its light.
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

    /// Takes back every [`set_emitter`](Self::set_emitter).
    pub fn forget_emitters(&mut self) {
        for material in &mut self.list {
            material.flags &= !types::constants::MATERIAL_EMITTER;
        }
        self.light_radiance.fill(Vec3::ZERO);
        self.touch();
    }

    /// Leaves what becomes of light in a liquid to the volume of fog that the map has of it.
    pub fn leave_to_fog(&mut self, name: &str) {
        let name = strip_extension(name);
        for material in &mut self.list {
            if strip_extension(&material.name).eq_ignore_ascii_case(name) {
                material.dielectric.absorption = Vec3::ZERO;
            }
        }
        self.touch();
    }

    /// Points every stage that shows texture `old` for a client at `new`.
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

    /// Takes away the stages of a video that cannot be played, and with each all stages after it, as the engine does.
    pub fn drop_video(&mut self, client: usize) {
        for material in &mut self.list {
            let Some(at) = material.videos.iter().position(|v| v.client == client) else {
                continue;
            };
            let stage = material.videos.get(at).map_or(0, |v| v.stage);
            let kept = stage.saturating_sub(material.stage_first);
            material.videos.truncate(at);
            material.stage_count = kept;
            material.shader.stages.truncate(kept as usize);
            material.passes = passes(&material.shader, material.stage_first);
        }
        self.touch();
    }
}
