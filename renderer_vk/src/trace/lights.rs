//! The lights of a map on the GPU, and those of the game in one view.

use std::f32::consts::PI;

use glam::Vec3;
use q3bsp::Bsp;
use relight::light::{LightLists, PointLight, SunLight, TriangleLight};
use shaders::trace_types as t;
use shaders::trace_types::constants::{LIGHT_SKY, LIGHT_TWO_SIDED};

use crate::api::DynamicLight;
use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// Lights of a map, its lists, and the tree that finds the list of a point.
pub struct MapLights {
    /// `TriangleLight`s.
    pub triangles: Buffer,
    /// Number of triangle lights.
    pub triangle_count: u32,
    /// `SphereLight`s: the map's point lights.
    pub spheres: Buffer,
    /// `SunLight`s.
    pub suns: Buffer,
    /// Number of suns.
    pub sun_count: u32,
    /// `BspNode`s.
    pub nodes: Buffer,
    /// Number of nodes.
    pub node_count: u32,
    /// Cluster of each leaf.
    pub leaf_clusters: Buffer,
    /// Rows of the lists.
    pub offsets: Buffer,
    /// Entries of the lists.
    pub indices: Buffer,
    /// For each entry the chance to draw one of its row up to it.
    pub chances: Buffer,
    /// Number of clusters.
    pub cluster_count: u32,
    /// Radiance of a white diffuse surface in the light that is everywhere.
    pub ambient: Vec3,
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
    /// Radiance of the even light from everywhere.
    pub ambient: Vec3,
    /// The map's tree; `None`: every point gets the list of all lights.
    pub bsp: Option<&'a Bsp>,
}

fn count(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
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
fn sphere(origin: Vec3, radius: f32, intensity: Vec3, clearance: f32) -> t::SphereLight {
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
    }
}

impl MapLights {
    /// Uploads a map's lights.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device, source: &MapLightSource<'_>) -> Result<Self, Error> {
        let storage = BufferUsage::STORAGE;
        let triangles: Vec<t::TriangleLight> = source
            .triangles
            .iter()
            .map(|light| t::TriangleLight {
                corners: light.vertices,
                radiance: light.radiance,
                flags: if light.two_sided { LIGHT_TWO_SIDED } else { 0 }
                    | if light.is_sky { LIGHT_SKY } else { 0 },
            })
            .collect();
        let spheres: Vec<t::SphereLight> = source
            .points
            .iter()
            .map(|light| {
                let mut s = sphere(light.origin, light.radius, light.intensity, light.radius);
                if let Some(spot) = light.spot {
                    s.axis = spot.direction;
                    (s.cos_inner, s.cos_outer) = spot_cosines(spot.tan_half_angle);
                }
                s
            })
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
        let (nodes, leaf_clusters) = source.bsp.map(tree).unwrap_or_default();
        let clusters = source.lists.clusters();
        // at least the row of all lights is always there
        let offsets: Vec<u32> = if source.lists.offsets.len() < 2 {
            vec![0, count(source.lists.lights.len())]
        } else {
            source.lists.offsets.clone()
        };
        let chances = chances(source, &offsets);
        Ok(Self {
            triangles: Buffer::with_data(device, "trace triangle lights", storage, &triangles)?,
            triangle_count: count(triangles.len()),
            spheres: Buffer::with_data(device, "trace point lights", storage, &spheres)?,
            suns: Buffer::with_data(device, "trace suns", storage, &suns)?,
            sun_count: count(suns.len()),
            nodes: Buffer::with_data(device, "trace nodes", storage, &nodes)?,
            node_count: count(nodes.len()),
            leaf_clusters: Buffer::with_data(device, "trace leafs", storage, &leaf_clusters)?,
            offsets: Buffer::with_data(device, "trace light rows", storage, &offsets)?,
            indices: Buffer::with_data(device, "trace light lists", storage, &source.lists.lights)?,
            chances: Buffer::with_data(device, "trace light chances", storage, &chances)?,
            cluster_count: count(clusters),
            ambient: source.ambient,
        })
    }
}

impl MapLights {
    /// No lights, for views without a map.
    ///
    /// # Errors
    /// Out of memory.
    pub fn none(device: &Device) -> Result<Self, Error> {
        let source = MapLightSource {
            triangles: &[],
            points: &[],
            suns: &[],
            lists: &LightLists::default(),
            ambient: Vec3::ZERO,
            bsp: None,
        };
        Self::new(device, &source)
    }
}

/// Part of a row's chance that is shared out evenly, so that no light is left out by a bad guess.
const EVEN_PART: f32 = 0.1;

/// Chances for drawing candidates from each row: by what the light can give to the middle of the cluster.
fn chances(source: &MapLightSource<'_>, offsets: &[u32]) -> Vec<f32> {
    let bounds = source
        .bsp
        .map(|bsp| cluster_bounds(bsp, source.lists.clusters()));
    let mut chances = vec![0.0; source.lists.lights.len()];
    let mut weights = Vec::new();
    for (row, range) in offsets.windows(2).enumerate() {
        let range = range[0] as usize..range[1] as usize;
        let (Some(entries), Some(chances)) = (
            source.lists.lights.get(range.clone()),
            chances.get_mut(range),
        ) else {
            continue;
        };
        let place = bounds.as_ref().and_then(|b| b.get(row).copied().flatten());
        weights.clear();
        weights.extend(entries.iter().map(|&entry| reach(source, entry, place)));
        let total: f32 = weights.iter().sum();
        #[allow(clippy::cast_precision_loss)] // a row's length
        let even = 1.0 / entries.len().max(1) as f32;
        let mut sum = 0.0;
        for (chance, weight) in chances.iter_mut().zip(&weights) {
            sum += if total > 0.0 && total.is_finite() {
                EVEN_PART * even + (1.0 - EVEN_PART) * weight / total
            } else {
                even
            };
            *chance = sum;
        }
        // rounding must not leave a gap before 1
        let scale = if sum > 0.0 { 1.0 / sum } else { 1.0 };
        for chance in chances.iter_mut() {
            *chance *= scale;
        }
        if let Some(last) = chances.last_mut() {
            *last = 1.0;
        }
    }
    chances
}

/// Middle and half diagonal of the boxes of each cluster's leafs; `None` for a cluster without leafs.
fn cluster_bounds(bsp: &Bsp, clusters: usize) -> Vec<Option<(Vec3, f32)>> {
    let mut boxes: Vec<Option<(Vec3, Vec3)>> = vec![None; clusters];
    for leaf in &bsp.leafs {
        let slot = usize::try_from(leaf.cluster)
            .ok()
            .and_then(|c| boxes.get_mut(c));
        if let Some(slot) = slot {
            #[allow(clippy::cast_precision_loss)] // map coordinates
            let [mins, maxs] = [leaf.mins, leaf.maxs].map(|v| Vec3::from(v.map(|x| x as f32)));
            let (low, high) = slot.unwrap_or((mins, maxs));
            *slot = Some((low.min(mins), high.max(maxs)));
        }
    }
    let ball = |(low, high): (Vec3, Vec3)| ((low + high) * 0.5, (high - low).length() * 0.5);
    boxes.into_iter().map(|b| b.map(ball)).collect()
}

/// About how much light an entry of the lists brings to a cluster; without one its power.
fn reach(source: &MapLightSource<'_>, entry: u32, cluster: Option<(Vec3, f32)>) -> f32 {
    let luminance = |c: Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722)).max(0.0);
    let entry = entry as usize;
    let (origin, intensity, size) = if let Some(light) = source.triangles.get(entry) {
        let [a, b, c] = light.vertices;
        let middle = (a + b + c) / 3.0;
        let area = light.area();
        let facing = match cluster {
            // how far the cluster can lie in front of the light; never none, for it is large
            Some((centre, radius)) if !light.two_sided => {
                let to = centre - middle;
                ((light.normal().dot(to) + radius) / (to.length() + radius).max(1.0))
                    .clamp(0.05, 1.0)
            }
            _ => 1.0,
        };
        (middle, luminance(light.radiance) * area * facing, area)
    } else if let Some(light) = source.points.get(entry - source.triangles.len()) {
        (
            light.origin,
            luminance(light.intensity),
            light.radius * light.radius,
        )
    } else {
        return 0.0;
    };
    // nearer than half the cluster's size all distances are alike
    let squared = cluster.map_or(1.0, |(centre, radius)| {
        centre
            .distance_squared(origin)
            .max(radius * radius * 0.25)
            .max(size)
            .max(1.0)
    });
    intensity / squared
}

/// Nodes with their planes beside them, and the cluster of each leaf.
fn tree(bsp: &Bsp) -> (Vec<t::BspNode>, Vec<i32>) {
    let nodes = bsp
        .nodes
        .iter()
        .map(|node| {
            let plane = usize::try_from(node.plane)
                .ok()
                .and_then(|i| bsp.planes.get(i));
            t::BspNode {
                plane: plane.map_or([0.0; 4], |p| [p.normal.x, p.normal.y, p.normal.z, p.dist]),
                children: node.children,
            }
        })
        .collect();
    (nodes, bsp.leafs.iter().map(|leaf| leaf.cluster).collect())
}

/// Radius of the ball of a dynamic light, as a part of its reach, and its bounds in units: about a muzzle flash.
const DYNAMIC_LIGHT_SIZE: (f32, f32, f32) = (0.02, 2.0, 8.0);

/// What lies this near to a dynamic light casts no shadow: the projectile or weapon that carries it.
const DYNAMIC_LIGHT_CLEARANCE: f32 = 20.0;

/// The game's dynamic lights as small spheres.
///
/// The engine gives a light a reach `r` and a colour; its classic look adds about the whole colour up to half the reach
/// and fades to nothing at `r`. Here light falls off with the square of the distance, strong enough that a white
/// surface that faces it at half the reach shows the light's colour: intensity = colour * pi * (r / 2)². Colours are as
/// displayed, so they are decoded.
pub fn dynamic_lights(lights: &[DynamicLight], scale: f32) -> Vec<t::SphereLight> {
    lights
        .iter()
        .filter(|light| light.radius > 0.0 && light.radius.is_finite() && light.origin.is_finite())
        .map(|light| {
            let half = light.radius * 0.5;
            let color = decode(light.color.max(Vec3::ZERO));
            let (part, min, max) = DYNAMIC_LIGHT_SIZE;
            let radius = (light.radius * part).clamp(min, max);
            sphere(
                light.origin,
                radius,
                color * (PI * half * half * scale.max(0.0)),
                DYNAMIC_LIGHT_CLEARANCE,
            )
        })
        .collect()
}

/// sRGB to linear (IEC 61966-2-1), as `shaders/trace/color.glsl` does it.
pub fn decode(c: Vec3) -> Vec3 {
    let channel = |c: f32| {
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    };
    Vec3::new(channel(c.x), channel(c.y), channel(c.z))
}
