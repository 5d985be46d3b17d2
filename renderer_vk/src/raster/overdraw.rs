//! Overdraw (`r_measureOverdraw`): the fragment shaders of all draws count their fragments, hidden ones included. The
//! result is that of the newest finished frame, so nothing waits for the GPU.

use crate::gpu::{self, Access, Buffer, BufferDesc, BufferUsage, Memory, Recorder};

/// Size of a counter, bytes.
const SIZE: u64 = 4;

/// A counter of one frame in flight. It is never reset: the count of a frame is the difference.
struct Counter {
    frame: u64,
    before: u32,
    buffer: Buffer,
}

impl Counter {
    fn read(&self) -> Result<u32, gpu::Error> {
        let mut bytes = [0; SIZE as usize];
        self.buffer.read(0, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }
}

/// The counters of the frames in flight.
#[derive(Default)]
pub struct Overdraw {
    counters: Vec<Counter>,
    /// Number and fragments of the newest finished frame.
    newest: Option<(u64, u32)>,
    /// Address of the counter of the frame that is recorded; 0: not counted.
    address: u64,
}

impl Overdraw {
    /// Begins a frame. `count`: counts its fragments; otherwise frees the counters.
    ///
    /// # Errors
    /// Out of memory.
    pub fn begin(&mut self, recorder: &mut Recorder, count: bool) -> Result<(), gpu::Error> {
        let count = count && recorder.device().fragment_stores();
        if !count {
            *self = Self::default();
            return Ok(());
        }
        let over = recorder.finished();
        for counter in self.counters.iter().filter(|c| c.frame <= over) {
            if self.newest.is_none_or(|(frame, _)| frame < counter.frame) {
                let fragments = counter.read()?.wrapping_sub(counter.before);
                self.newest = Some((counter.frame, fragments));
            }
        }
        let frame = recorder.serial();
        let index = match self.counters.iter().position(|c| c.frame <= over) {
            Some(index) => index,
            None => {
                let desc = BufferDesc {
                    name: "overdraw",
                    size: SIZE,
                    usage: BufferUsage::STORAGE,
                    memory: Memory::Readback,
                };
                self.counters.push(Counter {
                    frame,
                    before: 0,
                    buffer: Buffer::new(recorder.device(), &desc)?,
                });
                self.counters.len() - 1
            }
        };
        if let Some(counter) = self.counters.get_mut(index) {
            counter.frame = frame;
            counter.before = counter.read()?;
            self.address = counter.buffer.address();
            recorder.pass("count overdraw", Access::NONE, Access::HOST)?;
        }
        Ok(())
    }

    /// Address of this frame's counter; 0: not counted.
    pub fn address(&self) -> u64 {
        self.address
    }

    /// Fragments of the newest finished frame; 0 before the first.
    pub fn fragments(&self) -> u32 {
        self.newest.map_or(0, |(_, fragments)| fragments)
    }
}
