//! Hits of bounce rays in the last frame's picture (`rt_bounceScreen`): Willberger, Musterle, Bergmann, Deferred Hybrid
//! Path Tracing, Ray Tracing Gems, 2019, chapter 26.

use shaders::trace_types::ScreenView;

use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::{Device, Error, Format, Image, ImageDesc, ImageUsage};
use crate::settings::Settings;

/// Whether frames with these settings keep their light for the bounces of the next. Not in reference mode, which must not
/// depend on earlier frames, nor with a lens, through which a pixel shows several surfaces.
pub fn in_use(settings: &Settings) -> bool {
    settings.rt_bounce_screen > 0
        && settings.rt_bounces > 0
        && settings.rt_illumination
        && !settings.fullbright
        && !settings.rt_accumulate
        && !settings.rt_dof
}

/// Images of one size, 16 bytes a pixel.
struct Images {
    size: [u32; 2],
    /// `Rg32Uint`, two of light: albedo and emission of the first surface of each pixel.
    surface: Image,
    /// `R32Uint`: its distance.
    depth: Image,
    /// `R32Uint`, light.
    light: Image,
}

impl Images {
    fn new(device: &Device, size: [u32; 2]) -> Result<Self, Error> {
        let [width, height] = size;
        let make = |name, format| {
            let desc = ImageDesc::new(name, width, height, format, ImageUsage::STORAGE);
            Image::new(device, &desc)
        };
        Ok(Self {
            size,
            surface: make("trace screen surface", Format::Rg32Uint)?,
            depth: make("trace screen depth", Format::R32Uint)?,
            light: make("trace screen light", Format::R32Uint)?,
        })
    }
}

/// Depth and light of the last frame.
#[derive(Default)]
pub struct LastScreen {
    images: Option<Images>,
    /// The last frame has written them.
    written: bool,
}

impl LastScreen {
    /// Makes or drops the images, before the parameters of a frame are collected. `goes_on`: the frame continues the last
    /// one, whose camera is known.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        device: &Device,
        settings: &Settings,
        size: [u32; 2],
        goes_on: bool,
    ) -> Result<(), Error> {
        self.images
            .take_if(|images| !in_use(settings) || images.size != size);
        self.written &= goes_on && self.images.is_some();
        if in_use(settings) && self.images.is_none() {
            self.images = Some(Images::new(device, size)?);
        }
        Ok(())
    }

    /// Whether bounces of this frame may take light of the last.
    pub fn is_known(&self) -> bool {
        self.written
    }

    /// Parameters of the passes. `nothing`: an image for those that are absent.
    pub fn view(&self, settings: &Settings, nothing: &Image) -> ScreenView {
        let index = |image: fn(&Images) -> &Image| {
            (self.images.as_ref())
                .map_or(nothing, image)
                .storage_index()
        };
        ScreenView {
            surface: index(|images| &images.surface),
            depth: index(|images| &images.depth),
            light: index(|images| &images.light),
            steps: settings.rt_bounce_screen,
            thickness: settings.rt_bounce_thickness,
            padding: 0,
        }
    }

    /// Records what must be kept of first hits, before other passes overwrite them.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn keep_surfaces(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        match self.images {
            Some(_) => passes.run(Pass::ScreenSurface),
            None => Ok(()),
        }
    }

    /// Keeps the frame's light, once it is filtered.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn keep_light(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        match self.images {
            Some(_) => passes.run(Pass::ScreenLight),
            None => Ok(()),
        }
    }

    /// Ends the frame: its light becomes that of the last frame.
    pub fn advance(&mut self) {
        self.written = self.images.is_some();
    }
}
