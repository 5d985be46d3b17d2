//! Converts values of console variables to values of fields.

use super::row::{Kind, Range};

/// The value of a console variable, as an engine parses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Given<'a> {
    /// As a whole number; 0 for text.
    pub integer: i32,
    /// As a finite number; 0 for text.
    pub number: f32,
    /// As text. Only settings of the kind [`Kind::Name`] read it.
    pub text: &'a str,
}

impl<'a> Given<'a> {
    /// Parses a text.
    pub fn parse(text: &'a str) -> Self {
        let number: f32 = text.parse().unwrap_or(0.0);
        Self {
            integer: text.parse().unwrap_or(number as i32),
            number: if number.is_finite() { number } else { 0.0 },
            text,
        }
    }

    /// The value within limits.
    pub(super) fn within(self, range: Option<Range>) -> Self {
        let Some(Range { min, max, .. }) = range else {
            return self;
        };
        Self {
            integer: self.integer.clamp(min as i32, max as i32),
            number: self.number.clamp(min, max),
            ..self
        }
    }
}

/// The type of a field of the settings.
pub(super) trait Value: Copy + Default {
    const KIND: Kind;
    /// `None` for an unknown name.
    fn of(given: &Given<'_>) -> Option<Self>;
    /// Distinct for distinct values.
    fn bits(self) -> u32;
    /// The value as text of its variable.
    fn text(self) -> String;

    /// The value of a row's default, which a test reads.
    fn default_of(text: &str) -> Self {
        Self::of(&Given::parse(text)).unwrap_or_default()
    }

    /// Sets the value, if `given` is valid.
    fn put(&mut self, given: &Given<'_>) -> bool {
        let value = Self::of(given);
        if let Some(value) = value {
            *self = value;
        }
        value.is_some()
    }
}

impl Value for bool {
    const KIND: Kind = Kind::Whole;
    fn of(given: &Given<'_>) -> Option<Self> {
        Some(given.integer != 0)
    }
    fn bits(self) -> u32 {
        self.into()
    }
    fn text(self) -> String {
        u32::from(self).to_string()
    }
}

/// Negative numbers are 0.
impl Value for u32 {
    const KIND: Kind = Kind::Whole;
    fn of(given: &Given<'_>) -> Option<Self> {
        Some(Self::try_from(given.integer).unwrap_or(0))
    }
    fn bits(self) -> u32 {
        self
    }
    fn text(self) -> String {
        self.to_string()
    }
}

impl Value for i32 {
    const KIND: Kind = Kind::Whole;
    fn of(given: &Given<'_>) -> Option<Self> {
        Some(given.integer)
    }
    fn bits(self) -> u32 {
        self.cast_unsigned()
    }
    fn text(self) -> String {
        self.to_string()
    }
}

impl Value for f32 {
    const KIND: Kind = Kind::Number;
    fn of(given: &Given<'_>) -> Option<Self> {
        Some(given.number)
    }
    fn bits(self) -> u32 {
        self.to_bits()
    }
    fn text(self) -> String {
        self.to_string()
    }
}

/// An enumeration by the numbers of its variable. All other numbers select the first value.
macro_rules! numbered {
    ($(#[$meta:meta])* $name:ident { $(#[$first_meta:meta])* $first:ident = $zero:expr,
        $( $(#[$value_meta:meta])* $value:ident = $number:expr, )* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
        #[repr(u32)]
        pub enum $name {
            $(#[$first_meta])* #[default] $first = $zero,
            $( $(#[$value_meta])* $value = $number, )*
        }

        impl Value for $name {
            const KIND: Kind = Kind::Whole;
            fn of(given: &Given<'_>) -> Option<Self> {
                let values = [$( Self::$value ),*];
                let found = values.into_iter().find(|v| Ok(*v as u32) == given.integer.try_into());
                Some(found.unwrap_or(Self::$first))
            }
            fn bits(self) -> u32 {
                self as u32
            }
            fn text(self) -> String {
                self.bits().to_string()
            }
        }
    };
}

/// An enumeration by the names of its variable. Any other text selects `$other`.
macro_rules! named {
    ($(#[$meta:meta])* $name:ident, other: $other:expr, { $( $(#[$value_meta:meta])* $value:ident = $text:literal, )* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
        pub enum $name { $( $(#[$value_meta])* $value, )* }

        impl $name {
            /// Its name.
            pub fn name(self) -> &'static str {
                match self { $( Self::$value => $text, )* }
            }
        }

        impl Value for $name {
            const KIND: Kind = Kind::Name(&[$( $text ),*]);
            fn of(given: &Given<'_>) -> Option<Self> {
                let values = [$( Self::$value ),*];
                let found = values.into_iter().find(|v| v.name().eq_ignore_ascii_case(given.text));
                found.or($other)
            }
            fn bits(self) -> u32 {
                self as u32
            }
            fn text(self) -> String {
                self.name().to_owned()
            }
        }
    };
}

pub(super) use {named, numbered};
