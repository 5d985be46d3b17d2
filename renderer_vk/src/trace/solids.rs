//! Bodies of glass: closed, and thicker than a pane. Rays refract where they enter and leave them; they pass panes
//! straight, whose second face undoes the refraction of the first.

use std::collections::{HashMap, HashSet};

use glam::Vec3;
use shaders::types::constants as c;

use super::input::{Kind, MaterialTable, StaticScene, StaticSurface};

/// Bodies of at most this thickness are panes, units.
const PANE: f32 = 16.0;
/// Corners nearer to each other than this are one, units.
const JOINED: f32 = 1.0 / 8.0;
/// Most triangles of a body from which its thickness is measured.
const MEASURED: usize = 256;

/// A triangle of glass.
#[derive(Clone, Copy, Debug)]
struct Face {
    corners: [Vec3; 3],
    /// Unit, on the front side.
    normal: Vec3,
}

impl Face {
    fn middle(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / 3.0
    }

    /// Distance at which a ray hits the face's back.
    fn behind(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let rate = self.normal.dot(direction);
        let [a, b, c] = self.corners;
        let distance = self.normal.dot(a - origin) / rate;
        if !(rate > 1.0e-6 && distance > 0.0) {
            return None;
        }
        let at = origin + direction * distance;
        // clockwise from the front; a margin, so that no ray passes between two faces
        let inside = |from: Vec3, to: Vec3| {
            let edge = (to - from).cross(at - from).dot(self.normal);
            edge <= 1.0e-3 * (to - from).length()
        };
        (inside(a, b) && inside(b, c) && inside(c, a)).then_some(distance)
    }
}

/// The faces of a surface; triangles without area are left out.
fn faces(scene: &StaticScene<'_>, surface: &StaticSurface) -> Vec<Face> {
    let corners: Vec<Vec3> = scene.corners(surface).map(|v| v.position).collect();
    let (triangles, _) = corners.as_chunks::<3>();
    let face = |&corners: &[Vec3; 3]| {
        let [a, b, c] = corners;
        let normal = (c - a).cross(b - a).try_normalize()?;
        normal.is_finite().then_some(Face { corners, normal })
    };
    triangles.iter().filter_map(face).collect()
}

/// Whether faces enclose a body thicker than a pane: behind each of them lies another's back.
fn is_solid(faces: &[Face]) -> bool {
    let step = faces.len().div_ceil(MEASURED).max(1);
    let thickness = |face: &Face| {
        let origin = face.middle();
        let behind = faces.iter().filter_map(|f| f.behind(origin, -face.normal));
        behind.min_by(f32::total_cmp)
    };
    let measured = faces.iter().step_by(step);
    !faces.is_empty() && measured.map(thickness).all(|t| t.is_some_and(|t| t > PANE))
}

/// A set of surfaces that shrinks as they are joined: the smallest index of each one's body.
struct Joined(Vec<usize>);

impl Joined {
    fn root(&mut self, mut index: usize) -> usize {
        while let Some(&above) = self.0.get(index)
            && above != index
        {
            // halves the way
            let further = self.0.get(above).copied().unwrap_or(above);
            if let Some(entry) = self.0.get_mut(index) {
                *entry = further;
            }
            index = further;
        }
        index
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if let Some(entry) = self.0.get_mut(a.max(b)) {
            *entry = a.min(b);
        }
    }
}

/// Numbers of the surfaces that belong to bodies of glass.
pub fn solid_surfaces(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> HashSet<u32> {
    const GLASS: u32 = c::MATERIAL_GLASS | c::MATERIAL_REFLECTS;
    let is_glass = |surface: &&StaticSurface| {
        let (_, info) = materials.info(surface.material);
        info.flags & GLASS == GLASS && Kind::of(info.flags) == Some(Kind::Translucent)
    };
    let glass: Vec<&StaticSurface> = scene.surfaces.iter().filter(is_glass).collect();
    let mut joined = Joined((0..glass.len()).collect());
    let mut first_at: HashMap<(u32, [i64; 3]), usize> = HashMap::new();
    for (index, surface) in glass.iter().enumerate() {
        for vertex in scene.corners(surface) {
            #[allow(clippy::cast_possible_truncation)] // saturates
            let place = (vertex.position / JOINED)
                .to_array()
                .map(|v| v.round() as i64);
            let first = *first_at.entry((surface.model, place)).or_insert(index);
            joined.join(first, index);
        }
    }
    let mut bodies: HashMap<usize, Vec<&StaticSurface>> = HashMap::new();
    for (index, surface) in glass.into_iter().enumerate() {
        bodies.entry(joined.root(index)).or_default().push(surface);
    }
    let solid = |body: &Vec<&StaticSurface>| {
        let faces: Vec<Face> = body.iter().flat_map(|s| faces(scene, s)).collect();
        is_solid(&faces)
    };
    let bodies = bodies.into_values().filter(solid);
    bodies.flatten().map(|surface| surface.number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The faces of a box, two triangles a side, without the sides of `open`.
    fn block(size: Vec3, open: &[usize]) -> Vec<Face> {
        let mut faces = Vec::new();
        for side in (0..6).filter(|side| !open.contains(side)) {
            let normal = Vec3::AXES[side / 2] * if side % 2 == 0 { 1.0 } else { -1.0 };
            let (u, v) = normal.any_orthonormal_pair();
            let place = |a: f32, b: f32| 0.5 * size * (normal + u * a + v * b);
            let corners =
                [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]].map(|[a, b]| place(a, b));
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]].map(|t: [usize; 3]| t.map(|i| corners[i])) {
                let front = (c - a).cross(b - a).dot(normal) > 0.0;
                let corners = if front { [a, b, c] } else { [a, c, b] };
                faces.push(Face { corners, normal });
            }
        }
        faces
    }

    #[test]
    fn a_closed_body_thicker_than_a_pane_is_solid() {
        assert!(is_solid(&block(Vec3::new(64.0, 20.0, 17.0), &[])));
        // a pane, also seen from its edges
        assert!(!is_solid(&block(Vec3::new(64.0, 64.0, 16.0), &[])));
        // the top is missing: it stands under a roof
        assert!(!is_solid(&block(Vec3::splat(64.0), &[4])));
        assert!(!is_solid(&block(Vec3::splat(64.0), &[0, 1, 2, 3, 4])));
        assert!(!is_solid(&[]));
        // a body with the inside out has no backs behind its faces
        let mut inverse = block(Vec3::splat(64.0), &[]);
        for face in &mut inverse {
            face.corners.swap(1, 2);
            face.normal = -face.normal;
        }
        assert!(!is_solid(&inverse));
    }

    #[test]
    fn surfaces_are_joined_in_any_order() {
        let mut joined = Joined((0..6).collect());
        for (a, b) in [(5, 4), (2, 5), (4, 2), (0, 1)] {
            joined.join(a, b);
        }
        let roots: Vec<usize> = (0..6).map(|i| joined.root(i)).collect();
        assert_eq!(roots, [0, 0, 2, 3, 2, 2]);
    }
}
