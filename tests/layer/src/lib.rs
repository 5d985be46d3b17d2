//! A Vulkan layer for tests. Environment variables select what it does:
//!
//! * `RELIGHT_LAYER_PROFILE`: files that describe devices, separated by `:`. The driver's first device appears once for
//!   each, limited as the file says ([`profile`]).
//! * `RELIGHT_LAYER_FAULT`: `FUNCTION NUMBER RESULT`. That call of the function, counted from 1, fails with the result
//!   ([`faults`]).
//! * `RELIGHT_LAYER_SIZES`: sizes of the window ([`window`]).
//! * `RELIGHT_LAYER_DISPLAY`: emulates `VK_KHR_present_wait` ([`display`]).
//! * `RELIGHT_LAYER_LOG`: a file that gets a line `FUNCTION NUMBER` for each call that returns a `VkResult`, and a line
//!   `unknown EXTENSION` for each extension that the application enables and whose functions the layer does not know.
//!
//! The loader finds it by a manifest, as any layer; `tests::layer` writes one.

mod calls;
mod chain;
mod create;
mod devices;
mod display;
mod faults;
mod hooks;
mod limits;
mod memory;
mod profile;
mod window;

use std::ffi::{CStr, c_char, c_void};

use ash::vk;

use calls::CALLS;
use hooks::HOOKS;

/// `VkNegotiateLayerInterface`, by which the loader and a layer exchange their entry points.
#[repr(C)]
pub struct Negotiation {
    kind: u32,
    next: *const c_void,
    version: u32,
    get_instance_proc_addr: Option<vk::PFN_vkGetInstanceProcAddr>,
    get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    get_physical_device_proc_addr: *const c_void,
}

/// The entry point by which the loader gets the layer's functions.
///
/// # Safety
/// Called by the loader with its structure.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
    negotiation: *mut Negotiation,
) -> vk::Result {
    // SAFETY: the loader passes a valid structure, which is its own for the length of the call.
    let negotiation = unsafe { &mut *negotiation };
    negotiation.version = negotiation.version.min(2);
    negotiation.get_instance_proc_addr = Some(get_instance_proc_addr);
    negotiation.get_device_proc_addr = Some(get_device_proc_addr);
    negotiation.get_physical_device_proc_addr = std::ptr::null();
    vk::Result::SUCCESS
}

/// The layer's own function of this name.
fn own(name: &CStr) -> Option<*const c_void> {
    match name.to_bytes() {
        b"vkGetInstanceProcAddr" => {
            Some(get_instance_proc_addr as vk::PFN_vkGetInstanceProcAddr as *const c_void)
        }
        b"vkGetDeviceProcAddr" => {
            Some(get_device_proc_addr as vk::PFN_vkGetDeviceProcAddr as *const c_void)
        }
        _ => {
            let place = CALLS.iter().position(|call| call.name == name)?;
            Some(HOOKS[place].0)
        }
    }
}

/// # Safety
/// That of `vkGetInstanceProcAddr`.
unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller passes a NUL-terminated name.
    let name = unsafe { CStr::from_ptr(name) };
    let below = || chain::of(instance).and_then(|chain| chain.function(name));
    find(name, below)
}

/// # Safety
/// That of `vkGetDeviceProcAddr`.
unsafe extern "system" fn get_device_proc_addr(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller passes a NUL-terminated name.
    let name = unsafe { CStr::from_ptr(name) };
    let below = || chain::of(device).and_then(|chain| chain.function(name));
    find(name, below)
}

/// The layer's function if the next layer has one of this name, otherwise the next layer's.
fn find(name: &CStr, below: impl Fn() -> vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
    let own = own(name);
    let below = below();
    // Only `vkCreateInstance` and the functions that look up others exist before an instance does.
    let first = matches!(
        name.to_bytes(),
        b"vkCreateInstance" | b"vkGetInstanceProcAddr" | b"vkGetDeviceProcAddr"
    );
    let Some(own) = own.filter(|_| first || below.is_some() || display::has(name)) else {
        return below;
    };
    // SAFETY: the pointer is a function with the signature of this name.
    Some(unsafe { std::mem::transmute::<*const c_void, unsafe extern "system" fn()>(own) })
}
