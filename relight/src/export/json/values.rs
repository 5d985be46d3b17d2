//! Rust values as JSON and back, without loss.
//!
//! Numbers are written with as many digits as tell them from their neighbours. JSON has no NaN and no infinity, and maps
//! have both: such a number becomes a string of its bits, `"0x7fc00000"`. Bytes are Base64 (RFC 4648, section 4).

use glam::{Vec2, Vec3};
use serde_json::Value;
use std::fmt::Write as _;

/// What is wrong with a document: where, and what was expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {expected} expected")]
pub struct JsonError {
    /// Keys and indices from the root, such as `map.nodes[3].plane`.
    pub path: String,
    /// What should be there.
    pub expected: String,
}

impl JsonError {
    pub(super) fn new(expected: impl Into<String>) -> JsonError {
        JsonError {
            path: String::new(),
            expected: expected.into(),
        }
    }

    pub(super) fn inside(mut self, part: &str) -> JsonError {
        let dot = if self.path.is_empty() || self.path.starts_with('[') {
            ""
        } else {
            "."
        };
        self.path = format!("{part}{dot}{}", self.path);
        self
    }
}

/// A value that JSON can hold.
pub(super) trait Json: Sized {
    /// Appends it.
    fn put(&self, out: &mut String);
    /// Reads it.
    fn get(value: &Value) -> Result<Self, JsonError>;
}

/// Reads a key of an object.
pub(super) fn field<T: Json>(object: &Value, key: &str) -> Result<T, JsonError> {
    match object.get(key) {
        Some(value) => T::get(value).map_err(|problem| problem.inside(key)),
        None => Err(JsonError::new(format!("the key {key:?}"))),
    }
}

/// Appends a number, which writing to a string cannot fail at.
pub(super) fn put_display(out: &mut String, value: impl std::fmt::Display) {
    let _ = write!(out, "{value}");
}

/// Makes objects of structs: every field under its own name.
macro_rules! objects {
    ($($name:ident { $($field:ident),+ $(,)? })+) => { $(
        impl Json for $name {
            fn put(&self, out: &mut String) {
                let mut comma = '{';
                $(
                    out.push(std::mem::replace(&mut comma, ','));
                    out.push_str(concat!('"', stringify!($field), "\":"));
                    self.$field.put(out);
                )+
                let _ = comma;
                out.push('}');
            }
            fn get(value: &Value) -> Result<Self, JsonError> {
                Ok($name { $($field: field(value, stringify!($field))?),+ })
            }
        }
    )+ };
}
pub(super) use objects;

macro_rules! integers {
    ($($type:ty)+) => { $(
        impl Json for $type {
            fn put(&self, out: &mut String) {
                put_display(out, self);
            }
            fn get(value: &Value) -> Result<Self, JsonError> {
                let number = value.as_i64().and_then(|n| <$type>::try_from(n).ok());
                number.ok_or_else(|| JsonError::new(concat!("a number of type ", stringify!($type))))
            }
        }
    )+ };
}
integers!(i32 u32 u16 usize);

impl Json for f32 {
    fn put(&self, out: &mut String) {
        if self.is_finite() {
            // Rust writes the shortest digits that read back as the same number.
            put_display(out, self);
        } else {
            let _ = write!(out, "\"{:#010x}\"", self.to_bits());
        }
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let bits = |text: &str| u32::from_str_radix(text.strip_prefix("0x")?, 16).ok();
        match value {
            // By its digits: by way of a double it would be rounded twice.
            Value::Number(number) => number.to_string().parse().ok(),
            Value::String(text) => bits(text).map(f32::from_bits),
            _ => None,
        }
        .ok_or_else(|| JsonError::new("a number"))
    }
}

impl Json for bool {
    fn put(&self, out: &mut String) {
        put_display(out, self);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        value
            .as_bool()
            .ok_or_else(|| JsonError::new("true or false"))
    }
}

impl Json for String {
    fn put(&self, out: &mut String) {
        self.as_str().write(out);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let text = value.as_str().map(str::to_owned);
        text.ok_or_else(|| JsonError::new("a string"))
    }
}

/// Text that is only written.
pub(super) trait WriteText {
    /// Appends it in quotation marks.
    fn write(&self, out: &mut String);
}

impl WriteText for str {
    fn write(&self, out: &mut String) {
        out.push('"');
        for c in self.chars() {
            match c {
                '"' | '\\' => out.extend(['\\', c]),
                '\n' => out.push_str("\\n"),
                c if c < ' ' => {
                    let _ = write!(out, "\\u{:04x}", u32::from(c));
                }
                c => out.push(c),
            }
        }
        out.push('"');
    }
}

impl<T: Json> Json for Option<T> {
    fn put(&self, out: &mut String) {
        match self {
            Some(value) => value.put(out),
            None => out.push_str("null"),
        }
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        match value {
            Value::Null => Ok(None),
            value => T::get(value).map(Some),
        }
    }
}

/// Appends a list.
pub(super) fn put_list<T>(
    out: &mut String,
    items: impl IntoIterator<Item = T>,
    mut put: impl FnMut(T, &mut String),
) {
    out.push('[');
    for (at, item) in items.into_iter().enumerate() {
        if at > 0 {
            out.push(',');
        }
        put(item, out);
    }
    out.push(']');
}

impl<T: Json> Json for Vec<T> {
    fn put(&self, out: &mut String) {
        put_list(out, self, |item, out| item.put(out));
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let list = value.as_array().ok_or_else(|| JsonError::new("a list"))?;
        let item =
            |(at, value)| T::get(value).map_err(|problem| problem.inside(&format!("[{at}]")));
        list.iter().enumerate().map(item).collect()
    }
}

impl<T: Json, const N: usize> Json for [T; N] {
    fn put(&self, out: &mut String) {
        put_list(out, self, |item, out| item.put(out));
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let list = Vec::<T>::get(value)?;
        let count = list.len();
        let array = list.try_into();
        array.map_err(|_| JsonError::new(format!("{N} values instead of {count}")))
    }
}

impl Json for Vec2 {
    fn put(&self, out: &mut String) {
        self.to_array().put(out);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        Json::get(value).map(Vec2::from_array)
    }
}

impl Json for Vec3 {
    fn put(&self, out: &mut String) {
        self.to_array().put(out);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        Json::get(value).map(Vec3::from_array)
    }
}

/// Bytes as Base64.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Bytes(pub Vec<u8>);

const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Appends bytes as Base64 in quotation marks.
pub(super) fn put_bytes(out: &mut String, bytes: &[u8]) {
    out.push('"');
    for chunk in bytes.chunks(3) {
        let byte = |at: usize| u32::from(chunk.get(at).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for digit in 0..4 {
            let value = (bits >> (18 - 6 * digit)) as usize & 63;
            let used = digit <= chunk.len();
            let letter = DIGITS.get(value).copied().unwrap_or(b'A');
            out.push(if used { char::from(letter) } else { '=' });
        }
    }
    out.push('"');
}

impl Json for Bytes {
    fn put(&self, out: &mut String) {
        put_bytes(out, &self.0);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let decode = |text: &str| -> Option<Vec<u8>> {
            let text = text.trim_end_matches('=').as_bytes();
            let mut bytes = Vec::with_capacity(text.len() * 3 / 4);
            for chunk in text.chunks(4) {
                let mut bits = 0u32;
                for at in 0..4 {
                    let value = match chunk.get(at) {
                        Some(letter) => DIGITS.iter().position(|d| d == letter)?,
                        None => 0,
                    };
                    bits = bits << 6 | value as u32;
                }
                let [_, decoded @ ..] = bits.to_be_bytes();
                bytes.extend(decoded.iter().take(chunk.len().checked_sub(1)?));
            }
            Some(bytes)
        };
        let bytes = value.as_str().and_then(decode).map(Bytes);
        bytes.ok_or_else(|| JsonError::new("bytes as Base64"))
    }
}

/// Bytes of a fixed number: few as numbers, many as Base64.
macro_rules! byte_arrays {
    ($($count:literal)+) => { $(
        impl Json for [u8; $count] {
            fn put(&self, out: &mut String) {
                match $count {
                    0..8 => put_list(out, self, |byte, out| put_display(out, byte)),
                    _ => put_bytes(out, self),
                }
            }
            fn get(value: &Value) -> Result<Self, JsonError> {
                let bytes = match value {
                    Value::Array(list) => {
                        let byte = |v: &Value| v.as_u64().and_then(|n| u8::try_from(n).ok());
                        list.iter().map(byte).collect()
                    }
                    other => Bytes::get(other).ok().map(|bytes| bytes.0),
                };
                let array = bytes.and_then(|bytes: Vec<u8>| bytes.try_into().ok());
                array.ok_or_else(|| JsonError::new(concat!(stringify!($count), " bytes")))
            }
        }
    )+ };
}
byte_arrays!(3 4 64);

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back<T: Json + PartialEq + std::fmt::Debug>(value: &T) {
        let mut text = String::new();
        value.put(&mut text);
        let parsed = serde_json::from_str(&text).unwrap();
        assert_eq!(&T::get(&parsed).unwrap(), value, "{text}");
    }

    #[test]
    fn numbers_keep_their_bits() {
        for bits in [
            0,
            1,
            0x8000_0000,
            0x7f7f_ffff,
            0x3dcc_cccd,
            0x4b80_0001,
            0x0080_0000,
            0xff80_0000,
            0x7fc1_2345,
        ] {
            let mut text = String::new();
            f32::from_bits(bits).put(&mut text);
            let parsed: Value = serde_json::from_str(&text).unwrap();
            assert_eq!(f32::get(&parsed).unwrap().to_bits(), bits, "{text}");
        }
        there_and_back(&vec![i32::MIN, -1, i32::MAX]);
        there_and_back(&u32::MAX);
    }

    #[test]
    fn bytes_are_base64() {
        for (bytes, text) in [
            (&b""[..], "\"\""),
            (b"f", "\"Zg==\""),
            (b"fo", "\"Zm8=\""),
            (b"foobar", "\"Zm9vYmFy\""),
        ] {
            let mut out = String::new();
            put_bytes(&mut out, bytes);
            assert_eq!(out, text);
            there_and_back(&Bytes(bytes.to_vec()));
        }
        there_and_back(&[7u8; 64]);
        there_and_back(&[1u8, 2, 3]);
        assert!(Bytes::get(&Value::from("a b")).is_err());
    }

    #[test]
    fn text_is_escaped() {
        there_and_back(&"\"quoted\" \\ \n\t\u{1}\u{7f} ä".to_owned());
        there_and_back(&Some(vec![Vec3::X]));
        there_and_back(&None::<bool>);
    }
}
