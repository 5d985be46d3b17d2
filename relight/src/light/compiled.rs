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
//! * light passes `surfaceparm trans` without `alphashadow`, liquids among them;
//! * curves cast no shadow ([`RelitWorld::shadowless_curves`]);
//! * points have no extent, and light of less than one stored step is left out ([`RelitWorld::light_cutoff`]), of
//!   points alone ([`RelitWorld::has_compiled_lights`]).
//!
//! Source: q3map2 2.5.17n, by comparison with the light that it stores in maps made for it (lab/notes/bake.md).

use super::entities::{ambient_alone, compiled_light_entities, least_light};
use super::sky_suns::{SkyBox, sky_suns};
use super::{
    DEFAULT_SUN_RADIUS, Emission, EmissionSource, Falloff, Finder, POINT_LIGHT_INTENSITY,
    PointLight, SunLight, TriangleLight, build_lists, raise, surfaces,
};
use crate::files::GameFiles;
use crate::world::{NO_LIGHT, RelitWorld, WorldMaterial};
use glam::Vec3;
use q3bsp::{content_flags, surface_flags};
use shaderscript::Deform;
use support::Aabb;

/// Radiance of a surface with `q3map_surfacelight 1` of white colour.
const SURFACE_LIGHT: f32 = 3.0 / 255.0;

/// Strength of a back splash relative to the part that its directive gives.
const SPLASH: f32 = 7.0;

/// Default back splash: per cent, and distance from the surface, id units.
const USUAL_SPLASH: (f32, f32) = (5.0, 23.0);

/// Default of `q3map_lightSubdivide`, id units.
const USUAL_SUBDIVISION: f32 = 999.0;

/// Most halvings of a light: for directives that ask for tiny pieces.
const MOST_HALVINGS: u32 = 12;

/// Smallest area of a piece, square id units.
const LEAST_AREA: f32 = 1.0 / 64.0;

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
        surfaces::add_triangle_lights(self);
        self.lights = (self.lights.iter())
            .flat_map(|light| pieces(self, light))
            .collect();
        self.triangle_lights.fill(NO_LIGHT);
        for surface in &mut self.surfaces {
            (surface.first_light, surface.num_lights) = (0, 0);
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
        (self.light_cutoff, self.has_compiled_lights) = (STEP, true);
        self.shadowless_curves = true;
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
        if is_passed(material) {
            material.class.passed = true;
            material.holes = None;
        }
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

/// The pieces that q3map2 makes of a light: halves at the middle of its bounds, across x, y, z, until no side exceeds
/// `q3map_lightSubdivide`.
fn pieces(world: &RelitWorld, light: &TriangleLight) -> Vec<TriangleLight> {
    let surface = world.surfaces.get(light.surface as usize);
    let material = surface.and_then(|surface| world.material_of(surface));
    let most = material.and_then(|m| m.resolved.definition().light.light_subdivide);
    let most = most.filter(|most| *most > 0.0).unwrap_or(USUAL_SUBDIVISION);
    let mut whole = vec![(light.vertices.to_vec(), 0)];
    let mut made = Vec::new();
    while let Some((polygon, halvings)) = whole.pop() {
        let bounds = Aabb::of(polygon.iter().copied());
        let size = bounds.size().to_array();
        let across = (0..3).find(|&axis| size[axis] > most);
        if let Some(axis) = across.filter(|_| halvings < MOST_HALVINGS) {
            for side in [1.0, -1.0] {
                let part = half(&polygon, axis, bounds.centre()[axis], side);
                whole.push((part, halvings + 1));
            }
            continue;
        }
        let corners = polygon.windows(2).skip(1).map(|pair| match pair {
            &[b, c] => [polygon.first().copied().unwrap_or(b), b, c],
            _ => [Vec3::ZERO; 3],
        });
        made.extend(corners.map(|vertices| TriangleLight {
            vertices,
            // a piece of a triangle, which shines from where the sky's surface is
            triangle: u32::MAX,
            is_sky: false,
            ..*light
        }));
    }
    made.retain(|piece| piece.area() > LEAST_AREA);
    made
}

/// The part of a convex polygon on one side of a plane across an axis.
fn half(polygon: &[Vec3], axis: usize, middle: f32, side: f32) -> Vec<Vec3> {
    let next = polygon.iter().cycle().skip(1);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (&p, &q) in polygon.iter().zip(next) {
        let (here, there) = ((p[axis] - middle) * side, (q[axis] - middle) * side);
        if here >= 0.0 {
            kept.push(p);
        }
        if here * there < 0.0 {
            kept.push(p + (q - p) * (here / (here - there)));
        }
    }
    kept
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
            two_sided: false,
            ..*light
        })
    };
    lamps.filter_map(of_lamp).collect()
}

/// Whether q3map2 lets all light through a material: `surfaceparm trans` without `alphashadow`, liquids and fences among
/// them.
fn is_passed(material: &WorldMaterial) -> bool {
    let translucent = material.content_flags & content_flags::TRANSLUCENT != 0;
    translucent && material.surface_flags & surface_flags::ALPHASHADOW == 0
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_a_polygon_fill_it() {
        let triangle = [Vec3::ZERO, Vec3::X * 8.0, Vec3::Y * 8.0];
        let area = |polygon: &[Vec3]| -> f32 {
            let fan = polygon.windows(2).skip(1);
            fan.map(|p| (p[0] - polygon[0]).cross(p[1] - polygon[0]).z * 0.5)
                .sum()
        };
        let (right, left) = (half(&triangle, 0, 4.0, 1.0), half(&triangle, 0, 4.0, -1.0));
        assert_eq!((right.len(), left.len()), (3, 4));
        assert_eq!((area(&right), area(&left)), (8.0, 24.0));
        assert!(right.iter().all(|p| p.x >= 4.0) && left.iter().all(|p| p.x <= 4.0));
    }
}
