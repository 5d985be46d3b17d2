//! A pass: records bindings and dispatches. Draw commands are in `draw`, copies in `copy`.

use ash::vk;
use bytemuck::Pod;

use super::arena::UploadArena;
use super::bindless::PUSH_BYTES;
use super::buffer::Buffer;
use super::device::{Device, lock};
use super::draw::Attachments;
use super::dynamic_state::DynamicState;
use super::pipeline::{ComputePipeline, GraphicsPipeline};
use super::ray_tracing::{RayTracingPipeline, SbtRegions};
use super::recorder::Recorder;

/// A pass that is being recorded; see [`Recorder::pass`]. Invalid commands (a range outside of a buffer, a draw outside
/// of rendering) are omitted with a warning, so that the frame can continue.
pub struct Pass<'a> {
    pub(crate) rec: &'a mut Recorder,
    query: Option<(vk::QueryPool, u32)>,
    /// Size of the attachments during rendering.
    pub(crate) rendering: Option<vk::Extent2D>,
    /// Rendering may continue in the next pass.
    pub(crate) stays_open: Option<Attachments>,
    rays: Option<SbtRegions>,
    pub(crate) bound: Bound,
}

/// Bound pipelines.
#[derive(Clone, Copy, Default)]
pub(crate) struct Bound {
    /// The graphics pipeline, and the last recorded dynamic state.
    pub graphics: Option<(vk::Pipeline, DynamicState)>,
    /// Work group size of the compute pipeline.
    compute: Option<[u32; 3]>,
    /// The bind point of the last binding of the descriptor set.
    set: Option<vk::PipelineBindPoint>,
}

impl<'a> Pass<'a> {
    pub(crate) fn new(rec: &'a mut Recorder, query: Option<(vk::QueryPool, u32)>) -> Self {
        Self {
            rec,
            query,
            rendering: None,
            stays_open: None,
            rays: None,
            bound: Bound::default(),
        }
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.rec.device
    }

    /// Memory for data of this frame.
    pub fn arena(&mut self) -> &mut UploadArena {
        self.rec.arena()
    }

    pub(crate) fn recorder(&mut self) -> &mut Recorder {
        self.rec
    }

    pub(crate) fn vk(&self) -> &ash::Device {
        self.rec.device.vk()
    }

    pub(crate) fn cmd(&self) -> vk::CommandBuffer {
        self.rec.cmd
    }

    fn bind(&mut self, point: vk::PipelineBindPoint, pipeline: vk::Pipeline) {
        // SAFETY: recording; the pipeline is alive (the graveyard keeps it for this frame).
        unsafe { self.vk().cmd_bind_pipeline(self.cmd(), point, pipeline) };
        // All pipelines have the same layout, so the descriptor set stays bound.
        if self.bound.set.replace(point) == Some(point) {
            return;
        }
        let bindless = &self.rec.device.0.bindless;
        // SAFETY: every pipeline has this layout; the set is update-after-bind.
        unsafe {
            self.vk().cmd_bind_descriptor_sets(
                self.cmd(),
                point,
                bindless.pipeline_layout,
                0,
                &[bindless.set],
                &[],
            );
        }
    }

    /// Binds a pipeline for subsequent draws.
    pub fn bind_graphics(&mut self, pipeline: &GraphicsPipeline) {
        let (raw, state) = (pipeline.raw(), pipeline.state());
        let before = self.bound.graphics.replace((raw, state));
        if before.map(|(raw, _)| raw) != Some(raw) {
            self.bind(vk::PipelineBindPoint::GRAPHICS, raw);
        }
        if let Some(commands) = &self.rec.device.0.dynamic_state {
            commands.record(self.cmd(), state, before.map(|(_, state)| state));
        }
    }

    /// Binds a pipeline for subsequent dispatches.
    pub fn bind_compute(&mut self, pipeline: &ComputePipeline) {
        self.bind(vk::PipelineBindPoint::COMPUTE, pipeline.raw());
        self.bound.compute = Some(pipeline.local_size());
    }

    /// Binds a pipeline for subsequent ray launches.
    pub fn bind_rays(&mut self, pipeline: &RayTracingPipeline) {
        self.bind(vk::PipelineBindPoint::RAY_TRACING_KHR, pipeline.raw());
        self.rays = Some(pipeline.regions());
    }

    /// Sets the push constants from offset 0, for all stages; at most 128 bytes, a multiple of 4.
    pub fn push<T: Pod>(&mut self, constants: &T) {
        let bytes = bytemuck::bytes_of(constants);
        if bytes.len() > PUSH_BYTES as usize || !bytes.len().is_multiple_of(4) || bytes.is_empty() {
            self.refuse(&format!(
                "push constants of {} bytes (a multiple of 4 up to {PUSH_BYTES} is possible)",
                bytes.len()
            ));
            return;
        }
        let layout = self.rec.device.0.bindless.pipeline_layout;
        // SAFETY: the layout has 128 bytes for all stages, the size was checked.
        unsafe {
            self.vk()
                .cmd_push_constants(self.cmd(), layout, vk::ShaderStageFlags::ALL, 0, bytes);
        }
    }

    /// A full barrier within the pass: all earlier commands complete, and their writes are visible to all later ones.
    pub fn barrier(&mut self) {
        self.end_rendering();
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        self.record_barrier(&memory, &[]);
    }

    /// Records a barrier outside of a render pass; images must have the old layouts of their barriers.
    pub(crate) fn record_barrier(
        &self,
        memory: &[vk::MemoryBarrier<'_>],
        images: &[vk::ImageMemoryBarrier<'_>],
    ) {
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let none = vk::DependencyFlags::empty();
        // SAFETY: recording, outside of a render pass; the callers ensure the layouts.
        unsafe {
            self.vk()
                .cmd_pipeline_barrier(self.cmd(), all, all, none, memory, &[], images);
        }
    }

    /// Dispatches work groups.
    pub fn dispatch(&mut self, x: u32, y: u32, z: u32) {
        self.end_rendering();
        if self.bound.compute.is_none() {
            self.refuse("a dispatch without pipeline");
        } else if x > 0 && y > 0 && z > 0 {
            // SAFETY: a compute pipeline is bound, outside of a render pass.
            unsafe { self.vk().cmd_dispatch(self.cmd(), x, y, z) };
        }
    }

    /// Dispatches the work groups for at least this many invocations.
    pub fn dispatch_invocations(&mut self, x: u32, y: u32) {
        let [width, height, _] = self.bound.compute.unwrap_or([1; 3]);
        self.dispatch(x.div_ceil(width), y.div_ceil(height), 1);
    }

    /// Dispatches work groups by three 32-bit counts in a buffer.
    pub fn dispatch_indirect(&mut self, buffer: &Buffer, offset: u64) {
        self.end_rendering();
        if self.bound.compute.is_none() || buffer.check(offset, 12).is_err() {
            self.refuse("an indirect dispatch without pipeline or parameters");
            return;
        }
        // SAFETY: a compute pipeline is bound, the parameters lie inside the buffer.
        unsafe {
            self.vk()
                .cmd_dispatch_indirect(self.cmd(), buffer.0.raw, offset);
        }
    }

    /// Launches ray generation shaders.
    pub fn trace_rays(&mut self, width: u32, height: u32, depth: u32) {
        self.end_rendering();
        let (Some(functions), Some(regions)) = (&self.rec.device.0.ray_tracing, &self.rays) else {
            self.refuse("a ray launch without pipeline");
            return;
        };
        if width > 0 && height > 0 && depth > 0 {
            // SAFETY: the pipeline that the regions belong to is bound.
            unsafe {
                functions.cmd_trace_rays(
                    self.cmd(),
                    &regions.raygen,
                    &regions.miss,
                    &regions.hit,
                    &vk::StridedDeviceAddressRegionKHR::default(),
                    width,
                    height,
                    depth,
                );
            }
        }
    }
    /// Logs that a command was omitted; each message once, because frames repeat.
    pub(crate) fn refuse(&self, what: &str) {
        if lock(&self.rec.device.0.refused).insert(what.to_owned()) {
            log::warn!("GPU command omitted: {what}");
        }
    }
}
impl Drop for Pass<'_> {
    fn drop(&mut self) {
        match self.stays_open {
            Some(attachments) if self.rendering.is_some() => self.rec.open = Some(attachments),
            _ => self.end_rendering(),
        }
        if let Some((pool, query)) = self.query {
            // SAFETY: the query is reset by the command buffer that runs before this one.
            unsafe {
                self.vk().cmd_write_timestamp(
                    self.cmd(),
                    vk::PipelineStageFlags::BOTTOM_OF_PIPE,
                    pool,
                    query + 1,
                );
            }
        }
        if let Some(debug) = &self.rec.device.0.debug {
            // SAFETY: the label was opened by `Recorder::pass`.
            unsafe { debug.cmd_end_debug_utils_label(self.cmd()) };
        }
    }
}
