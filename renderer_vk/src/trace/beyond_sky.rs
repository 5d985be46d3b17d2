//! Geometry that is visible through skies.
//!
//! The engine draws a sky behind everything else, wherever its surfaces are: surfaces of the visible set that lie
//! behind a sky surface are visible through it. Few views have any. This module computes boxes around them; a primary
//! ray continues behind a sky only if it meets one of the boxes.

use std::collections::BTreeMap;

use glam::{Vec3, Vec4};
use shaders::types::Instance;
use support::Aabb;

use super::geometry::StaticGeometry;
use super::input::{Kind, MaterialTable, StaticScene};
use super::layer_boxes::{bounds_of, may_be_seen, placed};
use super::parts::axes;
use super::surroundings::merged;
use crate::scene::{TracedScene, turned};

/// Maximum number of boxes that a ray is tested against; above it, boxes are merged.
const MAX_BOXES: usize = 48;
/// Points less than this far behind a plane, units, count as in the plane.
const IN_PLANE: f32 = 0.1;

/// Sky surfaces in one plane, in the space of their model.
#[derive(Debug)]
struct Sky {
    model: u32,
    point: Vec3,
    normal: Vec3,
    /// Surface numbers and bounds.
    surfaces: Vec<(u32, Aabb)>,
}

/// The skies of a map, and the bounds of surfaces that may be visible through them.
#[derive(Debug, Default)]
pub struct MapSkies {
    skies: Vec<Sky>,
    /// Greatest surface number in `skies`, plus one.
    sky_numbers: usize,
    /// Bounds of the world's other surfaces, by surface number.
    surfaces: Vec<Option<Aabb>>,
    /// Bounds of the brush models, by number.
    models: BTreeMap<u32, Aabb>,
}

impl MapSkies {
    /// Collects the skies of a map.
    pub fn new(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> Self {
        let mut made = Self::default();
        let mut planes: BTreeMap<(u32, [i32; 4]), Sky> = BTreeMap::new();
        for surface in &scene.surfaces {
            let (_, info) = materials.info(surface.material);
            let Some(kind) = Kind::of(info.flags) else {
                continue; // not traced
            };
            if kind == Kind::Sky {
                made.sky_numbers = made.sky_numbers.max(surface.number as usize + 1);
                let corners: Vec<Vec3> = scene.corners(surface).map(|v| v.position).collect();
                for corners in corners.chunks_exact(3) {
                    let [a, b, c] = [corners[0], corners[1], corners[2]];
                    let Some(normal) = (c - a).cross(b - a).try_normalize() else {
                        continue; // no area
                    };
                    // planes of one brush differ by rounding
                    #[allow(clippy::cast_possible_truncation)]
                    let key = (normal * 100.0).extend(normal.dot(a)).round().as_ivec4();
                    let key = (surface.model, key.to_array());
                    let sky = planes.entry(key).or_insert_with(|| Sky {
                        model: surface.model,
                        point: a,
                        normal,
                        surfaces: Vec::new(),
                    });
                    let bounds = Aabb::of([a, b, c]);
                    match sky.surfaces.last_mut() {
                        Some((number, all)) if *number == surface.number => {
                            *all = all.union(bounds);
                        }
                        _ => sky.surfaces.push((surface.number, bounds)),
                    }
                }
                continue;
            }
            let bounds = bounds_of(scene.corners(surface));
            if surface.model == 0 {
                let number = surface.number as usize;
                if made.surfaces.len() <= number {
                    made.surfaces.resize(number + 1, None);
                }
                made.surfaces[number] = Some(bounds);
            } else {
                let all = made.models.entry(surface.model).or_insert(bounds);
                *all = all.union(bounds);
            }
        }
        made.skies = planes.into_values().collect();
        made
    }
}

/// A sky in view, in world space.
struct Seen {
    /// Plane, oriented towards the camera: `xyz . p > w` on the camera's side.
    plane: Vec4,
    bounds: Aabb,
}

impl Seen {
    /// The sky transformed by an instance; `None`: it is not in view.
    fn of(
        sky: &Sky,
        instance: &Instance,
        is_seen: &dyn Fn(u32) -> bool,
        from: Vec3,
        lens: f32,
    ) -> Option<Self> {
        let surfaces = sky.surfaces.iter().filter(|(number, _)| is_seen(*number));
        let bounds = surfaces.map(|(_, bounds)| *bounds).reduce(Aabb::union)?;
        let bounds = placed(&bounds, instance)?;
        let axis = axes(instance);
        let normal = (axis * sky.normal).try_normalize()?;
        let plane = normal.extend(normal.dot(axis * sky.point + instance.origin));
        // rays end at the back of a sky, too
        let in_front = normal.dot(from) >= plane.w;
        Some(Self {
            plane: if in_front { plane } else { -plane },
            bounds: bounds.grown(Vec3::splat(lens)),
        })
    }

    /// Whether a ray from the camera may reach a box behind the sky.
    fn hides(&self, bounds: &Aabb, from: Vec3) -> bool {
        let normal = self.plane.truncate();
        if normal.dot(bounds.nearest(normal)) > self.plane.w - IN_PLANE {
            return false;
        }
        // these bounds hold all segments from the camera to the box
        bounds.with(from).touches(self.bounds)
    }
}

/// Geometry of a view that may be visible through its skies.
#[derive(Debug, Default)]
pub struct Beyond {
    /// Boxes around the geometry.
    pub boxes: Vec<Aabb>,
    /// Bit mask of the world's surfaces.
    pub surfaces: Vec<u32>,
}

impl Beyond {
    /// Computes it for a view. `lens`: greatest distance of a ray's origin from the camera, units. `geometry`: the
    /// map's, if the view shows it.
    pub fn of(
        view: &TracedScene,
        from: Vec3,
        lens: f32,
        geometry: Option<&StaticGeometry>,
        materials: &dyn MaterialTable,
    ) -> Self {
        let (Some(map), Some(world)) = (geometry.map(|g| &g.map_skies), view.instances.first())
        else {
            return Self::default();
        };
        if map.skies.is_empty() {
            return Self::default();
        }
        let mut beyond = Self::default();
        let skies = skies_in_sight(map, view, world, from, lens);
        let frustum = view.view.frustum();
        let is_hidden = |bounds: &Aabb| {
            may_be_seen(bounds, from, &frustum) && skies.iter().any(|sky| sky.hides(bounds, from))
        };
        if skies.is_empty() {
            return beyond;
        }
        for &number in &view.look.potential {
            let Some(Some(bounds)) = map.surfaces.get(number as usize) else {
                continue; // not traced
            };
            if is_hidden(bounds) {
                let word = number as usize / 32;
                if beyond.surfaces.len() <= word {
                    beyond.surfaces.resize(word + 1, 0);
                }
                beyond.surfaces[word] |= 1 << (number % 32);
                beyond.boxes.push(*bounds);
            }
        }
        let mut add = |bounds: Option<&Aabb>, instance: u32| {
            let instance = view.instances.get(instance as usize);
            let bounds = bounds.zip(instance).and_then(|(b, i)| placed(b, i));
            beyond.boxes.extend(bounds.filter(&is_hidden));
        };
        for submodel in &view.look.submodels {
            add(map.models.get(&submodel.model), submodel.instance);
        }
        for mesh in &view.meshes {
            // only directly visible geometry is behind a sky
            let (_, info) = materials.info(mesh.material);
            if mesh.paths < turned::PORTAL && Kind::of(info.flags).is_some() {
                let bounds = bounds_of(view.mesh_geometry(mesh).vertices.iter());
                add(Some(&bounds), mesh.instance);
            }
        }
        beyond.boxes = merged(beyond.boxes, MAX_BOXES);
        beyond
    }
}

fn skies_in_sight(
    map: &MapSkies,
    view: &TracedScene,
    world: &Instance,
    from: Vec3,
    lens: f32,
) -> Vec<Seen> {
    let frustum = view.view.frustum();
    let mut potential = vec![false; map.sky_numbers];
    for &number in &view.look.potential {
        if let Some(seen) = potential.get_mut(number as usize) {
            *seen = true;
        }
    }
    let mut found = Vec::new();
    for sky in &map.skies {
        let mut add = |instance: &Instance, is_seen: &dyn Fn(u32) -> bool| {
            let seen = Seen::of(sky, instance, is_seen, from, lens);
            found.extend(seen.filter(|sky| may_be_seen(&sky.bounds, from, &frustum)));
        };
        if sky.model == 0 {
            add(world, &|number| {
                potential.get(number as usize) == Some(&true)
            });
        }
        for submodel in view.look.submodels.iter().filter(|s| s.model == sky.model) {
            if let Some(instance) = view.instances.get(submodel.instance as usize) {
                add(instance, &|_| true);
            }
        }
    }
    found
}
