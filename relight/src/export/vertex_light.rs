//! Light of lightmaps in the colours of vertices, for programs without lightmaps.
//!
//! A vertex does not get the light of its own place, which may be a dark corner of a large bright floor: the colours
//! are those whose interpolation over the triangles comes closest to the lightmap everywhere.
//!
//! Source: Kavan, Bargteil and Sloan, "Least Squares Vertex Baking", EGSR 2011, section 3; its regularisation is
//! replaced by a pull towards the mean of the light around a vertex.

use super::geometry::Part;
use crate::image::Image;
use crate::overbright;
use crate::world::{RelitWorld, WorldMaterial};
use glam::{Vec2, Vec3};
use shaderscript::ImplicitKind;
use std::collections::HashMap;
use support::slice;

/// Texels between places where the lightmap is read.
const SPACING: f32 = 1.5;
/// Most places along a side of a triangle.
const MOST: u32 = 32;
/// Weight of the pull towards the mean, over that of the lightmap.
const PULL: f32 = 0.05;
/// Steps of the conjugate gradients, and the part of the first error at which they end.
const STEPS: usize = 32;
const ENOUGH: f32 = 1.0e-3;

/// Whether a material shows lightmaps.
pub fn is_lightmapped(material: &WorldMaterial) -> bool {
    material.lighting == ImplicitKind::Lightmapped && material.resolved.shader.has_lightmap_stage()
}

/// A triangle: its unknowns, and what interpolation weights come to over it.
struct Element {
    corners: [usize; 3],
    /// Weights of pairs of corners: 00, 11, 22, 01, 12, 20.
    pairs: [f32; 6],
}

/// The normal equations.
#[derive(Default)]
struct System {
    elements: Vec<Element>,
    /// Light seen by each unknown, and its weight.
    right: Vec<Vec3>,
    weight: Vec<f32>,
}

/// The colour of each vertex of a part, linear, 0..1. `atlas`: all lightmaps, with the coordinates that the part has.
pub fn fit(part: &Part, atlas: &Image) -> Vec<Vec3> {
    let unknowns = unknowns(part);
    let mut system = System::default();
    let count = unknowns.iter().copied().max().map_or(0, |last| last + 1);
    system.right.resize(count, Vec3::ZERO);
    system.weight.resize(count, 0.0);
    let table = overbright::byte_table();
    for corners in part.indices.as_chunks::<3>().0 {
        system.add(part, &unknowns, *corners, atlas, &table);
    }
    let light = system.solve();
    unknowns
        .iter()
        .map(|&i| light.get(i).copied().unwrap_or(Vec3::ZERO))
        .collect()
}

/// Vertices at the same place that face the same way share their light.
fn unknowns(part: &Part) -> Vec<usize> {
    let mut known: HashMap<[u32; 6], usize> = HashMap::new();
    let bits = |v: Vec3| v.to_array().map(|f| (f + 0.0).to_bits());
    part.vertices
        .iter()
        .map(|v| {
            let ([x, y, z], [nx, ny, nz]) = (bits(v.position), bits(v.normal));
            let next = known.len();
            *known.entry([x, y, z, nx, ny, nz]).or_insert(next)
        })
        .collect()
}

impl System {
    fn add(
        &mut self,
        part: &Part,
        unknowns: &[usize],
        indices: [u32; 3],
        atlas: &Image,
        table: &[f32; 256],
    ) {
        let [a, b, c] = indices.map(|i| slice::item(&part.vertices, i as usize));
        let corners = indices.map(|i| slice::item(unknowns, i as usize));
        let area = (b.position - a.position)
            .cross(c.position - a.position)
            .length();
        let places = [a, b, c].map(|v| v.lightmap);
        if !(area > 0.0 && area.is_finite() && places.iter().all(|p| p.is_finite())) {
            return;
        }
        let size = Vec2::new(atlas.width as f32, atlas.height as f32);
        let [p, q, r] = places.map(|place| place * size);
        let longest = (q - p).length().max((r - q).length()).max((p - r).length());
        let steps = ((longest / SPACING).ceil() as u32).clamp(2, MOST);
        let weight = area / (steps * steps) as f32;
        let mut pairs = [0.0; 6];
        for phi in middles(steps) {
            let place = places[0] * phi.x + places[1] * phi.y + places[2] * phi.z;
            let light = atlas.linear_texel(place, true, table).truncate();
            for (corner, share) in corners.into_iter().zip(phi.to_array()) {
                if let (Some(right), Some(sum)) =
                    (self.right.get_mut(corner), self.weight.get_mut(corner))
                {
                    *right += light * (share * weight);
                    *sum += share * weight;
                }
            }
            let products = [
                phi.x * phi.x,
                phi.y * phi.y,
                phi.z * phi.z,
                phi.x * phi.y,
                phi.y * phi.z,
                phi.z * phi.x,
            ];
            for (pair, product) in pairs.iter_mut().zip(products) {
                *pair += product * weight;
            }
        }
        self.elements.push(Element { corners, pairs });
    }

    /// The left side of the equations times `x`.
    fn apply(&self, x: &[Vec3]) -> Vec<Vec3> {
        let mut out: Vec<Vec3> = x
            .iter()
            .zip(&self.weight)
            .map(|(x, weight)| *x * (PULL * weight))
            .collect();
        for Element { corners, pairs } in &self.elements {
            let [a, b, c] = corners.map(|i| x.get(i).copied().unwrap_or(Vec3::ZERO));
            let [aa, bb, cc, ab, bc, ca] = *pairs;
            let products = [
                a * aa + b * ab + c * ca,
                a * ab + b * bb + c * bc,
                a * ca + b * bc + c * cc,
            ];
            for (corner, product) in corners.iter().zip(products) {
                if let Some(out) = out.get_mut(*corner) {
                    *out += product;
                }
            }
        }
        out
    }

    /// Conjugate gradients with the diagonal as preconditioner, from the mean of the light around each vertex.
    fn solve(&self) -> Vec<Vec3> {
        let mut diagonal: Vec<f32> = self.weight.iter().map(|w| PULL * w).collect();
        for element in &self.elements {
            for (corner, pair) in element.corners.iter().zip(element.pairs) {
                if let Some(d) = diagonal.get_mut(*corner) {
                    *d += pair;
                }
            }
        }
        let mean: Vec<Vec3> = self
            .right
            .iter()
            .zip(&self.weight)
            .map(|(right, weight)| *right / weight.max(f32::MIN_POSITIVE))
            .collect();
        let mut x = mean.clone();
        let left = self.apply(&x);
        let mut residual: Vec<Vec3> = (self.right.iter().zip(&self.weight))
            .zip(mean.iter().zip(&left))
            .map(|((right, weight), (mean, left))| *right + *mean * (PULL * weight) - *left)
            .collect();
        let condition = |residual: &[Vec3]| -> Vec<Vec3> {
            let scaled = residual.iter().zip(&diagonal);
            scaled.map(|(r, d)| *r / d.max(f32::MIN_POSITIVE)).collect()
        };
        let dot = |a: &[Vec3], b: &[Vec3]| -> Vec3 { a.iter().zip(b).map(|(a, b)| *a * *b).sum() };
        let ratio = |a: Vec3, b: Vec3| {
            Vec3::select(
                b.abs().cmpgt(Vec3::splat(f32::MIN_POSITIVE)),
                a / b,
                Vec3::ZERO,
            )
        };
        let mut conditioned = condition(&residual);
        let mut direction = conditioned.clone();
        let mut size = dot(&residual, &conditioned);
        let first = size;
        for _ in 0..STEPS {
            if size.cmple(first * (ENOUGH * ENOUGH)).all() {
                break;
            }
            let pushed = self.apply(&direction);
            let step = ratio(size, dot(&direction, &pushed));
            for (((x, r), d), p) in (x.iter_mut().zip(&mut residual))
                .zip(&direction)
                .zip(&pushed)
            {
                *x += step * *d;
                *r -= step * *p;
            }
            conditioned = condition(&residual);
            let next = dot(&residual, &conditioned);
            let turn = ratio(next, size);
            size = next;
            for (d, c) in direction.iter_mut().zip(&conditioned) {
                *d = *c + turn * *d;
            }
        }
        let valid = |v: &Vec3| v.is_finite();
        x.into_iter()
            .map(|v| if valid(&v) { v } else { Vec3::ZERO })
            .map(|v| v.clamp(Vec3::ZERO, Vec3::ONE))
            .collect()
    }
}

/// Barycentric coordinates of the middles of a triangle's `steps`² equal parts.
fn middles(steps: u32) -> impl Iterator<Item = Vec3> {
    let side = steps as f32;
    let cells = (0..steps).flat_map(move |i| (0..steps - i).map(move |j| (i, j)));
    cells.flat_map(move |(i, j)| {
        // the part that stands in the cell, and the one that hangs from it
        let parts = [Some(1.0), (i + j + 1 < steps).then_some(2.0)];
        parts.into_iter().flatten().map(move |thirds: f32| {
            let y = (i as f32 + thirds / 3.0) / side;
            let z = (j as f32 + thirds / 3.0) / side;
            Vec3::new(1.0 - y - z, y, z)
        })
    })
}

/// Mean light of each material by area, linear: of lightmaps, or of the colours that the map's compiler gave to
/// vertices. `None` where nothing is drawn. `lights`: for all parts in order what [`fit`] found.
pub fn means<'a>(
    world: &RelitWorld,
    parts: impl Iterator<Item = (&'a Part, Option<&'a [Vec3]>)>,
) -> Vec<Option<Vec3>> {
    let table = overbright::byte_table();
    let mut sums = vec![(Vec3::ZERO, 0.0); world.materials.len()];
    for (part, light) in parts {
        let Some(sum) = slice::get_mut(&mut sums, part.material as usize) else {
            continue;
        };
        let light_of = |i: u32| -> Vec3 {
            let color = |v: &crate::world::WorldVertex| {
                let [r, g, b, _] = v.color;
                Vec3::from_array([r, g, b].map(|c| table[usize::from(c)]))
            };
            match light {
                Some(light) => slice::item(light, i as usize),
                None => color(&slice::item(&part.vertices, i as usize)),
            }
        };
        for corners in part.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|i| slice::item(&part.vertices, i as usize));
            let area = (b.position - a.position)
                .cross(c.position - a.position)
                .length();
            let [p, q, r] = corners.map(light_of);
            if area.is_finite() {
                sum.0 += (p + q + r) * (area / 3.0);
                sum.1 += area;
            }
        }
    }
    sums.into_iter()
        .map(|(sum, area)| (area > 0.0).then(|| sum / area))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::WorldVertex;

    /// A square of two triangles, lit by an atlas of 8 × 8 texels.
    fn square() -> Part {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        Part {
            material: 0,
            vertices: corners
                .map(|(x, y)| WorldVertex {
                    position: Vec3::new(x * 64.0, y * 64.0, 0.0),
                    normal: Vec3::Z,
                    st: Vec2::ZERO,
                    lightmap: Vec2::new(x, y),
                    color: [255; 4],
                })
                .to_vec(),
            indices: vec![0, 1, 2, 0, 2, 3],
        }
    }

    fn atlas(texel: impl Fn(usize, usize) -> u8) -> Image {
        let rgba = (0..64).flat_map(|i| {
            let c = texel(i % 8, i / 8);
            [c, c, c, 255]
        });
        Image::from_rgba(8, 8, rgba.collect()).unwrap()
    }

    #[test]
    fn parts_cover_the_triangle_evenly() {
        for steps in [1, 2, 5] {
            let all: Vec<Vec3> = middles(steps).collect();
            assert_eq!(all.len(), (steps * steps) as usize);
            let mean = all.iter().sum::<Vec3>() / all.len() as f32;
            assert!((mean - Vec3::splat(1.0 / 3.0)).length() < 1.0e-5, "{mean}");
            assert!(all.iter().all(|p| p.min_element() > 0.0));
        }
    }

    #[test]
    fn even_light_stays_and_dark_corners_do_not_darken_the_floor() {
        let even = fit(&square(), &atlas(|_, _| 188));
        let want = overbright::to_linear(188.0 / 255.0);
        for v in even {
            assert!((v - Vec3::splat(want)).length() < 1.0e-3, "{v}");
        }
        // only the corners are dark
        let corners = fit(
            &square(),
            &atlas(|x, y| if x % 7 == 0 && y % 7 == 0 { 0 } else { 188 }),
        );
        let mean = corners.iter().sum::<Vec3>() / 4.0;
        assert!(mean.x > 0.8 * want, "{mean}");
    }

    #[test]
    fn a_gradient_is_followed() {
        let colors = fit(&square(), &atlas(|x, _| (x * 30) as u8));
        assert!(colors[1].x > colors[0].x + 0.3, "{colors:?}");
        assert!((colors[1].x - colors[2].x).abs() < 0.15, "{colors:?}");
    }

    #[test]
    fn no_number_is_no_panic() {
        let mut part = square();
        part.vertices[0].lightmap = Vec2::splat(f32::NAN);
        part.vertices[2].position = Vec3::splat(f32::INFINITY);
        let colors = fit(&part, &atlas(|_, _| 9));
        assert!(colors.iter().all(|c| c.is_finite()));
    }
}
