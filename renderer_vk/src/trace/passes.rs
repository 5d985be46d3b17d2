//! The passes of a traced frame after the acceleration structures: each type owns its pipelines and records one step.
//! All of them read their inputs and outputs from one `TraceView`, whose address `record` is given.

use shaders::Spirv;
use shaders::constant_ids::trace::{bounce, direct, fog_keep, reflect_refract};
use shaders::trace_types::constants::{SAMPLING_LIGHT, SAMPLING_SUNS, RAY_TILE};

use super::input::Tracer;
use crate::gpu::{
    Access, ComputePipeline, Device, Error, HitGroup, RayTracingDesc, RayTracingPipeline, Recorder,
};

/// A ray tracing pipeline with the hit shaders that all passes share.
fn ray_pipeline(
    device: &Device,
    name: &str,
    raygen: &Spirv,
    constants: &[(u32, u32)],
) -> Result<RayTracingPipeline, Error> {
    RayTracingPipeline::new(
        device,
        &RayTracingDesc {
            name,
            raygen,
            miss: &[&shaders::TRACE_MISS_RMISS, &shaders::TRACE_LAYERS_RMISS],
            hit: &[
                HitGroup {
                    closest_hit: Some(&shaders::TRACE_HIT_RCHIT),
                    any_hit: Some(&shaders::TRACE_TESTED_RAHIT),
                },
                HitGroup {
                    closest_hit: Some(&shaders::TRACE_HIT_RCHIT),
                    any_hit: Some(&shaders::TRACE_TRANSLUCENT_RAHIT),
                },
            ],
            constants,
        },
    )
}

/// A pass that traces: launched as rays, or as a compute shader that follows rays itself.
enum RayPass {
    Pipeline(RayTracingPipeline),
    Compute(ComputePipeline),
}

/// Groups of the compute shaders that trace.
const COMPUTE_TILE: [u32; 2] = [8, 4];

fn trace(
    rec: &mut Recorder,
    name: &str,
    pipeline: &RayPass,
    view: u64,
    size: [u32; 2],
) -> Result<(), Error> {
    let pipeline = match pipeline {
        RayPass::Pipeline(pipeline) => pipeline,
        RayPass::Compute(pipeline) => {
            let mut pass = rec.pass(name, Access::COMPUTE, Access::COMPUTE)?;
            pass.bind_compute(pipeline);
            pass.push(&view);
            let [x, y] = COMPUTE_TILE;
            pass.dispatch(size[0].div_ceil(x), size[1].div_ceil(y), 1);
            return Ok(());
        }
    };
    let mut pass = rec.pass(name, Access::RAY_TRACING, Access::RAY_TRACING)?;
    pass.bind_rays(pipeline);
    pass.push(&view);
    pass.trace_rays(size[0], size[1], 1);
    Ok(())
}

/// Edge of the groups of the compute passes over pixels, see their `local_size`.
pub(super) const TILE: u32 = 8;

pub(super) fn dispatch(
    rec: &mut Recorder,
    name: &str,
    pipeline: &ComputePipeline,
    view: u64,
    size: [u32; 2],
    tile: [u32; 2],
) -> Result<(), Error> {
    let mut pass = rec.pass(name, Access::COMPUTE, Access::COMPUTE)?;
    pass.bind_compute(pipeline);
    pass.push(&view);
    pass.dispatch(size[0].div_ceil(tile[0]), size[1].div_ceil(tile[1]), 1);
    Ok(())
}

macro_rules! ray_pass {
    ($(#[$doc:meta])* $type:ident, $name:literal, $raygen:ident, $compute:ident, $query:ident) => {
        ray_pass!($(#[$doc])* $type, $name, $raygen, $compute, $query, &[]);
    };
    ($(#[$doc:meta])* $type:ident, $name:literal, $raygen:ident, $compute:ident, $query:ident, $constants:expr) => {
        $(#[$doc])*
        pub struct $type(RayPass);

        impl $type {
            /// Compiles the pipeline.
            ///
            /// # Errors
            /// The driver refuses the pipeline.
            pub fn new(device: &Device, tracer: Tracer) -> Result<Self, Error> {
                Self::with(device, tracer, $constants)
            }

            /// Compiles the pipeline with specialization constants, id and value.
            fn with(device: &Device, tracer: Tracer, constants: &[(u32, u32)]) -> Result<Self, Error> {
                Ok(Self(match tracer {
                    Tracer::Pipeline => RayPass::Pipeline(ray_pipeline(device, $name, &shaders::$raygen, constants)?),
                    Tracer::Compute => RayPass::Compute(ComputePipeline::new(device, $name, &shaders::$compute, constants)?),
                    Tracer::Query => RayPass::Compute(ComputePipeline::new(device, $name, &shaders::$query, constants)?),
                }))
            }

            /// Records the pass. `view`: device address of the `TraceView`; `size`: its pixels.
            ///
            /// # Errors
            /// Out of memory.
            pub fn record(&self, rec: &mut Recorder, view: u64, size: [u32; 2]) -> Result<(), Error> {
                trace(rec, $name, &self.0, view, size)
            }
        }
    };
}

macro_rules! pixel_pass {
    ($(#[$doc:meta])* $type:ident, $name:literal, $shader:ident) => {
        pixel_pass!($(#[$doc])* $type, $name, $shader, TILE);
    };
    ($(#[$doc:meta])* $type:ident, $name:literal, $shader:ident, $tile:expr) => {
        $(#[$doc])*
        pub struct $type(ComputePipeline);

        impl $type {
            /// Compiles the pipeline.
            ///
            /// # Errors
            /// The driver refuses the pipeline.
            pub fn new(device: &Device) -> Result<Self, Error> {
                Self::with(device, &[])
            }

            /// Compiles the pipeline with specialization constants, id and value.
            fn with(device: &Device, constants: &[(u32, u32)]) -> Result<Self, Error> {
                Ok(Self(ComputePipeline::new(device, $name, &shaders::$shader, constants)?))
            }

            /// Records the pass. `view`: device address of the `TraceView`; `size`: its pixels.
            ///
            /// # Errors
            /// Out of memory.
            pub fn record(&self, rec: &mut Recorder, view: u64, size: [u32; 2]) -> Result<(), Error> {
                dispatch(rec, $name, &self.0, view, size, [$tile; 2])
            }
        }
    };
}

ray_pass!(
    /// Reads the acceleration structures; writes what the eye's own rays meet first (`texels`).
    EyeRays, "trace_primary_rays", TRACE_PRIMARY_RAYS_RGEN,
    TRACE_PRIMARY_RAYS_RGEN_COMPUTE, TRACE_PRIMARY_RAYS_RGEN_QUERY
);
ray_pass!(
    /// Reads what the eye's rays meet, the acceleration structures and materials; writes the G-buffer (`position`,
    /// `surface`) and `front`: the picture of all that lies in front of the surface whose light is asked for. Pixels that
    /// [`PlainPrimary`] has finished stay.
    Primary, "trace_primary", TRACE_PRIMARY_RGEN,
    TRACE_PRIMARY_RGEN_COMPUTE, TRACE_PRIMARY_RGEN_QUERY
);
impl Primary {
    /// The same pass, which in addition leaves the points where fog is to be lit.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn with_lit_fog(device: &Device, tracer: Tracer) -> Result<Self, Error> {
        Self::with(device, tracer, &[(fog_keep::LIT_FOG, 1)])
    }
}

pixel_pass!(
    /// What [`Primary`] does, for those pixels that need no ray for it beyond the eye's own: they are finished then.
    PlainPrimary, "trace_primary_simple", TRACE_PRIMARY_RGEN_NO_RAYS
);
impl PlainPrimary {
    /// The same pass, which in addition leaves the points where fog is to be lit.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn with_lit_fog(device: &Device) -> Result<Self, Error> {
        Self::with(device, &[(fog_keep::LIT_FOG, 1)])
    }
}

ray_pass!(
    /// Follows those paths of the eye that were split between a reflection and what lies behind it once more, to the side
    /// that the pixel does not show: writes its albedo and what is in front of it (`other`). Reads the marks of `motion`
    /// besides what the eye's paths read.
    OtherSide, "trace_other_side", TRACE_PRIMARY_RGEN,
    TRACE_PRIMARY_RGEN_COMPUTE, TRACE_PRIMARY_RGEN_QUERY,
    &[(reflect_refract::OTHER_FIELD, 1)]
);

ray_pass!(
    /// Reads the points in fog and the light lists; writes the light there. `size`: cells of the fog.
    FogLight, "trace_fog", TRACE_FOG_LIGHT_RGEN,
    TRACE_FOG_LIGHT_RGEN_COMPUTE, TRACE_FOG_LIGHT_RGEN_QUERY
);
ray_pass!(
    /// Reads the G-buffer and the light lists; writes `direct`.
    Direct, "trace_direct", TRACE_DIRECT_RGEN,
    TRACE_DIRECT_RGEN_COMPUTE, TRACE_DIRECT_RGEN_QUERY
);
impl Direct {
    /// The same pass, whose lights [`Choose`] has chosen.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn of_chosen(device: &Device, tracer: Tracer) -> Result<Self, Error> {
        Self::with(device, tracer, &[(direct::SAMPLING, SAMPLING_LIGHT)])
    }

    /// The pass after that, which adds the light of suns.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn of_suns(device: &Device, tracer: Tracer) -> Result<Self, Error> {
        Self::with(device, tracer, &[(direct::SAMPLING, SAMPLING_SUNS)])
    }

    /// Records the pass for rays in the order that [`Choose`] has left them in.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record_chosen(
        &self,
        rec: &mut Recorder,
        name: &str,
        view: u64,
        size: [u32; 2],
    ) -> Result<(), Error> {
        let [across, down] = size.map(|n| n.div_ceil(RAY_TILE));
        let launch = match self.0 {
            RayPass::Pipeline(_) => [across * down * RAY_TILE * RAY_TILE, 1],
            // the groups of a tile side by side
            RayPass::Compute(_) => {
                let groups = RAY_TILE * RAY_TILE / (COMPUTE_TILE[0] * COMPUTE_TILE[1]);
                [across * groups * COMPUTE_TILE[0], down * COMPUTE_TILE[1]]
            }
        };
        trace(rec, name, &self.0, view, launch)
    }
}

ray_pass!(
    /// Reads the G-buffer and the light lists; writes `indirect`, by paths of any number of bounces: with
    /// `VIEW_SUBSAMPLED_BOUNCE` for one of 2 × 2 pixels, and `size` is half as large then.
    Indirect, "trace_indirect", TRACE_INDIRECT_RGEN,
    TRACE_INDIRECT_RGEN_COMPUTE, TRACE_INDIRECT_RGEN_QUERY
);
impl Indirect {
    /// The same pass for maps with fog, which lies in the way of its rays.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn with_fog(device: &Device, tracer: Tracer) -> Result<Self, Error> {
        Self::with(device, tracer, &[(bounce::HAS_FOG, 1)])
    }
}

ray_pass!(
    /// Reads the G-buffer; writes what the rays of a single bounce meet (`texels`). `size`: half of the view's, of this and
    /// the next two.
    BounceRays, "trace_bounce_rays", TRACE_BOUNCE_RAYS_RGEN,
    TRACE_BOUNCE_RAYS_RGEN_COMPUTE, TRACE_BOUNCE_RAYS_RGEN_QUERY
);
pixel_pass!(
    /// Reads what those rays meet, and the light lists; writes the light that is found there and that which a ray is to be
    /// sent to (`texels`).
    BounceHits, "trace_bounce_hits", TRACE_BOUNCE_HITS_COMP
);
impl BounceHits {
    /// The same pass for maps with fog, which lies in the way of those rays.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn with_fog(device: &Device) -> Result<Self, Error> {
        Self::with(device, &[(bounce::HAS_FOG, 1)])
    }
}
ray_pass!(
    /// Reads that light; writes `indirect` for one of 2 × 2 pixels.
    BounceLights, "trace_bounce_light", TRACE_BOUNCE_LIGHT_RGEN,
    TRACE_BOUNCE_LIGHT_RGEN_COMPUTE, TRACE_BOUNCE_LIGHT_RGEN_QUERY
);

ray_pass!(
    /// Reads the acceleration structures and the flares of the view; writes which of them are seen. `size`: their number
    /// and 1.
    FlareRays, "trace_flares", TRACE_FLARES_RGEN,
    TRACE_FLARES_RGEN_COMPUTE, TRACE_FLARES_RGEN_QUERY
);
pixel_pass!(
    /// Reads the G-buffer and the light lists; writes for each pixel the light that it sends a ray to (`texels`), those of a
    /// tile in the order of where the rays go.
    Choose, "trace_sample_lights", TRACE_SAMPLE_LIGHTS_COMP, RAY_TILE
);
pixel_pass!(
    /// Reads the G-buffer and `indirect`; writes `indirect` where it was not gathered. `size`: half of the view's.
    Fill, "trace_bounce_upsample", TRACE_BOUNCE_UPSAMPLE_COMP
);
pixel_pass!(
    /// Reads the G-buffer, `front`, `direct` and `indirect`; writes `composite`, or the mean in `accumulation`.
    Composite, "trace_composite", TRACE_COMPOSITE_COMP
);
pixel_pass!(
    /// Reads the picture and the exposure; writes the view's rectangle of the target.
    ToneMap, "trace_tonemap", TRACE_TONEMAP_COMP
);

/// Reads the picture; writes the exposure.
pub struct Exposure {
    histogram: ComputePipeline,
    adapt: ComputePipeline,
}

impl Exposure {
    /// Bytes of the state that outlives a frame: the exposure and the histogram.
    pub const STATE_SIZE: u64 = 4 + 4 * 128;

    /// Compiles the pipelines.
    ///
    /// # Errors
    /// The driver refuses a pipeline.
    pub fn new(device: &Device) -> Result<Self, Error> {
        Ok(Self {
            histogram: ComputePipeline::new(
                device,
                "trace_histogram",
                &shaders::TRACE_HISTOGRAM_COMP,
                &[],
            )?,
            adapt: ComputePipeline::new(
                device,
                "trace_exposure",
                &shaders::TRACE_EXPOSURE_COMP,
                &[],
            )?,
        })
    }

    /// Records the pass. `view`: device address of the `TraceView`; `size`: its pixels.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&self, rec: &mut Recorder, view: u64, size: [u32; 2]) -> Result<(), Error> {
        const HISTOGRAM_TILE: u32 = 16;
        let mut pass = rec.pass("trace_exposure", Access::COMPUTE, Access::COMPUTE)?;
        pass.bind_compute(&self.histogram);
        pass.push(&view);
        // one of each 2 × 2 pixels
        let [x, y] = size.map(|s| s.div_ceil(2).div_ceil(HISTOGRAM_TILE));
        pass.dispatch(x, y, 1);
        pass.barrier();
        pass.bind_compute(&self.adapt);
        pass.push(&view);
        pass.dispatch(1, 1, 1);
        Ok(())
    }
}
