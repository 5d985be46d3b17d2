//! Images and their formats.
//!
//! Layout rule: an image with the usage of storage or attachments stays in `GENERAL`; one that is only sampled stays in
//! `SHADER_READ_ONLY_OPTIMAL`. Copies change it temporarily. Swapchain images are `GENERAL` between acquisition and
//! presentation.

use std::ops::BitOr;
use std::sync::{Arc, Mutex};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::device::{Device, lock};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::memory::MemoryKind;

/// Result of [`Image::texture_index`] and [`Image::storage_index`] for an image without that usage.
pub const NO_INDEX: u32 = u32::MAX;

macro_rules! formats {
    ($($(#[$doc:meta])* $name:ident = $vk:ident, $block:expr, $bytes:expr;)*) => {
        /// Texel format; the name lists channels and bits, with `F` for float and `Uint` for integer, otherwise
        /// normalized.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Format { $($(#[$doc])* $name,)* }
        impl Format {
            pub(crate) fn vk(self) -> vk::Format {
                match self { $(Self::$name => vk::Format::$vk,)* }
            }
            /// Width and height of a block (1 for uncompressed formats), and its size in bytes.
            pub fn block(self) -> (u32, u32) {
                match self { $(Self::$name => ($block, $bytes),)* }
            }
        }
    };
}

formats! {
    /// One channel, 8 bits.
    R8 = R8_UNORM, 1, 1;
    /// Two channels, 8 bits.
    Rg8 = R8G8_UNORM, 1, 2;
    /// Four channels, 8 bits, without conversion.
    Rgba8 = R8G8B8A8_UNORM, 1, 4;
    /// Four channels, 8 bits, sampled as linear values of sRGB-encoded texels.
    Rgba8Srgb = R8G8B8A8_SRGB, 1, 4;
    /// Four channels, 8 bits, blue first: the usual swapchain.
    Bgra8 = B8G8R8A8_UNORM, 1, 4;
    /// Ten bits for each colour, two for alpha.
    Rgb10A2 = A2B10G10R10_UNORM_PACK32, 1, 4;
    /// Small unsigned floats.
    R11G11B10F = B10G11R11_UFLOAT_PACK32, 1, 4;
    /// Half float.
    R16F = R16_SFLOAT, 1, 2;
    /// Two half floats.
    Rg16F = R16G16_SFLOAT, 1, 4;
    /// Four half floats.
    Rgba16F = R16G16B16A16_SFLOAT, 1, 8;
    /// Four channels, 16 bits.
    Rgba16 = R16G16B16A16_UNORM, 1, 8;
    /// 16-bit integer.
    R16Uint = R16_UINT, 1, 2;
    /// Float.
    R32F = R32_SFLOAT, 1, 4;
    /// Two floats.
    Rg32F = R32G32_SFLOAT, 1, 8;
    /// Four floats.
    Rgba32F = R32G32B32A32_SFLOAT, 1, 16;
    /// 32-bit integer.
    R32Uint = R32_UINT, 1, 4;
    /// Two 32-bit integers.
    Rg32Uint = R32G32_UINT, 1, 8;
    /// Four 32-bit integers.
    Rgba32Uint = R32G32B32A32_UINT, 1, 16;
    /// BC1 with one bit of alpha.
    Bc1 = BC1_RGBA_UNORM_BLOCK, 4, 8;
    /// BC2.
    Bc2 = BC2_UNORM_BLOCK, 4, 16;
    /// BC3.
    Bc3 = BC3_UNORM_BLOCK, 4, 16;
    /// BC4, one channel.
    Bc4 = BC4_UNORM_BLOCK, 4, 8;
    /// BC5, two channels.
    Bc5 = BC5_UNORM_BLOCK, 4, 16;
    /// BC7.
    Bc7 = BC7_UNORM_BLOCK, 4, 16;
    /// Depth, float.
    D32F = D32_SFLOAT, 1, 4;
    /// Depth, float, and 8 bits of stencil. Copies include the depth alone.
    D32FS8 = D32_SFLOAT_S8_UINT, 1, 4;
    /// Depth, 24 bits normalized.
    D24 = X8_D24_UNORM_PACK32, 1, 4;
    /// Depth, 24 bits normalized, and 8 bits of stencil. Copies include the depth alone.
    D24S8 = D24_UNORM_S8_UINT, 1, 4;
}

impl Format {
    /// Bytes of `width` × `height` texels, in whole blocks.
    pub fn bytes(self, width: u32, height: u32) -> u64 {
        let (size, bytes) = self.block();
        u64::from(width.div_ceil(size)) * u64::from(height.div_ceil(size)) * u64::from(bytes)
    }

    pub(crate) fn aspect(self) -> vk::ImageAspectFlags {
        match self {
            Self::D24 | Self::D32F => vk::ImageAspectFlags::DEPTH,
            Self::D32FS8 | Self::D24S8 => {
                vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL
            }
            _ => vk::ImageAspectFlags::COLOR,
        }
    }

    /// Has a stencil beside the depth.
    pub fn has_stencil(self) -> bool {
        self.aspect().contains(vk::ImageAspectFlags::STENCIL)
    }
}

/// Usage of an image in addition to copies, which every image allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct ImageUsage(u32);

impl ImageUsage {
    /// Sampled texture.
    pub const SAMPLED: Self = Self(1);
    /// Storage image of shaders.
    pub const STORAGE: Self = Self(2);
    /// Colour attachment.
    pub const COLOR: Self = Self(4);
    /// Depth attachment.
    pub const DEPTH: Self = Self(8);

    pub(crate) fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Vulkan's usage flags, and the format features that they require.
    fn vk(self) -> (vk::ImageUsageFlags, vk::FormatFeatureFlags) {
        use vk::FormatFeatureFlags as F;
        use vk::ImageUsageFlags as U;
        let mut usage = U::TRANSFER_SRC | U::TRANSFER_DST;
        let mut needed = F::empty();
        for (wanted, use_flag, feature) in [
            (Self::SAMPLED, U::SAMPLED, F::SAMPLED_IMAGE),
            (Self::STORAGE, U::STORAGE, F::STORAGE_IMAGE),
            (Self::COLOR, U::COLOR_ATTACHMENT, F::COLOR_ATTACHMENT),
            (
                Self::DEPTH,
                U::DEPTH_STENCIL_ATTACHMENT,
                F::DEPTH_STENCIL_ATTACHMENT,
            ),
        ] {
            if self.has(wanted) {
                usage |= use_flag;
                needed |= feature;
            }
        }
        (usage, needed)
    }

    fn memory(self) -> MemoryKind {
        if self.has(Self::STORAGE | Self::COLOR | Self::DEPTH) {
            MemoryKind::Target
        } else {
            MemoryKind::Texture
        }
    }
}

impl BitOr for ImageUsage {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Parameters of an [`Image`].
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    /// Label in captures, validation messages and leak reports.
    pub name: &'a str,
    /// Texels.
    pub width: u32,
    /// Texels.
    pub height: u32,
    /// Levels, at least 1.
    pub mips: u32,
    /// Array layers, at least 1; more than one makes a 2D array.
    pub layers: u32,
    /// Texel format.
    pub format: Format,
    /// Usage.
    pub usage: ImageUsage,
    /// Samples per texel: 1, or 2, 4, 8 for an image that is only an attachment and source of a resolve.
    pub samples: u32,
    /// Another format of the same size, for [`Image::in_other_format`].
    pub other_format: Option<Format>,
}

impl<'a> ImageDesc<'a> {
    /// One level, one layer.
    pub fn new(name: &'a str, width: u32, height: u32, format: Format, usage: ImageUsage) -> Self {
        Self {
            name,
            width,
            height,
            mips: 1,
            layers: 1,
            format,
            usage,
            samples: 1,
            other_format: None,
        }
    }

    /// Checks that the device supports the image.
    fn check(&self, device: &Device) -> Result<(), Error> {
        let limit = device.0.info.max_image_size;
        if self.width == 0 || self.height == 0 || self.width > limit || self.height > limit {
            return Err(Error::Usage {
                name: self.name.to_owned(),
                what: format!(
                    "an image of {}x{} texels (1 to {limit} are possible)",
                    self.width, self.height
                ),
            });
        }
        let unsupported = |what| {
            Err(Error::Unsupported {
                name: self.name.to_owned(),
                what,
                device: device.0.info.name.clone(),
            })
        };
        if self.samples > 1 && !device.supports_samples(self.format, self.samples) {
            return unsupported(format!("{:?} with {} samples", self.format, self.samples));
        }
        let (_, needed) = self.usage.vk();
        if !device.0.features(self.format).contains(needed) {
            return unsupported(format!("{:?} as {needed:?}", self.format));
        }
        match self.other_format {
            Some(other) if other.block() != self.format.block() => Err(Error::Usage {
                name: self.name.to_owned(),
                what: format!("texels of {other:?} differ in size from {:?}", self.format),
            }),
            Some(other) if !device.0.features(other).contains(needed) => {
                unsupported(format!("{other:?} as {needed:?}"))
            }
            _ => Ok(()),
        }
    }
}

pub(crate) struct ImageInner {
    device: Device,
    pub raw: vk::Image,
    /// `None`: the image belongs to a swapchain, or to `owner`.
    memory: Mutex<Option<Allocation>>,
    /// The image whose texels this one reads and writes in another format.
    owner: Option<Image>,
    other_format: Option<Format>,
    /// All levels and layers.
    view: vk::ImageView,
    /// Level 0, for storage and drawing.
    pub target: vk::ImageView,
    pub layout: vk::ImageLayout,
    pub aspect: vk::ImageAspectFlags,
    width: u32,
    height: u32,
    mips: u32,
    layers: u32,
    format: Format,
    usage: ImageUsage,
    samples: u32,
    texture: u32,
    storage: u32,
    name: String,
}

/// An image. Clones share it.
#[derive(Clone)]
pub struct Image(pub(crate) Arc<ImageInner>);

/// The whole image, all levels and layers, for barriers.
pub(crate) fn whole(aspect: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: aspect,
        base_mip_level: 0,
        level_count: vk::REMAINING_MIP_LEVELS,
        base_array_layer: 0,
        layer_count: vk::REMAINING_ARRAY_LAYERS,
    }
}

/// Corner and size of a rectangle (x, y, width, height), for copies.
pub(crate) fn rectangle([x, y, width, height]: [u32; 4]) -> (vk::Offset3D, vk::Extent3D) {
    let (x, y) = (x.cast_signed(), y.cast_signed());
    let size = vk::Extent3D {
        width,
        height,
        depth: 1,
    };
    (vk::Offset3D { x, y, z: 0 }, size)
}

/// A layout transition of a whole image, after all earlier writes and before all later accesses.
pub(crate) fn layout_change(
    image: vk::Image,
    aspect: vk::ImageAspectFlags,
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
        .image(image)
        .subresource_range(whole(aspect))
}

impl Image {
    /// Makes an image; its contents are undefined until written.
    ///
    /// # Errors
    /// Out of memory, a full descriptor table, a size of zero or beyond the device's limit, a format that does not
    /// support the usage.
    pub fn new(device: &Device, desc: &ImageDesc<'_>) -> Result<Self, Error> {
        desc.check(device)?;
        let most_mips = 32 - desc.width.max(desc.height).leading_zeros();
        let (mips, layers) = (desc.mips.clamp(1, most_mips), desc.layers.max(1));
        let formats = [desc.format, desc.other_format.unwrap_or(desc.format)].map(Format::vk);
        let mut formats = vk::ImageFormatListCreateInfo::default().view_formats(&formats);
        let mut info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format.vk())
            .extent(vk::Extent3D {
                width: desc.width,
                height: desc.height,
                depth: 1,
            })
            .mip_levels(mips)
            .array_layers(layers)
            .samples(vk::SampleCountFlags::from_raw(desc.samples.max(1)))
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(desc.usage.vk().0)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        if desc.other_format.is_some() {
            info = info
                .flags(vk::ImageCreateFlags::MUTABLE_FORMAT)
                .push_next(&mut formats);
        }
        let vk = device.vk();
        // SAFETY: size and format were checked against the device.
        let raw = unsafe { vk.create_image(&info, None) }.context("vkCreateImage")?;
        // SAFETY: `raw` was just made.
        let requirements = unsafe { vk.get_image_memory_requirements(raw) };
        let kind = desc.usage.memory();
        let gpu_only = MemoryLocation::GpuOnly;
        let memory = match (device.0).allocate(desc.name, kind, requirements, gpu_only, false) {
            Ok(memory) => memory,
            Err(e) => {
                // SAFETY: nothing uses the new image.
                unsafe { vk.destroy_image(raw, None) };
                return Err(e);
            }
        };
        // SAFETY: the memory object is only used for the binding below.
        let (object, offset) = (unsafe { memory.memory() }, memory.offset());
        // SAFETY: the memory was allocated for these requirements and is bound once.
        let bound = unsafe { vk.bind_image_memory(raw, object, offset) };
        let only_sampled = desc.usage == ImageUsage::SAMPLED;
        let mut inner = ImageInner {
            device: device.clone(),
            raw,
            memory: Mutex::new(Some(memory)),
            owner: None,
            other_format: desc.other_format,
            view: vk::ImageView::null(),
            target: vk::ImageView::null(),
            layout: if only_sampled {
                vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL
            } else {
                vk::ImageLayout::GENERAL
            },
            aspect: desc.format.aspect(),
            width: desc.width,
            height: desc.height,
            mips,
            layers,
            format: desc.format,
            usage: desc.usage,
            samples: desc.samples.max(1),
            texture: NO_INDEX,
            storage: NO_INDEX,
            name: desc.name.to_owned(),
        };
        bound.context("vkBindImageMemory")?;
        device.0.name(raw, desc.name);
        inner.make_views()?;
        let image = Self(Arc::new(inner));
        device.queue_init(&image);
        Ok(image)
    }

    /// The same texels, read and written in the other format that the image was made for. Passes that use an image in
    /// both formats in turns need no copy; each overwrites what the other left.
    ///
    /// # Errors
    /// The image was made for one format; out of memory, a full descriptor table.
    pub fn in_other_format(&self) -> Result<Self, Error> {
        let own = &self.0;
        let Some(format) = own.other_format else {
            return Err(self.misuse("the image was made for one format"));
        };
        let mut inner = ImageInner {
            device: own.device.clone(),
            raw: own.raw,
            memory: Mutex::new(None),
            owner: Some(self.clone()),
            other_format: Some(own.format),
            view: vk::ImageView::null(),
            target: vk::ImageView::null(),
            layout: own.layout,
            aspect: own.aspect,
            width: own.width,
            height: own.height,
            mips: own.mips,
            layers: own.layers,
            format,
            usage: own.usage,
            samples: own.samples,
            texture: NO_INDEX,
            storage: NO_INDEX,
            name: own.name.clone(),
        };
        inner.make_views()?;
        Ok(Self(Arc::new(inner)))
    }

    /// The image that owns the texels: this one, or the one that it shows [in another format](Self::in_other_format).
    pub fn owner(&self) -> &Self {
        self.0.owner.as_ref().unwrap_or(self)
    }

    /// Wraps an image that a swapchain owns.
    pub(crate) fn of_swapchain(
        device: &Device,
        raw: vk::Image,
        name: &str,
        width: u32,
        height: u32,
        format: Format,
    ) -> Result<Self, Error> {
        let mut inner = ImageInner {
            device: device.clone(),
            raw,
            memory: Mutex::new(None),
            owner: None,
            other_format: None,
            view: vk::ImageView::null(),
            target: vk::ImageView::null(),
            layout: vk::ImageLayout::GENERAL,
            aspect: vk::ImageAspectFlags::COLOR,
            width,
            height,
            mips: 1,
            layers: 1,
            format,
            usage: ImageUsage::COLOR,
            samples: 1,
            texture: NO_INDEX,
            storage: NO_INDEX,
            name: name.to_owned(),
        };
        device.0.name(raw, name);
        inner.make_views()?;
        Ok(Self(Arc::new(inner)))
    }

    /// Index in the texture table (binding 1), or [`NO_INDEX`].
    pub fn texture_index(&self) -> u32 {
        self.0.texture
    }

    /// Index in the storage image table (binding 2) of level 0, or [`NO_INDEX`].
    pub fn storage_index(&self) -> u32 {
        self.0.storage
    }

    /// Texels of level 0.
    pub fn width(&self) -> u32 {
        self.0.width
    }

    /// Texels of level 0.
    pub fn height(&self) -> u32 {
        self.0.height
    }

    /// Levels.
    pub fn mips(&self) -> u32 {
        self.0.mips
    }

    /// Array layers.
    pub fn layers(&self) -> u32 {
        self.0.layers
    }

    /// Texel format.
    pub fn format(&self) -> Format {
        self.0.format
    }

    /// Samples of a texel.
    pub fn samples(&self) -> u32 {
        self.0.samples
    }

    /// The label.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Width and height of a level.
    pub fn mip_size(&self, mip: u32) -> (u32, u32) {
        (
            self.0.width.checked_shr(mip).unwrap_or(0).max(1),
            self.0.height.checked_shr(mip).unwrap_or(0).max(1),
        )
    }

    /// An [`Error::Usage`] about this image.
    pub(crate) fn misuse(&self, what: impl Into<String>) -> Error {
        Error::Usage {
            name: self.0.name.clone(),
            what: what.into(),
        }
    }

    pub(crate) fn usage(&self) -> ImageUsage {
        self.0.usage
    }
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let i = &self.0;
        write!(
            f,
            "Image({}, {}x{} {:?})",
            i.name, i.width, i.height, i.format
        )
    }
}

impl ImageInner {
    /// Aspects of copies: for depth and stencil, the depth.
    pub fn copied(&self) -> vk::ImageAspectFlags {
        if self.aspect.contains(vk::ImageAspectFlags::DEPTH) {
            vk::ImageAspectFlags::DEPTH
        } else {
            self.aspect
        }
    }

    /// Makes the views and their descriptors.
    fn make_views(&mut self) -> Result<(), Error> {
        if self.usage.0 == 0 {
            return Ok(());
        }
        let kind = if self.layers > 1 {
            vk::ImageViewType::TYPE_2D_ARRAY
        } else {
            vk::ImageViewType::TYPE_2D
        };
        let make = |levels: u32, kind: vk::ImageViewType, layers: u32| {
            let info = vk::ImageViewCreateInfo::default()
                .image(self.raw)
                .view_type(kind)
                .format(self.format.vk())
                .subresource_range(vk::ImageSubresourceRange {
                    level_count: levels,
                    layer_count: layers,
                    ..whole(self.aspect)
                });
            // SAFETY: the image is alive, levels and layers are its own.
            unsafe { self.device.vk().create_image_view(&info, None) }.context("vkCreateImageView")
        };
        let view = make(self.mips, kind, self.layers)?;
        self.view = view;
        self.target = if self.mips > 1 || self.layers > 1 {
            make(1, vk::ImageViewType::TYPE_2D, 1)?
        } else {
            view
        };
        let bindless = &self.device.0.bindless;
        if self.usage.has(ImageUsage::SAMPLED) {
            self.texture = bindless.add_texture(self.device.vk(), self.view, self.layout)?;
        }
        if self.usage.has(ImageUsage::STORAGE) {
            self.storage = bindless.add_storage(self.device.vk(), self.target)?;
        }
        Ok(())
    }
}

impl Drop for ImageInner {
    fn drop(&mut self) {
        let device = &self.device.0;
        if self.texture != NO_INDEX {
            device.bury(Garbage::Texture(self.texture));
        }
        if self.storage != NO_INDEX {
            device.bury(Garbage::Storage(self.storage));
        }
        if self.target != self.view && self.target != vk::ImageView::null() {
            device.bury(Garbage::View(self.target));
        }
        if self.view != vk::ImageView::null() {
            device.bury(Garbage::View(self.view));
        }
        if let Some(memory) = lock(&self.memory).take() {
            device.bury(Garbage::Image(self.raw, memory));
        }
    }
}
