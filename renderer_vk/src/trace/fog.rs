//! Light in fog: single scattering at one point of each cell of pixels, found by rays to lights.
//!
//! The primary rays leave for each pixel what light in its fog is multiplied by, and for each cell a point in that fog,
//! chosen by how much each place scatters. A pass lights the points. In a denoised picture a cell is 2 × 2 pixels, its
//! light joins that of earlier frames, and neighbours are evened out; otherwise each pixel is a cell, and the mean over
//! frames is exact.

use shaders::trace_types::FogView;
use shaders::trace_types::constants as t;

use super::frame_passes::FramePasses;
use super::passes::Pass;
use crate::gpu::{Device, Error, Format, Image, ImageDesc, ImageUsage};

/// Pixels to the edge of a cell of filtered light.
const CELL: u32 = 2;
/// Distances between the taps of the filter's steps, cells.
const SPACINGS: [u32; 3] = [1, 2, 4];
/// Frames that the images are kept for after fog was last in sight: turning to and fro costs no memory to be taken anew.
const KEPT_FRAMES: u32 = 300;

struct Images {
    /// Of the view, pixels.
    size: [u32; 2],
    cell: u32,
    cells: [u32; 2],
    weight: Image,
    /// Light at the points: of this frame and the last.
    light: [Image; 2],
    /// What the filter makes of it.
    filtered: Option<Image>,
}

impl Images {
    fn new(device: &Device, size: [u32; 2], filtered: bool) -> Result<Self, Error> {
        let cell = if filtered { CELL } else { 1 };
        let cells = size.map(|s| s.div_ceil(cell));
        let make = |name, [width, height]: [u32; 2], format| {
            let usage = ImageUsage::STORAGE;
            Image::new(device, &ImageDesc::new(name, width, height, format, usage))
        };
        let filtered = filtered.then(|| make("trace fog filtered", cells, Format::Rgba16F));
        Ok(Self {
            size,
            cell,
            cells,
            weight: make("trace fog weight", size, Format::R32Uint)?,
            light: [
                make("trace fog light", cells, Format::Rgba16F)?,
                make("trace last fog light", cells, Format::Rgba16F)?,
            ],
            filtered: filtered.transpose()?,
        })
    }
}

/// Lights fog; nothing is held while there is none.
pub struct LitFog {
    device: Device,
    images: Option<Images>,
    /// The images hold the light of the last frame.
    history: bool,
    /// Frames since fog was in sight.
    unseen: u32,
}

impl LitFog {
    /// Without images until fog comes into sight.
    pub fn new(device: &Device) -> Self {
        Self {
            device: device.clone(),
            images: None,
            history: false,
            unseen: 0,
        }
    }

    /// To be called before a frame's parameters are gathered. `wanted`: the view has fog that is lit; `filtered`: its
    /// light is to be free of noise; `size`: of the view, pixels; `goes_on`: the frame follows the last one that was
    /// drawn, whose camera is known.
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
        let had = self.images.as_ref().map(|i| (i.size, i.filtered.is_some()));
        self.unseen = if wanted {
            0
        } else {
            self.unseen.saturating_add(1)
        };
        let fits = had == Some((size, filtered)) && self.unseen < KEPT_FRAMES;
        if !fits {
            // the old ones go first: there may not be room for both
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

    /// The images, if there is fog in sight.
    fn seen(&self) -> Option<&Images> {
        self.images.as_ref().filter(|_| self.unseen == 0)
    }

    /// What the passes read. `half`: the image of half floats that the picture is put together in; until then it holds
    /// the points in fog. It and `packed`, an image of packed light, stand for images that are not there, since software
    /// drivers look at the images of branches that are not taken.
    pub fn view(&self, packed: &Image, half: &Image) -> FogView {
        let half = half.storage_index();
        let Some(images) = self.seen() else {
            return FogView {
                weight: packed.storage_index(),
                point: half,
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
            point: half,
            fresh,
            last,
            filtered: images.filtered.as_ref().map_or(fresh, Image::storage_index),
            cell: images.cell,
            width: images.cells[0],
            height: images.cells[1],
            flags: t::FOG_LIT
                | flag(images.filtered.is_some(), t::FOG_FILTERED)
                | flag(self.history && images.filtered.is_some(), t::FOG_HISTORY),
        }
    }

    /// Cells of the light in this frame's fog; 0 where there is none.
    pub fn cells(&self) -> [u32; 2] {
        self.seen().map_or([0; 2], |images| images.cells)
    }

    /// Lights the fog in sight, and filters that light where the picture is denoised.
    ///
    /// # Errors
    /// Out of memory, or the driver refuses a pipeline.
    pub fn record(&self, passes: &mut FramePasses<'_>) -> Result<(), Error> {
        let Some(images) = self.seen() else {
            return Ok(());
        };
        passes.run(Pass::FogLight)?;
        let Some(filtered) = &images.filtered else {
            return Ok(());
        };
        let [fresh, last, filtered] = [&images.light[0], &images.light[1], filtered]
            .map(|image| u64::from(image.storage_index()));
        // the next frame goes on from the fresh light; the last frame's is free
        let [first, second, third] = SPACINGS;
        passes.run_step(Pass::FogFilter, fresh, filtered, first)?;
        passes.run_step(Pass::FogFilter, filtered, last, second)?;
        passes.run_step(Pass::FogFilter, last, filtered, third)
    }

    /// The frame is recorded: what it wrote becomes what the last one wrote.
    pub fn advance(&mut self) {
        self.history = self.is_on();
        if let Some(images) = &mut self.images {
            images.light.swap(0, 1);
        }
    }

    /// Forgets the last frame.
    #[cfg(test)]
    pub fn reset(&mut self) {
        self.history = false;
    }
}
