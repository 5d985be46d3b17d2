//! How strongly materials glow: as strongly as the lights that they are.

use super::images::Encoded;
use super::layers::Layer;
use super::look::{Look, Picture, look as read_look, ratio};
use super::stack::Moment;
use super::{Export, ExportError, ImagePlace};
use crate::overbright::luminance;
use crate::world::{RelitWorld, WorldMaterial};
use glam::{Vec3, Vec4};
use shaderscript::Shader;
use std::sync::Arc;

/// For every material the mean radiance of its lights, by area; zero where it has none.
pub fn radiances(world: &RelitWorld) -> Vec<Vec3> {
    let mut sums = vec![Vec4::ZERO; world.materials.len()];
    for light in &world.lights {
        let material = world
            .surfaces
            .get(light.surface as usize)
            .and_then(|s| sums.get_mut(s.material as usize));
        if let Some(sum) = material {
            let area = light.area();
            *sum += (light.radiance * area).extend(area);
        }
    }
    let mean = |sum: Vec4| {
        let mean = sum.truncate() / sum.w;
        if mean.is_finite() { mean } else { Vec3::ZERO }
    };
    sums.into_iter().map(mean).collect()
}

/// What a picture is multiplied with so that its mean is `radiance`. Where the picture lacks a colour of the light, its
/// brightness alone is matched.
fn factor(radiance: Vec3, mean: Vec3) -> Vec3 {
    if mean.min_element() >= 0.05 * mean.max_element() && mean.min_element() > 0.0 {
        radiance / mean
    } else {
        Vec3::splat(luminance(radiance) / luminance(mean).max(1.0e-4))
    }
}

impl Export<'_> {
    /// The mean of a picture, linear, with its alpha; `None` for one that is missing.
    pub(super) fn mean(&self, material: &WorldMaterial, picture: &Picture) -> Option<Vec4> {
        if self.options.images == ImagePlace::None {
            return None;
        }
        let shader = &material.resolved.shader;
        self.images.mean(self.files, picture, shader).ok()?
    }

    /// A picture as a file; `None` when there is no such image, or none are asked for.
    pub(super) fn picture(
        &self,
        picture: &Picture,
        shader: &Shader,
    ) -> Result<Option<Arc<Encoded>>, ExportError> {
        match self.options.images {
            ImagePlace::None => Ok(None),
            _ => self.images.get(self.files, picture, shader),
        }
    }

    /// What other programs can say of a layer whose lights have the mean radiance `radiance`; `lit`: whether they
    /// compute light, so that surfaces reflect and refract it; `moment`: when.
    pub(super) fn look(
        &self,
        layer: &Layer<'_>,
        radiance: Option<Vec3>,
        lit: bool,
        moment: Moment,
    ) -> Look {
        let material = &*layer.material;
        let finish = self.finish(layer.whole);
        let clear = lit && !finish.plain;
        let mut mean = |name: &str| self.mean(material, &Picture::File(name.to_owned()));
        let mut look = read_look(material, clear, Moment::Mean, &mut mean);
        let usual = look.glow_factor;
        if moment != Moment::Mean {
            look.take_factors(&read_look(material, clear, moment, &mut mean));
        }
        let pulse = ratio(look.glow_factor, usual);
        if lit {
            self.reflect(layer, &finish, &mut look);
        }
        if !self.options.lights {
            return look;
        }
        let exposure = self.exposure();
        look.glow_factor *= exposure;
        let Some(radiance) = radiance.filter(|r| r.max_element() > 0.0) else {
            return look;
        };
        let radiance = radiance * exposure;
        if look.glow.is_none() {
            look.glow = look.color.clone();
        }
        let mean = look
            .glow
            .as_ref()
            .and_then(|slot| self.mean(material, &slot.picture));
        look.glow_factor = pulse
            * match mean {
                Some(mean) => factor(radiance, mean.truncate()),
                None => radiance,
            };
        look
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_glow_is_as_bright_as_its_light() {
        let mean = Vec3::new(0.5, 0.25, 0.1);
        let light = Vec3::new(4.0, 3.0, 2.0);
        assert!((factor(light, mean) * mean - light).length() < 1.0e-5);
        // a red picture cannot be white; it is as bright
        let red = Vec3::new(0.5, 0.0, 0.0);
        let white = Vec3::ONE;
        assert!((luminance(factor(white, red) * red) - 1.0).abs() < 1.0e-5);
    }
}
