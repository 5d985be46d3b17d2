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
use relight::calibrate::Surroundings;
use shaders::trace_types as t;
use shaders::trace_types::constants::NO_IMAGE;
use shaders::types::{Instance, constants::INSTANCE_UNLIT};

use super::accel::Accel;
use super::bake_lights::{BakeLights, BakeSurfaces, BakeSurroundings};
use super::bake_passes::{BakePass, BakePasses, Chunk, MOST_POINTS};
use super::geometry::StaticGeometry;
use super::input::MaterialTable;
use super::lights::{MapLightSource, count};
use super::pass_set::Pipeline;
use super::tracer::Tracer;
use crate::api::RefDef;
use crate::gpu::{Access, ComputePipeline, Device, Error, FrameRing};
use crate::scene::{TracedPart, TracedScene, View};

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

/// Bounds of chunks and slices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most points of a chunk, at most [`MOST_POINTS`].
    pub points: usize,
    /// Most lights or rays of a slice.
    pub slice: u32,
}

/// Sizes of chunks and slices, by the measured duration of submissions.
#[derive(Clone, Copy)]
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
    /// What earlier calls have found out about the sizes of chunks and slices.
    paces: [Option<Pace>; 3],
    /// Bounds of chunks and slices, on which results do not depend.
    pub limits: Limits,
    device: Device,
}

/// What all maps of a device share.
pub struct Shared<'a> {
    /// Its submissions.
    pub ring: &'a mut FrameRing,
    /// Its passes.
    pub passes: &'a mut BakePasses,
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
            paces: [None; 3],
            limits: Limits {
                points: MOST_POINTS,
                slice: u32::MAX,
            },
            device: device.clone(),
        })
    }

    /// Light of lamps and suns, by `samples` shadow rays to each; see [`relight::bake::Gather::direct`].
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn direct(
        &mut self,
        shared: &mut Shared<'_>,
        scene: BakeScene<'_>,
        points: &[Point],
        samples: u32,
        progress: &mut dyn FnMut(f32),
    ) -> Result<Vec<Light>, Error> {
        let (view, all) = self.lights.view(scene.geometry, samples);
        let (passes, chunks) = shared.passes.all()?;
        let work = Work {
            pass: &passes.direct,
            before: Some(&passes.estimate),
            view,
            samples,
            all,
        };
        let structures = (&mut self.accel, &self.scene);
        let pace = self.paces[0].get_or_insert(Pace::new(self.limits));
        let run = Run::new(structures, shared.ring, scene, pace);
        run.all(&work, chunks, points, progress)
    }

    /// Light that surfaces reflect, by `rays` from each point; see [`relight::bake::Gather::reflected`].
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn reflected(
        &mut self,
        shared: &mut Shared<'_>,
        scene: BakeScene<'_>,
        points: &[Point],
        (lit, rays): (&LitSurfaces<'_>, u32),
        progress: &mut dyn FnMut(f32),
    ) -> Result<Vec<Light>, Error> {
        let surfaces = BakeSurfaces::new(&self.device, scene.geometry, lit)?;
        let (passes, chunks) = shared.passes.all()?;
        let work = Work {
            pass: &passes.reflected,
            before: None,
            view: surfaces.view(scene.geometry),
            samples: rays.max(1),
            all: rays.max(1),
        };
        let structures = (&mut self.accel, &self.scene);
        let pace = self.paces[1].get_or_insert(Pace::new(self.limits));
        let run = Run::new(structures, shared.ring, scene, pace);
        run.all(&work, chunks, points, progress)
    }

    /// How near surfaces are; see [`relight::bake::Gather::nearness`].
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn nearness(
        &mut self,
        shared: &mut Shared<'_>,
        scene: BakeScene<'_>,
        points: &[Point],
        around: &Surroundings,
        progress: &mut dyn FnMut(f32),
    ) -> Result<Vec<f32>, Error> {
        let surroundings = BakeSurroundings::new(&self.device, around)?;
        let (passes, chunks) = shared.passes.all()?;
        let rays = count(around.rays.len());
        let work = Work {
            pass: &passes.nearness,
            before: None,
            view: surroundings.view(scene.geometry),
            samples: rays,
            all: rays,
        };
        let structures = (&mut self.accel, &self.scene);
        let pace = self.paces[2].get_or_insert(Pace::new(self.limits));
        let run = Run::new(structures, shared.ring, scene, pace);
        let found = run.all(&work, chunks, points, progress)?;
        Ok(found.iter().map(|near| near.value.x).collect())
    }
}

/// A call in progress.
struct Run<'a> {
    accel: &'a mut Accel,
    view: &'a TracedScene,
    ring: &'a mut FrameRing,
    scene: BakeScene<'a>,
    in_flight: VecDeque<Submitted>,
    /// The newest time at which a submission was known to have ended.
    idle_since: Instant,
    pace: &'a mut Pace,
}

impl<'a> Run<'a> {
    fn new(
        (accel, view): (&'a mut Accel, &'a TracedScene),
        ring: &'a mut FrameRing,
        scene: BakeScene<'a>,
        pace: &'a mut Pace,
    ) -> Self {
        Self {
            accel,
            view,
            ring,
            scene,
            in_flight: VecDeque::new(),
            idle_since: Instant::now(),
            pace,
        }
    }

    fn all(
        mut self,
        work: &Work<'_>,
        chunks: &[Chunk; 2],
        points: &[Point],
        progress: &mut dyn FnMut(f32),
    ) -> Result<Vec<Light>, Error> {
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
        self.pace
            .measured(took, submitted.slice, submitted.is_first, all);
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
