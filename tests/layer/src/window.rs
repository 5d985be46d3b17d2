//! A window whose size changes: `RELIGHT_LAYER_SIZES` lists the sizes, `WIDTHxHEIGHT`, that the window system reports one
//! after the other; the last one stays. 0x0 is a minimised window. Each picture that is shown is reported as suboptimal,
//! so that the application asks again.

use std::sync::atomic::{AtomicUsize, Ordering};

use ash::vk;

use crate::calls::Call;
use crate::devices;
use crate::faults::{self, SIZES, Strike};

/// Number of sizes reported so far.
static REPORTED: AtomicUsize = AtomicUsize::new(0);

/// # Safety
/// That of `vkGetPhysicalDeviceSurfaceCapabilitiesKHR`.
pub unsafe extern "system" fn capabilities(
    physical: vk::PhysicalDevice,
    surface: vk::SurfaceKHR,
    capabilities: *mut vk::SurfaceCapabilitiesKHR,
) -> vk::Result {
    let Some((real, _, chain)) = devices::open(physical) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    let call = Call::vkGetPhysicalDeviceSurfaceCapabilitiesKHR;
    if let Strike::Instead(result) = faults::strike(call as usize, Some(&chain)) {
        return result;
    }
    // SAFETY: this is its type.
    let next: vk::PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR = unsafe { chain.next(call) };
    // SAFETY: the caller's arguments.
    let result = unsafe { next(real, surface, capabilities) };
    if let Some(last) = SIZES.len().checked_sub(1) {
        let number = REPORTED.fetch_add(1, Ordering::Relaxed).min(last);
        // SAFETY: the caller passes a valid structure.
        unsafe { (*capabilities).current_extent = SIZES[number] };
    }
    result
}
