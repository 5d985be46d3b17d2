//! What shows through a sky.
//!
//! The engine draws a sky behind everything else, wherever its surfaces are: what lies behind them shows, too, if the
//! visible set holds it. Most views have nothing there. So it is found here what may lie behind a sky in sight, and rays
//! go on behind one only where they meet a box of that.

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

/// Boxes that a ray is held against; with more of them each is around several.
const MAX_BOXES: usize = 48;
/// Less far behind a plane, units, is in it.
const IN_PLANE: f32 = 0.1;

/// Surfaces of a sky in one plane, in the space of their model.
#[derive(Debug)]
struct Sky {
    model: u32,
    point: Vec3,
    normal: Vec3,
    /// Numbers and bounds.
    surfaces: Vec<(u32, Aabb)>,
}

/// The skies of a map, and what may show through them.
#[derive(Debug, Default)]
pub struct MapSkies {
    skies: Vec<Sky>,
    /// One more than the greatest number of a surface in `skies`.
    sky_numbers: usize,
    /// Of the world's other surfaces, by number.
    surfaces: Vec<Option<Aabb>>,
    /// Of the other models.
    models: BTreeMap<u32, Aabb>,
}

impl MapSkies {
    /// Of a map.
    pub fn new(scene: &StaticScene<'_>, materials: &dyn MaterialTable) -> Self {
        let mut made = Self::default();
        let mut planes: BTreeMap<(u32, [i32; 4]), Sky> = BTreeMap::new();
        for surface in &scene.surfaces {
            let (_, info) = materials.info(surface.material);
            let Some(kind) = Kind::of(info.flags) else {
                continue;
            };
            if kind == Kind::Sky {
                made.sky_numbers = made.sky_numbers.max(surface.number as usize + 1);
                let corners: Vec<Vec3> = scene.corners(surface).map(|v| v.position).collect();
                for corners in corners.chunks_exact(3) {
                    let [a, b, c] = [corners[0], corners[1], corners[2]];
                    let Some(normal) = (c - a).cross(b - a).try_normalize() else {
                        continue;
                    };
                    // those of one brush differ by rounding
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

/// A sky in sight.
struct Seen {
    /// Towards the eye: `xyz . p > w` on its side.
    plane: Vec4,
    bounds: Aabb,
}

impl Seen {
    /// Where an instance places it; `None`: the view shows nothing of it.
    fn of(
        sky: &Sky,
        instance: &Instance,
        is_seen: &dyn Fn(u32) -> bool,
        eye: Vec3,
        lens: f32,
    ) -> Option<Self> {
        let surfaces = sky.surfaces.iter().filter(|(number, _)| is_seen(*number));
        let bounds = surfaces.map(|(_, bounds)| *bounds).reduce(Aabb::union)?;
        let bounds = placed(&bounds, instance)?;
        let axis = axes(instance);
        let normal = (axis * sky.normal).try_normalize()?;
        let plane = normal.extend(normal.dot(axis * sky.point + instance.origin));
        // rays end at its back, too
        let in_front = normal.dot(eye) >= plane.w;
        Some(Self {
            plane: if in_front { plane } else { -plane },
            bounds: bounds.grown(Vec3::splat(lens)),
        })
    }

    /// Whether a ray from the eye may meet a box behind it.
    fn hides(&self, bounds: &Aabb, eye: Vec3) -> bool {
        let normal = self.plane.truncate();
        if normal.dot(bounds.nearest(normal)) > self.plane.w - IN_PLANE {
            return false;
        }
        // all ways from the eye to the box lie between these corners
        bounds.with(eye).touches(self.bounds)
    }
}

/// What may show through the skies of a view.
#[derive(Debug, Default)]
pub struct Beyond {
    /// Boxes around it.
    pub boxes: Vec<Aabb>,
    /// One bit for each surface of the world.
    pub surfaces: Vec<u32>,
}

impl Beyond {
    /// Of a view. `lens`: how far from the eye rays start at most. `geometry`: the map's, if the view shows it.
    pub fn of(
        view: &TracedScene,
        eye: Vec3,
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
        let skies = skies_in_sight(map, view, world, eye, lens);
        let frustum = view.view.frustum();
        let is_hidden = |bounds: &Aabb| {
            may_be_seen(bounds, eye, &frustum) && skies.iter().any(|sky| sky.hides(bounds, eye))
        };
        if skies.is_empty() {
            return beyond;
        }
        for &number in &view.look.potential {
            let Some(Some(bounds)) = map.surfaces.get(number as usize) else {
                continue;
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
            // rays go on for what is seen straight on
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
    eye: Vec3,
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
            let seen = Seen::of(sky, instance, is_seen, eye, lens);
            found.extend(seen.filter(|sky| may_be_seen(&sky.bounds, eye, &frustum)));
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
