//! Videos that materials show. The engine decodes them; each frame it is asked to go on, and uploads from inside.

use std::collections::HashMap;

/// Which videos the engine plays for us.
#[derive(Debug, Default)]
pub struct Cinematics {
    /// By name: the engine's handle, or `None` for one that cannot be played (asked once, not every frame).
    playing: HashMap<String, Option<i32>>,
}

impl Cinematics {
    /// Forgets all; the engine closes them itself when the map ends.
    pub fn clear(&mut self) {
        self.playing.clear();
    }

    /// What is known of a video: not asked yet, unplayable, or its handle.
    pub fn state(&self, name: &str) -> Option<Option<i32>> {
        self.playing.get(name).copied()
    }

    /// Remembers the engine's answer.
    pub fn remember(&mut self, name: String, handle: Option<i32>) {
        self.playing.insert(name, handle);
    }
}
