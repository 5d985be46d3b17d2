//! Models, skins and fonts of id Tech 3: bytes to typed, validated data.
//!
//! [`Md3`] is the vertex-animated model of Quake III, [`Mdr`] and [`Iqm`] are models with skeletons, [`Skin`] the text file that gives its surfaces
//! shaders, [`FontInfo`] the table of a pre-rendered font. Readers return typed errors that say where;
//! after `Ok` every index is in range. Numbers are as in the file: id units, x forward, y left, z up,
//! triangles clockwise seen from their front.

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

mod bone;
mod bytes;
mod error;
mod font;
mod iqm;
mod iqm_arrays;
mod iqm_header;
mod iqm_parse;
mod iqm_write;
mod md3;
mod md3_parse;
mod md3_write;
mod mdr;
mod mdr_parse;
mod mdr_write;
mod skin;
mod write;

pub use glam;

pub use bone::BoneMatrix;
pub use error::Error;
pub use font::{FONT_FILE_BYTES, FontInfo, GLYPHS_PER_FONT, Glyph};
pub use iqm::{
    IQM_CHANNELS, IQM_WEIGHTS, Iqm, IqmChannels, IqmJoint, IqmPose, IqmSkeleton, IqmSurface,
    IqmVertex,
};
pub use md3::{Frame, Md3, PackedVertex, Surface, Tag, TagPose};
pub use mdr::{Mdr, MdrSurface, MdrTag, MdrVertex, MdrWeight};
pub use skin::{Skin, SkinSurface};

/// The example of the README, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
