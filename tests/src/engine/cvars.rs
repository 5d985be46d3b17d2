//! Console variables with the engine's rules: live structures that the renderer keeps pointers to, latched values,
//! ranges.

use std::collections::HashMap;
use std::ffi::{CString, c_char, c_int};
use std::ptr;

use super::abi::{CVAR_CHEAT, CVAR_INIT, CVAR_LATCH, CVAR_ROM, CVAR_USER_CREATED, cvar_t};

/// A variable: the structure that the renderer reads, and the strings that its pointers point to.
struct Variable {
    /// Owned; freed with the table. A raw pointer, because the renderer keeps one too.
    live: *mut cvar_t,
    name: CString,
    string: CString,
    reset: CString,
    latched: Option<CString>,
    description: Option<CString>,
    /// Strings that the renderer may still look at; the engine frees them, we keep them so that a renderer that
    /// holds on to one is found out by its wrong value and not by a crash.
    old: Vec<CString>,
}

/// All variables by lower-case name.
#[derive(Default)]
pub struct Cvars {
    variables: HashMap<String, Variable>,
}

fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', "")).unwrap_or_default()
}

/// What C's `atof` makes of the text: its longest prefix that is a number.
fn number(text: &str) -> f32 {
    let text = text.trim_start();
    (0..=text.len())
        .rev()
        .filter(|&end| text.is_char_boundary(end))
        .find_map(|end| text[..end].parse::<f32>().ok())
        .unwrap_or(0.0)
}

/// What C's `atoi` makes of it.
fn integer(text: &str) -> c_int {
    let text = text.trim_start();
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    let len = digits.bytes().take_while(u8::is_ascii_digit).count() + (text.len() - digits.len());
    text[..len].parse().unwrap_or(0)
}

impl Variable {
    /// Gives the variable a value, whatever its flags say.
    fn assign(&mut self, text: &str) {
        // SAFETY: `live` is ours until the table is dropped, and no reference into it outlives this function.
        let live = unsafe { &mut *self.live };
        let mut text = text.to_string();
        if live.validate != 0 {
            let mut value = number(&text);
            if live.integral != 0 {
                value = value.trunc();
            }
            let clamped = value.clamp(live.min, live.max);
            if clamped != number(&text) {
                text = format_number(clamped);
            }
        }
        self.latched = None;
        live.latchedString = ptr::null_mut();
        if self.string.to_bytes() == text.as_bytes() {
            return;
        }
        self.old
            .push(std::mem::replace(&mut self.string, c_string(&text)));
        live.string = self.string.as_ptr().cast_mut();
        live.value = number(&text);
        live.integer = integer(&text);
        live.modified = 1;
        live.modificationCount += 1;
    }
}

fn format_number(value: f32) -> String {
    if value == value.trunc() {
        format!("{value:.0}")
    } else {
        format!("{value:.6}")
    }
}

impl Cvars {
    /// `Cvar_Get`: finds or creates. A latched value takes effect; flags are added; the default of a variable that
    /// the user had made becomes its reset value.
    pub fn get(&mut self, name: &str, default: &str, flags: c_int) -> *mut cvar_t {
        if let Some(variable) = self.variables.get_mut(&name.to_ascii_lowercase()) {
            // SAFETY: as in `assign`.
            let live = unsafe { &mut *variable.live };
            if live.flags & CVAR_USER_CREATED != 0 && flags & CVAR_USER_CREATED == 0 {
                live.flags &= !CVAR_USER_CREATED;
                variable
                    .old
                    .push(std::mem::replace(&mut variable.reset, c_string(default)));
                live.resetString = variable.reset.as_ptr().cast_mut();
                if flags & CVAR_ROM != 0 {
                    variable.latched = Some(c_string(default));
                }
            }
            live.flags |= flags;
            if let Some(latched) = variable.latched.take() {
                variable.assign(&latched.to_string_lossy());
            }
            return variable.live;
        }
        let strings = (c_string(name), c_string(default), c_string(default));
        let live = Box::into_raw(Box::new(cvar_t {
            name: strings.0.as_ptr().cast_mut(),
            string: strings.1.as_ptr().cast_mut(),
            resetString: strings.2.as_ptr().cast_mut(),
            latchedString: ptr::null_mut(),
            flags,
            modified: 1,
            modificationCount: 1,
            value: number(default),
            integer: integer(default),
            validate: 0,
            integral: 0,
            min: 0.0,
            max: 0.0,
            description: ptr::null_mut(),
            next: ptr::null_mut(),
            prev: ptr::null_mut(),
            hashNext: ptr::null_mut(),
            hashPrev: ptr::null_mut(),
            hashIndex: 0,
        }));
        let variable = Variable {
            live,
            name: strings.0,
            string: strings.1,
            reset: strings.2,
            latched: None,
            description: None,
            old: Vec::new(),
        };
        self.variables.insert(name.to_ascii_lowercase(), variable);
        live
    }

    /// `Cvar_Set`: past latches and read-only flags.
    pub fn force(&mut self, name: &str, value: &str) {
        if !self.variables.contains_key(&name.to_ascii_lowercase()) {
            self.get(name, value, CVAR_USER_CREATED);
        } else if let Some(variable) = self.variables.get_mut(&name.to_ascii_lowercase()) {
            variable.assign(value);
        }
    }

    /// What `set` on the console does: read-only variables stay, latched ones wait for the next `Cvar_Get`.
    /// Cheats are on.
    pub fn set_by_user(&mut self, name: &str, value: &str) {
        let Some(variable) = self.variables.get_mut(&name.to_ascii_lowercase()) else {
            self.get(name, value, CVAR_USER_CREATED);
            return;
        };
        // SAFETY: as in `assign`.
        let live = unsafe { &mut *variable.live };
        if live.flags & (CVAR_ROM | CVAR_INIT) != 0 {
            return;
        }
        if live.flags & CVAR_LATCH != 0 {
            variable.old.extend(variable.latched.take());
            live.latchedString = ptr::null_mut();
            if variable.string.to_bytes() != value.as_bytes() {
                let latched = variable.latched.insert(c_string(value));
                live.latchedString = latched.as_ptr().cast_mut();
                live.modified = 1;
                live.modificationCount += 1;
            }
            return;
        }
        variable.assign(value);
    }

    /// The value as text.
    pub fn string(&self, name: &str) -> Option<String> {
        let variable = self.variables.get(&name.to_ascii_lowercase())?;
        Some(variable.string.to_string_lossy().into_owned())
    }

    /// Flags, reset value and description, for tests of what a renderer registers.
    pub fn describe(&self, name: &str) -> Option<(c_int, String, Option<String>)> {
        let variable = self.variables.get(&name.to_ascii_lowercase())?;
        // SAFETY: as in `assign`.
        let flags = unsafe { (*variable.live).flags };
        let description = variable
            .description
            .as_ref()
            .map(|d| d.to_string_lossy().into_owned());
        Some((
            flags,
            variable.reset.to_string_lossy().into_owned(),
            description,
        ))
    }

    /// `Cvar_VariableIntegerValue`.
    pub fn integer(&self, name: &str) -> c_int {
        self.string(name).map_or(0, |s| integer(&s))
    }

    fn by_pointer(&mut self, live: *mut cvar_t) -> Option<&mut Variable> {
        self.variables.values_mut().find(|v| ptr::eq(v.live, live))
    }

    /// Where the text of a variable is, until it changes; null if there is none.
    pub fn place_of_text(&self, name: &str) -> *const c_char {
        self.variables
            .get(&name.to_ascii_lowercase())
            .map_or(ptr::null(), |v| v.string.as_ptr())
    }

    /// `Cvar_CheckRange`. False for a pointer that is none of ours.
    pub fn check_range(&mut self, live: *mut cvar_t, min: f32, max: f32, integral: bool) -> bool {
        let Some(variable) = self.by_pointer(live) else {
            return false;
        };
        {
            // SAFETY: as in `assign`.
            let live = unsafe { &mut *variable.live };
            live.validate = 1;
            live.min = min;
            live.max = max;
            live.integral = integral.into();
        }
        let text = variable.string.to_string_lossy().into_owned();
        variable.assign(&text);
        true
    }

    /// `Cvar_SetDescription`. False for a pointer that is none of ours.
    pub fn set_description(&mut self, live: *mut cvar_t, text: &str) -> bool {
        let Some(variable) = self.by_pointer(live) else {
            return false;
        };
        let description = variable.description.insert(c_string(text));
        // SAFETY: as in `assign`.
        unsafe { (*variable.live).description = description.as_ptr().cast_mut() };
        true
    }

    /// Names of all variables that are not merely the user's.
    pub fn registered(&self) -> Vec<String> {
        let mut names: Vec<String> = self
            .variables
            .values()
            // SAFETY: as in `assign`.
            .filter(|v| unsafe { (*v.live).flags } & CVAR_USER_CREATED == 0)
            .map(|v| v.name.to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// Whether the variable is one that only cheaters may change.
    pub fn is_cheat(&self, name: &str) -> bool {
        self.describe(name)
            .is_some_and(|(flags, ..)| flags & CVAR_CHEAT != 0)
    }
}

impl Drop for Cvars {
    fn drop(&mut self) {
        for variable in self.variables.values() {
            // SAFETY: made by `Box::into_raw` in `get`, freed here alone; the library has been shut down.
            drop(unsafe { Box::from_raw(variable.live) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn live(pointer: *mut cvar_t) -> &'static cvar_t {
        // SAFETY: the tables below outlive the use.
        unsafe { &*pointer }
    }

    #[test]
    fn latched_values_wait_for_the_next_get() {
        let mut cvars = Cvars::default();
        let mode = cvars.get("r_mode", "3", CVAR_LATCH);
        cvars.set_by_user("R_MODE", "6");
        assert_eq!(
            (live(mode).integer, live(mode).latchedString.is_null()),
            (3, false)
        );
        assert!(ptr::eq(cvars.get("r_mode", "3", CVAR_LATCH), mode));
        assert_eq!(
            (live(mode).integer, live(mode).latchedString.is_null()),
            (6, true)
        );
        cvars.force("r_mode", "4");
        assert_eq!(live(mode).integer, 4);
    }

    #[test]
    fn what_the_user_made_gets_a_default_and_flags() {
        let mut cvars = Cvars::default();
        cvars.set_by_user("r_gamma", "1.5");
        assert!(cvars.registered().is_empty());
        let gamma = live(cvars.get("r_gamma", "1", 1));
        assert_eq!((gamma.value, gamma.integer, gamma.flags), (1.5, 1, 1));
        assert_eq!(cvars.describe("r_gamma").unwrap().1, "1");
        assert_eq!(cvars.registered(), ["r_gamma"]);
    }

    #[test]
    fn ranges_clamp_now_and_later() {
        let mut cvars = Cvars::default();
        let lod = cvars.get("r_lodbias", "9", 0);
        assert!(cvars.check_range(lod, 0.0, 2.0, true));
        assert_eq!(live(lod).integer, 2);
        cvars.set_by_user("r_lodbias", "-5");
        assert_eq!(live(lod).integer, 0);
        cvars.set_by_user("r_lodbias", "1.7");
        assert_eq!(cvars.string("r_lodbias").unwrap(), "1");
        assert!(!cvars.check_range(ptr::null_mut(), 0.0, 1.0, false));
    }

    #[test]
    fn numbers_as_c_reads_them() {
        assert_eq!(
            (number("1.5x"), number("abc"), number(" -2"), number("1e2")),
            (1.5, 0.0, -2.0, 100.0)
        );
        assert_eq!(
            (integer("12.9"), integer("-3a"), integer(""), integer("+4")),
            (12, -3, 0, 4)
        );
    }

    #[test]
    fn read_only_variables_stay() {
        let mut cvars = Cvars::default();
        let info = cvars.get("r_info", "x", CVAR_ROM);
        cvars.set_by_user("r_info", "y");
        assert_eq!(cvars.string("r_info").unwrap(), "x");
        cvars.force("r_info", "y");
        assert_eq!(cvars.string("r_info").unwrap(), "y");
        assert_eq!(live(info).modificationCount, 2);
    }
}
