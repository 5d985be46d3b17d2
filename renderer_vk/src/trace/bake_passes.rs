//! The compiled passes of a bake and the buffers of its points, shared by all maps of a device.

use relight::bake::{Light, Point};
use shaders::RayShader;
use shaders::trace_types as t;

use super::pass_set::Pipeline;
use super::tracer::Tracer;
use crate::at_once::{Late, make_all};
use crate::gpu::{Buffer, BufferDesc, BufferUsage, ComputePipeline, Device, Error, Memory};

/// Most points of a chunk: 24 bytes of each up and 24 down, for two chunks at a time, which have 80 bytes a point.
pub const MOST_POINTS: usize = 1 << 18;

/// A pass with rays, compiled.
pub struct BakePass {
    /// Its name in timings.
    pub name: &'static str,
    /// Its variant for the tracer.
    pub pipeline: Pipeline,
}

/// The passes, compiled.
pub struct Compiled {
    /// Light of lamps, suns and skies.
    pub direct: BakePass,
    /// Unshadowed light, before `direct`.
    pub estimate: ComputePipeline,
    /// Light that surfaces reflect.
    pub reflected: BakePass,
    /// How near surfaces are.
    pub nearness: BakePass,
}

impl Compiled {
    fn new(device: &Device, tracer: Tracer) -> Result<Self, Error> {
        let rays = |name: &'static str, shader: &'static RayShader| {
            Late::new(move || {
                let pipeline = Pipeline::of_rays(device, tracer, name, shader, &[])?;
                Ok::<_, Error>(BakePass { name, pipeline })
            })
        };
        let direct = rays("bake_direct", &shaders::TRACE_BAKE_DIRECT);
        let reflected = rays("bake_reflected", &shaders::TRACE_BAKE_REFLECTED);
        let nearness = rays("bake_nearness", &shaders::TRACE_BAKE_NEARNESS);
        let estimate = Late::new(|| {
            let spirv = &shaders::TRACE_BAKE_ESTIMATE_COMP;
            ComputePipeline::new(device, "bake_estimate", spirv, &[])
        });
        make_all(&[&direct, &reflected, &nearness, &estimate]);
        Ok(Self {
            direct: direct.take()?,
            estimate: estimate.take()?,
            reflected: reflected.take()?,
            nearness: nearness.take()?,
        })
    }
}

/// The passes and the buffers of two chunks, made at their first use.
pub struct BakePasses {
    compiled: Option<Compiled>,
    chunks: Option<[Chunk; 2]>,
    tracer: Tracer,
    device: Device,
}

impl BakePasses {
    /// None yet.
    pub fn new(device: &Device, tracer: Tracer) -> Self {
        Self {
            compiled: None,
            chunks: None,
            tracer,
            device: device.clone(),
        }
    }

    /// All of them.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn all(&mut self) -> Result<(&Compiled, &[Chunk; 2]), Error> {
        let device = &self.device;
        let compiled = match self.compiled.take() {
            Some(made) => made,
            None => Compiled::new(device, self.tracer)?,
        };
        let compiled = self.compiled.insert(compiled);
        let chunks = match self.chunks.take() {
            Some(made) => made,
            None => [Chunk::new(device)?, Chunk::new(device)?],
        };
        Ok((compiled, self.chunks.insert(chunks)))
    }
}

/// Buffers of a chunk of points.
pub struct Chunk {
    /// [`BakePoint`](t::BakePoint)s.
    pub points: Buffer,
    /// [`BakeLight`](t::BakeLight)s.
    pub results: Buffer,
    /// [`BakeEstimate`](t::BakeEstimate)s.
    pub estimates: Buffer,
    /// Copy of the results for the CPU.
    pub read: Buffer,
}

impl Chunk {
    fn new(device: &Device) -> Result<Self, Error> {
        let make = |name, bytes: usize, memory| {
            let desc = BufferDesc {
                name,
                size: (MOST_POINTS * bytes) as u64,
                usage: BufferUsage::STORAGE,
                memory,
            };
            Buffer::new(device, &desc)
        };
        let light = size_of::<t::BakeLight>();
        Ok(Self {
            points: make("bake points", size_of::<t::BakePoint>(), Memory::Upload)?,
            results: make("bake results", light, Memory::Device)?,
            estimates: make(
                "bake estimates",
                size_of::<t::BakeEstimate>(),
                Memory::Device,
            )?,
            read: make("bake read-back", light, Memory::Readback)?,
        })
    }

    /// Uploads points.
    ///
    /// # Errors
    /// The memory cannot be written.
    pub fn upload(&self, points: &[Point]) -> Result<(), Error> {
        // rays must be finite
        let is_finite = |point: &&Point| point.position.is_finite() && point.normal.is_finite();
        let points: Vec<t::BakePoint> = (points.iter())
            .map(|point| match Some(point).filter(is_finite) {
                Some(point) => t::BakePoint {
                    position: point.position,
                    normal: point.normal,
                    rank: point.rank,
                },
                None => t::BakePoint::default(),
            })
            .collect();
        self.points.write(0, bytemuck::cast_slice(&points))
    }

    /// Appends the results of the first `count` points.
    ///
    /// # Errors
    /// The memory cannot be read.
    pub fn take(&self, count: usize, into: &mut Vec<Light>) -> Result<(), Error> {
        let mut results = vec![t::BakeLight::default(); count];
        self.read.read(0, bytemuck::cast_slice_mut(&mut results))?;
        into.extend(results.iter().map(|light| Light {
            value: light.value,
            towards: light.towards,
        }));
        Ok(())
    }
}
