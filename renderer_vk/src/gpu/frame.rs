//! The ring of frames in flight: the CPU records one while the GPU executes another.

use std::time::Duration;

use ash::vk;

use super::device::{Device, lock};
use super::error::{Context, Error};
use super::graveyard::Garbage;
use super::recorder::{Recorder, Recording, SlotResources};
use super::swapchain::{Submitted, Swapchain};

/// A slot of the ring.
struct Slot {
    /// Timeline value of the frame that used it last.
    value: u64,
    resources: Option<SlotResources>,
    /// Signalled when the swapchain image of this frame is available.
    available: vk::Semaphore,
}

/// Frames in flight of a device; a device has at most one ring.
pub struct FrameRing {
    device: Device,
    slots: Vec<Slot>,
    next: usize,
    /// Number of frames begun.
    begun: u64,
}

impl FrameRing {
    /// A ring of `frames` frames in flight (at least 1; 2 keeps CPU and GPU busy).
    ///
    /// # Errors
    /// [`Error::Usage`] when the device has a ring already; out of memory.
    pub fn new(device: &Device, frames: usize) -> Result<Self, Error> {
        {
            let mut state = lock(&device.0.state);
            if state.ring {
                return Err(Error::Usage {
                    name: "FrameRing".to_owned(),
                    what: "the device has one already, and they would share its timeline"
                        .to_owned(),
                });
            }
            state.ring = true;
        }
        let mut ring = Self {
            device: device.clone(),
            slots: Vec::new(),
            next: 0,
            begun: 0,
        };
        for _ in 0..frames.max(1) {
            // SAFETY: plain creation.
            let available = unsafe {
                device
                    .vk()
                    .create_semaphore(&vk::SemaphoreCreateInfo::default(), None)
            }
            .context("vkCreateSemaphore")?;
            ring.slots.push(Slot {
                value: 0,
                resources: None,
                available,
            });
        }
        Ok(ring)
    }

    /// Begins the next frame: waits until its slot is free, publishes the timings of the frame that used it before and
    /// frees buried objects.
    ///
    /// # Errors
    /// [`Error::Usage`] when a frame is being recorded; out of memory; device loss.
    pub fn begin(&mut self) -> Result<Recorder, Error> {
        let device = self.device.clone();
        if lock(&device.0.state).recording {
            return Err(Error::Usage {
                name: "FrameRing".to_owned(),
                what: "a frame is being recorded already".to_owned(),
            });
        }
        let index = self.next;
        let Some(slot) = self.slots.get_mut(index) else {
            return Err(Error::Usage {
                name: "FrameRing".to_owned(),
                what: "the ring is empty".to_owned(),
            });
        };
        let semaphores = [device.0.timeline];
        let values = [slot.value];
        let info = vk::SemaphoreWaitInfo::default()
            .semaphores(&semaphores)
            .values(&values);
        // SAFETY: the value is 0 or was submitted.
        unsafe { device.vk().wait_semaphores(&info, u64::MAX) }.context("vkWaitSemaphores")?;
        let mut resources = match slot.resources.take() {
            Some(mut resources) => {
                resources.timers.publish();
                resources
            }
            None => SlotResources::new(&device)?,
        };
        device.0.collect()?;
        resources.restart(self.begun + 1)?;
        lock(&device.0.state).recording = true;
        let available = slot.available;
        self.next = (index + 1) % self.slots.len();
        self.begun += 1;
        Ok(Recorder {
            cmd: resources.main,
            slot: resources,
            acquired: None,
            ring_slot: Some(index),
            serial: self.begun,
            finished: self.begun.saturating_sub(self.slots.len() as u64),
            open: None,
            host_reads: false,
            available: Some(available),
            recording: Some(Recording(device.clone())),
            device,
        })
    }

    /// The newest submission.
    pub fn newest(&self) -> u64 {
        lock(&self.device.0.state).submitted
    }

    /// The newest submission that the GPU has finished.
    ///
    /// # Errors
    /// Out of memory, device loss.
    pub fn finished(&self) -> Result<u64, Error> {
        self.device.0.finished()
    }

    /// Waits until the GPU has finished a submission, as [`newest`](Self::newest) counts them, and all before it; at most
    /// `timeout`. `false`: it has not.
    ///
    /// # Errors
    /// Out of memory, device loss.
    pub fn wait(&self, submission: u64, timeout: Duration) -> Result<bool, Error> {
        let (semaphores, values) = ([self.device.0.timeline], [submission.min(self.newest())]);
        let info = vk::SemaphoreWaitInfo::default()
            .semaphores(&semaphores)
            .values(&values);
        let nanoseconds = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: the value is 0 or was submitted.
        match unsafe { self.device.vk().wait_semaphores(&info, nanoseconds) } {
            Ok(()) => Ok(true),
            Err(vk::Result::TIMEOUT) => Ok(false),
            Err(result) => Err(result).context("vkWaitSemaphores"),
        }
    }

    /// Submits a frame without presenting.
    ///
    /// # Errors
    /// Out of memory, device loss.
    pub fn end(&mut self, recorder: Recorder) -> Result<(), Error> {
        self.submit(recorder).map(|_| ())
    }

    /// Submits a frame and presents the image that [`Swapchain::acquire`] returned, if any.
    ///
    /// # Errors
    /// Out of memory, device loss. An out-of-date swapchain is not an error: the next acquisition recreates it.
    pub fn end_present(
        &mut self,
        mut recorder: Recorder,
        swapchain: &mut Swapchain,
    ) -> Result<(), Error> {
        swapchain.prepare_present(&mut recorder);
        swapchain.show()?;
        match self.submit(recorder)? {
            Some(image) => swapchain.submitted(image),
            None => Ok(()),
        }
    }

    /// Submits; returns the acquired image.
    fn submit(&mut self, mut recorder: Recorder) -> Result<Option<Submitted>, Error> {
        let device = self.device.clone();
        recorder.close_drawing();
        let Recorder {
            slot,
            host_reads,
            acquired,
            ring_slot,
            recording,
            ..
        } = recorder;
        slot.finish(host_reads)?;
        let mut pending = std::mem::take(&mut *lock(&device.0.pending));
        let value = lock(&device.0.state).submitted + 1;
        let before = slot.record_before(&mut pending);
        let submitted = before.and_then(|()| {
            let first = [slot.before];
            let main = [slot.main];
            let stages =
                [vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT
                    | vk::PipelineStageFlags::TRANSFER];
            // Values of binary semaphores are ignored, but the counts must agree.
            let values = [value, 0];
            let (waits, signals, shown) = match &acquired {
                Some(image) => ([image.available], [device.0.timeline, image.finished], 1),
                None => (
                    [vk::Semaphore::null()],
                    [device.0.timeline, vk::Semaphore::null()],
                    0,
                ),
            };
            let (waits, stages) = (&waits[..shown], &stages[..shown]);
            let (signals, values) = (&signals[..1 + shown], &values[..1 + shown]);
            let mut timeline = vk::TimelineSemaphoreSubmitInfo::default()
                .wait_semaphore_values(&[0][..shown])
                .signal_semaphore_values(values);
            let submits = [
                // Separate, so that uploads do not wait for the swapchain.
                vk::SubmitInfo::default().command_buffers(&first),
                vk::SubmitInfo::default()
                    .command_buffers(&main)
                    .wait_semaphores(waits)
                    .wait_dst_stage_mask(stages)
                    .signal_semaphores(signals)
                    .push_next(&mut timeline),
            ];
            let queue = lock(&device.0.queue);
            // SAFETY: the buffers are recorded and not pending (their slot was waited for); the value is higher than
            // every one before; the queue is held.
            unsafe {
                device
                    .vk()
                    .queue_submit(*queue, &submits, vk::Fence::null())
            }
            .context("vkQueueSubmit")
        });
        if submitted.is_ok() {
            lock(&device.0.state).submitted = value;
        }
        device.0.put_back(pending, submitted.is_ok());
        if submitted.is_ok()
            && let Some(place) = ring_slot.and_then(|i| self.slots.get_mut(i))
        {
            place.value = value;
            place.resources = Some(slot);
        }
        drop(recording);
        submitted?;
        Ok(acquired.map(|a| Submitted {
            index: a.index,
            finished: a.finished,
        }))
    }
}

impl Drop for FrameRing {
    fn drop(&mut self) {
        for slot in self.slots.drain(..) {
            self.device.0.bury(Garbage::Semaphore(slot.available));
        }
        lock(&self.device.0.state).ring = false;
    }
}
