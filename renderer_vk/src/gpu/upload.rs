//! Uploads: data on their way to device memory.
//!
//! Data are copied into mapped staging buffers at once. The copies to their targets are recorded into the command
//! buffer that runs just before the next submission's own: a resource made while a frame is recorded is ready for that
//! same frame. New images get their layout there too.

use std::collections::{HashMap, HashSet};

use ash::vk;
use gpu_allocator::vulkan::Allocation;

use super::buffer::{Buffer, BufferDesc, BufferUsage, Memory};
use super::device::{Device, lock};
use super::error::Error;
use super::image::{Image, whole};

/// Size of a staging buffer; larger data get one of their own size.
const CHUNK: u64 = 4 << 20;
/// Staged bytes after which uploads are submitted without waiting for a frame.
const FLUSH: u64 = 96 << 20;

/// A target image and what barriers need to know of it.
#[derive(Clone, Copy)]
struct Target {
    image: vk::Image,
    layout: vk::ImageLayout,
    aspect: vk::ImageAspectFlags,
}

impl Target {
    fn of(image: &Image) -> Self {
        Self {
            image: image.0.raw,
            layout: image.0.layout,
            aspect: image.0.aspect,
        }
    }

    fn barrier(
        self,
        from: vk::ImageLayout,
        to: vk::ImageLayout,
    ) -> vk::ImageMemoryBarrier<'static> {
        vk::ImageMemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
            .old_layout(from)
            .new_layout(to)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(self.image)
            .subresource_range(whole(self.aspect))
    }
}

enum Copy {
    Buffer {
        source: vk::Buffer,
        target: vk::Buffer,
        region: vk::BufferCopy,
    },
    Image {
        source: vk::Buffer,
        target: vk::Image,
        region: vk::BufferImageCopy,
    },
}

/// Work that waits for the next submission. Raw handles: their owners may be dropped meanwhile, and the graveyard
/// keeps the objects until that submission is over.
#[derive(Default)]
pub(crate) struct Pending {
    inits: Vec<Target>,
    targets: HashMap<vk::Image, Target>,
    copies: Vec<Copy>,
    staging: Vec<(vk::Buffer, Allocation)>,
    /// Taken bytes of the last staging buffer.
    used: u64,
    staged: u64,
}

impl Pending {
    pub fn is_empty(&self) -> bool {
        self.inits.is_empty() && self.copies.is_empty()
    }

    /// Takes the staging buffers out, to be buried.
    pub fn take_staging(&mut self) -> Vec<(vk::Buffer, Allocation)> {
        std::mem::take(&mut self.staging)
    }

    /// Copies `bytes` into staging memory.
    fn stage(&mut self, device: &Device, bytes: &[u8]) -> Result<(vk::Buffer, u64), Error> {
        let size = bytes.len() as u64;
        let fits = self.staging.last().is_some_and(|(_, memory)| {
            self.used
                .checked_add(size)
                .is_some_and(|end| end <= memory.size())
        });
        if !fits {
            let desc = BufferDesc {
                name: "staging",
                size: size.max(CHUNK),
                usage: BufferUsage::TRANSFER,
                memory: Memory::Upload,
            };
            if let Some(parts) = Buffer::new(device, &desc)?.dissolve() {
                self.staging.push(parts);
            }
            self.used = 0;
        }
        let start = self.used;
        let slot = self.staging.last_mut().and_then(|(raw, memory)| {
            let from = usize::try_from(start).ok()?;
            let target = memory
                .mapped_slice_mut()?
                .get_mut(from..from.checked_add(bytes.len())?)?;
            target.copy_from_slice(bytes);
            Some(*raw)
        });
        let Some(raw) = slot else {
            return Err(Error::Usage {
                name: "staging".to_owned(),
                what: "the staging buffer is not mapped".to_owned(),
            });
        };
        // 16: the largest block of a format, and a multiple of every texel size in use.
        self.used = (start + size).next_multiple_of(16);
        self.staged += size;
        Ok((raw, start))
    }
}

/// Records everything that waits, between two full barriers.
pub(crate) fn record(device: &Device, cmd: vk::CommandBuffer, pending: &Pending) {
    let vk = device.vk();
    let barrier = |images: &[vk::ImageMemoryBarrier<'_>], to_all: bool| {
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let transfer = vk::PipelineStageFlags::TRANSFER;
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        // SAFETY: `cmd` is being recorded outside of a render pass; the images are alive (graveyard).
        unsafe {
            vk.cmd_pipeline_barrier(
                cmd,
                if to_all { transfer } else { all },
                if to_all { all } else { transfer },
                vk::DependencyFlags::empty(),
                &memory,
                &[],
                images,
            );
        }
    };
    let dst = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    // A new image that is written now goes straight to the layout for that.
    let mut images: Vec<_> = Vec::new();
    let mut fresh = HashSet::new();
    for target in &pending.inits {
        fresh.insert(target.image);
        let to = if pending.targets.contains_key(&target.image) {
            dst
        } else {
            target.layout
        };
        images.push(target.barrier(vk::ImageLayout::UNDEFINED, to));
    }
    for target in pending.targets.values() {
        if !fresh.contains(&target.image) {
            images.push(target.barrier(target.layout, dst));
        }
    }
    barrier(&images, false);

    // Two copies to the same place must keep their order.
    let mut buffers: HashMap<vk::Buffer, (u64, u64)> = HashMap::new();
    let mut levels: HashSet<(vk::Image, u32, u32)> = HashSet::new();
    for copy in &pending.copies {
        let again = match copy {
            Copy::Buffer { target, region, .. } => {
                let (start, end) = (region.dst_offset, region.dst_offset + region.size);
                let range = buffers.entry(*target).or_insert((start, start));
                let overlaps = start < range.1 && end > range.0;
                *range = if overlaps {
                    (start, end)
                } else {
                    (range.0.min(start), range.1.max(end))
                };
                overlaps
            }
            Copy::Image { target, region, .. } => {
                let part = region.image_subresource;
                !levels.insert((*target, part.mip_level, part.base_array_layer))
            }
        };
        if again {
            let memory = [vk::MemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
                .dst_access_mask(vk::AccessFlags::TRANSFER_WRITE)];
            let transfer = vk::PipelineStageFlags::TRANSFER;
            // SAFETY: as above.
            unsafe {
                vk.cmd_pipeline_barrier(
                    cmd,
                    transfer,
                    transfer,
                    vk::DependencyFlags::empty(),
                    &memory,
                    &[],
                    &[],
                );
            }
        }
        match copy {
            Copy::Buffer {
                source,
                target,
                region,
            } => {
                // SAFETY: the ranges were checked when the upload was asked for; both buffers are alive.
                unsafe { vk.cmd_copy_buffer(cmd, *source, *target, &[*region]) };
            }
            Copy::Image {
                source,
                target,
                region,
            } => {
                // SAFETY: as above; the image is in this layout since the first barrier.
                unsafe { vk.cmd_copy_buffer_to_image(cmd, *source, *target, dst, &[*region]) };
            }
        }
    }
    let back: Vec<_> = pending
        .targets
        .values()
        .map(|t| t.barrier(dst, t.layout))
        .collect();
    barrier(&back, true);
}

impl Device {
    /// Brings `bytes` into a device buffer at `offset`. The copy runs before the commands of the frame that is being
    /// recorded, or of the next one.
    ///
    /// # Errors
    /// A range outside of the buffer; out of staging memory.
    pub fn upload_buffer(&self, target: &Buffer, offset: u64, bytes: &[u8]) -> Result<(), Error> {
        target.check(offset, bytes.len() as u64)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let mut pending = lock(&self.0.pending);
        let (source, start) = pending.stage(self, bytes)?;
        pending.copies.push(Copy::Buffer {
            source,
            target: target.0.raw,
            region: vk::BufferCopy {
                src_offset: start,
                dst_offset: offset,
                size: bytes.len() as u64,
            },
        });
        self.flush_when_full(pending)
    }

    /// Brings the texels of one level and layer into an image: rows from the top without padding, blocks for
    /// compressed formats. When it runs: as [`upload_buffer`](Self::upload_buffer).
    ///
    /// # Errors
    /// A level or layer that is not there, a wrong number of bytes; out of staging memory.
    pub fn upload_image(
        &self,
        target: &Image,
        mip: u32,
        layer: u32,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let (width, height) = target.mip_size(mip);
        self.upload_image_part(target, mip, layer, [0, 0, width, height], bytes)
    }

    /// Brings texels into a rectangle of one level of layer 0. For compressed formats the rectangle is in texels and
    /// starts at a block.
    ///
    /// # Errors
    /// As [`upload_image`](Self::upload_image), and a rectangle that is not inside.
    #[allow(clippy::too_many_arguments)]
    pub fn upload_image_rect(
        &self,
        target: &Image,
        mip: u32,
        x: u32,
        y: u32,
        width: u32,
        height: u32,
        bytes: &[u8],
    ) -> Result<(), Error> {
        self.upload_image_part(target, mip, 0, [x, y, width, height], bytes)
    }

    fn upload_image_part(
        &self,
        target: &Image,
        mip: u32,
        layer: u32,
        [x, y, width, height]: [u32; 4],
        bytes: &[u8],
    ) -> Result<(), Error> {
        let (mip_width, mip_height) = target.mip_size(mip);
        let inside = |start: u32, size: u32, whole: u32| {
            size > 0 && start.checked_add(size).is_some_and(|end| end <= whole)
        };
        if mip >= target.mips()
            || layer >= target.layers()
            || !inside(x, width, mip_width)
            || !inside(y, height, mip_height)
        {
            return Err(target.misuse(format!(
                "no rectangle {width}x{height} at ({x}, {y}) in level {mip} of layer {layer}"
            )));
        }
        let wanted = target.format().bytes(width, height);
        if wanted != bytes.len() as u64 {
            return Err(target.misuse(format!(
                "{width}x{height} texels of {:?} take {wanted} bytes, {} were given",
                target.format(),
                bytes.len()
            )));
        }
        let mut pending = lock(&self.0.pending);
        let (source, start) = pending.stage(self, bytes)?;
        pending.targets.insert(target.0.raw, Target::of(target));
        pending.copies.push(Copy::Image {
            source,
            target: target.0.raw,
            region: vk::BufferImageCopy {
                buffer_offset: start,
                buffer_row_length: 0,
                buffer_image_height: 0,
                image_subresource: vk::ImageSubresourceLayers {
                    aspect_mask: target.0.aspect,
                    mip_level: mip,
                    base_array_layer: layer,
                    layer_count: 1,
                },
                image_offset: vk::Offset3D {
                    x: x.cast_signed(),
                    y: y.cast_signed(),
                    z: 0,
                },
                image_extent: vk::Extent3D {
                    width,
                    height,
                    depth: 1,
                },
            },
        });
        self.flush_when_full(pending)
    }

    /// Gives a new image its layout before anything uses it.
    pub(crate) fn queue_init(&self, image: &Image) {
        lock(&self.0.pending).inits.push(Target::of(image));
    }

    /// Runs waiting uploads at once when they hold much staging memory.
    fn flush_when_full(&self, pending: std::sync::MutexGuard<'_, Pending>) -> Result<(), Error> {
        let full = pending.staged >= FLUSH;
        drop(pending);
        if full {
            self.immediate(|_| Ok(()))?;
        }
        Ok(())
    }
}
