//! The counters on the GPU, and their copies for the CPU.

use crate::gpu::{Access, Buffer, BufferDesc, BufferUsage, Device, Error, Memory, Recorder};

/// Bytes of the smallest buffers.
const LEAST: u64 = 4096;

/// Counters of the frames in flight. `T`: what each frame counts.
pub struct Counts<T> {
    counters: Option<Buffer>,
    /// A frame reuses the first copy that was read.
    copies: Vec<Copy<T>>,
}

struct Copy<T> {
    /// Serial of the frame that wrote it.
    frame: u64,
    buffer: Buffer,
    /// Number of counters.
    number: usize,
    /// `None`: it was read.
    of: Option<T>,
}

impl<T> Default for Counts<T> {
    fn default() -> Self {
        Self {
            counters: None,
            copies: Vec::new(),
        }
    }
}

fn buffer(device: &Device, name: &str, number: usize, readback: bool) -> Result<Buffer, Error> {
    let (usage, memory) = match readback {
        true => (BufferUsage::TRANSFER, Memory::Readback),
        false => (BufferUsage::STORAGE, Memory::Device),
    };
    let size = (number as u64 * 4).next_power_of_two().max(LEAST);
    let desc = BufferDesc {
        name,
        size,
        usage,
        memory,
    };
    Buffer::new(device, &desc)
}

impl<T> Counts<T> {
    /// The next finished frame's counters, each frame once, in order.
    ///
    /// # Errors
    /// The device is lost.
    pub fn next(&mut self, rec: &Recorder) -> Result<Option<(T, Vec<u32>)>, Error> {
        let over = |c: &&mut Copy<T>| c.of.is_some() && c.frame <= rec.finished();
        let Some(copy) = self.copies.iter_mut().filter(over).min_by_key(|c| c.frame) else {
            return Ok(None);
        };
        let mut counts = vec![0; copy.number];
        copy.buffer.read(0, bytemuck::cast_slice_mut(&mut counts))?;
        Ok(copy.of.take().map(|of| (of, counts)))
    }

    /// Address of so many counters, cleared.
    ///
    /// # Errors
    /// Out of memory.
    pub fn begin(&mut self, rec: &mut Recorder, number: usize) -> Result<u64, Error> {
        let bytes = number as u64 * 4;
        let kept = self.counters.take().filter(|b| b.size() >= bytes);
        let counters = match kept {
            Some(buffer) => buffer,
            None => buffer(rec.device(), "hit counters", number, false)?,
        };
        if bytes > 0 {
            rec.pass("trace_feedback", Access::TRANSFER, Access::TRANSFER)?
                .fill_buffer(&counters, 0, bytes, 0);
        }
        let address = counters.address();
        self.counters = Some(counters);
        Ok(address)
    }

    /// Copies the counters of a frame for the CPU.
    ///
    /// # Errors
    /// Out of memory.
    pub fn end(&mut self, rec: &mut Recorder, number: usize, of: T) -> Result<(), Error> {
        let Some(counters) = self.counters.as_ref().filter(|_| number > 0) else {
            return Ok(());
        };
        let frame = rec.serial();
        let bytes = number as u64 * 4;
        // a copy that was read belongs to a finished frame
        let free = self.copies.iter().position(|c| c.of.is_none());
        let mut copy = match free {
            Some(free) => self.copies.swap_remove(free),
            None => Copy {
                frame,
                buffer: buffer(rec.device(), "hit counts", number, true)?,
                number,
                of: None,
            },
        };
        if copy.buffer.size() < bytes {
            copy.buffer = buffer(rec.device(), "hit counts", number, true)?;
        }
        (copy.frame, copy.number, copy.of) = (frame, number, Some(of));
        rec.pass("trace_feedback", Access::TRANSFER, Access::TRANSFER)?
            .copy_buffer(counters, 0, &copy.buffer, 0, bytes);
        self.copies.push(copy);
        Ok(())
    }
}
