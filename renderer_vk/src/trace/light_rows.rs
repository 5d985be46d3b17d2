//! Light lists for sampling: for each cell one list per normal bin.
//!
//! A lamp gives no light to surfaces that face away from it, however strong it is in the cell: with one list for all
//! normals, most candidates on a wall may be lamps behind it. The probabilities of a list are therefore proportional to
//! the light that arrives at surfaces of its normal bin; rays estimate the visibility. Moving geometry uses the cell's
//! list for all normals if the map has no surface in its bin.

use glam::Vec3;
use relight::light::{LightRef, LightShare};
use shaders::trace_types as t;
use shaders::trace_types::constants as c;
use support::slice::part;

use super::light_cells::{Cell, Cells};
use super::light_normal_bins::{NORMAL_BINS, NormalBins};
use super::light_tables::{Entry, append_slots};
use super::light_weights::{Arriving, Listed, Place, shares};
use super::lights::{
    MapLightSource, count, point_light, sphere_bounds, triangle_bounds, triangle_light,
};
use crate::at_once::{Late, Make, make_all};

/// Least distance at which a light is weighted, as a part of the cell's half diagonal; it bounds the inverse-square
/// law, which would overweight a light that few points are close to.
const NEAREST: f32 = 1.0 / 6.0;

/// Part of a normal bin's probabilities that comes from the cell's list for all normals: for moving geometry, and for
/// points unlike all sample points.
const ANYWHERE_PART: f32 = 0.125;

/// Maximum part of a list's estimated light that its weak lights give together. Where a shader uses all lights of a
/// list, it samples only some of the weak ones.
const WEAK_PART: f32 = 0.2;

/// Minimum number of strong lights in a list with weak ones; shorter lists have no weak lights.
const LEAST_STRONG: usize = 2;

/// Number of rays that shaders send to the weak lights of a list.
const WEAK_RAYS: usize = c::WEAK_RAYS as usize;

/// Number of strong lights among entries in descending order of their light.
fn strong(entries: &[Entry]) -> usize {
    let all: f32 = entries.iter().map(Entry::given).sum();
    let mut weak = 0.0;
    let few = entries.iter().rev().take_while(|entry| {
        weak += entry.given();
        weak <= all * WEAK_PART
    });
    let strong = entries.len() - few.count();
    if all.is_finite() && strong.max(LEAST_STRONG) + WEAK_RAYS < entries.len() {
        strong.max(LEAST_STRONG)
    } else {
        entries.len()
    }
}

/// The lights of a row, strong ones first.
struct Row {
    entries: Vec<Entry>,
    strong: usize,
}

impl Row {
    /// `swept`: the visibility of the lights is known, so that weak ones can be identified.
    fn new(mut entries: Vec<Entry>, swept: bool) -> Self {
        entries.sort_by(|a, b| b.given().total_cmp(&a.given()).then(a.light.cmp(&b.light)));
        let strong = if swept {
            strong(&entries)
        } else {
            entries.len()
        };
        Self { entries, strong }
    }
}

/// The rows of a cell.
struct RowsOfCell {
    of_all: Row,
    /// For each normal bin with surfaces, its row.
    bins: [Option<Row>; NORMAL_BINS],
}

impl RowsOfCell {
    /// `listed`: the lights of the cell's cluster.
    fn new(
        source: &MapLightSource<'_>,
        cell: &Cell,
        normal_bins: &NormalBins,
        listed: &[Listed<'_>],
    ) -> Self {
        let near: Vec<&Listed<'_>> = (listed.iter())
            .filter(|light| !light.triangle.is_some_and(|t| cell.behind(t)))
            .collect();
        let cluster = i32::try_from(cell.cluster).unwrap_or(i32::MAX);
        let swept = !source.lists.shares(cluster).is_empty();
        let nearest = cell.ball().1 * NEAREST;
        let entry = |light: &Listed<'_>, arriving: f32, share: f32| Entry {
            light: light.number,
            weight: share / arriving.max(f32::MIN_POSITIVE),
            visibility: arriving,
        };
        let places = Place::throughout(cell);
        let anywhere = shares(
            &near,
            &Arriving::as_listed(&near, &places),
            &places,
            nearest,
        );
        let of_all = near.iter().zip(&anywhere);
        let of_all = of_all.map(|(light, share)| entry(light, light.visibility, *share));
        let bins = std::array::from_fn(|bin| {
            let points = normal_bins.get(bin).filter(|points| !points.is_empty())?;
            let places: Vec<Place> = (points.iter())
                .map(|&(point, normal)| Place::on_surface(point, normal))
                .collect();
            let arriving = match source.occlusion {
                Some(occlusion) => Arriving::looked_for(&near, &places, occlusion),
                None => Arriving::as_listed(&near, &places),
            };
            let own = shares(&near, &arriving, &places, nearest);
            let lights = near.iter().zip(&arriving.together);
            let entries = lights
                .zip(anywhere.iter().zip(&own))
                .filter(|((light, _), _)| !light.is_below(cell, bin))
                .map(|((light, &arriving), (any, own))| {
                    let any = any * arriving / light.visibility.max(f32::MIN_POSITIVE);
                    let share = ANYWHERE_PART * any + (1.0 - ANYWHERE_PART) * own;
                    entry(light, arriving, share)
                });
            Some(Row::new(entries.collect(), swept))
        });
        Self {
            of_all: Row::new(of_all.collect(), swept),
            bins,
        }
    }
}

/// Number of cells for which one thread builds rows at a time.
const CELLS_AT_ONCE: usize = 16;

/// Rows and slots of the lists: for each cell its rows. The last row always exists and holds all lights.
pub fn rows(
    source: &MapLightSource<'_>,
    numbers: &[Option<u32>],
    cells: &Cells,
) -> (Vec<t::LightRow>, Vec<t::LightSlot>) {
    let lists = source.lists;
    let clusters = 0..i32::try_from(lists.clusters()).unwrap_or(i32::MAX);
    let listed_in: Vec<Vec<Listed<'_>>> = clusters.map(|c| listed(source, numbers, c)).collect();
    let listed_in = &listed_in;
    let normal_bins = cells.normal_bins.chunks(CELLS_AT_ONCE);
    let made: Vec<_> = (cells.cells.chunks(CELLS_AT_ONCE).zip(normal_bins))
        .map(|(cells, normal_bins)| {
            Late::new(move || {
                let cells = cells.iter().zip(normal_bins);
                let rows = cells.map(|(cell, normal_bins)| {
                    let listed = listed_in.get(cell.cluster).map_or(&[][..], Vec::as_slice);
                    (cell, RowsOfCell::new(source, cell, normal_bins, listed))
                });
                rows.collect::<Vec<_>>()
            })
        })
        .collect();
    make_all(
        &made
            .iter()
            .map(|late| late as &dyn Make)
            .collect::<Vec<_>>(),
    );
    let mut rows = Vec::with_capacity(cells.cells.len() * NORMAL_BINS + 1);
    let mut slots = Vec::new();
    let mut placed = |row: &Row, cluster: Option<i32>| {
        let first = count(slots.len());
        append_slots(&mut slots, &row.entries);
        append_slots(&mut slots, part(&row.entries, row.strong..));
        t::LightRow {
            first,
            count: count(row.entries.len()),
            strong: count(row.strong),
            suns: u32::from(cluster.is_none_or(|c| lists.sees_sky(c))),
            cluster: cluster.map_or(u32::MAX, i32::unsigned_abs),
        }
    };
    for (cell, made) in made.into_iter().flat_map(Late::take) {
        let cluster = i32::try_from(cell.cluster).ok();
        let of_all = placed(&made.of_all, cluster);
        for bin in &made.bins {
            let own = bin.as_ref().map(|row| placed(row, cluster));
            rows.push(own.unwrap_or(of_all));
        }
    }
    let all = listed(source, numbers, -1);
    let all = all.iter().map(|light| Entry {
        light: light.number,
        weight: light.power(),
        visibility: light.visibility,
    });
    rows.push(placed(&Row::new(all.collect(), false), None));
    (rows, slots)
}

/// A light of a list. `triangle_number`: maps the index of a triangle light to its number; `None` omits the light.
pub fn listed_light<'a>(
    source: &MapLightSource<'a>,
    entry: u32,
    visibility: f32,
    triangle_number: impl Fn(usize) -> Option<u32>,
) -> Option<Listed<'a>> {
    Some(match source.lists.light(entry) {
        LightRef::Triangle(index) => {
            let light = source.triangles.get(index as usize)?;
            Listed {
                number: triangle_number(index as usize)?,
                bounds: triangle_bounds(&triangle_light(light, 0.0, Vec3::ZERO)),
                triangle: Some(light),
                visibility,
            }
        }
        LightRef::Point(index) => Listed {
            number: source.point_number(index as usize),
            bounds: sphere_bounds(&point_light(source.points.get(index as usize)?, 0.0)),
            triangle: None,
            visibility,
        },
    })
}

/// The lights of a cluster's list; all lights for -1.
fn listed<'a>(
    source: &MapLightSource<'a>,
    numbers: &[Option<u32>],
    cluster: i32,
) -> Vec<Listed<'a>> {
    let lists = source.lists;
    let shares = lists.shares(cluster);
    let light = |(i, &entry): (usize, &u32)| {
        let share = shares.get(i).copied().unwrap_or(LightShare::UNKNOWN);
        let number = |index| numbers.get(index).copied().flatten();
        listed_light(source, entry, share.visible, number)
    };
    let entries = lists.row(cluster).iter().enumerate();
    entries.filter_map(light).collect()
}
