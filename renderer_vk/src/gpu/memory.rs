//! Device memory: allocation, release, and statistics by kind.

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::{Device, DeviceInner, lock};
use super::error::Error;

/// Kind of a memory allocation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryKind {
    /// A storage image or an attachment.
    Target,
    /// An image that is only sampled.
    Texture,
    /// A buffer of acceleration structures.
    AccelerationStructure,
    /// Any other buffer of the device.
    Buffer,
    /// A mapped buffer.
    Shared,
}

impl MemoryKind {
    const ALL: [Self; 5] = [
        Self::Target,
        Self::Texture,
        Self::AccelerationStructure,
        Self::Buffer,
        Self::Shared,
    ];

    /// Prefix of the allocation's name: the allocator stores only names.
    fn mark(self) -> &'static str {
        match self {
            Self::Target => "target: ",
            Self::Texture => "texture: ",
            Self::AccelerationStructure => "structure: ",
            Self::Buffer => "buffer: ",
            Self::Shared => "shared: ",
        }
    }

    /// Kind and label from the allocation's name.
    fn of(name: &str) -> (Self, &str) {
        let found = Self::ALL
            .iter()
            .find_map(|kind| Some((*kind, name.strip_prefix(kind.mark())?)));
        found.unwrap_or((Self::Buffer, name))
    }
}

/// An allocation in use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryUse {
    /// Kind.
    pub kind: MemoryKind,
    /// Label of the object.
    pub label: String,
    /// Size, bytes.
    pub bytes: u64,
}

/// GPU memory in use, for a console command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryReport {
    /// Bytes of live objects.
    pub allocated: u64,
    /// Bytes allocated from the driver.
    pub reserved: u64,
    /// Number of live allocations.
    pub allocations: usize,
}

impl Device {
    /// Memory in use; none while the device is taken down.
    pub fn memory_report(&self) -> MemoryReport {
        lock(&self.0.allocator)
            .as_ref()
            .map(|allocator| {
                let report = allocator.generate_report();
                MemoryReport {
                    allocated: report.total_allocated_bytes,
                    reserved: report.total_capacity_bytes,
                    allocations: report.allocations.len(),
                }
            })
            .unwrap_or_default()
    }

    /// All allocations in use; none while the device is taken down.
    pub fn memory_uses(&self) -> Vec<MemoryUse> {
        let allocator = lock(&self.0.allocator);
        let allocations = allocator.as_ref().map(|a| a.generate_report().allocations);
        let uses = allocations.unwrap_or_default().into_iter().map(|a| {
            let (kind, label) = MemoryKind::of(&a.name);
            MemoryUse {
                kind,
                label: label.to_owned(),
                bytes: a.size,
            }
        });
        uses.collect()
    }
}

impl DeviceInner {
    /// Allocates memory for an object.
    pub fn allocate(
        &self,
        name: &str,
        kind: MemoryKind,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation, Error> {
        let mut guard = lock(&self.allocator);
        let fail = |reason: String| Error::OutOfMemory {
            what: name.to_owned(),
            bytes: requirements.size,
            reason,
        };
        guard
            .as_mut()
            .ok_or_else(|| fail("the allocator is gone".to_owned()))?
            .allocate(&AllocationCreateDesc {
                name: &format!("{}{name}", kind.mark()),
                requirements,
                location,
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|e| fail(e.to_string()))
    }

    /// Frees memory.
    pub fn free(&self, allocation: Allocation) {
        if let Some(allocator) = lock(&self.allocator).as_mut()
            && let Err(e) = allocator.free(allocation)
        {
            log::error!("GPU memory could not be freed: {e}");
        }
    }
}
