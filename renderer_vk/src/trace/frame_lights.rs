//! The lights of one view: flickering emitters and pulsing points at their present brightness; emitting surfaces of
//! brush models at their present position; the game's dynamic lights; the flashlight; and the clusters that each can
//! reach.

use std::f32::consts::PI;

use glam::Vec3;
use relight::light::{ClusterSet, STRONGEST, Sight};
use shaders::trace_types as t;
use shaders::trace_types::constants as c;
use shaders::types::Instance;
use support::{Aabb, slice};

use super::light_selection::{estimator, uses_tree};
use super::light_tree::Emission;
use super::lights::{
    ChangingLight, MapLights, count, number, sphere, sphere_bounds, triangle_bounds,
};
use crate::api::DynamicLight;
use crate::gpu::{Error, Recorder};
use crate::scene::{TracedScene, View};
use crate::settings::Settings;

/// Lights of a view, with the clusters that they reach.
#[derive(Debug, Default)]
struct FrameLights {
    triangles: Vec<t::TriangleLight>,
    spheres: Vec<t::SphereLight>,
    /// Light numbers, with the clusters that each light can reach.
    reach: Vec<(u32, ClusterSet)>,
    /// Lights of the tree over those that move or change: index in the tree, number, emission.
    leafs: Vec<(usize, u32, Emission)>,
}

/// What finds a light of a brush model.
#[derive(Clone, Copy)]
enum Holder<'a> {
    /// The lists of the clusters that it reaches.
    Lists(&'a Sight),
    /// The tree, from this index on.
    Tree(usize),
}

/// Distance around a light within which its clusters are searched, units: leafs end at the surface of lamps.
const SEARCH_MARGIN: f32 = 2.0;

impl FrameLights {
    /// Uploads the lights for one frame. `clusters`: number of the map's clusters.
    fn upload(
        &self,
        rec: &mut Recorder,
        clusters: usize,
        lights: &mut t::LightView,
    ) -> Result<(), Error> {
        let arena = rec.arena();
        if !self.triangles.is_empty() {
            let bounds: Vec<_> = self.triangles.iter().map(triangle_bounds).collect();
            lights.triangles[1] = arena.push(&self.triangles)?;
            lights.bounds[1] = arena.push(&bounds)?;
        }
        if !self.spheres.is_empty() {
            let bounds: Vec<_> = self.spheres.iter().map(sphere_bounds).collect();
            lights.spheres[1] = arena.push(&self.spheres)?;
            lights.bounds[3] = arena.push(&bounds)?;
        }
        if !self.reach.is_empty() {
            let (rows, entries) = self.rows(clusters);
            lights.dynamic_rows = arena.push(&rows)?;
            lights.dynamic_lights = arena.push(&entries)?;
            lights.dynamic_row_count = count(rows.len());
        }
        Ok(())
    }

    /// Adds the animated lights of the world, which are all lights so far, to those of the tree.
    fn add_leafs(&mut self) {
        let triangles = self.triangles.iter().enumerate().map(|(i, light)| {
            let light_number = number(c::LIGHT_CHANGING_TRIANGLE, i);
            (light_number, Emission::of_triangle(light))
        });
        let spheres = self.spheres.iter().enumerate().map(|(i, light)| {
            let light_number = number(c::LIGHT_CHANGING_SPHERE, i);
            (light_number, Emission::of_sphere(light))
        });
        let leafs = triangles.chain(spheres).enumerate();
        self.leafs = leafs.map(|(at, (n, e))| (at, n, e)).collect();
    }

    fn add_sphere(&mut self, light: t::SphereLight, sight: &Sight) {
        let margin = Vec3::splat(light.radius.max(SEARCH_MARGIN));
        let line = light.axis * light.half_length;
        let ends = Aabb::of([light.origin - line, light.origin + line]);
        let at = sight.touching(ends.grown(margin));
        let light_number = number(c::LIGHT_CHANGING_SPHERE, self.spheres.len());
        self.spheres.push(light);
        self.reach.push((light_number, sight.lit_from(&at)));
    }

    /// Adds the emitting triangles of a model. `scale_of`: factor of a light's radiance.
    fn add_model(
        &mut self,
        lights: &[ChangingLight],
        instance: &Instance,
        scale_of: impl Fn(&ChangingLight) -> f32,
        holder: Holder<'_>,
    ) {
        let place = |p: Vec3| {
            let [x, y, z] = instance.axis;
            x * p.x + y * p.y + z * p.z + instance.origin
        };
        let first = self.triangles.len();
        let mut bounds = Aabb::EMPTY;
        for (index, light) in lights.iter().enumerate() {
            let corners = light.light.corners.map(place);
            if !corners.iter().all(|p| p.is_finite()) {
                continue;
            }
            bounds = bounds.union(Aabb::of(corners));
            let present = t::TriangleLight {
                corners,
                radiance: light.light.radiance * scale_of(light),
                flags: light.light.flags,
                end: light.light.end * scale_of(light),
            };
            if let Holder::Tree(first_leaf) = holder {
                let light_number = number(c::LIGHT_CHANGING_TRIANGLE, self.triangles.len());
                let emission = Emission::of_triangle(&present);
                self.leafs
                    .push((first_leaf + index, light_number, emission));
            }
            self.triangles.push(present);
        }
        let Holder::Lists(sight) = holder else {
            return;
        };
        if self.triangles.len() == first {
            return;
        }
        let margin = Vec3::splat(SEARCH_MARGIN);
        let reached = sight.lit_from(&sight.touching(bounds.grown(margin)));
        for index in first..self.triangles.len() {
            let light_number = number(c::LIGHT_CHANGING_TRIANGLE, index);
            self.reach.push((light_number, reached.clone()));
        }
    }

    /// The list of each of `clusters` clusters, then a list of all lights.
    fn rows(&self, clusters: usize) -> (Vec<t::DynamicRow>, Vec<u32>) {
        let mut counts = vec![0u32; clusters];
        for (_, reach) in &self.reach {
            for cluster in reach.iter() {
                if let Some(count) = counts.get_mut(cluster) {
                    *count += 1;
                }
            }
        }
        let mut first = 0;
        let mut rows: Vec<t::DynamicRow> = counts
            .iter()
            .map(|&count| {
                let row = t::DynamicRow { first, count: 0 };
                first += count;
                row
            })
            .collect();
        let mut entries = vec![0u32; first as usize];
        for (light, reach) in &self.reach {
            for cluster in reach.iter() {
                let Some(row) = slice::get_mut(&mut rows, cluster) else {
                    continue;
                };
                if let Some(entry) = entries.get_mut((row.first + row.count) as usize) {
                    *entry = *light;
                }
                row.count += 1;
            }
        }
        rows.push(t::DynamicRow {
            first: count(entries.len()),
            count: count(self.reach.len()),
        });
        entries.extend(self.reach.iter().map(|(light, _)| *light));
        (rows, entries)
    }
}

impl MapLights {
    /// The lights of a view; uploads those that only this frame has.
    ///
    /// # Errors
    /// Out of memory.
    pub fn of_view(
        &self,
        rec: &mut Recorder,
        view: &TracedScene,
        settings: &Settings,
    ) -> Result<t::LightView, Error> {
        let trees = match uses_tree(settings) {
            true => Some(self.trees(&rec.device().clone())?),
            false => None,
        };
        let frame = self.frame_lights(view, settings);
        let mut lights = self.fixed();
        frame.upload(rec, self.sight.count(), &mut lights)?;
        if let Some(trees) = trees {
            trees.add_to(rec, &frame.leafs, &mut lights)?;
        }
        if !settings.rt_cull_lights {
            // without a tree every point uses the last row, which holds all lights
            lights.node_count = 0;
        }
        lights.flags = if settings.rt_soft_shadows {
            c::LIGHTS_SOFT
        } else {
            0
        };
        lights.selection = estimator(settings);
        // all lights are one estimate
        lights.samples = match settings.rt_num_random_dl {
            0 => 1,
            picked => picked * settings.rt_samples,
        };
        lights.candidates = settings.rt_candidates.max(1);
        lights.scale = settings.rt_light_scale.max(0.0);
        lights.ambient = self.ambient * lights.scale;
        Ok(lights)
    }

    /// The lights that change from frame to frame: animated and moving lights of the map, and those of the game.
    fn frame_lights(&self, view: &TracedScene, settings: &Settings) -> FrameLights {
        let scale = settings.rt_light_scale.max(0.0);
        // the engine's time, by which stages are animated
        let time = f64::from(view.time);
        let flickers: Vec<f32> = self.flickers.iter().map(|f| f.scale(time)).collect();
        let scale_of = |light: &ChangingLight| {
            let flicker: Option<&f32> = light.flicker.and_then(|f| flickers.get(f));
            scale * flicker.copied().unwrap_or(1.0)
        };
        let mut frame = FrameLights {
            // the lists index them by position: all of them, and first
            triangles: self
                .changing
                .iter()
                .map(|changing| t::TriangleLight {
                    radiance: changing.light.radiance * scale_of(changing),
                    end: changing.light.end * scale_of(changing),
                    ..changing.light
                })
                .collect(),
            spheres: (self.pulsing.iter())
                .map(|(light, pulse)| pulsed(light, scale * pulse.scale(time)))
                .collect(),
            ..FrameLights::default()
        };
        let has_tree = uses_tree(settings);
        if has_tree {
            frame.add_leafs();
        }
        let mut in_tree = Vec::new();
        for submodel in &view.look.submodels {
            let model = self.moving.iter().position(|(m, _)| *m == submodel.model);
            let lights = model.and_then(|at| Some((at, &self.moving.get(at)?.1)));
            let instance = view.instances.get(submodel.instance as usize);
            if let (Some((at, lights)), Some(instance)) = (lights, instance) {
                // the tree has one place for each light of a model: further instances are in lists
                let holder = if has_tree && !in_tree.contains(&at) {
                    in_tree.push(at);
                    let before = self.moving.iter().take(at).map(|(_, l)| l.len());
                    let world = self.changing.len() + self.pulsing.len();
                    Holder::Tree(world + before.sum::<usize>())
                } else {
                    Holder::Lists(&self.sight)
                };
                frame.add_model(lights, instance, scale_of, holder);
            }
        }
        if settings.dynamic_light {
            let scale = settings.rt_dlight_scale.max(0.0) * self.white;
            for light in dynamic_lights(&view.dlights, scale) {
                frame.add_sphere(light, &self.sight);
            }
        }
        if settings.rt_flashlight {
            frame.add_sphere(flashlight(&view.view, self.white), &self.sight);
        }
        frame
    }
}

/// A point light scaled to its present strength.
fn pulsed(light: &t::SphereLight, scale: f32) -> t::SphereLight {
    t::SphereLight {
        radiance: light.radiance * scale,
        end: light.end * scale,
        ..*light
    }
}

/// Radius of a dynamic light: part of its reach, and bounds in units, about the size of a muzzle flash.
const DYNAMIC_LIGHT_SIZE: (f32, f32, f32) = (0.02, 2.0, 8.0);

/// Geometry closer than this to a dynamic light, units, casts no shadow: the projectile or weapon that carries it.
const DYNAMIC_LIGHT_CLEARANCE: f32 = 20.0;

/// Radius of the glowing gas, as a part of the light's reach.
const DYNAMIC_LIGHT_CORE: f32 = 0.35;

/// The game's dynamic lights as small spheres, those along a line as capsules.
///
/// The engine gives a light a reach `r` and a colour; its classic look adds about the whole colour up to half the reach
/// and fades to nothing at `r`. Here light falls off with the square of the distance, strong enough that a white
/// surface that faces it at half the reach shows the light's colour: intensity = colour * pi * (r / 2)². Colours are as
/// displayed, so they are decoded. `scale`: the radiance that shows as white.
///
/// In the game this light comes from gas: muzzle flashes, explosions, missile trails. Outside of a uniformly glowing
/// transparent ball of radius `a`, a facing surface receives intensity / d², as from a point (Gauss's theorem, with the
/// whole ball above the horizon); inside, at most about intensity / a², because gas behind the surface does not light
/// it. Therefore light is constant within 0.35 of the reach: twice the light's colour. The classic look multiplies the
/// displayed colour by up to one more than the light's colour: dark walls at a muzzle flash get less light there than
/// here, lit floors more.
///
/// A line of length L and total intensity I gives a surface that faces its middle at distance h the irradiance
/// I / (h sqrt(h² + L²/4)), the integral of cos / d² along it. So that it also shows the light's colour at half the
/// reach, its intensity is that of a light at a point times sqrt(1 + (L / 2h)²).
pub fn dynamic_lights(lights: &[DynamicLight], scale: f32) -> Vec<t::SphereLight> {
    lights
        .iter()
        .filter(|light| {
            light.radius > 0.0
                && light.radius.is_finite()
                && light.origin.is_finite()
                && light.end.is_none_or(Vec3::is_finite)
                && light.color.is_finite()
        })
        .map(|light| {
            let half = light.radius * 0.5;
            let color = decode(light.color.max(Vec3::ZERO));
            let (part, min, max) = DYNAMIC_LIGHT_SIZE;
            let radius = (light.radius * part).clamp(min, max);
            let line = (light.end.unwrap_or(light.origin) - light.origin) * 0.5;
            let half_length = Some(line.length()).filter(|&length| length > 0.5);
            let stretch = (1.0 + (line.length() / half).powi(2)).sqrt();
            let strength = (PI * half * half * scale * stretch).min(STRONGEST);
            let intensity = (color * strength).min(Vec3::splat(STRONGEST));
            let at_middle = sphere(
                light.origin + line,
                radius,
                intensity,
                DYNAMIC_LIGHT_CLEARANCE,
            );
            t::SphereLight {
                core: light.radius * DYNAMIC_LIGHT_CORE,
                axis: half_length.map_or(at_middle.axis, |length| line / length),
                half_length: half_length.unwrap_or(0.0),
                ..at_middle
            }
        })
        .collect()
}

/// Position of the flashlight: right of and below the camera, units. From the camera's own position its shadows would
/// be hidden behind their casters.
const FLASHLIGHT_PLACE: (f32, f32) = (6.0, 6.0);

/// Radius of the flashlight, units.
const FLASHLIGHT_RADIUS: f32 = 1.5;

/// Distance, units, at which a facing white surface shows the flashlight's own colour.
const FLASHLIGHT_REACH: f32 = 384.0;

/// Colour of the flashlight, linear: a warm white.
const FLASHLIGHT_COLOR: Vec3 = Vec3::new(1.0, 0.93, 0.8);

/// Half angles of its cone, degrees: full light inside the first, none outside the second.
const FLASHLIGHT_ANGLES: (f32, f32) = (9.0, 24.0);

/// Geometry closer than this, units, casts no shadow: the model of the player who holds the flashlight, which only
/// mirrors show.
const FLASHLIGHT_CLEARANCE: f32 = 40.0;

/// The flashlight of a view. `white`: radiance that is shown as white.
fn flashlight(view: &View, white: f32) -> t::SphereLight {
    let [forward, left, up] = view.axis;
    let (right, down) = FLASHLIGHT_PLACE;
    let origin = view.origin - left * right - up * down;
    let intensity = FLASHLIGHT_COLOR * (white * PI * FLASHLIGHT_REACH * FLASHLIGHT_REACH);
    let (inner, outer) = FLASHLIGHT_ANGLES;
    t::SphereLight {
        axis: forward,
        cos_inner: inner.to_radians().cos(),
        cos_outer: outer.to_radians().cos(),
        ..sphere(origin, FLASHLIGHT_RADIUS, intensity, FLASHLIGHT_CLEARANCE)
    }
}

/// Decodes a display-encoded colour to linear, as `shaders/trace/color.glsl` does.
pub fn decode(c: Vec3) -> Vec3 {
    c.map(relight::overbright::to_linear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dynamic_lights_are_finite_for_any_input() {
        let light = |radius, color| DynamicLight {
            radius,
            color,
            ..DynamicLight::default()
        };
        let asked = [
            light(200.0, Vec3::ONE),
            light(1.0e30, Vec3::new(1.0, 0.0, 0.0)),
            light(200.0, Vec3::splat(1.0e30)),
            light(f32::INFINITY, Vec3::ONE),
            light(200.0, Vec3::NAN),
            light(-1.0, Vec3::ONE),
        ];
        let made = dynamic_lights(&asked, 100.0);
        assert_eq!(made.len(), 3);
        for light in made {
            let strength = light.radiance;
            assert!(strength.length_squared().is_finite(), "{strength}");
            assert!(strength.x > 0.0, "{strength}");
        }
    }

    #[test]
    fn a_light_along_a_line_shows_its_colour_at_half_its_reach() {
        for length in [0.0, 30.0, 200.0, 700.0] {
            let light = DynamicLight {
                radius: 100.0,
                color: Vec3::ONE,
                end: Some(Vec3::X * length),
                ..DynamicLight::default()
            };
            let made = dynamic_lights(&[light], 1.0).remove(0);
            let receiver = Vec3::new(length * 0.5, 50.0, 0.0);
            assert_eq!(made.origin, receiver.with_y(0.0));
            let line = made.axis * made.half_length;
            let intensity = made.radiance.x * PI * made.radius * made.radius;
            let parts = (0..1000).map(|i| (i as f32 + 0.5) / 500.0 - 1.0);
            let falloff = parts.map(|part| {
                let to = made.origin + line * part - receiver;
                50.0 / to.length().powi(3)
            });
            let irradiance = intensity * falloff.sum::<f32>() / 1000.0;
            assert!(
                (irradiance / PI - 1.0).abs() < 0.001,
                "{length}: {irradiance}"
            );
        }
    }
}
