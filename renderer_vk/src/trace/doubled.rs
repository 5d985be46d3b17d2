//! Triangles of the map that lie in one plane with others that face the other way.
//!
//! Maps have them where a liquid's surface is drawn from above and from below, by two surfaces that show one face each.
//! A ray meets both at the same distance, and which of them it is told of is left to the last bits: told of the one that
//! does not show its face, it would go on and miss the other. So the sides of such triangles are decided where the ray
//! meets them, which costs a test each; all others need none.

use std::collections::{HashMap, HashSet};

use glam::Vec3;
use shaders::types::constants as c;

use super::input::{Kind, MaterialTable, StaticScene};

/// Planes are alike when their normals and distances differ by less than about these, units.
const NORMAL_STEP: f32 = 1.0e-3;
const DISTANCE_STEP: f32 = 0.125;
/// Boxes that share no more than this are side by side, units.
const TOUCHING: f32 = 0.01;

/// A plane whichever way it faces, of a model of the map.
type PlaneKey = (u32, [i32; 3], i32);

/// A triangle in its plane.
struct Flat {
    /// Place of its first corner among the scene's indices.
    first: usize,
    /// It shows its face where the key's normal points.
    along: bool,
    /// Around it, on the two axes that the plane leans to least.
    mins: [f32; 2],
    maxs: [f32; 2],
}

/// Opaque triangles that show one side and have an opposite in their plane, by the places of their first corners among the
/// scene's indices.
pub fn doubled(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> HashSet<usize> {
    let mut planes: HashMap<PlaneKey, Vec<Flat>> = HashMap::new();
    for surface in &scene.surfaces {
        let (_, info) = materials.info(surface.material);
        if Kind::of(info.flags) != Some(Kind::Opaque) || info.flags & c::MATERIAL_TWO_SIDED != 0 {
            continue;
        }
        let back = info.flags & c::MATERIAL_CULL_BACK != 0;
        for (i, corner) in scene.triangles(surface).iter().enumerate() {
            let place = |i: u32| scene.vertices.get(i as usize).map(|v| v.position);
            let [Some(p), Some(q), Some(r)] = corner.map(place) else {
                continue;
            };
            let first = surface.first_index as usize;
            if let Some((plane, flat)) = flat(first + 3 * i, [p, q, r], back) {
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

/// A triangle and its plane; `None` for one without area, or without numbers.
#[allow(clippy::cast_possible_truncation)] // steps of unit vectors, and of a map's size
fn flat(first: usize, corners: [Vec3; 3], back: bool) -> Option<(([i32; 3], i32), Flat)> {
    let [p, q, r] = corners;
    // the front is where the corners go round clockwise
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
