//! The light that the sample's map stores, computed as a map compiler does: lamps with shadows, the sun through the
//! windows, and an even light from all sides that stands for what the walls throw back.

use glam::{Vec2, Vec3};
use q3bsp::{Bsp, GridPoint, LIGHTMAP_SIZE, SurfaceKind};
use support::parallel;

use super::scene::Place;
use super::windows;
use crate::occluders::Occluders;

/// Direction to the sun of the script: 65 degrees clockwise from +x, 36 up.
pub(super) const SUN: Vec3 = Vec3::new(0.341_91, -0.733_22, 0.587_79);
/// Colour and value of the sun of the script.
const SUN_LIGHT: Vec3 = Vec3::new(340.0, 272.0, 187.0);
/// Offsets of the sun's direction, for soft shadows: about its radius.
const SUN_OFFSETS: [Vec3; 4] = [
    Vec3::new(0.009, 0.003, 0.003),
    Vec3::new(-0.003, 0.003, 0.009),
    Vec3::new(-0.009, -0.003, -0.003),
    Vec3::new(0.003, -0.003, -0.009),
];
/// Light that comes from everywhere.
const EVEN: Vec3 = Vec3::new(9.0, 9.0, 11.0);
/// Distance of a ray's start from its surface: curves lie this far from their mesh at most.
const CLEAR: f32 = 4.0;

/// A point of the light grid before its light is computed.
pub(super) const DARK: GridPoint = GridPoint {
    ambient: [0; 3],
    directed: [0; 3],
    longitude: 0,
    latitude: 0,
};

/// A small part of a lamp's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    /// Its middle.
    pub origin: Vec3,
    /// Which way it shines.
    pub normal: Vec3,
    /// A quarter of its value times its colour times its area.
    pub light: Vec3,
}

/// What the light of a point is computed from.
pub(super) struct Lighting<'a> {
    lamps: &'a [Lamp],
    sun: bool,
    occluders: Occluders,
}

impl<'a> Lighting<'a> {
    /// `sun`: the sun shines. `stops`: whether a surface stops light, by its index; glass, liquids, fog and lamps do not.
    pub fn new(
        bsp: &Bsp,
        lamps: &'a [Lamp],
        sun: bool,
        stops: impl Fn(usize) -> bool,
    ) -> Lighting<'a> {
        let mut triangles = Vec::new();
        for (index, mesh) in meshes(bsp).into_iter().enumerate() {
            if stops(index) {
                triangles.extend(mesh.iter().map(|t| t.map(|v| v.position)));
            }
        }
        let input = triangles.into_iter().map(|t| (t, false, 0));
        Lighting {
            lamps,
            sun,
            occluders: Occluders::new(input),
        }
    }

    /// Light on a surface at `position`, on a scale of 0 to 255 that the engine shows four times as bright.
    fn at(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let from = position + normal * CLEAR;
        let mut last = None;
        let mut sum = EVEN * (1.0 + 0.25 * normal.z);
        for lamp in self.lamps {
            let to = lamp.origin + lamp.normal - from;
            let distance = to.length().max(8.0);
            let cosines = to.dot(normal).max(0.0) * (-to.dot(lamp.normal)).max(0.0);
            if cosines > 0.0 {
                let light = lamp.light * cosines / distance.powi(4);
                let matters = light.max_element() > 0.5;
                if matters && !self.occluders.blocked_hinted(from, from + to, &mut last) {
                    sum += light;
                }
            }
        }
        let cosine = normal.dot(SUN);
        if self.sun && cosine > 0.0 {
            for offset in SUN_OFFSETS {
                let direction = SUN + offset;
                let passed = windows::tint(from, direction);
                let to = from + direction * 4096.0;
                if passed.max_element() > 0.0 && !self.occluders.blocked_hinted(from, to, &mut last)
                {
                    sum += SUN_LIGHT * passed * (cosine / SUN_OFFSETS.len() as f32);
                }
            }
        }
        sum
    }

    /// The points of the light grid; those in walls stay dark.
    fn grid(&self, bsp: &Bsp) -> Vec<GridPoint> {
        let Some(layout) = bsp.light_grid() else {
            return bsp.light_grid.clone();
        };
        let [columns, rows, _] = layout.counts;
        let place = |index: usize| {
            let (row, x) = (index / columns, index % columns);
            layout.position(x, row % rows, row / rows)
        };
        parallel::map(&bsp.light_grid, |index, &dark| {
            let position = place(index);
            match bsp.cluster_at(position) {
                ..0 => dark,
                _ => self.grid_point(position),
            }
        })
    }

    /// A point of the light grid.
    fn grid_point(&self, position: Vec3) -> GridPoint {
        let axes = [
            Vec3::X,
            Vec3::NEG_X,
            Vec3::Y,
            Vec3::NEG_Y,
            Vec3::Z,
            Vec3::NEG_Z,
        ];
        let lights = axes.map(|axis| self.at(position - axis * CLEAR, axis));
        let mean = lights.into_iter().sum::<Vec3>() / 6.0;
        let brightness = lights.map(|light| light.element_sum());
        let [e, w, n, s, up, down] = brightness;
        let direction = Vec3::new(e - w, n - s, up - down).normalize_or(Vec3::Z);
        let brightest = lights.into_iter().fold(Vec3::ZERO, Vec3::max);
        let turn = |radians: f32| (radians * 256.0 / std::f32::consts::TAU).round() as i32 as u8;
        GridPoint {
            ambient: bytes(mean * 0.6),
            directed: bytes(brightest * 0.6),
            longitude: turn(direction.z.clamp(-1.0, 1.0).acos()),
            latitude: turn(direction.y.atan2(direction.x)),
        }
    }

    /// Stores the light in the map: pages of lightmaps for `places`, the light grid, and colours of the vertices of
    /// surfaces without a page.
    pub fn store(&self, bsp: &mut Bsp, places: &[Place]) {
        let pages = self.pages(bsp, places);
        bsp.light_grid = self.grid(bsp);
        bsp.lightmaps = (pages.into_iter())
            .map(|page| q3bsp::Lightmap(page.into_flattened().into()))
            .collect();
        for surface in &bsp.surfaces {
            if surface.kind != SurfaceKind::TriangleSoup {
                continue;
            }
            let (first, count) = (surface.first_vert.max(0), surface.num_verts.max(0));
            let vertices = bsp.vertices.iter_mut().skip(first as usize);
            for vertex in vertices.take(count as usize) {
                let [r, g, b] = bytes(self.at(vertex.position, vertex.normal));
                vertex.color = [r, g, b, 255];
            }
        }
    }

    /// The pages of the lightmaps.
    fn pages(&self, bsp: &Bsp, places: &[Place]) -> Vec<Vec<[u8; 3]>> {
        let meshes = meshes(bsp);
        let rectangles = parallel::map(places, |_, place| {
            let mesh = meshes.get(place.surface).map_or(&[][..], Vec::as_slice);
            self.rectangle(place, mesh)
        });
        let count = places.iter().map(|place| place.page + 1).max().unwrap_or(0);
        let mut pages = vec![vec![[0; 3]; LIGHTMAP_SIZE * LIGHTMAP_SIZE]; count];
        for (place, rectangle) in places.iter().zip(rectangles) {
            let [columns, _] = place.size;
            for (index, texel) in rectangle.into_iter().enumerate() {
                let (x, y) = (place.at[0] + index % columns, place.at[1] + index / columns);
                let page = pages.get_mut(place.page);
                if let Some(slot) = page.and_then(|page| page.get_mut(y * LIGHTMAP_SIZE + x)) {
                    *slot = texel;
                }
            }
        }
        pages
    }

    /// The texels of a surface.
    fn rectangle(&self, place: &Place, mesh: &[[Corner; 3]]) -> Vec<[u8; 3]> {
        let [columns, rows] = place.size;
        (0..columns * rows)
            .map(|index| {
                let (x, y) = (place.at[0] + index % columns, place.at[1] + index / columns);
                let at = (Vec2::new(x as f32, y as f32) + 0.5) / LIGHTMAP_SIZE as f32;
                let found = mesh.iter().filter_map(|triangle| inside(triangle, at));
                let nearest = found.max_by(|a, b| a.0.total_cmp(&b.0));
                nearest.map_or([0; 3], |(_, position, normal)| {
                    bytes(self.at(position, normal))
                })
            })
            .collect()
    }
}

/// A corner of a triangle.
#[derive(Clone, Copy)]
struct Corner {
    position: Vec3,
    normal: Vec3,
    lightmap: Vec2,
}

/// The triangles of every surface.
fn meshes(bsp: &Bsp) -> Vec<Vec<[Corner; 3]>> {
    let corner = |v: &q3bsp::DrawVert| Corner {
        position: v.position,
        normal: v.normal,
        lightmap: v.lightmap,
    };
    let curves = bsp.patch_meshes(4.0);
    let of_surface = |(surface, curve): (&q3bsp::Surface, &Option<q3bsp::PatchMesh>)| {
        let (vertices, indices) = match (surface.kind, curve) {
            (SurfaceKind::Patch, Some(mesh)) => (mesh.vertices.as_slice(), mesh.indices()),
            _ => (
                bsp.surface_vertices(surface),
                bsp.surface_indices(surface)
                    .iter()
                    .map(|&i| i as u32)
                    .collect(),
            ),
        };
        let (triangles, _) = indices.as_chunks::<3>();
        let corners = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|index| vertices.get(index as usize).map(corner));
            Some([a?, b?, c?])
        };
        triangles.iter().filter_map(corners).collect()
    };
    bsp.surfaces.iter().zip(&curves).map(of_surface).collect()
}

/// Position and normal of a triangle at lightmap coordinates, clamped to it, after a number that is the larger the less
/// they were clamped.
fn inside([a, b, c]: &[Corner; 3], at: Vec2) -> Option<(f32, Vec3, Vec3)> {
    let (u, v, to) = (
        b.lightmap - a.lightmap,
        c.lightmap - a.lightmap,
        at - a.lightmap,
    );
    let determinant = u.perp_dot(v);
    if determinant.abs() < 1e-12 {
        return None;
    }
    let weights = Vec2::new(to.perp_dot(v), u.perp_dot(to)) / determinant;
    let weights = Vec3::new(1.0 - weights.x - weights.y, weights.x, weights.y);
    let clamped = weights.clamp(Vec3::ZERO, Vec3::ONE);
    let clamped = clamped / clamped.element_sum();
    let mix = |of: fn(&Corner) -> Vec3| of(a) * clamped.x + of(b) * clamped.y + of(c) * clamped.z;
    let normal = mix(|corner| corner.normal).normalize_or(Vec3::Z);
    Some((weights.min_element(), mix(|corner| corner.position), normal))
}

/// Rounds light to the bytes of a lightmap; light that is too bright keeps its colour.
fn bytes(light: Vec3) -> [u8; 3] {
    let scale = 255.0 / light.max_element().max(255.0);
    (light * scale).to_array().map(|c| c as u8)
}
