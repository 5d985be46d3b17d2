//! The panels over the game: `rt_menu` and `rt_photo`, drawn at the end of a frame.

use gui::Change;
use renderer_vk::Renderer;

use crate::capture::free_path;
use crate::delivery::Outbox;
use crate::engine;
use crate::failure::Failure;
use crate::menu::{self, Facts};
use crate::photo;
use crate::session::Front;
use crate::window;
use crate::window::input::Input;

/// `rt_menu` and `rt_photo`: draws what is open, and passes on what the player chose.
///
/// # Errors
/// The device is lost or out of memory.
pub fn draw_panels(
    renderer: &mut Renderer,
    front: &mut Front,
    outbox: &mut Outbox,
) -> Result<(), Failure> {
    let (mut events, relative) = window::input::take();
    events.append(&mut front.menu_keys);
    let photo = front.photo.is_some();
    renderer.hide_overlay(photo);
    if photo {
        return draw_photo(renderer, front, &events, relative, outbox);
    }
    renderer.set_free_camera(None);
    let Some(menu) = &mut front.menu else {
        return Ok(());
    };
    let timings = renderer.timings();
    let facts = Facts {
        settings: &front.settings,
        timings: &timings,
        size: renderer.size(),
        device: &renderer.device_info().name,
        in_map: renderer.world().is_some(),
        has_input: window::input::is_installed(),
    };
    let (ui, actions) = menu.frame(&events, relative, &facts);
    renderer.draw_ui(ui).map_err(Failure::from)?;
    for action in actions {
        match action {
            menu::Action::Set(Change { name, value }) => {
                outbox.variables.push((name, value.into()))
            }
            menu::Action::Command(text) => outbox.commands.push(text),
            menu::Action::Close => {
                front.menu = None;
                window::input::end();
            }
        }
    }
    Ok(())
}

/// Draws a frame of photo mode, and passes on what the player chose.
///
/// # Errors
/// The device is lost or out of memory.
fn draw_photo(
    renderer: &mut Renderer,
    front: &mut Front,
    events: &[Input],
    relative: bool,
    outbox: &mut Outbox,
) -> Result<(), Failure> {
    let Some(photo) = &mut front.photo else {
        return Ok(());
    };
    let taking = photo.is_taking();
    match photo.advance(renderer) {
        Ok(None) => {}
        Ok(Some((path, bytes))) => {
            photo.say(format!("wrote {path}"));
            outbox.files.push((path, bytes, false));
        }
        Err(message) => photo.say(message),
    }
    let (ui, actions) = photo.frame(events, relative, renderer);
    if taking && !photo.is_taking() {
        // cancelled in the panel, unless it is finished
        renderer.cancel_still();
    }
    renderer.set_free_camera(Some(photo.camera()));
    renderer.draw_ui(ui).map_err(Failure::from)?;
    for action in actions {
        match action {
            photo::Action::Take(kind) => {
                let exists = |path: &str| {
                    let path = std::ffi::CString::new(path);
                    let engine = engine::current();
                    path.is_ok_and(|path| engine.is_some_and(|e| e.home_file_exists(&path)))
                };
                let next = &mut front.captures.next_photo;
                match free_path("screenshots/photo", kind.extension(), next, exists) {
                    Some(path) => photo.take(kind, path, renderer.size()),
                    None => photo.say("all 10000 file names are taken".to_owned()),
                }
            }
            photo::Action::Close => {
                renderer.cancel_still();
                renderer.set_free_camera(None);
                renderer.hide_overlay(false);
                front.photo = None;
                window::input::end();
                break;
            }
        }
    }
    Ok(())
}
