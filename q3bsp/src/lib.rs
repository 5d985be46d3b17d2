//! id Tech 3 maps: bytes to typed, validated data and back.
//!
//! Read are `IBSP` 46 (Quake III and its mods), `IBSP` 47 (RTCW, Enemy Territory, Quake Live), `RBSP` 1 (Raven's games),
//! `FBSP` 1 (QFusion), and, converted, the maps of Quake, GoldSrc and Quake II (feature `quake`), all into the same [`Bsp`];
//! [`Bsp::format`] is the original format.
//!
//! [`Bsp::parse`] checks everything that a reader would otherwise have to check again: the directory,
//! the record sizes and every index of every lump. What the engine refuses is a typed [`Error`] that
//! names lump, element and value; what the engine tolerates is repaired and remembered as a [`Warning`].
//! Indices are types of their own ([`ShaderId`], [`Child`] and so on): after `Ok` the map has the record that each names, and
//! accessors such as [`Bsp::shader`] return it.
//! [`Bsp::write`] gives an unchanged file back byte for byte, repairs undone.
//!
//! Numbers are as in the file: id units, x forward, y left, z up, triangles clockwise seen from their
//! front. Floating-point values are *not* checked (shipped maps carry NaN lightmap coordinates and zero
//! normals, and they must survive writing); [`DrawVert::finite`] gives the cleaned vertex, and
//! everything derived here (patches, fog volumes, grid samples) is finite.
//!
//! With the feature `serde` the data types are `Serialize` and `Deserialize`, without [`Bsp::warnings`]; a deserialized
//! map has to pass [`Bsp::validate`] before its indices may be used.
//!
//! ```no_run
//! let bytes = std::fs::read("maps/example.bsp")?;
//! let bsp = q3bsp::Bsp::parse(&bytes)?;
//! for warning in &bsp.warnings {
//!     println!("{warning}");
//! }
//! let patches = bsp.patch_meshes(4.0);
//! println!("{} surfaces, {} of them drawn patches", bsp.surfaces.len(), patches.iter().flatten().count());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing
    )
)]

pub mod builder;
mod bytes;
mod container;
pub mod entities;
mod error;
mod flags;
mod fog;
mod foliage;
mod format;
mod grid;
mod ids;
mod layers;
mod lumps;
pub mod map_text;
mod parse;
mod patch;
#[cfg(feature = "quake")]
pub mod quake;
#[cfg(feature = "serde")]
mod serial;
mod surface;
mod tree;
mod validate;
mod visibility;
mod write;

pub use glam;

pub use container::{Container, Gap, LumpEntry, LumpRange, Repair};
pub use entities::Entity;
pub use error::{Error, Lump, Warning};
pub use flags::{content_flags, surface_flags};
pub use fog::FogVolume;
pub use format::Format;
pub use grid::{GridSample, LightGridLayout};
pub use ids::{BrushId, Child, LeafId, NodeId, PlaneId, ShaderId, SurfaceId};
pub use layers::{Advertisement, GridLayers, Layers, NO_STYLE, SurfaceLayers, VertexLayers};
pub use lumps::{
    Brush, BrushSide, DrawVert, Fog, GridPoint, LIGHTMAP_BYTES, LIGHTMAP_SIZE, Leaf, Lightmap,
    Model, Node, Plane, ShaderRef,
};
pub use parse::lump_entries;
pub use patch::{MAX_GRID_SIZE, PatchMesh, tessellate_patch};
pub use surface::{Surface, SurfaceKind, lightmap_index};
pub use visibility::Visibility;

/// A whole map, owned. Indices in the fields are valid after [`Bsp::parse`]; code that changes the
/// fields by hand takes over that duty ([`Bsp::validate`] checks it again).
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Bsp {
    /// The format that the map was read from and is written in.
    pub format: Format,
    /// Lump 0 as stored: entity text, meaningful up to the first NUL. See [`Bsp::entities`].
    #[cfg_attr(feature = "serde", serde(with = "crate::serial"))]
    pub entities: Vec<u8>,
    /// Lump 1: shader references of surfaces, brushes and brush sides. The same name may occur
    /// several times with different flags.
    pub shaders: Vec<ShaderRef>,
    /// Lump 2: planes.
    pub planes: Vec<Plane>,
    /// Lump 3: inner nodes of the BSP tree; node 0 is the root.
    pub nodes: Vec<Node>,
    /// Lump 4: leafs. Not every leaf is in the tree (see [`Bsp::tree_leafs`]).
    pub leafs: Vec<Leaf>,
    /// Lump 5: surface indices that leafs refer to.
    pub leaf_surfaces: Vec<SurfaceId>,
    /// Lump 6: brush indices that leafs refer to.
    pub leaf_brushes: Vec<BrushId>,
    /// Lump 7: models; 0 is the world, `n` is what an entity calls `*n`.
    pub models: Vec<Model>,
    /// Lump 8: convex brushes.
    pub brushes: Vec<Brush>,
    /// Lump 9: sides of brushes.
    pub brush_sides: Vec<BrushSide>,
    /// Lump 10: vertices and patch control points.
    pub vertices: Vec<DrawVert>,
    /// Lump 11: triangle corners, relative to the surface's `first_vert`. Surfaces share ranges.
    pub indices: Vec<i32>,
    /// Lump 12: fog volumes as stored; see [`Bsp::fog_volumes`].
    pub fogs: Vec<Fog>,
    /// Lump 13: what is drawn.
    pub surfaces: Vec<Surface>,
    /// Lump 14: lightmap pages.
    pub lightmaps: Vec<Lightmap>,
    /// Lump 15: light grid points, x fastest; see [`Bsp::light_grid`].
    pub light_grid: Vec<GridPoint>,
    /// Lump 16: potentially visible sets. `None` if absent or unusable: all clusters are mutually visible.
    pub visibility: Option<Visibility>,
    /// Light styles and what else `RBSP` and `FBSP` add; empty in other formats.
    pub layers: Layers,
    /// Lump 17 of Quake Live.
    pub advertisements: Vec<Advertisement>,
    /// How a map of Quake's formats draws its textures; see [`Bsp::material_script`]. Empty in other formats.
    #[cfg(feature = "quake")]
    pub texture_uses: Vec<quake::TextureUse>,
    /// Textures that a map of Quake's formats holds.
    #[cfg(feature = "quake")]
    pub embedded_textures: Vec<quake::EmbeddedTexture>,
    /// Whether the texture coordinates of vertices are in texels, because the format does not store the sizes of
    /// textures (Quake II): see [`Bsp::resolve_texture_sizes`].
    #[cfg(feature = "quake")]
    pub texel_coordinates: bool,
    /// What the file looked like around the data.
    pub container: Container,
    /// Tolerated oddities found by [`Bsp::parse`], in the order found.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub warnings: Vec<Warning>,
}

impl Bsp {
    /// Texels per side of each of [`Bsp::lightmaps`]: that of the format, but for pages that lay beside the map.
    pub fn lightmap_size(&self) -> usize {
        let first = self.lightmaps.first().map(Lightmap::size);
        first.unwrap_or_else(|| self.format.lightmap_size())
    }
}

/// The example of the README, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
