//! Videos of materials. The engine decodes them: each frame advances them by a service of the engine, which calls
//! `UploadCinematic`.
//!
//! The engine identifies a video by its handle, the renderer by a client number.

use std::collections::HashMap;

/// Videos that the engine plays for materials.
#[derive(Debug, Default)]
pub struct Cinematics {
    /// By the renderer's client number: the engine's handle, or `None` for a video that cannot be played, so that it is
    /// not requested again every frame.
    playing: HashMap<usize, Option<i32>>,
    /// An empty list of clients, kept for its memory.
    list: Vec<usize>,
}

impl Cinematics {
    /// Drops all entries; the engine closes its videos when the map ends.
    pub fn clear(&mut self) {
        self.playing.clear();
    }

    /// Takes the empty list; return it by [`keep_list`](Self::keep_list).
    pub fn take_list(&mut self) -> Vec<usize> {
        std::mem::take(&mut self.list)
    }

    /// Stores an empty list for reuse.
    pub fn keep_list(&mut self, list: Vec<usize>) {
        self.list = list;
    }

    /// State of a client's video: `None` before the request, `Some(None)` if it cannot be played, otherwise its handle.
    pub fn state(&self, client: usize) -> Option<Option<i32>> {
        self.playing.get(&client).copied()
    }

    /// Stores the engine's handle.
    pub fn remember(&mut self, client: usize, handle: Option<i32>) {
        self.playing.insert(client, handle);
    }

    /// The client of the engine's video `handle`: that of a material, otherwise the number itself, by which the engine
    /// draws full-screen videos.
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
