//! The refracting bodies of a map that do not move: surfaces of liquids, and closed bodies of glass. Photons are aimed at
//! them.

use std::collections::HashSet;

use glam::Vec3;
use shaders::trace_types::{BodyTriangle, PhotonView};
use shaders::types::constants as c;
use support::Aabb;

use super::input::{Kind, MaterialTable, StaticScene, StaticSurface};
use super::surroundings::{MAX_BOXES, merged};
use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// Numbers of the surfaces of these bodies. `solids`: of closed bodies of glass.
pub fn body_surfaces(
    scene: &StaticScene<'_>,
    materials: &dyn MaterialTable,
    solids: &HashSet<u32>,
) -> HashSet<u32> {
    let refracts = |surface: &&StaticSurface| {
        let (_, info) = materials.info(surface.material);
        let has = |bit| info.flags & bit != 0;
        surface.model == 0
            && Kind::of(info.flags) == Some(Kind::Translucent)
            && has(c::MATERIAL_REFLECTS)
            && (has(c::MATERIAL_LIQUID) || solids.contains(&surface.number))
    };
    let bodies = scene.surfaces.iter().filter(refracts);
    bodies.map(|surface| surface.number).collect()
}

/// Triangles of these surfaces, with the sums of their areas, and the whole area. Light enters glass by its front.
fn triangles(
    scene: &StaticScene<'_>,
    surfaces: &[&StaticSurface],
    materials: &dyn MaterialTable,
) -> (Vec<BodyTriangle>, f64) {
    let mut triangles = Vec::new();
    let mut sums = Vec::new();
    let mut sum = 0.0;
    for surface in surfaces {
        const BACKS: u32 = c::MATERIAL_TWO_SIDED | c::MATERIAL_CULL_BACK;
        let (_, info) = materials.info(surface.material);
        let is_liquid = info.flags & c::MATERIAL_LIQUID != 0;
        let two_sided = u32::from(is_liquid && info.flags & BACKS != 0);
        let corners: Vec<Vec3> = scene.corners(surface).map(|v| v.position).collect();
        for &[a, b, c] in corners.as_chunks::<3>().0 {
            let area = 0.5 * f64::from((c - a).cross(b - a).length());
            if !(area.is_finite() && area > 0.0) {
                continue;
            }
            sum += area;
            sums.push(sum);
            triangles.push(BodyTriangle {
                corners: [a, b, c],
                until: 0.0,
                two_sided,
            });
        }
    }
    for (triangle, until) in triangles.iter_mut().zip(sums) {
        #[allow(clippy::cast_possible_truncation)] // rounds
        let until = (until / sum) as f32;
        triangle.until = until;
    }
    (triangles, sum)
}

/// Refracting bodies on the GPU.
#[derive(Default)]
pub struct Bodies {
    /// Triangles, and boxes around surfaces.
    buffers: Option<[Buffer; 2]>,
    view: PhotonView,
}

impl Bodies {
    /// Uploads the bodies of a map. `numbers`: those of `body_surfaces`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        scene: &StaticScene<'_>,
        materials: &dyn MaterialTable,
        numbers: &HashSet<u32>,
    ) -> Result<Self, Error> {
        let is_body = |surface: &&StaticSurface| numbers.contains(&surface.number);
        let surfaces: Vec<&StaticSurface> = scene.surfaces.iter().filter(is_body).collect();
        let (triangles, area) = triangles(scene, &surfaces, materials);
        if triangles.is_empty() {
            return Ok(Self::default());
        }
        let bounds = |surface: &&StaticSurface| {
            let corners = scene.corners(surface);
            let bounds = corners.fold(Aabb::EMPTY, |bounds, v| bounds.with(v.position));
            bounds.grown(Vec3::ONE)
        };
        let boxes = merged(surfaces.iter().map(bounds).collect(), MAX_BOXES);
        let usage = BufferUsage::STORAGE;
        let buffers = [
            Buffer::with_data(device, "trace bodies", usage, &triangles)?,
            Buffer::with_data(device, "trace body boxes", usage, &boxes)?,
        ];
        #[allow(clippy::cast_possible_truncation)] // rounds
        let area = area as f32;
        Ok(Self {
            view: PhotonView {
                bodies: buffers[0].address(),
                boxes: buffers[1].address(),
                body_count: u32::try_from(triangles.len()).unwrap_or(u32::MAX),
                box_count: u32::try_from(boxes.len()).unwrap_or(u32::MAX),
                area,
                ..PhotonView::default()
            },
            buffers: Some(buffers),
        })
    }

    /// Whether the map has none.
    pub fn is_empty(&self) -> bool {
        self.buffers.is_none()
    }

    /// The fields that describe the bodies.
    pub fn view(&self) -> PhotonView {
        self.view
    }
}
