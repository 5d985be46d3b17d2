//! What can be wrong with a map, and where.

use std::borrow::Cow;
use std::fmt;

/// The lumps: the seventeen of `IBSP` in directory order, then those that other formats add.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[non_exhaustive]
#[allow(missing_docs)] // the names are the format's own
pub enum Lump {
    Entities,
    Shaders,
    Planes,
    Nodes,
    Leafs,
    LeafSurfaces,
    LeafBrushes,
    Models,
    Brushes,
    BrushSides,
    DrawVerts,
    DrawIndexes,
    Fogs,
    Surfaces,
    Lightmaps,
    LightGrid,
    Visibility,
    /// Lump 17 of `RBSP` and `FBSP`.
    LightArray,
    /// Lump 17 of Quake Live.
    Advertisements,
    /// Quake: pictures of textures.
    Textures,
    /// Quake and Quake II: corners of faces.
    Vertices,
    /// How textures lie on faces.
    Texinfo,
    /// Polygons.
    Faces,
    /// Lightmaps of faces.
    Lighting,
    /// Quake: collision trees.
    Clipnodes,
    /// Pairs of vertices.
    Edges,
    /// Edges in the order of faces.
    Surfedges,
    /// Quake II: unused.
    Pop,
    /// Quake II: areas.
    Areas,
    /// Quake II: doors between areas.
    AreaPortals,
}

impl Lump {
    /// The lumps of `IBSP` in directory order.
    pub const ALL: [Lump; 17] = [
        Lump::Entities,
        Lump::Shaders,
        Lump::Planes,
        Lump::Nodes,
        Lump::Leafs,
        Lump::LeafSurfaces,
        Lump::LeafBrushes,
        Lump::Models,
        Lump::Brushes,
        Lump::BrushSides,
        Lump::DrawVerts,
        Lump::DrawIndexes,
        Lump::Fogs,
        Lump::Surfaces,
        Lump::Lightmaps,
        Lump::LightGrid,
        Lump::Visibility,
    ];

    /// Place in the directory, 0 to 17; larger for the lumps that only Quake and Quake II have.
    pub fn index(self) -> usize {
        match self {
            Lump::Advertisements => Lump::LightArray as usize,
            _ => self as usize,
        }
    }

    /// Lower-case name as used in messages.
    pub fn name(self) -> &'static str {
        match self {
            Lump::Entities => "entities",
            Lump::Shaders => "shaders",
            Lump::Planes => "planes",
            Lump::Nodes => "nodes",
            Lump::Leafs => "leafs",
            Lump::LeafSurfaces => "leafsurfaces",
            Lump::LeafBrushes => "leafbrushes",
            Lump::Models => "models",
            Lump::Brushes => "brushes",
            Lump::BrushSides => "brushsides",
            Lump::DrawVerts => "drawverts",
            Lump::DrawIndexes => "drawindexes",
            Lump::Fogs => "fogs",
            Lump::Surfaces => "surfaces",
            Lump::Lightmaps => "lightmaps",
            Lump::LightGrid => "lightgrid",
            Lump::Visibility => "visibility",
            Lump::LightArray => "lightarray",
            Lump::Advertisements => "advertisements",
            Lump::Textures => "textures",
            Lump::Vertices => "vertices",
            Lump::Texinfo => "texinfo",
            Lump::Faces => "faces",
            Lump::Lighting => "lighting",
            Lump::Clipnodes => "clipnodes",
            Lump::Edges => "edges",
            Lump::Surfedges => "surfedges",
            Lump::Pop => "pop",
            Lump::Areas => "areas",
            Lump::AreaPortals => "areaportals",
        }
    }
}

impl fmt::Display for Lump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a map cannot be used. The file's name is the caller's to add.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file ends inside the header.
    #[error("file has {found} bytes, fewer than the {needed} of a map header")]
    TooShort {
        /// Bytes in the file.
        found: usize,
        /// Bytes needed.
        needed: usize,
    },
    /// Not a map of the kind read here.
    #[error("file is {found}, not a map format that is read")]
    WrongFormat {
        /// Identification and version found, with the format's name where it is known.
        found: String,
    },
    /// A directory entry points outside the file.
    #[error(
        "lump {lump}: offset {offset}, length {length} lie outside the file of {file_length} bytes"
    )]
    LumpOutsideFile {
        /// The lump.
        lump: Lump,
        /// Its offset.
        offset: i32,
        /// Its length.
        length: i32,
        /// Bytes in the file.
        file_length: usize,
    },
    /// A lump is not a whole number of records.
    #[error("lump {lump}: length {length} is not a multiple of {stride}")]
    LumpLength {
        /// The lump.
        lump: Lump,
        /// Its length in bytes.
        length: usize,
        /// Bytes per record.
        stride: usize,
    },
    /// A lump that no map can do without is empty.
    #[error("lump {lump} is empty")]
    Empty {
        /// The lump.
        lump: Lump,
    },
    /// An index or number outside what it may be.
    #[error("lump {lump}, element {element}: {field} is {value}, {expected}")]
    Value {
        /// The lump.
        lump: Lump,
        /// Index of the record in its lump.
        element: usize,
        /// Name of the field.
        field: &'static str,
        /// What it holds.
        value: i64,
        /// What it should be.
        expected: String,
    },
    /// A range of another lump that reaches outside it.
    #[error(
        "lump {lump}, element {element}: {field} {first}+{count} reach outside the {limit} of lump {target}"
    )]
    Range {
        /// The lump.
        lump: Lump,
        /// Index of the record in its lump.
        element: usize,
        /// Name of the range.
        field: &'static str,
        /// Its first element.
        first: i32,
        /// Its number of elements.
        count: i32,
        /// The lump pointed into.
        target: Lump,
        /// Number of elements there.
        limit: usize,
    },
    /// The records of a small file together refer to more data than any map has: sharing ranges is
    /// normal, but this would exhaust memory.
    #[error("lump {lump} refers to {found} elements of lump {target} in all, more than {limit}")]
    TooMuchSharing {
        /// The lump that refers.
        lump: Lump,
        /// The lump shared.
        target: Lump,
        /// Sum over all records.
        found: u64,
        /// Most accepted.
        limit: u64,
    },
    /// One of the errors above, with its place in the file.
    #[error("{error}, at byte {offset} of the file")]
    At {
        /// Bytes from the start of the file to the record or lump.
        offset: u64,
        /// What is wrong there.
        error: Box<Error>,
    },
    /// Control points that do not form a patch.
    #[error("patch of {width} by {height} control points with {points} points: {reason}")]
    Patch {
        /// Points per row.
        width: usize,
        /// Rows.
        height: usize,
        /// Points given.
        points: usize,
        /// What is wrong.
        reason: &'static str,
    },
}

impl Error {
    /// The error without its place in the file.
    pub fn without_offset(&self) -> &Error {
        match self {
            Error::At { error, .. } => error.without_offset(),
            other => other,
        }
    }

    /// Lump and record that the error is about.
    pub(crate) fn place(&self) -> Option<(Lump, usize)> {
        match *self {
            Error::LumpLength { lump, .. }
            | Error::Empty { lump }
            | Error::TooMuchSharing { lump, .. } => Some((lump, 0)),
            Error::Value { lump, element, .. } | Error::Range { lump, element, .. } => {
                Some((lump, element))
            }
            _ => None,
        }
    }
}

/// Something odd that was tolerated, as the engine does, and what was made of it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Warning {
    /// The lump.
    pub lump: Lump,
    /// Index of the record in its lump; `None` when the lump as a whole is meant.
    pub element: Option<usize>,
    /// Name of the field.
    pub field: Cow<'static, str>,
    /// What it holds.
    pub value: i64,
    /// What was made of it.
    pub action: Cow<'static, str>,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "lump {}", self.lump)?;
        if let Some(element) = self.element {
            write!(f, ", element {element}")?;
        }
        write!(f, ": {} is {}, {}", self.field, self.value, self.action)
    }
}
