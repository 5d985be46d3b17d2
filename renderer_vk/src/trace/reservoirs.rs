//! Reuse of light samples over frames and pixels (`rt_lightSelection 3`): its passes, and the reservoirs that one frame
//! leaves to the next. `shaders/trace/reservoirs.glsl` has the method.
//!
//! Frames of reference mode reuse samples of neighbours alone, so that they are independent of each other. Gradients of
//! the denoiser are off meanwhile: the light of a surface of the last frame cannot be repeated from its random numbers,
//! because it also depends on reservoirs.

use shaders::trace_types::ReservoirView;
use shaders::trace_types::constants as t;

use super::frame_passes::FramePasses;
use super::passes::Pass;
use super::targets::texels;
use crate::gpu::{Buffer, Device, Error};

/// Bytes of a pixel's reservoir, with its surface.
const BYTES: u64 = 32;

/// The reservoirs of a view.
#[derive(Default)]
pub struct Reservoirs {
    /// Those of the last frame, and their size in pixels.
    buffer: Option<(Buffer, [u32; 2])>,
    /// The frame reuses samples.
    on: bool,
    /// The buffer holds those of the last frame.
    history: bool,
}

impl Reservoirs {
    /// Makes the buffer if the frame leaves reservoirs to the next, and otherwise drops it. `in_use`: the frame reuses
    /// samples; `lasting`: over frames, too; `goes_on`: the frame continues the last drawn one.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        device: &Device,
        in_use: bool,
        lasting: bool,
        size: [u32; 2],
        goes_on: bool,
    ) -> Result<(), Error> {
        self.on = in_use;
        let needed = in_use && lasting;
        let fits = self.buffer.as_ref().is_some_and(|(_, had)| *had == size);
        if !needed || !fits {
            self.buffer = None;
            self.history = false;
        }
        if needed && !fits {
            let buffer = texels(device, "trace reservoirs", size, BYTES)?;
            self.buffer = Some((buffer, size));
        }
        self.history &= goes_on;
        Ok(())
    }

    /// Parameters of the passes. `lasting`: number of animated triangle lights and points of the map, whose numbers stay
    /// the same.
    pub fn view(&self, lasting: [u32; 2]) -> ReservoirView {
        ReservoirView {
            history: (self.buffer.as_ref()).map_or(0, |(buffer, _)| buffer.address()),
            flags: if self.history {
                t::RESERVOIRS_HISTORY
            } else {
                0
            },
            lasting_triangles: lasting[0],
            lasting_spheres: lasting[1],
            padding: 0,
        }
    }

    /// Whether the frame reuses samples.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Records the passes of direct light, suns included.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        passes.run(Pass::ReservoirSamples)?;
        passes.run(Pass::ReservoirReuse)
    }

    /// Discards the reservoirs of the last frame: numbers of lights have changed.
    pub fn forget(&mut self) {
        self.history = false;
    }

    /// Ends the frame.
    pub fn advance(&mut self) {
        self.history = self.buffer.is_some();
    }
}
