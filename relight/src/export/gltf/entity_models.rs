//! Models that entities name: each a mesh, once, however many nodes refer to it.

use super::moving::{Lighting, look_in, make_moving};
use super::nodes::{facing, turn};
use super::primitive::primitive;
use super::{Document, Made};
use crate::export::ExportError;
use crate::export::geometry::{Drawn, drawn};
use crate::export::layers::Layer;
use crate::export::model_file::{self, ModelName, ModelSurface};
use crate::overbright;
use crate::world::{RelitWorld, WorldMaterial, WorldVertex};
use glam::{Quat, Vec3};
use q3bsp::{GridPoint, LightGridLayout};
use serde_json::json;
use shaderscript::{ImplicitKind, RgbGen};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

/// Part of the grid's light from everywhere that the engine gives to models (`r_ambientScale`).
const AMBIENT: f32 = 0.6;
/// Light from everywhere that the engine adds to it, of 255.
const LEAST: f32 = 32.0;

/// What was added.
#[derive(Default)]
pub struct EntityModels {
    /// The mesh of each file with each skin.
    pub meshes: BTreeMap<ModelName, usize>,
    /// Triangles of all meshes, each once.
    pub triangles: usize,
    /// Triangles left out.
    pub degenerate: usize,
    /// Vertices of all meshes, each once.
    pub vertices: usize,
}

/// Where a file's model stands.
struct Use {
    /// The entity's number and class.
    first: String,
    /// Origin in the map, and how it is turned, in glTF's axes.
    places: Vec<(Vec3, Quat)>,
}

impl Document<'_> {
    /// Adds a mesh for every model file that entities name; a file that cannot be read is a warning. `shown`: whether
    /// materials are to need no light.
    pub fn add_entity_models(&mut self, shown: bool) -> Result<EntityModels, ExportError> {
        let mut out = EntityModels::default();
        let mut made: BTreeMap<String, Option<Made>> = BTreeMap::new();
        let grid = shown.then(|| Grid::new(self.source.world)).flatten();
        for (model, used) in uses(self.source.world) {
            let path = &model.path;
            let surfaces = match model_file::read(self.source.files, &model) {
                Ok((surfaces, trouble)) => {
                    let line = trouble.map(|t| format!("{path}: the skin of {}: {t}", used.first));
                    self.warnings.extend(line);
                    surfaces
                }
                Err(problem) => {
                    let others = match used.places.len() - 1 {
                        0 => String::new(),
                        more => format!(" and {more} more"),
                    };
                    self.warnings.push(format!(
                        "{path}: the model of {}{others} is left out: {problem}",
                        used.first
                    ));
                    continue;
                }
            };
            let mut primitives = Vec::new();
            for surface in &surfaces {
                out.degenerate += surface.degenerate;
                let light = grid.as_ref().map(|g| g.light(surface, &used.places));
                let name = surface.shader.to_ascii_lowercase();
                let material = match made.entry(name) {
                    Entry::Occupied(known) => known.into_mut(),
                    Entry::Vacant(place) => {
                        let material =
                            self.entity_material(&surface.shader, shown, light.as_deref())?;
                        place.insert(material)
                    }
                };
                let Some(material) = material.as_ref() else {
                    continue; // not drawn
                };
                let part = &surface.part;
                if part.indices.is_empty() {
                    continue;
                }
                out.triangles += part.indices.len() / 3;
                out.vertices += part.vertices.len();
                primitives.push(primitive(
                    &mut self.buffers,
                    self.source,
                    part,
                    light.as_deref().filter(|_| material.shaded),
                    &material.look,
                    material.number,
                ));
            }
            if !primitives.is_empty() {
                let extras = match &model.skin {
                    Some(skin) => json!({"file": path, "skin": skin}),
                    None => json!({"file": path}),
                };
                self.meshes
                    .push(json!({"name": path, "primitives": primitives, "extras": extras}));
                out.meshes.insert(model, self.meshes.len() - 1);
            }
        }
        Ok(out)
    }

    /// Adds a material of models; `None` for one that is not drawn. `light`: for each vertex of a surface with it.
    fn entity_material(
        &mut self,
        name: &str,
        shown: bool,
        light: Option<&[Vec3]>,
    ) -> Result<Option<Made>, ExportError> {
        let source = self.source;
        let kind = ImplicitKind::EntityLit;
        let material = WorldMaterial::by_name(source.files, source.materials, name, kind);
        if drawn(&material) != Drawn::Yes {
            return Ok(None);
        }
        if let Some(fault) = &material.resolved.fault {
            self.warnings.push(format!("material {name}: {fault}"));
        }
        let mut stages = material.resolved.shader.stages.iter();
        let lit = stages.any(|stage| stage.rgb_gen == RgbGen::LightingDiffuse);
        let mean = shown.then(|| {
            // White where no light is known.
            let light = light.filter(|_| lit).unwrap_or_default();
            let mean = light.iter().sum::<Vec3>() / light.len() as f32;
            if mean.is_finite() { mean } else { Vec3::ONE }
        });
        let lighting = Lighting {
            radiance: None,
            shown: mean,
        };
        let layer = Layer::only(&material);
        let (mut look, multiplied) = look_in(source, &layer, lighting);
        let shaded = shown && multiplied && lit;
        let pulse = make_moving(source, &layer, lighting, &mut look, None);
        let number = self.add_material(&layer, &look, pulse.as_ref())?;
        let lost = look.lost.iter();
        self.warnings
            .extend(lost.map(|l| format!("material {name}: {l}")));
        Ok(Some(Made {
            number,
            look,
            shaded,
        }))
    }
}

/// Which entities name which file.
fn uses(world: &RelitWorld) -> BTreeMap<ModelName, Use> {
    let mut out: BTreeMap<ModelName, Use> = BTreeMap::new();
    for (number, entity) in world.bsp.entities().iter().enumerate().skip(1) {
        let models: BTreeSet<ModelName> = model_file::named(entity)
            .map(|(_, path)| ModelName::of(entity, path))
            .collect();
        for model in models {
            let used = out.entry(model).or_insert_with(|| Use {
                first: format!("entity {number} ({})", entity.classname()),
                places: Vec::new(),
            });
            let rotation = match entity.brush_model() {
                Some(_) => Quat::IDENTITY,
                None => facing(entity),
            };
            let origin = entity.vec3("origin").unwrap_or(Vec3::ZERO);
            used.places.push((origin, rotation));
        }
    }
    out
}

/// The light grid, as models are lit by it.
struct Grid {
    layout: LightGridLayout,
    points: Vec<GridPoint>,
}

impl Grid {
    /// The grid of a map; `None` for one without.
    fn new(world: &RelitWorld) -> Option<Grid> {
        let layout = world.bsp.light_grid()?;
        let shift = |rgb| overbright::shift(rgb, world.overbright_shift);
        let points = world.bsp.light_grid.iter().map(|point| GridPoint {
            ambient: shift(point.ambient),
            directed: shift(point.directed),
            ..*point
        });
        Some(Grid {
            layout,
            points: points.collect(),
        })
    }

    /// The light of each vertex, linear: the mean of what it has at all places, since these share it.
    fn light(&self, surface: &ModelSurface, places: &[(Vec3, Quat)]) -> Vec<Vec3> {
        let samples: Vec<_> = places
            .iter()
            .filter_map(|&(origin, rotation)| {
                let sample = self.layout.sample(&self.points, origin)?;
                // towards the light, in the model's space
                let direction = rotation.inverse() * turn(sample.direction);
                Some((sample.ambient * AMBIENT + LEAST, sample.directed, direction))
            })
            .collect();
        let of_vertex = |v: &WorldVertex| {
            if samples.is_empty() {
                return Vec3::ONE;
            }
            let normal = turn(v.normal);
            let all = samples.iter().map(|&(ambient, directed, direction)| {
                let encoded = ambient + directed * normal.dot(direction).max(0.0);
                overbright::colour_to_linear((encoded / 255.0).clamp(Vec3::ZERO, Vec3::ONE))
            });
            all.sum::<Vec3>() / samples.len() as f32
        };
        surface.part.vertices.iter().map(of_vertex).collect()
    }
}
