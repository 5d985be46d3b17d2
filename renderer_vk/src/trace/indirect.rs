//! Bounced light: which passes gather it.

use super::input::Tracer;
use super::passes::{BounceLights, BounceMeets, BounceRays, Fill, Indirect};
use crate::gpu::{Device, Error, Recorder};
use crate::settings::Settings;

/// Whether bounced light is gathered for a quarter of the pixels: in a picture that is denoised nobody can tell, and it is the
/// dearest pass. Reference mode and undenoised pictures get every pixel.
pub fn is_sparse(settings: &Settings) -> bool {
    !settings.rt_accumulate && settings.rt_denoiser > 0 && settings.rt_bounces > 0
}

/// Passes that are made when they are first asked for: for maps without fog, and with it.
struct Kinds<T>([Option<T>; 2]);

impl<T> Kinds<T> {
    fn get(
        &mut self,
        has_fog: bool,
        make: impl FnOnce(bool) -> Result<T, Error>,
    ) -> Result<&T, Error> {
        let [without, with] = &mut self.0;
        match if has_fog { with } else { without } {
            Some(made) => Ok(made),
            none => Ok(none.insert(make(has_fog)?)),
        }
    }
}

fn bounce_meets(device: &Device, has_fog: bool) -> Result<BounceMeets, Error> {
    if has_fog {
        BounceMeets::with_fog(device)
    } else {
        BounceMeets::new(device)
    }
}

/// Records the passes that write `indirect`.
pub struct IndirectLight {
    device: Device,
    tracer: Tracer,
    rays: BounceRays,
    meets: Kinds<BounceMeets>,
    lights: BounceLights,
    fill: Fill,
    paths: Kinds<Indirect>,
}

impl IndirectLight {
    /// Compiles what a denoised picture of a map with one bounce needs; the rest when it is asked for.
    ///
    /// # Errors
    /// The driver refuses a pipeline.
    pub fn new(device: &Device, tracer: Tracer, has_fog: bool) -> Result<Self, Error> {
        let mut meets = Kinds([None, None]);
        meets.get(has_fog, |fog| bounce_meets(device, fog))?;
        Ok(Self {
            device: device.clone(),
            tracer,
            rays: BounceRays::new(device, tracer)?,
            meets,
            lights: BounceLights::new(device, tracer)?,
            fill: Fill::new(device)?,
            paths: Kinds([None, None]),
        })
    }

    /// Gathers bounced light. `view`: device address of the `TraceView`; `size`: its pixels.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(
        &mut self,
        rec: &mut Recorder,
        view: u64,
        size: [u32; 2],
        settings: &Settings,
        has_fog: bool,
    ) -> Result<(), Error> {
        let (device, tracer) = (&self.device, self.tracer);
        let cells = size.map(|n| n.div_ceil(2));
        let sparse = is_sparse(settings);
        if sparse && settings.rt_bounces == 1 {
            let meets = self.meets.get(has_fog, |fog| bounce_meets(device, fog))?;
            self.rays.record(rec, view, cells)?;
            meets.record(rec, view, cells)?;
            self.lights.record(rec, view, cells)?;
        } else {
            let paths = self.paths.get(has_fog, |fog| {
                if fog {
                    Indirect::with_fog(device, tracer)
                } else {
                    Indirect::new(device, tracer)
                }
            })?;
            paths.record(rec, view, if sparse { cells } else { size })?;
        }
        if sparse {
            self.fill.record(rec, view, cells)?;
        }
        Ok(())
    }
}
