//! `r_lowLatency`: waits for the frame before at the end of a frame. [`Pacer`] computes how long.

use std::time::{Duration, Instant};

use super::Renderer;
use crate::error::Error;
use crate::gpu::{Presented, Swapchain};
use crate::pacing::Pacer;
use crate::settings::LowLatency;
use crate::statistics::Latency;

/// Timeout of a wait for the display. A window system may show a covered window never, or once a second: after a timeout
/// nothing is waited for until a poll finds that a frame has ended.
const LONGEST_WAIT: Duration = Duration::from_millis(250);

impl Renderer {
    /// Whether a frame ends when the display shows it; otherwise, when it is drawn.
    fn ends_on_display(&self) -> bool {
        self.swapchain
            .as_ref()
            .is_some_and(Swapchain::observes_display)
    }

    /// Polls which frames have ended.
    pub(super) fn look_for_ends(&mut self) -> Result<(), Error> {
        let Some(swapchain) = &mut self.swapchain else {
            return Ok(());
        };
        if !self.paced_by_display {
            self.pacer.end(self.ring.finished()?, Instant::now());
            return Ok(());
        }
        while let Some(mark) = self.pacer.oldest() {
            match swapchain.wait_presented(mark, Duration::ZERO)? {
                Presented::Shown => {
                    self.pacer.end(mark, Instant::now());
                    self.wait_timed_out = false;
                }
                Presented::NotYet => break,
                Presented::Unknown => self.pacer.forget(),
            }
        }
        Ok(())
    }

    /// Waits for the end of a frame, and whether that took time.
    fn wait_for_end(&mut self, mark: u64) -> Result<(Presented, bool), Error> {
        match &mut self.swapchain {
            Some(swapchain) if self.paced_by_display => {
                let now = swapchain.wait_presented(mark, Duration::ZERO)?;
                Ok(match now {
                    Presented::NotYet => (swapchain.wait_presented(mark, LONGEST_WAIT)?, true),
                    _ => (now, false),
                })
            }
            _ => {
                let waits = self.ring.finished()? < mark;
                // what the GPU draws comes to an end, as for the next frame's slot of the ring
                self.ring.wait(mark, Duration::MAX)?;
                Ok((Presented::Shown, waits))
            }
        }
    }

    /// Ends a frame that was submitted to be shown, by waiting.
    pub(super) fn pace(&mut self) -> Result<(), Error> {
        let by_display = self.ends_on_display();
        let submission = self.ring.newest();
        let mark = match &self.swapchain {
            Some(swapchain) if by_display => swapchain.number(),
            _ => submission,
        };
        if by_display != self.paced_by_display {
            // marks were presentations and are submissions now, or the reverse
            self.paced_by_display = by_display;
            self.pacer = Pacer::default();
        }
        if mark == self.pacer.newest() {
            // the window had no image for the frame
            self.pacer.forget();
            return Ok(());
        }
        self.pacer.submit(mark, submission, Instant::now());
        if self.settings.low_latency != LowLatency::Off && !self.wait_timed_out {
            self.wait_for_frame_before()?;
            if self.settings.low_latency == LowLatency::JustInTime {
                self.rest(submission)?;
            }
        }
        self.look_for_ends()?;
        self.pacer.free(Instant::now());
        Ok(())
    }

    fn wait_for_frame_before(&mut self) -> Result<(), Error> {
        let mut now = None;
        if let Some((mark, submission)) = self.pacer.before_newest() {
            if self.paced_by_display
                && !self.ring.wait(submission, Duration::ZERO)?
                && self.ring.wait(submission, LONGEST_WAIT)?
            {
                self.pacer.draw(submission, Instant::now());
            }
            let (end, waits) = self.wait_for_end(mark)?;
            let then = Instant::now();
            match end {
                Presented::Shown => {
                    self.pacer.end(mark, then);
                    now = waits.then_some(then);
                }
                Presented::NotYet => self.wait_timed_out = true,
                Presented::Unknown => self.pacer.forget(),
            }
        }
        self.pacer.waited(now);
        Ok(())
    }

    /// Delays the engine until its next frame is needed.
    fn rest(&mut self, submission: u64) -> Result<(), Error> {
        let rest = self.pacer.rest().min(LONGEST_WAIT);
        if rest.is_zero() {
            return Ok(());
        }
        let begin = Instant::now();
        if self.paced_by_display
            && !self.ring.wait(submission, Duration::ZERO)?
            && self.ring.wait(submission, rest)?
        {
            self.pacer.draw(submission, Instant::now());
        }
        std::thread::sleep(rest.saturating_sub(begin.elapsed()));
        Ok(())
    }

    /// How long the newest frames took from input to picture; `None` without a window.
    pub fn latency(&self) -> Option<Latency> {
        self.pacer.latency(self.end_name())
    }

    /// Latency of the newest frame that has ended, milliseconds, and what its end is: `shown` or `drawn`.
    pub fn newest_latency(&self) -> Option<(&'static str, f32)> {
        Some((self.end_name(), self.pacer.newest_latency()?))
    }

    fn end_name(&self) -> &'static str {
        match self.paced_by_display {
            true => "shown",
            false => "drawn",
        }
    }

    /// What `r_lowLatency` waits for.
    pub fn latency_method(&self) -> &'static str {
        match (self.settings.low_latency, self.ends_on_display()) {
            _ if self.swapchain.is_none() => "no window",
            (LowLatency::Off, _) => "off",
            (_, true) => "VK_KHR_present_wait: the frame before is on the display",
            (_, false) => "the frame before is drawn",
        }
    }
}
