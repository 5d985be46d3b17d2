//! [`Mdr`] to bytes, in the layout that exporters use.

use crate::bytes::TRIANGLE_BYTES;
use crate::mdr::{Mdr, MdrSurface};
use crate::mdr_parse::{
    BONE_BYTES, COMPRESSED_BONE_BYTES, COMPRESSED_FRAME_BYTES, COMPRESSED_ROTATION,
    COMPRESSED_TRANSLATION, COMPRESSED_ZERO, FRAME_BYTES, HEADER_BYTES, IDENT, LOD_BYTES,
    SURFACE_BYTES, TAG_BYTES, VERSION, VERTEX_BYTES, WEIGHT_BYTES,
};
use crate::write::{patch, put, put_count, put_floats, put_name, put_triangles, put_vec3};
use crate::{BoneMatrix, Frame};

impl Mdr {
    /// The model as a file: header, frames, levels, tags. Reading it gives an equal model, provided that its lists
    /// have the lengths their fields say, weights follow one another in the order of their vertices, and names fit
    /// their fields (63 bytes, 31 for tags, 15 for frames; longer ones are cut).
    ///
    /// `compressed`: bones in half the space, to the nearest 1/64 unit and 1/32766 of an axis, and frames without
    /// names.
    pub fn write(&self, compressed: bool) -> Vec<u8> {
        let frame_bytes = if compressed {
            COMPRESSED_FRAME_BYTES + self.num_bones * COMPRESSED_BONE_BYTES
        } else {
            FRAME_BYTES + self.num_bones * BONE_BYTES
        };
        let lods_at = HEADER_BYTES + self.frames.len() * frame_bytes;
        let mut out = Vec::new();
        out.extend_from_slice(IDENT);
        put(&mut out, VERSION);
        put_name::<64>(&mut out, &self.name);
        put_count(&mut out, self.frames.len());
        put_count(&mut out, self.num_bones);
        let frames_at = HEADER_BYTES as i32;
        put(&mut out, if compressed { -frames_at } else { frames_at });
        put_count(&mut out, self.lods.len());
        put_count(&mut out, lods_at);
        put_count(&mut out, self.tags.len());
        let tags_at = out.len();
        // where tags and the end are is known later
        put(&mut out, 0);
        put(&mut out, 0);
        for (number, frame) in self.frames.iter().enumerate() {
            write_frame(frame, self.frame_bones(number), compressed, &mut out);
        }
        for lod in &self.lods {
            let start = out.len();
            put_count(&mut out, lod.len());
            put_count(&mut out, LOD_BYTES);
            put(&mut out, 0);
            for surface in lod {
                write_surface(surface, &mut out);
            }
            let length = out.len() - start;
            patch(&mut out, start + 8, length);
        }
        let end = out.len();
        patch(&mut out, tags_at, end);
        patch(&mut out, tags_at + 4, end + self.tags.len() * TAG_BYTES);
        for tag in &self.tags {
            put_count(&mut out, tag.bone);
            put_name::<32>(&mut out, &tag.name);
        }
        out
    }
}

fn write_frame(frame: &Frame, bones: &[BoneMatrix], compressed: bool, out: &mut Vec<u8>) {
    put_vec3(out, frame.mins);
    put_vec3(out, frame.maxs);
    put_vec3(out, frame.local_origin);
    put_floats(out, [frame.radius]);
    if !compressed {
        put_name::<16>(out, &frame.name);
    }
    for bone in bones {
        if compressed {
            compress(bone, out);
        } else {
            put_floats(out, bone.rows.iter().flat_map(|row| row.to_array()));
        }
    }
}

fn compress(bone: &BoneMatrix, out: &mut Vec<u8>) {
    let translation = bone.translation().to_array();
    let rotation = bone.rows.iter().flat_map(|row| row.truncate().to_array());
    let translation = translation.map(|v| v / COMPRESSED_TRANSLATION);
    for value in translation
        .into_iter()
        .chain(rotation.map(|v| v / COMPRESSED_ROTATION))
    {
        // A float-to-integer cast saturates.
        let value = (value + COMPRESSED_ZERO).round() as u16;
        out.extend_from_slice(&value.to_le_bytes());
    }
}

fn write_surface(surface: &MdrSurface, out: &mut Vec<u8>) {
    let start = out.len();
    let triangles_at = SURFACE_BYTES;
    let vertices_at = triangles_at + surface.triangles.len() * TRIANGLE_BYTES;
    let end =
        vertices_at + surface.vertices.len() * VERTEX_BYTES + surface.weights.len() * WEIGHT_BYTES;
    out.extend_from_slice(IDENT);
    put_name::<64>(out, &surface.name);
    put_name::<64>(out, &surface.shader);
    put(out, 0);
    put(out, -i32::try_from(start).unwrap_or(i32::MAX));
    put_count(out, surface.vertices.len());
    put_count(out, vertices_at);
    put_count(out, surface.triangles.len());
    put_count(out, triangles_at);
    put(out, 0);
    put_count(out, end);
    put_count(out, end);
    put_triangles(out, &surface.triangles);
    for vertex in &surface.vertices {
        put_vec3(out, vertex.normal);
        put_floats(out, vertex.st.to_array());
        put(out, i32::try_from(vertex.num_weights).unwrap_or(i32::MAX));
        let first = vertex.first_weight as usize;
        let weights = surface
            .weights
            .get(first..first.saturating_add(vertex.num_weights as usize))
            .unwrap_or(&[]);
        for weight in weights {
            put(out, i32::try_from(weight.bone).unwrap_or(i32::MAX));
            put_floats(out, [weight.weight]);
            put_vec3(out, weight.offset);
        }
    }
}
