//! Data for rays beside surfaces: skies, portals, filters, bounding boxes, flares, fog.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A sky material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SkyRecord {
    /// Bindless textures of the box in the order rt bk lf ft up dn, or `NO_TEXTURE`.
    pub faces: [u32; 6],
    /// Height of the clouds, units.
    pub cloud_height: f32,
}

/// A portal or mirror; see `scene::Portal` of the renderer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PortalRecord {
    /// Plane of the surface: `xyz . p = w`.
    pub plane: [f32; 4],
    /// 1: a mirror.
    pub mirror: u32,
    /// A point of the plane.
    pub surface_origin: Vec3,
    /// Frame of the plane.
    pub surface_axis: [Vec3; 3],
    /// Camera position of the portal, to which `surface_origin` is mapped.
    pub camera_origin: Vec3,
    /// Axes to which `surface_axis` is mapped.
    pub camera_axis: [Vec3; 3],
}

/// The flat mirrors of the map in one plane.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MirrorPlane {
    /// `xyz . p = w`; `xyz`: unit vector on the front side.
    pub plane: [f32; 4],
    /// Centre of the sphere around the mirrors.
    pub centre: Vec3,
    /// Its radius.
    pub radius: f32,
    /// Area of the mirrors, square units.
    pub area: f32,
    /// Sum of the probabilities of this plane and those before it.
    pub until: f32,
    /// `MIRROR_*` bits.
    pub flags: u32,
}

/// A cut-out surface of the map, to rays that do not test its alpha.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct CutOut {
    /// Least corner of the box around it and the surfaces that make up one thing with it, in the space of its model.
    pub mins: Vec3,
    /// Solid part of its material's image; 0: unknown, its alpha is tested.
    pub coverage: f32,
    /// Greatest corner.
    pub maxs: Vec3,
}

/// Bounds of surfaces that only some rays test, and limits of paths.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TransportView {
    /// Boxes around the world's surfaces that tint light: smallest and largest corners.
    pub filters: u64,
    /// Boxes around the translucent surfaces visible from the camera, likewise.
    pub layers: u64,
    /// Boxes around surfaces that may be visible through a sky, likewise.
    pub beyond: u64,
    /// One bit for each surface of the world: it may be visible through a sky.
    pub beyond_surfaces: u64,
    /// [`MirrorPlane`]s, largest area first.
    pub mirrors: u64,
    /// For each surface of the map, the index of its [`MirrorPlane`], or `NO_MIRROR`.
    pub mirror_of_surface: u64,
    /// For each cluster, a bit for each of the first `MASKED_MIRRORS` of `mirrors`: it may be visible from the cluster.
    pub mirror_reach: u64,
    /// Pairs of floats, `SPECULAR_TABLE` rows by roughness of as many by the cosine to the view: the specular albedo is the
    /// first times the reflectance at normal incidence, plus the second.
    pub specular_albedo: u64,
    /// For each surface of the map, its [`CutOut`]; ends behind the last cut-out. 0: the map has none.
    pub cut_outs: u64,
    /// Number of `filters`.
    pub filter_count: u32,
    /// Number of `layers`; all ones: unknown, a ray tests layers always.
    pub layer_count: u32,
    /// Number of `beyond`.
    pub beyond_count: u32,
    /// Number of bits in `beyond_surfaces`.
    pub beyond_surface_count: u32,
    /// Most mirrors and portals on a path.
    pub max_depth: u32,
    /// Most bounces, of diffuse and mirrored light.
    pub bounces: u32,
    /// Number of `mirrors` across which light is sampled.
    pub mirror_count: u32,
    /// Number of clusters in `mirror_reach`.
    pub mirror_clusters: u32,
    /// 1: glass and liquids mirror the rays of bounces.
    pub mirroring_layers: u32,
    /// Most bounces of a path that starts by the specular lobe of the visible surface, its first ray included.
    pub specular_bounces: u32,
    /// `SPECULAR_*`.
    pub specular_estimator: u32,
    /// Samples of bounced light in its history, from which on a pixel traces no more; 0: all trace.
    pub bounce_samples: f32,
    /// 1: paths may end at their first ray, so that it has a throughput.
    pub roulette: u32,
    /// Part of `bounce_samples` that the corners of the picture need less than its centre.
    pub foveation: f32,
    /// Part of the light of a cell that arrives at the last vertex of a path; 0: none.
    pub ambient: f32,
    /// Decrease of that light with the length of the last ray, per unit.
    pub ambient_fall: f32,
    /// `CUT_OUTS_*`.
    pub cut_out_rays: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// The flares of a view.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FlareView {
    /// [`Flare`](crate::types::Flare)s.
    pub flares: u64,
    /// [`FlareState`](crate::types::FlareState)s, by slot.
    pub states: u64,
    /// Number of flares.
    pub count: u32,
    /// To a multiple of eight bytes.
    pub padding: u32,
}

/// Light in fog: bindless image indices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FogView {
    /// Factor of the fog's light, per pixel.
    pub weight: u32,
    /// Per cell: selected point in fog and its distance along the path; then, in its place, the light at this point, and
    /// the number of frames in its mean.
    pub fresh: u32,
    /// `fresh` of the last frame.
    pub last: u32,
    /// Filtered light, as shown.
    pub filtered: u32,
    /// Edge of a cell, pixels.
    pub cell: u32,
    /// Cells in a row.
    pub width: u32,
    /// Rows of cells.
    pub height: u32,
    /// `FOG_*` bits.
    pub flags: u32,
}
