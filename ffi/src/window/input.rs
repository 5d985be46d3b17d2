//! Mouse and keys for the menu: SDL's event filter keeps events from the engine while the menu is open.
//!
//! A key that went down before the menu was opened comes up in the game, and a key that went down in the menu comes up
//! in the menu, also after it is closed: the engine sees no half of a key press.

use std::ffi::{c_int, c_void};
use std::sync::{Mutex, PoisonError};

use super::sdl::{Filter, Sdl};

/// An event for the menu.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// A key by its scan code.
    Key {
        /// `SDL_Scancode`.
        code: u32,
        /// Goes down.
        pressed: bool,
        /// A shift key is held.
        shift: bool,
    },
    /// Typed text.
    Text(String),
    /// The pointer, window points.
    Motion {
        /// Position.
        to: [f32; 2],
        /// Motion.
        by: [f32; 2],
    },
    /// A button of the mouse, 1 is the left one.
    Button {
        /// Its number.
        button: u8,
        /// Goes down.
        pressed: bool,
    },
    /// The wheel, lines away from the user.
    Wheel(f32),
}

/// Events of a window, and who gets them.
#[derive(Debug, Default)]
struct Capture {
    /// The menu is open.
    active: bool,
    /// Keys and buttons that went down in the menu.
    held_keys: Vec<u32>,
    held_buttons: Vec<u8>,
    events: Vec<Input>,
}

/// `SDL_EventType`.
mod kind {
    pub const KEY_DOWN: u32 = 0x300;
    pub const KEY_UP: u32 = 0x301;
    pub const TEXT_EDITING: u32 = 0x302;
    pub const TEXT_INPUT: u32 = 0x303;
    pub const MOTION: u32 = 0x400;
    pub const BUTTON_DOWN: u32 = 0x401;
    pub const BUTTON_UP: u32 = 0x402;
    pub const WHEEL: u32 = 0x403;
}

/// Bytes of an `SDL_Event`.
const EVENT_BYTES: usize = 56;
/// Bytes of the text of an `SDL_TextInputEvent`.
const TEXT_BYTES: usize = 32;
/// `KMOD_SHIFT`.
const SHIFT: u16 = 0x3;

fn number<const N: usize>(event: &[u8; EVENT_BYTES], at: usize) -> [u8; N] {
    let bytes = event
        .get(at..at + N)
        .and_then(|bytes| bytes.try_into().ok());
    bytes.unwrap_or([0; N])
}

impl Capture {
    /// Takes an event; whether the engine gets it.
    fn filter(&mut self, event: &[u8; EVENT_BYTES]) -> bool {
        let word = |at| u32::from_ne_bytes(number(event, at));
        let signed = |at| i32::from_ne_bytes(number(event, at)) as f32;
        let byte = |at: usize| event.get(at).copied().unwrap_or(0);
        match word(0) {
            kind::KEY_DOWN if self.active => {
                let code = word(16);
                if !self.held_keys.contains(&code) {
                    self.held_keys.push(code);
                }
                let shift = u16::from_ne_bytes(number(event, 24)) & SHIFT != 0;
                self.events.push(Input::Key {
                    code,
                    pressed: true,
                    shift,
                });
                false
            }
            kind::KEY_UP => {
                let code = word(16);
                let held = self.held_keys.iter().position(|held| *held == code);
                let Some(held) = held else {
                    return true;
                };
                self.held_keys.swap_remove(held);
                self.events.push(Input::Key {
                    code,
                    pressed: false,
                    shift: false,
                });
                false
            }
            kind::TEXT_EDITING if self.active => false,
            kind::TEXT_INPUT if self.active => {
                let bytes: [u8; TEXT_BYTES] = number(event, 12);
                let end = bytes.iter().position(|b| *b == 0).unwrap_or(TEXT_BYTES);
                let text = bytes.get(..end).unwrap_or_default();
                self.events
                    .push(Input::Text(String::from_utf8_lossy(text).into_owned()));
                false
            }
            kind::MOTION if self.active => {
                self.events.push(Input::Motion {
                    to: [signed(20), signed(24)],
                    by: [signed(28), signed(32)],
                });
                false
            }
            kind::BUTTON_DOWN if self.active => {
                let button = byte(16);
                if !self.held_buttons.contains(&button) {
                    self.held_buttons.push(button);
                }
                self.events.push(Input::Button {
                    button,
                    pressed: true,
                });
                false
            }
            kind::BUTTON_UP => {
                let button = byte(16);
                let held = self.held_buttons.iter().position(|held| *held == button);
                let Some(held) = held else {
                    return true;
                };
                self.held_buttons.swap_remove(held);
                self.events.push(Input::Button {
                    button,
                    pressed: false,
                });
                false
            }
            kind::WHEEL if self.active => {
                self.events.push(Input::Wheel(signed(20)));
                false
            }
            _ => true,
        }
    }
}

static CAPTURE: Mutex<Capture> = Mutex::new(Capture {
    active: false,
    held_keys: Vec::new(),
    held_buttons: Vec::new(),
    events: Vec::new(),
});

/// The engine's own filter and its data, as an address.
static PREVIOUS: Mutex<Option<(Filter, usize)>> = Mutex::new(None);

/// The SDL whose filter is ours; `None` while it is not.
static INSTALLED: Mutex<Option<Sdl>> = Mutex::new(None);

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    // the contents are valid at every moment
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// SDL's filter: 0 drops the event.
///
/// # Safety
/// Only SDL calls it, with an `SDL_Event`, on any thread.
unsafe extern "C" fn filter(_: *mut c_void, event: *mut c_void) -> c_int {
    let previous = *lock(&PREVIOUS);
    if let Some((previous, data)) = previous {
        let data = std::ptr::with_exposed_provenance_mut(data);
        // SAFETY: the engine's filter with the data that it was set with; SDL would call it the same way.
        if unsafe { previous(data, event) } == 0 {
            return 0;
        }
    }
    if event.is_null() {
        return 1;
    }
    // SAFETY: an `SDL_Event` is a union of 56 bytes, initialised by SDL; copied without alignment.
    let bytes = unsafe { event.cast::<[u8; EVENT_BYTES]>().read_unaligned() };
    c_int::from(lock(&CAPTURE).filter(&bytes))
}

/// Sets our filter, if the engine uses SDL. Setting it empties SDL's queue of events, so it is set when the window is
/// opened rather than when the menu is.
pub fn install() {
    let mut installed = lock(&INSTALLED);
    if installed.is_some() {
        return;
    }
    let Some(sdl) = Sdl::loaded().filter(Sdl::runs_video) else {
        return;
    };
    let previous = sdl.event_filter();
    *lock(&PREVIOUS) = previous.map(|(filter, data)| (filter, data.expose_provenance()));
    // SAFETY: the function lives as long as this library, and `remove` takes it back before that is unloaded.
    unsafe { sdl.set_event_filter(Some(filter), std::ptr::null_mut()) };
    *installed = Some(sdl);
}

/// Whether mouse and keys can be kept from the engine.
pub fn is_installed() -> bool {
    lock(&INSTALLED).is_some()
}

/// Begins to keep mouse and keys from the engine.
pub fn begin() {
    let mut capture = lock(&CAPTURE);
    capture.active = true;
    capture.events.clear();
}

/// Gives mouse and keys back to the engine. Keys that are held come up here.
pub fn end() {
    let mut capture = lock(&CAPTURE);
    capture.active = false;
    capture.events.clear();
}

/// Takes the filter back: this library may be unloaded.
pub fn remove() {
    end();
    let Some(sdl) = lock(&INSTALLED).take() else {
        return;
    };
    *lock(&CAPTURE) = Capture::default();
    let (previous, data) = match lock(&PREVIOUS).take() {
        Some((previous, data)) => (Some(previous), data),
        None => (None, 0),
    };
    let data = std::ptr::with_exposed_provenance_mut(data);
    // SAFETY: the engine's filter with its data, or none, as before.
    unsafe { sdl.set_event_filter(previous, data) };
}

/// The events since the last call. `relative`: the pointer is invisible and only its motion counts.
pub fn take() -> (Vec<Input>, bool) {
    let relative = lock(&INSTALLED).is_some_and(|sdl| sdl.is_pointer_relative());
    (std::mem::take(&mut lock(&CAPTURE).events), relative)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(kind: u32, words: &[(usize, u32)]) -> [u8; EVENT_BYTES] {
        let mut bytes = [0; EVENT_BYTES];
        for (at, word) in [(0, kind)].iter().chain(words) {
            bytes[*at..at + 4].copy_from_slice(&word.to_ne_bytes());
        }
        bytes
    }

    #[test]
    fn an_open_menu_keeps_everything_and_a_closed_one_nothing() {
        let mut capture = Capture::default();
        let all = [
            event(kind::KEY_DOWN, &[(16, 26)]),
            event(kind::TEXT_INPUT, &[(12, u32::from_ne_bytes(*b"w\0\0\0"))]),
            event(
                kind::MOTION,
                &[(20, 7), (24, 8), (28, -1i32 as u32), (32, 2)],
            ),
            event(kind::BUTTON_DOWN, &[(16, 1)]),
            event(kind::WHEEL, &[(20, -2i32 as u32)]),
        ];
        for event in &all {
            assert!(capture.filter(event));
        }
        assert!(capture.events.is_empty());
        capture.active = true;
        for event in &all {
            assert!(!capture.filter(event));
        }
        let expected = [
            Input::Key {
                code: 26,
                pressed: true,
                shift: false,
            },
            Input::Text("w".into()),
            Input::Motion {
                to: [7.0, 8.0],
                by: [-1.0, 2.0],
            },
            Input::Button {
                button: 1,
                pressed: true,
            },
            Input::Wheel(-2.0),
        ];
        assert_eq!(capture.events, expected);
        // other events, such as a closed window, reach the engine
        assert!(capture.filter(&event(0x100, &[])));
    }

    #[test]
    fn a_key_comes_up_where_it_went_down() {
        let mut capture = Capture::default();
        let down = |code| event(kind::KEY_DOWN, &[(16, code)]);
        let up = |code| event(kind::KEY_UP, &[(16, code)]);
        assert!(capture.filter(&down(26)));
        capture.active = true;
        // held since before the menu: the game must see it come up
        assert!(capture.filter(&up(26)));
        assert!(!capture.filter(&down(41)));
        assert!(!capture.filter(&down(41)), "repeated");
        capture.active = false;
        assert!(!capture.filter(&up(41)), "went down in the menu");
        assert!(capture.filter(&up(41)), "no longer held");
        assert!(capture.filter(&down(41)));
    }
}
