//! What a profile changes in the driver's answers, and what it forbids at the creation of a device.

use std::ffi::{CStr, c_char, c_void};

use ash::vk;

use crate::profile::Profile;

/// Sets the field of a name, if it is one of those that profiles may set.
macro_rules! fields {
    ($function:ident $structure:ty: $($field:ident)*) => {
        /// Whether the field changes.
        fn $function(structure: &mut $structure, name: &str, value: f64) -> bool {
            match name {
                $(stringify!($field) => {
                    let old = std::mem::replace(&mut structure.$field, value as _);
                    old != structure.$field
                })*
                _ => false,
            }
        }
    };
}

fields!(base_limit vk::PhysicalDeviceLimits:
    max_image_dimension2_d max_image_array_layers max_sampler_allocation_count max_memory_allocation_count
    max_storage_buffer_range max_push_constants_size max_bound_descriptor_sets max_per_stage_resources
    max_compute_shared_memory_size max_compute_work_group_invocations max_sampler_anisotropy max_sampler_lod_bias
    max_draw_indirect_count min_storage_buffer_offset_alignment min_uniform_buffer_offset_alignment
    min_memory_map_alignment non_coherent_atom_size buffer_image_granularity optimal_buffer_copy_offset_alignment
    optimal_buffer_copy_row_pitch_alignment timestamp_period);
fields!(limit11 vk::PhysicalDeviceVulkan11Properties<'_>:
    subgroup_size max_memory_allocation_size);
fields!(limit12 vk::PhysicalDeviceVulkan12Properties<'_>:
    max_update_after_bind_descriptors_in_all_pools
    max_per_stage_descriptor_update_after_bind_samplers max_per_stage_descriptor_update_after_bind_sampled_images
    max_per_stage_descriptor_update_after_bind_storage_images max_per_stage_descriptor_update_after_bind_storage_buffers
    max_per_stage_update_after_bind_resources
    max_descriptor_set_update_after_bind_samplers max_descriptor_set_update_after_bind_sampled_images
    max_descriptor_set_update_after_bind_storage_images max_descriptor_set_update_after_bind_storage_buffers);
fields!(limit_rays vk::PhysicalDeviceRayTracingPipelinePropertiesKHR<'_>:
    shader_group_handle_alignment shader_group_base_alignment max_ray_recursion_depth
    max_ray_dispatch_invocation_count);
fields!(limit_structures vk::PhysicalDeviceAccelerationStructurePropertiesKHR<'_>:
    max_primitive_count max_instance_count max_geometry_count min_acceleration_structure_scratch_offset_alignment);
fields!(base_feature vk::PhysicalDeviceFeatures:
    shader_int64 shader_int16 shader_sampled_image_array_dynamic_indexing shader_storage_image_array_dynamic_indexing
    sampler_anisotropy fill_mode_non_solid texture_compression_bc shader_storage_image_extended_formats
    fragment_stores_and_atomics vertex_pipeline_stores_and_atomics multi_draw_indirect draw_indirect_first_instance
    geometry_shader tessellation_shader shader_float64 wide_lines);
fields!(feature11 vk::PhysicalDeviceVulkan11Features<'_>: storage_buffer16_bit_access);
fields!(feature12 vk::PhysicalDeviceVulkan12Features<'_>:
    buffer_device_address scalar_block_layout timeline_semaphore runtime_descriptor_array
    descriptor_binding_partially_bound descriptor_binding_update_unused_while_pending
    descriptor_binding_sampled_image_update_after_bind descriptor_binding_storage_image_update_after_bind
    shader_sampled_image_array_non_uniform_indexing shader_storage_image_array_non_uniform_indexing
    shader_float16 shader_int8 storage_buffer8_bit_access);
fields!(feature_structures vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'_>:
    acceleration_structure descriptor_binding_acceleration_structure_update_after_bind);
fields!(feature_dynamic3 vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT<'_>:
    extended_dynamic_state3_color_blend_enable extended_dynamic_state3_color_blend_equation);

/// Calls `each` with every structure of a chain.
///
/// # Safety
/// `next` must be the `p_next` of a valid structure.
unsafe fn walk(next: *const c_void, mut each: impl FnMut(vk::StructureType, *mut c_void)) {
    let mut next = next.cast_mut().cast::<vk::BaseOutStructure<'_>>();
    while !next.is_null() {
        // SAFETY: every structure of a chain begins with its type and the next one.
        let found = unsafe { next.read() };
        each(found.s_type, next.cast());
        next = found.p_next;
    }
}

/// The structure at a place of a chain.
///
/// # Safety
/// It must be one of the type `T`, and used by nothing else.
unsafe fn at<'a, T>(place: *mut c_void) -> &'a mut T {
    // SAFETY: the caller's promise.
    unsafe { &mut *place.cast() }
}

/// Sets the field of a name in the structure at a place of a chain, by its type; whether the field changes.
macro_rules! set {
    ($kind:expr, $place:expr, $name:expr, $value:expr; $($structure:ident $function:ident),*) => {
        match $kind {
            $(vk::StructureType::$structure => {
                // SAFETY: the type of the structure says which one it is.
                let structure = unsafe { at($place) };
                $function(structure, $name, $value)
            })*
            _ => false,
        }
    };
}

/// Writes a text that Vulkan stores in an array.
fn write_text(array: &mut [c_char], text: &str) {
    let last = array.len() - 1;
    array.fill(0);
    for (to, from) in array.iter_mut().take(last).zip(text.bytes()) {
        *to = from as _;
    }
}

/// # Safety
/// None; the type is that of the other functions.
pub unsafe fn properties(profile: &Profile, properties: &mut vk::PhysicalDeviceProperties) {
    if let Some(name) = &profile.name {
        write_text(&mut properties.device_name, name);
    }
    properties.device_type = profile.kind.unwrap_or(properties.device_type);
    properties.vendor_id = profile.vendor.unwrap_or(properties.vendor_id);
    properties.api_version = profile.api.unwrap_or(properties.api_version);
    for (name, value) in &profile.limits {
        base_limit(&mut properties.limits, name, *value);
    }
}

/// # Safety
/// The chain of `answer` must be valid.
pub unsafe fn properties2(profile: &Profile, answer: &mut vk::PhysicalDeviceProperties2<'_>) {
    // SAFETY: it has no requirements.
    unsafe { properties(profile, &mut answer.properties) };
    let change = |kind: vk::StructureType, place: *mut c_void| {
        for (name, value) in &profile.limits {
            set!(kind, place, name, *value;
                PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES limit11,
                PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES limit12,
                PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR limit_rays,
                PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR limit_structures);
        }
        if let Some(driver) = &profile.driver
            && kind == vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES
        {
            // SAFETY: the type of the structure says which one it is.
            let found: &mut vk::PhysicalDeviceVulkan12Properties<'_> = unsafe { at(place) };
            write_text(&mut found.driver_name, driver);
            write_text(&mut found.driver_info, "");
        }
    };
    // SAFETY: the caller's promise.
    unsafe { walk(answer.p_next, change) };
}

/// # Safety
/// None; the type is that of the other functions.
pub unsafe fn features(profile: &Profile, features: &mut vk::PhysicalDeviceFeatures) {
    mask_base(profile, features);
}

/// Switches off what the device lacks of the core features; whether anything changes.
fn mask_base(profile: &Profile, features: &mut vk::PhysicalDeviceFeatures) -> bool {
    let mut changed = false;
    for name in &profile.lacks {
        changed |= base_feature(features, name, 0.0);
    }
    changed
}

fn base_feature2(features: &mut vk::PhysicalDeviceFeatures2<'_>, name: &str, value: f64) -> bool {
    base_feature(&mut features.features, name, value)
}

/// Switches off what the device lacks in a chain of structures of features; whether anything changes.
///
/// # Safety
/// `next` must be the `p_next` of a valid structure.
unsafe fn mask(profile: &Profile, next: *const c_void) -> bool {
    let mut changed = false;
    let change = |kind: vk::StructureType, place: *mut c_void| {
        for name in &profile.lacks {
            changed |= set!(kind, place, name, 0.0;
                PHYSICAL_DEVICE_FEATURES_2 base_feature2,
                PHYSICAL_DEVICE_VULKAN_1_1_FEATURES feature11,
                PHYSICAL_DEVICE_VULKAN_1_2_FEATURES feature12,
                PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR feature_structures,
                PHYSICAL_DEVICE_EXTENDED_DYNAMIC_STATE_3_FEATURES_EXT feature_dynamic3);
        }
    };
    // SAFETY: the caller's promise.
    unsafe { walk(next, change) };
    changed
}

/// # Safety
/// The chain of `answer` must be valid.
pub unsafe fn features2(profile: &Profile, answer: &mut vk::PhysicalDeviceFeatures2<'_>) {
    // SAFETY: the caller's promise; a structure is a chain with itself at the beginning.
    unsafe { mask(profile, std::ptr::from_mut(answer).cast()) };
}

/// # Safety
/// None; the type is that of the other functions.
pub unsafe fn memory(profile: &Profile, answer: &mut vk::PhysicalDeviceMemoryProperties) {
    if profile.heaps.is_empty() {
        return;
    }
    answer.memory_heap_count = profile.heaps.len() as u32;
    answer.memory_type_count = profile.memory.len() as u32;
    for (to, from) in answer.memory_heaps.iter_mut().zip(&profile.heaps) {
        *to = *from;
    }
    for (to, from) in answer.memory_types.iter_mut().zip(&profile.memory) {
        *to = *from;
    }
}

/// # Safety
/// None; the type is that of the other functions.
pub unsafe fn memory2(profile: &Profile, answer: &mut vk::PhysicalDeviceMemoryProperties2<'_>) {
    // SAFETY: it has no requirements.
    unsafe { memory(profile, &mut answer.memory_properties) };
}

/// Takes what the device lacks from a format.
pub fn format(profile: &Profile, format: vk::Format, answer: &mut vk::FormatProperties) {
    let lacks = profile.format_lacks(format);
    answer.optimal_tiling_features &= !lacks;
    answer.linear_tiling_features &= !lacks;
}

/// Why a device of a profile cannot be created: it lacks an extension or a feature that is asked for.
///
/// # Safety
/// `info` and its chain must be valid. Where the answer is not `None`, the features have changed.
pub unsafe fn forbids(profile: &Profile, info: &vk::DeviceCreateInfo<'_>) -> Option<vk::Result> {
    // SAFETY: the caller's promise.
    let names = unsafe {
        names(
            info.pp_enabled_extension_names,
            info.enabled_extension_count,
        )
    };
    if names.iter().any(|name| profile.hides(name)) {
        return Some(vk::Result::ERROR_EXTENSION_NOT_PRESENT);
    }
    // SAFETY: the caller's promise.
    let chained = unsafe { mask(profile, info.p_next) };
    // SAFETY: null, or the structure of the core features.
    let base = unsafe { info.p_enabled_features.cast_mut().as_mut() };
    let base = base.is_some_and(|base| mask_base(profile, base));
    (chained || base).then_some(vk::Result::ERROR_FEATURE_NOT_PRESENT)
}

/// The names of a list.
///
/// # Safety
/// `names` must point at that many NUL-terminated texts, which outlive the result.
pub unsafe fn names<'a>(names: *const *const c_char, count: u32) -> Vec<&'a CStr> {
    // SAFETY: the caller's promise.
    let name = |place: usize| unsafe { CStr::from_ptr(*names.add(place)) };
    (0..count as usize).map(name).collect()
}

impl Profile {
    /// Whether the device lacks an extension.
    pub fn hides(&self, extension: &CStr) -> bool {
        self.hidden
            .iter()
            .any(|name| name.as_bytes() == extension.to_bytes())
    }
}
