//! Selection of the physical device and its features.

mod examine;

use ash::{ext, khr, vk};

use super::device::DeviceOptions;
use super::error::{Context, Error};
use super::instance::Instance;
use examine::examine;

/// Type of the device, in ascending order of preference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// Unknown.
    Other,
    /// A software implementation.
    Cpu,
    /// A virtual machine's device.
    Virtual,
    /// Shares the memory of the CPU.
    Integrated,
    /// Has its own memory.
    Discrete,
}

/// Limits of the ray tracing pipeline and of acceleration structures.
#[derive(Clone, Copy, Debug)]
pub struct RayTracingLimits {
    /// Bytes of a shader group handle.
    pub handle_size: u32,
    /// Alignment of a record in a shader binding table.
    pub handle_alignment: u32,
    /// Alignment of a region of a shader binding table.
    pub base_alignment: u32,
    /// Maximum nesting of `traceRayEXT`; this renderer needs 1.
    pub max_recursion: u32,
    /// Alignment of scratch addresses.
    pub scratch_alignment: u32,
    /// Maximum number of triangles in a bottom-level structure.
    pub max_primitives: u64,
    /// Maximum number of instances in a top-level structure.
    pub max_instances: u64,
    /// Maximum number of rays in one launch.
    pub max_invocations: u32,
}

/// Properties of the device for the renderer.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// The driver's name of the device.
    pub name: String,
    /// Driver name and version text.
    pub driver: String,
    /// The kind.
    pub kind: DeviceKind,
    /// Vulkan version of the device: major, minor, patch.
    pub api_version: (u32, u32, u32),
    /// PCI vendor number.
    pub vendor_id: u32,
    /// Limits of the ray tracing pipeline, if it is supported.
    pub ray_tracing: Option<RayTracingLimits>,
    /// Whether `rayQueryEXT` is supported (then acceleration structures are, too).
    pub ray_query: bool,
    /// Whether passes are timed.
    pub timestamps: bool,
    /// Whether shaders can read the clock of their subgroup (`VK_KHR_shader_clock`).
    pub shader_clock: bool,
    /// Maximum anisotropy; `None` without the feature.
    pub anisotropy: Option<f32>,
    /// Whether triangles can be drawn as lines.
    pub wireframe: bool,
    /// Whether the window system says when a picture is shown (`VK_KHR_present_wait`).
    pub present_wait: bool,
    /// Whether BC1 to BC7 textures can be sampled.
    pub bc: bool,
    /// 16-bit floats in arithmetic and storage.
    pub float16: bool,
    /// 8-bit and 16-bit values in buffers.
    pub small_storage: bool,
    /// Invocations of a subgroup.
    pub subgroup_size: u32,
    /// Maximum number of textures at a time (binding 1).
    pub max_textures: u32,
    /// Maximum number of storage images at a time (binding 2).
    pub max_storage_images: u32,
    /// Maximum width and height of a 2D image.
    pub max_image_size: u32,
    /// Whether it is a software implementation, which has another default tracer.
    pub software: bool,
}

/// Features enabled at device creation.
#[derive(Clone, Copy, Default)]
pub(crate) struct Abilities {
    pub acceleration: bool,
    pub pipeline: bool,
    pub query: bool,
    pub anisotropy: bool,
    pub wireframe: bool,
    pub present_wait: bool,
    pub bc: bool,
    pub extended_formats: bool,
    pub fragment_stores: bool,
    pub vertex_stores: bool,
    pub multi_draw_indirect: bool,
    pub first_instance: bool,
    pub int16: bool,
    pub float16: bool,
    pub int8: bool,
    pub storage16: bool,
    pub storage8: bool,
    pub dynamic_state: bool,
    pub shader_clock: bool,
}

/// The selected device.
pub(crate) struct Choice {
    pub physical: vk::PhysicalDevice,
    pub queue_family: u32,
    pub timestamp_bits: u32,
    pub timestamp_period: f32,
    pub abilities: Abilities,
    pub info: DeviceInfo,
}

/// The devices that meet the requirements, best first: the one that `prefer` names (part of its name, or its index),
/// then discrete before integrated before virtual before software.
pub(crate) fn choose(instance: &Instance, options: &DeviceOptions) -> Result<Vec<Choice>, Error> {
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }
        .context("vkEnumeratePhysicalDevices")?;
    let mut refused = Vec::new();
    let mut usable: Vec<(usize, Choice)> = Vec::new();
    for (index, physical) in devices.into_iter().enumerate() {
        match examine(instance, physical, options) {
            Ok(choice) => usable.push((index, choice)),
            Err(reason) => refused.push(reason),
        }
    }
    if usable.is_empty() {
        let none = || "the drivers offer none".to_owned();
        let reasons = Some(refused.join("; ")).filter(|r| !r.is_empty());
        return Err(Error::NoDevice(reasons.unwrap_or_else(none)));
    }
    let prefer = options.prefer.as_deref().map(str::trim).unwrap_or_default();
    let wanted = |index: usize, choice: &Choice| match prefer.parse::<usize>() {
        Ok(number) => number == index,
        Err(_) => choice
            .info
            .name
            .to_lowercase()
            .contains(&prefer.to_lowercase()),
    };
    let found = (usable.iter())
        .find(|(i, c)| !prefer.is_empty() && wanted(*i, c))
        .map(|(i, _)| *i);
    if found.is_none() && !prefer.is_empty() {
        log::warn!("no usable Vulkan device matches `{prefer}`; the best one is used");
    }
    usable.sort_by_key(|(i, c)| std::cmp::Reverse((Some(*i) == found, c.info.kind)));
    Ok(usable.into_iter().map(|(_, choice)| choice).collect())
}

/// Makes the logical device with all features in `choice.abilities`.
// Over 80 lines: one list of extensions and features; their structures must live until the call at the end.
pub(crate) fn create_device(instance: &Instance, choice: &Choice) -> Result<ash::Device, Error> {
    let a = choice.abilities;
    let mut extensions = Vec::new();
    if instance.surface.is_some() {
        extensions.push(khr::swapchain::NAME.as_ptr());
    }
    if a.present_wait {
        extensions.push(khr::present_id::NAME.as_ptr());
        extensions.push(khr::present_wait::NAME.as_ptr());
    }
    if a.acceleration {
        extensions.push(khr::acceleration_structure::NAME.as_ptr());
        extensions.push(khr::deferred_host_operations::NAME.as_ptr());
    }
    if a.pipeline {
        extensions.push(khr::ray_tracing_pipeline::NAME.as_ptr());
    }
    if a.query {
        extensions.push(khr::ray_query::NAME.as_ptr());
    }
    if a.dynamic_state {
        extensions.push(ext::extended_dynamic_state::NAME.as_ptr());
        extensions.push(ext::extended_dynamic_state3::NAME.as_ptr());
    }
    if a.shader_clock {
        extensions.push(khr::shader_clock::NAME.as_ptr());
    }
    let features = vk::PhysicalDeviceFeatures::default()
        .shader_int64(true)
        .shader_sampled_image_array_dynamic_indexing(true)
        .shader_storage_image_array_dynamic_indexing(true)
        .sampler_anisotropy(a.anisotropy)
        .fill_mode_non_solid(a.wireframe)
        .texture_compression_bc(a.bc)
        .shader_storage_image_extended_formats(a.extended_formats)
        .fragment_stores_and_atomics(a.fragment_stores)
        .vertex_pipeline_stores_and_atomics(a.vertex_stores)
        .multi_draw_indirect(a.multi_draw_indirect)
        .draw_indirect_first_instance(a.first_instance)
        .shader_int16(a.int16);
    let mut f11 =
        vk::PhysicalDeviceVulkan11Features::default().storage_buffer16_bit_access(a.storage16);
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default()
        .buffer_device_address(true)
        .scalar_block_layout(true)
        .timeline_semaphore(true)
        .runtime_descriptor_array(true)
        .descriptor_binding_partially_bound(true)
        .descriptor_binding_update_unused_while_pending(true)
        .descriptor_binding_sampled_image_update_after_bind(true)
        .descriptor_binding_storage_image_update_after_bind(true)
        .shader_sampled_image_array_non_uniform_indexing(true)
        .shader_storage_image_array_non_uniform_indexing(true)
        .shader_float16(a.float16)
        .shader_int8(a.int8)
        .storage_buffer8_bit_access(a.storage8);
    let mut f_accel = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default()
        .acceleration_structure(true)
        .descriptor_binding_acceleration_structure_update_after_bind(true);
    let mut f_pipeline =
        vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
    let mut f_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
    let mut f_dynamic =
        vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT::default().extended_dynamic_state(true);
    let mut f_dynamic3 = vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT::default()
        .extended_dynamic_state3_color_blend_enable(true)
        .extended_dynamic_state3_color_blend_equation(true);
    let mut f_id = vk::PhysicalDevicePresentIdFeaturesKHR::default().present_id(true);
    let mut f_wait = vk::PhysicalDevicePresentWaitFeaturesKHR::default().present_wait(true);
    let mut f_clock =
        vk::PhysicalDeviceShaderClockFeaturesKHR::default().shader_subgroup_clock(true);
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(choice.queue_family)
        .queue_priorities(&priorities)];
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut f11)
        .push_next(&mut f12);
    if a.present_wait {
        info = info.push_next(&mut f_id).push_next(&mut f_wait);
    }
    if a.acceleration {
        info = info.push_next(&mut f_accel);
    }
    if a.pipeline {
        info = info.push_next(&mut f_pipeline);
    }
    if a.query {
        info = info.push_next(&mut f_query);
    }
    if a.dynamic_state {
        info = info.push_next(&mut f_dynamic).push_next(&mut f_dynamic3);
    }
    if a.shader_clock {
        info = info.push_next(&mut f_clock);
    }
    // SAFETY: features and extensions are ones that `examine` found on this device; pointers live here.
    unsafe { instance.raw.create_device(choice.physical, &info, None) }.context("vkCreateDevice")
}

/// Whether debug names and labels can be set.
pub(crate) fn debug_utils(
    instance: &Instance,
    device: &ash::Device,
) -> Option<ext::debug_utils::Device> {
    instance
        .debug_utils
        .then(|| ext::debug_utils::Device::new(&instance.raw, device))
}
