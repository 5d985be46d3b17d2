//! Dirt: ambient occlusion that all light of a place is multiplied by, as q3map2's `-dirty` does.

use super::smooth;
use super::targets::Targets;
use crate::world::RelitWorld;
use support::slice::{part, part_mut};

/// Part of the light that each place keeps, in the order of [`Places::lights_mut`](super::Places): of texels the mean over
/// 3 × 3. `found`: of [`Places::first_points`](super::Places).
pub(super) fn of_places(
    world: &RelitWorld,
    targets: &Targets,
    mut found: impl Iterator<Item = f32>,
) -> Vec<f32> {
    let mut all = vec![1.0; targets.places + targets.vertices.len()];
    let mut owners = vec![u32::MAX; targets.texels];
    for page in &targets.pages {
        for texel in page.texels.iter().filter(|texel| !texel.points.is_empty()) {
            let at = page.first + texel.at as usize;
            if let (Some(slot), Some(owner)) = (all.get_mut(at), owners.get_mut(at)) {
                *slot = found.next().unwrap_or(1.0);
                *owner = texel.surface;
            }
        }
        let range = page.first..page.first + page.side * page.side;
        let owners = part(&owners, range.clone());
        smooth::box_filter(world, page.side, owners, part_mut(&mut all, range));
    }
    for (index, vertex) in targets.vertices.iter().enumerate() {
        let factor = match vertex.points.is_empty() {
            true => 1.0,
            false => found.next().unwrap_or(1.0),
        };
        let drawn = vertex.drawn.map(|drawn| targets.texels + drawn as usize);
        for at in drawn.into_iter().chain([targets.places + index]) {
            if let Some(slot) = all.get_mut(at) {
                *slot = factor;
            }
        }
    }
    all
}
