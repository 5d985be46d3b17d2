//! A snapshot of a world's light, to switch between the directives' light and the calibrated light.

use super::RelitWorld;
use crate::emitters::{
    CalibrationReport, Emission, LightLists, LightReport, PointLight, SunLight, TriangleLight,
};
use crate::exposure::Exposure;
use glam::Vec3;

/// Everything that [`measure_materials`](RelitWorld::measure_materials), [`calibrate`](crate::calibrate()) and
/// [`sweep`](crate::light::sweep()) change in a world.
#[derive(Debug, Clone)]
pub struct Lighting {
    lights: Vec<TriangleLight>,
    triangle_lights: Vec<u32>,
    /// First light and number of lights of each surface.
    of_surfaces: Vec<(u32, u32)>,
    /// Of each material.
    emissions: Vec<Option<Emission>>,
    /// Whether light passes each material.
    passed: Vec<bool>,
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
            emissions: self.materials.iter().map(|m| m.emission).collect(),
            passed: self.materials.iter().map(|m| m.class.passed).collect(),
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
        for (material, emission) in self.materials.iter_mut().zip(lighting.emissions) {
            material.emission = emission;
        }
        for (material, passed) in self.materials.iter_mut().zip(lighting.passed) {
            material.class.passed = passed;
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
        self.exposure = lighting.exposure;
    }
}
