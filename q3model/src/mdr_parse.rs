//! Bytes to [`Mdr`].

use std::collections::HashSet;

use glam::Vec4;

use crate::bytes::{Fields, Region, check_format, check_sharing, count, read_triangles};
use crate::mdr::{Mdr, MdrSurface, MdrTag, MdrVertex, MdrWeight};
use crate::{BoneMatrix, Error, Frame};

pub(crate) const IDENT: &[u8; 4] = b"RDM5";
pub(crate) const VERSION: i32 = 2;
pub(crate) const HEADER_BYTES: usize = 104;
/// A frame without its bones, and without its name where it is compressed.
pub(crate) const FRAME_BYTES: usize = 56;
pub(crate) const COMPRESSED_FRAME_BYTES: usize = 40;
pub(crate) const BONE_BYTES: usize = 48;
pub(crate) const COMPRESSED_BONE_BYTES: usize = 24;
pub(crate) const LOD_BYTES: usize = 12;
pub(crate) const SURFACE_BYTES: usize = 168;
/// A vertex without its weights.
pub(crate) const VERTEX_BYTES: usize = 24;
pub(crate) const WEIGHT_BYTES: usize = 20;
pub(crate) const TAG_BYTES: usize = 36;

/// Compressed numbers are unsigned with zero in the middle.
pub(crate) const COMPRESSED_ZERO: f32 = 32768.0;
/// Units of a translation.
pub(crate) const COMPRESSED_TRANSLATION: f32 = 1.0 / 64.0;
/// Units of a rotation, from the engine's code; its comments do not define them.
pub(crate) const COMPRESSED_ROTATION: f32 = 1.0 / 32766.0;

impl Mdr {
    /// Reads and validates a model, its frames compressed or not. The engine's limits on bones, and on vertices and
    /// triangles per surface, do not apply.
    ///
    /// # Errors
    /// A wrong identification or version, no frame, no level of detail, counts or offsets that lead outside the file,
    /// triangle corners that name no vertex, weights and tags that name no bone.
    pub fn parse(bytes: &[u8]) -> Result<Mdr, Error> {
        let file = Region::new(bytes, 0);
        check_format(bytes, IDENT, VERSION, "\"RDM5\" version 2")?;
        let mut header =
            Fields::new(file.records(|| "the header".to_owned(), 0, 1, HEADER_BYTES)?);
        let _ident_and_version: [u8; 8] = header.bytes();
        let name = header.name::<64>();
        let num_frames = at_least_one("number of frames", header.i32())?;
        let num_bones = count("number of bones", header.i32())?;
        let frames_at = header.i32();
        let num_lods = at_least_one("number of levels of detail", header.i32())?;
        let lods_at = header.i32();
        let num_tags = count("number of tags", header.i32())?;
        let tags_at = header.i32();

        let (frames, bones) = read_frames(file, frames_at, num_frames, num_bones)?;
        let tags = file
            .records(|| format!("{num_tags} tags"), tags_at, num_tags, TAG_BYTES)?
            .chunks_exact(TAG_BYTES)
            .enumerate()
            .map(|(number, record)| {
                let mut f = Fields::new(record);
                let bone = bone_index(f.i32(), num_bones, || format!("bone of tag {number}"))?;
                let name = f.name::<32>();
                Ok(MdrTag { name, bone })
            })
            .collect::<Result<_, Error>>()?;
        let lods = Chains::new(bytes, num_bones).lods(lods_at, num_lods)?;
        Ok(Mdr {
            name,
            frames,
            bones,
            num_bones,
            lods,
            tags,
        })
    }
}

fn at_least_one(what: &str, value: i32) -> Result<usize, Error> {
    match count(what, value)? {
        0 => Err(Error::Value {
            what: what.to_owned(),
            value: 0,
            expected: "but a model has at least one".to_owned(),
        }),
        n => Ok(n),
    }
}

fn bone_index(value: i32, bones: usize, what: impl Fn() -> String) -> Result<usize, Error> {
    let index = usize::try_from(value).ok().filter(|&index| index < bones);
    index.ok_or_else(|| Error::Value {
        what: what(),
        value: i64::from(value),
        expected: format!("outside its {bones} bones"),
    })
}

/// Frames with their bones. A negative offset marks compressed frames.
fn read_frames(
    file: Region<'_>,
    at: i32,
    num_frames: usize,
    num_bones: usize,
) -> Result<(Vec<Frame>, Vec<BoneMatrix>), Error> {
    let compressed = at < 0;
    let (head, bone) = if compressed {
        (COMPRESSED_FRAME_BYTES, COMPRESSED_BONE_BYTES)
    } else {
        (FRAME_BYTES, BONE_BYTES)
    };
    let stride = num_bones
        .checked_mul(bone)
        .and_then(|bones| bones.checked_add(head))
        .unwrap_or(usize::MAX);
    let records = file.records(
        || format!("{num_frames} frames of {num_bones} bones"),
        at.checked_abs().unwrap_or(i32::MAX),
        num_frames,
        stride,
    )?;
    let mut frames = Vec::new();
    let mut bones = Vec::new();
    for record in records.chunks_exact(stride) {
        let (head, rest) = record.split_at_checked(head).unwrap_or((record, &[]));
        let mut f = Fields::new(head);
        frames.push(Frame {
            mins: f.vec3(),
            maxs: f.vec3(),
            local_origin: f.vec3(),
            radius: f.f32(),
            name: if compressed {
                String::new()
            } else {
                f.name::<16>()
            },
        });
        let read = if compressed { decompress } else { read_bone };
        bones.extend(rest.chunks_exact(bone).map(read));
    }
    Ok((frames, bones))
}

fn read_bone(record: &[u8]) -> BoneMatrix {
    let mut f = Fields::new(record);
    BoneMatrix {
        rows: std::array::from_fn(|_| Vec4::new(f.f32(), f.f32(), f.f32(), f.f32())),
    }
}

/// Twelve numbers of two bytes: the translation, then the rotation row by row.
fn decompress(record: &[u8]) -> BoneMatrix {
    let mut f = Fields::new(record);
    let mut next = || f32::from(u16::from_le_bytes(f.bytes())) - COMPRESSED_ZERO;
    let translation: [f32; 3] = std::array::from_fn(|_| next() * COMPRESSED_TRANSLATION);
    BoneMatrix {
        rows: translation.map(|moved| {
            let [x, y, z] = std::array::from_fn(|_| next() * COMPRESSED_ROTATION);
            Vec4::new(x, y, z, moved)
        }),
    }
}

/// Follows the chains of levels and of surfaces; each has the offset of the next. A chain that comes back to
/// a place would repeat it, so that the places visited are remembered.
struct Chains<'a> {
    bytes: &'a [u8],
    num_bones: usize,
    visited: HashSet<usize>,
    claimed: u64,
}

impl<'a> Chains<'a> {
    fn new(bytes: &'a [u8], num_bones: usize) -> Self {
        Chains {
            bytes,
            num_bones,
            visited: HashSet::new(),
            claimed: 0,
        }
    }

    fn visit(&mut self, at: i64, length: usize, what: impl Fn() -> String) -> Result<usize, Error> {
        let start = usize::try_from(at)
            .ok()
            .filter(|&start| start < self.bytes.len())
            .ok_or_else(|| Error::OutsideFile {
                what: what(),
                offset: at,
                length: length as u64,
                file_length: self.bytes.len(),
            })?;
        if self.visited.insert(start) {
            return Ok(start);
        }
        Err(Error::Value {
            what: format!("offset of {}", what()),
            value: at,
            expected: "where something else is".to_owned(),
        })
    }

    fn lods(mut self, first: i32, count: usize) -> Result<Vec<Vec<MdrSurface>>, Error> {
        let mut lods = Vec::new();
        let mut at = i64::from(first);
        for number in 0..count {
            let what = || format!("level of detail {number}");
            let start = self.visit(at, LOD_BYTES, what)?;
            let region = Region::new(self.bytes, start);
            let mut header = Fields::new(region.records(what, 0, 1, LOD_BYTES)?);
            let surfaces = count_of(&mut header, || format!("number of surfaces of {}", what()))?;
            let first = at + i64::from(header.i32());
            let end = header.i32();
            lods.push(self.surfaces(number, first, surfaces)?);
            at += i64::from(end);
        }
        Ok(lods)
    }

    fn surfaces(&mut self, lod: usize, first: i64, count: usize) -> Result<Vec<MdrSurface>, Error> {
        let mut surfaces = Vec::new();
        let mut at = first;
        for number in 0..count {
            let what = || format!("surface {number} of level {lod}");
            let start = self.visit(at, SURFACE_BYTES, what)?;
            let (surface, end) = self.surface(start, what)?;
            surfaces.push(surface);
            at += i64::from(end);
        }
        Ok(surfaces)
    }

    /// Reads one surface; also returns the distance to the next.
    fn surface(
        &mut self,
        start: usize,
        name_it: impl Fn() -> String,
    ) -> Result<(MdrSurface, i32), Error> {
        let region = Region::new(self.bytes, start);
        let what = |part: &str| format!("{part} of {}", name_it());
        let mut header = Fields::new(region.records(|| what("header"), 0, 1, SURFACE_BYTES)?);
        let _ident = header.i32();
        let name = header.name::<64>().to_ascii_lowercase();
        let shader = header.name::<64>();
        // a place for the renderer's index, and the way back to the header
        let _renderer: [u8; 8] = header.bytes();
        let num_verts = count_of(&mut header, || what("number of vertices"))?;
        let vertices_at = header.i32();
        let num_triangles = count_of(&mut header, || what("number of triangles"))?;
        let triangles_at = header.i32();
        // the list of the bones that it uses is for renderers that load few at a time
        let _references: [u8; 8] = header.bytes();
        let end = header.i32();

        let triangles = region.records(
            || what("triangles"),
            triangles_at,
            num_triangles,
            crate::bytes::TRIANGLE_BYTES,
        )?;
        self.claim(triangles.len())?;
        let triangles = read_triangles(triangles, 0, num_verts, |at| {
            what(&format!("corner of triangle {at}"))
        })?;
        let mut surface = MdrSurface {
            name,
            shader,
            triangles,
            ..MdrSurface::default()
        };
        // vertices have different numbers of weights, so each has the offset of the next
        let mut at = vertices_at;
        for number in 0..num_verts {
            let what = || what(&format!("vertex {number}"));
            let record = region.records(what, at, 1, VERTEX_BYTES)?;
            let mut f = Fields::new(record);
            let (normal, st) = (f.vec3(), f.vec2());
            let num_weights = count_of(&mut f, || format!("number of weights of {}", what()))?;
            let after = at.saturating_add(VERTEX_BYTES as i32);
            let weights = region.records(what, after, num_weights, WEIGHT_BYTES)?;
            self.claim(VERTEX_BYTES + weights.len())?;
            let length = i32::try_from(weights.len()).unwrap_or(i32::MAX);
            at = after.saturating_add(length);
            surface.vertices.push(MdrVertex {
                normal,
                st,
                first_weight: u32::try_from(surface.weights.len()).unwrap_or(u32::MAX),
                num_weights: u32::try_from(num_weights).unwrap_or(0),
            });
            for record in weights.chunks_exact(WEIGHT_BYTES) {
                let mut f = Fields::new(record);
                let bone = bone_index(f.i32(), self.num_bones, || format!("bone of {}", what()))?;
                surface.weights.push(MdrWeight {
                    bone: u32::try_from(bone).unwrap_or(u32::MAX),
                    weight: f.f32(),
                    offset: f.vec3(),
                });
            }
        }
        Ok((surface, end))
    }

    fn claim(&mut self, length: usize) -> Result<(), Error> {
        self.claimed += length as u64;
        check_sharing(self.claimed, self.bytes.len())
    }
}

fn count_of(fields: &mut Fields<'_>, what: impl Fn() -> String) -> Result<usize, Error> {
    let value = fields.i32();
    usize::try_from(value).or_else(|_| count(&what(), value))
}
