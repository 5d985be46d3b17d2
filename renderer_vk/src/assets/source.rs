//! Interface of material compilation to its images, so that tests need no GPU.

use glam::Vec4;
use relight::materials::finish::SurfaceMap;

/// Loading options of an image. The first request determines them, as in the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageFlags {
    /// With mip levels.
    pub mipmap: bool,
    /// `r_picmip` applies.
    pub picmip: bool,
    /// Clamped to its edge instead of repeated.
    pub clamp: bool,
    /// The image of a detail stage, whose mip levels `r_detailFade` makes grey.
    pub detail: bool,
    /// Numbers and not colours: settings of brightness do not apply.
    pub data: bool,
}

impl ImageFlags {
    /// Flags of world and model textures.
    pub const WORLD: Self = Self {
        mipmap: true,
        picmip: true,
        clamp: false,
        detail: false,
        data: false,
    };
    /// Flags of normal maps and maps of roughness.
    pub const DATA: Self = Self {
        data: true,
        ..Self::WORLD
    };
    /// Flags of images registered without mip levels.
    pub const NO_MIP: Self = Self {
        mipmap: false,
        picmip: false,
        clamp: true,
        detail: false,
        data: false,
    };
}

/// Finds images by name. [`Textures`](super::Textures) implements it with files and a GPU.
pub trait ImageSource {
    /// Bindless index of the image that a script or map names, and its flags, which the first request determined.
    /// `None` if there is no usable file.
    fn image(&mut self, name: &str, flags: ImageFlags) -> Option<(u32, ImageFlags)>;
    /// Bindless index of a map in one of the layouts of [`SurfaceMap::load`]. `None` if an image is missing or unusable.
    fn surface_map(&mut self, map: &SurfaceMap) -> Option<u32>;
    /// Whether a file has this image.
    fn exists(&self, name: &str) -> bool;
    /// The white image.
    fn white(&self) -> u32;
    /// The image of missing textures.
    fn default_image(&self) -> u32;
    /// The texture of a cinematic's client number; black before the first upload.
    fn scratch(&mut self, client: usize) -> u32;
    /// A lightmap page of the map.
    fn lightmap(&self, page: usize) -> Option<u32>;
    /// Mean of an image: linear colour 0..1 and alpha 0..1; white for an unknown image.
    fn mean(&self, texture: u32) -> Vec4;
}
