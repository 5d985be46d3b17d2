//! Bytes to [`Md3`].

use crate::Error;
pub(crate) use crate::bytes::TRIANGLE_BYTES;
use crate::bytes::{Fields, Region, check_format, check_sharing, count, read_triangles};
use crate::md3::{Frame, Md3, PackedVertex, Surface, Tag};
use std::collections::HashSet;

pub(crate) const IDENT: &[u8; 4] = b"IDP3";
pub(crate) const VERSION: i32 = 15;
pub(crate) const HEADER_BYTES: usize = 108;
pub(crate) const FRAME_BYTES: usize = 56;
pub(crate) const TAG_BYTES: usize = 112;
pub(crate) const SURFACE_BYTES: usize = 108;
pub(crate) const SHADER_BYTES: usize = 68;
pub(crate) const ST_BYTES: usize = 8;
pub(crate) const VERTEX_BYTES: usize = 8;

impl Md3 {
    /// Reads and validates a model. The engine's limits on vertices and triangles per surface do not
    /// apply.
    ///
    /// # Errors
    /// A wrong identification or version, no frame, counts or offsets that lead outside the file,
    /// triangle corners that name no vertex.
    pub fn parse(bytes: &[u8]) -> Result<Md3, Error> {
        let file = Region::new(bytes, 0);
        check_format(bytes, IDENT, VERSION, "\"IDP3\" version 15")?;
        let mut header =
            Fields::new(file.records(|| "the header".to_owned(), 0, 1, HEADER_BYTES)?);
        let _ident_and_version: [u8; 8] = header.bytes();
        let name = header.name::<64>();
        let _flags = header.i32();
        let num_frames = header.i32();
        let num_tags = header.i32();
        let num_surfaces = header.i32();
        let _num_skins = header.i32();
        let frames_at = header.i32();
        let tags_at = header.i32();
        let surfaces_at = header.i32();

        let num_frames = count("number of frames", num_frames)?;
        if num_frames == 0 {
            return Err(Error::Value {
                what: "number of frames".to_owned(),
                value: 0,
                expected: "but a model has at least one".to_owned(),
            });
        }
        let num_tags = count("number of tags", num_tags)?;
        let num_surfaces = count("number of surfaces", num_surfaces)?;

        let frames = file
            .records(
                || format!("{num_frames} frames"),
                frames_at,
                num_frames,
                FRAME_BYTES,
            )?
            .chunks_exact(FRAME_BYTES)
            .map(read_frame)
            .collect();
        let all_tags = num_frames.saturating_mul(num_tags);
        let tags = file
            .records(
                || format!("{num_tags} tags in {num_frames} frames"),
                tags_at,
                all_tags,
                TAG_BYTES,
            )?
            .chunks_exact(TAG_BYTES)
            .map(read_tag)
            .collect();
        let surfaces = read_surfaces(bytes, surfaces_at, num_surfaces, num_frames)?;
        Ok(Md3 {
            name,
            frames,
            tags,
            num_tags,
            surfaces,
        })
    }
}

fn read_frame(record: &[u8]) -> Frame {
    let mut f = Fields::new(record);
    Frame {
        mins: f.vec3(),
        maxs: f.vec3(),
        local_origin: f.vec3(),
        radius: f.f32(),
        name: f.name::<16>(),
    }
}

fn read_tag(record: &[u8]) -> Tag {
    let mut f = Fields::new(record);
    Tag {
        name: f.name::<64>(),
        origin: f.vec3(),
        axis: [f.vec3(), f.vec3(), f.vec3()],
    }
}

/// Follows the chain of surfaces; each has the offset of the next. A chain that comes back to a
/// surface would repeat it, so that the places visited are remembered.
fn read_surfaces(
    bytes: &[u8],
    first: i32,
    count: usize,
    num_frames: usize,
) -> Result<Vec<Surface>, Error> {
    let mut surfaces = Vec::new();
    let mut visited = HashSet::new();
    let mut at = i64::from(first);
    let mut claimed = 0u64;
    for number in 0..count {
        let start = usize::try_from(at)
            .ok()
            .filter(|&start| start < bytes.len());
        let Some(start) = start else {
            return Err(Error::OutsideFile {
                what: format!("surface {number}"),
                offset: at,
                length: SURFACE_BYTES as u64,
                file_length: bytes.len(),
            });
        };
        if !visited.insert(start) {
            return Err(Error::Value {
                what: format!("offset of surface {number}"),
                value: at,
                expected: "where another surface is".to_owned(),
            });
        }
        let (surface, end) = read_surface(bytes, start, number, num_frames, &mut claimed)?;
        surfaces.push(surface);
        at += i64::from(end);
    }
    Ok(surfaces)
}

/// Reads one surface; also returns the distance to the next.
fn read_surface(
    bytes: &[u8],
    start: usize,
    number: usize,
    num_frames: usize,
    claimed: &mut u64,
) -> Result<(Surface, i32), Error> {
    let region = Region::new(bytes, start);
    let what = |part: &str| format!("{part} of surface {number}");
    let mut header = Fields::new(region.records(|| what("header"), 0, 1, SURFACE_BYTES)?);
    // The engine does not look at the identification of a surface.
    let _ident = header.i32();
    let name = surface_name(&header.name::<64>());
    let _flags = header.i32();
    // Nor at its number of frames: those of the model count.
    let _frames = header.i32();
    let num_shaders = count(&what("number of shaders"), header.i32())?;
    let num_verts = count(&what("number of vertices"), header.i32())?;
    let num_triangles = count(&what("number of triangles"), header.i32())?;
    let triangles_at = header.i32();
    let shaders_at = header.i32();
    let st_at = header.i32();
    let vertices_at = header.i32();
    let end = header.i32();
    let all_verts = num_frames.saturating_mul(num_verts);
    let triangles = region.records(
        || what("triangles"),
        triangles_at,
        num_triangles,
        TRIANGLE_BYTES,
    )?;
    let shaders = region.records(|| what("shaders"), shaders_at, num_shaders, SHADER_BYTES)?;
    let st = region.records(|| what("texture coordinates"), st_at, num_verts, ST_BYTES)?;
    let vertices = region.records(|| what("vertices"), vertices_at, all_verts, VERTEX_BYTES)?;
    *claimed += [triangles, shaders, st, vertices]
        .iter()
        .map(|part| part.len() as u64)
        .sum::<u64>();
    check_sharing(*claimed, bytes.len())?;
    let triangles = read_triangles(triangles, 0, num_verts, |at| {
        what(&format!("corner of triangle {at}"))
    })?;
    let surface = Surface {
        name,
        shaders: shaders
            .chunks_exact(SHADER_BYTES)
            .map(|record| Fields::new(record).name::<64>())
            .collect(),
        triangles,
        st: st
            .chunks_exact(ST_BYTES)
            .map(|record| Fields::new(record).vec2())
            .collect(),
        vertices: vertices
            .chunks_exact(VERTEX_BYTES)
            .map(read_vertex)
            .collect(),
        num_verts,
    };
    Ok((surface, end))
}

fn read_vertex(record: &[u8]) -> PackedVertex {
    let mut f = Fields::new(record);
    let mut short = || u16::from_le_bytes(f.bytes());
    let (x, y, z) = (
        short().cast_signed(),
        short().cast_signed(),
        short().cast_signed(),
    );
    PackedVertex {
        position: [x, y, z],
        normal: short(),
    }
}

/// Lower case, without the exporters' `_1` or `_2` for a level of detail.
fn surface_name(stored: &str) -> String {
    let mut name = stored.to_ascii_lowercase();
    let mut chars = name.chars();
    if chars.next_back().is_some() && chars.next_back() == Some('_') {
        let length = chars.as_str().len();
        name.truncate(length);
    }
    name
}

#[cfg(test)]
mod tests {
    use super::surface_name;

    #[test]
    fn level_of_detail_is_stripped_from_names() {
        for (stored, name) in [
            ("H_Head", "h_head"),
            ("u_torso_1", "u_torso"),
            ("_a", ""),
            ("a", "a"),
            ("", ""),
            ("x_é", "x"),
        ] {
            assert_eq!(surface_name(stored), name, "{stored}");
        }
    }
}
