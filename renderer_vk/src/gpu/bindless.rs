//! The descriptor set and the pipeline layout that all pipelines share.
//!
//! Binding 0: samplers; 1: sampled images; 2: storage images; 3: top-level acceleration structures (with ray tracing).
//! `shaders/common/bindless.glsl` declares the same bindings. Descriptors are written while frames are in flight
//! (update-after-bind); an index is reused only after the frames that may use it are over (`graveyard`).

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use ash::vk;

use super::device::{Device, lock};
use super::error::{Context, Error};
use super::select::{Abilities, DeviceInfo};

/// Maximum number of samplers.
const SAMPLERS: u32 = 64;
/// Maximum number of top-level structures at a time.
const SCENES: u32 = 16;
/// Size of push constants, bytes: the minimum that Vulkan guarantees.
pub(crate) const PUSH_BYTES: u32 = 128;

/// Filter between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
}

/// Filter between mip levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum MipFilter {
    /// Only level 0.
    None,
    /// The nearest level.
    Nearest,
    /// Linear between two levels.
    #[default]
    Linear,
}

/// Addressing outside of [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Repeats the image.
    #[default]
    Repeat,
    /// Clamps to the border texels.
    Clamp,
    /// Transparent black.
    Border,
}

/// Parameters of a sampler.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct SamplerDesc {
    /// Minification and magnification.
    pub filter: Filter,
    /// Mip levels.
    pub mip: MipFilter,
    /// Both axes.
    pub wrap: Wrap,
    /// Requested anisotropy; limited to the device's maximum, off below 1.
    pub anisotropy: f32,
    /// Added to the level of detail.
    pub lod_bias: f32,
}

/// Allocated and free indices of one binding.
#[derive(Default)]
struct Slots {
    free: Vec<u32>,
    next: u32,
    capacity: u32,
}

impl Slots {
    fn take(&mut self, what: &'static str) -> Result<u32, Error> {
        if let Some(index) = self.free.pop() {
            return Ok(index);
        }
        if self.next < self.capacity {
            self.next += 1;
            return Ok(self.next - 1);
        }
        Err(Error::Full {
            what,
            limit: self.capacity,
        })
    }
}

/// The descriptor set, its layout, and the free indices.
#[derive(Default)]
pub(crate) struct Bindless {
    /// Descriptors written so far.
    pub writes: AtomicU64,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    pub set: vk::DescriptorSet,
    pub pipeline_layout: vk::PipelineLayout,
    samplers: Mutex<Vec<(SamplerDesc, vk::Sampler)>>,
    textures: Mutex<Slots>,
    storages: Mutex<Slots>,
    scenes: Mutex<Slots>,
}

impl Bindless {
    /// Makes the layouts and the set.
    pub fn init(
        &mut self,
        raw: &ash::Device,
        info: &DeviceInfo,
        abilities: Abilities,
    ) -> Result<(), Error> {
        use vk::DescriptorType as T;
        let mut counts = vec![
            (T::SAMPLER, SAMPLERS),
            (T::SAMPLED_IMAGE, info.max_textures),
            (T::STORAGE_IMAGE, info.max_storage_images),
        ];
        if abilities.acceleration {
            counts.push((T::ACCELERATION_STRUCTURE_KHR, SCENES));
        }
        // Index 0 stays empty: for arrays of textures with dynamic indices, synchronization validation treats every
        // draw as a read of the first element, which would be a hazard if that is a render target.
        *lock(&self.textures) = Slots {
            next: 1,
            capacity: info.max_textures,
            ..Slots::default()
        };
        lock(&self.storages).capacity = info.max_storage_images;
        lock(&self.scenes).capacity = if abilities.acceleration { SCENES } else { 0 };
        self.set_layout = set_layout(raw, &counts)?;
        let sizes: Vec<_> = counts
            .iter()
            .map(|(kind, count)| vk::DescriptorPoolSize {
                ty: *kind,
                descriptor_count: *count,
            })
            .collect();
        let pool_info = vk::DescriptorPoolCreateInfo::default()
            .flags(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND)
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: pointers live here.
        self.pool = unsafe { raw.create_descriptor_pool(&pool_info, None) }
            .context("vkCreateDescriptorPool")?;
        let layouts = [self.set_layout];
        let set_info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.pool)
            .set_layouts(&layouts);
        // SAFETY: the pool has room for this one set.
        let sets = unsafe { raw.allocate_descriptor_sets(&set_info) };
        // One set for the one layout.
        self.set = sets.context("vkAllocateDescriptorSets")?[0];
        let ranges = [vk::PushConstantRange {
            stage_flags: vk::ShaderStageFlags::ALL,
            offset: 0,
            size: PUSH_BYTES,
        }];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&layouts)
            .push_constant_ranges(&ranges);
        // SAFETY: every device has 128 bytes of push constants.
        self.pipeline_layout =
            unsafe { raw.create_pipeline_layout(&info, None) }.context("vkCreatePipelineLayout")?;
        Ok(())
    }

    /// Destroys all objects; the device is idle.
    pub fn destroy(&self, raw: &ash::Device) {
        for (_, sampler) in lock(&self.samplers).drain(..) {
            // SAFETY: made from this idle device.
            unsafe { raw.destroy_sampler(sampler, None) };
        }
        // SAFETY: made from this idle device, or null.
        unsafe { raw.destroy_pipeline_layout(self.pipeline_layout, None) };
        // SAFETY: as above; frees the set too.
        unsafe { raw.destroy_descriptor_pool(self.pool, None) };
        // SAFETY: as above.
        unsafe { raw.destroy_descriptor_set_layout(self.set_layout, None) };
    }

    /// Writes a descriptor of a sampled image; returns its index.
    pub fn add_texture(
        &self,
        raw: &ash::Device,
        view: vk::ImageView,
        layout: vk::ImageLayout,
    ) -> Result<u32, Error> {
        let index = lock(&self.textures).take("textures")?;
        self.write_image(
            raw,
            1,
            vk::DescriptorType::SAMPLED_IMAGE,
            index,
            view,
            layout,
        );
        Ok(index)
    }

    /// Writes a descriptor of a storage image; returns its index.
    pub fn add_storage(&self, raw: &ash::Device, view: vk::ImageView) -> Result<u32, Error> {
        let index = lock(&self.storages).take("storage images")?;
        let layout = vk::ImageLayout::GENERAL;
        self.write_image(
            raw,
            2,
            vk::DescriptorType::STORAGE_IMAGE,
            index,
            view,
            layout,
        );
        Ok(index)
    }

    /// Writes a descriptor of a top-level acceleration structure; returns its index.
    pub fn add_scene(
        &self,
        raw: &ash::Device,
        scene: vk::AccelerationStructureKHR,
    ) -> Result<u32, Error> {
        let index = lock(&self.scenes).take("top-level acceleration structures")?;
        let scenes = [scene];
        let mut accel = vk::WriteDescriptorSetAccelerationStructureKHR::default()
            .acceleration_structures(&scenes);
        let mut write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(3)
            .dst_array_element(index)
            .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
            .push_next(&mut accel);
        write.descriptor_count = 1;
        // SAFETY: the index is below the binding's count and no frame uses it (it was free).
        unsafe { raw.update_descriptor_sets(&[write], &[]) };
        self.writes.fetch_add(1, Ordering::Relaxed);
        Ok(index)
    }

    fn write_image(
        &self,
        raw: &ash::Device,
        binding: u32,
        kind: vk::DescriptorType,
        index: u32,
        view: vk::ImageView,
        layout: vk::ImageLayout,
    ) {
        let images = [vk::DescriptorImageInfo {
            sampler: vk::Sampler::null(),
            image_view: view,
            image_layout: layout,
        }];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(binding)
            .dst_array_element(index)
            .descriptor_type(kind)
            .image_info(&images);
        // SAFETY: the index is below the binding's count and no frame uses it (it was free).
        unsafe { raw.update_descriptor_sets(&[write], &[]) };
        self.writes.fetch_add(1, Ordering::Relaxed);
    }

    pub fn free_texture(&self, index: u32) {
        lock(&self.textures).free.push(index);
    }

    pub fn free_storage(&self, index: u32) {
        lock(&self.storages).free.push(index);
    }

    pub fn free_scene(&self, index: u32) {
        lock(&self.scenes).free.push(index);
    }
}

impl Device {
    /// The index (binding 0) of a sampler with these parameters, made at its first use and kept until the device is
    /// dropped.
    ///
    /// # Errors
    /// [`Error::Full`] after 64 different samplers.
    pub fn sampler(&self, desc: &SamplerDesc) -> Result<u32, Error> {
        let mut samplers = lock(&self.0.bindless.samplers);
        if let Some(index) = samplers.iter().position(|(d, _)| d == desc) {
            return Ok(u32::try_from(index).unwrap_or(0));
        }
        let index = u32::try_from(samplers.len()).unwrap_or(SAMPLERS);
        if index >= SAMPLERS {
            return Err(Error::Full {
                what: "samplers",
                limit: SAMPLERS,
            });
        }
        let filter = match desc.filter {
            Filter::Nearest => vk::Filter::NEAREST,
            Filter::Linear => vk::Filter::LINEAR,
        };
        let (mip, max_lod) = match desc.mip {
            MipFilter::None => (vk::SamplerMipmapMode::NEAREST, 0.0),
            MipFilter::Nearest => (vk::SamplerMipmapMode::NEAREST, vk::LOD_CLAMP_NONE),
            MipFilter::Linear => (vk::SamplerMipmapMode::LINEAR, vk::LOD_CLAMP_NONE),
        };
        let wrap = match desc.wrap {
            Wrap::Repeat => vk::SamplerAddressMode::REPEAT,
            Wrap::Clamp => vk::SamplerAddressMode::CLAMP_TO_EDGE,
            Wrap::Border => vk::SamplerAddressMode::CLAMP_TO_BORDER,
        };
        let anisotropy = self
            .0
            .info
            .anisotropy
            .map_or(1.0, |limit| desc.anisotropy.min(limit));
        let mut info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(mip)
            .address_mode_u(wrap)
            .address_mode_v(wrap)
            .address_mode_w(wrap)
            .mip_lod_bias(desc.lod_bias)
            .max_lod(max_lod)
            .border_color(vk::BorderColor::FLOAT_TRANSPARENT_BLACK);
        if anisotropy > 1.0 {
            info = info.anisotropy_enable(true).max_anisotropy(anisotropy);
        }
        // SAFETY: values are within the device's limits.
        let sampler =
            unsafe { self.vk().create_sampler(&info, None) }.context("vkCreateSampler")?;
        let images = [vk::DescriptorImageInfo {
            sampler,
            ..Default::default()
        }];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.0.bindless.set)
            .dst_binding(0)
            .dst_array_element(index)
            .descriptor_type(vk::DescriptorType::SAMPLER)
            .image_info(&images);
        // SAFETY: the index is new, so no frame uses it.
        unsafe { self.vk().update_descriptor_sets(&[write], &[]) };
        self.0.bindless.writes.fetch_add(1, Ordering::Relaxed);
        samplers.push((*desc, sampler));
        Ok(index)
    }
}

/// The layout of the set: arrays of so many descriptors of each kind, in the order of their bindings.
fn set_layout(
    raw: &ash::Device,
    counts: &[(vk::DescriptorType, u32)],
) -> Result<vk::DescriptorSetLayout, Error> {
    let bindings: Vec<_> = (0u32..)
        .zip(counts)
        .map(|(binding, (kind, count))| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(*kind)
                .descriptor_count(*count)
                .stage_flags(vk::ShaderStageFlags::ALL)
        })
        .collect();
    let flags = vec![
        vk::DescriptorBindingFlags::PARTIALLY_BOUND
            | vk::DescriptorBindingFlags::UPDATE_AFTER_BIND
            | vk::DescriptorBindingFlags::UPDATE_UNUSED_WHILE_PENDING;
        bindings.len()
    ];
    let mut flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
    let layout_info = vk::DescriptorSetLayoutCreateInfo::default()
        .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
        .bindings(&bindings)
        .push_next(&mut flags);
    // SAFETY: counts are within the device's update-after-bind limits; pointers live here.
    unsafe { raw.create_descriptor_set_layout(&layout_info, None) }
        .context("vkCreateDescriptorSetLayout")
}
