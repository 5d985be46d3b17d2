//! The lights of a bake, and the light that surfaces reflect, as its shaders read them.

use std::f32::consts::PI;

use glam::Vec3;
use q3bsp::{Bsp, Child};
use relight::bake::{LitSurfaces, LitTriangle};
use relight::calibrate::Surroundings;
use relight::light::{Falloff, LightRef, PointLight};
use shaders::trace_types as t;
use shaders::trace_types::constants as c;

use super::geometry::StaticGeometry;
use super::lights::{Buffers, MapLightSource, count, ends, sun_light, triangle_light};
use crate::gpu::{Buffer, BufferUsage, Device, Error};

/// The lights of a map with the lists of its clusters.
///
/// In contrast to [`MapLights`](super::lights::MapLights), nothing is sampled: all lights of a list are evaluated, those of
/// brush models and animated ones included, with the falloff and the cones of the map compiler.
pub struct BakeLights {
    _buffers: Vec<Buffer>,
    view: t::BakeView,
    /// Length of the longest list.
    longest: u32,
    has_sky: bool,
}

/// Directions over the sphere in which the sky is searched: with one ray to each light, and with several.
const SKY_DIRECTIONS: [u32; 2] = [384, 1024];

fn point_light(light: &PointLight, end: f32) -> t::BakePointLight {
    let (axis, tan_half_angle) = light.spot.map_or((Vec3::Z, -1.0), |spot| {
        let axis = spot.direction.normalize_or(Vec3::NEG_Z);
        (axis, spot.tan_half_angle.max(0.0))
    });
    t::BakePointLight {
        origin: light.origin,
        radius: light.radius.max(0.0),
        intensity: light.intensity / PI,
        reach: match light.falloff {
            Falloff::InverseSquare => 0.0,
            Falloff::Linear { reach } => reach,
            Falloff::LinearAtAnyAngle { reach } => -reach,
        },
        axis,
        tan_half_angle,
        end,
    }
}

/// The rows of all clusters, then that of all lights.
struct Rows {
    starts: Vec<u32>,
    entries: Vec<u32>,
    skies: Vec<u32>,
}

impl Rows {
    fn of(source: &MapLightSource<'_>) -> Self {
        let lists = source.lists;
        let triangles = count(source.triangles.len());
        let known = |&entry: &u32| match lists.light(entry) {
            LightRef::Triangle(index) => {
                let light = source.triangles.get(index as usize);
                light.is_some_and(|light| !light.is_sky).then_some(index)
            }
            LightRef::Point(index) => {
                ((index as usize) < source.points.len()).then(|| triangles + index)
            }
        };
        let clusters = (0..).take(lists.clusters());
        let mut rows = Self {
            starts: vec![0],
            entries: Vec::new(),
            skies: Vec::new(),
        };
        for cluster in clusters.chain([-1]) {
            (rows.entries).extend(lists.row(cluster).iter().filter_map(known));
            rows.starts.push(count(rows.entries.len()));
            rows.skies.push(u32::from(lists.sees_sky(cluster)));
        }
        rows
    }

    fn longest(&self) -> u32 {
        let lengths = self.starts.windows(2).map(|w| w[1] - w[0]);
        lengths.max().unwrap_or(0)
    }
}

/// The map's tree, and the cluster of each leaf.
fn tree(bsp: &Bsp) -> (Vec<t::BspNode>, Vec<i32>) {
    let nodes = bsp.nodes.iter().map(|node| {
        let plane = bsp.plane(node.plane);
        t::BspNode {
            plane: plane.normal.extend(plane.dist).to_array(),
            children: node.children.map(Child::raw),
        }
    });
    let clusters = bsp.leafs.iter().map(|leaf| leaf.cluster).collect();
    (nodes.collect(), clusters)
}

impl BakeLights {
    /// Uploads the lights of a map. `sky_light`: for each triangle of the geometry its radiance as a light of the sky; empty:
    /// the sky gives no light.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        source: &MapLightSource<'_>,
        sky_light: &[Vec3],
    ) -> Result<Self, Error> {
        let triangles: Vec<t::TriangleLight> = (source.triangles.iter())
            .zip(ends(source))
            .map(|(light, end)| triangle_light(light, end, Vec3::ZERO))
            .collect();
        let points: Vec<t::BakePointLight> = (source.points.iter())
            .map(|light| point_light(light, source.light_cutoff))
            .collect();
        let suns: Vec<t::SunLight> = source.suns.iter().map(sun_light).collect();
        let rows = Rows::of(source);
        let (nodes, clusters) = source.bsp.map(tree).unwrap_or_default();
        let mut buffers = Buffers {
            device,
            made: Vec::new(),
        };
        let view = t::BakeView {
            triangles: buffers.add("bake triangle lights", &triangles)?,
            points: buffers.add("bake point lights", &points)?,
            suns: buffers.add("bake suns", &suns)?,
            nodes: buffers.add("bake nodes", &nodes)?,
            leaf_clusters: buffers.add("bake leafs", &clusters)?,
            rows: buffers.add("bake light rows", &rows.starts)?,
            entries: buffers.add("bake light lists", &rows.entries)?,
            skies: buffers.add("bake skies", &rows.skies)?,
            sky_light: buffers.add("bake sky light", sky_light)?,
            node_count: count(nodes.len()),
            cluster_count: count(rows.skies.len().saturating_sub(1)),
            triangle_count: count(triangles.len()),
            sun_count: count(suns.len()),
            ..t::BakeView::default()
        };
        Ok(Self {
            _buffers: buffers.made,
            view,
            longest: rows.longest(),
            has_sky: !sky_light.is_empty(),
        })
    }

    /// What shaders read for direct light by `samples` rays to each light, and the most members of a list: suns, directions
    /// to the sky, lights.
    pub fn view(&self, geometry: &StaticGeometry, samples: u32) -> (t::BakeView, u32) {
        let [few, many] = SKY_DIRECTIONS;
        let sky_directions = match (self.has_sky, samples) {
            (false, _) => 0,
            (true, 0) => few,
            (true, _) => many,
        };
        let view = t::BakeView {
            records: geometry.triangles(),
            sky_directions,
            ..self.view
        };
        (view, self.longest + view.sun_count + sky_directions)
    }
}

/// The light that surfaces reflect.
pub struct BakeSurfaces {
    _buffers: Vec<Buffer>,
    addresses: [u64; 2],
}

impl BakeSurfaces {
    /// Uploads it.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        geometry: &StaticGeometry,
        lit: &LitSurfaces<'_>,
    ) -> Result<Self, Error> {
        let triangles: Vec<t::BakeTriangle> = (geometry.sources.iter())
            .map(|&source| triangle(lit, source as usize))
            .collect();
        let mut buffers = Buffers {
            device,
            made: Vec::new(),
        };
        let addresses = [
            buffers.add("bake lit triangles", &triangles)?,
            buffers.add("bake light", lit.light)?,
        ];
        Ok(Self {
            _buffers: buffers.made,
            addresses,
        })
    }

    /// What shaders read.
    pub fn view(&self, geometry: &StaticGeometry) -> t::BakeView {
        let [lit, light] = self.addresses;
        t::BakeView {
            lit,
            light,
            records: geometry.triangles(),
            ..t::BakeView::default()
        }
    }
}

/// The rays that measure how near surfaces are.
pub struct BakeSurroundings {
    _buffer: Buffer,
    address: u64,
    reach: f32,
}

impl BakeSurroundings {
    /// Uploads them.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(device: &Device, around: &Surroundings) -> Result<Self, Error> {
        let rays = Buffer::with_data(device, "bake rays", BufferUsage::STORAGE, &around.rays)?;
        Ok(Self {
            address: rays.address(),
            _buffer: rays,
            reach: around.reach,
        })
    }

    /// What shaders read.
    pub fn view(&self, geometry: &StaticGeometry) -> t::BakeView {
        t::BakeView {
            rays: self.address,
            reach: self.reach,
            records: geometry.triangles(),
            ..t::BakeView::default()
        }
    }
}

/// A triangle of the world; one whose light is missing reflects nothing.
fn triangle(lit: &LitSurfaces<'_>, source: usize) -> t::BakeTriangle {
    let place = lit.triangles.get(source).copied().unwrap_or_default();
    let reflectance = (lit.reflectances.get(source).copied()).unwrap_or_default();
    let known = |index: u32| (index as usize) < lit.light.len();
    match place {
        LitTriangle::Texels {
            first,
            side,
            corners,
        } if side
            .checked_mul(side)
            .and_then(|texels| first.checked_add(texels.checked_sub(1)?))
            .is_some_and(known)
            && corners.iter().all(|corner| corner.is_finite()) =>
        {
            t::BakeTriangle {
                reflectance,
                kind: c::BAKE_TEXELS,
                places: [first, side, 0],
                corners,
            }
        }
        LitTriangle::Vertices(places) if places.iter().all(|&place| known(place)) => {
            t::BakeTriangle {
                reflectance,
                kind: c::BAKE_VERTICES,
                places,
                ..t::BakeTriangle::default()
            }
        }
        _ => t::BakeTriangle::default(),
    }
}
