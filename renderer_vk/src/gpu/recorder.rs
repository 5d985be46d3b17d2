//! Recording of command buffers; passes are the only way to record work.

use std::ffi::CStr;

use ash::vk;

use super::access::{Access, pass_barrier};
use super::arena::UploadArena;
use super::buffer::{Buffer, BufferDesc, BufferUsage, Memory};
use super::device::{Device, lock};
use super::draw::{Attachments, Rendering};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::image::Image;
use super::pass::Pass;
use super::timers::Timers;
use super::upload;

/// Maximum length of a pass's name in captures, bytes, with the terminating NUL.
const LABEL: usize = 64;

/// A name as a C string, truncated to `place`; `None` with a NUL inside.
fn label<'a>(name: &str, place: &'a mut [u8; LABEL]) -> Option<&'a CStr> {
    let length = name.floor_char_boundary(LABEL - 1);
    let (text, end) = place.split_at_mut_checked(length)?;
    text.copy_from_slice(name.as_bytes().get(..length)?);
    *end.first_mut()? = 0;
    CStr::from_bytes_with_nul(place.get(..=length)?).ok()
}

/// Command pool and buffers of one slot, reused.
pub(crate) struct SlotResources {
    device: Device,
    pool: vk::CommandPool,
    pub main: vk::CommandBuffer,
    pub before: vk::CommandBuffer,
    pub arena: UploadArena,
    pub timers: Timers,
    pub scratch: Option<Buffer>,
}

impl SlotResources {
    pub fn new(device: &Device) -> Result<Self, Error> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.0.queue_family);
        // SAFETY: the family is the one of the device's queue.
        let pool = unsafe { device.vk().create_command_pool(&info, None) }
            .context("vkCreateCommandPool")?;
        let mut slot = Self {
            device: device.clone(),
            pool,
            main: vk::CommandBuffer::null(),
            before: vk::CommandBuffer::null(),
            arena: UploadArena::new(device),
            timers: Timers::new(device),
            scratch: None,
        };
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(2);
        // SAFETY: the pool was just made.
        let buffers = unsafe { device.vk().allocate_command_buffers(&info) }
            .context("vkAllocateCommandBuffers")?;
        if let [before, main] = buffers[..] {
            slot.before = before;
            slot.main = main;
        }
        Ok(slot)
    }

    /// Begins the main command buffer of the frame with this serial number; the GPU has finished the last use of the
    /// slot.
    pub fn restart(&mut self, frame: u64) -> Result<(), Error> {
        let vk = self.device.vk();
        // SAFETY: no command buffer of the pool is pending.
        unsafe { vk.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .context("vkResetCommandPool")?;
        self.arena.reset();
        self.timers.restart(frame);
        begin(&self.device, self.main)
    }

    /// Records uploads and query resets into the command buffer that is submitted before the main one.
    pub fn record_before(&self, pending: &mut upload::Pending) -> Result<(), Error> {
        begin(&self.device, self.before)?;
        self.timers.reset(self.before);
        if !pending.is_empty() {
            upload::record(&self.device, self.before, pending);
        }
        // SAFETY: the buffer is being recorded.
        unsafe { self.device.vk().end_command_buffer(self.before) }.context("vkEndCommandBuffer")
    }

    /// Ends the main command buffer; with `host_reads`, all writes are visible to the CPU after the submission.
    pub fn finish(&self, host_reads: bool) -> Result<(), Error> {
        let vk = self.device.vk();
        if !host_reads {
            // SAFETY: the buffer is being recorded.
            return unsafe { vk.end_command_buffer(self.main) }.context("vkEndCommandBuffer");
        }
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ)];
        // SAFETY: recording, outside of a render pass (a `Pass` ends its own).
        unsafe {
            vk.cmd_pipeline_barrier(
                self.main,
                vk::PipelineStageFlags::ALL_COMMANDS,
                vk::PipelineStageFlags::HOST,
                vk::DependencyFlags::empty(),
                &memory,
                &[],
                &[],
            );
        }
        // SAFETY: the buffer is being recorded.
        unsafe { vk.end_command_buffer(self.main) }.context("vkEndCommandBuffer")
    }
}

impl Drop for SlotResources {
    fn drop(&mut self) {
        self.device.0.bury(Garbage::CommandPool(self.pool));
    }
}

fn begin(device: &Device, cmd: vk::CommandBuffer) -> Result<(), Error> {
    let info =
        vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the buffer is in its initial state.
    unsafe { device.vk().begin_command_buffer(cmd, &info) }.context("vkBeginCommandBuffer")
}

/// The swapchain image of a frame.
pub(crate) struct Acquired {
    pub image: Image,
    pub index: u32,
    pub available: vk::Semaphore,
    pub finished: vk::Semaphore,
}

/// While it exists, a frame is being recorded.
pub(crate) struct Recording(pub Device);

impl Drop for Recording {
    fn drop(&mut self) {
        // No effect after a submission; the objects of a dropped frame are retagged with earlier frames.
        let pending = !lock(&self.0.0.pending).is_empty();
        let mut state = lock(&self.0.0.state);
        state.recording = false;
        state.retag(pending);
    }
}

/// Recorder of a frame or of immediate work. Dropping a frame's recorder without ending it discards the frame.
pub struct Recorder {
    pub(crate) device: Device,
    pub(crate) cmd: vk::CommandBuffer,
    pub(crate) slot: SlotResources,
    pub(crate) acquired: Option<Acquired>,
    /// Index in the ring; `None` for immediate work.
    pub(crate) ring_slot: Option<usize>,
    pub(crate) serial: u64,
    pub(crate) finished: u64,
    /// Open attachments, if rendering may continue in the next pass; see [`Recorder::drawing`].
    pub(crate) open: Option<Attachments>,
    /// A pass wrote data that the CPU reads after the frame.
    pub(crate) host_reads: bool,
    /// Semaphore for the acquisition of this frame's swapchain image.
    pub(crate) available: Option<vk::Semaphore>,
    // Last, so that the slot of a discarded frame is buried as part of that frame.
    pub(crate) recording: Option<Recording>,
}

impl Recorder {
    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Number of this frame: the first of a ring has 1, immediate work 0.
    pub fn serial(&self) -> u64 {
        self.serial
    }

    /// The newest frame that the GPU had finished when this one began; 0: none.
    pub fn finished(&self) -> u64 {
        self.finished
    }

    /// Memory for data of this frame.
    pub fn arena(&mut self) -> &mut UploadArena {
        &mut self.slot.arena
    }

    /// Begins a pass: waits for all earlier work, makes its writes visible to the stages in `reads` and `writes`, opens
    /// a debug label and writes a timestamp. Dropping the returned guard ends the pass.
    /// # Errors
    /// Out of memory for timestamps.
    pub fn pass(&mut self, name: &str, reads: Access, writes: Access) -> Result<Pass<'_>, Error> {
        self.close_drawing();
        self.host_reads |= (reads | writes).reaches_host();
        self.begin_pass(name, Some((reads, writes)))
    }

    /// Begins a pass that draws to attachments. If the previous pass drew to the same ones, it continues without a
    /// barrier: both draw in order, and the pass must not read other results of the previous one. Software drivers
    /// finish all drawing at each barrier, and GPUs drain their pipeline.
    ///
    /// # Errors
    /// Those of [`pass`](Self::pass) and [`Pass::begin_rendering`].
    pub fn drawing(&mut self, name: &str, target: &Rendering<'_>) -> Result<Pass<'_>, Error> {
        let attachments = Attachments::of(target);
        let clears = target.clear_color.is_some() || target.clear_depth.is_some();
        if clears || !self.goes_on(target) {
            let mut pass = self.pass(name, Access::GRAPHICS, Access::GRAPHICS)?;
            pass.begin_rendering(target)?;
            pass.stays_open = Some(attachments);
            return Ok(pass);
        }
        let mut pass = self.begin_pass(name, None)?;
        pass.go_on(attachments);
        Ok(pass)
    }

    /// Whether a [`drawing`](Self::drawing) to `target` without clears continues the previous pass.
    pub fn goes_on(&self, target: &Rendering<'_>) -> bool {
        self.open == Some(Attachments::of(target))
    }

    /// Ends rendering that a [`drawing`](Self::drawing) left open.
    pub(crate) fn close_drawing(&mut self) {
        if self.open.take().is_some() {
            // SAFETY: a render pass is open.
            unsafe { self.device.vk().cmd_end_render_pass(self.cmd) };
        }
    }

    fn begin_pass(
        &mut self,
        name: &str,
        access: Option<(Access, Access)>,
    ) -> Result<Pass<'_>, Error> {
        let query = match self.ring_slot {
            Some(_) => self.slot.timers.begin(name)?,
            None => None,
        };
        let mut place = [0; LABEL];
        if let Some(debug) = &self.device.0.debug
            && let Some(label) = label(name, &mut place)
        {
            let info = vk::DebugUtilsLabelEXT::default().label_name(label);
            // SAFETY: the command buffer is being recorded.
            unsafe { debug.cmd_begin_debug_utils_label(self.cmd, &info) };
        }
        let abilities = self.device.0.abilities;
        let barrier = access.and_then(|(reads, writes)| pass_barrier(abilities, reads, writes));
        if let Some((stages, memory)) = barrier {
            // SAFETY: recording outside of a render pass; the stages belong to extensions that are on.
            unsafe {
                self.device.vk().cmd_pipeline_barrier(
                    self.cmd,
                    vk::PipelineStageFlags::ALL_COMMANDS,
                    stages,
                    vk::DependencyFlags::empty(),
                    &[memory],
                    &[],
                    &[],
                );
            }
        }
        if let Some((pool, query)) = query {
            // SAFETY: the query is reset by the command buffer that runs before this one.
            unsafe {
                self.device.vk().cmd_write_timestamp(
                    self.cmd,
                    vk::PipelineStageFlags::BOTTOM_OF_PIPE,
                    pool,
                    query,
                );
            }
        }
        Ok(Pass::new(self, query))
    }

    /// Scratch memory for acceleration structure builds of this frame.
    pub(crate) fn scratch(&mut self, size: u64) -> Result<Buffer, Error> {
        if let Some(buffer) = &self.slot.scratch
            && buffer.size() >= size
        {
            return Ok(buffer.clone());
        }
        let buffer = Buffer::new(
            &self.device,
            &BufferDesc {
                name: "acceleration structure scratch",
                size: size.max(1 << 20),
                usage: BufferUsage::STORAGE,
                memory: Memory::Device,
            },
        )?;
        self.slot.scratch = Some(buffer.clone());
        Ok(buffer)
    }
}

impl Device {
    /// Records work, submits it before the frame being recorded, and waits for it. Pending uploads run first. For
    /// loading and tests.
    ///
    /// # Errors
    /// Those of `record`, out of memory, device loss.
    pub fn immediate<T>(
        &self,
        record: impl FnOnce(&mut Recorder) -> Result<T, Error>,
    ) -> Result<T, Error> {
        lock(&self.0.state).immediates += 1;
        let result = self.run_immediate(record);
        {
            let pending = !lock(&self.0.pending).is_empty();
            let mut state = lock(&self.0.state);
            state.immediates -= 1;
            state.retag(pending);
        }
        self.0.collect()?;
        result
    }

    fn run_immediate<T>(
        &self,
        record: impl FnOnce(&mut Recorder) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let mut slot = SlotResources::new(self)?;
        slot.restart(0)?;
        let mut recorder = Recorder {
            device: self.clone(),
            cmd: slot.main,
            slot,
            acquired: None,
            ring_slot: None,
            serial: 0,
            finished: 0,
            open: None,
            host_reads: true,
            available: None,
            recording: None,
        };
        let value = record(&mut recorder)?;
        recorder.close_drawing();
        let slot = recorder.slot;
        slot.finish(true)?;
        let mut pending = std::mem::take(&mut *lock(&self.0.pending));
        let submitted = slot
            .record_before(&mut pending)
            .and_then(|()| self.submit(&[slot.before, slot.main]));
        self.0.put_back(pending, submitted.is_ok());
        self.wait_for(submitted?)?;
        Ok(value)
    }

    /// Submits recorded buffers; the returned fence is signalled when the device has executed them.
    fn submit(&self, buffers: &[vk::CommandBuffer]) -> Result<vk::Fence, Error> {
        let vk = self.vk();
        // SAFETY: plain creation.
        let fence = unsafe { vk.create_fence(&vk::FenceCreateInfo::default(), None) }
            .context("vkCreateFence")?;
        let submits = [vk::SubmitInfo::default().command_buffers(buffers)];
        let queue = lock(&self.0.queue);
        // SAFETY: the buffers are recorded and pending nowhere else; the queue is held.
        let submitted = unsafe { vk.queue_submit(*queue, &submits, fence) };
        if submitted.is_err() {
            // SAFETY: the submission failed, so nothing uses the fence.
            unsafe { vk.destroy_fence(fence, None) };
        }
        submitted.context("vkQueueSubmit")?;
        Ok(fence)
    }

    /// Waits for a submission and destroys its fence.
    fn wait_for(&self, fence: vk::Fence) -> Result<(), Error> {
        let vk = self.vk();
        // SAFETY: the fence was submitted.
        let waited = unsafe { vk.wait_for_fences(&[fence], true, u64::MAX) };
        // The device may still execute the buffers, which the caller drops.
        let done = waited
            .context("vkWaitForFences")
            .or_else(|e| self.wait().and(Err(e)));
        // SAFETY: the execution is over, or the device is lost.
        unsafe { vk.destroy_fence(fence, None) };
        done
    }

    /// Reads a range of a buffer after all submitted work. Blocks.
    ///
    /// # Errors
    /// A range outside of the buffer, out of memory, device loss.
    pub fn read_buffer(&self, buffer: &Buffer, offset: u64, size: u64) -> Result<Vec<u8>, Error> {
        buffer.check(offset, size)?;
        let target = self.readback(size)?;
        self.immediate(|rec| {
            rec.pass("read_buffer", Access::TRANSFER, Access::TRANSFER)?
                .copy_buffer(buffer, offset, &target, 0, size);
            Ok(())
        })?;
        read_all(&target, size)
    }

    /// Reads level 0 of an image, rows from the top without padding, after all submitted work. Blocks.
    ///
    /// # Errors
    /// Out of memory, device loss.
    pub fn read_image(&self, image: &Image) -> Result<Vec<u8>, Error> {
        let size = image.format().bytes(image.width(), image.height());
        let target = self.readback(size)?;
        self.immediate(|rec| {
            rec.pass("read_image", Access::TRANSFER, Access::TRANSFER)?
                .copy_image_to_buffer(image, [0, 0, image.width(), image.height()], &target, 0);
            Ok(())
        })?;
        read_all(&target, size)
    }

    fn readback(&self, size: u64) -> Result<Buffer, Error> {
        Buffer::new(
            self,
            &BufferDesc {
                name: "read-back",
                size,
                usage: BufferUsage::TRANSFER,
                memory: Memory::Readback,
            },
        )
    }
}

fn read_all(buffer: &Buffer, size: u64) -> Result<Vec<u8>, Error> {
    let mut bytes = vec![0; usize::try_from(size).unwrap_or(0)];
    buffer.read(0, &mut bytes)?;
    Ok(bytes)
}
