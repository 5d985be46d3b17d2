//! Feedback of rays on the structures of bodies (`rt_hitFeedback`), after the thesis of LiPaC, section 3.3.2.
//!
//! Rays count their hits of each body and the boxes of a coarse grid that they pass (`shaders/trace/feedback.glsl`). The
//! counts are read when the frame has finished, without a wait. A body that few rays hit is omitted: it keeps the
//! structure of an earlier frame. Bodies in boxes that few rays pass are inactive: they are left out of the top level.
//! A body that enters the frustum, or appears in it, is active at once, with its boxes.
//!
//! A body is an instance of an entity. [`Motion`](super::motion::Motion) matches the entities of two frames.

mod activity;
mod boxes;
mod counts;

use glam::{Vec3, Vec4};
use shaders::trace_types::FeedbackView;
use shaders::trace_types::constants::FEEDBACK_RAYS;
use support::Aabb;
use support::slice;

use crate::gpu::{Error, Recorder};
use crate::scene::{DynamicMesh, Shape, TracedScene, ViewEntity, finite_bounds};
use crate::settings::{HitFeedback, Settings};
use crate::statistics::MovingCost;
use crate::world::outside;

use super::parts::axes;
use activity::{Activity, Thresholds};
use boxes::Boxes;
use counts::Counts;

/// Diagonal over distance of the smallest body that becomes active when it enters the frustum.
const SMALL: f32 = 1.0 / 1000.0;
/// Most boxes of a body that may be left out.
const MOST_BOXES: usize = 64;

/// What the structures of a body need in this frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// The shape of this frame.
    #[default]
    Active,
    /// That of an earlier frame.
    Omitted,
    /// It is left out.
    Inactive,
}

/// A body.
#[derive(Clone, Copy, Debug)]
struct Body {
    /// Unlike that of any other body.
    id: u32,
    /// Number of the last frame with it.
    seen: u64,
    activity: Activity,
    /// Whether it was in the frustum in that frame.
    in_sight: bool,
    /// Whether that frame left it out.
    left_out: bool,
    /// Hits of the frame that is being read; `None`: no geometry of it was read.
    hits: Option<u32>,
}

/// Geometry whose hits are counted.
#[derive(Clone, Copy, Debug)]
struct Counted {
    body: u32,
    id: u32,
    animated: bool,
}

/// What a frame counts.
struct Frame {
    geometries: Vec<Counted>,
    thresholds: Thresholds,
    /// Serial of the boxes.
    boxes: u64,
}

/// A body of this frame with its bounds.
struct Placed {
    instance: usize,
    body: u32,
    bounds: Aabb,
    enters: bool,
}

/// The state between frames.
#[derive(Default)]
pub struct Feedback {
    mode: HitFeedback,
    frame: u64,
    ids: u32,
    bodies: Vec<Body>,
    free: Vec<u32>,
    /// Body of each instance; `NONE`.
    of_instance: Vec<u32>,
    /// First instance and number of them, of each entity of the last frame.
    entities: Vec<(u32, u32)>,
    states: Vec<State>,
    placed: Vec<Placed>,
    boxes: Boxes,
    counts: Counts<Frame>,
    /// Index of the first counted geometry, and all of them.
    first: u32,
    geometries: Vec<Counted>,
    thresholds: Thresholds,
    /// Sums over frames.
    pub cost: MovingCost,
}

/// Whether frames with these settings count rays. Frames of a mean must not depend on earlier ones.
pub fn in_use(settings: &Settings) -> bool {
    settings.rt_hit_feedback != HitFeedback::None && !settings.rt_accumulate
}

/// No body.
const NONE: u32 = u32::MAX;

impl Feedback {
    /// Whether rays are counted.
    pub fn is_on(&self) -> bool {
        self.mode != HitFeedback::None
    }

    /// Begins a view of so many pixels. `last`: for each entity, its index in the last frame.
    ///
    /// # Errors
    /// The device is lost.
    pub fn begin(
        &mut self,
        rec: &Recorder,
        view: &TracedScene,
        settings: &Settings,
        pixels: u32,
        last: &[Option<usize>],
    ) -> Result<(), Error> {
        let mode = match in_use(settings) {
            true => settings.rt_hit_feedback,
            false => HitFeedback::None,
        };
        if mode == HitFeedback::None {
            if self.is_on() {
                self.forget();
            }
            return Ok(());
        }
        self.mode = mode;
        self.frame += 1;
        self.thresholds = Thresholds::of_pixels(pixels);
        while let Some((frame, counts)) = self.counts.next(rec)? {
            self.take(&frame, &counts);
        }
        self.follow(view, last);
        self.place(view);
        self.decide(view);
        Ok(())
    }

    /// Forgets all but the cost.
    pub fn forget(&mut self) {
        *self = Self {
            cost: self.cost,
            ids: self.ids,
            ..Self::default()
        };
    }

    /// State of an instance.
    pub fn state(&self, instance: u32) -> State {
        // none is set without feedback
        let state = self.states.get(instance as usize).copied();
        state.unwrap_or_default()
    }

    /// Number of the body of an instance, which no other body has.
    pub fn body(&self, instance: u32) -> Option<u32> {
        Some(self.body_of(instance)?.id)
    }

    fn body_of(&self, instance: u32) -> Option<&Body> {
        let body = self.of_instance.get(instance as usize)?;
        self.bodies.get(*body as usize)
    }

    /// Takes the counters of a finished frame.
    fn take(&mut self, frame: &Frame, counts: &[u32]) {
        let (hits, boxes) = counts.split_at(frame.geometries.len().min(counts.len()));
        for (geometry, &hits) in frame.geometries.iter().zip(hits) {
            if geometry.animated {
                self.cost.counted += 1;
                self.cost.unmet += u64::from(hits == 0);
            }
            if let Some(body) = self.bodies.get_mut(geometry.body as usize)
                && body.id == geometry.id
            {
                body.hits = Some(body.hits.unwrap_or(0).saturating_add(hits));
            }
        }
        for geometry in &frame.geometries {
            if let Some(body) = self.bodies.get_mut(geometry.body as usize)
                && let Some(hits) = body.hits.take()
            {
                #[allow(clippy::cast_precision_loss)] // compared with a threshold
                body.activity.observe(hits as f32, frame.thresholds);
            }
        }
        if frame.boxes == self.boxes.serial {
            #[allow(clippy::cast_precision_loss)] // compared with a threshold
            let rays = boxes.iter().map(|&n| n as f32 * FEEDBACK_RAYS as f32);
            self.boxes.observe(rays, frame.thresholds);
        }
    }

    /// Assigns the bodies of the last frame to the instances of this one.
    fn follow(&mut self, view: &TracedScene, last: &[Option<usize>]) {
        let before = std::mem::take(&mut self.of_instance);
        self.of_instance.resize(view.instances.len(), NONE);
        let mut entities = Vec::with_capacity(view.look.entities.len());
        for (entity, last) in view.look.entities.iter().zip(last) {
            entities.push((entity.first_instance, entity.instance_count));
            let old = last.and_then(|i| self.entities.get(i)).copied();
            for i in 0..entity.instance_count {
                let old = old.filter(|(_, count)| i < *count);
                let old = old.and_then(|(first, _)| before.get(first.saturating_add(i) as usize));
                let body = match old.copied().filter(|body| *body != NONE) {
                    Some(body) => body,
                    None => self.new_body(),
                };
                let instance = entity.first_instance.saturating_add(i) as usize;
                if let (Some(slot), Some(found)) = (
                    self.of_instance.get_mut(instance),
                    self.bodies.get_mut(body as usize),
                ) {
                    *slot = body;
                    found.seen = self.frame;
                }
            }
        }
        for body in before.into_iter().filter(|body| *body != NONE) {
            let gone = |b: &Body| b.seen != self.frame;
            if self.bodies.get(body as usize).is_some_and(gone) {
                // counts on their way no longer fit
                self.bodies[body as usize].id = NONE;
                self.free.push(body);
            }
        }
        self.entities = entities;
    }

    fn new_body(&mut self) -> u32 {
        // never `NONE`
        self.ids = (self.ids + 1) % NONE;
        let body = Body {
            id: self.ids,
            seen: 0,
            activity: Activity::ACTIVE,
            in_sight: false,
            left_out: false,
            hits: None,
        };
        match self.free.pop() {
            Some(free) => {
                self.bodies[free as usize] = body;
                free
            }
            None => {
                self.bodies.push(body);
                u32::try_from(self.bodies.len() - 1).unwrap_or(NONE)
            }
        }
    }

    /// Bounds of the bodies, and whether they enter the frustum.
    fn place(&mut self, view: &TracedScene) {
        self.placed.clear();
        let frustum = view.view.frustum();
        for entity in &view.look.entities {
            for i in 0..entity.instance_count {
                let instance = entity.first_instance.saturating_add(i);
                let (Some(&body), Some(placed)) = (
                    slice::get(&self.of_instance, instance as usize),
                    slice::get(&view.instances, instance as usize),
                ) else {
                    continue;
                };
                let Some(known) = self.bodies.get_mut(body as usize) else {
                    continue;
                };
                let local = local_bounds(view, entity, instance);
                if local.is_empty() {
                    continue; // without such a mesh
                }
                let axes = axes(placed);
                let corners = local.corners().map(|c| axes * c + placed.origin);
                let bounds = Aabb::of(corners);
                let seen = is_in_sight(&bounds, view.view.origin, &frustum);
                self.placed.push(Placed {
                    instance: instance as usize,
                    body,
                    bounds,
                    enters: seen && !known.in_sight,
                });
                known.in_sight = seen;
            }
        }
    }

    /// Decides the states of all instances.
    fn decide(&mut self, view: &TracedScene) {
        self.states.clear();
        self.states.resize(view.instances.len(), State::Active);
        let all = self.placed.iter().map(|p| p.bounds);
        self.boxes
            .begin(all.fold(Aabb::EMPTY, |sum, bounds| sum.union(bounds)));
        for placed in &self.placed {
            let Some(body) = self.bodies.get_mut(placed.body as usize) else {
                continue;
            };
            let places = self.boxes.of(&placed.bounds);
            let fits = self.boxes.of(&placed.bounds).nth(MOST_BOXES).is_none();
            let in_active = !fits || self.boxes.are_active(places, placed.enters);
            if placed.enters || in_active && body.left_out {
                body.activity = Activity::ACTIVE;
            }
            body.left_out = !in_active;
            let state = match (in_active, body.activity.is_active()) {
                (false, _) => State::Inactive,
                (true, false) => State::Omitted,
                (true, true) => State::Active,
            };
            if self.mode == HitFeedback::Acts
                && let Some(slot) = self.states.get_mut(placed.instance)
            {
                *slot = state;
            }
        }
        self.cost.bodies += self.placed.len() as u64;
        let left_out = self.states.iter().filter(|s| **s == State::Inactive);
        self.cost.left_out += left_out.count() as u64;
    }

    /// Begins the list of counted geometries; `first`: index of the first.
    pub fn begin_geometries(&mut self, first: usize) {
        self.first = u32::try_from(first).unwrap_or(u32::MAX);
        self.geometries.clear();
    }

    /// Adds the next geometry.
    pub fn add_geometry(&mut self, instance: u32, animated: bool) {
        let body = self.of_instance.get(instance as usize).copied();
        let body = body.unwrap_or(NONE);
        let id = self.bodies.get(body as usize).map_or(NONE, |b| b.id);
        self.geometries.push(Counted { body, id, animated });
    }

    /// Adds the geometry of a part that is left out.
    pub fn skip_geometry(&mut self) {
        let (body, id) = (NONE, NONE);
        self.geometries.push(Counted {
            body,
            id,
            animated: false,
        });
    }

    fn counters(&self) -> usize {
        self.geometries.len() + self.boxes.len()
    }

    /// Clears the counters of this frame, and returns what its rays need.
    ///
    /// # Errors
    /// Out of memory.
    pub fn count(&mut self, rec: &mut Recorder) -> Result<FeedbackView, Error> {
        if !self.is_on() {
            return Ok(FeedbackView::default());
        }
        Ok(FeedbackView {
            counters: self.counts.begin(rec, self.counters())?,
            first: self.first,
            count: u32::try_from(self.geometries.len()).unwrap_or(u32::MAX),
            origin: self.boxes.origin,
            edge: self.boxes.edge,
            counts: self.boxes.counts.to_array(),
            #[allow(clippy::cast_possible_truncation)] // below FEEDBACK_RAYS
            turn: (self.frame % u64::from(FEEDBACK_RAYS)) as u32,
        })
    }

    /// Ends a view: copies its counters for the CPU.
    ///
    /// # Errors
    /// Out of memory.
    pub fn end(&mut self, rec: &mut Recorder) -> Result<(), Error> {
        if !self.is_on() {
            return Ok(());
        }
        let frame = Frame {
            geometries: std::mem::take(&mut self.geometries),
            thresholds: self.thresholds,
            boxes: self.boxes.serial,
        };
        let number = frame.geometries.len() + self.boxes.len();
        self.counts.end(rec, number, frame)
    }
}

/// Bounds of the meshes of an instance that have structures of their own, in its space; empty without such a mesh.
fn local_bounds(view: &TracedScene, entity: &ViewEntity, instance: u32) -> Aabb {
    let first = entity.first_mesh as usize;
    let meshes = first..first.saturating_add(entity.mesh_count as usize);
    let meshes = slice::part(&view.meshes, meshes).iter();
    let bounds = |mesh: &DynamicMesh| match mesh.shape {
        Shape::Rigid(rigid) => view.look.rigid.get(rigid as usize).map(|r| r.bounds),
        Shape::Animated(_) => Some(finite_bounds(view.mesh_geometry(mesh).vertices)),
        Shape::Changing => None,
    };
    let meshes = meshes.filter(|mesh| mesh.instance == instance);
    let bounds = meshes.filter_map(bounds);
    bounds.fold(Aabb::EMPTY, Aabb::union)
}

/// Whether bounds are in the frustum of a camera and large enough to matter.
fn is_in_sight(bounds: &Aabb, camera: Vec3, frustum: &[Vec4; 4]) -> bool {
    let near = SMALL * SMALL * bounds.distance_squared(camera);
    bounds.size().length_squared() >= near && !outside(bounds, frustum)
}
