//! What computes the light of `relight bake`.

use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use relight::RelitWorld;
use relight::bake::{Gather, GatherError, GatherProgress, Light, LitSurfaces, Point, Rays};
use relight::calibrate::Surroundings;
use renderer_vk::{BakeDevice, GatherOptions, GpuGather, probe};

use super::STACK_SIZE;
use super::loading::Source;

/// A device, or none: the CPU computes.
type Made = Result<Option<Arc<BakeDevice>>, String>;

/// What computes the light of all maps: the CPU, or a GPU that a thread makes ready.
pub struct Computer {
    making: Mutex<Option<JoinHandle<Made>>>,
    made: OnceLock<Made>,
}

impl Computer {
    /// Begins to make a device ready. `device`: `cpu`, `gpu` or part of a Vulkan device's name; `None`: a GPU, or the CPU
    /// where there is none. `cache`: the folder of compiled pipelines.
    pub fn begin(device: Option<&str>, cache: Option<&Path>) -> Self {
        let wanted = device.map(str::to_owned);
        let options = GatherOptions {
            device: wanted.clone().filter(|name| name != "gpu"),
            pipeline_cache: cache.map(|folder| folder.join("pipelines.cache")),
            ..GatherOptions::default()
        };
        let made = OnceLock::new();
        let mut making = None;
        if device == Some("cpu") {
            made.get_or_init(|| Ok(None));
        } else {
            let make = {
                let (wanted, options) = (wanted.clone(), options.clone());
                move || make(wanted.as_deref(), &options)
            };
            let builder = thread::Builder::new().stack_size(STACK_SIZE);
            match builder.spawn(make) {
                Ok(thread) => making = Some(thread),
                Err(_) => {
                    made.get_or_init(|| self::make(wanted.as_deref(), &options));
                }
            }
        }
        Self {
            making: Mutex::new(making),
            made,
        }
    }

    /// The device, once it is ready.
    fn device(&self) -> &Made {
        self.made.get_or_init(|| {
            let mut making = self.making.lock().unwrap_or_else(PoisonError::into_inner);
            let thread = making.take().ok_or("there is no device")?;
            let panicked = |_| Err("the thread that makes the device failed".to_owned());
            thread.join().unwrap_or_else(panicked)
        })
    }

    /// What computes the light of a world. The device is waited for, and gets the world, at the first call.
    pub fn gather<'a>(&'a self, source: &'a Source, world: &'a RelitWorld) -> LateGather<'a> {
        LateGather {
            computer: self,
            source,
            world,
            made: None,
            waited: Duration::ZERO,
        }
    }
}

/// What computes the light of one world once it is needed: the device is made ready meanwhile.
pub struct LateGather<'a> {
    computer: &'a Computer,
    source: &'a Source,
    world: &'a RelitWorld,
    made: Option<Box<dyn Gather + 'a>>,
    /// How long the first call waited for the device, and for its copy of the world.
    pub waited: Duration,
}

impl<'a> LateGather<'a> {
    fn make(&self) -> Result<Box<dyn Gather + 'a>, GatherError> {
        match self.computer.device() {
            Ok(Some(on)) => {
                let files = Arc::clone(&self.source.files);
                let scripts = Arc::clone(&self.source.materials);
                let made = GpuGather::new(on, files, scripts, self.world);
                let failure = |error| GatherError(format!("{}: {error}", on.info().name));
                Ok(Box::new(made.map_err(failure)?))
            }
            Ok(None) => Ok(Box::new(Rays::new(self.world))),
            Err(problem) => Err(GatherError(problem.clone())),
        }
    }

    fn made(&mut self) -> Result<&mut (dyn Gather + 'a), GatherError> {
        let made = match self.made.take() {
            Some(made) => made,
            None => {
                let begin = Instant::now();
                let made = self.make()?;
                self.waited = begin.elapsed();
                made
            }
        };
        Ok(&mut **self.made.insert(made))
    }
}

impl Gather for LateGather<'_> {
    fn name(&self) -> String {
        (self.made.as_ref()).map_or_else(String::new, |made| made.name())
    }

    fn direct(
        &mut self,
        points: &[Point],
        samples: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        self.made()?.direct(points, samples, progress)
    }

    fn reflected(
        &mut self,
        points: &[Point],
        lit: LitSurfaces<'_>,
        rays: u32,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<Light>, GatherError> {
        self.made()?.reflected(points, lit, rays, progress)
    }

    fn nearness(
        &mut self,
        points: &[Point],
        around: &Surroundings,
        progress: GatherProgress<'_>,
    ) -> Result<Vec<f32>, GatherError> {
        self.made()?.nearness(points, around, progress)
    }
}

/// Makes the device that is wanted.
fn make(wanted: Option<&str>, options: &GatherOptions) -> Made {
    let usable = |on: &BakeDevice| wanted.is_some() || !on.info().software;
    let made = BakeDevice::new(options).and_then(|on| match usable(&on) {
        true => on.compile().map(|()| Some(Arc::new(on))),
        // slower than the CPU's own rays
        false => Ok(None),
    });
    match (made, wanted) {
        (Ok(made), _) => Ok(made),
        (Err(error), Some(name)) => Err(format!("--device {name}: {error}")),
        (Err(error), None) => {
            if probe(None).is_ok_and(|info| !info.software) {
                log::warn!("the CPU computes the light, because the GPU cannot: {error}");
            }
            Ok(None)
        }
    }
}
