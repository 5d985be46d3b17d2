//! Equal light on both sides of an edge that two charts share.
//!
//! Both charts are filtered bilinearly, each with texels of its own, so that light differs along the edge even if every texel
//! is right. The least change of the texels that makes both sides equal is found by least squares: over all samples of the
//! edges (L₁ − L₂)², plus a small multiple of the squared change of each texel. The normal equations are solved by conjugate
//! gradients.
//!
//! Source: S. Sylvan, "Fixing texture seams with linear least-squares", 2014.

use super::page::Page;
use crate::world::RelitWorld;
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use support::slice::item;

/// Weight of a texel's change against the differences across edges.
const KEEP: f32 = 0.01;

/// Most steps of the solver, and the part of the first residual at which it stops.
const STEPS: usize = 200;
const SMALL: f32 = 1e-4;

/// Least cosine between the normals of two surfaces at an edge that is smooth.
const SMOOTH: f32 = 0.985;

/// Steps per unit by which vertices are compared.
const GRID: f32 = 16.0;

/// Samples per texel of an edge, and the most of one edge.
const PER_TEXEL: f32 = 2.0;
const MOST_SAMPLES: usize = 512;

/// What [`match_seams`] did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SeamReport {
    /// Edges between two charts.
    pub edges: usize,
    /// Texels that take part.
    pub texels: usize,
    /// Largest difference of a component across an edge before.
    pub before: f32,
    /// And after.
    pub after: f32,
    /// Root of the mean square before.
    pub rms_before: f32,
    /// And after.
    pub rms_after: f32,
}

/// An edge of a triangle in its page.
#[derive(Debug, Clone, Copy)]
struct Side {
    page: u32,
    /// Coordinates of the ends, texels; the ends are in the order of their positions.
    ends: [Vec2; 2],
    normals: [Vec3; 2],
    /// Direction in the surface's plane from the edge to its triangle.
    inwards: Vec3,
}

/// Where an edge lies: model, and its ends rounded, the smaller one first.
type EdgeKey = (u32, [i32; 3], [i32; 3]);

/// One sample of an edge: eight texels with their weights, positive on one side and negative on the other.
type Row = [(u32, f32); 8];

/// Makes light equal along the edges between charts whose surfaces continue each other: in one plane, or with equal normals.
/// Edges are those of triangles that have both ends in common. `pages`: the world's own, by number.
pub fn match_seams(world: &RelitWorld, pages: &mut [Page]) -> SeamReport {
    let seams = seams(world, pages);
    let mut texels: HashMap<(u32, u32), u32> = HashMap::new();
    let mut places: Vec<(u32, u32)> = Vec::new();
    let mut rows: Vec<Row> = Vec::new();
    for [a, b] in &seams {
        let length = |side: &Side| side.ends[0].distance(side.ends[1]);
        let count = (length(a).max(length(b)) * PER_TEXEL).ceil() as usize;
        let count = count.clamp(1, MOST_SAMPLES);
        for step in 0..=count {
            let t = step as f32 / count as f32;
            let mut row = [(0, 0.0); 8];
            let taps = [(a, 1.0), (b, -1.0)].into_iter().flat_map(|(side, sign)| {
                let at = side.ends[0].lerp(side.ends[1], t);
                taps(pages, side.page, at).map(|(texel, weight)| (side.page, texel, weight * sign))
            });
            for (slot, (page, texel, weight)) in row.iter_mut().zip(taps) {
                let unknown = *texels.entry((page, texel)).or_insert_with(|| {
                    places.push((page, texel));
                    places.len() as u32 - 1
                });
                *slot = (unknown, weight);
            }
            rows.push(row);
        }
    }
    let before: Vec<Vec3> = (places.iter())
        .map(|&(page, texel)| {
            let page = pages.get(page as usize);
            page.map_or(Vec3::ZERO, |page| item(&page.texels, texel as usize))
        })
        .collect();
    let after = solve(&rows, &before);
    for (&(page, texel), light) in places.iter().zip(&after) {
        let page = pages.get_mut(page as usize);
        if let Some(slot) = page.and_then(|page| page.texels.get_mut(texel as usize)) {
            *slot = light.max(Vec3::ZERO);
        }
    }
    let (largest, mean) = differences(&rows, &before);
    let (largest_after, mean_after) = differences(&rows, &after);
    SeamReport {
        edges: seams.len(),
        texels: places.len(),
        before: largest,
        after: largest_after,
        rms_before: mean,
        rms_after: mean_after,
    }
}

/// The four texels that bilinear filtering reads at a place, and their weights.
fn taps(pages: &[Page], page: u32, at: Vec2) -> [(u32, f32); 4] {
    let Some(page) = pages.get(page as usize) else {
        return [(0, 0.0); 4];
    };
    let at = at - 0.5;
    let low = at.floor();
    let part = at - low;
    let tap = |x: i64, y: i64, weight: f32| {
        let texel = page.index(low.x as i64 + x, low.y as i64 + y);
        (texel as u32, weight)
    };
    [
        tap(0, 0, (1.0 - part.x) * (1.0 - part.y)),
        tap(1, 0, part.x * (1.0 - part.y)),
        tap(0, 1, (1.0 - part.x) * part.y),
        tap(1, 1, part.x * part.y),
    ]
}

/// Pairs of edges at one place with different texels.
fn seams(world: &RelitWorld, pages: &[Page]) -> Vec<[Side; 2]> {
    let mut sides: Vec<(EdgeKey, Side)> = Vec::new();
    for surface in &world.surfaces {
        let page = usize::try_from(surface.lightmap).ok();
        let Some((number, page)) = page.and_then(|p| Some((p, pages.get(p)?))) else {
            continue;
        };
        for triangle in surface.triangles() {
            let corners = world.corners(triangle);
            for (a, b, c) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                let [a, b, c] = [a, b, c].map(|i: usize| item(&corners, i));
                let key = |p: Vec3| (p * GRID).round().as_ivec3().to_array();
                let (a, b) = match key(a.position) <= key(b.position) {
                    true => (a, b),
                    false => (b, a),
                };
                if key(a.position) == key(b.position) {
                    continue;
                }
                let side = page.side as f32;
                let ends = [a, b].map(|v| v.lightmap * side);
                let along = (b.position - a.position).normalize_or_zero();
                let inwards = c.position - a.position;
                sides.push((
                    (surface.model, key(a.position), key(b.position)),
                    Side {
                        page: number as u32,
                        ends,
                        normals: [a.normal, b.normal],
                        inwards: (inwards - along * inwards.dot(along)).normalize_or_zero(),
                    },
                ));
            }
        }
    }
    // a stable sort, so that the result does not depend on a hash
    sides.sort_by_key(|(key, _)| *key);
    let mut found = Vec::new();
    for group in sides.chunk_by(|a, b| a.0 == b.0) {
        let Some(((_, first), others)) = group.split_first() else {
            continue;
        };
        let others = others.iter().map(|(_, side)| side);
        found.extend(
            others
                .filter(|side| is_seam(first, side))
                .map(|side| [*first, *side]),
        );
    }
    found
}

/// Whether two edges at one place are on surfaces that continue each other, with different texels.
fn is_seam(a: &Side, b: &Side) -> bool {
    let smooth = (a.normals.iter().zip(&b.normals)).all(|(a, b)| a.dot(*b) > SMOOTH);
    let apart =
        a.page != b.page || (a.ends.iter().zip(&b.ends)).any(|(a, b)| a.distance(*b) > 0.02);
    // on the other side of the edge; surfaces that cover each other do not continue
    smooth && apart && a.inwards.dot(b.inwards) < 0.0
}

/// Largest component and root mean square of the differences at samples.
fn differences(rows: &[Row], light: &[Vec3]) -> (f32, f32) {
    let (mut largest, mut sum) = (0.0f32, 0.0f64);
    for row in rows {
        let difference = apply(row, light);
        largest = largest.max(difference.abs().max_element());
        sum += f64::from(difference.length_squared()) / 3.0;
    }
    (largest, (sum / rows.len().max(1) as f64).sqrt() as f32)
}

/// Difference at a sample.
fn apply(row: &Row, light: &[Vec3]) -> Vec3 {
    let terms = row
        .iter()
        .map(|&(at, weight)| item(light, at as usize) * weight);
    terms.sum()
}

/// Light near `start` with small differences: (AᵀA + λ) d = −Aᵀ A x₀ by conjugate gradients, channels apart.
fn solve(rows: &[Row], start: &[Vec3]) -> Vec<Vec3> {
    // Aᵀ of a value per sample, added to `out`
    let spread = |values: &[Vec3], out: &mut [Vec3]| {
        for (row, value) in rows.iter().zip(values) {
            for &(at, weight) in row {
                if let Some(slot) = out.get_mut(at as usize) {
                    *slot += *value * weight;
                }
            }
        }
    };
    let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| *a * *b).sum::<Vec3>();
    let errors: Vec<Vec3> = rows.iter().map(|row| -apply(row, start)).collect();
    let mut residual = vec![Vec3::ZERO; start.len()];
    spread(&errors, &mut residual);
    let mut change = vec![Vec3::ZERO; start.len()];
    let mut direction = residual.clone();
    let mut norm = dot(&residual, &residual);
    let enough = norm * SMALL * SMALL;
    for _ in 0..STEPS {
        if norm.cmple(enough).all() || !norm.is_finite() {
            break;
        }
        let values: Vec<Vec3> = rows.iter().map(|row| apply(row, &direction)).collect();
        let mut image: Vec<Vec3> = direction.iter().map(|d| *d * KEEP).collect();
        spread(&values, &mut image);
        let ratio = |a: Vec3, b: Vec3| Vec3::select(b.cmpgt(Vec3::ZERO), a / b, Vec3::ZERO);
        let step = ratio(norm, dot(&direction, &image));
        for ((change, residual), (direction, image)) in
            (change.iter_mut().zip(&mut residual)).zip(direction.iter().zip(&image))
        {
            *change += *direction * step;
            *residual -= *image * step;
        }
        let next = dot(&residual, &residual);
        let keep = ratio(next, norm);
        for (direction, residual) in direction.iter_mut().zip(&residual) {
            *direction = *residual + *direction * keep;
        }
        norm = next;
    }
    start.iter().zip(&change).map(|(s, c)| *s + *c).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::layout::{LayoutOptions, LightmapUse, PageSides, make};
    use crate::bake::tests::plain_world;
    use q3bsp::builder::MapBuilder;
    use q3bsp::{Bsp, DrawVert};

    fn world(mut bsp: Bsp, sample_size: f32) -> (RelitWorld, Vec<Page>) {
        let material = |_: &str| LightmapUse::default();
        let options = LayoutOptions {
            sides: PageSides::Fixed(64),
            sample_size,
            ..LayoutOptions::internal(&material)
        };
        make(&mut bsp, &options).unwrap();
        let world = plain_world(bsp);
        let pages = vec![Page::blank(64); world.bsp.lightmaps.len()];
        (world, pages)
    }

    fn random_light(pages: &mut [Page]) {
        let mut random = testkit::Random::new(5);
        for texel in pages.iter_mut().flat_map(|page| &mut page.texels) {
            *texel = Vec3::new(random.uniform(), random.uniform(), random.uniform()) * 0.1 + 0.4;
        }
    }

    /// Two halves of a floor with different shaders, so that they have charts of their own; the texels of the second one are
    /// not those of the first.
    fn floor() -> Bsp {
        let mut map = MapBuilder::new();
        for (name, left, right) in [("a", 0.0, 130.0), ("b", 130.0, 250.0)] {
            let shader = map.add_shader(name, 0, 1);
            let corners = [(left, 0.), (left, 200.), (right, 230.), (right, 0.)];
            let corners = match name {
                "a" => corners,
                _ => [(left, 0.), (left, 230.), (right, 200.), (right, 0.)],
            };
            map.add_quad(shader, corners.map(|(x, y)| Vec3::new(x, y, 0.0)));
        }
        let mut bsp = map.build();
        for surface in &mut bsp.surfaces {
            surface.lightmap = -3;
        }
        bsp
    }

    #[test]
    fn both_sides_of_an_edge_get_equal_light() {
        let (world, mut pages) = world(floor(), 16.0);
        random_light(&mut pages);
        let before = pages.clone();
        let report = match_seams(&world, &mut pages);
        assert_eq!(report.edges, 1);
        assert!(report.before > 0.05, "{report:?}");
        assert!(report.after < 0.02 * report.before, "{report:?}");
        let changed = |(a, b): (&Page, &Page)| {
            let texels = a.texels.iter().zip(&b.texels);
            texels.filter(|(a, b)| a.distance(**b) > 1e-6).count()
        };
        let changed: usize = before.iter().zip(&pages).map(changed).sum();
        assert!(changed <= report.texels && changed < 100, "{changed}");
    }

    #[test]
    fn light_that_agrees_stays() {
        let (world, mut pages) = world(floor(), 16.0);
        for texel in pages.iter_mut().flat_map(|page| &mut page.texels) {
            *texel = Vec3::splat(0.5);
        }
        let before = pages.clone();
        let report = match_seams(&world, &mut pages);
        assert_eq!((report.before, report.after), (0.0, 0.0));
        assert_eq!(pages, before);
    }

    #[test]
    fn corners_of_a_room_are_no_seams_and_smooth_curves_are() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("w", 0, 1);
        map.add_box_faces(wall, Vec3::ZERO, Vec3::splat(128.0), true);
        let mut bsp = map.build();
        bsp.surfaces.iter_mut().for_each(|s| s.lightmap = -3);
        let (room, mut pages) = world(bsp, 16.0);
        assert_eq!(match_seams(&room, &mut pages).edges, 0);

        let mut map = MapBuilder::new();
        let wall = map.add_shader("w", 0, 1);
        // two quarters of one cylinder
        for corner in [
            [(64., 0.), (64., 64.), (0., 64.)],
            [(0., 64.), (-64., 64.), (-64., 0.)],
        ] {
            let points: Vec<DrawVert> = [0.0, 32.0, 64.0]
                .into_iter()
                .flat_map(|z| corner.map(|(x, y)| Vec3::new(x, y, z)))
                .map(|position| DrawVert {
                    position,
                    st: Vec2::ZERO,
                    lightmap: Vec2::ZERO,
                    normal: Vec3::Z,
                    color: [255; 4],
                })
                .collect();
            map.add_patch(wall, 3, 3, &points);
        }
        let mut bsp = map.build();
        bsp.surfaces.iter_mut().for_each(|s| s.lightmap = -3);
        let (curve, mut pages) = world(bsp, 8.0);
        random_light(&mut pages);
        let report = match_seams(&curve, &mut pages);
        assert!(report.edges > 0, "{report:?}");
        assert!(report.after < 0.05 * report.before, "{report:?}");
    }
}
