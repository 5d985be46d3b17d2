//! The data that passes exchange within a frame, and the memory that they share.

/// Data that passes exchange within a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resource {
    /// Acceleration structures, geometry, materials and positions of the last frame; ready before the passes.
    Scene,
    /// Light lists, lights and suns; ready before the passes.
    Lights,
    /// Geometry and triangle of each pixel; drawn before the passes.
    DrawnHits,
    /// First hits of the camera's rays.
    PrimaryHits,
    /// Motion and view distance of the surface that a pixel shows.
    GBuffer,
    /// Its position.
    Positions,
    /// Its normals.
    Normals,
    /// Albedo of that surface, and the radiance in front of it.
    Shown,
    /// The same for the alternate side of a reflecting or transparent surface.
    Other,
    /// Weight of the light in fog.
    FogWeights,
    /// Points in fog to be lit.
    FogPoints,
    /// Visibility of flares.
    FlareStates,
    /// Photons where they have landed.
    Photons,
    /// The grid that holds them.
    PhotonCells,
    /// Pixels that shade a surface of the last frame again.
    GradientPixels,
    /// For each pixel, the light that its shadow ray tests.
    SampledLights,
    /// For each pixel, a light sample that stands for several.
    Reservoirs,
    /// Direct light without albedo; the denoiser leaves the sum of all filtered light here.
    DirectLight,
    /// The vertices of the map's triangles, in the frame that computes their light.
    VertexGrids,
    /// Whether walls cross the cells between them.
    VertexCells,
    /// Sums of the samples of their light.
    VertexSums,
    /// Their light.
    LitVertices,
    /// Cells of 2 × 2 pixels that gather bounced light.
    SelectedCells,
    /// What the rays of a bounce hit.
    BounceHits,
    /// Hits of bounce rays in the last frame's picture.
    ScreenHits,
    /// Albedo and emission of the first surface of each pixel, for the bounces of the next frame.
    ScreenSurfaces,
    /// Its light and distance.
    ScreenLight,
    /// For each of those hits, the light that its shadow ray tests, and the path that goes on from there.
    BounceLights,
    /// Bounced light without albedo.
    IndirectLight,
    /// Specular reflection of the surface that a pixel shows.
    GlossSurfaces,
    /// Its light, without the reflectance.
    GlossLight,
    /// The same, joined with that of earlier frames.
    GlossHistory,
    /// Light at the points in fog.
    FogLight,
    /// The same, filtered.
    FilteredFogLight,
    /// Change of light at the gradient pixels.
    GradientSamples,
    /// The same, filtered over neighbouring strata.
    GradientSums,
    /// The changed part of light in each stratum.
    Gradients,
    /// Change of depth from pixel to pixel.
    DepthGradient,
    /// Number of frames and variance of the light.
    Past,
    /// Light of this and earlier frames, being filtered.
    FreshLight,
    /// Filtered light for the next frame.
    LightHistory,
    /// Radiance of the traced size.
    Picture,
    /// More samples of the pixels that have no history.
    MoreSamples,
    /// Radiance of the output's size, resolved over frames or upscaled.
    ResolvedPicture,
    /// Histogram of luminance.
    Histogram,
    /// Exposure.
    Exposure,
    /// Levels of bloom.
    BloomLevels,
    /// Their sum.
    Bloom,
    /// The view's rectangle of the frame's image.
    Target,
    /// Hybrid look: normals and depths of the map's surfaces; drawn before the passes.
    HybridSurfaces,
    /// Hybrid look: occlusion by models, and hidden dynamic lights.
    HybridTraced,
    /// The same, filtered; read by the draws of the map.
    HybridTexels,
    /// Hybrid look: the mirrored scene; read by the draws of environment images.
    HybridReflections,
}

impl Resource {
    /// Representative of the resources that share memory with this one: writing one of them destroys the others.
    pub fn memory(self) -> Self {
        match self {
            Self::SampledLights
            | Self::Reservoirs
            | Self::BounceHits
            | Self::ScreenHits
            | Self::BounceLights
            | Self::GradientSamples
            | Self::GradientSums
            | Self::FreshLight => Self::PrimaryHits,
            Self::Past => Self::IndirectLight,
            Self::DepthGradient => Self::DirectLight,
            Self::Normals => Self::Picture,
            Self::FogPoints => Self::FogLight,
            Self::FilteredFogLight => Self::Positions,
            Self::Other => Self::ResolvedPicture,
            other => other,
        }
    }
}
