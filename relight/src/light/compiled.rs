//! The light sources that q3map2 makes of a map's directives and entities, in place of those that a tracer takes.
//!
//! They differ from the world's own in this:
//!
//! * glowing stages, flares and sky images without directives give no light;
//! * a surface light of value s has the radiance 3 s / 255, because q3map2 multiplies its form factor by 3, not π;
//! * each surface light has a back splash: the same polygon, moved in front and turned round, with seven times the
//!   part that `q3map_backsplash` gives (5 % by default);
//! * surfaces with `deformVertexes autosprite` are one point light;
//! * a sky light is a set of suns, which are closer to each other near the zenith;
//! * points have no extent, and light of less than one stored step is left out ([`RelitWorld::light_cutoff`]), of
//!   points alone ([`RelitWorld::cutoff_of_points`]).
//!
//! Source: q3map2 2.5.17n, by comparison with the light that it stores in maps made for it (lab/notes/bake.md).

use super::entities::{ambient_alone, compiled_light_entities, least_light};
use super::sky_suns::{SkyBox, sky_suns};
use super::{
    DEFAULT_SUN_RADIUS, Emission, EmissionSource, Falloff, Finder, POINT_LIGHT_INTENSITY,
    PointLight, SunLight, TriangleLight, build_lists, raise, surfaces,
};
use crate::files::GameFiles;
use crate::world::{NO_LIGHT, RelitWorld};
use glam::Vec3;
use shaderscript::Deform;
use support::Aabb;

/// Radiance of a surface with `q3map_surfacelight 1` of white colour.
const SURFACE_LIGHT: f32 = 3.0 / 255.0;

/// Strength of a back splash relative to the part that its directive gives.
const SPLASH: f32 = 7.0;

/// Default back splash: per cent, and distance from the surface, id units.
const USUAL_SPLASH: (f32, f32) = (5.0, 23.0);

/// Distance from a brush at which a place counts as inside of it, id units.
const ROUNDING: f32 = 0.125;

/// Light of one stored step, irradiance over π.
const STEP: f32 = 4.0 / 255.0;

impl RelitWorld {
    /// Replaces the world's light sources and ambient term by those that q3map2 makes of the map.
    pub fn take_compiled_lights(&mut self, files: &dyn GameFiles) {
        let entities = self.bsp.entities();
        let mut finder = Finder::new(files, self.color_exponent);
        let (points, mut suns) = compiled_light_entities(&entities);
        self.point_lights = points;
        for index in 0..self.materials.len() {
            let sun = self.take_material(index, &mut finder);
            suns.extend(sun);
        }
        self.suns = suns;
        self.triangle_lights.fill(NO_LIGHT);
        for surface in &mut self.surfaces {
            (surface.first_light, surface.num_lights) = (0, 0);
        }
        surfaces::add_triangle_lights(self);
        for light in &mut self.lights {
            // it shines from where the sky's surface is
            light.is_sky = false;
        }
        self.lights.extend(splashes(self));
        self.ambient = ambient_alone(&entities);
        for strength in (self.point_lights.iter_mut().map(|l| &mut l.intensity))
            .chain(self.suns.iter_mut().map(|sun| &mut sun.irradiance))
            .chain([&mut self.ambient])
        {
            *strength = match strength.min_element() < 0.0 {
                true => -raise(-*strength, self.color_exponent),
                false => raise(*strength, self.color_exponent),
            };
        }
        (self.light_cutoff, self.cutoff_of_points) = (STEP, true);
        self.report.fallback = false;
        self.report.triangle_lights = self.lights.len();
        self.report.point_lights = self.point_lights.len();
        self.report.suns = self.suns.len();
        build_lists(self);
    }

    /// Bounds that a compiler raises light to, irradiance over π: of texels, vertices, points of the light grid.
    pub fn least_light(&self) -> [Vec3; 3] {
        least_light(&self.bsp.entities()).map(|light| raise(light, self.color_exponent))
    }

    /// Sets what a material emits, and returns the suns of a sky.
    fn take_material(&mut self, index: usize, finder: &mut Finder<'_>) -> Vec<SunLight> {
        let Some(material) = self.materials.get_mut(index) else {
            return Vec::new();
        };
        let definition = material.resolved.definition().clone();
        let light = &definition.light;
        let used = |world: &RelitWorld| {
            let drawn = world.surfaces.iter().filter(|s| s.num_indices > 0);
            drawn.into_iter().any(|s| s.material as usize == index)
        };
        let value = light.surface_light.filter(|v| *v > 0.0 && v.is_finite());
        let color = match value.is_some() || light.sky_light.is_some() {
            true => finder.compiler_color(&definition),
            false => Vec3::ONE,
        };
        let sprite = definition.deforms.contains(&Deform::AutoSprite);
        let is_sky = material.is_sky();
        let source = match is_sky {
            true => EmissionSource::Sky,
            false => EmissionSource::SurfaceLight,
        };
        let strength = raise(color, self.color_exponent) * (value.unwrap_or(0.0) * SURFACE_LIGHT);
        let emits = value.is_some() && !sprite;
        material.emission = emits.then(|| Emission::of(material, source, strength));
        if let Some(value) = value.filter(|_| sprite) {
            self.add_sprites(index, color * (value * POINT_LIGHT_INTENSITY));
        }
        if !is_sky || !used(self) {
            return Vec::new();
        }
        let mut suns = Vec::new();
        let no_suns = self.bsp.entities().first().is_some_and(|world| {
            world
                .number("_noshadersun")
                .is_some_and(|value| value != 0.0)
        });
        for sun in definition.suns.iter().filter(|_| !no_suns) {
            let several = sun.samples > 1 && sun.deviance_degrees > 0.0;
            suns.push(SunLight {
                direction: sun.direction.normalize_or(Vec3::Z),
                irradiance: sun.compiler_color() * (sun.intensity * super::SUN_IRRADIANCE),
                angular_radius: match several && sun.deviance_degrees.is_finite() {
                    true => sun.deviance_degrees.min(90.0).to_radians(),
                    false => DEFAULT_SUN_RADIUS,
                },
                material: Some(index as u32),
            });
        }
        if let Some((value, iterations)) = light.sky_light {
            let outer = definition.sky.as_ref().and_then(|sky| sky.outer.as_deref());
            let images = outer.and_then(|outer| SkyBox::new(finder, outer));
            suns.extend(
                sky_suns(value, iterations, color, images.as_ref()).map(|sun| SunLight {
                    material: Some(index as u32),
                    ..sun
                }),
            );
        }
        suns.retain(|sun| sun.irradiance.is_finite() && sun.irradiance.max_element() > 0.0);
        suns
    }

    /// Adds a point light in the middle of each surface of a material.
    fn add_sprites(&mut self, material: usize, intensity: Vec3) {
        let drawn = self.surfaces.iter().filter(|s| s.num_indices > 0);
        for surface in drawn.filter(|s| s.material as usize == material) {
            let model = self.models.get(surface.model as usize);
            let offset = model.map_or(Vec3::ZERO, |model| model.origin);
            let bounds = Aabb::of(self.vertices_of(surface).iter().map(|v| v.position));
            self.point_lights.push(PointLight {
                origin: bounds.centre() + offset,
                intensity,
                radius: 0.0,
                spot: None,
                falloff: Falloff::InverseSquare,
                pulse: None,
            });
        }
    }
}

/// Back splashes of the surface lights of a world. q3map2 drops lights whose middle lies in solid.
fn splashes(world: &RelitWorld) -> Vec<TriangleLight> {
    let lamps = world.lights.iter();
    let of_lamp = |light: &TriangleLight| {
        if light.source != EmissionSource::SurfaceLight {
            return None; // of the sky
        }
        let surface = world.surfaces.get(light.surface as usize)?;
        let directives = &world.material_of(surface)?.resolved.definition().light;
        let (percent, distance) = directives.backsplash.unwrap_or(USUAL_SPLASH);
        let usable = percent > 0.0 && percent.is_finite() && distance.is_finite();
        let offset = light.normal() * distance;
        let [a, b, c] = light.vertices.map(|v| v + offset);
        let middle = Aabb::of(light.vertices).centre() + light.normal() * (distance + 1.0);
        (usable && has_room(world, middle)).then_some(TriangleLight {
            vertices: [a, c, b],
            radiance: light.radiance * (SPLASH * percent / 100.0),
            triangle: u32::MAX,
            ..*light
        })
    };
    lamps.filter_map(of_lamp).collect()
}

/// Whether a light's place is outside of solids, or one of the places around it to which q3map2 moves a light.
fn has_room(world: &RelitWorld, place: Vec3) -> bool {
    const MOVES: [f32; 4] = [0.0, 2.0, -2.0, 4.0];
    let is_free =
        |at: Vec3| world.bsp.cluster_at(at) >= 0 && !world.bsp.is_in_drawn_brush(at, -ROUNDING);
    let mut moves = MOVES.iter().flat_map(|x| {
        let rows = MOVES.iter();
        rows.flat_map(move |y| MOVES.iter().map(move |z| Vec3::new(*x, *y, *z)))
    });
    moves.any(|by| is_free(place + by))
}
