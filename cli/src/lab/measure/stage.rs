//! A loaded map, and the variants of its pictures.

use anyhow::Result;
use glam::{Mat3, Vec3};
use indicatif::ProgressBar;
use relight::compare::Rgb8;
use renderer_vk::api::{DynamicLight, RefDef, RefEntity, renderfx};
use renderer_vk::{DebugOutput, DenoiserChoice, FrameStats, LightSelection, Renderer, Settings};

use super::shadows::Surface;
use crate::surfaces::{Mean, albedo, distance};
use crate::view::Camera;

/// Rotation of the camera in degrees, and its movement in units, in a frame on its way to a place: about those of a
/// walking player.
pub const TURN: f32 = 0.5;
pub const WALK: f32 = 0.75;

/// Duration of a frame on that way, milliseconds, and game time at its end, for surfaces that change with time.
pub const FRAME_TIME: u32 = 16;
const ARRIVAL_TIME: i32 = 60_000;

/// A variant of the picture.
pub struct Variant {
    /// Name in the table.
    pub name: &'static str,
    /// Its settings.
    pub settings: Settings,
}

/// The variants: one light sample a pixel, with different filters.
pub fn variants(base: &Settings) -> Vec<Variant> {
    let with = |name, change: &dyn Fn(&mut Settings)| {
        let mut settings = base.clone();
        change(&mut settings);
        Variant { name, settings }
    };
    vec![
        with("raw", &|s| {
            (s.rt_denoiser, s.rt_taa) = (DenoiserChoice::None, false)
        }),
        with("denoised", &|s| {
            (s.rt_denoiser, s.rt_taa) = (DenoiserChoice::ASvgf, false)
        }),
        with("denoised-taa", &|s| {
            (s.rt_denoiser, s.rt_taa) = (DenoiserChoice::ASvgf, true)
        }),
        with("sparse-taa", &|s| {
            (s.rt_denoiser, s.rt_taa) = (DenoiserChoice::Sparse, true)
        }),
        with("baseline", &|s| {
            (s.rt_denoiser, s.rt_taa) = (DenoiserChoice::ASvgf, true);
            s.rt_light_selection = LightSelection::Uniform;
            s.rt_gradients = false;
        }),
    ]
}

/// Frames that the albedo of surfaces is the mean of: cameras differ within a pixel, as those of the reference do.
const ALBEDO_FRAMES: u32 = 32;

/// A loaded map with a camera.
pub struct Stage {
    /// The renderer, with the map.
    pub renderer: Renderer,
    /// The entities that the game would add to every view.
    pub entities: Vec<RefEntity>,
    /// Handle of a first-person model.
    pub held: Option<i32>,
    /// Size of pictures, pixels.
    pub size: (u32, u32),
    /// Horizontal field of view, degrees.
    pub fov: f32,
    /// The camera stands still in all frames.
    pub stand: bool,
}

/// Position of a first-person model, units forward, left and up from the camera: about that of games.
const HELD_AT: Vec3 = Vec3::new(12.0, -5.0, -7.0);

impl Stage {
    /// Draws a frame, `left` frames before the camera arrives.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn frame(
        &mut self,
        camera: &Camera,
        left: u32,
        lights: &[DynamicLight],
    ) -> Result<FrameStats> {
        let camera = on_the_way(camera, if self.stand { 0 } else { left });
        let time = ARRIVAL_TIME.saturating_sub_unsigned(left.saturating_mul(FRAME_TIME));
        self.frame_at(&camera, time, lights)
    }

    /// Draws a frame at this game time, milliseconds.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn frame_at(
        &mut self,
        camera: &Camera,
        time_ms: i32,
        lights: &[DynamicLight],
    ) -> Result<FrameStats> {
        self.renderer.begin_frame(0);
        self.renderer.clear_scene();
        for entity in &self.entities {
            self.renderer.add_entity(entity);
        }
        if let Some(model) = self.held {
            let axis = camera.axis();
            let at = camera.origin + Mat3::from_cols_array_2d(&axis.map(Into::into)) * HELD_AT;
            self.renderer.add_entity(&RefEntity {
                renderfx: renderfx::FIRST_PERSON | renderfx::DEPTH_HACK,
                model,
                axis,
                origin: at,
                old_origin: at,
                lighting_origin: camera.origin,
                shader_rgba: [255; 4],
                ..RefEntity::default()
            });
        }
        for light in lights {
            self.renderer.add_light(*light);
        }
        self.renderer.render_scene(&RefDef {
            time_ms,
            ..camera.ref_def(self.size, self.fov)
        })?;
        Ok(self.renderer.end_frame()?)
    }

    /// Linear luminance of the last frame, before exposure.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn light(&mut self) -> Result<Vec<f32>> {
        let radiance = self.renderer.read_radiance()?;
        let luminance = |rgb: &[f32; 3]| relight::overbright::luminance(Vec3::from_array(*rgb));
        Ok(radiance.iter().map(luminance).collect())
    }

    /// Mask of the pixels with specular paths: mirror, portal, glass, liquid or shiny surface.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn specular(&mut self, base: &Settings, camera: &Camera) -> Result<Vec<bool>> {
        let settings = Settings {
            rt_debug: DebugOutput::Specular,
            rt_taa: false,
            ..base.clone()
        };
        self.cut(camera, &settings)?;
        self.frame(camera, 0, &[])?;
        let picture = self.picture()?;
        let pixels = picture.pixels().chunks_exact(3);
        Ok(pixels.map(|p| p.iter().any(|v| *v > 127)).collect())
    }

    /// The surface of each pixel.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn surfaces(&mut self, base: &Settings, camera: &Camera) -> Result<Vec<Surface>> {
        let view = |output| Settings {
            rt_debug: output,
            rt_accumulate: true,
            // light is not shown
            rt_bounces: 0,
            ..base.clone()
        };
        self.renderer.set_settings(&view(DebugOutput::Albedo));
        let mut mean = Mean::new((self.size.0 * self.size.1) as usize);
        for _ in 0..ALBEDO_FRAMES {
            self.frame(camera, 0, &[])?;
            mean.add(self.picture()?.pixels().chunks_exact(3).map(albedo()));
        }
        self.renderer.set_settings(&view(DebugOutput::Depth));
        self.frame(camera, 0, &[])?;
        let distances = self.picture()?;
        let distances = distances.pixels().chunks_exact(3).map(distance);
        let albedo = mean.texels().into_iter().map(Vec3::from_array);
        Ok(std::iter::zip(albedo, distances)
            .map(|(albedo, distance)| Some((relight::overbright::luminance(albedo), distance?)))
            .collect())
    }

    /// The last frame.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn picture(&mut self) -> Result<Rgb8> {
        let picture = self.renderer.read_pixels()?;
        Ok(Rgb8::new(
            picture.width as usize,
            picture.height as usize,
            picture.rgb,
        )?)
    }

    /// Drops the history: the next frame has none.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn cut(&mut self, camera: &Camera, settings: &Settings) -> Result<()> {
        // a frame of the other mode drops the history and the accumulated mean
        let other = Settings {
            rt_accumulate: !settings.rt_accumulate,
            ..settings.clone()
        };
        self.renderer.set_settings(&other);
        self.frame(camera, 0, &[])?;
        self.renderer.set_settings(settings);
        Ok(())
    }

    /// The mean of `frames` frames, as displayed, and as luminance before exposure.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn reference(
        &mut self,
        base: &Settings,
        camera: &Camera,
        lights: &[DynamicLight],
        frames: u32,
        bar: &ProgressBar,
    ) -> Result<(Rgb8, Vec<f32>)> {
        self.reference_at(base, (camera, ARRIVAL_TIME), lights, frames, bar)
    }

    /// The same at this game time, milliseconds.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn reference_at(
        &mut self,
        base: &Settings,
        (camera, time_ms): (&Camera, i32),
        lights: &[DynamicLight],
        frames: u32,
        bar: &ProgressBar,
    ) -> Result<(Rgb8, Vec<f32>)> {
        let settings = Settings {
            rt_accumulate: true,
            ..base.clone()
        };
        self.cut(camera, &settings)?;
        for _ in 0..frames {
            self.frame_at(camera, time_ms, lights)?;
            bar.inc(1);
        }
        Ok((self.picture()?, self.light()?))
    }
}

/// The camera `left` frames before it arrives.
fn on_the_way(camera: &Camera, left: u32) -> Camera {
    let left = left as f32;
    let [forward, ..] = camera.axis();
    Camera {
        origin: camera.origin - forward * (WALK * left),
        yaw: camera.yaw - TURN * left,
        ..*camera
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_arrives() {
        let camera = Camera {
            origin: Vec3::new(1.0, 2.0, 3.0),
            yaw: 30.0,
            pitch: 0.0,
        };
        assert_eq!(on_the_way(&camera, 0).origin, camera.origin);
        assert_eq!(on_the_way(&camera, 4).yaw, 28.0);
        assert!(on_the_way(&camera, 4).origin.distance(camera.origin) - 3.0 < 1.0e-5);
    }
}
