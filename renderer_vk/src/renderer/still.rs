//! `rt_screenshot`: an accumulated picture of the view at any size; each frame of the game traces a few of its frames.

use crate::settings::Look;
use std::time::Instant;

use super::Renderer;
use crate::api::{Picture, StillPicture};
use crate::error::Error;
use crate::gpu::Recorder;
use crate::scene::TracedScene;
use crate::trace::still::Still;

/// A requested picture.
#[derive(Default)]
pub(super) struct StillRequest {
    /// Size and number of samples, until the next traced view of the world.
    wanted: Option<([u32; 2], u32)>,
    still: Option<Still>,
    /// The linear picture is wanted, too.
    radiance: bool,
    /// Frames of the picture per frame of the game.
    pace: u32,
    last: Option<Instant>,
}

/// Duration of the game's frames while a picture is made, milliseconds: the pace rises below the first value and falls
/// above the second.
const FRAME_MS: (f32, f32) = (40.0, 120.0);

/// Maximum frames of the picture per frame of the game: each uploads the moving geometry again.
const FASTEST: u32 = 16;

impl StillRequest {
    /// Drops the picture and its request.
    pub fn cancel(&mut self) {
        *self = Self::default();
    }
}

impl Renderer {
    /// Requests a picture of the next traced view of the world, the mean of `samples` frames; `size` in pixels, `None`:
    /// the window's. It takes several frames: poll [`still_progress`](Self::still_progress), then call
    /// [`take_still`](Self::take_still). `radiance`: the linear picture is wanted, too.
    ///
    /// # Errors
    /// A message for the console: the traced look is off, another picture is in progress, or the device does not
    /// support images of this size.
    pub fn request_still(
        &mut self,
        samples: u32,
        size: Option<(u32, u32)>,
        radiance: bool,
    ) -> Result<(), String> {
        if self.settings.rt != Look::Traced {
            return Err("the traced look is off; set r_rt 1".into());
        }
        if self.still.wanted.is_some() || self.still.still.is_some() {
            return Err("another picture is in progress; wait until it is written".into());
        }
        let (width, height) = size.unwrap_or(self.size());
        let most = self.device_info().max_image_size;
        if width == 0 || height == 0 || width > most || height > most {
            return Err(format!(
                "{width}x{height}: choose a width and height from 1 to {most} pixels"
            ));
        }
        self.still.wanted = Some(([width, height], samples));
        self.still.radiance = radiance;
        Ok(())
    }

    /// Number of averaged and of requested frames of the picture in progress; `None` without one.
    pub fn still_progress(&self) -> Option<(u32, u32)> {
        let waiting = self.still.wanted.map(|(_, samples)| (0, samples));
        (self.still.still.as_ref()).map_or(waiting, |still| Some(still.progress()))
    }

    /// Cancels the picture in progress.
    pub fn cancel_still(&mut self) {
        self.still.cancel();
    }

    /// The finished picture; `None` before it is finished.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn take_still(&mut self) -> Result<Option<StillPicture>, Error> {
        let finished = |still: &mut Still| {
            let (done, wanted) = still.progress();
            done >= wanted
        };
        let Some(still) = self.still.still.take_if(finished) else {
            return Ok(None);
        };
        let wants_radiance = self.still.radiance;
        self.still.cancel();
        let radiance = match still.hdr().filter(|_| wants_radiance) {
            Some(hdr) => Some(self.radiance_of(hdr)?),
            None => None,
        };
        let image = still.image();
        let rgba = self.device.read_image(image)?;
        let (width, height) = (image.width(), image.height());
        Ok(Some(StillPicture {
            picture: Picture {
                width,
                height,
                rgb: self.displayed(&rgba, false),
            },
            radiance,
        }))
    }

    /// Stores a view for a requested picture. If the device has no memory for the picture, drops it with a warning, and
    /// the game continues.
    pub(super) fn keep_for_still(&mut self, view: &TracedScene) {
        if let (Some((size, samples)), Some(look)) = (self.still.wanted.take(), &self.trace) {
            match Still::new(&self.device, look, view, size, samples) {
                Ok(still) => (self.still.still, self.still.pace) = (Some(still), 1),
                Err(e) => log::warn!("rt_screenshot: {e}"),
            }
        }
    }

    /// Records more frames of the picture; drops it as [`keep_for_still`](Self::keep_for_still) does.
    pub(super) fn record_still(&mut self, rec: &mut Recorder) {
        let request = &mut self.still;
        let (Some(still), Some(look), Some(assets)) =
            (&mut request.still, &self.trace, &self.assets)
        else {
            return; // no picture is wanted
        };
        let now = Instant::now();
        if let Some(last) = request.last.replace(now) {
            let ms = now.duration_since(last).as_secs_f32() * 1000.0;
            if ms < FRAME_MS.0 {
                request.pace = (request.pace + 1).min(FASTEST);
            } else if ms > FRAME_MS.1 {
                request.pace = (request.pace / 2).max(1);
            }
        }
        if let Err(e) = still.record(rec, look, assets, &self.settings, request.pace) {
            log::warn!("rt_screenshot: {e}");
            request.cancel();
        }
    }
}
