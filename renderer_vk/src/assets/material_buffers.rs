//! The arrays of all materials on the GPU.

use glam::Vec3;
use shaders::types::{self, MaterialBuffers};

use super::{Material, Materials, Samplers};
use crate::gpu::{self, Buffer, BufferUsage, Device};

/// `clamp_time` of a material that never stops.
const ENDLESS: f32 = 1.0e30;

/// The arrays on the GPU.
pub(super) struct Uploaded {
    materials: Buffer,
    stages: Buffer,
    tc_mods: Buffer,
    images: Buffer,
    noise: Buffer,
}

impl Materials {
    /// Copies the arrays to the GPU if anything changed. `samplers` translates sampler kinds to bindless indices.
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
            .zip(&self.emission)
            .map(|(material, &emission)| gpu_material(material, emission))
            .collect();
        let usage = BufferUsage::STORAGE;
        // values as bits, then the permutation: one array of words
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

    /// Device addresses as of the last upload; zero before the first.
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
}

fn gpu_material(material: &Material, (mean, light): (Vec3, Vec3)) -> types::Material {
    types::Material {
        stage_first: material.stage_first,
        stage_count: material.stage_count,
        flags: material.flags,
        time_offset: material.time_offset,
        clamp_time: material.shader.clamp_time.unwrap_or(ENDLESS),
        mean_emission: mean,
        light_radiance: light,
    }
}
