//! Ray tracing pipelines with their shader binding tables.

use ash::vk;
use shaders::Spirv;

use super::buffer::{Buffer, BufferDesc, BufferUsage, Memory};
use super::device::Device;
use super::error::{Context, Error};
use super::pipeline::{Constants, Module, Pipeline, one};

/// A triangle hit group; a hit group without shaders is valid.
#[derive(Clone, Copy, Debug, Default)]
pub struct HitGroup<'a> {
    /// Runs at the nearest hit.
    pub closest_hit: Option<&'a Spirv>,
    /// Runs for each candidate on non-opaque geometry.
    pub any_hit: Option<&'a Spirv>,
}

/// Parameters of a [`RayTracingPipeline`].
#[derive(Clone, Copy, Debug)]
pub struct RayTracingDesc<'a> {
    /// Label.
    pub name: &'a str,
    /// Ray generation shader.
    pub raygen: &'a Spirv,
    /// Miss shaders, by the ray's miss index.
    pub miss: &'a [&'a Spirv],
    /// Hit groups, by the sum of instance offset and ray offset.
    pub hit: &'a [HitGroup<'a>],
    /// Specialization constants of all stages: id and 32-bit value.
    pub constants: &'a [(u32, u32)],
}

/// Regions of a pipeline's shader binding table.
#[derive(Clone, Copy)]
pub(crate) struct SbtRegions {
    pub raygen: vk::StridedDeviceAddressRegionKHR,
    pub miss: vk::StridedDeviceAddressRegionKHR,
    pub hit: vk::StridedDeviceAddressRegionKHR,
}

/// A ray tracing pipeline without recursion (depth 1): only ray generation shaders launch rays. With its shader binding
/// table.
pub struct RayTracingPipeline {
    pipeline: Pipeline,
    regions: SbtRegions,
    _table: Buffer,
}

impl RayTracingPipeline {
    /// Compiles a pipeline and fills its table.
    ///
    /// # Errors
    /// A device without ray tracing pipelines; an error of the driver; out of memory.
    pub fn new(device: &Device, desc: &RayTracingDesc<'_>) -> Result<Self, Error> {
        let (Some(functions), Some(limits)) = (&device.0.ray_tracing, device.0.info.ray_tracing)
        else {
            return Err(Error::Unsupported {
                name: desc.name.to_owned(),
                what: "a ray tracing pipeline".to_owned(),
                device: device.0.info.name.clone(),
            });
        };
        let pipeline = compile(device, functions, desc)?;
        let size = limits.handle_size as usize;
        let groups = 1 + desc.miss.len() + desc.hit.len();
        let count = u32::try_from(groups).unwrap_or(u32::MAX);
        // SAFETY: all groups of the pipeline, with room for their handles.
        let handles = unsafe {
            functions.get_ray_tracing_shader_group_handles(pipeline.raw(), 0, count, size * groups)
        }
        .context("vkGetRayTracingShaderGroupHandlesKHR")?;

        let layout = TableLayout::new(
            limits.handle_size,
            limits.handle_alignment,
            limits.base_alignment,
            desc.miss.len(),
            desc.hit.len(),
        );
        let bytes = layout.fill(&handles, size);
        let table = Buffer::new(
            device,
            &BufferDesc {
                name: desc.name,
                // The buffer's alignment may be less than that of a region.
                size: layout.size + u64::from(limits.base_alignment),
                usage: BufferUsage::SBT,
                memory: Memory::Device,
            },
        )?;
        let base = table
            .address()
            .next_multiple_of(u64::from(limits.base_alignment));
        device.upload_buffer(&table, base - table.address(), &bytes)?;
        let region = |start: u64, records: usize, stride: u64| {
            vk::StridedDeviceAddressRegionKHR::default()
                .device_address(if records == 0 { 0 } else { base + start })
                .stride(stride)
                .size(records as u64 * stride)
        };
        let regions = SbtRegions {
            // Size and stride of the ray generation region must be equal.
            raygen: region(0, 1, layout.raygen_stride),
            miss: region(layout.miss, desc.miss.len(), layout.stride),
            hit: region(layout.hit, desc.hit.len(), layout.stride),
        };
        Ok(Self {
            pipeline,
            regions,
            _table: table,
        })
    }

    pub(crate) fn raw(&self) -> vk::Pipeline {
        self.pipeline.raw()
    }

    pub(crate) fn regions(&self) -> SbtRegions {
        self.regions
    }
}

/// Compiles a pipeline; its groups are ray generation, miss shaders, hit groups.
fn compile(
    device: &Device,
    functions: &ash::khr::ray_tracing_pipeline::Device,
    desc: &RayTracingDesc<'_>,
) -> Result<Pipeline, Error> {
    let constants = Constants::new(desc.constants);
    let constants = constants.info();
    let mut modules = Vec::new();
    let mut stages = Vec::new();
    let mut add = |code: &Spirv, flags: vk::ShaderStageFlags| -> Result<u32, Error> {
        let module = Module::new(device, code)?;
        stages.push(
            vk::PipelineShaderStageCreateInfo::default()
                .stage(flags)
                .module(module.raw)
                .name(c"main")
                .specialization_info(&constants),
        );
        modules.push(module);
        Ok(u32::try_from(modules.len() - 1).unwrap_or(vk::SHADER_UNUSED_KHR))
    };
    let empty = vk::RayTracingShaderGroupCreateInfoKHR::default()
        .general_shader(vk::SHADER_UNUSED_KHR)
        .closest_hit_shader(vk::SHADER_UNUSED_KHR)
        .any_hit_shader(vk::SHADER_UNUSED_KHR)
        .intersection_shader(vk::SHADER_UNUSED_KHR);
    let general = empty.ty(vk::RayTracingShaderGroupTypeKHR::GENERAL);
    let mut groups =
        vec![general.general_shader(add(desc.raygen, vk::ShaderStageFlags::RAYGEN_KHR)?)];
    for miss in desc.miss {
        groups.push(general.general_shader(add(miss, vk::ShaderStageFlags::MISS_KHR)?));
    }
    for hit in desc.hit {
        let mut group = empty.ty(vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP);
        if let Some(code) = hit.closest_hit {
            group = group.closest_hit_shader(add(code, vk::ShaderStageFlags::CLOSEST_HIT_KHR)?);
        }
        if let Some(code) = hit.any_hit {
            group = group.any_hit_shader(add(code, vk::ShaderStageFlags::ANY_HIT_KHR)?);
        }
        groups.push(group);
    }
    let infos = [vk::RayTracingPipelineCreateInfoKHR::default()
        .stages(&stages)
        .groups(&groups)
        .max_pipeline_ray_recursion_depth(1)
        .layout(device.0.bindless.pipeline_layout)];
    // SAFETY: all pointers of the description are to live data; the modules declare the common layout.
    let made = unsafe {
        functions.create_ray_tracing_pipelines(
            vk::DeferredOperationKHR::null(),
            device.0.pipeline_cache,
            &infos,
            None,
        )
    };
    one(device, made, "vkCreateRayTracingPipelinesKHR", desc.name)
}

/// Offsets of the records in a shader binding table: ray generation, miss, hit.
#[derive(Debug, PartialEq, Eq)]
struct TableLayout {
    stride: u64,
    raygen_stride: u64,
    miss: u64,
    misses: usize,
    hit: u64,
    size: u64,
}

impl TableLayout {
    fn new(handle: u32, handle_align: u32, base_align: u32, misses: usize, hits: usize) -> Self {
        let base = u64::from(base_align.max(1));
        let stride = u64::from(handle).next_multiple_of(u64::from(handle_align.max(1)));
        let raygen_stride = stride.next_multiple_of(base);
        let miss = raygen_stride;
        let hit = (miss + stride * misses as u64).next_multiple_of(base);
        Self {
            stride,
            raygen_stride,
            miss,
            misses,
            hit,
            size: hit + stride * hits as u64,
        }
    }

    /// The table's bytes, from the packed handles of the groups.
    fn fill(&self, handles: &[u8], handle: usize) -> Vec<u8> {
        let mut bytes = vec![0; usize::try_from(self.size).unwrap_or(0)];
        for (group, source) in handles.chunks_exact(handle.max(1)).enumerate() {
            let offset = match group {
                0 => 0,
                g if g <= self.misses => self.miss + self.stride * (g - 1) as u64,
                g => self.hit + self.stride * (g - 1 - self.misses) as u64,
            };
            let target = usize::try_from(offset)
                .ok()
                .and_then(|at| bytes.get_mut(at..at + source.len()));
            if let Some(target) = target {
                target.copy_from_slice(source);
            }
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_lie_at_the_alignments_of_the_device() {
        // Handle 32, handle alignment 32, base alignment 64: a common desktop device.
        let layout = TableLayout::new(32, 32, 64, 2, 3);
        assert_eq!(layout.raygen_stride, 64);
        assert_eq!((layout.miss, layout.hit, layout.size), (64, 128, 224));
        let handles: Vec<u8> = (1u8..=6).flat_map(|group| [group; 32]).collect();
        let bytes = layout.fill(&handles, 32);
        for (offset, group) in [(0, 1), (64, 2), (96, 3), (128, 4), (160, 5), (192, 6)] {
            assert_eq!(bytes[offset..offset + 32], [group; 32], "group {group}");
        }
        assert_eq!(bytes[32..64], [0; 32]);
    }
}
