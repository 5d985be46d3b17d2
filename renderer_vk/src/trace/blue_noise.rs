//! The square of blue noise that rotates the random numbers of pixels (`rt_blueNoise`, `shaders/trace/random.glsl`).

use std::sync::OnceLock;

use shaders::trace_types::constants::BLUE_NOISE_SIZE;
use support::blue_noise::void_and_cluster;

use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// The square on the GPU, made at first use.
#[derive(Default)]
pub struct BlueNoise(Option<Buffer>);

impl BlueNoise {
    /// Uploads the square unless that is done.
    ///
    /// # Errors
    /// Out of memory.
    pub fn make(&mut self, device: &Device) -> Result<(), Error> {
        if self.0.is_none() {
            let (name, usage) = ("trace blue noise", BufferUsage::STORAGE);
            self.0 = Some(Buffer::with_data(device, name, usage, texels())?);
        }
        Ok(())
    }

    /// Its address; 0 before it is made.
    pub fn address(&self) -> u64 {
        self.0.as_ref().map_or(0, Buffer::address)
    }
}

/// Ranks as the middles of as many intervals from 0 to 1.
fn texels() -> &'static [f32] {
    static TEXELS: OnceLock<Vec<f32>> = OnceLock::new();
    TEXELS.get_or_init(|| {
        let ranks = void_and_cluster(BLUE_NOISE_SIZE as usize, 1);
        let count = ranks.len() as f32;
        ranks
            .iter()
            .map(|rank| (*rank as f32 + 0.5) / count)
            .collect()
    })
}
