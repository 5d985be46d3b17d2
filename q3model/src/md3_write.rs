//! [`Md3`] to bytes, in the layout that exporters use.

use crate::md3::Md3;
use crate::md3_parse::{
    FRAME_BYTES, HEADER_BYTES, IDENT, SHADER_BYTES, ST_BYTES, SURFACE_BYTES, TAG_BYTES,
    TRIANGLE_BYTES, VERSION, VERTEX_BYTES,
};
use crate::write::{patch, put, put_count, put_floats, put_name, put_triangles, put_vec3};

impl Md3 {
    /// The model as a file: header, frames, tags, surfaces. Reading it gives an equal model, provided
    /// that its lists have the lengths their fields say and names fit their fields (63 bytes, 15 for
    /// frames; longer ones are cut). A file that was read is not reproduced byte for byte: exporters
    /// differ in order, and flags and the case of surface names are not kept.
    pub fn write(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let tags_at = HEADER_BYTES + self.frames.len() * FRAME_BYTES;
        let surfaces_at = tags_at + self.tags.len() * TAG_BYTES;
        out.extend_from_slice(IDENT);
        put(&mut out, VERSION);
        put_name::<64>(&mut out, &self.name);
        put(&mut out, 0);
        put_count(&mut out, self.frames.len());
        put_count(&mut out, self.num_tags);
        put_count(&mut out, self.surfaces.len());
        put(&mut out, 0);
        put_count(&mut out, HEADER_BYTES);
        put_count(&mut out, tags_at);
        put_count(&mut out, surfaces_at);
        let end_at = out.len();
        put(&mut out, 0);
        for frame in &self.frames {
            put_vec3(&mut out, frame.mins);
            put_vec3(&mut out, frame.maxs);
            put_vec3(&mut out, frame.local_origin);
            put_floats(&mut out, [frame.radius]);
            put_name::<16>(&mut out, &frame.name);
        }
        for tag in &self.tags {
            put_name::<64>(&mut out, &tag.name);
            put_vec3(&mut out, tag.origin);
            tag.axis
                .into_iter()
                .for_each(|axis| put_vec3(&mut out, axis));
        }
        for surface in &self.surfaces {
            self.write_surface(surface, &mut out);
        }
        let end = out.len();
        patch(&mut out, end_at, end);
        out
    }

    fn write_surface(&self, surface: &crate::Surface, out: &mut Vec<u8>) {
        let triangles_at = SURFACE_BYTES;
        let shaders_at = triangles_at + surface.triangles.len() * TRIANGLE_BYTES;
        let st_at = shaders_at + surface.shaders.len() * SHADER_BYTES;
        let vertices_at = st_at + surface.st.len() * ST_BYTES;
        let end = vertices_at + surface.vertices.len() * VERTEX_BYTES;
        out.extend_from_slice(IDENT);
        put_name::<64>(out, &surface.name);
        put(out, 0);
        put_count(out, self.frames.len());
        put_count(out, surface.shaders.len());
        put_count(out, surface.num_verts);
        put_count(out, surface.triangles.len());
        for offset in [triangles_at, shaders_at, st_at, vertices_at, end] {
            put_count(out, offset);
        }
        put_triangles(out, &surface.triangles);
        for shader in &surface.shaders {
            put_name::<64>(out, shader);
            put(out, 0);
        }
        for st in &surface.st {
            put_floats(out, st.to_array());
        }
        for vertex in &surface.vertices {
            for value in vertex.position {
                out.extend_from_slice(&value.to_le_bytes());
            }
            out.extend_from_slice(&vertex.normal.to_le_bytes());
        }
    }
}
