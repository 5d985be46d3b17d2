//! Counts of a view for `r_speeds`: those of the engine's renderer, for this renderer's work.

use glam::Vec3;
use q3bsp::SurfaceKind;
use q3model::Frame;
use support::Aabb;
use support::slice;

use super::cull::{self, Lies, ModelLies};
use super::gather::Gatherer;
use super::key_frames::Frames;
use super::{ClassicScene, DrawSurface};
use crate::api::{RefEntity, renderfx};
use crate::assets::Model;
use crate::world::WorldData;

/// Results of tests against the frustum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lying {
    /// Completely inside.
    pub inside: u32,
    /// Crossing a plane.
    pub clipped: u32,
    /// Completely outside.
    pub outside: u32,
}

/// Counts of a view, or of all views of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Runs of surfaces drawn together.
    pub shaders: u32,
    /// Surfaces drawn.
    pub surfaces: u32,
    /// Visible leafs of the map.
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
    /// Cluster of the camera; -1: outside of the map.
    pub cluster: i32,
    /// Surfaces that a dynamic light reaches.
    pub lit_surfaces: u32,
    /// Surfaces whose box a dynamic light overlaps, but not their plane.
    pub unlit_surfaces: u32,
    /// Vertices drawn again for dynamic lights.
    pub lit_vertices: u32,
    /// Triangles drawn again for dynamic lights.
    pub lit_triangles: u32,
    /// Flares in the frustum, before the occlusion test.
    pub flares: u32,
    /// Distance of the far plane, units.
    pub far: f32,
}

/// Tests of curves or of models: of spheres, and of boxes where spheres did not decide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounts {
    /// Spheres.
    pub spheres: Lying,
    /// Boxes.
    pub boxes: Lying,
}

impl Lying {
    fn count(&mut self, lies: Lies) {
        *match lies {
            Lies::Inside => &mut self.inside,
            Lies::Across => &mut self.clipped,
            Lies::Outside => &mut self.outside,
        } += 1;
    }

    fn add(&mut self, other: Self) {
        self.inside += other.inside;
        self.clipped += other.clipped;
        self.outside += other.outside;
    }
}

impl CullCounts {
    fn count(&mut self, lies: ModelLies) {
        if let Some(lies) = lies.by_sphere {
            self.spheres.count(lies);
        }
        if let Some(lies) = lies.by_box {
            self.boxes.count(lies);
        }
    }

    fn add(&mut self, other: Self) {
        self.spheres.add(other.spheres);
        self.boxes.add(other.boxes);
    }
}

impl Statistics {
    /// Adds the counts of another view; cluster and far plane are those of the other view.
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
        self.patches.add(patches);
        self.models.add(models);
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
        // the vertices of a surface are contiguous
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
    /// Counts a gathered view, if `r_speeds` is set.
    pub(super) fn count_view(&self, out: &ClassicScene) -> Statistics {
        let mut counts = Statistics {
            cluster: -1,
            far: out.view.far,
            flares: super::gather::count(out.flares.len()),
            ..Statistics::default()
        };
        let static_indices = self.world.map_or(&[][..], |world| world.indices.as_slice());
        let mut last = None;
        for surface in &out.look.surfaces {
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
            let Some(surface) = slice::get(&world.surfaces, index as usize) else {
                continue;
            };
            if surface.kind == SurfaceKind::Patch {
                counts.patches.count(self.curve_lies(&surface.bounds));
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

    /// Tests a curve of the map: the sphere around its box, then the box.
    fn curve_lies(&self, bounds: &Aabb) -> ModelLies {
        let half = bounds.size() * 0.5;
        let by_sphere = cull::sphere(bounds.mins + half, half.length(), &self.frustum);
        ModelLies {
            by_sphere: Some(by_sphere),
            by_box: (by_sphere == Lies::Across)
                .then(|| cull::corners(&bounds.corners(), &self.frustum)),
        }
    }

    fn count_models(&self, counts: &mut Statistics) {
        for entity in self.entities {
            let model = self.input.models.get(entity.model);
            let Some(model) = model.filter(|_| entity.kind == crate::api::EntityKind::Model) else {
                continue; // not a model
            };
            if entity.renderfx & renderfx::FIRST_PERSON != 0 && self.view.is_portal {
                continue;
            }
            let of_frames = |list: &[Frame]| {
                let frames = Frames::of(entity, list.len());
                let (new, old) = (list.get(frames.new)?, list.get(frames.old)?);
                Some(cull::model(entity, new, old, &self.frustum))
            };
            let lies = match model {
                Model::Mesh { lods } => lods.first().and_then(|lod| of_frames(&lod.md3.frames)),
                Model::Mdr(model) => of_frames(&model.mdr.frames),
                Model::Iqm(model) => Some(self.skeleton_lies(entity, &model.iqm)),
                Model::Inline { .. } => None,
            };
            if let Some(lies) = lies {
                counts.models.count(lies);
            }
        }
    }

    fn skeleton_lies(&self, entity: &RefEntity, iqm: &q3model::Iqm) -> ModelLies {
        let frames = Frames::of(entity, iqm.num_frames.max(iqm.bounds.len()));
        let of = |frame: usize| iqm.bounds.get(frame).map(|&(a, b)| Aabb::new(a, b));
        let by_box = match (of(frames.new), of(frames.old)) {
            (Some(new), Some(old)) => {
                cull::corners(&cull::placed(entity, &new.union(old)), &self.frustum)
            }
            // a model without bounds is never culled
            _ => Lies::Across,
        };
        ModelLies {
            by_sphere: None,
            by_box: Some(by_box),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_test_that_was_made_counts() {
        let mut counts = CullCounts::default();
        let lies = |by_sphere, by_box| ModelLies { by_sphere, by_box };
        counts.count(lies(Some(Lies::Inside), None));
        counts.count(lies(Some(Lies::Across), Some(Lies::Outside)));
        counts.count(lies(None, Some(Lies::Across)));
        let lying = |inside, clipped, outside| Lying {
            inside,
            clipped,
            outside,
        };
        let expected = CullCounts {
            spheres: lying(1, 1, 0),
            boxes: lying(0, 1, 1),
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
