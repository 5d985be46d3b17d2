//! What is shown over the game, one at a time: the menu of `rt_menu` or the photo mode of `rt_photo`.

pub mod menu;
pub mod photo;
pub mod pointer;

use menu::Menu;
use photo::Photo;
use renderer_vk::{Renderer, Settings};

/// What is open. It gets mouse and keys in place of the game.
pub enum Panel {
    /// `rt_menu`.
    Menu(Box<Menu>),
    /// `rt_photo`.
    Photo(Box<Photo>),
}

impl Panel {
    /// Changes the settings of a frame for as long as the panel is open; the console variables stay as they are.
    pub fn put(&self, settings: &mut Settings) {
        if let Self::Photo(photo) = self {
            photo.put(settings);
        }
    }

    /// Ends what the panel does in the renderer.
    pub fn close(mut self, renderer: &mut Renderer) {
        if let Self::Photo(photo) = &mut self {
            photo.cancel(renderer);
            renderer.set_free_camera(None);
            renderer.hide_overlay(false);
        }
    }
}
