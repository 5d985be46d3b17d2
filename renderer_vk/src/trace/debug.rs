//! `rt_debug`: a step of the traced look in place of the picture.

use super::passes::{TILE, dispatch};
use crate::gpu::{ComputePipeline, Device, Error, Recorder};

/// Names of the views, by their numbers in `rt_debug` from 1 on.
pub const DEBUG_VIEWS: [&str; 11] = [
    "albedo",
    "normals",
    "depth",
    "motion",
    "clusters",
    "lights per pixel",
    "samples",
    "variance",
    "gradients",
    "rays per pixel",
    "reflections",
];

/// Reads the G-buffer and what the passes count; writes the view's rectangle of the target.
pub struct DebugView(ComputePipeline);

impl DebugView {
    /// Compiles the pipeline.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn new(device: &Device) -> Result<Self, Error> {
        let shader = &shaders::TRACE_DEBUG_COMP;
        let pipeline = ComputePipeline::new(device, "trace_debug", shader, &[])?;
        Ok(Self(pipeline))
    }

    /// Records the pass. `view`: device address of the `TraceView`; `size`: its pixels.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, rec: &mut Recorder, view: u64, size: [u32; 2]) -> Result<(), Error> {
        dispatch(rec, "trace_debug", &self.0, view, size, [TILE; 2])
    }
}
