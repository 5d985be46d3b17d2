//! Reflected light at the samples, as the tracer will add it.
//!
//! A surface reflects its albedo times its irradiance. Rays from each sample find the surfaces that light it; the
//! irradiance of a hit point is that of the nearest sample. One bounce is therefore a sparse matrix times the light
//! at all samples; a further bounce is another product. The matrix is applied to the fitted light, not to the
//! stored light, because the fit predicts what the tracer will show.
//!
//! Bounce rays also find surfaces that emit without being in a light list: sky images and faint glows.

use super::samples::{Sample, Site};
use crate::occluders::{Hit, Occluders};
use crate::world::{RelitWorld, WorldMaterial};
use glam::{IVec3, Vec3};
use std::collections::HashMap;
use std::f32::consts::TAU;
use support::parallel;
use support::random::Random;
use support::slice;

/// Strata along each side of the unit square; a sample sends the square of this number of rays.
const SIDE: u32 = 6;

/// Side of the cells of the sample lookup, id units.
const CELL: f32 = 96.0;

/// Distance from the plane of a hit above which a sample is a worse match, id units.
const OFF_PLANE: f32 = 16.0;

/// Smallest cosine between the normals of a hit and of its sample.
const SAME_NORMAL: f32 = 0.7;

/// Transfer matrix from light at samples to reflected light at samples.
#[derive(Clone)]
pub(super) struct Transfer {
    /// For each sample: the samples that represent the surfaces hit by its rays, and the part of their light that
    /// arrives.
    rows: Vec<Vec<(u32, Vec3)>>,
    /// Radiance of sky images that are in no light list, averaged over the hemisphere.
    skies: Vec<Vec3>,
    /// Radiance of other emitting surfaces that are in no light list, likewise.
    glows: Vec<Vec3>,
    /// Diffuse bounces.
    bounces: u32,
}

/// Row, sky radiance and glow radiance of one sample.
type Found = (Vec<(u32, Vec3)>, Vec3, Vec3);

impl Transfer {
    /// Traces the rays of all samples. `unlisted`: whether a sky material is found by its image only.
    pub fn new(
        world: &RelitWorld,
        occluders: &Occluders,
        samples: &[Sample],
        bounces: u32,
        unlisted: impl Fn(u32) -> bool + Sync,
    ) -> Transfer {
        let mut transfer = Transfer {
            rows: Vec::with_capacity(samples.len()),
            skies: Vec::with_capacity(samples.len()),
            glows: Vec::with_capacity(samples.len()),
            bounces,
        };
        transfer.add(world, occluders, samples, samples, unlisted);
        transfer
    }

    /// Traces the rays of further samples; what they hit is lit as at `lit`, the first of all samples.
    pub fn add(
        &mut self,
        world: &RelitWorld,
        occluders: &Occluders,
        lit: &[Sample],
        more: &[Sample],
        unlisted: impl Fn(u32) -> bool + Sync,
    ) {
        let of_triangle = world.surfaces_of_triangles();
        let near = Near::new(lit);
        let first = self.rows.len();
        let found = parallel::map(more, |i, sample| {
            let mut random = Random::new(0xB0_0000 + (first + i) as u64);
            if sample.site == Site::LightGrid {
                return Found::default();
            }
            trace_from(
                world,
                occluders,
                &of_triangle,
                (lit, &near),
                sample,
                &mut random,
                &unlisted,
            )
        });
        for (row, sky, glow) in found {
            let pictures = if self.bounces == 0 { 0.0 } else { 1.0 };
            self.rows.push(row);
            self.skies.push(sky * pictures);
            self.glows.push(glow * pictures);
        }
    }

    /// Reflected light at each sample for the direct light `direct`. `pictures`: with the light of sky images.
    pub fn of(&self, direct: &[Vec3], pictures: bool) -> Vec<Vec3> {
        let none = Vec3::ZERO;
        let shown: Vec<Vec3> = (self.skies.iter().zip(&self.glows))
            .map(|(sky, glow)| if pictures { *sky + *glow } else { *glow })
            .collect();
        let mut bounced = vec![none; self.rows.len()];
        for bounce in 0..self.bounces {
            let last = bounce == 0;
            let next = |row: &Vec<(u32, Vec3)>, shown: &Vec3| {
                let parts = row.iter().map(|&(i, weight)| {
                    let i = i as usize;
                    let light = direct.get(i).copied().unwrap_or(none);
                    let more = if last {
                        none
                    } else {
                        bounced.get(i).copied().unwrap_or(none)
                    };
                    weight * (light + more)
                });
                parts.sum::<Vec3>() + *shown
            };
            bounced = self
                .rows
                .iter()
                .zip(&shown)
                .map(|(r, s)| next(r, s))
                .collect();
        }
        bounced
    }
}

/// Traces the rays of one sample. `lit`: the samples that stand for hit points.
fn trace_from(
    world: &RelitWorld,
    occluders: &Occluders,
    of_triangle: &[u32],
    (lit, near): (&[Sample], &Near),
    sample: &Sample,
    random: &mut Random,
    unlisted: &impl Fn(u32) -> bool,
) -> Found {
    let (u, v) = sample.normal.any_orthonormal_pair();
    let (mut sky, mut glow) = (Vec3::ZERO, Vec3::ZERO);
    let mut row: Vec<(u32, Vec3)> = Vec::new();
    let part = 1.0 / (SIDE * SIDE) as f32;
    for stratum in 0..SIDE * SIDE {
        let x = ((stratum % SIDE) as f32 + random.uniform()) / SIDE as f32;
        let y = ((stratum / SIDE) as f32 + random.uniform()) / SIDE as f32;
        // Cosine-weighted directions: the mean of radiance is irradiance over π (Malley's method).
        let (sin, cos) = (x * TAU).sin_cos();
        let radius = y.sqrt();
        let ray = u * (radius * cos) + v * (radius * sin) + sample.normal * (1.0 - y).sqrt();
        let Some(hit) = occluders.nearest(sample.position, ray, f32::INFINITY) else {
            continue; // the ray leaves the map
        };
        let Some((index, material)) = material_of(world, of_triangle, &hit) else {
            continue;
        };
        if hit.sky {
            if unlisted(index) {
                sky += material.shown * part;
            }
            continue;
        }
        if !hit.front {
            continue;
        }
        if material.emission.is_none() {
            glow += material.shown * part;
        }
        let at = sample.position + ray * hit.t;
        let weight = material.albedo * part;
        if weight != Vec3::ZERO
            && let Some(lit) = near.find(lit, at, hit.normal)
        {
            match row.iter_mut().find(|(other, _)| *other == lit) {
                Some((_, sum)) => *sum += weight,
                None => row.push((lit, weight)),
            }
        }
    }
    (row, sky, glow)
}

/// Index of the material that a ray hit, and the material.
fn material_of<'a>(
    world: &'a RelitWorld,
    of_triangle: &[u32],
    hit: &Hit,
) -> Option<(u32, &'a WorldMaterial)> {
    let surface = *slice::get(of_triangle, hit.tag as usize)?;
    let index = slice::get(&world.surfaces, surface as usize)?.material;
    Some((index, slice::get(&world.materials, index as usize)?))
}

/// A cell and its neighbours by distance, so that near samples prune far cells.
const AROUND: [IVec3; 27] = around();

const fn around() -> [IVec3; 27] {
    let mut cells = [IVec3::ZERO; 27];
    let mut count = 0;
    let mut steps = 0;
    while steps <= 3 {
        let mut k = 0;
        while k < 27 {
            let (x, y, z) = (k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
            if x * x + y * y + z * z == steps {
                cells[count] = IVec3::new(x, y, z);
                count += 1;
            }
            k += 1;
        }
        steps += 1;
    }
    cells
}

/// Samples by cell.
pub(super) struct Near(HashMap<IVec3, Vec<u32>>);

impl Near {
    pub fn new(samples: &[Sample]) -> Near {
        let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
        let surface = |s: &(u32, &Sample)| s.1.site == Site::Surface;
        for (i, sample) in (0u32..).zip(samples).filter(surface) {
            cells.entry(cell(sample.position)).or_default().push(i);
        }
        Near(cells)
    }

    /// The sample that stands for a hit point: the nearest one of a similar normal; samples off the plane count as
    /// twice as far.
    pub fn find(&self, samples: &[Sample], at: Vec3, normal: Vec3) -> Option<u32> {
        let middle = cell(at);
        let mut best = None;
        let mut least = f32::INFINITY;
        for offset in AROUND {
            let cell = middle + offset;
            let mins = cell.as_vec3() * CELL;
            let nearest = at.clamp(mins, mins + CELL);
            if nearest.distance_squared(at) >= least {
                continue;
            }
            for &i in self.0.get(&cell).map_or(&[][..], Vec::as_slice) {
                let Some(sample) = slice::get(samples, i as usize) else {
                    continue;
                };
                let offset = sample.position - at;
                if sample.normal.dot(normal) < SAME_NORMAL {
                    continue;
                }
                let mut distance = offset.length_squared();
                if offset.dot(normal).abs() > OFF_PLANE {
                    distance *= 4.0;
                }
                if distance < least {
                    least = distance;
                    best = Some(i);
                }
            }
        }
        best
    }
}

fn cell(at: Vec3) -> IVec3 {
    (at / CELL).floor().as_ivec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::samples::tests::sample_at_place;

    #[test]
    fn the_nearest_sample_of_the_plane_is_found() {
        let mut random = Random::new(7);
        let mut anywhere =
            || Vec3::new(random.uniform(), random.uniform(), random.uniform()) * 500.0;
        let samples: Vec<Sample> = (0..400).map(|_| sample_at_place(anywhere())).collect();
        let near = Near::new(&samples);
        let mut elsewhere = 0;
        for _ in 0..300 {
            let at = anywhere();
            let far = |s: &Sample| (cell(s.position) - cell(at)).abs().max_element() > 1;
            let distance = |s: &Sample| {
                let off = (s.position.z - at.z).abs() > OFF_PLANE;
                s.position.distance_squared(at) * if off { 4.0 } else { 1.0 }
            };
            let all = samples.iter().filter(|s| !far(s));
            let best = all.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let found = near.find(&samples, at, Vec3::Z);
            assert_eq!(found.map(|i| &samples[i as usize]), best);
            elsewhere += usize::from(best.is_some_and(|s| cell(s.position) != cell(at)));
            assert!(near.find(&samples, at, Vec3::X).is_none());
        }
        assert!(elsewhere > 30, "{elsewhere}");
    }
}
