//! The last pass: writes the frame to the window, with overbright bits and gamma.

use bytemuck::{Pod, Zeroable};

use crate::gpu::{
    self, Access, Cull, DepthTest, Device, Encoding, Format, GraphicsDesc, GraphicsPipeline, Image,
    Recorder, Rendering, Viewport,
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Parameters {
    image: u32,
    scale: f32,
    inverse_gamma: f32,
    encoding: u32,
    wide: u32,
    white: f32,
}

/// How display values become values of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Each channel becomes `c^(1/gamma) * 2^overbright_bits`.
    pub gamma: f32,
    /// See `gamma`.
    pub overbright_bits: u32,
    /// Encoding of the window.
    pub encoding: Encoding,
    /// Brightness of white with an encoding of more than white, cd/m².
    pub white: f32,
}

/// Presents a frame to targets of one format.
pub struct Present {
    pipeline: GraphicsPipeline,
    format: Format,
}

impl Present {
    /// Creates the pipeline for targets of `format`.
    ///
    /// # Errors
    /// The device cannot make the pipeline.
    pub fn new(device: &Device, format: Format) -> Result<Self, gpu::Error> {
        let pipeline = GraphicsPipeline::new(
            device,
            &GraphicsDesc {
                color: Some(format),
                depth: None,
                blend: None,
                depth_test: DepthTest::Always,
                depth_write: false,
                cull: Cull::None,
                ..GraphicsDesc::new(
                    "present",
                    &shaders::RASTER_PRESENT_VERT,
                    &shaders::RASTER_PRESENT_FRAG,
                )
            },
        )?;
        Ok(Self { pipeline, format })
    }

    /// Format of the targets.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Records the copy of `frame` to `target`. Copies a frame unchanged if it has the target's format and that is
    /// neither [`super::COLOR_FORMAT`] nor [`super::WIDE_FORMAT`].
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        frame: &Image,
        target: &Image,
        display: Display,
    ) -> Result<(), gpu::Error> {
        let wide = frame.format() == super::WIDE_FORMAT;
        if frame.format() != super::COLOR_FORMAT && !wide {
            let mut pass = recorder.pass("present", Access::TRANSFER, Access::TRANSFER)?;
            let all = |image: &Image| [0, 0, image.width() as i32, image.height() as i32];
            if all(frame) == all(target) && frame.format() == target.format() {
                pass.copy_image(frame, target);
            } else {
                pass.blit_image(frame, all(frame), target, all(target), false);
            }
            return Ok(());
        }
        let mut pass = recorder.pass("present", Access::GRAPHICS, Access::GRAPHICS)?;
        pass.begin_rendering(&Rendering {
            color: Some(target),
            depth: None,
            clear_color: None,
            clear_depth: None,
        })?;
        let (width, height) = (target.width(), target.height());
        pass.set_viewport(&Viewport {
            x: 0.0,
            y: 0.0,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        });
        pass.set_scissor(0, 0, width, height);
        pass.bind_graphics(&self.pipeline);
        pass.push(&Parameters {
            image: frame.storage_index(),
            scale: (1 << display.overbright_bits.min(2)) as f32,
            inverse_gamma: 1.0 / display.gamma.clamp(0.5, 3.0),
            // `PRESENT_*`
            encoding: match (display.encoding, self.format) {
                (Encoding::Srgb, Format::Rgba8Srgb) => 1,
                (Encoding::Srgb, _) => 0,
                (Encoding::ScRgb, _) => 2,
                (Encoding::Hdr10, _) => 3,
            },
            wide: wide.into(),
            white: display.white,
        });
        pass.draw(3, 1, 0, 0);
        Ok(())
    }
}
