//! The lists that lights are drawn from: for each cell one for each direction that surfaces in it face.
//!
//! What faces away from a lamp gets nothing from it, however strong it is in the cell: with one list for all normals most
//! candidates on a wall may be lamps behind it. So a list's chances are by what its lights give to surfaces that face
//! about one way, where those lie; and by what of that arrives, which rays tell. What moves has the list of the cell for all normals where nothing of the map faces
//! its way.

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

/// Lights nearer to such a point than this part of the cell's half diagonal are taken to be as far away: what they give
/// grows without end there, but next to few points.
const NEAREST: f32 = 1.0 / 6.0;

/// Part of the chances of a list for one direction that is as in the list of the cell for all: for what moves, and for
/// places that are like none of the points.
const ANYWHERE_PART: f32 = 0.125;

/// Part of a list's light that its weak lights may give together, by what is known of them. Where all lights are used,
/// some of these are picked at random.
const WEAK_PART: f32 = 0.2;

/// Fewest strong lights of a list that has weak ones: shorter lists are used whole.
const LEAST_STRONG: usize = 2;

/// Rays for the weak lights of a list, as the shaders send them.
const WEAK_RAYS: usize = c::WEAK_RAYS as usize;

/// How many of the entries, which fall by what they give, are strong.
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

/// The lights of a row, with the strong ones first.
struct Row {
    entries: Vec<Entry>,
    strong: usize,
}

impl Row {
    /// `swept`: the lights' visibility is known, so that weak ones can be told.
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
    /// For each direction, where something faces that way.
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

/// Cells whose rows one thread makes at a time.
const CELLS_AT_ONCE: usize = 16;

/// Rows and slots of the lists: for each cell a row for each direction. The last row, which is always there, holds all
/// lights.
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

/// A light of a list. `triangle_number`: the number of a triangle light, by its index; `None` leaves it out.
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

/// The lights of a cluster's list, or of all for -1.
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
