//! Videos that materials show. The engine decodes them; each frame it is asked to go on, and uploads from inside.
//!
//! The engine knows a video by the handle that it answered, the renderer by a client number of its own.

use std::collections::HashMap;

/// Which videos the engine plays for us.
#[derive(Debug, Default)]
pub struct Cinematics {
    /// By the renderer's client number: the engine's handle, or `None` for a video that cannot be played, so that it
    /// is asked for once and not every frame.
    playing: HashMap<usize, Option<i32>>,
    /// An empty list of clients, for its memory.
    list: Vec<usize>,
}

impl Cinematics {
    /// Forgets all; the engine closes them itself when the map ends.
    pub fn clear(&mut self) {
        self.playing.clear();
    }

    /// An empty list to be given back.
    pub fn take_list(&mut self) -> Vec<usize> {
        std::mem::take(&mut self.list)
    }

    /// Takes an empty list back.
    pub fn keep_list(&mut self, list: Vec<usize>) {
        self.list = list;
    }

    /// What is known of a client's video: not asked yet, unplayable, or its handle.
    pub fn state(&self, client: usize) -> Option<Option<i32>> {
        self.playing.get(&client).copied()
    }

    /// Remembers the engine's answer.
    pub fn remember(&mut self, client: usize, handle: Option<i32>) {
        self.playing.insert(client, handle);
    }

    /// The client that a picture of the engine's video `handle` is for: a material's, or else the number itself, which
    /// is what the engine draws full-screen videos under.
    pub fn client_of(&self, handle: i32) -> Option<usize> {
        let ours = self
            .playing
            .iter()
            .find(|&(_, &known)| known == Some(handle));
        ours.map(|(&client, _)| client)
            .or_else(|| usize::try_from(handle).ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_find_their_material_or_keep_their_number() {
        let mut videos = Cinematics::default();
        assert_eq!(videos.state(1000), None);
        videos.remember(1000, Some(3));
        videos.remember(1001, None);
        assert_eq!(videos.state(1001), Some(None));
        assert_eq!(videos.client_of(3), Some(1000));
        assert_eq!(videos.client_of(4), Some(4));
        assert_eq!(videos.client_of(-1), None);
        videos.clear();
        assert_eq!(videos.client_of(3), Some(3));
    }
}
