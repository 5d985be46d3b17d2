//! Bytes to [`Bsp`]: the directory and the records. What they refer to is checked in `validate`.

use crate::bytes::Fields;
use crate::container::{Container, Gap, HEADER_BYTES, LumpRange};
use crate::error::{Error, Lump, Warning};
use crate::lumps::{LIGHTMAP_BYTES, Lightmap, Record};
use crate::{Bsp, Visibility};

impl Bsp {
    /// Reads and validates a map.
    ///
    /// # Errors
    /// Whatever the engine refuses (wrong format, odd lump sizes, missing world) and every reference
    /// that leads out of its lump, which the engine would follow. Oddities that the engine tolerates
    /// are in [`Bsp::warnings`].
    pub fn parse(bytes: &[u8]) -> Result<Bsp, Error> {
        let lumps = directory(bytes)?;
        let mut bsp = Bsp {
            container: Container {
                lumps,
                file_length: bytes.len(),
                ..Container::default()
            },
            ..Bsp::default()
        };
        bsp.find_gaps(bytes);

        let data = |lump: Lump| lump_bytes(bytes, lumps[lump.index()]);
        bsp.entities = data(Lump::Entities).to_vec();
        bsp.shaders = records(Lump::Shaders, data(Lump::Shaders))?;
        bsp.planes = records(Lump::Planes, data(Lump::Planes))?;
        bsp.nodes = records(Lump::Nodes, data(Lump::Nodes))?;
        bsp.leafs = records(Lump::Leafs, data(Lump::Leafs))?;
        bsp.leaf_surfaces = records(Lump::LeafSurfaces, data(Lump::LeafSurfaces))?;
        bsp.leaf_brushes = records(Lump::LeafBrushes, data(Lump::LeafBrushes))?;
        bsp.models = records(Lump::Models, data(Lump::Models))?;
        bsp.brushes = records(Lump::Brushes, data(Lump::Brushes))?;
        bsp.brush_sides = records(Lump::BrushSides, data(Lump::BrushSides))?;
        bsp.vertices = records(Lump::DrawVerts, data(Lump::DrawVerts))?;
        bsp.indices = records(Lump::DrawIndexes, data(Lump::DrawIndexes))?;
        bsp.fogs = records(Lump::Fogs, data(Lump::Fogs))?;
        bsp.surfaces = records(Lump::Surfaces, data(Lump::Surfaces))?;

        let (pages, rest) = split_records(data(Lump::Lightmaps), LIGHTMAP_BYTES);
        bsp.lightmaps = pages
            .chunks_exact(LIGHTMAP_BYTES)
            .map(|page| Lightmap(page.into()))
            .collect();
        bsp.keep_trailing(Lump::Lightmaps, rest, "the partial page is ignored");

        let (points, rest) = split_records(data(Lump::LightGrid), 8);
        bsp.light_grid = records(Lump::LightGrid, points)?;
        bsp.keep_trailing(Lump::LightGrid, rest, "the partial point is ignored");

        let (visibility, rest, oddity) = Visibility::decode(data(Lump::Visibility));
        bsp.visibility = visibility;
        bsp.container.trailing[Lump::Visibility.index()] = rest.to_vec();
        bsp.warnings.extend(oddity);

        bsp.validate()?;
        Ok(bsp)
    }

    fn keep_trailing(&mut self, lump: Lump, rest: &[u8], action: &'static str) {
        if !rest.is_empty() {
            self.container.trailing[lump.index()] = rest.to_vec();
            self.warnings.push(Warning {
                lump,
                element: None,
                field: "number of bytes after the last record",
                value: rest.len() as i64,
                action,
            });
        }
    }

    /// Collects the bytes that no lump claims, and notes lumps that share bytes.
    fn find_gaps(&mut self, bytes: &[u8]) {
        let mut ranges: Vec<(usize, usize, Lump)> = Lump::ALL
            .iter()
            .filter_map(|&lump| {
                let range = self.container.lumps[lump.index()];
                let start = usize::try_from(range.offset).ok()?;
                let length = usize::try_from(range.length).ok()?;
                (length > 0).then_some((start, start + length, lump))
            })
            .collect();
        ranges.sort_by_key(|&(start, end, _)| (start, end));
        let mut covered = HEADER_BYTES;
        for (start, end, lump) in ranges {
            if start < covered {
                self.warnings.push(Warning {
                    lump,
                    element: None,
                    field: "offset",
                    value: start as i64,
                    action: "inside the header or another lump; read all the same",
                });
            } else {
                self.push_gap(bytes, covered, start);
            }
            covered = covered.max(end);
        }
        self.push_gap(bytes, covered, bytes.len());
    }

    fn push_gap(&mut self, bytes: &[u8], start: usize, end: usize) {
        match bytes.get(start..end) {
            Some(gap) if !gap.is_empty() => self.container.gaps.push(Gap {
                offset: start,
                bytes: gap.to_vec(),
            }),
            _ => {}
        }
    }
}

/// Reads the header and checks that every lump lies inside the file.
fn directory(bytes: &[u8]) -> Result<[LumpRange; 17], Error> {
    if let Some(found) = foreign_format(bytes) {
        return Err(Error::WrongFormat { found });
    }
    let header = bytes.get(..HEADER_BYTES).ok_or(Error::TooShort {
        found: bytes.len(),
        needed: HEADER_BYTES,
    })?;
    let mut fields = Fields::new(header);
    let _ident_and_version: [u8; 8] = fields.bytes();
    let mut lumps = [LumpRange::default(); 17];
    for (lump, range) in Lump::ALL.into_iter().zip(&mut lumps) {
        let (offset, length) = (fields.i32(), fields.i32());
        let fits = length == 0
            || (offset >= 0
                && length > 0
                && i64::from(offset) + i64::from(length) <= bytes.len() as i64);
        if !fits {
            return Err(Error::LumpOutsideFile {
                lump,
                offset,
                length,
                file_length: bytes.len(),
            });
        }
        *range = LumpRange { offset, length };
    }
    Ok(lumps)
}

/// Names what the first eight bytes announce, unless they announce IBSP 46.
fn foreign_format(bytes: &[u8]) -> Option<String> {
    let (ident, rest) = bytes.split_first_chunk::<4>()?;
    let version = i32::from_le_bytes(*rest.first_chunk::<4>()?);
    let known = match (ident, version) {
        (b"IBSP", 46) => return None,
        (b"IBSP", 38) => "Quake II",
        (b"IBSP", 43..=45) => "a Quake III test version",
        (b"IBSP", 47) => "RTCW, Enemy Territory or Quake Live",
        (b"IBSP", 48) => "Iron Grip: Warlord",
        (b"IBSP", 666) => "Dark Salvation",
        (b"IBSP", _) if version == 46i32.swap_bytes() => "big-endian",
        (b"PSBI", _) => "big-endian",
        (b"RBSP", _) => "Raven Software's format",
        (b"FBSP", _) => "Warsow",
        (b"FAKK", _) => "Ritual's format",
        (b"VBSP", _) => "Source",
        (b"BSP2" | b"2PSB", _) => "extended Quake",
        ([29, 0, 0, 0], _) => "Quake",
        ([30, 0, 0, 0], _) => "GoldSrc",
        _ => "unknown",
    };
    Some(format!(
        "\"{}\" version {version} ({known})",
        ident.escape_ascii()
    ))
}

/// The bytes of a lump whose range was checked.
fn lump_bytes(bytes: &[u8], range: LumpRange) -> &[u8] {
    let start = usize::try_from(range.offset).unwrap_or(0);
    let length = usize::try_from(range.length).unwrap_or(0);
    bytes.get(start..start + length).unwrap_or(&[])
}

/// Cuts off what is no whole record.
fn split_records(data: &[u8], stride: usize) -> (&[u8], &[u8]) {
    data.split_at(data.len() - data.len() % stride)
}

fn records<T: Record>(lump: Lump, data: &[u8]) -> Result<Vec<T>, Error> {
    if !data.len().is_multiple_of(T::STRIDE) {
        return Err(Error::LumpLength {
            lump,
            length: data.len(),
            stride: T::STRIDE,
        });
    }
    Ok(data
        .chunks_exact(T::STRIDE)
        .map(|record| T::decode(Fields::new(record)))
        .collect())
}
