//! Memory for data that the CPU writes in every frame.

use bytemuck::Pod;

use super::buffer::{Buffer, BufferDesc, BufferUsage, Memory};
use super::device::Device;
use super::error::Error;

/// Size of a chunk, bytes; larger allocations get a chunk of their own.
const CHUNK: u64 = 1 << 20;
/// Minimum alignment of allocations, bytes.
const ALIGN: u64 = 16;

/// Mapped memory of one frame: a linear allocator that is reset when the frame is over. It grows by chunks, which are
/// kept for later frames.
pub struct UploadArena {
    device: Device,
    chunks: Vec<Buffer>,
    /// The current chunk and the bytes used in it.
    current: usize,
    used: u64,
}

/// An allocation in an [`UploadArena`]; write to it through [`bytes`](Self::bytes) before the frame ends.
pub struct ArenaSlice<'a> {
    bytes: &'a mut [u8],
    /// Device address of the first byte.
    pub address: u64,
    /// Offset of the first byte in [`buffer`](Self::buffer).
    pub offset: u64,
    buffer: Buffer,
}

impl ArenaSlice<'_> {
    /// The bytes; unwritten ones are undefined.
    pub fn bytes(&mut self) -> &mut [u8] {
        self.bytes
    }

    /// The buffer of the allocation (usable for indices, indirect parameters and acceleration structure input).
    pub fn buffer(&self) -> &Buffer {
        &self.buffer
    }
}

impl UploadArena {
    pub(crate) fn new(device: &Device) -> Self {
        Self {
            device: device.clone(),
            chunks: Vec::new(),
            current: 0,
            used: 0,
        }
    }

    /// Frees all allocations; the frame that used them is over.
    pub(crate) fn reset(&mut self) {
        self.current = 0;
        self.used = 0;
    }

    /// Allocates `size` bytes at a multiple of `align` (a power of two; at least 16).
    ///
    /// # Errors
    /// Out of memory.
    pub fn alloc(&mut self, size: u64, align: u64) -> Result<ArenaSlice<'_>, Error> {
        let align = align.max(ALIGN);
        let length = usize::try_from(size).map_err(|_| Error::OutOfMemory {
            what: "upload arena".to_owned(),
            bytes: size,
            reason: "larger than the address space".to_owned(),
        })?;
        loop {
            let Some(chunk) = self.chunks.get(self.current) else {
                // `align` more, because the driver determines the alignment of the chunk itself.
                let chunk = Buffer::new(
                    &self.device,
                    &BufferDesc {
                        name: "upload arena",
                        size: size.saturating_add(align).max(CHUNK),
                        usage: BufferUsage::INDEX
                            | BufferUsage::INDIRECT
                            | BufferUsage::ACCEL_INPUT,
                        memory: Memory::Upload,
                    },
                )?;
                self.chunks.push(chunk);
                self.used = 0;
                continue;
            };
            let address = (chunk.address() + self.used).next_multiple_of(align);
            let offset = address - chunk.address();
            let end = offset.saturating_add(size);
            if end > chunk.size() {
                self.current += 1;
                self.used = 0;
                continue;
            }
            self.used = end;
            let buffer = chunk.clone();
            let start = buffer.mapped_range(offset, length)?;
            // SAFETY: the range lies in mapped memory of the chunk, is handed out once per frame, and no GPU work
            // reads it before the frame is submitted; the slice borrows the arena, so it cannot outlive a reset.
            let bytes = unsafe { std::slice::from_raw_parts_mut(start, length) };
            return Ok(ArenaSlice {
                bytes,
                address,
                offset,
                buffer,
            });
        }
    }

    /// Copies `data` and returns the device address, a multiple of 16.
    ///
    /// # Errors
    /// Out of memory.
    pub fn push<T: Pod>(&mut self, data: &[T]) -> Result<u64, Error> {
        let source: &[u8] = bytemuck::cast_slice(data);
        let mut slice = self.alloc(source.len() as u64, ALIGN)?;
        slice.bytes().copy_from_slice(source);
        Ok(slice.address)
    }

    /// Copies indices; returns buffer and offset for [`Pass::bind_index_buffer`](super::Pass::bind_index_buffer).
    ///
    /// # Errors
    /// Out of memory.
    pub fn push_indices(&mut self, indices: &[u32]) -> Result<(Buffer, u64), Error> {
        let source: &[u8] = bytemuck::cast_slice(indices);
        // an empty allocation would have no buffer to bind
        let mut slice = self.alloc(source.len().max(4) as u64, ALIGN)?;
        if let Some(out) = slice.bytes().get_mut(..source.len()) {
            out.copy_from_slice(source);
        }
        Ok((slice.buffer.clone(), slice.offset))
    }
}
