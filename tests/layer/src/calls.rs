//! The functions that the layer intercepts: all of Vulkan 1.3 and of the renderer's extensions that return a
//! `VkResult` on an instance, a device or what was made from them, and those that a profile changes.

use std::ffi::CStr;

/// Gives the list to a macro: name, the errors that the function may return (a letter each, see `faults::results`), and
/// the layer's function, as `hooks` names it.
macro_rules! all_calls {
    ($with:ident) => {
        $with! {
            vkCreateInstance "HDI" (create::instance);
            vkDestroyInstance "" (create::destroy::<{ Call::vkDestroyInstance as usize }>);
            vkEnumeratePhysicalDevices "HDI" (devices::enumerate);
            vkEnumeratePhysicalDeviceGroups "HDI" hook3;
            vkEnumerateDeviceExtensionProperties "HD" (devices::extensions);
            vkEnumerateDeviceLayerProperties "HD" hook3;
            vkGetPhysicalDeviceImageFormatProperties "HD" hook7;
            vkGetPhysicalDeviceImageFormatProperties2 "HD" hook3;
            vkGetPhysicalDeviceToolProperties "H" hook3;
            vkCreateDebugUtilsMessengerEXT "H" hook4;
            vkCreateHeadlessSurfaceEXT "HD" hook4;
            vkCreateWaylandSurfaceKHR "HD" hook4;
            vkCreateXcbSurfaceKHR "HD" hook4;
            vkCreateXlibSurfaceKHR "HD" hook4;
            vkGetPhysicalDeviceSurfaceSupportKHR "HDS" (devices::surface_support);
            vkGetPhysicalDeviceSurfaceCapabilitiesKHR "HDS" (window::capabilities);
            vkGetPhysicalDeviceSurfaceFormatsKHR "HDS" hook4;
            vkGetPhysicalDeviceSurfacePresentModesKHR "HDS" hook4;
            vkGetPhysicalDevicePresentRectanglesKHR "HD" hook4;

            vkCreateDevice "HDIL" (create::device);
            vkDestroyDevice "" (create::destroy::<{ Call::vkDestroyDevice as usize }>);
            vkDeviceWaitIdle "HDL" hook1;
            vkQueueWaitIdle "HDL" hook1;
            vkQueueSubmit "HDL" hook4;
            vkQueueSubmit2 "HDL" hook4;
            vkQueueBindSparse "HDL" hook4;
            vkAllocateMemory "HD" (memory::allocate);
            vkMapMemory "HD" hook6;
            vkFlushMappedMemoryRanges "HD" hook3;
            vkInvalidateMappedMemoryRanges "HD" hook3;
            vkBindBufferMemory "HD" hook4;
            vkBindBufferMemory2 "HD" hook3;
            vkBindImageMemory "HD" hook4;
            vkBindImageMemory2 "HD" hook3;
            vkCreateFence "HD" hook4;
            vkResetFences "D" hook3;
            vkGetFenceStatus "HDL" hook2;
            vkWaitForFences "HDLT" hook5;
            vkCreateSemaphore "HD" hook4;
            vkGetSemaphoreCounterValue "HDL" hook3;
            vkWaitSemaphores "HDLT" hook3;
            vkSignalSemaphore "HD" hook2;
            vkCreateEvent "HD" hook4;
            vkGetEventStatus "HDL" hook2;
            vkSetEvent "HD" hook2;
            vkResetEvent "D" hook2;
            vkCreateQueryPool "HD" hook4;
            vkGetQueryPoolResults "HDL" hook8;
            vkCreateBuffer "HD" hook4;
            vkCreateBufferView "HD" hook4;
            vkCreateImage "HD" hook4;
            vkCreateImageView "HD" hook4;
            vkCreateSampler "HD" hook4;
            vkCreateSamplerYcbcrConversion "HD" hook4;
            vkCreateShaderModule "HD" hook4;
            vkCreatePipelineCache "HD" hook4;
            vkGetPipelineCacheData "HD" hook4;
            vkMergePipelineCaches "HD" hook4;
            vkCreatePipelineLayout "HD" hook4;
            vkCreateGraphicsPipelines "HD" hook6;
            vkCreateComputePipelines "HD" hook6;
            vkCreateDescriptorSetLayout "HD" hook4;
            vkCreateDescriptorPool "HD" hook4;
            vkResetDescriptorPool "" hook3;
            vkAllocateDescriptorSets "HD" hook3;
            vkFreeDescriptorSets "" hook4;
            vkCreateDescriptorUpdateTemplate "HD" hook4;
            vkCreateFramebuffer "HD" hook4;
            vkCreateRenderPass "HD" hook4;
            vkCreateRenderPass2 "HD" hook4;
            vkCreateCommandPool "HD" (memory::command_pool);
            vkResetCommandPool "D" hook3;
            vkAllocateCommandBuffers "HD" hook3;
            vkBeginCommandBuffer "HD" hook2;
            vkEndCommandBuffer "HD" hook1;
            vkResetCommandBuffer "HD" hook2;
            vkCreatePrivateDataSlot "H" hook4;
            vkSetPrivateData "H" hook5;
            vkSetDebugUtilsObjectNameEXT "HD" hook2;
            vkSetDebugUtilsObjectTagEXT "HD" hook2;

            vkCreateSwapchainKHR "HDLSI" hook4;
            vkGetSwapchainImagesKHR "HD" hook4;
            vkAcquireNextImageKHR "HDLSOT" (display::acquire);
            vkAcquireNextImage2KHR "HDLSOT" hook3;
            vkQueuePresentKHR "HDLSO" (display::present);
            vkWaitForPresentKHR "HDLSOT" (display::wait);
            vkGetDeviceGroupPresentCapabilitiesKHR "HD" hook2;
            vkGetDeviceGroupSurfacePresentModesKHR "HDS" hook3;
            vkCreateAccelerationStructureKHR "H" hook4;
            vkBuildAccelerationStructuresKHR "HD" hook5;
            vkCopyAccelerationStructureKHR "HD" hook3;
            vkCopyAccelerationStructureToMemoryKHR "HD" hook3;
            vkCopyMemoryToAccelerationStructureKHR "HD" hook3;
            vkWriteAccelerationStructuresPropertiesKHR "HD" hook7;
            vkCreateRayTracingPipelinesKHR "HD" hook7;
            vkGetRayTracingShaderGroupHandlesKHR "HD" hook6;
            vkGetRayTracingCaptureReplayShaderGroupHandlesKHR "HD" hook6;
            vkCreateDeferredOperationKHR "H" hook3;
            vkDeferredOperationJoinKHR "HD" hook2;
            vkGetDeferredOperationResultKHR "" hook2;

            vkGetPhysicalDeviceProperties "" (devices::properties);
            vkGetPhysicalDeviceProperties2 "" (devices::properties2);
            vkGetPhysicalDeviceFeatures "" (devices::features);
            vkGetPhysicalDeviceFeatures2 "" (devices::features2);
            vkGetPhysicalDeviceMemoryProperties "" (devices::memory);
            vkGetPhysicalDeviceMemoryProperties2 "" (devices::memory2);
            vkGetPhysicalDeviceQueueFamilyProperties "" (devices::queues);
            vkGetPhysicalDeviceQueueFamilyProperties2 "" hook3;
            vkGetPhysicalDeviceFormatProperties "" (devices::format);
            vkGetPhysicalDeviceFormatProperties2 "" (devices::format2);
            vkGetPhysicalDeviceSparseImageFormatProperties "" hook8;
            vkGetPhysicalDeviceSparseImageFormatProperties2 "" hook4;
            vkGetPhysicalDeviceExternalBufferProperties "" hook3;
            vkGetPhysicalDeviceExternalFenceProperties "" hook3;
            vkGetPhysicalDeviceExternalSemaphoreProperties "" hook3;
            vkGetDeviceQueue "" (memory::queue);
            vkFreeMemory "" (memory::free);
            vkGetBufferMemoryRequirements "" (memory::buffer_requirements);
            vkGetImageMemoryRequirements "" (memory::image_requirements);
        }
    };
}
pub(crate) use all_calls;

/// One of them.
pub struct Row {
    pub name: &'static CStr,
    pub errors: &'static str,
}

macro_rules! rows {
    ($($name:ident $errors:literal $hook:tt;)*) => {
        /// An intercepted function.
        #[allow(non_camel_case_types)] // Vulkan's own names
        #[derive(Clone, Copy)]
        pub enum Call { $($name),* }

        /// All of them, in the order of [`Call`].
        pub static CALLS: &[Row] = &[$(Row {
            // SAFETY: `concat!` adds the NUL, and names have none.
            name: unsafe { CStr::from_bytes_with_nul_unchecked(concat!(stringify!($name), "\0").as_bytes()) },
            errors: $errors,
        }),*];
    };
}

all_calls!(rows);

/// The extensions whose functions are among these, or that have none.
pub const EXTENSIONS: &[&str] = &[
    "VK_EXT_debug_utils",
    "VK_EXT_extended_dynamic_state",
    "VK_EXT_extended_dynamic_state3",
    "VK_EXT_headless_surface",
    "VK_EXT_swapchain_colorspace",
    "VK_EXT_validation_features",
    "VK_KHR_acceleration_structure",
    "VK_KHR_deferred_host_operations",
    "VK_KHR_present_id",
    "VK_KHR_present_wait",
    "VK_KHR_ray_query",
    "VK_KHR_ray_tracing_pipeline",
    "VK_KHR_shader_clock",
    "VK_KHR_surface",
    "VK_KHR_swapchain",
    "VK_KHR_wayland_surface",
    "VK_KHR_xcb_surface",
    "VK_KHR_xlib_surface",
];
