//! Light in fog: single scattering at one point of each cell of pixels, found by rays to lights.
//!
//! The primary pass writes for each pixel the weight of light in its fog, and for each cell a point in that fog,
//! sampled in proportion to scattering. A pass lights the points. In a denoised picture a cell is 2 × 2 pixels, its
//! light is blended with that of earlier frames and filtered over neighbours; otherwise each pixel is a cell, and the
//! mean over frames is exact.

use shaders::trace_types::FogView;
use shaders::trace_types::constants as t;

use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::{Device, Error, Format, Image, ImageDesc, ImageUsage};

/// Edge of a cell of filtered light, pixels.
const CELL: u32 = 2;
/// Distances between the taps of the filter steps, cells.
const SPACINGS: [u32; 3] = [1, 2, 4];
/// Frames for which the images are kept after fog was last in view, so that turning around does not reallocate them.
const KEPT_FRAMES: u32 = 300;

struct Images {
    /// Size of the view, pixels.
    size: [u32; 2],
    cell: u32,
    cells: [u32; 2],
    weight: Image,
    /// Light at the points in fog, of this frame and the last; one image where earlier frames do not count. This frame's
    /// holds the points before they are lit.
    light: [Image; 2],
    filtered: bool,
}

impl Images {
    fn new(device: &Device, size: [u32; 2], filtered: bool) -> Result<Self, Error> {
        let cell = if filtered { CELL } else { 1 };
        let cells = size.map(|s| s.div_ceil(cell));
        let make = |name, [width, height]: [u32; 2], format| {
            let usage = ImageUsage::STORAGE;
            Image::new(device, &ImageDesc::new(name, width, height, format, usage))
        };
        let light = make("trace fog light", cells, Format::Rgba16F)?;
        let last_light = match filtered {
            true => make("trace last fog light", cells, Format::Rgba16F)?,
            false => light.clone(),
        };
        Ok(Self {
            size,
            cell,
            cells,
            weight: make("trace fog weight", size, Format::R32Uint)?,
            light: [light, last_light],
            filtered,
        })
    }
}

/// Lighting of fog; holds no images while no fog is in view.
pub struct LitFog {
    device: Device,
    images: Option<Images>,
    /// The images hold valid light of the last frame.
    history: bool,
    /// Frames since fog was last in view.
    unseen: u32,
}

impl LitFog {
    /// Without images; [`prepare`](Self::prepare) makes them once fog is in view.
    pub fn new(device: &Device) -> Self {
        Self {
            device: device.clone(),
            images: None,
            history: false,
            unseen: 0,
        }
    }

    /// Call before the parameters of a frame are collected. `wanted`: the view has lit fog; `filtered`: its light is
    /// denoised; `size`: of the view, pixels; `goes_on`: the frame continues the last drawn one, whose camera is known.
    ///
    /// # Errors
    /// Out of memory.
    pub fn prepare(
        &mut self,
        wanted: bool,
        filtered: bool,
        size: [u32; 2],
        goes_on: bool,
    ) -> Result<(), Error> {
        let had = self.images.as_ref().map(|i| (i.size, i.filtered));
        self.unseen = if wanted {
            0
        } else {
            self.unseen.saturating_add(1)
        };
        let fits = had == Some((size, filtered)) && self.unseen < KEPT_FRAMES;
        if !fits {
            // free the old images first: memory may not suffice for both
            self.images = None;
            if wanted {
                self.images = Some(Images::new(&self.device, size, filtered)?);
            }
        }
        self.history &= goes_on && fits && wanted;
        Ok(())
    }

    /// Whether this frame's fog is lit.
    pub fn is_on(&self) -> bool {
        self.seen().is_some()
    }

    /// The images, if fog is in view.
    fn seen(&self) -> Option<&Images> {
        self.images.as_ref().filter(|_| self.unseen == 0)
    }

    /// Parameters of the passes. `filtered`: the image of filtered light. It and `packed`, an image of packed light,
    /// stand for absent images, because software drivers access the images of branches that are not taken.
    pub fn view(&self, packed: &Image, filtered: &Image) -> FogView {
        let half = filtered.storage_index();
        let Some(images) = self.seen() else {
            return FogView {
                weight: packed.storage_index(),
                fresh: half,
                last: half,
                filtered: half,
                cell: 1,
                ..FogView::default()
            };
        };
        let flag = |on: bool, bit: u32| if on { bit } else { 0 };
        let [fresh, last] = [0, 1].map(|i| images.light[i].storage_index());
        FogView {
            weight: images.weight.storage_index(),
            fresh,
            last,
            filtered: if images.filtered { half } else { fresh },
            cell: images.cell,
            width: images.cells[0],
            height: images.cells[1],
            flags: t::FOG_LIT
                | flag(images.filtered, t::FOG_FILTERED)
                | flag(self.history && images.filtered, t::FOG_HISTORY),
        }
    }

    /// Cells of the light in this frame's fog; 0 where there is none.
    pub fn cells(&self) -> [u32; 2] {
        self.seen().map_or([0; 2], |images| images.cells)
    }

    /// Lights the fog in view, and filters that light into the image `filtered` if the picture is denoised.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(&self, passes: &mut FramePasses<'_>, filtered: &Image) -> Result<(), Error> {
        let Some(images) = self.seen() else {
            return Ok(());
        };
        passes.run(Pass::FogLight)?;
        if !images.filtered {
            return Ok(());
        }
        let [fresh, last, filtered] = [&images.light[0], &images.light[1], filtered]
            .map(|image| u64::from(image.storage_index()));
        // the fresh light is the next frame's history; the last frame's image is free
        let [first, second, third] = SPACINGS;
        passes.run_step(Pass::FogFilter, fresh, filtered, first)?;
        passes.run_step(Pass::FogFilter, filtered, last, second)?;
        passes.run_step(Pass::FogFilter, last, filtered, third)
    }

    /// Ends the frame: its images become those of the last frame.
    pub fn advance(&mut self) {
        self.history = self.is_on();
        if let Some(images) = &mut self.images {
            images.light.swap(0, 1);
        }
    }

    /// Discards the history.
    #[cfg(test)]
    pub fn reset(&mut self) {
        self.history = false;
    }
}
