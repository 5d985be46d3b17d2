//! Shapes of constant vertices: built and compacted once, with their own vertex buffer.

use shaders::types::Vertex;

use super::super::bvh::build_triangles;
use super::super::input::Kind;
use super::super::part_mesh::{MeshPart, geometry, part_corners, part_indices};
use super::super::tracer::Tracer;
use super::{Bottom, OwnBottom};
use crate::gpu::{
    Blas, BlasBuild, BlasFlags, BlasGeometry, Buffer, BufferUsage, Device, Error, Pass,
};

/// A shape of constant vertices.
pub struct RigidShape {
    /// Number of the last frame that showed it.
    pub seen: u64,
    /// Vertices, then the driver's indices, or our nodes and triangles.
    data: Buffer,
    bottom: RigidBottom,
}

enum RigidBottom {
    Driver {
        blas: Blas,
        /// Build input until the structure is built.
        pending: Option<[BlasGeometry; 1]>,
    },
    /// `None`: no triangle can be hit.
    Own(Option<OwnBottom>),
}

impl RigidShape {
    /// A shape of some meshes, first shown in a frame. The driver's structure is built later, by
    /// [`pending`](Self::pending).
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        tracer: Tracer,
        kind: Kind,
        meshes: &[MeshPart<'_>],
        frame: u64,
    ) -> Result<Self, Error> {
        let vertices: Vec<Vertex> = meshes
            .iter()
            .flat_map(|m| m.mesh.vertices)
            .copied()
            .collect();
        let indices = part_indices(meshes);
        let mut bytes: Vec<u8> = bytemuck::cast_slice(&vertices).to_vec();
        let mut append = |part: &[u8]| {
            bytes.resize(bytes.len().next_multiple_of(16), 0);
            let at = bytes.len() as u64;
            bytes.extend_from_slice(part);
            at
        };
        let name = "trace rigid";
        if tracer.has_own_structures() {
            let corners = part_corners(&vertices, &indices);
            let built = build_triangles(&corners);
            let places = built.as_ref().map(|h| {
                let nodes = append(bytemuck::cast_slice(&h.nodes));
                (nodes, append(bytemuck::cast_slice(&h.triangles)), h.bounds)
            });
            let data = Buffer::with_data(device, name, BufferUsage::STORAGE, &bytes)?;
            let bottom = places.map(|(nodes, triangles, bounds)| OwnBottom {
                nodes: data.address() + nodes,
                triangles: data.address() + triangles,
                bounds,
            });
            return Ok(Self {
                seen: frame,
                data,
                bottom: RigidBottom::Own(bottom),
            });
        }
        let at = append(bytemuck::cast_slice(&indices));
        let data = Buffer::with_data(device, name, BufferUsage::ACCEL_INPUT, &bytes)?;
        let geometry = geometry(
            kind,
            data.address(),
            vertices.len(),
            data.address() + at,
            indices.len(),
        );
        let flags = BlasFlags {
            compact: true,
            ..BlasFlags::default()
        };
        Ok(Self {
            seen: frame,
            data,
            bottom: RigidBottom::Driver {
                blas: Blas::new(device, name, flags),
                pending: Some([geometry]),
            },
        })
    }

    /// Address of its vertices.
    pub fn vertices(&self) -> u64 {
        self.data.address()
    }

    /// Bytes on the device.
    #[cfg(test)]
    pub fn size(&self) -> u64 {
        self.data.size() + self.blas().map_or(0, Blas::size)
    }

    /// Its structure for the top level.
    pub fn bottom(&self) -> Option<Bottom> {
        match &self.bottom {
            RigidBottom::Driver { blas, .. } => Some(Bottom::Driver(blas.address())),
            RigidBottom::Own(bottom) => bottom.map(Bottom::Own),
        }
    }

    /// The driver's structure.
    pub fn blas(&self) -> Option<&Blas> {
        match &self.bottom {
            RigidBottom::Driver { blas, .. } => Some(blas),
            RigidBottom::Own(_) => None,
        }
    }

    /// Whether it is still to be built.
    pub fn has_work(&self) -> bool {
        matches!(
            self.bottom,
            RigidBottom::Driver {
                pending: Some(_),
                ..
            }
        )
    }

    /// Its build input, unless it is built.
    pub fn pending(&mut self) -> Option<BlasBuild<'_>> {
        match &mut self.bottom {
            RigidBottom::Driver {
                blas,
                pending: Some(geometries),
            } => Some(BlasBuild {
                blas,
                geometries,
                refit: false,
            }),
            _ => None,
        }
    }

    /// Marks it as built.
    pub fn settle(&mut self) {
        if let RigidBottom::Driver { pending, .. } = &mut self.bottom {
            *pending = None;
        }
    }

    /// Compacts the structure if it is built and becomes smaller. `size`: compacted, bytes.
    ///
    /// # Errors
    /// Out of memory.
    pub fn compact(&mut self, pass: &mut Pass<'_>, size: u64) -> Result<(), Error> {
        match &mut self.bottom {
            RigidBottom::Driver {
                blas,
                pending: None,
            } if size < blas.size() => pass.compact_blas(blas, size),
            _ => Ok(()),
        }
    }
}
