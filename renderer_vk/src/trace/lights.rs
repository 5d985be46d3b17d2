//! The lights of a map on the GPU. Those of one view are in [`frame_lights`](super::frame_lights).

use std::collections::HashMap;
use std::f32::consts::PI;

use glam::Vec3;
use q3bsp::Bsp;
use relight::light::{
    ClusterSet, Flicker, LightLists, Occlusion, PointLight, Pulse, Sight, SunLight, TriangleLight,
};
use shaders::trace_types as t;
use shaders::trace_types::constants as c;
use support::Aabb;

use super::cell_grid::CellGrid;
use super::light_cells::Cells;
use super::light_rows;
use super::light_tables::luminance;
use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// Lights of a map, its lists, and the tree that finds the list of a point.
pub struct MapLights {
    /// What `fixed` has the addresses of.
    _buffers: Vec<Buffer>,
    /// What does not change from view to view: counts and addresses.
    fixed: t::LightView,
    /// Which cluster sees which.
    pub(super) sight: Sight,
    /// For each fog volume the clusters that may see it.
    fog_reach: Vec<ClusterSet>,
    /// Lights of the world that change in time.
    pub(super) changing: Vec<ChangingLight>,
    /// Points of the world that change in time, as they are in the mean.
    pub(super) pulsing: Vec<(t::SphereLight, Pulse)>,
    /// Lights of brush models, in the models' space, by model.
    pub(super) moving: Vec<(u32, Vec<ChangingLight>)>,
    /// How lights change, each way once.
    pub(super) flickers: Vec<Flicker>,
    /// Radiance of a white diffuse surface in the light that is everywhere.
    pub ambient: Vec3,
    /// Radiance that the map's exposure shows as white: what is given as displayed is that much brighter.
    pub white: f32,
}

/// A light that each view has in its own form.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChangingLight {
    /// As it is in the mean, in the space of its model.
    pub light: t::TriangleLight,
    /// Index of how it changes in time.
    pub flicker: Option<usize>,
}

/// A map's lights as the loader found them.
#[derive(Clone, Copy, Debug)]
pub struct MapLightSource<'a> {
    /// Triangle lights.
    pub triangles: &'a [TriangleLight],
    /// Point lights.
    pub points: &'a [PointLight],
    /// Suns.
    pub suns: &'a [SunLight],
    /// Lists; entries below the number of triangle lights are triangle lights, the others point lights.
    pub lists: &'a LightLists,
    /// For each triangle light how it changes in time; lights without an entry do not.
    pub flickers: &'a [Option<&'a Flicker>],
    /// Where the map's entities put each brush model at start; triangle lights are there.
    pub model_origins: &'a [Vec3],
    /// Radiance of the even light from everywhere.
    pub ambient: Vec3,
    /// Light, irradiance / π, that a surface must get from one light to get any; 0: lights have no end.
    pub light_cutoff: f32,
    /// The map's tree; `None`: every point gets the list of all lights.
    pub bsp: Option<&'a Bsp>,
    /// What is in the way of light; `None`: only what the lists know of that is known.
    pub occlusion: Option<&'a Occlusion>,
}

impl<'a> MapLightSource<'a> {
    /// No lights and nothing that is known of them but lists.
    pub fn empty(lists: &'a LightLists) -> Self {
        Self {
            triangles: &[],
            points: &[],
            suns: &[],
            lists,
            flickers: &[],
            model_origins: &[],
            ambient: Vec3::ZERO,
            light_cutoff: 0.0,
            bsp: None,
            occlusion: None,
        }
    }

    /// The number of a point light: those that change in time are in each view's own.
    pub(super) fn point_number(&self, index: usize) -> u32 {
        let pulses = |light: &&PointLight| light.pulse.is_some();
        if self.points.get(index).as_ref().is_some_and(pulses) {
            let before = self.points.iter().take(index).filter(pulses).count();
            return number(c::LIGHT_CHANGING_SPHERE, before);
        }
        number(c::LIGHT_SPHERE, index)
    }
}

pub(super) fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// The number of a light: its kind (`LIGHT_*`) and its index among those.
pub(super) fn number(kind: u32, index: usize) -> u32 {
    kind << c::LIGHT_KIND_SHIFT | count(index)
}

/// Cosines of the cone of a spot: full light inside of the first, none outside of the second. The map compiler fades
/// over the last 32 units of the cone's radius at each distance; here the fade covers the outer eighth of the cone's
/// tangent, which is the same at a distance of 256 units over the tangent.
fn spot_cosines(tan_half_angle: f32) -> (f32, f32) {
    let cosine = |tangent: f32| 1.0 / (1.0 + tangent * tangent).sqrt();
    let tangent = tan_half_angle.clamp(0.001, 1000.0);
    (cosine(tangent * 0.875), cosine(tangent))
}

/// The sphere that gives a radiant intensity (in a unit where irradiance is `intensity / distance²`).
pub(super) fn sphere(origin: Vec3, radius: f32, intensity: Vec3, clearance: f32) -> t::SphereLight {
    let radius = radius.max(0.1);
    t::SphereLight {
        origin,
        radius,
        // a sphere's intensity is its radiance times the area of its disc
        radiance: intensity / (PI * radius * radius),
        clearance,
        axis: Vec3::Z,
        cos_inner: -1.0,
        cos_outer: -2.0,
        core: 0.0,
        reach: 0.0,
        end: 0.0,
    }
}

/// Bounds of a sphere light.
pub(super) fn sphere_bounds(light: &t::SphereLight) -> t::LightBounds {
    t::LightBounds {
        centre: light.origin,
        radius: light.radius,
        axis: if light.cos_outer > -2.0 {
            light.axis * (light.cos_outer + 2.0)
        } else {
            Vec3::ZERO
        },
        // as L: irradiance over pi. What gives nothing needs no candidates, but 0 would say that it is a triangle.
        omni_intensity: (luminance(light.radiance) * light.radius * light.radius)
            .max(f32::MIN_POSITIVE),
    }
}

/// Bounds of a triangle light.
pub(super) fn triangle_bounds(light: &t::TriangleLight) -> t::LightBounds {
    let [a, b, c] = light.corners;
    let centre = (a + b + c) / 3.0;
    let radius = light.corners.map(|p| p.distance(centre));
    t::LightBounds {
        centre,
        radius: radius.into_iter().fold(0.0, f32::max),
        axis: (b - a).cross(c - a) * (0.5 * luminance(light.radiance)),
        omni_intensity: if light.flags & c::LIGHT_TWO_SIDED != 0 {
            -1.0
        } else {
            0.0
        },
    }
}

/// For each light the L below which it gives nothing. The compiler made a light of each triangle; of a sprite it made one,
/// of which each quad ends at its part. Skies have no end.
fn ends(source: &MapLightSource<'_>) -> Vec<f32> {
    if source.light_cutoff <= 0.0 {
        return vec![0.0; source.triangles.len()];
    }
    let mut areas: HashMap<u32, f32> = HashMap::new();
    for light in source.triangles {
        *areas.entry(light.surface).or_default() += light.area();
    }
    let part = |light: &TriangleLight| {
        let whole = areas.get(&light.surface).copied().unwrap_or(0.0);
        if light.is_sky || whole <= 0.0 {
            0.0
        } else if light.has_own_cutoff() {
            source.light_cutoff
        } else {
            source.light_cutoff * light.area() / whole
        }
    };
    source.triangles.iter().map(part).collect()
}

pub(super) fn triangle_light(light: &TriangleLight, end: f32, origin: Vec3) -> t::TriangleLight {
    t::TriangleLight {
        corners: light.vertices.map(|p| p - origin),
        radiance: light.radiance,
        flags: if light.two_sided {
            c::LIGHT_TWO_SIDED
        } else {
            0
        },
        end,
    }
}

pub(super) fn point_light(light: &PointLight, end: f32) -> t::SphereLight {
    let mut s = sphere(light.origin, light.radius, light.intensity, light.radius);
    s.reach = light.falloff.reach().unwrap_or(0.0);
    s.end = end;
    if let Some(spot) = light.spot {
        s.axis = spot.direction.normalize_or(Vec3::NEG_Z);
        (s.cos_inner, s.cos_outer) = spot_cosines(spot.tan_half_angle);
    }
    s
}

/// Triangle lights by where and how they shine.
#[derive(Default)]
struct SortedTriangles {
    /// Of the world, as they are.
    triangles: Vec<t::TriangleLight>,
    /// Of the world, changing in time.
    changing: Vec<ChangingLight>,
    /// Of brush models.
    moving: Vec<(u32, Vec<ChangingLight>)>,
    flickers: Vec<Flicker>,
    /// For each light of the source its number in the lists; lights of brush models are in no list.
    numbers: Vec<Option<u32>>,
}

impl SortedTriangles {
    fn of(source: &MapLightSource<'_>) -> Self {
        let mut sorted = Self::default();
        for (index, (light, end)) in source.triangles.iter().zip(ends(source)).enumerate() {
            let known = source.flickers.get(index).copied().flatten();
            let flicker = known.map(|flicker| sorted.flicker(flicker));
            let number = sorted.add(source, light, end, flicker);
            sorted.numbers.push(number);
        }
        sorted
    }

    /// Index of a way to change in time.
    fn flicker(&mut self, flicker: &Flicker) -> usize {
        let at = self.flickers.iter().position(|f| f == flicker);
        at.unwrap_or_else(|| {
            self.flickers.push(flicker.clone());
            self.flickers.len() - 1
        })
    }

    /// Adds a light; returns its number in the lists.
    fn add(
        &mut self,
        source: &MapLightSource<'_>,
        light: &TriangleLight,
        end: f32,
        flicker: Option<usize>,
    ) -> Option<u32> {
        let origin = match light.model {
            0 => Vec3::ZERO,
            model => (source.model_origins.get(model as usize).copied()).unwrap_or_default(),
        };
        let placed = ChangingLight {
            light: triangle_light(light, end, origin),
            flicker,
        };
        if light.model != 0 {
            match self.moving.iter_mut().find(|(m, _)| *m == light.model) {
                Some((_, lights)) => lights.push(placed),
                None => self.moving.push((light.model, vec![placed])),
            }
            None
        } else if flicker.is_some() {
            self.changing.push(placed);
            Some(number(c::LIGHT_CHANGING_TRIANGLE, self.changing.len() - 1))
        } else {
            self.triangles.push(placed.light);
            Some(number(c::LIGHT_TRIANGLE, self.triangles.len() - 1))
        }
    }
}

/// Buffers that shaders read by address.
struct Buffers<'a> {
    device: &'a Device,
    made: Vec<Buffer>,
}

impl Buffers<'_> {
    /// Uploads data; returns their address.
    fn add<T: bytemuck::Pod>(&mut self, name: &str, data: &[T]) -> Result<u64, Error> {
        let buffer = Buffer::with_data(self.device, name, BufferUsage::STORAGE, data)?;
        let address = buffer.address();
        self.made.push(buffer);
        Ok(address)
    }
}

impl MapLights {
    /// Uploads a map's lights.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device, source: &MapLightSource<'_>) -> Result<Self, Error> {
        let sorted = SortedTriangles::of(source);
        let spheres: Vec<t::SphereLight> = (source.points.iter())
            .map(|light| point_light(light, source.light_cutoff))
            .collect();
        let suns: Vec<t::SunLight> = source
            .suns
            .iter()
            .map(|sun| t::SunLight {
                direction: sun.direction.normalize_or(Vec3::Z),
                cos_angle: sun.angular_radius.clamp(0.0, 1.5).cos(),
                irradiance: sun.irradiance / PI,
            })
            .collect();
        let lists = source.lists;
        let length = |cluster| i32::try_from(cluster).map_or(0, |c| lists.row(c).len());
        let cells = source
            .bsp
            .map(|bsp| Cells::new(bsp, lists.clusters(), length));
        // A scene without a map has no cells.
        let cells = cells.unwrap_or_default();
        let (rows, slots) = light_rows::rows(source, &sorted.numbers, &cells);
        let bounds = source.bsp.and_then(|bsp| bsp.models.first());
        let (low, high) = bounds
            .map(|world| (world.mins, world.maxs))
            .unwrap_or_default();
        let grid = CellGrid::new(&cells.nodes, low, high);
        let triangle_bounds: Vec<_> = sorted.triangles.iter().map(triangle_bounds).collect();
        let sphere_bounds: Vec<_> = spheres.iter().map(sphere_bounds).collect();
        let mut buffers = Buffers {
            device,
            made: Vec::new(),
        };
        let fixed = t::LightView {
            triangles: [buffers.add("trace triangle lights", &sorted.triangles)?, 0],
            spheres: [buffers.add("trace point lights", &spheres)?, 0],
            bounds: [
                buffers.add("trace triangle light bounds", &triangle_bounds)?,
                0,
                buffers.add("trace point light bounds", &sphere_bounds)?,
                0,
            ],
            suns: buffers.add("trace suns", &suns)?,
            nodes: buffers.add("trace nodes", &cells.nodes)?,
            leaf_cells: buffers.add("trace leafs", &cells.leaf_cells)?,
            grid: buffers.add("trace cell grid", &grid.starts)?,
            rows: buffers.add("trace light rows", &rows)?,
            slots: buffers.add("trace light lists", &slots)?,
            node_count: count(cells.nodes.len()),
            grid_origin: grid.origin,
            grid_scale: grid.scale,
            grid_size: grid.size.to_array(),
            row_count: count(rows.len()),
            sun_count: count(suns.len()),
            ..t::LightView::default()
        };
        Ok(Self {
            _buffers: buffers.made,
            fixed,
            sight: source.bsp.map(Sight::new).unwrap_or_default(),
            fog_reach: Vec::new(),
            changing: sorted.changing,
            pulsing: (source.points.iter().zip(&spheres))
                .filter_map(|(light, sphere)| Some((*sphere, light.pulse?)))
                .collect(),
            moving: sorted.moving,
            flickers: sorted.flickers,
            ambient: source.ambient,
            white: 1.0,
        })
    }

    /// No lights, for views without a map.
    ///
    /// # Errors
    /// Out of memory.
    pub fn none(device: &Device) -> Result<Self, Error> {
        Self::new(device, &MapLightSource::empty(&LightLists::default()))
    }

    /// Finds from where each of the map's fog volumes may be seen.
    pub fn find_fogs(&mut self, boxes: &[Aabb]) {
        let reach = |fog: &Aabb| self.sight.lit_from(&self.sight.touching(*fog));
        self.fog_reach = boxes.iter().map(reach).collect();
    }

    /// Which fog volumes may be seen from a point; all where nobody knows.
    pub(super) fn fogs_seen_from(&self, eye: Vec3) -> impl Fn(usize) -> bool {
        let cluster = self.sight.cluster_at(eye);
        move |fog| {
            let reach = self.fog_reach.get(fog).zip(cluster);
            reach.is_none_or(|(reach, cluster)| reach.contains(cluster))
        }
    }

    /// Counts and addresses that are the same in every view.
    pub(super) fn fixed(&self) -> t::LightView {
        self.fixed
    }
}
