//! Bottom-level acceleration structures of triangles.

use ash::vk;

use super::access::Access;
use super::buffer::{Buffer, BufferDesc, BufferUsage, Memory};
use super::device::Device;
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::pass::Pass;

/// Scratch memory shared by the builds of one call, bytes; larger calls build in several steps.
const SCRATCH: u64 = 64 << 20;

/// Flags of a bottom-level structure's builds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct BlasFlags {
    /// Prefer fast builds (moving geometry) to fast traversal (static geometry).
    pub fast_build: bool,
    /// Allows compaction, by [`Device::build_static_blas`] and [`Pass::compact_blas`].
    pub compact: bool,
    /// Allows refits ([`BlasBuild::refit`]).
    pub refit: bool,
}

/// Triangles of a bottom-level structure.
#[derive(Clone, Copy, Debug, Default)]
pub struct BlasGeometry {
    /// Address of the first vertex, whose first 12 bytes are its position.
    pub vertex_address: u64,
    /// Bytes from vertex to vertex.
    pub vertex_stride: u64,
    /// Highest index that occurs.
    pub max_vertex: u32,
    /// Address of the first triangle's first index (32 bits).
    pub index_address: u64,
    /// Triangles.
    pub triangle_count: u32,
    /// The any-hit shader is never called.
    pub opaque: bool,
    /// The any-hit shader is called at most once per triangle.
    pub no_duplicate_any_hit: bool,
}

/// One build of a batch.
pub struct BlasBuild<'a> {
    /// The structure; if its storage is too small, it gets new storage and a new address.
    pub blas: &'a mut Blas,
    /// Its triangles.
    pub geometries: &'a [BlasGeometry],
    /// The triangles are those of the last build at other positions: the structure is updated instead of built. Ignored
    /// for a structure that was never built, or whose number of triangles has changed.
    pub refit: bool,
}

/// A structure with its memory.
pub(super) struct Storage {
    device: Device,
    pub(super) raw: vk::AccelerationStructureKHR,
    pub(super) size: u64,
    pub(super) address: u64,
    _buffer: Buffer,
}

impl Storage {
    pub(super) fn raw(&self) -> vk::AccelerationStructureKHR {
        self.raw
    }

    pub(super) fn new(
        device: &Device,
        name: &str,
        kind: vk::AccelerationStructureTypeKHR,
        size: u64,
    ) -> Result<Self, Error> {
        let functions = functions(device, name)?;
        let buffer = Buffer::new(
            device,
            &BufferDesc {
                name,
                // The structure begins at offset 0, a multiple of the required 256.
                size,
                usage: BufferUsage::ACCEL_STORAGE,
                memory: Memory::Device,
            },
        )?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(buffer.0.raw)
            .size(size)
            .ty(kind);
        // SAFETY: the buffer has the usage and the size.
        let raw = unsafe { functions.create_acceleration_structure(&info, None) }
            .context("vkCreateAccelerationStructureKHR")?;
        device.0.name(raw, name);
        let info =
            vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
        // SAFETY: just made.
        let address = unsafe { functions.get_acceleration_structure_device_address(&info) };
        Ok(Self {
            device: device.clone(),
            raw,
            size,
            address,
            _buffer: buffer,
        })
    }
}

impl Drop for Storage {
    fn drop(&mut self) {
        // The structure is buried before its buffer, which is dropped afterwards.
        self.device.0.bury(Garbage::Acceleration(self.raw));
    }
}

pub(super) fn functions<'a>(
    device: &'a Device,
    name: &str,
) -> Result<&'a ash::khr::acceleration_structure::Device, Error> {
    device
        .0
        .acceleration
        .as_ref()
        .ok_or_else(|| Error::Unsupported {
            name: name.to_owned(),
            what: "an acceleration structure".to_owned(),
            device: device.0.info.name.clone(),
        })
}

/// A bottom-level acceleration structure.
pub struct Blas {
    device: Device,
    name: String,
    flags: BlasFlags,
    storage: Option<Storage>,
    /// Number of triangles of each geometry in the last build.
    built: Vec<u32>,
}

impl Blas {
    /// An empty structure; the first build allocates its memory.
    pub fn new(device: &Device, name: &str, flags: BlasFlags) -> Self {
        Self {
            device: device.clone(),
            name: name.to_owned(),
            flags,
            storage: None,
            built: Vec::new(),
        }
    }

    /// The device address for [`Instance::blas`](super::tlas::Instance::blas); 0 before the first build. A new build
    /// may change it.
    pub fn address(&self) -> u64 {
        self.storage.as_ref().map_or(0, |s| s.address)
    }

    /// Bytes of its memory.
    pub fn size(&self) -> u64 {
        self.storage.as_ref().map_or(0, |s| s.size)
    }

    /// The label.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// The structure to compact, if it is built and allows compaction.
    pub(super) fn compactable(&self) -> Option<vk::AccelerationStructureKHR> {
        let storage = self.storage.as_ref().filter(|_| self.flags.compact)?;
        Some(storage.raw)
    }

    /// Replaces the storage by one that holds a copy.
    pub(super) fn replace_storage(&mut self, storage: Storage) {
        self.storage = Some(storage);
    }

    fn build_flags(&self) -> vk::BuildAccelerationStructureFlagsKHR {
        use vk::BuildAccelerationStructureFlagsKHR as F;
        let mut flags = if self.flags.fast_build {
            F::PREFER_FAST_BUILD
        } else {
            F::PREFER_FAST_TRACE
        };
        if self.flags.compact {
            flags |= F::ALLOW_COMPACTION;
        }
        if self.flags.refit {
            flags |= F::ALLOW_UPDATE;
        }
        flags
    }
}

/// Vulkan's form of the triangles.
fn triangles(g: &BlasGeometry) -> vk::AccelerationStructureGeometryKHR<'static> {
    let mut flags = vk::GeometryFlagsKHR::empty();
    if g.opaque {
        flags |= vk::GeometryFlagsKHR::OPAQUE;
    }
    if g.no_duplicate_any_hit {
        flags |= vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION;
    }
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .flags(flags)
        .geometry(vk::AccelerationStructureGeometryDataKHR {
            triangles: vk::AccelerationStructureGeometryTrianglesDataKHR::default()
                .vertex_format(vk::Format::R32G32B32_SFLOAT)
                .vertex_data(vk::DeviceOrHostAddressConstKHR {
                    device_address: g.vertex_address,
                })
                .vertex_stride(g.vertex_stride)
                .max_vertex(g.max_vertex)
                .index_type(vk::IndexType::UINT32)
                .index_data(vk::DeviceOrHostAddressConstKHR {
                    device_address: g.index_address,
                }),
        })
}

/// A build that is ready for recording.
struct Planned {
    geometries: Vec<vk::AccelerationStructureGeometryKHR<'static>>,
    ranges: Vec<vk::AccelerationStructureBuildRangeInfoKHR>,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    target: vk::AccelerationStructureKHR,
    /// Updated in place.
    refit: bool,
    scratch: u64,
}

impl Planned {
    /// Vulkan's structure, without the scratch address.
    fn info(&self) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        use vk::BuildAccelerationStructureModeKHR as Mode;
        let info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL)
            .flags(self.flags)
            .dst_acceleration_structure(self.target)
            .geometries(&self.geometries);
        if self.refit {
            info.mode(Mode::UPDATE)
                .src_acceleration_structure(self.target)
        } else {
            info.mode(Mode::BUILD)
        }
    }
}

/// Allocates storage for every build and plans it.
fn plan(builds: &mut [BlasBuild<'_>]) -> Result<Vec<Planned>, Error> {
    let mut planned = Vec::with_capacity(builds.len());
    for build in builds {
        let device = &build.blas.device.clone();
        let functions = functions(device, &build.blas.name)?;
        let geometries: Vec<_> = build.geometries.iter().map(triangles).collect();
        let counts: Vec<u32> = build.geometries.iter().map(|g| g.triangle_count).collect();
        if let Some(limits) = device.0.info.ray_tracing {
            let total: u64 = counts.iter().map(|c| u64::from(*c)).sum();
            if total > limits.max_primitives {
                return Err(Error::Unsupported {
                    name: build.blas.name.clone(),
                    what: format!(
                        "{total} triangles in one structure ({} are)",
                        limits.max_primitives
                    ),
                    device: device.0.info.name.clone(),
                });
            }
        }
        let flags = build.blas.build_flags();
        let info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL)
            .flags(flags)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(&geometries);
        // SAFETY: one count for each geometry.
        let sizes = unsafe { build_sizes(functions, &info, &counts) };
        let refit = build.refit && build.blas.flags.refit && build.blas.built == counts;
        if !refit && build.blas.size() < sizes.acceleration_structure_size {
            // A structure of varying triangles that is built each frame gets spare storage, so that not every build
            // reallocates.
            let size = if build.blas.flags.fast_build && !build.blas.flags.refit {
                sizes.acceleration_structure_size.saturating_mul(5) / 4
            } else {
                sizes.acceleration_structure_size
            };
            build.blas.storage = None;
            build.blas.storage = Some(Storage::new(
                device,
                &build.blas.name,
                vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
                size,
            )?);
        }
        // Made above where it was missing.
        let target = build.blas.storage.as_ref().map(|s| s.raw);
        let target = target.unwrap_or_default();
        build.blas.built.clone_from(&counts);
        planned.push(Planned {
            geometries,
            ranges: counts
                .iter()
                .map(|count| {
                    vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(*count)
                })
                .collect(),
            flags,
            target,
            refit,
            scratch: if refit {
                sizes.update_scratch_size
            } else {
                sizes.build_scratch_size
            },
        });
    }
    Ok(planned)
}

/// Sizes of a structure and of the scratch memory of its build.
///
/// # Safety
/// `counts` has one for each geometry of `info`.
pub(super) unsafe fn build_sizes(
    functions: &ash::khr::acceleration_structure::Device,
    info: &vk::AccelerationStructureBuildGeometryInfoKHR<'_>,
    counts: &[u32],
) -> vk::AccelerationStructureBuildSizesInfoKHR<'static> {
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    let on_device = vk::AccelerationStructureBuildTypeKHR::DEVICE;
    // SAFETY: as the caller promises.
    unsafe {
        functions.get_acceleration_structure_build_sizes(on_device, info, counts, &mut sizes);
    }
    sizes
}

pub(super) fn scratch_alignment(device: &Device) -> u64 {
    device
        .0
        .info
        .ray_tracing
        .map_or(256, |l| u64::from(l.scratch_alignment))
        .max(1)
}

impl Pass<'_> {
    /// Builds bottom-level structures, in one command unless their scratch memory exceeds a limit. The pass declares
    /// [`Access::ACCEL_BUILD`].
    ///
    /// # Errors
    /// A device without acceleration structures; out of memory.
    pub fn build_blas(&mut self, builds: &mut [BlasBuild<'_>]) -> Result<(), Error> {
        let device = self.device().clone();
        let planned = plan(builds)?;
        if planned.is_empty() {
            return Ok(());
        }
        self.end_rendering();
        let functions = functions(&device, "build_blas")?;
        let align = scratch_alignment(&device);
        // Steps of builds with adjacent scratch memory.
        let mut steps: Vec<(Vec<(usize, u64)>, u64)> = Vec::new();
        for (index, build) in planned.iter().enumerate() {
            let size = build.scratch.next_multiple_of(align);
            match steps.last_mut() {
                Some((members, used)) if *used + size <= SCRATCH => {
                    members.push((index, *used));
                    *used += size;
                }
                _ => steps.push((vec![(index, 0)], size)),
            }
        }
        let most = steps.iter().map(|s| s.1).max().unwrap_or(0);
        let scratch = self.recorder().scratch(most + align)?;
        let base = scratch.address().next_multiple_of(align);
        for (members, _) in &steps {
            // The scratch memory is also that of the previous step or build.
            self.barrier();
            let parts = || {
                members
                    .iter()
                    .filter_map(|(i, at)| Some((planned.get(*i)?, *at)))
            };
            let infos: Vec<_> = parts()
                .map(|(build, at)| {
                    build.info().scratch_data(vk::DeviceOrHostAddressKHR {
                        device_address: base + at,
                    })
                })
                .collect();
            let ranges: Vec<&[_]> = parts().map(|(build, _)| &build.ranges[..]).collect();
            // SAFETY: storage and scratch have the sizes that the driver requires; the caller provides geometry
            // addresses within buffers of this device.
            unsafe {
                functions.cmd_build_acceleration_structures(self.cmd(), &infos, &ranges);
            }
        }
        Ok(())
    }
}

impl Device {
    /// Builds bottom-level structures and compacts those that allow it. Blocks; for loading.
    /// # Errors
    /// As [`Pass::build_blas`].
    pub fn build_static_blas(&self, builds: &mut [BlasBuild<'_>]) -> Result<(), Error> {
        if builds.is_empty() {
            return Ok(());
        }
        self.immediate(|rec| {
            rec.pass(
                "build_static_blas",
                Access::ACCEL_BUILD,
                Access::ACCEL_BUILD,
            )?
            .build_blas(builds)
        })?;
        let mut compact: Vec<&mut Blas> = builds
            .iter_mut()
            .map(|b| &mut *b.blas)
            .filter(|b| b.flags.compact && b.storage.is_some())
            .collect();
        if compact.is_empty() {
            return Ok(());
        }
        let asked = {
            let wanted: Vec<&Blas> = compact.iter().map(|b| &**b).collect();
            self.immediate(|rec| {
                rec.pass("compacted_size", Access::ACCEL_BUILD, Access::ACCEL_BUILD)?
                    .ask_compacted_sizes(&wanted)
            })?
        };
        // `immediate` has waited for them.
        let sizes = asked.sizes()?.unwrap_or_default();
        self.immediate(|rec| {
            let mut pass = rec.pass("compact_blas", Access::ACCEL_BUILD, Access::ACCEL_BUILD)?;
            for (blas, size) in compact.iter_mut().zip(&sizes) {
                if *size < blas.size() {
                    pass.compact_blas(blas, *size)?;
                }
            }
            Ok(())
        })
    }
}
