//! Back splashes: weak point lights that compilers place in front of area lights.
//!
//! A surface light gives nothing behind its plane and little beside it. So compilers place a weak point light in
//! front of each piece of an emitting surface, its *back splash*, unless the piece is larger than the subdivision
//! size. All back splashes of a material have the same ratio to their piece's light: they are one source with one
//! strength.
//!
//! Source: `q3map_backsplash` and `q3map_lightSubdivide` in q3map2's documentation, and their defaults.

use super::columns::{Column, Lamp, Prior, Source, material_of, point_rows};
use super::cutoff::{Piece, pieces_of};
use super::sample_soa::SampleSoa;
use super::samples::Sample;
use crate::light::{EmissionSource, Falloff, TriangleLight};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::collections::BTreeMap;
use support::Aabb;
use support::parallel;

/// Default back splash: per cent of the piece's light, and distance from it, id units.
const USUAL: (f32, f32) = (5.0, 23.0);

/// Default subdivision size, id units.
const CUT_ABOVE: f32 = 999.0;

/// Largest side of adjacent triangles that share one back splash here, id units.
const JOINED: f32 = 128.0;

/// Smallest cosine between the normals of such triangles.
const SAME_NORMAL: f32 = 0.9;

/// Largest strength of back splashes relative to their directive.
const STRONGEST: f32 = 4.0;

/// Back splashes of one material.
pub(super) struct Splashes {
    /// The material.
    material: u32,
    /// Intensity of a back splash relative to that of its lamp.
    part: f32,
    /// Positions, and intensities for strength 1; the strength is the radiance of the lamps times `part`.
    pub points: Vec<(Lamp, f32)>,
}

/// Adjacent triangles that share one back splash.
struct LampSurface {
    triangles: Vec<[Vec3; 3]>,
    /// Area-weighted sum of the centroids.
    middle: Vec3,
    /// Area-weighted sum of the normals.
    normal: Vec3,
    area: f32,
}

impl LampSurface {
    /// Whether a triangle belongs to this lamp.
    fn takes(&self, light: &TriangleLight) -> bool {
        let shared = |own: &[Vec3; 3]| own.iter().filter(|v| light.vertices.contains(v)).count();
        let all = self.triangles.iter().chain([&light.vertices]).flatten();
        self.triangles.iter().any(|own| shared(own) >= 2)
            && self.normal.normalize_or_zero().dot(light.normal()) > SAME_NORMAL
            && side(all) <= JOINED
    }
}

/// Longest side of the bounding box of points, id units.
fn side<'a>(points: impl Iterator<Item = &'a Vec3>) -> f32 {
    Aabb::of(points.copied()).size().max_element()
}

/// Back splashes of a world, by material.
pub(super) fn of(world: &RelitWorld) -> Vec<Splashes> {
    let mut lamps: BTreeMap<(u32, u32), Vec<LampSurface>> = BTreeMap::new();
    for light in &world.lights {
        let material = material_of(world, light);
        let directives = world.materials.get(material as usize);
        let cut = directives.and_then(|m| m.resolved.definition().light.light_subdivide);
        let cut = cut.filter(|cut| *cut > 0.0).unwrap_or(CUT_ABOVE);
        let area = light.area();
        let is_lamp = light.source == EmissionSource::SurfaceLight && light.model == 0;
        if !is_lamp || !area.is_finite() || area <= 0.0 || side(light.vertices.iter()) > cut {
            continue;
        }
        let pieces = lamps.entry((material, light.surface)).or_default();
        let [a, b, c] = light.vertices;
        let (middle, normal) = ((a + b + c) / 3.0 * area, light.normal() * area);
        match pieces.last_mut().filter(|piece| piece.takes(light)) {
            Some(piece) => {
                piece.triangles.push(light.vertices);
                piece.middle += middle;
                piece.normal += normal;
                piece.area += area;
            }
            None => pieces.push(LampSurface {
                triangles: vec![light.vertices],
                middle,
                normal,
                area,
            }),
        }
    }
    let mut found: BTreeMap<u32, Splashes> = BTreeMap::new();
    for ((material, _), pieces) in lamps {
        let directives = world.materials.get(material as usize);
        let backsplash = directives.and_then(|m| m.resolved.definition().light.backsplash);
        let (percent, distance) = backsplash.unwrap_or(USUAL);
        if !(percent > 0.0 && percent.is_finite() && distance.is_finite()) {
            continue;
        }
        let own = found.entry(material).or_insert_with(|| Splashes {
            material,
            part: percent / 100.0,
            points: Vec::new(),
        });
        for piece in pieces {
            let normal = piece.normal.normalize_or_zero();
            let origin = piece.middle / piece.area + normal * distance;
            if world.bsp.cluster_at(origin) >= 0 {
                let lamp = Lamp {
                    origin,
                    falloff: Falloff::InverseSquare,
                };
                own.points.push((lamp, piece.area));
            }
        }
    }
    found.into_values().collect()
}

/// Columns of back splashes; their prior follows from the current strengths of `lamps`.
pub(super) fn columns(
    world: &RelitWorld,
    occluders: &Occluders,
    samples: &[Sample],
    splashes: &[Splashes],
    lamps: &[Column],
) -> Vec<Column> {
    let soa = SampleSoa::new(samples);
    let column = |(index, splash): (u32, &Splashes)| {
        let of_point = |_, &(lamp, power): &(Lamp, f32)| {
            let bsp = &world.bsp;
            let rows = point_rows(bsp, occluders, &soa, lamp, None, f32::INFINITY);
            rows.into_iter().map(|(i, a)| (i, a * power)).collect()
        };
        let rows: Vec<Vec<(u32, f32)>> = parallel::map(&splash.points, of_point);
        let mut pieces: Vec<Piece> = rows.iter().flat_map(|rows| pieces_of(rows)).collect();
        pieces.sort_by_key(|piece| piece.sample);
        let is_lamp =
            |c: &&Column| c.source == Source::Group(splash.material, EmissionSource::SurfaceLight);
        let lit = lamps.iter().find(is_lamp);
        let value = lit.map_or(Vec3::ZERO, |lamp| lamp.strength) * splash.part;
        Column {
            source: Source::Splash(index),
            rows: sums(&pieces),
            pieces: match world.light_cutoff > 0.0 {
                true => pieces,
                false => Vec::new(),
            },
            strength: value,
            limit: Vec3::INFINITY,
            prior: Some(Prior {
                value,
                low: Vec3::ZERO,
                high: value * STRONGEST,
            }),
        }
    };
    (0u32..).zip(splashes).map(column).collect()
}

/// Rows from pieces sorted by sample.
fn sums(pieces: &[Piece]) -> Vec<(u32, f32)> {
    let mut rows: Vec<(u32, f32)> = Vec::new();
    for piece in pieces {
        match rows.last_mut() {
            Some((last, sum)) if *last == piece.sample => *sum += piece.given,
            _ => rows.push((piece.sample, piece.given)),
        }
    }
    rows
}
