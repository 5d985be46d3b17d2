//! Physical devices that a profile limits. The application gets handles of ours, one for each profile; each function
//! that takes a physical device gets the driver's.

use std::ffi::c_char;
use std::sync::{Arc, PoisonError, RwLock};

use ash::vk::{self, Handle};

use crate::calls::Call;
use crate::chain::{self, Chain};
use crate::faults::{self, Strike};
use crate::profile::{Profile, profiles};
use crate::{display, limits};

/// What a handle of ours points at. The loader reads the first word, which is its dispatch table.
#[repr(C)]
struct Physical {
    dispatch: usize,
    real: vk::PhysicalDevice,
    profile: &'static Profile,
}

/// The handles of ours. They are never freed: their number is that of instances times profiles.
static HANDLES: RwLock<Vec<&'static Physical>> = RwLock::new(Vec::new());

fn find(handle: usize) -> Option<&'static Physical> {
    let handles = HANDLES.read().unwrap_or_else(PoisonError::into_inner);
    handles
        .iter()
        .copied()
        .find(|physical| std::ptr::from_ref(*physical).addr() == handle)
}

/// The driver's handle in place of ours; any other handle unchanged.
pub fn real(handle: usize) -> usize {
    match profiles() {
        [] => handle,
        _ => find(handle).map_or(handle, |physical| physical.real.as_raw() as usize),
    }
}

/// The driver's handle, the profile, and the next layer's functions of a physical device.
pub fn open(
    handle: vk::PhysicalDevice,
) -> Option<(vk::PhysicalDevice, Option<&'static Profile>, Arc<Chain>)> {
    let chain = chain::of(handle)?;
    Some(match find(handle.as_raw() as usize) {
        Some(physical) => (physical.real, Some(physical.profile), chain),
        None => (handle, None, chain),
    })
}

/// A handle of ours for each profile of the driver's device.
fn handles_of(real: vk::PhysicalDevice) -> Vec<vk::PhysicalDevice> {
    // SAFETY: the driver's handle is alive, and the loader's word comes first.
    let dispatch = unsafe { *(real.as_raw() as usize as *const usize) };
    let mut handles = HANDLES.write().unwrap_or_else(PoisonError::into_inner);
    let mut made = Vec::new();
    for profile in profiles() {
        let same = |p: &&&Physical| {
            p.real == real && p.dispatch == dispatch && std::ptr::eq(p.profile, profile)
        };
        let known = handles.iter().find(same).copied();
        let physical = known.unwrap_or_else(|| {
            let new = Physical {
                dispatch,
                real,
                profile,
            };
            let new: &'static Physical = Box::leak(Box::new(new));
            handles.push(new);
            new
        });
        made.push(vk::PhysicalDevice::from_raw(
            std::ptr::from_ref(physical).expose_provenance() as u64,
        ));
    }
    made
}

/// Writes a list as Vulkan's functions do that are called once for the length and once for the items.
///
/// # Safety
/// `count` must be valid, and `items` null or have room for `count` items.
unsafe fn write_list<T: Copy>(list: &[T], count: *mut u32, items: *mut T) -> vk::Result {
    if items.is_null() {
        // SAFETY: the caller's promise.
        unsafe { count.write(list.len() as u32) };
        return vk::Result::SUCCESS;
    }
    // SAFETY: the caller's promise.
    let written = list.len().min(unsafe { count.read() } as usize);
    // SAFETY: there is room for that many.
    unsafe { items.copy_from_nonoverlapping(list.as_ptr(), written) };
    // SAFETY: the caller's promise.
    unsafe { count.write(written as u32) };
    match written == list.len() {
        true => vk::Result::SUCCESS,
        false => vk::Result::INCOMPLETE,
    }
}

/// Ends a function in the result that is injected into it.
macro_rules! strike {
    ($call:expr, $chain:expr) => {
        if let Strike::Instead(result) = faults::strike($call as usize, Some($chain)) {
            return result;
        }
    };
}

/// The driver's devices as those of the profiles.
///
/// # Safety
/// That of `vkEnumeratePhysicalDevices`.
pub unsafe extern "system" fn enumerate(
    instance: vk::Instance,
    count: *mut u32,
    devices: *mut vk::PhysicalDevice,
) -> vk::Result {
    let Some(chain) = chain::of(instance) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    strike!(Call::vkEnumeratePhysicalDevices, &chain);
    // SAFETY: the pointer is this function of the next layer.
    let next: vk::PFN_vkEnumeratePhysicalDevices =
        unsafe { chain.next(Call::vkEnumeratePhysicalDevices) };
    if profiles().is_empty() {
        // SAFETY: the caller's arguments.
        return unsafe { next(instance, count, devices) };
    }
    let (mut one, mut first) = (1, vk::PhysicalDevice::null());
    // SAFETY: room for one device; if there are more, they are left out.
    let result = unsafe { next(instance, &mut one, &mut first) };
    if result.as_raw() < 0 || one == 0 {
        return result;
    }
    // SAFETY: the caller's arguments.
    unsafe { write_list(&handles_of(first), count, devices) }
}

/// # Safety
/// That of `vkEnumerateDeviceExtensionProperties`.
pub unsafe extern "system" fn extensions(
    physical: vk::PhysicalDevice,
    layer: *const c_char,
    count: *mut u32,
    properties: *mut vk::ExtensionProperties,
) -> vk::Result {
    let Some((real, profile, chain)) = open(physical) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    strike!(Call::vkEnumerateDeviceExtensionProperties, &chain);
    // SAFETY: the pointer is this function of the next layer.
    let next: vk::PFN_vkEnumerateDeviceExtensionProperties =
        unsafe { chain.next(Call::vkEnumerateDeviceExtensionProperties) };
    let added = display::extensions();
    if !layer.is_null() || (profile.is_none() && added.is_empty()) {
        // SAFETY: the caller's arguments.
        return unsafe { next(real, layer, count, properties) };
    }
    let mut all = 0;
    // SAFETY: a place for the number.
    let result = unsafe { next(real, layer, &mut all, std::ptr::null_mut()) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    let mut list = vec![vk::ExtensionProperties::default(); all as usize];
    // SAFETY: room for `all` items.
    let result = unsafe { next(real, layer, &mut all, list.as_mut_ptr()) };
    if result != vk::Result::SUCCESS {
        return result;
    }
    list.retain(|e| {
        let hidden = |n| profile.is_some_and(|profile| profile.hides(n));
        e.extension_name_as_c_str().is_ok_and(|n| !hidden(n))
    });
    list.extend(added);
    // SAFETY: the caller's arguments.
    unsafe { write_list(&list, count, properties) }
}

/// Defines a function that asks the next layer and then changes the answer by the profile.
macro_rules! changed {
    ($($function:ident $pfn:ident $call:ident $answer:ty, $change:expr;)*) => {$(
        /// # Safety
        /// That of Vulkan's function of this name.
        pub unsafe extern "system" fn $function(physical: vk::PhysicalDevice, answer: *mut $answer) {
            let Some((real, profile, chain)) = open(physical) else { return };
            // SAFETY: the pointer is this function of the next layer.
            let next: vk::$pfn = unsafe { chain.next(Call::$call) };
            // SAFETY: the caller's arguments.
            unsafe { next(real, answer) };
            if let Some(profile) = profile {
                // SAFETY: the caller passes a valid structure, with a chain of valid ones.
                unsafe { $change(profile, &mut *answer) };
            }
        }
    )*};
}

changed! {
    properties PFN_vkGetPhysicalDeviceProperties vkGetPhysicalDeviceProperties vk::PhysicalDeviceProperties, limits::properties;
    properties2 PFN_vkGetPhysicalDeviceProperties2 vkGetPhysicalDeviceProperties2 vk::PhysicalDeviceProperties2<'_>, limits::properties2;
    features PFN_vkGetPhysicalDeviceFeatures vkGetPhysicalDeviceFeatures vk::PhysicalDeviceFeatures, limits::features;
    memory PFN_vkGetPhysicalDeviceMemoryProperties vkGetPhysicalDeviceMemoryProperties vk::PhysicalDeviceMemoryProperties, limits::memory;
    memory2 PFN_vkGetPhysicalDeviceMemoryProperties2 vkGetPhysicalDeviceMemoryProperties2 vk::PhysicalDeviceMemoryProperties2<'_>, limits::memory2;
}

/// # Safety
/// That of `vkGetPhysicalDeviceFeatures2`.
pub unsafe extern "system" fn features2(
    physical: vk::PhysicalDevice,
    answer: *mut vk::PhysicalDeviceFeatures2<'_>,
) {
    let Some((real, profile, chain)) = open(physical) else {
        return;
    };
    // SAFETY: the pointer is this function of the next layer.
    let next: vk::PFN_vkGetPhysicalDeviceFeatures2 =
        unsafe { chain.next(Call::vkGetPhysicalDeviceFeatures2) };
    // SAFETY: the caller's arguments.
    unsafe { display::features2(answer, || next(real, answer)) };
    if let Some(profile) = profile {
        // SAFETY: the caller passes a valid structure, with a chain of valid ones.
        unsafe { limits::features2(profile, &mut *answer) };
    }
}

/// # Safety
/// That of `vkGetPhysicalDeviceQueueFamilyProperties`.
pub unsafe extern "system" fn queues(
    physical: vk::PhysicalDevice,
    count: *mut u32,
    families: *mut vk::QueueFamilyProperties,
) {
    let Some((real, profile, chain)) = open(physical) else {
        return;
    };
    // SAFETY: the pointer is this function of the next layer.
    let next: vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties =
        unsafe { chain.next(Call::vkGetPhysicalDeviceQueueFamilyProperties) };
    let Some(profile) = profile.filter(|p| !p.queues.is_empty()) else {
        // SAFETY: the caller's arguments.
        return unsafe { next(real, count, families) };
    };
    let (mut one, mut first) = (1, vk::QueueFamilyProperties::default());
    // SAFETY: room for one family.
    unsafe { next(real, &mut one, &mut first) };
    let list: Vec<_> = (profile.queues.iter())
        .map(
            |&(queue_flags, timestamp_valid_bits)| vk::QueueFamilyProperties {
                queue_flags,
                timestamp_valid_bits,
                queue_count: 1,
                ..first
            },
        )
        .collect();
    // SAFETY: the caller's arguments.
    let _ = unsafe { write_list(&list, count, families) };
}

/// Only families for graphics can present.
///
/// # Safety
/// That of `vkGetPhysicalDeviceSurfaceSupportKHR`.
pub unsafe extern "system" fn surface_support(
    physical: vk::PhysicalDevice,
    family: u32,
    surface: vk::SurfaceKHR,
    supported: *mut vk::Bool32,
) -> vk::Result {
    let Some((real, profile, chain)) = open(physical) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    strike!(Call::vkGetPhysicalDeviceSurfaceSupportKHR, &chain);
    // SAFETY: the pointer is this function of the next layer.
    let next: vk::PFN_vkGetPhysicalDeviceSurfaceSupportKHR =
        unsafe { chain.next(Call::vkGetPhysicalDeviceSurfaceSupportKHR) };
    let queue = profile.and_then(|p| p.queues.get(family as usize));
    let real_family = if queue.is_some() { 0 } else { family };
    // SAFETY: the caller's arguments.
    let result = unsafe { next(real, real_family, surface, supported) };
    if let Some((flags, _)) = queue
        && !flags.contains(vk::QueueFlags::GRAPHICS)
    {
        // SAFETY: the caller passes a valid place.
        unsafe { supported.write(vk::FALSE) };
    }
    result
}

/// # Safety
/// That of `vkGetPhysicalDeviceFormatProperties`.
pub unsafe extern "system" fn format(
    physical: vk::PhysicalDevice,
    format: vk::Format,
    properties: *mut vk::FormatProperties,
) {
    let Some((real, profile, chain)) = open(physical) else {
        return;
    };
    // SAFETY: the pointer is this function of the next layer.
    let next: vk::PFN_vkGetPhysicalDeviceFormatProperties =
        unsafe { chain.next(Call::vkGetPhysicalDeviceFormatProperties) };
    // SAFETY: the caller's arguments.
    unsafe { next(real, format, properties) };
    if let Some(profile) = profile {
        // SAFETY: the caller passes a valid structure.
        unsafe { limits::format(profile, format, &mut *properties) };
    }
}

/// # Safety
/// That of `vkGetPhysicalDeviceFormatProperties2`.
pub unsafe extern "system" fn format2(
    physical: vk::PhysicalDevice,
    format: vk::Format,
    properties: *mut vk::FormatProperties2<'_>,
) {
    let Some((real, profile, chain)) = open(physical) else {
        return;
    };
    // SAFETY: the pointer is this function of the next layer.
    let next: vk::PFN_vkGetPhysicalDeviceFormatProperties2 =
        unsafe { chain.next(Call::vkGetPhysicalDeviceFormatProperties2) };
    // SAFETY: the caller's arguments.
    unsafe { next(real, format, properties) };
    if let Some(profile) = profile {
        // SAFETY: the caller passes a valid structure.
        unsafe { limits::format(profile, format, &mut (*properties).format_properties) };
    }
}
