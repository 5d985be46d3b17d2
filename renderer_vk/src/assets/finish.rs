//! Applies what packs and files of materials state (`relight::materials::finish`): it overrides what a material's stages
//! decide about its reflection.

use glam::Vec3;
use relight::materials::by_hand::MaterialsByHand;
use relight::materials::finish::{Finish, MapFault};
use shaders::types::{Dielectric, Specular, constants as c};
use shaderscript::TcGen;

use super::compile::sampler;
use super::material::{LightmapClass, Material};
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

/// Reflectance at normal incidence that materials other than metal and gems stay below.
const LITTLE: f32 = 0.2;

impl Materials {
    /// Replaces the files of materials, and changes all materials accordingly. Returns what is wrong with their images.
    pub fn set_by_hand(
        &mut self,
        by_hand: MaterialsByHand,
        source: &mut dyn ImageSource,
    ) -> Vec<String> {
        if self.by_hand.as_ref() == Some(&by_hand) {
            return Vec::new();
        }
        self.by_hand = Some(by_hand);
        let mut faults = Vec::new();
        for index in 0..self.list.len() {
            faults.extend(self.finish(index, source));
        }
        faults.sort();
        faults.dedup();
        self.touch();
        faults
    }

    /// Whether files of materials have been read.
    pub fn has_files(&self) -> bool {
        self.by_hand.is_some()
    }

    /// Whether a material is rough or has a normal map. `frosted`: glass counts too.
    pub fn has_gloss(&self, frosted: bool) -> bool {
        self.list.iter().any(|m| is_glossy(m.flags, frosted))
    }

    /// Whether a material has a normal map.
    pub fn has_normals(&self) -> bool {
        let has = |material: &Material| material.flags & c::MATERIAL_NORMALS != 0;
        self.list.iter().any(has)
    }

    /// Whether a normal map has heights.
    pub fn has_heights(&self) -> bool {
        let has = |material: &Material| material.flags & c::MATERIAL_HEIGHTS != 0;
        self.list.iter().any(has)
    }

    /// Whether a rough material reflects more than [`LITTLE`] at normal incidence.
    pub fn has_metal(&self) -> bool {
        self.list.iter().any(|material| material.metallic)
    }

    /// Applies the files to a material. Returns what is wrong with its images.
    pub(super) fn finish(&mut self, index: usize, source: &mut dyn ImageSource) -> Vec<String> {
        let mut faults = Vec::new();
        if let Some(material) = self.list.get_mut(index)
            && let Some(by_hand) = &self.by_hand
            && material.lightmap_class != LightmapClass::TwoD
        {
            let exists = |image: &str| source.exists(image);
            let of_pack = (self.scripts).of_pack(&material.name, &material.shader, &exists);
            let finish = by_hand.finish(&material.name, &of_pack);
            let of_mtr = self.scripts.mtr_faults(&material.name);
            faults.extend(of_mtr.map(ToString::to_string));
            apply(material, &finish, source, &mut faults);
        }
        faults
    }
}

/// Whether a material with these `MATERIAL_*` bits is rough or has a normal map. `frosted`: glass counts too.
pub fn is_glossy(flags: u32, frosted: bool) -> bool {
    let gloss = c::MATERIAL_ROUGH | c::MATERIAL_NORMALS;
    flags & gloss != 0 && (frosted || flags & c::MATERIAL_GLASS == 0)
}

/// Whether rays meet a body of the material, so that it can be rough, metal or glass.
fn has_body(flags: u32) -> bool {
    flags & (c::MATERIAL_SKY | c::MATERIAL_FOG | c::MATERIAL_INVISIBLE | c::MATERIAL_PORTAL) == 0
}

/// GPU stage of the first texture, which maps lie on, if it has other coordinates than the vertices.
fn maps_stage(material: &Material) -> Option<u32> {
    let mut stages = (material.stage_first..).zip(&material.shader.stages);
    let (index, stage) = stages.find(|(_, stage)| stage.tc_gen != TcGen::Lightmap)?;
    (!stage.tc_mods.is_empty()).then_some(index)
}

fn apply(
    material: &mut Material,
    finish: &Finish,
    source: &mut dyn ImageSource,
    faults: &mut Vec<String>,
) {
    let emitter = material.flags & c::MATERIAL_EMITTER;
    material.metallic = false;
    let OfScript {
        mut flags,
        mut dielectric,
    } = material.of_script;
    let mut specular = Specular {
        map: c::NO_TEXTURE,
        normals: c::NO_TEXTURE,
        glow: c::NO_TEXTURE,
        stage: maps_stage(material).unwrap_or(c::NO_STAGE),
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
        if let Some(roughness) = finish.roughness {
            flags |= c::MATERIAL_ROUGH;
            specular.roughness = roughness;
        }
    } else if has_body(flags) && flags & c::MATERIAL_TRANSLUCENT == 0 {
        let mut finish = finish.clone();
        let map = (finish.surface.as_ref()).and_then(|map| source.surface_map(map));
        let normals = (finish.normals.as_ref())
            .and_then(|map| Some(source.image(&map.image, ImageFlags::DATA)?.0));
        let mean = normals.map(|image| source.mean(image));
        let checks = [
            finish.check_surface(map.is_some()),
            finish.check_normals(mean.map(|mean| mean.truncate())),
            finish.check_heights(mean.map(|mean| mean.w)),
        ];
        let name = &material.name;
        let checks = checks.into_iter().filter_map(Result::err);
        faults.extend(checks.map(|fault| format!("material {name}: {fault}")));
        if finish.is_rough() {
            flags |= c::MATERIAL_ROUGH;
            specular.roughness = finish.roughness_or_usual();
            specular.reflectance = finish.reflectance_or_usual();
            specular.metal = finish.metal_or_usual();
            // the numbers are factors of a map of reflectance
            let map = (map.zip(finish.surface.as_ref()))
                .filter(|(_, surface)| surface.is_specular())
                .map_or(Vec3::ONE, |(map, _)| source.mean(map).truncate());
            let most = (specular.reflectance * map).max_element();
            material.metallic = specular.metal.max(most) > LITTLE;
        }
        if let (Some(surface), Some(map)) = (&finish.surface, map) {
            specular.map = map;
            if surface.is_specular() {
                flags |= c::MATERIAL_SPECULAR_MAP;
            }
        }
        if let (Some(map), Some(normals)) = (&finish.normals, normals) {
            flags |= c::MATERIAL_NORMALS;
            specular.normals = normals;
            specular.normal_scale = map.scale;
            if map.depth != 0.0 {
                flags |= c::MATERIAL_HEIGHTS;
                specular.depth = map.depth;
            }
        }
        specular.sampler_index = sampler::REPEAT_MIP;
    }
    if let Some(glow) = finish.glow.as_ref().filter(|_| has_body(flags)) {
        match source.image(&glow.image, ImageFlags::WORLD) {
            Some((image, _)) => {
                flags |= c::MATERIAL_GLOWS;
                specular.glow = image;
                specular.glow_radiance = glow.radiance;
                specular.sampler_index = sampler::REPEAT_MIP;
            }
            None => {
                let fault = MapFault::NoGlow(glow.image.clone());
                faults.push(format!("material {}: {fault}", material.name));
            }
        }
    }
    if let Some(mirror) = finish.mirror.filter(|_| has_body(flags)) {
        flags |= c::MATERIAL_REFLECTS;
        specular.mirror = mirror;
    }
    material.flags = flags | emitter;
    material.dielectric = dielectric;
    material.specular = specular;
}
