//! 2D pictures: drawings over the views, and cinematics.

use glam::{IVec2, Vec2};

use super::Renderer;
use crate::api::{CinematicFrame, StretchedPicture};
use crate::assets::desaturate;
use crate::error::Error;
use crate::raster::Picture2d;

impl Renderer {
    /// Sets the colour of subsequent pictures; `None` is white. Values are converted to bytes as in the engine.
    pub fn set_color(&mut self, rgba: Option<[f32; 4]>) {
        self.color_2d = rgba.map_or(u32::MAX, |rgba| {
            // truncates and wraps, without clamping
            let mut bytes = rgba.map(|c| (c * 255.0) as i32 as u8);
            desaturate(&mut bytes, self.settings.greyscale);
            u32::from_le_bytes(bytes)
        });
    }

    /// Draws a material in a rectangle of window pixels.
    pub fn stretch_pic(&mut self, picture: &StretchedPicture, shader: i32) {
        let Some(assets) = &self.assets else {
            return; // between registrations
        };
        let material = assets.materials.resolve(assets.material_of_handle(shader));
        self.overlay.add(
            material,
            &Picture2d {
                position: picture.position,
                size: picture.size,
                st1: picture.st1,
                st2: picture.st2,
                color: self.color_2d,
            },
        );
    }

    /// Draws a cinematic's pixels, stretched to a rectangle of the window.
    ///
    /// # Errors
    /// The picture's size is not a power of two, or the data is too short.
    pub fn stretch_raw(
        &mut self,
        position: IVec2,
        size: IVec2,
        frame: &CinematicFrame<'_>,
    ) -> Result<(), Error> {
        let CinematicFrame {
            cols, rows, client, ..
        } = *frame;
        if !cols.is_power_of_two() || !rows.is_power_of_two() {
            return Err(Error::NotPowerOfTwo { cols, rows });
        }
        self.upload_cinematic(frame)?;
        let Some(texture) = (self.assets.as_mut()).map(|a| a.textures.queue_scratch(client)) else {
            return Ok(());
        };
        let half = Vec2::new(0.5 / cols as f32, 0.5 / rows as f32);
        self.overlay.add_film(
            texture,
            &Picture2d {
                position: position.as_vec2(),
                size: size.as_vec2(),
                st1: half,
                st2: Vec2::ONE - half,
                color: u32::MAX,
            },
        );
        Ok(())
    }

    /// Uploads the pixels of a cinematic.
    ///
    /// # Errors
    /// The data is too short for the size, or the device is out of memory.
    pub fn upload_cinematic(&mut self, frame: &CinematicFrame<'_>) -> Result<(), Error> {
        let CinematicFrame {
            cols,
            rows,
            rgba,
            client,
            dirty,
        } = *frame;
        match &mut self.assets {
            Some(assets) => Ok(assets.update_scratch(client, cols, rows, rgba, dirty)?),
            None => Ok(()),
        }
    }
}
