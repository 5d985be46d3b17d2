//! The memory and the queues of a limited device: the driver has one heap, one type and one family for all of them.

use std::sync::PoisonError;

use ash::vk;

use crate::calls::Call;
use crate::chain;
use crate::faults::{self, Strike};
use crate::profile::Profile;

/// The profile that describes the memory of a device.
fn with_memory(profile: Option<&'static Profile>) -> Option<&'static Profile> {
    profile.filter(|profile| !profile.memory.is_empty())
}

/// One queue of the driver's family in place of those that a device is created with.
pub fn of_family_0<'a>(
    profile: Option<&Profile>,
    info: &vk::DeviceCreateInfo<'a>,
) -> Option<vk::DeviceQueueCreateInfo<'a>> {
    profile.filter(|p| !p.queues.is_empty() && info.queue_create_info_count == 1)?;
    // SAFETY: the application passes one structure.
    let mut queue = unsafe { *info.p_queue_create_infos };
    queue.queue_family_index = 0;
    Some(queue)
}

/// # Safety
/// That of `vkGetDeviceQueue`.
pub unsafe extern "system" fn queue(
    device: vk::Device,
    family: u32,
    index: u32,
    queue: *mut vk::Queue,
) {
    let Some(chain) = chain::of(device) else {
        return;
    };
    // SAFETY: this is its type.
    let next: vk::PFN_vkGetDeviceQueue = unsafe { chain.next(Call::vkGetDeviceQueue) };
    let limited = chain.profile.is_some_and(|p| !p.queues.is_empty());
    // SAFETY: the caller's arguments, in the driver's family.
    unsafe { next(device, if limited { 0 } else { family }, index, queue) }
}

/// # Safety
/// That of `vkCreateCommandPool`.
pub unsafe extern "system" fn command_pool(
    device: vk::Device,
    info: *const vk::CommandPoolCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    pool: *mut vk::CommandPool,
) -> vk::Result {
    let Some(chain) = chain::of(device) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    if let Strike::Instead(result) =
        faults::strike(Call::vkCreateCommandPool as usize, Some(&chain))
    {
        return result;
    }
    // SAFETY: this is its type.
    let next: vk::PFN_vkCreateCommandPool = unsafe { chain.next(Call::vkCreateCommandPool) };
    // SAFETY: the caller passes a valid structure.
    let mut info = unsafe { *info };
    if chain.profile.is_some_and(|p| !p.queues.is_empty()) {
        info.queue_family_index = 0;
    }
    // SAFETY: the caller's arguments, in the driver's family.
    unsafe { next(device, &info, allocator, pool) }
}

/// Fails where the heap is full.
///
/// # Safety
/// That of `vkAllocateMemory`.
pub unsafe extern "system" fn allocate(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    let Some(chain) = chain::of(device) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    if let Strike::Instead(result) = faults::strike(Call::vkAllocateMemory as usize, Some(&chain)) {
        return result;
    }
    // SAFETY: this is its type.
    let next: vk::PFN_vkAllocateMemory = unsafe { chain.next(Call::vkAllocateMemory) };
    // SAFETY: the caller passes a valid structure.
    let mut info = unsafe { *info };
    let Some(profile) = with_memory(chain.profile) else {
        // SAFETY: the caller's arguments.
        return unsafe { next(device, &info, allocator, memory) };
    };
    let Some(kind) = profile.memory.get(info.memory_type_index as usize) else {
        return vk::Result::ERROR_VALIDATION_FAILED_EXT;
    };
    let (heap, size) = (kind.heap_index, info.allocation_size);
    let most = profile.heaps.get(heap as usize).map_or(0, |heap| heap.size);
    let mut used = chain.used.lock().unwrap_or_else(PoisonError::into_inner);
    let of_heap = used.heaps.entry(heap).or_default();
    if of_heap.saturating_add(size) > most {
        return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
    }
    info.memory_type_index = 0;
    // SAFETY: the caller's arguments, in the driver's type.
    let result = unsafe { next(device, &info, allocator, memory) };
    if result == vk::Result::SUCCESS {
        *of_heap += size;
        // SAFETY: the call succeeded, so it has written the handle.
        used.allocations.insert(unsafe { *memory }, (heap, size));
    }
    result
}

/// # Safety
/// That of `vkFreeMemory`.
pub unsafe extern "system" fn free(
    device: vk::Device,
    memory: vk::DeviceMemory,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(chain) = chain::of(device) else {
        return;
    };
    let mut used = chain.used.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((heap, size)) = used.allocations.remove(&memory) {
        *used.heaps.entry(heap).or_default() -= size;
    }
    drop(used);
    // SAFETY: this is its type.
    let next: vk::PFN_vkFreeMemory = unsafe { chain.next(Call::vkFreeMemory) };
    // SAFETY: the caller's arguments.
    unsafe { next(device, memory, allocator) }
}

/// Defines a function after which every type of the profile fits.
macro_rules! requirements {
    ($($function:ident $pfn:ident $call:ident $handle:ty;)*) => {$(
        /// # Safety
        /// That of Vulkan's function of this name.
        pub unsafe extern "system" fn $function(
            device: vk::Device,
            handle: $handle,
            requirements: *mut vk::MemoryRequirements,
        ) {
            let Some(chain) = chain::of(device) else { return };
            // SAFETY: this is its type.
            let next: vk::$pfn = unsafe { chain.next(Call::$call) };
            // SAFETY: the caller's arguments.
            unsafe { next(device, handle, requirements) };
            if let Some(profile) = with_memory(chain.profile) {
                // SAFETY: the caller passes a valid structure.
                unsafe { (*requirements).memory_type_bits = (1 << profile.memory.len()) - 1 };
            }
        }
    )*};
}

requirements! {
    buffer_requirements PFN_vkGetBufferMemoryRequirements vkGetBufferMemoryRequirements vk::Buffer;
    image_requirements PFN_vkGetImageMemoryRequirements vkGetImageMemoryRequirements vk::Image;
}
