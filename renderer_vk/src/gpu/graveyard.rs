//! Deferred destruction of objects that a frame may still use.
//!
//! The device's timeline semaphore counts frames: frame `n` signals the value `n` when the GPU has finished it. An
//! object dropped now may be used by every submitted frame and by the one being recorded. It is tagged with the last of
//! these, and destroyed once the timeline has reached the tag.

use ash::vk;
use gpu_allocator::vulkan::Allocation;

/// A raw object that waits for destruction.
pub(crate) enum Garbage {
    Buffer(vk::Buffer, Allocation),
    /// A staging buffer, which uploads may reuse.
    Staging(vk::Buffer, Allocation),
    Image(vk::Image, Allocation),
    View(vk::ImageView),
    Pipeline(vk::Pipeline),
    CommandPool(vk::CommandPool),
    QueryPool(vk::QueryPool),
    Semaphore(vk::Semaphore),
    Acceleration(vk::AccelerationStructureKHR),
    /// An index of the texture table.
    Texture(u32),
    /// An index of the storage image table.
    Storage(u32),
    /// An index of the table of top-level structures.
    Scene(u32),
}

/// Progress of frames.
#[derive(Default)]
pub(crate) struct SyncState {
    /// Timeline value of the newest submitted frame.
    pub submitted: u64,
    /// Whether a frame is being recorded; its value will be `submitted + 1`.
    pub recording: bool,
    /// How many immediate command buffers are being recorded or waited for.
    pub immediates: u32,
    /// Whether a ring exists: frames of two rings would share the timeline.
    pub ring: bool,
    /// Tag and object.
    pub graveyard: Vec<(u64, Garbage)>,
    /// Reused memory of [`Self::take_dead`].
    pub dead: Vec<Garbage>,
}

impl SyncState {
    /// The tag of an object dropped now; `pending`: uploads wait for the next submission.
    pub fn tag(&self, pending: bool) -> u64 {
        if self.recording || self.immediates > 0 || pending {
            self.submitted + 1
        } else {
            self.submitted
        }
    }

    /// Removes the objects that no frame can use, given the timeline's value. Return the emptied list to
    /// [`Self::dead`].
    pub fn take_dead(&mut self, done: u64) -> Vec<Garbage> {
        let mut dead = std::mem::take(&mut self.dead);
        let over = self.graveyard.extract_if(.., |(tag, _)| *tag <= done);
        dead.extend(over.map(|(_, garbage)| garbage));
        dead
    }

    /// Retags objects of the next frame with the newest submitted one, when an immediate submission has ended or a
    /// frame was dropped. `pending`: uploads wait, which may use the objects.
    pub fn retag(&mut self, pending: bool) {
        if !self.recording && self.immediates == 0 && !pending {
            for entry in &mut self.graveyard {
                entry.0 = entry.0.min(self.submitted);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_waits_for_the_frame_that_may_use_it() {
        let mut state = SyncState {
            submitted: 4,
            recording: true,
            ..SyncState::default()
        };
        let tag = state.tag(false);
        assert_eq!(tag, 5);
        state.graveyard.push((tag, Garbage::Texture(1)));
        assert!(state.take_dead(4).is_empty());
        state.recording = false;
        state.submitted = 5;
        assert!(state.take_dead(4).is_empty());
        assert_eq!(state.take_dead(5).len(), 1);
        assert!(state.graveyard.is_empty());
    }

    #[test]
    fn uploads_that_wait_keep_their_target_until_they_have_run() {
        let state = SyncState {
            submitted: 2,
            ..SyncState::default()
        };
        assert_eq!(state.tag(false), 2);
        assert_eq!(state.tag(true), 3);
    }
}
