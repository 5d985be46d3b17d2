//! The file: header, directory, and the lumps as they are stored.

use super::records::{
    Edge, Face, QuakeBrush, QuakeBrushSide, QuakeLeaf, QuakeModel, QuakeNode, QuakePlane, Texinfo,
    Versioned,
};
use crate::bytes::Fields;
use crate::container::{LumpEntry, LumpRange};
use crate::error::{Error, Lump};
use crate::format::{Format, announced};
use glam::Vec3;

/// Lumps of Quake and GoldSrc in directory order.
const QUAKE_LUMPS: [Lump; 15] = [
    Lump::Entities,
    Lump::Planes,
    Lump::Textures,
    Lump::Vertices,
    Lump::Visibility,
    Lump::Nodes,
    Lump::Texinfo,
    Lump::Faces,
    Lump::Lighting,
    Lump::Clipnodes,
    Lump::Leafs,
    Lump::LeafSurfaces,
    Lump::Edges,
    Lump::Surfedges,
    Lump::Models,
];

/// Lumps of Quake II in directory order.
const QUAKE2_LUMPS: [Lump; 19] = [
    Lump::Entities,
    Lump::Planes,
    Lump::Vertices,
    Lump::Visibility,
    Lump::Nodes,
    Lump::Texinfo,
    Lump::Faces,
    Lump::Lighting,
    Lump::Leafs,
    Lump::LeafSurfaces,
    Lump::LeafBrushes,
    Lump::Edges,
    Lump::Surfedges,
    Lump::Models,
    Lump::Brushes,
    Lump::BrushSides,
    Lump::Pop,
    Lump::Areas,
    Lump::AreaPortals,
];

/// A map of Quake, GoldSrc or Quake II as it is stored. Nothing in it is checked but the directory and the sizes of
/// records; [`QuakeMap::to_bsp`] checks the rest.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct QuakeMap {
    /// Which of the formats.
    pub format: Format,
    /// Where the lumps were in the file, in directory order; empty for a map made in memory.
    pub directory: Vec<LumpRange>,
    /// Entity text.
    pub entities: Vec<u8>,
    /// Planes.
    pub planes: Vec<QuakePlane>,
    /// Textures with their pictures, as stored; empty in Quake II.
    pub textures: Vec<u8>,
    /// Vertices.
    pub vertices: Vec<Vec3>,
    /// Visibility, compressed.
    pub visibility: Vec<u8>,
    /// Nodes.
    pub nodes: Vec<QuakeNode>,
    /// How textures lie.
    pub texinfos: Vec<Texinfo>,
    /// Polygons.
    pub faces: Vec<Face>,
    /// Lightmaps of all faces: one byte a texel in Quake, three elsewhere.
    pub lighting: Vec<u8>,
    /// Leafs.
    pub leafs: Vec<QuakeLeaf>,
    /// Faces that leafs list.
    pub leaf_faces: Vec<u32>,
    /// Quake II: brushes that leafs list.
    pub leaf_brushes: Vec<u32>,
    /// Edges.
    pub edges: Vec<Edge>,
    /// Edges in the order of faces; negative ones are walked backwards.
    pub surfedges: Vec<i32>,
    /// The world and the brush models.
    pub models: Vec<QuakeModel>,
    /// Quake II: brushes.
    pub brushes: Vec<QuakeBrush>,
    /// Quake II: their sides.
    pub brush_sides: Vec<QuakeBrushSide>,
    /// Lumps that nothing here needs, as stored: collision trees, areas.
    pub others: Vec<(Lump, Vec<u8>)>,
    /// What follows the last lump, such as the extra lumps that later compilers append.
    pub appendix: Vec<u8>,
}

impl QuakeMap {
    /// Lumps in directory order.
    pub fn lumps(&self) -> &'static [Lump] {
        lumps_of(self.format)
    }

    /// Reads a file of one of the formats.
    ///
    /// # Errors
    /// Another format, a lump outside the file, or one that is no whole number of records.
    pub fn parse(bytes: &[u8]) -> Result<QuakeMap, Error> {
        let format = announced(bytes)?;
        if !format.is_quake() {
            let found = format.name().to_owned();
            return Err(Error::WrongFormat { found });
        }
        let lumps = lumps_of(format);
        let mut reader = Reader {
            bytes,
            format,
            directory: Vec::new(),
        };
        let header = directory_start(format) + 8 * lumps.len();
        let Some(entries) = bytes.get(directory_start(format)..header) else {
            return Err(Error::TooShort {
                found: bytes.len(),
                needed: header,
            });
        };
        let mut fields = Fields::new(entries);
        for &lump in lumps {
            let range = LumpRange::read(&mut fields, lump, bytes.len())?;
            reader.directory.push(range);
        }
        reader.read()
    }

    /// The map as a file: lumps in directory order, aligned to 4 bytes.
    pub fn write(&self) -> Vec<u8> {
        let lumps = self.lumps();
        let mut file = Vec::new();
        match self.format {
            Format::Quake => file.extend_from_slice(&29i32.to_le_bytes()),
            Format::GoldSrc => file.extend_from_slice(&30i32.to_le_bytes()),
            Format::Bsp2 => file.extend_from_slice(b"BSP2"),
            Format::TwoPsb => file.extend_from_slice(b"2PSB"),
            Format::Qbism => file.extend_from_slice(b"QBSP\x26\0\0\0"),
            _ => file.extend_from_slice(b"IBSP\x26\0\0\0"),
        }
        let start = file.len();
        file.resize(start + 8 * lumps.len(), 0);
        for (at, &lump) in lumps.iter().enumerate() {
            file.resize(file.len().next_multiple_of(4), 0);
            let data = self.encode(lump);
            let int = |n: usize| i32::try_from(n).unwrap_or(i32::MAX).to_le_bytes();
            let entry = [int(file.len()), int(data.len())].concat();
            if let Some(slot) = file.get_mut(start + at * 8..start + at * 8 + 8) {
                slot.copy_from_slice(&entry);
            }
            file.extend_from_slice(&data);
        }
        if !self.appendix.is_empty() {
            file.resize(file.len().next_multiple_of(4), 0);
            file.extend_from_slice(&self.appendix);
        }
        file
    }

    fn encode(&self, lump: Lump) -> Vec<u8> {
        fn all<T: Versioned>(records: &[T], format: Format) -> Vec<u8> {
            let mut out = Vec::new();
            for record in records {
                record.encode(format, &mut out);
            }
            out
        }
        let format = self.format;
        match lump {
            Lump::Entities => self.entities.clone(),
            Lump::Planes => all(&self.planes, format),
            Lump::Textures => self.textures.clone(),
            Lump::Vertices => all(&self.vertices, format),
            Lump::Visibility => self.visibility.clone(),
            Lump::Nodes => all(&self.nodes, format),
            Lump::Texinfo => all(&self.texinfos, format),
            Lump::Faces => all(&self.faces, format),
            Lump::Lighting => self.lighting.clone(),
            Lump::Leafs => all(&self.leafs, format),
            Lump::LeafSurfaces => all(&self.leaf_faces, format),
            Lump::LeafBrushes => all(&self.leaf_brushes, format),
            Lump::Edges => all(&self.edges, format),
            Lump::Surfedges => all(&self.surfedges, format),
            Lump::Models => all(&self.models, format),
            Lump::Brushes => all(&self.brushes, format),
            Lump::BrushSides => all(&self.brush_sides, format),
            other => {
                let stored = self.others.iter().find(|(lump, _)| *lump == other);
                // Empty lumps are not kept.
                stored.map(|(_, data)| data.clone()).unwrap_or_default()
            }
        }
    }

    /// The directory with the sizes of records.
    pub(crate) fn lump_entries(&self) -> Vec<LumpEntry> {
        let lumps = self.lumps().iter().zip(&self.directory);
        lumps
            .map(|(&lump, &range)| LumpEntry {
                lump,
                range,
                stride: stride(lump, self.format),
            })
            .collect()
    }

    /// An error about a record, with its place in the file.
    pub(super) fn located(&self, error: Error) -> Error {
        let Some((lump, element)) = error.place() else {
            return error;
        };
        let at = self.lumps().iter().position(|&l| l == lump);
        let range = at.and_then(|at| self.directory.get(at));
        match range.and_then(|range| u64::try_from(range.offset).ok()) {
            Some(start) => Error::At {
                offset: start + (element * stride(lump, self.format)) as u64,
                error: Box::new(error),
            },
            None => error,
        }
    }
}

fn lumps_of(format: Format) -> &'static [Lump] {
    match format {
        Format::Quake2 | Format::Qbism => &QUAKE2_LUMPS,
        _ => &QUAKE_LUMPS,
    }
}

/// Where the directory begins: behind a version, or behind an identification and a version.
fn directory_start(format: Format) -> usize {
    match format {
        Format::Quake2 | Format::Qbism => 8,
        _ => 4,
    }
}

/// Bytes per record of a lump.
fn stride(lump: Lump, format: Format) -> usize {
    match lump {
        Lump::Planes => QuakePlane::stride(format),
        Lump::Vertices => Vec3::stride(format),
        Lump::Nodes => QuakeNode::stride(format),
        Lump::Texinfo => Texinfo::stride(format),
        Lump::Faces => Face::stride(format),
        Lump::Leafs => QuakeLeaf::stride(format),
        Lump::LeafSurfaces | Lump::LeafBrushes => u32::stride(format),
        Lump::Edges => Edge::stride(format),
        Lump::Surfedges => i32::stride(format),
        Lump::Models => QuakeModel::stride(format),
        Lump::Brushes => QuakeBrush::stride(format),
        Lump::BrushSides => QuakeBrushSide::stride(format),
        _ => 1,
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    format: Format,
    directory: Vec<LumpRange>,
}

impl Reader<'_> {
    fn range(&self, lump: Lump) -> LumpRange {
        // A lump that the format does not have is empty.
        let at = lumps_of(self.format).iter().position(|&l| l == lump);
        at.and_then(|at| self.directory.get(at))
            .copied()
            .unwrap_or_default()
    }

    fn data(&self, lump: Lump) -> Vec<u8> {
        let range = self.range(lump);
        let start = usize::try_from(range.offset).unwrap_or(0);
        let length = usize::try_from(range.length).unwrap_or(0);
        let data = self.bytes.get(start..start.saturating_add(length));
        // The directory was checked against the length of the file.
        data.unwrap_or_default().to_vec()
    }

    fn records<T: Versioned>(&self, lump: Lump) -> Result<Vec<T>, Error> {
        let data = self.data(lump);
        let stride = T::stride(self.format);
        if !data.len().is_multiple_of(stride) {
            return Err(Error::At {
                offset: u64::try_from(self.range(lump).offset).unwrap_or(0),
                error: Box::new(Error::LumpLength {
                    lump,
                    length: data.len(),
                    stride,
                }),
            });
        }
        let decode = |record| T::decode(Fields::new(record), self.format);
        Ok(data.chunks_exact(stride).map(decode).collect())
    }

    fn read(self) -> Result<QuakeMap, Error> {
        let others = [Lump::Clipnodes, Lump::Pop, Lump::Areas, Lump::AreaPortals];
        let kept = others.into_iter().map(|lump| (lump, self.data(lump)));
        let ends = self.directory.iter().filter_map(|range| {
            let end = i64::from(range.offset) + i64::from(range.length);
            (range.length > 0).then(|| usize::try_from(end).unwrap_or(0))
        });
        let end = ends.max().unwrap_or(0).next_multiple_of(4);
        Ok(QuakeMap {
            format: self.format,
            entities: self.data(Lump::Entities),
            planes: self.records(Lump::Planes)?,
            textures: self.data(Lump::Textures),
            vertices: self.records(Lump::Vertices)?,
            visibility: self.data(Lump::Visibility),
            nodes: self.records(Lump::Nodes)?,
            texinfos: self.records(Lump::Texinfo)?,
            faces: self.records(Lump::Faces)?,
            lighting: self.data(Lump::Lighting),
            leafs: self.records(Lump::Leafs)?,
            leaf_faces: self.records(Lump::LeafSurfaces)?,
            leaf_brushes: self.records(Lump::LeafBrushes)?,
            edges: self.records(Lump::Edges)?,
            surfedges: self.records(Lump::Surfedges)?,
            models: self.records(Lump::Models)?,
            brushes: self.records(Lump::Brushes)?,
            brush_sides: self.records(Lump::BrushSides)?,
            others: kept.filter(|(_, data)| !data.is_empty()).collect(),
            // Most files end where their lumps do.
            appendix: self.bytes.get(end..).unwrap_or_default().to_vec(),
            directory: self.directory,
        })
    }
}
