//! Our own hierarchies of a frame: of geometry that changes, and the top level.

use glam::Vec3;
use shaders::trace_types::BvhInstance;
use shaders::trace_types::constants::INSTANCE_GRID;
use support::bvh::Hierarchy;
use support::{Aabb, parallel};

use super::kept::Kept;
use super::placements::{Part, Placement};
use super::{Accel, Top, rows};
use crate::gpu::{Error, Recorder};
use crate::trace::bvh::{INSTANCES, build_triangles, widen};
use crate::trace::geometry::Structure;
use crate::trace::shapes::{Bottom, OwnBottom};

impl Accel {
    /// Builds our own hierarchies of changing geometry, the top level and that of models, in the frame's memory. `fed`: rays
    /// are counted.
    pub(super) fn build_own(
        &mut self,
        rec: &mut Recorder,
        placed: &[Placement<'_>],
        fed: bool,
    ) -> Result<[Top; 2], Error> {
        let mut instances = Vec::with_capacity(placed.len());
        let mut boxes = Vec::with_capacity(placed.len());
        let mut of_models = Vec::new();
        let positions = &self.parts.positions;
        let position = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::NAN);
        let built = parallel::map(&self.parts.slots, |_, slot| {
            let corners = slot.indices.iter().map(|t| t.map(position));
            build_triangles(&corners.collect::<Vec<_>>())
        });
        let mut changing = 0;
        for p in placed {
            let found = match &p.part {
                Part::Static(Structure::Own(own)) => Some(OwnBottom {
                    nodes: own.nodes.address(),
                    triangles: own.triangles.address(),
                    bounds: own.bounds,
                }),
                Part::Static(Structure::Grid(grid)) => Some(OwnBottom {
                    nodes: grid.record.address(),
                    triangles: grid.triangles.address(),
                    bounds: grid.bounds,
                }),
                Part::Slot(index) => match built.get(*index).and_then(Option::as_ref) {
                    Some(hierarchy) => {
                        changing += size_of_val(hierarchy.nodes.as_slice())
                            + size_of_val(hierarchy.triangles.as_slice());
                        Some(OwnBottom {
                            nodes: rec.arena().push(&hierarchy.nodes)?,
                            triangles: rec.arena().push(&hierarchy.triangles)?,
                            bounds: hierarchy.bounds,
                        })
                    }
                    None => None,
                },
                Part::Kept(index, prepared) => {
                    let part = self.parts.parts.get(*index);
                    match part.and_then(|part| self.shapes.bottom(&self.parts, part, prepared)) {
                        Some(Bottom::Own(own)) => Some(own),
                        Some(Bottom::Driver(_)) | None => None,
                    }
                }
                Part::Static(Structure::Driver(_)) => None,
            };
            let Some(own) = found else {
                continue; // without a triangle
            };
            let structure = match p.part {
                Part::Static(Structure::Grid(_)) => INSTANCE_GRID,
                _ => 0,
            };
            let inverse = p.axis.inverse();
            if p.of_model {
                of_models.push(boxes.len());
            }
            boxes.push(Aabb::of(
                own.bounds.corners().map(|c| p.axis * c + p.origin),
            ));
            instances.push(BvhInstance {
                nodes: own.nodes,
                triangles: own.triangles,
                to_object: rows(inverse, -(inverse * p.origin)),
                geometry: p.record,
                mask: u32::from(p.mask) | structure,
            });
        }
        let kept = match self.own_kept.take().filter(|_| fed) {
            None if fed => Some(Kept::new(rec.device())?),
            kept => kept,
        };
        self.own_kept = kept;
        let before = self.own_kept.as_ref().map_or(0, |kept| kept.written);
        let (top, bytes) = own_top(rec, &boxes, &instances, self.own_kept.as_mut())?;
        let written = self.own_kept.as_ref().map(|kept| kept.written - before);
        self.cost.written += written.unwrap_or(instances.len() as u64);
        self.own_bytes = [changing as u64, bytes];
        let mut models = Top::default();
        if self.has_models {
            let boxes: Vec<Aabb> = pick(&boxes, &of_models);
            let instances: Vec<BvhInstance> = pick(&instances, &of_models);
            (models, _) = own_top(rec, &boxes, &instances, None)?;
        }
        Ok([top, models])
    }
}

/// The members of a list at these places.
fn pick<T: Copy>(list: &[T], places: &[usize]) -> Vec<T> {
    places
        .iter()
        .filter_map(|&i| list.get(i).copied())
        .collect()
}

/// A top level of ours in the frame's memory, and its bytes. The GPU lists the instances of `kept`.
fn own_top(
    rec: &mut Recorder,
    boxes: &[Aabb],
    instances: &[BvhInstance],
    kept: Option<&mut Kept<BvhInstance>>,
) -> Result<(Top, u64), Error> {
    let top = Hierarchy::new(boxes, INSTANCES);
    let ordered: Vec<BvhInstance> = (top.order().iter())
        .filter_map(|&i| instances.get(i as usize).copied())
        .collect();
    let nodes = widen(&top);
    let bytes = size_of_val(nodes.as_slice()) + size_of_val(ordered.as_slice());
    if nodes.is_empty() {
        return Ok((Top::default(), bytes as u64));
    }
    let placed = match kept {
        Some(kept) => {
            kept.take(
                ordered
                    .iter()
                    .map(|instance| (instance.geometry, *instance)),
            );
            kept.record(rec)?
        }
        None => rec.arena().push(&ordered)?,
    };
    let top = Top {
        nodes: rec.arena().push(&nodes)?,
        placed,
        ..Top::default()
    };
    Ok((top, bytes as u64))
}
