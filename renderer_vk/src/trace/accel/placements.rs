//! What the top level of a view holds, before its structures are built.

use std::iter;

use glam::{Mat3, Vec3};
use shaders::trace_types::GeometryRecord;
use support::slice;

use crate::scene::TracedScene;
use crate::trace::geometry::{StaticGeometry, StaticPart, Structure};
use crate::trace::input::Kind;
use crate::trace::parts::{Seen, axes, is_solid};
use crate::trace::shapes::Prepared;

/// Triangles of one geometry record, for [`FirstHits`](super::super::first_hits::FirstHits).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawnGeometry {
    /// Index of the record.
    pub record: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// `MASK_*` bits of the rays that meet it.
    pub mask: u8,
    /// Kind of its triangles.
    pub kind: Kind,
}

/// Source of a placement, before the structures are built.
pub enum Part<'a> {
    /// A structure of the map.
    Static(&'a Structure),
    /// Index of the slot.
    Slot(usize),
    /// Index of the part.
    Kept(usize, Prepared),
}

/// A structure with its transform.
pub struct Placement<'a> {
    pub part: Part<'a>,
    pub axis: Mat3,
    pub origin: Vec3,
    pub record: u32,
    pub mask: u8,
    pub kind: Kind,
    /// It belongs to a model.
    pub of_model: bool,
}

/// The placements of a view.
#[derive(Default)]
pub struct Placements<'a> {
    pub placed: Vec<Placement<'a>>,
    /// One record per geometry of a structure; a hit's record index is the structure's first plus the geometry's
    /// number.
    pub records: Vec<GeometryRecord>,
    /// The same as draws.
    pub drawn: Vec<DrawnGeometry>,
}

impl<'a> Placements<'a> {
    pub fn add(
        &mut self,
        part: Part<'a>,
        (axis, origin): (Mat3, Vec3),
        mask: u8,
        kind: Kind,
        records: impl IntoIterator<Item = (GeometryRecord, Kind, u32)>,
    ) {
        self.placed.push(Placement {
            part,
            axis,
            origin,
            record: u32::try_from(self.records.len()).unwrap_or(u32::MAX),
            mask,
            kind,
            of_model: false,
        });
        for (record, kind, triangles) in records {
            self.drawn.push(DrawnGeometry {
                record: u32::try_from(self.records.len()).unwrap_or(u32::MAX),
                triangles,
                mask,
                kind,
            });
            self.records.push(record);
        }
    }

    /// Adds the record of a part that is left out.
    pub fn skip(&mut self) {
        self.records.push(GeometryRecord::default());
    }

    /// Adds the world and the brush models of a view.
    pub fn add_map(&mut self, view: &TracedScene, geometry: &'a StaticGeometry) {
        let submodels = view.look.submodels.iter().map(|s| (s.model, s.instance));
        for (model, index) in iter::once((0, 0)).chain(submodels) {
            let Some(instance) = slice::get(&view.instances, index as usize) else {
                continue;
            };
            let axis = axes(instance);
            // axes without volume have no inverse: the model is left out
            if !is_solid(axis) {
                continue;
            }
            for blas in geometry.structures.iter().filter(|s| s.model == model) {
                let Some(first) = slice::get(&blas.parts, 0) else {
                    continue;
                };
                let record = |part: &StaticPart| {
                    let record = GeometryRecord {
                        triangles: part.triangles,
                        vertices: geometry.vertices,
                        instance: index,
                        kind: part.kind.index(),
                    };
                    (record, part.kind, part.count)
                };
                let mask = |mask, part: &StaticPart| mask | Seen::Always.mask(part.kind);
                let mask = blas.parts.iter().fold(0, mask);
                let structure = Part::Static(&blas.structure);
                let records = blas.parts.iter().map(record);
                self.add(
                    structure,
                    (axis, instance.origin),
                    mask,
                    first.kind,
                    records,
                );
            }
        }
    }
}
