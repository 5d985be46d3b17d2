//! Output of queued frames: recording, presenting, reading back, and the costs.

use std::time::Instant;

use relight::overbright;

use super::Renderer;
use crate::api::Picture;
use crate::assets::ImageSource;
use crate::error::Error;
use crate::frame::{CLEAR, FrameContext, Item};
use crate::gpu::{ColorMask, Encoding, Format, Image, ImageDesc, ImageUsage, Recorder};
use crate::half::half;
use crate::raster::{self, Display, Present};
use crate::scene::Statistics;
use crate::settings::{Anaglyph, Look, Settings};
use crate::stereo::Eye;
use crate::trace::TraceLook;

/// Counts of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameStats {
    /// Number of the frame since the renderer was made, from 1. Reading pictures takes numbers, too.
    pub serial: u64,
    /// 3D views drawn.
    pub views: u32,
    /// Draw calls of the classic look and the overlay.
    pub draws: u32,
    /// Mean number of times that the newest finished frame drew a pixel; 0 without `r_measureOverdraw`.
    pub overdraw: f32,
    /// Contents of the classic look's views; counted only with `r_speeds`.
    pub scene: Statistics,
    /// CPU times of the frame.
    pub cpu: CpuTimes,
}

/// CPU times of the calling thread in a frame, milliseconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuTimes {
    /// Gathering the scenes of the views.
    pub gather: f32,
    /// Waiting for an earlier frame; with two frames in flight, for the one before the last. With `r_lowLatency` also
    /// for the last one, after this frame's submission, and the time that the engine is kept then.
    pub wait: f32,
    /// Recording commands and uploading moving geometry.
    pub record: f32,
    /// Submitting commands and presenting.
    pub submit: f32,
}

pub(super) fn milliseconds(from: Instant, to: Instant) -> f32 {
    to.duration_since(from).as_secs_f32() * 1000.0
}

/// How the settings show display values in a window of this encoding.
fn display(settings: &Settings, encoding: Encoding) -> Display {
    Display {
        gamma: settings.display_gamma(),
        overbright_bits: settings.effective_overbright_bits(),
        encoding,
        white: settings.hdr_white,
    }
}

/// Four half floats a texel as four bytes; values above 1 are 255.
fn bytes_of_halves(texels: &[u8]) -> Vec<u8> {
    let halves: Vec<u16> = bytemuck::pod_collect_to_vec(texels);
    let byte = |v: u16| (half(v).clamp(0.0, 1.0) * 255.0).round() as u8;
    halves.into_iter().map(byte).collect()
}

impl Renderer {
    /// Begins a frame; `time_ms`: shader time of 2D materials.
    pub fn begin_frame(&mut self, time_ms: i32) {
        if self.swapchain.is_some() {
            self.pacer.begin(Instant::now());
        }
        self.set_eye(Eye::Both);
        self.held.begin_frame();
        self.overlay_time = time_ms as f32 * 0.001;
        // the second eye draws over the first eye's picture
        if self.settings.clear && self.queue.is_empty() {
            self.queue.push((Item::Clear(CLEAR), ColorMask::ALL));
        }
    }

    /// Eyes for which a frame is drawn, in this order, each with [`begin_frame`](Self::begin_frame).
    pub fn eyes(&self) -> &'static [Eye] {
        match self.settings.anaglyph {
            Anaglyph::None => &[Eye::Both],
            _ => &[Eye::Left, Eye::Right],
        }
    }

    /// Sets the eye that subsequent calls draw for, after [`begin_frame`](Self::begin_frame). A frame begins with both
    /// eyes.
    pub fn set_eye(&mut self, eye: Eye) {
        self.queue_overlay();
        self.eye = eye;
        self.scene.set_eye(eye);
    }

    pub(super) fn queue_overlay(&mut self) {
        if self.hides_overlay {
            self.overlay.clear();
        }
        if !self.overlay.is_empty() {
            // A new overlay if no spare one is left.
            let empty = self.spare_overlays.pop().unwrap_or_default();
            let overlay = std::mem::replace(&mut self.overlay, empty);
            let mask = self.eye.mask(self.settings.anaglyph);
            self.queue
                .push((Item::Overlay(overlay, self.overlay_time), mask));
        }
    }

    /// Records and presents the queue.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn end_frame(&mut self) -> Result<FrameStats, Error> {
        if self.settings.skip_back_end {
            self.queue_overlay();
            self.recycle_queue();
            self.scene.end_frame();
            self.pacer.forget();
            return Ok(FrameStats::default());
        }
        let stats = self.flush(true)?;
        if let Some(assets) = &mut self.assets {
            assets.textures.end_frame();
        }
        self.scene.end_frame();
        self.flares.end_frame();
        Ok(stats)
    }

    /// Empties the queue and keeps its memory for reuse.
    fn recycle_queue(&mut self) {
        for (item, _) in self.queue.drain(..) {
            match item {
                Item::Overlay(mut overlay, _) => {
                    overlay.clear();
                    self.spare_overlays.push(overlay);
                }
                Item::Clear(_) | Item::Ui(_) => {}
                Item::Classic(scenes) => self.scene.recycle_classic(scenes),
                // held views are copies: keeping their memory would leak a copy per frame
                Item::Traced(_) if self.settings.rt_pause => {}
                Item::Traced(scene) => self.scene.recycle_traced(*scene),
                Item::Hybrid(scenes, traversed) => {
                    self.scene.recycle_classic(scenes);
                    self.scene.recycle_traced(*traversed);
                }
            }
        }
    }

    /// `r_showImages`: draws all images over the picture.
    fn queue_image_sheet(&mut self) {
        if let (1.., Some(assets)) = (self.settings.show_images, &self.assets) {
            let proportional = self.settings.show_images == 2;
            let (size, textures) = (self.size(), &assets.textures);
            let white = ImageSource::white(textures);
            raster::image_sheet(
                &mut self.overlay,
                size,
                proportional,
                white,
                textures.images(),
            );
        }
    }

    /// Records and submits the queue; `end`: it ends a frame, which is presented.
    pub(super) fn flush(&mut self, end: bool) -> Result<FrameStats, Error> {
        self.queue_image_sheet();
        self.queue_overlay();
        let mut stats = FrameStats::default();
        let show = end && !self.hidden && self.swapchain.is_some();
        if !self.queue.is_empty() {
            let format = self.picture_format();
            self.targets.fit(&self.device, &self.settings, format)?;
        }
        let begin = Instant::now();
        let mut recorder = self.ring.begin()?;
        let ready = Instant::now();
        self.look_for_ends()?;
        stats.serial = recorder.serial();
        // colour channels that no eye draws keep old content
        if self.shown_anaglyph != self.settings.anaglyph {
            self.shown_anaglyph = self.settings.anaglyph;
            self.targets.clear(&mut recorder)?;
        }
        let measure = self.settings.measure_overdraw && self.settings.rt != Look::Traced;
        self.raster.begin_frame(&mut recorder, measure)?;
        let pixels = self.targets.color().width() as f32 * self.targets.color().height() as f32;
        stats.overdraw = self.raster.fragments() as f32 / pixels;
        if let Some(trace) = &mut self.trace {
            trace.count_rays(self.counts_rays);
        }
        if let Some(assets) = &mut self.assets {
            assets.prepare_frame(&self.settings)?;
            let mut context = FrameContext {
                color: self.targets.color(),
                drawn: self.targets.drawn(),
                depth: self.targets.depth(),
                mask: ColorMask::ALL,
                assets,
                world: self.world.as_ref(),
                settings: &self.settings,
                raster: &mut self.raster,
                flares: &mut self.flares,
                trace: self.trace.as_mut(),
                hybrid: self.hybrid.as_mut(),
                hybrid_surfaces: &mut self.hybrid_surfaces,
                list: &mut self.list,
            };
            for (item, mask) in &self.queue {
                context.mask = *mask;
                context.record(&mut recorder, item)?;
                if let Item::Classic(scenes) | Item::Hybrid(scenes, _) = item {
                    for scene in scenes {
                        stats.scene.add(&scene.look.statistics);
                    }
                }
                stats.views += u32::from(!matches!(
                    item,
                    Item::Overlay(..) | Item::Clear(_) | Item::Ui(_)
                ));
                stats.draws += context.list.calls.len() as u32;
            }
        }
        if !self.queue.is_empty() {
            self.targets.resolve(&mut recorder)?;
        }
        if end {
            self.record_still(&mut recorder);
        }
        self.recycle_queue();
        let recorded = Instant::now();
        if show {
            self.show(recorder)?;
        } else {
            self.ring.end(recorder)?;
        }
        let submitted = Instant::now();
        if show {
            self.pace()?;
        } else if end {
            self.pacer.forget();
        }
        stats.cpu = CpuTimes {
            gather: std::mem::take(&mut self.gather_ms),
            wait: milliseconds(begin, ready) + milliseconds(submitted, Instant::now()),
            record: milliseconds(ready, recorded),
            submit: milliseconds(recorded, submitted),
        };
        Ok(stats)
    }

    /// Presents the last frame's picture, before a long operation.
    pub(super) fn show_finished(&mut self) -> Result<(), Error> {
        match &mut self.swapchain {
            Some(swapchain) => Ok(swapchain.show()?),
            None => Ok(()),
        }
    }

    /// Ends a frame: presents its picture.
    fn show(&mut self, mut recorder: Recorder) -> Result<(), Error> {
        match &mut self.swapchain {
            Some(swapchain) => {
                if let Some(target) = swapchain.acquire(&mut recorder)? {
                    // a window may have moved to another display
                    self.encoding = swapchain.encoding();
                    // a change of the window's format needs a new swapchain
                    if self
                        .present
                        .as_ref()
                        .is_none_or(|p| p.format() != target.format())
                    {
                        self.present = Some(Present::new(&self.device, target.format())?);
                    }
                    let display = display(&self.settings, self.encoding);
                    if let Some(present) = &self.present {
                        present.record(&mut recorder, self.targets.color(), &target, display)?;
                    }
                }
                self.ring.end_present(recorder, swapchain)?;
            }
            None => self.ring.end(recorder)?,
        }
        Ok(())
    }

    /// Format of the picture. If the picture is presented unchanged, the window's own format: presenting then copies
    /// bytes, which software drivers do faster than a conversion. Otherwise a format that every shader can read and
    /// write.
    pub(super) fn picture_format(&self) -> Format {
        let traced = |(item, _): &(Item, _)| matches!(item, Item::Traced(_));
        let plain = self.settings.display_gamma() == 1.0
            && self.settings.effective_overbright_bits() == 0
            && self.settings.rt != Look::Traced
            && !self.queue.iter().any(traced);
        if self.encoding != Encoding::Srgb {
            return raster::WIDE_FORMAT;
        }
        match &self.swapchain {
            Some(swapchain)
                if plain && swapchain.copies() && swapchain.format() == Format::Bgra8 =>
            {
                Format::Bgra8
            }
            _ => raster::COLOR_FORMAT,
        }
    }

    /// The picture after all queued commands, as the display shows it.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn read_pixels(&mut self) -> Result<Picture, Error> {
        self.flush(false)?;
        let (width, height) = self.size();
        let color = self.targets.color();
        let mut texels = self.device.read_image(color)?;
        if color.format() == raster::WIDE_FORMAT {
            texels = bytes_of_halves(&texels);
        }
        let rgb = self.displayed(&texels, color.format() == Format::Bgra8);
        Ok(Picture { width, height, rgb })
    }

    /// The image that the window would show, for a window of more than white: linear light in units of 80 cd/m²
    /// (scRGB), or the code values of HDR10, 0 to 1. RGB in rows from the top; empty with 8 bits a channel.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn read_presented(&mut self) -> Result<Vec<[f32; 3]>, Error> {
        if self.encoding == Encoding::Srgb {
            return Ok(Vec::new());
        }
        self.flush(false)?;
        let (width, height) = self.size();
        // code values in half floats: read back alike for both encodings
        let format = raster::WIDE_FORMAT;
        let desc = ImageDesc::new("presented", width, height, format, ImageUsage::COLOR);
        let image = Image::new(&self.device, &desc)?;
        let present = Present::new(&self.device, format)?;
        let display = display(&self.settings, self.encoding);
        let frame = self.targets.color();
        self.device
            .immediate(|recorder| present.record(recorder, frame, &image, display))?;
        self.radiance_of(&image)
    }

    /// Display values of texels of four bytes, without alpha.
    pub(super) fn displayed(&self, texels: &[u8], blue_first: bool) -> Vec<u8> {
        let table = overbright::gamma_table(
            self.settings.display_gamma(),
            self.settings.effective_overbright_bits(),
        );
        texels
            .chunks_exact(4)
            .flat_map(|p| {
                if blue_first {
                    [p[2], p[1], p[0]]
                } else {
                    [p[0], p[1], p[2]]
                }
            })
            .map(|v| table[usize::from(v)])
            .collect()
    }

    /// The linear picture of the last traced view before exposure, RGB in rows from the top; empty if no view was
    /// traced. Display white has radiance 1.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn read_radiance(&mut self) -> Result<Vec<[f32; 3]>, Error> {
        self.flush(false)?;
        match self.trace.as_ref().and_then(TraceLook::hdr) {
            Some(hdr) => self.radiance_of(hdr),
            None => Ok(Vec::new()),
        }
    }

    /// Lets the next `frames` frames join the mean of `rt_accumulate` whatever they show, as light does on film while the
    /// shutter is open: what moves is blurred.
    pub fn join_frames(&mut self, frames: u32) {
        if let Some(trace) = &mut self.trace {
            trace.join_frames(frames);
        }
    }

    /// Replaces the mean of the accumulated frames by another linear picture before exposure, of the traced size, such
    /// as a filtered one: the next frames show it, with bloom, exposure and tone curve of their own, and leave it as it
    /// is, until their content changes. False if no frames are accumulated.
    ///
    /// # Errors
    /// A wrong number of pixels; the device is lost or out of memory.
    pub fn replace_radiance(&mut self, radiance: &[[f32; 3]]) -> Result<bool, Error> {
        self.flush(false)?;
        let texels: Vec<[f32; 4]> = radiance.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        match &mut self.trace {
            Some(trace) => Ok(trace.replace_mean(&texels)?),
            None => Ok(false),
        }
    }

    /// RGB of a linear image.
    pub(super) fn radiance_of(&self, hdr: &Image) -> Result<Vec<[f32; 3]>, Error> {
        let bytes = self.device.read_image(hdr)?;
        if hdr.format() == Format::Rgba16F {
            let texels: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
            return Ok(texels
                .iter()
                .map(|t| [t[0], t[1], t[2]].map(half))
                .collect());
        }
        let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
        Ok(texels.iter().map(|t| [t[0], t[1], t[2]]).collect())
    }
}
