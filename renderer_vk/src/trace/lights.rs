//! The lights of a map on the GPU. [`frame_lights`](super::frame_lights) has those of one view.

use std::collections::HashMap;
use std::f32::consts::PI;
use std::sync::OnceLock;
use std::time::Instant;

use glam::Vec3;
use q3bsp::Bsp;
use relight::light::{
    ClusterSet, Flicker, LightLists, Occlusion, PointLight, Pulse, Sight, SunLight, TriangleLight,
};
use shaders::trace_types as t;
use shaders::trace_types::constants as c;
use support::Aabb;

use super::cell_grid::CellGrid;
use super::cell_light;
use super::light_cells::Cells;
use super::light_rows;
use super::light_tables::luminance;
use super::light_tree::Emission;
use super::light_trees::LightTrees;
use crate::gpu::{Buffer, BufferUsage, Device, Error};
use crate::statistics::LightCost;

/// Lights of a map, their lists, and the tree that finds the list of a point.
pub struct MapLights {
    /// Buffers whose addresses `fixed` holds.
    _buffers: Vec<Buffer>,
    /// Counts and addresses that are equal in all views.
    fixed: t::LightView,
    /// Mutual visibility of clusters.
    pub(super) sight: Sight,
    /// For each fog volume, the clusters that it may be visible from.
    fog_reach: Vec<ClusterSet>,
    /// Animated triangle lights of the world.
    pub(super) changing: Vec<ChangingLight>,
    /// Animated point lights of the world, at their mean strength.
    pub(super) pulsing: Vec<(t::SphereLight, Pulse)>,
    /// Lights of brush models, in the models' space, by model.
    pub(super) moving: Vec<(u32, Vec<ChangingLight>)>,
    /// Distinct animations of lights.
    pub(super) flickers: Vec<Flicker>,
    /// Trees over the lights; made when a frame first uses them.
    trees: OnceLock<LightTrees>,
    /// Constant triangle lights and point lights, for the tree.
    constant: (Vec<t::TriangleLight>, Vec<t::SphereLight>),
    /// Wall time of the lists, milliseconds, and their bytes.
    lists_cost: (f64, u64),
    /// Radiance of a white diffuse surface in the map's ambient light.
    pub ambient: Vec3,
    /// Radiance that the map's exposure shows as white; display-encoded colours are scaled by it.
    pub white: f32,
}

/// A light that each view uploads in its current state.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChangingLight {
    /// At mean strength, in the space of its model.
    pub light: t::TriangleLight,
    /// Index of its animation.
    pub flicker: Option<usize>,
    /// Origin of its model by the map's entities.
    pub origin: Vec3,
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
    /// Animation of each triangle light; missing entries are constant lights.
    pub flickers: &'a [Option<&'a Flicker>],
    /// Whether rays of bounces can hit each triangle light; they cannot hit missing entries.
    pub hittable: &'a [bool],
    /// Initial position of each brush model by the map's entities; triangle lights are at these positions.
    pub model_origins: &'a [Vec3],
    /// Radiance of the ambient light.
    pub ambient: Vec3,
    /// Irradiance / π below which the map compiler drops a light's contribution; 0: no cutoff.
    pub light_cutoff: f32,
    /// Whether the cutoff applies to point lights alone.
    pub cutoff_of_points: bool,
    /// The map's tree; `None`: every point uses the list of all lights.
    pub bsp: Option<&'a Bsp>,
    /// Occluders for visibility rays; `None`: visibility comes from the lists alone.
    pub occlusion: Option<&'a Occlusion>,
}

impl<'a> MapLightSource<'a> {
    /// A source without lights.
    pub fn empty(lists: &'a LightLists) -> Self {
        Self {
            triangles: &[],
            points: &[],
            suns: &[],
            lists,
            flickers: &[],
            hittable: &[],
            model_origins: &[],
            ambient: Vec3::ZERO,
            light_cutoff: 0.0,
            cutoff_of_points: false,
            bsp: None,
            occlusion: None,
        }
    }

    /// Whether rays can hit a triangle light, with the radiance that the lists have: it neither moves nor changes.
    fn is_hittable(&self, index: usize) -> bool {
        let changes = self.flickers.get(index).is_some_and(Option::is_some);
        let moves = self
            .triangles
            .get(index)
            .is_none_or(|light| light.model != 0);
        !changes && !moves && self.hittable.get(index).copied().unwrap_or(false)
    }

    /// Number of a point light; animated ones belong to each view.
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

/// Light number from kind (`LIGHT_*`) and index within the kind.
pub(super) fn number(kind: u32, index: usize) -> u32 {
    kind << c::LIGHT_KIND_SHIFT | count(index)
}

/// Cosines of a spot's cone: full light inside the first, none outside the second. The map compiler fades over the last
/// 32 units of the cone's radius at each distance; here the fade covers the outer eighth of the cone's tangent, which
/// is equal at a distance of 256 units over the tangent.
fn spot_cosines(tan_half_angle: f32) -> (f32, f32) {
    let cosine = |tangent: f32| 1.0 / (1.0 + tangent * tangent).sqrt();
    let tangent = tan_half_angle.clamp(0.001, 1000.0);
    (cosine(tangent * 0.875), cosine(tangent))
}

/// The sphere light with this radiant intensity (irradiance is `intensity / distance²`).
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
        half_length: 0.0,
        core: 0.0,
        reach: 0.0,
        end: 0.0,
    }
}

/// Bounds of a sphere light.
pub(super) fn sphere_bounds(light: &t::SphereLight) -> t::LightBounds {
    t::LightBounds {
        centre: light.origin,
        radius: light.radius + light.half_length,
        axis: if light.cos_outer > -2.0 {
            light.axis * (light.cos_outer + 2.0)
        } else {
            Vec3::ZERO
        },
        // irradiance over pi. Lights of zero radiance need no candidates, but 0 would mark a triangle light.
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

/// For each light, the irradiance over pi below which its contribution is 0. The map compiler made one light per
/// triangle; of a sprite it made one light in all, so that each quad's cutoff is its share. Skies have no cutoff.
pub(super) fn ends(source: &MapLightSource<'_>) -> Vec<f32> {
    if source.light_cutoff <= 0.0 || source.cutoff_of_points {
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

/// Each surface as a light, by the surface's index; zero for surfaces without light.
fn emitted(source: &MapLightSource<'_>) -> Vec<t::EmittedLight> {
    let mut emitted = Vec::new();
    for (index, light) in source.triangles.iter().enumerate() {
        let surface = light.surface as usize;
        if surface >= emitted.len() {
            emitted.resize(surface + 1, t::EmittedLight::default());
        }
        if let Some(of_surface) = emitted.get_mut(surface) {
            *of_surface = t::EmittedLight {
                radiance: light.radiance,
                hittable: u32::from(source.is_hittable(index)),
            };
        }
    }
    emitted
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

pub(super) fn sun_light(sun: &SunLight) -> t::SunLight {
    t::SunLight {
        direction: sun.direction.normalize_or(Vec3::Z),
        cos_angle: sun.angular_radius.clamp(0.0, 1.5).cos(),
        irradiance: sun.irradiance / PI,
    }
}

/// The point lights with those that pulse put out, so that indices stay.
fn constant_points(
    source: &MapLightSource<'_>,
    mut spheres: Vec<t::SphereLight>,
) -> Vec<t::SphereLight> {
    let points = source.points.iter().zip(&mut spheres);
    for (_, sphere) in points.filter(|(point, _)| point.pulse.is_some()) {
        sphere.radiance = Vec3::ZERO;
    }
    spheres
}

/// Triangle lights by motion and animation.
#[derive(Default)]
struct SortedTriangles {
    /// Constant lights of the world.
    triangles: Vec<t::TriangleLight>,
    /// Animated lights of the world.
    changing: Vec<ChangingLight>,
    /// Lights of brush models, by model.
    moving: Vec<(u32, Vec<ChangingLight>)>,
    flickers: Vec<Flicker>,
    /// For each light of the source, its number in the lists; lights of brush models are in no list.
    numbers: Vec<Option<u32>>,
}

impl SortedTriangles {
    fn of(source: &MapLightSource<'_>) -> Self {
        let mut sorted = Self::default();
        for (index, (light, end)) in source.triangles.iter().zip(ends(source)).enumerate() {
            let known = source.flickers.get(index).copied().flatten();
            let flicker = known.map(|flicker| sorted.flicker(flicker));
            let number = sorted.add(source, light, end, flicker, source.is_hittable(index));
            sorted.numbers.push(number);
        }
        sorted
    }

    /// Index of an animation; adds it if it is new.
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
        hittable: bool,
    ) -> Option<u32> {
        let origin = match light.model {
            0 => Vec3::ZERO,
            // A scene of a test has no origins.
            model => (source.model_origins.get(model as usize).copied()).unwrap_or_default(),
        };
        let mut placed = ChangingLight {
            light: triangle_light(light, end, origin),
            flicker,
            origin,
        };
        if hittable {
            placed.light.flags |= c::LIGHT_HITTABLE;
        }
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
pub(super) struct Buffers<'a> {
    pub device: &'a Device,
    pub made: Vec<Buffer>,
}

impl Buffers<'_> {
    /// Uploads data; returns its address.
    pub fn add<T: bytemuck::Pod>(&mut self, name: &str, data: &[T]) -> Result<u64, Error> {
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
        let suns: Vec<t::SunLight> = source.suns.iter().map(sun_light).collect();
        let emitted = emitted(source);
        let lists = source.lists;
        let length = |cluster| i32::try_from(cluster).map_or(0, |c| lists.row(c).len());
        let cells = source
            .bsp
            .map(|bsp| Cells::new(bsp, lists.clusters(), length));
        // A scene without a map has no cells.
        let cells = cells.unwrap_or_default();
        let before = Instant::now();
        let (rows, slots) = light_rows::rows(source, &sorted.numbers, &cells);
        let bytes = size_of_val(rows.as_slice()) + size_of_val(slots.as_slice());
        let lists_cost = (before.elapsed().as_secs_f64() * 1000.0, bytes as u64);
        // Without a map as above.
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
            emitted: buffers.add("trace emitted", &emitted)?,
            emitted_count: count(emitted.len()),
            nodes: buffers.add("trace nodes", &cells.nodes)?,
            leaf_cells: buffers.add("trace leafs", &cells.leaf_cells)?,
            grid: buffers.add("trace cell grid", &grid.starts)?,
            cell_light: buffers.add(
                "trace cell light",
                &cell_light::of(source.bsp, &cells.cells),
            )?,
            rows: buffers.add("trace light rows", &rows)?,
            slots: buffers.add("trace light lists", &slots)?,
            node_count: count(cells.nodes.len()),
            grid_origin: grid.origin,
            grid_scale: grid.scale,
            grid_size: grid.size.to_array(),
            cell_count: count(cells.cells.len()),
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
            trees: OnceLock::new(),
            constant: (sorted.triangles, constant_points(source, spheres)),
            lists_cost,
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

    /// Computes from which clusters each fog volume may be visible.
    pub fn find_fogs(&mut self, boxes: &[Aabb]) {
        let reach = |fog: &Aabb| self.sight.lit_from(&self.sight.touching(*fog));
        self.fog_reach = boxes.iter().map(reach).collect();
    }

    /// Fog volumes that may be visible from a point; all if their visibility is unknown.
    pub(super) fn fogs_seen_from(&self, camera: Vec3) -> impl Fn(usize) -> bool {
        let cluster = self.sight.cluster_at(camera);
        move |fog| {
            let reach = self.fog_reach.get(fog).zip(cluster);
            reach.is_none_or(|(reach, cluster)| reach.contains(cluster))
        }
    }

    /// The trees over the map's lights; built at the first call.
    ///
    /// # Errors
    /// Out of memory.
    pub(super) fn trees(&self, device: &Device) -> Result<&LightTrees, Error> {
        if let Some(made) = self.trees.get() {
            return Ok(made);
        }
        let (triangles, spheres) = &self.constant;
        let triangles = triangles.iter().map(Emission::of_triangle).enumerate();
        let spheres = spheres.iter().map(Emission::of_sphere).enumerate();
        let constant: Vec<(u32, Emission)> = triangles
            .map(|(i, emission)| (number(c::LIGHT_TRIANGLE, i), emission))
            .chain(spheres.map(|(i, emission)| (number(c::LIGHT_SPHERE, i), emission)))
            .filter(|(_, emission)| *emission != Emission::NOTHING)
            .collect();
        let made = LightTrees::new(device, &constant, &self.changing_emissions())?;
        Ok(self.trees.get_or_init(|| made))
    }

    /// The lights that move or change, at mean strength and at their initial positions: animated triangles, animated
    /// points, then those of the brush models in the order of `moving`. Frames give them their numbers.
    fn changing_emissions(&self) -> Vec<(u32, Emission)> {
        let of_models = self.moving.iter().flat_map(|(_, lights)| lights);
        let at_origin = |light: &ChangingLight| t::TriangleLight {
            corners: light.light.corners.map(|p| p + light.origin),
            ..light.light
        };
        let changing = (self.changing.iter()).map(|light| Emission::of_triangle(&light.light));
        let pulsing = self.pulsing.iter().map(|p| Emission::of_sphere(&p.0));
        let models = of_models.map(|light| Emission::of_triangle(&at_origin(light)));
        let all = changing.chain(pulsing).chain(models);
        all.map(|emission| (0, emission)).collect()
    }

    /// Number of the animated triangle lights and points of the world: the first of those that frames upload.
    pub(super) fn lasting(&self) -> [u32; 2] {
        [count(self.changing.len()), count(self.pulsing.len())]
    }

    /// Whether lights of the lists, or with `tree` of the tree, move or change.
    pub(super) fn have_changing(&self, tree: bool) -> bool {
        tree || self.lasting() != [0; 2]
    }

    /// Costs of the lists, and of the trees if a frame has used them.
    pub fn cost(&self) -> LightCost {
        let trees = self.trees.get();
        LightCost {
            lights: self.constant.0.len()
                + self.constant.1.len()
                + self.changing.len()
                + self.moving.iter().map(|(_, l)| l.len()).sum::<usize>(),
            lists_ms: self.lists_cost.0,
            lists_bytes: self.lists_cost.1,
            tree_ms: trees.map(|trees| trees.build_ms),
            tree_bytes: trees.map(|trees| trees.bytes),
        }
    }

    /// Counts and addresses that are equal in all views.
    pub(super) fn fixed(&self) -> t::LightView {
        self.fixed
    }
}
