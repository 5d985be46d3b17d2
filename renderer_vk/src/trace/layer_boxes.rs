//! Bounding boxes of the translucent geometry in view.
//!
//! Most primary rays meet no translucent layer. A ray that searches for layers costs about a quarter of the ray for
//! opaque surfaces; a primary ray that meets none of these boxes skips it.

use glam::{Vec3, Vec4};
use shaders::types::{Instance, Vertex};
use support::{Aabb, slice};

use super::geometry::StaticGeometry;
use super::input::{Kind, MaterialTable};
use super::parts::axes;
use super::surroundings::merged;
use crate::scene::{TracedScene, turned};
use crate::world::outside;

/// Maximum number of boxes that a ray is tested against; above it, boxes are merged.
const MAX_BOXES: usize = 48;

/// A translucent surface of the map in the space of its model.
#[derive(Clone, Copy, Debug)]
pub struct StaticLayer {
    /// Index of the map's model; 0 is the world.
    pub model: u32,
    /// Its bounds.
    pub bounds: Aabb,
}

/// Bounds of vertices; infinite if one is not finite, because rays may meet its triangles.
pub fn bounds_of<'a>(vertices: impl Iterator<Item = &'a Vertex>) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    for vertex in vertices {
        if !vertex.position.is_finite() {
            return EVERYWHERE;
        }
        bounds = bounds.with(vertex.position);
    }
    bounds
}

/// Bounds of every possible map.
const EVERYWHERE: Aabb = Aabb::new(Vec3::splat(-1.0e6), Vec3::splat(1.0e6));

/// A box transformed by an instance, with a margin for rounding; `None`: the box is empty.
pub(super) fn placed(bounds: &Aabb, instance: &Instance) -> Option<Aabb> {
    if bounds.is_empty() {
        return None;
    }
    let axis = axes(instance);
    let middle = axis * bounds.centre() + instance.origin;
    let half = bounds.size() * 0.5;
    let reach =
        axis.x_axis.abs() * half.x + axis.y_axis.abs() * half.y + axis.z_axis.abs() * half.z;
    if !(middle.is_finite() && reach.is_finite()) {
        return Some(EVERYWHERE);
    }
    let reach = reach + 0.1 + 1.0e-5 * (middle.abs() + reach);
    Some(Aabb::new(middle - reach, middle + reach))
}

/// Whether primary rays of a view may meet a box.
pub(super) fn may_be_seen(bounds: &Aabb, from: Vec3, frustum: &[Vec4]) -> bool {
    // rays pass through all of a pixel, also at the picture's edge
    let farthest = (bounds.mins - from).abs().max((bounds.maxs - from).abs());
    let margin = Vec3::splat(0.01 * farthest.max_element());
    !outside(&bounds.grown(margin), frustum)
}

/// Boxes of the translucent geometry of a view: at most [`MAX_BOXES`]. `geometry`: the map's, if the view shows it.
pub fn in_sight(
    view: &TracedScene,
    geometry: Option<&StaticGeometry>,
    materials: &dyn MaterialTable,
) -> Vec<Aabb> {
    let frustum = view.view.frustum();
    let from = view.view.origin;
    let mut boxes = Vec::new();
    let mut add = |bounds: &Aabb, instance: u32| {
        let Some(instance) = slice::get(&view.instances, instance as usize) else {
            return;
        };
        let Some(bounds) = placed(bounds, instance) else {
            return; // empty
        };
        if may_be_seen(&bounds, from, &frustum) {
            boxes.push(bounds);
        }
    };
    if let Some(geometry) = geometry {
        for layer in geometry.layers.iter().filter(|layer| layer.model == 0) {
            add(&layer.bounds, 0);
        }
        for submodel in &view.look.submodels {
            let of_model = |layer: &&StaticLayer| layer.model == submodel.model;
            for layer in geometry.layers.iter().filter(of_model) {
                add(&layer.bounds, submodel.instance);
            }
        }
    }
    for mesh in &view.meshes {
        let (_, info) = materials.info(mesh.material);
        // rays that meet copies for portals search for layers unconditionally
        let straight_on = mesh.paths < turned::PORTAL;
        if straight_on && Kind::of(info.flags) == Some(Kind::Translucent) {
            let vertices = view.mesh_geometry(mesh).vertices;
            add(&bounds_of(vertices.iter()), mesh.instance);
        }
    }
    merged(boxes, MAX_BOXES)
}
