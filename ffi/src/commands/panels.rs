//! `rt_menu` and `rt_photo`: the commands.

use super::{benchmark, print_lines};
use crate::panel::Panel;
use crate::panel::menu::Menu;
use crate::panel::photo::{Kind, Photo};
use crate::panel::pointer::keys_of_word;
use crate::session::Front;
use crate::show_panel::{close, open};
use renderer_vk::{Look, Renderer};

/// Opens the menu, or closes it. With a word: a key for the open menu.
pub(super) unsafe extern "C" fn menu() {
    print_lines(|renderer, front, arguments| {
        let is_open = matches!(front.panel, Some(Panel::Menu(_)));
        match arguments.get(1).map(|word| keys_of_word(word)) {
            Some(None) => return vec!["usage: rt_menu [up|down|left|right|enter|close]".into()],
            // a key for a closed menu, such as by a bind, does nothing
            Some(Some(keys)) if is_open => front.panel_keys.extend(keys),
            Some(Some(_)) => {}
            None if is_open => close(renderer, front),
            None => {
                let menu = Menu::new(renderer.size());
                open(renderer, front, Panel::Menu(Box::new(menu)));
            }
        }
        Vec::new()
    });
}

/// Begins photo mode, or ends it; with a word: takes a picture in it.
pub(super) unsafe extern "C" fn photo() {
    print_lines(|renderer, front, arguments| {
        let line = match arguments.get(1..).unwrap_or_default() {
            [] => toggle(renderer, front),
            [kind] => ask(front, kind, None),
            [kind, samples] => ask(front, kind, Some(samples)),
            _ => Some(USAGE.to_owned()),
        };
        line.into_iter().collect()
    });
}

const USAGE: &str = "usage: rt_photo, then rt_photo png|exr|360 [SAMPLES]";

/// Takes a picture in photo mode; returns what is wrong.
fn ask(front: &mut Front, kind: &str, samples: Option<&String>) -> Option<String> {
    let samples = samples.map(|samples| samples.parse()).transpose();
    let (Some(kind), Ok(samples)) = (Kind::of(kind), samples) else {
        return Some(USAGE.to_owned());
    };
    let Some(Panel::Photo(photo)) = &mut front.panel else {
        return Some("give rt_photo first: it holds the scene".to_owned());
    };
    photo.ask(kind, samples);
    None
}

/// Begins photo mode, or ends it; returns what is wrong.
fn toggle(renderer: &mut Renderer, front: &mut Front) -> Option<String> {
    if matches!(front.panel, Some(Panel::Photo(_))) {
        close(renderer, front);
        return None;
    }
    if front.benchmark.is_some() {
        return Some(format!("rt_photo: {}", benchmark::IN_PROGRESS));
    }
    match front.world_view {
        Some(view) if front.settings.rt == Look::Traced && renderer.world().is_some() => {
            let photo = Photo::new(&view, renderer.size());
            open(renderer, front, Panel::Photo(Box::new(photo)));
            None
        }
        _ => Some("rt_photo needs the traced look: set r_rt 1 and start a map first".to_owned()),
    }
}
