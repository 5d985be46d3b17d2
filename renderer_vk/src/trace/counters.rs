//! Ray counters of the passes: exact counts made on the GPU, while a caller requests them.

use shaders::trace_types::constants as t;

use super::passes::COUNTERS;
use crate::gpu::{
    Access, Buffer, BufferDesc, BufferUsage, Device, Error, Format, Image, ImageDesc, ImageUsage,
    Memory, Recorder,
};

/// Bytes of the counters.
const SIZE: u64 = COUNTERS as u64 * t::COUNTER_ROWS as u64 * 4;

/// The counters on the GPU, and the counts of the newest finished frame.
#[derive(Default)]
pub struct RayCounters {
    counters: Option<Buffer>,
    /// Copies for the CPU, each with the serial of the frame that wrote it; a frame reuses the oldest.
    copies: Vec<(u64, Buffer)>,
    newest: Option<(u64, [u64; COUNTERS])>,
    /// Ray count of each pixel, while it is displayed.
    pixels: Option<Image>,
}

/// Where the passes of a view count rays.
#[derive(Clone, Copy)]
pub struct Counting {
    /// Address of the counters; 0: rays are not counted.
    pub address: u64,
    /// Storage image of each pixel's ray count, or `NO_IMAGE`.
    pub image: u32,
}

impl RayCounters {
    /// Rays of each counted pass in the newest finished frame; `None` before one has finished.
    pub fn rays(&self) -> Option<[u64; COUNTERS]> {
        self.newest.map(|(_, rays)| rays)
    }

    /// Begins a view. `count`: count its rays by pass; `show`: count the rays of each pixel. Frees what neither needs.
    ///
    /// # Errors
    /// Out of memory.
    pub fn begin(
        &mut self,
        rec: &mut Recorder,
        size: [u32; 2],
        count: bool,
        show: bool,
    ) -> Result<Counting, Error> {
        let device = rec.device().clone();
        Ok(Counting {
            address: if count {
                self.clear(rec, &device)?
            } else {
                *self = Self {
                    pixels: self.pixels.take(),
                    ..Self::default()
                };
                0
            },
            image: self.image(&device, size, show)?,
        })
    }

    fn clear(&mut self, rec: &mut Recorder, device: &Device) -> Result<u64, Error> {
        self.read(rec)?;
        let counters = match &self.counters {
            Some(buffer) => buffer,
            None => {
                let desc = BufferDesc {
                    name: "ray counters",
                    size: SIZE,
                    usage: BufferUsage::STORAGE,
                    memory: Memory::Device,
                };
                self.counters.insert(Buffer::new(device, &desc)?)
            }
        };
        // counts of the views of a frame add up
        let begun = self.copies.iter().any(|(frame, _)| *frame == rec.serial());
        if !begun {
            rec.pass("count rays", Access::TRANSFER, Access::TRANSFER)?
                .fill_buffer(counters, 0, SIZE, 0);
        }
        Ok(counters.address())
    }

    /// Reads the newest copy whose frame has finished.
    fn read(&mut self, rec: &Recorder) -> Result<(), Error> {
        let over = |(frame, _): &&(u64, Buffer)| *frame <= rec.finished();
        let Some((frame, buffer)) = self.copies.iter().filter(over).max_by_key(|c| c.0) else {
            return Ok(());
        };
        if self.newest.is_some_and(|(newest, _)| newest >= *frame) {
            return Ok(());
        }
        let mut bytes = vec![0; SIZE as usize];
        buffer.read(0, &mut bytes)?;
        let mut rays = [0; COUNTERS];
        let rows = bytes.chunks_exact(t::COUNTER_ROWS as usize * 4);
        for (sum, row) in rays.iter_mut().zip(rows) {
            let counters = row.chunks_exact(4).filter_map(|c| c.try_into().ok());
            *sum = counters.map(|c| u64::from(u32::from_le_bytes(c))).sum();
        }
        self.newest = Some((*frame, rays));
        Ok(())
    }

    fn image(&mut self, device: &Device, size: [u32; 2], show: bool) -> Result<u32, Error> {
        let [width, height] = size;
        self.pixels = self
            .pixels
            .take()
            .filter(|i| show && [i.width(), i.height()] == size);
        if show && self.pixels.is_none() {
            let (format, usage) = (Format::R32Uint, ImageUsage::STORAGE);
            let desc = ImageDesc::new("trace rays of pixels", width, height, format, usage);
            self.pixels = Some(Image::new(device, &desc)?);
        }
        Ok(self
            .pixels
            .as_ref()
            .map_or(t::NO_IMAGE, Image::storage_index))
    }

    /// Ends a view: copies its counts for the CPU.
    ///
    /// # Errors
    /// Out of memory.
    pub fn end(&mut self, rec: &mut Recorder) -> Result<(), Error> {
        let Some(counters) = &self.counters else {
            return Ok(());
        };
        let frame = rec.serial();
        let free = |copies: &[(u64, Buffer)]| {
            let same = copies.iter().position(|c| c.0 == frame);
            same.or_else(|| copies.iter().position(|c| c.0 <= rec.finished()))
        };
        let index = match free(&self.copies) {
            Some(index) => index,
            None => {
                let desc = BufferDesc {
                    name: "ray counts",
                    size: SIZE,
                    usage: BufferUsage::TRANSFER,
                    memory: Memory::Readback,
                };
                self.copies.push((0, Buffer::new(rec.device(), &desc)?));
                self.copies.len() - 1
            }
        };
        if let Some((of, copy)) = self.copies.get_mut(index) {
            *of = frame;
            rec.pass("read counts", Access::TRANSFER, Access::TRANSFER)?
                .copy_buffer(counters, 0, copy, 0, SIZE);
        }
        Ok(())
    }
}
