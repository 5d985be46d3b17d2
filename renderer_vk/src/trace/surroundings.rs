//! Transmission of light in a map: surfaces that filter light, and the liquids that a camera can be in.

use glam::{Vec3, Vec4};
use q3bsp::{Brush, Bsp};
use support::Aabb;

use crate::assets::Assets;
use crate::gpu::{Buffer, BufferUsage, Device, Error};
use crate::world::World;

/// Maximum number of boxes that a shadow ray is tested against; above it, boxes are merged.
pub const MAX_BOXES: usize = 16;
/// Margin for deformed surfaces, units: the usual maximum of a deformation.
const DEFORMATION: f32 = 16.0;

/// A brush of liquid.
struct Liquid {
    /// Outward planes: a point is outside where `xyz . p > w`.
    planes: Vec<Vec4>,
    absorption: Vec3,
}

/// Filtering surfaces and liquids of a map.
#[derive(Default)]
pub struct Surroundings {
    boxes: Option<Buffer>,
    count: u32,
    liquids: Vec<Liquid>,
}

impl Surroundings {
    /// Collects them from a map.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn new(device: &Device, world: &World, assets: &Assets) -> Result<Self, Error> {
        let data = &world.data;
        let dielectric = |material: u32| {
            let drawn = assets.materials.resolve(material);
            assets.materials.get(drawn).dielectric
        };
        let boxes: Vec<Aabb> = data
            .surfaces
            .iter()
            .filter(|s| s.model == 0 && s.index_count > 0 && dielectric(s.material).filters != 0)
            .map(|s| {
                let margin = if s.deformed { DEFORMATION } else { 0.0 };
                s.bounds.grown(Vec3::splat(margin + 1.0))
            })
            .collect();
        let liquids = (data.surfaces.iter())
            .map(|s| s.material)
            .collect::<std::collections::BTreeSet<u32>>()
            .into_iter()
            .filter(|&material| dielectric(material).absorption != Vec3::ZERO)
            .flat_map(|material| {
                let name = &assets.materials.get(material).name;
                brushes(&data.relit.bsp, name, dielectric(material).absorption)
            })
            .collect();
        Ok(Self {
            liquids,
            ..Self::of_boxes(device, boxes)?
        })
    }

    /// Only filtering surfaces, in these boxes.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn of_boxes(device: &Device, boxes: Vec<Aabb>) -> Result<Self, Error> {
        let boxes = merged(boxes, MAX_BOXES);
        let count = u32::try_from(boxes.len()).unwrap_or(u32::MAX);
        let boxes = (count > 0)
            .then(|| Buffer::with_data(device, "trace filters", BufferUsage::STORAGE, &boxes))
            .transpose()?;
        Ok(Self {
            boxes,
            count,
            liquids: Vec::new(),
        })
    }

    /// Device address of the boxes around filtering surfaces; 0: there are none.
    pub fn filters(&self) -> u64 {
        self.boxes.as_ref().map_or(0, Buffer::address)
    }

    /// Number of these boxes.
    pub fn filter_count(&self) -> u32 {
        self.count
    }

    /// Absorption per unit of length of the liquid at a point; zero outside of liquids.
    pub fn absorption(&self, point: Vec3) -> Vec3 {
        let outside = |plane: &Vec4| plane.truncate().dot(point) > plane.w;
        let around = |liquid: &&Liquid| !liquid.planes.iter().any(outside);
        (self.liquids.iter().find(around)).map_or(Vec3::ZERO, |l| l.absorption)
    }
}

/// The world's brushes of a material.
fn brushes(bsp: &Bsp, name: &str, absorption: Vec3) -> Vec<Liquid> {
    let world = bsp.models.first();
    let brushes = world.map_or(&[][..], |world| bsp.brushes_of(world));
    let named = |b: &&Brush| bsp.shader(b.shader).name.eq_ignore_ascii_case(name);
    brushes
        .iter()
        .filter(named)
        .filter_map(|brush| {
            let sides = bsp.sides_of(brush).iter();
            let planes: Vec<Vec4> = sides
                .map(|side| bsp.plane(side.plane))
                .map(|plane| plane.normal.extend(plane.dist))
                .collect();
            (planes.len() >= 4).then_some(Liquid { planes, absorption })
        })
        .collect()
}

/// At most `limit` boxes that cover all of these: merges neighbours along the longest axis.
pub fn merged(mut boxes: Vec<Aabb>, limit: usize) -> Vec<Aabb> {
    boxes.retain(|b| b.is_finite());
    if boxes.len() <= limit {
        return boxes;
    }
    let union = |boxes: &[Aabb]| boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
    let axis = union(&boxes).size().max_position();
    let middle = |b: &Aabb| b.mins[axis] + b.maxs[axis];
    boxes.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
    let share = boxes.len().div_ceil(limit);
    boxes.chunks(share).map(union).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merged_boxes_hold_every_one() {
        let boxes: Vec<Aabb> = (0..100)
            .map(|i| {
                let at = Vec3::new((i * 37 % 100) as f32 * 10.0, (i % 7) as f32, 0.0);
                Aabb::new(at, at + 5.0)
            })
            .collect();
        let few = merged(boxes.clone(), 16);
        assert!(few.len() <= 16 && !few.is_empty());
        for b in &boxes {
            assert!(few.iter().any(|f| f.union(*b) == *f), "{b:?}");
        }
        // and none covers everything
        assert!(few.iter().all(|f| f.size().x < 300.0));
        assert_eq!(merged(boxes[..3].to_vec(), 16), boxes[..3]);
    }
}
