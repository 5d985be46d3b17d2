//! How often a pixel is drawn (`r_measureOverdraw`): counted by the fragment shaders of all draws, whether a fragment is
//! in sight or not. The answer is that of the newest frame that is over, so that nothing waits for it.

use crate::gpu::{self, Access, Buffer, BufferDesc, BufferUsage, Memory, Recorder};

/// Bytes of a counter.
const SIZE: u64 = 4;

/// A number that fragments of one frame are added to. It is never set back: a frame's part is what it grew by.
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
    /// Of the newest frame that is over: its number and its fragments.
    newest: Option<(u64, u32)>,
    /// Where the frame being recorded counts; 0: nowhere.
    address: u64,
}

impl Overdraw {
    /// Begins a frame; `count`: its fragments are wanted. Frees what is not asked for.
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

    /// Where fragments are counted in this frame; 0: nowhere.
    pub fn address(&self) -> u64 {
        self.address
    }

    /// Fragments of the newest frame that is over; 0 while none was counted.
    pub fn fragments(&self) -> u32 {
        self.newest.map_or(0, |(_, fragments)| fragments)
    }
}
