//! Buffers: each has a device address, and can be source and target of copies.

use std::ops::BitOr;
use std::ptr::NonNull;
use std::sync::{Arc, Mutex};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::device::{Device, lock};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::memory::MemoryKind;

/// Usage of a buffer in addition to storage and copies, which every buffer allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct BufferUsage(u32);

impl BufferUsage {
    /// Access by shaders through the address.
    pub const STORAGE: Self = Self(0);
    /// Copies only; the same as [`STORAGE`](Self::STORAGE).
    pub const TRANSFER: Self = Self(0);
    /// Indices of draws.
    pub const INDEX: Self = Self(1);
    /// Parameters of indirect draws and dispatches.
    pub const INDIRECT: Self = Self(2);
    /// Vertices, indices and instances of acceleration structure builds.
    pub const ACCEL_INPUT: Self = Self(4);
    /// A shader binding table.
    pub const SBT: Self = Self(8);
    /// Size proportional to the screen: statistics count it with images of that size.
    pub const SCREEN: Self = Self(32);
    /// Holds acceleration structures.
    pub(crate) const ACCEL_STORAGE: Self = Self(16);

    fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

impl BitOr for BufferUsage {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Memory type of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Memory {
    /// Device memory; uploads and the GPU write it.
    #[default]
    Device,
    /// Mapped memory that the CPU writes sequentially and the GPU reads.
    Upload,
    /// Mapped memory that the GPU writes and the CPU reads.
    Readback,
}

/// Parameters of a [`Buffer`].
#[derive(Clone, Copy, Debug)]
pub struct BufferDesc<'a> {
    /// Label in captures, validation messages and leak reports.
    pub name: &'a str,
    /// Size, bytes; 0 becomes 16, so that empty scenes need no special case.
    pub size: u64,
    /// Usage.
    pub usage: BufferUsage,
    /// Memory type.
    pub memory: Memory,
}

pub(crate) struct BufferInner {
    device: Device,
    pub raw: vk::Buffer,
    memory: Mutex<Option<Allocation>>,
    mapped: Option<Mapped>,
    size: u64,
    address: u64,
    name: String,
}

/// The mapped bytes of a buffer.
#[derive(Clone, Copy)]
pub(crate) struct Mapped(NonNull<u8>);
// SAFETY: the pointer is to memory that is valid as long as its owner and is only read and written through `write`,
// `read` (which take the owner's lock) and the arena (which borrows itself mutably).
unsafe impl Send for Mapped {}
// SAFETY: as above.
unsafe impl Sync for Mapped {}

/// A buffer. Clones share it.
#[derive(Clone)]
pub struct Buffer(pub(crate) Arc<BufferInner>);

impl Buffer {
    /// Makes a buffer; its contents are undefined until written.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device, desc: &BufferDesc<'_>) -> Result<Self, Error> {
        use vk::BufferUsageFlags as F;
        let size = desc.size.max(16).next_multiple_of(4);
        let mut usage =
            F::TRANSFER_SRC | F::TRANSFER_DST | F::STORAGE_BUFFER | F::SHADER_DEVICE_ADDRESS;
        if desc.usage.has(BufferUsage::INDEX) {
            usage |= F::INDEX_BUFFER;
        }
        if desc.usage.has(BufferUsage::INDIRECT) {
            usage |= F::INDIRECT_BUFFER;
        }
        let abilities = device.0.abilities;
        if desc.usage.has(BufferUsage::ACCEL_INPUT) && abilities.acceleration {
            usage |= F::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        }
        if desc.usage.has(BufferUsage::ACCEL_STORAGE) && abilities.acceleration {
            usage |= F::ACCELERATION_STRUCTURE_STORAGE_KHR;
        }
        if desc.usage.has(BufferUsage::SBT) && abilities.pipeline {
            usage |= F::SHADER_BINDING_TABLE_KHR;
        }
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let vk = device.vk();
        // SAFETY: the usage flags belong to features that are on.
        let raw = unsafe { vk.create_buffer(&info, None) }.context("vkCreateBuffer")?;
        // SAFETY: `raw` was just made.
        let requirements = unsafe { vk.get_buffer_memory_requirements(raw) };
        let location = match desc.memory {
            Memory::Device => MemoryLocation::GpuOnly,
            Memory::Upload => MemoryLocation::CpuToGpu,
            Memory::Readback => MemoryLocation::GpuToCpu,
        };
        let kind = match desc.memory {
            Memory::Device if desc.usage.has(BufferUsage::ACCEL_STORAGE) => {
                MemoryKind::AccelerationStructure
            }
            Memory::Device if desc.usage.has(BufferUsage::SCREEN) => MemoryKind::Target,
            Memory::Device => MemoryKind::Buffer,
            Memory::Upload | Memory::Readback => MemoryKind::Shared,
        };
        let memory = match (device.0).allocate(desc.name, kind, requirements, location, true) {
            Ok(memory) => memory,
            Err(e) => {
                // SAFETY: nothing uses the new buffer.
                unsafe { vk.destroy_buffer(raw, None) };
                return Err(e);
            }
        };
        let mapped = match desc.memory {
            Memory::Device => None,
            _ => memory.mapped_ptr().map(|p| Mapped(p.cast())),
        };
        // SAFETY: the memory object is only used for the binding below.
        let (object, offset) = (unsafe { memory.memory() }, memory.offset());
        // SAFETY: the memory was allocated for these requirements and is bound once.
        let bound = unsafe { vk.bind_buffer_memory(raw, object, offset) };
        if let Err(e) = bound.context("vkBindBufferMemory") {
            // Not by the graveyard: staging buffers are made while the uploads are locked, which it locks too.
            // SAFETY: nothing uses the new buffer.
            unsafe { vk.destroy_buffer(raw, None) };
            device.0.free(memory);
            return Err(e);
        }
        let mut inner = BufferInner {
            device: device.clone(),
            raw,
            memory: Mutex::new(Some(memory)),
            mapped,
            size,
            address: 0,
            name: desc.name.to_owned(),
        };
        let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
        // SAFETY: the buffer is bound and was made with the address usage.
        inner.address = unsafe { vk.get_buffer_device_address(&info) };
        device.0.name(raw, desc.name);
        Ok(Self(Arc::new(inner)))
    }

    /// A device buffer with the content `data`, which later submissions read.
    ///
    /// # Errors
    /// Out of memory.
    pub fn with_data<T: bytemuck::Pod>(
        device: &Device,
        name: &str,
        usage: BufferUsage,
        data: &[T],
    ) -> Result<Self, Error> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = Self::new(
            device,
            &BufferDesc {
                name,
                size: bytes.len() as u64,
                usage,
                memory: Memory::Device,
            },
        )?;
        device.upload_buffer(&buffer, 0, bytes)?;
        Ok(buffer)
    }

    /// Writes to a mapped buffer. The caller ensures that no frame in flight reads this range.
    ///
    /// # Errors
    /// [`Error::Usage`] if the buffer is not mapped or the range is outside.
    pub fn write(&self, offset: u64, bytes: &[u8]) -> Result<(), Error> {
        let target = self.mapped_range(offset, bytes.len())?;
        let _lock = lock(&self.0.memory);
        // SAFETY: the range was checked, the source is a slice, mapped memory does not overlap Rust's, and the lock
        // keeps other writers away.
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), target, bytes.len()) };
        Ok(())
    }

    /// Reads the GPU's results of a finished frame from a mapped buffer.
    ///
    /// # Errors
    /// [`Error::Usage`] if the buffer is not mapped or the range is outside.
    pub fn read(&self, offset: u64, bytes: &mut [u8]) -> Result<(), Error> {
        let source = self.mapped_range(offset, bytes.len())?;
        let _lock = lock(&self.0.memory);
        // SAFETY: the range was checked, the target is a slice, and the lock keeps writers away.
        unsafe { std::ptr::copy_nonoverlapping(source, bytes.as_mut_ptr(), bytes.len()) };
        Ok(())
    }

    /// The device address, a multiple of 16.
    pub fn address(&self) -> u64 {
        self.0.address
    }

    /// Size, bytes.
    pub fn size(&self) -> u64 {
        self.0.size
    }

    /// The label.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Takes the raw buffer and its memory from a buffer with a single owner; the caller buries them.
    pub(crate) fn dissolve(self) -> Option<(vk::Buffer, Allocation)> {
        let memory = lock(&self.0.memory).take()?;
        Some((self.0.raw, memory))
    }

    /// Checks that `[offset, offset + size)` is inside of the buffer.
    pub(crate) fn check(&self, offset: u64, size: u64) -> Result<(), Error> {
        match offset.checked_add(size) {
            Some(end) if end <= self.0.size => Ok(()),
            _ => Err(Error::Usage {
                name: self.0.name.clone(),
                what: format!(
                    "bytes {offset} + {size} are outside of the buffer of {} bytes",
                    self.0.size
                ),
            }),
        }
    }

    /// The mapped address of a range.
    pub(crate) fn mapped_range(&self, offset: u64, size: usize) -> Result<*mut u8, Error> {
        self.check(offset, size as u64)?;
        let (Some(mapped), Ok(offset)) = (self.0.mapped, usize::try_from(offset)) else {
            return Err(Error::Usage {
                name: self.0.name.clone(),
                what: "the buffer is not mapped".to_owned(),
            });
        };
        // SAFETY: `offset` is at most the size of the mapping (checked above).
        Ok(unsafe { mapped.0.as_ptr().add(offset) })
    }
}

impl std::fmt::Debug for Buffer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Buffer({}, {} bytes)", self.0.name, self.0.size)
    }
}

impl Drop for BufferInner {
    fn drop(&mut self) {
        if let Some(memory) = lock(&self.memory).take() {
            self.device.0.bury(Garbage::Buffer(self.raw, memory));
        }
    }
}
