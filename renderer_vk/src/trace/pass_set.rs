//! The compiled pipelines of the traced look's passes, one set per device and tracer, shared by all maps and views.

use std::sync::OnceLock;

use shaders::{RayShader, Spirv};

use super::passes::{Pass, Shader, TABLE};
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

impl Pipeline {
    /// The variant of a ray generation shader for a tracer.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn of_rays(
        device: &Device,
        tracer: Tracer,
        name: &str,
        rays: &RayShader,
        constants: &[(u32, u32)],
    ) -> Result<Self, Error> {
        match tracer {
            Tracer::Compute => compute(device, name, rays.compute, constants),
            Tracer::Grid => compute(device, name, rays.grid, constants),
            Tracer::Query => compute(device, name, rays.query, constants),
            Tracer::Pipeline => {
                let any_hit = |any_hit| HitGroup {
                    closest_hit: Some(&shaders::TRACE_HIT_RCHIT),
                    any_hit: Some(any_hit),
                };
                let desc = RayTracingDesc {
                    name,
                    raygen: rays.pipeline,
                    miss: &[&shaders::TRACE_MISS_RMISS, &shaders::TRACE_LAYERS_RMISS],
                    hit: &[
                        any_hit(&shaders::TRACE_TESTED_RAHIT),
                        any_hit(&shaders::TRACE_TRANSLUCENT_RAHIT),
                    ],
                    constants,
                };
                RayTracingPipeline::new(device, &desc).map(Self::Rays)
            }
        }
    }
}

fn compute(
    device: &Device,
    name: &str,
    spirv: &'static Spirv,
    constants: &[(u32, u32)],
) -> Result<Pipeline, Error> {
    ComputePipeline::new(device, name, spirv, constants).map(Pipeline::Compute)
}

/// Pipelines of each pass, by the state of its switches: one bit each.
pub struct PassSet {
    device: Device,
    tracer: Tracer,
    pipelines: Vec<Vec<OnceLock<Pipeline>>>,
}

impl PassSet {
    /// An empty set.
    pub fn new(device: &Device, tracer: Tracer) -> Self {
        Self {
            device: device.clone(),
            tracer,
            pipelines: (TABLE.iter())
                .map(|row| {
                    (0..1 << row.switches.len())
                        .map(|_| OnceLock::new())
                        .collect()
                })
                .collect(),
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

    /// The pipeline of a pass with these switches on (a bit each); compiles it at first use.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn get(&self, pass: Pass, on: usize) -> Result<&Pipeline, Error> {
        let pass = pass.row().shares.unwrap_or(pass);
        let place = self.place(pass, on);
        match place.get() {
            Some(made) => Ok(made),
            None => {
                let made = self.compile(pass, on)?;
                Ok(place.get_or_init(|| made))
            }
        }
    }

    fn place(&self, pass: Pass, on: usize) -> &OnceLock<Pipeline> {
        let states = &self.pipelines[pass as usize];
        &states[on & (states.len() - 1)]
    }

    fn compile(&self, pass: Pass, on: usize) -> Result<Pipeline, Error> {
        let row = pass.row();
        let mut constants = row.constants.to_vec();
        let switches = row.switches.iter().zip(0..);
        constants.extend(switches.map(|((id, _), bit)| (*id, u32::from(on >> bit & 1 != 0))));
        match row.shader {
            Shader::Compute(spirv) => compute(&self.device, row.name, spirv, &constants),
            Shader::Rays(rays) => {
                Pipeline::of_rays(&self.device, self.tracer, row.name, rays, &constants)
            }
        }
    }

    /// Compiles those of these pipelines that are missing, on all cores at once. Takes no memory if none is.
    ///
    /// # Errors
    /// The driver refuses a pipeline.
    pub fn compile_missing(
        &self,
        variants: impl Iterator<Item = (Pass, usize)>,
    ) -> Result<(), Error> {
        let is_missing = |&(pass, on): &(Pass, usize)| {
            let place = self.place(pass, on);
            place.get().is_none()
        };
        let jobs: Vec<_> = variants
            .filter(is_missing)
            .map(|(pass, on)| Late::new(move || self.get(pass, on).map(|_| ())))
            .collect();
        if jobs.is_empty() {
            return Ok(());
        }
        if self.device.info().software {
            // Mesa compiles in the first frame that runs a shader, and not here
            log::info!(
                "the first traced picture can take minutes with this driver, which compiles {} shaders for it and keeps them; \
                 nothing moves meanwhile",
                jobs.len()
            );
        }
        make_all(&jobs.iter().map(|job| job as &dyn Make).collect::<Vec<_>>());
        jobs.into_iter().try_for_each(Late::take)
    }
}
