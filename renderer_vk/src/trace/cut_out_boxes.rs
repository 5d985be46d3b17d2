//! The cut-outs of a map for rays that do not test their alpha (`rt_cutouts`): coverage and boxes.

use shaders::trace_types::CutOut;
use support::Aabb;

use super::input::{Kind, MaterialTable, StaticScene, StaticSurface};
use super::layer_boxes::bounds_of;
use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// Surfaces of a material within this distance of another's box belong to it: both faces of a grate, and the leaves of a
/// plant. Units.
const NEAR: f32 = 16.0;
/// Most boxes that are tried for a surface: bounds the time for a map of any size.
const TRIED: usize = 4096;

/// [`CutOut`]s by the number of a surface.
pub struct CutOuts(Option<Buffer>);

impl CutOuts {
    /// Uploads those of a map.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        scene: &StaticScene<'_>,
        materials: &dyn MaterialTable,
    ) -> Result<Self, Error> {
        let records = records(scene, materials);
        if records.is_empty() {
            return Ok(Self(None));
        }
        let (name, usage) = ("trace cut-outs", BufferUsage::STORAGE);
        Ok(Self(Some(Buffer::with_data(
            device, name, usage, &records,
        )?)))
    }

    /// Address of the records; 0: there are none.
    pub fn address(&self) -> u64 {
        self.0.as_ref().map_or(0, Buffer::address)
    }
}

/// A cut-out surface.
struct Member<'a> {
    surface: &'a StaticSurface,
    material: u32,
    bounds: Aabb,
}

/// The records, up to that of the last cut-out.
fn records(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> Vec<CutOut> {
    let mut members: Vec<Member<'_>> = Vec::new();
    for surface in &scene.surfaces {
        let (material, info) = materials.info(surface.material);
        if Kind::in_light(info.flags, true) == Some(Kind::Tested) {
            members.push(Member {
                surface,
                material,
                bounds: bounds_of(scene.corners(surface)),
            });
        }
    }
    let size = |member: &Member<'_>| (member.bounds.maxs - member.bounds.mins).length();
    // the largest first: smaller ones join its box
    members.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let mut things: Vec<(u32, u32, Aabb, Aabb)> = Vec::new();
    let mut places = Vec::with_capacity(members.len());
    for member in &members {
        let key = (member.surface.model, member.material);
        let bounds = member.bounds;
        let found = things
            .iter()
            .take(TRIED)
            .position(|&(model, material, reach, _)| {
                (model, material) == key
                    && reach.mins.cmple(bounds.mins).all()
                    && reach.maxs.cmpge(bounds.maxs).all()
            });
        let place = found.unwrap_or_else(|| {
            let reach = Aabb::new(bounds.mins - NEAR, bounds.maxs + NEAR);
            things.push((key.0, key.1, reach, bounds));
            things.len() - 1
        });
        if let Some((_, _, _, whole)) = things.get_mut(place) {
            *whole = whole.union(bounds);
        }
        places.push(place);
    }
    let last = members.iter().map(|member| member.surface.number).max();
    let mut records = vec![CutOut::default(); last.map_or(0, |last| last as usize + 1)];
    for (member, place) in members.iter().zip(places) {
        let record = records.get_mut(member.surface.number as usize);
        if let (Some(record), Some((_, _, _, whole))) = (record, things.get(place)) {
            *record = CutOut {
                mins: whole.mins,
                coverage: materials.mean_coverage(member.material).unwrap_or(0.0),
                maxs: whole.maxs,
            };
        }
    }
    records
}
