//! The arrays of all materials on the GPU.

use glam::Vec3;
use shaders::types::constants as c;
use shaders::types::{self, MaterialBuffers};

use super::{LightmapClass, Material, Materials, Samplers};
use crate::gpu::{self, Buffer, BufferUsage, Device};

/// `clamp_time` of a material without a time limit.
const ENDLESS: f32 = 1.0e30;

/// The arrays on the GPU.
pub(super) struct Uploaded {
    materials: Buffer,
    stages: Buffer,
    tc_mods: Buffer,
    images: Buffer,
    noise: Buffer,
}

/// Factor by which the map compiler scaled the light on a material before storing it. The traced look scales the
/// reflectance by it.
fn lit_scale(material: &Material) -> f32 {
    let directive = material.shader.light.lightmap_brightness;
    let lightmapped = material.lightmap_class == LightmapClass::Page;
    relight::light::stored_scale(directive.filter(|_| lightmapped))
}

impl Materials {
    /// Uploads the arrays to the GPU if they have changed. `samplers` translates sampler kinds to bindless indices.
    ///
    /// # Errors
    /// The device has no memory for the buffers.
    pub fn upload(&mut self, device: &Device, samplers: &Samplers) -> Result<(), gpu::Error> {
        if !self.dirty && self.uploaded.is_some() {
            return Ok(());
        }
        let stages: Vec<types::Stage> = self
            .arrays
            .stages
            .iter()
            .map(|stage| types::Stage {
                sampler_index: samplers.index(stage.sampler_index),
                ..*stage
            })
            .collect();
        let materials: Vec<types::Material> = self
            .list
            .iter()
            .zip(&self.light_radiance)
            .map(|(material, &light)| self.gpu_material(material, light, samplers))
            .collect();
        let usage = BufferUsage::STORAGE;
        // noise values as bits, then the permutation: one array of words
        let noise: Vec<u32> = shaderscript::eval::noise_values()
            .iter()
            .map(|value| value.to_bits())
            .chain(
                shaderscript::eval::noise_permutation()
                    .iter()
                    .map(|&i| u32::from(i)),
            )
            .collect();
        self.uploaded = Some(Uploaded {
            materials: Buffer::with_data(device, "materials", usage, &materials)?,
            stages: Buffer::with_data(device, "stages", usage, &stages)?,
            tc_mods: Buffer::with_data(device, "tcMods", usage, &self.arrays.tc_mods)?,
            images: Buffer::with_data(device, "stage images", usage, &self.arrays.images)?,
            noise: Buffer::with_data(device, "noise", usage, &noise)?,
        });
        self.dirty = false;
        Ok(())
    }

    /// Device addresses of the last upload; zero before the first.
    pub fn addresses(&self) -> MaterialBuffers {
        self.uploaded
            .as_ref()
            .map_or_else(MaterialBuffers::default, |u| MaterialBuffers {
                materials: u.materials.address(),
                stages: u.stages.address(),
                tc_mods: u.tc_mods.address(),
                images: u.images.address(),
                noise: u.noise.address(),
            })
    }

    fn gpu_material(
        &self,
        material: &Material,
        light: Vec3,
        samplers: &Samplers,
    ) -> types::Material {
        let (plain_image, plain_sampler) = self
            .plain_image(material)
            .map_or((c::NO_TEXTURE, 0), |(image, sampler)| {
                (image, samplers.index(sampler))
            });
        types::Material {
            stage_first: material.stage_first,
            stage_count: material.stage_count,
            flags: material.flags,
            time_offset: material.time_offset,
            clamp_time: material.shader.clamp_time.unwrap_or(ENDLESS),
            plain_image,
            plain_sampler,
            light_radiance: light,
            lit_scale: lit_scale(material),
            dielectric: material.dielectric,
            specular: types::Specular {
                sampler_index: samplers.index(material.specular.sampler_index),
                ..material.specular
            },
        }
    }

    /// Texture and sampler kind of a material whose stages reduce to one constant image under light: the image alone
    /// where light is computed or stored in vertices, or the product of image and baked light in either order.
    /// None for glass of a file of materials, which does not show its stages.
    pub(super) fn plain_image(&self, material: &Material) -> Option<(u32, u32)> {
        if material.flags & c::MATERIAL_CLEAR != 0 {
            return None;
        }
        let is_drawn = |s: &&types::Stage| s.flags & c::STAGE_LIGHT_STYLE == 0;
        let stages: Vec<_> = self.stages(material).iter().filter(is_drawn).collect();
        let plain = |s: &types::Stage| {
            s.alpha_func == c::ALPHAFUNC_NONE
                && s.flags & (c::STAGE_WHITE | c::STAGE_NO_LIGHTMAP) == 0
        };
        let opaque = |s: &types::Stage| (s.blend_src, s.blend_dst) == (c::BLEND_ONE, c::BLEND_ZERO);
        let filter = |s: &types::Stage| {
            [
                (c::BLEND_DST_COLOR, c::BLEND_ZERO),
                (c::BLEND_ZERO, c::BLEND_SRC_COLOR),
            ]
            .contains(&(s.blend_src, s.blend_dst))
        };
        let full = |s: &types::Stage| {
            [c::RGBGEN_IDENTITY, c::RGBGEN_IDENTITY_LIGHTING].contains(&s.rgb_gen)
        };
        let still = |s: &types::Stage| {
            s.image_count == 1 && s.tc_gen == c::TCGEN_BASE && s.tc_mod_count == 0
        };
        let is_light = |s: &types::Stage| s.image_count == 0 || s.flags & c::STAGE_BAKED_LIGHT != 0;
        let image = match stages[..] {
            [one] if plain(one) && opaque(one) && still(one) => {
                let baked = material.flags & c::MATERIAL_VERTEX_LIGHT != 0
                    && [c::RGBGEN_VERTEX, c::RGBGEN_EXACT_VERTEX].contains(&one.rgb_gen);
                (baked || one.rgb_gen == c::RGBGEN_LIGHTING_DIFFUSE).then_some(one)?
            }
            [first, second]
                if [first, second].iter().all(|s| plain(s) && full(s))
                    && opaque(first)
                    && filter(second) =>
            {
                match (is_light(first), is_light(second)) {
                    (true, false) if still(second) => second,
                    (false, true) if still(first) => first,
                    _ => return None,
                }
            }
            _ => return None,
        };
        let texture = self.arrays.images.get(image.image_first as usize)?;
        (*texture != c::NO_TEXTURE).then_some((*texture, image.sampler_index))
    }
}
