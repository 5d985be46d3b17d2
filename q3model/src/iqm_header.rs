//! The header of an IQM file, and the lists that it names.

use crate::Error;
use crate::bytes::{Fields, Region};

pub(crate) const MAGIC: &[u8; 16] = b"INTERQUAKEMODEL\0";
pub(crate) const VERSION: u32 = 2;
pub(crate) const HEADER_BYTES: usize = 124;

/// The header's numbers after magic and version.
pub(crate) struct Header {
    pub file_size: u32,
    pub text: (u32, u32),
    pub meshes: (u32, u32),
    pub num_arrays: u32,
    pub num_vertices: u32,
    pub arrays_at: u32,
    pub triangles: (u32, u32),
    pub joints: (u32, u32),
    pub poses: (u32, u32),
    pub num_frames: u32,
    pub numbers_per_frame: u32,
    pub frames_at: u32,
    pub bounds_at: u32,
}

impl Header {
    pub fn read(bytes: &[u8]) -> Result<Header, Error> {
        if let Some(start) = bytes.first_chunk::<20>() {
            let mut f = Fields::new(start);
            let magic: [u8; 16] = f.bytes();
            let version = f.u32();
            if &magic != MAGIC || version != VERSION {
                return Err(Error::WrongFormat {
                    found: format!("\"{}\" version {version}", magic.escape_ascii()),
                    expected: "\"INTERQUAKEMODEL\" version 2",
                });
            }
        }
        let file = Region::new(bytes, 0);
        let mut f = Fields::new(file.records(|| "the header".to_owned(), 0, 1, HEADER_BYTES)?);
        let _magic_and_version: [u8; 20] = f.bytes();
        let file_size = f.u32();
        let _flags = f.u32();
        let list = |f: &mut Fields<'_>| (f.u32(), f.u32());
        let text = list(&mut f);
        let meshes = list(&mut f);
        let (num_arrays, num_vertices, arrays_at) = (f.u32(), f.u32(), f.u32());
        let triangles = list(&mut f);
        let _adjacency = f.u32();
        let joints = list(&mut f);
        let poses = list(&mut f);
        // named ranges of frames: games define their own
        let _animations = list(&mut f);
        Ok(Header {
            file_size,
            text,
            meshes,
            num_arrays,
            num_vertices,
            arrays_at,
            triangles,
            joints,
            poses,
            num_frames: f.u32(),
            numbers_per_frame: f.u32(),
            frames_at: f.u32(),
            bounds_at: f.u32(),
        })
    }
}

/// A list of records anywhere in the file.
pub(crate) fn list<'a>(
    bytes: &'a [u8],
    what: &str,
    offset: u32,
    count: u32,
    stride: usize,
) -> Result<&'a [u8], Error> {
    Region::new(bytes, 0).records(
        || format!("{count} {what}"),
        i32::try_from(offset).unwrap_or(i32::MAX),
        count as usize,
        stride,
    )
}
