//! Properties of a swapchain, chosen from what the window system offers.

use ash::vk;

use crate::gpu::window_format::Encoding;

/// Parameters of a [`Swapchain`](super::Swapchain).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SwapchainDesc {
    /// Width, pixels, unless the window system dictates the size.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Waits for vertical blank.
    pub vsync: bool,
    /// Encodings of more than white that are wanted, the best first.
    pub wide: &'static [Encoding],
}

impl SwapchainDesc {
    pub(super) fn present_mode(&self, offered: &[vk::PresentModeKHR]) -> vk::PresentModeKHR {
        let unsynchronized = [vk::PresentModeKHR::IMMEDIATE, vk::PresentModeKHR::MAILBOX];
        let found = unsynchronized.into_iter().find(|m| offered.contains(m));
        found
            .filter(|_| !self.vsync)
            .unwrap_or(vk::PresentModeKHR::FIFO)
    }

    /// Size of the images.
    pub(super) fn extent(&self, caps: &vk::SurfaceCapabilitiesKHR) -> vk::Extent2D {
        let (least, most) = (caps.min_image_extent, caps.max_image_extent);
        // This value means that the swapchain determines the size.
        if caps.current_extent.width != u32::MAX {
            return caps.current_extent;
        }
        vk::Extent2D {
            width: self.width.max(least.width).min(most.width),
            height: self.height.max(least.height).min(most.height),
        }
    }
}

/// Three images, or one more than the window system's minimum.
pub(super) fn image_count(caps: &vk::SurfaceCapabilitiesKHR) -> u32 {
    let count = caps.min_image_count.saturating_add(1).max(3);
    match caps.max_image_count {
        // no maximum
        0 => count,
        most => count.min(most),
    }
}

/// Opaque if the window system supports it.
pub(super) fn composite_alpha(caps: &vk::SurfaceCapabilitiesKHR) -> vk::CompositeAlphaFlagsKHR {
    [
        vk::CompositeAlphaFlagsKHR::OPAQUE,
        vk::CompositeAlphaFlagsKHR::INHERIT,
        vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
        vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED,
    ]
    .into_iter()
    .find(|a| caps.supported_composite_alpha.contains(*a))
    .unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE)
}
