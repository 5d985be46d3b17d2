//! Little-endian fields of fixed-size records.

use glam::{Vec2, Vec3};

/// Reads fields of one record in order, and zeros beyond its end. Records in a file are cut out by their stride, so that
/// they do not end early.
pub(crate) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn new(record: &'a [u8]) -> Self {
        Fields(record)
    }

    pub(crate) fn bytes<const N: usize>(&mut self) -> [u8; N] {
        match self.0.split_first_chunk::<N>() {
            Some((head, rest)) => {
                self.0 = rest;
                *head
            }
            None => {
                self.0 = &[];
                [0; N]
            }
        }
    }

    pub(crate) fn u8(&mut self) -> u8 {
        let [byte] = self.bytes();
        byte
    }

    pub(crate) fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.bytes())
    }

    #[cfg(feature = "quake")]
    pub(crate) fn i16(&mut self) -> i16 {
        i16::from_le_bytes(self.bytes())
    }

    pub(crate) fn i32(&mut self) -> i32 {
        i32::from_le_bytes(self.bytes())
    }

    pub(crate) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    pub(crate) fn f32(&mut self) -> f32 {
        f32::from_bits(self.u32())
    }

    pub(crate) fn vec2(&mut self) -> Vec2 {
        Vec2::new(self.f32(), self.f32())
    }

    pub(crate) fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.f32(), self.f32(), self.f32())
    }

    pub(crate) fn ivec3(&mut self) -> [i32; 3] {
        [self.i32(), self.i32(), self.i32()]
    }
}

/// A record of fixed size in a lump.
pub(crate) trait Record: Sized {
    /// Bytes per record.
    const STRIDE: usize;
    /// Decodes one record of exactly [`Self::STRIDE`] bytes.
    fn decode(fields: Fields<'_>) -> Self;
    /// Appends exactly [`Self::STRIDE`] bytes.
    fn encode(&self, out: &mut Vec<u8>);
}

/// Appends fields of a record.
pub(crate) trait Put {
    fn put_i32(&mut self, value: i32);
    fn put_f32(&mut self, value: f32);

    fn put_vec2(&mut self, value: Vec2) {
        self.put_f32(value.x);
        self.put_f32(value.y);
    }

    fn put_vec3(&mut self, value: Vec3) {
        self.put_f32(value.x);
        self.put_f32(value.y);
        self.put_f32(value.z);
    }

    fn put_ivec3(&mut self, value: [i32; 3]) {
        for v in value {
            self.put_i32(v);
        }
    }
}

impl Put for Vec<u8> {
    fn put_i32(&mut self, value: i32) {
        self.extend_from_slice(&value.to_le_bytes());
    }

    fn put_f32(&mut self, value: f32) {
        self.extend_from_slice(&value.to_bits().to_le_bytes());
    }
}

/// The text of a 64-byte name field: up to the first NUL, or all of it.
pub(crate) fn name_text(raw: &[u8; 64]) -> String {
    let end = raw.iter().position(|&b| b == 0).unwrap_or(raw.len());
    String::from_utf8_lossy(raw.get(..end).unwrap_or(raw)).into_owned()
}

/// The field to write for a name: the bytes read, garbage after the NUL included, as long as they
/// still say the same; else the name, cut to 63 bytes so that the engine finds a NUL.
pub(crate) fn name_field(name: &str, raw: &[u8; 64]) -> [u8; 64] {
    if name_text(raw) == name {
        return *raw;
    }
    let mut field = [0; 64];
    for (to, &from) in field.iter_mut().take(63).zip(name.as_bytes()) {
        *to = from;
    }
    field
}
