//! A device with the traced look, and the views that it renders.

use std::sync::{Arc, Mutex, PoisonError};

use glam::Vec3;
use shaders::trace_types::CameraView;
use shaders::trace_types::constants as t;
use testkit::Need;

use super::half;
use super::scene::{Scene, Uploaded};
use crate::api::RefDef;
use crate::gpu::{
    Device, DeviceOptions, Filter, Format, FrameRing, Image, ImageDesc, ImageUsage, MipFilter,
    Recorder, SamplerDesc, SurfaceSource, Wrap,
};
use crate::raster::FlareTest;
use crate::scene::{TracedScene, View};
use crate::settings::Settings;
use crate::stereo::Eye;
use crate::trace::pass_set::PassSet;
use crate::trace::passes::COUNTERS;
use crate::trace::tracer::Tracer;
use crate::trace::view_tracer::{TracedMap, TracedView, ViewTracer};

/// The tests of a file, in its module `on_gpu`: a `#[test]` for each named function of the file, which takes a
/// `&mut Gpu` and is run by [`Gpu::any`], [`Gpu::each`] or [`Gpu::compute`]. The compiler reports a function that no
/// list names as unused.
macro_rules! gpu_tests {
    ($($run:ident: [$($name:ident),+ $(,)?]),+ $(,)?) => {
        mod on_gpu {
            $($(
                #[test]
                fn $name() {
                    $crate::trace::tests::harness::Gpu::$run(super::$name);
                }
            )+)+
        }
    };
}
pub(crate) use gpu_tests;

/// Devices that no test uses, with the pipelines compiled so far. A software driver takes seconds to compile a pass and
/// keeps nothing from one device to the next, so that tests use devices in turns.
static IDLE: Mutex<Vec<Shared>> = Mutex::new(Vec::new());

/// A device and its pipelines, put back when a test drops them unless it failed.
struct Shared(Arc<PassSet>);

impl Drop for Shared {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
            idle.push(Shared(Arc::clone(&self.0)));
        }
    }
}

/// A device with its validation layer on and the look under test.
pub struct Gpu {
    pub device: Device,
    pub tracer: Tracer,
    pub look: ViewTracer,
    /// Camera of the last frame, unless that was of a reference picture.
    camera: CameraView,
    pub ring: FrameRing,
    pub passes: Arc<PassSet>,
    /// Dropped last, when nothing of this test is left on the device.
    _shared: Shared,
}

impl Gpu {
    /// Runs a test of shading, which all tracers share: with the compute tracer, which runs on every device; with every
    /// tracer if `RELIGHT_FULL=1`. A software driver takes minutes to compile the passes of one tracer.
    pub fn any(test: fn(&mut Gpu)) {
        if testkit::is_set("RELIGHT_FULL") {
            return Self::each(test);
        }
        Self::compute(test);
    }

    /// Runs a test with the compute tracer alone.
    pub fn compute(test: fn(&mut Gpu)) {
        if let Some(mut gpu) = Self::new(Tracer::Compute) {
            test(&mut gpu);
        }
    }

    /// Runs a test of ray traversal with every tracer that the device supports; with the grid tracer, which shares all
    /// but the walk with the compute tracer, only if `RELIGHT_FULL=1`.
    pub fn each(test: fn(&mut Gpu)) {
        let all = [
            Tracer::Pipeline,
            Tracer::Query,
            Tracer::Compute,
            Tracer::Grid,
        ];
        let full = testkit::is_set("RELIGHT_FULL");
        let tracers = if full { &all[..] } else { &all[..3] };
        Self::with(tracers, |mut gpu| test(&mut gpu));
    }

    /// Runs a test with each of `tracers` that the device supports. Without any of them, the test is skipped.
    pub fn with(tracers: &[Tracer], test: impl Fn(Gpu)) {
        let mut absent = Vec::new();
        for &tracer in tracers {
            match Self::open(tracer) {
                Ok(gpu) => {
                    println!("{tracer:?}");
                    test(gpu);
                }
                Err(why) => {
                    testkit::assert_optional(Need::Gpu, &why);
                    println!("{tracer:?} is left out: {why}");
                    absent.push(why);
                }
            }
        }
        if absent.len() == tracers.len() {
            testkit::skip(absent.join("; "));
        }
    }

    /// `None`, with a report of a skipped test, without a device for the tracer.
    pub fn new(tracer: Tracer) -> Option<Self> {
        testkit::device(Self::open(tracer))
    }

    /// An error message without a device for the tracer.
    fn open(tracer: Tracer) -> Result<Self, String> {
        let idle = {
            let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
            let place = idle.iter().position(|shared| shared.0.tracer() == tracer);
            place.map(|place| idle.swap_remove(place))
        };
        let shared = match idle {
            Some(shared) => shared,
            None => Shared(Arc::new(PassSet::new(&Self::open_device(tracer)?, tracer))),
        };
        let passes = Arc::clone(&shared.0);
        let device = passes.device().clone();
        Ok(Self {
            look: ViewTracer::new(&passes).expect("a device"),
            camera: CameraView::default(),
            tracer,
            ring: FrameRing::new(&device, 2).expect("frames"),
            device,
            passes,
            _shared: shared,
        })
    }

    fn open_device(tracer: Tracer) -> Result<Device, String> {
        let options = DeviceOptions {
            validation: true,
            // with the tracer's extensions disabled, to prove that it needs none
            allow_ray_tracing: !tracer.has_own_structures(),
            ..DeviceOptions::default()
        };
        let device = match Device::new(&options, SurfaceSource::Headless) {
            Ok(device) if tracer.is_possible(device.info()) => device,
            other => {
                let name = |d: Device| format!("{} does not trace rays", d.info().name);
                return Err(other.map_or_else(|e| e.to_string(), name));
            }
        };
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            device
                .sampler(&SamplerDesc {
                    filter: Filter::Linear,
                    mip: MipFilter::Linear,
                    wrap,
                    anisotropy: 1.0,
                    lod_bias: 0.0,
                })
                .expect("sampler");
        }
        Ok(device)
    }

    /// Switches ray counters for subsequent frames.
    pub fn count_rays(&mut self, count: bool) {
        self.look.count_rays = count;
    }

    /// Rays of each counted pass in the newest finished frame.
    pub fn rays(&self) -> Option<[u64; COUNTERS]> {
        self.look.rays()
    }

    /// The mean of `frames` frames before exposure, and the last picture.
    pub fn render(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        self.render_path(scene, settings, frames, |_, _| {})
    }

    /// As [`render`](Self::render), with a camera that `place` moves before each frame.
    pub fn render_path(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
        place: impl Fn(u32, &mut RefDef),
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        self.render_views(scene, settings, frames, |frame, view| {
            place(frame, &mut view.def);
        })
    }

    /// As [`render`](Self::render), with a view that `change` changes before each frame.
    pub fn render_views(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
        change: impl Fn(u32, &mut TracedScene),
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        self.render_watched(scene, settings, frames, change, None)
    }

    /// As [`render_views`](Self::render_views); passes the picture before exposure to `watch` after each frame.
    #[allow(clippy::type_complexity)] // for an optional closure
    pub fn render_watched(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
        change: impl Fn(u32, &mut TracedScene),
        mut watch: Option<&mut dyn FnMut(u32, &[Vec3])>,
    ) -> (Vec<Vec3>, Vec<[u8; 4]>) {
        let uploaded = scene.upload(&self.device, self.tracer);
        let target = self.target(scene);
        let mut view = scene.view();
        for frame in 0..frames {
            change(frame, &mut view);
            view.view = View::new(&view.def, 4.0, 10000.0);
            let mut rec = self.ring.begin().expect("frame");
            record(
                &mut self.look,
                &mut rec,
                &uploaded,
                &view,
                settings,
                &target,
            );
            self.ring.end(rec).expect("submitted");
            if let Some(watch) = &mut watch {
                self.device.wait_idle().expect("done");
                watch(frame, &self.linear_picture(&self.look));
            }
        }
        self.device.wait_idle().expect("done");
        if settings.rt_accumulate {
            assert_eq!(
                self.look.accumulated_frames(),
                frames,
                "nothing changed between the frames"
            );
        }
        let linear = self.linear_picture(&self.look);
        let picture: Vec<[u8; 4]> =
            bytemuck::pod_collect_to_vec(&self.device.read_image(&target).expect("read"));
        self.check_messages();
        self.camera = self.look.history.unwrap_or_default();
        self.look.reset();
        (linear, picture)
    }

    /// Frames for both eyes, `settings.stereo_separation` apart: the second eye's pictures before exposure, and the rays
    /// of its bounces in each frame, a few frames late. `forgets`: the second eye has no history.
    pub fn render_eyes(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        frames: u32,
        forgets: bool,
    ) -> Vec<(Vec<Vec3>, u64)> {
        let uploaded = scene.upload(&self.device, self.tracer);
        let target = self.target(scene);
        let mut right = ViewTracer::new(&self.passes).expect("a device");
        right.count_rays = true;
        let mut seen = Vec::new();
        for _ in 0..frames {
            let mut views = [Eye::Left, Eye::Right].map(|eye| {
                let mut view = scene.view();
                view.view = View::new(&view.def, 4.0, 10000.0).with_stereo(eye.stereo(settings));
                view
            });
            if forgets {
                right.reset();
            }
            let mut rec = self.ring.begin().expect("frame");
            let [first, second] = &mut views;
            record(
                &mut self.look,
                &mut rec,
                &uploaded,
                first,
                settings,
                &target,
            );
            right.other_eye = self.look.for_other_eye(second, settings);
            record(&mut right, &mut rec, &uploaded, second, settings, &target);
            self.ring.end(rec).expect("submitted");
            self.device.wait_idle().expect("done");
            let rays = right
                .rays()
                .map_or(0, |rays| rays[t::COUNT_BOUNCE_RAYS as usize]);
            seen.push((self.linear_picture(&right), rays));
        }
        self.check_messages();
        self.look.reset();
        seen
    }

    /// The image for a scene's picture.
    fn target(&self, scene: &Scene) -> Image {
        let [width, height] = [scene.def.width as u32, scene.def.height as u32];
        let usage = ImageUsage::STORAGE | ImageUsage::COLOR;
        Image::new(
            &self.device,
            &ImageDesc::new("test target", width, height, Format::Rgba8, usage),
        )
        .expect("target")
    }

    /// The picture of a tracer's last frame before exposure.
    fn linear_picture(&self, tracer: &ViewTracer) -> Vec<Vec3> {
        let hdr = tracer.hdr().expect("traced");
        let bytes = self.device.read_image(hdr).expect("read");
        let floats: Vec<f32> = if hdr.format() == Format::Rgba32F {
            bytemuck::pod_collect_to_vec(&bytes)
        } else {
            bytemuck::pod_collect_to_vec::<u8, u16>(&bytes)
                .into_iter()
                .map(half)
                .collect()
        };
        floats
            .chunks_exact(4)
            .map(|p| Vec3::new(p[0], p[1], p[2]))
            .collect()
    }

    /// Switches the denoiser's gradients, which are on by default.
    pub fn use_gradients(&mut self, on: bool) {
        self.look.denoiser.gradients = on;
    }

    /// Position and view distance of each pixel of the last frame, and its motion: offset, view distance in both
    /// frames.
    pub fn motion(&self) -> Vec<([f32; 4], [f32; 4])> {
        let targets = self.look.targets.as_ref().expect("traced");
        let read = |image| self.device.read_image(image).expect("read");
        let away: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read(&targets.position));
        let tails: Vec<u16> = bytemuck::pod_collect_to_vec(&read(&targets.distance_tail));
        let halves: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&read(&targets.motion));
        let paths: Vec<u16> = bytemuck::pod_collect_to_vec(&read(&targets.view_distance[1]));
        let motions = halves.iter().zip(&paths).map(|(motion, path)| {
            let [x, y, last, _mark] = motion.map(half);
            // the sign marks static surfaces
            [x, y, last, half(*path).abs()]
        });
        let places = away.into_iter().zip(tails.iter().zip(&paths)).enumerate();
        let places = places.map(|(i, (away, (tail, path)))| {
            let (x, y) = (i as u32 % targets.width, i as u32 / targets.width);
            let size = [targets.width, targets.height];
            place(&self.camera, [x, y], size, away, half(*path), *tail)
        });
        places.zip(motions).collect()
    }

    /// Asserts that the validation layer is silent.
    pub fn check_messages(&self) {
        let messages = self.device.validation_messages();
        let short: Vec<String> = messages
            .iter()
            .map(|m| m.chars().take(600).collect())
            .collect();
        assert!(messages.is_empty(), "{short:#?}");
    }

    /// The mean over the picture of the mean of `frames` frames.
    pub fn mean(&mut self, scene: &Scene, settings: &Settings, frames: u32) -> Vec3 {
        let (pixels, _) = self.render(scene, settings, frames);
        pixels.iter().sum::<Vec3>() / pixels.len() as f32
    }
}

/// Position and view distance of a pixel's surface, as `gbuffer.glsl` reads them: relative to the ray through the pixel.
fn place(
    camera: &CameraView,
    pixel: [u32; 2],
    size: [u32; 2],
    away: [u32; 2],
    distance: f32,
    tail: u16,
) -> [f32; 4] {
    let lit = tail & 1 << 13 != 0;
    if !lit {
        return [0.0, 0.0, 0.0, -1.0];
    }
    let above = u32::from(tail >> 15) << 13;
    let distance = f32::from_bits((distance.abs().to_bits() - above) | (u32::from(tail) & 0x1FFF));
    let [x, y] = [0, 1].map(|i| (pixel[i] as f32 + 0.5) / size[i] as f32 * 2.0 - 1.0);
    let ray = (camera.forward - camera.left * x - camera.up * y).normalize();
    let [low, high] = away;
    let steps = [
        low & 0xF_FFFF,
        low >> 20 | (high & 0xFF) << 12,
        high >> 8 & 0xF_FFFF,
    ];
    let step = ((high >> 28) as f32 + 3.0 - 19.0).exp2();
    let away = Vec3::from(steps.map(|n| (n as f32 - (1 << 19) as f32) * step));
    let place = camera.origin + ray * distance + away;
    [place.x, place.y, place.z, distance]
}

/// Records a view of a scene.
fn record(
    tracer: &mut ViewTracer,
    rec: &mut Recorder,
    uploaded: &Uploaded,
    view: &TracedScene,
    settings: &Settings,
    target: &Image,
) {
    let map = TracedMap {
        geometry: &uploaded.geometry,
        lights: &uploaded.lights,
        flares: FlareTest::default(),
    };
    let view = TracedView {
        scene: view,
        map: Some(map),
        materials: &uploaded.materials,
        settings,
        target,
    };
    tracer.record_view(rec, view).expect("recorded");
}
