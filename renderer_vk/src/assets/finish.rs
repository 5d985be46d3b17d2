//! Applies files of materials (`relight::materials::by_hand`): they override what a material's script decides about its
//! reflection.

use glam::{Vec2, Vec3};
use relight::materials::by_hand::{Finish, MaterialsByHand, USUAL_REFLECTANCE};
use shaders::types::{Dielectric, Specular, constants as c};

use super::compile::sampler;
use super::material::Material;
use super::materials::Materials;
use super::source::{ImageFlags, ImageSource};

/// What the script alone decides, to return to when files change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OfScript {
    /// `MATERIAL_*` bits.
    pub flags: u32,
    /// Optical properties.
    pub dielectric: Dielectric,
}

/// Least part of blue over red and green in the mean of a normal map: its normals mostly point away from the surface.
const LEAST_BLUE: f32 = 1.1;

impl Materials {
    /// Replaces the files of materials, and changes all materials accordingly. Returns what is wrong with their images.
    pub fn set_by_hand(
        &mut self,
        by_hand: MaterialsByHand,
        source: &mut dyn ImageSource,
    ) -> Vec<String> {
        if by_hand == self.by_hand {
            return Vec::new();
        }
        self.by_hand = by_hand;
        let mut faults = Vec::new();
        for index in 0..self.list.len() {
            faults.extend(self.finish(index, source));
        }
        faults.sort();
        faults.dedup();
        self.touch();
        faults
    }

    /// Whether a material is rough or has a normal map.
    pub fn has_gloss(&self) -> bool {
        let gloss = c::MATERIAL_ROUGH | c::MATERIAL_NORMALS;
        self.list.iter().any(|material| material.flags & gloss != 0)
    }

    /// Applies the files to a material. Returns what is wrong with its images.
    pub(super) fn finish(&mut self, index: usize, source: &mut dyn ImageSource) -> Vec<String> {
        let mut faults = Vec::new();
        if let Some(material) = self.list.get_mut(index) {
            let finish = self.by_hand.finish(&material.name);
            apply(material, &finish, source, &mut faults);
        }
        faults
    }
}

/// Whether rays meet a body of the material, so that it can be rough, metal or glass.
fn has_body(flags: u32) -> bool {
    flags & (c::MATERIAL_SKY | c::MATERIAL_FOG | c::MATERIAL_INVISIBLE | c::MATERIAL_PORTAL) == 0
}

fn apply(
    material: &mut Material,
    finish: &Finish,
    source: &mut dyn ImageSource,
    faults: &mut Vec<String>,
) {
    let emitter = material.flags & c::MATERIAL_EMITTER;
    let OfScript {
        mut flags,
        mut dielectric,
    } = material.of_script;
    let mut specular = Specular {
        map: c::NO_TEXTURE,
        normals: c::NO_TEXTURE,
        ..Specular::default()
    };
    if finish.plain {
        flags = flags & !c::MATERIAL_REFLECTS | c::MATERIAL_PLAIN;
        dielectric.index = 0.0;
    }
    if let Some((index, part)) = finish.glass.filter(|_| has_body(flags)) {
        flags &= !(c::MATERIAL_CUT_OUT | c::MATERIAL_LIQUID);
        flags |=
            c::MATERIAL_GLASS | c::MATERIAL_TRANSLUCENT | c::MATERIAL_CLEAR | c::MATERIAL_REFLECTS;
        dielectric = Dielectric {
            index,
            scale: 1.0,
            filters: 1,
            filter_color: part,
            ..Dielectric::default()
        };
    } else if has_body(flags) && flags & c::MATERIAL_TRANSLUCENT == 0 {
        if finish.is_rough() {
            flags |= c::MATERIAL_ROUGH;
            specular.roughness = finish.roughness_or_usual();
            specular.reflectance = finish.reflectance.unwrap_or(USUAL_REFLECTANCE);
            specular.metal = match (finish.metal, &finish.surface) {
                (Some(part), _) => part,
                (None, Some(_)) => 1.0,
                (None, None) => 0.0,
            };
        }
        let mut image = |name: &str, what: &str| {
            let found = source.image(name, ImageFlags::DATA).map(|(image, _)| image);
            if found.is_none() {
                faults.push(format!(
                    "material {}: {what} {name} is missing or unreadable; the surface stays without it",
                    material.name
                ));
            }
            found
        };
        if let Some(name) = &finish.surface
            && let Some(map) = image(name, "map of roughness")
        {
            specular.map = map;
        }
        if let Some((name, scale)) = &finish.normals
            && let Some(normals) = image(name, "normal map")
        {
            let mean = source.mean(normals).truncate();
            if is_normal_map(mean) {
                flags |= c::MATERIAL_NORMALS;
                specular.normals = normals;
                specular.normal_scale = Vec2::splat(*scale);
            } else {
                faults.push(format!(
                    "material {}: {name} is no normal map: its mean colour is not blue; the surface stays without it",
                    material.name
                ));
            }
        }
        specular.sampler_index = sampler::REPEAT_MIP;
    }
    if let Some(mirror) = finish.mirror.filter(|_| has_body(flags)) {
        flags |= c::MATERIAL_REFLECTS;
        specular.mirror = mirror;
    }
    material.flags = flags | emitter;
    material.dielectric = dielectric;
    material.specular = specular;
}

/// Whether an image of this mean colour (linear) can be a normal map. One of a single channel is grey.
fn is_normal_map(mean: Vec3) -> bool {
    mean.z > LEAST_BLUE * mean.x.max(mean.y)
}
