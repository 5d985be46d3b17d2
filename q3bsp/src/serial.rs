//! Forms of fields in text formats such as JSON, which have no NaN, no infinity and no bytes.
//!
//! A number that is not finite is a string with its bits in hexadecimal, `"0x7fc00000"`. Bytes are Base64 (RFC 4648,
//! section 4). Binary formats store both as they are. For `serde(with = "crate::serial")`.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::{Vec2, Vec3};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A type with a form of its own.
pub(crate) trait Field: Sized {
    type Form: Serialize + DeserializeOwned;
    fn form(&self) -> Self::Form;
    fn of(form: Self::Form) -> Self;
}

pub(crate) fn serialize<T: Field, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    value.form().serialize(to)
}

pub(crate) fn deserialize<'de, T: Field, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    T::Form::deserialize(from).map(T::of)
}

/// A number that may be NaN or infinite.
#[derive(Clone, Copy)]
pub(crate) struct Number(f32);

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        if self.0.is_finite() || !to.is_human_readable() {
            to.serialize_f32(self.0)
        } else {
            to.collect_str(&format_args!("{:#010x}", self.0.to_bits()))
        }
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Number, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "expected a number")]
        enum Text {
            Finite(f32),
            Bits(String),
        }
        if !from.is_human_readable() {
            return f32::deserialize(from).map(Number);
        }
        match Text::deserialize(from)? {
            Text::Finite(number) => Ok(Number(number)),
            Text::Bits(text) => {
                let bits = text.strip_prefix("0x");
                let bits = bits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
                let number = bits.map(|bits| Number(f32::from_bits(bits)));
                number.ok_or_else(|| D::Error::custom("expected a number"))
            }
        }
    }
}

/// Bytes of any container.
#[derive(Clone)]
pub(crate) struct Bytes<B>(pub B);

impl<B: AsRef<[u8]>> Serialize for Bytes<B> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let bytes = self.0.as_ref();
        if to.is_human_readable() {
            to.serialize_str(&STANDARD.encode(bytes))
        } else {
            bytes.serialize(to)
        }
    }
}

impl<'de, B: TryFrom<Vec<u8>>> Deserialize<'de> for Bytes<B> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Bytes<B>, D::Error> {
        let bytes = if from.is_human_readable() {
            let decoded = STANDARD.decode(String::deserialize(from)?);
            decoded.map_err(|problem| D::Error::custom(format!("Base64: {problem}")))?
        } else {
            Vec::deserialize(from)?
        };
        let length = bytes.len();
        let other = |_| D::Error::invalid_length(length, &std::any::type_name::<B>());
        B::try_from(bytes).map(Bytes).map_err(other)
    }
}

macro_rules! fields {
    ($($type:ty, $form:ty, $to:expr, $of:expr;)+) => { $(
        impl Field for $type {
            type Form = $form;
            fn form(&self) -> $form {
                $to(self.clone())
            }
            fn of(form: $form) -> $type {
                $of(form)
            }
        }
    )+ };
}
fields! {
    f32, Number, Number, |form: Number| form.0;
    Vec2, [Number; 2], |v: Vec2| v.to_array().map(Number), |form: [Number; 2]| form.map(|n| n.0).into();
    Vec3, [Number; 3], |v: Vec3| v.to_array().map(Number), |form: [Number; 3]| form.map(|n| n.0).into();
    Vec<u8>, Bytes<Vec<u8>>, Bytes, |form: Bytes<_>| form.0;
    Box<[u8]>, Bytes<Box<[u8]>>, Bytes, |form: Bytes<_>| form.0;
    [u8; 64], Bytes<[u8; 64]>, Bytes, |form: Bytes<_>| form.0;
}

impl<T: Field> Field for Option<T> {
    type Form = Option<T::Form>;
    fn form(&self) -> Self::Form {
        self.as_ref().map(T::form)
    }
    fn of(form: Self::Form) -> Self {
        form.map(T::of)
    }
}

impl<T: Field, const N: usize> Field for [T; N]
where
    [T::Form; N]: Serialize + DeserializeOwned,
{
    type Form = [T::Form; N];
    fn form(&self) -> Self::Form {
        self.each_ref().map(T::form)
    }
    fn of(form: Self::Form) -> Self {
        form.map(T::of)
    }
}
