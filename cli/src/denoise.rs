//! `relight render --denoise`: filters the accumulated picture by Open Image Denoise.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use oidn::{Guides, Oidn};
use renderer_vk::{DebugOutput, Look, Renderer, Settings};

use crate::surfaces::{Mean, Texel, albedo, normal};

/// Filter of accumulated pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Filter {
    /// Open Image Denoise, a library that must be installed.
    Oidn,
}

// No documentation comment: clap would show it in place of a subcommand's own description.

// Options of the filter.
#[derive(Args, Debug)]
pub struct DenoiseArgs {
    /// Remove the noise that is left in the mean of --spp frames, before exposure and tone curve; --denoiser is for
    /// frames that do not accumulate
    #[arg(long, value_enum, value_name = "FILTER", conflicts_with_all = ["no_accumulation", "timings", "frame_times", "stats"])]
    denoise: Option<Filter>,
    /// The library of --denoise oidn; default: libOpenImageDenoise of the system
    #[arg(long, value_name = "FILE", requires = "denoise")]
    oidn: Option<PathBuf>,
}

/// Frames that the guides are means of. Their cameras differ within a pixel, as those of the picture do.
const GUIDE_FRAMES: u16 = 16;

impl DenoiseArgs {
    /// The filter, if one is wanted, for pictures with these settings.
    ///
    /// # Errors
    /// Its library is absent, or the settings give no accumulated picture of the output's size.
    pub fn filter(&self, settings: &Settings) -> Result<Option<Denoiser>> {
        if self.denoise.is_none() {
            return Ok(None);
        }
        ensure!(
            settings.rt == Look::Traced,
            "--denoise is for the traced look"
        );
        ensure!(
            settings.rt_accumulate && settings.rt_debug == DebugOutput::None,
            "--denoise filters the mean picture: it needs rt_accumulate 1 and rt_debug 0"
        );
        ensure!(
            settings.rt_scale >= 1.0,
            "--denoise filters pictures of the traced size: it needs --render-scale 1"
        );
        let oidn = Oidn::load(self.oidn.as_deref()).context(
            "--denoise needs the library Open Image Denoise: install it (a package of your system, or openimagedenoise.org), \
             or name its file with --oidn",
        )?;
        Ok(Some(Denoiser { oidn }))
    }
}

/// A loaded filter.
pub struct Denoiser {
    oidn: Oidn,
}

impl Denoiser {
    /// Filters the accumulated picture of a view, so that the renderer shows the result. `draw` draws a frame of the
    /// view.
    ///
    /// # Errors
    /// The library's, or the device is lost or out of memory.
    pub fn apply(
        &self,
        renderer: &mut Renderer,
        settings: &Settings,
        mut draw: impl FnMut(&mut Renderer) -> Result<()>,
    ) -> Result<()> {
        let color = renderer.read_radiance()?;
        let (width, height) = renderer.size();
        // The albedo guide is the picture without illumination: the albedo of lit surfaces, and the emission of sky and
        // flames. It has the texture detail of the picture, and no noise of light.
        let unlit = Settings {
            rt_illumination: false,
            rt_bounces: 0,
            rt_bloom: 0.0,
            ..settings.clone()
        };
        renderer.set_settings(&Settings {
            rt_debug: DebugOutput::Normals,
            ..unlit.clone()
        });
        let mut normals = Mean::new(color.len());
        let mut lit = vec![0.0; color.len()];
        for _ in 0..GUIDE_FRAMES {
            draw(renderer)?;
            let shown = renderer.read_pixels()?;
            let shown: Vec<Texel> = shown.rgb.chunks_exact(3).map(normal).collect();
            for (lit, normal) in lit.iter_mut().zip(&shown) {
                *lit += f32::from(u8::from(*normal != [0.0; 3])) / f32::from(GUIDE_FRAMES);
            }
            normals.add(shown.into_iter());
        }
        // `rt_debug` does not restart the mean: the frames drawn for the normals already accumulated without illumination
        renderer.set_settings(&unlit);
        draw(renderer)?;
        let shown = renderer.read_pixels()?;
        let albedo: Vec<Texel> = shown.rgb.chunks_exact(3).map(albedo()).collect();
        let normal = normals.texels();
        let guides = Guides {
            albedo: &albedo,
            normal: &normal,
            clean: true,
        };
        let size = (width as usize, height as usize);
        let filtered = self.oidn.denoise(size, &color, Some(guides))?;
        let mixed = mixed(&color, &filtered, &lit);
        renderer.set_settings(settings);
        // the settings of the guides restarted the mean; one frame begins a new one, which the filtered picture replaces
        draw(renderer)?;
        ensure!(
            renderer.replace_radiance(&mixed)?,
            "there is no mean picture to filter"
        );
        draw(renderer)
    }
}

/// Mixes the filtered colour in by the lit fraction of each pixel. Sky, flames and screens have no noise of light: a
/// filter could only blur them.
fn mixed(color: &[Texel], filtered: &[Texel], lit: &[f32]) -> Vec<Texel> {
    let pixels = color.iter().zip(filtered).zip(lit);
    pixels
        .map(|((color, filtered), lit)| {
            std::array::from_fn(|k| color[k] + (filtered[k] - color[k]) * lit)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_lit_keeps_its_colour() {
        let (color, filtered) = ([[1.0, 2.0, 3.0]; 3], [[2.0, 2.0, 1.0]; 3]);
        let found = mixed(&color, &filtered, &[0.0, 0.5, 1.0]);
        assert_eq!(found, [color[0], [1.5, 2.0, 2.0], filtered[0]]);
    }
}
