//! The file around the lumps: kept so that an unchanged map is written back byte for byte.

use crate::bytes::Fields;
use crate::error::{Error, Lump};

/// Most directory entries that a format read here has.
pub(crate) const SLOTS: usize = 18;

/// Where a lump lies in the file, by the directory. Empty lumps may have any offset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LumpRange {
    /// Bytes from the start of the file.
    pub offset: i32,
    /// Length in bytes.
    pub length: i32,
}

impl LumpRange {
    /// Reads an entry of the directory of a file with this length.
    pub(crate) fn read(
        fields: &mut Fields<'_>,
        lump: Lump,
        file_length: usize,
    ) -> Result<LumpRange, Error> {
        let (offset, length) = (fields.i32(), fields.i32());
        let end = i64::from(offset) + i64::from(length);
        if length == 0 || (offset >= 0 && length > 0 && end <= file_length as i64) {
            return Ok(LumpRange { offset, length });
        }
        Err(Error::LumpOutsideFile {
            lump,
            offset,
            length,
            file_length,
        })
    }
}

/// A lump as the directory of a file has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LumpEntry {
    /// The lump.
    pub lump: Lump,
    /// Where it lies.
    pub range: LumpRange,
    /// Bytes per record; 1 for text, pictures and compressed data.
    pub stride: usize,
}

/// Bytes that belong to no lump: an eighteenth directory entry, a compiler's banner, padding.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gap {
    /// Bytes from the start of the file.
    pub offset: usize,
    /// What is there.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub bytes: Vec<u8>,
}

/// A value that was replaced on reading. [`crate::Bsp::write`] puts the original back as long as the
/// replacement is still there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Repair {
    /// The lump.
    pub lump: Lump,
    /// Index of the record.
    pub element: usize,
    /// Byte offset of the 32-bit field in the record.
    pub field_offset: usize,
    /// As stored in the file.
    pub original: i32,
    /// As found in the [`crate::Bsp`].
    pub replacement: i32,
}

/// The layout of the file a [`crate::Bsp`] was read from. The default (no file) makes
/// [`crate::Bsp::write`] use the compilers' usual order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Container {
    /// The directory, by [`Lump::index`].
    pub lumps: [LumpRange; SLOTS],
    /// Bytes of the header and the directory.
    pub header_length: usize,
    /// Bytes outside header and lumps, ascending.
    pub gaps: Vec<Gap>,
    /// Length of the file; 0 when the map was not read from one.
    pub file_length: usize,
    /// Bytes at the end of a lump that are no whole record, by [`Lump::index`]. For the visibility
    /// lump also everything that the matrix does not cover.
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub trailing: [Vec<u8>; SLOTS],
    /// Replaced values.
    pub repairs: Vec<Repair>,
}

impl Container {
    /// The bytes directly behind the header that no lump claims, where compilers leave their banner.
    pub fn banner(&self) -> &[u8] {
        match self.gaps.first() {
            Some(gap) if gap.offset == self.header_length => &gap.bytes,
            _ => &[],
        }
    }

    /// Keeps what follows the last whole record of a lump of the directory.
    pub(crate) fn set_trailing(&mut self, lump: Lump, rest: &[u8]) {
        if let Some(slot) = self.trailing.get_mut(lump.index()) {
            *slot = rest.to_vec();
        }
    }
}
