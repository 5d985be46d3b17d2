//! The acceleration structures of a frame: the top level over the map and everything that moves.
//!
//! Models are instances of structures that are kept between frames (`shapes`). Polygons, sprites and beams live for one
//! frame: the CPU transforms them to world space, and those of equal visibility and kind share one structure, built
//! each frame. All builds of a frame are one batch.

mod kept;
mod own;
mod placements;

use std::time::Instant;

use glam::{Mat3, Vec3};
use shaders::trace_types::constants::NO_INSTANCE;
use shaders::trace_types::{BvhInstance, GeometryRecord};
use support::slice;

use super::feedback::{Feedback, State};
use super::geometry::{StaticGeometry, Structure};
use super::input::{Kind, MaterialTable};
use super::parts::{Parts, Seen, Slot, axes};
use super::shapes::{Bottom, Shapes, Use};
use super::tracer::Tracer;
use crate::gpu::{
    self, Access, Blas, BlasBuild, BlasFlags, BlasGeometry, Device, Error, Recorder, Tlas,
};
use crate::scene::TracedScene;
use crate::statistics::MovingCost;

use kept::Kept;
pub use placements::DrawnGeometry;
use placements::{Part, Placement, Placements};

/// Hit group: solids report the nearest hit, translucent layers search in their any-hit shader.
fn hit_group(kind: Kind) -> u32 {
    u32::from(kind == Kind::Translucent)
}

/// A top level, as shaders address it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Top {
    /// Bindless index of the driver's structure.
    pub scene: u32,
    /// Device address of the nodes of our own; 0: it is empty.
    pub nodes: u64,
    /// Device address of the `BvhInstance`s, in leaf order.
    pub placed: u64,
}

/// Acceleration structures and geometry of one frame, as shaders address them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelOutput {
    /// The top level.
    pub top: Top,
    /// A top level of models that rest or move, without the map; only of an [`Accel::with_models`].
    pub models: Top,
    /// Device address of the `GeometryRecord`s.
    pub geometries: u64,
    /// Device address of the view's `Instance`s.
    pub instances: u64,
    /// Device address of the view's `Vertex`es.
    pub vertices: u64,
    /// Some geometry is visible to camera rays alone.
    pub first_person: bool,
}

/// Bytes of the acceleration structures, by content. Memory used for one frame is that of the last frame.
#[cfg(test)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelMemory {
    /// The map, with its triangle records.
    pub map: u64,
    /// Models of constant shape, each counted once.
    pub models: u64,
    /// Structures that are refitted each frame.
    pub animated: u64,
    /// Triangle records of models.
    pub skins: u64,
    /// Structures that are built each frame.
    pub changing: u64,
    /// The top level.
    pub top: u64,
}

/// The driver's structures.
struct DriverStructures {
    /// Rebuilt each frame, one per slot.
    slots: Vec<Blas>,
    tlas: Tlas,
    /// Input of the last build of `tlas`: serial of the map's geometry, and all instances.
    placed: Option<(u64, Vec<gpu::Instance>)>,
    /// The same while the GPU lists the instances.
    kept: Option<(u64, Kept<[u32; 16]>)>,
    /// The models alone.
    models: Option<Tlas>,
}

impl DriverStructures {
    /// Both top levels.
    fn tops(&self) -> [Top; 2] {
        let top = |tlas: Option<&Tlas>| Top {
            scene: tlas.map_or(gpu::NO_INDEX, Tlas::index),
            ..Top::default()
        };
        [top(Some(&self.tlas)), top(self.models.as_ref())]
    }
}

/// Builds the structures of each frame in persistent storage.
pub struct Accel {
    parts: Parts,
    shapes: Shapes,
    /// Only with the tracers that use them.
    driver: Option<DriverStructures>,
    /// The instances of our own top level, while the GPU lists them.
    own_kept: Option<Kept<BvhInstance>>,
    /// Bytes of our own structures of the last frame: bottom levels, top level.
    own_bytes: [u64; 2],
    /// Makes a top level of the models alone, too.
    has_models: bool,
    /// Sums over frames.
    cost: MovingCost,
    /// The geometry records of the last view.
    drawn: Vec<DrawnGeometry>,
}

impl Accel {
    /// Makes empty storage.
    pub fn new(device: &Device, tracer: Tracer) -> Self {
        let parts = Parts::default();
        let flags = BlasFlags {
            fast_build: true,
            ..BlasFlags::default()
        };
        let blas = |s: &Slot| Blas::new(device, &format!("trace {:?} {:?}", s.seen, s.kind), flags);
        Self {
            driver: (!tracer.has_own_structures()).then(|| DriverStructures {
                slots: parts.slots.iter().map(blas).collect(),
                tlas: Tlas::new(device, "trace scene"),
                placed: None,
                kept: None,
                models: None,
            }),
            parts,
            shapes: Shapes::new(device, tracer),
            own_kept: None,
            own_bytes: [0; 2],
            has_models: false,
            cost: MovingCost::default(),
            drawn: Vec::new(),
        }
    }

    /// The geometry of the last view, a draw for each of its records.
    pub fn drawn(&self) -> &[DrawnGeometry] {
        &self.drawn
    }

    /// Makes empty storage, which has a second top level of the models alone.
    pub fn with_models(device: &Device, tracer: Tracer) -> Self {
        let mut made = Self::new(device, tracer);
        made.has_models = true;
        if let Some(driver) = &mut made.driver {
            driver.models = Some(Tlas::new(device, "trace models"));
        }
        made
    }

    /// Bytes of all structures but the map's.
    #[cfg(test)]
    pub fn memory(&self) -> AccelMemory {
        let shapes = self.shapes.memory();
        let [changing, top] = self.driver.as_ref().map_or(self.own_bytes, |driver| {
            let slots = driver.slots.iter().map(Blas::size).sum();
            [slots, driver.tlas.size()]
        });
        AccelMemory {
            map: 0,
            models: shapes.rigid,
            animated: shapes.animated,
            skins: shapes.skins,
            changing,
            top,
        }
    }

    /// Number of kept structures: of constant shape, and refitted ones.
    #[cfg(test)]
    pub fn counts(&self) -> [usize; 2] {
        self.shapes.counts()
    }

    /// Sums over all frames.
    pub fn cost(&self) -> MovingCost {
        self.cost
    }

    /// Builds the structures of a view. `geometry`: the map, if the view shows it.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn record(
        &mut self,
        rec: &mut Recorder,
        view: &TracedScene,
        geometry: Option<&StaticGeometry>,
        materials: &dyn MaterialTable,
    ) -> Result<AccelOutput, Error> {
        self.record_fed(rec, view, geometry, materials, &mut Feedback::default())
    }

    /// As [`record`](Self::record), of bodies in the states of `feedback`, and lists their geometries there. While it
    /// counts, the GPU lists the instances of the top level: the CPU writes those that have changed.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn record_fed(
        &mut self,
        rec: &mut Recorder,
        view: &TracedScene,
        geometry: Option<&StaticGeometry>,
        materials: &dyn MaterialTable,
        feedback: &mut Feedback,
    ) -> Result<AccelOutput, Error> {
        let begin = Instant::now();
        self.parts.collect(view, materials);
        self.shapes.begin_view();
        let vertices = rec.arena().push(&view.vertices)?;
        let mut output = AccelOutput {
            instances: rec.arena().push(&view.instances)?,
            vertices,
            first_person: self.shows_first_person(),
            ..AccelOutput::default()
        };
        let mut placements = Placements::default();
        if let Some(geometry) = geometry {
            placements.add_map(view, geometry);
        }
        feedback.begin_geometries(placements.records.len());
        for (index, part) in self.parts.parts.iter().enumerate() {
            let state = feedback.state(part.instance);
            if state == State::Inactive {
                self.cost.left_out_parts += u64::from(part.animated);
                // the instances after it keep their records
                placements.skip();
                feedback.skip_geometry();
                continue;
            }
            let Some(instance) = slice::get(&view.instances, part.instance as usize) else {
                continue;
            };
            let pose = Use {
                body: feedback.body(part.instance),
                refit: state == State::Active,
            };
            let prepared = self
                .shapes
                .prepare(view, &self.parts, part, vertices, pose)?;
            self.cost.parts += u64::from(part.animated);
            feedback.add_geometry(part.instance, part.animated);
            let record = GeometryRecord {
                triangles: prepared.triangles,
                vertices: prepared.vertices,
                instance: part.instance,
                kind: part.kind.index(),
            };
            let mask = part.seen.mask(part.kind);
            let kept = Part::Kept(index, prepared);
            let place = (axes(instance), instance.origin);
            let records = [(record, part.kind, prepared.count)];
            placements.add(kept, place, mask, part.kind, records);
            if let Some(placed) = placements.placed.last_mut() {
                placed.of_model = part.of_model;
            }
        }
        self.shapes.fit(rec, view)?;
        for (index, slot) in self.parts.slots.iter().enumerate() {
            if slot.triangles.is_empty() {
                continue;
            }
            let record = GeometryRecord {
                triangles: rec.arena().push(&slot.triangles)?,
                vertices,
                instance: NO_INSTANCE,
                kind: slot.kind.index(),
            };
            let mask = slot.seen.mask(slot.kind);
            let place = (Mat3::IDENTITY, Vec3::ZERO);
            let count = u32::try_from(slot.triangles.len()).unwrap_or(u32::MAX);
            let records = [(record, slot.kind, count)];
            placements.add(Part::Slot(index), place, mask, slot.kind, records);
        }
        let Placements {
            placed,
            records,
            drawn,
        } = placements;
        self.drawn = drawn;
        output.geometries = rec.arena().push(&records)?;
        let fed = feedback.is_on();
        if self.driver.is_some() {
            let serial = geometry.map_or(0, |g| g.serial);
            [output.top, output.models] = self.build_driver(rec, serial, &placed, fed)?;
        } else {
            [output.top, output.models] = self.build_own(rec, &placed, fed)?;
        }
        self.cost.instances += placed.len() as u64;
        self.cost.frames += 1;
        self.cost.refits = self.shapes.refits();
        self.cost.cpu_ms += begin.elapsed().as_secs_f64() * 1e3;
        Ok(output)
    }

    /// Whether geometry that stops rays is visible to camera rays alone.
    fn shows_first_person(&self) -> bool {
        let solid = |seen, kind| seen == Seen::FirstPerson && kind != Kind::Translucent;
        let parts = self.parts.parts.iter();
        let mut slots = self.parts.slots.iter();
        slots.any(|s| solid(s.seen, s.kind) && !s.triangles.is_empty())
            || parts.into_iter().any(|p| solid(p.seen, p.kind))
    }

    /// Builds the driver's bottom levels in one batch, then the top level and that of models. `serial`: that of the map's
    /// geometry; `fed`: rays are counted.
    fn build_driver(
        &mut self,
        rec: &mut Recorder,
        serial: u64,
        placed: &[Placement<'_>],
        fed: bool,
    ) -> Result<[Top; 2], Error> {
        let Some(driver) = &mut self.driver else {
            return Ok(Default::default());
        };
        let positions = &self.parts.positions;
        let vertex_address = rec.arena().push(positions)?;
        let mut geometries = Vec::with_capacity(self.parts.slots.len());
        for slot in &self.parts.slots {
            geometries.push([BlasGeometry {
                vertex_address,
                vertex_stride: size_of::<Vec3>() as u64,
                max_vertex: u32::try_from(positions.len().saturating_sub(1)).unwrap_or(u32::MAX),
                index_address: rec.arena().push(&slot.indices)?,
                triangle_count: u32::try_from(slot.triangles.len()).unwrap_or(u32::MAX),
                opaque: slot.kind.is_untested(),
                no_duplicate_any_hit: slot.kind == Kind::Translucent,
            }]);
        }
        let changing: Vec<BlasBuild<'_>> = (driver.slots.iter_mut().zip(&geometries))
            .filter(|(_, geometries)| geometries[0].triangle_count > 0)
            .map(|(blas, geometries)| BlasBuild {
                blas,
                geometries,
                refit: false,
            })
            .collect();
        let rests = changing.is_empty() && !self.shapes.has_work();
        if !rests {
            let mut pass = rec.pass("trace_accel", Access::ACCEL_BUILD, Access::ACCEL_BUILD)?;
            self.shapes.build(&mut pass, changing)?;
        }
        let address = |part: &Part<'_>| match part {
            Part::Static(Structure::Driver(blas)) => blas.address(),
            Part::Slot(index) => driver.slots.get(*index).map_or(0, Blas::address),
            Part::Kept(index, prepared) => {
                let part = self.parts.parts.get(*index);
                match part.and_then(|part| self.shapes.bottom(&self.parts, part, prepared)) {
                    Some(Bottom::Driver(address)) => address,
                    Some(Bottom::Own(_)) | None => 0,
                }
            }
            Part::Static(Structure::Own(_) | Structure::Grid(_)) => 0,
        };
        let instance = |p: &Placement<'_>| gpu::Instance {
            transform: rows(p.axis, p.origin),
            custom_index: p.record,
            mask: p.mask,
            sbt_offset: hit_group(p.kind),
            cull_disable: true,
            flip_facing: false,
            force_opaque: None,
            blas: address(&p.part),
        };
        // models have a top level of their own only where nothing is counted
        if fed && driver.models.is_none() {
            driver.placed = None;
            let (of, mut kept) = match driver.kept.take() {
                Some((of, kept)) => (Some(of), kept),
                None => (None, Kept::new(rec.device())?),
            };
            let differs = kept.take(placed.iter().map(|p| (p.record, instance(p).words())));
            if differs || !rests || of != Some(serial) {
                let before = kept.written;
                let list = kept.record(rec)?;
                self.cost.written += kept.written - before;
                let mut pass = rec.pass("trace_scene", Access::ACCEL_BUILD, Access::ACCEL_BUILD)?;
                pass.build_tlas_of(&mut driver.tlas, list, kept.len())?;
            }
            driver.kept = Some((serial, kept));
            return Ok(driver.tops());
        }
        driver.kept = None;
        let instances: Vec<gpu::Instance> = placed.iter().map(instance).collect();
        // equal instances over the same map: the last top level is still valid
        let same = |(of, built): &(u64, Vec<gpu::Instance>)| *of == serial && *built == instances;
        if rests && driver.placed.as_ref().is_some_and(same) {
            return Ok(driver.tops());
        }
        self.cost.written += instances.len() as u64;
        let mut pass = rec.pass("trace_scene", Access::ACCEL_BUILD, Access::ACCEL_BUILD)?;
        driver.placed = None;
        pass.build_tlas(&mut driver.tlas, &instances)?;
        if let Some(models) = &mut driver.models {
            let of_models = instances.iter().zip(placed).filter(|(_, p)| p.of_model);
            let of_models: Vec<gpu::Instance> = of_models.map(|(instance, _)| *instance).collect();
            pass.build_tlas(models, &of_models)?;
        }
        driver.placed = Some((serial, instances));
        Ok(driver.tops())
    }
}

/// Rows of an instance's transform.
fn rows(axis: Mat3, o: Vec3) -> [[f32; 4]; 3] {
    let (x, y, z) = (axis.x_axis, axis.y_axis, axis.z_axis);
    [
        [x.x, y.x, z.x, o.x],
        [x.y, y.y, z.y, o.y],
        [x.z, y.z, z.z, o.z],
    ]
}
