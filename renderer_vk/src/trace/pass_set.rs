//! The compiled pipelines of the traced look's passes, one set per device and tracer, shared by all maps and views.

use std::sync::OnceLock;
use std::time::Instant;

use super::passes::{Pass, Shader, Switch, TABLE};
use super::tracer::Tracer;
use crate::at_once::{Late, Make, make_all};
use crate::gpu::{ComputePipeline, Device, Error, HitGroup, RayTracingDesc, RayTracingPipeline};

/// A compiled variant of a pass.
pub enum Pipeline {
    /// A ray tracing pipeline.
    Rays(RayTracingPipeline),
    /// A compute shader, which may trace rays itself.
    Compute(ComputePipeline),
}

/// Pipelines of each pass, with its switch off and on.
pub struct PassSet {
    device: Device,
    tracer: Tracer,
    pipelines: Vec<[OnceLock<Pipeline>; 2]>,
}

/// Passes of denoised pictures with one bounce, in descending order of compile time.
const AHEAD: [Pass; 27] = [
    Pass::Primary,
    Pass::OtherSide,
    Pass::BounceShade,
    Pass::Temporal,
    Pass::PrimarySimple,
    Pass::SampledDirect,
    Pass::Suns,
    Pass::BounceLight,
    Pass::BounceRays,
    Pass::PrimaryRays,
    Pass::SampleLights,
    Pass::WaveletFirst,
    Pass::WaveletSecond,
    Pass::WaveletLast,
    Pass::Antialias,
    Pass::Composite,
    Pass::Gradient,
    Pass::GradientReproject,
    Pass::GradientSample,
    Pass::GradientWide,
    Pass::Histogram,
    Pass::Exposure,
    Pass::BounceUpsample,
    Pass::ToneMap,
    Pass::SparseTemporal,
    Pass::SparseFirst,
    Pass::SparseLast,
];
/// Passes that only maps with fog run.
const FOG_AHEAD: [Pass; 2] = [Pass::FogLight, Pass::FogFilter];

impl PassSet {
    /// An empty set.
    pub fn new(device: &Device, tracer: Tracer) -> Self {
        Self {
            device: device.clone(),
            tracer,
            pipelines: TABLE.iter().map(|_| Default::default()).collect(),
        }
    }

    /// The device that the passes run on.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// The tracer of the passes.
    pub fn tracer(&self) -> Tracer {
        self.tracer
    }

    /// The pipeline of a pass with its switch `on` or off; compiles it at first use.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn get(&self, pass: Pass, on: bool) -> Result<&Pipeline, Error> {
        let place = &self.pipelines[pass as usize][usize::from(on)];
        match place.get() {
            Some(made) => Ok(made),
            None => {
                let made = self.compile(pass, on)?;
                Ok(place.get_or_init(|| made))
            }
        }
    }

    fn compile(&self, pass: Pass, on: bool) -> Result<Pipeline, Error> {
        let row = pass.row();
        let mut constants = row.constants.to_vec();
        constants.extend(row.switch.map(|(id, _)| (id, u32::from(on))));
        let compute = |spirv| {
            let made = ComputePipeline::new(&self.device, row.name, spirv, &constants);
            made.map(Pipeline::Compute)
        };
        match (row.shader, self.tracer) {
            (Shader::Compute(spirv), _) => compute(spirv),
            (Shader::Rays(rays), Tracer::Compute) => compute(rays.compute),
            (Shader::Rays(rays), Tracer::Query) => compute(rays.query),
            (Shader::Rays(rays), Tracer::Pipeline) => {
                let any_hit = |any_hit| HitGroup {
                    closest_hit: Some(&shaders::TRACE_HIT_RCHIT),
                    any_hit: Some(any_hit),
                };
                let desc = RayTracingDesc {
                    name: row.name,
                    raygen: rays.pipeline,
                    miss: &[&shaders::TRACE_MISS_RMISS, &shaders::TRACE_LAYERS_RMISS],
                    hit: &[
                        any_hit(&shaders::TRACE_TESTED_RAHIT),
                        any_hit(&shaders::TRACE_TRANSLUCENT_RAHIT),
                    ],
                    constants: &constants,
                };
                RayTracingPipeline::new(&self.device, &desc).map(Pipeline::Rays)
            }
        }
    }

    /// Compiles missing pipelines of denoised pictures with one bounce, on all cores at once. `has_fog`: the map has
    /// fog; if this is unknown, fog passes are compiled when fog comes into view.
    ///
    /// # Errors
    /// The driver refuses a pipeline.
    pub fn compile_ahead(&self, has_fog: bool) -> Result<(), Error> {
        let fog: &[Pass] = if has_fog { &FOG_AHEAD } else { &[] };
        let variants = AHEAD.iter().chain(fog).flat_map(|&pass| {
            let states: &[bool] = match pass.row().switch {
                None => &[false],
                Some((_, Switch::MapFog)) if has_fog => &[true],
                Some((_, Switch::LitFog | Switch::MapFog)) if !has_fog => &[false],
                Some(_) => &[true, false],
            };
            states.iter().map(move |&on| (pass, on))
        });
        let jobs: Vec<_> = variants
            .map(|(pass, on)| Late::new(move || self.get(pass, on).map(|_| ())))
            .collect();
        let begin = Instant::now();
        if self.device.info().software {
            log::info!(
                "preparing {} shaders of the traced look: minutes the first time, for a driver that draws on the processor",
                jobs.len()
            );
        }
        make_all(&jobs.iter().map(|job| job as &dyn Make).collect::<Vec<_>>());
        let seconds = begin.elapsed().as_secs_f32();
        if seconds > 2.0 {
            log::info!(
                "prepared the shaders of the traced look in {seconds:.0} s; the driver keeps them"
            );
        }
        jobs.into_iter().try_for_each(Late::take)
    }
}
