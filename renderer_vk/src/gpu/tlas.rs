//! Top-level acceleration structures: instances of bottom-level ones.

use ash::vk;

use super::accel::{Storage, build_sizes, functions, scratch_alignment};
use super::device::Device;
use super::error::Error;
use super::graveyard::Garbage;
use super::pass::Pass;

/// An instance of a bottom-level structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Object to world, three rows.
    pub transform: [[f32; 4]; 3],
    /// Custom index for shaders; 24 bits.
    pub custom_index: u32,
    /// Rays test it if their mask shares a bit.
    pub mask: u8,
    /// Added to the ray's offset to select the hit group; 24 bits.
    pub sbt_offset: u32,
    /// Disables face culling.
    pub cull_disable: bool,
    /// Front faces are clockwise seen from the ray's origin, instead of counter-clockwise.
    pub flip_facing: bool,
    /// Overrides the geometry: `Some(true)` as opaque, `Some(false)` as not opaque.
    pub force_opaque: Option<bool>,
    /// Address of the bottom-level structure; 0: an inactive instance.
    pub blas: u64,
}

impl Instance {
    /// An instance with the identity transform, visible to all rays.
    pub fn new(blas: u64) -> Self {
        Self {
            transform: [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
            custom_index: 0,
            mask: 0xff,
            sbt_offset: 0,
            cull_disable: false,
            flip_facing: false,
            force_opaque: None,
            blas,
        }
    }

    /// The words of Vulkan's instance structure.
    pub fn words(&self) -> [u32; 16] {
        bytemuck::cast(instance_bytes(&self.vk()))
    }

    fn vk(&self) -> vk::AccelerationStructureInstanceKHR {
        use vk::GeometryInstanceFlagsKHR as F;
        let mut matrix = [0.0; 12];
        for (target, value) in matrix.iter_mut().zip(self.transform.iter().flatten()) {
            *target = *value;
        }
        let mut flags = F::empty();
        if self.cull_disable {
            flags |= F::TRIANGLE_FACING_CULL_DISABLE;
        }
        if self.flip_facing {
            flags |= F::TRIANGLE_FLIP_FACING;
        }
        match self.force_opaque {
            Some(true) => flags |= F::FORCE_OPAQUE,
            Some(false) => flags |= F::FORCE_NO_OPAQUE,
            None => {}
        }
        vk::AccelerationStructureInstanceKHR {
            transform: vk::TransformMatrixKHR { matrix },
            instance_custom_index_and_mask: vk::Packed24_8::new(
                self.custom_index & 0x00ff_ffff,
                self.mask,
            ),
            instance_shader_binding_table_record_offset_and_flags: vk::Packed24_8::new(
                self.sbt_offset & 0x00ff_ffff,
                u8::try_from(flags.as_raw()).unwrap_or(0),
            ),
            acceleration_structure_reference: vk::AccelerationStructureReferenceKHR {
                device_handle: self.blas,
            },
        }
    }
}

/// A top-level acceleration structure.
pub struct Tlas {
    name: String,
    device: Device,
    storage: Option<Storage>,
    index: Option<u32>,
}

impl Tlas {
    /// An empty structure; build it before shaders use it.
    pub fn new(device: &Device, name: &str) -> Self {
        Self {
            name: name.to_owned(),
            device: device.clone(),
            storage: None,
            index: None,
        }
    }

    /// Index in binding 3, valid after [`Pass::build_tlas`], which may change it.
    pub fn index(&self) -> u32 {
        self.index.unwrap_or(super::image::NO_INDEX)
    }

    /// Device address, valid after [`Pass::build_tlas`], which may change it.
    pub fn address(&self) -> u64 {
        self.storage.as_ref().map_or(0, |s| s.address)
    }

    /// Bytes of its memory.
    pub fn size(&self) -> u64 {
        self.storage.as_ref().map_or(0, |s| s.size)
    }

    /// Ensures that the storage holds `size` bytes.
    fn reserve(&mut self, device: &Device, size: u64) -> Result<(), Error> {
        if self.storage.as_ref().is_some_and(|s| s.size >= size) {
            return Ok(());
        }
        let old = self.storage.as_ref().map_or(0, |s| s.size);
        self.release();
        let storage = Storage::new(
            device,
            &self.name,
            vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            size.max(old.saturating_mul(2)),
        )?;
        self.index = Some(device.0.bindless.add_scene(device.vk(), storage.raw)?);
        self.storage = Some(storage);
        Ok(())
    }

    fn release(&mut self) {
        if let Some(index) = self.index.take() {
            self.device.0.bury(Garbage::Scene(index));
        }
        self.storage = None;
    }
}

impl Drop for Tlas {
    fn drop(&mut self) {
        self.release();
    }
}

impl Pass<'_> {
    /// Builds the top-level structure from `instances`, after waiting for bottom-level builds of this pass. The pass
    /// declares [`Access::ACCEL_BUILD`](super::Access::ACCEL_BUILD).
    ///
    /// # Errors
    /// A device without acceleration structures; out of memory; more instances than the device allows.
    pub fn build_tlas(&mut self, tlas: &mut Tlas, instances: &[Instance]) -> Result<(), Error> {
        let words: Vec<[u32; 16]> = instances.iter().map(Instance::words).collect();
        let address = self.arena().push(&words)?;
        self.build_tlas_of(tlas, address, instances.len())
    }

    /// As [`build_tlas`](Self::build_tlas), from the [words](Instance::words) of `number` instances at a device address, a
    /// multiple of 16.
    ///
    /// # Errors
    /// As for [`build_tlas`](Self::build_tlas).
    pub fn build_tlas_of(
        &mut self,
        tlas: &mut Tlas,
        address: u64,
        number: usize,
    ) -> Result<(), Error> {
        let device = self.device().clone();
        let functions = functions(&device, &tlas.name)?;
        let count = u32::try_from(number).unwrap_or(u32::MAX);
        if let Some(limits) = device.0.info.ray_tracing
            && u64::from(count) > limits.max_instances
        {
            return Err(Error::Unsupported {
                name: tlas.name.clone(),
                what: format!("{count} instances ({} are)", limits.max_instances),
                device: device.0.info.name.clone(),
            });
        }
        let geometries = [vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR {
                instances: vk::AccelerationStructureGeometryInstancesDataKHR::default().data(
                    vk::DeviceOrHostAddressConstKHR {
                        device_address: address,
                    },
                ),
            })];
        let mut info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(vk::AccelerationStructureTypeKHR::TOP_LEVEL)
            .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(&geometries);
        // SAFETY: one count for the one geometry.
        let sizes = unsafe { build_sizes(functions, &info, &[count]) };
        tlas.reserve(&device, sizes.acceleration_structure_size)?;
        let align = scratch_alignment(&device);
        let scratch = self.recorder().scratch(sizes.build_scratch_size + align)?;
        self.barrier();
        // `reserve` has made the storage.
        info = info
            .dst_acceleration_structure(tlas.storage.as_ref().map(|s| s.raw).unwrap_or_default())
            .scratch_data(vk::DeviceOrHostAddressKHR {
                device_address: scratch.address().next_multiple_of(align),
            });
        let ranges = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count)];
        // SAFETY: storage and scratch have the sizes that the driver requires; the caller's address has the instances.
        unsafe {
            functions.cmd_build_acceleration_structures(self.cmd(), &[info], &[&ranges]);
        }
        Ok(())
    }
}

/// The 64 bytes of Vulkan's instance structure.
fn instance_bytes(instance: &vk::AccelerationStructureInstanceKHR) -> [u8; 64] {
    const {
        assert!(size_of::<vk::AccelerationStructureInstanceKHR>() == 64);
    }
    // SAFETY: a C structure of 64 bytes without padding: 48 of matrix, twice 4 of bit fields, 8 of address.
    unsafe { std::ptr::read(std::ptr::from_ref(instance).cast::<[u8; 64]>()) }
}
