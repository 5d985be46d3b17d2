//! The swapchain of the window.

mod choices;

use std::time::Duration;

use ash::vk;
use support::slice;

use super::device::{Device, lock};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::image::{Format, Image, layout_change};
use super::recorder::{Acquired, Recorder};
use super::window_format::{Encoding, WindowFormat};
pub use choices::SwapchainDesc;
use choices::{composite_alpha, image_count};

/// Timeout of image acquisition, nanoseconds. Window systems withhold images of invisible windows; the game continues
/// without presenting.
const PATIENCE: u64 = 500_000_000;

/// What is known of a presentation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presented {
    /// It is on the display, or was.
    Shown,
    /// It is not, at the end of the time to wait.
    NotYet,
    /// Cannot be observed: it belongs to an earlier swapchain, or is out of date.
    Unknown,
}

/// The images of the window, recreated when the window changes.
pub struct Swapchain {
    device: Device,
    desc: SwapchainDesc,
    raw: vk::SwapchainKHR,
    format: WindowFormat,
    images: Vec<(Image, vk::Semaphore)>,
    stale: bool,
    /// Presenting waits for vertical blank.
    synchronized: bool,
    /// Images can be targets of copies.
    copies: bool,
    /// Semaphore of an acquired image whose frame is not submitted yet.
    acquired: Option<vk::Semaphore>,
    /// Image of a submitted frame, to be presented before the next submission.
    put_off: Option<Submitted>,
    /// Presentation is deferred; see [`Swapchain::new`].
    late: bool,
    /// Number of images submitted so far: the number of the newest one's presentation.
    number: u64,
    /// Number of the first presentation that can be waited for: earlier ones belong to an earlier swapchain, or failed.
    first: u64,
}

/// The image of a submitted frame.
#[derive(Clone, Copy)]
pub(crate) struct Submitted {
    pub index: u32,
    /// Signalled when drawing is finished.
    pub finished: vk::Semaphore,
}

impl Swapchain {
    /// Makes the swapchain of the device's window. While the window is minimised, there are no images.
    ///
    /// On a software device, presenting waits until drawing has finished. Its images are therefore presented just
    /// before the next submission: meanwhile the game continues and the next frame is recorded.
    ///
    /// # Errors
    /// A headless device, a surface without a usable format, out of memory, a lost surface.
    pub fn new(device: &Device, desc: SwapchainDesc) -> Result<Self, Error> {
        let mut swapchain = Self {
            device: device.clone(),
            desc,
            raw: vk::SwapchainKHR::null(),
            format: WindowFormat::default(),
            images: Vec::new(),
            stale: true,
            synchronized: false,
            copies: false,
            acquired: None,
            put_off: None,
            late: false,
            number: 0,
            first: 1,
        };
        swapchain.format = swapchain.choose_format()?;
        swapchain.recreate()?;
        Ok(swapchain)
    }

    /// Format of the images: with [`Encoding::Srgb`] 8 bits per channel without conversion, red or blue first.
    pub fn format(&self) -> Format {
        self.format.texels
    }

    /// Encoding of the images.
    pub fn encoding(&self) -> Encoding {
        self.format.encoding
    }

    /// Whether images can be targets of copies in addition to attachments.
    pub fn copies(&self) -> bool {
        self.copies
    }

    /// Size of the images; zero while the window is minimised.
    #[cfg(test)]
    pub fn extent(&self) -> (u32, u32) {
        self.images
            .first()
            .map_or((0, 0), |(i, _)| (i.width(), i.height()))
    }

    /// Requests a new size or presentation mode, from the next acquisition on.
    pub fn resize(&mut self, width: u32, height: u32, vsync: bool) {
        let desc = SwapchainDesc {
            width,
            height,
            vsync,
            wide: self.desc.wide,
        };
        if desc != self.desc {
            self.desc = desc;
            self.stale = true;
        }
    }

    /// Acquires the next image for the frame. Call it just before the first pass that draws to the window: later passes
    /// wait for the window system. `None`: nothing can be presented now (minimised), and the frame continues without an
    /// image.
    ///
    /// # Errors
    /// Out of memory, a lost surface, device loss.
    pub fn acquire(&mut self, recorder: &mut Recorder) -> Result<Option<Image>, Error> {
        let Some(available) = recorder.available else {
            return Err(Error::Usage {
                name: "swapchain".to_owned(),
                what: "an image can only be taken for a frame".to_owned(),
            });
        };
        if let Some(acquired) = &recorder.acquired {
            return Ok(Some(acquired.image.clone()));
        }
        // A frame that was discarded after acquisition leaves its image acquired.
        if self.stale || self.acquired.is_some() {
            self.recreate()?;
        }
        let Some(functions) = self.device.0.swapchain.clone() else {
            return Ok(None);
        };
        // While a window is resized, a new swapchain may be out of date at once; then skip the frame.
        for _ in 0..2 {
            if self.images.is_empty() {
                return Ok(None);
            }
            // SAFETY: the semaphore is not pending: its last wait belongs to a frame that is over.
            let got = unsafe {
                functions.acquire_next_image(self.raw, PATIENCE, available, vk::Fence::null())
            };
            match got {
                Ok((index, suboptimal)) => {
                    self.stale = suboptimal;
                    let Some((image, finished)) = slice::get(&self.images, index as usize) else {
                        return Ok(None);
                    };
                    self.acquired = Some(available);
                    recorder.acquired = Some(Acquired {
                        image: image.clone(),
                        index,
                        available,
                        finished: *finished,
                    });
                    let image = image.clone();
                    recorder.close_drawing();
                    self.change_layout(
                        recorder,
                        &image,
                        vk::ImageLayout::UNDEFINED,
                        vk::ImageLayout::GENERAL,
                    );
                    return Ok(Some(image));
                }
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.recreate()?,
                // no image was acquired, so the semaphore is unused
                Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(None),
                Err(result) => return Err(result).context("vkAcquireNextImageKHR"),
            }
        }
        Ok(None)
    }

    /// Records the layout transition for presentation.
    pub(crate) fn prepare_present(&self, recorder: &mut Recorder) {
        recorder.close_drawing();
        if let Some(acquired) = &recorder.acquired {
            let image = acquired.image.clone();
            self.change_layout(
                recorder,
                &image,
                vk::ImageLayout::GENERAL,
                vk::ImageLayout::PRESENT_SRC_KHR,
            );
        }
    }

    /// Presents the image of a submitted frame, deferred or at once.
    pub(crate) fn submitted(&mut self, image: Submitted) -> Result<(), Error> {
        self.acquired = None;
        self.number += 1;
        self.put_off = Some(image);
        if self.late { Ok(()) } else { self.show() }
    }

    /// Presents a deferred image now, before a long operation.
    ///
    /// # Errors
    /// Out of memory, a lost surface, device loss.
    pub fn show(&mut self) -> Result<(), Error> {
        // Without the extension no image was acquired.
        let (Some(image), Some(functions)) = (self.put_off.take(), &self.device.0.swapchain) else {
            return Ok(());
        };
        let (waits, swapchains, indices) = ([image.finished], [self.raw], [image.index]);
        let numbers = [self.number];
        let mut number = vk::PresentIdKHR::default().present_ids(&numbers);
        let mut info = vk::PresentInfoKHR::default()
            .wait_semaphores(&waits)
            .swapchains(&swapchains)
            .image_indices(&indices);
        if self.device.0.present_wait.is_some() {
            info = info.push_next(&mut number);
        }
        let queue = lock(&self.device.0.queue);
        // SAFETY: the image was acquired from this swapchain, the frame that signals the semaphore was submitted, the
        // queue is held.
        match unsafe { functions.queue_present(*queue, &info) } {
            Ok(suboptimal) => self.stale |= suboptimal,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.stale = true;
                // it is never shown
                self.first = self.number + 1;
            }
            Err(result) => return Err(result).context("vkQueuePresentKHR"),
        }
        Ok(())
    }

    /// Number of the newest image's presentation; 0: there was none.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Whether [`wait_presented`](Self::wait_presented) can be called, and presenting waits for the display: without
    /// vertical synchronization a picture is shown once it is drawn, and window systems differ in what they report.
    pub fn observes_display(&self) -> bool {
        self.device.0.present_wait.is_some() && self.synchronized
    }

    /// Waits until the presentation of this number, or a later one, is on the display; at most `timeout`.
    ///
    /// # Errors
    /// Out of memory, a lost surface, device loss.
    pub fn wait_presented(&mut self, number: u64, timeout: Duration) -> Result<Presented, Error> {
        let Some(functions) = &self.device.0.present_wait else {
            return Ok(Presented::Unknown);
        };
        if number < self.first || number > self.number || self.raw == vk::SwapchainKHR::null() {
            return Ok(Presented::Unknown);
        }
        if number == self.number && self.put_off.is_some() {
            return Ok(Presented::NotYet);
        }
        let nanoseconds = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: the extension and its feature are on; presentations of this swapchain have ascending numbers; `self`
        // is borrowed, so that nothing else uses the swapchain.
        match unsafe { functions.wait_for_present(self.raw, number, nanoseconds) } {
            Ok(()) => Ok(Presented::Shown),
            Err(vk::Result::SUBOPTIMAL_KHR) => {
                self.stale = true;
                Ok(Presented::Shown)
            }
            Err(vk::Result::TIMEOUT) => Ok(Presented::NotYet),
            Err(
                vk::Result::ERROR_OUT_OF_DATE_KHR
                | vk::Result::ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT,
            ) => {
                self.stale = true;
                Ok(Presented::Unknown)
            }
            Err(result) => Err(result).context("vkWaitForPresentKHR"),
        }
    }

    fn change_layout(
        &self,
        recorder: &Recorder,
        image: &Image,
        from: vk::ImageLayout,
        to: vk::ImageLayout,
    ) {
        let barrier = layout_change(image.0.raw, vk::ImageAspectFlags::COLOR, from, to);
        // The same stages as the wait for the acquisition, so that this barrier is ordered after it.
        let stages =
            vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT | vk::PipelineStageFlags::TRANSFER;
        // SAFETY: recording outside of a render pass; the image is in the layout `from`.
        unsafe {
            self.device.vk().cmd_pipeline_barrier(
                recorder.cmd,
                stages,
                stages,
                vk::DependencyFlags::empty(),
                &[],
                &[],
                &[barrier],
            );
        }
    }

    fn surface(&self) -> Result<(&ash::khr::surface::Instance, vk::SurfaceKHR), Error> {
        self.device
            .0
            .core
            .instance
            .surface
            .as_ref()
            .map(|(functions, surface)| (functions, *surface))
            .ok_or_else(|| Error::Surface("the device was made without a window".to_owned()))
    }

    /// Selects a format of 8 bits per channel without conversion, because the picture is already display-encoded.
    fn choose_format(&self) -> Result<WindowFormat, Error> {
        let (functions, surface) = self.surface()?;
        // SAFETY: surface and physical device belong to the same live instance.
        let formats = unsafe {
            functions.get_physical_device_surface_formats(self.device.0.physical, surface)
        }
        .context("vkGetPhysicalDeviceSurfaceFormatsKHR")?;
        WindowFormat::choose(&formats, self.desc.wide).ok_or_else(|| {
            Error::Surface(format!(
                "the window offers no 8-bit UNORM format, only {:?}",
                formats.iter().map(|f| f.format).collect::<Vec<_>>()
            ))
        })
    }

    /// Recreates the swapchain for the present window; without images while it is minimised. Waits for the device,
    /// because Vulkan 1.2 does not report when the window system has released the old images.
    fn recreate(&mut self) -> Result<(), Error> {
        self.show()?;
        if let Some(available) = self.acquired.take() {
            self.swallow(available)?;
        }
        self.device.wait()?;
        let device = self.device.clone();
        let Some(swapchains) = &device.0.swapchain else {
            return Err(Error::Surface(
                "the device was made without a window".to_owned(),
            ));
        };
        self.forget_images();
        self.format = self.choose_format()?;
        let (functions, surface) = self.surface()?;
        // SAFETY: surface and physical device belong to the same live instance.
        let caps = unsafe {
            functions.get_physical_device_surface_capabilities(device.0.physical, surface)
        }
        .context("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
        // SAFETY: as above.
        let modes = unsafe {
            functions.get_physical_device_surface_present_modes(device.0.physical, surface)
        }
        .context("vkGetPhysicalDeviceSurfacePresentModesKHR")?;
        let extent = self.desc.extent(&caps);
        if extent.width == 0 || extent.height == 0 {
            // Minimised. The swapchain stays stale, so that the next acquisition tries again.
            self.stale = true;
            return Ok(());
        }
        let count = image_count(&caps);
        let mode = self.desc.present_mode(&modes);
        self.synchronized = mode == vk::PresentModeKHR::FIFO;
        let usage = (vk::ImageUsageFlags::COLOR_ATTACHMENT
            | vk::ImageUsageFlags::TRANSFER_DST
            | vk::ImageUsageFlags::TRANSFER_SRC)
            & caps.supported_usage_flags;
        self.copies = usage.contains(vk::ImageUsageFlags::TRANSFER_DST);
        let old = self.raw;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface)
            .min_image_count(count)
            .image_format(self.format.texels.vk())
            .image_color_space(self.format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(caps.current_transform)
            .composite_alpha(composite_alpha(&caps))
            .present_mode(mode)
            .clipped(true)
            .old_swapchain(old);
        // SAFETY: values are within the surface's capabilities; the old swapchain is retired by this.
        let made = unsafe { swapchains.create_swapchain(&info, None) };
        self.raw = vk::SwapchainKHR::null();
        // SAFETY: no reference to its images remains and the device is idle. Null is allowed.
        unsafe { swapchains.destroy_swapchain(old, None) };
        self.raw = made.context("vkCreateSwapchainKHR")?;
        self.first = self.number + 1;
        // one image is deferred while the next frame acquires another
        self.late = device.info().software && count > caps.min_image_count;
        device.0.name(self.raw, "swapchain");
        self.add_images(swapchains, extent)?;
        self.stale = false;
        Ok(())
    }

    /// Wraps the images of a new swapchain.
    fn add_images(
        &mut self,
        swapchains: &ash::khr::swapchain::Device,
        extent: vk::Extent2D,
    ) -> Result<(), Error> {
        let device = &self.device;
        // SAFETY: the swapchain was just made.
        let raw_images = unsafe { swapchains.get_swapchain_images(self.raw) }
            .context("vkGetSwapchainImagesKHR")?;
        for raw in raw_images {
            let (width, height) = (extent.width, extent.height);
            let image = Image::of_swapchain(
                device,
                raw,
                "swapchain image",
                width,
                height,
                self.format.texels,
            )?;
            // SAFETY: plain creation.
            let finished = unsafe {
                device
                    .vk()
                    .create_semaphore(&vk::SemaphoreCreateInfo::default(), None)
            }
            .context("vkCreateSemaphore")?;
            self.images.push((image, finished));
        }
        Ok(())
    }

    /// Consumes the signal of an acquisition whose frame was discarded, so that its semaphore can be reused.
    fn swallow(&self, available: vk::Semaphore) -> Result<(), Error> {
        let waits = [available];
        let stages = [vk::PipelineStageFlags::ALL_COMMANDS];
        let submits = [vk::SubmitInfo::default()
            .wait_semaphores(&waits)
            .wait_dst_stage_mask(&stages)];
        let queue = lock(&self.device.0.queue);
        // SAFETY: the acquisition signals the semaphore, and nothing else waits for it; the queue is held.
        unsafe {
            self.device
                .vk()
                .queue_submit(*queue, &submits, vk::Fence::null())
        }
        .context("vkQueueSubmit")
    }

    fn forget_images(&mut self) {
        for (image, finished) in self.images.drain(..) {
            drop(image);
            self.device.0.bury(Garbage::Semaphore(finished));
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        let over = match self.acquired.take() {
            Some(available) => self.swallow(available),
            None => Ok(()),
        };
        if let Err(e) = over.and_then(|()| self.device.wait()) {
            log::warn!("{e}");
        }
        self.forget_images();
        // The views of the images must be destroyed before the swapchain.
        if let Err(e) = self.device.0.collect() {
            log::warn!("{e}");
        }
        if let Some(functions) = &self.device.0.swapchain {
            // SAFETY: the device is idle. Null is allowed.
            unsafe { functions.destroy_swapchain(self.raw, None) };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::CString;

    use super::super::{Access, DeviceOptions, FrameRing, Rendering, SurfaceSource};
    use super::*;

    /// A device with a headless surface, or `None` with a report of a skipped test.
    fn device() -> Option<Device> {
        // SAFETY: the library is a Vulkan loader by its name.
        let entry = testkit::device(unsafe { ash::Entry::load() })?;
        let mut create = |raw: vk::Instance| {
            // SAFETY: the instance was just made by this loader.
            let instance = unsafe { ash::Instance::load(entry.static_fn(), raw) };
            let functions = ash::ext::headless_surface::Instance::new(&entry, &instance);
            let info = vk::HeadlessSurfaceCreateInfoEXT::default();
            // SAFETY: the extension is on.
            unsafe { functions.create_headless_surface(&info, None) }.map_err(|e| e.to_string())
        };
        let extensions = [ash::khr::surface::NAME, ash::ext::headless_surface::NAME]
            .map(CString::from)
            .to_vec();
        // SAFETY: `entry` is valid to the end of the process (see below); the surface is of the given instance.
        let source = unsafe {
            SurfaceSource::window(
                entry.static_fn().get_instance_proc_addr,
                extensions,
                &mut create,
            )
        };
        let options = DeviceOptions {
            validation: true,
            ..DeviceOptions::default()
        };
        // Not every driver supports headless surfaces: without one, the test is skipped even if a device is required.
        let device = Device::new(&options, source).map_err(testkit::skip).ok();
        // The device needs the loader until it is dropped.
        std::mem::forget(entry);
        device
    }

    #[test]
    fn frames_are_shown_through_resizes_and_thrown_away_frames() {
        let Some(device) = device() else { return };
        let mut ring = FrameRing::new(&device, 2).unwrap();
        let desc = SwapchainDesc {
            width: 64,
            height: 48,
            vsync: true,
            wide: &[],
        };
        let mut swapchain = Swapchain::new(&device, desc).unwrap();
        let mut shown = 0;
        for frame in 0..20u32 {
            if frame % 5 == 4 {
                swapchain.resize(64 + frame, 48, frame % 2 == 0);
            }
            let mut rec = ring.begin().unwrap();
            if let Some(image) = swapchain.acquire(&mut rec).unwrap() {
                assert_eq!(image.format(), swapchain.format());
                assert_eq!((image.width(), image.height()), swapchain.extent());
                let mut pass = rec
                    .pass("clear", Access::GRAPHICS, Access::GRAPHICS)
                    .unwrap();
                pass.begin_rendering(&Rendering {
                    color: Some(&image),
                    clear_color: Some([0.5; 4]),
                    ..Rendering::default()
                })
                .unwrap();
                shown += 1;
            }
            if frame == 7 {
                // An image that was acquired and never presented.
                drop(rec);
                continue;
            }
            ring.end_present(rec, &mut swapchain).unwrap();
        }
        assert_eq!(shown, 20);
        // A frame without an image is possible too.
        let rec = ring.begin().unwrap();
        ring.end_present(rec, &mut swapchain).unwrap();
        drop((swapchain, ring));
        device.wait_idle().unwrap();
        assert_eq!(device.graveyard_len(), 0);
        let messages = device.validation_messages();
        assert!(messages.is_empty(), "{messages:#?}");
    }
}
