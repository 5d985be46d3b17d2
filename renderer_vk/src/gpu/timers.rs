//! GPU time of passes.

use std::sync::atomic::Ordering;

use ash::vk;

use super::device::{Device, lock};
use super::error::{Context, Error};
use super::graveyard::Garbage;

/// Passes per query pool; more passes make more pools.
const PASSES: u32 = 64;

/// GPU time of the passes of a frame.
#[derive(Default)]
pub(crate) struct FrameTimings {
    /// Serial number of the frame; 0: no frame was timed.
    pub frame: u64,
    /// Milliseconds of each pass, in order of recording.
    pub passes: Vec<(String, f32)>,
}

/// Timestamps of one frame's passes.
pub(crate) struct Timers {
    device: Device,
    pools: Vec<vk::QueryPool>,
    /// Names of passes; those after `used` are from earlier frames, kept for their memory.
    names: Vec<String>,
    used: usize,
    /// Serial number of the frame that is timed.
    frame: u64,
    /// Query results.
    ticks: Vec<u64>,
}

impl Timers {
    pub fn new(device: &Device) -> Self {
        Self {
            device: device.clone(),
            pools: Vec::new(),
            names: Vec::new(),
            used: 0,
            frame: 0,
            ticks: Vec::new(),
        }
    }

    /// Removes the passes of the last use; those that follow belong to `frame`.
    pub fn restart(&mut self, frame: u64) {
        (self.used, self.frame) = (0, frame);
    }

    /// Adds a pass; returns the pool and the first of its two queries. `None` without timestamps.
    pub fn begin(&mut self, name: &str) -> Result<Option<(vk::QueryPool, u32)>, Error> {
        if !self.device.0.info.timestamps || !self.device.0.measuring.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let index = self.used;
        let per_pool = PASSES as usize;
        if index / per_pool >= self.pools.len() {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(PASSES * 2);
            // SAFETY: plain creation.
            let pool = unsafe { self.device.vk().create_query_pool(&info, None) }
                .context("vkCreateQueryPool")?;
            self.pools.push(pool);
        }
        match self.names.get_mut(index) {
            Some(known) => {
                known.clear();
                known.push_str(name);
            }
            None => self.names.push(name.to_owned()),
        }
        self.used += 1;
        let query = u32::try_from(index % per_pool).unwrap_or(0) * 2;
        Ok(self.pools.get(index / per_pool).map(|pool| (*pool, query)))
    }

    /// Records the reset of every pool, before the passes.
    pub fn reset(&self, cmd: vk::CommandBuffer) {
        for pool in &self.pools {
            // SAFETY: outside of a render pass, the whole pool, and its last frame is over.
            unsafe {
                self.device
                    .vk()
                    .cmd_reset_query_pool(cmd, *pool, 0, PASSES * 2);
            }
        }
    }

    /// Publishes the timings of a finished frame.
    pub fn publish(&mut self) {
        if self.used == 0 {
            return;
        }
        let inner = &self.device.0;
        self.ticks.clear();
        self.ticks.resize(self.used * 2, 0);
        let pieces = self.ticks.chunks_mut(PASSES as usize * 2);
        for (pool, values) in self.pools.iter().zip(pieces) {
            // SAFETY: these queries were written by a frame that is over.
            let read = unsafe {
                inner.core.raw.get_query_pool_results(
                    *pool,
                    0,
                    values,
                    vk::QueryResultFlags::TYPE_64,
                )
            };
            if read.is_err() {
                return;
            }
        }
        let mut timings = lock(&inner.timings);
        timings.frame = self.frame;
        let times = &mut timings.passes;
        times.truncate(self.used);
        let names = self.names.iter().take(self.used);
        for (i, (name, t)) in names.zip(self.ticks.chunks_exact(2)).enumerate() {
            let mask = inner.timestamp_mask;
            let passed = match t {
                [begin, end] => (end & mask).wrapping_sub(begin & mask) & mask,
                _ => 0,
            };
            #[allow(clippy::cast_precision_loss)]
            let ms = passed as f32 * inner.timestamp_period * 1e-6;
            match times.get_mut(i) {
                Some((known, time)) => {
                    known.clone_from(name);
                    *time = ms;
                }
                None => times.push((name.clone(), ms)),
            }
        }
    }
}

impl Drop for Timers {
    fn drop(&mut self) {
        for pool in self.pools.drain(..) {
            self.device.0.bury(Garbage::QueryPool(pool));
        }
    }
}
