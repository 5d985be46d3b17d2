//! Examines one physical device: requirements and optional features.

use std::ffi::CStr;

use ash::{ext, khr, vk};

use super::{Abilities, Choice, DeviceInfo, DeviceKind, RayTracingLimits};
use crate::gpu::device::DeviceOptions;
use crate::gpu::error::{Context, Error};
use crate::gpu::instance::Instance;

/// Maximum size of the texture table, even if the device allows more.
const TEXTURES: u32 = 65536;
/// Maximum size of the storage image table.
const STORAGE_IMAGES: u32 = 4096;
/// Invocations of the largest compute work groups: 16 x 16. Vulkan guarantees half as many, drivers support more.
const GROUP: u32 = 256;

/// Examines one device: its features, or the reason why it is unusable, in one line.
pub(super) fn examine(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    options: &DeviceOptions,
) -> Result<Choice, String> {
    // SAFETY: the physical device belongs to the live instance.
    let properties = unsafe { instance.raw.get_physical_device_properties(physical) };
    let name = device_name(&properties);
    // Only devices of version 1.2 accept queries of its features and properties.
    if properties.api_version < vk::API_VERSION_1_2 {
        return Err(format!(
            "{name} offers Vulkan {}.{}, 1.2 is needed",
            vk::api_version_major(properties.api_version),
            vk::api_version_minor(properties.api_version)
        ));
    }
    let failed = |error: Error| format!("{name}: {error}");
    let extensions = Extensions::of(instance, physical, options).map_err(failed)?;
    let features = Features::of(instance, physical, extensions);
    let mut missing = features.missing();
    if properties.limits.max_compute_work_group_invocations < GROUP {
        missing.push("compute groups of 256");
    }
    if instance.surface.is_some() && !extensions.swapchain {
        missing.push("VK_KHR_swapchain");
    }
    if !missing.is_empty() {
        return Err(format!("{name} lacks {}", missing.join(", ")));
    }
    let Some(queue) = QueueFamily::of(instance, physical).map_err(failed)? else {
        return Err(format!(
            "{name} has no queue for graphics and compute that can show pictures in the window"
        ));
    };
    let limits = Limits::of(instance, physical, extensions);
    let mut abilities = if options.required_only {
        Abilities::default()
    } else {
        features.abilities(extensions)
    };
    // A pipeline that does not allow `traceRayEXT` is useless.
    abilities.pipeline &= limits.pipeline.max_ray_recursion_depth > 0;
    Ok(Choice {
        physical,
        queue_family: queue.index,
        timestamp_bits: queue.timestamp_bits,
        timestamp_period: properties.limits.timestamp_period,
        abilities,
        info: info(name, &properties, &limits, abilities, &queue),
    })
}

fn device_name(properties: &vk::PhysicalDeviceProperties) -> String {
    properties.device_name_as_c_str().map_or_else(
        |_| "unnamed device".to_owned(),
        |n| n.to_string_lossy().into_owned(),
    )
}

/// Extensions that the device supports and the options allow.
#[derive(Clone, Copy)]
struct Extensions {
    /// Presentation to a window.
    swapchain: bool,
    /// Acceleration structures.
    acceleration: bool,
    /// The ray tracing pipeline, with `acceleration`.
    pipeline: bool,
    /// `rayQueryEXT`, with `acceleration`.
    query: bool,
    /// Both extensions of dynamic blending, culling and depth tests.
    dynamic_state: bool,
    /// The clock in shaders.
    shader_clock: bool,
    /// Numbers of presentations, and waiting for one, where there is a window.
    present_wait: bool,
}

impl Extensions {
    fn of(
        instance: &Instance,
        physical: vk::PhysicalDevice,
        options: &DeviceOptions,
    ) -> Result<Self, Error> {
        // SAFETY: the physical device belongs to the live instance.
        let extensions = unsafe { instance.raw.enumerate_device_extension_properties(physical) }
            .context("vkEnumerateDeviceExtensionProperties")?;
        let has = |wanted: &CStr| {
            extensions
                .iter()
                .any(|e| e.extension_name_as_c_str().is_ok_and(|n| n == wanted))
        };
        // VK_KHR_acceleration_structure requires VK_KHR_deferred_host_operations.
        let acceleration = options.allow_ray_tracing
            && has(khr::acceleration_structure::NAME)
            && has(khr::deferred_host_operations::NAME);
        Ok(Self {
            swapchain: has(khr::swapchain::NAME),
            acceleration,
            pipeline: acceleration && has(khr::ray_tracing_pipeline::NAME),
            query: acceleration && has(khr::ray_query::NAME),
            dynamic_state: has(ext::extended_dynamic_state::NAME)
                && has(ext::extended_dynamic_state3::NAME),
            shader_clock: has(khr::shader_clock::NAME),
            present_wait: instance.surface.is_some()
                && has(khr::present_id::NAME)
                && has(khr::present_wait::NAME),
        })
    }
}

fn is_on(feature: vk::Bool32) -> bool {
    feature == vk::TRUE
}

/// Features of a device; those of absent extensions are off. Only the flags are valid: the structures were chained for
/// one call, and their `p_next` pointers are stale.
#[derive(Default)]
struct Features {
    base: vk::PhysicalDeviceFeatures,
    v11: vk::PhysicalDeviceVulkan11Features<'static>,
    v12: vk::PhysicalDeviceVulkan12Features<'static>,
    acceleration: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    pipeline: vk::PhysicalDeviceRayTracingPipelineFeaturesKHR<'static>,
    query: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
    dynamic: vk::PhysicalDeviceExtendedDynamicStateFeaturesEXT<'static>,
    dynamic3: vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT<'static>,
    clock: vk::PhysicalDeviceShaderClockFeaturesKHR<'static>,
    present_id: vk::PhysicalDevicePresentIdFeaturesKHR<'static>,
    present_wait: vk::PhysicalDevicePresentWaitFeaturesKHR<'static>,
}

impl Features {
    /// Queries a device of Vulkan 1.2.
    fn of(instance: &Instance, physical: vk::PhysicalDevice, extensions: Extensions) -> Self {
        let mut found = Self::default();
        let mut chain = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut found.v11)
            .push_next(&mut found.v12);
        if extensions.acceleration {
            chain = chain.push_next(&mut found.acceleration);
        }
        if extensions.pipeline {
            chain = chain.push_next(&mut found.pipeline);
        }
        if extensions.query {
            chain = chain.push_next(&mut found.query);
        }
        if extensions.dynamic_state {
            chain = chain
                .push_next(&mut found.dynamic)
                .push_next(&mut found.dynamic3);
        }
        if extensions.shader_clock {
            chain = chain.push_next(&mut found.clock);
        }
        if extensions.present_wait {
            chain = chain
                .push_next(&mut found.present_id)
                .push_next(&mut found.present_wait);
        }
        // SAFETY: the chain holds only structures of this version and of extensions that the device has.
        unsafe { (instance.raw).get_physical_device_features2(physical, &mut chain) };
        found.base = chain.features;
        found
    }

    /// Names of required features that the device lacks.
    fn missing(&self) -> Vec<&'static str> {
        let (base, v12) = (&self.base, &self.v12);
        let required = [
            ("bufferDeviceAddress", v12.buffer_device_address),
            ("scalarBlockLayout", v12.scalar_block_layout),
            ("timelineSemaphore", v12.timeline_semaphore),
            ("runtimeDescriptorArray", v12.runtime_descriptor_array),
            (
                "descriptorBindingPartiallyBound",
                v12.descriptor_binding_partially_bound,
            ),
            (
                "descriptorBindingUpdateUnusedWhilePending",
                v12.descriptor_binding_update_unused_while_pending,
            ),
            (
                "descriptorBindingSampledImageUpdateAfterBind",
                v12.descriptor_binding_sampled_image_update_after_bind,
            ),
            (
                "descriptorBindingStorageImageUpdateAfterBind",
                v12.descriptor_binding_storage_image_update_after_bind,
            ),
            (
                "shaderSampledImageArrayNonUniformIndexing",
                v12.shader_sampled_image_array_non_uniform_indexing,
            ),
            (
                "shaderStorageImageArrayNonUniformIndexing",
                v12.shader_storage_image_array_non_uniform_indexing,
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
        let absent = required.iter().filter(|(_, feature)| !is_on(*feature));
        absent.map(|(name, _)| *name).collect()
    }

    /// The features to enable, without regard to limits.
    fn abilities(&self, extensions: Extensions) -> Abilities {
        let Self { base, v11, v12, .. } = self;
        // Scene descriptors change while frames are in flight, hence update-after-bind.
        let acceleration = extensions.acceleration
            && is_on(self.acceleration.acceleration_structure)
            && is_on(
                (self.acceleration).descriptor_binding_acceleration_structure_update_after_bind,
            );
        let pipeline =
            acceleration && extensions.pipeline && is_on(self.pipeline.ray_tracing_pipeline);
        let query = acceleration && extensions.query && is_on(self.query.ray_query);
        Abilities {
            acceleration: pipeline || query,
            pipeline,
            query,
            anisotropy: is_on(base.sampler_anisotropy),
            wireframe: is_on(base.fill_mode_non_solid),
            present_wait: is_on(self.present_id.present_id)
                && is_on(self.present_wait.present_wait),
            bc: is_on(base.texture_compression_bc),
            extended_formats: is_on(base.shader_storage_image_extended_formats),
            fragment_stores: is_on(base.fragment_stores_and_atomics),
            vertex_stores: is_on(base.vertex_pipeline_stores_and_atomics),
            multi_draw_indirect: is_on(base.multi_draw_indirect),
            first_instance: is_on(base.draw_indirect_first_instance),
            int16: is_on(base.shader_int16),
            float16: is_on(v12.shader_float16),
            int8: is_on(v12.shader_int8),
            storage16: is_on(v11.storage_buffer16_bit_access),
            storage8: is_on(v12.storage_buffer8_bit_access),
            dynamic_state: is_on(self.dynamic.extended_dynamic_state)
                && is_on(self.dynamic3.extended_dynamic_state3_color_blend_enable)
                && is_on(self.dynamic3.extended_dynamic_state3_color_blend_equation),
            shader_clock: is_on(self.clock.shader_subgroup_clock),
        }
    }
}

/// The queue family of all submissions.
struct QueueFamily {
    index: u32,
    /// Valid bits of its timestamps; 0: no timestamps.
    timestamp_bits: u32,
}

impl QueueFamily {
    /// The first family with graphics and compute that can present to the window, if there is one.
    fn of(instance: &Instance, physical: vk::PhysicalDevice) -> Result<Option<Self>, Error> {
        // SAFETY: the physical device belongs to the live instance.
        let families =
            unsafe { (instance.raw).get_physical_device_queue_family_properties(physical) };
        for (index, family) in (0u32..).zip(&families) {
            let draws = family
                .queue_flags
                .contains(vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE);
            if draws && can_present(instance, physical, index)? {
                return Ok(Some(Self {
                    index,
                    timestamp_bits: family.timestamp_valid_bits,
                }));
            }
        }
        Ok(None)
    }
}

/// Whether a queue family can present to the window; without a window, every family can.
fn can_present(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    family: u32,
) -> Result<bool, Error> {
    let Some((functions, surface)) = &instance.surface else {
        return Ok(true);
    };
    // SAFETY: surface and physical device belong to the same live instance.
    unsafe { functions.get_physical_device_surface_support(physical, family, *surface) }
        .context("vkGetPhysicalDeviceSurfaceSupportKHR")
}

/// Limits of a device; those of absent extensions are zero. Only the numbers are valid: the structures were chained for
/// one call, and their `p_next` pointers are stale.
#[derive(Default)]
struct Limits {
    v11: vk::PhysicalDeviceVulkan11Properties<'static>,
    v12: vk::PhysicalDeviceVulkan12Properties<'static>,
    acceleration: vk::PhysicalDeviceAccelerationStructurePropertiesKHR<'static>,
    pipeline: vk::PhysicalDeviceRayTracingPipelinePropertiesKHR<'static>,
}

impl Limits {
    /// Queries a device of Vulkan 1.2.
    fn of(instance: &Instance, physical: vk::PhysicalDevice, extensions: Extensions) -> Self {
        let mut found = Self::default();
        let mut chain = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut found.v11)
            .push_next(&mut found.v12);
        if extensions.acceleration {
            chain = chain.push_next(&mut found.acceleration);
        }
        if extensions.pipeline {
            chain = chain.push_next(&mut found.pipeline);
        }
        // SAFETY: the chain holds only structures of this version and of extensions that the device has.
        unsafe { (instance.raw).get_physical_device_properties2(physical, &mut chain) };
        found
    }

    /// Size of the texture table. The per-stage limit of resources covers all tables: the size leaves room for storage
    /// images and for 256 other descriptors.
    fn max_textures(&self) -> u32 {
        let limits = &self.v12;
        let resources = limits
            .max_per_stage_update_after_bind_resources
            .saturating_sub(STORAGE_IMAGES + 256);
        TEXTURES
            .min(limits.max_per_stage_descriptor_update_after_bind_sampled_images)
            .min(limits.max_descriptor_set_update_after_bind_sampled_images)
            .min(resources)
    }

    /// Size of the storage image table.
    fn max_storage_images(&self) -> u32 {
        let limits = &self.v12;
        STORAGE_IMAGES
            .min(limits.max_per_stage_descriptor_update_after_bind_storage_images)
            .min(limits.max_descriptor_set_update_after_bind_storage_images)
    }

    fn ray_tracing(&self) -> RayTracingLimits {
        let (acceleration, pipeline) = (&self.acceleration, &self.pipeline);
        RayTracingLimits {
            handle_size: pipeline.shader_group_handle_size,
            handle_alignment: pipeline.shader_group_handle_alignment.max(1),
            base_alignment: pipeline.shader_group_base_alignment.max(1),
            max_recursion: pipeline.max_ray_recursion_depth,
            scratch_alignment: acceleration
                .min_acceleration_structure_scratch_offset_alignment
                .max(1),
            max_primitives: acceleration.max_primitive_count,
            max_instances: acceleration.max_instance_count,
            max_invocations: pipeline.max_ray_dispatch_invocation_count,
        }
    }

    /// Driver name and version text.
    fn driver(&self) -> String {
        let text = |t: Result<&CStr, _>| {
            t.map_or_else(
                |_: std::ffi::FromBytesUntilNulError| String::new(),
                |t| t.to_string_lossy().into_owned(),
            )
        };
        format!(
            "{} {}",
            text(self.v12.driver_name_as_c_str()),
            text(self.v12.driver_info_as_c_str())
        )
    }
}

fn kind(of: vk::PhysicalDeviceType) -> DeviceKind {
    match of {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}

/// Properties of the device for the renderer. Disabled features are reported as absent.
fn info(
    name: String,
    properties: &vk::PhysicalDeviceProperties,
    limits: &Limits,
    abilities: Abilities,
    queue: &QueueFamily,
) -> DeviceInfo {
    let version = properties.api_version;
    let kind = kind(properties.device_type);
    DeviceInfo {
        name,
        driver: limits.driver(),
        kind,
        api_version: (
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version),
        ),
        vendor_id: properties.vendor_id,
        ray_tracing: abilities.pipeline.then(|| limits.ray_tracing()),
        ray_query: abilities.query,
        timestamps: queue.timestamp_bits > 0 && properties.limits.timestamp_period > 0.0,
        shader_clock: abilities.shader_clock,
        anisotropy: abilities
            .anisotropy
            .then_some(properties.limits.max_sampler_anisotropy),
        wireframe: abilities.wireframe,
        present_wait: abilities.present_wait,
        bc: abilities.bc,
        float16: abilities.float16 && abilities.storage16,
        small_storage: abilities.storage16 && abilities.storage8,
        subgroup_size: limits.v11.subgroup_size,
        max_textures: limits.max_textures(),
        max_storage_images: limits.max_storage_images(),
        max_image_size: properties.limits.max_image_dimension2_d,
        software: kind == DeviceKind::Cpu,
    }
}
