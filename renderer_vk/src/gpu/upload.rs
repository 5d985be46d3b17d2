//! Uploads to device memory.
//!
//! Data are copied into mapped staging buffers immediately. The copies to their targets are recorded into the command
//! buffer that runs before the next submission's own: a resource made while a frame is recorded is ready for that
//! frame. New images get their layout there, too.

use std::collections::{HashMap, HashSet};

use ash::vk;
use gpu_allocator::vulkan::Allocation;

use super::buffer::{Buffer, BufferDesc, BufferUsage, Memory};
use super::device::{Device, DeviceInner, lock};
use super::error::Error;
use super::graveyard::Garbage;
use super::image::{Image, layout_change, rectangle};

/// Size of a staging buffer, bytes; larger data get a buffer of their own.
const CHUNK: u64 = 4 << 20;
/// Number of staging buffers kept between frames, for video pictures.
const SPARE: usize = 3;
/// Submissions without uploads after which the kept ones are freed: two seconds of a game that plays no video.
const IDLE: u32 = 120;
/// Staged bytes above which uploads are submitted without waiting for a frame.
const FLUSH: u64 = 96 << 20;

/// A target image, with the data for its barriers.
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
        layout_change(self.image, self.aspect, from, to)
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

/// Uploads that wait for the next submission. Raw handles: if their owners are dropped meanwhile, the graveyard keeps
/// the objects until that submission has finished.
#[derive(Default)]
pub(crate) struct Pending {
    inits: Vec<Target>,
    targets: HashMap<vk::Image, Target>,
    copies: Vec<Copy>,
    staging: Vec<(vk::Buffer, Allocation)>,
    /// Unused staging buffers.
    spare: Vec<(vk::Buffer, Allocation)>,
    /// Submissions since the last one that staged something.
    idle: u32,
    /// Targets written so far during recording.
    seen: Seen,
    /// Used bytes of the last staging buffer.
    used: u64,
    staged: u64,
}

/// Targets that a [`Pending`] has written; its memory is reused.
#[derive(Default)]
struct Seen {
    /// New images.
    fresh: HashSet<vk::Image>,
    /// Written range of each buffer.
    buffers: HashMap<vk::Buffer, (u64, u64)>,
    /// Written image, level and layer.
    levels: HashSet<(vk::Image, u32, u32)>,
}

impl Pending {
    pub fn is_empty(&self) -> bool {
        self.inits.is_empty() && self.copies.is_empty()
    }

    /// Adds uploads that were requested later.
    fn append(&mut self, mut later: Self) {
        self.inits.append(&mut later.inits);
        self.targets.extend(later.targets);
        self.copies.append(&mut later.copies);
        if !later.staging.is_empty() {
            self.used = later.used;
        }
        self.staging.append(&mut later.staging);
        self.spare.append(&mut later.spare);
        self.staged += later.staged;
    }

    /// Removes all staging buffers, used and spare.
    pub fn take_staging(&mut self) -> impl Iterator<Item = (vk::Buffer, Allocation)> {
        self.staging.drain(..).chain(self.spare.drain(..))
    }

    /// Removes the spare staging buffers, to be destroyed.
    pub fn take_spare(&mut self) -> Vec<(vk::Buffer, Allocation)> {
        std::mem::take(&mut self.spare)
    }

    /// Keeps an unused staging buffer for later uploads, or returns it.
    pub fn keep_spare(
        &mut self,
        buffer: vk::Buffer,
        memory: Allocation,
    ) -> Option<(vk::Buffer, Allocation)> {
        // larger ones serve single large uploads
        if self.spare.len() >= SPARE || memory.size() != CHUNK {
            return Some((buffer, memory));
        }
        self.spare.push((buffer, memory));
        None
    }

    /// Counts a submission that staged so many bytes. Removes the spare buffers if none was needed for long.
    fn count(&mut self, staged: u64) -> Vec<(vk::Buffer, Allocation)> {
        self.idle = match staged {
            0 => self.idle.saturating_add(1),
            _ => 0,
        };
        match self.idle {
            IDLE.. => self.take_spare(),
            _ => Vec::new(),
        }
    }

    /// Copies `bytes` into staging memory.
    fn stage(&mut self, device: &Device, bytes: &[u8]) -> Result<(vk::Buffer, u64), Error> {
        let size = bytes.len() as u64;
        let fits = self.staging.last().is_some_and(|(_, memory)| {
            self.used
                .checked_add(size)
                .is_some_and(|end| end <= memory.size())
        });
        let spare = if fits {
            None
        } else {
            self.spare.pop_if(|(_, memory)| memory.size() >= size)
        };
        if let Some(spare) = spare {
            self.staging.push(spare);
            self.used = 0;
        } else if !fits {
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

/// A memory barrier between transfers and all commands, with changes of layouts.
fn full_barrier(
    device: &Device,
    cmd: vk::CommandBuffer,
    after_transfer: bool,
    mut images: impl Iterator<Item = vk::ImageMemoryBarrier<'static>>,
) {
    let all = vk::PipelineStageFlags::ALL_COMMANDS;
    let transfer = vk::PipelineStageFlags::TRANSFER;
    let (before, after) = if after_transfer {
        (transfer, all)
    } else {
        (all, transfer)
    };
    let memory = [vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
    // In batches of fixed size, which need no allocation; without images, the memory barrier alone.
    let mut piece = [vk::ImageMemoryBarrier::default(); 16];
    loop {
        let mut count = 0;
        for (place, image) in piece.iter_mut().zip(&mut images) {
            *place = image;
            count += 1;
        }
        let part = &piece[..count];
        let flags = vk::DependencyFlags::empty();
        // SAFETY: `cmd` is being recorded outside of a render pass; the images are alive (graveyard).
        unsafe {
            let vk = device.vk();
            vk.cmd_pipeline_barrier(cmd, before, after, flags, &memory, &[], part);
        }
        if count < piece.len() {
            break;
        }
    }
}

impl Seen {
    /// Whether a copy may write to the range of an earlier one; then both must keep their order.
    fn overlaps(&mut self, copy: &Copy) -> bool {
        match copy {
            Copy::Buffer { target, region, .. } => {
                let (start, end) = (region.dst_offset, region.dst_offset + region.size);
                let range = self.buffers.entry(*target).or_insert((start, start));
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
                let level = (*target, part.mip_level, part.base_array_layer);
                !self.levels.insert(level)
            }
        }
    }
}

/// Records all pending uploads between two full barriers.
pub(crate) fn record(device: &Device, cmd: vk::CommandBuffer, pending: &mut Pending) {
    let vk = device.vk();
    let Pending {
        inits,
        targets,
        copies,
        seen,
        ..
    } = pending;
    let dst = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
    // A new image that is written now changes directly to the transfer layout.
    seen.fresh.clear();
    seen.fresh.extend(inits.iter().map(|target| target.image));
    let new = inits.iter().map(|target| {
        let written = targets.contains_key(&target.image);
        let to = if written { dst } else { target.layout };
        target.barrier(vk::ImageLayout::UNDEFINED, to)
    });
    let old = (targets.values())
        .filter(|target| !seen.fresh.contains(&target.image))
        .map(|target| target.barrier(target.layout, dst));
    full_barrier(device, cmd, false, new.chain(old));

    seen.buffers.clear();
    seen.levels.clear();
    for copy in &*copies {
        if seen.overlaps(copy) {
            let memory = [vk::MemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
                .dst_access_mask(vk::AccessFlags::TRANSFER_WRITE)];
            let transfer = vk::PipelineStageFlags::TRANSFER;
            let flags = vk::DependencyFlags::empty();
            // SAFETY: `cmd` is being recorded outside of a render pass.
            unsafe {
                vk.cmd_pipeline_barrier(cmd, transfer, transfer, flags, &memory, &[], &[]);
            }
        }
        match copy {
            Copy::Buffer {
                source,
                target,
                region,
            } => {
                // SAFETY: the ranges were checked at the request; both buffers are alive.
                unsafe { vk.cmd_copy_buffer(cmd, *source, *target, &[*region]) };
            }
            Copy::Image {
                source,
                target,
                region,
            } => {
                // SAFETY: as for buffers; the image is in this layout since the first barrier.
                unsafe { vk.cmd_copy_buffer_to_image(cmd, *source, *target, dst, &[*region]) };
            }
        }
    }
    let back = targets.values().map(|t| t.barrier(dst, t.layout));
    full_barrier(device, cmd, true, back);
}

impl DeviceInner {
    /// Takes back a recorded list. After its submission only its memory is of use, and its staging buffers are buried;
    /// if the submission failed, its uploads wait for the next one: they belong to objects that stay.
    pub fn put_back(&self, mut recorded: Pending, submitted: bool) {
        if submitted {
            for (buffer, memory) in recorded.count(recorded.staged) {
                self.bury(Garbage::Buffer(buffer, memory));
            }
            for (buffer, memory) in recorded.staging.drain(..) {
                self.bury(Garbage::Staging(buffer, memory));
            }
            recorded.inits.clear();
            recorded.targets.clear();
            recorded.copies.clear();
            (recorded.used, recorded.staged) = (0, 0);
        }
        let mut pending = lock(&self.pending);
        recorded.append(std::mem::take(&mut pending));
        *pending = recorded;
    }
}

/// A rectangle of one level and layer of an image, texels. In compressed formats it starts at a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageRegion {
    /// Mip level; 0 is the largest.
    pub mip: u32,
    /// Array layer.
    pub layer: u32,
    /// Left edge.
    pub x: u32,
    /// Upper edge.
    pub y: u32,
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}

impl Device {
    /// Uploads `bytes` to a device buffer at `offset`. The copy runs before the commands of the frame being recorded,
    /// or of the next one.
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

    /// Uploads the texels of one level and layer of an image: rows from the top without padding, blocks in compressed
    /// formats. Timing as for [`upload_buffer`](Self::upload_buffer).
    ///
    /// # Errors
    /// An invalid level or layer, a wrong number of bytes; out of staging memory.
    pub fn upload_image(
        &self,
        target: &Image,
        mip: u32,
        layer: u32,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let (width, height) = target.mip_size(mip);
        let whole = ImageRegion {
            mip,
            layer,
            x: 0,
            y: 0,
            width,
            height,
        };
        self.upload_image_region(target, whole, bytes)
    }

    /// Uploads texels to a rectangle of one level and layer.
    ///
    /// # Errors
    /// As [`upload_image`](Self::upload_image), and a rectangle that is not inside of the image.
    pub fn upload_image_region(
        &self,
        target: &Image,
        region: ImageRegion,
        bytes: &[u8],
    ) -> Result<(), Error> {
        let ImageRegion {
            mip,
            layer,
            x,
            y,
            width,
            height,
        } = region;
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
        let (image_offset, image_extent) = rectangle([x, y, width, height]);
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
                image_offset,
                image_extent,
            },
        });
        self.flush_when_full(pending)
    }

    /// Records the initial layout transition of a new image.
    pub(crate) fn queue_init(&self, image: &Image) {
        lock(&self.0.pending).inits.push(Target::of(image));
    }

    /// Submits pending uploads if they hold much staging memory.
    fn flush_when_full(&self, pending: std::sync::MutexGuard<'_, Pending>) -> Result<(), Error> {
        let full = pending.staged >= FLUSH;
        drop(pending);
        if full {
            self.immediate(|_| Ok(()))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uploads_whose_submission_failed_come_before_later_ones() {
        let copy = |size| Copy::Buffer {
            source: vk::Buffer::null(),
            target: vk::Buffer::null(),
            region: vk::BufferCopy::default().size(size),
        };
        let size = |copy: &Copy| match copy {
            Copy::Buffer { region, .. } => region.size,
            Copy::Image { .. } => 0,
        };
        let target = |raw| Target {
            image: vk::Handle::from_raw(raw),
            layout: vk::ImageLayout::GENERAL,
            aspect: vk::ImageAspectFlags::COLOR,
        };
        let mut failed = Pending {
            inits: vec![target(1)],
            copies: vec![copy(1), copy(2)],
            used: 48,
            staged: 40,
            ..Pending::default()
        };
        failed.append(Pending {
            inits: vec![target(2)],
            copies: vec![copy(3)],
            staged: 2,
            ..Pending::default()
        });
        assert_eq!(
            failed.copies.iter().map(size).collect::<Vec<_>>(),
            [1, 2, 3]
        );
        let images: Vec<_> = failed.inits.iter().map(|target| target.image).collect();
        assert_eq!(images, [target(1).image, target(2).image]);
        // Without a staging buffer of the later ones, the next upload goes behind the earlier ones.
        assert_eq!((failed.used, failed.staged), (48, 42));
    }
}
