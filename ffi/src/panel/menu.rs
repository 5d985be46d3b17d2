//! `rt_menu`: a menu over any game, drawn by the renderer, with mouse and keys.

use std::time::Instant;

use gui::egui::{self, Context, RichText};
use gui::{Change, CostHistory, Gui, frame_time, main_settings, presets};
use renderer_vk::api::UiFrame;
use renderer_vk::{Look, Settings};

use super::pointer::{self, Pointer};
use crate::window::input::Input;

/// What the player chose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// A console variable gets a value.
    Set(Change),
    /// A console command.
    Command(&'static str),
    /// The menu closes.
    Close,
}

/// What the menu shows.
pub struct Facts<'a> {
    /// Current settings.
    pub settings: &'a Settings,
    /// GPU milliseconds by pass of the newest finished frame.
    pub timings: &'a [(String, f32)],
    /// Size of the window, pixels.
    pub size: (u32, u32),
    /// Name of the device.
    pub device: &'a str,
    /// A map is loaded.
    pub in_map: bool,
    /// Mouse and keys reach the menu.
    pub has_input: bool,
}

/// The open menu.
pub struct Menu {
    gui: Gui,
    pointer: Pointer,
    costs: CostHistory,
    last: Option<Instant>,
    frame_ms: f32,
    /// CPU time of the menu's own frame, milliseconds.
    own_ms: f32,
}

impl Menu {
    /// A menu for a window of this size, pixels.
    pub fn new(size: (u32, u32)) -> Self {
        Self {
            gui: Gui::new(),
            pointer: Pointer::new(size),
            costs: CostHistory::default(),
            last: None,
            frame_ms: 0.0,
            own_ms: 0.0,
        }
    }

    /// Runs a frame: what to draw, and what the player chose. `relative`: see [`Pointer::input`].
    pub fn frame(
        &mut self,
        events: &[Input],
        relative: bool,
        facts: &Facts<'_>,
    ) -> (UiFrame, Vec<Action>) {
        let begin = Instant::now();
        if let Some(last) = self.last.replace(begin) {
            let ms = begin.duration_since(last).as_secs_f32() * 1000.0;
            self.frame_ms += (ms - self.frame_ms) * 0.1;
        }
        self.costs.add(facts.timings);
        let input = self.pointer.input(events, relative, facts.size);
        let closes = input.events.iter().any(is_escape);
        let mut actions = Vec::new();
        let (frame_ms, own_ms, costs) = (self.frame_ms, self.own_ms, &self.costs);
        let pointer = self.pointer.place();
        let (frame, _) = self.gui.run(input, |context| {
            // egui may lay out a frame twice; the last layout counts
            actions.clear();
            show(context, facts, costs, (frame_ms, own_ms), &mut actions);
            if facts.has_input {
                pointer::draw(context, pointer);
            }
        });
        if closes {
            actions.push(Action::Close);
        }
        self.own_ms += (begin.elapsed().as_secs_f32() * 1000.0 - self.own_ms) * 0.1;
        (frame, actions)
    }
}

fn is_escape(event: &egui::Event) -> bool {
    matches!(
        event,
        egui::Event::Key {
            key: egui::Key::Escape,
            pressed: true,
            ..
        }
    )
}

fn show(
    context: &Context,
    facts: &Facts<'_>,
    costs: &CostHistory,
    (frame_ms, own_ms): (f32, f32),
    actions: &mut Vec<Action>,
) {
    egui::Window::new("Relight")
        .collapsible(false)
        .resizable(false)
        .default_pos([24.0, 24.0])
        .show(context, |ui| {
            let mut changes = Vec::new();
            ui.horizontal(|ui| {
                for (value, name) in [
                    (Look::Classic, "Classic look"),
                    (Look::Hybrid, "Hybrid look"),
                    (Look::Traced, "Traced look"),
                ] {
                    let chosen = facts.settings.rt == value;
                    if ui.selectable_label(chosen, name).clicked() && !chosen {
                        changes.push(Change {
                            name: "r_rt",
                            value: (value as u32).to_string(),
                        });
                    }
                }
            });
            ui.separator();
            ui.horizontal(|ui| {
                ui.label("Preset");
                presets(ui, facts.settings, &mut changes);
                let auto = ui.selectable_label(false, "auto");
                let auto = auto.on_hover_text("measures the presets for some seconds and keeps the best that is fast");
                if auto.clicked() {
                    actions.push(Action::Command("rt_preset auto"));
                }
            });
            main_settings(ui, facts.settings, costs.newest(), &mut changes);
            ui.separator();
            let gpu = frame_time(costs.newest());
            let rate = 1000.0 / frame_ms.max(0.1);
            ui.label(format!("{rate:.0} frames/s, GPU {gpu:.2} ms, this menu {own_ms:.2} ms"));
            ui.weak(facts.device);
            ui.separator();
            ui.horizontal(|ui| {
                let mut command = |ui: &mut egui::Ui, name: &str, text: &'static str, help: &str| {
                    let button = ui.add_enabled(facts.in_map, egui::Button::new(name));
                    if button.on_hover_text(help).clicked() {
                        actions.push(Action::Command(text));
                        actions.push(Action::Close);
                    }
                };
                command(ui, "Benchmark", "rt_benchmark", "measures a flight through this map");
                command(ui, "Report", "report", "writes a file for a bug report");
                if ui.button("Close").on_hover_text("Escape").clicked() {
                    actions.push(Action::Close);
                }
            });
            if !facts.has_input {
                let text = "Mouse and keys go to the game here: use \"rt_menu up\", down, left, right, enter, close";
                ui.label(RichText::new(text).small());
            }
            actions.extend(changes.into_iter().map(Action::Set));
        });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::input::Input;

    const SIZE: (u32, u32) = (800, 600);

    fn facts(settings: &Settings) -> Facts<'_> {
        Facts {
            settings,
            timings: &[],
            size: SIZE,
            device: "device",
            in_map: true,
            has_input: true,
        }
    }

    /// Place of a text of the frame: that of the mesh's first vertex with this label is unknown, so the menu is
    /// scanned by clicks.
    fn click_everywhere(settings: &Settings) -> Vec<Action> {
        let mut all = Vec::new();
        for y in (30..420).step_by(9) {
            for x in (30..420).step_by(24) {
                let mut menu = Menu::new(SIZE);
                let facts = facts(settings);
                let to = [x as f32, y as f32];
                let moved = Input::Motion { to, by: [0.0; 2] };
                let button = |pressed| Input::Button { button: 1, pressed };
                menu.frame(&[], false, &facts);
                menu.frame(&[moved], false, &facts);
                menu.frame(&[button(true)], false, &facts);
                let (_, actions) = menu.frame(&[button(false)], false, &facts);
                for action in actions {
                    if !all.contains(&action) {
                        all.push(action);
                    }
                }
            }
        }
        all
    }

    #[test]
    fn clicks_choose_looks_presets_settings_and_commands() {
        let actions = click_everywhere(&Settings::default());
        let set = |name, value: &str| {
            Action::Set(Change {
                name,
                value: value.to_owned(),
            })
        };
        for expected in [
            set("r_rt", "1"),
            set("rt_scale", "0.5"),
            set("rt_taa", "0"),
            set("rt_softshadows", "0"),
            Action::Command("rt_preset auto"),
            Action::Command("rt_benchmark"),
            Action::Command("report"),
            Action::Close,
        ] {
            assert!(actions.contains(&expected), "{expected:?}: {actions:?}");
        }
    }

    #[test]
    fn escape_closes_and_nothing_is_chosen_without_input() {
        let settings = Settings::default();
        let mut menu = Menu::new(SIZE);
        let (frame, actions) = menu.frame(&[], false, &facts(&settings));
        assert!(actions.is_empty(), "{actions:?}");
        assert!(!frame.textures.is_empty());
        let escape = Input::Key {
            code: 41,
            pressed: true,
            shift: false,
        };
        let (_, actions) = menu.frame(&[escape], false, &facts(&settings));
        assert_eq!(actions, [Action::Close]);
    }

    #[test]
    fn the_keys_of_commands_reach_a_widget() {
        let settings = Settings::default();
        let mut menu = Menu::new(SIZE);
        let facts = facts(&settings);
        menu.frame(&[], false, &facts);
        let mut all = Vec::new();
        // along all widgets, and enter at each
        for _ in 0..40 {
            for word in ["down", "enter"] {
                let events = pointer::keys_of_word(word).unwrap();
                for event in events {
                    all.extend(menu.frame(&[event], false, &facts).1);
                }
                all.extend(menu.frame(&[], false, &facts).1);
            }
        }
        assert!(all.iter().any(|a| matches!(a, Action::Set(_))), "{all:?}");
    }
}
