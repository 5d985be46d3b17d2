//! `r_lowLatency`: at the end of a frame, waits for the frame before. [`Pacer`] measures and
//! decides.

use std::time::{Duration, Instant};

use super::Renderer;
use crate::error::Error;
use crate::gpu::Presented;
use crate::pacing::Pacer;
use crate::settings::LowLatency;
use crate::statistics::Latency;

/// Longest wait for a frame. A window system may show the pictures of a covered window never, or once a second; after
/// one such wait there is none until a frame is seen to have ended.
const PATIENCE: Duration = Duration::from_millis(250);

impl Renderer {
    /// Whether a frame ends when the display shows it; otherwise, when it is drawn.
    fn ends_on_display(&self) -> bool {
        self.swapchain.as_ref().is_some_and(|s| s.reports())
    }

    /// What is known of the end of a frame after at most `timeout`.
    fn ended(&mut self, mark: u64, timeout: Duration) -> Result<Presented, Error> {
        Ok(match &mut self.swapchain {
            Some(swapchain) if self.paced_by_display => swapchain.wait_presented(mark, timeout)?,
            _ if self.ring.wait(mark, timeout)? => Presented::Shown,
            _ => Presented::NotYet,
        })
    }

    /// Notes the frames that have ended.
    pub(super) fn look_for_ends(&mut self) -> Result<(), Error> {
        while let Some(mark) = self.pacer.oldest() {
            match self.ended(mark, Duration::ZERO)? {
                Presented::Shown => {
                    self.pacer.end(mark, Instant::now());
                    self.display_sleeps = false;
                }
                Presented::NotYet => break,
                Presented::Unknown => self.pacer.forget(),
            }
        }
        Ok(())
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
            // other marks
            self.paced_by_display = by_display;
            self.pacer = Pacer::default();
        }
        if mark == self.pacer.newest() {
            // the window had no image for the frame
            self.pacer.forget();
            return Ok(());
        }
        self.pacer.submit(mark, submission, Instant::now());
        if self.settings.low_latency != LowLatency::Off && !self.display_sleeps {
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
                && self.ring.wait(submission, PATIENCE)?
            {
                self.pacer.draw(submission, Instant::now());
            }
            let mut end = self.ended(mark, Duration::ZERO)?;
            let waits = end == Presented::NotYet;
            if waits {
                end = self.ended(mark, PATIENCE)?;
            }
            let then = Instant::now();
            match end {
                Presented::Shown => {
                    self.pacer.end(mark, then);
                    now = waits.then_some(then);
                }
                Presented::NotYet => self.display_sleeps = true,
                Presented::Unknown => self.pacer.forget(),
            }
        }
        self.pacer.waited(now);
        Ok(())
    }

    /// Keeps the engine until its next frame is needed.
    fn rest(&mut self, submission: u64) -> Result<(), Error> {
        let rest = self.pacer.rest().min(PATIENCE);
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

    /// What a frame's end is, and the milliseconds from the end of the frame before to it, of the newest frame of which
    /// they are known.
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
