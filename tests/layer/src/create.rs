//! Creation and destruction of instances and devices, where the layer enters and leaves the chain.

use std::ffi::{CStr, c_void};

use ash::vk::{self, Handle};

use crate::calls::{Call, EXTENSIONS};
use crate::chain::{LookUp, add, remove};
use crate::faults::{self, Strike};
use crate::profile::PROFILES;
use crate::{devices, display, limits, memory};

/// `VkLayerInstanceCreateInfo` and `VkLayerDeviceCreateInfo`.
#[repr(C)]
struct LayerInfo {
    kind: vk::StructureType,
    next: *mut LayerInfo,
    function: u32,
    link: *mut Link,
}

/// `VkLayerInstanceLink`, and the beginning of `VkLayerDeviceLink`, which is the same.
#[repr(C)]
struct Link {
    next: *mut Link,
    get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
}

/// Takes this layer's link out of a chain of structures: the next layer takes the one after it.
///
/// # Safety
/// `info` must be the `p_next` of a structure that the loader passes to a layer.
unsafe fn take_link(info: *const c_void, kind: vk::StructureType) -> Option<Link> {
    let mut info = info.cast_mut().cast::<LayerInfo>();
    while !info.is_null() {
        // SAFETY: every structure of the chain begins with its type and the next one.
        let found = unsafe { &mut *info };
        if found.kind == kind && found.function == 0 && !found.link.is_null() {
            // SAFETY: a structure of this type and function has a link for each layer.
            let link = unsafe { found.link.read() };
            found.link = link.next;
            return Some(link);
        }
        info = found.next;
    }
    None
}

/// Lists the extensions whose functions the layer does not know.
fn log_unknown(extensions: Vec<&CStr>) {
    let known = |name: &&CStr| EXTENSIONS.contains(&name.to_str().unwrap_or_default());
    for name in extensions.iter().filter(|name| !known(name)) {
        faults::log(&format!("unknown {}", name.to_string_lossy()));
    }
}

/// # Safety
/// That of `vkCreateInstance`.
pub unsafe extern "system" fn instance(
    info: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    instance: *mut vk::Instance,
) -> vk::Result {
    // SAFETY: the loader passes a valid structure.
    let next = unsafe { (*info).p_next };
    // SAFETY: the loader passes it.
    let Some(link) = (unsafe { take_link(next, vk::StructureType::LOADER_INSTANCE_CREATE_INFO) })
    else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    if let Strike::Instead(result) = faults::strike(Call::vkCreateInstance as usize, None) {
        return result;
    }
    if let Err(line) = &*PROFILES {
        eprintln!("{line}");
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    }
    // SAFETY: the caller passes a valid structure.
    log_unknown(unsafe {
        limits::names(
            (*info).pp_enabled_extension_names,
            (*info).enabled_extension_count,
        )
    });
    let get = link.get_instance_proc_addr;
    // SAFETY: the next layer's entry point, with a literal.
    let Some(create) = (unsafe { get(vk::Instance::null(), c"vkCreateInstance".as_ptr()) }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    // SAFETY: the function of that name has this type.
    let create = unsafe {
        std::mem::transmute::<unsafe extern "system" fn(), vk::PFN_vkCreateInstance>(create)
    };
    // SAFETY: the caller's arguments.
    let result = unsafe { create(info, allocator, instance) };
    if result == vk::Result::SUCCESS {
        // SAFETY: the call succeeded, so it has written the handle.
        let made = unsafe { *instance };
        add(made.as_raw() as usize, LookUp::Instance(get, made), None);
    }
    result
}

/// # Safety
/// That of `vkCreateDevice`.
pub unsafe extern "system" fn device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    device: *mut vk::Device,
) -> vk::Result {
    // SAFETY: the loader passes a valid structure.
    let next = unsafe { (*info).p_next };
    // SAFETY: the loader passes it.
    let link = unsafe { take_link(next, vk::StructureType::LOADER_DEVICE_CREATE_INFO) };
    let (Some(link), Some((physical, profile, chain))) = (link, devices::open(physical)) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    if let Strike::Instead(result) = faults::strike(Call::vkCreateDevice as usize, None) {
        return result;
    }
    // SAFETY: the caller passes a valid structure.
    let info = unsafe { &*info };
    // SAFETY: as above.
    log_unknown(unsafe {
        limits::names(
            info.pp_enabled_extension_names,
            info.enabled_extension_count,
        )
    });
    // SAFETY: as above.
    if let Some(result) = profile.and_then(|profile| unsafe { limits::forbids(profile, info) }) {
        return result;
    }
    let mut info = *info;
    let queues = memory::of_family_0(profile, &info);
    if let Some(queue) = &queues {
        info.p_queue_create_infos = queue;
    }
    // SAFETY: this is its type.
    let create: vk::PFN_vkCreateDevice = unsafe { chain.next(Call::vkCreateDevice) };
    // SAFETY: the caller's arguments; the list of queues may be this layer's, which outlives the call.
    let result = unsafe { display::device(info, |info| create(physical, info, allocator, device)) };
    if result == vk::Result::SUCCESS {
        // SAFETY: the call succeeded, so it has written the handle.
        let made = unsafe { *device };
        let get = link.get_device_proc_addr;
        add(made.as_raw() as usize, LookUp::Device(get, made), profile);
    }
    result
}

/// `vkDestroyInstance` and `vkDestroyDevice`, which have the same arguments.
///
/// # Safety
/// That of the function.
pub unsafe extern "system" fn destroy<const CALL: usize>(
    handle: usize,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(chain) = remove(handle) else { return };
    // SAFETY: the pointer is this function of the next layer; a handle is a pointer.
    let destroy = unsafe {
        std::mem::transmute::<
            *const c_void,
            unsafe extern "system" fn(usize, *const vk::AllocationCallbacks<'_>),
        >(chain.below(CALL))
    };
    // SAFETY: the caller's arguments.
    unsafe { destroy(handle, allocator) }
}
