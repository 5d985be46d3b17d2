//! Charts: rectangles of texels, each with the coordinates of the surfaces in it.

use super::density::bounds;
use super::grid;
use super::shape::{Flat, Shape};
use glam::Vec2;
use q3bsp::{Bsp, SurfaceId};
use std::collections::BTreeMap;

/// A surface that needs a chart.
#[derive(Debug, Clone)]
pub(super) struct Wanted {
    /// The surface.
    pub surface: u32,
    /// Model that it belongs to.
    pub model: u32,
    /// Its shader.
    pub shader: u32,
    /// Wanted distance between texels, id units.
    pub sample: f32,
    /// Its form.
    pub shape: Shape,
}

/// A rectangle of texels, without border.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chart {
    /// Shader of its surfaces.
    pub shader: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Its surfaces with the coordinates of their vertices, texels from the corner of the rectangle: 0.5 is the middle of the
    /// first texel.
    pub parts: Vec<(u32, Vec<Vec2>)>,
    /// Wanted and used distance between texels, where the wanted one gives more texels than a page has.
    pub coarser: Option<(f32, f32)>,
}

/// What limits a chart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Most texels per side.
    pub most: u32,
    /// Factor from texels of present charts to wanted ones.
    pub finer: f32,
}

/// A rectangle on a plane with the surfaces in it.
struct Group {
    low: Vec2,
    high: Vec2,
    members: Vec<usize>,
}

/// Surfaces with equal keys may share a chart.
type Key = (u32, u32, usize, bool, [i64; 4], u32);

/// Groups that one is compared with; bounds the time for a plane with many surfaces.
const WINDOW: usize = 64;

/// Passes over the groups of a plane.
const PASSES: usize = 4;

/// Most of a shared rectangle that may be empty, as a multiple of the surfaces' own rectangles.
const LOOSE: f32 = 1.2;

/// Lays surfaces out. Returns the charts, and the surfaces that have none, because they are neither flat, nor seen whole along
/// an axis, nor a patch, nor laid out already.
pub(super) fn charts(bsp: &Bsp, wanted: &[Wanted], limits: Limits) -> (Vec<Chart>, Vec<u32>) {
    let mut planes: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
    let mut charts = Vec::new();
    let mut without = Vec::new();
    for (at, want) in wanted.iter().enumerate() {
        match &want.shape {
            Shape::Projected {
                axis,
                positive,
                flat: Some(flat),
                ..
            } => {
                let key = (
                    want.model,
                    want.shader,
                    *axis,
                    *positive,
                    rounded(flat),
                    want.sample.to_bits(),
                );
                planes.entry(key).or_default().push(at);
            }
            Shape::Projected { points, .. } => {
                charts.extend(fitted(want, &[(want.surface, points.clone())], limits));
            }
            Shape::Grid { columns, points } => match grid::flatten(*columns, points) {
                Some(flat) => charts.extend(fitted(want, &[(want.surface, flat)], limits)),
                None => without.push(want.surface),
            },
            Shape::Other => match kept(bsp, want, limits) {
                Some(chart) => charts.push(chart),
                None => without.push(want.surface),
            },
        }
    }
    for members in planes.into_values() {
        for group in merge(wanted, &members, limits) {
            let parts: Vec<_> = (group.members.iter())
                .filter_map(|&at| wanted.get(at))
                .filter_map(|want| match &want.shape {
                    Shape::Projected { points, .. } => Some((want.surface, points.clone())),
                    _ => None,
                })
                .collect();
            let first = group.members.first().and_then(|&at| wanted.get(at));
            charts.extend(first.and_then(|first| fitted(first, &parts, limits)));
        }
    }
    let laid: usize = charts.iter().map(|chart| chart.parts.len()).sum();
    debug_assert!(laid <= wanted.len(), "{laid} of {}", wanted.len());
    // in the order of the map, so that nothing depends on the order of planes
    charts.sort_by_key(|chart| chart.parts.first().map(|part| part.0));
    (charts, without)
}

/// A plane as numbers that are equal for surfaces on it: steps of 1/1000 and of 1/4 unit.
fn rounded(flat: &Flat) -> [i64; 4] {
    let [x, y, z] = flat.normal.to_array().map(|c| (c * 1000.0).round() as i64);
    [x, y, z, (flat.dist * 4.0).round() as i64]
}

/// Joins surfaces of a plane that touch, while a common rectangle fits a page and wastes little.
fn merge(wanted: &[Wanted], members: &[usize], limits: Limits) -> Vec<Group> {
    let mut groups: Vec<Group> = (members.iter())
        .filter_map(|&at| {
            let Shape::Projected { points, .. } = &wanted.get(at)?.shape else {
                return None;
            };
            let (low, high) = bounds(points.iter().copied());
            let members = vec![at];
            Some(Group { low, high, members })
        })
        .collect();
    let sample = members.first().and_then(|&at| wanted.get(at));
    let sample = sample.map_or(16.0, |want| want.sample);
    let most = sample * limits.most.saturating_sub(1) as f32;
    for _ in 0..PASSES {
        groups.sort_by(|a, b| {
            let order = a.low.y.total_cmp(&b.low.y);
            order.then(a.low.x.total_cmp(&b.low.x))
        });
        let before = groups.len();
        let mut open: Vec<Group> = Vec::with_capacity(before);
        for group in groups {
            let near = open.iter_mut().rev().take(WINDOW);
            match near
                .into_iter()
                .find(|other| joins(other, &group, sample, most))
            {
                Some(other) => {
                    other.low = other.low.min(group.low);
                    other.high = other.high.max(group.high);
                    other.members.extend(group.members);
                }
                None => open.push(group),
            }
        }
        groups = open;
        if groups.len() == before {
            break;
        }
    }
    for group in &mut groups {
        group.members.sort_unstable();
    }
    groups
}

/// Whether two groups touch, and a rectangle around both is at most `most` wide and not much larger than they are.
fn joins(a: &Group, b: &Group, sample: f32, most: f32) -> bool {
    let touch = Vec2::splat(0.1);
    let apart = a.low.cmpgt(b.high + touch) | b.low.cmpgt(a.high + touch);
    let (low, high) = (a.low.min(b.low), a.high.max(b.high));
    if apart.any() || (high - low).max_element() > most {
        return false;
    }
    // a texel more than the extent
    let area = |low: Vec2, high: Vec2| (high - low + sample).element_product();
    area(low, high) <= LOOSE * (area(a.low, a.high) + area(b.low, b.high))
}

/// A chart of points in units: stretched a little, so that the first and the last texel of each axis lie on the border.
fn fitted(want: &Wanted, parts: &[(u32, Vec<Vec2>)], limits: Limits) -> Option<Chart> {
    let (low, high) = bounds(parts.iter().flat_map(|part| part.1.iter().copied()));
    let extent = high - low;
    if !extent.is_finite() || want.sample.is_nan() || want.sample <= 0.0 {
        return None;
    }
    let steps = limits.most.saturating_sub(1).max(1) as f32;
    let least = extent.max_element() / steps;
    let sample = want.sample.max(least);
    let texels = |extent: f32| ((extent / sample - 1e-3).ceil().clamp(0.0, steps)) as u32 + 1;
    let size = extent.to_array().map(texels);
    let scale = |extent: f32, size: u32| match size {
        ..2 => 0.0,
        _ => (size - 1) as f32 / extent,
    };
    let scale = Vec2::new(scale(extent.x, size[0]), scale(extent.y, size[1]));
    let last = Vec2::new(size[0] as f32, size[1] as f32) - 0.5;
    let place = |p: &Vec2| ((*p - low) * scale + 0.5).clamp(Vec2::splat(0.5), last);
    let laid = parts
        .iter()
        .map(|(surface, points)| (*surface, points.iter().map(place).collect()));
    Some(Chart {
        shader: want.shader,
        width: size[0],
        height: size[1],
        parts: laid.collect(),
        coarser: (sample > want.sample * 1.001).then_some((want.sample, sample)),
    })
}

/// The present chart of a surface with more texels; `None` without a present chart.
fn kept(bsp: &Bsp, want: &Wanted, limits: Limits) -> Option<Chart> {
    let surface = bsp.surface(SurfaceId::from_raw(i32::try_from(want.surface).ok()?));
    if surface.lightmap < 0 {
        return None;
    }
    let side = bsp.lightmap_size() as f32;
    let vertices = bsp.surface_vertices(surface).iter();
    let points: Vec<Vec2> = vertices.map(|v| v.finite().lightmap * side).collect();
    let texels = Wanted {
        sample: 1.0 / limits.finer,
        ..want.clone()
    };
    fitted(&texels, &[(want.surface, points)], limits)
}
