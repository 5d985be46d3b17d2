//! The formats that are read, and how they are distinguished.

use crate::bytes::Fields;
use crate::container::LumpRange;
use crate::error::{Error, Lump};

/// A map format. All are read into the same [`crate::Bsp`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "&'static str", try_from = "String"))]
#[non_exhaustive]
pub enum Format {
    /// `IBSP` version 46: Quake III Arena and the games and mods made with its engine.
    #[default]
    Ibsp46,
    /// `IBSP` version 47: Return to Castle Wolfenstein and Enemy Territory. As version 46 with fog that fills the
    /// world and, in Enemy Territory, foliage.
    Ibsp47,
    /// `IBSP` version 47 with an eighteenth lump, the advertisements of Quake Live.
    QuakeLive,
    /// `RBSP` version 1: Jedi Outcast, Jedi Academy, Soldier of Fortune II. Up to four light styles per surface,
    /// vertex and grid point.
    Rbsp,
    /// `FBSP` version 1: QFusion (Warsow, Warfork). As `RBSP` with lightmap pages of 512 × 512 texels.
    Fbsp,
    /// `IBSP` version 38: Quake II. Written as `FBSP`, as are all that follow: see `quake::QuakeMap`.
    Quake2,
    /// `QBSP` version 38: Quake II with 32-bit indices.
    Qbism,
    /// Version 29: Quake.
    Quake,
    /// `BSP2`: Quake with 32-bit indices.
    Bsp2,
    /// `2PSB`: Quake with 32-bit indices and 16-bit bounds.
    TwoPsb,
    /// Version 30: GoldSrc (Half-Life).
    GoldSrc,
}

#[cfg(feature = "serde")]
impl From<Format> for &'static str {
    fn from(format: Format) -> &'static str {
        format.name()
    }
}

#[cfg(feature = "serde")]
impl TryFrom<String> for Format {
    type Error = String;
    fn try_from(name: String) -> Result<Format, String> {
        let found = Format::ALL.into_iter().find(|f| f.name() == name);
        found.ok_or_else(|| format!("unknown format {name:?}"))
    }
}

impl Format {
    /// All formats.
    pub const ALL: [Format; 11] = [
        Format::Ibsp46,
        Format::Ibsp47,
        Format::QuakeLive,
        Format::Rbsp,
        Format::Fbsp,
        Format::Quake2,
        Format::Qbism,
        Format::Quake,
        Format::Bsp2,
        Format::TwoPsb,
        Format::GoldSrc,
    ];

    /// Whether the file holds faces with edges instead of surfaces: the formats of the module `quake`.
    pub fn is_quake(self) -> bool {
        matches!(
            self,
            Format::Quake2
                | Format::Qbism
                | Format::Quake
                | Format::Bsp2
                | Format::TwoPsb
                | Format::GoldSrc
        )
    }

    /// Whether it is Quake II's or its extension.
    #[cfg(feature = "quake")]
    pub(crate) fn is_quake2(self) -> bool {
        matches!(self, Format::Quake2 | Format::Qbism)
    }

    /// The format that [`crate::Bsp::write`] gives a map of this one.
    pub fn written(self) -> Format {
        if self.is_quake() { Format::Fbsp } else { self }
    }

    /// The format that a file announces; `None` when it is none of those that are read.
    pub fn of(bytes: &[u8]) -> Option<Format> {
        announced(bytes).ok()
    }

    /// Name for people: identification, version and games.
    pub fn name(self) -> &'static str {
        match self {
            Format::Ibsp46 => "IBSP 46 (Quake III)",
            Format::Ibsp47 => "IBSP 47 (RTCW, Enemy Territory)",
            Format::QuakeLive => "IBSP 47 (Quake Live)",
            Format::Rbsp => "RBSP 1 (Raven)",
            Format::Fbsp => "FBSP 1 (QFusion)",
            Format::Quake2 => "IBSP 38 (Quake II)",
            Format::Qbism => "QBSP 38 (Quake II, extended)",
            Format::Quake => "BSP 29 (Quake)",
            Format::Bsp2 => "BSP2 (Quake, extended)",
            Format::TwoPsb => "2PSB (Quake, extended)",
            Format::GoldSrc => "BSP 30 (GoldSrc)",
        }
    }

    /// Texels per side of a lightmap page.
    pub fn lightmap_size(self) -> usize {
        match self {
            Format::Ibsp46 | Format::Ibsp47 | Format::QuakeLive | Format::Rbsp => 128,
            _ => 512,
        }
    }

    /// Whether surfaces, vertices and grid points have up to four layers of light ([`crate::Layers`]).
    pub fn has_layers(self) -> bool {
        !matches!(self, Format::Ibsp46 | Format::Ibsp47 | Format::QuakeLive)
    }

    /// The lumps in directory order, as written.
    pub fn lumps(self) -> &'static [Lump] {
        match self {
            Format::Ibsp46 | Format::Ibsp47 => &Lump::ALL,
            Format::QuakeLive => &QUAKE_LIVE_LUMPS,
            _ => &RAVEN_LUMPS,
        }
    }

    /// Bytes of the header: identification, version and directory.
    pub(crate) fn header_bytes(self) -> usize {
        8 + 8 * self.lumps().len()
    }

    /// Identification and version as they begin a file.
    pub(crate) fn magic(self) -> (&'static [u8; 4], i32) {
        match self {
            Format::Ibsp46 => (b"IBSP", 46),
            Format::Ibsp47 | Format::QuakeLive => (b"IBSP", 47),
            Format::Rbsp => (b"RBSP", 1),
            _ => (b"FBSP", 1),
        }
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

const fn with_eighteenth(lump: Lump) -> [Lump; 18] {
    let mut lumps = [lump; 18];
    if let Some((common, _)) = lumps.split_first_chunk_mut() {
        *common = Lump::ALL;
    }
    lumps
}

const RAVEN_LUMPS: [Lump; 18] = with_eighteenth(Lump::LightArray);
const QUAKE_LIVE_LUMPS: [Lump; 18] = with_eighteenth(Lump::Advertisements);

/// The format that identification and version announce.
pub(crate) fn announced(bytes: &[u8]) -> Result<Format, Error> {
    let (Some(ident), Some(version)) = (bytes.first_chunk::<4>(), bytes.get(4..8)) else {
        return Err(Error::TooShort {
            found: bytes.len(),
            needed: Format::Ibsp46.header_bytes(),
        });
    };
    let version = Fields::new(version).i32();
    let known = match (ident, version) {
        (b"IBSP", 46) => return Ok(Format::Ibsp46),
        (b"IBSP", 47) if has_advertisements(bytes) => return Ok(Format::QuakeLive),
        (b"IBSP", 47) => return Ok(Format::Ibsp47),
        (b"RBSP", 1) => return Ok(Format::Rbsp),
        (b"FBSP", 1) => return Ok(Format::Fbsp),
        (b"IBSP", 38) => return Ok(Format::Quake2),
        (b"QBSP", 38) => return Ok(Format::Qbism),
        (b"IBSP", 43..=45) => "a Quake III test version",
        (b"IBSP", 48) => "Iron Grip: Warlord",
        (b"IBSP", 666) => "Dark Salvation",
        (b"IBSP", _) if version == 46i32.swap_bytes() => "big-endian",
        (b"PSBI", _) => "big-endian",
        (b"FAKK" | b"2015" | b"EF2!", _) => "Ritual's format",
        (b"VBSP", _) => "Source",
        (b"BSP2", _) => return Ok(Format::Bsp2),
        (b"2PSB", _) => return Ok(Format::TwoPsb),
        ([29, 0, 0, 0], _) => return Ok(Format::Quake),
        ([30, 0, 0, 0], _) => return Ok(Format::GoldSrc),
        (b"PK\x03\x04", _) => "a zip archive",
        _ => "unknown",
    };
    Err(Error::WrongFormat {
        found: format!("\"{}\" version {version} ({known})", ident.escape_ascii()),
    })
}

/// Whether an `IBSP` 47 file has the eighteenth lump of Quake Live: RTCW and Enemy Territory have the same version
/// and no such lump, so that the entry must lie before all data, and be one.
fn has_advertisements(bytes: &[u8]) -> bool {
    let entry = |at: usize| -> Option<LumpRange> {
        let (offset, length) = bytes
            .get(8 + at * 8..16 + at * 8)?
            .split_first_chunk::<4>()?;
        Some(LumpRange {
            offset: i32::from_le_bytes(*offset),
            length: i32::from_le_bytes(*length.first_chunk::<4>()?),
        })
    };
    let first_data = (0..Lump::ALL.len())
        .filter_map(entry)
        .filter(|range| range.length > 0)
        .map(|range| i64::from(range.offset))
        .min();
    let header = Format::QuakeLive.header_bytes() as i64;
    let Some(entry) = entry(Lump::ALL.len()) else {
        return false; // the file ends before it
    };
    first_data.is_some_and(|first| first >= header)
        && entry.length > 0
        && entry.length % 128 == 0
        && i64::from(entry.offset) >= header
        && i64::from(entry.offset) + i64::from(entry.length) <= bytes.len() as i64
}
