//! Baking: light of a world's sources, written into the lightmaps, vertex colours and light grid of its map.

mod gather;

pub use gather::{Gather, GatherError, GatherProgress, Light, LitSurfaces, LitTriangle, Point};
