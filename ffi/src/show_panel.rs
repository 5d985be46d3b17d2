//! Opens, draws and closes the panel over the game.

use gui::Change;
use renderer_vk::Renderer;

use crate::capture::free_path;
use crate::delivery::Outbox;
use crate::engine;
use crate::failure::Failure;
use crate::panel::Panel;
use crate::panel::menu::{self, Facts};
use crate::panel::photo::{self, Photo};
use crate::session::Front;
use crate::window::input::{self, Input};

/// Opens a panel in place of another one.
pub fn open(renderer: &mut Renderer, front: &mut Front, panel: Panel) {
    close(renderer, front);
    front.panel = Some(panel);
    input::begin();
}

/// Closes the open panel.
pub fn close(renderer: &mut Renderer, front: &mut Front) {
    if let Some(panel) = front.panel.take() {
        panel.close(renderer);
        front.panel_keys.clear();
        input::end();
    }
}

/// Draws the open panel at the end of a frame, and passes on what the player chose.
///
/// # Errors
/// The device is lost or out of memory.
pub fn draw(
    renderer: &mut Renderer,
    front: &mut Front,
    outbox: &mut Outbox,
) -> Result<(), Failure> {
    let (mut events, relative) = input::take();
    events.append(&mut front.panel_keys);
    let closes = match &mut front.panel {
        None => false,
        Some(Panel::Menu(menu)) => {
            let timings = renderer.timings();
            let facts = Facts {
                settings: &front.settings,
                timings: &timings,
                size: renderer.size(),
                device: &renderer.device_info().name,
                in_map: renderer.world().is_some(),
                has_input: input::is_installed(),
            };
            let (ui, actions) = menu.frame(&events, relative, &facts);
            renderer.draw_ui(ui).map_err(Failure::from)?;
            follow_menu(actions, outbox)
        }
        Some(Panel::Photo(photo)) => {
            let next = &mut front.captures.next_photo;
            draw_photo(renderer, photo, next, (&events, relative), outbox)?
        }
    };
    if closes {
        close(renderer, front);
    }
    Ok(())
}

/// Passes on what the player chose in the menu; whether it closes.
fn follow_menu(actions: Vec<menu::Action>, outbox: &mut Outbox) -> bool {
    let mut closes = false;
    for action in actions {
        match action {
            menu::Action::Set(Change { name, value }) => {
                outbox.variables.push((name, value.into()));
            }
            menu::Action::Command(text) => outbox.commands.push(text),
            menu::Action::Close => closes = true,
        }
    }
    closes
}

/// Draws a frame of photo mode, and passes on what the player chose; whether it closes. `next`: number of the next
/// picture's file.
fn draw_photo(
    renderer: &mut Renderer,
    photo: &mut Photo,
    next: &mut u32,
    (events, relative): (&[Input], bool),
    outbox: &mut Outbox,
) -> Result<bool, Failure> {
    match photo.advance(renderer) {
        Ok(None) => {}
        Ok(Some((path, bytes))) => {
            photo.say(format!("wrote {path}"));
            outbox.files.push((path, bytes, false));
        }
        Err(message) => photo.say(message),
    }
    let (ui, actions) = photo.frame(events, relative, renderer);
    let mut closes = false;
    for action in actions {
        match action {
            photo::Action::Take(kind) => {
                let exists = |path: &str| engine::current().is_some_and(|e| e.home_has(path));
                match free_path("screenshots/photo", kind.extension(), next, exists) {
                    Some(path) => photo.take(kind, path, renderer.size()),
                    None => photo.say("all 10000 file names are taken".to_owned()),
                }
            }
            photo::Action::Cancel => photo.cancel(renderer),
            photo::Action::Close => closes = true,
        }
    }
    renderer.hide_overlay(true);
    renderer.set_free_camera(Some(photo.camera()));
    renderer.draw_ui(ui).map_err(Failure::from)?;
    Ok(closes)
}
