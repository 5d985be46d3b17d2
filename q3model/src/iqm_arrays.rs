//! The vertex arrays of an IQM file.

use crate::Error;
use crate::bytes::Fields;
use crate::iqm::IQM_WEIGHTS;
use crate::iqm_header::{Header, list};

pub(crate) const ARRAY_BYTES: usize = 20;

/// Kinds of vertex arrays.
pub(crate) const POSITION: u32 = 0;
pub(crate) const TEXCOORD: u32 = 1;
pub(crate) const NORMAL: u32 = 2;
pub(crate) const TANGENT: u32 = 3;
pub(crate) const BLEND_INDEXES: u32 = 4;
pub(crate) const BLEND_WEIGHTS: u32 = 5;
pub(crate) const COLOR: u32 = 6;

/// Kinds of numbers in them.
pub(crate) const UBYTE: u32 = 1;
pub(crate) const INT: u32 = 4;
pub(crate) const FLOAT: u32 = 7;

/// The vertex arrays that count.
#[derive(Default)]
pub(crate) struct Arrays<'a> {
    pub positions: Option<&'a [u8]>,
    pub normals: Option<&'a [u8]>,
    pub texcoords: Option<&'a [u8]>,
    pub colors: Option<&'a [u8]>,
    pub indexes: Option<Fours<'a>>,
    pub weights: Option<Fours<'a>>,
}

/// Four numbers for each vertex.
#[derive(Clone, Copy)]
pub(crate) struct Fours<'a> {
    bytes: &'a [u8],
    format: u32,
}

impl Fours<'_> {
    /// Those of a vertex as shares of 1: bytes are shares of 255.
    pub fn shares(&self, vertex: usize) -> [f32; IQM_WEIGHTS] {
        let four = self.four(vertex);
        if self.format == UBYTE {
            four.map(|share| share / 255.0)
        } else {
            four
        }
    }

    /// Those of a vertex.
    pub fn four(&self, vertex: usize) -> [f32; IQM_WEIGHTS] {
        let stride = if self.format == UBYTE { 4 } else { 16 };
        let record = vertex
            .checked_mul(stride)
            .and_then(|at| self.bytes.get(at..))
            .unwrap_or(&[]);
        let mut f = Fields::new(record);
        std::array::from_fn(|_| match self.format {
            UBYTE => f32::from(f.bytes::<1>()[0]),
            INT => f.i32() as f32,
            _ => f.f32(),
        })
    }
}

impl<'a> Arrays<'a> {
    /// Finds them; those of a kind that is not known are left out.
    ///
    /// # Errors
    /// An array that is not in the file, or has another form than its kind must have.
    pub fn read(bytes: &'a [u8], header: &Header) -> Result<Arrays<'a>, Error> {
        let mut arrays = Arrays::default();
        let records = list(
            bytes,
            "vertex arrays",
            header.arrays_at,
            header.num_arrays,
            ARRAY_BYTES,
        )?;
        for record in records.chunks_exact(ARRAY_BYTES) {
            let mut f = Fields::new(record);
            let (kind, _flags, format, size, offset) =
                (f.u32(), f.u32(), f.u32(), f.u32(), f.u32());
            let accepted: &[(u32, u32)] = match kind {
                POSITION | NORMAL => &[(FLOAT, 3)],
                TEXCOORD => &[(FLOAT, 2)],
                TANGENT => &[(FLOAT, 4)],
                BLEND_INDEXES => &[(UBYTE, 4), (INT, 4)],
                BLEND_WEIGHTS => &[(UBYTE, 4), (FLOAT, 4)],
                COLOR => &[(UBYTE, 4)],
                // arrays of a tool's own
                _ => continue,
            };
            if !accepted.contains(&(format, size)) {
                return Err(Error::Value {
                    what: format!("format of vertex array {kind}"),
                    value: i64::from(format),
                    expected: format!("of {size} numbers, which is not one that engines take"),
                });
            }
            let stride = size as usize * if format == UBYTE { 1 } else { 4 };
            let found = list(bytes, "vertices", offset, header.num_vertices, stride)?;
            let four = Some(Fours {
                bytes: found,
                format,
            });
            match kind {
                POSITION => arrays.positions = Some(found),
                NORMAL => arrays.normals = Some(found),
                TEXCOORD => arrays.texcoords = Some(found),
                COLOR => arrays.colors = Some(found),
                BLEND_INDEXES => arrays.indexes = four,
                BLEND_WEIGHTS => arrays.weights = four,
                _ => {}
            }
        }
        Ok(arrays)
    }
}
