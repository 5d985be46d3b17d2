//! Vertex light of surfaces without a lightmap, as samples.

use super::samples::{Sample, SampleContext, is_measurable, pick, sample_at};
use super::texels::Stored;
use crate::world::WorldSurface;
use q3bsp::SurfaceKind;
use support::parallel;
use support::random::Random;
use support::slice::part;

/// Whether a surface is lit by vertex and its vertices are the map's own.
pub(super) fn lit(surface: &WorldSurface) -> bool {
    surface.light_page == q3bsp::lightmap_index::BY_VERTEX
        && matches!(
            surface.kind,
            SurfaceKind::Planar | SurfaceKind::TriangleSoup
        )
}

/// Lit vertices, each with equal probability regardless of the size of its surface.
pub(super) fn take(context: &SampleContext<'_>, count: usize, random: &mut Random) -> Vec<Sample> {
    let world = context.world;
    let mut all = Vec::new();
    for (index, surface) in world.surfaces.iter().enumerate() {
        if !lit(surface) || !is_measurable(world, surface) {
            continue;
        }
        let stored = world.bsp.surfaces.get(index);
        let stored = stored.map_or(&[][..], |s| world.bsp.surface_vertices(s));
        let made = part(&world.vertices, surface.first_vertex as usize..);
        all.extend(stored.iter().zip(made).map(|(raw, vertex)| {
            let [r, g, b, _] = raw.color;
            let place = (vertex.position, vertex.normal);
            (place, surface.material, Stored::alone([r, g, b]))
        }));
    }
    let chosen: Vec<_> = (pick(all.len(), count, random))
        .filter_map(|i| all.get(i).copied())
        .collect();
    let found = parallel::map(&chosen, |_, &(place, material, stored)| {
        let mut sample = sample_at(context, place, material, stored)?;
        context.remove_dirt(&mut sample);
        Some(sample)
    });
    found.into_iter().flatten().collect()
}
