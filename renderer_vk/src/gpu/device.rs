//! The device: all GPU objects are made from it and keep it alive.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::bindless::Bindless;
use super::dynamic_state::{DynamicStateCommands, Shared};
use super::error::{Context, Error};
use super::graveyard::{Garbage, SyncState};
use super::image::Format;
use super::instance::{Instance, SurfaceSource};
use super::pin::pin_drivers;
use super::pipeline_cache::{cache_from_bytes, cache_to_bytes};
use super::render_pass::{FramebufferKey, RenderPassKey};
use super::select::{self, Abilities, Choice, DeviceInfo};
use super::timers::FrameTimings;
use super::upload::Pending;

/// Parameters of a [`Device`].
#[derive(Clone, Debug)]
pub struct DeviceOptions {
    /// Application name for the driver.
    pub app_name: String,
    /// Enables the validation layer with synchronization validation.
    pub validation: bool,
    /// Part of the preferred device's name, or its index; `None`: the best device.
    pub prefer: Option<String>,
    /// `false`: disables ray tracing, for tests.
    pub allow_ray_tracing: bool,
    /// `true`: disables all optional features, for tests.
    pub required_only: bool,
    /// Result of [`Device::pipeline_cache_data`] in an earlier run; ignored if it is invalid or of another driver.
    pub pipeline_cache: Option<Vec<u8>>,
}

impl Default for DeviceOptions {
    fn default() -> Self {
        Self {
            app_name: "Relight".to_owned(),
            validation: false,
            prefer: None,
            allow_ray_tracing: true,
            required_only: false,
            pipeline_cache: None,
        }
    }
}

/// Bytes that are allocated from the driver at once, of memory that the CPU does not see and of other memory. A larger
/// object gets memory of its own, of its size: at 1920x1080 every image with four bytes a pixel. Blocks of 64 MB were
/// up to a quarter empty.
const DEVICE_BLOCK: u64 = 8 << 20;
const HOST_BLOCK: u64 = 4 << 20;

/// Owner of the raw device, which it destroys after all other objects.
pub(crate) struct RawDevice {
    pub raw: ash::Device,
    pub instance: Instance,
}

impl Drop for RawDevice {
    fn drop(&mut self) {
        // SAFETY: every object of the device has been destroyed by `DeviceInner::drop`.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// The shared part of a [`Device`]. Field order is destruction order.
pub(crate) struct DeviceInner {
    pub allocator: Mutex<Option<Allocator>>,
    pub state: Mutex<SyncState>,
    pub pending: Mutex<Pending>,
    /// Few: one for each combination of attachments.
    pub framebuffers: Mutex<Vec<(FramebufferKey, vk::Framebuffer)>>,
    pub bindless: Bindless,
    pub render_passes: Mutex<HashMap<RenderPassKey, vk::RenderPass>>,
    pub pipeline_cache: vk::PipelineCache,
    pub shared_pipelines: Shared,
    /// Number of pipelines compiled so far.
    pub compiled: AtomicU64,
    /// Number of pipelines that exist.
    pub live_pipelines: AtomicU64,
    pub timeline: vk::Semaphore,
    pub timings: Mutex<FrameTimings>,
    /// Passes are timed.
    pub measuring: AtomicBool,
    pub refused: Mutex<HashSet<String>>,
    pub queue: Mutex<vk::Queue>,
    pub queue_family: u32,
    pub timestamp_mask: u64,
    pub timestamp_period: f32,
    pub abilities: Abilities,
    pub info: DeviceInfo,
    pub physical: vk::PhysicalDevice,
    pub acceleration: Option<khr::acceleration_structure::Device>,
    pub ray_tracing: Option<khr::ray_tracing_pipeline::Device>,
    pub swapchain: Option<khr::swapchain::Device>,
    pub present_wait: Option<khr::present_wait::Device>,
    pub dynamic_state: Option<DynamicStateCommands>,
    pub debug: Option<ext::debug_utils::Device>,
    pub core: RawDevice,
}

/// A Vulkan device with one queue. Clones share it; it is destroyed with the last object made from it.
#[derive(Clone)]
pub struct Device(pub(crate) Arc<DeviceInner>);

/// Locks a mutex, even after a panic of another holder: the data are plain lists.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes the first device of a list for which the driver does so.
fn create_first(instance: &Instance, choices: Vec<Choice>) -> Result<(Choice, ash::Device), Error> {
    let mut failed = Error::NoDevice("the list is empty".to_owned());
    for choice in choices {
        match select::create_device(instance, &choice) {
            Ok(raw) => return Ok((choice, raw)),
            Err(error) => {
                log::warn!("{} is not used: {error}", choice.info.name);
                failed = error;
            }
        }
    }
    Err(failed)
}

impl Device {
    /// Selects a device and initializes it.
    ///
    /// Required: Vulkan 1.2 with buffer device addresses, descriptor indexing, scalar block layout, timeline semaphores
    /// and 64-bit integers. Optional: ray tracing pipelines, ray queries, anisotropy, wireframe, BC textures.
    ///
    /// # Errors
    /// One message that names the missing item: the loader, the surface, or the features that each device lacks.
    pub fn new(options: &DeviceOptions, source: SurfaceSource<'_>) -> Result<Self, Error> {
        let instance = Instance::new(&options.app_name, options.validation, source)?;
        let (choice, raw) = create_first(&instance, select::choose(&instance, options)?)?;
        pin_drivers(raw.fp_v1_0().queue_submit);
        let core = RawDevice { raw, instance };
        let a = choice.abilities;
        let (vi, vd) = (&core.instance.raw, &core.raw);
        let mut inner = DeviceInner {
            allocator: Mutex::new(None),
            state: Mutex::new(SyncState::default()),
            pending: Mutex::new(Pending::default()),
            framebuffers: Mutex::new(Vec::new()),
            bindless: Bindless::default(),
            render_passes: Mutex::new(HashMap::new()),
            pipeline_cache: vk::PipelineCache::null(),
            shared_pipelines: Shared::default(),
            compiled: AtomicU64::new(0),
            live_pipelines: AtomicU64::new(0),
            timeline: vk::Semaphore::null(),
            timings: Mutex::new(FrameTimings::default()),
            measuring: AtomicBool::new(true),
            refused: Mutex::new(HashSet::new()),
            // SAFETY: the device was made with one queue of this family.
            queue: Mutex::new(unsafe { vd.get_device_queue(choice.queue_family, 0) }),
            queue_family: choice.queue_family,
            timestamp_mask: match choice.timestamp_bits {
                0 => 0,
                64.. => u64::MAX,
                bits => (1 << bits) - 1,
            },
            timestamp_period: choice.timestamp_period,
            abilities: a,
            physical: choice.physical,
            acceleration: a
                .acceleration
                .then(|| khr::acceleration_structure::Device::new(vi, vd)),
            ray_tracing: a
                .pipeline
                .then(|| khr::ray_tracing_pipeline::Device::new(vi, vd)),
            swapchain: core
                .instance
                .surface
                .is_some()
                .then(|| khr::swapchain::Device::new(vi, vd)),
            present_wait: a
                .present_wait
                .then(|| khr::present_wait::Device::new(vi, vd)),
            dynamic_state: a.dynamic_state.then(|| DynamicStateCommands::new(vi, vd)),
            debug: select::debug_utils(&core.instance, vd),
            info: choice.info,
            core,
        };
        inner.init(options)?;
        log::info!(
            "Vulkan device {} ({}), ray tracing pipeline: {}, ray query: {}",
            inner.info.name,
            inner.info.driver.trim(),
            inner.info.ray_tracing.is_some(),
            inner.info.ray_query
        );
        Ok(Self(Arc::new(inner)))
    }

    /// Name, limits and features of the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.0.info
    }

    /// Switches timing of passes in subsequent frames; initially on. Software drivers finish all drawing at each
    /// timestamp.
    pub fn measure(&self, on: bool) {
        self.0.measuring.store(on, Ordering::Relaxed);
    }

    /// GPU milliseconds of each pass of the newest finished frame, in order of recording. Empty if the device has no
    /// timestamps.
    pub fn timings(&self) -> Vec<(String, f32)> {
        lock(&self.0.timings).passes.clone()
    }

    /// Serial number of the frame that [`timings`](Self::timings) is of, as [`Recorder::serial`] counts; 0: of none.
    ///
    /// [`Recorder::serial`]: super::Recorder::serial
    pub fn timed_frame(&self) -> u64 {
        lock(&self.0.timings).frame
    }

    /// All messages of the validation layer since the device was made.
    pub fn validation_messages(&self) -> Vec<String> {
        lock(&self.0.core.instance.messages).clone()
    }

    /// Runs pending uploads, waits until the device is idle and frees all buried objects. Not for use within a frame.
    ///
    /// # Errors
    /// Device loss.
    pub fn wait_idle(&self) -> Result<(), Error> {
        if !lock(&self.0.pending).is_empty() {
            self.immediate(|_| Ok(()))?;
        }
        self.wait()?;
        self.0.collect()?;
        let spare = lock(&self.0.pending).take_spare();
        for (buffer, memory) in spare {
            self.0.destroy(Garbage::Buffer(buffer, memory));
        }
        Ok(())
    }

    /// Waits for all submitted work.
    pub(crate) fn wait(&self) -> Result<(), Error> {
        self.0.idle()
    }

    /// The driver's pipeline cache, for [`DeviceOptions::pipeline_cache`] of a later run.
    ///
    /// # Errors
    /// Those of `vkGetPipelineCacheData`.
    pub fn pipeline_cache_data(&self) -> Result<Vec<u8>, Error> {
        // SAFETY: the cache belongs to this live device.
        let data = unsafe {
            self.0
                .core
                .raw
                .get_pipeline_cache_data(self.0.pipeline_cache)
        }
        .context("vkGetPipelineCacheData")?;
        Ok(cache_to_bytes(&data))
    }

    /// Number of dropped objects that wait for frames which may use them.
    pub fn graveyard_len(&self) -> usize {
        lock(&self.0.state).graveyard.len()
    }

    /// Number of descriptors written so far: one per image view, sampler and scene; drawing writes none.
    pub fn descriptor_writes(&self) -> u64 {
        self.0.bindless.writes.load(Ordering::Relaxed)
    }

    /// Number of pipelines compiled so far.
    pub fn compiled_pipelines(&self) -> u64 {
        self.0.compiled.load(Ordering::Relaxed)
    }

    /// Number of pipelines that exist.
    pub fn live_pipelines(&self) -> u64 {
        self.0.live_pipelines.load(Ordering::Relaxed)
    }

    /// Whether fragment shaders can write to buffers.
    pub fn fragment_stores(&self) -> bool {
        self.0.abilities.fragment_stores
    }

    /// The depth format: 24 bits, as the engine requests of OpenGL, if the device can render to it. Some GPUs clear and
    /// test it faster than floats. Every device supports one format of each kind.
    pub fn depth_format(&self, stencil: bool) -> Format {
        let (format, other) = match stencil {
            false => (Format::D24, Format::D32F),
            true => (Format::D24S8, Format::D32FS8),
        };
        let needed = vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT;
        if self.0.features(format).contains(needed) {
            format
        } else {
            other
        }
    }

    /// Whether the device can render to images of a colour or depth format.
    pub fn draws_to(&self, format: Format) -> bool {
        let needed = match format.aspect() == vk::ImageAspectFlags::COLOR {
            true => vk::FormatFeatureFlags::COLOR_ATTACHMENT,
            false => vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT,
        };
        self.0.features(format).contains(needed)
    }

    /// Whether the device can render to images of a colour or depth format with this number of samples.
    pub fn supports_samples(&self, format: Format, samples: u32) -> bool {
        let usage = if format.aspect() == vk::ImageAspectFlags::COLOR {
            vk::ImageUsageFlags::COLOR_ATTACHMENT
                | vk::ImageUsageFlags::TRANSFER_SRC
                | vk::ImageUsageFlags::TRANSFER_DST
        } else {
            vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
        };
        // SAFETY: the physical device belongs to the live instance. An error means that the format does not support
        // this usage.
        let properties = unsafe {
            self.0
                .core
                .instance
                .raw
                .get_physical_device_image_format_properties(
                    self.0.physical,
                    format.vk(),
                    vk::ImageType::TYPE_2D,
                    vk::ImageTiling::OPTIMAL,
                    usage,
                    vk::ImageCreateFlags::empty(),
                )
        };
        samples.is_power_of_two()
            && properties.is_ok_and(|p| {
                p.sample_counts
                    .contains(vk::SampleCountFlags::from_raw(samples))
            })
    }

    /// The raw device functions.
    pub(crate) fn vk(&self) -> &ash::Device {
        &self.0.core.raw
    }
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Device({})", self.0.info.name)
    }
}

impl DeviceInner {
    /// Waits for all submitted work. A wait that fails for want of memory has not waited, and what the caller destroys
    /// next may be in use: the only queue is then waited for by another call.
    fn idle(&self) -> Result<(), Error> {
        let queue = lock(&self.queue);
        // SAFETY: the queue is held, so nothing is submitted meanwhile.
        match unsafe { self.core.raw.device_wait_idle() } {
            Ok(()) => Ok(()),
            Err(vk::Result::ERROR_DEVICE_LOST) => Err(Error::DeviceLost("vkDeviceWaitIdle")),
            // SAFETY: as above.
            Err(_) => unsafe { self.core.raw.queue_wait_idle(*queue) }.context("vkQueueWaitIdle"),
        }
    }

    /// Makes objects that need the device; on an error, dropping `self` destroys those already made.
    fn init(&mut self, options: &DeviceOptions) -> Result<(), Error> {
        let raw = &self.core.raw;
        *lock(&self.allocator) = Some(
            Allocator::new(&AllocatorCreateDesc {
                instance: self.core.instance.raw.clone(),
                device: raw.clone(),
                physical_device: self.physical,
                debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
                buffer_device_address: true,
                allocation_sizes: gpu_allocator::AllocationSizes::new(DEVICE_BLOCK, HOST_BLOCK),
            })
            .map_err(|e| Error::OutOfMemory {
                what: "the memory allocator".to_owned(),
                bytes: 0,
                reason: e.to_string(),
            })?,
        );
        let mut kind = vk::SemaphoreTypeCreateInfo::default()
            .semaphore_type(vk::SemaphoreType::TIMELINE)
            .initial_value(0);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the timelineSemaphore feature is on.
        self.timeline =
            unsafe { raw.create_semaphore(&info, None) }.context("vkCreateSemaphore")?;
        // A missing or damaged cache starts empty.
        let old = options
            .pipeline_cache
            .as_deref()
            .and_then(cache_from_bytes)
            .unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(old);
        // SAFETY: the data are a cache as a driver wrote it (checked by a hash); a driver that did not write them
        // ignores them by their header.
        self.pipeline_cache =
            unsafe { raw.create_pipeline_cache(&info, None) }.context("vkCreatePipelineCache")?;
        self.bindless.init(raw, &self.info, self.abilities)?;
        self.name(self.timeline, "frame timeline");
        Ok(())
    }

    /// Features of a format with optimal tiling.
    pub fn features(&self, format: Format) -> vk::FormatFeatureFlags {
        // SAFETY: the physical device belongs to the live instance.
        unsafe {
            self.core
                .instance
                .raw
                .get_physical_device_format_properties(self.physical, format.vk())
        }
        .optimal_tiling_features
    }

    /// Sets an object's name for validation messages and captures.
    pub fn name<T: vk::Handle>(&self, handle: T, name: &str) {
        // Without the extension names are of no use.
        let Some(debug) = &self.debug else { return };
        let Ok(name) = std::ffi::CString::new(name) else {
            debug_assert!(false, "{name:?} contains a NUL");
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(handle)
            .object_name(&name);
        // SAFETY: the handle is a live object of this device. A failure only loses the name.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    /// Keeps an object until no frame uses it, then destroys it.
    pub fn bury(&self, garbage: Garbage) {
        let pending = !lock(&self.pending).is_empty();
        let mut state = lock(&self.state);
        let tag = state.tag(pending);
        state.graveyard.push((tag, garbage));
    }

    /// The newest submission that the GPU has finished.
    ///
    /// # Errors
    /// Out of memory, device loss.
    pub fn finished(&self) -> Result<u64, Error> {
        // SAFETY: the timeline belongs to this device.
        unsafe { self.core.raw.get_semaphore_counter_value(self.timeline) }
            .context("vkGetSemaphoreCounterValue")
    }

    /// Destroys buried objects that no frame uses.
    pub fn collect(&self) -> Result<(), Error> {
        let mut dead = lock(&self.state).take_dead(self.finished()?);
        for garbage in dead.drain(..) {
            self.destroy(garbage);
        }
        lock(&self.state).dead = dead;
        Ok(())
    }

    /// Destroys one object. Only for objects that no submitted or open command buffer uses.
    fn destroy(&self, garbage: Garbage) {
        let raw = &self.core.raw;
        // SAFETY (each call below): the handle was made from this device, its owner is gone, and the frames that
        // could use it are over (`take_dead`, or an idle device).
        match garbage {
            Garbage::Buffer(buffer, memory) => {
                // SAFETY: see above.
                unsafe { raw.destroy_buffer(buffer, None) };
                self.free(memory);
            }
            Garbage::Staging(buffer, memory) => {
                if let Some((buffer, memory)) = lock(&self.pending).keep_spare(buffer, memory) {
                    self.destroy(Garbage::Buffer(buffer, memory));
                }
            }
            Garbage::Image(image, memory) => {
                // SAFETY: see above.
                unsafe { raw.destroy_image(image, None) };
                self.free(memory);
            }
            Garbage::View(view) => {
                // frames that could use the framebuffer could also use the view
                let mut framebuffers = lock(&self.framebuffers);
                for (_, made) in framebuffers.extract_if(.., |(key, _)| key.views.contains(&view)) {
                    // SAFETY: see above.
                    unsafe { raw.destroy_framebuffer(made, None) };
                }
                // SAFETY: see above.
                unsafe { raw.destroy_image_view(view, None) };
            }
            Garbage::Pipeline(p) => {
                self.live_pipelines.fetch_sub(1, Ordering::Relaxed);
                // SAFETY: see above.
                unsafe { raw.destroy_pipeline(p, None) }
            }
            // SAFETY: see above.
            Garbage::CommandPool(p) => unsafe { raw.destroy_command_pool(p, None) },
            // SAFETY: see above.
            Garbage::QueryPool(p) => unsafe { raw.destroy_query_pool(p, None) },
            // SAFETY: see above.
            Garbage::Semaphore(s) => unsafe { raw.destroy_semaphore(s, None) },
            Garbage::Acceleration(a) => {
                if let Some(functions) = &self.acceleration {
                    // SAFETY: see above.
                    unsafe { functions.destroy_acceleration_structure(a, None) };
                }
            }
            Garbage::Texture(index) => self.bindless.free_texture(index),
            Garbage::Storage(index) => self.bindless.free_storage(index),
            Garbage::Scene(index) => self.bindless.free_scene(index),
        }
    }
}

impl Drop for DeviceInner {
    fn drop(&mut self) {
        // On a lost device it fails, and destroying is allowed then, too.
        let _ = self.idle();
        let dead = std::mem::take(&mut lock(&self.state).graveyard);
        for (_, garbage) in dead {
            self.destroy(garbage);
        }
        let staging: Vec<_> = lock(&self.pending).take_staging().collect();
        for (buffer, memory) in staging {
            self.destroy(Garbage::Buffer(buffer, memory));
        }
        self.bindless.destroy(&self.core.raw);
        let raw = &self.core.raw;
        for (_, framebuffer) in lock(&self.framebuffers).drain(..) {
            // SAFETY: made from this idle device.
            unsafe { raw.destroy_framebuffer(framebuffer, None) };
        }
        for (_, pass) in lock(&self.render_passes).drain() {
            // SAFETY: made from this idle device.
            unsafe { raw.destroy_render_pass(pass, None) };
        }
        // SAFETY: made from this idle device, or null, which is allowed.
        unsafe { raw.destroy_pipeline_cache(self.pipeline_cache, None) };
        // SAFETY: as above.
        unsafe { raw.destroy_semaphore(self.timeline, None) };
        // The allocator logs what leaked and frees its blocks; it needs the device.
        drop(lock(&self.allocator).take());
    }
}
