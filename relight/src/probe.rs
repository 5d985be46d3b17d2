//! Rays into a map: which surface a ray meets, and which lights reach a place.

use std::f32::consts::PI;

use glam::Vec3;
use support::random::Random;

use crate::calibrate::triangle_lights::{lambert, visible_part};
use crate::emitters::{LightRef, PointLight};
use crate::occluders::Occluders;
use crate::world::RelitWorld;

/// Distance of a place from its surface, id units.
const LIFT: f32 = 1.0;

/// A surface that a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// Distance, id units.
    pub distance: f32,
    /// Place.
    pub point: Vec3,
    /// Unit normal of the side that the ray meets.
    pub normal: Vec3,
    /// Index into [`RelitWorld::surfaces`].
    pub surface: u32,
}

/// A source of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The triangle lights of a surface, by its index.
    Surface(u32),
    /// Index into [`RelitWorld::point_lights`].
    Point(u32),
    /// Index into [`RelitWorld::suns`].
    Sun(u32),
}

/// Light of a source at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arriving {
    /// The source.
    pub source: Source,
    /// Irradiance, linear, with shadows.
    pub irradiance: Vec3,
    /// Part of the source's light that arrives, 0 to 1.
    pub visible: f32,
}

/// Rays into one world. Valid while its geometry is unchanged.
pub struct Probe {
    /// What stops light.
    solid: Occluders,
    /// What is drawn, brush models at their places at start.
    drawn: Occluders,
    surface_of: Vec<u32>,
}

impl Probe {
    /// Builds the hierarchies.
    pub fn new(world: &RelitWorld) -> Self {
        let drawn = world.surfaces.iter().filter(|s| s.num_indices > 0);
        let triangles = drawn.flat_map(|surface| {
            let model = world.models.get(surface.model as usize);
            let origin = model.map_or(Vec3::ZERO, |m| m.origin);
            let place = move |t: usize| world.triangle(t).map(|corner| corner + origin);
            surface
                .triangles()
                .map(move |t| (place(t), false, t as u32))
        });
        Self {
            solid: Occluders::of_world(world),
            drawn: Occluders::new(triangles),
            surface_of: world.surfaces_of_triangles(),
        }
    }

    /// The first drawn surface along a ray; `direction`: a unit vector.
    pub fn surface(&self, from: Vec3, direction: Vec3) -> Option<Met> {
        let hit = self.drawn.nearest(from, direction, f32::INFINITY)?;
        let against = if hit.normal.dot(direction) > 0.0 {
            -1.0
        } else {
            1.0
        };
        Some(Met {
            distance: hit.t,
            point: from + direction * hit.t,
            normal: hit.normal * against,
            surface: self.surface_of.get(hit.tag as usize).copied()?,
        })
    }

    /// Distance to the first surface that stops light, up to `limit`; `direction`: a unit vector.
    pub fn distance(&self, from: Vec3, direction: Vec3, limit: f32) -> Option<f32> {
        let hit = self.solid.nearest(from, direction, limit);
        hit.map(|hit| hit.t)
    }

    /// Whether nothing between two places stops light.
    pub fn sees(&self, from: Vec3, to: Vec3) -> bool {
        !self.solid.blocked(from, to, false)
    }

    /// Direct light at a place of a surface with this unit normal, the strongest source first; sources whose light
    /// does not arrive are left out.
    pub fn light(&self, world: &RelitWorld, point: Vec3, normal: Vec3) -> Vec<Arriving> {
        let position = point + normal * LIFT;
        let row = world.light_lists.row(world.bsp.cluster_at(position));
        let mut random = Random::new(1);
        let mut found: Vec<Arriving> = Vec::new();
        // light with and without shadows
        let mut add = |source: Source, bare: Vec3, visible: f32| {
            if bare.max_element() <= 0.0 {
                return;
            }
            let entry = found.iter_mut().find(|a| a.source == source);
            let arrived = bare * visible;
            match entry {
                Some(entry) => {
                    entry.irradiance += arrived;
                    entry.visible += bare.element_sum();
                }
                None => found.push(Arriving {
                    source,
                    irradiance: arrived,
                    visible: bare.element_sum(),
                }),
            }
        };
        for &entry in row {
            match world.light_lists.light(entry) {
                LightRef::Triangle(index) => {
                    let Some(light) = world.lights.get(index as usize) else {
                        continue;
                    };
                    let bare = lambert(position, normal, light);
                    if bare > 0.0 {
                        let seen = visible_part(&self.solid, position, normal, light, &mut random);
                        add(Source::Surface(light.surface), light.radiance * bare, seen);
                    }
                }
                LightRef::Point(index) => {
                    let Some(light) = world.point_lights.get(index as usize) else {
                        continue;
                    };
                    let bare = light.intensity * of_point(light, position, normal);
                    let seen = bare.max_element() > 0.0 && self.sees(position, light.origin);
                    add(Source::Point(index), bare, f32::from(u8::from(seen)));
                }
            }
        }
        for (index, sun) in (0u32..).zip(&world.suns) {
            let cosine = normal.dot(sun.direction).max(0.0);
            let hit = || self.solid.nearest(position, sun.direction, f32::INFINITY);
            let seen = cosine > 0.0 && hit().is_none_or(|hit| hit.sky);
            add(
                Source::Sun(index),
                sun.irradiance * cosine,
                f32::from(u8::from(seen)),
            );
        }
        found.retain(|a| a.irradiance.max_element() > 0.0);
        for arriving in &mut found {
            arriving.visible = arriving.irradiance.element_sum() / arriving.visible;
        }
        let strength = |a: &Arriving| a.irradiance.element_sum();
        found.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
        found
    }
}

/// Irradiance of a point light of intensity 1, without shadows.
fn of_point(light: &PointLight, position: Vec3, normal: Vec3) -> f32 {
    let offset = light.origin - position;
    let distance = offset.length();
    if distance <= f32::EPSILON {
        return 0.0;
    }
    let cone = light.spot.map_or(1.0, |spot| spot.part(offset));
    let cosine = (normal.dot(offset) / distance).max(0.0);
    light.falloff.irradiance(distance, cosine) * cone
}

/// Radiance of a white surface under an irradiance, relative to display white.
pub fn shown_on_white(irradiance: Vec3) -> Vec3 {
    irradiance / PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::Sample;
    use crate::{Materials, Options};

    fn world() -> RelitWorld {
        let files = Sample::Hall.files().unwrap();
        let (materials, _) = Materials::load(&files);
        let options = Options {
            calibrate: None,
            ..Options::default()
        };
        RelitWorld::load(&files, &materials, Sample::Hall.map(), options).unwrap()
    }

    #[test]
    fn a_ray_down_meets_the_floor_under_every_spawn_point() {
        let world = world();
        let probe = Probe::new(&world);
        let mut count = 0;
        for view in crate::viewpoints::spawn_views(&world.bsp.entities()) {
            let met = probe.surface(view.origin, Vec3::NEG_Z).unwrap();
            assert!(met.normal.z > 0.5, "{met:?}");
            assert!(met.distance > 0.0 && met.distance < 512.0, "{met:?}");
            let surface = &world.surfaces[met.surface as usize];
            let low = surface.mins - Vec3::ONE;
            let high = surface.maxs + Vec3::ONE;
            assert!(met.point.cmpge(low).all() && met.point.cmple(high).all());
            count += 1;
        }
        assert!(count > 0);
    }

    #[test]
    fn a_point_light_gives_the_closed_form_and_nothing_behind_a_wall() {
        let mut world = world();
        let view = crate::viewpoints::spawn_views(&world.bsp.entities())
            .next()
            .unwrap();
        let probe = Probe::new(&world);
        let floor = probe.surface(view.origin, Vec3::NEG_Z).unwrap();
        let height = 20.0;
        let (file, _) = crate::light::LightsByHand::parse(&format!(
            "without points\nwithout suns\nwithout surfaces\npoint {} {} {} 300 1 1 1",
            floor.point.x,
            floor.point.y,
            floor.point.z + LIFT + height,
        ));
        file.apply(&mut world);
        let intensity = world.point_lights[0].intensity;
        let found = probe.light(&world, floor.point, Vec3::Z);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].source, Source::Point(0));
        assert_eq!(found[0].visible, 1.0);
        let expected = intensity / (height * height);
        assert!((found[0].irradiance - expected).length() < 1e-3 * expected.length());
        // below the floor the light is behind the surface
        assert!(probe.light(&world, floor.point, Vec3::NEG_Z).is_empty());
    }
}
