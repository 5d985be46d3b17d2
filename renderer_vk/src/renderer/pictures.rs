//! 2D pictures: what lies over the views, and films.

use glam::Vec2;

use super::Renderer;
use crate::assets::desaturate;
use crate::error::Error;
use crate::raster::Picture2d;

impl Renderer {
    /// Colour of the pictures that follow; `None` is white. Values become bytes as the engine makes them.
    pub fn set_color(&mut self, rgba: Option<[f32; 4]>) {
        self.color_2d = rgba.map_or(u32::MAX, |rgba| {
            // truncated and wrapped, not clamped
            let mut bytes = rgba.map(|c| (c * 255.0) as i32 as u8);
            desaturate(&mut bytes, self.settings.greyscale);
            u32::from_le_bytes(bytes)
        });
    }

    /// Draws a material in a rectangle of window pixels.
    #[allow(clippy::too_many_arguments)]
    pub fn stretch_pic(
        &mut self,
        x: f32,
        y: f32,
        w: f32,
        h: f32,
        s1: f32,
        t1: f32,
        s2: f32,
        t2: f32,
        shader: i32,
    ) {
        let Some(assets) = &self.assets else { return };
        let material = assets.materials.resolve(assets.material_of_handle(shader));
        self.overlay.add(
            material,
            &Picture2d {
                position: Vec2::new(x, y),
                size: Vec2::new(w, h),
                st1: Vec2::new(s1, t1),
                st2: Vec2::new(s2, t2),
                color: self.color_2d,
            },
        );
    }

    /// Draws RGBA8 pixels, stretched to a rectangle of the window.
    ///
    /// # Errors
    /// The picture's size is not a power of two, or the data is too short.
    #[allow(clippy::too_many_arguments)]
    pub fn stretch_raw(
        &mut self,
        x: i32,
        y: i32,
        w: i32,
        h: i32,
        cols: u32,
        rows: u32,
        rgba: &[u8],
        client: usize,
        dirty: bool,
    ) -> Result<(), Error> {
        if !cols.is_power_of_two() || !rows.is_power_of_two() {
            return Err(Error::NotPowerOfTwo { cols, rows });
        }
        self.upload_cinematic(cols, rows, rgba, client, dirty)?;
        let Some(texture) = (self.assets.as_mut()).map(|a| a.textures.queue_scratch(client)) else {
            return Ok(());
        };
        let half = Vec2::new(0.5 / cols as f32, 0.5 / rows as f32);
        self.overlay.add_film(
            texture,
            &Picture2d {
                position: Vec2::new(x as f32, y as f32),
                size: Vec2::new(w as f32, h as f32),
                st1: half,
                st2: Vec2::ONE - half,
                color: u32::MAX,
            },
        );
        Ok(())
    }

    /// Replaces the picture of a cinematic.
    ///
    /// # Errors
    /// The data is shorter than the size says, or the device is out of memory.
    pub fn upload_cinematic(
        &mut self,
        cols: u32,
        rows: u32,
        rgba: &[u8],
        client: usize,
        dirty: bool,
    ) -> Result<(), Error> {
        match &mut self.assets {
            Some(assets) => Ok(assets.update_scratch(client, cols, rows, rgba, dirty)?),
            None => Ok(()),
        }
    }
}
