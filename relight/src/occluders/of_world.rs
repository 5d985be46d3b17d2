//! The occluders of a world.

use super::{CutOut, Occluders};
use crate::materials::light::SurfaceClass;
use crate::world::{RelitWorld, WorldMaterial, WorldSurface};
use std::collections::HashMap;
use std::sync::Arc;

impl Occluders {
    /// Triangles of the world model that stop light: opaque ones, and cut-outs with their holes where these are
    /// known. The tag is the triangle's index.
    pub(crate) fn of_world(world: &RelitWorld) -> Occluders {
        Occluders::of_surfaces(world, |_| true)
    }

    /// Those of [`of_world`](Self::of_world) that cast shadows of lamps and suns.
    pub(crate) fn that_shadow(world: &RelitWorld) -> Occluders {
        Occluders::of_surfaces(world, |surface| world.casts_shadow(surface))
    }

    fn of_surfaces(world: &RelitWorld, wanted: impl Fn(&WorldSurface) -> bool) -> Occluders {
        let drawn = world.surfaces.iter().filter(|s| {
            let material = world.materials.get(s.material as usize);
            let stops = material.is_some_and(|m| m.is_sky() || stops_light(m));
            s.model == 0 && stops && wanted(s)
        });
        let mut holes_of = HashMap::new();
        for surface in &world.surfaces {
            let material = world.materials.get(surface.material as usize);
            if let Some(holes) = material.and_then(|m| m.holes.as_ref()) {
                let first = surface.first_index / 3;
                holes_of.extend((first..first + surface.num_indices / 3).map(|t| (t, holes)));
            }
        }
        Occluders::new(drawn.flat_map(|surface| {
            let material = world.materials.get(surface.material as usize);
            let sky = material.is_some_and(WorldMaterial::is_sky);
            let first = surface.first_index as usize / 3;
            (first..first + surface.num_indices as usize / 3)
                .map(move |t| (world.triangle(t), sky, t as u32))
        }))
        .cut(|tag| {
            let holes = holes_of.get(&tag)?;
            let [a, b, c] = world.corners(tag as usize);
            Some(CutOut {
                st: [a.st, b.st, c.st],
                holes: Arc::clone(holes),
            })
        })
    }
}

fn stops_light(material: &WorldMaterial) -> bool {
    let solid = matches!(
        material.class.class,
        SurfaceClass::Opaque | SurfaceClass::Mirror | SurfaceClass::Portal
    );
    (solid && !material.class.passed) || material.holes.is_some()
}
