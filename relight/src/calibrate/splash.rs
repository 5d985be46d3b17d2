//! Light that lamps throw at what is beside them.
//!
//! A surface gives nothing to what lies behind its plane, and little to what lies beside it. So compilers put a weak point
//! light in front of each piece of a surface that shines, its *back splash*, unless the piece is so large that it was cut.
//! What part of the piece's light it gives is the same for all of a material: they are one source of one strength.
//!
//! Source: what q3map2's documentation calls `q3map_backsplash` and `q3map_lightSubdivide`, and its defaults.

use super::columns::{Column, Lamp, Prior, Source, material_of, point_rows};
use super::cutoff::{Piece, pieces_of};
use super::sample_soa::SampleSoa;
use super::samples::Sample;
use crate::light::{EmissionSource, Falloff, TriangleLight};
use crate::occluders::Occluders;
use crate::world::RelitWorld;
use glam::Vec3;
use std::collections::BTreeMap;
use support::parallel;

/// Part of a piece's light that its splash gives, per cent, and how far in front of it, id units, where the material tells
/// neither.
const USUAL: (f32, f32) = (5.0, 23.0);

/// Side of the largest piece that is not cut where the material does not tell, id units.
const CUT_ABOVE: f32 = 999.0;

/// Triangles that are one lamp, up to this side, have one splash here for all, id units.
const JOINED: f32 = 128.0;

/// Least cosine between triangles of one lamp.
const SAME_NORMAL: f32 = 0.9;

/// How many times as strong as is usual beside such lamps splashes may be.
const STRONGEST: f32 = 4.0;

/// Splashes of a material's lamps.
pub(super) struct Splashes {
    /// The material.
    material: u32,
    /// Intensity of a splash for 1 of its lamp's.
    part: f32,
    /// Where they are, and their intensities for a strength of 1, which is the radiance of the lamps times the part.
    pub points: Vec<(Lamp, f32)>,
}

/// Triangles of one lamp.
struct LampSurface {
    triangles: Vec<[Vec3; 3]>,
    /// Sum of middles, by area.
    middle: Vec3,
    /// Sum of normals, by area.
    normal: Vec3,
    area: f32,
}

impl LampSurface {
    /// Whether a triangle is of this lamp.
    fn takes(&self, light: &TriangleLight) -> bool {
        let shared = |own: &[Vec3; 3]| own.iter().filter(|v| light.vertices.contains(v)).count();
        let all = self.triangles.iter().chain([&light.vertices]).flatten();
        self.triangles.iter().any(|own| shared(own) >= 2)
            && self.normal.normalize_or_zero().dot(light.normal()) > SAME_NORMAL
            && side(all) <= JOINED
    }
}

/// The longest side of the box around points.
fn side<'a>(points: impl Iterator<Item = &'a Vec3>) -> f32 {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = points.fold(none, |(low, high), p| (low.min(*p), high.max(*p)));
    (high - low).max_element()
}

/// The splashes of a world's lamps, by material.
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

/// Their columns; what is believed of them beforehand is by the strengths that `lamps` have now.
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

/// What pieces, by rising sample, give together.
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
