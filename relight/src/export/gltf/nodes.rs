//! Nodes of a glTF: models, entities, cameras, lights, fog.

use crate::export::model_file::{self, ModelName};
use crate::export::{Export, extras};
use crate::light::{PointLight, SunLight};
use crate::viewpoints::{self, is_spawn_point};
use glam::{EulerRot, Quat, Vec3};
use q3bsp::Entity;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::f32::consts::FRAC_PI_2;

/// Vertical field of view of the game's 90 degrees at 4:3, radians.
const VIEW: f32 = 1.287_002_2;

/// A direction or place of the map in glTF's axes.
pub fn turn(v: Vec3) -> Vec3 {
    Vec3::new(v.x, v.z, -v.y)
}

/// The nodes of a scene.
#[derive(Default)]
pub struct Nodes {
    /// All nodes.
    pub nodes: Vec<Value>,
    /// All cameras.
    pub cameras: Vec<Value>,
    /// All lights.
    pub lights: Vec<Value>,
}

impl Nodes {
    /// Adds a node and returns its number.
    pub fn add(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Adds a node for every entity, and one for every model with a mesh that no entity has; `meshes` gives the mesh of
    /// a brush model, `files` that of a model file. Returns the numbers of those without a parent.
    pub fn add_entities(
        &mut self,
        source: &Export<'_>,
        meshes: &[Option<usize>],
        files: &BTreeMap<ModelName, usize>,
    ) -> Vec<usize> {
        let scale = source.options.scale;
        let entities = source.world.bsp.entities();
        let mut top = Vec::new();
        let mut placed = vec![false; meshes.len()];
        for (number, entity) in entities.iter().enumerate() {
            let class = entity.classname();
            let model = if number == 0 {
                Some(0)
            } else {
                entity.brush_model()
            };
            let mut node = Map::new();
            let name = match number {
                0 => class.to_owned(),
                _ => format!("{class}_{number}"),
            };
            node.insert("name".into(), json!(name));
            node.insert("extras".into(), extras::entity(entity));
            if let Some(origin) = entity
                .vec3("origin")
                .filter(|o| o.is_finite() && number > 0)
            {
                put_translation(&mut node, turn(origin) * scale);
            }
            if let Some(model) = model {
                if let Some(placed) = placed.get_mut(model) {
                    *placed = true;
                }
                if let Some(Some(mesh)) = meshes.get(model) {
                    node.insert("mesh".into(), json!(mesh));
                }
            } else {
                let rotation = facing(entity);
                let aim = self.camera_of(entity, &entities, rotation, scale, &name);
                put_rotation(&mut node, rotation);
                if let Some(camera) = aim {
                    node.insert("children".into(), json!([camera]));
                }
            }
            if number > 0 {
                self.put_models(&mut node, entity, files, &name);
            }
            let node = self.add(Value::Object(node));
            top.push(node);
        }
        for (model, (mesh, placed)) in meshes.iter().zip(placed).enumerate() {
            if let (Some(mesh), false) = (mesh, placed) {
                let name = if model == 0 {
                    "worldspawn".to_owned()
                } else {
                    format!("model.{model}")
                };
                top.push(self.add(json!({"name": name, "mesh": mesh})));
            }
        }
        top
    }

    /// Gives an entity's node the models of files that the entity names: the node itself the first, where nothing else
    /// would be stretched with it, else nodes below it.
    fn put_models(
        &mut self,
        node: &mut Map<String, Value>,
        entity: &Entity,
        files: &BTreeMap<ModelName, usize>,
        name: &str,
    ) {
        for (key, path) in model_file::named(entity) {
            let Some(mesh) = files.get(&ModelName::of(entity, path)) else {
                // The file of the model is missing or broken.
                continue;
            };
            let scale = stretch(entity);
            if !node.contains_key("mesh") && !node.contains_key("children") {
                node.insert("mesh".into(), json!(mesh));
                put_scale(node, scale);
                continue;
            }
            let mut below = Map::new();
            below.insert("name".into(), json!(format!("{name}_{key}")));
            below.insert("mesh".into(), json!(mesh));
            // two models of one entity are stretched alike
            if !node.contains_key("scale") {
                put_scale(&mut below, scale);
            }
            let below = self.add(Value::Object(below));
            if let Value::Array(children) = node.entry("children").or_insert(json!([])) {
                children.push(json!(below));
            }
        }
    }

    /// The camera of an entity that one looks from, as a child of its node.
    fn camera_of(
        &mut self,
        entity: &Entity,
        entities: &[Entity],
        rotation: Quat,
        scale: f32,
        name: &str,
    ) -> Option<usize> {
        let intermission = viewpoints::is_intermission(entity);
        if !intermission && !is_spawn_point(entity) {
            return None;
        }
        let origin = entity.vec3("origin").unwrap_or(Vec3::ZERO);
        // cameras look along -z, entities along x
        let mut turned = Quat::from_rotation_y(-FRAC_PI_2);
        let target = viewpoints::target(entity, entities).filter(|_| intermission);
        let aim = target.map(|t| turn(t - origin).normalize_or_zero());
        if let Some(aim) = aim.filter(|a| a.is_finite() && *a != Vec3::ZERO) {
            let yaw = (-aim.x).atan2(-aim.z);
            let pitch = aim.y.clamp(-1.0, 1.0).asin();
            let world = Quat::from_euler(EulerRot::YXZ, yaw, pitch, 0.0);
            turned = rotation.inverse() * world;
        }
        self.cameras.push(json!({
            "type": "perspective",
            "name": name,
            "perspective": {"yfov": VIEW, "znear": 4.0 * scale},
        }));
        let mut node = Map::new();
        node.insert("name".into(), json!(format!("{name}_camera")));
        node.insert("camera".into(), json!(self.cameras.len() - 1));
        if !intermission {
            let height = viewpoints::SPAWN_LIFT + viewpoints::VIEW_HEIGHT;
            put_translation(&mut node, Vec3::Y * (height * scale));
        }
        put_rotation(&mut node, turned);
        Some(self.add(Value::Object(node)))
    }

    /// Adds a node with all lights below it; `None` when there are none.
    pub fn add_lights(&mut self, source: &Export<'_>) -> Option<usize> {
        let scale = source.options.scale;
        let exposure = source.exposure();
        let world = source.world;
        let mut children = Vec::new();
        for (number, light) in world.point_lights.iter().enumerate() {
            children.extend(self.add_point(number, light, scale, exposure));
        }
        for (number, sun) in world.suns.iter().enumerate() {
            children.extend(self.add_sun(number, sun, exposure));
        }
        (!children.is_empty()).then(|| self.add(json!({"name": "lights", "children": children})))
    }

    fn add_point(
        &mut self,
        number: usize,
        light: &PointLight,
        scale: f32,
        exposure: f32,
    ) -> Option<usize> {
        let (color, strength) = color_and_strength(light.intensity * exposure)?;
        let mut node = Map::new();
        let name = format!("light.{number}");
        let mut out = json!({
            "name": name,
            "color": color,
            // light falls off with the square of a distance that is `scale` times as long
            "intensity": strength * scale * scale,
            "type": "point",
        });
        put_translation(&mut node, turn(light.origin) * scale);
        if let (Some(pulse), Value::Object(map)) = (light.pulse, &mut out) {
            // the format's lights do not change: this one has its mean strength
            let strength = extras::style_strength(pulse.strength());
            map.insert("extras".into(), json!({ "strength": strength }));
        }
        if let (Some(reach), Value::Object(map)) = (light.falloff.reach(), &mut out) {
            // the format has no linear falloff, but an end
            map.insert("range".into(), json!(reach * scale));
        }
        if let (Some(spot), Value::Object(map)) = (light.spot, &mut out) {
            let outer = spot.tan_half_angle.atan().clamp(1.0e-3, FRAC_PI_2);
            map.insert("type".into(), json!("spot"));
            map.insert(
                "spot".into(),
                json!({"innerConeAngle": outer * 0.8, "outerConeAngle": outer}),
            );
            put_rotation(
                &mut node,
                Quat::from_rotation_arc(Vec3::NEG_Z, turn(spot.direction)),
            );
        }
        Some(self.add_light(out, node, name))
    }

    fn add_sun(&mut self, number: usize, sun: &SunLight, exposure: f32) -> Option<usize> {
        let (color, strength) = color_and_strength(sun.irradiance * exposure)?;
        let name = format!("sun.{number}");
        let mut node = Map::new();
        let out = json!({
            "name": name,
            "color": color,
            "intensity": strength,
            "type": "directional",
            "extras": {"angularRadius": sun.angular_radius},
        });
        put_rotation(
            &mut node,
            Quat::from_rotation_arc(Vec3::NEG_Z, -turn(sun.direction)),
        );
        Some(self.add_light(out, node, name))
    }

    fn add_light(&mut self, light: Value, mut node: Map<String, Value>, name: String) -> usize {
        self.lights.push(light);
        let number = self.lights.len() - 1;
        node.insert("name".into(), json!(name));
        node.insert(
            "extensions".into(),
            json!({"KHR_lights_punctual": {"light": number}}),
        );
        self.add(Value::Object(node))
    }

    /// Adds a node for every fog volume, in its middle.
    pub fn add_fogs(&mut self, source: &Export<'_>) -> Vec<usize> {
        let scale = source.options.scale;
        let fogs = source.world.fogs.iter().enumerate();
        fogs.map(|(number, fog)| {
            let volume = &fog.volume;
            let mut node = Map::new();
            node.insert("name".into(), json!(format!("fog.{number}")));
            put_translation(&mut node, turn((volume.mins + volume.maxs) * 0.5) * scale);
            node.insert(
                "extras".into(),
                json!({"fog": {
                    "shader": volume.shader,
                    "color": extras::vector(fog.color),
                    "depth": fog.depth,
                    "mins": extras::vector(volume.mins),
                    "maxs": extras::vector(volume.maxs),
                    "surface": volume.surface.map(|plane| {
                        json!({"normal": extras::vector(plane.normal), "dist": plane.dist})
                    }),
                }}),
            );
            self.add(Value::Object(node))
        })
        .collect()
    }
}

/// A colour whose largest channel is 1, and what it was divided by; `None` for darkness.
fn color_and_strength(light: Vec3) -> Option<([f32; 3], f32)> {
    let strength = light.max_element();
    (strength > 0.0 && strength.is_finite())
        .then(|| ((light / strength).max(Vec3::ZERO).to_array(), strength))
}

/// How an entity is turned: `angles`, or `angle`, where -1 is up and -2 down.
pub fn facing(entity: &Entity) -> Quat {
    let angles = match (entity.vec3("angles"), entity.number("angle")) {
        (Some(angles), _) => angles,
        (None, Some(-1.0)) => Vec3::new(-90.0, 0.0, 0.0),
        (None, Some(-2.0)) => Vec3::new(90.0, 0.0, 0.0),
        (None, Some(yaw)) => Vec3::new(0.0, yaw, 0.0),
        (None, None) => Vec3::ZERO,
    };
    if !angles.is_finite() {
        return Quat::IDENTITY;
    }
    let [pitch, yaw, roll] = angles.to_array().map(|a| (a % 360.0).to_radians());
    // pitch is down: about the map's y, which is glTF's -z
    Quat::from_rotation_y(yaw) * Quat::from_rotation_z(-pitch) * Quat::from_rotation_x(roll)
}

/// How an entity's model is stretched, in glTF's axes: `modelscale_vec`, or `modelscale`.
fn stretch(entity: &Entity) -> Vec3 {
    let all = entity.number("modelscale").map(Vec3::splat);
    let usable = |v: &Vec3| v.is_finite() && v.abs().min_element() > 0.0;
    let scale = entity.vec3("modelscale_vec").filter(usable);
    let scale = scale.or(all.filter(usable)).unwrap_or(Vec3::ONE);
    Vec3::new(scale.x, scale.z, scale.y)
}

fn put_scale(node: &mut Map<String, Value>, v: Vec3) {
    if v != Vec3::ONE {
        node.insert("scale".into(), json!(v.to_array()));
    }
}

fn put_translation(node: &mut Map<String, Value>, v: Vec3) {
    if v != Vec3::ZERO && v.is_finite() {
        node.insert("translation".into(), json!(v.to_array()));
    }
}

fn put_rotation(node: &mut Map<String, Value>, q: Quat) {
    let q = q.normalize();
    if q != Quat::IDENTITY && q.is_finite() {
        node.insert("rotation".into(), json!(q.to_array()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entities_look_where_the_game_looks() {
        let entity = |key: &str, value: &str| Entity {
            pairs: vec![(key.to_owned(), value.to_owned())],
        };
        let looks = |e: &Entity| facing(e) * Vec3::X;
        let near = |a: Vec3, b: Vec3| assert!((a - b).length() < 1.0e-5, "{a} {b}");
        near(looks(&entity("angle", "90")), turn(Vec3::Y));
        near(looks(&entity("angle", "-1")), turn(Vec3::Z));
        near(looks(&entity("angle", "-2")), turn(Vec3::NEG_Z));
        near(looks(&entity("angles", "90 0 0")), turn(Vec3::NEG_Z));
        near(looks(&entity("angles", "0 180 30")), turn(Vec3::NEG_X));
        let left = facing(&entity("angle", "90")) * turn(Vec3::Y);
        near(left, turn(Vec3::NEG_X));
    }
}
