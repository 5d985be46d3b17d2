//! Bytes to [`Iqm`].

use glam::Vec3;

use crate::Error;
use crate::bytes::{Fields, TRIANGLE_BYTES, check_sharing, read_triangles};
use crate::iqm::{IQM_WEIGHTS, Iqm, IqmChannels, IqmJoint, IqmPose, IqmSurface, IqmVertex};
use crate::iqm_arrays::Arrays;
use crate::iqm_header::{Header, list};

pub(crate) const MESH_BYTES: usize = 24;
pub(crate) const JOINT_BYTES: usize = 48;
pub(crate) const POSE_BYTES: usize = 88;
pub(crate) const BOUNDS_BYTES: usize = 32;

/// Longest name of a surface or shader, as long as the engine's.
const MAX_NAME: usize = 63;
/// Bytes of a vertex in memory, at most; a file has half of that at least.
const VERTEX_MEMORY: usize = 64;

impl Iqm {
    /// Reads and validates a model. The engine's limits on the size of the file, on joints, and on vertices and
    /// triangles per surface, do not apply. Animations, tangents, adjacency and extensions are not kept.
    ///
    /// # Errors
    /// A wrong magic or version; a file shorter than its header's size; no positions, normals or texture coordinates, or no
    /// weights where there are joints; arrays of a form that the engine does not take; counts or offsets that lead
    /// outside the file; triangle corners that name no vertex of their surface; weights and parents that name no
    /// joint, or a parent that does not come first; poses that are not one for each joint.
    pub fn parse(bytes: &[u8]) -> Result<Iqm, Error> {
        let header = Header::read(bytes)?;
        if header.file_size as usize > bytes.len() {
            return Err(Error::OutsideFile {
                what: "the file's own size".to_owned(),
                offset: 0,
                length: u64::from(header.file_size),
                file_length: bytes.len(),
            });
        }
        let mut reader = Reader {
            bytes,
            text: list(bytes, "text", header.text.1, header.text.0, 1)?,
            claimed: 0,
        };
        let joints = reader.joints(&header)?;
        let vertices = reader.vertices(&header, joints.len())?;
        let surfaces = reader.surfaces(&header)?;
        let channels = reader.channels(&header, joints.len())?;
        let num_frames = if channels.is_empty() {
            0
        } else {
            header.num_frames as usize
        };
        let numbers = header.num_frames.checked_mul(header.numbers_per_frame);
        let frame_data: Vec<u16> = match numbers.filter(|_| num_frames > 0) {
            Some(numbers) => list(bytes, "frames", header.frames_at, numbers, 2)?
                .chunks_exact(2)
                .map(|number| u16::from_le_bytes(Fields::new(number).bytes()))
                .collect(),
            None if num_frames > 0 => {
                return Err(Error::Value {
                    what: "numbers per frame".to_owned(),
                    value: i64::from(header.numbers_per_frame),
                    expected: format!("which is too much for {num_frames} frames"),
                });
            }
            None => Vec::new(),
        };
        let bounds = if header.bounds_at == 0 {
            // the engine finds those of a model that never moves itself
            let none = vertices.is_empty() || header.num_frames > 0;
            let places = || vertices.iter().map(|vertex| vertex.position);
            let mins = places().fold(Vec3::INFINITY, Vec3::min);
            let maxs = places().fold(Vec3::NEG_INFINITY, Vec3::max);
            if none { Vec::new() } else { vec![(mins, maxs)] }
        } else {
            list(
                bytes,
                "bounds",
                header.bounds_at,
                header.num_frames,
                BOUNDS_BYTES,
            )?
            .chunks_exact(BOUNDS_BYTES)
            .map(|record| {
                let mut f = Fields::new(record);
                (f.vec3(), f.vec3())
            })
            .collect()
        };
        Ok(Iqm {
            surfaces,
            vertices,
            joints,
            channels,
            num_frames,
            frame_data,
            numbers_per_frame: if num_frames > 0 {
                header.numbers_per_frame as usize
            } else {
                0
            },
            bounds,
        })
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    text: &'a [u8],
    /// Bytes of memory that names and surfaces ask for.
    claimed: u64,
}

impl Reader<'_> {
    fn claim(&mut self, length: usize) -> Result<(), Error> {
        self.claimed += length as u64;
        check_sharing(self.claimed, self.bytes.len())
    }

    /// A name in the text.
    fn name(&mut self, at: u32, what: impl Fn() -> String) -> Result<String, Error> {
        let Some(rest) = self.text.get(at as usize..).filter(|rest| !rest.is_empty()) else {
            return Err(Error::Value {
                what: format!("name of {}", what()),
                value: i64::from(at),
                expected: format!("outside the text of {} bytes", self.text.len()),
            });
        };
        let name = rest.split(|&b| b == 0).next().unwrap_or(&[]);
        self.claim(name.len())?;
        Ok(String::from_utf8_lossy(name).into_owned())
    }

    fn joints(&mut self, header: &Header) -> Result<Vec<IqmJoint>, Error> {
        let (count, at) = header.joints;
        let mut joints = Vec::new();
        let records = list(self.bytes, "joints", at, count, JOINT_BYTES)?;
        for (number, record) in records.chunks_exact(JOINT_BYTES).enumerate() {
            let mut f = Fields::new(record);
            let name = self.name(f.u32(), || format!("joint {number}"))?;
            let parent = f.i32();
            let pose = IqmPose::from_numbers(std::array::from_fn(|_| f.f32()));
            let parent = match parent {
                -1 => None,
                _ => Some(
                    usize::try_from(parent)
                        .ok()
                        .filter(|&parent| parent < number)
                        .ok_or_else(|| Error::Value {
                            what: format!("parent of joint {number}"),
                            value: i64::from(parent),
                            expected: "but has to be an earlier joint or -1".to_owned(),
                        })?,
                ),
            };
            joints.push(IqmJoint { name, parent, pose });
        }
        Ok(joints)
    }

    fn vertices(&mut self, header: &Header, joints: usize) -> Result<Vec<IqmVertex>, Error> {
        let arrays = Arrays::read(self.bytes, header)?;
        let count = header.num_vertices as usize;
        if count == 0 {
            return Ok(Vec::new());
        }
        let [Some(positions), Some(normals), Some(texcoords)] =
            [arrays.positions, arrays.normals, arrays.texcoords]
        else {
            return Err(missing("positions, normals or texture coordinates"));
        };
        if joints > 0 && (arrays.indexes.is_none() || arrays.weights.is_none()) {
            return Err(missing("joints of vertices or their weights"));
        }
        self.claim(count.saturating_mul(VERTEX_MEMORY))?;
        let parts = positions
            .chunks_exact(12)
            .zip(normals.chunks_exact(12))
            .zip(texcoords.chunks_exact(8));
        let mut vertices: Vec<IqmVertex> = parts
            .map(|((position, normal), st)| IqmVertex {
                position: Fields::new(position).vec3(),
                normal: Fields::new(normal).vec3(),
                st: Fields::new(st).vec2(),
                color: [0; 4],
                joints: [0; IQM_WEIGHTS],
                weights: [0.0; IQM_WEIGHTS],
            })
            .collect();
        if let Some(colors) = arrays.colors {
            for (vertex, color) in vertices.iter_mut().zip(colors.chunks_exact(4)) {
                vertex.color = Fields::new(color).bytes();
            }
        }
        if let (Some(indexes), Some(weights)) = (arrays.indexes, arrays.weights)
            && joints > 0
        {
            for (number, vertex) in vertices.iter_mut().enumerate() {
                vertex.weights = weights.shares(number);
                for (slot, joint) in indexes.four(number).into_iter().enumerate() {
                    let used = vertex.weights.get(..=slot).is_some_and(all_positive);
                    let joint = if used { joint } else { 0.0 };
                    if !(joint >= 0.0 && joint < joints as f32 && joint <= 255.0) {
                        return Err(Error::Value {
                            what: format!("joint of vertex {number}"),
                            value: joint as i64,
                            expected: format!("outside its {joints} joints"),
                        });
                    }
                    if let Some(place) = vertex.joints.get_mut(slot) {
                        *place = joint as u8;
                    }
                }
            }
        }
        Ok(vertices)
    }

    fn surfaces(&mut self, header: &Header) -> Result<Vec<IqmSurface>, Error> {
        let (count, at) = header.meshes;
        let (num_triangles, triangles_at) = header.triangles;
        let triangles = list(
            self.bytes,
            "triangles",
            triangles_at,
            num_triangles,
            TRIANGLE_BYTES,
        )?;
        let mut surfaces = Vec::new();
        let records = list(self.bytes, "meshes", at, count, MESH_BYTES)?;
        for (number, record) in records.chunks_exact(MESH_BYTES).enumerate() {
            let what = |part: &str| format!("{part} of mesh {number}");
            let mut f = Fields::new(record);
            let mut name = self.name(f.u32(), || format!("mesh {number}"))?;
            let mut material = self.name(f.u32(), || what("material"))?;
            for name in [&mut name, &mut material] {
                let end = (0..=MAX_NAME).rfind(|&at| name.is_char_boundary(at));
                name.truncate(end.unwrap_or(0));
            }
            name.make_ascii_lowercase();
            let (first_vertex, num_vertices) = (f.u32(), f.u32());
            let (first_triangle, num_corners) = (f.u32(), f.u32());
            if first_vertex.saturating_add(num_vertices) > header.num_vertices {
                return Err(Error::Value {
                    what: what("vertices"),
                    value: i64::from(first_vertex) + i64::from(num_vertices),
                    expected: format!("outside the {} of the model", header.num_vertices),
                });
            }
            let start = (first_triangle as usize).saturating_mul(TRIANGLE_BYTES);
            let length = (num_corners as usize).saturating_mul(TRIANGLE_BYTES);
            let Some(own) = triangles.get(start..start.saturating_add(length)) else {
                return Err(Error::Value {
                    what: what("triangles"),
                    value: i64::from(first_triangle) + i64::from(num_corners),
                    expected: format!("outside the {num_triangles} of the model"),
                });
            };
            self.claim(MESH_BYTES + own.len())?;
            surfaces.push(IqmSurface {
                name,
                material,
                first_vertex: first_vertex as usize,
                num_vertices: num_vertices as usize,
                triangles: read_triangles(own, first_vertex, num_vertices as usize, |at| {
                    what(&format!("corner of triangle {at}"))
                })?,
            });
        }
        Ok(surfaces)
    }

    fn channels(&self, header: &Header, joints: usize) -> Result<Vec<IqmChannels>, Error> {
        let (count, at) = header.poses;
        if count != 0 && count as usize != joints {
            return Err(Error::Value {
                what: "number of poses".to_owned(),
                value: i64::from(count),
                expected: format!("but there are {joints} joints"),
            });
        }
        let channels: Vec<IqmChannels> = list(self.bytes, "poses", at, count, POSE_BYTES)?
            .chunks_exact(POSE_BYTES)
            .map(|record| {
                let mut f = Fields::new(record);
                // the joints' own parents count
                let _parent = f.i32();
                IqmChannels {
                    mask: f.u32(),
                    offset: std::array::from_fn(|_| f.f32()),
                    scale: std::array::from_fn(|_| f.f32()),
                }
            })
            .collect();
        let stored: usize = channels.iter().map(IqmChannels::stored_numbers).sum();
        if stored > header.numbers_per_frame as usize {
            return Err(Error::Value {
                what: "numbers per frame".to_owned(),
                value: i64::from(header.numbers_per_frame),
                expected: format!("but the poses need {stored}"),
            });
        }
        Ok(channels)
    }
}

fn missing(what: &str) -> Error {
    Error::Value {
        what: format!("number of arrays of {what}"),
        value: 0,
        expected: "but the model needs them".to_owned(),
    }
}

fn all_positive(weights: &[f32]) -> bool {
    weights.iter().all(|&weight| weight > 0.0)
}
