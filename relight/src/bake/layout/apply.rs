//! Writes a layout into a map.

use super::charts::Chart;
use super::pack::Place;
use glam::Vec2;
use q3bsp::{Bsp, Lightmap, Lump, NO_STYLE, lightmap_index};

/// A chart with its place.
pub(super) struct Placed<'a> {
    pub chart: &'a Chart,
    pub place: Place,
    pub border: u32,
    /// Texels per side of the page.
    pub side: u32,
}

/// Gives surfaces blank pages and the coordinates of their charts. Surfaces that have none are lit by vertex, where they had
/// a page before. Vertices that surfaces with charts share with others are copied: returns how many.
pub(super) fn apply(bsp: &mut Bsp, charts: &[Placed<'_>], pages: usize, side: u32) -> usize {
    for surface in bsp.surfaces.iter_mut().filter(|s| s.lightmap >= 0) {
        surface.lightmap = lightmap_index::BY_VERTEX;
    }
    for layers in &mut bsp.layers.surfaces {
        layers.lightmaps = [lightmap_index::BY_VERTEX; 3];
        let [_, rest @ ..] = &mut layers.lightmap_styles;
        rest.fill(NO_STYLE);
    }
    let texels = side as usize * side as usize;
    let blank = Lightmap(vec![0; texels * 3].into());
    bsp.lightmaps = vec![blank; pages];
    forget_pages(bsp);
    let mut used = vec![false; bsp.vertices.len()];
    let mut copied = 0;
    for placed in charts {
        for (surface, points) in &placed.chart.parts {
            copied += place(bsp, &mut used, *surface, points, placed);
        }
    }
    copied
}

/// Drops what the map's container keeps about its former pages: bytes after the last one, and page numbers that
/// [`Bsp::write`] would put back.
fn forget_pages(bsp: &mut Bsp) {
    if let Some(trailing) = bsp.container.trailing.get_mut(Lump::Lightmaps.index()) {
        trailing.clear();
    }
    let by_vertex = lightmap_index::BY_VERTEX;
    let of_page = |lump: Lump, replacement: i32| lump == Lump::Surfaces && replacement == by_vertex;
    (bsp.container.repairs).retain(|repair| !of_page(repair.lump, repair.replacement));
    (bsp.warnings).retain(|w| !(w.lump == Lump::Surfaces && w.field.starts_with("lightmapNum")));
}

fn place(
    bsp: &mut Bsp,
    used: &mut Vec<bool>,
    number: u32,
    points: &[Vec2],
    placed: &Placed<'_>,
) -> usize {
    let Some(mut surface) = bsp.surfaces.get(number as usize).copied() else {
        return 0;
    };
    let range = |first: i32, count: i32| {
        let first = usize::try_from(first).unwrap_or(0);
        first..first.saturating_add(usize::try_from(count).unwrap_or(0))
    };
    let mut vertices = range(surface.first_vert, surface.num_verts);
    let shared = used.get(vertices.clone());
    let mut copied = 0;
    if shared.is_some_and(|shared| shared.contains(&true)) {
        let first = bsp.vertices.len();
        bsp.vertices.extend_from_within(vertices.clone());
        if bsp.layers.vertices.len() >= first {
            bsp.layers.vertices.extend_from_within(vertices.clone());
        }
        copied = vertices.len();
        vertices = first..bsp.vertices.len();
        used.resize(bsp.vertices.len(), false);
        surface.first_vert = i32::try_from(first).unwrap_or(i32::MAX);
    }
    if let Some(used) = used.get_mut(vertices.clone()) {
        used.fill(true);
    }
    let corner = [placed.place.x, placed.place.y].map(|c| c + placed.border);
    let origin = Vec2::new(corner[0] as f32, corner[1] as f32);
    let vertices = bsp.vertices.get_mut(vertices).unwrap_or_default();
    for (vertex, point) in vertices.iter_mut().zip(points) {
        vertex.lightmap = (origin + *point) / placed.side as f32;
    }
    let int = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
    surface.lightmap = int(placed.place.page);
    surface.lightmap_x = int(corner[0]);
    surface.lightmap_y = int(corner[1]);
    surface.lightmap_width = int(placed.chart.width);
    surface.lightmap_height = int(placed.chart.height);
    if let Some(stored) = bsp.surfaces.get_mut(number as usize) {
        *stored = surface;
    }
    copied
}
