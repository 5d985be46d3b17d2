//! What compiling a material needs from the outside, so that it can be tested without a GPU.

use glam::Vec4;

/// How an image is loaded. The flags of its first user win, as in the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageFlags {
    /// Has smaller levels.
    pub mipmap: bool,
    /// `r_picmip` applies.
    pub picmip: bool,
    /// Clamped to its edge instead of repeated.
    pub clamp: bool,
}

impl ImageFlags {
    /// What world and model textures use.
    pub const WORLD: Self = Self {
        mipmap: true,
        picmip: true,
        clamp: false,
    };
    /// What pictures registered without mip levels use.
    pub const NO_MIP: Self = Self {
        mipmap: false,
        picmip: false,
        clamp: true,
    };
}

/// Finds images by name. [`Textures`](super::Textures) does it with files and a GPU.
pub trait ImageSource {
    /// Bindless index of the image that a script or map names, and the flags that it was loaded with: those of its
    /// first user. `None` when there is no usable file.
    fn image(&mut self, name: &str, flags: ImageFlags) -> Option<(u32, ImageFlags)>;
    /// White.
    fn white(&self) -> u32;
    /// The grid that stands for what is missing.
    fn default_image(&self) -> u32;
    /// The picture that a cinematic of this client number is uploaded to; black before the first.
    fn scratch(&mut self, client: usize) -> u32;
    /// A lightmap page of the map.
    fn lightmap(&self, page: usize) -> Option<u32>;
    /// Mean of an image: linear colour 0..1 and alpha 0..1; white for an unknown one.
    fn mean(&self, texture: u32) -> Vec4;
}
