//! Which physical device, and which of its abilities.

use std::ffi::CStr;

use ash::{ext, khr, vk};

use super::device::DeviceOptions;
use super::error::{Context, Error};
use super::instance::Instance;

/// What kind of device it is; the order of preference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// The driver does not say.
    Other,
    /// Vulkan in software.
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
    /// How deep `traceRayEXT` may nest; this renderer needs 1.
    pub max_recursion: u32,
    /// Alignment of scratch addresses.
    pub scratch_alignment: u32,
    /// Most triangles in a bottom-level structure.
    pub max_primitives: u64,
    /// Most instances in a top-level structure.
    pub max_instances: u64,
    /// Most rays in one launch.
    pub max_invocations: u32,
}

/// What the renderer may know about its device.
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
    /// Present when the ray tracing pipeline can be used.
    pub ray_tracing: Option<RayTracingLimits>,
    /// Whether `rayQueryEXT` can be used (acceleration structures are there too then).
    pub ray_query: bool,
    /// Whether passes are timed.
    pub timestamps: bool,
    /// Highest anisotropy, `None` without the feature.
    pub anisotropy: Option<f32>,
    /// Whether lines instead of filled triangles can be drawn.
    pub wireframe: bool,
    /// Whether BC1 to BC7 textures can be sampled.
    pub bc: bool,
    /// 16-bit floats in arithmetic and storage.
    pub float16: bool,
    /// 8-bit and 16-bit values in buffers.
    pub small_storage: bool,
    /// Invocations of a subgroup.
    pub subgroup_size: u32,
    /// Most textures at a time (binding 1).
    pub max_textures: u32,
    /// Most storage images at a time (binding 2).
    pub max_storage_images: u32,
    /// Largest width and height of a 2D image.
    pub max_image_size: u32,
    /// Whether it is Vulkan in software, where the choice of tracer differs.
    pub software: bool,
}

/// What is switched on at device creation.
#[derive(Clone, Copy, Default)]
pub(crate) struct Abilities {
    pub acceleration: bool,
    pub pipeline: bool,
    pub query: bool,
    pub anisotropy: bool,
    pub wireframe: bool,
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
}

/// The device that was chosen.
pub(crate) struct Choice {
    pub physical: vk::PhysicalDevice,
    pub queue_family: u32,
    pub timestamp_bits: u32,
    pub timestamp_period: f32,
    pub abilities: Abilities,
    pub info: DeviceInfo,
}

/// Most entries of the texture table, whatever the device would allow.
const TEXTURES: u32 = 65536;
/// Most entries of the storage image table.
const STORAGE_IMAGES: u32 = 4096;
/// Invocations of the largest groups of compute shaders: 16 x 16. Vulkan promises half as many, drivers have more.
const GROUP: u32 = 256;

/// Chooses among the devices that meet the requirements: the one `prefer` names (part of its name, or its index),
/// else discrete before integrated before virtual before software.
pub(crate) fn choose(instance: &Instance, options: &DeviceOptions) -> Result<Choice, Error> {
    let prefer = options.prefer.as_deref();
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }
        .context("vkEnumeratePhysicalDevices")?;
    let mut refused = Vec::new();
    let mut usable: Vec<(usize, Choice)> = Vec::new();
    for (index, physical) in devices.into_iter().enumerate() {
        match examine(instance, physical, options)? {
            Ok(choice) => usable.push((index, choice)),
            Err(reason) => refused.push(reason),
        }
    }
    let best = usable
        .iter()
        .enumerate()
        .max_by_key(|(order, (_, c))| (c.info.kind, std::cmp::Reverse(*order)))
        .map(|(order, _)| order);
    let wanted = prefer
        .map(str::trim)
        .filter(|p| !p.is_empty())
        .and_then(|prefer| {
            let lower = prefer.to_lowercase();
            let number = prefer.parse::<usize>().ok();
            let found = usable.iter().position(|(index, c)| {
                number == Some(*index)
                    || (number.is_none() && c.info.name.to_lowercase().contains(&lower))
            });
            if found.is_none() {
                log::warn!("no usable Vulkan device matches `{prefer}`, taking the best one");
            }
            found
        });
    match wanted.or(best) {
        Some(order) => Ok(usable.swap_remove(order).1),
        None if refused.is_empty() => Err(Error::NoDevice("the drivers offer none".to_owned())),
        None => Err(Error::NoDevice(refused.join("; "))),
    }
}

/// Checks one device: what it can do, or the one line that says why it cannot be used.
fn examine(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    options: &DeviceOptions,
) -> Result<Result<Choice, String>, Error> {
    let raw = &instance.raw;
    // SAFETY: the physical device belongs to the live instance.
    let properties = unsafe { raw.get_physical_device_properties(physical) };
    let name = properties.device_name_as_c_str().map_or_else(
        |_| "unnamed device".to_owned(),
        |n| n.to_string_lossy().into_owned(),
    );
    if properties.api_version < vk::API_VERSION_1_2 {
        return Ok(Err(format!(
            "{name} offers Vulkan {}.{}, 1.2 is needed",
            vk::api_version_major(properties.api_version),
            vk::api_version_minor(properties.api_version)
        )));
    }
    // SAFETY: as above.
    let extensions = unsafe { raw.enumerate_device_extension_properties(physical) }
        .context("vkEnumerateDeviceExtensionProperties")?;
    let has = |wanted: &CStr| {
        extensions
            .iter()
            .any(|e| e.extension_name_as_c_str().is_ok_and(|n| n == wanted))
    };

    let acceleration_ext = options.allow_ray_tracing
        && has(khr::acceleration_structure::NAME)
        && has(khr::deferred_host_operations::NAME);
    let pipeline_ext = acceleration_ext && has(khr::ray_tracing_pipeline::NAME);
    let query_ext = acceleration_ext && has(khr::ray_query::NAME);
    let dynamic_ext =
        has(ext::extended_dynamic_state::NAME) && has(ext::extended_dynamic_state3::NAME);

    let mut f11 = vk::PhysicalDeviceVulkan11Features::default();
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut f_accel = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
    let mut f_pipeline = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default();
    let mut f_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
    let mut f_dynamic = vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT::default();
    let mut f_dynamic3 = vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT::default();
    let mut features = vk::PhysicalDeviceFeatures2::default()
        .push_next(&mut f11)
        .push_next(&mut f12);
    if acceleration_ext {
        features = features.push_next(&mut f_accel);
    }
    if pipeline_ext {
        features = features.push_next(&mut f_pipeline);
    }
    if query_ext {
        features = features.push_next(&mut f_query);
    }
    if dynamic_ext {
        features = features
            .push_next(&mut f_dynamic)
            .push_next(&mut f_dynamic3);
    }
    // SAFETY: the chain holds only structures of this version and of extensions that the device has.
    unsafe { raw.get_physical_device_features2(physical, &mut features) };
    let base = features.features;

    let on = |b: vk::Bool32| b == vk::TRUE;
    let required = [
        ("bufferDeviceAddress", f12.buffer_device_address),
        ("scalarBlockLayout", f12.scalar_block_layout),
        ("timelineSemaphore", f12.timeline_semaphore),
        ("runtimeDescriptorArray", f12.runtime_descriptor_array),
        (
            "descriptorBindingPartiallyBound",
            f12.descriptor_binding_partially_bound,
        ),
        (
            "descriptorBindingUpdateUnusedWhilePending",
            f12.descriptor_binding_update_unused_while_pending,
        ),
        (
            "descriptorBindingSampledImageUpdateAfterBind",
            f12.descriptor_binding_sampled_image_update_after_bind,
        ),
        (
            "descriptorBindingStorageImageUpdateAfterBind",
            f12.descriptor_binding_storage_image_update_after_bind,
        ),
        (
            "shaderSampledImageArrayNonUniformIndexing",
            f12.shader_sampled_image_array_non_uniform_indexing,
        ),
        (
            "shaderStorageImageArrayNonUniformIndexing",
            f12.shader_storage_image_array_non_uniform_indexing,
        ),
        (
            "shaderSampledImageArrayDynamicIndexing",
            base.shader_sampled_image_array_dynamic_indexing,
        ),
        (
            "shaderStorageImageArrayDynamicIndexing",
            base.shader_storage_image_array_dynamic_indexing,
        ),
        ("shaderInt64", base.shader_int64),
    ];
    let mut missing: Vec<&str> = required.iter().filter(|r| !on(r.1)).map(|r| r.0).collect();
    if properties.limits.max_compute_work_group_invocations < GROUP {
        missing.push("compute groups of 256");
    }
    if instance.surface.is_some() && !has(khr::swapchain::NAME) {
        missing.push("VK_KHR_swapchain");
    }
    if !missing.is_empty() {
        return Ok(Err(format!("{name} lacks {}", missing.join(", "))));
    }

    // SAFETY: as above.
    let families = unsafe { raw.get_physical_device_queue_family_properties(physical) };
    let mut queue_family = None;
    for (index, family) in (0u32..).zip(&families) {
        if !family
            .queue_flags
            .contains(vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE)
        {
            continue;
        }
        if let Some((functions, surface)) = &instance.surface {
            // SAFETY: surface and physical device belong to the same live instance.
            let can =
                unsafe { functions.get_physical_device_surface_support(physical, index, *surface) }
                    .context("vkGetPhysicalDeviceSurfaceSupportKHR")?;
            if !can {
                continue;
            }
        }
        queue_family = Some((index, family.timestamp_valid_bits));
        break;
    }
    let Some((queue_family, timestamp_bits)) = queue_family else {
        return Ok(Err(format!(
            "{name} has no queue for graphics and compute that can show pictures in the window"
        )));
    };

    // Scene descriptors change while frames are in flight, hence update-after-bind.
    let acceleration = acceleration_ext
        && on(f_accel.acceleration_structure)
        && on(f_accel.descriptor_binding_acceleration_structure_update_after_bind);
    let pipeline = acceleration && pipeline_ext && on(f_pipeline.ray_tracing_pipeline);
    let query = acceleration && query_ext && on(f_query.ray_query);
    let mut abilities = Abilities {
        acceleration: pipeline || query,
        pipeline,
        query,
        anisotropy: on(base.sampler_anisotropy),
        wireframe: on(base.fill_mode_non_solid),
        bc: on(base.texture_compression_bc),
        extended_formats: on(base.shader_storage_image_extended_formats),
        fragment_stores: on(base.fragment_stores_and_atomics),
        vertex_stores: on(base.vertex_pipeline_stores_and_atomics),
        multi_draw_indirect: on(base.multi_draw_indirect),
        first_instance: on(base.draw_indirect_first_instance),
        int16: on(base.shader_int16),
        float16: on(f12.shader_float16),
        int8: on(f12.shader_int8),
        storage16: on(f11.storage_buffer16_bit_access),
        storage8: on(f12.storage_buffer8_bit_access),
        dynamic_state: on(f_dynamic.extended_dynamic_state)
            && on(f_dynamic3.extended_dynamic_state3_color_blend_enable)
            && on(f_dynamic3.extended_dynamic_state3_color_blend_equation),
    };
    if options.required_only {
        abilities = Abilities::default();
    }

    let mut p11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut p12 = vk::PhysicalDeviceVulkan12Properties::default();
    let mut p_accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut p_pipeline = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
    let mut p2 = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut p11)
        .push_next(&mut p12);
    if acceleration_ext {
        p2 = p2.push_next(&mut p_accel);
    }
    if pipeline_ext {
        p2 = p2.push_next(&mut p_pipeline);
    }
    // SAFETY: the chain holds only structures of this version and of extensions that the device has.
    unsafe { raw.get_physical_device_properties2(physical, &mut p2) };
    if pipeline && p_pipeline.max_ray_recursion_depth == 0 {
        abilities.pipeline = false;
    }

    let resources = p12
        .max_per_stage_update_after_bind_resources
        .saturating_sub(STORAGE_IMAGES + 256);
    let max_textures = TEXTURES
        .min(p12.max_per_stage_descriptor_update_after_bind_sampled_images)
        .min(p12.max_descriptor_set_update_after_bind_sampled_images)
        .min(resources);
    let max_storage_images = STORAGE_IMAGES
        .min(p12.max_per_stage_descriptor_update_after_bind_storage_images)
        .min(p12.max_descriptor_set_update_after_bind_storage_images);
    let version = properties.api_version;
    let text = |t: Result<&CStr, _>| {
        t.map_or_else(
            |_: std::ffi::FromBytesUntilNulError| String::new(),
            |t| t.to_string_lossy().into_owned(),
        )
    };
    let kind = match properties.device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    };
    let info = DeviceInfo {
        name,
        driver: format!(
            "{} {}",
            text(p12.driver_name_as_c_str()),
            text(p12.driver_info_as_c_str())
        ),
        kind,
        api_version: (
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version),
        ),
        vendor_id: properties.vendor_id,
        ray_tracing: abilities.pipeline.then_some(RayTracingLimits {
            handle_size: p_pipeline.shader_group_handle_size,
            handle_alignment: p_pipeline.shader_group_handle_alignment.max(1),
            base_alignment: p_pipeline.shader_group_base_alignment.max(1),
            max_recursion: p_pipeline.max_ray_recursion_depth,
            scratch_alignment: p_accel
                .min_acceleration_structure_scratch_offset_alignment
                .max(1),
            max_primitives: p_accel.max_primitive_count,
            max_instances: p_accel.max_instance_count,
            max_invocations: p_pipeline.max_ray_dispatch_invocation_count,
        }),
        ray_query: abilities.query,
        timestamps: timestamp_bits > 0 && properties.limits.timestamp_period > 0.0,
        anisotropy: abilities
            .anisotropy
            .then_some(properties.limits.max_sampler_anisotropy),
        wireframe: abilities.wireframe,
        bc: abilities.bc,
        float16: abilities.float16 && abilities.storage16,
        small_storage: abilities.storage16 && abilities.storage8,
        subgroup_size: p11.subgroup_size,
        max_textures,
        max_storage_images,
        max_image_size: properties.limits.max_image_dimension2_d,
        software: kind == DeviceKind::Cpu,
    };
    Ok(Ok(Choice {
        physical,
        queue_family,
        timestamp_bits,
        timestamp_period: properties.limits.timestamp_period,
        abilities,
        info,
    }))
}

/// Makes the logical device with everything in `choice.abilities` switched on.
pub(crate) fn create_device(instance: &Instance, choice: &Choice) -> Result<ash::Device, Error> {
    let a = choice.abilities;
    let mut extensions = Vec::new();
    if instance.surface.is_some() {
        extensions.push(khr::swapchain::NAME.as_ptr());
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
