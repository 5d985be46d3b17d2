//! Texels of lightmap pages that a map's surfaces cover.

use anyhow::{Result, bail};
use glam::Vec2;
use q3bsp::{Bsp, Surface, SurfaceKind};

/// Subdivision of patches, id units; coordinates of their texels hardly depend on it.
const SUBDIVISIONS: f32 = 4.0;

/// Distance outside of a triangle at which the middle of a texel counts as inside, texels.
const SLACK: f32 = 1.0e-3;

/// Largest difference of coordinates in equal layouts, texels.
const SAME: f32 = 0.02;

/// For each page the surface that covers each texel's middle, `u32::MAX` for none. Of several the first.
pub fn covered(bsp: &Bsp) -> Vec<Vec<u32>> {
    let size = bsp.lightmap_size();
    let mut pages = vec![vec![u32::MAX; size * size]; bsp.lightmaps.len()];
    let patches = bsp.patch_meshes(SUBDIVISIONS);
    for ((index, surface), patch) in (0u32..).zip(&bsp.surfaces).zip(&patches) {
        let Some(page) = page_of(surface).and_then(|page| pages.get_mut(page)) else {
            continue; // lit by vertex
        };
        let mut mark = |corners: [Vec2; 3]| {
            fill(corners.map(|c| c * size as f32), size, |texel| {
                if let Some(slot) = page.get_mut(texel)
                    && *slot == u32::MAX
                {
                    *slot = index;
                }
            });
        };
        if let Some(mesh) = patch {
            for corners in mesh.indices().as_chunks::<3>().0 {
                let corner = |i: u32| Some(mesh.vertices.get(i as usize)?.finite().lightmap);
                if let [Some(a), Some(b), Some(c)] = corners.map(corner) {
                    mark([a, b, c]);
                }
            }
        } else if surface.kind != SurfaceKind::Patch {
            let first = usize::try_from(surface.first_index).unwrap_or(0);
            let count = usize::try_from(surface.num_indices).unwrap_or(0);
            let indices = bsp.indices.get(first..first + count).unwrap_or_default();
            for corners in indices.as_chunks::<3>().0 {
                let corner = |i: i32| {
                    let vertex = usize::try_from(surface.first_vert.checked_add(i)?).ok()?;
                    Some(bsp.vertices.get(vertex)?.finite().lightmap)
                };
                if let [Some(a), Some(b), Some(c)] = corners.map(corner) {
                    mark([a, b, c]);
                }
            }
        }
    }
    pages
}

/// Lightmap page of a surface that has one.
pub fn page_of(surface: &Surface) -> Option<usize> {
    usize::try_from(surface.lightmap).ok()
}

/// Calls `mark` for each texel whose middle lies in a triangle, in texels of a page of this size.
fn fill([a, b, c]: [Vec2; 3], size: usize, mut mark: impl FnMut(usize)) {
    let area = (b - a).perp_dot(c - a);
    if area.abs() < 1.0e-6 || !area.is_finite() {
        return;
    }
    let most = size.saturating_sub(1) as f32;
    let low = (a.min(b).min(c) - 0.5 - SLACK).ceil().max(Vec2::ZERO);
    let high = (a.max(b).max(c) - 0.5 + SLACK)
        .floor()
        .min(Vec2::splat(most));
    let outside = |p: Vec2, from: Vec2, to: Vec2| {
        let edge = to - from;
        edge.perp_dot(p - from) * area.signum() < -SLACK * edge.length()
    };
    let (mut y, last) = (low.y, high.y);
    while y <= last {
        let mut x = low.x;
        while x <= high.x {
            let p = Vec2::new(x + 0.5, y + 0.5);
            if !outside(p, a, b) && !outside(p, b, c) && !outside(p, c, a) {
                mark(y as usize * size + x as usize);
            }
            x += 1.0;
        }
        y += 1.0;
    }
}

/// Fails if two maps have different surfaces, or a surface has its lightmap at another place.
///
/// # Errors
/// Names the first difference.
pub fn same_layout(a: &Bsp, b: &Bsp) -> Result<()> {
    if a.surfaces.len() != b.surfaces.len() || a.vertices.len() != b.vertices.len() {
        bail!(
            "other geometry: {} and {} surfaces, {} and {} vertices",
            a.surfaces.len(),
            b.surfaces.len(),
            a.vertices.len(),
            b.vertices.len()
        );
    }
    if a.lightmap_size() != b.lightmap_size() {
        bail!(
            "pages of {} and {} texels",
            a.lightmap_size(),
            b.lightmap_size()
        );
    }
    let size = a.lightmap_size() as f32;
    for (index, (s, t)) in a.surfaces.iter().zip(&b.surfaces).enumerate() {
        if s.lightmap != t.lightmap {
            bail!(
                "surface {index} is on pages {} and {}",
                s.lightmap,
                t.lightmap
            );
        }
        let first = usize::try_from(s.first_vert).unwrap_or(0);
        let count = usize::try_from(s.num_verts).unwrap_or(0);
        if page_of(s).is_none() {
            continue;
        }
        let of = |bsp: &Bsp| -> Vec<Vec2> {
            let vertices = bsp.vertices.iter().skip(first).take(count);
            vertices.map(|v| v.finite().lightmap * size).collect()
        };
        if (of(a).iter().zip(of(b))).any(|(p, q)| p.distance(q) > SAME) {
            bail!("surface {index} has other lightmap coordinates");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_covered_where_their_middles_are() {
        let mut texels = Vec::new();
        let corners = [(1.0, 1.0), (4.0, 1.0), (1.0, 4.0)].map(|(x, y)| Vec2::new(x, y));
        fill(corners, 8, |t| texels.push(t));
        // middles on the diagonal count as inside
        assert_eq!(texels, [9, 10, 11, 17, 18, 25]);
        let [a, b, c] = corners;
        let mut turned = Vec::new();
        fill([a, c, b], 8, |t| turned.push(t));
        assert_eq!(turned, texels);
        fill([a, a, b], 8, |_| panic!("no area"));
        fill(corners.map(|c| c * f32::NAN), 8, |_| panic!("no place"));
        let mut far = 0;
        fill([a - 100.0, b * 1.0e6, c * 1.0e6], 8, |_| far += 1);
        assert!(far <= 64);
    }
}
