//! The time of each pixel's invocations, while a view of `rt_debug` shows it (`shaders/trace/clock.glsl`).

use shaders::trace_types::constants as t;

use crate::gpu::{
    Access, Buffer, BufferUsage, Error, Format, Image, ImageDesc, ImageUsage, Recorder,
};
use crate::settings::DebugOutput;

/// Bytes of the sum and the number of pixels of a frame.
const PAIR: u64 = 8;

/// Image and sums of the times.
#[derive(Default)]
pub struct PixelTimes {
    shown: Option<(DebugOutput, Image, Buffer)>,
    turn: u32,
    lack_reported: bool,
}

/// Where the passes of a view write times.
#[derive(Clone, Copy)]
pub struct Timing {
    /// Storage image of the pixels' times, or `NO_IMAGE`.
    pub image: u32,
    /// Address of the sums.
    pub sums: u64,
    /// The pair of sums that this frame writes.
    pub turn: u32,
}

impl Timing {
    const NONE: Self = Self {
        image: t::NO_IMAGE,
        sums: 0,
        turn: 0,
    };
}

impl PixelTimes {
    /// Whether passes measure the time.
    pub fn are_shown(&self) -> bool {
        self.shown.is_some()
    }

    /// Begins a view of this size that shows `output`. Frees what it does not need.
    ///
    /// # Errors
    /// Out of memory.
    pub fn begin(
        &mut self,
        rec: &mut Recorder,
        size: [u32; 2],
        output: DebugOutput,
    ) -> Result<Timing, Error> {
        if !matches!(output, DebugOutput::Time | DebugOutput::RayTime) || !self.can_measure(rec) {
            self.shown = None;
            return Ok(Timing::NONE);
        }
        let fits = |(of, image, _): &(DebugOutput, Image, Buffer)| {
            *of == output && [image.width(), image.height()] == size
        };
        self.shown = self.shown.take().filter(fits);
        self.turn = 1 - self.turn;
        let (_, image, sums) = match &self.shown {
            Some(shown) => shown,
            None => {
                let (format, usage) = (Format::R32Uint, ImageUsage::STORAGE);
                let [width, height] = size;
                let desc = ImageDesc::new("trace times of pixels", width, height, format, usage);
                let image = Image::new(rec.device(), &desc)?;
                rec.pass("trace_no_times", Access::TRANSFER, Access::TRANSFER)?
                    .clear_image(&image, [0.0; 4]);
                let usage = BufferUsage::STORAGE;
                let sums =
                    Buffer::with_data(rec.device(), "trace sums of times", usage, &[0u32; 4])?;
                self.shown.insert((output, image, sums))
            }
        };
        rec.pass("trace_no_times", Access::TRANSFER, Access::TRANSFER)?
            .fill_buffer(sums, PAIR * u64::from(self.turn), PAIR, 0);
        Ok(Timing {
            image: image.storage_index(),
            sums: sums.address(),
            turn: self.turn,
        })
    }

    /// Whether the device has a clock; the first lack is reported.
    fn can_measure(&mut self, rec: &Recorder) -> bool {
        let info = rec.device().info();
        if !info.shader_clock && !self.lack_reported {
            self.lack_reported = true;
            log::warn!(
                "rt_debug 12 and 13 show nothing: {} has no clock for shaders (VK_KHR_shader_clock)",
                info.name
            );
        }
        info.shader_clock
    }
}
