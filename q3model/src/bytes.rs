//! Checked reading of records at offsets that the file itself names.

use crate::Error;
use glam::{Vec2, Vec3};

/// A part of a file that offsets are relative to.
#[derive(Clone, Copy)]
pub(crate) struct Region<'a> {
    file: &'a [u8],
    start: usize,
}

impl<'a> Region<'a> {
    pub(crate) fn new(file: &'a [u8], start: usize) -> Self {
        Region { file, start }
    }

    /// `count` records of `stride` bytes at `offset` from the start of the region.
    pub(crate) fn records(
        &self,
        what: impl Fn() -> String,
        offset: i32,
        count: usize,
        stride: usize,
    ) -> Result<&'a [u8], Error> {
        let length = (count as u64).saturating_mul(stride as u64);
        let start = self.start as i64 + i64::from(offset);
        if length == 0 {
            return Ok(&[]);
        }
        let slice = usize::try_from(start).ok().and_then(|start| {
            let end = start.checked_add(usize::try_from(length).ok()?)?;
            self.file.get(start..end)
        });
        slice.ok_or_else(|| Error::OutsideFile {
            what: what(),
            offset: start,
            length,
            file_length: self.file.len(),
        })
    }
}

/// Reads fields of one record in order. A record is cut out by its size beforehand, so that running
/// out of bytes cannot happen; it would read zeros.
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

    pub(crate) fn i32(&mut self) -> i32 {
        i32::from_le_bytes(self.bytes())
    }

    pub(crate) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    pub(crate) fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.bytes())
    }

    pub(crate) fn vec2(&mut self) -> Vec2 {
        Vec2::new(self.f32(), self.f32())
    }

    pub(crate) fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.f32(), self.f32(), self.f32())
    }

    /// A name in a field of fixed size: up to the first NUL, bytes that are not UTF-8 replaced.
    pub(crate) fn name<const N: usize>(&mut self) -> String {
        let field: [u8; N] = self.bytes();
        let text = field.split(|&b| b == 0).next().unwrap_or(&[]);
        String::from_utf8_lossy(text).into_owned()
    }
}

/// Bytes of a triangle in every format.
pub(crate) const TRIANGLE_BYTES: usize = 12;

/// Parts may overlap in a file, but together claim at most this many times its size.
const MAX_SHARING: u64 = 4;

/// Refuses files whose parts claim far more memory than there are bytes.
pub(crate) fn check_sharing(claimed: u64, file_length: usize) -> Result<(), Error> {
    if claimed > MAX_SHARING * file_length as u64 {
        return Err(Error::TooMuchSharing {
            claimed,
            file_length,
        });
    }
    Ok(())
}

/// That a file starts with this identification and version; a file too short for both fails at its header.
pub(crate) fn check_format(
    bytes: &[u8],
    ident: &[u8; 4],
    version: i32,
    expected: &'static str,
) -> Result<(), Error> {
    let found_ident = bytes.first_chunk::<4>();
    let found_version = bytes.get(4..8).and_then(|v| v.first_chunk::<4>());
    if let (Some(found_ident), Some(found_version)) = (found_ident, found_version) {
        let found_version = i32::from_le_bytes(*found_version);
        if found_ident != ident || found_version != version {
            return Err(Error::WrongFormat {
                found: format!("\"{}\" version {found_version}", found_ident.escape_ascii()),
                expected,
            });
        }
    }
    Ok(())
}

/// A count that must not be negative.
pub(crate) fn count(what: &str, value: i32) -> Result<usize, Error> {
    usize::try_from(value).map_err(|_| Error::Value {
        what: what.to_owned(),
        value: i64::from(value),
        expected: "but cannot be negative".to_owned(),
    })
}

/// Triangles of vertices `first` to `first + num_verts`, counted from `first`.
pub(crate) fn read_triangles(
    records: &[u8],
    first: u32,
    num_verts: usize,
    what: impl Fn(usize) -> String,
) -> Result<Vec<[u32; 3]>, Error> {
    let mut triangles = Vec::with_capacity(records.len() / TRIANGLE_BYTES);
    for (at, record) in records.chunks_exact(TRIANGLE_BYTES).enumerate() {
        let mut f = Fields::new(record);
        let mut triangle = [0; 3];
        for slot in &mut triangle {
            let corner = f.i32();
            *slot = u32::try_from(corner)
                .ok()
                .and_then(|corner| corner.checked_sub(first))
                .filter(|&corner| (corner as usize) < num_verts)
                .ok_or_else(|| Error::Value {
                    what: what(at),
                    value: i64::from(corner),
                    expected: format!("outside its {num_verts} vertices"),
                })?;
        }
        triangles.push(triangle);
    }
    Ok(triangles)
}
