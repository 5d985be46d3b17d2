//! Events of the window as input of egui, and the pointer that the menu draws itself: games hide the system's.

use gui::egui::{
    self, Color32, Context, Event, Key, Modifiers, PointerButton, Pos2, RawInput, Rect, Stroke,
};

use crate::window::input::Input;

/// Height of the picture for which the menu is designed, pixels.
const HEIGHT: f32 = 720.0;

/// The pointer and the scale of the menu.
#[derive(Clone, Copy, Debug)]
pub struct Pointer {
    /// Pixels.
    place: Pos2,
    scale: f32,
}

impl Pointer {
    /// A pointer in the middle of a window, pixels.
    pub fn new((width, height): (u32, u32)) -> Self {
        Self {
            place: Pos2::new(width as f32 * 0.5, height as f32 * 0.5),
            scale: 1.0,
        }
    }

    /// Its place, points of egui.
    pub fn place(&self) -> Pos2 {
        self.place / self.scale
    }

    /// Input of a frame. `relative`: the window's pointer is invisible, and only its motion counts.
    pub fn input(
        &mut self,
        events: &[Input],
        relative: bool,
        (width, height): (u32, u32),
    ) -> RawInput {
        let size = egui::vec2(width.max(1) as f32, height.max(1) as f32);
        // a larger window gets a larger menu; a small one shows it all the same
        self.scale = (size.y / HEIGHT).clamp(1.0, 4.0);
        let mut input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size / self.scale)),
            ..RawInput::default()
        };
        let viewport = input.viewports.entry(egui::ViewportId::ROOT).or_default();
        viewport.native_pixels_per_point = Some(self.scale);
        for event in events {
            self.push(event, relative, size, &mut input.events);
        }
        input
    }

    fn push(&mut self, event: &Input, relative: bool, size: egui::Vec2, events: &mut Vec<Event>) {
        match event {
            Input::Motion { to, by } => {
                let moved = match relative {
                    true => self.place + egui::vec2(by[0], by[1]),
                    false => Pos2::new(to[0], to[1]),
                };
                self.place = moved.clamp(Pos2::ZERO, size.to_pos2());
                events.push(Event::PointerMoved(self.place()));
            }
            Input::Button { button, pressed } => {
                let button = match button {
                    1 => PointerButton::Primary,
                    2 => PointerButton::Middle,
                    3 => PointerButton::Secondary,
                    _ => return,
                };
                events.push(Event::PointerButton {
                    pos: self.place(),
                    button,
                    pressed: *pressed,
                    modifiers: Modifiers::NONE,
                });
            }
            Input::Wheel(lines) => events.push(Event::MouseWheel {
                unit: egui::MouseWheelUnit::Line,
                delta: egui::vec2(0.0, *lines),
                modifiers: Modifiers::NONE,
            }),
            Input::Text(text) => events.push(Event::Text(text.clone())),
            Input::Key {
                code,
                pressed,
                shift,
            } => {
                if let Some(key) = key_of(*code) {
                    events.push(Event::Key {
                        key,
                        physical_key: None,
                        pressed: *pressed,
                        repeat: false,
                        modifiers: Modifiers {
                            shift: *shift,
                            ..Modifiers::NONE
                        },
                    });
                }
            }
        }
    }
}

/// Scan codes of SDL with keys of egui.
const KEYS: [(u32, Key); 22] = [
    (4, Key::A),
    (6, Key::C),
    (7, Key::D),
    (8, Key::E),
    (20, Key::Q),
    (22, Key::S),
    (26, Key::W),
    (40, Key::Enter),
    (41, Key::Escape),
    (42, Key::Backspace),
    (43, Key::Tab),
    (44, Key::Space),
    (74, Key::Home),
    (75, Key::PageUp),
    (76, Key::Delete),
    (77, Key::End),
    (78, Key::PageDown),
    (79, Key::ArrowRight),
    (80, Key::ArrowLeft),
    (81, Key::ArrowDown),
    (82, Key::ArrowUp),
    // of the keypad
    (88, Key::Enter),
];

fn key_of(code: u32) -> Option<Key> {
    let found = KEYS.iter().find(|(known, _)| *known == code);
    found.map(|(_, key)| *key)
}

/// Keys for a word of `rt_menu`: down and up again.
pub fn keys_of_word(word: &str) -> Option<[Input; 2]> {
    let (key, shift) = match word.to_ascii_lowercase().as_str() {
        "down" => (Key::Tab, false),
        "up" => (Key::Tab, true),
        "left" => (Key::ArrowLeft, false),
        "right" => (Key::ArrowRight, false),
        "enter" => (Key::Enter, false),
        "close" => (Key::Escape, false),
        _ => return None,
    };
    let (code, _) = KEYS.iter().find(|(_, known)| *known == key)?;
    let event = |pressed| Input::Key {
        code: *code,
        pressed,
        shift,
    };
    Some([event(true), event(false)])
}

/// Draws an arrow.
pub fn draw(context: &Context, at: Pos2) {
    let layer = egui::LayerId::new(egui::Order::Tooltip, egui::Id::new("pointer"));
    let corner = |x: f32, y: f32| at + egui::vec2(x, y);
    let arrow = vec![
        corner(0.0, 0.0),
        corner(0.0, 15.0),
        corner(4.0, 11.5),
        corner(10.5, 11.0),
    ];
    let edge = Stroke::new(1.0, Color32::BLACK);
    let shape = egui::Shape::convex_polygon(arrow, Color32::WHITE, edge);
    context.layer_painter(layer).add(shape);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relative_pointer_stays_in_the_window() {
        let mut pointer = Pointer::new((800, 600));
        let motion = |by| Input::Motion { to: [-1.0; 2], by };
        pointer.input(&[motion([10.0, -20.0])], true, (800, 600));
        assert_eq!(pointer.place(), Pos2::new(410.0, 280.0));
        pointer.input(&[motion([1e4, -1e4])], true, (800, 600));
        assert_eq!(pointer.place(), Pos2::new(800.0, 0.0));
    }

    #[test]
    fn a_large_window_has_a_large_menu() {
        let mut pointer = Pointer::new((3840, 2160));
        let to = [1920.0, 1080.0];
        let input = pointer.input(&[Input::Motion { to, by: [0.0; 2] }], false, (3840, 2160));
        let size = input.screen_rect.unwrap().size();
        assert_eq!((size.x, size.y), (1280.0, 720.0));
        assert_eq!(pointer.place(), Pos2::new(640.0, 360.0));
    }
}
