//! [`Iqm`] to bytes.

use std::collections::HashMap;

use crate::iqm::{Iqm, IqmVertex};
use crate::iqm_arrays::{
    ARRAY_BYTES, BLEND_INDEXES, BLEND_WEIGHTS, COLOR, FLOAT, NORMAL, POSITION, TEXCOORD, UBYTE,
};
use crate::iqm_header::{HEADER_BYTES, MAGIC, VERSION};
use crate::iqm_parse::{JOINT_BYTES, MESH_BYTES, POSE_BYTES};
use crate::write::{patch, put, put_count, put_floats, put_triangles, put_vec3};

/// Offset in the header of the file size, which the lists follow.
const FILE_SIZE_AT: usize = 20;
const TEXT_AT: usize = 28;

impl Iqm {
    /// The model as a file. Reading it gives an equal model, provided that its lists have the lengths their fields
    /// say, names of surfaces fit 63 bytes and no name holds a NUL. The radii beside the bounds are written as those
    /// of the boxes.
    pub fn write(&self) -> Vec<u8> {
        let mut text = Text::default();
        let names: Vec<(usize, usize)> = self
            .surfaces
            .iter()
            .map(|surface| (text.add(&surface.name), text.add(&surface.material)))
            .collect();
        let joint_names: Vec<usize> = self.joints.iter().map(|j| text.add(&j.name)).collect();
        let skinned = !self.joints.is_empty();

        let mut out = Vec::new();
        out.extend_from_slice(MAGIC);
        put_count(&mut out, VERSION as usize);
        out.resize(HEADER_BYTES, 0);
        let mut header = TEXT_AT;
        let mut put_header = |out: &mut Vec<u8>, numbers: &[usize]| {
            for &number in numbers {
                patch(out, header, number);
                header += 4;
            }
        };
        let at = out.len();
        put_header(&mut out, &[text.bytes.len(), at]);
        out.extend_from_slice(&text.bytes);
        out.resize(out.len().next_multiple_of(4), 0);

        let at = out.len();
        put_header(&mut out, &[self.surfaces.len(), at]);
        let mut first_triangle = 0;
        for (surface, (name, material)) in self.surfaces.iter().zip(names) {
            for number in [
                name,
                material,
                surface.first_vertex,
                surface.num_vertices,
                first_triangle,
                surface.triangles.len(),
            ] {
                put_count(&mut out, number);
            }
            first_triangle += surface.triangles.len();
        }
        debug_assert_eq!(out.len(), at + self.surfaces.len() * MESH_BYTES);

        let arrays = self.arrays(skinned);
        let at = out.len();
        put_header(&mut out, &[arrays.len(), self.vertices.len(), at]);
        let mut data_at = at + arrays.len() * ARRAY_BYTES;
        for (kind, format, size, data) in &arrays {
            for number in [*kind, 0, *format, *size] {
                put_count(&mut out, number as usize);
            }
            put_count(&mut out, data_at);
            data_at += data.len();
        }
        for (_, _, _, data) in &arrays {
            out.extend_from_slice(data);
        }

        let at = out.len();
        put_header(&mut out, &[first_triangle, at, 0]);
        for surface in &self.surfaces {
            let first = u32::try_from(surface.first_vertex).unwrap_or(u32::MAX);
            let moved = |corner: u32| corner.saturating_add(first);
            let triangles: Vec<_> = surface.triangles.iter().map(|t| t.map(moved)).collect();
            put_triangles(&mut out, &triangles);
        }

        let at = out.len();
        put_header(&mut out, &[self.joints.len(), at]);
        for (joint, name) in self.joints.iter().zip(joint_names) {
            put_count(&mut out, name);
            put_parent(&mut out, joint.parent);
            put_floats(&mut out, joint.pose.numbers());
        }
        debug_assert_eq!(out.len(), at + self.joints.len() * JOINT_BYTES);

        let at = out.len();
        put_header(&mut out, &[self.channels.len(), at]);
        for (channels, joint) in self.channels.iter().zip(&self.joints) {
            put_parent(&mut out, joint.parent);
            out.extend_from_slice(&channels.mask.to_le_bytes());
            put_floats(&mut out, channels.offset);
            put_floats(&mut out, channels.scale);
        }
        debug_assert_eq!(out.len(), at + self.channels.len() * POSE_BYTES);

        let at = out.len();
        let frames = self.num_frames.max(self.bounds.len());
        put_header(&mut out, &[0, 0, frames, self.numbers_per_frame, at]);
        for number in &self.frame_data {
            out.extend_from_slice(&number.to_le_bytes());
        }
        out.resize(out.len().next_multiple_of(4), 0);
        if !self.bounds.is_empty() {
            let at = out.len();
            put_header(&mut out, &[at]);
        }
        for &(mins, maxs) in &self.bounds {
            put_vec3(&mut out, mins);
            put_vec3(&mut out, maxs);
            let corner = mins.abs().max(maxs.abs());
            put_floats(&mut out, [corner.truncate().length(), corner.length()]);
        }
        let end = out.len();
        patch(&mut out, FILE_SIZE_AT, end);
        out
    }

    /// Vertex arrays: kind, format, numbers for each vertex, bytes.
    fn arrays(&self, skinned: bool) -> Vec<(u32, u32, u32, Vec<u8>)> {
        let array = |kind, format, size, put: &dyn Fn(&IqmVertex, &mut Vec<u8>)| {
            let mut data = Vec::new();
            self.vertices.iter().for_each(|v| put(v, &mut data));
            (kind, format, size, data)
        };
        let mut arrays = vec![
            array(POSITION, FLOAT, 3, &|v, out| put_vec3(out, v.position)),
            array(TEXCOORD, FLOAT, 2, &|v, out| {
                put_floats(out, v.st.to_array());
            }),
            array(NORMAL, FLOAT, 3, &|v, out| put_vec3(out, v.normal)),
        ];
        if skinned {
            arrays.push(array(BLEND_INDEXES, UBYTE, 4, &|v, out| {
                out.extend_from_slice(&v.joints);
            }));
            arrays.push(array(BLEND_WEIGHTS, FLOAT, 4, &|v, out| {
                put_floats(out, v.weights);
            }));
        }
        if self.vertices.iter().any(|v| v.color != [0; 4]) {
            arrays.push(array(COLOR, UBYTE, 4, &|v, out| {
                out.extend_from_slice(&v.color);
            }));
        }
        arrays
    }
}

fn put_parent(out: &mut Vec<u8>, parent: Option<usize>) {
    let parent = parent.and_then(|parent| i32::try_from(parent).ok());
    put(out, parent.unwrap_or(-1));
}

/// All names, each once.
struct Text {
    bytes: Vec<u8>,
    places: HashMap<String, usize>,
}

impl Default for Text {
    fn default() -> Self {
        Text {
            // a first name of nothing
            bytes: vec![0],
            places: HashMap::from([(String::new(), 0)]),
        }
    }
}

impl Text {
    fn add(&mut self, name: &str) -> usize {
        if let Some(&at) = self.places.get(name) {
            return at;
        }
        let at = self.bytes.len();
        self.bytes.extend_from_slice(name.as_bytes());
        self.bytes.push(0);
        self.places.insert(name.to_owned(), at);
        at
    }
}
