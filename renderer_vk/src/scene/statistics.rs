//! Counts of a view for `r_speeds`: what the engine's own renderer counts, of this one's work.

use glam::{Vec3, Vec4};
use q3bsp::SurfaceKind;

use super::gather::Gatherer;
use super::{DrawSurface, ViewScene};
use crate::assets::Model;
use crate::world::{Bounds, WorldData};

/// How boxes lie to the view's pyramid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounts {
    /// Wholly within.
    pub inside: u32,
    /// Cut by it.
    pub clipped: u32,
    /// Wholly without.
    pub outside: u32,
}

/// Counts of a view or of all views of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Runs of surfaces that are drawn as one.
    pub shaders: u32,
    /// Surfaces drawn.
    pub surfaces: u32,
    /// Leafs of the map in sight.
    pub leafs: u32,
    /// Vertices of the surfaces.
    pub vertices: u32,
    /// Triangles of the surfaces.
    pub triangles: u32,
    /// Triangles times the passes of their materials.
    pub drawn_triangles: u32,
    /// Curved surfaces of the map.
    pub patches: CullCounts,
    /// Models.
    pub models: CullCounts,
    /// Cluster of the eye; -1: outside of the map.
    pub cluster: i32,
    /// Surfaces that a dynamic light reaches.
    pub lit_surfaces: u32,
    /// Surfaces near a dynamic light that it does not reach.
    pub unlit_surfaces: u32,
    /// Vertices drawn once more for a dynamic light.
    pub lit_vertices: u32,
    /// Triangles drawn once more for a dynamic light.
    pub lit_triangles: u32,
    /// Flares in sight, before what covers them is known.
    pub flares: u32,
    /// Distance of the far plane, units.
    pub far: f32,
}

impl CullCounts {
    fn add(&mut self, corners: &[Vec3; 8], planes: &[Vec4]) {
        let behind = |plane: &Vec4| {
            corners
                .iter()
                .filter(|corner| plane.truncate().dot(**corner) < plane.w)
                .count()
        };
        let mut cut = false;
        for plane in planes {
            match behind(plane) {
                0 => {}
                8 => {
                    self.outside += 1;
                    return;
                }
                _ => cut = true,
            }
        }
        if cut {
            self.clipped += 1;
        } else {
            self.inside += 1;
        }
    }
}

impl Statistics {
    /// Adds another view's counts; where it looks from is kept from the newest.
    pub fn add(&mut self, other: &Self) {
        let Self {
            shaders,
            surfaces,
            leafs,
            vertices,
            triangles,
            drawn_triangles,
            patches,
            models,
            cluster,
            lit_surfaces,
            unlit_surfaces,
            lit_vertices,
            lit_triangles,
            flares,
            far,
        } = *other;
        self.shaders += shaders;
        self.surfaces += surfaces;
        self.leafs += leafs;
        self.vertices += vertices;
        self.triangles += triangles;
        self.drawn_triangles += drawn_triangles;
        for (sum, counts) in [(&mut self.patches, patches), (&mut self.models, models)] {
            sum.inside += counts.inside;
            sum.clipped += counts.clipped;
            sum.outside += counts.outside;
        }
        self.cluster = cluster;
        self.lit_surfaces += lit_surfaces;
        self.unlit_surfaces += unlit_surfaces;
        self.lit_vertices += lit_vertices;
        self.lit_triangles += lit_triangles;
        self.flares += flares;
        self.far = far;
    }

    fn add_surface(&mut self, surface: &DrawSurface, passes: usize, indices: &[u32]) {
        let triangles = u32::try_from(indices.len() / 3).unwrap_or(u32::MAX);
        // a surface's vertices lie together
        let vertices = match (indices.iter().min(), indices.iter().max()) {
            (Some(first), Some(last)) => last - first + 1,
            _ => 0,
        };
        self.surfaces += 1;
        self.vertices += vertices;
        self.triangles += triangles;
        let passes = u32::try_from(passes).unwrap_or(u32::MAX);
        self.drawn_triangles = self
            .drawn_triangles
            .saturating_add(triangles.saturating_mul(passes));
        if surface.dlights != 0 {
            self.lit_surfaces += 1;
            self.lit_vertices += vertices * surface.dlights.count_ones();
            self.lit_triangles += triangles * surface.dlights.count_ones();
        }
    }
}

impl Gatherer<'_> {
    /// Counts a gathered view. Only asked for when somebody looks.
    pub(super) fn count_view(&self, out: &ViewScene) -> Statistics {
        let mut counts = Statistics {
            cluster: -1,
            far: out.view.far,
            flares: super::gather::count(out.flares.len()),
            ..Statistics::default()
        };
        let static_indices = self.world.map_or(&[][..], |world| world.indices.as_slice());
        let mut last = None;
        for surface in &out.surfaces {
            let material = self.input.materials.get(surface.material);
            let indices = out.indices_of(surface, static_indices);
            counts.add_surface(surface, material.passes.len(), indices);
            let run = (
                surface.material,
                surface.instance,
                surface.fog,
                surface.lightmap,
            );
            if last.replace(run) != Some(run) {
                counts.shaders += 1;
            }
        }
        if let Some(world) = self.world {
            counts.leafs = self.visible.leafs;
            counts.cluster = self.visible.cluster().unwrap_or(-1);
            self.count_world(world, &mut counts);
        }
        self.count_models(&mut counts);
        counts
    }

    fn count_world(&self, world: &WorldData, counts: &mut Statistics) {
        let mut lights = Vec::new();
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        super::surfaces::local_lights(self.lights, Vec3::ZERO, &axes, &mut lights);
        for &index in &self.visible.surfaces {
            let Some(surface) = world.surfaces.get(index as usize) else {
                continue;
            };
            if surface.kind == SurfaceKind::Patch {
                counts.patches.add(&surface.bounds.corners(), &self.frustum);
            }
            let near = super::surfaces::lights_at(&lights, &surface.bounds);
            let reached = surface.plane.filter(|_| surface.flat).is_none_or(|plane| {
                lights
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| *i < 32 && near & (1 << i) != 0)
                    .any(|(_, light)| plane.distance(light.world).abs() <= light.radius)
            });
            counts.unlit_surfaces += u32::from(near != 0 && !reached);
        }
    }

    fn count_models(&self, counts: &mut Statistics) {
        for entity in self.entities {
            let model = self.input.models.get(entity.model);
            let Some(model) = model.filter(|_| entity.kind == crate::api::EntityKind::Model) else {
                continue;
            };
            let frame = usize::try_from(entity.frame).ok();
            let Some((mins, maxs)) = frame.and_then(|frame| frame_bounds(model, frame)) else {
                continue;
            };
            let bounds = Bounds { mins, maxs };
            let corners = bounds.corners().map(|c| {
                entity.origin + entity.axis[0] * c.x + entity.axis[1] * c.y + entity.axis[2] * c.z
            });
            counts.models.add(&corners, &self.frustum);
        }
    }
}

/// The box around a frame of a model of triangles.
fn frame_bounds(model: &Model, frame: usize) -> Option<(Vec3, Vec3)> {
    let frames = match model {
        Model::Mesh { lods } => &lods.first()?.md3.frames,
        Model::Mdr(model) => &model.mdr.frames,
        Model::Iqm(model) => return model.iqm.bounds.get(frame).copied(),
        Model::Inline { .. } => return None,
    };
    frames.get(frame).map(|frame| (frame.mins, frame.maxs))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_inside_cut_or_outside() {
        let plane = Vec3::X.extend(0.0);
        let corners = |x: f32| {
            Bounds {
                mins: Vec3::new(x, 0.0, 0.0),
                maxs: Vec3::new(x + 2.0, 1.0, 1.0),
            }
            .corners()
        };
        let mut counts = CullCounts::default();
        for x in [1.0, 5.0, -1.0, -9.0] {
            counts.add(&corners(x), &[plane]);
        }
        let expected = CullCounts {
            inside: 2,
            clipped: 1,
            outside: 1,
        };
        assert_eq!(counts, expected);
    }

    #[test]
    fn views_add_up_and_the_newest_says_where() {
        let view = |cluster, far| Statistics {
            surfaces: 3,
            cluster,
            far,
            ..Statistics::default()
        };
        let mut sum = view(1, 10.0);
        sum.add(&view(2, 20.0));
        assert_eq!((sum.surfaces, sum.cluster, sum.far), (6, 2, 20.0));
    }
}
