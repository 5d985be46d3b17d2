//! Smoothing of reflected light between the texels of a surface.

use super::Light;
use crate::world::RelitWorld;
use support::slice::item;

/// Weights of neighbours at 0, 1 and 2 texels: a binomial filter.
const WEIGHTS: [f32; 3] = [6.0, 4.0, 1.0];

/// Smallest cosine between the normals of surfaces that share light.
const SAME_NORMAL: f32 = 0.95;

/// Smooths a page; `owners`: for each texel its surface, or `u32::MAX`.
pub(super) fn smooth(world: &RelitWorld, side: usize, owners: &[u32], light: &mut [Light]) {
    for step in [1, side] {
        let before = light.to_vec();
        for (texel, slot) in light.iter_mut().enumerate() {
            let owner = item_or_none(owners, texel);
            if owner == u32::MAX {
                continue;
            }
            let (mut sum, mut whole) = (Light::default(), 0.0);
            for (distance, weight) in WEIGHTS.into_iter().enumerate() {
                let both = [
                    texel.checked_sub(distance * step),
                    Some(texel + distance * step),
                ];
                let count = if distance == 0 { 1 } else { 2 };
                for other in both.into_iter().take(count).flatten() {
                    // a row of the page ends where the next begins
                    let same_row = step != 1 || other / side == texel / side;
                    let other_owner = item_or_none(owners, other);
                    if same_row && other_owner != u32::MAX && alike(world, owner, other_owner) {
                        sum += item(&before, other) * weight;
                        whole += weight;
                    }
                }
            }
            if whole > 0.0 {
                *slot = sum * (1.0 / whole);
            }
        }
    }
}

/// Gives each texel of a page that has an owner the mean over 3 × 3 texels of its plane.
pub(super) fn box_filter(world: &RelitWorld, side: usize, owners: &[u32], values: &mut [f32]) {
    let before = values.to_vec();
    for (texel, slot) in values.iter_mut().enumerate() {
        let owner = item_or_none(owners, texel);
        if owner == u32::MAX {
            continue;
        }
        let (x, y) = (texel % side, texel / side);
        let (mut sum, mut count) = (0.0, 0.0f32);
        for row in y.saturating_sub(1)..=(y + 1).min(side - 1) {
            for column in x.saturating_sub(1)..=(x + 1).min(side - 1) {
                let other = row * side + column;
                let other_owner = item_or_none(owners, other);
                if other_owner != u32::MAX && alike(world, owner, other_owner) {
                    sum += item(&before, other);
                    count += 1.0;
                }
            }
        }
        if count > 0.0 {
            *slot = sum / count;
        }
    }
}

fn item_or_none(owners: &[u32], at: usize) -> u32 {
    owners.get(at).copied().unwrap_or(u32::MAX)
}

/// Whether two surfaces are one, or lie in one plane.
fn alike(world: &RelitWorld, a: u32, b: u32) -> bool {
    let plane = |surface: u32| world.surfaces.get(surface as usize)?.plane;
    a == b
        || match (plane(a), plane(b)) {
            (Some(a), Some(b)) => {
                a.normal.dot(b.normal) > SAME_NORMAL && (a.dist - b.dist).abs() < 1.0
            }
            _ => false,
        }
}
