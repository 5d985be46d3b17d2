//! Console variables: registration, reading, and transfer to the renderer's settings.

#[cfg(test)]
mod document;
mod settings;
mod table;

pub use settings::{apply, apply_at_registration, write_back_limits};
pub use table::Cvar;

use std::collections::HashMap;
use std::ffi::{CString, c_int};

use crate::engine::{Engine, Variable, cvar_flags};
use renderer_vk::settings::{Kind, ROWS, Reading, Row, Spec, flags};
use table::{TABLE, UNUSED};

/// The variable of a setting.
#[derive(Debug)]
struct Registered {
    row: &'static Row,
    variable: Option<Variable>,
    /// The variable whose change triggers reading; `None`: it is read each frame.
    with: Option<Variable>,
}

/// The engine's variables.
#[derive(Debug)]
pub struct Cvars {
    engine: Engine,
    /// Those of [`TABLE`], by position.
    own: Vec<Option<Variable>>,
    settings: Vec<Registered>,
}

/// A text for the engine. A text with a NUL becomes empty; texts of tables have none.
pub fn c_text(text: &str) -> CString {
    CString::new(text).unwrap_or_default()
}

/// The value as a number; 0 if it is not finite.
fn number(engine: Engine, variable: Variable) -> f32 {
    let value = engine.cvar_as_number(variable);
    if value.is_finite() { value } else { 0.0 }
}

/// The engine's bits of a variable's flags.
fn engine_flags(spec: &Spec) -> c_int {
    let pairs = [
        (flags::ARCHIVE, cvar_flags::ARCHIVE),
        (flags::LATCH, cvar_flags::LATCH),
        (flags::ROM, cvar_flags::ROM),
        (flags::TEMP, cvar_flags::TEMP),
        (flags::CHEAT, cvar_flags::CHEAT),
    ];
    let set = pairs.iter().filter(|(ours, _)| spec.flags & ours != 0);
    set.map(|(_, engines)| engines).sum()
}

/// The default of a variable in this engine.
fn default_of(engine: Engine, spec: &Spec) -> &'static str {
    let mut given = engine
        .front_end()
        .map_or(&[][..], |front| front.defaults)
        .iter();
    given
        .find(|(name, _)| *name == spec.name)
        .map_or(spec.default, |(_, default)| default)
}

/// Whether the engine registers this variable itself.
fn is_owned(engine: Engine, spec: &Spec) -> bool {
    let owned = engine.front_end().map_or(&[][..], |front| front.owned);
    owned
        .iter()
        .any(|name| name.eq_ignore_ascii_case(spec.name))
}

/// Finds or makes a variable.
pub fn get(engine: Engine, spec: &Spec) -> Option<Variable> {
    let (name, default) = (c_text(spec.name), c_text(default_of(engine, spec)));
    let flags = if is_owned(engine, spec) {
        0
    } else {
        engine_flags(spec)
    };
    engine.cvar_get(&name, &default, flags)
}

fn register(engine: Engine, spec: &Spec) -> Option<Variable> {
    let variable = get(engine, spec)?;
    if is_owned(engine, spec) {
        return Some(variable);
    }
    if let Some(range) = spec.range.filter(|range| range.by_engine) {
        engine.cvar_check_range(variable, range.min, range.max, spec.kind == Kind::Whole);
    }
    engine.cvar_describe(variable, &c_text(spec.help));
    Some(variable)
}

impl Cvars {
    /// Registers every variable. A repeated call applies latched values.
    pub fn register(engine: Engine) -> Cvars {
        let own = TABLE.iter().map(|spec| register(engine, spec)).collect();
        for spec in UNUSED {
            register(engine, spec);
        }
        let variables: Vec<_> = ROWS.iter().map(|row| register(engine, &row.spec)).collect();
        let named = |name| {
            let at = ROWS.iter().position(|row| row.spec.name == name)?;
            variables.get(at).copied().flatten()
        };
        let settings = ROWS
            .iter()
            .zip(&variables)
            .map(|(row, variable)| Registered {
                row,
                variable: *variable,
                with: match row.reading {
                    Reading::With(name) => named(name),
                    Reading::Frame | Reading::Start => None,
                },
            });
        let settings = settings.collect();
        Cvars {
            engine,
            own,
            settings,
        }
    }

    /// The texts of the settings' variables, by name.
    pub fn texts(&self) -> HashMap<&'static str, String> {
        let text = |r: &Registered| Some((r.row.spec.name, self.engine.cvar_string(r.variable?)));
        self.settings.iter().filter_map(text).collect()
    }

    fn handle(&self, cvar: Cvar) -> Option<Variable> {
        self.own.get(cvar as usize).copied().flatten()
    }

    /// The value as an integer, as parsed by the engine; 0 if the engine has no such variable.
    pub fn integer(&self, cvar: Cvar) -> i32 {
        self.handle(cvar)
            .map_or(0, |handle| self.engine.cvar_as_integer(handle))
    }

    /// The value as a finite number; 0 if the engine has no such variable.
    pub fn value(&self, cvar: Cvar) -> f32 {
        self.handle(cvar)
            .map_or(0.0, |handle| number(self.engine, handle))
    }

    /// Whether the integer value is not 0.
    pub fn flag(&self, cvar: Cvar) -> bool {
        self.integer(cvar) != 0
    }

    /// The value as text.
    pub fn string(&self, cvar: Cvar) -> String {
        self.handle(cvar)
            .map_or_else(String::new, |handle| self.engine.cvar_string(handle))
    }

    /// Whether the value has changed since the last call of [`Cvars::seen`].
    pub fn modified(&self, cvar: Cvar) -> bool {
        self.handle(cvar)
            .is_some_and(|handle| self.engine.cvar_modified(handle))
    }

    /// Marks a change as processed.
    pub fn seen(&self, cvar: Cvar) {
        if let Some(handle) = self.handle(cvar) {
            self.engine.cvar_seen(handle);
        }
    }

    /// Sets a variable.
    fn set(&self, spec: &Spec, value: &str) {
        self.engine.cvar_set(&c_text(spec.name), value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Names, defaults and flags as Debian's opengl1 registers them (its log), one per line. `-` is the empty string.
    pub const KNOWN: &str = include_str!("known_cvars.txt");

    fn flag_bits(letters: &str) -> c_int {
        letters
            .chars()
            .map(|letter| match letter {
                'A' => 0x1,
                'L' => 0x20,
                'R' => 0x40,
                'T' => 0x100,
                'C' => 0x200,
                '0' => 0,
                other => panic!("unknown flag letter {other}"),
            })
            .sum()
    }

    /// All variables.
    pub fn specs() -> impl Iterator<Item = &'static Spec> {
        let settings = ROWS.iter().map(|row| &row.spec);
        TABLE.iter().chain(UNUSED).chain(settings)
    }

    #[test]
    fn every_known_cvar_is_there_with_its_default_and_flags() {
        let mut rows = 0;
        for line in KNOWN.lines().filter(|line| !line.starts_with('#')) {
            let [name, default, flags] = line.split_whitespace().collect::<Vec<_>>()[..] else {
                panic!("bad row {line:?}")
            };
            let default = if default == "-" { "" } else { default };
            let spec = specs()
                .find(|spec| spec.name == name)
                .unwrap_or_else(|| panic!("{name} is missing"));
            assert_eq!(spec.default, default, "default of {name}");
            assert_eq!(engine_flags(spec), flag_bits(flags), "flags of {name}");
            rows += 1;
        }
        assert_eq!(rows, 107);
    }

    #[test]
    fn names_are_unique_whatever_their_case() {
        let names: HashSet<_> = specs().map(|s| s.name.to_ascii_lowercase()).collect();
        assert_eq!(names.len(), specs().count());
    }

    #[test]
    fn texts_have_no_nul_and_a_description() {
        for spec in specs() {
            for text in [spec.name, spec.default, spec.help] {
                assert!(!text.contains('\0'), "{}", spec.name);
            }
            assert!(spec.help.len() > 10, "{}", spec.name);
        }
    }
}
