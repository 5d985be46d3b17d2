//! Every pass of the traced look, compiled once for a device and tracer, whatever maps and views come and go.

use std::sync::OnceLock;

use super::antialias::AntialiasPasses;
use super::bloom::BloomPasses;
use super::debug::DebugView;
use super::denoise::DenoisePasses;
use super::fog::FogPasses;
use super::input::Tracer;
use super::passes::{
    BounceLights, BounceHits, BounceRays, Choose, Composite, Direct, Exposure, EyeRays, Fill,
    FlareRays, Indirect, OtherSide, PlainPrimary, Primary, ToneMap,
};
use crate::at_once::{Late, Make, make_all};
use crate::gpu::{Device, Error};

/// A pass that is compiled when it is first asked for.
pub struct Pass<T> {
    made: OnceLock<T>,
    compile: fn(&Device, Tracer) -> Result<T, Error>,
}

impl<T> Pass<T> {
    fn new(compile: fn(&Device, Tracer) -> Result<T, Error>) -> Self {
        Self {
            made: OnceLock::new(),
            compile,
        }
    }
}

/// The passes. Where there are two of a kind, the second is for maps with fog.
pub struct PassSet {
    device: Device,
    tracer: Tracer,
    pub(super) eye_rays: Pass<EyeRays>,
    pub(super) plain: [Pass<PlainPrimary>; 2],
    pub(super) primary: [Pass<Primary>; 2],
    pub(super) other_side: Pass<OtherSide>,
    pub(super) fog: Pass<FogPasses>,
    pub(super) choose: Pass<Choose>,
    /// Of one chosen light a pixel.
    pub(super) chosen_direct: Pass<Direct>,
    pub(super) suns: Pass<Direct>,
    /// Of any number of lights.
    pub(super) direct: Pass<Direct>,
    pub(super) bounce_rays: Pass<BounceRays>,
    pub(super) bounce_shade: [Pass<BounceHits>; 2],
    pub(super) bounce_lights: Pass<BounceLights>,
    pub(super) fill: Pass<Fill>,
    pub(super) indirect: [Pass<Indirect>; 2],
    pub(super) flare_rays: Pass<FlareRays>,
    pub(super) denoise: Pass<DenoisePasses>,
    pub(super) composite: Pass<Composite>,
    pub(super) antialias: Pass<AntialiasPasses>,
    pub(super) exposure: Pass<Exposure>,
    pub(super) bloom: Pass<BloomPasses>,
    pub(super) tone_map: Pass<ToneMap>,
    pub(super) debug: Pass<DebugView>,
}

/// Compiles a pass unless it is there.
type Ahead<'a> = Box<dyn Fn() -> Result<(), Error> + Sync + 'a>;

impl PassSet {
    /// Nothing is compiled yet.
    pub fn new(device: &Device, tracer: Tracer) -> Self {
        Self {
            device: device.clone(),
            tracer,
            eye_rays: Pass::new(EyeRays::new),
            plain: [
                Pass::new(|device, _| PlainPrimary::new(device)),
                Pass::new(|device, _| PlainPrimary::with_lit_fog(device)),
            ],
            primary: [Pass::new(Primary::new), Pass::new(Primary::with_lit_fog)],
            other_side: Pass::new(OtherSide::new),
            fog: Pass::new(FogPasses::new),
            choose: Pass::new(|device, _| Choose::new(device)),
            chosen_direct: Pass::new(Direct::of_chosen),
            suns: Pass::new(Direct::of_suns),
            direct: Pass::new(Direct::new),
            bounce_rays: Pass::new(BounceRays::new),
            bounce_shade: [
                Pass::new(|device, _| BounceHits::new(device)),
                Pass::new(|device, _| BounceHits::with_fog(device)),
            ],
            bounce_lights: Pass::new(BounceLights::new),
            fill: Pass::new(|device, _| Fill::new(device)),
            indirect: [Pass::new(Indirect::new), Pass::new(Indirect::with_fog)],
            flare_rays: Pass::new(FlareRays::new),
            denoise: Pass::new(|device, _| DenoisePasses::new(device)),
            composite: Pass::new(|device, _| Composite::new(device)),
            antialias: Pass::new(|device, _| AntialiasPasses::new(device)),
            exposure: Pass::new(|device, _| Exposure::new(device)),
            bloom: Pass::new(|device, _| BloomPasses::new(device)),
            tone_map: Pass::new(|device, _| ToneMap::new(device)),
            debug: Pass::new(|device, _| DebugView::new(device)),
        }
    }

    /// The device that the passes run on.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// What follows rays in them.
    pub fn tracer(&self) -> Tracer {
        self.tracer
    }

    /// A pass, compiled now if it was not.
    ///
    /// # Errors
    /// The driver refuses a pipeline.
    pub(super) fn get<'a, T>(&'a self, pass: &'a Pass<T>) -> Result<&'a T, Error> {
        if let Some(made) = pass.made.get() {
            return Ok(made);
        }
        let made = (pass.compile)(&self.device, self.tracer)?;
        Ok(pass.made.get_or_init(|| made))
    }

    fn ahead<'a, T: Send + Sync>(&'a self, pass: &'a Pass<T>) -> Ahead<'a> {
        Box::new(|| self.get(pass).map(|_| ()))
    }

    /// Compiles, on all cores at once, what denoised pictures with one bounce need and is not there yet. `has_fog`: the
    /// map has some; where this is not known, its passes are compiled when it comes into sight.
    ///
    /// # Errors
    /// The driver refuses a pipeline.
    pub fn compile_ahead(&self, has_fog: bool) -> Result<(), Error> {
        let mut passes: Vec<Ahead<'_>> = Vec::new();
        // drivers compile for a long time where they have not done it before: those that take longest first
        if has_fog {
            passes.extend([
                self.ahead(&self.primary[1]),
                self.ahead(&self.plain[1]),
                self.ahead(&self.fog),
            ]);
        }
        passes.extend([
            self.ahead(&self.primary[0]),
            self.ahead(&self.other_side),
            self.ahead(&self.bounce_shade[usize::from(has_fog)]),
            self.ahead(&self.denoise),
            self.ahead(&self.plain[0]),
            self.ahead(&self.chosen_direct),
            self.ahead(&self.suns),
            self.ahead(&self.bounce_lights),
            self.ahead(&self.bounce_rays),
            self.ahead(&self.eye_rays),
            self.ahead(&self.choose),
            self.ahead(&self.antialias),
            self.ahead(&self.composite),
            self.ahead(&self.exposure),
            self.ahead(&self.fill),
            self.ahead(&self.tone_map),
        ]);
        let passes: Vec<_> = passes.into_iter().map(Late::new).collect();
        make_all(&passes.iter().map(|p| p as &dyn Make).collect::<Vec<_>>());
        passes.into_iter().try_for_each(Late::take)
    }
}
