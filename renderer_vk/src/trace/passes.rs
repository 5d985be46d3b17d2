//! The passes of the traced look, one row each: shader, specialization constants, size, inputs and outputs.
//!
//! [`PassSet`](super::pass_set::PassSet) compiles the rows, [`FramePasses`](super::frame_passes::FramePasses) records
//! them, and checks in debug builds that the frame has written each input of a pass. Timers, statistics and the table
//! in ARCHITECTURE.md use the names of the rows. The order of a frame is that of `ViewTracer::record_passes`.

use shaders::constant_ids::trace as ids;
use shaders::trace_types::constants as t;
use shaders::{RayShader, Spirv};

pub use super::resource::Resource;

/// A shader of a pass.
#[derive(Clone, Copy, Debug)]
pub enum Shader {
    /// Traces rays, with any tracer.
    Rays(&'static RayShader),
    /// Traces no rays.
    Compute(&'static Spirv),
}

/// Number of invocations of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// One for each traced pixel.
    Traced,
    /// One for each slot of the ray tiles (`ray_order.glsl`).
    RayTiles,
    /// One for each cell of 2 × 2 traced pixels.
    Cells,
    /// One for each stratum of 3 × 3 traced pixels.
    Strata,
    /// One for each cell of the light in fog.
    FogCells,
    /// One for each flare.
    Flares,
    /// One for each photon.
    Photons,
    /// One for each vertex that may have light.
    Vertices,
    /// One for each triangle that may have vertices.
    VertexTriangles,
    /// One for each pixel of the finished picture.
    Output,
    /// One for each 2 × 2 pixels of the finished picture.
    OutputHalf,
    /// One for each 4 × 4 pixels of the finished picture.
    OutputQuarter,
    /// A single work group.
    Group,
}

/// A fact about a frame that selects the variant of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// The view has fog that rays light.
    LitFog,
    /// The map has fog.
    MapFog,
    /// There is bounced light.
    Bounces,
    /// Materials are rough or have normal maps.
    Gloss,
    /// Heights of normal maps move textures (`r_parallaxMapping`).
    Heights,
    /// Photons bring the light that crosses refracting bodies.
    Caustics,
    /// A view of `rt_debug` shows the time of pixels.
    Timed,
    /// The random numbers of light are blue noise over the picture.
    BlueNoise,
    /// Bounces may hit the last frame's picture.
    ScreenHits,
    /// Only some cells gather bounced light.
    Adaptive,
    /// Paths of bounces may end where they have found light.
    Roulette,
    /// Lights are drawn from a tree (`rt_lightSelection 2`).
    LightTree,
    /// The other eye's light of this frame is known (`rt_shareEyes`).
    SharedEyes,
    /// The last bounce adds light of further ones.
    Ambient,
    /// The maximum of the colour range of antialiasing is smoothed over time.
    SmoothMaximum,
    /// Pixels without history have more samples.
    MoreSamples,
    /// Rays count the bodies that they meet (`rt_hitFeedback`).
    Feedback,
    /// Bounces take the light of vertices (`rt_bounceCache`).
    VertexLight,
    /// Scattered rays do not test the alpha of cut-outs (`rt_cutouts`).
    CutOuts,
}

/// Declaration of a pass.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Purpose, for the table in ARCHITECTURE.md.
    #[cfg_attr(not(test), expect(dead_code, reason = "documentation"))]
    pub about: &'static str,
    /// Name in timers, statistics and captures. Steps of one filter share a name.
    pub name: &'static str,
    /// Shader.
    pub shader: Shader,
    /// Number of invocations.
    pub size: Size,
    /// Specialization constants, id and value.
    pub constants: &'static [(u32, u32)],
    /// The pass whose pipelines this one runs; of the same shader, constants and switch.
    pub shares: Option<Pass>,
    /// Ids of constants that switches set to 0 or 1.
    pub switches: &'static [(u32, Switch)],
    /// Resources that an earlier pass of the frame must have written.
    pub reads: &'static [Resource],
    /// Resources that it reads if this frame has written them, for the same table.
    #[cfg_attr(not(test), expect(dead_code, reason = "documentation"))]
    pub may_read: &'static [Resource],
    /// Resources that it writes.
    pub writes: &'static [Resource],
    /// Number of its ray counter (`COUNT_*`).
    pub counter: Option<u32>,
}

impl Row {
    const fn of(about: &'static str, name: &'static str, shader: Shader, size: Size) -> Self {
        Self {
            about,
            name,
            shader,
            size,
            constants: &[],
            shares: None,
            switches: &[],
            reads: &[],
            may_read: &[],
            writes: &[],
            counter: None,
        }
    }
}

macro_rules! passes {
    ($($(#[doc = $about:literal])+ $pass:ident = $name:literal, $shader:expr, $size:ident { $($field:ident: $value:expr),* $(,)? })+) => {
        /// A pass of the traced look.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Pass {
            $($(#[doc = $about])+ $pass),+
        }

        /// Declarations, in the order of [`Pass`].
        pub static TABLE: &[Row] = {
            #[allow(clippy::enum_glob_use)] // rows name many of them
            use {Resource::*, Shader::{Compute, Rays}, Switch::{Adaptive, BlueNoise, Bounces, Caustics, CutOuts, Feedback, Gloss, Heights, LightTree, LitFog, MapFog, Roulette, SharedEyes, Timed, VertexLight}};
            &[$(Row { $($field: $value,)* ..Row::of(concat!($($about),+), $name, $shader, Size::$size) }),+]
        };
    };
}

passes! {
    /// First hits of the camera's rays.
    PrimaryRays = "trace_primary_rays", Rays(&shaders::TRACE_PRIMARY_RAYS), Traced {
        switches: &[(ids::clock::TIMED, Timed), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene],
        writes: &[PrimaryHits],
        counter: Some(t::COUNT_PRIMARY_RAYS),
    }
    /// The same from what the rasterizer has drawn (`rt_firstHits`).
    FirstHits = "trace_first_hits", Compute(&shaders::TRACE_FIRST_HITS_COMP), Traced {
        switches: &[(ids::clock::TIMED, Timed)],
        reads: &[Scene, DrawnHits],
        writes: &[PrimaryHits],
    }
    /// `Primary` compiled without rays: finishes the many pixels that show the surface of their first hit.
    PrimarySimple = "trace_primary_simple", Compute(&shaders::TRACE_PRIMARY_RGEN_NO_RAYS), Traced {
        switches: &[(ids::fog_keep::LIT_FOG, LitFog), (ids::specular::HAS_GLOSS, Gloss), (ids::specular::HAS_HEIGHTS, Heights), (ids::clock::TIMED, Timed)],
        reads: &[Scene, PrimaryHits],
        writes: &[GBuffer, Positions, Normals, Shown, FogWeights, FogPoints, GlossSurfaces],
    }
    /// The surface that each other pixel shows behind mirrors, portals, glass and liquids, with the layers in front of
    /// it.
    Primary = "trace_primary", Rays(&shaders::TRACE_PRIMARY), Traced {
        switches: &[(ids::fog_keep::LIT_FOG, LitFog), (ids::specular::HAS_GLOSS, Gloss), (ids::specular::HAS_HEIGHTS, Heights), (ids::clock::TIMED, Timed), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, PrimaryHits],
        writes: &[GBuffer, Positions, Normals, Shown, FogWeights, FogPoints, GlossSurfaces],
        counter: Some(t::COUNT_PRIMARY),
    }
    /// The side of glass or of a glossy surface that a pixel does not show.
    OtherSide = "trace_other_side", Rays(&shaders::TRACE_PRIMARY), Traced {
        shares: Some(Pass::Primary),
        switches: &[(ids::fog_keep::LIT_FOG, LitFog), (ids::specular::HAS_GLOSS, Gloss), (ids::specular::HAS_HEIGHTS, Heights), (ids::clock::TIMED, Timed), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, PrimaryHits, GBuffer],
        writes: &[Other],
    }
    /// What bounces of the next frame take from the first surface of each pixel, but for the light (`rt_bounceScreen`).
    ScreenSurface = "trace_screen_surface", Compute(&shaders::TRACE_SCREEN_SURFACE_COMP), Traced {
        switches: &[(ids::specular::HAS_GLOSS, Gloss)],
        reads: &[Scene, PrimaryHits, GBuffer],
        writes: &[ScreenSurfaces],
    }
    /// Visibility of flares.
    FlareRays = "trace_flares", Rays(&shaders::TRACE_FLARES), Flares {
        switches: &[(ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene],
        writes: &[FlareStates],
    }
    /// Photons from lamps and suns through refracting bodies (`rt_caustics`).
    Photons = "trace_photons", Rays(&shaders::TRACE_PHOTONS), Photons {
        switches: &[(ids::specular::HAS_GLOSS, Gloss), (ids::lights::LIGHT_TREE, LightTree), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights],
        writes: &[Photons],
        counter: Some(t::COUNT_PHOTONS),
    }
    /// Sorts them into the cells of a grid.
    PhotonCells = "trace_photon_cells", Compute(&shaders::TRACE_PHOTON_CELLS_COMP), Photons {
        reads: &[Photons],
        writes: &[PhotonCells],
    }
    /// Finds in each stratum a surface of the last frame, which is then shaded again with its old random numbers.
    GradientReproject = "trace_gradient_reproject", Compute(&shaders::TRACE_GRADIENT_REPROJECT_COMP), Strata {
        reads: &[GBuffer, Positions, Normals],
        writes: &[GradientPixels],
    }
    /// Samples one light for each pixel, and sorts the rays of a tile by direction.
    SampleLights = "trace_sample_lights", Compute(&shaders::TRACE_SAMPLE_LIGHTS_COMP), Traced {
        switches: &[(ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::lights::LIGHT_TREE, LightTree)],
        reads: &[Lights, GBuffer, Positions, Normals],
        may_read: &[GradientPixels],
        writes: &[SampledLights],
    }
    /// Shadow rays to the sampled lights.
    SampledDirect = "trace_direct", Rays(&shaders::TRACE_DIRECT), RayTiles {
        constants: &[(ids::direct::SAMPLING, t::SAMPLING_LIGHT)],
        switches: &[(ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals, SampledLights],
        may_read: &[GradientPixels, PhotonCells],
        writes: &[DirectLight],
        counter: Some(t::COUNT_DIRECT),
    }
    /// Shadow rays to suns, whose light is added.
    Suns = "trace_suns", Rays(&shaders::TRACE_DIRECT), RayTiles {
        constants: &[(ids::direct::SAMPLING, t::SAMPLING_SUNS)],
        switches: &[(ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals, SampledLights, DirectLight],
        may_read: &[GradientPixels, PhotonCells],
        writes: &[DirectLight],
        counter: Some(t::COUNT_SUNS),
    }
    /// A light sample for each pixel, tested by a ray and joined with that of the last frame (`rt_lightSelection 3`).
    ReservoirSamples = "trace_direct", Rays(&shaders::TRACE_RESERVOIR_SAMPLES), Traced {
        switches: &[(ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals],
        writes: &[Reservoirs],
        counter: Some(t::COUNT_DIRECT),
    }
    /// Joins the samples of neighbouring pixels; light of the result, and of a sun.
    ReservoirReuse = "trace_direct", Rays(&shaders::TRACE_RESERVOIR_REUSE), Traced {
        switches: &[(ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals, Reservoirs],
        may_read: &[PhotonCells],
        writes: &[DirectLight],
        counter: Some(t::COUNT_DIRECT),
    }
    /// Direct light where a pixel samples several lights or all.
    Direct = "trace_direct", Rays(&shaders::TRACE_DIRECT), Traced {
        switches: &[(ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::lights::LIGHT_TREE, LightTree), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals],
        may_read: &[GradientPixels, PhotonCells],
        writes: &[DirectLight],
        counter: Some(t::COUNT_DIRECT),
    }
    /// Light that flat mirrors of the map reflect onto the surfaces from which a bounce starts.
    MirrorLight = "trace_mirror_light", Rays(&shaders::TRACE_MIRROR_LIGHT), Cells {
        switches: &[(ids::specular::HAS_GLOSS, Gloss), (ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::subsample::ADAPTIVE, Adaptive), (ids::lights::LIGHT_TREE, LightTree), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals],
        may_read: &[GradientPixels, BounceLights, SelectedCells],
        writes: &[BounceLights],
        counter: Some(t::COUNT_MIRRORS),
    }
    /// Makes the vertices of the map's triangles, and splits triangles where the light of neighbours differs (`rt_bounceCache`).
    VertexSplit = "trace_vertices", Compute(&shaders::TRACE_VERTEX_SPLIT_COMP), VertexTriangles {
        reads: &[Scene],
        may_read: &[LitVertices],
        writes: &[VertexGrids],
    }
    /// Tests which cells of vertices no wall crosses.
    VertexTest = "trace_vertices", Rays(&shaders::TRACE_VERTEX_WRITE), Vertices {
        shares: Some(Pass::VertexWrite),
        reads: &[Scene, VertexGrids],
        writes: &[VertexCells],
    }
    /// Samples the light at these vertices.
    VertexGather = "trace_vertices", Rays(&shaders::TRACE_VERTEX_GATHER), Vertices {
        switches: &[(ids::bounce::HAS_FOG, MapFog), (ids::specular::HAS_GLOSS, Gloss), (ids::lights::LIGHT_TREE, LightTree)],
        reads: &[Scene, Lights, VertexGrids, VertexCells],
        may_read: &[LitVertices],
        writes: &[VertexSums],
    }
    /// Writes it for bounces.
    VertexWrite = "trace_vertices", Rays(&shaders::TRACE_VERTEX_WRITE), Vertices {
        reads: &[Scene, VertexGrids, VertexCells, VertexSums],
        writes: &[LitVertices],
    }
    /// Selects the cells that gather bounced light (`rt_bounceAdaptive`).
    BounceSelect = "trace_bounce_select", Compute(&shaders::TRACE_BOUNCE_SELECT_COMP), Cells {
        switches: &[(ids::subsample::SHARED_EYES, SharedEyes)],
        reads: &[GBuffer, Positions, Normals],
        writes: &[SelectedCells],
    }
    /// Hits of the first ray of a path in the last frame's picture (`rt_bounceScreen`).
    ScreenMarch = "trace_screen_march", Compute(&shaders::TRACE_SCREEN_MARCH_COMP), Cells {
        switches: &[(ids::subsample::ADAPTIVE, Adaptive)],
        reads: &[GBuffer, Positions, Normals],
        may_read: &[GradientPixels, SelectedCells],
        writes: &[ScreenHits],
    }
    /// Rays of a bounce.
    BounceRays = "trace_bounce_rays", Rays(&shaders::TRACE_BOUNCE_RAYS), Cells {
        switches: &[(ids::specular::HAS_GLOSS, Gloss), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::screen::SCREEN_HITS, Switch::ScreenHits), (ids::subsample::ADAPTIVE, Adaptive), (ids::bounce_rays::ROULETTE, Roulette), (ids::feedback::HIT_FEEDBACK, Feedback), (ids::candidate::CUT_OUTS, CutOuts)],
        reads: &[Scene, GBuffer, Positions, Normals],
        may_read: &[GradientPixels, BounceLights, GlossSurfaces, ScreenHits, SelectedCells, DirectLight],
        writes: &[BounceHits],
        counter: Some(t::COUNT_BOUNCE_RAYS),
    }
    /// Shades what they hit, and samples a light for it.
    BounceShade = "trace_bounce_hits", Compute(&shaders::TRACE_BOUNCE_HITS_COMP), Cells {
        switches: &[(ids::bounce::HAS_FOG, MapFog), (ids::specular::HAS_GLOSS, Gloss), (ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::screen::SCREEN_HITS, Switch::ScreenHits), (ids::subsample::ADAPTIVE, Adaptive), (ids::lights::LIGHT_TREE, LightTree), (ids::vertex_light::VERTEX_LIGHT, VertexLight)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals, BounceHits],
        may_read: &[GradientPixels, BounceLights, GlossSurfaces, PhotonCells, SelectedCells, LitVertices],
        writes: &[BounceLights, GlossSurfaces],
    }
    /// The same of the last bounce, after which no path goes on.
    BounceShadeLast = "trace_bounce_hits", Compute(&shaders::TRACE_BOUNCE_HITS_COMP), Cells {
        constants: &[(ids::bounce::LAST_BOUNCE, 1)],
        switches: &[(ids::bounce::HAS_FOG, MapFog), (ids::specular::HAS_GLOSS, Gloss), (ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::screen::SCREEN_HITS, Switch::ScreenHits), (ids::subsample::ADAPTIVE, Adaptive), (ids::lights::LIGHT_TREE, LightTree), (ids::bounce_hits::AMBIENT, Switch::Ambient), (ids::vertex_light::VERTEX_LIGHT, VertexLight)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals, BounceHits],
        may_read: &[GradientPixels, BounceLights, GlossSurfaces, PhotonCells, SelectedCells, LitVertices],
        writes: &[BounceLights, GlossSurfaces],
    }
    /// Shadow rays to those lights; the last writes the light of the paths, of one of both kinds.
    BounceLight = "trace_bounce_light", Rays(&shaders::TRACE_BOUNCE_LIGHT), Cells {
        switches: &[(ids::specular::HAS_GLOSS, Gloss), (ids::photons::CAUSTICS, Caustics), (ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::subsample::ADAPTIVE, Adaptive), (ids::feedback::HIT_FEEDBACK, Feedback), (ids::candidate::CUT_OUTS, CutOuts)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals, BounceLights],
        may_read: &[GradientPixels, GlossSurfaces, SelectedCells],
        writes: &[IndirectLight, GlossLight],
        counter: Some(t::COUNT_BOUNCE_LIGHT),
    }
    /// Specular light of sampled lights at rough surfaces. The passes of a bounce then trace its other paths.
    SpecularLight = "trace_specular_light", Rays(&shaders::TRACE_SPECULAR_LIGHT), Cells {
        constants: &[(ids::specular::HAS_GLOSS, 1)],
        switches: &[(ids::clock::TIMED, Timed), (ids::random::BLUE_NOISE, BlueNoise), (ids::lights::LIGHT_TREE, LightTree), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, GBuffer, Positions, Normals, GlossSurfaces],
        writes: &[BounceLights],
        counter: Some(t::COUNT_SPECULAR),
    }
    /// Interpolates bounced light to the pixels that did not gather it.
    BounceUpsample = "trace_bounce_upsample", Compute(&shaders::TRACE_BOUNCE_UPSAMPLE_COMP), Cells {
        switches: &[(ids::subsample::ADAPTIVE, Adaptive)],
        reads: &[GBuffer, Positions, Normals, IndirectLight],
        may_read: &[GradientPixels, SelectedCells],
        writes: &[IndirectLight],
    }
    /// Change of the light of each gradient pixel.
    GradientSample = "trace_gradient_sample", Compute(&shaders::TRACE_GRADIENT_SAMPLE_COMP), Strata {
        switches: &[(ids::subsample::ADAPTIVE, Adaptive)],
        reads: &[GradientPixels, DirectLight, IndirectLight],
        may_read: &[SelectedCells],
        writes: &[GradientSamples],
    }
    /// Filters it over strata up to 6 away.
    Gradient = "trace_gradient", Compute(&shaders::TRACE_GRADIENT_COMP), Strata {
        reads: &[GradientSamples],
        writes: &[GradientSums],
    }
    /// Filters it over strata up to 12 away.
    GradientWide = "trace_gradient_wide", Compute(&shaders::TRACE_GRADIENT_WIDE_COMP), Strata {
        reads: &[GradientPixels, GradientSums],
        writes: &[Gradients],
    }
    /// A-SVGF: joins the light with that of earlier frames.
    Temporal = "trace_temporal", Compute(&shaders::TRACE_TEMPORAL_COMP), Traced {
        switches: &[(ids::temporal::BOUNCES, Bounces), (ids::subsample::ADAPTIVE, Adaptive), (ids::subsample::SHARED_EYES, SharedEyes)],
        reads: &[GBuffer, Positions, Normals, DirectLight, IndirectLight],
        may_read: &[GradientPixels, Gradients, SelectedCells],
        writes: &[FreshLight, DepthGradient, Past],
    }
    /// A-SVGF: first wavelet step; its result is the history of the next frame.
    WaveletFirst = "trace_wavelet", Compute(&shaders::TRACE_ATROUS_COMP), Traced {
        constants: &[(ids::atrous::NOISY_VARIANCE, 1), (ids::atrous::LAST, 0)],
        switches: &[(ids::atrous::BOUNCES, Bounces)],
        reads: &[FreshLight, DepthGradient],
        writes: &[LightHistory],
    }
    /// A-SVGF: second wavelet step.
    WaveletSecond = "trace_wavelet", Compute(&shaders::TRACE_ATROUS_COMP), Traced {
        constants: &[(ids::atrous::NOISY_VARIANCE, 0), (ids::atrous::LAST, 0)],
        switches: &[(ids::atrous::BOUNCES, Bounces)],
        reads: &[LightHistory, DepthGradient],
        writes: &[FreshLight],
    }
    /// A-SVGF: last wavelet step.
    WaveletLast = "trace_wavelet", Compute(&shaders::TRACE_ATROUS_COMP), Traced {
        constants: &[(ids::atrous::NOISY_VARIANCE, 0), (ids::atrous::LAST, 1)],
        switches: &[(ids::atrous::BOUNCES, Bounces)],
        reads: &[FreshLight, DepthGradient, Past],
        writes: &[LightHistory, DirectLight],
    }
    /// Sparse filter: running mean over frames, shortened where the light changes.
    SparseTemporal = "trace_sparse_temporal", Compute(&shaders::TRACE_SPARSE_TEMPORAL_COMP), Traced {
        reads: &[GBuffer, Normals, DirectLight, IndirectLight],
        writes: &[FreshLight, DepthGradient],
    }
    /// Sparse filter: scattered taps; the inner ones make the history of the next frame.
    SparseFilter = "trace_sparse_filter", Compute(&shaders::TRACE_SPARSE_FILTER_COMP), Traced {
        reads: &[FreshLight, DepthGradient],
        writes: &[LightHistory, DirectLight],
    }
    /// Joins the specular light of the paths around a pixel with that of earlier frames.
    SpecularTemporal = "trace_specular_filter", Compute(&shaders::TRACE_SPECULAR_TEMPORAL_COMP), Traced {
        reads: &[GBuffer, Positions, Normals, GlossSurfaces, GlossLight],
        may_read: &[GradientPixels, Gradients],
        writes: &[GlossHistory],
    }
    /// Smooths it by the size of the lobe on the screen.
    SpecularFilter = "trace_specular_filter", Compute(&shaders::TRACE_SPECULAR_FILTER_COMP), Traced {
        reads: &[Positions, Normals, GlossHistory],
        writes: &[GlossLight],
    }
    /// Light at the points in fog.
    FogLight = "trace_fog", Rays(&shaders::TRACE_FOG_LIGHT), FogCells {
        switches: &[(ids::lights::LIGHT_TREE, LightTree), (ids::feedback::HIT_FEEDBACK, Feedback)],
        reads: &[Scene, Lights, FogPoints],
        writes: &[FogLight],
    }
    /// A step of the filter of that light.
    FogFilter = "trace_fog_filter", Compute(&shaders::TRACE_FOG_FILTER_COMP), FogCells {
        reads: &[FogWeights, FogLight],
        writes: &[FilteredFogLight],
    }
    /// The linear picture; in reference mode the mean over frames.
    Composite = "trace_composite", Compute(&shaders::TRACE_COMPOSITE_COMP), Traced {
        switches: &[(ids::specular::HAS_GLOSS, Gloss)],
        reads: &[GBuffer, Shown, DirectLight],
        may_read: &[IndirectLight, GlossSurfaces, GlossLight, Other, FogWeights, FogLight, FilteredFogLight, Gradients],
        writes: &[Picture],
    }
    /// Depth and light of this frame for the bounces of the next.
    ScreenLight = "trace_screen_light", Compute(&shaders::TRACE_SCREEN_LIGHT_COMP), Traced {
        reads: &[GBuffer, ScreenSurfaces, DirectLight],
        may_read: &[IndirectLight],
        writes: &[ScreenLight],
    }
    /// More samples of the pixels that have no history (`rt_taaRays`).
    MoreSamples = "trace_more_samples", Rays(&shaders::TRACE_MORE_SAMPLES), Traced {
        switches: &[(ids::specular::HAS_GLOSS, Gloss), (ids::specular::HAS_HEIGHTS, Heights)],
        reads: &[Scene, GBuffer, DirectLight, Picture],
        may_read: &[IndirectLight],
        writes: &[MoreSamples],
        counter: Some(t::COUNT_MORE_SAMPLES),
    }
    /// Temporal antialiasing, and upscaling with it.
    Antialias = "trace_antialias", Compute(&shaders::TRACE_ANTIALIAS_COMP), Output {
        switches: &[(ids::antialias::SMOOTH_MAXIMUM, Switch::SmoothMaximum), (ids::antialias::MORE_SAMPLES, Switch::MoreSamples)],
        reads: &[GBuffer, Shown, DirectLight, Picture],
        may_read: &[IndirectLight, Gradients, MoreSamples],
        writes: &[ResolvedPicture],
    }
    /// Upscaling of a single frame.
    Upscale = "trace_upscale", Compute(&shaders::TRACE_UPSCALE_COMP), Output {
        reads: &[Picture],
        writes: &[ResolvedPicture],
    }
    /// Sharpening of that picture (`rt_sharpness`).
    Sharpen = "trace_sharpen", Compute(&shaders::TRACE_SHARPEN_COMP), Output {
        reads: &[ResolvedPicture],
        writes: &[ResolvedPicture],
    }
    /// Histogram of luminance.
    Histogram = "trace_exposure", Compute(&shaders::TRACE_HISTOGRAM_COMP), OutputHalf {
        reads: &[GBuffer, Picture],
        may_read: &[ResolvedPicture],
        writes: &[Histogram],
    }
    /// Adaptation of exposure.
    Exposure = "trace_exposure", Compute(&shaders::TRACE_EXPOSURE_COMP), Group {
        reads: &[Histogram],
        writes: &[Exposure],
    }
    /// Mean light of ever larger squares.
    BloomDown = "trace_bloom", Compute(&shaders::TRACE_BLOOM_DOWN_COMP), OutputQuarter {
        reads: &[Picture, Exposure],
        may_read: &[ResolvedPicture],
        writes: &[BloomLevels],
    }
    /// Their weighted sum.
    BloomUp = "trace_bloom", Compute(&shaders::TRACE_BLOOM_UP_COMP), OutputQuarter {
        reads: &[BloomLevels],
        writes: &[Bloom],
    }
    /// Exposure, tone curve and display encoding.
    ToneMap = "trace_tonemap", Compute(&shaders::TRACE_TONEMAP_COMP), Output {
        reads: &[Picture, Exposure],
        may_read: &[ResolvedPicture, Bloom],
        writes: &[Target],
    }
    /// An intermediate result in place of the picture (`rt_debug`).
    Debug = "trace_debug", Compute(&shaders::TRACE_DEBUG_COMP), Output {
        reads: &[GBuffer, Picture],
        may_read: &[Positions, Normals, Shown, Other, Gradients, DirectLight, IndirectLight, Past],
        writes: &[Target],
    }
    /// Hybrid look (`r_rt 2`): rays from the map's surfaces to models, and to dynamic lights.
    HybridShadows = "hybrid_shadows", Rays(&shaders::TRACE_HYBRID_SHADOWS), Traced {
        reads: &[Scene, HybridSurfaces],
        writes: &[HybridTraced],
    }
    /// Hybrid look: what surfaces with an environment image mirror.
    HybridReflections = "hybrid_reflections", Rays(&shaders::TRACE_HYBRID_REFLECTIONS), Traced {
        reads: &[Scene, HybridSurfaces],
        writes: &[HybridReflections],
    }
    /// Hybrid look: mean over the directions of the rays to models.
    HybridFilter = "hybrid_filter", Compute(&shaders::TRACE_HYBRID_FILTER_COMP), Traced {
        reads: &[HybridTraced],
        writes: &[HybridTexels],
    }
}

impl Pass {
    /// Declaration of the pass.
    pub fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }
}

/// Number of ray counters.
pub const COUNTERS: usize = t::COUNT_MORE_SAMPLES as usize + 1;

/// Number of the ray counter of the pass with this name.
pub fn counter_of(name: &str) -> Option<usize> {
    let mut rows = TABLE.iter().filter(|row| row.name == name);
    rows.find_map(|row| row.counter).map(|count| count as usize)
}

#[cfg(test)]
#[path = "passes_tests.rs"]
mod tests;
