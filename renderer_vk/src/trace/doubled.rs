//! Coplanar triangles of the map that face opposite ways.
//!
//! Maps have them where one surface draws a liquid from above and another from below, each one-sided. A ray meets both
//! at the same distance, and rounding decides which of the two it reports: if the ray reports the one that it hits from
//! behind, it continues and misses the other. Therefore the sides of such triangles are tested during traversal, which
//! costs one test per hit; other triangles need no such test.

use std::collections::{HashMap, HashSet};

use glam::Vec3;
use shaders::types::constants as c;
use support::slice;

use super::input::{Kind, MaterialTable, StaticScene};

/// Planes are equal if their normals and distances differ by less than about this, units.
const NORMAL_STEP: f32 = 1.0e-3;
const DISTANCE_STEP: f32 = 0.125;
/// Boxes that overlap by no more than this, units, are separate.
const TOUCHING: f32 = 0.01;

/// Key of a plane regardless of its orientation: BSP model, normal, distance.
type PlaneKey = (u32, [i32; 3], i32);

/// A triangle with its bounds in its plane.
struct Flat {
    /// Index of its first corner in the scene's index list.
    first: usize,
    /// Its front faces along the key's normal.
    along: bool,
    /// Bounds on the plane's two main axes.
    mins: [f32; 2],
    maxs: [f32; 2],
}

/// Opaque one-sided triangles with an opposite triangle in their plane, by the index of their first corner in the
/// scene's index list.
pub fn doubled(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> HashSet<usize> {
    let mut planes: HashMap<PlaneKey, Vec<Flat>> = HashMap::new();
    for surface in &scene.surfaces {
        let (_, info) = materials.info(surface.material);
        if Kind::of(info.flags) != Some(Kind::Opaque) || info.flags & c::MATERIAL_TWO_SIDED != 0 {
            continue;
        }
        let back = info.flags & c::MATERIAL_CULL_BACK != 0;
        for (i, corner) in scene.triangles(surface).iter().enumerate() {
            let corners = corner.map(|i| slice::item(scene.vertices, i as usize).position);
            let first = surface.first_index as usize;
            if let Some((plane, flat)) = flat(first + 3 * i, corners, back) {
                let (normal, distance) = plane;
                let key = (surface.model, normal, distance);
                planes.entry(key).or_default().push(flat);
            }
        }
    }
    let mut found = HashSet::new();
    for mut flats in planes.into_values() {
        if flats.iter().all(|f| f.along) || !flats.iter().any(|f| f.along) {
            continue;
        }
        flats.sort_by(|a, b| a.mins[0].total_cmp(&b.mins[0]));
        for (i, a) in flats.iter().enumerate() {
            let after = flats.iter().skip(i + 1);
            for b in after.take_while(|b| b.mins[0] + TOUCHING < a.maxs[0]) {
                let shared = |axis: usize| {
                    a.maxs[axis].min(b.maxs[axis]) - a.mins[axis].max(b.mins[axis]) > TOUCHING
                };
                if a.along != b.along && shared(0) && shared(1) {
                    found.extend([a.first, b.first]);
                }
            }
        }
    }
    found
}

/// A triangle and its plane; `None` for a triangle without area or with non-finite corners.
#[allow(clippy::cast_possible_truncation)] // steps of unit vectors and of map coordinates
fn flat(first: usize, corners: [Vec3; 3], back: bool) -> Option<(([i32; 3], i32), Flat)> {
    let [p, q, r] = corners;
    // fronts are clockwise
    let normal = (r - p).cross(q - p).try_normalize()?;
    if !p.is_finite() {
        return None;
    }
    let size = normal.abs();
    let (lean, axes) = if size.x >= size.y && size.x >= size.z {
        (normal.x, [1, 2])
    } else if size.y >= size.z {
        (normal.y, [0, 2])
    } else {
        (normal.z, [0, 1])
    };
    let up = if lean < 0.0 { -normal } else { normal };
    let key = (up / NORMAL_STEP).round().to_array().map(|x| x as i32);
    let distance = (up.dot(p) / DISTANCE_STEP).round() as i32;
    let bound = |of: fn(Vec3, Vec3) -> Vec3| {
        let bound = of(of(p, q), r).to_array();
        axes.map(|axis: usize| bound[axis])
    };
    Some((
        (key, distance),
        Flat {
            first,
            along: (lean > 0.0) != back,
            mins: bound(Vec3::min),
            maxs: bound(Vec3::max),
        },
    ))
}
