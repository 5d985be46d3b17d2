//! Accumulates a picture of any size over several frames, independent of the displayed one.

use super::view_tracer::ViewTracer;
use crate::gpu::{Device, Error, Format, Image, ImageDesc, ImageUsage, Recorder};
use crate::scene::{TracedScene, View};
use crate::settings::{DebugOutput, Settings};

use super::TraceLook;
use crate::assets::Assets;

/// A picture in progress: the view at the time of the request, and the passes that trace it.
pub struct Still {
    tracer: ViewTracer,
    view: Box<TracedScene>,
    target: Image,
    wanted: u32,
}

impl Still {
    /// Stores a view, to be traced at a size in pixels until `samples` frames are averaged. Its vertical field of view
    /// stays; a wider picture shows more at the sides.
    ///
    /// # Errors
    /// Out of memory.
    pub fn new(
        device: &Device,
        look: &TraceLook,
        view: &TracedScene,
        size: [u32; 2],
        samples: u32,
    ) -> Result<Self, Error> {
        let mut tracer = ViewTracer::new(look.passes())?;
        tracer.map_exposure = look.tracer.map_exposure;
        let [width, height] = size;
        let usage = ImageUsage::STORAGE | ImageUsage::COLOR;
        let desc = ImageDesc::new("still picture", width, height, Format::Rgba8, usage);
        Ok(Self {
            tracer,
            view: Box::new(resized(view, size)),
            target: Image::new(device, &desc)?,
            wanted: samples.max(1),
        })
    }

    /// Number of averaged frames, and of requested ones.
    pub fn progress(&self) -> (u32, u32) {
        (self.tracer.accumulated_frames(), self.wanted)
    }

    /// The picture.
    pub fn image(&self) -> &Image {
        &self.target
    }

    /// The linear picture, before exposure.
    pub fn hdr(&self) -> Option<&Image> {
        self.tracer.hdr()
    }

    /// Records up to `count` more frames of the picture. A change of settings restarts it.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn record(
        &mut self,
        rec: &mut Recorder,
        look: &TraceLook,
        assets: &Assets,
        settings: &Settings,
        count: u32,
    ) -> Result<(), Error> {
        let settings = Settings {
            rt_accumulate: true,
            rt_scale: 1.0,
            rt_debug: DebugOutput::None,
            ..settings.clone()
        };
        for _ in 0..count {
            look.record_by(
                &mut self.tracer,
                rec,
                &self.view,
                assets,
                &settings,
                &self.target,
            )?;
            let (done, wanted) = self.progress();
            if done >= wanted {
                break;
            }
        }
        Ok(())
    }
}

/// The view at another picture size.
fn resized(view: &TracedScene, size: [u32; 2]) -> TracedScene {
    let mut view = view.clone();
    let [width, height] = size.map(|side| i32::try_from(side.max(1)).unwrap_or(i32::MAX));
    let camera = View {
        viewport: [0, 0, width, height],
        #[allow(clippy::cast_precision_loss)] // pixels
        tan_x: view.view.tan_y * width as f32 / height as f32,
        ..view.view
    };
    view.view = camera;
    view.view.update();
    view
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::RefDef;

    #[test]
    fn another_size_keeps_the_vertical_angle_and_square_pixels() {
        let def = RefDef {
            x: 10,
            y: 20,
            width: 640,
            height: 480,
            fov_x: 90.0,
            fov_y: 73.739_8,
            ..RefDef::default()
        };
        let view = TracedScene::empty(&def, View::new(&def, 4.0, 100.0));
        let wide = resized(&view, [1280, 480]);
        assert_eq!(wide.view.viewport, [0, 0, 1280, 480]);
        assert!((wide.view.tan_y - view.view.tan_y).abs() < 1e-6);
        assert!((wide.view.tan_x - 2.0).abs() < 1e-4);
    }
}
