//! A row of the table of settings.

use super::Settings;
use super::value::Given;

/// Flags of a console variable: bits of [`Spec::flags`].
pub mod flags {
    /// None.
    pub const NONE: u8 = 0;
    /// The engine stores the value in its configuration.
    pub const ARCHIVE: u8 = 1;
    /// A player's change takes effect at a restart of the renderer.
    pub const LATCH: u8 = 2;
    /// Only the renderer sets it.
    pub const ROM: u8 = 4;
    /// The engine never stores the value.
    pub const TEMP: u8 = 8;
    /// A player can change it only if cheats are allowed.
    pub const CHEAT: u8 = 16;
    /// Each flag with its letter in documentation.
    pub const LETTERS: [(u8, char); 5] = [
        (ARCHIVE, 'A'),
        (LATCH, 'L'),
        (ROM, 'R'),
        (TEMP, 'T'),
        (CHEAT, 'C'),
    ];
}

/// Type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number.
    Whole,
    /// A number, which may have a fraction.
    Number,
    /// One of these names, in any case.
    Name(&'static [&'static str]),
    /// Any text.
    Text,
}

/// Limits of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// The engine enforces the limits. Otherwise the front end writes the limit to a variable beyond it, as the
    /// engine's own renderer does.
    pub by_engine: bool,
}

/// Limits enforced by the engine.
pub const fn kept(min: f32, max: f32) -> Option<Range> {
    let by_engine = true;
    Some(Range {
        min,
        max,
        by_engine,
    })
}

/// Limits enforced by the front end.
pub(super) const fn written_back(min: f32, max: f32) -> Option<Range> {
    let by_engine = false;
    Some(Range {
        min,
        max,
        by_engine,
    })
}

/// A console variable.
#[derive(Debug)]
pub struct Spec {
    /// As the engine spells it.
    pub name: &'static str,
    /// Type of the value.
    pub kind: Kind,
    /// Default.
    pub default: &'static str,
    /// Bits of [`flags`].
    pub flags: u8,
    /// Limits, if it has any.
    pub range: Option<Range>,
    /// Help text of the console.
    pub help: &'static str,
}

impl Spec {
    /// Letters of the flags.
    pub fn letters(&self) -> String {
        let set = flags::LETTERS
            .iter()
            .filter(|(bit, _)| self.flags & bit != 0);
        set.map(|(_, letter)| letter).collect()
    }

    /// The error for an invalid text.
    fn refused(&self, text: &str) -> SettingError {
        SettingError {
            name: self.name,
            text: text.to_owned(),
            expected: self.expected(),
        }
    }

    /// Description of the valid values: "a whole number from 0 to 2".
    fn expected(&self) -> String {
        let kind = match self.kind {
            Kind::Whole => "a whole number".to_owned(),
            Kind::Number => "a number".to_owned(),
            Kind::Name(names) => format!("one of {}", names.join(", ")),
            Kind::Text => "text".to_owned(),
        };
        match self.range {
            None => kind,
            Some(Range { min, max, .. }) if max == f32::MAX => format!("{kind} from {min} on"),
            Some(Range { min, max, .. }) => format!("{kind} from {min} to {max}"),
        }
    }

    /// Whether a text is a valid value within the limits.
    fn allows(&self, text: &str) -> bool {
        let given = Given::parse(text);
        let is_value = match self.kind {
            Kind::Whole => text.parse::<i32>().is_ok(),
            Kind::Number => text.parse().is_ok_and(f32::is_finite),
            Kind::Name(names) => names.iter().any(|name| name.eq_ignore_ascii_case(text)),
            Kind::Text => true,
        };
        is_value && given.within(self.range) == given
    }
}

/// When a front end reads a setting's variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Each frame.
    Frame,
    /// When the renderer starts.
    Start,
    /// When the renderer starts, and when this variable has changed.
    With(&'static str),
}

/// What a changed setting does to the picture that `rt_accumulate` averages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accumulation {
    /// The mean picture is another one: accumulation starts again.
    Restarts,
    /// Accumulation goes on: the setting has no effect on the traced light, or the scene's data change with it.
    GoesOn,
}

/// A setting: a field of [`Settings`] and its console variable.
#[derive(Debug)]
pub struct Row {
    /// The variable.
    pub spec: Spec,
    /// When it is read.
    pub reading: Reading,
    /// Whether a change restarts accumulation.
    pub accumulation: Accumulation,
    pub(super) put: fn(&mut Settings, &Given<'_>) -> bool,
    pub(super) text: fn(&Settings) -> String,
}

/// A text that is no value of a setting.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} {text}: not {expected}")]
pub struct SettingError {
    name: &'static str,
    text: String,
    expected: String,
}

impl Row {
    /// Takes a value over, brought within the limits.
    ///
    /// # Errors
    /// It is no name that the setting has. Nothing changes.
    pub fn put(&self, settings: &mut Settings, given: &Given<'_>) -> Result<(), SettingError> {
        match (self.put)(settings, &given.within(self.spec.range)) {
            true => Ok(()),
            false => Err(self.spec.refused(given.text)),
        }
    }

    /// The current value as text, which [`put`](Self::put) accepts.
    pub fn text(&self, settings: &Settings) -> String {
        (self.text)(settings)
    }

    /// Puts the default back.
    pub fn reset(&self, settings: &mut Settings) {
        (self.put)(settings, &Given::parse(self.spec.default));
    }

    /// Refuses a text that is no value of the setting within its limits.
    ///
    /// # Errors
    /// The text is none.
    pub fn check(&self, text: &str) -> Result<(), SettingError> {
        match self.spec.allows(text) {
            true => Ok(()),
            false => Err(self.spec.refused(text)),
        }
    }
}
