//! Bloom: adds a blurred copy of the picture's light; `shaders/trace/bloom.glsl` describes the filter.

use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::{Buffer, BufferDesc, BufferUsage, Device, Error, Memory};
use shaders::trace_types::constants::{BLOOM_FIRST, BLOOM_LEVELS};

/// Reads `hdr`; writes the blurred light, one texel for each 4 x 4 pixels. Buffers are made at first use.
#[derive(Default)]
pub struct Bloom {
    /// Picture size and texels.
    texels: Option<([u32; 2], Buffer)>,
}

impl Bloom {
    /// Address of the texels for a picture of this size; 0 if the strength is 0, which frees them.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        device: &Device,
        size: [u32; 2],
        strength: f32,
    ) -> Result<u64, Error> {
        self.texels = (self.texels.take()).filter(|(of, _)| strength > 0.0 && *of == size);
        if strength <= 0.0 {
            return Ok(0);
        }
        let texels = match &self.texels {
            Some((_, texels)) => texels,
            None => {
                let desc = BufferDesc {
                    name: "trace bloom",
                    size: texel_count(size) * 8,
                    usage: BufferUsage::STORAGE,
                    memory: Memory::Device,
                };
                &self.texels.insert((size, Buffer::new(device, &desc)?)).1
            }
        };
        Ok(texels.address())
    }

    /// Records the passes. [`prepare`](Self::prepare) must have returned an address.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        if self.texels.is_some() {
            passes.run(Pass::BloomDown)?;
            passes.run(Pass::BloomUp)?;
        }
        Ok(())
    }
}

/// Number of texels of all levels and of their sum.
fn texel_count(size: [u32; 2]) -> u64 {
    let level = |level: u32| {
        let [w, h] = size.map(|s| u64::from(s.div_ceil(BLOOM_FIRST << level)));
        w * h
    };
    (0..BLOOM_LEVELS).map(level).sum::<u64>() + level(0)
}
