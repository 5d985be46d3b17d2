//! Light at points of a map, without a camera: what `relight bake` writes into lightmaps.
//!
//! Points are uploaded in chunks. A chunk is computed by several submissions, each of a slice of the lists of lights or of
//! the rays, so that none keeps the GPU busy for longer than a fraction of a second, and all its threads have work. Two
//! submissions are in flight. Sums are added in the order of the lights or rays, so that a result does not depend on the
//! division.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use glam::Vec3;
use relight::bake::{Light, LitSurfaces, Point};
use shaders::RayShader;
use shaders::trace_types as t;
use shaders::trace_types::constants::NO_IMAGE;
use shaders::types::{Instance, constants::INSTANCE_UNLIT};

use super::accel::Accel;
use super::bake_lights::{BakeLights, BakeSurfaces};
use super::geometry::StaticGeometry;
use super::input::MaterialTable;
use super::lights::{MapLightSource, count};
use super::pass_set::Pipeline;
use super::tracer::Tracer;
use crate::api::RefDef;
use crate::gpu::{
    Access, Buffer, BufferDesc, BufferUsage, ComputePipeline, Device, Error, FrameRing, Memory,
};
use crate::scene::{TracedPart, TracedScene, View};

/// Most points of a chunk: 24 bytes of each up and 24 down, for two chunks at a time, which have 80 bytes a point.
const MOST_POINTS: usize = 1 << 18;
/// Least and first number of points of a chunk.
const LEAST_POINTS: usize = 1 << 8;
const FIRST_POINTS: usize = 1 << 14;
/// Desired duration of a submission. Drivers reset a device that works at one for about two seconds.
const DESIRED: Duration = Duration::from_millis(60);
/// Duration from which on chunks are halved, if a slice cannot be smaller.
const TOO_LONG: Duration = Duration::from_millis(120);
/// Submissions in flight.
const IN_FLIGHT: usize = 2;

/// What the points of a bake are lit in.
#[derive(Clone, Copy)]
pub struct BakeScene<'a> {
    /// The map's geometry.
    pub geometry: &'a StaticGeometry,
    /// Its materials.
    pub materials: &'a dyn MaterialTable,
}

/// Buffers of a chunk of points.
struct Chunk {
    points: Buffer,
    results: Buffer,
    estimates: Buffer,
    read: Buffer,
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

    fn upload(&self, points: &[Point]) -> Result<(), Error> {
        // rays must be finite
        let is_finite = |point: &&Point| point.position.is_finite() && point.normal.is_finite();
        let points: Vec<t::BakePoint> = (points.iter())
            .map(|point| match Some(point).filter(is_finite) {
                Some(point) => t::BakePoint {
                    position: point.position,
                    normal: point.normal,
                },
                None => t::BakePoint::default(),
            })
            .collect();
        self.points.write(0, bytemuck::cast_slice(&points))
    }

    /// Appends the results of the first `count` points.
    fn take(&self, count: usize, into: &mut Vec<Light>) -> Result<(), Error> {
        let mut results = vec![t::BakeLight::default(); count];
        self.read.read(0, bytemuck::cast_slice_mut(&mut results))?;
        into.extend(results.iter().map(|light| Light {
            value: light.value,
            towards: light.towards,
        }));
        Ok(())
    }
}

/// Bounds of chunks and slices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most points of a chunk, at most [`MOST_POINTS`].
    pub points: usize,
    /// Most lights or rays of a slice.
    pub slice: u32,
}

/// Sizes of chunks and slices, by the measured duration of submissions.
struct Pace {
    limits: Limits,
    /// Points of the next chunk.
    points: usize,
    /// Lights or rays of the first slice of a chunk, and of the next slice.
    first: u32,
    next: u32,
}

impl Pace {
    fn new(limits: Limits) -> Self {
        Self {
            limits,
            points: FIRST_POINTS.min(limits.points),
            first: 1,
            next: 1,
        }
    }

    /// Takes over the duration of a submission of `slice` lights or rays of `all`.
    fn measured(&mut self, took: Duration, slice: u32, is_first: bool, all: u32) {
        let factor = DESIRED.as_secs_f64() / took.as_secs_f64().max(1e-6);
        // lists end within a chunk, so that later slices take less time
        let better =
            (f64::from(slice) * factor.clamp(0.25, 2.0)).clamp(1.0, f64::from(self.limits.slice));
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within the bounds
        let better = better as u32;
        self.next = better;
        if !is_first {
            return;
        }
        self.first = better;
        if slice == 1 && took > TOO_LONG {
            self.points = (self.points / 2).max(LEAST_POINTS.min(self.limits.points));
        } else if slice > 4 || (slice >= all && factor > 2.0) {
            self.points = (self.points * 2).min(self.limits.points);
        }
    }
}

/// A submission in flight.
struct Submitted {
    number: u64,
    at: Instant,
    slice: u32,
    is_first: bool,
}

/// One of the passes, compiled.
struct BakePass {
    name: &'static str,
    pipeline: Pipeline,
}

/// What is computed at points.
struct Work<'a> {
    pass: &'a BakePass,
    /// Runs before the first slice of a chunk.
    before: Option<&'a ComputePipeline>,
    view: t::BakeView,
    samples: u32,
    /// Lights of the longest list, or rays.
    all: u32,
}

/// Computes light at points on the GPU.
pub struct Baker {
    accel: Accel,
    /// The map alone.
    scene: TracedScene,
    lights: BakeLights,
    direct: Option<BakePass>,
    estimate: Option<ComputePipeline>,
    reflected: Option<BakePass>,
    chunks: Option<[Chunk; 2]>,
    /// Bounds of chunks and slices, on which results do not depend.
    pub limits: Limits,
    tracer: Tracer,
    device: Device,
}

fn pass<'a>(
    (device, tracer): (&Device, Tracer),
    kept: &'a mut Option<BakePass>,
    name: &'static str,
    shader: &RayShader,
) -> Result<&'a BakePass, Error> {
    let made = match kept.take() {
        Some(made) => made,
        None => BakePass {
            name,
            pipeline: Pipeline::of_rays(device, tracer, name, shader, &[])?,
        },
    };
    Ok(kept.insert(made))
}

impl Baker {
    /// Uploads the lights of a map; `sky_light`: see [`BakeLights::new`].
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        tracer: Tracer,
        lights: &MapLightSource<'_>,
        sky_light: &[Vec3],
    ) -> Result<Self, Error> {
        let def = RefDef::default();
        Ok(Self {
            accel: Accel::new(device, tracer),
            scene: TracedScene {
                def,
                view: View::new(&def, 4.0, 10000.0),
                time: 0.0,
                instances: vec![Instance {
                    axis: Vec3::AXES,
                    color: [1.0; 4],
                    flags: INSTANCE_UNLIT,
                    ..Instance::default()
                }],
                vertices: Vec::new(),
                indices: Vec::new(),
                meshes: Vec::new(),
                dlights: Vec::new(),
                has_world: true,
                sun: None,
                flares: Vec::new(),
                look: TracedPart::default(),
            },
            lights: BakeLights::new(device, lights, sky_light)?,
            direct: None,
            estimate: None,
            reflected: None,
            chunks: None,
            limits: Limits {
                points: MOST_POINTS,
                slice: u32::MAX,
            },
            tracer,
            device: device.clone(),
        })
    }

    /// Light of lamps and suns, by `samples` shadow rays to each; see [`relight::bake::Gather::direct`].
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn direct(
        &mut self,
        ring: &mut FrameRing,
        scene: BakeScene<'_>,
        points: &[Point],
        samples: u32,
        progress: &mut dyn FnMut(f32),
    ) -> Result<Vec<Light>, Error> {
        let on = (&self.device, self.tracer);
        let shader = &shaders::TRACE_BAKE_DIRECT;
        let (view, all) = self.lights.view(scene.geometry, samples);
        let estimate = match self.estimate.take() {
            Some(made) => made,
            None => {
                let spirv = &shaders::TRACE_BAKE_ESTIMATE_COMP;
                ComputePipeline::new(&self.device, "bake_estimate", spirv, &[])?
            }
        };
        let work = Work {
            pass: pass(on, &mut self.direct, "bake_direct", shader)?,
            before: Some(self.estimate.insert(estimate)),
            view,
            samples,
            all,
        };
        let structures = (&mut self.accel, &self.scene);
        let run = Run::new(&self.device, structures, ring, scene, self.limits);
        run.all(&work, &mut self.chunks, points, progress)
    }

    /// Light that surfaces reflect, by `rays` from each point; see [`relight::bake::Gather::reflected`].
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn reflected(
        &mut self,
        ring: &mut FrameRing,
        scene: BakeScene<'_>,
        points: &[Point],
        lit: &LitSurfaces<'_>,
        rays: u32,
        progress: &mut dyn FnMut(f32),
    ) -> Result<Vec<Light>, Error> {
        let surfaces = BakeSurfaces::new(&self.device, scene.geometry, lit)?;
        let on = (&self.device, self.tracer);
        let shader = &shaders::TRACE_BAKE_REFLECTED;
        let work = Work {
            pass: pass(on, &mut self.reflected, "bake_reflected", shader)?,
            before: None,
            view: surfaces.view(scene.geometry),
            samples: rays.max(1),
            all: rays.max(1),
        };
        let structures = (&mut self.accel, &self.scene);
        let run = Run::new(&self.device, structures, ring, scene, self.limits);
        run.all(&work, &mut self.chunks, points, progress)
    }
}

/// A call in progress.
struct Run<'a> {
    device: &'a Device,
    accel: &'a mut Accel,
    view: &'a TracedScene,
    ring: &'a mut FrameRing,
    scene: BakeScene<'a>,
    in_flight: VecDeque<Submitted>,
    /// The newest time at which a submission was known to have ended.
    idle_since: Instant,
    pace: Pace,
}

impl<'a> Run<'a> {
    fn new(
        device: &'a Device,
        (accel, view): (&'a mut Accel, &'a TracedScene),
        ring: &'a mut FrameRing,
        scene: BakeScene<'a>,
        limits: Limits,
    ) -> Self {
        Self {
            device,
            accel,
            view,
            ring,
            scene,
            in_flight: VecDeque::new(),
            idle_since: Instant::now(),
            pace: Pace::new(limits),
        }
    }

    fn all(
        mut self,
        work: &Work<'_>,
        chunks: &mut Option<[Chunk; 2]>,
        points: &[Point],
        progress: &mut dyn FnMut(f32),
    ) -> Result<Vec<Light>, Error> {
        let chunks = match chunks {
            Some(made) => made,
            none => none.insert([Chunk::new(self.device)?, Chunk::new(self.device)?]),
        };
        let mut found = Vec::with_capacity(points.len());
        if work.all == 0 {
            found.resize(points.len(), Light::default());
            return Ok(found);
        }
        // the last submission of the chunk before, and the number of its points
        let mut before: Option<(u64, usize)> = None;
        let mut first = 0;
        let mut turn = 0;
        while let Some(some) = points.get(first..).filter(|rest| !rest.is_empty()) {
            let some = some.get(..self.pace.points).unwrap_or(some);
            let [this, other] = match turn {
                0 => [&chunks[0], &chunks[1]],
                _ => [&chunks[1], &chunks[0]],
            };
            this.upload(some)?;
            let last = self.chunk(work, this, [first, some.len(), points.len()], progress)?;
            if let Some((submission, count)) = before.replace((last, some.len())) {
                self.wait(submission, work.all)?;
                other.take(count, &mut found)?;
            }
            first += some.len();
            turn = 1 - turn;
        }
        if let Some((submission, count)) = before {
            self.wait(submission, work.all)?;
            chunks[1 - turn].take(count, &mut found)?;
        }
        progress(1.0);
        Ok(found)
    }

    /// Submits the work of a chunk: its first point, and the number of its and of all points. Returns the last submission.
    fn chunk(
        &mut self,
        work: &Work<'_>,
        chunk: &Chunk,
        [first, points, all_points]: [usize; 3],
        progress: &mut dyn FnMut(f32),
    ) -> Result<u64, Error> {
        self.pace.next = self.pace.first;
        let mut from = 0;
        loop {
            while self.in_flight.len() >= IN_FLIGHT {
                self.finish_one(work.all)?;
            }
            let slice = self.pace.next.min(work.all - from);
            let step = t::BakeStep {
                points: chunk.points.address(),
                results: chunk.results.address(),
                estimates: chunk.estimates.address(),
                count: count(points),
                number: count(first),
                first: from,
                end: from + slice,
                samples: work.samples,
                begins: u32::from(from == 0),
                ..t::BakeStep::default()
            };
            let is_first = from == 0;
            from += slice;
            let last = from >= work.all;
            self.submit(work, chunk, step, last)?;
            self.in_flight.push_back(Submitted {
                number: self.ring.newest(),
                at: Instant::now(),
                slice,
                is_first,
            });
            let part = points as f64 * f64::from(from) / f64::from(work.all);
            #[allow(clippy::cast_possible_truncation)]
            progress(((first as f64 + part) / all_points as f64) as f32);
            if last {
                return Ok(self.ring.newest());
            }
        }
    }

    fn submit(
        &mut self,
        work: &Work<'_>,
        chunk: &Chunk,
        step: t::BakeStep,
        last: bool,
    ) -> Result<(), Error> {
        let BakeScene {
            geometry,
            materials,
        } = self.scene;
        let mut rec = self.ring.begin()?;
        let accel = (self.accel).record(&mut rec, self.view, Some(geometry), materials)?;
        let view = t::TraceView {
            materials: materials.buffers(),
            scene: t::SceneView {
                geometries: accel.geometries,
                instances: accel.instances,
                skies: geometry.skies.address(),
                nodes: accel.top.nodes,
                placed: accel.top.placed,
                top_level: accel.top.scene,
                sky_sampler: materials.sky_sampler(),
                ..t::SceneView::default()
            },
            post: t::PostView {
                image_rays: NO_IMAGE,
                image_time: NO_IMAGE,
                ..t::PostView::default()
            },
            ..t::TraceView::default()
        };
        let step = t::BakeStep {
            view: rec.arena().push(&[view])?,
            bake: rec.arena().push(&[work.view])?,
            ..step
        };
        if let Some(pipeline) = work.before.filter(|_| step.begins != 0) {
            let mut pass = rec.pass("bake_estimate", Access::COMPUTE, Access::COMPUTE)?;
            pass.bind_compute(pipeline);
            pass.push(&step);
            pass.dispatch_invocations(step.count, 1);
        }
        match &work.pass.pipeline {
            Pipeline::Rays(pipeline) => {
                let access = Access::RAY_TRACING;
                let mut pass = rec.pass(work.pass.name, access, access)?;
                pass.bind_rays(pipeline);
                pass.push(&step);
                pass.trace_rays(step.count, 1, 1);
            }
            Pipeline::Compute(pipeline) => {
                let access = Access::COMPUTE;
                let mut pass = rec.pass(work.pass.name, access, access)?;
                pass.bind_compute(pipeline);
                pass.push(&step);
                let [x, y, _] = pipeline.local_size();
                pass.dispatch(step.count.div_ceil(x * y), 1, 1);
            }
        }
        if last {
            let size = u64::from(step.count) * size_of::<t::BakeLight>() as u64;
            let mut pass = rec.pass("bake_read", Access::TRANSFER, Access::TRANSFER)?;
            pass.copy_buffer(&chunk.results, 0, &chunk.read, 0, size);
        }
        self.ring.end(rec)
    }

    /// Waits for the oldest submission in flight.
    fn finish_one(&mut self, all: u32) -> Result<(), Error> {
        let Some(submitted) = self.in_flight.pop_front() else {
            return Ok(());
        };
        while !self.ring.wait(submitted.number, Duration::MAX)? {}
        let now = Instant::now();
        let began = submitted.at.max(self.idle_since);
        self.idle_since = now;
        let took = now.saturating_duration_since(began);
        (self.pace).measured(took, submitted.slice, submitted.is_first, all);
        Ok(())
    }

    /// Waits for a submission.
    fn wait(&mut self, submission: u64, all: u32) -> Result<(), Error> {
        while (self.in_flight.front()).is_some_and(|oldest| oldest.number <= submission) {
            self.finish_one(all)?;
        }
        Ok(())
    }
}
