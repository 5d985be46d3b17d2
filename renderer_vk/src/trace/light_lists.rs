//! The light list that each cell wants for each normal bin.
//!
//! A lamp gives no light to surfaces that face away from it, however strong it is in the cell: with one list for all
//! normals, most candidates on a wall may be lamps behind it. The probabilities of a list are therefore proportional to
//! the light that arrives at surfaces of its normal bin; rays estimate the visibility. Moving geometry uses the cell's
//! list for all normals if the map has no surface in its bin. [`light_rows`](super::light_rows) stores the lists.

use glam::Vec3;
use relight::light::{LightRef, LightShare};

use super::light_cells::Cell;
use super::light_normal_bins::{NORMAL_BINS, NormalBins};
use super::light_weights::{Arriving, Listed, Place, shares};
use super::lights::{MapLightSource, point_light, sphere_bounds, triangle_bounds, triangle_light};

/// Least distance at which a light is weighted, as a part of the cell's half diagonal; it bounds the inverse-square
/// law, which would overweight a light that few points are close to.
const NEAREST: f32 = 1.0 / 6.0;

/// Part of a normal bin's probabilities that comes from the cell's list for all normals: for moving geometry, and for
/// points unlike all sample points.
const ANYWHERE_PART: f32 = 0.125;

/// A light of a cell's list.
#[derive(Clone, Copy)]
pub struct Member {
    /// Index in the cluster's list.
    pub index: u32,
    /// Estimated light that arrives; any unit.
    pub share: f32,
    /// Estimated visible part of the light, above 0.
    pub visibility: f32,
}

/// The lists of a cell.
pub struct ListsOfCell {
    /// For surfaces without a bin.
    pub of_all: Vec<Member>,
    /// For each normal bin with surfaces, its list.
    pub bins: [Option<Vec<Member>>; NORMAL_BINS],
}

impl ListsOfCell {
    /// `listed`: the lights of the cell's cluster.
    pub fn new(
        source: &MapLightSource<'_>,
        cell: &Cell,
        normal_bins: &NormalBins,
        listed: &[Listed<'_>],
    ) -> Self {
        let near: Vec<(u32, &Listed<'_>)> = (0..)
            .zip(listed)
            .filter(|(_, light)| !light.triangle.is_some_and(|t| cell.behind(t)))
            .collect();
        let indices = || near.iter().map(|(index, _)| *index);
        let near: Vec<&Listed<'_>> = near.iter().map(|(_, light)| *light).collect();
        let nearest = cell.ball().1 * NEAREST;
        let places = Place::throughout(cell);
        let anywhere = shares(
            &near,
            &Arriving::as_listed(&near, &places),
            &places,
            nearest,
        );
        let of_all = indices().zip(near.iter().zip(&anywhere));
        let of_all = of_all.map(|(index, (light, &share))| Member {
            index,
            share,
            visibility: light.visibility,
        });
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
            let lights = indices().zip(near.iter().zip(&arriving.together));
            let members = lights
                .zip(anywhere.iter().zip(&own))
                .filter(|((_, (light, _)), _)| !light.is_below(cell, bin))
                .map(|((index, (light, &arriving)), (any, own))| {
                    let any = any * arriving / light.visibility.max(f32::MIN_POSITIVE);
                    Member {
                        index,
                        share: ANYWHERE_PART * any + (1.0 - ANYWHERE_PART) * own,
                        visibility: arriving,
                    }
                });
            Some(members.collect())
        });
        Self {
            of_all: of_all.collect(),
            bins,
        }
    }

    /// The list for all normals and those of the normal bins.
    pub fn lists(&self) -> impl Iterator<Item = &Vec<Member>> {
        [&self.of_all].into_iter().chain(self.bins.iter().flatten())
    }
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

/// The lights of a cluster's list in ascending order of their numbers; all lights for -1.
pub fn listed<'a>(
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
    let mut listed: Vec<Listed<'a>> = entries.filter_map(light).collect();
    listed.sort_by_key(|light| light.number);
    listed
}
