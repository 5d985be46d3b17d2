//! A snapshot of a world's light, to switch between the directives' light and the calibrated light.

use super::{RelitWorld, WorldMaterial};
use crate::emitters::{
    CalibrationReport, Emission, LightLists, LightReport, PointLight, SunLight, TriangleLight,
};
use crate::exposure::Exposure;
use glam::Vec3;
use std::collections::HashMap;

/// Everything that [`measure_materials`](RelitWorld::measure_materials), [`calibrate`](crate::calibrate()) and
/// [`sweep`](crate::light::sweep()) change in a world.
#[derive(Debug, Clone)]
pub struct Lighting {
    lights: Vec<TriangleLight>,
    triangle_lights: Vec<u32>,
    /// First light and number of lights of each surface.
    of_surfaces: Vec<(u32, u32)>,
    /// Emission of each material, and whether light passes it.
    of_materials: Vec<(Option<Emission>, bool)>,
    point_lights: Vec<PointLight>,
    suns: Vec<SunLight>,
    light_lists: LightLists,
    ambient: Vec3,
    report: LightReport,
    calibration: Option<CalibrationReport>,
    color_exponent: f32,
    stored_gamma: f32,
    light_cutoff: f32,
    has_compiled_lights: bool,
    shadowless_curves: bool,
    exposure: Option<Exposure>,
}

impl RelitWorld {
    /// Copies the world's light.
    pub fn lighting(&self) -> Lighting {
        Lighting {
            lights: self.lights.clone(),
            triangle_lights: self.triangle_lights.clone(),
            of_surfaces: (self.surfaces.iter())
                .map(|s| (s.first_light, s.num_lights))
                .collect(),
            of_materials: self.materials.iter().map(light_of).collect(),
            point_lights: self.point_lights.clone(),
            suns: self.suns.clone(),
            light_lists: self.light_lists.clone(),
            ambient: self.ambient,
            report: self.report.clone(),
            calibration: self.calibration.clone(),
            color_exponent: self.color_exponent,
            stored_gamma: self.stored_gamma,
            light_cutoff: self.light_cutoff,
            has_compiled_lights: self.has_compiled_lights,
            shadowless_curves: self.shadowless_curves,
            exposure: self.exposure,
        }
    }

    /// Restores a snapshot.
    pub fn set_lighting(&mut self, lighting: Lighting) {
        self.lights = lighting.lights;
        self.triangle_lights = lighting.triangle_lights;
        for (surface, (first, count)) in self.surfaces.iter_mut().zip(lighting.of_surfaces) {
            (surface.first_light, surface.num_lights) = (first, count);
        }
        for (material, (emission, passed)) in self.materials.iter_mut().zip(lighting.of_materials) {
            (material.emission, material.class.passed) = (emission, passed);
            if passed {
                material.holes = None;
            }
        }
        self.point_lights = lighting.point_lights;
        self.suns = lighting.suns;
        self.light_lists = lighting.light_lists;
        self.ambient = lighting.ambient;
        self.report = lighting.report;
        self.calibration = lighting.calibration;
        self.color_exponent = lighting.color_exponent;
        self.stored_gamma = lighting.stored_gamma;
        self.light_cutoff = lighting.light_cutoff;
        self.has_compiled_lights = lighting.has_compiled_lights;
        self.shadowless_curves = lighting.shadowless_curves;
        self.exposure = lighting.exposure;
    }

    /// Takes the light of a world with the same surfaces and other lightmap coordinates. These decide how materials are
    /// lit, so that the same material may have another number.
    pub fn take_lighting(&mut self, other: &RelitWorld) {
        let key = |m: &WorldMaterial| {
            (
                m.name.to_ascii_lowercase(),
                m.surface_flags,
                m.content_flags,
            )
        };
        let others: HashMap<_, _> = (other.materials.iter())
            .map(|material| (key(material), light_of(material)))
            .collect();
        let of_materials = self.materials.iter().map(|material| {
            let found = others.get(&key(material)).copied();
            found.unwrap_or_else(|| light_of(material))
        });
        let lighting = Lighting {
            of_materials: of_materials.collect(),
            ..other.lighting()
        };
        self.set_lighting(lighting);
    }
}

/// Emission of a material, and whether light passes it.
fn light_of(material: &WorldMaterial) -> (Option<Emission>, bool) {
    (material.emission, material.class.passed)
}
