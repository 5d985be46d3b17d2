//! Transparent texels of materials with an alpha test, for rays on the CPU.

use crate::image::Image;
use crate::materials::light::cut_out_stage;
use glam::Vec2;
use shaderscript::{AlphaGen, Shader, StageImage, TcGen};

/// Opacity of a material's texels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holes {
    width: u32,
    height: u32,
    solid: Vec<bool>,
    /// Coordinates beyond the picture are those of its edge.
    clamp: bool,
    /// Both sides are drawn.
    pub(crate) two_sided: bool,
}

impl Holes {
    /// Holes of a cut-out; `None` for other materials, for images without holes, and for animated holes, which are
    /// unknown. `image` returns a picture by name.
    pub(crate) fn of(
        shader: &Shader,
        two_sided: bool,
        image: impl FnOnce(&str) -> Option<Image>,
    ) -> Option<Holes> {
        let stage = shader.stages.get(cut_out_stage(shader)?)?;
        let still = stage.tc_gen == TcGen::Base
            && stage.tc_mods.is_empty()
            && stage.alpha_gen == AlphaGen::Identity
            && shader.deforms.is_empty()
            && shader.stages.iter().filter(|s| s.depth_write).count() == 1;
        let (test, names) = (stage.alpha_func?, stage.image.names());
        let [name] = names else { return None };
        if !still {
            return None;
        }
        let picture = image(name)?;
        let solid: Vec<bool> = picture
            .pixels()
            .map(|[.., alpha]| test.passes(f32::from(alpha) / 255.0))
            .collect();
        let holes = solid.contains(&false);
        holes.then_some(Holes {
            width: picture.width,
            height: picture.height,
            solid,
            clamp: matches!(stage.image, StageImage::ClampMap(_)),
            two_sided,
        })
    }

    /// Whether the texel at these coordinates is opaque.
    pub(crate) fn is_solid(&self, st: Vec2) -> bool {
        let at = |t: f32, side: u32| -> usize {
            let t = if self.clamp {
                t.clamp(0.0, 1.0)
            } else {
                t.rem_euclid(1.0)
            };
            ((t * side as f32) as u32).min(side.saturating_sub(1)) as usize
        };
        let index = at(st.y, self.height) * self.width as usize + at(st.x, self.width);
        self.solid.get(index).copied().unwrap_or(true)
    }

    /// Identity for a hash.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.solid.iter().map(|s| u8::from(*s)).collect();
        bytes.extend(self.width.to_le_bytes());
        bytes.extend([u8::from(self.clamp), u8::from(self.two_sided)]);
        bytes
    }
}
