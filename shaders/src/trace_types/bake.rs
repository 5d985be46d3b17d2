//! Light at points of a map, for its lightmaps (`relight bake`).

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A place whose light is wanted.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BakePoint {
    /// Position, slightly above the surface.
    pub position: Vec3,
    /// Unit normal; zero: light from each direction counts fully.
    pub normal: Vec3,
    /// Its number among points that follow one another and are averaged.
    pub rank: u32,
}

/// Light at a point.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BakeLight {
    /// Irradiance over pi.
    pub value: Vec3,
    /// Sum of unit vectors towards the light, weighted by luminance.
    pub towards: Vec3,
}

/// Unshadowed light of the list of a point, of the brightest channels.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BakeEstimate {
    /// Sum over the lights.
    pub whole: f32,
    /// Lights that give less than this are left out.
    pub least: f32,
}

/// A point light with the falloff and the cone of the map compiler.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BakePointLight {
    /// Centre.
    pub origin: Vec3,
    /// Radius of the sphere that casts the shadows.
    pub radius: f32,
    /// Radiant intensity over pi.
    pub intensity: Vec3,
    /// Distance at which linear falloff ends, negative if the angle of incidence does not count; 0: inverse-square falloff.
    pub reach: f32,
    /// Direction of a spot, of length 1.
    pub axis: Vec3,
    /// Tangent of half the angle of a spot; negative: no spot.
    pub tan_half_angle: f32,
    /// Unshadowed L below which it contributes nothing; 0: no cutoff.
    pub end: f32,
}

/// Where the light of a triangle is stored, and the part of it that the triangle reflects.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BakeTriangle {
    /// Part of the light that it reflects.
    pub reflectance: Vec3,
    /// `BAKE_*`.
    pub kind: u32,
    /// `BAKE_TEXELS`: the page's first texel, texels per side. `BAKE_VERTICES`: the corners.
    pub places: [u32; 3],
    /// `BAKE_TEXELS`: the corners' coordinates in texels.
    pub corners: [Vec2; 3],
}

/// Lights of a bake, and the light that surfaces reflect.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BakeView {
    /// [`TriangleLight`](super::TriangleLight)s.
    pub triangles: u64,
    /// [`BakePointLight`]s.
    pub points: u64,
    /// [`SunLight`](super::SunLight)s.
    pub suns: u64,
    /// The map's [`BspNode`](super::BspNode)s; a child below 0 is a leaf.
    pub nodes: u64,
    /// Cluster of each leaf; -1: none.
    pub leaf_clusters: u64,
    /// For each cluster, and after them for points in none: the first of its `entries`; then their end.
    pub rows: u64,
    /// Lights of the rows: triangle lights, from `triangle_count` on point lights.
    pub entries: u64,
    /// For each row 1 if suns and skies may reach it.
    pub skies: u64,
    /// For each triangle of `records` its radiance as a light of the sky.
    pub sky_light: u64,
    /// A [`BakeTriangle`] for each triangle of the map, in the order of the records.
    pub lit: u64,
    /// Light of texels and vertices, irradiance over pi.
    pub light: u64,
    /// The map's [`Triangle`](crate::types::Triangle)s.
    pub records: u64,
    /// Number of `nodes`; 0: every point is in no cluster.
    pub node_count: u32,
    /// Number of clusters.
    pub cluster_count: u32,
    /// Number of triangle lights.
    pub triangle_count: u32,
    /// Number of suns.
    pub sun_count: u32,
    /// Directions over the sphere in which the sky is searched; 0: it gives no light.
    pub sky_directions: u32,
    /// Length of the `rays`, units.
    pub reach: f32,
    /// Rays around a point: (c, s, a, b) is the direction (c u + s v) a + n b in the frame u, v, n of its normal n.
    pub rays: u64,
}

/// Push constants of a pass that computes light at points.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct BakeStep {
    /// The `TraceView`.
    pub view: u64,
    /// The [`BakeView`].
    pub bake: u64,
    /// [`BakePoint`]s.
    pub points: u64,
    /// A [`BakeLight`] for each point, to which the pass adds.
    pub results: u64,
    /// A [`BakeEstimate`] for each point.
    pub estimates: u64,
    /// Number of points.
    pub count: u32,
    /// Number of the first point among all of the call: the key of its random numbers.
    pub number: u32,
    /// The lights of each list, or the rays of each point, that this pass computes: the first, and the end.
    pub first: u32,
    /// See `first`.
    pub end: u32,
    /// Shadow rays to each light, or rays of each point.
    pub samples: u32,
    /// 1: the results are not written yet.
    pub begins: u32,
}
