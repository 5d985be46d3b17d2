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

/// Reads the G-buffer and what the passes count; writes the view's rectangle of the target. Its pipeline is compiled
/// when it is first asked for.
#[derive(Default)]
pub struct DebugView(Option<ComputePipeline>);

impl DebugView {
    /// Records the pass. `view`: device address of the `TraceView`; `size`: its pixels.
    ///
    /// # Errors
    /// The driver refuses the pipeline; out of memory.
    pub fn record(
        &mut self,
        device: &Device,
        rec: &mut Recorder,
        view: u64,
        size: [u32; 2],
    ) -> Result<(), Error> {
        let pipeline = match &self.0 {
            Some(pipeline) => pipeline,
            None => {
                let shader = &shaders::TRACE_DEBUG_COMP;
                self.0
                    .insert(ComputePipeline::new(device, "trace_debug", shader, &[])?)
            }
        };
        dispatch(rec, "trace_debug", pipeline, view, size, [TILE; 2])
    }
}
