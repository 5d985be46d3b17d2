//! Memory of the device: taken for an object, given back, and counted by what it is for.

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::{Device, DeviceInner, lock};
use super::error::Error;

/// What a piece of memory is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryKind {
    /// An image that shaders write or that is drawn to.
    Target,
    /// An image that is only sampled.
    Texture,
    /// A buffer of acceleration structures.
    AccelerationStructure,
    /// Any other buffer of the device.
    Buffer,
    /// A buffer that the CPU sees.
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

    /// What the allocator's name of the memory begins with: it knows names alone.
    fn mark(self) -> &'static str {
        match self {
            Self::Target => "target: ",
            Self::Texture => "texture: ",
            Self::AccelerationStructure => "structure: ",
            Self::Buffer => "buffer: ",
            Self::Shared => "shared: ",
        }
    }

    /// Back from the allocator's name: kind and label.
    fn of(name: &str) -> (Self, &str) {
        let found = Self::ALL
            .iter()
            .find_map(|kind| Some((*kind, name.strip_prefix(kind.mark())?)));
        found.unwrap_or((Self::Buffer, name))
    }
}

/// A piece of memory in use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryUse {
    /// What for.
    pub kind: MemoryKind,
    /// Label of the object.
    pub label: String,
    /// Bytes.
    pub bytes: u64,
}

/// GPU memory in use, for a console command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryReport {
    /// Bytes taken by live objects.
    pub allocated: u64,
    /// Bytes taken from the driver.
    pub reserved: u64,
    /// Number of live allocations.
    pub allocations: usize,
}

impl Device {
    /// Memory in use.
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

    /// Every piece of memory in use.
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
    /// Takes memory for an object.
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

    /// Gives memory back.
    pub fn free(&self, allocation: Allocation) {
        if let Some(allocator) = lock(&self.allocator).as_mut()
            && let Err(e) = allocator.free(allocation)
        {
            log::error!("GPU memory could not be freed: {e}");
        }
    }
}
