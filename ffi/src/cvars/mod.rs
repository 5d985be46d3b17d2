//! Console variables: registration, reading, and their way into the renderer's settings.

mod settings;
pub mod table;

pub use settings::{WindowFacts, apply, apply_at_registration, write_back_clamps};
pub use table::{Cvar, TABLE};

use crate::engine::{Engine, Variable};

/// What may be asked of a cvar's number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// Whole numbers alone.
    pub integral: bool,
}

/// The engine's variables behind [`TABLE`], by position.
#[derive(Debug)]
pub struct Cvars {
    engine: Engine,
    handles: Vec<Option<Variable>>,
}

impl Cvars {
    /// Registers every cvar of the table. Doing it again applies the latched values.
    pub fn register(engine: Engine) -> Cvars {
        let handles = TABLE
            .iter()
            .map(|spec| {
                let cvar = engine.cvar_get(spec.name, spec.default, spec.flags)?;
                if let Some(range) = spec.range {
                    engine.cvar_check_range(cvar, range.min, range.max, range.integral);
                }
                engine.cvar_describe(cvar, spec.description);
                Some(cvar)
            })
            .collect();
        Cvars { engine, handles }
    }

    fn handle(&self, cvar: Cvar) -> Option<Variable> {
        self.handles.get(cvar as usize).copied().flatten()
    }

    /// The value as an integer, as the engine parsed it; 0 if the engine has no such cvar.
    pub fn integer(&self, cvar: Cvar) -> i32 {
        self.handle(cvar)
            .map_or(0, |handle| self.engine.cvar_as_integer(handle))
    }

    /// The value as a number, with anything that is not finite taken for 0.
    pub fn value(&self, cvar: Cvar) -> f32 {
        let value = self
            .handle(cvar)
            .map_or(0.0, |handle| self.engine.cvar_as_number(handle));
        if value.is_finite() { value } else { 0.0 }
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

    /// Whether the value changed since [`Cvars::seen`] was last called.
    pub fn modified(&self, cvar: Cvar) -> bool {
        self.handle(cvar)
            .is_some_and(|handle| self.engine.cvar_modified(handle))
    }

    /// Marks the change as consumed.
    pub fn seen(&self, cvar: Cvar) {
        if let Some(handle) = self.handle(cvar) {
            self.engine.cvar_seen(handle);
        }
    }

    /// Sets a variable of the table.
    pub fn set(&self, engine: Engine, cvar: Cvar, value: &str) {
        if let Some(spec) = TABLE.get(cvar as usize) {
            engine.cvar_set(spec.name, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Names, defaults and flags as Debian's opengl1 registers them (its log), one per line. `-` is the empty string.
    const KNOWN: &str = include_str!("known_cvars.txt");

    fn flag_bits(letters: &str) -> i32 {
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

    #[test]
    fn every_known_cvar_is_there_with_its_default_and_flags() {
        let mut rows = 0;
        for line in KNOWN.lines().filter(|line| !line.starts_with('#')) {
            let [name, default, flags] = line.split_whitespace().collect::<Vec<_>>()[..] else {
                panic!("bad row {line:?}")
            };
            let default = if default == "-" { "" } else { default };
            let spec = TABLE
                .iter()
                .find(|spec| spec.name.to_str() == Ok(name))
                .unwrap_or_else(|| panic!("{name} is missing"));
            assert_eq!(spec.default.to_str(), Ok(default), "default of {name}");
            assert_eq!(spec.flags, flag_bits(flags), "flags of {name}");
            rows += 1;
        }
        assert_eq!(rows, 107);
    }

    #[test]
    fn names_are_unique_whatever_their_case() {
        let names: HashSet<_> = TABLE
            .iter()
            .map(|spec| spec.name.to_bytes().to_ascii_lowercase())
            .collect();
        assert_eq!(names.len(), TABLE.len());
    }

    #[test]
    fn defaults_are_within_their_ranges() {
        for spec in TABLE {
            let Some(range) = spec.range else { continue };
            let value: f32 = spec.default.to_str().unwrap().parse().unwrap_or(0.0);
            assert!(range.min <= value && value <= range.max, "{:?}", spec.name);
            assert!(!range.integral || value.fract() == 0.0, "{:?}", spec.name);
        }
    }

    #[test]
    fn each_has_a_description() {
        for spec in TABLE {
            assert!(spec.description.to_bytes().len() > 10, "{:?}", spec.name);
        }
    }

    #[test]
    fn the_documentation_lists_each_with_its_default() {
        let text = include_str!("../../../docs/settings.md");
        for spec in TABLE {
            let (name, default) = (spec.name.to_str().unwrap(), spec.default.to_str().unwrap());
            let start = match default {
                "" => format!("| `{name}` |  | "),
                default => format!("| `{name}` | `{default}` | "),
            };
            let rows = text.lines().filter(|line| line.starts_with(&start));
            assert_eq!(rows.count(), 1, "{name} in docs/settings.md");
        }
    }
}
