//! Maps of Quake, GoldSrc and Quake II: polygons over shared edges instead of vertex lists, texture axes instead of
//! coordinates, one small lightmap per polygon and light style.
//!
//! [`QuakeMap`] is such a file as it is stored; [`QuakeMap::to_bsp`] makes the one map model of it.

mod atlas;
mod convert;
mod faces;
mod file;
mod materials;
mod records;
mod textures;
mod visibility;

pub use file::QuakeMap;
pub use records::{
    Edge, Face, QuakeBrush, QuakeBrushSide, QuakeLeaf, QuakeModel, QuakeNode, QuakePlane, Texinfo,
};
pub use textures::{EmbeddedTexture, TextureUse, quake2_flags};
