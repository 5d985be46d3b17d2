//! Compaction: copies long-lived bottom-level structures to the least memory that they need.
//!
//! The driver determines this size during the build. A query after the build requests it, and a later frame reads it
//! without waiting.

use ash::vk;

use super::accel::{Blas, Storage, functions};
use super::device::{Device, lock};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::pass::Pass;

/// Compacted sizes requested from the GPU.
pub struct CompactedSizes {
    device: Device,
    pool: vk::QueryPool,
    count: usize,
    /// Timeline value of the requesting frame; 0: outside of frames, and finished before the caller gets the value.
    frame: u64,
}

impl CompactedSizes {
    /// Bytes that each structure needs, in the order of the request; `None` while the GPU has not finished the query.
    ///
    /// # Errors
    /// A lost device.
    pub fn sizes(&self) -> Result<Option<Vec<u64>>, Error> {
        if self.device.0.finished()? < self.frame {
            return Ok(None);
        }
        let mut sizes = vec![0u64; self.count];
        // SAFETY: the pool has as many queries, which the frame has reset; without the WAIT flag the call does not
        // block.
        let read = unsafe {
            self.device.vk().get_query_pool_results(
                self.pool,
                0,
                &mut sizes,
                vk::QueryResultFlags::TYPE_64,
            )
        };
        match read {
            Ok(()) => Ok(Some(sizes)),
            Err(vk::Result::NOT_READY) => Ok(None),
            Err(e) => Err(e).context("vkGetQueryPoolResults"),
        }
    }
}

impl Drop for CompactedSizes {
    fn drop(&mut self) {
        self.device.0.bury(Garbage::QueryPool(self.pool));
    }
}

impl Pass<'_> {
    /// Queries the compacted sizes of structures, after waiting for their builds in this pass. They must allow
    /// compaction. The pass declares [`Access::ACCEL_BUILD`](super::Access::ACCEL_BUILD).
    ///
    /// # Errors
    /// A device without acceleration structures; a structure that is not built; out of memory.
    pub fn ask_compacted_sizes(&mut self, structures: &[&Blas]) -> Result<CompactedSizes, Error> {
        let device = self.device().clone();
        let functions = functions(&device, "ask_compacted_sizes")?;
        let raw: Vec<_> = structures.iter().filter_map(|b| b.compactable()).collect();
        if raw.len() != structures.len() || raw.is_empty() {
            return Err(Error::Usage {
                name: "ask_compacted_sizes".to_owned(),
                what: "a structure that is not built, or not to be compacted".to_owned(),
            });
        }
        let count = u32::try_from(raw.len()).unwrap_or(u32::MAX);
        let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(kind)
            .query_count(count);
        // SAFETY: plain creation.
        let pool =
            unsafe { device.vk().create_query_pool(&info, None) }.context("vkCreateQueryPool")?;
        let frame = match self.recorder().recording {
            Some(_) => lock(&device.0.state).submitted + 1,
            None => 0,
        };
        self.barrier();
        // SAFETY: the pool is new and not in use.
        unsafe { device.vk().cmd_reset_query_pool(self.cmd(), pool, 0, count) };
        // SAFETY: the structures were built with ALLOW_COMPACTION earlier in the queue, which the barrier waits for.
        unsafe {
            functions.cmd_write_acceleration_structures_properties(self.cmd(), &raw, kind, pool, 0);
        }
        Ok(CompactedSizes {
            device: device.clone(),
            pool,
            count: raw.len(),
            frame,
        })
    }

    /// Copies a structure to memory of `size` bytes, the value of [`ask_compacted_sizes`](Self::ask_compacted_sizes)
    /// since its last build; its address changes. The pass declares
    /// [`Access::ACCEL_BUILD`](super::Access::ACCEL_BUILD).
    ///
    /// # Errors
    /// A device without acceleration structures; out of memory.
    pub fn compact_blas(&mut self, blas: &mut Blas, size: u64) -> Result<(), Error> {
        if size == 0 || size > blas.size() {
            return Ok(());
        }
        let device = self.device().clone();
        let functions = functions(&device, "compact_blas")?;
        let Some(source) = blas.compactable() else {
            return Ok(());
        };
        let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        let target = Storage::new(&device, blas.name(), kind, size)?;
        let info = vk::CopyAccelerationStructureInfoKHR::default()
            .src(source)
            .dst(target.raw())
            .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
        self.end_rendering();
        // SAFETY: the target has the compacted size of the source, which was built with the flag for it.
        unsafe { functions.cmd_copy_acceleration_structure(self.cmd(), &info) };
        // the graveyard keeps the old memory until no frame uses it
        blas.replace_storage(target);
        Ok(())
    }
}
